"""The third experiment: circles that leave the workspace, and what a figure of them cannot show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pfabrik import Mechanism, Options, Status, Track, Workspace, passes, workspace

from .arrays import Floats, Mask
from .checking import Feasibility, feasibility
from .closest import nearest_distances
from .study import LEAVING, Case, Extent, Tick, follow
from .timing import clock, one_core
from .tolerances import ROTATION

LEAP = 3.0
"""A step of an actuator that is more than so many times the largest one inside the workspace is a leap."""


@dataclass(frozen=True)
class Jump:
    """The largest change of any actuator from one step to the next, in a part of the path.

    Attributes
    ----------
    size : [length or rad].
    step : the step it leads to; -1 where the part is empty.
    halved : the largest change in that part where the path has twice as many steps. A motion that is continuous
        halves; what stays as large is a jump.
    """

    size: float
    step: int
    halved: float


@dataclass(frozen=True)
class Followed:
    """The circle, followed with one set of options.

    Attributes
    ----------
    solution : each step from the answer before it.
    feasibility : of its steps.
    jumps : by kind of actuator ("lengths", "angles"), then by part of the path: "inside", "outside", "edge" (between
        a step that is reached and one that is not).
    leaps : steps of an actuator of either kind that are `LEAP` times the largest inside.
    ratios : distance to the target over that of the nearest feasible pose of its orientation, of the steps for which
        that is known and whose answers have this orientation.
    """

    solution: Track
    feasibility: Feasibility
    jumps: dict[str, dict[str, Jump]]
    leaps: int
    ratios: Floats

    @property
    def projected(self) -> Mask:
        return np.asarray(self.solution.status == Status.PROJECTED)

    @property
    def by_fallback(self) -> int:
        """Steps that passes did not answer."""
        return int(np.sum(passes.by_fallback(self.solution)))

    @property
    def jump_ratio(self) -> float:
        """Largest step outside, and across the edge, over the largest inside."""
        return max(max(part["outside"].size, part["edge"].size) / part["inside"].size for part in self.jumps.values())


@dataclass(frozen=True)
class Robustness:
    """The experiment on one machine.

    Attributes
    ----------
    runs : by the name of the options.
    beyond : steps that the default does not reach either, (n,).
    nearest : distance of the nearest feasible pose of the target's orientation, by the default or by a general
        optimiser, whichever comes nearer, (n,) [length]; NaN where it is not searched.
    searched : the same by the optimiser alone.
    seconds : median time of each step by the paper's passes, answered alone from the answer before it (n,).
    """

    case: Case
    targets: Floats
    runs: dict[str, Followed]
    beyond: Mask
    nearest: Floats
    searched: Floats
    workspace: Workspace
    seconds: Floats

    @property
    def paper(self) -> Followed:
        return self.runs["paper"]

    @property
    def default_ratios(self) -> Floats:
        """Distance of the default's answers over that which the optimiser finds."""
        answers = self.runs["default"].solution
        held = np.asarray(answers.rotation_error <= ROTATION) & np.isfinite(self.searched)
        return np.asarray(answers.position_error[held] / self.searched[held])

    def missed(self, name: str) -> int:
        """Steps within reach that the options with this name do not reach."""
        return int((self.runs[name].projected & ~self.beyond).sum())


def run(case: Case, extent: Extent, tick: Tick) -> Robustness:
    """Follow the circle that leaves the workspace with every set of options."""
    mechanism, targets = case.mechanism, case.leaving.poses(extent.steps)
    finer = case.leaving.poses(2 * extent.steps - 1)
    default = follow(mechanism, targets, LEAVING["default"])
    beyond = np.asarray(default.status != Status.REACHED)
    searched = nearest_distances(default, targets, beyond, extent.searches, tick)
    exact = np.where(np.asarray(default.rotation_error <= ROTATION), default.position_error, np.nan)
    nearest = np.where(np.isfinite(searched), np.fmin(exact, searched), np.nan)
    runs = {name: go_around(mechanism, targets, finer, options, nearest) for name, options in LEAVING.items()}
    return Robustness(
        case=case,
        targets=targets,
        runs=runs,
        beyond=beyond,
        nearest=nearest,
        searched=searched,
        workspace=workspace(mechanism, over=("y", "z"), fixed={"x": case.leaving.center[0]}),
        seconds=step_times(mechanism, targets, runs["paper"].solution, extent.repeats),
    )


def go_around(mechanism: Mechanism, targets: Floats, finer: Floats, options: Options, nearest: Floats) -> Followed:
    """Follow the circle, and it again in steps half as large."""
    solution = follow(mechanism, targets, options)
    found = jumps(solution, follow(mechanism, finer, options))
    held = np.isfinite(nearest) & np.asarray(solution.rotation_error <= ROTATION)
    return Followed(
        solution=solution,
        feasibility=feasibility(solution),
        jumps=found,
        leaps=leaps(solution, found),
        ratios=np.asarray(solution.position_error[held] / nearest[held]),
    )


def _kinds(mechanism: Mechanism) -> dict[str, Mask]:
    """The actuators of each kind."""
    is_length = np.array([drive.kind == "length" for drive in mechanism.drives])
    return {kind: chosen for kind, chosen in (("lengths", is_length), ("angles", ~is_length)) if chosen.any()}


def jumps(solution: Track, finer: Track) -> dict[str, dict[str, Jump]]:
    """The largest changes of the actuators of either kind, in each part of the path."""
    return {
        kind: {part: _jump(solution, finer, chosen, part) for part in ("inside", "outside", "edge")}
        for kind, chosen in _kinds(solution.mechanism).items()
    }


def leaps(solution: Track, found: dict[str, dict[str, Jump]]) -> int:
    """Steps in which an actuator goes farther than `LEAP` times the largest step inside of its kind."""
    is_leap = np.zeros(len(solution) - 1, bool)
    for kind, chosen in _kinds(solution.mechanism).items():
        is_leap |= _changes(solution, chosen) > LEAP * found[kind]["inside"].size
    return int(is_leap.sum())


def _jump(solution: Track, finer: Track, chosen: Mask, part: str) -> Jump:
    changes = np.where(_part(solution, part), _changes(solution, chosen), 0.0)
    step = int(changes.argmax()) + 1 if changes.max() > 0.0 else -1
    halved = np.where(_part(finer, part), _changes(finer, chosen), 0.0)
    return Jump(float(changes.max()), step, float(halved.max()))


def _changes(solution: Track, chosen: Mask) -> Floats:
    """Largest change of the chosen actuators into each step but the first."""
    return np.asarray(np.abs(np.diff(solution.actuators[:, chosen], axis=0)).max(axis=1))


def _part(solution: Track, part: str) -> Mask:
    """Steps but the first that are in a part of the path."""
    off = np.asarray(solution.status) != Status.REACHED
    parts = {"inside": ~off[1:] & ~off[:-1], "outside": off[1:] & off[:-1], "edge": off[1:] != off[:-1]}
    return np.asarray(parts[part])


def step_times(mechanism: Mechanism, targets: Floats, solution: Track, repeats: int) -> Floats:
    """Median time of each step by the paper's passes [s], on one core."""
    taken = np.zeros((min(repeats, 5), len(targets)))
    seeds = [None, *solution[:-1]]
    with one_core():
        for row in taken:
            for i, seed in enumerate(seeds):
                start = clock()
                passes.track(mechanism, targets[i : i + 1], start=seed)
                row[i] = clock() - start
    return np.asarray(np.median(taken, axis=0))


def summary(found: Robustness) -> list[dict[str, Any]]:
    """One row for each set of options."""
    length = found.case.mechanism.characteristic_length
    return [
        {
            "mechanism": found.case.key,
            "options": name,
            "steps": len(found.targets),
            "beyond": int(found.beyond.sum()),
            "projected": int(run.projected.sum()),
            "missed": found.missed(name),
            "by_fallback": run.by_fallback,
            **run.feasibility._asdict(),
            "largest_distance": float(run.solution.position_error.max()),
            "orientation_given_up": int((run.solution.rotation_error > ROTATION).sum()),
            "compared": len(run.ratios),
            **ratio_cells("ratio", run.ratios),
            "jump_ratio": run.jump_ratio,
            "leaps": run.leaps,
            "iterations_inside": float(np.mean(run.solution.iterations[~found.beyond])),
            "iterations_outside": float(np.mean(run.solution.iterations[found.beyond])),
            "rounds_most": int(run.solution.rounds.max()),
            "length": length,
        }
        for name, run in found.runs.items()
    ]


def ratio_cells(name: str, ratios: Floats) -> dict[str, float]:
    """The least, the median, that of 95 in 100, and the worst."""
    places = {"least": 0.0, "median": 0.5, "95": 0.95, "worst": 1.0}
    return {f"{name}_{what}": float(np.quantile(ratios, share)) for what, share in places.items()}


def jump_rows(found: Robustness) -> list[dict[str, Any]]:
    """One row for each set of options, kind of actuator and part of the path."""
    return [
        {"mechanism": found.case.key, "options": name, "actuators": kind, "part": part, **vars(jump)}
        for name, run in found.runs.items()
        for kind, parts in run.jumps.items()
        for part, jump in parts.items()
    ]


def steps(found: Robustness) -> list[dict[str, Any]]:
    """One row for each step: what the paper's passes answer, and how far the others are."""
    solution = found.paper.solution
    others = {name: run.solution for name, run in found.runs.items() if name != "paper"}
    return [
        {
            "step": i,
            **{f"target_{name}": found.targets[i, k, 3] for k, name in enumerate("xyz")},
            **{name: solution.pose[i, k, 3] for k, name in enumerate("xyz")},
            "status": Status(int(solution.status[i])).name,
            "position_error": solution.position_error[i],
            "rotation_error": solution.rotation_error[i],
            **{f"{name}_position_error": other.position_error[i] for name, other in others.items()},
            "nearest": found.nearest[i] if np.isfinite(found.nearest[i]) else "",
            "nearest_by_search": found.searched[i] if np.isfinite(found.searched[i]) else "",
            "iterations": solution.iterations[i],
            "rounds": solution.rounds[i],
            "residual": solution.residual[i],
            "limit_excess": solution.limit_excess[i],
            **dict(zip(solution.mechanism.actuator_names, solution.actuators[i], strict=True)),
            "active_limits": "; ".join(f"{limit.joint} {limit.bound}" for limit in solution.active_limits[i]),
        }
        for i in range(len(found.targets))
    ]


def step_time_rows(found: Robustness) -> list[dict[str, Any]]:
    """One row for each step: how long it took by the paper's passes."""
    return [{"step": i, "microseconds": 1e6 * seconds} for i, seconds in enumerate(found.seconds)]
