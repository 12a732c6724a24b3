"""A mechanism as two trees of unit motions, from the base and from the end effector, and the cuts that close its loops.

Balls that nothing asks for are cut before other joints: their coordinates are left out. Another joint that is cut keeps
its own, and is cut behind them.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from ..arrays import Floats, Ints
from ..derived import derived
from ..description.graph import tree_of
from ..description.joints import Joint
from ..description.mechanism import Mechanism
from ..kernels.closure.loops import BALL
from ..kernels.dynamics.moving import BASE, END, FIRST
from .displacements import columns
from .loops import unit_motions


class CutLoops(NamedTuple):
    """The trees and cuts of a mechanism, as the fields of `kernels.dynamics.moving.Moving` are; lengths in L.

    Attributes
    ----------
    frames : body -> its frame.
    places : coordinate -> its column; those of balls that are cut are missing.
    """

    frames: dict[str, int]
    places: dict[int, int]
    units: Ints
    axes: Floats
    points: Floats
    way: Ints
    way_axes: Floats
    way_points: Floats
    end: Floats
    cuts: Ints
    cut_points: Floats
    visits: Ints
    groups: Ints


@derived
def cut_loops(mechanism: Mechanism, kept: tuple[int, ...]) -> CutLoops:
    """The trees and cuts of a mechanism; the coordinates `kept` have columns."""
    return _Trees(mechanism, kept).built()


class _Trees:
    def __init__(self, mechanism: Mechanism, kept: Collection[int]) -> None:
        self.mechanism, self.columns, self.length = mechanism, columns(mechanism), mechanism.characteristic_length
        self.frames = {mechanism.base: BASE, mechanism.end_effector_body: END}
        self.units: list[list[int]] = []  # without their columns
        self.vectors: list[tuple[Floats, Floats]] = []

        def is_cut_ball(joint: Joint) -> bool:
            return joint.type == "spherical" and not set(range(*self.columns[joint.name].indices(2**31))) & set(kept)

        roots = {body: body for body in mechanism.bodies}

        def root(body: str) -> str:
            while roots[body] != body:
                body = roots[body]
            return body

        roots[root(mechanism.end_effector_body)] = root(mechanism.base)
        grown, cut = [], []
        for joint in sorted(mechanism.joints, key=lambda joint: (not joint.is_rigid, is_cut_ball(joint))):
            one, other = map(root, joint.connects)
            (cut if one == other else grown).append(joint)
            roots[one] = other
        while grown:
            joint = next(joint for joint in grown if set(joint.connects) & set(self.frames))
            grown.remove(joint)
            forward = joint.connects[0] in self.frames
            before, after = joint.connects if forward else joint.connects[::-1]
            self.frames[after] = self._grow(joint, self.frames[before], forward)
        self.cuts = []
        for joint in cut:
            one, other = (self.frames[body] for body in joint.connects)
            is_ball = is_cut_ball(joint)
            point = np.zeros(3) if joint.at is None else np.array(joint.at) / self.length
            self.cuts.append((one if is_ball else self._grow(joint, one, True), other, 3 if is_ball else 6, point))

    def _grow(self, joint: Joint, frame: int, forward: bool) -> int:
        """Add a joint's unit motions beyond a frame; the frame they lead to."""
        units, vectors = _units(self.mechanism, joint, forward)
        for unit in units:
            self.units.append([unit[0], frame, *unit[1:]])
            frame = FIRST + len(self.units) - 1
        self.vectors += vectors
        return frame

    def _way(self, frame: int) -> tuple[int, dict[int, int]]:
        """The root of a frame, and the unit motions on the way to it."""
        way = {}
        while frame >= FIRST:
            way[frame - FIRST] = 1
            frame = self.units[frame - FIRST][1]
        return frame, way

    def built(self) -> CutLoops:
        conditions = []
        for one, other, rows, point in self.cuts:
            (first, back), (second, out) = self._way(one), self._way(other)
            signs = {unit: (unit in out) - (unit in back) for unit in {**back, **out}}
            signs = {unit: sign for unit, sign in signs.items() if sign}
            conditions.append((one, other, rows, int(second == END) - int(first == END), signs, point))
        groups: list[tuple[set[int], list[int]]] = []
        for number, condition in enumerate(conditions):
            touching = [group for group in groups if group[0] & set(condition[4])]
            groups = [group for group in groups if group not in touching]
            members = sorted([number, *(m for group in touching for m in group[1])])
            groups.append((set(condition[4]).union(*(group[0] for group in touching)), members))
        groups.sort(key=lambda group: group[1])
        bound = set().union(*(group[0] for group in groups))
        groups.append(({unit for unit in range(len(self.units)) if unit not in bound}, []))
        firsts: dict[int, int] = {}
        n = rows = 0
        table, cuts, visits, points = [(0, 0, 0)], [], [], []
        for members, numbers in groups:
            for unit in sorted(members):
                firsts[unit] = n
                n += self._width(unit)
            for number in numbers:
                one, other, count, of_end, signs, point = conditions[number]
                cuts.append((one, other, count, of_end, len(visits)))
                points.append(point)
                visits += [(firsts[k] + i, signs[k]) for k in sorted(signs) for i in range(self._width(k))]
                rows += count
            table.append((n, len(cuts), rows))
        places = {self.units[k][2] + i: first + i for k, first in firsts.items() for i in range(self._width(k))}
        units = [(kind, parent, q, firsts[k], sense) for k, (kind, parent, q, sense) in enumerate(self.units)]
        way, vectors = [], []
        for index, forward in tree_of(self.mechanism).way(self.mechanism.end_effector_body):
            own, of_own = _units(self.mechanism, self.mechanism.joints[index], forward)
            way += [(kind, 0, q, 0, sense) for kind, q, sense in own]
            vectors += of_own
        return CutLoops(
            frames=self.frames,
            places=places,
            units=_ints(units, 5),
            axes=_floats(axis for axis, _ in self.vectors),
            points=_floats(point for _, point in self.vectors),
            way=_ints(way, 5),
            way_axes=_floats(axis for axis, _ in vectors),
            way_points=_floats(point for _, point in vectors),
            end=np.array(self.mechanism.reference_point) / self.length,
            cuts=_ints([*cuts, (0, 0, 0, 0, len(visits))], 5),
            cut_points=_floats(points),
            visits=_ints(visits, 2),
            groups=_ints(table, 3),
        )

    def _width(self, unit: int) -> int:
        return 3 if self.units[unit][0] == BALL else 1


def _units(mechanism: Mechanism, joint: Joint, forward: bool) -> tuple[list[list[int]], list[tuple[Floats, Floats]]]:
    """Kind, coordinate and sense of a joint's unit motions as they are passed, and axis and point of each [L]."""
    if joint.is_rigid:
        return [], []
    first = columns(mechanism)[joint.name].start
    point = np.zeros(3) if joint.at is None else np.array(joint.at) / mechanism.characteristic_length
    motions = [(kind, first + k, np.array(axis)) for k, (kind, axis) in enumerate(unit_motions(mechanism, joint))]
    motions = motions if forward else motions[::-1]
    return [[kind, q, 1 if forward else -1] for kind, q, _ in motions], [(axis, point) for *_, axis in motions]


def _ints(rows: list, width: int) -> Ints:
    return np.array(rows, np.int64).reshape(-1, width)


def _floats(vectors) -> Floats:
    return np.array(list(vectors), float).reshape(-1, 3)
