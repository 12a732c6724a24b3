"""How far the end effector can go, and in which directions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .answers.solution import Solution
from .closure.solve import reached_by_closure
from .decomposition.plan import flat_of
from .description.mechanism import Mechanism, checked_mechanism
from .description.task import task_of
from .errors import InvalidArgument
from .ik import solve_ik
from .kernels.reaching import plan as P
from .options import Options
from .poses import as_floats, as_targets
from .reaching.rows import new_rows
from .reaching.solve import settings_of, solve_rows
from .tolerances import TOLERANCES

Floats = NDArray[np.float64]

STEP = 1.0 / 32.0
"""How far one look ahead goes at first [L]: what is narrower may be stepped over."""

NEARBY, LONGEST, HORIZON = 4.0, 64.0, 1e3
"""How far looks are so short, beyond which each goes twice as far as the one before; how far one goes at most, as an
engine that takes limited steps can follow; and beyond which none goes [L]."""


def reach(
    mechanism: Mechanism, origin: Any, directions: Any, *, seed: Solution | None = None, options: Options | None = None
) -> Any:
    """How far the end effector can go from a pose in given directions, its orientation kept, until a limit stops it.

    Rays are looked along in steps of L/32, each from the configuration before it and in its working mode; where a step
    is not reached, the last pose that is reached is found by bisection, to the tolerance of a pose. All rays are
    followed at once.

    Parameters
    ----------
    origin : pose (4, 4) or position (3,) to start from, in the base frame [length]; must be reachable.
    directions : (..., 3), of any length but zero, in the base frame, along axes that the task has.
    seed : an answer that tells the working mode; default home.

    Returns
    -------
    Distances (...,) [length]; inf where nothing stops it within 1000 L. Where a task leaves coordinates out, these
    follow from the mechanism.

    Raises
    ------
    InvalidArgument : an origin that is no pose or is not reached, directions that are none or that leave the task, or a
        mechanism whose task has no position.
    """
    if not any(task_of(checked_mechanism(mechanism)).axes):
        raise InvalidArgument("mechanism", f"task {' '.join(mechanism.task)}", "one whose task has a position")
    rays, shape = _as_directions(mechanism, directions)
    poses, single = as_targets(origin)
    if single != ():
        raise InvalidArgument("origin", f"batch shape {single}", "one pose")
    length = mechanism.characteristic_length
    start = solve_ik(mechanism, poses[0], seed=seed, options=options)
    if not start:
        raise InvalidArgument("origin", f"a pose that is {start.status.name}", "a pose that can be reached")
    search = _Rays(mechanism, poses[0], rays, start, options or Options())
    near, step = np.zeros(len(rays)), np.full(len(rays), STEP * length)
    moving = np.arange(len(rays))
    while len(moving):  # ahead, until something stops each ray
        ahead = near[moving] + step[moving]
        reached = search.go_on(moving, ahead)
        moving = moving[reached]
        near[moving] = ahead[reached]
        distant = moving[near[moving] > NEARBY * length]
        step[distant] = np.minimum(2.0 * step[distant], LONGEST * length)
        near[near > HORIZON * length] = np.inf
        moving = moving[np.isfinite(near[moving])]
    bounded = np.flatnonzero(np.isfinite(near))
    far = near + step
    while len(bounded):
        middle = 0.5 * (near[bounded] + far[bounded])
        reached = search.go_on(bounded, middle)
        near[bounded[reached]], far[bounded[~reached]] = middle[reached], middle[~reached]
        bounded = bounded[far[bounded] - near[bounded] > TOLERANCES.position * length]
    return near.reshape(shape) if shape else near.item()


def _as_directions(mechanism: Mechanism, directions: Any) -> tuple[Floats, tuple[int, ...]]:
    """Unit vectors (n, 3), and the batch shape they came in."""
    expected = "finite directions of shape (..., 3) that are not zero"
    array = as_floats("directions", directions, expected)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise InvalidArgument("directions", f"shape {array.shape}", expected)
    rays, shape = array.reshape(-1, 3), array.shape[:-1]
    sizes = np.abs(rays).max(axis=1, initial=0.0)  # however long, no square of them is too large to be represented
    bad = np.flatnonzero(~(np.isfinite(sizes) & (sizes > 0.0)))
    if len(bad):
        raise InvalidArgument(
            "directions", f"{rays[bad[0]].tolist()}", expected, rows=bad[:5].tolist() if shape else ()
        )
    rays = rays / sizes[:, None]
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    free = [place for place, counts in enumerate(task_of(mechanism).axes) if not counts]
    bad = np.flatnonzero(np.abs(rays[:, free]).max(axis=1, initial=0.0) > TOLERANCES.alignment)
    if len(bad):
        expected = f"directions within the task, {' '.join(mechanism.task)}: what it leaves out follows by itself"
        raise InvalidArgument(
            "directions", f"{rays[bad[0]].tolist()}", expected, rows=bad[:5].tolist() if shape else ()
        )
    return rays, shape


class _Rays:
    """Rays from one pose, and the farthest configuration reached yet on each."""

    def __init__(self, mechanism: Mechanism, origin: Floats, rays: Floats, start: Solution, options: Options) -> None:
        self.mechanism = mechanism
        self.origin = origin
        self.rays = rays
        self.options = options
        self.flat = flat_of(mechanism)
        self.rows = P.Rows._make(np.repeat(array, len(rays), axis=0) for array in start._rows)
        self.coordinates = np.repeat(start._coordinates, len(rays), axis=0)

    def go_on(self, which: NDArray[np.intp], distances: Floats) -> NDArray[np.bool_]:
        """Whether poses so far out on some of the rays are reached; where they are, the next go on from them."""
        targets = np.repeat(self.origin[None], len(which), axis=0)
        targets[:, :3, 3] += distances[:, None] * self.rays[which]
        if self.flat is None:
            found, reached = reached_by_closure(self.mechanism, targets, self.coordinates[which])
            self.coordinates[which[reached]] = found[reached]
            return reached
        rows = new_rows(self.mechanism, self.flat, len(which))
        seeds = P.Seeds(self.rows.poses[which], self.rows.nodes[which], self.rows.trunks[which])
        settings = settings_of(self.mechanism, self.options, seeded=True)._replace(max_rounds=0, any_mode=0)
        solve_rows(self.flat, targets, seeds, settings, rows)
        reached = rows.status == P.REACHED
        for array, own in zip(self.rows, rows, strict=True):
            array[which[reached]] = own[reached]
        return np.asarray(reached)
