"""Answers that stay on their start's side of the dead points and change points of a linkage with one freedom."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import Floats, Mask
from ..kernels.rows import POSITION_ERROR, PROJECTED, REACHED, ROTATION_ERROR
from ..machine.description.mechanism import Mechanism
from ..machine.description.task import task_of
from ..machine.model import model_of
from ..machine.motion.singularities import are_opposite, assembly_signs, loop_blocks
from ..machine.poses import between
from ..options import Options
from ..tolerances import TOLERANCES
from .joints.close import measure_configurations
from .joints.configurations import Configurations
from .joints.effort import continued
from .joints.engine_contract import Engine

LEAST_STEP = 1e-13
"""Share of a way to which the dead point that it passes is found: rounding is near."""


def start_or_home(engine: Engine, mechanism: Mechanism, start: Configurations | None) -> Configurations:
    """A start, or the configuration at home where there is none."""
    if start is not None:
        return start
    home = np.zeros((1, len(mechanism.coordinates)))
    return engine.as_configurations(measure_configurations(model_of(mechanism), home))


def within_assembly(
    engine: Engine,
    mechanism: Mechanism,
    targets: Floats,
    start: Configurations | None,
    answers: Configurations,
    options: Options,
) -> Configurations:
    """Answers to targets (n, 4, 4) from one start, home, or one for each; those beyond a dead point stop at it."""
    if not loop_blocks(mechanism):
        return answers
    start = start_or_home(engine, mechanism, start)
    signs = assembly_signs(mechanism, start.coordinates)
    is_beyond = are_opposite(assembly_signs(mechanism, answers.coordinates), signs)
    for row in np.flatnonzero(is_beyond & (answers.rows.status <= PROJECTED)):
        own = np.array([row if len(start) > 1 else 0])
        stopped = up_to_dead_point(engine, mechanism, targets[[row]], start.at(own), signs[own[0]], options)
        answers = answers.with_rows(np.array([row]), stopped)
    return answers


def up_to_dead_point(
    engine: Engine,
    mechanism: Mechanism,
    target: Floats,
    start: Configurations,
    signs: Floats,
    options: Options,
) -> Configurations:
    """The last configuration with the start's signs of assembly on the straight way to a target (1, 4, 4)."""
    begin, kept = start.rows.poses.copy(), start.at(np.zeros(1, int))

    def advance(_rows: NDArray[np.intp], shares: Floats) -> Mask:
        nonlocal kept
        there = engine.advance(between(begin, target, shares), kept)
        is_kept = (there.rows.status == REACHED) & ~are_opposite(assembly_signs(mechanism, there.coordinates), signs)
        kept = there if is_kept[0] else kept
        return np.asarray(is_kept)

    continued(1, advance, LEAST_STEP)
    position, rotation = task_of(mechanism).errors(kept.rows.poses, target)
    kept.rows.measures[:, POSITION_ERROR], kept.rows.measures[:, ROTATION_ERROR] = position, rotation
    near = options.tolerance or TOLERANCES.position * mechanism.characteristic_length
    kept.rows.status[:] = np.where((position <= near) & (rotation <= options.rotation_tolerance), REACHED, PROJECTED)
    return kept
