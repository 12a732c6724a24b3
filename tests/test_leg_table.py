"""Legs in closed form: what they tell of a pose is what the closure engine measures there."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from machines import closure, machine
from pfabrik.closure.configurations import new_rows
from pfabrik.decomposition.leg_table import LegTable
from pfabrik.description.task import task_of
from pfabrik.engine import engine_of
from pfabrik.feasibility import _margins
from pfabrik.kernels.platform.evaluate import evaluate_poses
from pfabrik.model import Model, model_of
from pfabrik.motion.displacements import home_coordinates
from pfabrik.options import Options
from pfabrik.platform.answers import sides_at
from pfabrik.platform.coordinates import read_coordinates
from pfabrik.platform.legs_engine import LegsEngine
from pfabrik.platform.reach import reach
from pfabrik.platform.table import reading_scratch
from pfabrik.platform.table import table_handle as legs_of

SERVED = [name for name in pf.catalog() if not model_of(pf.load(name)).why_poses_do_not_suffice]
IN_FRONT = [name for name in SERVED if isinstance(engine_of(pf.load(name)), LegsEngine)]
COMPLETED = [name for name in IN_FRONT if model_of(pf.load(name)).legs.task["unset"][0]]
TARGETS = 150


def table(name: str) -> LegTable:
    return model_of(machine(name)).legs


def poses_around_home(name: str, n: int, shift: float, turn: float, seed: int = 1) -> np.ndarray:
    """Poses (n, 4, 4) up to `shift` [L] and `turn` [rad] away on each axis."""
    rng, mechanism = np.random.default_rng(seed), machine(name)
    poses = np.tile(mechanism.home_pose, (n, 1, 1))
    poses[:, :3, 3] += rng.uniform(-shift, shift, (n, 3)) * mechanism.characteristic_length
    poses[:, :3, :3] = Rotation.from_rotvec(rng.uniform(-turn, turn, (n, 3))).as_matrix()
    return poses


def targets_around_home(name: str, n: int, shift: float, turn: float) -> np.ndarray:
    """The same, of what a planar machine can do only that."""
    poses, mechanism, own = poses_around_home(name, n, shift, turn), machine(name), table(name)
    if own.task["unset"][0] or not own.task["rows"][0]:
        return poses
    slopes = constraints(name, mechanism.home_pose[None].copy())[1][0]
    free = np.linalg.svd(slopes)[2][np.linalg.matrix_rank(slopes, tol=1e-6) :]
    moves = np.random.default_rng(1).uniform(-1.0, 1.0, (n, len(free))) @ free
    poses[:, :3, 3] = mechanism.home_pose[:3, 3] + shift * mechanism.characteristic_length * moves[:, :3]
    poses[:, :3, :3] = np.eye(3)
    if not mechanism.end_effector_is_joint:
        poses[:, :3, :3] = Rotation.from_rotvec(turn * moves[:, 3:]).as_matrix()
    return poses


@lru_cache
def both(name: str) -> tuple[np.ndarray, Any, Any]:
    """Targets in and out of reach, what legs alone reach of them, and what the engine behind answers."""
    engine = engine_of(machine(name))
    assert isinstance(engine, LegsEngine)
    targets = targets_around_home(name, TARGETS, 0.25, 0.45)
    rows = new_rows(model_of(machine(name)), TARGETS)
    reach(engine._model, targets, None, engine._table.home_sides, False, rows)
    return targets, rows, engine._joint_space.answer(targets, None, Options(), keep_mode=False)


def off(name: str, actuators: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Largest difference of actuator values, (n,) [L or rad]."""
    mechanism = machine(name)
    lengths = [mechanism.joint(each).type == "prismatic" for each in mechanism.actuator_names]
    units = np.where(lengths, mechanism.characteristic_length, 1.0)
    return np.abs((actuators - others) / units).max(axis=1)


def constraints(name: str, poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    own = table(name)
    rows = np.zeros((len(poses), own.task["rows"][0]))
    slopes = np.zeros((*rows.shape, 6 + len(own.redundant)))
    none = np.zeros((0, 0))
    evaluate_poses(legs_of(own).address, reading_scratch(own).address, poses, own.home_sides, none, none, rows, slopes)
    return rows, slopes[:, :, :6]


@pytest.mark.parametrize("name", IN_FRONT)
def test_legs_reach_what_the_engine_behind_reaches(name: str) -> None:
    _, rows, behind = both(name)
    reached = rows.status == pf.Status.REACHED
    np.testing.assert_array_equal(reached, behind.rows.status == pf.Status.REACHED)
    assert reached.any()
    assert off(name, rows.actuators[reached], behind.rows.actuators[reached]).max() <= 1e-9


@pytest.mark.parametrize("name", IN_FRONT)
def test_answers_of_legs_are_closed_and_within_limits(name: str) -> None:
    targets, rows, _ = both(name)
    reached = rows.status == pf.Status.REACHED
    answers = pf.solve_ik(machine(name), targets[reached])
    np.testing.assert_array_equal(answers.actuators, rows.actuators[reached])
    assert pf.closure_residual(answers).max() <= 1e-9 * machine(name).characteristic_length
    assert all(margin.min() >= -1e-8 for margin in pf.margins(answers).values())


@pytest.mark.parametrize("name", SERVED)
def test_coordinates_told_by_legs_are_those_of_closed_loops(name: str) -> None:
    own, mechanism = table(name), machine(name)
    answers = pf.solve_ik(mechanism, poses_around_home(name, 40, 0.1, 0.2, seed=4))
    at_home = np.asarray(answers.status) == pf.Status.REACHED
    poses = np.ascontiguousarray(answers.pose[at_home])
    told = np.zeros((len(poses), len(mechanism.coordinate_names)))
    read_coordinates(own, poses, own.home_sides, told)
    columns = own.known["column"]
    closed = answers.q[at_home] - home_coordinates(mechanism)
    away = (told - closed)[:, columns] / own.known["unit"]
    away = np.where(own.known["unit"] == 1.0, np.remainder(away + np.pi, 2 * np.pi) - np.pi, away)
    assert np.abs(away).max(initial=0.0) <= 1e-9


CONSTRAINED = [name for name in SERVED if table(name).task["rows"][0] and not len(table(name).redundant)]


@pytest.mark.parametrize("name", CONSTRAINED)
def test_derivatives_of_constraints_are_their_differences(name: str) -> None:
    length, step = machine(name).characteristic_length, 1e-6
    poses = poses_around_home(name, 20, 0.03, 0.08)
    rows, slopes = constraints(name, poses)
    assert np.abs(rows).max() > 1e-3
    for axis in range(6):
        moved = []
        for sign in (1.0, -1.0):
            vector = sign * step * np.eye(3)[axis % 3]
            other = poses.copy()
            if axis < 3:
                other[:, :3, 3] += vector * length
            else:
                other[:, :3, :3] = Rotation.from_rotvec(vector).as_matrix() @ other[:, :3, :3]
            moved.append(constraints(name, other)[0])
        np.testing.assert_allclose(slopes[:, :, axis], (moved[0] - moved[1]) / (2 * step), atol=1e-7)


@pytest.mark.parametrize("name", COMPLETED)
def test_completed_poses_have_what_the_task_sets(name: str) -> None:
    targets, rows, _ = both(name)
    reached = rows.status == pf.Status.REACHED
    position, rotation = task_of(machine(name)).errors(rows.poses[reached], targets[reached])
    assert position.max() <= 1e-12 * machine(name).characteristic_length
    assert rotation.max() <= 1e-12


@pytest.mark.parametrize("name", ["g1_ankle", "prs", "agile_eye"])
def test_a_start_keeps_its_working_mode(name: str) -> None:
    mechanism = machine(name).without_limits()
    home = pf.solve_ik(mechanism, mechanism.home_pose)
    modes = pf.working_modes(mechanism, mechanism.home_pose)
    others = [each for each in modes if each and np.abs(each.pose - mechanism.home_pose).max() < 1e-6]
    start = max(others, key=lambda each: off(name, each.actuators[None], home.actuators[None])[0])
    assert off(name, start.actuators[None], home.actuators[None])[0] > 0.1
    near = poses_around_home(name, 30, 0.01, 0.02)
    engine = engine_of(mechanism)
    assert isinstance(engine, LegsEngine)
    rows = new_rows(model_of(mechanism), len(near))
    reach(engine._model, near, start._configurations, sides_at(engine._model, start._configurations), True, rows)
    behind = engine._joint_space.answer(near, start._configurations, Options(), keep_mode=True)
    assert (rows.status == pf.Status.REACHED).all()
    assert off(name, rows.actuators, behind.rows.actuators).max() <= 1e-9
    answers = pf.solve_ik(mechanism, near, start=start)
    assert pf.closure_residual(answers).max() <= 1e-9 * mechanism.characteristic_length


@pytest.mark.parametrize("name", ["delta", "rps", "canfield"])
def test_an_answer_starts_the_next_one_as_its_joint_coordinates_do(name: str) -> None:
    mechanism = machine(name)
    before = pf.solve_ik(mechanism, mechanism.home_pose)
    for target in poses_around_home(name, 4, 0.05, 0.02, seed=4):
        found = pf.solve_ik(mechanism, target, start=before)
        again = pf.solve_ik(mechanism, target, start=before.q)
        assert found and again
        np.testing.assert_allclose(
            found.actuators, again.actuators, rtol=0, atol=1e-9 * (1.0 + abs(again.actuators)).max()
        )
        np.testing.assert_allclose(found.pose, again.pose, rtol=0, atol=1e-9 * mechanism.characteristic_length)
        assert pf.closure_residual(found) <= 1e-9 * mechanism.characteristic_length
        before = found


def test_a_slide_counts_as_its_joint_says_whichever_way_that_points() -> None:
    joints = []
    for place, joint in enumerate(machine("stewart").joints):
        if joint.along is not None:
            base_end, platform_end = (np.array(machine("stewart").joint(end).at) for end in joint.along)
            axis = (platform_end - base_end) / np.linalg.norm(platform_end - base_end) * (1 if place % 2 else -1)
            bodies = joint.connects if place % 4 < 2 else joint.connects[::-1]
            joint = pf.Joint(joint.name, "prismatic", bodies, axis=axis, actuated=True, range=(-40.0, 40.0))
        joints.append(joint)
    mechanism = pf.Mechanism("slides both ways", joints, "platform", machine("stewart").reference_point)
    assert model_of(mechanism).has_legs
    answers = pf.solve_ik(mechanism, poses_around_home("stewart", 20, 0.05, 0.1))
    assert (answers.status == pf.Status.REACHED).all()
    assert pf.closure_residual(answers).max() <= 1e-9 * mechanism.characteristic_length


@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
def test_a_chain_that_is_no_leg_is_named_with_the_reason() -> None:
    reason = model_of(closure.crooked_upr()).why_no_legs
    assert reason.startswith("sub-chain R*-U-P*-U: ")


@pytest.mark.parametrize("name", ["delta", "rps", "canfield", "stewart", "rrr"])
def test_feasibility_is_the_least_margin_and_tells_what_is_reached(name: str) -> None:
    mechanism = machine(name)
    targets = poses_around_home(name, 120, 0.25, 0.0 if name == "rrr" else 0.45)
    if name == "rrr":
        targets[:, 2, 3] = mechanism.home_pose[2, 3]
    found = pf.feasibility(mechanism, targets)
    answers = pf.solve_ik(mechanism, targets, options=Options(working_mode="keep"))
    reached = np.asarray(answers.status) == pf.Status.REACHED
    np.testing.assert_array_equal(found.margin > 0.0, reached)
    assert 0 < reached.sum() < len(reached)
    least = np.min(list(pf.margins(answers[reached]).values()), axis=0)
    np.testing.assert_allclose(found.margin[reached], least, atol=1e-9)
    bounds = {found.limits[each][1] for each in found.binding}
    assert bounds <= {"min", "max", "cone", "reach", "closed"}
    for row in np.flatnonzero(reached)[:10]:
        named = pf.margins(answers[row])[found.limits[found.binding[row]]]
        assert named == pytest.approx(found.margin[row], abs=1e-9)


def test_a_locked_joint_leaves_no_room_at_its_value_and_less_beside_it() -> None:
    free = machine("stewart")
    length = free.home_coordinate("BL1")
    locked = free.with_limits(BL1=(length, length))
    here = pf.solve_ik(locked, locked.home_pose)
    above = here.pose + [[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 1.0], [0, 0, 0, 0]]
    found = pf.feasibility(locked, np.stack([here.pose, above]))
    assert found.margin.tolist() == [min(pf.margins(here).values()), -np.inf] == [0.0, -np.inf]
    assert {found.limits[each][0] for each in found.binding} == {"BL1"}


def with_a_locked_strut(name: str = "BL1") -> tuple[pf.Mechanism, pf.Mechanism]:
    """A hexapod one of whose struts is passive and locked, and the same with that strut in one piece."""
    free = machine("stewart")
    length = free.home_coordinate(name)
    joints = [
        replace(joint, actuated=False, range=(length, length)) if joint.name == name else joint for joint in free.joints
    ]
    weld = pf.Joint(name, "fixed", free.joint(name).connects, at=free.reference_point)
    tilting = ("x", "y", "z", "tilt")
    locked = replace(free, joints=tuple(joints), task=tilting)
    rigid = replace(locked, joints=tuple(weld if joint.name == name else joint for joint in joints))
    return locked, rigid


def test_a_locked_passive_joint_is_a_constraint_as_a_rigid_strut_is() -> None:
    (locked, rigid), name = with_a_locked_strut(), "BL1"
    targets = targets_around_home("stewart", 20, 0.05, 0.1)
    answers, others = pf.solve_ik(locked, targets), pf.solve_ik(rigid, targets)
    assert (answers.status == pf.Status.REACHED).sum() > 10
    np.testing.assert_array_equal(answers.joints[name], locked.home_coordinate(name))
    np.testing.assert_allclose(answers.pose, others.pose, rtol=0, atol=1e-7)
    np.testing.assert_array_equal(pf.feasibility(locked, targets).margin, pf.feasibility(rigid, targets).margin)
    here, there = (pf.solve_ik(each, each.home_pose) for each in (locked, rigid))
    found, expected = (pf.travel(each, along=(0, -1, 0)) for each in (here, there))
    assert found.distances == pytest.approx(expected.distances, abs=1e-6) and found.distances[0] > 0.01
    assert [limit.joint for limit in found[0].stopped_by] == [limit.joint for limit in expected[0].stopped_by]
    assert pf.mobility(locked) == pf.mobility(rigid)
    assert pf.singularity(answers[0]).parallel == pytest.approx(pf.singularity(others[0]).parallel)


@pytest.mark.slow
def test_a_locked_passive_joint_is_locked_in_lists_of_modes() -> None:
    locked, rigid = with_a_locked_strut()
    values = pf.solve_ik(locked, locked.home_pose).actuators
    assert len(pf.assembly_modes(locked, values)) == len(pf.assembly_modes(rigid, values)) > 0


@pytest.mark.slow
@pytest.mark.parametrize("n", [120, pytest.param(10_000, marks=pytest.mark.campaign)])
@pytest.mark.parametrize("name", SERVED)
def test_what_feasibility_says_is_what_is_reached_however_far_from_home(name: str, n: int) -> None:
    sizes = ((0.1, 0.1), (0.4, 0.4), (1.2, 0.8))
    targets = np.concatenate([targets_around_home(name, n // 3, *size) for size in sizes])
    answers = pf.solve_ik(machine(name), targets, options=Options(working_mode="keep"))
    reached = np.asarray(answers.status) == pf.Status.REACHED
    np.testing.assert_array_equal(pf.feasibility(machine(name), targets).margin >= 0.0, reached)
    assert 0 < reached.sum() < len(reached)


def test_feasibility_turns_what_a_leg_does_not_reach_as_it_stands_at_home() -> None:
    """The bar that carries the tool turns with where it is: held as at home, its hinge is soon too far away."""
    mechanism = closure.five_bar_with_tool()
    x, y = np.meshgrid(np.linspace(-150.0, 150.0, 21), np.linspace(-50.0, 260.0, 21))
    targets = pf.pose(np.stack([x, y, np.full_like(x, 10.0)], axis=-1))
    reached = np.asarray(pf.solve_ik(mechanism, targets, options=Options(working_mode="keep")).status) == 0
    feasible = np.asarray(pf.feasibility(mechanism, targets).margin) >= 0.0
    assert 100 < reached.sum() < 250 and not (feasible & ~reached).any()
    assert feasible.sum() > 0.98 * reached.sum()


def test_feasibility_tells_where_three_hinges_through_a_point_cannot_point() -> None:
    """Two hinges at an angle a, the outer of them and the platform's at b: the first and the last are |a - b| to a + b
    apart."""
    mechanism = closure.coaxial_rrr().without_limits()
    first, second, last = (np.array([mechanism.joint(f"R{leg}.{k}").axis for leg in (1, 2, 3)]) for k in (1, 2, 3))
    turns = Rotation.from_rotvec(np.random.default_rng(4).uniform(-1.2, 1.2, (200, 3))).as_matrix()
    apart = np.arccos(np.einsum("li,nij,lj->nl", first, turns, last))
    a, b = np.arccos((first * second).sum(axis=1)), np.arccos((second * last).sum(axis=1))
    beyond = np.maximum(apart - (a + b), np.abs(a - b) - apart).max(axis=1)
    found = pf.feasibility(mechanism, pf.pose([0, 0, 0], rotation=turns))
    np.testing.assert_array_equal(found.margin >= 0.0, beyond <= 0.0)
    np.testing.assert_allclose(found.margin[beyond > 0.0], -beyond[beyond > 0.0], atol=1e-9)
    assert {found.limits[each][1] for each in found.binding[beyond > 0.0]} == {"closed"}
    assert 20 < (beyond > 0.0).sum() < 180


@pytest.mark.parametrize("name", ["stewart", "hexaglide", "delta", "rrr"])
def test_blocks_measure_what_is_measured_one_by_one(name: str) -> None:
    mechanism, model = machine(name), Model(machine(name))
    table = model.legs
    singly = Model(mechanism)
    vars(singly.legs)["is_for_blocks"] = False
    poses = targets_around_home(name, 200, 0.4, 0.8)
    poses[7] = np.nan
    asked = poses, mechanism.home_pose[None].copy(), table.home_sides
    (margins, _), (each, _) = (_margins(legs, *asked) for legs in (model, singly))
    assert table.is_for_blocks
    np.testing.assert_allclose(margins, each, rtol=1e-9, atol=1e-9)
    assert (each > 0.0).any() and (each < 0.0).any()


def test_feasibility_of_one_target_is_a_number_and_of_no_pose_unknown() -> None:
    mechanism = machine("delta")
    assert pf.feasibility(mechanism, mechanism.home_pose).margin > 0.0
    broken = np.stack([mechanism.home_pose, np.full((4, 4), np.nan)])
    found = pf.feasibility(mechanism, broken)
    assert np.isnan(found.margin[1])
    assert found.binding[1] == -1


def test_feasibility_without_closed_forms_says_why() -> None:
    with pytest.raises(pf.errors.UnsupportedMechanism, match="no legs in closed form"):
        pf.feasibility(machine("nrpm"), machine("nrpm").home_pose)
