"""`design`: dimensions for what a machine must do, found by counterexample, with the proof."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from typing import Any, Literal, NamedTuple

import numpy as np

from ..answers.status import Status
from ..arrays import Floats
from ..certify.certificates import Certificate
from ..certify.pose_region import PoseRegion
from ..checks import require_choice, require_finite, require_mapping
from ..description.mechanism import Mechanism, checked_mechanism
from ..errors import InvalidArgument, InvalidMechanism, UnknownName
from ..extras import require
from ..ik import solve_ik
from ..kinematics import varied
from ..targets import Target
from ..telling import OnProgress, telling
from .candidate import Candidate, Dimensions
from .keep import DEFAULT_SINGULARITY, Home, Margin, OfPoses, Requirement, clearance, requirement_of, singularity
from .reach import Reach
from .result import Binding, Design, Designs, Round
from .search import KEPT, NEAR, Found, multipliers, smallest, spread

MOST_ROUNDS, MOST_INNER = 20, 12
"""Rounds that end with a proof or a pose that refutes; searches in a round, as samples show further poses."""

STARTS, SCREENED = 3, 256
"""Starts beside the machine as described: of so many spread points those that break the least."""

WORST = 3
"""Poses that are added at a time."""

SLACK = 1e-4
"""Least margin over a region, of which a proof needs some; it doubles where a proof does not end."""

BINDS = 1e-3
"""Share of a multiplier from which a row binds."""

FRONT = 7
"""Designs of a front."""

Aim = str | Callable[[Mechanism], float]


def design(
    mechanism: Mechanism | Sequence[Mechanism] | Mapping[str, Mechanism],
    vary: Mapping[str, tuple[float, float]],
    reach: PoseRegion | Target,
    *,
    keep: Iterable[Requirement | str] = (),
    minimise: Aim | tuple[Aim, Aim] = "size",
    about: Literal["base", "home"] = "base",
    seed: int = 0,
    executor: Executor | None = None,
    on_progress: OnProgress | None = None,
) -> Any:
    """Find dimensions with which a machine reaches all poses of a region and keeps what it must, as small as can be.

    By counterexample: the smallest aim for some poses; `certify` proves the region, or has a pose that is not reached,
    which is one more of them; and so on. Requirements other than margins have no proof: many samples decide, and the
    result says so.

    Parameters
    ----------
    mechanism : Mechanism or sequence of Mechanism or mapping of str to Mechanism
        A machine from a file with dimensions, whose chains are all legs in closed form; or several to compare.
    vary : mapping of str to tuple
        Dimension -> its lowest and highest value, in the units of the file. Of several machines each has those of them
        that it knows.
    reach : PoseRegion or array or Track
        What is to be reached: a region, poses as in `solve_ik`, or a Track, also between its steps.
    keep : iterable of Requirement or str, optional
        Requirements of `pfabrik.keep`, and relations of dimensions, "rod >= 1.2*arm". A distance from singularities is
        kept unless `keep.singularity(None)` is among them; a machine with a clearance keeps that.
    minimise : str or callable or tuple, optional
        "size": the diameter of the smallest sphere about the centres of all joints at home [length]. "stroke": the
        longest way of an actuator over the poses [length, or rad times L]. Or an expression of dimensions, or a
        function of a Mechanism. Two of these give a front.
    about : {"base", "home"}, optional
        Where positions of `reach` count from: the base's origin, or the reference point at home, which may move with
        the dimensions.
    seed : int, optional
        Of starts and samples.
    executor : Executor, optional
        Of `concurrent.futures`, or one like it, on whose workers `certify` looks at cells.
    on_progress : callable, optional
        Called with (rounds done, most rounds); default: a line on a terminal.

    Returns
    -------
    Design, or Designs of several machines
        True if found. Wishes that contradict each other end as "NOT FOUND", with those that do by name.

    Raises
    ------
    UnknownName or InvalidArgument
        No such dimension; bounds that are none; no poses.
    UnsupportedMechanism
        A chain is no leg in closed form.
    MissingLibrary
        SciPy is not installed.
    """
    require("design", "scipy", "calibrate")
    require_choice("about", about, ("base", "home"))
    bounds = _bounds(vary)
    requirements = [requirement_of(each) for each in ([keep] if isinstance(keep, str | Requirement) else keep)]
    if isinstance(mechanism, Mapping) or not isinstance(mechanism, Mechanism | str):
        machines = (
            dict(mechanism)
            if isinstance(mechanism, Mapping)
            else {m.name: m for m in map(checked_mechanism, mechanism)}
        )
        if not machines:
            raise InvalidArgument("mechanism", "no machine", "one or more")
        known = {name for m in machines.values() for name in m.dimensions}
        for name in bounds:
            if name not in known:
                raise UnknownName("dimension", name, sorted(known))
        return Designs(
            [
                replace(
                    design(
                        m,
                        {name: ends for name, ends in bounds.items() if name in m.dimensions},
                        reach,
                        keep=requirements,
                        minimise=minimise,
                        about=about,
                        seed=seed,
                        executor=executor,
                        on_progress=on_progress,
                    ),
                    _name=name,
                )
                for name, m in machines.items()
            ]
        )
    machine = checked_mechanism(mechanism)
    for name in bounds:
        if name not in machine.dimensions:
            raise UnknownName("dimension", name, machine.dimensions)
    with telling("design", on_progress) as tell:
        asked = _Asked(machine, bounds, reach, requirements, about, seed, executor, tell)
        if isinstance(minimise, tuple):
            return _front(asked, *minimise)
        return asked.answer(minimise)


def _bounds(vary: Any) -> dict[str, tuple[float, float]]:
    given = require_mapping("vary", vary, "bounds by the names of dimensions")
    if not given:
        raise InvalidArgument("vary", "no dimension", "bounds by the names of dimensions")
    found = {}
    for name, ends in given.items():
        try:
            low, high = (require_finite(f"vary['{name}']", end) for end in ends)
        except (TypeError, ValueError):
            raise InvalidArgument(f"vary['{name}']", repr(ends), "a lowest and a highest value") from None
        if not low < high:
            raise InvalidArgument(f"vary['{name}']", f"{low:g} to {high:g}", "the lowest value first, then the highest")
        found[name] = (low, high)
    return found


class _Asked:
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
        self.rng = np.random.default_rng(seed)
        self.reach = Reach(mechanism, reach, about, self.rng)
        own = [each for each in requirements if each.name]
        if not any(isinstance(each, Margin) for each in own):
            own.insert(0, Margin(0.0))
        if not any("singularity" in each.name or not each.name for each in requirements):
            own.append(singularity(DEFAULT_SINGULARITY))
        if mechanism.clearance is not None:
            own.append(clearance(mechanism.clearance))
        self.requirements = [*own, Home()]

    def answer(self, minimise: Aim, extra: Sequence[Requirement] = ()) -> Design:
        """The design with the smallest aim."""
        return _Search(self, minimise, extra).answer()

    def at(self, z: Floats, poses: Floats) -> Candidate:
        """The machine at shares z (p,) of the bounds, at poses (n, 4, 4)."""
        values = self.dimensions.low + z * (self.dimensions.high - self.dimensions.low)
        return self.dimensions.at(values, poses, from_home=self.reach.from_home)


class _Place(NamedTuple):
    """What a row is of: a requirement, a column, and the index of a pose, -1 without poses."""

    requirement: Requirement
    column: int
    pose: int


class _Search:
    """The search for one aim."""

    def __init__(self, asked: _Asked, minimise: Aim, extra: Sequence[Requirement]) -> None:
        self.asked, self.requirements = asked, [*asked.requirements, *extra]
        self.words, self._aim = _aim_of(asked, minimise)
        self.poses, self.slack = asked.reach.first(), SLACK if asked.reach.region is not None else 0.0
        self._kept: dict[bytes, Candidate] = {}
        self.rounds: list[Round] = []
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
        """What is to be small, of order 1."""
        value = self._aim(self.candidate(z))
        return value / self.unit if np.isfinite(value) else 1e6

    def rows(self, z: Floats) -> Floats:
        """All rows, (m,)."""
        return np.concatenate([rows.ravel() for _, rows in self._parts(self.candidate(z))])

    def _parts(self, machine: Candidate) -> list[tuple[Requirement, Floats]]:
        parts = []
        for each in self.requirements:
            found = each.rows(machine)
            parts.append((each, found - self.slack if isinstance(each, Margin | Home) else found))
        return parts

    def places(self, z: Floats) -> list[_Place]:
        """What every row is of."""
        found = []
        for each, rows in self._parts(self.candidate(z)):
            if each.has_poses:
                found += [_Place(each, j, i) for i in range(rows.shape[0]) for j in range(rows.shape[1])]
            else:
                found += [_Place(each, j, -1) for j in range(len(rows))]
        return found

    def look_at(self, poses: Floats) -> None:
        """Add poses."""
        self.poses = np.concatenate([self.poses, poses])
        self._kept.clear()

    def answer(self) -> Design:
        """Rounds until a proof, or wishes that contradict."""
        found = self._first()
        reason = f"no proof in {MOST_ROUNDS} rounds"
        for number in range(MOST_ROUNDS):
            if self.asked.tell is not None:
                self.asked.tell(number, MOST_ROUNDS)
            found = self._settled(found)
            if found.violation > KEPT:
                found = self._anew(found)
            if found.violation > KEPT:
                return self._result("NOT FOUND", found, None, None)
            verdict, mechanism, certificate, pose, reason = self._checked(found)
            self.rounds.append(Round(self._named(found), self._value(found), len(self.poses), verdict, pose))
            if verdict in ("PROVED", "CHECKED"):
                return self._result(verdict, found, mechanism, certificate)
            if pose is None:
                self.slack = max(2.0 * self.slack, SLACK * 1e-3)
                self._kept.clear()
            found = smallest(self.aim, self.rows, found.z)
        return self._result("OPEN", found, mechanism, certificate, reason)

    def _first(self) -> Found:
        """The best of several starts."""
        dimensions = self.asked.dimensions
        own = np.array([self.asked.mechanism.dimensions[name] for name in dimensions.names])
        z = np.clip((own - dimensions.low) / (dimensions.high - dimensions.low), 0.0, 1.0)
        others = spread(SCREENED, len(z), self.asked.rng)
        worst = np.array([self.rows(each).min(initial=0.0) for each in others])
        starts = [z, *others[np.argsort(-worst, kind="stable")[:STARTS]]]
        self.unit = abs(self._aim(self.candidate(z))) or 1.0
        if not np.isfinite(self.unit):
            self.unit = 1.0
        return min((smallest(self.aim, self.rows, each) for each in starts), key=_rank)

    def _anew(self, found: Found) -> Found:
        """The best from other starts where the poses so far have left none near the last."""
        others = spread(2 * STARTS, len(found.z), self.asked.rng)
        tried = [self._settled(smallest(self.aim, self.rows, each)) for each in others]
        return min([found, *tried], key=_rank)

    def _settled(self, found: Found) -> Found:
        """The smallest aim at the poses so far and at the worst samples, again while there are such."""
        samples = self.asked.reach.poses
        for _ in range(MOST_INNER):
            if found.violation > KEPT:
                return found
            worst = self._worst(self.asked.at(found.z, samples))
            broken = np.flatnonzero(worst < -10.0 * KEPT)
            if not len(broken):
                return found
            self.look_at(samples[broken[np.argsort(worst[broken])[:WORST]]])
            found = smallest(self.aim, self.rows, found.z)
        return found

    def _worst(self, machine: Candidate, unproved_only: bool = False) -> Floats:
        """The least row at each pose, (n,)."""
        rows = [
            found.min(axis=1, initial=np.inf)
            for each, found in self._parts(machine)
            if each.has_poses and not (unproved_only and each.is_proved)
        ]
        return np.min(rows, axis=0) if rows else np.full(len(machine.poses), np.inf)

    def _checked(self, found: Found) -> tuple[str, Mechanism | None, Certificate | None, Floats | None, str]:
        """The verdict on dimensions, the machine, its certificate, a pose that refutes them, and why it is open."""
        asked, reach = self.asked, self.asked.reach
        values = self._named(found)
        try:
            mechanism = asked.mechanism.with_dimensions(values)
        except InvalidMechanism as fault:
            return "OPEN", None, None, None, f"no machine has these dimensions: {fault}"
        dense = reach.dense()
        worst = self._worst(asked.at(found.z, dense), unproved_only=True)
        if worst.min(initial=np.inf) < -10.0 * KEPT:
            place = int(np.argmin(worst))
            self.look_at(dense[place][None])
            return "REFUTED", mechanism, None, self._placed(dense[place], mechanism), "a sample breaks a requirement"
        statuses = np.array(solve_ik(mechanism, reach.at(mechanism)).status) if reach.region is None else np.zeros(0)
        missed = np.flatnonzero(statuses != Status.REACHED)
        if len(missed):
            self.look_at(reach.poses[missed[:1]])
            return "OPEN", mechanism, None, None, "a pose is not quite reached"
        certificate = reach.certificate(mechanism, executor=asked.executor, on_progress=_silent)
        if certificate is None or certificate.verdict == "PROVED":
            return "CHECKED" if certificate is None else "PROVED", mechanism, certificate, None, ""
        if certificate.refutation is None:
            return "OPEN", mechanism, certificate, None, certificate.reason
        pose = certificate.refutation.pose
        self.look_at(reach.relative(pose, mechanism)[None])
        return "REFUTED", mechanism, certificate, pose, ""

    def _placed(self, pose: Floats, mechanism: Mechanism) -> Floats:
        moved = pose.copy()
        if self.asked.reach.from_home:
            moved[:3, 3] += mechanism.reference_point
        return moved

    def _named(self, found: Found) -> dict[str, float]:
        dimensions = self.asked.dimensions
        return dimensions.named(dimensions.low + found.z * (dimensions.high - dimensions.low))

    def _value(self, found: Found) -> float:
        return float(self._aim(self.candidate(found.z)))

    def _result(
        self,
        verdict: Any,
        found: Found,
        mechanism: Mechanism | None,
        certificate: Certificate | None,
        reason: str = "",
    ) -> Design:
        asked, is_found = self.asked, verdict != "NOT FOUND"
        binding = self._binding(found, is_found)
        if not is_found:
            names = list(dict.fromkeys(each.requirement for each in binding))
            against = " against ".join(names[:2]) if len(names) > 1 else "".join(names)
            reason = f"nothing within the bounds keeps all: {against}, missed by {found.violation:.2g} at least"
        unproved = tuple(each.name for each in self.requirements if each.has_poses and not each.is_proved)
        own = asked.mechanism.dimensions
        return Design(
            verdict,
            mechanism,
            self._named(found),
            self._value(found),
            self.words,
            certificate,
            unproved,
            tuple(binding),
            tuple(self.rounds),
            reason,
            _before={name: own[name] for name in asked.bounds},
            _bounds=asked.bounds,
            _name=asked.mechanism.name,
        )

    def _binding(self, found: Found, is_found: bool) -> list[Binding]:
        """Rows and bounds with multipliers, the largest first."""
        near = NEAR if is_found else NEAR - found.violation
        shares = multipliers(self.aim if is_found else None, self.rows, found.z, near)
        total = sum(float(part.sum()) for part in shares) or 1.0
        machine, places = self.candidate(found.z), self.places(found.z)
        binding = []
        for row in np.flatnonzero(shares.rows > BINDS * total).tolist():
            requirement, column, pose = places[row]
            label = requirement.labels(machine)[column]
            where = machine.poses[pose] if pose >= 0 else None
            binding.append(Binding(requirement.name, label, where, float(shares.rows[row] / total)))
        for name, (low, high), at_low, at_high in zip(
            self.asked.bounds, self.asked.bounds.values(), shares.low, shares.high, strict=True
        ):
            for share, words in ((at_low, f"{name} >= {low:g}"), (at_high, f"{name} <= {high:g}")):
                if share > BINDS * total:
                    binding.append(Binding(words, "bound", None, float(share / total)))
        return sorted(binding, key=lambda each: -each.share)


def _rank(found: Found) -> tuple[float, float]:
    return (0.0 if found.violation <= KEPT else found.violation, found.aim)


def _silent(done: int, total: int) -> None:
    """Progress of a proof within a design, which has its own."""


def _aim_of(asked: _Asked, minimise: Aim) -> tuple[str, Callable[[Candidate], float]]:
    """An aim in words, and its value of a machine."""
    if callable(minimise):
        return getattr(minimise, "__name__", "aim"), lambda machine: float(minimise(machine.unlimited))
    if minimise == "size":
        return "size", lambda machine: 2.0 * machine.length
    if minimise == "stroke":
        is_length = np.array([drive.kind == "length" for drive in asked.mechanism.drives])

        def stroke(machine: Candidate) -> float:
            used = np.ptp(machine.actuators, axis=0)
            return float(np.where(is_length, used, used * machine.length).max())

        return "stroke", stroke
    if not isinstance(minimise, str):
        raise InvalidArgument("minimise", repr(minimise), "size, stroke, an expression of dimensions, or a function")
    source = asked.dimensions.source
    source.value_of(minimise, {})
    return minimise, lambda machine: float(source.value_of(minimise, machine.dimensions.named(machine.values)))


def _front(asked: _Asked, first: Aim, second: Aim) -> Design:
    """Designs from the smallest first aim to the smallest second one, in equal steps of the second."""
    _, other = _aim_of(asked, second)
    words = _aim_of(asked, second)[0]

    def second_of(found: Design) -> float:
        dimensions = asked.dimensions
        values = np.array(list(found.dimensions.values()))
        return other(dimensions.at(values, asked.reach.poses, from_home=asked.reach.from_home))

    ends = asked.answer(first), asked.answer(second)
    if not all(ends):
        return ends[0] if not ends[0] else ends[1]
    most, least = second_of(ends[0]), second_of(ends[1])
    designs = [replace(ends[0], _other=most)]
    for bound in np.linspace(most, least, FRONT)[1:]:
        eased = bound + 1e-4 * abs(most - least)

        def kept(machine: Candidate, eased: float = eased) -> Floats:
            return np.full((len(machine.poses), 1), (eased - other(machine)) / (abs(most) or 1.0))

        found = asked.answer(first, [OfPoses(f"{words} <= {eased:.6g}", kept)])
        if found:
            designs.append(replace(found, _other=second_of(found)))
    best = designs[0]
    return replace(best, front=tuple(designs), minimised=f"{best.minimised}, {words}")
