"""``pfabrik info``: what a mechanism is made of and how it is solved."""

from __future__ import annotations

import click

from .arguments import MECH, load
from .printing import json_option, print_answer


@click.command()
@click.argument("mech", type=MECH)
@json_option()
def info(mech: str, as_json: bool) -> int:
    """Show what a mechanism is made of.

    Its joints, limits, actuators, mobility and task, and its sub-chains with the engine that answers, and why.
    """
    from .info_report import as_object, describe

    mechanism = load(mech)
    print_answer(as_json, lambda: as_object(mechanism), lambda: describe(mechanism))
    return 0
