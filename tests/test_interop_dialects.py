"""Loops in the dialects in which files tell them, and SDF: each machine against a MuJoCo model written by hand."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from command import pfabrik
from in_mujoco import Model, agrees, notes_of
from pfabrik.errors import InvalidArgument, InvalidMechanism, UnknownName
from pfabrik.exchange.interop import from_sdf, from_urdf, verify
from pfabrik.machine.files import dumps, loads

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

# A four-bar: hinges A and D at the base, B and C at the ends of the coupler.

LINKS = '<link name="ground"/><link name="crank"/><link name="coupler"/><link name="rocker"/>'


def hinge(name: str, parent: str, child: str, xyz: str, rpy: str = "0 0 0") -> str:
    return (
        f'<joint name="{name}" type="continuous"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="0 1 0"/></joint>'
    )


TREE = LINKS + hinge("A", "ground", "crank", "0 0 0") + hinge("B", "crank", "coupler", "0 0 0.06")
TREE += '<transmission name="t"><joint name="A"/></transmission>'
FOUR_BAR = f'<robot name="four-bar">{TREE}{hinge("D", "ground", "rocker", "0.2 0 0")}{{}}</robot>'
ONE, OTHER = "0.17 0 0.06", "-0.03 0 0.12"  # of coupler and rocker, where C is

IN_MUJOCO = """
<mujoco><compiler boundmass="1" boundinertia="1"/><worldbody>
  <body name="crank"><joint name="A" axis="0 1 0"/>
    <body name="coupler" pos="0 0 0.06"><joint name="B" axis="0 1 0"/><site name="c1" pos="0.17 0 0.06"/></body></body>
  <body name="rocker" pos="0.2 0 0"><joint name="D" axis="0 1 0"/><site name="c2" pos="-0.03 0 0.12"/></body>
</worldbody><equality><connect site1="c1" site2="c2"/></equality></mujoco>"""

FRAMED = f"<parent_origin xyz='{ONE}'/><child_origin xyz='{OTHER}' rpy='0 0.3 0'/>"
ENDS = "<parent link='coupler'/><child link='rocker'/>"
IN_FRAMES = f"<link1 link='coupler' xyz='{ONE}' rpy='0 0.2 0'/><link2 link='rocker' xyz='{OTHER}' rpy='0.1 0 0'/>"
AXIS = "<axis xyz='0 2 0'/>"
TURNED_AXES = "<parent_axis xyz='0 1 0'/><child_axis xyz='0 0.8 0.6'/>"
TURNED = f"<parent_origin xyz='{ONE}'/><child_origin xyz='{OTHER}' rpy='-0.6435011087932844 0 0'/>"
BODIES = "<{0}body_A name='coupler'/><{0}body_B name='rocker'/><{0}p_AP value='{1}'/><{0}p_BQ value='{2}'/>"
IN_SDF = "<parent>coupler</parent><child>rocker</child>"
IN_GAZEBO = f"<gazebo><joint name='C' type='{{}}'>{IN_SDF}<pose>{{}}</pose>{{}}</joint></gazebo>"
CROSS = "<axis><xyz>0 1 0</xyz></axis><axis2><xyz>1 0 0</xyz></axis2>"
RANGE, ON_PARENT = "<limit><lower>-1</lower><upper>2</upper></limit>", "<axis xyz='0 1 0' frame='parent'/>"


@pytest.mark.parametrize(
    ("element", "kind"),
    [
        (f"<loop_joint name='C' type='spherical'>{IN_FRAMES}</loop_joint>", "balls: C"),
        (f"<loop_joint name='C' type='spherical'>{IN_FRAMES.replace('link2 ', 'link1 ')}</loop_joint>", "balls: C"),
        (f"<loop_joint name='C'>{IN_FRAMES.replace('0.1 0 0', '0 0 0')}{AXIS}</loop_joint>", "hinges: C"),
        (f"<loop_joint name='C' type='revolute'>{ENDS}{FRAMED}{ON_PARENT}</loop_joint>", "hinges: C"),
        (f"<constraint name='C' type='ball'>{ENDS}{FRAMED}</constraint>", "balls: C"),
        (f"<constraint name='C' type='continuous'>{ENDS}{TURNED}{TURNED_AXES}</constraint>", "hinges: C"),
        (f"<drake:ball_constraint>{BODIES.format('drake:ball_', ONE, OTHER)}</drake:ball_constraint>", "balls: "),
        (IN_GAZEBO.format("revolute", f"{OTHER} 0 0 0", "<axis><xyz>0 1 0</xyz></axis>"), "hinges: C"),
        (IN_GAZEBO.format("universal", f"{OTHER} 0 0 0", CROSS), "welds: C:weld"),
        (IN_GAZEBO.format("ball", f"{OTHER} 1 2 3", "").replace(">c", ">m::c"), "balls: C"),
        (IN_GAZEBO.format("revolute", f"{OTHER} 0 0 0", f"<axis><xyz>0 1 0</xyz>{RANGE}</axis>"), "welds: C:weld"),
    ],
)  # fmt: skip
def test_a_loop_that_an_element_of_a_urdf_tells_closes_it_as_in_mujoco(element: str, kind: str, tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(FOUR_BAR.format(element))
    found = from_urdf(path, end_effector="rocker", task=["tilt"])
    assert "millimetres" not in notes_of(found)
    assert f"loops that the description tells, as {kind}" in notes_of(found)
    agrees(found, Model.of(IN_MUJOCO), "rocker")
    checked = verify(found.mechanism, poses=3, original=path)
    assert checked and checked.original
    loops = {"loops": [{"links": ["rocker", "coupler"], "at": [[-0.03, 0, 0.12], [0.17, 0, 0.06]]}]}
    again = from_urdf(path, loops, end_effector="rocker")
    assert again.mechanism.joint("closure_1").type == "spherical" and "tells too, which counts" in notes_of(again)
    assert "C" not in {joint.name for joint in again.mechanism.joints}


def test_a_link_that_hangs_on_two_joints_closes_a_loop_whose_joint_keeps_its_range() -> None:
    closing = hinge("D", "rocker", "ground_pin", "-0.03 0 0.12").replace("continuous", "revolute")
    closing = closing.replace("</joint>", '<limit lower="-0.4" upper="0.5" effort="1" velocity="1"/></joint>')
    second = hinge("D", "ground", "rocker", "0.2 0 0") + closing.replace('"D"', '"C"').replace("ground_pin", "tip")
    text = FOUR_BAR.replace(hinge("D", "ground", "rocker", "0.2 0 0"), second)
    text = text.replace(LINKS, LINKS + '<link name="tip"/>')
    tip = '<joint name="E" type="fixed"><parent link="coupler"/><child link="tip"/><origin xyz="0.17 0 0.06"/></joint>'
    found = from_urdf(text.format(tip), end_effector="rocker", task=["tilt"])
    assert found.mechanism.joint("C").range == (-0.4, 0.5)
    agrees(found, Model.of(IN_MUJOCO), "rocker", reach=0.2)


def test_of_a_slider_crank_the_slide_itself_may_close_the_loop_and_be_driven() -> None:
    """Two links on hinges at the base; a cylinder between them, told as a slide with a range, in SDF within a URDF."""
    axis = "<axis><xyz>1 0 0</xyz><limit><lower>-0.05</lower><upper>0.04</upper></limit></axis>"
    slide = IN_GAZEBO.format("prismatic", "-0.03 0 0.12 0 0.7 0", axis)
    found = from_urdf(FOUR_BAR.format(slide), end_effector="rocker", actuated=["C"], task=["tilt"])
    assert found.mechanism.joint("C").range == (-0.05, 0.04)
    joint = f'<joint name="C" type="slide" axis="{np.cos(0.7)} 0 {-np.sin(0.7)}"/>'
    body = f'<body name="rod" pos="0.17 0 0.06">{joint}<site name="c1"/></body>'
    model = IN_MUJOCO.replace('<site name="c1" pos="0.17 0 0.06"/>', body)
    agrees(found, Model.of(model.replace("connect", "weld")), "rocker", reach=0.03)


# The same machine in space, in SDF: hinges at the base, and a rod with a ball at each end.

POINTS = {"A": (0.0, 0.0, 0.1), "B": (0.05, 0.02, 0.2), "C": (0.2, -0.03, 0.3), "D": (0.3, 0.0, 0.1)}
TURN = {"A": (0.0, 0.6, 0.8), "D": (0.36, 0.48, 0.8)}
PLACED = {
    name: (Rotation.from_rotvec(vector), np.array(at))
    for name, vector, at in (
        ("crank", (0.3, -0.2, 0.9), (0.1, 0.2, 0.3)),
        ("rod", (1.0, 0.4, -0.3), (-0.1, 0.3, 0.2)),
        ("rocker", (-0.5, 0.8, 0.1), (0.4, -0.2, 0.1)),
    )
}


def rod_in_mujoco() -> str:
    a, b, c, d = (np.array(POINTS[name]) for name in "ABCD")
    text = lambda values: " ".join(map(repr, map(float, values)))  # noqa: E731
    return f"""<mujoco><compiler boundmass="1" boundinertia="1"/><worldbody>
      <body name="crank" pos="{text(a)}"><joint name="A" axis="{text(TURN["A"])}"/>
        <body name="rod" pos="{text(b - a)}"><joint name="B" type="ball"/>
          <site name="one" pos="{text(c - b)}"/></body></body>
      <body name="rocker" pos="{text(d)}"><joint name="D" axis="{text(TURN["D"])}"/>
        <site name="two" pos="{text(c - d)}"/>
        <body name="hand" pos="{text(PLACED["rocker"][1] - d)}"/></body>
      </worldbody><equality><connect site1="one" site2="two"/></equality></mujoco>"""


def in_frame(frame: tuple[Rotation, np.ndarray], other: tuple[Rotation, np.ndarray]) -> tuple[Rotation, np.ndarray]:
    return frame[0].inv() * other[0], frame[0].inv().apply(other[1] - frame[1])


MODEL = (Rotation.identity(), np.zeros(3))


def pose_text(frame: tuple[Rotation, np.ndarray], style: str, base: str = "") -> str:
    turn = frame[0].as_quat() if style == "quat" else frame[0].as_euler("xyz", degrees=style == "degrees")
    said = {"quat": ' rotation_format="quat_xyzw"', "degrees": ' degrees="true"'}.get(style, "")
    said += f' relative_to="{base}"' if base else ""
    return f"<pose{said}>{' '.join(map(repr, map(float, [*frame[1], *turn])))}</pose>"


CROSSED = ((0.6, 0.8, 0.0), (-0.48, 0.36, 0.8))  # axes of a universal joint in place of B


def rod_in_sdf(
    style: str, order: str = "ABCD", turned: Sequence[str] = (), limits: str = "", middle: str = "ball"
) -> str:
    """The machine, its poses relative to the model, the link before, or a frame, and joints listed in an order."""
    links, before = '<frame name="F" attached_to="crank"><pose>0.1 0 0 0 0 0.5</pose></frame>', ""
    f_in_crank = (Rotation.from_euler("z", 0.5), np.array([0.1, 0.0, 0.0]))
    crank = PLACED["crank"]
    frame = (crank[0] * f_in_crank[0], crank[0].apply(f_in_crank[1]) + crank[1])
    for name, place in PLACED.items():
        base = {"chain": before, "frame": "F" if name != "crank" else ""}.get(style, "")
        outer = {"": MODEL, "F": frame}.get(base) or PLACED[base]
        links += f'<link name="{name}">{pose_text(in_frame(outer, place), style, base)}</link>'
        before = name
    joints = {}
    for name, kind, parent, child in (
        ("A", "revolute", "world", "crank"),
        ("B", middle, "crank", "rod"),
        ("C", "ball", "rod", "rocker"),
        ("D", "revolute", "world", "rocker"),
    ):
        parent, child = (child, parent) if name in turned else (parent, child)
        at = (Rotation.from_rotvec([0.2, 0.1, -0.4]), np.array(POINTS[name]))
        outer = PLACED.get(child, MODEL)
        pose = pose_text(at, style, "__model__") if style == "frame" else pose_text(in_frame(outer, at), style)
        axes = np.array([TURN[name]] if kind == "revolute" else CROSSED if kind == "universal" else [])
        axes = -axes[::-1] if name in turned else axes
        said = ' expressed_in="__model__"' if style == "chain" else ""
        text = f"<parent>{parent}</parent><child>{child}</child>{pose}"
        for tag, axis in zip(("axis", "axis2"), axes, strict=False):
            xyz = " ".join(map(repr, map(float, axis if said else at[0].inv().apply(axis))))
            text += f"<{tag}><xyz{said}>{xyz}</xyz>{limits if name == 'A' else ''}</{tag}>"
        joints[name] = f'<joint name="{name}" type="{kind}">{text}</joint>'
    plugin = '<plugin filename="x" name="gz::sim::systems::JointPositionController"><joint_name>A</joint_name></plugin>'
    return (
        f'<sdf version="1.11"><model name="rod">{links}{"".join(joints[name] for name in order)}{plugin}</model></sdf>'
    )


@pytest.mark.parametrize(
    ("style", "order", "turned"),
    [
        ("model", "ABCD", ""),
        ("degrees", "DCBA", ""),
        ("quat", "ABCD", "C"),
        ("chain", "BADC", "AD"),
        ("frame", "CDAB", "BD"),
    ],
)
def test_a_model_in_sdf_moves_as_in_mujoco_whatever_its_frames_are(
    style: str, order: str, turned: str, tmp_path: Path
) -> None:
    path = tmp_path / "robot.sdf"
    path.write_text(rod_in_sdf(style, order, turned, "<limit><lower>-0.7</lower><upper>0.6</upper></limit>"))
    found = from_sdf(path, end_effector="rocker", task=["tilt"])
    assert found.mechanism.actuator_names == ("A",)
    assert found.mechanism.joint("A").range == pytest.approx((-0.7, 0.6))
    assert found.mechanism.reference_point == pytest.approx(PLACED["rocker"][1])
    agrees(found, Model.of(rod_in_mujoco()), "hand")
    assert verify(found.mechanism, poses=3, original=path)
    one_sided = from_sdf(rod_in_sdf(style, order, turned, "<limit><lower>-0.7</lower></limit>"), end_effector="rocker")
    assert one_sided.mechanism.joint("A").range[0] == -0.7 and one_sided.mechanism.joint("A").range[1] > 6.0


@pytest.mark.parametrize("turned", ["", "B"])
def test_a_universal_joint_of_sdf_has_its_first_axis_on_its_parent(turned: str) -> None:
    found = from_sdf(rod_in_sdf("model", turned=turned, middle="universal"), end_effector="rod", task=["tilt"])
    hinges = "".join(f'<joint name="B{axis}" axis="{" ".join(map(str, axis))}"/>' for axis in CROSSED)
    at = " ".join(map(repr, (PLACED["rod"][1] - POINTS["B"]).tolist()))
    model = rod_in_mujoco().replace('<joint name="B" type="ball"/>', f'{hinges}<body name="end" pos="{at}"/>')
    agrees(found, Model.of(model), "end")


def test_joints_that_drake_adds_to_a_urdf_are_joints_of_the_tree() -> None:
    tree = FOUR_BAR.replace('<joint name="B" type="continuous">', '<drake:joint name="B" type="universal">', 1)
    tree = tree.replace('<axis xyz="0 1 0"/></joint><trans', "</drake:joint><trans")
    drives = ["A", "B_1", "B_2"]
    found = from_urdf(tree.format(""), end_effector="coupler", actuated=drives, task=["x", "tilt"])
    hinges = '<joint name="B_1" axis="1 0 0"/><joint name="B_2" axis="0 1 0"/>'
    text = IN_MUJOCO.replace('<joint name="B" axis="0 1 0"/>', hinges)
    agrees(found, Model.of(re.sub("<equality>.*</equality>", "", text)), "coupler")


def test_a_hinge_that_closes_a_loop_may_be_driven_or_held(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    told = IN_GAZEBO.format("revolute", f"{OTHER} 0 0 0", "<axis><xyz>0 1 0</xyz></axis>")
    path.write_text(FOUR_BAR.format(told))
    found = from_urdf(path, end_effector="rocker", actuated=["C"], task=["tilt"])
    assert found.mechanism.actuator_names == ("C",)
    checked = verify(found.mechanism, poses=3, original=path)
    assert checked and checked.original
    held = from_urdf(path, end_effector="rocker", fixed=["C"], task=["tilt"]).mechanism
    assert pf.mobility(held).platform == 0
    sdf = from_sdf(rod_in_sdf("model").replace("A</joint_name>", "</joint_name>"), end_effector="crank", actuated=["D"])
    assert sdf.mechanism.actuator_names == ("D",)


def test_collision_geometry_of_sdf_is_where_its_links_are() -> None:
    box = "<geometry><box><size>0.02 0.04 0.06</size></box></geometry>"
    parts = f"<collision name='a'><pose>0.01 0.02 0.03 0.1 0.2 0.3</pose>{box}</collision>"
    parts += "<collision name='b'><geometry><sphere><radius>0.004</radius></sphere></geometry></collision>"
    parts += "<collision name='c'><geometry><mesh><uri>model://x.stl</uri></mesh></geometry></collision>"
    text = rod_in_sdf("chain").replace('<link name="rocker">', f'<link name="rocker">{parts}')
    found = from_sdf(text, end_effector="rocker", task=["tilt"], length_unit="mm")
    turn, at = PLACED["rocker"]
    shapes = {shape.kind: shape for shape in found.mechanism.shapes}
    assert shapes["sphere"].at == pytest.approx(1e3 * at)
    assert shapes["box"].at == pytest.approx(1e3 * (at + turn.apply([0.01, 0.02, 0.03])))
    axes = (turn * Rotation.from_euler("xyz", [0.1, 0.2, 0.3])).as_matrix().T[:2]
    np.testing.assert_allclose(shapes["box"].axes, axes, atol=1e-9)
    assert "mesh (1)" in notes_of(found)


# What is wrong, by its name.

CLOSED = FOUR_BAR.format(f"<loop_joint name='C' type='spherical'>{IN_FRAMES}</loop_joint>")
SPRING = BODIES.format("drake:linear_spring_damper_", ONE, OTHER)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("link2 link='rocker'", "link2 link='roker'", "'roker'; did you mean 'rocker'?"),
        ("<link2 link='rocker'", "<kink2 link='rocker'", "1 links; expected two"),
        (ONE, "nan 0 0", "three finite numbers"),
        ("</robot>", IN_GAZEBO.format("ball", "", "").replace("coupler", "world") + "</robot>", "'world', no link"),
        ("loop_joint name='C'", "loop_joint name='A'", "loop 'A': found a name that a joint or another loop has"),
        (OTHER, "0 0", "three finite numbers"),
        (OTHER, "-30 0 120", r"loop 'C': found open by 1\d\d m"),
        ("type='spherical'", "type='distance'", "type 'distance'; expected one of ball"),
        ("type='spherical'", "", "neither a type nor an axis"),
        ("type='spherical'", "type='hinge'", "C'.axis: found no direction"),
        ("spherical'>", "universal'><axis xyz='0 1 0'/>", "C'.axis: found one direction; expected two"),
        ("</robot>", f"<drake:linear_bushing_rpy>{SPRING}</drake:linear_bushing_rpy></robot>", "<linear_bushing_rpy>"),
        ("</robot>", f"<gazebo><joint name='E' type='gearbox'>{IN_SDF}</joint></gazebo></robot>", "type 'gearbox'"),
        ("</robot>", "<xacro:include filename='a'/></robot>", "of a file for xacro"),
        ("<link name", "<link/>" * 300_000 + "<link name", "too many"),
        ("<link name", "".join(f'<joint name="{i}"/>' for i in range(6000)) + "<link name", "joints, with all"),
        ('name="crank"', 'name="rocker"', "'rocker': found a name that is empty, or used twice"),
        ('name="D" type="continuous"', 'name="D" type="fixed"', "'rocker', which is fixed to 'ground'"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_told_loop_is_refused_in_a_sentence(old: str, new: str, said: str) -> None:
    with pytest.raises((InvalidMechanism, InvalidArgument), match=said):
        from_urdf(CLOSED.replace(old, new), end_effector="rocker")


def test_a_description_in_millimetres_is_noted_and_its_mechanism_file_takes_their_word() -> None:
    far = CLOSED.replace('xyz="0.2 0 0"', 'xyz="200 0 0"').replace("0 0 0.06", "0 0 60")
    far = far.replace(ONE, "170 0 60").replace(OTHER, "-30 0 120")
    found = from_urdf(far, end_effector="rocker")
    note = 'up to 200 m away, as a description has metres; if millimetres were meant, write length = "mm"'
    assert note in notes_of(found)
    mended = loads(dumps(found.mechanism).replace('length = "m"', 'length = "mm"'))
    expected = from_urdf(CLOSED, end_effector="rocker", length_unit="mm").mechanism
    for angle in np.linspace(-0.5, 0.5, 11):
        np.testing.assert_allclose(pf.solve_fk(mended, [angle]).pose, pf.solve_fk(expected, [angle]).pose, atol=1e-9)


DRIVES = (
    '<transmission name="t"><joint name="A"/></transmission><transmission name="u"><joint name="a"/></transmission>'
)
SPRUNG = f"<drake:linear_spring_damper>{SPRING}</drake:linear_spring_damper>"
WITHIN = {"name": "E", "type": "ball", "links": ["crank", "crank"], "at": [[0, 0, 0], [0, 0, 0]]}


@pytest.mark.parametrize(
    ("more", "loops", "note"),
    [
        (DRIVES, None, "what the description drives, but no joint of the robot: a"),
        ("", {"loops": [WITHIN]}, "loops between bodies that are fixed to each other are left out: E"),
        (SPRUNG, None, "springs between links are left out: coupler and rocker"),
    ],
)
def test_what_does_not_count_is_noted(more: str, loops: dict | None, note: str) -> None:
    found = from_urdf(CLOSED.replace("</robot>", f"{more}</robot>"), loops, end_effector="rocker")
    assert note in notes_of(found)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("</sdf>", "<model name='b'><joint/></model></sdf>", "2 models (rod, b)"),
        ("</model>", "<include><uri>model://x</uri></include></model>", "<include> 'model://x' within it"),
        ("</model>", "<model name='inner'/></model>", "<model> 'inner' within it; expected .* `gz sdf -p FILE`"),
        ('type="ball"', 'type="screw"', "type 'screw'"),
        ('type="ball"', 'type="gearbox"', "type 'gearbox'; expected .*--actuated"),
        ("<child>rocker</child>", "<child>roker</child>", "'roker', no link; did you mean 'rocker'?"),
        ("<pose>", "<pose>0 ", "expected x y z and roll pitch yaw"),
        ("<pose>", '<pose relative_to="rode">', "'rode', no frame; did you mean 'rod'"),
        ('attached_to="crank"', 'attached_to="F"', "'F', which is attached to itself"),
        ('<link name="crank"><pose>', '<link name="crank"><pose relative_to="A">', "relative to itself"),
        ('<joint name="A"', '<joint name="rod"', "the name 'rod', which is empty, reserved or used twice"),
        ("<lower>-1", "<lower>nan", "'nan'; expected a number"),
        ("<xyz>", "<xyz>0 0 0</xyz><xyz>", "no direction"),
        ('name="A" type="revolute"', 'name="A"', "type ''"),
        ("<parent>world</parent>", "<parent>rocker</parent>", "'rocker' as parent and as child"),
    ],
)
def test_what_is_wrong_with_a_model_in_sdf_is_refused_in_a_sentence(old: str, new: str, said: str) -> None:
    text = rod_in_sdf("model", limits="<limit><lower>-1</lower><upper>1</upper></limit>")
    assert old in text
    with pytest.raises(InvalidMechanism, match=re.sub(r"([()?])", r"\\\1", said)):
        from_sdf(text.replace(old, new), end_effector="rocker")


def test_of_a_world_its_one_model_is_read_and_frames_may_be_end_effectors() -> None:
    text = rod_in_sdf("frame").replace("<model", "<world name='w'><include><uri>model://sun</uri></include><model")
    found = from_sdf(text.replace("</model>", "</model></world>"), end_effector="F", task=["tilt"])
    assert "model://sun" in notes_of(found)
    turn, at = PLACED["crank"]
    assert found.mechanism.reference_point == pytest.approx(at + turn.apply([0.1, 0, 0]))


def test_frames_of_sdf_meet_as_a_file_of_loops_says() -> None:
    """As where a simulator closes a loop by a spring between two frames, of which the model says nothing."""
    frames = "".join(
        f'<frame name="{name}" attached_to="{link}">{pose_text(in_frame(PLACED[link], at), "model")}</frame>'
        for name, link in (("one", "rod"), ("two", "rocker"))
        for at in [(Rotation.from_rotvec([0.3, 0.5, -0.2]), np.array(POINTS["C"]))]
    )
    text = re.sub(r'<joint name="C".*?</joint>', frames, rod_in_sdf("model"))
    loops = {"loops": [{"name": "C", "frames": ["one", "two"]}]}
    found = from_sdf(text, loops, end_effector="rocker", task=["tilt"])
    agrees(found, Model.of(rod_in_mujoco()), "hand")
    with pytest.raises(InvalidMechanism, match=r"loops\[0\].frames: found 'D'"):
        from_sdf(text, {"loops": [{"frames": ["one", "D"]}]}, end_effector="rocker")


def test_a_plugin_that_attaches_links_closes_a_loop_beside_a_world_of_other_things() -> None:
    link = re.findall(r'<link name="rocker">.*?</link>', rod_in_sdf("model"))[0]
    ends = "<parent_link>rocker</parent_link><child_model>rod</child_model><child_link>tip</child_link>"
    plugin = f"<plugin filename='x.so' name='gz::sim::systems::DetachableJoint'>{ends}</plugin>"
    text = rod_in_sdf("model").replace(
        "<parent>rod</parent><child>rocker</child>", "<parent>rod</parent><child>tip</child>"
    )
    text = text.replace("<model", "<world name='w'><model name='floor'><link name='slab'/></model><model", 1)
    text = text.replace("</model></sdf>", f"{link.replace('rocker', 'tip')}{plugin}</model></world></sdf>")
    found = from_sdf(text, end_effector="rocker", task=["tilt"])
    assert "left out: floor" in notes_of(found) and "as welds: DetachableJoint" in notes_of(found)
    agrees(found, Model.of(rod_in_mujoco()), "hand")


# Joints that follow others, beside the loop that says how.


@pytest.mark.parametrize(("ratio", "drive"), [(-1.0, "A"), (-0.9, "A"), (-1.0, "D")])
def test_a_loop_counts_before_a_mimic_that_says_the_same_or_nearly(ratio: float, drive: str) -> None:
    """A parallelogram, at its flat home too, where a loop by itself might go either way."""
    lower = hinge("A", "base", "lower", "0 0 0") + hinge("D", "base", "rod", "-0.08 0 0.0")
    mimic = f'<mimic joint="A" multiplier="{ratio}"/></joint>'
    upper = hinge("B", "lower", "upper", "0 0 0.3").replace("</joint>", mimic)
    links = "".join(f'<link name="{name}"/>' for name in ("base", "lower", "upper", "rod"))
    motor = f'<transmission name="t"><joint name="{drive}"/></transmission>'
    ends = "<link1 link='rod' xyz='0 0 0.3'/><link2 link='upper' xyz='-0.08 0 0'/>"
    loop = f"<loop_joint name='C' type='ball'>{ends}</loop_joint>"
    found = from_urdf(f'<robot name="p">{links}{lower}{upper}{motor}{loop}</robot>', end_effector="upper", task=["x"])
    assert found.mechanism.actuator_names == (drive,)
    assert f"not B = {ratio:.6g} A: B by -1 as A by 1" in notes_of(found)
    solution = pf.solve_fk(found.mechanism, [0.4])
    at = 0.3 * np.array([np.sin(0.4), 0.0, np.cos(0.4)])
    assert solution.pose[:3, 3] == pytest.approx(at, abs=1e-9)
    assert solution.pose[:3, :3] == pytest.approx(np.eye(3), abs=1e-9)


def test_a_mimic_of_sdf_counts_from_its_reference_and_is_refused_where_no_loop_explains_it() -> None:
    follows = "<multiplier>2</multiplier><offset>0.1</offset><reference>0.3</reference>"
    before, rest = rod_in_sdf("model").split('name="D"')
    rest = rest.replace("</axis>", f"<mimic joint='A' axis='axis'>{follows}</mimic></axis>", 1)
    text = f'{before}name="D"{rest}'
    open_chain = re.sub(r'<joint name="C".*?</joint>', "", text)
    alone = from_sdf(open_chain, end_effector="rocker", task=["tilt"])
    assert alone.mechanism.actuator_names == ("D",)
    assert "driven through a coupling, D = -0.5 + 2 A" in notes_of(alone)
    closed = from_sdf(text, end_effector="rocker", task=["tilt"])
    assert closed.mechanism.actuator_names == ("A",) and "loops say how these follow" in notes_of(closed)
    series = text.replace("<parent>world</parent><child>rocker</child>", "<parent>crank</parent><child>rocker</child>")
    with pytest.raises(InvalidMechanism, match=r"follows 'A' at the ratio 2 .* --actuated|--fixed"):
        from_sdf(re.sub(r'<joint name="C".*?</joint>', "", series), end_effector="rocker")


def cross_description(at: str = "0 0 0") -> tuple[str, dict]:
    """An ankle whose pitch and roll are hinges that cross, with two motors that push its foot by rods."""

    def joint(name: str, parent: str, child: str, place: str, axis: str) -> str:
        ends = f'<parent link="{parent}"/><child link="{child}"/><origin xyz="{place}"/><axis xyz="{axis}"/>'
        limit = '<limit lower="-1" upper="1" effort="40" velocity="9"/>'
        return f'<link name="{child}"/><joint name="{name}" type="revolute">{ends}{limit}</joint>'

    parts = [joint("pitch", "shank", "cross", at, "0 1 0"), joint("roll", "cross", "foot", "0 0 0", "1 0 0")]
    loops = []
    for mark, side in (("L", 0.03), ("R", -0.03)):
        parts.append(joint(f"motor{mark}", "shank", f"crank{mark}", f"0 {side} 0.25", "0 1 0"))
        parts.append(joint(f"u{mark}", f"crank{mark}", f"pin{mark}", "-0.04 0 0", "0 1 0"))
        parts.append(joint(f"v{mark}", f"pin{mark}", f"rod{mark}", "0 0 0", "1 0 0"))
        ends = {"links": [f"rod{mark}", "foot"], "at": [[0.0, 0.0, -0.25], [-0.04, side, 0.0]]}
        loops.append({"name": f"tip{mark}", "type": "ball", **ends})
    text = f'<robot name="ankle"><link name="shank"/>{"".join(parts)}</robot>'
    return text, {"loops": loops, "actuated": ["motorL", "motorR"]}


def test_joints_that_become_one_keep_the_names_that_their_file_has(tmp_path: Path) -> None:
    text, loops = cross_description()
    ankle = from_urdf(text, loops, end_effector="foot").mechanism
    assert ankle.joint("pitch") is ankle.joint("roll") is ankle.joint("pitch+roll")
    angles = np.array([[0.1, -0.2], [0.0, 0.15]])
    own, merged = (pf.actuation(ankle, joints=names) for names in (("pitch", "roll"), ("pitch+roll",)))
    assert own.names == ("pitch", "roll")
    motors = own.to_actuators(angles).values
    assert np.array_equal(motors, merged.to_actuators(angles).values)
    for angle, motor in zip(angles, motors, strict=True):  # a foot that turns by pitch, then by roll, is where they say
        turned = pf.solve_fk(ankle, motor).pose[:3, :3]
        assert turned == pytest.approx(Rotation.from_euler("YX", angle).as_matrix(), abs=1e-8)
    with pytest.raises(InvalidArgument, match="'roll' twice"):
        pf.actuation(ankle, joints=("pitch+roll", "roll"))
    with pytest.raises(InvalidArgument, match="no coordinate"):
        pf.actuation(ankle, joints=("pitch",))
    assert ankle.with_limits({"roll": (-0.5, 0.4)}).joint("pitch").range == ((-1.0, 1.0), (-0.5, 0.4))
    both = ankle.with_limits(pitch=(-0.2, 0.1), roll=(-0.5, 0.4))
    assert both.joint("roll").range == ((-0.2, 0.1), (-0.5, 0.4))
    with pytest.raises(InvalidArgument, match="a range; None or a cone is for 'pitch"):
        ankle.with_limits(roll=None)
    answer = pf.solve_fk(ankle, motors[0])
    assert str(pf.transmission(answer, joint="roll")) == str(pf.transmission(answer, joint="pitch+roll"))
    file = tmp_path / "ankle.toml"
    pf.save(ankle, file)
    words = ["export", str(file), "--numpy", str(tmp_path / "ankle.py"), "--joints", "pitch,roll"]
    assert pfabrik(words).exit_code == 0
    with pytest.raises(UnknownName) as refusal:
        pf.actuation(ankle, joints=("pitsch",))
    assert refusal.value.__context__ is None  # one traceback, not two


def test_numbers_of_an_import_have_the_digits_that_their_file_has() -> None:
    """What is summed on the way to a joint is written as the sum, and not as what floating point makes of it."""
    text = """<robot name="r"><link name="a"/><link name="b"/><link name="c"/>
    <joint name="p" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0.1 0.07 0.2"/><axis xyz="0 1 0"/>
      <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
    <joint name="q" type="revolute"><parent link="b"/><child link="c"/>
      <origin xyz="0.2 0.03 0.14" rpy="0 0 1.5707963267948966"/><axis xyz="0 1 0"/>
      <limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""
    for unit, factor in (("m", 1.0), ("mm", 1000.0)):
        machine = from_urdf(text, end_effector="c", actuated=["p", "q"], length_unit=unit).mechanism
        assert machine.joint("q").at == tuple(factor * each for each in (0.3, 0.1, 0.34))
        assert machine.joint("q").axis == (-1.0, 0.0, 0.0)
    fine = text.replace("0.14", "0.1400000000001234")
    assert from_urdf(fine, end_effector="c", actuated=["p", "q"]).mechanism.joint("q").at[2] == 0.2 + 0.1400000000001234
