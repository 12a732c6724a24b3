"""Outputs: whole or not at all, and never in place of a file that was read, nor of another output."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, TextIO

import click

from ..common.checks import require_ending
from ..common.extras import require
from ..common.whole_files import whole_path
from ..errors import InvalidArgument
from ..view.save_picture import PICTURES
from .options import Decorator, together
from .printing import note

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..common.drawing import Theme, View

STANDARD = Path("-")
"""Standard input or output, in place of a file."""


def standard_if_so_named(context: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    """Standard output also by the name that systems have for it."""
    return STANDARD if path == Path("/dev/stdout") else path


OUTPUT: dict[str, Any] = {"type": click.Path(path_type=Path, allow_dash=True), "callback": standard_if_so_named}
"""Settings of an option that takes a file to write."""

force_option = click.option("--force", is_flag=True, help="Replace the file if it exists.")


def check_outputs(
    outputs: Sequence[tuple[str, Path | None]], inputs: Iterable[Path] = (), *, as_json: bool = False
) -> None:
    """Stop if an output would overwrite a file that was read, or another output; note where one is a link.

    Parameters
    ----------
    outputs : options, each with its path, or None where it is not given.
    inputs : files that are read, by any name or link, ``-`` for standard input.
    as_json : True if JSON goes to standard output.
    """
    given = [(option, path) for option, path in outputs if path is not None]
    if as_json:
        given.append(("--json", STANDARD))
    for _, path in given:
        if path != STANDARD and any(is_same_file(path, read, sys.stdin) for read in inputs):
            raise click.UsageError(f"{path}: found a file that was read; expected another file")
    for (option, path), (other_option, other) in combinations(given, 2):
        if is_one_place(path, other):
            both = " and ".join(dict.fromkeys((f"{option} {path}", f"{other_option} {other}")))
            raise click.UsageError(f"{both}: found one place for two outputs; expected a place for each")
    for _, path in given:
        is_device = path.exists() and not path.is_file() and not path.is_dir()
        if path.is_symlink() and not real(path).is_symlink() and not is_device:
            note(f"{path} is a link; {real(path)} is written")


def refuse_both_on_stdout(output: Path | None, as_json: bool) -> None:
    """Stop if ``-o -`` and ``--json`` are both given."""
    if as_json and output == STANDARD:
        raise click.UsageError("-o - and --json both print on stdout: give one of them")


def refuse_existing(path: Path, force: bool) -> None:
    """Stop if an output would replace a file, unless that is wanted."""
    if path.is_dir():
        raise click.ClickException(f"{path}: is a folder; expected the name of a file")
    if path != STANDARD and path.is_file() and not force:
        raise click.ClickException(f"{path}: exists already; --force replaces it")


def require_format(path: Path, known: Sequence[str]) -> None:
    """Stop if a file that is to be written has an ending of no format; the message has the option that was typed."""
    try:
        require_ending(path, known)
    except InvalidArgument as error:
        context = click.get_current_context()
        values = [(each.opts[0], context.params.get(each.name or "")) for each in context.command.params]
        option = next(name for name, value in values if value == path or (isinstance(value, tuple) and path in value))
        raise click.UsageError(f"{option}{str(error).removeprefix(error.argument)}") from error


def require_picture(path: Path | None, known: Sequence[str] = PICTURES) -> None:
    """Stop before the work begins where a picture or film that is wanted cannot be written."""
    if path is not None:
        require_format(path, known)
        require("pictures", "matplotlib", "plot")


def is_same_file(path: Path, other: Path, standard: TextIO) -> bool:
    """True if a path leads to another file, or to the one behind a standard stream where that is ``-``."""
    if other != STANDARD:
        return path.exists() and other.exists() and path.samefile(other)
    try:
        return path.is_file() and os.path.samestat(path.stat(), os.fstat(standard.fileno()))
    except (OSError, ValueError):  # the stream is closed, or no file at all
        return False


def is_one_place(path: Path, other: Path) -> bool:
    """True if two outputs would be one file, by whatever names or links."""
    if STANDARD in (path, other):
        path, other = (other, path) if path == STANDARD else (path, other)
        return path == STANDARD or is_same_file(path, other, sys.stdout)
    return real(path) == real(other) or is_same_file(path, other, sys.stdout)


def real(path: Path) -> Path:
    """A path without links, but for those that lead round in circles."""
    return Path(os.path.realpath(path))


def say_wrote(path: Path, more: str = "") -> None:
    """Say on stderr which file was written, and what comes next or is in it."""
    click.echo(f"wrote {path}{more}", err=True)


@contextmanager
def whole_file(path: Path, more: str = "") -> Iterator[TextIO]:
    """A text file for writing that takes the name `path` only when the block ends without an error, and then says so.

    It is opened at once, so an unwritable place is found before the work begins. A device or pipe, and standard output
    for ``-``, is written directly.

    Parameters
    ----------
    more : as of `say_wrote`.
    """
    if path == STANDARD:
        yield sys.stdout
        sys.stdout.flush()  # so that a failure to write is reported
        return
    if path.exists() and not path.is_file():
        with path.open("w", newline="", encoding="utf-8") as direct:
            yield direct
        return
    with whole_path(path) as part, part.open("x", newline="", encoding="utf-8") as handle:
        yield handle
    say_wrote(path, more)


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """An empty folder beside `path` that goes when the block ends; a failure speaks of `path`, which the user knows."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        folder = TemporaryDirectory(
            prefix=f".{path.name}.", suffix=".part", dir=path.parent, ignore_cleanup_errors=True
        )
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error
    with folder as part:
        yield Path(part)


@contextmanager
def whole_folder(path: Path) -> Iterator[Path]:
    """A folder to fill; its files move into `path` only when the block ends without an error."""
    path = real(path)
    if path.exists() and not path.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(path))
    with new_folder(path) as part:
        yield part
        path.mkdir(exist_ok=True)
        for item in sorted(part.iterdir()):
            item.replace(path / item.name)


@dataclass(frozen=True)
class PictureOptions:
    """The values of ``--view``, ``--size`` [inches], ``--theme`` and ``--dpi``; None where one is not given."""

    view: View | None = None
    size: tuple[float, float] | None = None
    theme: Theme = "light"
    dpi: int | None = None

    @property
    def looks(self) -> dict[str, Any]:
        """Size and theme, as functions take them that draw something without a view."""
        return {"size": self.size, "theme": self.theme}

    @property
    def in_space(self) -> dict[str, Any]:
        """View, size and theme, as functions take them that draw a machine."""
        return {"view": self.view, **self.looks}


def pictured(*, with_view: bool = True) -> Decorator:
    """Adds ``--view``, ``--size``, ``--dpi`` and ``--theme``, which a command gets as one `drawn`."""
    options = [
        click.option("--size", callback=_size, metavar="WxH", help="Width and height of a picture [inches]."),
        click.option("--dpi", type=click.IntRange(10, 2400), metavar="N", help="Pixels an inch."),
        click.option("--theme", type=click.Choice(["light", "dark"]), help="Colours for this ground. Default: light."),
    ]
    if with_view:
        seen = "Where it is seen from: top, front, side, iso, or elevation and azimuth [deg]."
        options.insert(0, click.option("--view", callback=_view, metavar="NAME|EL,AZ", help=seen))
    return together("drawn", _picture_options, *options)


def _picture_options(
    size: tuple[float, float] | None, dpi: int | None, theme: Theme | None, view: View | None = None
) -> PictureOptions:
    if size is not None and size[0] * size[1] * (dpi or USUAL_DPI) ** 2 > MOST_PIXELS:
        raise click.UsageError(f"--size and --dpi: expected a picture of at most {MOST_PIXELS:,} pixels")
    return PictureOptions(view, size, theme or "light", dpi)


USUAL_DPI, MOST_PIXELS = 150, 100_000_000
"""Pixels an inch where no other number is asked for, and pixels of a picture at most: more takes gigabytes."""


def _view(context: click.Context, parameter: click.Parameter, words: str | None) -> View | None:
    """A direction by name or by two angles [deg]."""
    if words is None:
        return None
    from ..view.eye import VIEWS, eye_of

    try:
        view: Any = words if words in VIEWS else tuple(map(float, words.split(",")))
        eye_of(view)
    except ValueError:
        names = ", ".join(VIEWS)
        expected = f"{names}, or EL,AZ: elevation from -90 to 90 and azimuth [deg]"
        raise click.UsageError(f"--view: found '{words}'; expected {expected}") from None
    return view  # type: ignore[no-any-return]


def _size(context: click.Context, parameter: click.Parameter, words: str | None) -> tuple[float, float] | None:
    """Width and height [inches]."""
    if words is None:
        return None
    from ..view.canvas import checked_size

    try:
        return checked_size(tuple(map(float, words.lower().split("x"))), (0.0, 0.0))
    except ValueError:
        raise click.UsageError(f"--size: found '{words}'; expected WxH in inches, such as 6x4") from None


def note_no_picture(*without: str) -> None:
    """Note the options of a picture that are given where there is none."""
    context = click.get_current_context()
    for name in ("view", "size", "dpi", "theme"):
        if name in context.params and context.params[name] is not None:
            note(f"--{name} has no effect without {' or '.join(without)}")


def write_picture(
    path: Path, draw: Callable[[], Axes | Figure | Mapping[str, Axes]], drawn: PictureOptions | None = None
) -> None:
    """Write to a file the figure that a function draws and returns, or of which it returns the axes, and say so.

    It is cropped to what is drawn, unless a size is asked for.
    """
    from ..view.save_picture import save_picture

    require_picture(path)
    import matplotlib
    from matplotlib import pyplot

    matplotlib.use("Agg")  # no window, whatever the user's settings
    drawn = drawn or PictureOptions()
    shown: Any = draw()
    figure = (next(iter(shown.values())) if isinstance(shown, Mapping) else shown).figure.figure
    if drawn.size is not None:
        figure.set_size_inches(drawn.size)
    try:
        save_picture(figure, path, tight=drawn.size is None, dpi=drawn.dpi)
    finally:
        pyplot.close(figure)
    say_wrote(path)
