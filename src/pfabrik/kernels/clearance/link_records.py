"""Links that searches keep apart, as kernels take them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints
from .convex import Polytope, new_polytope

# The numbers of bodies that every engine knows; others are not negative.
BASE, PLATFORM = -2, -1


class LinkLimits(NamedTuple):
    """Links that are to be kept apart, and where they are.

    A link moves with a body. Both ends of the axis of a capsule may move with bodies of their own, as those of a strut.
    """

    sizes: Floats  # (s, 5) [L], as in `solids`
    home: Floats  # (s, 4, 3): places at home [L]
    bodies: Ints  # (s, 2): the body of each end, numbered by the engine
    pairs: Ints  # (k, 2): two links each
    least: Floats  # (1,): the clearance [L]
    places: Floats  # (s, 4, 3): places [L]
    polytope: Polytope  # memory of overlaps
    points: Floats  # (2, 3): nearest points of the pair that was measured last [L]
    pulls: Floats  # (4, 6): points at the ends of this pair's links, and forces there, as of `put_pulls`
    kept: Ints  # (1,): pairs that a search keeps apart now: all or none


NO_LINKS = LinkLimits(
    np.zeros((0, 5)),
    np.zeros((0, 4, 3)),
    np.zeros((0, 2), np.int64),
    np.zeros((0, 2), np.int64),
    np.zeros(1),
    np.zeros((0, 4, 3)),
    new_polytope(0),
    np.zeros((2, 3)),
    np.zeros((4, 6)),
    np.zeros(1, np.int64),
)
"""Nothing to be kept apart."""
