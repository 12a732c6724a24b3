"""The links of a machine as they are exported: solids on bodies, and the pairs that stay apart."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from ..arrays import Floats
from ..description.links import links_of
from ..description.mechanism import Mechanism
from ..errors import UnsupportedMechanism
from ..kernels.clearance.solids import BOX, CAPSULE, DISC, KIND
from ..kernels.legs import records as K
from .moved_bodies import Motion, MovedBodies


class ExportedSolid(NamedTuple):
    """A solid on one body, or a capsule between points of two.

    Attributes
    ----------
    sizes, place : at home, as in `kernels.clearance.solids` [length].
    bodies : the numbers of the bodies of its first point and of its second.
    """

    sizes: Floats
    place: Floats
    bodies: tuple[int, int]


class ExportedLinks(NamedTuple):
    """The pairs of links that stay apart.

    Attributes
    ----------
    clearance : the least distance of a pair [length].
    pairs : the places of two solids each, and the names of their bodies.
    has_solids : True if some are no capsules.
    """

    clearance: float
    motions: list[Motion]
    solids: list[ExportedSolid]
    pairs: list[tuple[int, int, tuple[str, str]]]
    has_solids: bool


def exported_links(mechanism: Mechanism) -> ExportedLinks | None:
    """The links of a mechanism with a clearance; None without one.

    Raises
    ------
    UnsupportedMechanism : the place of some link follows from no coordinates of legs, or its shape has no code here.
    """
    if mechanism.clearance is None:
        return None
    links, bodies = links_of(mechanism), MovedBodies(mechanism)
    used = sorted(set(links.pairs.ravel().tolist()))
    places = {solid: place for place, solid in enumerate(used)}
    reasons = [reason for solid in used for reason in _faults(mechanism, solid, bodies)]
    if reasons:
        raise UnsupportedMechanism(mechanism.name, reasons, "exported with its clearance")
    solids = [
        ExportedSolid(links.sizes[solid], links.places[solid], _bodies_of(mechanism, solid, bodies)) for solid in used
    ]
    names = [shape.body for shape in mechanism.shapes]
    pairs = [(places[i], places[j], (names[i], names[j])) for i, j in links.pairs.tolist()]
    return ExportedLinks(mechanism.clearance, bodies.motions, solids, pairs, links.n_capsules < len(pairs))


WHAT_TO_DO = "or name its pairs in `ignore`, or export without the part 'limits'"


def _faults(mechanism: Mechanism, solid: int, bodies: MovedBodies) -> Iterator[str]:
    """The reason why a solid cannot be exported, if there is one."""
    links, shape = links_of(mechanism), mechanism.shapes[solid]
    if int(links.sizes[solid, KIND]) not in (CAPSULE, BOX, DISC):
        yield f"body '{shape.body}' is a {shape.kind}, which has no code here: give it another shape, {WHAT_TO_DO}"
        return
    for name in links.joints[solid]:
        if bodies.of_centre(mechanism.joint(name)) is None:
            yield (
                f"body '{shape.body}' ends at joint '{name}', whose place follows from no leg: name other joints in "
                f"`between`, {WHAT_TO_DO}"
            )
    if not links.joints[solid] and not bodies.is_placed(shape.body) and bodies.along_rod(solid) is None:
        yield (
            f"body '{shape.body}' turns in ways that no leg has in closed form: name two joints in `between`, or put "
            f"its shape on the line of its rod, {WHAT_TO_DO}"
        )


def _bodies_of(mechanism: Mechanism, solid: int, bodies: MovedBodies) -> tuple[int, int]:
    joints = links_of(mechanism).joints[solid]
    if not joints:
        body = mechanism.shapes[solid].body
        number = bodies.number(body) if bodies.is_placed(body) else bodies.along_rod(solid)
        assert number is not None
        return number, number
    first, second = (bodies.of_centre(mechanism.joint(name)) for name in joints)
    assert first is not None
    assert second is not None
    return first, second


def angles_needed(links: ExportedLinks | None, leg: int, start: int) -> bool:
    """True if angles of an end of a rod place links; `start` is the first place of that end's angles."""
    return links is not None and any(
        motion.leg == leg and start <= motion.place < start + 3 and start in (K.BASE_END, K.PLATFORM_END)
        for motion in links.motions
    )
