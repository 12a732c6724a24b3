"""What answers are checked against; no code of the solver is used. Here: closed forms of three topologies.

`assembly` has closed forms and searches of other hands for forward kinematics, `nearest` a general optimiser for the
feasible pose nearest to a target, `search` a blind search for a configuration that has a pose.
"""

from .closed_forms import (
    Array,
    actuators,
    arms,
    edge,
    inside_targets,
    leg_lengths,
    margin,
    poses,
    random_targets,
    reachable,
    working_mode_margins,
)

__all__ = [
    "Array",
    "actuators",
    "arms",
    "edge",
    "inside_targets",
    "leg_lengths",
    "margin",
    "poses",
    "random_targets",
    "reachable",
    "working_mode_margins",
]
