"""A workspace in a notebook, as HTML: its size, its ends, the limits that form its border, and an outline."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from ..answers.words import limit_name
from ..description.sketch import HEIGHT, MARGIN, WIDTH
from ..printed import ResultTable
from .border import REST, groups_of
from .sizes import in_words, kind_of

if TYPE_CHECKING:
    from .region import Region

HEADER = ("border", "formed by", "joint")


def workspace_table(region: Region) -> ResultTable:
    """Size, ends and parts of the border; over two coordinates, a drawing in the colours of its pictures."""
    if not len(region.faces):
        return ResultTable(region.mechanism.name, ["nothing within reach"], HEADER)
    lines = [in_words(region)]
    for name, low, high, unit in zip(region.names, *region.bounds.tolist(), region.units, strict=True):
        factor, label = (180.0 / np.pi, "deg") if unit == "rad" else (1.0, unit)
        lines.append(f"{name} from {low * factor:.6g} to {high * factor:.6g} {label}")
    rows = [(f"{share:.1%}", limit_name(*limit), kind_of(region, limit[0])) for limit, share in region.shares.items()]
    drawing = outline(region) if len(region.names) == 2 else ""
    return ResultTable(region.mechanism.name, lines, HEADER, rows, drawing=drawing)


def outline(region: Region) -> str:
    """The border over two coordinates as SVG, each limit in its colour and named in a title."""
    spans = np.ptp(region.vertices, axis=0)
    room = np.array([WIDTH, HEIGHT]) - 2.0 * MARGIN
    scale = room / np.where(spans > 0.0, spans, 1.0)
    if len(set(region.units)) == 1:
        scale[:] = scale.min()
    middle = region.vertices.min(axis=0) + 0.5 * spans
    places = (region.vertices - middle) * scale * (1.0, -1.0) + 0.5 * np.array([WIDTH, HEIGHT])
    colours = {limit: group.colour for group in groups_of(region) for limit in group.limits}
    paths = []
    for limit in np.unique(region.face_limit).tolist():
        ends = places[region.faces[region.face_limit == limit]]
        steps = "".join(f"M{x:.1f} {y:.1f}L{u:.1f} {v:.1f}" for (x, y), (u, v) in ends.tolist())
        title = escape(limit_name(*region.limits[limit]))
        colour = colours.get(limit, REST)
        paths.append(f'<path d="{steps}" stroke="{colour}" stroke-width="2" fill="none"><title>{title}</title></path>')
    name = escape(f"{region.mechanism.name} over {', '.join(region.names)}")
    size = f'width="{WIDTH:g}" height="{HEIGHT:g}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size} role="img"><title>{name}</title>{"".join(paths)}</svg>'
