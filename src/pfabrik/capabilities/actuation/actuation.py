"""The map between named joints, or task coordinates, of a parallel mechanism and its actuators."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...answers.solution import Solution
from ...answers.start_configuration import Start
from ...common.arguments import as_floats
from ...common.arrays import Floats, shaped
from ...errors import InvalidArgument
from ...fk import solve_fk
from ...kinematics import JointPath, actuator_units, joint_path, require_determined
from ...machine.description.mechanism import Mechanism, checked_mechanism
from ...machine.files.units import metres_of
from ..dynamics.drives import drives_of
from ..dynamics.mass_matrix import mass_matrix
from .drive_limits import HalfSpaces, image_of_box, preimage_of_box
from .hull import Hull, feasible_hull
from .jacobian_rate import jacobian_rates
from .named_values import Mapped, inverses, per_actuator, rows_of, speeds_of, vectors_of
from .placed import Placer
from .sample import Sample, sample_feasible
from .task_path import Coordinates, TaskPath

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TASK = "task"
PURPOSE = "mapped between joints and actuators"


class Gains(NamedTuple):
    """Gains of joints as matrices, (..., k, k): torque by joint error, and by joint speed.

    Attributes
    ----------
    kp : array (..., k, k)
        Torque by joint error.
    kd : array (..., k, k)
        Torque by joint speed.
    """

    kp: Floats
    kd: Floats


class LimitMargin(NamedTuple):
    """The least margin at joint coordinates, and the limit that has it.

    Attributes
    ----------
    margin : float or array (...)
        As in `margins` a share of the range: 1 in the middle, 0 on a limit, negative beyond it or where loops do not
        close. Near a dead point, how near it is, as in `Singularity.serial`. inf where nothing limits.
    joint, bound : str or array of str (...)
        The limit: "min", "max", "cone"; "stretched", "level" or "not closed" where a leg does not reach; "dead point"
        of a motor; "singularity", of no joint, where actuators lose their hold.
    """

    margin: float | Floats
    joint: str | np.ndarray
    bound: str | np.ndarray


def actuation(mechanism: Mechanism, joints: str | Sequence[str]) -> Actuation:
    """The map between joints that a serial model has and the actuators.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    joints : str or sequence of str
        Names of joints in series from base to end effector, in the order that coordinates are to have (a universal
        joint has two); or "task" for the coordinates that the mechanism's task sets.

    Raises
    ------
    UnknownName
        No joint of that name.
    InvalidArgument
        Joints that are not in series from the base to the end effector.
    UnsupportedMechanism
        The joints do not determine the actuators, or these not the joints; with the reason.
    """
    checked_mechanism(mechanism)
    if isinstance(joints, str) and joints == TASK and TASK not in {joint.name for joint in mechanism.joints}:
        task = TaskPath(mechanism)
        require_determined(mechanism, task.names, task.rates_of, PURPOSE)
        return Actuation(task)
    path = joint_path(mechanism, joints)
    require_determined(mechanism, path.names, path.rates_of, PURPOSE)
    return Actuation(path)


class Actuation:
    """A map between k named coordinates q and n_a actuators x, in home's working and assembly mode.

    Arrays have any leading shape (...,), whose rows are independent. Coordinates q (..., k) are in the order of
    `names`, x (..., n_a) in that of `mechanism.actuator_names` [rad or length]. Torques belong to them: a torque times
    a rate is a power, so that it is a force where the coordinate is a length. With J = dx/dq:

        dx/dt = J dq/dt,    torque of joints = J^T torque of actuators,    inertia of joints = J^T I J

    Where q is out of reach, J and all that follows from it are those of the nearest feasible configuration: ask
    `margin`, or the status of `to_actuators`.

    Attributes
    ----------
    mechanism : Mechanism
        The machine.
    names : tuple of str
        Names of the coordinates.
    low, high : array (k,)
        Their ranges [rad or length]; infinite without one.
    home : array (k,)
        Their values at home.
    """

    def __init__(self, coordinates: Coordinates) -> None:
        self.mechanism, self.names = coordinates.mechanism, coordinates.names
        self.low, self.high, self.home = coordinates.low, coordinates.high, coordinates.home
        self._coordinates, self._placer = coordinates, Placer(coordinates)

    def __repr__(self) -> str:
        actuators = ", ".join(self.mechanism.actuator_names)
        return f"<Actuation of '{self.mechanism.name}': {', '.join(self.names)} <-> {actuators}>"

    @property
    def is_redundant(self) -> bool:
        """True if there are more actuators than coordinates: torques of actuators are then one choice of many."""
        return len(self.mechanism.actuator_names) > len(self.names)

    def to_actuators(self, q: ArrayLike) -> Mapped:
        """Actuator values at coordinates q (..., k), each row REACHED, or PROJECTED to the nearest feasible pose."""
        rows, shape = rows_of(self.names, q)
        placed = self._placer.place(rows)
        values = placed.actuators.reshape(*shape, placed.actuators.shape[1])
        return Mapped(values, shaped(placed.status, shape), lambda: self._placer.solution_of(placed.asked, shape))

    def to_joints(self, x: ArrayLike, *, start: Start | None = None) -> Mapped:
        """Coordinates (..., k) at actuator values x (..., n_a), by `solve_fk`.

        Parameters
        ----------
        x : array (..., n_a)
            Actuator values [rad or length].
        start : Solution or array, optional
            A Solution; coordinates (..., k), or all joint coordinates (..., nq), single or one for each row. Default:
            home.
        """
        solution = solve_fk(self.mechanism, vectors_of("x", x, self.mechanism.actuator_names), start=self._start(start))
        values = self._placer.values(solution).reshape(*solution.shape, len(self.names))
        return Mapped(values, solution.status, lambda: solution)

    def jacobian(self, q: ArrayLike) -> Floats:
        """J = dx/dq at coordinates q (..., k): actuator rates by joint rates, (..., n_a, k)."""
        rows, shape = rows_of(self.names, q)
        J = self._placer.jacobian(rows)
        return J.reshape(*shape, *J.shape[1:])

    def jacobian_rate(self, q: ArrayLike, rates: ArrayLike) -> Floats:
        """dJ/dt (..., n_a, k) at coordinates q (..., k) with rates (..., k): actuators accelerate by J q'' + dJ/dt q'.

        Exact, from the second order of the loops' conditions. Where loops do not close, that of the nearest
        configuration that closes them.

        Parameters
        ----------
        q : array (..., k)
            Coordinates [rad or length].
        rates : array (..., k)
            Their rates [rad/s or length/s].

        Raises
        ------
        UnsupportedMechanism
            Coordinates of a ball, or the yaw of a platform that tilts too.
        """
        speeds = vectors_of("rates", rates, self.names)
        try:
            shape = np.broadcast_shapes(vectors_of("q", q, self.names).shape, speeds.shape)[:-1]
        except ValueError:
            raise InvalidArgument("rates", f"a batch of {speeds.shape[:-1]}", "one that fits that of q") from None
        at, moving = (np.broadcast_to(x, (*shape, len(self.names))) for x in (np.asarray(q, float), speeds))
        rows, _ = rows_of(self.names, at)
        found = jacobian_rates(self._unlimited.coordinates, self._unlimited.solution(rows), moving.reshape(rows.shape))
        return found.reshape(*shape, *found.shape[1:])

    def velocities(self, q: ArrayLike, rates: ArrayLike) -> Floats:
        """Actuator rates J dq/dt (..., n_a) at joint rates (..., k)."""
        return _times(self.jacobian(q), vectors_of("rates", rates, self.names))

    def joint_velocities(self, q: ArrayLike, rates: ArrayLike) -> Floats:
        """Joint rates (..., k) at actuator rates (..., n_a).

        Rates that redundant actuators cannot have together are replaced by the nearest ones that they can.
        """
        return _times(self._inverse(q), vectors_of("rates", rates, self.mechanism.actuator_names))

    def torques_to_joints(self, q: ArrayLike, torques: ArrayLike) -> Floats:
        """Torques of joints J^T tau (..., k) that torques of actuators (..., n_a) make."""
        torques = vectors_of("torques", torques, self.mechanism.actuator_names)
        return _times(np.swapaxes(self.jacobian(q), -1, -2), torques)

    def torques_to_actuators(self, q: ArrayLike, torques: ArrayLike) -> Floats:
        """Torques of actuators (..., n_a) that make torques of joints (..., k).

        Of redundant actuators (see `is_redundant`) those of the least norm; forces count as torques with the lever L.
        At a parallel singularity, where actuators cannot make all of them, those that make the nearest.
        """
        return _times(np.swapaxes(self._inverse(q), -1, -2), vectors_of("torques", torques, self.names))

    def armature(self, q: ArrayLike, rotor_inertia: ArrayLike | None = None, *, links: bool = False) -> Floats:
        """Inertia of the rotors as joints feel it, J^T I J, and of the links too, (..., k, k), in SI units.

        In kg m² between angles, kg between lengths, kg m between both, as `mass_matrix`.

        Parameters
        ----------
        q : array (..., k)
            Coordinates [rad or length].
        rotor_inertia : float or array (n_a,), optional
            Inertia behind the gears, one for all actuators or one for each: gear ratio squared times the rotor's [kg
            m², of a slide kg]. By default that of the mechanism.
        links : bool, optional
            Count the masses of all bodies too, as `mass_matrix` has them.

        Raises
        ------
        InvalidArgument
            With `links`, bodies without a mass.
        """
        metres = metres_of(self.mechanism.length_unit)
        rows, shape = rows_of(self.names, q)
        own, drives = self._placer.jacobian(rows), drives_of(self.mechanism)
        J = own * (drives.si[:, None] / np.where(self._coordinates.is_angle, 1.0, metres))
        inertia = drives.inertia
        if rotor_inertia is not None:
            inertia = per_actuator(self.mechanism.actuator_names, "rotor_inertia", rotor_inertia)
        found = self._congruent(J, inertia)
        if links:
            whole = mass_matrix(self._unlimited.solution(rows), "actuators")
            found = found + np.swapaxes(J, -1, -2) @ whole @ J - self._congruent(J, drives.inertia)
        return found.reshape(*shape, *found.shape[1:])

    def gains(self, q: ArrayLike, kp: ArrayLike, kd: ArrayLike = 0.0) -> Gains:
        """Gains of joints that gains of actuators, each one or (n_a,), make: J^T Kp J and J^T Kd J, (..., k, k) each.

        Of a servo that holds actuators where q is; where it also bears a torque, its stiffness has a further part,
        dJ^T/dq times this torque.
        """
        J = self.jacobian(q)
        return Gains(
            self._congruent(J, per_actuator(self.mechanism.actuator_names, "kp", kp)),
            self._congruent(J, per_actuator(self.mechanism.actuator_names, "kd", kd)),
        )

    def torque_limits(self, q: ArrayLike, torque_max: ArrayLike) -> HalfSpaces:
        """The torques of joints that actuators can make, each within +-torque_max, one or (n_a,)."""
        J = self.jacobian(q)
        limits = np.broadcast_to(per_actuator(self.mechanism.actuator_names, "torque_max", torque_max), J.shape[:-1])
        return image_of_box(J, limits)

    def speed_limits(self, q: ArrayLike, speed_max: ArrayLike | None = None) -> HalfSpaces:
        """The rates of joints at which no actuator is faster than +-speed_max, one or (n_a,).

        Parameters
        ----------
        q : array (..., k)
            Coordinates [rad or length].
        speed_max : float or array (n_a,), optional
            Highest speed [rad/s or length/s]; default `max_speed` of the mechanism's joints.
        """
        J = self.jacobian(q)
        limits = np.broadcast_to(speeds_of(self.mechanism, speed_max), J.shape[:-1])
        return preimage_of_box(J, limits)

    def margin(self, q: ArrayLike) -> LimitMargin:
        """Margins of coordinates q (..., k), with the name of the nearest limit; nothing is projected."""
        rows, shape = rows_of(self.names, q)
        margin, limits = self._placer.margins(rows)
        return LimitMargin(shaped(margin, shape), shaped(limits[:, 0], shape), shaped(limits[:, 1], shape))

    def hull(self, box: ArrayLike | None = None, *, seed: int = 0) -> Hull:
        """The feasible part of the box of joint ranges: half-spaces within it, and the share that is lost.

        Parameters
        ----------
        box : array (2, k), optional
            Lowest and highest coordinates; default the joints' ranges.
        seed : int, optional
            Seed of the configurations on which the share is measured.
        """
        return feasible_hull(self._placer, box, seed)

    def sample(self, n: int, seed: int = 0, *, box: ArrayLike | None = None, model: object = None) -> Sample:
        """Feasible configurations, uniform in the joint coordinates: coordinates, Solution, and MuJoCo's `qpos`.

        Parameters
        ----------
        n : int
            Number of configurations.
        seed : int, optional
            Seed of the random numbers.
        box : array (2, k), optional
            Lowest and highest coordinates; default the joints' ranges.
        model : MjModel or str or PathLike, optional
            The model of the robot that `qpos` belongs to, as in `interop.qpos`; default what `to_mjcf` writes.
        """
        return sample_feasible(self._placer, n, seed, box, model)

    def plot_torques(
        self, torque_max: ArrayLike = 1.0, *, box: ArrayLike | None = None, ax: Axes | None = None
    ) -> Axes:
        """Draw the torques of two joints over their range: polygons, and the weakest direction as colours.

        Parameters
        ----------
        torque_max : float or array (n_a,), optional
            Greatest torque of the actuators, as in `torque_limits`; default one unit of each actuator.
        box : array (2, k), optional
            Lowest and highest coordinates; default the joints' ranges.
        ax : Axes, optional
            Matplotlib axes to draw on; default those of a new figure.
        """
        from .torque_map import plot_torque_map

        return plot_torque_map(self._placer, torque_max, box, ax)

    @cached_property
    def _unlimited(self) -> Placer:
        """Coordinates without limits, beyond which the Jacobian goes on."""
        mechanism = self.mechanism.without_limits()
        is_task = isinstance(self._coordinates, TaskPath)
        return Placer(TaskPath(mechanism) if is_task else joint_path(mechanism, self.names))

    def _start(self, start: Start | None) -> Start | None:
        """A start for `solve_fk`: coordinates (..., k) as all joint coordinates."""
        if start is None or isinstance(start, Solution):
            return start
        values = as_floats("start", start, f"a Solution, or coordinates (..., {len(self.names)})")
        if values.shape[-1:] != (len(self.names),) or len(self.names) == len(self.mechanism.coordinate_names):
            return values
        rows, shape = rows_of(self.names, values)
        return self._placer.solution_of(rows, shape)

    def _inverse(self, q: ArrayLike) -> Floats:
        """The Moore-Penrose inverse of J, (..., k, n_a), lengths of actuators in units of L."""
        units = actuator_units(self.mechanism)
        return inverses(self.jacobian(q) / units[:, None]) / units

    @staticmethod
    def _congruent(J: Floats, values: Floats) -> Floats:
        return np.asarray(np.swapaxes(J, -1, -2) @ (values[:, None] * J))

    @property
    def path(self) -> JointPath:
        """The joints in series, with their axes.

        Raises
        ------
        InvalidArgument
            The coordinates are those of the task.
        """
        if isinstance(self._coordinates, TaskPath):
            raise InvalidArgument("path", "coordinates of the task", "an actuation of named joints")
        return self._coordinates


def _times(matrices: Floats, vectors: Floats) -> Floats:
    try:
        return np.asarray((matrices @ vectors[..., None])[..., 0])
    except ValueError:
        found = f"batch shapes {matrices.shape[:-2]} and {vectors.shape[:-1]}"
        raise InvalidArgument("q", found, "shapes that agree") from None
