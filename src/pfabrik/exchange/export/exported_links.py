"""Links as an exported file keeps them apart: on the bodies that it places."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...engines.joints.placed_links import link_limits
from ...errors import UnsupportedMechanism
from ...kernels.clearance.link_records import LinkLimits
from ...kernels.clearance.solids import BOX, CAPSULE, DISC, KIND
from ...kinematics import links_of
from ...machine.description.mechanism import Mechanism
from ...machine.moved_bodies import BASE, Motion, MovedBodies


class ExportedLinks(NamedTuple):
    """The links of a machine, and the pairs that stay apart.

    Attributes
    ----------
    limits : in L; `bodies` are those of the motions, as `MovedBodies` numbers them.
    names : of the bodies of each pair.
    """

    motions: list[Motion]
    limits: LinkLimits
    names: list[tuple[str, str]]


def exported_links(mechanism: Mechanism, bodies: MovedBodies) -> ExportedLinks | None:
    """The links of a mechanism with a clearance; None without one.

    Parameters
    ----------
    bodies : of the mechanism; those that links are on are numbered.

    Raises
    ------
    UnsupportedMechanism : the place of some link follows from no coordinates of legs, or its shape has no code here.
    """
    if mechanism.clearance is None:
        return None
    links = links_of(mechanism)
    used = np.unique(links.pairs).tolist()
    reasons = [reason for solid in used for reason in _faults(mechanism, solid, bodies)]
    if reasons:
        raise UnsupportedMechanism(mechanism.name, reasons, "exported with its clearance")
    ends = np.full((len(links.sizes), 2), BASE)
    for solid in used:
        ends[solid] = _bodies_of(mechanism, solid, bodies)
    names = [(mechanism.shapes[i].body, mechanism.shapes[j].body) for i, j in links.pairs.tolist()]
    return ExportedLinks(bodies.motions, link_limits(mechanism, ends, 0.0), names)


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
