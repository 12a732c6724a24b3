"""The line of a rod over a cell of poses, in the bodies at its ends: what cones and hinges there limit."""

from __future__ import annotations

from ...arrays import Record
from .._jit import routine
from ..legs.endings import turned, turned_back
from ..legs.records import COSINE, CRANK, FROM_BASE, Q_PROXIMAL, SINE
from ..vectors import add, along, cross, norm, put, sub, turn, vec
from .affine_forms import ABOVE, AWAY, BOUNDS, CENTRE, ERROR, put_bounds
from .leg_bounds import LegBounds
from .pose_cells import CHORD, CURVATURE, ROUNDING, PoseCell


@routine
def put_base_line(owner: Record, n: int, bounds: LegBounds) -> None:
    """The span in the body at its base end, which a crank turns."""
    span, line, q = bounds.span, bounds.line, bounds.q
    if owner["proximal"] != CRANK:
        for i in range(n):
            put(line[i], vec(span[i]))
        for i in range(CENTRE, BOUNDS + 1):
            put(line[i], vec(span[i]))
        return
    axis, cosine, sine = vec(owner["proximal_axis"]), bounds.values[COSINE], bounds.values[SINE]
    v = vec(span[CENTRE])
    aside, still = cross(axis, v), q[ABOVE] + abs(q[CENTRE] - bounds.values[Q_PROXIMAL])
    travel = still
    for i in range(n):
        put(line[i], turned(along(vec(span[i]), -q[i], aside), axis, cosine, -sine))
        travel += abs(q[i])
    put(line[CENTRE], turned(v, axis, cosine, -sine))
    error, length = span[BOUNDS, ERROR] + travel * span[BOUNDS, AWAY], norm(aside)
    error += length * (still + 0.5 * travel * travel) + ROUNDING * norm(v)
    put_bounds(line, n, error, span[BOUNDS, AWAY] + travel * length)


@routine
def put_platform_line(rod: Record, cell: PoseCell, n: int, bounds: LegBounds) -> None:
    """The span in the body at its platform end."""
    span, line, pose, sizes = bounds.span, bounds.line, cell.pose, cell.sizes
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
