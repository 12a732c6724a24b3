"""The paper's method, plain and accelerated, and its projection: as honest as all else, and as far as the default."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import machines
import pfabrik as pf
from checks import INTERPRETED, excess_of_joints, gap_of_joints
from machines.trunks import ARMS, TRUNKS
from pfabrik import Mechanism, Status
from pfabrik.passes import Options

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
compiled_only = pytest.mark.skipif(INTERPRETED, reason="a minute and more")

ACCELERATED = replace(Options.accelerated(), working_mode="any")
WAYS = {
    "paper": Options(tolerance=1e-2, max_rounds=50),
    "centroid": Options.centroid(),
    "nothing held": replace(Options.centroid(), hold=None),
    "position held": replace(Options.centroid(), hold="position"),
}
if not INTERPRETED:  # where a target out of reach takes seconds
    WAYS |= {
        "accelerated": Options.accelerated(),
        "accelerated, nothing held": replace(Options.accelerated(), hold=None),
        "accelerated, position held": replace(Options.accelerated(), hold="position"),
    }
N = 4 if INTERPRETED else 60


@cache
def machine(name: str) -> Mechanism:
    return ARMS[name]() if name in ARMS else machines.machine(name)


def far_and_near(mechanism: Mechanism, n: int) -> np.ndarray:
    """Poses (n, 4, 4) from home to some L away, turned by any angle; the last is a million L away."""
    rng, home = np.random.default_rng(1), mechanism.home_pose
    targets = np.repeat(home[None], n, axis=0)
    reach = np.geomspace(0.02, 3.0, n)[:, None]
    targets[:, :3, 3] += reach * rng.normal(size=(n, 3)) * mechanism.characteristic_length
    turns = Rotation.from_rotvec(np.minimum(reach, 1.0) * rng.normal(size=(n, 3)))
    targets[:, :3, :3] = turns.as_matrix() @ home[:3, :3]
    targets[-1, :3, 3] *= 1e6
    return targets


FIRST = ("five_bar", "stewart", "nrpm", *TRUNKS)
"""Machines that are asked in all ways in every run; others in two."""


@pytest.mark.parametrize(
    ("name", "way"),
    [
        pytest.param(
            name, way, marks=[pytest.mark.campaign] * (name not in FIRST and way not in ("paper", "accelerated"))
        )
        for name in (*FIRST, *machines.MACHINES)
        for way in WAYS
    ],
)
def test_limits_are_kept_and_loops_closed_for_any_target(name: str, way: str) -> None:
    mechanism, options = machine(name), WAYS[way]
    answer = pf.passes.solve(mechanism, far_and_near(mechanism, 4), options)
    assert np.isin(answer.status, (Status.REACHED, Status.PROJECTED)).all()
    assert gap_of_joints(mechanism, answer).max() <= 1e-9
    assert excess_of_joints(mechanism, answer).max() <= 1e-9
    reached = answer.status == Status.REACHED
    assert (answer.position_error[reached] <= (options.tolerance or 1e-9 * mechanism.characteristic_length)).all()


@pytest.mark.parametrize("name", ["stewart", "hexapod_rus", "planar_rrr"])
def test_a_path_keeps_its_working_mode_and_goes_on_from_answer_to_answer(name: str) -> None:
    """Out of the workspace and back: the coordinates of all joints end where they began."""
    mechanism = machine(name)
    way = np.sin(np.linspace(0.0, np.pi, 9))
    targets = np.repeat(mechanism.home_pose[None], len(way), axis=0)
    targets[:, 0, 3] += 1.2 * way * mechanism.characteristic_length
    for options in (Options.paper(), Options.centroid(), Options.accelerated())[: 2 if INTERPRETED else 3]:
        path = pf.passes.track(mechanism, targets, options)
        assert (path.status == Status.PROJECTED).any()
        np.testing.assert_allclose(path.actuators[-1], path.actuators[0], atol=0.02 * mechanism.characteristic_length)


# --- as far as the default -------------------------------------------------------------------------------------------


def targets_about(mechanism: Mechanism, size: float, turn: float, n: int = N) -> np.ndarray:
    """Poses (n, 4, 4) up to `size` [L] and `turn` [rad] from home; of a planar machine in its plane."""
    rng, targets = np.random.default_rng(8), np.repeat(mechanism.home_pose[None], n, axis=0)
    steps, turns = rng.uniform(-size, size, (n, 3)), rng.uniform(-turn, turn, (n, 3))
    axes = [np.array(joint.axis) for joint in mechanism.joints if joint.type == "revolute"]
    if len(axes) > 4 and np.ptp(np.abs(axes), axis=0).max() < 1e-9:
        normal = axes[0] / np.linalg.norm(axes[0])
        steps -= np.outer(steps @ normal, normal)
        turns = np.outer(turns @ normal, normal)
    targets[:, :3, 3] += steps * mechanism.characteristic_length
    if not mechanism.end_effector_is_joint:
        targets[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix() @ mechanism.home_pose[:3, :3]
    return targets


def reachable(mechanism: Mechanism, size: float, turn: float, n: int = N) -> np.ndarray:
    """Those of them that the default reaches."""
    targets = targets_about(mechanism, size, turn, n)
    return targets[pf.solve_ik(mechanism, targets).status == Status.REACHED]


TWO_PARTS = ("five_bar", "stewart", "servo_hexapod", "reachy_mini", "hexaglide", "rrr", "prr", "rpr", "planar_rrr")
MORE_PARTS = () if INTERPRETED else (*ARMS, *(name for name in TRUNKS if name != "pivoted"))


@pytest.mark.parametrize("name", [*TWO_PARTS[: 2 if INTERPRETED else None], "nrpm", *MORE_PARTS])
def test_exact_meetings_reach_all_that_the_default_reaches_of_legs_of_two_parts_in_one_pass(name: str) -> None:
    """Arms of many dimensions, hinges aslant, three struts and more, elbows, cranks and planar legs on them."""
    mechanism = machine(name)
    targets = reachable(mechanism, *((0.1, 0.1) if name in TRUNKS or INTERPRETED else (0.4, 0.2)))
    answers = pf.passes.solve(mechanism, targets, ACCELERATED)
    assert len(targets) >= 2
    np.testing.assert_array_equal(answers.status, Status.REACHED)
    assert gap_of_joints(mechanism, answers).max() <= 1e-9
    assert excess_of_joints(mechanism, answers).max() <= 1e-9
    assert np.abs(answers.pose[:, :3, 3] - targets[:, :3, 3]).max() <= 1e-9 * mechanism.characteristic_length
    if name in TWO_PARTS:
        np.testing.assert_array_equal(answers.iterations, 1)
    assert np.median(answers.iterations) <= 6


@compiled_only
def test_the_arms_of_the_paper_take_less_than_two_passes_over_a_whole_workspace() -> None:
    mechanism = pf.load("nrpm")
    targets = reachable(mechanism, 1.0, 0.26, 2000)
    answers = pf.passes.solve(mechanism, targets, ACCELERATED)
    assert (answers.status == Status.REACHED).all()
    assert len(targets) > 200 and np.mean(answers.iterations) <= 1.9
    warm = pf.passes.solve(mechanism, targets[1:], ACCELERATED, start=answers[:-1])
    assert (warm.status == Status.REACHED).all()


@compiled_only
def test_arms_are_told_of_every_limit_of_their_struts_and_move_for_those_that_ask() -> None:
    """Of crossbars that do not know of their cones, or split the difference with content struts, 78 of 100 are."""
    mechanism = pf.load("nrpm")
    targets = reachable(mechanism, 0.8, 0.26, 150)
    assert len(targets) >= 25
    assert np.mean(pf.passes.solve(mechanism, targets).status == Status.REACHED) >= 0.92


@compiled_only
@pytest.mark.parametrize(
    ("name", "size", "farther"),
    [("five_bar", 1.2, 1.03), ("stewart", 1.0, 1.02), ("servo_hexapod", 0.8, 1.2), ("prr", 1.0, 1.2)],
)
def test_targets_out_of_reach_end_near_the_nearest_pose(name: str, size: float, farther: float) -> None:
    mechanism = pf.load(name)
    targets = targets_about(mechanism, size, 0.2, 2 * N)
    answers = pf.passes.solve(mechanism, targets, ACCELERATED)
    nearest = pf.solve_ik(mechanism, targets, options=pf.Options(working_mode="any"))
    held = (nearest.status == Status.PROJECTED) & (nearest.rotation_error <= 1e-6) & (answers.rotation_error <= 1e-6)
    held &= nearest.position_error > 0.02 * mechanism.characteristic_length
    ratios = answers.position_error[held] / nearest.position_error[held]
    assert len(ratios) >= 1
    assert ratios.min() >= 1.0 - 1e-6 and np.median(ratios) <= 1.01 and ratios.max() <= farther


@compiled_only
def test_a_leg_that_keeps_its_side_is_not_flipped() -> None:
    mechanism = pf.load("rrr")
    targets = targets_about(mechanism, 0.5, 0.4, 2 * N)
    answers = pf.passes.solve(mechanism, targets, replace(ACCELERATED, working_mode="keep"))
    default = pf.solve_ik(mechanism, targets, options=pf.Options(working_mode="keep"))
    reached = answers.status == Status.REACHED
    np.testing.assert_array_equal(reached, default.status == Status.REACHED)
    np.testing.assert_allclose(answers.actuators[reached], default.actuators[reached], atol=1e-7)
