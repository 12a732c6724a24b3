"""Small meshes: vertices (n, 3) and faces (k, 3) of about the size 1; turns as quaternions, scalar first."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...arrays import Floats
from ...rotations import shortest_turns, to_quaternion, to_rotvec

if TYPE_CHECKING:
    from trimesh import Trimesh

Mesh = tuple[NDArray[np.float32], NDArray[np.int32]]

SIDES = 16


def cylinder(sides: int = SIDES, height: float = 1.0) -> Mesh:
    """Upright, about its middle, of radius 1: a prism where it has few sides."""
    from trimesh import creation

    return _mesh(creation.cylinder(radius=1.0, height=height, sections=sides))


def ball() -> Mesh:
    """A sphere of radius 0.8."""
    from trimesh import creation

    return _mesh(creation.uv_sphere(radius=0.8, count=(9, SIDES)))


def octahedron() -> Mesh:
    """With corners on the axes, 1.1 from its middle."""
    vertices = 1.1 * np.vstack([np.eye(3), -np.eye(3)])
    faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    return vertices.astype(np.float32), np.array(faces, np.int32)


def tetrahedron() -> Mesh:
    """With corners 1.2 from its middle."""
    vertices = 0.7 * np.array([[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]])
    return vertices.astype(np.float32), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32)


def box() -> Mesh:
    """A cube of side 1.6."""
    from trimesh import creation

    return _mesh(creation.box(extents=(1.6, 1.6, 1.6)))


def _mesh(made: Trimesh) -> Mesh:
    return np.asarray(made.vertices, np.float32), np.asarray(made.faces, np.int32)


SHAPES: dict[str, Callable[[], Mesh]] = {
    "revolute": ball,
    "prismatic": box,
    "universal": octahedron,
    "spherical": tetrahedron,
    "cylindrical": lambda: cylinder(6, 1.6),
    "fixed": lambda: cylinder(3, 1.6),
}
"""Shapes of joints, those of the markers in pictures: round, square, diamond, triangle, hexagon."""


def fan(corners: Floats) -> Mesh:
    """A face through corners (k, 3) in order, as triangles about their middle."""
    here = np.arange(len(corners))
    middle = np.full(len(corners), len(corners))
    vertices = np.vstack([corners, corners.mean(axis=0)]).astype(np.float32)
    return vertices, np.stack([here, np.roll(here, -1), middle], axis=1).astype(np.int32)


def upright_to(directions: Floats) -> Floats:
    """The quaternions (n, 4) of the shortest turns of the z axis to directions (n, 3); none for no direction."""
    lengths = np.linalg.norm(directions, axis=1, keepdims=True)
    upright = np.broadcast_to((0.0, 0.0, 1.0), directions.shape)
    along = np.divide(directions, lengths, out=upright.copy(), where=lengths > 0.0)
    return quaternion(shortest_turns(upright, along))


def quaternion(rotations: Floats) -> Floats:
    """The quaternions (..., 4) of rotation matrices (..., 3, 3), scalar first."""
    return np.roll(to_quaternion(to_rotvec(rotations)), 1, axis=-1)
