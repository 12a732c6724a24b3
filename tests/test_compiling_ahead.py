"""Compiling ahead: nothing is left to compile, and what is compiled is announced."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import pfabrik as pf
from copied import copied, copy_kernels
from pfabrik.kernels import IS_INTERPRETED, ahead
from pfabrik.kernels._shipped import COMPILES

pytestmark = pytest.mark.skipif(IS_INTERPRETED, reason="nothing is compiled")
by_numba = pytest.mark.skipif(not COMPILES, reason="compiled kernels are here")

ANNOUNCED = """
import sys
from pfabrik.kernels._jit import kernel

@kernel
def double(x):
    return 2.0 * x

print(double(float(sys.argv[1])))
"""


@by_numba
def test_every_kernel_is_compiled_for_the_types_that_questions_have() -> None:
    reported: list[str] = []
    ahead.compile_all(lambda name, seconds: reported.append(name))
    assert {"reaching.solve_by_passes", "legs.answer", "closure.close", "closure.nearest_configuration"} <= set(
        reported
    )
    assert len(reported) == len(ahead.KERNELS)
    for name in ("stewart", "delta"):
        mechanism = pf.load(name)
        far = pf.solve_ik(mechanism, np.array(mechanism.reference_point) * 3.0)
        assert far.joints and far.active_limits
        assert pf.solve_fk(mechanism, far.actuators).joints
    for kernel, _ in ahead.KERNELS:
        assert len(kernel.signatures) == 1


@by_numba
def test_kernels_with_scratch_memory_of_their_caller_cannot_allocate() -> None:
    names = {kernel.py_func.__name__ for kernel, _ in ahead.KERNELS if not kernel.targetoptions["_nrt"]}
    assert names == {
        "nearest_pose",
        "assemble",
        "evaluate_poses",
        "close",
        "nearest_configuration",
        "first_order",
        "walk_chains",
        "reach_in_chains",
        "nearest_in_chains",
        "jacobians",
    }


def test_a_kernel_is_announced_when_it_is_compiled_and_not_when_it_is_loaded(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(ANNOUNCED)
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": os.pathsep.join(sys.path)}
    environment["PFABRIK_KERNELS"] = "numba"
    told = []
    for _ in range(2):
        ran = subprocess.run(
            [sys.executable, str(script), "2"], env=environment, check=True, capture_output=True, text=True
        )
        assert ran.stdout == "4.0\n"
        told.append(ran.stderr)
    assert told[0].startswith("pfabrik: compiling double ... ") and told[0].endswith(" s\n")
    assert told[1] == ""


def load(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("edited", ["kernels/vectors.py", "beside/part.py"])
def test_an_edit_beside_a_kernel_or_in_the_kernels_it_uses_makes_its_cache_stale(
    edited: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "beside").mkdir()
    copy_kernels(tmp_path / "kernels")
    caller = tmp_path / "beside" / "caller.py"
    (tmp_path / "beside" / "part.py").touch()
    uses = "    from ..kernels import vectors\n    from .part import share\n"
    caller.write_text(f"def double(x):\n    return 2.0 * x\n\ndef triple(x):\n{uses}")
    monkeypatch.setenv("NUMBA_CACHE_DIR", "")
    kernels = []  # all kept: a module that cannot be imported by name is found only while one of them lives
    for _ in range(2):
        for _again in range(2):
            kernels.append(copied(tmp_path / "kernels", "_jit").kernel(load(caller).double))
            assert kernels[-1](2.0) == 4.0
        (tmp_path / edited).write_text("# edited\n")
    assert [sum(double.stats.cache_hits.values()) for double in kernels] == [0, 1, 0, 1]
