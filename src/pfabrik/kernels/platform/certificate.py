"""Whether no feasible configuration is nearer than where a search has ended, of platforms that do not turn.

A rod from a foot E, which a carrier may move, to a head y keeps to |y - E| = l, or to a bound l of its length. With
multipliers that balance the distance at the place x where a search has ended, and T the target,

    |y - T|^2 / 2  >=  |y - T|^2 / 2 + sum_k (m_k (l_k^2 - |y - E_k|^2) / 2 + b_k . (y - E_k)) + const

holds for every feasible y: the terms are zero, or not positive, there (m > 0 pushes, m < 0 pulls). Here b has the
conditions that are linear in y - E: hinges across, and cones, c . (y - E) >= l cos(half angle); of those that turn with
a crank, b turns too. All of it is convex in y where sum_k m_k < 1, and then least, for carriers moved by q_g, at

    |x - T|^2 / 2 + sum_g f_g(q_g) - |sum_g v_g(q_g)|^2 / (2 (1 - sum_k m_k)),

with f_g = A (cos q - 1) + B sin q and |v_g|^2 = 2 V^2 (1 - cos q) of a hinge, b q - m q^2 / 2 and m^2 q^2 of a slide,
m the sum of the m_k on it. Since |sum_g v_g|^2 <= sum_g |v_g|^2 / s_g for any shares s_g that add up to one, nothing is
nearer, in any working mode, if each carrier has a share with which f_g outweighs its part within the limits of q_g: at
least V^2 / (1 - sum_k m_k) / (most - A), with most the largest A for which f_g is not negative there.

Of an arm, a slide d on a hinge or a hinge on a slide, f_g has d (lean (cos q - 1) + twist sin q) besides. The first is
at least the largest lean d, as if it were part of A; the second at least - w d^2 / 2 + twist^2 / w (cos q - 1) for any
w, here half of what the slide has left.
"""

from __future__ import annotations

import math

from ...arrays import Record
from .._jit import routine
from ..closure.loops import BASE_AXES
from ..free_motions import put_multipliers
from ..legs.answer import deviation
from ..legs.frames import AXES, ZERO
from ..legs.records import (
    BASE_END,
    BASE_LINE,
    CARRIAGE,
    CRANK,
    FROM_BASE,
    HINGE,
    NO_PROXIMAL,
    PLATFORM_END,
    Q_PROXIMAL,
    ROD,
    SLIDE,
    Table,
)
from ..vectors import Vec, add, along, cross, dot, flatten, move, norm, rotate, scale, sub, turn, vec
from .equations import LegEvaluation, direction, has_proximal, main_of, own_row, place
from .lagrangian import put_force
from .limits import AT_BASE_END, AT_PLATFORM_END, cone_slope, seen
from .linearise import linearise
from .records import PlatformObjective
from .search import Search, put_objective

NEARER = 1e-7
"""Share of the square of the distance by which something might be nearer that does not count."""

BALANCED = 1e-7
"""Share of the distance that multipliers may leave unbalanced, and how far off a limit is met that has one [rad or
L]."""


@routine
def is_global(table: Table, row: int, objective: PlatformObjective, search: Search) -> bool:
    """Whether nothing feasible is nearer than `search.best`, as far as can be told; `search.leg_eval` is there then."""
    pose, used, reduced = objective.pose, search.elimination.used, search.first
    if pose.frame != BASE_AXES or objective.values.shape[0] > 0 or used[3] + used[4] + used[5] > 0:
        return False
    for i in range(3):
        if pose.platform[i] != 1.0:
            return False
    if search.leg_eval.rows.shape[0] == 0:
        place(table, search.best, search.leg_eval)
        put_objective(table, row, objective, search.best, search)
    else:
        linearise(table, row, objective, search.best, search, reduced)
        put_force(table, search, search.here)
        put_multipliers(search.here, reduced, search.balance)
    unit, away = search.gradient.unit[0], vec(search.force)
    nearer = NEARER * dot(away, away) / unit
    total, pushing, shares = away, 0.0, 0.0
    for root in range(table.legs.shape[0]):
        force, push, share = share_of(table, root, nearer, search)
        total, pushing, shares = add(total, force), pushing + push, shares + share
    return bool(norm(total) <= BALANCED * norm(away) and shares < unit - pushing)


@routine
def share_of(table: Table, root: int, nearer: float, search: Search) -> tuple[Vec, float, float]:
    """How rods that reach the base by one leg, see `way_of`, hold the platform: with what force, how much they push,
    and what share their carriers need; infinite where these may bring something nearer."""
    reduced, force, pushing, moved = search.leg_eval, ZERO, 0.0, ZERO
    A, B, b, push, lean, twist = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    hinge, slide = -1, -1
    for k in range(root, table.legs.shape[0]):
        first, on_hinge, on_slide = way_of(table, k)
        if first != root:
            continue
        m, at_foot, at_platform_end = hold_of(table, k, search)
        if m == 0.0 and norm(at_foot) + norm(at_platform_end) == 0.0:
            continue
        if (hinge >= 0 and on_hinge not in (-1, hinge)) or (slide >= 0 and on_slide not in (-1, slide)):
            return force, pushing, math.inf
        axes = reduced.frames[table.legs[k]["frame"], AXES:]
        line, at_foot, at_platform_end = (
            turn(axes, vec(reduced.lines[k])),
            turn(axes, at_foot),
            turn(axes, at_platform_end),
        )
        pull = along(scale(m, line), -1.0, at_platform_end)
        force, pushing = add(force, sub(at_foot, pull)), pushing + m
        axis, arm, course = ZERO, ZERO, ZERO
        if on_hinge >= 0:
            hinge, axis = on_hinge, axis_of(table, on_hinge, reduced)
            arm = sub(platform_end_from(table, k, on_hinge, reduced), line)
            crank, turned, rod = flatten(arm, axis), flatten(at_foot, axis), add(line, arm)
            A += dot(pull, crank) + m * dot(crank, crank) + dot(turned, rod)
            B += dot(pull, cross(axis, crank)) + dot(cross(axis, turned), rod)
            moved = add(moved, along(turned, m, crank))
        if on_slide >= 0:
            slide, course = on_slide, axis_of(table, on_slide, reduced)
            b, push = b + dot(sub(pull, at_foot), course), push + m
            turns = on_slide != root
            both = along(pull if turns else at_foot, m, arm)
            lean += dot(both, flatten(course, axis)) if turns else -dot(both, flatten(course, axis))
            twist += dot(both, cross(axis, course))
    share = 0.0
    if slide >= 0 and (b != 0.0 or push != 0.0):
        room = (most_of(table, slide, b, nearer, search) - push) * (0.5 if hinge >= 0 else 1.0)
        if room <= 0.0:
            return force, pushing, math.inf
        share = push * push / room
        if hinge >= 0:
            back, forth = room_of(table, slide, search)
            A += twist * twist / room + (max(lean * back, lean * forth) if lean != 0.0 else 0.0)
    if hinge >= 0 and (A != 0.0 or B != 0.0):
        room = most_of(table, hinge, B, nearer, search) - A
        share = share + dot(moved, moved) / room if room > 0.0 else math.inf
    return force, pushing, share


@routine
def way_of(table: Table, k: int) -> tuple[int, int, int]:
    """The leg by which a rod reaches the base, its own or the first of the arms that it is on, and the hinge and the
    slide on its way there, -1 for none; all -1 where there are more, or it is no such rod."""
    leg, at, first, hinge, slide = table.legs[k], main_of(table, k), -1, -1, -1
    while at >= 0 and leg["kind"] == ROD:
        lead = table.legs[at]
        if (
            lead["at_platform_end"] == 1
            or lead["mirror_of"] >= 0
            or (lead["redundant"] < 0 and lead["frame"] != FROM_BASE)
        ):
            return -1, -1, -1
        if lead["proximal"] == CRANK and hinge < 0:
            hinge = at
        elif lead["proximal"] == CARRIAGE and slide < 0:
            slide = at
        elif lead["proximal"] != NO_PROXIMAL:
            return -1, -1, -1
        first, at = at, lead["redundant"]
    return first, hinge, slide


@routine
def axis_of(table: Table, proximal: int, reduced: LegEvaluation) -> Vec:
    """The axis of a carrier as it is now."""
    lead = table.legs[proximal]
    return turn(reduced.frames[lead["frame"], AXES:], vec(lead["proximal_axis"]))


@routine
def platform_end_from(table: Table, k: int, hinge: int, reduced: LegEvaluation) -> Vec:
    """Where the head of a rod is, from a hinge that it is on."""
    lead = table.legs[hinge]
    frame = reduced.frames[lead["frame"]]
    return turn(frame[AXES:], sub(move(frame, vec(table.legs[k]["platform_end_point"])), vec(lead["proximal_point"])))


@routine
def hold_of(table: Table, k: int, search: Search) -> tuple[float, Vec, Vec]:
    """How much a rod pushes, m, and what else holds it at its foot and at its head, parts of b; times the unit of the
    objective, as the body of the foot sees it."""
    leg, main, leg_eval, multipliers = table.legs[k], main_of(table, k), search.leg_eval, search.hessian.multipliers
    length, ranges, row, pull = norm(vec(leg_eval.lines[k])), table.limited.shape[0], leg["first_row"], 0.0
    at_foot, at_platform_end = ZERO, ZERO
    if has_proximal(leg):
        pull = search.balance[own_row(table, k)]
    elif leg["slides"] == 0:
        pull = search.balance[row]
        row += 1
    if leg["base_end"] == HINGE:
        at_foot = scale(search.balance[row], seen(table, k, main, AT_BASE_END, vec(leg["base_end_axes"][0]), leg_eval))
        row += 1
    if leg["platform_end"] == HINGE:
        at_platform_end = scale(
            search.balance[row], seen(table, k, main, AT_PLATFORM_END, vec(leg["platform_end_axes"][0]), leg_eval)
        )
    u = direction(leg_eval.lines[k])
    for i in range(table.limited.shape[0]):
        limited, at_lo, at_hi = table.limited[i], multipliers[2 * i], multipliers[2 * i + 1]
        if limited["leg"] != k or max(at_lo, at_hi) == 0.0:
            continue
        state, spot, sense = deviation(limited, leg_eval.values), limited["place"], limited["sense"]
        at_lo = at_lo if state - limited["lo"] < BALANCED else 0.0
        at_hi = at_hi if limited["hi"] - state < BALANCED else 0.0
        half = 0.5 * (limited["hi"] - limited["lo"])
        if spot == SLIDE:
            pull += sense * (at_hi - at_lo)
        elif half < math.pi and (
            (spot == BASE_END and leg["base_end"] == HINGE) or (spot == PLATFORM_END and leg["platform_end"] == HINGE)
        ):
            end, hinge = (
                (AT_BASE_END, leg["base_end_axes"]) if spot == BASE_END else (AT_PLATFORM_END, leg["platform_end_axes"])
            )
            middle = rotate(
                u, seen(table, k, main, end, vec(hinge[0]), leg_eval), sense * (limited["lo"] + half - state)
            )
            stretch, lengthwise, push = bound_by(leg, max(at_lo, at_hi) / length, half)
            pull, at_platform_end = pull + stretch, along(at_platform_end, lengthwise, u)
            at_foot = along(at_foot, -push, middle) if end == AT_BASE_END else at_foot
            at_platform_end = along(at_platform_end, -push, middle) if end == AT_PLATFORM_END else at_platform_end
    for i in range(table.cones.shape[0]):
        cone, push = table.cones[i], multipliers[2 * ranges + i]
        if cone["leg"] != k or push == 0.0 or cone_slope(table, cone, leg_eval) < cone["half_angle"] - BALANCED:
            continue
        end = AT_BASE_END if cone["place"] == BASE_LINE else AT_PLATFORM_END
        axis = seen(table, k, main, end, vec(cone["axis"]), leg_eval)
        stretch, lengthwise, push = bound_by(leg, push / length, cone["half_angle"])
        pull, at_platform_end = pull + stretch, along(at_platform_end, lengthwise, u)
        at_foot = along(at_foot, -push, axis) if end == AT_BASE_END else at_foot
        at_platform_end = along(at_platform_end, -push, axis) if end == AT_PLATFORM_END else at_platform_end
    return -pull / length, at_foot, at_platform_end


@routine
def bound_by(leg: Record, push: float, half_angle: float) -> tuple[float, float, float]:
    """What a rod that is kept within an angle from an axis pulls, and is pushed along itself and away from the axis."""
    push /= max(math.sin(half_angle), BALANCED)
    lengthwise = push * math.cos(half_angle)
    if leg["slides"] == 0:
        return lengthwise, 0.0, push
    return 0.0, max(lengthwise, 0.0), push


@routine
def most_of(table: Table, k: int, B: float, nearer: float, search: Search) -> float:
    """The largest A for which a carrier's limits keep f_g from being negative, by more than counts as nothing."""
    most, is_crank = math.inf, table.legs[k]["proximal"] == CRANK
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
    is_crank = table.legs[k]["proximal"] == CRANK
    least, most = (-math.pi, math.pi) if is_crank else (-math.inf, math.inf)
    for i in range(table.limited.shape[0]):
        limited = table.limited[i]
        if limited["leg"] == k and limited["place"] == Q_PROXIMAL:
            state = deviation(limited, search.leg_eval.values)
            lo, hi = limited["lo"] - state, limited["hi"] - state
            if not is_crank or hi - lo < 2.0 * math.pi:
                least, most = (lo, hi) if limited["sense"] > 0.0 else (-hi, -lo)
    return least, most
