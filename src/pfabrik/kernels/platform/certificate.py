"""Whether no feasible configuration is nearer than where a search has ended, of platforms that do not turn.

A rod from a foot E, which a carrier may move, to a head y keeps to |y - E| = l, or to a bound l of its length. With
multipliers that balance the distance at the place x where a search has ended, and T the target,

    |y - T|^2 / 2  >=  |y - T|^2 / 2 + sum_k (m_k (l_k^2 - |y - E_k|^2) / 2 + b_k . (y - E_k)) + const

holds for every feasible y: the terms are zero, or not positive, there (m > 0 pushes, m < 0 pulls). Here b has the
conditions that are linear in y - E: hinges across, and cones, c . (y - E) >= l cos(half angle); of those that turn with
a crank, b turns too. All of it is convex in y where sum_k m_k < 1, and then least, for carriers moved by q_g, at

    |x - T|^2 / 2 + sum_g f_g(q_g) - |sum_g v_g(q_g)|^2 / (2 (1 - sum_k m_k)),

with f_g = A (cos q - 1) + B sin q and |v_g|^2 = 2 V^2 (1 - cos q) of a crank, B q - A q^2 / 2 and V^2 q^2 of a
carriage. Since |sum_g v_g|^2 <= sum_g |v_g|^2 / s_g for any shares s_g that add up to one, nothing is nearer, in any
working mode, if each carrier has a share with which f_g outweighs its part within the limits of q_g: at least
V^2 / (1 - sum_k m_k) / (most - A), with most the largest A for which f_g is not negative there.
"""

from __future__ import annotations

import math

from ...arrays import Record
from .._jit import routine
from ..closure.loops import BASE_AXES
from ..free_motions import put_multipliers
from ..legs.answer import deviation
from ..legs.frames import NOWHERE
from ..legs.records import CARRIAGE, CARRIER, CRANK, FOOT, FOOT_LINE, FROM_BASE, HEAD, HINGE, ROD, SHARED, SLIDE, Table
from ..legs.rods import carried_foot
from ..vectors import Vec, add, along, cross, dot, flatten, norm, rotate, scale, sub, vec
from .equations import direction, is_carried, own_row, place
from .lagrangian import put_force
from .limits import AT_FOOT, AT_HEAD, cone_slope, seen
from .linearise import linearise
from .records import Aim
from .search import Search, put_objective

NEARER = 1e-7
"""Share of the square of the distance by which something might be nearer that does not count."""

BALANCED = 1e-7
"""Share of the distance that multipliers may leave unbalanced, and how far off a limit is met that has one [rad or
L]."""


@routine
def is_global(table: Table, row: int, aim: Aim, search: Search) -> bool:
    """Whether nothing feasible is nearer than `search.best`, as far as can be told; `search.look` is there then."""
    pose, used, view = aim.pose, search.elimination.used, search.first
    if pose.frame != BASE_AXES or aim.values.shape[0] > 0 or used[3] + used[4] + used[5] > 0:
        return False
    for i in range(3):
        if pose.platform[i] != 1.0:
            return False
    if search.look.rows.shape[0] == 0:
        place(table, search.best, search.look)
        put_objective(table, row, aim, search.best, search)
    else:
        linearise(table, row, aim, search.best, search, view)
        put_force(table, search, search.here)
        put_multipliers(search.here, view, search.balance)
    unit, away = search.gradient.unit[0], vec(search.force)
    nearer = NEARER * dot(away, away) / unit
    total, pushing, shares, k = away, 0.0, 0.0, 0
    while k < table.legs.shape[0]:
        main, A, B, v = k, 0.0, 0.0, NOWHERE
        while k < table.legs.shape[0] and (k == main or table.legs[k]["carrier"] == SHARED):
            m, b, e = hold_of(table, k, main, search)
            line, (spoke, tangent, axis) = vec(search.look.lines[k]), arm_of(table, k, main, search)
            total, pushing, pull = add(along(total, -m, line), b), pushing + m, sub(scale(m, line), b)
            A += dot(pull, spoke) + m * dot(tangent, tangent) - dot(line, flatten(e, axis)) - 2.0 * dot(e, spoke)
            B += dot(pull, tangent) - dot(line, cross(axis, e))
            v = add(v, along(scale(m, tangent), -1.0, cross(axis, e)))
            k += 1
        room = most_of(table, main, B, nearer, search) - A
        if room <= 0.0 and (A != 0.0 or B != 0.0):
            return False
        shares += dot(v, v) / room if room > 0.0 else 0.0
    return bool(norm(total) <= BALANCED * norm(away) and shares < unit - pushing)


@routine
def hold_of(table: Table, k: int, main: int, search: Search) -> tuple[float, Vec, Vec]:
    """How much a rod pushes, m, what else holds it, b, and what of - b turns with its crank, e; times the unit of the
    objective."""
    leg, lead, look, multipliers = table.legs[k], table.legs[main], search.look, search.hessian.multipliers
    if leg["kind"] != ROD or leg["frame"] != FROM_BASE:
        return 0.0, NOWHERE, NOWHERE
    length, ranges, row, pull = norm(vec(look.lines[k])), table.limited.shape[0], leg["first_row"], 0.0
    at_foot, at_head = NOWHERE, NOWHERE
    if is_carried(leg):
        pull = search.balance[own_row(table, k)]
    elif leg["slides"] == 0:
        pull = search.balance[row]
        row += 1
    if leg["foot"] == HINGE:
        at_foot = scale(search.balance[row], seen(table, k, main, AT_FOOT, vec(leg["foot_axes"][0]), look))
        row += 1
    if leg["head"] == HINGE:
        at_head = scale(search.balance[row], seen(table, k, main, AT_HEAD, vec(leg["head_axes"][0]), look))
    u = direction(look.lines[k])
    for i in range(table.limited.shape[0]):
        limited, at_lo, at_hi = table.limited[i], multipliers[2 * i], multipliers[2 * i + 1]
        if limited["leg"] != k or max(at_lo, at_hi) == 0.0:
            continue
        now, spot, sense = deviation(limited, look.values), limited["place"], limited["sense"]
        at_lo = at_lo if now - limited["lo"] < BALANCED else 0.0
        at_hi = at_hi if limited["hi"] - now < BALANCED else 0.0
        half = 0.5 * (limited["hi"] - limited["lo"])
        if spot == SLIDE:
            pull += sense * (at_hi - at_lo)
        elif half < math.pi and ((spot == FOOT and leg["foot"] == HINGE) or (spot == HEAD and leg["head"] == HINGE)):
            end, hinge = (AT_FOOT, leg["foot_axes"]) if spot == FOOT else (AT_HEAD, leg["head_axes"])
            middle = rotate(u, seen(table, k, main, end, vec(hinge[0]), look), sense * (limited["lo"] + half - now))
            stretch, lengthwise, push = bound_by(leg, max(at_lo, at_hi) / length, half)
            pull, at_head = pull + stretch, along(at_head, lengthwise, u)
            at_foot = along(at_foot, -push, middle) if end == AT_FOOT else at_foot
            at_head = along(at_head, -push, middle) if end == AT_HEAD else at_head
    for i in range(table.cones.shape[0]):
        cone, push = table.cones[i], multipliers[2 * ranges + i]
        if cone["leg"] != k or push == 0.0 or cone_slope(table, cone, look) < cone["half_angle"] - BALANCED:
            continue
        end = AT_FOOT if cone["place"] == FOOT_LINE else AT_HEAD
        axis = seen(table, k, main, end, vec(cone["axis"]), look)
        stretch, lengthwise, push = bound_by(leg, push / length, cone["half_angle"])
        pull, at_head = pull + stretch, along(at_head, lengthwise, u)
        at_foot = along(at_foot, -push, axis) if end == AT_FOOT else at_foot
        at_head = along(at_head, -push, axis) if end == AT_HEAD else at_head
    return -pull / length, add(at_foot, at_head), scale(-1.0 if lead["carrier"] == CRANK else 0.0, at_foot)


@routine
def bound_by(leg: Record, push: float, half_angle: float) -> tuple[float, float, float]:
    """What a rod that is kept within an angle from an axis pulls, and is pushed along itself and away from the axis."""
    push /= max(math.sin(half_angle), BALANCED)
    lengthwise = push * math.cos(half_angle)
    if leg["slides"] == 0:
        return lengthwise, 0.0, push
    return 0.0, max(lengthwise, 0.0), push


@routine
def arm_of(table: Table, k: int, main: int, search: Search) -> tuple[Vec, Vec, Vec]:
    """The foot of a rod as seen from the axis of its crank, its velocity by the carrier's coordinate, and that axis;
    of a carriage, the velocity alone."""
    lead, foot = table.legs[main], carried_foot(table.legs[k], table.legs[main], search.look.values[main])
    axis = vec(lead["carrier_axis"])
    if lead["carrier"] == CRANK:
        arm = flatten(sub(foot, vec(lead["carrier_point"])), axis)
        return arm, cross(axis, arm), axis
    return NOWHERE, axis if lead["carrier"] == CARRIAGE else NOWHERE, NOWHERE


@routine
def most_of(table: Table, k: int, B: float, nearer: float, search: Search) -> float:
    """The largest A for which a carrier's limits keep f_g from being negative, by more than counts as nothing."""
    most, is_crank = math.inf, table.legs[k]["carrier"] == CRANK
    for end in room_of(table, k, search):
        if B * end < -nearer:
            return -math.inf
        if B * end > nearer:
            most = min(most, B / math.tan(0.5 * end) if is_crank else 2.0 * B / end)
        elif abs(end) > BALANCED:
            most = min(most, 0.0)
    return most


@routine
def room_of(table: Table, k: int, search: Search) -> tuple[float, float]:
    """How far a carrier may go on from where it is, either way."""
    is_crank = table.legs[k]["carrier"] == CRANK
    least, most = (-math.pi, math.pi) if is_crank else (-math.inf, math.inf)
    for i in range(table.limited.shape[0]):
        limited = table.limited[i]
        if limited["leg"] == k and limited["place"] == CARRIER:
            now = deviation(limited, search.look.values)
            lo, hi = limited["lo"] - now, limited["hi"] - now
            if not is_crank or hi - lo < 2.0 * math.pi:
                least, most = (lo, hi) if limited["sense"] > 0.0 else (-hi, -lo)
    return least, most
