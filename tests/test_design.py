"""Designs reach what they must, as small as closed forms say, and wishes that contradict each other are named."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import INTERPRETED
from pfabrik import PoseRegion, Status, keep

pytestmark = pytest.mark.skipif(INTERPRETED, reason="thousands of machines")
TEMPLATES = Path(pf.__file__).parent / "catalog" / "templates"
ABOUT_HOME = PoseRegion.box([-30, -30, -30], [30, 30, 30], rotation=math.radians(8))
SLIGHT = PoseRegion.box([-10, -10, -10], [10, 10, 10])
HEXAPOD: dict[str, Any] = {
    "vary": {
        "base_radius": (60, 200),
        "base_angle": (4, 40),
        "platform_radius": (30, 120),
        "platform_angle": (20, 55),
        "height": (100, 400),
        "shortest": (80, 500),
        "longest": (120, 600),
    },
    "reach": ABOUT_HOME,
    "keep": [keep.margin(0.005), keep.stroke(1 / 0.55), "base_radius >= 1.2*platform_radius"],
    "minimise": "(longest + 2*base_radius)/100",
    "about": "home",
}
FIVE_BAR = """
schema = 1
name = "Coaxial five-bar"
units = {{ length = "mm", angle = "deg" }}
base = "base"
end_effector = "Tip"

[dimensions]
crank = {crank}
forearm = {forearm}
elbow = "crank/sqrt(2)"
tip = "elbow + sqrt(forearm**2 - elbow**2)"

[[joint]]
name = "MotorL"
type = "revolute"
actuated = true
connects = ["base", "crankL"]
at = [0, 0, 0]
axis = [0, 0, 1]

[[joint]]
name = "ElbowL"
type = "revolute"
connects = ["crankL", "forearmL"]
at = ["-elbow", "elbow", 0]
axis = [0, 0, 1]

[[joint]]
name = "Tip"
type = "revolute"
connects = ["forearmL", "forearmR"]
at = [0, "tip", 0]
axis = [0, 0, 1]

[[joint]]
name = "ElbowR"
type = "revolute"
connects = ["crankR", "forearmR"]
at = ["elbow", "elbow", 0]
axis = [0, 0, 1]

[[joint]]
name = "MotorR"
type = "revolute"
actuated = true
connects = ["base", "crankR"]
at = [0, 0, 0]
axis = [0, 0, 1]
"""
ORTHOGLIDE = """
schema = 1
name = "Orthoglide"
units = { length = "mm", angle = "deg" }
base = "base"
end_effector = "platform"
reference_point = ["cross", "cross", "cross"]
task = ["x", "y", "z"]

[dimensions]
rod = 400
travel = 300
cross = 0                            # where the rails cross, along the diagonal

[[joint]]
name = "A"
type = "prismatic"
actuated = true
connects = ["base", "carriage"]
axis = [1, 0, 0]
home = "rod"
range = ["rod - travel", "rod + travel"]
copies = { count = 3, axis = [1, 1, 1] }

[[joint]]
name = "UpperL"
type = "spherical"
connects = ["carriage", "rodL"]
at = ["cross + rod + 40", "cross + 30", "cross"]
copies = { count = 3, axis = [1, 1, 1] }

[[joint]]
name = "LowerL"
type = "spherical"
connects = ["rodL", "platform"]
at = ["cross + 40", "cross + 30", "cross"]
copies = { count = 3, axis = [1, 1, 1] }

[[joint]]
name = "UpperR"
type = "spherical"
connects = ["carriage", "rodR"]
at = ["cross + rod + 40", "cross - 30", "cross"]
copies = { count = 3, axis = [1, 1, 1] }

[[joint]]
name = "LowerR"
type = "spherical"
connects = ["rodR", "platform"]
at = ["cross + 40", "cross - 30", "cross"]
copies = { count = 3, axis = [1, 1, 1] }
"""


def template(name: str) -> pf.Mechanism:
    return pf.load(TEMPLATES / f"{name}.toml")


def read(folder: Path, text: str) -> pf.Mechanism:
    path = folder / "machine.toml"
    path.write_text(text)
    return pf.load(path)


def random_poses(found: pf.Design, region: PoseRegion, count: int) -> np.ndarray:
    """Poses of a box about home, half of them on its sides, by SciPy's rotations."""
    rng = np.random.default_rng(5)
    points = rng.uniform(region.low, region.high, (count, 6))
    ends = np.where(rng.random(points.shape) < 0.5, region.low, region.high)
    points[::2] = np.where(rng.random(points.shape) < 0.6, ends, points)[::2]
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, 3] = points[:, :3] + found.mechanism.home_pose[:3, 3]
    poses[:, :3, :3] = Rotation.from_rotvec(points[:, 3:]).as_matrix()
    return poses


@pytest.fixture(scope="module")
def hexapod() -> pf.Design:
    return pf.design(template("6-UPS"), **HEXAPOD)


def test_hexapod_is_proved_and_smaller_than_published(hexapod: pf.Design) -> None:
    assert hexapod.verdict == "PROVED" and bool(hexapod)
    assert hexapod.aim <= 4.4896
    assert len(hexapod.rounds) <= 6
    found = hexapod.dimensions
    assert hexapod.aim == pytest.approx((found["longest"] + 2 * found["base_radius"]) / 100)
    assert found["longest"] <= found["shortest"] / 0.55 * (1 + 1e-6)
    assert found["base_radius"] >= 1.2 * found["platform_radius"] * (1 - 1e-6)
    assert all(low <= found[name] <= high for name, (low, high) in HEXAPOD["vary"].items())
    assert hexapod.certificate.margin >= 0.005
    assert hexapod.certificate.replay()
    assert sum(each.share for each in hexapod.binding) == pytest.approx(1.0, abs=0.02)
    assert "base_radius >= 60" in [each.requirement for each in hexapod.binding]


@pytest.mark.parametrize("count", [100_000, pytest.param(10_000_000, marks=pytest.mark.campaign)])
def test_random_poses_of_the_hexapod_keep_its_margin(hexapod: pf.Design, count: int) -> None:
    done = 0
    while done < count:
        poses = random_poses(hexapod, ABOUT_HOME, 100_000)
        low, high = np.array([drive.joint.range for drive in hexapod.mechanism.drives]).T
        answer = pf.solve_ik(hexapod.mechanism, poses)
        assert (np.asarray(answer.status) == Status.REACHED).all()
        lengths = answer.actuators
        shares = np.minimum(lengths - low, high - lengths) / (0.5 * (high - low))
        assert shares.min() >= 0.005
        done += len(poses)


@pytest.mark.parametrize("count", [2, pytest.param(20, marks=pytest.mark.campaign)])
def test_starts_do_not_matter(hexapod: pf.Design, count: int) -> None:
    rng, aims = np.random.default_rng(1), [hexapod.aim]
    for seed in range(count):
        values = {name: rng.uniform(low, high) for name, (low, high) in HEXAPOD["vary"].items()}
        try:
            machine = template("6-UPS").with_dimensions(values)
        except pf.errors.InvalidMechanism:
            machine = template("6-UPS")
        found = pf.design(machine, **HEXAPOD, seed=seed)
        assert found.verdict == "PROVED"
        aims.append(found.aim)
    assert max(aims) <= 1.01 * min(aims)


def test_orthoglide_has_the_rods_of_its_closed_form(folder: Path) -> None:
    """At p (1, 1, 1) from where rails cross, actuator speeds are I - t (ones - I), t = p / sqrt(L^2 - 2 p^2).

    Their factors are 1 - 2 t along the diagonal and 1 + t across: both bounds hold for -1/2 <= t <= 1/4, and the
    cube's diagonal is the way from one to the other.
    """
    first, last = (t / math.sqrt(1 + 2 * t * t) for t in (-0.5, 0.25))
    rod = 200.0 / (last - first)
    found = pf.design(
        read(folder, ORTHOGLIDE),
        {"rod": (250, 600), "travel": (100, 400), "cross": (-100, 100)},
        PoseRegion.box([-100, -100, -100], [100, 100, 100]),
        keep=[keep.factors(0.5, 2)],
        minimise="rod",
    )
    assert found.verdict == "PROVED"
    assert rod == pytest.approx(310.583, abs=1e-3)
    assert found.dimensions["rod"] == pytest.approx(rod, abs=0.1)
    assert found.dimensions["cross"] == pytest.approx(-0.5 * (first + last) * rod, abs=0.1)
    assert {each.requirement for each in found.binding} == {"factors 0.5 to 2"}
    assert found.unproved[0] == "factors 0.5 to 2"


@pytest.mark.parametrize("crank, forearm, low, high", [(120, 150, 50, 200), (90, 130, 30, 150), (150, 150, 60, 260)])
def test_coaxial_five_bar_reaches_an_annulus(
    folder: Path, crank: float, forearm: float, low: float, high: float
) -> None:
    turns = np.linspace(0, 2 * math.pi, 12, endpoint=False)
    circle = np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
    found = pf.design(
        read(folder, FIVE_BAR.format(crank=crank, forearm=forearm)),
        {"crank": (20, 400), "forearm": (20, 400)},
        np.concatenate([r * circle for r in np.linspace(low, high, 5)]),
        keep=[keep.singularity(None)],
        minimise="crank + forearm",
    )
    assert found.verdict == "CHECKED"
    assert found.aim == pytest.approx(high, rel=1e-6)
    assert abs(found.dimensions["crank"] - found.dimensions["forearm"]) <= low * (1 + 1e-6)


# What no design can have.
