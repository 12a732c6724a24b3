"""What a notebook shows of a mechanism: a title, facts, a table and a drawing, as HTML."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape

from .readouts import readouts
from .sketch import sketch
from .structure import Structure


def mechanism_html(mechanism: Structure, facts: str) -> str:
    """Name and facts, the actuators with their limits, and home as a drawing."""
    rows = [(each.name, *map(bound_text, each.limits), each.unit) for each in readouts(mechanism)]
    return card(mechanism.name, [facts], ("actuator", "min", "max", "unit"), rows, sketch(mechanism))


def card(title: str, lines: Iterable[str], header: Sequence[str], rows: Iterable[Sequence[str]], drawing: str) -> str:
    """Words and a table beside a drawing, which is HTML already; all else is text."""
    words = "".join(f"<div>{escape(line)}</div>" for line in lines)
    table = "".join(map(_row, rows))
    head = _row(header, "th")
    text = f"<div><b>{escape(title)}</b>{words}<table><thead>{head}</thead><tbody>{table}</tbody></table></div>"
    return f'<div style="display:flex;gap:1em;align-items:flex-start">{text}{drawing}</div>'


def _row(cells: Sequence[str], tag: str = "td") -> str:
    return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"


def bound_text(bound: float) -> str:
    """A limit in six digits; ``-`` where there is none."""
    return f"{bound:.6g}" if math.isfinite(bound) else "-"
