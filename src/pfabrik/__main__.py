"""The `pfabrik` command, also as ``python -m pfabrik``."""

from __future__ import annotations

import sys

INTERRUPTED = 130


def main() -> None:
    """Run the command; an interruption while it is still being loaded ends it as one that comes later does."""
    try:
        from .cli import main as command

        command()
    except KeyboardInterrupt:
        sys.stderr.write("pfabrik: interrupted\n")
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
