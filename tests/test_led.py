"""Forward kinematics goes where the motors lead: one call ends where small steps do, next to closed forms."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import SimpleNamespace

import numpy as np
import pytest

import exported
import pfabrik as pf
from checks import INTERPRETED
from machines.small import four_bar, gripper
from pfabrik import Mechanism, Status
from pfabrik.exchange.export.export_c import c_source
from pfabrik.kernels.controller.reached import OTHER_MODE

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
Z, Y = (0, 0, 1), (0, 1, 0)


def hinge(name: str, inner: str, outer: str, at: np.ndarray, **more: object) -> pf.Joint:
    return pf.Joint(name, "revolute", (inner, outer), at=(*at, 0), axis=Z, **more)


def rocker_angles(A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray, cranks: np.ndarray) -> np.ndarray:
    """Where two circles meet, on the side that they meet on at home; NaN beyond or near the dead point."""
    rod, rocker = np.linalg.norm(C - B), np.linalg.norm(C - D)
    cross = (D - B)[0] * (C - B)[1] - (D - B)[1] * (C - B)[0]
    turn = np.stack([[np.cos(cranks), -np.sin(cranks)], [np.sin(cranks), np.cos(cranks)]])
    tip = A[:, None] + np.einsum("ijn,j->in", turn, B - A)
    line = D[:, None] - tip
    length = np.linalg.norm(line, axis=0)
    along = (rod**2 - rocker**2 + length**2) / (2 * length)
    height = rod**2 - along**2
    height[height < (0.05 * rod) ** 2] = np.nan
    across = np.sign(cross) * np.sqrt(height) * np.stack([-line[1], line[0]])
    met = tip + (along * line + across) / length - D[:, None]
    return wrapped(np.arctan2(met[1], met[0]) - np.arctan2(*(C - D)[::-1]))


def wrapped(angle: np.ndarray) -> np.ndarray:
    return (angle + np.pi) % (2 * np.pi) - np.pi


def random_four_bars(seed: int, n: int) -> Iterator[tuple[np.ndarray, ...]]:
    rng = np.random.default_rng(seed)
    for _ in range(n):
        D = np.array([rng.uniform(20, 150), 0.0])
        yield np.zeros(2), rng.uniform(-100, 100, 2), D + rng.uniform(-100, 100, 2), D


@pytest.mark.parametrize("seed", [5, *(pytest.param(seed, marks=pytest.mark.campaign) for seed in range(20, 40))])
def test_a_rocker_is_where_its_crank_leads(seed: int) -> None:
    """From home in one call, of four-bars at random, next to two circles that meet."""
    n_rows, rng = 0, np.random.default_rng(seed)
    for points in random_four_bars(seed, 5 if INTERPRETED else 80):
        cranks = rng.uniform(-1.2, 1.2, 12)
        ways = np.array([rocker_angles(*points, np.linspace(0, crank, 60)) for crank in cranks])
        cranks, ways = cranks[np.isfinite(ways).all(axis=1)], ways[np.isfinite(ways).all(axis=1)]
        if not len(cranks):
            continue
        found = pf.solve_fk(four_bar(*points), cranks[:, None])
        np.testing.assert_array_equal(found.status, Status.REACHED)
        np.testing.assert_allclose(wrapped(found.joints["D"] - ways[:, -1]), 0.0, atol=1e-6)
        n_rows += len(cranks)
    assert n_rows >= (5 if INTERPRETED else 200)


@pytest.mark.parametrize(("crank", "ground"), [(90, 40), (40, 90), (60, 60.5), (200, 30)])
def test_the_rocker_of_a_parallelogram_turns_as_its_crank(crank: float, ground: float) -> None:
    """From home and from each other, on both sides of home, whole turns too."""
    at = [np.array(point, float) for point in ((0, 0), (0, crank), (ground, crank), (ground, 0))]
    mechanism, rng = four_bar(*at), np.random.default_rng(0)
    first, then = np.radians(rng.uniform(-85, 85, (2, 4 if INTERPRETED else 100)))
    found = pf.solve_fk(mechanism, first[:, None])
    again = pf.solve_fk(mechanism, then[:, None], start=found)
    turned = pf.solve_fk(mechanism, first[:, None] + 2 * np.pi * rng.integers(-2, 3, first.shape)[:, None])
    for answers, wanted in ((found, first), (again, then), (turned, first)):
        np.testing.assert_array_equal(answers.status, Status.REACHED)
        np.testing.assert_allclose(wrapped(answers.joints["D"] - wanted), 0.0, atol=1e-6)


def knees_in() -> Mechanism:
    """A planar 3-RRR whose knees point inward."""
    joints = []
    for i in range(3):
        c, s = np.cos(2 * np.pi * i / 3), np.sin(2 * np.pi * i / 3)
        A, B, C = (np.array([[c, -s], [s, c]]) @ point for point in ((160, 0), (60, 25), (105, -60)))
        joints.append(hinge(f"A{i}", "base", f"a{i}", A, actuated=True, range=tuple(np.radians((-75, 75)))))
        joints.append(hinge(f"B{i}", f"a{i}", f"b{i}", B, range=tuple(np.radians((-100, 100)))))
        joints.append(hinge(f"C{i}", f"b{i}", "platform", C))
    return Mechanism("3-RRR, knees in", joints, "platform", (0, 0, 0))


def test_one_call_is_many_small_steps() -> None:
    """Of a machine whose other assembly is near: where 60 steps lead, one call ends."""
    mechanism = knees_in()
    values = np.random.default_rng(0).uniform(-1.2, 1.2, (3 if INTERPRETED else 150, 3))
    led, is_led = pf.solve_fk(mechanism, 0.0 * values), np.ones(len(values), bool)
    for share in np.linspace(0, 1, 61)[1:]:
        led = pf.solve_fk(mechanism, share * values, start=led)
        is_led &= led.status == Status.REACHED
    found = pf.solve_fk(mechanism, values)
    reached = (found.status == Status.REACHED) & is_led
    assert reached.sum() >= 0.98 * is_led.sum() > 0
    np.testing.assert_allclose(found.pose[reached], led.pose[reached], atol=1e-6)
    assert not ((found.status == Status.REACHED) & ~is_led).any()


def palletizer() -> Mechanism:
    """Four axes and three parallelograms, one behind the other, which keep the hand level."""
    joints: list[pf.Joint] = []

    def joint(name: str, inner: str, outer: str, x: float, z: float, axis: tuple = Y, **more: object) -> None:
        joints.append(pf.Joint(name, "revolute", (inner, outer), at=(x, 0, z), axis=axis, **more))

    def limits(*angles: float) -> tuple[float, ...]:
        return tuple(np.radians(angles))

    joint("J1", "base", "waist", 0, 200, Z, actuated=True, range=limits(-170, 170))
    joint("J2", "waist", "low", 120, 400, actuated=True, range=limits(-55, 70))
    joint("J3", "waist", "crank", 120, 400, actuated=True, range=limits(-50, 55))
    joint("K1", "crank", "rod", -60, 400)
    joint("K2", "rod", "fore", -60, 1000)
    joint("E", "low", "fore", 120, 1000, range=limits(-70, 70))
    joint("L1", "waist", "rod1", 60, 470)
    joint("L2", "rod1", "tri", 60, 1070)
    joint("T", "low", "tri", 120, 1000)
    joint("L3", "tri", "rod2", 170, 1080)
    joint("L4", "rod2", "hand", 810, 1080)
    joint("H", "fore", "hand", 760, 1000)
    joint("J4", "hand", "flange", 760, 950, Z, actuated=True, range=limits(-200, 200))
    return Mechanism("palletizer", joints, "flange", (760, 0, 930))


def flange(q: np.ndarray) -> np.ndarray:
    """The pose of the flange: both arms turn about level axes, the hand stays level."""
    waist, low, fore, hand = q
    elbow = np.array([120 + 600 * np.sin(low), 0, 400 + 600 * np.cos(low)])
    tip = elbow + 640 * np.array([np.cos(fore), 0, -np.sin(fore)]) + [0, 0, -70]
    c, s = np.cos(waist), np.sin(waist)
    return pf.pose(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ tip, rotvec=[0, 0, waist + hand])


@pytest.mark.skipif(INTERPRETED, reason="a minute and more")
def test_the_hand_of_a_palletizer_stays_level() -> None:
    """From home over all ranges before its parallelograms fold, and from these by 20 degrees a motor."""
    mechanism, rng = palletizer(), np.random.default_rng(0)
    lo, hi = np.radians([[-90, -40.5, -50, -90], [90, 70, 55, 90]])

    def within(values: np.ndarray) -> np.ndarray:
        return values[np.abs(values[:, 2] - values[:, 1]) < np.radians(69.9)]

    values = within(rng.uniform(lo, hi, (300, 4)))
    found = pf.solve_fk(mechanism, values)
    then = np.clip(values + rng.uniform(-0.35, 0.35, values.shape), lo, hi)
    kept = np.abs(then[:, 2] - then[:, 1]) < np.radians(69.9)
    for answers, asked in ((found, values), (pf.solve_fk(mechanism, then[kept], start=found[kept]), then[kept])):
        np.testing.assert_array_equal(answers.status, Status.REACHED)
        np.testing.assert_allclose(answers.pose, [flange(q) for q in asked], atol=1e-6)


@exported.needs_compiler
@pytest.mark.parametrize("make", [knees_in, lambda: four_bar(*map(np.array, ((0, 0), (0, 90), (40, 90), (40, 0))))])
def test_exported_forward_kinematics_goes_there_too(make: Callable[[], Mechanism]) -> None:
    """The library's pose where the code is 0, from home in one call; its own code where legs are in another mode."""
    mechanism = make()
    n = len(mechanism.actuator_names)
    values = np.random.default_rng(1).uniform(-1.2, 1.2, (40, n))
    found = pf.solve_fk(mechanism, values)
    program = exported.compiled(c_source(mechanism))
    known = SimpleNamespace(targets=found.pose, whole=found.pose, actuators=values)
    answers = exported.answers_of(program, mechanism, known)
    reached = found.status == Status.REACHED
    assert reached.any()
    there = exported.flat(found.pose) / np.repeat([mechanism.characteristic_length, 1.0], [3, 9])
    told = answers.fk == 0
    assert np.isin(answers.fk[reached], (0, OTHER_MODE)).all() and (told & reached).sum() >= 5
    np.testing.assert_allclose(answers.back[told & reached], there[told & reached], atol=1e-6)


def test_dead_points_of_several_loops_at_once_are_dead_points() -> None:
    """A second finger, which mirrors the first, takes nothing away and adds nothing, out and home again."""
    xs = np.concatenate([np.arange(-30, 66), np.arange(65, -31, -1)])
    targets = np.stack([xs, np.full(len(xs), 92.0), np.zeros(len(xs))], axis=1)
    one, two = (pf.track(machine, targets, start=pf.solve_fk(machine, [0.0])) for machine in map(gripper, (1, 2)))
    np.testing.assert_array_equal(one.status, two.status)
    assert (one.status == Status.REACHED).any() and (one.status == Status.PROJECTED).any()
    np.testing.assert_allclose(one.actuators, two.actuators, atol=1e-5)
    assert two.status[-1] == Status.REACHED
    reached = two.status == Status.REACHED  # at the dead point both are as near as a root of rounding
    np.testing.assert_allclose(two.joints["drv0R"][reached], -two.joints["drv0L"][reached], atol=1e-6)
