"""Refusal of a map that has no size: some of its coordinates do not change while the others are held."""

from __future__ import annotations

import dataclasses
from itertools import compress

import numpy as np

from ...common.arrays import Floats, Ints, Mask
from ...errors import InvalidArgument
from ...kinematics import has_weak_coordinates, task_of, task_remark
from ...tolerances import TOLERANCES
from .lattice_points import Lattice, offsets, places_of
from .space import POSITIONS, TURNS
from .surface import BorderMesh
from .verdicts import MapQuestion
from .workspace_table import for_people

SAMPLES, SHARE = 32, 0.1
"""Points within reach beside the border that a map is tried beside, and the share beside which it must go on."""

ALONE, TOGETHER = 0.5, 0.9
"""Shares of the ways to the border that it is tried after: along one coordinate; along all, divided among them."""

STEPS = (1e-2, 1e-3)
"""Steps by which other coordinates are tried, to both sides [L or rad]."""


def require_size(lattice: Lattice, mesh: BorderMesh) -> None:
    """Refuse a map within whose border, but for the tolerance of poses, hardly anything is within reach.

    Beside each of some lattice points at the border, the map is tried along each coordinate alone, and along all
    together, by a part of the way to the border. Where a coordinate follows from the others, points on a line or a
    surface are within reach, and what is near to it to the tolerance.

    Raises
    ------
    InvalidArgument : names the coordinates that do not change, those that do, and a task that fits.
    """
    if not len(mesh.faces):
        return
    numbers, points, both = _ways_within(lattice, mesh)
    question, d = lattice.measure.question, lattice.d
    lengths, signs = both.max(axis=0), np.where(both[0] >= both[1], 1.0, -1.0)
    is_small = lengths < np.minimum(TOLERANCES.unmoved * question.lengths, lattice.step)
    is_wide = lengths > TOLERANCES.sized * question.lengths

    def goes_on(share: float, along: Mask) -> Mask:
        found, steps = np.zeros(len(points), bool), share * signs * lengths * along
        for exactly in (True, False):
            rows = np.flatnonzero(is_wide[:, along].all(axis=1) & (is_small[:, along].any(axis=1) == exactly))
            known = lattice.known.at(numbers[rows]) if question.is_grown else question.first_start
            found[rows] = question.goes_on(points[rows] + steps[rows], known, exactly=exactly)
        return found

    if goes_on(TOGETHER / d, np.ones(d, bool)).mean() < SHARE:
        stuck = ~np.array([goes_on(ALONE, along).any() for along in np.eye(d, dtype=bool)])
        nearest = points[np.abs(points - question.space.start).sum(axis=1).argmin()]
        raise InvalidArgument(
            "over", _found(question, stuck, both.sum(axis=0).max(axis=0)), _expected(question, nearest)
        )


def _ways_within(lattice: Lattice, mesh: BorderMesh) -> tuple[Ints, Floats, Floats]:
    """Some lattice points at the border: their numbers (n,), coordinates (n, d), and ways (2, n, d) within reach.

    Ways are up and down each coordinate, to the border or to the next point.
    """
    d = lattice.d
    numbers = np.unique(mesh.inner)
    chosen = numbers[np.unique(np.linspace(0, len(numbers) - 1, min(SAMPLES, len(numbers))).astype(np.int64))]
    places = lattice.points.codes[chosen]
    points, rows = lattice.coordinates(places_of(places, d)), np.flatnonzero(np.isin(mesh.inner, chosen))
    of_vertex = np.searchsorted(chosen, mesh.inner[rows])
    ways = np.zeros((2, len(chosen), d))
    for way, sign in zip(ways, (1, -1), strict=True):
        np.maximum.at(way, of_vertex, sign * (mesh.vertices[rows] - points[of_vertex]))
        for axis, along in enumerate(np.eye(d, dtype=np.int64)):
            beside = lattice.points.find(places + offsets(sign * along))
            goes_on = (beside < 0) | (lattice.margins[beside] >= 0.0)  # unknown ones are in cells that are all within
            way[goes_on, axis] = lattice.step[axis]
    return chosen, points, ways


def _found(question: MapQuestion, stuck: Mask, spans: Floats) -> str:
    """Words for the coordinates that do not change, with the spans (d,) within reach, and for those that are held."""
    space, named = question.space, stuck if stuck.any() else ~stuck
    factors, units = for_people(space.units)
    words = [
        f"{name} ({span * factor:.2g} {unit})" if stuck.any() else name
        for name, span, factor, unit in compress(zip(space.names, spans, factors, units, strict=True), named)
    ]
    verb = "changes" if len(words) == 1 else "change"
    how = "one at a time, never together," if not stuck.any() else "by no more"
    held = [name for name in _coordinates_of_task(question) if name not in compress(space.names, named)]
    while_held = f" while {', '.join(held)} {'is' if len(held) == 1 else 'are'} held" if held else ""
    return f"{', '.join(words)}, which {verb} {how}{while_held}"


def _expected(question: MapQuestion, point: Floats) -> str:
    """Words for the coordinates that change alone from a point within reach, and for a task that fits."""
    space = question.space
    held, free = {**space.held, **dict(zip(space.names, point.tolist(), strict=True))}, []
    steps = np.array([[sign * step] for step in STEPS for sign in (1.0, -1.0)])
    for name in _coordinates_of_task(question):
        line = dataclasses.replace(space, names=(name,), start=np.array([held[name]]), held=held)
        endless = np.array([np.inf])
        of_line = dataclasses.replace(question, space=line, lowest=-endless, highest=endless)
        if (of_line.measure(line.start + steps * of_line.lengths)[0] >= 0.0).any():
            free.append(name)
    expected = f"two or three coordinates that change while all others are held: {', '.join(free) or 'none'}"
    alone = " does" if not free else " alone does" if len(free) == 1 else ""
    is_weak = has_weak_coordinates(question.mechanism)
    return expected + alone + f"; {task_remark(question.mechanism)}" * is_weak


def _coordinates_of_task(question: MapQuestion) -> list[str]:
    """The coordinates of the pose that the task sets; none where a joint's are asked about."""
    task = task_of(question.mechanism)
    return [] if question.space.joint is not None else [*compress((*POSITIONS, *TURNS), (*task.axes, *task.turns))]
