"""Forward kinematics of legs in closed form."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..closure.configurations import Configurations, new_rows
from ..decomposition.leg_table import LegTable
from ..description.mechanism import Mechanism
from ..kernels.handle import Handle
from ..kernels.platform.records import Starts
from ..kernels.rows import ACTUATOR_ERROR, ITERATIONS, PENDING, POSITION_ERROR, PROJECTED, REACHED, ROTATION_ERROR, Rows
from ..kernels.threads import in_blocks
from .approach import home_start, no_starts, starts_at
from .corners import corners_of
from .nearest import nearest_actuators
from .one import Ends, scratch_of
from .table import machine_searched

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

    Without a start, the row's own configuration is looked for from elsewhere too.

    Parameters
    ----------
    sides : which of its two solutions each leg takes at the start, (n or 1, legs).
    tried : the arrays of one row that does not assemble from the start.

    Returns
    -------
    The rows, the coordinates of the legs' carriers (n, legs) [L or rad], and the sides of the answers (n, legs).
    """
    own = home_start(mechanism, table) if start is None else starts_at(mechanism, table, start.rows.poses, sides)
    rows, (wanted, *ends) = tried or _assembled_from(mechanism, table, values, own)
    found, rest = Starts(rows.poses, *ends), np.flatnonzero(rows.status == PENDING)
    if start is None and len(rest):
        filled = rows.status, wanted, *found, rows.measures
        parts = [array[rest] for array in (rows.actuators, *filled)]
        _assemble(mechanism, table, own, corners_of(mechanism), parts)
        for array, part in zip(filled, parts[1:], strict=True):
            array[rest] = part
        rest = np.flatnonzero(rows.status == PENDING)
    if len(rest):
        _project(mechanism, table, wanted, own, rest, rows, found, anywhere=start is None)
        near = rest[rows.measures[rest, ACTUATOR_ERROR] <= tolerance]
        rows.status[near[rows.status[near] == PROJECTED]] = REACHED
    return rows, found.q, found.sides


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
    ended = nearest_actuators(mechanism, values[places], first, corners=anywhere)
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

    legs, scratch, elsewhere = machine_searched(table), scratch_of(mechanism, table), Handle(others)

    def run(block: slice) -> None:
        first, (values, *filled) = Handle(own.of(block)), (a[block] for a in arrays)
        assemble(legs.address, scratch.address, values, first.address, elsewhere.address, *filled)

    in_blocks(run, len(arrays[0]), ROWS_A_BLOCK)
