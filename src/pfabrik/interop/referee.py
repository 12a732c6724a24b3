"""MuJoCo as the referee: what its own kinematics and its own constraint rows say of our answers."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..answers.solution import Solution
from ..arrays import Floats, Mask
from ..description.home_mobility import end_effector_freedom
from ..description.mechanism import Mechanism
from ..extras import require
from ..files.units import metres_of
from ..motion.displacements import columns
from ..rotations import to_quaternion
from .cuts import cut_tree
from .mjcf_bodies import names_of
from .mjcf_plain import compiled
from .mjcf_writing import to_mjcf

NEWTON_STEPS = 30
"""Most steps in which the referee closes loops that were opened by `APART`; five are usual."""

CLOSED = 1e-15
"""Gap of all rows at which the referee stops [m and rad]: rounding."""

APART = 1e-3
"""How far passive joints are moved off before the referee closes the loops by itself [rad or L]."""

SAME_ROW = 1e-9
"""Singular value, relative to the largest, below which a row of the loops says what others say."""


class Referee:
    """A mechanism in MuJoCo: put into configurations, measured, and closed by MuJoCo's own rows."""

    def __init__(self, mechanism: Mechanism) -> None:
        require("the referee", "mujoco", "mujoco")
        import mujoco

        self.mechanism = mechanism
        self.metres = metres_of(mechanism.length_unit)
        self._mujoco: Any = mujoco
        self.model: Any = compiled(to_mjcf(mechanism))
        self.model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        self.data: Any = mujoco.MjData(self.model)
        tree = cut_tree(mechanism)
        self._forward = {branch.joint.name: branch.forward for branch in tree.branches}
        self._reference = names_of(mechanism, tree).reference
        self._held = [int(self.model.joint(name).dofadr[0]) for name in mechanism.actuator_names]
        self._determined = end_effector_freedom(mechanism, frozenset(drive.column for drive in mechanism.drives)) == 0

    def compare(self, solution: Solution, rng: np.random.Generator) -> tuple[float, float, float]:
        """Loop gap at one answer [length], and how far it is from the pose that MuJoCo closes to [length], [rad]."""
        self.put(solution.q)
        gap = self.gap()
        self.close(self._disturbance(rng) if self._determined else None)
        position, turned = self.pose()
        apart = float(np.linalg.norm(position - solution.pose[:3, 3]))
        if self.mechanism.end_effector_is_joint:
            return gap, apart, 0.0
        between = turned.T @ solution.pose[:3, :3]
        return gap, apart, float(np.linalg.norm(between - between.T) / np.sqrt(8.0))

    def put(self, q: Floats) -> None:
        """Take joint coordinates (nq,), as the mechanism counts them [rad or length]."""
        model = self.model
        for joint in range(model.njnt):
            name, address = model.joint(joint).name, int(model.jnt_qposadr[joint])
            if name in self._forward and self.mechanism.joint(name).type == "spherical":
                turn = q[columns(self.mechanism)[name]] * (1.0 if self._forward[name] else -1.0)
                self.data.qpos[address : address + 4] = np.roll(to_quaternion(turn), 1)
            else:
                slides = model.jnt_type[joint] == self._mujoco.mjtJoint.mjJNT_SLIDE
                value = q[self.mechanism.coordinate_names.index(name)]
                self.data.qpos[address] = value * (self.metres if slides else 1.0)
        self._update()

    def gap(self) -> float:
        """How far the loops are open, by MuJoCo's rows: the largest of distances and of angles times L [length]."""
        count = self.data.ne
        lengths = np.abs(self.data.efc_pos[:count] / self.metres)
        turning = self._turning_rows()
        lengths[turning] *= self.metres * self.mechanism.characteristic_length
        return float(lengths.max(initial=0.0))

    def close(self, disturbance: Floats | None = None) -> None:
        """Newton's method on MuJoCo's rows, with the actuated joints held; from where a disturbance (nv,) leads to."""
        mujoco, model, data = self._mujoco, self.model, self.data
        if disturbance is not None:
            mujoco.mj_integratePos(model, data.qpos, disturbance, 1.0)
            self._update()
        for _ in range(NEWTON_STEPS):
            rows = data.efc_pos[: data.ne].copy()
            if np.abs(rows).max(initial=0.0) <= CLOSED:
                break
            conditions = data.efc_J.reshape(-1, model.nv)[: data.ne].copy()
            conditions[:, self._held] = 0.0
            step = -np.linalg.lstsq(conditions, rows, rcond=SAME_ROW)[0]
            mujoco.mj_integratePos(model, data.qpos, step, 1.0)
            self._update()

    def pose(self) -> tuple[Floats, Floats]:
        """Where the reference point is (3,) [length], and how the end effector is turned from home (3, 3)."""
        site = self.data.site(self._reference)
        return np.array(site.xpos) / self.metres, np.array(site.xmat).reshape(3, 3)

    def rank(self) -> int:
        """How many independent conditions the rows are, where the model is."""
        conditions = self.data.efc_J.reshape(-1, self.model.nv)[: self.data.ne]
        return int(np.linalg.matrix_rank(conditions, SAME_ROW)) if conditions.size else 0

    def _disturbance(self, rng: np.random.Generator) -> Floats:
        """A motion of the passive joints, (nv,) [rad or m]."""
        model = self.model
        slides = model.jnt_type[model.dof_jntid] == self._mujoco.mjtJoint.mjJNT_SLIDE
        units = np.where(slides, self.metres * self.mechanism.characteristic_length, 1.0)
        motion = rng.uniform(-APART, APART, model.nv) * units
        motion[self._held] = 0.0
        return np.asarray(motion)

    def _turning_rows(self) -> Mask:
        """Which rows are angles: the last three of every six, of a weld."""
        count = self.data.ne
        equalities = self.data.efc_id[:count]
        welds = self.model.eq_type[equalities] == self._mujoco.mjtEq.mjEQ_WELD
        place = np.arange(count) - np.searchsorted(equalities, equalities)
        return np.asarray(welds & (place >= 3))

    def _update(self) -> None:
        self._mujoco.mj_fwdPosition(self.model, self.data)
