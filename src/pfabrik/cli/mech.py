"""The argument MECH: a catalogue name, a file, or ``-`` for standard input."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click
from click.shell_completion import CompletionItem

import pfabrik as pf

if TYPE_CHECKING:
    from ..description.mechanism import Mechanism

STANDARD_INPUT = "-"


class MechanismName(click.types.StringParamType):
    """A text that completes to names of the catalogue, and to files."""

    name = "mech"

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """Names that begin so; else the shell's own completion of files."""
        names = [name for name in pf.catalog() if name.startswith(incomplete)]
        return [CompletionItem(name) for name in names] or [CompletionItem(incomplete, type="file")]


MECH = MechanismName()


def load(mech: str) -> Mechanism:
    """The mechanism of an argument MECH."""
    if mech != STANDARD_INPUT:
        return pf.load(mech)
    from ..files import loads

    return loads(sys.stdin.read(), "standard input")
