"""The border in patches, one for each group of limits, divided where one limit takes over from another."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..arrays import Floats, Ints

if TYPE_CHECKING:
    from ..workspace.region import Region

HALVINGS = 6
"""How often an edge is halved towards the point where one limit takes over from another."""

OUTWARD = (0.15, 0.5)
"""Distances outside the border where limits are asked for, the second where the first is still within, as a share of
the edge's length."""


class Patches(NamedTuple):
    """Faces of the border, each in one group of limits.

    Attributes
    ----------
    vertices : (v, d) [length or rad].
    faces : (f, d) places of vertices, as those of a workspace.
    groups : of each face, (f,).
    """

    vertices: Floats
    faces: Ints
    groups: Ints


def patches_of(region: Region, vertices: Floats, faces: Ints, groups: Ints, group_of_limit: Ints) -> Patches:
    """Divide the faces of a mesh whose vertices are of different groups, (v,), where one takes over from the other.

    Parameters
    ----------
    group_of_limit : the group of each of the region's limits, (n,).
    """
    d = faces.shape[1]
    mixed = (groups[faces] != groups[faces[:, :1]]).any(axis=1)
    whole, divided = faces[~mixed], faces[mixed]
    sides = np.sort(np.concatenate([divided[:, (k, (k + 1) % d)] for k in range(d)]), axis=1)
    edges = np.unique(sides[groups[sides[:, 0]] != groups[sides[:, 1]]], axis=0)
    if not len(edges):
        return Patches(vertices, faces, groups[faces[:, 0]])
    normals = vertex_normals(vertices / region.resolution, faces)
    shares = _changes(region, vertices, edges, groups, group_of_limit, normals)
    points = vertices[edges[:, 0]] + shares[:, None] * (vertices[edges[:, 1]] - vertices[edges[:, 0]])
    place = {pair: len(vertices) + row for row, pair in enumerate(map(tuple, edges.tolist()))}
    middles = vertices[divided].mean(axis=1)
    new: list[list[int]] = []
    for row, face in enumerate(divided.tolist()):
        new += _pieces(face, groups, place, len(vertices) + len(points) + row)
    everything = np.concatenate([vertices, points, middles])
    pieces = np.array(new, np.int64)
    pieces, of_pieces = pieces[:, 1:], groups[pieces[:, 0]]
    return Patches(everything, np.concatenate([whole, pieces]), np.concatenate([groups[whole[:, 0]], of_pieces]))


def _pieces(face: list[int], groups: Ints, place: dict[tuple[int, int], int], middle: int) -> list[list[int]]:
    """The pieces of one face, each with a vertex of its group before its corners."""
    d = len(face)
    points = [place.get((min(pair), max(pair))) for pair in zip(face, (*face[1:], face[0]), strict=True)]
    if d == 2:
        (a, b), point = face, points[0]
        return [[a, a, int(point or 0)], [b, int(point or 0), b]]
    if None not in points:
        ends = [int(point or 0) for point in points]
        return [
            piece
            for k, corner in enumerate(face)
            for piece in ([corner, corner, ends[k], middle], [corner, corner, middle, ends[k - 1]])
        ]
    k = points.index(None)  # the side of two corners of one group; the corner across is alone
    alone, b, c = (face[(k + step) % 3] for step in (2, 0, 1))
    before, after = int(points[(k + 2) % 3] or 0), int(points[(k + 1) % 3] or 0)
    return [[alone, alone, before, after], [b, before, b, c], [b, before, c, after]]


def _changes(
    region: Region, vertices: Floats, edges: Ints, groups: Ints, group_of_limit: Ints, normals: Floats
) -> Floats:
    """Where on edges (e, 2) the group of their first end gives way to that of their second, shares (e,) of the way."""
    shares = np.full(len(edges), 0.5)
    if not region._question.has_margins:
        return shares
    first, last = vertices[edges[:, 0]], vertices[edges[:, 1]]
    lengths = np.linalg.norm((last - first) / region.resolution, axis=1, keepdims=True)
    outward = normals[edges].sum(axis=1)
    outward *= lengths / np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-300) * region.resolution
    low, high = np.zeros(len(edges)), np.ones(len(edges))
    rows = np.arange(len(edges))
    for _ in range(HALVINGS):
        found = np.full(len(rows), -1)
        for far in OUTWARD:
            open_ = np.flatnonzero(found < 0)
            at = rows[open_]
            points = first[at] + shares[at, None] * (last - first)[at] + far * outward[at]
            margins, bindings = region._question.measure(points)
            beyond = margins < 0.0
            found[open_[beyond]] = group_of_limit[bindings[beyond]]
        is_first, is_last = found == groups[edges[rows, 0]], found == groups[edges[rows, 1]]
        low[rows[is_first]], high[rows[is_last]] = shares[rows[is_first]], shares[rows[is_last]]
        rows = rows[is_first | is_last]  # a third limit may form the border between them
        shares[rows] = 0.5 * (low + high)[rows]
    return shares


def vertex_normals(vertices: Floats, faces: Ints) -> Floats:
    """Sums of the outward normals of the faces around each vertex, (v, d)."""
    corners = vertices[faces]
    if faces.shape[1] == 2:
        along = corners[:, 1] - corners[:, 0]
        of_faces = np.column_stack([along[:, 1], -along[:, 0]])
    else:
        of_faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    around = np.zeros_like(vertices)
    for corner in faces.T:
        np.add.at(around, corner, of_faces)
    return around
