"""What first answers prepare, done before them: a loop, or a hand on a mouse, must not wait for it."""

from __future__ import annotations

import numpy as np

from .answers.differential import forward_jacobian, singularity
from .common.poses import pose
from .fk import solve_fk
from .ik import solve_ik
from .machine.description.mechanism import Mechanism
from .track import track

FAR = 3.0
"""How far away from home a target is out of reach of any machine [L or rad]."""


def prepare(mechanism: Mechanism) -> None:
    """Answer within reach and out of it, for poses, a path and actuator values: tenths of a second, once a machine."""
    home, shift = mechanism.home_pose, FAR * mechanism.characteristic_length
    far = pose(home[:3, 3] + shift, rotvec=(FAR, 0.0, 0.0))
    at_home = solve_ik(mechanism, home)
    solve_ik(mechanism, far)
    assert len(track(mechanism, np.stack([home, far])).q) == 2
    for change in (0.0, shift):
        solve_fk(mechanism, at_home.actuators + change)
    forward_jacobian(at_home)
    singularity(at_home)
