"""A mechanism's kinematics as one file of tensors: for PyTorch, JAX or NumPy, in batches, with gradients."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args

import numpy as np

from ...common.arrays import Floats
from ...common.checks import require_choice, require_names
from ...common.whole_files import whole_path
from ...machine.description.mechanism import Mechanism, checked_mechanism
from .tensor_machine import TensorMachine
from .tensor_text import Steps, tensor_text

N_TRIED = 400
"""Configurations by which steps are counted."""

MOST_STEPS = 12
SAME = 1e-6
"""Difference of coordinates up to which forward kinematics came back to them [rad or length]."""

ENOUGH = 0.995
"""Share of them that must have come as far as rounding lets them, by forward kinematics."""

CLOSING = ("dead point", "legs do not close")
"""What names of limits begin with that no range is."""

FEWEST_FORWARD = 1
"""Steps before the one that carries derivatives: these are right where its own length is 0."""

FEWEST_COMPLETING = 2
"""Steps by which a pose is completed at other dimensions too, where legs do not close at once as they do at home's."""


def steps_of(machine: TensorMachine) -> Steps:
    """The Newton steps after which forward kinematics from home, and completed poses, are done.

    One more follows in the file, which carries the derivatives. Poses are completed beyond ranges too, with one to
    spare.
    """
    room: dict[str, Any] = {}
    exec(compile(tensor_text(machine, "numpy", Steps(MOST_STEPS, MOST_STEPS)), "tensors", "exec"), room)
    samples = machine.samples(N_TRIED)
    margins = room["margins"](samples)
    inside = samples[(margins > 0.0).all(axis=1)]
    inside = inside if len(inside) else samples[:1]
    closes = samples[(margins[:, [name.startswith(CLOSING) for name in room["LIMITS"]]] > 0.0).all(axis=1)]
    closes = closes if len(closes) else samples[:1]
    forward = room["to_pose" if machine.path is None else "to_joints"]
    if machine.path is not None:  # others are another assembly for their actuators
        own = np.abs(forward(room["to_actuators"](inside), steps=MOST_STEPS) - inside).max(axis=1) <= SAME
        inside = inside[own] if own.any() else inside[:1]
    values = room["to_actuators"](inside)

    def complete(steps: int) -> Floats:
        room["COMPLETING_STEPS"] = steps
        return np.asarray(room["pose"](closes))

    size = max(machine.mechanism.characteristic_length, 1.0)
    completing = max(FEWEST_COMPLETING, _fewest(complete, size, 1.0) + 1) if machine.completes else 0
    found = _fewest(lambda steps: forward(values, steps=steps), size, ENOUGH)
    return Steps(max(FEWEST_FORWARD, found), completing)


def _fewest(answer: Callable[[int], Floats], size: float, enough: float) -> int:
    """The fewest steps after which a share of the answers (n, ...) are those after many [L or rad]."""
    last = answer(MOST_STEPS)
    for steps in range(MOST_STEPS):
        off = np.abs(answer(steps) - last).reshape(len(last), -1).max(axis=1)
        if np.mean(off <= 1e-13 * size) >= enough:
            return steps
    return MOST_STEPS


Backend: TypeAlias = Literal["numpy", "torch", "jax"]
BACKENDS: tuple[Backend, ...] = get_args(Backend)


def export_tensors(
    mechanism: Mechanism,
    path: str | PathLike[str],
    *,
    backend: Backend = "numpy",
    joints: str | Sequence[str] | None = None,
) -> Path:
    """Write a mechanism's kinematics as one Python file of tensors, which needs this library no more.

    Its functions take any leading shape, float64 or float32, and the device of what they are given; with PyTorch and
    JAX they have derivatives, by the machine's dimensions too. Actuators, Jacobians and margins come in closed form, in
    home's working mode; forward kinematics by a fixed number of Newton steps. No value and no derivative is NaN: at and
    beyond a dead point values are clamped, and the margin says so. A clearance between links is not kept, and is no
    limit of the margins.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    path : str or PathLike
        The file to write; whatever has this name is replaced, when the text is complete.
    backend : {"numpy", "torch", "jax"}, optional
        Library of the arrays.
    joints : str or sequence of str, optional
        Names of joints in series from the base to the end effector, which then are the coordinates; by default poses of
        the platform are, of which what the task leaves open is completed.

    Raises
    ------
    UnsupportedMechanism
        Some chain is no leg in closed form, or one that has no code here; or joints that do not determine the
        actuators, or the other way round.
    UnknownName or InvalidArgument
        Joints that are none, or not in series; an unknown backend.
    """
    text = tensor_source(mechanism, backend=backend, joints=joints)
    with whole_path(path) as part:
        part.write_text(text, encoding="ascii")
    return Path(path)


def tensor_source(
    mechanism: Mechanism, *, backend: Backend = "numpy", joints: str | Sequence[str] | None = None
) -> str:
    """The text that `export_tensors` writes."""
    checked_mechanism(mechanism)
    require_choice("backend", backend, BACKENDS)
    names = None if joints is None else require_names("joints", [joints] if isinstance(joints, str) else joints)
    machine = TensorMachine(mechanism, names)
    return tensor_text(machine, backend, steps_of(machine))


def export_numpy(mechanism: Mechanism, path: str | PathLike[str], *, joints: str | Sequence[str] | None = None) -> Path:
    """Write a mechanism's kinematics as one file of NumPy arrays: `export_tensors` with backend "numpy".

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    path : str or PathLike
        The file to write.
    joints : str or sequence of str, optional
        As in `export_tensors`.
    """
    return export_tensors(mechanism, path, backend="numpy", joints=joints)


def export_torch(mechanism: Mechanism, path: str | PathLike[str], *, joints: str | Sequence[str] | None = None) -> Path:
    """Write a mechanism's kinematics as one file of PyTorch tensors: `export_tensors` with backend "torch".

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    path : str or PathLike
        The file to write.
    joints : str or sequence of str, optional
        As in `export_tensors`.
    """
    return export_tensors(mechanism, path, backend="torch", joints=joints)


def export_jax(mechanism: Mechanism, path: str | PathLike[str], *, joints: str | Sequence[str] | None = None) -> Path:
    """Write a mechanism's kinematics as one file of JAX arrays: `export_tensors` with backend "jax".

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    path : str or PathLike
        The file to write.
    joints : str or sequence of str, optional
        As in `export_tensors`.
    """
    return export_tensors(mechanism, path, backend="jax", joints=joints)
