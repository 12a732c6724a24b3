"""The least distance between the links of a configuration."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...answers.solution import Solution, checked_solution
from ...common.arrays import Floats, Ints, as_plain, shaped
from ...common.printed import Printed, ResultTable, plain
from ...engines.joints.link_distances import least_distances
from ...engines.joints.placed_links import PlacedLinks
from ...errors import UnsupportedMechanism
from ...kinematics import links_of
from .gradients import gradients_of


@dataclass(frozen=True, eq=False)
class Clearance(Printed):
    """The least distance between links, as `clearance` returns it.

    Attributes
    ----------
    distance : float or array (...)
        Distance between the surfaces of the two links that are nearest [length]; negative where they overlap: by so
        much has one to move until they touch. NaN for INVALID rows.
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

    def table(self) -> ResultTable:
        """The least distance and its links."""
        return ResultTable("Clearance", [self._words])

    def to_dict(self) -> dict[str, Any]:
        """Distance, links and points as plain numbers and lists, ready for JSON."""
        return {name: as_plain(getattr(self, name)) for name in ("distance", "links", "points")}

    @property
    def in_words(self) -> str:
        """The least distance of one answer, and the clearance that is kept."""
        (first, second), distance, mechanism = self.links, float(self.distance), self._solution.mechanism
        least, size = mechanism.clearance, f"{plain(abs(distance), 1e-9)} {mechanism.length_unit}"
        kept = "no clearance is kept"
        if least is not None:
            kept = f"the clearance kept is {least:.6g} {mechanism.length_unit}"
        return f"{first} and {second} {f'are {size} apart' if distance >= 0.0 else f'overlap by {size}'} ({kept})"

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

    It is only measured: answers keep links apart where the mechanism has a `clearance`. Links that share a joint, parts
    of one body, and pairs in `ignore` are left out.

    Parameters
    ----------
    solution : Solution
        One configuration or a batch.

    Raises
    ------
    InvalidArgument
        The argument is no Solution.
    UnsupportedMechanism
        Its mechanism has no two links with a thickness that may touch.
    """
    mechanism = checked_solution(solution).mechanism
    if not mechanism.shapes:
        reason = "no link has a thickness: give legs one, or add [[body]] tables"
        raise UnsupportedMechanism(mechanism.name, [reason], "measured for clearance")
    if not len(links_of(mechanism).pairs):
        reason = "all links with a thickness share a joint, or are one body, or are ignored"
        raise UnsupportedMechanism(mechanism.name, [reason], "measured for clearance")
    distances, nearest, _ = _measured(solution)
    return Clearance(shaped(distances, solution.shape), solution, nearest)


def _measured(solution: Solution, nearest: Ints | None = None) -> tuple[Floats, Ints, Floats]:
    """Distances (n,), the pairs that have them (n,), and their points (n, 2, 3), as of `least_distances`."""
    return least_distances(placed_links(solution), nearest)


def placed_links(solution: Solution) -> PlacedLinks:
    """The links of a solution."""

    def centres() -> dict[str, Floats]:
        return {name: points.reshape(-1, 3) for name, points in solution.points.items()}

    return PlacedLinks(solution.mechanism, solution._configurations, centres)
