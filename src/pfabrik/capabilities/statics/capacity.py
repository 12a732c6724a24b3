"""What a machine can hold: polytopes of wrenches by the limits of its actuators."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations
from math import comb
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...answers.solution import Solution, checked_solution
from ...common.arguments import any_values, array
from ...common.arrays import Floats, shaped
from ...common.checks import require_choice
from ...common.printed import Printed, ResultTable, plain, spanned
from ...errors import InvalidArgument, UnsupportedMechanism
from ...kinematics import actuator_units
from ...tolerances import TOLERANCES
from .joint_balance import pairs_of
from .loads import Bounds, Reasons, asked_of, bounds_of, has_reason, in_shape, reasons_in_words
from .transmission import Maps, is_redundantly_actuated, maps_of, twist_units

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


ROWS_A_BLOCK = 128
PARTS = {"force": slice(0, 3), "moment": slice(3, 6), "wrench": slice(0, 6)}


@dataclass(frozen=True, eq=False)
class WrenchCapacity(Printed):
    """The loads that a machine's actuators can hold within their limits, as `wrench_capacity` returns it.

    x is what acts in addition to the given wrench: a force (d = 3), a moment (3) or a wrench (6), in the base frame.

    Attributes
    ----------
    of : {"force", "moment", "wrench"}
        What varies.
    normals : array (..., h, d)
        Normals of the half-spaces normals . x <= offsets.
    offsets : array (..., h)
        Their offsets; an infinite one bounds nothing. Directions in which the loops hold the end effector without its
        actuators are bounded by none.
    radius : float or array (...)
        Size of the largest x that can be held in any direction, the largest ball about 0: of a force or a moment; of a
        wrench, of a force, with moments divided by L. Negative where the given wrench itself is too much.
    weakest : array (..., d)
        The direction in which no more can be held, a unit vector.
    reason : str or array of str (...)
        Why nothing is known, with NaN in the numbers; empty elsewhere. A text for a single answer.
    """

    of: Literal["force", "moment", "wrench"]
    normals: Floats
    offsets: Floats
    radius: float | Floats
    weakest: Floats
    reason: str | Reasons
    _shape: tuple[int, ...] = field(repr=False)

    def table(self) -> ResultTable:
        """What can be held in any direction, and for a single answer the weakest direction; of a batch, the range."""
        rows = [(f"{self.of} in any direction", spanned(np.ravel(self.radius)))]
        if not self._shape:
            rows.append(("weakest direction", "  ".join(plain(part, 1e-9) for part in self.weakest.tolist())))
        return ResultTable("Wrench capacity", reasons_in_words(self.reason, "nothing known"), ("holds", ""), rows)

    @property
    def vertices(self) -> Floats | list[Floats]:
        """The vertices of the polytope, (v, 3) for a single answer; for a batch a list of such arrays, in row order.

        In directions that nothing bounds they are at 0, and those at infinity are left out. None where nothing can be
        held, or the reason says why not.

        Raises
        ------
        InvalidArgument
            For wrenches, which have six dimensions.
        """
        if self.of == "wrench":
            raise InvalidArgument(
                "of", "'wrench'", "'force' or 'moment', for vertices: use the half-spaces of wrenches"
            )
        planes, ends = (
            self.normals.reshape(-1, *self.normals.shape[-2:]),
            self.offsets.reshape(-1, self.offsets.shape[-1]),
        )
        found = [
            np.zeros((0, 3)) if np.isnan(end).any() else vertices_of(plane, end)
            for plane, end in zip(planes, ends, strict=True)
        ]
        return found[0] if self._shape == () else found

    def holds(self, load: ArrayLike) -> bool | NDArray[np.bool_]:
        """True where loads x, (..., d), can be held; batches go together as NumPy broadcasts."""
        dimension = self.normals.shape[-1]
        x = array("load", load, f"... {dimension}", f"numbers, a {self.of}", holds=any_values)
        values = np.einsum("...hd,...d->...h", self.normals, x)
        sizes = np.abs(np.where(np.isfinite(self.offsets), self.offsets, 0.0))
        kept = (values <= self.offsets + TOLERANCES.rank * sizes.max(axis=-1, keepdims=True, initial=0.0)).all(axis=-1)
        return bool(kept) if kept.ndim == 0 else kept


def wrench_capacity(
    solution: Solution,
    limits: Bounds,
    *,
    of: Literal["force", "moment", "wrench"] = "force",
    wrench: ArrayLike | None = None,
    at: ArrayLike | None = None,
) -> WrenchCapacity:
    """The forces, moments or wrenches on the end effector that actuators within their limits can hold.

    With t = -F' w, each limit of an actuator is a half-space of wrenches w. Where there are more actuators than
    motions, w is any sum of what each of them holds: a zonotope, whose facets are spanned by d - 1 of them each.

    Parameters
    ----------
    solution : Solution
        One configuration or a batch.
    limits : float or tuple of float or array (n_a, 2) or mapping
        Limits of what actuators exert, in the sense of `forces`: a number for both ways, a pair (lowest, highest), an
        array of these, or a mapping with either for each actuator. A cable only pulls: (-500, 0).
    of : {"force", "moment", "wrench"}, optional
        What varies.
    wrench : array (..., 6) or (..., 3), optional
        What acts in any case, as in `forces`: what is asked for comes on top. By default none.
    at : array (..., 3), optional
        The point of both, as in `forces` [length].

    Raises
    ------
    InvalidArgument or UnknownName
        Limits that are none, of no actuator, or missing; wrenches as in `forces`.
    UnsupportedMechanism
        So many redundant actuators that their polytope has more than 20,000 pairs of facets.
    """
    mechanism = checked_solution(solution).mechanism
    require_choice("of", of, ("force",) if mechanism.end_effector_is_joint else PARTS)
    bounds = bounds_of("limits", limits, mechanism.actuator_names)
    maps, asked = maps_of(solution), asked_of(solution, wrench, at)
    normals, offsets = _half_spaces(solution, maps, bounds)
    normals, offsets = normals[asked.places], offsets[asked.places]
    offsets = offsets - np.einsum("nhr,nr->nh", normals, asked.wrenches)
    if at is not None:
        points = np.broadcast_to(np.asarray(at, float), (*asked.shape, 3)).reshape(-1, 3)
        arms = points - solution._rows.poses[asked.places, :3, 3]
        normals[..., :3] += np.cross(normals[..., 3:], arms[:, None])
    length = mechanism.characteristic_length
    units = np.repeat([1.0, 1.0 / length], 3)
    whole = normals / units
    chosen, scaled = normals[..., PARTS[of]], whole[..., PARTS[of]]
    sizes = np.linalg.norm(scaled, axis=-1)
    bounds_nothing = sizes <= TOLERANCES.rank * np.linalg.norm(whole, axis=-1)
    chosen[bounds_nothing] = scaled[bounds_nothing] = 0.0
    radius, weakest = _ball(chosen if of == "moment" else scaled, offsets)
    reasons = maps.reasons[asked.places]
    is_unknown = has_reason(reasons)
    for values in (chosen, offsets, radius, weakest):
        values[is_unknown] = np.nan
    return WrenchCapacity(
        of,
        chosen.reshape(*asked.shape, *chosen.shape[1:]),
        offsets.reshape(*asked.shape, *offsets.shape[1:]),
        shaped(radius, asked.shape),
        shaped(weakest, asked.shape),
        in_shape(reasons, asked.shape),
        asked.shape,
    )


def _half_spaces(solution: Solution, maps: Maps, bounds: Floats) -> tuple[Floats, Floats]:
    """Normals (n, h, 6) and offsets (n, h) of the wrenches about the reference point that can be held."""
    mechanism = solution.mechanism
    if not is_redundantly_actuated(mechanism):
        forward = np.swapaxes(maps.forward, -1, -2).copy()
        sizes = np.linalg.norm(forward * actuator_units(mechanism)[:, None] / twist_units(mechanism), axis=-1)
        forward[sizes <= TOLERANCES.rank] = 0.0  # an actuator that moves nothing, at a serial singularity
        normals = np.zeros((*forward.shape[:2], 6))
        normals[..., : forward.shape[2]] = forward
        ends = np.concatenate([-bounds[:, 0], bounds[:, 1]])
        return np.concatenate([normals, -normals], axis=1), np.tile(ends, (len(normals), 1))
    q = np.where(maps.is_valid[:, None], solution._coordinates, 0.0)
    pairs, units = pairs_of(mechanism, q), actuator_units(mechanism)
    if n_facets(len(bounds), pairs.rates.shape[2]) > MOST_FACETS:
        raise UnsupportedMechanism(mechanism.name, [f"{len(bounds)} actuators"], "given a polytope of what it holds")
    blocks = []
    for start in range(0, max(len(q), 1), ROWS_A_BLOCK):
        block = slice(start, start + ROWS_A_BLOCK)
        normals, ends = sum_of_segments(-pairs.rates[block], bounds * units[:, None])
        shown = normals @ np.swapaxes(pairs.twists[block], -1, -2)
        shown[np.linalg.norm(shown, axis=-1) <= TOLERANCES.rank] = 0.0
        whole = np.zeros((*shown.shape[:2], 6))
        whole[..., : shown.shape[2]] = shown * twist_units(mechanism)
        blocks.append((whole, ends))
    return np.concatenate([normals for normals, _ in blocks]), np.concatenate([ends for _, ends in blocks])


def _ball(normals: Floats, offsets: Floats) -> tuple[Floats, Floats]:
    """Radius of the largest ball about 0, (n,), and the direction in which it touches, (n, d)."""
    sizes = np.linalg.norm(normals, axis=-1)
    is_bound = np.isfinite(offsets) & (sizes > 0.0)
    distances = np.divide(offsets, sizes, out=np.full(sizes.shape, np.inf), where=is_bound)
    distances[(sizes == 0.0) & (offsets < 0.0)] = -np.inf
    if not distances.shape[1]:
        return np.full(len(normals), np.inf), np.full((len(normals), normals.shape[2]), np.nan)
    nearest = np.argmin(distances, axis=1)[:, None]
    normal = np.take_along_axis(normals, nearest[..., None], axis=1)[:, 0]
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    unit = np.divide(normal, size, out=np.full(normal.shape, np.nan), where=size > 0.0)
    return np.take_along_axis(distances, nearest, axis=1)[:, 0], unit
