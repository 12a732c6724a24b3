"""Tables as aligned text, neither cut nor coloured, for a terminal, a pipe or a file."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from ..tolerances import TOLERANCES


def aligned(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """The rows under their header, columns two spaces apart; columns of numbers are aligned to the right."""
    body = [tuple(map(str, row)) for row in rows]
    columns = list(zip(header, *body, strict=True))
    padded = [pad(column) for column in columns]
    return "\n".join("  ".join(cells).rstrip() for cells in zip(*padded, strict=True))


def pad(column: Sequence[str]) -> list[str]:
    """All cells of a column (its header first) at one width."""
    width = max(map(len, column))
    numeric = len(column) > 1 and all(starts_like_a_number(cell) for cell in column[1:])
    return [cell.rjust(width) if numeric else cell.ljust(width) for cell in column]


def starts_like_a_number(cell: str) -> bool:
    """True if a cell is a number, perhaps with a unit; ``-`` stands for a missing one."""
    head = cell.split(" ")[0]
    try:
        float(head)
    except ValueError:
        return head in ("", "-")
    return True


def plain(value: float, smallest: float, form: str = ".6g") -> str:
    """A number with six digits, or as `form` says; 0 if its magnitude is not above `smallest`."""
    return "0" if abs(value) <= smallest else format(value, form)


def error_text(value: float, form: str, scale: float = 1.0) -> str:
    """An error as a number, or ``< 1e-12`` where it is rounding, whose digits differ between processors.

    Parameters
    ----------
    scale : size of what is computed, in the unit of `value`: rounding leaves a share of it.
    """
    least = 10.0 ** math.ceil(math.log10(TOLERANCES.implied * scale) - 1e-9)
    return f"< {least:g}" if abs(value) < least else format(value, form)
