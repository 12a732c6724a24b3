"""Workspaces are as large as closed forms say, to what they say, closed, and bounded by the limits they name."""

from __future__ import annotations

import csv
import itertools
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache, partial
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import pfabrik as pf
from links import distances_of_struts, struts
from machines import closure
from oracles.annuli import Ring, area, within
from pfabrik.capabilities.workspace.border import (
    JOINT_COLOURS,
    LINK_COLOURS,
    MOTOR_COLOURS,
    groups_of,
    stems_of,
)
from pfabrik.capabilities.workspace.verdicts import MapQuestion
from pfabrik.errors import InvalidArgument
from pfabrik.view.eye import Eye
from pfabrik.view.looks import look_of
from pfabrik.view.solid import in_the_light

Array = NDArray[np.float64]


def struts_only(mechanism: pf.Mechanism) -> pf.Mechanism:
    """The machine with the limits of its actuators alone."""
    passive = [joint for joint in mechanism.joints if not joint.actuated]
    return mechanism.with_limits({joint.name: None for joint in passive if joint.range or joint.cone})


def strut_rings(mechanism: pf.Mechanism, rotation: Array, z: float) -> list[Ring]:
    """Where each strut lets the reference point be at an orientation and height: a ring about its own centre."""
    rings = []
    for strut in (joint for joint in mechanism.joints if joint.actuated):
        assert strut.along is not None
        assert strut.range is not None
        foot, head = (np.array(mechanism.joint(name).at) for name in strut.along)
        centre = foot - rotation @ (head - mechanism.reference_point)
        inner, outer = (np.sqrt(max(length**2 - (z - centre[2]) ** 2, 0.0)) for length in strut.range)
        rings.append((centre[0], centre[1], inner, outer))
    return rings


def grid(found: pf.Workspace, n: int) -> Array:
    """Points (n^d, d) over the bounds of a workspace, and a tenth beyond."""
    low, high = found.bounds
    axes = [np.linspace(a - 0.1 * (b - a), b + 0.1 * (b - a), n) for a, b in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(n ** len(axes), -1)


class Case(NamedTuple):
    """A machine, the options of its workspace, the exact size, and the rings that it is what they have in common."""

    machine: pf.Mechanism
    options: dict[str, Any]
    size: float
    rings: list[Ring] | None = None


def two_links(a: float, b: float, elbow: tuple[float, float] | None = None, turn: float = 0.0) -> pf.Mechanism:
    """An arm in a plane, its elbow within a range, in whose middle it is at home, its shoulder within a turn [rad]."""
    bend = 0.5 * np.pi if elbow is None else sum(elbow) / 2.0
    bends = None if elbow is None else (elbow[0] - bend, elbow[1] - bend)
    turns = (-0.5 * turn, 0.5 * turn) if turn else None
    hand = (a + b * np.cos(bend), b * np.sin(bend), 0)
    joints = [
        pf.Joint("A", "revolute", ("base", "a"), at=(0, 0, 0), axis=(0, 0, 1), actuated=True, range=turns),
        pf.Joint("B", "revolute", ("a", "b"), at=(a, 0, 0), axis=(0, 0, 1), actuated=True, range=bends),
        pf.Joint("tip", "revolute", ("b", "c"), at=hand, axis=(0, 0, 1)),
    ]
    return pf.Mechanism("2R", joints, "tip", task=("x", "y"))


def gantry(*sides: float, turn: float = 0.0) -> pf.Mechanism:
    """Slides along x, y and z by given lengths, not about the middle; and a wrist that turns about z [rad]."""
    names, joints = ("base", "x", "y", "z", "wrist"), []
    for k, side in enumerate(sides):
        ends = (-0.3 * side, 0.7 * side)
        axis = np.eye(3)[k]
        joints.append(pf.Joint("XYZ"[k], "prismatic", names[k : k + 2], axis=axis, actuated=True, range=ends))
    last = names[len(sides)]
    if turn:
        ends = (-0.4 * turn, 0.6 * turn)
        joints.append(pf.Joint("W", "revolute", (last, "tip"), at=(0, 0, 1), axis=(0, 0, 1), actuated=True, range=ends))
    else:
        joints.append(pf.Joint("W", "fixed", (last, "tip"), at=(0, 0, 1)))
    return pf.Mechanism(
        "gantry", joints, "tip", (0, 0, 1), task=("x", "y", "z", "yaw")[: len(sides)] + ("yaw",) * bool(turn)
    )


def cases() -> Iterator[Any]:
    """Annuli, sectors, boxes, rings, cylinders and balls in common, and yaw beside positions."""
    for a, b in ((210, 250), (150, 400), (100, 97)):
        yield pytest.param(Case(two_links(a, b), {}, 4.0 * np.pi * a * b), id=f"annulus {a} {b}")
    for low, high, turn in ((0.3, 2.5, 1.0), (1.0, 1.2, 4.0), (0.05, 3.1, 2.0)):
        exact = 210.0 * 250.0 * turn * (np.cos(low) - np.cos(high))
        yield pytest.param(Case(two_links(210, 250, (low, high), turn), {}, exact), id=f"sector {low} {high}")
    for sides in ((7.0, 0.4), (3.0, 2.0, 1.0)):
        yield pytest.param(Case(gantry(*sides), {}, float(np.prod(sides))), id=f"box {sides}")
    yield pytest.param(Case(gantry(3.0, 2.0, turn=2.0), {"over": ("x", "yaw")}, 6.0), id="x with yaw")
    cube = Case(gantry(3.0, 2.0, turn=2.0), {"over": ("x", "y", "yaw")}, 12.0)
    yield pytest.param(cube, id="box with yaw", marks=pytest.mark.campaign)
    crank, forearm = np.hypot(66.0, 88.0), np.hypot(116.0, 87.0)
    lens = [(y, 0.0, abs(crank - forearm), crank + forearm) for y in (-50.0, 50.0)]
    yield pytest.param(Case(pf.load("five_bar").without_limits(), {}, area(lens), lens), id="lens")
    planar, turn = struts_only(pf.load("rpr")), pf.pose([0, 0, 0], rpy=[0, 0, 10], degrees=True)[:3, :3]
    rings = strut_rings(planar, turn, 0.0)
    yield pytest.param(Case(planar, {"orientation": turn}, area(rings), rings), id="planar struts")
    machine, turn = struts_only(pf.load("stewart")), pf.pose([0, 0, 0], rpy=[5, -3, 8], degrees=True)[:3, :3]
    for z in (160.0, 250.0):
        rings, asked = strut_rings(machine, turn, z), {"orientation": turn, "fixed": {"z": z}}
        yield pytest.param(Case(machine, asked, area(rings), rings), id=f"rings {z}")
    nodes, weights = np.polynomial.legendre.leggauss(150)
    slices = [area(strut_rings(machine, turn, z), 1_000) for z in 205.0 + 145.0 * nodes]
    shells = Case(machine, {"orientation": turn, "within": {"z": (60.0, 350.0)}}, 145.0 * weights @ slices)
    yield pytest.param(shells, id="shells", marks=pytest.mark.campaign)
    linear, rod = pf.load("linear_delta").without_limits(), np.hypot(145.0 - 40.0, 252.0)
    cylinders = [(105.0 * np.cos(turn), 105.0 * np.sin(turn), 0.0, rod) for turn in np.radians([0.0, 120.0, 240.0])]
    whole = Case(linear, {"within": {"z": (-60.0, 40.0)}}, 100.0 * area(cylinders), cylinders)
    yield pytest.param(whole, id="cylinders")
    exact, machine = 8.0 * (2.0 - np.sqrt(2.0)) * 310.582854123025**3, pf.load("orthoglide").without_limits()
    yield pytest.param(Case(machine, {"resolution": 20.0}, exact), id="Steinmetz's solid")


@pytest.mark.parametrize("case", list(cases()))
def test_a_size_is_off_by_its_uncertainty_at_most_and_what_is_contained_is_what_closed_forms_say(case: Case) -> None:
    default = pf.workspace(case.machine, **case.options)
    assert default.uncertainty <= 0.02 * case.size
    if case.rings:
        points = grid(default, 100 if len(default.names) == 2 else 24)
        inside = within(case.rings, points)
        for name, (low, high) in case.options.get("within", {}).items():
            inside &= (points[:, default.names.index(name)] >= low) & (points[:, default.names.index(name)] <= high)
            assert {(name, "min"), (name, "max")} < set(default.shares)
        assert (default.contains(points) == inside).all()
    resolution = next(r for r, unit in zip(default.resolution, default.units, strict=True) if unit != "rad")
    coarser = [pf.workspace(case.machine, **case.options | {"resolution": f * resolution}) for f in (1.37, 2.9)]
    for found in (default, *coarser):
        assert abs(found.size - case.size) <= found.uncertainty <= 0.25 * case.size


def is_closed(faces: NDArray[np.int64]) -> bool:
    """Whether every edge of a mesh (in a plane: every vertex) is passed as often one way as the other."""
    if faces.shape[1] == 2:
        return Counter(faces[:, 0].tolist()) == Counter(faces[:, 1].tolist())
    ways = Counter(itertools.chain(*(map(tuple, faces[:, pair].tolist()) for pair in ([0, 1], [1, 2], [2, 0]))))
    return all(ways[b, a] == count for (a, b), count in ways.items())


RESOLUTIONS = {"stewart": 8.0, "delta": 12.0, "hexaglide": 8.0, "rps": 8.0, "ankle_ups": 0.05, "linear_delta": 14.0}


@cache
def space(name: str) -> pf.Workspace:
    """The workspace of a machine of the catalogue, with all its limits."""
    return pf.workspace(pf.load(name), resolution=RESOLUTIONS.get(name))


@pytest.mark.parametrize("name", ["stewart", "delta", "hexaglide", "rps", "five_bar", "ankle_ups"])
def test_the_mesh_is_closed_and_encloses_what_is_contained(name: str) -> None:
    found, n = space(name), 20_000
    assert is_closed(found.faces)
    low, high = found.bounds - [[0.05], [-0.05]] * np.ptp(found.bounds, axis=0)
    hits = float(found.contains(np.random.default_rng(1).uniform(low, high, (n, len(low)))).mean())
    box = float(np.prod(high - low))
    noise = box * np.sqrt(hits * (1.0 - hits) / n)
    assert abs(found.size - box * hits) <= 4.0 * noise + found.uncertainty


@cache
def modes() -> list[pf.Solution]:
    """Two working modes of a five-bar."""
    machine = pf.load("five_bar").without_limits()
    machine = machine.with_limits(p2=(np.radians(-140.0), np.radians(-10.0)), p5=(-0.6, 2.2))
    return [each for each in pf.working_modes(machine, [0.0, 10.0, 180.0]) if each][:2]


def in_mode(k: int) -> pf.Workspace:
    return pf.workspace(modes()[k].mechanism, start=modes()[k])


def anyhow(machine: pf.Mechanism, **options: Any) -> pf.Workspace:
    return pf.workspace(machine, orientation="any", **options)


def apart() -> pf.Workspace:
    return anyhow(struts(clearance=16.0), fixed={"z": 195.0}, resolution=10.0)


KEEP, ANYHOW = pf.Options(working_mode="keep"), pf.Options(hold="position", working_mode="any")
SLOW = pytest.mark.compiled
CONTAINED = [
    *(pytest.param(partial(space, name), None, pf.Options(), id=name) for name in (*RESOLUTIONS, "five_bar", "rrr")),
    *(pytest.param(partial(in_mode, k), k, KEEP, id=f"mode {k}") for k in (0, 1)),
    pytest.param(partial(anyhow, pf.load("stewart"), resolution=24.0), None, ANYHOW, id="stewart anyhow", marks=SLOW),
    pytest.param(partial(anyhow, pf.load("rrr"), resolution=20.0), None, ANYHOW, id="rrr anyhow", marks=SLOW),
    pytest.param(apart, None, ANYHOW, id="links apart anyhow", marks=SLOW),
]


@pytest.mark.parametrize("n", [150, pytest.param(10_000, marks=pytest.mark.campaign)])
@pytest.mark.parametrize(("make", "mode", "options"), CONTAINED)
def test_what_is_contained_is_what_is_reached(
    make: Callable[[], pf.Workspace], mode: int | None, options: pf.Options, n: int
) -> None:
    """In some orientation too, where `solve_ik` may miss some."""
    found, start = make(), None if mode is None else modes()[mode]
    middle, half = found.bounds.mean(axis=0), 0.55 * np.ptp(found.bounds, axis=0)
    points = np.random.default_rng(2).uniform(middle - half, middle + half, (n, len(half)))
    answers = pf.solve_ik(found.mechanism, found.poses(points), start=start, options=options)
    reached = answers.status == pf.Status.REACHED
    if options.hold == "position":
        reached = answers.position_error <= 1e-9 * found.mechanism.characteristic_length
    assert 0.1 < reached.mean() < 0.95
    contained = found.contains(points)
    assert contained[reached].all() and found.contains(found.vertices).mean() > 0.99
    assert options.hold == "position" or not contained[~reached].any()


@pytest.mark.compiled
def test_any_orientation_ends_at_a_window() -> None:
    machine = pf.load("rpr")
    low, high = anyhow(machine, resolution=0.2).bounds
    middle = 0.5 * (low + high)[0]
    found = anyhow(machine, resolution=0.2, within={"x": (middle, high[0] + 1.0)})
    assert found.bounds[0, 0] == pytest.approx(middle, abs=5e-3)
    assert ("x", "min") in found.shares


@pytest.mark.parametrize("name", ["stewart", "delta", "rps"])
def test_vertices_are_on_the_limits_they_name(name: str) -> None:
    found = space(name)
    told = pf.feasibility(found.mechanism, found.poses(found.vertices))
    bounds = np.array([bound for _, bound in found.limits])[found.vertex_limit]
    assert (told.margin >= 0.0).all()
    assert (
        np.mean(told.margin[np.isin(bounds, ["min", "max", "cone"])] < 0.01) > 0.99
    )  # beside where a leg just reaches
    # the left and the right rod of a pair meet their limits at once; at edges the limit beyond is another
    named = np.array([joint.translate({ord("L"): None, ord("R"): None}) + bound for joint, bound in found.limits])
    assert np.mean(named[told.binding] == named[found.vertex_limit]) > 0.98
    assert {found.limits[limit] for limit in found.face_limit.tolist()} == set(found.shares)
    assert sum(found.shares.values()) == pytest.approx(1.0)


def test_shares_of_a_joint_with_two_ranges_are_those_of_both() -> None:
    found = space("ankle_ups")
    assert sum(found.shares.values()) == pytest.approx(1.0)
    assert {place for group in groups_of(found) for place in group.limits} >= set(found.face_limit.tolist())
    own = np.array([limit == ("pivot", "min") for limit in found.limits])
    assert own.sum() == 2
    lengths = np.linalg.norm(np.diff(found.vertices[found.faces], axis=1)[:, 0], axis=1)
    expected = lengths[own[found.face_limit]].sum() / lengths.sum()
    assert found.shares["pivot", "min"] == pytest.approx(expected)


def test_a_box_that_grows_holds_all_of_a_workspace_far_from_home() -> None:
    """A rail ten times as long as what else there is: a box about home would cut it."""
    machine = pf.load("linear_delta").with_limits(A1=(-3000.0, 420.0), A2=(-3000.0, 420.0), A3=(-3000.0, 420.0))
    found = pf.workspace(machine, resolution=15.0)
    low, high = found.bounds[:, 2]
    lowest = pf.solve_ik(machine, [[0.0, 0.0, low + 1.0], [0.0, 0.0, low - 10.0]]).status
    assert lowest.tolist() == [pf.Status.REACHED, pf.Status.PROJECTED]
    assert high - low > 3000.0
    assert is_closed(found.faces)


def test_parts_that_do_not_hang_together_are_told_apart() -> None:
    """A 5-bar whose holes cut what is between them off, seen in a strip."""
    found = pf.workspace(pf.load("five_bar").without_limits(), within={"z": (-20.0, 20.0)})
    rings = [(y, 0.0, 35.0, 255.0) for y in (-50.0, 50.0)]
    assert len(found.components) == 3
    assert found.at_start is None  # home is above the strip
    whole = space("five_bar")
    assert whole.at_start is whole.components[0] and whole.at_start.contains(whole.mechanism.reference_point[1:])
    assert sum(part.area for part in found.components) == pytest.approx(found.area)
    middle = next(part for part in found.components if part.contains([0.0, 0.0]))
    assert not middle.contains([150.0, 0.0])
    assert found.contains([150.0, 0.0])
    points = grid(middle, 60)
    between = within(rings, points) & (np.abs(points[:, 1]) <= 20.0) & (np.abs(points[:, 0]) < 50.0)
    assert (middle.contains(points) == between).all()


LEANING = Rotation.from_rotvec([0.4, 0.3, 0.0])


def leaning_five_bar() -> pf.Mechanism:
    upright = closure.five_bar_with_tool()
    joints = [replace(each, at=LEANING.apply(each.at), axis=LEANING.apply(each.axis)) for each in upright.joints]
    return pf.Mechanism("leaning", joints, "c1", LEANING.apply(upright.reference_point), task=("x", "y", "z"))


@pytest.mark.parametrize(
    ("words", "machine", "options"),
    [
        ("x, y, z change in 2 directions", leaning_five_bar, {}),
        ("whose task has a tilt", closure.ruu, {"tilt": 0.1}),
        ("at most 2 coordinates", partial(pf.load, "ankle_ups"), {"over": ("tilt_x", "tilt_y", "yaw")}),
        ("can change, x, y, yaw", partial(pf.load, "rrr"), {"over": ("tilt_x", "tilt_y")}),
        ("can change, y, z", partial(pf.load, "five_bar"), {"over": ("x", "y")}),
        ("'z'.*nothing ends the workspace", lambda: pf.load("linear_delta").without_limits(), {"resolution": 15.0}),
    ],
)
def test_what_has_no_size_is_told(words: str, machine: Callable[[], pf.Mechanism], options: dict[str, Any]) -> None:
    with pytest.raises(InvalidArgument, match=words):
        pf.workspace(machine(), **options)


@pytest.mark.parametrize("angle", [0.0, 0.1])
def test_where_it_can_lean_to_every_side_it_can(angle: float) -> None:
    machine = struts_only(pf.load("stewart"))
    found = pf.workspace(machine, tilt=angle, fixed={"z": 200.0}, resolution=4.0)
    azimuths = np.arange(24 if angle else 1) * np.pi / 12.0
    leaning = [pf.pose([0, 0, 0], rotvec=[angle * np.cos(each), angle * np.sin(each), 0])[:3, :3] for each in azimuths]
    rings = [ring for rotation in leaning for ring in strut_rings(machine, rotation, 200.0)]
    assert found.area == pytest.approx(area(rings, lines=500), rel=2e-3)


def reached_at_some_yaw(mechanism: pf.Mechanism, points: Array) -> Array:
    """Whether a planar platform on struts reaches points (n, 2) at one of many yaws, by the lengths of its struts."""
    rows = np.zeros(len(points), bool)
    for yaw in np.linspace(-np.pi, np.pi, 2000, endpoint=False):
        rings = strut_rings(mechanism, pf.pose([0, 0, 0], rpy=[0, 0, yaw])[:3, :3], 0.0)
        rows |= within(rings, points)
    return rows


@pytest.mark.compiled
def test_any_orientation_is_that_of_some_yaw_of_a_platform_on_three_struts(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = struts_only(pf.load("rpr"))
    with monkeypatch.context() as patched:
        patched.setattr(MapQuestion, "_answers", None)  # what projects all that is out of reach
        found = pf.workspace(machine, orientation="any")
    low, high = found.bounds
    points = np.random.default_rng(5).uniform(low - 0.2, high + 0.2, (3000, 2))
    oracle, contained = reached_at_some_yaw(machine, points), found.contains(points)
    assert contained[oracle].all()
    assert (contained & ~oracle).sum() <= 6  # beside the border, between two yaws
    box = np.prod(high - low + 0.4)
    assert found.area == pytest.approx(oracle.mean() * box, rel=0.06)
    assert found.contains(found.vertices).all()
    assert sum(found.shares.values()) == pytest.approx(1.0)
    assert all(bound in ("min", "max") for _, bound in found.shares)


def test_orientations_at_a_place_are_those_that_are_reached_there() -> None:
    machine = pf.load("stewart")
    found = pf.workspace(machine, fixed={"x": 10.0, "y": 0.0, "z": 200.0}, resolution=0.1)
    assert found.names == ("tilt_x", "tilt_y", "yaw")
    assert found.units == ("rad", "rad", "rad")
    points = grid(found, 7)
    turns = [pf.pose([10, 0, 200], rotvec=[a, b, 0]) @ pf.pose([0, 0, 0], rpy=[0, 0, c]) for a, b, c in points]
    assert np.allclose(found.poses(points), turns, atol=1e-12)


def test_a_slice_is_what_a_plane_cuts_out() -> None:
    whole = space("stewart")
    cut = whole.slice({"z": 200.0}, resolution=2.0)
    assert cut.names == ("x", "y")
    assert cut.area == pytest.approx(pf.workspace(whole.mechanism, fixed={"z": 200.0}, resolution=2.0).area)
    points = grid(cut, 20)
    assert (cut.contains(points) == whole.contains(np.column_stack([points, np.full(400, 200.0)]))).all()


@pytest.mark.parametrize("centre", [(0.0, 150.0), None])
def test_the_largest_circle_touches_the_border(centre: tuple[float, float] | None) -> None:
    found = pf.workspace(pf.load("five_bar").without_limits())
    largest = found.inscribed("sphere", centre)
    away = [np.hypot(largest.centre[0] - y, largest.centre[1]) for y in (-50.0, 50.0)]
    room = min(min(255.0 - each, each - 35.0) for each in away)
    assert largest.extents == pytest.approx(np.full(2, 2.0 * room), rel=5e-3)
    if centre is None:
        assert room > 109.5  # on the axis of symmetry it is 110: (255 - 35) / 2


@pytest.mark.parametrize("kind", ["sphere", "box", "cylinder"])
def test_all_of_the_largest_shape_is_within(kind: str) -> None:
    found, proportions = space("delta"), {"sphere": None, "cylinder": (2, 1), "box": (3, 2, 1)}
    largest = found.inscribed(kind, proportions=proportions[kind])
    share = np.random.default_rng(3).uniform(-0.5, 0.5, (5000, 3))
    if kind == "sphere":
        share = share[np.linalg.norm(share, axis=1) <= 0.5]
    if kind == "cylinder":
        share = share[np.hypot(share[:, 0], share[:, 1]) <= 0.5]
        assert largest.extents[0] == pytest.approx(2.0 * largest.extents[2])
    assert found.contains(largest.centre + share * largest.extents).all()
    assert largest.size > 0.05 * found.volume


def test_who_interrupts_leaves_nothing_behind(tmp_path: Path) -> None:
    def stop(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        pf.workspace(pf.load("five_bar"), on_progress=stop)
    with ThreadPoolExecutor(1) as executor, pytest.raises(KeyboardInterrupt):
        pf.workspace(pf.load("five_bar"), on_progress=stop, executor=executor)
    found = pf.workspace(pf.load("five_bar"))
    with pytest.raises(OSError, match="nowhere"):
        found.save(tmp_path / "nowhere" / "ws.npz")
    with pytest.raises(InvalidArgument, match="plane"):
        found.save(tmp_path / "ws.stl")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "asked"), [("five_bar", {}), ("rpr", {"orientation": "any"}), ("panda", {"over": ["x", "z"]})]
)
def test_the_share_done_never_falls_and_ends_at_all(name: str, asked: dict[str, Any]) -> None:
    told: list[tuple[int, int]] = []
    pf.workspace(pf.load(name), **asked, on_progress=lambda done, total: told.append((done, total)))
    assert len(told) > 4
    assert all(x * n <= y * m for (x, m), (y, n) in pairwise(told))
    assert [done for done, _ in told] == sorted(done for done, _ in told)
    assert told[-1][0] == told[-1][1]


def test_what_is_saved_can_be_read_again(tmp_path: Path) -> None:
    found = pf.workspace(pf.load("stewart"), resolution=20.0)
    for ending in ("npz", "stl", "ply", "csv"):
        found.save(tmp_path / f"ws.{ending}")
    arrays = np.load(tmp_path / "ws.npz")
    assert np.array_equal(arrays["vertices"], found.vertices)
    assert arrays["limits"][arrays["face_limit"]].shape == (len(found.faces), 2)
    stl = (tmp_path / "ws.stl").read_bytes()
    rows = np.frombuffer(stl[84:], [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    assert len(rows) == len(found.faces) == int.from_bytes(stl[80:84], "little")
    corners = rows["corners"].astype(float)
    enclosed = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6.0
    assert enclosed == pytest.approx(found.volume, rel=1e-4)
    assert (np.einsum("ij,ij->i", rows["normal"], corners.mean(axis=1) - [0, 0, 200]) > 0.0).mean() > 0.95
    header, _, body = (tmp_path / "ws.ply").read_bytes().partition(b"end_header\n")
    assert f"element face {len(found.faces)}".encode() in header
    assert len(body) == 24 * len(found.vertices) + 17 * len(found.faces)
    with (tmp_path / "ws.csv").open(encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == len(found.vertices)
    assert {(line["joint"], line["bound"]) for line in lines} >= set(found.shares)


def test_a_picture_has_every_limit_of_the_border_and_the_machine() -> None:
    """Stops of motors and of elbows differ in colour, copies do not, and all are named where they are."""
    pyplot = pytest.importorskip("matplotlib.pyplot")
    tip = pf.solve_ik(pf.load("five_bar"), (0.0, 40.0, 160.0))
    found = pf.workspace(tip.mechanism, start=tip)
    assert set(found.shares) == {(joint, bound) for joint in ("p1", "p2", "p4", "p5") for bound in ("min", "max")}
    groups = groups_of(found)
    motors = {f"p1, 5 {bound}, actuated" for bound in ("min", "max")}
    assert {group.label for group in groups} == motors | {f"p2, 4 {bound}" for bound in ("min", "max")}
    assert len({group.colour for group in groups}) == len(groups)
    assert {group.label for group in groups if group.is_motors} == motors
    assert {group.label for group in groups if group.colour in MOTOR_COLOURS} == motors
    axes = found.plot()
    assert sorted(text.get_text() for text in axes.texts) == sorted(" ".join(limit) for limit in found.shares)
    for text in axes.texts:
        nearest = np.argmin(np.linalg.norm(found.vertices - text.xy, axis=1))
        assert " ".join(found.limits[found.vertex_limit[nearest]]) == text.get_text()
    soft = look_of("light").soft
    ends = np.concatenate([line.get_xydata() for line in axes.lines if line.get_color() == soft])
    assert all(np.linalg.norm(ends - point[1:], axis=1).min() < 1e-9 for point in tip.points.values())
    assert found.plot(axes) is axes
    with pytest.raises(InvalidArgument, match="three-dimensional axes"):
        found.plot(pyplot.figure().add_subplot(projection="3d"))
    turns = space("ankle_ups").plot()  # which has no place for the machine
    assert not [line for line in turns.lines if line.get_color() == soft]


def test_groups_beyond_the_colours_are_one_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    assert {group.name for group in groups_of(space("delta"))} >= {"A1…3 min", "A1…3 max", "BL1…3 cone"}
    monkeypatch.setattr(sys.modules["pfabrik.capabilities.workspace.border"], "MOTOR_COLOURS", ("#0072b2",))
    names = [group.name for group in groups_of(space("five_bar"))]
    assert names[-1] == "2 other limits" and len(names) == 4


def test_copies_are_joints_of_one_type_that_a_number_or_letters_tell_apart() -> None:
    prismatic = ["carriage_a", "carriage_b", "carriage_c", "axis_1", "axis_2"]
    turning = [
        "upper_al",
        "upper_ar",
        "upper_bl",
        "upper_br",
        "liftX",
        "liftY",
        "liftZ",
        "arm_l",
        "arm_r",
        "carriage_d",
    ]
    stems = stems_of(dict.fromkeys(prismatic, "prismatic") | dict.fromkeys(turning, "revolute"))
    alone = {"arm_l", "arm_r", "carriage_d"}  # a pair may be left and right; one is of another type
    assert {name for name, stem in stems.items() if stem == name} == alone
    assert set(stems.values()) - alone == {"carriage_", "axis_", "upper_", "lift"}


@pytest.mark.parametrize("first", [MOTOR_COLOURS[:2], MOTOR_COLOURS[2:], JOINT_COLOURS[:2], JOINT_COLOURS[2:]])
def test_both_bounds_of_a_joint_differ_in_any_light(first: tuple[str, str]) -> None:
    """In lightness, green-red and blue-yellow of CIELAB: no light of the one looks like a light of the other."""
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    deuteranope = [[0.3673, 0.8606, -0.2280], [0.2801, 0.6725, 0.0474], [-0.0118, 0.0429, 0.9689]]
    protanope = [[0.1523, 1.0526, -0.2049], [0.1145, 0.7863, 0.0992], [-0.0039, -0.0481, 1.0520]]
    turns = np.radians(np.arange(0, 91, 10))
    eye = Eye(90.0, -90.0)
    normals = np.array([[np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)] for a in turns for b in 4.0 * turns])
    for seen in (np.eye(3), deuteranope, protanope):
        labs = []
        for colour in first:
            value = in_the_light(normals, eye, np.array([int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]))
            linear = np.where(value > 0.04045, ((value + 0.055) / 1.055) ** 2.4, value / 12.92)
            x, y, z = np.cbrt(np.clip(linear @ np.transpose(seen), 1e-3, 1.0) @ to_xyz.T / to_xyz.sum(axis=1)).T
            labs.append(np.stack([116.0 * y, 500.0 * (x - y), 200.0 * (y - z)], axis=1))
        assert np.linalg.norm(labs[0][:, None] - labs[1], axis=2).min() > 25.0


def test_limits_that_are_met_together_do_not_alternate() -> None:
    found = space("delta")
    cones = {joint for joint, bound in found.shares if bound == "cone"}
    assert cones == {"BL1", "BL2", "BL3"}  # both rods of a parallelogram have the same direction
    rows = np.linspace(0, len(found.vertices) - 1, 200).astype(int)
    margins = pf.margins(pf.solve_ik(found.mechanism, found.poses(found.vertices[rows])))
    for leg in "123":
        assert margins[f"BL{leg}", "cone"] == pytest.approx(margins[f"BR{leg}", "cone"], abs=1e-6)


@pytest.mark.parametrize("name", ["delta", "rps", "five_bar"])
def test_of_limits_met_together_the_first_binds(name: str) -> None:
    """Equal to 1e-9 of their ranges; in blocks of poses, and one by one."""
    found = space(name)
    machine, points = found.mechanism, found.vertices[np.random.default_rng(5).integers(len(found.vertices), size=400)]
    poses = found.poses(points + 0.02 * (found.bounds.mean(axis=0) - points))
    answers = pf.solve_ik(machine, poses)
    margins = pf.margins(answers[np.asarray(answers.status) == pf.Status.REACHED])
    told = pf.feasibility(machine, poses[np.asarray(answers.status) == pf.Status.REACHED])
    order = sorted(margins, key=told.limits.index)
    values = np.stack([np.asarray(margins[limit]) for limit in order])
    first = (values <= values.min(axis=0) + 1e-9).argmax(axis=0)
    assert len(first) > 100
    assert [told.limits[place] for place in told.binding] == [order[place] for place in first]
    np.testing.assert_allclose(told.margin, values.min(axis=0), atol=1.1e-9)


def test_a_window_is_looked_at_however_far_from_the_start_it_is_and_may_be_empty() -> None:
    none = pf.workspace(pf.load("stewart"), fixed={"z": 5000.0})
    assert (none.area, len(none.faces), none.components) == (0.0, 0, ()) and not none.contains([0.0, 0.0])
    assert pf.workspace(pf.load("five_bar"), within={"y": (1e5, 2e5)}, resolution=10.0).size == 0.0
    rail = pf.Joint("rail", "prismatic", ("base", "car"), axis=(1, 0, 0), actuated=True)
    lift = pf.Joint("lift", "prismatic", ("car", "platform"), axis=(0, 1, 0), actuated=True, range=(-1, 1))
    post = pf.Joint("post", "fixed", ("platform", "tip"), at=(0, 0, 1))
    machine = pf.Mechanism("gantry", [rail, lift, post], "tip", (0, 0, 1), task=("x", "y"))
    far = 9.0 * machine.characteristic_length
    found = pf.workspace(machine, within={"x": (far, far + 1.0)})
    np.testing.assert_allclose(found.bounds, [[far, -1.0], [far + 1.0, 1.0]], atol=0.05)


def test_what_no_closed_form_answers_is_explored_to_the_workspace_of_what_it_nearly_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    exact = struts_only(pf.load("delta"))
    apart = closure.with_hinges_apart(exact)
    asked = {"fixed": {"z": -200.0}, "resolution": 15.0}
    begin = np.array([0.0, 0.0])
    with monkeypatch.context() as patched:
        patched.setattr(MapQuestion, "_answers", None)  # what projects all that is out of reach
        explored = pf.workspace(apart, **asked)
        with ThreadPoolExecutor(2) as executor:
            assert pf.workspace(apart, **asked, executor=executor).size == explored.size
    known = pf.workspace(exact, **asked)
    assert explored.size == pytest.approx(known.size, rel=2e-3)
    assert explored.bounds == pytest.approx(known.bounds, abs=0.5)
    assert {limit for limit, share in explored.shares.items() if share > 0.05} == {(f"A{k}", "max") for k in (1, 2, 3)}
    assert len(explored.components) == 1 and explored.at_start is not None
    assert bool(explored.contains(begin)) and bool(known.contains(begin))


# Links kept apart


@pytest.mark.compiled
def test_a_border_is_where_links_are_as_near_as_they_may_be() -> None:
    machine = struts(clearance=10.0)
    found = pf.workspace(machine, over=["tilt_x", "yaw"], resolution=0.05)
    limits = np.array([bound for _, bound in found.limits])[found.vertex_limit]
    assert np.mean(limits == "clearance") > 0.9
    poses = found.poses(found.vertices)
    distances = distances_of_struts(poses)
    least = np.min(list(distances.values()), axis=0)
    np.testing.assert_allclose(least[limits == "clearance"], 10.0, atol=0.01)  # a thousandth of a cell, times 200 mm
    assert (least > 10.0 - 1e-9).all()
    names = [found.limits[place][0] for place in found.vertex_limit[limits == "clearance"].tolist()]
    own = np.array(
        [distances[name][row] for row, name in zip(np.flatnonzero(limits == "clearance"), names, strict=True)]
    )
    np.testing.assert_allclose(own, 10.0, atol=0.01)
    groups = groups_of(found)
    of_links = [group for group in groups if group.is_links]
    assert {group.colour for group in of_links} <= set(LINK_COLOURS) and of_links
    assert all("clearance" in group.name and not group.is_motors for group in of_links)
    assert "clearance" in found._repr_html_()


@pytest.mark.compiled
def test_a_map_that_explores_without_closed_forms_goes_round_an_obstacle() -> None:
    machine = pf.load("panda")
    length, at = machine.characteristic_length, np.array([406.9, 100.0, 697.0])
    shapes = [
        pf.Shape("link6", thickness=0.02 * length, between=("J6", "J7")),
        pf.Shape(machine.base, "sphere", at=at, diameter=0.2 * length),
    ]
    kept = machine.with_shapes(shapes).with_clearance(0.02 * length)
    place = {"z": float(machine.home_pose[2, 3])}
    found = pf.workspace(kept, fixed=place, resolution=0.05 * length)
    assert found.limits[[bound for _, bound in found.limits].index("clearance")][0] == "link6–base"
    by_links = np.flatnonzero([found.limits[limit][1] == "clearance" for limit in found.vertex_limit])
    assert len(by_links) > 8
    in_its_mode = pf.Options(working_mode="keep")  # others reach farther
    points = pf.solve_ik(kept, found.poses(found.vertices[by_links]), options=in_its_mode).points
    first, second = points["J6"], points["J7"]
    share = np.clip(((at - first) * (second - first)).sum(1) / ((second - first) ** 2).sum(1), 0.0, 1.0)
    distance = np.linalg.norm(at - first - share[:, None] * (second - first), axis=1) - 0.11 * length
    assert (distance > 0.02 * length - 1e-6).all()
    assert np.median(distance) == pytest.approx(0.02 * length, abs=1e-3 * length)
    assert distance.max() < 0.07 * length  # a cell: the arm is redundant, and answers may have another elbow
    assert not found.contains([406.9, 100.0])


@pytest.mark.parametrize("name", ["stewart", "rps", "prs", "tricept"])
def test_a_workspace_without_an_end_is_refused_before_it_is_searched(name: str) -> None:
    looked: list[int] = []
    with pytest.raises(pf.errors.InvalidArgument, match="nothing ends the workspace"):
        pf.workspace(pf.load(name).without_limits(), on_progress=lambda done, total: looked.append(done))
    assert max(looked, default=0) < 10_000
