"""A machine as one web page: its text, and `export_web`, which writes one that needs no server and no network."""

from __future__ import annotations

import html
import os
import re
from pathlib import Path
from typing import Any

from ...answers.solution import Solution
from ...answers.tracked import Track
from ...common.checks import require_ending
from ...common.memory_image import packed
from ...common.whole_files import whole_path
from ...errors import InvalidArgument
from ...kinematics import model_of
from ...machine.description.mechanism import Mechanism
from ...options import USUAL, Options
from .page_answers import home_answer, page_answer
from .page_data import page_data, why_no_page
from .page_json import as_json
from .tracked_answers import played

FOLDER = Path(__file__).parent

SCRIPTS = (
    *("vectors", "meshes", "canvas", "scene", "gizmo", "engine"),
    *("singular", "slice", "driver", "session", "panel", "player", "gestures", "page"),
)
"""Files of `web`, in the order in which a page has them."""

LIVE_SCRIPTS = ("remote", "live")
"""Those that a page has before them that a program serves."""


def export_web(mechanism: Mechanism, path: str | os.PathLike[str], *, hold_price: float = USUAL.hold_price) -> None:
    """Write a page on which one drags the machine: one file, for any browser, without a server or a network.

    The page answers as `solve_ik` and `solve_fk` do, by the same kernels: drag the platform or the sliders of the
    actuators; out of reach it shows the nearest feasible pose and lights up the limits that stop it. It shows travel,
    working modes and a slice of the workspace, and its address keeps the pose, to be sent as a link. No compiler is
    needed to write it.

    Parameters
    ----------
    mechanism : Mechanism
        A machine whose chains are all legs in closed form, as all parallel machines of the catalogue are.
    path : str or PathLike
        The file, which ends in ".html" or ".htm".
    hold_price : float, optional
        Up to which the nearest poses hold the orientation, as in `Options`.

    Raises
    ------
    InvalidArgument
        Another ending, or a machine that a page cannot answer for; says why.
    """
    require_ending(path, (".html", ".htm"))
    text = exported_page(mechanism, Options(hold_price=hold_price))
    with whole_path(path) as part:
        part.write_text(text, encoding="utf-8")


def exported_page(mechanism: Mechanism, options: Options = USUAL) -> str:
    """The text of a page that answers by itself.

    Raises
    ------
    InvalidArgument
        A machine that a page cannot answer for.
    """
    reason = why_no_page(model_of(mechanism))
    if reason:
        raise InvalidArgument("mechanism", f"'{mechanism.name}': {reason}", "a machine that closed forms answer alone")
    return web_page(mechanism, options)


def web_page(
    mechanism: Mechanism,
    options: Options = USUAL,
    *,
    first: Solution | None = None,
    track: Track | None = None,
    live: dict[str, Any] | None = None,
) -> str:
    """The text of a page.

    Parameters
    ----------
    first : the configuration in which the page opens; None for home.
    track : a path that it plays.
    live : what a page needs to know that a program serves; None for one that is alone.
    """
    data = page_data(mechanism, options)
    answers_itself = "image" in data
    data |= {"first": page_answer(first) if first is not None else None, "live": live}
    if not answers_itself:
        data["homeAnswer"] = home_answer(mechanism)
    if track is not None:
        data["track"] = played(track)
    folder = FOLDER / "web"
    names = [*SCRIPTS[:-1], *(LIVE_SCRIPTS if live is not None else ()), SCRIPTS[-1]]
    script = "\n".join((folder / f"{name}.js").read_text(encoding="utf-8") for name in names)
    filled = {
        "name": html.escape(mechanism.name),
        "style": _unindented((folder / "style.css").read_text(encoding="utf-8")),
        "machine": as_json(data),
        "kernels": packed((FOLDER / "kernels.wasm").read_bytes()) if answers_itself else "",
        "script": _unindented(script),
    }
    page = (folder / "page.html").read_text(encoding="utf-8")
    return re.sub(r"\{(\w+)\}", lambda place: filled[place[1]], page)


def _unindented(text: str) -> str:
    """Text without its indentation and its lines of comment, for a smaller page."""
    lines = (line.strip() for line in text.splitlines())
    return "\n".join(line for line in lines if line and not line.startswith(("//", "/**", "* ")))
