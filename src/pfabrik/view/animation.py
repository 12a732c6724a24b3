"""`animate`: a path that was followed, as a film."""

from __future__ import annotations

import os
import shutil
from textwrap import shorten
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..answers.solution import Solution
from ..answers.status import Status
from ..answers.tracked import Track
from ..answers.words import as_sentence, short_names
from ..common.checks import require_count, require_ending, require_positive
from ..common.drawing import SMALL, Size, Theme, View
from ..common.extras import require
from ..common.telling import OnProgress, telling
from ..common.whole_files import whole_path
from ..errors import InvalidArgument, MissingLibrary, counted
from .canvas import canvas_on, checked_size, letters_in, usual_size
from .looks import HELD, Look, look_of
from .machine import key_of, machine_eye
from .painter import draw_machine
from .plot_track import checked_track, places_along
from .save_picture import FILMS
from .skeleton import Skeleton, skeleton_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FRAMES_A_SECOND = 20
MOST_FRAMES = 10_000

NARROWEST, CAPTION, DPI = 5.0, 0.45, 100
"""Least width of a film, the height of what is written above it [inches], and pixels an inch."""

COLOURS, SAMPLED, NEARLY = 64, 8, 6
"""Colours of a GIF: enough for smooth edges, and half of the file; frames that they are chosen from; difference from
the ground, of 255, up to which a colour is that of the ground."""


def animate(
    track: Track,
    path: str | os.PathLike[str],
    *,
    seconds: float | None = None,
    view: View | None = None,
    size: tuple[float, float] | None = None,
    theme: Theme = "light",
    dpi: int | None = None,
    on_progress: OnProgress | None = None,
) -> None:
    """Write a film of a path that was followed: the machine, its targets, and the limits that block them.

    Axes and their limits stay the same throughout. The file appears when it is complete, or not at all.

    Parameters
    ----------
    track : Track
        What `track` answered.
    path : str or PathLike
        The film; it ends in ".gif" or ".mp4". The latter needs the program `ffmpeg`.
    seconds : float, optional
        How long it runs; default: as long as the path takes if the track has a `sample_time`, else a twentieth of a
        second a step. There are 20 frames a second, each the step that is due.
    view : str or (float, float), optional
        As in `plot`.
    size : (float, float), optional
        Width and height of the film [inches]. Default: the shape of the machine.
    theme : {"light", "dark"}, optional
        As in `plot`.
    dpi : int, optional
        Pixels an inch; default: 100.
    on_progress : callable, optional
        Called with (frames done, frames in all); default: a line on a terminal, if it takes more than two seconds.

    Raises
    ------
    InvalidArgument
        No Track, one of less than two steps, another ending, no positive time, or no such view, size or theme.
    MissingLibrary
        Matplotlib, or for ".mp4" `ffmpeg`, is not there.
    """
    known = checked_track(track)
    suffix = require_ending(path, FILMS)
    steps = _steps(track, known, seconds)
    require("pictures", "matplotlib", "plot")
    writer = film_writer(suffix)
    if len(known) < 2:
        raise InvalidArgument("track", f"{counted(len(known), 'step')} to show", "two or more: a film shows a motion")
    skeletons = {step: skeleton_of(track[step]) for step in np.unique(steps).tolist()}
    size = None if size is None else checked_size(size, (0.0, 0.0))
    film = _Film(track, skeletons, view, size, require_count("dpi", dpi or DPI), look_of(theme))
    with (
        telling(f"drawing {os.fspath(path)}", on_progress) as tell,
        whole_path(path) as part,
        writer.saving(film.figure, str(part), film.figure.dpi),
    ):
        for done, step in enumerate(steps.tolist(), 1):
            film.show(step)
            writer.grab_frame()
            if tell is not None:
                tell(done, len(steps))


def _steps(track: Track, known: NDArray[np.intp], seconds: float | None) -> NDArray[np.intp]:
    """The step that every frame shows."""
    if seconds is None:
        seconds = len(known) / FRAMES_A_SECOND if track.sample_time is None else len(known) * track.sample_time
    else:
        seconds = require_positive("seconds", seconds)
    frames = int(np.clip(round(seconds * FRAMES_A_SECOND), 1, MOST_FRAMES))
    return known[np.linspace(0, len(known) - 1, frames).round().astype(np.intp)]


def film_writer(suffix: str) -> Any:
    """The writer of films with that ending."""
    from matplotlib import animation, rcParams

    if suffix == ".gif":
        return _gif_writer()
    program = shutil.which(str(rcParams["animation.ffmpeg_path"])) or _own_ffmpeg()
    if program is None:
        command = "your system's packages (apt, brew, winget install ffmpeg), or pip install imageio-ffmpeg"
        raise MissingLibrary("mp4 films", "the program ffmpeg", command)
    rcParams["animation.ffmpeg_path"] = program
    even = ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"]  # what every player shows
    return animation.FFMpegWriter(fps=FRAMES_A_SECOND, codec="h264", extra_args=even)


def _gif_writer() -> Any:
    """A writer of films whose frames have one palette."""
    from matplotlib.animation import PillowWriter
    from PIL import Image

    class OnePalette(PillowWriter):
        def finish(self) -> None:
            frames = [frame.convert("RGB") for frame in self._frames]  # type: ignore[has-type]
            together = np.vstack([np.asarray(frame) for frame in frames[:: -(-len(frames) // SAMPLED)]])
            palette = Image.fromarray(together).quantize(COLOURS)
            colours = np.array(palette.getpalette()).reshape(-1, 3)
            ground = np.array(frames[0].getpixel((0, 0)))
            colours[np.abs(colours - ground).max(axis=1) <= NEARLY] = ground  # which is most of the picture
            palette.putpalette(colours.ravel().tolist())
            self._frames = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
            super().finish()

    return OnePalette(fps=FRAMES_A_SECOND)


def _own_ffmpeg() -> str | None:
    """The program that the package imageio-ffmpeg brings, where it is installed."""
    try:
        from imageio_ffmpeg import get_ffmpeg_exe

        return str(get_ffmpeg_exe())
    except (ImportError, RuntimeError):
        return None


class _Film:
    """One figure, whose machine is drawn anew for each frame."""

    def __init__(
        self, track: Track, skeletons: dict[int, Skeleton], view: View | None, size: Size | None, dpi: int, look: Look
    ) -> None:
        from matplotlib.figure import Figure

        self._track, self._skeletons = track, skeletons
        eye, is_plane = machine_eye(track.mechanism, view)
        everything = np.vstack([places_along(track), *(skeleton.points for skeleton in skeletons.values())])
        width, height = usual_size(everything, eye, is_plane=is_plane)
        size = size or (max(width, NARROWEST), height + CAPTION)
        self.figure: Figure = Figure(figsize=size, dpi=dpi, layout="constrained", facecolor=look.paper)
        heights = (CAPTION, max(size[1] - CAPTION, CAPTION))
        parts = self.figure.subfigures(2, 1, height_ratios=heights, squeeze=False, facecolor=look.paper)
        above, below = np.ravel(parts)
        self._caption = above.text(0.02, 0.9, " ", fontsize=SMALL + 1.0, va="top")
        self._canvas = canvas_on(below.add_subplot(), eye, look, is_plane=is_plane)
        told = next((each for each in skeletons.values() if each.held), next(iter(skeletons.values())))
        self._canvas.frame(everything, track.mechanism.length_unit, key_of(told, look))
        self.figure.draw_without_rendering()
        self.figure.set_layout_engine("none")  # all stays where it is, whatever a caption says
        self._artists: list[Any] = []

    def show(self, step: int) -> None:
        """Draw the machine at a step, the whole target path, and the path achieved so far."""
        for artist in self._artists:
            artist.remove()
        track, canvas = self._track, self._canvas
        look = canvas.look
        self._artists = draw_machine(canvas, self._skeletons[step])
        taken = track.pose[: step + 1, :3, 3]
        targets = track.targets[:, :3, 3]
        self._artists += [
            canvas.line(targets, color=look.asked, linestyle="--", linewidth=1.2, zorder=20),
            canvas.line(taken, color=look.achieved, linewidth=1.8, zorder=21),
            canvas.line(targets[step], marker="x", color=look.asked, markersize=6, zorder=22),
        ]
        colour = look.achieved if track.status[step] == Status.REACHED else HELD
        self._caption.set(text=_caption(track[step], step, len(track), self.figure.get_figwidth()), color=colour)


def _caption(solution: Solution, step: int, steps: int, width: float) -> str:
    """Which step it is, and below what became of it and what holds it back, as far as there is room [inches]."""
    held = short_names(solution._limits[0])
    status = as_sentence(solution).partition(";")[0]
    told = shorten(f"{status}; {held}" if held else status, letters_in(width, SMALL + 1.0), placeholder=" …")
    return f"{solution.mechanism.name}, step {step + 1} of {steps}\n{told}"
