"""Inverse kinematics: from a target pose to a feasible configuration."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import closing

import numpy as np

from .answers.answer_fields import Before, PoseRequest
from .answers.solution import Solution
from .answers.start_configuration import Start, start_of
from .common.arrays import Floats
from .common.checks import require_callable
from .common.executors import SLOWER, Workers, slices, told
from .common.telling import OnProgress
from .engines.engine import engine_of, knows_all_modes
from .engines.joints.close import measure_configurations
from .engines.joints.closure_engine import ClosureEngine
from .engines.joints.configurations import Configurations
from .engines.joints.engine_contract import Engine, InverseEngine
from .engines.joints.parasitic import has_parasitic_motion
from .engines.joints.projection import modes_of
from .engines.kept_assembly import within_assembly
from .engines.targets import Target, as_targets, refuse_invalid
from .errors import InvalidArgument
from .kernels.rows import CERTAIN, HOLD, ITERATIONS, PROJECTED, REACHED, RESIDUAL
from .machine.description.mechanism import Mechanism
from .machine.model import model_of
from .options import Options, checked_options
from .tolerances import TOLERANCES


def solve_ik(
    mechanism: Mechanism,
    target: Target,
    *,
    start: Start | None = None,
    options: Options | None = None,
    executor: Executor | None = None,
    on_progress: OnProgress | None = None,
) -> Solution:
    """Actuator values that put the end effector on a target, or as near as possible, with every limit kept.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    target : array or RigidTransform or mapping
        Pose (..., 4, 4) of the end effector in the base frame [length], position (..., 3) at home orientation, a SciPy
        RigidTransform, or the coordinates of the joint that carries the end effector on the base,
        ``{"pivot": [0.1, 0.05]}``; leading axes are a batch, whose rows are answered independently, on all cores.
    start : Solution or array (..., nq), optional
        A Solution or joint vector q to start from, single or one for each target; its working mode is kept. Default:
        home, and any working mode.
    options : Options, optional
        Tolerances, working mode, and what a projection keeps.
    executor : Executor, optional
        Of `concurrent.futures`, or one like it, on whose workers blocks of a batch are answered, with the same answers;
        default: here, on all cores.
    on_progress : callable, optional
        Called with the rows that are answered and their number, block by block.

    Returns
    -------
    Solution
        REACHED, or PROJECTED to the nearest feasible pose found; see `Solution`.

    Raises
    ------
    InvalidArgument
        A target or start of the wrong shape, or (unless marked) rows that are no poses.
    """
    return solve_by(engine_of, mechanism, target, start, checked_options(options), executor, on_progress)


def solve_by(
    choose_engine: Callable[[Mechanism], InverseEngine],
    mechanism: Mechanism,
    target: Target,
    start: Start | None,
    options: Options,
    executor: Executor | None = None,
    on_progress: OnProgress | None = None,
) -> Solution:
    """As `solve_ik`, by the engine that is chosen."""
    targets, shape = as_targets(mechanism, target)
    begin, before = start_of(mechanism, start, shape), start._request if isinstance(start, Solution) else None
    require_callable("on_progress", on_progress)
    if executor is None and on_progress is None:
        solutions = _answers(mechanism, targets, begin, before, options, choose_engine)
    else:
        asked = mechanism, targets, begin, before, options, choose_engine
        solutions = _answers_by_blocks(executor, on_progress, *asked)
    status = solutions.rows.status
    refuse_invalid(targets, shape, status, options)
    is_missed = status[0] != REACHED if len(status) == 1 else (status != REACHED).any()
    is_within = begin is None or not (begin.rows.status != REACHED).any()
    if not is_missed and is_within:
        return Solution(mechanism, solutions, shape)
    request, known = PoseRequest(targets.copy(), options), None
    if begin is not None:
        known = Before(begin, begin.rows.poses if before is None else before.targets, request)
    return Solution(mechanism, solutions, shape, request if is_missed else None, None, known)


def _answers_by_blocks(
    executor: Executor | None,
    tell: OnProgress | None,
    mechanism: Mechanism,
    targets: Floats,
    begin: Configurations | None,
    before: PoseRequest | None,
    options: Options,
    choose_engine: Callable[[Mechanism], InverseEngine],
) -> Configurations:
    """As `_answers`, in blocks, on the workers of an executor or here, with progress told behind each."""
    blocks = []
    parts = slices(len(targets), 1 if choose_engine(mechanism).is_fast else SLOWER)
    for block in parts:
        rows = np.arange(len(targets))[block]
        is_each = begin is not None and len(begin) > 1
        begin_there = begin.at(rows) if begin is not None and is_each else begin
        before_there = PoseRequest(before.targets[rows], before.options) if before is not None and is_each else before
        blocks.append((targets[block], begin_there, before_there, options, choose_engine))
    with closing(Workers(executor, mechanism).results(_answers, blocks)) as results:
        first, *others = told(results, parts, len(targets), tell)
    return first.followed_by(others)


def _answers(
    mechanism: Mechanism,
    targets: Floats,
    begin: Configurations | None,
    before: PoseRequest | None,
    options: Options,
    choose_engine: Callable[[Mechanism], InverseEngine],
) -> Configurations:
    """Answers to poses (n, 4, 4) from a start, one or one for each, which answered the request `before`, if any."""
    if begin is not None and before is not None and _is_certified(begin, before, targets, options):
        return begin
    keep_mode, engine = keeps_mode(options, begin), choose_engine(mechanism)
    if options.most_steps and begin is not None and not _is_feasible(mechanism, begin):
        raise InvalidArgument(
            "start", "none that is feasible", "loops closed, limits kept: with most_steps it may answer"
        )
    solutions = engine.answer(targets, begin, options, keep_mode=keep_mode)
    if keep_mode and not options.most_steps and isinstance(engine, Engine):
        solutions = within_assembly(engine, mechanism, targets, begin, solutions, options)
    status = solutions.rows.status
    if not (status[0] != REACHED if len(status) == 1 else (status != REACHED).any()):
        return solutions
    if not (keep_mode or options.most_steps or knows_all_modes(mechanism)):
        solutions = _reach_missed(mechanism, solutions, targets, begin, options)
    if begin is not None and before is not None:
        solutions = _prefer_start(mechanism, solutions, PoseRequest(targets, options), begin, before)
    return solutions


def _reach_missed(
    mechanism: Mechanism, solutions: Configurations, targets: Floats, start: Configurations | None, options: Options
) -> Configurations:
    """The solutions, with the targets reached that closing the loops in joint coordinates reaches.

    From the start, then from the answers, these leg by leg. For machines with modes that no engine enumerates.
    """
    model, engine = model_of(mechanism), engine_of(mechanism)
    for from_answers in (False, True):
        rows = np.flatnonzero((solutions.rows.status == PROJECTED) & ~solutions.rows.certain)
        if not len(rows):
            break
        begin = solutions.at(rows) if from_answers else start if start is None or len(start) == 1 else start.at(rows)
        leg_by_leg = from_answers and not model.has_legs and has_parasitic_motion(model.path_closure)
        found = ClosureEngine(model).close_as_expected(targets[rows], begin, options, leg_by_leg=leg_by_leg)
        reached = np.flatnonzero(found.rows.status == REACHED)
        if len(reached):
            measured = engine.as_configurations(measure_configurations(model, found.coordinates[reached]))
            reached = reached[measured.is_within_limits]
        if len(reached):
            solutions = solutions.with_rows(rows[reached], found.at(reached))
    return solutions


def _is_feasible(mechanism: Mechanism, start: Configurations) -> bool:
    """True if all starts are closed and keep their limits, by their measures."""
    is_closed = start.rows.measures[:, RESIDUAL] <= TOLERANCES.position * mechanism.characteristic_length
    return bool((is_closed & start.is_within_limits).all())


def _is_certified(start: Configurations, request: PoseRequest, targets: Floats, options: Options) -> bool:
    """True if the start is certified to be the nearest configuration to the same single target, by the same options."""
    rows = start.rows
    is_same = len(targets) == len(request.targets) == 1 and request.options == options
    return (
        is_same
        and targets.tobytes() == request.targets.tobytes()
        and rows.status[0] == PROJECTED
        and rows.counters[0, HOLD] >= CERTAIN
    )


def _prefer_start(
    mechanism: Mechanism,
    solutions: Configurations,
    request: PoseRequest,
    start: Configurations,
    start_request: PoseRequest,
) -> Configurations:
    """The solutions, with rows of the start in place of those that are no nearer to the same target.

    A target that is asked for again, from its own answer, keeps this answer unless a nearer one is found.
    """
    options, others, closure = request.options, start_request.options, model_of(mechanism).path_closure
    if modes_of(closure, options) != modes_of(closure, others):
        return solutions
    is_same = np.logical_and.reduce(request.targets == start_request.targets, axis=(1, 2))
    is_same &= (start.rows.status == PROJECTED) & (solutions.rows.status != REACHED)
    mode = modes_of(closure, options)[-1]
    before, after = (mode.distances(closure, *each.rows.measures[:, :2].T) for each in (start, solutions))
    places = np.flatnonzero(is_same & (before <= after + TOLERANCES.position))
    if not len(places):
        return solutions
    if options.most_steps:  # what the search took is told, not what it took the start
        start = start.at(places if len(start) > 1 else 0 * places)
        start.rows.counters[:, ITERATIONS] = solutions.rows.counters[places, ITERATIONS]
        return solutions.with_rows(places, start)
    if len(places) == len(start) == len(solutions):
        return start
    return solutions.with_rows(places, start.at(places if len(start) > 1 else 0 * places))


def keeps_mode(options: Options, start: object) -> bool:
    """True if answers stay in the working mode of the start, or of home without a start."""
    return (options.working_mode or ("any" if start is None else "keep")) == "keep"
