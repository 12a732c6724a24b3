"""A mechanism as two trees of unit motions, from the base and from the end effector, and the cuts that close its loops.

Balls that nothing asks for are cut before other joints: their coordinates are left out. Another joint that is cut keeps
its own, and is cut behind them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints
from ...common.derived import derived
from ...kernels.dynamics.moving import BASE, END, FIRST
from ...kernels.joints.loops import BALL
from ..description.graph import tree_of
from ..description.joints import Joint
from ..description.mechanism import Mechanism
from .displacements import columns
from .loops import connected, unit_motions


class CutLoops(NamedTuple):
    """The trees and cuts of a mechanism, as the fields of `kernels.dynamics.moving.MovingMachine` are; lengths in L.

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


class _Unit(NamedTuple):
    """A unit motion beyond a frame; axis and point at home [L]."""

    kind: int
    frame: int
    coordinate: int
    sense: int
    axis: Floats
    point: Floats

    @property
    def width(self) -> int:
        return 3 if self.kind == BALL else 1


class _Cut(NamedTuple):
    """A cut between two frames, its number of conditions, and the signs of V and of unit motions in them."""

    one: int
    other: int
    rows: int
    of_end: int
    signs: dict[int, int]
    point: Floats


@derived
def cut_loops(mechanism: Mechanism, kept: tuple[int, ...]) -> CutLoops:
    """The trees and cuts of a mechanism; the coordinates `kept` have columns."""
    frames, units, cuts = _grown(mechanism, set(kept))
    members = connected([set(cut.signs) for cut in cuts])
    groups = [(sorted({unit for k in group for unit in cuts[k].signs}), group) for group in members]
    bound = {unit for own, _ in groups for unit in own}
    groups.append(([unit for unit in range(len(units)) if unit not in bound], []))
    firsts: dict[int, int] = {}
    rows: list[list[int]] = []
    visits: list[tuple[int, int]] = []
    points, bounds, n_columns = [], [(0, 0, 0)], 0
    for own, group in groups:
        for unit in own:
            firsts[unit] = n_columns
            n_columns += units[unit].width
        for cut in (cuts[k] for k in group):
            rows.append([*cut[:4], len(visits)])
            points.append(cut.point)
            visits += [(firsts[k] + i, sign) for k, sign in sorted(cut.signs.items()) for i in range(units[k].width)]
        bounds.append((n_columns, len(rows), sum(row[2] for row in rows)))
    end, way = mechanism.end_effector_body, []
    for index, forward in tree_of(mechanism).way(end):
        way += _units(mechanism, mechanism.joints[index], 0, forward)
    return CutLoops(
        frames=frames,
        places={units[k].coordinate + i: first + i for k, first in firsts.items() for i in range(units[k].width)},
        units=_ints(
            ([unit.kind, unit.frame, unit.coordinate, firsts[k], unit.sense] for k, unit in enumerate(units)), 5
        ),
        axes=_vectors(unit.axis for unit in units),
        points=_vectors(unit.point for unit in units),
        way=_ints(([unit.kind, 0, unit.coordinate, 0, unit.sense] for unit in way), 5),
        way_axes=_vectors(unit.axis for unit in way),
        way_points=_vectors(unit.point for unit in way),
        end=np.array(mechanism.reference_point) / mechanism.characteristic_length,
        cuts=_ints([*rows, [0, 0, 0, 0, len(visits)]], 5),
        cut_points=_vectors(points),
        visits=_ints(visits, 2),
        groups=_ints(bounds, 3),
    )


def _grown(mechanism: Mechanism, kept: set[int]) -> tuple[dict[str, int], list[_Unit], list[_Cut]]:
    """Frames of the bodies, the unit motions that lead to them, and the cuts between them."""

    def is_cut_ball(joint: Joint) -> bool:
        own = columns(mechanism)[joint.name]
        return joint.type == "spherical" and not kept & set(range(own.start, own.stop))

    trees = {body: {body} for body in mechanism.bodies}
    _join(trees, mechanism.base, mechanism.end_effector_body)
    waiting: list[Joint] = []
    cut: list[Joint] = []
    for joint in sorted(mechanism.joints, key=lambda joint: (not joint.is_rigid, is_cut_ball(joint))):
        (waiting if _join(trees, *joint.connects) else cut).append(joint)
    frames, units = {mechanism.base: BASE, mechanism.end_effector_body: END}, []

    def beyond(joint: Joint, frame: int, forward: bool) -> int:
        for unit in _units(mechanism, joint, frame, forward):
            units.append(unit._replace(frame=frame))
            frame = FIRST + len(units) - 1
        return frame

    while waiting:
        joint = next(joint for joint in waiting if set(joint.connects) & set(frames))
        waiting.remove(joint)
        forward = joint.connects[0] in frames
        before, after = joint.connects if forward else joint.connects[::-1]
        frames[after] = beyond(joint, frames[before], forward)
    cuts = []
    for joint in cut:
        one, other = (frames[body] for body in joint.connects)
        one, rows = (one, 3) if is_cut_ball(joint) else (beyond(joint, one, True), 6)
        (first, back), (second, out) = _way(units, one), _way(units, other)
        signs = {unit: 1 if unit in out else -1 for unit in back ^ out}
        cuts.append(_Cut(one, other, rows, int(second == END) - int(first == END), signs, _centre(mechanism, joint)))
    return frames, units, cuts


def _join(trees: dict[str, set[str]], one: str, other: str) -> bool:
    """Join the trees of two bodies; False if they are one."""
    if trees[one] is trees[other]:
        return False
    trees[one] |= trees[other]
    trees.update(dict.fromkeys(trees[other], trees[one]))
    return True


def _way(units: Sequence[_Unit], frame: int) -> tuple[int, set[int]]:
    """The root of a frame, and the unit motions on the way to it."""
    way = set()
    while frame >= FIRST:
        way.add(frame - FIRST)
        frame = units[frame - FIRST].frame
    return frame, way


def _units(mechanism: Mechanism, joint: Joint, frame: int, forward: bool) -> list[_Unit]:
    """A joint's unit motions in the order in which they are passed."""
    if joint.is_rigid:
        return []
    first, point, sense = columns(mechanism)[joint.name].start, _centre(mechanism, joint), 1 if forward else -1
    units = [
        _Unit(kind, frame, first + k, sense, np.array(axis), point)
        for k, (kind, axis) in enumerate(unit_motions(mechanism, joint))
    ]
    return units[::sense]


def _centre(mechanism: Mechanism, joint: Joint) -> Floats:
    return np.zeros(3) if joint.at is None else np.array(joint.at) / mechanism.characteristic_length


def _ints(rows: Iterable[Any], width: int) -> Ints:
    return np.array(list(rows), np.int64).reshape(-1, width)


def _vectors(vectors: Iterable[Floats]) -> Floats:
    return np.array(list(vectors), float).reshape(-1, 3)
