"""How fast a platform may move at a pose, and which actuator limits it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ..answers.differential import forward_jacobian, inverse_jacobian
from ..answers.solution import Solution, checked_solution
from ..arrays import Floats
from ..description.task import task_of
from ..errors import InvalidArgument
from ..tolerances import TOLERANCES
from .time_path import limits_of


class PlatformSpeed(NamedTuple):
    """The highest speed in a direction.

    Attributes
    ----------
    kind : "along" or "about".
    direction : unit vector (3,) in the base frame.
    speed : [length/s or rad/s]; 0 where the machine cannot move so, infinite where no actuator would be limited. Where
        it cannot do so without moving in what its task leaves out, that follows.
    limited_by : the actuator that limits it; "" where none does.
    """

    kind: str
    direction: tuple[float, float, float]
    speed: float
    limited_by: str


def platform_speed(
    solution: Solution, *, speed: float | Mapping[str, float] | None = None
) -> tuple[PlatformSpeed, ...]:
    """The highest speeds of a platform along and about each axis of its task, and along the slowest direction of all.

    Axes are those of the base; of a tilt, the platform's x and y axes.

    They are those of the present moment: both ways along a direction they are the same. The last one is the direction
    in which the reference point is slowest of all that the machine can move it in without turning; it is left out
    where there is none.

    Parameters
    ----------
    solution : a single configuration.
    speed : highest of the actuators, by name or the same for all [length/s or rad/s]; those not named have the
        `max_speed` of their joints.

    Raises
    ------
    InvalidArgument : a batch; actuators without any limit.
    """
    mechanism = checked_solution(solution).mechanism
    if solution.shape:
        raise InvalidArgument("solution", f"batch shape {solution.shape}", "a single configuration")
    limits = limits_of(mechanism, "speed", speed)
    if not np.isfinite(limits).any():
        raise InvalidArgument("speed", f"'{mechanism.name}' without max_speed", "a limit: in the mechanism, or speed")
    inverse, forward = inverse_jacobian(solution), forward_jacobian(solution)
    sizes = np.repeat([mechanism.characteristic_length, 1.0], 3)[: inverse.shape[1]]
    twists = _twists(solution)[:, : len(sizes)]
    kept = twists @ (forward / sizes[:, None])
    following = np.linalg.pinv(kept, rcond=TOLERANCES.alignment)
    found = []
    for twist in twists:
        rates = inverse @ twist
        if not _is_made(twist, forward @ rates, sizes):
            wanted = twists @ (twist / sizes)
            rates = following @ wanted
            if not _is_made(wanted, kept @ rates, np.ones(len(wanted))):
                rates = np.full(len(limits), np.nan)
        found.append(_fastest(twist, rates, limits, mechanism.actuator_names))
    slowest = _slowest(inverse, forward, sizes, limits)
    if slowest is not None:
        found.append(_fastest(slowest, inverse @ slowest, limits, mechanism.actuator_names))
    return tuple(found)


def _twists(solution: Solution) -> Floats:
    """The motions that a task sets, unit vectors (m, 6), each along or about one axis."""
    task = task_of(solution.mechanism)
    lines, turns = np.eye(3)[list(task.axes)], task.turning_axes(solution.pose)
    return np.block([[lines, np.zeros((len(lines), 3))], [np.zeros((len(turns), 3)), turns]])


def _fastest(twist: Floats, rates: Floats, limits: Floats, names: tuple[str, ...]) -> PlatformSpeed:
    """The highest speed along or about an axis, by the rates of the actuators that it asks for; NaN for none."""
    kind = "along" if twist[:3].any() else "about"
    x, y, z = (twist[:3] if kind == "along" else twist[3:]).tolist()
    if np.isnan(rates).any():
        return PlatformSpeed(kind, (x, y, z), 0.0, "")
    with np.errstate(divide="ignore"):
        most = limits / np.abs(rates)
    place = int(np.argmin(most))
    name = names[place] if np.isfinite(most[place]) else ""
    return PlatformSpeed(kind, (x, y, z), float(most[place]), name)


def _is_made(wanted: Floats, made: Floats, sizes: Floats) -> bool:
    return bool(np.linalg.norm((made - wanted) / sizes) <= TOLERANCES.alignment * np.linalg.norm(wanted / sizes))


def _slowest(inverse: Floats, forward: Floats, sizes: Floats, limits: Floats) -> Floats | None:
    """The translation at which some actuator meets its limit first, among those that the machine makes."""
    keeps = (forward @ inverse - np.eye(len(sizes)))[:, :3] / sizes[:, None] * sizes[0]
    _, values, right = np.linalg.svd(keeps)
    free = right[values <= TOLERANCES.alignment]
    if not len(free):
        return None
    rows = inverse[:, :3] @ free.T / limits[:, None]
    direction = rows[np.argmax(np.linalg.norm(rows, axis=1))] @ free
    size = np.linalg.norm(direction)
    return None if size == 0.0 else np.concatenate([direction / size, np.zeros(len(sizes) - 3)])
