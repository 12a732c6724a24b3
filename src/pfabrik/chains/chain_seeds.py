"""Feasible configurations of a chain, all over its ranges: the nearest to a target is where its search starts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Floats
from ..derived import derived
from ..kernels.chains.chain_constants import ACROSS, INDEPENDENT, REACH_OF_SLIDES, WAVES
from ..kernels.chains.chain_records import SEEDS
from ..kernels.closure.loops import BALL, SLIDE
from ..model import Model
from .run_chains import NO_SCREWS, posed
from .serial_chain import chain_of


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
