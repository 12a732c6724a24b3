"""The handles to drag: one to move the target, one to turn it, each with the axes that the task leaves free."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from ...arrays import Floats
from ...description.mechanism import Mechanism
from ...kinematics import task_of
from ...rotations import from_quaternion
from .scene import GIZMO, MACHINE
from .shapes import quaternion

if TYPE_CHECKING:
    import viser

FAR = 1e6
"""Range of a handle [L]: the answer, not the handle, shows what is out of reach."""


class Handles:
    """Where the target is, in the user's hand.

    Parameters
    ----------
    drag : called with the pose (4, 4) that the user asks for, at every motion of the mouse.
    """

    def __init__(self, server: viser.ViserServer, mechanism: Mechanism, drag: Callable[[Floats], None]) -> None:
        self._length, self._drag = mechanism.characteristic_length, drag
        task = task_of(mechanism)
        self._all: list[Any] = []
        self._held: Any = None
        limits = ((-FAR, FAR),) * 3
        common: dict[str, Any] = {"scale": GIZMO, "depth_test": False, "translation_limits": limits}
        if any(task.axes):
            self._add(server, "move", active_axes=task.axes, disable_rotations=True, **common)
        if task.rotations:
            still = {"disable_axes": True, "disable_sliders": True}
            self._add(server, "turn", active_axes=task.turns, **still, **common)

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
            if event.phase == "update":
                self._drag(self._pose(event.target))

        handle.on_update(moved)
        self._all.append(handle)

    def _pose(self, handle: Any) -> Floats:
        pose = np.eye(4)
        pose[:3, :3] = from_quaternion(np.roll(np.asarray(handle.wxyz, float), -1))
        pose[:3, 3] = np.asarray(handle.position, float) * self._length
        return pose
