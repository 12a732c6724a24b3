"""The paper's closed forms: against other closed forms in NumPy and the library's own engines."""

from __future__ import annotations

import dataclasses
import pickle
import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

import machines
import oracles
import pfabrik as pf
from checks import INTERPRETED, home_values
from machines.redescribed import reversed_joints
from paper import geometric
from paper.geometric import NoClosedForm, arms, facts, targets
from paper.geometric.topologies import TOPOLOGIES, closed_form
from pfabrik import Cone, Joint, Mechanism
from pfabrik.errors import InvalidArgument
from pfabrik.tolerances import TOLERANCES

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

EXAMPLES = {"R*-R-R": "five_bar", "U-P*-S": "stewart", "R*-P*-[U-P*-S, U-P*-S]": "nrpm"}
"""A machine of every topology with a closed form."""
NAMES = tuple(EXAMPLES.values())
ON_THE_EDGE = 1e-8
"""Margins that the oracle does not tell from 0."""
DOCS = Path(__file__).parents[1] / "docs"


def some_targets(mechanism: Mechanism, n: int = 1000, seed: int = 11) -> oracles.Array:
    return oracles.random_targets(mechanism, np.random.default_rng(seed), n // 20 if INTERPRETED else n)


def redescribed(mechanism: Mechanism, **changes: dict[str, Any]) -> Mechanism:
    """The mechanism with some fields of some joints replaced."""
    joints = [dataclasses.replace(joint, **changes.get(joint.name, {})) for joint in mechanism.joints]
    return dataclasses.replace(mechanism, joints=tuple(joints))


@pytest.mark.parametrize("topology", TOPOLOGIES, ids=str)
def test_every_topology_has_an_example_is_told_from_its_sub_chains_and_says_where_it_is_from(topology: Any) -> None:
    mechanism = pf.load(EXAMPLES[topology.chain])
    assert {str(chain) for chain in pf.decompose(mechanism)} == {topology.chain}
    assert closed_form(dataclasses.replace(mechanism, name="anything")).kernel is topology.kernel
    assert f"`{topology.chain}`" in (DOCS / "geometric.md").read_text(encoding="utf-8")
    said = topology.kernel.__doc__
    assert "solution" in said and ("Degenerate" in said or "rule" in said)
    source = said.split("Source: ")[1].split()[0].rstrip(".")
    assert f"**{source}**" in (DOCS / "references.md").read_text(encoding="utf-8")


# --- agreement -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["five_bar", "stewart"])
def test_reached_exactly_where_the_oracle_says(name: str) -> None:
    mechanism = pf.load(name)
    wanted = some_targets(mechanism, 600)
    answer, expected = geometric.solve_ik(mechanism, wanted), oracles.solve_ik(mechanism, wanted)
    clear = abs(expected.margin) > ON_THE_EDGE
    np.testing.assert_array_equal(answer.reached[clear], expected.reached[clear])
    assert 0.2 < answer.reached.mean() < 0.8
    off = answer.actuators[answer.reached] - expected.actuators[answer.reached]
    np.testing.assert_allclose(off, 0.0, atol=1e-10)


def test_a_grid_of_candidates_finds_nearly_every_reachable_target_and_no_other_and_keeps_every_limit() -> None:
    mechanism = pf.load("nrpm")
    wanted = some_targets(mechanism, 300)
    answer, margin = geometric.solve_ik(mechanism, wanted), oracles.margin(mechanism, wanted)
    reached = answer.reached
    assert (pf.solve_ik(mechanism, wanted).status[reached] == pf.Status.REACHED).all()
    assert not reached[margin < -ON_THE_EDGE].any()
    assert reached[margin > 0].mean() > 0.97
    assert margin[~reached].max() < 0.1
    values, column = answer.actuators[reached], mechanism.actuator_names.index
    for arm in oracles.arms(mechanism):
        extension = values[:, column(arm.slide.name)]
        lines = arm.lines(wanted[reached], values[:, column(arm.hinge.name)])
        assert (lines.slack(extension) > -ON_THE_EDGE).all()
        for j, strut in enumerate(arm.struts):
            length = np.hypot(np.sqrt(lines.table[:, j, 1]), lines.table[:, j, 0] - extension)
            np.testing.assert_allclose(values[:, column(strut.slide.name)], length, rtol=0, atol=1e-9)


@pytest.mark.parametrize("elbow", [(-3.4, -1.2), (-6.0, 0.2), (-1.6, 4.2), None])
@pytest.mark.parametrize("crank", [(-0.5, 4.5), (-8.0, 8.0), None])
def test_a_leg_takes_its_other_branch_where_homes_breaks_a_limit_and_only_there(elbow: Any, crank: Any) -> None:
    """As leg by leg in NumPy; an elbow may have two intervals of bends, and a crank counts where its range has it."""
    mechanism = pf.load("five_bar").with_limits(p1=crank, p5=(-3.0, 3.0), p2=elbow, p4=(-2.5, 1.7))
    wanted = some_targets(mechanism, 200)
    answer, expected = geometric.solve_ik(mechanism, wanted), oracles.solve_ik(mechanism, wanted)
    np.testing.assert_array_equal(answer.reached, expected.reached)
    assert answer.reached.any()
    off = answer.actuators[answer.reached] - expected.actuators[answer.reached]
    np.testing.assert_allclose(off, 0.0, atol=1e-9)


def five_bar(crank: float = 100.0, forearm: float = 100.0, stretched: bool = False) -> Mechanism:
    """Without limits, its shoulders 60 apart; its first leg bent by a right angle at home, or stretched."""
    out = np.array([0.6, 0.8])
    elbow, tip = (
        (out * crank, out * (crank + forearm)) if stretched else (np.array([crank, 0]), np.array([crank, forearm]))
    )
    return machines.five_bar([(0, 0), (60, 0)], [elbow, tip + [120, -90]], tip)


def test_a_leg_reaches_out_to_its_stretch_and_not_beyond_and_only_in_its_plane() -> None:
    mechanism = five_bar(110.0, 70.0)
    slack, out = TOLERANCES.limit * mechanism.characteristic_length, np.array([0.6, 0.8, 0.0])
    reached = [180 * out, (180 + 0.5 * slack) * out, (40 - 0.5 * slack) * out, [90, 80, 0.5 * slack]]
    missed = [(180 + 2 * slack) * out, (40 - 2 * slack) * out, [90, 80, -2 * slack]]
    assert geometric.solve_ik(mechanism, reached + missed).reached.tolist() == [True] * 4 + [False] * 3
    answer = geometric.solve_ik(mechanism, 180 * out)
    assert answer.actuators[0] == pytest.approx(np.arctan2(0.8, 0.6), abs=1e-6)


def test_where_a_leg_has_no_side_the_branch_is_the_documented_one() -> None:
    on_shoulder = geometric.solve_ik(five_bar(), [0.0, 0, 0])
    assert on_shoulder and on_shoulder.actuators[0] == 0.0  # every angle serves: home's
    mechanism = five_bar(stretched=True)
    bent = geometric.solve_ik(mechanism, 0.9 * np.array(mechanism.reference_point))
    assert bent and bent.actuators[0] == pytest.approx(np.arccos(0.9))  # home is stretched: to the left


# --- redundant coordinates -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("started", [False, True])
def test_redundant_coordinates_stay_or_go_to_the_nearest_candidate(started: bool) -> None:
    mechanism = pf.load("nrpm")
    wanted = some_targets(mechanism, 100, seed=2)
    column, every_arm = mechanism.actuator_names.index, oracles.arms(mechanism)
    sides = [np.linspace(*j.range, arms.CANDIDATES_A_SIDE) for j in (every_arm[0].hinge, every_arm[0].slide)]
    grid = np.stack(np.meshgrid(*sides, indexing="ij")).reshape(2, -1).T  # the arms are alike
    starts = np.tile(home_values(mechanism), (len(wanted), 1))
    if started:
        rng = np.random.default_rng(4)
        for arm in every_arm:
            for joint in (arm.hinge, arm.slide):
                starts[:, column(joint.name)] = rng.uniform(*joint.range, len(wanted))
    answer = geometric.solve_ik(mechanism, wanted, start=SimpleNamespace(actuators=starts) if started else None)
    found, stayed = np.ones(len(wanted), bool), 0
    for arm in every_arm:
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
    wanted = some_targets(mechanism, 120)
    wanted = wanted[geometric.solve_ik(mechanism, wanted).reached]
    for first in (geometric.solve_ik(mechanism, wanted), pf.solve_ik(mechanism, wanted)):
        again = geometric.solve_ik(mechanism, wanted, start=first)
        np.testing.assert_allclose(again.actuators, first.actuators, rtol=0, atol=1e-6)


def test_a_start_out_of_range_does_not_stay() -> None:
    mechanism = pf.load("nrpm")
    home = geometric.solve_ik(mechanism, mechanism.home_pose).actuators
    free = [name for name in mechanism.actuator_names if name[0] == "D"]
    wide = mechanism.with_limits(dict.fromkeys([*free, "CL1", "CR1", "EL1", "ER1", "CL2", "CR2", "EL2", "ER2"]))
    for joint, value, slack in (("A1", np.radians(135), 1e-9), ("B2", 130.0, 1e-9 * mechanism.characteristic_length)):
        column = mechanism.actuator_names.index(joint)
        for beyond, stays in ((0.5 * slack, True), (2 * slack, False)):
            start = home.copy()
            start[column] = value + beyond
            answer = geometric.solve_ik(wide, mechanism.home_pose, start=SimpleNamespace(actuators=start))
            assert answer
            assert (answer.actuators[column] == start[column]) == stays
            assert answer.actuators[column] == pytest.approx(value)


def test_arms_without_ranges_search_a_turn_and_a_length_to_either_side() -> None:
    limited = pf.load("nrpm")
    mechanism = limited.with_limits(dict.fromkeys(f"{name}{i}" for name in "AB" for i in (1, 2, 3)))
    wanted = some_targets(mechanism, 120)
    answer, solution = geometric.solve_ik(mechanism, wanted), pf.solve_ik(mechanism, wanted)
    assert answer.reached.sum() > 0.9 * geometric.solve_ik(limited, wanted).reached.sum()
    assert (solution.status[answer.reached] == pf.Status.REACHED).all()


# --- limits on both sides of their thresholds ------------------------------------------------------------------------

BESIDE = {
    "five_bar": pf.pose([0, 20, 190]),
    "stewart": pf.pose([15, -10, 205], rpy=[0.1, 0.05, -0.2]),
    "nrpm": pf.pose([6, -4, 204], rpy=[0.03, 0.02, -0.05]),
}
"""Targets near home, where every limit can be put on either side."""


@pytest.mark.parametrize(
    ("name", "joint"), [("five_bar", "p1"), ("five_bar", "p4"), ("stewart", "BL1"), ("nrpm", "DL2"), ("nrpm", "DR1")]
)
def test_a_range_is_kept_to_its_tolerance_and_no_further(name: str, joint: str) -> None:
    mechanism, target = pf.load(name), BESIDE[name]
    value, home = pf.solve_ik(mechanism, target).joints[joint], mechanism.home_coordinate(joint)
    is_slide = mechanism.joint(joint).type == "prismatic"
    slack = TOLERANCES.limit * (mechanism.characteristic_length if is_slide else 1.0)
    low, high = mechanism.joint(joint).range
    for inside, stays in ((0.5 * slack, True), (2 * slack, False)):
        limits = (low, value - inside) if value > home else (value + inside, high)
        answer = geometric.solve_ik(mechanism.with_limits({joint: limits}), target)
        if name == "nrpm":  # the arm moves, and so the limit is kept
            assert (answer.actuators[mechanism.actuator_names.index(joint)] == pytest.approx(value, abs=1e-6)) == stays
        else:
            assert answer.reached is stays


@pytest.mark.parametrize("joint", ["AL1", "CR1"])
def test_a_cone_is_kept_to_its_tolerance_and_no_further(joint: str) -> None:
    stewart = pf.load("stewart")
    others = {each.name: None for each in stewart.joints if (each.cone or each.range) and each.name != joint}
    alone, cone = stewart.with_limits(others), stewart.joint(joint).cone
    aside = [BESIDE["stewart"] @ pf.pose([0, y, 0], rpy=[0.01 * y, 0, 0]) for y in (-40, 40)]
    target = min(aside, key=lambda each: oracles.solve_ik(alone, each).margin)
    angle = cone.half_angle * (1.0 - oracles.solve_ik(alone, target).margin) + TOLERANCES.limit
    for inside, reached in ((0.5e-9, True), (2e-9, False)):
        limited = alone.with_limits({joint: dataclasses.replace(cone, half_angle=float(angle) - inside)})
        assert geometric.solve_ik(limited, target).reached is reached


def test_cones_of_half_a_turn_and_more_limit_nothing() -> None:
    stewart = pf.load("stewart")
    wide = {j.name: dataclasses.replace(j.cone, half_angle=np.pi) if j.cone else None for j in stewart.joints}
    for mechanism in (stewart.with_limits(wide), stewart.without_limits()):
        assert geometric.solve_ik(mechanism, some_targets(stewart, 200))


# --- descriptions that count otherwise -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_joints_may_be_described_from_their_other_body(name: str) -> None:
    """With axes turned over, coordinates are the same; else they change sign, and candidates of arms are others."""
    mechanism = pf.load(name)
    wanted = some_targets(mechanism, 200)
    plain = geometric.solve_ik(mechanism, wanted)
    swapped = {joint.name: {"connects": joint.connects[::-1]} for joint in mechanism.joints}
    negated = {joint.name: {"axis": np.negative(joint.axis)} if joint.axis else {} for joint in mechanism.joints}
    turned_over = {name: swapped[name] | negated[name] for name in swapped}
    signs = np.where([mechanism.joint(each).along is None for each in mechanism.actuator_names], -1.0, 1.0)
    others = [(redescribed(mechanism, **turned_over), 1.0), (reversed_joints(mechanism), signs)]
    for other, sign in others[: 1 if name == "nrpm" else 2]:
        answer = geometric.solve_ik(other, wanted)
        np.testing.assert_array_equal(answer.reached, plain.reached)
        np.testing.assert_allclose(answer.actuators, sign * plain.actuators, rtol=0, atol=1e-9)


def test_struts_may_be_counted_from_home_and_bodies_fixed_to_the_base_count_as_the_base() -> None:
    stewart = pf.load("stewart")
    a, c = (np.array(stewart.joint(name).at) for name in ("AL2", "CL2"))
    mount = {"connects": ("mount", "cylinderL1"), "cone": Cone((0, 0, 1), np.radians(50), "mount")}
    slide = {"along": None, "axis": c - a, "home": 10.0, "range": (-40.0, 85.0)}
    other = redescribed(stewart, BL2=slide, AL1=mount)
    bolt = Joint("bolt", "fixed", ("base", "mount"), at=(90, 0, 0))
    other = dataclasses.replace(other, joints=(*other.joints, bolt))
    wanted = some_targets(stewart, 200)
    plain, answer = geometric.solve_ik(stewart, wanted), geometric.solve_ik(other, wanted)
    np.testing.assert_array_equal(answer.reached, plain.reached)
    counted = (np.array(stewart.actuator_names) == "BL2") * (10.0 - np.linalg.norm(c - a))
    np.testing.assert_allclose(answer.actuators, plain.actuators + counted, rtol=0, atol=1e-9)


# --- batches and wrong calls -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_batches_rows_and_every_form_of_a_target_are_answered_alike(name: str) -> None:
    mechanism = pf.load(name)
    wanted = some_targets(mechanism, 200)
    flat = geometric.solve_ik(mechanism, wanted)
    assert not flat
    np.testing.assert_array_equal(np.isnan(flat.actuators).all(axis=1), ~flat.reached)
    folded = geometric.solve_ik(mechanism, wanted.reshape(2, -1, 4, 4))
    assert folded.reached.shape == (2, len(wanted) // 2)
    np.testing.assert_array_equal(folded.actuators.reshape(flat.actuators.shape), flat.actuators)
    for row in range(0, len(wanted), 29):
        single = geometric.solve_ik(mechanism, wanted[row])
        assert single.reached is bool(flat.reached[row]) is bool(single)
        np.testing.assert_array_equal(single.actuators, flat.actuators[row])
    strided = np.asfortranarray(np.repeat(wanted, 2, axis=0))[::2]
    for form in (wanted.tolist(), strided, RigidTransform.from_matrix(wanted)):
        np.testing.assert_allclose(geometric.solve_ik(mechanism, form).actuators, flat.actuators, rtol=0, atol=1e-9)
    level = geometric.solve_ik(mechanism, oracles.poses(wanted[:, :3, 3]))
    np.testing.assert_array_equal(geometric.solve_ik(mechanism, wanted[:, :3, 3]).actuators, level.actuators)
    if name == "five_bar":  # a tip has no orientation
        np.testing.assert_array_equal(level.actuators, flat.actuators)
    if not INTERPRETED:
        assert len(closed_form(mechanism).kernel.compiled) == 1


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
    expected = pf.solve_ik(stewart, rough).actuators
    np.testing.assert_allclose(geometric.solve_ik(stewart, rough).actuators, expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize("distance", [1e4, 1e12, 1e308])
@pytest.mark.parametrize("name", NAMES)
def test_no_target_is_too_far_to_be_missed(name: str, distance: float) -> None:
    for mechanism in (pf.load(name), pf.load(name).without_limits()):
        length = mechanism.characteristic_length
        answer = geometric.solve_ik(mechanism, np.array([[0.0, 0.0, distance], [0.0, -distance, distance / 3]]))
        may_reach = name != "five_bar" and mechanism == mechanism.without_limits() and distance < facts.HORIZON * length
        assert answer.reached.tolist() == [may_reach, may_reach]
        assert np.isnan(answer.actuators).all() == (not may_reach)


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
    return dataclasses.replace(pf.load("stewart"), joints=(*pf.load("stewart").joints, *tool))


STRAY = {"along": None, "axis": (0, 0, 1), "range": (-10, 10)}
UNSUITABLE: dict[str, Callable[[], Mechanism]] = {
    "another topology": lambda: pf.load("delta"),
    "the cone of A1 turns with its strut": lambda: redescribed(two_struts(), A1={"cone": Cone((1, 0, 0), 0.9, "c1")}),
    "A1 has ranges about two axes": lambda: redescribed(
        two_struts(), A1={"axes": ((-60, 100, 0), (0, 0, 1)), "range": ((-1, 1), (-1, 1))}
    ),
    "BL1 does not point along its strut": lambda: redescribed(pf.load("stewart"), BL1=STRAY),
    "its end effector is a joint": lambda: two_struts(tip=True),
    "the range of p3 ties its legs together": lambda: redescribed(pf.load("five_bar"), p3={"range": (-1, 1)}),
    "its axes are not all parallel": lambda: redescribed(pf.load("five_bar"), p2={"axis": (1, 0.01, 0)}),
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
    assert all(part in str(error) for part in (mechanism.name, *error.sub_chains, *EXAMPLES))
    assert vars(pickle.loads(pickle.dumps(error))) == vars(error)


@pytest.mark.parametrize(
    ("target", "start", "argument"),
    [
        ([0, 190], None, "target"),
        ("up", None, "target"),
        ([0, 0, 190], "home", "start"),
        ([0, 0, 190], SimpleNamespace(actuators=[1, 2]), "start"),
        ([[0, 0, 190]] * 3, SimpleNamespace(actuators=np.ones((2, 6))), "start"),
        ([0, 0, 190], SimpleNamespace(actuators=np.full(6, np.nan)), "start"),
    ],
)
def test_wrong_calls_are_told(target: Any, start: Any, argument: str) -> None:
    with pytest.raises(InvalidArgument) as caught:
        geometric.solve_ik(pf.load("stewart"), target, start=start)
    assert caught.value.argument == argument
