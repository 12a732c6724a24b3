"""Poses at actuators, in the assembly mode of a start."""

from __future__ import annotations

import math
from typing import NamedTuple

from ...common.arrays import Floats, Ints
from .._jit import routine
from ..legs.complete_poses import is_pose, load_pose, orthonormalise, put_pose
from ..legs.records import Table
from ..pose.equations import evaluate_legs
from ..pose.forward import NewtonScratch, assemble_from_others, assemble_from_own, load_start, newton, put_deviations
from ..pose.nearest import is_other_mode
from ..pose.pose_constants import ASSEMBLED, NEARLY_ASSEMBLED
from ..pose.search_records import Starts
from ..pose.starts import put_sides
from ..rows import PENDING
from ..vectors import copy_row
from .reached import LEG, NO_ACTUATORS, NO_POSE, OTHER_MODE, Reaching, farthest_leg, rest_from, too_near


class Assembling(NamedTuple):
    """A machine whose pose follows from actuators, and the memory of a call."""

    table: Table  # with the cones of searches
    start: Starts  # one: that of a call
    seeds: Starts  # for more actuators than freedoms; else none
    stays: Ints  # (1,): 1 to stay in the assembly mode of the start; 0 with more actuators than freedoms
    deviations: Floats  # (1, n_a): of the actuators from home [L or rad]
    scratch: NewtonScratch


@routine
def put_start(start: Starts, reaching: Reaching, pose: Floats) -> None:
    """Fill a start with a whole pose (4, 4) [length] in home's working mode, implicit joints nearest to `begin`."""
    copy_row(reaching.home.sides[0], start.sides[0])
    if reaching.near.task[0]["implicit"] == 1:
        rest_from(reaching, pose)
        copy_row(reaching.scratch.sides, start.sides[0])
    load_pose(pose, reaching.near.task[0]["length"], start.poses[0])
    orthonormalise(start.poses[0])


@routine
def assemble(own: Assembling, reaching: Reaching, actuators: Floats, pose: Floats) -> int:
    """The pose at actuators, from a pose (4, 4) [length], which it replaces; a code; limits are not checked.

    OTHER_MODE where the assembly mode ends on the way, or another working mode begins.
    """
    size, state, table, status = 0.0, own.scratch.state, own.table, PENDING
    for i in range(actuators.shape[0]):
        size += actuators[i]
    if not abs(size) < math.inf:
        return NO_ACTUATORS
    if not is_pose(pose):
        return NO_POSE
    put_deviations(table, actuators, own.deviations[0])
    copy_row(reaching.home.sides[0], reaching.begin)
    for i in range(table.driven.shape[0]):  # there may be several places of an implicit joint at a pose
        driven = table.driven[i]
        if table.legs[driven["leg"]]["implicit"] == 1:
            reaching.begin[driven["leg"]] = driven["sense"] * own.deviations[0, driven["column"]]
    put_start(own.start, reaching, pose)
    own.scratch.steps[0] = 0
    wished = own.deviations[0]
    if own.stays[0] == 1:
        status = assemble_from_own(table, wished, own.start, 0, own.scratch)
    if status == PENDING:
        load_start(table, own.start, 0, own.scratch)
        copy_row(wished, own.scratch.values)
        worst = newton(table, ASSEMBLED, False, own.scratch)
        if own.seeds.poses.shape[0] > 0 and not worst <= NEARLY_ASSEMBLED:  # where they agree least badly, not at all
            worst = assemble_from_others(table, wished, own.seeds, own.start.poses[0], math.inf, own.scratch)
            worst = 0.0 if worst < math.inf else worst
        if not worst <= NEARLY_ASSEMBLED:
            return LEG + 1 + farthest_leg(table, own.scratch.leg_eval.rows)
    orthonormalise(state.pose)
    put_pose(state.pose, table.task[0]["length"], pose)
    put_sides(table, state, own.scratch.leg_eval)
    has_left = own.stays[0] == 1 and status == PENDING
    if has_left or is_other_mode(table.legs, state.sides, reaching.home.sides[0]):
        return OTHER_MODE
    links, leg_eval = reaching.links, own.scratch.leg_eval
    if links.pairs.shape[0] > 0:
        evaluate_legs(table, state, leg_eval)
        return too_near(links, table, leg_eval.frames, leg_eval.values, leg_eval.lines, reaching.distance)
    return 0
