"""Inverse kinematics by closed form: coerce, call the kernel of the topology or go from leg to leg, wrap."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..description.mechanism import Mechanism, checked_mechanism
from ..errors import InvalidArgument
from ..kernels.threads import in_blocks
from ..poses import are_poses, as_floats, as_poses, what_is_wrong
from .modes import Legs, solve_legs, start_of
from .targets import INVALID, MISSED, REACHED, Statuses
from .topologies import ClosedForm, closed_form

Floats = NDArray[np.float64]
ROWS_A_BLOCK = 4096
"""Rows that a core takes at once: enough to pay for the call, few enough to share a batch evenly."""


@dataclass(frozen=True, eq=False)
class Geometric:
    """What a closed form says of one target or, with leading batch axes on every field, of a batch.

    `bool(answer)` is whether the target, or every target of the batch, is reached.

    Attributes
    ----------
    reached : whether the geometry closes and every limit is kept, (...,); a plain bool for one target.
    actuators : actuated coordinates in the order of `mechanism.actuator_names`, (..., n_a); NaN where not.
    pose : poses of the end effector, T_base_platform, (..., 4, 4) [length]: the targets, with what the task leaves out
        as it follows from the mechanism; NaN where not reached.
    shape : the batch axes, () for one target.
    """

    reached: Any
    actuators: Floats
    shape: tuple[int, ...]
    _completed: Floats

    def __bool__(self) -> bool:
        return bool(np.all(self.reached))

    @cached_property
    def pose(self) -> Floats:
        return np.where(np.asarray(self.reached)[..., None, None], self._completed.reshape(*self.shape, 4, 4), np.nan)


class _Rows(NamedTuple):
    """Answers to be filled: actuators (n, n_a), poses (n, 4, 4), statuses (n,)."""

    actuators: Floats
    poses: Floats
    status: Statuses


def solve_ik(mechanism: Mechanism, target: Any, *, start: Any = None) -> Geometric:
    """Actuator values that put the end effector on a target, by the closed form of the mechanism's topology or legs.

    One answer a target: in the working mode of home, or of the start, where that closes and keeps every limit.
    Otherwise each leg that does not takes its other branch; where this does not help either, the other pose that
    completes a target which sets but a part of one. Of a redundant arm the coordinates stay next to the start's (or
    home's).

    Parameters
    ----------
    target : pose (..., 4, 4) of the end effector in the base frame [length], position (..., 3) at home orientation, or
        a SciPy RigidTransform; leading axes are a batch. Of a pose counts what the mechanism's task sets.
    start : an answer (anything with `actuators` and `pose`), single or one for each target. One without `pose` does not
        tell its working mode, and serves redundant arms alone. Default: home.

    Raises
    ------
    NoClosedForm : neither the mechanism's topology nor its legs have one here.
    InvalidArgument : a target or start of the wrong shape, or rows that are no poses.
    """
    checked_mechanism(mechanism)
    form = closed_form(mechanism)
    targets, shape = as_poses(target)
    starts = form.home if start is None else _starts(start, shape, len(mechanism.actuator_names))
    places = None if form.legs is None else _start_poses(start, shape)
    rows = _Rows(
        np.empty((len(targets), len(mechanism.actuator_names))), targets.copy(), np.empty(len(targets), np.int8)
    )
    if mechanism.end_effector_is_joint:
        rows.poses[:, :3, :3] = np.eye(3)
    if form.kernel is not None and places is None:
        _by_kernel(form, targets, starts, start is None, rows)
    else:
        rows.status[:] = np.where(are_poses(targets), MISSED, INVALID)
    if (rows.status == INVALID).any():
        bad = np.flatnonzero(rows.status == INVALID)
        found = what_is_wrong(targets[bad[0]])
        raise InvalidArgument("target", found, "finite poses whose rotation is one", rows=[int(i) for i in bad[:5]])
    if form.legs is not None:
        _by_legs(form.legs, targets, starts, places, rows)
    reached = (rows.status == REACHED).reshape(shape)
    actuators = rows.actuators.reshape(*shape, len(mechanism.actuator_names))
    return Geometric(reached if shape else bool(reached), actuators, shape, rows.poses)


def _by_kernel(form: ClosedForm, targets: Floats, starts: Floats, at_home: bool, rows: _Rows) -> None:
    """Answer all rows by compiled code."""

    def run(block: slice) -> int:
        own = starts if len(starts) == 1 else starts[block]
        return int(form.kernel(form.plan, targets[block], own, at_home, rows.actuators[block], rows.status[block]))

    in_blocks(run, len(targets), ROWS_A_BLOCK)


def _by_legs(legs: Legs, targets: Floats, starts: Floats, places: Floats | None, rows: _Rows) -> None:
    """Answer leg by leg what is not reached yet."""
    left = np.flatnonzero(rows.status == MISSED)
    own = starts[left] if len(starts) > 1 else starts
    sides, first = start_of(legs, own, None if places is None else places[left] if len(places) > 1 else places)

    def run(block: slice) -> None:
        which = left[block]
        reached, rows.actuators[which], rows.poses[which] = solve_legs(
            legs,
            targets[which],
            sides if len(sides) == 1 else sides[block],
            first if len(first) == 1 else first[block],
        )
        rows.status[which] = np.where(reached, REACHED, MISSED)

    in_blocks(run, len(left), ROWS_A_BLOCK)


def _starts(start: Any, shape: tuple[int, ...], n_actuators: int) -> Floats:
    """The actuators of a start, (1 or n, n_a); InvalidArgument where they do not fit, or are none."""
    expected = f"an answer with {n_actuators} actuators, single or of batch shape {shape}"
    if not hasattr(start, "actuators"):
        raise InvalidArgument("start", type(start).__name__, expected)
    values = as_floats("start", start.actuators, expected)
    if values.shape not in ((n_actuators,), (*shape, n_actuators)):
        raise InvalidArgument("start", f"actuators of shape {values.shape}", expected)
    values = values.reshape(-1, n_actuators)
    bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
    if len(bad):
        raise InvalidArgument(
            "start", "actuators that are not finite", "reached answers", rows=[int(i) for i in bad[:5]]
        )
    return values


def _start_poses(start: Any, shape: tuple[int, ...]) -> Floats | None:
    """The poses of a start, (1 or n, 4, 4); None of one that has none. InvalidArgument where they do not fit."""
    if not hasattr(start, "pose"):
        return None
    expected = f"poses, single or of batch shape {shape}"
    poses = as_floats("start", start.pose, expected)
    if poses.shape not in ((4, 4), (*shape, 4, 4)):
        raise InvalidArgument("start", f"poses of shape {poses.shape}", expected)
    poses = poses.reshape(-1, 4, 4)
    bad = np.flatnonzero(~are_poses(poses))
    if len(bad):
        raise InvalidArgument("start", "what is no pose", "reached answers", rows=[int(i) for i in bad[:5]])
    return poses
