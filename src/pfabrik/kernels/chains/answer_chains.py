"""Kernels of serial chains: targets answered, and configurations posed."""

from __future__ import annotations

import math

from ...common.arrays import Floats, Record
from .._jit import routine, search
from ..legs.complete_poses import is_pose, orthonormalise
from ..pose.answer_row import errors
from ..pose.tables import BY_LEGS
from ..projecting import UNBOUNDED
from ..rows import (
    FAILED,
    HOLD,
    HOLD_NOTHING,
    HOLD_ORIENTATION,
    HOLD_POSITION,
    ITERATIONS,
    LARGEST_NUMBER,
    LIMIT_EXCESS,
    PENDING,
    POSITION_ERROR,
    PROJECTED,
    REACHED,
    ROTATION_ERROR,
    Rows,
)
from ..search_constants import SIGHT
from ..vectors import copy_row, copy_table
from .chain_records import ChainScratch, ChainTables, open_chain, open_chain_scratch, open_question, open_tables
from .search_chain import project, reach
from .walk_chain import copy_chain_state, excess_of, load_chain, store_chain, walk_chain


@search
def answer_chains(
    tables_address: int,
    scratch_address: int,
    question_address: int,
    follows: bool,
    targets: Floats,
    starts: Floats,
    coordinates: Floats,
    rows: Rows,
) -> int:
    """Answer targets (n, 4, 4) [length]: reached, or brought nearest; FAILED or PENDING where that finds nothing.

    Parameters
    ----------
    tables_address, scratch_address, question_address : of `ChainTables`, of `ChainScratch`, and of a QUESTION.
    follows : each row starts from the answer to the one before, up to one that is not reached.
    starts : joint coordinates, deviations from home, one row for each target or one for all [length or rad].
    coordinates : of the answers, (n, columns) [length or rad].

    Returns
    -------
    The number of rows that are not REACHED.
    """
    tables, s, question = (
        open_tables(tables_address),
        open_chain_scratch(scratch_address),
        open_question(question_address).asked[0],
    )
    n_missed = 0
    for row in range(targets.shape[0]):
        if follows and row > 0:
            copy_row(coordinates[row - 1], coordinates[row])
        else:
            copy_row(starts[row if starts.shape[0] > 1 else 0], coordinates[row])
        has_start = question["has_start"] == 1 or (follows and row > 0)
        rows.status[row] = answer_chain(tables, s, question, has_start, targets[row], coordinates[row], row, rows)
        if rows.status[row] != REACHED:
            n_missed += 1
            if follows:
                break
    return n_missed


@routine
def answer_chain(
    tables: ChainTables,
    s: ChainScratch,
    question: Record,
    has_start: bool,
    asked: Floats,
    coordinates: Floats,
    row: int,
    rows: Rows,
) -> int:
    """Answer one target from joint coordinates, which become the answer's; the status."""
    chain, columns, effort = tables.chain, tables.columns, s.effort[0]
    if not is_pose(asked):
        return PENDING
    effort["steps"] = effort["searches"] = 0
    for j in range(coordinates.shape[0]):
        s.coordinates[j] = coordinates[j] * columns[j]["moves"] * columns[j]["scale"]
    is_clipped = read_target(tables.machine[0], asked, s)
    load_chain(chain, s.coordinates, True, s.start)
    walk_chain(chain, s.start, s)
    copy_table(s.X, s.start_X)
    most = question["most_steps"]
    effort["most"] = (most + 1) // 2 if most > 0 else UNBOUNDED
    error = reach(tables, question, s)
    effort["most"] = most if most > 0 else UNBOUNDED
    if is_clipped or error > tables.machine[0]["met"]:
        if question["last"] == BY_LEGS:
            return PENDING
        copy_chain_state(s.nearest, s.own)
        if project(tables, question, has_start, s) == math.inf:
            if most == 0:
                return FAILED
            copy_chain_state(s.start, s.nearest)
            copy_table(s.start_X, s.nearest_X)
    return write_answer(tables, s, coordinates, row, rows)


@routine
def read_target(machine: Record, asked: Floats, s: ChainScratch) -> bool:
    """Fill the target in both units; True if it is so far away that it was moved towards home."""
    copy_table(asked, s.pose)
    orthonormalise(s.pose)
    copy_table(s.pose, s.target)
    far, largest, scale = SIGHT * machine["length"], 0.0, 1.0 / machine["length"]
    for i in range(3):
        largest = max(largest, abs(asked[i, 3] - machine["home"][i]))
    for i in range(3):
        if largest > far:
            s.target[i, 3] = machine["home"][i] + (asked[i, 3] - machine["home"][i]) * (far / largest)
        s.target[i, 3] *= scale
    return largest > far


@routine
def write_answer(tables: ChainTables, s: ChainScratch, coordinates: Floats, row: int, rows: Rows) -> int:
    """Write the nearest configuration; the status."""
    machine, columns, driven = tables.machine[0], tables.columns, tables.driven
    counters, pose, actuators, measures = rows.counters[row], rows.poses[row], rows.actuators[row], rows.measures[row]
    store_chain(tables.chain, s.nearest, s.coordinates)
    for j in range(coordinates.shape[0]):
        coordinates[j] = within_turns(columns[j], s.coordinates[j] / columns[j]["scale"])
    for i in range(driven.shape[0]):
        actuators[i] = coordinates[driven[i]] + tables.home[i]
    write_pose(s.nearest_X, machine["length"], pose)
    excess = excess_of(tables.chain, s.nearest, s)
    position, rotation = errors(machine, s.pose, pose, s.gradient.turn)
    hold = tables.holds[1]
    if hold == HOLD_ORIENTATION and rotation > machine["held"]:
        hold = HOLD_NOTHING
    if hold == HOLD_POSITION and position > machine["held"]:
        hold = HOLD_NOTHING
    position = min(position * machine["length"], LARGEST_NUMBER)
    if machine["turns"] == 0:
        for i in range(3):
            for j in range(3):
                pose[i, j] = 1.0 if i == j else 0.0
    for k in range(counters.shape[0]):
        counters[k] = 0
    for k in range(measures.shape[0]):
        measures[k] = 0.0
    counters[ITERATIONS], counters[HOLD] = s.effort[0]["steps"], hold
    measures[POSITION_ERROR], measures[ROTATION_ERROR], measures[LIMIT_EXCESS] = position, rotation, max(excess, 0.0)
    if excess > machine["limit"]:
        return FAILED
    return REACHED if position <= machine["position"] and rotation <= machine["rotation"] else PROJECTED


@routine
def within_turns(column: Record, value: float) -> float:
    """An angle shifted by whole turns into its range, if possible."""
    if value < column["low"] or value > column["high"]:
        shifted = value - 2.0 * math.pi * math.floor((value - column["low"]) / (2.0 * math.pi))
        return shifted if shifted <= column["high"] else value
    return value


@routine
def write_pose(X: Floats, length: float, pose: Floats) -> None:
    """Write a pose (4, 4) [length] from one (3, 4) [L]."""
    for i in range(3):
        pose[3, i] = 0.0
        for j in range(4):
            pose[i, j] = X[i, j] * length if j == 3 else X[i, j]
    pose[3, 3] = 1.0


@search
def walk_chains(
    machine: int, scratch_address: int, coordinates: Floats, poses: Floats, excesses: Floats, screws: Floats
) -> None:
    """Pose the end effectors of configurations (n, columns), dimensionless, and measure their limits.

    Parameters
    ----------
    machine, scratch_address : addresses of a `SerialChain` and of its `ChainScratch`.
    poses, excesses : output, (n, 4, 4) [L], and the largest excess over a limit, (n,) [L or rad].
    screws : output, of all freedoms, (n, freedoms, 6), or without rows.
    """
    chain, s = open_chain(machine), open_chain_scratch(scratch_address)
    for row in range(coordinates.shape[0]):
        load_chain(chain, coordinates[row], False, s.state)
        walk_chain(chain, s.state, s)
        write_pose(s.X, 1.0, poses[row])
        excesses[row] = excess_of(chain, s.state, s)
        if len(screws) > 0:
            copy_table(s.screws, screws[row])
