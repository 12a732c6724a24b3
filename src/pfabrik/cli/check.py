"""``pfabrik check``: the faults of a mechanism file, and remarks on it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator

import click
import numpy as np

import pfabrik as pf

from ..description.graph_faults import leaves
from ..description.rod_lengths import odd_rods, uneven_rods, with_lengths
from ..errors import InvalidMechanism, counted
from ..motion.fitting_task import has_dependent_coordinates, task_remark
from .arguments import MECH, load
from .info import NOT_COUNTED, counted_mobility, nearly_free
from .printing import json_option, note, print_json

FULL_TURN = 2.0 * math.pi


@click.command()
@click.argument("mech", type=MECH)
@json_option("One JSON object on stdout: faults, or what there is, and notes.")
def check(mech: str, as_json: bool) -> int:
    """Check a mechanism file.

    Says "ok", or names every fault, one a line. What is sound but may not be what was meant is noted on stderr.
    """
    try:
        mechanism = load(mech)
    except InvalidMechanism as error:
        if as_json:
            print_json({"ok": False, "faults": [dataclasses.asdict(fault) for fault in error.faults]})
        raise
    remarks = list(notes(mechanism))
    name, task = mechanism.name, mechanism.task
    joints, actuators, chains = len(mechanism.joints), len(mechanism.actuator_names), len(pf.decompose(mechanism))
    if as_json:
        counts = {"joints": joints, "actuators": actuators, "sub_chains": chains}
        print_json({"ok": True, "name": name, **counts, "task": task, "notes": remarks})
        return 0
    for remark in remarks:
        note(remark)
    parts = f"{counted(joints, 'joint')}, {actuators} actuated, {counted(chains, 'sub-chain')}"
    click.echo(f"ok: {name}: {parts}, task {' '.join(task)}")
    return 0


def notes(mechanism: pf.Mechanism) -> Iterator[str]:
    """Remarks on what a description's author may not have meant."""
    mobility = counted_mobility(mechanism)
    if mobility is None:
        yield f"freedoms are {NOT_COUNTED}: whether they suffice for the task is not known"
    else:
        if has_dependent_coordinates(mechanism):
            yield f"{task_remark(mechanism)}; hardly any target can be reached"
        yield from (f"the loops hardly resist a motion of {nearly_free(motion)}" for motion in mobility.nearly_free)
    for _, joint, body in leaves(mechanism):
        yield f"nothing but joint '{joint.name}' connects '{body}', which so plays no part in where the end effector is"
    yield from rod_notes(mechanism)
    widest = max((width for joint in mechanism.joints for width in angular_widths(joint)), default=math.nan)
    if mechanism.angle_unit == "rad" and widest > 4 * FULL_TURN:
        yield f"a range of {widest:.4g} rad is {widest / FULL_TURN:.3g} turns; were degrees meant?"
    if mechanism.angle_unit == "deg" and widest < math.radians(FULL_TURN):
        yield f"no range of an angle is wider than {math.degrees(widest):.3g} degrees; were radians meant?"


def rod_notes(mechanism: pf.Mechanism) -> Iterator[str]:
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


def angular_widths(joint: pf.Joint) -> Iterator[float]:
    """The width of each range of an angle, and of a cone from side to side [rad]."""
    if joint.cone is not None:
        yield 2.0 * joint.cone.half_angle
    if joint.range is not None and joint.type in ("revolute", "universal", "cylindrical"):
        ranges = np.reshape(joint.range, (-1, 2))[: 1 if joint.type == "cylindrical" else None]
        yield from (ranges[:, 1] - ranges[:, 0]).tolist()
