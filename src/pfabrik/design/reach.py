"""The poses that a machine is to reach, as parameters of which some are looked at."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ..answers.tracked import Track
from ..arrays import Floats
from ..certify.certificates import Certificate
from ..certify.pose_region import PoseRegion
from ..certify.question import certify
from ..description.mechanism import Mechanism
from ..errors import InvalidArgument
from ..targets import as_targets
from ..track import track

SAMPLES = 500
"""Random poses of a region beside its corners, of which the worst are looked at next."""

DENSE = 5000
"""Poses by which what has no proof is decided."""


class Reach:
    """The poses that a machine is to reach.

    Attributes
    ----------
    region : PoseRegion or None; else `poses` are all.
    poses : array (n, 4, 4) [length]: corners, middle and random ones of a region.
    from_home : positions count from home's.
    """

    def __init__(self, mechanism: Mechanism, reach: Any, about: str, rng: np.random.Generator) -> None:
        self.from_home, self.region, self._rng = about == "home", None, rng
        self.is_track = isinstance(reach, Track)
        if isinstance(reach, PoseRegion):
            self.region = reach
            self.poses = reach.pose(np.concatenate([reach.middle[None], corners(reach), drawn(reach, SAMPLES, rng)]))
        else:
            given = reach.targets if isinstance(reach, Track) else reach
            self.poses = np.array(as_targets(mechanism, given)[0].reshape(-1, 4, 4))
        if not len(self.poses) or not np.isfinite(self.poses).all():
            raise InvalidArgument("reach", "no poses, or such as are not finite", "a PoseRegion, poses, or a Track")

    def first(self) -> Floats:
        """Poses that are looked at first."""
        return self.poses[:: max(1, len(self.poses) // 8)] if self.region is None else self.poses[:9]

    def dense(self) -> Floats:
        """Poses by which what has no proof is decided."""
        if self.region is None:
            return self.poses
        return np.concatenate([self.poses, self.region.pose(drawn(self.region, DENSE, self._rng))])

    def certificate(self, mechanism: Mechanism, **asked: Any) -> Certificate | None:
        """What `certify` says; None of poses without anything between them."""
        shift = mechanism.reference_point if self.from_home else np.zeros(3)
        if self.region is not None:
            moved = np.concatenate([shift, np.zeros(3)])
            region = dataclasses.replace(self.region, low=self.region.low + moved, high=self.region.high + moved)
            return certify(mechanism, region, **asked)
        if not self.is_track:
            return None
        path: Any = track(mechanism, self.at(mechanism))
        return certify(mechanism, path, **asked)

    def at(self, mechanism: Mechanism) -> Floats:
        """The poses [length] of a machine that is built."""
        poses = self.poses.copy()
        if self.from_home:
            poses[:, :3, 3] += mechanism.reference_point
        return poses

    def relative(self, pose: Floats, mechanism: Mechanism) -> Floats:
        """A pose of a machine that is built, as these poses are."""
        found = pose.copy()
        if self.from_home:
            found[:3, 3] -= mechanism.reference_point
        return found


def corners(region: PoseRegion) -> Floats:
    """Parameters of the ends of a region, (c, 6): of a round one those on its border."""
    sides = [np.unique([low, high]) for low, high in zip(region.low, region.high, strict=True)]
    found = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 6)
    return rounded(region, found)


def drawn(region: PoseRegion, count: int, rng: np.random.Generator) -> Floats:
    """Random parameters in a region, (count, 6), half of them on its border."""
    found = rng.uniform(region.low, region.high, (count, 6))
    ends = np.where(rng.random((count, 6)) < 0.5, region.low, region.high)
    at_end = rng.random((count, 6)) < np.where(np.arange(count) % 2, 0.7, 0.0)[:, None]
    return rounded(region, np.where(at_end, ends, found))


def rounded(region: PoseRegion, parameters: Floats) -> Floats:
    """Parameters moved into the round parts of a region."""
    found = parameters.copy()
    axes = {"box": [], "cylinder": [0, 1], "ball": [0, 1, 2]}[region.shape]
    round_parts = [(axes, region.middle[axes], region.half[0])] if axes else []
    if region.turning == "tilt":
        round_parts.append(([3, 4], np.zeros(2), region.high[3]))
    for places, middle, radius in round_parts:
        off = found[:, places] - middle
        sizes = np.maximum(np.linalg.norm(off, axis=1), np.finfo(float).tiny)
        found[:, places] = middle + off * np.minimum(1.0, radius / sizes)[:, None]
    return found
