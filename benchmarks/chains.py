"""Chains of n hinges with ranges, beside FABRIK, ikpy and PlaCo: `python benchmarks/chains.py [--targets N]`.

Targets are tips of smooth feasible configurations; every search starts at home, which is straight, but for seeds.
Times are of the processor, a target, the mean of a batch. "Reached" counts tips within 1e-6 of the chain's length with
every joint within its range, by the products of rotations in `tips`. FABRIK is the plain one, with ranges restricted
both ways, on positions, compiled; it has 100 passes for an error of 1e-4. Peers are in the table where they can be
imported (`pip install ikpy placo`, better into an environment of their own).
"""

from __future__ import annotations

import argparse
import importlib.util
import math
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import pfabrik as pf
from pfabrik.engines.chains.chain_engine import ChainEngine
from pfabrik.engines.chains.chain_tables import question_of
from pfabrik.engines.joints.closure_engine import ClosureEngine
from pfabrik.kernels.pose.tables import BY_LEGS
from pfabrik.machine.model import model_of
from table import Row, machine
from timing import best_times
from yardstick import kernel, routine

Array = NDArray[np.float64]
CASES = ((7, 60.0), (20, 30.0), (60, 15.0), (100, 10.0))
NEAR = 1e-6
PASSES, CLOSE_ENOUGH = 100, 1e-4
MOST_STEPS, STILL = 100, 1e-9


def chain(n: int, most: float, in_space: bool) -> pf.Mechanism:
    """Hinges along x, 1 apart, about z, or in space about z and y by turns; each turns by so much [rad]."""
    names = ["base", *(f"b{i}" for i in range(1, n)), "tip"]
    joints = [
        pf.Joint(
            f"j{i}",
            "revolute",
            (names[i], names[i + 1]),
            (i, 0, 0),
            (0, i % 2, 1 - i % 2) if in_space else (0, 0, 1),
            actuated=True,
            range=(-most, most),
        )
        for i in range(n)
    ]
    return pf.Mechanism("chain", joints, "tip", (n, 0, 0), task=("x", "y", "z") if in_space else ("x", "y"))


def smooth(rng: np.random.Generator, count: int, n: int, most: float, in_space: bool) -> Array:
    """Smooth angles (count, n) within their ranges: a few waves along the chain, for each direction of the axes."""
    s, q = np.linspace(0.0, 1.0, n), np.zeros((count, n))
    for first in range(2 if in_space else 1):
        for k in range(4):
            size, phase = rng.normal(size=(count, 1)), rng.uniform(0.0, 2.0 * np.pi, (count, 1))
            every = slice(first, None, 2 if in_space else 1)
            q[:, every] += 0.6 * size * np.cos(np.pi * k * s[every] + phase) / (1.0 + 0.5 * k)
    return np.clip(q, -1.0, 1.0) * most


def tips(q: Array, in_space: bool) -> Array:
    """Tips (count, 3) of chains of unit links, link by link."""
    R, tip = np.tile(np.eye(3), (len(q), 1, 1)), np.zeros((len(q), 3))
    for k in range(q.shape[1]):
        c, s = np.cos(q[:, k]), np.sin(q[:, k])
        turn = np.zeros((len(q), 3, 3))
        if in_space and k % 2:
            turn[:, 1, 1] = 1.0
            turn[:, 0, 0], turn[:, 0, 2], turn[:, 2, 0], turn[:, 2, 2] = c, s, -s, c
        else:
            turn[:, 2, 2] = 1.0
            turn[:, 0, 0], turn[:, 0, 1], turn[:, 1, 0], turn[:, 1, 1] = c, -s, s, c
        R = R @ turn
        tip = tip + R[:, :, 0]
    return tip


def share(q: Array, targets: Array, most: float, in_space: bool, near: float = NEAR) -> float:
    """How many of the targets, in per cent, are reached within the ranges."""
    away = np.linalg.norm(tips(q, in_space) - targets, axis=1)
    return 100.0 * float(np.mean((away <= near * q.shape[1]) & (np.abs(q).max(axis=1) <= most + 1e-9)))


@routine
def fabrik(q: Array, target: Array, most: float, passes: int, close_enough: float) -> int:
    """FABRIK in the plane, inward and outward with ranges, from angles and to angles (n,); the number of passes."""
    n = len(q)
    x, y = np.zeros(n + 1), np.zeros(n + 1)
    c_most, s_most, turned = math.cos(most), math.sin(most), 0.0
    for k in range(n):
        turned += q[k]
        x[k + 1], y[k + 1] = x[k] + math.cos(turned), y[k] + math.sin(turned)
    done = 0
    while done < passes and math.hypot(x[n] - target[0], y[n] - target[1]) > close_enough * n:
        done += 1
        x[n], y[n] = target[0], target[1]
        u, v = 0.0, 0.0
        for k in range(n - 1, -1, -1):
            a, b = x[k + 1] - x[k], y[k + 1] - y[k]
            size = 1.0 / math.sqrt(a * a + b * b + 1e-300)
            a, b = a * size, b * size
            if k < n - 1 and u * a + v * b < c_most:
                s = s_most if a * v - b * u > 0.0 else -s_most
                a, b = c_most * u + s * v, -s * u + c_most * v
            x[k], y[k], u, v = x[k + 1] - a, y[k + 1] - b, a, b
        u, v, x0, y0 = 1.0, 0.0, 0.0, 0.0
        x[0], y[0] = 0.0, 0.0
        for k in range(1, n + 1):
            a, b = x[k] - x0, y[k] - y0
            size = 1.0 / math.sqrt(a * a + b * b + 1e-300)
            a, b = a * size, b * size
            if u * a + v * b < c_most:
                s = s_most if u * b - v * a > 0.0 else -s_most
                a, b = c_most * u - s * v, s * u + c_most * v
            x0, y0 = x0 + a, y0 + b
            x[k], y[k], u, v = x0, y0, a, b
    before = 0.0
    for k in range(n):
        angle = math.atan2(y[k + 1] - y[k], x[k + 1] - x[k])
        q[k] = angle - before
        q[k] -= 2.0 * math.pi * math.floor((q[k] + math.pi) / (2.0 * math.pi))
        before = angle
    return done


@kernel
def fabrik_all(q: Array, targets: Array, most: float, passes: int, close_enough: float) -> int:
    """FABRIK for all rows; the passes of all."""
    done = 0
    for i in range(len(q)):
        done += fabrik(q[i], targets[i], most, passes, close_enough)
    return done


def timed(solve: Callable[[], Array], runs: int = 3) -> tuple[float, Array]:
    """Processor time [s], the least of several runs, and the result."""
    best, result = math.inf, np.zeros(0)
    for _ in range(runs):
        start = time.process_time()
        result = solve()
        best = min(best, time.process_time() - start)
    return best, result


def own(mechanism: pf.Mechanism, targets: Array, most: float, in_space: bool) -> Iterator[tuple[str, float, float]]:
    """The library, and its parts alone: name, share reached [%], and time a target [s]."""
    poses, n, count = pf.pose(targets), len(mechanism.joints), len(targets)
    engine, home = ChainEngine(model_of(mechanism)), np.zeros((count, n))
    closing = question_of(True, False, last=BY_LEGS, seeds=0)
    pf.solve_ik(mechanism, targets[:2])
    fabrik_all(home[:1].copy(), targets[:1], most, 1, 0.0)
    seconds, q = timed(lambda: pf.solve_ik(mechanism, targets).q)
    yield "pfabrik", share(q, targets, most, in_space), seconds / count
    seconds, q = timed(lambda: engine._run(closing, pf.Options(), poses, home)[1].coordinates)
    yield "closing alone, from home", share(q, targets, most, in_space), seconds / count
    if in_space:
        return
    begin = home.copy()
    start = time.process_time()
    fabrik_all(begin, targets, most, 1, 0.0)
    passed = time.process_time() - start
    seconds, q = timed(lambda: engine._run(closing, pf.Options(), poses, begin)[1].coordinates)
    yield "a pass from home, then closing", share(q, targets, most, in_space), (passed + seconds) / count

    def passes() -> Array:
        q = home.copy()
        fabrik_all(q, targets, most, PASSES, CLOSE_ENOUGH)
        return q

    seconds, q = timed(passes)
    yield f"FABRIK alone, to {CLOSE_ENOUGH:g}", share(q, targets, most, in_space, 1.1 * CLOSE_ENOUGH), seconds / count


def in_ikpy(n: int, most: float, targets: Array) -> Array:
    """Angles by ikpy, one target after the other, from home."""
    from ikpy.chain import Chain
    from ikpy.link import OriginLink, URDFLink

    links: list[Any] = [OriginLink()]
    for k in range(n):
        axis = [0, 1, 0] if k % 2 else [0, 0, 1]
        links.append(URDFLink(f"j{k}", [0 if k == 0 else 1, 0, 0], [0, 0, 0], rotation=axis, bounds=(-most, most)))
    links.append(URDFLink("tip", [1, 0, 0], [0, 0, 0], joint_type="fixed"))
    peer = Chain(links, active_links_mask=[False, *[True] * n, False])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return np.array([peer.inverse_kinematics(target)[1:-1] for target in targets])


class InPlaco:
    """The chain in PlaCo: a soft task of the tip's position, ranges kept by its QP."""

    def __init__(self, n: int, most: float) -> None:
        import placo

        inertia = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        parts = [f'<link name="b0">{inertia}</link>']
        for k in range(n):
            axis = "0 1 0" if k % 2 else "0 0 1"
            parts.append(
                f'<link name="b{k + 1}">{inertia}</link><joint name="j{k}" type="revolute"><parent link="b{k}"/>'
                f'<child link="b{k + 1}"/><origin xyz="{0 if k == 0 else 1} 0 0" rpy="0 0 0"/><axis xyz="{axis}"/>'
                f'<limit lower="{-most}" upper="{most}" effort="1" velocity="1e6"/></joint>'
            )
        parts.append(
            f'<link name="tip">{inertia}</link><joint name="end" type="fixed"><parent link="b{n}"/>'
            '<child link="tip"/><origin xyz="1 0 0" rpy="0 0 0"/></joint>'
        )
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "robot.urdf").write_text(f'<robot name="chain">{"".join(parts)}</robot>')
            self.robot: Any = placo.RobotWrapper(folder, placo.Flags.ignore_collisions)
        self.solver: Any = placo.KinematicsSolver(self.robot)
        self.solver.mask_fbase(True)
        self.solver.enable_joint_limits(True)
        self.solver.enable_velocity_limits(False)
        self.task: Any = self.solver.add_position_task("tip", np.zeros(3))
        self.task.configure("tip", "soft", 1.0)
        self.solver.add_regularization_task(1e-9)
        self.names = [f"j{k}" for k in range(n)]

    def solve(self, targets: Array) -> Array:
        """Angles, one target after the other, from home, or 1e-3 of a bend: a straight chain does not move."""
        found = []
        for target in targets:
            for k, name in enumerate(self.names):
                self.robot.set_joint(name, 1e-3 * (1 + k % 3))
            self.robot.update_kinematics()
            self.task.target_world = target
            before = np.inf
            for _ in range(MOST_STEPS):
                self.solver.solve(True)
                self.robot.update_kinematics()
                present = np.array([self.robot.get_joint(name) for name in self.names])
                if np.abs(present - before).max() < STILL:
                    break
                before = present
            found.append(present)
        return np.array(found)


def peers(n: int, most: float, targets: Array) -> Iterator[tuple[str, float, float]]:
    """What other programs take, in space: name, share reached [%], and time a target [s]."""
    if importlib.util.find_spec("placo"):
        peer = InPlaco(n, most)
        seconds, q = timed(lambda: peer.solve(targets), 1)
        yield "PlaCo, one by one", share(q, targets, most, True), seconds / len(targets)
    if importlib.util.find_spec("ikpy"):
        few = targets[: max(3, 200 // n)]
        seconds, q = timed(lambda: in_ikpy(n, most, few), 1)
        yield "ikpy, one by one", share(q, few, most, True), seconds / len(few)


def chain_rows(rng: np.random.Generator, runs: int, n: int) -> Iterator[Row]:
    """Rows of the table of all benchmarks: batches within reach and beyond, next to the engine in joint coordinates."""
    flat, deep = (chain(100, math.radians(10.0), in_space) for in_space in (False, True))
    for what, mechanism in (
        ("arm of 7 joints, pose", pf.load("panda")),
        ("snake of 60 joints, pose", pf.load("snake60")),
        ("100 hinges in a plane", flat),
        ("100 hinges in space", deep),
    ):
        low, high = np.transpose([mechanism.joint(name).range for name in mechanism.actuator_names])
        bends = smooth(rng, n, len(low), 1.0, mechanism is not flat)
        near = pf.solve_fk(mechanism, 0.5 * (low + high) + 0.5 * (high - low) * 0.95 * bends).pose
        far = near[: n // 10].copy()
        far[:, :3, 3] += 1.5 * (mechanism.home_pose[:3, 3] - np.array(mechanism.joints[0].at))
        few = max(4, min(40, 600 // len(low)))  # the other engine takes a third of a second for some
        engine = ClosureEngine(model_of(mechanism))
        for how, targets in (("within reach", near), ("out of reach", far)):
            asked = targets[:few]
            ours, theirs = best_times(
                min(runs, 3),
                partial(pf.solve_ik, mechanism, targets),
                partial(engine.answer, asked, None, pf.Options(), keep_mode=False),
            )
            yield Row(f"{what}, batch, {how}", len(targets), ours / len(targets), "closure engine", theirs / len(asked))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--targets", type=int, default=400)
    count = parser.parse_args().targets
    print(machine(), end="\n\n")
    print("| chain | how | reached % | µs a target |\n|---|---|--:|--:|")
    for in_space in (False, True):
        for n, degrees in CASES:
            most, rng = math.radians(degrees), np.random.default_rng(n)
            mechanism = chain(n, most, in_space)
            targets = tips(smooth(rng, count, n, most, in_space), in_space)
            rows = list(own(mechanism, targets, most, in_space))
            rows += peers(n, most, targets[: max(10, count // 8)]) if in_space else []
            for what, reached, seconds in rows:
                name = f"{n}, ±{degrees:g}°, {'space' if in_space else 'plane'}"
                print(f"| {name} | {what} | {reached:.1f} | {1e6 * seconds:.3g} |")
                sys.stdout.flush()


if __name__ == "__main__":
    main()
