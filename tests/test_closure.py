"""The closure kernel against what it computes written out slowly: displacements, limits, derivatives by differences."""

from __future__ import annotations

import numpy as np
import pytest

import pfabrik as pf
from machines import MACHINES
from pfabrik.answers.active_limits import active_limits
from pfabrik.closure.close import HELD, close, platform_poses
from pfabrik.closure.multistart import random_feasible
from pfabrik.closure.reaches import reaches_of
from pfabrik.description.paths import independent_paths
from pfabrik.model import model_of
from pfabrik.motion.displacements import columns, displacements, gaps, stepped
from pfabrik.tolerances import TOLERANCES

CATALOGUE = ("five_bar", "nrpm", "stewart")
NAMES = [*CATALOGUE, *MACHINES]
pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")


def machine(name: str) -> pf.Mechanism:
    return pf.load(name) if name in CATALOGUE else MACHINES[name]()


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
def test_paths_end_where_displacements_put_the_platform(name: str) -> None:
    mechanism = machine(name)
    start = around_home(mechanism, 20, 0.3, seed=2)
    found = close(model_of(mechanism).closure, start, platform_poses(mechanism, start))
    closed = found.gap <= 1e-10
    assert closed.mean() > 0.5
    q, length = found.coordinates[closed], mechanism.characteristic_length
    assert gaps(mechanism, q).max() <= 1e-9 * length
    np.testing.assert_allclose(platform_poses(mechanism, q), found.poses[closed], rtol=0, atol=1e-9 * length)


@pytest.mark.parametrize("name", NAMES)
def test_gaps_are_those_between_displaced_bodies(name: str) -> None:
    """For open loops: the largest difference of any path's end from the platform, posed by another code."""
    mechanism = machine(name)
    q = around_home(mechanism, 10, 0.2, seed=3)
    poses = np.repeat(mechanism.home_pose[None], 10, axis=0)
    found = close(model_of(mechanism).closure, q, poses, limits=True, max_iterations=0)
    bodies = displacements(mechanism, q)
    serial = len(independent_paths(mechanism)) == 1
    ends = bodies[mechanism.end_effector_body] @ mechanism.home_pose
    off = np.linalg.norm((ends - poses)[:, :3, 3], axis=1) / mechanism.characteristic_length
    turned = np.arccos(np.clip((np.trace(ends[:, :3, :3], axis1=1, axis2=2) - 1) / 2, -1, 1))
    one_path = np.maximum(off, turned)
    assert (found.gap >= one_path - 1e-6).all()  # the tree's path is one of them
    if serial:
        np.testing.assert_allclose(found.gap, one_path, atol=1e-6)


@pytest.mark.parametrize("name", ["stewart", "nrpm", "five_bar", "hexapod_rus"])
def test_excesses_are_those_of_the_limits_themselves(name: str) -> None:
    """A limit moved to where the configuration is, is met; the excess over the old one is how far it was moved."""
    mechanism = machine(name)
    start = around_home(mechanism, 60, 1.5, seed=4)
    found = close(model_of(mechanism).closure, start, platform_poses(mechanism, start))
    closed = found.gap <= 1e-12
    if any(
        mechanism.joint(each).along for each in mechanism.actuator_names
    ):  # pulled through its foot, a strut points back
        closed &= (model_of(mechanism).closure.actuators(found.coordinates) > 0.0).all(axis=1)
    excess = found.excess[closed]
    length = mechanism.characteristic_length
    for row, limits in zip(excess, active_limits(mechanism, found.coordinates[closed]), strict=True):
        worst = 0.0
        for limit in limits:
            over = limit.limit - limit.value if limit.bound == "min" else limit.value - limit.limit
            worst = max(worst, over / (length if mechanism.joint(limit.joint).type == "prismatic" else 1.0))
        assert row == pytest.approx(worst, abs=1e-9)
    assert (excess > 0.01).any()


@pytest.mark.parametrize("name", NAMES)
def test_limits_are_bounds_of_the_search(name: str) -> None:
    mechanism = machine(name)
    start = around_home(mechanism, 20, 0.5, seed=5)
    found = close(model_of(mechanism).closure, start, platform_poses(mechanism, start), limits=True, margin=1e-10)
    closed = found.gap <= TOLERANCES.position
    assert (found.excess[closed] <= TOLERANCES.limit).mean() > 0.5
    assert np.isfinite(found.coordinates).all()


def test_locked_joints_and_a_held_platform_stay() -> None:
    mechanism = pf.load("stewart")
    closure = model_of(mechanism).closure
    q = around_home(mechanism, 5, 0.1, seed=6)
    poses = platform_poses(mechanism, q)
    own = [column for name in ("BL1", "AR2") for column in range(*columns(mechanism)[name].indices(q.shape[1]))]
    assert len(own) == 3
    found = close(closure, q, poses, locked=frozenset(own))
    np.testing.assert_array_equal(found.coordinates[:, own], q[:, own])
    held = close(closure, q, poses, platform=HELD)
    np.testing.assert_allclose(held.poses, poses, rtol=0, atol=1e-12)
    assert held.gap.max() <= 1e-12


def test_actuated_values_survive_the_way_into_coordinates_and_back() -> None:
    mechanism = pf.load("nrpm")
    values = np.random.default_rng(7).uniform(50, 150, (4, len(mechanism.actuator_names)))
    closure = model_of(mechanism).closure
    q = np.zeros((4, len(closure.scale)))
    closure.put_actuators(q, values)
    np.testing.assert_allclose(closure.actuators(q), values)


def test_paths_are_as_many_as_loops_and_one() -> None:
    expected = {"five_bar": 2, "stewart": 6, "nrpm": 6}
    assert {name: len(independent_paths(pf.load(name))) for name in expected} == expected


def test_configurations_that_are_not_finite_end_the_search_without_harm() -> None:
    mechanism = pf.load("stewart")
    q = np.full((2, len(model_of(mechanism).closure.scale)), np.nan)
    q[1] = 0.0
    found = close(model_of(mechanism).closure, q, np.repeat(mechanism.home_pose[None], 2, axis=0))
    assert found.gap[1] <= 1e-13
    assert not found.gap[0] <= 1.0


@pytest.mark.parametrize("name", ["stewart", "hexaglide", "tricept", "panda"])
def test_what_a_machine_takes_is_never_called_beyond_its_reach(name: str) -> None:
    closure = model_of(pf.load(name)).path_closure
    poses = random_feasible(closure)[1]
    poses[:, :3, 3] /= closure.mechanism.characteristic_length
    for path in reaches_of(closure.loops):
        last = poses[:, :3, 3] - poses[:, :3, :3] @ path[3:6]
        assert (np.linalg.norm(last - path[:3], axis=1) <= path[6]).all()
        assert path[6] < 5.0
