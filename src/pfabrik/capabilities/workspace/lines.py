"""Lines across the border, narrowed to where they cross it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...common.arrays import Floats, Ints, Mask
from ...common.batch import put, take
from ...kinematics import Starts
from ...tolerances import TOLERANCES
from .measuring import Measure

SIDE, FARTHEST_SIDE = 0.45, 0.4
"""How far from where the border is expected to look, and from the ends of what is left, as shares of the accuracy."""

MOST_LOOKS = 40
"""Largest number of points measured on a line; bisection alone takes ten."""

TURNED = 0.1
"""Least angle between the orientations of two configurations that one is tried in place of the other for [rad]."""

ROUNDS = 100
"""Most rounds in which lines are narrowed anew after configurations farther out were found."""

Rows = NDArray[np.intp]


class Lines(NamedTuple):
    """Lines from points within reach to points beyond.

    Attributes
    ----------
    inner, ways : where they begin, and from there to their ends, (e, d) [length or rad].
    places, place_ways : the same as positions of the reference point, (e, 3) [L]; no rows if nothing is grown.
    near, far : shares of the way that are known to be within reach and beyond, (e,).
    inside, outside : the margins there, (e,).
    limits : that exceeded at `far`, (e,); -1 if it was not measured.
    within, beyond : the configuration at `near`, and that nearest to `far`.
    """

    inner: Floats
    ways: Floats
    places: Floats
    place_ways: Floats
    near: Floats
    far: Floats
    inside: Floats
    outside: Floats
    limits: Ints
    within: Starts
    beyond: Starts

    def at(self, rows: Rows, shares: Floats) -> Floats:
        """Points at shares of some lines."""
        return np.asarray(self.inner[rows] + shares[:, None] * self.ways[rows])

    def look(self, rows: Rows, halves: Mask, close: float) -> Floats:
        """Shares of the ways to look at next: just beside where the border is expected, or halfway."""
        near, width = self.near[rows], self.far[rows] - self.near[rows]
        even = self._expected(rows)
        usable = (even >= 0.0) & (even <= 1.0) & ~halves
        beside = np.where(even < 0.5, SIDE, -SIDE) * close / width
        end = FARTHEST_SIDE * close / width
        return np.asarray(near + width * np.where(usable, np.clip(even + beside, end, 1.0 - end), 0.5))

    def _expected(self, rows: Rows) -> Floats:
        """Where the border is expected, as shares of what is left of some lines; NaN if unknown.

        Where margins are interpolated to zero; for what is grown, in the plane through the configuration nearest to
        `far`, across the way to it.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            if not len(self.places):
                return np.asarray(self.inside[rows] / (self.inside[rows] - self.outside[rows]))
            near, far, ways = self.near[rows], self.far[rows], self.place_ways[rows]
            offset = self.places[rows] + far[:, None] * ways - self.beyond.poses[rows, :3, 3]
            border = far - (offset**2).sum(axis=1) / (offset * ways).sum(axis=1)
            is_known = self.outside[rows] < -TOLERANCES.position
            return np.asarray(np.where(is_known, (border - near) / (far - near), np.nan))


def lines_between(
    measure: Measure, inner: Floats, outer: Floats, inside: Floats, outside: Floats, within: Starts, beyond: Starts
) -> Lines:
    """Lines from points within reach to points beyond, (e, d), with their margins and configurations."""
    space, n = measure.question.space, len(inner)
    unit = 1.0 / space.mechanism.characteristic_length
    first = last = np.zeros((0, 3))
    if measure.question.is_grown:
        first, last = (unit * space.poses(points)[:, :3, 3] for points in (inner, outer))
    ends = np.zeros(n), np.ones(n), inside.copy(), outside.copy()
    return Lines(inner, outer - inner, first, last - first, *ends, np.full(n, -1), within, beyond)


def narrow(measure: Measure, lines: Lines, neighbours: Ints, close: float) -> Ints:
    """Bring `near` and `far` of lines as close to each other as `close` [share of the way]; the limits exceeded next.

    Where a point has many configurations, searches anew where they are quick, and from configurations of neighbouring
    lines that are turned otherwise, then show whether anything leads farther out; lines where this is so are narrowed
    again, and asked about again.

    Parameters
    ----------
    neighbours : pairs of lines beside each other, (p, 2).
    """
    question, pairs = measure.question, np.concatenate([neighbours, neighbours[:, ::-1]])
    changed = np.arange(len(lines.near))
    _narrow(measure, lines, changed, close)
    for _ in range(ROUNDS if question.has_many_at_a_point else 0):
        on = changed if question.is_quick_anew else changed[:0]
        while len(on):
            on = _went_on(measure, lines, on, question.first_start, close, anew=True)
            on = on[lines.near[on] < 1.0]  # else the end itself is within, which a search from elsewhere had missed
        is_changed = np.zeros(len(lines.near), bool)
        is_changed[changed] = True
        tried = pairs[is_changed[pairs[:, 0]]]
        changed = _led_on(measure, lines, tried[_differences(lines.within, tried) > TURNED], close)
        if not len(changed):
            break
    unnamed = np.flatnonzero(lines.limits < 0) if question.has_margins else np.arange(len(lines.near))
    if len(unnamed):
        starts = take(lines.beyond if question.is_quick_anew else lines.within, unnamed)
        lines.limits[unnamed] = measure.name_limits(lines.at(unnamed, lines.far[unnamed]), starts)
    return lines.limits


def _led_on(measure: Measure, lines: Lines, pairs: Ints, close: float) -> Ints:
    """Search on each second line of pairs, just beyond, from the configuration of the first; the lines that went on."""
    changed = [np.zeros(0, np.int64)]
    while len(pairs):
        now, places = np.unique(pairs[:, 1], return_index=True)
        changed.append(_went_on(measure, lines, now, take(lines.within, pairs[places, 0]), close, anew=False))
        pairs = np.delete(pairs, places, axis=0)
    return np.unique(np.concatenate(changed))


def _went_on(measure: Measure, lines: Lines, rows: Rows, starts: Starts, close: float, *, anew: bool) -> Rows:
    """Search just beyond on some lines; narrow those where that is reached anew, and return them."""
    margins, _, nearest = measure(lines.at(rows, lines.far[rows]), starts, anew=anew)
    is_on = margins >= 0.0
    on = rows[is_on]
    put(lines.within, on, nearest, is_on)
    lines.near[on], lines.far[on] = lines.far[on], 1.0
    _narrow(measure, lines, on, close)
    return on


def _narrow(measure: Measure, lines: Lines, rows: Rows, close: float) -> None:
    """Narrow some lines, from their configurations within."""
    halves = np.zeros(len(lines.near), bool)
    for _ in range(MOST_LOOKS):
        rows = rows[lines.far[rows] - lines.near[rows] > close]
        if not len(rows):
            return
        before = lines.far[rows] - lines.near[rows]
        at = lines.look(rows, halves[rows], close)
        margins, limits, nearest = measure(lines.at(rows, at), take(lines.within, rows))
        kept = margins >= 0.0
        for side, margin, states, chosen in (
            (lines.near, lines.inside, lines.within, kept),
            (lines.far, lines.outside, lines.beyond, ~kept),
        ):
            side[rows[chosen]], margin[rows[chosen]] = at[chosen], margins[chosen]
            put(states, rows[chosen], nearest, chosen)
        lines.limits[rows[~kept]] = limits[~kept]
        halves[rows] = lines.far[rows] - lines.near[rows] > 0.5 * before


def _differences(starts: Starts, pairs: Ints) -> Floats:
    """The angles between the orientations of pairs of starts, or largest differences of coordinates, (p,)."""
    if len(starts.q):
        return np.asarray(np.abs(starts.q[pairs[:, 0]] - starts.q[pairs[:, 1]]).max(axis=1))
    first, second = (starts.poses[pairs[:, side], :3, :3] for side in (0, 1))
    return np.asarray(np.arccos(np.clip(0.5 * (np.einsum("pij,pij->p", first, second) - 1.0), -1.0, 1.0)))
