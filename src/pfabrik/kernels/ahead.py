"""Every kernel, with the types of its arguments."""

from __future__ import annotations

from typing import Any

import numpy as np

from .certify.prove import prove
from .chains.answer_chains import answer_chains, walk_chains
from .clearance.capsules import capsule_clearance, place_ends
from .clearance.least_clearance import least_clearance
from .dynamics.effort_at_pose import effort_at_pose
from .dynamics.inverse_dynamics import inverse_dynamics
from .dynamics.moving import Exerted
from .dynamics.signs import signs_of
from .home import measure_home
from .joints.answer_joints import answer_joints, note_near
from .joints.close import close
from .joints.descend import nearest_configuration
from .joints.first_order import rates
from .joints.joint_tables import Answered
from .joints.live_joints import place_joints, tick_joints
from .joints.loops import Closed, ClosureProblem, FirstOrder, FirstOrderPlan, Objective, PoseObjective
from .lattice import join, number_points
from .legs.answer import answer
from .legs.blocks import answer_blocks
from .legs.complete_poses import are_poses
from .legs.margin_blocks import margins_in_blocks
from .legs.margin_rows import feasibility, read_targets
from .noted_steps import evaluate
from .passes import plan as P
from .passes.solve import solve_by_passes
from .pose.answer_rows import answer_rows, mark_near
from .pose.evaluate import evaluate_poses, jacobians
from .pose.forward import assemble
from .pose.forward_blocks import assemble_in_blocks
from .pose.live_pose import place_pose, tick_pose
from .pose.nearest import nearest_pose
from .pose.search_records import PoseSolutions, Starts
from .pose.tables import Start
from .rows import Rows
from .timing import acceleration_shares, fastest, second_derivatives, speed_shares, spline_at
from .walk_path import walk_path

_PLAN_RECORDS = (P.NODE, P.BRANCH, P.CHAIN, P.CONE, P.TRUNK_SPAN, P.TRUNK_JOINT)


def _read(array: Any) -> Any:
    """An array that kernels only read: they take read-only ones in its place."""
    array.setflags(write=False)
    return array


def _value(code: str) -> Any:
    """A value of the type of a code: i, f or b for a number, with dimensions for an array, I or F for one only read."""
    if len(code) == 1:
        return {"i": 0, "f": 0.0, "b": True}[code]
    array = np.zeros((0,) * int(code[1]), f"{code[0].lower()}8")
    return _read(array) if code[0].isupper() else array


def _values(codes: str) -> list[Any]:
    return [_value(code) for code in codes.split()]


_CLOSED = Closed(*_values("f2 f3 f2 f2 f2 i1"))
_FIRST_ORDER = FirstOrder(*_values("f3 f3 f2 f2 f2 f3 f3 f2 f3 f3"))
_FIRST_ORDER_PLAN = FirstOrderPlan(*_values("F2 F1 F2 I1 F2 i i i f f i"))
_PASSES = (
    P.Plan._make([*(_read(np.zeros(0, record)) for record in _PLAN_RECORDS), 0.0, 0]),
    *_values("F3"),
    P.Seeds(*_values("F3 F3 F2")),
    P.Settings(*_values("f i i i i f i")),
    P.PassResults(*_values("f3 f3 f2 f1 i1 i1")),
)

_SOLUTIONS = PoseSolutions(*_values("f1 f3 f2 f2 i2 f2 f2 i1"))
_ENDS = Starts(*_values("f3 f2 f2"))
_POSE_OBJECTIVE = PoseObjective(*_values("F3 F1 i i f f f f i"))

KERNELS: tuple[tuple[Any, tuple[Any, ...]], ...] = (
    (answer_blocks, tuple(_values("i F3 F3 F2 i1 f3 f2 f2"))),
    (answer, tuple(_values("i F3 F3 f2 i1 f3 f2 f2"))),
    (close, (*_values("i i i"), ClosureProblem(*_values("F1 i F3 i f i i i i f i")), _CLOSED)),
    (answer_joints, (*_values("i i i F3 F2"), Answered(*_values("f2 i2 f3 f2 f2")), *_values("i1"))),
    (note_near, tuple(_values("i i F2 i1"))),
    (solve_by_passes, _PASSES),
    (mark_near, tuple(_values("i i F3 F2 i1"))),
    (nearest_configuration, (*_values("i i"), Objective(_POSE_OBJECTIVE, *_values("F1 F2")), _CLOSED, *_values("f2"))),
    (evaluate_poses, tuple(_values("i i F3 F2 F2 f2 f2 f3"))),
    (jacobians, tuple(_values("i F3 i f3"))),
    (rates, (*_values("i i"), _FIRST_ORDER_PLAN, *_values("F2"), _FIRST_ORDER)),
    (feasibility, tuple(_values("i F3 F3 F2 f1 i1 f2"))),
    (read_targets, tuple(_values("i F3 F3 f2"))),
    (are_poses, tuple(_values("F3 i1"))),
    (inverse_dynamics, (*_values("i i F2 F3 F2 F2 F2"), Exerted(*_values("f2 f2 f2 f2 i1 f3 f2 f3 f3 f2 f3")))),
    (effort_at_pose, tuple(_values("i i i i i"))),
    (signs_of, tuple(_values("F2 f2"))),
    (answer_rows, (*_values("i i i F3"), Start(*_values("F3 F2 F2")), _SOLUTIONS)),
    (nearest_pose, (*_values("i i i F3 F2"), Starts(*_values("F3 F2 F2")), _SOLUTIONS, *_values("f2"))),
    (tick_joints, tuple(_values("i i f"))),
    (place_joints, tuple(_values("i i"))),
    (tick_pose, tuple(_values("i i f"))),
    (place_pose, tuple(_values("i i"))),
    (assemble, (*_values("i i F2 i b i1 f2"), _ENDS, *_values("f2"))),
    (assemble_in_blocks, (*_values("i I1 F2 i i1 f2"), _ENDS, *_values("f2"))),
    (margins_in_blocks, tuple(_values("i F3 F3 F2 i f1 i1"))),
    (walk_chains, tuple(_values("i i F2 f3 f1 f3"))),
    (answer_chains, (*_values("i i i b F3 F2 f2"), Rows(*_values("i1 i2 f3 f2 f2")))),
    (measure_home, tuple(_values("f1 i f1 i1"))),
    (evaluate, tuple(_values("I2 I2 I2 i F1 F2 F2 f2 f3"))),
    (number_points, tuple(_values("I1 i1 i1 i b i1"))),
    (join, tuple(_values("I2 i1"))),
    (place_ends, tuple(_values("F3 I2 F3 f3"))),
    (capsule_clearance, tuple(_values("F1 F3 I2 f1 f1"))),
    (least_clearance, tuple(_values("F2 F4 I2 i f1 i1 f3"))),
    (prove, tuple(_values("i i"))),
    (walk_path, tuple(_values("F2 F1 F2 f3 f3"))),
    (second_derivatives, tuple(_values("F1 F2 f2"))),
    (spline_at, tuple(_values("F1 F2 F2 F1 i f2"))),
    (speed_shares, tuple(_values("F1 F2 F2 F1 f f1"))),
    (acceleration_shares, tuple(_values("F1 F1 F2 F2 F1 f1"))),
    (fastest, tuple(_values("F1 F2 F2 F2 F2 F1 b f1"))),
)
"""Every kernel with arguments of its types, the most used first; arrays that it only reads are read-only."""
