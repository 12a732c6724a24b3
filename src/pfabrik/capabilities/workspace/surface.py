"""A closed mesh of the border, by marching cubes (in the plane: squares).

The border crosses each side of a cube in segments, which the four corners of that side decide alone. Those of all six
sides make loops, and the loops are filled with triangles. So cubes agree on what they share, and the mesh is closed:
each edge of it is in exactly two triangles, once in each direction.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple, TypeAlias

import numpy as np

from ...common.arrays import Floats, Ints, Mask
from .lattice_points import Lattice
from .refining import Cells
from .verdicts import MapQuestion

CLOSE, CLOSE_ONE_BY_ONE = 1e-3, 1e-2
"""Accuracy of vertices, where closed forms give margins and elsewhere [steps of the lattice]."""

STEEPEST = 5.0
"""Slope of a face to its neighbour beyond which a corner is no longer taken to be longer."""

LEAST_WIDTH = 0.05
"""Width of a face below which its direction is uncertain, so that it tells less of how the border bends [cells]."""

TINY = 1e-300

Edge: TypeAlias = tuple[int, int]
Face: TypeAlias = tuple[Edge, ...]


class BorderMesh(NamedTuple):
    """A closed mesh: triangles that turn right-handed as seen from outside; segments with the inside on their left.

    Attributes
    ----------
    vertices : (v, d), just inside the border.
    faces : (f, d) places of vertices.
    limits : which limit forms the border at each vertex, (v,).
    inner : numbers of the lattice points within reach that vertices are beside, (v,).
    """

    vertices: Floats
    faces: Ints
    limits: Ints
    inner: Ints

    @property
    def size(self) -> float:
        """The area or volume that it encloses."""
        return float(self.shares.sum())

    @property
    def shares(self) -> Floats:
        """The contribution of each face to the area or volume enclosed, (f,)."""
        if not len(self.faces):
            return np.zeros(0)
        ends = (self.vertices - self.vertices.mean(axis=0))[self.faces]
        if self.vertices.shape[1] == 2:
            return np.asarray(0.5 * (ends[:, 0, 0] * ends[:, 1, 1] - ends[:, 0, 1] * ends[:, 1, 0]))
        return np.asarray(np.einsum("fi,fi->f", ends[:, 0], np.cross(ends[:, 1], ends[:, 2])) / 6.0)

    @property
    def face_sizes(self) -> Floats:
        """Length or area of each face, (f,)."""
        return sizes_of(self.vertices[self.faces])

    def error(self, step: Floats, close: float) -> float:
        """The most that `size` may be off, for a border whose features are as large as cells, (d,), or larger.

        Between its vertices, a border that bends one way is on the outer side of each face and on the inner sides of
        its neighbours, extended: in a plane, within a triangle on the segment of length l with base angles t1 and t2,
        whose area is at most l² (tan t1 + tan t2) / 8. In space this is integrated along the edges of triangles, whose
        width falls to 0 beside an edge. Vertices are up to `close` of a cell too far inside.
        """
        if not len(self.faces):
            return 0.0
        d, scaled = len(step), self._replace(vertices=self.vertices / step)
        ends, places = scaled.vertices[self.faces], np.arange(d)
        normals = (ends[:, 1] - ends[:, 0])[:, ::-1] * (1.0, -1.0) if d == 2 else face_normals(ends)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), TINY)
        sides = np.sort(np.stack([self.faces[:, np.roll(places, -k)[: d - 1]] for k in places], axis=1), axis=2)
        order = np.lexsort(sides.reshape(-1, d - 1).T).reshape(-1, 2)  # both faces beside each edge
        cosines = np.einsum("ei,ei->e", *normals[order.T // d])
        slopes = np.minimum(np.sqrt(np.maximum(1.0 - cosines**2, 0.0)) / np.maximum(cosines, TINY), STEEPEST)
        lengths = np.ones((len(sides), d))
        if d == 3:
            lengths = np.linalg.norm(scaled.vertices[sides[..., 0]] - scaled.vertices[sides[..., 1]], axis=2)
        widths = ((d - 1) * scaled.face_sizes[:, None] / np.maximum(lengths, TINY)).ravel()[order]
        squares = (widths**2 * np.minimum(widths[:, ::-1] / LEAST_WIDTH, 1.0)).sum(axis=1)
        bent = lengths.ravel()[order[:, 0]] @ (slopes * squares) / (4.0 * d)
        return float((bent + close * scaled.face_sizes.sum()) * np.prod(step))

    def among(self, chosen: Mask) -> BorderMesh:
        """The faces all of whose vertices, (v,), are chosen, and these alone."""
        faces = self.faces[chosen[self.faces].all(axis=1)]
        used = np.zeros(len(self.vertices), bool)
        used[faces] = True
        place = np.cumsum(used) - 1
        return BorderMesh(self.vertices[used], place[faces], self.limits[used], self.inner[used])


def face_normals(corners: Floats) -> Floats:
    """Normals (f, 3) of triangles with corners (f, 3, 3), each as long as twice the area."""
    return np.asarray(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))


def sizes_of(corners: Floats) -> Floats:
    """Areas (f,) of triangles with corners (f, 3, 3), or lengths of segments with ends (f, 2, 2)."""
    if corners.shape[1] == 2:
        return np.asarray(np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1))
    return np.asarray(0.5 * np.linalg.norm(face_normals(corners), axis=1))


def mesh_of(lattice: Lattice, cells: Cells) -> BorderMesh:
    """The mesh of the border through cells that it does not leave."""
    ends, faces = crossed_edges(cells, len(lattice.points))
    vertices, limits, inner = _vertices(lattice, ends, faces)
    return BorderMesh(vertices, faces, limits, inner)


def crossed_edges(cells: Cells, n: int) -> tuple[Ints, Ints]:
    """The ends (2, e), lower and upper, of edges that the border crosses, and its faces (f, d) between those.

    Parameters
    ----------
    n : how many points have numbers.
    """
    d = cells.corners.shape[1].bit_length() - 1
    case = (cells.margins >= 0.0) @ (1 << np.arange(2**d))
    order = np.argsort(case.astype(np.uint8), kind="stable")
    starts = np.searchsorted(case[order], np.arange(2 ** (2**d) + 1))
    upper = np.full(n * d, -1)  # by the lower end of an edge, and its axis
    edges = [np.zeros((0, d), np.int64)]
    for which in np.flatnonzero(np.diff(starts)).tolist():
        numbers = cells.corners[order[starts[which] : starts[which + 1]]]
        for face in _faces(which, d):
            edge = np.stack([numbers[:, a] * d + (a ^ b).bit_length() - 1 for a, b in face], axis=1)
            upper[edge] = numbers[:, [b for _, b in face]]
            edges.append(edge)
    distinct = np.flatnonzero(upper >= 0)
    place = np.empty(n * d, np.int64)
    place[distinct] = np.arange(len(distinct))
    return np.stack([distinct // d, upper[distinct]]), place[np.concatenate(edges)]


@lru_cache(maxsize=512)
def _faces(case: int, d: int) -> tuple[Face, ...]:
    """The faces that the border has in a cell: each by the edges, from lower to higher corner, that it has vertices on.

    Parameters
    ----------
    case : bit k says whether corner k is within.
    """
    if d == 2:
        return tuple(_segments(case, (0, 2, 3, 1)))
    following = dict(segment for side in _SIDES for segment in _segments(case, side))
    faces: list[Face] = []
    while following:
        first, after = following.popitem()
        loop = [first]
        while after != first:
            loop.append(after)
            after = following.pop(after)
        faces += [(loop[0], *pair) for pair in pairwise(loop[1:])]
    return tuple(faces)


_SIDES = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
"""The corners of each side of a cube, in turn, right-handed as seen from outside."""


def _segments(case: int, side: Sequence[int]) -> Iterator[tuple[Edge, Edge]]:
    """The segments of the border in a square, given by its corners in turn, from edge to edge, the inside on the left.

    Where opposite corners are within, they are kept apart, so that both cells of a square agree.
    """
    within = [bool(case >> corner & 1) for corner in side]
    edges = [(min(pair), max(pair)) for pair in zip(side, (*side[1:], side[0]), strict=True)]
    for k in range(4):
        if within[k] and not within[k - 1]:  # comes in by the edge before corner k, and leaves by the next way out
            leaving = next(m for m in range(k, k + 4) if not within[(m + 1) % 4])
            yield edges[leaving % 4], edges[k - 1]


def closeness(question: MapQuestion) -> float:
    """Largest distance of vertices inside the border [cells]."""
    return CLOSE if question.has_margins else CLOSE_ONE_BY_ONE


def _vertices(lattice: Lattice, ends: Ints, faces: Ints) -> tuple[Floats, Ints, Ints]:
    """The crossings of the border with edges, their limits, and the ends within; (e, ...) each."""
    sides = np.concatenate([faces[:, (k, (k + 1) % faces.shape[1])] for k in range(faces.shape[1])])
    within, every = (lattice.margins[ends[1]] >= 0.0).astype(np.int64), np.arange(ends.shape[1])
    inner = ends[within, every]
    close = closeness(lattice.measure.question)
    points, limits = lattice.crossings(np.stack([inner, ends[1 - within, every]]), sides, close)
    return points, limits, inner
