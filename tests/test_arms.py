"""Legs on arms: those that the pose leaves open, which move as little as they must, and those that follow."""

from __future__ import annotations

import dataclasses
from functools import cache, partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import oracles
import pfabrik as pf
from checks import INTERPRETED, actuator_units, assert_feasible
from machines import closure, machine, ring
from machines.trunks import arms
from oracles.arms import redundant_margin
from pfabrik import Mechanism, Options, Status
from pfabrik.engines.engine import engine_of
from pfabrik.engines.joints.closure_engine import ClosureEngine
from pfabrik.engines.pose.legs_engine import LegsEngine
from pfabrik.errors import UnsupportedMechanism
from pfabrik.machine.decomposition.leg_forms import RedundantJoint
from pfabrik.machine.model import model_of

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
slow_interpreted = pytest.mark.skipif(INTERPRETED, reason="minutes")

FEET, HEADS = ring(150.0, 0.0, (-10, 10, 110, 130, 230, 250)), ring(80.0, 200.0, (-50, 50, 70, 170, 190, 290))
OUTWARD = [tuple(np.array(foot) / 150.0) for foot in FEET]
RAIL, STRUT, HEAD = (
    {"axis": OUTWARD, "range": (-40, 40)},
    {"range": (170, 250)},
    {"axis": (0, 0, -1), "half_angle": np.pi / 4},
)
NAMES = ("nrpm", "rails", "rails_above")


@cache
def hexapod(name: str) -> Mechanism:
    """The catalogue's, or a hexapod whose feet slide on the base, or whose heads do on the platform."""
    ends = {"base": FEET, "platform": HEADS, "reference_point": (0, 0, 200)}
    if name == "rails":
        return Mechanism.from_legs("P*-U-P*-S", **ends, A=RAIL, C=STRUT, D={"cone": HEAD})
    if name == "rails_above":
        return Mechanism.from_legs("U-P*-S-P*", **ends, B=STRUT, C={"cone": HEAD | {"fixed_to": "CD"}}, D=RAIL)
    return pf.load(name)


def targets(mechanism: Mechanism, n: int, shift: float, turn: float, about: tuple[int, ...] = (1, 1, 1)) -> np.ndarray:
    """Poses (n, 4, 4) up to `shift` [L] and `turn` [rad] from home on each axis."""
    rng, poses = np.random.default_rng(3), np.tile(mechanism.home_pose, (n, 1, 1))
    poses[:, :3, 3] += rng.uniform(-shift, shift, (n, 3)) * mechanism.characteristic_length
    poses[:, :3, :3] = Rotation.from_rotvec(rng.uniform(-turn, turn, (n, 3)) * about).as_matrix() @ poses[:, :3, :3]
    return poses


def moved(mechanism: Mechanism, actuators: np.ndarray, begin: np.ndarray) -> np.ndarray:
    """How far arms are from where they began, (n,) [L and rad, squares summed]."""
    forms = model_of(mechanism).legs.forms
    own = [form.elements[0].joint.name for form in forms if isinstance(form, RedundantJoint)]
    columns = [mechanism.actuator_names.index(name) for name in own]
    return np.linalg.norm(((actuators - begin) / actuator_units(mechanism))[..., columns], axis=-1)


def home_actuators(mechanism: Mechanism) -> np.ndarray:
    return pf.solve_ik(mechanism, mechanism.home_pose).actuators


# --- arms that the pose leaves open ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_arms_move_no_farther_than_needed_and_projections_are_as_near_as_on_joint_coordinates(name: str) -> None:
    mechanism = hexapod(name)
    assert isinstance(engine_of(mechanism), LegsEngine)
    wanted = np.concatenate([targets(mechanism, 40, 0.25, 0.3), targets(mechanism, 15, 1.2, 0.8)])
    answers = pf.solve_ik(mechanism, wanted)
    rows = ClosureEngine(model_of(mechanism)).answer(wanted, None, Options(), keep_mode=False).rows
    np.testing.assert_array_equal(answers.status, rows.status)
    reached, home = answers.status == Status.REACHED, home_actuators(mechanism)
    own, other = moved(mechanism, answers.actuators, home), moved(mechanism, rows.actuators, home)
    assert np.count_nonzero(own[reached] == 0.0) and np.count_nonzero(own[reached] > 1e-3)
    assert (own <= other + 1e-6)[reached].mean() >= 0.95  # each is a local least
    farther = (answers.position_error - rows.measures[:, 0])[~reached] / mechanism.characteristic_length
    assert np.mean(farther <= 1e-6) >= 0.9 and np.median(farther) <= 1e-9
    assert_feasible(mechanism, answers)


@pytest.mark.parametrize("name", NAMES)
def test_where_arms_rest_an_answer_from_home_is_that_from_an_answer_at_home(name: str) -> None:
    mechanism = hexapod(name)
    wanted = targets(mechanism, 40, 0.1, 0.1)
    answers = pf.solve_ik(mechanism, wanted)
    started = pf.solve_ik(mechanism, wanted, start=pf.solve_ik(mechanism, mechanism.home_pose))
    rest = moved(mechanism, answers.actuators, home_actuators(mechanism)) == 0.0
    assert np.count_nonzero(rest & (answers.status == Status.REACHED)) > 6
    for field in ("actuators", "pose", "q", "limit_excess"):
        own, other = getattr(answers, field)[rest], getattr(started, field)[rest]
        np.testing.assert_allclose(own, other, atol=1e-12 * mechanism.characteristic_length)


@pytest.mark.parametrize("name", NAMES)
def test_arms_that_need_not_move_stay_where_the_start_has_them(name: str) -> None:
    mechanism = hexapod(name)
    first = pf.solve_ik(mechanism, targets(mechanism, 40, 0.25, 0.3))
    home = home_actuators(mechanism)
    start = next(each for each in first if each and moved(mechanism, each.actuators, home) > 1e-3)
    again = pf.solve_ik(mechanism, start.pose, start=start)
    assert again and moved(mechanism, again.actuators, start.actuators) == 0.0
    by_vector = pf.solve_ik(mechanism, start.pose, start=start.q)
    assert by_vector and moved(mechanism, by_vector.actuators, start.actuators) <= 1e-12
    path = [pf.pose(xyz) @ start.pose for xyz in np.linspace([0, 0, 0], [0, 0, -1], 5)]
    track = pf.track(mechanism, np.array(path), start=start)
    assert moved(mechanism, np.asarray(track.actuators), start.actuators).max() <= 1e-9


def loop(mechanism: Mechanism, steps: int) -> np.ndarray:
    """Poses (steps + 1, 4, 4) of a closed path that begins at home and turns all ways; half of it is out of reach."""
    turn = np.linspace(0.0, 2.0 * np.pi, steps + 1)
    back, twice = 1.0 - np.cos(turn), np.sin(2.0 * turn)
    shift = mechanism.characteristic_length * np.stack([0.6 * np.sin(turn), 0.36 * back, 0.18 * twice], axis=1)
    turned = Rotation.from_rotvec(0.2 * np.stack([np.sin(turn), twice, back], axis=1)).as_matrix()
    return pf.pose(mechanism.home_pose[:3, 3] + shift, rotation=turned @ mechanism.home_pose[:3, :3])


FOLLOW = {"nearest": pf.track, "centroid": partial(pf.passes.track, options=pf.passes.Options.centroid())}


@pytest.mark.parametrize(("name", "projection"), [("rails", "nearest"), ("nrpm", "centroid")])
def test_half_the_steps_along_a_path_are_half_as_long_reached_or_not(name: str, projection: str) -> None:
    """Or 0.71 times, where limits fold as a square root does; leaps that a track tells of are no steps of arms."""
    mechanism, largest = hexapod(name), []
    for steps in (60, 120):
        track = FOLLOW[projection](mechanism, loop(mechanism, steps))
        changes = np.abs(np.diff(track.actuators, axis=0)) / actuator_units(mechanism)
        largest.append(changes[~np.asarray(track.jumps)[1:]].max())
    assert 0.2 <= np.mean(track.status == Status.PROJECTED) <= 0.8
    assert largest[1] <= 0.8 * largest[0]


@pytest.mark.parametrize("name", NAMES)
def test_no_answer_has_its_arms_farther_than_the_same_pose_asked_for(name: str) -> None:
    mechanism = hexapod(name)
    track = pf.track(mechanism, loop(mechanism, 60))
    rows = np.flatnonzero(~np.asarray(track.jumps)[1:]) + 1
    start = pf.configuration(mechanism, track.q[rows - 1])
    again = pf.solve_ik(mechanism, track.pose[rows], start=start, options=Options(working_mode="keep"))
    far, farther = (
        moved(mechanism, each, track.actuators[rows - 1]) for each in (again.actuators, track.actuators[rows])
    )
    assert np.count_nonzero(far > 1e-3) >= 5
    assert ((farther <= far + 5e-3) | (again.status != Status.REACHED)).all()


def test_maps_that_know_no_arms_say_so() -> None:
    for name in NAMES:
        with pytest.raises(UnsupportedMechanism, match="leave joints"):
            pf.feasibility(hexapod(name), hexapod(name).home_pose)


def test_arms_that_limits_hold_where_a_start_has_them_are_looked_for_from_home() -> None:
    """Three targets well within reach, each from an answer from which no search along the arms leads there."""
    mechanism, rng = pf.load("nrpm"), np.random.default_rng(10_000)
    drawn = oracles.random_targets(mechanism, rng, 10_000)
    starts, places = drawn[rng.permutation(len(drawn))], [1400, 1687, 9263]
    assert (oracles.margin(mechanism, drawn[places]) > 0.05).all()
    begun = pf.solve_ik(mechanism, starts[places])
    answer = pf.solve_ik(mechanism, drawn[places], start=begun, options=Options(working_mode="any"))
    assert (answer.status == Status.REACHED).all()


VARIANTS = {
    "steep": {"angles": (5, 120, 250), "crossbars": ((-20, 35), (-45, 15), (-30, 30)), "tilt": 50.0, "reach": 100.0},
    "wide": {"angles": (0, 90, 180, 270), "crossbars": ((-10, 55), (-30, 20), (-50, 5), (-25, 25)), "reach": 150.0},
    "four on one": {"angles": (0, 170), "crossbars": ((-60, -25, 20, 50), (-40, 10, 45)), "tilt": 20.0},
    "crossbars that turn": {"angles": (0, 130, 240), "crossbars": ((-30, 30),) * 3, "tilt": 15.0, "elbows": True},
}


@slow_interpreted
@pytest.mark.parametrize("name", VARIANTS)
def test_arms_of_any_dimensions_reach_what_a_search_of_their_own_says_they_can(name: str) -> None:
    """From home and from far away; the search knows crossbars that do not turn, and these lead to a part of it all."""
    mechanism, known = arms(**VARIANTS[name]), arms(**VARIANTS[name] | {"elbows": False})
    wanted = targets(mechanism, 40, 0.35, 0.35)
    margin = redundant_margin(known, wanted)
    reachable = wanted[margin > 1e-3]
    assert len(reachable) >= 8 and pf.solve_ik(known, wanted[margin < -1e-3]).status.min(initial=1) != 0
    for start in (None, pf.solve_ik(mechanism, reachable[::-1].copy())):
        answers = pf.solve_ik(mechanism, reachable, start=start, options=Options(working_mode="any"))
        np.testing.assert_array_equal(answers.status, Status.REACHED)
        assert_feasible(mechanism, answers)


def within_limits(name: str, leg: int, wanted: np.ndarray, slide: np.ndarray) -> np.ndarray:
    """True where a leg of the hexapod on rails keeps its limits with its slide at some values, (n, values)."""
    shifts = np.multiply.outer(slide, OUTWARD[leg])
    feet, heads = np.array(FEET[leg]) + (name == "rails") * shifts, np.array(HEADS[leg]) - (name != "rails") * shifts
    placed = np.einsum("nij,vj->nvi", wanted[:, :3, :3], heads - [0, 0, 200])
    lines = feet - (placed + wanted[:, None, :3, 3])
    length = np.linalg.norm(lines, axis=-1)
    cosine = np.einsum("nvi,ni->nv", lines, -wanted[:, :3, 2]) / length
    return (length >= 170) & (length <= 250) & (cosine >= np.cos(np.radians(45)))


@slow_interpreted
@pytest.mark.parametrize("name", ["rails", "rails_above"])
def test_each_slide_moves_hardly_farther_than_the_least_that_its_leg_asks_for(name: str) -> None:
    """Against all places of each slide, one by one: at the least where what blocks is straight, nearly so elsewhere."""
    mechanism, slide = hexapod(name), np.linspace(-40, 40, 3201)
    wanted = targets(mechanism, 100, 0.25, 0.3)
    answers = pf.solve_ik(mechanism, wanted)
    reached = answers.status == Status.REACHED
    is_reachable, off = np.ones(len(wanted), bool), []
    for leg in range(6):
        is_inside = within_limits(name, leg, wanted, slide)
        is_reachable &= is_inside.any(axis=1)
        least = np.where(is_inside, np.abs(slide), np.inf).min(axis=1)
        rail = f"{'A' if name == 'rails' else 'D'}{leg + 1}"
        own = np.abs(answers.actuators[:, mechanism.actuator_names.index(rail)])
        off.append((own - least)[reached & (least > 0.0)])
        assert (own[reached & (least == 0.0)] <= 1e-9).all()
    np.testing.assert_array_equal(reached, is_reachable)
    off = np.concatenate(off)
    assert len(off) > 30 and off.min() >= -0.026  # the grid's step
    assert np.median(off) <= 0.0 and np.quantile(off, 0.95) <= 1.0 and off.max() <= 10.0


# --- arms that follow from the pose ----------------------------------------------------------------------------------

LOOSE = (
    ("closure.H4", "x y z", (0, 0, 0)),
    ("stewart", "z tilt", (1, 1, 1)),
    ("servo_hexapod", "x y z yaw", (1, 1, 1)),
)


@pytest.mark.parametrize(("name", "task", "about"), LOOSE, ids=[f"{name}, {task}" for name, task, _ in LOOSE])
def test_what_neither_task_nor_legs_tell_stays_where_it_was(name: str, task: str, about: tuple[int, ...]) -> None:
    mechanism = dataclasses.replace(machine(name), task=tuple(task.split()))
    wanted = targets(mechanism, 5, 0.1, 0.2, about)
    answers = pf.solve_ik(mechanism, wanted)
    rows = ClosureEngine(model_of(mechanism)).answer(wanted, None, Options(), keep_mode=False).rows
    np.testing.assert_array_equal(answers.status, rows.status)
    assert_feasible(mechanism, answers)
    again = pf.solve_ik(mechanism, wanted[0], start=answers[0])
    np.testing.assert_allclose(again.pose, answers[0].pose, atol=1e-9 * mechanism.characteristic_length)


@pytest.mark.parametrize("name", ["SCARA", "R + 3-RPS + RR", "3-CRU"])
def test_a_start_may_be_a_joint_vector(name: str) -> None:
    mechanism = machine(f"closure.{name}")
    target = pf.pose(0.03 * mechanism.characteristic_length * np.ones(3)) @ mechanism.home_pose
    answer = pf.solve_ik(mechanism, target)
    again = pf.solve_ik(mechanism, target, start=answer.q)
    np.testing.assert_allclose(again.actuators, answer.actuators, atol=1e-7 * mechanism.characteristic_length)


def test_legs_with_two_carriers_answer_in_all_four_of_their_ways() -> None:
    """Without limits each leg of the 3-RRRS takes hip and knee as it likes; its answers follow where it starts."""
    joints = [dataclasses.replace(each, range=None, cone=None) for each in closure.rrrs().joints]
    mechanism = Mechanism("3-RRRS", joints, "platform", (0, 0, 190))
    wanted = targets(mechanism, 1, 0.05, 0.1)[0]
    modes = pf.working_modes(mechanism, wanted)
    assert modes.total == 4**3
    for mode in list(modes)[:64:5]:
        there = pf.solve_ik(mechanism, wanted, start=mode.q, options=Options(working_mode="keep"))
        assert there.status == Status.REACHED
        np.testing.assert_allclose(np.cos(there.actuators - mode.actuators), 1.0, atol=1e-9)


def test_a_home_at_dead_points_is_one_to_search_from() -> None:
    """At a dead point the distance changes with the square of a step: searches end some 1e-5 apart."""
    mechanism = closure.stretched_delta()
    wanted = targets(mechanism, 60, 0.1, 0.0)
    answers = pf.solve_ik(mechanism, wanted)
    rows = ClosureEngine(model_of(mechanism)).answer(wanted, None, Options(), keep_mode=False).rows
    assert 10 < (answers.status == Status.REACHED).sum() < 50
    np.testing.assert_array_equal(answers.status, rows.status)
    np.testing.assert_array_less(answers.position_error, rows.measures[:, 0] + 2e-5 * mechanism.characteristic_length)


def test_a_carrier_that_its_rod_does_not_place_alone_has_no_dead_point() -> None:
    """Rods of a 4-RRUR face their heads and do not spin: passing over the carrier leads to no other working mode."""
    mechanism = closure.rrur()
    found = pf.solve_fk(mechanism, np.random.default_rng(0).uniform(-1.0, 1.2, (40, 4)))
    poses = found.pose[found.status == Status.REACHED]
    assert len(poses) > 10 and pf.solve_ik(mechanism, poses)
    (along,) = pf.travel(pf.solve_ik(mechanism, mechanism.home_pose), along=(1, 0, 0))
    assert along.stopped_by and along.distance > 25.0


def test_maps_know_arms_that_follow_where_home_is_singular() -> None:
    mechanism = machine("closure.H4")
    wanted = targets(mechanism, 100, 0.4, 0.8, (0, 0, 1))
    feasible = wanted[pf.feasibility(mechanism, wanted).margin > 0.0]
    assert 10 < len(feasible) < 100 and pf.solve_ik(mechanism, feasible)


def test_maps_lead_arms_that_turn_far_near_home() -> None:
    """The tool stands beside the first of two axes, in line with it: to lean, this one turns by up to half a turn."""
    mechanism = closure.stretched_wrist(tool=(0, 10, 270))
    wanted = targets(mechanism, 100, 0.1, 0.3, (1, 1, 0))
    reached = pf.solve_ik(mechanism, wanted, options=Options(working_mode="keep")).status == Status.REACHED
    feasible = pf.feasibility(mechanism, wanted).margin > 0.0
    assert 20 < reached.sum() < 100 and not (feasible & ~reached).any()
    assert (feasible & reached).sum() > 0.97 * reached.sum()


@pytest.mark.compiled
def test_rods_of_one_arm_that_are_not_parallel_have_no_dead_point_alone() -> None:
    """Three rods, two and one on three cranks: where one of three stands square to its crank, the others place it."""
    joints = []
    rods = {0.0: ((20, 25), (-20, 25), (0, -30)), 2.2: ((22, 0), (-22, 0)), -2.0: ((0, 10),)}
    for k, (angle, beside) in enumerate(rods.items()):
        out, across = np.array([np.cos(angle), np.sin(angle), 0]), np.array([-np.sin(angle), np.cos(angle), 0])
        joints.append(
            pf.Joint(f"A{k}", "revolute", ("base", f"arm{k}"), 90 * out, across, actuated=True, range=(-1.1, 0.7))
        )
        for i, (y, z) in enumerate(beside):
            elbow = (170 + 5 * i) * out + y * across + (0, 0, 30 + z)
            platform_end = (30 - 3 * i) * out + y * across + (0, 0, 0.8 * z - 120)
            joints.append(pf.Joint(f"B{k}{i}", "spherical", (f"arm{k}", f"rod{k}{i}"), elbow))
            joints.append(pf.Joint(f"C{k}{i}", "spherical", (f"rod{k}{i}", "platform"), platform_end))
    mechanism = Mechanism("3-2-1", joints, "platform", (0, 0, -120), task=("x", "y", "z"))
    assert isinstance(engine_of(mechanism), LegsEngine)
    (reach,) = pf.travel(pf.solve_ik(mechanism, mechanism.home_pose), along=(1, 0, 0))
    velocities = pf.forward_jacobian(reach.end)[:3] / mechanism.characteristic_length
    assert reach.stopped_by or np.linalg.svd(velocities)[1].min() < 1e-4
