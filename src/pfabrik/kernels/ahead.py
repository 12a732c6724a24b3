"""Ahead-of-time compilation of every kernel, without a mechanism."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from ._pipeline import name_of
from .chains.answer_chains import nearest_in_chains, reach_in_chains, walk_chains
from .chains.chain_records import ChainAim, ChainAnswers
from .closure.close import close
from .closure.descend import nearest_configuration
from .closure.first_order import PLAN, first_order
from .closure.loops import Closed, ClosureProblem, FirstOrder, Objective, PoseObjective
from .lattice import join, number_points
from .legs.answer import answer
from .legs.blocks import answer_blocks
from .legs.feasibility import feasibility
from .legs.margin_blocks import margins_in_blocks
from .platform.any_mode import answer_in_any_mode
from .platform.evaluate import evaluate_poses
from .platform.forward import assemble
from .platform.jacobians import jacobians
from .platform.nearest import nearest_pose
from .reaching import plan as P
from .reaching.accelerated import solve_by_half_spaces
from .reaching.move_trunks import move_trunks
from .reaching.solve import solve_by_passes
from .timing import fastest, second_derivatives
from .walk_path import walk_path

_config: Any = numba.config
_typeof: Any = numba.typeof

_PLAN_RECORDS = (P.NODE, P.BRANCH, P.CHAIN, P.CONE, P.TRUNK_SPAN, P.TRUNK_JOINT)


def _values(codes: str) -> list[Any]:
    """Values of the types of the codes: i and f for numbers, followed by the dimensions for arrays."""
    numbers = {"i": 0, "f": 0.0}
    return [numbers[c] if len(c) == 1 else np.zeros((0,) * int(c[1]), c[0] + "8") for c in codes.split()]


_CLOSED = Closed(*_values("f2 f3 f2 f2 f2 i1"))
_F2, _FIRST_ORDER = np.zeros((0, 0)), FirstOrder(*_values("f3 f3 f2 f2 f2"))
_PASSES = (
    P.Plan._make([*(np.zeros(0, record) for record in _PLAN_RECORDS), 0.0]),
    np.zeros((0, 4, 4)),
    P.Seeds(*_values("f3 f3 f2")),
    P.Settings(*_values("f i i i i f")),
    P.PassResults(*_values("f3 f3 f2 f1 i1 i1")),
)

_POSE_OBJECTIVE = PoseObjective(*_values("f3 f1 i f f i"))
_CHAINS = ChainAim(_POSE_OBJECTIVE, *_values("f2 f3 i i i f f")), ChainAnswers(*_values("f2 f3 f1 f1 i1"))
_ANSWERS = tuple(_values("i f3 f3 f2 i1 f3 f2 f2"))

KERNELS: tuple[tuple[Any, tuple[Any, ...]], ...] = (
    (answer_blocks, _ANSWERS),
    (answer, _ANSWERS),
    (close, (*_values("i i i"), ClosureProblem(*_values("f1 i f3 i f i i f i")), _CLOSED)),
    (solve_by_passes, _PASSES),
    (solve_by_half_spaces, _PASSES),
    (move_trunks, (_PASSES[0], *_values("f3 f2"), _PASSES[3], 0.0)),
    (nearest_configuration, (*_values("i i"), Objective(_POSE_OBJECTIVE, *_values("f1 f2")), _CLOSED, _F2)),
    (evaluate_poses, tuple(_values("i i f3 f2 f2 f2 f2 f3"))),
    (jacobians, tuple(_values("i f3 i f3"))),
    (first_order, (*_values("i i"), PLAN, _F2, _FIRST_ORDER)),
    (feasibility, tuple(_values("i f3 f3 f2 f1 i1"))),
    (answer_in_any_mode, _ANSWERS),
    (nearest_pose, tuple(_values("i i i f3 f2 f3 f2 f2 f1 f3 f2 f2 i2 f2 f2 i1 f2"))),
    (assemble, tuple(_values("i i f2 i i i1 f2 f3 f2 f2 f2"))),
    (margins_in_blocks, tuple(_values("i f3 f3 f2 i f1 i1"))),
    (walk_chains, (*_values("i i"), _CHAINS[1], np.zeros((0, 0, 0)))),
    (reach_in_chains, (*_values("i i"), *_CHAINS)),
    (nearest_in_chains, (*_values("i i"), *_CHAINS)),
    (number_points, (*_values("i1 i1 i1 i"), True, *_values("i1"))),
    (join, tuple(_values("i2 i1"))),
    (walk_path, tuple(_values("f2 f1 f2 f3 f3"))),
    (second_derivatives, tuple(_values("f1 f2 f2"))),
    (fastest, (*_values("f1 f2 f2 f1 f1"), True, np.zeros(0))),
)
"""Every kernel with arguments of its types, the most used first."""


def compile_all(report: Callable[[str, float], None] | None = None) -> None:
    """Compile every kernel that is not in the cache yet, or load it.

    Parameters
    ----------
    report : called after each kernel with its name and the seconds taken.
    """
    if _config.DISABLE_JIT:
        return
    for kernel, arguments in KERNELS:
        began = time.perf_counter()
        kernel.compile(tuple(_typeof(argument) for argument in arguments))
        if report is not None:
            report(name_of(kernel.py_func), time.perf_counter() - began)
