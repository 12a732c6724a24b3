"""A driven cylindrical joint does what a hinge and a slide on one axis do, whichever of the two is driven."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import pfabrik as pf
from checks import INTERPRETED
from machines import closure, ring
from oracles import leg_lengths
from pfabrik import Joint, Mechanism, Status
from pfabrik.cli import main
from pfabrik.errors import InvalidMechanism

N = 3 if INTERPRETED else 20
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def crane() -> Mechanism:
    """A post that turns and lifts, with a trolley on its arm."""
    joints = [
        Joint("post", "cylindrical", ("base", "arm"), (0, 0, 0), Z, actuated=True, range=((-2.9, 2.9), (-50, 400))),
        Joint("trolley", "prismatic", ("arm", "hook"), axis=Y, actuated=True, range=(-200, 150)),
    ]
    return Mechanism("crane", joints, "hook", (0, 300, 200), task=("x", "y", "z"))


def tripteron() -> Mechanism:
    """3-CRR: three guides square to each other, each moving the platform along itself."""
    joints = []
    for leg, (axis, foot, knee, head) in enumerate(
        (
            (X, (0, -150, -20), (0, -90, 60), (0, -30, 0)),
            (Y, (10, 0, -160), (-70, 0, -100), (0, 0, -30)),
            (Z, (-150, 20, 0), (-90, -60, 0), (-30, 0, 0)),
        ),
        1,
    ):
        guide = ("C", foot, axis, {"range": ((-2, 2), (-50, 60))})
        joints += closure.chain(leg, guide, ("R", knee, axis), ("R", head, axis))
    joints = [
        dataclasses.replace(each, actuated=(False, True)) if each.type == "cylindrical" else each for each in joints
    ]
    return Mechanism("3-CRR", joints, "platform", (0, 0, 0), task=("x", "y", "z"))


FEET, HEADS = (
    np.array(ring(100, 0, (20, 100, 140, 220, 260, 340))),
    np.array(ring(60, 180, (50, 70, 170, 190, 290, 310))),
)


def struts() -> Mechanism:
    """6-UCU: rods that may spin in their cylinders."""
    feet, heads = FEET, HEADS
    lines = heads - feet
    across = np.cross(lines, Z)
    axes = [[first.tolist(), second.tolist()] for first, second in zip(across, np.cross(lines, across), strict=True)]
    return Mechanism.from_legs(
        "U-C*-U",
        base=feet,
        via=(feet + heads) / 2.0,
        platform=heads,
        reference_point=(0, 0, 180),
        A={"axes": axes},
        B={"axis": lines, "actuated": (False, True)},
        C={"axes": axes},
    )


def spatial_four_bar(driven: tuple[bool, bool]) -> Mechanism:
    """RCCC, driven by the turn or the slide of its output shaft."""
    joints = [
        Joint("crank", "revolute", ("base", "a"), (0, 0, 0), Z),
        Joint("C1", "cylindrical", ("a", "b"), (40, 0, 10), (1, 0.2, 0.3)),
        Joint("C2", "cylindrical", ("b", "c"), (90, 60, 30), (0.2, 1, 0.4)),
        Joint("shaft", "cylindrical", ("base", "c"), (120, 10, 0), (0.6, -0.3, 1), actuated=driven, home=(0.2, 5.0)),
    ]
    return Mechanism("RCCC", joints, "b", (70, 30, 20), task=("x",))


MACHINES = {
    "crane": crane,
    "tripteron": tripteron,
    "struts": struts,
    "four-bar, turned": lambda: spatial_four_bar((True, False)),
    "four-bar, pushed": lambda: spatial_four_bar((False, True)),
}


def in_two(mechanism: Mechanism) -> Mechanism:
    """The same machine with a hinge and a slide for every cylindrical joint: its coordinates are the same numbers."""
    joints: list[Joint] = []
    for each in mechanism.joints:
        joints += _hinge_and_slide(each) if each.type == "cylindrical" else [each]
    return Mechanism("in two", joints, mechanism.end_effector, mechanism.reference_point, task=mechanism.task)


def _hinge_and_slide(joint: Joint) -> list[Joint]:
    between, (first, second) = f"{joint.name}~", joint.connects
    driven = (joint.actuated,) * 2 if isinstance(joint.actuated, bool) else joint.actuated
    parts = zip(("revolute", "prismatic"), driven, joint.home, joint.range or (None, None), strict=True)  # type: ignore[arg-type]
    bodies = (first, between), (between, second)
    return [
        Joint(f"{joint.name}[{k}]", type_, bodies[k], joint.at, joint.axis, actuated=drives, home=home, range=limits)  # type: ignore[arg-type]
        for k, (type_, drives, home, limits) in enumerate(parts)
    ]


@pytest.fixture(params=MACHINES)
def pair(request: pytest.FixtureRequest) -> tuple[Mechanism, Mechanism]:
    whole = MACHINES[request.param]()
    return whole, in_two(whole)


def values_around_home(mechanism: Mechanism, n: int = N) -> np.ndarray:
    spread = [0.4 if drive.kind == "angle" else 2.0 for drive in mechanism.drives]
    home = [drive.home for drive in mechanism.drives]
    return np.random.default_rng(0).uniform(-1, 1, (n, len(home))) * spread + home


def test_it_is_counted_assembles_and_is_solved_as_two_joints_are(pair: tuple[Mechanism, Mechanism]) -> None:
    whole, two = pair
    assert whole.coordinate_names == two.coordinate_names
    assert whole.actuator_names == two.actuator_names
    assert pf.mobility(whole) == pf.mobility(two)
    values = values_around_home(whole)
    assembled, expected = pf.solve_fk(whole, values), pf.solve_fk(two, values)
    assert (assembled.status == Status.REACHED).sum() > N // 2
    np.testing.assert_array_equal(assembled.status, expected.status)
    reached = assembled.status == Status.REACHED
    np.testing.assert_allclose(assembled.q[reached], expected.q[reached], rtol=0, atol=1e-7)
    np.testing.assert_allclose(assembled.actuators[reached], values[reached], rtol=0, atol=1e-7)
    again = pf.solve_fk(two, values, start=pf.configuration(two, assembled.q))  # measured by what has no such joint
    np.testing.assert_allclose(again.pose[reached], assembled.pose[reached], rtol=0, atol=1e-7)
    targets = assembled.pose[reached]
    answer, other = pf.solve_ik(whole, targets), pf.solve_ik(two, targets)
    assert answer and other
    np.testing.assert_allclose(answer.actuators, other.actuators, rtol=0, atol=1e-6)
    assert np.max(pf.closure_residual(answer)) <= 1e-9 * whole.characteristic_length
    assert (pf.configuration(two, answer.q).status == Status.REACHED).all()


def test_it_is_followed_and_differentiated_as_two_joints_are(pair: tuple[Mechanism, Mechanism]) -> None:
    whole, two = pair
    start = pf.solve_fk(whole, values_around_home(whole)[0])
    steps = np.linspace(0, 1, 12)[:, None]
    targets = pf.solve_fk(whole, start.actuators + steps * (values_around_home(whole)[1] - start.actuators)).pose
    followed = pf.track(whole, targets, start=start)
    other = pf.track(two, targets, start=pf.configuration(two, start.q))
    np.testing.assert_array_equal(followed.status, other.status)
    np.testing.assert_allclose(followed.actuators, other.actuators, rtol=0, atol=1e-6)
    expected = pf.forward_jacobian(pf.configuration(two, start.q))
    np.testing.assert_allclose(pf.forward_jacobian(start), expected, rtol=1e-9, atol=1e-9)


@pytest.mark.skipif(INTERPRETED, reason="the searches take minutes")
def test_its_modes_are_those_of_two_joints(pair: tuple[Mechanism, Mechanism]) -> None:
    whole, two = pair
    if len(whole.drives) == 6:
        pytest.skip("forty assemblies take seconds")
    values = values_around_home(whole)[0]
    if whole.task == ("x",):
        modes = pf.assembly_modes(whole, values), pf.assembly_modes(two, values)
    else:
        target = pf.solve_fk(whole, values).pose
        modes = pf.working_modes(whole, target), pf.working_modes(two, target)
    assert len(modes[0]) == len(modes[1]) >= 1
    for one, other in zip(*modes, strict=True):
        assert one.status is other.status
        np.testing.assert_allclose(one.pose, other.pose, rtol=0, atol=1e-6)
        np.testing.assert_allclose(one.actuators, other.actuators, rtol=0, atol=1e-6)


def test_the_coordinate_that_is_not_driven_is_free_to_move() -> None:
    turned, pushed = (spatial_four_bar(driven) for driven in ((True, False), (False, True)))
    there = pf.solve_fk(turned, [0.5])
    assert there.status is Status.REACHED
    slide = there.joints["shaft"][1]
    assert abs(float(slide) - 5.0) > 0.5
    back = pf.solve_fk(pushed, [float(slide)], start=pf.configuration(pushed, there.q))
    assert float(back.joints["shaft"][0]) == pytest.approx(0.5, abs=1e-9)
    assert float(back.actuators[0]) == pytest.approx(float(slide), abs=1e-9)
    with pytest.raises(pf.errors.InvalidArgument, match=r"expected shape \(\.\.\., 1\): shaft\[1\]"):
        pf.solve_fk(pushed, [0.0, 0.0])
    by_name = pf.solve_fk(turned, {"shaft[0]": 0.5})
    np.testing.assert_array_equal(by_name.q, there.q)


def test_struts_that_may_spin_are_as_long_as_their_feet_and_heads_are_apart() -> None:
    mechanism = struts()
    rng = np.random.default_rng(3)
    poses = pf.pose(rng.uniform(-15, 15, (N, 3)) + [0, 0, 180], rotvec=rng.uniform(-0.2, 0.2, (N, 3)))
    answer = pf.solve_ik(mechanism, poses)
    assert answer
    lengths = leg_lengths(FEET, HEADS - [0, 0, 180], poses) - np.linalg.norm(HEADS - FEET, axis=1)
    np.testing.assert_allclose(answer.actuators, lengths, rtol=0, atol=1e-9)


def test_a_tripteron_goes_as_far_along_each_axis_as_its_guide_is_driven() -> None:
    mechanism = tripteron()
    offsets = np.random.default_rng(4).uniform(-45, 55, (N, 3))
    answer = pf.solve_ik(mechanism, offsets)
    assert answer
    np.testing.assert_allclose(answer.actuators, offsets, rtol=0, atol=1e-7)
    beyond = pf.solve_ik(mechanism, (75.0, 10.0, 0.0))
    assert beyond.position_error == pytest.approx(15.0, abs=1e-6)
    assert [(each.joint, each.bound, each.coordinate) for each in beyond.active_limits] == [("C1.1", "max", 1)]


def test_a_post_at_the_end_of_its_lift_says_so() -> None:
    mechanism = crane()
    answer = pf.solve_ik(mechanism, (100, 250, 700))
    assert answer.status is Status.PROJECTED
    assert answer.position_error == pytest.approx(100.0, abs=1e-6)
    assert [(each.joint, each.bound, each.coordinate, each.limit) for each in answer.active_limits] == [
        ("post", "max", 1, 400.0)
    ]
    track = pf.track(mechanism, [(0, 300, 200), (30, 300, 230)], sample_time=1.0, speed_limits={"post[1]": 20.0})
    assert track.too_fast == [(), ("post[1]",)]


def test_no_joint_is_called_what_a_coordinate_of_another_is() -> None:
    joints = [
        dataclasses.replace(each, name={"trolley": "post[1]"}.get(each.name, each.name)) for each in crane().joints
    ]
    with pytest.raises(InvalidMechanism) as raised:
        Mechanism("crane", joints, "hook", (0, 300, 200))
    (fault,) = raised.value.faults
    assert (fault.place, fault.found) == ("joint[1].name", "'post[1]', the name of a coordinate of joint 'post'")


def test_a_range_of_angles_is_met_by_whole_turns() -> None:
    joints = crane().joints
    over = dataclasses.replace(joints[0], home=(4.0, 0.0), range=((0.5, 7.0), (-50, 400)))
    mechanism = Mechanism("crane", [over, joints[1]], "hook", (0, 300, 200), task=("x", "y", "z"))
    for angle in (0.6, 3.0, 6.9):
        target = pf.solve_fk(mechanism, [angle, 20.0, 10.0])
        assert target.status is Status.REACHED
        answer = pf.solve_ik(mechanism, target.pose)
        assert answer.status is Status.REACHED
        assert np.cos(float(answer.actuators[0]) - angle) == pytest.approx(1.0, abs=1e-12)
        assert 0.5 - 1e-9 <= float(answer.actuators[0]) <= 7.0 + 1e-9


def test_the_command_shows_and_takes_both_coordinates_in_their_units(tmp_path: Path) -> None:
    path, run = str(tmp_path / "crane.toml"), CliRunner().invoke
    pf.save(crane(), path)
    assert json.loads(run(main, ["info", path, "--json"]).output)["actuators"] == ["post[0]", "post[1]", "trolley"]
    found = json.loads(run(main, ["fk", path, "30", "50", "20", "--json"]).output)
    np.testing.assert_allclose(found["actuators"][:2], [np.radians(30), 50])
    np.testing.assert_allclose(np.array(found["pose"])[:3, 3], [-160, 320 * np.cos(np.radians(30)), 250])
    solved = run(main, ["ik", path, "--position", "-160", "277.128129211", "250"])
    rows = {cells[0]: cells[1:] for cells in map(str.split, solved.output.splitlines()) if cells}
    assert (rows["post[0]"][0], rows["post[0]"][-1]) == ("30", "deg")
    assert (rows["post[1]"][0], rows["post[1]"][-1]) == ("50", "mm")
