"""Feasible configurations at random, uniform in joint coordinates."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...answers.solution import Solution
from ...answers.status import Status
from ...common.above import above
from ...common.arrays import Floats
from ...common.checks import require_count
from ...errors import InvalidArgument, counted
from .named_values import box_of
from .placed import Placer

MOST_DRAWS = 1000
"""Most draws of as many configurations as are wanted: where fewer than one in a thousand is feasible, none is found."""


class Sample(NamedTuple):
    """Closed configurations within all limits.

    Attributes
    ----------
    q : array (n, k)
        The named coordinates.
    solution : Solution
        The configurations, with actuators, poses and all joints.
    model : object
        The model of the robot whose states these are, as in `interop.qpos`; None for the model that `to_mjcf` writes.
    """

    q: Floats
    solution: Solution
    model: object = None

    def __repr__(self) -> str:
        return f"<Sample: {counted(len(self.q), 'configuration')} of '{self.solution.mechanism.name}'>"

    @property
    def qpos(self) -> Floats:
        """MuJoCo's joint positions of the model, (n, nq) [rad, m]; see `interop.qpos`."""
        joints: Floats = above("interop.qpos")(self.solution, self.model)
        return joints


def sample_feasible(placer: Placer, n: int, seed: int, box: Any, model: object) -> Sample:
    """Draw coordinates within a box until n are reached.

    Raises
    ------
    InvalidArgument : hardly any are.
    """
    require_count("n", n, most=100_000_000)
    low, high = box_of(placer.coordinates, box)
    random = np.random.default_rng(seed)
    kept = np.empty((0, len(low)))
    has_turns = np.array(placer.coordinates.is_angle) & (high - low > 2.0 * np.pi)
    for _ in range(MOST_DRAWS):
        drawn = random.uniform(low, high, (n, len(low)))
        kept = np.concatenate([kept, drawn[placer.feasible_margins(drawn) >= 0.0]])
        made = np.abs(kept - placer.coordinates.home).max(axis=0, initial=0.0) > np.pi
        if len(kept) and (has_turns & ~made).any():
            names = ", ".join(np.array(placer.coordinates.names)[has_turns & ~made])
            raise InvalidArgument(
                "box", f"several turns of {names}, which the loops cannot make", "a box within a turn"
            )
        if len(kept) >= n:
            solution = placer.solution(kept)
            reached = np.flatnonzero(np.asarray(solution.status) == Status.REACHED)
            kept = kept[reached]
            if len(kept) >= n:
                return Sample(kept[:n], solution[reached[:n]], model)
    raise InvalidArgument("box", f"{len(kept)} feasible of {MOST_DRAWS * n} draws", "a box of which more is reachable")
