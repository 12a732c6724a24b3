"""A mechanism compiled for the kernels that close its loops."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Floats, Ints, Mask
from ..description.mechanism import Mechanism
from ..description.task import Task, task_of
from ..kernels.closure import loops as K
from ..kernels.handle import Handle
from .loops import loops_of


@dataclass(frozen=True, eq=False)
class Closure:
    """A mechanism compiled for the closure kernel.

    Attributes
    ----------
    loops : the table of loops that kernels read.
    scale : factor that makes a coordinate dimensionless: 1 / L for lengths, 1 for angles, (columns,).
    turning : 1 for angles, 0 for lengths, (columns,).
    last_balls : columns of ball joints at the platform, each at the end of a path that shares no joint.
    actuated, home : columns of the actuators, and their values at home, (n_a,).
    driven : columns of actuators and locked joints, which stay fixed in forward kinematics.
    """

    mechanism: Mechanism
    task: Task
    loops: K.Loops
    scale: Floats
    turning: Floats
    actuated: Ints
    driven: frozenset[int]
    last_balls: frozenset[int]
    home: Floats

    @property
    def idle(self) -> Mask:
        """Mask of coordinates on no path, such as a tool's hinge: they do not move, and only their limits matter."""
        idle = np.ones(len(self.scale), bool)
        idle[self.loops.row_columns] = False
        return idle

    @cached_property
    def cubes(self) -> float:
        """Sum over groups of the cubed number of coordinates, at least 1: the cost of one closing step."""
        on_paths = self.loops.group_of[~self.idle]
        return float(max(1.0, (np.bincount(on_paths).astype(float) ** 3).sum()))

    def actuators(self, coordinates: Floats) -> Floats:
        """The actuated values (n, n_a) in coordinates (n, columns) [length or rad]."""
        return np.asarray(coordinates[:, self.actuated] + self.home)

    def put_actuators(self, coordinates: Floats, values: Floats) -> None:
        """Write actuated values (n, n_a), and zero for locked joints, into coordinates (n, columns)."""
        coordinates[:, list(self.driven)] = 0.0
        coordinates[:, self.actuated] = values - self.home

    @cached_property
    def machine(self) -> Handle[K.Loops]:
        """The handle by which kernels open the loops."""
        return Handle(self.loops)


def closure_of(mechanism: Mechanism, *, whole: bool) -> Closure:
    """Compile a mechanism for the closure kernel.

    Parameters
    ----------
    whole : with all loops; else with those on paths to the end effector only, the joints of other loops (a gripper's)
        being idle.
    """
    loops = loops_of(mechanism, whole=whole)
    turning = np.array([float(coordinate.kind == "angle") for coordinate in mechanism.coordinates])
    scale = np.where(turning, 1.0, 1.0 / mechanism.characteristic_length)
    actuated = np.array([drive.column for drive in mechanism.drives], np.int64)
    home = np.array([drive.home for drive in mechanism.drives])
    ending = loops.columns[loops.visits[loops.paths[1:][loops.last_balls == 1] - 1, 0]]
    balls = frozenset((ending[:, None] + np.arange(3)).ravel().tolist())
    locked = [coordinate.column for coordinate in mechanism.coordinates if coordinate.joint.is_rigid]
    driven = frozenset([*actuated.tolist(), *locked])
    return Closure(mechanism, task_of(mechanism), loops, scale, turning, actuated, driven, balls, home)
