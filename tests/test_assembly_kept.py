"""Modes are kept: signs of branches against closed forms, and answers against the same question led in small steps."""

from __future__ import annotations

import numpy as np
import pytest

import pfabrik as pf
from checks import INTERPRETED, actuator_units, home_values
from pfabrik.files import loads
from pfabrik.model import model_of
from pfabrik.platform.answers import sides_at
from pfabrik.platform.branch import branch_of, same_branch

TWO_LINKS = """
schema = 1
name = "two links"
units = { length = "mm", angle = "deg" }
base = "base"
end_effector = "fore"
reference_point = [150, 0, 0]
task = ["x", "y"]
joint = [
  { name = "A", type = "revolute", actuated = true, connects = ["base", "upper"], at = [0, 0, 0], axis = [0, 0, 1] },
  { name = "B", type = "revolute", actuated = true, connects = ["upper", "fore"], at = [90, 0, 0], axis = [0, 0, 1] },
]
"""


def test_the_branch_of_an_elbow_is_the_sign_of_its_angle() -> None:
    """det C of two links is 90 sin B, to a factor; both branches meet at the stretched home."""
    mechanism = loads(TWO_LINKS)
    angles = np.random.default_rng(0).uniform(-3.0, 3.0, (50, 2))
    answers, model = pf.solve_fk(mechanism, angles), model_of(mechanism)
    signs = branch_of(model, answers.pose, sides_at(model, answers._configurations))
    np.testing.assert_array_equal(signs[:, -1], np.sign(angles[:, 1]))
    home = branch_of(model, mechanism.home_pose[None], model.legs.home_sides)
    assert same_branch(signs, home).all() and not same_branch(signs, -signs).any()


PARALLELOGRAM = """
schema = 1
name = "parallelogram and a wrist"
units = { length = "mm", angle = "deg" }
base = "base"
end_effector = "hand"
reference_point = [1300, 0, 1000]
task = ["x", "z"]
joint = [
  { name = "J2", type = "revolute", actuated = true, connects = ["base", "lower"], at = [0, 0, 0], axis = [0, 1, 0] },
  { name = "J3", type = "revolute", actuated = true, connects = ["base", "lever"], at = [0, 0, 0], axis = [0, 1, 0] },
  { name = "low", type = "revolute", connects = ["lever", "rod"], at = [-400, 0, 0], axis = [0, 1, 0] },
  { name = "elbow", type = "revolute", connects = ["lower", "upper"], at = [0, 0, 1000], axis = [0, 1, 0] },
  { name = "top", type = "spherical", connects = ["rod", "upper"], at = [-400, 0, 1000] },
  { type = "revolute", name = "H", actuated = true, connects = ["upper", "W"], at = [1200, 0, 1e3], axis = [0, 1, 0] },
MORE]
"""

ROLL = """
  { name = "J5", type = "revolute", actuated = true, connects = ["w", "hand"], at = [1300, 0, 1000], axis = [1, 0, 0] },
"""


@pytest.mark.parametrize("more, wrist", [("", "hand"), (ROLL, "w")])
@pytest.mark.parametrize("start", [False, True])
def test_a_joint_behind_a_parallelogram_does_not_fold_it(more: str, wrist: str, start: bool) -> None:
    """A parallelogram's elbow turns by J3 - J2, whatever the wrist does."""
    mechanism = loads(PARALLELOGRAM.replace("MORE", more).replace('"W"', f'"{wrist}"'))
    n = len(mechanism.actuator_names)
    values = np.radians(np.random.default_rng(0).uniform(-65.0, 65.0, (20 if INTERPRETED else 2000, n)))
    values[:, 2] *= 2.0
    values = values[np.abs(values[:, 1] - values[:, 0]) < np.radians(85.0)]
    answer = pf.solve_fk(mechanism, values, start=pf.solve_fk(mechanism, np.zeros(n)) if start else None)
    assert answer
    np.testing.assert_allclose(answer.joints["elbow"], values[:, 1] - values[:, 0], rtol=0, atol=1e-6)


CRANK = """
schema = 1
name = "crank in a four-bar"
units = { length = "mm", angle = "deg" }
base = "base"
end_effector = "coupler"
reference_point = [60, 80, 0]
task = ["x"]
joint = [
  { name = "A", type = "revolute", actuated = true, connects = ["base", "a"], at = [0, 0, 0], axis = [0, 0, 1] },
  { name = "B", type = "revolute", connects = ["a", "coupler"], at = [0, 80, 0], axis = [0, 0, 1] },
  { name = "C", type = "revolute", connects = ["coupler", "c"], at = [100, 80, 0], axis = [0, 0, 1] },
  { name = "D", type = "revolute", connects = ["c", "base"], at = [120, 0, 0], axis = [0, 0, 1] },
]
"""


def led(mechanism: pf.Mechanism, values: np.ndarray, steps: int) -> pf.Solution:
    """Answers to rows of values that are led there from home in small steps."""
    home, answer = home_values(mechanism), None
    for share in np.linspace(1.0 / steps, 1.0, steps):
        answer = pf.solve_fk(mechanism, home + share * (values - home), start=answer)
    assert answer is not None
    return answer


@pytest.mark.parametrize("name", ["rrr", "prr", "reachy_mini", "five_bar", "canfield", "crank"])
def test_an_answer_is_where_small_steps_lead(name: str) -> None:
    """Without limits, far from home; what is not reached has a reason, and the other mode for who asks for any."""
    mechanism = loads(CRANK) if name == "crank" else pf.load(name).without_limits()
    n = len(mechanism.actuator_names)
    spans = np.random.default_rng(0).uniform(-1.0, 1.0, (3 if INTERPRETED else 24, n))
    values = home_values(mechanism) + 0.8 * spans * actuator_units(mechanism)
    answer, small = pf.solve_fk(mechanism, values), led(mechanism, values, 100)
    reached = (answer.status == pf.Status.REACHED) & (small.status == pf.Status.REACHED)
    np.testing.assert_array_equal(answer.status == pf.Status.REACHED, small.status == pf.Status.REACHED)
    np.testing.assert_allclose(
        answer.pose[reached], small.pose[reached], rtol=0, atol=1e-5 * mechanism.characteristic_length
    )
    assert (np.asarray(answer.actuator_error)[~reached] > 1e-9).all()
    assert all("parallel singularity" in row.reason for row in answer[~reached])
    assert pf.solve_fk(mechanism, values[reached], options=pf.Options(working_mode="any"))


def test_a_crank_reaches_in_any_mode_whatever_its_circles_reach() -> None:
    """Coupler and rocker meet if the distance of their ends is at most the sum of both, and at least the difference."""
    mechanism, coupler, rocker = loads(CRANK), 100.0, np.hypot(20.0, 80.0)
    angles = np.linspace(-3.1, 3.1, 8 if INTERPRETED else 40)
    ends = 80.0 * np.column_stack([-np.sin(angles), np.cos(angles)])
    distances = np.linalg.norm(ends - [120.0, 0.0], axis=1)
    answer = pf.solve_fk(mechanism, angles[:, None], options=pf.Options(working_mode="any"))
    meets = (distances <= coupler + rocker) & (distances >= coupler - rocker)
    np.testing.assert_array_equal(answer.status == pf.Status.REACHED, meets)
