"""The links that searches in the platform's pose keep apart."""

from __future__ import annotations

from collections.abc import Iterator

from ...common.arrays import Ints
from ...common.derived import derived
from ...kernels.clearance.link_records import BASE, NO_LINKS, PLATFORM, LinkLimits
from ...kernels.legs import records as K
from ...machine.decomposition.leg_forms import Rod
from ...machine.description.graph import welded
from ...machine.description.links import NOWHERE, ends_on, links_of
from ...machine.model import Model
from ..joints.placed_links import link_limits


def keeps_links(model: Model) -> bool:
    """True if searches in the platform's pose keep all links apart; else those in joint coordinates do."""
    return model.mechanism.clearance is None or bool((bodies_of_link_ends(model) != NOWHERE).all())


@derived
def links_of_legs(model: Model) -> LinkLimits:
    """The links of a machine of legs whose places follow from poses and proximal joints; none without a clearance."""
    if model.mechanism.clearance is None or not keeps_links(model):
        return NO_LINKS
    return link_limits(model.mechanism, bodies_of_link_ends(model))


@derived
def bodies_of_link_ends(model: Model) -> Ints:
    """The numbers of the bodies that both ends of every link move with, (s, 2); NOWHERE for bodies that have none."""
    mechanism, numbers = model.mechanism, dict(_numbers(model))
    rigid = welded([joint for joint in mechanism.joints if joint.is_rigid], mechanism.base)
    bodies = {body: numbers[rigid.get(body, body)] for body in mechanism.bodies if rigid.get(body, body) in numbers}
    ends = ends_on(mechanism, bodies)
    for shape, joints in enumerate(links_of(mechanism).joints):
        if mechanism.end_effector_is_joint and mechanism.end_effector in joints:
            ends[shape, joints.index(mechanism.end_effector)] = PLATFORM
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
