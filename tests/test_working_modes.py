"""All working modes: textbook counts, branches in closed form, and what a list of modes promises."""

from __future__ import annotations

import dataclasses
import pickle
from collections.abc import Sequence
from itertools import combinations

import numpy as np
import pytest

import checks
import machines
import oracles
import pfabrik as pf
from checks import INTERPRETED, home_values
from machines import closure
from pfabrik import Mechanism, Solution, Status
from pfabrik.errors import ContinuumOfSolutions, PfabrikError
from test_modes_kept import MACHINES, apart, modes_of

MOST = 512 if INTERPRETED else 40_000  # starts


def assert_modes(modes: Sequence[Solution], target: np.ndarray) -> None:
    """On the target in what the task counts, closed, each only once, and honest about limits."""
    for mode in modes:
        mechanism = mode.mechanism
        assert pf.closure_residual(mode) <= 1e-9 * mechanism.characteristic_length
        assert checks.task_errors(mechanism, mode.pose[None], target[None])[0] <= 1.5e-9
        assert checks.gap_of_joints(mechanism, mode).max() <= 1e-9
        assert mode.status is (Status.REACHED if mode.limit_excess <= 1e-9 else Status.EXCEEDED)
        assert abs(max(checks.excess_of_joints(mechanism, mode).max(), 0.0) - mode.limit_excess) <= 1e-8
        assert mode or any(limit.joint for limit in mode.active_limits)
    for one, other in combinations(modes[:64], 2):
        assert apart(one, other) > 1e-6


def assert_same_angles(modes: Sequence[Solution], expected: Sequence[Sequence[float]], atol: float = 1e-7) -> None:
    """The same sets of actuated angles, by whole turns, in any order."""
    angles = np.array([mode.actuators for mode in modes])
    assert len(angles) == len(expected)
    off = np.abs(np.exp(1j * angles[:, None]) - np.exp(1j * np.array(expected))).max(axis=2)
    assert max(off.min(axis=0).max(), off.min(axis=1).max()) <= atol


# --- closed forms ----------------------------------------------------------------------------------------------------


@pytest.mark.compiled
@pytest.mark.parametrize(("name", "count"), [("3-RRR", 8), ("6-RSS", 64), ("delta", 8)])
def test_cranks_have_the_modes_of_their_closed_form(name: str, count: int) -> None:
    mechanism, modes = modes_of(name)
    target = MACHINES[name][1]
    assert_modes(modes, target)
    assert len(modes) == modes.total == count
    assert_same_angles(modes, oracles.working_modes(mechanism, target).actuators)


def test_a_5_bar_has_the_four_modes_of_its_closed_form_some_beyond_limits() -> None:
    mechanism, target = pf.load("five_bar"), pf.pose([0, 13, 185])
    modes = pf.working_modes(mechanism, target, most_starts=MOST)
    assert_modes(modes, target)
    assert_same_angles(modes, oracles.working_modes(mechanism, target).actuators)
    few = pf.working_modes(mechanism, target, most=0, most_starts=MOST)
    assert (len(few), few.total) == (0, 4)


@pytest.mark.compiled
def test_what_a_task_leaves_open_is_found_too() -> None:
    """Only the position asked for: the eight modes with a level platform, and others with a turned one."""
    whole, target = closure.delta(), pf.pose([20.0, -30.0, -230.0])
    modes = pf.working_modes(dataclasses.replace(whole, task=("x", "y", "z")), target, most_starts=1024)
    assert_modes(modes, target)
    level = [mode for mode in modes if np.abs(mode.pose - target).max() <= 1e-6]
    assert_same_angles(level, oracles.working_modes(whole, target).actuators)
    assert len(modes) > 8
    assert all(mode.rotation_error == 0.0 for mode in modes)


ARM = closure.wrist_arm()


def tool_poses(*q: Sequence[float]) -> np.ndarray:
    """Poses (n, 4, 4) of the tool of a six-axis arm."""
    return pf.configuration(ARM, np.array(q)).pose


@pytest.mark.compiled
def test_a_six_axis_arm_with_a_spherical_wrist_has_eight_modes_four_and_these_with_the_wrist_flipped() -> None:
    """Within the shoulder's reach: before it or behind, elbow up or down; one of them is the one that was asked for."""
    for q in ([0.4, 0.3, -0.2, 0.6, 0.8, 0.2], [-1.2, -0.4, 0.5, -1.0, 1.1, 0.7]):
        (target,) = tool_poses(q)
        modes = pf.working_modes(ARM, target)
        assert_modes(modes, target)
        flipped = [mode.actuators * (1, 1, 1, 1, -1, 1) + np.pi * np.array((0, 0, 0, 1, 0, 1)) for mode in modes]
        assert len(modes) == 8
        assert_same_angles(modes, flipped)
        assert min(np.abs(np.exp(1j * mode.actuators) - np.exp(1j * np.array(q))).max() for mode in modes) <= 1e-7


@pytest.mark.compiled
def test_angles_are_counted_into_their_ranges() -> None:
    q = [2.9, 0.3, -0.2, 4.0, 0.8, 5.2]  # the last is beyond its range a turn less
    modes = pf.working_modes(closure.wrist_arm(range=(-1.0, 6.0)), tool_poses(q)[0])
    (same,) = [mode for mode in modes if np.abs(np.exp(1j * mode.actuators) - np.exp(1j * np.array(q))).max() < 1e-7]
    assert same
    np.testing.assert_allclose(same.actuators, q, rtol=0, atol=1e-7)


# --- counts ----------------------------------------------------------------------------------------------------------


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("stewart", 1),  # a strut is one distance
        ("rpr", 1),
        ("hexaglide", 64),  # a sphere meets each rail twice
        ("prr", 8),
        ("prs", 8),
        ("serial_arm", 2),
        ("agile_eye", 8),
        ("ankle_rss", 4),  # two cranks; the foot's other posture is half a turn about z
    ],
)
def test_catalogue_machines_have_the_modes_of_textbooks_the_first_at_home(name: str, count: int) -> None:
    mechanism = pf.load(name)
    modes = pf.working_modes(mechanism, mechanism.home_pose)
    assert_modes(modes, mechanism.home_pose)
    assert len(modes) == count and modes[0]
    np.testing.assert_allclose(modes[0].actuators, home_values(mechanism), rtol=0, atol=1e-7)


OF_EACH_KIND = ("five_bar", "stewart", "rps", "serial_arm", "agile_eye", "ankle_rss", "orthoglide", "reachy_mini")
"""Machines that are asked in every run, for one target."""
CONTINUA = ("nrpm", "panda", "snake60")


@pytest.mark.parametrize(
    ("name", "count"),
    [
        *(pytest.param(name, 1, marks=pytest.mark.compiled) for name in OF_EACH_KIND),
        *(pytest.param(name, 5, marks=pytest.mark.campaign) for name in pf.catalog() if name not in CONTINUA),
    ],
)
def test_what_solve_ik_reaches_is_one_of_the_modes(name: str, count: int) -> None:
    mechanism = pf.load(name)
    targets = np.repeat(mechanism.home_pose[None], count, axis=0)
    targets[:, :3, 3] += 0.02 * mechanism.characteristic_length * np.random.default_rng(5).normal(size=(count, 3))
    within = pf.solve_ik(mechanism, targets).pose
    for answer in pf.solve_ik(mechanism, within):
        modes = pf.working_modes(mechanism, answer.pose)
        assert_modes(modes[:16], answer.pose)
        nearest = min(modes, key=lambda mode: apart(mode, answer))
        assert answer and nearest and apart(nearest, answer) <= 1e-6


# --- continua, and what is none --------------------------------------------------------------------------------------


@pytest.mark.compiled
def test_a_redundant_machine_is_told_what_still_moves() -> None:
    mechanism = pf.load("nrpm")
    with pytest.raises(ContinuumOfSolutions, match="6 freedoms of the actuators") as caught:
        pf.working_modes(mechanism, mechanism.home_pose)
    assert isinstance(caught.value, PfabrikError)
    assert (caught.value.freedoms, set(caught.value.moving)) == (6, set(mechanism.actuator_names))
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def test_a_task_that_asks_for_less_leaves_a_continuum() -> None:
    tip = pf.Joint("tip", "spherical", ("1.5", "tool"), at=ARM.reference_point)
    mechanism = Mechanism("positioning arm", [*ARM.joints[:5], tip], "tip")
    with pytest.raises(ContinuumOfSolutions, match="2 freedoms of the actuators"):
        pf.working_modes(mechanism, tool_poses([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])[0, :3, 3])


@pytest.mark.compiled
def test_a_stretched_wrist_leaves_a_continuum_and_a_nearly_stretched_one_two_modes_close_together() -> None:
    stretched, nearly = tool_poses([0.3, 0.4, -0.2, 0.5, 0.0, 0.1], [0.3, 0.4, -0.2, 0.5, 1e-3, 0.1])
    with pytest.raises(ContinuumOfSolutions, match=r"1 freedom of the actuators R1.4, R1.6\)"):
        pf.working_modes(ARM, stretched)
    bends = np.sort([mode.actuators[4] for mode in pf.working_modes(ARM, nearly)])
    assert (np.abs(np.abs(bends) - 1e-3) <= 1e-6).sum() == 2 and len(bends) == 8


@pytest.mark.compiled
def test_what_spins_with_a_rod_makes_no_modes() -> None:
    """A servo hexapod one of whose rods carries a triangle of bars: it turns with the rod, however that is spun."""
    plain = machines.hexapod_rus()
    joints = [dataclasses.replace(each, cone=None) if each.name in ("B1", "C1") else each for each in plain.joints]
    corners = [("BC1", (60, 60, 60)), ("bar", (70, 60, 60)), ("tie", (60, 80, 60))]
    for k, (body, point) in enumerate(corners):
        joints.append(pf.Joint(f"flag{k}", "revolute", (body, corners[(k + 1) % 3][0]), at=point, axis=(0, 0, 1)))
    mechanism = Mechanism("hexapod with a flag", joints, "platform", plain.reference_point)
    modes = pf.working_modes(mechanism, mechanism.home_pose)
    assert len(modes) == 64 and modes[0]
    np.testing.assert_allclose(modes[0].points["flag1"], (70, 60, 60), rtol=0, atol=1e-6)  # not spun either


def test_a_platform_that_is_upside_down_is_at_no_yaw() -> None:
    """Loops of a 4-RUU close there too, badly, and its yaw is that of rounding: it took a hundred modes for one."""
    modes = pf.working_modes(closure.ruu(), closure.ruu().home_pose, most_starts=64 if INTERPRETED else 1024)
    assert len(modes) and all(mode.pose[2, 2] > 0.0 for mode in modes)


# --- singularities and reach -----------------------------------------------------------------------------------------


@pytest.mark.compiled
@pytest.mark.parametrize(("beyond", "count"), [(-1e-3, 4), (0.0, 2), (1e-3, 0)])
def test_modes_merge_and_vanish_where_an_arm_is_stretched(beyond: float, count: int) -> None:
    """The left arm of the 5-bar, of 110 and 145 from (-50, 0)."""
    tip = (0.0, -50.0, 0.0) + (255.0 + beyond) * np.array([0.0, 0.35, 1.0]) / np.hypot(0.35, 1.0)
    assert len(pf.working_modes(pf.load("five_bar").without_limits(), tip)) == count


@pytest.mark.compiled
@pytest.mark.parametrize("position", [(0, 0, 9000), (0, 1e200, -1e200)])
@pytest.mark.parametrize("name", ["five_bar", "serial_arm"])
def test_what_no_arm_is_long_enough_for_has_no_modes(name: str, position: tuple[float, ...]) -> None:
    modes = pf.working_modes(pf.load(name), position)
    assert (len(modes), modes.total, list(modes), modes.hits) == (0, 0, [], ())
    assert 0.0 < modes.unseen < 0.01


@pytest.mark.compiled
@pytest.mark.parametrize(("name", "away"), [("stewart", 9e3), ("stewart", 1e7), ("rps", 1e5)])
def test_a_strut_has_a_mode_however_far_and_exceeds_its_stroke(name: str, away: float) -> None:
    modes = pf.working_modes(pf.load(name), (0, 0, away))
    assert len(modes) == {"stewart": 1, "rps": 2}[name]
    assert all(mode.status == Status.EXCEEDED for mode in modes)


# --- what the list says ----------------------------------------------------------------------------------------------


@pytest.mark.compiled
def test_a_list_says_how_it_was_found_is_the_same_in_every_call_and_begins_nearest_to_home() -> None:
    mechanism, modes = modes_of("6-RSS")
    target = MACHINES["6-RSS"][1]
    assert isinstance(modes, Sequence) and len(modes[:3]) == 3
    assert len(modes.hits) == len(modes) == 64
    assert [len(leg) for leg in modes.branches[0]] == [2] * 6
    assert min(modes.hits) == min(map(min, modes.branches[0])) >= 10
    assert modes.unseen == 3 / modes.starts
    few = pf.working_modes(mechanism, target, most=7)
    assert (len(few), few.total, few.hits) == (7, 64, modes.hits[:7])
    for one, other in zip(few, modes, strict=False):
        np.testing.assert_array_equal(one.actuators, other.actuators)
        np.testing.assert_array_equal(one.joints["B1"], other.joints["B1"])
    off = []
    for mode in modes:
        shifts = [mode.points[joint.name] - joint.at for joint in mechanism.joints]
        turns = 2.0 * np.sin(mode.actuators / 2)
        off.append(np.linalg.norm([*np.ravel(shifts) / mechanism.characteristic_length, *turns]))
    assert np.diff(off).min() >= -1e-9
