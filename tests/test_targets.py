"""Targets given as coordinates of joints that stand in series between base and end effector."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from machines import closure
from pfabrik import Options, Status
from pfabrik.errors import InvalidArgument


@pytest.mark.parametrize("name", ["ankle_ups", "ankle_rss"])
def test_a_joint_takes_the_coordinates_that_were_asked_for(name: str) -> None:
    """A pivot about y and then x: the tilt is theirs, by SciPy's angles, and the answer tells the same coordinates."""
    mechanism = pf.load(name)
    asked = np.array([[(0.2, -0.1), (0.0, 0.0), (-0.15, 0.2)], [(0.1, 0.1), (-0.2, -0.05), (0.05, 0.0)]])
    found = pf.solve_ik(mechanism, {"pivot": asked})
    assert found and found.shape == (2, 3)
    np.testing.assert_allclose(found.joints["pivot"], asked, atol=1e-8)
    turned = Rotation.from_euler("YX", asked.reshape(-1, 2)).as_matrix().reshape(2, 3, 3, 3)
    np.testing.assert_allclose(found.pose[..., :3, :3], turned, atol=1e-8)
    np.testing.assert_array_equal(pf.solve_ik(mechanism, {"pivot": [0.2, -0.1]}).actuators, found.actuators[0, 0])


def test_coordinates_beyond_the_range_are_projected_to_it() -> None:
    mechanism = pf.load("ankle_ups").with_limits(BL=(50.0, 160.0), BR=(50.0, 160.0))
    found = pf.solve_ik(mechanism, {"pivot": (np.radians(45.0), 0.0)})
    assert found.status is Status.PROJECTED
    np.testing.assert_allclose(np.degrees(found.joints["pivot"]), (40.0, 0.0), atol=1e-4)
    assert [(limit.joint, limit.bound) for limit in found.active_limits] == [("pivot", "max")]


def test_one_coordinate_counts_from_where_its_joint_does() -> None:
    """A hinge whose home is 0.3 rad, and a slide told from the platform's side, whose home is 7."""
    hinge, slider = closure.hinge(), closure.slider()
    found = pf.solve_ik(hinge, {"R": [0.5, 1.9]})
    np.testing.assert_allclose(found.actuators[:, 0], [0.5, 1.9], atol=1e-9)
    np.testing.assert_allclose(found.pose[0, :3, :3], Rotation.from_rotvec([0, 0, 0.2]).as_matrix(), atol=1e-9)
    found = pf.solve_ik(slider, {"P": 20.0})
    assert found.shape == () and found.actuators[0] == pytest.approx(20.0, abs=1e-7)


def test_a_path_of_coordinates_is_followed() -> None:
    mechanism = pf.load("ankle_ups")
    path = np.linspace((0.0, 0.0), (0.3, 0.2), 8)
    np.testing.assert_allclose(pf.track(mechanism, {"pivot": path}).joints["pivot"], path, atol=1e-8)
    (kept,) = (mode for mode in pf.working_modes(mechanism, {"pivot": path[3]}) if mode)
    np.testing.assert_allclose(kept.joints["pivot"], path[3], atol=1e-6)


def test_hinges_in_series_take_the_coordinates_that_were_asked_for() -> None:
    """Two hinges whose axes miss each other: named in any order, in shapes that broadcast."""
    mechanism, pitch, roll = pf.load("g1_ankle"), np.linspace(-0.4, 0.3, 5)[:, None], np.array([-0.1, 0.0, 0.15])
    found = pf.solve_ik(mechanism, {"roll_joint": roll, "pitch_joint": pitch})
    assert found and found.shape == (5, 3)
    np.testing.assert_allclose(found.joints["pitch_joint"], np.broadcast_to(pitch, (5, 3)), atol=1e-8)
    np.testing.assert_allclose(found.joints["roll_joint"], np.broadcast_to(roll, (5, 3)), atol=1e-8)
    path = {"pitch_joint": pitch[:, 0], "roll_joint": 0.1}
    np.testing.assert_allclose(pf.track(mechanism, path).joints["pitch_joint"], pitch[:, 0], atol=1e-8)
    with pytest.raises(InvalidArgument, match=r"batch shapes .*; expected shapes that agree"):
        pf.solve_ik(mechanism, {"roll_joint": np.zeros(3), "pitch_joint": np.zeros(4)})


def test_coordinates_of_joints_that_are_driven_are_a_target_too() -> None:
    arm = pf.load("panda")
    q = pf.solve_ik(arm, arm.home_pose).q + 0.1
    names = [joint.name for joint in arm.joints if joint.type != "fixed"]
    found = pf.solve_ik(arm, dict(zip(names, q, strict=True)))
    assert found
    np.testing.assert_allclose(found.pose, pf.configuration(arm, q).pose, atol=1e-9)


def test_coordinates_that_are_not_finite_are_no_pose() -> None:
    machine, target = pf.load("ankle_ups"), {"pivot": [(0.1, np.nan), (0.1, 0.0)]}
    with pytest.raises(InvalidArgument, match="target: found a number that is not finite") as caught:
        pf.solve_ik(machine, target)
    assert caught.value.rows == (0,)
    marked = pf.solve_ik(machine, target, options=Options(on_invalid="mark"))
    assert list(marked.status) == [pf.Status.INVALID, pf.Status.REACHED]
