"""A compiled MuJoCo model as joints between bodies, and the loops that its equalities close."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator
from functools import cached_property
from itertools import pairwise
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import ArrayLike

from ...common.arguments import array
from ...common.arrays import Floats, Ints, Mask
from ...errors import InvalidArgument, UnknownName
from ...machine.description.joints import Joint
from .couplings import Coupling
from .digits import ModelDigits, Rounding, worst
from .driving import Rates
from .names import unique
from .notes import Note, note_names
from .opened import Loop
from .xml_fields import friction_of
from .xml_reading import fault

NEWTON_STEPS = 30
"""Most steps to close the loops; one or two are usual, from where the joints' values put them."""

SAME_ROW = 1e-4
"""Singular value, relative to the largest, below which a row of the loops follows from others, up to rounding."""

CLOSED = 1e-15
"""Gap that is none [m or rad]."""


class CompiledModel:
    """A model that is compiled, of a text or as a copy of another, and its state; sites are where the text puts them.

    MuJoCo takes frames that are less than 1e-6 apart, in whatever unit, for one; asked not to, it computes both.

    Attributes
    ----------
    model, data : MuJoCo's `MjModel` and `MjData`.
    is_slide : of the joints, (njnt,).
    joint_names : of the joints; those without a name have "".
    """

    def __init__(self, model: Any) -> None:
        import mujoco

        self.mujoco: Any = mujoco
        self.model: Any = mujoco.MjModel.from_xml_string(model) if isinstance(model, str) else copy.deepcopy(model)
        self.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        self.model.site_sameframe[:] = int(mujoco.mjtSameFrame.mjSAMEFRAME_NONE)
        self.model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        self.data: Any = mujoco.MjData(self.model)
        self.is_slide: Mask = self.model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE
        self.joint_names = [str(self.model.joint(index).name) for index in range(self.model.njnt)]

    def put_configuration(self, name: str | ArrayLike) -> None:
        """Take "qpos0", the configuration of a keyframe, UnknownName where there is none of this name, or (nq,)."""
        if not isinstance(name, str):
            qpos = array("configuration", name, "nq")
            if qpos.shape != (self.model.nq,):
                raise InvalidArgument("configuration", f"shape {qpos.shape}", f"qpos of shape ({self.model.nq},)")
            self.data.qpos[:] = qpos
        elif name != "qpos0":
            keys = [self.model.key(index).name for index in range(self.model.nkey)]
            if name not in keys:
                raise UnknownName("configuration", name, ["qpos0", *keys])
            self.data.qpos[:] = self.model.key_qpos[keys.index(name)]

    def update(self) -> None:
        """Compute everything that follows from the coordinates."""
        self.mujoco.mj_fwdPosition(self.model, self.data)

    def take(self, qpos: ArrayLike) -> None:
        """Take a state (nq,)."""
        self.data.qpos[:] = qpos
        self.update()

    def move(self, motion: ArrayLike) -> None:
        """Move the joints by (nv,) [rad or m]."""
        self.mujoco.mj_integratePos(self.model, self.data.qpos, motion, 1.0)
        self.update()

    def close_all(self) -> float:
        """Close all loops by Newton's method on all joints; the largest error that is left [m or rad]."""
        for _ in range(NEWTON_STEPS):
            errors, jacobian, _ = self.rows()
            if np.abs(errors).max(initial=0.0) <= CLOSED:
                break
            self.move(-np.linalg.lstsq(jacobian, errors, rcond=SAME_ROW)[0])
        return float(np.abs(self.rows()[0]).max(initial=0.0))

    def rows(self) -> tuple[Floats, Floats, Ints]:
        """Errors (r,) [m or rad] of the rows of equalities, their Jacobian (r, nv), and their equalities (r,)."""
        data, count = self.data, self.data.ne
        return data.efc_pos[:count], data.efc_J.reshape(-1, self.model.nv)[:count], data.efc_id[:count]


def frame_of(at: Floats, turn: Floats) -> Floats:
    """The frame (4, 4) of an origin (3,) and a rotation (9,)."""
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = turn.reshape(3, 3), at
    return frame


class MjcfModel(CompiledModel):
    """A model in one configuration, as joints and loops.

    Attributes
    ----------
    roundings : joint or loop -> how exactly the digits of the file place it [m, rad], of those that were read.
    """

    def __init__(self, plain: ET.Element, configuration: str | ArrayLike) -> None:
        try:
            super().__init__(ET.tostring(plain, encoding="unicode"))
        except ValueError as error:
            reason = str(error).replace("\n", " ").strip()
            raise fault("model", f"what MuJoCo does not compile ({reason})", "a model that it does") from None
        self.put_configuration(configuration)
        self.mujoco.mj_normalizeQuat(self.model, self.data.qpos)
        self.mujoco.mj_kinematics(self.model, self.data)
        self._digits = ModelDigits(plain, self.model)
        self.roundings: dict[str, Rounding] = {}
        self._bodies = {self.body(index) for index in range(self.model.nbody)}

    def body(self, index: int) -> str:
        """Name of a body; a number where it has none."""
        return str(self.model.body(index).name) or f"body_{index}"

    def joint(self, index: int) -> str:
        """Name of a joint; a number where it has none."""
        return self.joint_names[index] or f"joint_{index}"

    def tendon(self, index: int) -> str:
        """Name of a tendon; a number where it has none."""
        return str(self.model.tendon(index).name) or f"tendon_{index}"

    def note_rounding(self, names: Iterable[str], sites: Iterable[int]) -> None:
        """Have joints and loops placed as exactly as the worst of some sites."""
        self.roundings |= dict.fromkeys(names, worst(map(self._digits.site, sites)))

    @cached_property
    def targets(self) -> Ints:
        """What each actuator drives, (nu,): the index of a joint, or of a tendon, which come behind all joints."""
        is_tendon = self.model.actuator_trntype == self.mujoco.mjtTrn.mjTRN_TENDON
        return np.asarray(self.model.actuator_trnid[:, 0] + is_tendon * self.model.njnt)

    @cached_property
    def target_names(self) -> list[str]:
        """Names of joints, then of tendons."""
        return [*map(self.joint, range(self.model.njnt)), *map(self.tendon, range(self.model.ntendon))]

    @property
    def driven(self) -> list[str]:
        """Names of the joints and tendons that are driven, in the order of the actuators."""
        return [self.target_names[target] for target in self.targets]

    def rates(self, notes: list[Note]) -> dict[str, Rates]:
        """The armature and the friction of each joint and tendon, and the most that actuators exert, by its name."""
        model = self.model
        of_joints = np.array([model.dof_armature, model.dof_frictionloss, model.dof_damping])[:, model.jnt_dofadr]
        of_tendons = np.array([model.tendon_armature, model.tendon_frictionloss, model.tendon_damping])
        said, found, uneven = np.hstack([of_joints, of_tendons]) + self._of_actuators(), {}, []
        for name, (low, high), own in zip(self.target_names, self._forces(), said.T.tolist(), strict=True):
            most, (armature, dry, viscous) = float(min(-low, high)), own
            found[name] = Rates(
                max_torque=most if 0.0 < most < np.inf else None,
                rotor_inertia=armature or None,
                friction=friction_of(dry, viscous),
            )
            uneven += [name] * bool(-low != high)
        note_names(notes, "actuators exert more one way: the smaller limit counts, none where it is 0, of", uneven)
        curved = [getattr(model, f"{each}_dampingpoly", np.zeros((0, 0))).any(axis=1) for each in ("dof", "actuator")]
        names = [self.joint(int(model.dof_jntid[dof])) for dof in np.flatnonzero(curved[0])]
        names += [self.driven[k] for k in np.flatnonzero(curved[1])]
        note_names(notes, "damping by powers of the rate is left out, of", dict.fromkeys(names))
        return found

    def _of_actuators(self) -> Floats:
        """Armature, dry friction and damping that the actuators of each target add to its own, (3, targets)."""
        model, added = self.model, np.zeros((3, len(self.target_names)))
        squares = model.actuator_gear[:, 0] ** 2
        for row, name in ((0, "actuator_armature"), (2, "actuator_damping")):  # since MuJoCo 3.4
            np.add.at(added[row], self.targets, squares * getattr(model, name, np.zeros(model.nu)))
        return added

    def _forces(self) -> Floats:
        """The lowest and the highest force of the actuators on each target, (targets, 2) [N, N m]; else infinite."""
        model, mujoco = self.model, self.mujoco
        found = np.tile([-np.inf, np.inf], (len(self.target_names), 1))
        found[self.targets] = 0.0
        for k, target in enumerate(self.targets):
            ends = model.actuator_forcerange[k] if model.actuator_forcelimited[k] else np.array([-np.inf, np.inf])
            is_fixed = model.actuator_gaintype[k] == mujoco.mjtGain.mjGAIN_FIXED
            is_alone = model.actuator_biastype[k] == mujoco.mjtBias.mjBIAS_NONE
            is_force = is_fixed and is_alone and model.actuator_dyntype[k] != mujoco.mjtDyn.mjDYN_INTEGRATOR
            if is_force and model.actuator_ctrllimited[k]:
                ends = np.clip(np.sort(model.actuator_gainprm[k, 0] * model.actuator_ctrlrange[k]), *ends)
            found[target] += np.sort(model.actuator_gear[k, 0] * ends)
        for joint in np.flatnonzero(model.jnt_actfrclimited):
            found[joint] = np.clip(found[joint], *model.jnt_actfrcrange[joint])
        return found

    def places(self) -> dict[str, tuple[str, Floats]]:
        """Body or site -> its body, and its frame (4, 4) [m]."""
        model, data = self.model, self.data
        sites = {
            str(model.site(i).name): (self.body(model.site_bodyid[i]), frame_of(data.site_xpos[i], data.site_xmat[i]))
            for i in range(model.nsite)
        }
        bodies = {self.body(i): frame_of(data.xpos[i], data.xmat[i]) for i in range(model.nbody)}
        return sites | {body: (body, frame) for body, frame in bodies.items()}

    def joints(self, notes: list[Note]) -> Iterator[Joint]:
        """Yield every joint, between its body and the parent's; several on one body have bodies between them."""
        model = self.model
        limited_balls = []
        for index in range(1, model.nbody):
            parent, body = self.body(model.body_parentid[index]), self.body(index)
            begin, count = int(model.body_jntadr[index]), int(model.body_jntnum[index])
            parts: list[dict[str, Any]] = []
            for joint in range(begin, begin + count):
                parts += self._parts(joint)
                self.roundings[self.joint(joint)] = self._digits.joint(joint)
                if bool(model.jnt_type[joint] == self.mujoco.mjtJoint.mjJNT_BALL) and model.jnt_limited[joint]:
                    limited_balls.append(self.joint(joint))
            parts = parts or [{"name": unique(f"{body}:weld", self._bodies), "type": "fixed"}]
            between = [unique(f"{body}:{part['name']}", self._bodies) for part in parts[:-1]]
            for part, connects in zip(parts, pairwise([parent, *between, body]), strict=True):
                yield Joint(connects=connects, **part)
        note_names(notes, "a ball's range is no limit here: it is left out", limited_balls)

    def _parts(self, index: int) -> Iterator[dict[str, Any]]:
        """Yield the fields of the joints that one of the model is in series: a free joint, three slides and a ball."""
        model, data, kinds = self.model, self.data, self.mujoco.mjtJoint
        name, kind = self.joint(index), kinds(int(model.jnt_type[index]))
        at, axis = data.xanchor[index].copy(), data.xaxis[index].copy()
        address = int(model.jnt_qposadr[index])
        if kind == kinds.mjJNT_FREE:
            for letter, direction, home in zip("xyz", np.eye(3), data.qpos[address:], strict=False):
                yield {"name": f"{name}_{letter}", "type": "prismatic", "axis": direction, "home": home}
        if kind in (kinds.mjJNT_FREE, kinds.mjJNT_BALL):
            yield {"name": name, "type": "spherical", "at": at}
            return
        is_hinge = kind == kinds.mjJNT_HINGE
        yield {
            "name": name,
            "type": "revolute" if is_hinge else "prismatic",
            "at": at if is_hinge else None,
            "axis": axis,
            "actuated": index in self.targets,
            "home": float(data.qpos[address]),
            "range": model.jnt_range[index].tolist() if model.jnt_limited[index] else None,
        }

    def loops(self, notes: list[Note]) -> list[Loop]:
        """Every active equality of two points, or two frames, that are to meet."""
        note_names(notes, "an equality that is not active is left out", (each.name for each in self.inactive_loops()))
        return list(self._loops(active=True))

    def inactive_loops(self) -> list[Loop]:
        """Every equality that would close a loop, but is not active."""
        return list(self._loops(active=False))

    def _loops(self, active: bool) -> Iterator[Loop]:
        model, kinds = self.model, self.mujoco.mjtEq
        taken = {self.joint(index) for index in range(model.njnt)}
        for index in range(model.neq):
            kind = kinds(int(model.eq_type[index]))
            if kind not in (kinds.mjEQ_CONNECT, kinds.mjEQ_WELD):
                continue
            name = unique(str(model.eq(index).name) or f"closure_{index + 1}", taken)
            if bool(model.eq_active0[index]) == active:
                is_weld = kind == kinds.mjEQ_WELD
                holds_frames = is_weld and model.eq_data[index, 10] != 0.0
                bodies, points, frames, self.roundings[name] = self._sides(index, is_weld)
                yield Loop(
                    name, "fixed" if holds_frames else "spherical", bodies, points, frames if holds_frames else None
                )

    def _sides(self, index: int, is_weld: bool) -> tuple[tuple[str, str], Floats, Floats, Rounding]:
        """The two bodies of an equality, point (2, 3) and frame (2, 3, 3) on each, the rounding of the worse side."""
        model, data = self.model, self.data
        ends = [int(model.eq_obj1id[index]), int(model.eq_obj2id[index])]
        if model.eq_objtype[index] == self.mujoco.mjtObj.mjOBJ_SITE:
            first, second = (self.body(model.site_bodyid[site]) for site in ends)
            frames = data.site_xmat[ends].reshape(2, 3, 3).copy()
            return (first, second), data.site_xpos[ends].copy(), frames, worst(map(self._digits.site, ends))
        values = model.eq_data[index]
        anchors = np.array([values[3:6], values[:3]] if is_weld else [values[:3], values[3:6]])
        frames = data.xmat[ends].reshape(2, 3, 3).copy()
        points = data.xpos[ends] + np.einsum("bij,bj->bi", frames, anchors)
        if is_weld:
            relative = np.empty(9)
            self.mujoco.mju_quat2Mat(relative, values[6:10])
            frames[0] = frames[0] @ relative.reshape(3, 3)
        rounding = worst(self._digits.anchor(end, anchors[side], bool(side)) for side, end in enumerate(ends))
        return (self.body(ends[0]), self.body(ends[1])), points, frames, rounding

    def couplings(self, notes: list[Note]) -> Iterator[Coupling]:
        """Yield every active equality of two joints, as coordinates count."""
        inactive = []
        for follower, leader, factors, is_active in self._joint_equalities():
            if leader >= 0 and is_active:
                y, x = (float(self.model.qpos0[self.model.jnt_qposadr[joint]]) for joint in (follower, leader))
                begin = y + factors[0] - factors[1] * x  # factors count from the reference; higher ones stay with it
                yield Coupling(self.joint(follower), self.joint(leader), (begin, *factors[1:]))
            elif not is_active:
                inactive += [self.joint(joint) for joint in (follower, leader) if joint >= 0]
        note_names(notes, "an equality that is not active is left out, of", inactive)

    def held(self, notes: list[Note]) -> list[str]:
        """Joints that an equality keeps where they are."""
        names = [self.joint(joint) for joint, leader, _, active in self._joint_equalities() if leader < 0 and active]
        note_names(notes, "an equality holds these where they are", names)
        return names

    def _joint_equalities(self) -> Iterator[tuple[int, int, tuple[float, ...], bool]]:
        """Yield follower and leader of each equality of joints, -1 for no leader, its factors, and if it is active."""
        model = self.model
        for index in np.flatnonzero(model.eq_type == self.mujoco.mjtEq.mjEQ_JOINT):
            factors = tuple(model.eq_data[index, :5].tolist())
            yield int(model.eq_obj1id[index]), int(model.eq_obj2id[index]), factors, bool(model.eq_active0[index])
