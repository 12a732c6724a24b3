"""Margins of targets from the limits of a mechanism, without projection, for maps."""

from __future__ import annotations

from concurrent.futures import Executor
from contextlib import closing
from typing import Any, NamedTuple

import numpy as np

from .answers.margins import margins
from .answers.solution import Solution
from .answers.start_configuration import Start, start_of
from .answers.words import bound_notes
from .common.arrays import Floats, Ints, shaped
from .common.checks import require_callable
from .common.executors import Workers, slices, told
from .common.printed import ResultTable, plain
from .common.telling import OnProgress
from .engines.engine import engine_of, legs_decide
from .engines.joints.configurations import Configurations
from .engines.joints.link_distances import least_distances, pair_names
from .engines.pose.answers import sides_at
from .engines.pose.branch import starts_beside
from .engines.pose.leg_margins import leg_margins
from .engines.pose.links_at_poses import links_at_poses
from .engines.pose.tip_engine import measured, start_at_tip
from .engines.targets import Target, as_targets
from .errors import UnsupportedMechanism, counted
from .kernels.rows import REACHED
from .machine.description.mechanism import Mechanism, checked_mechanism
from .machine.model import Model, model_of
from .options import Options
from .tolerances import TOLERANCES

ROWS_AT_ONCE = 16384
"""Rows whose links are placed and measured at once: more would need much memory."""


class Feasibility(NamedTuple):
    """The least margins of targets, and the limits that have them.

    Attributes
    ----------
    margin : float or array (...)
        The least margin of all limits: as in `margins` a share of the range, 1 in its middle or on the axis of a cone,
        0 on a limit, negative beyond it. Where a leg does not reach, minus the gap as a share of its length; where a
        leg does not close on the target, minus the residual [L or rad]. NaN for rows that are no poses. Where the
        mechanism has a clearance and no other limit is exceeded, links count too: the rest of their distance as a share
        of L, as in `margins`.
    binding : int or array of int (...)
        Index in `limits` of the limit that has it, the first if several are equal to 1e-9; -1 if there is none.
    limits : tuple of tuple of str
        Pairs (joint, bound) of every limit: "min", "max" and "cone", as in `margins`; "stretched", or "level" of a
        rod on an upright slide, of a leg's proximal joint, beyond whose dead point the leg does not reach; "not closed"
        of its first joint; with a clearance, (``BC1–BC3``, "clearance") of every pair of links.
    """

    margin: Any
    binding: Any
    limits: tuple[tuple[str, str], ...]

    def _repr_html_(self) -> str:
        return self.table()._repr_html_()

    def table(self) -> ResultTable:
        """The margin and its limit; of a batch, the rows and the least margin of each limit."""
        margins, bindings = np.ravel(self.margin), np.ravel(self.binding)
        if not np.ndim(self.margin):
            limit = self.limits[int(bindings[0])] if bindings[0] >= 0 else ("-", "-")
            words = "feasible" if margins[0] >= 0.0 else "not feasible"
            row = (*limit, plain(margins[0], TOLERANCES.active, ".4g"))
            return ResultTable("Feasibility", [words], ("joint", "bound", "margin"), [row], [bound_notes([limit])])
        n_feasible = int(np.count_nonzero(margins >= 0.0))
        lines = [f"batch of shape {np.shape(self.margin)}", f"{n_feasible} of {counted(len(margins), 'row')} feasible"]
        places, counts = np.unique(bindings[bindings >= 0], return_counts=True)
        rows = [
            (*self.limits[place], str(count), plain(np.nanmin(margins[bindings == place]), TOLERANCES.active, ".4g"))
            for count, place in sorted(zip(counts.tolist(), places.tolist(), strict=True), reverse=True)
        ]
        notes = bound_notes(self.limits[place] for place in places.tolist())
        return ResultTable("Feasibility", lines, ("joint", "bound", "rows", "least margin"), rows, [notes])


def feasibility(
    mechanism: Mechanism,
    targets: Target,
    *,
    start: Start | None = None,
    executor: Executor | None = None,
    on_progress: OnProgress | None = None,
) -> Feasibility:
    """Margins of targets in one working mode, by the legs' closed forms.

    A target whose margin is positive is reached by `solve_ik`; one whose margin is negative may still be, in another
    working mode. Where a target does not decide all that legs need, as with a slide under a delta, arms that turn on
    implicit joints, or a task that leaves a freedom open, what these miss from the start is asked of `solve_ik` with
    ``working_mode="keep"``: where that reaches the target, the margin is that of its answer. Such targets take as long
    as it does.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    targets : array or RigidTransform or mapping
        Targets as in `solve_ik`; what the task leaves open is completed from the start.
    start : Solution or array (nq,), optional
        A single Solution or joint vector q that sets the working mode; default that of home.
    executor : Executor, optional
        Of `concurrent.futures`, or one like it, on whose workers blocks of targets are measured; default: here, on all
        cores.
    on_progress : callable, optional
        Called with the targets that are measured and their number, as in `solve_ik`.

    Raises
    ------
    UnsupportedMechanism
        Some chain is no leg in closed form; the message names it, with the reason.
    InvalidArgument
        Targets of the wrong shape.
    """
    model = measured(model_of(checked_mechanism(mechanism)))
    configuration = None if start is None else start_of(mechanism, start, ())
    if model.why_poses_do_not_suffice:
        raise UnsupportedMechanism(mechanism.name, [model.why_poses_do_not_suffice])
    poses, shape = as_targets(mechanism, targets)
    require_callable("on_progress", on_progress)
    if executor is None and on_progress is None:
        margin, binding = _best_of_modes(mechanism, poses, configuration)
    else:
        parts = slices(len(poses))
        blocks = [(poses[block], configuration) for block in parts]
        with closing(Workers(executor, mechanism).results(_best_of_modes, blocks)) as results:
            each = list(told(results, parts, len(poses), on_progress))
        margin, binding = (np.concatenate(values) for values in zip(*each, strict=True))
    return Feasibility(shaped(margin, shape), shaped(binding, shape), limits_of(mechanism))


def limits_of(mechanism: Mechanism) -> tuple[tuple[str, str], ...]:
    """The limits that `feasibility` measures, in its order."""
    limits = measured(model_of(mechanism)).legs.measured_limits
    if mechanism.clearance is not None:
        limits += tuple((name, "clearance") for name in pair_names(mechanism))
    return limits


def _best_of_modes(mechanism: Mechanism, poses: Floats, configuration: Configurations | None) -> tuple[Floats, Ints]:
    """Margins (n,) of poses (n, 4, 4), and the indices of their limits."""
    margin, binding = margins_of_legs(mechanism, poses, configuration)
    if not legs_decide(mechanism):
        _raise_to_kept(mechanism, poses, configuration, margin, binding)
    return margin, binding


def margins_of_legs(mechanism: Mechanism, poses: Floats, configuration: Configurations | None) -> tuple[Floats, Ints]:
    """Margins (n,) by closed forms alone, and the indices of their limits; a start on a fold is of both its modes."""
    model = model_of(mechanism)
    if measured(model) is not model:
        model, configuration = measured(model), start_at_tip(configuration)
    margin, binding = _of_mode(model, poses, configuration)
    for _, beside in starts_beside(model, configuration):
        other_margin, other_binding = _of_mode(model, poses, beside)
        better = other_margin > margin
        margin[better], binding[better] = other_margin[better], other_binding[better]
    return margin, binding


def margins_at(mechanism: Mechanism, answers: Configurations) -> tuple[Floats, Ints]:
    """Margins (n,) of configurations that legs have found, as these stand there, and the indices of their limits."""
    model, margin, binding = model_of(mechanism), np.empty(len(answers)), np.empty(len(answers), np.int64)
    poses, sides = np.require(answers.rows.poses, requirements=["C", "W"]), sides_at(model, answers)
    for row in range(len(answers)):
        here = slice(row, row + 1)
        margin[here], binding[here] = leg_margins(model, poses[here], poses[here], sides[here])
    return margin, binding


def _raise_to_kept(
    mechanism: Mechanism, poses: Floats, start: Configurations | None, margin: Floats, binding: Ints
) -> None:
    """Write margins (n,) of poses with negative ones that the engine reaches in the mode of a start: its answers'."""
    missed = np.flatnonzero(margin < 0.0)
    if not len(missed):
        return
    answers = engine_of(mechanism).answer(poses[missed], start, Options(), keep_mode=True)
    reached = np.flatnonzero(answers.rows.status == REACHED)
    rows, places = missed[reached], {limit: place for place, limit in reversed([*enumerate(limits_of(mechanism))])}
    margin[rows], binding[rows] = np.inf, -1
    for limit, own in margins(Solution(mechanism, answers.at(reached), (len(reached),))).items():
        least = np.maximum(own, 0.0)  # exceeded by rounding alone
        lower = least < margin[rows]
        margin[rows[lower]], binding[rows[lower]] = least[lower], places[limit]


def _of_mode(model: Model, poses: Floats, start: Configurations | None) -> tuple[Floats, Ints]:
    """Margins (n,) of poses (n, 4, 4), and the indices of their limits, in the working mode of a start, or of home."""
    mechanism, start_pose, sides = model.mechanism, model.mechanism.home_pose[None].copy(), model.legs.home_sides
    if start is not None:
        start_pose, sides = np.require(start.rows.poses, requirements=["C", "W"]), sides_at(model, start)
    margin, binding = leg_margins(model, poses, start_pose, sides)
    if mechanism.clearance is not None:
        _lower_to_clearance(model, mechanism.clearance, poses, start, sides, margin, binding)
    return margin, binding


def _lower_to_clearance(
    model: Model,
    clearance: float,
    poses: Floats,
    start: Configurations | None,
    sides: Floats,
    margin: Floats,
    binding: Ints,
) -> None:
    """Lower margins (n,) that are not negative to those of the nearest links, and write their pairs into `binding`."""
    first_pair, kept = len(model.legs.measured_limits), np.flatnonzero(margin >= 0.0)
    for rows in np.split(kept, range(ROWS_AT_ONCE, len(kept), ROWS_AT_ONCE)):
        placed, is_reached = links_at_poses(model, poses[rows], start, sides)
        distances, pairs, _ = least_distances(placed)
        room = (distances - clearance) / model.length
        room[~is_reached] = -np.inf
        lower = room < margin[rows]
        margin[rows[lower]], binding[rows[lower]] = room[lower], first_pair + pairs[lower]
