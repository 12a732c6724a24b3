"""Pose errors by actuator errors and play in joints, to first order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import Literal, Protocol

import numpy as np

from ...answers.solution import Solution, checked_solution
from ...common.arrays import Floats, Mask, shaped
from ...common.checks import require_choice, require_positive
from ...common.printed import Printed, ResultTable, spanned
from ...errors import InvalidArgument, UnknownName
from ...machine.description.mechanism import Mechanism
from ...tolerances import TOLERANCES
from .joint_balance import responses_of
from .loads import Reasons, add_reason, has_reason, in_shape, reasons_in_words
from .transmission import Maps, maps_of

ROWS_A_BLOCK = 256
MOST_PATTERNS = 2**14
"""Most sign patterns of actuator errors that are compared; with more actuators, searches start from some of them."""

ASCENTS = 40
"""Steps of a search for the worst direction: each goes to the direction of the worst error in the one before, and is at
its end after a few."""

LOOSE = "a constraint singularity: what joints with play move is not determined"


@dataclass(frozen=True, eq=False)
class PoseAccuracy(Printed):
    """Pose errors, as `accuracy` returns them; r is 6, or 3 for a joint end effector.

    Attributes
    ----------
    kind : {"worst", "rms"}
        "worst": no error within the bounds is larger; "rms": root mean squares.
    position, rotation : float or array (...)
        Size of the error of the reference point's position [length] and of the rotation [rad]. Of a joint end effector
        the rotation is 0.
    components : array (..., r)
        Errors of position [length] and rotation vector [rad] one by one, in the base frame.
    covariance : array (..., r, r) or None
        Covariance of the components for "rms"; None for "worst".
    actuators : array (..., 2, n_a) or None
        For "worst", the actuators' errors that make the largest position error, and those that make the largest
        rotation error: put them on the actuators, and `solve_fk` shows it. None for "rms".
    reason : str or array of str (...)
        Why nothing is known, with NaN in the numbers; empty elsewhere. A text for a single answer.
    """

    kind: Literal["worst", "rms"]
    position: float | Floats
    rotation: float | Floats
    components: Floats
    covariance: Floats | None
    actuators: Floats | None
    reason: str | Reasons
    _length_unit: str = field(repr=False)

    def table(self) -> ResultTable:
        """The errors of position and rotation; of a batch, their range."""
        rotation = np.degrees(np.ravel(self.rotation))
        rows = [
            ("position", spanned(np.ravel(self.position)), self._length_unit),
            ("rotation", spanned(np.where(rotation <= TOLERANCES.implied, 0.0, rotation)), "deg"),
        ]
        return ResultTable(
            "Accuracy", reasons_in_words(self.reason, "nothing known"), (f"{self.kind} error", "", "unit"), rows
        )


class Slopes(Protocol):
    """Derivatives of poses by parameters of their machine, as `pf.sensitivity` gives them."""

    @property
    def pose(self) -> Floats: ...

    @property
    def names(self) -> tuple[str, ...]: ...


def accuracy(
    solution: Solution,
    errors: float | Mapping[str, float],
    kind: Literal["worst", "rms"] = "worst",
    *,
    sensitivity: Slopes | None = None,
) -> PoseAccuracy:
    """The error of the pose by errors of actuators, play in joints and tolerances of parts, at any configurations.

    To first order, x = F e + sum R d + P p: with the forward Jacobian F, errors e of the actuators, responses R to play
    d of joints, and the sensitivity P to parameters p. "worst" is the largest |x| for all |e_i|, |d_j| and |p_k| within
    bounds, found at their corners; "rms" takes them for independent, with a mean of 0.

    Parameters
    ----------
    solution : Solution
        One configuration or a batch.
    errors : float or mapping of str to float
        Actuator -> how far its coordinate may be off [length or rad], half its resolution and half its backlash
        together; a number alone for all actuators. Other joint -> how far its centre may be off, in any direction
        [length]: half the clearance of its diameter. Parameter of `sensitivity` -> its tolerance, in its unit. What is
        not named is exact.
    kind : {"worst", "rms"}, optional
        "worst", and errors are bounds; "rms", and they are standard deviations, of a joint in each direction.
    sensitivity : Sensitivity, optional
        The derivatives of this solution, as `pf.sensitivity(solution, parameters)` gives them, if errors name
        parameters.

    Raises
    ------
    InvalidArgument or UnknownName
        Errors that are not positive, or of a joint without a centre; names not known.
    UnsupportedMechanism
        Play in joints of a machine with redundant actuators.
    """
    mechanism = checked_solution(solution).mechanism
    require_choice("kind", kind, ("worst", "rms"))
    tolerances, errors = _tolerances(solution, errors, sensitivity)
    of_actuators, of_joints = errors_of(mechanism, errors)
    maps = maps_of(solution)
    reasons = maps.reasons
    by_actuator = np.concatenate([maps.forward * of_actuators, tolerances], axis=-1)
    by_joint = np.zeros((len(by_actuator), 0, by_actuator.shape[1], 3))
    if of_joints:
        by_joint, is_loose = _by_joint(solution, maps, of_joints)
        add_reason(reasons, is_loose, LOOSE)
    is_unknown, shape = has_reason(reasons), solution.shape
    by_actuator[is_unknown], by_joint[is_unknown] = 0.0, 0.0
    if kind == "rms":
        products = by_actuator @ np.swapaxes(by_actuator, -1, -2) + np.einsum("njra,njsa->nrs", by_joint, by_joint)
        squares = np.einsum("nrr->nr", products)
        found = [np.sqrt(squares[:, part].sum(axis=1)) for part in (slice(0, 3), slice(3, 6))]
        found += [np.sqrt(squares), products]
    else:
        components = np.abs(by_actuator).sum(axis=-1) + np.linalg.norm(by_joint, axis=-1).sum(axis=1)
        parts = [largest(by_actuator[:, part], by_joint[:, :, part]) for part in (slice(0, 3), slice(3, 6))]
        found = [
            *(sizes for sizes, _ in parts),
            components,
            np.stack([signs[:, : len(of_actuators)] for _, signs in parts], axis=1) * of_actuators,
        ]
    for array in found:
        array[is_unknown] = np.nan
    position, rotation, components, more = (shaped(array, shape) for array in found)
    covariance, actuators = (more, None) if kind == "rms" else (None, more)
    reason, unit = in_shape(reasons, shape), mechanism.length_unit
    return PoseAccuracy(kind, position, rotation, components, covariance, actuators, reason, unit)


def _tolerances(
    solution: Solution, errors: float | Mapping[str, float], slopes: Slopes | None
) -> tuple[Floats, float | Mapping[str, float]]:
    """Errors of poses by parameters, (n, r, p), and the errors that are no parameters'."""
    n, r = len(solution._rows.status), 3 if solution.mechanism.end_effector_is_joint else 6
    if slopes is None or not isinstance(errors, Mapping):
        return np.zeros((n, r, 0)), errors
    by_parameter = np.reshape(slopes.pose, (-1, *np.shape(slopes.pose)[-2:]))
    if by_parameter.shape[:2] != (n, r):
        raise InvalidArgument("sensitivity", f"shape {np.shape(slopes.pose)}", "that of this solution")
    named = [name for name in errors if name in slopes.names and name not in solution.mechanism.actuator_names]
    bounds = np.array([require_positive(f"errors['{name}']", errors[name]) for name in named])
    columns = by_parameter[:, :, [slopes.names.index(name) for name in named]]
    return columns * bounds, {name: error for name, error in errors.items() if name not in named}


def errors_of(mechanism: Mechanism, given: float | Mapping[str, float]) -> tuple[Floats, dict[int, float]]:
    """Errors of actuators (n_a,), and of other joints by their index."""
    names = mechanism.actuator_names
    if not isinstance(given, Mapping):
        return np.full(len(names), require_positive("errors", given)), {}
    of_actuators, of_joints = np.zeros(len(names)), {}
    joints = {joint.name: place for place, joint in enumerate(mechanism.joints)}
    for name, error in given.items():
        if name not in names and name not in joints:
            raise UnknownName("actuator or joint", name, dict.fromkeys((*names, *joints)))
        value = require_positive(f"errors['{name}']", error)
        if name in names:
            of_actuators[names.index(name)] = value
        elif mechanism.joints[joints[name]].at is None:
            raise InvalidArgument(f"errors['{name}']", "play of a slide", "an actuator, or a joint with a centre")
        else:
            of_joints[joints[name]] = value
    return of_actuators, of_joints


def _by_joint(solution: Solution, maps: Maps, errors: Mapping[int, float]) -> tuple[Floats, Mask]:
    """Twists by play of joints, (n, j, r, 3), and a mask of rows at which these are not known, (n,).

    Where joints work against each other, play that would open loops is none.
    """
    found, joints = responses_of(solution, maps, "given the play of its joints"), list(errors)
    opened = found.open[:, joints]
    left, sizes, _ = np.linalg.svd(np.concatenate([opened, np.zeros((*opened.shape[:3], 3))], axis=-1))
    plays = left * (sizes <= TOLERANCES.alignment)[..., None, :]
    bounds = np.array(list(errors.values()))[:, None, None]
    twists = np.zeros((len(maps.forward), len(joints), maps.forward.shape[1], 3))
    twists[found.places] = found.twists[:, joints] @ plays @ np.swapaxes(plays, -1, -2) * bounds
    is_loose = np.zeros(len(twists), bool)
    is_loose[found.places] = found.is_singular
    return twists, is_loose


def largest(by_actuator: Floats, by_joint: Floats) -> tuple[Floats, Floats]:
    """The largest |A s + sum B_j d_j| with s of signs and |d_j| <= 1, (n,), and these signs, (n, n_a).

    Without play it is at a corner of the box of errors, and all are compared. With play, or where these are too many,
    the worst direction u is searched for: A sign(A'u) + sum B_j B_j'u / |B_j'u| is the farthest along u, and itself
    a better direction.
    """
    n, rows, actuators = by_actuator.shape
    sizes, signs = np.zeros(n), np.ones((n, actuators))
    if not rows:
        return sizes, signs
    patterns = _patterns(actuators)
    is_whole = 2 ** (actuators - 1) == len(patterns) and not by_joint.shape[1]
    for start in range(0, n, ROWS_A_BLOCK):
        block = slice(start, start + ROWS_A_BLOCK)
        a, b = by_actuator[block], by_joint[block]
        ends = np.einsum("nra,pa->npr", a, patterns)
        if not is_whole:
            ends = _ascended(a, b, np.concatenate([ends, np.tile(_directions(rows), (len(a), 1, 1))], axis=1))
        lengths = np.linalg.norm(ends, axis=-1)
        best = np.argmax(lengths, axis=1)[:, None]
        sizes[block] = np.take_along_axis(lengths, best, axis=1)[:, 0]
        toward = np.take_along_axis(ends, best[..., None], axis=1)[:, 0]
        signs[block] = patterns[best[:, 0]] if is_whole else _signs(np.einsum("nra,nr->na", a, toward))
    return sizes, signs


def _ascended(a: Floats, b: Floats, ends: Floats) -> Floats:
    """The farthest errors in the directions of others, again and again, (n, p, r)."""
    for _ in range(ASCENTS):
        along = np.einsum("nra,npr->npa", a, ends)
        plays = np.einsum("njrd,npr->npjd", b, ends)
        size = np.linalg.norm(plays, axis=-1, keepdims=True)
        plays = np.divide(plays, size, out=np.zeros_like(plays), where=size > 0.0)
        ends = np.einsum("nra,npa->npr", a, _signs(along)) + np.einsum("njrd,npjd->npr", b, plays)
    return np.asarray(ends)


def _signs(values: Floats) -> Floats:
    return np.where(values < 0.0, -1.0, 1.0)


def _patterns(actuators: int) -> Floats:
    """Signs of actuator errors, (p, n_a), the first always 1: all, or, of many, some drawn by chance."""
    if 2 ** (actuators - 1) <= MOST_PATTERNS:
        return np.array([(1.0, *rest) for rest in product((1.0, -1.0), repeat=actuators - 1)])
    return np.random.default_rng(0).choice([1.0, -1.0], (64, actuators))


def _directions(rows: int) -> Floats:
    """Directions towards the corners, edges and faces of a cube, (26, rows)."""
    return np.array([way for way in product((-1.0, 0.0, 1.0), repeat=rows) if any(way)])
