"""Which code runs: kernels compiled when the package was built, what Numba compiles here, or plain Python."""

from __future__ import annotations

import hashlib
import importlib.util
import json
import os
import sys
from collections.abc import Callable
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader
from pathlib import Path
from types import ModuleType
from typing import Any

from . import IS_INTERPRETED, NoKernels

HERE = Path(__file__).parent
CARD = "_compiled.json"
"""File beside the module of compiled kernels: its name, its hash, and the hash of the sources that it was made of."""

CHOICE = "PFABRIK_KERNELS"
"""Environment variable: `numba`, `compiled`, or a level of the compiled kernels, `v2`; else what is there."""


def name_of(function: Callable[..., Any]) -> str:
    """Name of a kernel: its folder and its function."""
    return f"{function.__module__.rpartition('.')[0].rpartition('.')[2]}.{function.__name__}".lstrip(".")


def sources_digest(folder: Path = HERE) -> str:
    """Hash of the sources of kernels; none where only bytecode was installed, which nobody edits."""
    paths = sorted((path.relative_to(folder).as_posix(), path) for path in folder.rglob("*.py"))
    digest = hashlib.sha256()
    for name, path in paths:
        text = path.read_bytes()
        digest.update(f"{name} {len(text)}\n".encode() + text)
    return digest.hexdigest() if paths else ""


def load_module(folder: Path = HERE) -> tuple[ModuleType | None, str]:
    """The module of compiled kernels, or why there is none; it is read and compared before it is loaded.

    A damaged extension module does not fail to load: it ends the process.
    """
    try:
        card = json.loads((folder / CARD).read_text(encoding="utf-8"))
        file, module, sources = folder / card["file"], card["module"], card["sources"]
        data = file.read_bytes()
    except (OSError, ValueError, TypeError, KeyError):
        return None, "no kernels were compiled for this installation"
    if hashlib.sha256(data).hexdigest() != module:
        return None, f"the compiled kernels, {file}, are damaged"
    if sources_digest(folder) not in (sources, ""):
        return None, "the kernels were edited since they were compiled"
    foreign = f"the compiled kernels, {file}, are not for this Python or this processor"
    if not file.name.endswith(tuple(EXTENSION_SUFFIXES)) or "t" in getattr(sys, "abiflags", ""):
        return None, foreign
    name = f"{__package__}._compiled"
    spec = importlib.util.spec_from_file_location(name, file, loader=ExtensionFileLoader(name, str(file)))
    assert spec is not None and spec.loader is not None
    try:
        loaded = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(loaded)
    except ImportError as error:
        return None, f"{foreign} ({error})"
    return loaded, ""


class Library:
    """Kernels of a compiled module by their names, vectorised ones for one level of the processor."""

    def __init__(self, module: ModuleType, level: str | None = None) -> None:
        """Take the best level that this processor has, or the one that is given."""
        levels = module.LEVELS
        if level is not None and level not in levels:
            raise NoKernels(f"{CHOICE}={level}: expected numba, compiled{''.join(f', {each}' for each in levels)}")
        self.module, self.level = module, level or (levels[-1] if levels else "")

    def kernel(self, name: str) -> Any:
        """The kernel of a name; one that lacks is an error, not a slow answer."""
        plain = name.replace(".", "_")
        return getattr(self.module, f"{plain}_{self.level}", None) or getattr(self.module, plain)


def choose() -> tuple[Library | None, bool, str]:
    """Compiled kernels if they are to run; whether Numba is to compile; and why there are no compiled ones.

    Raises
    ------
    NoKernels
    """
    choice = os.environ.get(CHOICE, "")
    if choice == "numba":
        return None, True, ""
    module, reason = load_module()
    if module is not None:
        return Library(module, choice if choice not in ("", "compiled") else None), False, ""
    if choice:
        raise NoKernels(f"{CHOICE}={choice}: {reason}")
    if importlib.util.find_spec("numba") is None:
        raise NoKernels(
            f"{reason}, and Numba, which would compile them, is not installed: pip install numba, or a wheel of pfabrik"
        )
    return None, True, reason if (HERE / CARD).exists() else ""


LIBRARY, COMPILES, REASON = (None, False, "") if IS_INTERPRETED else choose()
