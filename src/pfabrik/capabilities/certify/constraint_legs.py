"""Constraints of legs on the pose: which regions of poses keep them all."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Floats, Record, Records
from ...kernels.legs import records as K
from ...machine.decomposition.leg_table import LegTable
from ...tolerances import TOLERANCES

KEPT = TOLERANCES.implied
"""Part of a unit vector [1] or of a point's offset [L] up to which a constraint counts as kept all over a region."""

MOST_COSINE = 0.9
"""Cosine of the angle between two hinges from which on their product says too little of it."""


def leg_that_restricts(table: LegTable, shifts: Floats, turns: Floats, but: int = -1) -> int:
    """The first leg whose constraints may be broken within a region, or are not known to be kept; -1 if there is none.

    Leg `but` does not count.

    Parameters
    ----------
    shifts : directions and amounts by which positions of the region differ from home's, (k, 3) [L].
    turns : rotation vectors by which orientations differ from home's, (m, 3) [rad].
    """
    motion = _RegionMotion(shifts, turns)
    owner = 0
    for k, leg in enumerate(table.legs):
        owner = owner if leg["proximal"] == K.SHARED else k
        is_known = leg["frame"] in (0, 1) and leg["kind"] in (K.ROD, K.PIVOT)
        if k != but and (not is_known or not motion.keeps(leg, table.legs, owner)):
            return k
    return -1


def leg_without_bounds(table: LegTable) -> int:
    """The first leg whose constraints have no bounds over cells; -1 if all have.

    These are constraints of legs that redundant joints carry, and twists of rods but for those between two hinges that
    are square to each other, or nearly so: a product stands for their angle (`kernels.certify.constraint_rows`).
    """
    for k, leg in enumerate(table.legs):
        if not leg["has_rows"]:
            continue
        first, last = leg["base_end_axes"][0], leg["platform_end_axes"][0]
        is_between_hinges = leg["base_end"] == K.HINGE and leg["platform_end"] == K.HINGE
        is_between_hinges &= abs(float(first @ last)) < MOST_COSINE and leg["proximal"] == K.NO_PROXIMAL
        if leg["frame"] not in (0, 1) or leg["kind"] not in (K.ROD, K.PIVOT):
            return k
        if leg["kind"] == K.ROD and leg["twists"] and not is_between_hinges:
            return k
    return -1


def leg_of_joints(table: LegTable, names: set[str]) -> int:
    """The leg that some joints make up, which gives every pose that they do; -1 if none does."""
    for k, leg in enumerate(table.legs):
        is_fixed = not leg["has_proximal"] and leg["proximal"] != K.SHARED and leg["redundant"] < 0
        if (
            is_fixed
            and leg["kind"] in (K.ROD, K.PIVOT)
            and {each.joint.name for each in table.forms[k].elements} == names
        ):
            return k
    return -1


def names_of_leg(table: LegTable, leg: int) -> str:
    """The joints of a leg, for messages."""
    return ", ".join(dict.fromkeys(element.joint.name for element in table.forms[leg].elements))


def joints_without_bounds(table: LegTable) -> str:
    """The joints with a limit on a coordinate without bounds over regions, for messages; empty if there are none.

    These are angles of a rod's endings other than a hinge or two that cross and let it spin.
    """
    names = []
    for i, coordinate in enumerate(table.limited):
        leg, place = table.legs[coordinate["leg"]], int(coordinate["place"])
        ending = leg["base_end"] if place < K.SLIDE else leg["platform_end"]
        is_known = place in (K.Q_PROXIMAL, K.SLIDE) or ending == K.HINGE or (ending == K.CROSS and not leg["twists"])
        if leg["kind"] != K.PIVOT and (not is_known or leg["kind"] != K.ROD):
            names.append(table.limits[2 * i][0])
    return ", ".join(dict.fromkeys(names))


class _RegionMotion:
    """The motions of a region from home: translations, and no rotations, ones about a single axis, or any."""

    def __init__(self, shifts: Floats, turns: Floats) -> None:
        self.shifts = shifts
        sizes = np.linalg.norm(turns, axis=1)
        self.turns = bool(sizes.max(initial=0.0) > 0.0)
        self.axis = turns[np.argmax(sizes)] / sizes.max() if self.turns else np.zeros(3)
        self.has_axis = bool(self.turns and np.abs(np.cross(turns, self.axis)).max() <= KEPT)

    def is_about(self, n: Floats) -> bool:
        """True if all rotations are about a unit vector, or if there are none."""
        return not self.turns or (self.has_axis and _are_parallel(self.axis, n))

    def is_across(self, n: Floats) -> bool:
        """True if nothing moves along a unit vector."""
        return bool((np.abs(self.shifts @ n) <= KEPT).all()) and self.is_about(n)

    def keeps(self, leg: Record, legs: Records, k: int) -> bool:
        """True if all constraints of a leg are kept; `k` is the leg with its proximal joint."""
        if leg["kind"] == K.PIVOT:
            return self._keeps_pivot(leg)
        proximal = legs[k]
        if leg["slides"] == 0 and not leg["has_proximal"] and not self._is_parallel(leg, proximal):
            return False
        for end in ("base_end", "platform_end"):
            if leg[end] == K.HINGE and not self._stays_across(leg[f"{end}_axes"][0], proximal):
                return False
        # Crossed hinges that keep a rod from spinning have no bounds yet.
        hinges = [leg[f"{end}_axes"][0] for end in ("base_end", "platform_end") if leg[end] == K.HINGE]
        return leg["twists"] == 0 or (len(hinges) == 2 and _are_parallel(*hinges))

    def _keeps_pivot(self, pivot: Record) -> bool:
        """Its centre stays where its slides let it be, and its hinges turn as the platform does."""
        fixed = pivot["fixed_rows"][: 3 - pivot["slides"]]
        if pivot["frame"] == 1 and self.turns:
            return False
        is_centred = not self.turns or np.linalg.norm(pivot["platform_end_point"]) <= KEPT
        if any(
            np.abs(self.shifts @ row).max(initial=0.0) > KEPT or not (is_centred or self.is_about(row)) for row in fixed
        ):
            return False
        n_pairs = pivot["n_rows"] - len(fixed)
        pairs = zip(pivot["kept"][:n_pairs], pivot["moved"][:n_pairs], strict=True)
        return all(not self.turns or self.is_about(kept) or self.is_about(moved) for kept, moved in pairs)

    def _is_parallel(self, rod: Record, proximal: Record) -> bool:
        """True of the second rod of a parallelogram: as long as the first, and beside it in every pose."""
        if rod["proximal"] != K.SHARED:
            return False
        offset = rod["platform_end_point"] - proximal["platform_end_point"]
        base_offset = rod["base_end_point"] - proximal["base_end_point"]
        if np.abs(offset - base_offset).max() > KEPT or abs(rod["length"] - proximal["length"]) > KEPT:
            return False
        if proximal["proximal"] == K.CRANK and not _are_parallel(proximal["proximal_axis"], offset):
            return False
        return not self.turns or (self.has_axis and _are_parallel(self.axis, offset))

    def _stays_across(self, hinge: Floats, proximal: Record) -> bool:
        """True if a rod stays in the plane across a hinge, whatever its proximal joint does."""
        if proximal["proximal"] == K.CRANK and not _are_parallel(proximal["proximal_axis"], hinge):
            return False
        if proximal["proximal"] == K.CARRIAGE and abs(proximal["proximal_axis"] @ hinge) > KEPT:
            return False
        return self.is_across(hinge)


def _are_parallel(a: Floats, b: Floats) -> bool:
    return bool(np.abs(np.cross(a, b)).max() <= KEPT)
