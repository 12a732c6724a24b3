"""Machines whose points are rounded: how near an answer comes is continuous in their dimensions.

What an exact machine answers is feasible for the rounded one, but for what is rounded, wherever its forward kinematics
reaches it with the same actuators: its own answer is as near. Rods that are equal but for their last digits are no
other kind of rods.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import pfabrik as pf
from checks import INTERPRETED
from machines import EVERY, FILES, machine
from machines.drawn import DRAWN
from oracles import targets_about
from pfabrik import Mechanism, Solution, Status

pytestmark = [
    pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning"),
    pytest.mark.skipif(INTERPRETED, reason="many searches"),
]

FARTHER = 1e-3
"""By how much an answer may be farther than that of the exact machine [L]."""
STEPS = tuple(10.0**-digits for digits in range(5, 13))
"""Multiples to which points are rounded [L]."""


def rounded(m: Mechanism, step: float) -> Mechanism:
    """The machine with all points at multiples of a length [L]."""

    def at(point: np.ndarray) -> np.ndarray:
        return np.round(np.array(point) / unit) * unit

    unit = step * m.characteristic_length
    joints = [each if each.at is None else dataclasses.replace(each, at=at(each.at)) for each in m.joints]
    tip = {"reference_point": at(m.reference_point)} if m.end_effector_is_joint else {}
    return dataclasses.replace(m, joints=joints, **tip)


def distances(m: Mechanism, answer: Solution) -> np.ndarray:
    """Distances from the targets, as projections count them [L]."""
    turned = 0.0 if m.end_effector_is_joint else m.rotation_length * answer.rotation_error
    return np.asarray(np.hypot(answer.position_error, turned) / m.characteristic_length)


def assert_as_near(m: Mechanism, targets: np.ndarray, steps: tuple[float, ...]) -> None:
    """On machines of rounded points answers are as near, closed and within limits; exact ones are reached."""
    exact = pf.solve_ik(m, targets)
    away = exact.status == Status.PROJECTED
    for step in steps:
        other = rounded(m, step)
        there = pf.solve_fk(other, exact.actuators)
        apart = np.abs(there.pose - exact.pose)
        apart[:, :3, 3] /= m.characteristic_length
        is_feasible = (there.status == Status.REACHED) & (apart.max(axis=(1, 2)) <= FARTHER)
        answer, own = pf.solve_ik(other, targets), pf.solve_ik(other, exact.pose)
        farther = distances(other, answer) - distances(m, exact)
        assert farther[is_feasible].max(initial=0.0) <= FARTHER, (step, np.flatnonzero(farther > FARTHER))
        assert distances(other, own)[is_feasible].max(initial=0.0) <= FARTHER, step
        assert (answer.status[~away & is_feasible] == Status.REACHED).all() or step > 1e-9, step
        found = answer[np.flatnonzero(answer.status <= Status.PROJECTED)]
        assert found.residual.max(initial=0.0) <= 1e-9 * m.characteristic_length
        assert found.limit_excess.max(initial=0.0) <= 2e-9


def drawn(kind: str, seed: int) -> Mechanism:
    return DRAWN[kind](np.random.default_rng([seed, list(DRAWN).index(kind)]))


@pytest.mark.parametrize(
    ("kind", "step"), [("delta of balls", 1e-9), ("delta on rails", 1e-10), ("delta, rods apart", 1e-10)]
)
def test_rods_equal_but_for_their_last_digits_come_as_near_as_equal_ones(kind: str, step: float) -> None:
    m = drawn(kind, 0)
    assert_as_near(m, targets_about(m, np.random.default_rng(0), 4, 1.2, 0.0), (step,))


@pytest.mark.campaign
@pytest.mark.parametrize("name", [*EVERY, *FILES])
def test_answers_of_every_machine_with_rounded_points_are_as_near(name: str) -> None:
    m = machine(name)
    assert_as_near(m, targets_about(m, np.random.default_rng(3), 12, 1.2, 0.6), STEPS)


@pytest.mark.campaign
@pytest.mark.parametrize("seed", range(50))
@pytest.mark.parametrize("kind", DRAWN)
def test_answers_of_drawn_machines_with_rounded_points_are_as_near(kind: str, seed: int) -> None:
    m, steps = drawn(kind, seed), (STEPS[seed % len(STEPS)], STEPS[(seed + 3) % len(STEPS)])
    assert_as_near(m, targets_about(m, np.random.default_rng(seed), 6, 1.2, 0.5), steps)
