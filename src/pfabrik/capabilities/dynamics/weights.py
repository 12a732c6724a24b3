"""What bodies weigh, and what they carry."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...common.arrays import Floats
from ...common.derived import derived
from ...errors import InvalidArgument
from ...kinematics import BodyInertia, inertias_of, tree_of
from ...machine.description.mechanism import Mechanism
from ...machine.files.units import metres_of
from ..statics.loads import Load, checked_loads


class Weights(NamedTuple):
    """Masses of bodies, some of which may have several, and other loads on them; none by default.

    Attributes
    ----------
    bodies : names of what bears each, b.
    masses : [kg], (b,); centres : at home (b, 3) [length]; inertias : about these, (b, 3, 3) [kg length²].
    loaded : names of what bears each of the other loads.
    points : at home, (loads, 3) [length]; loads : force, and moment about the point, (loads, 6) [N, N m].
    """

    bodies: tuple[str, ...] = ()
    masses: Floats = np.zeros(0)
    centres: Floats = np.zeros((0, 3))
    inertias: Floats = np.zeros((0, 3, 3))
    loaded: tuple[str, ...] = ()
    points: Floats = np.zeros((0, 3))
    loads: Floats = np.zeros((0, 6))


def weights_of(mechanism: Mechanism, loads: Any = None) -> Weights:
    """All masses, those that bodies carry among them, and other loads on them; `loads` as in `inverse_dynamics`.

    Raises
    ------
    InvalidArgument or UnknownName : bodies that move without a mass; loads that are none.
    """
    if loads is None:
        return own_weights(mechanism)
    return _weights(mechanism, checked_loads(mechanism, loads))


@derived
def own_weights(mechanism: Mechanism) -> Weights:
    """All masses of a machine that carries nothing."""
    return _weights(mechanism, [])


def _weights(mechanism: Mechanism, given: Sequence[Load]) -> Weights:
    lacking = lacking_masses(mechanism)
    if lacking:
        expected = "a mass of each body that moves: `with_masses`, or in its file, and 0 where it weighs nothing"
        raise InvalidArgument("mechanism", f"no mass of {', '.join(lacking)}", expected)
    known = inertias_of(mechanism, metres_of(mechanism.length_unit))
    parts = [(body, known[body]) for body in moving_bodies(mechanism)]
    parts += [(each.body, BodyInertia(each.mass, each.point, np.zeros((3, 3)))) for each in given if each.mass]
    acting = [each for each in given if each.wrench.any()]
    return Weights(
        tuple(body for body, _ in parts),
        np.array([each.mass for _, each in parts], float),
        np.reshape([each.centre for _, each in parts], (-1, 3)),
        np.reshape([each.inertia for _, each in parts], (-1, 3, 3)),
        tuple(each.body for each in acting),
        np.reshape([each.point for each in acting], (-1, 3)),
        np.reshape([each.wrench for each in acting], (-1, 6)),
    )


def lacking_masses(mechanism: Mechanism) -> list[str]:
    """The bodies that move and have no mass."""
    known = inertias_of(mechanism, metres_of(mechanism.length_unit))
    return [body for body in moving_bodies(mechanism) if body not in known]


@derived
def moving_bodies(mechanism: Mechanism) -> tuple[str, ...]:
    """All bodies but the base, and those that are held on it."""
    resting = {mechanism.base}
    for index, forward in tree_of(mechanism).steps:
        joint = mechanism.joints[index]
        if joint.is_rigid and joint.connects[0 if forward else 1] in resting:
            resting.add(joint.connects[1 if forward else 0])
    return tuple(body for body in mechanism.bodies if body not in resting)
