"""The text of a file of tensors: comment, dimensions, tables, and the routines that the machine needs."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from importlib import resources
from typing import Any, NamedTuple

import numpy as np

from ...machine.description.mechanism import Mechanism
from .source import NOTICE, selected
from .static_data import comment
from .tensor_tables import Rows, TensorMachine, cones_of, counting_of, dimensions_of, nested, place_of

ACCURACY = {"float64": 1e-13, "float32": 1e-6}
"""Share of a pivot below which equations do not determine an unknown: what rounding leaves of it."""

CLOSED = {"float64": 1e-9, "float32": 1e-4}
"""What legs may be open and count as closed [L or rad]."""

DEAD = 1e-12
"""Square of the sine of an angle from a dead point below which a proximal joint is clamped."""

KEPT = 1e-9
"""Excess up to which an angle counts as within its range [rad]."""

LONGEST = 120


class Steps(NamedTuple):
    """Numbers of Newton steps: of forward kinematics, and for what the task leaves open of a pose."""

    forward: int
    completing: int


def tensor_text(machine: TensorMachine, backend: str, steps: Steps) -> str:
    """The text of the file."""
    folder = resources.files(__package__)
    routines = folder.joinpath("tensors.py.in").read_text(encoding="utf-8")
    head = selected(folder.joinpath("tensor_backends.py.in").read_text(encoding="utf-8"), {backend.upper()})
    text = _in_words(selected(routines, _conditions(machine)), machine, backend)
    parts = [_header(machine, backend), head.strip("\n"), "\n".join(_tables(machine, steps)), text.strip("\n")]
    return re.sub(r"\n{4,}", "\n\n\n", "\n\n".join(parts)) + "\n"


def _conditions(machine: TensorMachine) -> set[str]:
    """The names of conditions in the routines that hold."""
    kinds = [group.kind for group in machine.groups]
    rods = [kind for kind in kinds if kind["kind"] == "rod"]
    is_task = machine.path is None
    proximal = {kind["proximal"] for kind in kinds}
    endings = [kind[f"{end}_end"] for kind in rods for end in ("base", "platform")]
    conditions = {
        "TASK": is_task,
        "JOINTS": not is_task,
        "CLOSES": is_task and machine.machine.equations > 0,
        "COMPLETES": machine.completes,
        "POINT": machine.is_point and is_task,
        "PROXIMAL": proximal != {None},
        "CRANKS": "crank" in proximal,
        "CARRIAGES": "carriage" in proximal,
        "SHARED": any(kind["main"] for kind in kinds),
        "PIVOTS": len(rods) < len(kinds),
        "TWISTS": is_task and any(kind["twists"] for kind in rods),
        "HINGED": is_task and "hinge" in endings,
        "ANGLES": len(machine.machine.limited) > 0 or any(kind["twists"] for kind in rods),
        "DRIVEN_HINGES": any(place[2] in ("base", "platform") for place in machine.driven),
    }
    return {name for name, holds in conditions.items() if holds}


def _in_words(text: str, machine: TensorMachine, backend: str) -> str:
    """The routines, with the words for what their arguments are."""
    is_task = machine.path is None
    words = {
        "ARGUMENT_IS": "targets (..., 4, 4), what the task leaves open completed"
        if is_task
        else "joint coordinates (..., n)",
        "ARGUMENT": "target" if is_task else "q",
        "JACOBIAN_BY": "the twist of the end effector, (..., n_a, 6), or by the nearest one that the legs allow:\n"
        "    velocity of the reference point, angular velocity, in base coordinates"
        if is_task
        else "those of the joints, (..., n_a, n)",
        "RATES_OF": "of the end effector, twists (..., 6)" if is_task else "of the joints (..., n)",
        "TORQUES_NAME": "torques_to_wrenches" if is_task else "torques_to_joints",
        "TORQUES_AT": "the end effector, as forces and moments (..., 6)" if is_task else "the joints (..., n)",
        "PARAMETERS_OF": {
            "numpy": "dtype=xp.float64",
            "torch": "dtype=xp.float64, device=None",
            "jax": "dtype=xp.float64",
        }[backend],
        "MAKE_PARAMETERS": {
            "numpy": "xp.array(_PARAMETERS, dtype=dtype)",
            "torch": "xp.tensor(_PARAMETERS, dtype=dtype, device=device)",
            "jax": "xp.array(_PARAMETERS, dtype=dtype)",
        }[backend],
    }
    for word, meant in words.items():
        text = text.replace(word, meant)
    return text


def _header(machine: TensorMachine, backend: str) -> str:
    """The comment at the top: units, coordinates, and the notice."""
    mechanism = machine.mechanism
    unit, library = mechanism.length_unit, {"numpy": "NumPy", "torch": "PyTorch", "jax": "JAX"}[backend]
    what = "poses (4 x 4)" if machine.path is None else f"joints {', '.join(machine.path.names)}"
    forward = "to_pose(actuators)" if machine.path is None else "to_joints(actuators)"
    argument = "target" if machine.path is None else "q"
    lines = [
        f"The kinematics of '{mechanism.name}' in {library}, written by pfabrik from its description.",
        "",
        f"Between {what} and actuators {', '.join(mechanism.actuator_names)}:",
        f"    to_actuators({argument}), {forward}, jacobian({argument}), margin({argument})",
        f"Lengths in {unit}, angles in radians. Arrays may have any leading shape. What is computed has the type and",
        "the device of what is given. All of it is in the working mode of home.",
        "",
        "DIMENSIONS are the machine's, as it stands at home, in base coordinates. Every function takes them as one",
        "vector too: `parameters()`, or your own, with any leading shape, and with derivatives.",
        "",
        *_without_clearance(mechanism),
        *NOTICE.splitlines(),
    ]
    return '"""' + "\n".join(comment(line).replace("\\", "/").replace('"', "'") for line in lines) + '\n"""'


def _without_clearance(mechanism: Mechanism) -> list[str]:
    """Lines that say that a clearance is not kept."""
    if mechanism.clearance is None:
        return []
    least = f"{mechanism.clearance:.10g} {mechanism.length_unit}"
    return [f"Links may be nearer than the machine's clearance, {least}: that is no limit of `margin`.", ""]


def _tables(machine: TensorMachine, steps: Steps) -> Iterator[str]:
    """Constants and tables."""
    mechanism, size = machine.mechanism, machine.mechanism.characteristic_length
    inner, path = machine.machine, machine.path
    yield f"ACTUATORS = {_words(mechanism.actuator_names)}"
    if path is not None:
        yield f"JOINTS = {_words(path.names)}"
    yield from _limit_names(machine)
    yield f"LENGTH_UNIT = {str(mechanism.length_unit)!a}"
    yield f"SIZE = {size!r}  # a length of the machine, by which lengths are compared with angles"
    yield f"STEPS = {steps.forward}  # of Newton's method, for forward kinematics"
    if machine.completes:
        yield f"COMPLETING_STEPS = {steps.completing}  # for what the task leaves open"
    yield ""
    yield from _dimensions(machine)
    yield "# --- How the machine is built. ---"
    yield ""
    yield "GROUPS = {"
    for group in machine.groups:
        joints = "; ".join(", ".join(inner.legs[place].joints) for place in group.legs)
        yield f"    {group.name!r}: {{  # {comment(joints)}"[:LONGEST]
        yield from (f"        {key!r}: {value!r}," for key, value in group.kind.items())
        yield "    },"
    yield "}"
    yield "# of every actuator: the group, the leg there, what moves, which of these; its sense; how turns are counted"
    yield f"ACTUATED = {_rows(machine.driven)}"
    yield f"ACTUATOR_SENSE = {nested([driven.sense for driven in inner.driven])!r}"
    yield f"ACTUATOR_COUNTING = {_rows([counting_of(driven) for driven in inner.driven])}"
    ranged = [(place_of(c, inner, machine.groups), c.sense, counting_of(c)) for c in inner.limited]
    yield f"RANGED = {_rows(ranged)}"
    yield f"CONES = {_rows(list(cones_of(machine.machine, machine.groups)))}"
    yield f"DEAD_POINTS = {_rows(_dead_points(machine))}"
    yield f"OPEN = {machine.open!r}  # proximal joints without a motor"
    if path is not None:
        series = [(motion.place, motion.sign, motion.kind == "turn") for motion in path.motions]
        units = nested([1.0 if each.kind == "angle" else size for each in path.coordinates])
        yield "# from the base outward: the place of the coordinate, its sense, and if it turns"
        yield f"SERIES = {_rows(series)}"
        yield f"JOINT_UNITS = {units!r}"
    else:
        yield f"MOTIONS = {_rows(nested(np.eye(6)[:, :3])) if machine.is_point else None}  # of the pose; None: all"
        yield f"FIXED = {3 if machine.is_point else 0}  # of the six that a pose has"
    if machine.completes:
        yield f"ALL_PROXIMAL = {machine.proximal!r}"
        yield f"ROTATIONS = {inner.rotations}  # of the pose's three that the task sets"
        yield f"SET_AXES = {nested(inner.axes)!r}  # 1: the task sets x, y, z"
        yield f"UNSET_MOTIONS = {_rows(_unset(machine))}"
    is_angle_driven = any(place[2] in ("base", "platform") for place in machine.driven)
    yield f"CLOSING = {path is None}  # all legs' equations are solved, not those of actuators alone"
    yield f"CLOSES = {path is None and inner.equations > 0}"
    yield f"DRIVEN_ANGLES = {is_angle_driven}"
    yield "HINGES = {'hinge': 1, 'cross': 2}"
    yield f"ACCURACY = {ACCURACY!r}"
    yield f"CLOSED = {CLOSED!r}"
    yield f"DEAD, KEPT = {DEAD!r}, {KEPT!r}"
    yield "TURN = 6.283185307179586"
    yield "UNIT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))"


def _unset(machine: TensorMachine) -> Rows:
    """The motions of a pose that the task leaves open, but a turn about its own z axis."""
    inner, unit = machine.machine, np.eye(6)
    columns = [axis for axis in range(3) if not inner.axes[axis]] + ([3, 4, 5] if inner.rotations == 0 else [])
    return nested(unit[:, columns])


def _limit_names(machine: TensorMachine) -> Iterator[str]:
    names = [f"{joint} {bound}" for joint, bound in machine.machine.limits]
    for name, leg in _dead_points(machine):
        group = next(group for group in machine.groups if group.name == name)
        joints = machine.machine.legs[group.legs[leg]].joints
        names.append(f"dead point of {joints[0]}")
    if machine.path is None and machine.machine.equations:
        names.append("legs do not close")
    yield f"LIMITS = {_words(names)}"


def _dead_points(machine: TensorMachine) -> list[tuple[str, int]]:
    """Legs that have a singularity margin: on a proximal joint of their own, or pivots of three hinges."""
    return [(group.name, leg) for group in machine.groups if "side" in group.kind for leg in range(group.kind["n"])]


def _dimensions(machine: TensorMachine) -> Iterator[str]:
    """The dimensions, a line for every leg."""
    inner = machine.machine
    rows = dimensions_of(inner, machine.groups, machine.path)
    joints = {group.name: [", ".join(inner.legs[place].joints) for place in group.legs] for group in machine.groups}
    joints["actuators"] = list(machine.mechanism.actuator_names)
    if machine.path is not None:
        names = machine.path.names
        joints["joints"] = [names[motion.place] for motion in machine.path.motions]
    yield "DIMENSIONS = {"
    for name, values in rows.items():
        of = joints.get(name.rpartition(".")[0], [])
        if name == "joints.home":
            of = list(machine.path.names) if machine.path else []
        if not of:
            yield f"    {name!r}: {values!r},"
            continue
        yield f"    {name!r}: ("
        assert isinstance(values, tuple)
        yield from (f"        {row!r},  # {comment(each)}" for row, each in zip(values, of, strict=True))
        yield "    ),"
    yield "}"
    yield ""


def _words(names: Sequence[str]) -> str:
    return "(" + "".join(f"{name!a}, " for name in names).rstrip() + ")"


def _rows(rows: Any) -> str:
    """A tuple of rows, one a line."""
    return "(" + "".join(f"\n    {row!a}," for row in rows) + ("\n)" if len(rows) else ")")
