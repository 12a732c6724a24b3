"""The search for a workspace's border: coarse cells first, halved where the border passes."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np

from ...common.arrays import Floats
from ...common.checks import require_positive
from ...common.telling import telling
from ...errors import InvalidArgument
from .lattice_points import Lattice
from .measuring import Measure
from .parts import Parts
from .refining import refined
from .surface import BorderMesh, mesh_of
from .unmoved import require_size
from .verdicts import MapQuestion

FINENESS, FINENESS_OF_SETS, FINENESS_ONE_BY_ONE = 1 / 100, 1 / 50, 1 / 25
"""Resolutions [L or rad]: where closed forms give margins; where they do for each of many tilts; elsewhere."""

FIRST_CELLS = {(2, True): 1 / 48, (3, True): 1 / 12, (2, False): 1 / 12, (3, False): 1 / 5}
"""Width of the first cells [L or rad], by the number of coordinates and by whether closed forms give margins."""

FIRST_REACH = {True: 2.5, False: 1.5}
"""Extent of the first grid to each side [L or rad], by whether closed forms give margins."""


def searched(question: MapQuestion, step: Floats, measure: Measure) -> tuple[BorderMesh, Parts]:
    """The border at cells of size `step`, (d,), and the connected parts; InvalidArgument if they have no size."""
    space, exact = question.space, question.has_margins
    lattice = Lattice(space.start, step, measure)
    unit = np.where(space.is_angle, 1.0, question.mechanism.characteristic_length)
    widest = float((step / unit).max())
    levels = max(1, round(math.log2(FIRST_CELLS[len(step), exact] / widest)))
    reach = math.ceil(FIRST_REACH[exact] / (widest * 2**levels))
    cells = refined(lattice, levels, max(reach, 2))
    mesh = mesh_of(lattice, cells.border)
    require_size(lattice, mesh)
    return mesh, Parts(lattice, cells)


def step_of(question: MapQuestion, resolution: float | None) -> Floats:
    """The size of the smallest cells, (d,) [length or rad]."""
    space, length = question.space, question.mechanism.characteristic_length
    unit = np.where(space.is_angle, 1.0, length)
    if resolution is None:
        many = len(question.turns) > 1
        return unit * (FINENESS_ONE_BY_ONE if not question.has_margins else FINENESS_OF_SETS if many else FINENESS)
    resolution = require_positive("resolution", resolution)
    relative = resolution if all(space.is_angle) else resolution / length
    if not 1e-4 <= relative <= 0.5:
        expected = "between 1e-4 and 0.5 of the characteristic length, or rad"
        raise InvalidArgument("resolution", repr(resolution), expected)
    return unit * relative


def sliced(
    question: MapQuestion, fixed: Mapping[str, float], resolution: Floats | float
) -> tuple[MapQuestion, Floats, BorderMesh, Parts]:
    """A question with further coordinates fixed, the size of the smallest cells, and the result of `searched`."""
    space = question.space.with_fixed(fixed)
    kept = [question.space.names.index(name) for name in space.names]
    slice_question = dataclasses.replace(
        question, space=space, lowest=question.lowest[kept], highest=question.highest[kept]
    )
    step = resolution[kept] if isinstance(resolution, np.ndarray) else step_of(slice_question, resolution)
    with telling("slice") as tell:
        measure = Measure(slice_question, None, tell)
        answer = slice_question, step, *searched(slice_question, step, measure)
        measure.progress.end()
    return answer
