"""Legs on arms that stay where they are: as good as legs on the base."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Floats, Records
from ..kernels.legs import records as K
from ..rotations import from_rotvec
from .leg_table import LegTable


@dataclass(frozen=True)
class Resting:
    """A table of legs without the arms that they are on.

    Attributes
    ----------
    table : the other legs, as they stand while the arms are where they are.
    actuators : the values of those that move arms, NaN for the others, (n_a,) [length or rad].
    """

    table: LegTable
    actuators: Floats


def at_rest(table: LegTable, sides: Floats) -> Resting | None:
    """Legs on arms of the base which are where `sides` (legs,) say.

    None if they are not all such legs, a task leaves something open, or an arm is beyond its range.
    """
    legs = table.legs
    redundant = legs["kind"] == K.REDUNDANT
    is_otherwise = (legs["frame"] != K.FROM_BASE) & (legs["redundant"] < 0) & ~redundant
    is_otherwise |= (
        (legs["at_platform_end"] == 1) | (legs["orients"] == 1) | (legs["reversed"] == 1) | (legs["inner"] == 1)
    )
    if (
        table.task["unset"][0]
        or is_otherwise.any()
        or legs["platform_end_aimed"].any()
        or not _are_within(table, sides)
    ):
        return None
    moved = _moved(legs, sides)
    of_arms = {name: redundant[getattr(table, name)["leg"]] for name in ("limited", "cones", "driven", "known")}
    numbers = np.cumsum(~redundant) - 1
    parts = {name: getattr(table, name)[~own] for name, own in of_arms.items()}
    cones = parts["cones"]
    axes = np.einsum("nij,nj->ni", moved[cones["leg"], :3, :3], cones["axis"])
    cones["axis"] = np.where((cones["place"] == K.BASE_LINE)[:, None], axes, cones["axis"])
    for part in parts.values():
        part["leg"] = numbers[part["leg"]]
    standing = _standing(legs, moved)[~redundant]
    forms = tuple(form for form, is_arm in zip(table.forms, redundant, strict=True) if not is_arm)
    resting = replace(table, forms=forms, legs=standing, aimed=standing, limits=(), **parts)
    if not resting.is_for_blocks:
        return None
    driven, actuators = table.driven[of_arms["driven"]], np.full(len(table.driven), np.nan)
    actuators[driven["column"]] = driven["home"] + driven["sense"] * sides[driven["leg"]] * driven["unit"]
    return Resting(resting, actuators)


def _are_within(table: LegTable, sides: Floats) -> bool:
    """Whether arms are within their ranges."""
    own = table.limited[table.legs["kind"][table.limited["leg"]] == K.REDUNDANT]
    values = own["sense"] * sides[own["leg"]]
    return bool(((own["lo"] <= values) & (values <= own["hi"])).all())


def _moved(legs: Records, sides: Floats) -> Floats:
    """How the bodies that legs stand on, or that arms make move, are displaced from home, (legs, 4, 4) [L]."""
    moved = np.repeat(np.eye(4)[None], len(legs), axis=0)
    for k, leg in enumerate(legs):
        own = np.eye(4)
        if leg["kind"] == K.REDUNDANT and leg["proximal"] == K.CRANK:
            own[:3, :3] = from_rotvec(sides[k] * leg["proximal_axis"])
            own[:3, 3] = leg["proximal_point"] - own[:3, :3] @ leg["proximal_point"]
        elif leg["kind"] == K.REDUNDANT:
            own[:3, 3] = sides[k] * leg["proximal_axis"]
        moved[k] = moved[leg["redundant"]] @ own if leg["redundant"] >= 0 else own
    return moved


def _standing(legs: Records, moved: Floats) -> Records:
    """Legs with what they stand on as displaced."""
    legs, rotations = legs.copy(), moved[:, :3, :3]
    for name in ("base_end_point", "proximal_point"):
        legs[name] = np.einsum("nij,nj->ni", rotations, legs[name]) + moved[:, :3, 3]
    for name in ("proximal_axis", "crank", "crank_across", "line"):
        legs[name] = np.einsum("nij,nj->ni", rotations, legs[name])
    legs["base_end_axes"] = np.einsum("nij,nkj->nki", rotations, legs["base_end_axes"])
    legs["redundant"], legs["frame"] = -1, K.FROM_BASE
    return legs
