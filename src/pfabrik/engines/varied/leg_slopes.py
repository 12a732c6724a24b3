"""Derivatives of pose and actuators by the geometry, of machines whose chains are all legs in closed form."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats
from ...common.derived import derived
from ...machine.decomposition.leg_table import leg_table
from ...machine.description.geometry import Geometry, home_numbers, limit_numbers
from ...machine.description.mechanism import Mechanism
from ...machine.model import Model, model_of
from ...machine.noted_numbers import Formulas, Trace
from ...tolerances import TOLERANCES
from ..joints.configurations import Configurations
from ..pose.answers import sides_at
from ..pose.tip_engine import measured
from .placed_legs import PlacedLegs, open_motions

APART = 1e-3
"""Share of a parameter's scale by which it is changed to see if legs stay the same: far beyond the tolerances within
which joints count as in line, or parallel."""


class PoseSlopes(NamedTuple):
    """Derivatives by p parameters.

    Attributes
    ----------
    twists : of the end effector at held actuators, (n, 6, p) [length or rad].
    actuators : at held pose, or at held coordinates of the task, (n, n_a, p) [length or rad].
    opened : how far the loops open by each parameter, (p,) [L or rad].
    """

    twists: Floats
    actuators: Floats
    opened: Floats


class LegSlopes:
    """The legs of a machine as expressions of home's numbers, with derivatives by parameters of these."""

    def __init__(self, model: Model) -> None:
        mechanism, trace = model.mechanism, Trace()
        given = [trace.input(number) for number in home_numbers(mechanism).tolist()]
        self._table = leg_table(mechanism, [*given, *limit_numbers(mechanism)])
        self._legs = legs = PlacedLegs(trace, self._table, given[0], has_sides=True)
        read = {id(each) for _, operands in trace.steps for each in operands}
        self._used = np.array([place for place, number in enumerate(given) if id(number) in read])
        given = [given[place] for place in self._used]
        decisions = list(trace.decisions.values())
        self._decided = np.array(decisions, float)
        self._decisions, self._uniform = Formulas(decisions, given, 0), Formulas(legs.uniform, given, 0)
        self._formulas = legs.formulas([*legs.actuators, *legs.rows])
        is_angle = np.array([drive.kind == "angle" for drive in model.mechanism.drives])
        self._turns = np.where(is_angle, 2.0 * np.pi, 0.0)
        self._close = TOLERANCES.position * np.r_[np.where(is_angle, 1.0, model.length), np.ones(len(legs.rows))]

    def keeps(self, mechanism: Mechanism, slopes: Geometry, scales: Floats) -> bool:
        """True if legs stay the same when parameters change, by `APART` of their scales (p,), both ways.

        Otherwise they are expressions of what these parameters change only together: of joints in line, say.
        """
        changes = APART * scales[:, None] * _numbers_by(slopes)
        numbers = home_numbers(mechanism) + np.concatenate([changes, -changes])
        found, _ = self._decisions(np.empty(0), np.ascontiguousarray(numbers[:, self._used]))
        return bool((found == self._decided).all())

    def at(
        self, mechanism: Mechanism, at: Configurations, slopes: Geometry, moved: Floats | float = 0.0
    ) -> PoseSlopes | None:
        """Derivatives at configurations by p parameters; None where legs are not closed as these are.

        With M the slopes of actuators and constraints by the pose, and G those by the parameters, M dx + G = 0.

        Parameters
        ----------
        mechanism : of the same legs; its geometry may be another.
        slopes : derivatives of the geometry by the parameters.
        moved : how far parameters move actuators that read the same, (n, n_a, p) [rad or length]; by default not.
        """
        legs, m, n_a = self._legs, len(self._legs.uniform), len(self._legs.actuators)
        model, poses, changes = model_of(mechanism), at.rows.poses, _numbers_by(slopes)
        sides = np.broadcast_to(sides_at(model, at), (len(poses), len(model.legs.legs)))
        own = home_numbers(mechanism)[None, self._used]
        values, slopes_of_parts = self._uniform(np.empty(0), own, changes[:, self._used].T)
        order = np.argsort((slopes_of_parts[0] != 0.0).argmax(axis=0), kind="stable")  # those of one leg side by side
        uniform, n_q = np.concatenate([values[0], np.zeros(6)]), len(legs.implicit)
        given = np.concatenate([poses[:, :3].reshape(-1, 12), sides], axis=1)
        by_home, by_pose = np.zeros((m + 18 + len(legs.q), len(order))), np.zeros((m + 18 + len(legs.q), 6 + n_q))
        by_home[:m] = slopes_of_parts[0][:, order]
        by_pose[m : m + 6, :6] = np.eye(6)
        by_pose[[m + 18 + k for k in legs.implicit], 6:] = np.eye(n_q)
        found, G = self._formulas(uniform, given, by_home)
        apart = found - np.pad(at.rows.actuators, ((0, 0), (0, len(legs.rows))))
        apart[:, :n_a] -= self._turns * np.rint(apart[:, :n_a] / (2.0 * np.pi))
        if not (np.abs(apart) <= self._close).all():
            return None
        M = self._formulas(uniform, given, by_pose)[1]
        if not (np.isfinite(M).all() and np.isfinite(G).all()):
            return None
        motions, held = open_motions(self._table, poses[:, :3, :3], n_q), G[:, :n_a].copy()
        if motions.shape[2]:
            by_open = M @ motions
            held -= by_open[:, :n_a] @ (np.linalg.pinv(by_open[:, n_a:], TOLERANCES.rank) @ G[:, n_a:])
        G[:, :n_a] -= moved[:, :, order] if isinstance(moved, np.ndarray) else 0.0
        moves, opened = _solved(M, G)
        back = np.argsort(order)
        return PoseSlopes(-moves[:, :6, back], held[:, :, back], opened[back])


@derived
def leg_slopes(model: Model) -> LegSlopes | None:
    """The legs of a machine as expressions; None if poses do not give all that legs have."""
    if model.why_poses_do_not_suffice or measured(model) is not model:
        return None
    return LegSlopes(model)


def _solved(M: Floats, right: Floats) -> tuple[Floats, Floats]:
    """The least solutions x of M x = right, (n, k, p), and how far the worst row of each column is from one, (p,)."""
    if M.shape[1] == M.shape[2]:
        try:
            inverses = np.linalg.inv(M)
        except np.linalg.LinAlgError:
            inverses = np.full_like(M, np.inf)
        if np.abs(inverses).max(initial=0.0) < 1.0 / TOLERANCES.rank:
            return inverses @ right, np.zeros(right.shape[2])
    found = np.linalg.pinv(M, TOLERANCES.rank) @ right
    return found, np.abs(M @ found - right).max(axis=(0, 1), initial=0.0)


def _numbers_by(slopes: Geometry) -> Floats:
    """Derivatives of home's numbers, (p, k), from those of a geometry; L, a unit, stays."""
    parts = (slopes.reference_point, slopes.points, slopes.axes, slopes.home)
    p = len(slopes.home)
    return np.concatenate([np.zeros((p, 1)), *(np.nan_to_num(part).reshape(p, -1) for part in parts)], axis=1)
