"""What is run: for each machine its paths, how its random targets are drawn, and what the paper printed."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from importlib.resources import files
from typing import Any

import numpy as np

from pfabrik import Mechanism, Options, Solution, Track, load, passes, pose, solve_ik, track

from .arrays import Floats

Tick = Callable[[], None]

SETTINGS = {
    "paper": passes.Options.paper(),
    "extended": passes.Options.extended(),
    "accelerated": passes.Options.accelerated(),
    "default": Options(),
}
"""The paper's passes, with its E and its projection; these with two rules and a clamp that are not the paper's; passes
with exact meetings and half-spaces, which are not its own either; and what the library does unless told otherwise:
where legs have closed forms it takes them, and no passes at all."""

LEAVING = SETTINGS | {"centroid": passes.Options.centroid()}
"""What follows circles that leave the workspace: also the paper's projection, by least-squares fits, not passes."""


def solve(mechanism: Mechanism, targets: Floats, options: Options, start: Solution | None = None) -> Solution:
    """Answers by passes, or by default, as the options say."""
    if isinstance(options, passes.Options):
        return passes.solve(mechanism, targets, options, start=start)
    return solve_ik(mechanism, targets, start=start, options=options)


def follow(mechanism: Mechanism, targets: Floats, options: Options) -> Track:
    """Answers along a path, by passes or by default."""
    if isinstance(options, passes.Options):
        return passes.track(mechanism, targets, options)
    return track(mechanism, targets, options=options)


@dataclass(frozen=True)
class Circle:
    """A circle in the y-z plane through its centre, traced once from its lowest point.

    Attributes
    ----------
    center : (x, y, z) [length unit of the mechanism].
    radius : in the same unit.
    swing : how far roll, pitch and yaw swing on the way [deg]: as the sine and the cosine of the angle on the circle,
        and the sine of twice that angle.
    """

    center: tuple[float, float, float]
    radius: float
    swing: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def poses(self, count: int) -> Floats:
        """`count` poses (count, 4, 4), evenly spaced; the last one is the first one again."""
        turn = np.linspace(0, 2 * np.pi, count)
        around = np.stack([np.zeros(count), np.sin(turn), -np.cos(turn)], axis=-1)
        points = np.asarray(self.center) + self.radius * around
        angles = np.radians(self.swing) * np.stack([np.sin(turn), np.cos(turn), np.sin(2 * turn)], axis=-1)
        return np.stack([pose(xyz, rpy=rpy) for xyz, rpy in zip(points, angles, strict=True)])


@dataclass(frozen=True)
class Printed:
    """What the paper's tables say: RMSE [mm], [deg]; average passes; average times [ms]."""

    position_rmse: float
    iterations: float
    time: float
    geometric_time: float
    orientation_rmse: float | None = None

    @property
    def ratio(self) -> float:
        """Time of P-FABRIK over that of the geometric approach."""
        return self.time / self.geometric_time


@dataclass(frozen=True)
class Case:
    """One machine in the study."""

    key: str
    label: str
    shown: tuple[str, ...]
    inside: Circle
    leaving: Circle
    size: float
    turn: float
    printed: Printed

    @cached_property
    def mechanism(self) -> Mechanism:
        return load(self.key)


@dataclass(frozen=True)
class Extent:
    """How much is run."""

    steps: int
    """Targets on each circle."""
    targets: int
    """Random targets of each machine."""
    repeats: int
    """How often a time is taken; the median counts."""
    searches: int
    """Projected steps of each machine whose nearest feasible pose is searched; evenly spread."""


FULL = Extent(steps=361, targets=1000, repeats=15, searches=1000)
QUICK = Extent(steps=73, targets=100, repeats=2, searches=6)


@lru_cache(maxsize=1)
def cases() -> tuple[Case, ...]:
    """All machines of the study, in the paper's order."""
    text = (files(__package__) / "paper.toml").read_text(encoding="utf-8")
    return tuple(_case(key, entry) for key, entry in tomllib.loads(text).items())


def _case(key: str, entry: dict[str, Any]) -> Case:
    return Case(
        key=key,
        label=entry["label"],
        shown=tuple(entry["shown"]),
        inside=_circle(entry["inside"]),
        leaving=_circle(entry["leaving"]),
        size=float(entry["random"]["size"]),
        turn=float(np.radians(entry["random"]["turn"])),
        printed=Printed(**entry["printed"]),
    )


def _circle(entry: dict[str, Any]) -> Circle:
    return Circle(tuple(entry["center"]), float(entry["radius"]), tuple(entry.get("swing", (0.0, 0.0, 0.0))))
