"""Limits are kept in all joints of an answer, and what is not reached has a reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pfabrik as pf
from checks import INTERPRETED
from machines import EVERY, machine
from oracles import any_values, targets_about
from pfabrik import Mechanism, Solution, Status
from pfabrik.files import loads
from pfabrik.motion.displacements import home_coordinates

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

FOUR_LEGS = """
schema = 1
name = "four legs, one of them passive"
units = { length = "mm", angle = "deg" }
base = "base"
end_effector = "platform"
reference_point = [0, 0, 120]
task = TASK
joint = [
  { name = "A", TYPE, actuated = true, range = RANGE, connects = ["base", "a"], at = [70, 0, 0], COPIES },
  REST
]
"""
BALL_AND_HINGE = """
  { name = "B", type = "spherical", connects = ["a", "b"], at = [120, 0, 60], COPIES },
  { name = "C", type = "revolute", connects = ["b", "platform"], at = [70, 0, 120], axis = [0, 1, 0], COPIES },
"""
PARALLEL_RODS = "".join(
    f"""
  {{ name = "B{side}", type = "spherical", connects = ["a", "b{side}"], at = [120, {y}, -20], COPIES }},
  {{ name = "C{side}", type = "spherical", CONE connects = ["b{side}", "platform"], at = [40, {y}, 120], COPIES }},
"""
    for side, y in (("L", 15), ("R", -15))
)
CONE = 'cone = { axis = [80, 0, -140], half_angle = 35, fixed_to = "platform" },'
SLOW = ("snake60", "closure.Par4", "closure.H4")
SPARES = {
    "hinges": ('type = "revolute", axis = [0, 1, 0]', "[-60, 60]", '["z", "tilt"]', BALL_AND_HINGE),
    "cranks": (
        'type = "revolute", axis = [0, 1, 0]',
        "[-25, 50]",
        '["x", "y", "z"]',
        PARALLEL_RODS.replace("CONE", ""),
    ),
    "cranks with cones": (
        'type = "revolute", axis = [0, 1, 0]',
        "[-50, 20]",
        '["x", "y", "z"]',
        PARALLEL_RODS.replace("CONE", CONE),
    ),
    "slides": (
        'type = "prismatic", axis = [0, 0, 1]',
        "[-40, 30]",
        '["x", "y", "z"]',
        PARALLEL_RODS.replace("CONE", ""),
    ),
}


def spare(name: str) -> Mechanism:
    """Four legs, of which the last is passive, with the limits of the others."""
    text = FOUR_LEGS
    words = ("TYPE", "RANGE", "TASK", "REST", "COPIES")
    for word, part in zip(words, (*SPARES[name], "copies = { count = 4, axis = [0, 0, 1] }"), strict=True):
        text = text.replace(word, part)
    mechanism = loads(text)
    joints = [replace(joint, actuated=joint.actuated and joint.name != "A4") for joint in mechanism.joints]
    return replace(mechanism, joints=tuple(joints))


def assert_is_its_own_configuration(mechanism: Mechanism, answer: Solution) -> None:
    """What joint coordinates alone say: closed, within all limits, with the margins, points and pose of the answer."""
    answer = answer[np.flatnonzero(answer.status <= Status.PROJECTED)]
    again, length = pf.configuration(mechanism, answer.q), mechanism.characteristic_length
    assert np.all(again.status == Status.REACHED)
    np.testing.assert_allclose(again.pose[:, :3, 3], answer.pose[:, :3, 3], rtol=0, atol=1e-9 * length)
    np.testing.assert_allclose(again.actuators, answer.actuators, rtol=0, atol=1e-9 * length)
    for name, points in answer.points.items():
        np.testing.assert_allclose(points, again.points[name], rtol=0, atol=1e-9 * length)
    for limit, margin in pf.margins(answer).items():
        np.testing.assert_allclose(margin, pf.margins(again)[limit], rtol=0, atol=1e-6)


@pytest.mark.skipif(INTERPRETED, reason="many searches")
@pytest.mark.parametrize("name", [*(pytest.param(name, marks=pytest.mark.campaign) for name in EVERY), *SPARES])
def test_the_joints_of_an_answer_keep_every_limit(name: str) -> None:
    is_spare = name in SPARES
    mechanism, rng, count = spare(name) if is_spare else machine(name), np.random.default_rng(2), 200 if is_spare else 8
    if mechanism.actuator_names:
        assert_is_its_own_configuration(mechanism, pf.solve_fk(mechanism, any_values(mechanism, count)))
    for shift, turn in ((0.2, 0.3), (1.5, 1.0)):
        targets = targets_about(mechanism, rng, count, shift, turn)
        targets = targets[:, :3, 3] if mechanism.end_effector_is_joint else targets
        assert_is_its_own_configuration(mechanism, pf.solve_ik(mechanism, targets))
        assert_is_its_own_configuration(mechanism, pf.track(mechanism, targets[:4]))


def test_forward_kinematics_gives_the_distance_from_the_values_asked_for() -> None:
    asked = np.radians([30.0, -75.0])
    answer = pf.solve_fk(pf.load("five_bar"), asked)
    off = np.degrees(np.abs(answer.actuators - asked).max())
    assert answer.reason.startswith(f"actuators up to {off:.3g} deg from the values asked for; ")
    assert answer.active_limits and pf.solve_fk(pf.load("five_bar"), [asked])[0].reason == answer.reason


@pytest.mark.skipif(INTERPRETED, reason="many searches")
@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.campaign] * (n in SLOW)) for n in EVERY])
def test_what_stops_a_machine_has_a_name(name: str) -> None:
    mechanism = machine(name)
    for reach in pf.travel(pf.configuration(mechanism, home_coordinates(mechanism))):
        assert bool(reach.why) is (reach.end is not None)
    targets = targets_about(mechanism, np.random.default_rng(4), 3, 2.0, 1.0)
    for hold in ("orientation", "position", None):
        options = pf.Options(hold=hold)
        for answer in pf.solve_ik(
            mechanism, targets[:, :3, 3] if mechanism.end_effector_is_joint else targets, options=options
        ):
            assert bool(answer.reason) is (answer.status != Status.REACHED)
