"""The poses that a machine is to reach, as parameters of which some are looked at."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from ...answers.tracked import Track
from ...common.arrays import Floats
from ...errors import InvalidArgument
from ...kinematics import as_targets, plane_of, task_of
from ...machine.description.mechanism import Mechanism
from ...machine.poses import are_poses
from ...tolerances import TOLERANCES
from ...track import track
from ..certify.certificates import Certificate
from ..certify.pose_region import PoseRegion, drawn, rounded
from ..certify.question import certify, require_task

SAMPLES, DENSE = 300, 2000
"""Random poses of a region of which the worst are looked at next, and by which what has no proof is decided."""

PLACES, AROUND, SIZES = 16, 24, (0.3, 0.1, 0.03, 0.01)
"""How many of the worst are looked around, at how many poses, and how far away [half sizes of the region]."""


class PosesToReach:
    """The poses that a machine is to reach.

    Attributes
    ----------
    region : PoseRegion or None; else `poses` are all.
    poses : array (n, 4, 4) [length]: of a region its middle and corners.
    first : those that are looked at first.
    moves : array (3,): 1 for axes along which positions count from home's, as along all that the task does not set.
    """

    def __init__(self, mechanism: Mechanism, reach: Any, about: str, rng: np.random.Generator) -> None:
        self.region, self._rng, self.is_track = None, rng, isinstance(reach, Track)
        self.moves = np.where(task_of(mechanism).axes, float(about == "home"), 1.0)
        fixed = (self.moves - float(about == "home")) * mechanism.home_pose[:3, 3]
        self._home = mechanism.home_pose[:3, 3]
        if isinstance(reach, PoseRegion):
            region = _shifted(reach.of(mechanism), -fixed)
            require_task(mechanism, _shifted(region, self.moves * self._home))
            if region.path is not None and task_of(mechanism).axes != (False, False, False):
                raise InvalidArgument("reach", "joints that move what the task sets", "positions, tilts or rotations")
            self.region = region
            self.poses = self._posed(np.concatenate([region.middle[None], corners(region)]))
            self.first = self.poses[:9]
        else:
            given = reach.targets if isinstance(reach, Track) else reach
            self.poses = np.array(as_targets(mechanism, given)[0].reshape(-1, 4, 4))
            if not len(self.poses) or not are_poses(self.poses).all():
                raise InvalidArgument("reach", "no poses, or rows that are none", "a PoseRegion, finite poses, a Track")
            self.poses[:, :3, 3] -= fixed
            self.first = self.poses[:: max(1, len(self.poses) // 8)]

    def _posed(self, parameters: Floats) -> Floats:
        """Poses (n, 4, 4) of parameters of the region (n, 6); of joints, rotations alone: they turn a task without a
        position."""
        assert self.region is not None
        found = self.region.pose(parameters)
        if self.region.path is not None:
            found[:, :3, 3] = 0.0
        return found

    def require_plane(self, mechanism: Mechanism, homes: Floats) -> None:
        """Raise if poses are out of the plane of a planar machine, whose reference point may be at homes (k, 3)."""
        plane, task = plane_of(mechanism), task_of(mechanism)
        if plane is None:
            return
        normal, length = np.cross(*plane), mechanism.characteristic_length
        heights, planes = self.poses[:, :3, 3] * task.axes @ normal, homes * (1.0 - self.moves) @ normal
        if np.ptp(planes) > TOLERANCES.alignment * length:  # dimensions move the plane
            planes = heights
        turned = length * (self.poses[:, :3, :3] @ normal - normal) * (task.rotations == 3)
        if max(np.abs(heights - planes[0]).max(), np.abs(turned).max()) > TOLERANCES.alignment * length:
            raise InvalidArgument("reach", "poses out of its plane", f"one plane: '{mechanism.name}' is planar")

    def worst(self, least: Callable[[Floats], Floats], count: int) -> tuple[Floats, Floats]:
        """Poses where a function of poses (n, 4, 4) is about the least, and its values there, the least first.

        Of a region: random poses, then others ever nearer to the worst of these, which are apart from each other.
        """
        region = self.region
        if region is None:
            values = least(self.poses)
            order = np.argsort(values)
            return self.poses[order], values[order]
        found = np.concatenate([region.middle[None], corners(region), drawn(region, count, self._rng)])
        values = least(self._posed(found))
        best = _apart(found[np.argsort(values)], region.half)
        for size in SIZES:
            steps = self._rng.uniform(-size, size, (AROUND, len(best), 6)) * region.half
            steps[0] = 0.0
            near = rounded(region, np.clip(best + steps, region.low, region.high))
            values = least(self._posed(near.reshape(-1, 6))).reshape(AROUND, -1)
            best, values = near[values.argmin(axis=0), np.arange(len(best))], values.min(axis=0)
        order = np.argsort(values)
        return self._posed(best[order]), values[order]

    def certificate(self, mechanism: Mechanism, **asked: Any) -> Certificate | None:
        """The certificate of a region or track; None of separate poses."""
        if self.region is not None:
            return certify(mechanism, _shifted(self.region, self.moves * mechanism.home_pose[:3, 3]), **asked)
        if not self.is_track or len(self.poses) < 2:
            return None
        path: Any = track(mechanism, self.at(mechanism, self.poses))
        return certify(mechanism, path, **asked)

    def at(self, mechanism: Mechanism, poses: Floats, sign: float = 1.0) -> Floats:
        """Poses (n, 4, 4) [length] of a machine that is built; with sign -1, such poses as those here are."""
        found = poses.copy()
        found[:, :3, 3] += sign * self.moves * mechanism.home_pose[:3, 3]
        return found


def _apart(parameters: Floats, half: Floats) -> Floats:
    """The first of some parameters (n, 6) that are apart from those before them, of the first hundred."""
    shares, kept = parameters[:100] / np.where(half > 0.0, half, np.inf), [0]
    for place in range(1, len(shares)):
        if len(kept) < PLACES and (np.abs(shares[place] - shares[kept]).max(axis=1) > 2.0 * SIZES[0]).all():
            kept.append(place)
    return parameters[kept]


def _shifted(region: PoseRegion, shift: Floats) -> PoseRegion:
    if region.path is not None:
        return region
    moved = np.concatenate([shift, np.zeros(3)])
    return dataclasses.replace(region, low=region.low + moved, high=region.high + moved)


def corners(region: PoseRegion) -> Floats:
    """Parameters of the ends of a region, (c, 6): of a round one those on its border."""
    sides = [np.unique([low, high]) for low, high in zip(region.low, region.high, strict=True)]
    found = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 6)
    return rounded(region, found)
