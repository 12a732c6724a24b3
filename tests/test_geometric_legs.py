"""Closed forms leg by leg: against distances measured from scratch, published tables and the solver; all branches."""

from __future__ import annotations

import dataclasses
import json
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from pfabrik import Joint, Mechanism
from pfabrik.errors import InvalidArgument, NoClosedForm
from pfabrik.geometric.facts import home_values
from pfabrik.geometric.modes import legs_of, solve_legs
from pfabrik.tolerances import TOLERANCES

INTERPRETED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
PUBLISHED = json.loads((Path(__file__).parent / "data" / "published_cases.json").read_text(encoding="utf-8"))
Array = np.ndarray

MODES = {
    "agile_eye": 8,
    "ankle_rss": 4,
    "ankle_ups": 2,  # half a turn of the pivot about both axes, too
    "canfield": 8,
    "delta": 8,
    "five_bar": 4,
    "hexaglide": 64,
    "linear_delta": 8,
    "nrpm": None,  # redundant
    "orthoglide": 8,
    "prr": 8,
    "prs": 8,
    "psu": 8,
    "rpr": 1,
    "rps": 2,  # turned by half a turn, too
    "rrr": 8,
    "serial_arm": None,  # one leg, driven four times
    "servo_hexapod": 64,
    "stewart": 1,
    "tricept": 2,
    "ucu": 1,
}
"""How many working modes every machine of the catalogue has at home: two a crank or carriage, and of a target that sets
a part only perhaps two poses; None where they have no closed form."""
SOLVED = [name for name, modes in MODES.items() if modes is not None]
DRIVEN = {
    "agile_eye": [("A", "B", "C")],
    "ankle_rss": [("A", "B", "C")],
    "canfield": [("A", "B", "C")],
    "delta": [("A", "BL", "CL"), ("A", "BR", "CR")],
    "five_bar": [("p1", "p2", "p3"), ("p5", "p4", "p3")],
    "hexaglide": [("AL", "BL", "CL"), ("AR", "BR", "CR")],
    "linear_delta": [("A", "BL", "CL"), ("A", "BR", "CR")],
    "orthoglide": [("A", "CL", "DL"), ("A", "CR", "DR")],
    "prr": [("A", "B", "C")],
    "prs": [("A", "B", "C")],
    "psu": [("A", "BL", "CL"), ("A", "BR", "CR")],
    "rrr": [("A", "B", "C")],
    "servo_hexapod": [("AL", "BL", "CL"), ("AR", "BR", "CR")],
}
"""Rods: the driven joint on the base, the joint that it moves, and the joint on the end effector (of the Orthoglide,
both joints of a rod, as they lie on the axes of the hinges beyond)."""
STRUTS = {"ankle_ups": ("A", "C"), "rpr": ("A", "C"), "rps": ("A", "C"), "stewart": ("A", "C"), "tricept": ("A", "C")}
SUFFIXES = ("", "1", "2", "3", "L", "R")


def rods(mechanism: Mechanism, name: str) -> list[tuple[Joint, Joint, Joint]]:
    known = {joint.name: joint for joint in mechanism.joints}
    named = [tuple(each + suffix for each in rod) for rod in DRIVEN[name] for suffix in SUFFIXES]
    return [tuple(known[each] for each in rod) for rod in named if set(rod) <= set(known)]


def on_end_effector(mechanism: Mechanism, joint: Joint, poses: Array) -> Array:
    """Where joints of the end effector are, (n, 3)."""
    if mechanism.end_effector_is_joint:
        return poses[:, :3, 3]
    return poses[:, :3, :3] @ np.subtract(joint.at, mechanism.reference_point) + poses[:, :3, 3]


def moved(mechanism: Mechanism, driver: Joint, joint: Joint, values: Array) -> Array:
    """Where a driven joint on the base takes another joint, (n, 3)."""
    by = values - mechanism.home_coordinate(driver.name)
    by = by if driver.connects[0] == mechanism.base else -by
    if driver.type == "prismatic":
        return np.array(joint.at) + by[:, None] * np.array(driver.axis)
    turn = Rotation.from_rotvec(by[:, None] * np.array(driver.axis)).as_matrix()
    return turn @ np.subtract(joint.at, driver.at) + np.array(driver.at)


def misfits(mechanism: Mechanism, name: str, poses: Array, actuators: Array) -> Array:
    """How much any rod is too long or too short at poses (n, 4, 4) with actuators (n, n_a), (n, rods) [L]."""
    column = mechanism.actuator_names.index
    found = []
    for driver, foot, head in rods(mechanism, name):
        start = moved(mechanism, driver, foot, actuators[:, column(driver.name)])
        apart = np.linalg.norm(on_end_effector(mechanism, head, poses) - start, axis=1)
        found.append(np.abs(apart - np.linalg.norm(np.subtract(head.at, foot.at))))
    return np.stack(found, axis=1) / mechanism.characteristic_length


def some_targets(mechanism: Mechanism, n: int = 300, seed: int = 5) -> Array:
    """Poses about home's, some far off; of a plane machine in its plane."""
    rng = np.random.default_rng(seed)
    size, length = rng.uniform(0, 1, (n, 1)), mechanism.characteristic_length
    targets = np.tile(np.eye(4), (n, 1, 1))
    targets[:, :3, 3] = mechanism.reference_point + rng.uniform(-0.5, 0.5, (n, 3)) * length * size
    turns = rng.normal(size=(n, 3)) * 0.35 * size
    axes = {tuple(np.abs(joint.axis)) for joint in mechanism.joints if joint.type == "revolute"}
    plane = {joint.type for joint in mechanism.joints} <= {"revolute", "prismatic"} and len(axes) == 1
    if plane:
        normal = np.array(axes.pop())
        steps = targets[:, :3, 3] - mechanism.reference_point
        targets[:, :3, 3] -= np.outer(steps @ normal, normal)
        turns = np.outer(turns @ normal, normal) * 2.0
    targets[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix()
    return targets


# --- the catalogue ---------------------------------------------------------------------------------------------------


def test_every_machine_of_the_catalogue_is_in_the_table() -> None:
    assert sorted(MODES) == sorted(pf.catalog())
    assert set(DRIVEN) | set(STRUTS) | {"ucu"} == set(SOLVED)


@pytest.mark.parametrize("name", MODES)
def test_home_is_the_first_of_its_working_modes_and_the_answer(name: str) -> None:
    mechanism = pf.load(name)
    if MODES[name] is None:
        with pytest.raises(NoClosedForm):
            pf.geometric.working_modes(mechanism, mechanism.home_pose)
        return
    modes = pf.geometric.working_modes(mechanism, mechanism.home_pose)
    assert len(modes) == len(modes.poses) == len(modes.keeps_limits) == len(modes.branches) == MODES[name]
    assert modes.legs == tuple(str(chain) for chain in pf.decompose(mechanism))
    assert modes.keeps_limits[0]
    assert not modes.branches[0].any()
    assert modes.completions[0] == 0
    assert len(np.unique(np.column_stack([modes.completions, modes.branches]), axis=0)) == MODES[name]
    answer = pf.geometric.solve_ik(mechanism, mechanism.home_pose)
    for values, pose in ((modes.actuators[0], modes.poses[0]), (answer.actuators, answer.pose)):
        np.testing.assert_allclose(values, home_values(mechanism)[0], rtol=0, atol=1e-9)
        np.testing.assert_allclose(pose, mechanism.home_pose, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", DRIVEN)
def test_rods_keep_their_length_in_every_working_mode(name: str) -> None:
    mechanism = pf.load(name)
    found = [pf.geometric.working_modes(mechanism, target) for target in some_targets(mechanism, 8)]
    assert any(map(len, found))
    for modes in filter(len, found):
        assert misfits(mechanism, name, modes.poses, modes.actuators).max() < TOLERANCES.position
    wanted = some_targets(mechanism)
    answer = pf.geometric.solve_ik(mechanism, wanted)
    fits = misfits(mechanism, name, answer.pose[answer.reached], answer.actuators[answer.reached])
    assert fits.max() < TOLERANCES.position


@pytest.mark.parametrize("name", STRUTS)
def test_struts_are_as_long_as_their_ends_are_apart(name: str) -> None:
    mechanism = pf.load(name)
    wanted = some_targets(mechanism)
    answer = pf.geometric.solve_ik(mechanism, wanted)
    assert answer.reached.any()
    for column, strut in enumerate(mechanism.actuator_names):
        foot, head = (mechanism.joint(each + strut[1:]) for each in STRUTS[name])
        apart = on_end_effector(mechanism, head, answer.pose) - foot.at
        np.testing.assert_allclose(answer.actuators[:, column], np.linalg.norm(apart, axis=1), rtol=1e-12)


@pytest.mark.parametrize("name", SOLVED)
def test_the_forward_engine_returns_to_the_pose(name: str) -> None:
    """From actuators on a small ball about home to a pose, and back by the closed form."""
    mechanism = pf.load(name)
    scale = [
        mechanism.characteristic_length if mechanism.joint(each).type == "prismatic" else 1.0
        for each in mechanism.actuator_names
    ]
    values = home_values(mechanism) + np.random.default_rng(3).uniform(-0.1, 0.1, (20, len(scale))) * scale
    forward = pf.solve_fk(mechanism, values)
    forward = forward[forward.status == pf.Status.REACHED]
    assert len(forward) >= 15
    answer = pf.geometric.solve_ik(mechanism, forward.pose)
    assert answer
    np.testing.assert_allclose(answer.actuators, forward.actuators, rtol=0, atol=1e-8)
    np.testing.assert_allclose(answer.pose, forward.pose, rtol=0, atol=1e-8)


SLOW = {"delta", "psu"}


@pytest.mark.parametrize("name", [pytest.param(each, marks=[pytest.mark.slow] * (each in SLOW)) for each in SOLVED])
def test_the_solver_reaches_exactly_what_the_closed_form_reaches(name: str) -> None:
    mechanism = pf.load(name)
    wanted = some_targets(mechanism, 8 if INTERPRETED else 300)
    answer, solution = pf.geometric.solve_ik(mechanism, wanted), pf.solve_ik(mechanism, wanted)
    reached = solution.status == pf.Status.REACHED
    np.testing.assert_array_equal(answer.reached, reached)
    assert reached.any()
    length = mechanism.characteristic_length
    np.testing.assert_allclose(answer.actuators[reached], solution.actuators[reached], rtol=0, atol=1e-9 * length)
    np.testing.assert_allclose(answer.pose[reached], solution.pose[reached], rtol=0, atol=1e-9 * max(length, 1.0))
    assert np.isnan(answer.pose[~answer.reached]).all()
    assert np.isnan(answer.actuators[~answer.reached]).all()


@pytest.mark.parametrize("name", SOLVED)
def test_a_target_is_reached_exactly_where_a_working_mode_keeps_the_limits(name: str) -> None:
    mechanism = pf.load(name)
    wanted = some_targets(mechanism, 12, seed=8)
    answer = pf.geometric.solve_ik(mechanism, wanted)
    for row, target in enumerate(wanted):
        modes = pf.geometric.working_modes(mechanism, target)
        assert answer.reached[row] == modes.keeps_limits.any()
        if answer.reached[row]:
            apart = np.abs(modes.actuators - answer.actuators[row]).max(axis=1)
            assert apart[modes.keeps_limits].min() < 1e-9 * mechanism.characteristic_length


# --- published numbers -----------------------------------------------------------------------------------------------

TROSSEN = [[0, 19.403, 19.403, 19.403], [30, 20.743, 3.657, 35.155], [60, 24.721, -11.073, 50.524]]
TROSSEN += [[80, 28.8, -19.547, 60.563], [100, 34.009, -26.372, 70.524]]
"""x [mm] and the arms' angles [deg], 50 mm below level arms: the tests of DeltaCalculator.js, to 0.001 degrees."""
PRINTED = 1.1e-3


@pytest.mark.parametrize("row", TROSSEN)
def test_the_delta_turns_its_arms_as_printed(row: list[float]) -> None:
    mechanism = pf.load("delta")
    answer = pf.geometric.solve_ik(mechanism, mechanism.home_pose[:3, 3] + [row[0], 0, -50])
    assert answer
    np.testing.assert_allclose(np.degrees(answer.actuators), row[1:], rtol=0, atol=PRINTED)


@pytest.mark.parametrize("row", PUBLISHED["rps_leeshah"]["rows_a_b_pz_px_py_d1_d2_d3"])
def test_the_3rps_shifts_as_lee_and_shah_say(row: list[float]) -> None:
    azimuth, tilt, height, x, y, *lengths = row
    turn = Rotation.from_euler("zyz", [0.7 - azimuth, tilt, azimuth])  # whatever its torsion is
    answer = pf.geometric.solve_ik(pf.load("rps"), pf.pose([50, 60, height], rotation=turn))
    assert answer
    np.testing.assert_allclose(answer.pose[:3, 3], [x, y, height], rtol=0, atol=1e-9)
    untwisted = Rotation.from_euler("zyz", [-azimuth, tilt, azimuth]).as_matrix()
    np.testing.assert_allclose(answer.pose[:3, :3], untwisted, rtol=0, atol=1e-9)
    np.testing.assert_allclose(answer.actuators, lengths, rtol=0, atol=1e-8)


@pytest.mark.parametrize(
    "target, lengths",
    [([0, 0, 0], [310.5828541230249] * 3), ([50, -30, 20], [358.482915694, 275.87858584, 325.060173204])],
)
def test_the_orthoglide_slides_as_published(target: list[float], lengths: list[float]) -> None:
    answer = pf.geometric.solve_ik(pf.load("orthoglide"), target)
    np.testing.assert_allclose(answer.actuators, lengths, rtol=0, atol=1e-8)


def test_servo_angles_are_those_of_the_notebook() -> None:
    """Stewart_Py: a twist by 30 degrees at height 12.4; legs 1, 3, 5, then 2, 4, 6."""
    answer = pf.geometric.solve_ik(pf.load("servo_hexapod"), pf.pose([0, 0, 12.4], rpy=[0, 0, np.pi / 6]))
    np.testing.assert_allclose(answer.actuators, [0.60882972] * 3 + [0.22676629] * 3, rtol=0, atol=1e-8)


@pytest.mark.parametrize("p, rpy, lengths", PUBLISHED["gsp_conroy"]["rows_p_rpy_L"])
def test_struts_between_universal_joints_are_as_long_as_printed(p: Any, rpy: Any, lengths: Any) -> None:
    answer = pf.geometric.solve_ik(pf.load("ucu"), pf.pose(p, rpy=rpy))
    np.testing.assert_allclose(answer.actuators, [*lengths[::2], *lengths[1::2]], rtol=0, atol=6e-5)  # four digits


@pytest.mark.parametrize("theta, x, y", PUBLISHED["sauer_fig1_15"]["poses_theta_x_y"])
def test_struts_of_the_planar_platform_have_the_lengths_of_the_book(theta: float, x: float, y: float) -> None:
    home = PUBLISHED["sauer_fig1_15"]["poses_theta_x_y"][0][0]
    free = pf.load("rpr").without_limits()
    answer = pf.geometric.solve_ik(free, pf.pose([x, y, 0], rpy=[0, 0, theta - home]))
    np.testing.assert_allclose(answer.actuators, PUBLISHED["sauer_fig1_15"]["p"], rtol=0, atol=1e-12)


# --- machines of any shape -------------------------------------------------------------------------------------------

KINDS = ("R*-U-S", "R*-S-S", "P*-U-S", "P*-S-U", "U-P*-S", "S-P*-U")


def any_machine(seed: int, n_legs: int) -> Mechanism:
    """A platform on legs of various kinds, joints and axes wherever they happen to be."""
    rng = np.random.default_rng(seed)
    joints = []
    for leg in range(n_legs):
        chain = KINDS[rng.integers(len(KINDS))].split("-")
        foot, elbow = rng.uniform(-100, 100, 3), rng.uniform(-100, 100, 3)
        head = np.append(rng.uniform(-60, 60, 2), 250.0)
        points = [foot, head, head] if chain[1] == "P*" else [foot, elbow, head]
        names, last = [f"{letter}{leg}" for letter in "ABC"], len(chain) - 1
        for place, (letter, point) in enumerate(zip(chain, points, strict=True)):
            bodies = [
                "base" if place == 0 else f"l{leg}.{place}",
                "platform" if place == last else f"l{leg}.{place + 1}",
            ]
            bodies = bodies[:: rng.choice([-1, 1])]
            axis, driven = rng.normal(size=3), letter.endswith("*")
            if letter == "P*" and place == 1:
                joints.append(Joint(names[1], "prismatic", bodies, along=(names[0], names[2]), actuated=True))
            elif letter == "P*":
                joints.append(Joint(names[0], "prismatic", bodies, axis=axis, actuated=True))
            elif letter == "R*":
                joints.append(Joint(names[place], "revolute", bodies, at=point, axis=axis, actuated=driven))
            else:
                kind = {"U": "universal", "S": "spherical"}[letter]
                joints.append(Joint(names[place], kind, bodies, at=point))
    return Mechanism("any machine", joints, "platform", (5, -3, 240))


@pytest.mark.parametrize("seed", range(6))
def test_legs_of_any_shape_and_kind_are_mixed(seed: int) -> None:
    mechanism = any_machine(seed, n_legs=3 + seed % 4)
    wanted = some_targets(mechanism, 10 if INTERPRETED else 150, seed)
    answer, solution = pf.geometric.solve_ik(mechanism, wanted), pf.solve_ik(mechanism, wanted)
    np.testing.assert_array_equal(answer.reached, solution.status == pf.Status.REACHED)
    assert answer.reached.any()
    modes = pf.geometric.working_modes(mechanism, wanted[answer.reached][0])
    two = sum(joint.actuated and joint.along is None for joint in mechanism.joints)
    assert len(modes) == 2**two
    for poses, values in ((modes.poses, modes.actuators), (answer.pose, answer.actuators)):
        for column, driver in enumerate(map(mechanism.joint, mechanism.actuator_names)):
            foot, head = (mechanism.joint(letter + driver.name[1:]) for letter in ("AC" if driver.along else "BC"))
            start = np.array(foot.at) if driver.along else moved(mechanism, driver, foot, values[:, column])
            apart = np.linalg.norm(on_end_effector(mechanism, head, poses) - start, axis=1)
            expected = values[:, column] if driver.along else np.linalg.norm(np.subtract(head.at, foot.at))
            known = ~np.isnan(apart)
            np.testing.assert_allclose(apart[known], np.broadcast_to(expected, apart.shape)[known], rtol=1e-9)


@pytest.mark.parametrize("name", ["five_bar", "stewart"])
def test_leg_by_leg_is_the_same_as_compiled(name: str) -> None:
    mechanism = pf.load(name)
    wanted = some_targets(mechanism)
    plan = legs_of(mechanism)
    reached, actuators, _ = solve_legs(plan, wanted, plan.home_sides[None], np.zeros(1, dtype=int))
    compiled = pf.geometric.solve_ik(mechanism, wanted)
    np.testing.assert_array_equal(reached, compiled.reached)
    np.testing.assert_allclose(actuators, compiled.actuators, rtol=0, atol=1e-9)
    assert reached.any()


# --- branches --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name", ["rrr", "servo_hexapod", "linear_delta", "rps", "prs", "five_bar", "tricept", "agile_eye"]
)
def test_a_seed_keeps_its_working_mode(name: str) -> None:
    mechanism = pf.load(name).without_limits()
    target = some_targets(mechanism, 1, seed=4)[0] * 0.2 + mechanism.home_pose * 0.8
    target[:3, :3] = (Rotation.from_matrix(some_targets(mechanism, 1, seed=4)[0, :3, :3]) ** 0.3).as_matrix()
    modes = pf.geometric.working_modes(mechanism, target)
    assert len(modes) > 1
    seeds = SimpleNamespace(actuators=modes.actuators, pose=modes.poses)
    answer = pf.geometric.solve_ik(mechanism, np.tile(target, (len(modes), 1, 1)), start=seeds)
    assert answer
    np.testing.assert_allclose(answer.actuators, modes.actuators, rtol=0, atol=1e-7)
    np.testing.assert_allclose(answer.pose, modes.poses, rtol=0, atol=1e-7)
    for k in range(0, len(modes), 7):
        one = SimpleNamespace(actuators=modes.actuators[k], pose=modes.poses[k])
        again = pf.geometric.solve_ik(mechanism, target, start=one)
        np.testing.assert_allclose(again.actuators, modes.actuators[k], rtol=0, atol=1e-7)
    from_home = pf.geometric.solve_ik(mechanism, target)
    np.testing.assert_allclose(from_home.actuators, modes.actuators[0], rtol=0, atol=1e-7)


@pytest.mark.parametrize("leg", [0, 1, 2])
def test_only_the_leg_whose_branch_breaks_a_limit_changes_it(leg: int) -> None:
    free, tried = pf.load("rrr").without_limits(), 0
    for target in some_targets(free, 30):
        modes = pf.geometric.working_modes(free, target)
        alone = (modes.branches == np.eye(3, dtype=int)[leg]).all(axis=1)
        if not alone.any() or modes.actuators[0, leg] * modes.actuators[alone][0, leg] > 0:
            continue  # the limit below must allow 0, where home is, and forbid home's side of the leg
        away = modes.actuators[alone][0]
        low, high = sorted((0.0, away[leg]))
        answer = pf.geometric.solve_ik(free.with_limits({f"A{leg + 1}": (low - 1e-6, high + 1e-6)}), target)
        np.testing.assert_allclose(answer.actuators, away, rtol=0, atol=1e-9)
        tried += 1
    assert tried > 3


def test_a_mirrored_platform_is_the_image_of_the_base() -> None:
    """Canfield's joint: base and platform hinges are as far from every ball, and the balls' plane mirrors the tilt."""
    mechanism = pf.load("canfield")
    wanted = some_targets(mechanism, 100)
    answer = pf.geometric.solve_ik(mechanism, wanted)
    poses, values = answer.pose[answer.reached], answer.actuators[answer.reached]
    np.testing.assert_allclose(poses[:, :3, 2], wanted[answer.reached][:, :3, 2], rtol=0, atol=1e-12)
    np.testing.assert_allclose(poses[:, 2, 3], wanted[answer.reached][:, 2, 3], rtol=0, atol=1e-9)
    joints = [[mechanism.joint(f"{letter}{leg}") for letter in "ABC"] for leg in "123"]
    balls = [moved(mechanism, a, b, values[:, column]) for column, (a, b, _) in enumerate(joints)]
    normal = np.cross(balls[1] - balls[0], balls[2] - balls[0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    for a, _, c in joints:
        hinge = on_end_effector(mechanism, c, poses)
        image = np.array(a.at) - 2 * ((a.at - balls[0]) * normal).sum(axis=1)[:, None] * normal
        np.testing.assert_allclose(hinge, image, rtol=0, atol=1e-9)


def test_a_platform_on_three_hinged_legs_has_two_poses_in_their_planes() -> None:
    mechanism = pf.load("rps").without_limits()
    target = pf.pose([0, 0, 200], rpy=[0.1, 0.2, 0.3])
    modes = pf.geometric.working_modes(mechanism, target)
    assert modes.completions.tolist() == [0, 1]
    for pose in modes.poses:
        np.testing.assert_allclose(pose[:3, 2], target[:3, 2], rtol=0, atol=1e-12)
        assert pose[2, 3] == 200
        for leg in "123":
            ball = on_end_effector(mechanism, mechanism.joint(f"C{leg}"), pose[None])[0]
            hinge = mechanism.joint(f"A{leg}")
            assert abs((ball - hinge.at) @ np.array(hinge.axis)) < 1e-9
    assert np.linalg.norm(modes.poses[0] - modes.poses[1]) > 1.0


# --- degenerate cases ------------------------------------------------------------------------------------------------


def crank_machine(at_home: Any = (0, 0, 100)) -> Mechanism:
    """A tip on three cranks of 100 about level axes, each with a ball-jointed rod of 150."""
    joints = []
    for leg, angle in enumerate(np.radians([0, 120, 240]), 1):
        out, aside = np.array([np.cos(angle), np.sin(angle), 0]), np.array([-np.sin(angle), np.cos(angle), 0])
        hub = np.array([0, 0, 100]) + 200 * out
        joints += [
            Joint(f"A{leg}", "revolute", ("base", f"crank{leg}"), at=hub, axis=aside, actuated=True),
            Joint(f"B{leg}", "universal", (f"crank{leg}", f"rod{leg}"), at=hub + 100 * out * 0 + [0, 0, -100]),
            Joint(f"C{leg}", "spherical", (f"rod{leg}", "platform"), at=30 * out + at_home),
        ]
    return Mechanism("cranks", joints, "platform", at_home)


def reach_of(mechanism: Mechanism) -> float:
    rod = np.subtract(mechanism.joint("C1").at, mechanism.joint("B1").at)
    return float(np.linalg.norm(rod)) + 100.0


def only_leg(mechanism: Mechanism) -> Mechanism:
    """The first leg of a machine alone, which leaves the platform free to be anywhere."""
    joints = [joint for joint in mechanism.joints if joint.name.endswith("1")]
    return dataclasses.replace(mechanism, joints=tuple(joints))


def test_a_stretched_leg_has_one_branch_and_reaches_no_further() -> None:
    mechanism = only_leg(crank_machine())
    slack = TOLERANCES.position * mechanism.characteristic_length
    hub, arm = np.array(mechanism.joint("A1").at), np.subtract(mechanism.joint("C1").at, mechanism.reference_point)
    direction = np.array([-0.6, 0, 0.8])
    for beyond, modes in ((-1.0, 2), (0.0, 1), (0.4 * slack, 1), (3 * slack, 0)):
        target = hub + (reach_of(mechanism) + beyond) * direction - arm
        assert len(pf.geometric.working_modes(mechanism, target)) == modes
        assert pf.geometric.solve_ik(mechanism, target).reached is (modes > 0)
    answer = pf.geometric.solve_ik(mechanism, hub + reach_of(mechanism) * direction - arm)
    tip = moved(mechanism, mechanism.joint("A1"), mechanism.joint("B1"), answer.actuators[:1])[0]
    np.testing.assert_allclose(tip, hub + 100 * direction, rtol=0, atol=1e-5)  # a rounding's square root


def test_with_its_rod_on_the_axis_of_the_crank_every_angle_serves_and_homes_is_taken() -> None:
    plain = only_leg(crank_machine())
    hub, along = np.array(plain.joint("A1").at), np.array(plain.joint("A1").axis)
    rod = float(np.linalg.norm(np.subtract(plain.joint("C1").at, plain.joint("B1").at)))
    on_axis = hub + along * np.sqrt(rod**2 - 100**2) - np.subtract(plain.joint("C1").at, plain.reference_point)
    answer = pf.geometric.solve_ik(plain, on_axis)
    assert answer
    assert abs(answer.actuators[0]) < 1e-5  # what is left of the axis decides, within rounding
    assert not pf.geometric.solve_ik(plain, on_axis + 0.01 * along)


def carriage() -> Mechanism:
    joints = [
        Joint("A1", "prismatic", ("base", "carriage"), axis=(0, 0, 1), actuated=True),
        Joint("B1", "universal", ("carriage", "rod"), at=(100, 0, 80)),
        Joint("C1", "spherical", ("rod", "platform"), at=(40, 0, 0)),
    ]
    return Mechanism("carriage", joints, "platform", (0, 0, 0))


def test_a_rod_square_to_its_rail_has_one_branch() -> None:
    mechanism = carriage()
    slack = TOLERANCES.position * mechanism.characteristic_length
    for beyond, modes in ((-1.0, 2), (0.0, 1), (0.4 * slack, 1), (3 * slack, 0)):
        target = np.array([-40.0, -beyond, 0.0]) + [100, -100, 7]
        found = pf.geometric.working_modes(mechanism, target)
        assert len(found) == modes
        assert pf.geometric.solve_ik(mechanism, target).reached is (modes > 0)
        if modes == 2:
            middle = found.actuators.mean() + 80
            assert middle == pytest.approx(7.0)
            np.testing.assert_allclose(np.ptp(found.actuators), 2 * np.sqrt(100**2 - 99**2), rtol=1e-9)


def test_home_square_to_its_rail_counts_as_ahead() -> None:
    joints = [
        dataclasses.replace(joint, at=(100, 0, 0)) if joint.name == "B1" else joint for joint in carriage().joints
    ]
    mechanism = dataclasses.replace(carriage(), joints=tuple(joints))
    answer = pf.geometric.solve_ik(mechanism, [20, 0, 5])
    assert answer.actuators[0] == pytest.approx(5 + np.sqrt(60**2 - 40**2))


# --- batches and wrong calls -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["hexaglide", "rps", "delta"])
def test_a_batch_is_answered_row_by_row_and_in_blocks(name: str) -> None:
    mechanism = pf.load(name)
    wanted = some_targets(mechanism, 40)
    flat = pf.geometric.solve_ik(mechanism, wanted)
    folded = pf.geometric.solve_ik(mechanism, wanted.reshape(2, 20, 4, 4))
    assert folded.reached.shape == (2, 20)
    assert folded.pose.shape == (2, 20, 4, 4)
    np.testing.assert_array_equal(folded.pose.reshape(-1, 4, 4), flat.pose)
    np.testing.assert_array_equal(folded.actuators.reshape(40, -1), flat.actuators)
    many = pf.geometric.solve_ik(mechanism, np.tile(wanted, (120, 1, 1)))
    np.testing.assert_array_equal(many.actuators[-40:], flat.actuators)
    for row in range(0, 40, 7):
        single = pf.geometric.solve_ik(mechanism, wanted[row])
        assert single.reached is bool(flat.reached[row])
        assert single.pose.shape == (4, 4)
        np.testing.assert_allclose(single.actuators, flat.actuators[row], rtol=0, atol=1e-9)
    assert pf.geometric.solve_ik(mechanism, np.empty((0, 4, 4))).pose.shape == (0, 4, 4)


@pytest.mark.parametrize("name", ["delta", "rps", "hexaglide", "agile_eye"])
def test_what_the_task_does_not_set_does_not_matter(name: str) -> None:
    mechanism = pf.load(name)
    wanted = some_targets(mechanism, 40)
    other = wanted.copy()
    rng = np.random.default_rng(2)
    if not {"x", "y"} & set(mechanism.task):
        other[:, :2, 3] += rng.normal(0, 50, (40, 2))
    if mechanism.task == ("x", "y", "z"):
        other[:, :3, :3] = Rotation.random(40, random_state=2).as_matrix()
    if "tilt" in mechanism.task:
        other[:, :3, :3] = (
            wanted[:, :3, :3] @ Rotation.from_rotvec(np.outer(rng.normal(size=40), [0, 0, 1])).as_matrix()
        )
    expected, answer = pf.geometric.solve_ik(mechanism, wanted), pf.geometric.solve_ik(mechanism, other)
    np.testing.assert_array_equal(answer.reached, expected.reached)
    np.testing.assert_allclose(answer.pose, expected.pose, rtol=0, atol=1e-9)


@pytest.mark.parametrize("distance", [1e4, 1e10, 1e160, 1e308])
@pytest.mark.parametrize("name", ["delta", "rrr", "rps", "tricept", "ucu", "hexaglide"])
def test_no_target_is_too_far_to_be_missed(name: str, distance: float) -> None:
    mechanism = pf.load(name)
    away = [[distance, 0.0, distance], [0.0, -distance, distance / 3]]
    assert not pf.geometric.solve_ik(mechanism, away).reached.any()
    assert not pf.geometric.working_modes(mechanism, away[0]).keeps_limits.any()


def test_an_answer_keeps_its_poses_when_the_target_is_changed() -> None:
    for name in ("stewart", "delta"):
        mechanism = pf.load(name)
        target = mechanism.home_pose.copy()
        answer = pf.geometric.solve_ik(mechanism, target)
        target[:] = 0.0
        np.testing.assert_allclose(answer.pose, mechanism.home_pose, rtol=0, atol=1e-12)


def test_wrong_calls_are_told() -> None:
    mechanism = pf.load("rrr")
    home = pf.geometric.solve_ik(mechanism, mechanism.home_pose)
    for call, argument in (
        (lambda: pf.geometric.working_modes("rrr", [0, 0, 0]), "mechanism"),
        (lambda: pf.geometric.working_modes(mechanism, [[0, 0, 0], [1, 0, 0]]), "target"),
        (lambda: pf.geometric.working_modes(mechanism, np.full((4, 4), np.nan)), "target"),
        (lambda: pf.geometric.solve_ik(mechanism, np.full((4, 4), 2.0)), "target"),
        (lambda: _seeded(mechanism, actuators=home.actuators, pose=np.eye(3)), "seed"),
        (lambda: _seeded(mechanism, actuators=home.actuators, pose=np.ones((4, 4))), "seed"),
        (lambda: _seeded(mechanism, actuators=home.actuators * np.nan, pose=home.pose), "seed"),
    ):
        with pytest.raises(InvalidArgument) as caught:
            call()
        assert caught.value.argument == argument


def _seeded(mechanism: Mechanism, **seed: Any) -> Any:
    return pf.geometric.solve_ik(mechanism, mechanism.home_pose, start=SimpleNamespace(**seed))
