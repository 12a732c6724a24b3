"""A mechanism's kinematics as one file of tensors: for PyTorch, JAX or NumPy, in batches, with gradients."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Literal, TypeAlias, get_args

from ..checks import require_choice, require_names
from ..description.mechanism import Mechanism, checked_mechanism
from ..whole_files import whole_path
from .tensor_machine import TensorMachine
from .tensor_steps import steps_of
from .tensor_text import tensor_text

Backend: TypeAlias = Literal["numpy", "torch", "jax"]
BACKENDS: tuple[Backend, ...] = get_args(Backend)
TASK = "task"


def export_tensors(
    mechanism: Mechanism,
    path: str | PathLike[str],
    *,
    backend: Backend = "numpy",
    joints: str | Sequence[str] = TASK,
) -> Path:
    """Write a mechanism's kinematics as one Python file of tensors, which needs this library no more.

    Its functions take any leading shape, float64 or float32, and the device of what they are given; with PyTorch and
    JAX they have derivatives, by the machine's dimensions too. Actuators, Jacobians and margins come in closed form, in
    home's working mode; forward kinematics by a fixed number of Newton steps. No value and no derivative is NaN: at and
    beyond a dead point values are clamped, and the margin says so. A clearance between links is not kept, and is no
    limit of the margins.

    Parameters
    ----------
    path : the file to write; whatever has this name is replaced, when the text is complete.
    backend : "numpy", "torch" or "jax".
    joints : names of joints in series from the base to the end effector, which then are the coordinates; "task" for
        poses of the platform, of which what the task leaves open is completed.

    Raises
    ------
    UnsupportedMechanism : some chain is no leg in closed form, or one that has no code here; or joints that do not
        determine the actuators, or the other way round.
    UnknownName, InvalidArgument : of the joints, if they are none, or not in series; an unknown backend.
    """
    text = tensor_source(mechanism, backend=backend, joints=joints)
    with whole_path(path) as part:
        part.write_text(text, encoding="ascii")
    return Path(path)


def tensor_source(mechanism: Mechanism, *, backend: Backend = "numpy", joints: str | Sequence[str] = TASK) -> str:
    """The text that `export_tensors` writes."""
    checked_mechanism(mechanism)
    require_choice("backend", backend, BACKENDS)
    names = require_names("joints", [joints] if isinstance(joints, str) else joints)
    machine = TensorMachine(mechanism, None if tuple(names) == (TASK,) else names)
    return tensor_text(machine, backend, steps_of(machine))


def export_numpy(mechanism: Mechanism, path: str | PathLike[str], *, joints: str | Sequence[str] = TASK) -> Path:
    """Write a mechanism's kinematics as one file of NumPy arrays: `export_tensors` with backend "numpy"."""
    return export_tensors(mechanism, path, backend="numpy", joints=joints)


def export_torch(mechanism: Mechanism, path: str | PathLike[str], *, joints: str | Sequence[str] = TASK) -> Path:
    """Write a mechanism's kinematics as one file of PyTorch tensors: `export_tensors` with backend "torch"."""
    return export_tensors(mechanism, path, backend="torch", joints=joints)


def export_jax(mechanism: Mechanism, path: str | PathLike[str], *, joints: str | Sequence[str] = TASK) -> Path:
    """Write a mechanism's kinematics as one file of JAX arrays: `export_tensors` with backend "jax"."""
    return export_tensors(mechanism, path, backend="jax", joints=joints)
