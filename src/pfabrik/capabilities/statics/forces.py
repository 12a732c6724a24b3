"""Actuator forces, joint reactions, and forces along rods that only pull or push, in static equilibrium."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...answers.solution import Solution, checked_solution
from ...common.arrays import Floats, Ints, Mask, as_plain, shaped
from ...common.derived import derived
from ...common.frozen import FrozenMapping
from ...common.printed import Printed, ResultTable, plain
from ...kinematics import JointRates, actuator_units, end_effector_pose, joint_centres, model_of
from ...machine.description.mechanism import Mechanism
from ...tolerances import TOLERANCES
from .footing import Feet, best_footing, cone_rows, feet_of, off_the_ends, spare_of
from .geometric_stiffness import geometric_stiffness
from .joint_balance import (
    COMPONENTS,
    ROWS_A_BLOCK,
    Balance,
    Pairs,
    about_centres,
    balance,
    open_components,
    open_in_words,
    pairs_at,
    pairs_of,
)
from .loads import (
    Asked,
    BodyLoads,
    Bounds,
    Load,
    Reasons,
    acting,
    add_reason,
    asked_of,
    bounds_of,
    carried_of,
    checked_gravity,
    checked_loads,
    has_reason,
    in_shape,
    no_reasons,
    reasons_in_words,
)
from .sharing import within_limits
from .transmission import GAINS_MOTION, NO_CONFIGURATION, gives_way_in_words, is_redundantly_actuated, maps_of

GRAVITY = (0.0, 0.0, -9.81)
OFF_FEET = "no forces of the actuators keep every contact from slipping and lifting: {} would be the first"
BEYOND = "actuators within their limits do not hold the load: {}"
FREE_PART = "the loads move a part that neither the end effector nor an actuator holds"


class _Question(NamedTuple):
    """Arguments of `forces`."""

    solution: Solution
    asked: Asked
    loads: list[Load]
    gravity: Floats
    limits: Floats | None
    feet: Feet | None


class Reactions(Printed, FrozenMapping[str, Floats]):
    """Joint -> what it transmits, as `Forces.reactions` gives it; printed with the forces along rods."""

    def __init__(self, given: Mapping[str, Floats], forces: Forces) -> None:
        super().__init__(given)
        self._forces = forces

    def table(self) -> ResultTable:
        """Force and moment of every joint, and forces along rods; of a batch, the largest magnitude of each number."""
        forces, mechanism = self._forces, self._forces._mechanism
        units = ["force"] * 3 + [f"force {mechanism.length_unit}"] * 3
        scales = np.repeat([1.0, mechanism.characteristic_length], 3)
        wrenches = {name: _largest(np.reshape(wrench, (-1, 6))) for name, wrench in self.items()}
        size = float(np.nanmax(np.abs([*wrenches.values()]) / scales, initial=0.0))
        least = (TOLERANCES.rank * size * scales).tolist()
        cells = [(name, *map(plain, wrench, least, [".5g"] * 6)) for name, wrench in wrenches.items()]
        pulls = {name: _largest(np.reshape(pull, (-1, 1)))[0] for name, pull in forces.rods.items()}
        rods = [(name, plain(pull, least[0], ".5g")) for name, pull in pulls.items()]
        header = [f"{name} [{unit}]" for name, unit in zip(COMPONENTS, units, strict=True)]
        more = [ResultTable("", (), ("rod", "pulled by [force]"), rods)] if rods else []
        lines = reasons_in_words(forces.reason, "no forces")
        remarks = [forces.undetermined] if forces.undetermined else []
        return ResultTable("Reactions", lines, ("joint", *header), cells, remarks, more=more)

    def to_dict(self) -> dict[str, Any]:
        """Joints and rods by name, and what equilibrium does not determine: ready for JSON."""
        named = {"joints": self, "rods": self._forces.rods}
        plain = {name: {key: as_plain(value) for key, value in of.items()} for name, of in named.items()}
        return {**plain, "undetermined": self._forces.undetermined}


def _largest(rows: Floats) -> list[float]:
    """The largest of each column by magnitude, NaN where no row is known."""
    padded = np.vstack([rows, np.full(rows.shape[1], np.nan)])
    places = np.where(np.isnan(padded), -1.0, np.abs(padded)).argmax(axis=0)
    largest: list[float] = padded[places, np.arange(rows.shape[1])].tolist()
    return largest


@dataclass(frozen=True, eq=False)
class Forces(Printed):
    """Forces in static equilibrium, as `forces` returns them.

    Attributes
    ----------
    actuators : array (..., n_a)
        Force or torque that each actuator exerts: positive drives its coordinate up. A strut that is pressed has a
        positive one, a cable under tension a negative one. NaN where `reason` says why.
    is_least_norm : bool
        True if there are more actuators than motions that they control: of all forces that hold the load, those with
        the least sum of squares are given, torques compared with forces times L; with `limits`, those nearest to the
        middle of these.
    spare : mapping of str to float or array (...)
        With `friction`, contact -> the normal force that it may lose before it slips or lifts.
    margin : float or array (...)
        With `limits`, how far the actuator that is nearest to one of its own is from it, in the unit of that; infinite
        without.
    binding : str or array of str (...)
        That limit: the actuator, and "low" or "high"; empty without any.
    reason : str or array of str (...)
        Why there are no such forces; empty where there are. A text for a single answer.
    """

    actuators: Floats
    is_least_norm: bool
    reason: str | Reasons
    _question: _Question = field(repr=False)

    def table(self) -> ResultTable:
        """What each actuator exerts, or why no forces hold the load; of a batch, the largest of each."""
        mechanism, exerted = self._mechanism, np.reshape(self.actuators, (-1, len(self._mechanism.actuator_names)))
        lines = reasons_in_words(self.reason, "no forces")
        largest = _largest(exerted)
        if np.isnan(largest).any():
            return ResultTable(mechanism.name, lines or ["no row"])
        least = 1e-9 * max(map(abs, largest), default=0.0)
        units = ["force" if drive.kind == "length" else f"force {mechanism.length_unit}" for drive in mechanism.drives]
        values = [plain(value, least) for value in largest]
        remarks = []
        if self._question.limits is not None:
            place = int(np.nanargmin(np.ravel(self.margin)))
            remarks = [f"least margin: {np.ravel(self.margin)[place]:.6g} of {np.ravel(self.binding)[place]}"]
        if self.spare:
            name, least = min(
                ((n, float(np.nanmin(value))) for n, value in self.spare.items()), key=lambda each: each[1]
            )
            remarks.append(f"{name} is the first to slip or lift: it has {least:.5g} of normal force to spare")
        header = ("actuator", "exerts" if np.ndim(self.actuators) == 1 else "of largest magnitude", "unit")
        return ResultTable(
            mechanism.name, lines, header, list(zip(mechanism.actuator_names, values, units, strict=True)), remarks
        )

    @cached_property
    def margin(self) -> float | Floats:
        """See the attributes."""
        of_batch: float | Floats = shaped(self._nearest[0], self._question.asked.shape)
        return of_batch

    @cached_property
    def binding(self) -> str | Reasons:
        """See the attributes."""
        margins, places = self._nearest
        words = [f"{name} {end}" for name in self._mechanism.actuator_names for end in ("low", "high")]
        found = [words[place] if np.isfinite(margin) else "" for margin, place in zip(margins, places, strict=True)]
        return in_shape(np.array(found, dtype=object), self._question.asked.shape)

    @cached_property
    def _nearest(self) -> tuple[Floats, Ints]:
        """The distance to the nearest limit of every row, and which that is: each actuator has a low and a high one."""
        exerted, limits = np.reshape(self.actuators, (-1, len(self._mechanism.actuator_names))), self._question.limits
        if limits is None:
            return np.full(len(exerted), np.inf), np.zeros(len(exerted), np.int64)
        room = np.stack([exerted - limits[:, 0], limits[:, 1] - exerted], axis=-1)
        scaled = (room * actuator_units(self._mechanism)[:, None]).reshape(len(exerted), -1)
        places = np.argmin(np.where(np.isnan(scaled), np.inf, scaled), axis=1)
        return room.reshape(len(exerted), -1)[np.arange(len(exerted)), places], places

    @cached_property
    def spare(self) -> Mapping[str, float | Floats]:
        """Contact -> the normal force that it may lose before it slips or lifts, (...); empty without `friction`."""
        feet = self._question.feet
        if feet is None:
            return FrozenMapping({})
        pressing = feet.signs[:, None] * self._transmitted[:, feet.places, :3]
        left = spare_of(np.einsum("fij,nfj->nfi", cone_rows(feet), pressing))
        return FrozenMapping({name: self._shaped(left[:, place]) for place, name in enumerate(feet.names)})

    @cached_property
    def reactions(self) -> Reactions:
        """Joint -> force and moment that its first body exerts on its second, (..., 6), in the base frame.

        The moment is about the joint's centre; of a slide about that of the first joint of its `along`, or, without
        these, about the reference point. NaN where `reason` says why, and where `undetermined` does.
        """
        wrenches = np.where(self._is_open, np.nan, self._transmitted)
        names = (joint.name for joint in self._mechanism.joints)
        return Reactions({name: self._shaped(wrenches[:, place]) for place, name in enumerate(names)}, self)

    @cached_property
    def undetermined(self) -> str:
        """Which of the reactions equilibrium does not determine, in words; empty if it determines all.

        Of a batch, those of any row.
        """
        sentences = [open_in_words(self._mechanism, self._is_open)]
        return "; ".join(filter(None, sentences + [GAINS_MOTION] * bool(self._balance.is_singular.any())))

    @cached_property
    def rods(self) -> Mapping[str, Floats]:
        """Rod -> force along it, positive if it is pulled, (...): of links between two joints that are not driven.

        NaN where `reason` says why, or where equilibrium does not determine it.
        """
        rods, (centres, _) = rods_of(self._mechanism), self._places
        pulls = tensions(rods, self._balance.wrenches, centres)[..., 0] / self._mechanism.characteristic_length
        open_pulls = np.linalg.norm(tensions(rods, self._balance.open, centres), axis=-1)
        pulls = np.where((open_pulls > TOLERANCES.alignment) | self._is_unknown[:, None], np.nan, pulls)
        return FrozenMapping({name: self._shaped(pulls[:, place]) for place, name in enumerate(rods.names)})

    @property
    def _mechanism(self) -> Mechanism:
        return self._question.solution.mechanism

    def _shaped(self, rows: Floats) -> Floats:
        of_batch: Floats = shaped(rows, self._question.asked.shape)
        return of_batch

    @cached_property
    def _coordinates(self) -> Floats:
        """Joint coordinates of every row; home in place of INVALID ones, (n, c)."""
        q = self._question.solution._coordinates[self._question.asked.places]
        return np.where(np.isnan(q), 0.0, q)

    @cached_property
    def _balance(self) -> Balance:
        found = _balanced(self._question, self._coordinates, slice(None))
        if not self.is_least_norm:
            return found
        exerted = np.reshape(self.actuators, found.actuators.shape[:2]) * actuator_units(self._mechanism)
        more = np.where(np.isnan(exerted), 0.0, exerted - found.actuators[..., 0])
        return _balanced(self._question, self._coordinates, slice(None), more[..., None])

    @cached_property
    def _places(self) -> tuple[Floats, Floats]:
        """Joint centres (n, joints, 3) and reference points (n, 3) [length]."""
        mechanism, q = self._mechanism, self._coordinates
        return joint_centres(mechanism, q), end_effector_pose(mechanism, q)[:, :3, 3]

    def _is_at(self, solution: Solution) -> bool:
        """True if the forces are those at the configurations of a solution."""
        asked, own = self._question.asked, self._question.solution
        is_same = own.mechanism == solution.mechanism and asked.shape == solution.shape
        return is_same and np.array_equal(own._coordinates[asked.places], solution._coordinates, equal_nan=True)

    def _geometric_stiffness(self) -> tuple[Pairs, Floats]:
        """Motions, and the stiffness by these of the forces as the geometry changes, (n, d, d)."""
        mechanism, q, (_, asked, loads, gravity, *_) = self._mechanism, self._coordinates, self._question
        centres, reference = self._places
        arms = (centres - reference[:, None]) / mechanism.characteristic_length
        found = []
        for start in range(0, max(len(q), 1), ROWS_A_BLOCK):
            rows = slice(start, start + ROWS_A_BLOCK)
            first, pulling = JointRates(model_of(mechanism), q[rows]), self._balance.wrenches[rows, ..., 0]
            acting_on = acting(mechanism, q[rows], asked.wrenches[rows], loads, gravity)
            of_load = geometric_stiffness(mechanism, first, arms[rows], pulling, acting_on)
            found.append((*pairs_at(mechanism, first), of_load))
        twists, rates, of_loads = (np.concatenate(parts) for parts in zip(*found, strict=True))
        return Pairs(twists, rates), of_loads

    @cached_property
    def _is_unknown(self) -> Mask:
        return np.isnan(self.actuators).any(axis=-1).ravel() | self._balance.is_singular

    @cached_property
    def _transmitted(self) -> Floats:
        """Wrenches (n, joints, 6): force, and moment about the joints' centres."""
        found = about_centres(self._mechanism, self._balance.wrenches, *self._places)[..., 0]
        return np.where(self._is_unknown[:, None, None], np.nan, found)

    @cached_property
    def _is_open(self) -> Mask:
        """True where a component of a reaction is not determined, (n, joints, 6)."""
        return open_components(self._mechanism, self._balance.open, *self._places)


def forces(
    solution: Solution,
    wrench: ArrayLike | None = None,
    *,
    at: ArrayLike | None = None,
    loads: BodyLoads | None = None,
    gravity: ArrayLike = GRAVITY,
    limits: Bounds | None = None,
    friction: float | Mapping[str, float] | None = None,
) -> Forces:
    """Forces that the actuators exert to hold a load, and what the joints transmit, in static equilibrium.

    Without friction, for all motions that the loops allow: t . dq + w . V = 0, so that t = -F' w with the forward
    Jacobian F. Forces are in any unit, moments and torques in that unit times the machine's length.

    Parameters
    ----------
    solution : Solution
        One configuration or a batch.
    wrench : array (..., 6) or (..., 3), optional
        What acts on the end effector from outside, in the base frame: force and moment, or a force alone (the only
        choice where the end effector is a joint). Its batch goes with that of the solution, as NumPy broadcasts.
    at : array (..., 3), optional
        The point that the force acts at, and the moment is about, in the base frame [length]; the reference point by
        default.
    loads : mapping of str to tuple, optional
        Body -> (mass, centre), for its weight; (force, point) or (wrench, point) for what else acts on it, in the base
        frame. Points are those of the body at home, in base coordinates [length].
    gravity : array (3,), optional
        Gravity, for masses, in units of force per mass.
    limits : float or tuple of float or array (n_a, 2) or mapping of str, optional
        What actuators exert at most, both ways, or (lowest, highest), for all, each, or by name: (-200, -5) of cables
        that stay taut. Redundant actuators then share a load within these, as near to their middle as it lets them; a
        load that none of these forces hold has a reason.
    friction : float or mapping of str to float, optional
        Coefficient of friction between the ground and all point contacts, which are the passive balls on the base, or
        by the names of these joints; the ground's normal is against gravity. Actuators then share the load so that
        the contact that is nearest to slipping or lifting has most to spare. A load that no forces hold without has a
        reason.

    Raises
    ------
    InvalidArgument or UnknownName
        A wrong shape, numbers that are not finite, no such body.
    """
    mechanism = checked_solution(solution).mechanism
    question = _Question(
        solution,
        asked_of(solution, wrench, at),
        checked_loads(mechanism, loads),
        checked_gravity(gravity),
        None if limits is None else bounds_of("limits", limits, mechanism.actuator_names),
        None if friction is None else feet_of(mechanism, friction, checked_gravity(gravity)),
    )
    asked, maps = question.asked, maps_of(solution)
    places = asked.places
    reasons = no_reasons(len(places))
    add_reason(reasons, ~maps.is_valid[places], NO_CONFIGURATION)
    actuators = np.full((len(places), len(mechanism.actuator_names)), np.nan)
    is_quick = maps.is_regular[places] & (not question.loads) & (limits is None) & (friction is None)
    forward = maps.forward[places[is_quick]]
    actuators[is_quick] = -np.einsum("nra,nr->na", forward, asked.wrenches[is_quick, : forward.shape[1]])
    rest = np.flatnonzero(maps.is_valid[places] & ~is_quick)
    if len(rest):
        q = solution._configurations.coordinates_at(places[rest])
        found = _balanced(question, q, rest)
        actuators[rest] = found.actuators[..., 0] / actuator_units(mechanism)
        add_reason(reasons, rest[found.is_singular], GAINS_MOTION)
        add_reason(reasons, rest[found.is_idle[:, 0]], FREE_PART)
        add_reason(reasons, rest[~found.is_held[:, 0]], gives_way_in_words(mechanism))
        if question.limits is not None:
            units = actuator_units(mechanism)
            limits = question.limits if question.feet is None else off_the_ends(question.limits)
            shared, beyond, is_within = within_limits(
                found.actuators[..., 0], pairs_of(mechanism, q).rates, limits * units[:, None]
            )
            actuators[rest] = shared / units
            for row in np.flatnonzero(~is_within):
                add_reason(reasons, [rest[row]], _beyond_in_words(mechanism, question.limits, beyond[row] / units))
        if question.feet is not None:
            rest = rest[~has_reason(reasons[rest])]
            actuators[rest], least, worst = _on_feet(question, actuators[rest], rest)
            for row in np.flatnonzero(least < 0.0):
                add_reason(reasons, [rest[row]], OFF_FEET.format(question.feet.names[worst[row]]))
        actuators[has_reason(reasons)] = np.nan
    return Forces(
        shaped(actuators, asked.shape),
        is_redundantly_actuated(mechanism),
        in_shape(reasons, asked.shape),
        question,
    )


def _on_feet(question: _Question, exerted: Floats, rows: NDArray[np.intp]) -> tuple[Floats, Floats, Ints]:
    """Forces of the actuators (n, n_a) that keep feet on the ground best, the least that one has to spare, and which.

    Parameters
    ----------
    exerted : some that hold the load, within the limits.
    rows : of the question.
    """
    mechanism, feet = question.solution.mechanism, question.feet
    assert feet is not None
    units, spares, chosen = actuator_units(mechanism), np.empty((len(rows), len(feet.names))), exerted.copy()
    limits = np.full((len(units), 2), np.inf) * (-1.0, 1.0) if question.limits is None else question.limits
    for place, row in enumerate(rows):
        q = question.solution._configurations.coordinates_at(question.asked.places[[row]])
        centres, reference = joint_centres(mechanism, q), end_effector_pose(mechanism, q)[:, :3, 3]

        def on_feet(wrenches: Floats, centres: Floats = centres, reference: Floats = reference) -> Floats:
            """Forces (f, 3, k) on the feet from the ground."""
            found = about_centres(mechanism, wrenches, centres, reference)[0, feet.places, :3]
            return np.asarray(feet.signs[:, None, None] * found)

        left, sizes, _ = np.linalg.svd(pairs_of(mechanism, q).rates[0])
        free = left[:, int((sizes > TOLERANCES.singular * sizes[:1]).sum()) :]
        own = np.zeros((1, len(mechanism.joints), 6, free.shape[1]))
        changes = on_feet(balance(mechanism, q, own, free[None]).wrenches)
        more = exerted[place] * units - _balanced(question, q, rows[[place]]).actuators[0, :, 0]
        pressing = on_feet(_balanced(question, q, rows[[place]], more[None, :, None]).wrenches)[..., 0]
        along_free = best_footing(pressing, changes, feet, exerted[place] * units, free, limits * units[:, None])
        chosen[place] += free @ along_free / units
        spares[place] = spare_of(np.einsum("fij,fj->fi", cone_rows(feet), pressing + changes @ along_free))
    least = spares.min(axis=1, initial=np.inf)
    sizes = TOLERANCES.speed * np.abs(spares).max(axis=1, initial=0.0)
    return chosen, np.where(np.abs(least) <= sizes, 0.0, least), spares.argmin(axis=1)


def _beyond_in_words(mechanism: Mechanism, limits: Floats, beyond: Floats) -> str:
    """A reason that names the actuators whose forces are beyond their limits (n_a, 2), and by how much, (n_a,)."""
    sizes, words = np.abs(beyond * actuator_units(mechanism)), []
    for place in np.flatnonzero(sizes > TOLERANCES.speed * sizes.max()):
        name, by, bound = mechanism.actuator_names[place], beyond[place], limits[place, int(beyond[place] > 0.0)]
        does = "push" if bound <= 0.0 < bound + by else "exert"
        words.append(
            f"{name} would {does} {bound + by:.5g}, {abs(by):.5g} {'above' if by > 0.0 else 'below'} its limit"
        )
    return BEYOND.format("; ".join(words))


def _balanced(question: _Question, q: Floats, rows: slice | NDArray[np.intp], more: Floats | float = 0.0) -> Balance:
    """The equilibrium of some rows at their coordinates q, (n, c); of other forces than the least, that are `more`."""
    mechanism = question.solution.mechanism
    carried = carried_of(mechanism, q, question.asked.wrenches[rows], question.loads, question.gravity)
    return balance(mechanism, q, carried[..., None], more)


class Rods(NamedTuple):
    """The rods of a machine.

    Attributes
    ----------
    names : of their bodies.
    starts, ends : indices of their joints, (rods,).
    signs : 1 where the rod is the second body of its end joint, else -1, (rods,).
    """

    names: tuple[str, ...]
    starts: Ints
    ends: Ints
    signs: Floats


@derived
def rods_of(mechanism: Mechanism) -> Rods:
    """Bodies with two joints whose centres are apart and neither of which is driven, except base and end effector."""
    fixed = (mechanism.base, mechanism.end_effector)
    found = []
    for body in mechanism.bodies:
        places = [place for place, joint in enumerate(mechanism.joints) if body in joint.connects]
        places.sort(key=lambda place: mechanism.joints[place].name != mechanism.end_effector)  # its load is at that end
        joints = [mechanism.joints[place] for place in places]
        is_passive = all(joint.at is not None and not joint.driven for joint in joints)
        if len(joints) == 2 and is_passive and body not in fixed and joints[0].at != joints[1].at:
            sign = 1.0 if joints[1].connects[1] == body else -1.0
            found.append((body, *places, sign))
    names, starts, ends, signs = zip(*found, strict=True) if found else ((), (), (), ())
    return Rods(names, np.array(starts, np.int64), np.array(ends, np.int64), np.array(signs, float))


def tensions(rods: Rods, wrenches: Floats, centres: Floats) -> Floats:
    """Forces along rods, positive if they are pulled, (n, rods, k).

    Parameters
    ----------
    wrenches : what joints transmit from their first body to their second, [force; moment], (n, joints, 6, k).
    centres : of joints, (n, joints, 3) [length].
    """
    return np.asarray(np.einsum("nri,nrik->nrk", along(rods, centres), wrenches[:, rods.ends, :3]))


def along(rods: Rods, centres: Floats) -> Floats:
    """Displacements of the end joints' second bodies that make rods longer, (n, rods, 3)."""
    lines = centres[:, rods.ends] - centres[:, rods.starts]
    return np.asarray(lines * (rods.signs / np.linalg.norm(lines, axis=-1))[..., None])
