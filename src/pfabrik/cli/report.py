"""Answers for people: status, poses, actuators, margins, all modes; angles in degrees."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pfabrik as pf

from ..errors import ContinuumOfSolutions
from ..printed import aligned, plain
from ..tolerances import TOLERANCES
from .printing import complain, print_result

if TYPE_CHECKING:
    from ..modes.lists import Modes


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


def print_modes(search: Callable[[], Modes], as_json: bool) -> int:
    """Print all modes that a search finds; the exit code."""
    try:
        modes = search()
    except ContinuumOfSolutions as error:
        complain(str(error))
        return 1
    print_result(as_json, modes)
    return 0 if any(modes) else 1
