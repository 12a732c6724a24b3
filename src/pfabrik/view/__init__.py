"""Pictures, which need the extra ``plot``, and a page for the browser, alone or served."""

from collections.abc import Callable
from importlib import import_module
from typing import Any

PICTURES = {
    "Design": "design_picture.plot_design",
    "Efforts": "effort_picture.plot_efforts",
    "SingularityMap": "singular_picture.plot_singular_map",
    "SingularityTrack": "singular_picture.plot_singular_track",
    "PassTrace": "trace_picture.plot_trace",
    "Workspace": "workspace_picture.plot_workspace",
}
"""What draws results that lie below this package, by their classes."""


def picture_of(name: str) -> Callable[..., Any]:
    """What draws the results of a class; its module is imported when it is first asked for."""
    module, _, function = PICTURES[name].rpartition(".")
    drawing: Callable[..., Any] = getattr(import_module(f".{module}", __name__), function)
    return drawing
