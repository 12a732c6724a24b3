"""The mass of a body, as it is described."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ...common.arrays import Floats
from ...tolerances import TOLERANCES
from .coercion import numbers, text
from .form_faults import is_numbers
from .joints import Joint, Vector, set_fields

Moments: TypeAlias = tuple[float, float, float, float, float, float]

PLACES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Row and column of each of the six moments of inertia in their matrix."""


@dataclass(frozen=True)
class Mass:
    """The mass of a body, where its centre is, and how it resists turning, at home.

    Without a centre, the mass is spread evenly over the shapes of the body.

    Attributes
    ----------
    body : str
        The body.
    mass : float
        Mass [kg]; 0 of a body that weighs nothing.
    centre : array (3,) or None
        Centre of mass at home, in base coordinates [length]; by default that of the body's shapes.
    inertia : tuple of float or None
        Moments of inertia about the centre, along the axes of the base at home: Ixx, Iyy, Izz, Ixy, Ixz, Iyz, the last
        three as they stand in the matrix [kg length²]. Three numbers, or a matrix (3, 3), may be given in their place.
        By default those of the body's shapes, or, with a `centre`, 0: a point. Where all bodies turn about one axis,
        the moment about that may stand alone: the body is then as flat as it may be.
    """

    body: str
    mass: float
    centre: Vector | None = None
    inertia: Moments | None = None

    if TYPE_CHECKING:  # what may be given, which is more than what the fields then are

        def __init__(
            self, body: str, mass: float, centre: ArrayLike | None = None, inertia: ArrayLike | None = None
        ) -> None: ...

    def __post_init__(self) -> None:
        set_fields(self, body=text(self.body), mass=numbers(self.mass), centre=numbers(self.centre))
        set_fields(self, inertia=_six(numbers(self.inertia)))


def lamina(joints: Iterable[Joint], moments: Any) -> Floats | None:
    """The inertia (3, 3) of a lamina, where moments are about the only axis that all bodies turn about; else None."""
    axes = []
    for joint in joints:
        if joint.type in ("revolute", "cylindrical") and joint.axis is not None and is_numbers(joint.axis, 3):
            size = float(np.linalg.norm(joint.axis))
            axes.append(np.array(joint.axis, float) / (size or math.nan))
        elif joint.type not in ("prismatic", "fixed"):
            return None
    if not axes or not np.linalg.norm(np.cross(axes, axes[0]), axis=1).max() <= TOLERANCES.alignment:
        return None
    along, inertia = np.outer(axes[0], axes[0]), as_matrix(moments)
    about = float(axes[0] @ inertia @ axes[0])
    is_alone = about > 0.0 and np.abs(inertia - about * along).max() <= INERTIA_SLACK * about
    return 0.5 * about * (np.eye(3) + along) if is_alone else None


INERTIA_SLACK = 1e-6
"""Share of the largest moment of inertia by which moments may break their rules: files have six digits."""


def _six(given: Any) -> Any:
    """Moments of inertia as six numbers, of three or of a symmetric matrix; anything else as it is."""
    if is_numbers(given, 3):
        return (*given, 0.0, 0.0, 0.0)
    if isinstance(given, tuple) and len(given) == 3 and all(is_numbers(row, 3) for row in given):
        matrix = np.array(given)
        if (matrix == matrix.T).all():
            return tuple(matrix[place].item() for place in PLACES)
    return given


def as_matrix(moments: Moments) -> Floats:
    """The matrix of inertia, (3, 3), of its six moments."""
    matrix = np.zeros((3, 3))
    for value, (row, column) in zip(moments, PLACES, strict=True):
        matrix[row, column] = matrix[column, row] = value
    return matrix


def as_moments(matrix: Floats) -> Moments:
    """The six moments of a symmetric matrix of inertia, (3, 3)."""
    a, b, c, d, e, f = (0.5 * float(matrix[place] + matrix[place[::-1]]) for place in PLACES)
    return a, b, c, d, e, f
