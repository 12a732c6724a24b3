"""Pictures that commands write."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import click

from ..checks import require_ending
from ..extras import require
from .whole import refuse_input


@contextmanager
def picture(path: Path, inputs: Iterable[Path] = (), quiet: bool = False) -> Iterator[None]:
    """Write to a file what a block draws in one new figure, and say so; a name that cannot be, before it draws."""
    from ..view.saving import PICTURES, save_picture

    ending_checked(path, PICTURES, inputs)
    require("pictures", "matplotlib", "plot")
    import matplotlib
    from matplotlib import pyplot

    matplotlib.use("Agg")  # no window, whatever the user's settings
    yield
    figure = pyplot.gcf()
    try:
        save_picture(figure, path)
    finally:
        pyplot.close(figure)
    if not quiet:
        click.echo(f"wrote {path}", err=True)


def ending_checked(path: Path, endings: Sequence[str], inputs: Iterable[Path]) -> None:
    """Stop where a name ends in another way, or is that of a file that was read."""
    require_ending(path, endings)
    refuse_input(path, inputs)
