"""States of a whole robot in MuJoCo, from configurations of the mechanism in it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Floats, Ints, Mask
from ..description.joint_coordinates import JointCoordinate
from ..description.joints import Joint
from ..description.mechanism import Mechanism
from ..errors import InvalidArgument, UnknownName
from ..extras import require
from ..files.units import metres_of
from ..motion.displacements import columns
from ..rotations import to_quaternion
from ..tolerances import TOLERANCES
from .compiled_model import CompiledModel

NEWTON_STEPS = 30
"""Most steps to close the loops; one or two are usual, from where the joints' values put them."""

SAME_ROW = 1e-4
"""Singular value, relative to the largest, below which a row of the loops follows from others, up to rounding."""

CLOSED = 1e-13
"""Gap [m or rad], and step, that are none."""

STILL = 1e-12
"""Slope of a row below which it does not move with a joint: rounding of the poses of bodies in between."""


def matched_names(mechanism: Mechanism, coordinate: JointCoordinate) -> list[str]:
    """Names that a coordinate's joint may have in the model it comes from."""
    parts = coordinate.joint.name.split("+")
    names = [coordinate.name]
    names += [parts[coordinate.place]] if len(parts) == 2 and coordinate.place < 2 else []
    names += [mechanism.end_effector] if coordinate.name == f"{mechanism.end_effector}_joint" else []
    return names


class RobotStates:
    """A model with the joints of a mechanism in it, by their names.

    Hinges and slides are as the mechanism has them, balls turn as its balls do, joints that follow others follow; then
    Newton's method on MuJoCo's rows closes what the digits of the file leave open, with the actuated joints held.
    """

    def __init__(self, mechanism: Mechanism, model: Any, configuration: str) -> None:
        require("states of a robot", "mujoco", "mujoco")
        self.mechanism, self.metres = mechanism, metres_of(mechanism.length_unit)
        self._largest = TOLERANCES.position * mechanism.characteristic_length * self.metres
        self.compiled = CompiledModel(_compiled(model))
        self.compiled.put_configuration(configuration)
        self.model, self.data = self.compiled.model, self.compiled.data
        self._scalars = dict(self._matched_scalars())
        self._balls = dict(self._matched_balls())
        self._require_joints()
        driven = {drive.column for drive in mechanism.drives}
        joint_of, is_scalar = self.model.dof_jntid, {joint: column for joint, (column, _) in self._scalars.items()}
        self._known: Mask = np.array([joint in is_scalar or joint in self._balls for joint in joint_of], bool)
        self._passive: Mask = self._known & [is_scalar.get(joint) not in driven for joint in joint_of]
        self._idle: Mask = ~self._known & ~np.isin(joint_of, self.model.actuator_trnid[:, 0])
        self.begin: Floats = self.data.qpos.copy()
        self._before: dict[int, Floats] = {}
        self._put(np.array([each.home for each in mechanism.coordinates]))
        self._close()
        self._quaternions = {joint: self._quaternion(joint).copy() for joint in self._balls}
        self._before = {joint: self._orientation_before(joint) for joint in self._balls}

    def at(self, q: Floats, begin: Floats | None) -> Floats:
        """States (..., nq of the model) at joint coordinates (..., nq of the mechanism) [rad or length].

        Parameters
        ----------
        begin : the state of the joints that the mechanism has not; default the configuration's.
        """
        rows = q.reshape(-1, q.shape[-1])
        begins = np.broadcast_to(self.begin if begin is None else begin, (*q.shape[:-1], self.model.nq))
        states = np.empty((len(rows), self.model.nq))
        for row, (values, start) in enumerate(zip(rows, begins.reshape(-1, self.model.nq), strict=True)):
            self.data.qpos[:] = start
            self._put(values)
            gap, name = self._close()
            if not gap <= self._largest:
                place = f"row {row}: " if len(rows) > 1 else ""
                found = f"{place}a loop that stays open by {gap:.3g} ({name}) where the mechanism's joints are"
                raise InvalidArgument(
                    "model", found, "the model that the mechanism was read from, or `qpos=` that fits"
                )
            states[row] = self.data.qpos
        return states.reshape(*q.shape[:-1], self.model.nq)

    def _matched_scalars(self) -> Iterator[tuple[int, tuple[int, int]]]:
        """Hinge or slide of the model -> the column of the coordinate that it is, and its place in `qpos`."""
        for each in self.mechanism.coordinates:
            names = matched_names(self.mechanism, each)
            match = next((name for name in names if name in self.compiled.joint_names), None)
            if match is not None and each.joint.type != "spherical":
                joint = self.compiled.joint_names.index(match)
                yield joint, (each.column, int(self.model.jnt_qposadr[joint]))

    def _matched_balls(self) -> Iterator[tuple[int, tuple[slice, Ints]]]:
        """Ball or free joint of the model -> the columns of its rotation vector, and of a free joint's place."""
        kinds, spans = self.compiled.mujoco.mjtJoint, columns(self.mechanism)
        for joint in self.mechanism.joints:
            if joint.type != "spherical" or joint.name not in self.compiled.joint_names:
                continue
            index = self.compiled.joint_names.index(joint.name)
            kind = kinds(int(self.model.jnt_type[index]))
            slides = [f"{joint.name}_{letter}" for letter in "xyz"] if kind == kinds.mjJNT_FREE else []
            missing = [name for name in slides if name not in spans]
            if missing or kind not in (kinds.mjJNT_FREE, kinds.mjJNT_BALL):
                found = f"joint '{joint.name}', which is no ball" if not missing else f"no slide '{missing[0]}'"
                raise InvalidArgument("model", found, "joints as the mechanism has them")
            yield index, (spans[joint.name], np.array([spans[name].start for name in slides], np.int64))

    def _require_joints(self) -> None:
        """Stop where a joint has no counterpart, unless it may be one that closes a loop: of these a model has none."""
        columns_known = {column for column, _ in self._scalars.values()}
        columns_known |= {int(column) for _, slides in self._balls.values() for column in slides}
        balls = {self.compiled.joint_names[joint] for joint in self._balls}
        known = self.compiled.joint_names
        for drive in self.mechanism.drives:
            if drive.column not in columns_known:
                raise UnknownName("actuator in the model", drive.name, known)

        def is_known(joint: Joint) -> bool:
            span = columns(self.mechanism)[joint.name]
            return joint.name in balls or all(column in columns_known for column in range(span.start, span.stop))

        joints = [joint for joint in self.mechanism.joints if joint.type != "fixed"]
        bodies = {body for joint in self.mechanism.joints for body in joint.connects}
        n_loops = len(self.mechanism.joints) - len(bodies) + 1
        equalities = {self.model.eq(index).name for index in range(self.model.neq)}
        unknown = [joint.name for joint in joints if not is_known(joint)]
        if len(unknown) > n_loops:
            raise UnknownName(
                "joint in the model", next((n for n in unknown if n not in equalities), unknown[0]), known
            )

    def _put(self, q: Floats) -> None:
        """Put the joints that are known by name where coordinates (nq,) have them, and those that follow them."""
        qpos, slides = self.data.qpos, self.compiled.is_slide
        for joint, (column, address) in self._scalars.items():
            qpos[address] = q[column] * (self.metres if slides[joint] else 1.0)
        for joint, (span, slide_columns) in self._balls.items():
            address = int(self.model.jnt_qposadr[joint])
            qpos[address : address + len(slide_columns)] = q[slide_columns] * self.metres
            if joint in self._before:
                turn = np.roll(to_quaternion(self._before[joint].T @ q[span]), 1)
                self.compiled.mujoco.mju_mulQuat(self._quaternion(joint), turn, self._quaternions[joint])
        self._follow()
        self.compiled.update()

    def _quaternion(self, joint: int) -> Floats:
        """A view of a ball's or free joint's quaternion (4,), w first."""
        address = int(self.model.jnt_qposadr[joint]) + len(self._balls[joint][1])
        quaternion: Floats = self.data.qpos[address : address + 4]
        return quaternion

    def _orientation_before(self, joint: int) -> Floats:
        """Orientation (3, 3) of the frame in which a ball turns: of the body, without this joint and later ones."""
        mujoco, model, body = self.compiled.mujoco, self.model, int(self.model.jnt_bodyid[joint])
        frame, turned = np.zeros(9), np.zeros(4)
        if not len(self._balls[joint][1]):
            mujoco.mju_mulQuat(turned, self.data.xquat[model.body_parentid[body]], model.body_quat[body])
            for before in range(int(model.body_jntadr[body]), joint):
                if not self.compiled.is_slide[before]:
                    angle, turn = (
                        self.data.qpos[model.jnt_qposadr[before]] - model.qpos0[model.jnt_qposadr[before]],
                        np.zeros(4),
                    )
                    mujoco.mju_axisAngle2Quat(turn, model.jnt_axis[before], angle)
                    mujoco.mju_mulQuat(turned, turned.copy(), turn)
        else:
            turned[0] = 1.0
        mujoco.mju_quat2Mat(frame, turned)
        return frame.reshape(3, 3)

    def _follow(self) -> None:
        """Put the joints that follow known ones by a polynomial, and those that known ones follow."""
        model, qpos = self.model, self.data.qpos
        is_joint = (model.eq_type == self.compiled.mujoco.mjtEq.mjEQ_JOINT) & (self.data.eq_active != 0)
        pending = [index for index in np.flatnonzero(is_joint) if model.eq_obj2id[index] >= 0]
        known = set(self._scalars)
        while True:
            ready = [e for e in pending if (model.eq_obj1id[e] in known) != (model.eq_obj2id[e] in known)]
            if not ready:
                return
            for equality in ready:
                follower, leader = int(model.eq_obj1id[equality]), int(model.eq_obj2id[equality])
                y, x = (int(model.jnt_qposadr[joint]) for joint in (follower, leader))
                polynomial = np.polynomial.Polynomial(model.eq_data[equality, :5])
                if leader in known:
                    qpos[y] = model.qpos0[y] + polynomial(qpos[x] - model.qpos0[x])
                else:
                    roots = (polynomial - (qpos[y] - model.qpos0[y])).roots()
                    real = roots[np.abs(roots.imag) <= STILL].real + model.qpos0[x]
                    if not len(real):
                        name = self.compiled.joint_names[leader]
                        raise InvalidArgument("model", f"no value of joint '{name}' for what follows it", "one")
                    qpos[x] = real[np.abs(real - qpos[x]).argmin()]
                known |= {follower, leader}
            pending = [e for e in pending if e not in ready]

    def _close(self) -> tuple[float, str]:
        """Close the loops that move with the mechanism; the gap [m or rad] that is left, and whose.

        Passive joints of the mechanism move; where this does not do, those too that nothing drives or knows.
        """
        begin = self.data.qpos.copy()
        gap, name = self._newton(self._passive)
        if gap > self._largest and self._idle.any():
            self.data.qpos[:] = begin
            self.compiled.update()
            closed, other = self._newton(self._passive | self._idle)
            return (closed, other) if closed <= self._largest else (gap, name)
        return gap, name

    def _newton(self, free: Mask) -> tuple[float, str]:
        """Newton's method on MuJoCo's rows, by the degrees of freedom that are free."""
        motion = np.zeros(self.model.nv)
        for _ in range(NEWTON_STEPS):
            errors, slopes, _ = self._rows(free)
            if np.abs(errors).max(initial=0.0) <= CLOSED:
                break
            motion[free] = -np.linalg.lstsq(slopes, errors, rcond=SAME_ROW)[0]
            self.compiled.move(motion)
            if np.abs(motion).max(initial=0.0) <= CLOSED:
                break
        errors, _, equalities = self._rows(free)
        if not len(errors):
            return 0.0, ""
        worst = int(np.abs(errors).argmax())
        return float(np.abs(errors[worst])), self.model.eq(int(equalities[worst])).name or "an equality without a name"

    def _rows(self, free: Mask) -> tuple[Floats, Floats, Ints]:
        """Errors (r,) of rows that move with the mechanism, slopes (r, k) by what is free, and their equalities."""
        errors, jacobian, equalities = self.compiled.rows()
        moving = np.isin(equalities, equalities[(np.abs(jacobian[:, self._known]) > STILL).any(axis=1)])
        return errors[moving], jacobian[moving][:, free], equalities[moving]


def _compiled(model: Any) -> Any:
    """The model that a caller gives: compiled, or the path or the text of a file."""
    import mujoco

    if isinstance(model, mujoco.MjModel):
        return model
    if not isinstance(model, str | os.PathLike):
        raise InvalidArgument("model", type(model).__name__, "mujoco.MjModel, or the path or text of a MuJoCo model")
    try:
        if isinstance(model, str) and model.lstrip().startswith("<"):
            return mujoco.MjModel.from_xml_string(model)
        return mujoco.MjModel.from_xml_path(str(Path(model)))
    except ValueError as error:
        raise InvalidArgument("model", " ".join(str(error).split()), "a model that MuJoCo compiles") from None
