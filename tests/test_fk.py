"""Forward kinematics against closed forms, published answers and inverse kinematics; and what an answer promises."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import checks
import oracles
import pfabrik as pf
from checks import INTERPRETED, actuator_units, assert_feasible, home_values
from machines import closure, machine, published
from machines.published import PUBLISHED
from oracles import assembly
from pfabrik import Status

CATALOGUE = ("five_bar", "stewart", "nrpm")


def deviation(mechanism: pf.Mechanism, values: np.ndarray, asked: np.ndarray) -> np.ndarray:
    """Difference of actuator values, lengths relative to L."""
    return np.subtract(values, asked) / actuator_units(mechanism)


def assert_same_pose(mechanism: pf.Mechanism, found: np.ndarray, expected: np.ndarray, atol: float = 1e-7) -> None:
    """The same pose; of a joint that is placed, only the position counts. Lengths relative to L."""
    length = mechanism.characteristic_length
    np.testing.assert_allclose(found[..., :3, 3] / length, expected[..., :3, 3] / length, rtol=0, atol=atol)
    if not mechanism.end_effector_is_joint:
        np.testing.assert_allclose(found[..., :3, :3], expected[..., :3, :3], rtol=0, atol=atol)


def is_same_pose(mechanism: pf.Mechanism, found: np.ndarray, expected: np.ndarray, atol: float = 1e-6) -> np.ndarray:
    away = np.abs(found[..., :3, 3] - expected[..., :3, 3]).max(axis=-1) / mechanism.characteristic_length
    if mechanism.end_effector_is_joint:
        return away <= atol
    return np.maximum(away, np.abs(found[..., :3, :3] - expected[..., :3, :3]).max(axis=(-1, -2))) <= atol


# --- the check of joints ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["stewart", "nrpm", "five_bar", "tripod_rps", "hexaglide", "planar_rrr"])
def test_the_check_of_joints_accepts_home_and_notices_one_wrong_joint(name: str) -> None:
    mechanism = machine(name)
    home = SimpleNamespace(shape=(), pose=mechanism.home_pose, actuators=home_values(mechanism))
    home.joints = {
        joint.name: np.array(mechanism.home_coordinate(joint.name), dtype=float)
        for joint in mechanism.joints
        if joint.type != "fixed"
    }
    assert checks.gap_of_joints(mechanism, home).max() <= 1e-12
    for joint in (each for each in home.joints if each != mechanism.end_effector):
        wrong = SimpleNamespace(**vars(home) | {"joints": home.joints | {joint: home.joints[joint] + 0.01}})
        assert checks.gap_of_joints(mechanism, wrong).max() > 1e-6


# --- closed forms and published answers ------------------------------------------------------------------------------


@pytest.mark.parametrize("p, rpy, lengths", PUBLISHED["gsp_conroy"]["rows_p_rpy_L"])
def test_published_leg_lengths_of_a_hexapod_both_ways(p: list, rpy: list, lengths: list) -> None:
    mechanism = published.published_gough("gsp_conroy", PUBLISHED["gsp_conroy"]["rows_p_rpy_L"][0][0])
    target = pf.pose(p, rpy=rpy)
    np.testing.assert_allclose(pf.solve_ik(mechanism, target).actuators, lengths, rtol=0, atol=5e-5)
    answer = pf.solve_fk(mechanism, lengths)
    assert answer.status is Status.REACHED
    # four digits of the lengths are worth 8e-5 of the pose, by the oracle
    np.testing.assert_allclose(answer.pose, target, rtol=0, atol=1e-4)
    geometry = PUBLISHED["gsp_conroy"]["geometry"]
    found, _ = assembly.gough_modes(geometry["base"], geometry["platform"], lengths, starts=300)
    assert np.abs(found - answer.pose).max(axis=(1, 2)).min() <= 1e-9


def test_published_home_of_a_machine_controller_both_ways() -> None:
    case = PUBLISHED["gsp_linuxcnc_home"]
    mechanism = published.published_gough("gsp_linuxcnc_home", case["p"])
    target = pf.pose(case["p"])
    ik = pf.solve_ik(mechanism, target)
    np.testing.assert_allclose(ik.actuators, case["L"], rtol=0, atol=case["tol"])
    np.testing.assert_allclose(pf.solve_fk(mechanism, ik.actuators).pose, target, rtol=0, atol=1e-7)
    np.testing.assert_allclose(pf.solve_fk(mechanism, case["L"]).pose, target, rtol=0, atol=case["tol"])


@pytest.mark.parametrize("row", PUBLISHED["rps_leeshah"]["rows_a_b_pz_px_py_d1_d2_d3"])
def test_published_parasitic_motion_of_a_3rps_from_its_leg_lengths(row: list[float]) -> None:
    geometry = PUBLISHED["rps_leeshah"]["geometry"]
    mechanism = published.rps(geometry["base_radius"], geometry["platform_radius"], 200.0)
    answer = pf.solve_fk(mechanism, row[5:])
    assert answer.status is Status.REACHED
    np.testing.assert_allclose(answer.pose, published.lee_shah_pose(row), rtol=0, atol=1e-7)


@pytest.mark.parametrize("case", ["sauer_fig1_15", "sauer_p2_5"])
def test_planar_3rpr_is_one_of_the_published_poses_whatever_its_home(case: str) -> None:
    geometry, p = assembly.Planar3RPR(**PUBLISHED[case]["geometry"]), PUBLISHED[case]["p"]
    mechanism, home = published.planar_3rpr(geometry, geometry.lengths(0.3, 0.5, 2.5))
    answer = pf.solve_fk(mechanism, p)
    assert answer.status is Status.REACHED
    expected = np.array([published.planar_pose(each, home) for each in PUBLISHED[case]["poses_theta_x_y"]])
    assert np.abs(expected - answer.pose).max(axis=(1, 2)).min() <= 1e-9


def test_five_bar_tip_is_where_the_forearms_meet() -> None:
    mechanism = machine("five_bar")
    targets = oracles.inside_targets(mechanism, np.random.default_rng(2), 20 if INTERPRETED else 200)
    turns = oracles.actuators(mechanism, targets)
    answer = pf.solve_fk(mechanism, turns)
    assert answer
    for tip, turn in zip(answer.pose[:, :3, 3], turns, strict=True):
        assert min(np.linalg.norm(tip - each) for each in assembly.five_bar_tips(mechanism, turn)) <= 1e-7


def test_struts_that_meet_in_a_point_meet_where_three_spheres_do() -> None:
    """A leg that carries the tool's orientation, which positions alone cannot express."""
    mechanism = published.tripod()
    rng = np.random.default_rng(3)
    for _ in range(3 if INTERPRETED else 20):
        tip = published.TRIPOD_TIP + rng.uniform(-30, 30, 3)
        lengths = np.linalg.norm(published.TRIPOD_FEET - tip, axis=1)
        answer = pf.solve_fk(mechanism, lengths)
        assert answer.status is Status.REACHED
        points = assembly.spheres_meet(published.TRIPOD_FEET, lengths)
        assert min(np.linalg.norm(answer.pose[:3, 3] - point) for point in points) <= 1e-6
        np.testing.assert_allclose(answer.pose[:3, 3], tip, rtol=0, atol=1e-6)


def test_serial_arm_is_a_sum_of_its_links() -> None:
    mechanism = published.planar_arm()
    rng = np.random.default_rng(4)
    angles = rng.uniform(-3, 3, (50, 3))
    answer = pf.solve_fk(mechanism, angles)
    assert answer
    for found, turn in zip(answer.pose, angles, strict=True):
        tip, heading = assembly.planar_arm(published.ARM_LINKS, turn)
        expected = pf.pose([*tip, 0.0], rotvec=[0, 0, heading - published.ARM_HOME.sum()])
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * 600)


# --- there and back --------------------------------------------------------------------------------------------------


def assert_round_trip(mechanism: pf.Mechanism, targets: np.ndarray, least: float) -> None:
    """From home, at least this share of the poses comes back; all do, from a configuration near by."""
    reached = pf.solve_ik(mechanism, targets)
    assert reached
    back = pf.solve_fk(mechanism, reached.actuators)
    assert_feasible(mechanism, back)
    same = is_same_pose(mechanism, back.pose, reached.pose)
    assert same.mean() >= least
    rng = np.random.default_rng(5)
    near = np.array(targets)
    near[:, :3, 3] += rng.normal(size=(len(near), 3)) * 2e-3 * mechanism.characteristic_length
    seeds = pf.solve_ik(mechanism, near, start=reached)
    again = pf.solve_fk(mechanism, reached.actuators, start=seeds)
    assert again
    assert is_same_pose(mechanism, again.pose, reached.pose).all()


@pytest.mark.parametrize("count", [10 if INTERPRETED else 300, pytest.param(10_000, marks=pytest.mark.campaign)])
@pytest.mark.parametrize("name", CATALOGUE)
def test_forward_after_inverse_returns_the_pose(name: str, count: int) -> None:
    mechanism = machine(name)
    targets = oracles.inside_targets(mechanism, np.random.default_rng(6), count)
    assert_round_trip(mechanism, targets, least=0.99 if count < 1000 else 0.999)


def tilted_targets(mechanism: pf.Mechanism, rng: np.random.Generator, n: int, tilt: float) -> np.ndarray:
    """Poses within the workspace, turned by up to `tilt` [rad] about any axis."""
    found = np.empty((0, 4, 4))
    while len(found) < n:
        steps = rng.uniform(-0.6, 0.6, (4 * n, 3)) * mechanism.characteristic_length
        turns = rng.normal(size=(4 * n, 3))
        turns *= (rng.uniform(0, tilt, 4 * n) / np.linalg.norm(turns, axis=1))[:, None]
        drawn = oracles.poses(mechanism.reference_point + steps, Rotation.from_rotvec(turns).as_matrix())
        found = np.concatenate([found, drawn[oracles.margin(mechanism, drawn) >= 0]])
    return found[:n]


@pytest.mark.parametrize("count", [20 if INTERPRETED else 1000, pytest.param(10_000, marks=pytest.mark.campaign)])
def test_a_hexapod_tilted_up_to_30_degrees_is_found_from_home_without_a_start(count: int) -> None:
    mechanism = machine("stewart")
    targets = tilted_targets(mechanism, np.random.default_rng(8), count, np.radians(30.0))
    lengths = oracles.actuators(mechanism, targets)
    answer = pf.solve_fk(mechanism, lengths)
    assert_feasible(mechanism, answer)
    assert is_same_pose(mechanism, answer.pose, targets).mean() >= 0.999


@pytest.mark.parametrize("name", ["stewart", "rps"])
def test_where_the_reference_point_is_does_not_change_what_assembles(name: str) -> None:
    """A telescope's mirror turns about a point hundreds of times as far away as its hexapod is large."""
    near, rng = pf.load(name), np.random.default_rng(2)
    lever = 300.0 * near.characteristic_length * np.array([0.6, 0.0, 0.8])
    far = dataclasses.replace(near, reference_point=near.reference_point + lever)
    values = home_values(near) + rng.uniform(-0.2, 0.2, (20, len(near.actuator_names))) * near.characteristic_length
    answers, others = (pf.solve_fk(each, values) for each in (near, far))
    np.testing.assert_array_equal(answers.status == Status.REACHED, others.status == Status.REACHED)
    assert (answers.status == Status.REACHED).sum() >= 5
    for one, other in zip(answers, others, strict=True):
        if one:
            np.testing.assert_allclose(other.pose[:3, :3], one.pose[:3, :3], atol=1e-9)


def test_a_seed_keeps_its_assembly_mode() -> None:
    case = PUBLISHED["sauer_p2_5"]
    geometry = assembly.Planar3RPR(**case["geometry"])
    mechanism, home = published.planar_3rpr(geometry, case["p"])
    modes = pf.assembly_modes(mechanism, case["p"])
    assert len(modes) == 4
    for mode in modes:
        answer = pf.solve_fk(mechanism, np.add(case["p"], 0.01), start=mode)
        assert answer.status is Status.REACHED
        expected = [published.planar_pose(each, home) for each in geometry.solutions(np.add(case["p"], 0.01))]
        nearest = min(expected, key=lambda pose: np.abs(pose - mode.pose).max())
        np.testing.assert_allclose(answer.pose, nearest, rtol=0, atol=1e-8)


@pytest.mark.parametrize("has_starts", [False, True])
@pytest.mark.parametrize("name", ["stewart", "delta", "servo_hexapod", "hexaglide", "reachy_mini"])
def test_blocks_of_rows_answer_as_newton_row_by_row_and_as_single_rows(
    name: str, has_starts: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Within reach, at ends of ranges and where legs do not meet; in the same assemblies, though these may be near."""
    mechanism, rng, n = pf.load(name), np.random.default_rng(4), 40 if INTERPRETED else 1500
    values, units = home_values(mechanism), actuator_units(mechanism)
    values = values + rng.uniform(-0.25, 0.25, (n, 1)) * rng.uniform(0.0, 1.0, (n, len(values))) * units
    values[:20] += rng.uniform(-0.5, 0.5, values[:20].shape) * units

    def answers(machine: pf.Mechanism) -> tuple[pf.Solution | None, pf.Solution]:
        start = pf.solve_fk(machine, np.roll(values, 20, axis=0)) if has_starts else None
        return start, pf.solve_fk(machine, values, start=start)

    start, found = answers(mechanism)
    for row in range(0, n, n // 10):
        alone = pf.solve_fk(mechanism, values[row], start=None if start is None else start[row])
        assert (alone.status, alone.residual) == (found.status[row], found.residual[row])
        np.testing.assert_array_equal(alone.pose, found.pose[row])
    monkeypatch.setattr("pfabrik.platform.single.places_of_rods", lambda model: None)
    _, one_by_one = answers(dataclasses.replace(mechanism, name="row by row"))
    np.testing.assert_array_equal(found.status, one_by_one.status)
    assert_same_pose(mechanism, found.pose, one_by_one.pose, 1e-9)
    reached = found.status == Status.REACHED
    assert reached.sum() > n / 4 and not np.array_equal(found.pose, one_by_one.pose), "no rows were answered in blocks"
    assert (found.residual[reached] <= 1e-11 * mechanism.characteristic_length).all()


def assembled_anywhere(mechanism: pf.Mechanism, n: int) -> tuple[pf.Solution, np.ndarray]:
    """Configurations in whatever working modes random actuator values have; and a turn for each angle among these."""
    turns = np.array([2.0 * np.pi * (drive.kind == "angle") for drive in mechanism.drives])
    span = np.where(turns > 0.0, 1.5, 0.5 * mechanism.characteristic_length)
    values = home_values(mechanism) + np.random.default_rng(0).uniform(-span, span, (n, len(span)))
    found = pf.solve_fk(mechanism, values)
    return found[np.asarray(found.status) == Status.REACHED], turns


@pytest.mark.parametrize("make", [lambda: pf.load("five_bar"), lambda: pf.load("delta"), closure.scara])
def test_an_assembled_configuration_is_in_the_working_mode_that_its_actuators_tell(make: Any) -> None:
    """Values may take an elbow past its dead point; who starts there stays there."""
    mechanism = make().without_limits()
    found, turns = assembled_anywhere(mechanism, 6 if INTERPRETED else 40)
    answer = pf.solve_ik(mechanism, found.pose, start=found)
    away = np.abs(answer.actuators - found.actuators)
    assert bool(answer) and np.minimum(away, np.abs(turns - away)).max() <= 1e-6


@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
@pytest.mark.parametrize("make", [closure.h4, closure.par4])
def test_a_joint_vector_is_in_the_working_mode_that_its_joints_tell(make: Any) -> None:
    """That of a leg on an arm is told with the arm where it is."""
    mechanism = make().without_limits()
    found, turns = assembled_anywhere(mechanism, 4 if INTERPRETED else 40)
    answer = pf.solve_ik(mechanism, found.pose, start=found.q)
    away = np.abs(answer.actuators - found.actuators)
    assert bool(answer) and np.minimum(away, np.abs(turns - away)).max() <= 1e-6


# --- values that cannot be -------------------------------------------------------------------------------------------


def test_strokes_outside_their_range_are_projected_onto_it() -> None:
    """All six struts asked for 290: 280 is the most, straight up, and the nearest in every strut."""
    mechanism = machine("stewart")
    asked = np.full(6, 290.0)
    answer = pf.solve_fk(mechanism, asked)
    assert answer.status is Status.PROJECTED
    assert not answer
    assert_feasible(mechanism, answer)
    assert answer.actuator_error == pytest.approx(10.0 / mechanism.characteristic_length, rel=1e-6)
    height = np.sqrt(280.0**2 - 60.0**2 - 20.0**2)
    np.testing.assert_allclose(answer.pose, pf.pose([0, 0, height]), rtol=0, atol=1e-4)
    assert {limit.joint for limit in answer.active_limits} == set(mechanism.actuator_names)
    assert {limit.bound for limit in answer.active_limits} == {"max"}


@pytest.mark.parametrize("beyond, status", [(-1e-6, Status.REACHED), (1e-6, Status.PROJECTED)])
def test_the_end_of_a_stroke_is_tested_on_both_sides(beyond: float, status: Status) -> None:
    mechanism = machine("stewart")
    asked = np.full(6, 280.0 + beyond * mechanism.characteristic_length)
    answer = pf.solve_fk(mechanism, asked)
    assert answer.status is status
    assert_feasible(mechanism, answer)


def test_one_stroke_outside_is_named_and_the_others_are_kept() -> None:
    """Struts of 165 and one of 155, its least, are well within the cones: the nearest to 150, whatever the measure."""
    mechanism = machine("stewart")
    asked = np.array([165.0, 150.0, 165.0, 165.0, 165.0, 165.0])
    answer = pf.solve_fk(mechanism, asked)
    assert answer.status is Status.PROJECTED
    assert_feasible(mechanism, answer)
    assert answer.actuator_error == pytest.approx(5.0 / mechanism.characteristic_length, rel=1e-6)
    assert [(limit.joint, limit.bound) for limit in answer.active_limits] == [(mechanism.actuator_names[1], "min")]


def test_a_stroke_that_the_cones_do_not_allow_is_projected() -> None:
    """One strut of 150 among struts of 205 would turn the platform out of its cones, at its least stroke as well."""
    mechanism = machine("stewart")
    asked = home_values(mechanism)
    asked[1] = 150.0
    answer = pf.solve_fk(mechanism, asked)
    assert answer.status is Status.PROJECTED
    assert_feasible(mechanism, answer)
    assert answer.actuator_error > 5.0 / mechanism.characteristic_length
    assert any(limit.bound == "cone" for limit in answer.active_limits)


def test_limits_of_passive_joints_are_kept() -> None:
    """Strut lengths within their strokes whose platform would exceed a cone."""
    mechanism = machine("stewart")
    cones = {joint.name: None for joint in mechanism.joints if joint.cone is not None}
    rng = np.random.default_rng(10)
    free = mechanism.with_limits(cones)
    drawn = oracles.random_targets(mechanism, rng, 4000)
    held = (oracles.margin(free, drawn) >= 0.02) & (oracles.margin(mechanism, drawn) < -0.05)
    lengths = oracles.actuators(mechanism, drawn[held][: 5 if INTERPRETED else 40])
    answer = pf.solve_fk(mechanism, lengths)
    assert_feasible(mechanism, answer)
    assert (answer.status == Status.PROJECTED).mean() >= 0.9  # the others are within limits in another assembly mode
    for status, limits in zip(answer.status, answer.active_limits, strict=True):
        assert status == Status.REACHED or limits
    assert any(limit.bound == "cone" for limits in answer.active_limits for limit in limits)


def test_elbows_too_far_apart_come_together() -> None:
    """Cranks of a 5-bar turned outwards, whose forearms do not meet; the nearest ones that let them, by a grid."""
    mechanism = machine("five_bar")
    asked = np.radians([60.0, -60.0])
    assert assembly.five_bar_tips(mechanism, asked) == []
    answer = pf.solve_fk(mechanism, asked)
    assert answer.status is Status.PROJECTED
    assert_feasible(mechanism, answer)
    y, z = np.meshgrid(np.linspace(-150.1, 150, 121), np.linspace(0.1, 250, 101))
    targets = oracles.poses(np.stack([0 * y.ravel(), y.ravel(), z.ravel()], axis=1))
    inside = targets[oracles.margin(mechanism, targets) >= 0]
    nearest = np.linalg.norm(oracles.actuators(mechanism, inside) - asked, axis=1).min()
    assert np.linalg.norm(answer.actuators - asked) <= 1.05 * nearest


def test_struts_too_short_to_meet_end_in_a_closed_machine() -> None:
    case = PUBLISHED["sauer_p2_5"]
    geometry = assembly.Planar3RPR(**case["geometry"])
    mechanism, _ = published.planar_3rpr(geometry, case["p"])
    asked = np.array([5.0, 3.0, 3.0])
    answer = pf.solve_fk(mechanism, asked)
    assert answer.status is Status.PROJECTED
    assert_feasible(mechanism, answer)
    transition = PUBLISHED["sauer_intervals"]["transitions_p2_from_to"][0][0]
    assert np.linalg.norm(deviation(mechanism, answer.actuators, asked)) <= 1.01 * (
        (transition - 3.0) / mechanism.characteristic_length
    )


def test_twelve_values_that_agree_give_the_pose() -> None:
    mechanism = machine("nrpm")
    targets = oracles.inside_targets(mechanism, np.random.default_rng(11), 10 if INTERPRETED else 100, least=0.02)
    values = oracles.actuators(mechanism, targets)
    answer = pf.solve_fk(mechanism, values)
    assert_feasible(mechanism, answer)
    assert is_same_pose(mechanism, answer.pose, targets).mean() >= 0.99


@pytest.mark.parametrize("name", ["seven_struts", "four_rails"])
def test_more_readings_than_freedoms_that_agree_are_reached_from_home(name: str) -> None:
    """Of poses far from home too, where Newton's method alone strays."""
    mechanism, readings = getattr(published, name)(), getattr(published, f"{name}_readings")
    poses, values = readings(np.random.default_rng(1), 10 if INTERPRETED else 100)
    answer = pf.solve_fk(mechanism, values)
    assert (answer.status == Status.REACHED).all()
    assert_feasible(mechanism, answer)
    assert_same_pose(mechanism, answer.pose, poses)


@pytest.mark.parametrize("name", ["seven_struts", "four_rails"])
def test_more_readings_than_freedoms_that_nearly_agree_are_answered_as_nearly(name: str) -> None:
    """The nearest feasible values are no farther than the exact readings that the noise was added to."""
    mechanism, readings = getattr(published, name)(), getattr(published, f"{name}_readings")
    rng = np.random.default_rng(2)
    _, exact = readings(rng, 5 if INTERPRETED else 30)
    asked = exact + rng.normal(0.0, 1e-3, exact.shape) * mechanism.characteristic_length
    answer = pf.solve_fk(mechanism, asked)
    assert_feasible(mechanism, answer)
    assert (answer.status == Status.PROJECTED).all()
    errors = [np.linalg.norm(deviation(mechanism, values, asked), axis=1) for values in (answer.actuators, exact)]
    assert (errors[0] <= errors[1] + 1e-9).all()


def test_an_arm_of_a_redundant_machine_is_not_turned_beyond_its_range() -> None:
    mechanism = machine("nrpm")
    asked = home_values(mechanism)
    asked[mechanism.actuator_names.index("A1")] = np.radians(150.0)
    answer = pf.solve_fk(mechanism, asked)
    assert answer.status is Status.PROJECTED
    assert_feasible(mechanism, answer)
    assert answer.actuator_error >= np.radians(15.0) - 1e-9


def test_twelve_values_within_their_ranges_that_cannot_be_assembled_are_projected() -> None:
    """Arms leaning out at full length put the crossbars' ends 242 from the axis, the platform's are 78 from its own.

    Summed over the legs, outwards, a platform wherever it is leaves gaps of 164 on average; the struts are 95 long.
    """
    mechanism = machine("nrpm")
    asked = home_values(mechanism)
    for column, name in enumerate(mechanism.actuator_names):
        low, high = mechanism.joint(name).range
        asked[column] = high if name[0] in "AB" else low
    answer = pf.solve_fk(mechanism, asked)
    assert answer.status is Status.PROJECTED
    assert_feasible(mechanism, answer)
    assert checks.gap_of_joints(mechanism, answer).max() <= 1e-8
    assert answer.actuator_error > 0.01


# --- calls -----------------------------------------------------------------------------------------------------------


def test_batch_axes_come_first_on_every_field_in_both_directions() -> None:
    mechanism = machine("stewart")
    answers = (
        pf.solve_fk(mechanism, np.tile(home_values(mechanism), (2, 3, 1))),
        pf.solve_ik(mechanism, np.tile(mechanism.home_pose, (2, 3, 1, 1))),
    )
    shapes = {"BL1": (2, 3), "AL1": (2, 3, 2), "CL1": (2, 3, 3)}
    for answer in answers:
        for name in ("status", "residual", "limit_excess", "actuator_error", "iterations"):
            assert np.shape(getattr(answer, name)) == (2, 3), name
        assert (len(answer), answer.pose.shape, answer.actuators.shape) == (2, (2, 3, 4, 4), (2, 3, 6))
        assert answer.points["CL1"].shape == (2, 3, 3)
        assert {name: answer.joints[name].shape for name in shapes} == shapes
        assert pf.closure_residual(answer).shape == (2, 3)
        assert answer[1].status.shape == (3,)
        assert answer[1][2].status is Status.REACHED and np.shape(answer[1][2].joints["BL1"]) == ()
    assert pf.solve_fk(mechanism, np.empty((0, 6))).pose.shape == (0, 4, 4)
    assert pf.solve_ik(mechanism, np.empty((0, 4, 4))).pose.shape == (0, 4, 4)


def test_integers_lists_and_strided_arrays_are_values() -> None:
    mechanism = machine("stewart")
    asked = np.tile(home_values(mechanism), (3, 1))
    expected = pf.solve_fk(mechanism, asked).pose
    np.testing.assert_array_equal(pf.solve_fk(mechanism, np.asfortranarray(asked)).pose, expected)
    np.testing.assert_array_equal(pf.solve_fk(mechanism, np.repeat(asked, 2, axis=1)[:, ::2]).pose, expected)
    np.testing.assert_array_equal(pf.solve_fk(mechanism, [205] * 6).pose, pf.solve_fk(mechanism, [205.0] * 6).pose)


def test_actuators_are_given_by_name_in_any_order() -> None:
    """One number each, or a batch; a single number goes with every row."""
    mechanism = machine("stewart")
    values = home_values(mechanism) + np.random.default_rng(8).uniform(-5, 5, (3, 6))
    values[:, 0] = values[0, 0]
    by_name = dict(zip(reversed(mechanism.actuator_names), values.T[::-1], strict=True))
    expected = pf.solve_fk(mechanism, values)
    np.testing.assert_array_equal(pf.solve_fk(mechanism, by_name).pose, expected.pose)
    by_name[mechanism.actuator_names[0]] = values[0, 0]
    np.testing.assert_array_equal(pf.solve_fk(mechanism, by_name).pose, expected.pose)
    one = pf.solve_fk(mechanism, {name: float(np.ravel(value)[0]) for name, value in by_name.items()})
    assert one.shape == ()
    np.testing.assert_array_equal(one.pose, expected.pose[0])


def test_values_beyond_the_bound_of_a_wheel_are_not_answered_a_turn_away() -> None:
    """A range that is wider than a turn has ends all the same, and the one nearby is nearer than a turn."""
    wheel = pf.load("five_bar").with_limits(p1=(-0.5, 1e4))
    found = pf.solve_fk(wheel, [[-0.7, -0.1], [0.3, 0.1], [-3.0, -0.1]])
    assert found.status.tolist() == [pf.Status.PROJECTED, pf.Status.REACHED, pf.Status.PROJECTED]
    np.testing.assert_allclose(found.actuators, [[-0.5, -0.1], [0.3, 0.1], [-0.5, -0.1]], rtol=0, atol=1e-6)
    assert [[(limit.joint, limit.bound) for limit in row] for row in found.active_limits] == [
        [("p1", "min")],
        [],
        [("p1", "min")],
    ]
