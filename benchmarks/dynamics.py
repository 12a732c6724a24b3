"""What forces of a motion cost, next to those of a tree without its loops in Pinocchio.

Pinocchio is there where it can be imported (`pip install pin`, which brings a NumPy of its own choice: better into an
environment of its own). Its recursive Newton-Euler algorithm takes the rates and accelerations of all joints of the
spanning tree as known, and gives their torques as if all were driven: no loop is closed, and none shares them among the
actuators. At home, where all is at rest, that the torques of the tree do the work of the actuators' is checked.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

import pfabrik as pf
from closed_forms import Array
from pfabrik.kinematics import inertias_of, tree_of
from pfabrik.machine.description.home_mobility import universal_axes
from table import Row
from timing import best_times, draw

IS_THERE = importlib.util.find_spec("pinocchio") is not None
METRES = 1e-3
QUESTIONS = 200


def heavy(name: str) -> pf.Mechanism:
    """A machine in millimetres all of whose bodies weigh something."""
    machine = pf.load(name)
    masses = []
    for body in machine.bodies:
        ends = [joint.at for joint in machine.joints if body in joint.connects and joint.at is not None]
        masses.append(pf.Mass(body, 0.2, np.mean(ends, axis=0), [40.0, 50.0, 60.0]))
    return machine.with_masses(masses)


class Tree:
    """The spanning tree of a machine in Pinocchio, at home where its coordinates are 0."""

    def __init__(self, machine: pf.Mechanism) -> None:
        import pinocchio

        self.pin: Any = pinocchio
        self.model, self.machine = pinocchio.Model(), machine
        self.columns: dict[str, tuple[Any, float]] = {}
        ids, places = {machine.base: 0}, {0: np.zeros(3)}
        for index, forward in tree_of(machine).steps:
            joint, start = machine.joints[index], self.model.nv
            parent, child = joint.connects if forward else joint.connects[::-1]
            last, sign = ids[parent], 1.0 if forward else -1.0
            at = places[last] if joint.at is None else np.array(joint.at) * METRES
            for kind, axis in self._parts(joint)[:: int(sign)]:
                moves = kind(*(sign * axis / np.linalg.norm(axis))) if len(axis) else kind()
                place = pinocchio.SE3(np.eye(3), at - places[last])
                last = self.model.addJoint(last, moves, place, f"{joint.name}_{self.model.njoints}")
                places[last] = at
            ids[child], columns = last, np.arange(start, self.model.nv)
            is_ball = joint.type == "spherical"
            self.columns[joint.name] = (columns, sign) if is_ball else (columns[:: int(sign)], 1.0)
        for body, (mass, centre, inertia) in inertias_of(machine, METRES).items():
            solid = pinocchio.Inertia(mass, centre * METRES - places[ids[body]], inertia * METRES**2)
            self.model.appendBodyToJoint(ids[body], solid, pinocchio.SE3.Identity())
        self.data = self.model.createData()

    def _parts(self, joint: pf.Joint) -> list[tuple[Any, Array]]:
        """The joints of Pinocchio that a joint is, each with its axis at home."""
        pin, machine = self.pin, self.machine
        turn, slide = pin.JointModelRevoluteUnaligned, pin.JointModelPrismaticUnaligned
        if joint.type == "spherical":
            return [(pin.JointModelSpherical, np.zeros(0))]
        if joint.type == "universal":
            return [(turn, axis) for axis in universal_axes(machine, joint)]
        axis = np.zeros(3) if joint.axis is None else np.array(joint.axis)
        if joint.along is not None:
            first, second = (np.array(end.at) for end in machine.ends_along(joint))
            axis = second - first
        kinds = {"revolute": [turn], "prismatic": [slide], "cylindrical": [turn, slide], "fixed": []}[joint.type]
        return [(kind, axis) for kind in kinds]

    def torques(self, q: Array, v: Array, a: Array) -> Array:
        found: Array = self.pin.rnea(self.model, self.data, q, v, a)
        return found

    def check(self) -> None:
        """Stop where the torques of the tree at rest are not those of the actuators: rows would mean nothing."""
        home, zero = pf.solve_ik(self.machine, self.machine.home_pose), np.zeros(self.model.nv)
        work, by_tree = self.torques(self.pin.neutral(self.model), zero, zero), 0.0
        slides = np.array([drive.kind == "length" for drive in self.machine.drives])
        for name, (columns, sign) in self.columns.items():
            kind = self.machine.joint(name).type
            units = {"prismatic": [METRES], "cylindrical": [1.0, METRES]}.get(kind, np.ones(len(columns)))
            rates = pf.transmission(home, name).rates / np.where(slides, METRES, 1.0)
            by_tree = by_tree + (rates * np.reshape(units, (-1, 1))).T @ work[columns] * sign
        ours = pf.inverse_dynamics(home).actuators
        if np.abs(by_tree - ours).max() > 1e-9 * np.abs(ours).max():
            sys.exit(f"Pinocchio disagrees with the forces of '{self.machine.name}' at rest: {by_tree}, {ours}")


def dynamics(rng: np.random.Generator, runs: int, n: int) -> Iterator[Row]:
    """Forces of motions and mass matrices, in batches and one by one; Pinocchio is asked one by one."""
    for name, what in (("stewart", "6-UPS"), ("delta", "delta")):
        machine = heavy(name)
        answers = pf.solve_ik(machine, draw(machine, rng, 2 * n, 0.2, 0.2))
        yield from forces_of(machine, what, answers[np.flatnonzero(answers.status == pf.Status.REACHED)[:n]], rng, runs)


def forces_of(
    machine: pf.Mechanism, what: str, answers: pf.Solution, rng: np.random.Generator, runs: int
) -> Iterator[Row]:
    n, one_by_one = len(answers), range(QUESTIONS)
    rates, gains = rng.standard_normal((2, n, len(machine.actuator_names)))
    rows, move = [answers[i] for i in one_by_one], partial(pf.inverse_dynamics, at="actuators")
    solver, poses, twists = (
        pf.Solver(machine),
        [answers.pose[i].copy() for i in one_by_one],
        rng.standard_normal((n, 6)),
    )
    batch, one, state, mass = best_times(
        runs,
        lambda: move(answers, twists=rates, accelerations=gains),
        lambda: [move(rows[i], twists=rates[i], accelerations=gains[i]) for i in one_by_one],
        lambda: [solver.effort(poses[i], twists[i], twists[i]) for i in one_by_one],
        partial(pf.mass_matrix, answers, "actuators"),
    )
    theirs: dict[str, Any] = {}
    if IS_THERE:
        tree = Tree(machine)
        tree.check()
        q, (v, a) = tree.pin.neutral(tree.model), rng.standard_normal((2, tree.model.nv))
        (seconds,) = best_times(runs, lambda: [tree.torques(q, v, a) for _ in range(1000)])
        said = f"Pinocchio, {tree.model.nv} joint rates of the open tree"
        theirs = {"baseline": said, "baseline_seconds": seconds / 1000}
    yield Row(f"{what}, forces of a motion, batch", n, batch / n, **theirs)
    yield Row(f"{what}, forces of a motion, one call", QUESTIONS, one / QUESTIONS, **theirs)
    yield Row(f"{what}, forces of a motion, Solver.effort", QUESTIONS, state / QUESTIONS, **theirs)
    yield Row(f"{what}, mass matrix, batch", n, mass / n)
