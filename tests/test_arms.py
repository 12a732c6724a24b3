"""Arms: hinges and slides that the pose leaves open, below rods that slide."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import oracles
import pfabrik as pf
from pfabrik.closure.closure_engine import ClosureEngine
from pfabrik.decomposition.leg_forms import RedundantJoint
from pfabrik.engine import engine_of
from pfabrik.errors import UnsupportedMechanism
from pfabrik.files import loads
from pfabrik.model import model_of
from pfabrik.options import Options
from pfabrik.platform.legs_engine import LegsEngine

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
