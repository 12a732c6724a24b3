"""What `answers.py` asks: about a hundred machines as files, and for each targets, a path, a start, actuator values."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import pfabrik as pf

sys.path.append(str(Path(__file__).parents[1] / "tests"))
from machines import MACHINES, published
from machines.closure import MACHINES as CLOSED
from machines.closure import ON_ARMS
from machines.trunks import TRUNKS

Array = NDArray[np.float64]
SEED = 20261124
COPIED = ("stewart", "five_bar", "nrpm", "servo_hexapod", "delta", "rps", "canfield", "g1_ankle")
LITERATURE = (
    *(published.planar_arm, published.tripod, published.similar_hexagons, published.seven_struts),
    published.four_rails,
)
KINDS = ("3-PRS", "3-RPR", "3-RPS", "3-RRR", "5-bar", "6-PUS", "6-RUS", "6-UPS", "delta")

TARGETS = (200, 120, 80, 48, 24, 12)
"""How many targets a machine may have: as many as `BUDGET` allows."""

BUDGET = 2.0
"""Processor time that the targets of a machine may take, by all questions together, about [s]."""

QUESTIONS = 12
"""How many times all targets are asked for, about."""


class Asked(NamedTuple):
    """What a machine is asked.

    Attributes
    ----------
    text : the machine, as a file.
    targets : (n, 4, 4), by turns where the machine can be, at the edge of that, and anywhere.
    path : (k, 4, 4), out of home and back again.
    start : joint coordinates (nq,) other than home's.
    values : actuator values (n, n_a), of configurations and anywhere.
    """

    text: str
    targets: Array
    path: Array
    start: Array
    values: Array


def machines() -> dict[str, Callable[[], str]]:
    """Machines by name: what gives the text of the file that describes each."""
    tested = MACHINES | CLOSED | ON_ARMS | TRUNKS | {make.__name__: make for make in LITERATURE}
    makers: dict[str, Callable[[], str]] = {f"catalogue {name}": partial(loaded, name) for name in pf.catalog()}
    makers |= {f"new {kind}": partial(new, kind) for kind in KINDS}
    makers |= {f"tests {name}": partial(made, make) for name, make in tested.items()}
    return makers | {f"{how} {name}": partial(copied, name, copy) for name in COPIED for how, copy in COPIES.items()}


def loaded(name: str) -> str:
    return as_text(pf.load(name))


def made(make: Callable[[], pf.Mechanism]) -> str:
    return as_text(make())


def copied(name: str, copy: Callable[[pf.Mechanism], pf.Mechanism]) -> str:
    return as_text(copy(pf.load(name)))


def new(kind: str) -> str:
    """The starting file for a kind of machines, as the command prints it."""
    command = [sys.executable, "-m", "pfabrik", "new", kind]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def as_text(mechanism: pf.Mechanism) -> str:
    """A machine as the text of its file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "machine.toml"
        pf.save(mechanism, path)
        return path.read_text(encoding="utf-8")


def as_machine(text: str) -> pf.Mechanism:
    """The machine that a file describes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "machine.toml"
        path.write_text(text, encoding="utf-8")
        return pf.load(path)


def reordered(mechanism: pf.Mechanism) -> pf.Mechanism:
    """The machine with its joints in another order."""
    order = np.random.default_rng(SEED).permutation(len(mechanism.joints))
    return dataclasses.replace(mechanism, joints=tuple(mechanism.joints[k] for k in order))


def moved(mechanism: pf.Mechanism) -> pf.Mechanism:
    """The machine turned and set down elsewhere; its task, if it leaves out a part of the pose, is then another."""
    L = mechanism.characteristic_length
    T = pf.pose([0.3 * L, -0.7 * L, 0.2 * L], rotvec=[0.4, -0.9, 0.5])
    R, t = T[:3, :3], T[:3, 3]

    def move(joint: pf.Joint) -> pf.Joint:
        changes: dict[str, object] = {}
        if joint.at is not None:
            changes["at"] = tuple(R @ joint.at + t)
        if joint.axis is not None:
            changes["axis"] = tuple(R @ joint.axis)
        if joint.axes is not None:
            changes["axes"] = tuple(tuple(R @ axis) for axis in joint.axes)
        if joint.cone is not None:
            changes["cone"] = dataclasses.replace(joint.cone, axis=tuple(R @ joint.cone.axis))
        return dataclasses.replace(joint, **changes)

    return with_joints(mechanism, [move(joint) for joint in mechanism.joints], R @ mechanism.reference_point + t)


def scaled(mechanism: pf.Mechanism, factor: float = 0.01) -> pf.Mechanism:
    """The machine in another unit; those of the catalogue that are copied have no cylindrical joints."""

    def scale(joint: pf.Joint) -> pf.Joint:
        changes: dict[str, object] = {} if joint.at is None else {"at": tuple(factor * np.array(joint.at))}
        if joint.type == "prismatic":
            changes["home"] = factor * joint.home
            changes["range"] = joint.range and tuple(factor * np.array(joint.range))
        return dataclasses.replace(joint, **changes)

    point = factor * np.array(mechanism.reference_point)
    return with_joints(mechanism, [scale(joint) for joint in mechanism.joints], point)


def with_joints(mechanism: pf.Mechanism, joints: list[pf.Joint], point: Array) -> pf.Mechanism:
    """The machine with other joints, and another reference point where that is not a joint's."""
    reference = None if mechanism.end_effector_is_joint else tuple(point)
    return dataclasses.replace(mechanism, joints=tuple(joints), reference_point=reference)


COPIES: dict[str, Callable[[pf.Mechanism], pf.Mechanism]] = {
    "moved": moved,
    "scaled": scaled,
    "reordered": reordered,
    "unlimited": pf.Mechanism.without_limits,
}


def asked_of(text: str, count: int) -> Asked:
    """What to ask a machine, the same in every run of one state of the library."""
    mechanism, rng = as_machine(text), np.random.default_rng(SEED)
    home = pf.solve_ik(mechanism, mechanism.home_pose)
    slides = np.array([mechanism.joint(name).type == "prismatic" for name in mechanism.actuator_names])
    span = np.where(slides, 0.15 * mechanism.characteristic_length, 0.4)
    third = -(-count // 3)
    drawn = home.actuators + rng.uniform(-1.0, 1.0, (third, len(span))) * span
    within = pf.solve_fk(mechanism, drawn)
    far, edge = anywhere(mechanism, rng, third), anywhere(mechanism, rng, third)
    edge = beside(mechanism, pf.solve_ik(mechanism, edge, options=pf.Options(hold=None)).pose, rng)
    targets = np.stack([within.pose, edge, far], axis=1).reshape(-1, 4, 4)[:count]
    targets = targets[np.isfinite(targets).all(axis=(1, 2))]
    near = np.flatnonzero(within.status == pf.Status.REACHED)
    start = within[near[0]].q if len(near) else home.q
    wild = home.actuators + rng.uniform(-3.0, 3.0, (third, len(span))) * span
    path = out_and_back(mechanism, anywhere(mechanism, rng, max(1, count // 50)))
    return Asked(text, targets, path, np.asarray(start), np.concatenate([drawn, wild]))


def anywhere(mechanism: pf.Mechanism, rng: np.random.Generator, n: int) -> Array:
    """Poses up to 3 L from home in any direction, turned by up to 1.2 rad about each axis; half of them much nearer."""
    directions = rng.normal(size=(n, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    size = np.where(np.arange(n) % 2, 0.1, 1.0) * rng.uniform(size=n)
    away = 3.0 * mechanism.characteristic_length * (size[:, None] * directions)
    turns = 1.2 * size[:, None] * rng.uniform(-1.0, 1.0, (n, 3))
    return pf.pose(mechanism.reference_point + away, rotvec=turns)


def beside(mechanism: pf.Mechanism, edge: Array, rng: np.random.Generator) -> Array:
    """Poses a little short of those at the edge, on it, or a little beyond, seen from home."""
    poses, home = edge.copy(), np.asarray(mechanism.reference_point)
    share = rng.choice([0.9, 0.999, 1.0, 1.0 + 1e-7, 1.001, 1.1], len(poses))
    poses[:, :3, 3] = home + (poses[:, :3, 3] - home) * share[:, None]
    return poses


def out_and_back(mechanism: pf.Mechanism, ends: Array) -> Array:
    """A path from home half of the way to each of the positions, straight, and back, in twenty steps."""
    home, tenths = np.asarray(mechanism.reference_point), [*range(1, 11), *range(9, -1, -1)]
    ways = [home + tenth / 20.0 * (end[:3, 3] - home) for end in ends for tenth in tenths]
    return pf.pose(np.array(ways))


def affordable(seconds_a_target: float) -> int:
    """How many targets a machine has that takes so long for one."""
    wanted = BUDGET / (QUESTIONS * max(seconds_a_target, 1e-9))
    return next((count for count in TARGETS if count <= wanted), TARGETS[-1])
