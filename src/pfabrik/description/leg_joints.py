"""The joints, links and names of legs."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise

from ..errors import Fault
from .body_shapes import Shape
from .chains import read_chain
from .copies import MOST_COPIES
from .form_faults import is_pair_of_names
from .leg_maker import LegJoint, LegMaker
from .leg_points import count_legs
from .legs import Leg


def placed_joints(
    legs: Sequence[Leg], base: str, end_effector: str, tips: Collection[str] = ()
) -> tuple[list[LegJoint], list[Fault]]:
    """All joints that the legs stand for, leg by leg, and the faults of what they are made from.

    Legs are counted on from one description to the next, by the name that comes before theirs.

    Parameters
    ----------
    tips : names of other joints, in which no leg can end.
    """
    placed: list[LegJoint] = []
    faults: list[Fault] = []
    counted: Counter[str] = Counter()
    for index, leg in enumerate(legs):
        place = f"leg[{index}]"
        if leg.connects is None and end_effector in tips:
            found = f"nothing, but the end effector '{end_effector}' is a joint"
            faults.append(Fault(f"{place}.connects", found, "the two bodies that the legs lead from and to"))
        ends = leg.connects if leg.connects is not None and is_pair_of_names(leg.connects) else (base, end_effector)
        maker = LegMaker(leg, place, ends, faults)
        placed += maker.joints(counted[str(leg.name)] + 1)
        counted[str(leg.name)] += maker.count
    return placed, faults


def count_joints(leg: Leg) -> int:
    """How many joints legs stand for, as far as they can be read."""
    copies = leg.copies.get("count") if isinstance(leg.copies, Mapping) else 1.0
    turns = int(copies) if isinstance(copies, float) and 1.0 <= copies <= MOST_COPIES else 1
    return count_legs(leg.base, leg.platform) * len(read_chain(leg.chain)) * turns


def leg_shapes(legs: Sequence[Leg], placed: Sequence[LegJoint]) -> list[tuple[Shape, str]]:
    """The capsules of legs with a thickness, between neighbouring joints with a centre, and where that is said."""
    shapes: list[tuple[Shape, str]] = []
    for index, leg in enumerate(legs):
        place = f"leg[{index}]"
        own = [part for part in placed if part.place.startswith(f"{place}.") and part.joint.at is not None]
        for first, second in pairwise(own):
            if leg.thickness is not None and first.leg == second.leg:
                ends = (first.joint.name, second.joint.name)
                shape = Shape(second.joint.connects[0], thickness=leg.thickness, between=ends)
                shapes.append((shape, place))
    return shapes


def legs_name(legs: Sequence[Leg]) -> str:
    """What the field calls a machine of such legs: `6-UPS`, `2-UPS/1-U`."""
    kinds: Counter[str] = Counter()
    for leg in legs:
        kinds[re.sub(r"[^A-Z]", "", str(leg.chain))] += count_joints(leg) // (len(read_chain(leg.chain)) or 1)
    return "/".join(f"{count}-{kind}" for kind, count in kinds.items())
