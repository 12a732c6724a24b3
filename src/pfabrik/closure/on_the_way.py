"""Least distances of links between two configurations, while the platform moves straight."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Floats, Mask
from ..description.links import links_of
from ..description.mechanism import Mechanism
from ..options import USUAL
from ..poses import between
from .configurations import Configurations
from .engine_contract import Engine
from .link_distances import least_distances
from .placed_links import PlacedLinks

FINE = 1e-3
"""Error of the least distance, where it is less than the clearance [L]."""

HALVINGS = 10
"""Most halvings of the way."""


class Places(NamedTuple):
    """Links at one end of each way: poses, least distances, and places as in `PlacedLinks.places`."""

    poses: Floats  # (n, 4, 4) [length]
    distances: Floats  # (n,) [length]
    links: Floats  # (n, shapes, 4, 3) [length]

    def at(self, rows: Mask) -> Places:
        """Some of them."""
        return Places(*(array[rows] for array in self))

    def followed_by(self, others: Places) -> Places:
        """These, then others."""
        return Places(*(np.concatenate(both) for both in zip(self, others, strict=True)))


def least_on_the_way(engine: Engine, mechanism: Mechanism, before: Configurations, after: Configurations) -> Floats:
    """Least distances of links between as many pairs of configurations, (n,) [length]; NaN where one is INVALID.

    Points of two links that move by a and b come nearer by a + b at most: between distances d and e they are nowhere
    nearer than (d + e - a - b) / 2. Where that may be less than the clearance, the way is halved, and answered in the
    middle in the working mode of its beginning, with no regard to links.

    Parameters
    ----------
    engine : that of the machine without its clearance.
    """
    fine, asked = FINE * mechanism.characteristic_length, mechanism.clearance or 0.0
    first, last = (_places(engine, mechanism, each) for each in (before, after))
    least, rows = np.minimum(first.distances, last.distances), np.arange(len(before))
    for _ in range(HALVINGS):
        nearest = 0.5 * (first.distances + last.distances - _nearer_by(mechanism, first, last))
        is_open = nearest < np.minimum(least[rows], asked) - fine
        if not is_open.any():
            break
        rows, first, last = rows[is_open], first.at(is_open), last.at(is_open)
        targets = np.require(between(first.poses, last.poses, 0.5), requirements=["C", "W"])
        answers = engine.answer(targets, before.at(rows), USUAL, keep_mode=True)
        middle = _places(engine, mechanism, answers)
        np.fmin.at(least, rows, middle.distances)
        rows = np.concatenate([rows, rows])
        first, last = first.followed_by(middle), middle.followed_by(last)
    return least


def _places(engine: Engine, mechanism: Mechanism, configurations: Configurations) -> Places:
    placed = PlacedLinks(mechanism, configurations, lambda: engine.points(configurations))
    return Places(configurations.rows.poses, least_distances(placed)[0], placed.places(slice(None)))


def _nearer_by(mechanism: Mechanism, first: Places, last: Places) -> Floats:
    """The most by which two links can come nearer on straight ways of their points, (n,) [length]."""
    links = links_of(mechanism)
    moves = np.linalg.norm(last.links - first.links, axis=3)
    turned = np.linalg.norm(moves[:, :, 1:], axis=2) * np.linalg.norm(links.sizes[:, 2:], axis=1)
    is_capsule = links.sizes[:, 0] == 0.0
    most = np.where(is_capsule, moves[:, :, :2].max(axis=2), moves[:, :, 0] + turned)
    nearer: Floats = most[:, links.pairs].sum(axis=2).max(axis=1)
    return nearer
