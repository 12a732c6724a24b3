"""``pfabrik compile``: all kernels ahead, so that no answer has to wait for them."""

from __future__ import annotations

import time

import click

import pfabrik as pf


@click.command()
def compile() -> int:
    """Compile all kernels ahead.

    Only where they did not come compiled, as they do in a wheel, and in a clone after `make`: there is nothing to do
    then. Else each kernel is printed with the seconds it took. What Numba compiles stays in a cache, so that this is
    needed once per version; where all is there already it takes a second.
    """
    from ..kernels._shipped import COMPILES

    if not COMPILES:
        click.echo("nothing to compile: the kernels are here")
        return 0
    start = time.perf_counter()
    pf.warm_up(on_step=lambda what, seconds: click.echo(f"{seconds:6.1f} s  {what}"))
    click.echo(f"{time.perf_counter() - start:6.1f} s  in all")
    return 0
