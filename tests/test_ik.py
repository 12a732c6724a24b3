"""Inverse kinematics against the closed forms, and what an answer promises for any target."""

from __future__ import annotations

import weakref
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import oracles
import pfabrik as pf
from checks import INTERPRETED, assert_feasible
from machines import MACHINES
from machines import machine as made
from pfabrik.errors import InvalidArgument

CATALOGUE = ("five_bar", "stewart", "nrpm")


@pytest.fixture(scope="module", params=CATALOGUE)
def machine(request: pytest.FixtureRequest) -> pf.Mechanism:
    return pf.load(request.param)


def assert_same_as_closed_form(machine: pf.Mechanism, margin: np.ndarray, answer: pf.Solution) -> None:
    sure = np.abs(margin) > 1e-8
    assert ((answer.status == pf.Status.REACHED) == (margin >= 0))[sure].all()
    assert_feasible(machine, answer)


@pytest.mark.parametrize("count", [40 if INTERPRETED else 1000, pytest.param(10_000, marks=pytest.mark.campaign)])
def test_reached_exactly_where_the_closed_form_says_cold_and_warm(machine: pf.Mechanism, count: int) -> None:
    rng = np.random.default_rng(count)
    targets = oracles.random_targets(machine, rng, count)
    margin = oracles.margin(machine, targets)
    cold = pf.solve_ik(machine, targets)
    assert_same_as_closed_form(machine, margin, cold)
    seeds = cold[rng.permutation(len(targets))]
    warm = pf.solve_ik(machine, targets, start=seeds, options=pf.Options(working_mode="any"))
    assert_same_as_closed_form(machine, margin, warm)


@pytest.mark.parametrize("count", [30, pytest.param(200, marks=pytest.mark.campaign)])
def test_status_is_right_on_both_sides_of_the_boundary(machine: pf.Mechanism, count: int) -> None:
    """Targets a millionth of L inside and outside the edge, by the closed form."""
    count = count // 5 if machine.name.startswith("Redundant") else count  # whose margins are searched for
    rng = np.random.default_rng(3)
    outward = rng.normal(size=(count, 3)) * ([0, 1, 1] if machine.name.startswith("Planar") else 1)
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    home, length = np.array(machine.reference_point), machine.characteristic_length

    def targets(distance: np.ndarray) -> np.ndarray:
        return oracles.poses((home + distance[..., None] * outward).reshape(-1, 3))

    farthest, width = np.full(count, 10 * length), 1e-7 * length
    edge = oracles.edge(lambda d: oracles.margin(machine, targets(d)).reshape(d.shape), farthest, width)
    inner, outer = targets(edge - 1e-6 * length), targets(edge + 1e-6 * length)
    assert (oracles.margin(machine, inner) >= 0).all() and (oracles.margin(machine, outer) < 0).all()
    within, beyond = pf.solve_ik(machine, inner), pf.solve_ik(machine, outer)
    assert (within.status == pf.Status.REACHED).all()
    assert (beyond.status == pf.Status.PROJECTED).all()
    assert np.median(beyond.position_error) <= 1.1e-6 * length
    assert all(beyond.active_limits[i] or machine.end_effector_is_joint for i in range(len(outward)))


def test_actuators_are_those_of_the_closed_form() -> None:
    for name in ("five_bar", "stewart"):
        machine = pf.load(name)
        targets = oracles.inside_targets(machine, np.random.default_rng(4), 20 if INTERPRETED else 300)
        answer = pf.solve_ik(machine, targets)
        np.testing.assert_allclose(answer.actuators, oracles.actuators(machine, targets), rtol=0, atol=1e-9)


_numbers = st.floats(-1.0, 1.0)
_scales = st.sampled_from([0.0, 0.03, 0.3, 1.0, 10.0, 1e6, 1e150])


@pytest.mark.parametrize("name", [*CATALOGUE, *MACHINES])
@given(direction=st.tuples(_numbers, _numbers, _numbers), scale=_scales, turn=st.tuples(*[st.floats(-3.2, 3.2)] * 3))
@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
def test_limits_are_kept_and_loops_closed_for_any_finite_target(
    name: str, direction: tuple[float, ...], scale: float, turn: tuple[float, ...]
) -> None:
    mechanism = made(name)
    position = mechanism.reference_point + scale * mechanism.characteristic_length * np.array(direction)
    answer = pf.solve_ik(mechanism, pf.pose(position, rotvec=turn))
    assert_feasible(mechanism, answer)
    if answer.status == pf.Status.REACHED:
        assert answer.position_error <= 1e-9 * mechanism.characteristic_length
        assert answer.rotation_error <= 1e-9


def test_positions_alone_mean_home_orientation() -> None:
    mechanism = pf.load("stewart")
    position = np.add(mechanism.reference_point, (3.0, -2.0, 1.0))
    by_position, by_pose = pf.solve_ik(mechanism, position), pf.solve_ik(mechanism, pf.pose(position))
    np.testing.assert_array_equal(by_position.actuators, by_pose.actuators)


def test_a_point_has_no_orientation_to_miss() -> None:
    mechanism = pf.load("five_bar")
    answer = pf.solve_ik(mechanism, pf.pose(mechanism.reference_point, rotvec=[0.3, 0.2, 0.1]))
    assert answer
    assert answer.rotation_error == 0.0


def test_home_seeds_the_answer_where_no_seed_is_given() -> None:
    """Both elbows of an unlimited 5-bar reach; the answer stays on home's."""
    mechanism = pf.load("five_bar").without_limits()
    targets = oracles.inside_targets(pf.load("five_bar"), np.random.default_rng(7), 10)
    home = pf.solve_ik(mechanism, mechanism.home_pose)
    seeded = pf.solve_ik(mechanism, targets, start=home)
    np.testing.assert_allclose(seeded.actuators, pf.solve_ik(mechanism, targets).actuators)


def test_another_working_mode_is_used_where_only_it_keeps_the_limits() -> None:
    """An elbow range that contains home, not home's bend at the target, but the mirrored one."""
    machine = pf.load("five_bar").without_limits().with_limits(p2=np.radians((-100.0, 140.0)))
    target = np.subtract(machine.reference_point, (0.0, 5.0, 75.0))
    modes = oracles.working_modes(machine, target)
    assert modes.margins[0] < 0 < modes.margins.max()
    assert pf.solve_ik(machine, target)
    kept = pf.solve_ik(machine, target, options=pf.Options(working_mode="keep"))
    assert kept.status is pf.Status.PROJECTED
    assert [(limit.joint, limit.bound) for limit in kept.active_limits] == [("p2", "min")]


def test_projection_names_the_limits_that_hold_it_back() -> None:
    mechanism = pf.load("stewart")
    answer = pf.solve_ik(mechanism, np.add(mechanism.reference_point, (0, 0, 1000.0)))
    assert answer.status is pf.Status.PROJECTED
    assert {limit.joint for limit in answer.active_limits} == set(mechanism.actuator_names)
    assert {limit.bound for limit in answer.active_limits} == {"max"}
    assert answer.rotation_error <= 1e-9
    sideways = pf.solve_ik(mechanism, np.add(mechanism.reference_point, (1000.0, 0, 0)))
    assert 0 < len(sideways.active_limits) < 18


def test_holding_the_position_turns_the_platform_instead() -> None:
    mechanism = pf.load("stewart")
    target = pf.pose(mechanism.reference_point, rotvec=[1.2, 0, 0])
    answer = pf.solve_ik(mechanism, target, options=pf.Options(hold="position"))
    assert answer.status is pf.Status.PROJECTED
    assert answer.position_error <= 1e-9 * mechanism.characteristic_length
    assert 0 < answer.rotation_error < 1.2
    assert_feasible(mechanism, answer)


def test_an_orientation_that_no_position_suits_gives_way() -> None:
    mechanism = pf.load("stewart")
    answer = pf.solve_ik(mechanism, pf.pose(mechanism.reference_point, rotvec=[0, 0, 3.0]))
    assert answer.status is pf.Status.PROJECTED
    assert answer.rotation_error > 0.1
    assert_feasible(mechanism, answer)


@pytest.mark.parametrize("name", CATALOGUE)
def test_the_papers_settings_end_within_its_tolerance_with_the_loops_closed(name: str) -> None:
    mechanism = pf.load(name)
    targets = oracles.inside_targets(mechanism, np.random.default_rng(8), 10 if INTERPRETED else 200, least=0.05)
    answer = pf.passes.solve(mechanism, targets)
    assert_feasible(mechanism, answer)
    assert (answer.position_error <= 1e-2).mean() > 0.95
    assert np.median(answer.iterations) <= 100


@pytest.mark.parametrize("name", ["stewart", "delta", "servo_hexapod", "five_bar", "hexaglide"])
def test_a_certified_answer_asked_again_is_the_answer_but_with_other_tolerances(name: str) -> None:
    mechanism = pf.load(name)
    targets = oracles.targets_about(mechanism, np.random.default_rng(3), 12, 0.9, 0.2)
    answer = next(a for a in pf.solve_ik(mechanism, targets) if a.status is pf.Status.PROJECTED and a.certified)
    target = answer._request.targets[0]
    again = pf.solve_ik(mechanism, target, start=answer)
    assert again.certified
    assert again.status is pf.Status.PROJECTED
    assert np.array_equal(again.q, answer.q)
    wide = pf.Options(tolerance=2.0 * answer.position_error, rotation_tolerance=0.1)
    assert pf.solve_ik(mechanism, target, start=answer, options=wide).status is pf.Status.REACHED


def test_batches_asked_again_do_not_keep_all_answers_before_them() -> None:
    mechanism = pf.load("stewart")
    targets = oracles.targets_about(mechanism, np.random.default_rng(3), 12, 0.6, 0.4)
    first = answer = pf.solve_ik(mechanism, targets, options=pf.Options(hold=None))
    assert 0 < np.count_nonzero(first.status == pf.Status.PROJECTED) < len(targets)
    kept = weakref.ref(first._configurations)
    for _ in range(40):
        answer = pf.solve_ik(mechanism, targets, start=answer, options=pf.Options(hold=None))
    q = first.q.copy()
    del first
    assert kept() is None
    np.testing.assert_allclose(answer.q, q, rtol=0, atol=1e-12)


def test_rotations_are_accepted_up_to_the_stated_deviation() -> None:
    mechanism = pf.load("stewart")
    for deviation, accepted in ((0.4e-6, True), (0.6e-6, False)):
        target = mechanism.home_pose.copy()
        target[:3, :3] *= 1 + deviation
        if accepted:
            assert pf.solve_ik(mechanism, target)
        else:
            with pytest.raises(InvalidArgument):
                pf.solve_ik(mechanism, target)


def test_a_mechanism_that_positions_cannot_express_is_solved_by_the_closure_engine() -> None:
    joints = []
    directions = [(np.cos(angle), np.sin(angle)) for angle in (0.0, 2.1, 4.2)]
    for i, (c, s) in enumerate(directions, 1):
        tangent, across = (-s, c, 0), (150 * c, 150 * s, 30)
        joints += [
            pf.Joint(f"A{i}", "universal", ("base", f"c{i}"), at=(80 * c, 80 * s, 0), axes=(tangent, across)),
            pf.Joint(f"B{i}", "prismatic", (f"c{i}", f"r{i}"), along=(f"A{i}", f"C{i}"), actuated=True),
            pf.Joint(f"C{i}", "universal", (f"r{i}", "platform"), at=(50 * c, 50 * s, 150), axes=(across, tangent)),
        ]
    mechanism = pf.Mechanism("3-UPU", joints, "platform", (0, 0, 150))
    assert all(chain.reason for chain in pf.decompose(mechanism))
    raised = mechanism.home_pose + np.array([[0], [0], [12.0], [0]]) * [0, 0, 0, 1]
    answer = pf.solve_ik(mechanism, raised)
    assert answer.status is pf.Status.REACHED
    expected = [np.linalg.norm(np.subtract((50 * c, 50 * s, 162), (80 * c, 80 * s, 0))) for c, s in directions]
    np.testing.assert_allclose(answer.actuators, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("solve", [pf.solve_ik, pf.passes.solve])
def test_a_joint_end_effector_has_no_orientation_to_hold(solve: Any) -> None:
    answer = solve(pf.load("five_bar"), (0, 60, 300))
    assert answer.status is pf.Status.PROJECTED
    assert answer.held is None
    assert isinstance(answer.active_limits, tuple)
