"""The second experiment: random targets in the workspace, by P-FABRIK and by the geometric approach."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from .. import geometric
from ..answers.solution import Solution
from ..answers.status import Status
from ..arrays import Floats, Mask
from ..closure.configurations import new_rows, rows_at
from ..closure.projection import ways_of
from ..decomposition.leg_table import LegTable, leg_table
from ..decomposition.plan import compile_plan
from ..description.mechanism import Mechanism
from ..engine import inverse_engine_of
from ..geometric.topologies import closed_form
from ..ik import solve_ik
from ..platform.nearest import move_arms
from ..platform.table import machine
from ..poses import pose
from ..reaching.positions import new_reached, positions_of
from ..reaching.solve import settings_of
from .checking import Feasibility, feasibility
from .efficacy import rms
from .one_by_one import closed_form_one_by_one, legs_one_by_one, p_fabrik_one_by_one
from .study import SETTINGS, Case, Extent, Tick
from .timing import median_times, one_core

DRAWN_AT_ONCE = 4096
MOST_DRAWN = 2_000_000
COPIES = 10
"""How often the targets are repeated in a batch that is timed, so that one call's overhead does not count."""

ANY_MODE = {name: replace(options, working_mode="any") for name, options in SETTINGS.items()}
"""Targets are independent: from whatever seed, an answer may be in another working mode."""


@dataclass(frozen=True)
class Answered:
    """The targets with one set of options, from one kind of start."""

    solution: Solution
    feasibility: Feasibility

    @property
    def reached(self) -> int:
        return int(np.count_nonzero(self._are_reached))

    @property
    def position_rms(self) -> float:
        """Of the errors of the targets that are reached [length]."""
        return rms(np.asarray(self.solution.position_error)[self._are_reached])

    @property
    def iterations(self) -> float:
        """Passes, on average over the targets that are reached."""
        return float(np.mean(np.asarray(self.solution.iterations)[self._are_reached]))

    @property
    def _are_reached(self) -> Mask:
        return np.asarray(self.solution.status == Status.REACHED)


@dataclass(frozen=True)
class Efficiency:
    """The experiment on one machine.

    Attributes
    ----------
    targets : (n, 4, 4), in the workspace by the closed form; each the nearest one left to the one before.
    answers : by options ("paper", "default") and start ("cold": home, "warm": the answer to the target before).
    agreement : largest difference of an actuator from the closed form's, cold, default options [length or rad]; None
        for redundant mechanisms, where both may be right.
    times : of one target [s], by what was timed: ("paper", "default" or "geometric", start, "single" or "batch").
    """

    case: Case
    targets: Floats
    answers: dict[tuple[str, str], Answered]
    agreement: float | None
    times: dict[tuple[str, str, str], float]

    def ratio(self, options: str, start: str, how: str) -> float:
        """Time with these options over that of the geometric approach, from the same start and in the same way."""
        return self.times[options, start, how] / self.times["geometric", start, how]


def run(case: Case, extent: Extent, tick: Tick) -> Efficiency:
    """Draw targets, answer them, and time that."""
    mechanism = case.mechanism
    targets = in_tour(draw(case, extent.targets), mechanism)
    closed = geometric.solve_ik(mechanism, targets)
    answers = {}
    for name, options in ANY_MODE.items():
        cold = solve_ik(mechanism, targets, options=options)
        warm = solve_ik(mechanism, targets[1:], start=cold[:-1], options=options)
        answers[name, "cold"] = Answered(cold, feasibility(cold))
        answers[name, "warm"] = Answered(warm, feasibility(warm))
    tick()
    default = answers["default", "cold"].solution
    redundant = len(mechanism.actuator_names) > 6
    agreement = None if redundant else float(np.abs(default.actuators - closed.actuators).max())
    times = timed(mechanism, targets, extent.repeats)
    tick()
    return Efficiency(case, targets, answers, agreement, times)


def draw(case: Case, count: int) -> Floats:
    """Random targets (count, 4, 4) that the closed form reaches; the same in every run."""
    mechanism, rng = case.mechanism, np.random.default_rng(1)
    found, drawn = np.empty((0, 4, 4)), 0
    while len(found) < count:
        if drawn >= MOST_DRAWN:
            raise RuntimeError(f"{len(found)} of {drawn} targets drawn for '{mechanism.name}' lie in its workspace")
        tried = _draw(case, mechanism, rng, DRAWN_AT_ONCE)
        drawn += len(tried)
        found = np.concatenate([found, tried[np.asarray(geometric.solve_ik(mechanism, tried).reached)]])
    return found[:count]


def _draw(case: Case, mechanism: Mechanism, rng: np.random.Generator, n: int) -> Floats:
    """Poses (n, 4, 4) about home's; for a joint end effector in its plane."""
    steps = rng.uniform(-case.size, case.size, (n, 3)) * mechanism.characteristic_length
    turns = rng.uniform(-case.turn, case.turn, (n, 3))
    if mechanism.end_effector_is_joint:
        axis = np.array(mechanism.joint(mechanism.end_effector).axis)
        steps -= (steps @ axis)[:, None] * axis
    home = np.array(mechanism.reference_point)
    return np.stack([pose(home + step, rotvec=turn) for step, turn in zip(steps, turns, strict=True)])


def in_tour(targets: Floats, mechanism: Mechanism) -> Floats:
    """The targets in an order in which each is the nearest one left to the one before; the first is nearest to home.

    Distances are Euclidean over positions, relative to L, and rotation matrices.
    """
    flat = targets[:, :3].copy()
    flat[:, :, 3] /= mechanism.characteristic_length
    flat = flat.reshape(len(targets), -1)
    home = mechanism.home_pose[:3].copy()
    home[:, 3] /= mechanism.characteristic_length
    left, here, order = np.ones(len(targets), bool), home.ravel(), []
    for _ in range(len(targets)):
        distances = np.where(left, ((flat - here) ** 2).sum(axis=1), np.inf)
        order.append(int(distances.argmin()))
        left[order[-1]], here = False, flat[order[-1]]
    return targets[order]


def timed(mechanism: Mechanism, targets: Floats, repeats: int) -> dict[tuple[str, str, str], float]:
    """Median time of one target [s], on one core, each way by turns.

    "single" is one kernel call a target, made by compiled code; "batch" one call of the library for all targets.
    """
    calls: dict[tuple[str, str, str], Callable[[], object]] = {}
    table, many = leg_table(mechanism), np.tile(targets, (COPIES, 1, 1))
    assert isinstance(table, LegTable)
    for start in ("cold", "warm"):
        is_warm = start == "warm"
        calls["paper", start, "single"] = _single_passes(mechanism, targets, is_warm)
        calls["default", start, "single"] = _single_legs(mechanism, table, targets, is_warm)
        calls["geometric", start, "single"] = _single_closed(mechanism, targets, is_warm)
    for name, options in ANY_MODE.items():
        calls[name, "cold", "batch"] = partial(solve_ik, mechanism, many, options=options)
    calls["geometric", "cold", "batch"] = partial(geometric.solve_ik, mechanism, many)
    with one_core():
        seconds = median_times(calls, repeats)
    return {key: seconds[key] / (len(many) if key[-1] == "batch" else len(targets)) for key in calls}


def _single_passes(mechanism: Mechanism, targets: Floats, warm: bool) -> Callable[[], object]:
    """One kernel call of the paper's method a target."""
    compiled, options = compile_plan(mechanism), ANY_MODE["paper"]
    settings = settings_of(mechanism, options, ways_of(mechanism, options.hold, options.rotation_length)[0])
    seeds = compiled.home_seed
    if warm:
        answers = inverse_engine_of(mechanism, options).answer(targets, None, options, keep_mode=False)
        before = np.concatenate([np.zeros((1, answers.coordinates.shape[1])), answers.coordinates[:-1]])
        seeds = positions_of(mechanism, compiled, before)
    return partial(p_fabrik_one_by_one, compiled.plan, targets, seeds, settings, new_reached(compiled, len(targets)))


def _single_legs(mechanism: Mechanism, table: LegTable, targets: Floats, warm: bool) -> Callable[[], object]:
    """One kernel call of legs in closed form a target, and where arms must move, of the search for where to."""
    begins = np.concatenate([mechanism.home_pose[None], targets[:-1]]) if warm else mechanism.home_pose[None]
    legs, rows = machine(table), new_rows(mechanism, len(targets))
    sides = np.repeat(table.home_sides, len(targets), axis=0)

    def answer() -> None:
        if not legs_one_by_one(legs.address, targets, begins, table.home_sides, rows) or not len(table.arms):
            return
        rest = np.flatnonzero(rows.status != Status.REACHED)
        moved, _ = move_arms(mechanism, table, targets, begins, sides, rest)
        for i in moved:
            legs_one_by_one(
                legs.address, targets[i : i + 1], begins[:1], sides[i : i + 1], rows_at(rows, slice(i, i + 1))
            )

    return answer


def _single_closed(mechanism: Mechanism, targets: Floats, warm: bool) -> Callable[[], object]:
    """One kernel call of the closed form a target."""
    form = closed_form(mechanism)
    loop = closed_form_one_by_one(form.kernel)
    actuators, status = np.empty((len(targets), len(mechanism.actuator_names))), np.empty(len(targets), np.int8)
    seeds = np.asarray(form.home)
    if warm:
        seeds = np.concatenate([seeds, geometric.solve_ik(mechanism, targets).actuators[:-1]])
    return lambda: loop(form.plan, targets, seeds, not warm, actuators, status)


def summary(found: Efficiency) -> list[dict[str, Any]]:
    """One row for each set of options and kind of start."""
    return [
        {
            "mechanism": found.case.key,
            "options": options,
            "start": start,
            "targets": len(answered.solution),
            "reached": answered.reached,
            "position_rms": answered.position_rms,
            "iterations": answered.iterations,
            "iterations_most": int(np.max(answered.solution.iterations)),
            "agreement": found.agreement if (options, start) == ("default", "cold") else None,
            **answered.feasibility._asdict(),
        }
        for (options, start), answered in found.answers.items()
    ]


def time_rows(found: Efficiency) -> list[dict[str, Any]]:
    """One row for each time that was taken."""
    return [
        {
            "mechanism": found.case.key,
            "method": method,
            "start": start,
            "how": how,
            "microseconds": 1e6 * seconds,
            "ratio_to_geometric": seconds / found.times["geometric", start, how],
        }
        for (method, start, how), seconds in found.times.items()
    ]
