"""The panel beside the scene: status, margins, sliders, modes, playback. It only reports what the user does."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from html import escape
from itertools import compress
from typing import TYPE_CHECKING, Any

import numpy as np

from ...answers.margins import nearest_first
from ...answers.solution import Solution
from ...answers.status import Status
from ...arrays import Floats
from ...description.mechanism import Mechanism
from ...errors import counted
from ...kinematics import Readout, readout, readouts, task_of
from ..looks import ACHIEVED, HELD
from .session import COORDINATES, DIGITS, Session, coordinates

if TYPE_CHECKING:
    import viser

    from .scene import Patch

FAR = 2.0
"""Range of sliders on each side of home where there is no limit [L or half turns]."""

STEPS = 1000.0
"""Approximate number of steps of a slider."""

BARS = 8
"""Margins that have a bar; further ones are only counted."""

ALIVE_EVERY = 2000
"""Time between two looks whether the program still answers [ms]."""

GONE = "The program behind this page has ended: nothing moves any more. Start it again, and reload the page."

WATCH = (
    "if(!window.pfabrikWatch){const b=document.createElement('div');b.dataset.pfabrik='gone';b.textContent=this.alt;"
    "b.style.cssText='display:none;position:fixed;left:0;right:0;top:0;z-index:9999;padding:0.6em;text-align:center;"
    f"background:{HELD};color:white;font:1em sans-serif';document.body.append(b);"
    "window.pfabrikWatch=setInterval(()=>fetch('/pfabrik-alive',{cache:'no-store'}).then(()=>'none',()=>'block')"
    f".then(d=>b.style.display=d),{ALIVE_EVERY})}}"
)
"""Script that asks the server of the page whether it is there, and says so where it is not."""

BOX = "margin:0.3em 0.8em;font-size:0.85em;line-height:1.35"

STATUS = "height:5.4em;overflow:auto"
"""Style of the status: four lines, further ones by scrolling, so that what is below stays where it is."""

NOTE = "min-height:1.35em"
"""Style of a note, which has a line to itself even where it says nothing."""

NAME = "width:8em;overflow:hidden;white-space:nowrap;text-overflow:ellipsis"
"""Style of a limit's name: one line, however long it is."""

COPY = (
    "const t=this.previousElementSibling;t.select();"
    "(navigator.clipboard?navigator.clipboard.writeText(t.value):Promise.reject()).catch(()=>document.execCommand('copy'));"
    "this.textContent='Copied';setTimeout(()=>this.textContent='Copy pose',900)"
)
"""Script of the button: copies by the clipboard if the browser allows it, else by a command of the document."""


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
        self._gui, self._actions, self._touched = gui, actions, None
        self._length = mechanism.characteristic_length
        self._status = gui.add_html("")
        self._margins = gui.add_html("")
        with gui.add_folder("Target"):
            task = task_of(mechanism)
            names = compress(COORDINATES, (*task.axes, *task.turns))
            self._target = {name: self._target_slider(mechanism, name) for name in names}
            self._pose = gui.add_html("")
            gui.add_button("Home").on_click(lambda _: actions.go_home())
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
        named = coordinates(session.target)
        for name, slider in self._target.items():
            self._set(slider, named[name])
        of_actuators = zip(self._actuators, self._readouts, session.actuators, strict=True)
        of_joints = zip(self._joints, self._joint_readouts, session.joints, strict=True)
        for slider, shown, value in (*of_actuators, *of_joints):
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
            tell = partial(_tell_coordinate, change, place, each)
            sliders.append(self._slider(f"{each.name} [{each.unit}]", low, max(high, low), at, tell))
        return sliders

    def _slider(self, label: str, low: float, high: float, value: float, tell: Callable[[float], None]) -> Any:
        """A slider that tells the values that the user gives it."""
        step = 10.0 ** np.floor(np.log10(max(high - low, 1e-9) / STEPS))
        return self._heard(self._gui.add_slider(label, low, high, float(step), float(np.clip(value, low, high))), tell)

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
            playing = self._gui.add_checkbox("Play", initial_value=False)
            playing.on_update(_of_users(lambda event: self._actions.play(event.target.value)))
            self._step = self._gui.add_slider("step", 1, steps, 1, 1)
            self._heard(self._step, lambda step: self._actions.take_step(int(step)))

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
    change(place, shown.coordinate(value))


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


# What the panel says, as HTML.


def watch_html() -> str:
    """An element that nobody sees, which starts the script: scripts in HTML that is put in later do not run."""
    script, words = escape(WATCH, quote=True), escape(GONE, quote=True)
    return f'<img src="data:," alt="{words}" style="display:none" onerror="{script}">'


def status_html(session: Session) -> str:
    """The status of the answer, with the limits that block its target, as HTML."""
    reached = session.solution.status == Status.REACHED
    status, *reasons = session.sentence.split("; ")
    lines = "".join(f"<div>{escape(reason)}</div>" for reason in reasons)
    colour = ACHIEVED if reached else HELD
    return (
        f'<div style="{BOX};{STATUS};color:{colour}"><b data-pfabrik="status">{escape(status)}</b>'
        f'<div data-pfabrik="held">{lines}</div></div>'
    )


def margins_html(session: Session) -> str:
    """The nearest limits as bars, 1 in the middle of a range and 0 on the limit."""
    margins = nearest_first(session.solution)
    if not margins:
        return ""
    rows = "".join(_bar(f"{joint} {bound}", margin) for joint, bound, margin in margins[:BARS])
    more = f"<div>and {len(margins) - BARS} others, farther off</div>" if len(margins) > BARS else ""
    return f'<div data-pfabrik="margins" style="{BOX}">{rows}{more}</div>'


def _bar(name: str, value: float) -> str:
    full = escape(name, quote=True)
    share, colour = 100.0 * float(np.clip(value, 0.0, 1.0)), HELD if value <= 1e-6 else ACHIEVED
    return (
        f'<div style="display:flex;gap:0.5em;align-items:center"><span style="{NAME}" title="{full}">'
        f"{full}</span>"
        f'<span style="flex:1;background:#e8e8e8;height:0.6em"><span style="display:block;height:100%;'
        f'width:{share:.1f}%;background:{colour}"></span></span><span style="width:3em;text-align:right">'
        f"{value:.2f}</span></div>"
    )


def pose_html(session: Session) -> str:
    """The target as Python, to copy."""
    text = escape(session.pose_as_python, quote=True)
    return (
        f'<div style="{BOX};display:flex;gap:0.4em"><input readonly data-pfabrik="pose" value="{text}" '
        f'style="flex:1;min-width:0;border:1px solid #ccc;font:0.9em monospace;padding:0.2em">'
        f'<button data-pfabrik="copy" onclick="{escape(COPY, quote=True)}" '
        f'style="border:1px solid #ccc;padding:0 0.6em;cursor:pointer">Copy pose</button></div>'
    )
