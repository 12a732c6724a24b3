"""The search for working modes: poses of the platform on a target, and below each the branches of every leg."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Mask
from ..closure.close import HELD, Closing, Closure, close, platform_poses
from ..closure.starts import random_starts
from ..description.joint_types import TASK_TURNS
from ..description.task import task_of
from ..errors import ContinuumOfWorkingModes
from ..motion.displacements import columns
from ..tolerances import TOLERANCES
from .fingerprints import Fingerprints, close_on_target, count_from_home, shifts
from .lists import LEAST_STARTS, STEPS, Clusters

Ints = NDArray[np.intp]

LEAST_STARTS_OF_LEGS = 1024
"""Starts before a search may end where the target sets all of the platform: each is one of every leg, and a leg has a
handful of branches. One that a start in 100 leads to is missed by all of them once in 30 000 searches."""

FREEDOM = 2e-2
"""Singular value from which moves of the actuators count as one more freedom: those of shakes are larger by far, and
moves are straight to `ALONG`."""


class Listed(NamedTuple):
    """Modes, nearest to home first.

    Attributes
    ----------
    coordinates, poses : (n, columns) [length or rad], and of the platform, (n, 4, 4) [length].
    hits : how many starts led to the rarest branch of a leg in each.
    """

    coordinates: Floats
    poses: Floats
    hits: tuple[int, ...]


class BranchSearch:
    """What was found so far.

    Below a platform at rest legs are independent: a start that closes some of them counts for these, and modes are all
    combinations of the legs' branches.

    Attributes
    ----------
    poses : where the platform is; one place where the task sets all of it.
    legs : the branches of every leg, pose by pose.
    """

    def __init__(self, closure: Closure, target: Floats) -> None:
        self.closure = closure
        self.target = target
        self.task = task_of(closure.mechanism)
        self.rng = np.random.default_rng(0)
        self.starts = 0
        self.poses = Clusters()
        self.legs: list[list[Clusters]] = []
        self._marks: Fingerprints | None = None
        self._whole = np.zeros(len(closure.scale))
        self._lacking = np.ones(len(closure.loops.groups) - 1, bool)
        self._waiting: list[tuple[Floats, Floats, Mask]] = []

    @property
    def is_done(self) -> bool:
        every = [self.poses, *(leg for legs in self.legs for leg in legs)]
        least = LEAST_STARTS_OF_LEGS if self.task.is_whole_pose else LEAST_STARTS
        return self.starts >= least and all(each.are_well_known for each in every)

    def add_starts(self, n: int) -> None:
        """Try n more starts."""
        coordinates, begin = random_starts(self.closure, n, self.rng)
        if self.starts == 0:
            coordinates[0], begin[0] = 0.0, self.closure.mechanism.home_pose
        self.starts += n
        wanted = self.task.completed(np.repeat(self.target[None], n, axis=0), begin)
        found = close_on_target(self.closure, coordinates, wanted, max_iterations=STEPS)
        closed = (found.gaps <= TOLERANCES.position) & ~_inside_out(self.closure, found.coordinates)
        if self.task.rotations == TASK_TURNS["yaw"]:
            closed &= ~_upside_down(found.poses)[:, None]
        if not self.task.is_whole_pose:
            closed &= closed.all(axis=1, keepdims=True)
        self._complete(found.coordinates, closed)
        self._waiting.append((found.coordinates, found.poses, closed))
        if not self._lacking.any():
            self._sort_waiting()

    def _complete(self, coordinates: Floats, closed: Mask) -> None:
        """Take over legs for a configuration in which all are closed, so that each can be looked at among the rest."""
        for group in np.flatnonzero(self._lacking & closed.any(axis=0)):
            own = self.closure.loops.group_of == group
            self._whole[own] = coordinates[closed[:, group].argmax(), own]
            self._lacking[group] = False

    def _sort_waiting(self) -> None:
        for coordinates, poses, closed in self._waiting:
            rows = np.flatnonzero(closed.any(axis=1))
            if len(rows):
                own = closed[rows][:, self.closure.loops.group_of]
                self._sort(np.where(own, coordinates[rows], self._whole), poses[rows], closed[rows])
        self._waiting.clear()

    def _sort(self, coordinates: Floats, poses: Floats, closed: Mask) -> None:
        """Count configurations as poses of the platform, and the closed legs of each as branches."""
        count_from_home(self.closure, coordinates)
        if self._marks is None:
            self._refuse_continuum(coordinates[0], poses[0])
            self._marks = Fingerprints(self.closure, coordinates[0], poses[0])
        marks = self._marks

        def settle_pose(row: int) -> tuple[Floats, Floats]:
            _, pose = self._settled(coordinates[row], poses[row])
            return marks.of_poses(pose[None])[0], pose

        places = self.poses.count(marks.of_poses(poses), settle_pose)
        while len(self.legs) < len(self.poses.hits):
            self.legs.append([Clusters() for _ in range(marks.n_legs)])
        for place in np.unique(places):
            for leg, branches in enumerate(self.legs[place]):
                rows = np.flatnonzero((places == place) & closed[:, marks.leg_of_group == leg].all(axis=1))
                self._sort_leg(leg, branches, coordinates[rows], poses[rows])

    def _sort_leg(self, leg: int, branches: Clusters, coordinates: Floats, poses: Floats) -> None:
        """Count configurations of one leg among its branches; of each branch, keep the best."""
        marks = self._marks
        assert marks is not None
        own = marks.leg_of_mark == leg

        def settle(row: int) -> tuple[Floats, Floats]:
            ended, _ = self._settled(coordinates[row], poses[row])
            return marks.of_legs(ended[None])[0, own], ended

        places = branches.count(marks.of_legs(coordinates)[:, own], settle)
        for row, rank in enumerate(self._ranks(coordinates, poses)[:, leg].tolist()):
            branches.prefer(int(places[row]), coordinates[row], tuple(rank))

    def _settled(self, coordinates: Floats, pose: Floats) -> tuple[Floats, Floats]:
        """Where a configuration (columns,) and its platform (4, 4) end, if that is no continuum."""
        ended = close_on_target(self.closure, coordinates[None], pose[None], closeness=0.0)
        count_from_home(self.closure, ended.coordinates)
        self._refuse_continuum(ended.coordinates[0], ended.poses[0])
        return ended.coordinates[0], ended.poses[0]

    def _refuse_continuum(self, coordinates: Floats, pose: Floats) -> None:
        """Raise where actuators move with the end effector on the target."""
        mechanism, scale = self.closure.mechanism, self.closure.scale[self.closure.actuated]
        moved = shifts(
            self.closure,
            coordinates,
            pose,
            lambda closing: (self.closure.actuators(closing.coordinates) * scale)[:, :, None],
        )[:, :, 0]
        if moved.any():
            freedoms = int((np.linalg.svd(moved, compute_uv=False) > FREEDOM).sum())
            names = [mechanism.actuator_names[each] for each in np.flatnonzero(np.abs(moved).max(axis=0))]
            raise ContinuumOfWorkingModes(mechanism.name, max(freedoms, 1), names)

    def _ranks(self, coordinates: Floats, poses: Floats) -> Floats:
        """Excess over limits, and distance of all coordinates from home, of the legs, (n, legs, 2); less is better."""
        marks = self._marks
        assert marks is not None
        measured = close(self.closure, coordinates, poses, max_iterations=0)
        excess, size = np.zeros((2, len(coordinates), marks.n_legs))
        for leg in range(marks.n_legs):
            excess[:, leg] = measured.excesses[:, marks.leg_of_group == leg].max(axis=1)
            size[:, leg] = np.abs(coordinates * self.closure.scale)[:, marks.leg_of_column == leg].sum(axis=1)
        return np.stack([np.where(excess <= TOLERANCES.limit, 0.0, excess), size], axis=2)

    def listed(self, most: int) -> Listed:
        """The modes nearest to home, at most so many."""
        marks = self._marks
        if marks is None:
            return Listed(np.zeros((0, len(self._whole))), np.zeros((0, 4, 4)), ())
        chosen: list[tuple[float, int, Ints]] = []
        for place, legs in enumerate(self.legs):
            squares = [marks.legs_from_home(leg, np.array(each.marks)) for leg, each in enumerate(legs)]
            off = marks.pose_from_home(self.poses.marks[place])
            sums, branches = _least_sums(squares, most)
            chosen += [(off + own, place, each) for own, each in zip(sums.tolist(), branches, strict=True)]
        chosen = sorted(chosen, key=lambda each: each[0])[:most]
        bests = [self._bests(place) for place in range(len(self.legs))]
        every = np.arange(len(self._whole))
        coordinates = np.array([bests[place][each[marks.leg_of_column], every] for _, place, each in chosen])
        coordinates = coordinates.reshape(-1, len(every))
        ended = close_on_target(self.closure, coordinates, self._poses_of(coordinates))
        count_from_home(self.closure, ended.coordinates)
        closed = np.flatnonzero(ended.gap <= TOLERANCES.position)
        hits = [self._hits(place, each) for _, place, each in chosen]
        return Listed(ended.coordinates[closed], ended.poses[closed], tuple(hits[row] for row in closed))

    def _hits(self, place: int, branches: Ints) -> int:
        """How many starts led to the rarest of some branches, one a leg."""
        return min(leg.hits[int(branch)] for leg, branch in zip(self.legs[place], branches, strict=True))

    def _bests(self, place: int) -> Floats:
        """The branches of all legs below a pose, (most branches of a leg, columns), each leg's in its columns.

        What a branch leaves open, as a rod's spin, is nearest to home; elsewhere where that keeps limits.
        """
        assert self._marks is not None
        marks, legs = self._marks, self.legs[place]
        best = np.zeros((max(len(leg.hits) for leg in legs), len(self._whole)))
        for leg, branches in enumerate(legs):
            own = marks.leg_of_column == leg
            for row in range(len(best)):
                best[row, own] = branches.coordinates[min(row, len(branches.hits) - 1)][own]
        held = HELD if marks.pose_rests else self.task.held
        locked = self.closure.driven
        from_home = np.zeros_like(best)
        from_home[:, self.closure.actuated] = best[:, self.closure.actuated]
        for start, wishes in (
            (from_home, {"centres": marks.wished_centres(best)}),
            (best, {"limits": True, "margin": TOLERANCES.inside}),
        ):
            poses = self._poses_of(best)
            tried = close(self.closure, start, poses, locked=locked, platform=held, frame=self.task.frame, **wishes)
            self._take_better(best, tried)
        return best

    def _poses_of(self, coordinates: Floats) -> Floats:
        """Poses (n, 4, 4) of the platform in configurations, exactly on the target in what the task counts."""
        poses = platform_poses(self.closure.mechanism, coordinates)
        return self.task.completed(np.repeat(self.target[None], len(poses), axis=0), poses)

    def _take_better(self, best: Floats, found: Closing) -> None:
        """Take over legs that are of the same branch, closed, and less beyond limits, or nearer to home."""
        assert self._marks is not None
        marks, tried = self._marks, found.coordinates
        count_from_home(self.closure, tried)
        same = np.abs(marks.of_legs(tried) - marks.of_legs(best)) <= TOLERANCES.same_mode
        closed = found.gaps <= TOLERANCES.position
        ranks, present = self._ranks(tried, found.poses), self._ranks(best, self._poses_of(best))
        less = (ranks[..., 0] < present[..., 0]) | (
            (ranks[..., 0] == present[..., 0]) & (ranks[..., 1] < present[..., 1])
        )
        for leg in range(marks.n_legs):
            fits = same[:, marks.leg_of_mark == leg].all(axis=1) & closed[:, marks.leg_of_group == leg].all(axis=1)
            better = np.ix_(fits & less[:, leg], marks.leg_of_column == leg)
            best[better] = tried[better]


def _inside_out(closure: Closure, coordinates: Floats) -> Mask:
    """Which groups (n, groups) have a joint whose coordinate, a distance, is negative."""
    found = np.zeros((len(coordinates), len(closure.loops.groups) - 1), bool)
    for joint in closure.mechanism.joints:
        if joint.along is not None:
            column = columns(closure.mechanism)[joint.name].start
            length = coordinates[:, column] + np.ravel(closure.mechanism.home_coordinate(joint.name))
            found[:, closure.loops.group_of[column]] |= length < 0.0
    return found


def _upside_down(poses: Floats) -> Mask:
    """Which poses (n, 4, 4) have no yaw: loops that close badly there are on no target, whatever their yaw comes to."""
    return (poses[:, 2, 2] < 0.0) & (np.hypot(poses[:, 0, 2], poses[:, 1, 2]) <= TOLERANCES.same_mode)


def _least_sums(terms: list[Floats], most: int) -> tuple[Floats, Ints]:
    """The least sums of one term from each array, (m,), growing, and which terms they are of, (m, arrays)."""
    sums, chosen = np.zeros(1), np.zeros((1, 0), np.intp)
    for own in terms:
        every = (sums[:, None] + own).ravel()
        kept = np.argsort(every, kind="stable")[:most]
        chosen = np.column_stack([chosen[kept // len(own)], kept % len(own)])
        sums = every[kept]
    return sums, chosen
