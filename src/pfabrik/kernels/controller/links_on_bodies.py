"""Links on bodies that follow from the pose and from coordinates of legs, and the nearest pair of them."""

from __future__ import annotations

import math
from typing import NamedTuple

from ...common.arrays import Floats, Ints
from .._jit import routine
from ..clearance.convex import Polytope
from ..clearance.least_clearance import clearance_within
from ..clearance.solids import CAPSULE, KIND
from ..legs.records import FROM_BASE, Table
from ..vectors import Vec, along, copy_table, move, norm, put, rotate, scale, sub, turn, vec

SLIDES, TURNS, WITH_BASE_END, WITH_PLATFORM_END = 0, 1, 2, 3
"""How a body moves: along or about an axis, by a coordinate of a leg; or along the line of a rod, with one of its ends.
"""

BASE, PLATFORM, FIRST_MOVED = 0, 1, 2
"""Numbers of bodies."""

ON, KIND_OF, LEG, PLACE = 0, 1, 2, 3
SENSE, AXIS, POINT = 0, 1, 4
"""Columns of a motion's integers and numbers."""


class LinksOnBodies(NamedTuple):
    """Links, the bodies that they are on, and the memory of a call; lengths in L, at home."""

    motions: Ints  # (m, 4): of each body after the platform: the body that it moves on, how, the leg, the coordinate
    numbers: Floats  # (m, 7): sense, axis and point of each
    sizes: Floats  # (s, 5), as in `clearance.solids`
    home: Floats  # (s, 4, 3): places
    bodies: Ints  # (s, 2): of the first point of each, and of its second
    pairs: Ints  # (k, 2): two links each
    least: Floats  # (1,): the clearance
    displaced: Floats  # (2 + m, 4, 4): bodies
    places: Floats  # (s, 4, 3)
    polytope: Polytope  # memory of overlaps
    points: Floats  # (2, 3): nearest points


@routine
def nearest_pair(
    links: LinksOnBodies, table: Table, frames: Floats, values: Floats, lines: Floats, distance: Floats
) -> int:
    """Index of the nearest pair of links where legs are placed; fills its distance [L], negative if they overlap."""
    place_bodies(links, table, frames, values, lines)
    for i in range(links.home.shape[0]):
        for k in range(4):
            body, at = links.displaced[links.bodies[i, 1 if k == 1 else 0]], vec(links.home[i, k])
            is_point = k == 0 or links.sizes[i, KIND] == CAPSULE
            put(links.places[i, k], move(body, at) if is_point else turn(body, at))
    nearest, distance[0] = 0, math.inf
    for pair in range(links.pairs.shape[0]):
        i, j = links.pairs[pair, 0], links.pairs[pair, 1]
        one, other = (links.sizes[i], links.places[i]), (links.sizes[j], links.places[j])
        between = clearance_within(one, other, distance[0], links.polytope, links.points)
        if between < distance[0]:
            nearest, distance[0] = pair, between
    return nearest


@routine
def place_bodies(links: LinksOnBodies, table: Table, frames: Floats, values: Floats, lines: Floats) -> None:
    """Fill the displacements of all bodies from home."""
    displaced, reference = links.displaced, vec(table.task[0]["reference"])
    for i in range(3):
        for j in range(4):
            displaced[BASE, i, j] = 1.0 if i == j else 0.0
            displaced[PLATFORM, i, j] = frames[FROM_BASE, i, j]
    arm = turn(displaced[PLATFORM], reference)
    for i in range(3):
        displaced[PLATFORM, i, 3] -= arm[i]
    for k in range(links.motions.shape[0]):
        motion, numbers, body = links.motions[k], links.numbers[k], displaced[FIRST_MOVED + k]
        on, axis, point = displaced[motion[ON]], vec(numbers[AXIS:]), vec(numbers[POINT:])
        value = numbers[SENSE] * values[motion[LEG], motion[PLACE]]
        if motion[KIND_OF] == SLIDES:
            copy_table(on, body)
            put_point(body, move(on, scale(value, axis)))
        elif motion[KIND_OF] == TURNS:
            for i in range(3):
                e = (1.0 if i == 0 else 0.0, 1.0 if i == 1 else 0.0, 1.0 if i == 2 else 0.0)
                column = turn(on, rotate(e, axis, value))
                for j in range(3):
                    body[j, i] = column[j]
            put_point(body, sub(move(on, point), turn(body, point)))
        else:
            place_along(table, motion, on, frames, lines, body)


@routine
def put_point(T: Floats, point: Vec) -> None:
    """Fill the position of a displacement."""
    for i in range(3):
        T[i, 3] = point[i]


@routine
def place_along(table: Table, motion: Ints, on: Floats, frames: Floats, lines: Floats, body: Floats) -> None:
    """Fill the displacement of a body along the line of a rod, about which it may spin in any way."""
    rod, span = table.legs[motion[LEG]], vec(lines[motion[LEG]])
    end, home = move(frames[rod["frame"]], vec(rod["platform_end_point"])), vec(rod["base_end_point"])
    if motion[KIND_OF] == WITH_BASE_END:
        end = sub(end, span)
    else:
        home = along(home, rod["length"], vec(rod["line"]))
    u, line = turn(on, scale(1.0 / norm(span), span)), vec(rod["line"])
    for i in range(3):
        for j in range(3):
            body[i, j] = u[i] * line[j]
    put_point(body, sub(move(on, end), turn(body, home)))
