"""Tracking: continuous, in one working mode, the same as answering step by step; leaps, whole turns and speeds."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import INTERPRETED
from machines import machine
from pfabrik import Joint, Mechanism, Options, Status
from pfabrik.errors import InvalidArgument

CIRCLES = {"five_bar": (200.0, 60.0), "stewart": (220.0, 60.0), "nrpm": (200.0, 100.0)}
"""Height and radius of the circle in the plane x = 0 that each catalogue file names as its test path."""
NEAREST = 1e-6
"""Share of the distance by which projections may be farther than the nearest."""
MARK = Options(on_invalid="mark")


def circle(height: float, radius: float, steps: int = 60 if INTERPRETED else 360) -> np.ndarray:
    angle = np.linspace(0, 2 * np.pi, steps, endpoint=False)
    return np.stack([0 * angle, radius * np.cos(angle), height + radius * np.sin(angle)], axis=1)


def arm(limit: tuple[float, float] | None) -> Mechanism:
    """Two links of 3 and 2 in the plane z = 0, driven at both joints."""
    z = (0, 0, 1)
    joints = [
        Joint("j1", "revolute", ("base", "upper"), at=(0, 0, 0), axis=z, actuated=True, range=limit),
        Joint("j2", "revolute", ("upper", "lower"), at=(3, 0, 0), axis=(0, 0, -1), actuated=True, range=(-2.5, 2.5)),
        Joint("tip", "revolute", ("lower", "tool"), at=(3, 2, 0), axis=z),
    ]
    return Mechanism("two-link arm", joints, "tip")


def turned_by(angle: np.ndarray) -> np.ndarray:
    """Where the arm's tip is with its shoulder turned by angles (n,) and its elbow as at home, (n, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([3 * c - 2 * s, 3 * s + 2 * c, 0 * c], axis=1)


# --- step by step ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [*CIRCLES, "tripod_prs", "mixed"])
@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
def test_tracking_is_answering_step_by_step_from_the_answer_before(name: str) -> None:
    """In reach and out of it."""
    mechanism = machine(name)
    length = mechanism.characteristic_length
    height, radius = CIRCLES.get(name, (mechanism.reference_point[2], 0.25 * length))
    path = circle(height, radius, steps=12 if INTERPRETED else 30)
    followed, before = pf.track(mechanism, path), None
    for row, target in enumerate(path):
        before = pf.solve_ik(mechanism, target, start=before, options=Options(working_mode="keep"))
        assert followed.status[row] == before.status
        np.testing.assert_allclose(followed.pose[row], before.pose, rtol=0, atol=1e-8 * length)
        np.testing.assert_allclose(followed.actuators[row], before.actuators, rtol=0, atol=1e-8 * length)


def test_redundant_actuators_follow_from_the_start_and_move_evenly() -> None:
    """The machine is free to move its arms along the way: they may, but not in jumps."""
    mechanism, steps = pf.load("nrpm"), 60 if INTERPRETED else 360
    start = pf.solve_ik(mechanism, np.add(mechanism.reference_point, (20.0, 30.0, -20.0)))
    again = pf.track(mechanism, start.pose[None], start=start)
    np.testing.assert_allclose(again.actuators[0], start.actuators, rtol=0, atol=1e-9)
    followed = pf.track(mechanism, circle(200.0, 60.0, steps))
    turns = np.array([drive.kind == "angle" for drive in mechanism.drives])
    pace = 60.0 * 2 * np.pi / steps
    changes = np.abs(np.diff(followed.actuators, axis=0)).max(axis=0)
    assert followed and changes[~turns].max() <= 3 * pace and changes[turns].max() <= 3 * pace / 90.0


@pytest.mark.parametrize("steps", [0, 1, 17, 50])
def test_progress_is_reported_up_to_the_end_and_changes_nothing(steps: int) -> None:
    mechanism, path = pf.load("stewart"), circle(*CIRCLES["stewart"])[:steps]
    calls: list[tuple[int, int]] = []
    watched = pf.track(mechanism, path, on_progress=lambda done, total: calls.append((done, total)))
    np.testing.assert_array_equal(watched.actuators, pf.track(mechanism, path).actuators)
    done = [count for count, _ in calls]
    assert [total for _, total in calls] == [steps] * len(calls)
    assert done == sorted(set(done)) and (done[-1] if done else 0) == steps


def stretched_out() -> tuple[Mechanism, np.ndarray]:
    """A 5-bar without limits, and a path on which its links are stretched out from the eighth target on."""
    return pf.load("five_bar").without_limits(), np.linspace((0, 0, 220), (0, 0, 400), 12)


def along_a_circle() -> tuple[Mechanism, np.ndarray]:
    return pf.load("stewart"), circle(200.0, 20.0, steps=40)


@pytest.mark.parametrize(("make", "bad"), [(along_a_circle, [0, 16, 17, 31]), (stretched_out, [8])])
def test_rows_that_are_no_poses_are_named_or_marked_and_passed_over(
    make: Callable[[], tuple[Mechanism, np.ndarray]], bad: list[int]
) -> None:
    mechanism, path = make()
    clean = pf.track(mechanism, path)
    path[bad] = np.nan
    good = np.setdiff1d(np.arange(len(path)), bad)
    for report in (None, lambda done, total: None):
        marked = pf.track(mechanism, path, options=MARK, on_progress=report)
        assert np.flatnonzero(marked.status == Status.INVALID).tolist() == bad
        assert np.isnan(marked.actuators[bad]).all()
        off = np.abs(marked.pose - clean.pose)[good]
        assert off.max() <= 1e-6 * mechanism.characteristic_length
    with pytest.raises(InvalidArgument, match=f"first bad rows?: {', '.join(map(str, bad))}"):
        pf.track(mechanism, path)


# --- whole turns -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("turns", [3.0, -2.5])
@pytest.mark.parametrize("has_gaps", [False, True])
def test_an_unlimited_crank_counts_on_through_full_turns(turns: float, has_gaps: bool) -> None:
    """The tip goes round the base at home's distance: the shoulder turns as far, and the elbow stays."""
    angle = np.linspace(0.0, 2 * np.pi * turns, 200)
    path = turned_by(angle)
    if has_gaps:
        path[::7] = np.nan
    followed, known = pf.track(arm(None), path, options=MARK), np.isfinite(path[:, 0])
    np.testing.assert_array_equal(followed.status == Status.REACHED, known)
    shoulder = followed.actuators[known, 0]
    np.testing.assert_allclose(shoulder - shoulder[0], angle[known] - angle[known][0], rtol=0, atol=1e-8)
    np.testing.assert_allclose(followed.actuators[known, 1], 0, atol=1e-8)


def test_a_limited_crank_stays_within_its_range() -> None:
    angle = np.linspace(0.0, 4.0, 100)
    followed = pf.track(arm((-2.0, 2.0)), turned_by(angle))
    np.testing.assert_array_equal(followed.status == Status.REACHED, angle <= 2.0)
    assert np.abs(followed.actuators[:, 0]).max() <= 2.0 + 1e-9


# --- leaps -----------------------------------------------------------------------------------------------------------


def past_the_hole(offset: float) -> np.ndarray:
    """A line of targets in the hole of the two-link arm, of radius 3 - 2, that passes its centre at a distance."""
    x = np.linspace(-0.5, 0.5, 21)
    return np.stack([x, 0 * x + offset, 0 * x], axis=1)


@pytest.mark.parametrize("offset", [0.0, 0.01])
def test_an_answer_leaps_where_its_target_passes_the_centre_of_a_hole_and_not_beside_it(offset: float) -> None:
    """There every point of the rim is as near. At a fifth of a step from the centre the arm makes most of half a turn
    in two steps, and yet it moves."""
    mechanism, path = arm(None), past_the_hole(offset)
    followed = pf.track(mechanism, path, start=pf.solve_ik(mechanism, (-2.0, 0.0, 0.0)))
    assert (followed.status == Status.PROJECTED).all()
    np.testing.assert_allclose(followed.position_error, 1.0 - np.linalg.norm(path, axis=1), rtol=NEAREST)
    if offset:
        assert not followed.jumps.any()
        return
    np.testing.assert_allclose(followed.pose[:10, 0, 3], -1.0, atol=1e-4)
    np.testing.assert_allclose(followed.pose[11:, 0, 3], 1.0, atol=1e-4)
    assert followed.jumps.any() and set(np.flatnonzero(followed.jumps)) <= {10, 11}


def waiting_at(shoulder: float, path: np.ndarray) -> np.ndarray:
    """Where the tip of the two-link arm is nearest to targets (n, 3) with its shoulder at an angle, (n, 3)."""
    elbow = 3.0 * np.array([np.cos(shoulder), np.sin(shoulder), 0.0])
    return elbow + 2.0 * (path - elbow) / np.linalg.norm(path - elbow, axis=1)[:, None]


def test_an_answer_at_a_limit_leaps_once_when_the_other_side_has_become_nearer() -> None:
    """A target circles where the shoulder cannot go. The tip waits at the shoulder's limit, on the forearm's circle
    there, and then on that at its other limit: not before that is nearer, nor after the target is half a turn ahead.
    """
    mechanism, home = arm((-2.0, 2.0)), np.arctan2(2.0, 3.0)
    angle = np.linspace(home + 1.5, home + 2 * np.pi - 1.5, 60)
    path = 3.0 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    followed = pf.track(mechanism, path, start=pf.solve_ik(mechanism, path[0]))
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
    assert set(followed.status) == {Status.REACHED, Status.PROJECTED}
    assert not followed.jumps.any()


# --- stretched links -------------------------------------------------------------------------------------------------


def rail_and_crank() -> tuple[Mechanism, np.ndarray]:
    """A 5-bar with a crank and a rail, and a way on which the rail's end stop and the stretched crank hold it."""
    z = (0, 0, 1)
    joints = [
        Joint("A0", "revolute", ("base", "crank"), (-25.4, 0, 0), axis=z, actuated=True, range=(-0.96, 0.62)),
        Joint("B0", "revolute", ("crank", "rod"), (-79.5, 66.6, 0), axis=z),
        Joint("A1", "prismatic", ("base", "slider"), axis=(0, 1, 0), actuated=True, range=(-30, 30)),
        Joint("B1", "revolute", ("slider", "bar"), (69.2, 70.1, 0), axis=z, range=(-0.94, 0.47)),
        Joint("T", "revolute", ("rod", "bar"), (-0.2, 139.4, 0), axis=z),
    ]
    return Mechanism("5-bar", joints, "T", task=("x", "y")), np.array((0.42, 0.91, 0.0, 0.0, 0.0, 0.0))


def three_rrc() -> tuple[Mechanism, np.ndarray]:
    """A translating machine whose legs each bend in a plane of their own, and a way on which two are stretched out."""
    places = [
        ((37.7, -85.4, 57.0), (12.7, -18.8, 50.6), (-12.3, 0.6, -3.0)),
        ((62.9, 51.8, -115.7), (67.6, 26.8, -22.3), (2.9, 1.8, 1.6)),
        ((-80.9, 51.3, 45.3), (-8.2, 53.1, 20.3), (0.9, -8.7, -4.7)),
    ]
    joints = []
    for leg, (a, b, c) in enumerate(places):
        along = np.eye(3)[leg]
        joints += [
            Joint(f"A{leg}", "revolute", ("base", f"{leg}.1"), a, axis=along, actuated=True),
            Joint(f"B{leg}", "revolute", (f"{leg}.1", f"{leg}.2"), b, axis=along),
            Joint(f"C{leg}", "cylindrical", (f"{leg}.2", "table"), c, axis=along, range=((-1.5, 1.5), (-60, 60))),
        ]
    mechanism = Mechanism("3-RRC", joints, "table", (0, 0, 0), task=("x", "y", "z"))
    return mechanism, np.array((0.56, -0.51, 0.65, 0.0, 0.0, 0.0))


def cranks() -> tuple[Mechanism, np.ndarray]:
    """A hexapod, and a way on which its cranks are stretched out while it turns."""
    draw = np.random.default_rng(2)
    way, turn = draw.normal(size=3), 0.6 * draw.normal(size=3)
    return pf.load("servo_hexapod").without_limits(), np.concatenate([way / np.linalg.norm(way), turn / 1.2])


def pinned_parallelograms(seed: int) -> tuple[Mechanism, np.ndarray]:
    """A delta without closed forms, and any way: arms and forearms are stretched out on all of them."""
    way = np.random.default_rng(seed).normal(size=3)
    return machine("spherical_tip").without_limits(), np.concatenate([1.25 * way / np.linalg.norm(way), np.zeros(3)])


@pytest.mark.parametrize(
    ("make", "steps"),
    [
        (rail_and_crank, 101),
        (three_rrc, 101),
        (cranks, 21),
        *((partial(pinned_parallelograms, seed), 25) for seed in (1, 2, 3)),
    ],
)
def test_links_that_were_stretched_out_beyond_reach_bend_back_the_way_they_did(
    make: Callable[[], tuple[Mechanism, np.ndarray]], steps: int
) -> None:
    """Out on a way of 1.2 L and back the same way."""
    mechanism, way = make()
    share = 1.2 * np.linspace(0, 1, 13 if INTERPRETED else steps)
    share = np.concatenate([share, share[-2::-1]])[:, None]
    targets = np.tile(mechanism.home_pose, (len(share), 1, 1))
    targets[:, :3, 3] += share * mechanism.characteristic_length * way[:3]
    targets[:, :3, :3] = Rotation.from_rotvec(share * way[3:]).as_matrix()
    followed = pf.track(mechanism, targets)
    assert pf.singularity(followed).serial.min() < 1e-3  # links are stretched out on the way
    assert followed.status[-1] == Status.REACHED and not followed.jumps.any()
    np.testing.assert_allclose(followed.actuators[-1], followed.actuators[0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(followed.position_error, followed.position_error[::-1], rtol=1e-5, atol=1e-9)


@pytest.mark.parametrize("name", ["delta", "orthoglide"])
def test_a_platform_that_cannot_turn_does_not_turn_beyond_reach(name: str) -> None:
    mechanism = pf.load(name).without_limits()
    share = np.concatenate([np.linspace(0, 1, 13), np.linspace(1, 0, 13)[1:]])[:, None]
    for way in np.random.default_rng(11).normal(size=(1 if INTERPRETED else 6, 3)):
        way *= 1.8 * mechanism.characteristic_length / np.linalg.norm(way)
        followed = pf.track(mechanism, mechanism.home_pose[:3, 3] + share * way)
        assert Rotation.from_matrix(followed.pose[:, :3, :3]).magnitude().max() <= 1e-5
        assert (followed.status[[0, -1]] == Status.REACHED).all()


# --- speeds ----------------------------------------------------------------------------------------------------------

PACE = 0.25
"""How far the shoulder of the arm below turns in a step [rad]."""


def turning(steps: int = 9) -> np.ndarray:
    """A path on which the shoulder of the two-link arm turns evenly, and its elbow rests."""
    return turned_by(PACE * np.arange(steps))


def test_speeds_are_steps_by_the_time_they_take() -> None:
    followed = pf.track(arm(None), turning(), sample_time=0.5)
    np.testing.assert_allclose(followed.speeds, [(0.0, 0.0), *[(PACE / 0.5, 0.0)] * 8], rtol=0, atol=1e-7)
    assert followed.too_fast == [()] * 9
    without = pf.track(arm(None), turning())
    assert without.speeds is None and without.too_fast is None


@pytest.mark.parametrize(
    ("limits", "named"),
    [
        (1.001 * PACE / 0.5, ()),
        (0.999 * PACE / 0.5, ("j1",)),
        ({"j1": 0.999 * PACE / 0.5}, ("j1",)),
        ({"j2": 1e-3}, ()),
    ],
)
def test_an_actuator_above_its_speed_limit_is_named(limits: float | dict[str, float], named: tuple[str, ...]) -> None:
    followed = pf.track(arm(None), turning(), sample_time=0.5, speed_limits=limits)
    assert followed.too_fast == [(), *[named] * 8]


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


def test_speeds_do_not_reach_over_rows_that_are_no_poses() -> None:
    path = turning()
    path[4] = np.nan
    followed = pf.track(arm(None), path, options=MARK, sample_time=0.5, speed_limits=0.1)
    assert followed.too_fast == [(), *[("j1",)] * 3, (), (), *[("j1",)] * 3]
    assert not followed.jumps.any()


# --- what a track is -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("steps", [0, 1])
def test_a_path_may_be_without_steps(steps: int) -> None:
    followed = pf.track(arm(None), past_the_hole(0.0)[:steps], sample_time=0.1)
    assert followed.jumps.shape == (steps,) and not followed.jumps.any()
    assert followed.speeds is not None and followed.speeds.shape == followed.actuators.shape == (steps, 2)
    assert followed.too_fast == [()] * steps


def test_a_track_tells_its_fields_as_plain_numbers() -> None:
    followed = pf.track(pf.load("stewart"), [(0, 0, 195), (0, 0, 196)], sample_time=0.1, speed_limits={"BL1": 1.0})
    plain = json.loads(json.dumps(followed.to_dict()))
    assert plain["jumps"] == [False, False] and plain["status"] == ["REACHED", "REACHED"]
    np.testing.assert_allclose(plain["speeds"], followed.speeds)
    assert plain["too_fast"] == [[], ["BL1"]]
    assert repr(followed) == "<Track of '6-UPS Stewart platform': 2 REACHED>"
    assert pf.track(pf.load("stewart"), [(0, 0, 195)]).to_dict()["speeds"] is None


def test_a_track_survives_pickling() -> None:
    mechanism = arm(None)
    start = pf.solve_ik(mechanism, (-2.0, 0.0, 0.0))
    followed = pf.track(mechanism, past_the_hole(0.0), start=start, sample_time=0.1, speed_limits=1.0)
    again = pickle.loads(pickle.dumps(followed))
    for name in ("jumps", "speeds", "pose"):
        np.testing.assert_array_equal(getattr(again, name), getattr(followed, name))
    assert again.too_fast == followed.too_fast and again.active_limits == followed.active_limits
