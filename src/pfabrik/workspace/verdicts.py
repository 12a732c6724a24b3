"""Which coordinates of a map are within reach, how far inside or beyond, and what forms the border there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from ..answers.active_limits import active_limits
from ..answers.solution import Solution
from ..answers.status import Status
from ..arrays import Floats, Ints, Mask
from ..closure.closure_engine import ClosureEngine
from ..configuration import configuration
from ..description.mechanism import Mechanism
from ..engine import engine_of
from ..feasibility import feasibility
from ..ik import solve_ik
from ..model import model_of
from ..motion.displacements import home_coordinates
from ..options import Options
from ..tolerances import TOLERANCES
from .exploring import Explorer, Tell
from .orientations import least_of_all
from .space import Space

Limits: TypeAlias = tuple[tuple[str, str], ...]
"""(joint, bound) of limits: as of `Feasibility`; or a coordinate and "min", "max", its end in what was looked at."""

INSIDE, OUTSIDE = 1.0, -1.0
"""What stands for a margin where no closed form tells one: its sign is all that counts."""

GEOMETRY = ("", "reach")
"""What forms the border where no limit of a joint does, and no closed form tells which leg."""


@dataclass(frozen=True, eq=False)
class MapQuestion:
    """What is asked of every point of a map.

    Attributes
    ----------
    start : a configuration whose working mode is kept; None for home's.
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
        """Whether closed forms tell margins; else points are asked for one by one, and only told whether reached."""
        return self.hold == "orientation" and not model_of(self.mechanism).why_poses_do_not_suffice

    @property
    def limits(self) -> Limits:
        """The limits that borders are formed by, in the order of `measure`."""
        own = _known_limits(self.mechanism, self.has_margins)
        return own + tuple((name, bound) for name in self.space.names for bound in ("min", "max"))

    def explorer(self) -> Explorer | None:
        """What explores from the start, where points are asked for one by one, and it can."""
        engine = engine_of(self.mechanism)
        if self.has_margins or self.hold == "position" or len(self.turns) > 1 or not isinstance(engine, ClosureEngine):
            return None
        home = home_coordinates(self.mechanism)
        start = (
            configuration(self.mechanism, home)._configurations if self.start is None else self.start._configurations
        )
        at = self.space.start
        return Explorer(engine, start, self.space.poses(at[None])[0], at / self._lengths)

    def explored(self, points: Floats, explorer: Explorer, tell: Tell) -> tuple[Floats, Ints]:
        """As `measure`, from what was within reach before."""
        reached, _ = explorer.explore(self.space.poses(points), points / self._lengths, tell)
        margins, bindings = np.where(reached, INSIDE, OUTSIDE), np.full(len(points), self._unknown)
        return self._cut(points, margins, bindings)

    def measure(self, points: Floats) -> tuple[Floats, Ints]:
        """Margins (n,) of points (n, d), negative beyond reach, and which of `limits` each is of; -1 for none."""
        return self._cut(points, *least_of_all(self.turns, self.space.poses(points), self._of_poses))

    @property
    def _lengths(self) -> Floats:
        """What one is of each coordinate, (d,) [length or rad]: L of a length."""
        return np.where(self.space.is_angle, 1.0, self.mechanism.characteristic_length)

    def _cut(self, points: Floats, margins: Floats, bindings: Ints) -> tuple[Floats, Ints]:
        """Margins and bindings with the ends of what is looked at."""
        first = len(_known_limits(self.mechanism, self.has_margins))
        lengths = self._lengths
        for axis, column in enumerate(points.T):
            for side, end in enumerate((self.lowest[axis], self.highest[axis])):
                if np.isfinite(end):
                    past = (column - end) / lengths[axis] * (1 - 2 * side)
                    cut = past < np.minimum(margins, 0.0)
                    margins[cut], bindings[cut] = past[cut], first + 2 * axis + side
        return margins, bindings

    def _of_poses(self, poses: Floats) -> tuple[Floats, Ints]:
        if self.has_margins:
            found = feasibility(self.mechanism, poses, start=self.start)
            return np.nan_to_num(found.margin, copy=False, nan=-np.inf, posinf=np.inf, neginf=-np.inf), found.binding
        return np.where(self._answers(poses)[1], INSIDE, OUTSIDE), np.full(len(poses), self._unknown)

    def _answers(self, poses: Floats) -> tuple[Solution, Mask]:
        """Answers to poses, and which of them count as reached."""
        kept = self.hold == "orientation" or self.start is not None
        options = Options(hold=self.hold, working_mode="keep" if kept else "any", on_invalid="mark")
        answers = solve_ik(self.mechanism, poses, start=self.start, options=options)
        status = np.asarray(answers.status)
        if self.hold == "orientation":
            return answers, np.asarray(status == Status.REACHED)
        near = answers.position_error <= TOLERANCES.position * self.mechanism.characteristic_length
        return answers, np.asarray(near & (status <= Status.PROJECTED))

    @property
    def _unknown(self) -> int:
        return len(_known_limits(self.mechanism, self.has_margins)) - 1

    def name_limits(self, points: Floats, explorer: Explorer | None = None) -> Ints:
        """Which of `limits` points (n, d) just beyond the border are beyond, (n,)."""
        margins, bindings = self.measure(points) if explorer is None else self.explored(points, explorer, _untold)
        if self.has_margins or len(self.turns) > 1:
            return bindings
        rows = np.flatnonzero((margins < 0.0) & (bindings == self._unknown))
        poses = self.space.poses(points[rows])
        if explorer is None:
            coordinates = self._answers(poses)[0]._coordinates
        else:
            coordinates = explorer.explore(poses, points[rows] / self._lengths, _untold)[1]
        place = {limit: index for index, limit in enumerate(_known_limits(self.mechanism, self.has_margins))}
        for row, held in zip(rows.tolist(), active_limits(self.mechanism, coordinates), strict=True):
            if held:
                bindings[row] = place[held[0].joint, held[0].bound]
        return bindings


def _untold(done: int) -> None:
    """What is looked at again counts for nothing."""


def _known_limits(mechanism: Mechanism, has_margins: bool) -> Limits:
    if has_margins:
        return feasibility(mechanism, mechanism.home_pose).limits
    ranges = [(joint.name, bound) for joint in mechanism.joints if joint.range is not None for bound in ("min", "max")]
    cones = [(joint.name, "cone") for joint in mechanism.joints if joint.cone is not None]
    return (*ranges, *cones, GEOMETRY)
