"""Motions as they are given: a path with times, or configurations with rates and accelerations."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from ...answers.solution import Solution, checked_solution
from ...answers.status import Status
from ...answers.tracked import Track, refuse_leaps
from ...common.arguments import array
from ...common.arrays import Floats, Mask
from ...common.checks import require_choice
from ...common.rotations import to_rotvec
from ...errors import InvalidArgument
from ...kinematics import actuator_units
from ...tolerances import TOLERANCES
from .moving_rows import MovingRows

NEIGHBOURS = 5
"""Steps of a path through which a polynomial gives the rates and accelerations of one: of the fourth degree."""


@runtime_checkable
class TimedMotion(Protocol):
    """Configurations at times, and how the actuators move, as `Timed` has them."""

    @property
    def solution(self) -> Solution: ...

    @property
    def times(self) -> Floats: ...

    @property
    def rates(self) -> Floats: ...

    @property
    def accelerations(self) -> Floats: ...


def asked_motion(motion: Any, twists: ArrayLike | None, accelerations: ArrayLike | None, at: str) -> MovingRows:
    """Configurations and how they move, of the arguments of `inverse_dynamics`."""
    require_choice("at", at, ("task", "actuators"))
    is_given = twists is not None or accelerations is not None
    if not isinstance(motion, Solution) and isinstance(motion, TimedMotion):
        if is_given:
            raise InvalidArgument("twists", "twists beside a path with times", "none: the path says how it moves")
        return MovingRows(motion.solution, "actuators", motion.rates, motion.accelerations, motion.times)
    solution = checked_solution(motion)
    if isinstance(motion, Track) and not is_given:
        rates, gains, still, kinks = motion_of(motion)
        return MovingRows(motion, "path", rates, gains, motion.times, still, kinks)
    n, n_a = len(solution._rows.status), len(solution.mechanism.actuator_names)
    forms, width = (f"... {n_a}", n_a) if at == "actuators" else ("... 6 | ... 3", 6)
    values = []
    for name, given in (("twists", twists), ("accelerations", accelerations)):
        value = np.zeros(width) if given is None else array(name, given, forms)
        if value.shape[-1] < width:
            value = np.concatenate([value, np.zeros(value.shape)], axis=-1)
        try:
            values.append(np.broadcast_to(value, (*solution.shape, width)).reshape(n, width))
        except ValueError:
            expected = f"one for all, or one for each of batch shape {solution.shape}"
            raise InvalidArgument(name, f"a batch of {value.shape[:-1]}", expected) from None
    return MovingRows(solution, at, values[0], values[1], motion.times if isinstance(motion, Track) else None)


def motion_of(track: Track) -> tuple[Floats, Floats, Floats, Mask]:
    """Rates and accelerations of a path with times, (n, r + n_a) each: of its end effector, and of its actuators.

    In the machine's units; those of the polynomial through each step and its neighbours, as the times have them. Also
    the rates up to which actuators are at rest, (n, n_a): what the tolerance of positions makes of none, and any where
    an actuator is in one place for three steps on end. And a mask of steps with a kink among them and their neighbours:
    where the nearest pose comes to a limit or leaves it, the velocity leaps.

    Raises
    ------
    InvalidArgument : no times, or such as no motion has; steps without a feasible pose, or that jump.
    """
    mechanism, times = track.mechanism, track.times
    if times is None:
        raise InvalidArgument("track", "a path without times", "one that `track` got `sample_time` or `times` for")
    stops = np.flatnonzero(~(np.diff(times) > 0.0)) + 1
    if len(track) < 3 or len(stops):
        found = f"{len(track)} steps" if len(track) < 3 else "times that do not rise"
        raise InvalidArgument(
            "track", found, "three steps or more, each later than the one before", rows=stops[:5].tolist()
        )
    refuse_leaps(track, Status.PROJECTED)
    k = min(NEIGHBOURS, len(track))
    windows = np.clip(np.arange(len(track)) - k // 2, 0, len(track) - k)[:, None] + np.arange(k)
    late = times[windows] - times[:, None]
    span = np.abs(late).max(axis=1)
    powers = np.linalg.inv((late / span[:, None])[..., None] ** np.arange(k))  # coefficients by values, (n, k, k)
    values = [track.pose[windows][..., :3, 3]]
    if not mechanism.end_effector_is_joint:
        turned = track.pose[windows][..., :3, :3] @ np.swapaxes(track.pose[:, None, :3, :3], -1, -2)
        values.append(to_rotvec(turned))  # from the step itself: so their second derivative is its acceleration
    along = np.concatenate([*values, track.actuators[windows]], axis=-1)
    first, second = (np.einsum("nk,nkv->nv", powers[:, p], along) for p in (1, 2))
    same = TOLERANCES.position * actuator_units(mechanism)
    still = np.outer(np.abs(powers[:, 1]).sum(axis=1) / span, same)
    stays = np.abs(np.diff(track.actuators, axis=0)) <= same
    stays = stays[1:] & stays[:-1]
    for place in range(3):
        still[place : len(still) - 2 + place][stays] = np.inf
    return first / span[:, None], 2.0 * second / span[:, None] ** 2, still, _kinks(track)[windows[:, 1:]].any(axis=1)


def _kinks(track: Track) -> Mask:
    """True for steps of a track that are held by other limits than the one before, (n,); those reached by none."""
    found, is_off = np.zeros(len(track), bool), track.status != Status.REACHED
    if is_off.any():
        all_limits = zip(track.active_limits, is_off.tolist(), strict=True)
        held = [{(each.joint, each.bound) for each in limits if off} for limits, off in all_limits]
        found[1:] = [after != before for before, after in pairwise(held)]
    return found
