"""Chains in the field's notation: `U-P*-S` to the types of its joints."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from ..errors import Fault
from .form_faults import shown
from .joint_types import KINDS, JointType

LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
"""What the joints of a chain are called, from the base outward."""

_TYPES: dict[str, JointType] = {kind.letter: type_ for type_, kind in KINDS.items() if len(kind.letter) == 1}
_JOINT = rf"[{''.join(_TYPES)}]\*?"
_CHAIN = re.compile(rf"{_JOINT}(-{_JOINT}){{0,{len(LETTERS) - 1}}}")
_LOOSE = re.compile(rf"[{''.join(_TYPES)}*\s_–-]{{1,99}}", re.IGNORECASE)


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


def chain_faults(place: str, chain: Any) -> Iterator[Fault]:
    """The fault of what is no chain."""
    if read_chain(chain):
        return
    hint = ""
    if isinstance(chain, str) and _LOOSE.fullmatch(chain):
        behind = re.sub(r"(^|[^A-Z])\*([A-Z])", r"\1\2*", chain.upper())  # a star before its joint
        meant = "-".join(re.findall(_JOINT, behind))
        hint = f"; did you mean '{meant}'?" if read_chain(meant) else ""
    expected = f"joints from the base outward, such as 'U-P*-S': {' '.join(_TYPES)}, '*' behind the actuated ones"
    yield Fault(place, f"{shown(chain)}{hint}", expected)
