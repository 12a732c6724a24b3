"""MuJoCo models and robot descriptions as mechanisms: in the styles found in the wild, with what was changed told by
name, against MuJoCo's own kinematics; and files that mean harm."""

from __future__ import annotations

import importlib.util
import json
import re
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from command import pfabrik
from in_mujoco import Model, agrees, mujoco, notes_of
from pfabrik.errors import InvalidArgument, InvalidMechanism, UnknownName
from pfabrik.exchange.interop import (
    Imported,
    Loop,
    NoEndEffector,
    OpenMechanism,
    assemble,
    from_mjcf,
    from_urdf,
    verify,
)

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")


def chains(found: Imported) -> list[str]:
    return sorted(str(chain) for chain in pf.decompose(found.mechanism))


def assert_noted(found: Imported, *parts: str) -> None:
    for part in parts:
        assert part in notes_of(found), part


def refused(read: Callable[[], Imported]) -> InvalidMechanism:
    with pytest.raises(InvalidMechanism) as caught:
        read()
    return caught.value


# A five-bar in a plane, its loop closed between sites; a spring, a tendon, a coupling and a sensor that do not count.

FIVE_BAR = """
<mujoco model="five bar">
  <compiler angle="degree" boundmass="1" boundinertia="1"/>
  <default><joint damping="0.1"/>
    <default class="arm"><joint axis="0 1 0" range="-80 80" limited="true"/></default></default>
  <asset><mesh name="m" file="nowhere.stl"/><material name="red"/></asset>
  <worldbody>
    <light pos="0 0 3"/>
    <body name="frame" pos="0 0 0.1">
      <geom type="mesh" mesh="m"/>
      <body name="left" pos="-0.05 0 0"><joint name="qL" class="arm"/><geom size="0.01"/>
        <body name="fore_left" pos="-0.05 0 0.1"><joint name="eL" axis="0 1 0" stiffness="2"/>
          <site name="tip_left" pos="0.1 0 0.1"/></body></body>
      <body name="right" pos="0.05 0 0"><joint name="qR" class="arm"/>
        <body name="fore_right" pos="0.05 0 0.1"><joint name="eR" axis="0 1 0"/>
          <site name="tip_right" pos="-0.1 0 0.1"/></body></body>
      <body name="gripper" pos="0.3 0 0"><joint name="finger" axis="0 0 1"/></body>
    </body>
  </worldbody>
  <equality>
    <connect name="tip" site1="tip_left" site2="tip_right"/>
    <joint joint1="finger" joint2="qL" polycoef="0 1 0 0 0"/>
  </equality>
  <tendon><spatial name="cable"><site site="tip_left"/><site site="tip_right"/></spatial></tendon>
  <sensor><jointpos joint="qL"/></sensor>
  <actuator><position joint="qL" kp="5"/><motor joint="qR"/><motor name="winch" tendon="cable"/></actuator>
  <keyframe><key name="up" qpos="0.1 0 -0.1 0 0" ctrl="0 0 0"/></keyframe>
</mujoco>
"""


FORE = {"base": "frame", "end_effector": "fore_left", "task": ["x", "z"]}


def test_a_loop_between_sites_is_closed_and_all_that_is_left_out_is_named() -> None:
    found = from_mjcf(FIVE_BAR, **FORE)
    assert found.gap == pytest.approx(0.0, abs=1e-15)
    assert found.mechanism.actuator_names == ("qL", "qR")
    assert found.mechanism.joint("qL").range == pytest.approx(np.radians([-80, 80]))
    assert chains(found) == ["R*-R", "R*-R-S"]
    assert_noted(found, "no shape here are left out: mesh (1)", "anything: material (1), mesh (1)", "cable", "winch")
    assert_noted(found, "eL", "finger = 1 qL", "finger", "jointpos")
    text = FIVE_BAR.replace('<joint joint1="finger" joint2="qL" polycoef="0 1 0 0 0"/>', "")
    text = text.replace('<geom type="mesh" mesh="m"/>', "").replace('<mesh name="m" file="nowhere.stl"/>', "")
    agrees(found, Model.of(text, finger=0.0), "fore_left")
    small = from_mjcf(FIVE_BAR, **FORE, length_unit="mm").mechanism
    assert (small.length_unit, small.joint("tip").at) == ("mm", pytest.approx((0, 0, 300)))


def test_an_end_effector_may_be_a_site_or_the_equality_itself() -> None:
    at_site = from_mjcf(FIVE_BAR, base="frame", end_effector="tip_right").mechanism
    assert (at_site.end_effector, at_site.reference_point) == ("fore_right", pytest.approx((0, 0, 0.3)))
    at_tip = from_mjcf(FIVE_BAR, base="frame", end_effector="tip").mechanism
    assert at_tip.end_effector_is_joint
    assert pf.solve_ik(at_tip, [0.01, 0, 0.29])


def test_home_may_be_a_keyframe_that_is_then_closed() -> None:
    found = from_mjcf(FIVE_BAR, **FORE, configuration="up")
    assert 1e-4 < found.gap < 0.05
    assert [found.mechanism.joint(name).home for name in ("qL", "qR")] == [0.1, -0.1]
    assert pf.closure_residual(pf.solve_fk(found.mechanism, [0.1, -0.1])) <= 1e-12
    assert_noted(found, "loops were open")


@pytest.mark.parametrize(
    ("asked", "error", "said"),
    [
        ({"base": "fram"}, UnknownName, "frame"),
        ({"end_effector": "tipp"}, UnknownName, "tip"),
        ({"actuated": ["qX"]}, UnknownName, "qX"),
        ({"fixed": ["qX"]}, UnknownName, "qX"),
        ({"configuration": "down"}, UnknownName, "known: qpos0, up"),
        ({"end_effector": None}, NoEndEffector, "such as 'fore_left' against 'frame'"),
        ({"actuated": "qL"}, InvalidArgument, "a list of names"),
    ],
)
def test_names_that_do_not_exist_come_with_those_that_do(
    asked: dict[str, Any], error: type[Exception], said: str
) -> None:
    with pytest.raises(error, match=said):
        from_mjcf(FIVE_BAR, **{**FORE, **asked})


# An ankle: two hinges on one body, a connect between bodies, a rod with a ball and a spin of its own, a range off home.

ANKLE = """
<mujoco model="ankle">
  <worldbody>
    <body name="pelvis" pos="0 0 1"><freejoint/>
    <body name="shank" pos="0 0 -0.6"><joint name="knee" axis="0 1 0"/>
      <body name="foot">
        <joint name="pitch" axis="0 1 0" range="-40 40"/><joint name="roll" axis="1 0 0" range="-20 20"/>
        <site name="heel_left" pos="-0.05 0.04 0"/>
      </body>
      <body name="crank_left" pos="0 0.04 0.2"><joint name="motor_left" axis="0 1 0" range="-60 60"/>
        <body name="rod_left" pos="-0.05 0 0"><joint name="ball_left" type="ball" range="0 40"/>
          <body name="clevis" pos="0 0 -0.1"><joint name="spin" axis="0 0 1"/>
            <site name="end_left" pos="0 0 -0.1"/></body></body></body>
      <body name="crank_right" pos="0 -0.04 0.15"><joint name="motor_right" axis="0 1 0" range="5 60"/>
        <body name="rod_right" pos="-0.05 0 0"><joint name="hinge_right" axis="0 1 0"/>
          <joint name="cross_right" axis="1 0 0"/></body></body>
    </body></body>
  </worldbody>
  <equality>
    <connect site1="end_left" site2="heel_left"/>
    <connect name="right" body1="rod_right" body2="foot" anchor="0 0 -0.15"/>
    <connect name="spare" body1="rod_right" body2="foot" anchor="0 0 -0.15" active="false"/>
  </equality>
  <actuator><motor joint="motor_left"/><motor joint="motor_right"/><motor joint="knee"/></actuator>
</mujoco>
"""


BOUND = '<compiler boundmass="1" boundinertia="1"/>'


def test_of_a_whole_leg_the_ankle_alone_is_taken_and_hinges_that_cross_are_universal() -> None:
    found = from_mjcf(ANKLE, base="shank", end_effector="foot", task=["tilt"])
    assert chains(found) == ["R*-S-R-S", "R*-U-S", "U"]
    assert found.mechanism.actuator_names == ("motor_left", "motor_right")
    assert_noted(found, "knee", "ball_left", "pitch+roll", "hinge_right+cross_right", "spare", "motor_right")
    assert found.mechanism.joint("motor_right").home == pytest.approx(np.radians(5))  # the range does not have 0
    assert found.mechanism.joint("pitch+roll").range == pytest.approx(np.radians([[-40, 40], [-20, 20]]))
    model = Model.of(ANKLE.replace("<worldbody>", BOUND + "<worldbody>").replace("<freejoint/>", ""), knee=0.0)
    agrees(found, model, "foot", reach=0.2)
    asked = from_mjcf(ANKLE, base="pelvis", end_effector="foot", actuated=["knee", "motor_left"], fixed=["spin"])
    assert asked.mechanism.actuator_names == ("knee", "motor_left")
    assert "R*-S-S" in " ".join(chains(asked))


# A delta with five closures and a wrist behind its platform.


def delta() -> str:
    arms, equalities = [], []
    for index, angle in enumerate(np.radians([0, 120, 240])):
        degrees = np.degrees(angle)
        rods = ""
        for side, shift in (("a", -0.03), ("b", 0.03)):
            plate = ""
            if (index, side) == (0, "a"):
                plate = PLATE
            else:
                equalities.append(f'<connect name="c{index}{side}" site1="r{index}{side}" site2="p{index}{side}"/>')
            rods += f"""<body name="rod{index}{side}" pos="0.1 {shift} 0"><joint name="b{index}{side}" type="ball"/>
                <site name="r{index}{side}" pos="-0.06 0 -0.2"/>{plate}</body>"""
        arms.append(
            f"""<body euler="0 0 {degrees}"><body name="arm{index}" pos="0.06 0 0">
            <joint name="q{index}" axis="0 1 0" range="-60 60"/>{rods}</body></body>"""
        )
    motors = "".join(f'<position joint="q{index}"/>' for index in range(3))
    return f"""<mujoco model="delta">{BOUND}<worldbody>{"".join(arms)}</worldbody>
        <equality>{"".join(equalities)}</equality><actuator>{motors}<motor joint="wrist"/></actuator></mujoco>"""


PLACES = [
    (index, side, np.round([0.1 * np.cos(a) - s * np.sin(a), 0.1 * np.sin(a) + s * np.cos(a), 0.0], 17))
    for index, a in enumerate(np.radians([0, 120, 240]))
    for side, s in (("a", -0.03), ("b", 0.03))
]
PLATE = (
    '<body name="plate" pos="-0.16 0.03 -0.2"><joint name="plate" type="ball" pos="0.1 -0.03 0"/>'
    + "".join(f'<site name="p{i}{s}" pos="{" ".join(map(repr, at.tolist()))}"/>' for i, s, at in PLACES)
    + '<body name="tool" pos="0 0 -0.02"><joint name="wrist" axis="0 0 1"/></body></body>'
)


def test_a_delta_with_five_closures_and_a_wrist() -> None:
    text = delta()
    found = from_mjcf(text, end_effector="tool", task=["x", "y", "z", "yaw"])
    assert found.gap <= 1e-15
    assert pf.mobility(found.mechanism).platform == 4
    assert found.mechanism.actuator_names == ("q0", "q1", "q2", "wrist")  # as in its actuators
    agrees(found, Model.of(text), "tool")
    plate = from_mjcf(text, end_effector="plate", task=["x", "y", "z"])
    assert_noted(plate, "wrist")
    assert pf.solve_ik(plate.mechanism, np.array(plate.mechanism.reference_point) + [0.02, 0.01, -0.03])


def test_rods_as_free_bodies_that_equalities_hold() -> None:
    """A pendulum of two rods, of which the second is free in the air but for its connects; two make a hinge."""
    text = f"""<mujoco>{BOUND}<worldbody>
        <body name="arm"><joint name="q" axis="0 1 0"/></body>
        <body name="rod" pos="0.2 0 0"><freejoint name="free"/></body></worldbody>
        <equality><connect body1="arm" body2="rod" anchor="0.1 -0.02 0"/>
        <connect body1="arm" body2="rod" anchor="0.1 0.02 0"/></equality>
        <actuator><motor joint="q"/></actuator></mujoco>"""
    found = from_mjcf(text, end_effector="rod", task=["x", "z"])
    assert pf.mobility(found.mechanism).platform == 2
    by_type = [joint.type for joint in found.mechanism.joints]
    assert by_type == ["revolute", "prismatic", "prismatic", "prismatic", "spherical", "revolute"]
    np.testing.assert_allclose(np.abs(found.mechanism.joints[-1].axis), [0, 1, 0], atol=1e-15)


# The robot that thousands own, from the wheel that its maker publishes.


def reachy(*parts: str) -> Path:
    spec = importlib.util.find_spec("reachy_mini")
    if spec is None or not spec.submodule_search_locations:
        pytest.skip("reachy-mini is not installed: pip install --no-deps reachy-mini")
    return Path(spec.submodule_search_locations[0]).joinpath(*parts)


def test_reachy_mini_is_imported_from_its_makers_model_and_agrees_with_mujoco() -> None:
    path = reachy("descriptions", "reachy_mini", "mjcf", "reachy_mini.xml")
    found = from_mjcf(path, base="body_down_3dprint", end_effector="xl_330")
    assert found.gap == pytest.approx(1.2e-7, abs=0.3e-7)
    assert chains(found) == ["R*-S-S"] * 6
    others = dict.fromkeys(("yaw_body", "right_antenna", "left_antenna"), 0.0)
    assert_noted(found, *others, "mesh")
    agrees(found, Model(mujoco.MjModel.from_xml_path(str(path)), others), "xl_330", poses=20)


def test_the_head_answers_exactly_where_its_makers_kinematics_do() -> None:
    kinematics = pytest.importorskip("reachy_mini_rust_kinematics")
    data = json.loads(reachy("assets", "kinematics_data.json").read_text())
    theirs = kinematics.ReachyMiniRustKinematics(data["motor_arm_length"], data["rod_length"])
    for motor in data["motors"]:
        inverse = np.linalg.inv(np.array(motor["T_motor_world"])).tolist()
        theirs.add_branch(motor["branch_position"], inverse, 1 if motor["solution"] else -1)
    mechanism, random = pf.load("reachy_mini").without_limits(), np.random.default_rng(0)
    positions = mechanism.reference_point + random.uniform(-0.04, 0.04, (500, 3))
    targets = pf.pose(positions, rpy=random.uniform(-0.5, 0.5, (500, 3)))
    angles = np.array([theirs.inverse_kinematics(target.tolist()) for target in targets])
    ours = pf.solve_ik(mechanism, targets, options=pf.Options(working_mode="keep"))
    answered = np.isfinite(angles).all(axis=1)
    np.testing.assert_array_equal(np.asarray(ours.status) == pf.Status.REACHED, answered)
    assert 200 < answered.sum() < 400
    apart = np.abs(np.angle(np.exp(1j * (angles - ours.actuators))))[answered]
    assert apart.max() <= 1e-10  # rad


# Robot descriptions.

URDF = """<robot name="five bar">
  <link name="frame"/><link name="l1"/><link name="l2"/><link name="r1"/><link name="r2"/><link name="camera"/>
  <joint name="motor_l" type="revolute"><parent link="frame"/><child link="l1"/>
    <origin xyz="-0.05 0 0" rpy="1.5708 0 0"/>
    <axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <joint name="motor_r" type="revolute"><parent link="frame"/><child link="r1"/>
    <origin xyz="0.05 0 0" rpy="1.5708 0 0"/>
    <axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <joint name="elbow_l" type="continuous"><parent link="l1"/><child link="l2"/><origin xyz="-0.05 0.1 0"/>
    <axis xyz="0 0 1"/></joint>
  <joint name="elbow_r" type="continuous"><parent link="r1"/><child link="r2"/><origin xyz="0.05 0.1 0"/>
    <axis xyz="0 0 1"/></joint>
  <joint name="mount" type="fixed"><parent link="frame"/><child link="camera"/><axis xyz="0 0 0"/></joint>
</robot>"""
TIP_L, TIP_R = (0.1, 0.1, 0.0), (-0.098, 0.1035, 0.0)  # 4 mm apart at zero
PLAIN = {
    "loops": [{"name": "tip", "type": "ball", "links": ["l2", "r2"], "at": [list(TIP_L), list(TIP_R)]}],
    "actuated": ["motor_l", "motor_r"],
}


def in_mujoco(urdf: str, loops: Sequence[tuple[str, str, Sequence[float], Sequence[float]]]) -> Model:
    """The same robot by MuJoCo's own reader of URDF, with its loops as equalities between sites."""
    text = urdf.replace(
        "<link", "<mujoco><compiler fusestatic='false' boundmass='1' boundinertia='1'/></mujoco><link", 1
    )
    spec = mujoco.MjSpec.from_string(text)
    for number, (one, other, first, second) in enumerate(loops):
        for side, (body, at) in enumerate(((one, first), (other, second))):
            spec.body(body).add_site(name=f"s{number}{side}", pos=list(at))
        equality = spec.add_equality(name=f"e{number}", type=mujoco.mjtEq.mjEQ_CONNECT)
        equality.objtype = mujoco.mjtObj.mjOBJ_SITE
        equality.name1, equality.name2 = f"s{number}0", f"s{number}1"
    return Model(spec.compile())


def yaml_file(folder: Path, table: dict) -> Path:
    path = folder / "loops.yaml"
    path.write_text(json.dumps(table))  # which is YAML too
    return path


def test_a_five_bar_open_by_millimetres_at_zero_is_closed_and_agrees_with_mujoco(tmp_path: Path) -> None:
    (tmp_path / "robot.urdf").write_text(URDF)
    found = from_urdf(tmp_path / "robot.urdf", yaml_file(tmp_path, PLAIN), end_effector="l2", task=["x", "z"])
    assert found.gap == pytest.approx(np.hypot(0.002, 0.0035))
    assert_noted(found, "open by 0.00403 m")
    assert pf.mobility(found.mechanism).platform == 2
    for name in ("motor_l", "motor_r"):
        assert found.mechanism.joint(name).home == 0.0  # the passive joints gave way
    agrees(found, in_mujoco(URDF, [("l2", "r2", TIP_L, TIP_R)]), "l2")


def test_axes_that_a_few_digits_put_askew_do_not_lock_a_loop() -> None:
    askew = URDF.replace('rpy="1.5708 0 0"', 'rpy="1.57075 0 0.00004"', 1)
    hinge = {"name": "tip", "type": "hinge", "links": ["l2", "r2"], "at": [list(TIP_L), list(TIP_R)]}
    found = from_urdf(askew, {**PLAIN, "loops": [hinge]}, end_effector="l2", task=["x", "z"])
    assert_noted(found, "made parallel")
    assert pf.mobility(found.mechanism).platform == 2
    assert pf.solve_fk(found.mechanism, [0.2, 0.1])


POST = """<robot name="post"><link name="base"/><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
  <joint name="turn" type="continuous"><parent link="base"/><child link="a"/><axis xyz="1 0 0"/></joint>
  <joint name="C[0]" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" velocity="2" effort="1"/></joint>
  <joint name="C[1]" type="prismatic"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" velocity="0.5" effort="1"/></joint>
  <joint name="last" type="continuous"><parent link="c"/><child link="d"/><axis xyz="0 1 0"/>
    <limit velocity="0" effort="1"/></joint></robot>"""


def test_actuators_come_in_the_order_asked_for_as_fast_as_the_file_says() -> None:
    found = from_urdf(POST, end_effector="d", actuated=["last", "C[0]", "C[1]", "turn"], length_unit="mm").mechanism
    assert found.joint("C").type == "cylindrical"
    assert found.actuator_names == ("last", "C[0]", "C[1]", "turn")
    assert (found.joint("C").max_speed, found.joint("last").max_speed) == ((2.0, 500.0), None)
    passive = from_urdf(POST, end_effector="d", actuated=["C[1]"], length_unit="mm").mechanism
    assert (passive.actuator_names, passive.joint("C").max_speed) == (("C[1]",), 500.0)


def with_frame(urdf: str, name: str, parent: str, at: Sequence[float]) -> str:
    """A frame on a link, as exports have it."""
    joint = f'<joint name="{name}_frame" type="fixed"><parent link="{parent}"/><child link="{name}"/>'
    origin = f'<origin xyz="{" ".join(map(repr, at))}"/></joint>'
    return urdf.replace("</robot>", f'<link name="{name}"/>{joint}{origin}</robot>')


def test_balls_and_frames_that_a_second_file_names(tmp_path: Path) -> None:
    """In the convention of Gepetto's examples: frames by a joint or link, joints that URDF has no word for."""
    framed = with_frame(with_frame(URDF, "left", "l2", TIP_L), "right", "r2", TIP_R)
    gepetto = {
        "closed_loop": [["left_frame", "right"]],
        "type": ["3d"],
        "name_mot": ["motor_l", "motor_r"],
        "joint_name": ["elbow_l"],
        "joint_type": ["SPHERICAL"],
    }
    found = from_urdf(framed, yaml_file(tmp_path, gepetto), end_effector="r2", task=["x", "z"], fixed=[])
    assert found.gap == pytest.approx(np.hypot(0.002, 0.0035))
    assert chains(found) == ["R*-R", "R*-S-S"]
    spherical = URDF.replace('name="elbow_l" type="continuous"', 'name="elbow_l" type="spherical"')  # a ball of MuJoCo
    agrees(found, in_mujoco(spherical, [("l2", "r2", TIP_L, TIP_R)]), "r2", reach=0.2)


def test_an_open_machine_in_python_is_assembled_within_its_ranges() -> None:
    joints = [
        pf.Joint("A", "revolute", ("base", "a"), at=(0, 0, 0), axis=(0, 0, 1), actuated=True),
        pf.Joint("B", "revolute", ("base", "b"), at=(3, 0, 0), axis=(0, 0, 1), range=(0.1, 3)),
        pf.Joint("C", "revolute", ("a", "rod"), at=(1, 0, 0), axis=(0, 0, 1)),
    ]
    points = [[3.5, 0.2, 0], [4.0, 0.0, 0]]
    opened = OpenMechanism("four-bar", tuple(joints), (Loop("D", "spherical", ("rod", "b"), points),), "rod", (1, 0, 0))
    found = assemble(opened)
    assert found.gap == pytest.approx(np.hypot(0.5, 0.2))
    assert found.mechanism.joint("A").home == 0.0
    assert found.mechanism.joint("B").home >= 0.1 - 1e-9
    assert pf.solve_fk(found.mechanism, [0.0])
    with pytest.raises(InvalidArgument, match="points"):
        Loop("D", "spherical", ("rod", "b"), [[0, 0, 0]])


MOVING_FREELY = """<robot name="free"><link name="base"/><link name="table"/><link name="arm"/><link name="rod"/>
    <joint name="planar" type="planar"><parent link="base"/><child link="table"/><axis xyz="0 0.6 0.8"/>
        <origin xyz="0.1 0 0" rpy="0.3 -0.2 0.5"/></joint>
    <joint name="turn" type="continuous"><parent link="table"/><child link="arm"/><axis xyz="0 1 0"/></joint>
    <joint name="floating" type="floating"><parent link="base"/><child link="rod"/><origin rpy="0.2 0 1"/></joint>
    </robot>"""


def test_joints_of_several_freedoms_are_led_to_answers_in_the_original_too(tmp_path: Path) -> None:
    """A table in its plane with an arm, and a rod that floats but for its weld to the arm."""
    (tmp_path / "robot.urdf").write_text(MOVING_FREELY)
    loops = {"loops": [{"type": "weld", "links": ["arm", "rod"], "at": [[0.2, 0, 0], [0, 0, 0]]}]}
    drives = ["planar_x", "planar_y", "planar", "turn"]
    found = from_urdf(tmp_path / "robot.urdf", loops, end_effector="rod", actuated=drives)
    checked = verify(found.mechanism, poses=3, original=tmp_path / "robot.urdf", loops=loops)
    assert checked.poses == 3 and checked.original
    assert checked.original.position_difference <= 1e-9


# What is wrong is told in one go; files that mean harm are refused with a sentence.

DEEP = "<body>" * 5000 + "</body>" * 5000
IN_WORLD = "<mujoco><worldbody>{}</worldbody></mujoco>"
BOMB = '<!DOCTYPE x [<!ENTITY a "ha"><!ENTITY b "&a;&a;">]><mujoco>&b;</mujoco>'
OUTSIDE = '<!DOCTYPE x [<!ENTITY e SYSTEM "file:///etc/passwd">]><robot name="&e;"/>'
MISSPELT = URDF.replace('"continuous"', '"contineous"', 1).replace('<child link="r1"/>', '<child link="r9"/>')
MISTOLD = {"loops": [{"links": ["l2", "r3"], "type": "bal"}, {"links": ["l2"], "at": 3}], "actuated": []}
FAR = {**PLAIN, "loops": [{**PLAIN["loops"][0], "at": [[0.1, 0.1, 0], [-0.1, 3.0, 0]]}]}


@pytest.mark.parametrize(
    ("read", "said"),
    [
        (lambda: from_mjcf(BOMB), ["document type"]),
        (lambda: from_urdf(OUTSIDE), ["document type"]),
        (lambda: from_mjcf(f"<mujoco>{DEEP}</mujoco>"), ["nested too deeply"]),
        (lambda: from_mjcf("<mujoco><worldbody>"), ["no XML"]),
        (lambda: from_mjcf("<mujoco/>\0"), ["no XML"]),
        (lambda: from_mjcf("<robot/>"), ["expected <mujoco>"]),
        (lambda: from_mjcf(IN_WORLD.format("<body pos='a b c'/>")), ["what MuJoCo does not compile"]),
        (
            lambda: from_mjcf(IN_WORLD.format("<replicate count='1000000'><body/></replicate>")),
            ["1000000 bodies"],
        ),
        (lambda: from_mjcf(IN_WORLD.format("<flexcomp name='f' file='x.msh'/>")), ["flexible"]),
        (lambda: from_mjcf("<mujoco><include file='other.xml'/></mujoco>"), ["no folder"]),
        (lambda: from_urdf(MISSPELT.replace('"-0.05 0 0"', '"-0.05 0"')), ["contineous", "r9", "'-0.05 0'"]),
        (lambda: from_urdf(URDF, MISTOLD), ["'r3'", "'bal'", "loops[1].links", "loops[1].at"]),
        (lambda: from_urdf(URDF, {"loops": [7]}), ["loops[0]: found 7"]),
        (lambda: from_urdf(URDF, {"loop": []}), ["unknown key"]),
        (lambda: from_urdf(URDF, FAR, end_effector="l2"), ["loop 'tip': found open by 2.", " m"]),
    ],
)
def test_what_is_no_model_or_none_that_closes_is_refused_with_a_sentence(
    read: Callable[[], Imported], said: list[str]
) -> None:
    text = str(refused(read))
    for part in said:
        assert part in text


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: &a [1]\nb: *a", "an alias"),
        ("loops: [", "no YAML"),
        ("!!python/object/apply:os.system ['true']", "no YAML"),
        ("[" * 100_000, "nested too deeply"),
        ("loops: 3", "a list"),
        ("just words", "a table"),
    ],
)
def test_a_hostile_second_file_is_refused_with_a_sentence(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "loops.yaml"
    path.write_text(text)
    assert said in str(refused(lambda: from_urdf(URDF, path)))


def test_includes_stay_in_the_folder_and_end_and_large_files_are_not_read(tmp_path: Path) -> None:
    folder = tmp_path / "robot"
    (folder / "parts").mkdir(parents=True)
    (tmp_path / "secret.xml").write_text("<mujoco/>")
    (folder / "link.xml").symlink_to(tmp_path / "secret.xml")
    arm = FIVE_BAR.strip().removeprefix('<mujoco model="five bar">').removesuffix("</mujoco>")
    (folder / "parts" / "arm.xml").write_text(f"<mujocoinclude>{arm}</mujocoinclude>")
    (folder / "scene.xml").write_text('<mujoco model="scene"><include file="parts/arm.xml"/></mujoco>')
    assert from_mjcf(folder / "scene.xml", **FORE).mechanism.name == "scene"
    for name, said in (
        ("../secret.xml", "outside the folder"),
        (str(tmp_path / "secret.xml"), "outside the folder"),
        ("link.xml", "outside the folder"),
        ("nothing.xml", "no such file"),
        ("loop.xml", "includes itself"),
    ):
        (folder / "loop.xml").write_text(f'<mujoco><include file="{name}"/></mujoco>')
        assert said in str(refused(lambda: from_mjcf(folder / "loop.xml")))
    with (tmp_path / "large.xml").open("wb") as file:
        file.truncate(50_000_000)
    assert "more than 10000000 bytes" in str(refused(lambda: from_mjcf(tmp_path / "large.xml")))


def test_a_model_opens_no_file_but_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Meshes, textures, height fields and plugins are not even looked for."""
    files = '<hfield name="h" file="h.png"/><texture name="t" type="2d" file="t.png"/>'
    path, whole = tmp_path / "model.xml", Path.open
    path.write_text(FIVE_BAR.replace('<material name="red"/>', files))
    opened: list[str] = []
    monkeypatch.setattr(
        Path, "open", lambda self, *args, **more: opened.append(self.name) or whole(self, *args, **more)
    )
    from_mjcf(path, **FORE)
    assert opened == ["model.xml"]


# The command.


def run(*words: str) -> tuple[int, str, str]:
    result = pfabrik(words)
    return result.exit_code, result.stdout, result.stderr


def test_a_model_goes_through_the_command_to_answers_and_back(tmp_path: Path) -> None:
    model, file, again = (tmp_path / name for name in ("model.xml", "machine.toml", "again.xml"))
    model.write_text(FIVE_BAR)
    words = ("--base", "frame", "--end-effector", "fore_left", "--task", "x,z", "--unit", "mm", "-o", str(file))
    code, out, err = run("import", str(model), *words)
    assert (code, out) == (0, "")
    assert "note:" in err and "cable" in err and "read as shapes (1), of: left" in err
    assert '[[body]]\nname = "left"\nshape = "sphere"' in file.read_text()
    code, _, err = run("import", str(model), *words)
    assert code == 2 and "--force" in err
    assert run("check", str(file))[0] == 0
    assert run("fk", str(file), "5", "-3")[0] == 0
    code, out, _ = run("verify", str(file), "--with", "mujoco", "--poses", "3")
    assert code == 0 and "agrees with MuJoCo on 3 poses" in out
    assert run("export", str(file), "mjcf", "-o", str(again))[0] == 0
    machine = from_mjcf(again).mechanism
    assert verify(machine, poses=2)
    assert [shape.body for shape in machine.shapes] == ["left"]
    code, out, _ = run("verify", str(file), "--poses", "2", "--json")
    assert json.loads(out)["agree"] is True


def test_a_description_with_loops_goes_through_the_command(tmp_path: Path) -> None:
    (tmp_path / "robot.urdf").write_text(URDF)
    loops = str(yaml_file(tmp_path, PLAIN))
    code, out, _ = run("import", str(tmp_path / "robot.urdf"), "--loops", loops, "--end-effector", "l2", "--json")
    found = json.loads(out)
    assert code == 0 and found["gap"] == pytest.approx(0.00403, abs=1e-5)
    assert any("open by" in note["what"] for note in found["notes"])
    assert "schema = 1" in found["file"]


FILES = {"robot.urdf": URDF, "model.xml": FIVE_BAR, "page.html": "<html/>", "robot.sdf": "<sdf/>"}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("import page.html", "<mujoco> (MJCF) or <robot> (URDF)"),
        ("import none.xml", "no such file"),
        ("import model.xml --loops x.yaml", "--loops"),
        ("import robot.urdf --configuration up", "--configuration"),
        ("check model.xml", "pfabrik import"),
        ("check robot.urdf", "pfabrik import"),
        ("check robot.sdf", "pfabrik import"),
        ("export stewart", "FORMAT"),
        ("export stewart mjfc", "mjcf"),
        ("export stewart mjcf --name arm", "--name is of c, c-float, --ros2-control and"),
        ("export stewart klipper -o new.xml", "cannot be exported"),
    ],
)
def test_the_command_says_what_is_wrong_in_one_line(
    words: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    code, out, err = run(*words.split())
    assert (code, out) == (2, "")
    assert said in err and "Traceback" not in err
    assert not (tmp_path / "new.xml").exists()


def test_a_missing_library_is_told_with_the_command_that_installs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pfabrik.common.extras.find_spec", lambda name: None)
    code, _, err = run("verify", "stewart")
    assert code == 2 and "pip install '.[mujoco]'" in err


# Machines whose files say little: no drives, drives through tendons, joints that follow others, loops told by names.

MIMIC = """
<robot name="geared">
  <link name="base"/><link name="arm"/><link name="fore"/><link name="finger"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="3"/></joint>
  <joint name="elbow" type="revolute"><parent link="arm"/><child link="fore"/><origin xyz="0 0 0.3"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="0"/>
    <mimic joint="shoulder" multiplier="-0.5" offset="0.1"/></joint>
  <joint name="grip" type="prismatic"><parent link="fore"/><child link="finger"/><origin xyz="0 0 0.2"/>
    <axis xyz="0 0 1"/><limit lower="0" upper="0.05" effort="1" velocity="1"/><mimic joint="elbow"/></joint>
  <transmission name="t"><joint name="shoulder"/></transmission>
</robot>"""


COUPLED = "elbow = 0.1 + -0.5 shoulder"


def test_joints_that_follow_each_other_are_refused_with_their_ratio_and_what_to_do() -> None:
    said = str(refused(lambda: from_urdf(MIMIC, end_effector="fore")))
    for part in ("joint 'elbow'", "follows 'shoulder' at the ratio -0.5", COUPLED, "--actuated shoulder,elbow"):
        assert part in said, part
    assert "--fixed elbow" in said
    said = str(refused(lambda: from_urdf(MIMIC, end_effector="finger", fixed=["grip"])))
    assert "follows 'shoulder' at the ratio -0.5" in said
    wrong = MIMIC.replace('joint="shoulder" multiplier="-0.5"', 'joint="sholder" multiplier="half"')
    said = str(refused(lambda: from_urdf(wrong, end_effector="fore")))
    assert "mimic.joint: found 'sholder'" in said and "mimic.multiplier: found 'half'" in said


@pytest.mark.parametrize(
    ("asked", "drives", "note"),
    [
        (
            {"end_effector": "fore", "actuated": ["elbow", "shoulder"]},
            ("elbow", "shoulder"),
            "left to who drives these",
        ),
        ({"end_effector": "fore", "fixed": ["elbow"]}, ("shoulder",), "left out: "),
        ({"end_effector": "fore", "base": "arm"}, ("elbow",), "driven through a coupling"),  # by the shoulder's motor
        ({"end_effector": "arm"}, ("shoulder",), "coupled with joints that are left out"),
    ],
)
def test_of_coupled_joints_one_is_driven_or_all_that_are_asked_for(
    asked: dict[str, Any], drives: tuple[str, ...], note: str
) -> None:
    found = from_urdf(MIMIC, **asked)
    assert found.mechanism.actuator_names == drives
    assert_noted(found, note, COUPLED)


GEARS = """
<mujoco><worldbody>
  <body name="a" pos="0 0 0"><joint name="qa" axis="0 1 0" ref="10"/><geom size=".01"/>
    <body name="b" pos="0 0 0.2"><joint name="qb" axis="0 1 0"/><geom size=".01"/>
      <body name="c" pos="0 0 0.2"><joint name="qc" axis="0 1 0"/><geom size=".01"/></body></body></body>
</worldbody>
<tendon><fixed name="cable"><joint joint="qa" coef="1"/></fixed></tendon>
<equality>{equality}</equality><actuator>{actuator}</actuator></mujoco>"""


MOTOR = '<motor joint="qa"/>'


def geared(equality: str = "", actuator: str = MOTOR, **asked: Any) -> Imported:
    return from_mjcf(GEARS.format(equality=equality, actuator=actuator), **{"end_effector": "c", **asked})


def follows(follower: str, leader: str, polynomial: str) -> str:
    return f'<joint joint1="{follower}" joint2="{leader}" polycoef="{polynomial}"/>'


def test_equalities_of_joints_in_a_model_couple_hold_or_rest() -> None:
    error = refused(lambda: geared(follows("qb", "qa", "0 3 0 0 0") + follows("qc", "qb", "0 2 0 0 0")))
    assert {fault.place for fault in error.faults} == {"joint 'qb'", "joint 'qc'"}
    assert "follows 'qa' at the ratio 3" in str(error) and "follows 'qa' at the ratio 6" in str(error)
    error = refused(lambda: geared(follows("qb", "qa", "0 0 1 0 0"), end_effector="b"))
    assert "at no fixed ratio (qb = " in str(error) and "1 qa^2)" in str(error)
    resting = geared('<joint joint1="qb" joint2="qa" active="false"/>')
    assert_noted(resting, "an equality that is not active is left out, of: qb, qa")
    held = geared('<joint joint1="qb"/>')
    assert_noted(held, "an equality holds these where they are: qb")
    assert [joint.name for joint in held.mechanism.joints] == ["qa", "qc"]
    # MuJoCo counts both from the reference: with qa at 10 degrees there, qb = 3 (qa - 10 deg)
    found = geared(follows("qb", "qa", "0 3 0 0 0"), base="a", end_effector="b")
    assert_noted(found, f"qb = {-3 * np.radians(10):.6g} + 3 qa")


def test_a_machine_without_drives_is_refused_with_the_cause_the_flag_and_the_candidates(tmp_path: Path) -> None:
    winch, loose = '<motor name="winch" tendon="cable"/>', MIMIC.replace("mimic", "calibration")
    error = refused(lambda: geared("", winch, end_effector="b"))
    assert "winch (through tendon cable)" in str(error)
    assert "`actuated` (--actuated A,B,...), from the base outward: qa, qb" in str(error)
    assert any("tendons are left out: cable" in note for note in error.__notes__)
    (tmp_path / "winch.xml").write_text(GEARS.format(equality="", actuator=winch))
    code, out, err = run("import", str(tmp_path / "winch.xml"), "--end-effector", "b")
    assert (code, out) == (2, "")
    assert "note: tendons are left out: cable" in err and "(--actuated A,B,...)" in err
    assert "the model has no actuators" in str(refused(lambda: geared("", "", end_effector="b")))
    elsewhere = refused(lambda: from_urdf(loose, base="arm", end_effector="fore"))
    assert "drives elsewhere only: shoulder" in str(elsewhere)
    untold = refused(lambda: from_urdf(loose.replace("transmission", "sensor"), end_effector="fore"))
    assert "no transmission" in str(untold)


NO_LOOPS = """
<sensor name="camera"><parent link="upper"/><child link="rod"/></sensor><disable_collisions link1="upper" link2="rod"/>
<ros2_control name="upper" type="system"><joint name="A"/><link>rod</link></ros2_control><frame name="tool" link="rod"/>
<gazebo reference="upper"><material>rod</material><sensor name="rod"><collision>upper</collision></sensor></gazebo>
<gazebo><plugin name="p"><bodyName>upper</bodyName><frameName>rod</frameName></plugin></gazebo>
<gazebo><joint name="ground" type="fixed"><parent>world</parent><child>base</child></joint></gazebo>"""
"""Elements that close no loop, though some name two links."""

OPEN = """
<robot name="open" xmlns:drake="http://drake.mit.edu"><link name="base"/><link name="upper"/><link name="rod"/>
  <joint name="A" type="continuous"><parent link="base"/><child link="upper"/></joint>
  <joint name="D" type="continuous"><parent link="base"/><child link="rod"/><origin xyz=".1 0 0"/></joint>
  <transmission name="t"><joint name="A"/></transmission>{}</robot>"""


@pytest.mark.parametrize(
    ("element", "named"),
    [
        ('<drake:distance_constraint><a name="upper"/><b name="rod"/></drake:distance_constraint>', "<distance_"),
        ('<constraint links="upper, rod" type="point"/>', "<constraint>"),
        ("<gazebo><bond name='C'><parent>a::upper</parent><child>a::rod</child></bond></gazebo>", "<bond> 'C'"),
        ('<mujoco><equality><connect body1="upper" body2="rod"/></equality></mujoco>', "<equality><connect>"),
    ],
)
def test_what_binds_two_links_and_is_not_read_is_refused_by_its_name(element: str, named: str) -> None:
    assert len(from_urdf(OPEN.format(NO_LOOPS), end_effector="upper").mechanism.joints) == 1
    error = refused(lambda: from_urdf(OPEN.format(NO_LOOPS + element), end_effector="upper"))
    assert len(error.faults) == 1 and named in str(error)
    assert "not read; expected the loop in a file of loops" in str(error)
    if "a::" not in element:  # told in a file of loops it is read
        loops = {"loops": [{"name": "C", "links": ["rod", "upper"], "at": [[0, 0, 0.2], [0.1, 0, 0.2]]}]}
        closed = from_urdf(OPEN.format(NO_LOOPS + element), loops, end_effector="upper").mechanism
        assert {joint.name for joint in closed.joints} == {"A", "C", "D"}


@pytest.mark.parametrize(
    ("old", "bond", "named"),
    [
        ("{equality}", '<tendon name="e" tendon1="cable"/>', "equality <tendon> 'e'"),
        ('name="cable"', 'name="cable" range="-1 1"', "tendon <fixed> 'cable'"),
        ("<tendon>", '<default><tendon limited="true" range="0 1"/></default><tendon>', "tendon <fixed> 'cable'"),
        ("<tendon>", '<bonds><bond body1="a" body2="c"/></bonds><tendon>', "<bonds><bond>"),
    ],
)
def test_a_bond_of_a_model_that_is_not_read_is_refused_by_its_name(old: str, bond: str, named: str) -> None:
    text = GEARS.replace(old, bond).format(equality="", actuator=MOTOR)
    assert named in str(refused(lambda: from_mjcf(text, end_effector="c")))
    if named.startswith("equality"):
        assert from_mjcf(text.replace('"e"', '"e" active="false"'), end_effector="c").mechanism


def test_import_says_what_check_says_of_the_file_that_it_wrote(tmp_path: Path) -> None:
    robot, machine = str(tmp_path / "robot.urdf"), str(tmp_path / "machine.toml")
    limits = '<limit lower="-30" upper="30" effort="1" velocity="1"/></joint>\n  <joint name="D"'
    text = OPEN.format("").replace('</joint>\n  <joint name="D"', limits).replace("continuous", "revolute", 1)
    Path(robot).write_text(text)
    command = ["import", robot, "--end-effector", "upper", "-o", machine]
    _, _, err = run(*command)
    said = [line for line in run("check", machine)[2].splitlines() if "note: " in line]
    assert any("were degrees meant" in line for line in said)
    assert set(said) <= set(err.splitlines())
    assert "were degrees meant" in run(*command, "--force", "--json")[1]


def test_frames_that_are_called_closing_close_loops_as_a_second_file_does() -> None:
    asked = {"end_effector": "l2", "actuated": ["motor_l", "motor_r"]}
    framed = with_frame(with_frame(URDF, "closing_tip_1", "l2", TIP_L), "closing_tip_2", "r2", TIP_R)
    table = {"loops": [{"name": "closing_tip", "frames": ["closing_tip_1", "closing_tip_2"], "type": "ball"}]}
    named, written = from_urdf(framed, **asked), from_urdf(framed, table, **asked)
    assert "as balls: closing_tip" in notes_of(named) and "closing frames" not in notes_of(written)
    assert named.mechanism == written.mechanism
    assert named.gap == written.gap == pytest.approx(np.hypot(0.002, 0.0035))
    hinged = with_frame(framed, "closing_tip_1_z", "l2", (*TIP_L[:2], 0.1))
    hinged = with_frame(hinged, "closing_tip_2_z", "r2", (*TIP_R[:2], 0.1))
    hinge = from_urdf(hinged, **asked).mechanism.joint("closing_tip")
    assert hinge.type == "revolute" and np.abs(hinge.axis) == pytest.approx((0, 1, 0), abs=1e-5)
    tip = from_urdf(framed, **{**asked, "end_effector": "closing_tip"}).mechanism
    assert tip.task == ("x", "z") and pf.solve_ik(tip, np.add(tip.reference_point, [0.01, 0.0, 0.01]))
    alone = from_urdf(framed.replace("closing_tip_2", "closing_top_2"), end_effector="l2", actuated=["motor_l"])
    assert "closes no loop: closing_tip_1, closing_top_2" in notes_of(alone)


def test_sites_that_are_called_closing_close_loops_with_and_without_an_equality() -> None:
    sites = FIVE_BAR.replace("tip_left", "closing_t_1").replace("tip_right", "closing_t_2")
    asked = {"base": "frame", "end_effector": "fore_left", "task": ["x", "z"]}
    equality = '<connect name="tip" site1="closing_t_1" site2="closing_t_2"/>'
    with_it, without = from_mjcf(sites, **asked), from_mjcf(sites.replace(equality, ""), **asked)
    assert "closing frames" not in notes_of(with_it) and "as balls: closing_t" in notes_of(without)
    assert with_it.mechanism.joint("tip").at == pytest.approx(without.mechanism.joint("closing_t").at)
    assert pf.solve_fk(without.mechanism, [0.1, -0.1]).pose == pytest.approx(
        pf.solve_fk(with_it.mechanism, [0.1, -0.1]).pose
    )
    resting = from_mjcf(
        sites.replace(equality, equality.replace("/>", ' active="false"/>')), actuated=["qL", "eL"], **asked
    )
    assert "not active is left out: tip" in notes_of(resting) and "closing frames" not in notes_of(resting)


HOIST = """
<mujoco><default><tendon range="0.2 2.5"/></default>
  <worldbody>
    <site name="a0" pos="0.8 0.1 1.5"/><site name="b0" pos="-0.4 0.7 1.4"/><site name="c0" pos="-0.4 -0.7 1.6"/>
    <body name="mast" pos="0 0 0.1"><joint name="lift" type="slide" axis="0 0 1" range="-1 1"/><geom size="0.01"/>
      <body name="plate" pos="0.1 0 0.6"><joint name="tilt" type="ball"/><geom size="0.1"/>
        <site name="a1" pos="0.2 0 0.05"/><site name="b1" pos="-0.1 0.15 0"/><site name="c1" pos="-0.1 -0.2 0"/>
      </body></body>
  </worldbody>
  <tendon><spatial name="a" frictionloss="3"><site site="a0"/><site site="a1"/></spatial>
    <spatial name="b"><site site="b0"/><site site="b1"/></spatial>
    <spatial name="c"><site site="c0"/><site site="c1"/></spatial></tendon>
  <actuator><motor name="lifting" joint="lift"/><motor tendon="c" gear="-2" ctrlrange="-5 7"/><motor tendon="b"/>
    <cylinder tendon="a"/></actuator>
</mujoco>"""
"""A plate on a mast, held by three cylinders: straight tendons that actuators pull."""


def test_straight_tendons_that_actuators_pull_are_cylinders_as_long_as_in_mujoco() -> None:
    found = from_mjcf(HOIST, end_effector="plate")
    machine = found.mechanism
    assert machine.actuator_names == ("lift", "c", "b", "a")
    assert sorted(chains(found)) == ["P*-S", "U-P*-S", "U-P*-S", "U-P*-S"]
    assert machine.joint("c").max_torque == 10.0 and machine.joint("a").friction == (3.0, 0.0)
    assert machine.joint("b").range == (0.2, 2.5)
    model = mujoco.MjModel.from_xml_string(HOIST)
    data = mujoco.MjData(model)
    for lift, turn in ((0.0, [0.0, 0.0, 0.0]), (0.2, [0.1, -0.2, 0.15]), (-0.3, [-0.2, 0.1, -0.1])):
        answer = pf.solve_ik(machine, pf.pose([0.1, 0.0, 0.7 + lift], rotvec=turn))
        assert answer, answer
        data.qpos[0], size = lift, float(np.linalg.norm(turn))
        data.qpos[1:] = [np.cos(size / 2), *(np.sin(size / 2) * np.array(turn) / (size or 1.0))]
        mujoco.mj_forward(model, data)
        lengths = [data.tendon(name).length[0] for name in ("c", "b", "a")]
        assert answer.actuators == pytest.approx([lift, *lengths], abs=1e-9)


def test_what_drives_a_machine_and_is_not_read_is_never_followed_by_drives_that_nobody_named() -> None:
    around = HOIST.replace('<site site="a1"/></spatial>', '<site site="a1"/><site site="b1"/></spatial>')
    around = around.replace('<default><tendon range="0.2 2.5"/></default>', "").replace('<motor tendon="b"/>', "")
    unread = re.sub(r'<motor name="lifting"[^>]*/><motor[^>]*/>', "", around)
    with pytest.raises(NoEndEffector) as refusal:
        from_mjcf(unread)
    (choice,) = refusal.value.choices
    assert not choice.options
    assert "driven by what is not read: a cylinder (through tendon a)" in str(choice)


def test_no_more_drives_are_proposed_than_a_machine_has_freedoms() -> None:
    """A four-bar has three hinges that could be driven, and needs one of them."""
    still = FOUR_BAR.replace('<motor joint="A"/>', "")
    error = refused(lambda: from_mjcf(still, end_effector="coupler"))
    assert "`actuated` (--actuated A); others here: B, C" in str(error)


FOUR_BAR = """
<mujoco><worldbody><site name="ground" pos="0.2 0 0"/>
  <body name="crank"><joint name="A" axis="0 1 0"/><geom size="0.01"/>
    <body name="coupler" pos="0 0 0.1"><joint name="B" axis="0 1 0"/><geom size="0.01"/>
      <body name="rocker" pos="0.2 0 0.05"><joint name="C" axis="0 1 0"/><geom size="0.01"/>
        <site name="foot" pos="0 0 -0.15"/></body></body></body></worldbody>
  <equality><connect name="D" site1="foot" site2="ground"/></equality>
  <actuator><motor joint="A"/></actuator></mujoco>"""


def in_urdf(count: int, kind: str) -> str:
    links = "".join(
        f'<link name="l{k}"/><joint name="j{k}" type="{kind}"><parent link="base"/><child link="l{k}"/></joint>'
        for k in range(count)
    )
    return f'<robot name="r"><link name="base"/>{links}</robot>'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<mujoco><worldbody>" + "<body><joint/></body>" * 4_000 + "</worldbody></mujoco>", "4000 joints"),
        ("<mujoco><worldbody>" + "<body/>" * 10_000 + "</worldbody></mujoco>", "10000 bodies"),
        ("<mujoco><equality>" + '<connect body1="a" anchor="0 0 0"/>' * 400 + "</equality></mujoco>", "400 loops"),
        ("<mujoco><worldbody>" + "<site/>" * 150_000 + "</worldbody></mujoco>", "150000 sites"),
        (in_urdf(4_000, "revolute"), "4000 joints"),
        (in_urdf(6_000, "fixed"), "6001 links"),
        ("<sdf><model>" + "<joint type='ball'/>" * 4_000 + "</model></sdf>", "4000 joints"),
        ("<mujoco><worldbody>" + "<replicate count='90'>" * 3 + "<site/>" + "</replicate>" * 3, "sites"),
    ],
)
def test_a_model_of_more_parts_than_any_robot_has_is_refused_at_once(text: str, said: str) -> None:
    text += "</worldbody></mujoco>" if text.endswith("</replicate>") else ""
    read, before = from_mjcf if text.startswith("<mujoco>") else from_urdf, time.process_time()
    error = refused(lambda: read(text, end_effector="e"))
    assert said in str(error) and "at most" in str(error)
    assert time.process_time() - before < 8.0  # in place of half a minute; other work on the same cores slows it down
