"""The largest sphere, box or cylinder within a workspace, and the search that sizes shapes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ...common.arguments import array, is_positive
from ...common.arrays import Floats
from ...common.checks import require_known
from ...common.printed import Printed, ResultTable
from ...errors import InvalidArgument
from .region import product_of
from .workspace_table import for_people

if TYPE_CHECKING:
    from .region import Region

Kind = Literal["sphere", "box", "cylinder"]

NEAREST_FACES, POINTS_A_SIDE = 400, 12
"""Number of faces nearest to the shape that are sampled, and points along each of their sides."""

SAMPLES = 4096
"""Points on the shape that must be within the workspace."""

GIVES, MOST_GIVES = 0.998, 50
"""Factor by which the shape shrinks if one of them is not, and the largest number of times."""

GROWTH, FAR, LEAST = 1.02, 1.1, 0.01
"""Factor by which a shape that fits grows at first, up to the second; then it doubles. The least scale of a shape."""

FIRST_GRID, LOOKED_AT, MOST_STEPS = 13, 4, 60
"""A search for the best centre: points on each axis that it begins with, the best of them that it goes on from."""

MOST_VERTICES = 20_000


@dataclass(frozen=True)
class Inscribed(Printed):
    """A shape that lies within reach.

    Attributes
    ----------
    kind : {"sphere", "box", "cylinder", "ball"}
        A sphere is a circle in a plane; a "ball" is one of positions that are proved to be reached.
    centre : array (d,)
        The centre [length or rad].
    extents : array (d,)
        Length along each coordinate: the sides of a box, diameters, and a cylinder's height last.
    names, units : tuple of str
        Names and units of the d coordinates.
    """

    kind: Kind | Literal["ball"]
    centre: Floats
    extents: Floats
    names: tuple[str, ...]
    units: tuple[str, ...]

    @property
    def size(self) -> float:
        """Its area or volume [product of the units of the coordinates]."""
        rounds = {"box": 1.0, "cylinder": math.pi / 4.0}
        share = rounds.get(self.kind, math.pi / (4.0 if len(self.extents) == 2 else 6.0))
        return float(share * np.prod(self.extents))

    def table(self) -> ResultTable:
        """Centre and extents along each coordinate, angles in degrees."""
        factors, units = for_people(self.units)
        numbers = zip(self.names, units, self.centre.tolist(), self.extents.tolist(), factors, strict=True)
        rows = [
            (f"{name} [{unit}]", f"{middle * factor + 0.0:.6g}", f"{extent * factor:.6g}")
            for name, unit, middle, extent, factor in numbers
        ]
        size = math.prod(factors) * self.size  # of a box in a plane of space 0
        words = f", {size:,.6g} {product_of(units)}" if size else ""
        header = ("coordinate", "centre", "extent")
        name = "circle" if self.kind == "sphere" and len(self.extents) == 2 else self.kind
        return ResultTable(f"Largest {name}", [f"largest {name}{words}"], header, rows)

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists, ready for JSON."""
        centre, extents = self.centre.tolist(), self.extents.tolist()
        return {"kind": self.kind, "centre": centre, "extents": extents, "size": self.size}


def largest_scale(
    fits: Callable[[float, float, float], bool],
    accuracy: float,
    *,
    most_attempts: int,
    first: float = 1.0,
    bound: float = np.inf,
    shrinks: float = 0.5,
) -> float:
    """The largest scale at which a shape fits, to a share of itself; 0 if none does down to `LEAST` of the first.

    Parameters
    ----------
    fits : of a scale, the largest that fits, and the least that does not.
    first, bound : the scale to begin with, and one above which none fits.
    shrinks : factor to the next scale while none fits.
    """
    low, high, scale = 0.0, bound, first
    for _ in range(most_attempts):
        if fits(scale, low, high):
            low = scale
        else:
            high = scale
        if high < LEAST * first or high <= low * (1.0 + accuracy):
            break
        if not low:
            scale = shrinks * high
        else:
            scale = 0.5 * (low + high) if high < np.inf else low * (GROWTH if low < FAR * first else 2.0)
    return low


def inscribed(region: Region, kind: Kind, centre: ArrayLike | None, proportions: ArrayLike | None) -> Inscribed:
    """The largest shape of a kind about a centre, or anywhere."""
    extents = _extents(region, kind, proportions)
    vertices = region.vertices[np.unique(region.faces)]
    if not len(vertices):
        raise InvalidArgument("workspace", "nothing within reach", "a workspace that a shape fits into")
    middle = _best_centre(region, kind, extents, vertices) if centre is None else _checked_centre(region, centre)
    whole, shell = _distance_to_faces(region, kind, extents, middle), _shell(kind, extents)

    def is_within(scale: float, _low: float, _high: float) -> bool:
        return bool(np.all(region.contains(middle + scale * shell)))

    accuracy = 1.01 * (1.0 / GIVES - 1.0)
    scale = largest_scale(is_within, accuracy, most_attempts=MOST_GIVES, first=whole, bound=whole, shrinks=GIVES)
    if not scale:
        expected = "a point with room around it: here the border is too fine for the mesh"
        raise InvalidArgument("centre", f"{middle.tolist()}", expected)
    return Inscribed(kind, middle, scale * extents, region.names, region.units)


def _extents(region: Region, kind: Kind, proportions: ArrayLike | None) -> Floats:
    """The lengths along each coordinate of the shape of size one, (d,)."""
    d = len(region.names)
    require_known("shape", [kind], ("sphere", "box", "cylinder"))
    if kind == "cylinder" and d != 3:
        raise InvalidArgument("kind", "'cylinder'", "a sphere or a box: the workspace lies in a plane")
    alike = len(set(region.units[:2] if kind == "cylinder" else region.units)) == 1
    if kind != "box" and not alike:
        raise InvalidArgument(
            "kind", f"'{kind}'", f"a box: the coordinates {', '.join(region.names)} differ in their units"
        )
    if proportions is None:
        extents = np.ones(d) if len(set(region.units)) == 1 else np.ptp(region.bounds, axis=0)
        return extents if kind != "cylinder" else np.array([extents[:2].min()] * 2 + [extents[2]])
    n = {"sphere": 0, "box": d, "cylinder": 2}[kind]
    if not n:
        raise InvalidArgument("proportions", f"{proportions!r}", "None: a sphere has but one")
    given = array("proportions", proportions, f"{n}", "positive numbers", holds=is_positive)
    return given[[0, 0, 1]] if kind == "cylinder" else given


def _checked_centre(region: Region, centre: ArrayLike) -> Floats:
    names = ", ".join(region.names)
    point = array("centre", centre, f"{len(region.names)}", note=f" within reach: {names}")
    if not region.contains(point):
        raise InvalidArgument("centre", f"{point.tolist()}", f"a point within reach: {names}")
    return point


def _scales(kind: Kind, extents: Floats, away: Floats) -> Floats:
    """The sizes of shapes whose surfaces pass through points (..., d), measured from the centre."""
    shares = 2.0 * np.abs(away) / extents
    if kind == "box":
        return np.asarray(shares.max(axis=-1))
    if kind == "sphere":
        return np.asarray(np.linalg.norm(shares, axis=-1))
    return np.maximum(np.hypot(shares[..., 0], shares[..., 1]), shares[..., 2])


def _distance_to_faces(region: Region, kind: Kind, extents: Floats, centre: Floats) -> float:
    """The size at which the shape touches the mesh, from samples of the nearest faces."""
    corners = region.vertices[region.faces]
    nearest = _scales(kind, extents, corners - centre).min(axis=1)
    chosen = np.argsort(nearest)[:NEAREST_FACES]
    d = corners.shape[1]
    shares = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, POINTS_A_SIDE)] * (d - 1), indexing="ij"), axis=-1)
    shares = shares.reshape(-1, d - 1)
    shares = shares[shares.sum(axis=1) <= 1.0 + 1e-12]
    weights = np.column_stack([1.0 - shares.sum(axis=1), shares])
    return float(_scales(kind, extents, np.einsum("kc,fcd->fkd", weights, corners[chosen]) - centre).min())


def _shell(kind: Kind, extents: Floats) -> Floats:
    """Points (n, d) on the shape of size one about zero: evenly spread directions, and those that lead to its edges."""
    d = len(extents)
    steps = np.arange(SAMPLES) + 0.5
    turn = np.pi * (1.0 + math.sqrt(5.0)) * steps
    if d == 2:
        directions = np.column_stack([np.cos(2.0 * np.pi * steps / SAMPLES), np.sin(2.0 * np.pi * steps / SAMPLES)])
    else:
        height = 1.0 - 2.0 * steps / SAMPLES
        across = np.sqrt(1.0 - height**2)
        directions = np.column_stack([across * np.cos(turn), across * np.sin(turn), height])
    ends = np.stack(np.meshgrid(*[[-1.0, 1.0]] * d, indexing="ij"), axis=-1).reshape(-1, d)
    if kind == "cylinder":
        rim = np.linspace(0.0, 2.0 * np.pi, 128, endpoint=False)
        ends = np.concatenate([np.column_stack([np.cos(rim), np.sin(rim), np.full(128, side)]) for side in (-1, 1)])
    directions = np.concatenate([directions, ends]) * extents
    return directions / _scales(kind, extents, directions)[:, None]


def _best_centre(region: Region, kind: Kind, extents: Floats, vertices: Floats) -> Floats:
    """The centre of the largest shape that a search from the best points of a grid finds."""
    vertices = vertices[:: max(1, len(vertices) // MOST_VERTICES)]
    low, high = region.bounds
    axes = [np.linspace(a, b, FIRST_GRID + 2)[1:-1] for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(low))
    inside = grid[np.asarray(region.contains(grid))]

    def size(centre: Floats) -> float:
        return float(_scales(kind, extents, vertices - centre).min())

    begins = inside if len(inside) else region._question.space.start[None]
    best = sorted(begins, key=size, reverse=True)[:LOOKED_AT]
    return max((_climbed(size, region, centre, (high - low) / FIRST_GRID) for centre in best), key=size)


def _climbed(size: Any, region: Region, centre: Floats, steps: Floats) -> Floats:
    """Improve a centre by steps along one coordinate at a time; steps are halved if none is better."""
    best = size(centre)
    for _ in range(MOST_STEPS):
        tried = [centre + sign * way for way in np.diag(steps) for sign in (1.0, -1.0)]
        sizes = [size(each) for each in tried]
        place = int(np.argmax(sizes))
        if sizes[place] > best and region.contains(tried[place]):
            centre, best = tried[place], sizes[place]
        else:
            steps = 0.5 * steps
        if (steps < 0.1 * region.resolution).all():
            break
    return centre
