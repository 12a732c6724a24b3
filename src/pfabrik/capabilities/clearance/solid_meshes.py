"""Links as triangles, for pictures and the viewer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...answers.solution import Solution
from ...common.arrays import Floats, Ints
from ...kinematics import links_of
from ...machine.description.links import hulls_of
from ...machine.description.mechanism import Mechanism, Shape
from ...machine.meshes import MeshHull, middle_of
from ...tolerances import TOLERANCES
from .clearance import clearance, placed_links

AROUND, TO_POLE = 16, 4
"""Corners around a capsule or a disc, and rings from its edge to its pole."""


@dataclass(frozen=True)
class SolidMesh:
    """A shape of a body where it is, as triangles.

    Attributes
    ----------
    vertices : (k, 3) [length]; faces : indices of three each, (m, 3).
    is_nearest : True for the two links that are nearest to each other.
    is_stopped : True where these two are at the clearance or nearer; without a clearance, where they overlap.
    """

    body: str
    vertices: Floats
    faces: Ints
    is_nearest: bool = False
    is_stopped: bool = False


def solids_of(mechanism: Mechanism, solution: Solution | None) -> tuple[SolidMesh, ...]:
    """The shapes of a mechanism at home, or of one answer, the nearest two marked."""
    links, hulls = links_of(mechanism), hulls_of(mechanism)
    places = links.places if solution is None else placed_links(solution).places(slice(None))[0]
    nearest: list[int] = []
    is_stopped = False
    if solution is not None and len(links.pairs):
        measured = clearance(solution)
        nearest = links.pairs[int(measured._nearest[0])].tolist()
        near = TOLERANCES.active * mechanism.characteristic_length if mechanism.clearance is not None else 0.0
        is_stopped = float(measured.distance) < (mechanism.clearance or 0.0) + near
    return tuple(
        SolidMesh(shape.body, *mesh_of(shape, place, hulls.get(k)), k in nearest, is_stopped and k in nearest)
        for k, (shape, place) in enumerate(zip(mechanism.shapes, places, strict=True))
    )


def mesh_of(shape: Shape, place: Floats, hull: MeshHull | None) -> tuple[Floats, Ints]:
    """Vertices and faces of a shape; `place` as in `kernels.clearance.solids`, (4, 3); the hull of a mesh."""
    if shape.kind == "box":
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
        return place[0] + 0.5 * signs * np.array(shape.size) @ place[1:], BOX_FACES
    if shape.kind == "disc":
        radius, half = 0.5 * (shape.diameter or 0.0), 0.5 * shape.thickness
        return _turned(place[0], place[1], np.array([[-half, 0], [-half, radius], [half, radius], [half, 0]]))
    if hull is not None:
        return place[0] + (shape.scale or 1.0) * (hull.vertices - middle_of(hull)) @ place[1:], hull.triangles
    radius = 0.5 * (shape.thickness if shape.kind == "capsule" else shape.diameter or 0.0)
    line = place[1] - place[0]
    length = float(np.linalg.norm(line))
    axis = line / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    angles = np.linspace(0.0, 0.5 * np.pi, TO_POLE + 1)
    cap = radius * np.stack([np.sin(angles), np.cos(angles)], axis=1)
    return _turned(place[0], axis, np.vstack([(cap * [-1, 1])[::-1], cap + [length, 0]]))


def _turned(origin: Floats, axis: Floats, profile: Floats) -> tuple[Floats, Ints]:
    """A profile (k, 2) of heights and radii, turned about an axis."""
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    across /= np.linalg.norm(across)
    angles = np.arange(AROUND) * (2.0 * np.pi / AROUND)
    around = np.cos(angles)[:, None] * across + np.sin(angles)[:, None] * np.cross(axis, across)
    vertices = origin + profile[:, None, :1] * axis + profile[:, None, 1:] * around
    at = np.arange(len(profile) - 1)[:, None] * AROUND
    here, after = np.arange(AROUND), (np.arange(AROUND) + 1) % AROUND
    one = np.stack(np.broadcast_arrays(at + here, at + after, at + AROUND + after), axis=-1)
    two = np.stack(np.broadcast_arrays(at + here, at + AROUND + after, at + AROUND + here), axis=-1)
    return vertices.reshape(-1, 3), np.concatenate([one, two]).reshape(-1, 3)


def _box_faces() -> Ints:
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


BOX_FACES = _box_faces()
"""The twelve triangles of a box, turned outward, of corners in the order of their signs."""
