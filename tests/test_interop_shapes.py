"""Collision geometry of models and descriptions as shapes of a mechanism: where MuJoCo has it, and what may touch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from in_mujoco import mujoco, notes_of
from pfabrik.errors import InvalidMechanism
from pfabrik.exchange.interop import Imported, from_mjcf, from_urdf
from test_interop_reading import FIVE_BAR, FORE

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

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


KINDS = {2: "sphere", 3: "capsule", 5: "disc", 6: "box"}


def kinematics(text: str) -> tuple[Any, Any]:
    """MuJoCo's model, and its data at the first keyframe, if there is one."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_kinematics(model, data)
    return model, data


def assert_where_mujoco_has_them(shapes: Sequence[pf.Shape], model: Any, data: Any, solids: Sequence[int]) -> None:
    """Shapes in millimetres are the solids with these numbers."""
    assert len(shapes) == len(solids)
    for number in solids:
        at, axes = 1e3 * data.geom_xpos[number], data.geom_xmat[number].reshape(3, 3).T
        size, kind = 2e3 * model.geom_size[number], KINDS[int(model.geom_type[number])]
        middles = [(shape, shape.at if shape.ends is None else np.mean(shape.ends, axis=0)) for shape in shapes]
        (shape,) = (shape for shape, middle in middles if np.allclose(middle, at, atol=1e-9) and shape.kind == kind)
        if kind == "box":
            np.testing.assert_allclose(shape.size, size)
            np.testing.assert_allclose(shape.axes or np.eye(3)[:2], axes[:2], atol=1e-12)
        elif kind == "capsule":
            off = np.subtract(*shape.ends)
            assert (shape.thickness, np.linalg.norm(off)) == pytest.approx((size[0], size[1]))
            assert abs(off @ axes[2]) == pytest.approx(size[1])
        else:
            assert shape.diameter == pytest.approx(size[0])
        if kind == "disc":
            assert (shape.thickness, abs(shape.axis @ axes[2])) == pytest.approx((size[1], 1.0))


def test_geoms_that_collide_are_shapes_of_the_merged_bodies_where_mujoco_has_them() -> None:
    found = from_mjcf(WEIGHTY, end_effector="tool", configuration="bent", length_unit="mm")
    text = WEIGHTY.replace('<geom class="seen" mesh="m"/>', "").replace('<geom type="mesh" mesh="m"/>', "")
    text = text.replace('<geom type="box" mesh="m"/>', "").replace('<mesh name="m" file="nowhere.stl"/>', "")
    model, data = kinematics(text.replace("<compiler", '<compiler boundmass="1" boundinertia="1"'))
    solids = [model.geom(name).id for name in ("wall", "bone", "shell", "tip", "block")]
    assert_where_mujoco_has_them(found.mechanism.shapes, model, data, solids)
    tool = {("tool", "disc"), ("tool", "sphere"), ("tool", "box")}
    assert set(shapes_by_kind(found)) == {("world", "box"), ("upper", "capsule"), *tool}
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
    found = from_mjcf(text, **FORE, configuration="up")
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
    <mujoco><worldbody><body name="cross" pos="0 0 0.1"><joint name="jx" axis="1 0 0"/><geom size="0.01" mass="0"/>
      <body name="bar"><joint name="jy" axis="0 1 0"/>
        <body name="end" pos="0 0 0.2"><joint name="slide" type="slide" axis="0 0 1"/><geom size="0.02"/></body>
    </body></body></worldbody><actuator><motor joint="slide"/></actuator></mujoco>"""
    found = from_mjcf(crossed, end_effector="end")
    assert [joint.type for joint in found.mechanism.joints] == ["universal", "prismatic"]
    assert [shape.body for shape in found.mechanism.shapes] == ["end"]
    assert "within a joint is left out, of: cross" in notes_of(found)
    heavy = from_mjcf(crossed.replace(' mass="0"', ""), end_effector="end").mechanism
    assert [joint.type for joint in heavy.joints] == ["revolute", "revolute", "prismatic"]
    assert [shape.body for shape in heavy.shapes] == ["cross", "end"]


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
    model, data = kinematics(text)
    solids = np.flatnonzero(model.geom_contype).tolist()
    assert_where_mujoco_has_them(found.mechanism.shapes, model, data, solids)
    left_out = "geometry (1), mesh (1), sphere without its numbers (1)"
    for note in (left_out, "without a volume", "(5), of: base, tool, upper"):
        assert note in notes_of(found), note
