"""How far the end effector can go: as far as closed forms say, no farther, and stopped by the limits they name."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

import oracles
import pfabrik as pf
from checks import INTERPRETED, task_errors
from links import distances_of_struts, struts
from machines import machine, tripod_rps
from machines.small import four_bar, slides
from pfabrik import Joint, Mechanism, Solution, Status
from pfabrik.tolerances import TOLERANCES
from pfabrik.travel import Reach

BESIDE = 1e-8
"""How far before the end must be reached, and after it must not [L or rad]: it is told to 1e-9, closed forms tell
limits to 1e-9, and a way may meet a limit at a slant."""
X, Y, Z = np.eye(3)
Room = Callable[[Mechanism, np.ndarray], dict[tuple[str, str], float]]
"""(joint, bound) -> room left to each limit at a pose [length or rad]."""


def home_of(mechanism: Mechanism) -> Solution:
    return pf.solve_ik(mechanism, mechanism.home_pose)


def stops(reach: Reach) -> list[tuple[str, str]]:
    return [(limit.joint, limit.bound) for limit in reach.stopped_by]


# --- along -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["five_bar", "stewart", "servo_hexapod", "rpr", "delta", "linear_delta"])
def test_closed_forms_reach_all_the_way_and_no_farther(name: str) -> None:
    mechanism = pf.load(name)
    rays = np.random.default_rng(5).normal(size=(2 if INTERPRETED else 8, 3))
    if name in ("five_bar", "rpr"):
        normal = np.array(mechanism.joints[0].axis)
        rays -= np.outer(rays @ normal, normal)
    distances = pf.travel(home_of(mechanism), along=rays).distances
    assert (distances > 0.01 * mechanism.characteristic_length).all()
    beside = BESIDE * mechanism.characteristic_length
    for ray, far in zip(rays, distances, strict=True):
        steps = np.append(np.linspace(0.0, far, 50, endpoint=False), (far - beside, far + beside))
        way = np.array(mechanism.reference_point) + np.outer(steps, ray / np.linalg.norm(ray))
        np.testing.assert_array_equal(oracles.solve_ik(mechanism, way).reached, [True] * 51 + [False])


def test_a_gantry_goes_to_the_sides_of_its_box_and_for_ever_where_nothing_limits_a_slide() -> None:
    mechanism = slides((-5.0, 5.0), (-1.0, 7.0), None)
    rays = [(2, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -3, 0), (1, 1, 0), (0, 0, 1), (0, 0, -1)]
    answer = pf.travel(pf.solve_ik(mechanism, (2, 2, 3)), along=rays)
    np.testing.assert_allclose(answer.distances[:5], [4, 6, 7, 1, 4 * np.sqrt(2)], atol=1e-8)
    ends = [("P0", "max"), ("P0", "min"), ("P1", "max"), ("P1", "min"), ("P0", "max")]
    assert list(map(stops, answer)) == [*([end] for end in ends), [], []]
    assert np.isinf(answer.distances[5:]).all() and [reach.end for reach in answer[5:]] == [None, None]
    np.testing.assert_allclose(answer[4].end.pose[:3, 3], (6, 6, 3), atol=1e-8)
    assert np.isinf(pf.travel(home_of(pf.load("stewart").without_limits()), along=Z).distances).all()


def test_where_there_is_no_freedom_there_is_no_way() -> None:
    mechanism = pf.load("five_bar")
    assert pf.travel(home_of(mechanism), along=X).distances <= 2e-9 * mechanism.characteristic_length


def test_what_a_task_leaves_out_follows() -> None:
    """A 3-RPS goes up until its struts are out, shifting as it must: it does not where it stays level."""
    mechanism = tripod_rps()
    stroke = max(mechanism.joint(name).range[1] for name in mechanism.actuator_names)
    foot, head = (np.array(mechanism.joint(name).at) for name in mechanism.joint(mechanism.actuator_names[0]).along)
    height = np.sqrt(stroke**2 - np.sum((head - foot)[:2] ** 2)) - (head - foot)[2]
    (up,) = pf.travel(home_of(mechanism), along=Z)
    assert up.distance == pytest.approx(height, rel=1e-7)
    assert set(stops(up)) == {(name, "max") for name in mechanism.actuator_names}


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
    joints = [{joint for joint, _ in stops(answer[0])} for answer in (alone, both)]
    assert joints[1] == {"stage"} | joints[0]


# --- about -----------------------------------------------------------------------------------------------------------


def room_of_struts(mechanism: Mechanism, pose: np.ndarray) -> dict[tuple[str, str], float]:
    """Of the length of every strut, and of the cones at its ends."""
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


def room_of_ankle(mechanism: Mechanism, pose: np.ndarray) -> dict[tuple[str, str], float]:
    """Of the catalogue's 2-UPS/U, whose pivot turns about y and then about x."""
    x, y, z = pose[:3, 2]
    angles = float(np.arctan2(x, z)), float(np.arcsin(-y))
    ends = np.array(mechanism.joint("pivot").range)
    room = {("pivot", "min"): min(angles - ends[:, 0]), ("pivot", "max"): min(ends[:, 1] - angles)}
    tilted = pf.pose(mechanism.reference_point, rotation=Rotation.from_euler("YX", angles))
    return room | room_of_struts(mechanism, tilted)


def at(reach: Reach, distance: float, origin: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """The pose at a distance along a reach's direction from an origin, or about it and a centre."""
    step = distance * np.array(reach.direction)
    if reach.kind == "along":
        return pf.pose(origin[:3, 3] + step, rotation=origin[:3, :3])
    turn = Rotation.from_rotvec(step).as_matrix()
    return pf.pose(centre + turn @ (origin[:3, 3] - centre), rotation=turn @ origin[:3, :3])


def assert_ends_where_room_does(answer: pf.Travel, room_of: Room, pivot: Any = None) -> None:
    """There is room for every limit up to the end, and not after it; those met there are named."""
    mechanism, origin = answer.origin.mechanism, answer.origin.pose
    centre, length = origin[:3, 3] if pivot is None else np.array(pivot), mechanism.characteristic_length
    for reach in answer:

        def room(distance: float, reach: Reach = reach) -> float:
            return min(room_of(mechanism, at(reach, distance, origin, centre)).values())

        beside = BESIDE * (length if reach.kind == "along" else 1.0)
        steps = (*np.linspace(0.0, reach.distance, 30, endpoint=False), reach.distance - beside)
        assert min(map(room, steps)) >= 0.0 > room(reach.distance + beside)
        assert task_errors(mechanism, reach.end.pose[None], at(reach, reach.distance, origin, centre)[None]) <= 1e-8
        near = set()
        for (joint, bound), left in room_of(mechanism, reach.end.pose).items():
            unit = length if mechanism.joint(joint).along else 1.0
            near |= {(joint, bound)} if left <= TOLERANCES.active * unit else set()
        assert set(stops(reach)) == near != set()


@pytest.mark.parametrize("pivot", [None, (0.0, 0.0, 0.0), (30.0, -60.0, 250.0)])
def test_a_hexapod_goes_along_and_turns_about_a_point_until_its_tightest_limit_is_met(pivot: Any) -> None:
    """From a turned pose off the middle."""
    mechanism = pf.load("stewart")
    start = pf.pose(np.add(mechanism.reference_point, (10.0, -5.0, 20.0)), rpy=(0.05, -0.1, 0.1))
    along, about = np.random.default_rng(7).normal(size=(2, 2 if INTERPRETED else 8, 3))
    answer = pf.travel(pf.solve_ik(mechanism, start), along=along, about=about, pivot=pivot)
    assert [reach.kind for reach in answer] == ["along"] * len(along) + ["about"] * len(about)
    for reach, given in zip(answer, (*along, *about), strict=True):
        np.testing.assert_allclose(reach.direction, given / np.linalg.norm(given), atol=1e-15)
    assert_ends_where_room_does(answer, room_of_struts, pivot)


def test_an_ankle_tilts_from_a_tilted_pose_until_its_tightest_limit_is_met() -> None:
    start = pf.solve_ik(pf.load("ankle_ups"), {"pivot": (0.2, -0.1)})
    answer = pf.travel(start)
    x, y = start.pose[:3, 0], start.pose[:3, 1]
    np.testing.assert_allclose([reach.direction for reach in answer], [x, -x, y, -y], atol=1e-12)
    assert_ends_where_room_does(answer, room_of_ankle)


def test_a_tilt_stops_where_the_pivot_does_and_by_its_name() -> None:
    """By default about the platform's x and y axes, both ways: at home these are the pivot's own."""
    mechanism = pf.load("ankle_ups").with_limits(BL=(50.0, 160.0), BR=(50.0, 160.0))
    answer = pf.travel(home_of(mechanism))
    np.testing.assert_allclose(np.degrees(answer.distances), [25, 25, 40, 25], atol=1e-6)
    named = [[(limit.joint, limit.bound, limit.coordinate) for limit in reach.stopped_by] for reach in answer]
    assert named == [[("pivot", "max", 1)], [("pivot", "min", 1)], [("pivot", "max", 0)], [("pivot", "min", 0)]]


def test_a_hinge_turns_about_its_own_axis_as_far_as_its_range_and_about_no_other_line() -> None:
    mechanism = machine("hinge")  # at (10, 0, 0), counted from 0.3, range -1 to 2
    home = home_of(mechanism)
    answer = pf.travel(home, about=[2 * Z, -Z, X], pivot=(10, 0, 7))
    np.testing.assert_allclose(answer.distances, [1.7, 1.3, 0.0], atol=1e-8)
    assert list(map(stops, answer)) == [[("R", "max")], [("R", "min")], []]
    assert pf.travel(home, about=Z, pivot=(0, 0, 0)).distances <= 1e-8
    assert pf.travel(home, about=Z).distances <= 1e-8  # its reference point, which the hinge carries along
    free = home_of(mechanism.without_limits())
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
    q = np.array([1.0, 1.0, -1.0, 1.0]) * (end - 0.2)
    there = pf.travel(pf.configuration(turntable, q), about=Z)[0]
    assert there.distance == pytest.approx(0.2, abs=2e-9)
    assert stops(there) == [("T", "max")]


# --- what is asked and what is told ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "kinds", "first"),
    [
        ("stewart", ["along"] * 6 + ["about"] * 6, X),
        ("delta", ["along"] * 6, X),
        ("rps", ["along"] * 2 + ["about"] * 4, Z),
        ("agile_eye", ["about"] * 6, X),
        ("ankle_ups", ["about"] * 4, X),
    ],
)
def test_by_default_every_axis_of_the_task_is_asked_for_both_ways(
    name: str, kinds: list[str], first: np.ndarray
) -> None:
    answer = pf.travel(home_of(pf.load(name)))
    assert [reach.kind for reach in answer] == kinds
    np.testing.assert_allclose(answer[0].direction, first, atol=1e-12)
    for there, back in zip(answer[::2], answer[1::2], strict=True):
        np.testing.assert_array_equal(there.direction, np.negative(back.direction))


def test_each_direction_is_answered_for_itself() -> None:
    mechanism = pf.load("stewart")
    home, rays = home_of(mechanism), np.random.default_rng(6).normal(size=(4, 3))
    together = pf.travel(home, along=rays, about=rays)
    alone = [pf.travel(home, **{kind: 7.0 * ray}).distances[0] for kind in ("along", "about") for ray in rays]
    np.testing.assert_allclose(together.distances, alone, rtol=0, atol=2e-9 * mechanism.characteristic_length)
    assert len(pf.travel(home, along=np.zeros((0, 3)))) == 0


def test_a_travel_is_a_sequence_that_becomes_json() -> None:
    start = pf.solve_ik(slides((-5.0, 5.0), None, None), (2, 2, 3))
    answer = pf.travel(start, along=[X, Y])
    assert (len(answer), answer[1], list(answer)) == (2, answer.reaches[1], list(answer.reaches))
    plain = json.loads(json.dumps(answer.to_dict(), allow_nan=False))
    fields, distances = ("kind", "direction", "distance", "stopped_by", "cause"), answer.distances
    rows = [
        ("along", [1.0, 0.0, 0.0], distances[0], [{"joint": "P0", "bound": "max"}], ""),
        ("along", [0.0, 1.0, 0.0], None, [], ""),
    ]
    assert plain == {"from": start.pose.tolist(), "travel": [dict(zip(fields, row, strict=True)) for row in rows]}


def test_a_projected_answer_is_a_start_like_any_other() -> None:
    """A hexapod raised beyond reach goes no higher, and comes down as far as from any other pose above home."""
    mechanism = pf.load("stewart")
    top, length = pf.solve_ik(mechanism, (0, 0, 900)), mechanism.characteristic_length
    up, down = pf.travel(top, along=[Z, -Z])
    assert top.status == Status.PROJECTED and up.distance <= 1e-6 * length
    assert {joint for joint, _ in stops(up)} >= {limit.joint for limit in top.active_limits}
    (from_home,) = pf.travel(home_of(mechanism), along=-Z).distances
    height = top.pose[2, 3] - mechanism.reference_point[2]
    assert down.distance == pytest.approx(height + from_home, abs=1e-6 * length)


# --- just before links are stretched out -----------------------------------------------------------------------------


def test_a_rod_that_goes_faster_and_faster_stops_nothing_before_it_is_square_to_its_rail() -> None:
    """A lambda of two rods on rails: near the end of its way a step of the length of the first ones is not followed."""
    turn = np.radians
    joints = [
        Joint("P1", "prismatic", ("base", "car1"), axis=X, actuated=True, range=(-80, 70)),
        Joint("P2", "prismatic", ("base", "car2"), axis=X, actuated=True, range=(-90, 80)),
        Joint("A1", "revolute", ("car1", "rod1"), at=(-60, 0, 0), axis=Z, range=(turn(-35), turn(50))),
        Joint("A2", "revolute", ("car2", "rod2"), at=(110, -10, 0), axis=Z, range=(turn(-40), turn(50))),
        Joint("B", "revolute", ("rod1", "rod2"), at=(60, 65, 0), axis=Z, range=(turn(-60), turn(60))),
    ]
    mechanism = Mechanism("lambda", joints, "rod1", (160, 120, 0), task=("x", "y"))
    (end,) = pf.travel(home_of(mechanism), along=Y)
    knee = np.hypot(50, 75) - 10  # how high B is with the second rod square to its rail
    lift = np.arcsin(knee / np.hypot(120, 65)) - np.arctan2(65, 120)
    assert end.distance == pytest.approx(220 * np.sin(lift) + 120 * np.cos(lift) - 120, abs=1e-6)


def test_a_limit_just_before_links_are_stretched_out_is_named() -> None:
    """There a hinge turns a thousand times as fast as the end effector goes."""
    free = pf.load("five_bar").without_limits()
    (stretched,) = pf.travel(home_of(free), along=Z)
    assert stretched.end is not None and stops(stretched) == [("p1", "stretched")]
    assert abs(float(stretched.end.joints["p2"])) < 1e-4
    (reach,) = pf.travel(home_of(free.with_limits(p2=(-2.0, -2e-4))), along=Z)
    assert stops(reach) == [("p2", "max")] and reach.distance < stretched.distance


def test_a_turn_stops_where_struts_come_too_near() -> None:
    mechanism = struts(clearance=10.0)
    home = mechanism.home_pose

    def room(angle: float) -> float:
        turned = pf.pose(home[:3, 3], rotvec=(0.0, 0.0, angle))
        return min(float(distance[0]) for distance in distances_of_struts(turned[None]).values()) - 10.0

    (reach,) = pf.travel(pf.solve_ik(mechanism, home), about=Z)
    assert reach.distance == pytest.approx(brentq(room, 1.2, 2.4, xtol=1e-13), abs=1e-7)
    assert {joint for joint, _ in stops(reach)} == {"BC1–BC4", "BC2–BC5", "BC3–BC6"}
    assert "BC1–BC4 clearance" in reach.why
    (free,) = pf.travel(pf.solve_ik(mechanism.with_clearance(None), home), about=Z)
    assert free.distance > reach.distance + 0.1


# --- linkages --------------------------------------------------------------------------------------------------------


def slider_crank() -> Mechanism:
    """A jaw that a slide turns by a rod."""
    joints = [
        Joint("hinge", "revolute", ("base", "jaw"), at=(0, 0, 0), axis=Z),
        Joint("knee", "revolute", ("jaw", "rod"), at=(0, 40, 0), axis=Z),
        Joint("pin", "revolute", ("rod", "slide"), at=(np.sqrt(80**2 - 40**2), 0, 0), axis=Z),
        Joint("drive", "prismatic", ("base", "slide"), axis=X, actuated=True),
    ]
    return Mechanism("gripper", joints, "jaw", (0, 40, 0), task=("yaw",))


@pytest.mark.skipif(INTERPRETED, reason="many steps")
@pytest.mark.parametrize("name", ["slider_crank", "parallelogram"])
def test_a_linkage_stops_where_it_may_go_on_in_either_of_two_modes(name: str) -> None:
    """Both are in line, and so at a dead point of the slide or a change point, a quarter turn from home each way."""
    pins = (0, 0), (0, 40), (90, 40), (90, 0)
    mechanism = slider_crank() if name == "slider_crank" else four_bar(*pins, task=("yaw",))
    answer = pf.travel(home_of(mechanism))
    np.testing.assert_allclose(answer.distances, np.pi / 2.0, atol=1e-5)  # loops are closed to 1e-12, its square
    assert [reach.why for reach in answer] == ["dead point"] * 2
    turns = np.radians([40.0, 80.0, 100.0, 130.0, 85.0, 20.0])
    path = pf.track(mechanism, pf.pose(mechanism.reference_point, rotvec=np.outer(turns, Z)))
    assert [answer.status.name for answer in path] == ["REACHED"] * 2 + ["PROJECTED"] * 2 + ["REACHED"] * 2
    np.testing.assert_allclose(path.rotation_error[2:4], turns[2:4] - np.pi / 2.0, atol=1e-5)
    assert all("dead point" in answer.reason for answer in path[2:4])
