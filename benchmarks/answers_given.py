"""What machines answer to `answers.py`: every question as a table of numbers and words, by public names alone."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

import pfabrik as pf
from answers_asked import Array, Asked, as_machine

HELD = (None, "orientation", "position")
MOST_LIMITS = 6
"""Limits that hold one answer back, the hardest first, that are kept with their numbers; all are kept by name."""


@dataclass(frozen=True)
class Table:
    """Answers, a row each.

    Attributes
    ----------
    columns : name of each number, with how many there are of it.
    numbers : (n, as many).
    words : n; the names of limits, or the error that was raised.
    """

    columns: dict[str, int]
    numbers: Array
    words: list[str]


def table(fields: Mapping[str, object], words: list[str] | None = None) -> Table:
    """Fields (n, ...) side by side."""
    rows = {name: np.asarray(value, dtype=float) for name, value in fields.items()}
    n = len(next(iter(rows.values())))
    flat = {name: value.reshape(n, -1) for name, value in rows.items()}
    return Table(
        {name: value.shape[1] for name, value in flat.items()},
        np.concatenate(list(flat.values()), axis=1),
        [""] * n if words is None else words,
    )


def raised(error: Exception) -> Table:
    """An error, which is an answer too: its kind."""
    return Table({}, np.zeros((1, 0)), [type(error).__name__])


def given(asked: Asked) -> Iterator[tuple[str, Table]]:
    """Every question of a machine, answered."""
    mechanism = as_machine(asked.text)
    for name, question in questions(mechanism, asked).items():
        try:
            yield name, question()
        except (ValueError, NotImplementedError) as error:  # what the library raises on purpose is a ValueError
            yield name, raised(error)


def questions(m: pf.Mechanism, asked: Asked) -> dict[str, Callable[[], Table]]:
    """What is asked, by name."""
    T, q = asked.targets, asked.start
    few = T[: max(len(T) // 4, 6)]

    def ik(targets: Array, start: Array | None = None, **options: object) -> Table:
        return answers(pf.solve_ik(m, targets, start=start, options=pf.Options(**options)))

    def fk(start: Array | None = None) -> Table:
        return answers(pf.solve_fk(m, asked.values, start=start), of_actuators=True)

    return {
        "ik": partial(ik, T),
        "ik, nothing held": partial(ik, T, hold=None),
        "ik, position held": partial(ik, T, hold="position"),
        "ik from a start": partial(ik, T, q),
        "ik, working mode kept": partial(ik, T, working_mode="keep"),
        "ik from a start, any working mode": partial(ik, few, q, working_mode="any"),
        "ik by the centroid": lambda: answers(pf.passes.solve(m, few, pf.passes.Options.centroid())),
        "ik by the paper's passes": lambda: answers(pf.passes.solve(m, few)),
        "ik one by one": lambda: stacked([pf.solve_ik(m, target) for target in few[:12]]),
        "ik of a Solver": lambda: solver(pf.Solver(m), few[:12]),
        "track": lambda: answers(pf.track(m, asked.path)),
        "track from a start": lambda: answers(pf.track(m, asked.path[:20], start=q)),
        "fk": fk,
        "fk from a start": partial(fk, q),
        "q": lambda: joints(pf.solve_ik(m, T)),
        "q of track": lambda: joints(pf.track(m, asked.path)),
        "q of fk": lambda: joints(pf.solve_fk(m, asked.values)),
        "active limits": lambda: limits(pf.solve_ik(m, T)),
        "active limits, nothing held": lambda: limits(pf.solve_ik(m, few, options=pf.Options(hold=None))),
        "active limits of a start": lambda: limits(pf.solve_ik(m, few, start=q)),
        "margins": lambda: margins(pf.solve_ik(m, T)),
        "residual": lambda: table({"residual": pf.closure_residual(pf.solve_ik(m, few))}),
        "feasibility": lambda: feasible(pf.feasibility(m, T)),
        "feasibility from a start": lambda: feasible(pf.feasibility(m, T, start=q)),
        "jacobians": lambda: jacobians(pf.configuration(m, q)),
        "travel": lambda: reaches(pf.configuration(m, q), len(T)),
    }


def answers(solution: pf.Solution, of_actuators: bool = False) -> Table:
    """What answers say of themselves."""
    fields = {
        "status": solution.status,
        "pose": solution.pose[..., :3, :],
        "actuators": solution.actuators,
        "position error": solution.position_error,
        "rotation error": solution.rotation_error,
        "residual": solution.residual,
        "limit excess": solution.limit_excess,
        "passes": solution.iterations,
        "rounds": solution.rounds,
        "certified": solution.certified,
        "held": [HELD.index(held) for held in solution.held],
    }
    return table(fields | ({"actuator error": solution.actuator_error} if of_actuators else {}))


def stacked(solutions: list[pf.Solution]) -> Table:
    """Single answers, one below the other."""
    return table(
        {
            "status": [int(each.status) for each in solutions],
            "pose": [each.pose[:3] for each in solutions],
            "actuators": [each.actuators for each in solutions],
            "residual": [each.residual for each in solutions],
        }
    )


def solver(prepared: pf.Solver, targets: Array) -> Table:
    """Answers of a prepared Solver to targets, then to the actuators of these."""
    rows = []
    for target in targets:
        prepared.ik(np.ascontiguousarray(target))
        rows.append((int(prepared.status), prepared.pose[:3].copy(), prepared.actuators.copy()))
    for _, _, actuators in rows[:]:
        prepared.fk(actuators)
        rows.append((int(prepared.status), prepared.pose[:3].copy(), prepared.actuators.copy()))
    status, pose, actuators = zip(*rows, strict=True)
    return table({"status": status, "pose": pose, "actuators": actuators})


def joints(solution: pf.Solution) -> Table:
    return table({"q": solution.q})


def limits(solution: pf.Solution) -> Table:
    """What holds answers back: names, and the numbers of the first few."""
    rows = solution.active_limits
    numbers = np.full((len(rows), MOST_LIMITS, 3), np.nan)
    for own, row in zip(numbers, rows, strict=True):
        for place, each in zip(own, row, strict=False):
            place[:] = each.value, each.limit, np.nan if each.multiplier is None else each.multiplier
    words = ["; ".join(f"{each.joint}[{each.coordinate}] {each.bound}" for each in row) for row in rows]
    return table({"value": numbers[..., 0], "limit": numbers[..., 1], "multiplier": numbers[..., 2]}, words)


def margins(solution: pf.Solution) -> Table:
    found = pf.margins(solution)
    fields = {f"{joint} {bound}": margin for (joint, bound), margin in sorted(found.items())}
    return table(fields or {"none": np.zeros(len(solution))})


def feasible(found: pf.Feasibility) -> Table:
    words = [" ".join(found.limits[place]) if place >= 0 else str(place) for place in found.binding]
    return table({"margin": found.margin}, words)


def jacobians(solution: pf.Solution) -> Table:
    measures = pf.singularity(solution)
    fields = {name: [value] for name, value in vars(measures).items() if isinstance(value, int | float | np.floating)}
    return table({"forward": pf.forward_jacobian(solution)[None], **fields})


def reaches(origin: pf.Solution, n_targets: int) -> Table:
    """How far it is in each direction, and what stops it; in one only where answers take long."""
    axes = [axis for name, axis in zip("xyz", np.eye(3), strict=True) if name in origin.mechanism.task]
    found = pf.travel(origin) if n_targets >= 200 or not axes else pf.travel(origin, along=axes[0])
    words = [f"{each.kind} {'; '.join(f'{limit.joint} {limit.bound}' for limit in each.stopped_by)}" for each in found]
    return table({"distance": found.distances, "direction": [each.direction for each in found]}, words)
