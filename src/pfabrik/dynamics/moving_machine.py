"""Bodies in motion, from the rates of all joints: twists, accelerations, and the wrenches that masses resist with.

With the screws s_k and rates u_k of the joints, a body on the path p from the base has, at a point that rests,

    V = sum p_k s_k u_k,    A = sum p_k (s_k u'_k + s'_k u_k),    s'_k = W_k x s_k,

where W_k is the twist of what carries the joint's axis: its first body, and of a universal joint's second axis also
its first rotation. The axes of a spherical joint are those of the base; its centre moves with its first body. The loops
close, with their conditions C, if C u = 0 and C u' + C' u = 0.

A mass m with its centre at r, and inertia I about it, resists with the force f = m (g - a_r), and the moment
r x f - I w' - w x I w.

Lengths are in L. Twists are [velocity of what is at the present reference point; angular velocity], wrenches
[force; moment about that point] in kg L/s² and kg L²/s².
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..arrays import Floats
from ..description.mechanism import Mechanism
from ..kinematics import (
    BodyInertia,
    JointRates,
    column_joints,
    cycle_basis,
    model_of,
    placed,
    tree_of,
)
from ..tolerances import TOLERANCES


class Weights(NamedTuple):
    """Masses of bodies, some of which may have several.

    Attributes
    ----------
    bodies : names of what bears each, b.
    masses : [kg], (b,); centres : at home (b, 3) [length]; inertias : about these, (b, 3, 3) [kg length²].
    """

    bodies: tuple[str, ...]
    masses: Floats
    centres: Floats
    inertias: Floats


def weights_of(parts: Mapping[str, BodyInertia] | list[tuple[str, BodyInertia]]) -> Weights:
    """The masses of bodies as arrays."""
    pairs = list(parts.items()) if isinstance(parts, Mapping) else parts
    masses, centres, inertias = zip(*(each for _, each in pairs), strict=True) if pairs else ((), (), ())
    names = tuple(body for body, _ in pairs)
    return Weights(
        names, np.array(masses, float), np.reshape(centres, (-1, 3)).astype(float), np.reshape(inertias, (-1, 3, 3))
    )


class MovingMachine:
    """A machine at n configurations; its motions are rates u of its joints, (n, c), as `JointRates` has them.

    Attributes
    ----------
    first : the joint rates to first order.
    paths : of the bodies with masses along the joints, (b, joints).
    centres : of the joints, (n, joints, 3) [length].
    reference : points, (n, 3) [L].
    """

    def __init__(self, mechanism: Mechanism, weights: Weights, q: Floats) -> None:
        self.mechanism, self.weights = mechanism, weights
        self.first = JointRates(model_of(mechanism), q)
        self._tree, self._owners, self._graph = tree_of(mechanism), column_joints(mechanism), cycle_basis(mechanism)
        self.paths = np.array([self._tree.paths[body] for body in weights.bodies]).reshape(-1, len(mechanism.joints))
        self._bodies, self.centres = placed(mechanism, q)
        end = self._bodies[:, mechanism.bodies.index(mechanism.end_effector_body)] @ mechanism.home_pose
        self.reference = end[:, :3, 3] / mechanism.characteristic_length

    @cached_property
    def arms(self) -> Floats:
        """From the reference point to the centres of mass, (n, b, 3)."""
        bodies = self._of_bodies
        centres = np.einsum("nbij,bj->nbi", bodies[..., :3, :3], self.weights.centres) + bodies[..., :3, 3]
        return np.asarray(centres / self.mechanism.characteristic_length - self.reference[:, None])

    @cached_property
    def inertias(self) -> Floats:
        """Inertias about the centres of mass as bodies stand, (n, b, 3, 3)."""
        turns = self._of_bodies[..., :3, :3]
        at_home = self.weights.inertias / self.mechanism.characteristic_length**2
        return np.asarray(turns @ at_home @ np.swapaxes(turns, -1, -2))

    @cached_property
    def _of_bodies(self) -> Floats:
        return self._bodies[:, [self.mechanism.bodies.index(body) for body in self.weights.bodies]]

    def twists(self, u: Floats) -> Floats:
        """Twists of the bodies with masses, (n, b, 6)."""
        return np.asarray(self.paths[:, self._owners] @ (self.first.screws * u[..., None]))

    def drift(self, u: Floats) -> Floats:
        """What the screws add to accelerations as they move, s'_k u_k, (n, c, 6)."""
        parts = self.first.screws * u[..., None]
        carried_by = np.array([self._tree.paths[joint.connects[0]] for joint in self.mechanism.joints])
        carriers = carried_by[self._owners][:, self._owners] @ parts
        rates, joints = u @ self._graph.rates, self.mechanism.joints
        second = np.flatnonzero(np.diff(self._owners, prepend=-1) == 0)
        second = np.array([k for k in second if joints[self._owners[k]].type == "universal"], int)
        carriers[:, second] += self.first.screws[:, second - 1] * rates[:, second - 1, None]
        drift = _motion_cross(carriers, parts)
        balls = np.flatnonzero([joints[owner].type == "spherical" for owner in self._owners])
        if len(balls):
            arms = self.centres[:, self._owners[balls]] / self.mechanism.characteristic_length - self.reference[:, None]
            velocities = carriers[:, balls, :3] + np.cross(carriers[:, balls, 3:], arms)
            drift[:, balls, :3], drift[:, balls, 3:] = np.cross(velocities, parts[:, balls, 3:]), 0.0
        return drift

    def least_accelerations(self, drift: Floats) -> Floats:
        """The least u' (n, c) that keep the loops closed."""
        opened = (self._graph.orthonormal @ drift).reshape(len(drift), -1)
        return self.first.geometry(opened[..., None])[..., 0]

    def end_drift(self, u: Floats, drift: Floats) -> Floats:
        """Acceleration [of the reference point; angular] of the end effector while u' is 0, (n, 6)."""
        found = self._graph.path @ drift
        twist = (self.first.twists @ u[..., None])[..., 0]
        found[:, :3] += np.cross(twist[:, 3:], twist[:, :3])
        return np.asarray(found)

    def resistance(self, u: Floats, accelerations: Floats, drift: Floats, gravity: Floats) -> Floats:
        """Wrenches of the masses, (n, b, 6): of their weight, and against their acceleration.

        Parameters
        ----------
        accelerations : u', (n, c).
        gravity : (3,) [L/s²].
        """
        twists, path = self.twists(u), self.paths[:, self._owners]
        a = path @ (self.first.screws * accelerations[..., None] + drift)
        v, w, arms = twists[..., :3], twists[..., 3:], self.arms
        at_centre = a[..., :3] + np.cross(a[..., 3:], arms) + np.cross(w, v + np.cross(w, arms))
        force = self.weights.masses[:, None] * (gravity - at_centre)
        spin, gain = (np.einsum("nbij,nbj->nbi", self.inertias, x) for x in (w, a[..., 3:]))
        return np.concatenate([force, np.cross(arms, force) - gain - np.cross(w, spin)], axis=-1)

    def carried(self, wrenches: Floats) -> Floats:
        """What joints carry of wrenches on the bodies with masses, (n, joints, 6)."""
        return np.asarray(self.paths.T @ wrenches)

    def work(self, carried: Floats) -> Floats:
        """Power of what joints carry per rate, (n, c)."""
        return np.asarray(np.einsum("nci,nci->nc", self.first.screws, carried[:, self._owners]))

    def inertia_along(self, one: Floats, other: Floats) -> Floats:
        """The mass matrix between motions (n, c, k) and (n, c, m), (n, k, m) [kg L²]."""
        speeds, spins = self._shown(one)
        others, other_spins = (speeds, spins) if other is one else self._shown(other)
        both = speeds * self.weights.masses[:, None, None], np.swapaxes(self.inertias, -1, -2) @ spins
        pairs = zip(both, (others, other_spins), strict=True)
        return sum((_stacked(x).swapaxes(-1, -2) @ _stacked(y) for x, y in pairs), np.zeros(()))

    def _shown(self, motions: Floats) -> tuple[Floats, Floats]:
        """Velocities of the centres of mass by motions (n, c, k), and angular velocities, (n, b, 3, k)."""
        by_joint = self.first.screws[..., None] * motions[:, :, None]
        n, c, _, k = by_joint.shape
        twists = (self.paths[:, self._owners] @ by_joint.reshape(n, c, 6 * k)).reshape(n, -1, 6, k)
        return twists[..., :3, :] + np.cross(twists[..., 3:, :], self.arms[..., None], axis=2), twists[..., 3:, :]

    def free_responses(self, motions: Floats) -> tuple[Floats, Floats]:
        """Motions N that neither end effector nor actuators show, (n, c, f), and their mobility, (n, f, f) [1/kg/L²].

        These parts move as the forces on them will, such as a rod that spins between two ball joints. What has no
        inertia stays.
        """
        inertia = self.inertia_along(motions, motions)
        sizes, vectors = np.linalg.eigh(inertia)
        least = TOLERANCES.implied * self.weights.masses.sum()
        inverse = np.divide(1.0, sizes, out=np.zeros_like(sizes), where=sizes > least)
        return motions, (vectors * inverse[:, None]) @ np.swapaxes(vectors, -1, -2)


def _motion_cross(carrier: Floats, screw: Floats) -> Floats:
    """The rate of a screw that a twist carries along; [velocity; angular velocity] both."""
    v, w, own_v, own_w = carrier[..., :3], carrier[..., 3:], screw[..., :3], screw[..., 3:]
    return np.concatenate([np.cross(w, own_v) + np.cross(v, own_w), np.cross(w, own_w)], axis=-1)


def _stacked(vectors: Floats) -> Floats:
    """Vectors (n, b, 3, k) one above the other, (n, 3 b, k)."""
    return vectors.reshape(len(vectors), -1, vectors.shape[-1])
