"""The recording of answers sees what changed, and nothing else."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

import pfabrik as pf
from checks import INTERPRETED

pytestmark = pytest.mark.skipif(INTERPRETED, reason="hundreds of answers")
ROOT = Path(__file__).parents[1]


def answers(*line: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(ROOT / "benchmarks" / "answers.py"), *map(str, line)]
    environment = os.environ | {"PYTHONPATH": str(Path(pf.__file__).parents[1])}
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


def compared(path: Path, *line: object) -> tuple[int, str]:
    """The exit code of a comparison of the five-bar in this process, and what it prints."""
    with pytest.MonkeyPatch.context() as patched, redirect_stdout(StringIO()) as printed:
        patched.syspath_prepend(ROOT / "benchmarks")
        patched.setattr(sys, "argv", ["answers.py", "compare", str(path), "--only", "five_bar", *map(str, line)])
        recorder = importlib.import_module("answers")
        patched.setattr(recorder, "on_all_cores", map)
        return recorder.main(), printed.getvalue()


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("answers") / "answers.npz"
    done = answers("record", path, "--only", "catalogue stewart", "scaled five_bar")
    assert done.returncode == 0, done.stderr
    return path


def changed(recording: Path, tmp_path: Path, key: str, change: Callable[[np.ndarray], np.ndarray]) -> Path:
    """A copy of the recording with one array changed."""
    kept = dict(np.load(recording))
    kept[key] = change(kept[key])
    path = tmp_path / "changed.npz"
    np.savez_compressed(path, **kept)
    return path


def off_by(amount: float, column: int) -> Callable[[np.ndarray], np.ndarray]:
    """Adds to a number of the first row; numbers are stored byte by byte, column by column."""

    def change(packed: np.ndarray) -> np.ndarray:
        numbers = np.ascontiguousarray(packed.reshape(8, -1).T).view(np.float64)
        numbers.reshape(packed.shape[1:])[column, 0] += amount
        return np.ascontiguousarray(numbers.view(np.uint8).reshape(-1, 8).T).reshape(packed.shape)

    return change


def row_of(question: str, stdout: str) -> list[str]:
    """The numbers that are printed of a question: rows, equal, differing, largest difference, statuses."""
    (line,) = [line for line in stdout.splitlines() if line.startswith(f"{question}  ")]
    return line[len(question) :].split()


@pytest.mark.compiled
def test_the_same_answers_are_the_same_to_the_last_bit(recording: Path) -> None:
    found = np.load(recording)
    assert {key.split("/")[0] for key in found.files} == {"catalogue stewart", "scaled five_bar"}
    assert found["catalogue stewart/asked/targets"].shape[1:] == (4, 4)
    statuses = found["catalogue stewart/given/ik"][:, 0]
    assert len(np.unique(statuses.T, axis=0)) == 2  # some targets are reached, some are not
    done = answers("compare", recording)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "all answers are the same to the last bit" in done.stdout


@pytest.mark.compiled
def test_a_number_that_differs_is_counted_unless_it_is_within_the_tolerance(recording: Path, tmp_path: Path) -> None:
    path = changed(recording, tmp_path, "scaled five_bar/given/ik", off_by(1e-9, 4))
    code, printed = compared(path)
    assert code == 1
    rows, equal, differing, largest, statuses, *machines = row_of("ik", printed)
    assert (int(rows) - int(equal), differing, statuses) == (1, "1", "0")
    assert float(largest) == pytest.approx(1e-9, rel=0.5)
    assert machines == ["scaled", "five_bar", "1"]
    assert compared(path, "--tolerance", "1e-8")[0] == 0


@pytest.mark.compiled
def test_a_status_and_the_name_of_a_limit_differ_whatever_the_tolerance(recording: Path, tmp_path: Path) -> None:
    path = changed(recording, tmp_path, "scaled five_bar/given/track", off_by(1.0, 0))
    code, printed = compared(path, "--tolerance", "1e-3")
    assert code == 1
    assert row_of("track", printed)[4] == "1"

    def renamed(stored: np.ndarray) -> np.ndarray:
        columns, words = json.loads(str(stored))
        return np.array(json.dumps([columns, ["p9[0] max", *words[1:]]]))

    path = changed(recording, tmp_path, "scaled five_bar/words/active limits", renamed)
    code, printed = compared(path, "--tolerance", "1e-3")
    assert code == 1
    assert row_of("active limits", printed)[2] == "1"
