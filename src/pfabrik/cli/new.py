"""``pfabrik new``: a starting file for a machine of one's own."""

from __future__ import annotations

import json
from pathlib import Path

import click
from click.shell_completion import CompletionItem

from ..answers.aligned_text import aligned
from ..catalog import catalog, catalog_file, template, templates, title
from .mech import MECH
from .outputs import OUTPUT, STANDARD, check_outputs, refuse_existing
from .whole import whole_file


def kinds_completed(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """The kinds that begin so."""
    return [CompletionItem(name) for name in templates() if name.lower().startswith(incomplete.lower())]


@click.command()
@click.argument("kind", required=False, shell_complete=kinds_completed)
@click.option("--from", "machine", type=MECH, metavar="NAME", help="A machine of the catalogue, in place of a KIND.")
@click.option("-o", "--output", default="-", help="File to write. Default: print it.", **OUTPUT)
@click.option("--force", is_flag=True, help="Replace the file if it exists.")
@click.option("--list", "list_all", is_flag=True, help="List the kinds of machines there are files for.")
@click.option("--json", "as_json", is_flag=True, help="With --list: one JSON object on stdout.")
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
        click.echo(json.dumps(kinds) if as_json else aligned(("kind", "machine"), kinds.items()))
        if not list_all:
            click.echo("next: pfabrik new KIND -o FILE", err=True)
        return 0
    if (kind is None) == (machine is None):
        raise click.UsageError(f"give either --from NAME or one KIND of {', '.join(templates())}")
    text = text_of(kind) if machine is None else catalog_file(machine).read_text(encoding="utf-8")
    refuse_existing(output, force)
    check_outputs([("-o", output)])
    with whole_file(output) as handle:
        handle.write(text)
    if output != STANDARD:
        click.echo(f"wrote {output}; next: edit it, then pfabrik check {output}")
    return 0


def text_of(kind: str | None) -> str:
    """The text of a starting file; where there is none of that name, but a machine of the catalogue, it says so."""
    name = str(kind)
    spelt = name.lower().replace("-", "_")
    if name.lower() not in map(str.lower, templates()) and spelt in catalog():
        raise click.UsageError(f"no KIND '{name}'; a machine of the catalogue is called so: --from {spelt}")
    return template(name)
