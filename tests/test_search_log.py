"""The log of a search: it ends where the answer is, and says why a target is not reached."""

from __future__ import annotations

import numpy as np
import pytest

import pfabrik as pf


@pytest.mark.parametrize("name", ["five_bar", "stewart", "rps", "serial_arm"])
def test_a_target_out_of_reach_is_answered_by_the_nearest_attempt(name: str) -> None:
    machine = pf.load(name)
    target = machine.home_pose.copy()
    target[:3, 3] += 2.0 * machine.characteristic_length
    log = pf.search_log(machine, target)
    answer = pf.solve_ik(machine, target)
    np.testing.assert_array_equal(log.solution.pose, answer.pose)
    assert answer.status == pf.Status.PROJECTED
    distances = [each.distance for each in log.attempts if each.phase == log.answered_by]
    turned = machine.rotation_length * answer.rotation_error
    assert np.nanmin(distances) == pytest.approx(np.hypot(answer.position_error, turned), rel=1e-6)
    assert log.answered_by in str(log) and "seed 1" in str(log)


def test_a_target_within_reach_needs_one_attempt() -> None:
    machine = pf.load("delta")
    log = pf.search_log(machine, machine.home_pose)
    assert [each.ending for each in log.attempts] == ["reached"] and log.blocked_by is None


def test_the_limit_that_blocks_is_named() -> None:
    machine = pf.load("stewart")
    log = pf.search_log(machine, machine.reference_point + np.array([0.0, 0.0, 1000.0]))
    assert log.blocked_by is not None
    joint, bound, beyond = log.blocked_by
    assert f"beyond {joint} max" in log._repr_html_()
    assert bound == "max" and machine.joint(joint).actuated and beyond > 0.0


def test_several_targets_are_refused() -> None:
    machine = pf.load("five_bar")
    with pytest.raises(pf.errors.InvalidArgument, match="a single one"):
        pf.search_log(machine, np.stack([machine.home_pose] * 2))
