"""Calls of the kernels of chains, on all cores."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Floats
from ..closure.close import Closing, in_lengths
from ..derived import derived
from ..kernels.handle import Scratch
from ..kernels.threads import in_blocks
from ..model import Model
from .serial_chain import chain_handle, chain_of

if TYPE_CHECKING:
    from ..kernels.chains.chain_state import ChainScratch

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
    from ..kernels.chains.answer_chains import walk_chains

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
    from ..kernels.chains.chain_state import new_chain_scratch

    return new_chain_scratch(chain_of(model), len(model.closure.scale), attempts)
