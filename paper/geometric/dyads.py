"""Two driven cranks whose forearms meet at the tip, R*-R-R in one plane: each leg is two circles about two points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pfabrik import Mechanism, SubChain

from ..arrays import Floats, Records
from ..step import Step
from ..tolerances import ALIGNMENT, LIMIT
from .compiled import kernel, routine
from .facts import Interval, centre, home_of, is_parallel, range_of, require, tolerances
from .struts import write_status
from .targets import BLOCK, FREE, OVER, Statuses, load_block

# Rows of the table: direction of the elbow from the shoulder, and whether this leg exceeds anything (0 if not).
ELBOW_X, ELBOW_Y, LEG_OVER = FREE, FREE + 1, FREE + 2

_vector = ("f8", (3,))
DYAD = np.dtype(
    [
        ("shoulder", *_vector),  # centre, moved along its axis into the tip's plane
        ("x", *_vector),  # the crank's direction at home
        ("y", *_vector),  # a quarter of a turn on
        ("normal", *_vector),
        ("off_plane", "f8"),  # how far from its plane the tip may be
        ("crank", "f8"),
        ("forearm", "f8"),
        # of home's branch, and of the other: +1 with the elbow to the left of the line from shoulder to tip; two
        # intervals in one of which the squared distance from shoulder to tip must lie
        ("side", "f8", (2,)),
        ("square", "f8", (2, 4)),
        ("low", "f8"),  # turn of the crank from home, tolerance included
        ("high", "f8"),
        ("sense", "f8"),  # coordinate = home + sense * turn
        ("home", "f8"),
        ("column", "i8"),
    ]
)
NOWHERE: Interval = (math.inf, -math.inf)


class DyadPlan(NamedTuple):
    """Legs as arrays."""

    dyads: Records  # (k,)
    far: float


def plan_dyads(mechanism: Mechanism, chains: Sequence[SubChain]) -> DyadPlan:
    """Legs that meet at a joint, all of whose axes are parallel."""
    require(mechanism.end_effector_is_joint, "its end effector is not the joint where the legs meet")
    tip = mechanism.joint(mechanism.end_effector)
    require(tip.range is None, f"the range of {tip.name} ties its legs together")
    dyads = np.zeros(len(chains), DYAD)
    for k, chain in enumerate(chains):
        _read_dyad(mechanism, chain.branches[0], dyads[k])
    return DyadPlan(dyads, tolerances(mechanism)[1])


def _read_dyad(mechanism: Mechanism, steps: Sequence[Step], dyad: np.void) -> None:
    """Fill the record of one leg."""
    shoulder, elbow, _ = steps
    normal = np.array(shoulder.joint.axis)
    require(all(is_parallel(np.array(step.joint.axis), normal) for step in steps), "its axes are not all parallel")
    tip = np.array(mechanism.reference_point)
    at = [centre(step) + normal * float(normal @ (tip - centre(step))) for step in (shoulder, elbow)]
    crank, forearm = at[1] - at[0], tip - at[1]
    links = float(np.linalg.norm(crank)), float(np.linalg.norm(forearm))
    slack, least = tolerances(mechanism)[0], ALIGNMENT * mechanism.characteristic_length
    require(min(links) > least, f"a link at {elbow.joint.name} has no length")
    side = -1.0 if float(normal @ np.cross(tip - at[0], crank)) < -least * sum(links) else 1.0
    low, high = _turns(mechanism, shoulder, normal)
    dyad["shoulder"], dyad["normal"], dyad["off_plane"] = at[0], normal, slack
    dyad["x"], dyad["y"] = crank / links[0], np.cross(normal, crank / links[0])
    dyad["crank"], dyad["forearm"] = links
    dyad["side"] = side, -side
    bend_home = math.atan2(float(normal @ np.cross(crank, forearm)), float(crank @ forearm))
    turns = _turns(mechanism, elbow, normal)
    bends = [(*_bends(*turns, bend_home, each), NOWHERE, NOWHERE)[:2] for each in dyad["side"]]
    dyad["square"] = [[end for bend in own for end in _squares(*links, bend, slack)] for own in bends]
    dyad["low"], dyad["high"] = low, high
    dyad["sense"], dyad["home"] = _sense(shoulder, normal), home_of(mechanism, shoulder)
    dyad["column"] = mechanism.actuator_names.index(shoulder.joint.name)


def _sense(step: Step, normal: Floats) -> float:
    """+1 if the joint's coordinate grows when its outward body turns right-handed about `normal`."""
    return math.copysign(1.0, float(np.array(step.joint.axis) @ normal) * step.sign)


def _turns(mechanism: Mechanism, step: Step, normal: Floats) -> Interval:
    """The range of a joint as turns from home about `normal`, tolerance included [rad]."""
    home, sense = home_of(mechanism, step), _sense(step, normal)
    low, high = sorted((bound - home) * sense for bound in range_of(step))
    return low - LIMIT, high + LIMIT


def _bends(low: float, high: float, bend_home: float, side: float) -> list[Interval]:
    """Bends of the elbow, 0 stretched to pi folded, that its turns from home allow: one interval, two at most [rad].

    On the left side (+1) an elbow bends to the right.
    """
    if high - low >= 2.0 * math.pi:
        return [(0.0, math.pi)]
    found = []
    for turn in range(-2, 3):
        ends = (-side * (bound + bend_home + 2.0 * math.pi * turn) for bound in (low, high))
        least, most = sorted(ends)
        if least <= math.pi and most >= 0.0:
            found.append((max(least, 0.0), min(most, math.pi)))
    return found


def _squares(crank: float, forearm: float, bend: Interval, slack: float) -> Interval:
    """Squared distances from shoulder to tip at which the elbow's bend is within an interval.

    A leg that is stretched or folded may miss its tip by `slack`.
    """
    if bend == NOWHERE:
        return NOWHERE
    low, high = (
        (crank - forearm) ** 2 + 4.0 * crank * forearm * math.cos(0.5 * angle) ** 2 for angle in reversed(bend)
    )
    if bend[1] == math.pi:
        low = max(abs(crank - forearm) - slack, 0.0) ** 2
    if bend[0] == 0.0:
        high = (crank + forearm + slack) ** 2
    return low, high


@kernel
def solve_dyads(
    plan: DyadPlan, targets: Floats, starts: Floats, at_home: bool, actuators: Floats, status: Statuses
) -> int:
    """Angles of the cranks at every target; how many rows are no poses.

    The elbow lies where a circle about the shoulder meets one about the tip. Two solutions a leg, four for two legs: a
    leg takes the branch that it has at home (its elbow on the same side of the line from shoulder to tip), and the
    other one where only that keeps its limits; `starts` are not read. The elbow's bend depends on the distance from
    shoulder to tip alone, so that its range is one of distances. Degenerate: a leg that is stretched or folded, where
    both solutions are one; equal links with the tip on the shoulder, where every angle is a solution and home's is
    taken; a leg stretched at home, which has no side: left (seen against the shoulder's axis) is taken. Source: Liu.
    """
    table = np.zeros((LEG_OVER + 1, BLOCK))
    invalid = 0
    for row in range(0, targets.shape[0], BLOCK):
        n = min(BLOCK, targets.shape[0] - row)
        invalid += load_block(targets, row, n, plan.far, table, status)
        for k in range(plan.dyads.shape[0]):
            solve_dyad(plan.dyads[k], row, n, table, actuators)
        for i in range(n):
            if table[OVER, i] != 0.0:
                for k in range(plan.dyads.shape[0]):
                    actuators[row + i, plan.dyads[k]["column"]] = math.nan
        write_status(row, n, table, status)
    return invalid


@routine
def solve_dyad(dyad: Records, row: int, n: int, table: Floats, actuators: Floats) -> None:
    """Coordinate of one crank for `n` columns, by home's branch or else the other; over where neither serves."""
    place_elbow(dyad, 0, 0, n, table)
    turn_crank(dyad, row, 0, n, table, actuators)
    for i in range(n):
        if table[LEG_OVER, i] != 0.0 and table[OVER, i] == 0.0:
            place_elbow(dyad, 1, i, i + 1, table)
            turn_crank(dyad, row, i, i + 1, table, actuators)
        table[OVER, i] += table[LEG_OVER, i]


@routine
def place_elbow(dyad: Records, branch: int, first: int, last: int, table: Floats) -> None:
    """Where the elbow is seen from the shoulder, in its plane and at some scale, for columns first ... last - 1."""
    px, py, pz = dyad["shoulder"][0], dyad["shoulder"][1], dyad["shoulder"][2]
    xx, xy, xz = dyad["x"][0], dyad["x"][1], dyad["x"][2]
    yx, yy, yz = dyad["y"][0], dyad["y"][1], dyad["y"][2]
    nx, ny, nz = dyad["normal"][0], dyad["normal"][1], dyad["normal"][2]
    r1, r2, side, off_plane = dyad["crank"], dyad["forearm"], dyad["side"][branch], dyad["off_plane"]
    nearest, farthest = (r1 - r2) * (r1 - r2), (r1 + r2) * (r1 + r2)
    low, high = dyad["square"][branch, 0], dyad["square"][branch, 1]
    low2, high2 = dyad["square"][branch, 2], dyad["square"][branch, 3]
    for i in range(first, last):
        dx, dy, dz = table[3, i] - px, table[7, i] - py, table[11, i] - pz
        x = xx * dx + xy * dy + xz * dz
        y = yx * dx + yy * dy + yz * dz
        square = x * x + y * y
        # the elbow is `along` the line to the tip and `across` it, both times the length of that line
        along = 0.5 * (square + r1 * r1 - r2 * r2)
        across = side * 0.5 * math.sqrt(abs((square - nearest) * (farthest - square)))
        table[ELBOW_X, i] = along * x - across * y
        table[ELBOW_Y, i] = along * y + across * x
        kept = (abs(nx * dx + ny * dy + nz * dz) <= off_plane) & (
            ((square >= low) & (square <= high)) | ((square >= low2) & (square <= high2))
        )
        table[LEG_OVER, i] = 0.0 if kept else 1.0


@routine
def turn_crank(dyad: Records, row: int, first: int, last: int, table: Floats, actuators: Floats) -> None:
    """Coordinate of the crank for some columns; over where its range has it not, a turn more or less included."""
    low, high, sense, home, column = dyad["low"], dyad["high"], dyad["sense"], dyad["home"], dyad["column"]
    for i in range(first, last):
        if table[LEG_OVER, i] == 0.0 and table[OVER, i] == 0.0:
            turn = math.atan2(table[ELBOW_Y, i], table[ELBOW_X, i])
            if turn > high:
                turn -= 2.0 * math.pi
            elif turn < low:
                turn += 2.0 * math.pi
            table[LEG_OVER, i] = 0.0 if low <= turn <= high else 1.0
            actuators[row + i, column] = home + sense * turn
