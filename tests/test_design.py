"""Designs reach what they must, as small as closed forms say, and wishes that contradict each other are named."""

from __future__ import annotations

import math
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import INTERPRETED
from pfabrik import PoseRegion, Status, keep

pytestmark = pytest.mark.skipif(INTERPRETED, reason="thousands of machines")
TEMPLATES = Path(pf.__file__).parent / "machine" / "catalog" / "templates"
ABOUT_HOME = PoseRegion.box([-30, -30, -30], [30, 30, 30], rotation=math.radians(8))
TURNED = PoseRegion.box([-5, -5, 0], [5, 5, 0], rotation=[0.1, 0, 0])
SLIGHT = PoseRegion.box([-10, -10, -10], [10, 10, 10])
HEXAPOD: dict[str, Any] = {
    "vary": {
        "base_radius": (60, 200),
        "base_angle": (4, 40),
        "platform_radius": (30, 120),
        "platform_angle": (20, 55),
        "height": (100, 400),
        "shortest": (80, 500),
        "longest": (120, 600),
    },
    "reach": ABOUT_HOME,
    "keep": [keep.margin(0.005), keep.stroke(1 / 0.55), "base_radius >= 1.2*platform_radius"],
    "minimise": "(longest + 2*base_radius)/100",
    "about": "home",
}
PRINTER = {"arm_length": (120, 500), "delta_radius": (40, 250), "position_endstop": (200, 400), "travel": (150, 600)}
BUILD = PoseRegion.cylinder([0, 0, 100], 100, 200)
TOWERS = "height + arm_length/10"
FIVE_BAR = """
schema = 1
name = "Coaxial five-bar"
units = {{ length = "mm", angle = "deg" }}
base = "base"
end_effector = "Tip"

[dimensions]
crank = {crank}
forearm = {forearm}
elbow = "crank/sqrt(2)"
tip = "elbow + sqrt(forearm**2 - elbow**2)"

[[joint]]
name = "MotorL"
type = "revolute"
actuated = true
connects = ["base", "crankL"]
at = [0, 0, 0]
axis = [0, 0, 1]

[[joint]]
name = "ElbowL"
type = "revolute"
connects = ["crankL", "forearmL"]
at = ["-elbow", "elbow", 0]
axis = [0, 0, 1]

[[joint]]
name = "Tip"
type = "revolute"
connects = ["forearmL", "forearmR"]
at = [0, "tip", 0]
axis = [0, 0, 1]

[[joint]]
name = "ElbowR"
type = "revolute"
connects = ["crankR", "forearmR"]
at = ["elbow", "elbow", 0]
axis = [0, 0, 1]

[[joint]]
name = "MotorR"
type = "revolute"
actuated = true
connects = ["base", "crankR"]
at = [0, 0, 0]
axis = [0, 0, 1]
"""
ORTHOGLIDE = """
schema = 1
name = "Orthoglide"
units = { length = "mm", angle = "deg" }
base = "base"
end_effector = "platform"
reference_point = ["cross", "cross", "cross"]
task = ["x", "y", "z"]

[dimensions]
rod = 400
travel = 300
cross = 0                            # where the rails cross, along the diagonal

[[joint]]
name = "A"
type = "prismatic"
actuated = true
connects = ["base", "carriage"]
axis = [1, 0, 0]
home = "rod"
range = ["rod - travel", "rod + travel"]
copies = { count = 3, axis = [1, 1, 1] }

[[joint]]
name = "UpperL"
type = "spherical"
connects = ["carriage", "rodL"]
at = ["cross + rod + 40", "cross + 30", "cross"]
copies = { count = 3, axis = [1, 1, 1] }

[[joint]]
name = "LowerL"
type = "spherical"
connects = ["rodL", "platform"]
at = ["cross + 40", "cross + 30", "cross"]
copies = { count = 3, axis = [1, 1, 1] }

[[joint]]
name = "UpperR"
type = "spherical"
connects = ["carriage", "rodR"]
at = ["cross + rod + 40", "cross - 30", "cross"]
copies = { count = 3, axis = [1, 1, 1] }

[[joint]]
name = "LowerR"
type = "spherical"
connects = ["rodR", "platform"]
at = ["cross + 40", "cross - 30", "cross"]
copies = { count = 3, axis = [1, 1, 1] }
"""


def template(name: str) -> pf.Mechanism:
    return pf.load(TEMPLATES / f"{name}.toml")


def read(folder: Path, text: str) -> pf.Mechanism:
    path = folder / "machine.toml"
    path.write_text(text)
    return pf.load(path)


def random_poses(found: pf.Design, region: PoseRegion, count: int) -> np.ndarray:
    """Poses of a box about home, half of them on its sides, by SciPy's rotations."""
    rng = np.random.default_rng(5)
    points = rng.uniform(region.low, region.high, (count, 6))
    ends = np.where(rng.random(points.shape) < 0.5, region.low, region.high)
    points[::2] = np.where(rng.random(points.shape) < 0.6, ends, points)[::2]
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, 3] = points[:, :3] + found.mechanism.home_pose[:3, 3]
    poses[:, :3, :3] = Rotation.from_rotvec(points[:, 3:]).as_matrix()
    return poses


@pytest.fixture(scope="module")
def hexapod() -> pf.Design:
    return pf.design(template("6-UPS"), **HEXAPOD)


def test_hexapod_is_proved_and_smaller_than_published(hexapod: pf.Design) -> None:
    assert hexapod.verdict == "PROVED" and hexapod.aim <= 4.4896
    assert len(hexapod.rounds) <= 5
    found = hexapod.dimensions
    assert found["longest"] <= found["shortest"] / 0.55 * (1 + 1e-6)
    assert found["base_radius"] >= 1.2 * found["platform_radius"] * (1 - 1e-6)
    assert hexapod.certificate.margin >= 0.005
    assert hexapod.certificate.replay()
    assert "base_radius >= 60" in [each.requirement for each in hexapod.binding]


@pytest.mark.parametrize("count", [100_000, pytest.param(10_000_000, marks=pytest.mark.campaign)])
def test_random_poses_of_the_hexapod_keep_its_margin(hexapod: pf.Design, count: int) -> None:
    done = 0
    while done < count:
        poses = random_poses(hexapod, ABOUT_HOME, 100_000)
        low, high = np.array([drive.joint.range for drive in hexapod.mechanism.drives]).T
        answer = pf.solve_ik(hexapod.mechanism, poses)
        assert (np.asarray(answer.status) == Status.REACHED).all()
        lengths = answer.actuators
        shares = np.minimum(lengths - low, high - lengths) / (0.5 * (high - low))
        assert shares.min() >= 0.005
        done += len(poses)


@pytest.mark.parametrize("count", [1, pytest.param(20, marks=pytest.mark.campaign)])
def test_starts_do_not_matter(hexapod: pf.Design, count: int) -> None:
    rng, aims = np.random.default_rng(1), [hexapod.aim]
    for seed in range(count):
        values = {name: rng.uniform(low, high) for name, (low, high) in HEXAPOD["vary"].items()}
        try:
            machine = template("6-UPS").with_dimensions(values)
        except pf.errors.InvalidMechanism:
            machine = template("6-UPS")
        found = pf.design(machine, **HEXAPOD, seed=seed)
        assert found.verdict == "PROVED"
        aims.append(found.aim)
    assert max(aims) <= 1.01 * min(aims)


def test_orthoglide_has_the_rods_of_its_closed_form(folder: Path) -> None:
    """At p (1, 1, 1) from where rails cross, actuator speeds are I - t (ones - I), t = p / sqrt(L^2 - 2 p^2).

    Their factors are 1 - 2 t along the diagonal and 1 + t across: both bounds hold for -1/2 <= t <= 1/4, and the
    cube's diagonal is the way from one to the other.
    """
    first, last = (t / math.sqrt(1 + 2 * t * t) for t in (-0.5, 0.25))
    rod = 200.0 / (last - first)
    found = pf.design(
        read(folder, ORTHOGLIDE),
        {"rod": (250, 600), "travel": (100, 400), "cross": (-100, 100)},
        PoseRegion.box([-100, -100, -100], [100, 100, 100]),
        keep=[keep.factors(0.5, 2)],
        minimise="rod",
    )
    assert found.verdict == "PROVED"
    assert found.dimensions["rod"] == pytest.approx(rod, abs=0.1)
    assert found.dimensions["cross"] == pytest.approx(-0.5 * (first + last) * rod, abs=0.1)


@pytest.mark.parametrize("crank, forearm, low, high", [(120, 150, 50, 200), (90, 130, 30, 150)])
def test_coaxial_five_bar_reaches_an_annulus(
    folder: Path, crank: float, forearm: float, low: float, high: float
) -> None:
    turns = np.linspace(0, 2 * math.pi, 12, endpoint=False)
    circle = np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
    found = pf.design(
        read(folder, FIVE_BAR.format(crank=crank, forearm=forearm)),
        {"crank": (20, 400), "forearm": (20, 400)},
        np.concatenate([r * circle for r in np.linspace(low, high, 5)]),
        keep=[keep.singularity(None)],
        minimise="crank + forearm",
    )
    assert found.verdict == "CHECKED"
    assert found.aim == pytest.approx(high, rel=1e-6)
    assert abs(found.dimensions["crank"] - found.dimensions["forearm"]) <= low * (1 + 1e-6)


# What no design can have.
def test_contradicting_wishes_are_named() -> None:
    """A pose 20 mm up and down from home needs struts between two lengths, which a ratio of 1.02 is not."""
    poses = np.array([[0.0, 0.0, -20.0], [0.0, 0.0, 20.0]])
    found = pf.design(
        template("6-UPS"),
        {"shortest": (100, 300), "longest": (110, 320)},
        poses,
        keep=[keep.stroke(1.02)],
        about="home",
    )
    assert found.verdict == "NOT FOUND" and not found and found.mechanism is None
    named = {each.requirement for each in found.binding}
    assert {"stroke ratio <= 1.02", "margin >= 0"} <= named
    assert "stroke ratio" in found.reason
    assert "stands against" in str(found.table())
    with pytest.raises(pf.errors.InvalidArgument, match="NOT FOUND"):
        found.save("none.toml")


def test_what_is_out_of_reach_of_all_machines_is_not_found() -> None:
    found = pf.design(template("delta"), {"rod": (100, 400), "arm": (40, 200)}, [[4000.0, 0.0, 0.0]])
    assert found.verdict == "NOT FOUND"
    assert {"margin >= 0", "rod <= 400"} <= {each.requirement for each in found.binding}
    assert math.isfinite(found.aim)


def test_the_requirement_is_named_beside_a_bound_that_is_far_from_the_other() -> None:
    found = pf.design(template("6-UPS"), {"base_radius": (102, 1e9)}, [[0.0, 0.0, 900.0]])
    assert found.verdict == "NOT FOUND"
    assert {"margin >= 0", "base_radius >= 102"} <= {each.requirement for each in found.binding}


def test_a_bound_that_binds_is_named_and_the_machine_is_saved(folder: Path) -> None:
    found = pf.design(template("delta"), {"rod": (240, 300)}, SLIGHT, about="home")
    assert found.verdict == "PROVED"
    assert found.dimensions["rod"] == pytest.approx(240)
    assert [(each.requirement, each.limit) for each in found.binding] == [("rod >= 240", "bound")]
    found.save("found.toml")
    text = Path("found.toml").read_text()
    assert 'across = "base_radius + arm - platform_radius"' in text
    again = pf.load("found.toml")
    assert dict(again.dimensions) == dict(found.mechanism.dimensions)


def test_machines_are_ranked_and_none_is_lost() -> None:
    large = template("delta").with_dimensions(arm=120)
    vary = {"rod": (240, 300), "longest": (250, 300)}
    found = pf.design([template("6-UPS"), large, template("delta")], vary, SLIGHT, about="home")
    assert len(found) == 3
    assert [each.aim for each in found] == sorted(each.aim for each in found)
    text = str(
        pf.design({"short": template("delta"), "long": large}, {"rod": (240, 300)}, SLIGHT, about="home").table()
    )
    assert text.index("short") < text.index("long")


def test_no_design_of_a_front_is_better_than_another() -> None:
    vary = {"base_radius": (60, 120), "arm": (60, 150), "rod": (100, 300)}
    reach = PoseRegion.cylinder([0, 0, 0], 60, 40)
    asked: dict[str, Any] = {"keep": [keep.singularity(None)], "about": "home"}
    found = pf.design(template("delta"), vary, reach, minimise=("rod", "size"), **asked)
    first, second = [each.aim for each in found.front], [each.other for each in found.front]
    assert len(first) >= 3
    assert (np.diff(first) > 0.0).all() and (np.diff(second) < 0.0).all()
    ends = [pf.design(template("delta"), vary, reach, minimise=name, **asked).aim for name in ("rod", "size")]
    assert [first[0], second[-1]] == pytest.approx(ends, rel=5e-3)


def test_a_front_of_a_bound_that_both_aims_keep_is_one_design() -> None:
    """Rods of 150 mm do for the shortest arms too."""
    vary = {"base_radius": (60, 120), "arm": (60, 150), "rod": (150, 300)}
    reach = PoseRegion.cylinder([0, 0, 0], 40, 20)
    asked: dict[str, Any] = {"keep": [keep.singularity(None)], "about": "home"}
    found = pf.design(template("delta"), vary, reach, minimise=("rod", "arm"), **asked)
    assert len(found.front) == 1
    assert (found.front[0].aim, found.front[0].other) == pytest.approx((150, 60), rel=5e-3)


@pytest.mark.parametrize("seed", [0, 6])
def test_other_starts_find_what_one_start_finds(seed: int) -> None:
    found = [pf.design(template("linear-delta"), PRINTER, BUILD, minimise=TOWERS, seed=each) for each in (1, seed)]
    assert [each.verdict for each in found] == ["PROVED"] * 2
    assert found[0].aim == pytest.approx(found[1].aim, rel=1e-4)


DELTA = {"base_radius": (50, 200), "arm": (40, 200), "rod": (100, 400), "platform_radius": (20, 80)}
CYLINDER = PoseRegion.cylinder([0, 0, 0], 60, 40)


PUSHES = [[0, 0, -20], [20, 0, 0], [0, 20, 0]]
MEASURES: dict[str, tuple[Any, Any]] = {  # a requirement, and by how much the library's own verbs find it kept
    "margin": (keep.margin(0.2), lambda s: pf.feasibility(s.mechanism, s.pose).margin.min() - 0.2),
    "singularity": (
        keep.singularity(0.3),
        lambda s: min(pf.singularity(s).serial.min(), pf.singularity(s).parallel.min()) - 0.3,
    ),
    "speed": (
        keep.speed([[100, 0, 0], [0, 100, 0]], 1.2),
        lambda s: 1.2 - np.abs(pf.inverse_jacobian(s)[:, :, :2] * 100).max(),
    ),
    "force": (
        keep.force(PUSHES, 1800),
        lambda s: 1 - max(np.abs(pf.forces(s, push).actuators).max() for push in PUSHES) / 1800,
    ),
    "accuracy": (keep.accuracy(1e-3, 0.2), lambda s: 1 - pf.accuracy(s, 1e-3).position.max() / 0.2),
    "stiffness": (
        keep.stiffness(7, 1e5),
        lambda s: 1 / np.diagonal(pf.stiffness(s, 1e5).compliance, axis1=-2, axis2=-1)[:, :3].max() / 7 - 1,
    ),
}


@pytest.fixture(scope="module")
def plain() -> pf.Design:
    return pf.design(template("delta"), DELTA, CYLINDER, about="home")


@pytest.mark.parametrize("name", MEASURES)
def test_what_is_kept_is_kept_at_random_poses(name: str, plain: pf.Design) -> None:
    requirement, measure = MEASURES[name]
    found = pf.design(template("delta"), DELTA, CYLINDER, keep=[requirement], about="home")
    assert found.verdict == plain.verdict == "PROVED"
    assert found.aim > plain.aim * 1.001
    for each, holds in ((found, True), (plain, False)):
        poses = random_poses(each, CYLINDER, 2000)
        from_home = poses[:, :3, 3] - each.mechanism.home_pose[:3, 3]
        poses = poses[np.hypot(*from_home[:, :2].T) <= 60]
        answer = pf.solve_ik(each.mechanism, poses)
        assert (np.asarray(answer.status) == Status.REACHED).all()
        assert (measure(answer) >= -1e-3) == holds


def test_links_stay_apart_and_nothing_else_is_in_the_way(tmp_path: Path) -> None:
    text = (TEMPLATES / "6-UPS.toml").read_text(encoding="utf-8")
    machine = read(tmp_path, text.replace("stroke = [", "thickness = 10\nstroke = ["))
    poses = np.tile(machine.home_pose, (4, 1, 1))
    poses[:, :2, 3] += [[20, 20], [-20, 20], [20, -20], [-20, -20]]
    found = pf.design(machine, {"base_angle": (4, 40)}, poses, keep=[keep.clearance(12)], minimise="base_angle")
    assert found.verdict == "CHECKED" and {each.requirement for each in found.binding} == {"clearance >= 12"}
    apart = pf.clearance(pf.solve_ik(found.mechanism, poses)).distance
    assert np.asarray(apart).min() == pytest.approx(12, rel=1e-6)


def test_errors_of_encoders_move_the_tip_no_farther() -> None:
    poses = np.array([[x, y, 0.0] for x in (-20, 20) for y in (160, 190)])
    found = pf.design(
        template("5-bar"), {"crank": (60, 200)}, poses, keep=[keep.accuracy(1e-3, 0.2)], minimise="stroke"
    )
    assert found.verdict == "CHECKED" and {each.requirement for each in found.binding} == {"error <= 0.2"}
    answer = pf.solve_ik(found.mechanism, poses)
    moved = [
        pf.solve_fk(found.mechanism, answer.actuators + np.multiply(1e-3, signs), start=answer).pose[:, :3, 3]
        for signs in ((1, 1), (1, -1), (-1, 1), (-1, -1))
    ]
    off = np.linalg.norm(np.array(moved) - answer.pose[:, :3, 3], axis=2).max()
    assert off == pytest.approx(0.2, rel=5e-3)  # errors are to first order


def test_a_track_is_proved_between_its_steps() -> None:
    steps = np.array([[-40.0, 0.0, 195.0], [40.0, 0.0, 195.0]])
    path = pf.track(template("6-UPS"), steps)
    found = pf.design(template("6-UPS"), {"longest": (200, 300), "shortest": (100, 200)}, path, minimise="longest")
    assert found.verdict == "PROVED"
    between = np.linspace(steps[0], steps[1], 101)
    assert (np.asarray(pf.solve_ik(found.mechanism, between).status) == Status.REACHED).all()


@pytest.mark.parametrize("name", ["linear-delta", "3-RRR", "3-RPR"])
def test_proofs_of_three_freedoms_are_not_refuted(name: str) -> None:
    machine = template(name)
    source = machine.__dict__["_source"].independent
    vary = {each: (0.8 * machine.dimensions[each], 1.25 * machine.dimensions[each]) for each in source[:3]}
    flat = name != "linear-delta"
    region = PoseRegion.box([-10, -10, 0], [10, 10, 0], rotation=[0, 0, 0.1]) if flat else SLIGHT
    found = pf.design(machine, vary, region, about="home")
    assert found.verdict == "PROVED"
    poses = random_poses(found, region, 20_000)
    assert (np.asarray(pf.solve_ik(found.mechanism, poses).status) == Status.REACHED).all()


PIVOTED = PoseRegion.joints({"Pivot[0]": (-0.2, 0.2), "Pivot[1]": (-0.15, 0.15)})


@pytest.mark.parametrize(
    "name, vary, region",
    [
        ("3-RPS", {"longest": (200, 400)}, PoseRegion.box([0, 0, -10], [0, 0, 10], tilt=0.1)),
        ("ankle", {"crank": (20, 60)}, PoseRegion.box([0, 0, 0], [0, 0, 0], tilt=0.1)),
        ("ankle", {"turn": (20, 90), "crank": (20, 60)}, PIVOTED),
    ],
    ids=["tripod", "tilts", "pivot"],
)
def test_a_tilting_machine_is_proved(name: str, vary: dict[str, Any], region: PoseRegion) -> None:
    found = pf.design(template(name), vary, region, keep=[keep.singularity(None)], about="home")
    assert found.verdict == "PROVED" and found.certificate is not None and found.mechanism is not None
    asked = found.certificate.region
    assert asked is not None
    ends = asked.low + np.random.default_rng(0).random((200, 6)).round() * (asked.high - asked.low)
    poses = asked.pose(ends if asked.turning == "joints" else 0.7 * ends + 0.3 * asked.middle)
    assert (np.asarray(pf.solve_ik(found.mechanism, poses).status) == Status.REACHED).all()


def test_joints_that_move_a_position_of_the_task_are_refused() -> None:
    with pytest.raises(pf.errors.InvalidArgument, match="joints that move"):
        pf.design(template("tricept"), {"longest": (300, 500)}, PoseRegion.joints({"Slide": (280.0, 285.0)}))


def asked_whole(name: str) -> pf.Mechanism:
    """A template whose task is the whole pose, which it does not make."""
    lines = (TEMPLATES / f"{name}.toml").read_text(encoding="utf-8").splitlines()
    with TemporaryDirectory() as folder:
        return read(Path(folder), "\n".join(line for line in lines if not line.startswith("task")))


@pytest.mark.parametrize(
    "changed, says",
    [
        ({"vary": {"arms": (1, 2)}}, "arms"),
        ({"vary": {}}, "no dimension"),
        ({"vary": {"arm": (91, 90)}}, "91 to 90"),
        ({"reach": np.full((4, 4), np.nan)}, "reach"),
        ({"reach": np.zeros((0, 3))}, "reach"),
        ({"reach": PoseRegion.box([-1] * 3, [1] * 3, rotation=0.1)}, "rotation about x"),
        ({"mechanism": asked_whole("5-bar"), "vary": {"crank": (100, 120)}}, "one plane: 'My five-bar' is planar"),
        ({"mechanism": asked_whole("5-bar"), "vary": {"crank": (100, 120)}, "reach": [0, 160, 50]}, "one plane"),
        ({"mechanism": asked_whole("3-RRR"), "vary": {"crank": (100, 130)}, "reach": TURNED}, "one plane"),
        ({"about": "origin"}, "origin"),
        ({"keep": "arm"}, "<= or >="),
        ({"keep": "arm >= foo"}, "foo"),
        ({"keep": 3}, "requirements of pfabrik.keep"),
        ({"minimise": "foo"}, "foo"),
        ({"minimise": lambda machine: math.nan}, "nan"),
        ({"mechanism": []}, "no machine"),
        ({"mechanism": [3]}, "Mechanism"),
    ],
)
def test_errors_are_one_sentence(changed: dict[str, Any], says: str) -> None:
    asked = {"mechanism": template("delta"), "vary": {"arm": (80, 100)}, "reach": SLIGHT, "about": "home"}
    with pytest.raises((pf.errors.InvalidArgument, pf.errors.UnknownName)) as raised:
        pf.design(**(asked | changed))
    assert says in str(raised.value) and "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("reach", "edges"),
    [
        (PoseRegion.box([-30, -30, -10], [30, 30, 60]), 12),
        (PoseRegion.cylinder([0, 0, 20], 25, 60), 6),
        (PoseRegion.ball([0, 0, 20], 25), 3),
        (np.array([[0.0, 0.0, 0.0], [20.0, 0.0, 90.0]]), 0),
    ],
)
def test_a_picture_has_the_machine_before_and_after_around_what_is_to_be_reached(reach: Any, edges: int) -> None:
    pytest.importorskip("matplotlib")
    from matplotlib import pyplot

    machine = pf.load(TEMPLATES / "6-UPS.toml")
    found = pf.design(machine, {"longest": (200, 600)}, reach, minimise="longest", about="home")
    assert found and found.mechanism is not None
    figure = found.plot(view="top")
    poses = reach.pose(np.array([reach.low, reach.high])) if edges else pf.pose(reach)
    scales, spots = [], []
    for axes, each in zip(figure.axes, (machine, found.mechanism), strict=True):
        home = each.home_pose[:2, 3]
        dashed = [np.array(line.get_xydata()) - home for line in axes.lines if line.get_linestyle() == "--"]
        assert len(dashed) == edges
        if edges:  # seen from the top, x to the right, lines are within the region, and touch its ends
            seen = np.concatenate(dashed)
            np.testing.assert_allclose([seen.min(axis=0), seen.max(axis=0)], poses[:, :2, 3], atol=1e-9)
        dots = {line.get_label(): np.array(line.get_xydata()) - home for line in axes.lines}
        drawn = np.concatenate([dots.get("reached", np.zeros((0, 2))), dots.get("not reached", np.zeros((0, 2)))])
        moved = found._reach.at(each, found._reach.poses)
        is_reached = np.asarray(pf.solve_ik(each, moved).status) == Status.REACHED
        assert len(drawn) == len(moved) and len(dots.get("not reached", ())) == (~is_reached).sum()
        assert f"{is_reached.sum()} of {len(moved)} poses reached" in axes.get_title()
        assert f"longest {each.dimensions['longest']:.5g}" in axes.get_title()
        scales.append(np.ptp(axes.get_xlim()) / axes.bbox.width)
        spots.append(is_reached)
    assert spots[1].all() and scales[0] == pytest.approx(scales[1], rel=0.02)
    pyplot.close(figure)
    with pytest.raises(pf.errors.InvalidArgument, match="theme"):
        found.plot(theme="none")  # type: ignore[arg-type]


def test_a_region_of_one_pose_is_proved() -> None:
    """With a margin that is asked for: what is found in the only cell proves it."""
    one = PoseRegion.box([5, 0, 10], [5, 0, 10])
    design = pf.design(pf.load(TEMPLATES / "6-UPS.toml"), **{**HEXAPOD, "reach": one})
    assert design.verdict == "PROVED"
