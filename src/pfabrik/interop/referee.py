"""Answers against MuJoCo's own kinematics and constraint rows, on the model that we export."""

from __future__ import annotations

import numpy as np

from ..answers.solution import Solution
from ..arrays import Floats
from ..description.home_mobility import end_effector_freedom
from ..description.mechanism import Mechanism
from ..extras import require
from ..files.units import metres_of
from .compiled_model import CompiledModel
from .cuts import cut_tree
from .mjcf_bodies import names_of
from .mjcf_qpos import qpos_of
from .mjcf_writing import to_mjcf

NEWTON_STEPS = 30
"""Most steps in which the referee closes loops that were opened by `APART`; five are usual."""

CLOSED = 1e-15
"""Gap of all rows at which the referee stops [m and rad]: rounding."""

APART = 1e-3
"""How far passive joints are moved off before the referee closes the loops by itself [rad or L]."""

SAME_ROW = 1e-9
"""Singular value, relative to the largest, below which a row of the loops follows from others."""


class Referee:
    """A mechanism in MuJoCo: put into configurations, measured, and closed by MuJoCo's own rows."""

    def __init__(self, mechanism: Mechanism) -> None:
        require("the referee", "mujoco", "mujoco")
        self.mechanism = mechanism
        self.metres = metres_of(mechanism.length_unit)
        self.compiled = CompiledModel(to_mjcf(mechanism))
        self.model, self.data = self.compiled.model, self.compiled.data
        tree = cut_tree(mechanism)
        self._reference = names_of(mechanism, tree).reference
        self._held = [int(self.model.joint(name).dofadr[0]) for name in mechanism.actuator_names]
        self._is_determined = end_effector_freedom(mechanism, frozenset(each.column for each in mechanism.drives)) == 0

    def compare(self, solution: Solution, rng: np.random.Generator) -> tuple[float, float, float]:
        """Loop gap at one answer [length], and how far it is from the pose that MuJoCo closes to [length], [rad]."""
        self.put(solution.q)
        gap = self.gap()
        self.close(self._disturbance(rng) if self._is_determined else None)
        position, turned = self.pose()
        apart = float(np.linalg.norm(position - solution.pose[:3, 3]))
        if self.mechanism.end_effector_is_joint:
            return gap, apart, 0.0
        between = turned.T @ solution.pose[:3, :3]
        return gap, apart, float(np.linalg.norm(between - between.T) / np.sqrt(8.0))

    def put(self, q: Floats) -> None:
        """Take joint coordinates (nq,), as the mechanism counts them [rad or length]."""
        self.data.qpos[:] = qpos_of(self.mechanism, q)
        self.compiled.update()

    def gap(self) -> float:
        """How far the loops are open, by MuJoCo's rows: the largest of distances and of angles times L [length]."""
        errors, _, equalities = self.compiled.rows()
        lengths = np.abs(errors / self.metres)
        is_weld = self.model.eq_type[equalities] == self.compiled.mujoco.mjtEq.mjEQ_WELD
        row = np.arange(len(equalities)) - np.searchsorted(equalities, equalities)
        is_angle = is_weld & (row >= 3)  # the last three rows of every six
        lengths[is_angle] *= self.metres * self.mechanism.characteristic_length
        return float(lengths.max(initial=0.0))

    def close(self, disturbance: Floats | None = None) -> None:
        """Newton's method on MuJoCo's rows, with the actuated joints held; begins after a disturbance (nv,)."""
        if disturbance is not None:
            self.compiled.move(disturbance)
        for _ in range(NEWTON_STEPS):
            errors, jacobian, _ = self.compiled.rows()
            if np.abs(errors).max(initial=0.0) <= CLOSED:
                break
            jacobian = jacobian.copy()
            jacobian[:, self._held] = 0.0
            self.compiled.move(-np.linalg.lstsq(jacobian, errors, rcond=SAME_ROW)[0])

    def pose(self) -> tuple[Floats, Floats]:
        """Where the reference point is (3,) [length], and how the end effector is turned from home (3, 3)."""
        site = self.data.site(self._reference)
        return np.array(site.xpos) / self.metres, np.array(site.xmat).reshape(3, 3)

    def _disturbance(self, rng: np.random.Generator) -> Floats:
        """A motion of the passive joints, (nv,) [rad or m]."""
        slides = self.compiled.is_slide[self.model.dof_jntid]
        units = np.where(slides, self.metres * self.mechanism.characteristic_length, 1.0)
        motion = rng.uniform(-APART, APART, self.model.nv) * units
        motion[self._held] = 0.0
        return np.asarray(motion)
