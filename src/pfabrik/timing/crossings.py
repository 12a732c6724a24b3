"""Where a path meets or crosses a parallel singularity, in which no actuator holds the platform."""

from __future__ import annotations

import numpy as np

from ..answers.differential import inverse_jacobian
from ..answers.tracked import Track
from ..arrays import Floats, Ints, Mask
from ..errors import InvalidArgument
from ..kinematics import actuator_units
from ..tolerances import TOLERANCES

LOOKS = 80
"""Steps of a path that are sampled at first; more are added where a singularity could be between two of them."""


def refuse_crossings(track: Track) -> None:
    """Refuse paths that meet or cross a parallel singularity, with the steps.

    Raises
    ------
    InvalidArgument
    """
    sampled = np.unique(np.linspace(0, len(track) - 1, LOOKS).astype(int))
    while True:
        holds, basis, orientation = _measured(track, sampled)
        turned = _turned_over(basis, orientation)
        change = np.abs(np.diff(holds))
        change = np.maximum(change, np.maximum(np.append(change[1:], 0.0), np.insert(change[:-1], 0, 0.0)))
        near = turned | (np.minimum(holds[1:], holds[:-1]) < change)
        between = near & (np.diff(sampled) > 1)
        if not between.any():
            break
        sampled = np.sort(np.append(sampled, (sampled[:-1] + sampled[1:])[between] // 2))
    is_singular = holds < TOLERANCES.singular
    is_singular[1:] |= turned
    if is_singular.any():
        count = int(is_singular.sum())
        found = f"a path through {count} parallel singularit{'ies' if count > 1 else 'y'}"
        steps = sampled[is_singular][:5].tolist()
        raise InvalidArgument("track", found, "a path that its actuators hold throughout", rows=steps)


def _measured(track: Track, rows: Ints) -> tuple[Floats, Floats, Floats]:
    """The smallest singular value of the inverse Jacobian at steps, (k,), lengths relative to L: the least actuator
    rate of any unit motion of the platform.

    Also an orthonormal basis of its motions, (k, freedoms, r), and the orientation of the rates in it, (k,); 0 where
    actuators and freedoms differ in number.
    """
    mechanism = track.mechanism
    jacobians = inverse_jacobian(track[rows]) / actuator_units(mechanism)[:, None]
    jacobians[..., :3] *= mechanism.characteristic_length
    left, sizes, right = np.linalg.svd(jacobians, full_matrices=False)
    freedoms = int((sizes > TOLERANCES.rank * sizes[:, :1]).sum(axis=1).max(initial=0))
    square = freedoms == jacobians.shape[1]
    orientation = np.sign(np.linalg.det(left)) if square else np.zeros(len(rows))
    return sizes[:, freedoms - 1], right[:, :freedoms], orientation


def _turned_over(basis: Floats, orientation: Floats) -> Mask:
    """Mask (k - 1,) of neighbours between which the orientation changes, with each basis carried to the next."""
    carried = np.sign(np.linalg.det(basis[1:] @ np.swapaxes(basis[:-1], 1, 2)))
    return np.asarray(orientation[1:] * orientation[:-1] * carried < 0.0)
