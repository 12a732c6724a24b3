"""Passes with exact meetings and half-spaces: they reach what the default does, and project nearly as near."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import INTERPRETED, excess_of_joints, gap_of_joints
from machines import MACHINES
from machines.trunks import ARMS, TRUNKS
from pfabrik import Mechanism, Options, Status

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

ACCELERATED = replace(pf.passes.Options.accelerated(), working_mode="any")
TWO_PARTS = ("five_bar", "stewart", "servo_hexapod", "reachy_mini", "hexaglide", "rrr", "prr", "rpr")
ON_TRUNKS: dict[str, Callable[[], Mechanism]] = {"nrpm": lambda: pf.load("nrpm"), **ARMS, **TRUNKS}
ON_TRUNKS.pop("pivoted")
if INTERPRETED:
    ON_TRUNKS = {"nrpm": ON_TRUNKS["nrpm"]}
N = 4 if INTERPRETED else 120
slow_interpreted = pytest.mark.skipif(INTERPRETED, reason="a minute and more")


def targets_about(mechanism: Mechanism, size: float, turn: float, n: int = N) -> np.ndarray:
    """Poses (n, 4, 4) up to `size` [L] and `turn` [rad] from home; of a planar machine in its plane."""
    rng, home = np.random.default_rng(8), mechanism.home_pose
    steps, turns = rng.uniform(-size, size, (n, 3)), rng.uniform(-turn, turn, (n, 3))
    axes = [np.array(joint.axis) for joint in mechanism.joints if joint.type == "revolute"]
    if len(axes) > 4 and np.ptp(np.abs(axes), axis=0).max() < 1e-9:
        normal = axes[0] / np.linalg.norm(axes[0])
        steps -= (steps @ normal)[:, None] * normal
        turns = (turns @ normal)[:, None] * normal
    targets = np.repeat(home[None], n, axis=0)
    targets[:, :3, 3] += steps * mechanism.characteristic_length
    if not mechanism.end_effector_is_joint:
        targets[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix() @ home[:3, :3]
    return targets


def assert_reached_exactly(mechanism: Mechanism, targets: np.ndarray) -> pf.Solution:
    """All targets are reached, loops closed and limits kept, judged from the description alone."""
    answers = pf.passes.solve(mechanism, targets, ACCELERATED)
    np.testing.assert_array_equal(answers.status, Status.REACHED)
    assert gap_of_joints(mechanism, answers).max() <= 1e-9
    assert excess_of_joints(mechanism, answers).max() <= 1e-9
    assert np.abs(answers.pose[:, :3, 3] - targets[:, :3, 3]).max() <= 1e-9 * mechanism.characteristic_length
    return answers


@pytest.mark.parametrize(
    "name", TWO_PARTS[:2] if INTERPRETED else [*TWO_PARTS, "hexapod_rus", "planar_rrr", "planar_prr"]
)
def test_legs_of_two_parts_reach_in_one_pass_all_that_the_default_reaches(name: str) -> None:
    mechanism = pf.load(name) if name in TWO_PARTS else MACHINES[name]()
    targets = targets_about(mechanism, *((0.1, 0.1) if INTERPRETED else (0.4, 0.2)))
    reachable = targets[pf.solve_ik(mechanism, targets).status == Status.REACHED]
    assert len(reachable) >= N // 40
    answers = assert_reached_exactly(mechanism, reachable)
    np.testing.assert_array_equal(answers.iterations, 1)


@pytest.mark.parametrize("name", ON_TRUNKS)
def test_trunks_reach_all_that_the_default_reaches(name: str) -> None:
    """Arms of many dimensions, hinges aslant, three struts and more, elbows, cranks and planar legs on them."""
    mechanism = ON_TRUNKS[name]()
    targets = targets_about(mechanism, *((0.1, 0.1) if name in TRUNKS or INTERPRETED else (0.4, 0.2)))
    reachable = targets[pf.solve_ik(mechanism, targets).status == Status.REACHED]
    assert len(reachable) >= 2
    answers = assert_reached_exactly(mechanism, reachable)
    assert np.median(answers.iterations) <= 6


@slow_interpreted
def test_the_arms_of_the_paper_take_less_than_two_passes_over_a_whole_workspace() -> None:
    mechanism = pf.load("nrpm")
    targets = targets_about(mechanism, 1.0, 0.26, 4000)
    reachable = targets[pf.solve_ik(mechanism, targets).status == Status.REACHED]
    answers = assert_reached_exactly(mechanism, reachable)
    assert len(reachable) > 400
    assert np.mean(answers.iterations) <= 1.9
    warm = pf.passes.solve(mechanism, reachable[1:], ACCELERATED, start=answers[:-1])
    np.testing.assert_array_equal(warm.status, Status.REACHED)


@slow_interpreted
@pytest.mark.parametrize(
    ("name", "size", "farther"),
    [
        ("five_bar", 1.2, 1.03),
        ("stewart", 1.0, 1.02),
        ("servo_hexapod", 0.8, 1.2),
        ("hexaglide", 1.0, 1.2),
        ("prr", 1.0, 1.2),
    ],
)
def test_targets_out_of_reach_end_near_the_nearest_pose(name: str, size: float, farther: float) -> None:
    mechanism = pf.load(name)
    targets = targets_about(mechanism, size, 0.2, N if not INTERPRETED else 4)
    answers = pf.passes.solve(mechanism, targets, ACCELERATED)
    nearest = pf.solve_ik(mechanism, targets, options=Options(working_mode="any"))
    held = (nearest.status == Status.PROJECTED) & (nearest.rotation_error <= 1e-6) & (answers.rotation_error <= 1e-6)
    held &= nearest.position_error > 0.02 * mechanism.characteristic_length
    ratios = answers.position_error[held] / nearest.position_error[held]
    assert len(ratios) >= 1
    assert ratios.min() >= 1.0 - 1e-6
    assert np.median(ratios) <= 1.01
    assert ratios.max() <= farther
    assert excess_of_joints(mechanism, answers).max() <= 1e-9


@slow_interpreted
def test_a_leg_that_keeps_its_side_is_not_flipped() -> None:
    mechanism = pf.load("rrr")
    targets = targets_about(mechanism, 0.5, 0.4)
    answers = pf.passes.solve(mechanism, targets, replace(ACCELERATED, working_mode="keep"))
    default = pf.solve_ik(mechanism, targets, options=Options(working_mode="keep"))
    np.testing.assert_array_equal(answers.status == Status.REACHED, default.status == Status.REACHED)
    reached = answers.status == Status.REACHED
    np.testing.assert_allclose(answers.actuators[reached], default.actuators[reached], atol=1e-7)
