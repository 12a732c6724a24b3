"""Arms: hinges and slides that the pose leaves open, below rods that slide."""

from __future__ import annotations

from functools import lru_cache, partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import oracles
import pfabrik as pf
from checks import INTERPRETED, actuator_units, excess_of_joints, gap_of_joints
from machines.trunks import arms
from oracles.arms import redundant_margin
from pfabrik.closure.closure_engine import ClosureEngine
from pfabrik.closure.configurations import new_rows
from pfabrik.decomposition.leg_forms import RedundantJoint
from pfabrik.engine import engine_of
from pfabrik.errors import UnsupportedMechanism
from pfabrik.files import loads
from pfabrik.kernels.legs.answer import answer
from pfabrik.model import model_of
from pfabrik.options import Options
from pfabrik.platform.legs_engine import LegsEngine
from pfabrik.platform.rows_one_by_one import step_redundant_joints
from pfabrik.platform.table import table_handle

slow_interpreted = pytest.mark.skipif(INTERPRETED, reason="minutes")

RAILS = """
schema = 1
name = "Hexapod on rails"
units = { length = "mm", angle = "deg" }
base = "base"
end_effector = "platform"
reference_point = [0, 0, 200]
"""

LEG = """
[[joint]]
name = "rail{leg}"
type = "prismatic"
actuated = true
connects = {rail}
axis = [{x}, {y}, 0]
range = [-40, 40]

[[joint]]
name = "foot{leg}"
type = "universal"
connects = ["{base_end}", "cylinder{leg}"]
at = [{x}, {y}, 0]

[[joint]]
name = "strut{leg}"
type = "prismatic"
actuated = true
connects = ["cylinder{leg}", "rod{leg}"]
along = ["foot{leg}", "head{leg}"]
range = [170, 250]

[[joint]]
name = "head{leg}"
type = "spherical"
connects = ["rod{leg}", "{platform_end}"]
at = [{u}, {v}, 200]
cone = {{ axis = [0, 0, -1], half_angle = 45, fixed_to = "{platform_end}" }}
"""


@lru_cache
def machine(name: str) -> pf.Mechanism:
    """The catalogue's, or a hexapod whose feet slide on the base, or whose heads do on the platform."""
    if name in pf.catalog():
        return pf.load(name)
    legs = ""
    for leg, (low, high) in enumerate(((-10, -50), (10, 50), (110, 70), (130, 170), (230, 190), (250, 290))):
        (x, y), (u, v) = (
            r * np.array([np.cos(np.radians(a)), np.sin(np.radians(a))]) for r, a in ((150, low), (80, high))
        )
        if name == "rails":
            rail, base_end, platform_end = f'["base", "carriage{leg}"]', f"carriage{leg}", "platform"
        else:
            rail, base_end, platform_end = f'["carriage{leg}", "platform"]', "base", f"carriage{leg}"
        legs += LEG.format(leg=leg, x=x, y=y, u=u, v=v, rail=rail, base_end=base_end, platform_end=platform_end)
    return loads(RAILS + legs)


NAMES = ("nrpm", "rails", "rails_above")


def redundant(mechanism: pf.Mechanism) -> list[int]:
    """Places of the arms' actuators."""
    table = model_of(mechanism).legs
    own = [form.elements[0].joint.name for form in table.forms if isinstance(form, RedundantJoint)]
    return [mechanism.actuator_names.index(name) for name in own]


def targets(mechanism: pf.Mechanism, n: int, shift: float, turn: float) -> np.ndarray:
    """Poses (n, 4, 4) up to `shift` [L] and `turn` [rad] from home on each axis."""
    rng, poses = np.random.default_rng(3), np.tile(mechanism.home_pose, (n, 1, 1))
    poses[:, :3, 3] += rng.uniform(-shift, shift, (n, 3)) * mechanism.characteristic_length
    poses[:, :3, :3] = Rotation.from_rotvec(rng.uniform(-turn, turn, (n, 3))).as_matrix()
    return poses


def moved(mechanism: pf.Mechanism, actuators: np.ndarray, begin: np.ndarray) -> np.ndarray:
    """How far arms are from where they began, (n,) [L and rad, squares summed]."""
    own = redundant(mechanism)
    slides = np.array([mechanism.joint(mechanism.actuator_names[k]).type == "prismatic" for k in own])
    off = (actuators - begin)[..., own] / np.where(slides, mechanism.characteristic_length, 1.0)
    return np.linalg.norm(off, axis=-1)


def behind(mechanism: pf.Mechanism, wanted: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Statuses, actuators and position errors of the closure engine, which knows no legs."""
    found = ClosureEngine(model_of(mechanism)).answer(wanted, None, Options(), keep_mode=False).rows
    return found.status, found.actuators, found.measures[:, 0]


@pytest.mark.parametrize("name", NAMES)
def test_what_can_be_reached_is_reached_with_arms_moved_no_farther_than_needed(name: str) -> None:
    mechanism = machine(name)
    assert isinstance(engine_of(mechanism), LegsEngine)
    wanted = targets(mechanism, 60, 0.25, 0.3)
    answers = pf.solve_ik(mechanism, wanted)
    status, actuators, _ = behind(mechanism, wanted)
    reached = np.asarray(answers.status) == pf.Status.REACHED
    np.testing.assert_array_equal(reached, status == pf.Status.REACHED)
    home = pf.solve_ik(mechanism, mechanism.home_pose).actuators
    own, other = moved(mechanism, answers.actuators, home), moved(mechanism, actuators, home)
    assert np.count_nonzero(own[reached] == 0.0) and np.count_nonzero(own[reached] > 1e-3)
    assert (own <= other + 1e-6)[reached].mean() >= 0.95  # each is a local least
    assert pf.closure_residual(answers).max() <= 1e-9 * mechanism.characteristic_length
    assert answers.limit_excess.max() <= 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_where_arms_rest_an_answer_from_home_is_that_from_an_answer_at_home(name: str) -> None:
    mechanism = machine(name)
    wanted = targets(mechanism, 60, 0.1, 0.1)
    answers = pf.solve_ik(mechanism, wanted)
    started = pf.solve_ik(mechanism, wanted, start=pf.solve_ik(mechanism, mechanism.home_pose))
    rest = moved(mechanism, answers.actuators, pf.solve_ik(mechanism, mechanism.home_pose).actuators) == 0.0
    assert np.count_nonzero(rest & (answers.status == pf.Status.REACHED)) > 10
    for field in ("actuators", "pose", "q", "limit_excess"):
        own, other = getattr(answers, field)[rest], getattr(started, field)[rest]
        np.testing.assert_allclose(own, other, atol=1e-12 * mechanism.characteristic_length)


@pytest.mark.parametrize("name", NAMES)
def test_arms_that_need_not_move_stay_where_the_start_has_them(name: str) -> None:
    mechanism = machine(name)
    first = pf.solve_ik(mechanism, targets(mechanism, 60, 0.25, 0.3))
    home = pf.solve_ik(mechanism, mechanism.home_pose).actuators
    start = next(each for each in first if each and moved(mechanism, each.actuators, home) > 1e-3)
    again = pf.solve_ik(mechanism, start.pose, start=start)
    assert again and moved(mechanism, again.actuators, start.actuators) == 0.0
    by_vector = pf.solve_ik(mechanism, start.pose, start=start.q)
    assert by_vector and moved(mechanism, by_vector.actuators, start.actuators) <= 1e-12
    path = [pf.pose(xyz) @ start.pose for xyz in np.linspace([0, 0, 0], [0, 0, -1], 5)]
    track = pf.track(mechanism, np.array(path), start=start)
    assert moved(mechanism, np.asarray(track.actuators), start.actuators).max() <= 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_projections_are_no_farther_than_those_on_joint_coordinates(name: str) -> None:
    mechanism = machine(name)
    wanted = targets(mechanism, 25, 1.2, 0.8)
    answers = pf.solve_ik(mechanism, wanted)
    status, _, error = behind(mechanism, wanted)
    projected = (np.asarray(answers.status) == pf.Status.PROJECTED) & (status == pf.Status.PROJECTED)
    assert projected.sum() >= 15
    farther = (np.asarray(answers.position_error) - error)[projected] / mechanism.characteristic_length
    assert np.mean(farther <= 1e-6) >= 0.9 and np.median(farther) <= 1e-9
    assert pf.closure_residual(answers).max() <= 1e-9 * mechanism.characteristic_length
    assert all(each.active_limits for each in answers if each.status == pf.Status.PROJECTED)


@pytest.mark.parametrize("name", NAMES)
def test_forward_kinematics_returns_what_inverse_kinematics_was_given(name: str) -> None:
    mechanism = machine(name)
    answers = pf.solve_ik(mechanism, targets(mechanism, 40, 0.2, 0.2))
    reached = [each for each in answers if each]
    back = pf.solve_fk(mechanism, np.array([each.actuators for each in reached]))
    poses = np.array([each.pose for each in reached])
    same = np.abs(back.pose - poses).max(axis=(1, 2)) <= 1e-9 * mechanism.characteristic_length
    assert same.mean() >= 0.9  # others are assemblies of their own
    onward = pf.solve_ik(mechanism, back.pose[same], start=back[int(np.flatnonzero(same)[0])])
    assert (np.asarray(onward.status) == pf.Status.REACHED).all()


def loop(mechanism: pf.Mechanism, steps: int) -> np.ndarray:
    """Poses (steps + 1, 4, 4) of a closed path that begins at home and turns all ways; half of it is out of reach."""
    turn, poses = np.linspace(0.0, 2.0 * np.pi, steps + 1), np.tile(mechanism.home_pose, (steps + 1, 1, 1))
    back, twice = 1.0 - np.cos(turn), np.sin(2.0 * turn)
    shift = np.stack([0.6 * np.sin(turn), 0.36 * back, 0.18 * twice], axis=1)
    poses[:, :3, 3] += mechanism.characteristic_length * shift
    turned = Rotation.from_rotvec(0.2 * np.stack([np.sin(turn), twice, back], axis=1)).as_matrix()
    poses[:, :3, :3] = turned @ mechanism.home_pose[:3, :3]
    return poses


FOLLOW = {"nearest": pf.track, "centroid": partial(pf.passes.track, options=pf.passes.Options.centroid())}


@pytest.mark.parametrize("projection", FOLLOW)
@pytest.mark.parametrize("name", ["nrpm", "rails"])
def test_half_the_steps_along_a_path_are_half_as_long_reached_or_not(name: str, projection: str) -> None:
    """Or 0.71 times, where limits fold as a square root does; leaps that a track tells of are no steps of arms."""
    mechanism, largest = machine(name), []
    for steps in (60, 120):
        track = FOLLOW[projection](mechanism, loop(mechanism, steps))
        changes = np.abs(np.diff(track.actuators, axis=0)) / actuator_units(mechanism)
        largest.append(changes[~np.asarray(track.jumps)[1:]].max())
    assert 0.2 <= np.mean(track.status == pf.Status.PROJECTED) <= 0.8
    assert largest[1] <= 0.8 * largest[0]


@pytest.mark.parametrize("projection", FOLLOW)
@pytest.mark.parametrize("name", NAMES)
def test_no_answer_has_its_arms_farther_than_the_same_pose_asked_for(name: str, projection: str) -> None:
    mechanism = machine(name)
    track = FOLLOW[projection](mechanism, loop(mechanism, 60))
    rows = np.flatnonzero(~np.asarray(track.jumps)[1:]) + 1
    start = pf.configuration(mechanism, track.q[rows - 1])
    again = pf.solve_ik(mechanism, track.pose[rows], start=start, options=Options(working_mode="keep"))
    far, farther = (
        moved(mechanism, each, track.actuators[rows - 1]) for each in (again.actuators, track.actuators[rows])
    )
    assert np.count_nonzero(far > 1e-3) >= 5
    assert ((farther <= far + 5e-3) | (again.status != pf.Status.REACHED)).all()


def test_maps_and_code_that_know_no_arms_say_so() -> None:
    for name in NAMES:
        with pytest.raises(UnsupportedMechanism, match="leave joints"):
            pf.feasibility(machine(name), machine(name).home_pose)


def test_arms_that_limits_hold_where_a_start_has_them_are_looked_for_from_home() -> None:
    """Three targets well within reach, each from an answer from which no search along the arms leads there."""
    mechanism, rng = pf.load("nrpm"), np.random.default_rng(10_000)
    targets = oracles.random_targets(mechanism, rng, 10_000)
    starts = targets[rng.permutation(len(targets))]
    places = [1400, 1687, 9263]
    assert (oracles.margin(mechanism, targets[places]) > 0.05).all()
    begun = pf.solve_ik(mechanism, starts[places])
    answer = pf.solve_ik(mechanism, targets[places], start=begun, options=Options(working_mode="any"))
    assert (answer.status == pf.Status.REACHED).all()


VARIANTS = {
    "steep": {"angles": (5, 120, 250), "crossbars": ((-20, 35), (-45, 15), (-30, 30)), "tilt": 50.0, "reach": 100.0},
    "wide": {"angles": (0, 90, 180, 270), "crossbars": ((-10, 55), (-30, 20), (-50, 5), (-25, 25)), "reach": 150.0},
    "four on one": {"angles": (0, 170), "crossbars": ((-60, -25, 20, 50), (-40, 10, 45)), "tilt": 20.0},
    "crossbars that turn": {"angles": (0, 130, 240), "crossbars": ((-30, 30),) * 3, "tilt": 15.0, "elbows": True},
}


@slow_interpreted
@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
@pytest.mark.parametrize("name", VARIANTS)
def test_arms_of_any_dimensions_reach_what_a_search_of_their_own_says_they_can(name: str) -> None:
    """From home and from far away; the search knows crossbars that do not turn, and these lead to a part of it all."""
    mechanism = arms(**VARIANTS[name])
    wanted = targets(mechanism, 80, 0.35, 0.35)
    known = arms(**VARIANTS[name] | {"elbows": False})
    margin = redundant_margin(known, wanted)
    reachable = wanted[margin > 1e-3]
    assert len(reachable) >= 20 and pf.solve_ik(known, wanted[margin < -1e-3]).status.min(initial=1) != 0
    for start in (None, pf.solve_ik(mechanism, reachable[::-1].copy())):
        answers = pf.solve_ik(mechanism, reachable, start=start, options=Options(working_mode="any"))
        np.testing.assert_array_equal(answers.status, pf.Status.REACHED)
        assert gap_of_joints(mechanism, answers).max() <= 1e-9
        assert excess_of_joints(mechanism, answers).max() <= 1e-9


def within_limits(name: str, leg: int, wanted: np.ndarray, slide: np.ndarray) -> np.ndarray:
    """True where a leg of the hexapod on rails keeps its limits with its slide at some values, (n, values)."""
    mechanism = machine(name)
    foot, head = (np.array(mechanism.joint(f"{end}{leg}").at) for end in ("foot", "head"))
    axis = foot / np.linalg.norm(foot)
    feet, heads = (
        foot + (name == "rails") * np.multiply.outer(slide, axis),
        head - (name != "rails") * np.multiply.outer(slide, axis),
    )
    placed = np.einsum("nij,vj->nvi", wanted[:, :3, :3], np.atleast_2d(heads) - mechanism.reference_point)
    lines = feet - (placed + wanted[:, None, :3, 3])
    length = np.linalg.norm(lines, axis=-1)
    cosine = np.einsum("nvi,ni->nv", lines, -wanted[:, :3, 2]) / length
    return (length >= 170) & (length <= 250) & (cosine >= np.cos(np.radians(45)))


@slow_interpreted
@pytest.mark.parametrize("name", ["rails", "rails_above"])
def test_each_slide_moves_hardly_farther_than_the_least_that_its_leg_asks_for(name: str) -> None:
    """Against all places of each slide, one by one: at the least where what blocks is straight, nearly so elsewhere."""
    mechanism, slide = machine(name), np.linspace(-40, 40, 3201)
    wanted = targets(mechanism, 150, 0.25, 0.3)
    answers = pf.solve_ik(mechanism, wanted)
    reached = answers.status == pf.Status.REACHED
    is_reachable, off = np.ones(len(wanted), bool), []
    for leg in range(6):
        is_inside = within_limits(name, leg, wanted, slide)
        is_reachable &= is_inside.any(axis=1)
        least = np.where(is_inside, np.abs(slide), np.inf).min(axis=1)
        own = np.abs(answers.actuators[:, mechanism.actuator_names.index(f"rail{leg}")])
        off.append((own - least)[reached & (least > 0.0)])
        assert (own[reached & (least == 0.0)] <= 1e-9).all()
    np.testing.assert_array_equal(reached, is_reachable)
    off = np.concatenate(off)
    assert len(off) > 50 and off.min() >= -0.026  # the grid's step
    assert np.median(off) <= 0.0 and np.quantile(off, 0.95) <= 1.0 and off.max() <= 10.0


@slow_interpreted
@pytest.mark.parametrize("name", NAMES)
def test_few_steps_solve_almost_all_that_arms_can_reach(name: str) -> None:
    """Without the search behind them; started from other arms, of another answer, as well as from home."""
    mechanism = machine(name)
    model, wanted = model_of(mechanism), targets(mechanism, 200, 0.25, 0.3)
    answers = pf.solve_ik(mechanism, wanted)
    wanted = wanted[answers.status == pf.Status.REACHED]
    home = mechanism.home_pose[None].copy()
    sides = np.repeat(model.legs.home_sides, len(wanted), axis=0)
    for _ in range(2):
        step_redundant_joints(model, wanted, sides)
        rows = new_rows(model, len(wanted))
        handle = table_handle(model.legs)
        n_unsolved = answer(handle.address, wanted, home, sides, rows.status, rows.poses, rows.actuators, rows.measures)
        assert n_unsolved <= 0.02 * len(wanted)
        sides = sides[::-1].copy()
