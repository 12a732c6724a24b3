"""Where every body is, from the coordinates of all joints: products of exponentials along a tree from the base.

The coordinate vector q, shape (n, c), holds the deviations from home of all joints' coordinates, in the order of
`mechanism.joints`; each moves the joint's second body relative to its first:

- revolute: angle [rad] about the home axis through the joint's centre;
- prismatic: displacement [length] along the home axis;
- universal: two angles [rad], the first about the axis fixed in the first body, the second about the other;
- cylindrical: angle [rad] about, then displacement [length] along the home axis;
- spherical: rotation vector [rad], in home coordinates, about the joint's centre;
- fixed: nothing.

The displacement of a body is a matrix (4, 4) that takes its points from where they are at home to where they are now,
both in base coordinates [length]; the base has the identity. A row of q that holds a NaN gives NaN for all but
what rests on the base.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...common.arrays import Floats, Mask
from ...common.derived import derived
from ...common.frozen import FrozenMapping
from ...common.rotations import angles_and_sines, composed, from_rotvec
from ..description.graph import Tree, tree_of
from ..description.home_mobility import (
    column_joints,
    joint_screws,
    universal_axes,
)
from ..description.joints import Joint
from ..description.structure import Structure


@dataclass(frozen=True)
class _Geometry:
    """The geometry that displacements need, at home, in base coordinates, per joint (j) or per coordinate (c).

    Attributes
    ----------
    tree : the joints that lead to each body.
    places : body -> its index in stacks of displacements.
    firsts, seconds : the two bodies of every joint, (j,).
    owners : the joint of every coordinate, (c,).
    centres : fixed points of the joints' rotations, (j, 3) [length]; the reference point where there is no centre.
    turns : rotation vectors of the joints' first and second rotation per coordinate, (2, c, j, 3).
    slides : translations of the joints per coordinate, (c, j, 3).
    screws : unit screws of the coordinates, (c, 6): angular velocity, velocity at the origin [L].
    spherical : whether a coordinate is a spherical joint's, (c,).
    """

    tree: Tree
    places: Mapping[str, int]
    firsts: NDArray[np.intp]
    seconds: NDArray[np.intp]
    owners: NDArray[np.intp]
    centres: Floats
    turns: Floats
    slides: Floats
    screws: Floats
    spherical: Mask


@derived
def columns(mechanism: Structure) -> Mapping[str, slice]:
    """Joint name -> its coordinates, as a slice of the columns of q."""
    bounds = np.searchsorted(column_joints(mechanism), np.arange(len(mechanism.joints) + 1)).tolist()
    return FrozenMapping(
        {joint.name: slice(*bounds[index : index + 2]) for index, joint in enumerate(mechanism.joints)}
    )


@derived
def home_coordinates(mechanism: Structure) -> Floats:
    """All joint coordinates at home as the description counts them, (c,) [rad or length]."""
    home = np.array([each.home for each in mechanism.coordinates], float)
    home.setflags(write=False)
    return home


def displacements(mechanism: Structure, q: Floats) -> dict[str, Floats]:
    """Body -> its displacements, (n, 4, 4) [length], in base coordinates.

    Parameters
    ----------
    q : coordinates as deviations from home, (n, c) [rad or length].
    """
    geometry = _geometry(mechanism)
    bodies = _bodies(geometry, _motions(geometry, q)[0])
    return {body: bodies[:, place] for body, place in geometry.places.items()}


def joint_displacements(mechanism: Structure, name: str, values: Floats) -> Floats:
    """Displacements (n, 4, 4) [length] of a joint's second body when only that joint moves and its first body rests.

    Parameters
    ----------
    values : its coordinates as deviations from home, (n, own) [rad or length].
    """
    geometry = _geometry(mechanism)
    span, place = columns(mechanism)[name], [joint.name for joint in mechanism.joints].index(name)
    first, second = from_rotvec(values @ geometry.turns[:, span, place])
    return _about(geometry.centres[place], first @ second, values @ geometry.slides[span, place])


def centres(mechanism: Structure, q: Floats) -> dict[str, Floats]:
    """Joint name -> present position of its centre, as a point of its first body, (n, 3) [length], in base coordinates.

    Joints without a centre (prismatic joints without `at`) are left out.
    """
    geometry = _geometry(mechanism)
    present = _centres(geometry, _bodies(geometry, _motions(geometry, q)[0]))
    return {joint.name: present[:, j] for j, joint in enumerate(mechanism.joints) if joint.at is not None}


def placed(mechanism: Structure, q: Floats) -> tuple[Floats, Floats]:
    """Displacements (n, bodies, 4, 4) of `mechanism.bodies`, and joint centres (n, joints, 3) as of `centres`."""
    geometry = _geometry(mechanism)
    bodies = _bodies(geometry, _motions(geometry, q)[0])
    return bodies, _centres(geometry, bodies)


def joint_centres(mechanism: Structure, q: Floats) -> Floats:
    """Present centres of all joints, as points of their first bodies, (n, joints, 3) [length], in base coordinates."""
    return placed(mechanism, q)[1]


def end_effector_pose(mechanism: Structure, q: Floats) -> Floats:
    """Pose of the end effector, T_base_platform, (n, 4, 4) [length].

    Of a joint end effector, the pose is the present centre of the joint, unrotated.
    """
    displaced = displacements(mechanism, q)[mechanism.end_effector_body] @ mechanism.home_pose
    if mechanism.end_effector_is_joint:
        displaced[:, :3, :3] = np.eye(3)
    return displaced


def screws(mechanism: Structure, q: Floats) -> Floats:
    """Present unit screws of all coordinates, (n, c, 6), in base coordinates.

    A screw is the angular velocity, and the velocity of the point at the base origin in units of L (the characteristic
    length), of the joint's second body relative to its first: per unit rate of an angle [1/s], or of a displacement
    [L/s]. The three of a spherical joint are the rotations about the base's x, y and z axes through the present centre:
    they span what the joint can do, but are not the rates of its rotation vector (see `stepped`).
    """
    geometry = _geometry(mechanism)
    motions, turned = _motions(geometry, q)
    frames = _frames(geometry, _bodies(geometry, motions), turned)
    angular = np.einsum("ncij,cj->nci", frames[..., :3, :3], geometry.screws[:, :3])
    linear = np.einsum("ncij,cj->nci", frames[..., :3, :3], geometry.screws[:, 3:])
    offset = frames[..., :3, 3] / mechanism.characteristic_length
    return np.concatenate([angular, linear + np.cross(offset, angular)], axis=-1)


def geometry_screws(mechanism: Structure, q: Floats, points: Floats, axes: Floats) -> Floats:
    """Present screws of joints per change of the geometry at home, (n, joints, p, 6), in the units of `screws`.

    Each is the motion of the joint's second body relative to its first while all coordinates rest. With its rotation R,
    its slide s and its centre c, a joint takes x to y = R (x - c) + c + s; a change of the centre moves y by
    (I - R) dc, one of the axes turns it by w about c + s, and moves it by the displacement times the change of the
    slide's axis. For a turn by t about a unit axis a, w = sin(t) da + (1 - cos(t)) a x da.

    Parameters
    ----------
    points : changes of the centres per unit of each parameter, (p, joints, 3) [length]; not NaN.
    axes : changes of the unit axes, (p, joints, 2, 3), each square to its axis.
    """
    geometry = _geometry(mechanism)
    motions, turned = _motions(geometry, q)
    frames = _bodies(geometry, motions)[:, geometry.firsts]
    rotations, changes = motions[..., :3, :3], np.swapaxes(points, 0, 1)
    arms = motions[..., :3, 3] + np.einsum("njab,jb->nja", rotations, geometry.centres)  # c + s
    present = _axis_values(mechanism, q)
    angular = np.zeros((len(q), *changes.shape))
    for axis, frame in ((1, turned), (0, None)):
        angle, about = present.angles[axis][..., None, None], present.axes[axis][:, None]
        change = np.swapaxes(axes[:, :, axis], 0, 1)
        turn = np.sin(angle) * change + (1.0 - np.cos(angle)) * np.cross(about, change)
        angular += turn if frame is None else turn @ np.swapaxes(frame, -1, -2)
    velocity = changes - changes @ np.swapaxes(rotations, -1, -2) + np.cross(arms[:, :, None], angular)
    velocity += present.slides[..., None, None] * np.swapaxes(axes[:, :, 0], 0, 1)
    present_rotations = np.swapaxes(frames[..., :3, :3], -1, -2)
    angular, velocity = angular @ present_rotations, velocity @ present_rotations
    velocity += np.cross(frames[:, :, None, :3, 3], angular)
    return np.concatenate([angular, velocity / mechanism.characteristic_length], axis=-1)


class _AxisValues(NamedTuple):
    """Turns of joints about their axes, and slides along them; zero for a joint without.

    Attributes
    ----------
    angles : about the first and the second axis, (2, n, joints) [rad].
    slides : along the first axis, (n, joints) [length].
    axes : the unit axes, (2, joints, 3).
    """

    angles: Floats
    slides: Floats
    axes: Floats


def _axis_values(mechanism: Structure, q: Floats) -> _AxisValues:
    joints = mechanism.joints
    angles, slides = np.zeros((2, len(q), len(joints))), np.zeros((len(q), len(joints)))
    axes = np.zeros((2, len(joints), 3))
    for j, joint in enumerate(joints):
        column = columns(mechanism)[joint.name]
        if joint.type == "universal":
            angles[:, :, j], axes[:, j] = q[:, column].T, universal_axes(mechanism, joint)
        elif joint.type in ("revolute", "prismatic", "cylindrical"):
            axes[0, j] = mechanism.home_axis(joint.name)
            if joint.type != "prismatic":
                angles[0, :, j] = q[:, column.start]
            if joint.type != "revolute":
                slides[:, j] = q[:, column.stop - 1]
    return _AxisValues(angles, slides, axes)


def gaps(mechanism: Structure, q: Floats) -> Floats:
    """Largest gap of any loop, (n,) [length]; zero where there are no loops.

    At every joint that closes a loop, its second body is compared with where its first body and its coordinates put it:
    the distance at the joint's centre (at the reference point where it has none), and the angle times L.
    """
    turns, shifts, _ = _openings(mechanism, q)
    angles, _ = angles_and_sines(turns)
    sizes = np.concatenate([angles * mechanism.characteristic_length, np.linalg.norm(shifts, axis=-1)], axis=-1)
    return np.asarray(np.max(sizes, axis=-1, initial=0.0))


def loop_errors(mechanism: Structure, q: Floats) -> Floats:
    """The small screw motions that open the loops, (n, loops, 6), in base coordinates; in the units of `screws`.

    One for every joint that closes a loop: the motion of its second body away from where its first body and its
    coordinates put it. To first order: of a large rotation, the axis times the angle.
    """
    turns, shifts, points = _openings(mechanism, q)
    angles, sines = angles_and_sines(turns)
    rotations = sines / np.sinc(angles / np.pi)[..., None]
    velocity = (shifts - np.cross(rotations, points)) / mechanism.characteristic_length
    return np.concatenate([rotations, velocity], axis=-1)


def stepped(mechanism: Structure, q: Floats, step: Floats) -> Floats:
    """The coordinates after every joint made a step along its present screws, (n, c) [rad or length].

    Parameters
    ----------
    q : coordinates, (n, c) [rad or length].
    step : as the rates of `screws`, (n, c) [rad or L]. The step of a spherical joint is a rotation vector in base
        coordinates; it is composed with the rotation the joint has already.
    """
    geometry = _geometry(mechanism)
    moved = q + step * rate_units(mechanism)
    bodies = _bodies(geometry, _motions(geometry, q)[0])
    for name, column in columns(mechanism).items():
        if mechanism.joint(name).type == "spherical":
            first = bodies[:, geometry.firsts[geometry.owners[column.start]], :3, :3]
            turn = np.einsum("nji,nj->ni", first, step[:, column])
            moved[:, column] = composed(turn, q[:, column])
    return moved


@derived
def rate_units(mechanism: Structure) -> Floats:
    """Units of the rates of `screws`, (c,): 1 for an angle [1/s], L for a displacement [L/s]."""
    turning = _geometry(mechanism).screws[:, :3].any(axis=1)
    units = np.where(turning, 1.0, mechanism.characteristic_length)
    units.setflags(write=False)
    return units


def actuator_units(mechanism: Structure) -> Floats:
    """Units of the rates of actuators, (n_a,): 1 for an angle [1/s], L for a displacement [L/s]."""
    return rate_units(mechanism)[[drive.column for drive in mechanism.drives]]


@derived
def _geometry(mechanism: Structure) -> _Geometry:
    joints, owners = mechanism.joints, column_joints(mechanism)
    places = {body: place for place, body in enumerate(mechanism.bodies)}
    turns, slides = np.zeros((2, len(owners), len(joints), 3)), np.zeros((len(owners), len(joints), 3))
    for j, joint in enumerate(joints):
        column = columns(mechanism)[joint.name]
        turns[:, column, j], slides[column, j] = _exponents(mechanism, joint)
    return _Geometry(
        tree=tree_of(mechanism),
        places=places,
        firsts=np.array([places[joint.connects[0]] for joint in joints]),
        seconds=np.array([places[joint.connects[1]] for joint in joints]),
        owners=owners,
        centres=np.array([mechanism.reference_point if joint.at is None else joint.at for joint in joints]),
        turns=turns,
        slides=slides,
        screws=np.vstack([joint_screws(mechanism, joint) for joint in joints]),
        spherical=np.array([joint.type == "spherical" for joint in joints])[owners],
    )


def _exponents(mechanism: Structure, joint: Joint) -> tuple[Floats, Floats]:
    """Vectors of a joint's first and second rotation, (2, freedoms, 3), and of its translation, (freedoms, 3)."""
    none, one = np.zeros(3), np.eye(3)
    if joint.type == "spherical":
        return np.array([one, np.zeros((3, 3))]), np.zeros((3, 3))
    if joint.type == "universal":
        first, second = universal_axes(mechanism, joint)
        return np.array([[first, none], [none, second]]), np.zeros((2, 3))
    if joint.type == "fixed":
        return np.zeros((2, 0, 3)), np.zeros((0, 3))
    axis = np.array(mechanism.home_axis(joint.name))
    if joint.type == "cylindrical":
        return np.array([[axis, none], [none, none]]), np.array([none, axis])
    if joint.type == "prismatic":
        return np.zeros((2, 1, 3)), axis[None]
    return np.array([[axis], [none]]), np.zeros((1, 3))


def _motions(geometry: _Geometry, q: Floats) -> tuple[Floats, Floats]:
    """Displacement of every joint's second body relative to its first, (n, j, 4, 4); its first rotation, (n, j, 3, 3).

    Both are in home coordinates.
    """
    shape = (len(q), *geometry.centres.shape)
    first, second = from_rotvec((q @ geometry.turns.reshape(2, len(geometry.owners), -1)).reshape(2, *shape))
    slides = (q @ geometry.slides.reshape(len(geometry.slides), -1)).reshape(shape)
    return _about(geometry.centres, first @ second, slides), first


def _about(centres: Floats, rotations: Floats, slides: Floats) -> Floats:
    """The motions (..., 4, 4) that turn about a centre, then slide."""
    motions = np.zeros((*rotations.shape[:-2], 4, 4))
    motions[..., :3, :3] = rotations
    motions[..., :3, 3] = centres - np.einsum("...ij,...j->...i", rotations, centres) + slides
    motions[..., 3, 3] = 1.0
    return motions


def _bodies(geometry: _Geometry, motions: Floats) -> Floats:
    """Displacements of all bodies, (n, bodies, 4, 4), in the order of `places`."""
    bodies = np.empty((len(motions), len(geometry.places), 4, 4))
    bodies[:] = np.eye(4)
    for j, forward in geometry.tree.steps:
        first, second = geometry.firsts[j], geometry.seconds[j]
        if forward:
            bodies[:, second] = bodies[:, first] @ motions[:, j]
        else:
            bodies[:, first] = bodies[:, second] @ _inverse(motions[:, j])
    return bodies


def _inverse(motions: Floats) -> Floats:
    inverse = motions.copy()
    inverse[..., :3, :3] = np.swapaxes(motions[..., :3, :3], -1, -2)
    inverse[..., :3, 3] = -np.einsum("...ij,...j->...i", inverse[..., :3, :3], motions[..., :3, 3])
    return inverse


def _centres(geometry: _Geometry, bodies: Floats) -> Floats:
    """Present centres of all joints, as points of their first bodies, (n, j, 3)."""
    return _moved(bodies[:, geometry.firsts], geometry.centres)


def _moved(motions: Floats, points: Floats) -> Floats:
    return np.asarray(np.einsum("...ij,...j->...i", motions[..., :3, :3], points) + motions[..., :3, 3])


def _frames(geometry: _Geometry, bodies: Floats, turned: Floats) -> Floats:
    """Displacements (n, c, 4, 4) that take the home screws to the present ones.

    An axis of a joint's second rotation is carried by the first rotation too; a spherical joint's axes stay parallel.
    """
    owners, inner = geometry.owners, geometry.turns[1].any(axis=(1, 2))
    frames = bodies[:, geometry.firsts[owners]]
    carried = owners[inner]
    frames[:, inner] = frames[:, inner] @ _about(geometry.centres[carried], turned[:, carried], np.zeros(3))
    balls = owners[geometry.spherical]
    frames[..., :3, 3][:, geometry.spherical] = _centres(geometry, bodies)[:, balls] - geometry.centres[balls]
    frames[:, geometry.spherical, :3, :3] = np.eye(3)
    return frames


def _openings(mechanism: Structure, q: Floats) -> tuple[Floats, Floats, Floats]:
    """Gaps of the loops at their closing joints, and where they are, in base coordinates.

    Rotations (n, loops, 3, 3) and distances (n, loops, 3) [length] from where the first body and the coordinates put
    the second body to where it is, and the points (n, loops, 3) [length] at which the distances are measured.
    """
    geometry = _geometry(mechanism)
    motions = _motions(geometry, q)[0]
    bodies = _bodies(geometry, motions)
    closing = np.array(geometry.tree.closing, dtype=np.intp)
    put = bodies[:, geometry.firsts[closing]] @ motions[:, closing]
    found = bodies[:, geometry.seconds[closing]]
    points = _moved(put, geometry.centres[closing])
    turns = found[..., :3, :3] @ np.swapaxes(put[..., :3, :3], -1, -2)
    return turns, _moved(found, geometry.centres[closing]) - points, points
