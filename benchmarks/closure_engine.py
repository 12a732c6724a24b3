"""What the closure engine costs: forward kinematics, joint coordinates, assembly modes, chains beyond positions."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import partial

import numpy as np

import pfabrik as pf
from closed_forms import Array, Struts
from newton import StrutNewton
from pfabrik.engines.joints.closure_engine import ClosureEngine
from pfabrik.machine.model import model_of
from table import Row
from timing import best_times, draw
from yardstick import one_core

DIETMAIER_FEET = np.array(
    [
        [0.0, 0.0, 0.0],
        [1.107915, 0.0, 0.0],
        [0.549094, 0.756063, 0.0],
        [0.735077, -0.223935, 0.525991],
        [0.514188, -0.526063, -0.368418],
        [0.590473, 0.094733, -0.205018],
    ]
)
DIETMAIER_TOPS = np.array(
    [
        [0.0, 0.0, 0.0],
        [0.542805, 0.0, 0.0],
        [0.956919, -0.528915, 0.0],
        [0.665885, -0.353482, 1.402538],
        [0.478359, 1.158742, 0.107672],
        [-0.137087, -0.235121, 0.353913],
    ]
)
DIETMAIER_LENGTHS = np.array([1.0, 0.645275, 1.086284, 1.503439, 1.281933, 0.771071])
"""P. Dietmaier, The Stewart-Gough platform of general geometry can have 40 real postures, 1998."""


def forward(rng: np.random.Generator, runs: int, n: int) -> Iterator[Row]:
    """Strut lengths to poses: one call, batches from home and from seeds, next to Newton's method on the lengths."""
    mechanism = pf.load("stewart")
    struts, newton = Struts(mechanism), hexapod_newton(mechanism)
    drawn = draw(mechanism, rng, 4 * n, 0.2, 0.2)
    targets = drawn[struts.solve(drawn)[1]][:n]
    values, seeds = struts.lengths(targets), beside(mechanism, targets, rng)
    from_home, from_seeds = (
        partial(pf.solve_fk, mechanism, values),
        partial(pf.solve_fk, mechanism, values, start=seeds),
    )
    for found in (from_home(), from_seeds()):
        same_poses(found, targets)
    few = list(values[:100])
    one, theirs_one = best_times(
        runs,
        lambda: [pf.solve_fk(mechanism, each) for each in few],
        lambda: [newton.solve(each[None], mechanism.home_pose) for each in few],
    )
    yield Row("6-UPS, FK, one call, from home", len(few), one / len(few), "NumPy Newton", theirs_one / len(few))
    with one_core():
        home, theirs_home, seeded, theirs_seeded = best_times(
            runs,
            from_home,
            partial(newton.solve, values, mechanism.home_pose),
            from_seeds,
            partial(newton.solve, values, seeds.pose),
        )
    yield Row("6-UPS, FK, batch, from home, one core", n, home / n, "NumPy Newton", theirs_home / n)
    yield Row("6-UPS, FK, batch, seeded, one core", n, seeded / n, "NumPy Newton", theirs_seeded / n)
    apart = rng.uniform(struts.low, struts.high, (n // 20, 6))
    apart = apart[pf.solve_fk(mechanism, apart).status == pf.Status.PROJECTED]
    with one_core():
        projected, reached = best_times(min(runs, 3), partial(pf.solve_fk, mechanism, apart), from_home)
    what = "6-UPS, FK, batch, lengths that do not fit, one core"
    yield Row(what, len(apart), projected / len(apart), "FK, from home", reached / n)
    for name, what in (("five_bar", "5-bar"), ("nrpm", "NRPM")):
        yield forward_alone(pf.load(name), what, rng, runs, n)


def forward_alone(mechanism: pf.Mechanism, what: str, rng: np.random.Generator, runs: int, n: int) -> Row:
    """A batch from seeds, next to the inverse kinematics of the same poses."""
    targets = draw(mechanism, rng, 4 * n, 0.1, 0.1)
    there = pf.solve_ik(mechanism, targets)
    there = there[np.flatnonzero(there.status == pf.Status.REACHED)[:n]]
    seeds = beside(mechanism, there.pose, rng, seed=there)
    same_poses(pf.solve_fk(mechanism, there.actuators, start=seeds), there.pose)
    with one_core():
        ours, inverse = best_times(
            runs,
            lambda: pf.solve_fk(mechanism, there.actuators, start=seeds),
            lambda: pf.solve_ik(mechanism, there.pose),
        )
    return Row(f"{what}, FK, batch, seeded, one core", n, ours / n, "its inverse kinematics", inverse / n)


def hexapod_newton(mechanism: pf.Mechanism) -> StrutNewton:
    """The baseline for a catalogue hexapod, whose frame is at the reference point with home's orientation."""
    struts = Struts(mechanism)
    return StrutNewton(struts.feet, struts.tops)


def beside(
    mechanism: pf.Mechanism, targets: Array, rng: np.random.Generator, seed: pf.Solution | None = None
) -> pf.Solution:
    """Answers next to targets (n, 4, 4), with their joint coordinates worked out: where a control loop was before."""
    moves = draw(mechanism, rng, len(targets), 0.01, 0.01)
    start = targets.copy()
    start[:, :3, 3] += moves[:, :3, 3] - mechanism.reference_point
    start[:, :3, :3] = moves[:, :3, :3] @ start[:, :3, :3]
    found = pf.solve_ik(mechanism, start, start=seed)
    assert found.joints
    return found


def same_poses(found: pf.Solution, targets: Array) -> None:
    """Stop where forward kinematics gives other poses: the comparison would mean nothing."""
    apart = np.abs(found.pose - targets).max()
    if not found or apart > 1e-6 * found.mechanism.characteristic_length:
        sys.exit(f"forward kinematics strays by {apart:.1e}: {found!r}")


def joint_coordinates(rng: np.random.Generator, runs: int, n: int) -> Iterator[Row]:
    """All joints of answers in positions, next to those answers."""
    for name, what in (("stewart", "6-UPS"), ("five_bar", "5-bar"), ("nrpm", "NRPM")):
        mechanism = pf.load(name)
        drawn = draw(mechanism, rng, 4 * n, 0.2, 0.2)
        targets = drawn[pf.solve_ik(mechanism, drawn).status == pf.Status.REACHED][:n]
        solve = partial(pf.solve_ik, mechanism, targets)
        with one_core():
            ours, theirs = best_times(runs, partial(with_joints, mechanism, targets), solve)
        yield Row(f"{what}, batch, reachable, with joints, one core", n, ours / n, "without joints", theirs / n)


def with_joints(mechanism: pf.Mechanism, targets: Array) -> object:
    """Answers, and the coordinates of all their joints."""
    return pf.solve_ik(mechanism, targets).joints


def closed_chains(rng: np.random.Generator, runs: int, n: int) -> Iterator[Row]:
    """The 6-UPS answered by the closure engine, next to its legs in closed form."""
    mechanism = pf.load("stewart")
    engine = ClosureEngine(model_of(mechanism))
    drawn = draw(mechanism, rng, 8 * n, 0.2, 0.2)
    reached = Struts(mechanism).solve(drawn)[1]
    far = draw(mechanism, rng, 8 * n, 1.0, 0.5)
    far = far[~Struts(mechanism).solve(far)[1]][: n // 10]
    for what, targets in (("reachable", drawn[reached][:n]), ("out of reach", far)):
        solve = partial(engine.answer, targets, None, pf.Options(), keep_mode=False)
        by_legs = partial(pf.solve_ik, mechanism, targets)
        if not np.array_equal(solve().rows.status, by_legs().status):
            sys.exit("the engines disagree on what can be reached")
        with one_core():
            ours, theirs = best_times(min(runs, 5), solve, by_legs)
        k = len(targets)
        yield Row(f"6-UPS by the closure engine, batch, {what}, one core", k, ours / k, "by legs", theirs / k)


def modes(runs: int) -> Iterator[Row]:
    """All modes of a platform with 40, next to Newton's method on the lengths from as many random starts."""
    mechanism, newton = dietmaier(), StrutNewton(DIETMAIER_FEET, DIETMAIER_TOPS)
    found = pf.assembly_modes(mechanism, DIETMAIER_LENGTHS)
    theirs = newton.modes(DIETMAIER_LENGTHS, found.starts, np.random.default_rng(0))
    with one_core():
        ours, plain = best_times(
            runs,
            lambda: pf.assembly_modes(mechanism, DIETMAIER_LENGTHS),
            lambda: newton.modes(DIETMAIER_LENGTHS, found.starts, np.random.default_rng(0)),
        )
    what = f"all {len(found)} assembly modes, {found.starts} starts, one core"
    yield Row(what, 1, ours, f"NumPy Newton, as many starts, {len(theirs)} modes", plain)


def dietmaier() -> pf.Mechanism:
    """A hexapod with the published joints, at home in no particular pose."""
    home = np.array([0.3, 0.2, 1.0])
    joints = []
    for k, (foot, top) in enumerate(zip(DIETMAIER_FEET, DIETMAIER_TOPS + home, strict=True), start=1):
        joints += [
            pf.Joint(f"A{k}", "universal", ("base", f"cylinder{k}"), at=foot),
            pf.Joint(f"B{k}", "prismatic", (f"cylinder{k}", f"rod{k}"), along=(f"A{k}", f"C{k}"), actuated=True),
            pf.Joint(f"C{k}", "spherical", (f"rod{k}", "platform"), at=top),
        ]
    return pf.Mechanism("platform with 40 modes", joints, "platform", tuple(home))
