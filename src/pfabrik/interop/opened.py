"""A machine whose loops need not be closed yet: a tree of joints, and the places at which bodies are to meet."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats
from ..description.joints import Cone, Joint, Vector
from ..description.structure import Structure
from ..errors import InvalidArgument, PfabrikError
from ..rotations import square_to
from .digits import Rounding

LoopType = Literal["spherical", "revolute", "fixed"]
ROWS: dict[LoopType, int] = {"spherical": 3, "revolute": 5, "fixed": 6}
"""What may close a loop, and how many conditions that is."""


@dataclass(frozen=True, eq=False)
class Loop:
    """A joint that closes a loop, described on each of its two bodies, as long as they are apart.

    Attributes
    ----------
    type : "spherical" where two points are to meet, "revolute" where also two axes are, "fixed" where two frames are.
    connects : the two bodies.
    points : the point on each, (2, 3) [length], in base coordinates, where the joints are at their home values.
    frames : the frame on each, (2, 3, 3), likewise; of a hinge, the third column is the axis. None for a ball.
    """

    name: str
    type: LoopType
    connects: tuple[str, str]
    points: ArrayLike
    frames: ArrayLike | None = None

    def __post_init__(self) -> None:
        place = f"loop '{self.name}'"
        if self.type not in ROWS:
            raise InvalidArgument(f"{place}: type", repr(self.type), f"one of {', '.join(ROWS)}")
        _set(self, "points", self.points, (2, 3), place)
        if self.type != "spherical":
            _set(self, "frames", self.frames, (2, 3, 3), place)

    @property
    def at(self) -> Floats:
        """The point on each body, (2, 3) [length]."""
        return np.asarray(self.points)

    @property
    def turned(self) -> Floats:
        """The frame on each body, (2, 3, 3); of a ball, those of the base."""
        return np.asarray([np.eye(3), np.eye(3)] if self.frames is None else self.frames)


def _set(loop: Loop, name: str, value: object, shape: tuple[int, ...], place: str) -> None:
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        array = np.array(np.nan)
    if array.shape != shape or not np.isfinite(array).all():
        raise InvalidArgument(f"{place}: {name}", f"shape {array.shape}", f"finite numbers of shape {shape}")
    array.setflags(write=False)
    object.__setattr__(loop, name, array)


@dataclass(frozen=True, eq=False)
class OpenMechanism:
    """A machine before its loops are closed; see `assemble`.

    Attributes
    ----------
    joints : a tree from the base, with the joints at their home values, in base coordinates.
    loops : what closes it.
    base, end_effector, reference_point, length_unit, task : as of a `Mechanism`; the end effector may be a loop.
    cones : joint or loop -> the cone that limits it.
    roundings : joint or loop -> how far its digits put it from what was meant, at most [length, rad]; those that are
        not named are as the worst of those that are. Empty where nothing is known.
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

    def tree(self) -> Structure:
        """The joints alone, as a structure that can be moved."""
        known = {body for joint in self.joints for body in joint.connects}
        reference = (0.0, 0.0, 0.0) if self.reference_point is None else self.reference_point
        body = self.end_effector if self.end_effector in known else self.base
        return Structure(self.name, self.joints, body, reference, self.base, self.length_unit)


def frame_along(axis: Floats) -> Floats:
    """A frame (3, 3) whose third column is along an axis (3,) of any length but zero."""
    across = square_to(axis)[0]
    third = axis / np.linalg.norm(axis)
    return np.column_stack([across, np.cross(third, across), third])


@dataclass(frozen=True)
class Note:
    """Something that an import left out, changed, or found, with the names of what it is about."""

    what: str
    names: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.what}: {', '.join(self.names)}" if self.names else self.what


@contextmanager
def noting(told: list[Note]) -> Iterator[None]:
    """Have an error carry what was noted before it, as `__notes__`."""
    try:
        yield
    except PfabrikError as error:
        there = getattr(error, "__notes__", [])
        for note in told:
            if f"note: {note}" not in there:
                error.add_note(f"note: {note}")
        raise
