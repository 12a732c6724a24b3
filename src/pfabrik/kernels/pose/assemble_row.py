"""Forward kinematics of one row: from its start, from other starts, then the nearest actuators within limits."""

from __future__ import annotations

import math

from ...common.arrays import Floats, Record
from .._jit import routine
from ..projecting import UNBOUNDED, begin_effort
from ..rows import (
    ACTUATOR_ERROR,
    EXCEEDED,
    HOLD,
    ITERATIONS,
    PENDING,
    POSITION_ERROR,
    PROJECTED,
    REACHED,
    ROTATION_ERROR,
    TOO_NEAR,
)
from ..vectors import copy_row
from .answer_row import are_apart, copy_solution, load_own, nearest_turn, put_start, turns_repeatedly
from .forward import assemble_from_others, assemble_from_own, put_deviations, write_assembled
from .nearest import nearest_of_row
from .pose_constants import WAY_HALVINGS
from .search_records import PoseSolutions, RowSearch, Starts
from .tables import BY_LEGS, NEAREST, AnswerScratch, Start, Tables


@routine
def write_reached(tables: Tables, scratch: AnswerScratch, values: Floats, answer: PoseSolutions) -> None:
    """Write the configuration that was assembled at values (n_a,)."""
    measures = answer.measures
    write_assembled(tables.assembly, 0, scratch.newton, Starts(answer.poses, answer.q, answer.sides), answer.measures)
    copy_row(values, answer.actuators[0])
    answer.status[0], measures[0, ACTUATOR_ERROR] = REACHED, 0.0


@routine
def find_values(
    tables: Tables,
    scratch: AnswerScratch,
    start: Start,
    values: Floats,
    question: Record,
    anywhere: bool,
    answer: PoseSolutions,
) -> bool:
    """Fill an answer with the feasible configuration whose actuators are nearest to values (1, n_a); True if found.

    The search takes angles modulo whole turns: PENDING if the nearest turn is out of range, else PROJECTED.

    Parameters
    ----------
    anywhere : search from the machine's seeds too.
    """
    machine, driven, worst, is_inside = tables.machine[0], tables.legs.driven, 0.0, True
    measures, counters, actuators = answer.measures, answer.counters, answer.actuators
    distance = nearest_of_row(
        tables.search,
        tables.plan,
        RowSearch(0, machine["values"], question["seeds"] if anywhere else 0, question["steps"], 0),
        start.poses,
        scratch.wished,
        Starts(scratch.own, scratch.no_q if question["has_start"] == 1 else scratch.home_q, start.sides),
        answer,
        scratch.nearest,
        scratch.no_weights,
    )
    if distance == math.inf:
        return False
    for i in range(driven.shape[0]):
        column = driven[i]["column"]
        value = actuators[0, column]
        if turns_repeatedly(driven[i]):
            value, is_there = nearest_turn(driven[i], value, values[0, column])
            is_inside = is_inside and is_there
        actuators[0, column] = value
        worst = max(worst, abs(value - values[0, column]) / driven[i]["unit"])
    measures[0, POSITION_ERROR], measures[0, ROTATION_ERROR], measures[0, ACTUATOR_ERROR] = 0.0, 0.0, worst
    counters[0, HOLD] = 0
    answer.status[0] = PROJECTED if is_inside else PENDING
    return True


@routine
def project_values(
    tables: Tables,
    scratch: AnswerScratch,
    start: Start,
    values: Floats,
    question: Record,
    anywhere: bool,
    answer: PoseSolutions,
) -> None:
    """Answer a row by what `find_values` finds, if anything."""
    if find_values(tables, scratch, start, values, question, anywhere, scratch.other):
        copy_solution(scratch.other, answer)


@routine
def is_asked_for(answer: PoseSolutions, tolerance: float) -> bool:
    """True if a projection has the values asked for."""
    return bool(answer.status[0] == PROJECTED and answer.measures[0, ACTUATOR_ERROR] <= tolerance)


@routine
def is_elsewhere(tables: Tables, scratch: AnswerScratch, start: Start, question: Record, answer: PoseSolutions) -> bool:
    """True for an answer that is not what its start assembles to at its values.

    Values to which the mode of the start does not lead count as elsewhere if they are those asked for; else they are on
    the border of what assembles.
    """
    other, table, largest, length = scratch.other, tables.assembly, 0.0, tables.legs.task[0]["length"]
    starts = Starts(scratch.own, scratch.no_q if question["has_start"] == 1 else scratch.home_q, start.sides)
    put_deviations(table, answer.actuators[0], scratch.trial)
    status = assemble_from_own(table, scratch.trial, starts, 0, scratch.newton)
    if status == PENDING:
        return is_asked_for(answer, question["tolerance"])
    if status == EXCEEDED:
        return True
    write_assembled(table, 0, scratch.newton, Starts(other.poses, other.q, other.sides), other.measures)
    for i in range(3):
        largest = max(largest, abs(other.poses[0, i, 3] - answer.poses[0, i, 3]) / length)
        for j in range(3):
            largest = max(largest, abs(other.poses[0, i, j] - answer.poses[0, i, j]))
    return bool(largest > tables.machine[0]["stretched"])


@routine
def return_to_mode(
    tables: Tables, scratch: AnswerScratch, start: Start, values: Floats, question: Record, answer: PoseSolutions
) -> None:
    """Replace a projection that is in another assembly mode than its start.

    By that of a search from the start alone, or by the last configuration within limits on the way from there to the
    values.
    """
    if not is_elsewhere(tables, scratch, start, question, answer):
        return
    answer.status[0] = PENDING
    copy_row(values[0], answer.actuators[0])
    project_values(tables, scratch, start, values, question, False, answer)
    if not is_elsewhere(tables, scratch, start, question, answer):
        return
    table, driven, own, wished, share, halving = tables.assembly, tables.legs.driven, scratch.own, values[0], 0.0, 0.0
    actuators, counters, measures, way = answer.actuators, answer.counters, answer.measures, scratch.way
    answer.status[0] = PENDING
    starts = Starts(own, scratch.no_q if question["has_start"] == 1 else scratch.home_q, start.sides)
    for _halving in range(WAY_HALVINGS):
        for i in range(way.shape[0]):
            way[i] = start.actuators[0, i] + (share + halving) * (wished[i] - start.actuators[0, i])
        put_deviations(table, way, scratch.trial)
        if assemble_from_own(table, scratch.trial, starts, 0, scratch.newton) == REACHED:
            share += halving
            write_reached(tables, scratch, way, answer)
            answer.status[0], counters[0, ITERATIONS] = PROJECTED, 0
            measures[0, ACTUATOR_ERROR] = 0.0
            for i in range(driven.shape[0]):
                error = abs(actuators[0, driven[i]["column"]] - wished[driven[i]["column"]]) / driven[i]["unit"]
                measures[0, ACTUATOR_ERROR] = max(measures[0, ACTUATOR_ERROR], error)
        halving = 0.5 if halving == 0.0 else 0.5 * halving


@routine
def assemble_elsewhere(
    tables: Tables, scratch: AnswerScratch, start: Start, values: Floats, question: Record, answer: PoseSolutions
) -> None:
    """Assemble a row that its start does not lead to: from home and from seeds, or by a search from these."""
    table, newton, home, wished = tables.assembly, scratch.newton, scratch.home, scratch.wished[0]
    load_own(tables.home.poses[0], tables.legs.task[0]["length"], home[0])
    at_home = Starts(home, scratch.home_q, tables.home.sides)
    nearest = assemble_from_others(table, wished, at_home, scratch.own[0], math.inf, newton)
    nearest = assemble_from_others(table, wished, tables.plan.seeds, scratch.own[0], nearest, newton)
    if nearest == math.inf and assemble_from_own(table, wished, at_home, 0, newton) != REACHED:
        is_found = find_values(tables, scratch, start, values, question, True, scratch.other)
        if is_found and is_asked_for(scratch.other, question["tolerance"]):
            copy_solution(scratch.other, answer)
            answer.status[0] = REACHED
        return
    write_reached(tables, scratch, values[0], answer)


@routine
def assemble_anyhow(
    tables: Tables,
    scratch: AnswerScratch,
    start: Start,
    values: Floats,
    question: Record,
    is_near: bool,
    answer: PoseSolutions,
) -> int:
    """Assemble one row at actuated values (1, n_a) [length or rad], from a start, `tables.home` if none is given.

    REACHED within all limits: in the assembly mode of the start, or, if the mode need not be kept, from home and from
    seeds. Else PROJECTED to the nearest values that a search finds, which are REACHED within `tolerance`. PENDING where
    joint coordinates go on.

    Parameters
    ----------
    scratch, answer : as of `answer_row`; `distances` is without meaning.
    question : `first` and `last` are BY_LEGS to assemble from the start alone, whose status, PENDING, or EXCEEDED if it
        leads beyond a limit, is in `answer` if `first` is later; and NEAREST to search alone.
    is_near : nothing more is asked for than what a search needs.
    """
    machine, table, first, last = tables.machine[0], tables.assembly, question["first"], question["last"]
    is_cold, own, newton = question["has_start"] == 0, scratch.own, scratch.newton
    keeps_mode = question["keeps_mode"] == 1 and machine["is_over_determined"] == 0
    status, measures = answer.status[0], answer.measures
    load_own(start.poses[0], tables.legs.task[0]["length"], own[0])
    begin_effort(question["effort"], UNBOUNDED, scratch.nearest.search.effort[0])
    put_start(start, answer)
    put_start(start, scratch.other)
    copy_row(values[0], answer.actuators[0])
    put_deviations(table, values[0], scratch.wished[0])
    if is_near:
        return TOO_NEAR
    if first == BY_LEGS:
        starts = Starts(own, scratch.home_q if is_cold else scratch.no_q, start.sides)
        status = assemble_from_own(table, scratch.wished[0], starts, 0, newton)
        answer.status[0] = status
        if status == REACHED:
            write_reached(tables, scratch, values[0], answer)
        if status == REACHED or last == BY_LEGS:
            return int(status)
    if first < NEAREST and is_cold and not keeps_mode:
        nearest = assemble_from_others(table, scratch.wished[0], tables.plan.seeds, own[0], math.inf, newton)
        if nearest < math.inf:
            write_reached(tables, scratch, values[0], answer)
            return REACHED
    is_missed = status == PENDING and first < NEAREST and not is_cold and not keeps_mode
    answer.status[0] = PENDING
    project_values(tables, scratch, start, values, question, is_cold, answer)
    if keeps_mode and first < NEAREST:
        return_to_mode(tables, scratch, start, values, question, answer)
    if is_asked_for(answer, question["tolerance"]):
        answer.status[0] = REACHED
    is_near = machine["is_over_determined"] == 1 and answer.status[0] != PENDING
    is_missed = is_missed and not (is_near and measures[0, ACTUATOR_ERROR] <= machine["noise"])
    if is_missed and answer.status[0] != REACHED:
        assemble_elsewhere(tables, scratch, start, values, question, answer)
    return int(answer.status[0])


@routine
def assemble_row(
    tables: Tables, scratch: AnswerScratch, start: Start, values: Floats, question: Record, answer: PoseSolutions
) -> int:
    """Assemble one row as `assemble_anyhow` does, so that links are apart, by a search where they would be too near.

    TOO_NEAR, as status of the answer, tells that the start alone leads to such links.
    """
    links, is_known = scratch.nearest.search.links, question["first"] > BY_LEGS and answer.status[0] == TOO_NEAR
    links.kept[0] = 0
    status = assemble_anyhow(tables, scratch, start, values, question, is_known, answer)
    is_found = status == REACHED or answer.status[0] == PROJECTED
    if is_found and not are_apart(tables, scratch, answer.poses[0], answer.sides[0]):
        status = answer.status[0] = TOO_NEAR
    if status == TOO_NEAR and question["last"] > BY_LEGS:
        links.kept[0] = links.pairs.shape[0]
        put_start(start, answer)
        copy_row(values[0], answer.actuators[0])
        answer.status[0] = PENDING
        project_values(tables, scratch, start, values, question, question["has_start"] == 0, answer)
        if is_asked_for(answer, question["tolerance"]):
            answer.status[0] = REACHED
    return int(answer.status[0])
