"""What the command prints, wording and all: transcripts in `golden/`, which `PFABRIK_REGOLD=1` writes anew."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from command import pfabrik, told, write_files

GOLDEN = Path(__file__).with_name("golden")
CHANCE = re.compile(r"^\d+ starts;.*|\s+\d+(?=\s+(nothing|\S[^\n]* (min|max|cone))$)", re.MULTILINE)
"""What random starts decide: how many there were, and how many of them ended in a mode."""


def printed(line: str) -> list[str]:
    """What a command prints, of which `| head -n` leaves the first lines, `!` before lines on stderr; its exit code."""
    command, _, most = line.partition(" | head -")
    result = pfabrik(command.removeprefix("$ pfabrik "))
    shown = result.stdout.splitlines()[: int(most) if most else None]
    code = [f"exit code {result.exit_code}"] * (result.exit_code != 0)
    return [*(each.rstrip() for each in shown), *(f"! {each}" for each in told(result)), *code]


def transcript(text: str) -> str:
    """The comments and command lines of a transcript, with what is printed now."""
    lines = [line for line in text.splitlines() if line.startswith(("# ", "$ "))]
    blocks = ["\n".join([line, *printed(line), ""]) if line.startswith("$ ") else line for line in lines]
    return "\n".join(blocks)


@pytest.mark.filterwarnings("always::pfabrik.errors.MobilityWarning")
@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    "name",
    [
        *("check", "design", "fk", "ik", "info", "speed", "statics", "track", "travel"),
        pytest.param("modes", marks=pytest.mark.compiled),
    ],
)
def test_the_command_prints_this(name: str) -> None:
    write_files()
    path = GOLDEN / f"{name}.txt"
    now = transcript(path.read_text(encoding="utf-8"))
    if os.environ.get("PFABRIK_REGOLD"):
        path.write_text(now, encoding="utf-8")
    assert CHANCE.sub("", now) == CHANCE.sub("", path.read_text(encoding="utf-8"))
