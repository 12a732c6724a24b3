"""Where a path meets or crosses a parallel singularity, in which no actuator holds the platform."""

from __future__ import annotations

import numpy as np

from ..answers.differential import inverse_jacobian
from ..answers.tracked import Track
from ..arrays import Floats, Ints, Mask
from ..errors import InvalidArgument
from ..motion.displacements import actuator_units
from ..tolerances import TOLERANCES

LOOKS = 80
"""Steps of a path that are looked at; more between two of them where a singularity could be."""


def refuse_crossings(track: Track) -> None:
    """Refuse paths that meet or cross a parallel singularity, with the steps.

    Raises
    ------
    InvalidArgument
    """
    looked = np.unique(np.linspace(0, len(track) - 1, LOOKS).astype(int))
    while True:
        holds, basis, side = _measured(track, looked)
        turned = _turned_over(basis, side)
        change = np.abs(np.diff(holds))
        change = np.maximum(change, np.maximum(np.append(change[1:], 0.0), np.insert(change[:-1], 0, 0.0)))
        near = turned | (np.minimum(holds[1:], holds[:-1]) < change)
        between = near & (np.diff(looked) > 1)
        if not between.any():
            break
        looked = np.sort(np.append(looked, (looked[:-1] + looked[1:])[between] // 2))
    met = holds < TOLERANCES.singular
    met[1:] |= turned
    if met.any():
        count = int(met.sum())
        found = f"a path through {count} parallel singularit{'ies' if count > 1 else 'y'}"
        steps = looked[met][:5].tolist()
        raise InvalidArgument("track", found, "a path that its actuators hold throughout", rows=steps)


def _measured(track: Track, rows: Ints) -> tuple[Floats, Floats, Floats]:
    """How well the actuators hold the platform at steps, (k,): their least rate [L or rad] by any of its motions.

    And an orthonormal basis of its motions, (k, freedoms, r), and the orientation of the rates by it, (k,); 0 where
    there are not as many actuators as freedoms.
    """
    mechanism = track.mechanism
    jacobians = inverse_jacobian(track[rows]) / actuator_units(mechanism)[:, None]
    jacobians[..., :3] *= mechanism.characteristic_length
    left, sizes, right = np.linalg.svd(jacobians, full_matrices=False)
    freedoms = int((sizes > TOLERANCES.rank * sizes[:, :1]).sum(axis=1).max(initial=0))
    square = freedoms == jacobians.shape[1]
    side = np.sign(np.linalg.det(left)) if square else np.zeros(len(rows))
    return sizes[:, freedoms - 1], right[:, :freedoms], side


def _turned_over(basis: Floats, side: Floats) -> Mask:
    """Between which of k neighbours the orientation changes, (k - 1,), the bases carried from one to the next."""
    carried = np.sign(np.linalg.det(basis[1:] @ np.swapaxes(basis[:-1], 1, 2)))
    return np.asarray(side[1:] * side[:-1] * carried < 0.0)
