"""The configurations of a chain nearest to targets out of reach."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..batch import put
from ..closure.close import Closing, in_lengths
from ..closure.projection import Projected, ProjectionMode
from ..kernels.chains.chain_records import ChainAim, ChainAnswers
from ..kernels.closure.loops import PoseObjective
from ..kernels.projecting import SAME
from ..kernels.rows import HOLD_NOTHING
from ..model import Model
from ..tolerances import TOLERANCES
from .chain_seeds import ChainSeeds, chain_seeds
from .run_chains import new_answers, run_chains
from .serial_chain import chain_of

CLOSENESS = 1e-12
"""Error of held components that ends a search [L or rad]."""

MET = 1e-10
"""Error up to which a search has met them [L or rad]: a tenth of what counts as reached."""

FEW, DESCENTS_OF_FEW, DESCENTS = 12, 60, 15
"""Most joints of a chain that has few; seeds from which descents start, in such chains and in longer ones. Short chains
with narrow limits have the most local minima."""

NEARLY, DESCENTS_NEARBY = 1e-2, 120
"""Distance below which a target out of reach is tried from more seeds [L], and how many these are."""

AGREEMENTS_OF_FEW, AGREEMENTS = 10, 4
"""Descents that must end at the least distance before the others are left out."""


def project_chain(
    model: Model,
    targets: Floats,
    start: Floats,
    begin: Floats,
    projections: Sequence[ProjectionMode],
    *,
    seeds: bool,
    has_start: bool,
) -> Projected:
    """The nearest feasible configurations that descents find.

    Parameters
    ----------
    targets : (n, 4, 4) [length]; components without weight are free.
    start, begin : joint coordinates (n, columns) of the first descents, and poses (n, 4, 4) of the starts of the rows.
    projections : tried in turn, until one has an answer.
    seeds : descend from seeds too.
    has_start : a start was given: nothing held leads farther away than it is.
    """
    n = len(targets)
    closing = closing_of_chain(model, new_answers(start * model.closure.scale))
    best = Projected(closing, np.full(n, np.inf), np.full(n, HOLD_NOTHING))
    for projection in projections:
        pending = np.flatnonzero(np.isinf(best.distances))
        _put(best, pending, projection, *_descend(model, targets[pending], start[pending], projection, seeds))
    if has_start and len(projections) > 1:
        holding, free = projections[0], projections[-1]
        is_far = holding.is_too_far(model.closure, best.distances, begin, targets)
        far = np.flatnonzero((best.holds == holding.hold) & is_far)
        released, distances = _descend(model, targets[far], start[far], free, False)
        allowed = (1.0 + SAME) * free.distances(model.closure, begin[far], targets[far])
        _put(best, far, free, released, np.where(distances <= allowed, distances, np.inf))
    return best


def _put(
    best: Projected, rows: NDArray[np.intp], projection: ProjectionMode, trial: Closing, distances: Floats
) -> None:
    """Put the rows of a trial that have an answer."""
    solved = np.flatnonzero(np.isfinite(distances))
    put(best.closing, rows[solved], trial, solved)
    best.distances[rows[solved]], best.holds[rows[solved]] = distances[solved], projection.hold


def _descend(
    model: Model, targets: Floats, start: Floats, projection: ProjectionMode, seeds: bool
) -> tuple[Closing, Floats]:
    """Local minima of a projection's distance, and the distances, (n,) [L]; infinite where there are none."""
    from ..kernels.chains.answer_chains import nearest_in_chains

    answers = new_answers(start * model.closure.scale)
    if not len(targets):
        return closing_of_chain(model, answers), np.zeros(0)
    n_seeds = DESCENTS_OF_FEW if has_few_joints(model) else DESCENTS
    aim = chain_aim(model, targets, projection.weights, n_seeds if seeds else 0)
    run_chains(model, nearest_in_chains, aim, answers)
    near = np.flatnonzero((answers.distances > MET) & (answers.distances < NEARLY))
    if seeds and has_few_joints(model) and len(near):
        _descend_again(model, aim, answers, near)
    closing = closing_of_chain(model, answers)
    distances = projection.distances(model.closure, closing.poses, targets)
    return closing, np.where(np.isfinite(answers.distances), distances, np.inf)


def _descend_again(model: Model, aim: ChainAim, answers: ChainAnswers, rows: NDArray[np.intp]) -> None:
    """Descend from more seeds in rows that end next to their targets, which may be within reach, at a border."""
    from ..kernels.chains.answer_chains import nearest_in_chains

    pose = aim.pose._replace(targets=aim.pose.targets[rows])
    more = aim._replace(pose=pose, tries=DESCENTS_NEARBY, agreements=DESCENTS_NEARBY)
    trial = new_answers(answers.coordinates[rows])
    run_chains(model, nearest_in_chains, more, trial)
    better = np.flatnonzero(trial.distances < answers.distances[rows])
    for array, trial_array in zip(answers, trial, strict=True):
        array[rows[better]] = trial_array[better]


def has_few_joints(model: Model) -> bool:
    """True if a chain is so short that its limits leave many local minima."""
    return len(chain_of(model).kinds) <= FEW


NO_SEEDS = ChainSeeds(np.zeros((0, 0)), np.zeros((0, 4, 4)))


def chain_aim(
    model: Model, targets: Floats, platform: Sequence[float], tries: int, *, follows: bool = False
) -> ChainAim:
    """The question for the kernels: targets (n, 4, 4) [length] with the weights of their components."""
    scaled = in_lengths(targets, 1.0 / model.length)
    weights = np.array(platform, float)
    objective = PoseObjective(scaled, weights, model.task.frame, TOLERANCES.inside, TOLERANCES.active, 0)
    seeds = chain_seeds(model) if tries else NO_SEEDS
    agreements = AGREEMENTS_OF_FEW if has_few_joints(model) else AGREEMENTS
    return ChainAim(objective, seeds.coordinates, seeds.poses, int(follows), tries, agreements, CLOSENESS, MET)


def closing_of_chain(model: Model, answers: ChainAnswers) -> Closing:
    """The kernels' answers as results of closing loops, of which there are none."""
    n, groups = len(answers.steps), len(model.path_closure.loops.groups) - 1
    gaps, excesses, misses = np.zeros((3, n, groups))
    excesses[:] = answers.excesses[:, None]
    poses = in_lengths(answers.poses, model.length)
    return Closing(answers.coordinates / model.closure.scale, poses, gaps, excesses, misses, answers.steps)
