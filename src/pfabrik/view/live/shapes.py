"""Small meshes: vertices (n, 3) and faces (k, 3) of about the size 1; turns as quaternions, scalar first."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Floats

Mesh = tuple[NDArray[np.float32], NDArray[np.int32]]

SIDES = 16


def cylinder() -> Mesh:
    """Upright, of radius 1 and length 1, about its middle."""
    return prism(SIDES)


def prism(sides: int, half: float = 0.5) -> Mesh:
    """An upright prism on a regular polygon of radius 1."""
    angles = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    low, high = (np.column_stack([ring, np.full(sides, height)]) for height in (-half, half))
    here = np.arange(sides)
    after = np.roll(here, -1)
    walls = [np.stack([here, after, after + sides], axis=1), np.stack([here, after + sides, here + sides], axis=1)]
    bottom, top = np.full(sides, 2 * sides), np.full(sides, 2 * sides + 1)
    caps = [np.stack([after, here, bottom], axis=1), np.stack([here + sides, after + sides, top], axis=1)]
    vertices = np.vstack([low, high, [[0.0, 0.0, -half], [0.0, 0.0, half]]])
    return vertices.astype(np.float32), np.vstack([*walls, *caps]).astype(np.int32)


def ball() -> Mesh:
    """A sphere of radius 0.8, by rings of latitude."""
    rings, around = 9, SIDES
    polar = np.linspace(0.0, np.pi, rings)[:, None]
    turn = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    grid = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar) + 0.0 * turn], axis=-1)
    index = np.arange(rings * around).reshape(rings, around)
    right = np.roll(index, -1, axis=1)
    corners = index[:-1], right[:-1], index[1:], right[1:]
    a, b, c, d = (corner.ravel() for corner in corners)
    faces = np.vstack([np.stack([a, c, d], axis=1), np.stack([a, d, b], axis=1)])
    return (0.8 * grid.reshape(-1, 3)).astype(np.float32), faces.astype(np.int32)


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
    vertices, faces = prism(4)
    quarter = np.pi / 4.0
    turn = np.array([[np.cos(quarter), -np.sin(quarter), 0], [np.sin(quarter), np.cos(quarter), 0], [0, 0, 1]])
    return (1.6 * (vertices * (np.sqrt(0.5), np.sqrt(0.5), 1.0)) @ turn.T).astype(np.float32), faces


SHAPES: dict[str, Callable[[], Mesh]] = {
    "revolute": ball,
    "prismatic": box,
    "universal": octahedron,
    "spherical": tetrahedron,
    "cylindrical": lambda: prism(6, 0.8),
    "fixed": lambda: prism(3, 0.8),
}
"""Shapes of joints, those of the markers in pictures: round, square, diamond, triangle, hexagon."""


def fan(corners: Floats) -> Mesh:
    """A face through corners (k, 3) in order, as triangles about their middle."""
    here = np.arange(len(corners))
    middle = np.full(len(corners), len(corners))
    vertices = np.vstack([corners, corners.mean(axis=0)]).astype(np.float32)
    return vertices, np.stack([here, np.roll(here, -1), middle], axis=1).astype(np.int32)


def upright_to(direction: Floats) -> Floats:
    """The quaternion of the shortest turn of the z axis to a direction of any length; none for no direction."""
    length = np.linalg.norm(direction)
    x, y, z = direction / length if length > 0.0 else (0.0, 0.0, 1.0)
    if z < -1.0 + 1e-9:
        return np.array([0.0, 1.0, 0.0, 0.0])
    turn = np.array([1.0 + z, -y, x, 0.0])
    return np.asarray(turn / np.linalg.norm(turn))


def quaternion(rotation: Floats) -> Any:
    """The quaternion of a rotation matrix (3, 3), scalar first."""
    squares = np.array(
        [
            1.0 + np.trace(rotation),
            *(1.0 + 2.0 * rotation[place, place] - np.trace(rotation) for place in range(3)),
        ]
    )
    largest = int(np.argmax(squares))
    w = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    if largest == 0:
        parts = np.array([squares[0], *w])
    else:
        place = largest - 1
        row = rotation[place] + rotation[:, place]
        row[place] = squares[largest]
        parts = np.array([w[place], *row])
    return parts / np.linalg.norm(parts)
