"""Texts of files: read only where one could be a mechanism's, or a printer's."""

from __future__ import annotations

from pathlib import Path

from ...errors import Fault, InvalidMechanism

LARGEST_FILE = 1_000_000
"""Largest file read [bytes]: a hundred times any machine, and quickly refused when it is something else."""


def text_of(path: Path) -> str:
    """The text of a file that could be a mechanism file; a fault when it cannot be one."""
    if not path.is_file():
        raise unusable("a directory or device" if path.exists() else "no such file", "a mechanism file")
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
        refuse_large(content)
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise unusable(f"no UTF-8 text at byte {error.start}", "a text file in UTF-8") from None
    except OSError as error:
        raise unusable(f"a file that cannot be read ({error.strerror})", "a readable file") from None


def refuse_large(content: str | bytes) -> None:
    """Refuse a text that is too large."""
    if len(content) > LARGEST_FILE:
        raise unusable(f"more than {LARGEST_FILE} bytes", f"at most {LARGEST_FILE}")


def unusable(found: str, expected: str) -> InvalidMechanism:
    """The error of a file that is none."""
    return InvalidMechanism([Fault("file", found, expected)])
