"""Kernel tables: a table of legs in the variants that kernels take."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from ...common.arrays import Records
from ...common.batch import take
from ...common.derived import derived
from ...kernels.handle import Handle, Scratch
from ...kernels.joints.joint_constants import STRANGE
from ...kernels.legs import records as K
from ...machine.decomposition.leg_table import LegTable
from ...machine.decomposition.resting import Resting, at_rest
from ...tolerances import TOLERANCES

if TYPE_CHECKING:
    from ...kernels.pose.evaluate import EvaluationScratch

TableHandle: TypeAlias = Handle[K.Table]

OF_POINTING = -1
"""The leader of cones that belong to no joint, but limit where crossed hinges can point a rod."""


@derived
def kernel_table(table: LegTable) -> K.Table:
    """The records of a leg table, with the index of each proximal, then redundant, coordinate among the unknowns."""
    columns = np.full(len(table.legs), -1)
    is_mirror = table.legs["mirror_of"] >= 0
    proximal_legs = [*np.flatnonzero(table.legs["has_proximal"]), *np.flatnonzero(table.is_redundant & ~is_mirror)]
    columns[proximal_legs] = 6 + np.arange(len(proximal_legs))
    columns[is_mirror] = columns[table.legs["mirror_of"][is_mirror]]
    return K.Table(table.legs, table.limited, table.cones, table.driven, table.known, table.task, columns)


def without_legs(table: LegTable) -> K.Table:
    """A kernel table with the task alone."""
    full = kernel_table(table)
    return take(full, slice(0, 0))._replace(task=full.task)


@derived
def table_handle(table: LegTable) -> TableHandle:
    """The kernel table."""
    return Handle(kernel_table(table))


@derived
def local_table(table: LegTable) -> TableHandle:
    """Kernel table that completes a partial pose only near its start."""
    return Handle(kernel_table(table)._replace(task=table.task_within(STRANGE)))


@derived
def search_table(table: LegTable) -> TableHandle:
    """Kernel table for searches and assembly, with cones that limit where crossed hinges can point their rods."""
    return Handle(kernel_table(table)._replace(cones=with_pointing_cones(table.legs, table.cones)))


def with_pointing_cones(legs: Records, cones: Records) -> Records:
    """Cones, followed by those that limit where two crossed hinges can point a rod, or a pivot's third hinge.

    With A the angle between hinges a and b, and B that between b and the rod, the angle t between a and the rod is in
    |A - B| <= t <= min(A + B, 2 pi - A - B). Hinges square to each other and to their rod point it anywhere. Cones of
    pivots come first and have a leader, so that searches always enforce them: nothing else shows that a pivot does not
    reach.
    """
    pointing = []
    for k, leg in enumerate(legs):
        for end, place in (("base_end", K.BASE_LINE), ("platform_end", K.PLATFORM_LINE)):
            if not leg[f"{end}_aimed"] or leg[end] == K.HINGE:
                continue
            is_pivot, (a, b, _) = leg[end] == K.TRIPLE, leg[f"{end}_axes"]
            A, B = np.arccos(np.clip([a @ b, b @ leg["line"]], -1.0, 1.0))
            for axis, half_angle in ((a, min(A + B, 2.0 * np.pi - A - B)), (-a, np.pi - abs(A - B))):
                if half_angle < np.pi - TOLERANCES.alignment:
                    pointing.append(
                        (k, place, axis, half_angle, np.cos(half_angle), len(cones) if is_pivot else OF_POINTING)
                    )
    pointing.sort(key=lambda cone: cone[-1] == OF_POINTING)
    return np.concatenate([cones, np.array(pointing, K.CONE)]) if pointing else cones


@derived
def reading_table(table: LegTable) -> TableHandle:
    """Kernel table that computes the angles of all endings."""
    return Handle(kernel_table(table)._replace(legs=table.aimed))


@derived
def reading_scratch(table: LegTable) -> Scratch[EvaluationScratch]:
    """Scratch memory to read joint coordinates and constraints at poses."""
    from ...kernels.pose.evaluate import new_evaluation_scratch

    return Scratch(new_evaluation_scratch, kernel_table(table))


@derived
def legs_at_rest(table: LegTable) -> Resting | None:
    """The legs while free redundant joints stay at home; None if there are none, or if such legs are not equivalent."""
    return at_rest(table, table.home_sides[0]) if table.has_free_redundant else None
