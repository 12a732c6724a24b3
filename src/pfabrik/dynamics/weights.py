"""What bodies weigh, and what they carry."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..arguments import array
from ..arrays import Floats
from ..derived import derived
from ..description.mechanism import Mechanism
from ..errors import InvalidArgument
from ..kinematics import BodyInertia, inertias_of, tree_of
from ..statics.loads import BodyLoads


class Weights(NamedTuple):
    """Masses of bodies, some of which may have several, and other loads on them.

    Attributes
    ----------
    bodies : names of what bears each, b.
    masses : [kg], (b,); centres : at home (b, 3) [length]; inertias : about these, (b, 3, 3) [kg length²].
    loaded : names of what bears each of the other loads.
    points : at home, (loads, 3) [length]; loads : force, and moment about the point, (loads, 6) [N, N m].
    """

    bodies: tuple[str, ...]
    masses: Floats
    centres: Floats
    inertias: Floats
    loaded: tuple[str, ...]
    points: Floats
    loads: Floats


def weights_of(parts: Sequence[tuple[str, BodyInertia]], acting: Sequence[tuple[str, Floats, Floats]]) -> Weights:
    """Masses, and loads at points, as arrays."""
    masses = np.array([each.mass for _, each in parts], float)
    centres, inertias = ([getattr(each, name) for _, each in parts] for name in ("centre", "inertia"))
    vectors = np.reshape(centres, (-1, 3)).astype(float), np.reshape(inertias, (-1, 3, 3)).astype(float)
    points, loads = (np.reshape([each[k] for each in acting], (-1, w)).astype(float) for k, w in ((2, 3), (1, 6)))
    return Weights(
        tuple(body for body, _ in parts), masses, *vectors, tuple(body for body, *_ in acting), points, loads
    )


def masses_of(mechanism: Mechanism, metres: float) -> dict[str, BodyInertia]:
    """What the bodies that move weigh.

    Raises
    ------
    InvalidArgument : some bodies have no mass.
    """
    lacking = lacking_masses(mechanism, metres)
    if lacking:
        expected = "a mass of each body that moves: `with_masses`, or in its file, and 0 where it weighs nothing"
        raise InvalidArgument("mechanism", f"no mass of {', '.join(lacking)}", expected)
    resting = resting_bodies(mechanism)
    return {body: each for body, each in inertias_of(mechanism, metres).items() if body not in resting}


def lacking_masses(mechanism: Mechanism, metres: float) -> list[str]:
    """The bodies that move and have no mass."""
    found, resting = inertias_of(mechanism, metres), resting_bodies(mechanism)
    return [body for body in mechanism.bodies if body not in found and body not in resting]


@derived
def resting_bodies(mechanism: Mechanism) -> frozenset[str]:
    """The base, and the bodies that are held on it."""
    resting = {mechanism.base}
    for index, forward in tree_of(mechanism).steps:
        joint = mechanism.joints[index]
        if joint.is_rigid and joint.connects[0 if forward else 1] in resting:
            resting.add(joint.connects[1 if forward else 0])
    return frozenset(resting)


def loads_of(mechanism: Mechanism, metres: float, loads: BodyLoads) -> Weights:
    """All masses, those that bodies carry among them, and other loads on them."""
    parts, acting = list(masses_of(mechanism, metres).items()), []
    for body, (load, point) in loads.items():
        value = array(f"loads['{body}']", load, "() | 3 | 6", note=", a mass [kg], force [N] or wrench [N, N m]")
        place = array(f"loads['{body}'][1]", point, "3", note=", its centre or point")
        if value.shape == ():
            if value < 0.0:
                raise InvalidArgument(f"loads['{body}']", f"a mass of {value}", "a mass that is not negative")
            parts.append((body, BodyInertia(float(value), place, np.zeros((3, 3)))))
        else:
            acting.append((body, np.append(value, np.zeros(6 - len(value))), place))
    return weights_of(parts, acting)
