"""Requirements of `pfabrik.design` at every pose that a machine is to reach."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...common.arguments import array
from ...common.arrays import Floats
from ...common.checks import require_finite, require_positive
from ...errors import InvalidArgument
from ..clearance.clearance import clearance as clearance_of
from ..statics.accuracy import accuracy as accuracy_of
from ..statics.accuracy import errors_of
from ..statics.loads import positive_values
from .candidate import IMPOSSIBLE, NOWHERE, REACHED, UNKNOWN, Candidate

__all__ = [
    "Requirement",
    "accuracy",
    "clearance",
    "factors",
    "force",
    "margin",
    "relation",
    "singularity",
    "speed",
    "stiffness",
    "stroke",
]

DEFAULT_SINGULARITY = 0.05
"""Least measure of a singularity that is asked for by default: L of travel moves an actuator by at most 20 L."""


@dataclass(frozen=True, eq=False)
class Requirement:
    """A requirement; its rows are positive where it is kept, and of order 1.

    Attributes
    ----------
    name : str
        The requirement in words; empty if it asks for nothing.
    function : callable
        Rows of a machine at its poses (n, k), or without poses (k,).
    kind : str
        "margin", proved by `certify` over a region; "singularity", in place of what is kept by default; or "".
    has_poses : bool
        False if it is of the dimensions alone.
    columns : callable or None
        Names of what the k columns are of; none if they have no names.
    expressions : tuple of str
        Of dimensions, which need a value.
    least : float
        The margin that is asked for.
    """

    name: str
    function: Callable[[Candidate], Floats]
    kind: str = ""
    has_poses: bool = True
    columns: Callable[[Candidate], Sequence[str]] | None = None
    expressions: tuple[str, ...] = ()
    least: float = 0.0

    def __repr__(self) -> str:
        return f"<Requirement {self.name or 'none'}>"

    def rows(self, machine: Candidate) -> Floats:
        """Rows at poses (n, k), or without poses (k,): finite, and negative where there is no machine."""
        found = np.asarray(self.function(machine), float)
        if found.ndim == 1 and self.has_poses:
            found = found[:, None]
        if not (machine.is_machine or self.expressions):
            return np.full_like(found, NOWHERE)
        unknown = UNKNOWN if machine.is_machine else NOWHERE
        return np.asarray(np.nan_to_num(found, nan=unknown, posinf=REACHED, neginf=IMPOSSIBLE))

    def labels(self, machine: Candidate) -> Sequence[str]:
        """Names of the columns."""
        return self.columns(machine) if self.columns is not None else [""] * self.rows(machine).shape[-1]


def _limits(machine: Candidate) -> list[str]:
    return [" ".join(limit) for limit in machine.dimensions.limits]


HOME = Requirement("home within limits", lambda m: m.home_margins, "margin", has_poses=False, columns=_limits)
"""Home within all limits: a machine is built there."""


def margin(least: float) -> Requirement:
    """A least margin of all limits, as `feasibility` measures it: a share of half the range of each.

    Parameters
    ----------
    least : float
        From 0 to less than 1, which only the middle of a range has.
    """
    value = _not_negative("least", least)
    if value >= 1.0:
        raise InvalidArgument("least", f"{value:g}", "less than 1, which only the middle of a range has")
    return Requirement(f"margin >= {value:g}", lambda m: m.margins - value, "margin", columns=_limits, least=value)


def stroke(ratio: float) -> Requirement:
    """A largest ratio of the longest to the shortest that actuators which slide can be, by their ranges.

    Parameters
    ----------
    ratio : float
        More than 1: a cylinder that is 0.55 as long when retracted has 1 / 0.55.
    """
    if not require_finite("ratio", ratio) > 1.0:
        raise InvalidArgument("ratio", f"{ratio:g}", "more than 1: longest by shortest")

    def rows(machine: Candidate) -> Floats:
        low, high = machine.sliding_ranges.T
        return np.asarray(ratio * low / np.where(high == 0.0, 1.0, np.abs(high)) - 1.0)

    return Requirement(
        f"stroke ratio <= {ratio:g}", rows, has_poses=False, columns=lambda m: m.dimensions.sliding_names
    )


def singularity(least: float | None = DEFAULT_SINGULARITY) -> Requirement:
    """A least distance from singularities, serial and parallel ones, as `pfabrik.singularity` measures it.

    Where actuators follow the task's coordinates one by one, only these count, not constraints that are lost.

    Parameters
    ----------
    least : float or None, optional
        0 at a singularity; 0 or None asks for nothing. Without this requirement 0.05 is asked for.
    """
    value = _not_negative("least", 0.0 if least is None else least)
    words = f"singularity >= {value:g}" if value else ""
    return Requirement(words, lambda m: m.distances / (value or 1.0) - 1.0, "singularity")


def factors(least: float, most: float) -> Requirement:
    """Velocity factors between two bounds: speeds of the end effector per speed of the actuators.

    Parameters
    ----------
    least, most : float
        Of the singular values of the Jacobian of what the task sets; lengths beside angles are in units of L.
    """
    low, high = require_positive("least", least), require_positive("most", most)
    if low > high:
        raise InvalidArgument("most", f"{most:g}", f"not less than least, {least:g}")
    words = f"factors {low:g} to {high:g}"
    return Requirement(words, lambda m: np.concatenate([1.0 - low * m.factors, high * m.factors - 1.0], axis=1))


def clearance(distance: float) -> Requirement:
    """A least distance of links that may not touch, of a machine whose legs or bodies have shapes.

    Parameters
    ----------
    distance : float
        Between their surfaces [length].
    """
    least = _not_negative("distance", distance)
    words = f"clearance >= {least:g}"
    return Requirement(words, lambda m: (m.measured(lambda s: clearance_of(s).distance) - least) / m.length)


def force(wrenches: ArrayLike, most: float) -> Requirement:
    """Largest force or torque of an actuator that holds any of some wrenches.

    Parameters
    ----------
    wrenches : array (..., 6) or (..., 3)
        On the end effector at the reference point, in the base frame: forces, moments [force times length].
    most : float
        As in `pfabrik.forces`.
    """
    given = _rows_of("wrenches", wrenches)
    limit = require_positive("most", most)

    def rows(machine: Candidate) -> Floats:
        return np.asarray(1.0 - np.abs(machine.forces(given)).max(axis=2) / limit)

    return Requirement(f"actuator force <= {limit:g}", rows)


def stiffness(least: float, k: float | Mapping[str, float], axes: str = "xyz") -> Requirement:
    """A least stiffness along axes.

    Parameters
    ----------
    least : float
        Force that moves the end effector by one unit of length.
    k : float or mapping of str to float
        Stiffness of the actuators, as in `pfabrik.stiffness`.
    axes : str, optional
        Some of "x", "y", "z".
    """
    wanted = require_positive("least", least)
    if not isinstance(axes, str) or not axes or not set(axes) <= set("xyz"):
        raise InvalidArgument("axes", repr(axes), "some of x, y, z")
    places = ["xyz".index(axis) for axis in axes]

    def rows(machine: Candidate) -> Floats:
        values = positive_values("k", k, machine.dimensions.mechanism.actuator_names)
        gives = np.diagonal(machine.compliance(values), axis1=-2, axis2=-1)[:, places]
        return np.asarray(1.0 - wanted * gives)

    return Requirement(f"stiffness along {axes} >= {wanted:g}", rows)


def accuracy(errors: float | Mapping[str, float], most: float) -> Requirement:
    """A largest error of the position.

    Parameters
    ----------
    errors : float or mapping of str to float
        Errors of actuators, play of joints, as in `pfabrik.accuracy`.
    most : float
        How far off the reference point may be [length].
    """
    limit = require_positive("most", most)

    def rows(machine: Candidate) -> Floats:
        of_actuators, of_joints = errors_of(machine.dimensions.mechanism, errors)
        if of_joints:
            return np.asarray(1.0 - machine.measured(lambda s: accuracy_of(s, errors).position) / limit)
        return np.asarray(1.0 - machine.position_errors(of_actuators) / limit)

    return Requirement(f"error <= {limit:g}", rows)


def speed(twists: ArrayLike, most: float) -> Requirement:
    """A largest speed of an actuator at any of some twists.

    Parameters
    ----------
    twists : array (..., 6) or (..., 3)
        Velocity of the reference point, angular velocity, in the base frame [length/s, rad/s].
    most : float
        Of every actuator [length/s or rad/s].
    """
    given = _rows_of("twists", twists)
    limit = require_positive("most", most)

    def rows(machine: Candidate) -> Floats:
        return np.asarray(1.0 - np.abs(machine.rates[:, :, : given.shape[1]] @ given.T).max(axis=1) / limit)

    return Requirement(f"actuator speed <= {limit:g}", rows)


def relation(text: str) -> Requirement:
    """An inequality of dimensions.

    Parameters
    ----------
    text : str
        Two expressions with <= or >= between them: "rod >= 1.2*arm".
    """
    parts = re.split(r"(<=|>=)", text)
    if len(parts) != 3:
        raise InvalidArgument("keep", repr(text), "two expressions of dimensions with <= or >= between them")
    left, sign, right = (part.strip() for part in parts)
    more, less = (left, right) if sign == ">=" else (right, left)

    def rows(machine: Candidate) -> Floats:
        value, other = machine.value_of(more), machine.value_of(less)
        return np.array([(value - other) / max(abs(value), abs(other), np.finfo(float).tiny)])

    return Requirement(text, rows, has_poses=False, expressions=(more, less))


def requirements_of(given: Any) -> list[Requirement]:
    """Requirements, some of which may be given as texts."""
    one_or_more = [given] if isinstance(given, str | Requirement) or not isinstance(given, Iterable) else given
    found = []
    for each in one_or_more:
        if not isinstance(each, str | Requirement):
            words = "requirements of pfabrik.keep, or texts such as 'rod >= 1.2*arm'"
            raise InvalidArgument("keep", repr(each), words)
        found.append(relation(each) if isinstance(each, str) else each)
    return found


def _rows_of(name: str, given: ArrayLike) -> Floats:
    """Wrenches or twists, (n, 6) or (n, 3)."""
    found = array(name, given, "... 6 | ... 3")
    if not found.size:
        raise InvalidArgument(name, "none", "one or more")
    return np.asarray(found.reshape(-1, found.shape[-1]))


def _not_negative(name: str, value: float) -> float:
    if not require_finite(name, value) >= 0.0:
        raise InvalidArgument(name, f"{value:g}", "0 or more")
    return float(value)
