"""The point that all hinges of a spherical linkage pass through."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..common.arrays import Floats
from ..common.derived import derived
from ..tolerances import TOLERANCES
from .description.joints import Joint
from .description.mechanism import Mechanism
from .description.sketch import joints_on


@derived
def common_centre(mechanism: Mechanism) -> Floats | None:
    """The point (3,) [length] about which an end effector turns that hinges alone carry, all of them through it.

    Such hinges hold it in the base frame, whatever the configuration. None where there is no such point, and where
    joints are at it: their links are straight.
    """
    hinges = [joint for joint in mechanism.joints if joint.type == "revolute"]
    on_base = [joint for joint in hinges if mechanism.base in joint.connects]
    for first in on_base:
        for second in hinges:
            if second is not first and set(first.connects) & set(second.connects):
                centre = _crossing(mechanism, first, second)
                if centre is not None and _holds(mechanism, hinges, centre):
                    return centre
    return None


def _crossing(mechanism: Mechanism, first: Joint, second: Joint) -> Floats | None:
    """The point where the axes of two hinges cross; None where they do not, or are parallel."""
    (a, along), (b, other) = _line(mechanism, first), _line(mechanism, second)
    normal = np.cross(along, other)
    if np.linalg.norm(normal) <= TOLERANCES.alignment:
        return None
    share = np.linalg.det([b - a, other, normal]) / (normal @ normal)
    point = np.asarray(a + share * along)
    return point if _passes(mechanism, second, point) else None


def _holds(mechanism: Mechanism, hinges: Sequence[Joint], centre: Floats) -> bool:
    """True if hinges through a point lead from the base to the end effector, over a body with two of them off it."""
    through = [joint for joint in hinges if _passes(mechanism, joint, centre)]
    reached, before = {mechanism.base}, 0
    while len(reached) > before:
        before = len(reached)
        for joint in through:
            if set(joint.connects) & reached:
                reached |= set(joint.connects)
    names = {joint.name for joint in through if not _is_at(mechanism, joint, centre)}
    links = reached - {mechanism.base}
    is_curved = any(len(names & set(joints_on(mechanism, body))) > 1 for body in links)
    return is_curved and (mechanism.end_effector in reached or mechanism.end_effector in names)


def is_around(mechanism: Mechanism, joints: Sequence[str], centre: Floats) -> bool:
    """True if the hinges of these names are all through a point, and off it."""
    found = [mechanism.joint(name) for name in joints]
    return all(
        joint.type == "revolute" and _passes(mechanism, joint, centre) and not _is_at(mechanism, joint, centre)
        for joint in found
    )


def arc(start: Floats, end: Floats, centre: Floats, steps: int) -> Floats:
    """Points (n, 3) of the shorter arc about a centre from one point to another; a straight line beyond half a turn.

    Where the two are not equally far from the centre, the distance changes evenly along it.
    """
    out, back = start - centre, end - centre
    near, far = np.linalg.norm(out), np.linalg.norm(back)
    angle = np.arctan2(np.linalg.norm(np.cross(out, back)), out @ back)
    if not TOLERANCES.alignment < angle < np.pi - TOLERANCES.alignment:
        return np.array([start, end])
    shares = np.linspace(0.0, 1.0, steps + 1)[:, None]
    turned = np.sin((1.0 - shares) * angle) * out / near + np.sin(shares * angle) * back / far
    return np.asarray(centre + (near + shares * (far - near)) * turned / np.sin(angle))


def _line(mechanism: Mechanism, joint: Joint) -> tuple[Floats, Floats]:
    """A point of a hinge's axis, and its unit direction, at home."""
    return np.array(joint.at, float), np.array(mechanism.home_axis(joint.name), float)


def _passes(mechanism: Mechanism, joint: Joint, point: Floats) -> bool:
    at, along = _line(mechanism, joint)
    return bool(np.linalg.norm(np.cross(point - at, along)) <= TOLERANCES.alignment * mechanism.characteristic_length)


def _is_at(mechanism: Mechanism, joint: Joint, point: Floats) -> bool:
    at, _ = _line(mechanism, joint)
    return bool(np.linalg.norm(point - at) <= TOLERANCES.alignment * mechanism.characteristic_length)
