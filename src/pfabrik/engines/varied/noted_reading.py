"""Numbers of a file as expressions of its dimensions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...common.arrays import Floats
from ...machine.description.geometry import (
    AT_POINTS,
    AT_REFERENCE,
    Geometry,
    described_numbers,
    geometry_of,
    limit_numbers,
)
from ...machine.description.mechanism import Mechanism
from ...machine.noted_numbers import Formulas, Trace


class NotedReading:
    """The numbers of a mechanism from a file as expressions of dimensions, noted at values of these.

    Attributes
    ----------
    sketch : the description there.
    given : the dimensions.
    numbers, limits : as of `described_numbers` and `limit_numbers`.
    """

    def __init__(self, mechanism: Mechanism, names: Sequence[str], values: Floats) -> None:
        source, self.trace = mechanism.__dict__["_source"], Trace()
        self.sketch = source.sketch_with(dict(zip(names, values.tolist(), strict=True)))
        self.given = [self.trace.input(value) for value in values.tolist()]
        numbered = source.sketch_with(dict(zip(names, self.given, strict=True)))
        self.numbers, self.limits = described_numbers(numbered), limit_numbers(numbered)


class VariedGeometry:
    """The geometry of a mechanism from a file at values of some of its dimensions.

    Axes and values that follow from centres are those of the mechanism as described.
    """

    def __init__(self, mechanism: Mechanism, names: Sequence[str]) -> None:
        self._mechanism, self._names = mechanism, names
        reading = NotedReading(mechanism, names, np.array([mechanism.dimensions[name] for name in names]))
        decisions = list(reading.trace.decisions.values())
        self._decided = np.array(decisions, float)
        self._formulas = Formulas([*decisions, *reading.numbers], reading.given, 0)
        self._own, joints = geometry_of(mechanism), mechanism.joints
        self._has_axes = np.array([[j.axis is not None or j.axes is not None, j.axes is not None] for j in joints])

    def at(self, values: Floats) -> Geometry:
        """Geometries at values (b, n), every array with the batch in front; InvalidMechanism where there is none."""
        (found, _), n = self._formulas(np.empty(0), values), len(self._decided)
        for row in np.flatnonzero((found[:, :n] != self._decided).any(axis=1)):
            found[row, n:] = NotedReading(self._mechanism, self._names, values[row]).numbers
        return self._geometry(found[:, n:], self._own.axes)

    def slopes(self, values: Floats) -> Geometry:
        """Derivatives of the geometry at values (n,) by the dimensions: every array with these in front."""
        given, n = (np.empty(0), values[None], np.eye(len(values))), len(self._decided)
        numbers, slopes = self._formulas(*given)
        if (numbers[0, :n] != self._decided).any():
            reading, n = NotedReading(self._mechanism, self._names, values), 0
            slopes = Formulas(reading.numbers, reading.given, 0)(*given)[1]
        return self._geometry(slopes[0, n:].T, np.zeros_like(self._own.axes))

    def _geometry(self, numbers: Floats, following: Floats) -> Geometry:
        """Rows of numbers (b, r) as arrays of a geometry, with axes (joints, 2, 3) where these follow from centres."""
        joints = len(self._has_axes)
        parts = np.split(numbers, np.cumsum([AT_POINTS - AT_REFERENCE, 3 * joints, 6 * joints]), axis=1)
        axes = np.where(self._has_axes[:, :, None], parts[2].reshape(-1, joints, 2, 3), following)
        return Geometry(parts[1].reshape(-1, joints, 3), axes, parts[3], parts[0])
