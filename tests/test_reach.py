"""How far the end effector can go: as far as closed forms say, and no farther."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from machines import tripod_rps
from pfabrik import Joint, Mechanism, Options
from pfabrik.errors import InvalidArgument

INTERPRETED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
BESIDE = 1e-8
"""How far before the end must be reached, and after it must not [L]: it is told to 1e-9 L, closed forms tell limits to
1e-9, and a ray may meet a limit at a slant."""
MACHINES = ["five_bar", "stewart", "servo_hexapod", "rpr", "delta", "linear_delta"]


def directions_of(mechanism: Mechanism, n: int) -> np.ndarray:
    """Directions (n, 3); of a planar machine, in its plane."""
    rays = np.random.default_rng(5).normal(size=(n, 3))
    hinges = [np.array(joint.axis) for joint in mechanism.joints if joint.type == "revolute"]
    normal = np.mean(hinges, axis=0) if len(hinges) else np.zeros(3)
    if np.isclose(np.linalg.norm(normal), 1.0):
        rays -= np.outer(rays @ normal, normal)
    return rays


def along(origin: Any, ray: np.ndarray, distances: np.ndarray) -> np.ndarray:
    return np.asarray(origin) + np.multiply.outer(distances, ray / np.linalg.norm(ray))


def closed_form_reaches(mechanism: Mechanism, positions: np.ndarray) -> np.ndarray:
    return np.asarray(pf.geometric.solve_ik(mechanism, positions).reached)


@pytest.mark.parametrize("name", MACHINES)
def test_closed_forms_reach_all_the_way_and_no_farther(name: str) -> None:
    mechanism = pf.load(name)
    origin = mechanism.reference_point
    rays = directions_of(mechanism, 2 if INTERPRETED else 12)
    distances = pf.travel(mechanism, origin, rays)
    assert (distances > 0.01 * mechanism.characteristic_length).all()
    for ray, far in zip(rays, distances, strict=True):
        beside = BESIDE * mechanism.characteristic_length
        way = along(origin, ray, np.append(np.linspace(0.0, far, 100, endpoint=False), (far - beside, far + beside)))
        np.testing.assert_array_equal(closed_form_reaches(mechanism, way), [True] * 101 + [False])


def test_the_border_of_a_hexapod_is_where_its_tightest_limit_is_met() -> None:
    """From a turned pose off the middle: the first root of any strut's length, or cone, along the ray."""
    mechanism = pf.load("stewart")
    origin = pf.pose(np.add(mechanism.reference_point, (10.0, -5.0, 20.0)), rpy=(0.05, -0.1, 0.1))
    rays = directions_of(mechanism, 3 if INTERPRETED else 20)
    distances = pf.travel(mechanism, origin, rays)
    for ray, far in zip(rays, distances, strict=True):
        beside = BESIDE * mechanism.characteristic_length
        at = along(origin[:3, 3], ray, np.array([0.0, 0.5 * far, far - beside, far + beside]))
        rooms = [room_of_hexapod(mechanism, origin[:3, :3], position) for position in at]
        assert min(rooms[:3]) >= 0.0 > rooms[3]


def room_of_hexapod(mechanism: Mechanism, rotation: np.ndarray, position: np.ndarray) -> float:
    """The least room left to the limit of any strut, or of the cones at its ends [length or rad]."""
    rooms = []
    for strut in (joint for joint in mechanism.joints if joint.along):
        foot, head = (mechanism.joint(name) for name in strut.along)
        a = np.array(foot.at)
        c = position + rotation @ np.subtract(head.at, mechanism.reference_point)
        length = np.linalg.norm(c - a)
        rooms += [length - strut.range[0], strut.range[1] - length]
        axes = ((foot.cone, np.array(foot.cone.axis), c - a), (head.cone, rotation @ np.array(head.cone.axis), a - c))
        for cone, axis, line in axes:
            angle = np.arccos(axis @ line / np.linalg.norm(axis) / length)
            rooms.append(cone.half_angle - angle)
    return float(min(rooms))


def gantry(*ranges: tuple[float, float] | None) -> Mechanism:
    """Slides along x, y and z, one on the other."""
    bodies = ("base", "bridge", "trolley", "tool")
    joints = [
        Joint(f"P{k}", "prismatic", bodies[k : k + 2], axis=np.eye(3)[k], actuated=True, range=limits)
        for k, limits in enumerate(ranges)
    ]
    return Mechanism("gantry", joints, "tool", (1, 2, 3), task=("x", "y", "z"))


def test_a_gantry_reaches_the_sides_of_its_box() -> None:
    """By the closure engine, and for ever where nothing limits a slide."""
    machine = gantry((-5.0, 5.0), (-1.0, 7.0), None)
    rays = np.array([(2, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -3, 0), (0, 0, 1), (0, 0, -1), (1, 1, 0)])
    distances = pf.travel(machine, (2, 2, 3), rays)
    np.testing.assert_allclose(distances[[0, 1, 2, 3, 6]], [4, 6, 7, 1, 4 * np.sqrt(2)], atol=1e-8)
    assert np.isinf(distances[4:6]).all()


def test_a_hexapod_without_limits_goes_on_for_ever() -> None:
    machine = pf.load("stewart").without_limits()
    assert np.isinf(pf.travel(machine, machine.home_pose, (0, 0, 1)))


def test_where_there_is_no_freedom_there_is_no_way() -> None:
    machine = pf.load("five_bar")
    assert pf.travel(machine, machine.reference_point, (1, 0, 0)) <= 2e-9 * machine.characteristic_length


def test_what_a_task_leaves_out_follows() -> None:
    """A 3-RPS goes up until its struts are out, shifting as it must: it does not where it stays level."""
    machine = tripod_rps()
    stroke = max(machine.joint(name).range[1] for name in machine.actuator_names)
    foot, head = (np.array(machine.joint(name).at) for name in machine.joint(machine.actuator_names[0]).along)
    height = np.sqrt(stroke**2 - np.sum((head - foot)[:2] ** 2)) - (head - foot)[2]
    assert pf.travel(machine, machine.reference_point, (0, 0, 1)) == pytest.approx(height, rel=1e-7)


def test_the_seed_tells_the_working_mode() -> None:
    """A folded elbow reaches where a bent one does: what differs is the limits on the way."""
    machine = pf.load("five_bar").without_limits().with_limits(p2=np.radians((-100.0, 140.0)))
    low = (0.0, -5.0, 100.0)
    flipped = pf.solve_ik(machine, low)
    assert flipped
    with pytest.raises(InvalidArgument, match="origin"):
        pf.travel(machine, low, (0, 0, 1), start=pf.solve_ik(machine, machine.home_pose))
    assert pf.travel(machine, low, (0, 0, 1), start=flipped) > 0.0


@pytest.mark.parametrize("shape", [(), (1,), (4,), (2, 3), (0,)])
def test_distances_have_the_shape_of_the_directions(shape: tuple[int, ...]) -> None:
    machine = pf.load("stewart")
    rays = np.random.default_rng(6).normal(size=(*shape, 3))
    distances = pf.travel(machine, machine.home_pose, rays)
    assert np.shape(distances) == shape
    one_by_one = [pf.travel(machine, machine.reference_point, 7.0 * ray) for ray in rays.reshape(-1, 3)]
    np.testing.assert_allclose(np.ravel(distances), one_by_one, rtol=0, atol=2e-9 * machine.characteristic_length)


@pytest.mark.parametrize(
    ("origin", "rays", "named"),
    [
        ((0, 0, 900), (0, 0, 1), "origin: found a pose that is PROJECTED"),
        ([(0, 0, 195)] * 2, (0, 0, 1), "origin"),
        ((0, np.nan, 195), (0, 0, 1), "target"),
        ((0, 0, 195), (0, 0, 0), "directions"),
        ((0, 0, 195), [(0, 0, 1), (0, np.nan, 1)], r"directions.*rows?: 1"),
        ((0, 0, 195), (0, 1), "directions: found shape"),
        ((0, 0, 195), 1.0, "directions: found shape"),
        ((0, 0, 195), "up", "directions"),
    ],
)
def test_wrong_arguments_are_named(origin: Any, rays: Any, named: str) -> None:
    with pytest.raises(InvalidArgument, match=named):
        pf.travel(pf.load("stewart"), origin, rays)


def test_a_task_without_a_position_has_no_reach() -> None:
    machine = pf.load("agile_eye")
    with pytest.raises(InvalidArgument, match="task has a position"):
        pf.travel(machine, machine.home_pose, (0, 0, 1))


def test_options_count() -> None:
    machine = pf.load("stewart")
    with pytest.raises(InvalidArgument, match="seed"):
        pf.travel(machine, machine.home_pose, (0, 0, 1), start=pf.solve_ik(pf.load("nrpm"), pf.load("nrpm").home_pose))
    coarse = pf.travel(machine, machine.home_pose, (0, 0, 1), options=Options(tolerance=1e-6))
    assert coarse == pytest.approx(pf.travel(machine, machine.home_pose, (0, 0, 1)), abs=1e-4)
