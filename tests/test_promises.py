"""Cases in which an easier solver breaks its word: each a machine that once showed how."""

from __future__ import annotations

import copy
import multiprocessing
import pickle
import sys
from collections.abc import Mapping

import numpy as np
import pytest

import machines
import pfabrik as pf
from checks import assert_feasible
from machines import closure
from pfabrik import Cone, Joint, Mechanism, Options, Status

Z = (0.0, 0.0, 1.0)
pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")


def five_bar() -> Mechanism:
    return machines.five_bar([(-50, 0), (50, 0)], [(-120, 60), (120, 60)], (0, 130))


def arm_on_a_rail(travel: float | None = None) -> Mechanism:
    limits = None if travel is None else (-travel, travel)
    joints = [
        Joint("P", "prismatic", ("base", "c"), axis=(0, 1, 0), actuated=True, range=limits),
        Joint("R1", "revolute", ("c", "a"), at=(0, 0, 0), axis=Z, actuated=True, range=(-0.4, 0.4)),
        Joint("R2", "revolute", ("a", "b"), at=(100, 0, 0), axis=Z, actuated=True, range=(-0.9, 0.5)),
        Joint("tip", "revolute", ("b", "g"), at=(150, 50, 0), axis=Z),
    ]
    return Mechanism("arm on a rail", joints, "tip")


@pytest.mark.parametrize("angle", [0.5, 2.0, 4.5])
def test_a_path_that_leaves_the_workspace_and_returns_ends_as_it_began(angle: float) -> None:
    """The arms stretch out at the boundary, where their two bends meet; they come back in their own."""
    machine = five_bar()
    away = np.r_[np.linspace(0, 500, 60), np.linspace(500, 0, 60)]
    path = machine.reference_point + away[:, None] * [np.cos(angle), np.sin(angle), 0]
    answer = pf.track(machine, path)
    assert (answer.status == Status.PROJECTED).any()
    np.testing.assert_allclose(answer.actuators[-1], answer.actuators[0], atol=1e-9)


def test_a_projection_keeps_the_working_mode_of_its_seed() -> None:
    machine = five_bar()
    home = pf.solve_ik(machine, machine.home_pose)
    projected = pf.solve_ik(machine, [500, 130, 0], start=home)
    back = pf.solve_ik(machine, machine.home_pose, start=projected)
    np.testing.assert_allclose(back.actuators, home.actuators, atol=1e-9)


@pytest.mark.parametrize(("travel", "far"), [(None, 600), (None, 60_000), (20_000, 20_000)])
def test_an_arm_on_a_long_rail_reaches_what_its_joints_reach(travel: float | None, far: float) -> None:
    rng = np.random.default_rng(0)
    slide, first, second = rng.uniform((-far, -0.4, -0.9), (far, 0.4, 0.5), (100, 3)).T
    tip = slide * 1j + np.exp(1j * first) * (100 + np.exp(1j * second) * (50 + 50j))
    targets = np.stack([tip.real, tip.imag, 0 * slide], axis=-1)
    assert pf.solve_ik(arm_on_a_rail(travel), targets)


def test_beside_an_endless_rail_answers_are_as_near_anywhere_along_it() -> None:
    along, off = np.random.default_rng(3).uniform((-60_000, 1), (60_000, 100), (50, 2)).T
    farthest = 100 + 50 * np.sqrt(2) * np.cos(np.pi / 4)
    for first in np.linspace(-0.4, 0.4, 401):
        second = np.clip(-np.pi / 4 - first, -0.9, 0.5)
        farthest = max(farthest, 100 * np.cos(first) + 50 * np.sqrt(2) * np.cos(first + second + np.pi / 4))
    answers = pf.solve_ik(arm_on_a_rail(), np.stack([farthest + off, along, 0 * off], axis=-1))
    np.testing.assert_allclose(answers.position_error, off, atol=1e-6)


def test_a_rail_oblique_to_its_hinge_is_driven_to_where_the_plane_holds_the_target() -> None:
    joints = [
        Joint("P", "prismatic", ("base", "c"), axis=(0.6, 0.8, 0), actuated=True, range=(-100, 100)),
        Joint("R", "revolute", ("c", "r"), at=(100, 0, 0), axis=(0, 1, 0)),
        Joint("S", "spherical", ("r", "platform"), at=(60, 0, 150)),
    ]
    machine = Mechanism("oblique PRS", joints, "platform", (60, 0, 150))
    slide, turn = np.random.default_rng(1).uniform((-100, -1), (100, 1), (100, 2)).T
    rod = (-40 + 150j) * np.exp(-1j * turn)
    targets = np.stack([100 + 0.6 * slide + rod.real, 0.8 * slide, rod.imag], axis=-1)
    answer = pf.solve_ik(machine, targets)
    assert answer
    np.testing.assert_allclose(answer.actuators[:, 0], slide, atol=1e-6)


def test_a_cone_about_a_line_to_a_hinge_off_the_plane_is_for_the_closure_engine() -> None:
    joints = [
        Joint("P", "prismatic", ("base", "c"), axis=Z, actuated=True),
        Joint("R", "revolute", ("c", "r"), at=(100, 30, 0), axis=(0, 1, 0)),
        Joint("S", "spherical", ("r", "platform"), at=(60, 0, 150), cone=Cone((0, 0, -1), 0.5, "platform")),
    ]
    mechanism = Mechanism("PRS", joints, "platform", (0, 0, 150))
    assert "cone of joint S" in str(pf.decompose(mechanism)[0].reason)
    assert pf.solve_ik(mechanism, (0, 0, 150))


def test_a_revolute_along_an_axis_of_its_universal_neighbour_makes_no_ball_joint() -> None:
    axes = ((1, 0, 0), (0, 1, 0))
    for axis, is_positions in (((0, 1, 0), False), ((0, 0, 1), True)):
        joints = [
            Joint("A", "universal", ("base", "c"), at=(0, 0, 0), axes=axes),
            Joint("P", "prismatic", ("c", "r"), axis=Z, actuated=True),
            Joint("B", "universal", ("r", "x"), at=(0, 0, 100), axes=axes),
            Joint("C", "revolute", ("x", "platform"), at=(0, 0, 100), axis=axis),
        ]
        assert (pf.decompose(Mechanism("leg", joints, "platform", (0, 0, 100)))[0].reason is None) == is_positions


def test_a_range_of_more_than_a_turn_counts_from_home() -> None:
    joints = [
        Joint("j1", "revolute", ("base", "l1"), at=(0, 0, 0), axis=Z, actuated=True, range=(0, 10)),
        Joint("j2", "revolute", ("l1", "l2"), at=(100, 0, 0), axis=Z, actuated=True, range=(-2.5, 2.5)),
        Joint("tip", "revolute", ("l2", "g"), at=(150, 80, 0), axis=Z),
    ]
    machine = Mechanism("arm", joints, "tip")
    assert pf.solve_ik(machine, machine.home_pose).actuators[0] == pytest.approx(0, abs=1e-9)
    turn = np.linspace(0, 9, 200)
    tip = np.exp(1j * turn) * (150 + 80j)
    answer = pf.track(machine, np.stack([tip.real, tip.imag, 0 * turn], axis=-1))
    np.testing.assert_allclose(answer.actuators[:, 0], turn, atol=1e-9)


def test_home_just_off_its_bound_is_reached() -> None:
    machine = five_bar().with_limits(A1=(9e-10, 1.0), A2=(-1.0, -9e-10))
    assert pf.solve_ik(machine, machine.home_pose)


def test_a_coarse_tolerance_opens_no_loop() -> None:
    machine = arm_on_a_rail()
    targets = np.random.default_rng(2).uniform(-900, 900, (40, 3))
    answer = pf.passes.solve(machine, targets, pf.passes.Options(tolerance=1e3))
    assert np.max(answer.residual) <= 1e-9 * machine.characteristic_length
    assert (answer.status <= Status.PROJECTED).all()


def wrist(legs: int, lean: float, offset: float, half: float, elbow: float | None) -> Mechanism:
    """Legs of four hinges between two centres, crossed in pairs, neither square to each other nor to the line between
    the centres: they cannot point it anywhere. An Omni-Wrist has four, two of them driven."""
    joints, wide, bend = [], (-half, half), elbow and (-elbow, elbow)
    for i, angle in enumerate(2.0 * np.pi * np.arange(legs) / legs):
        out, aside = (np.cos(angle), np.sin(angle), 0.0), (np.cos(angle + lean), np.sin(angle + lean), 0.0)
        knee, shin = np.multiply(offset, out) + (0, 0, 0.3), np.multiply(offset, out) + (0, 0, 0.7)
        joints += [
            Joint(f"A{i}", "revolute", ("base", f"p{i}"), at=(0, 0, 0), axis=aside, actuated=i < 2, range=wide),
            Joint(f"B{i}", "revolute", (f"p{i}", f"q{i}"), at=knee, axis=knee, range=bend),
            Joint(f"C{i}", "revolute", (f"q{i}", f"r{i}"), at=shin, axis=(*-shin[:2], 0.3), range=bend),
            Joint(f"D{i}", "revolute", (f"r{i}", "platform"), at=(0, 0, 1), axis=aside),
        ]
    return Mechanism("wrist", joints, "platform", (0, 0, 1), task=("tilt",))


@pytest.mark.parametrize("machine", [wrist(4, 1.047, 0.42, 1.22, 1.745), wrist(3, 1.309, 0.4125, 1.047, None)])
def test_hinges_that_cannot_point_their_rod_anywhere_are_not_told_to(machine: Mechanism) -> None:
    """Out of reach and by actuator values alike; from a feasible start there is always an answer."""
    rng = np.random.default_rng(0)
    axes = rng.normal(size=(40, 3)) * (1.0, 1.0, 0.1)
    tilts = rng.uniform(0.0, 3.1, (40, 1)) * axes / np.linalg.norm(axes, axis=1)[:, None]
    targets = pf.pose((0, 0, 1) + np.zeros((40, 3)), rotvec=tilts)
    home = pf.solve_ik(machine, machine.home_pose)
    for answer in (pf.solve_ik(machine, targets), pf.solve_ik(machine, targets, start=home)):
        assert (answer.status == Status.PROJECTED).any()
        assert_feasible(machine, answer)
    assert_feasible(machine, pf.solve_fk(machine, rng.uniform(-1.0, 1.0, (40, 2))))


def wide_five_bar() -> Mechanism:
    """A 5-bar whose elbows may go through their dead points."""
    ranges = {"A1": (-94, 94), "B1": (-143, 85), "A2": (-94, 94), "B2": (-85, 143)}
    limits = {name: tuple(np.radians(ends)) for name, ends in ranges.items()}
    return machines.five_bar([(-36, 0), (36, 0)], [(-78, 106), (78, 106)], (0, 231), task=("x", "y"), **limits)


def test_more_freedom_leads_no_farther_from_the_target() -> None:
    """Answers that may be in any working mode are no farther than those that may not, nor than what others reach."""
    machine, rng = wide_five_bar(), np.random.default_rng(3)
    targets = machine.home_pose[:3, 3] + rng.uniform(-500, 500, (150, 3)) * (1, 1, 0)
    answer = pf.solve_ik(machine, targets)
    kept = pf.solve_ik(machine, targets, options=Options(working_mode="keep"))
    assert (answer.position_error <= kept.position_error + 1e-6 * machine.characteristic_length).all()
    feasible = answer.pose[:, :3, 3]
    nearest = np.linalg.norm(targets[:, None] - feasible[None], axis=2).min(axis=1)
    assert (answer.position_error <= nearest + 1e-6 * machine.characteristic_length).all()


def test_a_search_that_was_lost_on_its_way_does_not_stand_for_the_other_way() -> None:
    """Led step by step to its target this 3-CRU is lost, and what it recovers to is two millimetres away."""
    nearly_level = (-3.335e-12, -6.275e-12, -5.325e-12)
    target = pf.pose((-111.641489770977, -216.920214936537, 133.269389225476), rotvec=nearly_level)
    assert pf.solve_ik(closure.cru().without_limits(), target, options=Options(working_mode="keep"))


def test_a_position_that_another_way_of_assembly_has_is_reached() -> None:
    """A tool on a forearm of a 5-bar: where it points is left open, and has two solutions at each elbow."""
    machine = closure.five_bar_with_tool()
    rng = np.random.default_rng(0)
    found = pf.solve_fk(machine, rng.uniform((-np.pi, -1.4), (np.pi, 1.1), (300, 2)))
    assert pf.solve_ik(machine, found.pose[found.status == Status.REACHED])


def test_every_mapping_of_an_answer_and_legs_survive_pickling_and_copying() -> None:
    leg = pf.Leg("R*-S-S", base=[1, 0, 0], by_letter={"A": {"axis": "z"}, "B": {"cone": {"half_angle": 0.5}}})
    answer = pf.solve_ik(pf.load("stewart"), [0, 0, 200])
    for value in (answer.joints, answer.points, pf.margins(answer), leg, leg.by_letter):
        for twin in (pickle.loads(pickle.dumps(value)), copy.deepcopy(value), copy.copy(value)):
            assert type(twin) is type(value)
            np.testing.assert_equal(*(dict(each) if isinstance(each, Mapping) else each for each in (twin, value)))
    with pytest.raises(TypeError):
        leg.by_letter["A"] = {}  # type: ignore[index]


def _solve_in_child() -> None:
    machine = five_bar()
    pf.solve_ik(machine, np.tile(machine.reference_point, (9000, 1)))


@pytest.mark.skipif(sys.platform != "linux", reason="fork is Linux's way to start processes")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_forked_child_solves_batches_too() -> None:
    _solve_in_child()
    child = multiprocessing.get_context("fork").Process(target=_solve_in_child)
    child.start()
    child.join(60)
    assert child.exitcode == 0
