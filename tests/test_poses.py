"""Poses from every description of a rotation, against SciPy, and targets of every accepted form."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
from scipy.spatial import transform
from scipy.spatial.transform import Rotation

import pfabrik as pf
from pfabrik.common.rotations import angles_between, from_rotvec, square_to
from pfabrik.errors import InvalidArgument
from pfabrik.machine.poses import as_poses, is_rotation

ANGLES = [0.0, 1e-300, 1e-16, 1e-12, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 0.1, 1.0, 3.0, np.pi, 4.0, 100.0]
LAST = (0, 0, 0, 1)


# --- rotations -------------------------------------------------------------------------------------------------------


@pytest.mark.filterwarnings("ignore:.*were degrees meant")
@pytest.mark.parametrize("angle", ANGLES)
def test_rotation_vectors_are_exact_at_every_angle(angle: float) -> None:
    """The antisymmetric part is compared relative to the angle, so that no branch may lose digits."""
    for axis in np.random.default_rng(1).normal(size=(20, 3)):
        axis /= np.linalg.norm(axis)
        R, expected = pf.pose([0, 0, 0], rotvec=angle * axis)[:3, :3], Rotation.from_rotvec(angle * axis).as_matrix()
        np.testing.assert_allclose(R, expected, rtol=0, atol=1e-14 * max(angle, 1))
        sine = np.sin(angle) * np.cross(np.eye(3), axis)
        np.testing.assert_allclose(0.5 * (R - R.T), sine, rtol=0, atol=2e-15 * angle)


@pytest.mark.parametrize("size", [1e-9, 1e-3, 3.0])
def test_roll_pitch_yaw_turn_about_the_fixed_axes_in_this_order(size: float) -> None:
    rpy = size * np.random.default_rng(2).uniform(-1, 1, (50, 3))
    expected = Rotation.from_euler("xyz", rpy).as_matrix()
    np.testing.assert_allclose(pf.pose([1, 2, 3], rpy=rpy)[:, :3, :3], expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize("norm", [1e-200, 1.0, 1e200])
def test_quaternions_of_any_norm_with_the_scalar_where_the_name_says(norm: float) -> None:
    for quaternion in np.random.default_rng(3).normal(size=(50, 4)):
        last = pf.pose([0, 0, 0], quat_xyzw=norm * quaternion)
        first = pf.pose([0, 0, 0], quat_wxyz=norm * np.roll(quaternion, 1))
        np.testing.assert_allclose(last[:3, :3], Rotation.from_quat(quaternion).as_matrix(), rtol=0, atol=1e-14)
        np.testing.assert_array_equal(first, last)


@pytest.mark.parametrize("angle", [1e-9, 1e-6, 1e-3])
def test_tiny_quaternions_keep_their_angle(angle: float) -> None:
    R = pf.pose([0, 0, 0], quat_wxyz=[np.cos(0.5 * angle), np.sin(0.5 * angle), 0, 0])[:3, :3]
    assert R[2, 1] == pytest.approx(np.sin(angle), rel=1e-14)


@pytest.mark.parametrize("deviation, accepted", [(0.4e-6, True), (0.6e-6, False)])
def test_rotation_matrices_are_accepted_up_to_the_stated_deviation(deviation: float, accepted: bool) -> None:
    """R^T R deviates from I by twice the stretch of R, and may by 1e-6."""
    assert is_rotation(Rotation.from_rotvec([1, 2, 3]).as_matrix() * (1 + deviation)) is accepted


def test_angles_between_orientations_are_exact_where_they_are_tiny() -> None:
    for angle in (1e-14, 1e-7, 1.0, 3.0):
        turned = from_rotvec(np.array([0.6, 0.0, 0.8]) * angle)
        assert angles_between(turned, np.eye(3)) == pytest.approx(angle, rel=1e-2 if angle < 1e-10 else 1e-8)


def test_what_is_square_to_an_axis_of_any_length_are_unit_vectors() -> None:
    for axis in np.random.default_rng(0).normal(size=(20, 3)) * 10.0 ** np.arange(-10, 10)[:, None]:
        across = square_to(axis)
        np.testing.assert_allclose(across @ across.T, np.eye(2), atol=1e-14)
        np.testing.assert_allclose(across @ axis, 0.0, atol=1e-14 * np.linalg.norm(axis))


# --- poses -----------------------------------------------------------------------------------------------------------


def test_a_pose_is_position_and_rotation_and_a_last_row_in_an_array_of_its_own() -> None:
    R = Rotation.from_rotvec([0.1, 0.2, 0.3])
    for given in (R, R.as_matrix(), R.as_matrix().tolist()):
        T = pf.pose([1, 2, 3], rotation=given)
        np.testing.assert_array_equal(T, [*np.column_stack([R.as_matrix(), (1, 2, 3)]), LAST])
    pf.pose((1, 2, 3))[0, 0] = 7.0
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
        np.testing.assert_array_equal(T[..., 3, :], np.broadcast_to(LAST, (2, 3, 4)))
    assert pf.pose(positions).shape == (2, 3, 4, 4)
    assert pf.pose((1, 2, 3), rpy=turns).shape == (3, 4, 4)
    assert pf.pose(np.zeros((0, 3)), rpy=(0, 0, 1)).shape == (0, 4, 4)


def test_degrees_are_of_angles_and_of_rotation_vectors_alone() -> None:
    angles = np.array([(10.0, -20.0, 30.0), (170.0, 80.0, -170.0)])
    for name in ("rpy", "rotvec"):
        expected = pf.pose((1, 2, 3), **{name: np.radians(angles)})
        np.testing.assert_array_equal(pf.pose((1, 2, 3), **{name: angles}, degrees=True), expected)
    quaternion = Rotation.from_rotvec(angles[0], degrees=True).as_quat()
    expected = pf.pose((1, 2, 3), quat_xyzw=quaternion)
    np.testing.assert_array_equal(pf.pose((1, 2, 3), quat_xyzw=quaternion, degrees=True), expected)


def test_angles_of_more_than_a_turn_warn_that_degrees_may_be_meant() -> None:
    with pytest.warns(UserWarning, match=r"rpy: an angle of 90 rad is 14.3 turns; .*degrees=True"):
        pf.pose([0, 0, 0], rpy=[0, 90, 0])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pf.pose([0, 0, 0], rpy=[0, 90, 0], degrees=True)
        pf.pose([0, 0, 0], rotvec=[0, 0, 2 * np.pi])


REFUSED = [
    *({"xyz": value} for value in ([0, 0], [[0, 0]], [0, 0, np.nan], "here")),
    *({"rpy": value} for value in ([0, 0], [0, np.inf, 0])),
    *({"rotvec": value} for value in ([0, 0, 0, 1], [[0], [0, 1]], [1j, 0, 0], [True, False, True])),
    *({"quat_xyzw": value} for value in ([0, 0, 1], [0, 0, 0, 0])),
    {"quat_wxyz": [0, 0, 0, 0]},
    *({"rotation": R} for R in (np.eye(4), np.diag([1, 1, -1]), np.full((3, 3), np.nan), 2 * np.eye(3))),
]


@pytest.mark.parametrize("given", REFUSED)
def test_what_is_no_position_or_rotation_is_refused_by_name(given: dict[str, Any]) -> None:
    with pytest.raises(InvalidArgument) as caught:
        pf.pose(**{"xyz": [0, 0, 0]} | given)
    assert [caught.value.argument] == list(given)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"rpy": [0, 0, 0], "quat_xyzw": LAST}, "rpy and quat_xyzw"),
        (
            {"xyz": np.zeros((2, 3)), "rpy": np.zeros((3, 3))},
            r"xyz: found shape \(2, 3\) beside rotations of batch shape \(3,\)",
        ),
    ],
)
def test_what_does_not_go_together_is_named(given: dict[str, Any], told: str) -> None:
    with pytest.raises(InvalidArgument, match=told):
        pf.pose(**{"xyz": [0, 0, 0]} | given)


# --- targets ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "shape", [(4, 4), (5, 4, 4), (2, 3, 4, 4), (0, 4, 4), (3,), (4, 3), (3, 3)], ids=lambda shape: str(shape)
)
def test_targets_are_flattened_and_their_batch_shape_kept(shape: tuple[int, ...]) -> None:
    given = np.random.default_rng(4).normal(size=shape)
    poses, batch = as_poses(given)
    are_positions = shape[-1] == 3
    assert batch == (shape[:-1] if are_positions else shape[:-2])
    assert poses.dtype == np.float64 and poses.flags.c_contiguous
    expected = pf.pose(given.reshape(-1, 3)) if are_positions else given.reshape(-1, 4, 4)
    np.testing.assert_array_equal(poses, expected)


@pytest.mark.parametrize("given", [*map(np.zeros, [(), (4,), (3, 4), (4, 3, 4), (2,), (0,)]), Rotation.identity()])
def test_other_shapes_are_no_targets(given: Any) -> None:
    """Nor is a rotation alone, whose matrix would pass for three positions."""
    with pytest.raises(InvalidArgument, match="target"):
        as_poses(given)


@pytest.mark.skipif(not hasattr(transform, "RigidTransform"), reason="SciPy before 1.16")
def test_rigid_transforms_are_targets() -> None:
    expected = pf.pose([[1, 2, 196], [4, 5, 190]], rotvec=[[0.05, 0, 0], [0, 0.02, 0]])
    transforms, machine = transform.RigidTransform.from_matrix(expected), pf.load("stewart")
    poses, batch = as_poses(transforms)
    assert batch == (2,) and as_poses(transforms[0])[1] == ()
    np.testing.assert_allclose(poses, expected, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(pf.solve_ik(machine, transforms).actuators, pf.solve_ik(machine, poses).actuators)
