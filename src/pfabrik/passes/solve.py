"""Inverse kinematics and paths by the paper's method."""

from __future__ import annotations

from typing import Any, cast

from ..answers.pace import pace_of
from ..answers.solution import Solution
from ..answers.start_configuration import Start
from ..answers.tracked import Track
from ..common.arrays import Mask
from ..common.derived import derived
from ..engines.engine import engine_of
from ..engines.joints.configurations import Configurations
from ..engines.joints.engine_contract import InverseEngine
from ..engines.targets import Target
from ..ik import solve_by
from ..kernels.rows import ROUNDS
from ..machine.decomposition.decompose import positions_express
from ..machine.description.mechanism import Mechanism, checked_mechanism
from ..machine.model import Model, model_of
from ..options import options_or
from ..track import as_path, follow_by
from .pass_options import PAPER, PassOptions
from .passes_engine import BY_FALLBACK, PassesEngine


def solve(
    mechanism: Mechanism, target: Target, options: PassOptions | None = None, *, start: Start | None = None
) -> Solution:
    """Solve for targets by passes.

    `solve_ik` answers, and such answers are marked (`by_fallback`), where passes end beyond a limit or with open loops,
    and for mechanisms that joint positions do not express (`decompose`) or whose task leaves a part of the pose open.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    target : array or RigidTransform or mapping
        Target as in `solve_ik`.
    options : Options, optional
        Default `Options.paper()`.
    start : Solution or array (..., nq), optional
        Start as in `solve_ik`.
    """
    options = options_or(PAPER, options).of(checked_mechanism(mechanism))
    return solve_by(lambda machine: _engine(model_of(machine), options), mechanism, target, start, options)


def track(
    mechanism: Mechanism, targets: Target, options: PassOptions | None = None, *, start: Start | None = None
) -> Track:
    """Follow a path by passes; see `pfabrik.track`.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    targets : array or RigidTransform or mapping
        Targets as in `pfabrik.track`.
    options : Options, optional
        Default `Options.paper()`.
    start : Solution or array (nq,), optional
        Start as in `pfabrik.track`.
    """
    options = options_or(PAPER, options).of(checked_mechanism(mechanism))
    poses = as_path(mechanism, targets, options)
    engine = _engine(model_of(mechanism), options)
    solutions, request = follow_by(engine, mechanism, poses, start, options, None)
    return Track(mechanism, solutions, request, pace_of(mechanism, len(poses), None, None, None), engine)


def by_fallback(solution: Solution) -> bool | Mask:
    """True for answers of `pfabrik.passes` that passes did not find: `rounds` is -1, another engine answered.

    Parameters
    ----------
    solution : Solution
        An answer, or a batch.
    """
    return cast(bool | Mask, solution.rounds == BY_FALLBACK)


@derived
def _engine(model: Model, options: PassOptions) -> InverseEngine:
    usual = engine_of(model.mechanism)
    is_expressed = positions_express(model.mechanism)
    return PassesEngine(model.mechanism, usual, options) if is_expressed else cast(InverseEngine, _Fallback(usual))


class _Fallback:
    """The usual engine, whose answers are marked."""

    def __init__(self, usual: InverseEngine) -> None:
        self._usual = usual

    def __getattr__(self, name: str) -> Any:
        return getattr(self._usual, name)

    def answer(self, *given: Any, **options: Any) -> Configurations:
        return _marked(self._usual.answer(*given, **options))

    def follow(self, *given: Any, **options: Any) -> Configurations:
        return _marked(self._usual.follow(*given, **options))


def _marked(solutions: Configurations) -> Configurations:
    solutions.rows.counters[:, ROUNDS] = BY_FALLBACK
    return solutions
