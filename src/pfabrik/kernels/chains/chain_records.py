"""A serial chain of unit motions from the base to the end effector, and what kernels are asked of it.

Lengths are in units of L; coordinates are deviations from home. A degree of freedom is one turn or one slide; a ball
joint has three.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Floats, Ints, Records

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
    holds: Ints  # (1 + projections,): what these hold; the last one holds nothing
    seeds: Floats  # (seeds, columns): feasible configurations, dimensionless
    seed_poses: Floats  # (seeds, 4, 4) [L]
