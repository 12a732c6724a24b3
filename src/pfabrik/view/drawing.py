"""A line drawing of a mechanism: its bodies as lines and polygons through their joints, at home or in an answer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]
from numpy.typing import NDArray

from ..description.joint_types import KINDS
from ..description.places import Places, joint_places, joints_on, middle
from ..errors import InvalidArgument

if TYPE_CHECKING:
    from ..answers.solution import Solution
    from ..description.mechanism import Joint, Mechanism

Floats = NDArray[np.float64]

# Lightness tells base, platform and links apart, and actuated from passive joints, without any colour.
BASE, PLATFORM, LINK, EDGE, ACTUATED, PASSIVE = "#c8c8c8", "#79b4d9", "#4d4d4d", "#1a1a1a", "#d55e00", "#ffffff"
MARKERS = {"revolute": "o", "prismatic": "s", "universal": "D", "spherical": "^", "cylindrical": "h", "fixed": "X"}
SIZES = {"prismatic": 42.0}  # seen behind a joint that a carriage has in the same place
SIZE = 20.0
ALMOST_FLAT = 1e-6  # of the largest extent: below it the machine is planar, and seen from the front
THINNEST = 0.15  # of the largest extent: the least that the axes of a planar machine span across its plane
MARGIN = 1.08
ZOOM = 0.92  # leaves room for the labels of tall machines
TICKS = 5  # at most, on the longest axis


def draw(mechanism: Mechanism, solution: Solution | None = None, axes: Any = None, beside: Floats | None = None) -> Any:
    """Draw a mechanism in space; a planar one along the normal of its plane.

    Joints are markers by type, actuated ones filled; links are lines, and bodies with three or more joints polygons.
    A prismatic joint without a centre is drawn at its carriage, or between its neighbours; one on the base has a rail.
    A cross marks the reference point.

    Parameters
    ----------
    solution : one answer of this mechanism; home by default.
    axes : three-dimensional matplotlib axes to draw on; by default those of a new figure, which is `axes.figure`.
    beside : points (n, 3) in the base frame that are to lie within the picture too.

    Returns
    -------
    The axes.

    Raises
    ------
    InvalidArgument : a batch, or an answer of another mechanism.
    """
    check(mechanism, solution)
    axes = Figure(figsize=(6, 5), dpi=120).add_subplot(projection="3d") if axes is None else axes
    reference = mechanism.home_pose[:3, 3] if solution is None else solution.pose[:3, 3]
    places = joint_places(mechanism, None if solution is None else solution.points, reference)
    rails = {joint.name: rail for joint in mechanism.joints if (rail := rail_of(mechanism, joint, places, solution))}
    for body in mechanism.bodies:
        draw_body(axes, mechanism, body, body_points(mechanism, body, places, rails))
    for low, high in rails.values():
        draw_lines(axes, [low, high], color=EDGE, linewidth=0.9, linestyle=(0, (4, 2)))
    draw_reference(axes, mechanism, places, reference)
    draw_joints(axes, mechanism, places)
    axes.set(**{f"{name}label": f"{name} [{mechanism.length_unit}]" for name in "xyz"})
    ends = [end for rail in rails.values() for end in rail]
    set_view(axes, np.array([*places.values(), reference, *ends, *([] if beside is None else beside)]))
    return axes


def check(mechanism: Mechanism, solution: Solution | None) -> None:
    """Refuse what cannot be drawn as one configuration of the mechanism."""
    if solution is None:
        return
    if solution.mechanism != mechanism:
        raise InvalidArgument("solution", f"a solution of '{solution.mechanism.name}'", f"one of '{mechanism.name}'")
    if solution.shape != ():
        raise InvalidArgument("solution", f"a batch of shape {solution.shape}", "one answer, such as solution[0]")


def rail_of(
    mechanism: Mechanism, joint: Joint, places: Places, solution: Solution | None
) -> tuple[Floats, Floats] | None:
    """Both ends of the travel of a prismatic joint on the base; None for any other, and without limits."""
    if joint.type != "prismatic" or joint.along or joint.range is None or mechanism.base not in joint.connects:
        return None
    if not np.isfinite(joint.range).all():
        return None
    value = mechanism.home_coordinate(joint.name) if solution is None else solution.joints[joint.name]
    outward = np.array(mechanism.home_axis(joint.name)) * (1.0 if joint.connects[0] == mechanism.base else -1.0)
    low, high = (places[joint.name] + (bound - value) * outward for bound in np.array(joint.range))
    return low, high


def body_points(
    mechanism: Mechanism, body: str, places: Places, rails: dict[str, tuple[Floats, Floats]]
) -> list[Floats]:
    """Where a body is held: at its joints; the base at the middle of its rails, so that it rests where they move."""
    names = joints_on(mechanism, body)
    at_rails = body == mechanism.base
    return [middle(list(rails[name])) if at_rails and name in rails else places[name] for name in names]


def draw_body(axes: Any, mechanism: Mechanism, body: str, points: list[Floats]) -> None:
    """A body: base and end effector light and broad, links dark and narrow."""
    if body in (mechanism.base, mechanism.end_effector):
        colour = BASE if body == mechanism.base else PLATFORM
        style: dict[str, Any] = {"color": colour, "linewidth": 4.0, "solid_capstyle": "round"}
        alpha = 0.55
    else:
        colour, alpha = LINK, 0.25
        style = {"color": colour, "linewidth": 1.6}
    if len(points) >= 3:
        points = around(points)
        axes.add_collection3d(polygon(points, facecolor=colour, alpha=alpha))
        style["linewidth"] = min(style["linewidth"], 1.6)
        points = [*points, points[0]]
    draw_lines(axes, points, **style)


def around(points: list[Floats]) -> list[Floats]:
    """Points in the order of their angles about their middle, in the plane that they span most of."""
    offsets = np.array(points) - middle(points)
    first, second = np.linalg.svd(offsets, full_matrices=False)[2][:2]
    angles = np.arctan2(offsets @ second, offsets @ first)
    return [points[index] for index in np.argsort(angles.round(6), kind="stable")]


def polygon(points: list[Floats], **style: Any) -> Any:
    """A filled polygon."""
    return Poly3DCollection([np.array(points)], linewidth=0, **style)


def draw_lines(axes: Any, points: list[Floats], **style: Any) -> None:
    """Straight lines from point to point; nothing for fewer than two."""
    if len(points) >= 2:
        axes.plot(*np.transpose(points), zorder=1, **style)


def draw_reference(axes: Any, mechanism: Mechanism, places: Places, reference: Floats) -> None:
    """The point that targets place, tied to the joints that carry it."""
    if not mechanism.end_effector_is_joint:
        carriers = [places[name] for name in joints_on(mechanism, mechanism.end_effector)]
        draw_lines(axes, [middle(carriers), reference], color=PLATFORM, linewidth=1.6)
    axes.plot(*reference[:, None], marker="+", color=EDGE, markersize=9, zorder=4)


def draw_joints(axes: Any, mechanism: Mechanism, places: Places) -> None:
    """One marker for every joint, prismatic ones behind the others, and a legend of those that occur."""
    kinds = {(joint.type, joint.actuated): None for joint in mechanism.joints}
    for kind, actuated in sorted(kinds, key=lambda each: (each[0] != "prismatic", each)):
        names = [joint.name for joint in mechanism.joints if (joint.type, joint.actuated) == (kind, actuated)]
        axes.scatter(
            *np.transpose([places[name] for name in names]),
            marker=MARKERS[kind],
            s=SIZES.get(kind, SIZE),
            color=ACTUATED if actuated else PASSIVE,
            edgecolors=EDGE,
            linewidths=0.8,
            depthshade=False,
            zorder=2 if kind == "prismatic" else 3,
            label=KINDS[kind].letter + "*" * actuated,
        )
    axes.legend(loc="upper left", frameon=False, fontsize="small", handletextpad=0.1, borderaxespad=0)


def set_view(axes: Any, points: Floats) -> None:
    """Equal scales on all axes, and a planar machine seen from the front, without the axis across its plane."""
    low, high = points.min(axis=0), points.max(axis=0)
    extents, largest = high - low, float(np.max(high - low)) or 1.0
    spans = MARGIN * np.maximum(extents, THINNEST * largest)
    for name, centre, span in zip("xyz", (low + high) / 2.0, spans, strict=True):
        axes.set(**{f"{name}lim": (centre - span / 2.0, centre + span / 2.0)})
        axes.locator_params(axis=name, nbins=max(2, round(TICKS * span / max(spans))))
    axes.set_box_aspect(spans, zoom=ZOOM)
    axes.computed_zorder = False
    flat = np.flatnonzero(extents <= ALMOST_FLAT * largest)
    if len(flat) == 1:
        look_along(axes, int(flat[0]))
    else:
        axes.view_init(elev=22, azim=-58)


def look_along(axes: Any, across: int) -> None:
    """See the plane that is square to one axis from the front."""
    axes.set_proj_type("ortho")
    axes.view_init(*((0, 0), (0, -90), (90, -90))[across])
    axes.set(**{f"{'xyz'[across]}ticks": []})
    getattr(axes, f"{'xyz'[across]}axis").set_label_text("")
