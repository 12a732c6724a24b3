"""Projections in any unknowns: from which starts, how many, and what their ends are worth."""

from __future__ import annotations

import math

import numpy as np

from ..common.arrays import Floats, Record, Records
from ._jit import routine
from .joints.loops import LOCKED
from .rows import HOLD_POSITION
from .search_constants import SAME_DISTANCE
from .search_constants import UNBOUNDED as UNBOUNDED

# Objectives of a part that is held: exactly, up to its price, and that rounded off farther.
HELD, PRICED, COARSE = 0, 1, 2

TALLY = np.dtype(
    [
        ("least", "f8"),  # least distance [L]
        ("agreements", "f8"),  # searches that ended there; infinite if certified the nearest
        ("disagreements", "f8"),  # searches that ended farther away
        ("is_unbroken", "i8"),  # 1 if some search needed no second descent with restoration
        ("from_start", "i8"),  # 1 if the search from the start had an end
        ("cost", "f8"),  # by how much it would fall, per unit by which what is held gave way [L per rad or per L]
    ]
)
"""Agreement counts of the searches for a row."""

EFFORT = np.dtype(
    [
        ("steps", "i8"),  # taken by all searches
        ("searches", "i8"),
        ("most", "i8"),  # steps after which no further search begins
        ("linearised", "i8"),  # configurations that were linearised
        ("bound", "i8"),  # how many may be, in all searches
        ("is_cut", "i8"),  # 1 if a search ended because of that
    ]
)
"""What searches have cost, and may."""

ATTEMPT = np.dtype(
    [
        ("phase", "i8"),  # 0: to reach the target; else the objective, from 1 on
        ("start", "i8"),  # number of the seed; -1: the start
        ("steps", "i8"),
        ("distance", "f8"),  # of its end from the target, or from what is held [L]; infinite without one
    ]
)
"""One search in a log of all."""


@routine
def seed_of(search: int, n_seeds: int, nearest_seed: int) -> int:
    """The seed of a search: after that from a row's own start come the nearest, then the others in order; else -1."""
    if search <= 0 or search > n_seeds:
        return -1
    other = search - 2
    return nearest_seed if search == 1 else other + int(other >= nearest_seed)


@routine
def clear_tally(tally: Record) -> None:
    """Reset a tally."""
    tally["least"], tally["agreements"], tally["disagreements"] = math.inf, 0.0, 0.0
    tally["is_unbroken"], tally["from_start"], tally["cost"] = 0, 0, math.inf


@routine
def count_ending(distance: float, tally: Record) -> bool:
    """Count the end of a search in a tally; True if it is nearer than all before."""
    least = tally["least"]
    if distance < (1.0 - SAME_DISTANCE) * least:
        tally["disagreements"] += tally["agreements"]
        tally["least"], tally["agreements"] = distance, 1.0
        return True
    if distance <= (1.0 + SAME_DISTANCE) * least and least < math.inf:
        tally["agreements"] += 1.0
    else:
        tally["disagreements"] += 1.0
    return False


@routine
def is_agreed(tally: Record, agreements: int) -> bool:
    """True if enough searches agree: as many as asked for, plus one for each that ended elsewhere."""
    return bool(tally["agreements"] >= agreements + tally["disagreements"])


@routine
def begin_effort(most: int, bound: int, effort: Record) -> None:
    """Begin to count what a row costs: `most` steps, and no more than `bound` linearisations."""
    effort["steps"], effort["searches"], effort["most"] = 0, 0, most
    effort["linearised"], effort["bound"], effort["is_cut"] = 0, bound, 0


@routine
def count_effort(steps: int, effort: Record) -> None:
    """Count a search."""
    effort["steps"] += steps
    effort["searches"] += 1


@routine
def note_attempt(phase: int, start: int, steps: int, distance: float, effort: Record, log: Records) -> None:
    """Count a search whose steps are counted already, and note it in a log as long as that has room."""
    place = effort["searches"]
    effort["searches"] += 1
    if place < len(log):
        attempt = log[place]
        attempt["phase"], attempt["start"], attempt["steps"], attempt["distance"] = phase, start, steps, distance


@routine
def is_spent(effort: Record) -> bool:
    """True if no further search is to begin."""
    return bool(effort["steps"] >= effort["most"])


@routine
def is_over(effort: Record) -> bool:
    """True if no further configuration is to be linearised: a search ends where it is, and is noted to be cut."""
    if effort["linearised"] >= effort["bound"]:
        effort["is_cut"] = 1
    return bool(effort["linearised"] >= effort["bound"])


@routine
def weighted_distance(weights: Floats, position: float, rotation: float) -> float:
    """Distance of a pose from a target [L], from its errors [L], [rad]; held components do not count."""
    turning = 0.0
    for i in range(3, 6):
        turning = turning if weights[i] == LOCKED else max(turning, weights[i])
    return math.hypot(position, math.sqrt(turning) * rotation)


@routine
def priced_distance(weights: Floats, hold: int, price: float, position: float, rotation: float) -> float:
    """Distance of a pose from a target with the price of what is held [L], from its errors [L], [rad]."""
    return weighted_distance(weights, position, rotation) + price * (position if hold == HOLD_POSITION else rotation)
