"""Faults that a user would meet, one wrong line each, and the test that catches each of them: `seeded_faults.toml`."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

TESTS = Path(__file__).parent
ROOT = TESTS.parent
FAULTS: list[dict[str, Any]] = tomllib.loads((TESTS / "seeded_faults.toml").read_text(encoding="utf-8"))["fault"]

every_fault = pytest.mark.parametrize("fault", FAULTS, ids=[fault["test"].partition("::")[2] for fault in FAULTS])


@every_fault
def test_a_fault_is_one_change_of_the_source_with_a_test_that_exists(fault: dict[str, Any]) -> None:
    assert (ROOT / fault["file"]).read_text(encoding="utf-8").count(fault["old"]) == 1, fault["what"]
    file, _, name = fault["test"].partition("::")
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    assert name.partition("[")[0] in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}, fault


@pytest.mark.campaign
@every_fault
def test_a_fault_is_caught(fault: dict[str, Any], tmp_path: Path) -> None:
    """Kernels with a fault run as plain Python: they are not compiled again."""
    package = shutil.copytree(ROOT / "src", tmp_path / "src", ignore=shutil.ignore_patterns("__pycache__"))
    file = tmp_path / fault["file"]
    file.write_text(file.read_text(encoding="utf-8").replace(fault["old"], fault["new"]), encoding="utf-8")
    environment = os.environ | {"PYTHONPATH": str(package), "PYTHONDONTWRITEBYTECODE": "1"}
    if "/kernels/" in fault["file"] and "/kernels/_" not in fault["file"]:
        environment["PFABRIK_KERNELS"] = "python"
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-p", "no:xdist", fault["test"]]
    ended = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=1200)
    assert ended.returncode == 1, ended.stdout[-2000:] + ended.stderr[-2000:]
