"""All assembly modes: published counts and poses, closed forms, and what a list of modes promises."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import pytest

import checks
import oracles
import pfabrik as pf
from checks import INTERPRETED
from machines import planar, published
from machines.published import PUBLISHED
from oracles import assembly
from pfabrik.errors import MobilityWarning, PfabrikError

SAUER = assembly.Planar3RPR(**PUBLISHED["sauer_p2_5"]["geometry"])


def assert_modes(mechanism: pf.Mechanism, actuators: Sequence[float], modes: Sequence[pf.Solution]) -> None:
    """Closed, at exactly these actuator values, and each only once."""
    length = mechanism.characteristic_length
    for mode in modes:
        assert mode.pose.shape == (4, 4)
        assert mode.residual <= 1e-9 * length
        assert pf.closure_residual(mode) <= 1e-9 * length
        assert checks.gap_of_points(mechanism, mode).max() <= 1e-9
        assert checks.gap_of_joints(mechanism, mode).max() <= 1e-8
        slides = [mechanism.joint(name).type == "prismatic" for name in mechanism.actuator_names]
        np.testing.assert_allclose(
            np.subtract(mode.actuators, actuators) / np.where(slides, length, 1.0), 0.0, rtol=0, atol=1e-9
        )
    for one, other in combinations(modes, 2):
        apart = np.abs(one.pose - other.pose)
        assert max(apart[:3, :3].max(), apart[:3, 3].max() / length) > 1e-6


def assert_same_poses(modes: Sequence[pf.Solution], expected: Sequence[np.ndarray], atol: float) -> None:
    """The same set of poses, in any order."""
    found = np.array([mode.pose for mode in modes])
    assert len(found) == len(expected)
    taken = {int(np.abs(found - pose).max(axis=(1, 2)).argmin()) for pose in expected}
    assert len(taken) == len(expected)
    for pose in expected:
        assert np.abs(found - pose).max(axis=(1, 2)).min() <= atol


# --- planar ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", ["sauer_fig1_15", "sauer_p2_5"])
def test_planar_3rpr_has_the_published_poses(case: str) -> None:
    geometry, p = assembly.Planar3RPR(**PUBLISHED[case]["geometry"]), PUBLISHED[case]["p"]
    mechanism, home = published.planar_3rpr(geometry, p)
    modes = pf.assembly_modes(mechanism, p)
    assert_modes(mechanism, p, modes)
    expected = [published.planar_pose(each, home) for each in PUBLISHED[case]["poses_theta_x_y"]]
    assert_same_poses(modes, expected, atol=1e-9)


@pytest.mark.parametrize("transition, below, above", PUBLISHED["sauer_intervals"]["transitions_p2_from_to"])
def test_planar_3rpr_gains_and_loses_modes_at_the_published_strut_lengths(
    transition: float, below: int, above: int
) -> None:
    mechanism, home = published.planar_3rpr(SAUER, PUBLISHED["sauer_p2_5"]["p"])
    for p2, count in ((transition - 1e-3, below), (transition + 1e-3, above)):
        p = [5.0, p2, 3.0]
        modes = pf.assembly_modes(mechanism, p)
        assert len(modes) == count
        assert_modes(mechanism, p, modes)
        assert_same_poses(modes, [published.planar_pose(each, home) for each in SAUER.solutions(p)], atol=1e-7)


@pytest.mark.parametrize("count", [2 if INTERPRETED else 4, pytest.param(100, marks=pytest.mark.campaign)])
def test_planar_3rpr_has_the_modes_of_its_sextic_whatever_its_lengths(count: int) -> None:
    mechanism, home = published.planar_3rpr(SAUER, PUBLISHED["sauer_p2_5"]["p"])
    rng = np.random.default_rng(1)
    for _ in range(count):
        p = SAUER.lengths(*rng.uniform([-3, -2, -2], [3, 5, 5]))
        expected = [published.planar_pose(each, home) for each in SAUER.solutions(p)]
        assert_same_poses(pf.assembly_modes(mechanism, p), expected, atol=1e-7)


def test_five_bar_has_two_tips_of_which_its_limits_leave_one() -> None:
    mechanism = pf.load("five_bar")
    target = oracles.inside_targets(mechanism, np.random.default_rng(2), 1, least=0.05)
    turns = oracles.actuators(mechanism, target)[0]
    modes = pf.assembly_modes(mechanism, turns)
    assert_modes(mechanism, turns, modes)
    tips = assembly.five_bar_tips(mechanism, turns)
    assert len(modes) == len(tips) == 2
    for tip in tips:
        assert min(np.linalg.norm(mode.pose[:3, 3] - tip) for mode in modes) <= 1e-7
    kept = [mode for mode in modes if mode.limit_excess <= 1e-9]
    assert len(kept) == 1
    np.testing.assert_allclose(kept[0].pose[:3, 3], target[0, :3, 3], rtol=0, atol=1e-7)


def test_forearms_that_do_not_meet_have_no_mode() -> None:
    modes = pf.assembly_modes(pf.load("five_bar"), np.radians([60.0, -60.0]))
    assert len(modes) == 0
    assert list(modes) == []


def test_a_serial_arm_has_one_mode() -> None:
    mechanism = published.planar_arm()
    angles = [0.4, -0.8, 1.7]
    modes = pf.assembly_modes(mechanism, angles)
    assert_modes(mechanism, angles, modes)
    tip, heading = assembly.planar_arm(published.ARM_LINKS, angles)
    assert_same_poses(modes, [pf.pose([*tip, 0.0], rotvec=[0, 0, heading - published.ARM_HOME.sum()])], atol=1e-6)


# --- in space --------------------------------------------------------------------------------------------------------


def test_three_struts_to_a_point_have_two_points_in_two_postures() -> None:
    mechanism = published.tripod()
    lengths = np.linalg.norm(published.TRIPOD_FEET - published.TRIPOD_TIP, axis=1)
    modes = pf.assembly_modes(mechanism, lengths)
    assert_modes(mechanism, lengths, modes)
    assert len(modes) == 4
    for point in assembly.spheres_meet(published.TRIPOD_FEET, lengths):
        assert sum(np.linalg.norm(mode.pose[:3, 3] - point) <= 1e-6 for mode in modes) == 2


def test_3rps_has_all_poses_of_its_three_swinging_struts() -> None:
    geometry = PUBLISHED["rps_leeshah"]["geometry"]
    mechanism = published.rps(geometry["base_radius"], geometry["platform_radius"], 200.0)
    lengths = PUBLISHED["rps_leeshah"]["rows_a_b_pz_px_py_d1_d2_d3"][0][5:]
    modes = pf.assembly_modes(mechanism, lengths)
    assert_modes(mechanism, lengths, modes)
    side = np.sqrt(3.0) * geometry["platform_radius"]
    expected = assembly.rps_tops(geometry["base_radius"], side, lengths)
    assert len(modes) == len(expected)
    for tops in expected:
        gaps = [max(np.abs(mode.points[f"S{i + 1}"] - tops[i]).max() for i in range(3)) for mode in modes]
        assert min(gaps) <= 1e-6


def test_a_published_hexapod_has_the_modes_found_for_it() -> None:
    case = PUBLISHED["gsp_mathworks_home"]
    mechanism = published.published_gough("gsp_mathworks_home", [0.0, 0.0, 2.0])
    modes = pf.assembly_modes(mechanism, case["L"])
    assert_modes(mechanism, case["L"], modes)
    found = np.array([mode.pose for mode in modes])
    for p, quat in case["solutions_p_quat_xyzw"]:
        assert np.abs(found - pf.pose(p, quat_xyzw=quat)).max(axis=(1, 2)).min() <= 1e-7
    expected, _ = assembly.gough_modes(case["geometry"]["base"], case["geometry"]["platform"], case["L"])
    assert_same_poses(modes, expected, atol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("p, rpy, lengths", PUBLISHED["gsp_conroy"]["rows_p_rpy_L"][1:4])
def test_a_hexapod_has_the_modes_of_an_independent_search(p: list, rpy: list, lengths: list) -> None:
    mechanism = published.published_gough("gsp_conroy", [0.0, 0.0, 3.0])
    geometry = PUBLISHED["gsp_conroy"]["geometry"]
    modes = pf.assembly_modes(mechanism, lengths)
    assert_modes(mechanism, lengths, modes)
    expected, _ = assembly.gough_modes(geometry["base"], geometry["platform"], lengths)
    assert_same_poses(modes, expected, atol=1e-6)
    assert min(np.abs(mode.pose - pf.pose(p, rpy=rpy)).max() for mode in modes) <= 1e-4


@pytest.mark.slow
def test_dietmaiers_platform_has_40_modes() -> None:
    mechanism, home = published.dietmaier()
    modes = pf.assembly_modes(mechanism, published.DIETMAIER_LENGTHS)
    assert_modes(mechanism, published.DIETMAIER_LENGTHS, modes)
    expected, _ = assembly.gough_modes(
        published.DIETMAIER_BASE, published.DIETMAIER_PLATFORM, published.DIETMAIER_LENGTHS, starts=8000
    )
    assert len(modes) == len(expected) == 40
    assert_same_poses(modes, published.moved_from_home(expected, home), atol=1e-6)


def test_a_catalogue_hexapod_is_within_its_limits_in_the_pose_asked_for() -> None:
    mechanism = pf.load("stewart")
    target = pf.pose([10.0, -5.0, 205.0], rpy=[0.1, -0.15, 0.2])
    lengths = oracles.actuators(mechanism, target[None])[0]
    modes = pf.assembly_modes(mechanism, lengths)
    assert_modes(mechanism, lengths, modes)
    assert len(modes) > 1
    for mode in modes:
        margin = oracles.margin(mechanism, mode.pose[None])[0]
        assert (mode.limit_excess <= 1e-9) == (margin >= -1e-8)
    kept = [mode for mode in modes if mode.limit_excess <= 1e-9]
    assert min(np.abs(mode.pose - target).max() for mode in kept) <= 1e-6


def test_a_redundant_machine_has_a_mode_for_values_that_agree_and_none_for_others() -> None:
    mechanism = pf.load("nrpm")
    home = np.array([mechanism.home_coordinate(name) for name in mechanism.actuator_names])
    modes = pf.assembly_modes(mechanism, home)
    assert_modes(mechanism, home, modes)
    assert min(np.abs(mode.pose - mechanism.home_pose).max() for mode in modes) <= 1e-6
    apart = home.copy()
    for name in ("DL1", "DR1"):  # from a crossbar 60 wide to platform joints 100 apart
        apart[mechanism.actuator_names.index(name)] = 1.0
    assert len(pf.assembly_modes(mechanism, apart)) == 0


# --- what the list says ----------------------------------------------------------------------------------------------


def test_a_list_of_modes_says_how_it_was_found_and_what_it_may_have_missed() -> None:
    mechanism, _ = published.planar_3rpr(SAUER, PUBLISHED["sauer_p2_5"]["p"])
    modes = pf.assembly_modes(mechanism, PUBLISHED["sauer_p2_5"]["p"])
    assert modes.starts >= len(modes)
    assert 0.0 <= modes.unseen < 0.1
    assert isinstance(modes, Sequence)
    assert modes[0] is not None
    assert modes[-1].pose.shape == (4, 4)
    assert len(list(modes)) == len(modes)


def test_modes_are_the_same_in_every_call() -> None:
    mechanism, _ = published.planar_3rpr(SAUER, PUBLISHED["sauer_p2_5"]["p"])
    first, second = (pf.assembly_modes(mechanism, [5.0, 7.0, 3.0]) for _ in range(2))
    assert len(first) == len(second) == 6
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one.pose, other.pose)


def assert_continuum(mechanism: pf.Mechanism) -> None:
    home = [mechanism.home_coordinate(name) for name in mechanism.actuator_names]
    with pytest.raises(pf.errors.ContinuumOfSolutions) as caught:
        pf.assembly_modes(mechanism, home)
    assert isinstance(caught.value, PfabrikError)
    assert isinstance(caught.value, ValueError)


def test_similar_hexagons_have_a_continuum_of_modes() -> None:
    with pytest.warns(MobilityWarning):
        mechanism = published.similar_hexagons()
    assert_continuum(mechanism)


def test_too_few_actuators_leave_a_continuum_of_modes() -> None:
    whole = planar("RPR")
    joints = [
        pf.Joint(j.name, j.type, j.connects, axis=j.axis, home=j.home) if j.name == "B1" else j for j in whole.joints
    ]
    with pytest.warns(MobilityWarning):
        mechanism = pf.Mechanism("planar 3-RPR, two driven", joints, "platform", whole.reference_point)
    assert_continuum(mechanism)


def five_bar_turns(half_span: float) -> list[float]:
    """Crank angles, mirrored, that put the elbows of the catalogue's 5-bar this far from its plane of symmetry.

    An elbow is 50 + 110 sin(turn + c) away, and (66, 88) from its shoulder at home: c is 36.87 degrees.
    """
    turn = np.arcsin((half_span - 50.0) / 110.0) - np.arctan2(66.0, 88.0)
    return [turn, -turn]


def test_modes_merge_and_vanish_where_the_forearms_are_stretched() -> None:
    mechanism = pf.load("five_bar").without_limits()
    for half_span, count in ((145.0 - 1e-3, 2), (145.0 + 1e-3, 0)):
        turns = five_bar_turns(half_span)
        modes = pf.assembly_modes(mechanism, turns)
        assert len(modes) == len(assembly.five_bar_tips(mechanism, turns)) == count
        assert_modes(mechanism, turns, modes)


def test_a_singular_but_isolated_configuration_is_no_continuum() -> None:
    """Forearms stretched exactly: where two modes become one, to within half the digits."""
    mechanism = pf.load("five_bar").without_limits()
    modes = pf.assembly_modes(mechanism, five_bar_turns(145.0))
    assert 1 <= len(modes) <= 2
    for mode in modes:
        np.testing.assert_allclose(mode.pose[:2, 3], [0.0, 0.0], rtol=0, atol=1e-2)
