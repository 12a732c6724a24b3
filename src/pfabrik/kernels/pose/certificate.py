"""Certificate that no feasible configuration is nearer than the end of a search, for platforms that do not turn.

A rod from a base end E, which a proximal joint may move, to a platform end y keeps |y - E| = l, or a bound l of its
length. With multipliers that balance the gradient of the distance at the end x of a search, and T the target,

    |y - T|^2 / 2  >=  |y - T|^2 / 2 + sum_k (m_k (l_k^2 - |y - E_k|^2) / 2 + b_k . (y - E_k)) + const

holds for every feasible y: the terms are zero, or not positive, there (m > 0 pushes, m < 0 pulls). Here b contains the
constraints that are linear in y - E: those of hinges, and of cones, c . (y - E) >= l cos(half angle); if they turn with
a crank, so does b. The right-hand side is convex in y where sum_k m_k < 1, and its minimum over y is then, with
proximal joints moved by q_g,

    |x - T|^2 / 2 + sum_g f_g(q_g) - |sum_g v_g(q_g)|^2 / (2 (1 - sum_k m_k)),

with f_g = A (cos q - 1) + B sin q and |v_g|^2 = 2 V^2 (1 - cos q) for a hinge, b q - m q^2 / 2 and m^2 q^2 for a slide,
m the sum of the m_k on it. Since |sum_g v_g|^2 <= sum_g |v_g|^2 / s_g for any shares s_g with sum one, nothing is
nearer, in any working mode, if each joint has a share with which f_g is at least its part within the limits of q_g: at
least V^2 / (1 - sum_k m_k) / (A_max - A), with A_max the largest A for which f_g is not negative there.

For a redundant joint that carries a proximal joint, a slide d on a hinge or a hinge on a slide, f_g has the further
term d (lean (cos q - 1) + twist sin q). Its first part is at least the largest lean d, as if it were part of A; its
second at least - w d^2 / 2 + twist^2 / w (cos q - 1) for any w, here half of what the slide has left.

Links that are c apart have no two points that are nearer, whatever their shares s and t along links from the base to
the platform: with u = (s - t) y + const from one to the other, m (c^2 - |u|^2) / 2 is not positive, as of a rod at its
shortest, and (s - t)^2 m counts in the sum of the m_k. The shares are those of the nearest points at x.
"""

from __future__ import annotations

import math
from typing import TypeAlias

from .._jit import routine
from ..clearance.link_limits import pair_excess, share_of_end
from ..clearance.link_records import PLATFORM, LinkLimits
from ..clearance.solids import ROUND
from ..free_motions import put_multipliers
from ..joints.loops import BASE_AXES, PoseObjective
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
from ..projecting import is_over
from ..rows import HOLD_ORIENTATION
from ..vectors import Vec, add, along, cross, dot, flatten, move, norm, rotate, scale, sub, turn, vec
from .equations import LegEvaluation, direction, evaluate_legs, has_proximal, length_row, owner_of
from .limits import AT_BASE_END, AT_PLATFORM_END, cone_slope, current_direction, place_links
from .linearise import add_equation_gradient, linearise, put_limited_gradient
from .pose_constants import BALANCED, NEARER
from .search import SearchScratch, put_objective
from .search_records import PlatformObjective

Terms: TypeAlias = tuple[float, float, float, float, float, float, float, int, int]
"""V, A and B of a hinge; m, b, lean and twist of a slide; the hinge, and the slide, -1 for none."""


@routine
def may_be_global(objective: PlatformObjective, search: SearchScratch) -> bool:
    """True if the certificate knows the objective: the distance of a platform that does not turn."""
    pose, used = objective.pose, search.elimination.used
    if pose.frame != BASE_AXES or objective.values.shape[0] > 0 or used[3] + used[4] + used[5] > 0:
        return False
    for i in range(3):
        if pose.platform[i] != 1.0:
            return False
    return True


@routine
def put_forces(table: Table, row: int, objective: PlatformObjective, search: SearchScratch) -> bool:
    """Fill what the objective, limits and equations pull with at `search.best`; False where the effort is over.

    In `search.here` is what of it is left but for what holds a part: the force and moment that this bears.
    """
    if search.leg_eval.rows.shape[0] == 0:
        evaluate_legs(table, search.best, search.leg_eval)
        put_objective(table, row, objective, search.best, search)
        put_limited_gradient(table, search, search.here)
        return True
    if is_over(search.effort[0]):
        return False
    linearise(table, row, objective, search.best, search, search.first)
    put_limited_gradient(table, search, search.here)
    put_multipliers(search.here, search.first, search.equation_multipliers)
    add_equation_gradient(0, search, search.here)
    return True


@routine
def cost_of_hold(pose: PoseObjective, distance: float, search: SearchScratch) -> float:
    """By how much the distance would fall per unit by which the held part gave way, after `put_forces` [L per rad].

    As long as that is less than its price, the configuration is also where a part is nearest up to a price: F grows
    in every direction in which the part gives way.
    """
    first = 3 if pose.hold == HOLD_ORIENTATION else 0
    return norm(vec(search.here[first:])) / (search.gradient.unit[0] * distance)


@routine
def is_global(table: Table, search: SearchScratch) -> bool:
    """True if the certificate holds: nothing feasible is nearer than `search.best`, where `put_forces` was called."""
    unit, gradient = search.gradient.unit[0], vec(search.objective_gradient)
    nearer = NEARER * dot(gradient, gradient) / unit
    total, pushing, shares = gradient, 0.0, 0.0
    for root in range(table.legs.shape[0]):
        leg_force, push, share = leg_share(table, root, nearer, search)
        total, pushing, shares = add(total, leg_force), pushing + push, shares + share
    links_force, push = terms_of_links(table, search)
    total, pushing = add(total, links_force), pushing + push
    return bool(norm(total) <= BALANCED * norm(gradient) and shares < unit - pushing)


@routine
def leg_share(table: Table, root: int, nearer: float, search: SearchScratch) -> tuple[Vec, float, float]:
    """Force, push and share of the rods that reach the base by one leg, as found by `path_to_base`.

    The force is that on the platform, the push the sum of the m_k, and the share what the leg's proximal joints need;
    infinite if these joints may bring something nearer.
    """
    force, pushing, terms = leg_terms(table, root, search)
    lever, A, B, push, b, lean, twist, hinge, slide = terms
    share = 0.0
    if slide >= 0 and (b != 0.0 or push != 0.0):
        slack = (largest_cosine_term(table, slide, b, nearer, search) - push) * (0.5 if hinge >= 0 else 1.0)
        if slack <= 0.0:
            return force, pushing, math.inf
        share = push * push / slack
        if hinge >= 0:
            lowest, highest = travel_left(table, slide, search)
            A += twist * twist / slack + (max(lean * lowest, lean * highest) if lean != 0.0 else 0.0)
    if hinge >= 0 and (A != 0.0 or B != 0.0):
        slack = largest_cosine_term(table, hinge, B, nearer, search) - A
        share = share + lever * lever / slack if slack > 0.0 else math.inf
    return force, pushing, share


@routine
def leg_terms(table: Table, root: int, search: SearchScratch) -> tuple[Vec, float, Terms]:
    """Force, push and `Terms` of the rods that reach the base by one leg, as found by `path_to_base`."""
    leg_eval, force, pushing, moved = search.leg_eval, ZERO, 0.0, ZERO
    A, B, b, push, lean, twist = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    hinge, slide = -1, -1
    for k in range(root, table.legs.shape[0]):
        path_root, on_hinge, on_slide = path_to_base(table, k)
        if path_root != root:
            continue
        m, at_base_end, at_platform_end = rod_multipliers(table, k, search)
        if m == 0.0 and norm(at_base_end) + norm(at_platform_end) == 0.0:
            continue
        if (hinge >= 0 and on_hinge not in (-1, hinge)) or (slide >= 0 and on_slide not in (-1, slide)):
            return ZERO, math.inf, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1, -1)
        axes = leg_eval.frames[table.legs[k]["frame"], AXES:]
        line, at_base_end, at_platform_end = (
            turn(axes, vec(leg_eval.lines[k])),
            turn(axes, at_base_end),
            turn(axes, at_platform_end),
        )
        pull = along(scale(m, line), -1.0, at_platform_end)
        force, pushing = add(force, sub(at_base_end, pull)), pushing + m
        axis, lever, slide_axis = ZERO, ZERO, ZERO
        if on_hinge >= 0:
            hinge, axis = on_hinge, axis_of(table, on_hinge, leg_eval)
            lever = sub(platform_end_from(table, k, on_hinge, leg_eval), line)
            radial, turned, rod = flatten(lever, axis), flatten(at_base_end, axis), add(line, lever)
            A += dot(pull, radial) + m * dot(radial, radial) + dot(turned, rod)
            B += dot(pull, cross(axis, radial)) + dot(cross(axis, turned), rod)
            moved = add(moved, along(turned, m, radial))
        if on_slide >= 0:
            slide, slide_axis = on_slide, axis_of(table, on_slide, leg_eval)
            b, push = b + dot(sub(pull, at_base_end), slide_axis), push + m
            turns = on_slide != root
            weight = along(pull if turns else at_base_end, m, lever)
            lean += dot(weight, flatten(slide_axis, axis)) if turns else -dot(weight, flatten(slide_axis, axis))
            twist += dot(weight, cross(axis, slide_axis))
    return force, pushing, (norm(moved), A, B, push, b, lean, twist, hinge, slide)


@routine
def terms_of_links(table: Table, search: SearchScratch) -> tuple[Vec, float]:
    """Force and push of the pairs of links that are kept apart; an infinite push if the bound does not know one."""
    links, multipliers, force, pushing = search.links, search.hessian.multipliers, ZERO, 0.0
    first, is_placed = multipliers.shape[0] - links.pairs.shape[0], False
    for pair in range(links.kept[0]):
        multiplier = multipliers[first + pair]
        if multiplier == 0.0:
            continue
        if not is_placed:
            place_links(table, search.links, search.leg_eval.frames, search.leg_eval.values)
        is_placed = True
        excess, i, j = pair_excess(search.links, pair, math.inf), links.pairs[pair, 0], links.pairs[pair, 1]
        if excess < -BALANCED:
            continue
        distance, radii = links.least[0] - excess, links.sizes[i, ROUND] + links.sizes[j, ROUND]
        here, one, other = distance + radii, vec(links.points[0]), vec(links.points[1])
        share = share_of_platform(links, j, other) - share_of_platform(links, i, one)
        if distance == 0.0 or here <= 0.0 or not abs(share) <= 1.0:
            return ZERO, math.inf
        force = along(force, -multiplier * share / distance, sub(other, one))
        pushing += multiplier / here * share * share
    return force, pushing


@routine
def share_of_platform(links: LinkLimits, link: int, x: Vec) -> float:
    """The share of the platform's displacement that a point of a link makes; infinite if proximal joints move it."""
    first, second = links.bodies[link, 0], links.bodies[link, 1]
    if first >= 0 or second >= 0:
        return math.inf
    share = share_of_end(links, link, x)
    return (1.0 - share if first == PLATFORM else 0.0) + (share if second == PLATFORM else 0.0)


@routine
def path_to_base(table: Table, k: int) -> tuple[int, int, int]:
    """Leg by which a rod reaches the base, and the hinge and the slide on its path there, -1 for none.

    The leg is the first of the redundant joints that the rod is on, else the owner of its proximal joint. All are -1 if
    the path has more joints, or the leg is no such rod.
    """
    leg, index, root, hinge, slide = table.legs[k], owner_of(table, k), -1, -1, -1
    while index >= 0 and leg["kind"] == ROD:
        joint = table.legs[index]
        if (
            joint["at_platform_end"] == 1
            or joint["mirror_of"] >= 0
            or (joint["redundant"] < 0 and joint["frame"] != FROM_BASE)
        ):
            return -1, -1, -1
        if joint["proximal"] == CRANK and hinge < 0:
            hinge = index
        elif joint["proximal"] == CARRIAGE and slide < 0:
            slide = index
        elif joint["proximal"] != NO_PROXIMAL:
            return -1, -1, -1
        root, index = index, joint["redundant"]
    return root, hinge, slide


@routine
def axis_of(table: Table, proximal: int, leg_eval: LegEvaluation) -> Vec:
    """Current axis of a proximal joint."""
    joint = table.legs[proximal]
    return turn(leg_eval.frames[joint["frame"], AXES:], vec(joint["proximal_axis"]))


@routine
def platform_end_from(table: Table, k: int, hinge: int, leg_eval: LegEvaluation) -> Vec:
    """Vector to the platform end of a rod from a hinge that it is on."""
    joint = table.legs[hinge]
    frame = leg_eval.frames[joint["frame"]]
    return turn(frame[AXES:], sub(move(frame, vec(table.legs[k]["platform_end_point"])), vec(joint["proximal_point"])))


@routine
def rod_multipliers(table: Table, k: int, search: SearchScratch) -> tuple[float, Vec, Vec]:
    """Multiplier m of a rod's length, and the parts of b at its base end and at its platform end.

    Times the unit of the objective, in the body of the base end.
    """
    leg, owner, leg_eval, multipliers = table.legs[k], owner_of(table, k), search.leg_eval, search.hessian.multipliers
    length, n_ranges, row, pull = norm(vec(leg_eval.lines[k])), table.limited.shape[0], leg["first_row"], 0.0
    at_base_end, at_platform_end = ZERO, ZERO
    if has_proximal(leg):
        pull = search.equation_multipliers[length_row(table, k)]
    elif leg["slides"] == 0:
        pull = search.equation_multipliers[row]
        row += 1
    if leg["base_end"] == HINGE:
        at_base_end = scale(
            search.equation_multipliers[row],
            current_direction(table, k, owner, AT_BASE_END, vec(leg["base_end_axes"][0]), leg_eval),
        )
        row += 1
    if leg["platform_end"] == HINGE:
        at_platform_end = scale(
            search.equation_multipliers[row],
            current_direction(table, k, owner, AT_PLATFORM_END, vec(leg["platform_end_axes"][0]), leg_eval),
        )
    u = direction(leg_eval.lines[k])
    for i in range(table.limited.shape[0]):
        limited, at_lo, at_hi = table.limited[i], multipliers[2 * i], multipliers[2 * i + 1]
        if limited["leg"] != k or max(at_lo, at_hi) == 0.0:
            continue
        value, entry, sense = deviation(limited, leg_eval.values), limited["place"], limited["sense"]
        at_lo = at_lo if value - limited["lo"] < BALANCED else 0.0
        at_hi = at_hi if limited["hi"] - value < BALANCED else 0.0
        half = 0.5 * (limited["hi"] - limited["lo"])
        if entry == SLIDE:
            pull += sense * (at_hi - at_lo)
        elif half < math.pi and (
            (entry == BASE_END and leg["base_end"] == HINGE) or (entry == PLATFORM_END and leg["platform_end"] == HINGE)
        ):
            end, hinge = (
                (AT_BASE_END, leg["base_end_axes"])
                if entry == BASE_END
                else (AT_PLATFORM_END, leg["platform_end_axes"])
            )
            middle = rotate(
                u,
                current_direction(table, k, owner, end, vec(hinge[0]), leg_eval),
                sense * (limited["lo"] + half - value),
            )
            stretch, lengthwise, push = bound_by(table, k, max(at_lo, at_hi) / length, half)
            pull, at_platform_end = pull + stretch, along(at_platform_end, lengthwise, u)
            at_base_end = along(at_base_end, -push, middle) if end == AT_BASE_END else at_base_end
            at_platform_end = along(at_platform_end, -push, middle) if end == AT_PLATFORM_END else at_platform_end
    for i in range(table.cones.shape[0]):
        cone, push = table.cones[i], multipliers[2 * n_ranges + i]
        if cone["leg"] != k or push == 0.0:
            continue
        angle = cone_slope(table, cone, leg_eval)
        if angle < cone["half_angle"] - BALANCED:
            continue
        end = AT_BASE_END if cone["place"] == BASE_LINE else AT_PLATFORM_END
        axis = current_direction(table, k, owner, end, vec(cone["axis"]), leg_eval)
        stretch, lengthwise, push = bound_by(table, k, push / length, cone["half_angle"])
        pull, at_platform_end = pull + stretch, along(at_platform_end, lengthwise, u)
        at_base_end = along(at_base_end, -push, axis) if end == AT_BASE_END else at_base_end
        at_platform_end = along(at_platform_end, -push, axis) if end == AT_PLATFORM_END else at_platform_end
    return -pull / length, at_base_end, at_platform_end


@routine
def bound_by(table: Table, k: int, push: float, half_angle: float) -> tuple[float, float, float]:
    """Pull along, push along and push from the axis of a rod that is kept within an angle from an axis."""
    push /= max(math.sin(half_angle), BALANCED)
    lengthwise = push * math.cos(half_angle)
    if table.legs[k]["slides"] == 0:
        return lengthwise, 0.0, push
    return 0.0, max(lengthwise, 0.0), push


@routine
def largest_cosine_term(table: Table, k: int, B: float, nearer: float, search: SearchScratch) -> float:
    """The largest A for which f_g is not negative within a proximal joint's limits, up to `nearer`."""
    most, is_crank = math.inf, table.legs[k]["proximal"] == CRANK
    for end in travel_left(table, k, search):
        if B * end < -nearer:
            return -math.inf
        if B * end > nearer:
            most = min(most, B / math.tan(0.5 * end) if is_crank else 2.0 * B / end)
        elif abs(end) > BALANCED:
            most = min(most, 0.0)
    return most


@routine
def travel_left(table: Table, k: int, search: SearchScratch) -> tuple[float, float]:
    """Travel left to a proximal joint before its limits, downwards (negative) and upwards."""
    is_crank = table.legs[k]["proximal"] == CRANK
    least, most = (-math.pi, math.pi) if is_crank else (-math.inf, math.inf)
    for i in range(table.limited.shape[0]):
        limited = table.limited[i]
        if limited["leg"] == k and limited["place"] == Q_PROXIMAL:
            value = deviation(limited, search.leg_eval.values)
            lo, hi = limited["lo"] - value, limited["hi"] - value
            if not is_crank or hi - lo < 2.0 * math.pi:
                least, most = (lo, hi) if limited["sense"] > 0.0 else (-hi, -lo)
    return least, most
