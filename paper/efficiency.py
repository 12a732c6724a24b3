"""The second experiment: random targets in the workspace, by P-FABRIK and by the geometric approach."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from pfabrik import Mechanism, Solution, Solver, Status, passes, pose

from . import geometric
from .arrays import Floats, Mask
from .checking import Feasibility, feasibility
from .efficacy import rms
from .study import SETTINGS, Case, Extent, Tick, solve
from .timing import median_times, one_core

DRAWN_AT_ONCE = 4096
MOST_DRAWN = 2_000_000
COPIES = {"default": 10, "geometric": 10}
"""How often the targets are repeated in a batch that takes microseconds a target, so that the call does not count."""

NEVER = 1e-300
"""A tolerance that is never met [length, rad]."""

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
    def by_fallback(self) -> int:
        """Targets that passes did not answer."""
        return int(np.sum(passes.by_fallback(self.solution)))

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
    answers : by options ("paper", "extended", "accelerated", "default") and start ("cold": home, "warm": the answer to
        the target before).
    agreement : largest difference of an actuator from the closed form's, cold, default options [length or rad]; None
        for redundant mechanisms, where both may be right.
    times : of one target [s], by what was timed: (options or "geometric", start, "batch", "call" or "single").
    pass_time : of a forward and backward pass of all chains [s].
    """

    case: Case
    targets: Floats
    answers: dict[tuple[str, str], Answered]
    agreement: float | None
    times: dict[tuple[str, str, str], float]
    pass_time: float

    def ratio(self, start: str) -> float:
        """Time of a target of a batch by default over that of the geometric approach, from the same start."""
        return self.times["default", start, "batch"] / self.geometric_time(start, "batch")

    def ratio_of_passes(self, start: str) -> float:
        """Time of the passes that a target takes over that of the geometric approach for a target alone."""
        return self.answers["paper", start].iterations * self.pass_time / self.geometric_time(start, "single")

    def geometric_time(self, start: str, how: str) -> float:
        """Time of a target by the geometric approach [s]; NaN where it is not compiled."""
        return self.times.get(("geometric", start, how), float("nan"))


def run(case: Case, extent: Extent, tick: Tick) -> Efficiency:
    """Draw targets, answer them, and time that."""
    mechanism = case.mechanism
    targets = in_tour(draw(case, extent.targets), mechanism)
    closed = geometric.solve_ik(mechanism, targets)
    answers = {}
    for name, options in ANY_MODE.items():
        cold = solve(mechanism, targets, options)
        warm = solve(mechanism, targets[1:], options, cold[:-1])
        answers[name, "cold"] = Answered(cold, feasibility(cold))
        answers[name, "warm"] = Answered(warm, feasibility(warm))
    tick()
    default = answers["default", "cold"].solution
    redundant = len(mechanism.actuator_names) > 6
    agreement = None if redundant else float(np.abs(default.actuators - closed.actuators).max())
    times = timed(mechanism, targets, answers, extent.repeats)
    a_pass = time_a_pass(mechanism, targets, extent.repeats)
    tick()
    return Efficiency(case, targets, answers, agreement, times, a_pass)


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


def timed(
    mechanism: Mechanism, targets: Floats, answers: dict[tuple[str, str], Answered], repeats: int
) -> dict[tuple[str, str, str], float]:
    """Median time of one target [s], on one core, each way by turns.

    Where closed forms are not compiled, nothing is timed by them.
    "batch": its share of one call for all targets, many times over. "call": a call of its own from Python, by
    default of a prepared `Solver`. "single": a call of its own from compiled code, of the geometric approach alone.
    """
    calls: dict[tuple[str, str, str], Callable[[], object]] = {}
    n = len(targets)
    rows = {name: (np.tile(np.arange(n), copies), np.tile(np.arange(n - 1), copies)) for name, copies in COPIES.items()}
    for name, options in ANY_MODE.items():
        every, first = rows.get(name, (np.arange(n), np.arange(n - 1)))
        many, after, before = targets[every], targets[first + 1], answers[name, "cold"].solution[first]
        calls[name, "cold", "batch"] = partial(solve, mechanism, many, options)
        calls[name, "warm", "batch"] = partial(solve, mechanism, after, options, before)
        is_default = not isinstance(options, passes.Options)
        one = Solver(mechanism, options=options).ik if is_default else partial(solve, mechanism, options=options)
        calls[name, "cold", "call"] = partial(ask_one_by_one, one, targets)
    closed = partial(geometric.solve_ik, mechanism)
    if not geometric.IS_COMPILED:
        return _a_target(calls, repeats, len(targets))
    every, first = rows["geometric"]
    calls["geometric", "cold", "batch"] = partial(closed, targets[every])
    calls["geometric", "warm", "batch"] = partial(closed, targets[first + 1], start=closed(targets[first]))
    calls["geometric", "cold", "call"] = partial(ask_one_by_one, closed, targets)
    calls["geometric", "cold", "single"] = geometric.one_by_one(mechanism, targets)
    calls["geometric", "warm", "single"] = geometric.one_by_one(mechanism, targets[1:], closed(targets[:-1]))
    return _a_target(calls, repeats, len(targets))


def _a_target(
    calls: dict[tuple[str, str, str], Callable[[], object]], repeats: int, n: int
) -> dict[tuple[str, str, str], float]:
    """Median time of each call over the targets that it answers [s]."""
    with one_core():
        seconds = median_times(calls, repeats)
    counts = {key: n - (key[1] == "warm") for key in calls}
    return {key: seconds[key] / (counts[key] * (COPIES.get(key[0], 1) if key[2] == "batch" else 1)) for key in calls}


def ask_one_by_one(answer: Callable[[Floats], object], targets: Floats) -> None:
    """Ask for every target by a call of its own."""
    for target in targets:
        answer(target)


def time_a_pass(mechanism: Mechanism, targets: Floats, repeats: int) -> float:
    """Time of a forward and backward pass of all chains [s], on one core.

    The library answers more than the passes: joint coordinates, loops and limits. What a pass takes is by how much
    longer a batch takes whose chains may make K of them than one whose chains stop after the first, where none comes
    near enough to stop before, over the passes that were made more.
    """
    most = replace(passes.Options.paper(), working_mode="any", tolerance=NEVER, rotation_tolerance=NEVER, max_rounds=1)
    few = replace(most, max_iterations=1)
    calls = {options: partial(passes.solve, mechanism, targets, options) for options in (few, most)}
    made = {options: int(np.sum(call().iterations)) for options, call in calls.items()}
    with one_core():
        seconds = median_times(calls, repeats)
    return (seconds[most] - seconds[few]) / (made[most] - made[few])


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
            "by_fallback": answered.by_fallback,
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
            "ratio_to_geometric": seconds / found.geometric_time(start, how),
        }
        for (method, start, how), seconds in found.times.items()
    ] + [
        {
            "mechanism": found.case.key,
            "method": "paper",
            "start": "",
            "how": "pass",
            "microseconds": 1e6 * found.pass_time,
            "ratio_to_geometric": found.pass_time / found.geometric_time("cold", "single"),
        }
    ]
