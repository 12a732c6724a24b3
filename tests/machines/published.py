"""Machines for forward kinematics: built from published dimensions, or with a known number of assembly modes."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from oracles import assembly
from pfabrik import Joint, Mechanism, pose

from .positions import ring, struts

Array = NDArray[np.float64]

PUBLISHED: dict[str, Any] = json.loads(
    (Path(__file__).parents[1] / "data" / "published_cases.json").read_text(encoding="utf-8")
)
"""Published geometries and answers, each with its source."""


def moved_from_home(own: Array, home_pose: Array) -> Array:
    """A pose given in the platform's own coordinates, as the library counts it: the rotation from home."""
    return pose(own[..., :3, 3], rotation=own[..., :3, :3] @ home_pose[:3, :3].T)


def lee_shah_pose(row: Sequence[float]) -> Array:
    """The pose of a 3-RPS in a row of Lee and Shah's table: two angles, then z, x and y."""
    a, b, pz, px, py = row[:5]
    return pose((px, py, pz), rotation=Rotation.from_euler("ZYZ", [a, b, -a]))


# --- planar ----------------------------------------------------------------------------------------------------------


def planar_3rpr(geometry: assembly.Planar3RPR, p: Sequence[float]) -> tuple[Mechanism, Array]:
    """A planar 3-RPR at home in the first of its configurations with strut lengths p, and home's (theta, x, y)."""
    home = np.array(geometry.solutions(p)[0])
    joints = []
    for i, (a, c) in enumerate(zip(geometry.anchors, geometry.corners(*home), strict=True), 1):
        joints += [
            Joint(f"A{i}", "revolute", ("base", f"cylinder{i}"), at=(*a, 0.0), axis=(0, 0, 1)),
            Joint(f"B{i}", "prismatic", (f"cylinder{i}", f"rod{i}"), along=(f"A{i}", f"C{i}"), actuated=True),
            Joint(f"C{i}", "revolute", (f"rod{i}", "platform"), at=(*c, 0.0), axis=(0, 0, 1)),
        ]
    return Mechanism("planar 3-RPR", joints, "platform", (*home[1:], 0.0)), home


def planar_pose(theta_x_y: Sequence[float], home: Array) -> Array:
    """The library's pose of a planar 3-RPR in Sauer's coordinates."""
    theta, x, y = theta_x_y
    return pose((x, y, 0.0), rotvec=(0, 0, theta - home[0]))


ARM_LINKS = np.array([300.0, 200.0, 100.0])
ARM_HOME = np.array([0.3, 0.4, 0.5])


def planar_arm() -> Mechanism:
    """A serial arm of three driven revolutes in the plane z = 0, whose coordinates count from the link before."""
    joints, at = [], np.zeros(3)
    for k, heading in enumerate(np.cumsum(ARM_HOME)):
        bodies = ("base" if k == 0 else f"link{k}", "hand" if k == 2 else f"link{k + 1}")
        joints.append(
            Joint(f"J{k + 1}", "revolute", bodies, at=at, axis=(0, 0, 1), home=float(ARM_HOME[k]), actuated=True)
        )
        at = at + ARM_LINKS[k] * np.array([np.cos(heading), np.sin(heading), 0.0])
    return Mechanism("planar arm", joints, "hand", tuple(at))


# --- three legs ------------------------------------------------------------------------------------------------------


def rps(base_radius: float, platform_radius: float, height: float) -> Mechanism:
    """A 3-RPS without limits, feet 120 degrees apart and hinges tangential, level at home."""
    joints = []
    for i, azimuth in enumerate((0.0, 120.0, 240.0), 1):
        out, along = (np.array(ring(1.0, 0.0, [azimuth + turn])[0]) for turn in (0.0, 90.0))
        joints += [
            Joint(f"R{i}", "revolute", ("base", f"cylinder{i}"), at=base_radius * out, axis=along),
            Joint(f"P{i}", "prismatic", (f"cylinder{i}", f"rod{i}"), along=(f"R{i}", f"S{i}"), actuated=True),
            Joint(f"S{i}", "spherical", (f"rod{i}", "platform"), at=platform_radius * out + [0, 0, height]),
        ]
    return Mechanism("3-RPS", joints, "platform", (0, 0, height))


TRIPOD_FEET = np.array([[0.0, 0, 0], [200, 30, 10], [70, 180, -20]])
TRIPOD_TIP = np.array([80.0, 60.0, 250.0])


def tripod() -> Mechanism:
    """Three struts that meet at a point: one carries the tool (U-P), the others end on it in ball joints (U-P-S).

    The point is where three spheres meet. The tool's own joint turns about x, then about y, and so holds a point in
    two postures of the tool.
    """
    a, b, c = TRIPOD_FEET
    line, length = TRIPOD_TIP - a, float(np.linalg.norm(TRIPOD_TIP - a))
    joints = [
        Joint("A1", "universal", ("base", "cylinder1"), at=a, axes=((1, 0, 0), (0, 1, 0))),
        Joint("B1", "prismatic", ("cylinder1", "tool"), axis=line, home=length, actuated=True),
    ]
    for i, foot in ((2, b), (3, c)):
        joints += [
            Joint(f"A{i}", "universal", ("base", f"cylinder{i}"), at=foot),
            Joint(f"B{i}", "prismatic", (f"cylinder{i}", f"rod{i}"), along=(f"A{i}", f"C{i}"), actuated=True),
            Joint(f"C{i}", "spherical", (f"rod{i}", "tool"), at=TRIPOD_TIP),
        ]
    return Mechanism("tripod", joints, "tool", tuple(TRIPOD_TIP))


# --- six struts ------------------------------------------------------------------------------------------------------


def gough(base: Any, platform: Any, home_pose: Array, name: str = "6-UPS") -> Mechanism:
    """Six unlimited U-P-S struts; `platform` in the platform's own coordinates, placed by `home_pose` at home.

    The library counts rotations from home: see `moved_from_home`.
    """
    heads = np.array(platform, float) @ home_pose[:3, :3].T + home_pose[:3, 3]
    return Mechanism(name, struts(np.array(base, float), heads), "platform", tuple(home_pose[:3, 3]))


def published_gough(case: str, p: Sequence[float]) -> Mechanism:
    """A published 6-UPS, level at home at position p."""
    geometry = PUBLISHED[case]["geometry"]
    return gough(geometry["base"], geometry["platform"], pose(p), case)


def dietmaier() -> Mechanism:
    """Dietmaier's platform, which has 40 real assembly modes at its published lengths, at home near one of them."""
    geometry = PUBLISHED["gsp_dietmaier"]["geometry"]
    home = pose((0.478, -0.781, -0.402), quat_xyzw=(0.765, 0.239, -0.172, -0.572))
    return gough(geometry["base"], geometry["platform"], home, "Dietmaier's platform")


def similar_hexagons() -> Mechanism:
    """A 6-UPS that is singular everywhere: base and platform are similar hexagons, corner above corner.

    With its struts locked it still moves, from every pose; constructing it warns of that.
    """
    base, platform = (ring(radius, 0.0, (0, 40, 120, 160, 240, 280)) for radius in (100.0, 60.0))
    return gough(base, platform, pose((3.0, -2.0, 150.0), rotvec=(0.2, -0.1, 0.3)), "similar hexagons")


# --- more actuators than freedoms ------------------------------------------------------------------------------------

STROKE, RAIL = (160.0, 300.0), 150.0
QUARTERS = [0.0, 90.0, 180.0, 270.0]


def _on_circle(radius: float, degrees: Any) -> Array:
    return np.array(ring(radius, 0.0, degrees))


STRUTS = _on_circle(150.0, [10, 60, 110, 130, 230, 250, 350]), _on_circle(80.0, [50, 60, 75, 170, 190, 290, 310])
"""Both ends of the struts of `seven_struts`, (7, 3) each, in the base's and in the platform's coordinates."""
RODS = _on_circle(190.0, np.subtract(QUARTERS, 40.0)), _on_circle(60.0, QUARTERS)
"""Where the rods of `four_rails` begin and end at home, (4, 3) each."""
RAILS = _on_circle(1.0, np.add(QUARTERS, 90.0))


def seven_struts() -> Mechanism:
    """A 7-UPS: six lengths fix the platform, up to its assembly mode, and the seventh must agree."""
    return gough(*STRUTS, pose((0, 0, 200.0)), "7-UPS").with_limits({f"B{i}": STROKE for i in range(1, 8)})


def four_rails() -> Mechanism:
    """A planar 4-PRR: rods from carriages on the sides of a square to a platform within; three of them would do."""
    rail = {"axis": RAILS.tolist(), "range": (-RAIL, RAIL)}
    parts = {"base": RODS[0], "platform": RODS[1], "axis": "z", "A": rail, "reference_point": (0, 0, 0)}
    return Mechanism.from_legs("P*-R-R", name="planar 4-PRR", task=("x", "y", "rotation"), **parts)


def seven_struts_readings(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """Random poses (n, 4, 4) of `seven_struts`, turned by up to 2 rad about any axis, and their lengths (n, 7)."""
    turns = rng.normal(size=(400 * n, 3))
    turns *= (rng.uniform(0.0, 2.0, len(turns)) / np.linalg.norm(turns, axis=1))[:, None]
    poses = pose(rng.uniform([-150, -150, 80], [150, 150, 320], turns.shape), rotvec=turns)
    lengths = np.linalg.norm(_lines(poses, *STRUTS), axis=2)
    kept = ((lengths >= STROKE[0]) & (lengths <= STROKE[1])).all(axis=1)
    return poses[kept][:n], lengths[kept][:n]


def four_rails_readings(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """Random poses (n, 4, 4) of `four_rails` in any of its working modes, and where its carriages are (n, 4)."""
    turns, modes = rng.uniform(-np.pi, np.pi, (400 * n, 1)), rng.choice([-1.0, 1.0], (400 * n, 4))
    poses = pose(rng.uniform(-80, 80, (len(turns), 3)) * [1, 1, 0], rotvec=turns * [0, 0, 1])
    lines = _lines(poses, *RODS)
    middle = (lines * RAILS).sum(axis=2)
    square = (np.subtract(*RODS) ** 2).sum(axis=1) - (lines**2).sum(axis=2) + middle**2
    values = middle + modes * np.sqrt(np.maximum(square, 0.0))
    kept = ((square >= 0.0) & (np.abs(values) <= RAIL)).all(axis=1)
    return poses[kept][:n], values[kept][:n]


def _lines(poses: Array, feet: Array, tops: Array) -> Array:
    """From feet on the base to tops on the platform at poses (n, 4, 4), (n, k, 3)."""
    return np.asarray(tops @ poses[:, :3, :3].swapaxes(1, 2) + poses[:, None, :3, 3] - feet)
