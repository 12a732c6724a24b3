"""Poses from every description of a rotation, against SciPy, and targets of every accepted form."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.spatial import transform
from scipy.spatial.transform import Rotation

import pfabrik as pf
from pfabrik.errors import InvalidArgument
from pfabrik.poses import as_poses, is_rotation
from pfabrik.rotations import angles_between, from_rotvec, square_to

ANGLES = [0.0, 1e-300, 1e-16, 1e-12, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 0.1, 1.0, 3.0, np.pi, 4.0, 100.0]


@pytest.mark.filterwarnings("ignore:.*were degrees meant")
@pytest.mark.parametrize("angle", ANGLES)
def test_rotation_vectors_are_exact_at_every_angle(angle: float) -> None:
    """The antisymmetric part is compared relative to the angle, so that no branch may lose digits."""
    for axis in np.random.default_rng(1).normal(size=(20, 3)):
        axis /= np.linalg.norm(axis)
        R = pf.pose([0, 0, 0], rotvec=angle * axis)[:3, :3]
        np.testing.assert_allclose(
            R, Rotation.from_rotvec(angle * axis).as_matrix(), rtol=0, atol=1e-14 * max(angle, 1)
        )
        sine = np.sin(angle) * np.cross(np.eye(3), axis)
        np.testing.assert_allclose(0.5 * (R - R.T), sine, rtol=0, atol=2e-15 * angle)


@pytest.mark.parametrize("size", [1e-9, 1e-6, 1e-3, 1.0, 3.0])
def test_roll_pitch_yaw_turn_about_the_fixed_axes_in_this_order(size: float) -> None:
    for rpy in size * np.random.default_rng(2).uniform(-1, 1, (50, 3)):
        expected = Rotation.from_euler("xyz", rpy).as_matrix()
        np.testing.assert_allclose(pf.pose([1, 2, 3], rpy=rpy)[:3, :3], expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize("norm", [1e-200, 1e-3, 1.0, 1e200])
def test_quaternions_of_any_norm_with_the_scalar_where_the_name_says(norm: float) -> None:
    for quaternion in np.random.default_rng(3).normal(size=(50, 4)):
        expected = Rotation.from_quat(quaternion).as_matrix()
        last = pf.pose([0, 0, 0], quat_xyzw=norm * quaternion)
        first = pf.pose([0, 0, 0], quat_wxyz=norm * np.roll(quaternion, 1))
        np.testing.assert_allclose(last[:3, :3], expected, rtol=0, atol=1e-14)
        np.testing.assert_array_equal(first, last)


@pytest.mark.parametrize("angle", [1e-9, 1e-6, 1e-3])
def test_tiny_quaternions_keep_their_angle(angle: float) -> None:
    R = pf.pose([0, 0, 0], quat_wxyz=[np.cos(0.5 * angle), np.sin(0.5 * angle), 0, 0])[:3, :3]
    assert R[2, 1] == pytest.approx(np.sin(angle), rel=1e-14)


def test_a_pose_is_position_and_rotation_and_a_last_row() -> None:
    R = Rotation.from_rotvec([0.1, 0.2, 0.3])
    for given in (R, R.as_matrix(), R.as_matrix().tolist()):
        T = pf.pose([1, 2, 3], rotation=given)
        np.testing.assert_array_equal(T[:3, :3], R.as_matrix())
        np.testing.assert_array_equal(T[:3, 3], (1, 2, 3))
        np.testing.assert_array_equal(T[3], (0, 0, 0, 1))
    np.testing.assert_array_equal(pf.pose((1, 2, 3))[:3, :3], np.eye(3))


def test_poses_come_in_batches_whose_leading_axes_are_broadcast() -> None:
    positions = np.arange(18.0).reshape(2, 3, 3)
    turns = np.random.default_rng(5).uniform(-3, 3, (3, 3))
    for given, rotations in (
        ({"rotvec": turns}, Rotation.from_rotvec(turns)),
        ({"rpy": turns}, Rotation.from_euler("xyz", turns)),
        ({"rotation": Rotation.from_rotvec(turns)}, Rotation.from_rotvec(turns)),
        ({"quat_xyzw": Rotation.from_rotvec(turns).as_quat()}, Rotation.from_rotvec(turns)),
    ):
        T = pf.pose(positions, **given)
        assert T.shape == (2, 3, 4, 4)
        np.testing.assert_array_equal(T[..., :3, 3], positions)
        np.testing.assert_allclose(T[..., :3, :3], np.stack([rotations.as_matrix()] * 2), rtol=0, atol=1e-14)
        np.testing.assert_array_equal(T[..., 3, :], np.broadcast_to((0, 0, 0, 1), (2, 3, 4)))
    assert pf.pose(positions).shape == (2, 3, 4, 4)
    assert pf.pose((1, 2, 3), rpy=turns).shape == (3, 4, 4)
    assert pf.pose(np.zeros((0, 3)), rpy=(0, 0, 1)).shape == (0, 4, 4)
    with pytest.raises(InvalidArgument, match=r"xyz: found shape \(2, 3\) beside rotations of batch shape \(3,\)"):
        pf.pose(np.zeros((2, 3)), rpy=turns)


def test_degrees_are_of_angles_and_of_rotation_vectors_alone() -> None:
    angles = np.array([(10.0, -20.0, 30.0), (170.0, 80.0, -170.0)])
    for name in ("rpy", "rotvec"):
        expected = pf.pose((1, 2, 3), **{name: np.radians(angles)})
        np.testing.assert_array_equal(pf.pose((1, 2, 3), **{name: angles}, degrees=True), expected)
    quaternion = Rotation.from_rotvec(angles[0], degrees=True).as_quat()
    expected = pf.pose((1, 2, 3), quat_xyzw=quaternion)
    np.testing.assert_array_equal(pf.pose((1, 2, 3), quat_xyzw=quaternion, degrees=True), expected)


def test_every_pose_is_its_own_array() -> None:
    first, second = pf.pose([0, 0, 0]), pf.pose([0, 0, 0])
    first[0, 0] = 7.0
    assert second[0, 0] == 1.0


def test_two_rotations_are_a_conflict_that_names_both() -> None:
    with pytest.raises(InvalidArgument, match="rpy and quat_xyzw"):
        pf.pose([0, 0, 0], rpy=[0, 0, 0], quat_xyzw=[0, 0, 0, 1])


@pytest.mark.parametrize(
    "argument, value",
    [
        ("xyz", [0, 0]),
        ("xyz", [[0, 0]]),
        ("xyz", [0, 0, np.nan]),
        ("xyz", "here"),
        ("rpy", [0, 0]),
        ("rpy", [0, np.inf, 0]),
        ("rotvec", [0, 0, 0, 1]),
        ("rotvec", [[0], [0, 1]]),
        ("quat_xyzw", [0, 0, 1]),
        ("quat_xyzw", [0, 0, 0, 0]),
        ("quat_wxyz", [0, 0, 0, 0]),
        ("rotation", np.eye(4)),
        ("rotation", np.diag([1.0, 1.0, -1.0])),
        ("rotation", np.full((3, 3), np.nan)),
        ("rotation", 2 * np.eye(3)),
        ("rotvec", [1j, 0, 0]),
        ("rotvec", [True, False, True]),
    ],
)
def test_what_is_no_position_or_rotation_is_refused_by_name(argument: str, value: object) -> None:
    arguments = {"xyz": [0, 0, 0]} | {argument: value}
    with pytest.raises(InvalidArgument) as caught:
        pf.pose(**arguments)
    assert caught.value.argument == argument


@pytest.mark.parametrize("deviation, accepted", [(0.4e-6, True), (0.6e-6, False)])
def test_rotation_matrices_are_accepted_up_to_the_stated_deviation(deviation: float, accepted: bool) -> None:
    """R^T R deviates from I by twice the stretch of R, and may by 1e-6."""
    assert is_rotation(Rotation.from_rotvec([1, 2, 3]).as_matrix() * (1 + deviation)) is accepted


@pytest.mark.parametrize(
    "shape, batch",
    [
        ((4, 4), ()),
        ((5, 4, 4), (5,)),
        ((2, 3, 4, 4), (2, 3)),
        ((0, 4, 4), (0,)),
        ((3,), ()),
        ((4, 3), (4,)),
        ((3, 3), (3,)),
    ],
)
def test_targets_are_flattened_and_their_batch_shape_kept(shape: tuple[int, ...], batch: tuple[int, ...]) -> None:
    given = np.random.default_rng(4).normal(size=shape)
    poses, found = as_poses(given)
    assert found == batch
    assert poses.shape == (int(np.prod(batch)), 4, 4)
    assert poses.dtype == np.float64
    assert poses.flags.c_contiguous
    if shape[-1] == 3:
        np.testing.assert_array_equal(poses[:, :3, 3], given.reshape(-1, 3))
        np.testing.assert_array_equal(poses[:, :3, :3], np.broadcast_to(np.eye(3), (len(poses), 3, 3)))
        np.testing.assert_array_equal(poses[:, 3], np.broadcast_to((0, 0, 0, 1), (len(poses), 4)))
    else:
        np.testing.assert_array_equal(poses, given.reshape(-1, 4, 4))


@pytest.mark.parametrize("shape", [(), (4,), (3, 4), (4, 3, 4), (2,), (0,)])
def test_other_shapes_are_no_targets(shape: tuple[int, ...]) -> None:
    with pytest.raises(InvalidArgument, match="target"):
        as_poses(np.zeros(shape))


def test_a_rotation_alone_is_no_target() -> None:
    """Its matrix would pass for three positions."""
    with pytest.raises(InvalidArgument, match="target"):
        as_poses(Rotation.identity())


@pytest.mark.skipif(not hasattr(transform, "RigidTransform"), reason="SciPy before 1.16")
def test_rigid_transforms_are_targets() -> None:
    R = Rotation.from_rotvec([[0.1, 0, 0], [0, 0.2, 0]])
    transforms = transform.RigidTransform.from_components([[1, 2, 3], [4, 5, 6]], R)
    poses, batch = as_poses(transforms)
    assert batch == (2,)
    np.testing.assert_allclose(poses[:, :3, :3], R.as_matrix(), rtol=0, atol=1e-15)
    np.testing.assert_array_equal(poses[:, :3, 3], [[1, 2, 3], [4, 5, 6]])
    assert as_poses(transforms[0])[1] == ()
    machine = pf.load("stewart")
    near_home = transform.RigidTransform.from_matrix(pf.pose([1, 2, 196], rotvec=[0.05, 0, 0]))
    expected = pf.solve_ik(machine, near_home.as_matrix())
    np.testing.assert_array_equal(pf.solve_ik(machine, near_home).actuators, expected.actuators)


def test_angles_between_orientations_are_exact_where_they_are_tiny() -> None:
    for angle in (1e-14, 1e-7, 1.0, 3.0):
        turned = from_rotvec(np.array([0.6, 0.0, 0.8]) * angle)
        assert angles_between(turned, np.eye(3)) == pytest.approx(angle, rel=1e-2 if angle < 1e-10 else 1e-8)


def test_what_is_square_to_an_axis_of_any_length_are_unit_vectors() -> None:
    for axis in np.random.default_rng(0).normal(size=(20, 3)) * 10.0 ** np.arange(-10, 10)[:, None]:
        across = square_to(axis)
        np.testing.assert_allclose(across @ across.T, np.eye(2), atol=1e-14)
        np.testing.assert_allclose(across @ axis, 0.0, atol=1e-14 * np.linalg.norm(axis))


def test_angles_of_more_than_a_turn_warn_that_degrees_may_be_meant() -> None:
    with pytest.warns(UserWarning, match=r"rpy: an angle of 90 rad is 14.3 turns; .*degrees=True"):
        pf.pose([0, 0, 0], rpy=[0, 90, 0])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pf.pose([0, 0, 0], rpy=[0, 90, 0], degrees=True)
        pf.pose([0, 0, 0], rotvec=[0, 0, 2 * np.pi])
