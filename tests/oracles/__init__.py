"""What answers are checked against: plain NumPy and SciPy on the description, never an engine or a kernel.

`ik` has closed forms of legs: cranks, carriages, struts and guides, with all their branches; `arms` the best
configuration of a redundant mechanism; `targets` draws targets on both sides of the border. `assembly` has closed forms
for forward kinematics, `nearest` a general optimiser for the feasible pose nearest to a target, `search` a blind search
for a configuration that has a pose, `annuli` areas of workspaces. `no_poses` tells poses from other matrices exactly.
"""

from .arms import ACCURACY, arms
from .ik import Answer, NoClosedForm, WorkingModes, solve_ik, working_modes
from .no_poses import far_poses, is_pose, no_poses, rough_pose
from .targets import (
    actuators,
    any_targets,
    any_values,
    edge,
    inside_targets,
    leg_lengths,
    margin,
    poses,
    random_targets,
    targets_about,
)
from .turns import Array

__all__ = [
    "ACCURACY",
    "Answer",
    "Array",
    "NoClosedForm",
    "WorkingModes",
    "actuators",
    "any_targets",
    "any_values",
    "arms",
    "edge",
    "far_poses",
    "inside_targets",
    "is_pose",
    "leg_lengths",
    "margin",
    "no_poses",
    "poses",
    "random_targets",
    "rough_pose",
    "solve_ik",
    "targets_about",
    "working_modes",
]
