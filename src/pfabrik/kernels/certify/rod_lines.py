"""The line of a rod over a cell of poses, in the bodies at its ends: what cones and hinges there limit."""

from __future__ import annotations

from ...arrays import Record
from .._jit import routine
from ..legs.endings import turned, turned_back
from ..legs.records import COSINE, CRANK, FROM_BASE, Q_PROXIMAL, SINE
from ..vectors import add, along, cross, norm, put, sub, turn, vec
from .affine_forms import ABOVE, AWAY, BELOW, BOUNDS, CENTRE, ERROR, put_bounds, put_moved
from .leg_bounds import LegBounds
from .pose_cells import CHORD, CURVATURE, ROUNDING, PoseCell


@routine
def put_base_line(rod: Record, owner: Record, n: int, bounds: LegBounds) -> None:
    """The span in the body at its base end: on a crank, Rot(-q) (H - centre) less the lever at home."""
    line, q, values, point = bounds.v, bounds.q, bounds.values, vec(rod["base_end_point"])
    if owner["proximal"] != CRANK:
        put_moved(bounds.span, (0.0, 0.0, 0.0), n, line)
        return
    axis, cosine, sine, centre = vec(owner["proximal_axis"]), values[COSINE], values[SINE], vec(owner["proximal_point"])
    put_moved(bounds.end, centre, n, bounds.w)
    c = vec(bounds.w[CENTRE])
    aside, linear, still = cross(axis, c), 0.0, max(-q[BELOW], q[ABOVE]) + abs(q[CENTRE] - values[Q_PROXIMAL])
    for i in range(n):
        put(line[i], turned(along(vec(bounds.w[i]), -q[i], aside), axis, cosine, -sine))
        linear += abs(q[i])
    put(line[CENTRE], sub(turned(c, axis, cosine, -sine), sub(point, centre)))
    travel = linear + still
    chord, speed, away = min(travel, 2.0), norm(aside), bounds.w[BOUNDS, AWAY]
    rounded = ROUNDING * (norm(c) + norm(point) + norm(centre))
    error = bounds.w[BOUNDS, ERROR] + chord * away + speed * min(still + 0.5 * travel * travel, chord + linear)
    put_bounds(line, n, error + rounded, away + speed * chord + rounded)


@routine
def put_platform_line(rod: Record, cell: PoseCell, n: int, bounds: LegBounds) -> None:
    """The span in the body at its platform end."""
    span, line, pose, sizes = bounds.span, bounds.v, cell.pose, cell.sizes
    v = vec(span[CENTRE])
    length = norm(v)
    if rod["frame"] != FROM_BASE:  # from the body at the base end, the platform, into the base
        base_v = turn(pose, v)
        put(line[CENTRE], base_v)
        for i in range(n):
            put(line[i], add(turn(pose, vec(span[i])), cross(vec(cell.motions[i, 3:]), base_v)))
    else:
        put(line[CENTRE], turned_back(pose, v))
        for i in range(n):
            put(line[i], turned_back(pose, sub(vec(span[i]), cross(vec(cell.motions[i, 3:]), v))))
    error = span[BOUNDS, ERROR] + sizes[CURVATURE] * length + sizes[CHORD] * span[BOUNDS, AWAY] + ROUNDING * length
    put_bounds(line, n, error, span[BOUNDS, AWAY] + sizes[CHORD] * length + ROUNDING * length)
