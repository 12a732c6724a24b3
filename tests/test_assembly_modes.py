"""All assembly modes: published counts and poses, closed forms, and what a list of modes promises."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
import pytest

import checks
import oracles
import pfabrik as pf
from checks import actuator_units, home_values
from machines import planar, published
from machines.published import PUBLISHED
from oracles import assembly
from pfabrik import Mechanism, Solution
from pfabrik.errors import ContinuumOfSolutions, MobilityWarning, PfabrikError

SAUER = assembly.Planar3RPR(**PUBLISHED["sauer_p2_5"]["geometry"])


class Case(NamedTuple):
    """A machine, values of its actuators, and all of its modes there: their number, and poses or points of some."""

    mechanism: Mechanism
    values: Sequence[float]
    count: int
    expected: Sequence[np.ndarray]
    is_point: bool = False


def of_sauer(p: Sequence[float], published_poses: Sequence[Sequence[float]] | None = None) -> Case:
    """The planar 3-RPR in the configurations of its closed form, or in published ones."""
    mechanism, home = published.planar_3rpr(SAUER, PUBLISHED["sauer_p2_5"]["p"])
    poses = [published.planar_pose(pose, home) for pose in published_poses or SAUER.solutions(p)]
    return Case(mechanism, p, len(poses), poses)


def another_of_sauer() -> Case:
    case = PUBLISHED["sauer_fig1_15"]
    mechanism, home = published.planar_3rpr(assembly.Planar3RPR(**case["geometry"]), case["p"])
    poses = [published.planar_pose(pose, home) for pose in case["poses_theta_x_y"]]
    return Case(mechanism, case["p"], len(poses), poses)


def five_bar() -> Case:
    mechanism, turns = pf.load("five_bar"), (-0.3, 0.2)
    return Case(mechanism, turns, 2, assembly.five_bar_tips(mechanism, turns), is_point=True)


def serial_arm() -> Case:
    headings = np.cumsum([0.4, -0.8, 1.7])
    tip = published.ARM_LINKS @ np.stack([np.cos(headings), np.sin(headings), 0 * headings], axis=1)
    pose = pf.pose(tip, rotvec=[0, 0, headings[-1] - published.ARM_HOME.sum()])
    return Case(published.planar_arm(), [0.4, -0.8, 1.7], 1, [pose])


def tripod() -> Case:
    """The two points where three spheres meet, mirror images, each in two postures of the tool."""
    (a, b, c), tip = published.TRIPOD_FEET, published.TRIPOD_TIP
    normal = np.cross(b - a, c - a) / np.linalg.norm(np.cross(b - a, c - a))
    mirrored = tip - 2 * normal * (normal @ (tip - a))
    lengths = np.linalg.norm(published.TRIPOD_FEET - tip, axis=1)
    return Case(published.tripod(), lengths, 4, [tip, tip, mirrored, mirrored], is_point=True)


def three_rps() -> Case:
    """Sixteen, the most that there can be."""
    case = PUBLISHED["rps_leeshah"]
    row, geometry = case["rows_a_b_pz_px_py_d1_d2_d3"][0], case["geometry"]
    mechanism = published.rps(geometry["base_radius"], geometry["platform_radius"], 200.0)
    return Case(mechanism, row[5:], 16, [published.lee_shah_pose(row)])


def six_ups() -> Case:
    case = PUBLISHED["gsp_mathworks_home"]
    poses = [pf.pose(p, quat_xyzw=quat) for p, quat in case["solutions_p_quat_xyzw"]]
    return Case(published.published_gough("gsp_mathworks_home", [0.0, 0.0, 2.0]), case["L"], 8, poses)


CASES: dict[str, Callable[[], Case]] = {
    "sauer_fig1_15": another_of_sauer,
    "sauer_p2_5": lambda: of_sauer(PUBLISHED["sauer_p2_5"]["p"], PUBLISHED["sauer_p2_5"]["poses_theta_x_y"]),
    "5-bar": five_bar,
    "serial arm": serial_arm,
    "tripod": tripod,
    "3-RPS": three_rps,
    "6-UPS": six_ups,
    "Dietmaier's": lambda: Case(published.dietmaier(), PUBLISHED["gsp_dietmaier"]["L"], 40, []),
}


def assert_modes(case: Case, modes: Sequence[Solution], atol: float = 1e-6) -> None:
    """Closed, at exactly these actuator values, each only once, and all of them."""
    mechanism, length = case.mechanism, case.mechanism.characteristic_length
    for mode in modes:
        assert max(mode.residual, pf.closure_residual(mode)) <= 1e-9 * length
        assert checks.gap_of_joints(mechanism, mode).max() <= 1e-8
        assert np.abs((mode.actuators - case.values) / actuator_units(mechanism)).max() <= 1e-9
    for one, other in combinations(modes, 2):
        apart = np.abs(one.pose - other.pose)
        assert max(apart[:3, :3].max(), apart[:3, 3].max() / length) > 1e-6
    assert len(modes) == case.count
    left = [mode.pose[:3, 3] if case.is_point else mode.pose for mode in modes]
    for expected in case.expected:
        off = [np.abs(expected - pose).max() for pose in left]
        assert min(off) <= atol
        left.pop(int(np.argmin(off)))


@pytest.mark.compiled
@pytest.mark.parametrize("name", CASES)
def test_all_modes_of_a_closed_form_or_a_publication_are_found(name: str) -> None:
    case = CASES[name]()
    assert_modes(case, pf.assembly_modes(case.mechanism, case.values))


@pytest.mark.parametrize("transition, below, above", PUBLISHED["sauer_intervals"]["transitions_p2_from_to"])
def test_planar_3rpr_gains_and_loses_modes_at_the_published_strut_lengths(
    transition: float, below: int, above: int
) -> None:
    for p2, count in ((transition - 1e-3, below), (transition + 1e-3, above)):
        case = of_sauer([5.0, p2, 3.0])
        assert case.count == count
        assert_modes(case, pf.assembly_modes(case.mechanism, case.values, most_starts=1024), atol=1e-7)


@pytest.mark.parametrize("count", [2, pytest.param(100, marks=pytest.mark.campaign)])
def test_planar_3rpr_has_the_modes_of_its_sextic_whatever_its_lengths(count: int) -> None:
    rng = np.random.default_rng(1)
    for _ in range(count):
        case = of_sauer(SAUER.lengths(*rng.uniform([-3, -2, -2], [3, 5, 5])))
        assert_modes(case, pf.assembly_modes(case.mechanism, case.values, most_starts=1024), atol=1e-7)


# --- limits ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "target"), [
    ("five_bar", pf.pose([0.0, 13.0, 185.0])), ("stewart", pf.pose([10.0, -5.0, 205.0], rpy=[0.1, -0.15, 0.2])),
])  # fmt: skip
def test_modes_say_which_of_them_are_within_limits(name: str, target: np.ndarray) -> None:
    mechanism = pf.load(name)
    modes = pf.assembly_modes(mechanism, oracles.actuators(mechanism, target[None])[0])
    assert len(modes) > 1
    for mode in modes:
        excess = checks.excess_of_joints(mechanism, mode)[0]
        assert (mode.limit_excess <= 1e-9) == (excess <= 1e-8) == bool(mode)
    kept = [mode for mode in modes if mode]
    assert min(checks.pose_errors(mechanism, mode.pose, target) for mode in kept) <= 1e-6
    assert name != "five_bar" or len(kept) == 1


def test_values_that_do_not_agree_have_no_mode() -> None:
    """Of forearms that do not meet; of a redundant machine, from a crossbar 60 wide to platform joints 100 apart."""
    assert list(pf.assembly_modes(pf.load("five_bar"), np.radians([60.0, -60.0]))) == []
    mechanism = pf.load("nrpm")
    values = home_values(mechanism)
    modes = pf.assembly_modes(mechanism, values, most_starts=512)
    assert min(np.abs(mode.pose - mechanism.home_pose).max() for mode in modes) <= 1e-6
    values[[mechanism.actuator_names.index(name) for name in ("DL1", "DR1")]] = 1.0
    assert len(pf.assembly_modes(mechanism, values, most_starts=512)) == 0


# --- what the list says ----------------------------------------------------------------------------------------------


def test_a_list_says_how_it_was_found_and_is_the_same_in_every_call() -> None:
    mechanism, values = of_sauer([5.0, 7.0, 3.0])[:2]
    first, second = (pf.assembly_modes(mechanism, values) for _ in range(2))
    assert isinstance(first, Sequence) and len(first[:2]) == 2
    assert len(first) == len(second) == len(list(first)) == 6 and first.starts >= 6
    assert 0.0 <= first.unseen < 0.1
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one.pose, other.pose)


def two_driven() -> Mechanism:
    """A planar 3-RPR one of whose struts nothing drives."""
    whole = planar("RPR")
    joints = [dataclasses.replace(each, actuated=each.actuated and each.name != "B1") for each in whole.joints]
    return Mechanism("planar 3-RPR, two driven", joints, "platform", whole.reference_point)


@pytest.mark.parametrize("make", [published.similar_hexagons, two_driven])
def test_a_continuum_of_modes_is_refused(make: Callable[[], Mechanism]) -> None:
    with pytest.warns(MobilityWarning):
        mechanism = make()
    with pytest.raises(ContinuumOfSolutions) as caught:
        pf.assembly_modes(mechanism, home_values(mechanism))
    assert isinstance(caught.value, PfabrikError) and isinstance(caught.value, ValueError)


@pytest.mark.parametrize(("short_of", "counts"), [(1e-3, (2,)), (1e-6, (2,)), (0.0, (1, 2)), (-1e-3, (0,))])
def test_modes_merge_and_vanish_where_the_forearms_are_stretched(short_of: float, counts: tuple[int, ...]) -> None:
    """Two modes that nearly meet are no continuum, nor is a singular but isolated one, known to half the digits.

    An elbow is 50 + 110 sin(turn + c) from the plane of symmetry, and (66, 88) from its shoulder at home: c is 36.87
    degrees.
    """
    mechanism = pf.load("five_bar").without_limits()
    turn = np.arcsin((145.0 - short_of - 50.0) / 110.0) - np.arctan2(66.0, 88.0)
    modes = pf.assembly_modes(mechanism, [turn, -turn])
    assert len(modes) in counts
    for mode in modes:
        np.testing.assert_allclose(mode.pose[:2, 3], [0.0, 0.0], rtol=0, atol=1e-2)
