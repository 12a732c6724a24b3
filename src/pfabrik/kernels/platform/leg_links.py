"""Links of a machine of legs: where they are, and how their distances change with the unknowns of `equations`.

Their bodies are numbered: the base, the platform, or the leg on whose crank or carriage they are.
"""

from __future__ import annotations

from ...arrays import Floats
from .._jit import routine
from ..clearance.link_limits import put_pulls
from ..clearance.link_records import BASE, PLATFORM, LinkLimits
from ..clearance.solids import CAPSULE, KIND
from ..legs.endings import turned
from ..legs.frames import CENTRE
from ..legs.records import COSINE, CRANK, FROM_BASE, Q_PROXIMAL, SINE, Table
from ..vectors import Vec, add, along, cross, dot, move, put, sub, turn, vec
from .equations import LegEvaluation


@routine
def place_links(table: Table, links: LinkLimits, frames: Floats, values: Floats) -> None:
    """Fill the places of all links, with legs evaluated."""
    for i in range(links.home.shape[0]):
        is_capsule = links.sizes[i, KIND] == CAPSULE
        for k in range(4):
            at, body = vec(links.home[i, k]), links.bodies[i, 1 if is_capsule and k == 1 else 0]
            put(links.places[i, k], place_in(table, body, at, is_capsule or k == 0, frames, values))


@routine
def are_on_legs(links: LinkLimits) -> bool:
    """True if some links move with proximal joints."""
    for i in range(links.bodies.shape[0]):
        if max(links.bodies[i, 0], links.bodies[i, 1]) >= 0:
            return True
    return False


@routine
def place_in(table: Table, body: int, at: Vec, is_point: bool, frames: Floats, values: Floats) -> Vec:
    """A point of a body, or a direction in it, given at home, where it is now."""
    if body == BASE:
        return at
    if body == PLATFORM:
        frame = frames[FROM_BASE]
        return move(frame, sub(at, vec(table.task[0]["reference"]))) if is_point else turn(frame, at)
    leg = table.legs[body]
    axis, point = vec(leg["proximal_axis"]), vec(leg["proximal_point"])
    if leg["proximal"] == CRANK:
        lever = turned(sub(at, point) if is_point else at, axis, values[body, COSINE], values[body, SINE])
        return add(point, lever) if is_point else lever
    return along(at, values[body, Q_PROXIMAL], axis) if is_point else at


@routine
def add_pair_slope(
    table: Table, links: LinkLimits, pair: int, excess: float, factor: float, leg_eval: LegEvaluation, out: Floats
) -> None:
    """Add a factor times the derivative of the excess of the pair that was measured last."""
    put_pulls(links, pair, excess, factor)
    for end in range(4):
        body = links.bodies[links.pairs[pair, end // 2], end % 2]
        add_force(table, body, vec(links.pulls[end]), vec(links.pulls[end, 3:]), leg_eval, out)


@routine
def add_force(table: Table, body: int, x: Vec, force: Vec, leg_eval: LegEvaluation, out: Floats) -> None:
    """Add the generalised force of a force at a point of a body."""
    if body == PLATFORM:
        moment = cross(sub(x, vec(leg_eval.frames[FROM_BASE, CENTRE])), force)
        for i in range(3):
            out[i] += force[i]
            out[3 + i] += moment[i]
    elif body >= 0:
        leg = table.legs[body]
        rate = vec(leg["proximal_axis"])
        if leg["proximal"] == CRANK:
            rate = cross(rate, sub(x, vec(leg["proximal_point"])))
        out[table.columns[body]] += dot(force, rate)
