"""`Live`: whatever streams in, limits are kept, loops closed, drives not too fast; what they reach in time is met."""

from __future__ import annotations

import copy
import math
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from checks import INTERPRETED, actuator_units, assert_feasible
from machines import EVERY, FILES, machine
from pfabrik import Mechanism, Options, Solution, Status
from pfabrik.errors import InvalidArgument, UnknownName
from pfabrik.machine.description.task import task_of
from test_streams import smooth

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

FEW = ("stewart", "delta", "positions.mixed", "closure.four_bar_driven")
NAMES = FEW if INTERPRETED else (*EVERY, *FILES)
SPAN = 2.0
"""Range of a drive that a stream uses, about [L or rad]."""


def live_of(mechanism: Mechanism, ticks: int, **given: object) -> pf.Live:
    """A machine whose drives take so many ticks of a second across the range that they use."""
    speeds = dict(zip(mechanism.actuator_names, SPAN * actuator_units(mechanism) / ticks, strict=True))
    return pf.Live(mechanism, speed=speeds, **given)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", NAMES)
def test_no_tick_opens_a_loop_or_exceeds_a_limit_or_a_speed(name: str) -> None:
    mechanism, ticks = machine(name), 12 if INTERPRETED else 60
    live, before = live_of(mechanism, 20), np.array([])
    most = SPAN * actuator_units(mechanism) / 20
    before = live.actuators.copy()
    for k, target in enumerate(smooth(mechanism, ticks)):
        status = live.tick(target, 1.0)
        assert status in (Status.REACHED, Status.PROJECTED)
        assert (np.abs(live.actuators - before) <= most).all()
        np.testing.assert_allclose(live.speeds, live.actuators - before, rtol=1e-9, atol=1e-12 * most.max())
        before = live.actuators.copy()
        if k % 5 == 0:
            here = pf.configuration(mechanism, live.q)
            assert here.status is Status.REACHED, (k, here)
            assert_feasible(mechanism, here)
            np.testing.assert_allclose(here.actuators, live.actuators, atol=1e-9 * most.max())
            np.testing.assert_allclose(here.pose[:3, 3], live.pose[:3, 3], atol=1e-8 * mechanism.characteristic_length)


@pytest.mark.parametrize("name", NAMES)
def test_out_of_reach_a_machine_comes_to_rest_where_nothing_beside_it_is_nearer(name: str) -> None:
    """Feasible configurations a little away, whichever way, are no nearer but for what is of second order."""
    if INTERPRETED:
        pytest.skip("hundreds of ticks")
    mechanism, rng = machine(name), np.random.default_rng(0)
    live, target, length = live_of(mechanism, 40, hold=None), smooth(mechanism, 40)[5], mechanism.characteristic_length
    for _ in range(400):
        live.tick(target, 1.0)
        if np.abs(live.speeds / actuator_units(mechanism)).max() < 1e-9:
            break
    assert np.abs(live.speeds / actuator_units(mechanism)).max() < 1e-7
    if name in ("snake60", "closure.coaxial_rrr"):
        return  # sixty hinges take as long as all others; a wrist at a singularity of its loops
    here, (shifts, turns) = live.q, 1e-3 * rng.normal(size=(2, 12, 3))
    beside = pf.pose(live.pose[:3, 3] + shifts * length, rotvec=turns)
    beside[:, :3, :3] = beside[:, :3, :3] @ live.pose[:3, :3]
    moved = pf.solve_ik(mechanism, beside, start=here, options=Options(hold=None, working_mode="keep"))
    position, rotation = task_of(mechanism).errors(moved.pose, np.repeat(target[None], len(beside), axis=0))
    lags = np.hypot(position, mechanism.rotation_length * rotation) / length
    assert lags.min() >= live.lag / length - 2e-5


@pytest.mark.parametrize(
    "name", ["stewart", "delta", "rrr", "five_bar", "servo_hexapod", "canfield", "orthoglide", "prs"]
)
def test_a_target_in_reach_is_reached_as_soon_as_the_drives_go_straight_there(name: str) -> None:
    mechanism, rng, ticks, worst = machine(name), np.random.default_rng(0), 20, list[float]()
    length, keep = mechanism.characteristic_length, Options(working_mode="keep")
    for _ in range(4 if INTERPRETED else 30):
        ends: list[Solution] = []
        for _ in range(2):
            shift, turn = rng.normal(0.0, 0.15, (2, 3))
            wild = pf.pose(mechanism.home_pose[:3, 3] + shift * length, rotvec=turn)
            projected = pf.solve_ik(mechanism, wild, options=keep)
            ends.append(pf.solve_ik(mechanism, projected.pose, start=projected, options=keep))
        begin, end = ends
        way = end.actuators - begin.actuators
        values = begin.actuators + np.linspace(0.0, 1.0, 40)[:, None] * way
        led = begin
        is_feasible = begin.status is Status.REACHED and end.status is Status.REACHED
        for value in values:
            led = pf.solve_fk(mechanism, value, start=led) if is_feasible else led
            is_feasible = is_feasible and led.status is Status.REACHED
        if not is_feasible or np.abs(led.pose - end.pose).max() > 1e-6 * length:
            continue
        live = pf.Live(mechanism, speed=np.abs(way).max() / (ticks - 0.5), start=begin)
        took = next((k for k in range(1, 3 * ticks) if live.tick(end.pose.copy(), 1.0) is Status.REACHED), math.inf)
        worst.append(took / ticks)
        assert took >= ticks
    assert len(worst) > 2 and np.mean(worst) <= 1.1
    assert sorted(worst)[-2] <= 1.2


@pytest.mark.parametrize("name", ["stewart", "delta", "panda", "rps"])
def test_drives_brake_for_what_is_no_pose_and_start_again(name: str) -> None:
    mechanism = machine(name)
    live = live_of(mechanism, 200, acceleration=dict.fromkeys(mechanism.actuator_names, 0.0001))
    targets = smooth(mechanism, 60)[:12]
    for target in targets:
        live.tick(target, 1.0)
    moving = np.abs(live.speeds).max()
    assert moving > 0.0
    for _ in range(math.ceil(moving / 1e-4) + 8):
        before = live.speeds.copy()
        assert live.tick(np.full((4, 4), np.nan), 1.0) is Status.INVALID
        assert (np.abs(live.speeds) <= np.abs(before) + 1e-12).all() or live.exceeded > 0.0
    assert np.abs(live.speeds).max() < 1e-9
    at_rest = live.actuators.copy()
    live.tick(np.full((4, 4), np.inf), 1.0)
    np.testing.assert_allclose(live.actuators, at_rest, atol=1e-9)
    assert live.tick(targets[0], 1.0) in (Status.REACHED, Status.PROJECTED)
    assert np.abs(live.speeds).max() > 0.0


@pytest.mark.parametrize("name", ["stewart", "delta", "five_bar", "servo_hexapod", "panda"])
def test_second_differences_of_drives_keep_accelerations_but_for_what_is_told(name: str) -> None:
    mechanism, ticks = machine(name), 12 if INTERPRETED else 400
    units = actuator_units(mechanism)
    most = 0.1 * SPAN / 100
    names = mechanism.actuator_names
    live = live_of(mechanism, 100, acceleration=dict(zip(names, most * units, strict=True)))
    rates, told = [live.speeds.copy()], []
    for target in smooth(mechanism, ticks):
        live.tick(target, 1.0)
        rates.append(live.speeds.copy())
        told.append(live.exceeded)
    excess = np.abs(np.diff(rates, axis=0) / units).max(axis=1) / most - 1.0
    np.testing.assert_allclose(np.maximum(excess, 0.0), told, atol=1e-6)
    assert np.mean(np.array(told) > 1e-6) <= 0.05
    assert np.mean(np.array(told) > 0.5) <= 0.03  # limits bend away faster than drives may brake


@pytest.mark.parametrize("name", ["g1_ankle", "canfield", "ankle_ups", "rps", "stewart", "panda", "files.spare_arm"])
def test_drives_that_take_time_to_brake_rest_where_others_do(name: str) -> None:
    if INTERPRETED:
        pytest.skip("hundreds of ticks")
    mechanism, target = machine(name), smooth(machine(name), 25)[3]
    units = actuator_units(mechanism)
    limits = dict(zip(mechanism.actuator_names, SPAN / 800 * units, strict=True))
    slow, free = live_of(mechanism, 40, acceleration=limits), live_of(mechanism, 40)
    for _ in range(390):
        slow.tick(target, 1.0)
        free.tick(target, 1.0)
    assert np.abs(slow.speeds / units).max() < 1e-6
    assert slow.lag <= free.lag + 1e-6 * mechanism.characteristic_length


def test_a_machine_goes_to_where_its_drives_are_measured_and_starts_where_it_is_told() -> None:
    hexapod = machine("stewart")
    live = live_of(hexapod, 20)
    measured = live.actuators + 2.0
    assert live.to(measured) is Status.REACHED
    np.testing.assert_allclose(live.actuators, measured, atol=1e-9)
    np.testing.assert_allclose(live.pose, pf.solve_fk(hexapod, measured).pose, atol=1e-9)
    assert live.to(measured * 10.0) is not Status.REACHED
    np.testing.assert_allclose(live.actuators, measured, atol=1e-9)
    live.reset()
    np.testing.assert_allclose(live.pose, hexapod.home_pose, atol=1e-9)
    start = pf.solve_ik(hexapod, [5.0, 0.0, hexapod.home_pose[2, 3]])
    live.reset(start)
    np.testing.assert_allclose(live.actuators, start.actuators, atol=1e-9)
    for other in (copy.deepcopy(live), pickle.loads(pickle.dumps(live))):
        np.testing.assert_allclose(other.actuators, live.actuators, atol=1e-9)
        assert other.tick(hexapod.home_pose, 1.0) is live.tick(hexapod.home_pose, 1.0)
        live.reset(start)


@pytest.mark.parametrize("name", ["panda", "closure.arm", "delta"])
def test_with_accelerations_too_a_machine_comes_to_rest_at_a_target_that_rests(name: str) -> None:
    if INTERPRETED:
        pytest.skip("hundreds of ticks")
    mechanism = machine(name)
    most = SPAN / 50 * actuator_units(mechanism)
    accelerations = dict(zip(mechanism.actuator_names, 0.05 * most, strict=True))
    live, target = live_of(mechanism, 50, acceleration=accelerations), smooth(mechanism, 25)[17]
    for _ in range(350):
        live.tick(target, 1.0)
    assert np.abs(live.speeds / most).max() < 1e-4


@pytest.mark.parametrize("acceleration", [None, 0.1])
def test_a_reset_forgets_all_ticks(acceleration: float | None) -> None:
    hexapod = machine("stewart")
    live, targets = live_of(hexapod, 50, acceleration=acceleration), smooth(hexapod, 12 if INTERPRETED else 60)
    once = live.follow(targets, sample_time=1.0).actuators
    live.reset()
    assert live.lag == 0.0 and live.holding == ()
    np.testing.assert_array_equal(live.follow(targets, sample_time=1.0).actuators, once)


@pytest.mark.parametrize("share", [None, 0.03])
def test_a_linkage_stays_on_its_side_of_the_dead_points_of_its_loop(share: float | None) -> None:
    """A four-bar driven at its rocker: crank and coupler in line are a dead point, which speeds alone do not stop."""
    if INTERPRETED:
        pytest.skip("hundreds of ticks")
    told = machine("files.crank_rocker")
    driven = {"crank": False, "rocker": True}
    joints = [replace(joint, actuated=driven.get(joint.name, False)) for joint in told.joints]
    linkage = replace(told, joints=tuple(joints), task=("y",))
    for ticks in (5, 30):
        live = live_of(linkage, ticks, acceleration=None if share is None else share * SPAN / ticks)
        rng, targets, target, went = np.random.default_rng(1), smooth(linkage, 50), linkage.home_pose, 0.0
        for k in range(120):
            target = targets[rng.integers(50)] if k % 25 == 0 else target
            before = live.actuators.copy()
            live.tick(target, 1.0)
            went += np.abs(live.actuators - before).max()
            at = {name: np.asarray(point)[:2] for name, point in live.solution.points.items()}
            crank, coupler = at["crank_pin"] - at["crank"], at["rocker_pin"] - at["crank_pin"]
            assert crank[0] * coupler[1] - crank[1] * coupler[0] < 0.0
        assert went > 0.5


@pytest.mark.parametrize("name", ["stewart", "panda", "closure.H4"])
def test_ticks_of_no_length_say_nothing_of_how_fast_drives_are(name: str) -> None:
    mechanism = machine(name)
    live, targets = live_of(mechanism, 20, acceleration=1e-9), smooth(mechanism, 12)
    for target in targets:
        for dt in (5e-324, 1e-15):
            live.tick(target, dt)
            assert np.abs(live.speeds).max() == 0.0


def test_speeds_are_kept_to_the_last_digit_where_loops_close_no_better_than_their_description() -> None:
    mechanism = machine("closure.H4")
    live, target = live_of(mechanism, 100), smooth(mechanism, 40)[3]
    before = live.actuators.copy()
    live.tick(target, 1.0)
    assert (np.abs(live.actuators - before) <= SPAN / 100 * actuator_units(mechanism)).all()


@pytest.mark.parametrize("name", ["stewart", "servo_hexapod", "rps", "panda"])
def test_ticks_of_half_the_time_move_every_joint_half_as_far(name: str) -> None:
    mechanism, ticks, most = machine(name), 12 if INTERPRETED else 100, []
    for parts in (1, 2):
        live, q = live_of(mechanism, 40), []
        for target in smooth(mechanism, parts * ticks):
            live.tick(target, 1.0 / parts)
            q.append(live.q)
        most.append(np.abs(np.diff(q, axis=0)).max())
    assert most[1] <= 0.7 * most[0] or INTERPRETED


def test_passive_joints_turn_on_where_they_pass_half_a_turn() -> None:
    linkage = machine("files.crank_rocker")
    live, targets = live_of(linkage, 60), smooth(linkage, 12 if INTERPRETED else 120)
    q = [live.q]
    for target in targets:
        live.tick(target, 1.0)
        q.append(live.q)
    assert np.abs(np.diff(q, axis=0)).max() < 1.0


def test_what_holds_a_tick_is_named() -> None:
    hexapod = machine("stewart")
    live, up = live_of(hexapod, 100), hexapod.home_pose.copy()
    up[2, 3] += 3.0 * hexapod.characteristic_length
    live.tick(up, 1.0)
    assert live.holding and all(word.endswith(" speed") for word in live.holding)
    for _ in range(200):
        live.tick(up, 1.0)
    near = {f"{joint} {bound}" for (joint, bound), margin in pf.margins(live.solution).items() if margin < 1e-6}
    assert live.holding and set(live.holding) <= near
    delta = machine("delta")  # whose legs are all in line there
    apex, above = live_of(delta, 100), delta.home_pose.copy()
    above[2, 3] += 0.9 * delta.characteristic_length
    for _ in range(100):
        apex.tick(above, 1.0)
    assert apex.holding and all(word.endswith(" stretched") for word in apex.holding)
    assert live.tick(live.pose.copy(), 1.0) is Status.REACHED
    assert live.holding == () and live.lag < 1e-9 * hexapod.characteristic_length


@pytest.mark.parametrize(
    ("given", "error"),
    [
        ({}, "speed: found .* without one"),
        ({"speed": 0.0}, "speed"),
        ({"speed": {"B9": 1.0}}, "B9"),
        ({"speed": 1.0, "acceleration": -1.0}, "acceleration"),
        ({"speed": 1.0, "hold": "yaw"}, "hold"),
        ({"speed": 1.0, "start": np.zeros(3)}, "start"),
    ],
)
def test_refusals_say_what_is_wrong(given: dict[str, object], error: str) -> None:
    with pytest.raises((InvalidArgument, UnknownName), match=error):
        pf.Live(machine("stewart"), **given)  # type: ignore[arg-type]


def test_ticks_refuse_other_shapes_and_times() -> None:
    live = live_of(machine("stewart"), 20)
    odd: Any = ["a", None, True, [0.1]]
    for dt in (0.0, -1.0, math.nan, math.inf, *odd):
        with pytest.raises(InvalidArgument, match="dt: found"):
            live.tick(live.pose, dt)
    assert live.tick(live.pose, np.float32(0.5)) is Status.REACHED
    with pytest.raises(InvalidArgument, match="target"):
        live.tick(np.zeros((2, 3)), 1.0)
    assert live.tick([0.0, 0.0, live.pose[2, 3]], 1.0) is Status.REACHED
