"""Forward kinematics of legs in closed form."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..closure.assemble import NOISE, is_over_determined
from ..closure.configurations import Configurations, new_rows, rows_at
from ..decomposition.leg_table import LegTable, leg_table
from ..description.mechanism import Mechanism
from ..kernels.handle import Handle
from ..kernels.platform.records import Starts
from ..kernels.rows import ACTUATOR_ERROR, ITERATIONS, PENDING, POSITION_ERROR, PROJECTED, REACHED, ROTATION_ERROR, Rows
from ..kernels.threads import in_blocks
from .nearest import nearest_actuators
from .nearest_pose import home_start, no_starts, starts_at
from .one import Ends, scratch_of
from .seeds import seeds_of
from .table import search_table

ROWS_A_BLOCK = 256


def assembled(
    mechanism: Mechanism,
    table: LegTable,
    values: Floats,
    start: Configurations | None,
    sides: Floats,
    tolerance: float,
    tried: tuple[Rows, Ends] | None,
) -> tuple[Rows, Floats, Floats]:
    """Configurations that have actuated values (n, n_a), within all limits; rows without one are PENDING.

    What does not assemble from where it starts is assembled from elsewhere: from a start only where that beats a
    projection, and where legs do not assemble in its mode beyond a limit.

    Parameters
    ----------
    sides : which of its two solutions each leg takes at the start, (n or 1, legs).
    tried : the arrays of one row that does not assemble from the start.

    Returns
    -------
    The rows, the coordinates of the legs' carriers (n, legs) [L or rad], and the sides of the answers (n, legs).
    """
    is_cold = start is None
    own = home_start(mechanism, table) if start is None else starts_at(mechanism, table, start.rows.poses, sides)
    rows, (wanted, *ends) = tried or _assembled_from(mechanism, table, values, own)
    found, strayed = Starts(rows.poses, *ends), rows.status == PENDING
    missed = partial(_assemble_missed, mechanism, table, values, rows, wanted, found)
    if is_cold:
        missed(own, seeds_of, np.flatnonzero(rows.status != REACHED))
    rest = np.flatnonzero(rows.status != REACHED)
    if not len(rest):
        return rows, found.q, found.sides
    rows.status[rest] = PENDING
    _project(mechanism, table, wanted, own, rest, rows, found, anywhere=is_cold)
    near = rest[rows.measures[rest, ACTUATOR_ERROR] <= tolerance]
    rows.status[near[rows.status[near] == PROJECTED]] = REACHED
    strayed &= rows.status != REACHED
    if is_cold or not np.count_nonzero(strayed):
        return rows, found.q, found.sides
    if is_over_determined(mechanism):
        strayed &= (rows.status == PENDING) | (rows.measures[:, ACTUATOR_ERROR] > NOISE)
    missed(own, _starts_elsewhere, np.flatnonzero(strayed))
    missed(home_start(mechanism, table), seeds_of, np.flatnonzero(strayed & (rows.status != REACHED)))
    places = np.flatnonzero(strayed & (rows.status != REACHED))
    if len(places):
        _project_elsewhere(mechanism, table, wanted, own, places, rows, values, found, tolerance)
    return rows, found.q, found.sides


@lru_cache(maxsize=64)
def _starts_elsewhere(mechanism: Mechanism) -> Starts:
    """Home, then the corners."""
    table = leg_table(mechanism)
    assert isinstance(table, LegTable)
    home = home_start(mechanism, table)
    return Starts(*(np.concatenate(both) for both in zip(home, seeds_of(mechanism), strict=True)))


def _assemble_missed(
    mechanism: Mechanism,
    table: LegTable,
    values: Floats,
    rows: Rows,
    wanted: Floats,
    found: Starts,
    own: Starts,
    elsewhere: Callable[[Mechanism], Starts],
    places: NDArray[np.intp],
) -> None:
    """Assemble rows that are missed from elsewhere, nearest to where they start; those reached replace what they were.

    From where they start actuators are led to their values: from home too, which is a start of its own for that.
    """
    if not len(places):
        return
    filled, asked = [rows.status, wanted, *found, rows.measures], values[places]
    parts = [array[places] for array in filled]
    _assemble(mechanism, table, own.of(places), elsewhere(mechanism), [asked, *parts])
    reached = parts[0] == REACHED
    for array, part in zip(filled, parts, strict=True):
        array[places[reached]] = part[reached]
    rows.actuators[places[reached]] = asked[reached]
    rows.measures[places[reached], ACTUATOR_ERROR] = 0.0


def _project_elsewhere(
    mechanism: Mechanism,
    table: LegTable,
    wanted: Floats,
    own: Starts,
    places: NDArray[np.intp],
    rows: Rows,
    values: Floats,
    found: Starts,
    tolerance: float,
) -> None:
    """Project rows from anywhere; those that have their values so replace what they were."""
    some = rows_at(rows, places)
    ends = Starts(some.poses, found.q[places], found.sides[places])
    some.actuators[:] = values[places]
    _project(mechanism, table, wanted[places], own.of(places), np.arange(len(places)), some, ends, anywhere=True)
    reached = (some.status == PROJECTED) & (some.measures[:, ACTUATOR_ERROR] <= tolerance)
    some.status[reached] = REACHED
    for array, part in zip((*rows, found.q, found.sides), (*some, ends.q, ends.sides), strict=True):
        array[places[reached]] = part[reached]


def _assembled_from(mechanism: Mechanism, table: LegTable, values: Floats, own: Starts) -> tuple[Rows, Ends]:
    """Rows assembled at actuated values (n, n_a) from where each starts, or all of them; PENDING where they are not."""
    rows, shape = new_rows(mechanism, len(values)), (len(values), len(table.legs))
    ends = Ends(np.zeros_like(values), np.zeros(shape), np.zeros(shape))
    rows.actuators[:] = values
    filled = rows.status, ends.wanted, rows.poses, ends.q, ends.sides, rows.measures
    _assemble(mechanism, table, own, no_starts(table), (rows.actuators, *filled))
    return rows, ends


def _project(
    mechanism: Mechanism,
    table: LegTable,
    values: Floats,
    own: Starts,
    places: NDArray[np.intp],
    rows: Rows,
    found: Starts,
    *,
    anywhere: bool,
) -> None:
    """Answer rows by feasible configurations with actuators as near to their values as searches bring them.

    For these one turn is as good as another. Rows that end beyond a bound, and so a turn away, stay PENDING.
    """
    first = own.of(places)
    ended = nearest_actuators(mechanism, values[places], first, seeds=anywhere)
    near = np.flatnonzero(np.isfinite(ended.distances))
    ended, places = ended.at(near), places[near]
    asked, actuators, measures = rows.actuators[places], ended.actuators, ended.measures
    measures[:, [POSITION_ERROR, ROTATION_ERROR]] = 0.0
    turned = np.zeros(len(places), bool)
    for driven in table.driven:
        column = driven["column"]
        now = actuators[:, column]  # a view
        if driven["turns"] == 1 and driven["hi"] - driven["lo"] > 2.0 * np.pi:
            counted = now + 2.0 * np.pi * np.round((asked[:, column] - now) / (2.0 * np.pi))
            inside = (counted >= driven["home"] + driven["lo"]) & (counted <= driven["home"] + driven["hi"])
            now[:] = np.where(inside, counted, now)
            turned |= ~inside
        off = np.abs(now - asked[:, column]) / driven["unit"]
        measures[:, ACTUATOR_ERROR] = np.maximum(measures[:, ACTUATOR_ERROR], off)
    rows.actuators[places], rows.measures[places] = actuators, measures
    rows.status[places] = np.where(turned, PENDING, PROJECTED)
    rows.counters[places, ITERATIONS] = ended.counters[:, ITERATIONS]
    rows.poses[places], found.q[places], found.sides[places] = ended.poses, ended.q, ended.sides


def _assemble(
    mechanism: Mechanism, table: LegTable, own: Starts, others: Starts, arrays: Sequence[NDArray[Any]]
) -> None:
    """Assemble rows on all cores; the arrays are the actuators, then what is filled: see the kernel."""
    from ..kernels.platform.forward import assemble

    legs, scratch, elsewhere = search_table(table), scratch_of(mechanism, table), Handle(others)

    def run(block: slice) -> None:
        first, (values, *filled) = Handle(own.of(block)), (a[block] for a in arrays)
        assemble(legs.address, scratch.address, values, first.address, elsewhere.address, *filled)

    in_blocks(run, len(arrays[0]), ROWS_A_BLOCK)
