"""A serial chain of unit motions from the base to the end effector, what kernels are asked of it, and their answers.

Lengths are in units of L; coordinates are deviations from home. A degree of freedom is one turn or one slide; a ball
joint has three.
"""

from __future__ import annotations

from typing import NamedTuple

from ...arrays import Floats, Ints
from ..closure.loops import PoseObjective

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


class ChainAim(NamedTuple):
    """What is asked of all rows; lengths in L."""

    pose: PoseObjective  # weights, and targets (n, 4, 4)
    seeds: Floats  # (seeds, columns): feasible configurations
    seed_poses: Floats  # (seeds, 4, 4)
    follows: int  # 1: each row starts from the result of the one before
    tries: int  # most seeds to start from, beside the start
    agreements: int  # descents that must end at the least distance before the others are left out
    closeness: float  # error of held components that ends a search [L or rad]
    is_held: float  # error up to which they are met


class ChainAnswers(NamedTuple):
    """Starts and results, row by row."""

    coordinates: Floats  # (n, columns), dimensionless: of the start, then of the result
    poses: Floats  # (n, 4, 4) [L]
    excesses: Floats  # (n,): largest excess over a limit [L or rad]
    distances: Floats  # (n,): error of what is held, or distance from the target [L]; infinite without a result
    steps: Ints  # (n,)
