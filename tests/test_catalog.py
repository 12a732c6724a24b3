"""The catalogue: every machine has the freedoms that the literature gives it, and answers with published numbers."""

from __future__ import annotations

from contextlib import suppress

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
from pfabrik.machine.catalog import catalog_file, description, template
from pfabrik.machine.files import loads

Array = NDArray[np.float64]
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


def targets_about_the_border(mechanism: Mechanism, count: int) -> Array:
    """Targets anywhere, (count, 4, 4), and the poses of their answers, moved in and out by a fiftieth."""
    random, home = np.random.default_rng(1), mechanism.home_pose
    far = oracles.targets_about(mechanism, random, count, 0.6, 0.4)
    far[::2, :3, :3] = home[:3, :3]
    beside = pf.solve_ik(mechanism, far).pose
    beside[:, :3, 3] += random.choice([-0.02, 0.02], (count, 1)) * (beside - home)[:, :3, 3]
    return np.concatenate([far, beside])


def reached_in_closed_form(mechanism: Mechanism, targets: Array) -> NDArray[np.bool_] | None:
    """Which targets (n, 4, 4) a closed form reaches, (n,); None without one."""
    for solve_ik in (oracles.solve_ik, geometric.solve_ik):
        with suppress(oracles.NoClosedForm, geometric.NoClosedForm):
            return np.asarray(solve_ik(mechanism, targets).reached)
    return None


def search_reaches(mechanism: Mechanism, target: Array, answer: Solution) -> bool:
    """Whether blind search finds a configuration, from the answer's and from home's."""
    explicit = checks.with_axes(mechanism)
    moved = checks.deviations(explicit, answer)
    own = np.concatenate([moved[joint.name][0] for joint in explicit.joints]) / search.units(explicit)
    return search.can_reach(explicit, target, [own, np.zeros(len(own))])


@pytest.mark.parametrize("count", [2 if INTERPRETED else 50, pytest.param(1000, marks=pytest.mark.campaign)])
@pytest.mark.parametrize("name", NAMES)
def test_what_is_called_out_of_reach_is(name: str, count: int) -> None:
    """Of all targets by the closed form, where there is one; else of the nearest, by blind search."""
    mechanism = machine(name)
    if len(mechanism.joints) > 40 and count < 1000:
        pytest.skip("a search in sixty coordinates takes seconds")
    targets = targets_about_the_border(mechanism, count)
    found = pf.solve_ik(mechanism, targets)
    reached, missed = reached_in_closed_form(mechanism, targets), np.flatnonzero(found.status != Status.REACHED)
    if reached is None:
        nearest = missed[np.argsort(found.position_error[missed] + found.rotation_error[missed])]
        few = 1 if len(mechanism.joints) > 40 else max(2, count // 50)
        assert [row for row in nearest[:few] if search_reaches(mechanism, targets[row], found[row])] == []
        row = np.flatnonzero(found.status == Status.REACHED)[0]
        assert search_reaches(mechanism, targets[row], pf.solve_ik(mechanism, mechanism.home_pose))  # it can find
    else:
        assert np.flatnonzero(reached & (found.status != Status.REACHED)).tolist() == []


@pytest.mark.parametrize("name", NAMES)
def test_a_file_begins_with_a_line_that_says_what_the_machine_is(name: str) -> None:
    line, second = catalog_file(name).read_text(encoding="utf-8").splitlines()[:2]
    assert line == f"# {description(name)}" and line.endswith(".") and second.startswith("# ")


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
        [20, 20.0, 8.858, 29.938],
        [40, 21.78, -1.436, 40.325],
        [60, 24.721, -11.073, 50.524],
        [80, 28.8, -19.547, 60.563],
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


@pytest.mark.compiled
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
    first, second, drop, wrist = oracles.any_values(mechanism, 50, 0.5).T
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


@pytest.mark.parametrize(
    ("kind", "name"), [("spherical-3rrr", "agile_eye"), ("orthoglide", "orthoglide"), ("tricept", "tricept")]
)
def test_a_starting_file_with_published_dimensions_is_the_machine_of_the_catalogue(kind: str, name: str) -> None:
    made, supplied = loads(template(kind)), pf.load(name)
    moves = np.random.default_rng(3).uniform(-0.1, 0.1, (20, 6)) * supplied.characteristic_length
    targets = pf.pose(supplied.reference_point + moves[:, :3], rotvec=moves[:, 3:] / supplied.characteristic_length)
    one, other = (pf.solve_ik(machine, targets) for machine in (made, supplied))
    homes = (pf.solve_ik(machine, machine.home_pose).actuators for machine in (made, supplied))
    assert (one.status == pf.Status.REACHED).all()
    np.testing.assert_allclose(one.actuators - next(homes), other.actuators - next(homes), atol=1e-8)


def test_struts_of_the_starting_file_of_an_ankle_are_as_long_as_their_ends_are_apart() -> None:
    machine = loads(template("ankle-spu"))
    values, pivot = machine.dimensions, machine.reference_point
    answer = pf.solve_ik(machine, pf.pose(pivot, rpy=[0.1, 0.2, 0.0]))
    for actuator, side in zip(answer.actuators, (-1, 1), strict=True):
        upper = np.array([-values["back"], side * values["side"], 0.0])
        lower = pivot + answer.pose[:3, :3] @ [-values["back"], side * values["side"], 0.0]
        assert actuator == pytest.approx(np.linalg.norm(lower - upper), abs=1e-9)
