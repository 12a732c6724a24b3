"""The names of what may be freed of a machine, by kind, with the values as described."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from ...common.printed import Printed, ResultTable
from ...common.printed import plain as shown
from ...errors import InvalidArgument, UnsupportedMechanism
from ...machine.description.mechanism import Mechanism
from ...tolerances import TOLERANCES
from .parameter_kinds import KINDS
from .parameters import Parameters, parameters


class FreeName(NamedTuple):
    """A parameter that may be freed: its kind, name, value as described and the unit of it."""

    kind: str
    name: str
    described: float
    unit: str


class FreeNames(Printed):
    """Names that `free` takes; made by `free_names`.

    Attributes
    ----------
    names : tuple of FreeName
        All of them, kind by kind.
    """

    def __init__(self, mechanism: Mechanism, names: Sequence[FreeName]) -> None:
        self.mechanism, self.names = mechanism, tuple(names)

    def table(self) -> ResultTable:
        """The names, a line each."""
        length = self.mechanism.characteristic_length
        rows = []
        for each in self.names:
            factor, unit = (math.degrees(1.0), "deg") if each.unit == "rad" else (1.0, each.unit)
            value = shown(each.described * factor, TOLERANCES.implied * max(factor, length), ".9g")
            rows.append((each.kind, each.name, value, unit))
        return ResultTable(self.mechanism.name, (), ("kind", "parameter", "described", "unit"), rows)

    def to_dict(self) -> dict[str, Any]:
        """The names as plain values, ready for JSON."""
        return {"free": [each._asdict() for each in self.names]}


def free_names(machines: Sequence[Mechanism]) -> FreeNames:
    """What may be freed of a machine: its dimensions, and all parameters of the kinds that it has.

    Parameters
    ----------
    machines : the machine, or several with the same dimensions, of which the last has the other kinds.
    """
    dimensions = _of_kind(machines[0], "dimensions")
    return FreeNames(machines[0], [*dimensions, *(name for kind in KINDS for name in _of_kind(machines[-1], kind))])


def _of_kind(mechanism: Mechanism, kind: str) -> Iterator[FreeName]:
    """The names of a kind; none where the machine has none."""
    try:
        own: Parameters = parameters(mechanism, kind)
    except (InvalidArgument, UnsupportedMechanism):
        return
    for name, value, unit in zip(own.names, own.values.tolist(), own.units, strict=True):
        yield FreeName(kind, name, value, unit)
