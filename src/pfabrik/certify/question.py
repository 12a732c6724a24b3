"""`certify`: is every pose of a region, or between the steps of a track, within all limits?"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from ..answers.solution import Solution
from ..answers.status import Status
from ..arrays import Floats
from ..checks import require_count, require_finite, require_names, require_positive
from ..description.mechanism import Mechanism, checked_mechanism
from ..errors import InvalidArgument, UnsupportedMechanism
from ..feasibility import feasibility
from ..ik import solve_ik
from ..kernels.certify.link_rows import ROWS_A_PAIR
from ..kernels.certify.pose_cells import CellParameters
from ..kernels.certify.prove import (
    BREAKS,
    BROKEN,
    DONE,
    FOUND_MARGIN,
    LIMIT,
    N_OPEN,
    N_PROVED,
    N_STACK,
    PROVED_MARGIN,
    SPENT,
    TOO_SMALL,
)
from ..kinematics import Model, model_of, task_of
from ..poses import are_poses
from ..rotations import to_rotvec
from ..targets import Target, as_targets
from ..telling import OnProgress, telling
from .certificates import OPEN, PROVED, REFUTED, Certificate, Refutation, Verdict
from .constraint_legs import joints_without_bounds, leg_that_restricts, names_of_leg
from .links_over_cells import bounded_pairs, links_without_bounds
from .pose_region import PoseRegion
from .subdividing import Subdividing, first_cells, region_parameters, step_poses, track_parameters


def require_no_clearance(mechanism: Mechanism, doing: str) -> None:
    """Raise UnsupportedMechanism if a mechanism has a clearance: there are no bounds of distances over regions."""
    if mechanism.clearance is not None:
        reason = "its clearance is no part of a proof: ask for `mechanism.with_clearance(None)`"
        raise UnsupportedMechanism(mechanism.name, [reason], doing)


BUDGET = 200_000
"""Cells that are looked at by default: about a tenth of a second for six struts."""

SAMPLES = 20_000
"""Random poses of a region of which links are left open, that may refute it: some hundredths of a second."""

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
    on_progress: OnProgress | None = None,
) -> Certificate:
    """Prove that `solve_ik` reaches every pose of a region, find a pose that it does not reach, or say what is open.

    Legs are in home's working mode: what is proved is reached without a change of it. What is refuted is reached in no
    working mode.

    Parameters
    ----------
    region : a `PoseRegion`; or poses as of `solve_ik` (n, ...), or a Track, whose answers count: every pose between two
        of them, with the position on a line and the rotation about one axis.
    limits : names of the joints whose limits count; default all. The clearance of links counts where there is one.
    tolerance : by how much the proved `margin` may be less than the least margin in the region, if the region is
        proved; by default it is only known to be positive.
    budget : number of cells to look at, at most.
    uncertain : radius of a ball about each joint's point that its true place may be anywhere in [length]: proved for
        all machines with such points and directions of axes as described.
    on_progress : called with (cells looked at, cells in all, about); default: a line on a terminal, if it takes more
        than two seconds.

    Raises
    ------
    UnsupportedMechanism : a chain has no closed form, or poses leave joints open; the message names them.
    InvalidArgument : a region over coordinates that the task does not set.
    """
    mechanism = _with_limits_of(checked_mechanism(mechanism), limits)
    model = model_of(mechanism)
    if model.why_poses_do_not_suffice:
        raise UnsupportedMechanism(
            mechanism.name, [f"no legs in closed form, {model.why_poses_do_not_suffice}"], "certified"
        )
    gap, budget, uncertain = _checked(tolerance, budget, uncertain)
    poses = None if isinstance(region, PoseRegion) else _steps(mechanism, region)
    if isinstance(region, PoseRegion):
        _require_task(mechanism, region)
        parameters = region_parameters(model, region, uncertain)
    else:
        assert poses is not None
        parameters = track_parameters(model, poses, uncertain)
    ask = _RegionQuestion(model, region if isinstance(region, PoseRegion) else None, poses, parameters)
    with telling("certify", on_progress) as tell:
        return ask.answer(gap, budget, tell)


class _RegionQuestion:
    """One region and its machine."""

    def __init__(
        self, model: Model, region: PoseRegion | None, poses: Floats | None, parameters: CellParameters
    ) -> None:
        self.model, self.region, self.poses, self.parameters = model, region, poses, parameters

    def answer(self, gap: float, budget: int, tell: OnProgress | None) -> Certificate:
        """Subdivide until there is a verdict."""
        first = first_cells(self.parameters)
        subdividing = Subdividing(self.model, self.parameters, first, gap, budget)
        work, n_doubts, reason = subdividing.work, 0, self._restriction()
        while True:
            result = subdividing.proceed(tell)
            if result != BROKEN:
                break
            refutation = self._refuted(work.pose.copy(), int(work.counters[LIMIT]))
            if refutation is not None:
                return self._certificate(REFUTED, subdividing, "", refutation)
            n_doubts += 1
            if n_doubts >= MOST_DOUBTS:
                break
        if result in (SPENT, TOO_SMALL) and not n_doubts and len(bounded_pairs(self.model)):
            refutation = self._sampled()
            if refutation is not None:
                work.measures[FOUND_MARGIN] = min(work.measures[FOUND_MARGIN], refutation.margin)
                return self._certificate(REFUTED, subdividing, "", refutation)
        if n_doubts:
            reason = reason or "some poses are reached in another working mode than home's"
        elif result != DONE:
            spent = f"after {subdividing.n_cells} cells" if result == SPENT else "cells became too small"
            reason = reason or spent
        return self._certificate(OPEN if reason else PROVED, subdividing, reason, None)

    def _certificate(
        self, verdict: Verdict, subdividing: Subdividing, reason: str, refutation: Refutation | None
    ) -> Certificate:
        work = subdividing.work
        margin = float(work.measures[PROVED_MARGIN]) if verdict == PROVED else -math.inf
        proved = work.proved[: min(int(work.counters[N_PROVED]), len(work.proved))]
        n_left = int(work.counters[N_OPEN])
        left = np.concatenate([work.stack[: int(work.counters[N_STACK])], work.left[:n_left]])
        is_whole = len(proved) == int(work.counters[N_PROVED])
        return Certificate(
            self.model.mechanism,
            self.region,
            self.poses,
            verdict,
            margin,
            float(work.measures[FOUND_MARGIN]),
            reason,
            refutation,
            subdividing.n_cells,
            is_whole,
            self.parameters,
            proved,
            left,
        )

    def _restriction(self) -> str:
        """Why nothing can be proved of the region: a leg that leaves a constraint on its poses; empty if none does."""
        model, table = self.model, self.model.legs
        home = model.mechanism.home_pose
        if self.region is not None:
            ends = np.stack([self.region.low, self.region.high])
            far = np.abs(ends[:, 3:]).max(axis=0)
            shifts = np.diag(self.region.half[:3])
            shifts = np.concatenate([shifts, (self.region.middle[:3] - home[:3, 3])[None]]) / model.length
            turns = np.diag(far)
        else:
            assert self.poses is not None
            shifts = (self.poses[:, :3, 3] - home[:3, 3]) / model.length
            turns = np.concatenate([to_rotvec(self.poses[:, :3, :3]), self.parameters.moves[:, 3:]])
        if task_of(model.mechanism).rotations == 2 and np.any(turns):
            return "the task leaves the yaw of the platform open"
        leg = leg_that_restricts(table, shifts, turns)
        if leg >= 0:
            return f"the leg with {names_of_leg(table, leg)} restricts the platform in this region, or carries others"
        if self.parameters.uncertain[0] > 0.0 and len(table.legs) and table.legs["has_rows"].any():
            return "with uncertain points, legs restrict the platform"
        unknown = joints_without_bounds(table)
        if unknown:
            return f"limits of {unknown} have no bounds over regions yet"
        pair = links_without_bounds(model)
        return f"the distance of the links {pair} has no bounds over regions yet" if pair else ""

    def _refuted(self, parameters: Floats, limit: int) -> Refutation | None:
        """The refutation by a pose that breaks the limit of a row; None if `solve_ik` reaches it."""
        if self.region is not None:
            units = np.array([self.model.length] * 3 + [1.0] * 3)
            pose = self.region.pose(parameters * units)
        else:
            assert self.poses is not None
            pose = step_poses(self.model, self.parameters, parameters[None, 1::-1])[0]
        return self._refuted_by(pose, limit)

    def _sampled(self) -> Refutation | None:
        """The refutation by the worst of random poses, half of them on sides of the region; None if all are within
        limits: links may be too near where the worst corners of cells keep them apart."""
        rng = np.random.default_rng(0)
        if self.region is not None:
            low, high = self.region.low, self.region.high
            points = rng.uniform(low, high, (SAMPLES, 6))
            ends = np.where(rng.random(points.shape) < 0.5, low, high)
            points[::2] = np.where(rng.random(points.shape) < 0.5, points, ends)[::2]
            poses = self.region.pose(points[np.asarray(self.region.contains(points))])
        else:
            steps = rng.integers(len(self.parameters.steps), size=SAMPLES)
            points = np.stack([steps.astype(float), rng.random(SAMPLES)], axis=1)
            poses = step_poses(self.model, self.parameters, points)
        if not len(poses):
            return None
        feasible = feasibility(self.model.mechanism, poses)
        worst = int(np.argmin(feasible.margin))
        return self._refuted_by(poses[worst], 0) if feasible.margin[worst] < -BREAKS else None

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


def _with_limits_of(mechanism: Mechanism, limits: Any) -> Mechanism:
    """The mechanism with the limits of some joints only."""
    if limits is None:
        return mechanism
    names = set(require_names("limits", limits))
    for name in names:
        mechanism.joint(name)
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


def _require_task(mechanism: Mechanism, region: PoseRegion) -> None:
    """Raise if a region spans, or shifts, what the task does not set."""
    task, home = task_of(mechanism), mechanism.home_pose
    at_home = np.array([*home[:3, 3], 0.0, 0.0, 0.0])
    turns = task.turns if task.rotations < 3 else (True, True, True)
    names = ("x", "y", "z", "rotation about x", "rotation about y", "rotation about z")
    for i, counts in enumerate((*task.axes, *turns)):
        if not counts and (region.low[i] != at_home[i] or region.high[i] != at_home[i]):
            found = f"{names[i]} from {region.low[i]:g} to {region.high[i]:g}"
            raise InvalidArgument("region", found, f"{at_home[i]:g}, as at home: the task does not set it")
