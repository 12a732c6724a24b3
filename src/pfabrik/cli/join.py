"""``pfabrik join``: several machines as one, or arms that hold one object."""

from __future__ import annotations

from itertools import zip_longest
from pathlib import Path
from typing import Any

import click

import pfabrik as pf

from ..common.cells import is_finite
from .arguments import MECH, comma_separated, load
from .outputs import OUTPUT, check_outputs, force_option, refuse_existing, whole_file
from .printing import note


@click.command()
@click.argument("machines", metavar="MECH...", type=MECH, nargs=-1, required=True)
@click.option(
    "--at", "places", multiple=True, metavar="X,Y,Z[,R,P,Y]", help="Where each is [length, deg], in their order."
)
@click.option(
    "--prefix", "prefixes", multiple=True, metavar="TEXT", help="What names of each begin with, in their order."
)
@click.option("--on", metavar="BODY", help="The body of the first that all others stand on. Default: its base.")
@click.option("--hold", metavar="NAME[:CONTACT]", help="What all end effectors hold: flat, or at a point.")
@click.option("--end-effector", metavar="NAME", help="A body or a joint. Default: what is held.")
@click.option("--task", metavar="A,B,...", callback=comma_separated, help="What targets set, such as z,tilt.")
@click.option("-o", "--output", default="-", help="File to write. Default: print it.", **OUTPUT)
@force_option
def join(
    machines: tuple[str, ...],
    places: tuple[str, ...],
    prefixes: tuple[str, ...],
    on: str | None,
    hold: str | None,
    end_effector: str | None,
    task: list[str] | None,
    output: Path,
    force: bool,
) -> int:
    """Join machines, or have arms hold an object, as one mechanism file.

    Each MECH is moved as its --at says, and its names begin as its --prefix says. They stand on the base of the first,
    or on one of its bodies (--on). With --hold, the end effectors hold an object where they are at home.
    """
    refuse_existing(output, force)
    check_outputs([("-o", output)], [Path(each) for each in machines])
    for option, given in (("--at", places), ("--prefix", prefixes)):
        if len(given) > len(machines):
            raise click.UsageError(f"{option}: found {len(given)} for {len(machines)} machines; expected one for each")
    if (hold is None) == (end_effector is None):
        raise click.UsageError("expected either --hold or --end-effector: what targets place")
    carrier = None if on is None else "".join(prefixes[:1]) + on
    parts: list[pf.Mechanism] = []
    for mech, place, prefix in zip_longest(machines, places, prefixes):
        machine = load(mech)
        parts.append(machine.at(_pose(place), prefix=prefix or "", base=(carrier or parts[0].base) if parts else None))
    joined = pf.join(*parts, end_effector=str(end_effector), task=task) if hold is None else _held(parts, hold, task)
    from ..machine.files import dumps
    from .remarks import remarks_on

    for remark in remarks_on(joined):
        note(remark)
    with whole_file(output, f"; next: pfabrik info {output}") as handle:
        handle.write(dumps(joined))
    return 0


def _held(parts: list[pf.Mechanism], hold: str, task: list[str] | None) -> pf.Mechanism:
    """Machines whose end effectors hold an object where they are."""
    name, _, touch = hold.partition(":")
    from ..exchange.contacts.grasping import held_by
    from ..machine.description.contact import as_contact

    contact = as_contact("--hold", touch or "flat")
    return held_by(parts, name, [(part.home_pose, contact) for part in parts], None, task, None)


def _pose(given: str | None) -> Any:
    """The pose of three or six numbers [length, deg]; none is where the machine is described."""
    words = given.split(",") if given else ["0", "0", "0"]
    if len(words) not in (3, 6) or not all(map(is_finite, words)):
        raise click.UsageError(f"--at: found '{given}'; expected X,Y,Z or X,Y,Z,R,P,Y")
    numbers = [float(word) for word in words]
    return pf.pose(numbers[:3], rpy=numbers[3:] or (0.0, 0.0, 0.0), degrees=True)
