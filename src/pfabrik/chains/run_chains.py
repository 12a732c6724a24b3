"""Calls of the kernels of chains, on all cores."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Floats
from ..derived import derived
from ..kernels.chains.chain_records import ChainAim, ChainAnswers
from ..kernels.handle import Scratch
from ..kernels.threads import in_blocks
from ..model import Model
from .serial_chain import chain_handle, chain_of

if TYPE_CHECKING:
    from ..kernels.chains.chain_state import ChainScratch

ROWS_A_BLOCK = 16
"""Rows of one call of a kernel: a row takes microseconds to milliseconds."""


def new_answers(coordinates: Floats) -> ChainAnswers:
    """Allocate the answers of as many dimensionless starts, (n, columns), which are copied."""
    n = len(coordinates)
    poses = np.zeros((n, 4, 4))
    poses[:, 3, 3] = 1.0
    return ChainAnswers(coordinates.copy(), poses, np.zeros(n), np.zeros(n), np.zeros(n, np.int64))


NO_SCREWS = np.zeros((0, 0, 6))


def run_walk(model: Model, coordinates: Floats) -> ChainAnswers:
    """Poses of the end effector and limits at dimensionless coordinates (n, columns), which are not changed."""
    return _walk(model, coordinates, NO_SCREWS)


def run_screws(model: Model, coordinates: Floats) -> Floats:
    """Twists of the end effector per unit rate of each freedom, (n, freedoms, 6) [L], at dimensionless coordinates."""
    screws = np.zeros((len(coordinates), len(chain_of(model).lo), 6))
    _walk(model, coordinates, screws)
    return screws


def _walk(model: Model, coordinates: Floats, screws: Floats) -> ChainAnswers:
    """Walk chains at dimensionless coordinates (n, columns), and fill the screws unless there are no rows of these."""
    from ..kernels.chains.answer_chains import walk_chains

    answers, handle, scratch = new_answers(coordinates), chain_handle(model), scratch_of_chain(model)

    def run(block: slice) -> None:
        own = ChainAnswers._make(array[block] for array in answers)
        walk_chains(handle.address, scratch.address, own, screws[block])

    in_blocks(run, len(coordinates), 4 * ROWS_A_BLOCK)
    return answers


def run_chains(model: Model, kernel: Callable[..., int], aim: ChainAim, answers: ChainAnswers) -> int:
    """Run a kernel on the rows of answers, in place; the sum of what it returns."""
    handle, scratch = chain_handle(model), scratch_of_chain(model)

    def run(block: slice) -> int:
        own = aim._replace(pose=aim.pose._replace(targets=aim.pose.targets[block]))
        return kernel(handle.address, scratch.address, own, ChainAnswers._make(array[block] for array in answers))

    n = len(answers.steps)
    return sum(in_blocks(run, n, n if aim.follows else ROWS_A_BLOCK))


@derived
def scratch_of_chain(model: Model) -> Scratch[ChainScratch]:
    """Scratch memory of the kernels, for each thread its own."""
    from ..kernels.chains.chain_state import new_chain_scratch

    return Scratch(new_chain_scratch, chain_of(model))
