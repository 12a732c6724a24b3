"""Bounds on the reach of paths from lengths alone, to find poses out of reach without a search."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from ...common.arrays import Floats, Ints
from ...kernels.joints.loops import BALL, SLIDE, Loops

SLACK = 1e-6
"""What is added to a reach [L]: more than the tolerances of gaps and limits on a path."""

ENDLESS = 1e9
"""Stroke of a slide without a bound, and reach of a path without joints that turn [L]."""

SWEEPS = 50
"""Sweeps over the points of a path, each moved along its axis to where the way through all is shortest; a way that is
not yet the shortest is a bound, too."""


def reaches_of(loops: Loops) -> Floats:
    """For each path its first point, the reference point less its last point at home, and its reach, (paths, 7) [L].

    A body keeps the distance of two points on the axes of its joints, or lets slides change it. So at no configuration
    are the two ends of a path farther apart than these distances together.
    """
    found = [_reach(loops, loops.visits[first:last, 0]) for first, last in pairwise(loops.paths.tolist())]
    return np.array([[*first, *(loops.end - last), reach] for first, last, reach in found])


def _reach(loops: Loops, units: Ints) -> tuple[Floats, Floats, float]:
    """First and last point of a path through some units, and how far they may be apart [L]."""
    turns = [k for k in units.tolist() if loops.kinds[k] != SLIDE]
    if not turns:
        return loops.end, loops.end, ENDLESS
    slides: list[list[int]] = [[] for _ in range(len(turns) + 1)]
    passed = 0
    for k in units.tolist():
        passed += loops.kinds[k] != SLIDE
        if loops.kinds[k] == SLIDE:
            slides[passed].append(k)
    points = loops.points[turns].copy()
    axes = loops.axes[turns] * (loops.kinds[turns] != BALL)[:, None]
    for _ in range(SWEEPS):
        for i in range(len(turns)):
            here, (one, other) = loops.points[turns[i]], (points[max(i - 1, 0)], points[min(i + 1, len(turns) - 1)])
            (along, off), (along_other, off_other) = (_from_axis(axes[i], end - here) for end in (one, other))
            if i in (0, len(turns) - 1):  # an end of the path has one neighbour
                along, off = (along_other, off_other) if i == 0 else (along, off)
                along_other, off_other = along, off
            share = off / (off + off_other) if off + off_other > 0.0 else 0.5
            points[i] = here + (along + share * (along_other - along)) * axes[i]
    reach = SLACK
    for i, between in enumerate(slides):
        ends = (points[i] - points[i - 1] if 0 < i < len(turns) else np.zeros(3))[None]
        for k in between:  # passed one way or the other
            strokes = np.clip([loops.lo[loops.columns[k]], loops.hi[loops.columns[k]]], -ENDLESS, ENDLESS)
            ends = np.concatenate([ends + stroke * loops.axes[k] for stroke in (*strokes, *-strokes)])
        reach += float(np.linalg.norm(ends, axis=1).max())
    return points[0], points[-1], reach


def _from_axis(axis: Floats, way: Floats) -> tuple[float, float]:
    """Coordinate of a point along an axis, and its distance from the axis."""
    along = float(axis @ way)
    across = way - along * axis
    return along, math.sqrt(across @ across)
