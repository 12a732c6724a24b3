"""The links that searches in joint coordinates keep apart."""

from __future__ import annotations

import numpy as np

from ..arrays import Ints
from ..derived import derived
from ..description.links import bodies_of_ends, links_of, scaled_sizes
from ..description.mechanism import Mechanism
from ..kernels.clearance.link_records import BASE, NO_LINKS, LinkLimits
from ..kernels.closure import loops as K
from ..motion.loops import ways_to
from ..tolerances import TOLERANCES


@derived
def links_on_paths(mechanism: Mechanism) -> tuple[LinkLimits, K.Loops]:
    """The links of a mechanism with a clearance, and the ways from the base to their bodies; none without."""
    if mechanism.clearance is None:
        return NO_LINKS, ways_to(mechanism, ())
    ends = bodies_of_ends(mechanism)
    bodies = list(dict.fromkeys(body for each in ends for body in each if body != mechanism.base))
    numbers = {body: number for number, body in enumerate(bodies)} | {mechanism.base: BASE}
    limits = link_limits(mechanism, np.array([[numbers[body] for body in each] for each in ends]))
    return limits, ways_to(mechanism, bodies)


def link_limits(mechanism: Mechanism, bodies: Ints) -> LinkLimits:
    """The links of a mechanism with a clearance, in L, that move with bodies of these numbers, (s, 2)."""
    from ..kernels.clearance.solids import CAPSULE

    links, length = links_of(mechanism), mechanism.characteristic_length
    sizes, places = scaled_sizes(links, 1.0 / length), links.places.copy()
    is_capsule = sizes[:, 0] == CAPSULE
    places[:, 0] /= length
    places[is_capsule, 1] /= length
    least = np.array([max((mechanism.clearance or 0.0) / length, TOLERANCES.apart)])
    return NO_LINKS._replace(sizes=sizes, home=places, bodies=bodies, pairs=links.pairs.copy(), least=least)
