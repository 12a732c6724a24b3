"""`certify`: is every pose of a region, or between the steps of a track, within all limits?"""

from __future__ import annotations

import math
from collections.abc import Iterable
from concurrent.futures import Executor
from contextlib import closing
from typing import Any, NamedTuple

import numpy as np

from ...answers.solution import Solution
from ...answers.status import Status
from ...common.arrays import Floats
from ...common.checks import require_count, require_finite, require_names, require_positive
from ...common.executors import Workers
from ...common.telling import OnProgress, telling
from ...errors import InvalidArgument, UnsupportedMechanism
from ...feasibility import feasibility
from ...ik import solve_ik
from ...kernels.certify.link_rows import ROWS_A_PAIR
from ...kernels.certify.pose_cells import CellParameters
from ...kernels.certify.prove import (
    BREAKS,
    BROKEN,
    DONE,
    FOUND_MARGIN,
    HALF,
    LAST_ROW,
    LIMIT,
    N_OPEN,
    N_PROVED,
    N_STACK,
    PROVED_LEGS,
    PROVED_MARGIN,
    SPENT,
    TOO_SMALL,
)
from ...kinematics import Model, Target, as_targets, model_of, task_of
from ...machine.description.mechanism import Mechanism, checked_mechanism
from ...machine.poses import are_poses
from .certificates import OPEN, PROVED, REFUTED, SINGULARITY, Certificate, Refutation, Verdict
from .constraint_legs import joints_without_bounds
from .following import of_track, what_follows
from .links_over_cells import bounded_pairs, links_without_bounds
from .pose_region import PoseRegion, drawn
from .subdividing import (
    MOST_LEFT,
    MOST_PROVED,
    Subdividing,
    first_cells,
    region_parameters,
    side_at,
    step_poses,
    track_parameters,
    units_of,
)


def require_no_clearance(mechanism: Mechanism, doing: str) -> None:
    """Raise UnsupportedMechanism if a mechanism has a clearance: there are no bounds of distances over regions."""
    if mechanism.clearance is not None:
        reason = "its clearance is no part of a proof: ask for `mechanism.with_clearance(None)`"
        raise UnsupportedMechanism(mechanism.name, [reason], doing)


BUDGET = 200_000
"""Cells that are looked at by default: about a tenth of a second for six struts."""

SAMPLES = 20_000
"""Random poses of a region of which links are left open, that may refute it: some hundredths of a second."""

WORST, SIDES = 8, 200
"""How many of the worst of them are solved for, and how many of them are asked for their side of singularities."""

CELLS_A_ROUND, CELLS_A_BLOCK = 64, 20_000
"""On an executor: cells that workers subdivide at a time, and how many of its parts each looks at: some ten ms."""

MOST_DOUBTS = 16
"""Poses out of reach in home's working mode but reached in another, after which a region is left open."""


def certify(
    mechanism: Mechanism,
    region: PoseRegion | Target,
    *,
    limits: Iterable[str] | None = None,
    tolerance: float | None = None,
    budget: int = BUDGET,
    uncertain: float = 0.0,
    singular: bool = False,
    executor: Executor | None = None,
    on_progress: OnProgress | None = None,
) -> Certificate:
    """Prove that `solve_ik` reaches every pose of a region, find a pose that it does not reach, or say what is open.

    Legs are in home's working mode: what is proved is reached without a change of it. What is refuted is reached in no
    working mode. Coordinates that the task leaves open and legs determine are proved to exist, on the side of home.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    region : PoseRegion or array or Track
        A `PoseRegion`; or poses (n, ...) as in `solve_ik`, or a Track, whose answers count: every pose between two of
        them, with the position on a line and the rotation about one axis.
    limits : iterable of str, optional
        Names of the joints whose limits count; default all. The clearance of links counts where there is one.
    tolerance : float, optional
        By how much the proved `margin` may be less than the least margin in the region, if the region is proved; by
        default it is only known to be positive.
    budget : int, optional
        Number of cells to look at, at most.
    uncertain : float, optional
        Radius of a ball about each joint's point that its true place may be anywhere in [length]: proved for all
        machines with such points and directions of axes as described.
    singular : bool, optional
        True to prove, too, that no pose is a parallel singularity: locked drives hold the platform in all of the
        region, whose determinant keeps the sign that it has at home. For legs with driven lengths or proximal joints.
    executor : Executor, optional
        Of `concurrent.futures`, or one like it, on whose workers parts of the region are looked at; default: here. A
        proof holds either way; its cells are others, and of poses that refute a region it may find another.
    on_progress : callable, optional
        Called with (cells looked at, cells in all, about); default: a line on a terminal, if it takes more than two
        seconds.

    Raises
    ------
    UnsupportedMechanism
        A chain has no closed form, or poses leave joints open; the message names them.
    InvalidArgument
        A region over coordinates that the task does not set.
    """
    mechanism = _with_limits_of(checked_mechanism(mechanism), limits)
    model = model_of(mechanism)
    if model.why_poses_do_not_suffice:
        raise UnsupportedMechanism(mechanism.name, [model.why_poses_do_not_suffice], "certified")
    gap, budget, uncertain = _checked(tolerance, budget, uncertain)
    poses = None if isinstance(region, PoseRegion) else _steps(mechanism, region)
    if isinstance(region, PoseRegion):
        region = region.of(mechanism)
        require_task(mechanism, region)
        follows = what_follows(model, region, uncertain)
        parameters = region_parameters(model, region, uncertain, follows.implicit, singular)
    else:
        assert poses is not None
        follows = of_track(model, poses, uncertain)
        parameters = track_parameters(model, poses, uncertain, singular)
    ask = _RegionQuestion(model, region if isinstance(region, PoseRegion) else None, poses, parameters, follows.reason)
    with telling("certify", on_progress) as tell:
        return ask.answer(gap, budget, executor, tell)


class _Looked(NamedTuple):
    """Outcome of a look at some cells.

    Attributes
    ----------
    ending : of the kernel: DONE, SPENT, TOO_SMALL, or BROKEN where limits were broken too often.
    open : cells that are still to be looked at.
    left : cells too small to be halved, neither proved nor refuted.
    proved : proved cells, as many as are kept of `n_proved`.
    last_row : the row that was not proved on the last cell that was not.
    n_doubts : number of poses out of reach in home's working mode, but reached in another.
    """

    ending: int
    open: Floats
    left: Floats
    proved: Floats
    n_proved: int
    n_cells: int
    last_row: int
    n_doubts: int
    proved_margin: float
    found_margin: float
    refutation: Refutation | None


class _RegionQuestion:
    """One region and its machine."""

    def __init__(
        self,
        model: Model,
        region: PoseRegion | None,
        poses: Floats | None,
        parameters: CellParameters,
        reason: str = "",
    ) -> None:
        self.model, self.region, self.poses, self.parameters, self.reason = model, region, poses, parameters, reason

    def answer(self, gap: float, budget: int, executor: Executor | None, tell: OnProgress | None) -> Certificate:
        """Subdivide until there is a verdict."""
        first = first_cells(self.parameters)
        if executor is None:
            looked = self.look(first, gap, budget, tell)
        else:
            looked = self._look_elsewhere(executor, first, gap, budget, tell)
        reason, refutation = self._restriction(), looked.refutation
        if refutation is None and not looked.n_doubts and looked.ending in (SPENT, TOO_SMALL):
            is_sampled = len(bounded_pairs(self.model)) or self.parameters.implicit.any() or self.parameters.kinds[4]
            refutation = self._sampled() if is_sampled else None
        if refutation is not None:
            least_found = (
                min(looked.found_margin, refutation.margin) if looked.refutation is None else looked.found_margin
            )
            return self._certificate(REFUTED, looked._replace(found_margin=least_found), "", refutation)
        has_bounds = not reason
        if looked.n_doubts:
            reason = reason or "some poses are reached in another working mode than home's"
        elif looked.ending != DONE:
            spent = f"after {looked.n_cells} cells" if looked.ending == SPENT else "cells became too small"
            reason = reason or f"{spent}, the last one at {self._open_at(looked.last_row)}"
        return self._certificate(OPEN if reason else PROVED, looked, reason, None, has_bounds)

    def look(self, cells: Floats, gap: float, budget: int, tell: OnProgress | None = None) -> _Looked:
        """Subdivide cells until they are proved, a pose refutes them, or the budget is spent."""
        subdividing = Subdividing(self.model, self.parameters, cells, gap, budget)
        work, n_doubts, refutation = subdividing.work, 0, None
        while (ending := subdividing.proceed(tell)) == BROKEN:
            refutation = self._refuted(work.pose.copy(), int(work.counters[LIMIT]))
            n_doubts += refutation is None
            if refutation is not None or n_doubts >= MOST_DOUBTS:
                break
        n_proved = int(work.counters[N_PROVED])
        return _Looked(
            ending,
            work.stack[: int(work.counters[N_STACK]), :PROVED_LEGS],
            work.left[: int(work.counters[N_OPEN])],
            work.proved[: min(n_proved, len(work.proved))],
            n_proved,
            subdividing.n_cells,
            int(work.counters[LAST_ROW]),
            n_doubts,
            float(work.measures[PROVED_MARGIN]),
            float(work.measures[FOUND_MARGIN]),
            refutation,
        )

    def _look_elsewhere(
        self, executor: Executor, cells: Floats, gap: float, budget: int, tell: OnProgress | None
    ) -> _Looked:
        """As `look`, on the workers of an executor, in rounds: what a round leaves open is looked at in the next."""
        workers = Workers(executor, (self.model.mechanism, self.region, self.poses, self.parameters))
        parts: list[_Looked] = []
        whole, n_cells, n_left, n_doubts = _size(cells), 0, 0, 0
        while len(cells) and n_cells < budget and n_left < MOST_LEFT and n_doubts < MOST_DOUBTS:
            waiting, turn = cells[:-CELLS_A_ROUND], cells[-CELLS_A_ROUND:]
            budget_each = min(CELLS_A_BLOCK, max((budget - n_cells) // len(turn), 1))
            blocks = [(turn[i : i + 1, :PROVED_LEGS], gap, budget_each) for i in range(len(turn))]
            with closing(workers.results(_look_at, blocks)) as results:
                for part in results:
                    parts.append(part)
                    if part.refutation is not None:
                        break
            cells = np.concatenate([waiting, *(part.open for part in parts[-len(turn) :])])
            n_cells, n_left = sum(part.n_cells for part in parts), sum(len(part.left) for part in parts)
            n_doubts = sum(part.n_doubts for part in parts)
            if parts[-1].refutation is not None:
                break
            if tell is not None:
                share = max(1.0 - _size(cells) / whole, n_cells / budget)
                tell(n_cells, math.ceil(n_cells / share))
        proved = np.concatenate([part.proved for part in parts])[:MOST_PROVED]
        return _Looked(
            SPENT if len(cells) else TOO_SMALL if n_left else DONE,
            cells,
            np.concatenate([part.left for part in parts]),
            proved,
            sum(part.n_proved for part in parts),
            n_cells,
            parts[-1].last_row,
            n_doubts,
            min(part.proved_margin for part in parts),
            min(part.found_margin for part in parts),
            parts[-1].refutation,
        )

    def _certificate(
        self,
        verdict: Verdict,
        looked: _Looked,
        reason: str,
        refutation: Refutation | None,
        has_bounds: bool = True,
    ) -> Certificate:
        return Certificate(
            self.model.mechanism,
            self.region,
            self.poses,
            verdict,
            looked.proved_margin if verdict == PROVED else -math.inf,
            looked.found_margin,
            reason,
            refutation,
            looked.n_cells,
            len(looked.proved) == looked.n_proved,
            has_bounds,
            self.parameters,
            looked.proved,
            np.concatenate([looked.open, looked.left[:, :PROVED_LEGS]]),
        )

    def _restriction(self) -> str:
        """Why nothing can be proved of the region: a leg that leaves a constraint on its poses; empty if none does."""
        model, table = self.model, self.model.legs
        if self.reason:
            return self.reason
        unknown = joints_without_bounds(table)
        if unknown:
            return f"limits of {unknown} have no bounds over regions yet"
        if self.parameters.kinds[4] and not self.parameters.signs[1]:
            return "its determinant with locked drives has no bounds, or vanishes at home"
        pair = links_without_bounds(model)
        return f"the distance of the links {pair} has no bounds over regions yet" if pair else ""

    def _refuted(self, parameters: Floats, limit: int) -> Refutation | None:
        """The refutation by a pose that breaks the limit of a row; None if `solve_ik` reaches it.

        Of the last row, by one on the other side of the parallel singularities than home, which is reached.
        """
        if self.region is not None:
            units, origin = units_of(self.model, self.region)
            pose = self.region.pose(parameters * units + origin)
        else:
            assert self.poses is not None
            pose = step_poses(self.model, self.parameters, parameters[None, 1::-1])[0]
        if limit == self._last_row:
            if not side_at(self.model, self.parameters, parameters) < 0.0:
                return None
            answer = solve_ik(self.model.mechanism, pose)
            return Refutation(pose, SINGULARITY, 0.0, answer) if answer.status == Status.REACHED else None
        return self._refuted_by(pose, limit)

    def _sampled(self) -> Refutation | None:
        """The refutation by the worst of random poses, half of them on sides of the region; None if all are within
        limits: links may be too near where the worst corners of cells keep them apart. Then by one beyond a
        singularity."""
        rng, points = np.random.default_rng(0), None
        if self.region is not None:
            points = drawn(self.region, SAMPLES, rng)
            poses = self.region.pose(points)
        else:
            steps = rng.integers(len(self.parameters.steps), size=SAMPLES)
            points = np.stack([steps.astype(float), rng.random(SAMPLES)], axis=1)
            poses = step_poses(self.model, self.parameters, points)
        feasible = feasibility(self.model.mechanism, poses)
        for worst in np.argsort(feasible.margin)[:WORST].tolist():
            if not feasible.margin[worst] < -BREAKS:
                break
            refutation = self._refuted_by(poses[worst], 0)
            if refutation is not None:
                return refutation
        if not self.parameters.kinds[4] or self.region is None or self.parameters.implicit.any():
            return None
        units, origin = units_of(self.model, self.region)
        found = (self._refuted((point - origin) / units, self._last_row) for point in points[:SIDES])
        return next((refutation for refutation in found if refutation is not None), None)

    @property
    def _last_row(self) -> int:
        """The row on the whole machine, behind those of limits and of links."""
        table = self.model.legs
        return len(table.limits) + 2 * len(table.legs) + ROWS_A_PAIR * len(bounded_pairs(self.model))

    def _open_at(self, row: int) -> str:
        """What is not proved, for messages."""
        if row != self._last_row:
            mechanism = self.model.mechanism
            return " ".join(feasibility(mechanism, mechanism.home_pose).limits[self._place_of(row)])
        if self.parameters.implicit.any():
            return "a pose that legs do not determine, or hardly"
        return "a pose that locked drives do not hold, or hardly"

    def _refuted_by(self, pose: Floats, limit: int) -> Refutation | None:
        """The refutation by a pose; None if `solve_ik` reaches it."""
        mechanism = self.model.mechanism
        answer = solve_ik(mechanism, pose)
        if answer.status != Status.PROJECTED:
            return None
        feasible = feasibility(mechanism, pose)
        binding = int(feasible.binding)
        if binding < 0:  # a configuration that has no margins there: the limit that the search found broken
            binding = self._place_of(limit)
        return Refutation(pose, feasible.limits[binding], float(feasible.margin), answer)

    def _place_of(self, row: int) -> int:
        """The index in `Feasibility.limits` of the limit of a row of the kernel."""
        table = self.model.legs
        n_limits, n_legs = len(table.limits), len(table.legs)
        if row < n_limits:
            return row
        pair = (row - n_limits - 2 * n_legs) // ROWS_A_PAIR
        if pair < 0:
            return n_limits + (row - n_limits) // 2
        return n_limits + 2 * n_legs + int(bounded_pairs(self.model)[pair])


def _look_at(
    asked: tuple[Mechanism, PoseRegion | None, Floats | None, CellParameters], cells: Floats, gap: float, budget: int
) -> _Looked:
    """Look at cells on a worker."""
    mechanism, region, poses, parameters = asked
    return _RegionQuestion(model_of(mechanism), region, poses, parameters).look(cells, gap, budget)


def _size(cells: Floats) -> float:
    """The size of cells, of the coordinates that vary in the first."""
    return float(np.prod(cells[:, HALF:PROVED_LEGS], axis=1, where=cells[:1, HALF:PROVED_LEGS] > 0.0).sum())


def _with_limits_of(mechanism: Mechanism, limits: Any) -> Mechanism:
    """The mechanism with the limits of some joints only."""
    if limits is None:
        return mechanism
    names = {mechanism.joint(name).name for name in require_names("limits", limits)}
    others = {
        joint.name: None
        for joint in mechanism.joints
        if joint.name not in names and (joint.range is not None or joint.cone is not None)
    }
    return mechanism.with_limits(others) if others else mechanism


def _checked(tolerance: Any, budget: Any, uncertain: Any) -> tuple[float, int, float]:
    """The gap, the budget and the uncertainty, checked."""
    gap = math.inf if tolerance is None else require_positive("tolerance", tolerance)
    radius = require_finite("uncertain", uncertain)
    if radius < 0.0:
        raise InvalidArgument("uncertain", f"{uncertain!r}", "a length that is not negative")
    return gap, require_count("budget", budget, most=10**8), radius


def _steps(mechanism: Mechanism, track: Any) -> Floats:
    """The poses (n, 4, 4) of a track, two or more."""
    poses, shape = as_targets(mechanism, track.pose if isinstance(track, Solution) else track)
    if len(shape) != 1 or len(poses) < 2:
        raise InvalidArgument("region", f"poses of batch shape {shape}", "a PoseRegion, a Track, or two or more poses")
    if not are_poses(poses).all():
        raise InvalidArgument("region", "rows that are no poses", "finite poses whose rotation is one")
    return np.asarray(poses)


def require_task(mechanism: Mechanism, region: PoseRegion) -> None:
    """Raise if a region spans, or shifts, what the task does not set."""
    if region.turning == "joints":
        return
    task, home = task_of(mechanism), mechanism.home_pose
    at_home = np.array([*home[:3, 3], 0.0, 0.0, 0.0])
    turns = task.turns if task.rotations < 3 else (True, True, True)
    names = ("x", "y", "z", "rotation about x", "rotation about y", "rotation about z")
    for i, counts in enumerate((*task.axes, *turns)):
        if not counts and (region.low[i] != at_home[i] or region.high[i] != at_home[i]):
            found = f"{names[i]} from {region.low[i]:g} to {region.high[i]:g}"
            raise InvalidArgument("region", found, f"{at_home[i]:g}, as at home: the task does not set it")
