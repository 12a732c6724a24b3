"""What a machine has left along a path that was followed: room before its limits, and how upright its rods stand."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..answers.margins import margins
from ..answers.solution import Solution
from ..arrays import Floats
from ..decomposition.elementary_joints import ElementaryJoint
from ..decomposition.leg_forms import Rod
from ..description.mechanism import Mechanism
from ..model import model_of
from ..motion.displacements import displacements, home_coordinates


class Extremes(NamedTuple):
    """The extreme of a kind in every row, (n,), and what it is of, n names; NaN and "" where there is nothing."""

    values: Floats
    names: list[str]


def least_margins(solution: Solution) -> Extremes:
    """The smallest margin of all limits, as of `margins`, and the limit: its joint and bound."""
    found = margins(solution)
    if not found:
        return Extremes(np.full(len(solution), np.nan), [""] * len(solution))
    names = [f"{joint} {bound}" for joint, bound in found]
    return _extremes(np.stack([np.asarray(each) for each in found.values()], axis=-1), names)


def largest_tilts(solution: Solution) -> Extremes | None:
    """The largest tilt of any rod [rad], and which body that rod is; None for machines without rods.

    The tilt of a rod is the angle between its line and the direction in which its carriage or crank moves its foot: 0
    where it is pushed along its length, a quarter turn at a dead point. Struts, which change their length, have none.
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
    found = _extremes(-np.stack(tilts, axis=-1), [rod for rod, *_ in rods])
    return found._replace(values=-found.values)


def _rods(mechanism: Mechanism) -> list[tuple[str, Floats, str, Floats]]:
    """Of every rod on a proximal joint: its body and line at home, the joint's body, the motion of the base end."""
    model = model_of(mechanism)
    found: list[tuple[str, Floats, str, Floats]] = []
    proximal: ElementaryJoint | None = None
    for form in model.legs.forms if model.has_legs else ():
        if not isinstance(form, Rod):
            continue
        proximal = proximal if form.is_shared else form.proximal
        if proximal is None or form.slide is not None or not form.base_ending.elements:
            continue
        turns = proximal.kind == "R"
        motion = np.cross(proximal.axis, form.base_end - proximal.point) if turns else proximal.axis
        found.append(
            (form.base_ending.elements[-1].outward, form.platform_end - form.base_end, proximal.outward, motion)
        )
    return found


def _extremes(values: Floats, names: list[str]) -> Extremes:
    """The least of each row, (n, k) to (n,)."""
    places = np.argmin(np.where(np.isnan(values), np.inf, values), axis=1)
    return Extremes(values[np.arange(len(values)), places], [names[place] for place in places.tolist()])
