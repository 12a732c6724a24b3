"""What projections keep, name and search: policies of the nearest feasible pose. That it is one, `test_matrix` asks."""

from __future__ import annotations

import dataclasses
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import INTERPRETED, assert_feasible
from machines import closure, five_bar
from oracles import targets_about
from oracles.nearest import conditions
from pfabrik import Joint, Leg, Mechanism, Options, Status
from pfabrik.common.rotations import angles_between
from pfabrik.engines.engine import engine_of
from pfabrik.engines.joints.close import close
from pfabrik.engines.joints.closure_engine import ClosureEngine
from pfabrik.engines.pose.legs_engine import LegsEngine
from pfabrik.machine.description.task import task_of
from pfabrik.machine.model import model_of

SAME = 1e-6
"""Share of the distance, or of L, by which answers may differ."""


# --- what counts -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("share", [0.1, 10.0])
def test_what_a_rotation_counts_is_for_the_caller_to_say(share: float) -> None:
    """The less it counts, the more the platform turns toward a far target."""
    machine = pf.load("stewart")
    targets = targets_about(machine, np.random.default_rng(0), 2 if INTERPRETED else 10, 3.0, 0.3)
    length = share * machine.rotation_length
    usual, options = Options(hold=None), Options(hold=None, rotation_length=length)
    usually, answers = (pf.solve_ik(machine, targets, options=each) for each in (usual, options))
    turns_more = np.greater(answers.rotation_error, usually.rotation_error)
    assert (turns_more if share < 1.0 else ~turns_more).mean() >= 0.8
    for target, answer in zip(targets, answers, strict=True):
        found = conditions(machine, target, answer, options)
        assert np.linalg.norm(found.rest) <= 1e-4 * np.linalg.norm(found.slope)


@pytest.mark.parametrize("name", ["five_bar", "stewart", "nrpm"])
def test_the_centroid_of_the_paper_is_never_nearer(name: str) -> None:
    machine = pf.load(name)
    targets = targets_about(machine, np.random.default_rng(0), 2 if INTERPRETED else 8, 1.5, 0.3)
    answers = pf.solve_ik(machine, targets, options=Options(hold=None))
    centred = pf.passes.solve(machine, targets, replace(pf.passes.Options.centroid(), hold=None))
    assert_feasible(machine, centred)
    ours, theirs = (
        np.hypot(each.position_error, machine.rotation_length * each.rotation_error) for each in (answers, centred)
    )
    assert (ours <= theirs * (1.0 + SAME)).all()


@pytest.mark.parametrize("name", ["five_bar", "delta"])
def test_what_has_no_orientation_has_none_to_hold(name: str) -> None:
    machine = pf.load(name)
    targets = targets_about(machine, np.random.default_rng(1), 4, 2.0, 0.0)
    answers = pf.solve_ik(machine, targets, options=Options(hold=None))
    assert (answers.status == Status.PROJECTED).any()
    for hold in ("orientation", "position"):
        held = pf.solve_ik(machine, targets, options=Options(hold=hold))
        np.testing.assert_allclose(held.pose, answers.pose, atol=1e-9 * machine.characteristic_length)
        assert list(held.held) == [None] * len(targets)


@pytest.mark.parametrize("name", ["ucu", "nrpm"])
def test_where_the_reference_point_is_does_not_change_what_is_held(name: str) -> None:
    """Platforms turn about their middle on the way to a target, not about a point far away."""
    near, rng = pf.load(name), np.random.default_rng(3)
    lever = 300.0 * near.characteristic_length * np.array([0.6, 0.0, 0.8])
    far = dataclasses.replace(near, reference_point=near.reference_point + lever)
    turns = Rotation.from_rotvec(0.1 * rng.normal(size=(30, 3))).as_matrix()
    targets = near.home_pose @ pf.pose(rng.normal(size=(30, 3)) * 0.3 * near.characteristic_length, rotation=turns)
    answers, others = pf.solve_ik(near, targets), pf.solve_ik(far, targets @ pf.pose(lever))
    np.testing.assert_array_equal(others.status, answers.status)
    np.testing.assert_array_equal(others.held, answers.held)
    held = answers.held == "orientation"
    assert held.sum() >= 2
    np.testing.assert_allclose(
        others.position_error[held], answers.position_error[held], atol=SAME * near.characteristic_length
    )


STRICT = 100.0
"""A price at which what some pose has is held [L per rad, or per L]."""

HOLDING = {"2-PRU/UPR": closure.pru_upr, "rotopod": closure.rotopod, "angled 3-PRR": closure.angled_prr}
"""Machines whose platforms have fewer places for what is held than they have others."""


@pytest.mark.filterwarnings("ignore:(divide by zero|invalid value):RuntimeWarning")  # dead points, where interpreted
@pytest.mark.parametrize("count", [2 if INTERPRETED else 50, pytest.param(800, marks=pytest.mark.campaign)])
@pytest.mark.parametrize("hold", ["orientation", "position"])
@pytest.mark.parametrize("name", HOLDING)
def test_what_a_known_pose_holds_is_not_given_up_and_hardly_ever_farther(name: str, hold: str, count: int) -> None:
    """Poses that answer other targets have the part of these that is to be held, and hardly any of them costs less."""
    machine, rng = HOLDING[name](), np.random.default_rng(5)
    length, lever = machine.characteristic_length, machine.rotation_length
    known = pf.solve_ik(machine, targets_about(machine, rng, count, 0.6, 0.7), options=Options(hold=None)).pose
    targets = known.copy()
    if hold == "orientation":
        targets[:, :3, 3] += rng.uniform(-0.8, 0.8, (count, 3)) * task_of(machine).axes * length
    else:
        targets[:, :3, :3] = Rotation.from_rotvec(rng.uniform(-0.9, 0.9, (count, 3))).as_matrix() @ targets[:, :3, :3]
    answers = pf.solve_ik(machine, targets, options=Options(hold=hold, hold_price=STRICT))
    off = answers.rotation_error if hold == "orientation" else answers.position_error / length
    assert np.quantile(off, 0.9) <= 1e-6 and off.max() <= 0.05
    position, rotation = task_of(machine).errors(known, targets)
    far = np.hypot(answers.position_error, lever * answers.rotation_error) + STRICT * off * length
    farther = far > np.hypot(position, lever * rotation) + SAME * length
    assert np.mean(farther) <= (0.0 if name == "2-PRU/UPR" else 0.06)


@pytest.mark.parametrize("by_legs", [True, False])
def test_without_a_start_nothing_is_given_up_for_home(by_legs: bool) -> None:
    """Upright targets at heights of poses that lean: home, upright and beside them, is nearer than what holds one."""
    machine, count = closure.rotopod(), 1 if INTERPRETED else 40
    leaning = targets_about(machine, np.random.default_rng(5), count, 0.6, 0.7)
    heights = pf.solve_ik(machine, leaning, options=Options(hold=None)).pose[:, 2, 3]
    targets = np.tile(machine.home_pose, (count, 1, 1))
    targets[:, 2, 3] = heights
    engine = engine_of(machine) if by_legs else ClosureEngine(model_of(machine))
    assert isinstance(engine, LegsEngine) == by_legs
    rows = engine.answer(targets, None, Options(hold="position", hold_price=STRICT), keep_mode=False).rows
    assert (rows.status == Status.PROJECTED).all()
    assert (np.abs(rows.poses[:, 2, 3] - heights) <= 1e-3 * machine.characteristic_length).all()


# --- how near --------------------------------------------------------------------------------------------------------

IN_A_PLANE = {"five_bar": (0.0, 1.0, 1.0), "rrr": (1.0, 1.0, 0.0), "rpr": (1.0, 1.0, 0.0)}
"""Directions in which machines move that cannot in others."""
CERTIFIED = [*IN_A_PLANE, "delta", "linear_delta", "orthoglide", "psu", "stewart", "ucu", "servo_hexapod", "hexaglide"]


@pytest.mark.parametrize("count", [8 if INTERPRETED else 15, pytest.param(5000, marks=pytest.mark.campaign)])
@pytest.mark.parametrize("name", [*CERTIFIED, "nrpm"])
def test_nothing_is_reached_that_is_nearer_than_what_is_certified(name: str, count: int) -> None:
    machine, rng, axes = pf.load(name), np.random.default_rng(1), IN_A_PLANE.get(name, 1.0)
    targets = np.repeat(machine.home_pose[None], count, axis=0)
    targets[:, :3, 3] += rng.uniform(-1.5, 1.5, (count, 3)) * axes * machine.characteristic_length
    targets[:, :3, :3] = Rotation.from_rotvec(rng.uniform(-0.3, 0.3, (count, 1)) * (0, 0, 1)).as_matrix()
    answers = pf.solve_ik(machine, targets)
    certain = answers.certified & (answers.status == Status.PROJECTED)
    assert certain.sum() >= 0.3 * (answers.status == Status.PROJECTED).sum() or INTERPRETED
    away, nearer = answers.position_error[certain, None], np.repeat(answers.pose[certain][:, None], 20, axis=1)
    shifts = rng.normal(size=(*nearer.shape[:2], 3)) * axes
    sizes = away * 10.0 ** rng.uniform(-4.0, 0.3, nearer.shape[:2])
    nearer[..., :3, 3] += shifts * (sizes / np.linalg.norm(shifts, axis=2))[..., None]
    inside = np.linalg.norm(nearer[..., :3, 3] - targets[certain, None, :3, 3], axis=2) < (1.0 - SAME) * away
    assert inside.any() and not np.any(pf.solve_ik(machine, nearer[inside]).status == Status.REACHED)


@pytest.mark.parametrize("name", ["five_bar", "stewart", "nrpm", "servo_hexapod", "delta"])
def test_just_outside_the_border_answers_are_as_far_as_the_target_is(name: str) -> None:
    machine = pf.load(name)
    axes, step = np.array(IN_A_PLANE.get(name, (1.0, 1.0, 1.0))), 1e-7 * machine.characteristic_length
    targets = targets_about(machine, np.random.default_rng(0), 2 if INTERPRETED else 8, 1.5, 0.0)
    border = pf.solve_ik(machine, targets)
    outward = (targets - border.pose)[:, :3, 3] * axes
    rows = (np.linalg.norm(outward, axis=1) > 0.01 * machine.characteristic_length) & (border.rotation_error <= 1e-9)
    beside = targets[rows]
    beside[:, :3, 3] = border.pose[rows, :3, 3] + step * outward[rows] / np.linalg.norm(outward[rows], axis=1)[:, None]
    answers = pf.solve_ik(machine, beside)
    assert rows.any()
    np.testing.assert_allclose(answers.position_error, step, rtol=0.01)


def test_an_answer_at_a_singular_pose_is_the_nearest() -> None:
    """Without limits, both arms of a 5-bar stretch toward a target above it: their tip is where two circles meet."""
    machine = pf.load("five_bar").without_limits()
    shoulder, elbow = (np.array(machine.joint(joint).at) for joint in ("p1", "p2"))
    reach = np.linalg.norm(elbow - shoulder) + np.linalg.norm(machine.reference_point - elbow)
    height = np.sqrt(reach**2 - shoulder[1] ** 2)
    for above in np.array([1e-3, 1.0, 1e3]) * machine.characteristic_length:
        answer = pf.solve_ik(machine, (0.0, 0.0, height + above))
        assert answer.status == Status.PROJECTED
        np.testing.assert_allclose(answer.position_error, above, rtol=SAME)


def unlimited_five_bar(base: float, inner: float, outer: float) -> Mechanism:
    """A 5-bar without limits: feet at +- base / 2, links of these lengths, elbows out."""
    tip, feet, elbows = np.array([0.03 * base, 0.75 * (inner + outer)]), np.array([[-1.0, 0], [1, 0]]) * base / 2, []
    for side, foot in zip((-1.0, 1.0), feet, strict=True):
        away = np.linalg.norm(tip - foot)
        turn = np.arctan2(*(tip - foot)[::-1]) - side * np.arccos((inner**2 + away**2 - outer**2) / (2 * inner * away))
        elbows.append(foot + inner * np.array([np.cos(turn), np.sin(turn)]))
    return five_bar(feet, elbows, tip)


def nearest_of_rings(targets: np.ndarray, feet: np.ndarray, radii: tuple[float, float]) -> np.ndarray:
    """How far targets (n, 2) are from what is within both of two rings: feet on four circles, and their crossings."""
    candidates, span = [targets], np.linalg.norm(feet[1] - feet[0])
    for foot in feet:
        out = (targets - foot) / np.linalg.norm(targets - foot, axis=1)[:, None]
        candidates += [foot + radius * out for radius in radii]
    for first in radii:
        for second in radii:
            x = (span**2 + first**2 - second**2) / (2 * span)
            if abs(x) <= first:
                corners = feet[0] + [[x, y * np.sqrt(first**2 - x**2)] for y in (1.0, -1.0)]
                candidates += [np.broadcast_to(corner, targets.shape) for corner in corners]
    every = np.stack(candidates)
    from_feet = np.linalg.norm(every[:, :, None] - feet, axis=-1)
    inside = ((from_feet <= radii[1] + 1e-9) & (from_feet >= radii[0] - 1e-9)).all(axis=-1)
    return np.where(inside, np.linalg.norm(every - targets, axis=-1), np.inf).min(axis=0)


@pytest.mark.parametrize(("base", "inner", "outer"), [(0.6472, 1.14, 0.9), (0.3, 0.46, 0.46), (118.0, 90.0, 90.0)])
def test_just_outside_two_rings_answers_are_their_nearest_points(base: float, inner: float, outer: float) -> None:
    """Links stretch out at the border, where elbows tell of the tip with half their digits: no search stops there."""
    machine = unlimited_five_bar(base, inner, outer)
    feet, radii = np.array([[-base / 2, 0.0], [base / 2, 0.0]]), (abs(inner - outer), inner + outer)
    rng, length = np.random.default_rng(0), machine.characteristic_length
    n = 20 if INTERPRETED else 500
    angle, radius = rng.uniform(-np.pi, np.pi, n), radii[1] + length * 10.0 ** rng.uniform(-6, -2, n)
    targets = feet[rng.integers(0, 2, n)] + radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    answers = pf.solve_ik(machine, np.c_[targets, np.zeros(n)])
    assert (answers.status == Status.PROJECTED).all()
    assert np.abs(answers.position_error - nearest_of_rings(targets, feet, radii)).max() <= 1e-9 * length
    assert answers.certified.mean() > 0.98


# --- however far -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", pf.catalog())
def test_however_far_a_target_is_no_answer_is_no_number(name: str) -> None:
    machine = pf.load(name)
    target = machine.home_pose.copy()
    target[int(np.argmax(task_of(machine).axes)), 3] = 1e308
    answer = pf.solve_ik(machine, target)
    assert np.isfinite(answer.actuators).all() and np.isfinite(answer.pose).all()
    assert answer.status is Status.PROJECTED or not any(task_of(machine).axes)


@pytest.mark.parametrize("distance", [1e8, 1e12, 1e150, 1.7e308])
def test_struts_without_limits_follow_far_but_not_to_where_numbers_end(distance: float) -> None:
    machine = pf.load("stewart").without_limits()
    for target in ([distance, distance, 180], [[distance, distance, 180]] * 2):
        answer = pf.solve_ik(machine, target)
        assert np.isfinite(answer.position_error).all()
        gone = np.abs(np.subtract(answer.pose[..., 0, 3], distance)) / distance
        assert (np.equal(answer.status, Status.REACHED) == (gone < 1e-12)).all()


@pytest.mark.skipif(INTERPRETED, reason="many searches: minutes without the compiler")
@pytest.mark.parametrize("distance", [1e7, 1e12, 1e160, 1e300])
def test_a_target_however_far_is_approached_like_one_that_is_far(distance: float) -> None:
    for machine in (closure.delta("UU", cone=None), closure.five_bar_with_tool()):
        near, far = (pf.solve_ik(machine, machine.home_pose[:3, 3] + [away, 0, 0]) for away in (1e5, distance))
        assert far.status == Status.PROJECTED
        assert far.position_error == pytest.approx(distance, rel=1e-4)
        np.testing.assert_allclose(far.pose, near.pose, atol=2e-3 * machine.characteristic_length)
        assert_feasible(machine, far)


# --- what holds answers back -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("away", [5e2, 1e9, 1e300])
def test_limits_that_hold_alike_are_named_as_the_description_lists_them(away: float) -> None:
    machine = pf.load("stewart")
    limits = pf.solve_ik(machine, (0, 0, away)).active_limits
    assert [limit.joint for limit in limits] == list(machine.actuator_names)
    assert all(limit.bound == "max" for limit in limits)


def test_a_limit_says_which_coordinate_of_a_joint_it_is() -> None:
    pivot = {"type": "universal", "connects": ("base", "table"), "at": (0, 0, 10), "axes": ((1, 0, 0), (0, 1, 0))}
    post = Joint("pivot", **pivot, range=((-0.5, 0.5), (-0.5, 0.5)))
    legs = [Leg("U-P*-S", base=[at], platform=[(at[0], at[1], 10)]) for at in ((10, 0, 0), (0, 10, 0))]
    table = Mechanism.from_legs(legs, joints=[post], end_effector="table", reference_point=(0, 0, 10), task=("tilt",))
    for coordinate, turn in enumerate([(1, 0, 0), (0, 1, 0)]):
        (limit,) = pf.solve_ik(table, pf.pose((0, 0, 10), rotvec=turn)).active_limits
        assert (limit.joint, limit.bound, limit.coordinate) == ("pivot", "max", coordinate)
        assert limit.value == pytest.approx(0.5, abs=1e-8)


@pytest.mark.parametrize("name", ["delta", "linear_delta"])
def test_the_second_forearm_of_a_parallelogram_keeps_its_own_cone(name: str) -> None:
    """Both have one line, so a cone is worth the same on either."""
    machine = pf.load(name)
    length = machine.characteristic_length
    cones = {joint: replace(machine.joint(joint).cone, half_angle=0.5) for joint in ("BL1", "BR1")}
    narrow = [machine.with_limits({joint: cone}) for joint, cone in cones.items()]
    targets = machine.home_pose[:3, 3] + length * np.random.default_rng(0).uniform(-1.5, 1.5, (60, 3))
    on_first, on_second, wide = (pf.solve_ik(each, targets) for each in (*narrow, machine))
    assert (on_first.position_error > wide.position_error + 1e-3 * length).any()
    np.testing.assert_allclose(on_second.position_error, on_first.position_error, atol=SAME * length)
    assert all(margin.min() >= -1e-8 for margin in pf.margins(on_second).values())


@pytest.mark.parametrize(
    ("machine", "strut"),
    [(pf.load("stewart"), "BL1"), (closure.gripper_on_platform(), "P1.2")],
    ids=["in the pose", "on joint coordinates"],
)
def test_the_nearest_with_a_joint_locked_is_that_with_it_fixed(machine: Mechanism, strut: str) -> None:
    at, length = machine.joint(strut), float(machine.home_coordinate(strut))
    locked = machine.with_limits({strut: (length, length)})
    weld = Joint(strut, "fixed", at.connects, at=machine.reference_point)
    fixed = replace(machine, joints=tuple(weld if joint.name == strut else joint for joint in machine.joints))
    targets = targets_about(machine, np.random.default_rng(3), 2 if INTERPRETED else 12, 0.8, 0.3)
    answers, others = (pf.solve_ik(each, targets, options=Options(hold=None)) for each in (locked, fixed))
    assert_feasible(locked, answers)
    for error in ("position_error", "rotation_error"):
        np.testing.assert_allclose(getattr(answers, error), getattr(others, error), rtol=1e-5, atol=1e-9)
    assert (answers.status == Status.PROJECTED).any()


# --- what is searched ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("degrees", [100, 160, 179, 180])
@pytest.mark.parametrize("name", ["rps", "prs"])
def test_a_platform_that_is_told_to_hold_its_tilt_does_not_stand_on_its_head(name: str, degrees: float) -> None:
    machine = pf.load(name)
    turns = [pf.pose(machine.home_pose[:3, 3], rotvec=np.radians(degrees) * np.array(axis)) for axis in np.eye(3)[:2]]
    for hold in ("orientation", None):
        for answer in pf.solve_ik(machine, np.array(turns), options=Options(hold=hold)):
            assert answer.status is Status.PROJECTED and answer.held is None
            assert 0.1 < answer.rotation_error < np.radians(degrees) - 0.1
            assert answer.active_limits


def test_a_tool_that_rods_keep_upright_is_never_answered_lying_down() -> None:
    """Loops of a delta with a shaft close with its platform turned over too: no answer, though the tool may yaw."""
    machine = closure.picker()
    shifts = np.random.default_rng(0).uniform(-1.0, 1.0, (4 if INTERPRETED else 60, 3)) * machine.characteristic_length
    answers = pf.solve_ik(machine, machine.reference_point + shifts)
    np.testing.assert_allclose(answers.pose[:, 2, 2], 1.0, atol=1e-9)
    assert set(answers.status.tolist()) == {Status.REACHED, Status.PROJECTED}


def test_a_working_mode_with_a_small_room_of_its_own_is_searched() -> None:
    """A delta's platform can be above its base, where nothing leads from below: a target under that room is nearest to
    it."""
    machine = pf.load("delta")
    targets = [[-0.07, -0.26, 0.2], [0.04, -0.27, 0.13], [0.11, 0.02, 0.13], [0.08, 0.12, 0.16], [-0.16, 0.11, 0.19]]
    answers = pf.solve_ik(machine, machine.characteristic_length * np.array(targets))
    assert (answers.status == Status.PROJECTED).all() and (answers.pose[:, 2, 3] > 0.0).all()
    assert (answers.position_error < 0.35 * machine.characteristic_length).all()


def test_a_search_that_passes_by_the_nearest_yet_goes_on_to_one_nearer() -> None:
    """Two of a hexaglide's poses are nearest to a target among those about them, and the way to one leads by the
    other."""
    machine = pf.load("hexaglide")
    target = pf.pose([-5.8, -19.9, 231.3], rotvec=[-0.362, -0.415, -0.202])
    answer = pf.solve_ik(machine, target, options=Options(hold=None))
    assert np.hypot(answer.position_error, machine.rotation_length * answer.rotation_error) < 31.92


def test_a_foot_that_is_asked_to_tilt_too_far_tilts_as_far_as_it_can() -> None:
    """An ankle's motors pass their dead points on the way: no search may be lost there. Of all tilts, every
    two thirds of a degree, that the foot can have, none is nearer."""
    machine = pf.load("g1_ankle")

    def tilted(angles: np.ndarray) -> np.ndarray:
        return np.array([pf.pose(machine.reference_point, rpy=(roll, pitch, 0.0)) for pitch, roll in angles])

    grid = np.stack(np.meshgrid(np.linspace(-0.87, 0.5235, 120), np.linspace(-0.2617, 0.2617, 45)), axis=-1)
    every = tilted(grid.reshape(-1, 2))
    upright = every[pf.solve_ik(machine, every).status == Status.REACHED][:, :3, 2]
    targets = tilted(np.random.default_rng(0).uniform((-1.4, -0.6), (1.1, 0.6), (200, 2)))
    answers = pf.solve_ik(machine, targets)
    nearest = np.arccos(np.clip(targets[:, :3, 2] @ upright.T, -1.0, 1.0)).min(axis=1)
    assert np.count_nonzero(answers.status == Status.PROJECTED) > 130
    np.testing.assert_array_less(answers.rotation_error, nearest + 1e-9)


@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
def test_a_target_that_a_search_starts_on_is_reached() -> None:
    """A 3-URU that turns about the middle of its base: all legs are at dead points there, however they stand."""
    joints = []
    for k, angle in enumerate(np.radians([0, 120, 240])):
        out, across = np.array([np.cos(angle), np.sin(angle), 0]), np.array([-np.sin(angle), np.cos(angle), 0])
        hip, knee, ankle = 120 * out, 160 * out + (0, 0, 70), 40 * out + (0, 0, 130)
        joints += [
            Joint(f"A{k}", "universal", ("base", f"u{k}"), hip, axes=(out, across)),
            Joint(f"B{k}", "revolute", (f"u{k}", f"l{k}"), knee, across, actuated=True, range=(-0.9, 0.8)),
            Joint(f"C{k}", "universal", (f"l{k}", "platform"), ankle, axes=(across, out)),
        ]
    machine = Mechanism("3-URU", joints, "platform", (0, 0, 130), task=("x", "y", "z"))
    turned, lowest = np.array([0.327, -0.306, -0.9, 1.508, 0.206]), [-0.03, -0.029, -0.802, 0.22, 0.03]
    count, rng = 2 if INTERPRETED else 200, np.random.default_rng(0)
    around = [*turned, *lowest, *turned[[4, 1, 2, 3, 0]] * (-1, 1, 1, 1, -1)] + 0.05 * rng.normal(size=(count, 15))
    poses = np.repeat(machine.home_pose[None], count, axis=0)
    starts = pf.configuration(machine, close(model_of(machine).closure, around, poses, limits=True).coordinates)
    assert (starts.status == Status.REACHED).all()
    assert (pf.solve_ik(machine, starts.pose, start=starts).status == Status.REACHED).all()


def test_searches_mind_where_three_hinges_point_the_platform() -> None:
    """Where two hinges of a leg cannot point the third, no search ends; and both ways to point it are searched."""
    machine = closure.coaxial_rrr()
    targets = targets_about(machine, np.random.default_rng(2), 3 if INTERPRETED else 200, 0.0, 1.0)
    answers = pf.solve_ik(machine, targets)
    least = angles_between(answers.pose[:, None, :3, :3], targets[None, :, :3, :3]).min(axis=0)
    assert np.mean(answers.rotation_error > least + 1e-6) <= 0.01


@pytest.mark.parametrize(
    ("name", "turned"), [("delta", "yaw"), ("linear_delta", "yaw"), ("orthoglide", "tilt"), ("delta", "tilt")]
)
def test_a_platform_that_never_turns_is_not_looked_for_turned(
    name: str, turned: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It goes where it goes if it is not asked to turn; and that is told in the pose of the platform alone."""
    plain = pf.load(name)
    asked = Mechanism(plain.name, plain.joints, plain.end_effector, plain.reference_point, task=("x", "y", "z", turned))
    offsets = np.random.default_rng(0).uniform(-0.6, 0.6, (12, 3)) * plain.characteristic_length
    angles = np.linspace(0.1, 2.0, 12)
    axis = np.array([0.0, 0.0, 1.0] if turned == "yaw" else [0.8, 0.6, 0.0])
    targets = pf.pose(np.array(plain.reference_point) + offsets, rotvec=angles[:, None] * axis)
    monkeypatch.setattr(ClosureEngine, "answer", None)
    found, expected = pf.solve_ik(asked, targets), pf.solve_ik(plain, targets)
    assert {Status.REACHED, Status.PROJECTED} == set(expected.status)
    assert (found.status == Status.PROJECTED).all()
    np.testing.assert_allclose(found.rotation_error, angles, atol=1e-9)
    np.testing.assert_allclose(found.position_error, expected.position_error, atol=SAME * plain.characteristic_length)
