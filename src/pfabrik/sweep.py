"""Millions of poses answered chunk by chunk into files, and resumed where a job was killed."""

from __future__ import annotations

from concurrent.futures import Executor
from hashlib import sha256
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from .common.checks import require_count, require_path
from .common.telling import OnProgress, telling
from .common.whole_files import whole_path
from .errors import InvalidArgument, counted
from .ik import solve_ik
from .machine.description.mechanism import Mechanism, checked_mechanism
from .machine.files import dumps
from .options import Options, checked_options

FIELDS = ("status", "actuators", "pose", "position_error", "rotation_error")
"""Fields of a Solution that a file has."""


def sweep(
    mechanism: Mechanism,
    poses: ArrayLike,
    *,
    into: str | PathLike[str],
    options: Options | None = None,
    executor: Executor | None = None,
    chunk: int = 1 << 17,
    on_progress: OnProgress | None = None,
) -> tuple[Path, ...]:
    """Answer many poses as `solve_ik` does, and write them to files, chunk by chunk.

    A chunk that is in the folder already is not answered again, so that the same call goes on where it was killed.
    Each file, `00000000.npz` and so on by its first pose, has the arrays `status`, `actuators`, `pose`,
    `position_error` and `rotation_error` of a Solution; it is there whole or not at all.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    poses : array (n, 4, 4) or (n, 3)
        Targets as in `solve_ik`; one from `np.load(..., mmap_mode="r")` is read a chunk at a time.
    into : str or PathLike
        The folder, which is made where there is none.
    options : Options, optional
        As in `solve_ik`.
    executor : Executor, optional
        On whose workers each chunk is answered, as in `solve_ik`; files are written here.
    chunk : int, optional
        Poses of a file.
    on_progress : callable, optional
        Called with the poses that are done and their number, behind each chunk.

    Returns
    -------
    tuple of Path
        The files, in the order of the poses.

    Raises
    ------
    InvalidArgument
        Poses of the wrong shape; a folder with answers of another machine, other poses, options or chunks.
    """
    checked_mechanism(mechanism)
    targets, folder, options = np.asanyarray(poses), Path(require_path("into", into)), checked_options(options)
    require_count("chunk", chunk)
    if targets.shape[1:] not in ((4, 4), (3,)) or not len(targets):
        raise InvalidArgument("poses", f"shape {targets.shape}", "(n, 4, 4) or (n, 3)")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise InvalidArgument("into", f"{folder}, which is a file or lies in one", "a folder") from None
    asked, n, files = f"{dumps(mechanism)}{options}".encode(), len(targets), []
    with telling(f"sweep of {counted(n, 'pose')}", on_progress) as tell:
        for first in range(0, n, chunk):
            part, file = np.ascontiguousarray(targets[first : first + chunk]), folder / f"{first:08d}.npz"
            key = sha256(asked + str(part.dtype).encode() + part.tobytes()).hexdigest()
            if not _is_there(file, key):
                try:
                    answers = solve_ik(mechanism, part, options=options, executor=executor)
                except InvalidArgument as error:
                    rows = [first + row for row in error.rows]
                    raise InvalidArgument("poses", error.found, error.expected, rows=rows) from None
                with whole_path(file) as path:
                    np.savez(path, key=key, **{name: getattr(answers, name) for name in FIELDS})
            files.append(file)
            if tell is not None:
                tell(min(first + chunk, n), n)
    return tuple(files)


def _is_there(file: Path, key: str) -> bool:
    """True if a file has the answers that are asked for; InvalidArgument if it has others."""
    if not file.exists():
        return False
    try:
        with np.load(file) as kept:
            known = str(kept["key"])
    except (OSError, ValueError, KeyError):
        known = ""
    if known != key:
        expected = "an empty folder, or one of the same machine, poses, options and chunk"
        raise InvalidArgument("into", f"{file.name}, which has other answers", expected)
    return True
