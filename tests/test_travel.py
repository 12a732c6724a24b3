"""How far the end effector can go: as far as closed forms say, no farther, and stopped by the limits they name."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

import oracles
import pfabrik as pf
from checks import INTERPRETED
from links import distances_of_struts, struts
from machines import closure, tripod_rps
from pfabrik import Joint, Mechanism, Solution, Status
from pfabrik.files import loads
from pfabrik.tolerances import TOLERANCES

BESIDE = 1e-8
"""How far before the end must be reached, and after it must not [L or rad]: it is told to 1e-9, closed forms tell
limits to 1e-9, and a way may meet a limit at a slant."""
MACHINES = ["five_bar", "stewart", "servo_hexapod", "rpr", "delta", "linear_delta"]
X, Y, Z = np.eye(3)


def home_of(mechanism: Mechanism) -> Solution:
    return pf.solve_ik(mechanism, mechanism.home_pose)


def rays_of(mechanism: Mechanism, n: int) -> np.ndarray:
    """Directions (n, 3); of a planar machine, in its plane."""
    rays = np.random.default_rng(5).normal(size=(n, 3))
    hinges = [np.array(joint.axis) for joint in mechanism.joints if joint.type == "revolute"]
    normal = np.mean(hinges, axis=0) if len(hinges) else np.zeros(3)
    if np.isclose(np.linalg.norm(normal), 1.0):
        rays -= np.outer(rays @ normal, normal)
    return rays


# --- along --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", MACHINES)
def test_closed_forms_reach_all_the_way_and_no_farther(name: str) -> None:
    mechanism = pf.load(name)
    rays = rays_of(mechanism, 2 if INTERPRETED else 12)
    distances = pf.travel(home_of(mechanism), along=rays).distances
    assert (distances > 0.01 * mechanism.characteristic_length).all()
    beside = BESIDE * mechanism.characteristic_length
    for ray, far in zip(rays, distances, strict=True):
        steps = np.append(np.linspace(0.0, far, 100, endpoint=False), (far - beside, far + beside))
        way = np.array(mechanism.reference_point) + np.outer(steps, ray / np.linalg.norm(ray))
        reached = oracles.solve_ik(mechanism, way).reached
        np.testing.assert_array_equal(reached, [True] * 101 + [False])


def gantry(*ranges: tuple[float, float] | None) -> Mechanism:
    """Slides along x, y and z, one on the other."""
    bodies = ("base", "bridge", "trolley", "tool")
    joints = [
        Joint(f"P{k}", "prismatic", bodies[k : k + 2], axis=np.eye(3)[k], actuated=True, range=limits)
        for k, limits in enumerate(ranges)
    ]
    return Mechanism("gantry", joints, "tool", (1, 2, 3), task=("x", "y", "z"))


def test_a_gantry_goes_to_the_sides_of_its_box() -> None:
    """By the closure engine, and for ever where nothing limits a slide."""
    machine = gantry((-5.0, 5.0), (-1.0, 7.0), None)
    rays = [(2, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -3, 0), (1, 1, 0), (0, 0, 1), (0, 0, -1)]
    found = pf.travel(pf.solve_ik(machine, (2, 2, 3)), along=rays)
    np.testing.assert_allclose(found.distances[:5], [4, 6, 7, 1, 4 * np.sqrt(2)], atol=1e-8)
    stops = [[(limit.joint, limit.bound) for limit in reach.stopped_by] for reach in found]
    assert stops == [[("P0", "max")], [("P0", "min")], [("P1", "max")], [("P1", "min")], [("P0", "max")], [], []]
    assert np.isinf(found.distances[5:]).all() and [reach.end for reach in found[5:]] == [None, None]
    np.testing.assert_allclose(found[4].end.pose[:3, 3], (6, 6, 3), atol=1e-8)


def test_a_hexapod_without_limits_goes_on_for_ever() -> None:
    assert np.isinf(pf.travel(home_of(pf.load("stewart").without_limits()), along=Z).distances).all()


def test_where_there_is_no_freedom_there_is_no_way() -> None:
    machine = pf.load("five_bar")
    assert pf.travel(home_of(machine), along=X).distances <= 2e-9 * machine.characteristic_length


def test_what_a_task_leaves_out_follows() -> None:
    """A 3-RPS goes up until its struts are out, shifting as it must: it does not where it stays level."""
    machine = tripod_rps()
    stroke = max(machine.joint(name).range[1] for name in machine.actuator_names)
    foot, head = (np.array(machine.joint(name).at) for name in machine.joint(machine.actuator_names[0]).along)
    height = np.sqrt(stroke**2 - np.sum((head - foot)[:2] ** 2)) - (head - foot)[2]
    (up,) = pf.travel(home_of(machine), along=Z)
    assert up.distance == pytest.approx(height, rel=1e-7)
    assert {(limit.joint, limit.bound) for limit in up.stopped_by} == {(name, "max") for name in machine.actuator_names}


def elbows(solution: Solution) -> list[bool]:
    """Of a 5-bar in the plane x = 0: which way each arm is bent."""
    p = solution.points
    return [bool(np.cross(p[b] - p[a], p["p3"] - p[b])[0] > 0) for a, b in (("p1", "p2"), ("p5", "p4"))]


def test_what_nothing_else_determines_gives_way_before_a_limit_stops_it() -> None:
    """A delta on a gantry goes as far as both of them; across the gantry as far as the delta alone."""
    delta, length = pf.load("delta"), 500.0
    carried = [
        replace(
            joint,
            connects=tuple("gantry" if body == "base" else body for body in joint.connects),
            cone=joint.cone and replace(joint.cone, fixed_to=joint.cone.fixed_to.replace("base", "gantry")),
        )
        for joint in delta.joints
    ]
    stage = Joint("stage", "prismatic", ("base", "gantry"), axis=X, actuated=True, range=(0.0, length))
    hybrid = Mechanism("delta on a gantry", [stage, *carried], "platform", delta.reference_point, task=delta.task)
    alone, both = (pf.travel(home_of(each), along=[X, -X, Y]) for each in (delta, hybrid))
    np.testing.assert_allclose(both.distances - alone.distances, [length, 0.0, 0.0], atol=1e-5)
    stops = {limit.joint for limit in alone[0].stopped_by}
    assert {limit.joint for limit in both[0].stopped_by} == {"stage"} | stops


def test_every_working_mode_goes_its_own_way() -> None:
    """A folded elbow goes as far as a bent one where nothing limits either, and each stays as it is."""
    machine = pf.load("five_bar").without_limits()
    modes = pf.working_modes(machine, (0.0, 10.0, 180.0))
    found = [pf.travel(mode, along=[Z, -Z]) for mode in modes]
    assert len({tuple(elbows(mode)) for mode in modes}) == 4
    for mode, travelled in zip(modes, found, strict=True):
        assert all(elbows(reach.end) == elbows(mode) and not reach.stopped_by for reach in travelled)
    up = [travelled.distances[0] for travelled in found]
    np.testing.assert_allclose(up, up[0], atol=1e-8 * machine.characteristic_length)


# --- about --------------------------------------------------------------------------------------------------------


def room_of_hexapod(mechanism: Mechanism, pose: np.ndarray) -> dict[tuple[str, str], float]:
    """(joint, bound) -> room left to the limit of every strut, and of the cones at its ends [length or rad]."""
    room = {}
    for strut in (joint for joint in mechanism.joints if joint.along):
        foot, head = (mechanism.joint(name) for name in strut.along)
        line = pose[:3, 3] + pose[:3, :3] @ np.subtract(head.at, mechanism.reference_point) - foot.at
        length = np.linalg.norm(line)
        room |= {(strut.name, "min"): length - strut.range[0], (strut.name, "max"): strut.range[1] - length}
        axes = ((foot, np.array(foot.cone.axis), line), (head, pose[:3, :3] @ head.cone.axis, -line))
        for joint, axis, way in axes:
            angle = np.arccos(axis @ way / np.linalg.norm(axis) / length)
            room[joint.name, "cone"] = joint.cone.half_angle - angle
    return room


@pytest.mark.parametrize("pivot", [None, (0.0, 0.0, 0.0), (30.0, -60.0, 250.0)])
def test_a_hexapod_goes_along_and_turns_about_a_point_until_its_tightest_limit_is_met(pivot: Any) -> None:
    """From a turned pose off the middle, to the first root of any strut's length, or cone; those met are named."""
    mechanism = pf.load("stewart")
    length = mechanism.characteristic_length
    origin = pf.pose(np.add(mechanism.reference_point, (10.0, -5.0, 20.0)), rpy=(0.05, -0.1, 0.1))
    along, about = np.random.default_rng(7).normal(size=(2, 2 if INTERPRETED else 12, 3))
    found = pf.travel(pf.solve_ik(mechanism, origin), along=along, about=about, pivot=pivot)
    assert [reach.kind for reach in found] == ["along"] * len(along) + ["about"] * len(about)
    centre = origin[:3, 3] if pivot is None else np.array(pivot)
    for reach, given in zip(found, (*along, *about), strict=True):
        direction, unit = given / np.linalg.norm(given), length if reach.kind == "along" else 1.0
        np.testing.assert_allclose(reach.direction, direction, atol=1e-15)

        def at(distance: float, kind: str = reach.kind, direction: np.ndarray = direction) -> np.ndarray:
            if kind == "along":
                return pf.pose(origin[:3, 3] + distance * direction, rotation=origin[:3, :3])
            turn = Rotation.from_rotvec(distance * direction).as_matrix()
            return pf.pose(centre + turn @ (origin[:3, 3] - centre), rotation=turn @ origin[:3, :3])

        steps = (*np.linspace(0.0, reach.distance, 30, endpoint=False), reach.distance - BESIDE * unit)
        assert min(min(room_of_hexapod(mechanism, at(step)).values()) for step in steps) >= 0.0
        assert min(room_of_hexapod(mechanism, at(reach.distance + BESIDE * unit)).values()) < 0.0
        np.testing.assert_allclose(reach.end.pose, at(reach.distance), rtol=0, atol=1e-8 * length)
        room = room_of_hexapod(mechanism, reach.end.pose)
        near = {
            limit for limit, left in room.items() if left <= TOLERANCES.active * (1.0 if "cone" in limit else length)
        }
        assert {(limit.joint, limit.bound) for limit in reach.stopped_by} == near != set()


def test_a_hinge_turns_about_its_own_axis_as_far_as_its_range_and_about_no_other_line() -> None:
    machine = closure.hinge()  # at (10, 0, 0), counted from 0.3, range -1 to 2
    home = home_of(machine)
    found = pf.travel(home, about=[2 * Z, -Z, X], pivot=(10, 0, 7))
    np.testing.assert_allclose(found.distances, [1.7, 1.3, 0.0], atol=1e-8)
    assert [[limit.bound for limit in reach.stopped_by] for reach in found] == [["max"], ["min"], []]
    assert pf.travel(home, about=Z, pivot=(0, 0, 0)).distances <= 1e-8
    assert pf.travel(home, about=Z).distances <= 1e-8  # its reference point, which the hinge carries along
    free = home_of(machine.without_limits())
    assert np.isinf(pf.travel(free, about=Z, pivot=(10, 0, 0)).distances).all()  # a full turn, and round again


@pytest.mark.parametrize("end", [np.pi, 9.0])
@pytest.mark.parametrize("actuated", [True, False])
def test_a_turntable_stops_at_the_end_of_its_turns(end: float, actuated: bool) -> None:
    """From its end on, what it would reach is a turn back, whether it has several turns or a single one."""
    joints = [
        Joint("T", "revolute", ("base", "table"), at=(0, 0, 0), axis=Z, actuated=actuated, range=(-end, end)),
        Joint("A", "revolute", ("base", "crank"), at=(50, 0, 0), axis=Z, actuated=not actuated),
        Joint("B", "revolute", ("crank", "rod"), at=(50, 20, 0), axis=Z),
        Joint("C", "revolute", ("rod", "table"), at=(0, 20, 0), axis=Z),
    ]
    turntable = Mechanism("turntable", joints, "table", (0, 0, 0), task=("yaw",))
    q = np.array([0.3, 0.3, -0.3, 0.3]) * (end - 0.2) / 0.3
    there = pf.travel(pf.configuration(turntable, q), about=Z)[0]
    assert there.distance == pytest.approx(0.2, abs=2e-9)
    assert [(limit.joint, limit.bound) for limit in there.stopped_by] == [("T", "max")]


def pivot_angles(pose: np.ndarray) -> tuple[float, float]:
    """Angles of an ankle's pivot, about y and then about x, whose z axis points as a pose's does."""
    x, y, z = pose[:3, 2]
    return float(np.arctan2(x, z)), float(np.arcsin(-y))


def room_of_ankle(mechanism: Mechanism, pose: np.ndarray) -> dict[tuple[str, str], float]:
    """(joint, bound) -> room left to the limits of the catalogue's 2-UPS/U at a tilt [length or rad]."""
    room, angles = {}, pivot_angles(pose)
    for angle, (low, high) in zip(angles, mechanism.joint("pivot").range, strict=True):
        for bound, left in (("min", angle - low), ("max", high - angle)):
            room["pivot", bound] = min(left, room.get(("pivot", bound), np.inf))
    tilted = pf.pose(mechanism.reference_point, rotation=Rotation.from_euler("YX", angles))
    return room | room_of_hexapod(mechanism, tilted)


def test_a_tilt_stops_where_the_pivot_does_and_by_its_name() -> None:
    """By default about the platform's x and y axes, both ways: at home these are the pivot's own."""
    machine = pf.load("ankle_ups").with_limits(BL=(50.0, 160.0), BR=(50.0, 160.0))
    found = pf.travel(home_of(machine))
    assert [(reach.kind, reach.direction) for reach in found] == [
        ("about", (1, 0, 0)), ("about", (-1, 0, 0)), ("about", (0, 1, 0)), ("about", (0, -1, 0)),
    ]  # fmt: skip
    np.testing.assert_allclose(np.degrees(found.distances), [25, 25, 40, 25], atol=1e-6)
    stops = [[(limit.joint, limit.bound, limit.coordinate) for limit in reach.stopped_by] for reach in found]
    assert stops == [[("pivot", "max", 1)], [("pivot", "min", 1)], [("pivot", "max", 0)], [("pivot", "min", 0)]]


def test_an_ankle_tilts_from_a_tilted_pose_until_its_tightest_limit_is_met() -> None:
    machine = pf.load("ankle_ups")
    start = pf.solve_ik(machine, {"pivot": (0.2, -0.1)})
    for reach, axis in zip(pf.travel(start), start.pose[:3, [0, 0, 1, 1]].T * [[1], [-1], [1], [-1]], strict=True):
        np.testing.assert_allclose(reach.direction, axis, atol=1e-12)

        def at(angle: float, axis: np.ndarray = axis) -> np.ndarray:
            return pf.pose(
                start.pose[:3, 3], rotation=Rotation.from_rotvec(angle * axis).as_matrix() @ start.pose[:3, :3]
            )

        steps = (*np.linspace(0.0, reach.distance, 30, endpoint=False), reach.distance - BESIDE)
        assert min(min(room_of_ankle(machine, at(step)).values()) for step in steps) >= 0.0
        beyond = room_of_ankle(machine, at(reach.distance + BESIDE))
        assert (
            {(limit.joint, limit.bound) for limit in reach.stopped_by}
            == {limit for limit, left in beyond.items() if left < 0.0}
            != set()
        )


# --- what is asked and what is told -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "kinds"),
    [
        ("stewart", ["along"] * 6 + ["about"] * 6),
        ("delta", ["along"] * 6),
        ("rps", ["along"] * 2 + ["about"] * 4),
        ("agile_eye", ["about"] * 6),
    ],
)
def test_by_default_every_axis_of_the_task_is_asked_for_both_ways(name: str, kinds: list[str]) -> None:
    found = pf.travel(home_of(pf.load(name)))
    assert [reach.kind for reach in found] == kinds
    for there, back in zip(found[::2], found[1::2], strict=True):
        np.testing.assert_array_equal(there.direction, np.negative(back.direction))
    if name == "rps":
        assert [reach.direction for reach in found[:2]] == [(0, 0, 1), (0, 0, -1)]


def test_each_direction_is_answered_for_itself() -> None:
    machine = pf.load("stewart")
    home, rays = home_of(machine), np.random.default_rng(6).normal(size=(4, 3))
    together = pf.travel(home, along=rays, about=rays)
    alone = [pf.travel(home, **{kind: 7.0 * ray}).distances[0] for kind in ("along", "about") for ray in rays]
    np.testing.assert_allclose(together.distances, alone, rtol=0, atol=2e-9 * machine.characteristic_length)
    assert len(pf.travel(home, along=np.zeros((0, 3)))) == 0


def test_a_travel_is_a_sequence_that_becomes_json() -> None:
    machine = gantry((-5.0, 5.0), None, None)
    start = pf.solve_ik(machine, (2, 2, 3))
    found = pf.travel(start, along=[X, Y])
    assert (len(found), found[1], list(found)) == (2, found.reaches[1], list(found.reaches))
    plain = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert plain["from"] == start.pose.tolist()
    assert plain["travel"] == [
        {
            "kind": "along",
            "direction": [1.0, 0.0, 0.0],
            "distance": found.distances[0],
            "stopped_by": [{"joint": "P0", "bound": "max"}],
            "cause": "",
        },
        {"kind": "along", "direction": [0.0, 1.0, 0.0], "distance": None, "stopped_by": [], "cause": ""},
    ]


def test_a_projected_answer_is_a_start_like_any_other() -> None:
    """A hexapod raised beyond reach goes no higher, and comes down as far as from any other pose above home."""
    machine = pf.load("stewart")
    top = pf.solve_ik(machine, (0, 0, 900))
    up, down = pf.travel(top, along=[Z, -Z])
    assert top.status == Status.PROJECTED and up.distance <= 1e-6 * machine.characteristic_length
    assert {limit.joint for limit in up.stopped_by} >= {limit.joint for limit in top.active_limits}
    from_home = pf.travel(home_of(machine), along=-Z).distances[0]
    height = top.pose[2, 3] - machine.reference_point[2]
    assert down.distance == pytest.approx(height + from_home, abs=1e-6 * machine.characteristic_length)


def test_a_rod_that_goes_faster_and_faster_stops_nothing_before_it_is_square_to_its_rail() -> None:
    """A lambda of two rods on rails: near the end of its way a step of the length of the first ones is not followed."""
    turn = np.radians
    joints = [
        Joint("P1", "prismatic", ("base", "car1"), axis=(1, 0, 0), actuated=True, range=(-80, 70)),
        Joint("P2", "prismatic", ("base", "car2"), axis=(1, 0, 0), actuated=True, range=(-90, 80)),
        Joint("A1", "revolute", ("car1", "rod1"), at=(-60, 0, 0), axis=(0, 0, 1), range=(turn(-35), turn(50))),
        Joint("A2", "revolute", ("car2", "rod2"), at=(110, -10, 0), axis=(0, 0, 1), range=(turn(-40), turn(50))),
        Joint("B", "revolute", ("rod1", "rod2"), at=(60, 65, 0), axis=(0, 0, 1), range=(turn(-60), turn(60))),
    ]
    machine = Mechanism("lambda", joints, "rod1", (160, 120, 0), task=("x", "y"))
    end = pf.travel(pf.solve_ik(machine, machine.home_pose), along=(0, 1, 0))[0]
    knee = np.hypot(50, 75) - 10  # how high B is with the second rod square to its rail
    lift = np.arcsin(knee / np.hypot(120, 65)) - np.arctan2(65, 120)
    assert end.distance == pytest.approx(220 * np.sin(lift) + 120 * np.cos(lift) - 120, abs=1e-6)


def test_a_limit_just_before_links_are_stretched_out_is_named() -> None:
    """There a hinge turns a thousand times as fast as the end effector goes."""
    free = pf.load("five_bar").without_limits()
    (stretched,) = pf.travel(home_of(free), along=Z)
    assert stretched.end is not None and not stretched.stopped_by
    assert abs(float(stretched.end.joints["p2"])) < 1e-4
    (reach,) = pf.travel(home_of(free.with_limits(p2=(-2.0, -2e-4))), along=Z)
    assert [(limit.joint, limit.bound) for limit in reach.stopped_by] == [("p2", "max")]
    assert reach.distance < stretched.distance


def test_a_turn_stops_where_struts_come_too_near() -> None:
    machine = struts(clearance=10.0)
    home = machine.home_pose

    def room(angle: float) -> float:
        turned = pf.pose(home[:3, 3], rotvec=(0.0, 0.0, angle))
        return min(float(distance[0]) for distance in distances_of_struts(turned[None]).values()) - 10.0

    expected = brentq(room, 1.2, 2.4, xtol=1e-13)
    (found,) = pf.travel(pf.solve_ik(machine, home), about=[0, 0, 1])
    assert found.distance == pytest.approx(expected, abs=1e-7)
    assert {limit.joint for limit in found.stopped_by} == {"BC1–BC4", "BC2–BC5", "BC3–BC6"}
    assert "BC1–BC4 too near" in found.why
    (free,) = pf.travel(pf.solve_ik(machine.with_clearance(None), home), about=[0, 0, 1])
    assert free.distance > found.distance + 0.1


# --- linkages -----------------------------------------------------------------------------------------------------

SLIDER_CRANK = """
schema = 1
name = "gripper"
units = { length = "mm", angle = "deg" }
base = "base"
end_effector = "jaw"
reference_point = [0, 40, 0]
task = ["yaw"]
joint = [
  { name = "hinge", type = "revolute", connects = ["base", "jaw"], at = [0, 0, 0], axis = [0, 0, 1] },
  { name = "knee", type = "revolute", connects = ["jaw", "rod"], at = [0, 40, 0], axis = [0, 0, 1] },
  { name = "pin", type = "revolute", connects = ["rod", "slide"], at = [69.28203230275508, 0, 0], axis = [0, 0, 1] },
  { name = "drive", type = "prismatic", connects = ["base", "slide"], axis = [1, 0, 0], actuated = true },
]
"""
PARALLELOGRAM = """
schema = 1
name = "parallelogram"
units = { length = "mm", angle = "deg" }
base = "base"
end_effector = "rocker"
reference_point = [90, 40, 0]
task = ["yaw"]
joint = [
  { name = "A", type = "revolute", connects = ["base", "crank"], at = [0, 0, 0], axis = [0, 0, 1], actuated = true },
  { name = "B", type = "revolute", connects = ["crank", "coupler"], at = [0, 40, 0], axis = [0, 0, 1] },
  { name = "C", type = "revolute", connects = ["coupler", "rocker"], at = [90, 40, 0], axis = [0, 0, 1] },
  { name = "D", type = "revolute", connects = ["base", "rocker"], at = [90, 0, 0], axis = [0, 0, 1] },
]
"""


@pytest.mark.skipif(INTERPRETED, reason="many steps")
@pytest.mark.parametrize("text", [SLIDER_CRANK, PARALLELOGRAM])
def test_a_linkage_stops_where_it_may_go_on_in_either_of_two_modes(text: str) -> None:
    """Both are in line, and so at a dead point of the slide or a change point, a quarter turn from home each way."""
    mechanism = loads(text)
    home = home_of(mechanism)
    found = pf.travel(home)
    np.testing.assert_allclose(found.distances, np.pi / 2.0, atol=1e-5)  # loops are closed to 1e-12, its square
    assert [reach.why for reach in found] == ["dead point"] * 2
    turns = np.radians([40.0, 80.0, 100.0, 130.0, 85.0, 20.0])
    poses = np.tile(mechanism.home_pose, (len(turns), 1, 1))
    poses[:, :3, :3] = Rotation.from_rotvec(np.outer(turns, Z)).as_matrix()
    path = pf.track(mechanism, poses)
    assert [answer.status.name for answer in path] == ["REACHED"] * 2 + ["PROJECTED"] * 2 + ["REACHED"] * 2
    np.testing.assert_allclose(path.rotation_error[2:4], turns[2:4] - np.pi / 2.0, atol=1e-5)
    assert all("dead point" in answer.reason for answer in path[2:4])
