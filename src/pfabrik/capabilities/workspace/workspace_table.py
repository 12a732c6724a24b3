"""A workspace in words, as a table and, over two coordinates, as an outline in SVG."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from ...answers.words import bound_notes, limit_name
from ...common.arrays import Floats
from ...common.printed import ResultTable
from ...kinematics import has_weak_coordinates, task_remark
from ...machine.description.sketch import HEIGHT, MARGIN, WIDTH
from .border import REST, groups_of

if TYPE_CHECKING:
    from .region import Region

BORDER = ("border", "formed by", "joint")

LEAST_SHARE = 1e-3
"""Share of the whole below which parts are not named in words: single points at the border are such."""

MOST_LIMITS = 12
"""Limits that form the border in a table, at most."""


def workspace_table(region: Region, remarks: Sequence[str]) -> ResultTable:
    """Size, ends, the limits that form the border, and remarks; over two coordinates, a drawing."""
    if not len(region.faces):
        weak = [task_remark(region.mechanism)] if has_weak_coordinates(region.mechanism) else []
        return ResultTable(region.mechanism.name, ["nothing within reach", *weak])
    lines, ends = [in_words(region)], shown(region, region.bounds).T.tolist()
    for name, (low, high), unit in zip(region.names, ends, for_people(region.units)[1], strict=True):
        lines.append(f"{name} from {low:.6g} to {high:.6g} {unit}")
    kinds = {joint.name: joint.type + ", actuated" * bool(joint.actuated) for joint in region.mechanism.joints}
    rows = [(f"{share:.1%}", limit_name(*limit), kinds.get(limit[0], "")) for limit, share in region.shares.items()]
    remarks = [bound_notes([*region.shares][:MOST_LIMITS]), *remarks]
    n_more = len(rows) - MOST_LIMITS
    rows[MOST_LIMITS:] = [("", f"and {n_more} more", "")] if n_more > 0 else []
    drawing = outline(region) if len(region.names) == 2 else ""
    return ResultTable(region.mechanism.name, lines, BORDER, rows, remarks, drawing)


def for_people(units: Sequence[str]) -> tuple[list[float], list[str]]:
    """Factors to the units that people read, and these: degrees in place of radians."""
    factors = [math.degrees(1.0) if unit == "rad" else 1.0 for unit in units]
    return factors, ["deg" if unit == "rad" else unit for unit in units]


def shown(region: Region, points: Floats) -> Floats:
    """Coordinates (..., d) in the units that people read."""
    return np.asarray(points * np.array(for_people(region.units)[0]))


def labels(region: Region) -> list[str]:
    """The coordinates with the units that people read."""
    return [f"{name} [{unit}]" for name, unit in zip(region.names, for_people(region.units)[1], strict=True)]


def in_words(region: Region, *, degrees: bool = True) -> str:
    """The size of a workspace, to the digit that is uncertain, and a bound of its error: "4,970,000 ± 3,000 mm³".

    Parameters
    ----------
    degrees : True for people, who read angles in degrees; else in radians, as `size` has them.
    """
    size, uncertainty, unit = region.size, region.uncertainty, region.size_unit
    if degrees:
        factor = math.degrees(1.0) ** region.units.count("rad")
        size, uncertainty, unit = factor * size, factor * uncertainty, unit.replace("rad", "deg")
    digit = 10.0 ** math.floor(math.log10(uncertainty)) if uncertainty > 0.0 else 1.0
    bound = digit * math.ceil(uncertainty / digit + 0.5 * (uncertainty > 0.0))  # holds for the rounded size too
    return f"{rounded(size, uncertainty)} ± {rounded(bound, uncertainty)} {unit}"


def rounded(value: float, uncertainty: float) -> str:
    """A number to the first digit of its uncertainty."""
    if not uncertainty > 0.0:
        return f"{value:,.6g}"
    digits = -math.floor(math.log10(uncertainty))
    return f"{round(value, digits):,.{max(digits, 0)}f}"


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
