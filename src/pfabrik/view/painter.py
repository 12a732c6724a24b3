"""A machine as matplotlib artists: nearer links cross over farther ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..capabilities.clearance.solid_meshes import SolidMesh
from ..capabilities.workspace.surface import face_normals
from ..common.arrays import Floats
from ..machine.description.joints import JointType
from ..tolerances import TOLERANCES
from .canvas import Canvas
from .crossings import cross, far_to_near
from .drawn_parts import Role, role_of
from .eye import SAME
from .looks import HELD, MARKERS, Look
from .skeleton import Line, Skeleton
from .solid import in_the_light

if TYPE_CHECKING:
    from matplotlib.artist import Artist

HALO, INK, BORDER = 2.2, 4.2, 1.8
"""Width of a usual link; of this its border on both sides, and beyond it the ground that parts it from what is farther
[points]."""

PLATE_EDGE, GROUND_EDGE = 1.3, 1.0
"""Widths of the borders of plates and of the ground [points]."""

FRAME = 0.75
"""Width of the bars of a base, against that of a usual link."""

RAIL, RAIL_FILLING = 9.0, 7.4
"""Widths of a rail and of its filling [points]."""

DRIVEN, PASSIVE, SLIDE = 7.4, 5.6, 2.4
"""Diameters of markers of joints, and what that of a carriage is larger by, so that it shows behind a joint in the same
place [points]."""

MARKS_APART = 24.0
"""Distance between neighbouring joints from which on lines and markers have their usual size [points]."""

PENS = (0.65, 1.25)
"""Least and greatest size of lines and markers, against the usual."""

PLATE = 0.93
"""How opaque plates are."""

SOLID, SEAM = 0.6, 0.4
"""Share of its colour that a thick link has, the rest is paper; width of the lines that close its faces [points]."""

CROSS, CROSS_WIDTH = 9.0, 1.6
"""Size of the cross at the reference point, and width of its lines [points]."""


@dataclass(frozen=True)
class Stroke:
    """Lines (n, 3) of one link that are drawn together, each with its width against the usual one; or a plate."""

    outlines: tuple[Floats, ...]
    widths: tuple[float, ...]
    filling: str
    edge: str
    is_plate: bool = False


def draw_machine(canvas: Canvas, skeleton: Skeleton, *, zorder: float = 2.0) -> list[Artist]:
    """The ground, rails, bodies, reference point and joints, as artists that can be removed again.

    They are drawn between `zorder` and one more, on axes whose limits are set.
    """
    look, pen = canvas.look, pen_of(canvas, skeleton)
    artists = _draw_ground(canvas, skeleton, zorder, pen)
    strokes = _strokes(skeleton, look)
    order = far_to_near([canvas.eye.seen(each.outlines[0]) for each in strokes], [each.is_plate for each in strokes])
    for place, index in enumerate(order):
        at = zorder + 0.3 + 0.4 * place / len(order)
        artists += _draw_stroke(canvas, strokes[index], at, pen)
    for mark in sorted(skeleton.marks, key=lambda mark: float(canvas.eye.seen(mark.place)[2])):
        style = marker_style(mark.joint.type, bool(mark.joint.actuated), bool(mark.held_by), look, pen)
        is_carriage = mark.joint.type == "prismatic" and mark.joint.along is None
        style["markersize"] += SLIDE * pen * is_carriage
        at = zorder + (0.75 if is_carriage else 0.8)
        artists.append(canvas.line(mark.place, linestyle="", zorder=at, **style))
    for colour, more in ((look.paper, 1.4), (look.ink, 0.0)):
        cross = {"marker": "+", "markersize": CROSS * min(pen, 1.0) + more, "markeredgewidth": CROSS_WIDTH + more}
        artists.append(canvas.line(skeleton.reference, color=colour, linestyle="", zorder=zorder + 0.9, **cross))
    return artists


def _draw_ground(canvas: Canvas, skeleton: Skeleton, zorder: float, pen: float) -> list[Artist]:
    """What is behind all: the base, rails, and how thick links are."""
    look = canvas.look
    faces, edges = look.faces["base"], look.edges["base"]
    base = [line for line in skeleton.parts if line.part.role == "base"]
    plates = [line.corners for line in base if line.part.kind == "plate"]
    if not plates and len(skeleton.ground) and not any(line.part.kind == "arc" for line in base):
        plates = [skeleton.ground]
    style: dict[str, Any] = {"facecolor": faces, "edgecolor": edges, "linewidth": GROUND_EDGE}
    artists: list[Artist] = [canvas.face(corners, zorder=zorder, **style) for corners in plates]
    for line in base if not plates else ():
        artists += _draw_stroke(canvas, Stroke((line.outline,), (FRAME,), faces, edges), zorder, pen)
    for rail in skeleton.rails:
        for colour, width in ((edges, RAIL), (faces, RAIL_FILLING)):
            style = {"color": colour, "linewidth": width * pen, "solid_capstyle": "round"}
            artists.append(canvas.line(rail, zorder=zorder + 0.1, **style))
    for solid in sorted(skeleton.solids, key=lambda each: float(canvas.eye.seen(each.vertices)[:, 2].mean())):
        artists += _draw_solid(canvas, solid, role_of(skeleton.mechanism, solid.body), zorder + 0.2)
    return artists


def _draw_solid(canvas: Canvas, solid: SolidMesh, role: Role, zorder: float) -> list[Artist]:
    """A convex solid in the light, pale, in the colour of its body, darker if it is nearest to another, or orange."""
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgb

    look = canvas.look
    colour = HELD if solid.is_stopped else look.soft if solid.is_nearest else look.faces[role]
    corners = solid.vertices[solid.faces]
    normals = face_normals(corners)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    is_seen = normals @ canvas.eye.axes[2] > 0.0
    shades = in_the_light(normals[is_seen], canvas.eye, np.array(to_rgb(colour)))
    pale = SOLID * shades + (1.0 - SOLID) * np.array(to_rgb(look.paper))
    style: dict[str, Any] = {"facecolors": pale, "edgecolors": pale, "linewidths": SEAM, "zorder": zorder}
    faces = canvas.axes.add_collection(PolyCollection(list(canvas.seen(corners[is_seen])), **style), autolim=False)
    edge = {"facecolor": "none", "edgecolor": HELD if solid.is_stopped else look.edges["base"]}
    return [faces, canvas.face(_silhouette(canvas, solid.vertices), zorder=zorder, linewidth=GROUND_EDGE, **edge)]


def _silhouette(canvas: Canvas, vertices: Floats) -> Floats:
    """Those of the corners (n, 3) of a convex solid that are its border on the screen, in order around it."""
    flat = canvas.seen(vertices)
    border: list[int] = []
    for places in (np.lexsort(flat.T[::-1]), np.lexsort(flat.T[::-1])[::-1]):  # one half, then the other
        chain: list[int] = []
        for place in places.tolist():
            while len(chain) > 1 and cross(flat[chain[-1]] - flat[chain[-2]], flat[place] - flat[chain[-1]]) <= 0.0:
                chain.pop()  # where one turns right
            chain.append(place)
        border += chain[:-1]
    return vertices[border]


def _strokes(skeleton: Skeleton, look: Look) -> list[Stroke]:
    """What is drawn in front of the ground: both parts of a strut together, and nothing that is a point.

    The links of a joint at its limit are orange, and thick ones that stop the machine or overlap; the two that are
    nearest to each other are darker.
    """
    strokes: list[Stroke] = []
    nearest = {solid.body for solid in skeleton.solids if solid.is_nearest}
    stopped = {solid.body for solid in skeleton.solids if solid.is_stopped}
    parts = [line for line in skeleton.parts if line.part.role != "base"]
    corners = np.vstack([np.zeros((0, 3)), *(line.corners for line in parts if line.part.kind == "plate")])
    off = np.abs(corners - skeleton.reference).max(axis=1)
    is_at_corner = bool((off <= SAME * _extent(skeleton.points)).any())
    barrels: dict[tuple[str, ...], Line] = {line.part.joints: line for line in parts if line.part.kind == "barrel"}
    for line in parts:
        part = line.part
        is_stem = () in part.ends  # which a corner at the reference point makes needless
        if part.kind == "barrel" or _extent(line.outline) == 0.0 or (is_stem and is_at_corner):
            continue
        drawn = [line, *([barrels[part.joints]] if part.joints in barrels else [])]
        widths = tuple(float(np.sqrt(each.part.radius)) for each in drawn)
        is_held = bool(skeleton.held & set(part.joints)) or part.body in stopped
        filling = HELD if is_held else look.soft if part.body in nearest else look.faces[part.role]
        outlines = tuple(each.outline for each in drawn)
        strokes.append(Stroke(outlines, widths, filling, look.edges[part.role], part.kind == "plate"))
    return strokes


def _extent(points: Floats) -> float:
    """The longest side of the box around points (n, 3) [length]."""
    return float(np.ptp(points, axis=0).max())


def _draw_stroke(canvas: Canvas, stroke: Stroke, zorder: float, pen: float) -> list[Artist]:
    """A plate, or lines with a border and some ground around."""
    from matplotlib.patheffects import Normal
    from matplotlib.patheffects import Stroke as Around

    filling, edge = stroke.filling, stroke.edge
    if stroke.is_plate:
        style: dict[str, Any] = {"facecolor": filling, "edgecolor": edge, "linewidth": PLATE_EDGE * pen, "alpha": PLATE}
        return [canvas.face(stroke.outlines[0][:-1], zorder=zorder, **style)]
    artists = []
    for outline, width in zip(stroke.outlines, stroke.widths, strict=True):
        around: list[Any] = [
            Around(linewidth=(INK * width + HALO) * pen, foreground=canvas.look.paper, capstyle="butt"),
            Around(linewidth=INK * width * pen, foreground=edge),
            Normal(),
        ]
        style = {"color": filling, "linewidth": (INK * width - BORDER) * pen, "solid_capstyle": "round"}
        artists.append(canvas.line(outline, zorder=zorder, path_effects=around, **style))
    return artists


def pen_of(canvas: Canvas, skeleton: Skeleton) -> float:
    """The thickness of lines and size of markers: less where joints are so close together that markers would meet."""
    places = np.array([mark.place for mark in skeleton.marks])
    apart = np.linalg.norm(places[:, None] - places, axis=2) * canvas.points_per_length
    same = TOLERANCES.alignment * _extent(skeleton.points) * canvas.points_per_length
    nearest = np.where(apart > same, apart, np.inf).min(axis=1)
    nearest = nearest[np.isfinite(nearest)]
    return float(np.clip(np.median(nearest) / MARKS_APART, *PENS)) if len(nearest) else 1.0


def marker_style(kind: JointType, actuated: bool, held: bool, look: Look, pen: float = 1.0) -> dict[str, Any]:
    """The style of a joint's marker: shape by type, filled if it is actuated, orange at a limit."""
    colour = HELD if held else look.ink
    return {
        "marker": MARKERS[kind],
        "markersize": (DRIVEN if actuated else PASSIVE) * pen,
        "markerfacecolor": colour if actuated else look.paper,
        "markeredgecolor": colour,
        "markeredgewidth": 1.8 * pen if held else 0.9 * pen,
    }
