"""The panel beside the scene: status, margins, sliders, modes, playback. It only reports what the user does."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from itertools import compress
from typing import TYPE_CHECKING, Any

import numpy as np

from ...answers.solution import Solution
from ...description.mechanism import Mechanism
from ...errors import counted
from ...kinematics import Readout, readout, readouts, task_of
from ...rotations import to_rpy
from ..looks import ACHIEVED, HELD
from .panel_html import BOX, NOTE, margins_html, pose_html, status_html, watch_html
from .session import DIGITS, Session

if TYPE_CHECKING:
    import viser

    from .border_patches import Patch

FAR = 2.0
"""Range of sliders on each side of home where there is no limit [L or half turns]."""

STEPS = 1000.0
"""Approximate number of steps of a slider."""


@dataclass(frozen=True)
class Actions:
    """Callbacks of a panel; none of them waits."""

    change_target: Callable[[str, float], None]
    change_actuator: Callable[[int, float], None]
    change_joint: Callable[[int, float], None]
    go_home: Callable[[], None]
    find_modes: Callable[[str], None]
    take_mode: Callable[[int], None]
    take_step: Callable[[int], None]
    play: Callable[[bool], None]
    show_workspace: Callable[[bool], None]
    save: Callable[[Any], None]


class Panel:
    """The elements of one machine.

    Parameters
    ----------
    steps : of the path to play; 0 without one.
    """

    def __init__(self, gui: viser.GuiApi, mechanism: Mechanism, session: Session, actions: Actions, steps: int) -> None:
        self._actions, self._touched = actions, None
        self._status = gui.add_html("")
        self._margins = gui.add_html("")
        with gui.add_folder("Target"):
            self._target = {name: self._target_slider(gui, mechanism, name) for name in coordinates_of(mechanism)}
            self._pose = gui.add_html("")
            gui.add_button("Home").on_click(lambda _: actions.go_home())
        self._add_joints(gui, mechanism, session)
        with gui.add_folder("Actuators"):
            self._readouts = readouts(mechanism)
            values = zip(self._readouts, session.actuators, strict=True)
            self._actuators = [
                self._actuator_slider(gui, mechanism, place, shown, float(shown.display(value)))
                for place, (shown, value) in enumerate(values)
            ]
        self._add_path(gui, steps)
        self._add_modes(gui)
        self._workspace = gui.add_checkbox("Workspace at this orientation", initial_value=False)
        self._workspace.on_update(_of_users(lambda event: actions.show_workspace(event.target.value)))
        self._border = gui.add_html("")
        self._note = gui.add_html("")
        self.tell("")
        gui.add_html(watch_html())
        gui.add_button("Save as a page").on_click(lambda event: actions.save(event.client))

    def show(self, session: Session) -> None:
        """Update everything to an answer, except the slider that the user holds."""
        self._status.content = status_html(session)
        self._margins.content = margins_html(session)
        self._pose.content = pose_html(session)
        position, angles = session.target[:3, 3], np.degrees(to_rpy(session.target[:3, :3]))
        named = dict(zip(("x", "y", "z", "roll", "pitch", "yaw"), (*position, *angles), strict=True))
        for name, slider in self._target.items():
            self._set(slider, named[name])
        for slider, shown, value in zip(self._actuators, self._readouts, session.actuators, strict=True):
            self._set(slider, float(shown.display(value)))
        for slider, shown, value in zip(self._joints, self._joint_readouts, session.joints, strict=True):
            self._set(slider, float(shown.display(value)))

    def tell(self, words: str, *, alarming: bool = False) -> None:
        """Show a note on progress, or on an error."""
        colour = HELD if alarming else ACHIEVED
        lines = "<br>".join(escape(line) for line in words.splitlines())
        self._note.content = f'<div data-pfabrik="note" style="{BOX};{NOTE};color:{colour}">{lines}</div>'

    @property
    def wants_workspace(self) -> bool:
        """True if the user wants to see the workspace."""
        return bool(self._workspace.value)

    def tell_border(self, patches: Sequence[Patch]) -> None:
        """Show the colour of each limit, and the share of the border that it forms."""
        rows = "".join(
            f'<div><span style="color:{each.colour}">&#9632;</span> {escape(each.name)}: {each.share:.0%}</div>'
            for each in patches
        )
        self._border.content = f'<div data-pfabrik="border" style="{BOX}">{rows}</div>' if rows else ""

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
            slider.value = float(np.clip(round(value, DIGITS), slider.min, slider.max)) + 0.0

    def _target_slider(self, gui: viser.GuiApi, mechanism: Mechanism, name: str) -> Any:
        if name in ("x", "y", "z"):
            home = float(mechanism.home_pose["xyz".index(name), 3])
            far = FAR * mechanism.characteristic_length
            slider = _slider(gui, f"{name} [{mechanism.length_unit}]", *rounded(home - far, home + far), home)
        else:
            slider = _slider(gui, f"{name} [deg]", -180.0, 180.0, 0.0)
        return self._heard(slider, lambda value: self._actions.change_target(name, value))

    def _actuator_slider(
        self, gui: viser.GuiApi, mechanism: Mechanism, place: int, shown: Readout, value: float
    ) -> Any:
        slider = _coordinate_slider(gui, mechanism, shown, value)
        return self._heard(slider, lambda moved_to: self._actions.change_actuator(place, shown.coordinate(moved_to)))

    def _add_joints(self, gui: viser.GuiApi, mechanism: Mechanism, session: Session) -> None:
        """Sliders of the passive joints in series that carry the end effector, if there are such joints."""
        self._joints: list[Any] = []
        named = () if session.path is None else session.path.coordinates
        self._joint_readouts = [readout(each, mechanism.length_unit) for each in named]
        if not named:
            return
        with gui.add_folder("Joints"):
            for place, (shown, value) in enumerate(zip(self._joint_readouts, session.joints, strict=True)):
                self._joints.append(self._joint_slider(gui, mechanism, place, shown, float(shown.display(value))))

    def _joint_slider(self, gui: viser.GuiApi, mechanism: Mechanism, place: int, shown: Readout, value: float) -> Any:
        slider = _coordinate_slider(gui, mechanism, shown, value)
        return self._heard(slider, lambda moved_to: self._actions.change_joint(place, shown.coordinate(moved_to)))

    def _heard(self, slider: Any, tell: Callable[[float], None]) -> Any:
        """Report the values that the user gives a slider; returns the slider."""

        def moved(event: Any) -> None:
            self._touched = event.target
            tell(event.target.value)

        slider.on_update(_of_users(moved))
        return slider

    def _add_path(self, gui: viser.GuiApi, steps: int) -> None:
        self._step: Any = None
        if steps < 2:
            return
        with gui.add_folder("Path"):
            playing = gui.add_checkbox("Play", initial_value=False)
            playing.on_update(_of_users(lambda event: self._actions.play(event.target.value)))
            self._step = gui.add_slider("step", 1, steps, 1, 1)
            self._heard(self._step, lambda step: self._actions.take_step(int(step)))

    def _add_modes(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Modes", expand_by_default=False):
            self._add_search(gui, "working", "of this pose")
            self._add_search(gui, "assembly", "of these actuator values")
            self._modes = gui.add_dropdown("mode", ("none",), visible=False)
            self._modes.on_update(_of_users(self._chosen))

    def _add_search(self, gui: viser.GuiApi, kind: str, hint: str) -> None:
        button = gui.add_button(f"{kind.capitalize()} modes", hint=f"All configurations {hint}")
        button.on_click(lambda _: self._actions.find_modes(kind))

    def _chosen(self, event: Any) -> None:
        place = self._modes.options.index(event.target.value)
        if place > 0:
            self._actions.take_mode(place - 1)


def coordinates_of(mechanism: Mechanism) -> tuple[str, ...]:
    """The names of a target's sliders: the coordinates of the task, a rotation as angles."""
    task = task_of(mechanism)
    return tuple(compress(("x", "y", "z", "roll", "pitch", "yaw"), (*task.axes, *task.turns)))


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


def _slider(gui: viser.GuiApi, label: str, low: float, high: float, value: float) -> Any:
    step = 10.0 ** np.floor(np.log10(max(high - low, 1e-9) / STEPS))
    return gui.add_slider(label, low, high, float(step), float(np.clip(value, low, high)))


def _coordinate_slider(gui: viser.GuiApi, mechanism: Mechanism, shown: Readout, value: float) -> Any:
    """A slider over the range of a coordinate, or far enough where there is none."""
    far = 180.0 if shown.is_angle else FAR * mechanism.characteristic_length
    free_low, free_high = rounded(value - far, value + far)
    low, high = shown.limits
    low, high = (low if np.isfinite(low) else free_low), (high if np.isfinite(high) else free_high)
    return _slider(gui, f"{shown.name} [{shown.unit}]", low, max(high, low), value)
