"""The search for working modes: platform poses on a target, and at each pose the branches of every leg."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...common.arrays import Floats, Mask
from ...engines.joints.close import HELD, Closing, close, platform_poses
from ...engines.joints.multistart import random_starts
from ...errors import ContinuumOfWorkingModes
from ...kinematics import columns
from ...machine.description.joints import TASK_TURNS
from ...machine.motion.loops import Closure
from ...tolerances import TOLERANCES
from .fingerprints import Fingerprints, close_on_target, count_from_home, shifts
from .lists import LEAST_STARTS, STEPS, Clusters

Ints = NDArray[np.intp]

LEAST_STARTS_OF_LEGS = 1024
"""Least number of starts if the target sets the whole pose: every start is one of every leg, and legs have few
branches. A branch that one start in 100 finds is missed once in 30 000 searches."""

FREEDOM = 2e-2
"""Least singular value of actuator moves that counts as a freedom: true motions are far larger, and the curvature of
the moves is of the order of `ALONG`."""


class Listed(NamedTuple):
    """Modes, nearest to home first.

    Attributes
    ----------
    coordinates, poses : joint coordinates (n, columns) [length or rad]; platform poses (n, 4, 4) [length].
    hits : number of starts that found the rarest leg branch of each mode.
    """

    coordinates: Floats
    poses: Floats
    hits: tuple[int, ...]


class BranchSearch:
    """A search for working modes.

    With the platform fixed, legs are independent: a start that closes only some legs counts for these, and modes are
    all combinations of the legs' branches.

    Attributes
    ----------
    poses : clusters of platform poses; a single one if the task sets the whole pose.
    legs : for every pose, the clusters of the branches of every leg.
    """

    def __init__(self, closure: Closure, target: Floats) -> None:
        self.closure = closure
        self.target = target
        self.task = closure.task
        self.rng = np.random.default_rng(0)
        self.starts = 0
        self.poses = Clusters()
        self.legs: list[list[Clusters]] = []
        self._marks: Fingerprints | None = None
        self._completing = np.zeros(len(closure.scale))
        self._lacking = np.ones(len(closure.loops.groups) - 1, bool)
        self._pending: list[tuple[Floats, Floats, Mask]] = []

    @property
    def is_done(self) -> bool:
        """True after enough starts, if every branch was found often enough."""
        all_clusters = [self.poses, *(leg for legs in self.legs for leg in legs)]
        least = LEAST_STARTS_OF_LEGS if self.task.is_whole_pose else LEAST_STARTS
        return self.starts >= least and all(clusters.are_well_known for clusters in all_clusters)

    def add_starts(self, n: int) -> None:
        """Search from n more random starts, the first of all from home."""
        coordinates, poses = random_starts(self.closure, n, self.rng)
        if self.starts == 0:
            coordinates[0], poses[0] = 0.0, self.closure.mechanism.home_pose
        self.starts += n
        completed = self.task.completed(np.repeat(self.target[None], n, axis=0), poses)
        closing = close_on_target(self.closure, coordinates, completed, max_iterations=STEPS)
        is_closed = (closing.gaps <= TOLERANCES.position) & ~_has_negative_lengths(self.closure, closing.coordinates)
        if self.task.rotations == TASK_TURNS["yaw"]:
            is_closed &= ~_is_upside_down(closing.poses)[:, None]
        if not self.task.is_whole_pose:
            is_closed &= is_closed.all(axis=1, keepdims=True)
        self._complete(closing.coordinates, is_closed)
        self._pending.append((closing.coordinates, closing.poses, is_closed))
        if not self._lacking.any():
            self._assign_pending()

    def _complete(self, coordinates: Floats, closed: Mask) -> None:
        """Collect a closed solution of every leg in one configuration, to complete starts that close only some legs."""
        for group in np.flatnonzero(self._lacking & closed.any(axis=0)):
            in_group = self.closure.loops.group_of == group
            self._completing[in_group] = coordinates[closed[:, group].argmax(), in_group]
            self._lacking[group] = False

    def _assign_pending(self) -> None:
        """Assign the pending configurations to clusters."""
        for coordinates, poses, closed in self._pending:
            rows = np.flatnonzero(closed.any(axis=1))
            if len(rows):
                is_closed = closed[rows][:, self.closure.loops.group_of]
                self._assign(np.where(is_closed, coordinates[rows], self._completing), poses[rows], closed[rows])
        self._pending.clear()

    def _assign(self, coordinates: Floats, poses: Floats, closed: Mask) -> None:
        """Assign configurations to clusters of platform poses, and the closed legs of each to clusters of branches."""
        count_from_home(self.closure, coordinates)
        if self._marks is None:
            self._refuse_continuum(coordinates[0], poses[0])
            self._marks = Fingerprints(self.closure, coordinates[0], poses[0])
        marks = self._marks

        def polish_pose(row: int) -> tuple[Floats, Floats]:
            _, pose = self._polish(coordinates[row], poses[row])
            return marks.of_poses(pose[None])[0], pose

        places = self.poses.count(marks.of_poses(poses), polish_pose)
        while len(self.legs) < len(self.poses.hits):
            self.legs.append([Clusters() for _ in range(marks.n_legs)])
        for place in np.unique(places):
            for leg, branches in enumerate(self.legs[place]):
                rows = np.flatnonzero((places == place) & closed[:, marks.leg_of_group == leg].all(axis=1))
                self._assign_leg(leg, branches, coordinates[rows], poses[rows])

    def _assign_leg(self, leg: int, branches: Clusters, coordinates: Floats, poses: Floats) -> None:
        """Assign configurations of one leg to clusters of its branches; keep the best of every branch."""
        marks = self._marks
        assert marks is not None
        of_leg = marks.leg_of_mark == leg

        def polish(row: int) -> tuple[Floats, Floats]:
            polished, _ = self._polish(coordinates[row], poses[row])
            return marks.of_legs(polished[None])[0, of_leg], polished

        places = branches.count(marks.of_legs(coordinates)[:, of_leg], polish)
        for row, rank in enumerate(self._ranks(coordinates, poses)[:, leg].tolist()):
            branches.prefer(int(places[row]), coordinates[row], tuple(rank))

    def _polish(self, coordinates: Floats, pose: Floats) -> tuple[Floats, Floats]:
        """Iterate a configuration (columns,) and its pose (4, 4) to convergence; raise if it is part of a continuum."""
        polished = close_on_target(self.closure, coordinates[None], pose[None], closeness=0.0)
        count_from_home(self.closure, polished.coordinates)
        self._refuse_continuum(polished.coordinates[0], polished.poses[0])
        return polished.coordinates[0], polished.poses[0]

    def _refuse_continuum(self, coordinates: Floats, pose: Floats) -> None:
        """Raise if actuators can move with the end effector on the target."""
        mechanism, scale = self.closure.mechanism, self.closure.scale[self.closure.actuated]
        moves = shifts(
            self.closure,
            coordinates,
            pose,
            lambda closing: (self.closure.actuators(closing.coordinates) * scale)[:, :, None],
        )[:, :, 0]
        if moves.any():
            freedoms = int((np.linalg.svd(moves, compute_uv=False) > FREEDOM).sum())
            names = [mechanism.actuator_names[place] for place in np.flatnonzero(np.abs(moves).max(axis=0))]
            raise ContinuumOfWorkingModes(mechanism.name, max(freedoms, 1), names)

    def _ranks(self, coordinates: Floats, poses: Floats) -> Floats:
        """Ranks (n, legs, 2), less is better: a leg's excess over its limits, distance of its coordinates from home."""
        marks = self._marks
        assert marks is not None
        measured = close(self.closure, coordinates, poses, max_iterations=0)
        excess, size = np.zeros((2, len(coordinates), marks.n_legs))
        for leg in range(marks.n_legs):
            excess[:, leg] = measured.excesses[:, marks.leg_of_group == leg].max(axis=1)
            size[:, leg] = np.abs(coordinates * self.closure.scale)[:, marks.leg_of_column == leg].sum(axis=1)
        return np.stack([np.where(excess <= TOLERANCES.limit, 0.0, excess), size], axis=2)

    def listed(self, most: int) -> Listed:
        """The modes nearest to home, at most `most` of them."""
        marks = self._marks
        if marks is None:
            return Listed(np.zeros((0, len(self._completing))), np.zeros((0, 4, 4)), ())
        chosen: list[tuple[float, int, Ints]] = []
        for place, legs in enumerate(self.legs):
            squares = [marks.legs_from_home(leg, np.array(clusters.marks)) for leg, clusters in enumerate(legs)]
            pose_square = marks.pose_from_home(self.poses.marks[place])
            sums, combinations = _least_sums(squares, most)
            chosen += [
                (pose_square + total, place, branches)
                for total, branches in zip(sums.tolist(), combinations, strict=True)
            ]
        chosen = sorted(chosen, key=lambda mode: mode[0])[:most]
        bests = [self._best_branches(place) for place in range(len(self.legs))]
        columns_of_all = np.arange(len(self._completing))
        coordinates = np.array(
            [bests[place][branches[marks.leg_of_column], columns_of_all] for _, place, branches in chosen]
        ).reshape(-1, len(columns_of_all))
        closing = close_on_target(self.closure, coordinates, self._poses_of(coordinates))
        count_from_home(self.closure, closing.coordinates)
        closed = np.flatnonzero(closing.gap <= TOLERANCES.position)
        hits = [self._hits(place, branches) for _, place, branches in chosen]
        return Listed(closing.coordinates[closed], closing.poses[closed], tuple(hits[row] for row in closed))

    def _hits(self, place: int, branches: Ints) -> int:
        """Number of starts that led to the rarest of some branches, one per leg."""
        return min(leg.hits[int(branch)] for leg, branch in zip(self.legs[place], branches, strict=True))

    def _best_branches(self, place: int) -> Floats:
        """Joint coordinates of all leg branches at a pose, (most branches of a leg, columns).

        Undetermined coordinates, such as a rod's spin, are nearest to home within the limits.
        """
        assert self._marks is not None
        marks, legs = self._marks, self.legs[place]
        best = np.zeros((max(len(leg.hits) for leg in legs), len(self._completing)))
        for leg, branches in enumerate(legs):
            of_leg = marks.leg_of_column == leg
            for row in range(len(best)):
                best[row, of_leg] = branches.coordinates[min(row, len(branches.hits) - 1)][of_leg]
        held = HELD if marks.pose_rests else self.task.held
        locked = self.closure.driven
        from_home = np.zeros_like(best)
        from_home[:, self.closure.actuated] = best[:, self.closure.actuated]
        for start, options in (
            (from_home, {"centres": marks.target_centres(best)}),
            (best, {"limits": True, "margin": TOLERANCES.inside}),
        ):
            poses = self._poses_of(best)
            trial = close(self.closure, start, poses, locked=locked, platform=held, frame=self.task.frame, **options)
            self._replace_worse(best, trial)
        return best

    def _poses_of(self, coordinates: Floats) -> Floats:
        """Poses (n, 4, 4) of the platform in configurations, exactly on the target in the components of the task."""
        poses = platform_poses(self.closure.mechanism, coordinates)
        return self.task.completed(np.repeat(self.target[None], len(poses), axis=0), poses)

    def _replace_worse(self, best: Floats, trial: Closing) -> None:
        """Replace legs by those of a trial on the same branch that are closed and have a better rank."""
        assert self._marks is not None
        marks, coordinates = self._marks, trial.coordinates
        count_from_home(self.closure, coordinates)
        is_same = np.abs(marks.of_legs(coordinates) - marks.of_legs(best)) <= TOLERANCES.same_mode
        is_closed = trial.gaps <= TOLERANCES.position
        ranks, best_ranks = self._ranks(coordinates, trial.poses), self._ranks(best, self._poses_of(best))
        is_less = (ranks[..., 0] < best_ranks[..., 0]) | (
            (ranks[..., 0] == best_ranks[..., 0]) & (ranks[..., 1] < best_ranks[..., 1])
        )
        for leg in range(marks.n_legs):
            is_valid = is_same[:, marks.leg_of_mark == leg].all(axis=1)
            is_valid &= is_closed[:, marks.leg_of_group == leg].all(axis=1)
            better = np.ix_(is_valid & is_less[:, leg], marks.leg_of_column == leg)
            best[better] = coordinates[better]


def _has_negative_lengths(closure: Closure, coordinates: Floats) -> Mask:
    """Mask of groups (n, groups) with a negative joint coordinate that is a distance."""
    is_negative = np.zeros((len(coordinates), len(closure.loops.groups) - 1), bool)
    for joint in closure.mechanism.joints:
        if joint.along is not None:
            column = columns(closure.mechanism)[joint.name].start
            length = coordinates[:, column] + np.ravel(closure.mechanism.home_coordinate(joint.name))
            is_negative[:, closure.loops.group_of[column]] |= length < 0.0
    return is_negative


def _is_upside_down(poses: Floats) -> Mask:
    """Mask of poses (n, 4, 4) that are upside down: they have no yaw, and meet no target that sets one."""
    return (poses[:, 2, 2] < 0.0) & (np.hypot(poses[:, 0, 2], poses[:, 1, 2]) <= TOLERANCES.same_mode)


def _least_sums(terms: list[Floats], most: int) -> tuple[Floats, Ints]:
    """The least sums of one term per array, (m,), in ascending order, and the indices of the terms, (m, arrays)."""
    sums, chosen = np.zeros(1), np.zeros((1, 0), np.intp)
    for array in terms:
        all_sums = (sums[:, None] + array).ravel()
        least = np.argsort(all_sums, kind="stable")[:most]
        chosen = np.column_stack([chosen[least // len(array)], least % len(array)])
        sums = all_sums[least]
    return sums, chosen
