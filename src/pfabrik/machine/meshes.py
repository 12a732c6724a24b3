"""Convex hulls of mesh files: polyhedra of few vertices that enclose all of a mesh."""

from __future__ import annotations

import os
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ..common.arrays import Floats, Ints
from ..common.extras import require

LARGEST_FILE = 50_000_000
"""Largest mesh file read [bytes]: a million triangles, whose hull takes some ten seconds if all are on it."""

MOST_VERTICES = 128
"""Most vertices of a hull. Round parts have more; a ball becomes 3 % of its radius larger."""

AT_ONCE = 256
"""Vertices that are measured again at once while some are chosen."""

FLAT = 1e-6
"""Thickness of a mesh, relative to half its length, up to which it counts as flat: files have six digits or so."""


class UnusableMesh(Exception):
    """A file that gives no hull: what was found, and what was expected."""

    def __init__(self, found: str, expected: str) -> None:
        super().__init__(found)
        self.found, self.expected = found, expected


class MeshHull(NamedTuple):
    """A convex polyhedron in the frame of its file, in the file's unit, turned outward.

    Attributes
    ----------
    vertices : (v, 3); triangles : indices of three each, (t, 3), for pictures.
    margin : the mesh is within so much of the polyhedron, 0 where no vertex of its hull is left out.
    """

    vertices: Floats
    triangles: Ints
    margin: float


def hull_of(file: str) -> MeshHull:
    """The convex hull of all vertices of a mesh file.

    Raises
    ------
    UnusableMesh : the file has no hull.
    MissingLibrary : the libraries that read files and make hulls are not installed.
    """
    require("meshes", "trimesh", "collide")
    require("meshes", "scipy", "collide")
    if not os.path.exists(file):
        raise UnusableMesh(f"'{file}': no such file", "a mesh file, such as STL, OBJ or PLY")
    if not os.path.isfile(file):
        raise UnusableMesh(f"'{file}', which is no file", "a mesh file, such as STL, OBJ or PLY")
    status = os.stat(file)
    if status.st_size > LARGEST_FILE:
        raise UnusableMesh(f"'{file}' with {status.st_size} bytes", f"a mesh file of at most {LARGEST_FILE}")
    return _hull_of(file, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=256)
def _hull_of(file: str, changed: int, size: int) -> MeshHull:
    """The hull of a file as it is at a time."""
    points = _read(file)
    if len(points) < 4 or not np.isfinite(points).all():
        raise UnusableMesh(f"'{file}', in which no mesh was found", "a mesh file, such as STL, OBJ or PLY")
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    length = float(np.abs(points - middle).max())
    scaled = (points - middle) / (length or 1.0)
    hull = _enclosing(scaled) if length > 0.0 else None
    if hull is None:
        raise UnusableMesh(f"'{file}', a flat mesh", "a mesh with a thickness")
    return hull._replace(vertices=hull.vertices * length + middle, margin=hull.margin * length)


def _read(file: str) -> Floats:
    """The vertices of a mesh file, (n, 3); none where it cannot be read."""
    import trimesh

    try:
        mesh: Any = trimesh.load(file, force="mesh", process=False)
        return np.array(mesh.vertices, float).reshape(-1, 3)
    except Exception:  # a reader of many formats meets broken files with errors of any kind
        return np.empty((0, 3))


def _enclosing(points: Floats) -> MeshHull | None:
    """The hull of points; of too many vertices, that of some, with a margin that encloses the others; None if flat.

    Each vertex that is added is the one that is farthest beyond a face of those before.
    """
    from scipy.spatial import QhullError

    try:
        points = points[_qhull(points).vertices]
    except QhullError:
        return None
    _, _, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    if not np.ptp(points @ axes.T, axis=0).min() > FLAT:
        return None
    if len(points) <= MOST_VERTICES:
        return _polyhedron(points, 0.0)
    few = points[_chosen(points)]
    return _polyhedron(few, _distance_beyond(points, _polyhedron(few, 0.0)))


def _chosen(points: Floats) -> list[int]:
    """Indices of vertices whose hull is nearly that of all: each time the one that is farthest beyond a face of those
    before.

    The more vertices, the less the others are beyond: what was measured before bounds it, and most need not be measured
    again.
    """
    chosen = [int(k) for k in dict.fromkeys([*points.argmin(axis=0), *points.argmax(axis=0)])]
    while (farthest := _out_of_plane(points, points[chosen])) is not None:
        chosen.append(farthest)
    beyond = _beyond(points, _qhull(points[chosen]).equations)
    while len(chosen) < MOST_VERTICES:
        chosen.append(int(beyond.argmax()))
        planes, measured = _qhull(points[chosen]).equations, np.zeros(len(points), bool)
        count = min(AT_ONCE, len(points))
        while not measured[beyond.argmax()]:
            first = np.argpartition(beyond, -count)[-count:]
            beyond[first], measured[first] = _beyond(points[first], planes), True
    return chosen


def _out_of_plane(points: Floats, few: Floats) -> int | None:
    """The point that is farthest from the line or plane of some; None if they are in none."""
    rows = few - few.mean(axis=0)
    _, squares, axes = np.linalg.svd(rows.T @ rows)
    rank = int((squares > FLAT**2).sum())
    if rank == 3:
        return None
    return int(np.argmax(np.linalg.norm((points - few.mean(axis=0)) @ axes[rank:].T, axis=1)))


def _beyond(points: Floats, planes: Floats) -> Floats:
    """How far points are beyond the plane that they are farthest beyond, (n,); planes as (p, 4)."""
    beyond = np.full(len(points), -np.inf)
    for plane in planes:
        np.maximum(beyond, points @ plane[:3] + plane[3], out=beyond)
    return beyond


def _distance_beyond(points: Floats, hull: MeshHull) -> float:
    """The largest distance of points from a polyhedron, and a little for rounding."""
    from ..kernels.clearance.least_clearance import least_clearance

    sizes = np.zeros((2, len(sizes_of(hull, 1.0))))
    sizes[0] = sizes_of(hull, 1.0)
    places = np.zeros((len(points), 2, 4, 3))
    places[:, 0, 0], places[:, 0, 1:] = middle_of(hull), np.eye(3)
    places[:, 1, 0] = places[:, 1, 1] = points
    distances, nearest = np.full(len(points), np.inf), np.full(len(points), -1)
    least_clearance(sizes, places, np.array([[0, 1]]), 0, distances, nearest, np.empty((len(points), 2, 3)))
    return max(0.0, float(distances.max())) + 1e-12


def _polyhedron(points: Floats, margin: float) -> MeshHull:
    """The polyhedron of points that are all vertices."""
    hull = _qhull(points)
    a, b, c = np.moveaxis(hull.points[hull.simplices], 1, 0)
    is_inward = np.einsum("ni,ni->n", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
    triangles = np.where(is_inward[:, None], hull.simplices[:, ::-1], hull.simplices)
    return MeshHull(hull.points, triangles.astype(np.int64), margin)


def _qhull(points: Floats) -> Any:
    from scipy.spatial import ConvexHull

    return ConvexHull(points)


def middle_of(hull: MeshHull) -> Floats:
    """The middle of the box around a hull, (3,)."""
    middle: Floats = 0.5 * (hull.vertices.min(axis=0) + hull.vertices.max(axis=0))
    return middle


def sizes_of(hull: MeshHull, scale: float) -> Floats:
    """A hull as a row of sizes, its vertices counted from its middle; see `kernels.clearance.solids`."""
    from ..kernels.clearance.solids import HULL

    vertices = scale * (hull.vertices - middle_of(hull))
    reach = np.linalg.norm(vertices, axis=1).max()
    return np.concatenate([[HULL, scale * hull.margin, len(vertices), reach, 0.0], vertices.ravel()])
