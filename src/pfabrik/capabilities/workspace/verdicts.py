"""Margins of the points of a map, and the limits that form the border."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, TypeAlias

import numpy as np

from ...answers.active_limits import active_limits, stretched_joint
from ...answers.margins import margins
from ...answers.solution import Solution
from ...answers.status import Status
from ...common.arrays import Floats, Ints, Mask
from ...common.batch import put, take_each
from ...common.rotations import from_rotvec
from ...configuration import configuration
from ...feasibility import feasibility, limits_of, margins_at
from ...ik import solve_ik
from ...kinematics import (
    POSITION_ERROR,
    Configurations,
    Grower,
    Starts,
    engine_of,
    home_coordinates,
    legs_decide,
    why_not_measured,
)
from ...machine.description.mechanism import Mechanism
from ...machine.model import model_of
from ...options import Options
from ...tolerances import TOLERANCES
from .space import Space

Limits: TypeAlias = tuple[tuple[str, str], ...]
"""(joint, bound) of limits: as of `Feasibility`; or a coordinate and "min", "max", its end in the map."""

INSIDE, OUTSIDE = 1.0, -1.0
"""Values in place of margins where no closed form gives them: only the sign counts."""

GEOMETRY = ("", "stretched")
"""The limit of a border that no limit of a joint forms, where neither a closed form gives the leg nor links tell."""


AZIMUTHS, RING = 24, math.radians(6.0)
"""Number of directions of tilts to every side, and the largest step between tilts [rad]."""

Verdict: TypeAlias = Callable[[Floats], tuple[Floats, Ints]]
"""From poses (n, 4, 4) to margins and bindings (n,)."""


@dataclass(frozen=True, eq=False)
class MapQuestion:
    """The question that every point of a map answers: its poses, its working mode, and the ends of the map.

    Attributes
    ----------
    start : a configuration whose working mode is kept; None for that of home.
    turns : rotations (k, 3, 3) in the base frame; a point counts where its pose is within reach turned by each of them.
    hold : "orientation"; or "position", where it counts with whatever orientation.
    lowest, highest : where the map ends, (d,) [length or rad].
    """

    space: Space
    start: Solution | None
    turns: Floats
    hold: Literal["orientation", "position"]
    lowest: Floats
    highest: Floats

    @property
    def mechanism(self) -> Mechanism:
        return self.space.mechanism

    @property
    def has_margins(self) -> bool:
        """True if closed forms give margins; else points are solved one by one, and only known as reached or not."""
        return self.hold == "orientation" and legs_decide(self.mechanism)

    @property
    def limits(self) -> Limits:
        """The limits that borders are formed by, in the order of `measure`."""
        return self._known_limits + tuple((name, bound) for name in self.space.names for bound in ("min", "max"))

    @cached_property
    def _known_limits(self) -> Limits:
        if self.has_margins:
            return limits_of(self.mechanism)
        home = configuration(self.mechanism, home_coordinates(self.mechanism))
        return (*margins(home), *((joint.name, "stretched") for joint in self.mechanism.joints), GEOMETRY)

    @property
    def _grower(self) -> Grower:
        grower = engine_of(self.mechanism).grower(self.hold)
        assert grower is not None
        return grower

    @cached_property
    def is_grown(self) -> bool:
        """True if known configurations lead from one point to the next; else each point is measured by itself."""
        return not self.has_margins and len(self.turns) == 1 and engine_of(self.mechanism).grower(self.hold) is not None

    @property
    def has_many_at_a_point(self) -> bool:
        """True if a map is grown whose points have families of configurations: some lead farther than others do."""
        return self.is_grown and (self.hold == "position" or bool(why_not_measured(self.mechanism)))

    @property
    def is_quick_anew(self) -> bool:
        """True if any point may be searched for anew: one out of reach takes about as long as one within."""
        return self.hold == "position"

    @property
    def first_start(self) -> Starts:
        """The configuration that points are searched for anew from; none if the map is not grown."""
        if not self.is_grown:
            return Starts(np.zeros((0, 4, 4)), np.zeros((0, 0)), np.zeros((0, 0)))
        return self._grower.known(None if self.start is None else self.start._configurations)

    def look(self, points: Floats, known: Starts, anew: bool) -> tuple[Floats, Ints, Starts]:
        """Margins and bindings as of `measure`, and configurations at points or nearest to them, if the map is grown.

        Then negative margins are distances from these configurations [L]; that of a search that fails, which says
        nothing of what is around a point, is the least that counts as one.

        Parameters
        ----------
        known, anew : as of `Grower.grow`.
        """
        if not self.is_grown:
            return *self.measure(points), known
        found = self._grown(points, known, anew)
        ends = self._grower.known(found)
        failed = np.flatnonzero(found.rows.status > Status.PROJECTED)
        put(ends, failed, take_each(known, failed))
        return *self._cut(points, *self._of_grown(found)), ends

    def _of_grown(self, found: Configurations) -> tuple[Floats, Ints]:
        status, away = found.rows.status, found.rows.measures[:, POSITION_ERROR] / self.mechanism.characteristic_length
        away = np.where(status == Status.PROJECTED, np.maximum(away, TOLERANCES.position), TOLERANCES.position)
        return np.where(status == Status.REACHED, INSIDE, -away), np.full(len(status), self._unknown)

    def _grown(self, points: Floats, known: Starts, anew: bool) -> Configurations:
        targets = np.require(self.space.poses(points), requirements=["C", "W"])
        keeps = self.hold == "orientation" or self.start is not None
        return self._grower.grow(known, targets, anew=anew, keep_mode=keeps)

    def measure(self, points: Floats) -> tuple[Floats, Ints]:
        """Margins (n,) of points (n, d), negative beyond reach, and which of `limits` each is of; -1 for none."""
        if self.is_grown and self.is_quick_anew:
            return self.look(points, self.first_start, True)[:2]
        return self._cut(points, *least_of_all(self.turns, self.space.poses(points), self._of_poses))

    @property
    def lengths(self) -> Floats:
        """The unit of each coordinate, (d,) [length or rad]: L for a length, 1 for an angle."""
        return np.where(self.space.is_angle, 1.0, self.mechanism.characteristic_length)

    def _cut(self, points: Floats, margins: Floats, bindings: Ints) -> tuple[Floats, Ints]:
        """Margins and bindings with the ends of the map as limits too."""
        n_limits = len(self._known_limits)
        lengths = self.lengths
        for axis, column in enumerate(points.T):
            for side, end in enumerate((self.lowest[axis], self.highest[axis])):
                if np.isfinite(end):
                    excess = (column - end) / lengths[axis] * (1 - 2 * side)
                    cut = excess < np.minimum(margins, 0.0)
                    margins[cut], bindings[cut] = excess[cut], n_limits + 2 * axis + side
        return margins, bindings

    def _of_poses(self, poses: Floats) -> tuple[Floats, Ints]:
        if self.has_margins:
            feasible = feasibility(self.mechanism, poses, start=self.start)
            return np.nan_to_num(
                feasible.margin, copy=False, nan=-np.inf, posinf=np.inf, neginf=-np.inf
            ), feasible.binding
        if self.hold == "orientation" and not why_not_measured(self.mechanism):
            reached = feasibility(self.mechanism, poses, start=self.start).margin >= 0.0
            return np.where(reached, INSIDE, OUTSIDE), np.full(len(poses), self._unknown)
        return np.where(self._answers(poses)[1], INSIDE, OUTSIDE), np.full(len(poses), self._unknown)

    def _answers(self, poses: Floats) -> tuple[Solution, Mask]:
        """Answers to poses, and the mask of those that count as reached."""
        kept = self.hold == "orientation" or self.start is not None
        options = Options(hold=self.hold, working_mode="keep" if kept else "any", on_invalid="mark")
        answers = solve_ik(self.mechanism, poses, start=self.start, options=options)
        status = np.asarray(answers.status)
        if self.hold == "orientation":
            return answers, np.asarray(status == Status.REACHED)
        near = answers.position_error <= TOLERANCES.position * self.mechanism.characteristic_length
        return answers, np.asarray(near & (status <= Status.PROJECTED))

    def goes_on(self, points: Floats, known: Starts, *, exactly: bool) -> Mask:
        """Mask (n,) of points (n, d) that are reached; exactly: to rounding, not to the tolerance of poses alone.

        Parameters
        ----------
        known : configurations near them, (n,), if the map is grown.
        """
        if not (exactly or self.is_grown):
            return np.asarray(self.measure(points)[0] >= 0.0)
        if self.is_grown:
            answers = Solution(self.mechanism, self._grown(points, known, False), (len(points),))
            reached = np.asarray(np.asarray(answers.status) == Status.REACHED)
        else:
            answers, reached = self._answers(self.space.poses(points))
        if not exactly:
            return reached
        length = self.mechanism.characteristic_length
        off = np.maximum(answers.position_error, answers.residual) / length
        if self.hold == "orientation":
            off = np.maximum(off, answers.rotation_error)
        return np.asarray(reached & (off <= TOLERANCES.exact))

    @property
    def _unknown(self) -> int:
        return len(self._known_limits) - 1

    def name_limits(self, points: Floats, known: Starts) -> Ints:
        """Which of `limits` points (n, d) just beyond the border are beyond, (n,).

        Parameters
        ----------
        known : configurations near them, (n,), if the map is grown.
        """
        if self.is_grown:
            found = self._grown(points, known, False)
            bindings = self._cut(points, *self._of_grown(found))[1]
        else:
            bindings = self.measure(points)[1]
        if self.has_margins or len(self.turns) > 1:
            return bindings
        rows = np.flatnonzero(bindings == self._unknown)
        if self.is_grown and not self.has_many_at_a_point:
            bindings[rows] = self._met(found.at(rows))
            return bindings
        ended = found.at(rows) if self.is_grown else self._answers(self.space.poses(points[rows]))[0]._configurations
        bindings[rows] = self._active(ended.coordinates)
        return bindings

    def _met(self, ended: Configurations) -> Ints:
        """The limit that legs meet at each configuration, by its place in `limits`; that of reach if none."""
        place = {limit: index for index, limit in enumerate(self._known_limits)}
        own = np.array([place.get(limit, self._unknown) for limit in (*limits_of(self.mechanism), GEOMETRY)])
        margin, binding = margins_at(self.mechanism, ended)
        return np.asarray(own[np.where(np.abs(margin) <= TOLERANCES.active, binding, -1)])

    def _active(self, coordinates: Floats) -> Ints:
        """The first limit that each row of joint coordinates is on, by its place in `limits`; that of reach if none."""
        place = {limit: index for index, limit in enumerate(self._known_limits)}
        held, model = active_limits(self.mechanism, coordinates), model_of(self.mechanism)
        held = [limits or stretched_joint(model, q[None]) for limits, q in zip(held, coordinates, strict=True)]
        return np.array(
            [place[limits[0].joint, limits[0].bound] if limits else self._unknown for limits in held], np.int64
        )


def tilts_up_to(angle: float) -> Floats:
    """Rotations (n, 3, 3) about axes in the base's x, y plane: to every side, the greatest first, and none."""
    rings = math.ceil(angle / RING)
    azimuths = 2.0 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
    sizes = angle * np.arange(rings, 0, -1) / max(rings, 1)
    turns = np.zeros((1 + AZIMUTHS * rings, 3))
    turns[:-1, 0] = (sizes[:, None] * np.cos(azimuths)).ravel()
    turns[:-1, 1] = (sizes[:, None] * np.sin(azimuths)).ravel()
    return from_rotvec(turns)


def least_of_all(turns: Floats, poses: Floats, verdict: Verdict) -> tuple[Floats, Ints]:
    """The least margin over all turns, and its binding, of poses (n, 4, 4); the first negative margin is final."""
    if len(turns) == 1:
        return verdict(turned(turns[0], poses))
    margins, bindings = np.full(len(poses), np.inf), np.full(len(poses), -1)
    for turn in turns:
        rows = np.flatnonzero(margins >= 0.0)
        margin, binding = verdict(turned(turn, poses[rows]))
        worse = margin < margins[rows]
        margins[rows[worse]], bindings[rows[worse]] = margin[worse], binding[worse]
    return margins, bindings


def turned(turn: Floats, poses: Floats) -> Floats:
    """Poses (n, 4, 4) turned in the base frame by a rotation (3, 3), each about its reference point."""
    if not np.array_equal(turn, np.eye(3)):
        poses[:, :3, :3] = turn @ poses[:, :3, :3]
    return poses
