"""Delta printers from the files of their firmwares, as tables of mechanism files: Klipper, RepRapFirmware, Marlin."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .klipper import klipper_table
from .m_codes import m_codes_table
from .marlin import marlin_table

_READERS: tuple[tuple[str, Callable[[str, Path | None], dict[str, Any]]], ...] = (
    (r"^\[(printer|stepper_\w+)\]", klipper_table),
    (r"^[ \t]*#define[ \t]+[A-Z]", marlin_table),
    (r"^[^;\n]*\bM(665|666|669)\b|^[ \t]*[GM]\d+\b", m_codes_table),
)
"""Beginnings of lines by which a firmware's file is recognised, and what reads it."""


def printer_table(text: str, folder: Path | None) -> dict[str, Any] | None:
    """The machine of a printer's settings, as the table of a mechanism file; None for a text that is no such settings.

    Parameters
    ----------
    folder : of the file, where files that it includes are.

    Raises
    ------
    InvalidMechanism : a printer without closed loops, or settings that are missing or no numbers.
    """
    reader = next((read for begin, read in _READERS if re.search(begin, text, re.MULTILINE)), None)
    return None if reader is None else reader(text, folder)
