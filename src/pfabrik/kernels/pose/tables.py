"""All that kernels need of a machine whose chains are legs in closed form: to answer a target, to assemble actuators.

A `Handle` of these tables, constants in a C file and bytes in a web page are the same, written differently.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints, Records
from ..legs.answer import Completion, new_completion
from ..legs.records import Table
from .forward import NewtonScratch, new_newton_scratch
from .nearest import NearestScratch, new_nearest_scratch
from .redundant_sets import RedundantSets, SetsScratch, new_sets_scratch
from .search_records import MultistartPlan, PoseSolutions, Starts, new_solutions

# Phases of an answer, in order: legs on the sides of the start, on others, in other assemblies, by searches for the
# nearest feasible pose, and exactly from where these ended.
BY_LEGS, IN_OTHER_MODES, IN_OTHER_ASSEMBLIES, NEAREST, EXACTLY = 0, 1, 2, 3, 4

MACHINE = np.dtype(
    [
        ("has_sides", "i8"),  # 1: some legs have two solutions
        ("is_partial", "i8"),  # 1: the task leaves some of the pose open
        ("is_completed", "i8"),  # 1: some of the pose, or a redundant joint, is completed from the start
        ("is_free", "i8"),  # 1: poses leave redundant joints open: they stay where they are, or are moved
        ("rests", "i8"),  # 1: `resting` are the legs while free redundant joints stay at home
        ("searches", "i8"),  # 1: what legs do not reach is searched for in the platform's pose
        ("flips", "i8"),  # 1: a platform that the legs keep upright about home may turn over on them
        (
            "projections",
            "i8",
        ),  # objectives of poses, the first of `plan`: 1 that holds nothing, or HELD ... COARSE
        ("fallback", "i8"),  # objective that is tried where these leave doubts; -1 if none
        ("values", "i8"),  # objective of which actuators near to values count
        ("turns", "i8"),  # 1: the platform turns; 0: the end effector is a point
        ("is_over_determined", "i8"),  # 1: there are more actuators than motions, and values contradict each other
        ("position", "f8"),  # tolerance of a position [L]
        ("rotation", "f8"),  # tolerance of a rotation [rad]
        ("same_mode", "f8"),  # largest difference of solutions that count as one [L, and entries of rotations]
        ("stretched", "f8"),  # and of solutions in one assembly mode, where links are stretched out
        ("noise", "f8"),  # actuator error that noise alone causes in readings of too many actuators [L or rad]
    ]
)
"""What is known of a machine, beside its legs."""

QUESTION = np.dtype(
    [
        ("assembles", "i8"),  # 1: of actuated values, 0: of a target
        ("first", "i8"),  # phases that are gone through: BY_LEGS ... EXACTLY
        ("last", "i8"),
        ("has_start", "i8"),  # 1: the start was given, 0: it is home
        ("keeps_mode", "i8"),  # 1: answers are in the working mode of the start
        ("is_nearby", "i8"),  # 1: as along a path, searches stay around the start
        ("seeds", "i8"),  # most starts of a search beside its own
        ("steps", "i8"),  # most steps of a search from one start
        ("effort", "i8"),  # steps of all searches after which no further one begins
        ("most_steps", "i8"),  # configurations that may be linearised in all; 0 if there is no bound
        ("tolerance", "f8"),  # of assembly: how close actuators must come to values to be REACHED [L or rad]
    ]
)
"""What is asked of a target, or of actuator values."""


class Question(NamedTuple):
    """Options of the question, common to all targets."""

    asked: Records  # (1,): QUESTION


class Start(NamedTuple):
    """A configuration that an answer starts from."""

    poses: Floats  # (1, 4, 4) [length]
    sides: Floats  # (1, legs): which of its two solutions each leg takes; the coordinate of an implicit joint
    actuators: Floats  # (1, n_a) [length or rad]: turns of actuators that may turn more than once count from there


class RestingLegs(NamedTuple):
    """The legs while free redundant joints stay at home, as of `decomposition.resting`."""

    legs: Table
    sides: Floats  # (1, legs)
    actuators: Floats  # (1, n_a): of those that drive redundant joints


class Tables(NamedTuple):
    """All that is needed to answer targets, and to assemble actuators.

    Limits are numbered as multipliers of limits are: 2 k and 2 k + 1 for the low and the high bound of coordinate k of
    `limited`, then the cones; their names are in `LegTable.limits`.
    """

    machine: Records  # (1,): MACHINE
    legs: Table
    near: Table  # they complete what the task leaves open only near its start
    resting: RestingLegs
    search: Table  # as searches take them
    assembly: Table  # as forward kinematics does
    plan: MultistartPlan
    others: Starts  # seeds in other assemblies than home's
    sets: RedundantSets
    home: Start


class AnswerScratch(NamedTuple):
    """Scratch memory of one thread."""

    completion: Completion
    resting: Completion
    nearest: NearestScratch
    other: PoseSolutions  # one row: an answer to be compared
    anew: PoseSolutions  # one row: what searches from elsewhere than the start find
    priced: PoseSolutions  # one row: where one of these leads by the price
    newton: NewtonScratch
    sets: SetsScratch
    moved: Floats  # (1, legs): sides, with redundant joints moved
    begin: Floats  # (1, 4, 4): a pose, in [L] where a search starts, or [length] where legs do
    own: Floats  # (1, 4, 4): the start of an assembly [L]
    home: Floats  # (1, 4, 4): home [L]
    wished: Floats  # (1, n_a): deviations of actuators from home that are asked for [L or rad]
    trial: Floats  # (n_a,): others
    way: Floats  # (n_a,): values of actuators on the way to those asked for [length or rad]
    misfits: Floats  # (legs,)
    choices: Ints  # (legs,)
    home_q: Floats  # (1, legs): 0, the coordinates at home
    no_q: Floats  # (0, legs)
    no_values: Floats  # (0, n_a)
    no_weights: Floats  # (0, 0)


def new_answer_scratch(tables: Tables) -> AnswerScratch:
    """Allocate the scratch memory of one thread."""
    legs, actuators = tables.legs.legs.shape[0], tables.home.actuators.shape[1]
    return AnswerScratch(
        new_completion(tables.legs),
        new_completion(tables.resting.legs),
        new_nearest_scratch(tables.search, tables.plan, False),
        new_solutions(1, legs, actuators),
        new_solutions(1, legs, actuators),
        new_solutions(1, legs, actuators),
        new_newton_scratch(tables.assembly, bool(tables.machine["turns"][0])),
        new_sets_scratch(tables.sets),
        np.zeros((1, legs)),
        np.zeros((1, 4, 4)),
        np.zeros((1, 4, 4)),
        np.zeros((1, 4, 4)),
        np.zeros((1, actuators)),
        np.zeros(actuators),
        np.zeros(actuators),
        np.zeros(legs),
        np.zeros(legs, np.int64),
        np.zeros((1, legs)),
        np.zeros((0, legs)),
        np.zeros((0, actuators)),
        np.zeros((0, 0)),
    )


def new_weighing_scratch(tables: Tables) -> NearestScratch:
    """Allocate the scratch memory of one thread for `weigh_limits`."""
    return new_nearest_scratch(tables.assembly, tables.plan, True)
