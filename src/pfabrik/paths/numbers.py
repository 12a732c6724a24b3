"""Numbers as people write them."""

from __future__ import annotations

import math
import re

NUMBER = re.compile(r"\s*[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?\s*")
"""Python reads more as a number: 1_0, digits of other scripts, names of infinities."""


def is_finite(text: str) -> bool:
    """Whether a text is a finite number."""
    return NUMBER.fullmatch(text) is not None and math.isfinite(float(text))
