"""The links of a mechanism as solids, the pairs of them that may touch, and those that do at home."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints
from ...common.derived import derived
from ...errors import Fault, InvalidMechanism
from ...tolerances import TOLERANCES
from ..meshes import MeshHull, UnusableMesh, hull_of, middle_of, sizes_of
from .body_shapes import Shape
from .graph import joints_with_centre, sliding_along, welded
from .joints import Joint
from .structure import Structure

MOST_PAIRS = 500
"""Most pairs of links that searches keep apart: each is a row of their programmes."""


class Links(NamedTuple):
    """The shapes of a mechanism as `kernels.clearance` takes them.

    Attributes
    ----------
    sizes : (s, 5), or longer rows where there are meshes [length]; places : at home, (s, 4, 3): see
        `kernels.clearance.solids`.
    joints : names of the two joints that a capsule is between; empty for a shape that moves with its body.
    pairs : indices of two shapes each, (k, 2), those of two capsules first; n_capsules : how many these are.
    """

    sizes: Floats
    places: Floats
    joints: tuple[tuple[str, ...], ...]
    pairs: Ints
    n_capsules: int


@derived
def links_of(mechanism: Structure) -> Links:
    """The links of a mechanism whose description has no faults."""
    from ...kernels.clearance.solids import WIDTH

    joints = tuple(_joints_of(mechanism, shape) for shape in mechanism.shapes)
    hulls = hulls_of(mechanism)
    rows = {k: sizes_of(hull, mechanism.shapes[k].scale or 1.0) for k, hull in hulls.items()}
    sizes = np.zeros((len(joints), max([WIDTH, *map(len, rows.values())])))
    places = np.zeros((len(joints), 4, 3))
    for k, (shape, ends) in enumerate(zip(mechanism.shapes, joints, strict=True)):
        if k in rows:
            sizes[k, : len(rows[k])] = rows[k]
            _place_hull(shape, hulls[k], places[k])
        else:
            _put(shape, [mechanism.joint(name).at for name in ends], sizes[k], places[k])
    pairs = _pairs(mechanism, joints)
    pairs = pairs[np.argsort(sizes[pairs, 0].any(axis=1), kind="stable")]
    n_capsules = int(np.count_nonzero(~sizes[pairs, 0].any(axis=1)))
    return Links(sizes, places, joints, pairs, n_capsules)


@derived
def hulls_of(mechanism: Structure) -> dict[int, MeshHull]:
    """The hulls of meshes, by the places of their shapes, as their files were when the mechanism was made."""
    hulls = {}
    for k, shape in enumerate(mechanism.shapes):
        if shape.file is not None:
            try:
                hulls[k] = hull_of(shape.file)
            except UnusableMesh as error:  # the file was changed since: of a mechanism that was copied, or sent
                raise InvalidMechanism([Fault(f"body[{k}].file", error.found, error.expected)]) from None
    return hulls


def scaled_sizes(links: Links, scale: float) -> Floats:
    """The sizes of links in another unit; how many parts a hull has, where its faces point, and what is beside an edge
    stay."""
    from ...kernels.clearance.solids import HULL, KIND, REACH, ROUND, VERTICES, A

    sizes = links.sizes.copy()
    for row in sizes:
        if row[KIND] == HULL:
            row[[ROUND, REACH]] *= scale
            row[VERTICES : VERTICES + 3 * int(row[A])] *= scale
        else:
            row[ROUND:] *= scale
    return sizes


def has_pairs(mechanism: Structure) -> bool:
    """True if some links have a thickness and may touch."""
    return bool(mechanism.shapes) and len(links_of(mechanism).pairs) > 0


def _joints_of(mechanism: Structure, shape: Shape) -> tuple[str, ...]:
    if shape.kind != "capsule" or shape.ends is not None:
        return ()
    return shape.between or tuple(joint.name for joint in joints_with_centre(mechanism, shape.body))


def bodies_of_centre(joint: Joint) -> tuple[str, ...]:
    """The bodies that the centre of a joint is a point of: the first one alone where the joint slides."""
    return joint.connects[:1] if joint.type in ("prismatic", "cylindrical") else joint.connects


NOWHERE = 2**31
"""The number of a body that has none."""


def ends_on(mechanism: Structure, numbers: Mapping[str, int]) -> Ints:
    """The numbers of the bodies that both ends of every shape move with, (shapes, 2); NOWHERE for bodies without one.

    They are twice the same, but for capsules between two joints: an end moves with any body that the joint's centre is
    a point of, here that of the least number.
    """
    ends = (_joints_of(mechanism, shape) for shape in mechanism.shapes)
    on = [
        [bodies_of_centre(mechanism.joint(name)) for name in each] or [(shape.body,)] * 2
        for shape, each in zip(mechanism.shapes, ends, strict=True)
    ]
    found = [[min(numbers.get(body, NOWHERE) for body in end) for end in each] for each in on]
    return np.array(found, np.int64).reshape(-1, 2)


def _put(shape: Shape, ends: list[Any], sizes: Floats, place: Floats) -> None:
    """Fill the sizes and the place of a shape other than a mesh."""
    from ...kernels.clearance.solids import BOX, CAPSULE, DISC, KIND, ROUND, A, B

    if shape.kind == "capsule":
        sizes[KIND], sizes[ROUND] = CAPSULE, 0.5 * shape.thickness
        place[:2] = ends or shape.ends
        return
    place[0], half = shape.at, 0.5 * (shape.diameter or 0.0)
    if shape.kind == "sphere":
        sizes[KIND], sizes[ROUND], place[1] = CAPSULE, half, shape.at
    elif shape.kind == "disc":
        sizes[KIND], sizes[A], sizes[B], place[1] = DISC, half, 0.5 * shape.thickness, shape.axis
    else:
        sizes[KIND], sizes[A : A + 3] = BOX, 0.5 * np.array(shape.size)
        place[1:] = _axes_of(shape)


def _place_hull(shape: Shape, hull: MeshHull, place: Floats) -> None:
    """Fill the place of a mesh: the middle of its hull, and the axes of its file."""
    axes = _axes_of(shape)
    place[0] = np.array(shape.at or (0.0, 0.0, 0.0)) + (shape.scale or 1.0) * middle_of(hull) @ axes
    place[1:] = axes


def _axes_of(shape: Shape) -> Floats:
    """The three axes of a box or a mesh, (3, 3), one a row."""
    x, y = np.array(shape.axes or ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
    y = y - (y @ x) * x
    y = y / np.linalg.norm(y)
    return np.array([x, y, np.cross(x, y)])


def _pairs(mechanism: Structure, ends: tuple[tuple[str, ...], ...]) -> Ints:
    """Pairs of shapes that may touch, (k, 2): not of one body, nor of two that share a joint, nor of two ignored.

    Bodies that a fixed joint holds together are one. Joints in one place of one body are as one: so the two struts
    of a double ball joint share it.
    """
    rigid = welded([joint for joint in mechanism.joints if joint.is_rigid], mechanism.base)
    ignored = {frozenset(pair) for pair in mechanism.ignore}
    of_shapes = [frozenset(_bodies_of(mechanism, *each)) for each in zip(mechanism.shapes, ends, strict=True)]
    own = list(dict.fromkeys(of_shapes))  # many shapes may be of one body
    as_one = [{rigid.get(body, body) for body in bodies} for bodies in own]
    around = [_neighbours(mechanism, bodies, rigid) for bodies in as_one]
    near = TOLERANCES.home_slack * mechanism.characteristic_length
    may_touch = np.zeros((len(own), len(own)), bool)
    for i, j in combinations(range(len(own)), 2):
        if as_one[i] & as_one[j] or any(frozenset((a, b)) in ignored for a in own[i] for b in own[j]):
            continue
        if any(body in as_one[j] for body, _ in around[i]) or any(
            body == other and at is not None and place is not None and np.linalg.norm(at - place) <= near
            for body, at in around[i]
            for other, place in around[j]
        ):
            continue
        may_touch[i, j] = may_touch[j, i] = True
    index = [own.index(bodies) for bodies in of_shapes]
    return np.argwhere(np.triu(may_touch[np.ix_(index, index)], 1))


def _bodies_of(mechanism: Structure, shape: Shape, names: tuple[str, ...]) -> set[str]:
    """The bodies that a shape belongs to: of a strut both of its parts."""
    along = sliding_along(mechanism, shape.body)
    return {shape.body} | {body for name in names for body in mechanism.joint(name).connects if body in along}


def _neighbours(mechanism: Structure, bodies: set[str], rigid: dict[str, str]) -> list[tuple[str, Floats | None]]:
    """Bodies that a joint connects with some, and where."""
    found: list[tuple[str, Floats | None]] = []
    for joint in mechanism.joints:
        first, second = (rigid.get(body, body) for body in joint.connects)
        at = None if joint.at is None else np.array(joint.at)
        if first in bodies and second not in bodies:
            found.append((second, at))
        elif second in bodies and first not in bodies:
            found.append((first, at))
    return found


def collisions_at_home(mechanism: Structure) -> Iterator[Fault]:
    """The pairs of links that overlap at home, or are nearer than the clearance, the worst first."""
    links, least = links_of(mechanism), mechanism.clearance or 0.0
    if mechanism.clearance is not None and not 0 < len(links.pairs) <= MOST_PAIRS:
        found = (
            f"{len(links.pairs)} pairs of links that may touch" if len(links.pairs) else "no two links that may touch"
        )
        expected = f"at most {MOST_PAIRS}: name others in `ignore`" if len(links.pairs) else "links with a thickness"
        yield Fault("clearance", found, expected)
        return
    for distance, first, second in overlaps_at_home(mechanism):
        how = f"{-distance:.4g} deep in" if distance < 0.0 else f"{distance:.4g} from"
        found = f"'{mechanism.shapes[second].body}', which is {how} '{mechanism.shapes[first].body}' at home"
        apart = f"that are at least {least:.4g} apart" if least > 0.0 else "that do not overlap"
        yield Fault(f"body[{second}]", found, f"links {apart} at home; or name the pair in `ignore`")


def overlaps_at_home(mechanism: Structure) -> list[tuple[float, int, int]]:
    """Distances [length] at home of two shapes each that are nearer than the clearance, or overlap; the worst first."""
    from ...kernels.clearance.least_clearance import least_clearance

    links, least = links_of(mechanism), mechanism.clearance or 0.0
    clearance, nearest, points = np.empty(1), np.empty(1, np.int64), np.empty((1, 2, 3))
    overlaps: list[tuple[float, int, int]] = []
    for pair in links.pairs:
        clearance[0], nearest[0] = np.inf, -1
        least_clearance(links.sizes, links.places[None], pair[None], 0, clearance, nearest, points)
        if clearance[0] < least - TOLERANCES.home_slack * mechanism.characteristic_length:
            overlaps.append((float(clearance[0]), int(pair[0]), int(pair[1])))
    return sorted(overlaps)


def bodies_of_shapes(mechanism: Structure) -> list[set[str]]:
    """The bodies that each shape belongs to: of a strut both of its parts."""
    shapes = zip(mechanism.shapes, links_of(mechanism).joints, strict=True)
    return [_bodies_of(mechanism, shape, names) for shape, names in shapes]
