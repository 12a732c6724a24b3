"""Inputs and results of the kernels in the platform's pose; lengths in L, angles in radians."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints, Records
from ..clearance.link_records import LinkLimits
from ..joints.loops import PoseObjective
from ..rows import N_COUNTERS, PENDING


class PlatformObjective(NamedTuple):
    """Objective of a search: the pose of the platform, or the values of actuators."""

    pose: PoseObjective  # its targets in [length]
    values: Floats  # (n, n_a): wished deviations of the actuators from home [L or rad]; no rows if not wished
    implied: int  # number of leg equations that follow from the others


class Starts(NamedTuple):
    """Configurations that searches start from: poses [L], coordinates and sides, as in `PlatformState`."""

    poses: Floats  # (s, 4, 4)
    q: Floats  # (s, legs); no rows if they follow from poses and sides
    sides: Floats  # (s, legs)


SETTINGS = np.dtype(
    [
        ("frame", "i8"),  # as in `PoseObjective`
        ("margin", "f8"),
        ("near", "f8"),
        ("steps", "i8"),  # most steps of a search; 0 to compute the multipliers of limits only
        ("implied", "i8"),  # as in `PlatformObjective`
        ("agreements", "i8"),  # agreements that end a multistart, as counted by `is_agreed`
        ("stays", "i8"),  # 1 to keep the working mode of a row's own start
        ("cones", "i8"),  # number of cones that searches constrain, the first ones: all where they end beyond a limit
        ("limit", "f8"),  # excess up to which a limit counts as kept [L or rad]
        ("position", "f8"),  # tolerance of REACHED [length]
        ("rotation", "f8"),  # tolerance of REACHED [rad]
        ("hold", "i8"),  # held part of the target: HOLD_...
        ("price", "f8"),  # up to which it is held, as in `PoseObjective`; 0 if it is held at any
        ("rounding", "f8"),  # share of the distance that the price is rounded off by
        ("held_position", "f8"),  # tolerance of the held part [length]
        ("held_rotation", "f8"),  # tolerance of the held part [rad]
    ]
)


class Along(NamedTuple):
    """How carriages take a whole machine along: legs, arms and platform, none of which then moves within it."""

    part: Floats  # (3, 3): of a displacement, the part that they can take
    rates: Floats  # (legs, 3): of it, what each carriage goes
    room: Floats  # (legs, 2): least and most coordinate of each [L]


class MultistartPlan(NamedTuple):
    """The objectives of searches, and what is common to all of these and to all rows."""

    weights: Floats  # (k, 6): of the pose, as in `PoseObjective`
    settings: Records  # (k,): SETTINGS
    seeds: Starts  # after a row's own start, for any row
    along: Along
    links: LinkLimits


class RowSearch(NamedTuple):
    """Which search of which row."""

    row: int
    aim: int  # number of the objective in the plan
    most_seeds: int  # of the plan's, beside the row's own start
    most_steps: int  # of a search from one start
    stays: int  # 1 to keep the working mode of the row's own start


class PoseSolutions(NamedTuple):
    """Solutions of the searches of all rows; rows without a solution have a distance only."""

    distances: Floats  # (n,) [L]; infinite if no feasible pose was found, or the target is no pose
    poses: Floats  # (n, 4, 4) [length]
    q: Floats  # (n, legs)
    sides: Floats  # (n, legs)
    counters: Ints  # (n, N_COUNTERS): steps and the held part, as in `Rows`
    actuators: Floats  # (n, n_a)
    measures: Floats  # (n, 5): distances from the target [length, rad], the largest equation [length], limit excess
    status: Ints  # (n,): REACHED or PROJECTED


def new_solutions(n: int, legs: int, actuators: int) -> PoseSolutions:
    """Allocate n solutions, all PENDING."""
    return PoseSolutions(
        np.full(n, np.inf),
        np.zeros((n, 4, 4)),
        np.zeros((n, legs)),
        np.zeros((n, legs)),
        np.zeros((n, N_COUNTERS), np.int64),
        np.zeros((n, actuators)),
        np.zeros((n, 5)),
        np.full(n, PENDING),
    )
