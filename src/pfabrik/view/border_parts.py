"""The border in a plane in segments of one group of limits each, divided where one limit takes over from another."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..common.arrays import Floats, Ints

if TYPE_CHECKING:
    from ..capabilities.workspace.region import Region

HALVINGS = 6
"""How often a segment is halved towards the point where one limit takes over from another."""

OUTWARD = (0.15, 0.5)
"""Distances outside the border where limits are asked for, the second where the first is still within, as a share of
the segment's length."""


class Patches(NamedTuple):
    """Segments of the border, each in one group of limits.

    Attributes
    ----------
    vertices : (v, 2) [length or rad].
    segments : (f, 2) places of vertices, as those of a workspace.
    groups : of each segment, (f,).
    """

    vertices: Floats
    segments: Ints
    groups: Ints


def patches_of(region: Region, group_of_limit: Ints) -> Patches:
    """Divide the segments of a border whose two ends are of different groups.

    Parameters
    ----------
    group_of_limit : the group of each of the region's limits, (n,).
    """
    vertices, groups = region.vertices, group_of_limit[region.vertex_limit][region.faces]
    is_mixed = groups[:, 0] != groups[:, 1]
    whole, divided = region.faces[~is_mixed], region.faces[is_mixed]
    ends = vertices[divided]
    shares = _changes(region, ends, groups[is_mixed], group_of_limit, _outward(region)[divided].sum(axis=1))
    between = len(vertices) + np.arange(len(divided))
    pieces = np.stack([divided[:, 0], between, between, divided[:, 1]], axis=1).reshape(-1, 2)
    return Patches(
        np.concatenate([vertices, ends[:, 0] + shares[:, None] * (ends[:, 1] - ends[:, 0])]),
        np.concatenate([whole, pieces]),
        np.concatenate([groups[~is_mixed, 0], groups[is_mixed].ravel()]),
    )


def _changes(region: Region, ends: Floats, groups: Ints, group_of_limit: Ints, outward: Floats) -> Floats:
    """Where on segments (e, 2, 2) the first of their groups (e, 2) gives way to the second, shares (e,) of the way."""
    shares = np.full(len(ends), 0.5)
    if not region._question.has_margins:
        return shares
    first, along = ends[:, 0], ends[:, 1] - ends[:, 0]
    lengths = np.linalg.norm(along / region.resolution, axis=1, keepdims=True)
    outward = outward * lengths / np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-300) * region.resolution
    low, high, rows = np.zeros(len(ends)), np.ones(len(ends)), np.arange(len(ends))
    for _ in range(HALVINGS):
        found = np.full(len(rows), -1)
        for far in OUTWARD:
            open_ = np.flatnonzero(found < 0)
            at = rows[open_]
            margins, bindings = region._question.measure(first[at] + shares[at, None] * along[at] + far * outward[at])
            beyond = margins < 0.0
            found[open_[beyond]] = group_of_limit[bindings[beyond]]
        is_first, is_last = found == groups[rows, 0], found == groups[rows, 1]
        low[rows[is_first]], high[rows[is_last]] = shares[rows[is_first]], shares[rows[is_last]]
        rows = rows[is_first | is_last]  # a third limit may form the border between them
        shares[rows] = 0.5 * (low + high)[rows]
    return shares


def _outward(region: Region) -> Floats:
    """The sums of the outward normals of both segments at each vertex, (v, 2) [cells]."""
    along = np.diff(region.vertices[region.faces], axis=1)[:, 0] / region.resolution
    around = np.zeros_like(region.vertices)
    np.add.at(around, region.faces.ravel(), np.repeat(along[:, ::-1] * (1.0, -1.0), 2, axis=0))
    return around
