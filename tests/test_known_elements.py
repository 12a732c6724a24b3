"""What files say and nothing reads: refused or noted by name, in every dialect, against the programs' own schemas."""

from __future__ import annotations

import re
from collections.abc import Iterator
from xml.etree import ElementTree as ET

import pytest

from in_mujoco import Model, mujoco, notes_of
from pfabrik.errors import InvalidMechanism
from pfabrik.exchange.interop import from_mjcf, from_sdf, from_urdf, known_elements
from pfabrik.exchange.interop.known_mjcf import MJCF

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

ARM = """<mujoco><worldbody><body name="b"><joint name="a" axis="0 1 0"/><inertial pos="0 0 .1" mass="1"
  diaginertia=".1 .1 .1"/></body></worldbody><actuator><motor joint="a"/></actuator></mujoco>"""
URDF = """<robot name="r"><link name="base"/><link name="b"><inertial><origin xyz="0 0 .1"/><mass value="1"/>
  <inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="a" type="revolute"><parent link="base"/><child link="b"/><origin xyz="0 0 0"/><axis xyz="0 1 0"/>
  <limit lower="-1" upper="1" effort="1" velocity="1"/><dynamics damping="0"/></joint>
  <transmission name="t"><joint name="a"/></transmission></robot>"""
SDF = """<sdf version="1.7"><model name="m"><link name="b"><inertial><mass>1</mass><inertia><ixx>.1</ixx></inertia>
  </inertial></link><frame name="f" attached_to="b"><pose>0 0 0 0 0 0</pose></frame><joint name="a" type="revolute">
  <parent>world</parent><child>b</child><pose>0 0 0 0 0 0</pose><axis><xyz>0 1 0</xyz><limit><lower>-1</lower>
  <upper>1</upper></limit><dynamics/></axis></joint></model></sdf>"""
READ = {
    "mjcf": lambda text: from_mjcf(text, end_effector="b"),
    "urdf": lambda text: from_urdf(text, end_effector="b"),
    "sdf": lambda text: from_sdf(text, end_effector="b", actuated=["a"]),
}
TEXTS = {"mjcf": ARM, "urdf": URDF, "sdf": SDF}
LOOKED_INTO = {
    "mjcf": ("body", "joint", "inertial", "motor", "actuator", "worldbody"),
    "urdf": ("link", "inertial", "inertia", "mass", "origin", "joint", "limit", "axis", "dynamics", "parent", "child"),
    "sdf": ("link", "inertial", "inertia", "frame", "pose", "joint", "axis", "limit", "dynamics", "xyz"),
}


@pytest.mark.parametrize(("dialect", "tag"), [(each, tag) for each, tags in LOOKED_INTO.items() for tag in tags])
def test_what_nobody_knows_is_refused_by_its_name_wherever_it_could_move_or_weigh_something(
    dialect: str, tag: str
) -> None:
    assert READ[dialect](TEXTS[dialect]).mechanism
    for element in (each for each in ET.fromstring(TEXTS[dialect]).iter(tag)):
        assert element.tag == tag
    for is_attribute in (True, False):
        root = ET.fromstring(TEXTS[dialect])
        for element in list(root.iter(tag)):
            if is_attribute:
                element.set("swerve", "1")
            else:
                ET.SubElement(element, "swerve")
        with pytest.raises(InvalidMechanism, match=r"swerve: found an (attribute|element) that is not read"):
            READ[dialect](ET.tostring(root, encoding="unicode"))


def _schema() -> Iterator[tuple[str, str, set[str]]]:
    """Yield the parent, the name and the attributes of every element that MuJoCo has."""
    path: list[str] = []
    attributes: set[str] = set()
    for line in mujoco.mj_printSchema(False, True).splitlines():
        match = re.match(r"( *)(\(?\w+\)?\w*) \((.)\) +(.*)", line)
        if match is None:
            attributes |= set(line.split())
            continue
        path = [*path[: len(match[1]) // 3], match[2].replace("(world)", "")]
        attributes = set(match[4].split())
        yield (path[-2] if len(path) > 1 else ""), path[-1], attributes


def test_every_word_of_mujocos_own_schema_is_known() -> None:
    """And what has no entry only looks, senses or touches: these lists are of what there is at MuJoCo 4."""
    harmless = {"lengthrange", "size", "statistic", "visual", "extension", "asset", "contact", "tendon", "sensor"}
    harmless |= {"custom", "deformable", "flexcomp", "attach", "camera", "light", "plugin", "config", "mesh", "pair"}
    harmless |= {"texture", "material", "layer", "tendon", "flex", "flexstrain", "compiler"}
    inner = {"", "default", "equality", "actuator"}
    below, count = set(), 0
    for parent, name, attributes in [(*each[:2], each[2]) for each in list(_schema())]:
        if parent in harmless | below and parent != "compiler":
            below.add(name)
            continue
        kind = f"{parent}/{name}" if parent in inner and f"{parent}/{name}" in MJCF else name
        if MJCF.get(kind) is None:
            assert name in harmless | below or parent == "compiler", f"{parent}/{name}"
            continue
        words = known_elements._words(MJCF[kind] or "")
        unknown = {each for each in attributes if f"@{each}" not in words}
        assert not unknown, f"{parent}/{name}: {sorted(unknown)}"
        count += len(attributes)
    assert count > 300


def test_what_a_model_says_of_masses_by_bounds_and_actuators_is_read_as_mujoco_computes_it() -> None:
    drive = '<motor joint="a" gear="3" armature="0.5" damping="0.25"/>'
    text = ARM.replace('<motor joint="a"/>', drive).replace("<mujoco>", '<mujoco><compiler boundmass="2"/>')
    if not hasattr(mujoco.MjModel, "actuator_armature"):
        pytest.skip("this MuJoCo has no armature of actuators")
    model = Model.of(text)
    found = from_mjcf(text, end_effector="b").mechanism
    (mass,) = found.masses
    assert mass.mass == model.model.body("b").mass[0] == 2.0
    joint = found.joint("a")
    about = 0.1 + 2.0 * 0.1**2  # of the body about the hinge
    assert joint.rotor_inertia == pytest.approx(float(model.mass()[0, 0]) - about) == pytest.approx(4.5)
    model.data.qvel[0] = 1.0
    mujoco.mj_forward(model.model, model.data)
    assert joint.friction == (0.0, pytest.approx(-float(model.data.qfrc_passive[0])))


@pytest.mark.parametrize(
    ("dialect", "old", "new", "note"),
    [
        ("mjcf", 'name="b"', 'name="b" gravcomp="1"', "gravcomp of body is left out, for nothing here reads it, of: b"),
        ("mjcf", "<worldbody>", '<option gravity="0 0 0"/><worldbody>', "gravity of option is left out"),
        ("mjcf", 'axis="0 1 0"', 'axis="0 1 0" springdamper="1 1"', "springdamper of joint is left out"),
        ("urdf", "</joint>", '<safety_controller k_velocity="1"/></joint>', "<safety_controller> is left out"),
        ("urdf", "</robot>", '<gazebo reference="b"><turnGravityOff>1</turnGravityOff></gazebo></robot>', "turnGrav"),
        ("urdf", "</robot>", "<swerve/></robot>", "<swerve> is left out"),
        ("sdf", "<inertial>", "<gravity>false</gravity><inertial>", "<gravity> is left out"),
        ("sdf", "<dynamics/>", "<dynamics><spring_stiffness>3</spring_stiffness></dynamics>", "<spring_stiffness>"),
    ],
)
def test_what_is_known_and_not_read_is_noted_by_name(dialect: str, old: str, new: str, note: str) -> None:
    assert note in notes_of(READ[dialect](TEXTS[dialect].replace(old, new, 1)))


@pytest.mark.parametrize(
    ("dialect", "old", "new"),
    [
        ("mjcf", 'name="a"', 'name="a" class="main" group="3" margin="0.1" user="1" solreflimit="0.01 1"'),
        ("mjcf", "<worldbody>", '<option gravity="0 0 -9.81" timestep="0.001"/><size njmax="9"/><worldbody>'),
        ("mjcf", "<worldbody>", '<compiler coordinate="local" meshdir="m" discardvisual="true"/><worldbody>'),
        ("urdf", "</link>", '<visual><geometry><box size="1 1 1"/></geometry></visual><self_filter/></link>'),
        ("urdf", "<robot", '<robot xmlns:x="http://a.b" xml:lang="en" version="1"'),
        ("urdf", "</joint>", '<calibration rising="0"/><joint_properties friction="0.0"/></joint>'),
        ("sdf", "<inertial>", "<gravity>1</gravity><self_collide>0</self_collide><sensor name='s'/><inertial>"),
    ],
)
def test_what_only_looks_or_senses_or_is_a_setting_is_passed_over(dialect: str, old: str, new: str) -> None:
    plain, found = (READ[dialect](text) for text in (TEXTS[dialect], TEXTS[dialect].replace(old, new, 1)))
    assert found.mechanism == plain.mechanism and notes_of(found) == notes_of(plain)


def test_rotors_and_accelerations_of_descriptions_are_read() -> None:
    said = '<actuator name="m"><drake:rotor_inertia value="0.002"/><drake:gear_ratio value="50"/></actuator>'
    text = URDF.replace('<joint name="a"/>', f'<joint name="a"/>{said}')
    text = text.replace('velocity="1"', 'velocity="1" drake:acceleration="7"').replace(
        "<robot", '<robot xmlns:drake="d"'
    )
    joint = from_urdf(text, end_effector="b").mechanism.joint("a")
    assert (joint.rotor_inertia, joint.gear, joint.max_acceleration) == (0.002, 50.0, 7.0)
    said = "<drake:rotor_inertia>0.002</drake:rotor_inertia><drake:gear_ratio>50</drake:gear_ratio></joint>"
    text = SDF.replace("</joint>", said).replace("</limit>", "<drake:acceleration>7</drake:acceleration></limit>")
    found = from_sdf(text.replace("<sdf", '<sdf xmlns:drake="d"'), end_effector="b", actuated=["a"])
    joint = found.mechanism.joint("a")
    assert (joint.rotor_inertia, joint.gear, joint.max_acceleration) == (0.002, 50.0, 7.0)
