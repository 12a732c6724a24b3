"""The file that a mechanism was imported from, in MuJoCo: led to our answers, its loops closed by MuJoCo's own rows."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
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
from .digits import worst
from .loops_file import read_loops
from .mjcf_digits import ModelDigits
from .mjcf_plain import compiled, plain_model
from .urdf_plain import plain_robot
from .xml_reading import kind_of, read_xml

LED = 10
"""Steps in which joints are led from home to an answer."""

NEWTON_STEPS = 30
"""Most steps to close the loops at the end of it; half a dozen are usual."""

SAME_ROW = 1e-4
"""Singular value, relative to the largest, below which a row of the loops says what others say, up to rounding."""

STILL = 1e-13
"""Step [rad or m] that counts as none."""

EXACT = 20.0
"""How many times what rounding puts a joint off, at most, poses may differ: loops add that up, and magnify it."""


class Original:
    """A model with the joints of a mechanism in it.

    Attributes
    ----------
    position_tolerance, rotation_tolerance : how far its digits let poses be apart [m], [rad].
    """

    def __init__(
        self,
        mechanism: Mechanism,
        path: str | os.PathLike[str],
        loops: str | os.PathLike[str] | Mapping[str, Any] | None = None,
        configuration: str = "qpos0",
    ) -> None:
        require("the referee", "mujoco", "mujoco")
        import mujoco

        self.mechanism, self._mujoco = mechanism, mujoco
        self.metres = metres_of(mechanism.length_unit)
        plain = _plain(path, loops)
        self.model: Any = compiled(ET.tostring(plain, encoding="unicode"))
        self.model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        self.data: Any = mujoco.MjData(self.model)
        if configuration != "qpos0":
            keys = [self.model.key(index).name for index in range(self.model.nkey)]
            if configuration not in keys:
                raise UnknownName("configuration", configuration, ["qpos0", *keys])
            self.data.qpos[:] = self.model.key_qpos[keys.index(configuration)]
        self._names = [self.model.joint(index).name for index in range(self.model.njnt)]
        self._columns = dict(self._matched())
        self._require_drives()
        self._body = self._end_effector()
        self._free, self._balls, self._unknown = self._may_move()
        self._put(np.array([each.home for each in mechanism.coordinates]), 1.0)
        self._closed = np.ones(self.model.neq, bool)
        digits = worst(ModelDigits(plain, self.model).bodies)
        length = mechanism.characteristic_length * self.metres
        gap = self._close_home(TOLERANCES.file_gap * length)
        off = digits.angle + (digits.length + (gap if gap <= TOLERANCES.file_gap * length else 0.0)) / length
        self.rotation_tolerance = max(TOLERANCES.rotation, EXACT * off)
        self.position_tolerance = max(TOLERANCES.position * length, self.rotation_tolerance * length)
        self._home = self.data.qpos.copy()
        self._home_pose = self._pose()

    def compare(self, solution: Solution) -> tuple[float, float, float]:
        """Gap of the loops where an answer's drives are [m], and how far its pose is from ours [m], [rad]."""
        self.data.qpos[:] = self._home
        for step in range(1, LED + 1):
            self._put(np.asarray(solution.q), step / LED)
            steps = NEWTON_STEPS if step == LED else 3
            self._close(steps, self._balls)  # they were not put; what the drives leave open is to stay where it was
            gap = self._close(steps)
        place, turned = self._pose()
        begin, before = self._home_pose
        turn = turned @ before.T
        point = np.array(self.mechanism.reference_point) * self.metres
        apart = turn @ (point - begin) + place - solution.pose[:3, 3] * self.metres
        if self.mechanism.end_effector_is_joint:
            return gap, float(np.linalg.norm(apart)), 0.0
        return gap, float(np.linalg.norm(apart)), float(angles_between(turn, solution.pose[:3, :3]))

    def _matched(self) -> Iterator[tuple[int, int]]:
        """Joint of the model -> the column of the coordinate that it is."""
        renamed = f"{self.mechanism.end_effector}_joint"
        for each in self.mechanism.coordinates:
            parts = each.joint.name.split("+")
            names = [each.name, parts[each.place] if len(parts) == 2 and each.place < 2 else each.name]
            names += [self.mechanism.end_effector] if each.name == renamed else []
            found = next((name for name in names if name in self._names), None)
            if found is not None and each.joint.type != "spherical":
                yield self._names.index(found), each.column

    def _require_drives(self) -> None:
        columns = set(self._columns.values())
        for drive in self.mechanism.drives:
            if drive.column not in columns:
                raise UnknownName("actuator in the original", drive.name, self._names)

    def _end_effector(self) -> int:
        """The body of the model that is the end effector, or carries it."""
        names = [self.model.body(index).name for index in range(self.model.nbody)]
        mechanism = self.mechanism
        tips = [mechanism.end_effector]
        if mechanism.end_effector_is_joint:
            tips = [*mechanism.joint(mechanism.end_effector).connects]
        found = next((name for name in tips if name in names), None)
        if found is None:
            raise UnknownName("end effector in the original", tips[0], names)
        return names.index(found)

    def _may_move(self) -> tuple[Mask, Mask, Mask]:
        """Which degrees of freedom, (nv,), close loops, for they are of passive joints that the mechanism has; which of
        these are of balls; and which are of joints that it has not."""
        model, (free, loose, unknown) = self.model, np.zeros((3, self.model.nv), bool)
        driven = {drive.column for drive in self.mechanism.drives}
        balls = {joint.name for joint in self.mechanism.joints if joint.type == "spherical"}
        for index, name in enumerate(self._names):
            begin = int(model.jnt_dofadr[index])
            end = int(model.jnt_dofadr[index + 1]) if index + 1 < model.njnt else model.nv
            passive = index in self._columns and self._columns[index] not in driven
            loose[begin:end] = name in balls and index not in self._columns
            free[begin:end] = passive or loose[begin:end].any()
            unknown[begin:end] = name not in balls and index not in self._columns
        return free, loose, unknown

    def _put(self, q: Floats, share: float) -> None:
        """Lead the joints that are known by name towards coordinates (nq,) by a share of the way from home."""
        home = np.array([each.home for each in self.mechanism.coordinates])
        for joint, column in self._columns.items():
            slides = self.model.jnt_type[joint] == self._mujoco.mjtJoint.mjJNT_SLIDE
            value = home[column] + share * (q[column] - home[column])
            self.data.qpos[self.model.jnt_qposadr[joint]] = value * (self.metres if slides else 1.0)
        self._mujoco.mj_fwdPosition(self.model, self.data)

    def _close(self, steps: int, free: Mask | None = None) -> float:
        """Newton's method on MuJoCo's rows, with the actuated joints held; the largest gap that is left [m or rad].

        Parameters
        ----------
        free : the degrees of freedom that move, (nv,). Default: of all passive joints.
        """
        model, data, move = self.model, self.data, np.zeros(self.model.nv)
        free = self._free if free is None else free
        for _ in range(steps):
            rows, slopes = self._rows(free)
            move[free] = -np.linalg.lstsq(slopes, rows, rcond=SAME_ROW)[0]
            self._mujoco.mj_integratePos(model, data.qpos, move, 1.0)
            self._mujoco.mj_fwdPosition(model, data)
            if np.abs(move).max(initial=0.0) <= STILL:
                break
        return float(np.abs(self._rows(self._free)[0]).max(initial=0.0))

    def _close_home(self, most: float) -> float:
        """Close the loops at home, and find out which: those with joints that the mechanism has not may be others'.

        A joint that was held when the mechanism was imported is in loops of the mechanism, which close without it; one
        that was left out, for the end effector does not depend on it, is in loops that do not.
        """
        self._close(NEWTON_STEPS, self._balls)
        begin = self.data.qpos.copy()
        gap = self._close(NEWTON_STEPS)
        if gap <= most:
            return gap
        slopes = self.data.efc_J.reshape(-1, self.model.nv)[: self.data.ne]
        doubtful = np.unique(self.data.efc_id[: self.data.ne][slopes[:, self._unknown].any(axis=1)])
        self._closed[doubtful] = False
        for equality in [None, *doubtful]:
            if equality is not None:
                self._closed[equality] = True
            self.data.qpos[:] = begin
            self._mujoco.mj_fwdPosition(self.model, self.data)
            if self._close(NEWTON_STEPS) > most and equality is not None:
                self._closed[equality] = False
        self.data.qpos[:] = begin
        self._mujoco.mj_fwdPosition(self.model, self.data)
        return self._close(NEWTON_STEPS)

    def _rows(self, free: Mask) -> tuple[Floats, Floats]:
        """What is open of the loops that the mechanism has, and how that changes with what may move."""
        slopes = self.data.efc_J.reshape(-1, self.model.nv)[: self.data.ne][:, free]
        ours = slopes.any(axis=1) & self._closed[self.data.efc_id[: self.data.ne]]
        return self.data.efc_pos[: self.data.ne][ours], slopes[ours]

    def _pose(self) -> tuple[Floats, Floats]:
        return self.data.xpos[self._body].copy(), self.data.xmat[self._body].reshape(3, 3).copy()


def _plain(path: str | os.PathLike[str], loops: str | os.PathLike[str] | Mapping[str, Any] | None) -> ET.Element:
    """The kinematics of a model, or of a robot description with its loops, as a MuJoCo model."""
    if kind_of(path) == "urdf":
        return plain_robot(read_xml(path, "robot"), read_loops(loops))
    if loops is not None:
        raise InvalidArgument("loops", "some", "none: a MuJoCo model tells its loops itself")
    return plain_model(read_xml(path, "mujoco"), [])
