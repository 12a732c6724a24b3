"""Pictures into files: whole or not at all, with fonts that journals take."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from ..common.checks import require_ending
from ..common.whole_files import whole_path

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PICTURES, FILMS = (".png", ".svg", ".pdf"), (".gif", ".mp4")

SETTINGS: dict[Any, Any] = {"pdf.fonttype": 42, "svg.fonttype": "path", "svg.hashsalt": "pfabrik"}
"""Letters of a PDF as TrueType, those of an SVG as outlines, which look the same everywhere."""

WITHOUT_DATES: dict[str, dict[str, str | None]] = {
    ".png": {"Software": None},
    ".svg": {"Date": None},
    ".pdf": {"CreationDate": None},
}
"""Metadata without dates, so that equal pictures are equal files."""

ROOM = 0.05
"""Free edge around what is drawn [inches]."""


def save_picture(figure: Figure, path: str | os.PathLike[str], *, tight: bool = True, dpi: int | None = None) -> None:
    """Write a picture as PNG, SVG or PDF, as the ending of its name says.

    Parameters
    ----------
    tight : True to crop the picture to the drawing; else it is as large as the figure.
    dpi : pixels an inch; default: the figure's.
    """
    from matplotlib import rc_context

    suffix = require_ending(path, PICTURES)
    box: dict[str, Any] = {"bbox_inches": "tight", "pad_inches": ROOM} if tight else {}
    with whole_path(path) as part, rc_context(SETTINGS):
        figure.savefig(part, dpi=dpi or "figure", metadata=WITHOUT_DATES[suffix], **box)
