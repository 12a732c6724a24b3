"""The highest values of a machine's drives: those of its description, or given in their place."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...common.arrays import Floats
from ...common.checks import put_limits
from .mechanism import Mechanism


def drive_limits(mechanism: Mechanism, what: str, given: float | Mapping[str, float] | None) -> Floats:
    """The highest speed, acceleration or torque of every drive, (n_a,); infinite where there is none.

    Parameters
    ----------
    given : for all drives, or by name; those not named have the `max_...` of their joints.
    """
    limits = np.array([drive.said(f"max_{what}") or np.inf for drive in mechanism.drives])
    put_limits(limits, what, given, mechanism.actuator_names)
    return limits
