"""Whether a machine can take a pose, by blind search over the coordinates of all its joints: no solver's code.

Loops, task and limits are one sum of squares, worked out from the description alone; SciPy looks for where it vanishes,
from several starts. What it finds exists; what it does not find may exist all the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from checks import cone_angle, placed_bodies
from pfabrik import Mechanism
from pfabrik.machine.description.joints import KINDS

Array = NDArray[np.float64]
INSIDE = (
    1e-6  # how far within its limits a configuration must lie to count as found [L or rad]: no doubt about rounding
)
VANISHES = 1e-9  # what a residual may be [L or rad]: what a result promises
STEP = 1e-7  # of the differences for the derivative [L or rad]: about the root of machine precision


def can_reach(mechanism: Mechanism, target: Array, starts: Sequence[Array]) -> bool:
    """Whether a configuration with the end effector on a target (4, 4) is found from any of the starts (columns,)."""
    asked = partial(residuals, mechanism, target)

    def at(x: Array) -> Array:
        return asked(x[None])[0]

    def slopes(x: Array) -> Array:
        moved = asked(x + STEP * np.concatenate([np.eye(len(x)), -np.eye(len(x))]))
        return ((moved[: len(x)] - moved[len(x) :]) / (2 * STEP)).T

    for start in starts:
        found = least_squares(at, start, slopes, xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=60)
        if np.abs(found.fun).max() <= VANISHES:
            return True
    return False


def columns(mechanism: Mechanism) -> int:
    """How many coordinates the joints have together."""
    return sum(len(KINDS[joint.type].coordinates) for joint in mechanism.joints)


def units(mechanism: Mechanism) -> Array:
    """What every coordinate is divided by: L for lengths, 1 for angles."""
    kinds = [kind for joint in mechanism.joints for kind in KINDS[joint.type].coordinates]
    return np.array([mechanism.characteristic_length if kind == "length" else 1.0 for kind in kinds])


def residuals(mechanism: Mechanism, target: Array, x: Array) -> Array:
    """Loops, task and limits of configurations x (n, columns) [L or rad], all zero where these hold, (n, …)."""
    widths = [len(KINDS[joint.type].coordinates) for joint in mechanism.joints]
    parts = np.split(x * units(mechanism), np.cumsum(widths)[:-1], axis=1)
    moved = {joint.name: part for joint, part in zip(mechanism.joints, parts, strict=True)}
    placed, open_by = placed_bodies(mechanism, moved)
    return np.concatenate([*open_by, off_task(mechanism, target, placed), *excesses(mechanism, moved, placed)], axis=1)


def off_task(mechanism: Mechanism, target: Array, placed: dict[str, Array]) -> Array:
    """How far the end effector is from its target in what counts, (n, …) [L and entries of matrices]."""
    body = mechanism.end_effector
    if mechanism.end_effector_is_joint:
        body = mechanism.joint(body).connects[0]
    at = (placed[body] @ np.append(mechanism.reference_point, 1.0))[:, :3]
    off = (at - target[:3, 3])[:, ["xyz".index(name) for name in mechanism.task if name in "xyz"]]
    turned = (placed[body][:, :3, :3] - target[:3, :3]).reshape(-1, 9)
    counted = {"rotation": turned, "tilt": turned[:, 2::3]}
    parts = [off / mechanism.characteristic_length, *(counted[name] for name in mechanism.task if name in counted)]
    return np.concatenate(parts, axis=1)


def excesses(mechanism: Mechanism, moved: dict[str, Array], placed: dict[str, Array]) -> list[Array]:
    """By how much every limit is exceeded that should be kept with a little room, (n, …) [L or rad]; 0 within."""
    found = []
    for joint in mechanism.joints:
        if joint.range is not None:
            kinds = KINDS[joint.type].coordinates
            unit = np.array([mechanism.characteristic_length if kind == "length" else 1.0 for kind in kinds])
            values = (moved[joint.name] + np.ravel(mechanism.home_coordinate(joint.name))) / unit
            low, high = np.reshape(joint.range, (-1, 2)).T / unit
            found.append(np.maximum(0.0, np.maximum(low + INSIDE - values, values - high + INSIDE)))
        if joint.cone is not None:
            over = cone_angle(mechanism, joint, placed) - joint.cone.half_angle + INSIDE
            found.append(np.maximum(0.0, over)[:, None])
    return found
