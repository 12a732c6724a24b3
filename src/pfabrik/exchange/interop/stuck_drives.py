"""Drives of an imported machine that move nothing: forward kinematics a step from home, one drive after the other."""

from __future__ import annotations

import numpy as np

from ...fk import solve_fk
from ...kinematics import actuator_units, generic_of
from ...machine.description.mechanism import Mechanism
from ...machine.motion.loops import actuated_columns
from .choices import generic_motions

STEP, SHARE = np.radians(10.0), 0.1
"""Step from home [rad or L], and the share of a drive's range that it is at most."""

FOLLOWED = 0.5
"""Share of its step that a drive which moves is off at most: more drives than freedoms do not agree exactly."""

ALONE = 0.1
"""Share of the motion along which a drive is asked that it makes at least: of less it is not the cause."""


def stuck_drives(mechanism: Mechanism) -> tuple[str, ...]:
    """Names of the drives that forward kinematics does not follow from home, either way.

    Each is asked for a step with the others at rest; where there are more drives than freedoms, the others go along as
    the loops let them away from home. None is asked where drives leave freedoms, for then they do not tell a pose.
    """
    if generic_of(mechanism).mobility.uncontrolled:
        return ()
    motions = generic_motions(mechanism)[0][actuated_columns(mechanism)]
    together = motions @ np.linalg.pinv(motions)
    alone = np.diag(together)
    drives, units = mechanism.drives, actuator_units(mechanism)
    homes = np.array([drive.home for drive in drives])
    low, high = np.array([drive.limits for drive in drives]).T
    steps = np.minimum(STEP, SHARE * (high - low) / units)
    is_stuck = np.full(len(drives), not motions.any())
    pending = alone > ALONE
    for sign, room in ((1.0, high - homes), (-1.0, homes - low)):
        sizes = np.minimum(steps, room / units)
        asked = np.flatnonzero(pending & (sizes > 0.0))
        if len(asked):
            rows = together[asked] / alone[asked, None] * sizes[asked, None]
            answers = solve_fk(mechanism, homes + sign * units * rows)
            is_stuck[asked] = np.asarray(answers.actuator_error) > FOLLOWED * sizes[asked]
            pending = pending & is_stuck
    return tuple(drive.name for drive, stays in zip(drives, is_stuck, strict=True) if stays)
