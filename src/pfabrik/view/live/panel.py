"""The panel beside the scene: distances, sliders, modes, playback. It only reports what the user does."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ...answers.solution import Solution
from ...common.arrays import Floats
from ...errors import counted
from ...kinematics import Readout, readout, readouts
from ...machine.description.mechanism import Mechanism
from ..drawn_parts import free_axes
from ..eye import VIEWS
from .panel_html import legend_html, margins_html, note_html, page_html, pose_html, singular_html, status_html
from .scene import Patch
from .session import COORDINATES, Session, coordinates

if TYPE_CHECKING:
    import viser

FAR = 2.0
"""Range of sliders on each side of home where there is no limit [L or half turns]."""

STEPS = 10_000.0
"""Approximate number of steps of a slider; its box has the digits of one."""

WORKSPACE, LOCUS = "workspace", "locus"
"""Borders that can be shown, by their names."""

UNDO, HOME = "Undo", "Home"


@dataclass(frozen=True)
class Actions:
    """Callbacks of a panel; none of them waits."""

    change_target: Callable[[str, float], None]
    change_actuator: Callable[[int, float], None]
    change_joint: Callable[[int, float], None]
    go_home: Callable[[], None]
    undo: Callable[[], None]
    find_modes: Callable[[str], None]
    take_mode: Callable[[int], None]
    take_step: Callable[[int], None]
    play: Callable[[bool], None]
    look_from: Callable[[Any, str], None]
    show_border: Callable[[str, bool], None]
    show_solids: Callable[[bool], None]
    keep_limits: Callable[[bool], None]
    save: Callable[[Any], None]


class Panel:
    """The elements of one machine.

    Parameters
    ----------
    steps : int
        Of the path to play; 0 without one.
    limits : bool or None
        Whether limits are kept; None for a machine that has none.
    """

    def __init__(
        self,
        gui: viser.GuiApi,
        mechanism: Mechanism,
        session: Session,
        actions: Actions,
        steps: int,
        limits: bool | None,
    ) -> None:
        self._gui, self._actions, self._touched = gui, actions, None
        self._length = mechanism.characteristic_length
        gui.add_html(page_html())
        self._status = gui.add_html("")
        self._margins = gui.add_html("")
        self._singular = gui.add_html("")
        back = gui.add_button_group("Back", (UNDO, HOME), hint="Undo is also Ctrl Z")
        back.on_click(lambda event: actions.undo() if event.target.value == UNDO else actions.go_home())
        gui.add_command(UNDO, hotkey="Z", modifier="cmd/ctrl").on_trigger(lambda _: actions.undo())
        views = gui.add_button_group("View", tuple(VIEWS))
        views.on_click(lambda event: actions.look_from(event.client, event.target.value))
        with gui.add_folder("Target"):
            slides, turns = free_axes(mechanism)
            names = [COORDINATES[k] for k in (*slides, *(3 + axis for axis in turns))]
            self._target = {name: self._target_slider(mechanism, name) for name in names}
            self._pose = gui.add_html("")
        in_series = () if session.path is None else session.path.coordinates
        self._joint_readouts = [readout(each, mechanism.length_unit) for each in in_series]
        self._readouts, self._joints = readouts(mechanism), []
        if in_series:
            with gui.add_folder("Joints"):
                self._joints = self._sliders(self._joint_readouts, session.joints, actions.change_joint)
        with gui.add_folder("Actuators"):
            self._actuators = self._sliders(self._readouts, session.actuators, actions.change_actuator)
        self._add_path(steps)
        self._add_modes()
        with gui.add_folder("Show"):
            self._add_switches(mechanism, limits)
        self._legend, self._note = gui.add_html(""), gui.add_html("")
        self.tell("")
        gui.add_button("Save as a page").on_click(lambda event: actions.save(event.client))

    def show(self, session: Session) -> None:
        """Update everything to an answer, except the slider that the user holds."""
        self._status.content = status_html(session)
        self._margins.content = margins_html(session)
        self._singular.content = singular_html(session)
        self._pose.content = pose_html(session)
        named = coordinates(session.target)
        for name, slider in self._target.items():
            self._set(slider, named[name])
        of_actuators = zip(self._actuators, self._readouts, session.actuators, strict=True)
        of_joints = zip(self._joints, self._joint_readouts, session.joints, strict=True)
        for slider, shown, value in (*of_actuators, *of_joints):
            self._set(slider, float(shown.display(value)))

    def tell(self, words: str, *, alarming: bool = False) -> None:
        """Show a note on progress, or on an error."""
        self._note.content = note_html(words, alarming=alarming)

    def wants(self, what: str) -> bool:
        """True if the user wants to see a border, by its name."""
        return bool(self._borders[what].value)

    def list_patches(self, patches: Iterable[Patch]) -> None:
        """Show what each colour in the scene stands for."""
        self._legend.content = legend_html([(patch.colour, patch.words) for patch in patches])

    def list_modes(self, kind: str, modes: Sequence[Solution], words: Sequence[str]) -> None:
        """Offer modes to choose from."""
        self._modes.options = (counted(len(modes), f"{kind} mode"), *words)
        self._modes.visible = bool(modes)

    def show_step(self, step: int) -> None:
        """Bring the slider of a path up to a step."""
        if self._step is not None:
            self._set(self._step, step)

    def release(self) -> None:
        """Let all sliders follow the answers again."""
        self._touched = None

    def _set(self, slider: Any, value: float) -> None:
        if slider is not self._touched:
            shown = round(value, slider.precision)
            slider.value = float(np.clip(shown, slider.min, slider.max)) + 0.0

    def _target_slider(self, mechanism: Mechanism, name: str) -> Any:
        low, high, at, unit = -180.0, 180.0, 0.0, "deg"
        if name in "xyz":
            at, far, unit = float(mechanism.home_pose["xyz".index(name), 3]), FAR * self._length, mechanism.length_unit
            low, high = rounded(at - far, at + far)
        return self._slider(f"{name} [{unit}]", low, high, at, lambda value: self._actions.change_target(name, value))

    def _sliders(self, shown: Sequence[Readout], values: Floats, change: Callable[[int, float], None]) -> list[Any]:
        """A slider for each coordinate, over its range, or far enough where there is none."""
        sliders = []
        for place, (each, value) in enumerate(zip(shown, values, strict=True)):
            at, far = float(each.display(value)), 180.0 if each.is_angle else FAR * self._length
            free_low, free_high = rounded(at - far, at + far)
            low, high = each.limits
            low, high = (low if np.isfinite(low) else free_low), (high if np.isfinite(high) else free_high)
            tell = partial(_tell_coordinate, change, place, each)  # whose ends are rounded on the slider
            sliders.append(self._slider(f"{each.name} [{each.unit}]", low, high, at, tell))
        return sliders

    def _slider(self, label: str, low: float, high: float, value: float, tell: Callable[[float], None]) -> Any:
        """A slider that tells the values that the user gives it; its ends and its value are whole steps."""
        digits = int(np.ceil(-np.log10(max(high - low, 1e-9) / STEPS)))
        low, high, value = (round(each, digits) for each in (low, max(high, low), value))
        shown = float(np.clip(value, low, high)) + 0.0
        return self._heard(
            self._gui.add_slider(label, low, high, float(round(10.0**-digits, max(digits, 0))), shown), tell
        )

    def _heard(self, slider: Any, tell: Callable[[float], None]) -> Any:
        def moved(event: Any) -> None:
            self._touched = event.target
            tell(event.target.value)

        slider.on_update(_of_users(moved))
        return slider

    def _add_path(self, steps: int) -> None:
        self._step: Any = None
        if steps < 2:
            return
        with self._gui.add_folder("Path"):
            self._switch("Play", False, None, self._actions.play)
            self._step = self._gui.add_slider("step", 1, steps, 1, 1)
            self._heard(self._step, lambda step: self._actions.take_step(int(step)))

    def _add_switches(self, mechanism: Mechanism, limits: bool | None) -> None:
        show, hint = self._actions.show_border, "Parallel ones, at this orientation"
        reached = self._switch("workspace", False, "What is reached at this orientation", partial(show, WORKSPACE))
        self._borders = {WORKSPACE: reached, LOCUS: self._switch("singularities", False, hint, partial(show, LOCUS))}
        if mechanism.shapes:
            hint = "Shapes of links, and the least distance between them"
            self._switch("solids", True, hint, self._actions.show_solids)
        if limits is not None:
            self._switch("limits", limits, "Whether answers keep the limits of joints", self._actions.keep_limits)

    def _switch(self, label: str, value: bool, hint: str | None, change: Callable[[bool], None]) -> Any:
        """A switch that tells what the user sets it to."""
        switch = self._gui.add_checkbox(label, value, hint=hint)
        switch.on_update(_of_users(lambda event: change(event.target.value)))
        return switch

    def _add_modes(self) -> None:
        with self._gui.add_folder("Modes", expand_by_default=False):
            self._add_search("working", "of this pose")
            self._add_search("assembly", "of these actuator values")
            self._modes = self._gui.add_dropdown("mode", ("none",), visible=False)
            self._modes.on_update(_of_users(self._chosen))

    def _add_search(self, kind: str, hint: str) -> None:
        button = self._gui.add_button(f"{kind.capitalize()} modes", hint=f"All configurations {hint}")
        button.on_click(lambda _: self._actions.find_modes(kind))

    def _chosen(self, event: Any) -> None:
        place = self._modes.options.index(event.target.value)
        if place > 0:
            self._actions.take_mode(place - 1)


def _tell_coordinate(change: Callable[[int, float], None], place: int, shown: Readout, value: float) -> None:
    change(place, shown.coordinate(float(np.clip(value, *shown.limits))))


def _of_users(listen: Callable[[Any], None]) -> Callable[[Any], None]:
    """A callback for what a user does, not for what the program sets."""

    def heard(event: Any) -> None:
        if event.client is not None:
            listen(event)

    return heard


def rounded(low: float, high: float) -> tuple[float, float]:
    """A range with ends that are easily read."""
    unit = 10.0 ** np.floor(np.log10(high - low)) / 10.0
    return float(np.floor(low / unit) * unit), float(np.ceil(high / unit) * unit)
