"""What acts on a machine from outside: a wrench on its end effector, weights and wrenches on its bodies."""

from __future__ import annotations

import reprlib
from collections.abc import Mapping
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ..answers.solution import Solution
from ..arrays import Floats, Ints
from ..checks import require_mapping
from ..description.graph import tree_of
from ..description.mechanism import Mechanism
from ..errors import InvalidArgument, UnknownName
from ..motion.displacements import displacements
from ..poses import as_floats

BodyLoads: TypeAlias = Mapping[str, tuple[ArrayLike, ArrayLike]]
"""Body -> (mass, centre), (force, point) or (wrench, point): points of the body, at home, in base coordinates."""

EXPECTED = "(..., 6), a force and a moment, or (..., 3), a force"
OF_LOADS = "body -> (mass, centre), (force, point) or (wrench, point)"


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
        points = _finite("at", at, "a point, (..., 3)")
        if points.shape[-1:] != (3,):
            raise InvalidArgument("at", f"shape {points.shape}", "a point, (..., 3)")
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


def carried_of(mechanism: Mechanism, q: Floats, wrenches: Floats, loads: BodyLoads, gravity: Floats) -> Floats:
    """What each joint carries of loads, by the way of the tree to the base, (n, joints, 6).

    As force times L, and moment about the present reference point: what screws of `JointRates` do work with.

    Parameters
    ----------
    wrenches : on the end effector, about the reference point, (n, 6).
    """
    tree, length = tree_of(mechanism), mechanism.characteristic_length
    bodies = displacements(mechanism, q)
    reference = (bodies[mechanism.end_effector_body] @ mechanism.home_pose)[:, :3, 3]
    carried = tree.paths[mechanism.end_effector_body][:, None] * _scaled(wrenches, length)[:, None]
    for body, (load, point) in loads.items():
        acting = _load(body, load, gravity)
        place = _finite(f"loads['{body}']", point, OF_LOADS)
        if place.shape != (3,):
            raise InvalidArgument(f"loads['{body}']", f"a point of shape {place.shape}", OF_LOADS)
        arms = bodies[body][:, :3, :3] @ place + bodies[body][:, :3, 3] - reference
        moments = acting[3:] + np.cross(arms, acting[:3])
        wrench = np.concatenate([np.broadcast_to(acting[:3], moments.shape), moments], axis=1)
        carried = carried + tree.paths[body][:, None] * _scaled(wrench, length)[:, None]
    return np.asarray(carried)


def checked_loads(mechanism: Mechanism, loads: Any) -> BodyLoads:
    """Loads by body; the errors of `forces` for what is none."""
    given = require_mapping("loads", loads, OF_LOADS)
    known = tuple(body for body in mechanism.bodies if body != mechanism.base)
    for body, load in given.items():
        if body not in known:
            raise UnknownName("body that moves", body, known)
        if not isinstance(load, tuple | list) or len(load) != 2:
            raise InvalidArgument(f"loads['{body}']", reprlib.repr(load), OF_LOADS)
    return given


def checked_gravity(gravity: Any) -> Floats:
    """The acceleration of free fall, (3,)."""
    found = _finite("gravity", gravity, "three numbers")
    if found.shape != (3,):
        raise InvalidArgument("gravity", f"shape {found.shape}", "three numbers")
    return found


def _load(body: str, load: ArrayLike, gravity: Floats) -> Floats:
    """A mass, force or wrench on a body as a wrench, (6,)."""
    found = _finite(f"loads['{body}']", load, OF_LOADS)
    if found.shape == ():
        if found < 0.0:
            raise InvalidArgument(f"loads['{body}']", f"a mass of {found}", "a mass that is not negative")
        found = found * gravity
    if found.shape not in ((3,), (6,)):
        raise InvalidArgument(f"loads['{body}']", f"shape {found.shape}", OF_LOADS)
    return np.concatenate([found, np.zeros(6 - len(found))])


def _wrench(name: str, value: Any, is_at_joint: bool) -> Floats:
    """Wrenches (..., 6); a moment of zero beside forces alone."""
    expected = "(..., 3), a force: the end effector is a joint" if is_at_joint else EXPECTED
    wrench = _finite(name, value, expected)
    if wrench.shape[-1:] not in ((3,),) if is_at_joint else wrench.shape[-1:] not in ((3,), (6,)):
        raise InvalidArgument(name, f"shape {wrench.shape}", expected)
    if wrench.shape[-1] == 6:
        return wrench
    return np.concatenate([wrench, np.zeros(wrench.shape)], axis=-1)


def _finite(name: str, value: Any, expected: str) -> Floats:
    array = as_floats(name, value, expected)
    if not np.isfinite(array).all():
        raise InvalidArgument(name, "numbers that are not finite", expected)
    return array


def _scaled(wrenches: Floats, length: float) -> Floats:
    """Wrenches (n, 6) with forces times L."""
    return np.asarray(wrenches * np.repeat([length, 1.0], 3))
