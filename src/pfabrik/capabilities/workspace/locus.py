"""The zero set of a measure that lattice points within a workspace have, up to the border."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Floats, Ints
from .lattice_points import Numbering, codes, corners, places_around
from .refining import Cells
from .result import Workspace
from .surface import crossed_edges

HALVINGS = 10
"""Halvings of the way from a point within reach to one beyond, towards the border: loci may run along it."""


def drawn_to_border(over: Workspace, places: Ints, step: Floats) -> tuple[Ints, Floats]:
    """Lattice places (k, d) beyond reach beside those within, (n, d), and points (k, d) at the border for them.

    Each is drawn towards the middle of its neighbours within, or to the nearest where that middle is beyond reach. So
    a cell with some corner within has all its others at the border, and ends there.
    """
    d, start, numbering = len(step), over._question.space.start, Numbering()
    numbering.number(codes(places))
    ways = places_around(d)
    around = (places[:, None] + ways).reshape(-1, d)
    around = around[numbering.find(codes(around)) < 0]
    outer = around[np.unique(codes(around), return_index=True)[1]]
    is_within = numbering.find(codes(outer[:, None] + ways)) >= 0
    inner = (is_within @ ways) / is_within.sum(axis=1, keepdims=True)
    is_beyond = ~np.asarray(over.contains((outer + inner) * step + start))
    inner[is_beyond] = ways[is_within[is_beyond].argmax(axis=1)]
    near, far = np.ones(len(outer)), np.zeros(len(outer))
    for _ in range(HALVINGS):
        middle = 0.5 * (near + far)
        is_on = np.asarray(over.contains((outer + middle[:, None] * inner) * step + start))
        near, far = np.where(is_on, middle, near), np.where(is_on, far, middle)
    near += (1.0 - near) / 2**HALVINGS  # at the border itself legs may be at dead points, where signs have no meaning
    return outer, (outer + near[:, None] * inner) * step + start


def locus(places: Ints, points: Floats, signed: Floats) -> tuple[Floats, Ints]:
    """The zero set of a signed measure at points (n, d) of lattice places (n, d): vertices (v, d), and faces (f, d)."""
    numbering = Numbering()
    numbering.number(codes(places))
    around = numbering.find(codes(places[:, None] + corners(places.shape[1])))
    whole = (around >= 0).all(axis=1)
    cells = Cells(codes(places[whole]), 1, around[whole], signed[around[whole]])
    (first, last), faces = crossed_edges(cells.at(cells.touched & ~cells.inside), len(places))
    share = signed[first] / np.where(signed[first] == signed[last], 1.0, signed[first] - signed[last])
    return np.asarray(points[first] + share[:, None] * (points[last] - points[first])), faces
