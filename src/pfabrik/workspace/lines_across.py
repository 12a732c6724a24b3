"""Lines across the border, narrowed to where they cross it by searches for positions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Ints, Mask
from ..batch import put, take
from ..kernels.platform.search_records import Starts
from .measuring import Measure

SIDE = 0.2
"""How far from where the border is expected to search on either side, as a share of the accuracy asked for."""

TURNED = 0.1
"""Least angle between the orientations of two configurations that one is tried in place of the other for [rad]."""

ROUNDS = 100
"""Most rounds in which lines are narrowed anew after configurations farther out were found."""

Rows = NDArray[np.intp]


class Lines(NamedTuple):
    """Lines from points within reach to points beyond.

    Attributes
    ----------
    inner, ways : where they begin, and from there to their ends, (e, d) [length].
    places, place_ways : the same as positions of the reference point, (e, 3) [L].
    near, far : shares of the way that are known to be within reach and beyond, (e,).
    within, beyond : the configuration at `near`, and that nearest to `far`.
    """

    inner: Floats
    ways: Floats
    places: Floats
    place_ways: Floats
    near: Floats
    far: Floats
    within: Starts
    beyond: Starts

    def at(self, rows: Rows, shares: Floats) -> Floats:
        """Points at shares of some lines."""
        return np.asarray(self.inner[rows] + shares[:, None] * self.ways[rows])

    def guess(self, rows: Rows, halves: Mask, close: float) -> Floats:
        """Shares of the ways to search at next: on either side of where the border is expected, or halfway.

        The border is expected to be a plane through the nearest configuration, across the way to it.
        """
        near, far = self.near[rows], self.far[rows]
        offset = self.places[rows] + far[:, None] * self.place_ways[rows] - self.beyond.poses[rows, :3, 3]
        with np.errstate(divide="ignore", invalid="ignore"):
            border = far - (offset**2).sum(axis=1) / (offset * self.place_ways[rows]).sum(axis=1)
        low = border - SIDE * close
        at = np.where(low > near, low, near + 2.0 * SIDE * close)
        usable = (border > near) & (border < far) & (at < far) & ~halves
        return np.where(usable, at, 0.5 * (near + far))


def lines_between(measure: Measure, inner: Floats, outer: Floats, within: Starts, beyond: Starts) -> Lines:
    """Lines from points within reach to points beyond, (e, d), with their configurations or the nearest to them."""
    space, n = measure.question.space, len(inner)
    unit = 1.0 / space.mechanism.characteristic_length
    first, last = (unit * space.poses(points)[:, :3, 3] for points in (inner, outer))
    return Lines(inner, outer - inner, first, last - first, np.zeros(n), np.ones(n), within, beyond)


def narrow(measure: Measure, lines: Lines, neighbours: Ints, close: float) -> None:
    """Bring `near` and `far` of lines as close to each other as `close` [share of the way].

    Lines are narrowed from their configurations within. Then searches from the first start and the seeds, and from
    configurations of neighbouring lines that are turned otherwise, show whether anything leads farther out; lines where
    this is so are narrowed again, and asked about again.

    Parameters
    ----------
    neighbours : pairs of lines beside each other, (p, 2).
    """
    pairs = np.concatenate([neighbours, neighbours[:, ::-1]])
    changed = np.arange(len(lines.near))
    _narrow(measure, lines, changed, close)
    for _ in range(ROUNDS):
        on = changed
        while len(on):
            on = _went_on(measure, lines, on, measure.question.first_start, close, seeds=True)
        is_changed = np.zeros(len(lines.near), bool)
        is_changed[changed] = True
        tried = pairs[is_changed[pairs[:, 0]]]
        changed = _led_on(measure, lines, tried[_angles(lines.within, tried) > TURNED], close)
        if not len(changed):
            break


def _led_on(measure: Measure, lines: Lines, pairs: Ints, close: float) -> Ints:
    """Search on each second line of pairs, just beyond, from the configuration of the first; the lines that went on."""
    changed = [np.zeros(0, np.int64)]
    while len(pairs):
        now, places = np.unique(pairs[:, 1], return_index=True)
        changed.append(_went_on(measure, lines, now, take(lines.within, pairs[places, 0]), close, seeds=False))
        pairs = np.delete(pairs, places, axis=0)
    return np.unique(np.concatenate(changed))


def _went_on(measure: Measure, lines: Lines, rows: Rows, starts: Starts, close: float, *, seeds: bool) -> Rows:
    """Search just beyond on some lines; narrow those where that is reached anew, and return them."""
    margins, nearest = measure.approach(lines.at(rows, lines.far[rows]), starts, seeds=seeds)
    is_on = margins >= 0.0
    on = rows[is_on]
    put(lines.within, on, nearest, is_on)
    lines.near[on], lines.far[on] = lines.far[on], 1.0
    _narrow(measure, lines, on, close)
    return on


def _narrow(measure: Measure, lines: Lines, rows: Rows, close: float) -> None:
    """Narrow some lines by searches from their configurations within."""
    halves = np.zeros(len(lines.near), bool)
    while len(rows := rows[lines.far[rows] - lines.near[rows] > close]):
        before = lines.far[rows] - lines.near[rows]
        at = lines.guess(rows, halves[rows], close)
        margins, nearest = measure.approach(lines.at(rows, at), take(lines.within, rows), seeds=False)
        kept = margins >= 0.0
        lines.near[rows[kept]], lines.far[rows[~kept]] = at[kept], at[~kept]
        put(lines.within, rows[kept], nearest, kept)
        put(lines.beyond, rows[~kept], nearest, ~kept)
        halves[rows] = lines.far[rows] - lines.near[rows] > 0.5 * before


def _angles(starts: Starts, pairs: Ints) -> Floats:
    """The angles between the orientations of pairs of starts, (p,) [rad]."""
    first, second = (starts.poses[pairs[:, side], :3, :3] for side in (0, 1))
    return np.asarray(np.arccos(np.clip(0.5 * (np.einsum("pij,pij->p", first, second) - 1.0), -1.0, 1.0)))
