"""Least margins and largest tilts of rods along a path that was followed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..common.arrays import Floats
from ..machine.decomposition.leg_forms import ElementaryJoint, Rod
from ..machine.description.mechanism import Mechanism
from ..machine.model import model_of
from ..machine.motion.displacements import displacements, home_coordinates
from .margins import margins
from .solution import Solution


class Extremes(NamedTuple):
    """An extreme value in every row, (n,), and the names of what has it, n; NaN and "" where there is none.

    Attributes
    ----------
    values : array (n,)
        The extreme values.
    names : list of str
        Names of what has them.
    """

    values: Floats
    names: list[str]


def least_margins(solution: Solution) -> Extremes:
    """The smallest margin of every row, of those of `margins`, and the limit that has it: its joint and bound."""
    by_limit = margins(solution)
    if not by_limit:
        return Extremes(np.full(len(solution), np.nan), [""] * len(solution))
    names = [f"{joint} {bound}" for joint, bound in by_limit]
    return _extremes(np.stack([np.asarray(values) for values in by_limit.values()], axis=-1), names)


def largest_tilts(solution: Solution) -> Extremes | None:
    """The largest tilt of any rod in every row [rad], and the body of that rod; None for machines without rods.

    The tilt of a rod is the angle between its line and the direction in which its carriage or crank moves its base
    end: 0 where it is pushed along its length, a quarter turn at a dead point. Struts, which change their length, have
    none.
    """
    rods = _rods(solution.mechanism)
    if not rods:
        return None
    bodies = displacements(solution.mechanism, solution.q - home_coordinates(solution.mechanism))
    tilts = []
    for rod, line, proximal, motion in rods:
        now, pushed = bodies[rod][:, :3, :3] @ line, bodies[proximal][:, :3, :3] @ motion
        across = np.linalg.norm(np.cross(now, pushed), axis=-1)
        tilts.append(np.arctan2(across, np.abs((now * pushed).sum(axis=-1))))
    least = _extremes(-np.stack(tilts, axis=-1), [rod for rod, *_ in rods])
    return least._replace(values=-least.values)


def _rods(mechanism: Mechanism) -> list[tuple[str, Floats, str, Floats]]:
    """Rods on proximal joints: body and line at home, body of the joint, direction of motion of the base end."""
    model = model_of(mechanism)
    rods: list[tuple[str, Floats, str, Floats]] = []
    proximal: ElementaryJoint | None = None
    for form, record in zip(model.legs.forms, model.legs.legs, strict=True) if model.has_legs else ():
        if not isinstance(form, Rod):
            continue
        if not form.is_shared:
            proximal, first = form.proximal, record
        if proximal is None or form.slide is not None or not form.base_ending.elements:
            continue
        axis = motion = first["proximal_axis"]
        if proximal.kind == "R":
            motion = np.cross(axis, record["base_end_point"] - first["proximal_point"])
        rods.append((form.base_ending.elements[-1].outward, record["line"], proximal.outward, motion))
    return rods


def _extremes(values: Floats, names: list[str]) -> Extremes:
    """The least value of each row, (n, k) to (n,)."""
    places = np.argmin(np.where(np.isnan(values), np.inf, values), axis=1)
    return Extremes(values[np.arange(len(values)), places], [names[place] for place in places.tolist()])
