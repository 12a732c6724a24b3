"""A rod between two bodies that are placed already: the joints at its ends, and where they put what lies between."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pfabrik.description.home_mobility import universal_axes
from pfabrik.description.joints import Joint
from pfabrik.description.mechanism import Mechanism
from pfabrik.tolerances import TOLERANCES

from .facts import Array, is_parallel, require
from .turns import Placed, aimed, anchored, shortest_turn

TIP = "(tip)"
"""The body that a joint end effector stands for."""


@dataclass(frozen=True, eq=False)
class Passage:
    """A joint on the way outward, from the body `inner` to the body `outer`; welded bodies are one.

    Attributes
    ----------
    forward : whether `inner` is its first body.
    axes : of its hinges at home in the order in which they are passed; none of P and S.
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
        """Whether it is a revolute joint."""
        return self.joint.type == "revolute"


def passage(mechanism: Mechanism, joint: Joint, inner: str, outer: str, forward: bool) -> Passage:
    """A joint passed outward; `forward` if its second body is the outer one."""
    axes: tuple[Array, ...] = ()
    if joint.type in ("revolute", "cylindrical"):
        axes = (np.array(joint.axis),)
    elif joint.type == "universal":
        axes = tuple(universal_axes(mechanism, joint)[:: 1 if forward else -1])
    return Passage(joint, inner, outer, forward, axes)


@dataclass(frozen=True, eq=False)
class Rod:
    """A rod, rigid or a strut of variable length, from its foot on the body `start` to its head on the body `end`.

    Attributes
    ----------
    inner, outer : the joints at the foot and at the head, outward: one, or two hinges whose axes cross there.
    middle : joints about or along the line from foot to head.
    foot, head : at home, (3,) [length].
    """

    inner: tuple[Passage, ...]
    middle: tuple[Passage, ...]
    outer: tuple[Passage, ...]
    foot: Array
    head: Array

    @property
    def passages(self) -> tuple[Passage, ...]:
        """All its joints, from the base outward."""
        return self.inner + self.middle + self.outer

    @property
    def start(self) -> str:
        """The body it stands on."""
        return self.passages[0].inner

    @property
    def end(self) -> str:
        """The body it carries."""
        return self.passages[-1].outer

    @property
    def line(self) -> Array:
        """From foot to head at home, (3,) [length]."""
        return self.head - self.foot

    @property
    def slides(self) -> tuple[Passage, ...]:
        """Its prismatic joints."""
        return tuple(each for each in self.middle if each.joint.type == "prismatic")

    @property
    def twists(self) -> bool:
        """Whether a joint lets one part of it turn in the other, about its line."""
        return any(each.axes for each in self.middle)

    @property
    def holds_below(self) -> bool:
        """Whether the foot's joints alone tell how it is turned."""
        return bool(_axes(self.inner))

    @property
    def holds_above(self) -> bool:
        """Whether the head's joints do."""
        return self.end != TIP and bool(_axes(self.outer))

    @property
    def spinning(self) -> frozenset[str]:
        """Bodies whose turn about the rod's line is nobody's to say."""
        parts = [each.outer for each in (*self.inner[-1:], *self.middle)]
        twist = next((place for place, each in enumerate(self.middle) if each.axes), len(parts))
        held_below, held_above = self.holds_below, self.holds_above
        if not self.twists:
            held_below = held_above = held_below or held_above
        below, above = parts[: twist + 1], parts[twist + 1 :]
        return frozenset((() if held_below else tuple(below)) + (() if held_above else tuple(above)))


def read_rod(mechanism: Mechanism, passages: Sequence[Passage]) -> Rod:
    """The rod that some joints make; `Unsuitable` where they do not, as exactly as it will have to close."""
    names = "-".join(each.joint.name for each in passages)
    require(len(passages) >= 2, f"{names} is no rod")
    inner = _ending(mechanism, passages[:-1])
    outer = _ending(mechanism, [each.back for each in passages[: len(inner) - 1 : -1]])
    foot, head = _place(mechanism, inner), _place(mechanism, outer)
    near = TOLERANCES.position * mechanism.characteristic_length
    if np.linalg.norm(head - foot) <= near and all(
        len(ending) == 1 and ending[0].is_hinge for ending in (inner, outer)
    ):
        # a hinge is wherever on its axis: these two cross, as in a spherical wrist
        foot, head = (
            place + mechanism.characteristic_length * each[0].axes[0] for place, each in ((foot, inner), (head, outer))
        )
    middle = tuple(passages[len(inner) : len(passages) - len(outer)])
    rod = Rod(tuple(inner), middle, tuple(each.back for each in outer[::-1]), foot, head)
    length = float(np.linalg.norm(rod.line))
    require(length > TOLERANCES.alignment * mechanism.characteristic_length, f"{names} has no length at home")
    for each in middle:
        require(each.joint.type in ("prismatic", "revolute"), f"{each.joint.name} is neither at an end of {names}")
        axis = np.array(mechanism.home_axis(each.joint.name))
        straight = is_parallel(axis, rod.line / length, TOLERANCES.rotation)
        require(straight, f"{each.joint.name} does not point along {names}")
    for ending in (rod.inner, [each.back for each in rod.outer[::-1]]):
        last = _axes(ending)[-1:]
        require(not any(is_parallel(axis, rod.line / length) for axis in last), f"{names} only spins on its end")
    return rod


def _ending(mechanism: Mechanism, passages: Sequence[Passage]) -> Sequence[Passage]:
    """The joints at the beginning of a rod: one, or two hinges whose axes cross."""
    first = passages[0]
    require(first.joint.type in ("revolute", "universal", "spherical"), f"{first.joint.name} does not end a rod")
    if len(passages) > 1 and first.is_hinge and passages[1].is_hinge:
        place = _crossing(mechanism, first, passages[1])
        if place is not None:
            return passages[:2]
    return passages[:1]


def _place(mechanism: Mechanism, ending: Sequence[Passage]) -> Array:
    """Where a rod ends, at home (3,): a point that its joints leave where it is on the bodies beyond them."""
    if len(ending) == 2:
        place = _crossing(mechanism, *ending)
        assert place is not None
        return place
    return np.array(ending[0].joint.at, dtype=float)


def _crossing(mechanism: Mechanism, first: Passage, second: Passage) -> Array | None:
    """Where the axes of two hinges cross, (3,), if they do."""
    (a,), (b,) = first.axes, second.axes
    if is_parallel(a, b):
        return None
    start, apart = np.array(first.joint.at), np.subtract(second.joint.at, first.joint.at)  # type: ignore[arg-type]
    normal = np.cross(a, b)
    if abs(apart @ normal) > TOLERANCES.position * mechanism.characteristic_length * np.linalg.norm(normal):
        return None
    return np.asarray(start + a * (np.cross(apart, b) @ normal) / (normal @ normal))


def _axes(ending: Sequence[Passage]) -> tuple[Array, ...]:
    return tuple(axis for each in ending for axis in each.axes)


def place_rod(rod: Rod, placed: dict[str, Placed]) -> None:
    """Place the bodies of a rod between its two ends, as its joints allow: whether they close is not asked.

    One solution, but for a universal joint (or two hinges that cross), whose second one, half a turn about either axis
    away, is not taken: see `aimed`. A rod between two balls is not turned about its line at all.
    """
    start, end = placed[rod.start], placed[rod.end]
    foot, head = start.point(rod.foot), end.point(rod.head)
    line, twist = head - foot, next((k for k, each in enumerate(rod.middle) if each.axes), len(rod.middle))
    below = _turned(rod.inner, start, rod.line, line) if rod.holds_below else []
    above = _turned([each.back for each in rod.outer[::-1]], end, rod.line, line) if rod.holds_above else []
    turn = below[-1] if below else above[-1] if above else _along(rod.line, line)
    for each, turned in zip(rod.inner[:-1], below, strict=False):
        placed[each.outer] = anchored(turned, rod.foot, foot)
    for each, turned in zip(rod.outer[:0:-1], above, strict=False):
        placed[each.inner] = anchored(turned, rod.head, head)
    lengthens = False
    placed[rod.inner[-1].outer] = anchored(turn, rod.foot, foot)
    for k, each in enumerate(rod.middle):
        lengthens = lengthens or each.joint.type == "prismatic"
        own = above[-1] if above and k >= twist else turn
        placed[each.outer] = anchored(own, rod.head, head) if lengthens else anchored(own, rod.foot, foot)


def _turned(ending: Sequence[Passage], body: Placed, home: Array, line: Array) -> list[Array]:
    """Rotations (n, 3, 3) of the bodies beyond the joints at one end, one a joint."""
    turns = aimed(_axes(ending), body.turn, home, line)
    return turns if len(ending) == 2 else turns[-1:]


def _along(home: Array, line: Array) -> Array:
    size = np.linalg.norm(line, axis=1)[:, None]
    home = home / np.linalg.norm(home)
    return shortest_turn(home, np.where(size > 0.0, line / np.where(size > 0.0, size, 1.0), home))
