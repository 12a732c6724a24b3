"""The links whose distances are bounded over cells of poses, and those without bounds."""

from __future__ import annotations

import numpy as np

from ..apart.link_distances import pair_names
from ..arrays import Ints
from ..derived import derived
from ..description.links import links_of
from ..kernels.certify.link_rows import CellLinks, new_cell_links, no_cell_links
from ..kernels.clearance.solids import CAPSULE, KIND, ROUND
from ..model import Model
from ..platform.links_of_legs import bodies_of_link_ends


@derived
def bounded_pairs(model: Model) -> Ints:
    """Indices of the pairs of links with bounds over cells, (k,): of capsules and spheres whose ends move with the
    base, the platform, cranks or carriages."""
    if model.mechanism.clearance is None:
        return np.zeros(0, np.int64)
    links = links_of(model.mechanism)
    is_known = np.array([None not in ends for ends in bodies_of_link_ends(model)])
    is_known &= links.sizes[:, KIND] == CAPSULE
    return np.flatnonzero(is_known[links.pairs].all(axis=1))


def cell_links(model: Model) -> CellLinks:
    """The links of these pairs, in L, with scratch memory."""
    pairs = bounded_pairs(model)
    if not len(pairs):
        return no_cell_links()
    links, length = links_of(model.mechanism), model.length
    shapes, numbers = np.unique(links.pairs[pairs], return_inverse=True)
    bodies, clearance = bodies_of_link_ends(model), model.mechanism.clearance or 0.0
    return new_cell_links(
        links.sizes[shapes, ROUND] / length,
        links.places[shapes, :2] / length,
        np.array([bodies[shape] for shape in shapes], np.int64),
        numbers.reshape(-1, 2).astype(np.int64),
        clearance / length,
    )


def links_without_bounds(model: Model) -> str:
    """A pair of links whose distance has no bounds over cells, for messages; empty if all have."""
    if model.mechanism.clearance is None:
        return ""
    names, bounded = pair_names(model.mechanism), set(bounded_pairs(model).tolist())
    return next((name for pair, name in enumerate(names) if pair not in bounded), "")
