"""The attempts of a search, repeated one by one to look into an answer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ..arrays import Floats
from ..kernels.rows import HOLD_NOTHING, HOLD_ORIENTATION, HOLD_POSITION
from ..motion.closure import Closure
from ..tolerances import TOLERANCES
from .descend import MOST_STEPS, clip_targets, nearest_configurations
from .multistart import seeds_of
from .projection import ProjectionMode

HELD = {HOLD_NOTHING: "nothing held", HOLD_ORIENTATION: "orientation held", HOLD_POSITION: "position held"}


class Attempt(NamedTuple):
    """One attempt to answer a target.

    Attributes
    ----------
    phase : what was tried: closed forms, other working modes, a search with a part of the target held, ...
    start : the configuration that it started from.
    steps : steps of the search; 0 for closed forms.
    distance : of its end from the target, as projections measure it [length]; NaN where it has no end.
    ending : what became of it.
    """

    phase: str
    start: str
    steps: int
    distance: float
    ending: str


def with_verdicts(phase: str, starts: Sequence[str], steps: Sequence[int], distances: Floats) -> Iterator[Attempt]:
    """The attempts of one phase, each judged against the nearest of them."""
    nearest = np.nanmin(distances) if np.isfinite(distances).any() else np.nan
    for start, n_steps, distance in zip(starts, steps, distances.tolist(), strict=True):
        if np.isnan(distance):
            ending = "no feasible configuration"
        elif distance <= nearest * (1.0 + TOLERANCES.position) + TOLERANCES.position:
            ending = "nearest"
        else:
            ending = f"farther by {distance - nearest:.3g}"
        yield Attempt(phase, start, n_steps, distance, ending)


def descents(
    closure: Closure, target: Floats, start: Floats, projections: Sequence[ProjectionMode], *, seeds: bool
) -> Iterator[Attempt]:
    """Searches in joint coordinates for one target (1, 4, 4), from a start (1, columns) and from seeds."""
    starts = np.concatenate([start, *(seed[None] for seed in (seeds_of(closure) if seeds else ()))])
    names = ["the start", *(f"seed {k + 1}" for k in range(len(starts) - 1))]
    targets = np.repeat(clip_targets(closure.mechanism, target), len(starts), axis=0)
    frame, length = closure.task.frame, closure.mechanism.characteristic_length
    for projection in projections:
        ends = nearest_configurations(
            closure, starts, targets, platform=projection.weights, frame=frame, steps=MOST_STEPS
        )
        distances = length * projection.distances(closure, ends.poses, np.repeat(target, len(starts), axis=0))
        distances = np.where(ends.feasible, distances, np.nan)
        phase = f"joint coordinates, {HELD[projection.hold]}"
        yield from with_verdicts(phase, names, ends.iterations.tolist(), distances)
