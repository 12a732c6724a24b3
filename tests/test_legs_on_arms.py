"""Legs on arms that follow from the pose: two carriers, stations between legs, tasks that leave more open."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import excess_of_joints, gap_of_joints
from machines import closure, machine
from pfabrik.closure.closure_engine import ClosureEngine
from pfabrik.engine import engine_of
from pfabrik.model import model_of
from pfabrik.options import Options
from pfabrik.platform.legs_engine import LegsEngine

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

ABOUT_Z, ANY, NONE = (0, 0, 1), (1, 1, 1), (0, 0, 0)
TURNS = {
    "H4": ABOUT_Z,
    "Par4": ABOUT_Z,
    "R + 3-RPS + RR": ANY,
    "delta with a shaft": ABOUT_Z,
    "Tricept with a wrist": ANY,
    "SCARA": ABOUT_Z,
    "3-CRU": NONE,
    "3-RRRS": ANY,
    "6-RRPS": ANY,
}
"""About which axes a platform can turn."""


def targets(mechanism: pf.Mechanism, n: int, shift: float, turn: float, about: tuple[int, ...]) -> np.ndarray:
    """Poses (n, 4, 4) up to `shift` [L] and `turn` [rad] from home on each axis."""
    rng, poses = np.random.default_rng(11), np.tile(mechanism.home_pose, (n, 1, 1))
    poses[:, :3, 3] += rng.uniform(-shift, shift, (n, 3)) * mechanism.characteristic_length
    poses[:, :3, :3] = Rotation.from_rotvec(rng.uniform(-turn, turn, (n, 3)) * about).as_matrix() @ poses[:, :3, :3]
    return poses


def far(mechanism: pf.Mechanism, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    return np.hypot(position, mechanism.rotation_length * rotation) / mechanism.characteristic_length


def assert_as_on_joint_coordinates(
    mechanism: pf.Mechanism, wanted: np.ndarray, answers: pf.Solution, at_most: float = 1e-6
) -> None:
    """Same statuses, and no projection farther than those of the engine that knows no legs; all of it kept exactly."""
    assert isinstance(engine_of(mechanism), LegsEngine)
    rows = ClosureEngine(model_of(mechanism)).answer(wanted, None, Options(), keep_mode=False).rows
    np.testing.assert_array_equal(np.asarray(answers.status), rows.status)
    own = far(mechanism, np.asarray(answers.position_error), np.asarray(answers.rotation_error))
    other = far(mechanism, rows.measures[:, 0], rows.measures[:, 1])
    np.testing.assert_array_less(own, other + at_most)
    assert gap_of_joints(mechanism, answers).max() <= 1e-9
    assert excess_of_joints(mechanism, answers).max() <= 1e-9


@pytest.mark.parametrize("name", TURNS)
def test_answers_are_those_on_joint_coordinates(name: str) -> None:
    mechanism = machine(name)
    near, off = (
        targets(mechanism, n, shift, turn, TURNS[name]) for n, shift, turn in ((40, 0.1, 0.2), (40, 0.25, 0.5))
    )
    wanted = np.concatenate([near, off])
    answers = pf.solve_ik(mechanism, wanted)
    assert (np.asarray(answers.status) == pf.Status.REACHED).sum() >= 15
    assert_as_on_joint_coordinates(mechanism, wanted, answers)
    alone = [pf.solve_ik(mechanism, each) for each in wanted[:5]]
    np.testing.assert_array_equal([each.actuators for each in alone], answers.actuators[:5])
    np.testing.assert_allclose([each.q for each in alone], answers.q[:5], atol=1e-12)


LOOSE = (("H4", "xyz", NONE), ("stewart", "z tilt", ANY), ("servo_hexapod", "x y z yaw", ANY))


@pytest.mark.parametrize(("name", "task", "about"), LOOSE, ids=[f"{name}, {task}" for name, task, _ in LOOSE])
def test_what_neither_task_nor_legs_tell_stays_where_it_was(name: str, task: str, about: tuple[int, ...]) -> None:
    plain = machine(name) if name in TURNS else pf.load(name)
    mechanism = dataclasses.replace(plain, task=tuple(task.split()) if " " in task else tuple(task))
    wanted = targets(mechanism, 40, 0.1, 0.2, about)
    answers = pf.solve_ik(mechanism, wanted)
    assert_as_on_joint_coordinates(mechanism, wanted, answers)
    again = pf.solve_ik(mechanism, wanted[0], start=answers[0])
    np.testing.assert_allclose(again.pose, answers[0].pose, atol=1e-9 * mechanism.characteristic_length)


@pytest.mark.parametrize("name", TURNS)
def test_along_a_path_nothing_leaps_and_a_start_may_be_a_joint_vector(name: str) -> None:
    mechanism, length = machine(name), machine(name).characteristic_length
    end = targets(mechanism, 1, 0.05, 0.15, TURNS[name])[0]
    begin = pf.solve_ik(mechanism, mechanism.home_pose)
    path = [pf.pose(*(share * (end - mechanism.home_pose)[:3, 3],)) @ mechanism.home_pose for share in (0.25, 0.5, 1.0)]
    track = pf.track(mechanism, np.array(path), start=begin)
    assert (np.asarray(track.status) == pf.Status.REACHED).all()
    unit = np.where(model_of(mechanism).path_closure.turning > 0.0, 1.0, length)
    steps = np.abs(np.diff(np.concatenate([begin.q[None], np.asarray(track.q)]), axis=0)) / unit
    assert steps.max() <= 0.5
    by_vector = pf.solve_ik(mechanism, path[-1], start=np.asarray(track.q)[-1])
    off = by_vector.q - np.asarray(track.q)[-1]
    own = [mechanism.coordinate_names.index(name) for name in mechanism.actuator_names]
    np.testing.assert_allclose((off / unit)[own], 0.0, atol=1e-7)


def test_legs_with_two_carriers_answer_in_all_four_of_their_ways() -> None:
    """Without limits each leg of the 3-RRRS takes hip and knee as it likes; its answers follow where it starts."""
    joints = [dataclasses.replace(each, range=None, cone=None) for each in closure.rrrs().joints]
    mechanism = pf.Mechanism("3-RRRS", joints, "platform", (0, 0, 190))
    table = model_of(mechanism).legs
    assert not table.has_free_redundant and not table.has_implicit_joints
    wanted = targets(mechanism, 1, 0.05, 0.1, (1, 1, 1))[0]
    modes = pf.working_modes(mechanism, wanted)
    assert modes.total == 4**3
    for mode in list(modes)[:64:5]:
        there = pf.solve_ik(mechanism, wanted, start=mode.q, options=Options(working_mode="keep"))
        assert there.status == pf.Status.REACHED
        turned = there.actuators - mode.actuators
        np.testing.assert_allclose(np.cos(turned), 1.0, atol=1e-9)


def test_a_home_at_dead_points_is_one_to_search_from() -> None:
    mechanism = closure.stretched_delta()
    wanted = targets(mechanism, 60, 0.1, 0.0, NONE)
    answers = pf.solve_ik(mechanism, wanted)
    assert 10 < (np.asarray(answers.status) == pf.Status.REACHED).sum() < 50
    # at a dead point the distance changes with the square of a step: searches end some 1e-5 apart
    assert_as_on_joint_coordinates(mechanism, wanted, answers, at_most=2e-5)


def test_a_carrier_that_its_rod_does_not_place_alone_has_no_dead_point() -> None:
    """Rods of a 4-RRUR face their heads and do not spin: passing over the carrier leads to no other working mode."""
    mechanism = closure.rrur()
    found = pf.solve_fk(mechanism, np.random.default_rng(0).uniform(-1.0, 1.2, (40, 4)))
    poses = found.pose[np.asarray(found.status) == pf.Status.REACHED]
    assert len(poses) > 10 and pf.solve_ik(mechanism, poses)
    (along,) = pf.travel(pf.solve_ik(mechanism, mechanism.home_pose), along=(1, 0, 0))
    assert along.stopped_by and along.distance > 25.0


def test_maps_know_arms_that_follow() -> None:
    mechanism = machine("H4")
    wanted = targets(mechanism, 200, 0.4, 0.8, (0, 0, 1))
    margin = pf.feasibility(mechanism, wanted).margin
    reached = np.asarray(pf.solve_ik(mechanism, wanted[margin > 0.0]).status) == pf.Status.REACHED
    assert reached.all() and 20 < len(reached) < 200


def test_maps_lead_arms_that_turn_far_near_home() -> None:
    """The tool stands beside the first of two axes, in line with it: to lean, this one turns by up to half a turn."""
    mechanism = closure.stretched_wrist(tool=(0, 10, 270))
    wanted = targets(mechanism, 100, 0.1, 0.3, (1, 1, 0))
    reached = np.asarray(pf.solve_ik(mechanism, wanted, options=Options(working_mode="keep")).status) == 0
    feasible = np.asarray(pf.feasibility(mechanism, wanted).margin) > 0.0
    assert 20 < reached.sum() < 100 and not (feasible & ~reached).any()
    assert (feasible & reached).sum() > 0.97 * reached.sum()


@pytest.mark.slow
def test_maps_lead_arms_of_whole_poses_part_by_part_too() -> None:
    """Trunks that the whole pose places: all at once they end in another of their ways to stand, or in none."""
    mechanism = machine("R + 3-RPS + RR")
    wanted = targets(mechanism, 300, 0.3, 0.6, ANY)
    reached = np.asarray(pf.solve_ik(mechanism, wanted, options=Options(working_mode="keep")).status) == 0
    assert 20 < reached.sum() < 300
    np.testing.assert_array_equal(np.asarray(pf.feasibility(mechanism, wanted).margin) > 0.0, reached)


@pytest.mark.slow
def test_rods_of_one_arm_that_are_not_parallel_have_no_dead_point_alone() -> None:
    """Three rods, two and one on three cranks: where one of three stands square to its crank, the others place it."""
    joints = []
    rods = {0.0: ((20, 25), (-20, 25), (0, -30)), 2.2: ((22, 0), (-22, 0)), -2.0: ((0, 10),)}
    for k, (angle, beside) in enumerate(rods.items()):
        out, across = np.array([np.cos(angle), np.sin(angle), 0]), np.array([-np.sin(angle), np.cos(angle), 0])
        joints.append(
            pf.Joint(f"A{k}", "revolute", ("base", f"arm{k}"), 90 * out, across, actuated=True, range=(-1.1, 0.7))
        )
        for i, (y, z) in enumerate(beside):
            elbow = (170 + 5 * i) * out + y * across + (0, 0, 30 + z)
            platform_end = (30 - 3 * i) * out + y * across + (0, 0, 0.8 * z - 120)
            joints.append(pf.Joint(f"B{k}{i}", "spherical", (f"arm{k}", f"rod{k}{i}"), elbow))
            joints.append(pf.Joint(f"C{k}{i}", "spherical", (f"rod{k}{i}", "platform"), platform_end))
    mechanism = pf.Mechanism("3-2-1", joints, "platform", (0, 0, -120), task=("x", "y", "z"))
    assert isinstance(engine_of(mechanism), LegsEngine)
    (reach,) = pf.travel(pf.solve_ik(mechanism, mechanism.home_pose), along=(1, 0, 0))
    velocities = pf.forward_jacobian(reach.end)[:3] / mechanism.characteristic_length
    assert reach.stopped_by or np.linalg.svd(velocities)[1].min() < 1e-4
