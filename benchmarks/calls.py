"""One question at a time from Python, kernels loaded: `python benchmarks/calls.py`, and the first rows of `run.py`."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

import pfabrik as pf
from closed_forms import Array, Struts
from pfabrik.engines.joints.closure_engine import ClosureEngine
from pfabrik.machine.description.geometry import geometry_of
from pfabrik.machine.model import Model, model_of
from pfabrik.machine.motion.displacements import rate_units
from pfabrik.machine.motion.loops import actuated_columns, right_singular
from pfabrik.machine.motion.loops import first_order as conditions_and_twist
from pfabrik.machine.motion.mobility import generic_of
from table import Row, cells, machine, table
from timing import best_times, draw
from yardstick import one_core

CALLS = 200


def each(question: Callable[..., object], *asked: object) -> Callable[[], object]:
    """A question asked of one after the other."""
    return lambda: [question(one) for one in asked]


def strut_jacobian(struts: Struts, pose: Array) -> Array:
    """Rates of strut lengths by the platform's twist, (k, 6), in plain NumPy."""
    arms = struts.tops @ pose[:3, :3].T
    lines = arms + (pose[:3, 3] - struts.feet)
    units = lines / np.sqrt((lines * lines).sum(axis=1))[:, None]
    return np.hstack([units, np.cross(arms, units)])


def near(mechanism: pf.Mechanism, rng: np.random.Generator) -> list[Array]:
    """Targets that are reached, one by one: poses at actuator values up to 0.1 L or 0.1 rad from home's."""
    home = pf.solve_ik(mechanism, mechanism.home_pose).actuators
    units = rate_units(mechanism)[actuated_columns(mechanism)]
    drawn = pf.solve_fk(mechanism, home + rng.uniform(-0.1, 0.1, (2 * CALLS, len(home))) * units)
    return list(drawn.pose[drawn.status == pf.Status.REACHED][:CALLS])


def questions(name: str, what: str, rng: np.random.Generator, runs: int) -> Iterator[Row]:
    """Inverse and forward kinematics of a machine of legs, next to the closure engine on the same call."""
    mechanism = pf.load(name)
    targets, solver, engine = near(mechanism, rng), pf.Solver(mechanism), ClosureEngine(model_of(mechanism))
    values = [pf.solve_ik(mechanism, target).actuators for target in targets]

    def closed(target: Array) -> object:
        return engine.answer(target[None], None, pf.Options(), keep_mode=False)

    def assembled(value: Array) -> object:
        return engine.forward(value[None], None, 1e-9)

    n, slow = len(targets), slice(0, 20)
    ik, prepared, fk, prepared_fk, by_closure, fk_by_closure = best_times(
        runs,
        each(partial(pf.solve_ik, mechanism), *targets),
        each(solver.ik, *targets),
        each(partial(pf.solve_fk, mechanism), *values),
        each(solver.fk, *values),
        each(closed, *targets[slow]),
        each(assembled, *values[slow]),
    )
    few = len(targets[slow])
    yield Row(f"{what}, one solve_ik, reachable", n, ik / n, "closure engine", by_closure / few)
    yield Row(f"{what}, Solver.ik, reachable", n, prepared / n, "one solve_ik", ik / n)
    yield Row(f"{what}, one solve_fk, from home", n, fk / n, "closure engine", fk_by_closure / few)
    yield Row(f"{what}, Solver.fk, from home", n, prepared_fk / n, "one solve_fk", fk / n)


def out_of_reach(name: str, what: str, rng: np.random.Generator, runs: int) -> Iterator[Row]:
    """One projection at a time."""
    mechanism = pf.load(name)
    drawn = draw(mechanism, rng, 4 * CALLS, 1.0, 0.5)
    far = drawn[pf.solve_ik(mechanism, drawn).status == pf.Status.PROJECTED][: CALLS // 2]
    with one_core():
        one, batch = best_times(runs, each(partial(pf.solve_ik, mechanism), *far), partial(pf.solve_ik, mechanism, far))
    yield Row(f"{what}, one solve_ik, out of reach", len(far), one / len(far), "a pose of a batch", batch / len(far))


def streams(name: str, what: str, runs: int) -> Iterator[Row]:
    """Ticks along a stream that leaves reach by far and comes back, next to as many answers of `Solver.ik` at home."""
    mechanism, turn = pf.load(name), np.arange(CALLS) / CALLS * 2.0 * np.pi
    shift = 0.9 * np.stack([np.sin(turn), np.sin(2 * turn + 0.4), np.sin(3 * turn + 1.0)], axis=1)
    turned = 0.7 * np.stack([np.sin(2 * turn), np.sin(turn + 0.7), np.sin(3 * turn)], axis=1)
    targets = pf.pose(mechanism.home_pose[:3, 3] + shift * mechanism.characteristic_length, rotvec=turned)
    solver, home = pf.Solver(mechanism), mechanism.home_pose.copy()
    speed = np.ptp(np.asarray(pf.track(mechanism, targets).actuators), axis=0).max() / 50.0
    live = pf.Live(mechanism, speed=float(speed))

    def along(*targets: Array) -> None:
        for target in targets:
            live.tick(target, 1.0)

    ticks, rests, answers = best_times(
        runs, partial(along, *targets), partial(along, *([home] * CALLS)), each(solver.ik, *([home] * CALLS))
    )
    yield Row(f"{what}, Live.tick, out of reach and back", CALLS, ticks / CALLS, "Solver.ik at home", answers / CALLS)
    yield Row(f"{what}, Live.tick, on a target that rests", CALLS, rests / CALLS, "Solver.ik at home", answers / CALLS)


def singular_vectors(mechanism: pf.Mechanism, q: Array) -> None:
    """Those of the loops' conditions, and of what the motions do that these allow."""
    closure, twist = conditions_and_twist(mechanism, q)
    motions = right_singular(closure)[1][0, generic_of(mechanism).rank :].T
    np.linalg.svd(np.concatenate([twist[0] @ motions, motions[actuated_columns(mechanism)]]))


def first_order(rng: np.random.Generator, runs: int) -> Iterator[Row]:
    """Jacobians, singularity and margins of new answers of the 6-UPS."""
    mechanism = pf.load("stewart")
    struts, targets = Struts(mechanism), near(mechanism, rng)[:20]
    answer = pf.solve_ik(mechanism, targets[0])
    pose, q = answer.pose, answer._coordinates
    inverse, near_singular, margins, lines, by_numpy = best_times(
        runs,
        lambda: [pf.inverse_jacobian(pf.solve_ik(mechanism, target)) for target in targets],
        lambda: [pf.singularity(pf.solve_ik(mechanism, target)) for target in targets],
        lambda: [pf.margins(pf.solve_ik(mechanism, target)) for target in targets],
        lambda: [strut_jacobian(struts, pose) for _ in range(20)],
        lambda: [singular_vectors(mechanism, q) for _ in range(20)],
    )
    yield Row("6-UPS, one solve_ik and inverse_jacobian", 20, inverse / 20, "NumPy, lines of the struts", lines / 20)
    yield Row(
        "6-UPS, one solve_ik and singularity", 20, near_singular / 20, "NumPy, all singular vectors", by_numpy / 20
    )
    yield Row("6-UPS, one solve_ik and margins", 20, margins / 20)


def other_geometries(name: str, what: str, rng: np.random.Generator, runs: int) -> Iterator[Row]:
    """Another geometry, its table of legs, and its first answer; next to the same machine made anew."""
    mechanism = pf.load(name)
    model, points, target = model_of(mechanism), geometry_of(mechanism).points, mechanism.home_pose.copy()
    moved = [points + offset for offset in rng.normal(size=(20, 3)) * 1e-3 * mechanism.characteristic_length]
    made = [model.with_geometry(points=each).mechanism for each in moved]

    def anew(like: pf.Mechanism) -> object:
        return Model(dataclasses.replace(like)).legs

    def first(other: Array) -> object:
        return pf.solve_ik(model.with_geometry(points=other).mechanism, target)

    records, answers, machines = best_times(
        10 * runs,
        each(lambda other: model.with_geometry(points=other).legs, *moved),
        each(first, *moved),
        each(anew, *made),
    )
    n, baseline = len(moved), "the mechanism made anew, and its table"
    yield Row(f"{what}, leg table of another geometry", n, records / n, baseline, machines / n)
    yield Row(f"{what}, another geometry and its first solve_ik", n, answers / n, baseline, machines / n)


def calls(rng: np.random.Generator, runs: int) -> Iterator[Row]:
    mechanism = pf.load("stewart")
    struts, targets = Struts(mechanism), near(mechanism, rng)
    ours, theirs = best_times(runs, each(partial(pf.solve_ik, mechanism), *targets), each(struts.one, *targets))
    n, baseline = len(targets), "NumPy, lengths and strokes of one pose"
    yield Row("6-UPS, one call, reachable", n, ours / n, baseline, theirs / n)
    for name, what in (("stewart", "6-UPS"), ("delta", "delta"), ("rps", "3-RPS"), ("serial_arm", "serial arm")):
        yield from questions(name, what, rng, runs)
        yield from out_of_reach(name, what, rng, min(runs, 5))
    for name, what in (("stewart", "6-UPS"), ("delta", "delta"), ("g1_ankle", "humanoid ankle"), ("panda", "Panda")):
        yield from streams(name, what, runs)
    yield from first_order(rng, runs)
    for name, what in (("stewart", "6-UPS"), ("servo_hexapod", "6-RUS"), ("delta", "delta"), ("nrpm", "NRPM")):
        yield from other_geometries(name, what, rng, runs)


if __name__ == "__main__":
    print(machine(), end="\n\n")
    print("\n".join(table([cells(row) for row in calls(np.random.default_rng(1), 9)], False)))
