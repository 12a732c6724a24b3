"""What a machine must keep, at every pose that it is to reach: requirements of `pfabrik.design`."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import array
from ..arrays import Floats
from ..checks import require_finite, require_positive
from ..clearance.clearance import clearance as clearance_of
from ..errors import InvalidArgument
from ..statics.accuracy import accuracy as accuracy_of
from ..statics.forces import forces as forces_of
from ..statics.stiffness import stiffness as stiffness_of
from .candidate import IMPOSSIBLE, Candidate

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


class Requirement(ABC):
    """A requirement; its rows are positive where it is kept, and of order 1.

    Attributes
    ----------
    is_proved : True if `certify` proves it over a region.
    """

    is_proved = False

    @property
    @abstractmethod
    def name(self) -> str:
        """The requirement in words."""

    @abstractmethod
    def rows(self, machine: Candidate) -> Floats:
        """Rows at poses (n, k), or without poses (k,)."""

    def labels(self, machine: Candidate) -> list[str]:
        """What the k columns are of."""
        return [""] * self.rows(machine).shape[-1]

    @property
    def has_poses(self) -> bool:
        """False if it is of the dimensions alone."""
        return True


@dataclass(frozen=True)
class Margin(Requirement):
    """Margins of all limits."""

    least: float
    is_proved = True

    @property
    def name(self) -> str:
        return f"margin >= {self.least:g}"

    def rows(self, machine: Candidate) -> Floats:
        return np.asarray(machine.margins - self.least)

    def labels(self, machine: Candidate) -> list[str]:
        return [" ".join(limit) for limit in machine.dimensions.limits]


@dataclass(frozen=True)
class Home(Requirement):
    """Home within all limits: a machine is built there."""

    @property
    def name(self) -> str:
        return "home within limits"

    def rows(self, machine: Candidate) -> Floats:
        return machine.home_margins[0]

    def labels(self, machine: Candidate) -> list[str]:
        return [" ".join(limit) for limit in machine.dimensions.limits]

    @property
    def has_poses(self) -> bool:
        return False


@dataclass(frozen=True)
class Stroke(Requirement):
    """Lowest and highest values of actuators that slide."""

    ratio: float

    @property
    def name(self) -> str:
        return f"stroke ratio <= {self.ratio:g}"

    def _ends(self, machine: Candidate) -> Iterator[tuple[str, Floats]]:
        mechanism = machine.dimensions.mechanism
        for name, drive, ends in zip(mechanism.actuator_names, mechanism.drives, machine.ranges, strict=True):
            if drive.kind == "length" and (np.isfinite(ends).all() or not machine.is_machine):
                yield name, ends

    def rows(self, machine: Candidate) -> Floats:
        return np.array([self.ratio * low / abs(high or 1.0) - 1.0 for _, (low, high) in self._ends(machine)])

    def labels(self, machine: Candidate) -> list[str]:
        return [name for name, _ in self._ends(machine)]

    @property
    def has_poses(self) -> bool:
        return False


@dataclass(frozen=True)
class Relation(Requirement):
    """An inequality of dimensions."""

    text: str
    left: str
    right: str

    @property
    def name(self) -> str:
        return self.text

    def rows(self, machine: Candidate) -> Floats:
        values = machine.dimensions.named(machine.values)
        left, right = (machine.dimensions.source.value_of(side, values) for side in (self.left, self.right))
        return np.array([(left - right) / max(abs(left), abs(right), np.finfo(float).tiny)])

    @property
    def has_poses(self) -> bool:
        return False


@dataclass(frozen=True)
class OfPoses(Requirement):
    """A requirement whose rows a function gives."""

    words: str
    function: Callable[[Candidate], Floats]

    @property
    def name(self) -> str:
        return self.words

    def rows(self, machine: Candidate) -> Floats:
        n = len(machine.poses)
        if not machine.is_machine:
            return np.full((n, 1), IMPOSSIBLE)
        found = np.asarray(self.function(machine), float).reshape(n, -1)
        return np.asarray(np.nan_to_num(found, nan=IMPOSSIBLE, posinf=1.0, neginf=IMPOSSIBLE))


def margin(least: float) -> Requirement:
    """A least margin of all limits, as `feasibility` measures it: a share of half the range of each.

    Parameters
    ----------
    least : float
        0 or more.
    """
    return Margin(_not_negative("least", least))


def stroke(ratio: float) -> Requirement:
    """A largest ratio of the longest to the shortest that actuators which slide can be, by their ranges.

    Parameters
    ----------
    ratio : float
        More than 1: a cylinder that is 0.55 as long when retracted has 1 / 0.55.
    """
    if not require_finite("ratio", ratio) > 1.0:
        raise InvalidArgument("ratio", f"{ratio:g}", "more than 1: longest by shortest")
    return Stroke(ratio)


def singularity(least: float | None = DEFAULT_SINGULARITY) -> Requirement:
    """A least distance from singularities, serial and parallel ones, as `pfabrik.singularity` measures it.

    Parameters
    ----------
    least : float or None
        0 at a singularity; 0 or None asks for nothing. Without this requirement 0.05 is asked for.
    """
    value = _not_negative("least", least or 0.0)
    return OfPoses(f"singularity >= {value:g}" if value else "", lambda m: m.distances / (value or 1.0) - bool(value))


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
    return OfPoses(words, lambda m: np.concatenate([1.0 - low * m.factors, high * m.factors - 1.0], axis=1))


def clearance(distance: float) -> Requirement:
    """A least distance of links that may not touch [length], of a machine whose legs or bodies have shapes."""
    least = _not_negative("distance", distance)
    words = f"clearance >= {least:g}"
    return OfPoses(words, lambda m: (np.asarray(clearance_of(m.solution).distance) - least) / m.length)


def force(wrenches: ArrayLike, most: float) -> Requirement:
    """Largest force or torque of an actuator that holds any of some wrenches.

    Parameters
    ----------
    wrenches : array (..., 6) or (..., 3)
        On the end effector at the reference point, in the base frame: forces, moments [force times length].
    most : float
        As in `pfabrik.forces`.
    """
    given = np.atleast_2d(np.asarray(wrenches, float))
    limit = require_positive("most", most)

    def rows(machine: Candidate) -> Floats:
        held = [np.abs(forces_of(machine.solution, wrench).actuators).max(axis=1) for wrench in given]
        return 1.0 - np.stack(held, axis=1) / limit

    return OfPoses(f"actuator force <= {limit:g}", rows)


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
    wanted, places = require_positive("least", least), ["xyz".index(axis) for axis in axes]
    if not places or not set(axes) <= set("xyz"):
        raise InvalidArgument("axes", repr(axes), "some of x, y, z")

    def rows(machine: Candidate) -> Floats:
        gives = np.diagonal(stiffness_of(machine.solution, k).compliance, axis1=-2, axis2=-1)[:, places]
        return np.asarray(1.0 - wanted * gives)

    return OfPoses(f"stiffness along {axes} >= {wanted:g}", rows)


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
    return OfPoses(f"error <= {limit:g}", lambda m: 1.0 - np.asarray(accuracy_of(m.solution, errors).position) / limit)


def speed(twists: ArrayLike, most: float) -> Requirement:
    """A largest speed of an actuator at any of some twists.

    Parameters
    ----------
    twists : array (..., 6) or (..., 3)
        Velocity of the reference point, angular velocity, in the base frame [length/s, rad/s].
    most : float
        Of every actuator [length/s or rad/s].
    """
    given = np.atleast_2d(array("twists", twists, "... 6 | ... 3"))
    limit = require_positive("most", most)
    given = np.pad(given.reshape(-1, given.shape[-1]), ((0, 0), (0, 6 - given.shape[-1])))

    def rows(machine: Candidate) -> Floats:
        return np.asarray(1.0 - np.abs(machine.rates @ given.T).max(axis=1) / limit)

    return OfPoses(f"actuator speed <= {limit:g}", rows)


def relation(text: str) -> Requirement:
    """An inequality of dimensions, such as "rod >= 1.2*arm"."""
    parts = re.split(r"(<=|>=)", text)
    if len(parts) != 3:
        raise InvalidArgument("keep", repr(text), "two expressions of dimensions with <= or >= between them")
    left, sign, right = (part.strip() for part in parts)
    return Relation(text, *((left, right) if sign == ">=" else (right, left)))


def requirement_of(given: Any) -> Requirement:
    """A requirement that may be given as a text."""
    if isinstance(given, str):
        return relation(given)
    if not isinstance(given, Requirement):
        raise InvalidArgument("keep", repr(given), "requirements of pfabrik.keep, or texts such as 'rod >= 1.2*arm'")
    return given


def _not_negative(name: str, value: float) -> float:
    if not require_finite(name, value) >= 0.0:
        raise InvalidArgument(name, f"{value:g}", "0 or more")
    return float(value)
