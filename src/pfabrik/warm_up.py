"""Compiling ahead: what answers need is compiled, or loaded from the cache, before the first question."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import TypeAlias

import numpy as np

from .answers.differential import forward_jacobian, singularity
from .answers.solution import Solution
from .checks import require_callable
from .description.mechanism import Mechanism, checked_mechanism
from .fk import solve_fk
from .ik import solve_ik
from .poses import pose
from .track import track

Step: TypeAlias = tuple[str, Callable[[], object]]

NEAR = 0.01
"""How far away from home a target is near, where what it leaves open may have to be completed [L or rad]."""

FAR = 3.0
"""How far away from home a target is out of reach of any machine [L or rad]."""


def warm_up(mechanism: Mechanism | None = None, *, on_step: Callable[[str, float], None] | None = None) -> None:
    """Compile ahead what questions need, where the kernels did not come compiled: there Numba keeps them in a cache.

    Where they did, in a wheel and in a clone after `make`, nothing is compiled, and without a mechanism nothing done.
    With one, what its first questions prepare, which takes tenths of a second, is done at a time of your choice.

    Parameters
    ----------
    mechanism : the machine to be asked: inverse and forward kinematics within and out of reach, paths, all joints, and
        Jacobians.
        What it does not need is not compiled. Default: everything that any machine needs.
    on_step : called after each step with its name and how long it took [s].
    """
    require_callable("on_step", on_step)
    if mechanism is None:
        return
    for name, step in _questions(checked_mechanism(mechanism)):
        start = time.perf_counter()
        step()
        if on_step is not None:
            on_step(name, time.perf_counter() - start)


def _questions(mechanism: Mechanism) -> Iterator[Step]:
    """Questions to one machine, so chosen that whatever answers them is compiled."""
    home, shift = mechanism.home_pose, FAR * mechanism.characteristic_length
    near = pose(home[:3, 3] + NEAR * np.array([3.0, 2.0, 1.0]) * mechanism.characteristic_length, rotvec=[NEAR] * 3)
    far = pose(home[:3, 3] + shift, rotvec=(FAR, 0.0, 0.0))

    def forward(change: float) -> Solution:
        return solve_fk(mechanism, solve_ik(mechanism, home).actuators + change)

    yield "targets within reach", lambda: (solve_ik(mechanism, home), solve_ik(mechanism, near))
    yield "targets out of reach", partial(solve_ik, mechanism, far)
    yield "paths", partial(track, mechanism, np.stack([home, far]))
    yield "coordinates of all joints", lambda: solve_ik(mechanism, np.stack([home, far])).q
    yield "Jacobians", lambda: (forward_jacobian(solve_ik(mechanism, home)), singularity(solve_ik(mechanism, home)))
    yield "forward kinematics", partial(forward, 0.0)
    yield "actuator values out of reach", partial(forward, shift)
