"""Machines that are asked for a part of a pose: what is asked is met, the rest follows."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import INTERPRETED
from machines import closure, published
from machines.published import PUBLISHED
from pfabrik import Joint, Mechanism, Status
from pfabrik.errors import InvalidMechanism
from pfabrik.machine.description.task import Task, task_of
from pfabrik.machine.files import dumps, loads

N = 4 if INTERPRETED else 30


def rps(task: tuple[str, ...] | None = ("z", "tilt"), stroke: tuple[float, float] = (100.0, 300.0)) -> Mechanism:
    """The 3-RPS of Lee and Shah (1988)."""
    geometry = PUBLISHED["rps_leeshah"]["geometry"]
    free = published.rps(geometry["base_radius"], geometry["platform_radius"], 200.0)
    return dataclasses.replace(free.with_limits({f"P{i}": stroke for i in (1, 2, 3)}), task=task)


def asked_of(mechanism: Mechanism, task: tuple[str, ...]) -> Mechanism:
    return dataclasses.replace(mechanism, task=task)


@pytest.mark.parametrize("spin", [0.0, 0.4, -2.0])
@pytest.mark.parametrize("row", PUBLISHED["rps_leeshah"]["rows_a_b_pz_px_py_d1_d2_d3"])
def test_parasitic_motion_is_the_published_one_whatever_the_target_says_of_it(row: list[float], spin: float) -> None:
    azimuth, tilt, z, x, y, *lengths = row
    turn = (
        Rotation.from_euler("z", azimuth) * Rotation.from_euler("y", tilt) * Rotation.from_euler("z", -azimuth + spin)
    )
    answer = pf.solve_ik(rps(), pf.pose([7.0, -3.0, z], rotation=turn))
    assert answer.status is Status.REACHED
    np.testing.assert_allclose(answer.pose[:3, 3], (x, y, z), rtol=0, atol=1e-9)
    np.testing.assert_allclose(answer.pose[:3, 2], turn.as_matrix()[:, 2], rtol=0, atol=1e-9)
    np.testing.assert_allclose(answer.actuators, lengths, rtol=0, atol=1e-8)
    assert max(answer.position_error, answer.rotation_error) <= 1e-9 * 200
    assert pf.closure_residual(answer) <= 1e-9


def test_the_whole_pose_is_out_of_reach_where_the_task_is_not() -> None:
    target = pf.pose([0, 0, 203.835], rpy=[0.1, 0.15, 0])
    assert pf.solve_ik(rps(), target).status is Status.REACHED
    assert pf.solve_ik(rps(task=None), target).status is Status.PROJECTED


@pytest.mark.parametrize(
    "build, task, freedoms", [(closure.pinned_delta, ("x", "y", "z"), 3), (closure.ankle, ("tilt",), 2)]
)
def test_forward_kinematics_returns_what_was_asked(build, task: tuple[str, ...], freedoms: int) -> None:
    mechanism = asked_of(build(), task)
    assert pf.mobility(mechanism).platform == freedoms
    rng = np.random.default_rng(3)
    home = [np.ravel(mechanism.home_coordinate(name))[0] for name in mechanism.actuator_names]
    turning = np.array([mechanism.joint(name).type == "revolute" for name in mechanism.actuator_names])
    size = np.where(turning, 0.25, 0.08 * mechanism.characteristic_length)
    assembled = pf.solve_fk(mechanism, home + size * rng.uniform(-1, 1, (N, len(home))))
    assembled = assembled[assembled.status == Status.REACHED]
    assert len(assembled) >= 0.6 * N
    answer = pf.solve_ik(mechanism, assembled.pose)
    assert answer
    assert answer.limit_excess.max() <= 1e-9
    assert pf.closure_residual(answer).max() <= 1e-9 * mechanism.characteristic_length
    position, rotation = task_of(mechanism).errors(answer.pose, assembled.pose)
    assert position.max() <= 1e-9 * mechanism.characteristic_length
    assert rotation.max() <= 1e-9
    back = pf.solve_fk(mechanism, answer.actuators, start=answer)
    np.testing.assert_allclose(back.pose, answer.pose, rtol=0, atol=1e-7)


def test_what_is_out_of_reach_is_projected_and_measured_in_the_task_alone() -> None:
    mechanism = rps(stroke=(180.0, 220.0))
    target = pf.pose([50, 60, 260], rpy=[0.02, 0.03, 1.0])
    answer = pf.solve_ik(mechanism, target)
    assert answer.status is Status.PROJECTED
    assert answer.limit_excess <= 1e-9
    assert pf.closure_residual(answer) <= 1e-7
    assert answer.position_error == pytest.approx(260 - answer.pose[2, 3], abs=1e-6)  # x and y do not count
    assert answer.rotation_error <= 1e-9  # held
    assert {limit.bound for limit in answer.active_limits} == {"max"}
    free = pf.solve_ik(mechanism, target, options=pf.Options(hold=None))
    assert free.status is Status.PROJECTED
    assert free.position_error <= answer.position_error


def test_a_file_says_what_is_asked() -> None:
    mechanism = rps()
    written = dumps(mechanism)
    assert 'task = ["z", "tilt"]' in written
    assert loads(written) == mechanism
    assert "task" not in dumps(rps(task=None))


def test_the_whole_pose_is_the_default_in_any_order() -> None:
    assert rps(task=("rotation", "z", "x", "y")) == rps(task=None)
    assert rps(task=None).task == ("x", "y", "z", "rotation")
    assert pf.load("five_bar").task == ("x", "y", "z")


@pytest.mark.parametrize(
    "task, message",
    [
        (("z", "tlt"), "did you mean 'tilt'"),
        ((), "some of x, y, z"),
        (("z", "z"), "none of them twice"),
        (("rotation", "tilt"), "one of the two"),
        (("z", 3), "some of x, y, z"),
        ("z", "some of x, y, z"),
    ],
)
def test_a_task_that_is_none_is_named(task, message: str) -> None:
    with pytest.raises(InvalidMechanism, match=message):
        rps(task=task)


def test_a_joint_end_effector_has_no_rotation_to_ask_for() -> None:
    with pytest.raises(InvalidMechanism, match="only the position counts"):
        dataclasses.replace(pf.load("five_bar"), task=("x", "tilt"))
    assert pf.solve_ik(dataclasses.replace(pf.load("five_bar"), task=("y", "z")), (5.0, 10.0, 180.0))


def twist_about_z(turn: np.ndarray) -> np.ndarray:
    """What SciPy makes of it: the quaternion's part about z, as an angle (n,)."""
    quaternions = Rotation.from_matrix(turn).as_quat()
    return 2.0 * np.arctan2(quaternions[..., 2], quaternions[..., 3])


def yaw_off(poses: np.ndarray, others: np.ndarray) -> np.ndarray:
    off = twist_about_z(poses[..., :3, :3]) - twist_about_z(others[..., :3, :3])
    return np.abs(np.angle(np.exp(1j * off)))


def random_turns(n: int, seed: int, tilt: float = 1.0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    swings = Rotation.from_rotvec(rng.uniform(-tilt, tilt, (n, 3)) * [1, 1, 0])
    return (swings * Rotation.from_euler("z", rng.uniform(-2, 2, (n, 1)))).as_matrix()


def test_the_yaw_is_the_twist_about_z() -> None:
    turns = random_turns(50, 1, tilt=2.0)
    a, b = pf.pose(np.zeros((50, 3)), rotation=turns), pf.pose(np.zeros((50, 3)), rotation=turns[::-1])
    np.testing.assert_allclose(Task((True,) * 3, 1).errors(a, b)[1], yaw_off(a, b), rtol=0, atol=1e-12)
    completed = Task((False,) * 3, 1).completed(a, b)
    assert yaw_off(completed, a).max() <= 1e-12
    np.testing.assert_allclose(completed[:, 2, 2], b[:, 2, 2], rtol=0, atol=1e-12)


def test_a_scara_takes_a_position_and_a_yaw_whatever_the_tilt_of_the_target() -> None:
    mechanism = closure.scara()
    q = np.random.default_rng(2).uniform(-1, 1, (N, 4)) * [2.2, 2.2, 45.0, 3.0]
    poses = pf.solve_fk(mechanism, q).pose
    answer = pf.solve_ik(mechanism, poses)
    assert answer
    np.testing.assert_allclose(answer.pose, poses, rtol=0, atol=1e-6)
    tilted = poses.copy()
    tilted[:, :3, :3] = random_turns(N, 3, tilt=0.5)
    answer = pf.solve_ik(mechanism, tilted)
    assert answer
    assert yaw_off(answer.pose, tilted).max() <= 1e-9
    np.testing.assert_allclose(answer.pose[:, 2, 2], 1.0, rtol=0, atol=1e-12)


def test_a_scara_out_of_reach_keeps_the_yaw_and_misses_by_as_much_as_it_must() -> None:
    mechanism = closure.scara()
    answer = pf.solve_ik(mechanism, pf.pose([100, 200, 75], rpy=[0, 0, 1.0]))
    assert answer.status is Status.PROJECTED
    assert answer.position_error == pytest.approx(25.0, abs=1e-6)  # the quill ends at 50
    assert answer.rotation_error <= 1e-9
    assert [limit.bound for limit in answer.active_limits] == ["max"]
    far = pf.solve_ik(mechanism, pf.pose([600, 0, 0], rpy=[0, 0, 2.0]))
    assert far.position_error == pytest.approx(600 - 200 - np.hypot(150, 50), abs=1e-6)
    assert far.rotation_error <= 1e-9


@pytest.mark.parametrize("asked, gets", [(0.5, 0.5), (2.0, 1.0), (3.0, 1.0), (-3.0, -1.2)])
def test_a_turntable_yaws_as_far_as_it_turns(asked: float, gets: float) -> None:
    table = Mechanism(
        "turntable",
        [Joint("A", "revolute", ("base", "plate"), at=(5, 0, 0), axis=(0, 0, 1), actuated=True, range=(-1.2, 1.0))],
        "plate",
        (50, 0, 0),
        task=("yaw",),
    )
    for tilt in (0.0, 0.4):
        turn = Rotation.from_rotvec([tilt, -tilt, 0.0]) * Rotation.from_euler("z", asked)
        answer = pf.solve_ik(table, pf.pose([1e3, 0, 7], rotation=turn))
        assert answer.status is (Status.REACHED if asked == gets else Status.PROJECTED)
        np.testing.assert_allclose(answer.actuators, [gets], rtol=0, atol=1e-8)
        assert answer.position_error == 0.0
        assert answer.rotation_error == pytest.approx(abs(asked - gets), abs=1e-8)
    travel = pf.travel(pf.solve_ik(table, table.home_pose))
    assert [(each.kind, each.direction) for each in travel] == [("about", (0, 0, 1)), ("about", (0, 0, -1))]
    np.testing.assert_allclose(travel.distances, [1.0, 1.2], rtol=0, atol=1e-8)
    with pytest.raises(pf.errors.InvalidArgument, match="within the task, yaw"):
        pf.travel(pf.solve_ik(table, table.home_pose), about=(1, 0, 0))


@pytest.mark.parametrize("task", [("yaw",), ("x", "y", "z", "yaw"), ("z", "yaw")])
def test_an_arm_that_is_asked_for_a_yaw_may_tilt_as_it_likes(task: tuple[str, ...]) -> None:
    mechanism = asked_of(closure.arm(), task)
    q = np.random.default_rng(4).uniform(-1, 1, (N, 6)) * [2, 0.8, 0.8, 1.5, 1, 1.5]
    targets = pf.solve_fk(mechanism, q + [0, 0.3, 0, 0, 0, 0]).pose
    targets = targets[targets[:, 2, 2] > -0.9]  # upside down there is no yaw
    answer = pf.solve_ik(mechanism, targets)
    assert answer
    assert yaw_off(answer.pose, targets).max() <= 1e-9
    counted = ["xyz".index(axis) for axis in task if axis in "xyz"]
    assert np.abs((answer.pose - targets)[:, counted, 3]).max(initial=0.0) <= 1e-9 * mechanism.characteristic_length
    assert answer.limit_excess.max() <= 1e-9
    here = pf.solve_ik(mechanism, targets[0])
    path = np.array([pf.pose(targets[0][:3, 3], rotation=targets[0][:3, :3])] * 20)
    path[:, :3, :3] = Rotation.from_euler("z", np.linspace(0, 0.3, 20)[:, None]).as_matrix() @ path[:, :3, :3]
    assert pf.track(mechanism, path, start=here)


@pytest.mark.parametrize("hold", ["orientation", "position", None])
def test_no_small_motion_leads_nearer_to_a_yaw_out_of_reach(hold: str | None) -> None:
    mechanism = asked_of(closure.arm(), ("x", "y", "z", "yaw")).with_limits(**{"R1.1": (-0.4, 0.4)})
    target = pf.pose([150, 420, 500], rpy=[0.2, 0.1, 2.5])
    options = pf.Options(hold=hold, rotation_length=100.0)
    answer = pf.solve_ik(mechanism, target, options=options)
    assert answer.status is Status.PROJECTED
    assert answer.limit_excess <= 1e-9
    assert answer.rotation_error == pytest.approx(yaw_off(answer.pose[None], target[None])[0], abs=1e-12)
    if answer.held == "orientation":
        assert answer.rotation_error <= 1e-9
    if hold is not None:
        return
    away = np.hypot(answer.position_error, 100.0 * answer.rotation_error)
    shifts = np.random.default_rng(5).normal(0, 1e-3, (200, 6))
    shifted = pf.configuration(mechanism, answer.q + shifts)
    within = shifted[shifted.status == Status.REACHED].pose
    offset = np.linalg.norm((within - target)[:, :3, 3], axis=1)
    assert len(within) > 20
    assert np.hypot(offset, 100.0 * yaw_off(within, target[None])).min() >= away - 1e-7


@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
def test_an_h4_takes_positions_and_yaws_from_its_singular_home() -> None:
    mechanism = closure.h4()
    assembled = pf.solve_fk(mechanism, np.random.default_rng(6).uniform(-0.5, 0.5, (12, 4)))
    level = assembled.pose[:, 2, 2] > 1.0 - 1e-9  # else it has folded, or tilts as its singular home lets it
    same = np.abs(assembled.joints["Q1"] - assembled.joints["Q2"]) < 1e-6
    poses = assembled.pose[(assembled.status == Status.REACHED) & level & same]
    assert len(poses) >= 4
    assert np.ptp(twist_about_z(poses[:, :3, :3])) > (0.5 if not INTERPRETED else 0.0)
    answer = pf.solve_ik(mechanism, poses)
    assert answer
    assert yaw_off(answer.pose, poses).max() <= 1e-9


@pytest.mark.parametrize("task", [("tilt", "yaw"), ("x", "rotation", "yaw"), ("yaw", "yaw")])
def test_a_yaw_goes_with_no_other_part_of_the_rotation(task: tuple[str, ...]) -> None:
    with pytest.raises(InvalidMechanism) as raised:
        asked_of(closure.scara(), task)
    assert [fault.place for fault in raised.value.faults] == ["task"]
    assert loads(dumps(closure.scara())) == closure.scara()
