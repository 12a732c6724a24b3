"""One machine as it is shown: its session, and all elements of the page: scene, panel, handles, and the camera."""

from __future__ import annotations

from collections.abc import Callable
from threading import RLock
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from ...answers.solution import Solution
from ...answers.status import Status
from ...answers.tracked import Track
from ...common.arrays import Floats
from ...common.rotations import from_quaternion
from ...kinematics import plane_of
from ...machine.description.mechanism import Mechanism
from ..drawn_parts import free_axes
from ..eye import VIEWS, Eye, eye_on
from ..plot_track import checked_track
from ..skeleton import checked_shown, skeleton_of
from .panel import Actions, Panel
from .scene import MACHINE, Patch, Scene, quaternion
from .session import Session
from .workers import due_after

if TYPE_CHECKING:
    import viser

Shown: TypeAlias = tuple[Mechanism, Solution | None, Track | None]
"""A machine, the configuration that it is first shown in (default: home), and the path that can be played."""


GIZMO = 0.35
"""Size of the handles to drag [L]."""

FAR = 1e6
"""Range of a handle [L]: the answer, not the handle, shows what is out of reach."""

DISTANCE = 2.1
"""Distance of the camera from the middle of the machine, in radii of the machine."""

ASPECT = 1.4
"""Height per width of a picture from which the camera stands farther off, as widths do not fit any more."""

IN_VIEW = 0.8
"""Share of the camera's angle within which the target is kept: its handles need room around it."""

UPRIGHT, STEEP = np.array([0.0, 0.0, 1.0]), 0.99
"""The axis that a view is turned about, and the part of a direction along it from which on it is none for it."""


class LiveMachine:
    """A machine in the page, in place of what was there before.

    Attributes
    ----------
    session : its target and its answer.
    track : the path that can be played, or None.
    modes : those that were found last.
    asked : the number of questions of the user so far.
    wanted, actuators, joints : targets of the user, which run ahead of the answers: a pose (4, 4) [length], and values
        of actuators, and of joints in series (k,) [length or rad].
    """

    def __init__(
        self,
        server: viser.ViserServer,
        shown: Shown,
        drag: Callable[[Floats, int], None],
        actions: Actions,
        limits: bool | None,
    ) -> None:
        mechanism, first, self.track = shown
        skeleton = skeleton_of(mechanism if first is None else first)
        self._server, self.session, self._points = server, Session(mechanism, first), skeleton.points
        self.modes: tuple[Solution, ...] = ()
        self.asked = 0
        self.wish = RLock()  # of `wanted`, `actuators`, `joints` and `asked`, which the user and answers both set
        self._borders: dict[str, list[Patch]] = {}
        server.gui.reset()
        server.scene.reset()
        server.scene.configure_default_lights(cast_shadow=False)
        server.gui.set_panel_label(mechanism.name)
        server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium")
        server.gui.main_panel.dock_right()
        self.scene = Scene(server, mechanism, skeleton)
        if self.track is not None:
            self.scene.show_path(self.track)
        self._handles = Handles(server, mechanism, drag)
        steps = 0 if self.track is None else len(self.track)
        self.panel = Panel(server.gui, mechanism, self.session, actions, steps, limits)
        self.look_from(server.initial_camera, 1.0)
        self.refresh()

    def refresh(self, number: int | None = None) -> None:
        """Show the answer of the session; where it is not to the newest question, what the user wants runs ahead."""
        session = self.session
        answered = session.target.copy(), session.actuators.copy(), session.joints
        with self.wish:
            if number is None or number == self.asked:
                self.wanted, self.actuators, self.joints = answered
        with self._server.atomic():
            if session.solution.status < Status.INVALID:
                self.scene.show(session.solution)
            self._handles.show(session.target)
            self.panel.show(session)
        self._server.flush()

    def release(self) -> None:
        """Let handles and sliders follow the answers again."""
        self._handles.release()
        self.panel.release()

    def show_border(self, name: str, patches: list[Patch]) -> None:
        """Show a border in place of the one of that name before, and what its colours stand for."""
        self._borders[name] = patches
        self.scene.show_border(name, patches)
        self.panel.list_patches(patch for border in self._borders.values() for patch in border)

    def look_from(self, camera: Any, aspect: float, view: str | None = None) -> None:
        """Place a camera so that the machine is in view, from a side by its name, or as at first.

        `aspect` is the width of the picture per height.
        """
        seen = self._points / self.session.mechanism.characteristic_length
        middle = 0.5 * (seen.min(axis=0) + seen.max(axis=0))
        radius = max(1.0, float(np.linalg.norm(seen - middle, axis=1).max()))
        direction, camera_up = seen_from(self.session.mechanism, view)
        away = DISTANCE * radius / min(1.0, aspect * ASPECT)
        place_camera(camera, middle + away * direction, middle, camera_up)

    def page(self) -> str:
        """The scene as a page of its own, HTML: the machine as it is, or moving along its path."""
        self._handles.show_all(False)
        try:
            serializer = self._server.get_scene_serializer()
            if self.track is not None:
                self._play_into(serializer, self.track)
            return str(serializer.as_html())
        finally:
            self._handles.show_all(True)

    def _play_into(self, serializer: Any, track: Track) -> None:
        try:
            for step in track:
                if np.isfinite(step.pose).all():
                    self.scene.show(step)
                    serializer.insert_sleep(due_after(track))
        finally:
            self.scene.show(self.session.solution)


def checked(what: object) -> Shown:
    """The machine, configuration and path to show, checked before anything is served."""
    if isinstance(what, Track):
        return what.mechanism, what[int(checked_track(what)[0])], what
    mechanism, solution = checked_shown(what)
    return mechanism, solution, None


class Handles:
    """The target in the user's hand: a handle to move it, one to turn it, each with the axes that the task leaves free.

    Parameters
    ----------
    drag : callable
        Called with the pose (4, 4) that the user asks for at every motion of the mouse, and the number of the grasp.
    """

    def __init__(self, server: viser.ViserServer, mechanism: Mechanism, drag: Callable[[Floats, int], None]) -> None:
        self._length, self._drag = mechanism.characteristic_length, drag
        slides, turns = free_axes(mechanism)
        self._all: list[Any] = []
        self._held: Any = None
        self._grasps = 0
        limits = ((-FAR, FAR),) * 3
        common: dict[str, Any] = {"scale": GIZMO, "depth_test": False, "translation_limits": limits}
        if slides:
            self._add(server, "move", active_axes=_active(slides), disable_rotations=True, **common)
        if turns:
            still = {"disable_axes": True, "disable_sliders": True}
            self._add(server, "turn", active_axes=_active(turns), **still, **common)

    def show(self, target: Floats) -> None:
        """Bring the handles to a target, but for the one in the user's hand."""
        for handle in self._all:
            if handle is not self._held:
                handle.position, handle.wxyz = target[:3, 3] / self._length, quaternion(target[:3, :3])

    def release(self) -> None:
        """Let all handles follow the answers again: a page that goes in the middle of a motion does not say so."""
        self._held = None

    def show_all(self, visible: bool) -> None:
        """Show or hide them."""
        for handle in self._all:
            handle.visible = visible

    def _add(self, server: viser.ViserServer, name: str, **properties: Any) -> None:
        handle = server.scene.add_transform_controls(f"{MACHINE}/target_{name}", **properties)

        async def moved(event: Any) -> None:
            self._held = None if event.phase == "end" else event.target
            self._grasps += event.phase == "start"
            if event.phase == "update":
                self._drag(self._pose(event.target), self._grasps)

        handle.on_update(moved)
        self._all.append(handle)

    def _pose(self, handle: Any) -> Floats:
        pose = np.eye(4)
        pose[:3, :3] = from_quaternion(np.roll(np.asarray(handle.wxyz, float), -1))
        pose[:3, 3] = np.asarray(handle.position, float) * self._length
        return pose


def _active(axes: list[int]) -> tuple[bool, bool, bool]:
    return 0 in axes, 1 in axes, 2 in axes


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


def seen_from(mechanism: Mechanism, view: str | None = None) -> tuple[Floats, Floats]:
    """The direction that a view is seen from, and the axis about which the user turns it, unit vectors (3,).

    Without a view, "iso"; a planar machine is seen in its plane.
    """
    plane = plane_of(mechanism)
    eye = eye_on(plane) if view is None and plane is not None else Eye(*VIEWS[view or "iso"])
    _, up, direction = eye.axes
    return direction, UPRIGHT if abs(direction @ UPRIGHT) < STEEP else up


def place_camera(camera: Any, position: Floats, middle: Floats, up: Floats) -> None:
    """Place a camera of a page, or the one that pages begin with."""
    if hasattr(camera, "up_direction"):
        camera.up_direction = up
    else:
        camera.up = up
    camera.position, camera.look_at = position, middle
