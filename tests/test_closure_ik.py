"""What answers promise for any machine, on those that positions alone cannot express, and where they once broke it."""

from __future__ import annotations

import json
import os
import pickle
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import checks
import pfabrik as pf
from machines import closure, ring
from machines.closure import MACHINES, X, Z, chain, joint
from pfabrik import Mechanism, Options, Solution, Status

INTERPRETED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
FEW = ("upu", "four_bar_driven", "hinge")
"""Enough for the interpreted run, which takes a hundred times as long."""

compiled = pytest.mark.skipif(INTERPRETED, reason="many searches: minutes without the compiler")
pytestmark = pytest.mark.filterwarnings("error", "ignore::pfabrik.errors.MobilityWarning")

_MADE: dict[str, Mechanism] = {}


def machine(name: str) -> Mechanism:
    if name not in _MADE:
        _MADE[name] = MACHINES[name]()
    return _MADE[name]


def every_machine(*but: str) -> list[str]:
    return [name for name in (FEW if INTERPRETED else MACHINES) if name not in but]


def home_values(mechanism: Mechanism) -> np.ndarray:
    return np.array([mechanism.home_coordinate(name) for name in mechanism.actuator_names])


def random_values(mechanism: Mechanism, n: int, share: float = 1.0, seed: int = 0) -> np.ndarray:
    """Actuator values within a share of their ranges, from home, (n, n_a)."""
    rng, length = np.random.default_rng(seed), mechanism.characteristic_length
    columns = []
    for name, home in zip(mechanism.actuator_names, home_values(mechanism), strict=True):
        own = mechanism.joint(name)
        reach = 0.4 * length if own.type == "prismatic" else 1.5
        low, high = own.range or (home - reach, home + reach)
        columns.append(home + share * (rng.uniform(low, high, n) - home))
    return np.stack(columns, axis=1)


def random_targets(mechanism: Mechanism, n: int, seed: int = 0) -> np.ndarray:
    """Poses near and far, up to 1e6 L and turned by any angle, some on joint centres, the last one home, (n, 4, 4)."""
    rng, length = np.random.default_rng(seed), mechanism.characteristic_length
    targets = np.tile(np.eye(4), (n, 1, 1))
    away = length * rng.choice([0, 1e-6, 0.05, 0.3, 1, 10, 1e3, 1e6], (n, 1))
    turn = rng.choice([0, 1e-6, 0.05, 0.4, 3], (n, 1))
    targets[:, :3, 3] = mechanism.reference_point + away * rng.normal(size=(n, 3))
    targets[:, :3, :3] = Rotation.from_rotvec(turn * rng.uniform(-1, 1, (n, 3))).as_matrix()
    centres = [each.at for each in mechanism.joints if each.at is not None][: n // 4]
    for row, centre in enumerate(centres):
        targets[row, :3, 3] = centre
    targets[-1] = mechanism.home_pose
    return targets


def errors(mechanism: Mechanism, poses: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """How far poses are from targets, (n,) [L or rad]; of a joint end effector only the position counts."""
    apart = np.linalg.norm((poses - targets)[:, :3, 3], axis=1) / mechanism.characteristic_length
    turned = np.linalg.norm((poses - targets)[:, :3, :3], axis=(1, 2)) / np.sqrt(2.0)
    return np.maximum(apart, 0.0 if mechanism.end_effector_is_joint else turned)


def assert_feasible(mechanism: Mechanism, answer: Solution) -> None:
    """Every row is an assembled configuration within all limits, by its own `joints`."""
    assert np.max(answer.status) <= Status.PROJECTED
    assert np.max(checks.gap_of_joints(mechanism, answer)) <= 2e-9
    assert np.max(pf.closure_residual(answer)) <= 1e-9 * mechanism.characteristic_length
    assert np.max(checks.excess_of_joints(mechanism, answer)) <= 1.0001e-9


def assert_honest(mechanism: Mechanism, targets: np.ndarray, answer: Solution) -> None:
    """Feasible, and REACHED where and only where the pose is the target."""
    assert_feasible(mechanism, answer)
    reached, error = answer.status == Status.REACHED, errors(mechanism, answer.pose, targets)
    assert np.all(error[reached] <= 1.01e-9)
    assert np.all(error[~reached] > 1e-10)


def turned_by(mechanism: Mechanism, first: Solution, second: Solution) -> float:
    """Largest change of any joint between two single answers [L or rad], whole turns aside."""
    changes = [0.0]
    for each in mechanism.joints:
        if each.type == "fixed":
            continue
        here, there = np.atleast_1d(first.joints[each.name]), np.atleast_1d(second.joints[each.name])
        if each.type == "spherical":
            changes.append((Rotation.from_rotvec(here) * Rotation.from_rotvec(there).inv()).magnitude())
            continue
        off = np.abs(here - there)
        slides = {"prismatic": [True], "cylindrical": [False, True]}.get(each.type, [False] * len(off))
        turn = np.abs(2.0 * np.sin(0.5 * off))
        changes.append(np.where(slides, off / mechanism.characteristic_length, turn).max())
    return float(max(changes))


# --- promises, on every machine --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", every_machine("delta_small_cones"))
def test_what_forward_kinematics_assembles_is_reached_and_gives_the_same_pose_again(name: str) -> None:
    mechanism = machine(name)
    there = pf.solve_fk(mechanism, random_values(mechanism, 4 if INTERPRETED else 12, 0.6))
    assert_feasible(mechanism, there)
    for seed in (None, there):
        answer = pf.solve_ik(mechanism, there.pose, start=seed)
        assert np.all(answer.status == Status.REACHED)
        assert_honest(mechanism, there.pose, answer)
        again = pf.solve_fk(mechanism, answer.actuators, start=answer)
        assert np.all(again.status == Status.REACHED)
        assert np.max(errors(mechanism, again.pose, answer.pose)) <= 1e-8


@compiled
@pytest.mark.parametrize("name", every_machine())
def test_any_finite_target_has_an_honest_answer(name: str) -> None:
    mechanism = machine(name)
    targets = random_targets(mechanism, 16)
    assert_honest(mechanism, targets, pf.solve_ik(mechanism, targets))


@pytest.mark.parametrize(
    "count", [pytest.param(6, marks=pytest.mark.slow), pytest.param(64, marks=pytest.mark.campaign)]
)
@pytest.mark.parametrize("hold", ["orientation", "position", None])
@pytest.mark.parametrize("name", MACHINES)
def test_any_finite_target_has_an_honest_answer_whatever_a_projection_holds(
    name: str, hold: str | None, count: int
) -> None:
    mechanism = machine(name)
    home = pf.solve_ik(mechanism, mechanism.home_pose)
    targets = random_targets(mechanism, count, seed=1)
    for seed in (None, home):
        answer = pf.solve_ik(mechanism, targets, start=seed, options=Options(hold=hold))
        assert_honest(mechanism, targets, answer)


@compiled
@pytest.mark.parametrize("name", every_machine())
def test_any_finite_actuator_values_have_an_honest_answer(name: str) -> None:
    mechanism = machine(name)
    asked = random_values(mechanism, 6, share=3.0)
    answer = pf.solve_fk(mechanism, asked)
    assert_feasible(mechanism, answer)
    slides = np.array([mechanism.joint(each).type == "prismatic" for each in mechanism.actuator_names])
    off = np.abs(answer.actuators - asked) / np.where(slides, mechanism.characteristic_length, 1.0)
    assert np.array_equal(answer.status == Status.REACHED, off.max(axis=1) <= 1e-9)


@pytest.mark.parametrize("name", every_machine())
def test_home_is_reached_with_the_coordinates_of_the_description(name: str) -> None:
    mechanism = machine(name)
    for answer in (pf.solve_ik(mechanism, mechanism.home_pose), pf.solve_fk(mechanism, home_values(mechanism))):
        assert answer.status == Status.REACHED
        for each, value in answer.joints.items():
            np.testing.assert_allclose(value, mechanism.home_coordinate(each), atol=1e-9)


@compiled
@pytest.mark.parametrize("name", every_machine())
def test_a_row_alone_is_answered_as_in_a_batch_and_survives_being_stored(name: str) -> None:
    mechanism = machine(name)
    targets = random_targets(mechanism, 6, seed=2)
    together = pf.solve_ik(mechanism, targets)
    stored = pickle.loads(pickle.dumps(together))
    json.dumps(together.to_dict(), allow_nan=False)
    for row in range(len(targets)):
        alone = pf.solve_ik(mechanism, targets[row])
        assert alone.status == together.status[row]
        np.testing.assert_allclose(alone.pose, together.pose[row], atol=1e-9 * mechanism.characteristic_length)
        for each, value in alone.joints.items():
            np.testing.assert_allclose(value, together[row].joints[each], atol=1e-9)
            np.testing.assert_array_equal(stored[row].joints[each], together.joints[each][row])


@pytest.mark.parametrize("name", every_machine("agile_eye"))
def test_rows_that_are_no_poses_are_marked_and_spoil_nothing(name: str) -> None:
    mechanism = machine(name)
    targets = np.tile(mechanism.home_pose, (4, 1, 1))
    targets[1, 0, 0], targets[2, :3, :3] = np.nan, 2.0 * np.eye(3)
    answer = pf.solve_ik(mechanism, targets, options=Options(on_invalid="mark"))
    assert answer.status.tolist() == [Status.REACHED, Status.INVALID, Status.INVALID, Status.REACHED]
    assert all(np.isnan(value[1]).all() and np.isfinite(value[3]).all() for value in answer.joints.values())
    assert np.isnan(pf.closure_residual(answer)).tolist() == [False, True, True, False]


@compiled
@pytest.mark.parametrize("change", ["reversed", "shuffled", "smaller", "larger"])
@pytest.mark.parametrize("name", every_machine("agile_eye", "slider"))  # descriptions without a length
def test_how_a_machine_is_described_does_not_change_what_it_reaches(name: str, change: str) -> None:
    mechanism = machine(name)
    factor = {"smaller": 1e-3, "larger": 1e6}.get(change, 1.0)
    other = {"reversed": closure.reversed_joints, "shuffled": closure.shuffled}.get(
        change, lambda each: closure.scaled(each, factor)
    )(mechanism)
    reached = pf.solve_fk(mechanism, random_values(mechanism, 2, 0.4)).pose
    targets = np.concatenate([reached, random_targets(mechanism, 3, seed=3)])
    moved = targets.copy()
    moved[:, :3, 3] *= factor
    answer = pf.solve_ik(other, moved)
    assert_honest(other, moved, answer)
    assert np.array_equal(answer.status, pf.solve_ik(mechanism, targets).status)


# --- paths -----------------------------------------------------------------------------------------------------------


def round_trip(mechanism: Mechanism, shift: float, turn: float, steps: int = 60) -> np.ndarray:
    """Poses out from home and back, (2 steps, 4, 4): by a distance [L] and by an angle [rad]."""
    direction = np.array([2.0, -1.0, 1.5]) / np.linalg.norm([2.0, -1.0, 1.5])
    way = np.r_[np.linspace(0, 1, steps), np.linspace(1, 0, steps)][:, None] * direction
    path = np.tile(mechanism.home_pose, (2 * steps, 1, 1))
    path[:, :3, 3] += shift * mechanism.characteristic_length * way
    path[:, :3, :3] = Rotation.from_rotvec(turn * way).as_matrix()
    return path


SMOOTH = ("tricept", "delta_uu", "pinned_delta", "orthoglide", "puu", "exechon", "cru", "ankle", "limited_tip")


@compiled
@pytest.mark.parametrize("name", SMOOTH)
def test_a_path_out_of_reach_and_back_is_followed_without_leaps_and_ends_as_it_began(name: str) -> None:
    mechanism = machine(name)
    path = round_trip(mechanism, shift=1.2, turn=0.3)
    answer = pf.track(mechanism, path)
    assert_honest(mechanism, path, answer)
    assert (answer.status == Status.PROJECTED).any()
    leaps = [turned_by(mechanism, *pair) for pair in pairwise(answer)]
    assert max(leaps) <= 0.2
    assert turned_by(mechanism, answer[0], answer[-1]) <= 1e-6


@compiled
@pytest.mark.parametrize("name", ["delta_uu", "pinned_delta", "puu"])
def test_an_orientation_out_of_reach_does_not_pull_a_path_into_another_branch(name: str) -> None:
    """Nothing turns these platforms: far turns asked for drew the search through open loops to other branches."""
    mechanism = machine(name)
    path = round_trip(mechanism, shift=0.0, turn=2.9)
    answer = pf.track(mechanism, path)
    assert_honest(mechanism, path, answer)
    leaps = [turned_by(mechanism, *pair) for pair in pairwise(answer)]
    assert max(leaps) <= 0.3


@compiled
def test_a_projection_is_never_further_away_than_where_it_started() -> None:
    mechanism = machine("delta_uu")
    home = pf.solve_ik(mechanism, mechanism.home_pose)
    for turn in np.linspace(2.0, 3.1, 8):
        target = mechanism.home_pose.copy()
        target[:3, :3] = Rotation.from_rotvec([turn, 0.0, 0.0]).as_matrix()
        answer = pf.solve_ik(mechanism, target, start=home)
        chord = np.linalg.norm(answer.pose[:3, :3] - target[:3, :3])
        started = np.linalg.norm(mechanism.home_pose[:3, :3] - target[:3, :3])
        away = np.hypot(chord, answer.position_error / mechanism.characteristic_length)
        assert away <= started + 1e-6


@pytest.mark.parametrize(
    "count", [pytest.param(36, marks=pytest.mark.slow), pytest.param(120, marks=pytest.mark.campaign)]
)
def test_a_start_far_away_keeps_its_working_mode_as_a_path_does(count: int) -> None:
    """A single step of Newton's method leaps over a wrist's singularity."""
    mechanism, followed = machine("arm"), 0
    there = pf.solve_fk(mechanism, random_values(mechanism, count, 0.8, seed=11))
    for row in range(0, count, 2):
        begin, end = there.pose[row], there.pose[row + 1]
        share = np.linspace(0, 1, 100)[:, None]
        path = np.tile(begin, (100, 1, 1))
        turn = Rotation.from_matrix(end[:3, :3] @ begin[:3, :3].T).as_rotvec()
        path[:, :3, :3] = Rotation.from_rotvec(share * turn).as_matrix() @ begin[:3, :3]
        path[:, :3, 3] += share * (end - begin)[:3, 3]
        tracked = pf.track(mechanism, path, start=there[row])
        if not tracked:
            continue
        answer = pf.solve_ik(mechanism, path[-1], start=there[row])
        if answer:  # fewer steps than the path has may end at a limit
            followed += 1
            assert turned_by(mechanism, answer, tracked[-1]) <= 1e-6
    assert followed >= count // 6


# --- joints on no path -----------------------------------------------------------------------------------------------


def arm_with_tool(tip: str) -> Mechanism:
    """An arm placed by the hinge of a tool that hangs on it alone."""
    joints = [
        *chain(1, *closure.ARM, end="hand"),
        joint(tip, "tip", ("hand", "tool"), (300, 0, 340), Z, range=(-0.5, 0.5)),
    ]
    return Mechanism("arm with a tool", joints, "tip")


@pytest.mark.parametrize("name", ["gripper", "platform_gripper"])
def test_a_loop_beyond_the_end_effector_is_closed_too(name: str) -> None:
    mechanism = machine(name)
    values = np.repeat(home_values(mechanism)[None], 5, axis=0)
    values[:, mechanism.actuator_names.index("g1")] = np.linspace(-0.3, 0.3, 5)
    answer = pf.solve_fk(mechanism, values)
    assert np.all(answer.status == Status.REACHED)
    assert_feasible(mechanism, answer)
    np.testing.assert_allclose(answer.joints["g2"], np.linspace(-0.3, 0.3, 5), atol=1e-9)  # a parallelogram


@pytest.mark.parametrize("asked, status", [(0.4, Status.REACHED), (2.0, Status.PROJECTED)])
def test_a_driven_tool_that_no_path_passes_keeps_its_range(asked: float, status: Status) -> None:
    mechanism = arm_with_tool("R*")
    answer = pf.solve_fk(mechanism, [*home_values(mechanism)[:-1], asked])
    assert answer.status == status
    assert answer.joints["tip"] == pytest.approx(min(asked, 0.5), abs=1e-8)
    assert_feasible(mechanism, answer)


@compiled
def test_what_nothing_asks_of_stays_where_it_was() -> None:
    mechanism = arm_with_tool("R")
    answer = pf.solve_ik(mechanism, random_targets(mechanism, 24))
    assert np.all(answer.joints["tip"] == 0.0)


# --- odd machines and targets ----------------------------------------------------------------------------------------


def test_a_platform_welded_to_the_base_stays_there() -> None:
    leg = chain(1, ("R*", (0, 0, 0), Z), ("R", (10, 0, 0), Z), ("R", (10, 10, 0), Z))
    mechanism = Mechanism("welded", [joint("F", "weld", ("base", "platform"), (0, 0, 0)), *leg], "platform", (0, 0, 10))
    assert pf.solve_ik(mechanism, mechanism.home_pose).status == Status.REACHED
    for answer in (pf.solve_ik(mechanism, [0, 0, 11]), pf.solve_fk(mechanism, [0.3])):
        assert answer.status == Status.PROJECTED
        np.testing.assert_allclose(answer.pose, mechanism.home_pose, atol=1e-8)
        assert_feasible(mechanism, answer)


@compiled
@pytest.mark.parametrize("distance", [1e7, 1e9, 1e12, 1e100, 1e200, 1e300])
def test_a_target_however_far_is_approached_like_one_that_is_far(distance: float) -> None:
    mechanism = machine("delta_uu")
    near, far = (pf.solve_ik(mechanism, mechanism.home_pose[:3, 3] + [away, 0, 0]) for away in (1e5, distance))
    assert far.status == Status.PROJECTED
    assert far.position_error == pytest.approx(distance, rel=1e-4)
    np.testing.assert_allclose(far.pose, near.pose, atol=0.5)  # of 240 from the base
    assert_feasible(mechanism, far)


@compiled
@pytest.mark.parametrize("distance", [1e1, 1e2, 1e3, 1e4])
def test_slides_without_ranges_reach_however_far(distance: float) -> None:
    mechanism = Mechanism.from_legs(
        "U-P*-U",
        base=[(2, 0, 0)],
        platform=[(1, 0, 2)],
        copies={"count": 3, "axis": (0, 0, 1)},
        reference_point=(0, 0, 2),
        task=("x", "y", "z"),
        A={"axes": [(0, 1, 0), (2, 0, 1)]},
        C={"axes": [(2, 0, 1), (0, 1, 0)]},
    )
    directions = np.random.default_rng(0).normal(size=(20, 3))
    directions[:, 2] = np.abs(directions[:, 2])
    targets = mechanism.home_pose[:3, 3] + distance * directions
    answers = pf.solve_ik(mechanism, targets)
    assert (answers.status == Status.REACHED).all()
    assert pf.closure_residual(answers).max() <= 1e-9 * distance


@compiled
def test_universal_and_revolute_joints_may_turn_further_than_half_way() -> None:
    wide = {"range": ((-4, 4), (-0.1, 3.5))}
    joints = [
        joint("R*", "r", ("base", "a"), (0, 0, 0), Z),
        joint("U", "u", ("a", "b"), (100, 0, 0), (Z, X), **wide),
        joint("R*", "w", ("b", "platform"), (150, 0, 0), (0, 1, 0), range=(0, 7), home=1.0),
    ]
    mechanism = Mechanism("wide joints", joints, "platform", (200, 0, 0))
    rng = np.random.default_rng(0)
    moved = {
        "r": rng.uniform(-7, 7, (50, 1)),
        "u": rng.uniform((-4, -0.1), (4, 3.5), (50, 2)),
        "w": rng.uniform(-1, 6, (50, 1)),
    }
    targets = checks.placed_bodies(mechanism, moved)[0]["platform"] @ mechanism.home_pose
    answer = pf.solve_ik(mechanism, targets)
    assert np.all(answer.status == Status.REACHED)
    assert_honest(mechanism, targets, answer)


@compiled
@pytest.mark.parametrize("count", [30, pytest.param(1000, marks=pytest.mark.campaign)])
def test_every_pose_of_an_arm_within_its_ranges_is_reached(count: int) -> None:
    """The poses come from random joint angles, so that each is in reach, in whatever working mode."""
    mechanism, rng = machine("arm"), np.random.default_rng(4)
    moved = {}
    for each in mechanism.joints:
        low, high = each.range or (-7.0, 7.0)
        moved[each.name] = rng.uniform(low - each.home, high - each.home, (count, 1))
    targets = checks.placed_bodies(mechanism, moved)[0]["platform"] @ mechanism.home_pose
    answer = pf.solve_ik(mechanism, targets)
    assert np.all(answer.status == Status.REACHED)
    assert_honest(mechanism, targets, answer)


@compiled
def test_the_agile_eye_has_eight_assembly_modes() -> None:
    """C. M. Gosselin, J. Sefrioui, M. J. Richard: a spherical 3-RRR has at most eight."""
    mechanism = machine("agile_eye")
    modes = pf.assembly_modes(mechanism, [0.2, -0.3, 0.4])
    assert len(modes) == 8
    for mode in modes:
        assert checks.gap_of_joints(mechanism, mode)[0] <= 2e-9


@compiled
def test_what_holds_an_orientation_is_sought_from_other_places_turned_so() -> None:
    """A 3-CRS: the nearest pose that leans as asked is one to which no short way leads from home, or from a corner."""
    mechanism = Mechanism.from_legs(
        "C*-R-S",
        base=ring(100.0, 0.0, closure.TURNS),
        via=ring(80.0, 40.0, (25, 145, 265)),
        platform=ring(40.0, 90.0, closure.TURNS),
        A={"axis": "vertical", "range": ((-1.2, 1.2), (-40, 50))},
        B={"axis": "radial"},
        C={"cone": {"half_angle": 1.0}},
        reference_point=(0, 0, 90),
    )
    leant = {"rotvec": (-0.15, 0.02, 0.13)}
    near = pf.solve_ik(mechanism, pf.pose((-16, 1, 82), **leant))
    found = pf.solve_ik(mechanism, pf.pose((-23, 8, 82), **leant))
    assert near and found.held == "orientation"
    assert found.position_error < np.linalg.norm(near.pose[:3, 3] - (-23, 8, 82))
