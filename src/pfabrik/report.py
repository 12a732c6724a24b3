"""A Solution in words and in the units that people read: degrees, and the mechanism's own length."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .tolerances import TOLERANCES

if TYPE_CHECKING:
    from .mechanism import Joint, Mechanism
    from .solution import ActiveLimit, Solution


@dataclass(frozen=True)
class Readout:
    """How the coordinate of an actuator is shown.

    Attributes
    ----------
    name : of the actuator.
    is_angle : whether the coordinate is an angle; a length otherwise.
    unit : ``"deg"`` or the mechanism's length unit.
    limits : lowest and highest value in `unit`, infinite where there is no limit.
    """

    name: str
    is_angle: bool
    unit: str
    limits: tuple[float, float]

    def display(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Coordinates [rad or length] in `unit`."""
        return np.degrees(values) if self.is_angle else values


def readouts(mechanism: Mechanism) -> tuple[Readout, ...]:
    """One readout for each actuator, in the order of ``mechanism.actuators``."""
    return tuple(readout(mechanism.joint(name), mechanism.length_unit) for name in mechanism.actuators)


def readout(joint: Joint, length_unit: str) -> Readout:
    """How the coordinate of one actuated revolute or prismatic joint is shown."""
    is_angle = joint.type == "revolute"
    low, high = (float(bound) for bound in joint.range or (-math.inf, math.inf))  # type: ignore[arg-type]
    limits = (math.degrees(low), math.degrees(high)) if is_angle else (low, high)
    return Readout(joint.name, is_angle, "deg" if is_angle else length_unit, limits)


def rpy_angles(pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Roll, pitch, yaw [rad] of poses, the inverse of ``pose(..., rpy=...)``: R = Rz(yaw) Ry(pitch) Rx(roll).

    Parameters
    ----------
    pose : (..., 4, 4)

    Returns
    -------
    (..., 3); pitch lies within a quarter turn. At a quarter turn of pitch only yaw - roll (or yaw + roll) is
    determined, and roll is given as 0.
    """
    rotation = np.asarray(pose)[..., :3, :3]
    cos_pitch = np.hypot(rotation[..., 0, 0], rotation[..., 1, 0])
    pitch = np.arctan2(-rotation[..., 2, 0], cos_pitch)
    locked = cos_pitch < TOLERANCES.rotation
    roll = np.where(locked, 0.0, np.arctan2(rotation[..., 2, 1], rotation[..., 2, 2]))
    yaw = np.where(
        locked,
        np.arctan2(-rotation[..., 0, 1], rotation[..., 1, 1]),
        np.arctan2(rotation[..., 1, 0], rotation[..., 0, 0]),
    )
    return np.stack([roll, pitch, yaw], axis=-1)


def as_sentence(solution: Solution) -> str:
    """What became of one target, in one sentence.

    For instance ``projected: 12.3 mm from the target; strut B3 at its maximum 250 mm; joint C1's cone at 45 deg``.
    """
    status = solution.status.name.lower()
    if status == "reached":
        return "reached"
    if status == "projected":
        return "; ".join([f"projected: {distance(solution)} from the target", *reasons(solution)])
    return f"{status}: no feasible configuration found; loops open by {loop_gap(solution)}"


def distance(solution: Solution) -> str:
    """Position error, rotation error, or both, where they exceed the tolerance."""
    mechanism = solution.mechanism
    parts = []
    if solution.position_error > TOLERANCES.position * mechanism.characteristic_length:
        parts.append(f"{float(solution.position_error):.3g} {mechanism.length_unit}")
    if solution.rotation_error > TOLERANCES.rotation:
        parts.append(f"{math.degrees(float(solution.rotation_error)):.3g} deg")
    return " and ".join(parts) or "a hair"


def loop_gap(solution: Solution) -> str:
    """The largest loop gap with its unit."""
    return f"{float(solution.residual):.1e} {solution.mechanism.length_unit}"


def reasons(solution: Solution) -> list[str]:
    """What holds a projected answer back, one phrase for each active limit."""
    phrases = [as_phrase(limit, solution.mechanism) for limit in solution.active_limits]
    return phrases or ["no limit is active: the links are too short or too long"]


def as_phrase(limit: ActiveLimit, mechanism: Mechanism) -> str:
    """``strut B3 at its maximum 250 mm``, or ``joint C1's cone at 45 deg``."""
    if limit.bound == "cone":
        return f"joint {limit.joint}'s cone at {math.degrees(limit.limit):.6g} deg"
    joint = mechanism.joint(limit.joint)
    noun = "joint" if joint.type != "prismatic" else "strut" if joint.along else "slider"
    bound = "maximum" if limit.bound == "max" else "minimum"
    return f"{noun} {limit.joint} at its {bound} {show_coordinate(limit.limit, joint, mechanism.length_unit)}"


def show_coordinate(value: float, joint: Joint, length_unit: str) -> str:
    """A coordinate of a joint with its unit."""
    if joint.type == "prismatic":
        return f"{value:.6g} {length_unit}"
    return f"{math.degrees(value):.6g} deg"


def short_names(limits: Iterable[ActiveLimit]) -> str:
    """Active limits in a cell of a table: ``B3 max; C1 cone``."""
    return "; ".join(f"{limit.joint} {limit.bound}" for limit in limits)
