"""Tracking: continuous, in one working mode, the same as answering step by step."""

from __future__ import annotations

import json
import pickle
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import checks
import pfabrik as pf
from checks import INTERPRETED
from machines import MACHINES
from pfabrik import Joint, Mechanism, Options, Status
from pfabrik.errors import InvalidArgument

STEPS = 60 if INTERPRETED else 360
CIRCLES = {"five_bar": (200.0, 60.0), "stewart": (220.0, 60.0), "nrpm": (200.0, 100.0)}
"""Height and radius of the circle in the plane x = 0 that each catalogue file names as its test path."""


def circle(height: float, radius: float, steps: int = STEPS, turns: float = 1.0) -> np.ndarray:
    angle = np.linspace(0, 2 * np.pi * turns, steps, endpoint=False)
    return np.stack([0 * angle, radius * np.cos(angle), height + radius * np.sin(angle)], axis=1)


def largest_jump(values: np.ndarray) -> np.ndarray:
    """Largest step of each column over the larger of its neighbours and a hundredth of its range."""
    steps = np.abs(np.diff(values, axis=0))
    near = np.maximum(steps[:-2], steps[2:])
    return (steps[1:-1] / np.maximum(near, 1e-2 * np.ptp(values, axis=0) + 1e-12)).max(axis=0)


@pytest.mark.parametrize("name", ["five_bar", "stewart"])
def test_actuators_move_continuously_along_a_circle_within_reach(name: str) -> None:
    machine = pf.load(name)
    height, radius = CIRCLES[name]
    followed = pf.track(machine, circle(height, 0.6 * radius))
    assert followed
    assert (largest_jump(followed.actuators) <= 3).all()


def test_redundant_actuators_move_continuously_along_a_circle_within_reach() -> None:
    """The machine is free to move its arms along the way: they may, but not in jumps."""
    machine = pf.load("nrpm")
    followed = pf.track(machine, circle(200.0, 60.0))
    assert followed
    pace = 60.0 * 2 * np.pi / STEPS
    steps = np.abs(np.diff(followed.actuators, axis=0))
    turns = np.array([machine.joint(actuator).type == "revolute" for actuator in machine.actuator_names])
    assert steps[:, ~turns].max() <= 3 * pace
    assert steps[:, turns].max() <= 3 * pace / 90.0


@pytest.mark.parametrize("name", CIRCLES)
def test_a_path_partly_out_of_reach_is_followed_as_far_as_it_goes(name: str) -> None:
    machine = pf.load(name)
    followed = pf.track(machine, circle(*CIRCLES[name]))
    assert set(followed.status) == {Status.REACHED, Status.PROJECTED}
    length = machine.characteristic_length
    assert followed.residual.max() <= 1e-9 * length
    assert followed.limit_excess.max() <= 1e-9
    assert checks.gap_of_points(machine, followed).max() <= 1e-9
    assert checks.excess_of_points(machine, followed).max() <= 1e-9


@pytest.mark.parametrize("name", [*CIRCLES, "hexapod_rus", "tripod_prs", "mixed"])
@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
def test_tracking_is_answering_step_by_step_from_the_answer_before(name: str) -> None:
    machine = MACHINES[name]() if name in MACHINES else pf.load(name)
    length = machine.characteristic_length
    height, radius = CIRCLES.get(name, (machine.reference_point[2], 0.25 * length))
    path = circle(height, radius, steps=12 if INTERPRETED else 40)
    followed = pf.track(machine, path)
    seed = None
    for i, target in enumerate(path):
        seed = pf.solve_ik(machine, target, start=seed, options=Options(working_mode="keep"))
        assert followed.status[i] == seed.status
        np.testing.assert_allclose(followed.pose[i], seed.pose, rtol=0, atol=1e-8 * length)
        np.testing.assert_allclose(followed.actuators[i], seed.actuators, rtol=0, atol=1e-8 * length)


def elbow_sides(machine: Mechanism, answer: pf.Solution) -> np.ndarray:
    """On which side of the line from its base joint to the tip each elbow is, in the plane x = 0."""
    sides = []
    for base, elbow in (("p1", "p2"), ("p5", "p4")):
        line, arm = answer.points["p3"] - answer.points[base], answer.points[elbow] - answer.points[base]
        sides.append(np.sign(np.cross(line, arm)[..., 0]))
    return np.array(sides)


def two_modes() -> tuple[Mechanism, np.ndarray]:
    """A 5-bar whose left elbow may bend either way, and a path to where only the bend that is not home's is allowed."""
    machine = pf.load("five_bar").without_limits().with_limits(p2=np.radians((-100.0, 140.0)))
    home = np.array(machine.reference_point)
    return machine, home + np.linspace(0, 1, 20)[:, None] * np.array((0.0, -5.0, -75.0))


def test_the_working_mode_stays_where_another_would_reach() -> None:
    machine, path = two_modes()
    assert pf.solve_ik(machine, path[-1])
    followed = pf.track(machine, path)
    assert followed.status[0] == Status.REACHED
    assert followed.status[-1] == Status.PROJECTED
    sides = elbow_sides(machine, followed)
    np.testing.assert_array_equal(sides, np.tile(sides[:, :1], len(path)))


def test_the_seed_decides_the_working_mode() -> None:
    """Started with the left elbow flipped, the way back to home ends with it flipped."""
    machine, path = two_modes()
    flipped = pf.solve_ik(machine, path[-1])
    followed = pf.track(machine, path[::-1], start=flipped)
    assert followed
    home = elbow_sides(machine, pf.solve_ik(machine, path[:1]))
    np.testing.assert_array_equal(elbow_sides(machine, followed), np.tile(home * [[-1], [1]], len(path)))


def test_a_path_starts_from_its_seed() -> None:
    machine = pf.load("nrpm")
    seed = pf.solve_ik(machine, np.add(machine.reference_point, (20.0, 30.0, -20.0)))
    from_seed = pf.track(machine, seed.pose[None], start=seed)
    np.testing.assert_allclose(from_seed.actuators[0], seed.actuators, rtol=0, atol=1e-9)


@pytest.mark.parametrize("steps", [0, 1, 16, 17, 50])
def test_progress_is_reported_up_to_the_end_and_changes_nothing(steps: int) -> None:
    machine = pf.load("stewart")
    path = circle(*CIRCLES["stewart"])[:steps]
    calls: list[tuple[int, int]] = []
    watched = pf.track(machine, path, on_progress=lambda done, total: calls.append((done, total)))
    np.testing.assert_array_equal(watched.actuators, pf.track(machine, path).actuators)
    assert [total for _, total in calls] == [steps] * len(calls)
    done = [count for count, _ in calls]
    assert done == sorted(set(done))
    assert (done[-1] if done else 0) == steps


def test_rows_that_are_no_poses_are_marked_and_passed_over() -> None:
    machine = pf.load("stewart")
    path = np.tile(machine.home_pose, (40, 1, 1))
    path[:, :3, 3] = circle(200.0, 20.0, steps=40)
    clean = pf.track(machine, path)
    bad = [0, 16, 17, 31]
    path[bad, 0, 0] = np.nan
    for report in (None, lambda done, total: None):
        marked = pf.track(machine, path, options=Options(on_invalid="mark"), on_progress=report)
        assert np.flatnonzero(marked.status == Status.INVALID).tolist() == bad
        good = np.setdiff1d(np.arange(40), bad)
        np.testing.assert_allclose(marked.actuators[good], clean.actuators[good], rtol=0, atol=1e-9)
        assert np.isnan(marked.actuators[bad]).all()
    with pytest.raises(InvalidArgument, match="first bad rows: 0, 16, 17, 31"):
        pf.track(machine, path)


def arm(limit: tuple[float, float] | None) -> Mechanism:
    """Two links of 3 and 2 in the plane z = 0, driven at both joints."""
    joints = [
        Joint("j1", "revolute", ("base", "upper"), at=(0, 0, 0), axis=(0, 0, 1), actuated=True, range=limit),
        Joint("j2", "revolute", ("upper", "lower"), at=(3, 0, 0), axis=(0, 0, -1), actuated=True, range=(-2.5, 2.5)),
        Joint("tip", "revolute", ("lower", "tool"), at=(3, 2, 0), axis=(0, 0, 1)),
    ]
    return Mechanism("two-link arm", joints, "tip")


@pytest.mark.parametrize("turns", [3.0, -2.5])
@pytest.mark.parametrize("invalid", [False, True])
def test_an_unlimited_crank_counts_on_through_full_turns(turns: float, invalid: bool) -> None:
    """The tip goes round the base at home's distance: the shoulder turns as far, and the elbow stays."""
    steps = 200
    angle = np.linspace(0.0, 2 * np.pi * turns, steps)
    c, s = np.cos(angle), np.sin(angle)
    path = np.stack([3 * c - 2 * s, 3 * s + 2 * c, 0 * c], axis=1)
    if invalid:
        path[::7] = np.nan
    followed = pf.track(arm(None), path, options=Options(on_invalid="mark"))
    known = followed.status == Status.REACHED
    assert known.sum() == (np.isfinite(path[:, 0])).sum()
    shoulder = followed.actuators[known, 0]
    np.testing.assert_allclose(shoulder - shoulder[0], (angle - angle[known][0])[known], rtol=0, atol=1e-8)
    np.testing.assert_allclose(followed.actuators[known, 1], 0, atol=1e-8)


def test_a_limited_crank_stays_within_its_range() -> None:
    angle = np.linspace(0.0, 4.0, 100)
    c, s = np.cos(angle), np.sin(angle)
    path = np.stack([3 * c - 2 * s, 3 * s + 2 * c, 0 * c], axis=1)
    followed = pf.track(arm((-2.0, 2.0)), path)
    np.testing.assert_array_equal(followed.status == Status.REACHED, angle <= 2.0)
    assert np.abs(followed.actuators[:, 0]).max() <= 2.0 + 1e-9


def test_a_path_may_be_empty() -> None:
    machine = pf.load("stewart")
    empty = pf.track(machine, np.empty((0, 3)))
    assert len(empty) == 0
    assert empty.actuators.shape == (0, 6)


NEAREST = 1e-6
"""Share of the distance by which projections may be farther than the nearest, as in the tests of projections. Where
many places are nearly as near, that leaves some of them."""


# --- leaps -----------------------------------------------------------------------------------------------------------


def past_the_hole(offset: float, targets: int = 21) -> np.ndarray:
    """A line of targets in the hole of the two-link arm, of radius 3 - 2, that passes its centre at a distance."""
    x = np.linspace(-0.5, 0.5, targets)
    return np.stack([x, 0 * x + offset, 0 * x], axis=1)


def test_an_answer_leaps_where_its_target_passes_the_centre_of_a_hole() -> None:
    """There every point of the rim is as near; on the line before and behind it, only one is the nearest."""
    machine, path = arm(None), past_the_hole(0.0)
    followed = pf.track(machine, path, start=pf.solve_ik(machine, (-2.0, 0.0, 0.0)))
    assert (followed.status == Status.PROJECTED).all()
    np.testing.assert_allclose(followed.position_error, 1.0 - np.abs(path[:, 0]), rtol=NEAREST)
    np.testing.assert_allclose(followed.pose[:10, 0, 3], -1.0, atol=1e-4)
    np.testing.assert_allclose(followed.pose[11:, 0, 3], 1.0, atol=1e-4)
    assert set(np.flatnonzero(followed.jumps)) <= {10, 11}
    assert followed.jumps.any()


def test_an_answer_that_swings_round_beside_the_centre_does_not_leap() -> None:
    """At a fifth of a step from the centre the arm makes most of half a turn in two steps, and yet it moves."""
    machine, path = arm(None), past_the_hole(0.01)
    followed = pf.track(machine, path, start=pf.solve_ik(machine, (-2.0, 0.0, 0.0)))
    np.testing.assert_allclose(followed.position_error, 1.0 - np.linalg.norm(path, axis=1), rtol=NEAREST)
    assert not followed.jumps.any()


def waiting_at(shoulder: float, path: np.ndarray) -> np.ndarray:
    """Where the tip of the two-link arm is nearest to targets (n, 3) with its shoulder at an angle, (n, 3)."""
    elbow = 3.0 * np.array([np.cos(shoulder), np.sin(shoulder), 0.0])
    return elbow + 2.0 * (path - elbow) / np.linalg.norm(path - elbow, axis=1)[:, None]


def test_an_answer_at_a_limit_leaps_once_when_the_other_side_has_become_nearer() -> None:
    """A target circles where the shoulder cannot go. The tip waits at the shoulder's limit, on the forearm's circle
    there, and then on that at its other limit: not before that is nearer, nor after the target is half a turn ahead.
    """
    machine, home = arm((-2.0, 2.0)), np.arctan2(2.0, 3.0)
    angle = np.linspace(home + 1.5, home + 2 * np.pi - 1.5, 60)
    path = 3.0 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    followed = pf.track(machine, path, start=pf.solve_ik(machine, path[0]))
    away = np.flatnonzero(followed.status == Status.PROJECTED)
    (leap,) = np.flatnonzero(followed.jumps)
    here, there = waiting_at(2.0, path), waiting_at(-2.0, path)
    to_here, to_there = (np.linalg.norm(path - tips, axis=1) for tips in (here, there))
    for rows, distances, limit in ((away[away < leap], to_here, 2.0), (away[away >= leap], to_there, -2.0)):
        np.testing.assert_allclose(followed.position_error[rows], distances[rows], rtol=NEAREST)
        np.testing.assert_allclose(followed.actuators[rows, 0], limit, atol=1e-6)
    assert to_there[leap] < to_here[leap]
    assert np.cross(here, path)[leap - 1, 2] > 0.0


@pytest.mark.parametrize("name", ["five_bar", "stewart"])
def test_a_smooth_path_out_of_reach_and_back_has_no_leaps(name: str) -> None:
    followed = pf.track(pf.load(name), circle(*CIRCLES[name]))
    assert (followed.status == Status.PROJECTED).any()
    assert not followed.jumps.any()


def rail_and_crank() -> tuple[Mechanism, np.ndarray]:
    """A 5-bar with a crank and a rail, and a way on which the rail's end stop and the stretched crank hold it."""
    arms = [
        Joint("A0", "revolute", ("base", "crank"), (-25.4, 0, 0), axis=(0, 0, 1), actuated=True, range=(-0.96, 0.62)),
        Joint("B0", "revolute", ("crank", "rod"), (-79.5, 66.6, 0), axis=(0, 0, 1)),
        Joint("A1", "prismatic", ("base", "slider"), axis=(0, 1, 0), actuated=True, range=(-30, 30)),
        Joint("B1", "revolute", ("slider", "bar"), (69.2, 70.1, 0), axis=(0, 0, 1), range=(-0.94, 0.47)),
        Joint("T", "revolute", ("rod", "bar"), (-0.2, 139.4, 0), axis=(0, 0, 1)),
    ]
    return Mechanism("5-bar", arms, "T", task=("x", "y")), np.array((0.42, 0.91, 0.0))


def three_rrc() -> tuple[Mechanism, np.ndarray]:
    """A translating machine whose legs each bend in a plane of their own, and a way on which two are stretched out."""
    places = [
        ((37.7, -85.4, 57.0), (12.7, -18.8, 50.6), (-12.3, 0.6, -3.0)),
        ((62.9, 51.8, -115.7), (67.6, 26.8, -22.3), (2.9, 1.8, 1.6)),
        ((-80.9, 51.3, 45.3), (-8.2, 53.1, 20.3), (0.9, -8.7, -4.7)),
    ]
    joints = []
    for leg, (a, b, c) in enumerate(places):
        along = {"axis": np.eye(3)[leg]}
        joints += [
            Joint(f"A{leg}", "revolute", ("base", f"{leg}.1"), a, actuated=True, **along),
            Joint(f"B{leg}", "revolute", (f"{leg}.1", f"{leg}.2"), b, **along),
            Joint(f"C{leg}", "cylindrical", (f"{leg}.2", "table"), c, range=((-1.5, 1.5), (-60, 60)), **along),
        ]
    return Mechanism("3-RRC", joints, "table", (0, 0, 0), task=("x", "y", "z")), np.array((0.56, -0.51, 0.65))


@pytest.mark.parametrize("machine_and_way", [rail_and_crank, three_rrc])
def test_links_that_were_stretched_out_beyond_reach_bend_back_the_way_they_did(machine_and_way: Any) -> None:
    machine, way = machine_and_way()
    share = np.linspace(0, 1.2, 13 if INTERPRETED else 101)
    share = np.concatenate([share, share[-2::-1]])
    home = machine.home_pose[:3, 3]
    followed = pf.track(machine, home + share[:, None] * machine.characteristic_length * way)
    assert pf.singularity(followed).serial.min() < 1e-3  # links are stretched out on the way
    assert followed.status[-1] == Status.REACHED
    assert not followed.jumps.any()
    np.testing.assert_allclose(followed.actuators[-1], followed.actuators[0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(followed.pose, followed.pose[::-1], rtol=0, atol=1e-5 * machine.characteristic_length)
    assert checks.excess_of_points(machine, followed).max() <= 1e-9


def out_and_back(steps: int) -> np.ndarray:
    """Shares of a way, out and back the same way."""
    share = np.linspace(0, 1, steps)
    return np.concatenate([share, share[-2::-1]])[:, None]


@pytest.mark.skipif(INTERPRETED, reason="long")
def test_cranks_that_were_stretched_out_beyond_reach_bend_back_the_way_they_did() -> None:
    machine = pf.load("servo_hexapod").without_limits()
    draw = np.random.default_rng(2)
    way, turn = draw.normal(size=3), 0.6 * draw.normal(size=3)
    share = out_and_back(21)
    targets = np.tile(machine.home_pose, (len(share), 1, 1))
    targets[:, :3, 3] += 1.2 * machine.characteristic_length * share * way / np.linalg.norm(way)
    targets[:, :3, :3] = Rotation.from_rotvec(share * turn).as_matrix()
    followed = pf.track(machine, targets)
    assert pf.singularity(followed).serial.min() < 1e-3  # cranks are stretched out on the way
    np.testing.assert_allclose(followed.position_error, followed.position_error[::-1], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(followed.actuators[-1], followed.actuators[0], rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ["delta", "orthoglide"])
def test_a_platform_that_cannot_turn_does_not_turn_beyond_reach(name: str) -> None:
    machine = pf.load(name).without_limits()
    draw = np.random.default_rng(11)
    for way in draw.normal(size=(1 if INTERPRETED else 10, 3)):
        way *= 1.8 * machine.characteristic_length / np.linalg.norm(way)
        followed = pf.track(machine, machine.home_pose[:3, 3] + out_and_back(13) * way)
        turned = Rotation.from_matrix(followed.pose[:, :3, :3]).magnitude()
        assert turned.max() <= 1e-5
        assert (followed.status[[0, -1]] == Status.REACHED).all()


@pytest.mark.parametrize("on_invalid", ["raise", "mark"])
def test_a_row_that_is_no_pose_where_links_are_stretched_out_is_passed_over(on_invalid: str) -> None:
    machine = pf.load("five_bar").without_limits()
    path = np.linspace((0, 0, 220), (0, 0, 400), 12)
    whole = pf.track(machine, path)
    path[8] = np.nan
    if on_invalid == "raise":
        with pytest.raises(InvalidArgument, match="first bad row: 8"):
            pf.track(machine, path)
        return
    followed = pf.track(machine, path, options=Options(on_invalid="mark"))
    assert pf.singularity(whole).serial[7] < 1e-3
    assert followed.status[8] == Status.INVALID
    others = np.arange(12) != 8
    np.testing.assert_allclose(
        followed.pose[others], whole.pose[others], rtol=0, atol=1e-6 * machine.characteristic_length
    )


@pytest.mark.parametrize("steps", [0, 1])
def test_a_path_without_steps_has_no_leaps(steps: int) -> None:
    followed = pf.track(arm(None), past_the_hole(0.0)[:steps], sample_time=0.1)
    assert followed.jumps.shape == (steps,) and not followed.jumps.any()
    assert followed.speeds is not None and followed.speeds.shape == (steps, 2)
    assert followed.too_fast == [()] * steps


# --- speeds ----------------------------------------------------------------------------------------------------------

PACE = 0.25
"""How far the shoulder of the arm below turns in a step [rad]."""


def turning(steps: int = 9) -> np.ndarray:
    """A path on which the shoulder of the two-link arm turns evenly, and its elbow rests."""
    angle = PACE * np.arange(steps)
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([3 * c - 2 * s, 3 * s + 2 * c, 0 * c], axis=1)


def test_speeds_are_steps_by_the_time_they_take() -> None:
    followed = pf.track(arm(None), turning(), sample_time=0.5)
    expected = np.tile([PACE / 0.5, 0.0], (9, 1))
    expected[0] = 0.0
    np.testing.assert_allclose(followed.speeds, expected, rtol=0, atol=1e-7)
    assert followed.too_fast == [()] * 9


@pytest.mark.parametrize("limits", [lambda limit: limit, lambda limit: {"j1": limit}], ids=["all", "by name"])
@pytest.mark.parametrize(("share", "named"), [(1.001, ()), (0.999, ("j1",))])
def test_an_actuator_above_its_speed_limit_is_named(limits: Any, share: float, named: tuple[str, ...]) -> None:
    followed = pf.track(arm(None), turning(), sample_time=0.5, speed_limits=limits(share * PACE / 0.5))
    assert followed.too_fast == [(), *[named] * 8]


def test_an_actuator_that_is_not_named_may_be_as_fast_as_it_likes() -> None:
    assert pf.track(arm(None), turning(), sample_time=0.5, speed_limits={"j2": 1e-3}).too_fast == [()] * 9


def test_times_may_be_given_one_by_one() -> None:
    times = np.array([0.0, 0.5, 0.75, 1.75, 1.75, np.nan, 2.0, 2.5, 4.0])
    followed = pf.track(arm(None), turning(), times=times, speed_limits={"j1": PACE / 0.3})
    steps = np.array([0.5, 0.25, 1.0, np.nan, np.nan, np.nan, 0.5, 1.5])
    np.testing.assert_allclose(followed.speeds[1:, 0], PACE / steps, atol=1e-7)
    assert followed.too_fast == [(), (), ("j1",), *[()] * 6]
    velocities, apart = PACE / steps, 0.5 * (steps[1:] + steps[:-1])
    np.testing.assert_allclose(followed.accelerations[2:, 0], np.diff(velocities) / apart, atol=1e-6)
    assert followed.sample_time is None
    assert pf.track(arm(None), turning(), times=0.5 * np.arange(9)).sample_time == pytest.approx(0.5)
    assert json.loads(json.dumps(followed.to_dict()))["speeds"][4] == [None, None]


def test_without_a_sample_time_nothing_is_said_of_speeds() -> None:
    followed = pf.track(arm(None), turning())
    assert followed.speeds is None and followed.too_fast is None


def test_speeds_do_not_reach_over_rows_that_are_no_poses() -> None:
    path = turning()
    path[4] = np.nan
    options = Options(on_invalid="mark")
    followed = pf.track(arm(None), path, options=options, sample_time=0.5, speed_limits=0.1)
    assert followed.too_fast == [(), *[("j1",)] * 3, (), (), *[("j1",)] * 3]
    assert not followed.jumps.any()


def test_a_track_tells_its_fields_as_plain_numbers() -> None:
    followed = pf.track(pf.load("stewart"), [(0, 0, 195), (0, 0, 196)], sample_time=0.1, speed_limits={"BL1": 1.0})
    plain = json.loads(json.dumps(followed.to_dict()))
    assert plain["jumps"] == [False, False]
    np.testing.assert_allclose(plain["speeds"], followed.speeds)
    assert plain["too_fast"] == [[], ["BL1"]]
    assert plain["status"] == ["REACHED", "REACHED"]
    assert repr(followed) == "<Track of '6-UPS Stewart platform': 2 REACHED>"
    assert pf.track(pf.load("stewart"), [(0, 0, 195)]).to_dict()["speeds"] is None


def test_a_track_survives_pickling() -> None:
    machine, path = arm(None), past_the_hole(0.0)
    seed = pf.solve_ik(machine, (-2.0, 0.0, 0.0))
    followed = pf.track(machine, path, start=seed, sample_time=0.1, speed_limits=1.0)
    again = pickle.loads(pickle.dumps(followed))
    np.testing.assert_array_equal(again.jumps, followed.jumps)
    np.testing.assert_array_equal(again.speeds, followed.speeds)
    np.testing.assert_array_equal(again.pose, followed.pose)
    assert again.too_fast == followed.too_fast
    assert again.active_limits == followed.active_limits
