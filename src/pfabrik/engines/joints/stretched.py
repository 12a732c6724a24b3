"""Stretched links on a path, which bend back to the side from which they came."""

from __future__ import annotations

from ...common.arrays import Floats
from ...kernels.rows import PROJECTED, REACHED, Rows
from ...kernels.search_constants import SAME_DISTANCE
from ...machine.model import Model
from ...options import Options
from .first_order import are_stretched
from .parasitic import differences
from .projection import modes_of

SAME_POSE = 1e-7
"""Largest difference of poses that count as equal [L and entries of rotation matrices]."""


class BentConfiguration:
    """The last configuration on a path before links were stretched out.

    A stretched configuration belongs to two working modes. A search that starts from it may continue in either, or
    stay, for along stretched links nothing moves to first order. So a second search starts from the last bent one.

    Attributes
    ----------
    coordinates : joint coordinates (1, columns) of the last answer with bent links; None if that is the last answer.
    """

    def __init__(self, model: Model, options: Options) -> None:
        self._model = model
        self._projection = modes_of(model.path_closure, options)[-1]
        self.coordinates: Floats | None = None

    def update(self, status: int, start: Floats, end: Floats) -> None:
        """Update after a step of the path, from joint coordinates (1, columns) before and after it."""
        if status == REACHED and self.coordinates is None:
            return  # inside the workspace links are hardly ever stretched out, and the check takes time
        is_stretched = bool(are_stretched(self._model, end)[0])
        self.coordinates = (start if self.coordinates is None else self.coordinates) if is_stretched else None

    def is_preferred(self, rows: Rows, bent_rows: Rows) -> bool:
        """True if the answer to a target from the bent start is to replace the one from the last answer.

        It is preferred if it is better, or has the same pose and thus bends links to the side from which they came.
        """
        return self._is_same(rows, bent_rows) or self._is_better(rows, bent_rows)

    def _is_same(self, rows: Rows, bent_rows: Rows) -> bool:
        apart = differences(self._model.closure, bent_rows.poses, rows.poses)[0]
        return bool(bent_rows.status[0] == rows.status[0] and apart <= SAME_POSE)

    def _is_better(self, rows: Rows, bent_rows: Rows) -> bool:
        """True if the second answer has a better status, or is nearer to the target."""
        if bent_rows.status[0] != rows.status[0] or rows.status[0] != PROJECTED:
            return bool(bent_rows.status[0] < rows.status[0])
        distance, bent_distance = (
            self._projection.distances(self._model.path_closure, *answer.measures[:1, :2].T)[0]
            for answer in (rows, bent_rows)
        )
        return bool(bent_distance < (1.0 - SAME_DISTANCE) * distance)
