"""Out of reach is continuous: a stream's drives move less as its steps are finer, and what they jump is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import INTERPRETED
from pfabrik import Mechanism, Options, Solution, Status
from pfabrik.errors import InvalidArgument

PRICE = 10.0


def smooth(machine: Mechanism, ticks: int) -> np.ndarray:
    """Targets (ticks, 4, 4) of a closed path that leaves reach by far and comes back, and turns on its way."""
    phase = np.arange(ticks) / ticks * 2.0 * np.pi
    shifts = np.stack([0.9 * np.sin(phase), 0.8 * np.sin(2 * phase + 0.4), 0.9 * np.sin(3 * phase + 1.0)], 1)
    turns = np.stack([0.7 * np.sin(2 * phase), 0.7 * np.sin(phase + 0.7), 0.5 * np.sin(3 * phase)], 1)
    return np.asarray(pf.pose(machine.home_pose[:3, 3] + shifts * machine.characteristic_length, rotvec=turns))


def stream(machine: Mechanism, targets: np.ndarray, options: Options | None = None) -> list[Solution]:
    """Answers, each from the one before."""
    answers: list[Solution] = []
    for target in targets:
        answers.append(pf.solve_ik(machine, target, start=answers[-1] if answers else None, options=options))
    return answers


def steps(machine: Mechanism, answers: list[Solution]) -> np.ndarray:
    """The largest step of a drive from each answer to the next [L or rad]."""
    units = [machine.characteristic_length if drive.kind == "length" else 1.0 for drive in machine.drives]
    return np.asarray(np.abs(np.diff([each.actuators for each in answers], axis=0) / units).max(axis=1))


def cost(machine: Mechanism, solution: Solution, price: float) -> np.ndarray:
    """Distance plus price of the orientation [L]."""
    return cost_of(machine, solution.position_error, solution.rotation_error, price)


def cost_of(machine: Mechanism, position: float | np.ndarray, rotation: float | np.ndarray, price: float) -> np.ndarray:
    """The same of errors [length], [rad]."""
    length = machine.characteristic_length
    lever = np.linalg.norm(machine.platform_points.mean(axis=0) - machine.reference_point)
    distance = np.hypot(position, machine.rotation_length * rotation) / length
    return np.asarray(distance + (price + lever / length) * rotation)


@pytest.mark.parametrize("name", ["stewart", "rps", "canfield", "reachy_mini"])
def test_halved_steps_of_a_stream_halve_the_largest_step_of_a_drive(name: str) -> None:
    machine = pf.load(name)
    ticks = 20 if INTERPRETED else 300
    coarse, fine = (steps(machine, stream(machine, smooth(machine, n))).max() for n in (ticks, 2 * ticks))
    assert fine <= 0.76 * coarse or INTERPRETED


@pytest.mark.parametrize("name", ["delta", "orthoglide", "stewart", "prr", "nrpm"])
def test_a_leap_that_finer_steps_do_not_spread_is_told(name: str) -> None:
    """A drive that moves a tenth of what it uses in a step, and half of that at least in one of four parts of it."""
    machine, ticks = pf.load(name), 20 if INTERPRETED else 600
    targets = smooth(machine, ticks)
    answers = stream(machine, targets)
    values = np.array([each.actuators for each in answers])
    used = np.maximum(np.ptp(values, axis=0), 1e-9)
    for k in np.flatnonzero((np.abs(np.diff(values, axis=0)) / used).max(axis=1) > 0.1) + 1:
        if answers[k].jumped or INTERPRETED:
            continue
        way, here = between(targets[k - 1], targets[k], np.arange(1, 5) / 4.0), answers[k - 1]
        parts = [here.actuators]
        for target in way:
            here = pf.solve_ik(machine, target, start=here)
            parts.append(here.actuators)
        whole = (np.abs(values[k] - values[k - 1]) / used).max()
        assert (np.abs(np.diff(parts, axis=0)) / used).max() <= 0.75 * whole, (k, whole)


def between(begin: np.ndarray, end: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Poses on the straight way from one to another, turning about one axis."""
    turn = Rotation.from_matrix(end[:3, :3] @ begin[:3, :3].T).as_rotvec()
    way = np.repeat(begin[None], len(shares), axis=0)
    way[:, :3, 3] += shares[:, None] * (end - begin)[:3, 3]
    way[:, :3, :3] = Rotation.from_rotvec(shares[:, None] * turn).as_matrix() @ begin[:3, :3]
    return way


@pytest.mark.parametrize("name", ["stewart", "hexaglide"])
def test_a_target_that_turns_slowly_out_of_reach_is_followed_slowly(name: str) -> None:
    """Its answers stay on one branch: no drive moves a sixth of L, or of a radian, in a quarter of a degree."""
    machine, length = pf.load(name), pf.load(name).characteristic_length
    for seed in range(1 if INTERPRETED else 4):
        rng = np.random.default_rng(seed)
        place = machine.home_pose[:3, 3] + rng.uniform(-1, 1, 3) * (1.9, 1.9, 0.6) * length
        axis = rng.normal(size=3)
        turns = np.radians(np.arange(0.0, 5.0 if INTERPRETED else 90.0, 0.25))[:, None] * axis / np.linalg.norm(axis)
        assert steps(machine, stream(machine, np.asarray(pf.pose(place, rotvec=turns))))[1:].max() <= 0.16


@pytest.mark.parametrize("name", ["stewart", "servo_hexapod", "hexaglide"])
def test_no_answer_is_costlier_than_those_at_other_prices(name: str) -> None:
    """These are feasible too: so are those with nothing held, and those that hold what can be held."""
    machine, rng = pf.load(name), np.random.default_rng(5)
    n = 3 if INTERPRETED else 40
    way = rng.normal(size=(n, 3))
    way *= (rng.uniform(0.05, 3.0, n) * machine.characteristic_length / np.linalg.norm(way, axis=1))[:, None]
    targets = np.asarray(pf.pose(machine.home_pose[:3, 3] + way, rotvec=rng.uniform(-0.5, 0.5, (n, 3))))
    own = pf.solve_ik(machine, targets)
    away = own.status == Status.PROJECTED
    for options in (Options(hold=None), Options(hold_price=1.0), Options(hold_price=100.0)):
        other = cost(machine, pf.solve_ik(machine, targets, options=options), PRICE)
        assert (cost(machine, own, PRICE) <= other + 1e-3 * np.maximum(other, 1.0))[away].mean() >= 0.97
    exact = np.array([held == "orientation" for held in own.held])
    assert (own.rotation_error[exact] <= 1e-9).all()


def test_a_strict_price_holds_all_that_some_pose_has() -> None:
    machine, rng = pf.load("stewart"), np.random.default_rng(3)
    targets = np.asarray(
        pf.pose(
            machine.home_pose[:3, 3] + rng.uniform(-2, 2, (10, 3)) * machine.characteristic_length,
            rotvec=rng.uniform(-0.3, 0.3, (10, 3)),
        )
    )
    found = pf.solve_ik(machine, targets, options=Options(hold_price=100.0))
    away = found.status == Status.PROJECTED
    assert set(found.held[away]) == {"orientation"}


def test_what_drives_would_jump_is_told_by_solutions_and_paths_alike() -> None:
    """An arm's target passes the centre of the hole in its workspace, and goes on the other side."""
    joints = [
        pf.Joint("A", "revolute", ("base", "upper"), (0, 0, 0), (0, 0, 1), actuated=True),
        pf.Joint("B", "revolute", ("upper", "fore"), (2, 0, 0), (0, 0, 1), actuated=True, range=(-0.5, 0.5)),
    ]
    arm = Mechanism("arm", joints, "fore", (3, 0, 0), task=("x", "y"))
    path = np.zeros((21, 3))
    path[:, 0], path[:, 1] = np.linspace(-1.0, 1.0, 21), 0.001
    start = pf.solve_ik(arm, (-3.0, 0.0, 0.0))
    followed = pf.track(arm, path, start=start)
    single = [start]
    for place in path:
        single.append(pf.solve_ik(arm, place, start=single[-1]))
    assert np.abs(np.diff([each.actuators for each in single], axis=0)).max() > 1.0
    assert np.array_equal(followed.jumps, [each.jumped for each in single[1:]])


def test_without_a_start_nothing_has_jumped() -> None:
    machine = pf.load("five_bar")
    assert not pf.solve_ik(machine, (0, 0, 500)).jumped


@pytest.mark.parametrize("price", [0.0, -1.0, np.nan])
def test_a_price_is_positive(price: float) -> None:
    with pytest.raises(InvalidArgument):
        Options(hold_price=price)


def two_arms() -> Mechanism:
    """Two arms of seven hinges that hold a box between them: joints in loops, without closed forms, and redundant."""
    arm, joints = pf.load("panda"), []
    hand = arm.home_pose[:3, 3]
    for side, about in (("left", 0.0), ("right", np.pi)):
        turn = Rotation.from_euler("z", about).as_matrix()
        middle = hand + (0.1 * arm.characteristic_length, 0.0, 0.0)
        for each in arm.joints:
            bodies = [{"base": "base", arm.end_effector: "box"}.get(body, f"{side} {body}") for body in each.connects]
            at = turn @ (np.array(each.at) - middle) + middle
            moved = replace(each, name=f"{side} {each.name}", connects=tuple(bodies), at=at, axis=turn @ each.axis)
            joints.append(moved)
    return Mechanism("two arms", joints, "box", tuple(hand + (0.1 * arm.characteristic_length, 0.0, 0.0)))


def test_two_arms_follow_a_stream_out_of_reach_and_back() -> None:
    """Every answer is closed within limits and costs no more than to stay; what a drive leaps is told."""
    machine = two_arms()
    targets = smooth(machine, 20 if INTERPRETED else 600)
    answers = stream(machine, targets)
    far = steps(machine, answers)
    assert max(pf.closure_residual(each) for each in answers) <= 1e-9 * machine.characteristic_length
    assert max(each.limit_excess for each in answers) <= 1e-9
    for before, after, target in zip(answers, answers[1:], targets[1:], strict=False):
        if after.status is Status.PROJECTED:
            off = float(np.linalg.norm(before.pose[:3, 3] - target[:3, 3]))
            turn = Rotation.from_matrix(before.pose[:3, :3].T @ target[:3, :3]).magnitude()
            assert cost(machine, after, PRICE) <= cost_of(machine, off, turn, PRICE) + 1e-9
    leaps = np.flatnonzero(far > 1.0)
    assert INTERPRETED or (len(leaps) <= 2 and all(answers[k + 1].jumped for k in leaps))
    assert INTERPRETED or np.quantile(far, 0.99) <= 0.3
