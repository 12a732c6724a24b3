"""Closed forms of one branch: where its reach needs no passes. The branch of the solution is the caller's `mode`."""

from __future__ import annotations

import math

from .._jit import inlined
from ..vectors import add, along, cross, dot, flatten, move, norm, put, scale, sub, turn, vec
from .plan import DYAD, LENGTH, RAIL_ROD, STRUT, Configuration, Plan

# Share of L below which a mode's determinant is noise: the branch is stretched or folded and has no side.
NO_SIDE = 1e-7


@inlined
def branch_mode(plan: Plan, b: int, now: Configuration) -> float:
    """Which of two solutions a configuration is on: +1, -1, or 0 where it cannot be told."""
    branch = plan.branches[b]
    carrier = now.carriers[branch["carrier"]]
    first, last = branch["first"], branch["last"]
    length = plan.scalars[LENGTH]
    side = 0.0
    if branch["kind"] == DYAD:
        normal = turn(carrier, vec(branch["normal"]))
        base = vec(now.nodes[first])
        side = dot(normal, cross(sub(vec(now.nodes[last]), base), sub(vec(now.nodes[first + 1]), base))) / length
    elif branch["kind"] == RAIL_ROD:
        side = dot(vec(branch["rail_axis"]), sub(vec(now.nodes[last]), vec(now.nodes[first])))
    if abs(side) < NO_SIDE * length:
        return 0.0
    return 1.0 if side > 0.0 else -1.0


@inlined
def reach_exact(plan: Plan, b: int, now: Configuration, mode: float, slack: float) -> bool:
    """Put branch `b` on its target by closed form; False where the geometry has no solution. Limits are not looked at.

    One solution for a strut, two (`mode`) for a dyad and for a rail with a rod. At full stretch, and up to `slack`
    beyond it, the two coincide.
    """
    branch = plan.branches[b]
    carrier = now.carriers[branch["carrier"]]
    first, last = branch["first"], branch["last"]
    base = move(carrier, vec(plan.nodes[first]["home"]))
    target = move(now.pose, vec(branch["end"]))
    put(now.nodes[last], target)
    if branch["kind"] == STRUT:
        if first != last:
            put(now.nodes[first], base)
        return True
    if branch["kind"] == DYAD:
        put(now.nodes[first], base)
        normal = turn(carrier, vec(branch["normal"]))
        inner, outer = plan.nodes[first + 1]["hi"], plan.nodes[last]["hi"]
        off_plane = dot(normal, sub(target, base))
        if abs(off_plane) > outer:
            return False
        outer = math.sqrt(outer * outer - off_plane * off_plane)
        d = flatten(sub(target, base), normal)
        distance = norm(d)
        if distance <= slack:  # the target is on the base joint: any direction serves: home's
            if abs(inner - outer) > slack:
                return False
            put(now.nodes[first + 1], along(base, inner, turn(carrier, vec(branch["reference"]))))
            return True
        if distance > inner + outer + slack or distance < abs(inner - outer) - slack:
            return False
        d = scale(1.0 / distance, d)
        x = (distance * distance + inner * inner - outer * outer) / (2.0 * distance)
        x = min(max(x, -inner), inner)
        y = mode * math.sqrt(inner * inner - x * x)
        put(now.nodes[first + 1], add(base, add(scale(x, d), scale(y, cross(normal, d)))))
        return True
    # a rail and a rod
    axis = vec(branch["rail_axis"])
    rod = plan.nodes[last]["hi"]
    d = sub(target, base)
    off_rail = norm(flatten(d, axis))
    if off_rail > rod + slack:
        return False
    offset = math.sqrt(max(rod * rod - off_rail * off_rail, 0.0))
    put(now.nodes[first], along(base, dot(axis, d) - mode * offset, axis))
    return True
