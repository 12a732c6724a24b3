"""MuJoCo models and robot descriptions as mechanisms: in the styles found in the wild, with what was changed told by
name, against MuJoCo's own kinematics; and files that mean harm."""

from __future__ import annotations

import dataclasses
import importlib.util
import json
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import pfabrik as pf
from in_mujoco import Model, mujoco
from pfabrik.cli import main
from pfabrik.errors import InvalidArgument, InvalidMechanism, UnknownName
from pfabrik.interop import Imported, Loop, NoEndEffector, OpenMechanism, assemble, from_mjcf, from_urdf, verify
from pfabrik.interop.driving import Rates
from pfabrik.interop.robots import ImportOptions, Robot, mechanism_of

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")


def notes_of(imported: Imported) -> str:
    return "\n".join(map(str, imported.notes))


def chains(found: Imported) -> list[str]:
    return sorted(str(chain) for chain in pf.decompose(found.mechanism))


def agrees(found: Imported, model: Model, body: str, off: Sequence[Sequence[float]], tolerance: float = 1e-12) -> None:
    """Forward kinematics against MuJoCo, in metres, with the actuated joints off home by so much."""
    mechanism = found.mechanism
    home = np.array([mechanism.home_coordinate(name) for name in mechanism.actuator_names])
    model.lead(mechanism.actuator_names, home)
    _, begin = model.pose(body)
    for step in off:
        assert model.lead(mechanism.actuator_names, home + step) <= 1e-13
        position, turned = model.pose(body)
        solution = pf.solve_fk(mechanism, home + step)
        assert solution
        assert np.linalg.norm(solution.pose[:3, 3] - position) <= tolerance
        assert np.abs(solution.pose[:3, :3] - turned @ begin.T).max() <= 10 * tolerance


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


def test_a_loop_between_sites_is_closed_and_all_that_is_left_out_is_named() -> None:
    found = from_mjcf(FIVE_BAR, base="frame", end_effector="fore_left", task=["x", "z"])
    assert found.gap == pytest.approx(0.0, abs=1e-15)
    assert found.mechanism.actuator_names == ("qL", "qR")
    assert found.mechanism.joint("qL").range == pytest.approx(np.radians([-80, 80]))
    assert chains(found) == ["R*-R", "R*-R-S"]
    for name in (
        "no shape here are left out: mesh (1)",
        "anything: material (1), mesh (1)",
        "cable",
        "winch",
        "eL",
        "finger = 1 qL",
        "finger",
        "jointpos",
    ):
        assert name in notes_of(found), name
    text = FIVE_BAR.replace('<joint joint1="finger" joint2="qL" polycoef="0 1 0 0 0"/>', "")
    text = text.replace('<geom type="mesh" mesh="m"/>', "").replace('<mesh name="m" file="nowhere.stl"/>', "")
    held = Model.of(text, finger=0.0)
    agrees(found, held, "fore_left", [(0.2, 0.1), (-0.3, 0.2), (0.1, -0.4)])


def test_an_end_effector_may_be_a_site_or_the_equality_itself() -> None:
    at_site = from_mjcf(FIVE_BAR, base="frame", end_effector="tip_right").mechanism
    assert (at_site.end_effector, at_site.reference_point) == ("fore_right", pytest.approx((0, 0, 0.3)))
    at_tip = from_mjcf(FIVE_BAR, base="frame", end_effector="tip").mechanism
    assert at_tip.end_effector_is_joint
    assert pf.solve_ik(at_tip, [0.01, 0, 0.29])


def test_home_may_be_a_keyframe_that_is_then_closed() -> None:
    found = from_mjcf(FIVE_BAR, base="frame", end_effector="fore_left", configuration="up")
    assert 1e-4 < found.gap < 0.05
    assert [found.mechanism.joint(name).home for name in ("qL", "qR")] == [0.1, -0.1]
    assert pf.closure_residual(pf.solve_fk(found.mechanism, [0.1, -0.1])) <= 1e-12
    assert "loops were open" in notes_of(found)


def test_names_that_do_not_exist_come_with_those_that_do() -> None:
    for wrong in ({"base": "fram"}, {"end_effector": "tipp"}, {"actuated": ["qX"]}, {"fixed": ["qX"]}):
        with pytest.raises(UnknownName):
            from_mjcf(FIVE_BAR, **{"end_effector": "fore_left", **wrong})
    with pytest.raises(UnknownName, match="known: qpos0, up"):
        from_mjcf(FIVE_BAR, end_effector="fore_left", configuration="down")
    with pytest.raises(NoEndEffector, match="such as 'fore_left' against 'frame'"):
        from_mjcf(FIVE_BAR, base="frame")
    with pytest.raises(InvalidArgument, match="a list of names"):
        from_mjcf(FIVE_BAR, end_effector="fore_left", actuated="qL")


def test_lengths_are_in_the_unit_asked_for() -> None:
    small = from_mjcf(FIVE_BAR, base="frame", end_effector="fore_left", length_unit="mm").mechanism
    assert (small.length_unit, small.joint("tip").at) == ("mm", pytest.approx((0, 0, 300)))


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
    for name in ("knee", "ball_left", "pitch+roll", "hinge_right+cross_right", "spare", "motor_right"):
        assert name in notes_of(found), name
    assert found.mechanism.joint("motor_right").home == pytest.approx(np.radians(5))  # the range does not have 0
    assert found.mechanism.joint("pitch+roll").range == pytest.approx(np.radians([[-40, 40], [-20, 20]]))
    model = Model.of(ANKLE.replace("<worldbody>", BOUND + "<worldbody>").replace("<freejoint/>", ""), knee=0.0)
    agrees(found, model, "foot", [(0.1, 0.05), (-0.2, 0.2), (0.0, 0.3)])


def test_actuated_and_fixed_joints_are_as_asked_for() -> None:
    found = from_mjcf(ANKLE, base="pelvis", end_effector="foot", actuated=["knee", "motor_left"], fixed=["spin"])
    assert found.mechanism.actuator_names == ("knee", "motor_left")
    assert "R*-S-S" in " ".join(chains(found))


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
    agrees(found, Model.of(text), "tool", [(0.1, 0.5, -0.1, 0.2), (0.3, 0.0, 0.25, 0.2), (-0.2, -0.4, 0.1, 0.1)])
    plate = from_mjcf(text, end_effector="plate", task=["x", "y", "z"])
    assert "wrist" in notes_of(plate)
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
    hinge = found.mechanism.joints[-1]
    np.testing.assert_allclose(np.abs(hinge.axis), [0, 1, 0], atol=1e-15)


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
    for name in ("yaw_body", "right_antenna", "left_antenna", "mesh"):
        assert name in notes_of(found)
    others = dict.fromkeys(("yaw_body", "right_antenna", "left_antenna"), 0.0)
    model = Model(mujoco.MjModel.from_xml_path(str(path)), others)
    steps = np.random.default_rng(0).uniform(-0.3, 0.3, (100, 6))
    agrees(found, model, "xl_330", steps, tolerance=1e-11)


def test_the_head_answers_exactly_where_its_makers_kinematics_do() -> None:
    kinematics = pytest.importorskip("reachy_mini_rust_kinematics")
    data = json.loads(reachy("assets", "kinematics_data.json").read_text())
    theirs = kinematics.ReachyMiniRustKinematics(data["motor_arm_length"], data["rod_length"])
    for motor in data["motors"]:
        inverse = np.linalg.inv(np.array(motor["T_motor_world"])).tolist()
        theirs.add_branch(motor["branch_position"], inverse, 1 if motor["solution"] else -1)
    mechanism = pf.load("reachy_mini").without_limits()
    rng = np.random.default_rng(0)
    positions = mechanism.reference_point + rng.uniform(-0.04, 0.04, (2000, 3))
    targets = pf.pose(positions, rpy=rng.uniform(-0.5, 0.5, (2000, 3)))
    angles = np.array([theirs.inverse_kinematics(target.tolist()) for target in targets])
    ours = pf.solve_ik(mechanism, targets, options=pf.Options(working_mode="keep"))
    answered = np.isfinite(angles).all(axis=1)
    np.testing.assert_array_equal(np.asarray(ours.status) == pf.Status.REACHED, answered)
    assert 1000 < answered.sum() < 1500
    apart = np.abs(np.angle(np.exp(1j * (angles - ours.actuators))))[answered].max(axis=1)
    assert np.sort(apart)[-2] <= 1e-11  # rad
    assert apart.max() <= 1e-10  # one pose of all is off by more than 1e-11, for a reason not known


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
    assert "open by 0.00403 m" in notes_of(found)
    assert pf.mobility(found.mechanism).platform == 2
    for name in ("motor_l", "motor_r"):
        assert found.mechanism.joint(name).home == 0.0  # the passive joints gave way
    agrees(found, in_mujoco(URDF, [("l2", "r2", TIP_L, TIP_R)]), "l2", [(0.2, 0.1), (-0.3, 0.2), (0.1, -0.3)])


def test_axes_that_a_few_digits_put_askew_do_not_lock_a_loop() -> None:
    askew = URDF.replace('rpy="1.5708 0 0"', 'rpy="1.57075 0 0.00004"', 1)
    hinge = {"name": "tip", "type": "hinge", "links": ["l2", "r2"], "at": [list(TIP_L), list(TIP_R)]}
    found = from_urdf(askew, {**PLAIN, "loops": [hinge]}, end_effector="l2", task=["x", "z"])
    assert "made parallel" in notes_of(found)
    assert pf.mobility(found.mechanism).platform == 2
    assert pf.solve_fk(found.mechanism, [0.2, 0.1])


def test_actuators_come_in_the_order_of_the_file_as_fast_as_it_says() -> None:
    joints = [pf.Joint("A", "spherical", ("base", "link"), at=(0, 0, 0))]
    joints += [
        pf.Joint(name, kind, (body, f"on {name}"), at=None if kind == "prismatic" else (0, 0, 0), axis=axis)
        for name, kind, body, axis in (
            ("turn", "revolute", "link", (1, 0, 0)),
            ("C[0]", "revolute", "on turn", (0, 0, 1)),
            ("C[1]", "prismatic", "on C[0]", (0, 0, 1)),
            ("last", "revolute", "on C[1]", (0, 1, 0)),
        )
    ]
    joints = [dataclasses.replace(joint, actuated=joint.name != "A") for joint in joints]
    rates = {"C[0]": Rates(2.0, 3.0), "C[1]": Rates(0.5), "last": Rates(None, 7.0)}
    places = {"on last": ("on last", np.zeros(3))}
    robot = Robot("arm", joints, [], "base", places, order=("last", "C[0]", "C[1]"), rates=rates)
    found = mechanism_of(robot, None, "on last", ImportOptions(length_unit="mm"), []).mechanism
    assert [joint.name for joint in found.joints] == ["A", "last", "C", "turn"]
    assert found.actuator_names == ("last", "C[0]", "C[1]", "turn")
    assert (found.joint("C").max_speed, found.joint("C").max_acceleration) == ((2.0, 500.0), None)
    assert (found.joint("last").max_speed, found.joint("last").max_acceleration) == (None, 7.0)


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
    model = in_mujoco(spherical, [("l2", "r2", TIP_L, TIP_R)])
    agrees(found, model, "r2", [(0.2, 0.1), (-0.3, 0.2), (0.1, -0.3)], tolerance=1e-11)


def test_what_is_wrong_with_a_description_is_told_in_one_go() -> None:
    wrong = URDF.replace('type="continuous"', 'type="contineous"', 1).replace(
        '<child link="r1"/>', '<child link="r9"/>'
    )
    with pytest.raises(InvalidMechanism) as caught:
        from_urdf(wrong.replace('xyz="-0.05 0 0"', 'xyz="-0.05 0"'))
    for part in ("contineous", "r9", "'-0.05 0'"):
        assert part in str(caught.value)
    loops = {"loops": [{"links": ["l2", "r3"], "type": "bal"}, {"links": ["l2"], "at": 3}, 7], "actuated": []}
    with pytest.raises(InvalidMechanism, match=r"loops\[2\]: found 7"):
        from_urdf(URDF, loops)
    with pytest.raises(InvalidMechanism) as caught:
        from_urdf(URDF, {**loops, "loops": loops["loops"][:2]})
    for part in ("'r3'", "'bal'", "loops[1].links", "loops[1].at"):
        assert part in str(caught.value)
    with pytest.raises(InvalidMechanism, match="unknown key"):
        from_urdf(URDF, {"loop": []})


def test_loops_that_cannot_close_are_refused_with_how_far_they_stay_open() -> None:
    far = {**PLAIN, "loops": [{**PLAIN["loops"][0], "at": [[0.1, 0.1, 0], [-0.1, 3.0, 0]]}]}
    with pytest.raises(InvalidMechanism, match=r"loop 'tip': found open by 2\.\d+ m"):
        from_urdf(URDF, far, end_effector="l2")


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


# Files that mean harm.

BOMB = '<!DOCTYPE x [<!ENTITY a "ha"><!ENTITY b "&a;&a;">]><mujoco>&b;</mujoco>'
OUTSIDE = '<!DOCTYPE x [<!ENTITY e SYSTEM "file:///etc/passwd">]><robot name="&e;"/>'


@pytest.mark.parametrize("read", [from_mjcf, from_urdf])
@pytest.mark.parametrize("text", [BOMB, OUTSIDE])
def test_entities_are_refused_before_they_are_expanded(read, text: str) -> None:
    with pytest.raises(InvalidMechanism, match="document type"):
        read(text)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<mujoco>" + "<body>" * 5000 + "</body>" * 5000 + "</mujoco>", "nested too deeply"),
        ("<mujoco><worldbody>", "no XML"),
        ("<mujoco/>\0", "no XML"),
        ("<robot/>", "expected <mujoco>"),
        ("<mujoco><worldbody><body pos='a b c'/></worldbody></mujoco>", "what MuJoCo does not compile"),
        ("<mujoco><worldbody><replicate count='1000000'><body/></replicate></worldbody></mujoco>", "1000000 copies"),
        ("<mujoco><worldbody><flexcomp name='f' file='x.msh'/></worldbody></mujoco>", "flexible"),
        ("<mujoco><include file='other.xml'/></mujoco>", "no folder"),
    ],
)
def test_what_is_no_model_or_too_much_of_one_is_refused_with_a_sentence(text: str, said: str) -> None:
    with pytest.raises(InvalidMechanism, match=said):
        from_mjcf(text)


def test_a_file_of_fifty_megabytes_is_refused_without_being_read(tmp_path: Path) -> None:
    path = tmp_path / "large.xml"
    with path.open("wb") as file:
        file.truncate(50_000_000)
    with pytest.raises(InvalidMechanism, match="more than 10000000 bytes"):
        from_mjcf(path)


def test_includes_stay_in_the_folder_and_end(tmp_path: Path) -> None:
    folder = tmp_path / "robot"
    (folder / "parts").mkdir(parents=True)
    (tmp_path / "secret.xml").write_text("<mujoco/>")
    (folder / "link.xml").symlink_to(tmp_path / "secret.xml")
    arm = FIVE_BAR.strip().removeprefix('<mujoco model="five bar">').removesuffix("</mujoco>")
    (folder / "parts" / "arm.xml").write_text(f"<mujocoinclude>{arm}</mujocoinclude>")
    (folder / "scene.xml").write_text('<mujoco model="scene"><include file="parts/arm.xml"/></mujoco>')
    assert from_mjcf(folder / "scene.xml", base="frame", end_effector="fore_left").mechanism.name == "scene"
    for name, said in (
        ("../secret.xml", "outside the folder"),
        (str(tmp_path / "secret.xml"), "outside the folder"),
        ("link.xml", "outside the folder"),
        ("nothing.xml", "no such file"),
        ("loop.xml", "includes itself"),
    ):
        (folder / "loop.xml").write_text(f'<mujoco><include file="{name}"/></mujoco>')
        with pytest.raises(InvalidMechanism, match=said):
            from_mjcf(folder / "loop.xml")


def test_a_model_opens_no_file_but_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Meshes, textures, height fields and plugins are not even looked for."""
    files = '<hfield name="h" file="h.png"/><texture name="t" type="2d" file="t.png"/>'
    path = tmp_path / "model.xml"
    path.write_text(FIVE_BAR.replace('<material name="red"/>', files))
    opened: list[str] = []
    whole = Path.open
    monkeypatch.setattr(
        Path, "open", lambda self, *args, **more: opened.append(self.name) or whole(self, *args, **more)
    )
    from_mjcf(path, base="frame", end_effector="fore_left")
    assert opened == ["model.xml"]


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
    with pytest.raises(InvalidMechanism, match=said):
        from_urdf(URDF, path)


# The command.


def run(*words: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(main, list(words))
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
    assert code == 0
    found = json.loads(out)
    assert found["gap"] == pytest.approx(0.00403, abs=1e-5)
    assert any("open by" in note["what"] for note in found["notes"])
    assert "schema = 1" in found["file"]


def test_the_command_says_what_is_wrong_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "robot.urdf").write_text(URDF)
    (tmp_path / "model.xml").write_text(FIVE_BAR)
    (tmp_path / "page.html").write_text("<html/>")
    (tmp_path / "robot.sdf").write_text("<sdf/>")
    for words, said in (
        (("import", str(tmp_path / "page.html")), "<mujoco> (MJCF) or <robot> (URDF)"),
        (("import", str(tmp_path / "none.xml")), "no such file"),
        (("import", str(tmp_path / "model.xml"), "--loops", "x.yaml"), "--loops"),
        (("import", str(tmp_path / "robot.urdf"), "--configuration", "up"), "--configuration"),
        (("check", str(tmp_path / "model.xml")), "pfabrik import"),
        (("check", str(tmp_path / "robot.urdf")), "pfabrik import"),
        (("check", str(tmp_path / "robot.sdf")), "pfabrik import"),
        (("export", "stewart"), "FORMAT"),
        (("export", "stewart", "mjfc"), "mjcf"),
        (("export", "stewart", "mjcf", "--name", "arm"), "--name is of c, c-float and"),
        (("export", "stewart", "c", "--name", "A b"), "found 'A b'"),
        (("export", "stewart", "klipper", "-o", str(tmp_path / "new.xml")), "cannot be exported"),
    ):
        code, out, err = run(*words)
        assert (code, out) == (2, "")
        assert said in err and "Traceback" not in err
    assert not (tmp_path / "new.xml").exists()


def test_a_missing_library_is_told_with_the_command_that_installs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pfabrik.extras.find_spec", lambda name: None)
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


def test_joints_that_follow_each_other_are_refused_with_their_ratio_and_what_to_do() -> None:
    with pytest.raises(InvalidMechanism) as caught:
        from_urdf(MIMIC, end_effector="fore")
    said = str(caught.value)
    for part in ("joint 'elbow'", "follows 'shoulder' at the ratio -0.5", "elbow = 0.1 + -0.5 shoulder"):
        assert part in said, part
    assert "--actuated shoulder,elbow" in said and "--fixed elbow" in said
    with pytest.raises(InvalidMechanism, match=r"follows 'shoulder' at the ratio -0\.5"):
        from_urdf(MIMIC, end_effector="finger", fixed=["grip"])
    both = from_urdf(MIMIC, end_effector="fore", actuated=["elbow", "shoulder"])
    assert both.mechanism.actuator_names == ("elbow", "shoulder")
    assert "a coupling is left to who drives these, elbow = 0.1 + -0.5 shoulder" in notes_of(both)
    held = from_urdf(MIMIC, end_effector="fore", fixed=["elbow"])
    assert held.mechanism.actuator_names == ("shoulder",) and "elbow = 0.1 + -0.5 shoulder" in notes_of(held)


def test_of_coupled_joints_one_alone_is_driven_by_the_drive_of_the_other() -> None:
    """The forearm against the arm: the elbow turns with the shoulder's motor, wherever that is."""
    alone = from_urdf(MIMIC, base="arm", end_effector="fore")
    assert alone.mechanism.actuator_names == ("elbow",)
    assert "driven through a coupling, elbow = 0.1 + -0.5 shoulder" in notes_of(alone)
    first = from_urdf(MIMIC, end_effector="arm")
    assert first.mechanism.actuator_names == ("shoulder",)
    assert "coupled with joints that are left out, elbow = 0.1 + -0.5 shoulder" in notes_of(first)


def test_speeds_are_read_of_what_is_driven_in_the_unit_asked_for() -> None:
    uncoupled, joints = MIMIC.replace("mimic", "x"), ("shoulder", "elbow", "grip")
    every = from_urdf(uncoupled, end_effector="finger", actuated=joints, length_unit="mm").mechanism
    assert [every.joint(name).max_speed for name in joints] == [3.0, None, 1000.0]
    one = from_urdf(uncoupled, end_effector="finger", actuated=["grip"], length_unit="mm").mechanism
    assert [one.joint(name).max_speed for name in joints] == [None, None, 1000.0]


def test_a_coupling_that_names_no_joint_or_no_number_is_a_fault() -> None:
    wrong = MIMIC.replace('joint="shoulder" multiplier="-0.5"', 'joint="sholder" multiplier="half"')
    with pytest.raises(InvalidMechanism, match=r"(?s)mimic.joint: found 'sholder'.*mimic.multiplier: found 'half'"):
        from_urdf(wrong, end_effector="fore")


GEARS = """
<mujoco><worldbody>
  <body name="a" pos="0 0 0"><joint name="qa" axis="0 1 0" ref="10"/><geom size=".01"/>
    <body name="b" pos="0 0 0.2"><joint name="qb" axis="0 1 0"/><geom size=".01"/>
      <body name="c" pos="0 0 0.2"><joint name="qc" axis="0 1 0"/><geom size=".01"/></body></body></body>
</worldbody>
<tendon><fixed name="cable"><joint joint="qa" coef="1"/></fixed></tendon>
<equality>{equality}</equality><actuator>{actuator}</actuator></mujoco>"""


def test_equalities_of_joints_in_a_model_couple_hold_or_rest() -> None:
    motor = '<motor joint="qa"/>'
    coupling = (
        '<joint joint1="qb" joint2="qa" polycoef="0 3 0 0 0"/><joint joint1="qc" joint2="qb" polycoef="0 2 0 0 0"/>'
    )
    with pytest.raises(InvalidMechanism) as caught:
        from_mjcf(GEARS.format(equality=coupling, actuator=motor), end_effector="c")
    assert {fault.place for fault in caught.value.faults} == {"joint 'qb'", "joint 'qc'"}
    assert "follows 'qa' at the ratio 3" in str(caught.value) and "follows 'qa' at the ratio 6" in str(caught.value)
    bent = GEARS.format(equality='<joint joint1="qb" joint2="qa" polycoef="0 0 1 0 0"/>', actuator=motor)
    with pytest.raises(InvalidMechanism, match=r"at no fixed ratio \(qb = .*1 qa\^2\)"):
        from_mjcf(bent, end_effector="b")
    resting = GEARS.format(equality='<joint joint1="qb" joint2="qa" active="false"/>', actuator=motor)
    assert "an equality that is not active is left out, of: qb, qa" in notes_of(from_mjcf(resting, end_effector="c"))
    held = from_mjcf(GEARS.format(equality='<joint joint1="qb"/>', actuator=motor), end_effector="c")
    assert "an equality holds these where they are: qb" in notes_of(held)
    assert [joint.name for joint in held.mechanism.joints] == ["qa", "qc"]


def test_a_factor_of_a_coupling_counts_from_where_its_joints_count() -> None:
    """MuJoCo counts both from the reference: with qa at 10 degrees there, qb = 3 (qa - 10 deg)."""
    coupled = GEARS.format(
        equality='<joint joint1="qb" joint2="qa" polycoef="0 3 0 0 0"/>', actuator='<motor joint="qa"/>'
    )
    found = from_mjcf(coupled, base="a", end_effector="b")
    assert f"qb = {-3 * np.radians(10):.6g} + 3 qa" in notes_of(found)


def test_a_machine_without_drives_is_refused_with_the_cause_the_flag_and_the_candidates(tmp_path: Path) -> None:
    through = GEARS.format(equality="", actuator='<motor name="winch" tendon="cable"/>')
    with pytest.raises(InvalidMechanism) as caught:
        from_mjcf(through, end_effector="b")
    assert "winch (through tendon cable)" in str(caught.value)
    assert "`actuated` (--actuated A,B,...), from the base outward: qa, qb" in str(caught.value)
    assert any("tendons are left out: cable" in note for note in caught.value.__notes__)
    (tmp_path / "winch.xml").write_text(through)
    code, out, err = run("import", str(tmp_path / "winch.xml"), "--end-effector", "b")
    assert (code, out) == (2, "")
    assert "note: tendons are left out: cable" in err and "(--actuated A,B,...)" in err
    with pytest.raises(InvalidMechanism, match="the model has no actuators"):
        from_mjcf(GEARS.format(equality="", actuator=""), end_effector="b")
    with pytest.raises(InvalidMechanism, match="drives elsewhere only: shoulder"):
        from_urdf(MIMIC.replace("mimic", "x"), base="arm", end_effector="fore")
    with pytest.raises(InvalidMechanism, match="no transmission"):
        from_urdf(MIMIC.replace("transmission", "x").replace("mimic", "x"), end_effector="fore")


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
    with pytest.raises(InvalidMechanism, match=r"bond of .* not read; expected the loop in a file of loops") as caught:
        from_urdf(OPEN.format(NO_LOOPS + element), end_effector="upper")
    assert len(caught.value.faults) == 1 and named in str(caught.value)
    if "a::" not in element:  # told in a file of loops it is read
        loops = {"loops": [{"name": "C", "links": ["rod", "upper"], "at": [[0, 0, 0.2], [0.1, 0, 0.2]]}]}
        closed = from_urdf(OPEN.format(NO_LOOPS + element), loops, end_effector="upper").mechanism
        assert {joint.name for joint in closed.joints} == {"A", "C", "D"}


def test_import_says_what_check_says_of_the_file_that_it_wrote(tmp_path: Path) -> None:
    limits = '<limit lower="-30" upper="30" effort="1" velocity="1"/></joint><joint name="D"'
    (tmp_path / "robot.urdf").write_text(
        OPEN.format("").replace('</joint>\n  <joint name="D"', limits).replace("continuous", "revolute", 1)
    )
    command = ["import", str(tmp_path / "robot.urdf"), "--end-effector", "upper", "-o", str(tmp_path / "machine.toml")]
    _, _, err = run(*command)
    said = [line for line in run("check", str(tmp_path / "machine.toml"))[2].splitlines() if "note: " in line]
    assert any("were degrees meant" in line for line in said)
    assert set(said) <= set(err.splitlines())
    assert "were degrees meant" in run(*command, "--force", "--json")[1]


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
    text = GEARS.replace(old, bond).format(equality="", actuator='<motor joint="qa"/>')
    with pytest.raises(InvalidMechanism, match=re.escape(named)):
        from_mjcf(text, end_effector="c")
    if named.startswith("equality"):
        assert from_mjcf(text.replace('"e"', '"e" active="false"'), end_effector="c").mechanism


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


# Collision geometry


WEIGHTY = """
<mujoco model="arm">
  <compiler angle="degree"/>
  <default>
    <default class="seen"><geom type="mesh" contype="0" conaffinity="0" group="2"/></default>
    <default class="hit"><geom type="capsule" size="0.01" group="3"/>
      <default class="ball"><geom type="sphere" size="0.03"/></default></default>
  </default>
  <asset><mesh name="m" file="nowhere.stl"/></asset>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <geom name="wall" type="box" size="0.02 0.3 0.2" pos="-0.4 0 0.2" euler="0 0 30"/>
    <body name="upper" pos="0 0 0.1" euler="0 10 20" childclass="hit">
      <joint name="shoulder" axis="0 1 0" range="-90 90"/>
      <geom class="seen" mesh="m"/>
      <geom name="bone" fromto="0 0 0.03 0.02 0 0.27"/>
      <geom type="mesh" mesh="m"/><geom type="box" mesh="m"/>
      <body name="fore" pos="0 0 0.3">
        <joint name="elbow" axis="0 1 0" range="-120 120"/>
        <frame pos="0 0.01 0" euler="90 0 0"><geom name="shell" type="cylinder" size="0.02 0.1" euler="0 90 0"/></frame>
        <body name="tool" pos="0 0 0.3" quat="0.6 0 0.8 0">
          <geom name="tip" class="ball" pos="0.05 0 0"/><geom type="ellipsoid" size="0.1 0.1 0.1"/>
          <geom name="block" type="box" size="0.01 0.02 0.03" pos="0.1 0 0" xyaxes="0.6 0.8 0 -0.8 0.6 0"/>
        </body>
      </body>
    </body>
    <body name="bystander" pos="1 0 0"><freejoint/><geom size="0.1"/></body>
  </worldbody>
  <actuator><motor joint="shoulder"/><motor joint="elbow"/></actuator>
  <keyframe><key name="bent" qpos="0.3 -0.5 1 0 0 1 0 0 0"/></keyframe>
</mujoco>
"""


def shapes_by_kind(found: Imported) -> dict[tuple[str, str], pf.Shape]:
    return {(shape.body, shape.kind): shape for shape in found.mechanism.shapes}


def test_geoms_that_collide_are_shapes_of_the_merged_bodies_where_mujoco_has_them() -> None:
    found = from_mjcf(WEIGHTY, end_effector="tool", configuration="bent", length_unit="mm")
    text = WEIGHTY.replace('<geom class="seen" mesh="m"/>', "").replace('<geom type="mesh" mesh="m"/>', "")
    text = text.replace('<geom type="box" mesh="m"/>', "").replace('<mesh name="m" file="nowhere.stl"/>', "")
    model = mujoco.MjModel.from_xml_string(text.replace("<compiler", '<compiler boundmass="1" boundinertia="1"'))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_kinematics(model, data)
    shapes = shapes_by_kind(found)
    assert set(shapes) == {
        ("world", "box"),
        ("upper", "capsule"),
        ("tool", "disc"),
        ("tool", "sphere"),
        ("tool", "box"),
    }
    for name, body, kind in (("shell", "tool", "disc"), ("tip", "tool", "sphere"), ("block", "tool", "box")):
        np.testing.assert_allclose(shapes[body, kind].at, 1e3 * data.geom(name).xpos, atol=1e-9)
    axes = {name: data.geom(name).xmat.reshape(3, 3).T for name in ("wall", "bone", "shell", "block")}
    assert (shapes["tool", "disc"].diameter, shapes["tool", "disc"].thickness) == pytest.approx((40, 200))
    assert abs(axes["shell"][2] @ shapes["tool", "disc"].axis) == pytest.approx(1)
    assert shapes["tool", "sphere"].diameter == pytest.approx(60)
    for name, body, size in (("block", "tool", (20, 40, 60)), ("wall", "world", (40, 600, 400))):
        np.testing.assert_allclose(shapes[body, "box"].axes, axes[name][:2], atol=1e-12)
        np.testing.assert_allclose(shapes[body, "box"].size, size)
    half = 1e3 * model.geom("bone").size[1] * axes["bone"][2]
    middle = 1e3 * data.geom("bone").xpos
    np.testing.assert_allclose(shapes["upper", "capsule"].ends, [middle + half, middle - half], atol=1e-9)
    assert shapes["upper", "capsule"].thickness == pytest.approx(20)
    for note in ("ellipsoid (1), mesh (2), plane (1)", "touch nothing are left out (1)", "(5), of: tool, upper, world"):
        assert note in notes_of(found), note


def test_links_that_overlap_at_home_may_touch_and_the_deepest_is_named() -> None:
    text = WEIGHTY.replace('pos="-0.4 0 0.2" euler="0 0 30"', 'pos="0.11 0 0.65"')
    found = from_mjcf(text, end_effector="tool")
    assert found.mechanism.ignore == (("world", "tool"),)
    assert "overlap at home are in `ignore` (1), the deepest: world and tool by 0.0" in notes_of(found)
    alone = from_mjcf(WEIGHTY, end_effector="tool").mechanism
    assert alone.ignore == ()
    with pytest.raises(InvalidMechanism, match="deep in"):
        found.mechanism.with_shapes(found.mechanism.shapes, ())
    far = [0.05, 0.0, 0.55]
    with_shapes, without = (pf.solve_ik(each, far).q for each in (alone, alone.with_shapes(())))
    np.testing.assert_array_equal(with_shapes, without)


THREE = """
<mujoco><worldbody>
  <body name="a"><joint name="ja" axis="0 1 0"/><geom name="ga" size="0.01" {a}/>
    <body name="b" pos="0 0 0.2"><joint name="jb" axis="0 1 0"/>
      <body name="c" pos="0 0 0.2"><joint name="jc" axis="0 1 0"/><geom name="gc" size="0.01" {c}/>
        <body name="d" pos="0 0 0.2"><joint name="jd" axis="0 1 0"/>
          <body name="e" pos="0 0 0.2"><joint name="je" axis="0 1 0"/><geom name="ge" size="0.01" {e}/></body>
  </body></body></body></body></worldbody>
  <contact>{contact}</contact>
  <actuator><motor joint="ja"/><motor joint="jb"/><motor joint="jc"/><motor joint="jd"/><motor joint="je"/></actuator>
</mujoco>
"""
NOTHING, FLOOR = 'contype="0" conaffinity="0"', 'contype="0" conaffinity="1"'


@pytest.mark.parametrize(
    ("a", "c", "e", "contact", "bodies", "ignore"),
    [
        ("", "", "", "", "ace", []),
        ("", "", NOTHING, "", "ac", []),
        ("", "", "", '<exclude body1="e" body2="a"/><exclude body1="a" body2="b"/>', "ace", ["ae"]),
        (
            'contype="2" conaffinity="1"',
            'contype="1" conaffinity="2"',
            'contype="2" conaffinity="4"',
            "",
            "ace",
            ["ae"],
        ),
        (FLOOR, FLOOR, FLOOR, "", "ace", []),
        (FLOOR, FLOOR, FLOOR, '<exclude body1="c" body2="a"/>', "ace", ["ac"]),
        (FLOOR, FLOOR, FLOOR, '<pair geom1="ga" geom2="ge"/>', "ace", ["ac", "ce"]),
        (NOTHING, NOTHING, NOTHING, '<pair geom1="ga" geom2="ge"/>', "ae", []),
        (NOTHING + ' group="3"', NOTHING, NOTHING + ' group="3"', "", "ae", []),
        (NOTHING + ' group="3"', NOTHING, "", "", "e", []),
    ],
)
def test_bits_pairs_and_exclusions_say_which_links_may_touch(
    a: str, c: str, e: str, contact: str, bodies: str, ignore: list[str]
) -> None:
    found = from_mjcf(THREE.format(a=a, c=c, e=e, contact=contact), end_effector="e")
    assert "".join(sorted(shape.body for shape in found.mechanism.shapes)) == bodies
    assert ["".join(sorted(pair)) for pair in found.mechanism.ignore] == ignore
    assert ("keep all links from touching" in notes_of(found)) == (a == FLOOR and "<pair" not in contact)


def test_of_merged_bodies_all_solids_must_be_excluded_for_the_pair_to_be() -> None:
    more = '<body name="horn" pos="0.05 0 0"><geom size="0.01"/></body></body></body>'
    for contact, ignore in (("", ()), ('<exclude body1="horn" body2="a"/>', (("a", "e"),))):
        text = THREE.format(a="", c=NOTHING, e="", contact=f'<exclude body1="a" body2="e"/>{contact}')
        found = from_mjcf(text.replace("</body>\n  </body>", f"{more}\n  "), end_effector="e")
        assert [shape.body for shape in found.mechanism.shapes] == ["a", "e", "e"]
        assert found.mechanism.ignore == ignore


def test_geoms_that_are_too_many_or_that_mujoco_refuses_are_left_out_and_the_machine_is_read() -> None:
    three = THREE.format(a="", c="", e="", contact="")
    for count, each, note in ((301, 1, "303 solids, of which a mechanism"), (900, 9, "8102 geoms, of which at most")):
        balls = each * '<geom size="0.001"/>'
        many = f'<replicate count="{count}" offset="0.001 0 0">{balls}</replicate>'
        found = from_mjcf(three.replace('<geom name="gc" size="0.01" />', many), end_effector="e")
        assert found.mechanism.shapes == ()
        assert f"collision geometry is left out: {note}" in notes_of(found)
    found = from_mjcf(THREE.format(a='type="capsule"', c="", e="", contact=""), end_effector="e")
    assert found.mechanism.shapes == ()
    assert "does not compile it" in notes_of(found)
    assert len(found.mechanism.joints) == 5


def test_solids_move_with_their_bodies_where_home_is_closed_first() -> None:
    along = 'size="0.004" fromto="0 0 0 -0.1 0 0.1"/>'
    geoms = "".join(f'<geom type="{kind}" {along}' for kind in ("capsule", "box", "cylinder"))
    text = FIVE_BAR.replace('<site name="tip_right"', f'{geoms}<site name="tip_right"')
    found = from_mjcf(text, base="frame", end_effector="fore_left", configuration="up")
    assert found.gap > 1e-4
    shapes, joints = shapes_by_kind(found), [found.mechanism.joint(name).at for name in ("eR", "tip")]
    np.testing.assert_allclose(shapes["fore_right", "capsule"].ends, joints, atol=1e-6)
    direction = np.subtract(*joints) / np.linalg.norm(np.subtract(*joints))
    box, disc = shapes["fore_right", "box"], shapes["fore_right", "disc"]
    np.testing.assert_allclose([box.at, disc.at], [np.mean(joints, axis=0)] * 2, atol=1e-6)
    assert abs(np.cross(*box.axes) @ direction) == pytest.approx(1.0)
    assert abs(np.dot(disc.axis, direction)) == pytest.approx(1.0)


def test_a_body_that_becomes_part_of_a_joint_loses_its_solids_by_name() -> None:
    crossed = """
    <mujoco><worldbody><body name="cross" pos="0 0 0.1"><joint name="jx" axis="1 0 0"/><geom size="0.01"/>
      <body name="bar"><joint name="jy" axis="0 1 0"/>
        <body name="end" pos="0 0 0.2"><joint name="slide" type="slide" axis="0 0 1"/><geom size="0.02"/></body>
    </body></body></worldbody><actuator><motor joint="slide"/></actuator></mujoco>"""
    found = from_mjcf(crossed, end_effector="end")
    assert [joint.type for joint in found.mechanism.joints] == ["universal", "prismatic"]
    assert [shape.body for shape in found.mechanism.shapes] == ["end"]
    assert "within a joint is left out, of: cross" in notes_of(found)


SOLID_URDF = """
<robot name="arm">
  <link name="base"><collision><origin xyz="0 0 -0.05"/><geometry><box size="0.2 0.3 0.1"/></geometry></collision>
    <visual><geometry><sphere radius="1"/></geometry></visual></link>
  <link name="upper"><collision><origin xyz="0.1 0 0.2" rpy="0.3 -0.2 0.5"/>
    <geometry><cylinder radius="0.02" length="0.2"/></geometry></collision>
    <collision><geometry><mesh filename="package://x/y.stl"/></geometry></collision></link>
  <link name="tool"><collision><origin xyz="0.01 0.02 0.03"/><geometry><sphere radius="0.04"/></geometry></collision>
    <collision><origin rpy="0 1 0"/><geometry><box size="0.02 0.04 0.06"/></geometry></collision></link>
  <link name="flange"><collision><geometry><sphere radius="0.01"/></geometry></collision>
    {more}</link>
  <joint name="q1" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.3" rpy="0.1 0.2 0.3"/>
    <axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="q2" type="revolute"><parent link="upper"/><child link="tool"/><origin xyz="0 0 0.4" rpy="0 0.5 0"/>
    <axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="weld" type="fixed"><parent link="tool"/><child link="flange"/><origin xyz="0 0 0.1"/></joint>
</robot>
"""


def test_collision_geometry_of_a_description_is_where_mujoco_has_it() -> None:
    more = '<collision><geometry><box size="0 1 1"/></geometry></collision>'
    more += '<collision><geometry><sphere radius="x"/></geometry></collision><collision/>'
    found = from_urdf(SOLID_URDF.format(more=more), actuated=["q1", "q2"], end_effector="tool", length_unit="mm")
    text = SOLID_URDF.format(more="").replace("<collision><geometry><mesh", "<visual><geometry><mesh")
    text = text.replace('y.stl"/></geometry></collision>', 'y.stl"/></geometry></visual>')
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    kinds = {int(kind): name for kind, name in ((2, "sphere"), (5, "disc"), (6, "box"))}
    shapes = [(each.kind, *np.round(each.at, 6)) for each in found.mechanism.shapes]
    solid = [i for i in range(model.ngeom) if model.geom_contype[i]]
    assert sorted(shapes) == sorted(
        (kinds[int(model.geom_type[i])], *np.round(1e3 * data.geom_xpos[i], 6)) for i in solid
    )
    for i in solid:
        shape = next(each for each in found.mechanism.shapes if np.allclose(each.at, 1e3 * data.geom_xpos[i]))
        axes, size = data.geom_xmat[i].reshape(3, 3).T, 1e3 * model.geom_size[i]
        if shape.kind == "box":
            np.testing.assert_allclose(shape.size, 2 * size)
            np.testing.assert_allclose(shape.axes or np.eye(3)[:2], axes[:2], atol=1e-12)
        else:
            assert shape.diameter == pytest.approx(2 * size[0])
        if shape.kind == "disc":
            assert shape.axis == pytest.approx(axes[2])
            assert shape.thickness == pytest.approx(2 * size[1])
    for note in (
        "geometry (1), mesh (1), sphere without its numbers (1)",
        "without a volume",
        "(5), of: base, tool, upper",
    ):
        assert note in notes_of(found), note
