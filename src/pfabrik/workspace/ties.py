"""Limits that are met together, as those of both rods of a parallelogram: one of them stands for all."""

from __future__ import annotations

import numpy as np

from ..answers.margins import margins
from ..answers.status import Status
from ..arrays import Floats, Ints
from ..ik import solve_ik
from ..options import Options
from .parts import connected
from .surface import BorderMesh
from .verdicts import MapQuestion

SAMPLES = 16
"""Edges of the mesh, for each two limits at their ends, where the margins of both are compared."""

SAME = 1e-6
"""Difference up to which margins are equal: loops closed to 1e-9 of L, seen through angles of short links."""


def without_ties(question: MapQuestion, mesh: BorderMesh) -> BorderMesh:
    """The mesh with the first of each set of limits whose margins are equal along the border in place of the others.

    Which of them is the least is rounding: without this, neighbours name one and the other in turn.
    """
    if not question.has_margins or len(question.turns) > 1:
        return mesh
    limits, edges = question.limits, _changes(mesh)
    if not len(edges):
        return mesh
    pairs, rows = np.unique(mesh.limits[edges], axis=0, return_inverse=True)
    samples = [np.flatnonzero(rows.ravel() == place) for place in range(len(pairs))]
    samples = [each[np.unique(np.linspace(0, len(each) - 1, SAMPLES).astype(np.intp))] for each in samples]
    places = [np.unique(edges[each]) for each in samples]
    values = _margins(question, mesh.vertices[np.concatenate(places)])
    ends = np.cumsum([0, *map(len, places)])
    tied = [
        pair
        for pair, begin, end in zip(pairs.tolist(), ends[:-1].tolist(), ends[1:].tolist(), strict=True)
        if _are_equal(values.get(limits[pair[0]]), values.get(limits[pair[1]]), slice(begin, end))
    ]
    first = connected(len(limits), np.array(tied, np.int64).reshape(-1, 2))
    return mesh._replace(limits=first[mesh.limits])


def _changes(mesh: BorderMesh) -> Ints:
    """Edges of the mesh (e, 2) whose ends are of different limits, the end of the lower limit first."""
    d = mesh.faces.shape[1]
    edges = np.concatenate([mesh.faces[:, (k, (k + 1) % d)] for k in range(d)])
    limits = mesh.limits[edges]
    edges, limits = (array[limits[:, 0] != limits[:, 1]] for array in (edges, limits))
    return np.take_along_axis(edges, np.argsort(limits, axis=1), axis=1)


def _margins(question: MapQuestion, points: Floats) -> dict[tuple[str, str], Floats]:
    """The margin of each limit of a joint at points (n, d), (n,); NaN where they are not reached."""
    options = Options(working_mode="keep", on_invalid="mark")
    answers = solve_ik(question.mechanism, question.space.poses(points), start=question.start, options=options)
    reached = np.asarray(answers.status) == Status.REACHED
    return {limit: np.where(reached, margin, np.nan) for limit, margin in margins(answers).items()}


def _are_equal(first: Floats | None, second: Floats | None, rows: slice) -> bool:
    """True if two margins are equal in all of some rows that are known, and in one at least."""
    if first is None or second is None:
        return False
    apart = np.abs(first[rows] - second[rows])
    known = ~np.isnan(apart)
    return bool(known.any() and (apart[known] <= SAME).all())
