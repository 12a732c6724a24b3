"""``pfabrik check``: the faults of a mechanism file, and remarks on it."""

from __future__ import annotations

import dataclasses

import click

import pfabrik as pf

from ..errors import InvalidMechanism, counted
from .arguments import MECH, load
from .printing import json_option, note, print_json, print_text


@click.command()
@click.argument("mech", type=MECH)
@json_option("One JSON object on stdout: faults, or what there is, and notes.")
def check(mech: str, as_json: bool) -> int:
    """Check a mechanism file.

    Says "ok", or names every fault, one a line. What is sound but may not be what was meant is noted on stderr.
    """
    from .check_remarks import remarks_on

    try:
        mechanism = load(mech)
    except InvalidMechanism as error:
        if as_json:
            print_json({"ok": False, "faults": [dataclasses.asdict(fault) for fault in error.faults]})
        raise
    remarks = list(remarks_on(mechanism))
    name, task = mechanism.name, mechanism.task
    joints, actuators, chains = len(mechanism.joints), len(mechanism.actuator_names), len(pf.decompose(mechanism))
    if as_json:
        counts = {"joints": joints, "actuators": actuators, "sub_chains": chains}
        print_json({"ok": True, "name": name, **counts, "task": task, "notes": remarks})
        return 0
    for remark in remarks:
        note(remark)
    parts = f"{counted(joints, 'joint')}, {actuators} actuated, {counted(chains, 'sub-chain')}"
    print_text(f"ok: {name}: {parts}, task {' '.join(task)}")
    return 0
