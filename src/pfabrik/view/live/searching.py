"""Searches that take longer than a motion of the mouse: for modes, the border of the workspace, and singularities."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from typing import TYPE_CHECKING

import numpy as np

from ...answers.solution import Solution
from ...answers.words import by_bound, exceeded
from ...capabilities.modes.assembly import assembly_modes
from ...capabilities.modes.working import working_modes
from ...capabilities.workspace.space import POSITIONS
from ...common.arrays import Floats, Ints
from ...common.telling import OnProgress
from ...kinematics import plane_of
from ...machine.description.mechanism import Mechanism
from ..drawn_parts import free_axes
from ..looks import SINGULAR
from .live_machine import LiveMachine
from .panel import FAR, LOCUS, WORKSPACE
from .scene import Patch
from .workers import Newest

if TYPE_CHECKING:
    from ...capabilities.workspace.result import Workspace


class _Unwanted(Exception):
    """Nobody wants to see any more what is looked for."""


class Searches:
    """One search at a time, beside the answers; results for a machine that is no longer shown are dropped.

    Parameters
    ----------
    shown : returns the machine that is shown now.
    lock : held while the machine shown is changed.
    """

    def __init__(
        self,
        shown: Callable[[], LiveMachine],
        lock: AbstractContextManager[object],
        on_error: Callable[[Exception], None],
    ) -> None:
        self._shown, self._lock, self._newest = shown, lock, Newest(on_error)
        self._space: tuple[Solution, Workspace] | None = None
        self._found: dict[str, tuple[list[Patch], str]] = {}

    def find_modes(self, kind: str) -> None:
        """List the "working" modes of the pose, or the "assembly" modes of the actuator values."""
        machine = self._shown()
        machine.panel.release()
        machine.panel.tell(f"looking for {kind} modes …")
        session = machine.session
        mechanism, target, actuators = session.mechanism, session.target.copy(), session.actuators.copy()

        def search() -> None:
            modes = working_modes(mechanism, target) if kind == "working" else assembly_modes(mechanism, actuators)
            beyond = [by_bound(exceeded(mode)) for mode in modes]
            kept = [f"beyond {limits}" if limits else "within limits" for limits in beyond]
            words = [f"{number}: {each}" for number, each in enumerate(kept, 1)]
            with self._lock:
                if self._shown() is machine:
                    machine.modes = tuple(modes)
                    machine.panel.list_modes(kind, machine.modes, words)
                    machine.panel.tell("" if modes else f"no {kind} mode was found")

        self._newest.post(search)

    def show_border(self, name: str, wanted: bool) -> None:
        """Show the border of the workspace at this orientation, or the singularities in it, or hide them."""
        machine = self._shown()
        if wanted:
            start = machine.session.start
            machine.panel.tell("looking for the workspace …")
            self._newest.post(lambda: self._find_borders(machine, start))
            return
        with self._lock:
            machine.show_border(name, [])
            machine.panel.tell("")

    def _find_borders(self, machine: LiveMachine, start: Solution) -> None:
        """Find the borders that are wanted, one after the other: singularities are looked for in a workspace."""
        from ...capabilities.workspace.ask import workspace
        from ...capabilities.workspace.workspace_table import in_words

        both = WORKSPACE, LOCUS
        if not self._is_wanted(machine, both):
            return
        if self._space is None or self._space[0] is not start:
            progress = self._progress(machine, "the workspace", both)
            try:
                space = workspace(start.mechanism, start=start, within=_ends(start.mechanism), on_progress=progress)
            except _Unwanted:
                return
            self._space, self._found = (start, space), {}
        _, space = self._space
        notes = [f"workspace: {in_words(space)}"]
        for name, find in ((WORKSPACE, border_of), (LOCUS, locus_of)):
            if not self._is_wanted(machine, (name,)):
                continue
            if name not in self._found:
                with suppress(_Unwanted):
                    self._found[name] = find(space, start, self._progress(machine, "singularities", (name,)))
            with self._lock:
                if name in self._found and self._is_wanted(machine, (name,)):
                    patches, note = self._found[name]
                    machine.show_border(name, patches)
                    notes.append(note)
        with self._lock:
            if self._is_wanted(machine, both):
                machine.panel.tell("\n".join(filter(None, notes)))

    def _is_wanted(self, machine: LiveMachine, names: tuple[str, ...]) -> bool:
        """True if a machine is shown, and the user wants to see one of these borders of it."""
        return self._shown() is machine and any(map(machine.panel.wants, names))

    def _progress(self, machine: LiveMachine, what: str, names: tuple[str, ...]) -> OnProgress:
        """A callback that shows how much of a search for borders is done, and ends it where none of them is wanted."""

        def tell(done: int, total: int) -> None:
            with self._lock:
                if not self._is_wanted(machine, names):
                    raise _Unwanted
                machine.panel.tell(f"looking for {what}: {100 * done // max(total, 1)} %")

        return tell

    def end(self) -> None:
        """Let the thread end."""
        self._newest.end()


def _ends(mechanism: Mechanism) -> dict[str, tuple[float, float]] | None:
    """Ends of positions for a machine in space without limits, whose workspace may have none: those of its sliders."""
    if plane_of(mechanism) is not None or mechanism.without_limits() != mechanism:
        return None
    far, home = FAR * mechanism.characteristic_length, mechanism.home_pose[:3, 3].tolist()
    return {POSITIONS[k]: (home[k] - far, home[k] + far) for k in free_axes(mechanism)[0]}


def border_of(space: Workspace, start: Solution, _: object) -> tuple[list[Patch], str]:
    """The border of a workspace, each face in the colour of the limit that forms it, and a remark.

    Coordinates that it does not span are as at the start. One over angles has no place in the scene.
    """
    from ...capabilities.workspace.border import groups_of

    corners, limits = _in_the_scene(space, start, space.vertices, space.faces), np.asarray(space.face_limit)
    if corners is None:
        return [], f"over {', '.join(space.names)}: it has no place in the scene"
    return [
        Patch(f"{group.label}: {group.share:.0%}", group.colour, corners[np.isin(limits, group.limits)])
        for group in groups_of(space)
    ], ""


def locus_of(space: Workspace, start: Solution, on_progress: OnProgress) -> tuple[list[Patch], str]:
    """Where the parallel measure changes its sign in a workspace, and a remark."""
    from ...capabilities.workspace.singular import singularity_map

    if not set(space.names) <= set(POSITIONS):
        return [], f"singularities over {', '.join(space.names)} have no place in the scene"
    found = singularity_map(space.mechanism, space, on_progress=on_progress)
    corners = _in_the_scene(space, start, found.locus_vertices, found.locus_faces)
    if corners is None or not len(corners):
        return [], "no parallel singularity in it"
    return [Patch("parallel singularities", SINGULAR, corners)], ""


def _in_the_scene(space: Workspace, start: Solution, vertices: Floats, faces: Ints) -> Floats | None:
    """Corners (k, d, 3) of a mesh in a workspace over positions, [length]; None over angles."""
    if not set(space.names) <= set(POSITIONS):
        return None
    points = np.repeat(start.pose[None, :3, 3], len(vertices), axis=0)
    points[:, [POSITIONS.index(name) for name in space.names]] = vertices
    return np.asarray(points[faces])
