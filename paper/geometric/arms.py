"""Arms that swing about a hinge on the base and extend, each with struts on its end: R*-P*-[U-P*-S, U-P*-S].

An arm's swing and extension are redundant: given these two, its struts follow. Which two is a rule, not a solution:

1. they stay where the start has them (home by default) if all limits of that arm hold there;
2. otherwise they are the nearest to them, as shares of their ranges, of a regular grid of candidates over both ranges
   at which the arm's ranges, strokes and cones hold;
3. if there is none, the target is not reached. The grid can miss what lies between its candidates.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pfabrik import Mechanism, SubChain

from ..arrays import Floats, Records
from ..step import Step
from ..tolerances import LIMIT
from .compiled import kernel, routine
from .facts import Interval, centre, home_of, range_of, require, tolerances
from .struts import FOOT_SIZE, measure_strut, read_strut, strut_records, write_status, write_strut
from .targets import BLOCK, FREE, OVER, Statuses, load_block

CANDIDATES_A_SIDE = 16
"""Values of swing and of extension in the grid. Of the catalogue's machine a grid of 16 finds an answer for 99 % of the
targets that have one; twice as many take four times as long where there is none."""

_vector = ("f8", (3,))
ARM = np.dtype(
    [
        ("first", "i8"),  # struts first ... last - 1
        ("last", "i8"),
        ("pivot", *_vector),
        ("axis", *_vector),
        ("slide", *_vector),  # direction of extension at home
        ("swing_home", "f8"),
        ("extension_home", "f8"),
        ("low", "f8", (2,)),  # of swing and extension, tolerance included
        ("high", "f8", (2,)),
        ("weight", "f8", (2,)),  # one over the size of the range
        ("columns", "i8", (2,)),
    ]
)


class ArmPlan(NamedTuple):
    """Arms as arrays."""

    arms: Records  # (m,)
    struts: Records  # (k,)
    feet: Floats  # (k, FOOT_SIZE), at home
    candidates: Floats  # (m, 2, c): swing and extension, ordered by their distance from home's
    candidate_feet: Floats  # (k, FOOT_SIZE, c)
    far: float


def plan_arms(mechanism: Mechanism, chains: Sequence[SubChain]) -> ArmPlan:
    """Arms that stand on the base."""
    require(not mechanism.end_effector_is_joint, "its end effector is a joint")
    struts = [read_strut(mechanism, branch) for chain in chains for branch in chain.branches]
    arms = np.zeros(len(chains), ARM)
    first = 0
    for arm, chain in zip(arms, chains, strict=True):
        _read_arm(mechanism, chain.trunk, arm)
        arm["first"], arm["last"] = first, first + len(chain.branches)
        first = arm["last"]
    feet = np.array([foot for _, foot in struts])
    candidates = np.array([_grid(mechanism, chain.trunk, arm) for chain, arm in zip(chains, arms, strict=True)])
    candidate_feet = np.zeros((*feet.shape, candidates.shape[2]))
    place_candidates(arms, feet, candidates, candidate_feet)
    return ArmPlan(arms, strut_records(struts), feet, candidates, candidate_feet, tolerances(mechanism)[1])


def _read_arm(mechanism: Mechanism, trunk: Sequence[Step], arm: np.void) -> None:
    """Fill the record of an arm, but for its struts."""
    hinge, slide = trunk
    slack = np.array([LIMIT, tolerances(mechanism)[0]])
    arm["pivot"], arm["axis"] = centre(hinge), np.array(hinge.joint.axis) * hinge.sign
    arm["slide"] = np.array(mechanism.home_axis(slide.joint.name)) * slide.sign
    arm["swing_home"], arm["extension_home"] = (home_of(mechanism, step) for step in trunk)
    arm["low"], arm["high"] = np.transpose([range_of(step) for step in trunk]) + [-slack, slack]
    arm["weight"] = [1.0 / ((high - low) or 1.0) for low, high in _spans(mechanism, trunk)]
    arm["columns"] = [mechanism.actuator_names.index(step.joint.name) for step in trunk]


def _spans(mechanism: Mechanism, trunk: Sequence[Step]) -> list[Interval]:
    """What the grid covers: the ranges; without one, a whole turn, and the characteristic length to either side."""
    room = (math.pi, mechanism.characteristic_length)
    homes = [home_of(mechanism, step) for step in trunk]
    return [
        range_of(step) if step.joint.range is not None else (home - half, home + half)
        for step, home, half in zip(trunk, homes, room, strict=True)
    ]


def _grid(mechanism: Mechanism, trunk: Sequence[Step], arm: np.void) -> Floats:
    """The candidates of one arm, (2, c), the nearest to home first."""
    values = [np.linspace(low, high, CANDIDATES_A_SIDE) for low, high in _spans(mechanism, trunk)]
    grid = np.stack(np.meshgrid(*values, indexing="ij")).reshape(2, -1)
    home = np.array([arm["swing_home"], arm["extension_home"]])
    distance = (((grid - home[:, None]) * arm["weight"][:, None]) ** 2).sum(axis=0)
    return np.asarray(grid[:, np.argsort(distance, kind="stable")])


@kernel
def place_candidates(arms: Records, feet: Floats, candidates: Floats, candidate_feet: Floats) -> None:
    """Where the feet are at every candidate."""
    placed = np.zeros(FOOT_SIZE)
    for m in range(arms.shape[0]):
        for c in range(candidates.shape[2]):
            for k in range(arms[m]["first"], arms[m]["last"]):
                place_foot(arms[m], candidates[m, 0, c], candidates[m, 1, c], feet[k], placed)
                for j in range(FOOT_SIZE):
                    candidate_feet[k, j, c] = placed[j]


@kernel
def solve_arms(
    plan: ArmPlan, targets: Floats, starts: Floats, at_home: bool, actuators: Floats, status: Statuses
) -> int:
    """Swing and extension of the arms and lengths of their struts at every target; how many rows are no poses.

    Given the swing and the extension of an arm its struts are as those of `solve_struts`: one solution. The two are
    chosen by the rule above, next to `starts` (1 or n rows of actuators); home's come first in the order of the
    candidates, so that with `at_home` the search may end early. Source: Merlet for the struts; the rule is ours.
    """
    n_struts = plan.struts.shape[0]
    table = np.zeros((FREE + 1 + n_struts, BLOCK))
    found = np.zeros(BLOCK)
    feet = np.zeros((n_struts, FOOT_SIZE))
    block = BLOCK if starts.shape[0] == 1 else 1
    invalid = 0
    row = 0
    while row < targets.shape[0]:
        n = min(block, targets.shape[0] - row)
        start = starts[row if block == 1 else 0]
        if row == 0 or block == 1:
            place_feet(plan, start, feet)
        invalid += load_block(targets, row, n, plan.far, table, status)
        for m in range(plan.arms.shape[0]):
            solve_arm(plan, m, feet, start, at_home, row, n, table, found, actuators)
        for k in range(n_struts):
            write_strut(plan.struts[k], row, n, table, FREE + 1 + k, actuators)
        for i in range(n):
            if table[OVER, i] != 0.0:
                for m in range(plan.arms.shape[0]):
                    actuators[row + i, plan.arms[m]["columns"][0]] = math.nan
                    actuators[row + i, plan.arms[m]["columns"][1]] = math.nan
        write_status(row, n, table, status)
        row += block
    return invalid


@routine
def place_feet(plan: ArmPlan, start: Floats, feet: Floats) -> None:
    """Where the start has the feet."""
    for m in range(plan.arms.shape[0]):
        arm = plan.arms[m]
        for k in range(arm["first"], arm["last"]):
            place_foot(arm, start[arm["columns"][0]], start[arm["columns"][1]], plan.feet[k], feet[k])


@routine
def place_foot(arm: Records, swing: float, extension: float, home: Floats, foot: Floats) -> None:
    """A foot, moved with its arm from where it is at home."""
    cosine, sine = math.cos(swing - arm["swing_home"]), math.sin(swing - arm["swing_home"])
    out = extension - arm["extension_home"]
    x, y, z = arm["axis"][0], arm["axis"][1], arm["axis"][2]
    for part in range(0, FOOT_SIZE, 3):
        u, v, w = home[part], home[part + 1], home[part + 2]
        if part == 0:
            u += out * arm["slide"][0] - arm["pivot"][0]
            v += out * arm["slide"][1] - arm["pivot"][1]
            w += out * arm["slide"][2] - arm["pivot"][2]
        along = (1.0 - cosine) * (x * u + y * v + z * w)
        foot[part] = cosine * u + sine * (y * w - z * v) + along * x
        foot[part + 1] = cosine * v + sine * (z * u - x * w) + along * y
        foot[part + 2] = cosine * w + sine * (x * v - y * u) + along * z
    for j in range(3):
        foot[j] += arm["pivot"][j]


@routine
def solve_arm(
    plan: ArmPlan,
    m: int,
    feet: Floats,
    start: Floats,
    at_home: bool,
    row: int,
    n: int,
    table: Floats,
    found: Floats,
    actuators: Floats,
) -> None:
    """One arm for `n` columns: where the start has it, or at a candidate; over where at neither."""
    arm = plan.arms[m]
    swing, extension = arm["columns"][0], arm["columns"][1]
    outside = not (
        arm["low"][0] <= start[swing] <= arm["high"][0] and arm["low"][1] <= start[extension] <= arm["high"][1]
    )
    for i in range(n):
        table[FREE, i] = 1.0 if outside else 0.0
    for k in range(arm["first"], arm["last"]):
        measure_strut(plan.struts[k], feet[k], n, table, FREE, FREE + 1 + k)
    for i in range(n):
        actuators[row + i, swing] = start[swing]
        actuators[row + i, extension] = start[extension]
        if table[FREE, i] != 0.0 and table[OVER, i] == 0.0:
            best = search(plan, m, start, at_home, i, table, found)
            if best < 0:
                table[OVER, i] = 1.0
            else:
                actuators[row + i, swing] = plan.candidates[m, 0, best]
                actuators[row + i, extension] = plan.candidates[m, 1, best]
                for k in range(arm["first"], arm["last"]):
                    table[FREE + 1 + k, i] = length_from(plan, k, best, i, table)


@routine
def search(plan: ArmPlan, m: int, start: Floats, at_home: bool, i: int, table: Floats, found: Floats) -> int:
    """The candidate nearest to the start at which the arm keeps its limits for column `i`, or -1."""
    arm = plan.arms[m]
    swing, extension = start[arm["columns"][0]], start[arm["columns"][1]]
    best, least = -1, math.inf
    for first in range(0, plan.candidates.shape[2], BLOCK):
        n = min(BLOCK, plan.candidates.shape[2] - first)
        for c in range(n):
            found[c] = 0.0
        for k in range(arm["first"], arm["last"]):
            try_candidates(plan, k, first, n, i, table, found)
        for c in range(n):
            if found[c] == 0.0:
                by = (plan.candidates[m, 0, first + c] - swing) * arm["weight"][0]
                out = (plan.candidates[m, 1, first + c] - extension) * arm["weight"][1]
                if by * by + out * out < least:
                    best, least = first + c, by * by + out * out
                    if at_home:
                        return best
    return best


@routine
def try_candidates(plan: ArmPlan, k: int, first: int, n: int, i: int, table: Floats, found: Floats) -> None:
    """1 more for every one of `n` candidates at which strut `k` exceeds a limit for column `i`."""
    strut, feet = plan.struts[k], plan.candidate_feet[k]
    hx, hy, hz = turned(strut["head"], i, table)
    px, py, pz = hx + table[3, i], hy + table[7, i], hz + table[11, i]
    u, v, w = turned(strut["head_axis"], i, table)
    low, high = strut["low"], strut["high"]
    foot_cosine, head_cosine = strut["foot_cosine"], strut["head_cosine"]
    for c in range(n):
        x, y, z = px - feet[0, first + c], py - feet[1, first + c], pz - feet[2, first + c]
        distance = math.sqrt(x * x + y * y + z * z)
        along_foot = feet[3, first + c] * x + feet[4, first + c] * y + feet[5, first + c] * z
        kept = (
            (distance >= low)
            & (distance <= high)
            & (along_foot >= foot_cosine * distance)
            & (u * x + v * y + w * z <= -head_cosine * distance)
        )
        found[c] += 0.0 if kept else 1.0


@routine
def length_from(plan: ArmPlan, k: int, candidate: int, i: int, table: Floats) -> float:
    """Length of strut `k` from a candidate's foot, for column `i`."""
    hx, hy, hz = turned(plan.struts[k]["head"], i, table)
    x = hx + table[3, i] - plan.candidate_feet[k, 0, candidate]
    y = hy + table[7, i] - plan.candidate_feet[k, 1, candidate]
    z = hz + table[11, i] - plan.candidate_feet[k, 2, candidate]
    return math.sqrt(x * x + y * y + z * z)


@routine
def turned(vector: Floats, i: int, table: Floats) -> tuple[float, float, float]:
    """A vector of the end effector in base coordinates, for column `i`."""
    x, y, z = vector[0], vector[1], vector[2]
    return (
        table[0, i] * x + table[1, i] * y + table[2, i] * z,
        table[4, i] * x + table[5, i] * y + table[6, i] * z,
        table[8, i] * x + table[9, i] * y + table[10, i] * z,
    )
