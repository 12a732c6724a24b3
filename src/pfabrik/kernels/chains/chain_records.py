"""A serial chain of unit motions, its configuration, and what its kernels are asked.

Lengths are in units of L; coordinates are deviations from home. A degree of freedom is one turn or one slide; a ball
joint has three.

A ball joint's three freedoms are turns about axes chosen anew at every configuration. The screw of a freedom is the
twist of the end effector per unit rate: velocity of its point, then angular velocity.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints, Records
from .._jit import opener
from ..joints.linearise_loops import PRICING, PoseGradient
from ..joints.loops import BALL
from ..pose.tables import QUESTION, Question
from ..projecting import ATTEMPT, EFFORT, TALLY

SEEDS = 512
"""Most feasible configurations that are kept as starts: the nearest of them is near enough for most targets."""


class SerialChain(NamedTuple):
    """The unit motions of a chain, at home, in base coordinates, in order; m of them, with n freedoms in all."""

    kinds: Ints  # (m,): TURN, SLIDE or BALL
    axes: Floats  # (m, 3): as the chain passes them
    offsets: Floats  # (m + 1, 3): from the point of the motion before, or the origin; the last one to the end point
    freedoms: Ints  # (m,): first freedom of each
    columns: Ints  # (m,): first coordinate of each
    senses: Floats  # (m,): -1.0 where the chain passes a joint from its second body to its first, else 1.0
    lo: Floats  # (n,): ranges of turns and slides, a little inside the limits; infinite where there are none
    hi: Floats  # (n,)
    low: Floats  # (n,): the limits themselves
    high: Floats  # (n,)
    cone_motions: Ints  # (cones,): first unit motion of the joint: a ball, or the first of two turns
    cone_moved: Floats  # (cones, 3): unit vector that the joint turns
    cone_fixed: Floats  # (cones, 3): unit vector that it is to stay near
    cone_angles: Floats  # (cones,): half angles


MACHINE = np.dtype(
    [
        ("length", "f8"),  # L
        ("axes", "i8", 3),  # what the task sets of a pose, as of `description.task.Task`
        ("rotations", "i8"),
        ("frame", "i8"),
        ("turns", "i8"),  # 1: the end effector is a body; 0: a point
        ("home", "f8", 3),  # position at home [length]
        ("longest", "f8"),  # of the chain stretched out, slides too, with what counts as reached [L]
        ("is_short", "i8"),  # 1: limits leave many local minima
        ("tries", "i8"),  # most seeds that a target is reached from
        ("descents", "i8"),  # most seeds that a search for the nearest starts from
        ("bends", "i8"),  # most starts of one around the start
        ("agreements", "i8"),  # of its ends, that end it
        ("position", "f8"),  # tolerances of what counts as reached [length], [rad]
        ("rotation", "f8"),
        ("limit", "f8"),  # excess up to which a limit is kept [L or rad]
        ("met", "f8"),  # error up to which a search has met what is held [L or rad]
        ("held", "f8"),  # most that an answer may miss of the part that it holds [L or rad]
    ]
)
"""What is known of a machine beside its chain, and what counts as an answer."""

COLUMN = np.dtype(
    [
        (
            "scale",
            "f8",
        ),  # makes the coordinate dimensionless; it starts at this, times `moves`, times that of the start
        ("moves", "f8"),  # 1; 0: it is locked
        ("low", "f8"),  # range into which whole turns bring it [rad]; infinite where there is none
        ("high", "f8"),
    ]
)
"""A coordinate of a joint, beside the chain too."""


class ChainTables(NamedTuple):
    """All that is needed to answer targets."""

    machine: Records  # (1,): MACHINE
    chain: SerialChain
    columns: Records  # (columns,): COLUMN
    driven: Ints  # (n_a,): columns of the actuators
    home: Floats  # (n_a,): their values at home [length or rad]
    weights: Floats  # (1 + projections, 6): that hold all that counts, then of the projections tried in turn
    holds: Ints  # (1 + projections,): what these hold
    prices: Floats  # (1 + projections, 2): price up to which they do, 0 for any, and the share it is rounded off by
    seeds: Floats  # (seeds, columns): feasible configurations, dimensionless
    seed_poses: Floats  # (seeds, 4, 4) [L]


class ChainState(NamedTuple):
    """One configuration, changed in place."""

    q: Floats  # (n,): turns and slides; nothing for the freedoms of balls
    balls: Floats  # (m, 4): quaternions of ball joints; no rows if there is none, nor a cone


class ChainScratch(NamedTuple):
    """Scratch memory of one thread."""

    state: ChainState
    best: ChainState
    saved: ChainState
    unpulled: ChainState
    nearest: ChainState
    start: ChainState
    own: ChainState  # where the searches for the nearest start first
    held: ChainState  # the nearest by the price, before it is held exactly
    kept: ChainState  # the nearest of the searches before
    begin: ChainState  # `own`, before it is changed
    local: ChainState  # the nearest around the start
    X: Floats  # (3, 4): pose of the end effector
    start_X: Floats  # (3, 4)
    nearest_X: Floats  # (3, 4)
    held_X: Floats  # (3, 4)
    kept_X: Floats  # (3, 4)
    local_X: Floats  # (3, 4)
    target: Floats  # (4, 4) [L]: no farther away than SIGHT
    between: Floats  # (4, 4): a target on the way there
    pulled: Floats  # (4, 4): a target farther out
    pose: Floats  # (4, 4) [length]: the target as it is asked for, exactly orthonormal
    coordinates: Floats  # (columns,), dimensionless: of the start, then of the answer
    bent: Floats  # (columns,), dimensionless: a start moved a little
    screws: Floats  # (n, 6)
    couplings: Floats  # (n, 6)
    rests: Floats  # (n, 7): right-hand sides: of the gradient, then of the held components
    responses: Floats  # (n, 7): step, or slope of a fixed freedom; then its changes per unit of each multiplier
    centres: Floats  # (n, 3): a point on the axis of each freedom
    least: Floats  # (n,): bounds of the step of each freedom
    most: Floats  # (n,)
    bend: Floats  # (n,): second derivative of an active cone, times its multiplier
    step: Floats  # (n,)
    force: Floats  # (n,): gradient of the objective in the freedoms
    pivots: Floats  # (n,)
    fixed: Ints  # (n,): 1 where the step of a freedom is given, as of a bound, 2 where only this step's, else 0
    cones: Floats  # (cones, 5): how the freedoms of a joint near its cone are turned, as of `frame_cone`
    gradient: PoseGradient
    sums: Floats  # (6, 6): of products of screws
    P: Floats  # (6, 6): second derivatives of the objective, as of `fill_curvature`
    M: Floats  # (6, 6): those of the cost of the freedoms further out
    A: Floats  # (6, 7): system of the held components, or of the rows to reach
    sides: Floats  # (7, 6): sums of right-hand sides
    shifts: Floats  # (7, 6): twists of the freedoms further in
    total: Floats  # (6,): force and moment at the end, of objective and multipliers
    wanted: Floats  # (6,): by what the held components are to change
    multipliers: Floats  # (6,): of the held components
    distances: Floats  # (SEEDS,): of the seeds from a target; infinite for those that were tried
    effort: Records  # (1,): EFFORT
    tally: Records  # (1,): TALLY
    log: Records  # (attempts,): ATTEMPT; most have no rows


def new_chain_state(chain: SerialChain) -> ChainState:
    """Allocate a configuration."""
    has_balls = (chain.kinds == BALL).any() or len(chain.cone_angles) > 0
    return ChainState(np.zeros(len(chain.lo)), np.zeros((len(chain.kinds) if has_balls else 0, 4)))


def new_chain_scratch(chain: SerialChain, columns: int, attempts: int) -> ChainScratch:
    """Allocate the memory of one thread, with room to note so many attempts."""
    n, zeros = len(chain.lo), np.zeros
    return ChainScratch._make(
        (
            *(new_chain_state(chain) for _ in range(11)),
            *zeros((6, 3, 4)),
            *zeros((4, 4, 4)),
            *zeros((2, columns)),
            *zeros((2, n, 6)),
            *zeros((2, n, 7)),
            zeros((n, 3)),
            *zeros((6, n)),
            zeros(n, np.int64),
            zeros((len(chain.cone_angles), 5)),
            PoseGradient(zeros(6), zeros((6, 6)), zeros(6), np.ones(1), zeros(6), zeros(1, PRICING)),
            *zeros((3, 6, 6)),
            zeros((6, 7)),
            *zeros((2, 7, 6)),
            *zeros((3, 6)),
            zeros(SEEDS),
            *(zeros(1, record) for record in (EFFORT, TALLY)),
            zeros(attempts, ATTEMPT),
        )
    )


_TYPES = "i1 f2 f2 i1 i1 f1 f1 f1 f1 f1 i1 f2 f2 f1"

CHAIN = SerialChain._make(np.zeros((2,) * int(each[1]), f"{each[0]}8") for each in _TYPES.split())
"""A chain of the types that kernels are compiled for."""

TABLES = ChainTables(
    np.zeros(1, MACHINE),
    CHAIN,
    np.zeros(1, COLUMN),
    np.zeros(1, np.int64),
    np.zeros(1),
    np.zeros((2, 6)),
    np.zeros(2, np.int64),
    np.zeros((2, 2)),
    np.zeros((1, 1)),
    np.zeros((1, 4, 4)),
)

open_chain, open_chain_scratch = opener(CHAIN), opener(new_chain_scratch(CHAIN, 1, 0))
open_tables, open_question = opener(TABLES), opener(Question(np.zeros(1, QUESTION)))
"""Functions that open the arguments of kernels at the addresses of their handles."""
