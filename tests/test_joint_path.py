"""Joints in series from base to end effector: the poses they give, and back."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from machines import machine
from pfabrik import Joint, Mechanism
from pfabrik.errors import InvalidArgument, MobilityWarning, UnknownName
from pfabrik.machine.motion.displacements import end_effector_pose, home_coordinates
from pfabrik.machine.motion.joint_path import JointPath, joint_path, passive_series


@cache
def chain_of_all_kinds() -> Mechanism:
    """Joints of every kind one after the other, some told from their outer body, with a weld between."""
    with pytest.warns(MobilityWarning):
        return Mechanism(
            name="chain",
            joints=[
                Joint("R", "revolute", ("base", "a"), at=(0, 0, 0), axis=(0.6, 0, 0.8), home=0.4, actuated=True),
                Joint("U", "universal", ("b", "a"), at=(1, 0, 2), axes=[[0, 1, 0], [1, 0, 0]]),
                Joint("P", "prismatic", ("c", "b"), axis=(0, 0.8, 0.6), home=3.0),
                Joint("S", "spherical", ("d", "c"), at=(2, 1, 2)),
                Joint("W", "fixed", ("d", "e"), at=(2, 1, 3)),
                Joint("C", "cylindrical", ("e", "tip"), at=(2, 2, 3), axis=(1, 0, 0), home=(0.1, 0.2)),
                Joint("S2", "spherical", ("tip", "end"), at=(3, 2, 3)),
            ],
            end_effector="end",
            reference_point=(3.0, 1.0, 4.0),
        )


def path_of_all_kinds() -> JointPath:
    return joint_path(chain_of_all_kinds(), ("C[1]", "S", "U", "P", "C[0]", "R", "S2"))


def test_hinges_in_series_turn_the_pose_one_after_the_other() -> None:
    path = joint_path(machine("g1_ankle"), ("pitch_joint", "roll_joint"))
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (50, 2))
    poses = path.poses(q)
    np.testing.assert_allclose(poses[:, :3, :3], Rotation.from_euler("YX", q).as_matrix(), atol=1e-14)
    drop = 0.132442 - 0.15
    where = np.stack([drop * np.sin(q[:, 0]), 0.0 * q[:, 0], 0.15 + drop * np.cos(q[:, 0])], axis=1)
    np.testing.assert_allclose(poses[:, :3, 3], where, atol=1e-15)
    np.testing.assert_array_equal(path.low, [-0.87267, -0.2618])
    np.testing.assert_allclose(path.coordinates_at(poses), q, atol=1e-12)
    poses[0, 0, 3] += 1e-3  # off the path
    assert np.isnan(path.coordinates_at(poses)[0]).all() and not np.isnan(path.coordinates_at(poses)[1:]).any()


def test_joints_of_every_kind_give_the_pose_that_all_coordinates_give() -> None:
    """Compared with the displacement of all bodies, which walks the graph joint by joint."""
    mechanism, path = chain_of_all_kinds(), path_of_all_kinds()
    q = np.random.default_rng(1).uniform(-1.5, 1.5, (40, len(mechanism.coordinate_names)))
    expected = end_effector_pose(mechanism, q - home_coordinates(mechanism))
    np.testing.assert_allclose(path.poses(q[:, path.columns]), expected, atol=1e-13)
    assert path.names[:2] == ("C[1]", "S[0]") and path.home[0] == 0.2


def test_twists_are_the_poses_finite_differences() -> None:
    path, step = path_of_all_kinds(), 1e-6
    q = np.random.default_rng(2).uniform(-1.0, 1.0, (10, len(path.names)))
    q[0, 1:4] = 0.0  # a ball at home
    poses, twists = path.poses_and_twists(q)
    for place in range(len(path.names)):
        off = np.zeros(len(path.names))
        off[place] = step
        after, before = path.poses(q + off), path.poses(q - off)
        turns = Rotation.from_matrix(after[:, :3, :3] @ np.swapaxes(before[:, :3, :3], 1, 2)).as_rotvec()
        rates = np.concatenate([after[:, :3, 3] - before[:, :3, 3], turns], axis=1) / (2.0 * step)
        np.testing.assert_allclose(twists[:, :, place], rates, atol=1e-8)
    np.testing.assert_array_equal(poses, path.poses(q))


def test_a_tip_is_reached_over_either_of_its_bodies() -> None:
    five_bar = machine("five_bar")
    answer = pf.solve_ik(five_bar, five_bar.home_pose[:3, 3] + [5.0, -8.0, 0.0])
    for names in (("p1", "p2"), ("p5", "p4")):
        path = joint_path(five_bar, names)
        q = answer.q[None, path.columns]
        np.testing.assert_allclose(path.poses(q)[0], answer.pose, atol=1e-9)
        assert path.poses_and_twists(q)[1].shape == (1, 3, 2)


def test_the_order_of_names_is_that_of_coordinates() -> None:
    ankle, struts = machine("g1_ankle"), machine("ankle_ups")
    one, other = (joint_path(ankle, names) for names in (("pitch_joint", "roll_joint"), ("roll_joint", "pitch_joint")))
    q = np.array([[0.3, -0.1]])
    np.testing.assert_array_equal(one.poses(q), other.poses(q[:, ::-1]))
    pivot = joint_path(struts, ("pivot[1]", "pivot[0]"))
    np.testing.assert_array_equal(pivot.poses(q), joint_path(struts, "pivot").poses(q[:, ::-1]))
    assert passive_series(ankle) == ("pitch_joint", "roll_joint")  # found where nothing is asked for
    assert passive_series(struts) == ("pivot",)
    assert passive_series(machine("stewart")) == ()


@pytest.mark.parametrize(
    ("names", "error", "text"),
    [
        ((), InvalidArgument, "no joint"),
        (("pitch",), UnknownName, "did you mean 'pitch_joint'"),
        (("pitch_joint",), InvalidArgument, "in series from 'base' to 'roll_link', such as pitch_joint, roll_joint"),
        (("pitch_joint", "left_motor_joint"), InvalidArgument, "expected joints in series"),
        (("pitch_joint", "roll_joint", "left_motor_joint"), InvalidArgument, "expected joints in series"),
        (("roll_joint", "roll_joint"), InvalidArgument, "'roll_joint' twice"),
        (("closure_1[0]",), InvalidArgument, "no coordinate closure_1"),
    ],
)
def test_names_that_make_no_series_are_refused(names: tuple[str, ...], error: type[Exception], text: str) -> None:
    with pytest.raises(error, match=text):
        joint_path(machine("g1_ankle"), names)
