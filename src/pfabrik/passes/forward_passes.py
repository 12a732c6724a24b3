"""Forward kinematics by passes, which the paper leaves to future work: actuators are locked, the platform follows."""

from __future__ import annotations

import numpy as np

from ..answers.solution import Solution
from ..answers.start_configuration import Start, start_of
from ..common.arrays import Floats
from ..common.batch import take
from ..engines.engine import engine_of
from ..engines.joints.close import measure_configurations
from ..engines.joints.closure_engine import start_coordinates
from ..errors import UnsupportedMechanism
from ..fk import HORIZON, Actuators, as_values, count_clipped, finite_rows
from ..kernels.passes import plan as P
from ..kernels.rows import ITERATIONS, REACHED, ROUNDS
from ..machine.description.mechanism import Mechanism, checked_mechanism
from ..machine.model import model_of
from ..options import options_or
from ..tolerances import TOLERANCES
from .joint_positions import new_pass_results, place, positions_of
from .pass_options import PAPER, PassOptions
from .passes_engine import BY_FALLBACK
from .plan import CompiledPlan, compile_plan

MOST_PASSES = 10_000
"""Passes after which values count as those of no assembly: of 600 that assemble none took half as many."""


def solve_fk(
    mechanism: Mechanism, actuators: Actuators, options: PassOptions | None = None, *, start: Start | None = None
) -> Solution:
    """The pose of the end effector at given actuator values, by passes; ours, for the paper leaves it to future work.

    With its actuators locked, the end of a strut keeps its distance from the base, the end of a rod its distance from a
    crank or carriage. A pass puts each end at the nearest such place to where the platform has it (a pass inward and
    outward), then moves the platform to the ends: their centroid, and a step of the turn that fits best. Limits are
    left out. From the pose where all ends are within E, Newton's method closes the loops exactly.

    Parameters
    ----------
    mechanism : Mechanism
        The machine: its legs struts, or cranks or carriages with rods (`decompose`).
    actuators : array (..., n_a) or mapping of str to array
        Values as in `pfabrik.solve_fk`.
    options : Options, optional
        Of these E, `max_iterations` times `max_rounds`, the most passes (10,000 at most), `actuator_tolerance` and
        `on_invalid` count. Default `Options.paper()`.
    start : Solution or array (..., nq), optional
        Start as in `pfabrik.solve_fk`.

    Returns
    -------
    Solution
        As of `pfabrik.solve_fk`; `iterations` are passes. Where passes do not end within E, or do so beyond a limit,
        Newton's method answers from the start, and `rounds` is -1 (`by_fallback`).

    Raises
    ------
    UnsupportedMechanism
        Joint positions do not express the mechanism.
    """
    options = options_or(PAPER, options).of(checked_mechanism(mechanism))
    compiled, model = compile_plan(mechanism), model_of(mechanism)
    ends = [drive.name for drive, lock in zip(mechanism.drives, compiled.locks, strict=True) if lock.what == "end"]
    if ends:
        raise UnsupportedMechanism(mechanism.name, tuple(f"actuator {name} turns the platform itself" for name in ends))
    values, shape = as_values(mechanism, actuators)
    is_valid, begin, engine = (
        finite_rows(values, shape, options),
        start_of(mechanism, start, shape),
        engine_of(mechanism),
    )
    valid = np.flatnonzero(is_valid)
    starts, locked = (
        begin if begin is None or len(begin) == 1 else begin.at(valid),
        values[valid].clip(-HORIZON, HORIZON),
    )
    coordinates = np.broadcast_to(
        start_coordinates(model, starts), (len(valid), start_coordinates(model, None).shape[1])
    )
    near = float(options.tolerance or TOLERANCES.position * model.length)
    most = min(options.max_iterations * options.max_rounds, MOST_PASSES)
    results = _follow(mechanism, compiled, locked, coordinates, near, most)
    placed = place(model.path_closure, compiled, coordinates.copy(), results)
    found = engine.as_configurations(measure_configurations(model, placed.coordinates))
    solutions = engine.forward(locked, found, options.actuator_tolerance)
    solutions.rows.counters[:, ITERATIONS], solutions.rows.counters[:, ROUNDS] = results.iterations, 0
    missed = np.flatnonzero((results.gaps > near) | (solutions.rows.status != REACHED))
    if len(missed):
        at = starts if starts is None or len(starts) == 1 else starts.at(missed)
        solutions = solutions.with_rows(missed, engine.forward(locked[missed], at, options.actuator_tolerance))
        solutions.rows.counters[missed, ROUNDS] = BY_FALLBACK
    count_clipped(solutions, locked, values[valid])
    return Solution(mechanism, solutions.scatter(is_valid), shape, values=values.copy())


def _follow(
    mechanism: Mechanism, compiled: CompiledPlan, values: Floats, coordinates: Floats, near: float, most: int
) -> P.PassResults:
    """Passes at locked actuators (n, n_a) from joint coordinates (n, columns), until ends are `near`."""
    from ..kernels.passes.solve import solve_by_passes

    seeds, results = positions_of(mechanism, compiled, coordinates), new_pass_results(compiled, len(values))
    settings = P.Settings(
        tolerance=near,
        max_iterations=1,
        max_rounds=most,
        free=P.TRANSLATES if mechanism.end_effector_is_joint else P.TRANSLATES | P.TURNS,
        keep_mode=0,
        lever=0.0,
        is_accelerated=0,
    )
    for i, row in enumerate(values):
        block = slice(i, i + 1)
        plan = locked_plan(compiled, row)
        solve_by_passes(plan, seeds.poses[block].copy(), take(seeds, block), settings, take(results, block))
    return results


def locked_plan(compiled: CompiledPlan, values: Floats) -> P.Plan:
    """The plan with actuators at values (n_a,), and passive joints free."""
    plan = compiled.plan
    nodes, branches, joints = plan.nodes.copy(), plan.branches.copy(), plan.trunk_joints.copy()
    nodes["ranged"], branches["cone_last"] = 0, branches["cone_first"]
    is_stroke = nodes["lo"] < nodes["hi"]
    nodes["lo"][is_stroke], nodes["hi"][is_stroke] = 0.0, np.inf
    branches["rail_lo"], branches["rail_hi"] = -np.inf, np.inf
    joints["lo"], joints["hi"] = -np.inf, np.inf
    for (what, at, origin, sign), q in zip(compiled.locks, values.tolist(), strict=True):
        value = sign * (q - origin)
        if what == "stroke":
            nodes["lo"][at] = nodes["hi"][at] = max(value, 0.0)
        elif what == "hinge":
            nodes["angle_lo"][at] = nodes["angle_hi"][at] = value
            nodes["ranged"][at] = 1
        elif what == "rail":
            branches["rail_lo"][at] = branches["rail_hi"][at] = value
        else:
            joints["lo"][at] = joints["hi"][at] = value
    return plan._replace(nodes=nodes, branches=branches, trunk_joints=joints)
