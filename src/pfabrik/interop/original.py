"""Answers against the file that a mechanism was imported from: led to them in MuJoCo, its loops closed by its rows."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from ..answers.solution import Solution
from ..arrays import Floats, Mask
from ..description.mechanism import Mechanism
from ..errors import InvalidArgument, UnknownName
from ..extras import require
from ..files.units import metres_of
from ..rotations import angles_between
from ..tolerances import TOLERANCES
from .compiled_model import CompiledModel
from .loops_file import read_loops
from .mjcf_plain import plain_model
from .robot_states import matched_names
from .urdf_plain import plain_robot
from .urdf_reading import read_description
from .xml_reading import kind_of, read_xml

LED = 10
"""Steps in which joints are led from home to an answer."""

NEWTON_STEPS = 30
"""Most steps to close the loops at the end of it; half a dozen are usual."""

SAME_ROW = 1e-4
"""Singular value, relative to the largest, below which a row of the loops follows from others, up to rounding."""

STILL = 1e-13
"""Step [rad or m] that counts as none."""


class Original:
    """A model with the joints of a mechanism in it.

    Attributes
    ----------
    left_out : names of its joints that the mechanism has not.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        path: str | os.PathLike[str],
        loops: str | os.PathLike[str] | Mapping[str, Any] | None = None,
        configuration: str = "qpos0",
    ) -> None:
        require("the referee", "mujoco", "mujoco")
        self.mechanism = mechanism
        self.metres = metres_of(mechanism.length_unit)
        self.compiled = CompiledModel(ET.tostring(_plain(path, loops, mechanism.actuator_names), encoding="unicode"))
        self.compiled.put_configuration(configuration)
        self.model, self.data = self.compiled.model, self.compiled.data
        self._columns = dict(self._matched())
        self._require_drives()
        self._body = self._end_effector()
        self._passive, self._balls, self._unknown = self._degrees_of_freedom()
        self.left_out = [self.compiled.joint_names[joint] for joint in set(self.model.dof_jntid[self._unknown])]
        self._is_closed = np.ones(self.model.neq, bool)
        self._put(np.array([each.home for each in mechanism.coordinates]), 1.0)
        self._close_home(TOLERANCES.file_gap * mechanism.characteristic_length * self.metres)
        self._home = self.data.qpos.copy()
        self._home_pose = self._pose()

    def compare(self, solution: Solution) -> tuple[float, float, float]:
        """Gap of the loops where an answer's drives are [m], and how far its pose is from ours [m], [rad]."""
        self.data.qpos[:] = self._home
        for step in range(1, LED + 1):
            self._put(np.asarray(solution.q), step / LED)
            n_steps = NEWTON_STEPS if step == LED else 3
            self._close(n_steps, self._balls)  # they were not put; what the drives leave open is to stay where it was
            gap = self._close(n_steps, self._passive)
        position, turned = self._pose()
        begin, turned_at_home = self._home_pose
        turn = turned @ turned_at_home.T
        point = np.array(self.mechanism.reference_point) * self.metres
        apart = turn @ (point - begin) + position - solution.pose[:3, 3] * self.metres
        if self.mechanism.end_effector_is_joint:
            return gap, float(np.linalg.norm(apart)), 0.0
        return gap, float(np.linalg.norm(apart)), float(angles_between(turn, solution.pose[:3, :3]))

    def _matched(self) -> Iterator[tuple[int, int]]:
        """Joint of the model -> the column of the coordinate that it is, by their names."""
        for each in self.mechanism.coordinates:
            names = matched_names(self.mechanism, each)
            match = next((name for name in names if name in self.compiled.joint_names), None)
            if match is not None and each.joint.type != "spherical":
                yield self.compiled.joint_names.index(match), each.column

    def _require_drives(self) -> None:
        columns = set(self._columns.values())
        for drive in self.mechanism.drives:
            if drive.column not in columns:
                raise UnknownName("actuator in the original", drive.name, self.compiled.joint_names)

    def _end_effector(self) -> int:
        """The body of the model that is the end effector, or carries it."""
        names = [self.model.body(index).name for index in range(self.model.nbody)]
        tips = [self.mechanism.end_effector]
        if self.mechanism.end_effector_is_joint:
            tips = [*self.mechanism.joint(self.mechanism.end_effector).connects]
        body = next((name for name in tips if name in names), None)
        if body is None:
            raise UnknownName("end effector in the original", tips[0], names)
        return names.index(body)

    def _degrees_of_freedom(self) -> tuple[Mask, Mask, Mask]:
        """Masks (nv,): freedoms of passive joints of the mechanism, of its balls, and of joints that it has not."""
        driven = {drive.column for drive in self.mechanism.drives}
        balls = {joint.name for joint in self.mechanism.joints if joint.type == "spherical"}
        names, columns = self.compiled.joint_names, self._columns
        is_matched = np.array([joint in columns for joint in range(len(names))], bool)
        is_driven = np.array([columns.get(joint) in driven for joint in range(len(names))], bool)
        is_ball = np.array([name in balls for name in names], bool) & ~is_matched
        joint_of = self.model.dof_jntid
        passive = (is_matched & ~is_driven) | is_ball
        return passive[joint_of], is_ball[joint_of], (~is_matched & ~is_ball)[joint_of]

    def _put(self, q: Floats, share: float) -> None:
        """Lead the joints that are known by name towards coordinates (nq,) by a share of the way from home."""
        home = np.array([each.home for each in self.mechanism.coordinates])
        for joint, column in self._columns.items():
            value = home[column] + share * (q[column] - home[column])
            self.data.qpos[self.model.jnt_qposadr[joint]] = value * (
                self.metres if self.compiled.is_slide[joint] else 1.0
            )
        self.compiled.update()

    def _close(self, n_steps: int, free: Mask) -> float:
        """Newton's method on MuJoCo's rows; the largest gap that is left [m or rad].

        Parameters
        ----------
        free : the degrees of freedom that move, (nv,).
        """
        motion = np.zeros(self.model.nv)
        for _ in range(n_steps):
            errors, slopes = self._rows(free)
            motion[free] = -np.linalg.lstsq(slopes, errors, rcond=SAME_ROW)[0]
            self.compiled.move(motion)
            if np.abs(motion).max(initial=0.0) <= STILL:
                break
        return float(np.abs(self._rows(self._passive)[0]).max(initial=0.0))

    def _close_home(self, largest: float) -> None:
        """Close the loops at home, and find out which: those with joints that the mechanism has not may not be its own.

        A joint that was held when the mechanism was imported is in loops of the mechanism, which close without it; one
        that was left out, for the end effector does not depend on it, is in loops that do not.
        """
        self._close(NEWTON_STEPS, self._balls)
        begin = self.data.qpos.copy()
        gap = self._close(NEWTON_STEPS, self._passive)
        if gap <= largest:
            return
        _, jacobian, equalities = self.compiled.rows()
        doubtful = np.unique(equalities[jacobian[:, self._unknown].any(axis=1)])
        self._is_closed[doubtful] = False
        self._close_from(begin)
        for equality in doubtful:
            self._is_closed[equality] = True
            self._is_closed[equality] = self._close_from(begin) <= largest
        self._close_from(begin)

    def _close_from(self, qpos: Floats) -> float:
        """Close the loops from a configuration of the model; the largest gap that is left [m or rad]."""
        self.data.qpos[:] = qpos
        self.compiled.update()
        return self._close(NEWTON_STEPS, self._passive)

    def _rows(self, free: Mask) -> tuple[Floats, Floats]:
        """Errors (r,) of the loops that the mechanism has, and their slopes (r, k) by the freedoms that move."""
        errors, jacobian, equalities = self.compiled.rows()
        slopes = jacobian[:, free]
        moving = slopes.any(axis=1) & self._is_closed[equalities]
        return errors[moving], slopes[moving]

    def _pose(self) -> tuple[Floats, Floats]:
        return self.data.xpos[self._body].copy(), self.data.xmat[self._body].reshape(3, 3).copy()


def _plain(
    path: str | os.PathLike[str], loops: str | os.PathLike[str] | Mapping[str, Any] | None, driven: Sequence[str]
) -> ET.Element:
    """The kinematics of a model, or of a robot description with its loops, as a MuJoCo model."""
    if kind_of(path) != "mjcf":
        return plain_robot(*read_description(read_xml(path, "urdf", "sdf"), read_loops(loops), driven, []))
    if loops is not None:
        raise InvalidArgument("loops", "some", "none: a MuJoCo model tells its loops itself")
    return plain_model(read_xml(path, "mjcf"), [])
