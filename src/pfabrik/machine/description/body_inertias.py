"""Masses, centres and inertias of bodies: as they are described, or of shapes that are filled evenly."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats
from ...common.derived import derived
from .body_masses import Moments, as_matrix, lamina
from .links import links_of
from .structure import Structure


class BodyInertia(NamedTuple):
    """What a body weighs.

    Attributes
    ----------
    mass : [kg].
    centre : at home, in base coordinates, (3,) [length].
    inertia : about the centre, (3, 3) [kg length²].
    """

    mass: float
    centre: Floats
    inertia: Floats


@derived
def inertias_of(mechanism: Structure, metres: float) -> dict[str, BodyInertia]:
    """Body -> what it weighs, of those whose mass is known: by `masses`, or by the density of their shapes.

    Parameters
    ----------
    metres : length of the mechanism's unit [m].
    """
    given, found = {each.body: each for each in mechanism.masses}, {}
    for body in mechanism.bodies:
        shapes = [(k, shape) for k, shape in enumerate(mechanism.shapes) if shape.body == body and shape.is_filled]
        if body not in given:
            dense = [(k, shape.density * metres**3) for k, shape in shapes if shape.density is not None]
            if dense:
                found[body] = joined([_filled(mechanism, k, density) for k, density in dense])
            continue
        mass, centre, moments = given[body].mass, given[body].centre, given[body].inertia
        whole = BodyInertia(0.0, np.zeros(3), np.zeros((3, 3)))
        if centre is not None:
            whole = whole._replace(centre=np.array(centre))
        elif shapes:
            whole = joined([_filled(mechanism, k, 1.0) for k, _ in shapes])
        inertia = whole.inertia * (mass / (whole.mass or 1.0)) if moments is None else _as_body(mechanism, moments)
        found[body] = BodyInertia(mass, whole.centre, inertia)
    return found


def _as_body(mechanism: Structure, moments: Moments) -> Floats:
    """Moments as a matrix; those about the only axis of a planar machine are of a lamina."""
    flat = lamina(mechanism.joints, moments)
    return as_matrix(moments) if flat is None else flat


def joined(parts: Sequence[BodyInertia]) -> BodyInertia:
    """Several solids as one."""
    mass = sum(part.mass for part in parts)
    centre = np.sum([part.mass * part.centre for part in parts], axis=0) / mass
    moved = [part.inertia + part.mass * _of_point(part.centre - centre) for part in parts]
    return BodyInertia(mass, centre, np.sum(moved, axis=0))


def _of_point(arm: Floats) -> Floats:
    """Inertia per mass of a point, (3, 3), or the second moments of a rod's half: |a|² I - a a'."""
    return np.asarray(arm @ arm * np.eye(3) - np.outer(arm, arm))


def _filled(mechanism: Structure, k: int, density: float) -> BodyInertia:
    """A shape filled evenly, at home; density in kg per length³."""
    shape, (first, second, *axes) = mechanism.shapes[k], links_of(mechanism).places[k]
    centre, radius = first, 0.5 * (shape.diameter or 0.0)
    if shape.kind == "capsule":
        centre, radius = 0.5 * (first + second), 0.5 * shape.thickness
        height = float(np.linalg.norm(second - first))
        axis = (second - first) / (height or 1.0)
        rod, ball = math.pi * radius**2 * height, 4.0 / 3.0 * math.pi * radius**3
        about = (0.5 * rod + 0.4 * ball) * radius**2
        across = rod * (radius**2 / 4.0 + height**2 / 12.0)
        across += ball * (0.4 * radius**2 + height**2 / 4.0 + 0.375 * height * radius)
        volume, inertia = rod + ball, across * np.eye(3) + (about - across) * np.outer(axis, axis)
    elif shape.kind == "sphere":
        volume = 4.0 / 3.0 * math.pi * radius**3
        inertia = 0.4 * volume * radius**2 * np.eye(3)
    elif shape.kind == "disc":
        volume, across = math.pi * radius**2 * shape.thickness, radius**2 / 4.0 + shape.thickness**2 / 12.0
        inertia = volume * (across * np.eye(3) + (0.5 * radius**2 - across) * np.outer(second, second))
    else:
        edges = np.array(shape.size)
        volume = float(np.prod(edges))
        inertia = np.sum([_of_point(e * axis) for e, axis in zip(edges, (second, *axes), strict=True)], axis=0)
        inertia = inertia * (volume / 12.0)
    return BodyInertia(density * volume, np.array(centre), density * inertia)
