"""Modes are kept: signs of branches against closed forms, and answers against the same question led in small steps."""

from __future__ import annotations

import numpy as np

import pfabrik as pf
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
