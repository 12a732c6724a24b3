"""Joints in series as coordinates of an exported file: they must fit the actuators."""

from __future__ import annotations

from collections.abc import Sequence

from ..checks import require_names
from ..description.mechanism import Mechanism
from ..errors import UnsupportedMechanism
from ..kinematics import JointPath, joint_path, require_determined

PURPOSE = "exported"


def fitting_path(mechanism: Mechanism, joints: str | Sequence[str]) -> JointPath:
    """The path of named joints, which determine the actuators as these determine them.

    Raises
    ------
    UnsupportedMechanism : they do not, or one of them is a ball, which has no coordinates in files.
    UnknownName, InvalidArgument : no such joints, or not in series.
    """
    path = joint_path(mechanism, require_names("joints", [joints] if isinstance(joints, str) else joints))
    if any(motion.kind == "ball" for motion in path.motions):
        reason = f"joints {', '.join(path.names)}: a ball has no coordinates here, name hinges"
        raise UnsupportedMechanism(mechanism.name, [reason], PURPOSE)
    require_determined(mechanism, path.names, path.rates_of, PURPOSE)
    return path
