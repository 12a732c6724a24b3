"""What became of a target: one word."""

from __future__ import annotations

from enum import IntEnum

from ..kernels import rows

NUMBERS = tuple("bdoxXneEfFgG%")
"""Types of format specifications by which a status is written as the number it is."""


class Status(IntEnum):
    """What became of a target; the worst of a batch is the largest.

    REACHED : what was asked for, closed and within every limit.
    PROJECTED : closed and within every limit, near what was asked for.
    EXCEEDED : what was asked for, closed, but beyond a limit; only `assembly_modes` and `working_modes` look for such.
    FAILED : no feasible configuration was found.
    INVALID : what was asked for is no pose, or not finite; only where such rows are to be marked.
    """

    REACHED = rows.REACHED
    PROJECTED = rows.PROJECTED
    EXCEEDED = rows.EXCEEDED
    FAILED = rows.FAILED
    INVALID = rows.INVALID

    def __str__(self) -> str:
        return self.name

    def __format__(self, spec: str) -> str:
        return format(int(self) if spec[-1:] in NUMBERS else self.name, spec)
