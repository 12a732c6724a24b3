"""A table of legs as kernels take it."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from ..arrays import Records
from ..closure.solve import STRANGE
from ..decomposition.leg_table import LegTable
from ..decomposition.resting import Resting, at_rest
from ..kernels.handle import Handle, Scratch
from ..kernels.legs import records as K
from ..tolerances import TOLERANCES

if TYPE_CHECKING:
    from ..kernels.platform.evaluate import EvaluationScratch

Machine: TypeAlias = Handle[K.Table]

OF_AIMS = -1
"""The leader of cones that no joint has: see `with_aims`."""


@lru_cache(maxsize=64)
def kernel_table(table: LegTable) -> K.Table:
    """The same records, with the unknown that the coordinate of each carrier, then of each arm, is."""
    columns = np.full(len(table.legs), -1)
    turned_by_proximal = (table.legs["kind"] == K.ROD) & np.isin(table.legs["proximal"], (K.CRANK, K.CARRIAGE))
    redundant, mirrors = (
        (table.legs["kind"] == K.REDUNDANT) & own for own in (table.legs["mirror_of"] < 0, table.legs["mirror_of"] >= 0)
    )
    own = np.concatenate([np.flatnonzero(turned_by_proximal), np.flatnonzero(redundant)])
    columns[own] = 6 + np.arange(len(own))
    columns[mirrors] = columns[table.legs["mirror_of"][mirrors]]
    return K.Table(table.legs, table.limited, table.cones, table.driven, table.known, table.task, columns)


@lru_cache(maxsize=64)
def machine(table: LegTable) -> Machine:
    """What kernels are given."""
    return Handle(kernel_table(table))


@lru_cache(maxsize=64)
def local_table(table: LegTable) -> Machine:
    """The same for poses that are completed near to where they began alone."""
    return Handle(kernel_table(table)._replace(task=table.task_within(STRANGE)))


@lru_cache(maxsize=64)
def search_table(table: LegTable) -> Machine:
    """The same for searches and assembly, where it is a limit that crossed hinges cannot point rods anywhere."""
    return Handle(kernel_table(table)._replace(cones=with_aims(table.legs, table.cones)))


def with_aims(legs: Records, cones: Records) -> Records:
    """Cones, and after them those that say where two crossed hinges can point their rods, or the third of a pivot.

    Hinges a, b with an angle A between them, and B between b and the rod: its angle from a is from |A - B| to A + B, or
    to 2 pi - A - B. Hinges square to each other and to their rod point it anywhere. Those of pivots come first, with a
    leader, for searches to mind them always: nothing else says that such a leg does not reach.
    """
    aims = []
    for k, leg in enumerate(legs):
        for end, place in (("base_end", K.BASE_LINE), ("platform_end", K.PLATFORM_LINE)):
            is_pivot = leg["kind"] == K.PIVOT and leg[end] == K.TRIPLE
            if not is_pivot and (leg["kind"] != K.ROD or leg[end] != K.CROSS):
                continue
            a, b, c = leg[f"{end}_axes"]
            A, B = np.arccos(np.clip([a @ b, b @ (c if is_pivot else leg["line"])], -1.0, 1.0))
            for axis, most in ((a, min(A + B, 2.0 * np.pi - A - B)), (-a, np.pi - abs(A - B))):
                if most < np.pi - TOLERANCES.alignment:
                    aims.append((k, place, axis, most, np.cos(most), len(cones) if is_pivot else OF_AIMS))
    aims.sort(key=lambda aim: aim[-1] == OF_AIMS)
    return np.concatenate([cones, np.array(aims, K.CONE)]) if aims else cones


@lru_cache(maxsize=64)
def reading_table(table: LegTable) -> Machine:
    """The same with the angles of all endings asked for."""
    return Handle(kernel_table(table)._replace(legs=table.aimed))


@lru_cache(maxsize=64)
def reading_of(table: LegTable) -> Scratch[EvaluationScratch]:
    """Memory to read what legs tell at poses."""
    from ..kernels.platform.evaluate import new_evaluation_scratch

    return Scratch(new_evaluation_scratch, kernel_table(table))


@lru_cache(maxsize=64)
def resting_at_home(table: LegTable) -> Resting | None:
    """Legs as they stand while the arms that they are on are where they are at home."""
    return at_rest(table, table.home_sides[0]) if table.has_free_redundant else None
