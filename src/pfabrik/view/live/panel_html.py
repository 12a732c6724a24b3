"""What the panel says, as HTML; and the style and the script of the page, which come with it."""

from __future__ import annotations

from html import escape

import numpy as np

from ...answers.status import Status
from ...common.drawing import ACHIEVED
from ...tolerances import TOLERANCES
from ..looks import HELD, SINGULAR
from .distances import Left, Nearness, limits_left
from .session import Session

BARS = 6
"""Limits that have a bar; further ones are only counted."""

NEAR = 0.5
"""Share of its measure at home up to which a singularity is near: the leg is named."""

BOX = "margin:0.3em 0.8em;font-size:0.85em;line-height:1.35"

STATUS = "height:5.4em;overflow:auto"
"""Style of the status: four lines, further ones by scrolling, so that what is below stays where it is."""

NOTE = "min-height:1.35em"
"""Style of a note, which has a line to itself even where it says nothing."""

NAME = "width:8em;overflow:hidden;white-space:nowrap;text-overflow:ellipsis"
"""Style of a bar's name: one line, however long it is."""

STYLE = (
    f":root{{--pf-fine:{ACHIEVED};--pf-held:{HELD};--pf-singular:{SINGULAR};--pf-line:#ccc;--pf-track:#e8e8e8}}"
    "[data-mantine-color-scheme=dark]{--pf-fine:#9fc4ff;--pf-held:#f0761c;--pf-singular:#e37fb6;--pf-line:#555;"
    "--pf-track:#3d434c}"
    "[data-mantine-color-scheme=dark] canvas[data-engine]{background:#414852}"
    ".mantine-NumberInput-root{width:4.2rem!important}"  # for seven characters
)
"""Colours on light and on dark ground: links are dark, so that the ground of a dark page is not black."""

LOOKS_EVERY, FOLDED_LOOKS_EVERY, GONE_AFTER = 500, 5000, 4
"""Time between two looks whether the page is connected [ms], with the panel open and folded to its title, where that
takes a question to the server; and how many looks find it gone before the page says so."""

GONE = "The program behind this page has ended: nothing moves any more. Start it again, and reload the page."

PHONE = "(max-width: 36em)"
"""Pages so narrow that the panel lies over the machine: it is folded at first."""

SCRIPT = (
    "window.pfabrikMark=this;if(!window.pfabrikWatch){"
    # The page of a program that has ended says so: the panel of a page that is not connected takes no clicks.
    "const b=document.createElement('div');b.dataset.pfabrik='gone';b.textContent=this.alt;"
    "b.style.cssText='display:none;position:fixed;left:0;right:0;top:0;z-index:9999;padding:0.6em;text-align:center;"
    f"background:{HELD};color:white;font:1em sans-serif';document.body.append(b);"
    "window.pfabrikWatch=(async()=>{for(let n=0;;){const open=window.pfabrikMark.isConnected;"
    f"await new Promise(r=>setTimeout(r,open?{LOOKS_EVERY}:{FOLDED_LOOKS_EVERY}));const m=window.pfabrikMark;"
    "const gone=m.isConnected?getComputedStyle(m).pointerEvents==='none':"
    "await fetch('/',{cache:'no-store'}).then(r=>{r.body.cancel()},()=>true);"
    f"n=gone?n+(open?1:{GONE_AFTER}):0;b.style.display=n<{GONE_AFTER}?'none':'block'}}}})();"
    # On a phone the panel is folded by a click on its title.
    f"if(matchMedia('{PHONE}').matches){{const p=this.closest('.mantine-Paper-root');"
    "[...(p?p.querySelectorAll('div'):[])].find(d=>d.style.cursor==='pointer')?.click()}"
    # Dark as the system is: a part of the address, which the page reads as it opens.
    "const dark=matchMedia('(prefers-color-scheme: dark)'),follow=()=>{const u=new window.URL(location.href);"
    "if(u.searchParams.has('darkMode')===dark.matches)return;"
    "if(dark.matches)u.searchParams.set('darkMode','');else u.searchParams.delete('darkMode');location.replace(u)};"
    "if(dark.matches)follow();dark.addEventListener('change',follow)}"
)
"""Script of the page."""

COPY = (
    "const t=this.previousElementSibling;t.select();"
    "(navigator.clipboard?navigator.clipboard.writeText(t.value):Promise.reject()).catch(()=>document.execCommand('copy'));"
    "this.textContent='Copied';setTimeout(()=>this.textContent='Copy pose',900)"
)
"""Script of the button: copies by the clipboard if the browser allows it, else by a command of the document."""


def page_html() -> str:
    """The style, and an element that nobody sees, which starts the script: scripts in HTML put in later do not run."""
    script, words = escape(SCRIPT, quote=True), escape(GONE, quote=True)
    return f'<style>{STYLE}</style><img src="data:," alt="{words}" style="display:none" onerror="{script}">'


def status_html(session: Session) -> str:
    """The status of the answer, with the limits that block its target."""
    reached = session.solution.status == Status.REACHED
    status, *reasons = session.sentence.split("; ")
    lines = "".join(f"<div>{escape(reason)}</div>" for reason in reasons)
    return (
        f'<div style="{BOX};{STATUS};color:var(--pf-{"fine" if reached else "held"})">'
        f'<b data-pfabrik="status">{escape(status)}</b><div data-pfabrik="held">{lines}</div></div>'
    )


def margins_html(session: Session) -> str:
    """The nearest limits as bars, 1 in the middle of a range and 0 on the limit, with what is left to them."""
    limits = limits_left(session.solution)
    if not limits:
        return ""
    rows = "".join(_limit_bar(limit) for limit in limits[:BARS])
    more = f"<div>and {len(limits) - BARS} others, farther off</div>" if len(limits) > BARS else ""
    return f'<div data-pfabrik="margins" style="{BOX}">{_heading("Nearest limits", "left")}{rows}{more}</div>'


def _limit_bar(limit: Left) -> str:
    unit = "°" if limit.unit == "deg" else f" {limit.unit}"
    is_on = abs(limit.margin) <= TOLERANCES.active
    words = f"{0.0 if is_on else limit.left:.{0 if is_on else decimals(limit.left)}f}{unit}"
    hint = f"{limit.name}: {words} left; the bar is full in the middle of the range"
    colour = "var(--pf-held)" if limit.margin <= TOLERANCES.active else "var(--pf-fine)"
    return _bar(limit.name, limit.margin, colour, words, hint)


def singular_html(session: Session) -> str:
    """Distances from serial and parallel singularities as bars, and whether a parallel one was passed."""
    rows = "".join(_singular_bar(each) for each in session.nearness)
    words = "passed a parallel singularity" if session.is_across else ""
    hint = "The same actuator values have another pose on the side that it came from" if session.is_across else ""
    return (
        f'<div data-pfabrik="singular" style="{BOX}">{_heading("Singularities", "home = 100%")}{rows}'
        f'<div data-pfabrik="across" title="{hint}" style="{NOTE};color:var(--pf-singular)">{words}</div></div>'
    )


MEANINGS = {
    "serial": "platform speed per actuator speed in the most expensive direction; 0 at a dead point of a leg",
    "parallel": "actuator speed per platform speed in the softest direction; 0 where locked actuators hold nothing",
}
"""Meanings of the measures."""


def _singular_bar(near: Nearness) -> str:
    share = near.share
    leg = f": {near.leg}" if near.leg and share <= NEAR else ""
    words = f"{share:.0%}" if np.isfinite(share) else "–"
    hint = f"{near.kind}: {MEANINGS[near.kind]}. Now {near.measure:.3g}, at home {near.at_home:.3g}, scale free"
    colour = f"color-mix(in srgb, var(--pf-fine) {100.0 * _within(share):.0f}%, var(--pf-singular))"
    return _bar(f"{near.kind}{leg}", share, colour, words, hint)


def _heading(name: str, values: str) -> str:
    return f'<div style="display:flex;justify-content:space-between;opacity:0.65"><span>{name}</span>{values}</div>'


def _bar(name: str, share: float, colour: str, words: str, hint: str) -> str:
    return (
        f'<div style="display:flex;gap:0.5em;align-items:center" title="{escape(hint, quote=True)}">'
        f'<span style="{NAME}">{escape(name)}</span>'
        f'<span style="flex:1;background:var(--pf-track);height:0.6em"><span style="display:block;height:100%;'
        f'width:{100.0 * _within(share):.1f}%;background:{colour}"></span></span>'
        f'<span style="width:5em;text-align:right;white-space:nowrap">{escape(words)}</span></div>'
    )


def _within(share: float) -> float:
    return float(np.clip(np.nan_to_num(share, nan=0.0), 0.0, 1.0))


def decimals(value: float) -> int:
    """Digits after the point with which a value has three that count, and four at most."""
    return int(np.clip(2 - np.floor(np.log10(max(abs(value), 1e-2))), 0, 4))


def note_html(words: str, *, alarming: bool) -> str:
    """A note on progress, or on an error."""
    lines = "<br>".join(escape(line) for line in words.splitlines())
    colour = "var(--pf-held)" if alarming else "var(--pf-fine)"
    return f'<div data-pfabrik="note" style="{BOX};{NOTE};color:{colour}">{lines}</div>'


def legend_html(entries: list[tuple[str, str]]) -> str:
    """Colours of what is shown in the scene, and what they stand for."""
    rows = "".join(
        f'<div><span style="color:{colour}">&#9632;</span> {escape(words)}</div>' for colour, words in entries
    )
    return f'<div data-pfabrik="border" style="{BOX}">{rows}</div>' if rows else ""


def pose_html(session: Session) -> str:
    """The target as Python, to copy."""
    text, border = escape(session.pose_as_python, quote=True), "border:1px solid var(--pf-line)"
    return (
        f'<div style="{BOX};display:flex;gap:0.4em"><input readonly data-pfabrik="pose" value="{text}" '
        f'style="flex:1;min-width:0;{border};font:0.9em monospace;padding:0.2em">'
        f'<button data-pfabrik="copy" onclick="{escape(COPY, quote=True)}" '
        f'style="{border};padding:0 0.6em;cursor:pointer">Copy pose</button></div>'
    )
