"""Distances of links: the least ones, those of all pairs, and the least between two configurations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints, Mask
from ...common.derived import derived
from ...kernels.clearance.link_records import PLATFORM
from ...kernels.threads import in_blocks
from ...machine.description.links import Links, links_of
from ...machine.description.mechanism import Mechanism
from ...machine.model import model_of
from ...machine.motion.displacements import end_effector_pose
from ...machine.poses import between
from ...options import USUAL
from ...tolerances import TOLERANCES
from .configurations import Configurations, new_rows
from .engine_contract import Engine
from .placed_links import PlacedLinks, bodies_of_links, placed_at

ROWS_A_BLOCK = 4096
"""Rows of one call of a kernel, and of the tables of places that it takes."""

ROWS_A_RUN = 1024
"""Rows of one call of the kernel of capsules: their ends stay in the cache."""


def least_distances(placed: PlacedLinks, nearest: Ints | None = None) -> tuple[Floats, Ints, Floats]:
    """The least distances of links (n,) [length], the pairs that have them (n,), and their nearest points (n, 2, 3).

    Distances are between surfaces, and negative where links overlap. The points are there where pairs are given, or
    where there are other links than capsules; else they are NaN.

    Parameters
    ----------
    nearest : the pair of each row, (n,), if it is known already; -1 for none.
    """
    links = links_of(placed.mechanism)
    n = len(placed)
    distances, pairs, points = np.full(n, np.inf), np.full(n, -1.0), np.full((n, 2, 3), np.nan)
    if nearest is None:
        _measure_capsules(links, placed, distances, pairs)
    which = pairs.astype(np.int64) if nearest is None else nearest.copy()
    if nearest is not None or links.n_capsules < len(links.pairs):
        first = len(links.pairs) if nearest is not None else links.n_capsules
        _measure_solids(links.pairs, first, placed, distances, which, points)
    distances[which < 0] = np.nan
    return distances, which, points


def clearance_excess(placed: PlacedLinks) -> Floats:
    """By how much links are nearer than the clearance, (n,) [L]; negative where they are farther, NaN if INVALID."""
    mechanism = placed.mechanism
    excess: Floats = ((mechanism.clearance or 0.0) - least_distances(placed)[0]) / mechanism.characteristic_length
    return excess


def too_near(engine: Engine, mechanism: Mechanism, answers: Configurations) -> Ints:
    """The rows of an engine's answers whose links are nearer than the clearance; none without a clearance."""
    if mechanism.clearance is None:
        return np.zeros(0, np.int64)
    excess = clearance_excess(PlacedLinks(mechanism, answers, lambda: engine.points(answers)))
    return np.flatnonzero(excess > TOLERANCES.limit)


def pair_distances(placed: PlacedLinks) -> Floats:
    """The distance of every pair of links, (n, pairs) [length]; NaN for INVALID rows."""
    pairs, n = links_of(placed.mechanism).pairs, len(placed)
    distances = np.empty((n, len(pairs)))
    for k in range(len(pairs)):
        of_pair, which, points = np.full(n, np.inf), np.full(n, -1), np.empty((n, 2, 3))
        _measure_solids(pairs[k : k + 1], 0, placed, of_pair, which, points)
        distances[:, k] = of_pair
    return distances


def pair_distances_at(mechanism: Mechanism, coordinates: Floats) -> Floats:
    """As `pair_distances`, at joint coordinates (n, columns), as deviations from home."""
    rows = new_rows(model_of(mechanism), len(coordinates))
    rows.poses[:] = end_effector_pose(mechanism, coordinates)
    return pair_distances(placed_at(mechanism, Configurations(rows, coordinates)))


@derived
def pair_names(mechanism: Mechanism) -> tuple[str, ...]:
    """The names of the two bodies of every pair of links: ``BC1–BC3``; those of bodies with several links repeat."""
    bodies = [shape.body for shape in mechanism.shapes]
    return tuple(f"{bodies[first]}–{bodies[second]}" for first, second in links_of(mechanism).pairs.tolist())


def _measure_solids(
    pairs: Ints, first: int, placed: PlacedLinks, distances: Floats, nearest: Ints, points: Floats
) -> None:
    """Lower distances (n,) by those of pairs of any solids, from the first of them on."""
    from ...kernels.clearance.least_clearance import least_clearance

    sizes = links_of(placed.mechanism).sizes

    def run(block: slice) -> None:
        least_clearance(sizes, placed.places(block), pairs, first, distances[block], nearest[block], points[block])

    in_blocks(run, len(distances), ROWS_A_BLOCK)


def _measure_capsules(links: Links, placed: PlacedLinks, distances: Floats, pairs: Floats) -> None:
    """Lower distances (n,) by those of all pairs of capsules."""
    from ...kernels.clearance.capsules import capsule_clearance, place_ends

    mechanism, poses = placed.mechanism, placed.configurations.rows.poses
    bodies, home = bodies_of_links(mechanism), np.ascontiguousarray(links.places[:, :2])
    home[bodies == PLATFORM] -= mechanism.home_pose[:3, 3]
    rounds, capsules = links.sizes[:, 1].copy(), links.pairs[: links.n_capsules]

    def run(block: slice) -> None:
        ends = placed.ends(block)
        place_ends(home, bodies, poses[block], ends)
        capsule_clearance(rounds, ends, capsules, distances[block], pairs[block])

    in_blocks(run, len(distances), ROWS_A_RUN)


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
