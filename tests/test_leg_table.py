"""Legs in closed form: what they reach, in which working mode, and with which margins."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import oracles
import pfabrik as pf
from checks import actuator_units
from machines import closure, machine
from pfabrik.engines.engine import engine_of
from pfabrik.engines.joints.configurations import Configurations, new_rows
from pfabrik.engines.pose.answers import sides_at
from pfabrik.engines.pose.leg_margins import leg_margins as _margins
from pfabrik.engines.pose.legs_engine import LegsEngine
from pfabrik.engines.pose.reach import reach
from pfabrik.kernels.rows import Rows
from pfabrik.machine.model import Model, model_of
from pfabrik.machine.motion.mobility import generic_of
from pfabrik.options import Options

SERVED = [name for name in pf.catalog() if not model_of(pf.load(name)).why_poses_do_not_suffice]
IN_FRONT = [name for name in SERVED if isinstance(engine_of(pf.load(name)), LegsEngine)]


def targets_around_home(name: str, n: int, shift: float, turn: float, seed: int = 1) -> np.ndarray:
    """Poses (n, 4, 4) up to `shift` [L] and `turn` [rad] away, in directions in which the machine can move."""
    mechanism = machine(name)
    directions, moves = generic_of(mechanism).directions, np.random.default_rng(seed).uniform(-1.0, 1.0, (n, 6))
    moves[:, : len(directions)] = moves[:, : len(directions)] @ directions @ directions.T
    poses = np.tile(mechanism.home_pose, (n, 1, 1))
    poses[:, :3, 3] += shift * mechanism.characteristic_length * moves[:, :3]
    if not mechanism.end_effector_is_joint:
        poses[:, :3, :3] = Rotation.from_rotvec(turn * moves[:, 3:]).as_matrix()
    return poses


def reached_by_legs(
    mechanism: pf.Mechanism, targets: np.ndarray, start: Configurations | None = None
) -> tuple[Rows, Rows]:
    """What legs alone reach in the working mode of a start, or of home, and what joint space answers."""
    engine = engine_of(mechanism)
    assert isinstance(engine, LegsEngine)
    rows, keep = new_rows(model_of(mechanism), len(targets)), start is not None
    sides = engine._table.home_sides if start is None else sides_at(engine.model, start)
    reach(engine.model, targets, start, sides, keep, rows)
    return rows, engine._joint_space.answer(targets, start, Options(), keep_mode=keep).rows


def off(mechanism: pf.Mechanism, actuators: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Largest difference of actuator values, (n,) [L or rad]."""
    return np.abs((actuators - others) / actuator_units(mechanism)).max(axis=-1)


@pytest.mark.parametrize("name", IN_FRONT)
def test_legs_reach_what_joint_space_reaches(name: str) -> None:
    mechanism = machine(name)
    targets = targets_around_home(name, 60, 0.25, 0.45)
    rows, behind = reached_by_legs(mechanism, targets)
    reached, in_any_mode = rows.status == pf.Status.REACHED, pf.solve_ik(mechanism, targets).status == pf.Status.REACHED
    assert reached.any() and not (reached & ~in_any_mode).any()
    np.testing.assert_array_equal(in_any_mode, behind.status == pf.Status.REACHED)
    assert off(mechanism, rows.actuators[reached], behind.actuators[reached]).max() <= 1e-9


@pytest.mark.parametrize("name", ["g1_ankle", "prs", "agile_eye"])
def test_a_start_keeps_its_working_mode(name: str) -> None:
    mechanism = machine(name).without_limits()
    home = pf.solve_ik(mechanism, mechanism.home_pose)
    modes = pf.working_modes(mechanism, mechanism.home_pose)
    others = [each for each in modes if each and np.abs(each.pose - mechanism.home_pose).max() < 1e-6]
    start = max(others, key=lambda each: off(mechanism, each.actuators, home.actuators))
    assert off(mechanism, start.actuators, home.actuators) > 0.1
    near = targets_around_home(name, 30, 0.01, 0.02)
    rows, behind = reached_by_legs(mechanism, near, start._configurations)
    assert (rows.status == pf.Status.REACHED).all()
    answers = pf.solve_ik(mechanism, near, start=start)
    for actuators in (rows.actuators, answers.actuators):
        assert off(mechanism, actuators, behind.actuators).max() <= 1e-9
    assert off(mechanism, answers.actuators, start.actuators).max() < 0.1


@pytest.mark.parametrize("name", ["delta", "rps", "canfield"])
def test_an_answer_starts_the_next_one_as_its_joint_coordinates_do(name: str) -> None:
    mechanism = machine(name)
    before = pf.solve_ik(mechanism, mechanism.home_pose)
    for target in targets_around_home(name, 4, 0.05, 0.02, seed=4):
        found = pf.solve_ik(mechanism, target, start=before)
        again = pf.solve_ik(mechanism, target, start=before.q)
        assert found and again
        assert off(mechanism, found.actuators, again.actuators) <= 1e-9
        np.testing.assert_allclose(found.pose, again.pose, rtol=0, atol=1e-9 * mechanism.characteristic_length)
        assert pf.closure_residual(found) <= 1e-9 * mechanism.characteristic_length
        before = found


def test_a_slide_counts_as_its_joint_says_whichever_way_that_points() -> None:
    stewart, joints = machine("stewart"), []
    for place, joint in enumerate(stewart.joints):
        if joint.along is not None:
            axis = np.array(stewart.home_axis(joint.name)) * (1 if place % 2 else -1)
            bodies = joint.connects if place % 4 < 2 else joint.connects[::-1]
            joint = pf.Joint(joint.name, "prismatic", bodies, axis=axis, actuated=True, range=(-40.0, 40.0))
        joints.append(joint)
    mechanism = pf.Mechanism("slides both ways", joints, "platform", stewart.reference_point)
    assert model_of(mechanism).has_legs
    answers = pf.solve_ik(mechanism, targets_around_home("stewart", 20, 0.05, 0.1))
    assert (answers.status == pf.Status.REACHED).all()
    assert pf.closure_residual(answers).max() <= 1e-9 * mechanism.characteristic_length


@pytest.mark.parametrize("name", ["delta", "rps", "canfield", "stewart", "rrr"])
def test_feasibility_is_the_least_margin_and_tells_what_is_reached(name: str) -> None:
    mechanism = machine(name)
    targets = targets_around_home(name, 120, *((0.8, 0.8) if name == "rrr" else (0.25, 0.45)))
    found = pf.feasibility(mechanism, targets)
    answers = pf.solve_ik(mechanism, targets, options=Options(working_mode="keep"))
    reached = np.asarray(answers.status) == pf.Status.REACHED
    np.testing.assert_array_equal(found.margin > 0.0, reached)
    assert 0 < reached.sum() < len(reached)
    least = np.min(list(pf.margins(answers[reached]).values()), axis=0)
    np.testing.assert_allclose(found.margin[reached], least, atol=1e-9)
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


def with_a_locked_strut() -> tuple[pf.Mechanism, pf.Mechanism]:
    """A hexapod one of whose struts is passive and locked, and the same with that strut in one piece."""
    free, strut = replace(machine("stewart"), task=("x", "y", "z", "tilt")), machine("stewart").joint("BL1")
    length = free.home_coordinate("BL1")
    locked = replace(strut, actuated=False, range=(length, length))
    weld = pf.Joint("BL1", "fixed", strut.connects, at=free.reference_point)
    return tuple(replace(free, joints=[other if j is strut else j for j in free.joints]) for other in (locked, weld))


def test_a_locked_passive_joint_is_a_constraint_as_a_rigid_strut_is() -> None:
    locked, rigid = with_a_locked_strut()
    targets = oracles.targets_about(locked, np.random.default_rng(1), 20, 0.05, 0.1)
    answers, others = pf.solve_ik(locked, targets), pf.solve_ik(rigid, targets)
    assert (answers.status == pf.Status.REACHED).sum() > 10
    np.testing.assert_array_equal(answers.joints["BL1"], locked.home_coordinate("BL1"))
    np.testing.assert_allclose(answers.pose, others.pose, rtol=0, atol=1e-7)
    np.testing.assert_array_equal(pf.feasibility(locked, targets).margin, pf.feasibility(rigid, targets).margin)
    found, expected = (pf.travel(pf.solve_ik(each, each.home_pose), along=(0, -1, 0)) for each in (locked, rigid))
    assert found.distances == pytest.approx(expected.distances, abs=1e-6) and found.distances[0] > 0.01
    assert [limit.joint for limit in found[0].stopped_by] == [limit.joint for limit in expected[0].stopped_by]
    assert pf.mobility(locked) == pf.mobility(rigid)
    assert pf.singularity(answers[0]).parallel == pytest.approx(pf.singularity(others[0]).parallel)
    values = pf.solve_ik(locked, locked.home_pose).actuators
    assert len(pf.assembly_modes(locked, values)) == len(pf.assembly_modes(rigid, values)) > 0


@pytest.mark.campaign
@pytest.mark.parametrize("name", SERVED)
def test_what_feasibility_says_is_what_is_reached_however_far_from_home(name: str) -> None:
    sizes = ((0.1, 0.1), (0.4, 0.4), (1.2, 0.8))
    targets = np.concatenate([targets_around_home(name, 3000, *size) for size in sizes])
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
    assert {found.limits[each][1] for each in found.binding[beyond > 0.0]} == {"not closed"}
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


def test_feasibility_of_one_target_is_a_number_of_no_pose_unknown_and_without_closed_forms_refused() -> None:
    mechanism = machine("delta")
    assert pf.feasibility(mechanism, mechanism.home_pose).margin > 0.0
    found = pf.feasibility(mechanism, np.stack([mechanism.home_pose, np.full((4, 4), np.nan)]))
    assert np.isnan(found.margin[1]) and found.binding[1] == -1
    with pytest.raises(pf.errors.UnsupportedMechanism, match="poses leave joints A1"):
        pf.feasibility(machine("nrpm"), machine("nrpm").home_pose)


@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
def test_a_chain_that_is_no_leg_is_named_with_the_reason_and_answered_all_the_same() -> None:
    assert model_of(closure.crooked_upr()).why_no_legs.startswith("sub-chain R*-U-P*-U: ")
    clavel = closure.pinned_delta()
    along = {leg: np.subtract(clavel.joint(f"C{leg}").at, clavel.joint(f"B{leg}").at) for leg in "123"}
    inward = {"D": 0.1, "E": -0.1}  # pins off the hinges beside them, as in Tsai's
    joints = [
        replace(joint, at=joint.at + inward.get(joint.name[0], 0.0) * along[joint.name[1]]) for joint in clavel.joints
    ]
    tsai = replace(clavel, joints=joints)
    assert "not as long as the hinges beside it are apart" in model_of(tsai).why_no_legs
    answers = pf.solve_ik(tsai, oracles.targets_about(tsai, np.random.default_rng(2), 10, 0.1, 0.0))
    assert (answers.status == pf.Status.REACHED).all()
    assert pf.closure_residual(answers).max() <= 1e-9 * tsai.characteristic_length
