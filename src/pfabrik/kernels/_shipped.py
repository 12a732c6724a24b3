"""Which code runs: kernels compiled when the package was built, or plain Python."""

from __future__ import annotations

import importlib
import os
import warnings
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

from . import NoKernels

HERE = Path(__file__).parent

CHOICE = "PFABRIK_KERNELS"
"""Environment variable: `python`, `compiled`, or a level of the compiled kernels, `v2`; else what is there."""


def name_of(function: Callable[..., Any]) -> str:
    """Name of a kernel: its folder and its function."""
    return f"{function.__module__.rpartition('.')[0].rpartition('.')[2]}.{function.__name__}".lstrip(".")


def is_stale(file: str | None) -> bool:
    """True if kernels of a checkout were edited after the module was compiled; installed ones never are."""
    if file is None or not (HERE.parents[2] / "tools" / "kernels" / "compile_kernels.py").exists():
        return False
    made = os.stat(file).st_mtime
    return any(path.stat().st_mtime > made for path in HERE.rglob("*.py"))


def load_module() -> tuple[ModuleType | None, str]:
    """The module of compiled kernels, or why there is none."""
    try:
        module = importlib.import_module("._compiled", __package__)
    except ImportError as error:
        if not any(HERE.glob("_compiled.*")):
            return None, "no kernels were compiled for this installation"
        return None, f"the compiled kernels are not for this Python or this processor ({error})"
    if is_stale(module.__file__):
        return None, "the kernels were edited since they were compiled"
    return module, ""


class Library:
    """Kernels of a compiled module by their names, vectorised ones for one level of the processor."""

    def __init__(self, module: ModuleType, level: str | None = None) -> None:
        """Take the best level that this processor has, or the one that is given."""
        levels = module.LEVELS
        if level is not None and level not in levels:
            raise NoKernels(f"{CHOICE}={level}: expected python, compiled{''.join(f', {each}' for each in levels)}")
        self.module, self.level = module, level or (levels[-1] if levels else "")

    def kernel(self, name: str) -> Any:
        """The kernel of a name; one that lacks is an error, not a slow answer."""
        plain = name.replace(".", "_")
        return getattr(self.module, f"{plain}_{self.level}", None) or getattr(self.module, plain)


def choose() -> Library | None:
    """Compiled kernels if they are to run.

    Raises
    ------
    NoKernels
    """
    choice = os.environ.get(CHOICE, "")
    if choice == "python":
        return None
    module, reason = load_module()
    if module is not None:
        return Library(module, choice if choice not in ("", "compiled") else None)
    if choice:
        raise NoKernels(f"{CHOICE}={choice}: {reason}")
    warnings.warn(
        f"{reason}: answers are the same, and take 15 to 100 times as long; install a wheel, or compile them with a C "
        "compiler (python tools/kernels/compile_kernels.py)",
        RuntimeWarning,
        stacklevel=2,
    )
    return None


LIBRARY = choose()

IS_INTERPRETED = LIBRARY is None
"""Kernels run as plain Python, which needs no compiler: the same answers, far slower."""
