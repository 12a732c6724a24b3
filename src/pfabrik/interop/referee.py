"""MuJoCo as the referee: what its own kinematics and its own constraint rows say of our answers."""

from __future__ import annotations

import reprlib
from dataclasses import dataclass
from numbers import Integral
from typing import Any

import numpy as np

from ..answers.solution import Solution
from ..answers.status import Status
from ..arrays import Floats, Mask
from ..description.home_mobility import end_effector_freedom
from ..description.mechanism import Mechanism, checked_mechanism
from ..errors import InvalidArgument
from ..extras import require
from ..files.units import metres_of
from ..fk import solve_fk
from ..ik import solve_ik
from ..motion.displacements import columns
from ..motion.mobility import generic_of
from ..poses import pose
from ..rotations import to_quaternion
from ..tolerances import TOLERANCES
from .cuts import cut_tree
from .mjcf_bodies import names_of
from .mjcf_writing import to_mjcf

NEWTON_STEPS = 30
"""Most steps in which the referee closes loops that were opened by `APART`; five are usual."""

CLOSED = 1e-15
"""Gap of all rows at which the referee stops [m and rad]: rounding."""

APART = 1e-3
"""How far passive joints are moved off before the referee closes the loops by itself [rad or L]."""

SAME_ROW = 1e-9
"""Singular value, relative to the largest, below which a row of the loops says what others say."""

SPREAD = (0.2, 0.35)
"""How far from home random targets are at most, in each coordinate [L, rad]."""

MOST_DRAWS = 8
"""How often random targets, then actuator values, are drawn: each time as many as are asked for, until enough are
reached."""


@dataclass(frozen=True)
class Verification:
    """What the referee found: the largest differences over all poses, lengths in the mechanism's unit.

    Attributes
    ----------
    poses : how many configurations were compared, of as many different targets.
    loop_gap : how far MuJoCo finds our answers open, by its own constraint rows [length; angles times L].
    position_difference, rotation_difference : between our pose and the one in which MuJoCo closes the loops by itself,
        with the actuated joints where we have them [length], [rad].
    tolerance : what counts as agreement [length].
    """

    poses: int
    loop_gap: float
    position_difference: float
    rotation_difference: float
    tolerance: float

    def __bool__(self) -> bool:
        """Whether the two agree on every pose, and there was one."""
        apart = max(self.loop_gap, self.position_difference)
        return self.poses > 0 and apart <= self.tolerance and self.rotation_difference <= TOLERANCES.rotation


def verify(mechanism: Mechanism, *, poses: int = 100, seed: int = 0) -> Verification:
    """Compare answers with MuJoCo's, over random targets that are reached.

    The mechanism is written as a MuJoCo model. At each answer MuJoCo's constraint rows say how far the loops are open;
    then the passive joints are moved off, and Newton's method on these rows closes the loops again, with the actuated
    joints held: that must lead to the same pose.

    Parameters
    ----------
    poses : how many.
    seed : of the random targets.

    Raises
    ------
    MissingLibrary : MuJoCo is not installed.
    InvalidArgument : less than one pose.
    """
    checked_mechanism(mechanism)
    given: tuple[tuple[str, Any, int], ...] = (("poses", poses, 1), ("seed", seed, 0))
    for name, value, least in given:
        if isinstance(value, bool) or not isinstance(value, Integral) or int(value) < least:
            raise InvalidArgument(name, reprlib.repr(value), f"an integer from {least} on")
    rng = np.random.default_rng(seed)
    referee = Referee(mechanism)
    found = [referee.compare(solution, rng) for solution in reached_at_random(mechanism, poses, rng)]
    gap, position, rotation = np.max(found, axis=0, initial=0.0) if found else np.full(3, np.nan)
    tolerance = TOLERANCES.position * mechanism.characteristic_length
    return Verification(len(found), float(gap), float(position), float(rotation), tolerance)


def reached_at_random(mechanism: Mechanism, count: int, rng: np.random.Generator) -> list[Solution]:
    """Reached configurations around home, as many as are asked for if so many are found.

    Answers to random targets, nearer to home while most are out of reach; where targets are hardly ever reached, as
    where they set more than the end effector can do, answers to random actuator values.
    """
    found: list[Solution] = []
    for ask, drawn in ((solve_ik, _targets), (solve_fk, _actuators)):
        near = 1.0
        for _ in range(MOST_DRAWS):
            if len(found) == count:
                return found
            answers = ask(mechanism, drawn(mechanism, count, near, rng))
            reached = np.flatnonzero(np.asarray(answers.status) == Status.REACHED)
            found += [answers[int(row)] for row in reached[: count - len(found)]]
            near *= 0.6 if 2 * len(reached) < count else 1.0
    return found


def _actuators(mechanism: Mechanism, count: int, near: float, rng: np.random.Generator) -> Floats:
    """Actuated values (n, n_a) off home; `near` scales how far."""
    shift, turn = SPREAD
    turns = np.array([drive.kind == "angle" for drive in mechanism.drives])
    most = near * np.where(turns, turn, shift * mechanism.characteristic_length)
    home = [drive.home for drive in mechanism.drives]
    return np.asarray(home + rng.uniform(-most, most, (count, len(most))))


def _targets(mechanism: Mechanism, count: int, near: float, rng: np.random.Generator) -> Floats:
    """Poses (n, 4, 4) off home in those directions that the end effector has at all; `near` scales how far."""
    directions = generic_of(mechanism).directions
    most = near * np.repeat(SPREAD, 3)[: len(directions)]
    twists = rng.uniform(-most, most, (count, len(directions))) @ directions @ directions.T
    turns = twists[:, 3:] if twists.shape[1] > 3 else np.zeros((count, 3))
    return pose(mechanism.reference_point + mechanism.characteristic_length * twists[:, :3], rotvec=turns)


class Referee:
    """A mechanism in MuJoCo: put into configurations, measured, and closed by MuJoCo's own rows."""

    def __init__(self, mechanism: Mechanism) -> None:
        require("the referee", "mujoco", "mujoco")
        import mujoco

        self.mechanism = mechanism
        self.metres = metres_of(mechanism.length_unit)
        self._mujoco: Any = mujoco
        self.model: Any = mujoco.MjModel.from_xml_string(to_mjcf(mechanism))
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
