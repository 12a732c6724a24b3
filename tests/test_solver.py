"""A prepared solver: the answers of `solve_ik` and `solve_fk`, in arrays that stay; and searches with a bound."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from oracles import targets_about
from pfabrik import Options, Solver, Status
from pfabrik.engines.engine import engine_of
from pfabrik.errors import InvalidArgument
from test_dynamics import motorised, weighed

MACHINES = ["delta", "rps", "stewart", "five_bar", "serial_arm"]


def targets(mechanism: pf.Mechanism, n: int, shift: float) -> np.ndarray:
    """Poses (n, 4, 4) up to `shift` [L] from home, a little turned."""
    return targets_about(mechanism, np.random.default_rng(2), n, shift, 0.1)


def assert_same(solver: Solver, expected: pf.Solution, status: Status) -> None:
    """The arrays, the solution and the Jacobian are those of a single call."""
    assert status is solver.status is expected.status
    np.testing.assert_array_equal(solver.pose, expected.pose)
    np.testing.assert_array_equal(solver.actuators, expected.actuators)
    np.testing.assert_array_equal(solver.jacobian(), pf.forward_jacobian(expected))
    assert solver.solution.to_dict() == expected.to_dict()


@pytest.mark.parametrize("started", [False, True])
@pytest.mark.parametrize("name", MACHINES)
def test_answers_statuses_and_jacobians_are_those_of_single_calls(name: str, started: bool) -> None:
    """Within reach and out of it, from home and from a start."""
    mechanism = pf.load(name)
    start = pf.solve_ik(mechanism, targets(mechanism, 1, 0.03)[0]) if started else None
    solver = Solver(mechanism, start=start)
    for target in [mechanism.home_pose, *targets(mechanism, 3, 0.05), *targets(mechanism, 2, 1.0)]:
        assert_same(solver, pf.solve_ik(mechanism, target, start=start), solver.ik(target))
    for share in (0.0, 0.02, 5.0):
        values = pf.solve_ik(mechanism, mechanism.home_pose).actuators + share
        assert_same(solver, pf.solve_fk(mechanism, values, start=start), solver.fk(values))


@pytest.mark.parametrize("kind", ["position", "list", "transposed", "joint"])
def test_any_kind_of_target_is_taken_and_may_change_afterwards(kind: str) -> None:
    mechanism = pf.load("ankle_ups" if kind == "joint" else "delta")
    pose = np.array(mechanism.home_pose)
    given = {
        "position": pose[:3, 3].tolist(),
        "list": pose.tolist(),
        "transposed": np.asfortranarray(pose),
        "joint": {"pivot": (0.1, 0.05)},
    }[kind]
    solver, expected = Solver(mechanism), pf.solve_ik(mechanism, given)
    assert solver.ik(given) is Status.REACHED
    np.testing.assert_array_equal(solver.actuators, expected.actuators)
    solver.ik(pose)
    before = pf.solve_ik(mechanism, pose).actuators
    pose[:3, 3] = np.nan
    np.testing.assert_array_equal(solver.solution.actuators, before)


def test_views_stay_and_are_overwritten_and_the_solution_is_not() -> None:
    mechanism = pf.load("delta")
    solver = Solver(mechanism)
    first, second = targets(mechanism, 2, 0.05)
    solver.ik(first)
    pose, actuators, jacobian, kept = solver.pose, solver.actuators, solver.jacobian(), solver.solution
    before = actuators.copy()
    solver.ik(second)
    assert solver.pose is pose and solver.actuators is actuators and (actuators != before).any()
    np.testing.assert_array_equal(actuators, solver.solution.actuators)
    solver.jacobian()
    np.testing.assert_array_equal(jacobian, pf.forward_jacobian(solver.solution))
    np.testing.assert_array_equal(kept.actuators, before)
    for view in (pose, actuators, jacobian):
        with pytest.raises(ValueError, match="read-only"):
            view[0] = 0.0


def test_options_hold_for_every_question() -> None:
    mechanism = pf.load("stewart")
    far = pf.pose(np.array(mechanism.reference_point) * 1.5, rpy=[0.0, 0.2, 0.0])
    solver = Solver(mechanism, options=Options(hold="position", on_invalid="mark"))
    assert solver.ik(far) is Status.PROJECTED
    np.testing.assert_array_equal(solver.pose, pf.solve_ik(mechanism, far, options=Options(hold="position")).pose)
    assert solver.ik(np.full((4, 4), np.nan)) is Status.INVALID
    assert np.isnan(solver.actuators).all()


@pytest.mark.parametrize("name", ["delta", "stewart"])
def test_a_refused_question_leaves_no_answer(name: str) -> None:
    mechanism = pf.load(name)
    solver = Solver(mechanism)
    assert solver.status is Status.INVALID
    refused = [
        (solver.ik, 2.0 * np.eye(4), "matrix that is not a rotation|last row"),
        (solver.ik, np.full((4, 4), np.nan), "not finite"),
        (solver.ik, np.zeros(5), "target: found shape"),
        (solver.ik, np.tile(mechanism.home_pose, (2, 1, 1)), "target: found batch shape .2,.; expected one at a time"),
        (solver.fk, np.zeros(2), "actuators: found shape"),
        (solver.fk, np.zeros((2, len(mechanism.actuator_names))), "expected one at a time"),
    ]
    for ask, given, told in refused:
        assert solver.ik(np.array(mechanism.home_pose)) is Status.REACHED
        with pytest.raises(InvalidArgument, match=told):
            ask(given)
        assert solver.status is Status.INVALID
        assert np.isnan(solver.pose).all() and np.isnan(solver.actuators).all()
        with pytest.raises(InvalidArgument, match="solution: found no answer"):
            solver.jacobian()


@pytest.mark.parametrize("started", [False, True])
def test_an_answer_may_be_asked_back_as_it_stands(started: bool) -> None:
    """What it answered in are views, which the next question clears before it looks."""
    mechanism = pf.load("stewart")
    solver = Solver(mechanism, start=pf.solve_ik(mechanism, mechanism.home_pose) if started else None)
    wanted = pf.pose(mechanism.reference_point + np.array([4.0, -3.0, 5.0]), rotvec=(0.02, 0.01, -0.03))
    assert solver.ik(wanted) is Status.REACHED
    assert solver.fk(solver.actuators) is Status.REACHED
    np.testing.assert_allclose(solver.pose, wanted, atol=1e-9 * mechanism.characteristic_length)
    assert solver.ik(solver.pose[:3, 3]) is Status.REACHED
    np.testing.assert_allclose(solver.pose[:3, 3], wanted[:3, 3], atol=1e-9 * mechanism.characteristic_length)


def test_a_copy_is_prepared_anew_and_shares_nothing() -> None:
    solver = Solver(pf.load("stewart"), options=Options(hold=None))
    lower, higher = ([0.0, 0.0, z] for z in (190.0, 200.0))
    for twin in (copy.copy(solver), copy.deepcopy(solver), pickle.loads(pickle.dumps(solver))):
        solver.ik(lower)
        assert twin.status is Status.INVALID and twin.options == solver.options
        assert twin.ik(higher) is Status.REACHED
        assert solver.pose[2, 3] == pytest.approx(190.0) and twin.pose[2, 3] == pytest.approx(200.0)


# --- bounded searches ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", pf.catalog())
def test_bounded_searches_are_feasible_and_say_whether_they_were_cut(name: str) -> None:
    mechanism = pf.load(name)
    asked = targets_about(mechanism, np.random.default_rng(4), 4, 0.9, 0.7)
    whole = pf.solve_ik(mechanism, asked)
    assert np.all(whole.is_complete)
    for most_steps in (1, 8, 64):
        answer = pf.solve_ik(mechanism, asked, options=Options(most_steps=most_steps))
        is_lost = answer.status != whole.status  # within reach of joint coordinates, where closing takes steps
        assert np.all(answer.status[is_lost] == Status.PROJECTED)
        assert not (is_lost.any() and engine_of(mechanism).is_fast)
        assert np.all(pf.closure_residual(answer) <= 1e-9 * mechanism.characteristic_length)
        assert np.all(answer.limit_excess <= 1e-9)
        is_projected = answer.status == Status.PROJECTED
        assert np.all(answer.iterations[is_projected] <= most_steps)
        assert np.all(answer.is_complete[~is_projected | answer.certified])
    solver = Solver(mechanism, most_steps=1)
    assert solver.options.most_steps == 1
    solver.ik(asked[0])
    assert np.array_equal(solver.pose, pf.solve_ik(mechanism, asked[0], options=solver.options).pose)


def test_where_no_step_is_left_the_start_answers_and_it_must_be_feasible() -> None:
    mechanism, one = pf.load("stewart"), Options(most_steps=1)
    start = pf.solve_ik(mechanism, (0, 0, 10) + mechanism.home_pose[:3, 3])
    far = mechanism.home_pose.copy()
    far[:3, :3] = Rotation.from_rotvec((1.5, 0.0, 0.0)).as_matrix()
    answer = pf.solve_ik(mechanism, far, start=start, options=one)
    assert answer.status is Status.PROJECTED and not answer.is_complete and answer.held is None
    np.testing.assert_array_equal(answer.pose, start.pose)
    np.testing.assert_array_equal(answer.actuators, start.actuators)
    with pytest.raises(InvalidArgument, match="feasible"):
        pf.solve_ik(mechanism, mechanism.home_pose, start=start.q + 0.3, options=one)


def test_a_bounded_search_bounds_no_later_call() -> None:
    mechanism = pf.load("stewart")
    values = 1.5 * np.asarray(pf.solve_ik(mechanism, mechanism.home_pose).actuators)
    before = pf.solve_fk(mechanism, values)
    Solver(mechanism, most_steps=1).ik(mechanism.home_pose @ pf.pose((300.0, 0.0, 0.0)))
    after = pf.solve_fk(mechanism, values)
    assert after.status == before.status == Status.PROJECTED
    np.testing.assert_array_equal(after.actuators, before.actuators)


MOVED = ["stewart", "delta", "hexaglide", "nrpm", "rps", "five_bar", "agile_eye", "panda", "linear_delta", "canfield"]


@pytest.mark.parametrize("name", MOVED)
def test_efforts_of_states_are_those_of_inverse_dynamics(name: str) -> None:
    """Within reach and out of it, at rest and moving, with what bodies carry from call to call and without."""
    mechanism = motorised(weighed(pf.load(name)))
    solver, random, length = Solver(mechanism), np.random.default_rng(3), mechanism.characteristic_length
    unit = np.repeat([length, 1.0], 3)
    own = mechanism.bodies[-1] if mechanism.bodies[-1] != mechanism.base else mechanism.bodies[0]
    carried = {own: (0.5, np.asarray(mechanism.reference_point) + 0.1 * length)}
    for target in [mechanism.home_pose, *targets(mechanism, 2, 0.05), *targets(mechanism, 1, 1.0)]:
        twist, gain = random.standard_normal((2, 6)) * unit
        for loads in (None, carried, {own: (np.array([3.0, -2.0, 1.0]), np.zeros(3))}):
            for gravity in ((0.0, 0.0, -9.81), random.standard_normal(3)):
                moves = {"twists": twist, "accelerations": gain, "loads": loads, "gravity": gravity}
                efforts = solver.effort(target, twist, gain, loads=loads, gravity=gravity)
                expected = pf.inverse_dynamics(pf.solve_ik(mechanism, target), **moves).actuators
                np.testing.assert_allclose(efforts, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
        at_rest = pf.inverse_dynamics(pf.solve_ik(mechanism, target)).actuators
        np.testing.assert_allclose(solver.effort(target), at_rest, rtol=1e-9, atol=1e-9 * np.abs(at_rest).max())
        assert solver.status is pf.solve_ik(mechanism, target).status


def test_loads_that_change_in_place_count() -> None:
    mechanism = weighed(pf.load("delta"))
    solver, carried = Solver(mechanism), np.zeros(3)
    loads = {"platform": (np.array([0.0, 0.0, -1.0]), carried)}
    before = solver.effort(mechanism.home_pose, loads=loads).copy()
    loads["platform"][0][:] = 0.0
    np.testing.assert_allclose(solver.effort(mechanism.home_pose, loads=loads), solver.effort(mechanism.home_pose))
    assert np.abs(before - solver.effort(mechanism.home_pose)).max() > 0.01


def test_efforts_refuse_what_inverse_dynamics_does() -> None:
    mechanism = weighed(pf.load("stewart"))
    solver, home = Solver(mechanism), mechanism.home_pose
    with pytest.raises(InvalidArgument, match="twist"):
        solver.effort(home, np.array([0.0, 0.0, np.nan, 0.0, 0.0, 0.0]))
    with pytest.raises(InvalidArgument, match="acceleration"):
        solver.effort(home, None, [1.0, 2.0])
    with pytest.raises(pf.errors.UnknownName, match="platfrom"):
        solver.effort(home, loads={"platfrom": (1.0, np.zeros(3))})
    with pytest.raises(InvalidArgument, match="loads"):
        solver.effort(home, loads=3.0)
    assert np.isnan(solver.effort(home, np.full(6, 1e200))).all()  # forces overflow
    with pytest.raises(InvalidArgument, match="mass"):
        Solver(pf.load("stewart")).effort(home)
