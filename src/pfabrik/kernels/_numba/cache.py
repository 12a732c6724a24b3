"""Compiled code kept on disk, keyed by its source text."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from numba.core.caching import FunctionCache

_Cache: Any = FunctionCache

_IMPORTS = re.compile(r"^\s*from (\.+)([\w.]*) import (\([^)]*\)|.*)$", re.MULTILINE)


@cache
def _imported(path: Path) -> tuple[Path, ...]:
    """The files of this package that a file imports."""
    modules = []
    for dots, module, names in _IMPORTS.findall(path.read_text(encoding="utf-8")):
        base = path.parents[len(dots) - 1].joinpath(*module.split("."))
        modules += [base, *(base / name for name in re.findall(r"\w+", names))]
    files = (file for base in modules for file in (base.with_name(f"{base.name}.py"), base / "__init__.py"))
    return tuple(file for file in files if file.is_file() and file.name != "_shipped.py")  # it makes no code


def _sources_of(path: Path) -> set[Path]:
    """A file and the files of this package that it imports, directly or not."""
    sources, pending = {path}, [path]
    while pending:
        fresh = set(_imported(pending.pop())) - sources
        sources |= fresh
        pending += fresh
    return sources


def digest_for(function: Callable[..., Any]) -> str:
    """Hash of all sources that a compiled function depends on: Numba itself sees no edit of other files."""
    digest = hashlib.sha256()
    for path in sorted(_sources_of(Path(function.__code__.co_filename))):
        digest.update(path.read_bytes())
    return digest.hexdigest()


class KernelCache(_Cache):
    """Numba's file cache, invalidated by an edit of any file that the kernel depends on."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        # in the version, not in the stamp: an index of other sources may hold types that no longer exist, and must not
        # be read
        self._cache_file._version = (self._cache_file._version, digest_for(function))

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Store compiled code; where there is no space, it runs all the same."""
        with suppress(OSError):
            super().save_overload(signature, compiled)
