"""How far targets are inside, or beyond, the limits of a mechanism: for maps, without projecting any."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from .answers.starts import Start, start_of
from .arrays import Floats, Ints, shaped
from .closure.parasitic import has_parasitic_motion
from .decomposition.leg_forms import LegForm, Rod
from .decomposition.leg_table import LegTable, table_of_poses
from .description.mechanism import Mechanism, checked_mechanism
from .errors import UnsupportedMechanism
from .kernels.threads import in_blocks
from .platform.answers import sides_at
from .platform.table import table_handle
from .targets import Target, as_targets

ROWS_A_BLOCK, ROWS_A_RUN = 1024, 4096
"""Rows of one call of a kernel that measures one by one, or in blocks."""

UNKNOWN = -2
"""Binding of rows whose margin blocks do not tell, see `kernels.legs.maps`."""


class Feasibility(NamedTuple):
    """What keeps targets from being reached, or would first.

    Attributes
    ----------
    margin : the least margin of all limits, (...,): as of `margins` a share of the room there is, 1 in the middle of a
        range or on the axis of a cone, 0 on a limit, negative beyond it. Where a rod does not reach, minus the gap as a
        share of its length; where a leg does not close on the target, minus what is left [L or rad]. NaN for rows that
        are no poses.
    binding : which of `limits` it is the margin of, (...,); -1 where there is none.
    limits : (joint, bound) of every limit: "min", "max" and "cone", as of `margins`; "reach" of a leg's carrier, and
        "closed" of its first joint.
    """

    margin: Any
    binding: Any
    limits: tuple[tuple[str, str], ...]


def feasibility(mechanism: Mechanism, targets: Target, *, start: Start | None = None) -> Feasibility:
    """Margins of targets in one working mode, by legs in closed form; nothing is projected or searched for.

    A target whose margin is positive is reached by `solve_ik`; one whose margin is negative may still be, in another
    working mode.

    Parameters
    ----------
    targets : as of `solve_ik`; what the task leaves open is completed from the start.
    start : a single Solution or joint vector q whose working mode is meant; default home's.

    Raises
    ------
    UnsupportedMechanism : some chain is no leg in closed form; the message says which, and why.
    InvalidArgument : targets of the wrong shape.
    """
    table = table_of_poses(checked_mechanism(mechanism))
    if not isinstance(table, LegTable):
        raise UnsupportedMechanism(mechanism.name, [f"no legs in closed form, {table}"])
    begin, sides = mechanism.home_pose[None].copy(), table.home_sides
    if start is not None:
        found = start_of(mechanism, start, ())
        assert found is not None
        begin = np.require(found.rows.poses, requirements=["C", "W"])
        sides = sides_at(mechanism, table, found)
    poses, shape = as_targets(mechanism, targets)
    margin, binding = _margins(mechanism, table, poses, begin, sides)
    return Feasibility(shaped(margin, shape), shaped(binding, shape), _limits(mechanism))


def _margins(mechanism: Mechanism, table: LegTable, poses: Floats, begin: Floats, sides: Floats) -> tuple[Floats, Ints]:
    """Margins (n,) of poses (n, 4, 4), and which limits they are of: in blocks, and one by one what these leave."""
    margin, binding = np.empty(len(poses)), np.empty(len(poses), np.int64)
    legs, rest = table_handle(table), np.arange(len(poses))
    if table.is_for_blocks:
        from .kernels.legs.maps import margins_in_blocks

        follows = int(table.task["unset"][0] > 0 and has_parasitic_motion(mechanism))

        def run(own: slice) -> int:
            return margins_in_blocks(legs.address, poses[own], begin, sides, follows, margin[own], binding[own])

        if not sum(in_blocks(run, len(poses), ROWS_A_RUN)):
            return margin, binding
        rest = np.flatnonzero(binding == UNKNOWN)
    from .kernels.legs.feasibility import feasibility as measure

    left, margins, bindings = poses[rest], np.empty(len(rest)), np.empty(len(rest), np.int64)

    def run_rest(own: slice) -> None:
        measure(legs.address, left[own], begin, sides, margins[own], bindings[own])

    in_blocks(run_rest, len(rest), ROWS_A_BLOCK)
    margin[rest], binding[rest] = margins, bindings
    return margin, binding


@lru_cache(maxsize=64)
def _limits(mechanism: Mechanism) -> tuple[tuple[str, str], ...]:
    """Limits in the order of the kernel: ranges and cones, then whether legs reach, then whether they close."""
    table = table_of_poses(mechanism)
    assert isinstance(table, LegTable)
    reach = tuple((_carrier(form), "reach") for form in table.forms)
    closed = tuple((form.elements[0].joint.name if form.elements else "", "closed") for form in table.forms)
    return table.limits + reach + closed


def _carrier(form: LegForm) -> str:
    """The joint that carries a leg, or its first one."""
    proximal = form.proximal if isinstance(form, Rod) else None
    items = (proximal,) if proximal is not None else form.elements
    return items[0].joint.name if items else ""
