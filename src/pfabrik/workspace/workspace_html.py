"""What a notebook shows of a workspace: its size, its ends, what forms its border, and an outline, as HTML."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from ..description.mechanism_html import card
from ..description.sketch import HEIGHT, MARGIN, WIDTH
from .border import REST, groups_of
from .sizes import in_words, kind_of

if TYPE_CHECKING:
    from .region import Region


def workspace_html(found: Region) -> str:
    """Size, ends and parts of the border; over two coordinates, a drawing in the colours of its pictures."""
    if not len(found.faces):
        return card(found.mechanism.name, ["nothing within reach"], ("border", "formed by", "joint"), [], "")
    lines = [in_words(found)]
    for name, low, high, unit in zip(found.names, *found.bounds.tolist(), found.units, strict=True):
        factor, label = (180.0 / np.pi, "deg") if unit == "rad" else (1.0, unit)
        lines.append(f"{name} from {low * factor:.6g} to {high * factor:.6g} {label}")
    rows = [
        (f"{share:.1%}", " ".join(limit).strip(), kind_of(found, limit[0])) for limit, share in found.shares.items()
    ]
    drawing = outline(found) if len(found.names) == 2 else ""
    return card(found.mechanism.name, lines, ("border", "formed by", "joint"), rows, drawing)


def outline(found: Region) -> str:
    """The border over two coordinates as SVG, each limit in its colour and named in a title."""
    spans = np.ptp(found.vertices, axis=0)
    room = np.array([WIDTH, HEIGHT]) - 2.0 * MARGIN
    scale = room / np.where(spans > 0.0, spans, 1.0)
    if len(set(found.units)) == 1:
        scale[:] = scale.min()
    middle = found.vertices.min(axis=0) + 0.5 * spans
    places = (found.vertices - middle) * scale * (1.0, -1.0) + 0.5 * np.array([WIDTH, HEIGHT])
    colours = {limit: group.colour for group in groups_of(found) for limit in group.limits}
    paths = []
    for limit in np.unique(found.face_limit).tolist():
        ends = places[found.faces[found.face_limit == limit]]
        steps = "".join(f"M{x:.1f} {y:.1f}L{u:.1f} {v:.1f}" for (x, y), (u, v) in ends.tolist())
        title = escape(" ".join(found.limits[limit]).strip())
        colour = colours.get(limit, REST)
        paths.append(f'<path d="{steps}" stroke="{colour}" stroke-width="2" fill="none"><title>{title}</title></path>')
    name = escape(f"{found.mechanism.name} over {', '.join(found.names)}")
    size = f'width="{WIDTH:g}" height="{HEIGHT:g}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size} role="img"><title>{name}</title>{"".join(paths)}</svg>'
