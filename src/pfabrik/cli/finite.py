"""Numbers on the command line and in path files: finite, and written as people write them."""

from __future__ import annotations

from typing import Any

import click

from ..cells import is_finite

__all__ = ["FINITE", "is_finite"]


class Finite(click.types.FloatParamType):
    """A float that is neither infinite nor NaN."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The number, or a failure that names the option."""
        if isinstance(value, str) and not is_finite(value):
            self.fail(f"found '{value}'; expected a finite number", param, ctx)
        number: float = super().convert(value, param, ctx)
        return number


FINITE = Finite()
