"""What is left of an answer to its limits, and on which side of singularities it is, next to which leg's dead point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...answers.differential import forward_jacobian
from ...answers.margins import nearest_first
from ...answers.solution import Solution
from ...kinematics import actuator_units, generic_of, parallel_signs
from ...tolerances import TOLERANCES

LEADS = 0.75
"""Share of the actuators' rates, as a cosine, from which one of them alone is named as near to its dead point."""


@dataclass(frozen=True)
class Left:
    """A limit of an answer, and what is left to it.

    Attributes
    ----------
    name : str
        The joint and the bound.
    margin : float
        As of `margins`: 1 in the middle of a range, 0 on the limit.
    left : float
        What is left to the limit, in `unit`.
    unit : str
        "deg", or the mechanism's unit of length.
    """

    name: str
    margin: float
    left: float
    unit: str


def limits_left(solution: Solution) -> list[Left]:
    """Every limit of an answer, the nearest first."""
    return [
        Left(f"{joint} {bound}", margin, *_left(solution, joint, bound, margin))
        for joint, bound, margin in nearest_first(solution)
    ]


def _left(solution: Solution, joint: str, bound: str, margin: float) -> tuple[float, str]:
    """What is left to a limit, and its unit; of two ranges of a joint, to the one that the margin is of."""
    mechanism = solution.mechanism
    if bound == "clearance":
        return margin * mechanism.characteristic_length, mechanism.length_unit
    cone = mechanism.joint(joint).cone
    if bound == "cone" and cone is not None:
        return float(np.degrees(margin * cone.half_angle)), "deg"
    nearest, found = np.inf, (np.nan, "deg")
    for coordinate in mechanism.coordinates:
        if coordinate.joint.name != joint:
            continue
        (low, high), value = coordinate.limits, solution.q[coordinate.column]
        left = float(value - low if bound == "min" else high - value)
        share = left / max(0.5 * (high - low), TOLERANCES.limit)
        if share < nearest:
            is_angle = coordinate.kind == "angle"
            found = (np.degrees(left), "deg") if is_angle else (left, mechanism.length_unit)
            nearest = share
    return found


def side_of(solution: Solution) -> float:
    """The side of the parallel singularities that an answer is on: 1 or -1; 0 on one, and NaN where none is known."""
    signs = parallel_signs(solution.mechanism, solution._coordinates, forward_jacobian(solution)[None])
    return float(signs[0])


def leg_at_dead_point(solution: Solution) -> str:
    """The actuator that moves most in the motion that moves the end effector least, if it leads that motion.

    This motion is the last right singular vector of the forward Jacobian: at a serial singularity the actuators of the
    legs at a dead point move while the end effector rests.
    """
    mechanism = solution.mechanism
    forward = forward_jacobian(solution)
    if not np.isfinite(forward).all() or not forward.size:
        return ""
    length = mechanism.characteristic_length
    forward = forward / np.repeat([length, 1.0], 3)[: len(forward), None] * actuator_units(mechanism)
    _, _, right = np.linalg.svd(forward)
    freedoms = min(len(mechanism.actuator_names), generic_of(mechanism).mobility.platform)
    rates = np.abs(right[freedoms - 1])
    leader = int(np.argmax(rates))
    return mechanism.actuator_names[leader] if rates[leader] > LEADS else ""
