"""The search for dimensions: the smallest aim at some poses, refuted by further ones, until a proof."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from typing import Any, NamedTuple, cast

import numpy as np

from ...answers.status import Status
from ...common.arrays import Floats
from ...common.checks import require_count
from ...common.telling import OnProgress
from ...errors import InvalidArgument, InvalidMechanism
from ...ik import solve_ik
from ...kinematics import varied
from ...machine.description.mechanism import Mechanism
from ..certify.certificates import Certificate
from .candidate import Candidate, Dimensions
from .found_design import Binding, Design, DesignRound, Verdict
from .keep import DEFAULT_SINGULARITY, HOME, Requirement, clearance, margin, singularity
from .poses_to_reach import DENSE, SAMPLES, PosesToReach
from .smallest_aim import KEPT, NEAR, Found, multipliers, smallest, spread

MOST_ROUNDS, MOST_INNER = 20, 12
"""Rounds that end with a proof or a pose that refutes; searches in a round, as samples show further poses."""

STARTS, SCREENED = 3, 64
"""Starts beside the machine as described: of so many spread points those that break the least."""

MOST_ANEW = 2
"""Times that other starts are tried: the second time has the poses that the first one brought up."""

WORST = 3
"""Poses that are added at a time."""

SLACK = 1e-4
"""Least margin over a region, of which a proof needs some; four times as much where one does not end."""

MOST_SLACK = 0.02
"""Slack after which a proof that does not end is given up."""

BINDS = 1e-3
"""Share of a multiplier from which a row binds."""

Aim = str | Callable[[Mechanism], float]


class DesignQuestion:
    """One question: a machine, its bounds, poses and requirements."""

    def __init__(
        self,
        mechanism: Mechanism,
        bounds: Mapping[str, tuple[float, float]],
        reach: Any,
        requirements: Sequence[Requirement],
        about: str,
        seed: int,
        executor: Executor | None,
        tell: OnProgress | None,
    ) -> None:
        self.mechanism, self.bounds, self.executor, self.tell = mechanism, bounds, executor, tell
        low, high = np.array(list(bounds.values())).T
        alone = mechanism if mechanism.clearance is None else mechanism.with_clearance(None)
        self.dimensions = Dimensions(varied(alone, tuple(bounds)), low, high)
        self.rng = np.random.default_rng(require_count("seed", seed, 0))
        self.reach = PosesToReach(mechanism, reach, about, self.rng)
        drawn = self.dimensions.own
        ends = [np.where(one, end, drawn) for one in np.eye(len(drawn), dtype=bool) for end in (low, high)]
        machines = [self.dimensions.at(values) for values in (drawn, *ends)]
        self.reach.require_plane(mechanism, np.array([m.home_pose[:3, 3] for m in machines if m is not None]))
        for text in (text for each in requirements for text in each.expressions):
            self.dimensions.source.value_of(text, {}, "keep")
        own = [each for each in requirements if each.name]
        if not any(each.kind == "margin" for each in own):
            own.insert(0, margin(0.0))
        if not any(each.kind == "singularity" for each in requirements):
            own.append(singularity(DEFAULT_SINGULARITY))
        if mechanism.clearance is not None:
            own.append(clearance(mechanism.clearance))
        self.requirements = [*own, HOME]

    def values(self, z: Floats) -> Floats:
        """Dimensions (p,) at shares of their bounds."""
        return np.asarray(self.dimensions.low + z * (self.dimensions.high - self.dimensions.low))

    def at(self, z: Floats, poses: Floats) -> Candidate:
        """The machine at shares z (p,) of the bounds, at poses (n, 4, 4)."""
        return Candidate(self.dimensions, self.values(z), poses, self.reach.moves)


class CheckedMachine(NamedTuple):
    """The outcome of a check of a machine.

    Attributes
    ----------
    verdict, refuted_by : as of a `DesignRound`.
    is_final : True if nothing that follows can prove it.
    """

    verdict: str
    found: Found
    mechanism: Mechanism | None = None
    reason: str = ""
    certificate: Certificate | None = None
    refuted_by: Floats | None = None
    is_final: bool = False


class SmallestSearch:
    """The search for one aim."""

    def __init__(
        self, asked: DesignQuestion, minimise: Aim, extra: Sequence[Requirement] = (), near: Design | None = None
    ) -> None:
        self.asked, self.requirements = asked, [*asked.requirements, *extra]
        self._near = [] if near is None else [np.array(list(near.dimensions.values()))]
        self.asked_for = [each for each in self.requirements if not each.has_poses or each.kind == "margin"]
        self.words, self._aim = aim_of(asked, minimise)
        self.poses, self.slack = asked.reach.first, 0.0 if asked.reach.region is None else SLACK
        self._kept: dict[bytes, Candidate] = {}
        self.rounds: list[DesignRound] = []
        self.unit = 1.0

    def candidate(self, z: Floats) -> Candidate:
        """The machine at z and the poses so far; the last few are kept."""
        key = z.tobytes()
        if key not in self._kept:
            if len(self._kept) > 4 * len(z) + 8:
                self._kept.clear()
            self._kept[key] = self.asked.at(z, self.poses)
        return self._kept[key]

    def aim(self, z: Floats) -> float:
        """The aim, of order 1."""
        value = self._aim(self.candidate(z))
        return value / self.unit if np.isfinite(value) else 1e6

    def rows(self, z: Floats) -> Floats:
        """All rows, (m,): of requirements that samples have broken, of all margins, and of dimensions alone."""
        return np.concatenate([rows.ravel() for _, rows in self._parts(self.candidate(z))])

    def _parts(self, machine: Candidate) -> list[tuple[Requirement, Floats]]:
        return [(each, each.rows(machine) - self.slack * (each.kind == "margin")) for each in self.asked_for]

    def look_at(self, poses: Floats, z: Floats) -> None:
        """Add poses, and the requirements that the machine at z breaks there."""
        machine, known = self.asked.at(z, poses), self.asked_for
        self.poses = np.concatenate([self.poses, poses])
        self.asked_for = [each for each in self.requirements if each in known or each.rows(machine).min() < -KEPT]
        self._kept.clear()

    def ask(self, slack: float) -> None:
        """Ask for another least margin beyond that which is kept."""
        self.slack = slack
        self._kept.clear()

    def answer(self) -> Design:
        """Rounds until a proof, or wishes that contradict."""
        found = self._first()
        last = CheckedMachine("NOT FOUND", found)
        for number in range(MOST_ROUNDS):
            if self.asked.tell is not None:
                self.asked.tell(number, MOST_ROUNDS)
            found = self._anew(self._settled(found))
            if KEPT < found.violation <= KEPT + self.slack and not self.rounds:
                self.ask(0.0)
                found = self._settled(smallest(self.aim, self.rows, found.z))
            if found.violation > KEPT:
                return self._result(last if last.verdict == "OPEN" else CheckedMachine("NOT FOUND", found))
            last = self._checked(found)
            self.rounds.append(
                DesignRound(self._named(found), self._value(found), len(self.poses), last.verdict, last.refuted_by)
            )
            is_open = last.verdict == "OPEN"
            if last.verdict in ("PROVED", "CHECKED") or last.is_final or (is_open and self.slack > MOST_SLACK):
                return self._result(last)
            if is_open:
                self.ask(max(4.0 * self.slack, SLACK * 1e-3))
            found = smallest(self.aim, self.rows, found.z)
        if last.verdict == "REFUTED":
            reason = f"a further pose refuted each of {MOST_ROUNDS} rounds"
            return self._result(last._replace(verdict="OPEN", mechanism=None, certificate=None, reason=reason))
        return self._result(last)

    def _first(self) -> Found:
        """The best of several starts."""
        starts = self._starts()
        unit = abs(self._aim(self.candidate(starts[0])))
        self.unit = unit if unit and np.isfinite(unit) else 1.0
        return min((smallest(self.aim, self.rows, each) for each in starts), key=_rank)

    def _starts(self) -> list[Floats]:
        """The machine as described, a design nearby, and the spread points that break the least at the poses so far."""
        dimensions = self.asked.dimensions
        known = np.stack([dimensions.own, *self._near])
        z = np.clip((known - dimensions.low) / (dimensions.high - dimensions.low), 0.0, 1.0)
        others = spread(SCREENED, z.shape[1], self.asked.rng)
        worst = np.array([self.rows(each).min(initial=0.0) for each in others])
        return [*z, *others[np.argsort(-worst, kind="stable")[:STARTS]]]

    def _anew(self, found: Found) -> Found:
        """The best from other starts, if the poses so far have left none near the last."""
        for _ in range(MOST_ANEW):
            if found.violation <= KEPT:
                return found
            tried = [self._settled(smallest(self.aim, self.rows, each)) for each in self._starts()]
            again = [Found(each.z, each.aim, max(0.0, -self.rows(each.z).min())) for each in (found, *tried)]
            found = min(again, key=_rank)
        return found

    def _settled(self, found: Found) -> Found:
        """The smallest aim at the poses so far and at the worst samples, again while there are such."""
        for _ in range(MOST_INNER):
            if found.violation > KEPT:
                return found
            poses, worst = self._worst(found, SAMPLES, self.slack)
            broken = worst < -10.0 * KEPT
            if not broken.any():
                return found
            self.look_at(poses[broken][:WORST], found.z)
            found = smallest(self.aim, self.rows, found.z)
        return found

    def _worst(self, found: Found, count: int, slack: float) -> tuple[Floats, Floats]:
        """Poses where the least row is about the least, and that row: the worst first."""

        def least(poses: Floats) -> Floats:
            machine = self.asked.at(found.z, poses)
            of_poses = [each for each in self.requirements if each.has_poses]
            rows = [each.rows(machine).min(axis=1) - slack * (each.kind == "margin") for each in of_poses]
            return np.asarray(np.min(rows, axis=0))

        return self.asked.reach.worst(least, count)

    def _checked(self, found: Found) -> CheckedMachine:
        """The outcome for dimensions; poses that refute them are looked at from now on."""
        asked, reach = self.asked, self.asked.reach
        try:
            mechanism = asked.mechanism.with_dimensions(self._named(found))
        except InvalidMechanism as fault:
            return CheckedMachine("OPEN", found, reason=f"no machine has these dimensions: {fault}")
        poses, worst = self._worst(found, DENSE, 0.0)
        if worst[0] < -10.0 * KEPT:
            self.look_at(poses[:WORST], found.z)
            return CheckedMachine("REFUTED", found, mechanism, refuted_by=reach.at(mechanism, poses)[0])
        if reach.region is None:
            statuses = np.array(solve_ik(mechanism, reach.at(mechanism, reach.poses)).status)
            if (statuses != Status.REACHED).any():
                return CheckedMachine("OPEN", found, mechanism, "a pose is not quite reached")
        least = max(each.least for each in self.requirements)
        gap = max(0.5 * self.slack, 1e-6) if least else None
        certificate = reach.certificate(mechanism, tolerance=gap, executor=asked.executor, on_progress=_silent)
        if certificate is None:
            return CheckedMachine("CHECKED", found, mechanism)
        if certificate.refutation is not None:
            pose = certificate.refutation.pose
            self.look_at(reach.at(mechanism, pose[None], -1.0), found.z)
            return CheckedMachine("REFUTED", found, mechanism, "", certificate, pose)
        if certificate.margin >= least:
            return CheckedMachine("PROVED", found, mechanism, "", certificate)
        reason = certificate.reason or f"the margin is proved to {certificate.margin:.6g}"
        reason += "" if certificate.has_bounds else ": ask for poses, which are checked"
        is_final = not (certificate or (certificate.has_bounds and len(certificate.open_boxes)))
        return CheckedMachine("OPEN", found, mechanism, reason, certificate, None, is_final)

    def _named(self, found: Found) -> dict[str, float]:
        return self.asked.dimensions.named(self.asked.values(found.z))

    def _value(self, found: Found) -> float:
        return float(self._aim(self.candidate(found.z)))

    def _result(self, last: CheckedMachine) -> Design:
        asked, found, is_found, reason = self.asked, last.found, last.verdict != "NOT FOUND", last.reason
        binding = self._binding(found, is_found)
        if not is_found:
            against = " against ".join(list(dict.fromkeys(each.requirement for each in binding))[:2])
            reason = f"nothing within the bounds keeps all: {against}, missed by {found.violation:.2g} at least"
        return Design(
            cast(Verdict, last.verdict),
            last.mechanism,
            self._named(found),
            self._value(found),
            self.words,
            last.certificate,
            tuple(each.name for each in self.requirements if each.has_poses and each.kind != "margin"),
            tuple(binding),
            tuple(self.rounds),
            reason,
            _bounds=asked.bounds,
            _name=asked.mechanism.name,
            _machine=asked.mechanism,
            _reach=asked.reach,
        )

    def _binding(self, found: Found, is_found: bool) -> list[Binding]:
        """Rows and bounds with multipliers, the largest first."""
        near = NEAR if is_found else NEAR - found.violation
        shares = multipliers(self.aim if is_found else None, self.rows, found.z, near)
        total = sum(float(part.sum()) for part in shares) or 1.0
        least = BINDS * (total if is_found else float(shares.rows.sum()))  # bounds where machines end outweigh all rows
        machine, binding, first = self.candidate(found.z), [], 0
        for each, rows in self._parts(machine):
            for row in np.flatnonzero(shares.rows[first : first + rows.size] > least).tolist():
                pose, column = divmod(row, rows.shape[-1])
                where = machine.poses[pose] if each.has_poses else None
                share = float(shares.rows[first + row] / total)
                binding.append(Binding(each.name, each.labels(machine)[column], where, share))
            first += rows.size
        for place, (name, ends) in enumerate(self.asked.bounds.items()):
            for share, sign, end in zip((shares.low[place], shares.high[place]), (">=", "<="), ends, strict=True):
                if share > BINDS * total:
                    binding.append(Binding(f"{name} {sign} {end:g}", "bound", None, float(share / total)))
        return sorted(binding, key=lambda each: -each.share)


def _rank(found: Found) -> tuple[float, float]:
    return (0.0 if found.violation <= KEPT else found.violation, found.aim)


def _silent(done: int, total: int) -> None:
    """Progress of a proof within a design, which has its own."""


def aim_of(asked: DesignQuestion, minimise: Any) -> tuple[str, Callable[[Candidate], float]]:
    """An aim in words, and its value of a machine, which is not finite where it has none."""
    if callable(minimise):
        value = minimise(asked.mechanism)
        if not isinstance(value, int | float | np.number) or not np.isfinite(value):
            raise InvalidArgument("minimise", f"{value!r} of the machine as it is", "a function that gives a number")

        def of_machine(machine: Candidate) -> float:
            try:
                return float(minimise(machine.unlimited))
            except InvalidMechanism:
                return np.inf

        return getattr(minimise, "__name__", "aim"), of_machine
    if minimise == "size":
        return "size", lambda machine: 2.0 * machine.length if machine.is_machine else np.inf
    if minimise == "stroke":

        def stroke(machine: Candidate) -> float:
            strokes = np.ptp(machine.actuators, axis=0) * machine.length / machine.units
            return float(strokes.max()) if machine.is_machine else np.inf

        return "stroke", stroke
    if not isinstance(minimise, str):
        raise InvalidArgument("minimise", repr(minimise), "size, stroke, an expression of dimensions, or a function")
    asked.dimensions.source.value_of(minimise, {}, "minimise")
    return minimise, lambda machine: machine.value_of(minimise)
