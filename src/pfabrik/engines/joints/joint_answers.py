"""Targets answered in joint coordinates by one kernel, with all that it needs of a machine."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial
from typing import TYPE_CHECKING

import numpy as np

from ...common.arrays import Floats, Ints, Records
from ...common.batch import take
from ...common.derived import derived, is_derived
from ...kernels.handle import Handle, Scratch
from ...kernels.joints.joint_constants import A_DESCENT, MOST_CLOSING, NEARBY, STARTS, STEPS
from ...kernels.joints.joint_tables import (
    ASKED,
    MACHINE,
    PROMPT,
    Answered,
    JointQuestion,
    JointTables,
    new_joint_scratch,
)
from ...kernels.joints.loops import LOCKED
from ...kernels.legs.records import TASK
from ...kernels.rows import OPEN, Rows
from ...kernels.search_constants import CONTINUATION_STEPS
from ...kernels.threads import in_blocks
from ...machine.description.home_mobility import column_moves
from ...machine.model import Model
from ...machine.motion.mobility import generic_of
from ...options import USUAL, Options
from ...tolerances import TOLERANCES
from .close import CLOSED, in_lengths, locking
from .configurations import new_rows
from .effort import descending_steps, starts_within, steps_per_continuation_step, steps_within
from .multistart import random_coordinates, random_feasible, seeds_of
from .parasitic import asks_too_much, follows_task, has_parasitic_motion
from .placed_links import links_on_paths
from .projection import projection_modes, with_coarse
from .reaches import reaches_of

if TYPE_CHECKING:
    from ...kernels.joints.joint_tables import JointScratch

ROWS_A_BLOCK, ROWS_A_RUN = 16, 1024


def answer_rows(
    model: Model, targets: Floats, begin: Floats, options: Options, question: Handle[JointQuestion], rows: Rows
) -> Floats:
    """Answer targets (n, 4, 4) from joint coordinates (n, columns), or (1, columns) for all, in `rows`; those found.

    Seeds are found only once some target needs them.
    """
    from ...kernels.joints.answer_joints import answer_joints

    n, coordinates = len(targets), np.empty((len(targets), begin.shape[1]))
    answers = Answered(coordinates, rows.counters, rows.poses, rows.actuators, rows.measures)
    rows.status[:] = OPEN
    for with_seeds in (True,) if is_derived(seeds_of, model.path_closure) else (False, True):
        tables, scratch = prepared(model, options, with_seeds)
        addresses = tables.address, scratch.address, question.address
        if n <= ROWS_A_BLOCK:
            n_open = answer_joints(*addresses, targets, begin, answers, rows.status)
        else:
            blocks = in_blocks(
                partial(_answer_block, tables, scratch, question, targets, begin, answers, rows.status), n, ROWS_A_BLOCK
            )
            n_open = sum(blocks)
        if not n_open:
            break
    return coordinates


def near_rows(model: Model, coordinates: Floats) -> Ints:
    """The rows of joint coordinates (n, columns) whose links are nearer than the clearance; none without one."""
    is_near = np.zeros(len(coordinates), np.int64)
    if model.mechanism.clearance is not None:
        from ...kernels.joints.answer_joints import note_near

        tables, scratch = prepared(model, USUAL, False)
        coordinates = np.ascontiguousarray(coordinates)
        in_blocks(
            lambda block: note_near(tables.address, scratch.address, coordinates[block], is_near[block]),
            len(is_near),
            ROWS_A_RUN,
        )
    return np.flatnonzero(is_near)


def _answer_block(
    tables: Handle[JointTables],
    scratch: Scratch[JointScratch],
    question: Handle[JointQuestion],
    targets: Floats,
    begin: Floats,
    answers: Answered,
    status: Ints,
    block: slice,
) -> int:
    """Answer a block of the rows; the number of rows that are left open."""
    from ...kernels.joints.answer_joints import answer_joints

    start, addresses = begin[block] if len(begin) > 1 else begin, (tables.address, scratch.address, question.address)
    return answer_joints(*addresses, targets[block], start, take(answers, block), status[block])


def logged(
    model: Model, target: Floats, begin: Floats, options: Options, question: Handle[JointQuestion]
) -> tuple[Records, Ints, Floats]:
    """The log of a search for a target (1, 4, 4), and what each of its projections holds at what price."""
    from ...kernels.joints.answer_joints import answer_joints

    tables, rows = prepared(model, options, True)[0], new_rows(model, 1)
    scratch = Handle(new_joint_scratch(tables.record, *links_on_paths(model.mechanism)))
    rows.status[:] = OPEN
    answers = Answered(begin.copy(), rows.counters, rows.poses, rows.actuators, rows.measures)
    answer_joints(tables.address, scratch.address, question.address, target, begin, answers, rows.status)
    return scratch.record.log[: scratch.record.logged[0]], tables.record.holds, tables.record.prices


def prompt_call(
    model: Model, target: Floats, begin: Floats, rows: Rows, keep_mode: bool, has_start: bool
) -> tuple[Callable[[], int], object]:
    """A call that reaches the pose in `target` in one step from joint coordinates, into `rows`, and what it needs."""
    from ...kernels.joints.answer_joints import answer_joints

    tables, question = prepared(model, USUAL, False)[0], question_of(PROMPT, keep_mode, has_start)
    scratch = Handle(new_joint_scratch(tables.record, *links_on_paths(model.mechanism)))
    answers = Answered(begin.copy(), rows.counters, rows.poses, rows.actuators, rows.measures)
    addresses = tables.address, scratch.address, question.address
    return partial(answer_joints, *addresses, target, begin, answers, rows.status), (tables, scratch, question)


@lru_cache(maxsize=64)
def question_of(
    verb: int,
    keeps_mode: bool = False,
    has_start: bool = False,
    leg_by_leg: bool = False,
    most_steps: int | None = None,
) -> Handle[JointQuestion]:
    """The question of all targets."""
    asked = np.zeros(1, ASKED)
    asked[0] = verb, keeps_mode, has_start, leg_by_leg, most_steps or 0
    return Handle(JointQuestion(asked))


def prepared(model: Model, options: Options, with_seeds: bool) -> tuple[Handle[JointTables], Scratch[JointScratch]]:
    """All that kernels need of a machine to answer targets in joint coordinates, and scratch memory."""
    tolerances = options.tolerance, options.rotation_tolerance
    return _prepared(model, options.hold, options.rotation_length, options.hold_price, *tolerances, with_seeds)


@derived
def _prepared(
    model: Model,
    hold: str | None,
    rotation_length: float | None,
    hold_price: float,
    tolerance: float | None,
    rotation_tolerance: float,
    with_seeds: bool,
) -> tuple[Handle[JointTables], Scratch[JointScratch]]:
    closure, mechanism, task = model.path_closure, model.mechanism, model.task
    follows, varies, scale = follows_task(closure), has_parasitic_motion(closure), closure.scale
    has_others = follows and (varies or asks_too_much(closure))
    nearby, poses = random_feasible(closure) if with_seeds else (np.zeros((0, len(scale))), np.zeros((0, 4, 4)))
    seeds = np.reshape(seeds_of(closure) if with_seeds else (), (-1, len(scale)))
    projections = with_coarse(projection_modes(closure, hold, rotation_length, hold_price))
    random, rng = [], np.random.default_rng(0)
    for _ in range(STARTS):
        random.append(random_coordinates(closure, 1, rng))
    steps = descending_steps(closure)
    machine, asked = np.zeros(1, MACHINE), np.zeros(1, TASK)
    fields = {
        "frame": task.frame,
        "is_whole": task.is_whole_pose,
        "follows": follows,
        "varies": varies,
        "has_others": has_others,
        "asks_all": has_others and (asks_too_much(closure) or (with_seeds and len(nearby) < NEARBY)),
        "is_point": mechanism.end_effector_is_joint,
        "is_redundant": generic_of(mechanism).mobility.internal > 0,
        "has_seeds": with_seeds,
        "closing_steps": steps_within(closure, MOST_CLOSING),
        "search_steps": steps_within(closure, STEPS),
        "continuation_steps": steps_per_continuation_step(closure, MOST_CLOSING, CONTINUATION_STEPS),
        "nearby": starts_within(closure, NEARBY, STEPS),
        "random": starts_within(closure, STARTS, STEPS),
        "descents": max(1, steps // A_DESCENT),
        "descent_steps": steps,
        "closed": CLOSED,
        "near": TOLERANCES.position,
        "limit": TOLERANCES.limit,
        "inside": TOLERANCES.inside,
        "active": TOLERANCES.active,
        "same_mode": TOLERANCES.same_mode,
        "position": tolerance or TOLERANCES.position * mechanism.characteristic_length,
        "rotation": rotation_tolerance,
        "held": TOLERANCES.held,
    }
    for name, value in fields.items():
        machine[name] = value
    asked["length"], asked["axes"], asked["rotations"] = mechanism.characteristic_length, task.axes, task.rotations
    layout, following = (locking(closure, locked)[0].record for locked in (frozenset[int](), closure.last_balls))
    tables = JointTables(
        machine,
        asked,
        closure.loops,
        layout,
        following,
        np.array(column_moves(mechanism)),
        closure.idle.astype(np.int64),
        scale,
        closure.actuated,
        closure.home,
        np.zeros(6),
        np.full(6, LOCKED),
        np.array(task.held),
        np.array([projection.weights for projection in projections]),
        np.array([projection.hold for projection in projections]),
        np.array([(projection.price, projection.rounding) for projection in projections]),
        reaches_of(closure.loops),
        seeds * scale,
        nearby * scale,
        in_lengths(poses, 1.0 / mechanism.characteristic_length),
        np.concatenate(random) * scale,
    )
    return Handle(tables), Scratch(new_joint_scratch, tables, *links_on_paths(mechanism))
