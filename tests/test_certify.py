"""What is proved holds, what is refuted is not reached, and sizes lie between their bounds."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import INTERPRETED
from links import distances_of_pairs, struts
from machines.closure import ON_ARMS
from machines.redescribed import moved, relabelled, scaled
from pfabrik import PoseRegion, Status
from pfabrik.capabilities.certify.following import what_follows
from pfabrik.capabilities.certify.pose_region import rounded
from pfabrik.capabilities.certify.subdividing import Subdividing, first_cells, region_parameters, units_of
from pfabrik.cli import main
from pfabrik.engines.pose.table import kernel_table
from pfabrik.kernels.certify.affine_forms import ABOVE, BELOW, CENTRE
from pfabrik.kernels.certify.implicit_pose import put_pose
from pfabrik.kernels.certify.limit_rows import first_link_row, first_reach_row, put_limits
from pfabrik.kernels.certify.pose_cells import ROTATION_VECTOR, CellParameters, put_cell
from pfabrik.kernels.certify.prove import new_rows
from pfabrik.kinematics import parallel_signs
from pfabrik.machine.files import loads
from pfabrik.machine.model import model_of

CATALOG = Path(pf.__file__).parent / "machine" / "catalog"
CENTRE_OF_STEWART = np.array([0.0, 0.0, 210.0])
ROD_OF_ORTHOGLIDE = 310.582854123025
# Machines whose legs leave the region of positions at home's orientation free, and the axes that they move along.
POSITIONED = {
    "stewart": (1, 1, 1),
    "servo_hexapod": (1, 1, 1),
    "hexaglide": (1, 1, 1),
    "reachy_mini": (1, 1, 1),
    "ucu": (1, 1, 1),
    "delta": (1, 1, 1),
    "linear_delta": (1, 1, 1),
    "orthoglide": (1, 1, 1),
    "psu": (1, 1, 1),
    "five_bar": (0, 1, 1),
    "rpr": (1, 1, 0),
    "rrr": (1, 1, 0),
    "prr": (1, 1, 0),
}
PLANAR = ("rpr", "rrr", "prr")


def box_about(centre: np.ndarray, half: float, degrees: float = 0.0) -> PoseRegion:
    return PoseRegion.box(centre - half, centre + half, rotation=math.radians(degrees))


def stewart_box(half: float, degrees: float) -> PoseRegion:
    return box_about(CENTRE_OF_STEWART, half, degrees)


def thick_struts(size: float = 1.0) -> pf.Mechanism:
    """With long strokes, so that links are what comes first."""
    return struts(20.0, 4.0, stroke=(100.0, 400.0), size=size)


def box_of_struts(half: float, degrees: float, size: float = 1.0) -> PoseRegion:
    return box_about(size * np.array([0.0, 0.0, 195.0]), size * half, degrees)


def random_region(name: str, rng: np.random.Generator) -> PoseRegion:
    """A region about a random pose near home, of a random shape where the machine has one."""
    machine = pf.load(name)
    L, axes = machine.characteristic_length, np.array(POSITIONED[name], float)
    centre = machine.home_pose[:3, 3] + axes * rng.uniform(-0.3, 0.3, 3) * L * rng.uniform()
    half = axes * rng.uniform(0.02, 0.4, 3) * L * rng.uniform() + 1e-3 * L * axes
    if "rotation" not in machine.task:
        return PoseRegion.box(centre - half, centre + half)
    turn = rng.uniform(0.0, 0.5, 3) * rng.uniform()
    if name in PLANAR:
        return PoseRegion.box(centre - half, centre + half, rotation=turn * (0.0, 0.0, 1.0))
    kind = rng.integers(3)
    if kind == 0:
        return PoseRegion.box(centre - half, centre + half, rotation=turn)
    if kind == 1:
        return PoseRegion.ball(centre, half.max(), tilt=turn[0], yaw=[-turn[2], turn[2]])
    return PoseRegion.cylinder(centre, half.max(), 2.0 * half.min(), rotation=turn)


def random_poses(region: PoseRegion, n: int, rng: np.random.Generator) -> np.ndarray:
    """Random poses of a region, many of them on its sides and edges."""
    points = rng.uniform(region.low, region.high, (n, 6))
    is_end = rng.random(points.shape) < 0.3
    points = np.where(is_end, np.where(rng.random(points.shape) < 0.5, region.low, region.high), points)
    return region.pose(points[region.contains(points)])


def assert_holds(certificate: pf.Certificate, n: int, rng: np.random.Generator) -> None:
    """Random poses, and poses where the search went, agree with a verdict."""
    assert certificate.region is not None
    poses = random_poses(certificate.region, n, rng)
    if certificate.verdict == "REFUTED":
        assert certificate.refutation is not None
        assert pf.solve_ik(certificate.mechanism, certificate.refutation.pose).status == Status.PROJECTED
        assert certificate.refutation.margin < 0.0
    elif certificate and len(poses):
        assert (np.asarray(pf.solve_ik(certificate.mechanism, poses).status) == Status.REACHED).all()
        assert pf.feasibility(certificate.mechanism, poses).margin.min() >= certificate.margin - 1e-12


def test_a_stewart_platform_reaches_a_box_that_is_proved_and_not_a_slightly_larger_one() -> None:
    machine = pf.load("stewart")
    proved, refuted = (pf.certify(machine, stewart_box(*sizes)) for sizes in ((34.0, 7.5), (35.0, 8.0)))
    assert proved and proved.verdict == "PROVED" and not len(proved.open_boxes)
    assert refuted.verdict == "REFUTED" and refuted.refutation is not None
    assert refuted.refutation.limit[1] in ("min", "max") and refuted.refutation.answer.status == Status.PROJECTED
    for certificate in (proved, refuted):
        assert_holds(certificate, 5 if INTERPRETED else 20_000, np.random.default_rng(0))
    # The margin, from all corners of the box: they are the extremes here to a hundredth.
    corners = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 6, indexing="ij"), -1).reshape(-1, 6)
    region = stewart_box(34.0, 7.5)
    least = pf.feasibility(machine, region.pose(region.middle + corners * region.half)).margin.min()
    close = pf.certify(machine, region, tolerance=1e-3)
    assert least - 2e-3 <= close.margin <= least
    assert 0.0 <= proved.margin <= close.margin


def known_verdicts() -> Iterator[Any]:
    """Wherever a machine is, in any unit, and whatever its names; boxes at cones and ranges take few cells."""
    stewart, turn, away = (
        pf.load("stewart"),
        Rotation.from_rotvec([0.0, 0.0, 0.7]).as_matrix(),
        np.array([500, -300, 50]),
    )
    for radius, verdict in ((30.0, "PROVED"), (60.0, "REFUTED")):
        alike = {
            "moved": (moved(stewart, turn, away), CENTRE_OF_STEWART + away, 1.0),
            "scaled": (scaled(stewart, 1e-3), 1e-3 * CENTRE_OF_STEWART, 1e-3),
            "relabelled": (relabelled(stewart, np.random.default_rng(4))[0], CENTRE_OF_STEWART, 1.0),
        }
        for name, (machine, centre, size) in alike.items():
            ball = PoseRegion.ball(centre, size * radius, tilt=0.2)
            yield pytest.param(machine, ball, verdict, 200_000, id=f"{name} {verdict}")
    for half, degrees, verdict in ((25.0, 7.0, "PROVED"), (30.0, 24.0, "REFUTED")):
        small, there = box_of_struts(half, degrees, 1e-3), box_about(away + [0.0, 0.0, 195.0], half, degrees)
        yield pytest.param(thick_struts(1e-3), small, verdict, 200_000, id=f"links scaled {verdict}")
        yield pytest.param(moved(thick_struts(), np.eye(3), away), there, verdict, 200_000, id=f"links moved {verdict}")
    for name, half, degrees, cells in (("hexaglide", 15.0, 4.0, 20), ("servo_hexapod", 2.0, 0.5, 600)):
        machine = pf.load(name)
        yield pytest.param(machine, box_about(machine.home_pose[:3, 3], half, degrees), "PROVED", cells, id=name)


@pytest.mark.parametrize(("machine", "region", "verdict", "budget"), list(known_verdicts()))
def test_verdicts_are_known_and_hold(machine: pf.Mechanism, region: PoseRegion, verdict: str, budget: int) -> None:
    certificate = pf.certify(machine, region, budget=budget)
    assert certificate.verdict == verdict
    assert_holds(certificate, 3 if INTERPRETED else 1000, np.random.default_rng(5))


@pytest.mark.parametrize("name", POSITIONED)
def test_verdicts_on_random_regions_hold(name: str) -> None:
    rng, machine = np.random.default_rng(len(name)), pf.load(name)
    verdicts = set()
    for _ in range(1 if INTERPRETED else 10):
        certificate = pf.certify(machine, random_region(name, rng), budget=10 if INTERPRETED else 20_000)
        assert_holds(certificate, 3 if INTERPRETED else 1000, rng)
        verdicts.add(certificate.verdict)
    assert INTERPRETED or "PROVED" in verdicts


@pytest.mark.parametrize("name", ["stewart", "servo_hexapod", "hexaglide", "delta", "psu", "five_bar", "prr"])
def test_bounds_of_every_limit_enclose_its_values_on_random_cells(name: str) -> None:
    """The forms of all rows over a cell, against the forms at single poses of it, which depend on no bound."""
    machine, rng = pf.load(name), np.random.default_rng(1)
    model = model_of(machine)
    table = kernel_table(model.legs)
    sides, cell_rows, rows = model.legs.home_sides[0], new_rows(table), new_rows(table)
    n_checked = 0
    for _ in range(2 if INTERPRETED else 5):
        region = random_region(name, rng)
        parameters = region_parameters(model, region, 0.0)
        share = 10.0 ** rng.uniform(-3.0, -0.5)
        box = np.concatenate([parameters.middle, share * parameters.half])
        n = int(parameters.kinds[2])
        put_cell(parameters, box, cell_rows.cell)
        for s in rng.uniform(-1.0, 1.0, (6, 6)):
            put_cell(parameters, np.concatenate([box[:6] + s * box[6:], np.zeros(6)]), rows.cell)
            for k in np.unique(rows.owners[: first_link_row(table)]):
                put_limits(table, sides, 0.0, int(k), n, cell_rows)
                put_limits(table, sides, 0.0, int(k), n, rows)
            form, value = cell_rows.rows, rows.rows[:, CENTRE]
            linear = form[:, CENTRE] + form[:, :n] @ s[:n]
            # Angles are known but for whole turns, and rows of cells beside dead points hold where the rod reaches.
            is_known = np.isfinite(form[:, BELOW]) & np.isfinite(rows.rows[:, BELOW])
            is_known &= np.abs(value - form[:, CENTRE]) < 1.0
            first = 2 * len(table.limited) + len(table.cones)
            is_known[first:] = False
            excess = np.maximum(linear + form[:, BELOW] - value, value - linear - form[:, ABOVE])
            assert (excess[is_known] <= 1e-13).all(), name
            n_checked += int(is_known.sum())
    assert n_checked > 50 or not len(table.limited) + len(table.cones)


def test_rounding_stays_within_its_bound_far_from_the_origin() -> None:
    """Lengths of struts at single poses of a machine moved 1e4 lengths away, against extended precision."""
    stewart = pf.load("stewart")
    away = np.array([1.3e6, -0.7e6, 0.4e6])
    machine = moved(stewart, np.eye(3), away)
    model, rng = model_of(machine), np.random.default_rng(3)
    table, rows = kernel_table(model.legs), new_rows(kernel_table(model.legs))
    region = PoseRegion.box(CENTRE_OF_STEWART + away - 20, CENTRE_OF_STEWART + away + 20, rotation=0.2)
    parameters = region_parameters(model, region, 0.0)
    wide = np.longdouble
    for _ in range(30):
        point = parameters.middle + rng.uniform(-1, 1, 6) * parameters.half
        put_cell(parameters, np.concatenate([point, np.zeros(6)]), rows.cell)
        r = point[3:].astype(wide)
        angle = np.sqrt((r * r).sum())
        K = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]], dtype=wide)
        R = np.eye(3, dtype=wide) + np.sin(angle) / angle * K + (1 - np.cos(angle)) / angle**2 * (K @ K)
        for limit, coordinate in enumerate(table.limited):
            leg = table.legs[coordinate["leg"]]
            put_limits(table, model.legs.home_sides[0], 0.0, int(coordinate["leg"]), 6, rows)
            v = R @ leg["platform_end_point"].astype(wide) + point[:3].astype(wide)
            v = v - leg["base_end_point"].astype(wide)
            exact = np.sqrt((v * v).sum()) - wide(leg["length"]) - wide(coordinate["lo"])
            row = rows.rows[2 * limit]
            error = abs(float(exact - wide(row[CENTRE])))
            assert error <= -row[BELOW] and error <= row[ABOVE]
            assert -row[BELOW] < 1e-8  # and it is still a bound of use
    assert pf.certify(machine, PoseRegion.ball(CENTRE_OF_STEWART + away, 20.0, tilt=0.1))


def test_a_leg_in_another_working_mode_is_neither_proved_nor_refuted() -> None:
    machine = pf.load("five_bar").without_limits().with_limits(p1=(-3.0, 0.1))
    region = PoseRegion.box([0, -5, 125], [0, 5, 135])
    pose = [0.0, 0.0, 130.0]
    assert pf.feasibility(machine, pose).margin < 0.0 and pf.solve_ik(machine, pose).status == Status.REACHED
    certificate = pf.certify(machine, region)
    assert certificate.verdict == "OPEN" and "another working mode" in certificate.reason


def test_every_pose_between_the_steps_of_a_track_counts() -> None:
    machine = pf.load("stewart")
    s = np.linspace(0.0, 2.0 * np.pi, 12 if INTERPRETED else 1001)
    circle = np.stack([30 * np.cos(s), 30 * np.sin(s), 210 + 10 * np.sin(3 * s)], axis=-1)
    track = pf.track(machine, pf.pose(circle, rpy=np.stack([0.1 * np.cos(s), 0.1 * np.sin(s), 0 * s], axis=-1)))
    proved = pf.certify(machine, track)
    assert proved and proved.replay()
    # Ends that are reached, on either side of what is too near to a crank's axis: less than 145 - 110.
    machine = pf.load("five_bar").without_limits()
    beside, across = ([[0.0, y, 60.0], [0.0, y, -60.0]] for y in (-90.0, -50.0))
    assert (np.asarray(pf.solve_ik(machine, across).status) == Status.REACHED).all()
    refuted = pf.certify(machine, across).refutation
    assert refuted is not None and np.hypot(refuted.pose[1, 3] + 50.0, refuted.pose[2, 3]) < 35.0
    assert pf.certify(machine, beside)


def test_an_orthoglide_fills_what_three_cylinders_share_and_a_five_bar_two_rings() -> None:
    """Steinmetz's solid, 8 (2 - sqrt 2) l^3; and two circular rings, by their integral."""
    accuracy = 0.3 if INTERPRETED else 1e-3
    volume = 8.0 * (2.0 - math.sqrt(2.0)) * ROD_OF_ORTHOGLIDE**3
    orthoglide = enclosure_of(pf.load("orthoglide").without_limits(), ("x", "y", "z"), accuracy)
    assert orthoglide.lower <= volume <= orthoglide.upper <= (1.0 + accuracy) * orthoglide.lower
    five_bar = enclosure_of(pf.load("five_bar").without_limits(), ("y", "z"), 0.1 * accuracy)
    assert five_bar.lower <= 145_913.8687 <= five_bar.upper <= (1.0 + 0.1 * accuracy) * five_bar.lower
    sides = np.prod(five_bar.inside[:, 1] - five_bar.inside[:, 0], axis=1)
    assert sides.sum() <= five_bar.lower
    machine = pf.load("five_bar").without_limits()
    boxes = five_bar.inside[np.argsort(-sides)[:200]]
    corners = np.concatenate([boxes[:, 0], boxes[:, 1]])
    assert (pf.feasibility(machine, np.insert(corners, 0, 0.0, axis=1)).margin >= 0.0).all()


def enclosure_of(machine: pf.Mechanism, names: tuple[str, ...], accuracy: float) -> pf.Enclosure:
    from pfabrik.capabilities.certify.enclosure import COORDINATES, enclose

    held = dict(zip(COORDINATES, [*machine.home_pose[:3, 3], 0.0, 0.0, 0.0], strict=True))
    ends = np.full(len(names), np.inf)
    return enclose(model_of(machine), names, held, np.eye(3), (-ends, ends), accuracy=accuracy, budget=2_000_000)


@pytest.mark.skipif(INTERPRETED, reason="maps take long as plain Python")
def test_a_certified_workspace_has_its_size_between_two_bounds() -> None:
    space = pf.workspace(pf.load("five_bar"), resolution=2, certified=1e-3)
    enclosure = space.enclosure
    assert enclosure is not None and enclosure.upper <= 1.001 * enclosure.lower
    assert enclosure.lower - space.uncertainty <= space.area <= enclosure.upper + space.uncertainty
    assert space.to_dict()["enclosure"]["lower"] == enclosure.lower
    every = np.concatenate([enclosure.inside, enclosure.border])
    inside = np.all(
        (space.vertices[:, None] >= every[:, 0] - 1e-9) & (space.vertices[:, None] <= every[:, 1] + 1e-9), -1
    )
    assert inside.any(axis=1).all()


@pytest.mark.skipif(INTERPRETED, reason="maps take long as plain Python")
def test_the_largest_box_is_proved_and_a_larger_one_is_not() -> None:
    machine = pf.load("five_bar")
    found = pf.largest(machine, "box", accuracy=0.01)
    assert found.certificate and found.certificate.replay()
    half = 0.5 * 1.02 * found.extents
    assert not pf.certify(machine, PoseRegion.box(found.centre - half, found.centre + half))
    tripod = pf.load("rps")
    tall = pf.largest(tripod, "box", centre=tripod.home_pose[:3, 3], extents=[0, 0, 40], tilt=0.2, accuracy=0.01)
    assert tall.certificate and tall.certificate.replay()
    assert not pf.certify(tripod, tilts(tripod, 0.5 * 1.02 * tall.extents[2])(0.2))
    ball = pf.largest(pf.load("stewart"), "ball", centre=CENTRE_OF_STEWART, extents=[60, 60, 60], tilt=0.2)
    assert ball.certificate and ball.certificate.region.shape == "ball"


def test_uncertain_points_are_proved_for_all_machines_near() -> None:
    machine, rng = pf.load("servo_hexapod"), np.random.default_rng(6)
    L = machine.characteristic_length
    region = box_about(machine.home_pose[:3, 3], 0.02 * L, 1.7)
    radius = 2e-3 * L
    assert pf.certify(machine, region, uncertain=radius)
    model = model_of(machine)
    points = model._geometry.points
    for _ in range(2 if INTERPRETED else 8):
        away = rng.normal(size=points.shape)
        away *= radius / np.linalg.norm(away, axis=1, keepdims=True)
        other = model.with_geometry(points=points + away).mechanism
        poses = random_poses(region, 5 if INTERPRETED else 200, rng)
        assert (np.asarray(pf.solve_ik(other, poses).status) == Status.REACHED).all()
    wide = pf.certify(machine, region, uncertain=0.2 * L, budget=500)
    assert wide.verdict == "OPEN"


def test_a_replay_sees_a_box_that_is_missing_or_too_large() -> None:
    machine = pf.load("stewart")
    certificate = pf.certify(machine, stewart_box(30.0, 7.5 if INTERPRETED else 9.0))
    assert certificate and certificate.replay()
    if len(certificate.boxes) > 1:
        assert not dataclasses.replace(certificate, _proved=certificate._proved[1:]).replay()
    widened = certificate._proved.copy()
    widened[:, 9:12] *= 2.0
    assert not dataclasses.replace(certificate, _proved=widened).replay()


def test_only_the_limits_of_named_joints_count() -> None:
    machine = pf.load("stewart")
    region = stewart_box(35.0, 8.0)
    cones = [joint.name for joint in machine.joints if joint.cone is not None]
    certificate = pf.certify(machine, region, limits=cones)
    assert certificate and all(not joint.range or joint.name in cones for joint in certificate.mechanism.joints)
    with pytest.raises(pf.errors.UnknownName):
        pf.certify(machine, region, limits=["no_such_joint"])


AT_HOME = np.zeros(3)


@pytest.mark.parametrize(
    ("error", "words", "ask"),
    [
        ("UnsupportedMechanism", "no legs in closed form", lambda: pf.certify(pf.load("panda"), box_about(AT_HOME, 1))),
        ("UnsupportedMechanism", "A1, B1", lambda: pf.certify(pf.load("nrpm"), box_about(AT_HOME, 1))),
        ("InvalidArgument", "rotation about x", lambda: pf.certify(pf.load("delta"), box_about(AT_HOME, 1, 6.0))),
        ("InvalidArgument", "expected", lambda: PoseRegion.box([0, 0, 1], [0, 0, 0])),
        ("InvalidArgument", "expected", lambda: PoseRegion.box([0, 0], [1, 1, 1])),
        ("InvalidArgument", "tilt", lambda: PoseRegion.ball([0, 0, 0], 1, tilt=0.1, rotation=0.1)),
        ("InvalidArgument", "budget", lambda: pf.certify(pf.load("stewart"), stewart_box(1, 1), budget=0)),
        ("InvalidArgument", "certified", lambda: pf.workspace(pf.load("stewart"), tilt=0.1, certified=True)),
        ("UnknownName", "cube", lambda: pf.largest(pf.load("five_bar"), "cube")),  # type: ignore[arg-type]
    ],
)
def test_what_cannot_be_certified_is_refused(error: str, words: str, ask: Callable[[], object]) -> None:
    with pytest.raises(getattr(pf.errors, error), match=words):
        ask()


def test_what_legs_restrict_without_bounds_is_open() -> None:
    """Legs on an arm that carries others; points that are uncertain; a task that legs do not leave."""
    ankle, arm = pf.load("ankle_ups"), ON_ARMS["R + 3-RPS + RR"]()
    whole = dataclasses.replace(pf.load("tricept"), task=("x", "y", "z", "rotation"))
    for machine, words, more in (
        (ankle, "uncertain", {"uncertain": 0.1}),
        (pf.load("rps"), "uncertain", {"uncertain": 0.1}),
        (arm, "turntable", {}),
        (whole, "restricts the platform", {}),
    ):
        at = machine.home_pose[:3, 3]
        half = 1.0 if machine is whole else 0.0
        certificate = pf.certify(machine, PoseRegion.box(at - half, at + half), budget=100, **more)
        assert certificate.verdict == "OPEN" and words in certificate.reason
    turns = pf.certify(ankle, PoseRegion.joints({"pivot[0]": (-0.1, 0.1)}), uncertain=0.1)
    assert turns.verdict == "OPEN" and "uncertain" in turns.reason


def test_the_command_says_what_the_function_says(tmp_path: Path) -> None:
    def said(*words: str) -> tuple[int, str]:
        result = CliRunner().invoke(main, ["certify", "stewart", *words])
        return result.exit_code, result.stdout + (result.stderr if result.exit_code == 2 else "")

    code, text = said("--box=-34:34,-34:34,176:244", "--rotation", "5")
    assert code == 0 and text.startswith("PROVED")
    code, text = said("--box=-35:35,-35:35,175:245", "--rotation", "8,8,8", "--json")
    refutation = json.loads(text)["refutation"]
    expected = pf.certify(pf.load("stewart"), stewart_box(35.0, 8.0)).refutation
    assert expected is not None
    assert code == 1 and (refutation["joint"], refutation["bound"]) == expected.limit
    assert np.allclose(refutation["pose"], expected.pose)
    code, text = said("--ball", "0,0,210,20", "--tilt", "5", "--yaw=-3:3")
    assert code == 0 and "margin at least" in text
    ankle = ("certify", "ankle_rss", "--joints", "pivot[0]=-10:10,pivot[1]=-8:8", "--singular")
    result = CliRunner().invoke(main, ankle)
    assert result.exit_code == 0 and "none is singular" in result.stdout
    path = tmp_path / "path.csv"
    path.write_text("x,y,z\n0,0,200\n10,0,205\n500,0,205\n", encoding="utf-8")
    code, text = said("--track", str(path))
    assert code == 1 and "not reached" in text
    for words in (("--tilt", "3"), ("--ball", "1,2,3"), ("--box", "1:2,3:4"), ("--track", str(path), "--tilt", "3")):
        code, text = said(*words)
        assert code == 2 and "certify" in text


# Coordinates that follow from the legs, and those of joints


def tilts(machine: pf.Mechanism, height: float = 0.0) -> Callable[[float], PoseRegion]:
    """Regions of tilts up to an angle [rad], within a height to either side of home's."""
    at, up = machine.home_pose[:3, 3], np.array([0.0, 0.0, height])
    return lambda tilt: PoseRegion.box(at - up, at + up, tilt=tilt)


def angles(machine: pf.Mechanism, **ends: tuple[float, float]) -> Callable[[float], PoseRegion]:
    """Regions of joint coordinates between shares of ends; `_` stands for what follows a name in brackets."""
    names = {name.replace("_0", "[0]").replace("_1", "[1]"): end for name, end in ends.items()}
    return lambda share: PoseRegion.joints({n: (share * a, share * b) for n, (a, b) in names.items()}).of(machine)


def own_ankle() -> pf.Mechanism:
    """Cranks of different lengths about oblique axes, a pivot whose axes are neither square nor along coordinates."""
    text = (CATALOG / "ankle_rss.toml").read_text(encoding="utf-8")
    text = text.replace("axes = [[0, 1, 0], [1, 0, 0]]", "axes = [[0.1, 1, 0.2], [1, 0.15, -0.1]]")
    text = text.replace("at = [-70, 40, 0]\ncone", "at = [-75, 43, 4]\ncone")
    return loads(text.replace("at = [-40, -40, 0]\naxis = [0, 1, 0]", "at = [-40, -40, 0]\naxis = [0.1, 1, -0.1]"))


def own_tripod() -> pf.Mechanism:
    """3-RRS: cranks with hinged rods, each of another length."""
    legs = []
    for i, (crank, top) in enumerate(((50.0, 60.0), (45.0, 66.0), (55.0, 55.0))):
        turn = Rotation.from_rotvec([0.0, 0.0, 2.0 * np.pi * i / 3.0])
        foot, elbow, head = turn.apply([[90.0, 0.0, 0.0], [90.0 + crank, 0.0, 20.0], [top, 0.0, 120.0]])
        axis = turn.apply([0.0, 1.0, 0.0])
        legs += [
            pf.Joint(f"A{i}", "revolute", ("base", f"crank{i}"), at=foot, axis=axis, actuated=True, range=(-0.8, 0.8)),
            pf.Joint(f"B{i}", "revolute", (f"crank{i}", f"rod{i}"), at=elbow, axis=axis, range=(-0.9, 0.9)),
            pf.Joint(f"C{i}", "spherical", (f"rod{i}", "platform"), at=head),
        ]
    return pf.Mechanism("own 3-RRS", legs, "platform", (0.0, 0.0, 120.0), task=("z", "tilt"))


def rotations(machine: pf.Mechanism) -> Callable[[float], PoseRegion]:
    at = machine.home_pose[:3, 3]
    return lambda half: PoseRegion.box(at, at, rotation=half)


def boxes(machine: pf.Mechanism) -> Callable[[float], PoseRegion]:
    return lambda half: box_about(machine.home_pose[:3, 3], half)


FOLLOWING: dict[str, tuple[pf.Mechanism, Callable[[float], PoseRegion], float]] = {
    name: (machine, make(machine), top)
    for name, machine, make, top in (
        ("3-RPS", pf.load("rps"), lambda m: tilts(m, 20.0), 1.0),
        ("3-PRS", pf.load("prs"), lambda m: tilts(m, 10.0), 1.0),
        ("Canfield", pf.load("canfield"), tilts, 1.0),
        ("3-RRS", own_tripod(), lambda m: tilts(m, 5.0), 1.0),
        ("2-UPS/U", pf.load("ankle_ups"), tilts, 1.0),
        ("2-RSS/U", pf.load("ankle_rss"), tilts, 1.0),
        ("G1", pf.load("g1_ankle"), tilts, 1.0),
        ("own ankle", own_ankle(), tilts, 1.0),
        ("Tricept", pf.load("tricept"), boxes, 120.0),
        ("agile eye", pf.load("agile_eye"), rotations, 1.0),
        ("2-UPS/U pivot", pf.load("ankle_ups"), lambda m: angles(m, pivot_0=(-0.4, 0.6), pivot_1=(-0.4, 0.4)), 1.5),
        ("2-RSS/U pivot", pf.load("ankle_rss"), lambda m: angles(m, pivot_0=(-0.3, 0.3), pivot_1=(-0.2, 0.2)), 1.5),
        ("G1 pivot", pf.load("g1_ankle"), lambda m: angles(m, pitch_joint=(-0.8, 0.5), roll_joint=(-0.2, 0.2)), 1.5),
        ("own ankle pivot", own_ankle(), lambda m: angles(m, pivot_0=(-0.3, 0.3), pivot_1=(-0.2, 0.2)), 1.5),
        ("Tricept pivot", pf.load("tricept"), lambda m: angles(m, D_0=(-0.5, 0.4), D_1=(-0.5, 0.5)), 1.5),
    )
}
"""Machines of which coordinates follow from the legs, or are joints', regions by size, a size beyond reach."""


def drawn_in(region: PoseRegion, n: int, rng: np.random.Generator) -> np.ndarray:
    """Parameters of a region, most of them on its border."""
    points = rng.uniform(region.low, region.high, (n, 6))
    is_end = rng.random(points.shape) < 0.5
    points = np.where(is_end, np.where(rng.random(points.shape) < 0.5, region.low, region.high), points)
    if region.turning == "tilt":
        angle, size = rng.uniform(-np.pi, np.pi, n), region.high[3] * np.sqrt(rng.random(n))
        size[: 3 * n // 4] = region.high[3]
        points[:, 3:5] = size[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1)
    return points


def border_by_brute_force(machine: pf.Mechanism, make: Any, top: float, n: int, rng: np.random.Generator) -> float:
    """The largest size of a region in which no random pose is beyond a limit, by bisection to a thousandth."""
    low, high = 0.0, top
    while high - low > 1e-3 * high:
        middle = 0.5 * (low + high)
        poses = make(middle).pose(drawn_in(make(middle), n, rng))
        margin = np.asarray(pf.feasibility(machine, poses).margin)
        beyond = poses[np.argsort(margin)[:4]][np.sort(margin)[:4] < -1e-9]
        is_beyond = len(beyond) and (np.asarray(pf.solve_ik(machine, beyond).status) != Status.REACHED).any()
        low, high = (low, middle) if is_beyond else (middle, high)
    return low


@pytest.mark.skipif(INTERPRETED, reason="thousands of cells take long as plain Python")
@pytest.mark.parametrize("name", FOLLOWING)
def test_tilts_are_proved_up_to_the_border_that_brute_force_finds(name: str) -> None:
    machine, make, top = FOLLOWING[name]
    rng = np.random.default_rng(len(name))
    border = border_by_brute_force(machine, make, top, 3000, rng)
    proved, refuted = (pf.certify(machine, make(share * border)) for share in (0.985, 1.01))
    assert proved and not len(proved.open_boxes) and refuted.verdict == "REFUTED"
    assert_holds_of(machine, make(0.985 * border), proved.margin, rng)
    refutation = refuted.refutation
    assert refutation is not None and pf.solve_ik(machine, refutation.pose).status == Status.PROJECTED


def test_a_tilted_region_is_replayed_and_says_what_it_is() -> None:
    for name in ("3-RPS", "2-UPS/U pivot"):
        machine, make, _ = FOLLOWING[name]
        certificate = pf.certify(machine, make(0.3))
        assert certificate and certificate.replay()
        fewer = dataclasses.replace(certificate, _proved=certificate._proved[1:])
        assert not fewer.replay()
        region = certificate.region
        assert region is not None and (certificate.boxes >= region.low - 1e-12).all()
        assert (certificate.boxes <= region.high + 1e-12).all()
    assert "pivot[0]" in repr(region)


@pytest.mark.parametrize("name", FOLLOWING)
def test_poses_of_a_cell_are_within_its_bounds(name: str) -> None:
    """Implicit coordinates and rows over random cells, against those at answers of `solve_ik`, and at single poses."""
    machine, make, _ = FOLLOWING[name]
    rng, model = np.random.default_rng(7), model_of(machine)
    region = make(6.0 if name == "Tricept" else 0.15)
    follows = what_follows(model, region, 0.0)
    parameters = region_parameters(model, region, 0.0, follows.implicit)
    assert not follows.reason
    table, sides, n = kernel_table(model.legs), model.legs.home_sides[0], int(parameters.kinds[2])
    cell, single = [new_subdivision_for(model, parameters) for _ in range(2)]
    units, origin = units_of(model, region)
    is_implicit, n_checked = follows.implicit.astype(bool), 0
    for _ in range(2 if INTERPRETED else 4):
        half = np.where(is_implicit, 0.0, 10.0 ** rng.uniform(-2.0, -0.5) * parameters.half)
        middle = parameters.middle + np.where(is_implicit, 0.0, rng.uniform(-0.5, 0.5, 6) * parameters.half)
        box = np.concatenate([middle, half])
        while not put_pose(table, sides, parameters, box, cell.rows, cell.implicit):  # too large to be enclosed
            half *= 0.5
            box = np.concatenate([middle, half])
        for s in np.concatenate([rng.uniform(-1.0, 1.0, (2, 6)), rng.choice([-1.0, 1.0], (2, 6))]):
            at = box[:6] + s * half
            answer = pf.solve_ik(machine, region.pose(at * units + origin))
            assert answer.status == Status.REACHED
            point, share = np.concatenate([at, np.zeros(6)]), np.where(is_implicit, 0.0, s)
            if is_implicit.any():
                exact = as_parameters(answer.pose, parameters, model.length)
                linear = box[:6] + cell.implicit.slopes @ np.where(is_implicit, 0.0, s * half)
                off = (exact - linear)[is_implicit]
                assert (np.abs(off) <= cell.implicit.errors[is_implicit] + 1e-9).all()
                share[is_implicit] = np.clip(off / cell.implicit.errors[is_implicit], -1.0, 1.0)
                point[:6] = np.where(is_implicit, exact, at)
            assert put_pose(table, sides, parameters, point, single.rows, single.implicit)
            for k in np.flatnonzero(table.legs["proximal"] != 3):
                put_limits(table, sides, 0.0, int(k), n, cell.rows)
                put_limits(table, sides, 0.0, int(k), n, single.rows)
            form, value = cell.rows.rows, single.rows.rows[:, CENTRE]
            linear = form[:, CENTRE] + form[:, :n] @ share[:n]
            is_known = np.isfinite(form[:, BELOW]) & np.isfinite(single.rows.rows[:, BELOW])
            is_known &= np.abs(value - form[:, CENTRE]) < 1.0
            is_known[first_reach_row(table) :] = False
            excess = np.maximum(linear + form[:, BELOW] - value, value - linear - form[:, ABOVE])
            assert (excess[is_known] <= 1e-8).all()
            n_checked += int(is_known.sum())
    assert n_checked > 20


def new_subdivision_for(model: Any, parameters: CellParameters) -> Any:
    return Subdividing(model, parameters, first_cells(parameters), math.inf, 1).work


def as_parameters(pose: np.ndarray, parameters: CellParameters, length: float) -> np.ndarray:
    """The parameters of a pose, by SciPy."""
    found = np.zeros(6)
    found[:3] = pose[:3, 3] / length
    if parameters.kinds[0] == ROTATION_VECTOR:
        found[3:] = Rotation.from_matrix(pose[:3, :3]).as_rotvec()
        return found
    across = np.cross([0.0, 0.0, 1.0], pose[:3, 2])
    sine = np.linalg.norm(across)
    tilt = across * (math.atan2(sine, pose[2, 2]) / sine if sine > 0.0 else 1.0)
    found[3:5] = tilt[:2]
    found[5] = (Rotation.from_rotvec(-tilt) * Rotation.from_matrix(pose[:3, :3])).as_rotvec()[2]
    return found


def sides(machine: pf.Mechanism, poses: np.ndarray) -> np.ndarray:
    """Sides of the parallel singularities of answers, from Jacobians in joint coordinates; 1 is home's."""
    answers = pf.solve_ik(machine, np.concatenate([machine.home_pose[None], poses]))
    signs = parallel_signs(machine, answers.q, pf.forward_jacobian(answers))
    return np.asarray(signs[1:] * signs[0])


@pytest.mark.skipif(INTERPRETED, reason="thousands of cells take long as plain Python")
@pytest.mark.parametrize(
    ("name", "regular", "singular"),
    [("stewart", 0.6, 1.7), ("rps", 0.8, 1.25), ("ankle_ups", 0.6, 0.9), ("tricept", 0.8, 1.5)],
)
def test_locked_drives_hold_the_platform_where_it_is_proved(name: str, regular: float, singular: float) -> None:
    machine = pf.load(name).without_limits()
    at, length, rng = machine.home_pose[:3, 3], machine.characteristic_length, np.random.default_rng(2)

    def region(size: float) -> PoseRegion:
        if name == "stewart":
            return PoseRegion.box(at - 5.0, at + 5.0, tilt=0.1, yaw=[-size, size])
        return PoseRegion.box(at, at, tilt=size) if name != "tricept" else box_about(at, size * length)

    proved = pf.certify(machine, region(regular), singular=True)
    assert proved and proved.replay() and "none is singular" in str(proved)
    assert (sides(machine, region(regular).pose(drawn_in(region(regular), 500, rng))) == 1.0).all()
    refuted = pf.certify(machine, region(singular), singular=True)
    refutation = refuted.refutation
    assert refutation is not None and refutation.limit[1] == "singularity"
    assert sides(machine, refutation.pose[None]) == [-1.0]
    assert pf.certify(machine, region(singular)).refutation is None


def test_drives_without_rows_leave_singularities_open() -> None:
    """Hinges of a pivot are driven; planar machines have fewer than six rows."""
    for name in ("agile_eye", "rrr"):
        machine = pf.load(name)
        at = machine.home_pose[:3, 3]
        certificate = pf.certify(machine, PoseRegion.box(at, at), budget=20, singular=True)
        assert certificate.verdict == "OPEN" and "determinant" in certificate.reason


def thick_machines() -> Iterator[Any]:
    """Links that come near each other before anything else does."""
    shape = pf.Shape
    for name, shapes, size in (
        ("rps", [shape(f"rod{i}", thickness=100.0, between=(f"A{i}", f"C{i}")) for i in (1, 2, 3)], 1.2),
        ("ankle_ups", [shape(f"rod{i}", thickness=60.0, between=(f"A{i}", f"C{i}")) for i in "LR"], 1.2),
    ):
        machine = pf.load(name).without_limits().with_shapes(shapes).with_clearance(1.0)
        yield pytest.param(machine, tilts(machine), size, id=name)


@pytest.mark.skipif(INTERPRETED, reason="thousands of cells take long as plain Python")
@pytest.mark.parametrize(("machine", "make", "top"), list(thick_machines()))
def test_links_are_proved_apart_over_tilts(machine: pf.Mechanism, make: Any, top: float) -> None:
    rng = np.random.default_rng(4)
    border = border_by_brute_force(machine, make, top, 2000, rng)
    proved, refuted = pf.certify(machine, make(0.97 * border)), pf.certify(machine, make(1.02 * border))
    assert proved and border < 0.98 * top
    assert_holds_of(machine, make(0.97 * border), proved.margin, rng)
    assert refuted.refutation is not None and refuted.refutation.limit[1] == "clearance"
    assert refuted.refutation.answer.status == Status.PROJECTED


@pytest.mark.skipif(INTERPRETED, reason="hundreds of cells with links take long as plain Python")
def test_links_on_cranks_are_proved_apart_over_tilts() -> None:
    shapes = [pf.Shape(f"rod{i}", thickness=70.0) for i in "LR"]
    machine, rng = pf.load("ankle_rss").with_shapes(shapes).with_clearance(1.0), np.random.default_rng(3)
    region = tilts(machine)(0.25)
    proved = pf.certify(machine, region, tolerance=5e-3)
    assert proved and proved.margin > 0.0
    assert_holds_of(machine, region, proved.margin, rng)


def assert_holds_of(machine: pf.Mechanism, region: PoseRegion, margin: float, rng: np.random.Generator) -> None:
    poses = region.pose(drawn_in(region, 2000, rng))
    assert (np.asarray(pf.solve_ik(machine, poses).status) == Status.REACHED).all()
    assert pf.feasibility(machine, poses).margin.min() >= margin - 1e-9


def test_regions_of_joints_are_refused_by_name() -> None:
    ankle = pf.load("ankle_ups")
    for ranges, words in (
        ({}, "one to 6"),
        ({"pivot[0]": (0.1, -0.1)}, "smaller one first"),
        ({"AL[0]": (0.0, 0.1)}, "series"),
        ({"pivott": (0.0, 0.1)}, "pivot"),
    ):
        with pytest.raises(pf.errors.PfabrikError, match=words):
            pf.certify(ankle, PoseRegion.joints(ranges))
    with pytest.raises(pf.errors.InvalidArgument, match="machine"):
        PoseRegion.joints({"pivot[0]": (0.0, 0.1)}).pose(np.zeros(6))


# Links


def test_links_are_proved_apart_in_a_box_and_refuted_in_a_larger_one() -> None:
    machine, rng = thick_struts(), np.random.default_rng(0)
    region, length = box_of_struts(25.0, 7.0), machine.characteristic_length
    proved, close = pf.certify(machine, region), pf.certify(machine, region, tolerance=0.02 if INTERPRETED else 2e-3)
    assert proved and proved.replay()
    assert_holds(proved, 50 if INTERPRETED else 1000, rng)
    room = distances_of_pairs(random_poses(region, 50 if INTERPRETED else 20_000, rng), 24.0) / length
    assert (room >= proved.margin).all()
    assert close and close.margin <= close.least_found and close.margin <= room.min()
    assert close.least_found - close.margin <= (0.021 if INTERPRETED else 2.1e-3)
    # Legs alone leave more room.
    wide = box_of_struts(30.0, 24.0)
    assert pf.certify(machine.with_clearance(None), wide)
    refuted = pf.certify(machine, wide)
    refutation = refuted.refutation
    assert refuted.verdict == "REFUTED" and refutation is not None
    assert refutation.limit[1] == "clearance" and "–" in refutation.limit[0]
    assert refutation.answer.status == Status.PROJECTED
    away = distances_of_pairs(refutation.pose[None], 24.0).min()
    assert away < 0.0 and refutation.margin == pytest.approx(away / length, abs=1e-9)
    assert [limit.bound for limit in refutation.answer.active_limits][:1] == ["clearance"]


def test_a_track_on_which_links_come_too_near_between_two_steps_is_not_proved() -> None:
    machine = thick_struts()
    ends = pf.pose([[-10.26, -14.35, 235.17], [8.03, 9.28, 156.0]], rotvec=[[0.33, -0.63, 0.73], [0.65, -0.71, -0.09]])
    assert (pf.solve_ik(machine, ends).status == Status.REACHED).all()
    assert pf.certify(machine, ends).verdict != "PROVED"


@pytest.mark.campaign
def test_ten_million_random_poses_of_what_is_proved_are_feasible() -> None:
    rng, machine = np.random.default_rng(9), pf.load("stewart")
    certificate = pf.certify(machine, stewart_box(34.0, 7.5))
    assert certificate
    for _ in range(100):
        assert_holds(certificate, 100_000, rng)
    for name in POSITIONED:
        for _ in range(60):
            assert_holds(pf.certify(pf.load(name), random_region(name, rng)), 20_000, rng)


@pytest.mark.campaign
@pytest.mark.parametrize("name", FOLLOWING)
def test_no_pose_and_no_descent_refutes_what_is_proved_of_tilts(name: str) -> None:
    """A million random poses, most of them on the border, and descents of the margin from the worst of them."""
    machine, make, top = FOLLOWING[name]
    rng = np.random.default_rng(11)
    border = border_by_brute_force(machine, make, top, 250_000, rng)
    region = make(0.99 * border)
    proved, refuted = pf.certify(machine, region), pf.certify(machine, make(1.01 * border))
    assert proved and refuted.verdict == "REFUTED"
    least = []
    for _ in range(10):
        points = drawn_in(region, 100_000, rng)
        poses = region.pose(points)
        assert (np.asarray(pf.solve_ik(machine, poses).status) == Status.REACHED).all()
        margin = np.asarray(pf.feasibility(machine, poses).margin)
        assert margin.min() >= proved.margin - 1e-9
        least.append(points[np.argmin(margin)])

    def margin_at(point: np.ndarray) -> float:
        return float(
            pf.feasibility(machine, region.pose(rounded(region, np.clip(point, region.low, region.high)))).margin
        )

    for start in least:
        bounds = list(zip(region.low, region.high, strict=True))
        found = minimize(margin_at, start, bounds=bounds, method="Powell")
        assert margin_at(found.x) >= proved.margin - 1e-9


@pytest.mark.campaign
@pytest.mark.parametrize(
    ("machine", "region"),
    [(pf.load("stewart"), stewart_box(34.0, 7.5)), (thick_struts(), box_of_struts(30.0, 9.0))],
    ids=["limits", "links"],
)
def test_no_descent_from_a_proved_box_finds_a_smaller_margin(machine: pf.Mechanism, region: PoseRegion) -> None:
    certificate = pf.certify(machine, region)
    assert certificate

    def margin(point: np.ndarray) -> float:
        return float(pf.feasibility(machine, region.pose(point)).margin)

    for low, high in certificate.boxes[:200]:
        for start in (0.5 * (low + high), low, high):
            found = minimize(margin, start, bounds=list(zip(low, high, strict=True)), method="Powell")
            assert margin(np.clip(found.x, low, high)) >= certificate.margin - 1e-12
