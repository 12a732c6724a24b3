"""The kernel of P-FABRIK with exact meetings and half-spaces.

A pass of a chain whose trunk carries several branches: every branch adds half-spaces, the trunk takes the least
step that answers all of them, and the branches reach outward again. Where targets are not reached, the target itself is
the trunk of all chains: it takes the least step, from where it is pulled back towards what was asked for.
"""

from __future__ import annotations

import math

from ...arrays import Floats
from .._jit import routine
from ..legs.complete_poses import orthonormalise, turn_pose
from ..quaternions import difference
from ..vectors import copy_row, copy_table, dot, move, put, scale, vec
from .fit import revise_target
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
from .moving_frames import load_seed, move_carriers
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
from .plan import TRANSLATES, TURNS, Configuration, Plan, Seeds, Settings


@routine
def add_chain(plan: Plan, c: int, config: Configuration, settings: Settings, spaces: LeastStep) -> float:
    """Add what the branches of a chain ask for, and the ranges of its trunk; the largest excess."""
    gap, trunk = 0.0, plan.chains[c]["trunk"]
    for b in range(plan.chains[c]["first"], plan.chains[c]["last"]):
        gap = max(gap, add_branch(plan, b, config, settings, spaces))
    if trunk >= 0:
        add_ranges(plan, plan.trunks[trunk]["first"], plan.trunks[trunk]["last"], config, spaces)
    return gap


@routine
def move_trunk(plan: Plan, trunk: int, config: Configuration, spaces: LeastStep, share: float) -> None:
    """Move the joints of a trunk by a share of the step, within their ranges; carriers do not follow yet."""
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
    near: bool,
) -> tuple[float, int]:
    """Passes of a chain from where its trunk is; the largest excess that is left, and how many.

    Steps aim inside limits by a margin [length]; passes end after so many in a row that gain little.

    Parameters
    ----------
    near : passes go on from where branches reach to the place nearest to the start that they reach. Least steps alone
        lead far beyond a limit that hardly changes with the trunk.
    """
    trunk = plan.chains[c]["trunk"]
    first, last = plan.trunks[trunk]["first"], plan.trunks[trunk]["last"]
    best, stalled, nearest, programme = math.inf, 0, math.inf, spaces.programme[0]
    copy_row(config.trunks, spaces.start)
    for n in range(PASSES + 1):
        for j in range(first, last):
            away = (spaces.start[j] - config.trunks[j]) / plan.trunk_joints[j]["unit"]
            spaces.x[j - first] = away if near else 0.0
        far = math.sqrt(dot_of(spaces.x, spaces.x, last - first))
        programme["margin"], programme["window"] = margin, max(margin, far * plan.length)
        programme["trunk_scale"] = 1.0
        begin_programme(spaces, last - first, -first, 0)
        gap = add_chain(plan, c, config, settings, spaces)
        stalled = 0 if gap < TAKEN_OFF * best else stalled + 1
        best = min(best, gap)
        reaches = gap <= 0.5 * settings.enough
        if (reaches and (far == 0.0 or far >= nearest)) or stalled == patience or n == PASSES:
            break
        if reaches:
            copy_row(config.trunks, spaces.trunks)
            nearest = far
        else:
            for i in range(last - first):
                spaces.x[i] = 0.0
        least_step(spaces)
        size = math.sqrt(dot_of(spaces.x, spaces.x, last - first))
        if reaches and size <= CAME_BACK * far:
            break
        move_trunk(plan, trunk, config, spaces, min(1.0, LONGEST / max(size, 1e-300)))
        move_carriers(plan, config)
        margin *= SHRINK
    if nearest < math.inf:
        copy_row(spaces.trunks, config.trunks)
        move_carriers(plan, config)
        gap = best
    return gap, n


@routine
def start_trunk(plan: Plan, trunk: int, config: Configuration, start: int, inside: float) -> None:
    """Put the joints of a trunk near corner `start` of their ranges, by a share of these inside."""
    first, last = plan.trunks[trunk]["first"], plan.trunks[trunk]["last"]
    for j in range(first, min(last, first + VARIED)):
        joint, end = plan.trunk_joints[j], 1.0 if (start >> (j - first)) & 1 else -1.0
        step = OPEN * joint["unit"]
        lo, hi = max(joint["lo"], -step), min(joint["hi"], step)
        if joint["lo"] > -math.inf and joint["hi"] < math.inf:
            lo, hi = joint["lo"], joint["hi"]
        config.trunks[j] = 0.5 * (lo + hi) + end * (0.5 - inside) * (hi - lo)
    move_carriers(plan, config)


@routine
def reach_with_trunk(
    plan: Plan, c: int, config: Configuration, settings: Settings, spaces: LeastStep
) -> tuple[float, int]:
    """Passes of a chain with a trunk, from other starts too where one is caught; the excess left, and how many."""
    trunk = plan.chains[c]["trunk"]
    first, last = plan.trunks[trunk]["first"], plan.trunks[trunk]["last"]
    gap, passes = reach_from_start(plan, c, config, settings, spaces, MARGINS[0] * plan.length, HASTY, False)
    corners = 1 << min(last - first, VARIED)
    for start in range(len(INSIDE) * corners):
        if gap <= 0.5 * settings.enough:
            break
        start_trunk(plan, trunk, config, start, INSIDE[start // corners])
        tour = start // corners
        patience = HASTY if tour == 0 else PATIENT
        gap, more = reach_from_start(plan, c, config, settings, spaces, MARGINS[tour] * plan.length, patience, False)
        passes += more
    return gap, max(passes, 1)


@routine
def reach_ends(plan: Plan, config: Configuration, settings: Settings) -> tuple[float, int]:
    """Bring the ends of all branches to the present pose; the largest gap, and the most passes."""
    worst, most = 0.0, 1
    for b in range(plan.branches.shape[0]):
        gap, passes = reach_end(plan, b, config, move(config.pose, vec(plan.branches[b]["end"])), settings)
        worst, most = max(worst, gap), max(most, passes)
    return worst, most


@routine
def reach_pose(plan: Plan, config: Configuration, settings: Settings, spaces: LeastStep) -> tuple[float, int]:
    """Passes of all chains towards the present pose; the largest gap of an end, and the most passes of a chain."""
    passes = 1
    for c in range(plan.chains.shape[0]):
        if plan.chains[c]["trunk"] >= 0:
            gap, more = reach_with_trunk(plan, c, config, settings, spaces)
            passes = max(passes, more)
            if gap > settings.enough:
                return gap, passes
    gap, more = reach_ends(plan, config, settings)
    return gap, max(passes, more)


@routine
def pull_back(
    config: Configuration, target: Floats, settings: Settings, spaces: LeastStep, pull: float, length: float
) -> float:
    """Set x to the target's way back to what was asked for; the distance [length]."""
    x, far = spaces.x, 0.0
    for i in range(spaces.programme[0]["n_unknowns"]):
        x[i] = 0.0
    if settings.free & TRANSLATES:
        for i in range(3):
            x[i] = (target[i, 3] - config.pose[i, 3]) / length
    if settings.free & TURNS:
        difference(target, config.pose, x[3:6])
        for i in range(3, 6):
            x[i] *= settings.lever / length
    far = math.sqrt(dot_of(x, x, PLATFORM))
    share = min(pull, FARTHEST / max(far, 1e-300))
    for i in range(PLATFORM):
        x[i] *= share
    return far


@routine
def move_all(plan: Plan, config: Configuration, settings: Settings, spaces: LeastStep, share: float) -> None:
    """Move the target and all trunks by a share of the step."""
    if settings.free & TURNS:
        turn_pose(config.pose, scale(share * plan.length / settings.lever, vec(spaces.x[3:6])))
        orthonormalise(config.pose)
    if settings.free & TRANSLATES:
        for i in range(3):
            config.pose[i, 3] += share * plan.length * spaces.x[i]
    for trunk in range(plan.trunks.shape[0]):
        move_trunk(plan, trunk, config, spaces, share)
    move_carriers(plan, config)


@routine
def settle(
    plan: Plan, config: Configuration, target: Floats, settings: Settings, spaces: LeastStep
) -> tuple[float, int]:
    """Move the target, and all trunks, to where all chains reach it, as near as it can be; the gap and the rounds.

    From where they are: every round pulls the target back and answers what branches ask for; once steps are small, the
    last rounds only answer.
    """
    pull, closing, n, programme = PULL, 0, PLATFORM + plan.trunk_joints.shape[0], spaces.programme[0]
    for b in range(plan.branches.shape[0]):
        put(spaces.normals[b], (0.0, 0.0, 0.0))
    last_step, least, since, rounds = (0.0, 0.0, 0.0), math.inf, 0, 0
    while rounds < settings.max_rounds and closing < CLOSING:
        rounds += 1
        programme["margin"], programme["window"] = 0.0, WINDOW * plan.length
        programme["trunk_scale"], programme["lever"] = CHEAP, settings.lever
        begin_programme(spaces, n, PLATFORM, settings.free)
        gap = 0.0
        for c in range(plan.chains.shape[0]):
            gap = max(gap, add_chain(plan, c, config, settings, spaces))
        if closing > 0 and gap <= 0.5 * settings.enough:
            break
        since = 0 if gap < TAKEN_OFF * least else since + 1
        least = min(least, gap)
        if gap > LOST * plan.length and since > LOST_ROUNDS:
            break
        far = pull_back(config, target, settings, spaces, 0.0 if closing > 0 else pull, plan.length)
        least_step(spaces)
        size, step = math.sqrt(dot_of(spaces.x, spaces.x, PLATFORM)), vec(spaces.x)
        if dot(step, last_step) < -0.25 * dot(last_step, last_step):
            pull *= WEAKER
        last_step = step
        move_all(plan, config, settings, spaces, min(1.0, LONGEST_OF_ALL / max(size, 1e-300)))
        if closing > 0 or size <= SETTLED * far or rounds >= PULLED:
            closing += 1
    gap, _passes = reach_ends(plan, config, settings)
    return gap, rounds


@routine
def distance_from(config: Configuration, target: Floats, settings: Settings, spaces: LeastStep, length: float) -> float:
    """Distance of the pose from what was asked for [L], turns as they count beside it."""
    return pull_back(config, target, settings, spaces, 0.0, length)


@routine
def project_by_half_spaces(
    plan: Plan, config: Configuration, target: Floats, seeds: Seeds, row: int, settings: Settings, spaces: LeastStep
) -> tuple[float, int, int]:
    """Move a target that is not reached to a nearest pose that is; the largest gap, passes and rounds.

    From the target itself; where a trunk moves, or that settles nowhere, from the seed too, and the nearer counts. If
    neither settles, ends agree on their centroid, as in the paper.
    """
    gap, passes = reach_pose(plan, config, settings, spaces)
    if gap <= settings.enough or settings.max_rounds == 0:
        return gap, passes, 0
    load_seed(plan, seeds, row, config)
    copy_table(target, config.pose)
    gap, rounds = settle(plan, config, target, settings, spaces)
    if gap > settings.enough or plan.trunks.shape[0] > 0:
        far = distance_from(config, target, settings, spaces, plan.length) if gap <= settings.enough else math.inf
        copy_table(config.pose, spaces.pose)
        copy_row(config.trunks, spaces.trunks)
        load_seed(plan, seeds, row, config)
        start_at_target(config, target, settings)
        other_gap, more = settle(plan, config, target, settings, spaces)
        rounds += more
        other = distance_from(config, target, settings, spaces, plan.length)
        if far <= other or other_gap > settings.enough:
            copy_table(spaces.pose, config.pose)
            copy_row(spaces.trunks, config.trunks)
            move_carriers(plan, config)
            other_gap, _passes = reach_ends(plan, config, settings)
        gap = other_gap
    while gap > settings.enough and rounds < settings.max_rounds:
        rounds += 1
        revise_target(plan, config, settings)
        gap, _passes = reach_ends(plan, config, settings)
    return gap, passes + rounds, rounds


@routine
def start_at_target(config: Configuration, target: Floats, settings: Settings) -> None:
    """Give a pose what its target holds: the orientation, or the position."""
    for i in range(3):
        if settings.free & TRANSLATES == 0:
            config.pose[i, 3] = target[i, 3]
        if settings.free & TURNS == 0:
            for j in range(3):
                config.pose[i, j] = target[i, j]
