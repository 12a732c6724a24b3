"""Where the links of configurations are."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Floats
from ..closure.configurations import Configurations
from ..description.links import links_of
from ..description.mechanism import Mechanism
from ..motion.displacements import centres, displacements


@dataclass(frozen=True, eq=False)
class PlacedLinks:
    """The links of some configurations.

    Attributes
    ----------
    configurations : with the poses of the platform; joint coordinates are read where links on inner bodies need them.
    centres_of : a function that gives the centres of joints by name, (n, 3) [length]: called where links run between
        joints that are neither on the base nor on the platform.
    """

    mechanism: Mechanism
    configurations: Configurations
    centres_of: Callable[[], Mapping[str, Floats]]

    def __len__(self) -> int:
        return len(self.configurations)

    def ends(self) -> Floats:
        """Ends of the axes of all capsules, (shapes, 6, n) [length]; other shapes are left out."""
        links = links_of(self.mechanism)
        ends = np.zeros((len(links.sizes), 6, len(self)))
        moves = self._displacements(slice(None))
        for k, joints in enumerate(links.joints):
            if joints:
                for at, name in ((0, joints[0]), (3, joints[1])):
                    ends[k, at : at + 3] = self._centres[name]
            elif links.sizes[k, 0] == 0.0:
                ends[k] = _moved(moves[k], links.places[k, :2]).reshape(-1, 6).T
        return ends

    def places(self, rows: slice) -> Floats:
        """Places of all shapes in some rows, (n, shapes, 4, 3) [length], as in `kernels.clearance.solids`."""
        links, moves = links_of(self.mechanism), self._displacements(rows)
        places = np.zeros((len(self.configurations.rows.status[rows]), len(links.sizes), 4, 3))
        for k, joints in enumerate(links.joints):
            for at, name in enumerate(joints):
                places[:, k, at] = self._centres[name].T[rows]
            if not joints:
                n_points = 2 if links.sizes[k, 0] == 0.0 else 1
                places[:, k, :n_points] = _moved(moves[k], links.places[k, :n_points])
                places[:, k, n_points:] = links.places[k, n_points:] @ np.swapaxes(moves[k][:, :3, :3], 1, 2)
        return places

    @cached_property
    def _centres(self) -> dict[str, Floats]:
        """The centres of the joints that links run between, (3, n) [length], or (3, 1) for those on the base."""
        mechanism = self.mechanism
        names = list(dict.fromkeys(name for joints in links_of(mechanism).joints for name in joints))
        on_base = [name for name in names if mechanism.base in mechanism.joint(name).connects]
        on_platform = [name for name in names if mechanism.end_effector in mechanism.joint(name).connects]
        found = {name: np.array(mechanism.joint(name).at)[:, None] for name in on_base}
        if on_platform and not mechanism.end_effector_is_joint:
            offsets = np.array([mechanism.joint(name).at for name in on_platform]) - mechanism.home_pose[:3, 3]
            points = np.concatenate([offsets, np.ones((len(offsets), 1))], axis=1)
            poses = self.configurations.rows.poses[:, :3]
            moved = (poses.reshape(-1, 4) @ points.T).reshape(len(poses), 3, -1)
            found |= {name: moved[:, :, k].T for k, name in enumerate(on_platform)}
        if len(found) < len(names):
            found = {name: centre.T for name, centre in self.centres_of().items() if name in names} | found
        return found

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


def placed_at(mechanism: Mechanism, configurations: Configurations) -> PlacedLinks:
    """The links of configurations, with the centres of joints from all their joint coordinates."""
    return PlacedLinks(mechanism, configurations, lambda: centres(mechanism, configurations.coordinates))


def _moved(displaced: Floats, points: Floats) -> Floats:
    """Points of a body (k, 3) at home, where they are now, (n, k, 3)."""
    moved: Floats = points @ np.swapaxes(displaced[:, :3, :3], 1, 2) + displaced[:, None, :3, 3]
    return moved
