"""Joints in series from the base to the end effector: found, their coordinates, the poses they give, and back.

With the joints' motions at home as unit screws s_1 ... s_m, in order from the base outward, a coordinate vector q moves
the end effector from home by the product of exponentials

    D(q) = exp(s_1 d_1) ... exp(s_m d_m),    d_i = sign_i (q_i - home_i)

and the pose is T_base_platform = D(q) T_home. The sign is -1 for a joint whose first body is the outer one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from ...common.arrays import Floats, Ints, Mask
from ...common.checks import names_of
from ...common.derived import derived
from ...common.rotations import UNTURNED, to_rotvec
from ...errors import InvalidArgument, UnknownName
from ...kernels.threads import in_blocks
from ...tolerances import TOLERANCES
from ..description.graph import Step, edges_of, welded
from ..description.home_mobility import universal_axes
from ..description.joint_coordinates import JointCoordinate
from ..description.joints import Vector
from ..description.mechanism import Mechanism
from .displacements import columns, home_coordinates


def passive_series(mechanism: Mechanism) -> tuple[str, ...]:
    """Names of passive joints in series from base to end effector, the fewest; none if there are no such joints."""
    passive = [joint for joint in mechanism.joints if not joint.actuated]
    stands_for = welded([joint for joint in passive if joint.type == "fixed"], mechanism.base)
    ways: dict[str, tuple[str, ...]] = {stands_for.get(mechanism.base, mechanism.base): ()}
    bodies = list(ways)
    for body in bodies:  # grows while it is looked through
        for joint in passive:
            ends = [stands_for.get(end, end) for end in joint.connects]
            if body in ends and joint.type != "fixed":
                other = ends[1] if ends[0] == body else ends[0]
                if other not in ways:
                    ways[other] = (*ways[body], joint.name)
                    bodies.append(other)
    return min((ways[end] for end in _ends(mechanism, stands_for) if end in ways), key=len, default=())


def named_coordinates(mechanism: Mechanism, names: tuple[str, ...]) -> list[JointCoordinate]:
    """The coordinates that names of joints or coordinates stand for, in their order."""
    if not names:
        raise InvalidArgument("joints", "no joint", _expected(mechanism))
    by_name = {name: [replace(each, name=name)] for name, each in mechanism.coordinates_by_name.items()}
    for joint in mechanism.joints:
        by_name[joint.name] = [each for each in mechanism.coordinates if each.joint.name == joint.name]
    for name in names:
        if not isinstance(name, str) or name not in by_name:
            raise UnknownName("joint", name, [joint.name for joint in mechanism.joints])
        if not by_name[name]:
            raise InvalidArgument("joints", f"'{name}', which is fixed", "joints that move")
    named = [each for name in names for each in by_name[name]]
    columns = [each.column for each in named]
    twice = [each.name for place, each in enumerate(named) if each.column in columns[:place]]
    if twice:
        raise InvalidArgument("joints", f"'{twice[0]}' twice", "each joint once")
    return named


def in_series(mechanism: Mechanism, names: set[str]) -> list[Step]:
    """The named joints as steps from the base to the end effector."""
    stands_for = welded([joint for joint in mechanism.joints if joint.type == "fixed"], mechanism.base)
    edges = [edge for edge in edges_of(mechanism.joints) if edge.joint.name in names]
    body, passed = stands_for.get(mechanism.base, mechanism.base), set[str]()
    steps: list[Step] = []
    while len(steps) < len(edges):
        ways = [
            (edge.joint, other)
            for edge in edges
            if edge.joint.name not in {step.joint.name for step in steps}
            for here, other in (_ends_of(edge.bodies, stands_for), _ends_of(edge.bodies[::-1], stands_for))
            if here == body
        ]
        passed.add(body)
        if len(ways) != 1 or ways[0][1] in passed:
            raise _no_series(mechanism, names)
        joint, body = ways[0]
        steps.append(Step(joint, stands_for.get(joint.connects[1], joint.connects[1]) == body))
    if body not in _ends(mechanism, stands_for):
        raise _no_series(mechanism, names)
    return steps


def _ends_of(bodies: tuple[str, ...], stands_for: dict[str, str]) -> tuple[str, str]:
    return stands_for.get(bodies[0], bodies[0]), stands_for.get(bodies[1], bodies[1])


def _ends(mechanism: Mechanism, stands_for: dict[str, str]) -> set[str]:
    """The bodies that end a path: the end effector, or both that it joins."""
    bodies: tuple[str, ...] = (mechanism.end_effector,)
    if mechanism.end_effector_is_joint:
        bodies = mechanism.joint(mechanism.end_effector).connects
    return {stands_for.get(body, body) for body in bodies}


def _no_series(mechanism: Mechanism, names: set[str]) -> InvalidArgument:
    listed = ", ".join(joint.name for joint in mechanism.joints if joint.name in names)
    return InvalidArgument("joints", listed, _expected(mechanism))


def _expected(mechanism: Mechanism) -> str:
    passive = passive_series(mechanism)
    hint = f", such as {', '.join(passive)}" if passive else ""
    return f"joints in series from '{mechanism.base}' to '{mechanism.end_effector}'{hint}"


ROWS_A_BLOCK = 1024
"""Rows of one call of the kernel."""

MOST_STEPS = 50
"""Newton steps from a pose back to coordinates: it takes four to eight; more only where there are none."""


@dataclass(frozen=True)
class PathMotion:
    """One elementary motion of a joint on the path, at home, in base coordinates.

    Attributes
    ----------
    kind : a turn about, or a slide along, the axis; or a ball, whose three coordinates are a rotation vector.
    axis : unit vector at home; zero for a ball.
    point : fixed point of the rotation at home [length]; of a slide without a centre, the origin.
    sign : +1 if a growing coordinate moves the outer body forward about or along the axis, else -1.
    place : which of the path's coordinates it is; of a ball, the first of three.
    """

    kind: Literal["turn", "slide", "ball"]
    axis: Vector
    point: Vector
    sign: float
    place: int


@dataclass(frozen=True, eq=False)
class JointPath:
    """Joints in series from the base to the end effector, whose coordinates give the pose.

    Coordinates are in the order in which they were named, counted as the description counts them.

    Attributes
    ----------
    mechanism : the machine.
    coordinates : each of them, with its name, kind, range and joint.
    motions : elementary motions from the base outward; each has the place of its coordinate.
    """

    mechanism: Mechanism
    coordinates: tuple[JointCoordinate, ...]
    motions: tuple[PathMotion, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates: "pitch" of a hinge or slide, "pivot[0]", "pivot[1]" of a universal joint."""
        return tuple(each.name for each in self.coordinates)

    @cached_property
    def columns(self) -> Ints:
        """Their places in `mechanism.coordinate_names`, (k,)."""
        return np.array([each.column for each in self.coordinates], np.int64)

    def rates_of(self, motions: Floats, _: Floats) -> Floats:
        """Their rates (n, k, f) by f motions, given as rates of all joints (n, nq, f)."""
        return motions[:, self.columns]

    @cached_property
    def home(self) -> Floats:
        """Their values in the home configuration, (k,) [rad or length]."""
        return home_coordinates(self.mechanism)[self.columns]

    @cached_property
    def low(self) -> Floats:
        """Lowest values, (k,) [rad or length]; -inf without a range."""
        return np.array([each.limits[0] for each in self.coordinates])

    @cached_property
    def high(self) -> Floats:
        """Highest values, (k,) [rad or length]; inf without a range."""
        return np.array([each.limits[1] for each in self.coordinates])

    @cached_property
    def is_angle(self) -> tuple[bool, ...]:
        """Which of them are angles; the others are lengths."""
        return tuple(each.kind == "angle" for each in self.coordinates)

    def poses(self, q: Floats) -> Floats:
        """Poses T_base_platform (n, 4, 4) [length] at coordinates q (n, k); of a joint end effector, unrotated.

        NaN where a coordinate is not finite.
        """
        return self.poses_and_twists(q)[0]

    def poses_and_twists(self, q: Floats) -> tuple[Floats, Floats]:
        """Poses (n, 4, 4), and the twist of the end effector by each coordinate's rate, (n, 6, k), in the base frame.

        Twists are [velocity of the reference point; angular velocity] [length, rad]; (n, 3, k), the velocity alone, for
        a joint end effector. NaN where a coordinate is not finite.
        """
        from ...kernels.walk_path import walk_path

        is_joint = self.mechanism.end_effector_is_joint
        poses, twists = np.empty((len(q), 4, 4)), np.empty((len(q), 6, len(self.coordinates)))
        deviations, end = np.ascontiguousarray(q - self.home), np.array(self.mechanism.reference_point)

        def run(block: slice) -> None:
            walk_path(self._table, end, deviations[block], poses[block], twists[block])

        in_blocks(run, len(q), ROWS_A_BLOCK)
        invalid = ~np.isfinite(q).all(axis=1)
        if invalid.any():
            poses[invalid], twists[invalid] = np.nan, np.nan
        if is_joint:
            poses[~invalid, :3, :3] = UNTURNED
        return poses, twists[:, :3] if is_joint else twists

    def coordinates_at(self, poses: Floats, start: Floats | None = None) -> Floats:
        """Coordinates (n, k) at which the path has given poses (n, 4, 4), nearest to a start (k,) or (n, k) by Newton.

        NaN where the search finds none: the pose may be off the path, or far from the start (default: home).
        """
        q = np.array(np.broadcast_to(self.home if start is None else start, (len(poses), len(self.coordinates))))
        units = np.where(self.is_angle, 1.0, self.mechanism.characteristic_length)
        length, rows = self.mechanism.characteristic_length, np.flatnonzero(np.isfinite(poses).all(axis=(1, 2)))
        is_there = np.zeros(len(poses), bool)
        for _ in range(MOST_STEPS):
            present, twists = self.poses_and_twists(q[rows])
            errors = self._errors(present, poses[rows]) / length
            twists[:, :3] /= length
            if twists.shape[1] > 3:
                errors[:, 3:] *= length
            is_there[rows] = self._is_small(errors)
            steps = (np.linalg.pinv(twists * units, rcond=TOLERANCES.rank) @ errors[..., None])[..., 0]
            sizes = np.abs(steps).max(axis=1, initial=0.0)
            q[rows] += steps * units / np.maximum(sizes, 1.0)[:, None]  # at most a radian, or L, at once
            rows = rows[sizes > np.finfo(float).eps]
            if not len(rows):
                break
        q[~is_there] = np.nan
        return q

    @staticmethod
    def _is_small(errors: Floats) -> Mask:
        small = np.linalg.norm(errors[:, :3], axis=1) <= TOLERANCES.position
        return np.asarray(small & (np.linalg.norm(errors[:, 3:], axis=1) <= TOLERANCES.rotation))

    def _errors(self, present: Floats, wanted: Floats) -> Floats:
        """Twists (n, 6) or (n, 3) [length, rad] that lead from poses to others, to first order."""
        shifts = wanted[:, :3, 3] - present[:, :3, 3]
        if self.mechanism.end_effector_is_joint:
            return np.asarray(shifts)
        turns = to_rotvec(wanted[:, :3, :3] @ np.swapaxes(present[:, :3, :3], 1, 2))
        return np.concatenate([shifts, turns], axis=1)

    @cached_property
    def _table(self) -> Floats:
        """The motions as the kernel takes them."""
        kinds = ("turn", "slide", "ball")
        return np.array(
            [[kinds.index(each.kind), each.place, each.sign, *each.axis, *each.point] for each in self.motions]
        )


def joint_path(mechanism: Mechanism, names: str | Sequence[str]) -> JointPath:
    """The path of named joints, which stand in series between base and end effector.

    Fixed joints between them need no names. The order of the names is that of the coordinates, and need not be that of
    the joints.

    Parameters
    ----------
    names : names of joints, or of all coordinates of a joint one by one ("pivot[1]", "pivot[0]").

    Raises
    ------
    UnknownName : no joint or coordinate of that name.
    InvalidArgument : a name twice; joints that are not in series, or do not lead from the base to the end effector.
    """
    return path_of(mechanism, names_of("joints", names))


@derived
def path_of(mechanism: Mechanism, names: tuple[str, ...]) -> JointPath:
    """The path of `joint_path`, made once."""
    named = named_coordinates(mechanism, names)
    joints = {each.joint.name for each in named}
    places = {each.column: place for place, each in enumerate(named)}
    for name in joints:
        lacking = [c.name for c in mechanism.coordinates if c.joint.name == name and c.column not in places]
        if lacking:
            raise InvalidArgument("joints", f"no coordinate {', '.join(lacking)}", f"all those of joint '{name}'")
    steps = in_series(mechanism, joints)
    motions = [motion for step in steps for motion in _motions_of(mechanism, step, places)]
    return JointPath(mechanism, tuple(named), tuple(motions))


def _motions_of(mechanism: Mechanism, step: Step, places: dict[int, int]) -> list[PathMotion]:
    """The elementary motions of a joint on the path, from the base outward."""
    joint, first = step.joint, columns(mechanism)[step.joint.name].start
    point: Vector = (0.0, 0.0, 0.0) if joint.at is None else joint.at
    if joint.type == "spherical":
        taken = [places[first + k] for k in range(3)]
        if taken != list(range(taken[0], taken[0] + 3)):
            raise InvalidArgument("joints", f"coordinates of '{joint.name}' in another order", f"'{joint.name}'")
        return [PathMotion("ball", (0.0, 0.0, 0.0), point, step.sign, taken[0])]
    if joint.type == "universal":
        kinds, axes = ["turn", "turn"], [*universal_axes(mechanism, joint)]
    else:
        kinds = {"revolute": ["turn"], "prismatic": ["slide"], "cylindrical": ["turn", "slide"]}[joint.type]
        axes = [mechanism.home_axis(joint.name)] * len(kinds)
    motions = [
        PathMotion("turn" if kind == "turn" else "slide", _vector(axis), point, step.sign, places[first + place])
        for place, (kind, axis) in enumerate(zip(kinds, axes, strict=True))
    ]
    return motions if step.forward else motions[::-1]


def _vector(axis: Sequence[float] | Floats) -> Vector:
    x, y, z = (float(each) for each in axis)
    return x, y, z
