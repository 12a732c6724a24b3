"""Forward kinematics: published answers, inverse kinematics and back, and the nearest where values cannot be.

That answers are closed, feasible and at the values asked for is in `test_matrix`; modes are in `test_modes_kept` and
`test_assembly_modes`.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import checks
import oracles
import pfabrik as pf
from checks import INTERPRETED, actuator_units, assert_feasible, home_values, pose_errors
from machines import machine, published
from machines.published import PUBLISHED
from oracles import assembly
from pfabrik import Mechanism, Status


@pytest.mark.parametrize("name", ["stewart", "nrpm", "five_bar", "tripod_rps", "hexaglide", "planar_rrr"])
def test_the_check_of_joints_accepts_home_and_notices_one_wrong_joint(name: str) -> None:
    mechanism = machine(name)
    joints = [joint.name for joint in mechanism.joints if joint.type != "fixed"]
    home = {name: np.array(mechanism.home_coordinate(name), dtype=float) for name in joints}
    points = {joint.name: np.array(joint.at) for joint in mechanism.joints if joint.at is not None}

    def answer_with(joints: dict[str, np.ndarray]) -> Any:
        answer = type("Answer", (), {"shape": (), "points": points})()
        answer.pose, answer.actuators, answer.joints = mechanism.home_pose, home_values(mechanism), joints
        return answer

    assert checks.gap_of_joints(mechanism, answer_with(home)).max() <= 1e-12
    for joint in home.keys() - {mechanism.end_effector}:
        answer = answer_with(home | {joint: home[joint] + 0.01})
        assert checks.gap_of_joints(mechanism, answer).max() > 1e-6


# --- published answers -----------------------------------------------------------------------------------------------


def published_rows() -> list[tuple[Mechanism, np.ndarray, list[float], float]]:
    """Machines, poses, lengths and how exactly these are published."""
    conroy, linuxcnc, lee_shah = (PUBLISHED[name] for name in ("gsp_conroy", "gsp_linuxcnc_home", "rps_leeshah"))
    rows = []
    hexapod = published.published_gough("gsp_conroy", conroy["rows_p_rpy_L"][0][0])
    for p, rpy, lengths in conroy["rows_p_rpy_L"]:
        rows.append((hexapod, pf.pose(p, rpy=rpy), lengths, 1e-4))
    controller = published.published_gough("gsp_linuxcnc_home", linuxcnc["p"])
    rows.append((controller, pf.pose(linuxcnc["p"]), linuxcnc["L"], linuxcnc["tol"]))
    radii = [lee_shah["geometry"][name] for name in ("base_radius", "platform_radius")]
    for row in lee_shah["rows_a_b_pz_px_py_d1_d2_d3"]:
        rows.append((published.rps(*radii, 200.0), published.lee_shah_pose(row), row[5:], 1e-7))
    return rows


@pytest.mark.parametrize(("mechanism", "pose", "lengths", "digits"), published_rows())
def test_published_poses_and_lengths_belong_together_both_ways(
    mechanism: Mechanism, pose: np.ndarray, lengths: list[float], digits: float
) -> None:
    inverse, forward = pf.solve_ik(mechanism, pose), pf.solve_fk(mechanism, lengths)
    assert inverse and forward
    np.testing.assert_allclose(inverse.actuators, lengths, rtol=0, atol=digits)
    np.testing.assert_allclose(forward.pose, pose, rtol=0, atol=digits)


# --- there and back --------------------------------------------------------------------------------------------------


def tilted_targets(mechanism: Mechanism, rng: np.random.Generator, n: int, tilt: float) -> np.ndarray:
    """Poses within the workspace, turned by up to `tilt` [rad] about any axis."""
    turns = rng.normal(size=(40 * n, 3))
    turns *= (rng.uniform(0, tilt, len(turns)) / np.linalg.norm(turns, axis=1))[:, None]
    steps = rng.uniform(-0.6, 0.6, turns.shape) * mechanism.characteristic_length
    poses = oracles.poses(mechanism.reference_point + steps, Rotation.from_rotvec(turns).as_matrix())
    return poses[oracles.margin(mechanism, poses) >= 0][:n]


@pytest.mark.parametrize("count", [10 if INTERPRETED else 150, pytest.param(10_000, marks=pytest.mark.campaign)])
@pytest.mark.parametrize(("name", "tilt"), [("five_bar", 0), ("stewart", 0), ("nrpm", 0), ("stewart", 30)])
def test_forward_after_inverse_returns_the_pose_mostly_from_home_and_always_from_near_by(
    name: str, tilt: float, count: int
) -> None:
    mechanism, rng = machine(name), np.random.default_rng(6)
    if tilt:
        targets = tilted_targets(mechanism, rng, count, np.radians(tilt))
    else:
        targets = oracles.inside_targets(mechanism, rng, count)
    there = pf.solve_ik(mechanism, targets)
    back = pf.solve_fk(mechanism, there.actuators)
    assert there
    assert_feasible(mechanism, back)
    assert (pose_errors(mechanism, back.pose, there.pose) <= 1e-6).mean() >= (0.99 if count < 1000 else 0.999)
    targets[:, :3, 3] += rng.normal(size=(len(targets), 3)) * 2e-3 * mechanism.characteristic_length
    near = pf.solve_ik(mechanism, targets, start=there)
    again = pf.solve_fk(mechanism, there.actuators, start=near)
    assert again and pose_errors(mechanism, again.pose, there.pose).max() <= 1e-6


@pytest.mark.parametrize("name", ["stewart", "rps"])
def test_where_the_reference_point_is_does_not_change_what_assembles(name: str) -> None:
    """A telescope's mirror turns about a point hundreds of times as far away as its hexapod is large."""
    near, rng = pf.load(name), np.random.default_rng(2)
    lever = 300.0 * near.characteristic_length * np.array([0.6, 0.0, 0.8])
    far = dataclasses.replace(near, reference_point=near.reference_point + lever)
    values = home_values(near) + rng.uniform(-0.2, 0.2, (20, len(near.actuator_names))) * near.characteristic_length
    answers, others = (pf.solve_fk(each, values) for each in (near, far))
    reached = answers.status == Status.REACHED
    np.testing.assert_array_equal(reached, others.status == Status.REACHED)
    assert reached.sum() >= 5
    np.testing.assert_allclose(others.pose[reached, :3, :3], answers.pose[reached, :3, :3], atol=1e-9)


def test_a_seed_keeps_its_assembly_mode() -> None:
    case = PUBLISHED["sauer_p2_5"]
    geometry, values = assembly.Planar3RPR(**case["geometry"]), np.add(case["p"], 0.01)
    mechanism, home = published.planar_3rpr(geometry, case["p"])
    modes = pf.assembly_modes(mechanism, case["p"])
    assert len(modes) == 4
    expected = [published.planar_pose(each, home) for each in geometry.solutions(values)]
    for mode in modes:
        answer = pf.solve_fk(mechanism, values, start=mode)
        nearest = min(expected, key=lambda pose: np.abs(pose - mode.pose).max())
        assert answer.status is Status.REACHED
        np.testing.assert_allclose(answer.pose, nearest, rtol=0, atol=1e-8)


@pytest.mark.parametrize("has_starts", [False, True])
@pytest.mark.parametrize("name", ["stewart", "delta", "reachy_mini"])
def test_blocks_of_rows_answer_as_newton_row_by_row_and_as_single_rows(
    name: str, has_starts: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Within reach, at ends of ranges and where legs do not meet; in the same assemblies, though these may be near."""
    mechanism, rng, n = pf.load(name), np.random.default_rng(4), 40 if INTERPRETED else 600
    values, units = home_values(mechanism), actuator_units(mechanism)
    values = values + rng.uniform(-0.25, 0.25, (n, 1)) * rng.uniform(0.0, 1.0, (n, len(values))) * units
    values[:20] += rng.uniform(-0.5, 0.5, values[:20].shape) * units

    def answers(machine: Mechanism) -> tuple[pf.Solution | None, pf.Solution]:
        start = pf.solve_fk(machine, np.roll(values, 20, axis=0)) if has_starts else None
        return start, pf.solve_fk(machine, values, start=start)

    start, answer = answers(mechanism)
    for row in range(0, n, n // 10):
        alone = pf.solve_fk(mechanism, values[row], start=None if start is None else start[row])
        assert (alone.status, alone.residual) == (answer.status[row], answer.residual[row])
        np.testing.assert_array_equal(alone.pose, answer.pose[row])
    monkeypatch.setattr("pfabrik.engines.pose.single.places_of_rods", lambda model: None)
    _, one_by_one = answers(dataclasses.replace(mechanism, name="row by row"))
    np.testing.assert_array_equal(answer.status, one_by_one.status)
    assert pose_errors(mechanism, answer.pose, one_by_one.pose).max() <= 1e-8
    reached = answer.status == Status.REACHED
    assert reached.sum() > n / 4 and not np.array_equal(answer.pose, one_by_one.pose), "no rows were answered in blocks"
    assert (answer.residual[reached] <= 1e-11 * mechanism.characteristic_length).all()


# --- values that cannot be: the nearest that can ---------------------------------------------------------------------


def distances(mechanism: Mechanism, values: np.ndarray, asked: np.ndarray) -> np.ndarray:
    """How far actuator values are from others, by least squares [L and rad]."""
    return np.linalg.norm((values - asked) / actuator_units(mechanism), axis=-1)


def test_strokes_outside_their_range_are_projected_onto_it() -> None:
    """All six struts asked for 290: 280 is the most, straight up, and the nearest in every strut."""
    mechanism = machine("stewart")
    answer = pf.solve_fk(mechanism, np.full(6, 290.0))
    assert answer.status is Status.PROJECTED
    assert answer.actuator_error == pytest.approx(10.0 / mechanism.characteristic_length, rel=1e-6)
    height = np.sqrt(280.0**2 - 60.0**2 - 20.0**2)
    np.testing.assert_allclose(answer.pose, pf.pose([0, 0, height]), rtol=0, atol=1e-4)
    limits = {(limit.joint, limit.bound) for limit in answer.active_limits}
    assert limits == {(name, "max") for name in mechanism.actuator_names}


@pytest.mark.parametrize("beyond, status", [(-1e-6, Status.REACHED), (1e-6, Status.PROJECTED)])
def test_the_end_of_a_stroke_is_tested_on_both_sides(beyond: float, status: Status) -> None:
    mechanism = machine("stewart")
    answer = pf.solve_fk(mechanism, np.full(6, 280.0 + beyond * mechanism.characteristic_length))
    assert answer.status is status


def test_one_stroke_outside_is_named_and_the_others_are_kept() -> None:
    """Struts of 165 and one of 155, its least, are well within the cones: the nearest to 150, whatever the measure."""
    mechanism = machine("stewart")
    answer = pf.solve_fk(mechanism, [165.0, 150.0, 165.0, 165.0, 165.0, 165.0])
    assert answer.status is Status.PROJECTED
    assert answer.actuator_error == pytest.approx(5.0 / mechanism.characteristic_length, rel=1e-6)
    assert [(limit.joint, limit.bound) for limit in answer.active_limits] == [(mechanism.actuator_names[1], "min")]


def test_elbows_too_far_apart_come_together() -> None:
    """Cranks of a 5-bar turned outwards, whose forearms do not meet; the nearest ones that let them, by a grid."""
    mechanism, asked = machine("five_bar"), np.radians([60.0, -60.0])
    assert assembly.five_bar_tips(mechanism, asked) == []
    answer = pf.solve_fk(mechanism, asked)
    assert answer.status is Status.PROJECTED
    y, z = np.meshgrid(np.linspace(-150.1, 150, 121), np.linspace(0.1, 250, 101))
    targets = oracles.poses(np.stack([0 * y.ravel(), y.ravel(), z.ravel()], axis=1))
    inside = targets[oracles.margin(mechanism, targets) >= 0]
    nearest = distances(mechanism, oracles.actuators(mechanism, inside), asked).min()
    assert distances(mechanism, answer.actuators, asked) <= 1.05 * nearest


def test_struts_too_short_to_meet_end_where_they_first_do() -> None:
    case = PUBLISHED["sauer_p2_5"]
    mechanism, _ = published.planar_3rpr(assembly.Planar3RPR(**case["geometry"]), case["p"])
    asked = np.array([5.0, 3.0, 3.0])
    answer = pf.solve_fk(mechanism, asked)
    assert answer.status is Status.PROJECTED
    assert_feasible(mechanism, answer)
    transition = PUBLISHED["sauer_intervals"]["transitions_p2_from_to"][0][0]
    most = 1.01 * (transition - 3.0) / mechanism.characteristic_length
    assert distances(mechanism, answer.actuators, asked) <= most


@pytest.mark.parametrize("name", ["seven_struts", "four_rails"])
def test_more_readings_than_freedoms_are_reached_if_they_agree_and_else_answered_as_nearly(name: str) -> None:
    """Of poses far from home too, where Newton's method alone strays; no farther than exact readings from noisy."""
    mechanism, rng = getattr(published, name)(), np.random.default_rng(1)
    poses, values = getattr(published, f"{name}_readings")(rng, 10 if INTERPRETED else 100)
    answer = pf.solve_fk(mechanism, values)
    assert (answer.status == Status.REACHED).all()
    assert pose_errors(mechanism, answer.pose, poses).max() <= 1e-6
    exact = values[:20]
    noisy = exact + rng.normal(0.0, 1e-3, exact.shape) * mechanism.characteristic_length
    answer = pf.solve_fk(mechanism, noisy)
    assert_feasible(mechanism, answer)
    assert (answer.status == Status.PROJECTED).all()
    assert (distances(mechanism, answer.actuators, noisy) <= distances(mechanism, exact, noisy) + 1e-9).all()


def test_values_beyond_the_bound_of_a_wheel_are_not_answered_a_turn_away() -> None:
    """A range that is wider than a turn has ends all the same, and the one nearby is nearer than a turn."""
    wheel = pf.load("five_bar").with_limits(p1=(-0.5, 1e4))
    answer = pf.solve_fk(wheel, [[-0.7, -0.1], [0.3, 0.1], [-3.0, -0.1]])
    assert answer.status.tolist() == [Status.PROJECTED, Status.REACHED, Status.PROJECTED]
    np.testing.assert_allclose(answer.actuators, [[-0.5, -0.1], [0.3, 0.1], [-0.5, -0.1]], rtol=0, atol=1e-6)
    bounds = [[(limit.joint, limit.bound) for limit in row] for row in answer.active_limits]
    assert bounds == [[("p1", "min")], [], [("p1", "min")]]


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


def test_values_are_given_as_any_array_or_by_name_in_any_order() -> None:
    """By name one number each, or a batch; a single number goes with every row."""
    mechanism = machine("stewart")
    names, values = mechanism.actuator_names, np.tile([205, 204, 206, 203, 207, 205], (3, 1))
    values[:, 1] += (0, 1, 2)
    by_name = dict(zip(reversed(names), values.T[::-1], strict=True))
    expected = pf.solve_fk(mechanism, values.astype(float)).pose
    strided = np.repeat(values, 2, axis=1)[:, ::2]
    for given in (values, values.tolist(), np.asfortranarray(values), strided, by_name, by_name | {names[0]: 205}):
        np.testing.assert_array_equal(pf.solve_fk(mechanism, given).pose, expected)
    one = pf.solve_fk(mechanism, {name: float(column[0]) for name, column in by_name.items()})
    assert one.shape == ()
    np.testing.assert_array_equal(one.pose, expected[0])
