"""What acts on a machine from outside, values for its actuators, and why a row has no numbers."""

from __future__ import annotations

import reprlib
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...answers.solution import Solution
from ...common.arguments import array, as_floats, is_positive
from ...common.arrays import Floats, Ints, Mask
from ...common.checks import require_each, require_known, require_mapping, require_positive
from ...errors import InvalidArgument, counted
from ...kinematics import displacements, tree_of
from ...machine.description.mechanism import Mechanism

Bounds: TypeAlias = float | tuple[float, float] | ArrayLike | Mapping[str, float | tuple[float, float]]
"""Limits of actuators: a number for both ways, a pair (lowest, highest), or an array (n_a, 2), or either by name."""

BOUND = "a positive number, or (lowest, highest)"


def bounds_of(argument: str, given: Bounds, names: Sequence[str]) -> Floats:
    """The lowest and the highest value of each actuator, (n_a, 2); infinite where there is none."""
    if isinstance(given, Mapping):
        require_each(argument, given, names)
        return np.array([_pair(f"{argument}['{name}']", given[name]) for name in names])
    values = as_floats(argument, given, f"{BOUND}, for all {len(names)} actuators or each")
    if values.shape == (len(names), 2):
        return np.array([_pair(f"{argument}[{place}]", row) for place, row in enumerate(values)])
    return np.tile(_pair(argument, values), (len(names), 1))


def _pair(argument: str, given: Any) -> tuple[float, float]:
    value = as_floats(argument, given, BOUND)
    if value.shape == () and value > 0.0:
        return -float(value), float(value)
    if value.shape == (2,) and value[0] <= value[1]:
        return float(value[0]), float(value[1])
    raise InvalidArgument(argument, reprlib.repr(value.tolist()), BOUND)


def positive_values(argument: str, given: ArrayLike | Mapping[str, float], names: Sequence[str]) -> Floats:
    """A positive number for each actuator, (n_a,), of one for all, an array (n_a,), or a mapping by name."""
    if isinstance(given, Mapping):
        require_each(argument, given, names)
        return np.array([require_positive(f"{argument}['{name}']", given[name]) for name in names])
    note = ", for all actuators or each, or a mapping by name"
    values = array(argument, given, f"() | {len(names)}", "positive numbers", note, is_positive)
    return np.broadcast_to(values, len(names)).copy()


Reasons: TypeAlias = NDArray[np.object_]


def no_reasons(rows: int) -> Reasons:
    """Empty reasons, (n,)."""
    return np.full(rows, "", dtype=object)


def add_reason(reasons: Reasons, rows: Any, reason: str | Reasons) -> None:
    """Give some rows this reason, or each its own, by indices or a mask, unless they have one."""
    places = np.arange(len(reasons))[rows]
    if not len(places):
        return
    is_open = ~has_reason(reasons[places])
    reasons[places[is_open]] = reason if isinstance(reason, str) else reason[is_open]


def reasons_in_words(reason: str | Reasons, lacking: str) -> list[str]:
    """A line that says how many rows have no numbers, and why the first of them has none; none where all have."""
    reasons = np.ravel(np.asarray(reason, dtype=object)).tolist()
    given = [text for text in reasons if text]
    rows = "" if isinstance(reason, str) else f" in {len(given)} of {counted(len(reasons), 'row')}"
    return [f"{lacking}{rows}: {given[0]}"] if given else []


def has_reason(reasons: Reasons) -> Mask:
    """Mask of the rows with a reason, (n,)."""
    return np.asarray(np.not_equal(reasons, ""), bool)


def in_shape(reasons: Reasons, shape: tuple[int, ...]) -> str | Reasons:
    """Reasons (n,) in the shape of a batch: a text for a single row."""
    return str(reasons[0]) if shape == () else reasons.reshape(shape)


BodyLoads: TypeAlias = Mapping[str, tuple[ArrayLike, ArrayLike]]
"""Body -> (mass, centre), (force, point) or (wrench, point): points of the body, at home, in base coordinates."""

OF_LOADS = "body -> (mass, centre), (force, point) or (wrench, point)"


class Load(NamedTuple):
    """What a body carries: a mass, or a wrench that acts on it.

    Attributes
    ----------
    body : the body.
    mass : 0 of a wrench.
    wrench : force, and moment about the point, (6,); 0 of a mass.
    point : that they are at, of the body at home, in base coordinates, (3,) [length].
    """

    body: str
    mass: float
    wrench: Floats
    point: Floats


class Asked(NamedTuple):
    """Wrenches on end effectors, a row for each: the batch of the solution with that of the wrenches.

    Attributes
    ----------
    shape : of the batch.
    places : row of the solution for each, (n,).
    wrenches : force and moment about the reference point, (n, 6).
    """

    shape: tuple[int, ...]
    places: Ints
    wrenches: Floats


def asked_of(solution: Solution, wrench: ArrayLike | None, at: ArrayLike | None) -> Asked:
    """Wrenches on the end effector of a solution, row by row; none is a wrench of zero.

    Parameters
    ----------
    at : the point that the wrench is about, (..., 3) [length], in the base frame; None for the reference point.
    """
    mechanism = solution.mechanism
    forces = _wrench("wrench", np.zeros(3) if wrench is None else wrench, mechanism.end_effector_is_joint)
    points = None
    if at is not None:
        points = array("at", at, "... 3", note=", a point")
        if mechanism.end_effector_is_joint:
            raise InvalidArgument("at", "a point", f"None: forces act on the centre of {mechanism.end_effector}")
    shapes = [solution.shape, forces.shape[:-1], *([] if points is None else [points.shape[:-1]])]
    try:
        shape = np.broadcast_shapes(*shapes)
    except ValueError:
        found = " and ".join(map(str, shapes[1:]))
        raise InvalidArgument(
            "wrench", f"a batch of {found}", f"one that fits that of the solution, {shapes[0]}"
        ) from None
    rows = np.arange(len(solution._rows.poses)).reshape(solution.shape)
    places = np.broadcast_to(rows, shape).ravel()
    wrenches = np.broadcast_to(forces, (*shape, 6)).reshape(-1, 6).copy()
    if points is not None:
        arms = np.broadcast_to(points, (*shape, 3)).reshape(-1, 3) - solution._rows.poses[places, :3, 3]
        wrenches[:, 3:] += np.cross(arms, wrenches[:, :3])
    return Asked(shape, places, wrenches)


class Acting(NamedTuple):
    """A load on a body at n configurations; lengths in L, and of the present reference point.

    Attributes
    ----------
    body : that it acts on.
    wrench : force times L, and moment about the reference point, (n, 6).
    arm : from there to the point that it acts at, (n, 3).
    """

    body: str
    wrench: Floats
    arm: Floats


def acting(mechanism: Mechanism, q: Floats, wrenches: Floats, loads: Sequence[Load], gravity: Floats) -> list[Acting]:
    """All loads at coordinates q (n, c): on the end effector, (n, 6) about the reference point, and on bodies."""
    length, bodies = mechanism.characteristic_length, displacements(mechanism, q)
    reference = (bodies[mechanism.end_effector_body] @ mechanism.home_pose)[:, :3, 3]
    found = [Acting(mechanism.end_effector_body, _scaled(wrenches, length), np.zeros((len(q), 3)))]
    for body, mass, wrench, point in loads:
        arms, force = bodies[body][:, :3, :3] @ point + bodies[body][:, :3, 3] - reference, wrench[:3] + mass * gravity
        moments = wrench[3:] + np.cross(arms, force)
        both = np.concatenate([np.broadcast_to(force, moments.shape), moments], axis=1)
        found.append(Acting(body, _scaled(both, length), arms / length))
    return found


def carried_of(mechanism: Mechanism, q: Floats, wrenches: Floats, loads: Sequence[Load], gravity: Floats) -> Floats:
    """What each joint carries of loads, by the way of the tree to the base, (n, joints, 6).

    As `Acting.wrench`: what screws of `JointRates` do work with.

    Parameters
    ----------
    wrenches : on the end effector, about the reference point, (n, 6).
    """
    paths = tree_of(mechanism).paths
    found = acting(mechanism, q, wrenches, loads, gravity)
    return np.asarray(sum(paths[load.body][:, None] * load.wrench[:, None] for load in found))


def checked_loads(mechanism: Mechanism, loads: Any) -> list[Load]:
    """Loads of bodies; raises the errors of `forces` for invalid ones."""
    given = require_mapping("loads", loads, OF_LOADS)
    known = tuple(body for body in mechanism.bodies if body != mechanism.base)
    require_known("body that moves", given, known)
    found = []
    for body, pair in given.items():
        name = f"loads['{body}']"
        if not isinstance(pair, tuple | list) or len(pair) != 2:
            raise InvalidArgument(name, reprlib.repr(pair), OF_LOADS)
        value = array(name, pair[0], "() | 3 | 6", note=f", a mass, force or wrench, in {OF_LOADS}")
        point = array(f"{name}[1]", pair[1], "3", note=f", the point of {OF_LOADS}")
        if value.shape == () and value < 0.0:
            raise InvalidArgument(name, f"a mass of {value}", "a mass that is not negative")
        is_mass, wrench = value.shape == (), np.zeros(6)
        wrench[: value.size] = 0.0 if is_mass else value
        found.append(Load(body, float(value) if is_mass else 0.0, wrench, point))
    return found


def checked_gravity(gravity: Any) -> Floats:
    """The acceleration of free fall, (3,)."""
    return array("gravity", gravity, "3")


def _wrench(name: str, value: Any, is_at_joint: bool) -> Floats:
    """Wrenches (..., 6); a moment of zero beside forces alone."""
    if is_at_joint:
        wrench = array(name, value, "... 3", note=", a force: the end effector is a joint")
    else:
        wrench = array(name, value, "... 6 | ... 3", note=": a force and a moment, or a force")
    if wrench.shape[-1] == 6:
        return wrench
    return np.concatenate([wrench, np.zeros(wrench.shape)], axis=-1)


def _scaled(wrenches: Floats, length: float) -> Floats:
    """Wrenches (n, 6) with forces times L."""
    return np.asarray(wrenches * np.repeat([length, 1.0], 3))
