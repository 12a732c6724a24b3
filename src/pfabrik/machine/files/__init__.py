"""Mechanism files: TOML text to a mechanism and back, with every fault of a file reported in one go."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path
from typing import Any

from ...common.whole_files import whole_path
from ...errors import InvalidArgument, InvalidMechanism, UnknownName
from ..catalog import catalog, catalog_file
from ..description.form_faults import shown
from ..description.mechanism import Mechanism, checked_mechanism
from .printers import are_settings, print_region, printer_table
from .printers.print_region import PrintRegion
from .reading import read_mechanism
from .texts import LARGEST_FILE, refuse_large, text_of, unusable
from .writing import dumps

__all__ = ["LARGEST_FILE", "dumps", "load", "loads", "print_region_of", "printer_settings_of", "save"]

MOST_DOTS = 200
"""Most dots in one line: no line needs more than a few, and a key of many parts takes the parser quadratic time."""


def load(source: str | os.PathLike[str]) -> Mechanism:
    """The mechanism of a file.

    Parameters
    ----------
    source : str or PathLike
        A catalogue name (a text equal to one of `catalog()`), or the path of a mechanism file, or of the settings of a
        delta printer: Klipper's `printer.cfg`, RepRapFirmware's `config.g`, Marlin's `Configuration.h`.

    Raises
    ------
    UnknownName
        Neither a file nor a catalogue name.
    InvalidMechanism
        The file does not describe a mechanism; carries every fault found.
    """
    if isinstance(source, str) and source in catalog():
        return loads(catalog_file(source).read_text(encoding="utf-8"), source)
    if not isinstance(source, str | os.PathLike):
        raise InvalidArgument("source", shown(source), "a path or a catalogue name")
    path = Path(source)
    if not os.path.exists(path):  # unlike Path.exists, it also answers for paths that no system could have
        raise UnknownName("mechanism file or catalogue name", str(path), catalog())
    try:
        return read_mechanism(_parsed(text_of(path), path.parent), path.parent)
    except InvalidMechanism as error:
        raise InvalidMechanism(error.faults, str(path)) from None


def loads(text: str, source: str | None = None) -> Mechanism:
    """The mechanism that a text in the format of a mechanism file describes.

    Parameters
    ----------
    source : what to call the text in an error, usually the name of its file.

    Raises
    ------
    InvalidMechanism : the text does not describe a mechanism; carries every fault found.
    """
    if not isinstance(text, str):
        raise InvalidArgument("text", shown(text), "the text of a mechanism file")
    try:
        return read_mechanism(_parsed(text))
    except InvalidMechanism as error:
        raise InvalidMechanism(error.faults, source) from None


def print_region_of(source: str) -> PrintRegion | None:
    """What a printer's settings say beside the machine that `load` makes of them; None of any other source."""
    text = printer_settings_of(source)
    return None if text is None else print_region(text, Path(source).parent)


def printer_settings_of(source: str) -> str | None:
    """The text of a printer's settings; None of any other source."""
    if source in catalog() or not os.path.isfile(source):
        return None
    text = text_of(Path(source))
    try:
        if tomllib.loads(text):
            return None
    except (RecursionError, ValueError):
        pass
    return text if are_settings(text) else None


def save(mechanism: Mechanism, path: str | os.PathLike[str]) -> None:
    """Write a mechanism to a file that `load` turns into an equal one.

    The file is replaced as a whole or not at all. Copies, shorthands and expressions of the file that the mechanism
    came from are kept if that has dimensions. Paths of meshes are written relative to the folder of the new file.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    path : str or PathLike
        The file to write.
    """
    checked_mechanism(mechanism)
    with whole_path(path) as part:
        part.write_bytes(dumps(mechanism, Path(path).parent).encode())


FORMATS = {
    "<mujoco": "a MuJoCo model (MJCF)",
    "<robot": "a robot description (URDF)",
    "<sdf": "a model in SDF",
    "<": "XML",
}
"""Tags by which files of other programs are recognised."""


def _parsed(text: str, folder: Path | None = None) -> dict[str, Any]:
    """The table of a text in TOML, or of the settings of a printer, with the folder of files that these include."""
    refuse_large(text)
    if text.lstrip().startswith("<"):
        form = next(name for tag, name in FORMATS.items() if tag in text)
        hint = ", or `pfabrik import` to make one of it" if form != FORMATS["<"] else ""
        raise unusable(form, f"a mechanism file (TOML), as `pfabrik new` writes{hint}")
    try:
        if max((line.count(".") for line in text.split("\n") if not line.startswith("#")), default=0) > MOST_DOTS:
            raise RecursionError
        return tomllib.loads(text) or printer_table(text, folder) or {}
    except InvalidMechanism:
        raise
    except (RecursionError, ValueError) as error:  # a syntax error with its place, or a number of too many digits
        table = printer_table(text, folder)
        if table is not None:
            return table
        if isinstance(error, RecursionError):
            raise unusable("values nested too deeply", "tables and lists a few levels deep") from None
        raise unusable(f"no TOML: {error}", "TOML") from None
