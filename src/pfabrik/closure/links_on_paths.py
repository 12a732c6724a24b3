"""The links of a mechanism as kernels take them, and those that searches in joint coordinates keep apart."""

from __future__ import annotations

import numpy as np

from ..arrays import Ints
from ..derived import derived
from ..description.graph import steps_from_base
from ..description.links import ends_on, links_of, scaled_sizes
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
    steps = steps_from_base(mechanism)
    bodies = sorted(set(steps) - {mechanism.base}, key=lambda body: steps[body])
    on = ends_on(mechanism, {mechanism.base: BASE} | {body: number for number, body in enumerate(bodies)})
    used = np.unique(on[on >= 0])
    on[on >= 0] = np.searchsorted(used, on[on >= 0])
    return link_limits(mechanism, on), ways_to(mechanism, [bodies[k] for k in used])


def link_limits(mechanism: Mechanism, bodies: Ints, least: float = TOLERANCES.apart) -> LinkLimits:
    """The links of a mechanism with a clearance, in L, that move with bodies of these numbers, (s, 2).

    Parameters
    ----------
    least : the clearance kept where the mechanism's own is less [L].
    """
    from ..kernels.clearance.solids import CAPSULE

    links, length = links_of(mechanism), mechanism.characteristic_length
    sizes, places = scaled_sizes(links, 1.0 / length), links.places.copy()
    is_capsule = sizes[:, 0] == CAPSULE
    places[:, 0] /= length
    places[is_capsule, 1] /= length
    clearance = np.array([max((mechanism.clearance or 0.0) / length, least)])
    return NO_LINKS._replace(sizes=sizes, home=places, bodies=bodies, pairs=links.pairs.copy(), least=clearance)
