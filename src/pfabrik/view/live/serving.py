"""The server of the page: silent, of this computer alone, its camera where the machine is seen."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
import rich

from ...arrays import Floats
from ...description.mechanism import Mechanism
from ...kinematics import plane_of

if TYPE_CHECKING:
    import viser

DISTANCE = 2.1
"""Distance of the camera from the middle of the machine, in radii of the machine."""

IN_VIEW = 0.8
"""Share of the camera's angle within which the target is kept: its handles need room around it."""

SEEN_FROM = np.array([0.5, -0.8, 0.35]) / np.linalg.norm([0.5, -0.8, 0.35])


@contextlib.contextmanager
def quietly() -> Iterator[None]:
    """Keep what the server says of itself off standard output, and out of the cells of a notebook.

    It prints by rich, whose console writes into a notebook's cell by itself, not on standard output.
    """
    console = rich.get_console()
    was_quiet, console.quiet = console.quiet, True
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            yield
    finally:
        console.quiet = was_quiet


def serve(host: str, port: int) -> viser.ViserServer:
    """A server at an address, and at the next free port; it opens no way in from elsewhere."""
    import viser

    class Local(viser.ViserServer):
        def request_share_url(self, verbose: bool = True) -> None:
            """A page could ask for a tunnel to the outside; this one is of this computer alone."""

    with quietly():
        return Local(host=host, port=port, verbose=False)


def keep_in_view(server: viser.ViserServer, point: Floats) -> None:
    """Move the camera of each page back, if need be, until a point (3,) of the scene is in view, its handles too."""
    for client in server.get_clients().values():
        camera = client.camera
        try:
            position, middle, angle = np.array(camera.position), np.array(camera.look_at), float(camera.fov)
        except (AssertionError, AttributeError):  # the page has not yet told where its camera is
            continue
        camera.position = backed_off(position, middle, angle, point)


def backed_off(position: Floats, middle: Floats, angle: float, point: Floats) -> Floats:
    """The place (3,) of a camera that looks at a middle (3,), moved back until a point is within its angle [rad]."""
    along = (middle - position) / max(float(np.linalg.norm(middle - position)), 1e-12)
    away = point - position
    across = float(np.linalg.norm(away - (away @ along) * along))
    missing = across / np.tan(0.5 * IN_VIEW * angle) - float(away @ along)
    return np.asarray(position - max(missing, 0.0) * along)


def aim_camera(server: viser.ViserServer, mechanism: Mechanism, points: Floats) -> None:
    """Place the camera so that points (n, 3) [length] are in view; a planar machine is viewed from the front."""
    seen = points / mechanism.characteristic_length
    middle = 0.5 * (seen.min(axis=0) + seen.max(axis=0))
    radius = max(1.0, float(np.linalg.norm(seen - middle, axis=1).max()))
    plane = plane_of(mechanism)
    direction = SEEN_FROM if plane is None else np.cross(*plane)
    camera = server.initial_camera
    camera.position, camera.look_at = middle + DISTANCE * radius * direction, middle
    camera.up = (0.0, 0.0, 1.0) if plane is None else plane[1]
