"""Files that appear whole or not at all."""

from __future__ import annotations

import errno
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .checks import require_path


@contextmanager
def whole_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A path to write to, which takes the name `path` only when the block ends without an error, or an interruption.

    Its ending is that of `path`, which writers tell the format by. A file that it replaces leaves it its permissions.
    Where it cannot be written, the error names `path`.
    """
    final = Path(os.path.realpath(require_path("path", path)))  # a link keeps pointing where it points
    if final.is_symlink():  # in circles
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))
    if not final.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
    if final.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    part = final.with_name(f".{final.stem}.{secrets.token_hex(4)}.part{final.suffix}")  # of this writer alone
    try:
        yield part
        if final.exists():
            shutil.copymode(final, part)
        part.replace(final)
    except OSError as error:
        if str(error.filename) != str(part):
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        with suppress(OSError):
            part.unlink()
