"""`identify`: masses of bodies, friction and rotors, from efforts that were measured in motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ...answers.solution import Solution
from ...answers.tracked import Track, refuse_leaps
from ...common.arguments import any_values, array
from ...common.arrays import Floats, Mask
from ...common.batch import take
from ...common.checks import names_of, require_known
from ...errors import InvalidArgument
from ...kinematics import inertias_of
from ...machine.description.mechanism import Mass, Mechanism
from ...machine.files.units import metres_of
from ..statics.forces import GRAVITY
from ..statics.loads import BodyLoads, checked_gravity, positive_values
from .asked_motion import NEIGHBOURS, TimedMotion, asked_motion
from .drives import drives_of
from .effort_fit import EffortFit
from .identification import Identification
from .regressor import BodyScales, EffortRows, effort_rows
from .unknowns import FRICTION, ROTOR, Unknowns
from .weights import lacking_masses, moving_bodies, weights_of

LEAST_SIZE = 0.1
"""Size of a body at least, to compare its moments with [L]: of one without joints apart."""


def identify(
    motion: Solution | Track | TimedMotion,
    efforts: ArrayLike,
    *,
    twists: ArrayLike | None = None,
    accelerations: ArrayLike | None = None,
    at: Literal["task", "actuators"] = "task",
    gravity: ArrayLike = GRAVITY,
    loads: BodyLoads | None = None,
    bodies: str | Sequence[str] | None = None,
    friction: bool = True,
    rotors: bool = False,
    sigma: ArrayLike | Mapping[str, float] | None = None,
) -> Identification:
    """Masses of bodies, and friction and rotors of actuators, from efforts measured in motion.

    The most likely values, by weighted least squares, of those that bodies can have. Each parameter is expected to be
    as the file has it, and off by as much as its body weighs: what the efforts do not determine stays there. A rod
    between two ball joints, on whose line its centre is, keeps its moment about that; other parts that nothing holds
    are taken to move as the masses of the file would.

    Parameters
    ----------
    motion : Solution or Track or Timed
        How the machine moved, as in `inverse_dynamics`, with its `twists`, `accelerations` and `at`: a path with times,
        or configurations with rates and accelerations, of the actuators for example. At rest, efforts of gravity say
        what they can.
    efforts : array (n, n_a)
        Force or torque that each actuator exerted [N, N m], at each row of the motion; rows with NaN are left out, as
        those of pauses should be, where an actuator with dry friction may exert anything up to that besides, and
        the first and last two steps of a track, whose accelerations are the least exact.
    twists, accelerations : array (..., 6) or (..., 3), optional
        How configurations move, as in `inverse_dynamics`; with `at` "actuators", (..., n_a).
    at : {"task", "actuators"}, optional
        What `twists` and `accelerations` are of.
    gravity : array (3,), optional
        Gravity [m/s²].
    loads : mapping of str to tuple, optional
        What bodies carry, and is known, as in `inverse_dynamics`.
    bodies : str or sequence of str, optional
        The bodies whose masses are to be identified; by default all that move. Others are as in the file.
    friction : bool, optional
        Identify dry and viscous friction of all actuators; else it is as in the file.
    rotors : bool, optional
        Identify their `rotor_inertia`, behind the gears of the file.
    sigma : float or array (n_a,) or mapping of str to float, optional
        Standard deviations of the efforts [N, N m]. By default those that the residuals of each actuator show.

    Returns
    -------
    Identification
        The machine with identified masses, what the efforts determine and how well, and what is left over.

    Raises
    ------
    InvalidArgument or UnknownName
        A motion that `inverse_dynamics` refuses; efforts of another shape; no body or actuator of a name; no row left.
    """
    if isinstance(motion, Track):
        refuse_leaps(motion)
    rows = asked_motion(motion, twists, accelerations, at)
    mechanism, solution = rows.solution.mechanism, rows.solution
    names, movable = mechanism.actuator_names, moving_bodies(mechanism)
    form, note = (
        " ".join(map(str, (*solution.shape, len(names)))),
        f", a row for each of the motion: {', '.join(names)}",
    )
    measured = array("efforts", efforts, form, "numbers", note, any_values).reshape(-1, len(names))
    known = None if sigma is None else positive_values("sigma", sigma, names)
    chosen = movable if bodies is None else names_of("bodies", bodies)
    require_known("body that moves", chosen, movable)
    wanted = tuple(body for body in movable if body in chosen)
    lacking = [Mass(body, 0.0) for body in lacking_masses(mechanism) if body in wanted]
    whole = mechanism.with_masses([*mechanism.masses, *lacking])
    is_used: Mask = np.isfinite(np.concatenate([measured, solution._coordinates], axis=1)).all(axis=1)
    if rows.at == "path":
        is_used[: NEIGHBOURS // 2] = is_used[-(NEIGHBOURS // 2) :] = False
    scales = _scales(whole, wanted, measured[is_used] * drives_of(mechanism).units)
    moved = effort_rows(replace(rows, weights=weights_of(whole, loads), gravity=checked_gravity(gravity)), scales)
    is_used &= moved.is_good
    if not is_used.any():
        raise InvalidArgument("motion", "no row with efforts that the actuators hold", "some, away from singularities")
    moved, measured = take(moved, is_used), measured[is_used]
    kinds = (*(FRICTION if friction else ()), *([ROTOR] if rotors else []))
    unknowns = Unknowns(whole, scales, kinds, _typical(kinds, measured, moved))
    return Identification(unknowns, EffortFit(unknowns, moved, measured, is_used, known))


def _scales(mechanism: Mechanism, bodies: tuple[str, ...], measured: Floats) -> BodyScales:
    """Where the parameters of bodies are about, and what they are compared with.

    A body without a mass is compared with the mean of the others; without any, with what the efforts, in the units of a
    `Balance`, would hold at rest on an arm of L.
    """
    known, length = inertias_of(mechanism, metres_of(mechanism.length_unit)), mechanism.characteristic_length
    joints = {body: [j.at for j in mechanism.joints if body in j.connects and j.at is not None] for body in bodies}
    points = [
        known[body].centre if known[body].mass > 0.0 else np.mean(joints[body] or [mechanism.reference_point], axis=0)
        for body in bodies
    ]
    farthest = [
        np.linalg.norm(np.reshape(joints[body], (-1, 3)) - point, axis=1).max(initial=LEAST_SIZE * length)
        for body, point in zip(bodies, points, strict=True)
    ]
    masses = np.array([known[body].mass for body in bodies])
    held = np.sqrt(np.mean(measured**2)) / (np.linalg.norm(GRAVITY) * length) if measured.size else 0.0
    other = np.mean(masses[masses > 0.0]) if masses.any() else held or 1.0
    return BodyScales(bodies, np.reshape(points, (-1, 3)), np.array(farthest), np.where(masses > 0.0, masses, other))


def _typical(kinds: Sequence[str], efforts: Floats, moved: EffortRows) -> Floats:
    """What parameters of actuators would be if they took all of an effort, (kinds, n_a)."""
    sizes = [np.sqrt(np.mean(x**2, axis=0)) for x in (efforts, moved.rates, moved.gains)]
    by = {"dry": np.ones_like(sizes[0]), "viscous": sizes[1], "rotor": sizes[2]}
    whole = sizes[0] + np.finfo(float).tiny
    typical = [np.divide(whole, by[kind], out=np.ones_like(whole), where=by[kind] > 0.0) for kind in kinds]
    return np.reshape(typical, (len(kinds), len(whole)))
