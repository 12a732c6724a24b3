"""Copies of the kernels' sources, run from a folder of their own."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from itertools import count
from pathlib import Path
from types import ModuleType

from pfabrik import kernels

_NUMBERS = count()


def copied(folder: Path, name: str) -> ModuleType:
    """A module of a package that is copied to a folder, loaded anew."""
    package = f"copied_{next(_NUMBERS)}"
    spec = importlib.util.spec_from_file_location(
        package, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    sys.modules[package] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sys.modules[package])
    return importlib.import_module(f"{package}.{name}")


def copy_kernels(folder: Path) -> None:
    """Copy what chooses the code that runs, without the compiled kernels."""
    folder.mkdir(parents=True, exist_ok=True)
    for source in Path(kernels.__file__).parent.glob("*.py"):
        (folder / source.name).write_bytes(source.read_bytes())
