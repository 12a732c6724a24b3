"""``pfabrik view``: a machine in the browser."""

from __future__ import annotations

import webbrowser
from pathlib import Path

import click

import pfabrik as pf

from ..checks import require_ending
from .arguments import MECH, STANDARD_INPUT, load
from .outputs import check_outputs
from .printing import note


@click.command()
@click.argument("mech", type=MECH)
@click.option("--track", "path", type=click.Path(path_type=Path), metavar="PATH", help="A path of targets to play.")
@click.option("--port", type=click.IntRange(1, 65535), default=8080, show_default=True, help="Or the next free one.")
@click.option("--host", default="127.0.0.1", show_default=True, help="0.0.0.0 lets other computers in.")
@click.option("--no-browser", is_flag=True, help="Print the address only.")
@click.option("--html", type=click.Path(path_type=Path), metavar="FILE", help="Write a page of its own, and leave.")
def view(mech: str, path: Path | None, port: int, host: str, no_browser: bool, html: Path | None) -> int:
    """Show a machine in the browser: drag its target, drive its actuators, see what stops it.

    The page comes from this computer, is shown to this computer alone unless --host says otherwise, and needs no
    network. A file is read again whenever it changes. It ends with Ctrl-C.

    --html writes what is shown as one file, which opens in any browser without this program.
    """
    if html is not None:
        check_outputs([("--html", html)], [Path(mech), *([path] if path else [])])
        require_ending(html, (".html", ".htm"))
    shown: str | pf.Mechanism | pf.Track = mech
    if mech == STANDARD_INPUT or path is not None:
        shown = mechanism = load(mech)
    if path is not None:
        shown = pf.track(mechanism, pf.read_path(path, mechanism).targets)
    with pf.view(shown, port=port, host=host) as viewer:
        if html is not None:
            viewer.save(html)
            click.echo(f"wrote {html}")
            return 0
        if viewer.port != port:
            note(f"port {port} is taken: served at {viewer.port} instead")
        click.echo(f"{viewer.mechanism.name} at {viewer.url} (Ctrl-C ends it)")
        if not no_browser:
            webbrowser.open(viewer.url)
        viewer.wait()
    return 0
