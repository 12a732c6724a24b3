"""Compiled code kept on disk, keyed by its source text."""

from __future__ import annotations

import hashlib
import pickle
import re
import warnings
import zlib
from collections.abc import Callable
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, cast

from numba.core.caching import FunctionCache, IndexDataCacheFile

_Cache: Any = FunctionCache
_CacheFiles: Any = IndexDataCacheFile

CHECKSUM_BYTES = 4

_IMPORTS = re.compile(r"^\s*from (\.+)([\w.]*) import (\([^)]*\)|.*)$", re.MULTILINE)


@cache
def _imported(path: Path) -> tuple[Path, ...]:
    """The files of this package that a file imports."""
    modules = []
    for dots, module, names in _IMPORTS.findall(path.read_text(encoding="utf-8")):
        base = path.parents[len(dots) - 1].joinpath(*module.split("."))
        modules += [base, *(base / name for name in re.findall(r"\w+", names))]
    files = (file for base in modules for file in (base.with_name(f"{base.name}.py"), base / "__init__.py"))
    return tuple(file for file in files if file.is_file())


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


def _checksum(data: bytes) -> bytes:
    return zlib.crc32(data).to_bytes(CHECKSUM_BYTES, "little")


class _WholeFiles(_CacheFiles):
    """Numba's files of one kernel; a damaged file counts as missing, so that the kernel is compiled again.

    Machine code truncated by a crash or a full disk must not run.
    """

    def _load_index(self) -> dict[Any, Any]:
        try:
            return cast(dict[Any, Any], super()._load_index())
        except Exception:  # damaged bytes unpickle to anything
            return {}

    def _load_data(self, name: str) -> Any:
        written = Path(self._data_path(name)).read_bytes()
        checksum, data = written[:CHECKSUM_BYTES], written[CHECKSUM_BYTES:]
        if checksum != _checksum(data):
            raise OSError(f"{name} is damaged")  # which Numba treats as a missing file
        return pickle.loads(data)

    def _save_data(self, name: str, data: Any) -> None:
        dumped = self._dump(data)
        with self._open_for_write(self._data_path(name)) as file:
            file.write(_checksum(dumped) + dumped)


class KernelCache(_Cache):
    """Numba's file cache, invalidated by an edit of any file that the kernel depends on."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        files: Any = self._cache_file
        self._cache_file: Any = _WholeFiles(self._cache_path, self._impl.filename_base, files._source_stamp)
        # in the version, not in the stamp: an index of other sources may hold types that no longer exist, and must not
        # be read
        self._cache_file._version = (files._version, digest_for(function))

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Store compiled code; if the disk is full, it runs all the same."""
        try:
            super().save_overload(signature, compiled)
        except OSError:
            warn_of_no_cache()


@lru_cache(maxsize=1)
def warn_of_no_cache() -> None:
    """Warn once that compiled code cannot be kept."""
    warnings.warn(
        "compiled kernels cannot be kept, for neither the package's folder nor the user's cache folder can be written: "
        "every process compiles them anew (the environment variable NUMBA_CACHE_DIR names another folder)",
        RuntimeWarning,
        stacklevel=2,
    )
