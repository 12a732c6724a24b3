"""A look into an answer: every attempt that was made to reach a target, and where it ended."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

from .answers.solution import Solution
from .answers.start_configuration import Start, start_of
from .answers.status import Status
from .answers.words import limit_name
from .common.printed import Printed, ResultTable, plain
from .engines.engine import engine_of
from .engines.joints.attempts import Attempt
from .engines.joints.configurations import Configurations
from .engines.joints.link_distances import too_near
from .engines.pose.tip_engine import measured
from .engines.targets import Target, as_targets
from .errors import InvalidArgument
from .feasibility import feasibility
from .ik import keeps_mode, solve_ik
from .machine.description.mechanism import Mechanism
from .machine.model import model_of
from .options import Options, checked_options
from .tolerances import TOLERANCES

KEPT_APART = "links kept apart"
"""The phase that follows where links are nearer than the clearance."""


@dataclass(frozen=True, repr=False)
class SearchLog(Printed):
    """The attempts to answer one target; printed as a table.

    Attributes
    ----------
    solution : Solution
        The answer, that of `solve_ik`.
    attempts : tuple of Attempt
        The attempts, in the order in which they are made. The solver stops once enough of them agree: some of the last
        ones may not have been needed.
    blocked_by : tuple or None
        (joint, bound) of the limit that the target exceeds most in the working mode of the start, and by how much, as
        in `feasibility`; None where closed forms do not tell.
    """

    solution: Solution
    attempts: tuple[Attempt, ...]
    blocked_by: tuple[str, str, float] | None

    @property
    def answered_by(self) -> str:
        """The phase that gave the answer: the first one that ended at a feasible configuration that answers.

        A part that is held up to its price, where it is not held exactly. Where links came too near there, it is the
        last phase, which keeps them apart.
        """
        if self.attempts and self.attempts[-1].phase == KEPT_APART:
            return KEPT_APART
        phases = [each.phase for each in self.attempts if each.ending in ("reached", "nearest")]
        priced = [phase for phase in phases if phase.endswith("up to its price")]
        return (priced if priced and self.solution.held is None else phases or ["none"])[0]

    def table(self) -> ResultTable:
        """Every attempt, then the limit that is in the way and the phase that gave the answer."""
        least = TOLERANCES.position * self.solution.mechanism.characteristic_length
        header = ("phase", "start", "steps", f"distance [{self.solution.mechanism.length_unit}]", "ending")
        rows = [
            (each.phase, each.start, str(each.steps), plain(each.distance, least), each.ending)
            for each in self.attempts
        ]
        blocked, answer = self._blocked(), f"answer: {self.solution}, by {self.answered_by}"
        return ResultTable("Search", (), header, rows, ["\n".join(filter(None, [blocked, answer]))])

    def __repr__(self) -> str:
        return str(self)

    def _blocked(self) -> str:
        """A sentence on the limit that is in the way; empty if there is none."""
        if self.blocked_by is None:
            return ""
        joint, bound, beyond = self.blocked_by
        if bound == "clearance":
            lacking = f"{beyond * self.solution.mechanism.characteristic_length:.4g}"
            unit = self.solution.mechanism.length_unit
            return f"in the working mode of the start {joint} come too near at the target, by {lacking} {unit}"
        return f"in the working mode of the start the target is beyond {limit_name(joint, bound)}, by {beyond:.4g}"


def search_log(
    mechanism: Mechanism, target: Target, *, start: Start | None = None, options: Options | None = None
) -> SearchLog:
    """Every attempt to answer a target: phase, start, steps, where it ended.

    The attempts are made again, one by one, so this takes longer than `solve_ik`, whose arguments it takes.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    target : array or RigidTransform or mapping
        A single target.
    start : Solution or array (nq,), optional
        As in `solve_ik`.
    options : Options, optional
        As in `solve_ik`.

    Raises
    ------
    InvalidArgument
        As in `solve_ik`, or for several targets.
    """
    options = checked_options(options)
    targets, shape = as_targets(mechanism, target)
    if shape != ():
        raise InvalidArgument("target", f"{len(targets)} targets", "a single one")
    solution = solve_ik(mechanism, targets[0], start=start, options=options)
    if solution.status == Status.INVALID:
        return SearchLog(solution, (), None)
    begin = start_of(mechanism, start, ())
    free, keep_mode = mechanism.with_clearance(None), keeps_mode(options, begin)
    attempts = tuple(engine_of(free).attempts(targets, begin, options, keep_mode=keep_mode))
    if mechanism.clearance is not None:
        usual = engine_of(free).answer(targets, begin, options, keep_mode=keep_mode)
        attempts += _kept_apart(solution, usual, options.rotation_length or mechanism.rotation_length)
    return SearchLog(solution, attempts, _blocked_by(mechanism, targets[0], start))


def _kept_apart(solution: Solution, usual: Configurations, lever: float) -> tuple[Attempt, ...]:
    """The searches that keep links apart, as one attempt; none where they are far enough without."""
    if not len(too_near(engine_of(solution.mechanism), solution.mechanism, usual)):
        return ()
    distance = hypot(solution.position_error, lever * solution.rotation_error)
    ending = "reached" if solution.status == Status.REACHED else "nearest"
    return (Attempt(KEPT_APART, "the start", int(solution.iterations), distance, ending),)


def _blocked_by(mechanism: Mechanism, target: Target, start: Start | None) -> tuple[str, str, float] | None:
    """The limit that a target exceeds most, in the working mode of the start."""
    if measured(model_of(mechanism)).why_poses_do_not_suffice:
        return None
    found = feasibility(mechanism, target, start=start)
    margin, binding = float(found.margin), int(found.binding)
    return None if binding < 0 or not margin < 0.0 else (*found.limits[binding], -margin)
