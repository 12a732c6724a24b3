"""P-FABRIK with closed-form intersections and half-spaces.

One pass of a chain whose trunk carries several branches: every branch adds half-spaces, the trunk takes the least step
into all of them, and the branches reach outward again. An unreached target is treated as the trunk of all chains: it is
pulled back towards the requested pose and takes the least step into the half-spaces.
"""

from __future__ import annotations

import math

from ...common.arrays import Floats
from .._jit import routine
from ..legs.complete_poses import orthonormalise, turn_pose
from ..quaternions import difference
from ..vectors import copy_row, copy_table, dot, move, put, scale, vec
from .half_spaces import (
    PLATFORM,
    LeastStep,
    add_branch,
    add_ranges,
    begin_programme,
    dot_of,
    least_step,
)
from .meet import reach_end
from .pass_constants import (
    CAME_BACK,
    CHEAP,
    CLOSING,
    FARTHEST,
    HASTY,
    INSIDE,
    LONGEST,
    LONGEST_OF_ALL,
    LOST,
    LOST_ROUNDS,
    MARGINS,
    OPEN,
    PASSES,
    PATIENT,
    PULL,
    PULLED,
    SETTLED,
    SHRINK,
    TAKEN_OFF,
    VARIED,
    WEAKER,
    WINDOW,
)
from .plan import TRANSLATES, TURNS, Configuration, Plan, Seeds, Settings, load_seed, move_carriers
from .restrict import revise_target


@routine
def add_chain(plan: Plan, c: int, config: Configuration, settings: Settings, spaces: LeastStep) -> float:
    """Add the limits of a chain's branches and the ranges of its trunk; return the largest excess."""
    gap, trunk = 0.0, plan.chains[c]["trunk"]
    for b in range(plan.chains[c]["first"], plan.chains[c]["last"]):
        gap = max(gap, add_branch(plan, b, config, settings, spaces))
    if trunk >= 0:
        add_ranges(plan, plan.trunks[trunk]["first"], plan.trunks[trunk]["last"], config, spaces)
    return gap


@routine
def step_trunk(plan: Plan, trunk: int, config: Configuration, spaces: LeastStep, share: float) -> None:
    """Move the joints of a trunk by a share of the step, within their ranges; leave the carriers where they are."""
    programme = spaces.programme[0]
    for j in range(plan.trunks[trunk]["first"], plan.trunks[trunk]["last"]):
        joint, x = plan.trunk_joints[j], spaces.x[programme["trunk_column"] + j]
        value = config.trunks[j] + share * joint["unit"] * programme["trunk_scale"] * x
        config.trunks[j] = min(max(value, joint["lo"]), joint["hi"])


@routine
def reach_from_start(
    plan: Plan,
    c: int,
    config: Configuration,
    settings: Settings,
    spaces: LeastStep,
    margin: float,
    patience: int,
    is_nearest: bool,
) -> tuple[float, int]:
    """Run passes of a chain from the present trunk coordinates; return the largest excess and their number.

    Parameters
    ----------
    margin : distance inside the limits at which steps aim [length].
    patience : number of stalled passes in a row that ends the search.
    is_nearest : True to continue, once the branches reach, to the solution nearest to the start. Least steps alone end
        far beyond a limit that hardly changes with the trunk.
    """
    trunk = plan.chains[c]["trunk"]
    first, last = plan.trunks[trunk]["first"], plan.trunks[trunk]["last"]
    best, stalled, least_distance, programme = math.inf, 0, math.inf, spaces.programme[0]
    copy_row(config.trunks, spaces.start)
    for n in range(PASSES + 1):
        for j in range(first, last):
            step_back = (spaces.start[j] - config.trunks[j]) / plan.trunk_joints[j]["unit"]
            spaces.x[j - first] = step_back if is_nearest else 0.0
        distance = math.sqrt(dot_of(spaces.x, spaces.x, last - first))
        programme["margin"], programme["window"] = margin, max(margin, distance * plan.length)
        programme["trunk_scale"] = 1.0
        begin_programme(spaces, last - first, -first, 0)
        gap = add_chain(plan, c, config, settings, spaces)
        stalled = 0 if gap < TAKEN_OFF * best else stalled + 1
        best = min(best, gap)
        reaches = gap <= 0.5 * settings.tolerance
        if (reaches and (distance == 0.0 or distance >= least_distance)) or stalled == patience or n == PASSES:
            break
        if reaches:
            copy_row(config.trunks, spaces.trunks)
            least_distance = distance
        else:
            for i in range(last - first):
                spaces.x[i] = 0.0
        least_step(spaces)
        size = math.sqrt(dot_of(spaces.x, spaces.x, last - first))
        if reaches and size <= CAME_BACK * distance:
            break
        step_trunk(plan, trunk, config, spaces, min(1.0, LONGEST / max(size, 1e-300)))
        move_carriers(plan, config)
        margin *= SHRINK
    if least_distance < math.inf:
        copy_row(spaces.trunks, config.trunks)
        move_carriers(plan, config)
        gap = best
    return gap, n


@routine
def start_trunk(plan: Plan, trunk: int, config: Configuration, start: int, inside: float) -> None:
    """Set a trunk near corner number `start` of its joint ranges; `inside` is the distance as a share of each range."""
    first, last = plan.trunks[trunk]["first"], plan.trunks[trunk]["last"]
    for j in range(first, min(last, first + VARIED)):
        joint, sign = plan.trunk_joints[j], 1.0 if (start >> (j - first)) & 1 else -1.0
        step = OPEN * joint["unit"]
        lo, hi = max(joint["lo"], -step), min(joint["hi"], step)
        if joint["lo"] > -math.inf and joint["hi"] < math.inf:
            lo, hi = joint["lo"], joint["hi"]
        config.trunks[j] = 0.5 * (lo + hi) + sign * (0.5 - inside) * (hi - lo)
    move_carriers(plan, config)


@routine
def reach_with_trunk(
    plan: Plan, c: int, config: Configuration, settings: Settings, spaces: LeastStep
) -> tuple[float, int]:
    """Run passes of a chain with a trunk, from seeds if the first start stalls; return the excess and their number."""
    trunk = plan.chains[c]["trunk"]
    first, last = plan.trunks[trunk]["first"], plan.trunks[trunk]["last"]
    gap, passes = reach_from_start(plan, c, config, settings, spaces, MARGINS[0] * plan.length, HASTY, False)
    n_corners = 1 << min(last - first, VARIED)
    for start in range(len(INSIDE) * n_corners):
        if gap <= 0.5 * settings.tolerance:
            break
        tour = start // n_corners
        start_trunk(plan, trunk, config, start, INSIDE[tour])
        patience = HASTY if tour == 0 else PATIENT
        gap, more = reach_from_start(plan, c, config, settings, spaces, MARGINS[tour] * plan.length, patience, False)
        passes += more
    return gap, max(passes, 1)


@routine
def reach_ends(plan: Plan, config: Configuration, settings: Settings) -> tuple[float, int]:
    """Bring the ends of all branches to the present pose; return the largest gap and the most passes of a branch."""
    worst, most = 0.0, 1
    for b in range(plan.branches.shape[0]):
        gap, passes = reach_end(plan, b, config, move(config.pose, vec(plan.branches[b]["end"])), settings)
        worst, most = max(worst, gap), max(most, passes)
    return worst, most


@routine
def reach_pose(plan: Plan, config: Configuration, settings: Settings, spaces: LeastStep) -> tuple[float, int]:
    """Run passes of all chains towards the present pose; return the largest end gap and the most passes of a chain."""
    passes = 1
    for c in range(plan.chains.shape[0]):
        if plan.chains[c]["trunk"] >= 0:
            gap, more = reach_with_trunk(plan, c, config, settings, spaces)
            passes = max(passes, more)
            if gap > settings.tolerance:
                return gap, passes
    gap, more = reach_ends(plan, config, settings)
    return gap, max(passes, more)


@routine
def pull_back(
    config: Configuration, target: Floats, settings: Settings, spaces: LeastStep, pull: float, length: float
) -> float:
    """Set x to a step of the present pose back towards the requested target; return the distance between them [L]."""
    x, distance = spaces.x, 0.0
    for i in range(spaces.programme[0]["n_unknowns"]):
        x[i] = 0.0
    if settings.free & TRANSLATES:
        for i in range(3):
            x[i] = (target[i, 3] - config.pose[i, 3]) / length
    if settings.free & TURNS:
        difference(target, config.pose, x[3:6])
        for i in range(3, 6):
            x[i] *= settings.lever / length
    distance = math.sqrt(dot_of(x, x, PLATFORM))
    share = min(pull, FARTHEST / max(distance, 1e-300))
    for i in range(PLATFORM):
        x[i] *= share
    return distance


@routine
def step_all(plan: Plan, config: Configuration, settings: Settings, spaces: LeastStep, share: float) -> None:
    """Move the target and all trunks by a share of the step."""
    if settings.free & TURNS:
        turn_pose(config.pose, scale(share * plan.length / settings.lever, vec(spaces.x[3:6])))
        orthonormalise(config.pose)
    if settings.free & TRANSLATES:
        for i in range(3):
            config.pose[i, 3] += share * plan.length * spaces.x[i]
    for trunk in range(plan.trunks.shape[0]):
        step_trunk(plan, trunk, config, spaces, share)
    move_carriers(plan, config)


@routine
def project_target(
    plan: Plan, config: Configuration, target: Floats, settings: Settings, spaces: LeastStep
) -> tuple[float, int]:
    """Move pose and trunks to the nearest pose that all chains reach; return the remaining gap and the rounds.

    Every round pulls the pose back towards the target and takes the least step into the half-spaces of the branches.
    Once steps are small, the last rounds only close the remaining gaps.
    """
    pull, closing, n, programme = PULL, 0, PLATFORM + plan.trunk_joints.shape[0], spaces.programme[0]
    for b in range(plan.branches.shape[0]):
        put(spaces.normals[b], (0.0, 0.0, 0.0))
    last_step, least, stalled, rounds = (0.0, 0.0, 0.0), math.inf, 0, 0
    while rounds < settings.max_rounds and closing < CLOSING:
        rounds += 1
        programme["margin"], programme["window"] = 0.0, WINDOW * plan.length
        programme["trunk_scale"], programme["lever"] = CHEAP, settings.lever
        begin_programme(spaces, n, PLATFORM, settings.free)
        gap = 0.0
        for c in range(plan.chains.shape[0]):
            gap = max(gap, add_chain(plan, c, config, settings, spaces))
        if closing > 0 and gap <= 0.5 * settings.tolerance:
            break
        stalled = 0 if gap < TAKEN_OFF * least else stalled + 1
        least = min(least, gap)
        if gap > LOST * plan.length and stalled > LOST_ROUNDS:
            break
        distance = pull_back(config, target, settings, spaces, 0.0 if closing > 0 else pull, plan.length)
        least_step(spaces)
        size, step = math.sqrt(dot_of(spaces.x, spaces.x, PLATFORM)), vec(spaces.x)
        if dot(step, last_step) < -0.25 * dot(last_step, last_step):
            pull *= WEAKER
        last_step = step
        step_all(plan, config, settings, spaces, min(1.0, LONGEST_OF_ALL / max(size, 1e-300)))
        if closing > 0 or size <= SETTLED * distance or rounds >= PULLED:
            closing += 1
    gap, _passes = reach_ends(plan, config, settings)
    return gap, rounds


@routine
def distance_from(config: Configuration, target: Floats, settings: Settings, spaces: LeastStep, length: float) -> float:
    """Weighted distance of the pose from the requested target [L]."""
    return pull_back(config, target, settings, spaces, 0.0, length)


@routine
def project_by_half_spaces(
    plan: Plan, config: Configuration, target: Floats, seeds: Seeds, row: int, settings: Settings, spaces: LeastStep
) -> tuple[float, int, int]:
    """Project an unreached target to the nearest reachable pose; return the largest gap, the passes and the rounds.

    The projection starts from the target. If a trunk moves, or this start fails, a second one starts from the seed's
    pose, and the nearer result is kept. If both fail, the target is moved to the centroid of the ends, as in the paper.
    """
    gap, passes = reach_pose(plan, config, settings, spaces)
    if gap <= settings.tolerance or settings.max_rounds == 0:
        return gap, passes, 0
    load_seed(plan, seeds, row, config)
    copy_table(target, config.pose)
    gap, rounds = project_target(plan, config, target, settings, spaces)
    if gap > settings.tolerance or plan.trunks.shape[0] > 0:
        distance = math.inf
        if gap <= settings.tolerance:
            distance = distance_from(config, target, settings, spaces, plan.length)
        copy_table(config.pose, spaces.pose)
        copy_row(config.trunks, spaces.trunks)
        load_seed(plan, seeds, row, config)
        copy_held_part(config, target, settings)
        seed_gap, more = project_target(plan, config, target, settings, spaces)
        rounds += more
        seed_distance = distance_from(config, target, settings, spaces, plan.length)
        if distance <= seed_distance or seed_gap > settings.tolerance:
            copy_table(spaces.pose, config.pose)
            copy_row(spaces.trunks, config.trunks)
            move_carriers(plan, config)
            seed_gap, _passes = reach_ends(plan, config, settings)
        gap = seed_gap
    while gap > settings.tolerance and rounds < settings.max_rounds:
        rounds += 1
        revise_target(plan, config, settings)
        gap, _passes = reach_ends(plan, config, settings)
    return gap, passes + rounds, rounds


@routine
def copy_held_part(config: Configuration, target: Floats, settings: Settings) -> None:
    """Copy the held part of the target, orientation or position, to the pose."""
    for i in range(3):
        if settings.free & TRANSLATES == 0:
            config.pose[i, 3] = target[i, 3]
        if settings.free & TURNS == 0:
            for j in range(3):
                config.pose[i, j] = target[i, j]
