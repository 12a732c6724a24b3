"""The closed home of an open machine: its joints moved until all loops meet, within their ranges.

The solver of `closure` begins with loops that are closed at home. So between the two sides of a loop that is open, a
slide and a hinge of no other use bridge the gap; locked where this is gone, they leave the loop to the joints.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats, Mask
from ..closure.close import close, platform_poses
from ..description.joints import Joint, JointType
from ..description.mechanism import Mechanism
from ..description.structure import Structure
from ..kinematics import column_joints, columns, displacements, home_coordinates, rate_units, tree_of
from ..motion.displacements import screws, stepped
from ..motion.loops import Closure, closure_of
from ..rotations import shortest_turns, to_rotvec
from ..tolerances import TOLERANCES
from .opened import Loop, OpenMechanism

CLOSED = 1e-13
"""Gap that counts as none [L and rad]: rounding."""

POLISH = 10
"""Newton's steps at the end, where least squares stall: those of a closed loop end at rounding."""

BRIDGE = "bridge of loop"
"""What bodies and joints in the gap of a loop are called."""

STARTS, STRAY = 6, 0.3
"""Attempts from elsewhere, where the first ends open, and how far off they start [rad or L]: legs that are stretched
out, or lie on one another, have no direction to begin with."""

FARTHEST, MOST = 1.2, 3
"""Times the distance of the nearest one up to which closed configurations are let come nearer, and most of them."""

SAME, APART = 1e-4, 0.1
"""Difference of coordinates up to which two configurations are one [rad or L]; as a share of the distance of the
nearest from the drawing, once they have come as near as a few steps get them."""

NOTHING = 1e-15
"""Deviation from home that is rounding of none [rad or L]."""

SETTLING, SETTLED = 20, 1e-9
"""Most steps by which a configuration comes nearer, and the share of its distance by which a last one does."""


@dataclass(frozen=True)
class ClosedHome:
    """Coordinates at which the loops meet, or are least open.

    Attributes
    ----------
    q : coordinates of the tree's joints, deviations from home, (c,) [rad or length].
    gap : of all loops, the largest distance [L] or angle [rad].
    distance : from the drawing, as of `OpenLoops.distances` [L].
    other : that of the next nearest configuration that was found apart from it; infinite where there is none.
    """

    q: Floats
    gap: float
    distance: float = 0.0
    other: float = np.inf


class Linear(NamedTuple):
    """Values (m,) and their slopes (m, c)."""

    values: Floats
    slopes: Floats


class OpenLoops:
    """The loops of an open machine, and how far they are open at given coordinates.

    Attributes
    ----------
    tree : the joints alone.
    low, high : bounds of the tree's coordinates as deviations from home, (c,) [rad or length]; infinite without any.
    length : the radius around all joints and loops [length], the L of gaps here.
    """

    def __init__(self, opened: OpenMechanism) -> None:
        self.loops = opened.loops
        self.tree: Structure = opened.tree()
        limits = np.reshape([each.limits for each in self.tree.coordinates], (-1, 2)).T
        self.low, self.high = limits - home_coordinates(self.tree)
        points = [joint.at for joint in opened.joints if joint.at is not None]
        self.length = radius_around([*points, *(point for loop in opened.loops for point in loop.at)])

    @cached_property
    def middles(self) -> Mapping[str, Floats]:
        """Body -> the middle of its joints and loops, (3,) [length]; bodies between slides have none."""
        points: dict[str, list[Floats]] = defaultdict(list)
        for joint in self.tree.joints:
            for body in joint.connects if joint.at is not None else ():
                points[body].append(np.array(joint.at))
        for loop in self.loops:
            for body, point in zip(loop.connects, loop.at, strict=True):
                points[body].append(point)
        points.pop(self.tree.base, None)
        return {body: np.mean(own, axis=0) for body, own in points.items()}

    def distances(self, q: Floats) -> Floats:
        """How far the bodies are from where they are drawn, at coordinates (n, c): (n,) [L].

        sqrt(mean over bodies of (shift / L)^2 + (2 sin(turn / 2))^2), with the shift of the middle of a body's joints.
        """
        moved, squares = displacements(self.tree, q), np.zeros(len(q))
        for body, middle in self.middles.items():
            turn = moved[body][:, :3, :3]
            shifts = turn @ middle + moved[body][:, :3, 3] - middle
            squares += (shifts**2).sum(axis=1) / self.length**2 + 3.0 - np.trace(turn, axis1=1, axis2=2)
        return np.asarray(np.sqrt(np.maximum(squares, 0.0) / max(len(self.middles), 1)))

    def linearised(self, q: Floats) -> tuple[Linear, Linear]:
        """The loops' errors, and the bodies' shifts and turns that `distances` sums up, near coordinates (c,).

        Slopes are by the rates of `screws`; those of errors hold where these are small.
        """
        present, moved, unit = screws(self.tree, q[None])[0], displacements(self.tree, q[None]), self.length
        scale = self.tree.characteristic_length / unit
        signs = {body: path[column_joints(self.tree)] for body, path in tree_of(self.tree).paths.items()}

        def rates(body: str, point: Floats) -> tuple[Floats, Floats]:
            """Angular velocities and velocities of a point (3,) on a body, (3, c) each."""
            own = (present * signs[body][:, None]).T
            return own[:3], scale * own[3:] + _crossing(point / unit) @ own[:3]

        errors: list[Floats] = []
        gaps: list[Floats] = []
        for loop in self.loops:
            points, frames = _sides(loop, moved)
            turns, shifts = zip(*(rates(*each) for each in zip(loop.connects, points, strict=True)), strict=True)
            across = {"spherical": np.zeros((0, 3)), "revolute": frames[0][:, :2].T}.get(loop.type, np.eye(3))
            errors += [shifts[0] - shifts[1], across @ (turns[0] - turns[1])]
            gaps += [(points[0] - points[1]) / unit, across @ _turn(loop, frames)]
        values, slopes = [], []
        for body, middle in self.middles.items():
            turn = moved[body][0, :3, :3]
            point = turn @ middle + moved[body][0, :3, 3]
            omegas, velocities = rates(body, point)
            values += [(point - middle) / unit, (turn - np.eye(3)).ravel() * np.sqrt(0.5)]
            turning = np.stack([_crossing(axis) @ omegas for axis in turn.T], axis=1)
            slopes += [velocities, turning.reshape(9, -1) * np.sqrt(0.5)]
        linear = Linear(np.concatenate(values), np.concatenate(slopes))
        return Linear(np.concatenate(gaps), np.concatenate(errors)), linear

    @cached_property
    def columns_of_loops(self) -> Mask:
        """Coordinates (n, c) that mirror images turn about: all, and those around each loop, or around no other."""
        paths = tree_of(self.tree).paths
        around = [np.not_equal(*(paths[body] for body in loop.connects)) for loop in self.loops]
        alone = [each & (np.sum(around, axis=0) == 1) for each in around]
        columns = np.array([np.ones(len(self.tree.joints), bool), *around, *alone])[:, column_joints(self.tree)]
        return np.unique(columns, axis=0)

    @cached_property
    def bridged(self) -> tuple[Closure, dict[int, float]]:
        """The machine with bridges in its open loops, compiled, and column -> the coordinate that closes each."""
        joints, values = list(self.tree.joints), {}
        openings = self.openings(np.zeros_like(self.low))
        for number, (loop, (gap, turn)) in enumerate(zip(self.loops, openings, strict=True)):
            first, second = loop.connects
            at = loop.at[1]
            for kind, vector in (("prismatic", gap * self.length), ("revolute", turn)):
                size = float(np.linalg.norm(vector))
                if size > 0.0:
                    name = f"{BRIDGE} {number} {kind}"
                    point = None if kind == "prismatic" else at
                    joints.append(Joint(name, cast(JointType, kind), (first, name), point, vector / size))
                    values[name], first = size, name
            axis = loop.turned[1][:, 2] if loop.type == "revolute" else None
            joints.append(Joint(f"{BRIDGE} {number}", loop.type, (first, second), at, axis))
        body = next(body for body in self.loops[0].connects if body != self.tree.base)
        bridged = replace(self.tree, joints=tuple(joints), end_effector=body)
        closure = closure_of(cast(Mechanism, bridged), whole=True)
        return closure, {columns(bridged)[name].start: value for name, value in values.items()}

    def openings(self, q: Floats) -> list[tuple[Floats, Floats]]:
        """For every loop, at coordinates (c,): distance (3,) [L], and angle (3,) [rad] between its two sides."""
        bodies = displacements(self.tree, q[None])
        sides = [(loop, *_sides(loop, bodies)) for loop in self.loops]
        return [((points[0] - points[1]) / self.length, _turn(loop, frames)) for loop, points, frames in sides]

    def gap(self, q: Floats) -> float:
        """The largest distance [L] or angle [rad]."""
        sizes = [np.linalg.norm(part) for opening in self.openings(q) for part in opening]
        return float(max(sizes, default=0.0))

    def meetings(self, q: Floats) -> list[tuple[Floats, Floats]]:
        """For every loop, at coordinates (c,): the point (3,) [length] midway between its sides, a frame (3, 3)."""
        bodies = displacements(self.tree, q[None])
        return [(point.mean(axis=0), frames[0]) for point, frames in (_sides(loop, bodies) for loop in self.loops)]

    def is_along_pin(self, loop: Loop, q: Floats, gap: Floats) -> bool:
        """True if the hinges around a loop are all parallel, nothing else moves it, and its gap (3,) is along them."""
        one, other = (tree_of(self.tree).paths[body][column_joints(self.tree)] for body in loop.connects)
        turns = screws(self.tree, q[None])[0][one != other][:, :3]
        off = np.linalg.norm(np.cross(turns, gap), axis=1) > TOLERANCES.file_angle * np.linalg.norm(gap)
        return bool(len(turns) and not off.any() and turns.any(axis=1).all())


def _crossing(point: Floats) -> Floats:
    """The matrix (3, 3) that takes an angular velocity to its cross product with a vector (3,)."""
    x, y, z = point
    return np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])


def radius_around(points: Sequence[ArrayLike]) -> float:
    """The radius around the mean of points (3,) [length]; 1 where they have no extent."""
    every = np.array(points, float).reshape(-1, 3)
    return float(np.linalg.norm(every - every.mean(axis=0), axis=1).max()) or 1.0 if len(every) else 1.0


def _sides(loop: Loop, bodies: dict[str, Floats]) -> tuple[Floats, Floats]:
    """A loop's points (2, 3) [length] and frames (2, 3, 3) where its bodies are."""
    moved = [bodies[body][0] for body in loop.connects]
    points = [motion[:3, :3] @ point + motion[:3, 3] for motion, point in zip(moved, loop.at, strict=True)]
    frames = [motion[:3, :3] @ frame for motion, frame in zip(moved, loop.turned, strict=True)]
    return np.array(points), np.array(frames)


def _turn(loop: Loop, frames: Floats) -> Floats:
    """The rotation vector (3,) [rad] from the second frame to the first; of a hinge, that between the axes."""
    if loop.type == "spherical":
        return np.zeros(3)
    if loop.type == "revolute":
        one, other = frames[:, :, 2]  # of a hinge, either way along its line
        return to_rotvec(shortest_turns(np.copysign(1.0, one @ other) * other[None], one[None])[0])
    return to_rotvec(frames[0] @ frames[1].T)


def close_home(loops: OpenLoops, free: Mask, low: Floats, high: Floats) -> ClosedHome:
    """The coordinates nearest to home, of those found, in which the loops meet; or are least open.

    Newton's method starts from the drawing, then from mirror images of what it comes to: of all joints, and of those of
    one loop alone, over and over while that is nearer; where all end open, from around. Nearest is least in
    `OpenLoops.distances`.

    Parameters
    ----------
    free : the coordinates that may move, (c,); the others stay at home.
    low, high : bounds of the coordinates as deviations from home, (c,) [rad or length]; equal ones hold a coordinate.
    """
    home = np.where(free, np.clip(0.0, low, high), 0.0)
    if not loops.loops:
        return ClosedHome(home, 0.0)
    search = _Search(loops, free, low, high)
    search.start(home[None])
    if search.nearest()[0].gap > TOLERANCES.file_gap:
        rng, units = np.random.default_rng(0), rate_units(loops.tree)
        search.start(np.where(free, home + rng.uniform(-STRAY, STRAY, (STARTS, len(home))) * units, home))
    if loops.gap(home) > TOLERANCES.file_gap >= search.nearest()[0].gap:
        search.mirror(home)
    best, *others = search.nearest()
    distances = loops.distances(np.array([each.q for each in (best, *others)]))
    return replace(best, distance=float(distances[0]), other=float(distances[1]) if others else np.inf)


class _Search:
    """Closed configurations of an open machine, as they are found.

    Attributes
    ----------
    found : what Newton's method came to.
    """

    def __init__(self, loops: OpenLoops, free: Mask, low: Floats, high: Floats) -> None:
        self._loops, self._free, self._low, self._high = loops, free & (low < high), low, high
        self._closure, self._bridges = loops.bridged
        self._locked = frozenset([*np.flatnonzero(~self._free).tolist(), *self._bridges])
        self._units = rate_units(loops.tree)
        self._has_limits = bool(np.isfinite([low, high]).any())
        self.found: list[ClosedHome] = []

    def nearest(self) -> list[ClosedHome]:
        """Those that are closed as well as any, the nearest to the drawing first."""
        least = min(each.gap for each in self.found)
        closed = [each for each in self.found if each.gap <= max(2.0 * least, CLOSED)]
        distances = self._loops.distances(np.array([each.q for each in closed]))
        return [closed[index] for index in np.argsort(distances, kind="stable")]

    def start(self, starts: Floats) -> None:
        """Close the loops from some coordinates (n, c), within bounds where that is what it takes."""
        for limits in (False, True)[: 1 + self._has_limits]:
            self.found += self._closed(np.clip(starts, self._low, self._high), limits)
            if self.nearest()[0].gap <= TOLERANCES.file_gap:
                return

    def _closed(self, starts: Floats, limits: bool) -> list[ClosedHome]:
        """What Newton's method comes to from some coordinates (n, c)."""
        closure, count = self._closure, starts.shape[1]
        coordinates = np.zeros((len(starts), len(closure.scale)))
        coordinates[:, :count], coordinates[:, list(self._bridges)] = starts, list(self._bridges.values())
        poses = platform_poses(closure.mechanism, coordinates)
        ends = close(closure, coordinates, poses, locked=self._locked, limits=limits, closeness=0.1 * CLOSED)
        exact = close(closure, ends.coordinates, ends.poses, locked=self._locked, undamped=True, max_iterations=POLISH)
        found = []
        for pair in np.stack([exact.coordinates, ends.coordinates], axis=1)[:, :, :count]:
            one, other = (ClosedHome(q, self._loops.gap(q)) for q in np.clip(pair, self._low, self._high))
            found.append(one if one.gap < 2.0 * other.gap else other)
        return found

    def mirror(self, home: Floats) -> None:
        """Start from mirror images of the nearest one, across home, until none is nearer; then let all come nearer."""
        best = self.nearest()[0]
        while True:
            images = np.where(self._loops.columns_of_loops, 2.0 * home - best.q, best.q)
            self.start(np.where(self._free, images, home))
            if (nearest := self.nearest()[0]) is best:
                break
            best = nearest
        least = float(self._loops.distances(best.q[None])[0])
        self.found = [self._settled(each) for each in self._apart(FARTHEST * least, SAME)]
        self.found = self._apart(FARTHEST * least, APART * least)

    def _apart(self, most: float, least: float) -> list[ClosedHome]:
        """The nearest ones, a few, that are at most so far from the drawing [L], and apart in some coordinate by more.

        Parameters
        ----------
        least : difference of coordinates from which two are apart [rad or L].
        """
        chosen: list[ClosedHome] = []
        for each in self.nearest():
            is_apart = all((np.abs(each.q - other.q) > least * self._units).any() for other in chosen)
            if is_apart and len(chosen) < MOST and (not chosen or self._loops.distances(each.q[None])[0] <= most):
                chosen.append(each)
        return chosen

    def _settled(self, home: ClosedHome) -> ClosedHome:
        """The nearest to the drawing of the closed configurations that one can be moved to; itself, if it cannot move.

        Gauss-Newton on the bodies' shifts and turns, in the motions that keep the loops closed to first order.
        """
        share = 1.0
        for _ in range(SETTLING):
            errors, bodies = self._loops.linearised(home.q)
            _, singular, rows = np.linalg.svd(errors.slopes[:, self._free])
            motions = rows[int((singular > TOLERANCES.alignment * singular[0]).sum()) :].T
            if not motions.size or share < SAME:
                break
            toward = np.linalg.lstsq(bodies.slopes[:, self._free] @ motions, bodies.values, rcond=None)[0]
            trial = self._restored(self._moved(home.q, -share * motions @ toward))
            before, after = self._loops.distances(np.array([home.q, trial.q]))
            if trial.gap > max(2.0 * home.gap, CLOSED) or after >= before:
                share *= 0.3
                continue
            home, share = trial, min(1.0, 2.0 * share)
            if before - after <= SETTLED * before:
                break
        return home

    def _moved(self, q: Floats, step: Floats) -> Floats:
        """Coordinates after a step of the free ones, as rates of `screws`, within bounds."""
        whole = np.zeros((1, len(q)))
        whole[0, self._free] = step
        moved = stepped(self._loops.tree, q[None], whole)[0]
        return np.where(self._free, np.clip(moved, self._low, self._high), q)

    def _restored(self, q: Floats) -> ClosedHome:
        """The closed configuration next to one that is nearly closed, by least steps."""
        for _ in range(POLISH):
            errors, _ = self._loops.linearised(q)
            if np.abs(errors.values).max() <= 0.5 * CLOSED:
                break
            free = errors.slopes[:, self._free]
            step: Floats = -np.linalg.lstsq(free, errors.values, rcond=TOLERANCES.alignment)[0]
            q = self._moved(q, step)
        q = np.where(np.abs(q) <= NOTHING * self._units, 0.0, q)
        return ClosedHome(q, self._loops.gap(q))
