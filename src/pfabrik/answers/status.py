"""The status of an answer."""

from __future__ import annotations

from enum import IntEnum

from ..kernels import rows

NUMBERS = tuple("bdoxXneEfFgG%")
"""Format types that write a status as a number."""


class Status(IntEnum):
    """The status of an answer; the largest of a batch is the worst.

    Attributes
    ----------
    REACHED : Status
        On the target, closed and within every limit.
    PROJECTED : Status
        Near the target, closed and within every limit; no configuration that reaches it was found, and where the answer
        is `certified` none exists.
    EXCEEDED : Status
        On the target and closed, but beyond a limit; `assembly_modes` and `working_modes` search for such.
    FAILED : Status
        No feasible configuration was found.
    INVALID : Status
        The target is no pose, or not finite; only if such rows are to be marked.
    """

    REACHED = rows.REACHED
    PROJECTED = rows.PROJECTED
    EXCEEDED = rows.EXCEEDED
    FAILED = rows.FAILED
    INVALID = rows.INVALID

    def __eq__(self, other: object) -> bool:
        """True for its number and for its name: ``solution.status == "REACHED"``."""
        return self.name == other if isinstance(other, str) else int(self) == other

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = IntEnum.__hash__

    def __str__(self) -> str:
        return self.name

    def __format__(self, spec: str) -> str:
        return format(int(self) if spec[-1:] in NUMBERS else self.name, spec)
