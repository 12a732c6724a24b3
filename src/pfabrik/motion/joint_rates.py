"""Motion to first order: loop conditions and twist of the end effector per joint rate.

Here lengths are in units of L and twists are [velocity of the reference point; angular velocity], in the base frame, so
nothing depends on the mechanism's unit, on where it stands, or on the order of its joints.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from ..derived import derived
from ..description.graph import tree_of
from ..description.home_mobility import body_twist, column_joints, column_moves, loop_conditions, orthonormal_rates
from ..description.mechanism import Mechanism
from ..description.structure import Structure
from .displacements import end_effector_pose, loop_errors, screws, stepped


def actuated_columns(mechanism: Mechanism) -> list[int]:
    """The columns of the actuators."""
    return [drive.column for drive in mechanism.drives]


@dataclass(frozen=True)
class CycleBasis:
    """Sums of screws that make up twists and loop conditions, per column of q; locked joints have no part in them.

    Attributes
    ----------
    path : of the end effector's body, (c,).
    fundamental, orthonormal : the loops of the tree, and orthonormal combinations that depend on no tree, (loops, c).
    of_joints : these combinations by joint, (loops, joints).
    rates : orthonormal rates of every joint, (c, c).
    """

    path: Floats
    fundamental: Floats
    orthonormal: Floats
    of_joints: Floats
    rates: Floats


@derived
def cycle_basis(mechanism: Structure) -> CycleBasis:
    """The paths and loops along which screws of joint rates add up."""
    tree, owners = tree_of(mechanism), column_joints(mechanism)
    path = tree.paths[mechanism.end_effector_body][owners]
    orthonormal = np.linalg.qr(tree.loops.T)[0].T
    moves = column_moves(mechanism)
    loops, rates = tree.loops[:, owners] * moves, moves[:, None] * orthonormal_rates(mechanism)
    return CycleBasis(path * moves, loops, orthonormal[:, owners] * moves, orthonormal, rates)


def first_order(mechanism: Structure, q: Floats) -> tuple[Floats, Floats]:
    """Loop conditions (n, 6 loops, c) and twist of the end effector (n, r, c), per orthonormal joint rate."""
    graph, present = cycle_basis(mechanism), present_screws(mechanism, q)
    twist = body_twist(graph.path, present)
    velocity, angular = twist[:, 3:], twist[:, :3]
    rows = [velocity] if mechanism.end_effector_is_joint else [velocity, angular]
    return loop_conditions(graph.orthonormal, present), np.concatenate(rows, axis=1)


def present_screws(mechanism: Structure, q: Floats) -> Floats:
    """Screws of orthonormal joint rates, (n, c, 6): angular velocity, velocity of the present reference point."""
    return np.asarray(cycle_basis(mechanism).rates @ at_reference(mechanism, q, screws(mechanism, q)))


def loop_slopes(mechanism: Structure, q: Floats) -> Floats:
    """Slopes of the loops' errors by orthonormal joint rates, (n, 6 loops, c)."""
    return loop_conditions(cycle_basis(mechanism).fundamental, present_screws(mechanism, q))


def loop_errors_here(mechanism: Structure, q: Floats) -> Floats:
    """The loops' errors at the present reference point, (n, 6 loops) [rad, L]."""
    return at_reference(mechanism, q, loop_errors(mechanism, q)).reshape(len(q), -1)


def at_reference(mechanism: Structure, q: Floats, origin_screws: Floats) -> Floats:
    """Screws (n, k, 6) with the velocity of the present reference point in place of that at the base origin."""
    points = end_effector_pose(mechanism, q)[:, None, :3, 3] / mechanism.characteristic_length
    moved = origin_screws.copy()
    moved[..., 3:] += np.cross(moved[..., :3], points)
    return moved


def moved(mechanism: Structure, q: Floats, rates: Floats) -> Floats:
    return stepped(mechanism, q, rates @ cycle_basis(mechanism).rates)


def right_singular(matrices: Floats) -> tuple[Floats, Floats]:
    """Singular values, and all right singular vectors as rows, of (n, a, b): (n, min(a, b)) and (n, b, b)."""
    if 0 in matrices.shape[1:]:
        n, _, b = matrices.shape
        return np.zeros((n, 0)), np.broadcast_to(np.eye(b), (n, b, b))
    _, values, right = np.linalg.svd(matrices)
    return values, right
