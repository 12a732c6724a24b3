"""Legs: a chain such as `U-P*-S`, and the points of its joints at home, stand for the ordinary joints of some legs."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import ArrayLike

from ...common.frozen import FrozenMapping
from ...errors import Fault, InvalidArgument
from .coercion import numbers, text, texts
from .form_faults import shown
from .joints import DRIVE_FIELDS, KINDS, Cone, JointType, Range, set_fields

LEG_KEYS = ("chain", "name", "connects", "base", "via", "platform", "axis", "stroke", "thickness", "copies")
"""What can be said of legs, in the order in which it is told, beside what is said of single joints."""

JOINT_KEYS = ("axis", "axes", "actuated", "home", "range", "cone", *DRIVE_FIELDS)
"""What can be said of one joint of a chain."""

BODY_KEYS = ("thickness", "density", "mass", "centre")
"""What can be said of a body between two of its joints."""

CONE_KEYS = ("axis", "half_angle", "fixed_to")
"""What can be said of its cone."""

LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
"""What the joints of a chain are called, from the base outward."""

_TYPES: dict[str, JointType] = {kind.letter: type_ for type_, kind in KINDS.items() if len(kind.letter) == 1}
_JOINT = rf"[{''.join(_TYPES)}]\*?"
_CHAIN = re.compile(rf"{_JOINT}(-{_JOINT}){{0,{len(LETTERS) - 1}}}")
_LOOSE = re.compile(rf"[{''.join(_TYPES)}*\s_–-]{{1,99}}", re.IGNORECASE)


@dataclass(frozen=True)
class Leg:
    """Legs of one kind: a chain, and where its joints are at home, in base coordinates. Angles in radians.

    Attributes
    ----------
    chain : str
        The joints from the base outward, `*` behind the actuated ones: "U-P*-S". They are called A, B, C by their place
        in the chain, and A1, B1, C1 in the first leg.
    base, platform : array (3,) or (n, 3) or None
        Centres of the first and the last joint that has a centre (a prismatic one has none) [length]: one point for
        each leg, or a single one.
    via : array or None
        Centres of the joints between, one list of points for each joint; for a single joint the list alone.
    axis : array or str or sequence of str or None
        Direction of the joints that need one: three numbers or a word ("radial", "tangential", "vertical", "x", "y",
        "z", "-" before it for the opposite), for all legs or one for each leg.
    stroke : tuple of float or None
        Range of the prismatic joint [length]; one for all legs, or one for each.
    name : str
        What comes before the names of joints and bodies.
    connects : tuple of str or None
        The bodies that the legs lead from and to; the base and the end effector by default.
    by_letter : mapping of str to mapping
        What is said of joints and bodies, by letters: {"A": {"axis": "radial", "range": (-1, 1)}}. Keys are axis,
        axes, home, range, cone and those of actuators, max_speed to friction, as in `Joint`, directions as above; and,
        of a C with
        `*` in the chain, actuated: which of its coordinates is driven, by default both. A cone is a mapping too:
        half_angle; axis, by default the line that it limits, at home; fixed_to, by default the base or the end effector
        at the ends of the chain and the inner body between. Home and range are one for all legs, or a list with one for
        each. A body is called by the letters of its two joints: {"AB": {"thickness": 10, "density": 2700}}. Its keys
        are thickness, by default that of the leg, density or mass, and centre, a point for each leg, or a single one,
        at home; by default that of the link.
    copies : mapping or None
        {"count": 3, "axis": (0, 0, 1)}: rotational copies about an axis through the origin.
    thickness : float or None
        Diameter of the links between neighbouring joints of the chain that have a centre, for `clearance`.
    """

    chain: str
    base: ArrayLike | None = None
    platform: ArrayLike | None = None
    via: ArrayLike | None = None
    axis: ArrayLike | None = None
    stroke: Range | None = None
    name: str = ""
    connects: tuple[str, str] | None = None
    by_letter: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    copies: Mapping[str, int | ArrayLike] | None = None
    thickness: float | None = None

    def __post_init__(self) -> None:
        deep = {name: numbers(getattr(self, name), 3) for name in ("base", "platform", "via", "axis", "stroke")}
        plain = {"chain": text(self.chain), "name": text(self.name), "connects": texts(self.connects)}
        set_fields(self, thickness=numbers(self.thickness))
        set_fields(self, **deep, **plain, by_letter=_frozen(self.by_letter, 3), copies=_frozen(self.copies, 1))


def as_legs(chain: Any, parts: Mapping[str, Any]) -> tuple[Leg, ...]:
    """Legs from what a call names them by: a chain with its parts, or legs without."""
    if isinstance(chain, str):
        return (Leg(chain, **parts),)
    legs = (chain,) if isinstance(chain, Leg) else tuple(chain) if isinstance(chain, Sequence) else ()
    if not legs or not all(isinstance(leg, Leg) for leg in legs):
        raise InvalidArgument("legs", shown(chain), "a chain such as 'U-P*-S', a Leg, or a list of them")
    given = [name for name, value in parts.items() if value]
    if given:
        raise InvalidArgument(given[0], shown(parts[given[0]]), "nothing: legs have their own")
    return legs


def _frozen(value: Any, depth: int) -> Any:
    """A copy that nobody can change, its numbers as floats. Among the values of one joint, a cone is a mapping too."""
    if isinstance(value, Cone):
        value = {key: getattr(value, key) for key in CONE_KEYS}
    if not isinstance(value, Mapping) or depth == 0:
        return numbers(value, 3)
    inner = {key: depth - 1 if depth == 3 or key == "cone" else 0 for key in value}
    return FrozenMapping({key: _frozen(each, inner[key]) for key, each in value.items()})


@dataclass(frozen=True)
class ChainJoint:
    """One joint of a chain; `letter` is its place in the chain."""

    letter: str
    type: JointType
    actuated: bool

    @property
    def centred(self) -> bool:
        """True if the joint has a centre."""
        return self.type != "prismatic"


def read_chain(chain: Any) -> tuple[ChainJoint, ...]:
    """The joints of a chain, from the base outward; none where the text is no chain."""
    if not isinstance(chain, str) or not _CHAIN.fullmatch(chain):
        return ()
    parts = zip(LETTERS, chain.split("-"), strict=False)
    return tuple(ChainJoint(letter, _TYPES[part[0]], part.endswith("*")) for letter, part in parts)


def neighbours(steps: Sequence[ChainJoint], letters: str) -> tuple[str, ...]:
    """The letters of the joints with a centre next to a body, before it and behind it: the ends of its link."""
    before = [step.letter for step in steps if step.centred and step.letter <= letters[0]]
    behind = [step.letter for step in steps if step.centred and step.letter >= letters[1]]
    return (*before[-1:], *behind[:1])


def is_listed(field: str, type_: JointType, value: Any) -> bool:
    """True if the value of a joint's `home` or `range` is a list of them, one for each leg."""
    depth = (field == "range") + (len(KINDS[type_].coordinates) > 1)
    for _ in range(depth):
        value = value[0] if isinstance(value, list | tuple) and value else None
    return isinstance(value, list | tuple) and bool(value)


def chain_faults(place: str, chain: Any) -> Iterator[Fault]:
    """The fault of a value that is not a chain."""
    if read_chain(chain):
        return
    hint = ""
    if isinstance(chain, str) and _LOOSE.fullmatch(chain):
        behind = re.sub(r"(^|[^A-Z])\*([A-Z])", r"\1\2*", chain.upper())  # a star before its joint
        meant = "-".join(re.findall(_JOINT, behind))
        hint = f"; did you mean '{meant}'?" if read_chain(meant) else ""
    expected = f"joints from the base outward, such as 'U-P*-S': {' '.join(_TYPES)}, '*' behind the actuated ones"
    yield Fault(place, f"{shown(chain)}{hint}", expected)
