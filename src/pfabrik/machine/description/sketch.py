"""A small drawing of a mechanism as SVG, in its plane or from above, and where joints are drawn."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from html import escape

import numpy as np

from ...common.arrays import Floats
from ...tolerances import TOLERANCES
from .joints import Joint
from .structure import Structure

Places = dict[str, Floats]


def joint_places(mechanism: Structure, points: Mapping[str, Floats] | None, reference: Floats) -> Places:
    """Where each joint is drawn [length]: at its centre or, if it is prismatic and has none, near by.

    Parameters
    ----------
    points : joint centres of an answer, as `Solution.points`; None is home.
    reference : where the reference point is: a place for joints in a machine that has no centre at all.
    """
    if points is None:
        places = {joint.name: np.array(joint.at) for joint in mechanism.joints if joint.at is not None}
    else:
        places = {name: np.asarray(point) for name, point in points.items()}
    waiting = [joint for joint in mechanism.joints if joint.name not in places]
    while waiting:
        found = {joint.name: slider_place(mechanism, joint, places) for joint in waiting}
        placed = {name: place for name, place in found.items() if place is not None}
        places |= placed or dict.fromkeys(found, reference)  # a gantry of slides has no centre at all
        waiting = [joint for joint in waiting if joint.name not in places]
    return {joint.name: places[joint.name] for joint in mechanism.joints}


def slider_place(mechanism: Structure, joint: Joint, places: Places) -> Floats | None:
    """Where a prismatic joint is drawn: amid the joints of its larger moving body, or between two of equal size."""
    if joint.along is not None:
        return middle([places[name] for name in joint.along])
    moving = [body for body in joint.connects if body != mechanism.base]
    sides = [[places[name] for name in joints_on(mechanism, body) if name in places] for body in moving]
    most = max(map(len, sides))
    return middle([middle(side) for side in sides if len(side) == most]) if most else None


def joints_on(mechanism: Structure, body: str) -> list[str]:
    """Names of the joints of a body."""
    return [joint.name for joint in mechanism.joints if body in joint.connects]


def middle(points: list[Floats]) -> Floats:
    """The mean of some points."""
    return np.asarray(np.mean(points, axis=0))


WIDTH, HEIGHT, MARGIN = 260.0, 200.0, 14.0
"""Size of the picture, and room around what is drawn [pixels]."""

RADIUS, HALF_SIDE = 3.5, 5.0
"""Sizes of a joint's circle, and of a slide's square, which is to be seen behind a joint in the same place [pixels]."""

VIEWER = np.array([1.0, -1.0, 1.0]) / math.sqrt(3.0)
"""Where a machine in space, or a plane, is seen from: x to the right, y to the back, z up, all at one scale."""

BASE, END_EFFECTOR, LINK, ACTUATED, PASSIVE = "#9a9a9a", "#0072b2", "#6a6a6a", "#1a1a1a", "#ffffff"
HELD = "#d55e00"
"""Colour of a joint that is at a limit, in every picture, and of nothing else here."""


def sketch(
    mechanism: Structure,
    points: Mapping[str, Floats] | None = None,
    reference: Floats | None = None,
    held: Collection[str] = (),
) -> str:
    """An SVG element: bodies as lines and faces between their joints, joints as circles, actuated ones filled.

    Squares are prismatic joints, and a cross marks the reference point. Joints at a limit are orange. Each marker has
    its joint's name as title.

    Parameters
    ----------
    points : mapping of str to array (3,), optional
        Joint centres of an answer [length]; default those at home.
    reference : array (3,), optional
        Reference point of an answer [length]; default that at home.
    held : collection of str, optional
        Names of the joints that are at a limit.
    """
    home = mechanism.home_pose[:3, 3]
    centre = home if reference is None else reference
    places = joint_places(mechanism, points, centre)
    plane = _plane_of_view(np.array(list(joint_places(mechanism, None, home).values())))
    flat = np.array([*places.values(), centre]) @ plane.T * (1.0, -1.0)  # y points down in a picture
    low, extents = flat.min(axis=0), np.ptp(flat, axis=0)
    room = np.array([WIDTH, HEIGHT]) - 2.0 * MARGIN
    scale = min((side / extent for side, extent in zip(room, extents, strict=True) if extent > 0.0), default=1.0)
    drawn = np.array([WIDTH, HEIGHT]) / 2.0 + scale * (flat - low - extents / 2.0)
    spots = dict(zip(places, drawn[:-1], strict=True))
    x, y = drawn[-1]
    slides, others = ([j for j in mechanism.joints if (j.type == "prismatic") is it] for it in (True, False))
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH:g}" height="{HEIGHT:g}" role="img">',
        f"<title>{escape(mechanism.name)}</title>",
        *(_body(mechanism, body, spots, drawn[-1]) for body in mechanism.bodies),
        f'<path d="M{x - 5:.1f} {y:.1f}h10M{x:.1f} {y - 5:.1f}v10" stroke="{END_EFFECTOR}"/>',
        *(_square(_style(joint, held), *spots[joint.name]) for joint in slides),
        *(_circle(_style(joint, held), *spots[joint.name]) for joint in others),
        "</svg>",
    ]
    return "".join(parts)


def _plane_of_view(places: Floats) -> Floats:
    """The directions that are drawn to the right and up, unit vectors as rows (2, 3)."""
    spreads, axes = np.linalg.svd(places - places.mean(axis=0))[1:]
    is_planar = len(places) >= 3 and spreads[2] <= TOLERANCES.alignment * spreads[0] < spreads[1]
    return seen_along(axes[2] if is_planar else VIEWER)


def seen_along(normal: Floats) -> Floats:
    """The directions to the right and up, unit vectors (2, 3), as one looks along a line from the viewer's side."""
    normal = normal * np.copysign(1.0, normal @ VIEWER)
    upward = next(each for each in np.eye(3)[[2, 1]] if np.linalg.norm(np.cross(each, normal)) > TOLERANCES.alignment)
    right = np.cross(upward, normal)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(normal, right)]) + 0.0  # no negative zeros


def _body(mechanism: Structure, body: str, spots: Places, reference: Floats) -> str:
    """A body between its joints: a line for two, a face for more; of an end effector also the way to its reference."""
    corners = [spots[name] for name in joints_on(mechanism, body)]
    colour = {mechanism.base: BASE, mechanism.end_effector: END_EFFECTOR}.get(body, LINK)
    middle = np.mean(corners, axis=0)
    corners.sort(key=lambda corner: math.atan2(*(corner - middle)[::-1]))
    face = f'fill="{colour}" fill-opacity="0.25"' if len(corners) > 2 else 'fill="none"'
    outline = f'stroke="{colour}" stroke-width="{2 if colour == LINK else 3}" stroke-linejoin="round"'
    listed, tip = (" ".join(f"{x:.1f},{y:.1f}" for x, y in spots) for spots in (corners, (middle, reference)))
    tool = f'<polyline points="{tip}" {outline}/>' if colour == END_EFFECTOR else ""
    return f'<polygon points="{listed}" {face} {outline}/>{tool}'


def _square(style: str, x: float, y: float) -> str:
    corner, side = f'x="{x - HALF_SIDE:.1f}" y="{y - HALF_SIDE:.1f}"', 2.0 * HALF_SIDE
    return f'<rect {corner} width="{side:g}" height="{side:g}" {style}</rect>'


def _circle(style: str, x: float, y: float) -> str:
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{RADIUS:g}" {style}</circle>'


def _style(joint: Joint, held: Collection[str]) -> str:
    """The rest of a marker: its colours, and as its title the name, with ``*`` where it is actuated."""
    colour = HELD if joint.name in held else ACTUATED if joint.actuated else PASSIVE
    return f'fill="{colour}" stroke="#1a1a1a"><title>{escape(joint.name)}{"*" * bool(joint.actuated)}</title>'
