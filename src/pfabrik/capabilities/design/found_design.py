"""Result of `design`: dimensions, their proof, and the requirements that bind."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, cast, overload

import numpy as np

from ...common.arrays import Floats, as_plain
from ...common.drawing import Size, Theme, View, drawn
from ...common.printed import Printed, ResultTable
from ...common.rotations import to_rpy
from ...errors import InvalidArgument, counted
from ...machine.description.mechanism import Mechanism
from ...machine.files import save as save_mechanism
from ..certify.certificates import Certificate
from .poses_to_reach import PosesToReach

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Verdict = Literal["PROVED", "CHECKED", "OPEN", "NOT FOUND"]


class Binding(NamedTuple):
    """A requirement or bound that keeps a design from a smaller aim, or from being found.

    Attributes
    ----------
    requirement : str
        The requirement, or the bound of a dimension, in words.
    limit : str
        The limit, actuator or other part of it that binds; empty of a requirement without parts.
    pose : array (4, 4) or None
        The pose at which it does [length]; None of what has no poses.
    share : float
        Its share among all that bind, 0 to 1: by how much the aim falls if it is eased.
    """

    requirement: str
    limit: str
    pose: Floats | None
    share: float


class DesignRound(NamedTuple):
    """One round of a search.

    Attributes
    ----------
    dimensions : mapping of str to float
        The dimensions that were the best for the poses so far.
    aim : float
        The aim.
    poses : int
        Number of poses that were looked at.
    verdict : str
        The outcome: "PROVED", "CHECKED", "REFUTED" or "OPEN".
    refuted_by : array (4, 4) or None
        The pose that is not reached, or does not keep a requirement [length].
    """

    dimensions: Mapping[str, float]
    aim: float
    poses: int
    verdict: str
    refuted_by: Floats | None


@dataclass(frozen=True, eq=False, repr=False)
class Design(Printed):
    """Dimensions for what a machine must do, as `design` returns them.

    Attributes
    ----------
    verdict : {"PROVED", "CHECKED", "OPEN", "NOT FOUND"}
        "PROVED": every pose of the region is reached within all limits, by the certificate. "CHECKED": every pose that
        was given is, by `solve_ik`. "OPEN": no pose is known that is not, but the proof has not ended. "NOT FOUND": the
        wishes contradict each other; `binding` names those that do.
    mechanism : Mechanism or None
        The machine with these dimensions; None if not found.
    dimensions : dict of str to float
        The dimensions, in the units of the file; if not found, those that break the wishes least.
    aim : float
        The aim; infinite where no machine was found at all.
    minimised : str
        The aim in words.
    certificate : Certificate or None
        Of a region or a track.
    unproved : tuple of str
        Requirements that samples decided.
    binding : tuple of Binding
        What binds, the most first.
    rounds : tuple of DesignRound
        The rounds of the search.
    front : tuple of Design
        With two aims, designs from the smallest of the first to the smallest of the second.
    other : float or None
        The second aim of a design of a front.
    reason : str
        Why nothing was found, or it is open; empty otherwise.
    """

    verdict: Verdict
    mechanism: Mechanism | None
    dimensions: dict[str, float]
    aim: float
    minimised: str
    certificate: Certificate | None
    unproved: tuple[str, ...]
    binding: tuple[Binding, ...]
    rounds: tuple[DesignRound, ...]
    reason: str = ""
    front: tuple[Design, ...] = ()
    other: float | None = None
    _bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    _name: str = ""
    _machine: Mechanism = field(kw_only=True)
    _reach: PosesToReach = field(kw_only=True)

    def __bool__(self) -> bool:
        """True if a machine was found that reaches all poses, proved or checked."""
        return self.verdict in ("PROVED", "CHECKED")

    def __repr__(self) -> str:
        sizes = ", ".join(f"{name} {value:.5g}" for name, value in list(self.dimensions.items())[:6])
        return f"<Design of '{self._name}': {self.verdict}, {self.minimised} {self.aim:.6g}: {sizes}>"

    def table(self) -> ResultTable:
        """The dimensions, and what binds them."""
        lines = [f"{self.verdict}  {self.minimised} {self.aim:.6g}, {counted(len(self.rounds), 'round')}"]
        if self.reason:
            lines.append(self.reason)
        rows = [
            (
                name,
                f"{self._machine.dimensions[name]:.6g}",
                f"{value:.6g}",
                *(f"{end:.6g}" for end in self._bounds[name]),
            )
            for name, value in self.dimensions.items()
        ]
        header = ("dimension", "before", "found" if self.mechanism else "least broken", "from", "to")
        held = [(each.requirement, each.limit, _in_words(each.pose), f"{each.share:.0%}") for each in self.binding]
        title = "binds" if self.mechanism else "stands against the others"
        more = [ResultTable("Binding", (), (title, "limit", "at", "share"), held)] if held else []
        remarks = [f"not proved, by samples: {', '.join(self.unproved)}"] if self.unproved and self.mechanism else []
        if self.front:
            ends = [(f"{each.aim:.6g}", f"{each.other:.6g}", each.verdict) for each in self.front]
            first, second = self.minimised.split(", ", 1)
            more.append(ResultTable("Front", (), (first, second, "verdict"), ends))
        return ResultTable(f"Design of {self._name}", lines, header, rows, remarks, more=more)

    def to_dict(self) -> dict[str, Any]:
        """Its fields as plain numbers, lists and texts, ready for JSON."""
        plain: dict[str, Any] = {
            "verdict": self.verdict,
            "dimensions": dict(self.dimensions),
            "minimised": self.minimised,
            "aim": self.aim if np.isfinite(self.aim) else None,
            "other": self.other,
            "unproved": list(self.unproved),
            "binding": [as_plain(each._asdict()) for each in self.binding],
            "rounds": [as_plain(each._asdict()) for each in self.rounds],
            "front": [each.to_dict() for each in self.front],
            "reason": self.reason,
        }
        return plain

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the machine with its dimensions; the file keeps expressions.

        Parameters
        ----------
        path : str or PathLike
            The file to write.
        """
        if self.mechanism is None:
            raise InvalidArgument("design", f"{self.verdict}: {self.reason}", "a design that was found")
        save_mechanism(self.mechanism, path)

    def plot(self, *, view: View | None = None, size: Size | None = None, theme: Theme = "light") -> Figure:
        """The machine before, and with the dimensions found, at home and at one scale, with what is to be reached.

        A region has dashed lines around its positions; its middle and corners, or the poses that were given, are
        orange where the machine does not reach them.

        Parameters
        ----------
        view : str or (float, float), optional
            As in `plot`.
        size : (float, float), optional
            Width and height of the figure [inches].
        theme : {"light", "dark"}, optional
            As in `plot`.

        Raises
        ------
        InvalidArgument
            No such view, size or theme.
        """
        return cast("Figure", drawn(self, view, size, theme))


class Designs(Printed, Sequence[Design]):
    """Designs of several machines, the smallest aim first; those without come last."""

    def __init__(self, designs: Sequence[Design]) -> None:
        self._designs = sorted(designs, key=lambda each: (not each, each.mechanism is None, each.aim))

    @overload
    def __getitem__(self, place: int) -> Design: ...

    @overload
    def __getitem__(self, place: slice) -> list[Design]: ...

    def __getitem__(self, place: int | slice) -> Design | list[Design]:
        return self._designs[place]

    def __len__(self) -> int:
        return len(self._designs)

    def __bool__(self) -> bool:
        """True if some machine was found."""
        return any(self._designs)

    def table(self) -> ResultTable:
        """The machines in order, each proved or why not."""
        rows = [
            (each._name, f"{each.aim:.6g}" if each.mechanism else "-", each.verdict, each.reason or "-")
            for each in self
        ]
        header = ("machine", self[0].minimised, "verdict", "reason")
        return ResultTable("Designs", [f"{sum(map(bool, self))} of {counted(len(self), 'machine')}"], header, rows)

    def to_dict(self) -> dict[str, Any]:
        """The designs in order, ready for JSON."""
        return {"designs": [each.to_dict() | {"machine": each._name} for each in self]}


def _in_words(pose: Floats | None) -> str:
    if pose is None:
        return "-"
    position = " ".join(f"{x:.4g}" for x in pose[:3, 3] + 0.0)
    turn = np.degrees(to_rpy(pose[:3, :3]))
    return position + (f", rpy {' '.join(f'{x:.3g}' for x in turn + 0.0)} deg" if np.abs(turn).max() > 1e-6 else "")
