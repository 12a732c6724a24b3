"""Reachy Mini's head keeps off its body: as its maker's solids say, in single answers and on paths, and it recovers."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import pfabrik as pf
from in_mujoco import mujoco
from test_compiled_and_interpreted import INTERPRETED

Array = NDArray[np.float64]
CLEARANCE = 0.005

# The five solids, and nothing else, for another program; the head is carried by hand.
SCENE = """
<mujoco><worldbody>
<geom type="cylinder" pos="-0.055 0 0.0898" zaxis="1 0 0" size="0.08 0.005"/>
<geom type="cylinder" pos="0.058 0 0.1048" zaxis="1 0 0" size="0.08 0.005"/>
<geom type="box" pos="0 0.058 0.1048" size="0.05 0.005 0.025"/>
<geom type="box" pos="0 -0.058 0.1048" size="0.05 0.005 0.025"/>
<body mocap="true">
<geom type="cylinder" pos="-0.005 0 0.0525" zaxis="0.05085 0.998664 -0.009217" size="0.049 0.07"/>
</body>
</worldbody></mujoco>
"""


def distances_in_mujoco(poses: Array) -> Array:
    """Distances of the head from the body at poses (n, 4, 4), (n,) [m]."""
    model = mujoco.MjModel.from_xml_string(SCENE)
    data, found = mujoco.MjData(model), np.empty(len(poses))
    for row, pose in enumerate(poses):
        data.mocap_pos[0], data.mocap_quat[0] = pose[:3, 3], np.roll(Rotation.from_matrix(pose[:3, :3]).as_quat(), 1)
        mujoco.mj_forward(model, data)
        found[row] = min(mujoco.mj_geomDistance(model, data, 4, k, 1.0, None) for k in range(4))
    return found


def look(roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0, up: float = 0.0) -> Array:
    """The target for three angles [deg] and a height above home [mm]."""
    return pf.pose([0, 0, 0.177 + 1e-3 * up], rpy=[roll, pitch, yaw], degrees=True)


def random_looks(count: int) -> Array:
    rng = np.random.default_rng(5)
    angles, heights = rng.uniform(-1, 1, (count, 3)) * [25, 30, 40], rng.uniform(-35, 15, count)
    return np.stack([look(*angle, up=up) for angle, up in zip(angles, heights, strict=True)])


def keeping() -> pf.Mechanism:
    return pf.load("reachy_mini").with_clearance(CLEARANCE)


def test_the_head_is_as_far_from_the_body_as_in_another_program() -> None:
    answers = pf.solve_ik(pf.load("reachy_mini"), random_looks(8 if INTERPRETED else 60))
    found, expected = np.asarray(pf.clearance(answers).distance), distances_in_mujoco(answers.pose)
    apart = expected > 1e-5
    assert apart.any()
    np.testing.assert_allclose(found[apart], expected[apart], atol=2e-6)
    assert (found[~apart] < 2e-5).all()


@pytest.mark.skipif(INTERPRETED, reason="searches, which take long as plain Python")
def test_a_look_that_would_collide_is_answered_by_the_nearest_that_does_not_and_names_the_pair() -> None:
    free, machine, targets = pf.load("reachy_mini"), keeping(), random_looks(40)
    answers, by_itself = pf.solve_ik(machine, targets), pf.solve_ik(free, targets)
    can_be = by_itself.status == pf.Status.REACHED
    wanted = distances_in_mujoco(targets)
    collides = can_be & (wanted < CLEARANCE - 1e-5)
    is_fine = can_be & (wanted > CLEARANCE + 1e-5)
    assert collides.sum() >= 5 and is_fine.sum() >= 3
    assert (answers.status[collides] == pf.Status.PROJECTED).all()
    assert (answers.status[is_fine] == pf.Status.REACHED).all()
    assert (distances_in_mujoco(answers.pose) >= CLEARANCE - 2e-6).all()
    rng = np.random.default_rng(6)
    for row in np.flatnonzero(collides)[:3]:
        active = [limit for limit in answers[row].active_limits if limit.bound == "clearance"]
        assert active and active[0].joint in ("body–head", "head–body")
        assert active[0].value == pytest.approx(CLEARANCE, abs=1e-7) and active[0].limit == CLEARANCE
        # No pose of the same orientation that is nearer to the target keeps all limits.
        around = np.tile(answers.pose[row], (400, 1, 1))
        directions = rng.normal(size=(400, 3))
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        radii = answers.position_error[row] * rng.uniform(0, 0.999, 400) ** (1 / 3)
        around[:, :3, 3] = targets[row, :3, 3] + radii[:, None] * directions
        is_kept = distances_in_mujoco(around) >= CLEARANCE
        assert (pf.solve_ik(free, around[is_kept]).status != pf.Status.REACHED).all()


def test_a_path_far_below_the_body_is_answered_and_the_head_comes_back_from_it() -> None:
    machine = keeping()
    down = np.linspace(0, -200, 20 if INTERPRETED else 40)
    path = np.stack([look(pitch=5, up=up) for up in [*down, *down[::-1]]])
    motion = pf.track(machine, path)
    reached = motion.status == pf.Status.REACHED
    np.testing.assert_array_equal(reached, reached[::-1])
    assert reached[0] and not reached[len(down) - 1] and not motion.jumps.any()
    assert ((motion.status == pf.Status.REACHED) | (motion.status == pf.Status.PROJECTED)).all()
    assert (distances_in_mujoco(motion.pose) >= CLEARANCE - 2e-6).all()
    np.testing.assert_allclose(motion.pose, motion.pose[::-1], atol=1e-6)
    np.testing.assert_allclose(motion.actuators[-1], motion.actuators[0], atol=1e-9)


@pytest.mark.skipif(INTERPRETED, reason="searches, which take long as plain Python")
def test_a_solver_that_was_asked_for_what_cannot_be_goes_on() -> None:
    solver = pf.Solver(keeping())
    for up in (-176, -200, -400, 300):
        assert solver.ik(look(up=up)) is pf.Status.PROJECTED
        assert distances_in_mujoco(np.array([solver.pose]))[0] >= CLEARANCE - 2e-6
        assert solver.ik(look()) is pf.Status.REACHED
        np.testing.assert_allclose(solver.pose, look(), atol=1e-9)
