"""Workspaces are as large as closed forms say, closed, and bounded by the limits they name."""

from __future__ import annotations

import itertools
from collections import Counter

import numpy as np
import pytest
from numpy.typing import NDArray

import pfabrik as pf
from oracles.annuli import Ring, area, within

Array = NDArray[np.float64]


def struts_only(mechanism: pf.Mechanism) -> pf.Mechanism:
    """The machine with the limits of its actuators alone."""
    passive = [joint for joint in mechanism.joints if not joint.actuated]
    return mechanism.with_limits({joint.name: None for joint in passive if joint.range or joint.cone})


def strut_rings(mechanism: pf.Mechanism, rotation: Array, z: float) -> list[Ring]:
    """Where each strut lets the reference point be at an orientation and height: a ring about its own centre."""
    rings = []
    for strut in (joint for joint in mechanism.joints if joint.actuated):
        assert strut.along is not None
        assert strut.range is not None
        foot, head = (np.array(mechanism.joint(name).at) for name in strut.along)
        centre = foot - rotation @ (head - mechanism.reference_point)
        inner, outer = (np.sqrt(max(length**2 - (z - centre[2]) ** 2, 0.0)) for length in strut.range)
        rings.append((centre[0], centre[1], inner, outer))
    return rings


def grid(found: pf.Workspace, n: int) -> Array:
    """Points (n^d, d) over the bounds of a workspace, and a tenth beyond."""
    low, high = found.bounds
    axes = [np.linspace(a - 0.1 * (b - a), b + 0.1 * (b - a), n) for a, b in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(n ** len(axes), -1)


def test_a_five_bar_without_limits_fills_what_both_its_arms_reach() -> None:
    found = pf.workspace(pf.load("five_bar").without_limits())
    crank, forearm = np.hypot(66.0, 88.0), np.hypot(116.0, 87.0)
    rings = [(y, 0.0, abs(crank - forearm), crank + forearm) for y in (-50.0, 50.0)]
    assert area(rings) == pytest.approx(145_913.87, abs=0.1)
    assert found.names == ("y", "z")
    assert found.area == pytest.approx(area(rings), rel=1e-5)
    assert abs(found.area - area(rings)) <= found.uncertainty
    points = grid(found, 150)
    assert (found.contains(points) == within(rings, points)).all()


def test_a_planar_platform_on_struts_fills_three_rings() -> None:
    machine = struts_only(pf.load("rpr"))
    turn = pf.pose([0, 0, 0], rpy=[0, 0, 10], degrees=True)[:3, :3]
    found = pf.workspace(machine, orientation=turn, resolution=0.01)
    rings = strut_rings(machine, turn, 0.0)
    assert found.area == pytest.approx(area(rings), rel=1e-4)
    assert abs(found.area - area(rings)) <= found.uncertainty
    points = grid(found, 100)
    assert (found.contains(points) == within(rings, points)).all()


@pytest.mark.parametrize("z", [160.0, 200.0, 250.0])
def test_a_slice_of_a_hexapod_fills_six_rings(z: float) -> None:
    machine = struts_only(pf.load("stewart"))
    turn = pf.pose([0, 0, 0], rpy=[5, -3, 8], degrees=True)[:3, :3]
    found = pf.workspace(machine, orientation=turn, fixed={"z": z})
    rings = strut_rings(machine, turn, z)
    assert found.area == pytest.approx(area(rings), rel=1e-4)
    points = grid(found, 100)
    assert (found.contains(points) == within(rings, points)).all()
    assert {bound for _, bound in found.shares} <= {"min", "max"}


def test_a_linear_delta_without_limits_fills_three_cylinders() -> None:
    machine = pf.load("linear_delta").without_limits()
    found = pf.workspace(machine, within={"z": (-60.0, 40.0)}, resolution=5.0)
    turns = np.radians([0.0, 120.0, 240.0])
    rod = np.hypot(145.0 - 40.0, 252.0)
    rings = [(105.0 * np.cos(turn), 105.0 * np.sin(turn), 0.0, rod) for turn in turns]
    assert found.volume == pytest.approx(100.0 * area(rings), rel=1e-3)
    points = grid(found, 24)
    inside = within(rings, points) & (points[:, 2] >= -60.0) & (points[:, 2] <= 40.0)
    assert (found.contains(points) == inside).all()
    assert {("z", "min"), ("z", "max")} < set(found.shares)


def is_closed(faces: NDArray[np.int64]) -> bool:
    """Whether every edge of a mesh (in a plane: every vertex) is passed as often one way as the other."""
    if faces.shape[1] == 2:
        return Counter(faces[:, 0].tolist()) == Counter(faces[:, 1].tolist())
    ways = Counter(itertools.chain(*(map(tuple, faces[:, pair].tolist()) for pair in ([0, 1], [1, 2], [2, 0]))))
    return all(ways[b, a] == count for (a, b), count in ways.items())


@pytest.mark.parametrize(
    ("name", "resolution"),
    [("stewart", 6.0), ("delta", 9.0), ("hexaglide", 4.0), ("rps", 6.0), ("five_bar", None), ("ankle_ups", None)],
)
def test_the_mesh_is_closed_and_encloses_what_is_contained(name: str, resolution: float | None) -> None:
    found = pf.workspace(pf.load(name), resolution=resolution)
    assert is_closed(found.faces)
    low, high = found.bounds - [[0.05], [-0.05]] * np.ptp(found.bounds, axis=0)
    n = 40_000
    hits = float(found.contains(np.random.default_rng(1).uniform(low, high, (n, len(low)))).mean())
    box = float(np.prod(high - low))
    noise = box * np.sqrt(hits * (1.0 - hits) / n)
    assert abs(found.size - box * hits) <= 4.0 * noise + found.uncertainty
