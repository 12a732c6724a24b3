"""All that kernels need of a machine to answer targets in joint coordinates, and what is asked; lengths in L."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints, Records
from ..clearance.link_records import LinkLimits
from ..projecting import TALLY
from .close import ClosingScratch, new_closing_scratch
from .linearise_loops import DescentScratch, new_descent_scratch
from .loops import Closed, Layout, Loops

# What is asked of a target: one step there, the platform brought there in the working mode of the start; searches in
# other modes too, then for the nearest configuration; only the latter; loops closed where the start lets expect them;
# one step there, if it is no longer than keeps the mode.
STEP, REACH, ANSWER, NEAREST, EXPECTED, PROMPT = 0, 1, 2, 3, 4, 5

ASKED = np.dtype(
    [
        ("verb", "i8"),  # STEP ... PROMPT
        ("keeps_mode", "i8"),  # 1: searches stay around the start
        ("has_start", "i8"),  # 1: the start was given, 0: it is home
        ("leg_by_leg", "i8"),  # 1: of loops closed as expected, each leg may be searched for alone
        ("most_steps", "i8"),  # configurations that may be linearised in all; 0 if there is no bound
    ]
)
"""What is asked of targets."""

MACHINE = np.dtype(
    [
        ("frame", "i8"),  # axes of the rotations that the task sets
        ("is_whole", "i8"),  # 1: the task sets the whole pose
        ("follows", "i8"),  # 1: the mechanism determines what the task leaves out
        ("varies", "i8"),  # 1: that varies as the mechanism moves; 0: it is that of home, else the platform has flipped
        ("has_others", "i8"),  # 1: where it follows, other assembly modes reach other targets
        ("asks_all", "i8"),  # 1: these are searched for from random starts, too
        ("is_point", "i8"),  # 1: the end effector is a joint
        ("is_redundant", "i8"),  # 1: actuators move while the end effector rests
        ("has_seeds", "i8"),  # 1: seeds, and the other starts of searches, are known
        ("closing_steps", "i8"),  # most steps that close loops on a target
        ("search_steps", "i8"),  # and from other starts
        ("continuation_steps", "i8"),  # and in each step of a continuation
        ("nearby", "i8"),  # most starts among the random configurations
        ("random", "i8"),  # most random starts
        ("descents", "i8"),  # most descents
        ("descent_steps", "i8"),  # of all descents together
        ("closed", "f8"),  # largest gap of a closed path [L or rad]
        ("near", "f8"),  # of platforms that a task's constraints complete [L or rad]
        ("limit", "f8"),  # largest excess over a limit that counts as kept
        ("inside", "f8"),  # distance inside the limits that answers keep
        ("active", "f8"),  # of limits that have multipliers
        ("same_mode", "f8"),  # largest difference of poses of one platform that has not flipped
        ("position", "f8"),  # tolerance of a position [length]
        ("rotation", "f8"),  # of a rotation [rad]
        ("held", "f8"),  # most that answers miss of the part that they hold [L or rad]
    ]
)
"""What is known of a machine, beside its loops."""


class JointQuestion(NamedTuple):
    """Options of the question, common to all targets."""

    asked: Records  # (1,): ASKED


class Answered(NamedTuple):
    """Answers, row by row."""

    coordinates: Floats  # (n, columns): deviations from home [length or rad]
    counters: Ints  # and the others as in `Rows`
    poses: Floats
    actuators: Floats
    measures: Floats


class JointTables(NamedTuple):
    """All that is needed to answer targets in joint coordinates."""

    machine: Records  # (1,): MACHINE
    task: Records  # (1,): TASK
    loops: Loops
    layout: Layout
    following: Layout  # with the ball joints locked that follow the platform
    moves: Floats  # (columns,): 0 for rigid joints, else 1
    idle: Ints  # (columns,): 1 for coordinates on no path
    scale: Floats  # (columns,): 1 / L for lengths, 1 for angles
    actuated: Ints  # (n_a,): columns of the actuators
    home: Floats  # (n_a,): their values at home
    nothing: Floats  # (6,): weights that hold nothing of a pose
    whole: Floats  # (6,): all of it
    held: Floats  # (6,): what the task sets
    weights: Floats  # (aims, 6): of the projections: 1 that holds nothing, or HELD ... COARSE
    holds: Ints  # (aims,): what each holds
    prices: Floats  # (aims, 2): price up to which it does, 0 for any, and the share it is rounded off by
    reaches: Floats  # (paths, 7): first point of each path, its last in the platform's axes, and the way between them
    seeds: Floats  # (k, columns)
    nearby: Floats  # (n, columns): random feasible configurations
    nearby_poses: Floats  # (n, 4, 4)
    random: Floats  # (n, columns): random starts


class JointScratch(NamedTuple):
    """Scratch memory of one thread; configurations are of one row."""

    closing: ClosingScratch
    descent: DescentScratch
    begin: Closed  # the start
    reached: Closed  # where the platform was brought to the target, or nearest to it
    start: Closed  # of a descent or a closing
    trial: Closed  # its end
    answer: Closed
    nearest: Closed  # of other searches, to be compared
    priced: Closed  # by its price
    tally: Records  # (1,): TALLY
    agreements: Floats  # (groups,)
    distances: Floats  # (n,): of random configurations
    target: Floats  # (1, 4, 4)
    pose: Floats  # (4, 4): the target, with what it leaves open
    wished: Floats  # (4, 4): a pose on the way there
    present: Floats  # (4, 4): the last pose on the way
    aside: Floats  # (4, 4): the target, while another is looked at
    turn: Floats  # (3,)
    held: Floats  # (6,): weights of the part that is held
    no_centres: Floats  # (1, 0, 3)
    no_weights: Floats  # (columns,)
    no_anchors: Floats  # (1, 0)
    no_multipliers: Floats  # (1, 0)
    log: Records  # (n,): ATTEMPT
    logged: Ints  # (1,): number of attempts


# Where attempts begin, beside seeds, and what they are, beside searches with a projection's part held.
AT_START, AT_END, TO_CLOSE = 0, -1, -1

ATTEMPT = np.dtype(
    [
        ("aim", "i8"),  # number of the projection; TO_CLOSE: loops were closed on the target
        ("start", "i8"),  # number of the seed; AT_START, or AT_END of closing loops
        ("steps", "i8"),
        ("distance", "f8"),  # of its end from the target [L]; infinite where it has none
    ]
)
"""A search."""

MOST_LOGGED = 64


def new_joint_scratch(tables: JointTables, links: LinkLimits, ways: Loops) -> JointScratch:
    """Allocate the scratch memory of one thread."""
    n, groups = len(tables.loops.lo), len(tables.loops.groups) - 1

    def new_closed() -> Closed:
        gaps, excesses, misses = np.zeros((3, 1, groups))
        return Closed(np.zeros((1, n)), np.eye(4)[None].copy(), gaps, excesses, misses, np.zeros(1, np.int64))

    return JointScratch._make(
        (
            new_closing_scratch(tables.loops, tables.layout),
            new_descent_scratch(tables.loops, links, ways),
            *(new_closed() for _ in range(7)),
            np.zeros(1, TALLY),
            np.zeros(groups),
            np.zeros(len(tables.nearby)),
            np.eye(4)[None].copy(),
            *np.tile(np.eye(4), (4, 1, 1)),
            np.zeros(3),
            np.zeros(6),
            np.zeros((1, 0, 3)),
            np.zeros(n),
            np.zeros((1, 0)),
            np.zeros((1, 0)),
            np.zeros(MOST_LOGGED, ATTEMPT),
            np.zeros(1, np.int64),
        )
    )
