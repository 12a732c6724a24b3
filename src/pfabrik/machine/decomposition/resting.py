"""Legs on redundant joints at rest, which are as good as legs on the base."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...common.arrays import Floats, Records
from ...common.rotations import from_rotvec
from ...kernels.legs import records as K
from .leg_table import LegTable


@dataclass(frozen=True)
class Resting:
    """A table of legs without the redundant joints that they are on.

    Attributes
    ----------
    table : the legs, displaced as the redundant joints have them.
    actuators : values of those that drive redundant joints, NaN for the others, (n_a,) [length or rad].
    """

    table: LegTable
    actuators: Floats


def at_rest(table: LegTable, sides: Floats) -> Resting | None:
    """Legs on redundant joints at the base, whose coordinates are in `sides` (legs,).

    None if some leg is not like that, the task leaves some of the pose open, or a redundant joint is beyond its range.
    """
    legs, is_redundant = table.legs, table.is_redundant
    is_otherwise = (legs["frame"] != K.FROM_BASE) & (legs["redundant"] < 0)
    is_otherwise |= (
        (legs["at_platform_end"] == 1) | (legs["orients"] == 1) | (legs["reversed"] == 1) | (legs["inner"] == 1)
    )
    if (
        table.task["unset"][0]
        or is_otherwise.any()
        or legs["platform_end_aimed"].any()
        or not _are_within_ranges(table, sides)
    ):
        return None
    displacements = _displacements(table, sides)
    on_redundant = {name: is_redundant[getattr(table, name)["leg"]] for name in ("limited", "cones", "driven", "known")}
    numbers = np.cumsum(~is_redundant) - 1
    parts = {name: getattr(table, name)[~mask] for name, mask in on_redundant.items()}
    cones = parts["cones"]
    axes = np.einsum("nij,nj->ni", displacements[cones["leg"], :3, :3], cones["axis"])
    cones["axis"] = np.where((cones["place"] == K.BASE_LINE)[:, None], axes, cones["axis"])
    for part in parts.values():
        part["leg"] = numbers[part["leg"]]
    displaced = _displaced(legs, displacements)[~is_redundant]
    forms = tuple(
        form for form, is_redundant_form in zip(table.forms, is_redundant, strict=True) if not is_redundant_form
    )
    resting = replace(table, fields={}, forms=forms, legs=displaced, aimed=displaced, limits=(), **parts)
    if not resting.is_for_blocks:
        return None
    driven, actuators = table.driven[on_redundant["driven"]], np.full(len(table.driven), np.nan)
    actuators[driven["column"]] = driven["home"] + driven["sense"] * sides[driven["leg"]] * driven["unit"]
    return Resting(resting, actuators)


def _are_within_ranges(table: LegTable, sides: Floats) -> bool:
    """True if redundant joints are within their ranges."""
    limits = table.limited[table.is_redundant[table.limited["leg"]]]
    values = limits["sense"] * sides[limits["leg"]]
    return bool(((limits["lo"] <= values) & (values <= limits["hi"])).all())


def _displacements(table: LegTable, sides: Floats) -> Floats:
    """The displacements from home of the bodies that legs are on, or that redundant joints move, (legs, 4, 4) [L]."""
    displacements = np.repeat(np.eye(4)[None], len(table.legs), axis=0)
    for k, leg in enumerate(table.legs):
        motion, q = np.eye(4), sides[k] if table.is_redundant[k] else 0.0
        if leg["proximal"] == K.CRANK:
            motion[:3, :3] = from_rotvec(q * leg["proximal_axis"])
            motion[:3, 3] = leg["proximal_point"] - motion[:3, :3] @ leg["proximal_point"]
        else:
            motion[:3, 3] = q * leg["proximal_axis"]
        displacements[k] = displacements[leg["redundant"]] @ motion if leg["redundant"] >= 0 else motion
    return displacements


def _displaced(legs: Records, displacements: Floats) -> Records:
    """Legs whose bases are displaced, as legs on the base."""
    legs, rotations = legs.copy(), displacements[:, :3, :3]
    for name in ("base_end_point", "proximal_point"):
        legs[name] = np.einsum("nij,nj->ni", rotations, legs[name]) + displacements[:, :3, 3]
    for name in ("proximal_axis", "crank", "crank_across", "line"):
        legs[name] = np.einsum("nij,nj->ni", rotations, legs[name])
    legs["base_end_axes"] = np.einsum("nij,nkj->nki", rotations, legs["base_end_axes"])
    legs["redundant"], legs["frame"] = -1, K.FROM_BASE
    return legs
