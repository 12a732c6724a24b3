"""Kernel tables of a chain, seeds all over its ranges, and kernel calls on all cores."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...common.arrays import Floats
from ...common.derived import derived
from ...kernels.chains.chain_constants import ACROSS, FEW, INDEPENDENT, LONG, MET, REACH_OF_SLIDES, SHORT, WAVES
from ...kernels.chains.chain_records import COLUMN, MACHINE, SEEDS, ChainTables
from ...kernels.handle import Handle, Scratch
from ...kernels.joints.loops import BALL, SLIDE
from ...kernels.pose.tables import BY_LEGS, NEAREST, QUESTION, Question
from ...kernels.projecting import UNBOUNDED
from ...kernels.rows import HOLD_NOTHING
from ...kernels.threads import in_blocks
from ...machine.description.home_mobility import column_moves
from ...machine.model import Model
from ...machine.motion.limited_coordinates import ranged_angles
from ...options import Options
from ...tolerances import TOLERANCES
from ..joints.close import Closing, in_lengths
from ..joints.projection import projection_modes, with_coarse
from .serial_chain import chain_handle, chain_of, stretched_length

if TYPE_CHECKING:
    from ...kernels.chains.chain_records import ChainScratch


@lru_cache(maxsize=16)
def question_of(
    has_start: bool,
    keeps_mode: bool,
    *,
    nearby: bool = False,
    last: int = NEAREST,
    seeds: int = UNBOUNDED,
    most_steps: int | None = None,
) -> Handle[Question]:
    """The question of all rows: BY_LEGS to reach targets only, else the nearest, from so many seeds at most."""
    asked = np.zeros(1, QUESTION)
    asked[0] = False, BY_LEGS, last, has_start, keeps_mode, nearby, seeds, UNBOUNDED, UNBOUNDED, most_steps or 0, 0.0
    return Handle(Question(asked))


def tables_of(model: Model, options: Options) -> Handle[ChainTables]:
    """All that kernels need of a chain, with options."""
    tolerances = options.tolerance, options.rotation_tolerance
    return _tables(model, options.hold, options.rotation_length, options.hold_price, *tolerances)


@derived
def _tables(
    model: Model,
    hold: str | None,
    rotation_length: float | None,
    hold_price: float,
    tolerance: float | None,
    rotation_tolerance: float,
) -> Handle[ChainTables]:
    closure, mechanism, task, length = model.closure, model.mechanism, model.task, model.length
    projections, seeds = projection_modes(model.path_closure, hold, rotation_length, hold_price), chain_seeds(model)
    projections = with_coarse(projections)
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
            np.array([(0.0, 0.0), *((projection.price, projection.rounding) for projection in projections)]),
            *seeds,
        )
    )


ROWS_A_BLOCK = 16
"""Rows of one call of a kernel: a row takes microseconds to milliseconds."""

NO_SCREWS = np.zeros((0, 0, 6))


def walk(model: Model, coordinates: Floats) -> Closing:
    """Configurations at joint coordinates (n, columns), as results of closing loops, of which there are none."""
    poses, excess = posed(model, coordinates * model.closure.scale, NO_SCREWS)
    gaps, excesses, misses = np.zeros((3, len(coordinates), len(model.path_closure.loops.groups) - 1))
    excesses[:] = excess[:, None]
    return Closing(
        coordinates, in_lengths(poses, model.length), gaps, excesses, misses, np.zeros(len(coordinates), int)
    )


def posed(model: Model, coordinates: Floats, screws: Floats) -> tuple[Floats, Floats]:
    """End effectors (n, 4, 4) [L] and largest excesses over a limit (n,) at dimensionless coordinates (n, columns).

    Parameters
    ----------
    screws : filled with the twists of the end effector per unit rate of each freedom, (n, freedoms, 6), or `NO_SCREWS`.
    """
    from ...kernels.chains.answer_chains import walk_chains

    poses, excesses = np.empty((len(coordinates), 4, 4)), np.empty(len(coordinates))
    handle, scratch = chain_handle(model), scratch_of_chain(model)

    def run(block: slice) -> None:
        part = coordinates[block], poses[block], excesses[block], screws[block]
        walk_chains(handle.address, scratch.address, *part)

    in_blocks(run, len(coordinates), 4 * ROWS_A_BLOCK)
    return poses, excesses


@derived
def scratch_of_chain(model: Model) -> Scratch[ChainScratch]:
    """Scratch memory of the kernels, for each thread its own."""
    return Scratch(new_scratch, model, 0)


def new_scratch(model: Model, attempts: int) -> ChainScratch:
    """Allocate scratch memory, with room to note so many attempts."""
    from ...kernels.chains.chain_records import new_chain_scratch

    return new_chain_scratch(chain_of(model), len(model.closure.scale), attempts)


class ChainSeeds(NamedTuple):
    """Configurations and their end effectors."""

    coordinates: Floats  # (seeds, columns), dimensionless
    poses: Floats  # (seeds, 4, 4) [L]


@derived
def chain_seeds(model: Model) -> ChainSeeds:
    """Configurations all over the ranges of a chain, the same in every call.

    A smooth one bends the chain by a vector c(s) that varies slowly along it: a turn about the axis a gets the share
    c . a of its range.
    """
    chain, rng = chain_of(model), np.random.default_rng(0)
    n_motions, is_ball, is_slide = len(chain.kinds), chain.kinds == BALL, chain.kinds == SLIDE
    reach = np.where(is_slide, REACH_OF_SLIDES, np.pi)
    places = np.minimum(chain.freedoms, len(chain.lo) - 1)
    low = np.where(np.isfinite(chain.lo[places]), chain.lo[places], -reach)
    high = np.where(np.isfinite(chain.hi[places]), chain.hi[places], np.maximum(reach, low + reach))
    low = np.where(np.isfinite(chain.lo[places]), low, np.minimum(low, high - reach))
    axes = _own_frame(chain.axes) @ chain.axes.T
    along = np.linspace(0.0, 1.0, n_motions)
    coordinates = np.zeros((SEEDS, len(model.mechanism.coordinates)))
    for seed in coordinates:
        waves = np.arange(WAVES)[:, None, None]
        sizes = rng.normal(size=(WAVES, 3, 1)) / (1.0 + 0.5 * waves)
        phases = rng.uniform(0.0, 2.0 * np.pi, (WAVES, 3, 1))
        bend = rng.uniform(0.2, 0.9) * (sizes * np.cos(np.pi * waves * along + phases)).sum(axis=0)
        shares = np.clip((axes * bend).sum(axis=0), -1.0, 1.0)
        scattered, rotvecs = rng.uniform(-1.0, 1.0, n_motions), rng.normal(size=(n_motions, 3))
        if rng.integers(INDEPENDENT) == 0:
            shares, bend = scattered, rotvecs.T
        values = 0.5 * (low + high) + 0.5 * (high - low) * shares
        seed[chain.columns[~is_ball]] = values[~is_ball]
        for k in np.flatnonzero(is_ball):
            seed[chain.columns[k] : chain.columns[k] + 3] = bend[:, k]
    return ChainSeeds(coordinates, posed(model, coordinates, NO_SCREWS)[0])


def _own_frame(axes: Floats) -> Floats:
    """Unit vectors (3, 3), one a row, that turn with the axes (m, 3) of a chain: the first, and across it."""
    first = next((axis for axis in axes if axis.any()), np.array([0.0, 0.0, 1.0]))
    others = np.vstack([axes, np.eye(3)])
    across = others - np.outer(others @ first, first)
    second = across[np.argmax(np.linalg.norm(across, axis=1) > ACROSS)]
    second = second / np.linalg.norm(second)
    return np.stack([first, second, np.cross(first, second)])
