"""How redundant actuators keep feet on the ground: as far from slipping and lifting as their forces let them.

A contact presses with a force f, f_n of it along the normal and f_t along the ground. It neither slips nor lifts where
|f_t| <= mu f_n; what it has to spare is s = f_n - |f_t| / mu, the normal force that it may lose before. Of all forces
of the actuators that hold the load, those are best whose least s is largest. It is found by a barrier: of

    max  s + w [ sum log((f_n - s)^2 - |f_t|^2 / mu^2) + sum log(t - low) + sum log(high - t) ]

by Newton's method, for a falling weight w.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints
from ...common.checks import require_known, require_positive
from ...common.rotations import square_to
from ...errors import InvalidArgument
from ...machine.description.joints import Joint
from ...machine.description.mechanism import Mechanism

WEIGHTS = tuple(10.0**-power for power in range(10))
"""Weights of the barrier [of the load]: the last leaves less than 1e-8 of the load."""

MOST_STEPS, MOST_HALVINGS = 50, 60
"""Newton's steps at each weight, and the halvings of each."""

BETWEEN = 1e-6
"""Share of a range of forces by which the first ones are off its ends."""

RIDGE = 1e-12
"""Curvature of directions in which nothing changes."""


class Feet(NamedTuple):
    """Contacts on the ground.

    Attributes
    ----------
    names : of their joints; places : indices of these, (f,).
    signs : 1 where the joint's first body is the ground, else -1, (f,).
    friction : coefficients, (f,).
    normal : up, (3,).
    """

    names: tuple[str, ...]
    places: Ints
    signs: Floats
    friction: Floats
    normal: Floats


def feet_of(mechanism: Mechanism, friction: float | Mapping[str, float], gravity: Floats) -> Feet:
    """The contacts that friction is told of: a coefficient for all balls on the base, or by name."""
    balls = {joint.name: joint for joint in mechanism.joints if _is_foot(joint, mechanism.base)}
    if isinstance(friction, Mapping):
        require_known("point contact, a passive ball on the base", friction, balls)
    elif not balls:
        found = f"no passive ball on '{mechanism.base}'"
        raise InvalidArgument("friction", found, "points that touch the ground, as of `stand`")
    by_name = friction if isinstance(friction, Mapping) else dict.fromkeys(balls, friction)
    values = [require_positive(f"friction['{name}']", value) for name, value in by_name.items()]
    if not gravity.any():
        raise InvalidArgument("gravity", "none", "one, against which the ground's normal points")
    names = [joint.name for joint in mechanism.joints]
    signs = [1.0 if balls[name].connects[0] == mechanism.base else -1.0 for name in by_name]
    places = np.array([names.index(name) for name in by_name])
    return Feet(tuple(by_name), places, np.array(signs), np.array(values), -gravity / np.linalg.norm(gravity))


def _is_foot(joint: Joint, base: str) -> bool:
    return joint.type == "spherical" and base in joint.connects


def off_the_ends(limits: Floats) -> Floats:
    """Limits of forces (n_a, 2) between which others are that the barrier may begin with."""
    low, high = limits.T
    off = BETWEEN * np.where(
        np.isfinite(high - low), high - low, np.maximum(*np.where(np.isfinite(limits), abs(limits), 0.0).T)
    )
    return np.stack([low + off, high - off], axis=1)


def best_footing(
    pressing: Floats, changes: Floats, feet: Feet, exerted: Floats, free: Floats, limits: Floats
) -> Floats:
    """How far to go along free forces of the actuators for the most to spare, (k,).

    Parameters
    ----------
    pressing : forces on the feet from the ground, (f, 3).
    changes : of these by free forces of the actuators, (f, 3, k).
    exerted, free : forces of the actuators, (n_a,), and free ones, (n_a, k).
    limits : of the actuators, (n_a, 2), between which `exerted` is, not on them; infinite where there is none.
    """
    size = max(float(np.abs(pressing).max(initial=0.0)), 1e-300)
    rows = cone_rows(feet)
    base, slopes = np.einsum("fij,fj->fi", rows, pressing), np.einsum("fij,fjk->fik", rows, changes)
    low, high = (np.isfinite(side) for side in limits.T)
    box = np.concatenate([free[low], -free[high]])
    room = np.concatenate([(exerted - limits[:, 0])[low], (limits[:, 1] - exerted)[high]])
    x = np.append(np.zeros(free.shape[1]), spare_of(base).min(initial=0.0) - size)

    def value(x: Floats, weight: float) -> float:
        """What is to be largest; minus infinity beyond the borders."""
        cone = base + slopes @ x[:-1]
        up, within = cone[:, 0] - x[-1], room + box @ x[:-1]
        inside = up**2 - cone[:, 1] ** 2 - cone[:, 2] ** 2
        if (up <= 0.0).any() or (inside <= 0.0).any() or (within <= 0.0).any():
            return -np.inf
        return float(x[-1] / size + weight * (np.log(inside).sum() + np.log(within).sum()))

    for weight in WEIGHTS:
        for _ in range(MOST_STEPS):
            cone = base + slopes @ x[:-1]
            up, within = cone[:, 0] - x[-1], room + box @ x[:-1]
            vectors = np.concatenate([slopes, np.zeros((len(cone), 3, 1))], axis=2)
            vectors[:, 0, -1] = -1.0
            signed = np.stack([up, -cone[:, 1], -cone[:, 2]], axis=1)
            inside = up**2 - cone[:, 1] ** 2 - cone[:, 2] ** 2
            first = 2.0 * np.einsum("fi,fik->fk", signed, vectors) / inside[:, None]
            second = np.einsum("fik,i,fil->fkl", vectors, np.array([2.0, -2.0, -2.0]), vectors) / inside[:, None, None]
            by_box = np.concatenate([box, np.zeros((len(box), 1))], axis=1) / within[:, None]
            slope = weight * (first.sum(axis=0) + by_box.sum(axis=0))
            slope[-1] += 1.0 / size
            bend = weight * ((first[:, :, None] * first[:, None] - second).sum(axis=0) + by_box.T @ by_box)
            bend += RIDGE * max(1.0, float(np.trace(bend))) * np.eye(len(x))
            step = np.linalg.solve(bend, slope)
            gain, share, now = float(slope @ step), 1.0, value(x, weight)
            for _ in range(MOST_HALVINGS):
                if value(x + share * step, weight) >= now + 0.25 * share * gain:
                    break
                share *= 0.5
            x = x + share * step
            if gain <= 1e-9 * weight:
                break
    return np.asarray(x[:-1])


def cone_rows(feet: Feet) -> Floats:
    """Rows (f, 3, 3) that take a force on each foot to f_n, and the two parts of f_t / mu."""
    rows = np.array([feet.normal, *square_to(feet.normal)])
    scaled = np.broadcast_to(rows, (len(feet.names), 3, 3)).copy()
    scaled[:, 1:] /= feet.friction[:, None, None]
    return scaled


def spare_of(cone: Floats) -> Floats:
    """What feet have to spare, (..., f), of f_n and f_t / mu, (..., f, 3)."""
    return np.asarray(cone[..., 0] - np.hypot(cone[..., 1], cone[..., 2]))
