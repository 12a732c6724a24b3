"""The next configurations to measure: those that determine parameters best, chosen by exchange."""

from __future__ import annotations

import numpy as np

from ...answers.solution import Solution
from ...answers.status import Status
from ...common.arrays import Floats
from ...common.checks import require_choice, require_count
from ...common.rotations import from_rotvec
from ...errors import InvalidArgument
from ...ik import solve_ik
from ...kinematics import task_of
from ...machine.description.mechanism import Mechanism
from .linear_fit import LinearFit
from .measured_residuals import Fit, slopes_of, whitened
from .measurements import Measurements
from .parameters import Parameters

CANDIDATES = 400
"""Feasible configurations that are chosen from."""

SPREAD, TILT = 1.2, 0.6
"""Targets are spread about home by this share of L, and tilted by up to this angle [rad]; feasible poses answer."""

EXCHANGES = 40
"""Rounds of exchanges at most: each goes through all that are chosen."""

LEAST = 1e-6
"""Information that each scaled parameter has without any measurement, so that few configurations can be compared."""

CRITERIA = ("deviation", "determinant")


def suggested(
    mechanism: Mechanism,
    parameters: Parameters,
    values: Floats,
    measured: Measurements,
    known: LinearFit,
    n: int,
    criterion: str,
    seed: int,
) -> Floats:
    """Actuator values (n, n_a) of the configurations to measure next, like those that were.

    Parameters
    ----------
    mechanism, values : the calibrated machine, and the values of its parameters.
    known : what is known from the measurements so far.
    criterion, seed : as of `Calibration.suggest`.
    """
    require_count("n", n, most=CANDIDATES // 2)
    require_choice("criterion", criterion, CRITERIA)
    solution = _feasible(mechanism, seed)
    actuators = solution.actuators / parameters.factors_at(values)
    if len(actuators) < n:
        raise InvalidArgument("n", str(n), f"at most {len(actuators)}: so many feasible configurations were found")
    rows = _measured_rows(parameters, values, measured, solution)
    information = np.einsum("kmp,kmq->kpq", rows, rows)
    base = known.jacobian.T @ known.jacobian + LEAST * np.eye(known.jacobian.shape[1])
    return np.asarray(actuators[_exchanged(information, base, n, criterion, np.random.default_rng(seed))])


def _feasible(mechanism: Mechanism, seed: int) -> Solution:
    """Feasible configurations all over the workspace."""
    rng, task, length = np.random.default_rng(seed), task_of(mechanism), mechanism.characteristic_length
    targets = np.tile(mechanism.home_pose, (2 * CANDIDATES, 1, 1))
    targets[:, :3, 3] += rng.uniform(-SPREAD, SPREAD, (len(targets), 3)) * length * np.array(task.axes)
    targets[:, :3, :3] = from_rotvec(rng.uniform(-TILT, TILT, (len(targets), 3)) * np.array(task.turns))
    solution = solve_ik(mechanism, targets)
    kept = np.flatnonzero(solution.status <= Status.PROJECTED)
    _, first = np.unique(np.round(solution.actuators[kept], 9), axis=0, return_index=True)
    return solution[kept[np.sort(first)][:CANDIDATES]]


def _measured_rows(parameters: Parameters, values: Floats, given: Measurements, solution: Solution) -> Floats:
    """Derivatives (k, m, p) of the quantities that were measured, at other configurations, by scaled parameters.

    A position that was measured in some components is taken to be measured in all, a distance as a position is.
    """
    k = len(solution)
    zero = np.zeros(k)
    like = Measurements(
        solution.actuators / parameters.factors_at(values),
        position=np.zeros((k, 3)) if given.position is not None or len(given.distances) else None,
        orientation=None if given.orientation is None else np.tile(np.eye(3), (k, 1, 1)),
        height=None if given.height is None else zero,
        joints=dict.fromkeys(given.joints, zero),
        sigma={"position": given.sigma.get("distances", 1.0)} | given.sigma if given.sigma else None,
    )
    fit = Fit(parameters, like)
    fit.begin_at(values, solution)
    blocks = fit.blocks(values, slopes=True)
    factors = whitened(blocks, like.sigma, fit.length, None)
    rows = factors[:, None] * slopes_of(blocks) * parameters.scales
    numbers = np.concatenate([block.groups for block in blocks])
    order = np.argsort(numbers, kind="stable")
    return np.asarray(rows[order].reshape(k, -1, rows.shape[1]))


def _exchanged(information: Floats, base: Floats, n: int, criterion: str, rng: np.random.Generator) -> list[int]:
    """Numbers of n candidates: greedily chosen, then exchanged one by one as long as that makes them better."""
    chosen: list[int] = []
    total = base.copy()
    for _ in range(n):
        free = np.setdiff1d(np.arange(len(information)), chosen)
        best = free[int(np.argmin(_losses(total + information[free], "determinant")))]
        chosen.append(int(best))
        total = total + information[best]
    loss = float(_losses(total[None], criterion)[0])
    for _ in range(EXCHANGES):
        before = loss
        for place in rng.permutation(n):
            rest = total - information[chosen[place]]
            free = np.setdiff1d(np.arange(len(information)), [c for k, c in enumerate(chosen) if k != place])
            losses = _losses(rest + information[free], criterion)
            best = int(np.argmin(losses))
            if losses[best] < loss * (1.0 - 1e-9):
                chosen[place], loss = int(free[best]), float(losses[best])
                total = rest + information[chosen[place]]
        if loss >= before * (1.0 - 1e-6):
            break
    return chosen


def _losses(information: Floats, criterion: str) -> Floats:
    """Losses of information matrices (k, p, p)."""
    if criterion == "determinant":
        signs, logarithms = np.linalg.slogdet(information)
        return np.asarray(np.exp(np.where(signs > 0.0, -logarithms / information.shape[1], 700.0)))
    return np.asarray(np.diagonal(np.linalg.inv(information), axis1=1, axis2=2).max(axis=1))
