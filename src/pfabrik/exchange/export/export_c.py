"""A mechanism's kinematics as one file of C99."""

from __future__ import annotations

import re
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from shlex import quote
from typing import Literal, TypeAlias, get_args

from ...common.checks import require_choice, require_names, require_path, require_positive
from ...common.whole_files import whole_path
from ...errors import InvalidArgument, UnsupportedMechanism, counted
from ...machine.description.mechanism import Mechanism, checked_mechanism
from ...machine.motion.fitting_task import leaves_a_choice
from ...options import USUAL
from .driven_bodies import unplaced_masses
from .equal_rods import with_equal_rods
from .machine_data import Machine, fitting_path
from .source import source
from .static_data import Precision

Part: TypeAlias = Literal["ik", "limits", "fk", "rates", "nearest", "live", "bodies", "effort"]
PARTS: tuple[Part, ...] = get_args(Part)
_NAME = re.compile(r"[a-z][a-z0-9_]*", re.ASCII)


def export_c(
    mechanism: Mechanism,
    path: str | PathLike[str],
    *,
    precision: Precision = "double",
    parts: Sequence[Part] | None = None,
    name: str = "pfk",
    joints: str | Sequence[str] | None = None,
    hold_price: float = USUAL.hold_price,
) -> Path:
    """Write a mechanism's kinematics as a file of C99 with its header, for a controller.

    The file is the library's own kernels for this machine; it allocates nothing, and needs only the C library's
    mathematics. Its comment lists units, limits and legs. Actuators, limits and poses are those of the library, in
    home's working mode; compiled with `PFK_SELF_TEST` defined it becomes a program that compares itself with the
    library's answers to 50 poses.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    path : str or PathLike
        The file to write; its header has the same name with the ending ".h". Whatever has these names is replaced, when
        the text is complete.
    precision : {"double", "float"}, optional
        "float" is for controllers without double precision in hardware. Rods of a pair that differ by less than 1e-6
        of the characteristic length then count as equal; the file says which.
    parts : sequence of str, optional
        "ik" from poses to actuators, completed where the task leaves something open; "limits" every limit, with the
        number of the one exceeded most, and the clearance of a machine that has one: "ik" and "fk" then return the
        number of a pair of links that is too near; "fk" from actuators to the pose, by Newton's method from a start;
        "rates" the Jacobian, speeds of actuators, and torques of them and back; "nearest", with "ik" and "limits", the
        nearest feasible pose to a target out of reach; "live", with them too, ticks along a stream, as of `Live`;
        "bodies" where every body is at a pose, for pictures;
        "effort" the forces of the actuators in motion, of a machine with masses. By default all but "bodies" and
        "effort", and without "nearest" where the machine has none.
    name : str, optional
        Prefix of all names in the file; lower-case letters, digits and underscores.
    joints : str or sequence of str, optional
        Names of joints in series from the base to the end effector: then there are functions of these too, and rates
        are by them.
    hold_price : float, optional
        Up to which the nearest poses hold the orientation, as in `Options`.

    Raises
    ------
    UnsupportedMechanism
        Some chain is no leg in closed form, or one that has no code here; the message says which, and why. Also where
        "fk" is asked for and the actuators leave the end effector free, or "ik" and the task leaves motions open that
        are a choice; and with "limits" and a clearance where the place of a link follows from no leg.
    InvalidArgument
        An unknown precision or part, or a name that is not allowed.
    """
    text = c_source(
        mechanism,
        precision=precision,
        parts=parts,
        name=name,
        joints=joints,
        hold_price=hold_price,
        file=require_path("path", path).name,
    )
    header = header_of(Path(path))
    declarations, definitions = in_two(text, header.name)
    with whole_path(path) as part, whole_path(header) as beside:
        part.write_text(definitions, encoding="ascii")
        beside.write_text(declarations, encoding="ascii")
    return Path(path)


def header_of(path: Path) -> Path:
    """The header beside a file."""
    if path.suffix == ".h":
        raise InvalidArgument("path", repr(path.name), "another ending than that of its header, .h")
    return path.with_suffix(".h")


def in_two(text: str, header: str) -> tuple[str, str]:
    """A header of the given name, and the file that includes it, of a text with both."""
    head, _, definitions = re.split(r"(?m)^#ifndef (\w+_DECLARATIONS_ONLY)\n", text, maxsplit=1)
    comment = head[: head.index("#ifndef")]
    return head.rstrip("\n") + "\n", f'{comment}#include "{header}"\n{definitions.rstrip().removesuffix("#endif")}'


def c_source(
    mechanism: Mechanism,
    *,
    precision: Precision = "double",
    parts: Sequence[Part] | None = None,
    name: str = "pfk",
    joints: str | Sequence[str] | None = None,
    hold_price: float = USUAL.hold_price,
    file: str = "FILE",
) -> str:
    """The text that `export_c` writes; `file` is the name in the command that compiles its self-test."""
    checked_mechanism(mechanism)
    require_choice("precision", precision, get_args(Precision))
    if parts is not None and not set(PARTS) >= set(require_names("parts", parts)) > set():
        raise InvalidArgument("parts", repr(parts), f"some of {', '.join(map(repr, PARTS))}")
    for part in ("nearest", "live"):
        if parts is not None and part in parts and not {"ik", "limits"} <= set(parts):
            raise InvalidArgument("parts", repr(parts), f"'ik' and 'limits' too, for '{part}' is made of them")
    require_identifier(name)
    require_positive("hold_price", hold_price)
    equal_rods: list[str] = []
    if precision == "float":
        mechanism, equal_rods = with_equal_rods(mechanism)
    machine = Machine(mechanism, hold_price, equal_rods)
    if parts is None:
        parts = parts_of(machine)
    reasons = {"nearest": machine.why_no_nearest, "live": machine.why_no_live}
    for part in {*parts} & {part for part, reason in reasons.items() if reason}:
        reason = f"{reasons[part]}: leave '{part}' out of `parts` (--parts ik,limits,fk,rates)"
        raise UnsupportedMechanism(mechanism.name, [reason], "exported")
    if "effort" in parts and (unplaced := unplaced_masses(machine.mechanism, machine.bodies)):
        raise UnsupportedMechanism(mechanism.name, unplaced, "exported with 'effort'")
    if "fk" in parts and machine.uncontrolled:
        left = counted(machine.uncontrolled, "freedom")
        reason = f"its actuators leave the end effector {left}: leave 'fk' out of `parts` (--parts ik,limits,rates)"
        raise UnsupportedMechanism(mechanism.name, [reason], "exported")
    if "ik" in parts and machine.completes and machine.equations and leaves_a_choice(mechanism):
        task = " ".join(mechanism.task)
        reason = f"its task {task} leaves motions open that only the library chooses among: set them in `task`"
        reason = f"{reason}, or leave 'ik' out of `parts` (--parts limits,fk,rates)"
        raise UnsupportedMechanism(mechanism.name, [reason], "exported")
    path = None if joints is None else fitting_path(mechanism, joints)
    return source(machine, name, precision, parts, path, quote(file))


def parts_of(machine: Machine) -> list[Part]:
    """All parts of a machine's file but those that are named alone."""
    left_out = ("bodies", "effort", "live", *(["nearest"] if machine.why_no_nearest else []))
    return [part for part in PARTS if part not in left_out]


def require_identifier(name: object) -> None:
    """InvalidArgument for what cannot begin the names of functions and files."""
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise InvalidArgument("name", repr(name), "lower-case letters, digits and underscores, a letter first")
