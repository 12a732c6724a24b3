"""The closure kernel against what it computes written out slowly: displacements, limits, derivatives by steps."""

from __future__ import annotations

import numpy as np
import pytest

import pfabrik as pf
from machines import MACHINES, machine
from pfabrik.answers.active_limits import active_limits
from pfabrik.closure.close import HELD, close, platform_poses
from pfabrik.closure.multistart import random_feasible
from pfabrik.closure.reaches import reaches_of
from pfabrik.description.paths import independent_paths
from pfabrik.model import model_of
from pfabrik.motion.displacements import columns, displacements, gaps, stepped
from pfabrik.tolerances import TOLERANCES

NAMES = ["five_bar", "nrpm", "stewart", *MACHINES]
pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")


def around_home(mechanism: pf.Mechanism, n: int, size: float, seed: int = 0) -> np.ndarray:
    """Coordinates (n, columns) near home, loops open; angles and lengths relative to L up to `size`."""
    q = np.zeros((n, len(model_of(mechanism).closure.scale)))
    return stepped(mechanism, q, size * np.random.default_rng(seed).uniform(-1, 1, q.shape))


@pytest.mark.parametrize("name", NAMES)
def test_a_step_leaves_open_only_the_square_of_what_was_open(name: str) -> None:
    """So the Jacobian is right in every entry: a wrong one leaves a share of the gap, however small the gap."""
    mechanism = machine(name)
    closure = model_of(mechanism).closure
    start = around_home(mechanism, 20, 0.1)
    on_it = close(closure, start, platform_poses(mechanism, start), max_iterations=60)
    assert on_it.gap.max() <= 1e-12
    rng = np.random.default_rng(1)
    off = stepped(mechanism, on_it.coordinates, 1e-4 * rng.uniform(-1, 1, start.shape))
    before = close(closure, off, on_it.poses, limits=True, max_iterations=0).gap  # limits: no joint follows
    for limits in (False, True):  # with limits no ball joint is left out
        after = close(closure, off, on_it.poses, limits=limits, max_iterations=1).gap
        assert (after <= 20.0 * before**2 + 1e-14).all()


@pytest.mark.parametrize("name", NAMES)
def test_gaps_and_ends_of_paths_are_those_of_displaced_bodies(name: str) -> None:
    """Of closed loops none; of open ones the largest difference of any path's end, the tree's path among them."""
    mechanism = machine(name)
    closure, length = model_of(mechanism).closure, mechanism.characteristic_length
    start = around_home(mechanism, 20, 0.3, seed=2)
    closed = close(closure, start, platform_poses(mechanism, start))
    is_closed = closed.gap <= 1e-10
    assert is_closed.mean() > 0.5
    q = closed.coordinates[is_closed]
    assert gaps(mechanism, q).max() <= 1e-9 * length
    np.testing.assert_allclose(platform_poses(mechanism, q), closed.poses[is_closed], rtol=0, atol=1e-9 * length)
    poses = np.repeat(mechanism.home_pose[None], 20, axis=0)
    left_open = close(closure, start, poses, limits=True, max_iterations=0)
    ends = displacements(mechanism, start)[mechanism.end_effector_body] @ mechanism.home_pose
    off = np.linalg.norm((ends - poses)[:, :3, 3], axis=1) / length
    turned = np.arccos(np.clip((np.trace(ends[:, :3, :3], axis1=1, axis2=2) - 1) / 2, -1, 1))
    one_path = np.maximum(off, turned)
    assert (left_open.gap >= one_path - 1e-6).all()
    if len(independent_paths(mechanism)) == 1:
        np.testing.assert_allclose(left_open.gap, one_path, atol=1e-6)


@pytest.mark.parametrize("name", ["stewart", "nrpm", "five_bar", "hexapod_rus"])
def test_excesses_are_those_of_the_limits_themselves(name: str) -> None:
    """Each is by how far the worst of the limits that are exceeded is."""
    mechanism = machine(name)
    closure, length = model_of(mechanism).closure, mechanism.characteristic_length
    start = around_home(mechanism, 60, 1.5, seed=4)
    closed = close(closure, start, platform_poses(mechanism, start))
    rows = closed.gap <= 1e-12
    if any(mechanism.joint(each).along for each in mechanism.actuator_names):
        rows &= (closure.actuators(closed.coordinates) > 0.0).all(axis=1)  # a strut through its foot points back
    for excess, limits in zip(closed.excess[rows], active_limits(mechanism, closed.coordinates[rows]), strict=True):
        worst = 0.0
        for limit in limits:
            over = limit.limit - limit.value if limit.bound == "min" else limit.value - limit.limit
            worst = max(worst, over / (length if mechanism.joint(limit.joint).type == "prismatic" else 1.0))
        assert excess == pytest.approx(worst, abs=1e-9)
    assert (closed.excess[rows] > 0.01).any()


@pytest.mark.parametrize("name", NAMES)
def test_limits_are_bounds_of_the_search(name: str) -> None:
    mechanism = machine(name)
    start = around_home(mechanism, 20, 0.5, seed=5)
    closing = close(model_of(mechanism).closure, start, platform_poses(mechanism, start), limits=True, margin=1e-10)
    closed = closing.gap <= TOLERANCES.position
    assert (closing.excess[closed] <= TOLERANCES.limit).mean() > 0.5
    assert np.isfinite(closing.coordinates).all()


def test_locked_joints_and_a_held_platform_stay_and_rows_that_are_not_finite_do_no_harm() -> None:
    mechanism = pf.load("stewart")
    closure, q = model_of(mechanism).closure, around_home(mechanism, 5, 0.1, seed=6)
    poses = platform_poses(mechanism, q)
    locked = [column for name in ("BL1", "AR2") for column in range(*columns(mechanism)[name].indices(q.shape[1]))]
    assert len(locked) == 3
    closing = close(closure, q, poses, locked=frozenset(locked))
    np.testing.assert_array_equal(closing.coordinates[:, locked], q[:, locked])
    q[0] = np.nan
    held = close(closure, q, poses, platform=HELD)
    np.testing.assert_allclose(held.poses[1:], poses[1:], rtol=0, atol=1e-12)
    assert held.gap[1:].max() <= 1e-12 and not held.gap[0] <= 1.0


def test_actuated_values_survive_the_way_into_coordinates_and_back() -> None:
    mechanism = pf.load("nrpm")
    values = np.random.default_rng(7).uniform(50, 150, (4, len(mechanism.actuator_names)))
    closure = model_of(mechanism).closure
    q = np.zeros((4, len(closure.scale)))
    closure.put_actuators(q, values)
    np.testing.assert_allclose(closure.actuators(q), values)


def test_paths_are_as_many_as_loops_and_one() -> None:
    assert [len(independent_paths(machine(name))) for name in ("five_bar", "nrpm", "stewart")] == [2, 6, 6]


@pytest.mark.parametrize("name", ["stewart", "hexaglide", "tricept", "panda"])
def test_what_a_machine_takes_is_never_called_beyond_its_reach(name: str) -> None:
    closure = model_of(pf.load(name)).path_closure
    poses = random_feasible(closure)[1]
    poses[:, :3, 3] /= closure.mechanism.characteristic_length
    for path in reaches_of(closure.loops):
        last = poses[:, :3, 3] - poses[:, :3, :3] @ path[3:6]
        assert (np.linalg.norm(last - path[:3], axis=1) <= path[6]).all()
        assert path[6] < 5.0
