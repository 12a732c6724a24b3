"""``pfabrik check``: is this mechanism file right?"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import click
import numpy as np

import pfabrik as pf

from ..description.graph_faults import leaves
from ..description.rod_lengths import odd_rods, uneven_rods, with_lengths
from ..errors import InvalidMechanism, counted
from ..motion.fitting_task import has_dependent_coordinates, task_remark
from .info import NOT_COUNTED, counted_mobility, nearly_free
from .mech import MECH, load

if TYPE_CHECKING:
    from ..description.mechanism import Joint, Mechanism

FULL_TURN = 2.0 * math.pi


@click.command()
@click.argument("mech", type=MECH)
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout: faults, or what there is, and notes.")
def check(mech: str, as_json: bool) -> int:
    """Check a mechanism file.

    Says "ok", or names every fault, one a line. What is sound but may not be what was meant is noted on stderr.
    """
    try:
        mechanism = load(mech)
    except InvalidMechanism as error:
        if as_json:
            click.echo(json.dumps({"ok": False, "faults": [dataclasses.asdict(fault) for fault in error.faults]}))
        raise
    chains, noted = pf.decompose(mechanism), list(notes(mechanism))
    if as_json:
        counts = {
            "joints": len(mechanism.joints),
            "actuators": len(mechanism.actuator_names),
            "sub_chains": len(chains),
        }
        found = {"ok": True, "name": mechanism.name, **counts, "task": mechanism.task, "notes": noted}
        click.echo(json.dumps(found))
        return 0
    for note in noted:
        click.echo(f"pfabrik: note: {note}", err=True)
    click.echo(
        f"ok: {mechanism.name}: {counted(len(mechanism.joints), 'joint')}, {len(mechanism.actuator_names)} actuated, "
        f"{counted(len(chains), 'sub-chain')}, task {' '.join(mechanism.task)}"
    )
    return 0


def notes(mechanism: Mechanism) -> Iterator[str]:
    """What a description says that its author may not have meant."""
    mobility = counted_mobility(mechanism)
    if mobility is None:
        yield f"freedoms are {NOT_COUNTED}: whether they suffice for the task is not known"
    else:
        yield from task_notes(mechanism)
        yield from (f"the loops hardly resist a motion of {nearly_free(each)}" for each in mobility.nearly_free)
    for _, joint, body in leaves(mechanism):
        yield f"nothing but joint '{joint.name}' connects '{body}', which so plays no part in where the end effector is"
    yield from rod_notes(mechanism)
    widths = [width for joint in mechanism.joints for width in angular_widths(joint)]
    if widths and mechanism.angle_unit == "rad" and max(widths) > 4 * FULL_TURN:
        yield f"a range of {max(widths):.4g} rad is {max(widths) / FULL_TURN:.3g} turns; were degrees meant?"
    if widths and mechanism.angle_unit == "deg" and max(widths) < math.radians(FULL_TURN):
        yield f"no range of an angle is wider than {math.degrees(max(widths)):.3g} degrees; were radians meant?"


def rod_notes(mechanism: Mechanism) -> Iterator[str]:
    """Rods that are not as long as those beside them, or as those of other legs."""
    unit = mechanism.length_unit
    for rods in uneven_rods(mechanism):
        first, last = rods[0].between
        yield (
            f"rods {with_lengths(rods, unit)} are side by side between '{first}' and '{last}', and differ in length: "
            "what they hold tilts as it moves"
        )
    for odd, others in odd_rods(mechanism):
        what = "rod" if len(odd) == 1 else "rods"
        length = f"{others[0].length:.9g} {unit}"
        yield f"{what} {with_lengths(odd, unit)}: the {len(others)} others alike are {length} long"


def task_notes(mechanism: Mechanism) -> Iterator[str]:
    """That a task asks for more than the end effector can do."""
    if has_dependent_coordinates(mechanism):
        yield f"{task_remark(mechanism)}; hardly any target can be reached"


def angular_widths(joint: Joint) -> Iterator[float]:
    """How wide each range of an angle is, and a cone from side to side [rad]."""
    if joint.cone is not None:
        yield 2.0 * joint.cone.half_angle
    if joint.range is not None and joint.type in ("revolute", "universal", "cylindrical"):
        ranges = np.reshape(joint.range, (-1, 2))[: 1 if joint.type == "cylindrical" else None]
        yield from (ranges[:, 1] - ranges[:, 0]).tolist()
