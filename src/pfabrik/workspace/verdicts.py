"""Margins of the points of a map, and the limits that form the border."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from ..answers.active_limits import active_limits
from ..answers.solution import Solution
from ..answers.status import Status
from ..arrays import Floats, Ints, Mask
from ..batch import take
from ..chains.chain_engine import ChainEngine
from ..closure.closure_engine import ClosureEngine
from ..closure.link_distances import pair_names
from ..configuration import configuration
from ..description.mechanism import Mechanism
from ..engine import engine_of
from ..feasibility import feasibility
from ..ik import solve_ik
from ..kernels.platform.search_records import Starts
from ..model import model_of
from ..motion.displacements import home_coordinates
from ..options import Options
from ..platform.tip_engine import measured
from ..tolerances import TOLERANCES
from .exploring import Explorer, Tell
from .orientations import least_of_all
from .reachable_positions import coordinates_nearest, follows_positions, reach_positions, start_at
from .space import Space

Limits: TypeAlias = tuple[tuple[str, str], ...]
"""(joint, bound) of limits: as of `Feasibility`; or a coordinate and "min", "max", its end in the map."""

INSIDE, OUTSIDE = 1.0, -1.0
"""Values in place of margins where no closed form gives them: only the sign counts."""

GEOMETRY = ("", "reach")
"""The limit of a border that no limit of a joint forms, where no closed form gives the leg."""


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
        return self.hold == "orientation" and not measured(model_of(self.mechanism)).why_poses_do_not_suffice

    @property
    def limits(self) -> Limits:
        """The limits that borders are formed by, in the order of `measure`."""
        limits = _known_limits(self.mechanism, self.has_margins)
        return limits + tuple((name, bound) for name in self.space.names for bound in ("min", "max"))

    def explorer(self) -> Explorer | None:
        """An explorer that begins at the start, where points are solved one by one by the closure engine; else None."""
        engine = engine_of(self.mechanism.with_clearance(None))
        if self.has_margins or self.hold == "position" or len(self.turns) > 1:
            return None
        if not isinstance(engine, ClosureEngine | ChainEngine):
            return None
        home = home_coordinates(self.mechanism)
        start = (
            configuration(self.mechanism, home)._configurations if self.start is None else self.start._configurations
        )
        at = self.space.start
        return Explorer(self.mechanism, engine, start, self.space.poses(at[None])[0], at / self._lengths)

    def explored(self, points: Floats, explorer: Explorer, tell: Tell) -> tuple[Floats, Ints]:
        """Margins and bindings as of `measure`, by an explorer, from configurations that were reached before."""
        reached, _ = explorer.explore(self.space.poses(points), points / self._lengths, tell)
        margins, bindings = np.where(reached, INSIDE, OUTSIDE), np.full(len(points), self._unknown)
        return self._cut(points, margins, bindings)

    @property
    def follows_positions(self) -> bool:
        """True if positions count in whatever orientation, and configurations lead from one to the next."""
        return self.hold == "position" and follows_positions(model_of(self.mechanism))

    @property
    def first_start(self) -> Starts:
        """The configuration that positions are first searched for from."""
        return start_at(model_of(self.mechanism), self.start)

    def approach(self, points: Floats, starts: Starts, seeds: bool) -> tuple[Floats, Ints, Starts]:
        """Margins and bindings as of `measure`, and configurations at the positions of points, or nearest to them.

        Negative margins are distances from these configurations [L].

        Parameters
        ----------
        starts, seeds : as of `reach_positions`.
        """
        model, targets = model_of(self.mechanism), self.space.poses(points)
        distances, ends = reach_positions(model, targets, starts, seeds=seeds, keep_mode=self.start is not None)
        margins, bindings = np.where(distances > 0.0, -distances, INSIDE), np.full(len(points), self._unknown)
        return (*self._cut(points, margins, bindings), ends)

    def measure(self, points: Floats) -> tuple[Floats, Ints]:
        """Margins (n,) of points (n, d), negative beyond reach, and which of `limits` each is of; -1 for none."""
        if self.follows_positions:
            return self.approach(points, self.first_start, True)[:2]
        return self._cut(points, *least_of_all(self.turns, self.space.poses(points), self._of_poses))

    @property
    def _lengths(self) -> Floats:
        """The unit of each coordinate, (d,) [length or rad]: L for a length, 1 for an angle."""
        return np.where(self.space.is_angle, 1.0, self.mechanism.characteristic_length)

    def _cut(self, points: Floats, margins: Floats, bindings: Ints) -> tuple[Floats, Ints]:
        """Margins and bindings with the ends of the map as limits too."""
        n_limits = len(_known_limits(self.mechanism, self.has_margins))
        lengths = self._lengths
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

    @property
    def _unknown(self) -> int:
        return len(_known_limits(self.mechanism, self.has_margins)) - 1

    def name_limits(self, points: Floats, explorer: Explorer | None = None) -> Ints:
        """Which of `limits` points (n, d) just beyond the border are beyond, (n,)."""
        margins, bindings = self.measure(points) if explorer is None else self.explored(points, explorer, _no_progress)
        if self.has_margins or len(self.turns) > 1:
            return bindings
        rows = np.flatnonzero((margins < 0.0) & (bindings == self._unknown))
        poses = self.space.poses(points[rows])
        if explorer is None:
            coordinates = self._answers(poses)[0]._coordinates
        else:
            coordinates = explorer.explore(poses, points[rows] / self._lengths, _no_progress)[1]
        bindings[rows] = self._active(coordinates)
        return bindings

    def name_limits_near(self, points: Floats, starts: Starts) -> Ints:
        """As `name_limits`, of positions (n, d) just beyond the border, from configurations (n,) nearest to them."""
        model, targets = model_of(self.mechanism), self.space.poses(points)
        offsets = targets[:, :3, 3] / model.length - starts.poses[:, :3, 3]
        bindings = self._cut(points, -np.linalg.norm(offsets, axis=1), np.full(len(points), self._unknown))[1]
        rows = np.flatnonzero(bindings == self._unknown)
        starts = take(starts, rows)
        coordinates = coordinates_nearest(model, targets[rows], starts, keep_mode=self.start is not None)
        bindings[rows] = self._active(coordinates)
        return bindings

    def _active(self, coordinates: Floats) -> Ints:
        """The first limit that each row of joint coordinates is on, by its place in `limits`; that of reach if none."""
        place = {limit: index for index, limit in enumerate(_known_limits(self.mechanism, self.has_margins))}
        held = active_limits(self.mechanism, coordinates)
        return np.array(
            [place[limits[0].joint, limits[0].bound] if limits else self._unknown for limits in held], np.int64
        )


def _no_progress(done: int) -> None:
    """Report no progress: these points were counted before."""


def _known_limits(mechanism: Mechanism, has_margins: bool) -> Limits:
    if has_margins:
        return feasibility(mechanism, mechanism.home_pose).limits
    ranges = [(joint.name, bound) for joint in mechanism.joints if joint.range is not None for bound in ("min", "max")]
    cones = [(joint.name, "cone") for joint in mechanism.joints if joint.cone is not None]
    pairs = () if mechanism.clearance is None else pair_names(mechanism)
    return (*ranges, *cones, *((name, "clearance") for name in pairs), GEOMETRY)
