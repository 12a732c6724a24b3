"""The first experiment: circles inside the workspace, followed, and verified by forward kinematics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pfabrik import Options, Solution, Status, passes, solve_fk

from .arrays import Floats
from .checking import Feasibility, feasibility
from .study import SETTINGS, Case, Extent, Tick, follow


@dataclass(frozen=True)
class Followed:
    """One path with one set of options.

    Attributes
    ----------
    solution : what `track` answered, n steps.
    position_errors, orientation_errors : of the poses that Newton's method finds from the actuators of each step,
        begun at the step before, against the targets, (n,) [length], [deg].
    by_fallback : steps that passes did not answer.
    """

    solution: Solution
    position_errors: Floats
    orientation_errors: Floats
    by_fallback: int
    feasibility: Feasibility

    @property
    def position_rmse(self) -> float:
        return rms(self.position_errors)

    @property
    def orientation_rmse(self) -> float:
        return rms(self.orientation_errors)


@dataclass(frozen=True)
class Efficacy:
    """The experiment on one machine, by the name of its options."""

    case: Case
    targets: Floats
    runs: dict[str, Followed]


def run(case: Case, extent: Extent, tick: Tick) -> Efficacy:
    """Follow the circle inside the workspace with every set of options."""
    targets = case.inside.poses(extent.steps)
    runs = {name: go_around(case, targets, options) for name, options in SETTINGS.items()}
    tick()
    return Efficacy(case, targets, runs)


def go_around(case: Case, targets: Floats, options: Options) -> Followed:
    """Inverse kinematics along a path, then forward kinematics of every step from the step before."""
    solution = follow(case.mechanism, targets, options)
    start = solve_fk(case.mechanism, solution[:1].actuators)
    rest = solve_fk(case.mechanism, solution[1:].actuators, start=solution[:-1])
    poses = np.concatenate([start.pose, rest.pose])
    return Followed(
        solution=solution,
        position_errors=np.linalg.norm(poses[:, :3, 3] - targets[:, :3, 3], axis=1),
        orientation_errors=np.degrees(angles_between(poses[:, :3, :3], targets[:, :3, :3])),
        by_fallback=int(np.sum(passes.by_fallback(solution))),
        feasibility=feasibility(solution),
    )


def angles_between(one: Floats, other: Floats) -> Floats:
    """Angles (n,) [rad] from rotations to others, matrices (n, 3, 3): by their chord, exact also where tiny."""
    half_sine = np.sqrt(((one - other) ** 2).sum(axis=(1, 2)) / 8.0)
    return np.asarray(2.0 * np.arcsin(np.minimum(half_sine, 1.0)))


def rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


def summary(found: Efficacy) -> list[dict[str, Any]]:
    """One row for each set of options."""
    return [
        {
            "mechanism": found.case.key,
            "options": name,
            "steps": len(found.targets),
            "reached": int(np.count_nonzero(run.solution.status == Status.REACHED)),
            "position_rmse": run.position_rmse,
            "orientation_rmse_deg": None if is_point(found.case) else run.orientation_rmse,
            "iterations": float(np.mean(run.solution.iterations)),
            "by_fallback": run.by_fallback,
            **run.feasibility._asdict(),
        }
        for name, run in found.runs.items()
    ]


def steps(found: Efficacy) -> list[dict[str, Any]]:
    """One row for each step: errors after the round trip, with every set of options."""
    return [
        {
            "step": i,
            **dict(zip("xyz", found.targets[i, :3, 3], strict=True)),
            **{
                f"{name}_{what}": getattr(run, what)[i]
                for name, run in found.runs.items()
                for what in ("position_errors", "orientation_errors")
            },
        }
        for i in range(len(found.targets))
    ]


def is_point(case: Case) -> bool:
    """Whether the end effector has a position only."""
    return case.mechanism.end_effector_is_joint
