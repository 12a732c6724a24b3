"""A machine whose loops need not be closed yet: a tree of joints, and the loops that are to close."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ..description.joints import Cone, Joint, Vector
from ..description.structure import Structure
from .digits import Rounding
from .open_loops import Loop


@dataclass(frozen=True, eq=False)
class OpenMechanism:
    """A machine before its loops are closed by `assemble`.

    Attributes
    ----------
    joints : a tree from the base, with the joints at their home values, in base coordinates.
    loops : the joints that close it.
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
        bodies = {body for joint in self.joints for body in joint.connects}
        reference = (0.0, 0.0, 0.0) if self.reference_point is None else self.reference_point
        body = self.end_effector if self.end_effector in bodies else self.base
        return Structure(self.name, self.joints, body, reference, self.base, self.length_unit)
