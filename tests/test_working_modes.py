"""All working modes: textbook counts, branches in closed form, and what a list of modes promises."""

from __future__ import annotations

import dataclasses
import pickle
from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np
import pytest

import checks
import machines
import oracles
import pfabrik as pf
from checks import INTERPRETED
from machines import closure
from pfabrik import Status
from pfabrik.errors import ContinuumOfSolutions, PfabrikError

Z = (0.0, 0.0, 1.0)
MOST = 512 if INTERPRETED else 40_000  # starts


def apart(one: pf.Solution, other: pf.Solution) -> float:
    """Largest difference of two configurations in joint centres [L] and actuators (angles as points on a circle)."""
    mechanism = one.mechanism
    off = [np.abs(one.points[name] - other.points[name]).max() / mechanism.characteristic_length for name in one.points]
    for name, a, b in zip(mechanism.actuator_names, one.actuators, other.actuators, strict=True):
        turns = mechanism.joint(name).type == "revolute"
        off.append(2 * abs(np.sin((a - b) / 2)) if turns else abs(a - b) / mechanism.characteristic_length)
    return float(max(off))


def assert_modes(modes: Sequence[pf.Solution], target: np.ndarray) -> None:
    """On the target in what the task counts, closed, each only once, and honest about limits."""
    for mode in modes:
        mechanism = mode.mechanism
        length = mechanism.characteristic_length
        assert pf.closure_residual(mode) <= 1e-9 * length
        offset = np.abs(mode.pose - target)
        if not mechanism.end_effector_is_joint and "rotation" in mechanism.task:
            assert offset[:3, :3].max() <= 1e-9
        if "tilt" in mechanism.task:
            assert offset[:3, 2].max() <= 1e-9
        for axis, name in enumerate("xyz"):
            assert name not in mechanism.task or offset[axis, 3] <= 1e-9 * length
        assert mode.status is (pf.Status.REACHED if mode.limit_excess <= 1e-9 else pf.Status.EXCEEDED)
        assert not mode or checks.excess_of_points(mechanism, mode).max() <= 1.1e-9
        assert checks.gap_of_joints(mechanism, mode).max() <= 1e-9
        assert abs(max(checks.excess_of_joints(mechanism, mode).max(), 0.0) - mode.limit_excess) <= 1e-8
        assert mode or any(limit.joint for limit in mode.active_limits)
    for one, other in combinations(modes[:64], 2):
        assert apart(one, other) > 1e-6


def assert_same_angles(modes: Sequence[pf.Solution], expected: Sequence[Sequence[float]], atol: float = 1e-7) -> None:
    """The same sets of actuated angles, by whole turns, in any order."""
    found = np.array([mode.actuators for mode in modes])
    assert len(found) == len(expected)
    off = np.abs(np.exp(1j * found[:, None]) - np.exp(1j * np.array(expected))).max(axis=2)
    assert off.min(axis=0).max() <= atol
    assert off.min(axis=1).max() <= atol


# --- closed forms ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("make", "target", "count"), [
    pytest.param(lambda: pf.load("five_bar"), pf.pose([0, 13, 185]), 4, id="5-bar"),
    pytest.param(lambda: machines.planar("RRR"), pf.pose([6, -9, 30], rotvec=[0, 0, 0.2]), 8, id="3-RRR"),
    pytest.param(machines.hexapod_rus, pf.pose([5, -8, 130], rpy=[0.05, 0.1, -0.15]), 64, id="6-RSS",
                 marks=pytest.mark.slow),
    pytest.param(closure.delta, pf.pose([20, -30, -230]), 8, id="delta", marks=pytest.mark.slow),
])  # fmt: skip
def test_cranks_have_the_modes_of_their_closed_form(make: Any, target: np.ndarray, count: int) -> None:
    mechanism = make()
    modes = pf.working_modes(mechanism, target, most_starts=MOST)
    assert_modes(modes, target)
    assert len(modes) == modes.total == count
    assert_same_angles(modes, oracles.working_modes(mechanism, target).actuators)


@pytest.mark.slow
def test_what_a_task_leaves_open_is_found_too() -> None:
    """Only the position asked for: the eight modes with a level platform, and others with a turned one."""
    whole = closure.delta()
    mechanism = pf.Mechanism("delta", whole.joints, "platform", whole.reference_point, task=["x", "y", "z"])
    target = pf.pose([20.0, -30.0, -230.0])
    modes = pf.working_modes(mechanism, target)
    assert_modes(modes, target)
    level = [mode for mode in modes if np.abs(mode.pose - target).max() <= 1e-6]
    assert_same_angles(level, oracles.working_modes(whole, target).actuators)
    assert len(modes) > 8
    assert all(mode.rotation_error == 0.0 for mode in modes)


H, A1, A2, D4, D6 = 330.0, 75.0, 300.0, 320.0, 80.0


def wrist_arm(**more: object) -> pf.Mechanism:
    """A 6R arm with a spherical wrist: upright at home, the forearm level."""
    wrist = (A1 + D4, 0, H + A2)
    points = [(0, 0, 0), (A1, 0, H), (A1, 0, H + A2), wrist, wrist, wrist]
    bodies = ["base", *(f"link{k}" for k in range(1, 6)), "tool"]
    joints = [
        pf.Joint(f"j{k + 1}", "revolute", (bodies[k], bodies[k + 1]), at=point, axis=np.eye(3)[axis], actuated=True,
                 **more)  # type: ignore[arg-type]
        for k, (point, axis) in enumerate(zip(points, (2, 1, 1, 0, 1, 0), strict=True))
    ]  # fmt: skip
    return pf.Mechanism("6R arm with a wrist", joints, "tool", (wrist[0] + D6, 0, wrist[2]))


def turn(axis: int, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R = np.eye(3)
    R[i, i] = R[j, j] = c
    R[j, i], R[i, j] = s, -s
    return R


def wrist_arm_pose(q: Sequence[float]) -> np.ndarray:
    """Its tool: Rz(q1) Ry(q2) Ry(q3) Rx(q4) Ry(q5) Rx(q6)."""
    upper, fore = turn(1, q[1]), turn(1, q[1] + q[2])
    hand = turn(2, q[0]) @ fore @ turn(0, q[3]) @ turn(1, q[4]) @ turn(0, q[5])
    wrist = turn(2, q[0]) @ (np.array([A1, 0, H]) + upper @ [0, 0, A2] + fore @ [D4, 0, 0])
    return pf.pose(wrist + hand @ [D6, 0, 0], rotation=hand)


def wrist_arm_angles(target: np.ndarray) -> list[list[float]]:
    """The angles that have its tool on a target: shoulder before or behind, elbow up or down, wrist flipped or not."""
    R, found = target[:3, :3], []
    w = target[:3, 3] - R @ [D6, 0, 0]
    for q1 in (np.arctan2(w[1], w[0]), np.arctan2(-w[1], -w[0])):
        r, s = np.cos(q1) * w[0] + np.sin(q1) * w[1] - A1, w[2] - H
        sine = (A2**2 + D4**2 - r**2 - s**2) / (2 * A2 * D4)
        for q3 in (np.arcsin(sine), np.pi - np.arcsin(sine)) if abs(sine) < 1 else ():
            a, b = A2 - D4 * np.sin(q3), D4 * np.cos(q3)
            q2 = np.arctan2(a * r - b * s, a * s + b * r)
            M = (turn(2, q1) @ turn(1, q2 + q3)).T @ R
            for sign in (1, -1):
                q4 = np.arctan2(sign * M[1, 0], -sign * M[2, 0])
                q6 = np.arctan2(sign * M[0, 1], sign * M[0, 2])
                found.append([q1, q2, q3, q4, sign * np.arccos(M[0, 0]), q6])
    return found


@pytest.mark.slow
def test_a_six_axis_arm_with_a_spherical_wrist_has_eight_modes() -> None:
    mechanism = wrist_arm()
    rng = np.random.default_rng(4)
    counts = []
    for _ in range(5):
        q = rng.uniform(-2.5, 2.5, 6)
        target = wrist_arm_pose(q)
        expected = wrist_arm_angles(target)
        for each in expected:
            np.testing.assert_allclose(wrist_arm_pose(each), target, rtol=0, atol=1e-9)
        modes = pf.working_modes(mechanism, target)
        assert_modes(modes, target)
        assert_same_angles(modes, expected)
        counts.append(len(modes))
    assert max(counts) == 8


@pytest.mark.slow
def test_angles_are_counted_into_their_ranges() -> None:
    q = [2.9, 0.3, -0.2, 4.0, 0.8, 5.2]  # the last is beyond its range a turn less
    target = wrist_arm_pose(q)
    modes = pf.working_modes(wrist_arm(range=(-1.0, 6.0)), target)
    found = [mode for mode in modes if np.abs(np.exp(1j * mode.actuators) - np.exp(1j * np.array(q))).max() < 1e-7]
    assert len(found) == 1
    assert found[0]
    np.testing.assert_allclose(found[0].actuators, q, rtol=0, atol=1e-7)


# --- counts ----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
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
def test_catalogue_machines_have_the_modes_of_textbooks(name: str, count: int) -> None:
    mechanism = pf.load(name)
    modes = pf.working_modes(mechanism, mechanism.home_pose)
    assert_modes(modes, mechanism.home_pose)
    assert len(modes) == count
    home = {name: np.ravel(mechanism.home_coordinate(name)) for name in mechanism.actuator_names}
    np.testing.assert_allclose(modes[0].actuators, np.concatenate(list(home.values())), rtol=0, atol=1e-7)
    assert modes[0]


MANY_STARTS = ("delta", "linear_delta", "psu")
"""Machines whose modes are searched from the most starts; of their kind, the orthoglide is asked in every run."""


@pytest.mark.parametrize(
    ("name", "count"),
    [
        pytest.param(name, count, marks=pytest.mark.campaign if count > 1 or name in MANY_STARTS else pytest.mark.slow)
        for name in pf.catalog()
        if name not in ("nrpm", "panda", "snake60")
        for count in (1, 5)
    ],
)
def test_what_solve_ik_reaches_is_one_of_the_modes(name: str, count: int) -> None:
    mechanism = pf.load(name)
    rng = np.random.default_rng(5)
    targets = np.repeat(mechanism.home_pose[None], count, axis=0)
    targets[:, :3, 3] += 0.02 * mechanism.characteristic_length * rng.normal(size=(count, 3))
    reached = pf.solve_ik(mechanism, targets)
    reached = pf.solve_ik(mechanism, reached.pose)  # projections are within reach
    for answer in reached:
        assert answer
        modes = pf.working_modes(mechanism, answer.pose)
        assert_modes(modes[:16], answer.pose)
        nearest = min(modes, key=lambda mode: apart(mode, answer))
        assert apart(nearest, answer) <= 1e-6
        assert nearest


# --- continua, and what is none --------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_redundant_machine_is_told_what_still_moves() -> None:
    mechanism = pf.load("nrpm")
    with pytest.raises(ContinuumOfSolutions, match="6 freedoms of the actuators") as caught:
        pf.working_modes(mechanism, mechanism.home_pose)
    assert isinstance(caught.value, PfabrikError)
    assert caught.value.freedoms == 6
    assert set(caught.value.moving) == set(mechanism.actuator_names)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def test_a_task_that_asks_for_less_leaves_a_continuum() -> None:
    arm = wrist_arm()
    joints = [*arm.joints[:5], pf.Joint("tip", "spherical", ("link5", "tool"), at=(A1 + D4 + D6, 0, H + A2))]
    mechanism = pf.Mechanism("positioning arm", joints, "tip")
    with pytest.raises(ContinuumOfSolutions, match="2 freedoms of the actuators"):
        pf.working_modes(mechanism, wrist_arm_pose([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])[:3, 3])


def test_a_stretched_wrist_leaves_a_continuum_of_its_two_axes() -> None:
    with pytest.raises(ContinuumOfSolutions, match=r"1 freedom of the actuators j4, j6\)"):
        pf.working_modes(wrist_arm(), wrist_arm_pose([0.3, 0.4, -0.2, 0.5, 0.0, 0.1]))


@pytest.mark.slow
def test_a_wrist_that_is_nearly_stretched_has_two_modes_close_together() -> None:
    target = wrist_arm_pose([0.3, 0.4, -0.2, 0.5, 1e-3, 0.1])
    modes = pf.working_modes(wrist_arm(), target)
    assert_same_angles(modes, wrist_arm_angles(target), atol=1e-6)


def with_flag() -> pf.Mechanism:
    """A servo hexapod one of whose rods carries a triangle of bars: it turns with the rod, however that is spun."""
    mechanism = machines.hexapod_rus()
    joints = [
        dataclasses.replace(joint, cone=None) if joint.name in ("B1", "C1") else joint for joint in mechanism.joints
    ]
    corners = [("BC1", (60, 60, 60)), ("bar", (70, 60, 60)), ("tie", (60, 80, 60))]
    for k, (body, point) in enumerate(corners):
        joints.append(pf.Joint(f"flag{k}", "revolute", (body, corners[(k + 1) % 3][0]), at=point, axis=Z))
    return pf.Mechanism("hexapod with a flag", joints, "platform", mechanism.reference_point)


@pytest.mark.slow
def test_what_spins_with_a_rod_makes_no_modes() -> None:
    mechanism = with_flag()
    modes = pf.working_modes(mechanism, mechanism.home_pose)
    assert len(modes) == 64
    assert modes[0]
    np.testing.assert_allclose(modes[0].points["flag1"], (70, 60, 60), rtol=0, atol=1e-6)  # not spun either


# --- singularities and reach -----------------------------------------------------------------------------------------


def stretched(by: float) -> np.ndarray:
    """A tip of the catalogue's 5-bar whose left arm is stretched, of 110 and 145 from (-50, 0), or beyond."""
    direction = np.array([0.0, 0.35, 1.0]) / np.hypot(0.35, 1.0)
    return np.array([0.0, -50.0, 0.0]) + (255.0 + by) * direction


@pytest.mark.slow
def test_modes_merge_and_vanish_where_an_arm_is_stretched() -> None:
    mechanism = pf.load("five_bar").without_limits()
    assert len(pf.working_modes(mechanism, stretched(-1e-3))) == 4
    assert len(pf.working_modes(mechanism, stretched(0.0))) == 2
    assert len(pf.working_modes(mechanism, stretched(1e-3))) == 0


@pytest.mark.slow
@pytest.mark.parametrize("position", [(0, 0, 9000), (0, 1e12, 1e12), (0, 1e200, -1e200)])
@pytest.mark.parametrize("name", ["five_bar", "serial_arm"])
def test_what_no_arm_is_long_enough_for_has_no_modes(name: str, position: tuple) -> None:
    modes = pf.working_modes(pf.load(name), position)
    assert (len(modes), modes.total, list(modes), modes.hits) == (0, 0, [], ())
    assert 0.0 < modes.unseen < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("away", [9e3, 1e5, 1e7])
@pytest.mark.parametrize("name", ["stewart", "rps"])
def test_a_strut_has_a_mode_however_far_and_exceeds_its_stroke(name: str, away: float) -> None:
    modes = pf.working_modes(pf.load(name), (0, 0, away))
    assert len(modes) == len(oracles.working_modes(pf.load(name), (0, 0, away)).actuators) > 0
    assert all(mode.status == Status.EXCEEDED for mode in modes)


# --- what the list says ----------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_list_of_modes_says_how_it_was_found_and_what_it_may_have_missed() -> None:
    modes = pf.working_modes(pf.load("servo_hexapod"), pf.load("servo_hexapod").home_pose)
    assert isinstance(modes, Sequence)
    assert len(modes.hits) == len(modes) == 64
    assert [len(leg) for leg in modes.branches[0]] == [2] * 6
    assert min(modes.hits) == min(map(min, modes.branches[0])) >= 10
    assert modes.unseen == 3 / modes.starts
    assert len(modes[:3]) == 3


@pytest.mark.slow
def test_modes_are_the_same_in_every_call_and_nearest_to_home_first() -> None:
    mechanism = machines.hexapod_rus()
    target = pf.pose([5.0, -8.0, 130.0], rpy=[0.05, 0.1, -0.15])
    first, second = (pf.working_modes(mechanism, target) for _ in range(2))
    few = pf.working_modes(mechanism, target, most=7)
    assert (len(few), few.total, few.hits) == (7, 64, first.hits[:7])
    for modes in (second, few):
        for one, other in zip(first, modes, strict=False):
            np.testing.assert_array_equal(one.actuators, other.actuators)
            np.testing.assert_array_equal(one.joints["B1"], other.joints["B1"])
    centres = {joint.name: np.array(joint.at) for joint in mechanism.joints}
    off = [
        np.sqrt(
            sum(((mode.points[name] - centres[name]) ** 2).sum() for name in centres)
            / mechanism.characteristic_length**2
            + (4 * np.sin(mode.actuators / 2) ** 2).sum()
        )
        for mode in first
    ]
    assert np.diff(off).min() >= -1e-9


def test_no_modes_are_listed_where_none_are_wanted() -> None:
    modes = pf.working_modes(pf.load("five_bar"), (0, 10, 180), most=0, most_starts=MOST)
    assert (len(modes), modes.total) == (0, 4)


# --- seeds -----------------------------------------------------------------------------------------------------------

# what makes a machine, a target, and another one near it
SEEDED = {
    "5-bar": (lambda: pf.load("five_bar"), (0, 12, 182), (0, 12.5, 182.4)),
    "3-RRR": (lambda: machines.planar("RRR"), pf.pose([6, -9, 30], rotvec=[0, 0, 0.2]),
              pf.pose([6.5, -9.4, 30], rotvec=[0, 0, 0.21])),
    "6-RSS": (machines.hexapod_rus, pf.pose([5, -8, 130], rpy=[0.05, 0.1, -0.15]),
              pf.pose([5.2, -8.1, 130.2], rpy=[0.051, 0.1, -0.15])),
    "delta": (closure.delta, pf.pose([20, -30, -230]), pf.pose([20.5, -30.3, -230.2])),
    "6R": (wrist_arm, wrist_arm_pose([0.3, 0.4, -0.2, 0.5, 0.7, 0.1]),
           wrist_arm_pose([0.31, 0.4, -0.2, 0.5, 0.71, 0.1])),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("mode", [None, "any", "keep"])
@pytest.mark.parametrize("name", SEEDED)
def test_an_answer_stays_on_the_branch_of_its_seed(name: str, mode: str | None) -> None:
    make, here, there = SEEDED[name]
    mechanism = make().without_limits()
    options = pf.Options(working_mode=mode)
    for seed in pf.working_modes(mechanism, here)[::5]:
        answer = pf.solve_ik(mechanism, there, start=seed, options=options)
        assert answer
        assert apart(answer, seed) <= 0.1  # branches are further apart


@pytest.mark.slow
@pytest.mark.parametrize("name", SEEDED)
def test_without_a_seed_the_answer_is_the_mode_of_home(name: str) -> None:
    make, here, _ = SEEDED[name]
    mechanism = make().without_limits()
    answer = pf.solve_ik(mechanism, here)
    assert answer
    assert apart(answer, pf.working_modes(mechanism, here)[0]) <= 1e-6


def barred(name: str) -> tuple[pf.Mechanism, object]:
    """A machine with one limit, that bars the mode of home from a target but leaves another; the target."""
    make, target, _ = SEEDED[name]
    free = make().without_limits()
    modes = pf.working_modes(free, target)
    for k, actuator in enumerate(free.actuator_names):
        value = modes[0].actuators[k]
        for other in modes[1:]:
            away = (np.sign(value) * (value - other.actuators[k])) % (2 * np.pi)  # back past home
            if abs(value) > 0.04 and 0.1 < away < 2 * np.pi - 0.1:
                bounds = np.sign(value) * np.array([min(abs(value) - away, 0.0) - 0.05, abs(value) - 0.02])
                return free.with_limits({actuator: tuple(sorted(bounds))}), target
    raise AssertionError(f"no limit of {name} bars the mode of home alone")


@pytest.mark.slow
@pytest.mark.parametrize("name", SEEDED)
def test_a_branch_that_cannot_reach_is_left_where_that_is_allowed(name: str) -> None:
    mechanism, target = barred(name)
    assert pf.solve_ik(mechanism, target)
    seed = pf.solve_ik(mechanism, mechanism.home_pose)
    assert pf.solve_ik(mechanism, target, start=seed, options=pf.Options(working_mode="any"))


@pytest.mark.slow
@pytest.mark.parametrize("mode", [None, "keep"])
@pytest.mark.parametrize("name", SEEDED)
def test_a_branch_that_cannot_reach_is_kept_where_it_is_to_be(name: str, mode: str | None) -> None:
    mechanism, target = barred(name)
    seed = pf.solve_ik(mechanism, mechanism.home_pose)
    answer = pf.solve_ik(mechanism, target, start=seed, options=pf.Options(working_mode=mode))
    assert answer.status is pf.Status.PROJECTED
    # a limit of one actuator by 0.02 beyond: what keeps it on the same branch is near
    assert apart(answer, pf.working_modes(mechanism.without_limits(), target)[0]) <= 0.2


def test_a_platform_that_is_upside_down_is_at_no_yaw() -> None:
    """Loops of a 4-RUU close there too, badly, and its yaw is that of rounding: it took a hundred modes for one."""
    modes = pf.working_modes(closure.ruu(), closure.ruu().home_pose, most_starts=64 if INTERPRETED else 1024)
    assert len(modes) and all(mode.pose[2, 2] > 0.0 for mode in modes)
