"""The same hexapod in PlaCo, a C++ solver of whole-body tasks with closed loops: one question at a time from Python.

Its rows are in the table where PlaCo can be imported (`pip install placo`, which brings a NumPy of its own choice:
better into an environment of its own). A cone is there the ranges of two hinges, at the platform's end alone, and a
radian of the target counts as much as L in both. Both start at home; PlaCo's search ends where its coordinates rest.
"""

from __future__ import annotations

import importlib.util
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import pfabrik as pf
from closed_forms import Array, Struts
from table import Row
from timing import best_times, draw

IS_THERE = importlib.util.find_spec("placo") is not None

QUESTIONS = 100
STILL, MOST_STEPS = 1e-9, 100
"""Change of its coordinates [L or rad] at which a search has ended, and the steps after which it is given up."""

INERTIA = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'


def along(line: Array) -> Array:
    """A rotation (3, 3) whose z axis is a line."""
    z = line / np.linalg.norm(line)
    x = np.cross((0.0, 1.0, 0.0), z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def origin(point: Array, rotation: Array) -> str:
    """A URDF frame: roll, pitch, yaw about fixed axes."""
    R = rotation
    angles = np.arctan2(R[2, 1], R[2, 2]), -np.arcsin(R[2, 0]), np.arctan2(R[1, 0], R[0, 0])
    return f'<origin xyz="{" ".join(map(str, point))}" rpy="{" ".join(map(str, angles))}"/>'


class Hexapod:
    """A platform that floats and six struts that hang from it, whose ends are held at the feet; lengths in L."""

    def __init__(self, mechanism: pf.Mechanism, held: str | None = None, driven: bool = False) -> None:
        import placo

        L = self.length = mechanism.characteristic_length
        struts = Struts(mechanism)
        self.home = self.scaled(mechanism.home_pose)
        self.feet, tops = struts.feet / L, struts.tops / L
        lines = self.feet - (tops + self.home[:3, 3])
        self.at_home = np.linalg.norm(lines, axis=1)
        lean = np.arccos(struts.head_cosines)
        parts = [f'<link name="platform">{INERTIA}</link>']
        for i, (top, line) in enumerate(zip(tops, lines, strict=True)):
            before = "platform"
            slide = (struts.low[i] / L - self.at_home[i], struts.high[i] / L - self.at_home[i])
            for kind, axis, frame, (lo, hi) in (
                ("revolute", "1 0 0", origin(top, along(line)), (-lean[i], lean[i])),
                ("revolute", "0 1 0", origin(np.zeros(3), np.eye(3)), (-lean[i], lean[i])),
                ("prismatic", "0 0 1", origin(np.array([0.0, 0.0, self.at_home[i]]), np.eye(3)), slide),
            ):
                name = f"{before}_{i}" if before == "platform" else f"{before}_"
                parts += [
                    f'<link name="{name}">{INERTIA}</link><joint name="to_{name}" type="{kind}">',
                    f'<parent link="{before}"/><child link="{name}"/>{frame}<axis xyz="{axis}"/>',
                    f'<limit lower="{lo}" upper="{hi}" effort="1" velocity="1e6"/></joint>',
                ]
                before = name
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "robot.urdf").write_text(f'<robot name="hexapod">{"".join(parts)}</robot>')
            self.robot: Any = placo.RobotWrapper(folder, placo.Flags.ignore_collisions)
        self.robot.set_T_world_frame("platform", self.home)
        self.robot.update_kinematics()
        self.begin = np.array(self.robot.state.q)
        self.solver: Any = placo.KinematicsSolver(self.robot)
        self.solver.enable_velocity_limits(False)
        for i, foot in enumerate(self.feet):
            self.solver.add_position_task(f"platform_{i}__", foot).configure(f"foot {i}", "hard")
        self.lengths = self.position = self.orientation = None
        if driven:
            self.lengths = self.solver.add_joints_task()
            self.lengths.configure("lengths", "hard")
        else:
            self.position = self.solver.add_position_task("platform", self.home[:3, 3])
            self.position.configure("position", "soft", 1.0)
            self.orientation = self.solver.add_orientation_task("platform", self.home[:3, :3])
            self.orientation.configure("orientation", "hard" if held else "soft", 1.0)
        self.solver.add_regularization_task(1e-9)

    def scaled(self, pose: Array) -> Array:
        scaled = np.array(pose)
        scaled[:3, 3] /= self.length
        return scaled

    def ik(self, pose: Array) -> Array:
        """Where its search for a pose (4, 4) [length] ends, from home."""
        target = self.scaled(pose)
        self.position.target_world, self.orientation.R_world_frame = target[:3, 3], target[:3, :3]
        return self._search()

    def fk(self, lengths: Array) -> Array:
        """The pose of lengths (6,), from home."""
        for i, off in enumerate(lengths / self.length - self.at_home):
            self.lengths.set_joint(f"to_platform_{i}__", off)
        return self._search()

    def follow(self, targets: Array, speed: float) -> Array:
        """Where it is after each tick of a second towards targets (n, 4, 4), struts no faster than a speed [length]."""
        for i in range(len(self.feet)):
            self.robot.set_velocity_limit(f"to_platform_{i}__", speed / self.length)
        self.solver.dt = 1.0
        self.solver.enable_velocity_limits(True)
        state = self.robot.state
        state.q = self.begin
        self.robot.state = state
        self.robot.update_kinematics()
        poses = np.empty((len(targets), 4, 4))
        for pose, target in zip(poses, targets, strict=True):
            scaled = self.scaled(target)
            self.position.target_world, self.orientation.R_world_frame = scaled[:3, 3], scaled[:3, :3]
            self.solver.solve(True)
            self.robot.update_kinematics()
            pose[:] = self.robot.get_T_world_frame("platform")
        self.opened = self.gap()
        poses[:, :3, 3] *= self.length
        return poses

    def gap(self) -> float:
        """How far its struts end from the feet at most [L]."""
        ends = [self.robot.get_T_world_frame(f"platform_{i}__")[:3, 3] for i in range(len(self.feet))]
        return float(np.linalg.norm(np.array(ends) - self.feet, axis=1).max())

    def _search(self) -> Array:
        state = self.robot.state
        state.q = before = self.begin
        self.robot.state = state
        self.robot.update_kinematics()
        for _ in range(MOST_STEPS):
            self.solver.solve(True)
            self.robot.update_kinematics()
            present = np.array(self.robot.state.q)
            if np.abs(present - before).max() < STILL:
                break
            before = present
        pose: Array = np.array(self.robot.get_T_world_frame("platform"))
        pose[:3, 3] *= self.length
        return pose


def peer(rng: np.random.Generator, runs: int) -> Iterator[Row]:
    """One call each, both from home: in reach, out of reach in two ways, and forward."""
    if not IS_THERE:
        return
    mechanism = pf.load("stewart")
    struts, drawn = Struts(mechanism), draw(mechanism, rng, 8 * QUESTIONS, 0.2, 0.2)
    near = drawn[struts.solve(drawn)[1]][:QUESTIONS]
    drawn = draw(mechanism, rng, 8 * QUESTIONS, 1.0, 0.5)
    far = drawn[~struts.solve(drawn)[1]][:QUESTIONS]
    free = pf.Options(hold=None, rotation_length=mechanism.characteristic_length)
    for what, asked, held in (
        ("reachable", near, None),
        ("out of reach, hold nothing", far, None),
        ("out of reach, hold orientation", far, "orientation"),
    ):
        ours = partial(pf.solve_ik, mechanism, options=replace(free, hold=held))
        yield row(f"6-UPS, one solve_ik, {what}", asked, ours, Hexapod(mechanism, held).ik, runs)
    values, theirs = pf.solve_ik(mechanism, near).actuators, Hexapod(mechanism, driven=True)
    yield row("6-UPS, one solve_fk", values, partial(pf.solve_fk, mechanism), theirs.fk, runs)
    yield from followed(mechanism, runs)


def followed(mechanism: pf.Mechanism, runs: int) -> Iterator[Row]:
    """A tick each along a stream that leaves reach by far and comes back; how far both are from it in the mean."""
    n, length = 600, mechanism.characteristic_length
    turn = np.arange(n) / n * 2.0 * np.pi
    shift = 0.9 * np.stack([np.sin(turn), np.sin(2 * turn + 0.4), np.sin(3 * turn + 1.0)], axis=1)
    turned = 0.7 * np.stack([np.sin(2 * turn), np.sin(turn + 0.7), np.sin(3 * turn)], axis=1)
    targets = pf.pose(mechanism.home_pose[:3, 3] + length * shift, rotvec=turned)
    theirs, speed = Hexapod(mechanism), 0.02 * length
    live = pf.Live(mechanism, speed=speed, hold=None, rotation_length=length)

    def ticks() -> Array:
        live.reset()
        return np.array([(live.tick(target, 1.0), live.pose.copy())[1] for target in targets])

    own, peers = best_times(min(runs, 5), ticks, lambda: theirs.follow(targets, speed))
    for poses, whose, gap in ((ticks(), "Live", 0.0), (theirs.follow(targets, speed), "PlaCo", theirs.opened)):
        errors = mechanism_errors(mechanism, poses, targets)
        margins = np.asarray(pf.feasibility(mechanism, poses).margin)
        print(
            f"6-UPS, {whose} along a stream: {errors.mean():.3f} L from it in the mean, within all limits in"
            f" {np.mean(margins >= -1e-6):.0%} of {n} ticks, loops open by {gap:.1e} L in the end"
        )
    yield Row("6-UPS, Live.tick, out of reach and back", n, own / n, "PlaCo", peers / n)


def mechanism_errors(mechanism: pf.Mechanism, poses: Array, targets: Array) -> Array:
    """Distances of poses from targets (n,) [L]; a radian counts as much as L."""
    positions = np.linalg.norm(poses[:, :3, 3] - targets[:, :3, 3], axis=1) / mechanism.characteristic_length
    traces = np.einsum("nij,nij->n", poses[:, :3, :3], targets[:, :3, :3])
    return np.asarray(np.hypot(positions, np.arccos(np.clip(0.5 * (traces - 1.0), -1.0, 1.0))))


def row(what: str, asked: Array, ours: Callable[[Array], object], theirs: Callable[[Array], object], runs: int) -> Row:
    def all_of(question: Callable[[Array], object]) -> Callable[[], object]:
        return lambda: [question(each) for each in asked]

    own, peers = best_times(min(runs, 5), all_of(ours), all_of(theirs))
    return Row(what, len(asked), own / len(asked), "PlaCo", peers / len(asked))
