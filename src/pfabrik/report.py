"""A Solution in words and in the units that people read: degrees, and the mechanism's own length."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .tolerances import TOLERANCES

if TYPE_CHECKING:
    from .limits import ActiveLimit
    from .mechanism import Joint, Mechanism
    from .solution import Solution


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
    return f"{float(solution.residual):.1g} {solution.mechanism.length_unit}"


def reasons(solution: Solution) -> list[str]:
    """What holds a projected answer back, one phrase for the limits of a kind that have the same value."""
    names: dict[tuple[str, str], list[str]] = {}
    for limit in solution.active_limits:
        names.setdefault(in_words(limit, solution.mechanism), []).append(limit.joint)
    phrases = [as_phrase(noun, joints, bound) for (noun, bound), joints in names.items()]
    return phrases or ["no limit is active: the links themselves do not reach"]


def in_words(limit: ActiveLimit, mechanism: Mechanism) -> tuple[str, str]:
    """What kind of joint it is, and which of its bounds: ``("strut", "maximum 250 mm")``."""
    joint = mechanism.joint(limit.joint)
    noun = "joint" if joint.type != "prismatic" else "strut" if joint.along else "slider"
    if limit.bound == "cone":
        return noun, f"cone at {math.degrees(limit.limit):.6g} deg"
    bound = "maximum" if limit.bound == "max" else "minimum"
    return noun, f"{bound} {show_coordinate(limit.limit, joint, mechanism.length_unit)}"


def as_phrase(noun: str, joints: Sequence[str], bound: str) -> str:
    """``strut B3 at its maximum 250 mm``, ``struts B1, B3 at their maximum 250 mm``, ``joint C1's cone at 45 deg``."""
    subject = f"{noun}{'s' * (len(joints) > 1)} {', '.join(joints)}"
    if bound.startswith("cone"):
        return (
            f"{subject}'s {bound}" if len(joints) == 1 else f"the cones of {subject} at{bound.removeprefix('cone at')}"
        )
    return f"{subject} at {'their' if len(joints) > 1 else 'its'} {bound}"


def show_coordinate(value: float, joint: Joint, length_unit: str) -> str:
    """A coordinate of a joint with its unit."""
    if joint.type == "prismatic":
        return f"{value:.6g} {length_unit}"
    return f"{math.degrees(value):.6g} deg"


def short_names(limits: Iterable[ActiveLimit]) -> str:
    """Active limits in a cell of a table: ``B3 max; C1 cone``."""
    return "; ".join(f"{limit.joint} {limit.bound}" for limit in limits)
