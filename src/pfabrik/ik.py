"""Inverse kinematics: from a target pose to a feasible, honest answer."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import InvalidArgument
from .flatten import Flat, flatten
from .kernels import plan as P
from .mechanism import Mechanism
from .options import Options
from .parallel import run_in_blocks
from .poses import as_targets, what_is_wrong
from .solution import Solution
from .tolerances import TOLERANCES

if TYPE_CHECKING:
    from numpy.typing import NDArray

DEFAULT = Options()
_HOLDS = {None: P.HOLD_NOTHING, "orientation": P.HOLD_ORIENTATION, "position": P.HOLD_POSITION}


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
    UnsupportedMechanism : a sub-chain that the reaching engine cannot express.
    """
    targets, shape = as_targets(target)
    options = checked(mechanism, options)
    flat = flatten(mechanism)
    rows = new_rows(flat, len(targets))
    settings = settings_of(mechanism, options, seeded=seed is not None)
    solve_rows(flat, targets, seeds_of(mechanism, flat, seed, shape), settings, rows)
    handle_invalid(targets, rows, options)
    return Solution(mechanism, flat, rows, shape)


def checked(mechanism: Mechanism, options: Options | None) -> Options:
    """The options to use; InvalidArgument where a mechanism or options are something else."""
    if not isinstance(mechanism, Mechanism):
        raise InvalidArgument("mechanism", type(mechanism).__name__, "a Mechanism, as `load` returns")
    if not isinstance(options, Options | None):
        raise InvalidArgument("options", type(options).__name__, "Options, or None")
    return options or DEFAULT


def solve_rows(flat: Flat, targets: NDArray[np.float64], seeds: P.Seeds, settings: P.Settings, rows: P.Rows) -> None:
    """Answer independent rows: directly where closed forms reach, by iteration where not."""
    from .kernels.solve import solve_by_iteration, solve_directly

    if len(targets) == 1:
        if solve_directly(flat.plan, targets, seeds, settings, rows):
            solve_by_iteration(flat.plan, targets, seeds, settings, rows)
        return
    if run_in_blocks(solve_directly, flat.plan, targets, seeds, settings, rows, rows_a_block=4096):
        run_in_blocks(solve_by_iteration, flat.plan, targets, seeds, settings, rows, rows_a_block=64)


def new_rows(flat: Flat, n: int) -> P.Rows:
    """Room for n answers."""
    plan = flat.plan
    return P.Rows(
        status=np.empty(n, np.int64),
        counters=np.empty((n, 2), np.int64),
        poses=np.empty((n, 4, 4)),
        nodes=np.empty((n, flat.home_seed.nodes.shape[1], 3)),
        trunks=np.empty((n, len(plan.trunk_joints))),
        actuators=np.empty((n, flat.n_actuators)),
        measures=np.empty((n, 4)),
    )


@lru_cache(maxsize=256)
def settings_of(mechanism: Mechanism, options: Options, seeded: bool, chained: bool = False) -> P.Settings:
    """Options as the kernels take them."""
    length = mechanism.characteristic_length
    mode = options.working_mode or ("keep" if seeded or chained else "any")
    return P.Settings(
        tolerance=float(options.tolerance or TOLERANCES.position * length),
        rotation_tolerance=float(options.rotation_tolerance),
        slack=0.1 * TOLERANCES.limit * length,
        max_iterations=int(options.max_iterations),
        max_rounds=int(options.max_rounds),
        exact=int(options.exact),
        any_mode=int(mode == "any"),
        hold=_HOLDS[options.hold],
        chained=int(chained),
    )


def seeds_of(mechanism: Mechanism, flat: Flat, seed: Solution | None, shape: tuple[int, ...]) -> P.Seeds:
    """Where the rows of a batch start."""
    if seed is None:
        return flat.home_seed
    if not isinstance(seed, Solution):
        raise InvalidArgument("seed", type(seed).__name__, "a Solution, or None")
    if seed.mechanism != mechanism:
        raise InvalidArgument("seed", f"an answer of '{seed.mechanism.name}'", f"an answer of '{mechanism.name}'")
    rows = seed._rows
    if (rows.status >= P.FAILED).any():
        raise InvalidArgument("seed", "an answer that is FAILED or INVALID", "a feasible configuration")
    if seed.shape not in ((), shape):
        raise InvalidArgument("seed", f"batch shape {seed.shape}", f"a single answer or batch shape {shape}")
    return P.Seeds(rows.poses, rows.nodes, rows.trunks)


def handle_invalid(targets: NDArray[np.float64], rows: P.Rows, options: Options) -> None:
    """Raise for rows that are no poses, naming the first; or leave them marked, their numbers NaN."""
    if len(targets) == 1 and rows.status[0] != P.INVALID:
        return
    bad = np.flatnonzero(rows.status == P.INVALID)
    if not len(bad):
        return
    if options.on_invalid == "raise":
        found = what_is_wrong(targets[bad[0]])
        raise InvalidArgument("target", found, "finite poses whose rotation is one", rows=[int(i) for i in bad[:5]])
    for array in (rows.poses, rows.nodes, rows.trunks, rows.actuators, rows.measures):
        array[bad] = np.nan
    rows.counters[bad] = 0
