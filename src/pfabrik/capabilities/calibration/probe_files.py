"""What probes of printers wrote: lines of logs, and height maps of beds."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats
from ...common.cells import is_finite
from ...common.text_lines import WrongText

_NUMBER = r"([-+]?\d+\.?\d*(?:[eE][-+]?\d+)?)"

TOUCHES = (
    (re.compile(rf"\bprobe at {_NUMBER}, *{_NUMBER} is z *= *{_NUMBER}"), False),
    (re.compile(rf"\bprobe: at {_NUMBER}, *{_NUMBER} bed will contact at z *= *{_NUMBER}"), True),
    (re.compile(rf"\bBed X: *{_NUMBER} +Y: *{_NUMBER} +Z: *{_NUMBER}"), True),
)
"""Lines of Klipper, of its releases from 2025 on, and of Marlin, each with x, y and z; and whether these are where the
bed is touched, or where the nozzle is then."""

BEGINNINGS = ("Start printer at", "Restarting printer")
"""Lines of Klipper's log at which a session begins: settings of those before it may have been others."""

MAP = "RepRapFirmware height map file"
"""The beginning of RepRapFirmware's heightmap.csv."""

LABELS = {
    "xmin,xmax,ymin,ymax,radius,spacing,xnum,ynum": "min0 max0 min1 max1 radius spacing0 num0 num1",
    "xmin,xmax,ymin,ymax,radius,xspacing,yspacing,xnum,ynum": "min0 max0 min1 max1 radius spacing0 spacing1 num0 num1",
    "axis0,axis1,min0,max0,min1,max1,radius,spacing0,spacing1,num0,num1": "axis0 axis1 min0 max0 min1 max1 radius "
    "spacing0 spacing1 num0 num1",
}
"""Second lines of height maps, by the firmware's version, and what their columns are called since 3.3."""

NOT_PROBED = "0"
"""A cell of a point without a height; a height has decimals."""


class Touches(NamedTuple):
    """Places of the nozzle, as the firmware counts them, at which it found the bed.

    Attributes
    ----------
    places : (n, 3) [length].
    names : what the file calls each, n.
    """

    places: Floats
    names: list[str]


def touches_of(lines: Iterable[str], probe_offset: Sequence[float]) -> Touches | None:
    """The touches in the lines of a log or a height map; None where there are none.

    Parameters
    ----------
    probe_offset : x, y, z of the probe from the nozzle, z at its trigger [length].
    """
    begun = iter(lines)
    first = next((line for line in begun if line.strip()), "")
    if first.lstrip("\ufeff").startswith(MAP):
        places, names = zip(*_of_map(begun, 2), strict=True)
        return Touches(np.array(places) + [-probe_offset[0], -probe_offset[1], probe_offset[2]], list(names))
    found: list[tuple[list[float], str]] = []
    for number, line in enumerate(chain([first], begun), 1):
        if line.startswith(BEGINNINGS):
            found = []
        if line.startswith("#"):
            continue
        for pattern, is_of_bed in TOUCHES if "robe" in line or "Bed" in line else ():
            match = pattern.search(line)
            if match:
                x, y, z = map(float, match.groups())
                shift = probe_offset if is_of_bed else (0.0, 0.0, 0.0)
                found.append(([x - shift[0], y - shift[1], z + shift[2]], f"line {number}"))
    if not found:
        return None
    return Touches(np.array([place for place, _ in found]), [name for _, name in found])


def _of_map(lines: Iterator[str], begin: int) -> Iterator[tuple[list[float], str]]:
    """Places and names of the probed points of a height map."""
    label = next(lines, "").strip()
    if label not in LABELS:
        raise WrongText(f"line {begin}: found '{label[:40]}'; expected {list(LABELS)[-1]}")
    cells = [cell.strip() for cell in next(lines, "").split(",")]
    said = dict(zip(LABELS[label].split(), cells, strict=False))
    axes = said.pop("axis0", "X"), said.pop("axis1", "Y")
    if len(cells) != len(LABELS[label].split()) or not all(map(is_finite, said.values())) or axes != ("X", "Y"):
        raise WrongText(f"line {begin + 1}: found '{','.join(cells)[:40]}'; expected numbers of a grid in X and Y")
    x, y, dx = (float(said[name]) for name in ("min0", "min1", "spacing0"))
    dy, n_x, n_y = float(said.get("spacing1", dx)), float(said["num0"]), float(said["num1"])
    n_points, n_rows = 0, 0
    for row, line in enumerate(lines):
        heights = [cell.strip() for cell in line.split(",")]
        if heights == [""]:
            continue
        if len(heights) != n_x or row >= n_y or not all(map(is_finite, heights)):
            raise WrongText(f"line {begin + 2 + row}: found '{line.strip()[:40]}'; expected {n_x:g} heights")
        n_rows += 1
        for column, height in enumerate(heights):
            if height != NOT_PROBED:
                n_points += 1
                yield [x + dx * column, y + dy * row, float(height)], f"line {begin + 2 + row}, point {column + 1},"
    if n_rows != n_y:
        raise WrongText(f"{n_rows} of the {n_y:g} rows that its line {begin + 1} says; expected the whole map")
    if not n_points:
        raise WrongText("no point that was probed; expected heights")
