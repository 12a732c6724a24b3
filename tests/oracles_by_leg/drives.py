"""What drives a leg, when its end on the end effector is given: crank, carriage or strut, in space.

The end of the rod is on a circle, on a line, or anywhere on the line from foot to head; and as far from the head as the
rod is long.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pfabrik.description.mechanism import Mechanism
from pfabrik.tolerances import TOLERANCES

from .facts import Array, require
from .legs import Leg
from .turns import Placed, either_angle, turns_about

Side = Array | float


@dataclass(frozen=True)
class Drive:
    """One way to drive a leg.

    Attributes
    ----------
    chain : what such legs look like; `rod` stands for a rod or a pair of rods, and the joints at their ends.
    branches : how many solutions a leg has.
    solve : places the driven body; None where no body stands between the base and the rod.
    """

    chain: str
    branches: int
    solve: Callable[[Mechanism, Leg, Array, Side], Placed] | None


def solve_crank(mechanism: Mechanism, leg: Leg, head: Array, side: Side) -> Placed:
    """The crank, turned so that its rod meets the head, (n, 3) [length].

    The circle of the rod's foot about the crank's axis meets the sphere about the head with the rod's length. Two
    solutions, to the left (`side` +1, seen against the axis) and to the right (-1) of the plane through axis and head.
    Degenerate: both are one where that plane holds crank and rod (stretched or folded), and beyond this there is none:
    then the crank is turned as if there were; with the head on the axis all angles are a solution, or none: home's is
    taken. Source: Merlet; Pierrot for the delta; Liu for plane legs.
    """
    driver, rod = leg.driver, leg.rods[0]
    assert driver is not None
    axis, hub = driver.axes[0], np.array(driver.joint.at)
    centre = hub + axis * (axis @ (rod.foot - hub))
    crank, length = float(np.linalg.norm(rod.foot - centre)), float(np.linalg.norm(rod.line))
    x_axis = (rod.foot - centre) / crank
    x, y, z = np.stack([x_axis, np.cross(axis, x_axis), axis]) @ (head - centre).T
    out = np.hypot(x, y)
    near, far = np.hypot(out - crank, z), np.hypot(out + crank, z)
    part = crank * crank + out * out + z * z - length * length
    square = (far - length) * (far + length) * (length - near) * (length + near)
    turn = turns_about(axis, either_angle(x, y, part, square, side))
    return Placed(turn, hub - turn @ hub)


def solve_carriage(mechanism: Mechanism, leg: Leg, head: Array, side: Side) -> Placed:
    """The carriage, moved so that its rod meets the head, (n, 3) [length].

    The line of the rod's foot meets the sphere about the head with the rod's length. Two solutions, further along the
    rail than the head (`side` +1) and less far (-1). Degenerate: both are one where the rod is square to the rail, and
    further away there is none: then the rod is square to the rail, and too short. Source: Merlet; Clavel for the linear
    delta; Orthoglide.
    """
    driver, rod = leg.driver, leg.rods[0]
    assert driver is not None
    axis, length = np.array(mechanism.home_axis(driver.joint.name)), float(np.linalg.norm(rod.line))
    apart = head - rod.foot
    level = apart @ axis
    across = np.linalg.norm(apart - level[:, None] * axis, axis=1)
    moved = level + side * np.sqrt(np.maximum((length - across) * (length + across), 0.0))
    return Placed(np.tile(np.eye(3), (len(head), 1, 1)), moved[:, None] * axis)


CRANK = Drive("R*-rod", 2, solve_crank)
CARRIAGE = Drive("P*-rod", 2, solve_carriage)
STRUT = Drive("strut", 1, None)
GUIDE = Drive("U, S or U-P", 1, None)


def drive_of(mechanism: Mechanism, leg: Leg) -> Drive:
    """How a leg is driven; `Unsuitable` where that gives no solution to speak of."""
    if leg.guide:
        return GUIDE
    if leg.driver is None:
        return STRUT
    if leg.driver.joint.type == "prismatic":
        return CARRIAGE
    arm = np.cross(leg.driver.axes[0], leg.rods[0].foot - np.array(leg.driver.joint.at))
    short = np.linalg.norm(arm) <= TOLERANCES.alignment * mechanism.characteristic_length
    require(not short, f"{leg.driver.joint.name} does not move its rod")
    return CRANK
