"""Volumes of workspaces between two proved bounds, by boxes that are within reach and boxes of the border."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from ...common.arrays import Floats
from ...common.rotations import to_rotvec
from ...common.telling import OnProgress
from ...errors import InvalidArgument, UnsupportedMechanism
from ...kernels.certify.pose_cells import BOX, ROTATION_VECTOR, TILT
from ...kernels.certify.prove import ENCLOSE, HALF, N_COLUMNS, no_parameters
from ...kinematics import Model
from .constraint_legs import joints_without_bounds, leg_that_restricts, names_of_leg
from .pose_region import reach_box
from .subdividing import Enclosing

COORDINATES = ("x", "y", "z", "tilt_x", "tilt_y", "yaw")

SPLIT = 0.8
"""Share of the gap between both bounds whose cells are halved along all coordinates in one round: the largest first."""

ROUNDED = 1e-12
"""Share by which sums of volumes are rounded outwards."""


@dataclass(frozen=True, eq=False, repr=False)
class Enclosure:
    """The size of a workspace between two proved bounds, in home's working mode.

    Attributes
    ----------
    names : tuple of str
        Names of the d coordinates.
    lower, upper : float
        Bounds of its area or volume [product of the units of the coordinates].
    inside : array (n, 2, d)
        Boxes that are wholly within reach: low and high ends [length or rad].
    border : array (m, 2, d)
        Boxes that hold the rest of it. Everything in neither is out of reach.
    n_cells : int
        Number of cells looked at.
    """

    names: tuple[str, ...]
    lower: float
    upper: float
    inside: Floats
    border: Floats
    n_cells: int

    @property
    def middle(self) -> float:
        """The size halfway between both bounds."""
        return 0.5 * (self.lower + self.upper)

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, ready for JSON, without the boxes."""
        return {"lower": self.lower, "upper": self.upper, "cells": self.n_cells}

    def __repr__(self) -> str:
        return (
            f"<Enclosure over {', '.join(self.names)}: from {self.lower:.8g} to {self.upper:.8g}; {self.n_cells} cells>"
        )


def enclose(
    model: Model,
    names: Sequence[str],
    held: Mapping[str, float],
    rotation: Floats,
    ends: tuple[Floats, Floats],
    *,
    accuracy: float,
    budget: int,
    tell: OnProgress | None = None,
) -> Enclosure:
    """Enclose the size of the workspace over some coordinates.

    Parameters
    ----------
    held : the values of all coordinates; those of `names` do not count.
    rotation : the orientation held, (3, 3); that of home if angles vary.
    ends : least and greatest value of each of `names`, (d,) [length or rad]; infinite where only reach ends them.
    accuracy : gap between both bounds at which the search stops, as a share of the lower one.
    budget : cells to look at, at most.
    tell : called with (cells looked at, cells in all, about).

    Raises
    ------
    UnsupportedMechanism : a leg restricts the platform's poses there, or nothing ends the workspace.
    """
    axes = [COORDINATES.index(name) for name in names]
    units = np.where(np.array(axes) < 3, model.length, 1.0)
    middle = np.array([held[name] for name in COORDINATES])
    turning = TILT if middle[3:].any() or max(axes) > 2 else ROTATION_VECTOR
    if turning == TILT and np.abs(rotation - np.eye(3)).max() > 0.0:
        raise InvalidArgument(
            "orientation", "another than home's, with angles", "home's, to enclose a workspace of angles"
        )
    if turning == ROTATION_VECTOR:
        middle[3:] = to_rotvec(rotation)
    _require_free(model, middle, axes)
    low, high = (np.asarray(end, dtype=float) for end in ends)
    reach = reach_box(model, middle, axes)
    low, high = np.maximum(low, reach[0]), np.minimum(high, reach[1])
    if not np.isfinite([low, high]).all():
        free = ", ".join(name for name, a, b in zip(names, low, high, strict=True) if not np.isfinite([a, b]).all())
        raise InvalidArgument("within", f"no ends of {free}", "ends for what no leg's reach ends")
    if (low >= high).any():
        none = np.zeros((0, 2, len(axes)))
        return Enclosure(tuple(names), 0.0, 0.0, none, none, 0)
    scale = np.array([model.length] * 3 + [1.0] * 3)
    parameters = no_parameters()._replace(
        kinds=np.array([turning, BOX, 6 if max(axes) > 2 else 3, ENCLOSE, 0]), middle=middle / scale
    )
    first = np.zeros((1, N_COLUMNS))
    first[0, :HALF] = middle / scale
    first[0, axes] = 0.5 * (low + high) / units
    first[0, [HALF + axis for axis in axes]] = 0.5 * (high - low) / units
    return _refine(Enclosing(model, parameters), first, axes, units, tuple(names), accuracy, budget, tell)


def _refine(
    enclosing: Enclosing,
    first: Floats,
    axes: list[int],
    units: Floats,
    names: tuple[str, ...],
    accuracy: float,
    budget: int,
    tell: OnProgress | None,
) -> Enclosure:
    """Halve the cells with the largest gaps until the sum of all gaps is small, or the budget is spent."""
    halves = [HALF + axis for axis in axes]
    corners = np.array(list(product((-1.0, 1.0), repeat=len(axes))))
    inside, settled = [np.zeros((0, N_COLUMNS))], 0.0
    cells, shares = np.zeros((0, N_COLUMNS)), np.zeros((0, 2))
    fresh, n_cells = first, 0
    while True:
        fresh_shares = enclosing.shares(fresh)
        n_cells += len(fresh)
        is_whole, is_left = fresh_shares[:, 0] >= 1.0, fresh_shares[:, 1] > 0.0
        inside.append(fresh[is_whole])
        settled += float(np.prod(2.0 * fresh[is_whole][:, halves] * units, axis=1).sum())
        is_left &= ~is_whole
        cells, shares = np.concatenate([cells, fresh[is_left]]), np.concatenate([shares, fresh_shares[is_left]])
        volumes = np.prod(2.0 * cells[:, halves] * units, axis=1)
        gaps = (shares[:, 1] - shares[:, 0]) * volumes
        lower, gap = settled + float(shares[:, 0] @ volumes), float(gaps.sum())
        if gap <= accuracy * lower or n_cells >= budget or not len(cells):
            break
        if tell is not None and lower > 0.0:  # halving cells at the border halves the gap
            tell(n_cells, math.ceil(min(budget, n_cells * (gap / (accuracy * lower)) ** (len(axes) - 1))))
        order = np.argsort(-gaps)
        n_split = int(np.searchsorted(np.cumsum(gaps[order]), SPLIT * gap)) + 1
        chosen, kept = order[:n_split], order[n_split:]
        fresh = np.repeat(cells[chosen], len(corners), axis=0)
        fresh[:, halves] *= 0.5
        fresh[:, axes] += fresh[:, halves] * np.tile(corners, (n_split, 1))
        cells, shares = cells[kept], shares[kept]
    whole = np.concatenate(inside)
    boxes = [
        np.stack([part[:, axes] - part[:, halves], part[:, axes] + part[:, halves]], axis=1) * units
        for part in (whole, cells)
    ]
    for array in boxes:
        array.setflags(write=False)
    return Enclosure(names, lower * (1.0 - ROUNDED), (lower + gap) * (1.0 + ROUNDED), boxes[0], boxes[1], n_cells)


def _require_free(model: Model, middle: Floats, axes: list[int]) -> None:
    """Raise if the constraints of a leg are not kept all over the coordinates."""
    home = model.mechanism.home_pose[:3, 3]
    shifts = np.zeros((1 + len(axes), 3))
    shifts[0] = (middle[:3] - home) / model.length
    turns = np.diag(middle[3:])
    for i, axis in enumerate(axes):
        if axis < 3:
            shifts[0, axis] = 0.0
            shifts[1 + i, axis] = 1.0
        else:
            turns[axis - 3, axis - 3] = 1.0
    leg, unknown = leg_that_restricts(model.legs, shifts, turns), joints_without_bounds(model.legs)
    if unknown:
        reason = f"limits of {unknown} have no bounds over regions yet"
        raise UnsupportedMechanism(model.mechanism.name, [reason], "enclosed")
    if leg >= 0:
        reason = f"the leg with {names_of_leg(model.legs, leg)} restricts the platform there, or carries others"
        raise UnsupportedMechanism(model.mechanism.name, [reason], "enclosed")
