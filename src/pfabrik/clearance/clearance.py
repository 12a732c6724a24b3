"""The least distance between the links of a configuration."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..answers.solution import Solution, checked_solution
from ..arrays import Floats, Ints, shaped
from ..description.links import Links, has_pairs, links_of
from ..description.mechanism_html import card
from ..errors import UnsupportedMechanism
from ..kernels.threads import in_blocks
from .gradients import gradients_of
from .placed_links import ends_of, joint_centres, places_of

ROWS_A_BLOCK = 4096
"""Rows of one call of a kernel, and of the tables of places that it takes."""


@dataclass(frozen=True, eq=False)
class Clearance:
    """The least distance between links, as `clearance` returns it.

    Attributes
    ----------
    distance : between the surfaces of the two links that are nearest, (...,) [length]; negative where they overlap: by
        so much has one to move until they touch. NaN for INVALID rows.
    """

    distance: float | Floats
    _solution: Solution = field(repr=False)
    _nearest: Ints = field(repr=False)

    @cached_property
    def links(self) -> tuple[str, str] | NDArray[np.str_]:
        """Names of the two bodies that are nearest, (..., 2); a pair for a single answer; empty for INVALID rows."""
        mechanism = self._solution.mechanism
        names = np.array([shape.body for shape in mechanism.shapes] + [""])
        pairs = np.vstack([links_of(mechanism).pairs, [[-1, -1]]])
        found: NDArray[np.str_] = names[pairs[self._nearest]]
        if self._solution.shape == ():
            return str(found[0, 0]), str(found[0, 1])
        of_batch: NDArray[np.str_] = found.reshape(*self._solution.shape, 2)
        return of_batch

    @cached_property
    def points(self) -> Floats:
        """The points of the two links that are nearest to each other, on their surfaces, (..., 2, 3) [length]."""
        points: Floats = shaped(_measured(self._solution, self._nearest)[2], self._solution.shape)
        return points

    @cached_property
    def gradient(self) -> Floats:
        """Change of the distance per actuator value, (..., n_a) [length per rad or length], of the nearest two links.

        Where several pairs are as near, it is that of the pair in `links`. NaN for INVALID rows, and where links just
        touch: they have no direction from each other there.
        """
        distances, points = np.reshape(self.distance, -1), self.points.reshape(-1, 2, 3)
        gradients: Floats = shaped(gradients_of(self._solution, self._nearest, distances, points), self._solution.shape)
        return gradients

    def __repr__(self) -> str:
        return f"<Clearance: {self._words}>"

    def _repr_html_(self) -> str:
        """The least distance and its links, for notebooks."""
        return card("Clearance", [self._words], (), (), "")

    @property
    def _words(self) -> str:
        unit, distances = self._solution.mechanism.length_unit, np.ravel(self.distance)
        if not np.isfinite(distances).any():
            return "no configuration"
        least = int(np.nanargmin(distances))
        first, second = np.reshape(self.links, (-1, 2))[least]
        n_overlapping = int(np.count_nonzero(distances < 0.0))
        overlap = f"; {n_overlapping} of {len(distances)} overlap" if self._solution.shape else ""
        return f"{distances[least]:.4g} {unit} between '{first}' and '{second}'{overlap}"


def clearance(solution: Solution) -> Clearance:
    """The least distance between links that have a thickness, and which links these are.

    It is measured, and keeps nothing apart: no answer of any verb avoids that links touch. Links that share a joint,
    parts of one body, and pairs in `ignore` are left out.

    Raises
    ------
    InvalidArgument : the argument is no Solution.
    UnsupportedMechanism : its mechanism has no two links with a thickness that may touch.
    """
    mechanism = checked_solution(solution).mechanism
    if not mechanism.shapes:
        reason = "no link has a thickness: give legs one, or add [[body]] tables"
        raise UnsupportedMechanism(mechanism.name, [reason], "measured for clearance")
    if not has_pairs(mechanism):
        reason = "all links with a thickness share a joint, or are one body, or are ignored"
        raise UnsupportedMechanism(mechanism.name, [reason], "measured for clearance")
    distances, nearest, _ = _measured(solution)
    return Clearance(shaped(distances, solution.shape), solution, nearest)


def _measured(solution: Solution, nearest: Ints | None = None) -> tuple[Floats, Ints, Floats]:
    """Distances (n,), the pairs that have them (n,), and their points (n, 2, 3); the points only where pairs are given,
    or where there are other links than capsules."""
    links = links_of(solution.mechanism)
    n = len(solution._rows.status)
    distances, pairs, points = np.full(n, np.inf), np.full(n, -1.0), np.full((n, 2, 3), np.nan)
    others_from = len(links.pairs) if nearest is not None else links.n_capsules
    if nearest is None:
        _measure_capsules(links, ends_of(solution), distances, pairs)
    which = pairs.astype(np.int64) if nearest is None else nearest.copy()
    if nearest is not None or links.n_capsules < len(links.pairs):
        centres = joint_centres(solution)

        def run(block: slice) -> None:
            from ..kernels.clearance.least_clearance import least_clearance

            places = places_of(solution, centres, block)
            scratch = np.zeros(1 + places.shape[2] * places.shape[3])
            scratch[0] = others_from
            least_clearance(links.sizes, places, links.pairs, scratch, distances[block], which[block], points[block])

        in_blocks(run, n, ROWS_A_BLOCK)
    distances[which < 0] = np.nan
    return distances, which, points


def _measure_capsules(links: Links, ends: Floats, distances: Floats, pairs: Floats) -> None:
    """Lower distances (n,) by those of all pairs of capsules, whose ends are (s, 6, n)."""
    from ..kernels.clearance.capsules import capsule_clearance

    rounds, capsules = links.sizes[:, 1].copy(), links.pairs[: links.n_capsules]

    def run(block: slice) -> None:
        capsule_clearance(rounds, np.ascontiguousarray(ends[:, :, block]), capsules, distances[block], pairs[block])

    in_blocks(run, len(distances), ROWS_A_BLOCK)
