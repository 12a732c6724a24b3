"""``pfabrik plot`` and ``view``: a picture of a machine, and a machine in the browser."""

from __future__ import annotations

import webbrowser
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import click

import pfabrik as pf

from .arguments import FINITE, MECH, TargetOptions, load, named_joints, targeted
from .options import STANDARD_INPUT, joints_option, together
from .outputs import PictureOptions, check_outputs, pictured, require_format, say_wrote, write_picture
from .printing import note


@dataclass(frozen=True)
class TorqueMap:
    """A torque map: of which joints, and by which torque of every actuator."""

    joints: tuple[str, ...]
    torque: float

    def draw(self, mechanism: pf.Mechanism) -> Any:
        """Draw it; of the passive joints in series, if none are named."""
        from ..kinematics import passive_series

        names = self.joints or passive_series(mechanism)
        if not names:
            raise click.UsageError("--torque-map: no passive joints in series from base to end effector; give --joints")
        return pf.actuation(mechanism, names).plot_torques(self.torque)


def _torque_map(
    wanted: bool, joints: tuple[str, ...], words: tuple[str, ...], torque: float | None
) -> TorqueMap | None:
    if words and not joints:
        raise click.UsageError(f"found {' '.join(words)}; expected one MECH, or names after --joints")
    if not wanted and (joints or torque is not None):
        raise click.UsageError("--joints and --torque belong to --torque-map")
    return TorqueMap(named_joints(joints, words), 1.0 if torque is None else torque) if wanted else None


torque_map_options = together(
    "torque_map",
    _torque_map,
    click.option("--torque-map", "wanted", is_flag=True, help="Draw the torques that actuators give two joints."),
    joints_option("The joints of --torque-map.  [default: the passive ones in series]"),
    click.argument("words", metavar="", nargs=-1),
    click.option("--torque", type=FINITE, help="Of every actuator, for --torque-map.  [default: 1]"),
)
"""Adds ``--torque-map``, ``--joints`` and ``--torque``, which a command gets as one `torque_map`, or None."""


@click.command()
@click.argument("mech", type=MECH)
@targeted
@click.option("-o", "--output", type=click.Path(path_type=Path), help="PNG, SVG or PDF.  [default: NAME.png]")
@click.option("--names", is_flag=True, help="Write the names of joints beside them.")
@pictured()
@torque_map_options
def plot(
    mech: str,
    target: TargetOptions,
    output: Path | None,
    names: bool,
    drawn: PictureOptions,
    torque_map: TorqueMap | None,
) -> int:
    """Draw a machine at home, or where a target takes it.

    A planar machine is drawn in its plane, any other from where its joints are seen best apart. A target out of reach
    shows the nearest feasible pose, the joints that hold it back in orange and named; the exit code is then 1.

    With --torque-map: the torques that the actuators give two joints in series, over the range of these.
    """
    path = output or Path(f"{Path(mech).stem if mech != STANDARD_INPUT else 'mechanism'}.png")
    check_outputs([("-o", path)], [Path(mech)])
    mechanism = load(mech)
    if torque_map is not None:
        if target.is_given or names:
            raise click.UsageError("--torque-map is of the whole range: it does not go with a target or --names")
        if drawn.view is not None or drawn.theme != "light":
            raise click.UsageError("--torque-map is no picture of a machine: it does not go with --view or --theme")
        write_picture(path, partial(torque_map.draw, mechanism), drawn)
        return 0
    shown = pf.solve_ik(mechanism, target.of(mechanism)) if target.is_given else mechanism
    write_picture(path, partial(pf.plot, shown, names=names, **drawn.in_space), drawn)
    return 0 if shown else 1


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
        require_format(html, (".html", ".htm"))
    shown: str | pf.Mechanism | pf.Track = mech
    if mech == STANDARD_INPUT or path is not None:
        shown = mechanism = load(mech)
    if path is not None:
        shown = pf.track(mechanism, pf.read_path(path, mechanism).targets)
    with pf.view(shown, port=port, host=host) as viewer:
        if html is not None:
            viewer.save(html)
            say_wrote(html)
            return 0
        if viewer.port != port:
            note(f"port {port} is taken: served at {viewer.port} instead")
        click.echo(f"{viewer.mechanism.name} at {viewer.url} (Ctrl-C ends it)")
        if not no_browser:
            webbrowser.open(viewer.url)
        viewer.wait()
    return 0
