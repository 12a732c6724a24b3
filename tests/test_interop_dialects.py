"""Loops in the dialects in which files tell them, and SDF: each machine against a MuJoCo model written by hand."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from in_mujoco import Model
from pfabrik.errors import InvalidMechanism
from pfabrik.interop import Imported, from_sdf, from_urdf, verify

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

POSES = 50


def notes_of(imported: Imported) -> str:
    return "\n".join(map(str, imported.notes))


def agrees(found: Imported, model: Model, body: str, reach: float = 0.5) -> None:
    """The end effector is where MuJoCo has it, to 1e-9 m, at random values of the drives around home."""
    mechanism, rng = found.mechanism, np.random.default_rng(0)
    names = mechanism.actuator_names
    home = np.array([mechanism.home_coordinate(name) for name in names])
    model.lead(names, home)
    _, begin = model.pose(body)
    for values in home + rng.uniform(-reach, reach, (POSES, len(names))):
        solution = pf.solve_fk(mechanism, values)
        assert solution
        assert model.lead(names, values) <= 1e-12
        position, turned = model.pose(body)
        assert np.linalg.norm(solution.pose[:3, 3] - position) <= 1e-9
        assert np.abs(solution.pose[:3, :3] - turned @ begin.T).max() <= 1e-9


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


@pytest.mark.parametrize(
    ("element", "kind"),
    [
        (f"<loop_joint name='C' type='spherical'>{IN_FRAMES}</loop_joint>", "balls: C"),
        (f"<loop_joint name='C' type='spherical'>{IN_FRAMES.replace('link2 ', 'link1 ')}</loop_joint>", "balls: C"),
        (f"<loop_joint name='C'>{IN_FRAMES.replace('0.1 0 0', '0 0 0')}{AXIS}</loop_joint>", "hinges: C"),
        (f"<loop_joint name='C' type='revolute'>{ENDS}{FRAMED}<axis xyz='0 1 0' frame='parent'/></loop_joint>", "hinges: C"),
        (f"<constraint name='C' type='ball'>{ENDS}{FRAMED}</constraint>", "balls: C"),
        (f"<constraint name='C' type='continuous'>{ENDS}{TURNED}{TURNED_AXES}</constraint>", "hinges: C"),
        (f"<drake:ball_constraint>{BODIES.format('drake:ball_constraint_', ONE, OTHER)}</drake:ball_constraint>", "balls"),
        (f"<gazebo><joint name='C' type='revolute'>{IN_SDF}<pose>{OTHER} 0 0 0</pose><axis><xyz>0 1 0</xyz></axis></joint></gazebo>", "hinges: C"),
        (f"<gazebo><joint name='C' type='ball'>{IN_SDF.replace('>c', '>m::c')}<pose>{OTHER} 1 2 3</pose></joint></gazebo>", "balls: C"),
        (f"<gazebo><joint name='C' type='revolute'>{IN_SDF}<pose>{OTHER} 0 0 0</pose><axis><xyz>0 1 0</xyz><limit><lower>-1</lower><upper>2</upper></limit></axis></joint></gazebo>", "welds: C:weld"),
    ],
)  # fmt: skip
def test_a_loop_that_an_element_of_a_urdf_tells_closes_it_as_in_mujoco(element: str, kind: str, tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(FOUR_BAR.format(element))
    found = from_urdf(path, end_effector="rocker", task=["tilt"])
    assert f"loops that the description tells, as {kind}" in notes_of(found)
    agrees(found, Model.of(IN_MUJOCO), "rocker")
    checked = verify(found.mechanism, poses=3, original=path)
    assert checked and checked.original
    again = {"loops": [{"links": ["rocker", "coupler"], "at": [[-0.03, 0, 0.12], [0.17, 0, 0.06]]}]}
    assert "spherical" in {joint.type for joint in from_urdf(path, again, end_effector="rocker").mechanism.joints}


def test_a_link_that_hangs_on_two_joints_closes_a_loop_whose_joint_keeps_its_range() -> None:
    closing = hinge("D", "rocker", "ground_pin", "-0.03 0 0.12").replace("continuous", "revolute")
    closing = closing.replace("</joint>", '<limit lower="-0.4" upper="0.5" effort="1" velocity="1"/></joint>')
    second = hinge("D", "ground", "rocker", "0.2 0 0") + closing.replace('"D"', '"C"').replace("ground_pin", "tip")
    text = FOUR_BAR.replace(hinge("D", "ground", "rocker", "0.2 0 0"), second).replace(
        LINKS, LINKS + '<link name="tip"/>'
    )
    tip = '<joint name="E" type="fixed"><parent link="coupler"/><child link="tip"/><origin xyz="0.17 0 0.06"/></joint>'
    found = from_urdf(text.format(tip), end_effector="rocker", task=["tilt"])
    assert found.mechanism.joint("C").range == (-0.4, 0.5)
    agrees(found, Model.of(IN_MUJOCO), "rocker", reach=0.2)


def test_of_a_slider_crank_the_slide_itself_may_close_the_loop_and_be_driven() -> None:
    """Two links on hinges at the base; a cylinder between them, told as a slide with a range, in SDF within a URDF."""
    slide = "<gazebo><joint name='C' type='prismatic'><parent>coupler</parent><child>rocker</child><pose>-0.03 0 0.12 0 0.7 0</pose><axis><xyz>1 0 0</xyz><limit><lower>-0.05</lower><upper>0.04</upper></limit></axis></joint></gazebo>"
    found = from_urdf(FOUR_BAR.format(slide), end_effector="rocker", actuated=["C"], task=["tilt"])
    assert found.mechanism.joint("C").range == (-0.05, 0.04)
    angle = 0.7
    model = IN_MUJOCO.replace(
        '<site name="c1" pos="0.17 0 0.06"/>',
        f'<body name="rod" pos="0.17 0 0.06"><joint name="C" type="slide" axis="{np.cos(angle)} 0 {-np.sin(angle)}"/><site name="c1"/></body>',
    )
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
        <body name="rod" pos="{text(b - a)}"><joint name="B" type="ball"/><site name="one" pos="{text(c - b)}"/></body></body>
      <body name="rocker" pos="{text(d)}"><joint name="D" axis="{text(TURN["D"])}"/><site name="two" pos="{text(c - d)}"/>
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


def rod_in_sdf(style: str, order: str = "ABCD", turned: Sequence[str] = (), limits: str = "") -> str:
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
        ("B", "ball", "crank", "rod"),
        ("C", "ball", "rod", "rocker"),
        ("D", "revolute", "world", "rocker"),
    ):
        parent, child = (child, parent) if name in turned else (parent, child)
        at = (Rotation.from_rotvec([0.2, 0.1, -0.4]), np.array(POINTS[name]))
        outer = PLACED.get(child, MODEL)
        pose = pose_text(at, style, "__model__") if style == "frame" else pose_text(in_frame(outer, at), style)
        axis = np.array(TURN.get(name, (0, 0, 1))) * (-1 if name in turned else 1)
        said = ' expressed_in="__model__"' if style == "chain" else ""
        axis = axis if said else at[0].inv().apply(axis)
        xyz = f"<axis><xyz{said}>{' '.join(map(repr, map(float, axis)))}</xyz>{limits if name == 'A' else ''}</axis>"
        ends = f"<parent>{parent}</parent><child>{child}</child>"
        joints[name] = f'<joint name="{name}" type="{kind}">{ends}{pose}{xyz if kind == "revolute" else ""}</joint>'
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
    model = Model.of(rod_in_mujoco())
    begin = found.mechanism.reference_point
    assert begin == pytest.approx(PLACED["rocker"][1])
    agrees(found, model, "hand", reach=0.3)
    assert verify(found.mechanism, poses=3, original=path)
