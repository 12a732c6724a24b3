"""Margins: how far a configuration is from each limit, by the description alone."""

from __future__ import annotations

import numpy as np
import pytest

import pfabrik as pf
from pfabrik import Joint, Mechanism, Options, Status
from pfabrik.errors import InvalidArgument

EXACT = 1e-9
"""Answers keep their limits to this; half angles and half ranges here are not much smaller than one."""


def test_every_limit_has_one_margin() -> None:
    for name in ("five_bar", "stewart", "nrpm", "delta"):
        machine = pf.load(name)
        expected = {(joint.name, bound) for joint in machine.joints if joint.range for bound in ("min", "max")}
        expected |= {(joint.name, "cone") for joint in machine.joints if joint.cone}
        home = pf.solve_ik(machine, machine.home_pose)
        assert set(pf.margins(home)) == expected


def test_margins_of_a_hexapod_are_shares_of_half_its_stroke_and_of_its_cones() -> None:
    machine = pf.load("stewart")
    target = pf.pose((12.0, -7.0, 205.0), rpy=(0.1, 0.05, -0.1))
    found = pf.margins(pf.solve_ik(machine, target))
    for strut in (joint for joint in machine.joints if joint.along):
        foot, head = (machine.joint(name) for name in strut.along)
        line = target[:3, 3] + target[:3, :3] @ np.subtract(head.at, machine.reference_point) - foot.at
        length, (low, high) = np.linalg.norm(line), strut.range
        assert found[strut.name, "min"] == pytest.approx((length - low) / ((high - low) / 2), abs=EXACT)
        assert found[strut.name, "max"] == pytest.approx((high - length) / ((high - low) / 2), abs=EXACT)
        for joint, axis, way in (
            (foot, np.array(foot.cone.axis), line),
            (head, target[:3, :3] @ head.cone.axis, -line),
        ):
            angle = np.arccos(axis @ way / np.linalg.norm(axis) / length)
            assert found[joint.name, "cone"] == pytest.approx(1.0 - angle / joint.cone.half_angle, abs=1e-7)


def test_margins_are_negative_beyond_a_limit() -> None:
    machine = pf.load("five_bar")
    (exceeded, *_) = [mode for mode in pf.working_modes(machine, (0, 10, 180)) if mode.status == Status.EXCEEDED]
    found = pf.margins(exceeded)
    beyond = {(limit.joint, limit.bound) for limit in exceeded.active_limits}
    assert beyond == {limit for limit, margin in found.items() if margin < 0.0}


def slide(low: float, high: float, home: float = 0.0) -> Mechanism:
    """A slide along x, beside a hinge that nothing limits."""
    joints = [
        Joint("X", "prismatic", ("base", "cart"), axis=(1, 0, 0), actuated=True, range=(low, high), home=home),
        Joint("C", "revolute", ("cart", "tool"), at=(0, 0, 20), axis=(0, 0, 1), actuated=True),
        Joint("tip", "revolute", ("tool", "end"), at=(10, 0, 20), axis=(0, 0, 1)),
    ]
    return Mechanism("slide", joints, "tip")


@pytest.mark.parametrize(("low", "high", "margins"), [(4.0, 12.0, (0.5, 1.5)), (6.0, 6.0, (0.0, 0.0))])
def test_margins_count_from_where_the_joint_does(low: float, high: float, margins: tuple[float, float]) -> None:
    """On a range without room they are 0."""
    machine = slide(low, high, home=6.0)
    found = pf.margins(pf.solve_ik(machine, machine.reference_point))
    assert (found["X", "min"], found["X", "max"]) == pytest.approx(margins)


@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
def test_of_two_ranges_of_a_joint_the_nearer_counts() -> None:
    joints = [
        Joint("X", "prismatic", ("base", "cart"), axis=(1, 0, 0), actuated=True, range=(-50, 50)),
        Joint("C", "cylindrical", ("cart", "tool"), at=(0, 0, 9), axis=(0, 0, 1), range=((-0.5, 0.5), (-5, 5))),
    ]
    machine = Mechanism("plotter", joints, "tool", (0, 0, 30))
    lifted = pf.margins(pf.solve_ik(machine, pf.pose((0, 0, 34), rpy=(0, 0, 0.1))))
    turned = pf.margins(pf.solve_ik(machine, pf.pose((0, 0, 31), rpy=(0, 0, -0.4))))
    assert (lifted["C", "max"], lifted["C", "min"]) == (pytest.approx(0.2), pytest.approx(1.2))
    assert (turned["C", "min"], turned["C", "max"]) == (pytest.approx(0.2), pytest.approx(0.8))


def test_margins_have_the_shape_of_the_answers() -> None:
    machine = pf.load("stewart")
    targets = np.add(machine.reference_point, np.zeros((2, 3, 3)))
    targets[1, 2, 0] = np.nan
    answers = pf.solve_ik(machine, targets, options=Options(on_invalid="mark"))
    for margin in pf.margins(answers).values():
        assert margin.shape == (2, 3)
        assert np.isnan(margin[1, 2]) and np.isfinite(np.delete(margin.ravel(), 5)).all()
    assert all(isinstance(margin, float) for margin in pf.margins(answers[0, 0]).values())


def test_margins_are_of_a_solution_and_of_its_own_mechanism() -> None:
    """To measure against other limits: the same joint vector as a configuration of a machine that has them."""
    machine = pf.load("five_bar")
    home = pf.solve_ik(machine, machine.reference_point)
    for wrong in (home.pose, None, machine):
        with pytest.raises(InvalidArgument, match=r"solution: .*expected a Solution"):
            pf.margins(wrong)  # type: ignore[arg-type]
    off = home.actuators[0] + 0.3
    wider = machine.with_limits(p1=(off - 0.3 - 1.5, off + 1.5))
    found = pf.margins(pf.configuration(wider, home.q))
    assert (found["p1", "min"], found["p1", "max"]) == (pytest.approx(1.5 / 1.65), pytest.approx(1.8 / 1.65))
