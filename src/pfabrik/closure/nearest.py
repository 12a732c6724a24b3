"""The exact constrained step of the closure engine: closed loops and kept limits first, then nearest to a wish."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..kernels.closure.loops import BASE_AXES, LOCKED
from .close import EVERYTHING_FREE, MARGIN, Closing, Closure, close

Floats = NDArray[np.float64]

WISHES = (1e-2, 1e-4, 1e-6, 1e-8)
"""Weights of what is wished against what must hold: each starts from the answer to the one before, and the last leaves
the loops open by less than the step that then closes them can notice."""

STEPS = 60
"""Steps for each weight."""


def nearest(
    closure: Closure,
    coordinates: Floats,
    poses: Floats,
    *,
    platform: Sequence[float] = EVERYTHING_FREE,
    frame: int = BASE_AXES,
    targets: Floats | None = None,
    weights: Floats | None = None,
    anchors: Floats | None = None,
    gently: bool = False,
) -> Closing:
    """Feasible configurations nearest to wishes for the platform or for coordinates: a local search.

    Parameters
    ----------
    coordinates, poses : where to start; need not be closed, nor within limits.
    platform : what counts of the platform's distance from `targets`: six weights relative to each other; LOCKED keeps
        a part where it starts.
    frame : what the weights of the rotation are about, as of `close`.
    weights, anchors : what counts of the coordinates' distances from anchors, (columns,), (n, columns).
    gently : open the loops less on the way, so that the search stays in its working mode, and may end less near.

    Returns
    -------
    Closing : judge by `feasible`.
    """
    wished, own = np.array(platform, dtype=float), np.zeros(len(closure.scale)) if weights is None else weights
    held = wished == LOCKED
    for weight in WISHES[1:] if gently else WISHES:
        found = close(
            closure,
            coordinates,
            poses,
            platform=np.where(held, LOCKED, weight * wished).tolist(),
            frame=frame,
            targets=targets,
            weights=weight * own,
            anchors=anchors,
            limits=True,
            margin=MARGIN,
            closeness=-1.0,
            max_iterations=STEPS,
        )
        coordinates, poses = found.coordinates, found.poses
    return close(
        closure,
        coordinates,
        poses,
        platform=np.where(held, LOCKED, 0.0).tolist(),
        frame=frame,
        targets=targets,
        limits=True,
        margin=MARGIN,
    )
