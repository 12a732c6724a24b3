"""The links of a mechanism: as kernels take them, and where they are in configurations."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...common.arrays import Floats, Ints
from ...common.derived import derived
from ...kernels.clearance.link_records import BASE, NO_LINKS, PLATFORM, LinkLimits
from ...kernels.joints import loops as K
from ...machine.description.graph import steps_from_base
from ...machine.description.links import ends_on, links_of, scaled_sizes
from ...machine.description.mechanism import Mechanism
from ...machine.motion.displacements import centres, displacements
from ...machine.motion.loops import ways_to
from ...tolerances import TOLERANCES
from .configurations import Configurations


@derived
def links_on_paths(mechanism: Mechanism) -> tuple[LinkLimits, K.Loops]:
    """The links of a mechanism with a clearance, and the ways from the base to their bodies; none without."""
    if mechanism.clearance is None:
        return NO_LINKS, ways_to(mechanism, ())
    steps = steps_from_base(mechanism)
    bodies = sorted(set(steps) - {mechanism.base}, key=lambda body: steps[body])
    on = ends_on(mechanism, {mechanism.base: BASE} | {body: number for number, body in enumerate(bodies)})
    used = np.unique(on[on >= 0])
    on[on >= 0] = np.searchsorted(used, on[on >= 0])
    return link_limits(mechanism, on), ways_to(mechanism, [bodies[k] for k in used])


def link_limits(mechanism: Mechanism, bodies: Ints, least: float = TOLERANCES.apart) -> LinkLimits:
    """The links of a mechanism with a clearance, in L, that move with bodies of these numbers, (s, 2).

    Parameters
    ----------
    least : the clearance kept where the mechanism's own is less [L].
    """
    from ...kernels.clearance.solids import CAPSULE

    links, length = links_of(mechanism), mechanism.characteristic_length
    sizes, places = scaled_sizes(links, 1.0 / length), links.places.copy()
    is_capsule = sizes[:, 0] == CAPSULE
    places[:, 0] /= length
    places[is_capsule, 1] /= length
    clearance = np.array([max((mechanism.clearance or 0.0) / length, least)])
    return NO_LINKS._replace(sizes=sizes, home=places, bodies=bodies, pairs=links.pairs.copy(), least=clearance)


@dataclass(frozen=True, eq=False)
class PlacedLinks:
    """The links of some configurations.

    Attributes
    ----------
    configurations : with the poses of the platform; joint coordinates are read where links on inner bodies need them.
    centres_of : a function that gives the centres of joints by name, (n, 3) [length]: called where links run between
        joints, of which some are neither on the base nor on the platform.
    """

    mechanism: Mechanism
    configurations: Configurations
    centres_of: Callable[[], Mapping[str, Floats]]

    def __len__(self) -> int:
        return len(self.configurations)

    def ends(self, rows: slice) -> Floats:
        """Ends of the axes of capsules on inner bodies, (shapes, 6, n) [length]; the rest is not filled."""
        links, bodies = links_of(self.mechanism), bodies_of_links(self.mechanism)
        ends = np.empty((len(links.sizes), 6, len(self.configurations.rows.status[rows])))
        for k, joints in enumerate(links.joints):
            if bodies[k].max() < 0 or links.sizes[k, 0] != 0.0:
                continue
            if joints:
                for at, name in ((0, joints[0]), (3, joints[1])):
                    ends[k, at : at + 3] = self._centres[name][rows].T
            else:
                ends[k] = _moved(self._moves[k][rows], links.places[k, :2]).reshape(-1, 6).T
        return ends

    def places(self, rows: slice) -> Floats:
        """Places of all shapes in some rows, (n, shapes, 4, 3) [length], as in `kernels.clearance.solids`."""
        links, moves = links_of(self.mechanism), self._displacements(rows)
        places = np.zeros((len(self.configurations.rows.status[rows]), len(links.sizes), 4, 3))
        for k, joints in enumerate(links.joints):
            for at, name in enumerate(joints):
                places[:, k, at] = self._centres[name][rows]
            if not joints:
                n_points = 2 if links.sizes[k, 0] == 0.0 else 1
                places[:, k, :n_points] = _moved(moves[k], links.places[k, :n_points])
                places[:, k, n_points:] = links.places[k, n_points:] @ np.swapaxes(moves[k][:, :3, :3], 1, 2)
        return places

    @cached_property
    def _centres(self) -> Mapping[str, Floats]:
        """The centres of joints, (n, 3) [length]."""
        return self.centres_of()

    @cached_property
    def _moves(self) -> list[Floats]:
        """Displacements of all rows, as of `_displacements`."""
        return self._displacements(slice(None))

    def _displacements(self, rows: slice) -> list[Floats]:
        """Displacements (n, 4, 4) of the body of every shape that does not run between two joints; others have none.

        Those of the platform follow from its pose, and those of inner bodies from all joint coordinates.
        """
        mechanism, poses = self.mechanism, self.configurations.rows.poses[rows]
        base = np.broadcast_to(np.eye(4), poses.shape).copy()
        base[np.isnan(poses[:, 0, 3])] = np.nan
        known = {mechanism.base: base}
        if not mechanism.end_effector_is_joint:
            known[mechanism.end_effector] = poses @ np.linalg.inv(mechanism.home_pose)
        joints = links_of(mechanism).joints
        alone = {shape.body for shape, ends in zip(mechanism.shapes, joints, strict=True) if not ends}
        if alone - set(known):
            known = displacements(mechanism, self.configurations.coordinates[rows]) | known
        none = np.empty((0, 4, 4))
        return [none if ends else known[shape.body] for shape, ends in zip(mechanism.shapes, joints, strict=True)]


@derived
def bodies_of_links(mechanism: Mechanism) -> Ints:
    """The bodies that both ends of every link are on, (shapes, 2): BASE, PLATFORM, or 0 for any other."""
    platform = {} if mechanism.end_effector_is_joint else {mechanism.end_effector: PLATFORM}
    return np.minimum(ends_on(mechanism, {mechanism.base: BASE} | platform), 0)


def placed_at(mechanism: Mechanism, configurations: Configurations) -> PlacedLinks:
    """The links of configurations, with the centres of joints from all their joint coordinates."""
    return PlacedLinks(mechanism, configurations, lambda: centres(mechanism, configurations.coordinates))


def _moved(displaced: Floats, points: Floats) -> Floats:
    """Points of a body (k, 3) at home, where they are now, (n, k, 3)."""
    moved: Floats = points @ np.swapaxes(displaced[:, :3, :3], 1, 2) + displaced[:, None, :3, 3]
    return moved
