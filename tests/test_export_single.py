"""The exported C in single precision, on machines as they are drawn: what is out of reach is found as in double."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from exported import compiled, needs_compiler
from machines.closure import TURNS, X, Y, Z, chain, out
from machines.drawn import DRAWN
from machines.positions import ring
from pfabrik.exchange.export import source
from pfabrik.exchange.export.export_c import c_source
from pfabrik.exchange.export.static_data import Precision
from test_export_nearest import Said, costs, said_by

Array = np.ndarray
Draw = np.random.Generator
PARTS: Any = ("ik", "limits", "fk", "nearest")
N_TARGETS, SIZE, TILT = 60, 1.2, 0.6
"""Targets of each machine, and how far from home they are [L], [rad]: most are out of reach."""

FINEST = 1e-4
"""Distance that is none [L]: what single precision promises."""

THICKNESS, CLEARANCE = 5.0, 2.0
OFTEN, LONG = 1, 50
"""Machines drawn of each kind in the slow tests, and in a campaign."""


def struts(rng: Draw, **more: Any) -> pf.Mechanism:
    turns = np.repeat(TURNS, 2) + np.tile([-20.0, 20.0], 3) + rng.uniform(-8, 8, 6)
    feet, heads = ring(100, 0, turns), ring(60, rng.uniform(150, 200), turns + np.tile([-25.0, 25.0], 3))
    R, t = Rotation.from_rotvec(rng.uniform(-3, 3, 3)).as_matrix(), rng.uniform(-100, 100, 3)
    base, platform = (np.round(np.array(points) @ R.T + t, 6) for points in (feet, heads))
    more |= {"stroke": (130, 250), "reference_point": np.round(platform.mean(axis=0), 6).tolist()}
    return pf.Mechanism.from_legs("U-P*-S", base=base.tolist(), platform=platform.tolist(), **more)


def hexaglide(rng: Draw) -> pf.Mechanism:
    """Carriages on rails that are upright, or all along one another."""
    joints, height, rail = [], rng.uniform(110.0, 190.0), (Z, X)[rng.integers(2)]
    for leg in range(6):
        angle = 60.0 * leg + rng.uniform(-12, 12)
        foot, head = rng.uniform(90, 110) * out(angle), 60 * out(angle + (20 if leg % 2 else -20)) + [0, 0, height]
        joints += chain(leg, ("P*", None, rail, {"range": (-70, 70)}), ("U", foot, (X, Y)), ("S", head))
    return pf.Mechanism("6-PUS", joints, "platform", (0, 0, height))


def with_digits(machine: pf.Mechanism) -> pf.Mechanism:
    """The machine with the places of its joints rounded to six decimals."""
    joints = [
        each if each.at is None else dataclasses.replace(each, at=np.round(each.at, 6)) for each in machine.joints
    ]
    return dataclasses.replace(machine, joints=joints, reference_point=np.round(machine.reference_point, 6))


def with_rods_apart(machine: pf.Mechanism) -> pf.Mechanism:
    """The machine with thick rods, bodies between two joints that have a place."""
    ends = {body: [each for each in machine.joints if body in each.connects] for body in machine.bodies}
    rods = [body for body, each in ends.items() if len(each) == 2 and all(end.at is not None for end in each)]
    carried = [body for body in rods if not any(each.actuated for each in ends[body])]
    return machine.with_shapes([pf.Shape(body, thickness=THICKNESS) for body in carried]).with_clearance(CLEARANCE)


KINDS: dict[str, Callable[[Draw], pf.Mechanism]] = {
    "6-UPS": struts,
    "6-RUS": DRAWN["6-RSS"],
    "hexaglide": hexaglide,
    "linear delta": DRAWN["delta on rails"],
    "rotary delta": DRAWN["delta of balls"],
}


def drawn(kind: str, number: int, is_thick: bool) -> pf.Mechanism:
    """A machine of a kind; of thick ones the first that is clear of itself at home."""
    rng = np.random.default_rng([list(KINDS).index(kind), number])
    for _ in range(50):
        try:
            if kind == "6-UPS":
                return struts(rng, thickness=THICKNESS, clearance=CLEARANCE) if is_thick else struts(rng)
            machine = with_digits(KINDS[kind](rng))
            return with_rods_apart(machine) if is_thick else machine
        except pf.errors.InvalidMechanism:
            assert is_thick
    raise AssertionError(f"no {kind} is clear of itself")


def targets_of(machine: pf.Mechanism, n: int) -> Array:
    rng = np.random.default_rng(0)
    targets = np.repeat(machine.home_pose[None], n, axis=0)
    targets[:, :3, 3] += rng.uniform(-SIZE, SIZE, (n, 3)) * machine.characteristic_length
    targets[:, :3, :3] = Rotation.from_rotvec(rng.uniform(-TILT, TILT, (n, 3))).as_matrix()
    return targets


def ratios(kind: str, number: int, is_thick: bool, starts: int) -> Array:
    """Of targets that double precision does not reach, how many times as far from them single precision ends."""
    machine = drawn(kind, number, is_thick)
    targets, n_actuators = targets_of(machine, N_TARGETS), len(machine.actuator_names)
    found: dict[Precision, Said] = {}
    for precision in ("double", "float"):
        program = compiled(c_source(machine, precision=precision, parts=PARTS))
        found[precision] = said_by(program, targets, n_actuators, starts=starts)
    away = found["double"].codes != 0
    exact, rounded = (costs(machine, each.poses, targets) / machine.characteristic_length for each in found.values())
    assert (np.where(away, 0.0, rounded) <= FINEST).all()
    return ((rounded + FINEST) / (exact + FINEST))[away]


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize("is_thick", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_drawn_machines_are_projected_in_single_precision_as_in_double(
    kind: str, is_thick: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(source, "N_TRIED", 3)  # for the self-test, which is not of interest here
    check(kind, OFTEN, is_thick)


@needs_compiler
@pytest.mark.campaign
@pytest.mark.parametrize("is_thick", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_so_are_fifty_of_each_kind(kind: str, is_thick: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(source, "N_TRIED", 3)
    check(kind, LONG, is_thick)


def check(kind: str, n: int, is_thick: bool) -> None:
    """With a few seeds, hardly farther; from the start alone, which may lead either one elsewhere, nearly always."""
    several = np.concatenate([ratios(kind, number, is_thick, 4) for number in range(n)])
    assert len(several) > 20 * n
    assert (
        np.median(several) <= 1.01 and (several > 1.05).mean() <= 0.001
    )  # one of 2,400 hexaglides' targets was farther
    alone = np.concatenate([ratios(kind, number, is_thick, 0) for number in range(n)])
    assert np.median(alone) <= 1.01 and (alone > 1.05).mean() <= 0.04


def test_rods_of_a_pair_count_as_equal_where_single_precision_cannot_tell_them_apart() -> None:
    """The file says which; in double they stay as they are, and so do rods that differ by more."""
    machine = with_digits(DRAWN["delta of balls"](np.random.default_rng(3)))
    said = "Rods that count as equal to the other of their pair: rodR1, rodR2, rodR3."
    uneven = DRAWN["delta, measured"](np.random.default_rng(3))
    texts = [c_source(each, precision="float", parts=["ik"]) for each in (machine, uneven, pf.load("delta"))]
    assert [said in text for text in texts] == [True, False, False]
    assert "count as equal" not in texts[1] + texts[2] + c_source(machine, parts=["ik"])
