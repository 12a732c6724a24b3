"""``pfabrik new``: a starting file for a machine of one's own."""

from __future__ import annotations

from pathlib import Path

import click
from click.shell_completion import CompletionItem

from ..answers.aligned_text import aligned
from ..catalog import catalog, catalog_file, template, templates, title
from .arguments import MECH
from .outputs import OUTPUT, STANDARD, check_outputs, force_option, refuse_existing, whole_file
from .printing import json_option, print_answer


def complete_kind(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """The kinds that begin so."""
    return [CompletionItem(name) for name in templates() if name.lower().startswith(incomplete.lower())]


@click.command()
@click.argument("kind", required=False, shell_complete=complete_kind)
@click.option("--from", "machine", type=MECH, metavar="NAME", help="A machine of the catalogue, in place of a KIND.")
@click.option("-o", "--output", default="-", help="File to write. Default: print it.", **OUTPUT)
@force_option
@click.option("--list", "list_all", is_flag=True, help="List the kinds of machines there are files for.")
@json_option("With --list: one JSON object on stdout.")
def new(kind: str | None, machine: str | None, output: Path, force: bool, list_all: bool, as_json: bool) -> int:
    """Write a starting file for a machine of your own.

    KIND is one of those that `pfabrik new` alone lists. The file describes a machine of this kind that works as it is;
    its comments say what to measure and where to put it. With --from it is a machine of `pfabrik catalog`, as it is
    there.
    """
    if as_json and not list_all:
        raise click.UsageError("--json goes with --list: a file is TOML")
    if list_all or not (kind or machine or output != STANDARD or force):
        kinds = {name: title(name) for name in templates()}
        print_answer(as_json, lambda: kinds, lambda: aligned(("kind", "machine"), kinds.items()))
        if not list_all:
            click.echo("next: pfabrik new KIND -o FILE", err=True)
        return 0
    if (kind is None) == (machine is None):
        raise click.UsageError(f"give either --from NAME or one KIND of {', '.join(templates())}")
    text = starting_file(str(kind)) if machine is None else catalog_file(machine).read_text(encoding="utf-8")
    refuse_existing(output, force)
    check_outputs([("-o", output)])
    with whole_file(output) as handle:
        handle.write(text)
    if output != STANDARD:
        click.echo(f"wrote {output}; next: edit it, then pfabrik check {output}")
    return 0


def starting_file(kind: str) -> str:
    """The text of a starting file; if only a machine of the catalogue has that name, the error says so."""
    name = kind.lower().replace("-", "_")
    if kind.lower() not in map(str.lower, templates()) and name in catalog():
        raise click.UsageError(f"no KIND '{kind}'; a machine of the catalogue is called so: --from {name}")
    return template(kind)
