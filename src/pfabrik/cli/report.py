"""Answers for people: status, poses, actuators, margins, all modes; angles in degrees."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, TypeAlias

import pfabrik as pf

from ..answers.aligned_text import aligned, plain
from ..answers.words import as_sentence, by_bound, exceeded, loop_gap
from ..arrays import Floats
from ..description.mechanism_html import bound_text
from ..description.readouts import Readout, readouts
from ..errors import ContinuumOfSolutions, counted
from ..rotations import to_rpy
from ..tolerances import TOLERANCES
from .printing import complain, print_answer

if TYPE_CHECKING:
    from ..modes.lists import Modes

ModeCells: TypeAlias = Callable[[pf.Solution], list[str]]
"""The cells of a table of modes that show one of them."""


def describe(solution: pf.Solution, values: Floats | None = None) -> str:
    """The answer to a target or, with `values` (n_a,) [length or rad], to actuator values."""
    position, angles = pose_texts(solution)
    rows = [
        ("x y z", "   ".join(position), solution.mechanism.length_unit),
        ("roll pitch yaw", "   ".join(angles), "deg"),
    ]
    width = max(len(text) for _, text, _ in rows)
    lines = [f"{name:<16}{text:<{width}}   [{unit}]" for name, text, unit in rows]
    gap = f"{'loops closed to':<16}{loop_gap(solution)}"
    return "\n".join([as_sentence(solution), "", *lines, gap, "", actuator_table(solution, values)])


def pose_texts(solution: pf.Solution) -> tuple[list[str], list[str]]:
    """Position [length], and roll, pitch, yaw [deg]."""
    smallest = TOLERANCES.position * solution.mechanism.characteristic_length
    position = [plain(value, smallest) for value in solution.pose[:3, 3]]
    return position, [plain(math.degrees(angle), 1e-7) for angle in to_rpy(solution.pose[:3, :3])]


def pose_cells(solution: pf.Solution) -> list[str]:
    """Position and angles of a pose in one row."""
    position, angles = pose_texts(solution)
    return position + angles


def pose_header(mechanism: pf.Mechanism) -> list[str]:
    """The columns of `pose_cells`."""
    return [*(f"{name} [{mechanism.length_unit}]" for name in "xyz"), "roll [deg]", "pitch [deg]", "yaw [deg]"]


def actuator_table(solution: pf.Solution, values: Floats | None) -> str:
    """The actuator values, the target values if they are not reached, and the limits."""
    shown = readouts(solution.mechanism)
    low, high = ([bound_text(readout.limits[side]) for readout in shown] for side in (0, 1))
    columns = {"actuator": [readout.name for readout in shown], "value": in_units(shown, solution.actuators)}
    if values is not None and not solution:
        columns["asked"] = in_units(shown, values)
    columns |= {"min": low, "max": high, "unit": [readout.unit for readout in shown]}
    return aligned(list(columns), zip(*columns.values(), strict=True))


def in_units(shown: Sequence[Readout], values: Floats) -> list[str]:
    """Actuator coordinates (n_a,) [length or rad] in the units for people."""
    return [plain(float(readout.display(value)), 1e-9) for readout, value in zip(shown, values, strict=True)]


def margins_table(solution: pf.Solution) -> str:
    """Joint, bound and margin of every limit, nearest first."""
    from ..answers.margins import nearest_first

    rows = [(joint, bound, plain(margin, TOLERANCES.active)) for joint, bound, margin in nearest_first(solution)]
    return aligned(["joint", "bound", "margin"], rows) if rows else "no limits"


def clearance_line(solution: pf.Solution) -> list[str]:
    """The least distance between links, where some have a thickness, and the clearance that is kept."""
    from ..description.links import has_pairs

    if not has_pairs(solution.mechanism):
        return []
    apart = pf.clearance(solution)
    first, second = apart.links
    unit, distance = solution.mechanism.length_unit, float(apart.distance)
    size = f"{plain(abs(distance), 1e-9)} {unit}"
    least = solution.mechanism.clearance
    kept = "no clearance is kept" if least is None else f"the clearance kept is {least:.6g} {unit}"
    return [f"{first} and {second} {f'are {size} apart' if distance >= 0.0 else f'overlap by {size}'} ({kept})"]


def print_modes(search: Callable[[], Modes], kind: str, header: Sequence[str], cells: ModeCells, as_json: bool) -> int:
    """Print all modes of a kind that a search finds, in a table with `cells` under `header`; the exit code."""
    try:
        modes = search()
    except ContinuumOfSolutions as error:
        complain(str(error))
        return 1
    print_answer(as_json, lambda: modes_as_object(modes), lambda: describe_modes(modes, kind, header, cells))
    return 0 if any(modes) else 1


def modes_as_object(modes: Modes) -> dict[str, object]:
    """Modes as plain numbers, lists and dicts."""
    return {
        "modes": [mode.to_dict() for mode in modes],
        "total": modes.total,
        "hits": list(modes.hits),
        "starts": modes.starts,
        "unseen": modes.unseen,
    }


def describe_modes(modes: Modes, kind: str, header: Sequence[str], cells: ModeCells) -> str:
    """The number of modes, a table of them, and how likely it is that there are others."""
    chance = f"another one would find a new mode with a probability of about {modes.unseen:.2%}"
    searched = f"{counted(modes.starts, 'start')}; {chance}"
    if not modes:
        return f"no {kind} mode found\n\n{searched}"
    kept = sum(map(bool, modes)) or "none"
    count = f"{counted(modes.total, f'{kind} mode')}, "
    count += f"of the {len(modes)} nearest to home " if modes.total > len(modes) else ""
    rows = [
        [str(number), *cells(mode), str(hits), by_bound(exceeded(mode)) or "nothing"]
        for number, (mode, hits) in enumerate(zip(modes, modes.hits, strict=True), 1)
    ]
    table = aligned(["mode", *header, "starts", "exceeds"], rows)
    return "\n\n".join([f"{count}{kept} within all limits", table, searched])
