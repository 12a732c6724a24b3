"""Passes next to the default: the kernels alone, one target after another, and whole answers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

import pfabrik as pf
from closed_forms import Array
from pfabrik.engines.joints.projection import modes_of
from pfabrik.engines.pose.table import table_handle
from pfabrik.kernels.legs.answer import answer
from pfabrik.kernels.passes.solve import solve_by_passes
from pfabrik.machine.decomposition.leg_table import LegTable, leg_table
from pfabrik.machine.model import model_of
from pfabrik.passes.joint_positions import new_pass_results
from pfabrik.passes.passes_engine import settings_of
from pfabrik.passes.plan import compile_plan
from table import Row
from timing import Solve, best_times, draw
from yardstick import one_core

MACHINES = (("five_bar", "5-bar", 1.0), ("stewart", "6-UPS", 0.6), ("nrpm", "NRPM", 0.6))
"""Machines, and how far from home targets are drawn [L]."""

TURNED = 0.2
"""Most that targets are turned about each axis [rad]."""


def passes(rng: np.random.Generator, runs: int, n: int) -> Iterator[Row]:
    """Reachable targets, cold: kernels of either kind of passes, and whole answers, next to the default's."""
    paper, accelerated = pf.passes.Options.paper(), replace(pf.passes.Options.accelerated(), working_mode="any")
    for name, label, size in MACHINES:
        mechanism = pf.load(name)
        drawn = draw(mechanism, rng, 4 * n, size, TURNED)
        targets = drawn[pf.solve_ik(mechanism, drawn).status == pf.Status.REACHED][:n]
        count, what = len(targets), f"{label}, whole workspace, cold, one core"
        solves = [kernel_call(mechanism, targets, options) for options in (accelerated, paper)]
        solves += [partial(pf.passes.solve, mechanism, targets, accelerated), partial(pf.solve_ik, mechanism, targets)]
        alone = legs_alone(mechanism, targets)
        with one_core():
            fast, plain, whole, default, *legs = best_times(runs, *solves, *([alone] if alone else []))
        least, against = (legs[0], "legs' kernel, pose by pose") if legs else (default, "default batch")
        yield Row(f"{what}, kernel of accelerated passes", count, fast / count, against, least / count)
        yield Row(f"{what}, kernel of the paper's passes", count, plain / count, against, least / count)
        yield Row(f"{what}, accelerated batch, all measured", count, whole / count, "default batch", default / count)


def kernel_call(mechanism: pf.Mechanism, targets: Array, options: pf.passes.Options) -> Solve:
    """One call of the kernel of passes for all targets, from home."""
    compiled, model = compile_plan(mechanism), model_of(mechanism)
    settings = settings_of(model, options, modes_of(model.path_closure, options)[0])
    settings, results = settings._replace(max_rounds=0), new_pass_results(compiled, len(targets))
    return partial(solve_by_passes, compiled.plan, targets, compiled.home_seed, settings, results)


def legs_alone(mechanism: pf.Mechanism, targets: Array) -> Solve | None:
    """One call of the legs' kernel for all targets, pose by pose; None where redundant joints are searched for."""
    table = leg_table(mechanism)
    if not isinstance(table, LegTable) or len(table.implicit_joints):
        return None
    n, legs = len(targets), table_handle(table)
    home = mechanism.home_pose[None].copy()
    sides = np.repeat(table.home_sides, n, axis=0)
    outputs = np.zeros(n, np.int64), np.empty((n, 4, 4)), np.empty((n, len(mechanism.actuator_names))), np.empty((n, 5))
    return lambda: answer(legs.address, targets, home, sides, *outputs)
