"""What answers promise for any machine, on those that positions alone cannot express, and where they once broke it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import checks
import pfabrik as pf
from checks import INTERPRETED, assert_feasible, assert_honest, home_values
from machines import closure, machine, ring
from machines.closure import X, Z, chain, joint
from oracles import any_targets, any_values
from pfabrik import Mechanism, Status

compiled = pytest.mark.skipif(INTERPRETED, reason="many searches: minutes without the compiler")
pytestmark = pytest.mark.filterwarnings("error", "ignore::pfabrik.errors.MobilityWarning")


def turned(q: np.ndarray, other: np.ndarray) -> float:
    """Largest change of any angle [rad], whole turns aside."""
    return float(np.abs(2.0 * np.sin(0.5 * (q - other))).max())


# --- paths -----------------------------------------------------------------------------------------------------------


@compiled
def test_an_orientation_out_of_reach_does_not_pull_a_path_into_another_branch() -> None:
    """Nothing turns this platform: far turns asked for drew the search through open loops to other branches."""
    mechanism = machine("closure.delta_uu")
    turns = np.linspace(0, 2.9, 40)[:, None] * np.array([2.0, -1.0, 1.5]) / np.linalg.norm([2.0, -1.0, 1.5])
    path = pf.pose(mechanism.home_pose[:3, 3] + 0.0 * turns, rotvec=turns)
    answer = pf.track(mechanism, path)
    assert_honest(mechanism, path, answer)
    assert turned(answer.q[1:], answer.q[:-1]) <= 0.3


@compiled
def test_a_projection_is_never_further_away_than_where_it_started() -> None:
    mechanism = machine("closure.delta_uu")
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
    "count", [pytest.param(36, marks=pytest.mark.compiled), pytest.param(120, marks=pytest.mark.campaign)]
)
def test_a_start_far_away_keeps_its_working_mode_as_a_path_does(count: int) -> None:
    """A single step of Newton's method leaps over a wrist's singularity."""
    mechanism, followed = machine("closure.arm"), 0
    there = pf.solve_fk(mechanism, any_values(mechanism, count, 0.8, seed=11))
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
            assert turned(answer.q, tracked.q[-1]) <= 1e-6
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
    mechanism = machine(f"closure.{name}")
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
    answer = pf.solve_ik(mechanism, any_targets(mechanism, 24))
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
@pytest.mark.parametrize("distance", [1e1, 1e4])
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
    mechanism, rng = machine("closure.arm"), np.random.default_rng(4)
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
    mechanism = machine("closure.agile_eye")
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
