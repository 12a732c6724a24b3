"""A robot in MuJoCo, put where a mechanism in it has its joints, with its loops closed by MuJoCo's own rows."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...common.arrays import Floats, Ints, Mask
from ...common.extras import require
from ...common.rotations import to_quaternion
from ...errors import InvalidArgument, UnknownName
from ...kinematics import columns, displacements, home_coordinates
from ...machine.description.joint_coordinates import JointCoordinate
from ...machine.description.joints import Joint
from ...machine.description.mechanism import Mechanism
from ...machine.files.units import metres_of
from ...tolerances import TOLERANCES
from .mjcf_bodies import si_unit
from .mjcf_model import CLOSED, NEWTON_STEPS, SAME_ROW, CompiledModel, frame_of

AT_REST = 1e-13
"""Step that is none [m or rad]."""

SAME_PLACE = 1e-3
"""How far joints may be from where the mechanism has them [L]: digits of another file of the same robot."""

STILL = 1e-12
"""Slope of a row below which it does not move with a joint: rounding of the poses of bodies in between."""


class RobotInMujoco(CompiledModel):
    """A model with the joints of a mechanism in it, by their names.

    Hinges and slides are as the mechanism has them, balls turn as its balls do, joints that follow others follow; then
    Newton's method on MuJoCo's rows closes what the digits of the file leave open, with the actuated joints held.

    Parameters
    ----------
    model : compiled, or the path or the text of one.
    configuration : the mechanism's home in it; None for the first of "qpos0" and the keyframes that has it.
    same_row : as of `SAME_ROW`.
    is_whole : joints that the mechanism has not, and nothing drives, move too, where that is what closes loops.

    Attributes
    ----------
    begin : the state of the joints that the mechanism has not, (nq of the model,).
    passive, unknown : the degrees of freedom of the mechanism's passive joints, and of joints that it has not, (nv,).
    """

    def __init__(
        self,
        mechanism: Mechanism,
        model: Any,
        configuration: str | ArrayLike | None,
        same_row: float = SAME_ROW,
        is_whole: bool = False,
    ) -> None:
        require("a robot in MuJoCo", "mujoco", "mujoco")
        super().__init__(_compiled(model))
        self.mechanism, self.metres, self._same_row = mechanism, metres_of(mechanism.length_unit), same_row
        self._size = mechanism.characteristic_length * self.metres
        self._scalars: dict[int, int] = {}
        self._places: dict[int, int] = {}
        self._balls: dict[int, tuple[slice, int]] = {}
        self._floating: dict[int, str] = {}
        self._afloat: dict[int, Floats] = {}
        self._match()
        self._require_joints()
        self.put_configuration(self._home_in_model() if configuration is None else configuration)
        self.begin: Floats = self.data.qpos.copy()
        driven, joint_of = {drive.column for drive in mechanism.drives}, self.model.dof_jntid
        names = {joint.name for joint in mechanism.joints}
        known = {*self._scalars, *self._balls, *(n for n, name in enumerate(self.joint_names) if name in names)}
        self.unknown: Mask = np.array([joint not in known for joint in joint_of], bool)
        self.passive: Mask = ~self.unknown & [self._scalars.get(joint) not in driven for joint in joint_of]
        self._idle: Mask = self.unknown & ~np.isin(joint_of, self.model.actuator_trnid[:, 0]) & is_whole
        self.put_home()

    def put_home(self) -> None:
        """Take the mechanism's home, closed, from which its balls turn."""
        self.take(self.begin)
        self._homes = {joint: (np.eye(3), self._quaternion(joint).copy()) for joint in self._balls}
        home = np.array([each.home for each in self.mechanism.coordinates])
        self.put(home)
        self._afloat = {joint: self._home_afloat(joint) for joint in self._floating}
        self.put(home)
        self.close()
        self._homes = {joint: (self._frame_before(joint), self._quaternion(joint).copy()) for joint in self._balls}

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
            self.put(values, start)
            gap, name = self.close()
            if not gap <= self._largest:
                place = f"row {row}: " if len(rows) > 1 else ""
                found = f"{place}a loop that stays open by {gap:.3g} ({name}) where the mechanism's joints are"
                raise InvalidArgument(
                    "model", found, "the model that the mechanism was read from, or `qpos=` that fits"
                )
            states[row] = self.data.qpos
        return states.reshape(*q.shape[:-1], self.model.nq)

    def put(self, q: Floats, begin: Floats | None = None) -> None:
        """Put the joints that are known by name where coordinates (nq,) have them, and those that follow them."""
        qpos, coordinates = self.data.qpos, self.mechanism.coordinates
        qpos[:] = self.begin if begin is None else begin
        for column, address in self._places.items():
            qpos[address] = q[column] * si_unit(coordinates[column], self.metres)
        for joint, (span, _) in self._balls.items():
            before, home = self._homes[joint]
            is_inward = self.model.body(self.model.jnt_bodyid[joint]).name == coordinates[span][0].joint.connects[0]
            turn = to_quaternion(before.T @ q[span] * (-1.0 if is_inward else 1.0))
            self.mujoco.mju_mulQuat(self._quaternion(joint), np.roll(turn, 1), home)
        self._float(q)
        self._follow()
        self.update()

    def close(self) -> tuple[float, str]:
        """Close the loops that move with the mechanism; the gap that is left, as of `gap`, and whose.

        Passive joints of the mechanism move; where this does not do, those of others too that may.
        """
        begin = self.data.qpos.copy()
        gap, name = self._newton(self.passive)
        if gap <= self._largest or not self._idle.any():
            return gap, name
        midway = self.data.qpos.copy()
        self.take(begin)
        self._newton(self._idle)
        closed, other = self._newton(self.passive | self._idle)
        if closed <= self._largest:
            return closed, other
        self.take(midway)
        return gap, name

    def gap(self) -> tuple[float, str]:
        """The largest gap of the loops that move with the mechanism [m; angles of welds times L], and whose it is."""
        errors, jacobian, equalities = self.rows()
        is_weld = self.model.eq_type[equalities] == self.mujoco.mjtEq.mjEQ_WELD
        row = np.arange(len(equalities)) - np.searchsorted(equalities, equalities)
        is_angle = is_weld & (row >= 3)  # the last three rows of every six
        sizes = np.abs(errors) * np.where(is_angle, self._size, 1.0) * self._moving(jacobian, equalities)
        if not sizes.any():
            return 0.0, ""
        worst = int(sizes.argmax())
        return float(sizes[worst]), self.model.eq(int(equalities[worst])).name or "an equality without a name"

    @property
    def _largest(self) -> float:
        """The gap up to which loops count as closed [m]."""
        return TOLERANCES.position * self._size

    def _match(self) -> None:
        """Find the joints of the mechanism in the model: the places of their coordinates in `qpos`, and the balls."""
        kinds, spans, known = self.mujoco.mjtJoint, columns(self.mechanism), self.joint_names
        for each in self.mechanism.coordinates:
            match = next((name for name in _names_of(self.mechanism, each) if name in known), None)
            joint = -1 if match is None or each.joint.type == "spherical" else known.index(match)
            if joint >= 0 and kinds(int(self.model.jnt_type[joint])) in (kinds.mjJNT_HINGE, kinds.mjJNT_SLIDE):
                self._scalars[joint], self._places[each.column] = each.column, int(self.model.jnt_qposadr[joint])
        for ball in self.mechanism.joints:
            if ball.type != "spherical" or ball.name not in known:
                continue
            joint = known.index(ball.name)
            kind, address = kinds(int(self.model.jnt_type[joint])), int(self.model.jnt_qposadr[joint])
            slides = [f"{ball.name}_{letter}" for letter in "xyz"] if kind == kinds.mjJNT_FREE else []
            missing = [name for name in slides if name not in spans]
            if missing or kind not in (kinds.mjJNT_FREE, kinds.mjJNT_BALL):
                found = f"joint '{ball.name}', which is no ball" if not missing else f"no slide '{missing[0]}'"
                raise InvalidArgument("model", found, "joints as the mechanism has them")
            self._places |= {spans[name].start: address + place for place, name in enumerate(slides)}
            self._balls[joint] = spans[ball.name], address + len(slides)
        for joint in np.flatnonzero(self.model.jnt_type == kinds.mjJNT_FREE).tolist():
            welded = np.flatnonzero(self.model.body_weldid == self.model.jnt_bodyid[joint])
            bodies = [str(self.model.body(index).name) for index in welded]
            afloat = next((body for body in bodies if body in self.mechanism.bodies), None)
            if joint not in self._balls and afloat is not None:
                self._floating[joint] = afloat

    def _home_in_model(self) -> str:
        """The first configuration of the model whose joints have the mechanism's values at home, else "qpos0"."""
        names = ["qpos0", *(str(self.model.key(index).name) for index in range(self.model.nkey))]
        home = {n: each.home * si_unit(each, self.metres) for n, each in enumerate(self.mechanism.coordinates)}
        for name, qpos in zip(names, [self.model.qpos0, *self.model.key_qpos], strict=True):
            off = [qpos[address] - home[column] for column, address in self._places.items()]
            if name and np.abs(off).max(initial=0.0) <= TOLERANCES.alignment:
                return name
        return "qpos0"

    def _float(self, q: Floats) -> None:
        """Put what floats freely, of which the mechanism has the body and not the joint, where it has it.

        The world is what the mechanism's base coordinates are.
        """
        if not self._afloat:
            return
        moved = displacements(self.mechanism, (q - home_coordinates(self.mechanism))[None])
        for joint, home in self._afloat.items():
            address, motion = int(self.model.jnt_qposadr[joint]), moved[self._floating[joint]][0].copy()
            motion[:3, 3] *= self.metres
            pose = motion @ home
            self.data.qpos[address : address + 3] = pose[:3, 3]
            turn = np.ascontiguousarray(pose[:3, :3]).ravel()
            self.mujoco.mju_mat2Quat(self.data.qpos[address + 3 : address + 7], turn)

    def _home_afloat(self, joint: int) -> Floats:
        """The pose (4, 4) at home of a body that floats, in base coordinates [m], by the joints that are on it."""
        root, here, there = self.model.body_rootid[self.model.jnt_bodyid[joint]], [], []
        for index, column in self._scalars.items():
            own = self.mechanism.coordinates[column].joint
            if own.at is None or own.axis is None or self.model.body_rootid[self.model.jnt_bodyid[index]] != root:
                continue
            at = np.array(own.at) * self.metres
            here += [at, at + self._size * np.array(own.axis)]
            there += [self.data.xanchor[index], self.data.xanchor[index] + self._size * self.data.xaxis[index]]
        place = int(self.model.jnt_bodyid[joint])
        frame = frame_of(self.data.xpos[place], self.data.xmat[place])
        if not here:
            return frame
        middle, other = np.mean(here, axis=0), np.mean(there, axis=0)
        left, _, right = np.linalg.svd((np.array(here) - middle).T @ (np.array(there) - other))
        turn = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
        off = np.abs((np.array(there) - other) @ turn.T + middle - here).max()
        if not off <= SAME_PLACE * self._size:
            found = f"joints that are up to {off:.3g} m away from where the mechanism has them at home"
            raise InvalidArgument("model", found, "the robot that the mechanism was made of")
        return frame_of(middle - turn @ other, turn) @ frame

    def _require_joints(self) -> None:
        """Stop where a joint has no counterpart, unless it may be one that closes a loop, or holds what else floats."""
        for drive in self.mechanism.drives:
            if drive.column not in self._places:
                raise UnknownName("actuator in the model", drive.name, self.joint_names)

        def is_known(joint: Joint) -> bool:
            span = columns(self.mechanism)[joint.name]
            return joint.name in self.joint_names or all(n in self._places for n in range(span.start, span.stop))

        joints = [joint for joint in self.mechanism.joints if joint.type != "fixed"]
        n_loops = len(self.mechanism.joints) - len(self.mechanism.bodies) + 1 + len(self._floating)
        equalities = {self.model.eq(index).name for index in range(self.model.neq)}
        unknown = [joint.name for joint in joints if not is_known(joint)]
        if len(unknown) > n_loops:
            name = next((name for name in unknown if name not in equalities), unknown[0])
            raise UnknownName("joint in the model", name, self.joint_names)

    def _quaternion(self, joint: int) -> Floats:
        """A view of a ball's or free joint's quaternion (4,), w first."""
        address = self._balls[joint][1]
        quaternion: Floats = self.data.qpos[address : address + 4]
        return quaternion

    def _frame_before(self, joint: int) -> Floats:
        """Orientation (3, 3) of the frame in which a ball turns: of its body, without this joint and later ones."""
        state, body = self.data.qpos.copy(), int(self.model.jnt_bodyid[joint])
        last = int(self.model.body_jntadr[body] + self.model.body_jntnum[body])
        later = self.model.jnt_qposadr[joint + 1 : last]
        self._quaternion(joint)[:] = 1.0, 0.0, 0.0, 0.0
        self.data.qpos[later] = self.model.qpos0[later]
        self.update()
        frame: Floats = self.data.xmat[body].reshape(3, 3).copy()
        self.take(state)
        return frame

    def _follow(self) -> None:
        """Put the joints that follow known ones by a polynomial, and those that known ones follow."""
        model, qpos = self.model, self.data.qpos
        is_joint = (model.eq_type == self.mujoco.mjtEq.mjEQ_JOINT) & (self.data.eq_active != 0)
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
                        name = self.joint_names[leader]
                        raise InvalidArgument("model", f"no value of joint '{name}' for what follows it", "one")
                    qpos[x] = real[np.abs(real - qpos[x]).argmin()]
                known |= {follower, leader}
            pending = [e for e in pending if e not in ready]

    def _newton(self, free: Mask) -> tuple[float, str]:
        """Newton's method on MuJoCo's rows, by the degrees of freedom that are free; the gap, and whose."""
        motion = np.zeros(self.model.nv)
        for _ in range(NEWTON_STEPS):
            errors, jacobian, equalities = self.rows()
            moving = self._moving(jacobian, equalities)
            if np.abs(errors[moving]).max(initial=0.0) <= CLOSED:
                break
            motion[free] = -np.linalg.lstsq(jacobian[moving][:, free], errors[moving], rcond=self._same_row)[0]
            self.move(motion)
            if np.abs(motion).max(initial=0.0) <= AT_REST:
                break
        return self.gap()

    def _moving(self, jacobian: Floats, equalities: Ints) -> Mask:
        """Mask (r,) of the rows of equalities that move with the mechanism."""
        by_known = (np.abs(jacobian[:, ~self.unknown]) > STILL).any(axis=1)
        return np.isin(equalities, equalities[by_known])


def _names_of(mechanism: Mechanism, coordinate: JointCoordinate) -> list[str]:
    """Names that a coordinate's joint may have in the model it comes from."""
    names = [*dict.fromkeys((coordinate.name, coordinate.alias))]
    names += [mechanism.end_effector] if coordinate.name == f"{mechanism.end_effector}_joint" else []
    return names


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
