"""``pfabrik catalog``, ``new``, ``info`` and ``check``: machines and their files."""

from __future__ import annotations

import dataclasses
import os
import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.shell_completion import CompletionItem

import pfabrik as pf

from ..common.printed import aligned
from ..errors import counted
from ..machine.catalog import catalog_file, description, template, templates, title
from .arguments import MECH, load
from .outputs import OUTPUT, STANDARD, check_outputs, force_option, refuse_existing, whole_file
from .printing import json_option, note, print_answer, print_json, print_text, printing_result

if TYPE_CHECKING:
    from ..view.overview import Overview

ALIASES = {
    "hexapod": "6-UPS",
    "five-bar": "5-bar",
    "servo-hexapod": "6-RUS",
    "hexaglide": "6-PUS",
    "tripod": "3-RPS",
    "agile-eye": "spherical-3rrr",
}
"""Other names of kinds."""


@click.command()
@json_option("One JSON object on stdout.")
def catalog(as_json: bool) -> int:
    """List the mechanisms supplied.

    Each file begins with more about its mechanism: whose dimensions it has, what home is, what its joints count.
    """
    described = {name: description(name) for name in pf.catalog()}
    print_answer(as_json, lambda: described, lambda: aligned(("name", "mechanism"), described.items()))
    return 0


def complete_kind(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """The kinds that begin so."""
    return [CompletionItem(name) for name in templates() if name.lower().startswith(incomplete.lower())]


class WithDimensions(click.Command):
    """A command whose options are completed to the dimensions of KIND too."""

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """As click does, with the dimensions that begin so."""
        try:
            options = dimension_options(starting_file(ctx.params.get("kind") or ""))
        except (click.UsageError, pf.errors.PfabrikError):
            options = {}
        found = [CompletionItem(option) for option in options if incomplete and option.startswith(incomplete)]
        return found + super().shell_complete(ctx, incomplete)


@click.command(cls=WithDimensions, context_settings={"ignore_unknown_options": True, "allow_extra_args": True})
@click.argument("kind", required=False, shell_complete=complete_kind)
@click.option(
    "--from",
    "machine",
    type=MECH,
    metavar="NAME",
    help="A machine of the catalogue, or the file of one, in place of a KIND.",
)
@click.option("-o", "--output", default="-", help="File to write. Default: print it.", **OUTPUT)
@force_option
@click.option("--list", "list_all", is_flag=True, help="List the kinds of machines there are files for.")
@json_option("With --list: one JSON object on stdout.")
@click.pass_context
def new(
    ctx: click.Context, kind: str | None, machine: str | None, output: Path, force: bool, list_all: bool, as_json: bool
) -> int:
    """Write a starting file for a machine of your own.

    KIND is one of those that `pfabrik new` alone lists. The file describes a machine of this kind that works as it is.
    Its dimensions are at the top; each may be given as an option: `pfabrik new delta --rod 230 --arm 80`. With --from
    it is a machine of `pfabrik catalog`, as it is there, or one of your printer: `pfabrik new --from printer.cfg`.
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
    text = starting_file(str(kind)) if machine is None else file_of(machine)
    text = with_dimensions(text, ctx.args)
    refuse_existing(output, force)
    check_outputs([("-o", output)])
    with whole_file(output, f"; next: edit it, then pfabrik check {output}") as handle:
        handle.write(text)
    return 0


def starting_file(kind: str) -> str:
    """The text of a starting file; if only a machine of the catalogue has that name, the error says so."""
    kind = ALIASES.get(kind.lower(), kind)
    name = kind.lower().replace("-", "_")
    if kind.lower() not in map(str.lower, templates()) and name in pf.catalog():
        raise click.UsageError(f"no KIND '{kind}'; a machine of the catalogue is called so: --from {name}")
    return template(kind)


def file_of(machine: str) -> str:
    """The text of a mechanism file: one of the catalogue as it is there, or what a file describes."""
    if machine in pf.catalog() or not os.path.exists(machine):
        return catalog_file(machine).read_text(encoding="utf-8")
    from ..machine.files import dumps

    return dumps(load(machine))


def dimension_options(text: str) -> dict[str, str]:
    """Options of the dimensions of a starting file, each with its dimension: ``--arm-length``."""
    return {f"--{name.replace('_', '-')}": name for name in tomllib.loads(text).get("dimensions", {})}


def with_dimensions(text: str, options: Sequence[str]) -> str:
    """A starting file with other dimensions: options `--rod 250` or `--rod=250`, in order."""
    words = [word for option in options for word in (option.split("=", 1) if option.startswith("--") else [option])]
    if not words:
        return text
    names, numbers = words[::2], words[1::2]
    known = dimension_options(text)
    for name, number in zip(names, [*numbers, ""], strict=False):
        if not name.startswith("--"):
            raise click.UsageError(f"Got unexpected extra argument ({name})")
        dimension = known.get(name.replace("_", "-"))
        if dimension is None:
            options_of_all = ["--from", "--output", "--force", "--list", "--json"]
            raise pf.errors.UnknownName("dimension or option", name, [*known, *options_of_all])
        try:
            value = float(number)
        except ValueError:
            raise click.UsageError(f"{name}: found '{number}'; expected a number") from None
        require_sign(name, dimension, value, text)
        line = re.compile(rf"^({dimension} *= *)(\"[^\"]*\"|[^ #\n]+)( *)", re.MULTILINE)
        text = line.sub(rf"\g<1>{value:.15g}\g<3>", text, count=1)
    from ..machine.files import loads

    loads(text)
    return text


def require_sign(option: str, dimension: str, value: float, text: str) -> None:
    """Refuse a length that is not positive: a radius, or one that a file squares; note where another changes sign."""
    before = tomllib.loads(text)["dimensions"][dimension]
    if value > 0.0 or not isinstance(before, int | float) or before <= 0.0:
        return
    if dimension.endswith("radius") or re.search(rf"\b{dimension}\*\*2", text):
        raise click.UsageError(f"{option}: found {value:g}; expected a positive length")
    if value < 0.0:
        note(f"{option} {value:g} is negative; the starting file has {before:g} there")


@click.command()
@click.argument("mech", type=MECH)
@printing_result
def info(mech: str) -> Overview:
    """Show what a mechanism is made of.

    Its joints, limits, actuators, mobility and task, and its sub-chains with the engine that answers, and why.
    """
    from ..view.overview import Overview

    return Overview(load(mech))


@click.command()
@click.argument("mech", type=MECH)
@json_option("One JSON object on stdout: faults, or what there is, and notes.")
def check(mech: str, as_json: bool) -> int:
    """Check a mechanism file.

    Says "ok", or names every fault, one a line. What is sound but may not be what was meant is noted on stderr.
    """
    from ..machine.files import print_region_of
    from .remarks import remarks_on

    try:
        mechanism = load(mech)
    except pf.errors.InvalidMechanism as error:
        if as_json:
            print_json({"ok": False, "faults": [dataclasses.asdict(fault) for fault in error.faults]})
        raise
    printer = print_region_of(mech)
    remarks = [*(printer.slips if printer else ()), *remarks_on(mechanism)]
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
