"""The closure kernel: mathematics that no answer shows. What it closes is measured with every answer (`checks`)."""

from __future__ import annotations

import numpy as np
import pytest

import pfabrik as pf
from machines import MACHINES, machine
from pfabrik.engines.joints.close import HELD, close, platform_poses
from pfabrik.engines.joints.multistart import random_feasible
from pfabrik.engines.joints.reaches import reaches_of
from pfabrik.machine.model import model_of
from pfabrik.machine.motion.displacements import columns, stepped
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
def test_searches_close_most_starts_and_keep_limits_as_bounds(name: str) -> None:
    mechanism = machine(name)
    start = around_home(mechanism, 20, 0.4, seed=5)
    poses = platform_poses(mechanism, start)
    assert (close(model_of(mechanism).closure, start, poses).gap <= 1e-10).mean() > 0.5
    closing = close(model_of(mechanism).closure, start, poses, limits=True, margin=1e-10)
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


@pytest.mark.parametrize("name", ["stewart", "hexaglide", "tricept", "panda"])
def test_what_a_machine_takes_is_never_called_beyond_its_reach(name: str) -> None:
    closure = model_of(pf.load(name)).path_closure
    poses = random_feasible(closure)[1]
    poses[:, :3, 3] /= closure.mechanism.characteristic_length
    for path in reaches_of(closure.loops):
        last = poses[:, :3, 3] - poses[:, :3, :3] @ path[3:6]
        assert (np.linalg.norm(last - path[:3], axis=1) <= path[6]).all()
        assert path[6] < 5.0
