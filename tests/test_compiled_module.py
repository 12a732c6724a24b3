"""The module of compiled kernels: what is in it, what it refuses, and when it is not loaded."""

from __future__ import annotations

import hashlib
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from copied import copied, copy_kernels
from pfabrik import kernels
from pfabrik.kernels import _shipped
from pfabrik.kernels._shipped import CARD, LIBRARY

KERNELS = Path(kernels.__file__).parent
compiled = pytest.mark.skipif(LIBRARY is None, reason="kernels are not compiled in this folder: see `make`")


def test_the_table_of_kernels_is_complete() -> None:
    """What Python may call is compiled: the table names every kernel of the sources."""
    sources = "".join(path.read_text(encoding="utf-8") for path in KERNELS.rglob("*.py") if "_numba" not in str(path))
    defined = re.findall(r"^@(?:kernel|search)\ndef (\w+)", sources, re.MULTILINE)
    table = (KERNELS / "ahead.py").read_text(encoding="utf-8").partition("\nKERNELS")[2]
    assert sorted(re.findall(r"^    \((\w+), ", table, re.MULTILINE)) == sorted(defined)


@compiled
def test_answers_are_the_same_to_the_last_bit_at_every_level(tmp_path: Path) -> None:
    assert LIBRARY is not None
    answers = [answers_with(level) for level in LIBRARY.module.LEVELS or ("compiled",)]
    assert len(answers[0]) == 64 and len(set(answers)) == 1


@compiled
@pytest.mark.campaign
def test_answers_are_those_of_numba_to_the_last_bit() -> None:
    assert answers_with("numba") == answers_with("compiled")


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
@pytest.mark.parametrize("arguments", WRONG.values(), ids=WRONG)
def test_arguments_of_other_types_are_refused(arguments: tuple[Any, ...]) -> None:
    assert LIBRARY is not None
    with pytest.raises(TypeError, match=r"^kernels_join: argument \d: expected "):
        LIBRARY.kernel("kernels.join")(*arguments)


@compiled
def test_what_is_only_read_may_be_read_only() -> None:
    assert LIBRARY is not None
    lowest = LOWEST.copy()
    LIBRARY.kernel("kernels.join")(np.frombuffer(PAIRS.tobytes(), np.int64).reshape(2, 2), lowest)
    assert lowest.tolist() == [0, 0, 2, 2]


@compiled
def test_numbers_and_records_of_other_types_are_refused() -> None:
    assert LIBRARY is not None
    number, codes = LIBRARY.kernel("kernels.number_points"), np.zeros(1, np.int64)
    for count in ("1", 1.5, 2**70, None):
        with pytest.raises(TypeError, match="argument 4: expected an integer"):
            number(codes, codes.copy(), codes.copy(), count, False, codes.copy())
    walk, arrays = LIBRARY.kernel("chains.walk_chains"), (np.zeros((0, 0)), np.zeros((0, 0, 0)))
    for record, expected in (((), "more fields"), (arrays, "more fields"), (None, "a record")):
        with pytest.raises(TypeError, match=f"argument 3: expected .*{expected}"):
            walk(0, 0, record, np.zeros((0, 0, 0)))


def card_of(folder: Path, data: bytes, **other: str) -> None:
    """A module with its card in a folder."""
    name = json.loads((KERNELS / CARD).read_text())["file"]
    (folder / name).write_bytes(data)
    card = {"file": name, "module": hashlib.sha256(data).hexdigest(), "sources": "those", **other}
    (folder / CARD).write_text(json.dumps(card))


def why_not(folder: Path) -> str:
    module, reason = _shipped.load_module(folder)
    assert module is None
    return reason


@compiled
def test_a_module_that_is_damaged_or_made_of_other_sources_is_not_loaded(tmp_path: Path) -> None:
    whole = (KERNELS / json.loads((KERNELS / CARD).read_text())["file"]).read_bytes()
    assert "no kernels were compiled" in why_not(tmp_path)
    digest = hashlib.sha256(whole).hexdigest()
    for damaged in (whole[: len(whole) // 2], b"", bytes(len(whole)), whole[:-64] + bytes(64)):
        if damaged != whole:
            card_of(tmp_path, damaged, module=digest)
            assert "are damaged" in why_not(tmp_path)
    card_of(tmp_path, b"\x7fELF of another machine")
    assert "not for this Python or this processor" in why_not(tmp_path)
    card_of(tmp_path, whole)
    (tmp_path / "edited.py").touch()
    assert "were edited" in why_not(tmp_path)
    for text in ("", "{}", "[]", '{"file": 1}'):
        (tmp_path / CARD).write_text(text)
        assert "no kernels were compiled" in why_not(tmp_path)
    card_of(tmp_path, whole)
    next(tmp_path.glob("*_compiled.[!j]*")).unlink()
    assert "no kernels were compiled" in why_not(tmp_path)


def test_without_compiled_kernels_and_without_numba_a_sentence_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy_kernels(tmp_path)
    monkeypatch.setitem(sys.modules, "numba", None)
    monkeypatch.setattr(os, "environ", os.environ | {"NUMBA_DISABLE_JIT": "0", "PFABRIK_KERNELS": ""})
    with pytest.raises(ImportError, match=r"^no kernels were compiled .* pip install numba"):
        copied(tmp_path, "_jit")


@compiled
def test_the_command_says_in_a_sentence_what_is_not_there() -> None:
    environment = os.environ | {"PFABRIK_KERNELS": "v9", "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-m", "pfabrik", "ik", "stewart", "--position", "0", "0", "190"]
    ran = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout) == (2, "")
    assert re.fullmatch(r"pfabrik: PFABRIK_KERNELS=v9: expected numba, compiled.*\n", ran.stderr)


WITHOUT_NUMBA = """
import sys
from click.testing import CliRunner

sys.modules["numba"] = sys.modules["llvmlite"] = None
from pfabrik.cli import main

for line in sys.stdin.read().splitlines():
    result = CliRunner().invoke(main, line.split())
    print(result.exit_code, line if isinstance(result.exception, SystemExit | None) else repr(result.exception))
"""


@compiled
@pytest.mark.slow
def test_everything_runs_where_numba_is_not_installed(tmp_path: Path) -> None:
    path = tmp_path / "path.csv"
    path.write_text("x,y,z\n0,0,190\n10,0,190\n400,0,190\n")
    lines = {
        "ik stewart --position 10 0 190": 0,
        "ik stewart --position 400 0 190": 1,
        "ik delta --position 0 0 -100 --hold none": 0,
        "fk five_bar -20 20": 0,
        f"track stewart {path} -o -": 1,
        "travel five_bar": 0,
        "info stewart": 0,
        "check stewart": 0,
        f"plot stewart --position 10 0 190 -o {tmp_path}/plot.png": 0,
        "workspace five_bar": 0,
        f"demo --quick -o {tmp_path}/demo": 0,
        "compile": 0,
    }
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-c", WITHOUT_NUMBA]
    ran = subprocess.run(
        command, input="\n".join(lines), env=environment, capture_output=True, text=True, check=True, cwd=tmp_path
    )
    assert ran.stdout.splitlines() == [f"{code} {line}" for line, code in lines.items()]
