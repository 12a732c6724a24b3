"""A path as a table of MuJoCo's joint positions, a row a target."""

from __future__ import annotations

from collections.abc import Iterator
from os import PathLike
from typing import TextIO

import numpy as np

from ...capabilities.paths.follow import TrackPart
from ...common.cells import CsvWriter
from ...machine.description.mechanism import Mechanism
from .robot_in_mujoco import RobotInMujoco

OF_A_TURN = ("qw", "qx", "qy", "qz")
"""What stands behind the name of a joint for each number of a quaternion."""


class QposRows:
    """Writes the states of a robot on its way to a file: a line of names, then a row for each target.

    Parameters
    ----------
    handle : where to.
    model : the robot's, or its path.
    """

    def __init__(self, handle: TextIO, mechanism: Mechanism, model: str | PathLike[str]) -> None:
        self._writer, self._robot = CsvWriter(handle), RobotInMujoco(mechanism, model, None, is_whole=True)
        self._writer.writerow(list(_names(self._robot)))

    def write(self, part: TrackPart) -> None:
        """Write the rows of a part that are new."""
        q = np.asarray(part.track.q)[part.first :]
        self._writer.writerows(self._robot.at(q, None).tolist())


def _names(robot: RobotInMujoco) -> Iterator[str]:
    """A name for every number of `qpos`; joints without a name are called as their bodies."""
    kinds = robot.mujoco.mjtJoint
    for index, name in enumerate(robot.joint_names):
        called = name or str(robot.model.body(robot.model.jnt_bodyid[index]).name)
        kind = kinds(int(robot.model.jnt_type[index]))
        if kind == kinds.mjJNT_FREE:
            yield from (f"{called}_{axis}" for axis in "xyz")
        if kind in (kinds.mjJNT_FREE, kinds.mjJNT_BALL):
            yield from (f"{called}_{part}" for part in OF_A_TURN)
        else:
            yield called
