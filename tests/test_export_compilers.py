"""Exported C in compilers that treat warnings as errors: none has one, at any level of optimisation."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from exported import CATALOGUE, STRICT, text_of
from pfabrik.exchange.export.export_c import PARTS

M4F = ("-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16")
COMMANDS = {
    "gcc": ("gcc", "-std=c99"),
    "clang": ("clang", "-std=c99"),
    "g++": ("g++", "-std=c++11", "-xc++"),
    "arm": ("arm-none-eabi-gcc", "-std=c99", *M4F),
}
LEVELS = ("-O0", "-O1", "-O2", "-O3")
PRECISIONS = ("float", "double")
ALL: Any = tuple(part for part in PARTS if part != "effort")
"""Of a machine without masses; those that have some are compiled in `test_export_effort`."""

CHOICES = [(compiler, level, "delta") for compiler in ("gcc", "arm") for level in LEVELS]
CHOICES += [(compiler, "-O2", "delta") for compiler in ("clang", "g++")]
CHOICES += [(compiler, "-O2", name) for name in ("stewart", "agile_eye") for compiler in ("gcc", "arm")]
"""A machine with cranks, pairs of rods and cones at every level; one of struts, and one without cones, where most flow
of data is seen. The others take a quarter of an hour."""

OTHERS = [(compiler, level, name) for name in CATALOGUE for compiler in COMMANDS for level in LEVELS]
MATRIX = [*CHOICES, *(pytest.param(*each, marks=pytest.mark.campaign) for each in OTHERS if each not in CHOICES)]


def said_by(compiler: str, level: str, text: str, folder: Path) -> str:
    """What a compiler says of a file, with its self-test."""
    command, *options = COMMANDS[compiler]
    if not shutil.which(command):
        pytest.skip(f"no {command} here")
    (folder / "exported.c").write_text(text)
    given = [command, *options, level, *STRICT, "-DPFK_SELF_TEST", "-c", "exported.c", "-o", "exported.o"]
    return subprocess.run(given, cwd=folder, capture_output=True, text=True).stderr


@pytest.mark.parametrize(("compiler", "level", "name"), MATRIX)
def test_no_compiler_has_a_warning(compiler: str, level: str, name: str, tmp_path: Path) -> None:
    for precision in PRECISIONS:
        assert said_by(compiler, level, text_of(name, precision, ALL), tmp_path) == ""


@pytest.mark.parametrize("part", [part for part in PARTS if part not in ("nearest", "live", "effort")])
def test_no_part_by_itself_has_a_warning(part: Any, tmp_path: Path) -> None:
    for compiler in COMMANDS:
        assert said_by(compiler, "-O2", text_of("delta", "float", (part,)), tmp_path) == ""


def test_a_file_in_single_precision_computes_nothing_in_double() -> None:
    code = re.sub(r"/\*.*?\*/", "", text_of("delta", "float", ALL), flags=re.DOTALL)
    assert not re.search(r"\bdouble\b|(?<![\w.])\d+\.\d*(?:e[+-]?\d+)?(?![\w.])|\b(sqrt|sin|cos|fabs|floor)\(", code)


def test_no_line_of_a_file_is_long() -> None:
    assert max(map(len, text_of("delta", "float", ALL).splitlines())) < 800
