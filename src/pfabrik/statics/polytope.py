"""Polytopes: half-spaces of a sum of segments, and vertices in two or three dimensions."""

from __future__ import annotations

from itertools import combinations
from math import comb

import numpy as np

from ..arrays import Floats
from ..tolerances import TOLERANCES

MOST_FACETS = 20_000
"""Most pairs of half-spaces of one sum: beyond, the numbers no longer say anything to anyone."""

FAR = 1e6
"""Size of the box that vertices are cut from, in units of the largest offset: farther ones count as at infinity."""


def n_facets(generators: int, dimension: int) -> int:
    """Pairs of half-spaces of a sum of so many segments."""
    return comb(generators, dimension - 1)


def sum_of_segments(generators: Floats, bounds: Floats) -> tuple[Floats, Floats]:
    """Half-spaces normals . x <= offsets of all x = sum t_i g_i with t_i within bounds.

    A facet is spanned by d - 1 of the generators. Its offset is the largest normal . x, infinite if a bound is.

    Parameters
    ----------
    generators : g, (n, k, d).
    bounds : lowest and highest t, (k, 2).

    Returns
    -------
    Normals (n, h, d) and offsets (n, h), which are infinite too where d - 1 generators span less.
    """
    n, k, d = generators.shape
    chosen = np.array(list(combinations(range(k), d - 1)), np.intp).reshape(-1, d - 1)
    spans = generators[:, chosen]
    if d > 1:
        _, sizes, right = np.linalg.svd(spans)
        normals, is_facet = right[..., -1, :], sizes[..., -1] > TOLERANCES.rank
    else:
        normals, is_facet = np.ones((n, 1, 1)), np.ones((n, 1), bool)
    normals = np.concatenate([normals, -normals], axis=1)
    along = np.einsum("nhd,nkd->nhk", normals, generators)
    along[np.abs(along) <= TOLERANCES.rank] = 0.0
    ends = np.where(along == 0.0, 0.0, np.where(along > 0.0, bounds[:, 1], bounds[:, 0]))
    offsets = np.einsum("nhk,nhk->nh", along, ends)
    return normals, np.where(np.tile(is_facet, 2), offsets, np.inf)


def vertices_of(normals: Floats, offsets: Floats) -> Floats:
    """Vertices (v, d) of the half-spaces normals . x <= offsets, (h, d) and (h,), with d <= 3.

    In the space that the normals span: what they do not bound is left at 0. None if the half-spaces have no point in
    common. A box is cut by one half-space after the other: new vertices are where it meets the edges, which join
    vertices with d - 1 half-spaces in common.
    """
    sizes = np.linalg.norm(normals, axis=1)
    is_plane = np.isfinite(offsets) & (sizes > TOLERANCES.rank * sizes.max(initial=0.0))
    if (offsets[sizes == 0.0] < 0.0).any():
        return np.zeros((0, normals.shape[1]))
    normals, offsets = normals[is_plane] / sizes[is_plane, None], offsets[is_plane] / sizes[is_plane]
    _, values, right = np.linalg.svd(normals)
    basis = right[: int((values > TOLERANCES.alignment).sum())]
    d, scale = len(basis), np.abs(offsets).max(initial=0.0)
    if d == 0 or scale == 0.0:
        return np.zeros((1 if d == 0 or len(offsets) else 0, normals.shape[1]))
    box = np.vstack([np.eye(d), -np.eye(d)])
    planes = np.vstack([box, normals @ basis.T])
    ends = np.concatenate([np.full(2 * d, FAR), offsets / scale])
    corners = np.array(np.meshgrid(*[[-FAR, FAR]] * d)).reshape(d, -1).T
    active = np.zeros((len(corners), len(planes)), bool)
    active[:, : 2 * d] = np.abs(corners @ box.T - FAR) < 0.5 * FAR
    for place in range(2 * d, len(planes)):
        corners, active = _cut(corners, active, planes, ends, place)
    is_near = ~active[:, : 2 * d].any(axis=1)
    return np.asarray(corners[is_near] @ basis * scale)


def _cut(corners: Floats, active: np.ndarray, planes: Floats, ends: Floats, place: int) -> tuple[Floats, np.ndarray]:
    """Cut a polytope by a half-space: its vertices (v, d), and the half-spaces that each is on, (v, h)."""
    d = planes.shape[1]
    beyond = corners @ planes[place] - ends[place]
    near = TOLERANCES.rank * np.maximum(1.0, np.abs(corners).max(axis=1, initial=0.0))
    active[:, place] = np.abs(beyond) <= near
    if (beyond <= near).all():
        return corners, active
    outer, inner = np.flatnonzero(beyond > near), np.flatnonzero(beyond < -near)
    shared = active[outer][:, None] & active[inner][None]
    first, second = np.nonzero(shared.sum(axis=-1) >= d - 1)
    on = shared[first, second]
    on[:, place] = True
    is_vertex = (
        np.linalg.matrix_rank(on[..., None] * planes, tol=TOLERANCES.alignment) == d if len(on) else np.zeros(0, bool)
    )
    on = np.unique(on[is_vertex], axis=0)
    met = np.array([np.linalg.lstsq(planes[row], ends[row], rcond=None)[0] for row in on]).reshape(-1, d)
    keeps = beyond <= near
    return np.vstack([corners[keeps], met]), np.vstack([active[keeps], on])
