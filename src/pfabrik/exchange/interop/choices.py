"""Choices of base and end effector in a robot: what its loops could move, with which drives, in how many freedoms."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...common.arrays import Floats
from ...errors import InvalidArgument, PfabrikError, counted
from ...kinematics import column_joints, tree_of
from ...machine.description.contact import ContactType
from ...machine.description.graph import Edge, spanning_tree
from ...machine.description.home_mobility import body_twist
from ...machine.description.joints import Joint
from ...machine.description.mechanism import Mechanism
from ...machine.motion.loops import actuated_columns, first_order, present_screws, right_singular
from ...machine.motion.mobility import around_home
from ...tolerances import TOLERANCES
from .driving import candidates
from .opened import Loop
from .simplify import edges_between, loop_blocks

MOST_TRIED = 2
"""Most bodies of a part that are tried as its end effector: where its loops do not close, none does."""

MOST_WHOLE = 4
"""Most ends of the whole robot that are proposed beside the parts that loops hold together."""

Build = Callable[[str, str, Sequence[str] | None], Mechanism]
"""The mechanism from a base to an end effector, with named drives or those of the file."""


@dataclass(frozen=True)
class Moved:
    """A body that moves against the base: its freedoms, those left with all drives at rest, what drives move it.

    Attributes
    ----------
    body : str
        The body.
    freedoms : int
        Freedoms of the body.
    undriven : int
        Freedoms that are left with all drives at rest.
    actuators : tuple of str
        Drives that move it.
    """

    body: str
    freedoms: int
    undriven: int
    actuators: tuple[str, ...]

    def __str__(self) -> str:
        undriven = f" ({self.undriven} of them not driven)" if self.undriven else ""
        return f"{self.body}: {counted(self.freedoms, 'freedom')}{undriven}, moved by {', '.join(self.actuators)}"


@dataclass(frozen=True)
class Choice:
    """A part of a robot that is a mechanism.

    Attributes
    ----------
    base : str
        The body that rests.
    loops : tuple of str
        Names of the loops that it consists of; none of an open chain.
    end_effector : str or None
        A body that makes a mechanism, one that most drives move; None where none does.
    actuated : tuple of str or None
        Drives to name, where the file drives nothing here; else None.
    moved : tuple of Moved
        The bodies that move.
    refusal : str
        Why no mechanism was made of it; empty where one was.
    feet : mapping of str to str
        What it stands on, of a robot on its feet, and how that touches.
    """

    base: str
    loops: tuple[str, ...] = ()
    end_effector: str | None = None
    actuated: tuple[str, ...] | None = None
    moved: tuple[Moved, ...] = ()
    refusal: str = ""
    feet: Mapping[str, ContactType] = field(default_factory=dict)

    def __str__(self) -> str:
        if self.feet and not self.moved:
            return f"stands on {', '.join(self.feet)}:\n  {self.refusal}"
        if self.feet:
            drives = counted(len(self.moved[0].actuators), "drive")
            freedoms = counted(self.moved[0].freedoms, "freedom")
            return f"stands on {', '.join(self.feet)}:\n  {self.end_effector}: {freedoms} of {drives}"
        what = f"{counted(len(self.loops), 'loop')} ({', '.join(self.loops)})" if self.loops else "the whole way"
        return "\n".join([f"against '{self.base}', {what}:", *(f"  {each}" for each in self.moved or [self.refusal])])

    @property
    def options(self) -> list[str]:
        """The words of the command that makes a mechanism of it; none where there is no end effector."""
        if self.feet and self.end_effector:
            feet = (foot if touch == "point" else f"{foot}:{touch}" for foot, touch in self.feet.items())
            return ["--stand", ",".join(feet), "--body", self.end_effector]
        drives = ["--actuated", ",".join(self.actuated)] if self.actuated else []
        return ["--base", self.base, "--end-effector", self.end_effector, *drives] if self.end_effector else []


class NoEndEffector(InvalidArgument):
    """No end effector was given; carries the choices that there are.

    Attributes
    ----------
    choices : tuple of Choice
        The parts of the robot that are mechanisms.
    """

    def __init__(self, choices: Sequence[Choice]) -> None:
        self.choices = tuple(choices)
        ends = [
            f"'{each.end_effector}' against '{each.base}'" for each in choices if each.end_effector and not each.feet
        ]
        expected = f"what is to be moved (--end-effector), such as {', '.join(ends)}" if ends else "a body of the file"
        super().__init__("end_effector", "none", expected)


def choices_of(
    joints: Sequence[Joint], loops: Sequence[Loop], base: str, build: Build, unread: str = ""
) -> list[Choice]:
    """The parts of a robot that loops hold together, each against its body nearest to the base; then open ends.

    Parameters
    ----------
    joints, loops : between bodies of which those welded to each other are one.
    unread : what drives the robot and is not read, if anything is: no drives are made up in its place.
    """
    edges = edges_between(joints, loops)
    tree = spanning_tree(edges, base)
    blocks = loop_blocks(tree)
    degrees = {body: sum(body in edge.bodies for edge in edges) for body in tree.paths}
    depth = {body: int(np.count_nonzero(path)) for body, path in tree.paths.items()}
    found = []
    for block in blocks:
        inside = sorted(dict.fromkeys(body for index in block for body in edges[index].bodies), key=depth.__getitem__)
        names = tuple(edges[index].joint.name for index in block if index >= len(joints))
        ends = sorted(inside[1:], key=lambda body: (-degrees[body], -depth[body]))
        drivable = [edges[index].joint for index in block if index < len(joints)]
        found.append(_choice(inside[0], ends, drivable, names, build, unread))
    start = _start(edges, base, {index for block in blocks for index in block})
    ends = [each.end_effector for each in found if each.end_effector and each.base != start]
    ends += [body for body in tree.paths if degrees[body] == 1 and body not in (base, start)]
    ways = {end: {index for index, _ in tree.way(end)} for end in ends}
    last = [end for end in ways if not any(ways[end] < way for way in ways.values())]
    for end in sorted(last, key=lambda body: -depth[body])[:MOST_WHOLE]:
        found.append(_choice(start, [end], joints, (), build, unread))
    return [each for each in found if each.end_effector] or found


def _start(edges: Sequence[Edge], base: str, looped: set[int]) -> str:
    """The body behind what only lets the whole robot float: undriven joints, one behind the other, from the base."""
    seen: set[int] = set()
    while any(edge.joint.driven for edge in edges):
        around = [index for index, edge in enumerate(edges) if base in edge.bodies and index not in seen]
        if len(around) != 1 or around[0] in looped or edges[around[0]].joint.driven:
            break
        seen.add(around[0])
        base = edges[around[0]].other(base)
    return base


def _choice(
    base: str, ends: list[str], joints: Sequence[Joint], loops: tuple[str, ...], build: Build, unread: str
) -> Choice:
    """What bodies of a part are moved by, and those of them that make a mechanism as end effectors."""
    drives: tuple[str, ...] | None = None
    refusals = []
    for end in ends[:MOST_TRIED]:
        try:
            if not any(joint.driven for joint in joints):
                if unread:
                    return Choice(base, loops, refusal=f"driven by what is not read: {unread}")
                drives = enough_drives(base, end, joints, build)
            machine = build(base, end, drives)
            moved = {each.body: each for each in moved_bodies(machine) if each.freedoms and each.actuators}
            order = sorted((body for body in ends if body in moved), key=lambda body: -len(moved[body].actuators))
            best = next((body for body in order if body == end or build(base, body, drives)), None)
        except PfabrikError as error:
            refusals.append(f"'{end}' is refused: {str(error).splitlines()[0]}")
        else:
            remains = "" if order else "no drive moves any of its bodies"
            return Choice(base, loops, best, drives, tuple(moved[body] for body in order), remains)
    return Choice(base, loops, refusal=refusals[0] if refusals else "nothing moves")


def enough_drives(base: str, end: str, joints: Sequence[Joint], build: Build) -> tuple[str, ...]:
    """Joints that drive all of a part that has no drives, those at the base first; as many as it has freedoms."""
    known = [joint.name for joint in candidates(joints, base)]
    machine = build(base, end, known)
    motions = generic_motions(machine)[0][actuated_columns(machine)]
    drives: list[int] = []
    for place in range(len(motions)):
        if _rank(motions[[*drives, place]]) > len(drives):
            drives.append(place)
    names = [machine.actuator_names[place] for place in drives]
    return tuple(name if name in known else end for name in names)  # a joint called as its body gets another name


def moved_bodies(mechanism: Mechanism) -> Iterator[Moved]:
    """Every body but the base with its freedoms at generic configurations, and what moves it.

    An actuator moves a body that has more freedoms while this actuator moves and the others rest than with all at rest.
    """
    motions, screws = generic_motions(mechanism)
    drives, owners = motions[actuated_columns(mechanism)], column_joints(mechanism)
    resting, alone = _null_space(drives), np.linalg.pinv(drives, TOLERANCES.alignment)
    moves = np.diag(drives @ alone) > 1.0 - TOLERANCES.alignment  # else it rests where the others do
    alone = np.divide(alone, np.linalg.norm(alone, axis=0), where=moves, out=np.zeros_like(alone))
    for body, path in tree_of(mechanism).paths.items():
        twist = body_twist(path[owners], screws) @ motions
        at_rest, by_one = twist @ resting, (twist @ alone).T[:, :, None]
        undriven = _rank(at_rest)
        counts = [_rank(np.hstack([at_rest, one])) for one in by_one]
        by = [name for name, count in zip(mechanism.actuator_names, counts, strict=True) if count > undriven]
        yield Moved(body, _rank(twist), undriven, tuple(by))


def generic_motions(mechanism: Mechanism) -> tuple[Floats, Floats]:
    """Independent motions (c, k) of all joints at a generic configuration, and the screws (c, 6) there.

    Of configurations that are as good, home comes last: a chain that is straight has fewer freedoms.
    """
    q = around_home(mechanism)
    closure, _ = first_order(mechanism, q)
    place = max(reversed(range(len(q))), key=lambda row: _rank(closure[row]))
    return _null_space(closure[place]), present_screws(mechanism, q)[place]


def _null_space(matrix: Floats) -> Floats:
    return right_singular(matrix[None])[1][0, _rank(matrix) :].T


def _rank(matrix: Floats) -> int:
    return int(np.linalg.matrix_rank(matrix, TOLERANCES.alignment)) if matrix.size else 0
