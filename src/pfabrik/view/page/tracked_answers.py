"""A path as a page plays it."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...answers.tracked import Track
from ...common.memory_image import packed
from ..plot_track import checked_track
from .page_answers import page_answer
from .page_json import as_json

FRAMES_A_SECOND = 20

DIGITS = 7
"""Digits of the numbers of a step that count: it is looked at, and a drag from it starts nearby."""


def played(track: Track) -> dict[str, Any]:
    """The time of a step [s], targets [length], and the answers of all steps that have a configuration, packed."""
    steps = []
    for k in checked_track(track).tolist():
        step = page_answer(track[k]) | {"step": k + 1, "target": np.asarray(track.targets[k]).ravel().tolist()}
        steps.append({name: _shortened(value) for name, value in step.items()})
    return {
        "every": track.sample_time or 1.0 / FRAMES_A_SECOND,
        "steps": packed(as_json(steps).encode()),
    }


def _shortened(value: Any) -> Any:
    """Numbers with the digits that count."""
    if isinstance(value, list):
        return [_shortened(each) for each in value]
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) and np.isfinite(value) else value
