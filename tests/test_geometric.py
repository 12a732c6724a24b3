"""The three closed forms: against other closed forms in NumPy, the library's own engines and brute force."""

from __future__ import annotations

import dataclasses
import os
import pickle
import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

import oracles
import oracles_by_leg as by_leg
import pfabrik as pf
from paper import geometric
from paper.geometric import NoClosedForm, arms, facts, targets
from paper.geometric.topologies import TOPOLOGIES, closed_form
from pfabrik import Cone, Joint, Mechanism
from pfabrik.errors import InvalidArgument
from pfabrik.tolerances import TOLERANCES

INTERPRETED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

EXAMPLES: dict[str, Callable[[], Mechanism]] = {
    "R*-R-R": lambda: pf.load("five_bar"),
    "U-P*-S": lambda: pf.load("stewart"),
    "R*-P*-[U-P*-S, U-P*-S]": lambda: pf.load("nrpm"),
}
"""A machine of every topology with a closed form."""
NAMES = ("five_bar", "stewart", "nrpm")
ON_THE_EDGE = 1e-8
"""Margins that the oracle does not tell from 0."""
DOCS = Path(__file__).parents[1] / "docs"


def some_targets(mechanism: Mechanism, n: int = 2000, seed: int = 11) -> oracles.Array:
    return oracles.random_targets(mechanism, np.random.default_rng(seed), n // 20 if INTERPRETED else n)


def relimited(mechanism: Mechanism, **limits: Any) -> Mechanism:
    return mechanism.with_limits(limits)


def redescribed(mechanism: Mechanism, **changes: dict[str, Any]) -> Mechanism:
    """The mechanism with some fields of some joints replaced."""
    joints = [dataclasses.replace(joint, **changes.get(joint.name, {})) for joint in mechanism.joints]
    return dataclasses.replace(mechanism, joints=tuple(joints))


# --- the registry ----------------------------------------------------------------------------------------------------


def test_every_topology_of_the_registry_has_an_example_and_is_documented() -> None:
    assert [topology.chain for topology in TOPOLOGIES] == list(EXAMPLES)
    page = (DOCS / "geometric.md").read_text(encoding="utf-8")
    for topology in TOPOLOGIES:
        assert f"`{topology.chain}`" in page


@pytest.mark.parametrize("topology", TOPOLOGIES, ids=str)
def test_a_topology_is_told_from_its_sub_chains(topology: Any) -> None:
    mechanism = EXAMPLES[topology.chain]()
    assert {str(chain) for chain in pf.decompose(mechanism)} == {topology.chain}
    assert closed_form(mechanism).kernel is topology.kernel
    renamed = dataclasses.replace(mechanism, name="anything")
    assert closed_form(renamed).kernel is topology.kernel


@pytest.mark.parametrize("topology", TOPOLOGIES, ids=str)
def test_every_closed_form_says_how_many_solutions_which_branch_and_where_from(topology: Any) -> None:
    said = getattr(topology.kernel, "py_func", topology.kernel).__doc__
    assert "solution" in said
    assert "Degenerate" in said or "rule" in said
    source = said.split("Source: ")[1].split()[0].rstrip(".")
    assert f"**{source}**" in (DOCS / "references.md").read_text(encoding="utf-8")


# --- agreement -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["five_bar", "stewart"])
def test_reached_exactly_where_the_oracle_says(name: str) -> None:
    mechanism = pf.load(name)
    wanted = some_targets(mechanism, 4000)
    answer = geometric.solve_ik(mechanism, wanted)
    margin = oracles.margin(mechanism, wanted)
    clear = abs(margin) > ON_THE_EDGE
    np.testing.assert_array_equal(answer.reached[clear], margin[clear] > 0)
    assert 0.2 < answer.reached.mean() < 0.8
    expected = oracles.actuators(mechanism, wanted)[answer.reached]
    np.testing.assert_allclose(answer.actuators[answer.reached], expected, rtol=0, atol=1e-10)


def test_the_solver_reaches_every_redundant_target_that_the_closed_form_reaches() -> None:
    mechanism = pf.load("nrpm")
    wanted = some_targets(mechanism)
    answer, solution = geometric.solve_ik(mechanism, wanted), pf.solve_ik(mechanism, wanted)
    assert (solution.status[answer.reached] == pf.Status.REACHED).all()


def test_a_grid_of_candidates_finds_nearly_every_reachable_target_and_no_other() -> None:
    mechanism = pf.load("nrpm")
    wanted = some_targets(mechanism)
    reached = geometric.solve_ik(mechanism, wanted).reached
    margin = oracles.margin(mechanism, wanted)
    assert not reached[margin < -ON_THE_EDGE].any()
    assert reached[margin > 0].mean() > 0.97
    assert margin[~reached].max() < 0.1


def arm_slacks(mechanism: Mechanism, wanted: oracles.Array, values: oracles.Array) -> oracles.Array:
    """Smallest slack of every arm at the swings and extensions among actuator values (n, n_a), shape (n, arms)."""
    column = mechanism.actuator_names.index
    slacks = []
    for arm in oracles.arms(mechanism):
        swing, extension = values[:, column(arm.hinge.name)], values[:, column(arm.slide.name)]
        slacks.append(arm.lines(wanted, swing).slack(extension))
    return np.stack(slacks, axis=1)


def test_redundant_answers_close_and_keep_every_limit() -> None:
    mechanism = pf.load("nrpm")
    wanted = some_targets(mechanism)
    answer = geometric.solve_ik(mechanism, wanted)
    wanted, values = wanted[answer.reached], answer.actuators[answer.reached]
    assert (arm_slacks(mechanism, wanted, values) > -ON_THE_EDGE).all()
    column = mechanism.actuator_names.index
    for arm in oracles.arms(mechanism):
        table = arm.lines(wanted, values[:, column(arm.hinge.name)]).table
        extension = values[:, column(arm.slide.name)]
        for j, strut in enumerate(arm.struts):
            length = np.hypot(np.sqrt(table[:, j, 1]), table[:, j, 0] - extension)
            np.testing.assert_allclose(values[:, column(strut.slide.name)], length, rtol=0, atol=1e-9)


# --- branches of cranks ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "elbow", [(-3.4, -1.2), (-5.0, -1.0), (-6.0, 0.2), (-1.6, 4.2), (-7.0, 1.0), (-1.7, 2.5), None]
)
@pytest.mark.parametrize("crank", [(-0.5, 4.5), (-6.5, 0.4), (-8.0, 8.0), (-3.0, 3.0), None])
def test_a_leg_takes_its_other_branch_where_homes_breaks_a_limit_and_only_there(elbow: Any, crank: Any) -> None:
    """As leg by leg in NumPy; an elbow may have two intervals of bends, and a crank counts where its range has it."""
    mechanism = relimited(pf.load("five_bar"), p1=crank, p5=(-3.0, 3.0), p2=elbow, p4=(-2.5, 1.7))
    wanted = some_targets(mechanism, 500)
    answer, expected = geometric.solve_ik(mechanism, wanted), by_leg.solve_ik(mechanism, wanted)
    np.testing.assert_array_equal(answer.reached, expected.reached)
    assert answer.reached.any()
    np.testing.assert_allclose(answer.actuators, expected.actuators, rtol=0, atol=1e-9)


def five_bar(crank: float = 100.0, forearm: float = 100.0, stretched: bool = False) -> Mechanism:
    """A 5-bar without limits, its shoulders 60 apart; its first leg bent by a right angle at home, or stretched."""
    tip = np.array([crank, forearm, 0.0]) if not stretched else np.array([0.6, 0.8, 0.0]) * (crank + forearm)
    elbow = np.array([crank, 0.0, 0.0]) if not stretched else np.array([0.6, 0.8, 0.0]) * crank
    z = (0, 0, 1)
    joints = [
        Joint("A1", "revolute", ("base", "crank1"), at=(0, 0, 0), axis=z, actuated=True),
        Joint("B1", "revolute", ("crank1", "rod1"), at=elbow, axis=z),
        Joint("T", "revolute", ("rod1", "rod2"), at=tip, axis=z),
        Joint("B2", "revolute", ("rod2", "crank2"), at=tip + [120.0, -90.0, 0.0], axis=z),
        Joint("A2", "revolute", ("crank2", "base"), at=(60.0, 0, 5.0), axis=z, actuated=True),
    ]
    return Mechanism("unlimited 5-bar", joints, "T")


def test_a_leg_reaches_out_to_its_stretch_and_not_beyond() -> None:
    mechanism = five_bar(110.0, 70.0)
    slack = TOLERANCES.limit * mechanism.characteristic_length
    direction = np.array([0.6, 0.8, 0.0])
    for distance, reached in ((180 - 1e-3, True), (180 + 0.5 * slack, True), (180 + 2 * slack, False)):
        assert geometric.solve_ik(mechanism, distance * direction).reached is reached
    for distance, reached in ((40 + 1e-3, True), (40 - 0.5 * slack, True), (40 - 2 * slack, False)):
        assert geometric.solve_ik(mechanism, distance * direction).reached is reached
    answer = geometric.solve_ik(mechanism, 180 * direction)
    assert answer.actuators[0] == pytest.approx(np.arctan2(0.8, 0.6), abs=1e-6)


def test_a_tip_off_its_plane_is_not_reached() -> None:
    mechanism = five_bar()
    slack = TOLERANCES.limit * mechanism.characteristic_length
    assert geometric.solve_ik(mechanism, [90, 80, 0.5 * slack])
    assert not geometric.solve_ik(mechanism, [90, 80, -2 * slack])


def test_where_a_leg_has_no_side_the_branch_is_the_documented_one() -> None:
    on_shoulder = geometric.solve_ik(five_bar(), [0.0, 0, 0])
    assert on_shoulder
    assert on_shoulder.actuators[0] == 0.0  # every angle serves: home's
    mechanism = five_bar(stretched=True)
    bent = geometric.solve_ik(mechanism, 0.9 * np.array(mechanism.reference_point))
    assert bent
    assert bent.actuators[0] == pytest.approx(np.arccos(0.9))  # home is stretched: to the left


def test_a_tip_has_no_orientation() -> None:
    bar = pf.load("five_bar")
    wanted = some_targets(bar, 100)
    turned = wanted.copy()
    turned[:, :3, :3] = Rotation.random(len(wanted), random_state=1).as_matrix()
    np.testing.assert_array_equal(geometric.solve_ik(bar, turned).actuators, geometric.solve_ik(bar, wanted).actuators)


# --- redundant coordinates -------------------------------------------------------------------------------------------


def grid_of(mechanism: Mechanism) -> oracles.Array:
    """All candidates of an arm, (c, 2); the arms are alike."""
    arm = oracles.arms(mechanism)[0]
    sides = [np.linspace(*joint.range, arms.CANDIDATES_A_SIDE) for joint in (arm.hinge, arm.slide)]
    return np.stack(np.meshgrid(*sides, indexing="ij")).reshape(2, -1).T


@pytest.mark.parametrize("started", [False, True])
def test_redundant_coordinates_stay_or_go_to_the_nearest_candidate(started: bool) -> None:
    mechanism = pf.load("nrpm")
    wanted = some_targets(mechanism, 200, seed=2)
    column = mechanism.actuator_names.index
    starts = np.tile([mechanism.home_coordinate(name) for name in mechanism.actuator_names], (len(wanted), 1))
    if started:
        rng = np.random.default_rng(4)
        for arm in oracles.arms(mechanism):
            for joint in (arm.hinge, arm.slide):
                starts[:, column(joint.name)] = rng.uniform(*joint.range, len(wanted))
    answer = geometric.solve_ik(mechanism, wanted, start=SimpleNamespace(actuators=starts) if started else None)
    grid = grid_of(mechanism)
    found = np.ones(len(wanted), bool)
    stayed = 0
    for arm in oracles.arms(mechanism):
        columns = [column(arm.hinge.name), column(arm.slide.name)]
        size = np.ptp([arm.hinge.range, arm.slide.range], axis=1)
        keeps = arm.lines(wanted, starts[:, columns[0]]).slack(starts[:, columns[1]]) >= 0
        stayed += keeps.sum()
        for row, target in enumerate(wanted):
            options = starts[row : row + 1, columns]
            if not keeps[row]:
                feasible = arm.lines(np.tile(target, (len(grid), 1, 1)), grid[:, 0]).slack(grid[:, 1]) >= -1e-9
                options = grid[feasible]
            found[row] &= len(options) > 0
            if answer.reached[row]:
                distance = (((options - starts[row, columns]) / size) ** 2).sum(axis=1)
                taken = options[np.isclose(distance, distance.min(), rtol=1e-9)]
                assert np.isclose(taken, answer.actuators[row, columns], rtol=0, atol=1e-12).all(axis=1).any()
    np.testing.assert_array_equal(answer.reached, found)
    assert 0 < stayed < 3 * len(wanted)
    assert 0 < found.sum() < len(wanted)


def test_an_answer_as_start_keeps_its_redundant_coordinates() -> None:
    mechanism = pf.load("nrpm")
    wanted = some_targets(mechanism, 400)
    wanted = wanted[geometric.solve_ik(mechanism, wanted).reached]
    for first in (geometric.solve_ik(mechanism, wanted), pf.solve_ik(mechanism, wanted)):
        again = geometric.solve_ik(mechanism, wanted, start=first)
        np.testing.assert_allclose(again.actuators, first.actuators, rtol=0, atol=1e-6)


def test_a_single_start_serves_every_row_as_it_serves_one() -> None:
    mechanism = pf.load("nrpm")
    wanted = some_targets(mechanism, 400)
    near = geometric.solve_ik(mechanism, pf.pose([30, 20, 215]))
    batch = geometric.solve_ik(mechanism, wanted, start=near)
    rows = SimpleNamespace(actuators=np.tile(near.actuators, (len(wanted), 1)))
    np.testing.assert_array_equal(batch.actuators, geometric.solve_ik(mechanism, wanted, start=rows).actuators)
    for row in range(0, len(wanted), 37):
        single = geometric.solve_ik(mechanism, wanted[row], start=near)
        np.testing.assert_array_equal(single.actuators, batch.actuators[row])


def test_a_start_out_of_range_does_not_stay() -> None:
    mechanism = pf.load("nrpm")
    home = geometric.solve_ik(mechanism, mechanism.home_pose).actuators
    for joint, value, slack in (("A1", np.radians(135), 1e-9), ("B2", 130.0, 1e-9 * mechanism.characteristic_length)):
        wide = relimited(mechanism, **{name: None for name in mechanism.actuator_names if name[0] == "D"})
        wide = wide.with_limits(dict.fromkeys(("CL1", "CR1", "EL1", "ER1", "CL2", "CR2", "EL2", "ER2")))
        column = mechanism.actuator_names.index(joint)
        for beyond, stays in ((0.5 * slack, True), (2 * slack, False)):
            start = home.copy()
            start[column] = value + beyond
            answer = geometric.solve_ik(wide, mechanism.home_pose, start=SimpleNamespace(actuators=start))
            assert answer
            assert (answer.actuators[column] == start[column]) == stays
            assert answer.actuators[column] == pytest.approx(value)


def test_arms_without_ranges_search_a_turn_and_a_length_to_either_side() -> None:
    mechanism = relimited(pf.load("nrpm"), **{f"{name}{i}": None for name in "AB" for i in (1, 2, 3)})
    wanted = some_targets(mechanism, 400)
    limited = geometric.solve_ik(pf.load("nrpm"), wanted)
    answer, solution = geometric.solve_ik(mechanism, wanted), pf.solve_ik(mechanism, wanted)
    assert answer.reached.sum() > 0.9 * limited.reached.sum()
    assert (solution.status[answer.reached] == pf.Status.REACHED).all()


# --- limits on both sides of their thresholds ------------------------------------------------------------------------


def cone_angle(mechanism: Mechanism, joint: str, other: str, target: oracles.Array) -> float:
    """Angle between the axis of a cone, fixed to base or platform, and its line [rad]."""
    at = {name: np.array(mechanism.joint(name).at) for name in (joint, other)}
    for name, point in at.items():
        if mechanism.end_effector in mechanism.joint(name).connects:
            at[name] = target[:3, :3] @ (point - mechanism.reference_point) + target[:3, 3]
    cone = mechanism.joint(joint).cone
    axis = np.array(cone.axis)
    if cone.fixed_to == mechanism.end_effector:
        axis = target[:3, :3] @ axis
    line = at[other] - at[joint]
    return float(np.arctan2(np.linalg.norm(np.cross(axis, line)), axis @ line))


BESIDE = {
    "five_bar": pf.pose([0, 20, 190]),
    "stewart": pf.pose([15, -10, 205], rpy=[0.1, 0.05, -0.2]),
    "nrpm": pf.pose([6, -4, 204], rpy=[0.03, 0.02, -0.05]),
}
"""Targets near home, where every limit can be put on either side."""
RANGED = [("five_bar", "p1"), ("five_bar", "p2"), ("five_bar", "p4"), ("five_bar", "p5"), ("stewart", "BL1")]
RANGED += [("stewart", "BR3"), ("nrpm", "DL2"), ("nrpm", "DR1")]


@pytest.mark.parametrize("name, joint", RANGED)
def test_a_range_is_kept_to_its_tolerance_and_no_further(name: str, joint: str) -> None:
    mechanism, target = pf.load(name), BESIDE[name]
    value, home = pf.solve_ik(mechanism, target).joints[joint], mechanism.home_coordinate(joint)
    slides = mechanism.joint(joint).type == "prismatic"
    slack = TOLERANCES.limit * (mechanism.characteristic_length if slides else 1.0)
    low, high = mechanism.joint(joint).range
    for inside, stays in ((0.5 * slack, True), (2 * slack, False)):
        limits = (low, value - inside) if value > home else (value + inside, high)
        answer = geometric.solve_ik(relimited(mechanism, **{joint: limits}), target)
        if name == "nrpm":  # the arm moves, and so the limit is kept
            assert (answer.actuators[mechanism.actuator_names.index(joint)] == pytest.approx(value, abs=1e-6)) == stays
        else:
            assert answer.reached is stays


@pytest.mark.parametrize("joint, other", [("AL1", "CL1"), ("AR2", "CR2"), ("CL3", "AL3"), ("CR1", "AR1")])
def test_a_cone_is_kept_to_its_tolerance_and_no_further(joint: str, other: str) -> None:
    stewart = pf.load("stewart").with_limits(dict.fromkeys(pf.load("stewart").actuator_names))
    aside = [BESIDE["stewart"] @ pf.pose([0, y, 0], rpy=[0.01 * y, 0, 0]) for y in (-40, 40)]
    target = max(aside, key=lambda each: cone_angle(stewart, joint, other, each))
    angle = cone_angle(stewart, joint, other, target)
    assert angle > cone_angle(stewart, joint, other, stewart.home_pose)
    cone = stewart.joint(joint).cone
    wide = {each.name: None for each in stewart.joints if each.cone and each.name != joint}
    for inside, reached in ((0.5e-9, True), (2e-9, False)):
        limited = relimited(stewart, **wide, **{joint: dataclasses.replace(cone, half_angle=angle - inside)})
        assert geometric.solve_ik(limited, target).reached is reached


@pytest.mark.parametrize("joint, other", [("CL1", "EL1"), ("CR3", "ER3"), ("EL2", "CL2")])
def test_a_cone_on_a_crossbar_moves_the_arm_when_it_is_exceeded(joint: str, other: str) -> None:
    nrpm, target = pf.load("nrpm"), BESIDE["nrpm"]
    angle = cone_angle(nrpm, joint, other, target)  # at home's arms a crossbar is where it is at home
    cone = nrpm.joint(joint).cone
    columns = [nrpm.actuator_names.index(f"{letter}{joint[-1]}") for letter in "AB"]
    at_home = [nrpm.home_coordinate(nrpm.actuator_names[column]) for column in columns]
    for inside, stays in ((0.5e-9, True), (2e-9, False)):
        limited = relimited(nrpm, **{joint: dataclasses.replace(cone, half_angle=angle - inside)})
        answer = geometric.solve_ik(limited, target)
        assert (answer.actuators[columns] == at_home).all() == stays


def test_cones_of_half_a_turn_and_more_limit_nothing() -> None:
    stewart = pf.load("stewart")
    wide = {
        joint.name: dataclasses.replace(joint.cone, half_angle=np.pi) if joint.cone else None
        for joint in stewart.joints
    }
    wanted = some_targets(stewart, 400)
    for mechanism in (stewart.with_limits(wide), stewart.without_limits()):
        assert geometric.solve_ik(mechanism, wanted)


def test_a_strut_without_length_keeps_every_cone() -> None:
    stewart = pf.load("stewart").with_limits(dict.fromkeys(pf.load("stewart").actuator_names))
    head = np.array(stewart.joint("CL1").at) - stewart.reference_point
    only = {joint.name: None for joint in stewart.joints if joint.cone and joint.name not in ("AL1", "CL1")}
    foot = np.array(stewart.joint("AL1").at)
    answer = geometric.solve_ik(stewart.with_limits(only), foot - head)
    assert answer
    assert answer.actuators[stewart.actuator_names.index("BL1")] == pytest.approx(0.0, abs=1e-12)


# --- descriptions that count otherwise -------------------------------------------------------------------------------


def test_a_strut_may_be_described_from_its_other_end_and_counted_from_home() -> None:
    stewart = pf.load("stewart")
    foot, head = (np.array(stewart.joint(name).at) for name in ("AL1", "CL1"))
    counted = {"along": None, "axis": head - foot, "home": 10.0, "range": (-40.0, 85.0)}
    backwards = {"along": None, "axis": foot - head, "home": 3.0, "range": (-72.0, 53.0)}
    other = redescribed(
        stewart,
        AL1={"connects": ("cylinderL1", "base")},
        BL1={"connects": ("rodL1", "cylinderL1")},
        CL2={"connects": ("platform", "rodL2")},
        BL2=counted | {"axis": np.subtract(stewart.joint("CL2").at, stewart.joint("AL2").at)},
        BR1=backwards | {"axis": np.subtract(stewart.joint("AR1").at, stewart.joint("CR1").at)},
    )
    wanted = some_targets(stewart)
    answer, solution = geometric.solve_ik(other, wanted), pf.solve_ik(other, wanted)
    plain = geometric.solve_ik(stewart, wanted)
    np.testing.assert_array_equal(answer.reached, solution.status == pf.Status.REACHED)
    np.testing.assert_array_equal(answer.reached, plain.reached)
    np.testing.assert_allclose(answer.actuators[answer.reached], solution.actuators[answer.reached], rtol=0, atol=1e-9)


def test_arms_and_cranks_may_be_described_from_their_other_end() -> None:
    nrpm, bar = pf.load("nrpm"), pf.load("five_bar")
    turned_arm = redescribed(
        nrpm,
        A1={"connects": ("arm1", "base"), "axis": np.negative(nrpm.joint("A1").axis)},
        B2={"connects": ("crossbar2", "arm2"), "axis": np.negative(nrpm.joint("B2").axis)},
    )
    turned_crank = redescribed(
        bar,
        p1={"connects": ("link1", "base"), "axis": np.negative(bar.joint("p1").axis)},
        p4={"connects": ("link3", "link4"), "axis": np.negative(bar.joint("p4").axis)},
        p5={"connects": ("link4", "base")},
    )
    for mechanism, other, signs in ((nrpm, turned_arm, {}), (bar, turned_crank, {"p5": -1.0})):
        wanted = some_targets(mechanism, 400)
        plain, answer = geometric.solve_ik(mechanism, wanted), geometric.solve_ik(other, wanted)
        expected = plain.actuators * [signs.get(name, 1.0) for name in mechanism.actuator_names]
        np.testing.assert_array_equal(answer.reached, plain.reached)
        np.testing.assert_allclose(answer.actuators, expected, rtol=0, atol=1e-9)


def test_bodies_that_are_fixed_to_the_base_count_as_the_base() -> None:
    stewart = pf.load("stewart")
    mount = {"connects": ("mount", "cylinderL1"), "cone": Cone((0, 0, 1), np.radians(50), "mount")}
    joints = [dataclasses.replace(joint, **mount) if joint.name == "AL1" else joint for joint in stewart.joints]
    mounted = dataclasses.replace(stewart, joints=(*joints, Joint("bolt", "fixed", ("base", "mount"), at=(90, 0, 0))))
    wanted = some_targets(stewart, 400)
    expected = geometric.solve_ik(stewart, wanted)
    np.testing.assert_array_equal(geometric.solve_ik(mounted, wanted).actuators, expected.actuators)


# --- batches and wrong calls -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_a_batch_is_answered_row_by_row(name: str) -> None:
    mechanism = pf.load(name)
    wanted = some_targets(mechanism, 300)[: 2 * (len(some_targets(mechanism, 300)) // 2)]
    flat = geometric.solve_ik(mechanism, wanted)
    assert flat.reached.shape == (len(wanted),)
    assert not flat
    np.testing.assert_array_equal(
        np.isnan(flat.actuators), np.tile(~flat.reached, (len(mechanism.actuator_names), 1)).T
    )
    folded = geometric.solve_ik(mechanism, wanted.reshape(2, -1, 4, 4))
    assert folded.reached.shape == (2, len(wanted) // 2)
    np.testing.assert_array_equal(folded.actuators.reshape(flat.actuators.shape), flat.actuators)
    for row in range(0, len(wanted), 29):
        single = geometric.solve_ik(mechanism, wanted[row])
        assert single.actuators.shape == flat.actuators.shape[1:]
        assert single.reached is bool(flat.reached[row]) is bool(single)
        np.testing.assert_array_equal(single.actuators, flat.actuators[row])


@pytest.mark.parametrize("name", NAMES)
def test_targets_come_in_every_form_that_the_solver_takes(name: str) -> None:
    mechanism = pf.load(name)
    wanted = some_targets(mechanism, 60)
    expected = geometric.solve_ik(mechanism, wanted)
    locked = wanted.copy()
    locked.setflags(write=False)
    strided = np.asfortranarray(np.repeat(wanted, 2, axis=0))[::2]
    for form in (wanted.tolist(), locked, strided, RigidTransform.from_matrix(wanted)):
        answer = geometric.solve_ik(mechanism, form)
        np.testing.assert_allclose(answer.actuators, expected.actuators, rtol=0, atol=1e-9)
    level = oracles.poses(wanted[:, :3, 3])
    np.testing.assert_array_equal(
        geometric.solve_ik(mechanism, wanted[:, :3, 3]).actuators,
        geometric.solve_ik(mechanism, level).actuators,
    )
    if not INTERPRETED:
        assert len(closed_form(mechanism).kernel.signatures) == 1


@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")  # of interpreted kernels
@pytest.mark.parametrize("name", NAMES)
def test_rows_that_are_no_poses_are_named_as_the_solver_names_them(name: str) -> None:
    mechanism = pf.load(name)
    wanted = np.tile(mechanism.home_pose, (90, 1, 1))
    wanted[70, 0, 3] = np.nan
    wanted[71, 0, 0] = np.inf
    wanted[72, :3, :3] *= 1.01
    wanted[73, :3, :3] *= -1
    wanted[74, 3, 3] = 2.0
    wanted[75, 3, 0] = np.nan
    errors = []
    for solve in (geometric.solve_ik, pf.solve_ik):
        with pytest.raises(InvalidArgument) as caught:
            solve(mechanism, wanted)
        errors.append(caught.value)
    assert errors[0].rows == errors[1].rows == (70, 71, 72, 73, 74)
    assert str(errors[0]) == str(errors[1])
    for row in range(70, 76):
        with pytest.raises(InvalidArgument):
            geometric.solve_ik(mechanism, wanted[row])


@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_a_rotation_typed_with_few_digits_counts_as_the_solver_counts_it(factor: float) -> None:
    stewart = pf.load("stewart")
    assert TOLERANCES.rotation_matrix == targets.NOT_A_ROTATION
    rough = BESIDE["stewart"].copy()
    rough[:3, 0] *= np.sqrt(1 + factor * TOLERANCES.rotation_matrix)
    if factor > 1:
        with pytest.raises(InvalidArgument):
            geometric.solve_ik(stewart, rough)
        return
    for noise in (rough, np.round(BESIDE["stewart"], 7)):
        expected = pf.solve_ik(stewart, noise).actuators
        np.testing.assert_allclose(geometric.solve_ik(stewart, noise).actuators, expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize("distance", [1e4, 1e10, 1e12, 1e160, 1e308])
@pytest.mark.parametrize("name", NAMES)
def test_no_target_is_too_far_to_be_missed(name: str, distance: float) -> None:
    for mechanism in (pf.load(name), pf.load(name).without_limits()):
        length = mechanism.characteristic_length
        answer = geometric.solve_ik(mechanism, np.array([[0.0, 0.0, distance], [0.0, -distance, distance / 3]]))
        may_reach = name != "five_bar" and mechanism == mechanism.without_limits() and distance < facts.HORIZON * length
        assert answer.reached.tolist() == [may_reach, may_reach]
        assert np.isnan(answer.actuators).all() == (not may_reach)


STEWART, FIVE_BAR = pf.load("stewart"), pf.load("five_bar")


def two_struts(tip: bool = False) -> Mechanism:
    """Two struts on a platform that they do not hold, or that meet at a tip."""
    joints = []
    for i, foot in enumerate(([0, 0, 0], [200, 30, 0]), 1):
        joints += [
            Joint(f"A{i}", "universal", ("base", f"c{i}"), at=foot),
            Joint(f"B{i}", "prismatic", (f"c{i}", f"r{i}"), along=(f"A{i}", "T" if tip else f"C{i}"), actuated=True),
            Joint(f"C{i}", "spherical", (f"r{i}", "platform"), at=(80 + 20 * i, 60, 250)),
        ]
    if tip:
        joints = [joint for joint in joints if joint.name[0] != "C"]
        joints.append(Joint("T", "spherical", ("r1", "r2"), at=(80, 60, 250)))
    return Mechanism("two struts", joints, "T" if tip else "platform", None if tip else (100, 60, 250))


def spinning() -> Mechanism:
    """A 6-UPS with a driven tool that hangs beside the way to its platform."""
    tool = [
        Joint(f"spin{k}", "revolute", bodies, at=(0, 0, 200), axis=(0, 0, 1), actuated=k == 1)
        for k, bodies in enumerate((("platform", "tool"), ("tool", "platform")), 1)
    ]
    return dataclasses.replace(STEWART, joints=(*STEWART.joints, *tool))


UNSUITABLE = {
    "another topology": lambda: pf.load("delta"),
    "the cone of A1 turns with its strut": lambda: redescribed(two_struts(), A1={"cone": Cone((1, 0, 0), 0.9, "c1")}),
    "A1 has ranges about two axes": lambda: redescribed(
        two_struts(), A1={"axes": ((-60, 100, 0), (0, 0, 1)), "range": ((-1, 1), (-1, 1))}
    ),
    "BL1 does not point along its strut": lambda: redescribed(
        STEWART, BL1={"along": None, "axis": (0, 0, 1), "range": (-10, 10)}
    ),
    "its end effector is a joint": lambda: two_struts(tip=True),
    "the range of p3 ties its legs together": lambda: redescribed(FIVE_BAR, p3={"range": (-1, 1)}),
    "its axes are not all parallel": lambda: redescribed(FIVE_BAR, p2={"axis": (1, 0.01, 0)}),
    "actuated joint spin1 is in no sub-chain": spinning,
    "its task leaves out a part of the pose": lambda: dataclasses.replace(pf.load("nrpm"), task=("z", "tilt")),
}


@pytest.mark.parametrize("reason", UNSUITABLE)
def test_what_has_no_closed_form_is_told_what_has(reason: str) -> None:
    mechanism = UNSUITABLE[reason]()
    with pytest.raises(NoClosedForm, match=re.escape(reason)) as caught:
        geometric.solve_ik(mechanism, mechanism.home_pose)
    error = caught.value
    assert (error.mechanism, error.sub_chains) == (mechanism.name, tuple(map(str, pf.decompose(mechanism))))
    assert [part in str(error) for part in (mechanism.name, *error.sub_chains, *EXAMPLES)].count(False) == 0
    assert vars(pickle.loads(pickle.dumps(error))) == vars(error)


def test_wrong_calls_are_told() -> None:
    stewart = pf.load("stewart")
    for mechanism, target, start, argument in (
        ("stewart", [0, 0, 190], None, "mechanism"),
        (stewart, [0, 190], None, "target"),
        (stewart, "up", None, "target"),
        (stewart, [0, 0, 190], "home", "start"),
        (stewart, [0, 0, 190], SimpleNamespace(actuators=[1, 2]), "start"),
        (stewart, [[0, 0, 190]] * 3, SimpleNamespace(actuators=np.ones((2, 6))), "start"),
        (stewart, [0, 0, 190], geometric.solve_ik(stewart, [0, 0, 1e4]), "start"),
    ):
        with pytest.raises(InvalidArgument) as caught:
            geometric.solve_ik(mechanism, target, start=start)
        assert caught.value.argument == argument
