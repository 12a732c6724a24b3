"""Velocity and force factors, from the actuators to the end effector or to a joint, by forward Jacobians."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ...answers.differential import forward_jacobian, singularity
from ...answers.solution import Solution, checked_solution
from ...answers.status import Status
from ...common.arrays import Floats, Mask
from ...common.printed import Printed, ResultTable, plain, spanned
from ...engines.pose.jacobians import regular_forward_map
from ...errors import counted
from ...kinematics import JointRates, columns, cycle_basis, generic_of, model_of, rate_units
from ...machine.description.mechanism import Mechanism
from ...tolerances import TOLERANCES
from .loads import Reasons, add_reason, has_reason, in_shape, no_reasons, reasons_in_words

NO_CONFIGURATION = "the row is INVALID: it has no configuration"
GIVES_WAY = "a parallel singularity: the end effector moves with all actuators locked"
GAINS_MOTION = "a constraint singularity: the loops let the machine move in more ways than elsewhere"
LEFT_OPEN = "the end effector keeps {} with all actuators locked, in every pose"


class Maps(NamedTuple):
    """Forward Jacobians of n rows, in the machine's units.

    Attributes
    ----------
    forward : twists per actuator rate, (n, 6, n_a), or (n, 3, n_a) for a joint end effector.
    is_valid : False for INVALID rows, (n,).
    is_regular : True where the machine has the motions that it has in general, controlled by its actuators, (n,).
    reasons : why the Jacobian does not tell how the end effector moves; empty where it does, (n,).
    """

    forward: Floats
    is_valid: Mask
    is_regular: Mask
    reasons: Reasons


def maps_of(solution: Solution) -> Maps:
    """The forward Jacobians of a solution's rows.

    By the legs' slopes, which are enough away from singularities, else by all joints, which are slower but tell these.
    """
    mechanism, is_valid = solution.mechanism, np.asarray(solution._rows.status != Status.INVALID)
    rows = Solution(mechanism, solution._configurations, is_valid.shape)
    forward = regular_forward_map(model_of(mechanism), rows._configurations)
    if forward is None:
        is_asked, forward = is_valid, np.array(forward_jacobian(rows))
    else:
        is_asked = is_valid & np.isnan(forward[:, 0, 0])
    asked = np.flatnonzero(is_asked)
    is_regular, reasons = is_valid & ~is_asked, no_reasons(len(is_valid))
    add_reason(reasons, ~is_valid, NO_CONFIGURATION)
    if len(asked):
        found = singularity(rows[asked])
        forward[asked] = forward_jacobian(rows[asked])
        least = np.stack([found.constraint, found.parallel, found.serial, found.passive]) < TOLERANCES.singular
        add_reason(reasons, asked[least[0]], GAINS_MOTION)
        add_reason(reasons, asked[least[1]], gives_way_in_words(mechanism))
        is_regular[asked] = ~least.any(axis=0)
    return Maps(forward, is_valid, is_regular, reasons)


def twist_units(mechanism: Mechanism) -> Floats:
    """The units of a twist [velocity of the reference point; angular velocity]: L and 1, (6,) or (3,)."""
    length = mechanism.characteristic_length
    return np.array([length] * 3 if mechanism.end_effector_is_joint else [length] * 3 + [1.0] * 3)


def gives_way_in_words(mechanism: Mechanism) -> str:
    """Why actuators do not hold the end effector, in general or at a configuration."""
    uncontrolled = generic_of(mechanism).mobility.uncontrolled
    return LEFT_OPEN.format(counted(uncontrolled, "freedom")) if uncontrolled else GIVES_WAY


def is_redundantly_actuated(mechanism: Mechanism) -> bool:
    """True if actuators can work against each other: there are more than motions that they control."""
    counts = generic_of(mechanism).mobility
    return counts.actuators > counts.platform + counts.internal - counts.uncontrolled


@dataclass(frozen=True, eq=False)
class Factors:
    """Speeds in k directions that are square to each other, the fastest first, per speed of the actuators.

    Attributes
    ----------
    velocity : array (..., k)
        Factors: the speed when the actuators' rates have a sum of squares of 1. 0 where what moves is at rest in that
        direction, to a relative 1e-9.
    directions : array (..., 3, k)
        Unit vectors of these, in the base frame, whose largest component is positive; of a joint's coordinates,
        (..., coordinates, k).
    actuators : array (..., n_a, k)
        The actuators' rates that make them.
    """

    velocity: Floats
    directions: Floats
    actuators: Floats

    @property
    def force(self) -> Floats:
        """The force in each direction that actuator forces with a sum of squares of 1 hold, (..., k): 1 / velocity."""
        return np.divide(1.0, self.velocity, out=np.full_like(self.velocity, np.inf), where=self.velocity != 0.0)


@dataclass(frozen=True, eq=False)
class Transmission(Printed):
    """Factors of translation and rotation, as `transmission` returns them.

    Attributes
    ----------
    rates : array (..., r, n_a)
        Velocities per actuator rate: of the end effector [length/s, then rad/s], as in `forward_jacobian`; of a joint,
        of its coordinates.
    translation, rotation : Factors
        The factors of each apart. Whatever the other does: a translation is that of the reference point, which may turn
        as well. Their forces are those without a moment, or moments without a force.
    reason : str or array of str (...)
        Why nothing is known, with NaN in the numbers; empty elsewhere. A text for a single answer.
    """

    rates: Floats
    translation: Factors
    rotation: Factors
    reason: str | Reasons
    _units: tuple[str, str] = field(repr=False)

    def table(self) -> ResultTable:
        """The factors of each direction, by its vector; of a batch their ranges, from the fastest direction on."""
        parts = ("along", "translation", self.translation), ("about", "rotation", self.rotation)
        is_vector = all(factors.directions.shape[:-1] in ((3,), (0,)) for *_, factors in parts)
        rows = []
        for (kind, noun, factors), unit in zip(parts, self._units, strict=True):
            for place in range(factors.velocity.shape[-1]):
                vector = [plain(part, TOLERANCES.rank) for part in np.ravel(factors.directions[..., place])]
                name = (kind, *vector) if is_vector else (f"{noun} {place + 1}",)
                speed, force = (np.ravel(each[..., place]) for each in (factors.velocity, factors.force))
                rows.append((*name, spanned(speed), unit, spanned(force)))
        header = (*(("", "x", "y", "z") if is_vector else ("direction",)), "velocity", "per actuator", "force")
        return ResultTable("Transmission", reasons_in_words(self.reason, "no factors"), header, rows)


def transmission(solution: Solution, joint: str | None = None) -> Transmission:
    """Velocity and force factors of the end effector, or of a passive joint, at a configuration or a batch.

    The singular values s of V = F dq, with the forward Jacobian F, translation and rotation apart; forces have the
    factors 1 / s in the same directions, since t = -F' w.

    Parameters
    ----------
    solution : Solution
        One configuration or a batch.
    joint : str, optional
        A joint's name, for the rates of its coordinates; of a spherical one, the angular velocity of its second body
        relative to its first, in the base frame.

    Raises
    ------
    UnknownName
        No joint of that name.
    """
    mechanism = checked_solution(solution).mechanism
    maps = maps_of(solution)
    rates, turns = maps.forward.copy(), np.arange(maps.forward.shape[1]) >= 3
    if joint is not None:
        joint = mechanism.joint(joint).name
        turns = np.array([each.kind == "angle" for each in mechanism.coordinates])[columns(mechanism)[joint]]
        rates = _of_joint(solution, maps, joint)
    reasons = maps.reasons
    rates[has_reason(reasons)] = np.nan
    shape, most = solution.shape, _ranks(mechanism) if joint is None else (3, 3)
    units = np.where(turns, 1.0, mechanism.characteristic_length)
    rounding = TOLERANCES.rank * np.linalg.norm(rates / units[:, None], axis=(1, 2))
    return Transmission(
        rates.reshape(shape + rates.shape[1:]),
        _factors(rates[:, ~turns], most[0], shape, rounding * mechanism.characteristic_length),
        _factors(rates[:, turns], most[1], shape, rounding),
        in_shape(reasons, shape),
        _units(mechanism),
    )


def _units(mechanism: Mechanism) -> tuple[str, str]:
    """Units of translation and rotation per actuator rate: of lengths, of angles, or of whichever it is."""
    kinds = {drive.kind for drive in mechanism.drives}
    per = "rate" if len(kinds) > 1 else mechanism.length_unit if kinds == {"length"} else "rad"
    return f"{mechanism.length_unit}/{per}", f"rad/{per}"


def _of_joint(solution: Solution, maps: Maps, joint: str) -> Floats:
    """Rates of a joint's coordinates per actuator rate, (n, own, n_a)."""
    mechanism = solution.mechanism
    q, column = np.where(maps.is_valid[:, None], solution._coordinates, 0.0), columns(mechanism)[joint]
    first, units = JointRates(model_of(mechanism), q), rate_units(mechanism)
    rates = cycle_basis(mechanism).rates.T[column] @ first.by_actuators
    return np.asarray(rates * units[column][:, None] / units[first.actuated])


def _ranks(mechanism: Mechanism) -> tuple[int, int]:
    """In how many directions the end effector translates and turns, in general."""
    generic = generic_of(mechanism)
    parts = generic.directions[:3], generic.directions[3:]
    ranks = [int(np.linalg.matrix_rank(part, tol=TOLERANCES.alignment)) if part.size else 0 for part in parts]
    return min(ranks[0], generic.mobility.platform), min(ranks[1], generic.mobility.platform)


def _factors(rates: Floats, most: int, shape: tuple[int, ...], rounding: Floats) -> Factors:
    """The factors of maps (n, r, n_a), at most so many, in the shape of a batch; 0 below their rounding, (n,)."""
    rows, actuators = rates.shape[1:]
    k = min(rows, actuators, most)
    is_known = np.asarray(~np.isnan(rates).any(axis=(1, 2)))
    left, values, right = np.linalg.svd(np.where(is_known[:, None, None], rates, 0.0), full_matrices=False)
    values[values <= rounding[:, None]] = 0.0
    found = values[:, :k], left[..., :k], np.swapaxes(right[:, :k], -1, -2)
    largest = np.take_along_axis(found[1], np.abs(found[1]).argmax(axis=1, keepdims=True), 1) if rows else 1.0
    for array in found[1:]:
        array *= np.sign(largest)
    for array in found:
        array[~is_known] = np.nan
    return Factors(*(array.reshape(shape + array.shape[1:]) for array in found))
