"""A rod between two bodies that are placed already: the joints at its ends, and where they put what lies between."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pfabrik import Joint, Mechanism
from pfabrik.description.home_mobility import universal_axes
from pfabrik.tolerances import TOLERANCES

from .turns import Array, Placed, aimed, anchored, is_parallel, shortest_turn

TIP = "(tip)"
"""The body that a joint end effector stands for."""


class NoClosedForm(Exception):
    """A mechanism whose legs, or what follows from its task, are not covered; the text says why."""


def require(fact: bool, otherwise: str) -> None:
    """Raise `NoClosedForm`, with what is the case otherwise, unless the fact holds."""
    if not fact:
        raise NoClosedForm(otherwise)


@dataclass(frozen=True, eq=False)
class Passage:
    """A joint passed outward, from the body `inner` to the body `outer`; `forward` if `inner` is its first body.

    `axes` are those of its hinges at home in the order in which they are passed; none of P and S.
    """

    joint: Joint
    inner: str
    outer: str
    forward: bool
    axes: tuple[Array, ...]

    @property
    def back(self) -> Passage:
        """The same joint, passed inward."""
        return Passage(self.joint, self.outer, self.inner, not self.forward, self.axes[::-1])

    @property
    def is_hinge(self) -> bool:
        return self.joint.type == "revolute"


def passage(mechanism: Mechanism, joint: Joint, inner: str, outer: str, forward: bool) -> Passage:
    """A joint passed outward."""
    axes: tuple[Array, ...] = ()
    if joint.type == "revolute":
        axes = (np.array(joint.axis),)
    elif joint.type == "universal":
        axes = tuple(universal_axes(mechanism, joint)[:: 1 if forward else -1])
    return Passage(joint, inner, outer, forward, axes)


@dataclass(frozen=True, eq=False)
class Rod:
    """A rigid rod, or a strut of variable length.

    Attributes
    ----------
    inner, outer : the joints at its two ends, outward: one each, or two hinges whose axes cross there.
    middle : its slide, and a hinge about its line, if it has them.
    base_end, platform_end : at home, (3,) [length].
    """

    inner: tuple[Passage, ...]
    middle: tuple[Passage, ...]
    outer: tuple[Passage, ...]
    base_end: Array
    platform_end: Array

    @property
    def passages(self) -> tuple[Passage, ...]:
        return self.inner + self.middle + self.outer

    @property
    def line(self) -> Array:
        """From base end to platform end at home, (3,) [length]."""
        return self.platform_end - self.base_end


def read_rod(mechanism: Mechanism, passages: Sequence[Passage]) -> Rod:
    """The rod that some joints make; `NoClosedForm` where they make none."""
    names, length = "-".join(each.joint.name for each in passages), mechanism.characteristic_length
    require(len(passages) >= 2, f"{names} is no rod")
    inner = _ending(mechanism, passages[:-1])
    outer = _ending(mechanism, [each.back for each in passages[: len(inner) - 1 : -1]])
    base_end, platform_end = _place(mechanism, inner), _place(mechanism, outer)
    are_hinges = all(len(ending) == 1 and ending[0].is_hinge for ending in (inner, outer))
    if are_hinges and np.linalg.norm(platform_end - base_end) <= TOLERANCES.position * length:
        # a hinge is wherever on its axis: these two cross, as in a spherical wrist
        base_end, platform_end = base_end + length * inner[0].axes[0], platform_end + length * outer[0].axes[0]
    middle = tuple(passages[len(inner) : len(passages) - len(outer)])
    rod = Rod(tuple(inner), middle, tuple(each.back for each in outer[::-1]), base_end, platform_end)
    for each in middle:
        along = rod.line / np.linalg.norm(rod.line)
        fits = each.joint.type == "revolute" or (each.joint.type == "prismatic" and each.joint.actuated)
        fits = fits and is_parallel(np.array(mechanism.home_axis(each.joint.name)), along, TOLERANCES.rotation)
        require(fits, f"{each.joint.name} is no drive along {names}")
    return rod


def _ending(mechanism: Mechanism, passages: Sequence[Passage]) -> Sequence[Passage]:
    """The joints at the beginning of a rod: one, or two hinges whose axes cross."""
    first = passages[0]
    require(first.joint.type in ("revolute", "universal", "spherical"), f"{first.joint.name} does not end a rod")
    crosses = len(passages) > 1 and first.is_hinge and passages[1].is_hinge
    return passages[: 2 if crosses and _crossing(mechanism, *passages[:2]) is not None else 1]


def _place(mechanism: Mechanism, ending: Sequence[Passage]) -> Array:
    """Where a rod ends, at home (3,): a point that its joints leave where it is on the bodies beyond them."""
    crossing = _crossing(mechanism, *ending) if len(ending) == 2 else None
    return np.array(ending[0].joint.at, dtype=float) if crossing is None else crossing


def _crossing(mechanism: Mechanism, first: Passage, second: Passage) -> Array | None:
    """Where the axes of two hinges cross, (3,), if they do."""
    (a,), (b,) = first.axes, second.axes
    if is_parallel(a, b):
        return None
    start, apart, normal = np.array(first.joint.at), np.subtract(second.joint.at, first.joint.at), np.cross(a, b)
    if abs(apart @ normal) > TOLERANCES.position * mechanism.characteristic_length * np.linalg.norm(normal):
        return None
    return np.asarray(start + a * (np.cross(apart, b) @ normal) / (normal @ normal))


def place_rod(rod: Rod, placed: dict[str, Placed]) -> None:
    """Place the bodies of a rod between its two ends, as its joints allow: whether they close is not asked.

    One solution, but for a universal joint (or two hinges that cross), whose second one, half a turn about either axis
    away, is not taken: see `aimed`. A rod between two balls is not turned about its line at all.
    """
    start, end = placed[rod.inner[0].inner], placed[rod.outer[-1].outer]
    base_end, platform_end = start.point(rod.base_end), end.point(rod.platform_end)
    line = platform_end - base_end
    below = _turned(rod.inner, start, rod.line, line)
    above = _turned([each.back for each in rod.outer[::-1]], end, rod.line, line)
    turn = below[-1] if below else above[-1] if above else _along(rod.line, line)
    for each, turned in zip(rod.inner[:-1], below, strict=False):
        placed[each.outer] = anchored(turned, rod.base_end, base_end)
    for each, turned in zip(rod.outer[:0:-1], above, strict=False):
        placed[each.inner] = anchored(turned, rod.platform_end, platform_end)
    placed[rod.inner[-1].outer] = anchored(turn, rod.base_end, base_end)
    has_slid = False
    for each in rod.middle:
        has_slid = has_slid or not each.is_hinge
        turn = above[-1] if above and each.is_hinge else turn  # which turns about the line
        place = (rod.platform_end, platform_end) if has_slid else (rod.base_end, base_end)
        placed[each.outer] = anchored(turn, *place)


def _turned(ending: Sequence[Passage], body: Placed, home: Array, line: Array) -> list[Array]:
    """Rotations (n, 3, 3) of the bodies beyond the joints at one end, one a joint; none beyond a ball or a tip."""
    axes = [axis for each in ending for axis in each.axes]
    if not axes or ending[0].inner == TIP:
        return []
    turns = aimed(axes, body.turn, home, line)
    return turns if len(ending) == 2 else turns[-1:]


def _along(home: Array, line: Array) -> Array:
    size, home = np.linalg.norm(line, axis=1)[:, None], home / np.linalg.norm(home)
    return shortest_turn(home, np.where(size > 0.0, line / np.where(size > 0.0, size, 1.0), home))
