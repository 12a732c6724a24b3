"""Stiffness by which a load changes as the geometry does: forces turn with what transmits them.

Along a motion v, screws s_k of the joints move at s'_k(v), and so does what they transmit, W_k, from first to second
body. A motion e that keeps its twist does the work, with the wrenches w_b on bodies and joint rates u(e),

    d(P_e) / dv = sum w'_b(v) . V_b(e) - sum W_k . s'_k(v) u_k(e),

where the rates that keep loops closed do none, for W is in equilibrium. G = -d(P_e) / dv is the stiffness: of a cable
with tension t and length l, t / l across it. Lengths are in L.
"""

from __future__ import annotations

import numpy as np

from ...common.arrays import Floats
from ...kinematics import JointRates, column_joints, cycle_basis, tree_of
from ...machine.description.mechanism import Mechanism
from .loads import Acting


def geometric_stiffness(
    mechanism: Mechanism, first: JointRates, centres: Floats, transmitted: Floats, loads: list[Acting]
) -> Floats:
    """G (n, d, d) by motions e and v of `first.pairs`.

    Forces keep their directions and act at points of their bodies; moments stay as they are. G is symmetric but for
    what moments do as bodies turn.

    Parameters
    ----------
    centres : of the joints, from the reference point, (n, joints, 3).
    transmitted : wrenches W, about the reference point, (n, joints, 6).
    """
    paths, owners, motions = tree_of(mechanism).paths, column_joints(mechanism), first.pairs
    found = np.zeros((len(motions), motions.shape[2], motions.shape[2]))
    twists = [(paths[load.body][owners, None] * first.screws).swapaxes(-1, -2) @ motions for load in loads]
    for place in range(motions.shape[2]):
        moved = screw_rates(mechanism, first, centres, motions[..., place])
        found[..., place] = np.einsum("nci,nci,nce->ne", transmitted[:, owners], moved, motions)
        for load, twist in zip(loads, twists, strict=True):
            shift = twist[:, :3, place] + np.cross(twist[:, 3:, place], load.arm)
            found[..., place] -= np.einsum("ni,nie->ne", np.cross(shift, load.wrench[:, :3]), twist[:, 3:])
    return found


def screw_rates(mechanism: Mechanism, first: JointRates, centres: Floats, u: Floats) -> Floats:
    """Rates s' of the joints' screws along joint rates u (n, c), (n, c, 6).

    s'_k = W_k x s_k, with the twist W_k of what carries the joint's axis: its first body, and of a universal joint's
    second axis also its first rotation. The axes of a spherical joint are those of the base; its centre moves with its
    first body.

    Parameters
    ----------
    centres : of the joints, from the reference point, (n, joints, 3).
    """
    owners, joints, graph = column_joints(mechanism), mechanism.joints, cycle_basis(mechanism)
    carried_by = np.array([tree_of(mechanism).paths[joint.connects[0]] for joint in joints])
    carriers = carried_by[owners][:, owners] @ (first.screws * u[..., None])
    second = np.flatnonzero(np.diff(owners, prepend=-1) == 0)
    second = np.array([k for k in second if joints[owners[k]].type == "universal"], int)
    carriers[:, second] += first.screws[:, second - 1] * (u @ graph.rates)[:, second - 1, None]
    moved = motion_cross(carriers, first.screws)
    balls = np.flatnonzero([joints[owner].type == "spherical" for owner in owners])
    velocities = carriers[:, balls, :3] + np.cross(carriers[:, balls, 3:], centres[:, owners[balls]])
    moved[:, balls, :3], moved[:, balls, 3:] = np.cross(velocities, first.screws[:, balls, 3:]), 0.0
    return moved


def motion_cross(carrier: Floats, screw: Floats) -> Floats:
    """The rate of a screw that a twist carries along; [velocity; angular velocity] both."""
    v, w, own_v, own_w = carrier[..., :3], carrier[..., 3:], screw[..., :3], screw[..., 3:]
    return np.concatenate([np.cross(w, own_v) + np.cross(v, own_w), np.cross(w, own_w)], axis=-1)
