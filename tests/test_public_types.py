"""The program that mypy checks as a user's own does what it says."""

from __future__ import annotations

import runpy
from pathlib import Path

PROGRAM = Path(__file__).parent / "typing" / "public.py"


def test_the_typed_program_runs() -> None:
    runpy.run_path(str(PROGRAM), run_name="__main__")


def test_it_casts_and_ignores_nothing() -> None:
    text = PROGRAM.read_text(encoding="utf-8")
    assert not [word for word in ("cast(", "type: ignore", "Any") if word in text]
