"""What the panel says, as HTML: status, the nearest limits, the target to copy, and words when the program is gone."""

from __future__ import annotations

from html import escape

import numpy as np

from ...answers.margins import nearest_first
from ...answers.status import Status
from ..looks import ACHIEVED, HELD
from .session import Session

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


def watch_html() -> str:
    """An element that nobody sees, which starts the script: scripts in HTML that is put in later do not run."""
    script, words = escape(WATCH, quote=True), escape(GONE, quote=True)
    return f'<img src="data:," alt="{words}" style="display:none" onerror="{script}">'


BOX = "margin:0.3em 0.8em;font-size:0.85em;line-height:1.35"

STATUS = "height:5.4em;overflow:auto"
"""Style of the status: four lines, further ones by scrolling, so that what is below stays where it is."""

NOTE = "min-height:1.35em"
"""Style of a note, which has a line to itself even where it says nothing."""

NAME = "width:8em;overflow:hidden;white-space:nowrap;text-overflow:ellipsis"
"""Style of a limit's name: one line, however long it is."""


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


COPY = (
    "const t=this.previousElementSibling;t.select();"
    "(navigator.clipboard?navigator.clipboard.writeText(t.value):Promise.reject()).catch(()=>document.execCommand('copy'));"
    "this.textContent='Copied';setTimeout(()=>this.textContent='Copy pose',900)"
)
"""Script of the button: copies by the clipboard if the browser allows it, else by a command of the document."""


def pose_html(session: Session) -> str:
    """The target as Python, to copy."""
    text = escape(session.pose_as_python, quote=True)
    return (
        f'<div style="{BOX};display:flex;gap:0.4em"><input readonly data-pfabrik="pose" value="{text}" '
        f'style="flex:1;min-width:0;border:1px solid #ccc;font:0.9em monospace;padding:0.2em">'
        f'<button data-pfabrik="copy" onclick="{escape(COPY, quote=True)}" '
        f'style="border:1px solid #ccc;padding:0 0.6em;cursor:pointer">Copy pose</button></div>'
    )
