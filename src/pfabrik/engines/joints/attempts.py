"""The attempts of a search, to look into an answer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints, Records
from ...kernels.joints.joint_tables import AT_END, AT_START, TO_CLOSE
from ...kernels.rows import HOLD_NOTHING, HOLD_ORIENTATION, HOLD_POSITION
from ...tolerances import TOLERANCES

STARTS_NAMED = {AT_START: "the start", AT_END: "where loops closed worst"}
HELD = {HOLD_NOTHING: "nothing held", HOLD_ORIENTATION: "orientation held", HOLD_POSITION: "position held"}


def held_words(hold: int, price: float) -> str:
    """What a search holds, and if it does up to a price."""
    return f"{HELD[hold]} up to its price" if price else HELD[hold]


class Attempt(NamedTuple):
    """One attempt to answer a target.

    Attributes
    ----------
    phase : str
        What was tried: closed forms, other working modes, a search with a part of the target held, ...
    start : str
        The configuration that it started from.
    steps : int
        Steps of the search; 0 for closed forms.
    distance : float
        Distance of its end from the target, as projections measure it [length]; NaN where it has no end.
    ending : str
        What became of it.
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


def attempts_of(log: Records, holds: Ints, prices: Floats, length: float) -> Iterator[Attempt]:
    """The attempts of a search in joint coordinates, from its log and from what each projection holds at what price."""
    for aim in range(TO_CLOSE, len(holds)):
        chosen = log[log["aim"] == aim]
        starts = [STARTS_NAMED.get(start, f"seed {start}") for start in chosen["start"].tolist()]
        distances = np.where(np.isfinite(chosen["distance"]), length * chosen["distance"], np.nan)
        if aim == TO_CLOSE and len(chosen):
            ending = "not reached" if np.isnan(distances[0]) else "reached"
            yield Attempt("loops closed on the target", starts[0], int(chosen["steps"][0]), distances[0], ending)
        elif len(chosen):
            phase = f"joint coordinates, {held_words(int(holds[aim]), prices[aim, 0])}"
            yield from with_verdicts(phase, starts, chosen["steps"].tolist(), distances)
