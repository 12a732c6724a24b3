"""Lattice points are numbered as they are met, each once, and joined to what hangs together."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from pfabrik.capabilities.workspace.lattice_points import Numbering, codes, offsets, places_of
from pfabrik.capabilities.workspace.parts import connected


@pytest.mark.parametrize("d", [2, 3])
def test_points_are_numbered_in_the_order_in_which_they_are_met(d: int) -> None:
    rng = np.random.default_rng(d)
    places = rng.integers(-40, 40, (6000, d)) * rng.choice([1, 64], (6000, 1))
    numbering, met = Numbering(), {}
    for some in np.array_split(places, 3):  # the table grows between
        expected = [met.setdefault(place, len(met)) for place in map(tuple, some.tolist())]
        assert numbering.number(codes(some)).tolist() == expected
    assert places_of(numbering.codes, d).tolist() == [list(place) for place in met]
    elsewhere = np.array([[10_000] * d, [0] * d])
    assert numbering.find(codes(elsewhere)).tolist() == [-1, met.get((0,) * d, -1)]
    assert len(numbering) == len(met)


def test_a_code_tells_where_its_place_is_from_another() -> None:
    rng = np.random.default_rng(1)
    first, way = rng.integers(-1000, 1000, (2, 50, 3))
    assert (codes(first) + offsets(way) == codes(first + way)).all()


def test_what_is_joined_has_the_same_lowest_point() -> None:
    n, rng = 2000, np.random.default_rng(3)
    pairs = rng.integers(0, n, (1500, 2))
    joined = coo_array((np.ones(len(pairs)), tuple(pairs.T)), shape=(n, n))
    _, labels = connected_components(joined, directed=False)
    _, first, back = np.unique(labels, return_index=True, return_inverse=True)
    assert (connected(n, pairs) == first[back]).all()
