"""Loops told by names: frames `closing_<name>_1` and `closing_<name>_2` on two bodies meet, as drawings are exported.

Where there are frames of the same names with `_z` behind them, which are off along an axis, they are hinged about it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from ..arrays import Floats
from ..tolerances import TOLERANCES
from .cuts import unique
from .opened import Loop, Note, frame_along

CLOSING = re.compile(r"(closing_.+)_([12])")
"""How a frame is called that meets another: the loop's name, and which of its two sides it is."""


def closing_loops(
    places: Mapping[str, tuple[str, Floats]], known: Sequence[Loop], taken: Iterable[str], told: list[Note]
) -> list[Loop]:
    """The loops that frames tell by their names, but for those that are known.

    Parameters
    ----------
    places : frame -> its body, and where it is.
    known : loops that are told otherwise, at rest or not.
    taken : names that loops must not have.
    """
    sides: dict[str, dict[str, str]] = {}
    for frame in places:
        match = CLOSING.fullmatch(frame)
        if match:
            sides.setdefault(match[1], {})[match[2]] = frame
    alone = tuple(frame for pair in sides.values() if len(pair) == 1 for frame in pair.values())
    if alone:
        told.append(Note("a closing frame without the other one closes no loop", alone))
    names, loops = set(taken), []
    for name, pair in sides.items():
        if len(pair) == 2:
            loop = _loop(unique(name, names), (pair["1"], pair["2"]), places)
            loops += [] if any(_is_there(loop, other) for other in known) else [loop]
    for kind, what in (("spherical", "balls"), ("revolute", "hinges")):
        of_kind = tuple(loop.name for loop in loops if loop.type == kind)
        if of_kind:
            told.append(Note(f"loops that closing frames tell of, as {what}", of_kind))
    return loops


def _loop(name: str, frames: tuple[str, str], places: Mapping[str, tuple[str, Floats]]) -> Loop:
    """The loop of two frames: a hinge where both have another one along its axis, else a ball."""
    bodies = (places[frames[0]][0], places[frames[1]][0])
    points = np.array([places[frame][1] for frame in frames])
    along = [places.get(f"{frame}_z") for frame in frames]
    axes = np.array([point if end is None else end[1] for point, end in zip(points, along, strict=True)]) - points
    if not np.linalg.norm(axes, axis=1).all():
        return Loop(name, "spherical", bodies, points)
    return Loop(name, "revolute", bodies, points, np.array([frame_along(axis) for axis in axes]))


def _is_there(loop: Loop, other: Loop) -> bool:
    """Whether another loop joins the same two bodies at the same place on each."""
    points = dict(zip(other.connects, other.at, strict=True))
    return set(points) == set(loop.connects) and all(
        np.linalg.norm(points[body] - point) <= TOLERANCES.file_gap
        for body, point in zip(loop.connects, loop.at, strict=True)
    )
