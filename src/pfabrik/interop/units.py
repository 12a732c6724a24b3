"""Lengths of other programs, which count in metres, and of mechanisms, which count in what their label says."""

from __future__ import annotations

from ..errors import InvalidArgument, near_miss

METRES = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "um": 1e-6, "µm": 1e-6}
METRES |= {"in": 0.0254, "inch": 0.0254, "ft": 0.3048, "unit": 1.0}
"""Label of a unit of length -> its length [m]; a machine without a size counts in metres."""


def metres_of(length_unit: str) -> float:
    """Length of a unit [m]; InvalidArgument for a label that is not known."""
    if not isinstance(length_unit, str) or length_unit not in METRES:
        found = f"'{length_unit}'{near_miss(length_unit, METRES)}"
        raise InvalidArgument("length_unit", found, f"a unit whose length in metres is known: {', '.join(METRES)}")
    return METRES[length_unit]
