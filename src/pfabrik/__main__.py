"""The `pfabrik` command, also as ``python -m pfabrik``."""

from __future__ import annotations

import os
import sys

INTERRUPTED = 130

ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""Matrices are small here: threads of the linear algebra would only wait for each other, and on a busy machine long."""


def main() -> None:
    """Run the command; an interruption while it is still being loaded ends it as one that comes later does."""
    os.environ.update({name: os.environ.get(name, value) for name, value in ONE_THREAD.items()})
    try:
        from .cli import main as command

        command()
    except KeyboardInterrupt:
        sys.stderr.write("pfabrik: interrupted\n")
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
