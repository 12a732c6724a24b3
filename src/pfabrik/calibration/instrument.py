"""The instrument that measures a machine: the frame in which it sees the base, and its target on the platform."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Mask
from ..rotations import from_rotvec, to_rotvec, turning
from .measurements import Measurements

INSTRUMENT = ("frame", "tool")
"""The frame and target of an instrument, which sees T_instrument_base T_base_platform T_platform_target."""

ROUNDS = 20
"""Rounds in which frame and target are aligned to each other."""

UNTURNED = 1e-9
"""Part of no turn in what decides one, so that it also decides about an axis about which nothing tells."""


def seen(poses: Floats, twists: Floats | None, places: Floats, moves: Floats) -> tuple[Floats, Floats | None]:
    """Poses (n, 4, 4), and twists (n, 6, p) of them by parameters, as an instrument sees them.

    Parameters
    ----------
    places : a rotation vector and a place of the frame and of the target, (2, 6) [rad, length].
    moves : their derivatives by the parameters, (p, 2, 6).
    """
    frame, target = _matrices(places)
    here = frame @ poses @ target
    if twists is None:
        return here, None
    turn, turned = frame[:3, :3], frame[:3, :3] @ poses[:, :3, :3]
    of_frame, of_target = (turning(places[k : k + 1, :3])[0] @ moves[:, k, :3].T for k in (0, 1))
    arms, levers = poses[:, :3, :3] @ target[:3, 3], here[:, :3, 3] - frame[:3, 3]
    angular = turn @ twists[:, 3:] + of_frame + turned @ of_target
    velocity = turn @ (twists[:, :3] + np.cross(twists[:, 3:], arms[:, :, None], axis=1)) + moves[:, 0, 3:].T
    velocity = velocity + np.cross(of_frame[None], levers[:, :, None], axis=1) + turned @ moves[:, 1, 3:].T
    return here, np.concatenate([velocity, angular], axis=1)


def aligned(poses: Floats, given: Measurements, is_free: Mask, length: float) -> Floats:
    """The frame and the target, (2, 6), that take poses (n, 4, 4) nearest to measured ones, in closed form.

    Turns follow from covariances (Arun; of positions, and of orientations), then both places from linear equations;
    round by round where frame and target are open.

    Parameters
    ----------
    is_free : which numbers may be other than 0, (2, 6); turns only if all three may.
    """
    places = np.zeros((2, 6))
    position, orientation = (np.full(shape, np.nan) if a is None else a for a, shape in _fields(given))
    at, turned = np.isfinite(position).all(axis=1), np.isfinite(orientation).all(axis=(1, 2))
    for number in range(ROUNDS if is_free.any(axis=1).all() else 1):
        frame, target = _matrices(places)
        if is_free[0, :3].all():
            shown = poses @ target
            covariance = _spread(position[at]).T @ _spread(shown[at, :3, 3]) / length**2
            if number > 0 or not is_free[1, :3].all() or not at.any():
                covariance += np.einsum("nij,nkj->ik", orientation[turned], shown[turned, :3, :3])
            places[0, :3] = to_rotvec(_nearest_turn(covariance))
            frame = _matrices(places)[0]
        turns = frame[:3, :3] @ poses[:, :3, :3]
        if is_free[1, :3].all():
            places[1, :3] = to_rotvec(_nearest_turn(np.einsum("nji,njk->ik", turns[turned], orientation[turned])))
        columns = np.concatenate([np.broadcast_to(np.eye(3), turns.shape), turns], axis=2)[at][
            :, :, is_free[:, 3:].ravel()
        ]
        wanted = (position - poses[:, :3, 3] @ frame[:3, :3].T)[at]
        found = np.linalg.lstsq(columns.reshape(-1, columns.shape[2]), wanted.ravel())[0]
        places[:, 3:][is_free[:, 3:]] = found
    return places


def _fields(given: Measurements) -> tuple[tuple[Floats | None, tuple[int, ...]], ...]:
    return (given.position, (given.rows, 3)), (given.orientation, (given.rows, 3, 3))


def _matrices(places: Floats) -> Floats:
    """Poses (2, 4, 4) of rotation vectors and places, (2, 6)."""
    made = np.tile(np.eye(4), (2, 1, 1))
    made[:, :3, :3], made[:, :3, 3] = from_rotvec(places[:, :3]), places[:, 3:]
    return made


def _spread(points: Floats) -> Floats:
    return points - points.mean(axis=0) if len(points) else points


def _nearest_turn(covariance: Floats) -> Floats:
    """The rotation with the largest trace of its transpose times a matrix (3, 3)."""
    left, _, right = np.linalg.svd(covariance + UNTURNED * np.eye(3))
    return np.asarray(left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right)
