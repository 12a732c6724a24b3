"""The module of compiled kernels: what is in it, what it refuses, and when it is not loaded."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from copied import copied, copy_kernels
from pfabrik import kernels
from pfabrik.kernels._shipped import LIBRARY

KERNELS = Path(kernels.__file__).parent
compiled = pytest.mark.skipif(LIBRARY is None, reason="kernels are not compiled in this folder: see `make`")


def test_the_table_of_kernels_is_complete() -> None:
    """What Python may call is compiled: the table names every kernel of the sources."""
    sources = "".join(path.read_text(encoding="utf-8") for path in KERNELS.rglob("*.py"))
    defined = re.findall(r"^@(?:kernel|flattened|search)\ndef (\w+)", sources, re.MULTILINE)
    table = (KERNELS / "ahead.py").read_text(encoding="utf-8").partition("\nKERNELS")[2]
    assert sorted(re.findall(r"^    \((\w+), ", table, re.MULTILINE)) == sorted(defined)


@compiled
def test_answers_are_the_same_to_the_last_bit_at_every_level(tmp_path: Path) -> None:
    assert LIBRARY is not None
    answers = [answers_with(level) for level in LIBRARY.module.LEVELS or ("compiled",)]
    assert len(answers[0]) == 64 and len(set(answers)) == 1


ANSWERS = """
import hashlib, warnings
import numpy as np
import pfabrik as pf

warnings.simplefilter("ignore")
digest, rng = hashlib.sha256(), np.random.default_rng(3)
for name in ("stewart", "delta", "agile_eye", "hexaglide", "ankle_rss"):
    m = pf.load(name)
    targets = np.tile(m.home_pose, (300, 1, 1))
    targets[:, :3, 3] += rng.uniform(-0.4, 0.4, (300, 3)) * m.characteristic_length
    found = pf.solve_ik(m, targets)
    back = pf.solve_fk(m, found.actuators[:100])
    for array in (found.status, found.pose, found.actuators, found.q, back.pose, pf.feasibility(m, targets).margin):
        digest.update(np.ascontiguousarray(array).tobytes())
print(digest.hexdigest())
"""


def answers_with(choice: str) -> str:
    """Hash of answers in a new process."""
    environment = os.environ | {"PFABRIK_KERNELS": choice, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-c", ANSWERS]
    return subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout.strip()


PAIRS, LOWEST = np.array([[0, 1], [3, 2]]), np.arange(4)
WRONG = {
    "another type": (PAIRS.astype(float), LOWEST),
    "other bytes": (PAIRS.astype(np.int32), LOWEST),
    "swapped bytes": (PAIRS.astype(">i8"), LOWEST),
    "too few dimensions": (PAIRS[0], LOWEST),
    "another order": (np.asfortranarray(PAIRS), LOWEST),
    "steps": (np.repeat(PAIRS, 2, axis=0)[::2], LOWEST),
    "read-only": (PAIRS, np.frombuffer(LOWEST.tobytes(), np.int64)),
    "no array": ([[0, 1]], LOWEST),
    "nothing": (None, LOWEST),
    "too few": (PAIRS,),
    "too many": (PAIRS, LOWEST, LOWEST),
}


@compiled
def test_arguments_of_other_types_are_refused_and_what_is_only_read_may_be_read_only() -> None:
    assert LIBRARY is not None
    join, lowest = LIBRARY.kernel("kernels.join"), LOWEST.copy()
    join(np.frombuffer(PAIRS.tobytes(), np.int64).reshape(2, 2), lowest)
    assert lowest.tolist() == [0, 0, 2, 2]
    for arguments in WRONG.values():
        with pytest.raises(TypeError, match=r"^kernels_join: argument \d: expected "):
            join(*arguments)
    number, codes = LIBRARY.kernel("kernels.number_points"), np.zeros(1, np.int64)
    for count in ("1", 1.5, 2**70, None):
        with pytest.raises(TypeError, match="argument 4: expected an integer"):
            number(codes, codes.copy(), codes.copy(), count, False, codes.copy())
    answer, arrays = LIBRARY.kernel("chains.answer_chains"), (np.zeros(0, np.int64), np.zeros((0, 0), np.int64))
    for record, expected in (((), "more fields"), (arrays, "more fields"), (None, "a record")):
        with pytest.raises(TypeError, match=f"argument 8: expected .*{expected}"):
            answer(0, 0, 0, False, np.zeros((0, 4, 4)), np.zeros((0, 0)), np.zeros((0, 0)), record)


PLAIN = "answers are the same, and take 15 to 100 times as long; install a wheel, or compile them"


def loaded_from(folder: Path) -> str:
    """What is said where the copied kernels are loaded, which run as plain Python then."""
    with pytest.warns(RuntimeWarning) as caught:
        module = copied(folder, "_shipped")
    assert module.LIBRARY is None
    (warning,) = caught
    return str(warning.message)


def test_without_compiled_kernels_plain_python_runs_and_a_sentence_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("PFABRIK_KERNELS", raising=False)
    copy_kernels(tmp_path)
    assert loaded_from(tmp_path).startswith(f"no kernels were compiled for this installation: {PLAIN}")
    for choice in ("compiled", "v2"):
        monkeypatch.setenv("PFABRIK_KERNELS", choice)
        with pytest.raises(ImportError, match=f"^PFABRIK_KERNELS={choice}: no kernels were compiled"):
            copied(tmp_path, "_shipped")
    monkeypatch.setenv("PFABRIK_KERNELS", "python")
    assert copied(tmp_path, "_shipped").LIBRARY is None


@compiled
@pytest.mark.parametrize("data", [b"", b"\x7fELF of another machine"])
def test_a_module_that_is_not_for_this_processor_is_not_loaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, data: bytes
) -> None:
    assert LIBRARY is not None
    monkeypatch.delenv("PFABRIK_KERNELS", raising=False)
    copy_kernels(tmp_path)
    (tmp_path / Path(LIBRARY.module.__file__).name).write_bytes(data)
    assert loaded_from(tmp_path).startswith("the compiled kernels are not for this Python or this processor (")


@compiled
def test_kernels_edited_after_they_were_compiled_are_plain_python(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert LIBRARY is not None
    monkeypatch.delenv("PFABRIK_KERNELS", raising=False)
    folder = tmp_path / "src" / "pfabrik" / "kernels"
    (tmp_path / "tools" / "kernels").mkdir(parents=True)
    (tmp_path / "tools" / "kernels" / "compile_kernels.py").touch()  # a checkout
    copy_kernels(folder)
    module = Path(LIBRARY.module.__file__)
    (folder / module.name).write_bytes(module.read_bytes())
    assert copied(folder, "_shipped").LIBRARY is not None
    later = (folder / module.name).stat().st_mtime + 1
    os.utime(folder / "vectors.py", (later, later))
    assert loaded_from(folder).startswith("the kernels were edited since they were compiled")


@compiled
def test_the_command_says_in_a_sentence_what_is_not_there() -> None:
    environment = os.environ | {"PFABRIK_KERNELS": "v9", "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-m", "pfabrik", "ik", "stewart", "--position", "0", "0", "190"]
    ran = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout) == (2, "")
    assert re.fullmatch(r"pfabrik: PFABRIK_KERNELS=v9: expected python, compiled, .*\n", ran.stderr)
