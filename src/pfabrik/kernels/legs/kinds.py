"""What depends on a leg's kind at a pose: its values, its constraints and their derivatives, the frame that it makes.

A rod, a pivot and a redundant joint are a file each (`rods`, `pivots`, `frames`); an idle leg has nothing to fill.
"""

from __future__ import annotations

from ...common.arrays import Floats, Records
from .._jit import routine
from .frames import place_redundant, q_redundant_of
from .pivots import pivot_rows, pivot_slopes, place_pivot
from .records import PIVOT, REDUNDANT, ROD
from .rods import place_rod, rod_rows, rod_slopes


@routine
def place_frame(legs: Records, k: int, q: Floats, frames: Floats, values: Floats) -> None:
    """Fill the frame that a leg defines, and its values, at coordinates q (legs,); nothing if it defines none."""
    if legs[k]["kind"] == REDUNDANT:
        place_redundant(legs[k], q_redundant_of(legs, k, q), frames, values[k])


@routine
def place_leg(
    legs: Records, k: int, owner: int, q: float, side: float, frames: Floats, values: Floats, lines: Floats
) -> float:
    """Fill the values of a leg at a pose; the singularity margin.

    Parameters
    ----------
    owner : the leg that owns its proximal joint, already placed; itself if it shares none.
    q : coordinate of a redundant joint.
    side : of a pivot of three hinges.
    """
    leg, frame = legs[k], frames[legs[k]["frame"]]
    if leg["kind"] == ROD:
        return place_rod(leg, legs[owner], frame, values[owner], values[k], lines[k])
    if leg["kind"] == PIVOT:
        return place_pivot(leg, frame, side, values[k])
    if leg["kind"] == REDUNDANT:
        place_redundant(leg, q, frames, values[k])
    return 1.0


@routine
def leg_rows(legs: Records, k: int, owner: int, frames: Floats, values: Floats, lines: Floats, rows: Floats) -> None:
    """Fill the constraints of a leg."""
    leg, frame = legs[k], frames[legs[k]["frame"]]
    if leg["kind"] == ROD:
        rod_rows(leg, legs[owner], frame, values[owner], values[k], lines[k], rows)
    elif leg["kind"] == PIVOT:
        pivot_rows(leg, frame, rows)


@routine
def leg_slopes(
    legs: Records,
    k: int,
    owner: int,
    frames: Floats,
    values: Floats,
    lines: Floats,
    proximal_slopes: Floats,
    slopes: Floats,
) -> None:
    """Fill the derivatives of a leg's constraints, and of its proximal coordinate (`proximal_slopes`)."""
    leg, frame = legs[k], frames[legs[k]["frame"]]
    if leg["kind"] == ROD:
        rod_slopes(leg, legs[owner], frame, values[owner], values[k], lines[k], proximal_slopes[owner], slopes)
    elif leg["kind"] == PIVOT:
        pivot_slopes(leg, frame, slopes)
