"""Reaching a given pose: every chain for itself, by closed form, by passes, and from other starts before giving up."""

from __future__ import annotations

import math

from .._jit import routine
from ..vectors import add, along, copy_row, copy_table, dot, move, put, scale, sub, vec
from .exact import reach_exact
from .frames import move_carriers
from .passes import chain_is_reached, reach_by_passes, try_directly
from .plan import LENGTH, PASSES, TURN, Configuration, Plan, Settings, Work
from .settle import settle
from .violations import note_violations

# Passes bring a chain within this share of L before the exact step takes over.
NEAR = 1e-3
# A chain that misses by less than this share of L tries the exact step before any passes.
CLOSE = 0.1
# Other starts tried before a target is called out of reach; for trunks, each is the best of so many samples.
RESTARTS = 12
# Starts of a trunk in a row that come no nearer end the search: each is the best of an even spread already.
VAIN = 3
SAMPLES = 24
# A start replaces the present one only where it comes notably nearer: share of the squared violation.
NOTABLY = 0.25
# Generators of an additive recurrence that fills a box evenly (powers of the inverse of the plastic number).
_SPREAD = (0.7548776662466927, 0.5698402909980532, 0.4301597090019468, 0.3247179572447460)


@routine
def place_ends(plan: Plan, c: int, now: Configuration) -> None:
    """Put the first and last nodes of a chain where carrier and platform have them."""
    for b in range(plan.chains[c]["first"], plan.chains[c]["last"]):
        branch = plan.branches[b]
        first, last = branch["first"], branch["last"]
        if branch["rail"] == 0:
            put(now.nodes[first], move(now.carriers[branch["carrier"]], vec(plan.nodes[first]["home"])))
        put(now.nodes[last], move(now.pose, vec(branch["end"])))


@routine
def has_closed_form(plan: Plan, c: int) -> bool:
    """Whether the closed forms decide alone if a chain reaches: no trunk, and no branch that needs passes."""
    if plan.chains[c]["trunk"] >= 0:
        return False
    for b in range(plan.chains[c]["first"], plan.chains[c]["last"]):
        if plan.branches[b]["kind"] == PASSES:
            return False
    return True


@routine
def start_anew(plan: Plan, c: int, attempt: int, now: Configuration, work: Work, settings: Settings) -> None:
    """A new start for one chain: home, then the present one mirrored, then bends and trunk values spread evenly."""
    chain = plan.chains[c]
    for b in range(chain["first"], chain["last"]):
        branch = plan.branches[b]
        first, last = branch["first"], branch["last"]
        if attempt == 1:
            mirror_branch(plan, b, now)
        else:
            for k in range(first, last + 1):
                put(now.nodes[k], move(now.carriers[branch["carrier"]], vec(plan.nodes[k]["home"])))
        if attempt >= 2 and branch["rail"] == 1:
            slide_branch(plan, b, attempt, now)
        if attempt >= 2:
            for k in range(first + 1, last):
                size = 0.0
                for s in range(first + 1, last + 1):
                    size += 0.5 * (min(plan.nodes[s]["hi"], plan.scalars[LENGTH]) + plan.nodes[s]["lo"])
                for i in range(3):
                    spread = (attempt + 0.37 * k) * _SPREAD[i]
                    now.nodes[k, i] += size * (spread - math.floor(spread) - 0.5)
    if chain["trunk"] >= 0:
        sample_trunk(plan, c, attempt, now, work, settings)


@routine
def slide_branch(plan: Plan, b: int, attempt: int, now: Configuration) -> None:
    """Take a branch along its rail, to somewhere within reach of the target where the rail is that long."""
    branch = plan.branches[b]
    home, axis = vec(plan.nodes[branch["first"]]["home"]), vec(branch["rail_axis"])
    foot = dot(axis, sub(move(now.pose, vec(branch["end"])), home))
    reach = 0.0
    for k in range(branch["first"] + 1, branch["last"] + 1):
        reach += min(plan.nodes[k]["hi"], 2.0 * plan.scalars[LENGTH])
    lo = min(max(branch["rail_lo"], foot - reach), branch["rail_hi"])
    hi = max(min(branch["rail_hi"], foot + reach), branch["rail_lo"])
    spread = attempt * _SPREAD[0]
    slide = lo + (hi - lo) * (spread - math.floor(spread))
    for k in range(branch["first"], branch["last"]):
        put(now.nodes[k], along(vec(now.nodes[k]), slide, axis))


@routine
def mirror_branch(plan: Plan, b: int, now: Configuration) -> None:
    """Turn the inner nodes half around the line from base to target: a planar chain's other bend."""
    branch = plan.branches[b]
    base = vec(now.nodes[branch["first"]])
    line = sub(move(now.pose, vec(branch["end"])), base)
    size = dot(line, line)
    if size > 0.0:
        for k in range(branch["first"] + 1, branch["last"]):
            d = sub(vec(now.nodes[k]), base)
            put(now.nodes[k], add(base, along(scale(-1.0, d), 2.0 * dot(d, line) / size, line)))


@routine
def sample_trunk(plan: Plan, c: int, attempt: int, now: Configuration, work: Work, settings: Settings) -> None:
    """Set a trunk to the best of some values spread over its ranges."""
    span = plan.trunks[plan.chains[c]["trunk"]]
    best = math.inf
    for sample in range(SAMPLES):
        for j in range(span["first"], span["last"]):
            joint = plan.trunk_joints[j]
            reach = math.pi if joint["kind"] == TURN else 2.0 * plan.scalars[LENGTH]
            spread = (1.0 + sample + attempt * SAMPLES) * _SPREAD[(j - span["first"]) % 4]
            middle = 0.5 * (joint["lo"] + joint["hi"]) if math.isfinite(joint["hi"] - joint["lo"]) else 0.0
            lo, hi = max(joint["lo"], middle - reach), min(joint["hi"], middle + reach)
            now.trunks[j] = lo + (hi - lo) * (spread - math.floor(spread))
        move_carriers(plan, now)
        place_ends(plan, c, now)
        for b in range(plan.chains[c]["first"], plan.chains[c]["last"]):
            if plan.branches[b]["kind"] != PASSES:
                reach_exact(plan, b, now, work.modes[b], settings.slack)
        note_violations(plan, c, c + 1, now, work)
        if work.totals[0] < best:
            best = work.totals[0]
            for j in range(span["first"], span["last"]):
                work.sample_trunks[j] = now.trunks[j]
    for j in range(span["first"], span["last"]):
        now.trunks[j] = work.sample_trunks[j]
    move_carriers(plan, now)
    place_ends(plan, c, now)


@routine
def violation(plan: Plan, c: int, now: Configuration, work: Work) -> float:
    """Sum of the squared violations of one chain at the present pose."""
    place_ends(plan, c, now)
    note_violations(plan, c, c + 1, now, work)
    return float(work.totals[0])


@routine
def reach_from_here(
    plan: Plan, c: int, now: Configuration, work: Work, with_passes: bool, settings: Settings
) -> tuple[bool, int]:
    """One chain by passes from the present nodes, finished by closed form or by the exact step."""
    if settings.exact == 0:
        gap, iterations = reach_by_passes(plan, c, now, work.wanted, work.system, settings.tolerance, settings)
        return gap <= settings.tolerance, iterations
    iterations = 1
    if with_passes:
        near = NEAR * plan.scalars[LENGTH]
        _gap, iterations = reach_by_passes(plan, c, now, work.wanted, work.system, near, settings)
    if try_directly(plan, c, now, work.modes, settings):
        return True, iterations
    place_ends(plan, c, now)
    settle(plan, c, c + 1, 0, now, work)
    return chain_is_reached(plan, c, now, settings.slack), iterations


@routine
def reach_chain(plan: Plan, c: int, now: Configuration, work: Work, settings: Settings) -> tuple[bool, int]:
    """One chain to the present pose; where it cannot, it is left as near as any of its starts came.

    A chain whose closed forms decide is not searched further; any other is tried from several starts.
    """
    if settings.exact == 1:
        if try_directly(plan, c, now, work.modes, settings):
            return True, 1
        if has_closed_form(plan, c):
            return False, 1
    closeness = CLOSE * plan.scalars[LENGTH]
    reached, iterations = False, 0
    if settings.exact == 1 and violation(plan, c, now, work) < closeness * closeness:
        # the smallest change that does it: an answer next to the seed's
        reached, iterations = reach_from_here(plan, c, now, work, False, settings)
    if not reached:
        reached, more = reach_from_here(plan, c, now, work, True, settings)
        iterations += more
    if reached or settings.exact == 0 or settings.any_mode == 0:
        return reached, iterations
    least = violation(plan, c, now, work)
    keep_best(now, work)
    vain = 0
    for attempt in range(RESTARTS):
        start_anew(plan, c, attempt, now, work, settings)
        # a trunk's samples are near enough for the exact step at once
        reached, more = reach_from_here(plan, c, now, work, plan.chains[c]["trunk"] < 0, settings)
        iterations += more
        if reached:
            return True, iterations
        size = violation(plan, c, now, work)
        if size < NOTABLY * least:
            least, vain = size, 0
            keep_best(now, work)
        else:
            vain += 1
            if vain >= VAIN and plan.chains[c]["trunk"] >= 0:
                break
    return_to_best(plan, now, work)
    return False, iterations


@routine
def keep_best(now: Configuration, work: Work) -> None:
    copy_table(now.nodes, work.best_nodes)
    copy_row(now.trunks, work.best_trunks)


@routine
def return_to_best(plan: Plan, now: Configuration, work: Work) -> None:
    copy_table(work.best_nodes, now.nodes)
    copy_row(work.best_trunks, now.trunks)
    move_carriers(plan, now)


@routine
def reach_pose(plan: Plan, now: Configuration, work: Work, settings: Settings) -> tuple[bool, int]:
    """Every chain to the present pose, or as near as it comes."""
    reached, iterations = True, 0
    for c in range(plan.chains.shape[0]):
        chain_reached, chain_iterations = reach_chain(plan, c, now, work, settings)
        reached = reached and chain_reached
        iterations = max(iterations, chain_iterations)
    return reached, iterations
