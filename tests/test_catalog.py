"""The catalogue: every machine loads, has the freedoms that the literature gives it, and keeps what answers promise."""

from __future__ import annotations

from contextlib import suppress
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import checks
import oracles
import pfabrik as pf
from checks import INTERPRETED
from machines import machine
from machines.published import PUBLISHED, moved_from_home
from oracles import search
from paper import geometric
from pfabrik import Mechanism, Solution, Status
from pfabrik.catalog import catalog_file, description

Array = NDArray[np.float64]
KEPT = 1e-9  # what a result promises, of L or in radians
NAMES = pf.catalog()

FREEDOMS = {
    "agile_eye": (3, 3),  # Gosselin and Hamel 1994: three rotations
    "ankle_rss": (2, 4),  # and two rods that spin between their ball joints
    "ankle_ups": (2, 2),
    "canfield": (3, 3),  # Canfield 1997: two rotations and the plunge
    "delta": (3, 3),  # Clavel 1988: three translations
    "five_bar": (2, 2),
    "g1_ankle": (2, 2),
    "hexaglide": (6, 6),
    "linear_delta": (3, 9),  # and six rods that spin between their ball joints
    "nrpm": (6, 12),  # the paper: twelve actuators for six freedoms
    "orthoglide": (3, 3),  # Chablat and Wenger 2003: three translations
    "panda": (6, 7),  # one more than the flange has
    "prr": (3, 3),
    "prs": (3, 3),
    "psu": (3, 3),
    "reachy_mini": (6, 12),  # and six rods that spin between their ball joints
    "rpr": (3, 3),
    "rps": (3, 3),  # Lee and Shah 1988
    "rrr": (3, 3),
    "serial_arm": (4, 4),
    "servo_hexapod": (6, 6),
    "snake60": (6, 60),
    "stewart": (6, 6),
    "tricept": (3, 3),  # Neumann 1988: a tilt in two directions and a distance
    "ucu": (6, 6),
}
"""Freedoms of the end effector and of the whole machine, as the literature counts them."""

INTERNAL = {"nrpm": 6, "panda": 1, "snake60": 54}
"""Motions that leave the end effector where it is; none elsewhere."""

OVER_CONSTRAINTS = {"five_bar": 3, "rrr": 6, "rpr": 6, "prr": 6, "agile_eye": 6, "orthoglide": 12}
"""Loop conditions that follow from others: three of every planar or spherical loop, such as the Orthoglide's three
parallelograms; and three more there, because three legs hold two rotations each. None elsewhere."""


def drawn_actuators(mechanism: Mechanism, count: int, seed: int) -> Array:
    """Actuator values (count, n_a) between home and halfway to somewhere in their ranges; without one, to any angle.

    Few combinations of values from the ends of their ranges belong to a pose, and to find that out takes long, the
    interpreter minutes; the limits are met by what is projected.
    """
    farthest = 0.15 if INTERPRETED else 0.5
    random = np.random.default_rng(seed)
    ranges = [mechanism.joint(name).range or (-np.pi, np.pi) for name in mechanism.actuator_names]
    home = np.array([mechanism.home_coordinate(name) for name in mechanism.actuator_names])
    away = random.uniform(*np.transpose(ranges), (count, len(ranges))) - home
    return home + random.uniform(0, farthest, (count, 1)) * away


def random_poses(mechanism: Mechanism, count: int, seed: int) -> Array:
    """Poses (count, 4, 4) around home, up to 1.5 L and half a turn away.

    Every other one goes only where home's first motions lead: of whole poses few others are of any use to a machine
    that moves in a plane.
    """
    random = np.random.default_rng(seed)
    scale = random.uniform(0, 1, (count, 1))
    turn = random.standard_normal((count, 3))
    turn *= np.pi * scale / np.linalg.norm(turn, axis=1, keepdims=True)
    moved = np.hstack([1.5 * scale * random.uniform(-1, 1, (count, 3)), turn])
    rates = pf.forward_jacobian(pf.solve_ik(mechanism, mechanism.home_pose))
    if mechanism.end_effector_is_joint:
        moved, rates = moved[:, :3], rates[:3]
    rates = rates / np.where(np.arange(len(rates)) < 3, mechanism.characteristic_length, 1.0)[:, None]
    left, values, _ = np.linalg.svd(rates, full_matrices=False)
    own = left[:, values > 1e-6 * values[0]]
    moved[::2] = moved[::2] @ own @ own.T
    poses = np.tile(mechanism.home_pose, (count, 1, 1))
    poses[:, :3, 3] += mechanism.characteristic_length * moved[:, :3]
    if not mechanism.end_effector_is_joint:
        poses[:, :3, :3] = Rotation.from_rotvec(moved[:, 3:]).as_matrix()
    return poses


def distance(mechanism: Mechanism, poses: Array, others: Array) -> Array:
    """Largest of position [L] and rotation [rad] between poses, (n,); position alone for a joint end effector."""
    moved = np.linalg.norm((poses - others)[:, :3, 3], axis=1) / mechanism.characteristic_length
    turned = np.linalg.norm((poses - others)[:, :3, :3], axis=(1, 2)) / np.sqrt(2)
    return moved if mechanism.end_effector_is_joint else np.maximum(moved, turned)


def pose_errors(mechanism: Mechanism, poses: Array, targets: Array) -> Array:
    """Largest error [L or rad] in what the task counts, (n,)."""
    off = np.zeros((len(poses), 1))
    at = (poses - targets)[:, :3, 3] / mechanism.characteristic_length
    turned = (poses - targets)[:, :3, :3]
    counted = {"x": at[:, :1], "y": at[:, 1:2], "z": at[:, 2:], "rotation": turned.reshape(-1, 9) / np.sqrt(2)}
    counted["tilt"] = turned[:, :, 2]
    return np.max([off[:, 0], *(np.linalg.norm(counted[name], axis=1) for name in mechanism.task)], axis=0)


# Any target: half of the rows anywhere, half where a feasible configuration puts the end effector

MISSED_AT_BOUNDS = {"snake60": 0.1}
"""Share of targets on the very border that searches may end next to: there the stops of sixty joints leave many local
minima, a thousandth of L apart."""

FEW, MANY = (2 if INTERPRETED else 100), 2000
COUNTS = [FEW, pytest.param(MANY, marks=pytest.mark.campaign)]
SEARCHED = {FEW: 2, MANY: 20}
"""How many of the targets called out of reach are searched for, where no closed form tells of all."""
LONG = 40
"""Joints of a chain whose blind search takes seconds a start: one target, from the answer and from home."""


@cache
def anywhere(name: str, count: int) -> tuple[Array, Solution]:
    """Targets drawn blindly, and their answers."""
    targets = random_poses(machine(name), count // 2, 1)
    return targets, pf.solve_ik(machine(name), targets)


@cache
def assembled(name: str, count: int) -> Solution:
    """Configurations with actuator values drawn within their ranges, or values near these where no pose has them."""
    return pf.solve_fk(machine(name), drawn_actuators(machine(name), count // 2, 0))


@cache
def inside(name: str, count: int) -> tuple[Array, Solution]:
    """Poses of configurations that are feasible whatever solver found them, and the answers to these as targets."""
    poses = assembled(name, count).pose
    return poses, pf.solve_ik(machine(name), poses)


@cache
def at_bounds(name: str, count: int) -> tuple[Array, Solution]:
    """The same of configurations as far out as they go: what targets out of reach were projected to."""
    _, found = anywhere(name, count)
    poses = found.pose[found.status == Status.PROJECTED][: count // 4]
    return poses, pf.solve_ik(machine(name), poses)


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("name", NAMES)
def test_limits_are_kept_and_loops_closed_for_any_target(name: str, count: int) -> None:
    for found in (anywhere(name, count)[1], assembled(name, count), inside(name, count)[1], at_bounds(name, count)[1]):
        checks.assert_feasible(machine(name), found)


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("name", NAMES)
def test_whatever_a_feasible_configuration_reaches_is_reached(name: str, count: int) -> None:
    for (poses, found), most in ((inside(name, count), 0.0), (at_bounds(name, count), MISSED_AT_BOUNDS.get(name, 0.0))):
        assert np.mean(found.status != Status.REACHED) <= most
        off = pose_errors(machine(name), found.pose, poses)
        assert off[found.status == Status.REACHED].max(initial=0.0) <= KEPT
        assert off.max(initial=0.0) <= (KEPT if most == 0.0 else 1e-2)


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("name", NAMES)
def test_what_is_called_out_of_reach_is(name: str, count: int) -> None:
    """Of all targets by the closed form, where there is one; else of some, by search from the answer and beyond."""
    mechanism = machine(name)
    targets, found = anywhere(name, count)
    missed = np.flatnonzero(found.status != Status.REACHED)
    reached = reached_in_closed_form(mechanism, targets)
    if reached is None:
        few = 1 if len(mechanism.joints) > LONG else SEARCHED[count]
        searched = in_turn(missed, found.position_error, few)
        assert [row for row in searched if search_reaches(mechanism, targets[row], found[row])] == []
    else:
        assert np.flatnonzero(reached & (found.status != Status.REACHED)).tolist() == []


def reached_in_closed_form(mechanism: Mechanism, targets: Array) -> NDArray[np.bool_] | None:
    """Which targets (n, 4, 4) a closed form reaches, (n,); None without one."""
    for solve_ik in (oracles.solve_ik, geometric.solve_ik):
        with suppress(oracles.NoClosedForm, geometric.NoClosedForm):
            return np.asarray(solve_ik(mechanism, targets).reached)
    return None


def in_turn(rows: NDArray[np.intp], errors: Array, count: int) -> list[int]:
    """Some of the rows: by turns those with the least errors, where a miss is likely, and the others in order."""
    nearest = rows[np.argsort(errors[rows])]
    return list(dict.fromkeys(np.stack([nearest, rows], axis=1).ravel().tolist()))[:count]


def search_reaches(mechanism: Mechanism, target: Array, answer: Solution) -> bool:
    """Whether blind search finds a configuration, from the answer's, home's and two drawn around it."""
    explicit = checks.with_axes(mechanism)
    moved = checks.deviations(explicit, answer)
    own = np.concatenate([moved[joint.name][0] for joint in explicit.joints]) / search.units(explicit)
    drawn = np.random.default_rng(0).normal(0, 0.3, (0 if len(own) > LONG else 2, len(own)))
    return search.can_reach(explicit, target, [own, np.zeros(len(own)), *drawn])


@pytest.mark.parametrize("name", NAMES)
def test_the_blind_search_finds_what_is_within_reach(name: str) -> None:
    """From home alone: so that it means something if it finds nothing."""
    explicit = checks.with_axes(machine(name))
    poses = inside(name, FEW)[0][:3]
    start = np.zeros(search.columns(explicit))
    assert [search.can_reach(explicit, pose, [start]) for pose in poses].count(True) >= len(poses) - 1


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("name", NAMES)
def test_forward_kinematics_undoes_inverse_kinematics(name: str, count: int) -> None:
    for _, found in (anywhere(name, count), inside(name, count), at_bounds(name, count)):
        reached = found[found.status == Status.REACHED]
        if len(reached):
            back = pf.solve_fk(machine(name), reached.actuators, start=reached)
            assert (back.status == Status.REACHED).all()
            assert distance(machine(name), back.pose, reached.pose).max() <= 1e-8


# Each machine


def test_every_machine_has_its_freedoms_checked() -> None:
    assert set(FREEDOMS) == set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_a_file_begins_with_a_line_that_says_what_the_machine_is(name: str) -> None:
    line, second = catalog_file(name).read_text(encoding="utf-8").splitlines()[:2]
    assert description(name) == line.removeprefix("# ")
    assert line.startswith("# ")
    assert line.endswith(".")
    assert second.startswith("# ")


@pytest.mark.parametrize("name", NAMES)
def test_machines_have_the_freedoms_that_the_literature_counts(name: str) -> None:
    counted = pf.mobility(machine(name))
    assert (counted.platform, counted.mobility) == FREEDOMS[name]
    assert counted.uncontrolled == 0
    assert counted.over_constraints == OVER_CONSTRAINTS.get(name, 0)
    assert counted.internal == INTERNAL.get(name, 0)


# Published numbers


TROSSEN = np.array(
    [
        [0, 19.403, 19.403, 19.403],
        [10, 19.553, 14.119, 24.683],
        [20, 20.0, 8.858, 29.938],
        [30, 20.743, 3.657, 35.155],
        [40, 21.78, -1.436, 40.325],
        [50, 23.107, -6.366, 45.448],
        [60, 24.721, -11.073, 50.524],
        [70, 26.619, -15.488, 55.559],
        [80, 28.8, -19.547, 60.563],
        [90, 31.263, -23.191, 65.546],
        [100, 34.009, -26.372, 70.524],
    ]
)
"""x [mm] and the arms' angles [deg] at y = 0, 50 mm below level arms. Source: the tests of firepick's
DeltaCalculator.js, of the machine of the Trossen tutorial; printed to 0.001 degrees."""


def test_the_delta_turns_its_arms_as_the_tutorials_program_says() -> None:
    mechanism = machine("delta")
    targets = mechanism.home_pose[:3, 3] + np.outer(TROSSEN[:, 0], [1, 0, 0]) - [0, 0, 50]
    found = pf.solve_ik(mechanism, targets)
    assert found
    np.testing.assert_allclose(np.degrees(found.actuators), TROSSEN[:, 1:], atol=1.1e-3)


def test_the_delta_sinks_by_the_published_amount_for_one_degree() -> None:
    mechanism = machine("delta")
    assert mechanism.home_pose[2, 3] == pytest.approx(-96.859, abs=1e-3)
    sunk = pf.solve_fk(mechanism, np.radians([1.0, 1.0, 1.0])).pose[2, 3] - mechanism.home_pose[2, 3]
    assert sunk == pytest.approx(-1.992, abs=1.5e-3)


@pytest.mark.parametrize(
    ("target", "lengths"),
    [
        ((0, 0, 0), (310.5828541230249, 310.5828541230249, 310.5828541230249)),
        ((50, -30, 20), (358.482915694, 275.87858584, 325.060173204)),
    ],
)
def test_the_orthoglide_slides_as_published(target: tuple[float, ...], lengths: tuple[float, ...]) -> None:
    found = pf.solve_ik(machine("orthoglide"), target)
    assert found
    np.testing.assert_allclose(found.actuators, lengths, atol=1e-6)


@pytest.mark.parametrize(("corner", "factors"), [(73.20508076, (0.8, 0.8, 2)), (-126.79491924, (0.5, 2, 2))])
def test_the_orthoglide_is_within_its_transmission_factors_just_so(corner: float, factors: tuple[float, ...]) -> None:
    """Chablat and Wenger chose its dimensions so that these two corners of the cube meet the bounds 1/2 and 2."""
    mechanism = machine("orthoglide")
    found = pf.solve_ik(mechanism, [corner] * 3)
    assert found
    gains = np.linalg.svd(pf.forward_jacobian(found)[:3], compute_uv=False)
    np.testing.assert_allclose(sorted(gains), factors, atol=1e-6)


def test_servo_angles_are_those_of_the_notebook() -> None:
    """Of a twist by 30 degrees at height 12.4: positive lifts a horn there as here; legs 1, 3, 5, then 2, 4, 6."""
    found = pf.solve_ik(machine("servo_hexapod"), pf.pose([0, 0, 12.4], rpy=[0, 0, np.pi / 6]))
    assert found
    np.testing.assert_allclose(found.actuators, [0.60882972] * 3 + [0.22676629] * 3, atol=1e-8)


@pytest.mark.parametrize("p, rpy, lengths", PUBLISHED["gsp_conroy"]["rows_p_rpy_L"])
def test_struts_of_the_ucu_hexapod_are_as_long_as_printed(
    p: list[float], rpy: list[float], lengths: list[float]
) -> None:
    found = pf.solve_ik(machine("ucu"), pf.pose(p, rpy=rpy))
    assert found
    np.testing.assert_allclose(found.actuators, [*lengths[::2], *lengths[1::2]], atol=6e-5)


@pytest.mark.slow
def test_the_planar_3rpr_has_the_two_poses_of_the_book() -> None:
    mechanism = machine("rpr")
    modes = pf.assembly_modes(mechanism, [np.sqrt(5)] * 3)
    home = pf.pose([0, 0, 0], rotvec=[0, 0, PUBLISHED["sauer_fig1_15"]["poses_theta_x_y"][0][0]])
    expected = [
        moved_from_home(pf.pose([x, y, 0], rotvec=[0, 0, theta]), home)
        for theta, x, y in PUBLISHED["sauer_fig1_15"]["poses_theta_x_y"]
    ]
    assert len(modes) == len(expected)
    for pose, mode in zip(expected, sorted(modes, key=lambda mode: mode.pose[0, 3]), strict=True):
        np.testing.assert_allclose(mode.pose, pose, atol=1e-9)


def test_the_scara_moves_its_tool_as_its_parameters_say() -> None:
    """Denavit-Hartenberg by hand: 325 and 275 mm in the plane, 387 mm above the base."""
    mechanism = machine("serial_arm")
    first, second, drop, wrist = drawn_actuators(mechanism, 50, 3).T
    expected = np.tile(np.eye(4), (50, 1, 1))
    expected[:, 0, 3] = 325 * np.cos(first) + 275 * np.cos(first + second)
    expected[:, 1, 3] = 325 * np.sin(first) + 275 * np.sin(first + second)
    expected[:, 2, 3] = 387 - drop
    home = [mechanism.home_coordinate(name) for name in mechanism.actuator_names]
    about_z = first + second - wrist - (home[0] + home[1] - home[3])
    expected[:, :3, :3] = Rotation.from_rotvec(np.outer(about_z, [0, 0, 1])).as_matrix()
    found = pf.solve_fk(mechanism, np.stack([first, second, drop, wrist], axis=1))
    assert found
    np.testing.assert_allclose(found.pose, expected, atol=1e-9 * 600)
