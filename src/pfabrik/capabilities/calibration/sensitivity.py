"""Derivatives of the pose and the actuators of configurations by the parameters of their machine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...answers.solution import Solution, checked_solution
from ...common.arrays import Floats, shaped
from ...common.derived import derived
from ...errors import InvalidArgument, UnsupportedMechanism
from ...kinematics import (
    JointRates,
    LegSlopes,
    cycle_basis,
    displacements,
    end_effector_pose,
    home_coordinates,
    leg_slopes,
    model_of,
    rate_units,
    tree_of,
)
from ...machine.description.geometry import Geometry
from ...machine.description.mechanism import Mechanism
from ...machine.motion.displacements import geometry_screws
from ...machine.motion.singularities import task_twists
from ...tolerances import TOLERANCES
from .parameters import Parameters


@dataclass(frozen=True)
class Sensitivity:
    """Derivatives of configurations by parameters.

    Attributes
    ----------
    pose : array (..., 6, p)
        Change of the end effector at held actuators: velocity of the reference point [length per unit of the
        parameter], angular velocity [rad per unit], in the base frame; (..., 3, p) for a joint end effector.
    actuators : array (..., n_a, p)
        Change of the actuators at a held pose; of the task's coordinates where the machine cannot hold the whole pose.
        Where actuators are redundant, the least change.
    names : tuple of str
        Names of the p parameters.
    """

    pose: Floats
    actuators: Floats
    names: tuple[str, ...]


def sensitivity(solution: Solution, parameters: Parameters) -> Sensitivity:
    """Derivatives of the pose and of the actuators of a solution by the parameters of its machine.

    Implicit differentiation of the closed loops: with the present screws S of the coordinates z, and those T of the
    geometry's changes, loops ask for S dz + T dx = 0 around every loop; pose and actuators follow from dz and dx.

    Parameters
    ----------
    solution : Solution
        One configuration or a batch.
    parameters : Parameters
        Parameters of its machine.

    Raises
    ------
    InvalidArgument
        A solution of another machine, or one that is INVALID.
    UnsupportedMechanism
        Loops that some parameters open: an overconstrained machine moves with some geometries only.
    """
    mechanism = checked_solution(solution).mechanism
    if not isinstance(parameters, Parameters) or parameters.mechanism != mechanism:
        raise InvalidArgument("parameters", "those of another machine", f"parameters of '{mechanism.name}'")
    if parameters.moves.any() or parameters.factors.any():
        raise InvalidArgument("parameters", "those of an instrument or of readings", "parameters of the machine alone")
    q = np.reshape(solution.q, (-1, len(mechanism.coordinate_names)))
    if not np.isfinite(q).all():
        raise InvalidArgument("solution", "a row that is INVALID", "configurations")
    slopes, twists = parameters.slopes(parameters.values), 3 if mechanism.end_effector_is_joint else 6
    legs = legs_that_stay(parameters)
    by_legs = None if legs is None else legs.at(parameters.like, solution._configurations, slopes)
    if by_legs is not None:
        require_closed(by_legs.opened, parameters)
        pose, moved = by_legs.twists[:, :twists], by_legs.actuators
        return Sensitivity(shaped(pose, solution.shape), shaped(moved, solution.shape), parameters.names)
    first = GeometrySlopes(parameters.like, q - home_coordinates(mechanism), slopes, parameters.like)
    pose, _ = first.at_held_actuators()
    require_closed(first.opened, parameters)
    return Sensitivity(
        shaped(pose[:, :twists], solution.shape), shaped(first.at_held_pose(), solution.shape), parameters.names
    )


@derived
def legs_that_stay(parameters: Parameters) -> LegSlopes | None:
    """The legs of a machine as expressions of its geometry; None unless they are that with all parameters."""
    legs = leg_slopes(model_of(parameters.like))
    slopes = parameters.slopes(parameters.values)
    return legs if legs is not None and legs.keeps(parameters.like, slopes, parameters.scales) else None


OPENS = 1e-6
"""Opening of the loops per scaled parameter that counts as one [L or rad]: derivatives are exact to 1e-10, and loops
of axes that are not quite parallel open by the angle between these."""


def require_closed(opened: Floats, parameters: Parameters) -> None:
    """Refuse parameters whose change opens loops.

    Parameters
    ----------
    opened : how far per unit of each parameter, (p,) [L or rad].
    """
    opening = np.flatnonzero(opened * parameters.scales > OPENS)
    if len(opening):
        names = ", ".join(parameters.names[k] for k in opening[:4]) + (", ..." if len(opening) > 4 else "")
        reason = (
            f"its loops do not close with another {names}; free dimensions, or let copies vary as one: ties='copies'"
        )
        raise UnsupportedMechanism(parameters.mechanism.name, [reason], "varied so")


class GeometrySlopes:
    """Configurations to first order in their joint coordinates and in the geometry of their machine; lengths in L.

    Parameters
    ----------
    q : coordinates as deviations from home, (n, c) [rad or length].
    slopes : derivatives of the geometry by p parameters.
    like : the machine from which this one was changed, by little.
    """

    def __init__(self, mechanism: Mechanism, q: Floats, slopes: Geometry, like: Mechanism) -> None:
        self.mechanism, self.q, self.length = mechanism, q, mechanism.characteristic_length
        self.rates, self.units = JointRates(model_of(mechanism), q, model_of(like)), rate_units(mechanism)
        self.drives, body = self.rates.actuated, mechanism.end_effector_body
        weights = np.concatenate([np.nan_to_num(slopes.points), slopes.axes[:, :, 0], slopes.axes[:, :, 1]], axis=2)
        units = np.eye(9)[:, None] * np.ones((len(mechanism.joints), 1))
        changes = geometry_screws(mechanism, q, units[..., :3], units[..., 3:].reshape(9, -1, 2, 3))
        ways = np.concatenate([cycle_basis(mechanism).of_joints, tree_of(mechanism).paths[body][None]])
        sums = _at(_summed(changes, weights, ways), end_effector_pose(mechanism, q)[:, :3, 3] / self.length)
        n, _, _, p = sums.shape
        self.openings, self.twist_changes = sums[:, :-1].reshape(n, -1, p), sums[:, -1]
        rotations = displacements(mechanism, q)[body][:, :3, :3]
        self.twist_changes[:, :3] += np.einsum("nab,pb->nap", rotations, slopes.reference_point) / self.length
        self.zeros = slopes.home[:, self.drives] / self.units[self.drives]
        """Changes of the drives' zeros, (p, n_a) [rad or L]."""
        self.opened = np.zeros(p)
        """How far loops are from closing per unit of a parameter, (p,) [L or rad]; 0 until it is computed."""

    def at_held_actuators(self, moved: Floats | None = None) -> tuple[Floats, Floats]:
        """Twists (n, 6, p), and rates of all coordinates (n, c, p), per unit of every parameter [length, rad].

        Parameters
        ----------
        moved : how far parameters move actuators that read the same, (n, n_a, p) [rad or length]; by default not.
        """
        wanted = -self.zeros.T + (0.0 if moved is None else moved / self.units[self.drives, None])
        rates = self.rates.geometry(self.openings, wanted)
        left = self.rates.conditions @ rates + self.openings, rates[:, self.drives] - wanted
        self.opened = np.abs(np.concatenate(left, axis=1)).max(axis=(0, 1), initial=0.0)
        twists = self.rates.twists @ rates + self.twist_changes
        twists[:, :3] *= self.length
        return twists, cycle_basis(self.mechanism).rates.T @ rates * self.units[:, None]

    def at_held_pose(self) -> Floats:
        """Rates of the actuators (n, n_a, p) per unit of every parameter, with the task's coordinates held."""
        least, held = self.rates.geometry(self.openings), np.swapaxes(task_twists(self.mechanism, self.q), 1, 2)
        left = held @ (self.rates.twists @ least + self.twist_changes)
        moved = self.rates.motions @ np.linalg.pinv(held @ self.rates.twists @ self.rates.motions, TOLERANCES.rank)
        return np.asarray(((least - moved @ left)[:, self.drives] + self.zeros.T) * self.units[self.drives, None])


def _summed(screws: Floats, weights: Floats, passes: Floats) -> Floats:
    """Sums of the joints' screws along ways, (n, ways, 6, p).

    Parameters
    ----------
    screws : of every joint per unit of its geometry's numbers, (n, joints, 9, 6).
    weights : changes of these numbers per unit of each parameter, (p, joints, 9).
    passes : how each way passes every joint, (ways, joints).
    """
    n, ways, (p, joints, numbers) = len(screws), len(passes), weights.shape
    along = passes[:, None, :, None] * weights  # (ways, p, joints, 9)
    flat = np.moveaxis(screws, -1, 1).reshape(n, 6, joints * numbers)  # one by one: a BLAS takes no threads for these
    sums = (flat @ along.reshape(ways * p, joints * numbers).T).reshape(n, 6, ways, p)
    return np.asarray(np.swapaxes(sums, 1, 2))


def _at(twists: Floats, points: Floats) -> Floats:
    """Twists (n, k, 6, p) as [velocity at points (n, 3); angular velocity], from [angular; velocity at the origin]."""
    angular, velocity = twists[:, :, :3], twists[:, :, 3:]
    return np.concatenate([velocity + np.cross(angular, points[:, None, :, None], axis=2), angular], axis=2)
