"""Exceptions: they name the culprit, what was found and what was expected."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

__all__ = [
    "ContinuumOfSolutions",
    "ContinuumOfWorkingModes",
    "Fault",
    "InvalidArgument",
    "InvalidMechanism",
    "MissingLibrary",
    "MobilityWarning",
    "PfabrikError",
    "UnknownName",
    "UnsupportedMechanism",
]


def counted(number: int, noun: str) -> str:
    """So many of what a noun in the singular says: "1 row", "2 rows"."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def one_line(text: str, most: int = 300) -> str:
    """A text as part of a sentence: on one line, cut off where it is longer than any that means something."""
    line = " ".join(text.split())
    return line if len(line) <= most else f"{line[:most]}…"


def near_miss(name: str, known: Iterable[str], likeness: float = 0.6) -> str:
    """``"; did you mean 'platform'?"`` when a known name is close to `name`, else an empty string.

    Parameters
    ----------
    likeness : least share of the two names that are the same letters in the same order.
    """
    close = difflib.get_close_matches(str(name), list(known), n=1, cutoff=likeness)
    return f"; did you mean '{close[0]}'?" if close else ""


class PfabrikError(Exception):
    """Root of every error this library raises on purpose."""

    def __reduce__(self) -> tuple[Any, ...]:
        """For copies and other processes: the text and the attributes as they are, not put together again."""
        return _as_it_was, (type(self), self.args), self.__dict__


def _as_it_was(kind: type[PfabrikError], args: tuple[Any, ...]) -> PfabrikError:
    """An error with these texts; its attributes follow."""
    return kind.__new__(kind, *args)


class MobilityWarning(UserWarning):
    """A valid description that may not be the intended one, by its mobility at home.

    Its actuators, locked, leave the end effector freedoms; or its loops hold the end effector, or all but lock.
    """


@dataclass(frozen=True)
class Fault:
    """One thing wrong with a description: where, what was found there, what was expected.

    Attributes
    ----------
    place : str
        Where in the description.
    found : str
        What was found there.
    expected : str
        What was expected.
    """

    place: str
    found: str
    expected: str

    def __str__(self) -> str:
        return f"{self.place}: found {self.found}; expected {self.expected}"


class InvalidMechanism(PfabrikError, ValueError):
    """A description that does not make a mechanism; carries every fault found, not only the first.

    Attributes
    ----------
    faults : tuple of Fault
        The faults, in the order of the description.
    source : str or None
        The file they were found in, or None for a mechanism built in Python.
    """

    def __init__(self, faults: Sequence[Fault], source: str | None = None) -> None:
        self.faults = tuple(faults)
        self.source = source
        prefix = f"{source}: " if source else ""
        super().__init__("\n".join(f"{prefix}{fault}" for fault in self.faults))


class UnsupportedMechanism(PfabrikError, ValueError):
    """A valid mechanism that no engine of this version can solve; names the sub-chain and the reason.

    Attributes
    ----------
    mechanism : str
        Its name.
    reasons : tuple of str
        The reasons, one for each sub-chain.
    """

    def __init__(self, mechanism: str, reasons: Sequence[str], purpose: str = "solved") -> None:
        self.mechanism = mechanism
        self.reasons = tuple(reasons)
        super().__init__(f"'{mechanism}' cannot be {purpose}: " + "; ".join(self.reasons))


class ContinuumOfSolutions(PfabrikError, ValueError):
    """The mechanism still moves with what was given: there are no single solutions to list.

    Attributes
    ----------
    mechanism : str
        Its name.
    freedoms : int
        Number of independent motions that are left.
    """

    def __init__(
        self,
        mechanism: str,
        freedoms: int,
        given: str = "its actuators locked at these values",
        moving: str = "the end effector",
    ) -> None:
        self.mechanism = mechanism
        self.freedoms = freedoms
        super().__init__(
            f"'{mechanism}' still moves with {given} ({freedoms} freedom{'s' if freedoms > 1 else ''} of {moving}): "
            "a continuum of solutions, none of which stands alone"
        )


class ContinuumOfWorkingModes(ContinuumOfSolutions):
    """With its end effector on the target, actuators still move: there are no single working modes to list.

    Attributes
    ----------
    mechanism : str
        Its name.
    freedoms : int
        Number of independent motions of the actuators.
    moving : tuple of str
        Names of the actuators that take part.
    """

    def __init__(self, mechanism: str, freedoms: int, moving: Iterable[str]) -> None:
        self.moving = tuple(moving)
        names = f"the actuators {', '.join(self.moving)}"
        super().__init__(mechanism, freedoms, "its end effector on the target", names)


class InvalidArgument(PfabrikError, ValueError):
    """A call with an argument of the wrong shape, type or value.

    Attributes
    ----------
    argument, found, expected : str
        The argument's name, and both sides of the disagreement, as text.
    rows : tuple of int
        Indices of the first offending rows of a batch, or an empty tuple.
    """

    def __init__(self, argument: str, found: str, expected: str, rows: Sequence[int] = ()) -> None:
        self.argument = argument
        self.found = one_line(found)  # arrays are shown on several lines
        self.expected = expected
        self.rows = tuple(rows)
        where = f" (first bad row{'s' * (len(self.rows) > 1)}: {', '.join(map(str, self.rows))})" if self.rows else ""
        super().__init__(f"{argument}: found {self.found}; expected {expected}{where}")


class UnknownName(PfabrikError, KeyError):
    """A name that is not known here; the alternatives are listed on `known`."""

    def __init__(self, kind: str, name: Any, known: Iterable[str]) -> None:
        self.kind = kind
        self.name = name if isinstance(name, str) else one_line(str(name))
        self.known = tuple(known)
        shown, others = one_line(self.name), ", ".join(self.known)
        self._text = f"no {kind} named '{shown}'{near_miss(shown, self.known)} (known: {others})"
        super().__init__(self._text)

    def __str__(self) -> str:
        return self._text


class MissingLibrary(PfabrikError, ImportError):
    """Something optional that is not installed; the message is the command that installs it.

    Attributes
    ----------
    what : str
        What needs it.
    library : str
        What is missing.
    command : str
        What installs it.
    """

    def __init__(self, what: str, library: str, command: str) -> None:
        self.what, self.library, self.command = what, library, command
        super().__init__(f"{what} need{'' if what.endswith('s') else 's'} {library}; install it with: {command}")
