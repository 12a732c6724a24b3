"""The line of a rod over a cell of poses, in the bodies at its ends: what cones and hinges there limit.

The part of a line along an axis fixed in a body is formed without turning the line. With R the rotation of the body
and H = p + R h the platform end, (R a) . (H - E) = (R a) . (p - E) + a . h: what is turned is the axis alone.
"""

from __future__ import annotations

from ...arrays import Floats
from .._jit import routine
from ..legs.endings import turned_back
from ..legs.records import COSINE, CRANK, FROM_BASE, Q_PROXIMAL, SINE, Table
from ..vectors import Vec, cross, dot, norm, put, scale, sub, turn, vec
from .affine_forms import (
    ABOVE,
    AWAY,
    BELOW,
    BOUNDS,
    CENTRE,
    ERROR,
    put_along,
    put_bounds,
    put_moved,
    put_product,
    put_turned,
)
from .leg_bounds import LegBounds
from .pose_cells import CHORD, CURVATURE, ROUNDING, SHIFT, PoseCell


@routine
def put_along_line(
    table: Table,
    m: int,
    k: int,
    at_base_end: bool,
    axis: Vec,
    uncertain: float,
    n: int,
    cell: PoseCell,
    bounds: LegBounds,
    a: Floats,
) -> None:
    """The part of the line of rod `m`, on the proximal joint of leg `k`, along an axis fixed in the body at one end."""
    rod, owner, values = table.legs[m], table.legs[k], bounds.values
    if not at_base_end:
        put_along_platform_line(table, m, axis, uncertain, n, cell, bounds, a)
    elif owner["proximal"] == CRANK:
        centre, joint = vec(owner["proximal_point"]), vec(owner["proximal_axis"])
        put_moved(bounds.end, centre, n, bounds.v)
        put_turned(axis, joint, values[COSINE], values[SINE], values[Q_PROXIMAL], bounds.q, n, bounds.w)
        put_product(bounds.w, bounds.v, n, a)
        a[CENTRE] -= dot(axis, sub(vec(rod["base_end_point"]), centre))
    else:
        put_along(bounds.span, axis, n, a)


@routine
def put_along_platform_line(
    table: Table, m: int, axis: Vec, uncertain: float, n: int, cell: PoseCell, bounds: LegBounds, a: Floats
) -> None:
    """The part along an axis fixed in the body at the platform end: the base, of a leg read from the platform."""
    rod, pose, sizes, v, w = table.legs[m], cell.pose, cell.sizes, bounds.v, bounds.w
    is_from_base, p, reach = rod["frame"] == FROM_BASE, (pose[0, 3], pose[1, 3], pose[2, 3]), norm(axis)
    start = p if is_from_base else vec(table.task[0]["reference"])
    for i in range(n):
        motion = cell.motions[i]
        put(v[i], sub(vec(motion), vec(bounds.base[i])) if is_from_base else scale(-1.0, vec(bounds.base[i])))
        turning = cross(vec(motion[3:]), turn(pose, axis) if is_from_base else axis)
        put(w[i], turning if is_from_base else scale(-1.0, turned_back(pose, turning)))
    put(v[CENTRE], sub(start, vec(bounds.base[CENTRE])))
    put(w[CENTRE], turn(pose, axis) if is_from_base else turned_back(pose, axis))
    rounded = 4.0 * uncertain + ROUNDING * (norm(start) + norm(vec(bounds.base[CENTRE])))
    shift = sizes[SHIFT] if is_from_base else 0.0
    put_bounds(v, n, bounds.base[BOUNDS, ERROR] + rounded, bounds.base[BOUNDS, AWAY] + shift + rounded)
    put_bounds(w, n, (sizes[CURVATURE] + ROUNDING) * reach, (sizes[CHORD] + ROUNDING) * reach)
    put_product(w, v, n, a)
    point = vec(rod["platform_end_point"])
    if not is_from_base:
        point = sub(point, p)
        for i in range(n):
            a[i] -= dot(axis, vec(cell.motions[i]))
    a[CENTRE] += dot(axis, point)
    rounded = ROUNDING * reach * (norm(point) + norm(p))
    a[BELOW] -= rounded
    a[ABOVE] += rounded
