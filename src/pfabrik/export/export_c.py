"""A mechanism's kinematics as one file of C99."""

from __future__ import annotations

import re
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Literal, TypeAlias, get_args

from ..checks import require_names
from ..description.mechanism import Mechanism, checked_mechanism
from ..errors import InvalidArgument, UnsupportedMechanism, counted
from ..whole_files import whole_path
from .machine_data import Machine
from .source import source
from .wording import Precision

Part: TypeAlias = Literal["ik", "limits", "fk"]
PARTS: tuple[Part, ...] = get_args(Part)
NAME = re.compile(r"[a-z][a-z0-9_]*", re.ASCII)


def export_c(
    mechanism: Mechanism,
    path: str | PathLike[str],
    *,
    precision: Precision = "double",
    parts: Sequence[Part] = PARTS,
    name: str = "pfk",
) -> Path:
    """Write a mechanism's kinematics as one file of C99, for a controller.

    The file takes no memory but the stack and keeps nothing between calls; it needs the C library's mathematics alone.
    Its comment tells the units and the numbers of limits and legs. Actuators, limits and poses are those of the
    library, in home's working mode; compiled with `PFK_SELF_TEST` defined it becomes a program that compares itself
    with the library's answers to 50 poses.

    Parameters
    ----------
    path : the file to write; whatever has this name is replaced, when the text is complete.
    precision : "double", or "float" for controllers without double precision in hardware.
    parts : "ik" from poses to actuators, completed where the task leaves something open; "limits" every limit, with the
        number of the one exceeded most; "fk" from actuators to the pose, by Newton's method from a start.
    name : what all names in the file begin with; lower-case letters, digits and underscores.

    Raises
    ------
    UnsupportedMechanism : some chain is no leg in closed form, or one that has no code here; the message says which,
        and why. Also where "fk" is asked for and the actuators leave the end effector free.
    InvalidArgument : a precision, part or name that there is not.
    """
    text = c_source(mechanism, precision=precision, parts=parts, name=name)
    with whole_path(path) as part:
        part.write_text(text, encoding="ascii")
    return Path(path)


def c_source(
    mechanism: Mechanism, *, precision: Precision = "double", parts: Sequence[Part] = PARTS, name: str = "pfk"
) -> str:
    """The text that `export_c` writes."""
    checked_mechanism(mechanism)
    if not isinstance(precision, str) or precision not in get_args(Precision):
        raise InvalidArgument("precision", repr(precision), "'double' or 'float'")
    if not (named := require_names("parts", parts)) or not set(named) <= set(PARTS):
        raise InvalidArgument("parts", repr(parts), f"some of {', '.join(map(repr, PARTS))}")
    if not isinstance(name, str) or not NAME.fullmatch(name):
        raise InvalidArgument("name", repr(name), "lower-case letters, digits and underscores, a letter first")
    machine = Machine(mechanism)
    if "fk" in parts and machine.uncontrolled:
        left = f"its actuators leave the end effector {counted(machine.uncontrolled, 'freedom')}: leave 'fk' out"
        raise UnsupportedMechanism(mechanism.name, [left], "exported")
    return source(machine, name, precision, parts)
