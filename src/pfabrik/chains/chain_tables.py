"""All that kernels need to answer targets of a chain: the machine, options and the question."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..closure.projection import projection_modes
from ..derived import derived
from ..description.home_mobility import column_moves
from ..kernels.chains.chain_constants import FEW, LONG, MET, SHORT
from ..kernels.chains.chain_records import COLUMN, MACHINE, ChainTables
from ..kernels.handle import Handle
from ..kernels.platform.tables import BY_LEGS, NEAREST, QUESTION, Question
from ..kernels.projecting import UNBOUNDED
from ..kernels.rows import HOLD_NOTHING
from ..model import Model
from ..motion.limited_coordinates import ranged_angles
from ..options import Options
from ..tolerances import TOLERANCES
from .chain_seeds import chain_seeds
from .serial_chain import chain_of, stretched_length


@lru_cache(maxsize=16)
def question_of(
    has_start: bool, keeps_mode: bool, *, nearby: bool = False, last: int = NEAREST, seeds: int = UNBOUNDED
) -> Handle[Question]:
    """The question of all rows: BY_LEGS to reach targets only, else the nearest, from so many seeds at most."""
    asked = np.zeros(1, QUESTION)
    asked[0] = False, BY_LEGS, last, has_start, keeps_mode, nearby, seeds, UNBOUNDED, UNBOUNDED, 0, 0.0
    return Handle(Question(asked))


def tables_of(model: Model, options: Options) -> Handle[ChainTables]:
    """All that kernels need of a chain, with options."""
    return _tables(model, options.hold, options.rotation_length, options.tolerance, options.rotation_tolerance)


@derived
def _tables(
    model: Model,
    hold: str | None,
    rotation_length: float | None,
    tolerance: float | None,
    rotation_tolerance: float,
) -> Handle[ChainTables]:
    closure, mechanism, task, length = model.closure, model.mechanism, model.task, model.length
    projections, seeds = projection_modes(model.path_closure, hold, rotation_length), chain_seeds(model)
    machine, columns = np.zeros(1, MACHINE), np.zeros(len(closure.scale), COLUMN)
    is_short = len(chain_of(model).kinds) <= FEW
    fields = {
        "length": length,
        "axes": task.axes,
        "rotations": task.rotations,
        "frame": task.frame,
        "turns": not mechanism.end_effector_is_joint,
        "home": mechanism.home_pose[:3, 3],
        "longest": stretched_length(model) * (1.0 + TOLERANCES.position) + TOLERANCES.position,
        "is_short": is_short,
        **(SHORT if is_short else LONG),
        "position": tolerance or TOLERANCES.position * length,
        "rotation": rotation_tolerance,
        "limit": TOLERANCES.limit,
        "held": TOLERANCES.held,
        "met": MET,
    }
    for name, value in fields.items():
        machine[name] = value
    columns["scale"], columns["moves"], columns["low"], columns["high"] = (
        closure.scale,
        column_moves(mechanism),
        -np.inf,
        np.inf,
    )
    places, low, high = ranged_angles(mechanism)
    columns["low"][places], columns["high"][places] = low, high
    return Handle(
        ChainTables(
            machine,
            chain_of(model),
            columns,
            closure.actuated,
            closure.home,
            np.array([task.held, *(projection.weights for projection in projections)], float),
            np.array([HOLD_NOTHING, *(projection.hold for projection in projections)], np.int64),
            *seeds,
        )
    )
