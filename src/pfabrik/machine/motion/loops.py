"""A mechanism as closed loops of unit motions, as kernels take them, and its joint rates to first order.

Here lengths are in units of L and twists are [velocity of the reference point; angular velocity], in the base frame, so
nothing depends on the mechanism's unit, on where it stands, or on the order of its joints.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, pairwise
from typing import Any

import numpy as np

from ...common.arrays import Floats, Ints, Mask
from ...common.derived import derived
from ...kernels.handle import Handle
from ...kernels.joints import loops as K
from ...tolerances import TOLERANCES
from ..description.graph import (
    PASSED_THROUGH,
    Path,
    Step,
    cone_line,
    edges_of,
    independent_paths,
    opposite,
    spanning_tree,
    tree_of,
)
from ..description.home_mobility import (
    body_twist,
    column_joints,
    column_moves,
    loop_conditions,
    orthonormal_rates,
    universal_axes,
)
from ..description.mechanism import Joint, Mechanism
from ..description.structure import Structure
from ..description.task import Task, task_of
from .displacements import columns, end_effector_pose, loop_errors, rate_units, screws, stepped


def loops_of(mechanism: Mechanism, *, whole: bool = True) -> K.Loops:
    """The table of paths, limits and cones that the closure kernels read; lengths in L.

    Parameters
    ----------
    whole : all loops; else only those on a path from the base to the end effector.
    """
    builder = _Builder(mechanism)
    for path in independent_paths(mechanism, detours=whole):
        builder.add_path(path)
    return builder.build()


def ways_to(mechanism: Mechanism, bodies: Sequence[str]) -> K.Loops:
    """The table of the paths from the base to some bodies, in their order; they may share joints."""
    builder, tree = _Builder(mechanism), tree_of(mechanism)
    for body in bodies:
        builder.add_path(tuple(Step(mechanism.joints[index], forward) for index, forward in tree.way(body)))
    return builder.build([[path] for path in range(len(bodies))])


class _Builder:
    """A builder of the table: the unit motions of all joints, in their order, and visits, path by path.

    All tables of a mechanism number its unit motions alike: one configuration is read by several.
    """

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
        for joint in mechanism.joints:
            self._add_joint(joint)

    def add_path(self, path: Path) -> None:
        visits: list[tuple[int, int]] = []
        marks: list[tuple[int, int]] = []
        is_detour = len({step.joint.name for step in path}) < len(path)
        for step in path:
            units = self.units[step.joint.name]
            if units and step.joint.name in self.marked and not is_detour:
                marks.append((len(visits), self.marked[step.joint.name]))
            visits += [(k, 1) for k in units] if step.forward else [(k, -1) for k in reversed(units)]
        self.paths.append(visits)
        self.marks.append(marks)

    def _add_joint(self, joint: Joint) -> None:
        """Add a joint's unit motions, in the order from its first body to its second."""
        first, motions = self.columns[joint.name].start, unit_motions(self.mechanism, joint)
        self.units[joint.name] = list(range(len(self.records), len(self.records) + len(motions)))
        point = np.zeros(3) if joint.at is None else np.array(joint.at) / self.length
        self.records += [(kind, axis, point, first + place) for place, (kind, axis) in enumerate(motions)]

    def build(self, groups: list[list[int]] | None = None) -> K.Loops:
        """The table; groups of paths, in their order, are those that share joints unless they are given."""
        groups = connected([{k for k, _ in path} for path in self.paths]) if groups is None else groups
        order = [path for group in groups for path in group]
        visits = [visit for path in order for visit in self.paths[path]]
        starts = _starts(len(self.paths[path]) for path in order)
        widths = [3 if self.records[k][0] == K.BALL else 1 for k, _ in visits]
        n_columns = len(self.mechanism.coordinates)
        group_of = np.zeros(n_columns, np.int64)
        for number, group in enumerate(groups):
            for k in {k for path in group for k, _ in self.paths[path]}:
                group_of[self._columns_of(k)] = number
        marks = [
            (starts[place] + visit, joint) for place, path in enumerate(order) for visit, joint in self.marks[path]
        ]
        lo, hi = _ranges(self.mechanism)
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
            "slides": _ints(j for of_cone in slides for j, _ in of_cone),
            "slide_axes": _vectors(axis for of_cone in slides for _, axis in of_cone),
        }


def unit_motions(mechanism: Mechanism, joint: Joint) -> list[tuple[int, Any]]:
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
    """The slides between a joint and the next that turn its line: the column and the motion of the line of each."""
    passed = [passed_joint for passed_joint in mechanism.joints if passed_joint.type in PASSED_THROUGH]
    tree, slides = spanning_tree(edges_of(passed), opposite(joint)), []
    for index, forward in tree.way(next(body for body in end.connects if body in tree.paths)):
        slide = passed[index]
        if slide.type == "prismatic":
            axis = np.array(mechanism.home_axis(slide.name)) * (1.0 if forward else -1.0)
            off = np.linalg.norm(np.cross(axis, line))
            if slide.along is None or off > TOLERANCES.position * np.linalg.norm(line):
                slides.append((places[slide.name].start, axis))
    return slides


def connected(sets: Sequence[set[int]]) -> list[list[int]]:
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


def _ranges(mechanism: Mechanism) -> tuple[Floats, Floats]:
    """Bounds of the deviations from home, (columns,) each, dimensionless; infinite where there are none.

    A coordinate that is a distance always has a lower bound, for it cannot be negative.
    """
    units = rate_units(mechanism).tolist()
    bounds = [coordinate.room(unit) for coordinate, unit in zip(mechanism.coordinates, units, strict=True)]
    lo, hi = np.ascontiguousarray(np.reshape(bounds, (-1, 2)).T)
    return lo, hi


def _starts(sizes: Iterable[int]) -> list[int]:
    return list(accumulate(sizes, initial=0))


def _ints(values: Iterable[int]) -> Ints:
    return np.fromiter(values, np.int64)


def _pairs(values: Iterable[tuple[int, int]]) -> Ints:
    return np.array(list(values), np.int64).reshape(-1, 2)


def _vectors(values: Iterable[Any]) -> Floats:
    return np.array(list(values), dtype=float).reshape(-1, 3)


@dataclass(frozen=True, eq=False)
class Closure:
    """A mechanism compiled for the closure kernel.

    Attributes
    ----------
    loops : the table of loops that kernels read.
    scale : factor that makes a coordinate dimensionless: 1 / L for lengths, 1 for angles, (columns,).
    turning : 1 for angles, 0 for lengths, (columns,).
    last_balls : columns of ball joints at the platform, each at the end of a path that shares no joint.
    actuated, home : columns of the actuators, and their values at home, (n_a,).
    driven : columns of actuators and locked joints, which stay fixed in forward kinematics.
    """

    mechanism: Mechanism
    task: Task
    loops: K.Loops
    scale: Floats
    turning: Floats
    actuated: Ints
    driven: frozenset[int]
    last_balls: frozenset[int]
    home: Floats

    @property
    def idle(self) -> Mask:
        """Mask of coordinates on no path, such as a tool's hinge: they do not move, and only their limits matter."""
        idle = np.ones(len(self.scale), bool)
        idle[self.loops.row_columns] = False
        return idle

    @cached_property
    def cubes(self) -> float:
        """Sum over groups of the cubed number of coordinates, at least 1: the cost of one closing step."""
        on_paths = self.loops.group_of[~self.idle]
        return float(max(1.0, (np.bincount(on_paths).astype(float) ** 3).sum()))

    def actuators(self, coordinates: Floats) -> Floats:
        """The actuated values (n, n_a) in coordinates (n, columns) [length or rad]."""
        return np.asarray(coordinates[:, self.actuated] + self.home)

    def put_actuators(self, coordinates: Floats, values: Floats) -> None:
        """Write actuated values (n, n_a), and zero for locked joints, into coordinates (n, columns)."""
        coordinates[:, list(self.driven)] = 0.0
        coordinates[:, self.actuated] = values - self.home

    @cached_property
    def machine(self) -> Handle[K.Loops]:
        """The handle by which kernels open the loops."""
        return Handle(self.loops)


def closure_of(mechanism: Mechanism, *, whole: bool) -> Closure:
    """Compile a mechanism for the closure kernel.

    Parameters
    ----------
    whole : with all loops; else with those on paths to the end effector only, the joints of other loops (a gripper's)
        being idle.
    """
    loops = loops_of(mechanism, whole=whole)
    turning = np.array([float(coordinate.kind == "angle") for coordinate in mechanism.coordinates])
    scale = np.where(turning, 1.0, 1.0 / mechanism.characteristic_length)
    actuated = np.array([drive.column for drive in mechanism.drives], np.int64)
    home = np.array([drive.home for drive in mechanism.drives])
    ending = loops.columns[loops.visits[loops.paths[1:][loops.last_balls == 1] - 1, 0]]
    balls = frozenset((ending[:, None] + np.arange(3)).ravel().tolist())
    locked = [coordinate.column for coordinate in mechanism.coordinates if coordinate.joint.is_rigid]
    driven = frozenset([*actuated.tolist(), *locked])
    return Closure(mechanism, task_of(mechanism), loops, scale, turning, actuated, driven, balls, home)


def actuated_columns(mechanism: Mechanism) -> list[int]:
    """The columns of the actuators."""
    return [drive.column for drive in mechanism.drives]


@dataclass(frozen=True)
class CycleBasis:
    """Sums of screws that make up twists and loop conditions, per column of q; locked joints have no part in them.

    Attributes
    ----------
    path : of the end effector's body, (c,).
    fundamental, orthonormal : the loops of the tree, and orthonormal combinations that depend on no tree, (loops, c).
    of_joints : these combinations by joint, (loops, joints).
    rates : orthonormal rates of every joint, (c, c).
    """

    path: Floats
    fundamental: Floats
    orthonormal: Floats
    of_joints: Floats
    rates: Floats


@derived
def cycle_basis(mechanism: Structure) -> CycleBasis:
    """The paths and loops along which screws of joint rates add up."""
    tree, owners = tree_of(mechanism), column_joints(mechanism)
    path = tree.paths[mechanism.end_effector_body][owners]
    orthonormal = np.linalg.qr(tree.loops.T)[0].T
    moves = column_moves(mechanism)
    loops, rates = tree.loops[:, owners] * moves, moves[:, None] * orthonormal_rates(mechanism)
    return CycleBasis(path * moves, loops, orthonormal[:, owners] * moves, orthonormal, rates)


def first_order(mechanism: Structure, q: Floats) -> tuple[Floats, Floats]:
    """Loop conditions (n, 6 loops, c) and twist of the end effector (n, r, c), per orthonormal joint rate."""
    graph, present = cycle_basis(mechanism), present_screws(mechanism, q)
    twist = body_twist(graph.path, present)
    velocity, angular = twist[:, 3:], twist[:, :3]
    rows = [velocity] if mechanism.end_effector_is_joint else [velocity, angular]
    return loop_conditions(graph.orthonormal, present), np.concatenate(rows, axis=1)


def present_screws(mechanism: Structure, q: Floats) -> Floats:
    """Screws of orthonormal joint rates, (n, c, 6): angular velocity, velocity of the present reference point."""
    return np.asarray(cycle_basis(mechanism).rates @ at_reference(mechanism, q, screws(mechanism, q)))


def loop_slopes(mechanism: Structure, q: Floats) -> Floats:
    """Slopes of the loops' errors by orthonormal joint rates, (n, 6 loops, c)."""
    return loop_conditions(cycle_basis(mechanism).fundamental, present_screws(mechanism, q))


def loop_errors_here(mechanism: Structure, q: Floats) -> Floats:
    """The loops' errors at the present reference point, (n, 6 loops) [rad, L]."""
    return at_reference(mechanism, q, loop_errors(mechanism, q)).reshape(len(q), -1)


def at_reference(mechanism: Structure, q: Floats, origin_screws: Floats) -> Floats:
    """Screws (n, k, 6) with the velocity of the present reference point in place of that at the base origin."""
    points = end_effector_pose(mechanism, q)[:, None, :3, 3] / mechanism.characteristic_length
    moved = origin_screws.copy()
    moved[..., 3:] += np.cross(moved[..., :3], points)
    return moved


def moved(mechanism: Structure, q: Floats, rates: Floats) -> Floats:
    return stepped(mechanism, q, rates @ cycle_basis(mechanism).rates)


def right_singular(matrices: Floats) -> tuple[Floats, Floats]:
    """Singular values, and all right singular vectors as rows, of (n, a, b): (n, min(a, b)) and (n, b, b)."""
    if 0 in matrices.shape[1:]:
        n, _, b = matrices.shape
        return np.zeros((n, 0)), np.broadcast_to(np.eye(b), (n, b, b))
    _, values, right = np.linalg.svd(matrices)
    return values, right
