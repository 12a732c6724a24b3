"""Pictures that commands write."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from ..checks import require_ending
from ..extras import require


@contextmanager
def picture(path: Path, quiet: bool = False) -> Iterator[None]:
    """Write to a file what a block draws in one new figure, and say so; a name that cannot be, before it draws."""
    from ..view.save_picture import PICTURES, save_picture

    require_ending(path, PICTURES)
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
