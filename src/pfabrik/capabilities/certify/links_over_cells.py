"""The links whose distances are bounded over cells of poses, and those without bounds."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Ints
from ...common.derived import derived
from ...engines.joints.link_distances import pair_names
from ...engines.joints.placed_links import link_limits
from ...engines.pose.links_of_legs import bodies_of_link_ends
from ...kernels.certify.link_rows import CellLinks, new_cell_links
from ...kernels.clearance.link_records import NO_LINKS
from ...kernels.clearance.solids import CAPSULE, KIND
from ...kinematics import Model, links_of
from ...machine.description.links import NOWHERE


@derived
def bounded_pairs(model: Model) -> Ints:
    """Indices of the pairs of links with bounds over cells, (k,): of capsules and spheres whose ends move with the
    base, the platform, cranks or carriages."""
    if model.mechanism.clearance is None:
        return np.zeros(0, np.int64)
    links, is_known = links_of(model.mechanism), (bodies_of_link_ends(model) != NOWHERE).all(axis=1)
    is_known &= links.sizes[:, KIND] == CAPSULE
    return np.flatnonzero(is_known[links.pairs].all(axis=1))


def cell_links(model: Model) -> CellLinks:
    """The links of these pairs, in L, with scratch memory."""
    pairs = bounded_pairs(model)
    if not len(pairs):
        return new_cell_links(NO_LINKS)
    limits = link_limits(model.mechanism, bodies_of_link_ends(model), 0.0)
    return new_cell_links(limits._replace(pairs=limits.pairs[pairs]))


def links_without_bounds(model: Model) -> str:
    """A pair of links whose distance has no bounds over cells, for messages; empty if all have."""
    if model.mechanism.clearance is None:
        return ""
    names, bounded = pair_names(model.mechanism), set(bounded_pairs(model).tolist())
    return next((name for pair, name in enumerate(names) if pair not in bounded), "")
