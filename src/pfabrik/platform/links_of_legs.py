"""The links that searches in the platform's pose keep apart."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..closure.links_on_paths import link_limits
from ..decomposition.leg_forms import Rod
from ..derived import derived
from ..description.graph import welded
from ..description.links import bodies_of_centre, links_of
from ..kernels.clearance.link_records import BASE, NO_LINKS, PLATFORM, LinkLimits
from ..kernels.legs import records as K
from ..model import Model


def keeps_links(model: Model) -> bool:
    """True if searches in the platform's pose keep all links apart; else those in joint coordinates do."""
    return model.mechanism.clearance is None or _bodies(model) is not None


@derived
def links_of_legs(model: Model) -> LinkLimits:
    """The links of a machine of legs whose places follow from poses and proximal joints; none without a clearance."""
    bodies = None if model.mechanism.clearance is None else _bodies(model)
    return NO_LINKS if bodies is None else link_limits(model.mechanism, np.array(bodies, np.int64))


@derived
def _bodies(model: Model) -> list[tuple[int, int]] | None:
    """The numbers of the bodies that both ends of every link move with; None where some have none."""
    found = [
        (first, second) for first, second in bodies_of_link_ends(model) if first is not None and second is not None
    ]
    return found if len(found) == len(bodies_of_link_ends(model)) else None


@derived
def bodies_of_link_ends(model: Model) -> list[tuple[int | None, int | None]]:
    """The numbers of the bodies that both ends of every link move with; None for bodies that have none."""
    mechanism = model.mechanism
    links, numbers = links_of(mechanism), dict(_numbers(model))
    rigid = welded([joint for joint in mechanism.joints if joint.is_rigid], mechanism.base)

    def of_body(body: str) -> int | None:
        return numbers.get(rigid.get(body, body))

    def of_joint(name: str) -> int | None:
        if name == mechanism.end_effector and mechanism.end_effector_is_joint:
            return PLATFORM
        known = [number for body in bodies_of_centre(mechanism.joint(name)) if (number := of_body(body)) is not None]
        return known[0] if known else None

    ends = []
    for shape, joints in zip(mechanism.shapes, links.joints, strict=True):
        first, second = map(of_joint, joints) if joints else (of_body(shape.body), of_body(shape.body))
        ends.append((first, second))
    return ends


def _numbers(model: Model) -> Iterator[tuple[str, int]]:
    """Bodies, welded ones as one, with their numbers: the base, the platform, cranks and carriages on the base."""
    mechanism, table = model.mechanism, model.legs
    if len(table.redundant):
        return
    rigid = welded([joint for joint in mechanism.joints if joint.is_rigid], mechanism.base)
    for number, (form, leg) in enumerate(zip(table.forms, table.legs, strict=True)):
        is_on_base = leg["frame"] == K.FROM_BASE and not leg["reversed"]
        if isinstance(form, Rod) and form.proximal is not None and is_on_base and not form.is_shared:
            yield rigid.get(form.proximal.outward, form.proximal.outward), number
    yield rigid.get(mechanism.base, mechanism.base), BASE
    if not mechanism.end_effector_is_joint:
        yield rigid.get(mechanism.end_effector, mechanism.end_effector), PLATFORM
