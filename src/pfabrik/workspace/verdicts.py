"""Which coordinates of a map are within reach, how far inside or beyond, and what forms the border there."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from ..answers.limits import active_limits
from ..answers.solution import Solution, Status
from ..arrays import Floats, Ints
from ..decomposition.leg_table import LegTable, leg_table
from ..description.mechanism import Mechanism
from ..feasibility import feasibility
from ..ik import solve_ik
from ..options import Options
from ..rotations import from_rotvec
from .space import Space

Limits: TypeAlias = tuple[tuple[str, str], ...]
"""(joint, bound) of limits: as of `Feasibility`; or a coordinate and "min", "max", its end in what was looked at."""

KEPT = Options(working_mode="keep", on_invalid="mark")
INSIDE, OUTSIDE = 1.0, -1.0
"""What stands for a margin where no closed form tells one: its sign is all that counts."""

AZIMUTHS, RING = 24, np.radians(6.0)
"""Tilts to every side are asked for in so many directions, and in steps no larger than this [rad]."""

GEOMETRY = ("", "reach")
"""What forms the border where no limit of a joint does, and no closed form tells which leg."""


@dataclass(frozen=True, eq=False)
class Question:
    """What is asked of every point of a map.

    Attributes
    ----------
    start : a configuration whose working mode is kept; None for home's.
    turns : rotations (k, 3, 3) in the base frame that each pose is turned by.
    wanted : whether a point counts where "all" poses turned so are within reach, or where "any" is.
    lowest, highest : where the map ends, (d,) [length or rad].
    """

    space: Space
    start: Solution | None
    turns: Floats
    wanted: Literal["all", "any"]
    lowest: Floats
    highest: Floats

    @property
    def mechanism(self) -> Mechanism:
        return self.space.mechanism

    @property
    def has_margins(self) -> bool:
        """Whether closed forms tell margins; else points are asked for one by one, and only told whether reached."""
        return isinstance(leg_table(self.mechanism), LegTable)

    @property
    def limits(self) -> Limits:
        """The limits that borders are formed by, in the order of `measure`."""
        own = _known_limits(self.mechanism)
        return own + tuple((name, bound) for name in self.space.names for bound in ("min", "max"))

    def measure(self, points: Floats) -> tuple[Floats, Ints]:
        """Margins (n,) of points (n, d), negative beyond reach, and which of `limits` each is of; -1 for none."""
        margins, bindings = self._least(points)
        lengths = np.where(self.space.is_angle, 1.0, self.mechanism.characteristic_length)
        past = np.stack([points - self.lowest, self.highest - points], axis=2) / lengths[:, None]
        past = past.reshape(len(points), -1)
        worst = past.argmin(axis=1)
        cut = np.take_along_axis(past, worst[:, None], axis=1)[:, 0]
        is_cut = cut < np.minimum(margins, 0.0)
        n_own = len(_known_limits(self.mechanism))
        return np.where(is_cut, cut, margins), np.where(is_cut, n_own + worst, bindings)

    def _least(self, points: Floats) -> tuple[Floats, Ints]:
        """The margins over all turns: the least of all, as far as it is negative; or the greatest of any."""
        sign = 1.0 if self.wanted == "all" else -1.0
        margins, bindings = np.full(len(points), sign * np.inf), np.full(len(points), -1)
        poses = self.space.poses(points)
        open_ = np.arange(len(points))
        for turn in self.turns:
            turned = poses[open_]
            turned[:, :3, :3] = turn @ turned[:, :3, :3]
            own, binding = self._of_poses(turned)
            own = np.where(np.isnan(own), -np.inf, own)
            better = sign * own < sign * margins[open_]
            margins[open_[better]], bindings[open_[better]] = own[better], binding[better]
            open_ = open_[sign * margins[open_] >= 0.0]
        return margins, bindings

    def _of_poses(self, poses: Floats) -> tuple[Floats, Ints]:
        if self.has_margins:
            found = feasibility(self.mechanism, poses, start=self.start)
            return found.margin, found.binding
        answers = solve_ik(self.mechanism, poses, start=self.start, options=KEPT)
        reached = answers.status == Status.REACHED
        bindings = np.full(len(poses), len(_known_limits(self.mechanism)) - 1)
        return np.where(reached, INSIDE, OUTSIDE), bindings

    def name_limits(self, points: Floats) -> Ints:
        """Which of `limits` points (n, d) just beyond the border are beyond."""
        margins, bindings = self.measure(points)
        if self.has_margins or self.turns.shape[0] > 1:
            return bindings
        rows = np.flatnonzero((margins < 0.0) & (bindings == len(_known_limits(self.mechanism)) - 1))
        answers = solve_ik(self.mechanism, self.space.poses(points[rows]), start=self.start, options=KEPT)
        place = {limit: index for index, limit in enumerate(_known_limits(self.mechanism))}
        for row, held in zip(rows.tolist(), active_limits(self.mechanism, answers._coordinates), strict=True):
            if held:
                bindings[row] = place[held[0].joint, held[0].bound]
        return bindings


def _known_limits(mechanism: Mechanism) -> Limits:
    if isinstance(leg_table(mechanism), LegTable):
        return feasibility(mechanism, mechanism.home_pose).limits
    ranges = [(joint.name, bound) for joint in mechanism.joints if joint.range is not None for bound in ("min", "max")]
    cones = [(joint.name, "cone") for joint in mechanism.joints if joint.cone is not None]
    return (*ranges, *cones, GEOMETRY)


def tilts_up_to(angle: float) -> Floats:
    """Rotations (n, 3, 3): tilts of the base's z axis to all sides, the greatest first, and none."""
    rings = max(1, math.ceil(angle / RING)) if angle > 0.0 else 0
    azimuths = 2.0 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
    sizes = angle * np.arange(rings, 0, -1) / max(rings, 1)
    vectors = np.zeros((1 + AZIMUTHS * rings, 3))
    vectors[:-1, 0] = (sizes[:, None] * np.cos(azimuths)).ravel()
    vectors[:-1, 1] = (sizes[:, None] * np.sin(azimuths)).ravel()
    return from_rotvec(vectors)


def all_rotations(mechanism: Mechanism) -> Floats:
    """Rotations (n, 3, 3) over all there are that the mechanism's freedoms have, none first."""
    raise NotImplementedError
