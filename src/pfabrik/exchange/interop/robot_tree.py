"""A robot as a tree of bodies, with what closes its loops."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ...common.arrays import Floats
from ...machine.description.joints import Cone, Joint
from .collision import NO_COLLISION, Collision
from .couplings import Coupling
from .digits import Rounding
from .driving import Rates
from .opened import Loop


@dataclass(frozen=True)
class Robot:
    """A tree of bodies and what closes its loops, in metres and radians, in the frame of its root.

    Attributes
    ----------
    joints : from the root outward, each from its parent to its child; bodies welded to each other have a fixed one.
    root : the body that the others hang on.
    places : what an end effector may be called besides a joint -> its body, and a frame (4, 4) of it [m], whose origin
        targets place.
    base, end_effector, task, cones : those of a mechanism that the file describes, if any.
    order : coordinates that are driven, in the order of the actuators; those that are not named come behind.
    rates : coordinate -> what its drive can do [rad or m, per s and per s^2, and SI units].
    roundings : joint or loop -> how exactly the digits of the file place it [m, rad]; other loops are as the worst.
    couplings : joints that follow others.
    undriven : what the file has in place of driven joints, for the refusal of a machine without any.
    unread : its drives that are not read, by name.
    collision : its collision geometry [m].
    spans : slide -> the two joints or loops whose distance is its coordinate.
    """

    name: str
    joints: Sequence[Joint]
    loops: Sequence[Loop]
    root: str
    places: Mapping[str, tuple[str, Floats]]
    base: str | None = None
    end_effector: str | None = None
    task: tuple[str, ...] | None = None
    cones: Mapping[str, Cone] = field(default_factory=dict)
    order: Sequence[str] = ()
    rates: Mapping[str, Rates] = field(default_factory=dict)
    roundings: Mapping[str, Rounding] = field(default_factory=dict)
    couplings: Sequence[Coupling] = ()
    undriven: str = "none in the file"
    unread: str = ""
    spans: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    collision: Collision = NO_COLLISION
