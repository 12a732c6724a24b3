"""Delta printers from the files of their firmwares, as tables of mechanism files: Klipper, RepRapFirmware, Marlin."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from .klipper import BEGIN, klipper_region, klipper_table
from .m_codes import m_codes_region, m_codes_table
from .marlin import marlin_region, marlin_table
from .print_region import PrintRegion


class _Reader(NamedTuple):
    """What reads the files of a firmware, recognised by the beginning of a line."""

    begin: str
    table: Callable[[str, Path | None], dict[str, Any]]
    region: Callable[[str, Path | None], PrintRegion]


_READERS = (
    _Reader(BEGIN, klipper_table, klipper_region),
    _Reader(r"^[ \t]*#define[ \t]+[A-Z]", marlin_table, marlin_region),
    _Reader(r"^[^;\n]*\bM(665|666|669)\b|^[ \t]*[GM]\d+\b", m_codes_table, m_codes_region),
)


def printer_table(text: str, folder: Path | None) -> dict[str, Any] | None:
    """The machine of a printer's settings, as the table of a mechanism file; None for a text that is no such settings.

    Parameters
    ----------
    folder : of the file, where files that it includes are.

    Raises
    ------
    InvalidMechanism : a printer without closed loops, or settings that are missing or no numbers.
    """
    reader = _reader_of(text)
    return None if reader is None else reader.table(text, folder)


def print_region(text: str, folder: Path | None) -> PrintRegion | None:
    """What a printer's settings say beside the machine; None for a text that is no such settings."""
    reader = _reader_of(text)
    return None if reader is None else reader.region(text, folder)


def are_settings(text: str) -> bool:
    """True for the text of a printer's settings, whatever its kinematics are."""
    return _reader_of(text) is not None


def _reader_of(text: str) -> _Reader | None:
    return next((reader for reader in _READERS if re.search(reader.begin, text, re.MULTILINE)), None)
