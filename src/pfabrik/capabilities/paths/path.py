"""A path that was read."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from ...common.arrays import Floats, Ints
from ...machine.poses import between

MOST_STEPS = 1_000_000
"""Steps of a path that is held whole, at most."""

BLOCK = 4096
"""Steps that are read, answered and written at a time."""

AngleUnit: TypeAlias = Literal["deg", "rad"]


class Path(NamedTuple):
    """Targets in their order.

    Attributes
    ----------
    targets : array (n, 4, 4)
        The targets [length].
    times : array (n,) or None
        Times of the targets [s], as given or from the feeds; None unless every step has one.
    feeds : array (n,)
        Speed of the reference point toward each target [length/s], or of turning where it does not move [deg/s];
        infinite in rapid moves, NaN where not given.
    lines : list of int
        Line of the file that each comes from, counted from 1.
    others : mapping of str to sequence of str
        Further columns by name, the cells as they were, n each.
    angle_units : tuple of str
        Units of roll, pitch and yaw, as the file has them.
    passed : mapping of str to int
        What a program has that moves nothing of the path as it is here, levelling and macros, and the line where it is
        first.
    dwells : array (n,) or None
        Time at rest before each target, which is where the one before it is [s]; None where there is none.
    by_joints : bool
        True if the targets follow from columns of joints, whose poses have what the task leaves out as well.
    """

    targets: Floats
    times: Floats | None
    feeds: Floats
    lines: list[int]
    others: Mapping[str, Sequence[str]]
    angle_units: tuple[AngleUnit, AngleUnit, AngleUnit]
    passed: Mapping[str, int] = MappingProxyType({})
    dwells: Floats | None = None
    by_joints: bool = False

    @classmethod
    def of(cls, targets: Floats) -> Path:
        """A path with targets only: no times, feeds or further columns."""
        count = len(targets)
        return cls(targets, None, np.full(count, np.nan), list(range(1, count + 1)), {}, ("deg", "deg", "deg"))

    def at(self, ends: Ints, shares: Floats) -> Path:
        """Points (k,) on the way to the steps `ends`, each at a share (k,) of the way from the step before; feeds and
        cells are those of the step that it leads to."""
        begins = np.maximum(ends - 1, 0)
        chosen = ends.tolist()
        times = self.times
        if times is not None:
            times = times[begins] + shares * (times[ends] - times[begins])
        return self._replace(
            targets=between(self.targets[begins], self.targets[ends], shares[:, None, None]),
            times=times,
            feeds=self.feeds[ends],
            dwells=None,
            lines=[self.lines[end] for end in chosen],
            others={name: [cells[end] for end in chosen] for name, cells in self.others.items()},
        )

    def after(self, first: int) -> Path:
        """The steps from row `first` on."""
        return self._replace(
            targets=self.targets[first:],
            times=None if self.times is None else self.times[first:],
            feeds=self.feeds[first:],
            dwells=None if self.dwells is None else self.dwells[first:],
            lines=self.lines[first:],
            others={name: cells[first:] for name, cells in self.others.items()},
        )


def joined(blocks: Iterable[Path]) -> Path:
    """Parts of a path as one."""
    parts = list(blocks)
    first = parts[0]
    times = None if first.times is None else np.concatenate([each.times for each in parts if each.times is not None])
    dwells = [each.dwells for each in parts if each.dwells is not None]
    return first._replace(
        targets=np.concatenate([each.targets for each in parts]),
        times=times,
        feeds=np.concatenate([each.feeds for each in parts]),
        lines=[line for each in parts for line in each.lines],
        others={name: [cell for each in parts for cell in each.others[name]] for name in first.others},
        passed=parts[-1].passed,
        dwells=np.concatenate(dwells) if dwells else None,
    )
