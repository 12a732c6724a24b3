"""Joints that follow others at a fixed ratio, and what remains of them between a base and an end effector."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...errors import Fault, InvalidMechanism
from ...kinematics import columns, cycle_basis, rate_units
from ...machine.description.joints import KINDS, Joint
from ...machine.motion.loops import loop_slopes, right_singular
from ...tolerances import TOLERANCES
from .assembling import closed_structure
from .closed_home import close_home
from .closing import OpenLoops
from .notes import Note, note_names
from .opened import OpenMechanism

OFF_HOME = 0.1
"""Distance from home [rad or L] at which loops are asked what they hold: far from any singular home, within reach."""

SAME_ROW = 1e-4
"""Singular value, relative to the largest, below which a row of the loops follows from others, up to rounding."""


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
        """Motion of the follower per unit of its leader; None if it depends on the position, or is 0."""
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


def with_coupled_drives(
    opened: OpenMechanism,
    joints: Sequence[Joint],
    couplings: Sequence[Coupling],
    chosen: Collection[str],
    notes: list[Note],
) -> OpenMechanism:
    """A machine whose joints are driven by what drives the joints that they are coupled with.

    Of joints that are coupled one may be in the machine: it is driven if any of them is. Where more are, and move, a
    mechanism has no word for their ratio.

    Parameters
    ----------
    joints : of the whole robot [m and rad].
    chosen : joints that the caller has named as driven: if all that are coupled are, they are so many drives.

    Raises
    ------
    InvalidMechanism : joints that follow one another, with their ratio.
    """
    machine = {joint.name: joint for joint in opened.joints}
    moving = {joint.name: joint for joint in joints if joint.type != "fixed"}
    omitted, faults = [], []
    for group in _groups(couplings, moving):
        names = [name for name in group.slopes if name in machine]
        if not names:
            omitted += group.couplings
        elif len(names) == 1:
            machine[names[0]] = _coupled_joint(machine[names[0]], _is_driven(group, moving), group, notes)
        elif set(names) <= set(chosen):
            notes.append(Note(f"a coupling is left to who drives these, {_text(group.couplings)}", tuple(names)))
        else:
            leader = next((name for name in names if moving[name].driven), names[0])
            followers = [name for name in names if name != leader]
            held = _ratios_of_loops(opened, leader, followers)
            faults += [_fault(leader, name, group) for name in followers if name not in held]
            if held.keys() >= {*followers}:
                machine |= {name: dataclasses.replace(machine[name], actuated=False) for name in followers}
                if not machine[leader].driven:
                    machine[leader] = _coupled_joint(machine[leader], _is_driven(group, moving), group, notes)
                told = tuple(f"{name} by {held[name]:.6g} as {leader} by 1, near home" for name in followers)
                notes.append(Note(f"loops say how these follow, and count, not {_text(group.couplings)}", told))
    if faults:
        raise InvalidMechanism(faults)
    omitted += [each for each in couplings if not all(name in moving for name in each.names)]
    what = "couplings of joints that are held, or that do not matter to the end effector, are left out"
    note_names(notes, what, omitted)
    return dataclasses.replace(opened, joints=tuple(machine.values()))


class _Group(NamedTuple):
    """Joints that are coupled, directly or through others.

    Attributes
    ----------
    slopes : joint -> how far it goes as the first one goes by one; None where that depends on where they are.
    """

    slopes: dict[str, float | None]
    couplings: list[Coupling]


def _groups(couplings: Sequence[Coupling], moving: Collection[str]) -> list[_Group]:
    """Joints that are coupled with each other, among those that move."""
    groups: list[_Group] = []
    pending = [each for each in couplings if all(name in moving for name in each.names)]
    while pending:
        group = _Group({pending[0].leader: 1.0}, [])
        while coupling := next((each for each in pending if set(each.names) & set(group.slopes)), None):
            pending.remove(coupling)
            group.couplings.append(coupling)
            ratio, leader, follower = coupling.ratio, coupling.leader, coupling.follower
            if follower not in group.slopes:
                slope = group.slopes[leader]
                group.slopes[follower] = None if ratio is None or slope is None else slope * ratio
            elif leader not in group.slopes:
                slope = group.slopes[follower]
                group.slopes[leader] = None if ratio is None or slope is None else slope / ratio
        groups.append(group)
    return groups


def _is_driven(group: _Group, moving: Mapping[str, Joint]) -> bool:
    return any(moving[name].driven for name in group.slopes)


def _ratios_of_loops(opened: OpenMechanism, leader: str, names: Sequence[str]) -> dict[str, float]:
    """Of joints that move as loops make them once the leader's coordinate is given, how fast by that of the leader.

    Found where the leader is off home, for legs that are stretched out there may go either way.
    """
    if not opened.loops:
        return {}
    loops = OpenLoops(opened)
    place = {name: columns(loops.tree)[name].start for name in names}
    low, high, at = loops.low.copy(), loops.high.copy(), columns(loops.tree)[leader].start
    step = OFF_HOME * rate_units(loops.tree)[at]
    low[at] = high[at] = step if step <= high[at] else max(-step, low[at])
    home = close_home(loops, np.ones(len(low), bool), low, high)
    structure = closed_structure(opened, loops, home)
    sizes, directions = right_singular(loop_slopes(structure, np.zeros((1, len(structure.coordinates)))))
    free = directions[0, (sizes > SAME_ROW * sizes.max(initial=0.0)).sum() :]
    motions = cycle_basis(structure).rates.T @ free.T
    if home.gap > TOLERANCES.file_digits or not motions[at].any():
        return {}
    ratios = {name: motions[row] @ motions[at] / (motions[at] @ motions[at]) for name, row in place.items()}
    return {
        name: float(ratio)
        for name, ratio in ratios.items()
        if np.abs(motions[place[name]] - ratio * motions[at]).max() <= SAME_ROW
    }


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


def _coupled_joint(joint: Joint, is_driven: bool, group: _Group, notes: list[Note]) -> Joint:
    """The one joint of a group that is in the machine, driven if any of them is."""
    if joint.driven or not (is_driven and KINDS[joint.type].actuatable):
        notes.append(Note(f"coupled with joints that are left out, {_text(group.couplings)}", (joint.name,)))
        return joint
    notes.append(Note(f"driven through a coupling, {_text(group.couplings)}", (joint.name,)))
    return dataclasses.replace(joint, actuated=True)
