"""Wrench polytopes of a machine by the limits of its actuators."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..answers.solution import Solution, checked_solution
from ..arguments import any_values, array
from ..arrays import Floats, shaped
from ..checks import require_choice
from ..errors import InvalidArgument, UnsupportedMechanism
from ..kinematics import actuator_units
from ..tolerances import TOLERANCES
from .actuator_values import Bounds, bounds_of
from .first_order_maps import Maps, is_redundantly_actuated, maps_of, twist_units
from .joint_balance import pairs_of
from .loads import asked_of
from .polytope import MOST_FACETS, n_facets, sum_of_segments, vertices_of
from .reasons import Reasons, has_reason, in_shape

ROWS_A_BLOCK = 128
PARTS = {"force": slice(0, 3), "moment": slice(3, 6), "wrench": slice(0, 6)}


@dataclass(frozen=True, eq=False)
class WrenchCapacity:
    """The loads that a machine's actuators can hold within their limits, as `wrench_capacity` returns it.

    x is what acts in addition to the given wrench: a force (d = 3), a moment (3) or a wrench (6), in the base frame.

    Attributes
    ----------
    of : "force", "moment" or "wrench".
    normals, offsets : the half-spaces normals . x <= offsets, (..., h, d) and (..., h); an infinite offset bounds
        nothing. Directions in which the loops hold the end effector without its actuators are bounded by none.
    radius : size of the largest x that can be held in any direction, the largest ball about 0, (...): of a force or a
        moment; of a wrench, of a force, with moments divided by L. Negative where the given wrench itself is too much.
    weakest : the direction in which no more can be held, a unit vector, (..., d).
    reason : why nothing is known, (...), with NaN in the numbers; empty elsewhere. A text for a single answer.
    """

    of: Literal["force", "moment", "wrench"]
    normals: Floats
    offsets: Floats
    radius: float | Floats
    weakest: Floats
    reason: str | Reasons
    _shape: tuple[int, ...] = field(repr=False)

    @property
    def vertices(self) -> Floats | list[Floats]:
        """The vertices of the polytope, (v, 3) for a single answer; for a batch a list of such arrays, in row order.

        In directions that nothing bounds they are at 0, and those at infinity are left out. None where nothing can be
        held, or the reason says why not.

        Raises
        ------
        InvalidArgument : of wrenches, which have six dimensions.
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
    limits : of what actuators exert, in the sense of `forces`: a number for both ways, a pair (lowest, highest), an
        array (n_a, 2) of these, or a mapping with either for each actuator. A cable only pulls: (-500, 0).
    of : what varies.
    wrench : what acts in any case, as of `forces`: what is asked for comes on top. By default none.
    at : the point of both, as of `forces`.

    Raises
    ------
    InvalidArgument, UnknownName : limits that are none, of no actuator, or missing; wrenches as of `forces`.
    UnsupportedMechanism : so many redundant actuators that their polytope has more than 20,000 pairs of facets.
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
