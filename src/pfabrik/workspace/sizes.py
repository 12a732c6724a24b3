"""Sizes in words."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .region import Region


def in_words(found: Region) -> str:
    """The size of a workspace, to the digit that is uncertain: "4,970,000 ± 2,000 mm³"."""
    return (
        f"{rounded(found.size, found.uncertainty)} ± {rounded(found.uncertainty, found.uncertainty)} {found.size_unit}"
    )


def kind_of(found: Region, name: str) -> str:
    """What a limit's joint is: "revolute, actuated"; empty where it is none's."""
    kinds = {joint.name: joint.type + ", actuated" * bool(joint.actuated) for joint in found.mechanism.joints}
    return kinds.get(name, "")


def rounded(value: float, uncertainty: float) -> str:
    """A number to the first digit of its uncertainty."""
    if not uncertainty > 0.0:
        return f"{value:,.6g}"
    digits = -math.floor(math.log10(uncertainty))
    return f"{round(value, digits):,.{max(digits, 0)}f}"
