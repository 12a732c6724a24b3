"""The oracles themselves: against home, hand-made cases, published tables and brute force."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import oracles
import pfabrik as pf
from machines.published import PUBLISHED
from oracles import Array
from pfabrik import Mechanism

# --- legs in closed form ---------------------------------------------------------------------------------------------


def bent(degrees: float) -> tuple[float, float, float]:
    """A tip of the 5-bar in the middle, its elbows bent by an angle."""
    return 0.0, 0.0, np.sqrt(110**2 + 145**2 + 2 * 110 * 145 * np.cos(np.radians(degrees)) - 50**2)


@pytest.mark.parametrize(
    ("name", "inner", "outer"),
    [
        ("five_bar", bent(10.001), bent(9.999)),  # an elbow bends by no less than 10 degrees
        ("five_bar", (0.0, 0.0, 180.0), (1e-3, 0.0, 180.0)),  # out of its plane
        ("stewart", (0.0, 0.0, 272.75), (0.0, 0.0, 272.77)),  # 280 mm of a strut that spans 60 and 20 mm sideways
    ],
)
def test_bounds_are_where_arithmetic_has_them(name: str, inner: tuple[float, ...], outer: tuple[float, ...]) -> None:
    assert oracles.solve_ik(pf.load(name), [inner, outer]).reached.tolist() == [True, False]


@pytest.mark.parametrize("margin_deg", [0.01, -0.01])
def test_a_cone_is_tested_on_both_sides(margin_deg: float) -> None:
    """With the strokes free, tilting the platform about the joint CL1 brings that joint to its cone's edge."""
    mechanism = pf.load("stewart")
    others = {j.name: None for j in mechanism.joints if j.name != "CL1" and (j.range or j.cone)}
    mechanism = mechanism.with_limits(others)
    head, strut = np.array([40.0, 40.0, 195.0]), np.array([60.0, -20.0, -195.0])
    axis = np.cross(strut, [0.0, 0.0, 1.0])
    tilt = Rotation.from_rotvec(axis / np.linalg.norm(axis) * np.radians(45.0 - margin_deg))
    target = pf.pose(head - tilt.apply([40.0, 40.0, 0.0]), rotation=tilt)
    assert oracles.solve_ik(mechanism, target).reached == (margin_deg > 0)


@pytest.mark.parametrize("p, rpy, lengths", PUBLISHED["gsp_conroy"]["rows_p_rpy_L"])
def test_leg_lengths_agree_with_a_published_hexapod(p: list[float], rpy: list[float], lengths: list[float]) -> None:
    base, platform = (np.array(PUBLISHED["gsp_conroy"]["geometry"][body]) for body in ("base", "platform"))
    assert oracles.leg_lengths(base, platform, pf.pose(p, rpy=rpy)[None])[0] == pytest.approx(lengths, abs=6e-5)


# --- the redundant mechanism against brute force ---------------------------------------------------------------------


def arm_slack(mechanism: Mechanism, leg: str, targets: Array, phi: Array, d: Array) -> Array:
    """Smallest slack of an NRPM arm, ``(n, *phi.shape)``, from the positions of its joints step by step."""
    hinge, slide = mechanism.joint("A" + leg), mechanism.joint("B" + leg)
    pivot = np.array(hinge.at)
    swing = Rotation.from_rotvec((phi.ravel() - hinge.home)[:, None] * np.array(hinge.axis))
    slacks = [share_of_range(phi, hinge.range), share_of_range(d, slide.range)]
    for side in "LR":
        foot, head = mechanism.joint(f"C{side}{leg}"), mechanism.joint(f"E{side}{leg}")
        start = np.array(foot.at) - pivot + (d.ravel() - slide.home)[:, None] * np.array(slide.axis)
        feet = (pivot + swing.apply(start)).reshape(*phi.shape, 3)
        foot_axes = swing.apply(foot.cone.axis).reshape(*phi.shape, 3)
        arm = np.array(head.at) - np.array(mechanism.reference_point)
        heads = targets[:, :3, :3] @ arm + targets[:, :3, 3]
        head_axes = targets[:, :3, :3] @ np.array(head.cone.axis)
        spread = (len(targets),) + (1,) * phi.ndim + (3,)
        lines = heads.reshape(spread) - feet
        slacks.append(share_of_range(np.linalg.norm(lines, axis=-1), mechanism.joint(f"D{side}{leg}").range))
        slacks.append(1 - angle(foot_axes, lines) / foot.cone.half_angle)
        slacks.append(1 - angle(head_axes.reshape(spread), -lines) / head.cone.half_angle)
    return np.min(np.broadcast_arrays(*slacks), axis=0)


def arm_grid(mechanism: Mechanism, leg: str, n: int) -> tuple[Array, Array]:
    """Angles and extensions, ``(n, n)`` each, over the arm's ranges."""
    ranges = (mechanism.joint("A" + leg).range, mechanism.joint("B" + leg).range)
    phi, d = np.meshgrid(*(np.linspace(*limits, n) for limits in ranges), indexing="ij")
    return phi, d


def share_of_range(value: Array, limits: tuple[float, float]) -> Array:
    return np.minimum(value - limits[0], limits[1] - value) / (limits[1] - limits[0])


def angle(first: Array, second: Array) -> Array:
    return np.arctan2(np.linalg.norm(np.cross(first, second), axis=-1), (first * second).sum(axis=-1))


def test_nrpm_margin_is_never_below_what_brute_force_finds() -> None:
    mechanism = pf.load("nrpm")
    targets = oracles.random_targets(mechanism, np.random.default_rng(20), 100)
    grids = [arm_slack(mechanism, leg, targets, *arm_grid(mechanism, leg, 41)).max(axis=(1, 2)) for leg in "123"]
    found, margins = np.min(grids, axis=0), oracles.margin(mechanism, targets)
    assert (margins >= found - oracles.ACCURACY).all()
    near = np.abs(margins) < 0.3
    assert near.sum() > 30
    assert (margins - found)[near].max() < 0.1


def test_nrpm_actuators_attain_the_margin() -> None:
    mechanism = pf.load("nrpm")
    targets = oracles.inside_targets(mechanism, np.random.default_rng(5), 10)
    values = dict(zip(mechanism.actuator_names, oracles.actuators(mechanism, targets).T, strict=True))
    attained = [
        [arm_slack(mechanism, leg, targets[k : k + 1], values["A" + leg][k], values["B" + leg][k])[0] for leg in "123"]
        for k in range(len(targets))
    ]
    assert np.min(attained, axis=1) == pytest.approx(oracles.margin(mechanism, targets), abs=1e-7)
