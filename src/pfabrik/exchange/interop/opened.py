"""A machine whose loops need not be closed yet: a tree of joints, and the loops that are to close."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from ...common.arguments import array
from ...common.arrays import Floats
from ...common.rotations import square_to
from ...errors import InvalidArgument
from ...machine.description.joints import Cone, Joint, Vector
from ...machine.description.structure import Structure
from ...tolerances import TOLERANCES
from .collision import NO_COLLISION, Collision
from .digits import Rounding
from .names import unique
from .notes import Note, note_names

LoopType = Literal["spherical", "revolute", "fixed"]
"""Joint types that may close a loop."""

CLOSING = re.compile(r"(closing_.+)_([12])")
"""The name of a frame that meets another: the loop's name, and which of its two sides it is."""


@dataclass(frozen=True, eq=False)
class Loop:
    """A joint that closes a loop, described on each of its two bodies, as long as they are apart.

    Attributes
    ----------
    name : str
        Name of the joint.
    type : {"spherical", "revolute", "fixed"}
        "spherical" where two points are to meet, "revolute" where also two axes are, "fixed" where two frames are.
    connects : tuple of str
        The two bodies.
    points : array (2, 3)
        The point on each body [length], in base coordinates, where the joints are at their home values.
    frames : array (2, 3, 3) or None
        The frame on each body, likewise; of a hinge, the third column is the axis. None for a ball.
    """

    name: str
    type: LoopType
    connects: tuple[str, str]
    points: ArrayLike
    frames: ArrayLike | None = None

    def __post_init__(self) -> None:
        place = f"loop '{self.name}'"
        if self.type not in get_args(LoopType):
            raise InvalidArgument(f"{place}: type", repr(self.type), f"one of {', '.join(get_args(LoopType))}")
        for name, shape in (("points", "2 3"), ("frames", "2 3 3"))[: 1 if self.type == "spherical" else 2]:
            value = array(f"{place}: {name}", getattr(self, name), shape).copy()
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    @property
    def at(self) -> Floats:
        """The point on each body, (2, 3) [length]."""
        return np.asarray(self.points)

    @property
    def turned(self) -> Floats:
        """The frame on each body, (2, 3, 3); of a ball, those of the base."""
        return np.asarray([np.eye(3), np.eye(3)] if self.frames is None else self.frames)


def frame_along(axis: Floats) -> Floats:
    """A frame (3, 3) whose third column is along an axis (3,) of any length but zero."""
    across = square_to(axis)[0]
    third = axis / np.linalg.norm(axis)
    return np.column_stack([across, np.cross(third, across), third])


@dataclass(frozen=True, eq=False)
class OpenMechanism:
    """A machine before its loops are closed by `assemble`.

    Attributes
    ----------
    name : str
        Name of the machine.
    joints : tuple of Joint
        A tree from the base, with the joints at their home values, in base coordinates.
    loops : tuple of Loop
        The joints that close it.
    end_effector : str
        A body, a joint or a loop.
    reference_point : array (3,) or None
        As in `Mechanism`.
    base, length_unit : str
        As in `Mechanism`.
    task : tuple of str or None
        As in `Mechanism`.
    cones : mapping of str to Cone
        Joint or loop -> the cone that limits it.
    roundings : mapping of str to Rounding
        Joint or loop -> how far its digits put it from what was meant, at most [length, rad]; those that are not named
        are as the worst of those that are. Empty where nothing is known.
    collision : Collision
        The collision geometry [length].
    is_asked : bool
        True if these roundings are asked for, and not read off the digits of a file.
    spans : mapping of str to tuple of str
        Slide -> the two joints or loops whose distance is its coordinate.
    """

    name: str
    joints: tuple[Joint, ...]
    loops: tuple[Loop, ...]
    end_effector: str
    reference_point: Vector | None = None
    base: str = "base"
    length_unit: str = "m"
    task: tuple[str, ...] | None = None
    cones: Mapping[str, Cone] = field(default_factory=dict)
    roundings: Mapping[str, Rounding] = field(default_factory=dict)
    collision: Collision = NO_COLLISION
    is_asked: bool = False
    spans: Mapping[str, tuple[str, str]] = field(default_factory=dict)

    def tree(self) -> Structure:
        """The joints alone, as a structure that can be moved."""
        bodies = {body for joint in self.joints for body in joint.connects}
        reference = (0.0, 0.0, 0.0) if self.reference_point is None else self.reference_point
        body = self.end_effector if self.end_effector in bodies else self.base
        return Structure(self.name, self.joints, body, reference, self.base, self.length_unit)


def loops_by_name(
    places: Mapping[str, tuple[str, Floats]], known: Sequence[Loop], taken: Iterable[str], notes: list[Note]
) -> list[Loop]:
    """The loops of frames called `closing_<name>_1` and `closing_<name>_2`, as drawings are exported; new ones only.

    They are balls, or hinges where there are frames of the same names with `_z` behind them, off along the axis.

    Parameters
    ----------
    places : frame -> its body, and the frame (4, 4).
    known : loops that the file describes otherwise, active or not.
    taken : names that loops must not have.
    """
    sides: dict[str, dict[str, str]] = {}
    for frame in places:
        match = CLOSING.fullmatch(frame)
        if match:
            sides.setdefault(match[1], {})[match[2]] = frame
    single = tuple(frame for pair in sides.values() if len(pair) == 1 for frame in pair.values())
    note_names(notes, "a closing frame without the other one closes no loop", single)
    names, loops = set(taken), []
    for name, pair in sides.items():
        if len(pair) == 2:
            loop = _loop_between(unique(name, names), (pair["1"], pair["2"]), places)
            loops += [] if any(_is_same(loop, other) for other in known) else [loop]
    for kind, plural in (("spherical", "balls"), ("revolute", "hinges")):
        of_kind = tuple(loop.name for loop in loops if loop.type == kind)
        note_names(notes, f"loops that closing frames tell of, as {plural}", of_kind)
    return loops


def _loop_between(name: str, frames: tuple[str, str], places: Mapping[str, tuple[str, Floats]]) -> Loop:
    """The loop of two frames: a hinge where both have another one along its axis, else a ball."""
    bodies = (places[frames[0]][0], places[frames[1]][0])
    points = np.array([places[frame][1][:3, 3] for frame in frames])
    ends = [places.get(f"{frame}_z", places[frame])[1][:3, 3] for frame in frames]
    axes = np.array(ends) - points
    if not np.linalg.norm(axes, axis=1).all():
        return Loop(name, "spherical", bodies, points)
    return Loop(name, "revolute", bodies, points, np.array([frame_along(axis) for axis in axes]))


def _is_same(loop: Loop, other: Loop) -> bool:
    """True if two loops join the same two bodies at the same place on each."""
    points = dict(zip(other.connects, other.at, strict=True))
    return set(points) == set(loop.connects) and all(
        np.linalg.norm(points[body] - point) <= TOLERANCES.file_gap
        for body, point in zip(loop.connects, loop.at, strict=True)
    )
