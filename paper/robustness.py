"""The third experiment: circles that leave the workspace, and what a figure of them cannot show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pfabrik import Mechanism, Status, Track, Workspace, passes, solve_ik, workspace

from .arrays import Floats, Mask
from .checking import Feasibility, feasibility
from .closest import Comparison, compare
from .study import Case, Extent, Tick
from .timing import clock, one_core
from .tolerances import ROTATION

CENTROID = passes.Options.centroid()
"""The paper's projection, finished exactly."""


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
class Robustness:
    """The experiment on one machine.

    Attributes
    ----------
    solution : what `track` answered, projected as the paper does.
    feasibility, exact_feasibility, accelerated_feasibility : of its steps, and of the same targets projected exactly
        and by half-spaces.
    jumps : by kind of actuator ("lengths", "angles"), then by part of the path: "inside", "outside", "edge" (between
        a step that is reached and one that is not).
    compared : projected steps next to the nearest feasible pose.
    seconds : median time of each step, answered alone from the answer before it (n,).
    """

    case: Case
    targets: Floats
    solution: Track
    feasibility: Feasibility
    exact_feasibility: Feasibility
    accelerated_feasibility: Feasibility
    jumps: dict[str, dict[str, Jump]]
    compared: list[Comparison]
    workspace: Workspace
    seconds: Floats

    @property
    def projected(self) -> Mask:
        return np.asarray(self.solution.status == Status.PROJECTED)

    @property
    def ratios(self) -> Floats:
        """Distance to the target over that of the nearest feasible pose."""
        return np.array([pair.distance / pair.nearest for pair in self.compared])

    @property
    def accelerated_ratios(self) -> Floats:
        """The same for the projection by half-spaces."""
        return np.array([pair.accelerated / pair.nearest for pair in self.compared])

    @property
    def exact_ratios(self) -> Floats:
        """The same for the exact projection, over the distance of the nearest pose that the optimiser finds."""
        return np.array([pair.exact / pair.searched for pair in self.compared])


def run(case: Case, extent: Extent, tick: Tick) -> Robustness:
    """Follow the circle that leaves the workspace."""
    mechanism = case.mechanism
    targets = case.leaving.poses(extent.steps)
    solution = passes.track(mechanism, targets, CENTROID)
    finer = passes.track(mechanism, case.leaving.poses(2 * extent.steps - 1), CENTROID)
    exact = solve_ik(mechanism, targets)
    accelerated = passes.solve(mechanism, targets, passes.Options.accelerated())
    compared = compare(targets, solution, exact, accelerated, extent.searches, tick)
    return Robustness(
        case=case,
        targets=targets,
        solution=solution,
        feasibility=feasibility(solution),
        exact_feasibility=feasibility(exact),
        accelerated_feasibility=feasibility(accelerated),
        jumps=jumps(solution, finer),
        compared=compared,
        workspace=workspace(mechanism, over=("y", "z"), fixed={"x": case.leaving.center[0]}),
        seconds=step_times(mechanism, targets, solution, extent.repeats),
    )


def jumps(solution: Track, finer: Track) -> dict[str, dict[str, Jump]]:
    """The largest changes of the actuators of either kind, in each part of the path."""
    mechanism = solution.mechanism
    is_length = np.array([drive.kind == "length" for drive in mechanism.drives])
    kinds = {"lengths": is_length, "angles": ~is_length}
    return {
        kind: {part: _jump(solution, finer, chosen, part) for part in ("inside", "outside", "edge")}
        for kind, chosen in kinds.items()
        if chosen.any()
    }


def _jump(solution: Track, finer: Track, chosen: Mask, part: str) -> Jump:
    changes = _changes(solution, chosen, part)
    step = int(changes.argmax()) + 1 if changes.max() > 0.0 else -1
    return Jump(float(changes.max()), step, float(_changes(finer, chosen, part).max()))


def _changes(solution: Track, chosen: Mask, part: str) -> Floats:
    """Largest change of the chosen actuators into each step but the first; 0 outside the part."""
    off = np.asarray(solution.status) != Status.REACHED
    parts = {"inside": ~off[1:] & ~off[:-1], "outside": off[1:] & off[:-1], "edge": off[1:] != off[:-1]}
    changes = np.abs(np.diff(solution.actuators[:, chosen], axis=0)).max(axis=1)
    return np.asarray(np.where(parts[part], changes, 0.0))


def step_times(mechanism: Mechanism, targets: Floats, solution: Track, repeats: int) -> Floats:
    """Median time of each step [s], on one core."""
    taken = np.zeros((repeats, len(targets)))
    seeds = [None, *solution[:-1]]
    with one_core():
        for row in taken:
            for i, seed in enumerate(seeds):
                start = clock()
                passes.track(mechanism, targets[i : i + 1], CENTROID, start=seed)
                row[i] = clock() - start
    return np.asarray(np.median(taken, axis=0))


def summary(found: Robustness) -> dict[str, Any]:
    """One row."""
    mechanism = found.case.mechanism
    return {
        "mechanism": found.case.key,
        "steps": len(found.targets),
        "projected": int(found.projected.sum()),
        **found.feasibility._asdict(),
        "largest_distance": float(found.solution.position_error.max()),
        "orientation_given_up": int((found.solution.rotation_error > ROTATION).sum()),
        "compared": len(found.compared),
        **ratio_cells("ratio", found.ratios),
        **ratio_cells("exact_ratio", found.exact_ratios),
        **ratio_cells("accelerated_ratio", found.accelerated_ratios),
        "iterations_inside": float(np.mean(found.solution.iterations[~found.projected])),
        "iterations_outside": float(np.mean(found.solution.iterations[found.projected])),
        "length": mechanism.characteristic_length,
    }


def ratio_cells(name: str, ratios: Floats) -> dict[str, float]:
    """The least, the median, that of 95 in 100, and the worst."""
    places = {"least": 0.0, "median": 0.5, "95": 0.95, "worst": 1.0}
    return {f"{name}_{what}": float(np.quantile(ratios, share)) for what, share in places.items()}


def jump_rows(found: Robustness) -> list[dict[str, Any]]:
    """One row for each kind of actuator and part of the path."""
    return [
        {"mechanism": found.case.key, "actuators": kind, "part": part, **vars(jump)}
        for kind, parts in found.jumps.items()
        for part, jump in parts.items()
    ]


def steps(found: Robustness) -> list[dict[str, Any]]:
    """One row for each step."""
    solution = found.solution
    compared = {pair.step: pair for pair in found.compared}
    return [
        {
            "step": i,
            **{f"target_{name}": found.targets[i, k, 3] for k, name in enumerate("xyz")},
            **{name: solution.pose[i, k, 3] for k, name in enumerate("xyz")},
            "status": Status(int(solution.status[i])).name,
            "position_error": solution.position_error[i],
            "rotation_error": solution.rotation_error[i],
            "exact_projection": compared[i].exact if i in compared else "",
            "accelerated_projection": compared[i].accelerated if i in compared else "",
            "nearest_by_search": compared[i].searched if i in compared else "",
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
    """One row for each step: how long it took."""
    return [{"step": i, "microseconds": 1e6 * seconds} for i, seconds in enumerate(found.seconds)]
