"""Sizes of workspaces are off closed forms by what they say at most, at any resolution, and they say little."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from oracles.annuli import area
from test_workspace import strut_rings, struts_only

Case = tuple[pf.Mechanism, dict[str, Any], float]
"""A machine, the options of its workspace, and the exact size."""


def two_links(a: float, b: float, elbow: tuple[float, float] | None = None, turn: float = 0.0) -> pf.Mechanism:
    """An arm in a plane, its elbow within a range, in whose middle it is at home, its shoulder within a turn [rad]."""
    bend = 0.5 * np.pi if elbow is None else sum(elbow) / 2.0
    bends = None if elbow is None else (elbow[0] - bend, elbow[1] - bend)
    turns = (-0.5 * turn, 0.5 * turn) if turn else None
    hand = (a + b * np.cos(bend), b * np.sin(bend), 0)
    joints = [
        pf.Joint("A", "revolute", ("base", "a"), at=(0, 0, 0), axis=(0, 0, 1), actuated=True, range=turns),
        pf.Joint("B", "revolute", ("a", "b"), at=(a, 0, 0), axis=(0, 0, 1), actuated=True, range=bends),
        pf.Joint("tip", "revolute", ("b", "c"), at=hand, axis=(0, 0, 1)),
    ]
    return pf.Mechanism("2R", joints, "tip", task=("x", "y"))


def gantry(*sides: float, turn: float = 0.0) -> pf.Mechanism:
    """Slides along x, y and z by given lengths, not about the middle; and a wrist that turns about z [rad]."""
    names, joints = ("base", "x", "y", "z", "wrist"), []
    for k, side in enumerate(sides):
        ends = (-0.3 * side, 0.7 * side)
        axis = np.eye(3)[k]
        joints.append(pf.Joint("XYZ"[k], "prismatic", names[k : k + 2], axis=axis, actuated=True, range=ends))
    last = names[len(sides)]
    if turn:
        ends = (-0.4 * turn, 0.6 * turn)
        joints.append(pf.Joint("W", "revolute", (last, "tip"), at=(0, 0, 1), axis=(0, 0, 1), actuated=True, range=ends))
    else:
        joints.append(pf.Joint("W", "fixed", (last, "tip"), at=(0, 0, 1)))
    return pf.Mechanism(
        "gantry", joints, "tip", (0, 0, 1), task=("x", "y", "z", "yaw")[: len(sides)] + ("yaw",) * bool(turn)
    )


def cases() -> Iterator[Any]:
    """Annuli, sectors, boxes, rings, cylinders and balls in common, and yaw beside positions."""
    for a, b in ((210, 250), (300, 100), (150, 400), (100, 97)):
        yield pytest.param((two_links(a, b), {}, 4.0 * np.pi * a * b), id=f"annulus {a} {b}")
    for low, high, turn in ((0.3, 2.5, 1.0), (1.0, 1.2, 4.0), (0.05, 3.1, 2.0)):
        exact = 210.0 * 250.0 * turn * (np.cos(low) - np.cos(high))
        yield pytest.param((two_links(210, 250, (low, high), turn), {}, exact), id=f"sector {low} {high}")
    crank, forearm = np.hypot(66.0, 88.0), np.hypot(116.0, 87.0)
    rings = [(y, 0.0, abs(crank - forearm), crank + forearm) for y in (-50.0, 50.0)]
    yield pytest.param((pf.load("five_bar").without_limits(), {}, area(rings)), id="lens")
    for sides in ((3.0, 2.0), (7.0, 0.4), (3.0, 2.0, 1.0)):
        yield pytest.param((gantry(*sides), {}, float(np.prod(sides))), id=f"box {sides}")
    yield pytest.param((gantry(3.0, 2.0, turn=2.0), {"over": ("x", "y", "yaw")}, 12.0), id="box with yaw")
    yield pytest.param((gantry(3.0, 2.0, turn=2.0), {"over": ("x", "yaw")}, 6.0), id="x with yaw")
    machine = struts_only(pf.load("stewart"))
    turn = pf.pose([0, 0, 0], rpy=[5, -3, 8], degrees=True)[:3, :3]
    nodes, weights = np.polynomial.legendre.leggauss(150)
    heights = 205.0 + 145.0 * nodes
    slices = [area(strut_rings(machine, turn, z), 1_000) for z in heights]
    yield pytest.param(
        (machine, {"orientation": turn, "within": {"z": (60.0, 350.0)}}, 145.0 * weights @ slices), id="shells"
    )
    for z in (160.0, 250.0):
        slice_ = {"orientation": turn, "fixed": {"z": z}}
        yield pytest.param((machine, slice_, area(strut_rings(machine, turn, z))), id=f"rings {z}")
    linear, rod = pf.load("linear_delta").without_limits(), np.hypot(145.0 - 40.0, 252.0)
    rings = [(105.0 * np.cos(turn), 105.0 * np.sin(turn), 0.0, rod) for turn in np.radians([0.0, 120.0, 240.0])]
    yield pytest.param((linear, {"within": {"z": (-60.0, 40.0)}}, 100.0 * area(rings)), id="cylinders")


@pytest.mark.parametrize("case", list(cases()))
def test_a_size_is_off_by_its_uncertainty_at_most(case: Case) -> None:
    machine, options, exact = case
    default = pf.workspace(machine, **options)
    assert default.uncertainty <= 0.02 * exact
    resolution = next((r for r, unit in zip(default.resolution, default.units, strict=True) if unit != "rad"))
    for factor in (None, 1.37, 2.9):
        coarser = {} if factor is None else {"resolution": factor * resolution}
        found = default if factor is None else pf.workspace(machine, **options, **coarser)
        assert abs(found.size - exact) <= found.uncertainty, factor
        assert found.uncertainty <= 0.25 * exact
