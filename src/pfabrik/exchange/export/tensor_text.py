"""The text of a file of tensors: comment, dimensions, what is noted of the legs, and the functions that ask them."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator, Sequence
from importlib import resources
from typing import Any, NamedTuple

from ...machine.description.mechanism import Mechanism
from ...machine.noted_numbers import numbers_behind
from . import tensor_functions
from .source import NOTICE, selected
from .static_data import comment
from .tensor_machine import TensorMachine
from .tensor_steps import WIDEST, Body, Places, Variable

LIBRARIES = {"numpy": "NumPy", "torch": "PyTorch", "jax": "JAX"}


class Steps(NamedTuple):
    """Numbers of Newton steps: of forward kinematics, and for what the task leaves open of a pose."""

    forward: int
    completing: int


def tensor_text(machine: TensorMachine, backend: str, steps: Steps) -> str:
    """The text of the file."""
    head = resources.files(__package__).joinpath("tensor_backends.py.in").read_text(encoding="utf-8")
    parts = [
        _header(machine, backend),
        selected(head, {backend.upper()}).strip("\n"),
        "\n".join(_tables(machine, steps)),
        _functions(machine, backend),
    ]
    return re.sub(r"\n{4,}", "\n\n\n", "\n\n\n".join(parts)) + "\n"


def _functions(machine: TensorMachine, backend: str) -> str:
    """The functions of `tensor_functions` that the machine needs, and before Newton's method those that are noted."""
    source = inspect.getsource(tensor_functions)
    blocks = source[source.index("class _Numbers") : source.index("_platform: Any")].strip("\n").split("\n\n\n")
    unneeded = set() if machine.completes else set(COMPLETING)
    unneeded |= BY_JOINTS if machine.path is None else BY_POSES
    unneeded |= {"_platform_by_pose"} if machine.completes else set()
    unneeded |= {"_repeat"} if backend == "jax" else set()
    parts: list[str] = []
    for block in blocks:
        name = re.match(r"def (\w+)", block)
        if name is not None and name[1] in unneeded:
            continue
        if block.startswith("# --- Newton's method"):
            parts += [LEGS, *noted_functions(machine)]
        if block.startswith("@_cached"):
            parts.append(PARAMETERS[backend])
        is_asked = name is not None and block.startswith(f"def {name[1]}(q") and not name[1].startswith("_")
        parts.append(_in_words(block, machine) if is_asked else block)
    return re.sub("_platform_(by_pose|by_joints|completed)", "_platform", "\n\n\n".join(parts))


LEGS = "# --- The legs, at poses in SIZE: steps of the library's own routines, which comments name. ---"

BY_JOINTS = {"to_joints", "_platform_by_joints"}
BY_POSES = {"to_pose", "_moved_by", "_moved_slightly", "_platform_by_pose", "_feasible"}
COMPLETING = {"_platform_completed", "_completed", "_times", "_start_rotation", "_by_unset", "_unset_twist"}
"""Functions of files by joints, by poses, and of those that complete poses."""


def _parameters(dtype: str, made: str) -> str:
    return f'''def parameters({dtype}):
    """The dimensions as one vector; PARAMETER_NAMES says which is which."""
    return xp.{made}'''


PARAMETERS = dict.fromkeys(LIBRARIES, _parameters("dtype=xp.float64", "array(_PARAMETERS, dtype=dtype)")) | {
    "torch": _parameters("dtype=xp.float64, device=None", "tensor(_PARAMETERS, dtype=dtype, device=device)")
}


def _in_words(text: str, machine: TensorMachine) -> str:
    """Text of functions that take coordinates, with the words for these."""
    is_task = machine.path is None
    words = {
        r"\bq\b": "target" if is_task else "q",
        "RATES_BY": "the twist of the end effector, (..., n_a, 6), or by the nearest one that the legs allow:\n"
        "    velocity of the reference point, angular velocity, in base coordinates"
        if is_task
        else "those of the joints, (..., n_a, n)",
        "torques_to_coordinates": "torques_to_wrenches" if is_task else "torques_to_joints",
        "TORQUES_AT": "the end effector, as forces and moments (..., 6)" if is_task else "the joints (..., n)",
    }
    for word, meant in words.items():
        text = re.sub(word, meant, text)
    return text


# The functions that are noted


def noted_functions(machine: TensorMachine) -> Iterator[str]:
    """The functions that are steps of the machine's legs."""
    names, placed, size = machine.names, machine.placed, machine.size
    is_task = machine.path is None
    rates = [x for column in (*placed.rates, *(placed.row_rates if is_task else ())) for x in column]
    rooms = [*placed.rooms, *(placed.gaps if machine.closes else ())]
    equations = [("_equations", machine.forward, ", actuators, z", "at values of actuators")]
    if machine.completes:
        equations.append(("_closing", machine.closing, ", z", "at coordinates of all proximal joints"))
    walked = [] if is_task else [*machine.walked[0], *(x for row in machine.walked[1] for x in row)]
    proximal = machine.proximal_places if machine.completes else []
    everything = [*placed.actuators, *rates, *rooms, *proximal, *walked]
    everything += [x for _, each, *_ in equations for part in (each.rows, *each.slopes) for x in part]
    home, places = _home(machine, everything)
    yield home
    leaves = places | _leaves(machine)
    if not is_task:
        yield _walked(machine, leaves)

    behind = {each.place for each in numbers_behind(placed.actuators, lambda each: each.place in leaves)}
    later = numbers_behind([*rates, *rooms], lambda each: each.place in leaves or each.place in behind)
    kept = [each for each in later if each.place in behind and each.place not in leaves]
    body = Body(placed.actuators, leaves, names, "p_x", size, kept)
    at = {each.place: body.places[each.place] for each in kept}
    variables = list(dict.fromkeys(variable.text for variable, _ in at.values()))
    lines = [*body.lines, f"return {body.output(placed.actuators)}, _Numbers({_named(variables)})"]
    yield _function("_placed(h, R, p)", "Actuators in closed form, and numbers of the legs there.", lines)
    given = leaves | {place: (v._replace(text=f"at.{v.text}"), k) for place, (v, k) in at.items()}
    body = Body(rates, given, names, "p_x", size)
    row_rates = placed.row_rates if is_task else []
    order = body.order(row_rates)
    lines = [*body.lines, f"rates = {_stacked(body, placed.rates)}", f"rows = {_stacked(body, row_rates, order)}"]
    lines.append("return rates, rows")
    yield _function("_rates(h, R, p, at)", "Slopes of actuators, and of the legs' constraints, by a twist.", lines)
    body = Body(rooms, given, names, "p_x", size)
    order = body.order([placed.gaps]) if machine.closes else []
    gaps = body.output([placed.gaps[k] for k in order]) if machine.closes else "None"
    room = body.output(placed.rooms) if placed.rooms else "None"
    lines = [*body.lines, f"return {room}, {gaps}"]
    yield _function("_rooms(h, R, p, at)", "The room before every limit, and by how much legs are open.", lines)
    if proximal:
        body = Body(proximal, leaves, names, "p_x", size)
        lines = [*body.lines, f"return {body.output(proximal)}"]
        yield _function("_proximal(h, R, p)", "Coordinates of all proximal joints in closed form.", lines)
    for name, each, more, where in equations:
        body = Body([*each.rows, *(x for column in each.slopes for x in column)], leaves, names, "p_x", size)
        order = body.order([each.rows, *each.slopes])
        rows, slopes = body.output([each.rows[k] for k in order]), _stacked(body, each.slopes, order)
        lines = [*body.lines, f"rows = {rows}", f"return rows, {slopes}"]
        doc = f"Equations of legs {where}; slopes by a twist, then by proximal joints in z."
        yield _function(f"{name}(h, R, p{more})", doc, lines)


def _home(machine: TensorMachine, everything: Sequence[Any]) -> tuple[str, Places]:
    """The function of what follows from dimensions, and where its numbers are."""
    inputs, raw = _inputs(machine)
    more = {"reference": machine.reference, "joint_homes": machine.joint_homes}
    wanted = numbers_behind([*everything, *machine.reference], lambda each: not each.is_open)
    used = [each for each in wanted if not each.is_open]
    body = Body([], inputs, machine.names, "n[0]", machine.size, used)
    variables = {each.place: body.places[each.place] for each in used}
    named = {variable.text: raw.get(variable.text, variable.text) for variable, _ in variables.values()}
    made = [f"{name}={text}" for text, name in named.items()]
    made += [f"{name}={body.output(numbers)}" for name, numbers in more.items() if numbers]
    lines = [*body.lines, f"return _Numbers({', '.join(made)})"]
    places = {place: (v._replace(text=f"h.{named[v.text]}"), k) for place, (v, k) in variables.items()}
    return _function("_home(n)", "What follows from dimensions alone, of all legs.", lines), places


def _inputs(machine: TensorMachine) -> tuple[Places, dict[str, str]]:
    """Where the machine's numbers are in the vector of all of them; and the names of its parts, by their texts.

    A part is one component of legs that are alike, or of what else has rows.
    """
    places: Places = {}
    names: dict[str, str] = {}
    start = 0
    for name, numbers in (*machine.given, *machine.constants):
        rows = numbers.reshape(1, -1) if name == "reference_point" else numbers.reshape(len(numbers), -1)
        n, width = rows.shape
        end = start + n * width
        for column in range(width):
            step = f":{width}" if n > 1 and width > 1 else ""
            text = f"n[{start + column}:{end if n > 1 else start + column + 1}{step}]"
            letter = f"_{'xyz'[column % 3]}" if width > 1 else ""
            names[text] = f"{name}_{column // 3}{letter}" if width > 3 else f"{name}{letter}"
            places |= {x.place: (Variable(text, n, False), k) for k, x in enumerate(rows[:, column])}
        start = end
    return places, names


def _leaves(machine: TensorMachine) -> Places:
    """Where the numbers of a pose, and given coordinates, are."""
    axes = "xyz"
    leaves = {x.place: (Variable(f"R_{axes[k // 3]}{axes[k % 3]}", 1, True), 0) for k, x in enumerate(machine.R)}
    leaves |= {x.place: (Variable(f"p_{axes[k]}", 1, True), 0) for k, x in enumerate(machine.p)}
    for name in ("actuators", "joints", "proximal"):
        numbers = getattr(machine, name)
        text = {"actuators": "actuators", "joints": "q", "proximal": "z"}[name]
        leaves |= {x.place: (Variable(text, len(numbers), True), k) for k, x in enumerate(numbers)}
    return leaves


def _walked(machine: TensorMachine, leaves: Places) -> str:
    pose, twists = machine.walked
    body = Body([*pose, *(x for row in twists for x in row)], leaves, machine.names, "q[0]", machine.size)
    R = [pose[3 * row : 3 * row + 3] for row in range(3)]
    lines = [*body.lines, f"R, p = {_stacked(body, R)}, {body.output(pose[9:])}"]
    lines.append(f"return R, p, {_stacked(body, twists)}")
    return _function("_walked(h, q)", "Rotation and position at joint coordinates, and the twist by each.", lines)


def _function(head: str, doc: str, lines: Sequence[str]) -> str:
    text = "\n".join(lines)
    axes, unpacked = "xyz", []
    if "R, p" in head:
        rows = ", ".join(f"({', '.join(f'R_{a}{b}' for b in axes)})" for a in axes)
        unpacked += [f"{rows} = R"] if re.search(r"\bR_[xyz]{2}\b", text) else []
        unpacked += ["p_x, p_y, p_z = p"] if re.search(r"\bp_[xyz]\b", text) else []
    return "\n    ".join([f"def {head}:", f'"""{doc}"""', *unpacked, *map(_broken, lines)])


def _broken(line: str) -> str:
    """A line, broken behind commas within brackets where it is long."""
    parts, depth, start = [], 0, 0
    for place, letter in enumerate(line):
        depth += (letter in "([") - (letter in ")]")
        if letter == "," and depth and line[place + 1 : place + 2] == " ":
            parts.append(line[start : place + 1])
            start = place + 2
    rows = [""]
    for part in (*parts, line[start:]):
        if rows[-1] and len(rows[-1]) + len(part) > WIDEST:
            rows.append("    ")
        rows[-1] += part if rows[-1].strip() == "" else f" {part}"
    return "\n    ".join(rows)


def _stacked(body: Body, columns: Sequence[Sequence[Any]], order: Sequence[int] | None = None) -> str:
    """The text of numbers by columns; of those in each, in an order of their own."""
    if not columns:
        return "None"
    rows = range(len(columns[0])) if order is None else order
    return "xp.stack((" + ", ".join(body.output([column[k] for k in rows]) for column in columns) + "), 0)"


def _named(variables: Sequence[str]) -> str:
    return ", ".join(f"{each}={each}" for each in variables)


# The top of a file


def _header(machine: TensorMachine, backend: str) -> str:
    """The comment at the top: units, coordinates, and the notice."""
    mechanism = machine.mechanism
    unit, library = mechanism.length_unit, LIBRARIES[backend]
    what = "poses (..., 4, 4)" if machine.path is None else f"joints {', '.join(machine.path.names)}, (..., n),"
    forward = "to_pose(actuators)" if machine.path is None else "to_joints(actuators)"
    argument = "target" if machine.path is None else "q"
    lines = [
        f"The kinematics of '{mechanism.name}' in {library}, written by pfabrik from its description.",
        "",
        f"Between {what} and actuators {', '.join(mechanism.actuator_names)}, (..., n_a):",
        f"    to_actuators({argument}), {forward}, jacobian({argument}), margin({argument})",
        *(["What the task leaves open of a pose is completed."] if machine.completes else []),
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
    mechanism, inner, path = machine.mechanism, machine.machine, machine.path
    yield f"ACTUATORS = {_words(mechanism.actuator_names)}"
    if path is not None:
        yield f"JOINTS = {_words(path.names)}"
    yield f"LIMITS = {_words(machine.limit_names)}"
    yield f"LENGTH_UNIT = {str(mechanism.length_unit)!a}"
    yield f"SIZE = {machine.size!r}  # a length of the machine, by which lengths are compared with angles"
    yield f"STEPS = {steps.forward}  # of Newton's method, for forward kinematics"
    if machine.completes:
        yield f"COMPLETING_STEPS = {steps.completing}  # for what the task leaves open"
    yield ""
    yield "DIMENSIONS = {"
    for name, values, of in machine.dimensions:
        if not of:
            yield f"    {name!r}: {_rows(values)!r},"
            continue
        yield f"    {name!r}: ("
        yield from (f"        {_rows(row)!r},  # {comment(each)}" for row, each in zip(values, of, strict=True))
        yield "    ),"
    yield "}"
    constants = [float(x) for _, numbers in machine.constants for x in numbers]
    yield f"_CONSTANTS = {tuple(constants)!r}  # of legs: sides, senses, bounds"
    yield f"N_OPEN = {len(machine.open_columns)}  # proximal joints without a motor"
    units = machine.rate_units
    yield f"RATE_UNITS = {_rows(units.tolist()) if (units != 1.0).any() else None!r}"
    if path is not None:
        yield f"JOINT_UNITS = {tuple(1.0 if is_angle else machine.size for is_angle in path.is_angle)!r}"
    else:
        yield f"N_MOTIONS = {3 if machine.is_point else 6}  # of the pose"
    if machine.completes:
        yield f"N_PROXIMAL = {len(machine.proximal)}"
        yield f"ROTATIONS = {inner.rotations}  # of the pose's three that the task sets"
        yield f"SET_AXES = {tuple(map(float, inner.axes))!r}  # 1: the task sets x, y, z"
    yield f"ACCURACY = {tensor_functions.ACCURACY!r}"
    yield f"CLOSED = {tensor_functions.CLOSED!r}"
    yield f"UNIT = {tensor_functions.UNIT!r}"


def _words(names: Sequence[str]) -> str:
    return "(" + "".join(f"{name!a}, " for name in names).rstrip() + ")"


def _rows(values: Any) -> Any:
    """Numbers, nested in tuples."""
    return tuple(map(_rows, values)) if isinstance(values, list) else values
