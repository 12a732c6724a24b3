"""Sizes in words."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .region import Region


def in_words(region: Region, *, degrees: bool = True) -> str:
    """The size of a workspace, to the digit that is uncertain, and a bound of its error: "4,970,000 ± 3,000 mm³".

    Parameters
    ----------
    degrees : True for people, who read angles in degrees; else in radians, as `size` has them.
    """
    size, uncertainty, unit = region.size, region.uncertainty, region.size_unit
    if degrees:
        factor = math.degrees(1.0) ** region.units.count("rad")
        size, uncertainty, unit = factor * size, factor * uncertainty, unit.replace("rad", "deg")
    digit = 10.0 ** math.floor(math.log10(uncertainty)) if uncertainty > 0.0 else 1.0
    bound = digit * math.ceil(uncertainty / digit + 0.5 * (uncertainty > 0.0))  # holds for the rounded size too
    return f"{rounded(size, uncertainty)} ± {rounded(bound, uncertainty)} {unit}"


def kind_of(region: Region, name: str) -> str:
    """The kind of a limit's joint, as "revolute, actuated"; empty for a limit that is no joint's."""
    kinds = {joint.name: joint.type + ", actuated" * bool(joint.actuated) for joint in region.mechanism.joints}
    return kinds.get(name, "")


def rounded(value: float, uncertainty: float) -> str:
    """A number to the first digit of its uncertainty."""
    if not uncertainty > 0.0:
        return f"{value:,.6g}"
    digits = -math.floor(math.log10(uncertainty))
    return f"{round(value, digits):,.{max(digits, 0)}f}"
