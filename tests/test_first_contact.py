"""What people try first: bodies that lead nowhere, driven joints of two freedoms, odd numbers, odd homes."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import pfabrik as pf
from command import pfabrik
from machines import closure, five_bar
from pfabrik import Joint, Mechanism, Status
from pfabrik.errors import InvalidMechanism

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def with_fingers(left: str = "finger_l", right: str = "finger_r") -> Mechanism:
    """A SCARA whose tool has two fingers, one of them driven, that nothing else connects."""
    joints = [
        *closure.scara().joints,
        Joint("G", "revolute", ("tool", left), at=(340, 50, 0), axis=Y, actuated=True, range=(-0.5, 0.6)),
        Joint("H", "prismatic", (right, "tool"), axis=X, range=(-5, 8)),
    ]
    return Mechanism("SCARA with a gripper", joints, "tool", (350, 50, 0), task=("x", "y", "z", "yaw"))


def faults_of(mechanism: object) -> dict[str, str]:
    with pytest.raises(InvalidMechanism) as raised:
        mechanism()  # type: ignore[operator]
    return {fault.place: fault.found for fault in raised.value.faults}


@pytest.mark.parametrize("names", [("finger_l", "finger_r"), ("finger1", "finger2"), ("thumb", "index")])
def test_a_finger_rests_where_the_start_has_it_and_goes_where_it_is_driven(names: tuple[str, str]) -> None:
    mechanism = with_fingers(*names)
    plain = closure.scara()
    targets = pf.solve_fk(plain, np.random.default_rng(0).uniform(0, 1, (20, 4)) * [2, 2, 40, 2]).pose
    start = np.zeros(6)
    start[4:] = 0.3, -2.0
    answer = pf.solve_ik(mechanism, targets, start=start)
    assert answer
    np.testing.assert_array_equal(answer.joints["G"], 0.3)
    np.testing.assert_array_equal(answer.joints["H"], -2.0)
    away = pf.solve_ik(
        mechanism, targets + 500.0 * np.eye(4)[:, 3] * np.array([[0.0], [0.0], [1.0], [0.0]]), start=start
    )
    assert (away.status == Status.PROJECTED).all()
    np.testing.assert_array_equal(away.joints["G"], 0.3)
    driven = pf.solve_fk(mechanism, [*answer.actuators[0][:4], -0.4])
    assert driven.status is Status.REACHED
    assert float(driven.joints["G"]) == pytest.approx(-0.4, abs=1e-12)
    np.testing.assert_allclose(driven.pose, targets[0], rtol=0, atol=1e-6)
    beyond = pf.configuration(mechanism, [0, 0, 0, 0, 0.7, 0])
    assert [limit.joint for limit in beyond.active_limits] == ["G"]


def test_a_body_that_is_nearly_another_is_taken_for_a_slip() -> None:
    def with_rod(name: str) -> Mechanism:
        joints = [
            Joint("A", "revolute", ("base", "forearm"), at=(0, 0, 0), axis=Z, actuated=True),
            Joint("B", "revolute", ("forearm", "platform"), at=(100, 0, 0), axis=Z, actuated=True),
            Joint("C", "revolute", ("base", "rod"), at=(0, 50, 0), axis=Z),
            Joint("D", "revolute", ("rod", name), at=(100, 50, 0), axis=Z),
        ]
        return Mechanism("loop", joints, "platform", (100, 0, 0))

    for slip in ("platfrom", "platfom", "plattform", "Platform", "paltform"):
        found = faults_of(lambda slip=slip: with_rod(slip))
        assert found == {"joint[3].connects": f"'{slip}', which no other joint connects; did you mean 'platform'?"}
    for leaf in ("finger", "flag", "plate", "tip", "coupler"):
        assert with_rod(leaf).bodies[-1] == leaf


@pytest.mark.usefixtures("folder")
def test_a_leaf_is_noted_by_check() -> None:
    pf.save(with_fingers(), "gripper.toml")
    result = pfabrik("check gripper.toml")
    assert result.exit_code == 0
    assert "note: nothing but joint 'G' connects 'finger_l'" in result.stderr


@pytest.mark.parametrize("elbows", [((25, 40), (75, 40)), ((20, 32), (75, 40))])
def test_a_five_bar_stretched_out_at_home_is_not_said_to_be_stuck(elbows) -> None:  # type: ignore[no-untyped-def]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mechanism = five_bar([(0, 0), (100, 0)], elbows, (50, 80))
    assert pf.mobility(mechanism).platform == 2
    assert pf.solve_ik(mechanism, [50, 70, 0])


@pytest.mark.parametrize("spins", [False, True])
def test_what_cannot_move_is_said_to_be_stuck(spins: bool) -> None:
    ball = "spherical" if spins else "revolute"
    axis = {} if spins else {"axis": Z}
    turns = np.radians([0, 20, 120, 140, 240, 260] if spins else [0, 120, 240])
    heads = np.radians([310, 70, 70, 190, 190, 310] if spins else [20, 130, 260])
    joints = []
    for k, (foot, head) in enumerate(zip(turns, heads, strict=True)):
        at, to = (100 * np.cos(foot), 100 * np.sin(foot), 0), (60 * np.cos(head), 60 * np.sin(head), 80 * spins)
        joints += [
            Joint(f"A{k}", ball, ("base", f"rod{k}"), at=at, actuated=not spins, **axis),
            Joint(f"B{k}", ball, (f"rod{k}", "plate"), at=to, **axis),
        ]
    if spins:
        joints.append(Joint("D", "revolute", ("plate", "tool"), at=(0, 0, 90), axis=Z, actuated=True))
    with pytest.warns(pf.errors.MobilityWarning, match="it cannot move"):
        Mechanism("frame", joints, "plate", (0, 0, 80))


def two_links(offset: float, size: float = 100.0, **more: object) -> Mechanism:
    at = np.array([offset, -offset, 0.0])
    joints = [
        Joint("A", "revolute", ("base", "a"), at=at, axis=Z, actuated=True, **more),  # type: ignore[arg-type]
        Joint("B", "revolute", ("a", "b"), at=at + [size, 0, 0], axis=Z, actuated=True),
    ]
    return Mechanism("2R", joints, "b", at + [1.5 * size, 0.5 * size, 0])


@pytest.mark.parametrize("offset", [0.0, 1e3, 1e5, 3e7])
def test_a_machine_far_from_the_origin_is_exact_and_no_motion_of_it_is_doubted(offset: float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mechanism = two_links(offset)
        five = pf.load("five_bar")
        shift = np.array([offset, offset, 0.0])
        joints = [pf.Joint(**(vars(each) | {"at": np.array(each.at) + shift})) for each in five.joints]  # type: ignore[arg-type]
        moved = Mechanism("5-bar", joints, five.end_effector)
    answer = pf.solve_ik(mechanism, pf.solve_fk(mechanism, [0.3, 0.5]).pose)
    assert answer.status is Status.REACHED
    there = pf.solve_ik(moved, np.add(five.reference_point, shift) + [0, 5, 9])
    assert there.status is Status.REACHED
    here = pf.solve_ik(five, np.add(five.reference_point, [0, 5, 9]))
    np.testing.assert_allclose(there.actuators, here.actuators, rtol=0, atol=1e-8 if offset > 1e6 else 1e-9)


@pytest.mark.parametrize("offset", [1e8, 1e9, 5e11])
def test_a_machine_too_far_from_the_origin_to_be_exact_is_refused_and_told_why(offset: float) -> None:
    found = faults_of(lambda: two_links(offset))
    assert len(found) == 1
    assert "times the size of the machine from the origin" in next(iter(found.values()))
    two_links(offset, size=offset / 10)


def test_a_range_of_one_value_locks_its_joint() -> None:
    mechanism = two_links(0.0, range=(0, 0))
    answer = pf.solve_ik(mechanism, [150, 60, 0])
    assert answer.status is Status.PROJECTED
    assert float(answer.joints["A"]) == pytest.approx(0.0, abs=1e-9)
    assert "joint[0].range" in faults_of(lambda: two_links(0.0, range=(0, -1e-3)))


@pytest.mark.parametrize("length", [1e-300, 1e-9, 1.0, 1e13, 1e300])
def test_a_direction_may_have_any_length(length: float) -> None:
    axis = (0.6 * length, 0.0, 0.8 * length)
    hinge = Joint("A", "revolute", ("base", "a"), at=(0, 0, 0), axis=axis, actuated=True)
    np.testing.assert_allclose(hinge.axis, (0.6, 0, 0.8), rtol=0, atol=1e-15)
    assert Mechanism("hinge", [hinge], "a", (1, 0, 0)).home_axis("A") == hinge.axis
    infinite = Joint("A", "revolute", ("base", "a"), at=(0, 0, 0), axis=(0, 0, np.inf), actuated=True)
    assert list(faults_of(lambda: Mechanism("hinge", [infinite], "a", (1, 0, 0)))) == ["joint[0].axis"]
