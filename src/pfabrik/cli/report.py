"""Answers for people: what became of a question, poses, actuators, all modes; angles in degrees."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import click

from ..answers.aligned_text import aligned, plain
from ..answers.words import as_sentence, by_bound, exceeded, loop_gap
from ..arrays import Floats
from ..description.mechanism_html import bound_text
from ..description.readouts import readouts
from ..errors import ContinuumOfSolutions, counted
from ..rotations import to_rpy
from ..tolerances import TOLERANCES
from .group import complain

if TYPE_CHECKING:
    from ..answers.solution import Solution
    from ..description.mechanism import Mechanism
    from ..description.readouts import Readout
    from ..modes.lists import Modes


def describe(solution: Solution, asked: Floats | None = None) -> str:
    """The answer to a target or, with `asked` (n_a,) [length or rad], to actuator values."""
    position, angles = pose_texts(solution)
    rows = [
        ("x y z", "   ".join(position), solution.mechanism.length_unit),
        ("roll pitch yaw", "   ".join(angles), "deg"),
    ]
    width = max(len(value) for _, value, _ in rows)
    lines = [f"{name:<16}{value:<{width}}   [{label}]" for name, value, label in rows]
    gap = f"{'loops closed to':<16}{loop_gap(solution)}"
    return "\n".join([as_sentence(solution, asked), "", *lines, gap, "", actuator_table(solution, asked)])


def pose_texts(solution: Solution) -> tuple[list[str], list[str]]:
    """Position [length], and roll, pitch, yaw [deg]."""
    smallest = TOLERANCES.position * solution.mechanism.characteristic_length
    position = [plain(value, smallest) for value in solution.pose[:3, 3]]
    return position, [plain(math.degrees(angle), 1e-7) for angle in to_rpy(solution.pose[:3, :3])]


def actuator_table(solution: Solution, asked: Floats | None) -> str:
    """The actuator values, those asked for where they were not reached, and the limits."""
    shown = readouts(solution.mechanism)
    low, high = ([bound_text(readout.limits[side]) for readout in shown] for side in (0, 1))
    columns = {"actuator": [readout.name for readout in shown], "value": in_units(shown, solution.actuators)}
    if asked is not None and not solution:
        columns["asked"] = in_units(shown, asked)
    columns |= {"min": low, "max": high, "unit": [readout.unit for readout in shown]}
    return aligned(list(columns), zip(*columns.values(), strict=True))


def in_units(shown: Sequence[Readout], values: Floats) -> list[str]:
    """Actuator coordinates (n_a,) [length or rad] in the units for people."""
    return [plain(float(readout.display(value)), 1e-9) for readout, value in zip(shown, values, strict=True)]


def margins_table(solution: Solution) -> str:
    """Joint, bound and margin of every limit, nearest first."""
    from ..answers.margins import nearest_first

    rows = [(joint, bound, plain(margin, TOLERANCES.active)) for joint, bound, margin in nearest_first(solution)]
    return aligned(["joint", "bound", "margin"], rows) if rows else "no limits"


def tell_modes(
    find: Callable[[], Modes], kind: str, header: Sequence[str], cells: Callable[[Solution], list[str]], as_json: bool
) -> int:
    """Print all modes of a kind that are found; the exit code.

    Parameters
    ----------
    header, cells : what a table of them shows of each.
    """
    try:
        found = find()
    except ContinuumOfSolutions as error:
        complain(str(error))
        return 1
    if as_json:
        click.echo(json.dumps(modes_as_object(found), allow_nan=False))
    else:
        click.echo(describe_modes(found, kind, header, cells))
    return 0 if any(found) else 1


def modes_as_object(found: Modes) -> dict[str, object]:
    """Modes as plain numbers, lists and dicts."""
    return {
        "modes": [mode.to_dict() for mode in found],
        "total": found.total,
        "hits": list(found.hits),
        "starts": found.starts,
        "unseen": found.unseen,
    }


def describe_modes(found: Modes, kind: str, header: Sequence[str], cells: Callable[[Solution], list[str]]) -> str:
    """How many modes, a table of them, and how sure it is that there are no others."""
    chance = f"another one would find a new mode with a probability of about {found.unseen:.2%}"
    searched = f"{counted(found.starts, 'start')}; {chance}"
    if not found:
        return f"no {kind} mode found\n\n{searched}"
    kept = sum(map(bool, found)) or "none"
    count = f"{counted(found.total, f'{kind} mode')}, "
    count += f"of the {len(found)} nearest to home " if found.total > len(found) else ""
    rows = [
        [str(number), *cells(mode), str(hits), by_bound(exceeded(mode)) or "nothing"]
        for number, (mode, hits) in enumerate(zip(found, found.hits, strict=True), 1)
    ]
    table = aligned(["mode", *header, "starts", "exceeds"], rows)
    return "\n\n".join([f"{count}{kept} within all limits", table, searched])


def pose_header(mechanism: Mechanism) -> list[str]:
    """The columns of `pose_texts`."""
    return [*(f"{name} [{mechanism.length_unit}]" for name in "xyz"), "roll [deg]", "pitch [deg]", "yaw [deg]"]
