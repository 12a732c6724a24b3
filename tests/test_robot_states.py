"""Configurations as states of the robot that a mechanism was read from, with MuJoCo's kinematics as the referee."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import mujoco
import numpy as np
import pytest

import pfabrik as pf
from machines import ring
from pfabrik.errors import InvalidArgument, UnknownName
from pfabrik.exchange.interop import from_mjcf, qpos, verify

ROBOT = """
<mujoco model="walker">
  <compiler angle="radian"/>
  <worldbody>
    <body name="torso" pos="0 0 1"><freejoint name="floating"/><geom size="0.1"/>
      <body name="shin" pos="0.02 0.1 -0.4">
        <joint name="knee" axis="0 1 0" range="-2 2"/><geom size="0.03"/>
        <body name="crank_l" pos="0 0.04 -0.1"><joint name="motor_l" axis="0 1 0" range="-1 1"/><geom size="0.01"/>
          <body name="rod_l" pos="-0.05 0 0"><joint name="knuckle_l" type="ball"/><geom size="0.01"/>
            <site name="end_l" pos="0 0 -0.2"/></body></body>
        <body name="crank_r" pos="0 -0.04 -0.1"><joint name="motor_r" axis="0 1 0" range="-1 1"/><geom size="0.01"/>
          <body name="rod_r" pos="-0.05 0 0"><joint name="knuckle_r" type="ball"/><geom size="0.01"/>
            <site name="end_r" pos="0 0 -0.2"/></body></body>
        <body name="foot" pos="0 0 -0.3"><joint name="pitch" axis="0 1 0" range="-0.6 0.6"/>
          <joint name="roll" axis="1 0 0" range="-0.4 0.4"/><geom size="0.02"/>
          <site name="heel_l" pos="-0.05 0.04 0"/><site name="heel_r" pos="-0.05 -0.04 0"/>
          <body name="toe" pos="0.1 0 0"><joint name="toe" axis="0 1 0"/><geom size="0.01"/></body></body>
        <body name="lid" pos="0.05 0 -0.1"><joint name="lid" axis="0 0 1"/><geom size="0.01"/></body>
      </body>
      <body name="arm" pos="0 -0.2 0"><joint name="shoulder" type="ball"/><geom size="0.03"/></body>
    </body>
  </worldbody>
  <equality>
    <connect name="left" site1="end_l" site2="heel_l"/>
    <connect name="right" site1="end_r" site2="heel_r"/>
    <joint name="toes" joint1="toe" joint2="pitch" polycoef="0.05 -0.5 0.3 0 0"/>
  </equality>
  <actuator><motor joint="motor_l"/><motor joint="motor_r"/><motor joint="knee"/></actuator>
  <keyframe><key name="sat" qpos="1 2 0.5 0.6 0 0.8 0  0.7  0 1 0 0 0  0 1 0 0 0  0 0  0.3 0.4  0.8 0.6 0 0"/>
  </keyframe>
</mujoco>
"""
"""An ankle with rods between balls in a robot that floats: a toe that follows, a lid and an arm that are its own."""

LOOPS = ("left", "right")


@cache
def machine_of(text: str = ROBOT, **how: Any) -> pf.Mechanism:
    return from_mjcf(text, base="shin", end_effector="foot", actuated=("motor_l", "motor_r"), **how).mechanism


@cache
def samples(machine: pf.Mechanism, n: int = 5) -> tuple[np.ndarray, pf.Solution]:
    pitch_and_roll = np.random.default_rng(1).uniform(-0.25, 0.25, (n, 2))
    answers = pf.actuation(machine, joints="pitch+roll").to_actuators(pitch_and_roll).solution
    assert answers
    return pitch_and_roll, answers


def compiled(text: str = ROBOT) -> tuple[Any, Any]:
    model = mujoco.MjModel.from_xml_string(text)
    return model, mujoco.MjData(model)


def gaps(model: Any, data: Any, states: np.ndarray) -> float:
    """The largest distance of the sites that are to meet, by MuJoCo's forward kinematics alone [m]."""
    largest = 0.0
    for state in states:
        data.qpos[:] = state
        mujoco.mj_kinematics(model, data)
        for side in "lr":
            apart = data.site(f"end_{side}").xpos - data.site(f"heel_{side}").xpos
            largest = max(largest, float(np.linalg.norm(apart)))
    return largest


@pytest.mark.parametrize("unit", ["m", "mm"])
def test_states_of_the_robot_are_closed_and_all_else_is_as_it_was(unit: str) -> None:
    (model, data), machine = compiled(), machine_of(length_unit=unit)
    wanted, answers = samples(machine)
    states = qpos(answers, model)
    assert states.shape == (5, model.nq) and gaps(model, data, states) < 1e-9
    place = {name: int(model.joint(name).qposadr[0]) for name in ("pitch", "roll", "toe", "motor_l", "motor_r")}
    np.testing.assert_allclose(states[:, [place["pitch"], place["roll"]]], wanted, atol=1e-12)
    np.testing.assert_allclose(states[:, [place["motor_l"], place["motor_r"]]], answers.actuators, atol=1e-15)
    pitch = states[:, place["pitch"]]
    np.testing.assert_allclose(states[:, place["toe"]], 0.05 - 0.5 * pitch + 0.3 * pitch**2, atol=1e-15)
    ours = [*place.values(), *(int(model.joint(f"knuckle_{side}").qposadr[0]) + k for side in "lr" for k in range(4))]
    others = np.setdiff1d(np.arange(model.nq), ours)
    np.testing.assert_array_equal(states[:, others], np.broadcast_to(model.qpos0[others], (5, len(others))))
    np.testing.assert_array_equal(qpos(answers[3], model), states[3])
    sample = pf.actuation(machine, joints="pitch+roll").sample(30, seed=2, model=model)
    assert sample.qpos.shape == (30, model.nq) and gaps(model, data, sample.qpos) < 1e-9


def test_other_joints_are_as_they_are_given(tmp_path: Any) -> None:
    (model, data), machine = compiled(), machine_of()
    _, answers = samples(machine)
    given = model.key("sat").qpos
    (tmp_path / "robot.xml").write_text(ROBOT)
    states = qpos(answers, tmp_path / "robot.xml", qpos=given)
    assert gaps(model, data, states) < 1e-9
    np.testing.assert_array_equal(states[:, :8], np.broadcast_to(given[:8], (5, 8)))
    each = np.tile(given, (5, 1))
    each[:, 7] = np.linspace(-1.0, 1.0, 5)
    assert (qpos(answers, ROBOT, qpos=each)[:, 7] == each[:, 7]).all()


def test_balls_turn_as_the_mechanism_s_do_with_no_equality_to_close_them() -> None:
    """Loops by sites alone: MuJoCo has no row to close, so it is the quaternions that have to."""
    text = re.sub(r'<connect name="(left|right)".*/>', "", ROBOT).replace(
        'name="rod_l" pos="-0.05 0 0"', 'name="rod_l" pos="-0.05 0 0" quat="0.6 0 0 0.8"'
    )
    for number, end in ((1, "end"), (2, "heel")):
        text = re.sub(rf'<site name="{end}_(.)" (.*?)/>', rf'<site name="closing_\1_{number}" \2/>\g<0>', text)
    (model, data), machine = compiled(text), machine_of(text)
    _, answers = samples(machine)
    assert gaps(model, data, qpos(answers, model, qpos=model.key("sat").qpos)) < 1e-9


def text_of(values: np.ndarray) -> str:
    return " ".join(map(repr, values.tolist()))


def test_a_free_joint_in_the_mechanism_is_its_place_and_turn() -> None:
    """A plate that floats in the file, held by six rods, each driven where it stands."""
    feet = ring(1.0, 0.0, [10, 110, 130, 230, 250, 350])
    tops = ring(0.5, 1.0, [50, 70, 170, 190, 290, 310])
    legs, sites, closing, motors = "", "", "", ""
    for k, (foot, top) in enumerate(zip(np.array(feet, float), np.array(tops, float), strict=True)):
        axis = (top - foot) / np.linalg.norm(top - foot)
        legs += (
            f'<body name="leg{k}" pos="{text_of(foot)}"><joint name="U{k}" type="ball"/><geom size="0.01"/>'
            f'<body name="rod{k}"><joint name="P{k}" type="slide" axis="{text_of(axis)}" range="-0.5 0.5"/>'
            f'<geom size="0.01"/><site name="top{k}" pos="{text_of(top - foot)}"/></body></body>'
        )
        sites += f'<site name="at{k}" pos="{text_of(top - [0, 0, 1])}"/>'
        closing += f'<connect name="S{k}" site1="top{k}" site2="at{k}"/>'
        motors += f'<motor joint="P{k}"/>'
    text = (
        f'<mujoco><worldbody>{legs}<body name="plate" pos="0 0 1"><freejoint name="float"/><geom size="0.1"/>{sites}'
        f"</body></worldbody><equality>{closing}</equality><actuator>{motors}</actuator></mujoco>"
    )
    pose = pf.pose([30.0, -20.0, 1040.0], rpy=[5, -4, 8], degrees=True)
    answer = pf.solve_ik(from_mjcf(text, end_effector="plate", length_unit="mm").mechanism, pose)
    assert answer
    model, data = compiled(text)
    data.qpos[:] = qpos(answer, model)
    mujoco.mj_kinematics(model, data)
    for k in range(6):
        assert np.linalg.norm(data.site(f"top{k}").xpos - data.site(f"at{k}").xpos) < 1e-9
    np.testing.assert_allclose(data.body("plate").xpos, pose[:3, 3] * 1e-3, atol=1e-9)
    np.testing.assert_allclose(data.body("plate").xmat.reshape(3, 3), pose[:3, :3], atol=1e-9)


def test_loops_that_are_not_the_mechanism_s_do_not_hold_it_in_its_original(tmp_path: Any) -> None:
    """The ankle without its rods, whose loops are closed at home: the robot would not move with them."""
    (tmp_path / "robot.xml").write_text(ROBOT)
    ankle = from_mjcf(ROBOT, base="shin", end_effector="foot", actuated=["pitch", "roll"], leave_out=LOOPS).mechanism
    against = verify(ankle, poses=3, original=tmp_path / "robot.xml").original
    assert against and max(against.position_tolerance, against.rotation_tolerance) <= 1e-8


RENAMED = ROBOT.replace('"pitch"', '"p"').replace('"roll"', '"r"').replace('"knuckle_l"', '"k"')
LONGER = ROBOT.replace('name="end_l" pos="0 0 -0.2"', 'name="end_l" pos="0 0 -0.9"')


@pytest.mark.parametrize(
    ("model", "others", "error", "said"),
    [
        (ROBOT.replace("motor_l", "drive_l"), None, UnknownName, "no actuator in the model named 'motor_l'"),
        (RENAMED, None, UnknownName, r"no joint in the model named '(pitch|roll|knuckle_l)"),
        (LONGER, None, InvalidArgument, r"row 0: a loop that stays open by 0\.\d+ \(left\)"),
        (ROBOT, np.zeros(3), InvalidArgument, "qpos: found shape"),
        (ROBOT, np.full(26, np.nan), InvalidArgument, "qpos: found a value that is not finite"),
        (3, None, InvalidArgument, "model: found int"),
    ],
)
def test_what_cannot_be_known_is_an_error_by_name(model: Any, others: Any, error: type, said: str) -> None:
    with pytest.raises(error, match=said):
        qpos(samples(machine_of())[1], model, qpos=others)
