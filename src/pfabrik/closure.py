"""The closure engine: the joint coordinates of a whole mechanism, its loops closed to machine precision.

Bodies are posed by products of exponentials along the paths from the base to the end effector; nothing here is shared
with the reaching engine, so that each can check the other.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import accumulate, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .cones import cone_line, opposite
from .displacements import columns
from .freedom import universal_axes
from .joint_types import KINDS
from .kernels import loops as K
from .mechanism import Joint, Mechanism
from .parallel import in_blocks
from .paths import Path, independent_paths

Floats = NDArray[np.float64]

EVERYTHING_FREE = (0.0,) * 6
HELD = (K.LOCKED,) * 6


@dataclass(frozen=True)
class Closure:
    """A mechanism as the closure kernel takes it.

    Attributes
    ----------
    scale : what a coordinate is multiplied by to be dimensionless: 1 / L for lengths, 1 for angles, (columns,).
    turning : 1 for angles, 0 for lengths, (columns,).
    last_balls : ball joints at the platform, each at the end of a path that shares no joint.
    actuated, home : columns of the actuators, and their values at home, (n_a,).
    """

    mechanism: Mechanism
    loops: K.Loops
    scale: Floats
    turning: Floats
    actuated: NDArray[np.int64]
    last_balls: frozenset[str]
    home: Floats

    @property
    def idle(self) -> NDArray[np.bool_]:
        """Which coordinates are on no path (a tool's hinge): nothing but their limits asks anything of them."""
        idle = np.ones(len(self.scale), bool)
        idle[self.loops.row_columns] = False
        return idle

    def layout(self, locked: frozenset[str]) -> K.Layout:
        """The layout in which some joints do not move."""
        return _layout(self.mechanism, locked)


@lru_cache(maxsize=64)
def closure_of(mechanism: Mechanism) -> Closure:
    """Compile a mechanism for the closure kernel."""
    builder = _Builder(mechanism)
    for path in independent_paths(mechanism):
        builder.add_path(path)
    for joint in mechanism.joints:
        builder.add_joint(joint)
    loops = builder.build()
    kinds = [kind for joint in mechanism.joints for kind in KINDS[joint.type].coordinates]
    turning = np.array([float(kind == "angle") for kind in kinds])
    scale = np.where(turning, 1.0, 1.0 / mechanism.characteristic_length)
    actuated = _ints(columns(mechanism)[name].start for name in mechanism.actuators)
    home = np.array([np.ravel(mechanism.home_coordinate(name))[0] for name in mechanism.actuators])
    ending = loops.columns[loops.visits[loops.paths[1:][loops.last_balls == 1] - 1, 0]]
    starts = {span.start: name for name, span in columns(mechanism).items() if span.stop > span.start}
    balls = frozenset(starts[int(first)] for first in ending)
    return Closure(mechanism, loops, scale, turning, actuated, balls, home)


@lru_cache(maxsize=256)
def _layout(mechanism: Mechanism, locked: frozenset[str]) -> K.Layout:
    loops = closure_of(mechanism).loops
    free = np.ones(len(loops.group_of), bool)
    for name, span in columns(mechanism).items():
        if name in locked:
            free[span] = False
    slots = np.full(len(free), -1)
    sizes = np.zeros(len(loops.groups) - 1, np.int64)
    for j in np.flatnonzero(free):
        group = loops.group_of[j]
        slots[j] = sizes[group]
        sizes[group] += 1
    return K.Layout(slots, sizes)


class Closing(NamedTuple):
    """What a search for closed loops found, row by row; lengths in the mechanism's unit.

    Attributes
    ----------
    coordinates : deviations from home, (n, columns).
    poses : of the platform, (n, 4, 4).
    gaps : largest gap of the loops of each group of paths, (n, groups) [L or rad].
    excesses : largest excess over the limits of each group, likewise.
    misses : largest distance of a joint's centre from where it was wished, likewise.
    iterations : (n,).
    """

    coordinates: Floats
    poses: Floats
    gaps: Floats
    excesses: Floats
    misses: Floats
    iterations: NDArray[np.int64]

    @property
    def gap(self) -> Floats:
        """The largest gap of each row [L or rad]."""
        return np.asarray(self.gaps.max(axis=1, initial=0.0))

    @property
    def excess(self) -> Floats:
        """The largest excess over any limit of each row [L or rad]."""
        return np.asarray(self.excesses.max(axis=1, initial=0.0))


def close(
    closure: Closure,
    coordinates: Floats,
    poses: Floats,
    *,
    locked: frozenset[str] = frozenset(),
    platform: Sequence[float] = EVERYTHING_FREE,
    framed: bool = False,
    targets: Floats | None = None,
    weights: Floats | None = None,
    anchors: Floats | None = None,
    centres: Floats | None = None,
    limits: bool = False,
    margin: float = 0.0,
    chained: bool = False,
    plunging: bool = False,
    closeness: float = 1e-13,
    max_iterations: int = 100,
) -> Closing:
    """Close loops from given configurations, nearest to what is wished.

    Parameters
    ----------
    coordinates, poses : where to start, (n, columns) and (n, 4, 4).
    locked : joints that keep their coordinates.
    platform : weights of the squares of the platform's distance from `targets` (default: `poses`), position [L], then
        rotation [rad]; `LOCKED` holds that part where it starts.
    framed : the weights of the rotation are about the axes of the targets, not of the base.
    weights, anchors : weights of the squares of the coordinates' distances from anchors, (columns,), (n, columns).
    centres : wished joint centres, (n, joints, 3); NaN for none.
    limits : keep all limits too, by `margin` inside.
    chained : every row starts from the free coordinates of the one before.
    plunging : undamped steps, up and down: finds more of many solutions, but not the nearest.
    closeness : largest gap, excess and miss that ends the search [L or rad].
    """
    n = len(coordinates)
    follow = centres is None and not limits
    length = closure.mechanism.characteristic_length
    groups = len(closure.loops.groups) - 1
    closed = K.Closed(
        coordinates=coordinates * closure.scale,
        poses=_in_lengths(poses, 1.0 / length),
        gaps=np.full((n, groups), np.inf),
        excesses=np.full((n, groups), np.inf),
        misses=np.full((n, groups), np.inf),
        iterations=np.zeros(n, np.int64),
    )
    none = np.zeros((n, 0, 3))
    wishes = K.Wishes(
        weights=np.zeros(len(closure.scale)) if weights is None else weights,
        anchors=none[:, :, 0] if anchors is None else anchors * closure.scale,
        platform=np.array(platform, dtype=float),
        framed=int(framed),
        targets=closed.poses.copy() if targets is None else _in_lengths(targets, 1.0 / length),
        centres=none if centres is None else centres / length,
        limits=int(limits),
        margin=margin,
        chained=int(chained),
        balls_follow=int(follow),
        plunging=int(plunging),
        closeness=closeness,
        max_iterations=max_iterations,
    )
    layout = closure.layout(locked | closure.last_balls if follow else locked)
    _run(closure.loops, layout, wishes, closed)
    return Closing(closed.coordinates / closure.scale, _in_lengths(closed.poses, length), *closed[2:])


def _run(loops: K.Loops, layout: K.Layout, wishes: K.Wishes, closed: K.Closed) -> None:
    """The kernel over all rows, on all cores."""
    from .kernels.close import close as close_rows

    def run(block: slice) -> None:
        own = wishes._replace(
            anchors=wishes.anchors[block], targets=wishes.targets[block], centres=wishes.centres[block]
        )
        close_rows(loops, layout, own, K.Closed._make(array[block] for array in closed))

    n = len(closed.poses)
    in_blocks(run, n, rows_a_block=max(n, 1) if wishes.chained else 64)


def _in_lengths(poses: Floats, scale: float) -> Floats:
    scaled = np.array(poses)
    scaled[:, :3, 3] *= scale
    return scaled


class _Builder:
    """Collects unit motions and visits, path by path."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.columns = columns(mechanism)
        self.length = mechanism.characteristic_length
        self.units: dict[str, list[int]] = {}
        self.records: list[tuple[int, Any, Any, int]] = []
        self.paths: list[list[tuple[int, int]]] = []
        self.marks: list[list[tuple[int, int]]] = []
        ends = (mechanism.base, mechanism.end_effector)
        self.marked = {
            joint.name: place
            for place, joint in enumerate(mechanism.joints)
            if joint.at is not None and not set(ends) & set(joint.connects)
        }

    def add_path(self, path: Path) -> None:
        visits: list[tuple[int, int]] = []
        marks: list[tuple[int, int]] = []
        is_detour = len({passage.joint.name for passage in path}) < len(path)
        for passage in path:
            units = self.add_joint(passage.joint)
            if units and passage.joint.name in self.marked and not is_detour:
                marks.append((len(visits), self.marked[passage.joint.name]))
            visits += [(k, 1) for k in units] if passage.forward else [(k, -1) for k in reversed(units)]
        self.paths.append(visits)
        self.marks.append(marks)

    def add_joint(self, joint: Joint) -> list[int]:
        """Numbers of a joint's unit motions, in the order from its first body to its second."""
        if joint.name not in self.units:
            first = self.columns[joint.name].start
            motions = _motions(self.mechanism, joint)
            self.units[joint.name] = list(range(len(self.records), len(self.records) + len(motions)))
            point = np.zeros(3) if joint.at is None else np.array(joint.at) / self.length
            self.records += [(kind, axis, point, first + place) for place, (kind, axis) in enumerate(motions)]
        return self.units[joint.name]

    def build(self) -> K.Loops:
        groups = _connected([{k for k, _ in path} for path in self.paths])
        order = [path for group in groups for path in group]
        visits = [visit for path in order for visit in self.paths[path]]
        starts = _starts(len(self.paths[path]) for path in order)
        widths = [3 if self.records[k][0] == K.BALL else 1 for k, _ in visits]
        n_columns = sum(len(KINDS[joint.type].coordinates) for joint in self.mechanism.joints)
        group_of = np.zeros(n_columns, np.int64)
        for number, group in enumerate(groups):
            for k in {k for path in group for k, _ in self.paths[path]}:
                group_of[self._columns_of(k)] = number
        marks = [
            (starts[place] + visit, joint) for place, path in enumerate(order) for visit, joint in self.marks[path]
        ]
        lo, hi = _ranges(self.mechanism, n_columns)
        return K.Loops(
            kinds=_ints(record[0] for record in self.records),
            axes=_vectors(record[1] for record in self.records),
            points=_vectors(record[2] for record in self.records),
            columns=_ints(record[3] for record in self.records),
            visits=_pairs(visits),
            visit_rows=_ints(_starts(widths)),
            row_columns=_ints(j for k, _ in visits for j in self._columns_of(k)),
            paths=_ints(starts),
            groups=_ints(_starts(map(len, groups))),
            group_of=group_of,
            last_balls=_ints(self._ends_with_own_ball(group) for group in groups for _ in group),
            end=np.array(self.mechanism.reference_point) / self.length,
            lo=lo,
            hi=hi,
            marks=_pairs(marks),
            path_marks=_ints(_starts(len(self.marks[path]) for path in order)),
            **self._cones(),
        )

    def _ends_with_own_ball(self, group: list[int]) -> bool:
        last = self.paths[group[0]][-1:]
        return len(group) == 1 and any(self.records[k][0] == K.BALL for k, _ in last)

    def _columns_of(self, k: int) -> range:
        kind, _, _, first = self.records[k]
        return range(first, first + (3 if kind == K.BALL else 1))

    def _cones(self) -> dict[str, Any]:
        joints = [joint for joint in self.mechanism.joints if joint.cone is not None]
        lines = [cone_line(self.mechanism, joint) for joint in joints]
        offsets = [(np.asarray(end.at) - np.asarray(start.at)) / self.length for start, end in lines]
        slides = [
            _slides(self.mechanism, joint, end, offset, self.columns)
            for joint, (_, end), offset in zip(joints, lines, offsets, strict=True)
        ]
        starts = _starts(map(len, slides))
        return {
            "cone_units": _pairs((self.units[joint.name][0], self.units[joint.name][-1] + 1) for joint in joints),
            "cone_axes": _vectors(joint.cone.axis for joint in joints if joint.cone),
            "cone_lines": _vectors(offsets),
            "cone_angles": np.array([joint.cone.half_angle for joint in joints if joint.cone]),
            "cone_outward": _ints(j.cone.fixed_to == j.connects[0] for j in joints if j.cone),
            "cone_slides": _pairs(pairwise(starts)),
            "slides": _ints(j for each in slides for j, _ in each),
            "slide_axes": _vectors(axis for each in slides for _, axis in each),
        }


def _motions(mechanism: Mechanism, joint: Joint) -> list[tuple[int, Any]]:
    """The unit motions of a joint and their axes, in the order from its first body to its second."""
    if joint.type == "fixed":
        return []
    if joint.type == "spherical":
        return [(K.BALL, np.zeros(3))]
    if joint.type == "universal":
        return [(K.TURN, axis) for axis in universal_axes(mechanism, joint)]
    axis = mechanism.home_axis(joint.name)
    slide, turn = (K.SLIDE, axis), (K.TURN, axis)
    return {"revolute": [turn], "prismatic": [slide], "cylindrical": [turn, slide]}[joint.type]


def _slides(
    mechanism: Mechanism, joint: Joint, end: Joint, line: Floats, places: Mapping[str, slice]
) -> list[tuple[int, Floats]]:
    """The slides between a joint and the next that turn its line, and how the line moves with each."""
    body, found = opposite(joint), []
    seen = {joint.name}
    while body not in end.connects:
        passed = next(
            each
            for each in mechanism.joints
            if each.name not in seen and each.type in ("prismatic", "fixed") and body in each.connects
        )
        seen.add(passed.name)
        forward = passed.connects[0] == body
        body = passed.connects[1 if forward else 0]
        if passed.type == "prismatic":
            axis = np.array(mechanism.home_axis(passed.name)) * (1.0 if forward else -1.0)
            if passed.along is None or np.linalg.norm(np.cross(axis, line)) > 1e-9 * np.linalg.norm(line):
                found.append((places[passed.name].start, axis))
    return found


def _connected(sets: Sequence[set[int]]) -> list[list[int]]:
    """Indices of the sets, grouped so that sets of different groups share no element."""
    groups: list[tuple[set[int], list[int]]] = []
    for number, elements in enumerate(sets):
        touching = [group for group in groups if group[0] & elements]
        merged = (
            elements.union(*(group[0] for group in touching)),
            [*(m for group in touching for m in group[1]), number],
        )
        groups = [group for group in groups if group not in touching] + [merged]
    return [members for _, members in groups]


def _ranges(mechanism: Mechanism, n_columns: int) -> tuple[Floats, Floats]:
    """Bounds of the deviations from home, (columns,) each, dimensionless; infinite where there are none.

    A coordinate that is a distance has one even where the description gives none: it is not negative.
    """
    lo, hi = np.full(n_columns, -np.inf), np.full(n_columns, np.inf)
    for joint in mechanism.joints:
        span = columns(mechanism)[joint.name]
        home = np.reshape(mechanism.home_coordinate(joint.name), (-1, 1))
        lengths = np.array([kind == "length" for kind in KINDS[joint.type].coordinates])
        units = np.where(lengths, mechanism.characteristic_length, 1.0)[:, None]
        if joint.range is not None:
            lo[span], hi[span] = ((np.reshape(joint.range, (-1, 2)) - home) / units).T
        if joint.along is not None:
            lo[span] = np.maximum(lo[span], -home[:, 0] / units[:, 0])
    return lo, hi


def _starts(sizes: Iterable[int]) -> list[int]:
    return list(accumulate(sizes, initial=0))


def _ints(values: Iterable[int]) -> NDArray[np.int64]:
    return np.fromiter(values, np.int64)


def _pairs(values: Iterable[tuple[int, int]]) -> NDArray[np.int64]:
    return np.array(list(values), np.int64).reshape(-1, 2)


def _vectors(values: Iterable[Any]) -> Floats:
    return np.array(list(values), dtype=float).reshape(-1, 3)
