"""Inverse kinematics: from a target pose to a feasible, honest answer."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from .answers.solution import Solution, Wanted
from .closure.close import closure_of
from .closure.solve import answer_by_closure
from .decomposition.plan import Flat, flat_of
from .description.mechanism import Mechanism, checked_mechanism
from .errors import InvalidArgument
from .kernels.reaching import plan as P
from .options import Options
from .poses import as_targets, what_is_wrong
from .reaching.completion import coordinates_of
from .reaching.rows import new_rows
from .reaching.solve import draw_near, leaves_projections, settings_of, solve_rows

if TYPE_CHECKING:
    from numpy.typing import NDArray

DEFAULT = Options()


def solve_ik(
    mechanism: Mechanism, target: Any, *, seed: Solution | None = None, options: Options | None = None
) -> Solution:
    """Actuator values that put the end effector on a target, or as near as the method gets, with every limit kept.

    Parameters
    ----------
    target : pose (..., 4, 4) of the end effector in the base frame [length], position (..., 3) at home orientation, or
        a SciPy RigidTransform; leading axes are a batch, whose rows are answered independently, on all cores.
    seed : an answer to start from, single or one for each target; its working mode is kept. Default: home.

    Returns
    -------
    Solution : REACHED, or PROJECTED to a feasible pose near the target; see `Solution`.

    Raises
    ------
    InvalidArgument : a target or seed of the wrong shape, or (unless marked) rows that are no poses.
    """
    targets, shape = as_targets(target)
    options = checked(mechanism, options)
    flat = flat_of(mechanism)
    rows = new_rows(mechanism, flat, len(targets))
    joints: Callable[[], NDArray[np.float64]] | None = None
    if flat is None:
        start = start_coordinates(mechanism, seed, shape)
        mode = options.working_mode or ("any" if seed is None else "keep")
        found = answer_by_closure(mechanism, targets, start, options, mode == "keep", rows)
        joints = partial(np.asarray, found)
    else:
        seeds = seeds_of(mechanism, flat, seed, shape)
        settings = settings_of(mechanism, options, seeded=seed is not None)
        solve_rows(flat, targets, seeds, settings, rows)
        if leaves_projections(flat, settings):
            start_from = partial(start_coordinates, mechanism, seed, shape)
            draw_near(mechanism, flat, targets, start_from, settings, options, rows)
        if seed is not None:
            joints = partial(joints_near, mechanism, rows, seed._rows)
    handle_invalid(targets, shape, rows, options)
    if not (rows.status[0] == P.PROJECTED if len(targets) == 1 else P.PROJECTED in rows.status):
        return Solution(mechanism, rows, shape, joints)
    wanted = Wanted(targets.copy(), options.hold, options.rotation_length)  # a caller may write to the targets
    return Solution(mechanism, rows, shape, joints, wanted)


def start_coordinates(mechanism: Mechanism, seed: Solution | None, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Joint coordinates to start from: home's (1, columns), or those of a seed, as deviations from home."""
    if seed is None:
        return np.zeros((1, len(closure_of(mechanism).scale)))
    seed_rows(mechanism, seed, shape)
    return seed._coordinates


def joints_near(mechanism: Mechanism, rows: P.Rows, seed: P.Rows | None, chained: bool = False) -> NDArray[np.float64]:
    """Joint coordinates of answers, nearest to those of their seeds, and those nearest to home."""
    start = None if seed is None else coordinates_of(mechanism, seed)
    return coordinates_of(mechanism, rows, start, chained)


def checked(mechanism: Mechanism, options: Options | None) -> Options:
    """The options to use; InvalidArgument where a mechanism or options are something else."""
    checked_mechanism(mechanism)
    if not isinstance(options, Options | None):
        raise InvalidArgument("options", type(options).__name__, "Options, or None")
    return options or DEFAULT


def seeds_of(mechanism: Mechanism, flat: Flat, seed: Solution | None, shape: tuple[int, ...]) -> P.Seeds:
    """Where the rows of a batch start."""
    if seed is None:
        return flat.home_seed
    rows = seed_rows(mechanism, seed, shape)
    return P.Seeds(rows.poses, rows.nodes, rows.trunks)


def seed_rows(mechanism: Mechanism, seed: Solution, shape: tuple[int, ...]) -> P.Rows:
    """The rows of a seed; InvalidArgument for one that is no feasible answer of this mechanism and batch shape."""
    if not isinstance(seed, Solution):
        raise InvalidArgument("seed", type(seed).__name__, "a Solution, or None")
    if seed.mechanism != mechanism:
        raise InvalidArgument("seed", f"an answer of '{seed.mechanism.name}'", f"an answer of '{mechanism.name}'")
    if (seed._rows.status >= P.FAILED).any():
        raise InvalidArgument("seed", "an answer that is FAILED or INVALID", "a feasible configuration")
    if seed.shape not in ((), shape):
        raise InvalidArgument("seed", f"batch shape {seed.shape}", f"a single answer or batch shape {shape}")
    return seed._rows


def handle_invalid(targets: NDArray[np.float64], shape: tuple[int, ...], rows: P.Rows, options: Options) -> None:
    """Raise for rows that are no poses, naming the first of a batch; or leave them marked, their numbers NaN."""
    if len(targets) == 1 and rows.status[0] != P.INVALID:
        return
    bad = np.flatnonzero(rows.status == P.INVALID)
    if not len(bad):
        return
    if options.on_invalid == "raise":
        found, first = what_is_wrong(targets[bad[0]]), bad[:5].tolist() if shape else ()
        raise InvalidArgument("target", found, "finite poses whose rotation is one", rows=first)
    for array in (rows.poses, rows.nodes, rows.trunks, rows.actuators, rows.measures):
        array[bad] = np.nan
    rows.counters[bad] = 0
