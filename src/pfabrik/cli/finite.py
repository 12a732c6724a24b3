"""Numbers on the command line and in path files: finite, and written as people write them."""

from __future__ import annotations

import math
import re
from typing import Any

import click

NUMBER = re.compile(r"\s*[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?\s*")
"""Python reads more as a number: 1_0, digits of other scripts, names of infinities."""


def is_finite(text: str) -> bool:
    """Whether a text is a finite number."""
    return NUMBER.fullmatch(text) is not None and math.isfinite(float(text))


class Finite(click.types.FloatParamType):
    """A float that is neither infinite nor NaN."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The number, or a failure that names the option."""
        if isinstance(value, str) and not is_finite(value):
            self.fail(f"found '{value}'; expected a finite number", param, ctx)
        number: float = super().convert(value, param, ctx)
        return number


FINITE = Finite()
