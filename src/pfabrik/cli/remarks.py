"""Remarks on a sound mechanism: what its author may not have meant."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ..capabilities.dynamics.weights import lacking_masses, moving_bodies
from ..exchange.export.rod_lengths import odd_rods, uneven_rods, with_lengths
from ..machine.description.graph import leaves, next_joints, steps_from_base
from ..machine.description.home_mobility import ends_of_default_axes, universal_axes
from ..machine.description.mechanism import Joint, Mechanism
from ..machine.description.symmetry import crossed_rounds, near_copies
from ..machine.motion.fitting_task import has_weak_coordinates, task_hint, task_remark
from ..view.overview import NOT_COUNTED, counted_mobility, nearly_free, vector

FULL_TURN = 2.0 * math.pi


def remarks_on(mechanism: Mechanism) -> Iterator[str]:
    """Remarks on what a description's author may not have meant."""
    mobility = counted_mobility(mechanism)
    if mobility is None:
        yield f"freedoms are {NOT_COUNTED}: whether they suffice for the task is not known"
    else:
        if has_weak_coordinates(mechanism):
            yield f"{task_remark(mechanism)}; hardly any target can be reached"
        elif hint := task_hint(mechanism):
            yield hint
        yield from (f"the loops hardly resist a motion of {nearly_free(motion)}" for motion in mobility.nearly_free)
    for _, joint, body in leaves(mechanism):
        yield f"nothing but joint '{joint.name}' connects '{body}', which so plays no part in where the end effector is"
    yield from mass_notes(mechanism)
    yield from axes_notes(mechanism)
    yield from rod_notes(mechanism)
    yield from symmetry_notes(mechanism)
    widest = max((width for joint in mechanism.joints for width in angular_widths(joint)), default=math.nan)
    if mechanism.angle_unit == "rad" and widest > 4 * FULL_TURN:
        yield f"a range of {widest:.4g} rad is {widest / FULL_TURN:.3g} turns; were degrees meant?"
    if mechanism.angle_unit == "deg" and widest < math.radians(FULL_TURN):
        yield f"no range of an angle is wider than {math.degrees(widest):.3g} degrees; were radians meant?"


def mass_notes(mechanism: Mechanism) -> Iterator[str]:
    """The remark on bodies without a mass beside others that have one."""
    lacking = lacking_masses(mechanism)
    if 0 < len(lacking) < len(moving_bodies(mechanism)):
        yield (
            f"without a mass, while other bodies have one: {quoted(lacking)}; `mass = 0` says of a body that it weighs "
            "nothing"
        )


def axes_notes(mechanism: Mechanism) -> Iterator[str]:
    """Remarks on universal joints whose axes are left out, and do not follow from where the joints beyond them are."""
    steps = steps_from_base(mechanism)
    for joint in mechanism.joints:
        if joint.type != "universal" or joint.axes is not None:
            continue
        lines, _ = ends_of_default_axes(mechanism, joint)
        body = max(joint.connects, key=lambda each: steps.get(each, 0))
        if not lines or (
            body != mechanism.end_effector_body and lines[0] not in next_joints(mechanism.joints, joint, body)
        ):
            axes = " and ".join(map(vector, universal_axes(mechanism, joint)))
            yield (
                f"universal joint '{joint.name}' has no `axes`, and the joints beyond it are not on one line with it, "
                f"which would tell them: {axes} are taken"
            )


def rod_notes(mechanism: Mechanism) -> Iterator[str]:
    """Remarks on rods that are not as long as those beside them, or as those of other legs."""
    unit = mechanism.length_unit
    for rods in uneven_rods(mechanism):
        first, last = rods[0].between
        yield (
            f"rods {with_lengths(rods, unit)} are side by side between '{first}' and '{last}', and differ in length: "
            "what they hold tilts as it moves"
        )
    for odd, like in odd_rods(mechanism):
        name = "rod" if len(odd) == 1 else "rods"
        length = f"{like[0].length:.9g} {unit}"
        yield f"{name} {with_lengths(odd, unit)}: the {len(like)} others alike are {length} long"


def symmetry_notes(mechanism: Mechanism) -> Iterator[str]:
    """Remarks on joints that are nearly copies of others, and on numbered ones that go round the other way."""
    for slip in near_copies(mechanism):
        turn = f"a turn of {math.degrees(slip.angle):.6g} deg about {vector(slip.axis)} through {vector(slip.centre)}"
        away = f"{slip.distance:.4g} {mechanism.length_unit}"
        yield (
            f"joint '{slip.joint}' is {away} off the place where {turn} takes joint '{slip.like}'; "
            f"{slip.n_exact} of {slip.n_joints} joints fall onto each other by such turns"
        )
    for one, other in crossed_rounds(mechanism):
        yield (
            f"joints {quoted(one.names)} go round {vector(one.axis)}, and {quoted(other.names)} round "
            f"{vector(other.axis)}: they share bodies, which so are no copies of each other"
        )


def quoted(names: Sequence[str]) -> str:
    """Names with marks, commas between."""
    return ", ".join(f"'{name}'" for name in names)


def angular_widths(joint: Joint) -> Iterator[float]:
    """The width of each range of an angle, and of a cone from side to side [rad]."""
    if joint.cone is not None:
        yield 2.0 * joint.cone.half_angle
    if joint.range is not None and joint.type in ("revolute", "universal", "cylindrical"):
        ranges = np.reshape(joint.range, (-1, 2))[: 1 if joint.type == "cylindrical" else None]
        yield from (ranges[:, 1] - ranges[:, 0]).tolist()
