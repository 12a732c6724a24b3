"""From joints with copies, legs and shapes to the mechanism that they stand for, and from its faults back to them."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeVar

from ...errors import Fault, InvalidMechanism
from .body_masses import Mass
from .body_shapes import Shape
from .copies import Copy, Pattern, Patterns
from .faults import merged
from .form_faults import is_name
from .leg_bodies import PlaceOf, all_masses, all_shapes, bodies_of_legs, families_of
from .leg_joints import LegJoint, placed_joints
from .legs import Leg
from .rules import joint_faults
from .structure import Structure
from .whole_rules import head_faults

Described = TypeVar("Described", bound=Structure)
"""A mechanism, or its structure, which is not checked."""


def expanded(
    kind: type[Described],
    head: Mapping[str, Any],
    described: tuple[Sequence[Pattern], Sequence[Leg], Sequence[Shape | None], Sequence[Mass | None]],
    faults: Sequence[Fault] = (),
) -> Described:
    """The mechanism of all copies and legs.

    Parameters
    ----------
    head : its fields, beside joints and shapes.
    described : its joints, legs, shapes and masses; None where a [[body]] of a file has no shape, or no mass.
    faults : those that were found while these were read. If it is then not clear what is copied, or where legs are,
        only faults of single joints are searched for.

    Raises
    ------
    InvalidMechanism : with every fault, at the places of the description.
    """
    patterns, legs, shapes, masses = described
    base: Any = head.get("base", "base")
    end_effector: Any = head.get("end_effector")
    start, end = base if is_name(base) else "base", end_effector if is_name(end_effector) else "platform"
    placed, of_legs = placed_joints(legs, start, end, [each.joint.name for each in patterns])
    bodies = bodies_of_legs(legs, placed)
    leg_joints = frozenset(each.joint.name.removesuffix(str(each.leg)) for each in placed)
    as_patterns = (*patterns, *(Pattern(each.joint) for each in placed))
    layout = Patterns(as_patterns, base, end_effector, families_of(bodies), leg_joints)
    single = [Copy(index, 0, each.joint) for index, each in enumerate(layout.patterns)]
    faults = merged(faults, [*head_faults(Structure(joints=(), **head)), *of_legs])
    is_unclear = bool(of_legs) or any(map(_hides_joints, faults))
    if not is_unclear and layout.copied_joints():
        misfits = list(_as_written(list(layout.faults()), layout, single, placed, {}))
        is_unclear, faults = bool(misfits), [*faults, *misfits]
    if is_unclear:
        alone = [fault for copy in single for fault in joint_faults(f"joint[{copy.index}]", copy.joint)]
        raise InvalidMechanism(merged(faults, list(_as_written(alone, layout, single, placed, {}))))
    copies = layout.expanded()
    of_tables: list[Fault] = []
    thick = all_shapes(layout, shapes, bodies, of_tables)
    heavy = all_masses(layout, masses, bodies, of_tables)
    faults = merged(faults, of_tables)
    try:
        with warnings.catch_warnings():
            if faults:
                warnings.simplefilter("ignore")
            joints, links = tuple(copy.joint for copy in copies), tuple(shape for shape, _ in thick)
            weights = tuple(mass for mass, _ in heavy)
            mechanism = kind(**{**head, "joints": joints, "shapes": links, "masses": weights})
    except InvalidMechanism as error:
        places = {"body": [place for _, place in thick], "mass": [place for _, place in heavy]}
        faults = merged(faults, list(_as_written(error.faults, layout, copies, placed, places)))
    if faults:
        raise InvalidMechanism(merged(faults, ()))
    return mechanism


def _hides_joints(fault: Fault) -> bool:
    """True if a fault leaves open which joints and bodies there are, or what their numbers mean."""
    root = fault.place.partition(".")[0]
    return root in ("base", "end_effector", "units", "joint", "leg") or ".copies" in fault.place


_PLACE = re.compile(r"(joint|body|mass)\[(\d+)\]\.?(\w*)")


def _as_written(
    faults: Sequence[Fault],
    layout: Patterns,
    copies: Sequence[Copy],
    placed: Sequence[LegJoint],
    bodies: Mapping[str, Sequence[PlaceOf]],
) -> Iterator[Fault]:
    """Faults of joints and shapes at the places of what stands for them, each reported of one copy or leg only.

    Parameters
    ----------
    copies : the joints; the last patterns are those of `placed`.
    bodies : where each shape ("body") and mass ("mass") is described.
    """
    reporter: dict[str, int] = {}
    first = len(layout.patterns) - len(placed)
    for fault in faults:
        match = _PLACE.match(fault.place)
        if match is None:
            yield fault
            continue
        table, number, field = match.groups()
        found, expected, rest = fault.found, fault.expected, fault.place[match.end() :]
        place, who = fault.place, int(number)
        if table in bodies:
            place, found = bodies[table][who](field) + rest, layout.by_family(found)
        elif (copy := copies[int(number)]).index < first:
            place, who = f"joint[{copy.index}].{field}".rstrip(".") + rest, copy.number
            found, expected = layout.as_written(found, copy), layout.as_written(expected, copy)
        else:
            part = placed[copy.index - first]
            place, who = part.places.get(field, f"{part.place}.{field}".rstrip(".")) + rest, part.leg
            found = f"{found} (joint {part.joint.name})"
        if reporter.setdefault(place, who) == who:
            yield Fault(place, found, expected)
