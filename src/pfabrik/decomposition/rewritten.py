"""The table of legs of a mechanism with another geometry, without reading its legs anew."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ..arrays import Floats
from .leg_table import LegTable


def rewritten(table: LegTable, numbers: Floats) -> LegTable | None:
    """The table of the same legs for other numbers, to the last bit that of a new mechanism; None if legs must be read.

    They must where a decision by which legs were read comes out otherwise: joints are no longer along a rod, or axes
    cross that did not, or the direction of a slide has turned over.

    Parameters
    ----------
    numbers : the home numbers of the machine with another geometry, as of `description.geometry.numbers_with`.
    """
    from ..kernels.replay import replay

    recording = table.recording
    if recording is None:
        return None
    values, words = recording.values.copy(), recording.words.copy()
    if not replay(recording.steps, numbers, recording.used, values, recording.writes, words):
        return None
    arrays: dict[str, Any] = recording.arrays(words)
    return replace(table, **arrays)
