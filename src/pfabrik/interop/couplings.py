"""Joints that follow others at a fixed ratio, and what remains of them between a base and an end effector."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from ..description.joint_types import KINDS
from ..description.joints import Joint
from ..errors import Fault, InvalidMechanism
from .opened import Note, OpenMechanism


@dataclass(frozen=True)
class Coupling:
    """A joint whose coordinate is a polynomial of another's.

    Attributes
    ----------
    factors : of 1, x, x^2, ... with x the leader's coordinate [rad and m].
    """

    follower: str
    leader: str
    factors: tuple[float, ...]

    @property
    def names(self) -> tuple[str, str]:
        return self.follower, self.leader

    @property
    def ratio(self) -> float | None:
        """How far the follower goes when its leader goes by one; None where that depends on where it is, or is 0."""
        is_plain = len(self.factors) > 1 and self.factors[1] != 0.0 and not any(self.factors[2:])
        return self.factors[1] if is_plain else None

    def renamed(self, old: str, new: str) -> Coupling:
        """With another name for one joint."""
        follower, leader = (new if name == old else name for name in self.names)
        return Coupling(follower, leader, self.factors)

    def __str__(self) -> str:
        terms = []
        for power, factor in enumerate(self.factors):
            if factor:
                by = {0: "", 1: f" {self.leader}"}.get(power, f" {self.leader}^{power}")
                terms.append(f"{factor:.6g}{by}")
        return f"{self.follower} = {' + '.join(terms) or '0'}"


def coupled(
    opened: OpenMechanism,
    joints: Sequence[Joint],
    couplings: Sequence[Coupling],
    chosen: Collection[str],
    told: list[Note],
) -> OpenMechanism:
    """A machine whose joints are driven by what drives the joints that they are coupled with.

    Of joints that are coupled one may be there: it is driven if any of them is. Where more are there, and move, a
    mechanism has no word for their ratio.

    Parameters
    ----------
    joints : of the whole robot [m and rad].
    chosen : joints that the caller has named as driven: if all that are coupled are, they are so many drives.

    Raises
    ------
    InvalidMechanism : joints that follow one another, with their ratio.
    """
    kept = {joint.name: joint for joint in opened.joints}
    every = {joint.name: joint for joint in joints if joint.type != "fixed"}
    left, faults = [], []
    for group in _groups(couplings, every):
        there = [name for name in group.slopes if name in kept]
        if not there:
            left += group.couplings
        elif len(there) == 1:
            kept[there[0]] = _led(kept[there[0]], [every[name] for name in group.slopes], group, told)
        elif set(there) <= set(chosen):
            told.append(Note(f"a coupling is left to who drives these, {_text(group.couplings)}", tuple(there)))
        else:
            faults += [_fault(there[0], other, group) for other in there[1:]]
    if faults:
        raise InvalidMechanism(faults)
    left += [each for each in couplings if not all(name in every for name in each.names)]
    if left:
        what = "couplings of joints that are held, or that do not matter to the end effector, are left out"
        told.append(Note(what, tuple(map(str, left))))
    return dataclasses.replace(opened, joints=tuple(kept.values()))


class _Group(NamedTuple):
    """Joints that are coupled, directly or through others.

    Attributes
    ----------
    slopes : joint -> how far it goes as the first one goes by one; None where that depends on where they are.
    """

    slopes: dict[str, float | None]
    couplings: list[Coupling]


def _groups(couplings: Sequence[Coupling], every: Collection[str]) -> list[_Group]:
    """Joints that are coupled with each other, among those that move."""
    groups: list[_Group] = []
    waiting = [each for each in couplings if all(name in every for name in each.names)]
    while waiting:
        group = _Group({waiting[0].leader: 1.0}, [])
        while own := [each for each in waiting if set(each.names) & set(group.slopes)]:
            each = own[0]
            waiting.remove(each)
            group.couplings.append(each)
            leads, follows = group.slopes.get(each.leader), group.slopes.get(each.follower)
            if each.follower not in group.slopes:
                group.slopes[each.follower] = None if each.ratio is None or leads is None else leads * each.ratio
            elif each.leader not in group.slopes:
                group.slopes[each.leader] = None if each.ratio is None or follows is None else follows / each.ratio
        groups.append(group)
    return groups


def _text(couplings: Iterable[Coupling]) -> str:
    return "; ".join(map(str, couplings))


def _fault(leader: str, follower: str, group: _Group) -> Fault:
    over, under = group.slopes[follower], group.slopes[leader]
    ratio = "at no fixed ratio" if over is None or under is None else f"at the ratio {over / under:.6g}"
    return Fault(
        f"joint '{follower}'",
        f"that it follows '{leader}' {ratio} ({_text(group.couplings)}), which a mechanism here cannot have",
        f"both among the actuated joints, as two drives that you couple (--actuated {leader},{follower},...); or one "
        f"of them held where it is (--fixed {follower})",
    )


def _led(own: Joint, group: list[Joint], coupled: _Group, told: list[Note]) -> Joint:
    """The one joint of a group that is there, driven if any of them is."""
    is_driven = any(joint.driven for joint in group)
    if own.driven or not (is_driven and KINDS[own.type].actuatable):
        told.append(Note(f"coupled with joints that are left out, {_text(coupled.couplings)}", (own.name,)))
        return own
    told.append(Note(f"driven through a coupling, {_text(coupled.couplings)}", (own.name,)))
    return dataclasses.replace(own, actuated=True)
