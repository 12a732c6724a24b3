"""The active limits of a configuration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import Floats
from ..common.rotations import from_rotvec
from ..engines.joints.configurations import Configurations
from ..engines.joints.first_order import are_stretched
from ..engines.joints.link_distances import pair_distances_at, pair_names
from ..engines.pose.answers import sides_at
from ..engines.pose.leg_margins import leg_margins
from ..engines.pose.tip_engine import measured, start_at_tip
from ..machine.decomposition.leg_table import DEAD_POINTS
from ..machine.description.mechanism import Mechanism
from ..machine.model import Model
from ..machine.motion.displacements import columns, rate_units
from ..machine.motion.limited_coordinates import coned, ranges_of
from ..machine.motion.loops import cycle_basis, first_order, right_singular
from ..machine.motion.mobility import generic_of
from ..tolerances import TOLERANCES

Bound: TypeAlias = Literal["min", "max", "cone", "clearance", "stretched", "level"]
"""A limit of a joint, the clearance of two links, or a dead point: links are stretched out or folded at a joint, or a
rod is level, square to its upright slide."""

JUST_BEYOND = 1e-5
"""How far beyond a border poses are by which legs tell the dead point that they meet there [L or rad]."""


@dataclass(frozen=True)
class ActiveLimit:
    """A limit that an answer lies on or exceeds.

    Attributes
    ----------
    joint, bound : str
        The limit and its joint; for a clearance the two bodies that are as near: ``BC1–BC3``.
    value, limit : float
        The coordinate (or the angle at the cone, or the distance of the links) and its bound, of a dead point the
        coordinate itself [length or rad].
    coordinate : int
        Which coordinate of the joint, as in `home_coordinate`: 0, or 1 for the second of a universal or cylindrical
        joint.
    multiplier : float or None
        The most by which the answer comes nearer to its target per unit by which the limit is relaxed [length per
        length or rad]; rotations count as lengths by `Options.rotation_length`. It is exact if the active limits are
        independent; redundant limits (two parallel rods) share a multiplier, and relaxing one of them alone changes
        nothing. None if the target was no pose.
    """

    joint: str
    bound: Bound
    value: float
    limit: float
    multiplier: float | None = None
    coordinate: int = 0


ALIKE = 0.999
"""Ratio of two multipliers above which they count as equal: their relative error is about 1e-4."""


def active_limits(mechanism: Mechanism, coordinates: Floats) -> list[tuple[ActiveLimit, ...]]:
    """The limits that each row of joint coordinates (n, columns), deviations from home, lies on.

    Ranges come first, then cones, then pairs of links, the nearest first. A rigid joint is always at its limits, and is
    listed only if it exceeds them.
    """
    limits: list[list[ActiveLimit]] = [[] for _ in coordinates]
    ranges = ranges_of(mechanism)
    rigid = [joint.is_rigid for joint in ranges.joints]
    values, near = ranges.values(coordinates), np.where(rigid, -TOLERANCES.limit, TOLERANCES.active) * ranges.units
    low, high = values - ranges.low <= near, ranges.high - values <= near
    for k, (joint, place) in enumerate(zip(ranges.joints, ranges.places, strict=True)):
        for row in np.flatnonzero(low[:, k] | high[:, k]):
            bound: Bound = "min" if low[row, k] else "max"
            limit = float((ranges.low if bound == "min" else ranges.high)[k])
            limits[row].append(ActiveLimit(joint.name, bound, float(values[row, k]), limit, None, place))
    for joint, angles, half_angle in coned(mechanism, coordinates):
        for row in np.flatnonzero(half_angle - angles <= TOLERANCES.active):
            limits[row].append(ActiveLimit(joint.name, "cone", float(angles[row]), half_angle))
    clearance = mechanism.clearance
    if clearance is not None and len(coordinates):
        names, distances = pair_names(mechanism), pair_distances_at(mechanism, coordinates)
        length = mechanism.characteristic_length
        near_pairs = distances <= max(clearance, TOLERANCES.apart * length) + TOLERANCES.active * length
        for row in np.flatnonzero(near_pairs.any(axis=1)):
            pairs = np.flatnonzero(near_pairs[row])
            for pair in pairs[np.argsort(distances[row, pairs], kind="stable")]:
                limits[row].append(ActiveLimit(names[pair], "clearance", float(distances[row, pair]), clearance))
    return [tuple(row_limits) for row_limits in limits]


def holding_limits(mechanism: Mechanism, coordinates: Floats, multipliers: Floats) -> list[tuple[ActiveLimit, ...]]:
    """The limits that block each row of joint coordinates (n, columns) from its target, the largest multiplier first.

    Limits with equal multipliers, as of symmetric legs, are in the order of the description.

    Parameters
    ----------
    multipliers : (n, 2 columns + cones), as of `limit_multipliers`; with a clearance, (n, 2 columns + cones + pairs).
    """
    limits: list[list[ActiveLimit]] = [[] for _ in coordinates]
    n, units = coordinates.shape[1], rate_units(mechanism)
    first_pair = 2 * n + sum(joint.cone is not None for joint in mechanism.joints)
    angles = coned(mechanism, coordinates) if (multipliers[:, 2 * n : first_pair] > TOLERANCES.holding).any() else []
    has_pairs = (multipliers[:, first_pair:] > TOLERANCES.holding).any()
    distances = pair_distances_at(mechanism, coordinates) if has_pairs else np.empty((0, 0))
    places = [(row, place) for row in range(len(multipliers)) for place in _largest_first(multipliers[row])]
    for row, place in places:
        coordinate_place = 0
        if place < 2 * n:
            coordinate = mechanism.coordinates[place // 2]
            if coordinate.joint.is_rigid:
                continue
            name, coordinate_place, column = coordinate.joint.name, coordinate.place, coordinate.column
            unit = mechanism.characteristic_length / float(units[column])
            value, limit = float(coordinates[row, column]) + coordinate.home, coordinate.bounds[place % 2]
            bound: Bound = "max" if place % 2 else "min"
        elif place >= first_pair:
            name, bound, unit = pair_names(mechanism)[place - first_pair], "clearance", 1.0
            value, limit = float(distances[row, place - first_pair]), mechanism.clearance or 0.0
        else:
            joint, values, limit = angles[place - 2 * n]
            name, value, bound, unit = joint.name, float(values[row]), "cone", mechanism.characteristic_length
        multiplier = float(multipliers[row, place]) * unit
        limits[row].append(ActiveLimit(name, bound, value, limit, multiplier, coordinate_place))
    return [tuple(row_limits) for row_limits in limits]


def dead_point(model: Model, at: Configurations, motions: Sequence[tuple[Floats, Floats]]) -> tuple[ActiveLimit, ...]:
    """The dead point at a configuration: of the leg that does not reach just beyond it, else as of `stretched_joint`.

    Parameters
    ----------
    motions : velocities of the reference point [L] and angular ones that lead beyond, the first that tells counts.
    """
    read = measured(model)
    legs_at = at if read is model else cast(Configurations, start_at_tip(at))
    for velocity, turn in motions if read.has_legs and not read.why_poses_do_not_suffice else ():
        size = float(np.abs([velocity, turn]).max())
        if size == 0.0:
            continue
        pose, step = np.require(legs_at.rows.poses, requirements=["C", "W"]).copy(), JUST_BEYOND / size
        beyond = pose.copy()
        beyond[0, :3, :3] = from_rotvec(step * turn) @ pose[0, :3, :3]
        beyond[0, :3, 3] += model.length * (step * velocity)
        margin, binding = leg_margins(read, beyond, pose, sides_at(read, legs_at))
        joint, bound = read.legs.measured_limits[int(binding[0])] if margin[0] < 0.0 else ("", "")
        if bound in DEAD_POINTS:
            (value, *_) = np.atleast_1d(at.coordinates[0, columns(model.mechanism)[joint]]).tolist()
            (home, *_) = np.atleast_1d(model.mechanism.home_coordinate(joint)).tolist()
            return (ActiveLimit(joint, cast(Bound, bound), value + home, value + home),)
    return stretched_joint(model, at.coordinates)


def stretched_joint(model: Model, q: Floats) -> tuple[ActiveLimit, ...]:
    """The joint at which links are stretched out or folded at joint coordinates q (1, c); empty if none are.

    It is the one that turns fastest in the motion that the end effector shows least of.
    """
    freedoms = generic_of(model.mechanism).mobility.platform
    if not freedoms or not are_stretched(model, q)[0]:
        return ()
    closure, twist = first_order(model.mechanism, q)
    values, right = right_singular(closure)
    motions = right[0, np.count_nonzero(values > TOLERANCES.rank) :]
    if not len(motions):  # so folded that nothing moves, to first order
        return ()
    lost = np.linalg.svd(motions @ twist[0].T)[0][:, min(freedoms, len(motions)) - 1] @ motions
    coordinate = model.mechanism.coordinates[int(np.argmax(np.abs(cycle_basis(model.mechanism).rates.T @ lost)))]
    value = float(q[0, coordinate.column]) + coordinate.home
    return (ActiveLimit(coordinate.joint.name, "stretched", value, value, None, coordinate.place),)


def has_passive_limits(mechanism: Mechanism, multipliers: Floats) -> bool:
    """True if a limit of a passive joint, or a clearance, is active; for multipliers see `holding_limits`."""
    columns = [drive.column for drive in mechanism.drives]
    columns += [coordinate.column for coordinate in mechanism.coordinates if coordinate.joint.is_rigid]  # never listed
    is_passive = np.ones(multipliers.shape[1], bool)
    is_passive[[2 * column + bound for column in columns for bound in (0, 1)]] = False
    return bool((multipliers[:, is_passive] > TOLERANCES.holding).any())


def _largest_first(multipliers: Floats) -> list[int]:
    """Places of the active multipliers (k,), in falling order; equal ones in the order of their places."""
    groups: list[list[int]] = []
    for place in np.argsort(-multipliers, kind="stable").tolist():
        if multipliers[place] <= TOLERANCES.holding:
            break
        if groups and multipliers[place] > ALIKE * multipliers[groups[-1][0]]:
            groups[-1].append(place)
        else:
            groups.append([place])
    return [place for group in groups for place in sorted(group)]


BINDING = np.dtype(
    [("joint", "U64"), ("bound", "U9"), ("coordinate", "i8"), ("value", "f8"), ("limit", "f8"), ("multiplier", "f8")]
)
"""A limit as a record of an array, for batches."""


def _binding_of(longest: int) -> np.dtype[np.void]:
    """`BINDING`, with room for names of this length."""
    if 4 * longest <= BINDING["joint"].itemsize:
        return BINDING
    return np.dtype([("joint", f"U{longest}"), *((name, BINDING[name]) for name in (BINDING.names or ())[1:])])


def binding_limits(rows: Sequence[tuple[ActiveLimit, ...]]) -> NDArray[np.void]:
    """The first limit of each row, (n,) records of `BINDING`; empty names and NaN where a row has none."""
    records = np.zeros(len(rows), _binding_of(max((len(limits[0].joint) for limits in rows if limits), default=0)))
    for name in ("value", "limit", "multiplier"):
        records[name] = np.nan
    for place, limits in enumerate(rows):
        for limit in limits[:1]:
            multiplier = np.nan if limit.multiplier is None else limit.multiplier
            records[place] = (limit.joint, limit.bound, limit.coordinate, limit.value, limit.limit, multiplier)
    return records
