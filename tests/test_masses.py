"""What bodies weigh and motors can do: in files, by shapes, and from and for other programs."""

from __future__ import annotations

import dataclasses
import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import pfabrik as pf
from pfabrik.cli import main
from pfabrik.errors import InvalidArgument
from pfabrik.machine.description.body_inertias import inertias_of
from pfabrik.machine.files import dumps, loads
from test_dynamics import by_mujoco, weighed

DESCRIBED = """
[[body]]
name = "{body}"
{text}
"""


@pytest.mark.parametrize(
    ("text", "place", "found"),
    [
        ("mass = -1\ncentre = [0, 0, 0]", "body[0].mass", "-1"),
        ("mass = 1", "body[0].centre", "nothing"),
        ("centre = [0, 0, 0]", "body[0].mass", "nothing"),
        ("mass = 1\ncentre = [0, 0]", "body[0].centre", "[0, 0]"),
        ("mass = 1\ncentre = [0, 0, 0]\ninertia = [1, 1, 3]", "body[0].inertia", "moments 1, 1 and 3"),
        ("mass = 1\ncentre = [0, 0, 0]\ninertia = [1, 1, 1, 2, 0, 0]", "body[0].inertia", "moments -1, 1 and 3"),
        ("mass = 1\ncentre = [0, 0, 0]\ninertia = 3", "body[0].inertia", "3"),
        ('shape = "sphere"\nat = [0, 0, 0]\ndiameter = 9\ndensity = 0', "body[0].density", "0"),
        ('shape = "sphere"\nat = [0, 0, 0]\ndiameter = 9\ndensity = 9\nmass = 3', "body[0].mass", "density"),
        ("mass = 0\ninertial = [1, 1, 1]", "body[0].inertial", "did you mean 'inertia'"),
    ],
)
def test_faults_of_masses_are_named_at_their_places(text: str, place: str, found: str) -> None:
    with pytest.raises(pf.errors.InvalidMechanism) as refused:
        loads(dumps(pf.load("stewart")) + DESCRIBED.format(body="platform", text=text))
    assert [fault.place for fault in refused.value.faults] == [place]
    assert found in refused.value.faults[0].found


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("friction = 1", "1"),
        ("friction = [1, -1]", "[1, -1]"),
        ("max_torque = 0", "0"),
        ('gear = "x"', "'x'"),
        ("rotor_inertia = -1e-5", "-1e-05"),
    ],
)
def test_faults_of_drives_are_named_at_their_places(line: str, found: str) -> None:
    text = dumps(pf.load("delta")).replace("actuated = true", f"actuated = true\n{line}", 1)
    with pytest.raises(pf.errors.InvalidMechanism) as refused:
        loads(text)
    (fault,) = refused.value.faults
    assert fault.place.endswith(line.split()[0]) and found in fault.found


def with_drives(machine: pf.Mechanism) -> pf.Mechanism:
    """The machine with masses and motors."""
    drive: dict[str, Any] = {"max_torque": 2.5, "rotor_inertia": 1.2e-5, "gear": 20, "friction": (0.1, 0.02)}
    joints = [dataclasses.replace(joint, **drive) if joint.actuated else joint for joint in machine.joints]
    task, masses = machine.task, weighed(machine).masses
    return pf.Mechanism(machine.name, joints, machine.end_effector, machine.reference_point, task=task, masses=masses)


def test_masses_and_drives_come_back_from_files() -> None:
    made = with_drives(pf.load("delta"))
    made = made.with_masses([*made.masses[:-1], pf.Mass(made.masses[-1].body, 0)])
    assert loads(dumps(made)) == made
    assert made != pf.load("delta")


@pytest.mark.parametrize("name", ["stewart", "hexaglide"])
def test_masses_and_drives_come_back_from_mujoco_but_those_made_up(name: str) -> None:
    pytest.importorskip("mujoco")
    machine = with_drives(pf.load(name))
    back = pf.interop.from_mjcf(pf.interop.to_mjcf(machine), length_unit="mm").mechanism
    masses = {each.body: each for each in back.masses}
    for each in machine.masses:
        if each.body != machine.base:
            found = masses[each.body]
            np.testing.assert_allclose(found.mass, each.mass)
            np.testing.assert_allclose(found.centre, each.centre, atol=1e-9)
            np.testing.assert_allclose(found.inertia, each.inertia, atol=1e-9 * max(each.inertia or ()))
    fields = ("max_torque", "rotor_inertia", "gear", "friction")
    assert [[getattr(joint, field) for field in fields] for joint in back.joints if joint.actuated] == [
        [2.5, 1.2e-5, 20.0, (0.1, 0.02)]
    ] * 6
    made_up = pf.interop.to_mjcf(pf.load(name), masses={"platform": 2.0})
    assert [each.body for each in pf.interop.from_mjcf(made_up).mechanism.masses] == ["platform"]


URDF = """
<robot name="arm">
  <link name="base"/>
  <link name="a">
    <inertial>
      <origin xyz="0.1 0 0" rpy="0 0 1.5707963267948966"/><mass value="2"/>
      <inertia ixx="0.01" iyy="0.02" izz="0.03" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <link name="t"><inertial><mass value="0.5"/><inertia ixx="1" iyy="0.1" izz="0.1"/></inertial></link>
  <link name="x"><inertial><mass value="0.25"/></inertial></link>
  <joint name="j" type="revolute">
    <parent link="base"/><child link="a"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="12" velocity="3"/><dynamics damping="0.3" friction="0.1"/>
  </joint>
  <joint name="k" type="revolute">
    <parent link="a"/><child link="t"/><origin xyz="0.5 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="0" velocity="0"/>
  </joint>
  <joint name="f" type="fixed"><parent link="t"/><child link="x"/><origin xyz="0.3 0 0"/></joint>
</robot>
"""


def test_armature_and_friction_of_mujocos_joints_are_those_of_the_drives() -> None:
    text = """<mujoco><default><joint armature="0.002"/></default><worldbody>
      <body name="a"><joint name="j" axis="0 1 0" damping="0.3" frictionloss="0.1"/><inertial pos="1 0 0" mass="2"
        diaginertia="1 1 1"/><body name="b"><joint name="k" type="slide" axis="1 0 0" armature="0"/>
        <inertial pos="1 0 0" mass="2" diaginertia="1 1 1"/></body></body>
      </worldbody><actuator><motor joint="j"/><motor joint="k"/></actuator></mujoco>"""
    read = pf.interop.from_mjcf(text, base="world", end_effector="b", length_unit="mm").mechanism
    turned, pushed = (read.joint(name) for name in "jk")
    assert (turned.rotor_inertia, turned.gear, turned.friction) == (0.002, None, (0.1, 0.3))
    assert (pushed.rotor_inertia, pushed.friction) == (None, None)


def test_friction_and_armature_of_passive_joints_are_noted() -> None:
    passive = "".join(
        f'<body name="{name}"><joint name="j_{name}" type="{kind}" {said}/><geom size="1"/>'
        for name, kind, said in (
            ("b", "hinge", 'damping="0.3"'),
            ("c", "ball", 'armature="0.1"'),
            ("d", "slide", 'frictionloss="2"'),
            ("e", "hinge", ""),
        )
    )
    text = f"""<mujoco><worldbody><body name="a"><joint name="j" damping="1"/><geom size="1"/>{passive}{"</body>" * 5}
      </worldbody><actuator><motor joint="j"/></actuator></mujoco>"""
    found = pf.interop.from_mjcf(text, end_effector="e")
    (note,) = (each for each in found.notes if "friction and armature" in each.what)
    assert note.names == ("j_b", "j_c", "j_d")


ACTUATORS = """<mujoco><default><default class="strong"><motor ctrlrange="-3 3" gear="50"/></default>
    <default class="servo"><position kp="1e9" forcerange="-20 30"/></default></default><worldbody>
    <body name="a"><joint name="j0" axis="0 1 0"/><geom size="1"/>
    <body name="b"><joint name="j1" axis="0 1 0" actuatorfrcrange="-120 120"/><geom size="1"/>
    <body name="c"><joint name="j2" axis="0 1 0"/><geom size="1"/>
    <body name="d"><joint name="j3" axis="0 1 0"/><geom size="1"/>
    <body name="e"><joint name="j4" type="slide" axis="0 1 0"/><geom size="1"/>
    <body name="f"><joint name="j5" axis="0 1 0"/><geom size="1"/></body></body></body></body></body></body>
    </worldbody><actuator><motor class="strong" joint="j0"/><motor class="strong" joint="j1"/>
    <position class="servo" joint="j2" ctrlrange="-1 1" gear="-2"/><velocity joint="j3" ctrlrange="-1 1"/>
    <cylinder joint="j4" forcerange="-9 0"/>
    <general joint="j5" gainprm="7" ctrlrange="-1 1"/></actuator></mujoco>"""


def test_limits_of_mujocos_actuators_are_those_of_the_drives() -> None:
    """The largest force of either way that MuJoCo lets each joint have, at any control."""
    mujoco = pytest.importorskip("mujoco")
    found = pf.interop.from_mjcf(ACTUATORS, end_effector="f", length_unit="mm")
    read = [found.mechanism.joint(f"j{k}").max_torque for k in range(6)]
    model = mujoco.MjModel.from_xml_string(ACTUATORS)
    data, forces = mujoco.MjData(model), []
    for control in (-1e9, 1e9):
        data.ctrl[:] = control
        mujoco.mj_forward(model, data)
        forces.append(data.qfrc_actuator.copy())
    least = np.abs(forces).min(axis=0)
    assert [most or 0.0 for most in read] == pytest.approx([*least[:3], 0.0, 0.0, least[5]])
    (note,) = (each for each in found.notes if "exert more one way" in each.what)
    assert note.names == ("j2", "j4")


@pytest.mark.parametrize(("effort", "most"), [("<effort>12</effort>", 12.0), ("<effort>-1</effort>", None), ("", None)])
def test_effort_and_friction_of_an_sdf_are_read(effort: str, most: float | None) -> None:
    text = f"""<sdf version="1.9"><model name="arm"><link name="base"/><link name="a"/>
      <joint name="w" type="fixed"><parent>world</parent><child>base</child></joint>
      <joint name="j" type="revolute"><parent>base</parent><child>a</child><axis><xyz>0 1 0</xyz><limit>{effort}
        </limit><dynamics><damping>0.3</damping><friction>0.1</friction></dynamics></axis></joint></model></sdf>"""
    joint = pf.interop.from_sdf(text, end_effector="a", actuated=["j"]).mechanism.joint("j")
    assert (joint.max_torque, joint.friction) == (most, (0.1, 0.3))


def test_masses_and_drives_of_a_robot_description_are_read() -> None:
    read = pf.interop.from_urdf(URDF, base="base", end_effector="t", actuated=["j", "k"], length_unit="mm")
    first, second = read.mechanism.masses
    assert (first.body, first.mass, second.body, second.mass) == ("a", 2.0, "t", 0.75)
    np.testing.assert_allclose(first.centre, [100, 0, 0])
    np.testing.assert_allclose(first.inertia, [2e4, 1e4, 3e4, 0, 0, 0], atol=1e-9)
    np.testing.assert_allclose(second.centre, [600, 0, 0])  # with what is welded to it
    np.testing.assert_allclose(second.inertia, [0, 15e3, 15e3, 0, 0, 0], atol=1e-9)
    joint, other = read.mechanism.joints
    assert (joint.max_torque, joint.friction, other.max_torque) == (12.0, (0.1, 0.3), None)
    assert any("moments of inertia that no body has" in note.what and note.names == ("t",) for note in read.notes)


def test_copies_of_bodies_have_their_masses_turned_with_them() -> None:
    text = (
        dumps(pf.load("delta"))
        + """
[[joint]]
name = "X"
type = "spherical"
connects = ["platform", "weight"]
at = [20, 0, 100]
copies = { count = 3, axis = [0, 0, 1] }

[[body]]
name = "weight"
mass = "m / 2"
centre = [30, 0, 90]
inertia = [1, 2, 2.5, 0.1, 0, 0.2]

[dimensions]
m = 1
"""
    )
    machine = loads(text)
    turn = pf.pose([0, 0, 0], rotvec=[0, 0, 2 * math.pi / 3])[:3, :3]
    first, second, _ = machine.masses
    assert (first.body, first.mass, first.inertia) == ("weight1", 0.5, (1, 2, 2.5, 0.1, 0, 0.2))
    np.testing.assert_allclose(second.centre, turn @ first.centre)
    weights = inertias_of(machine, 1e-3)
    np.testing.assert_allclose(weights["weight2"].inertia, turn @ weights["weight1"].inertia @ turn.T, atol=1e-12)


def test_a_mass_without_a_centre_is_spread_over_the_shapes_of_its_body() -> None:
    machine = pf.load("five_bar").with_shapes([pf.Shape("link1", thickness=8.0), pf.Shape("link2", thickness=8.0)])
    heavy = machine.with_masses([pf.Mass("link1", 0.2)])
    ends = [np.array(heavy.joint(name).at) for name in ("p1", "p2")]
    np.testing.assert_allclose(inertias_of(heavy, 1e-3)["link1"].centre, np.mean(ends, axis=0), atol=1e-12)
    assert loads(dumps(heavy)) == heavy
    assert pf.solve_ik(heavy, [0, 10, 180])


def test_the_command_says_what_motors_exert_along_a_path(tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("t,x,y,z\n0,0,0,5\n0.1,0,0,5\n0.2,0,0,5\n")
    words = ["effort", "linear_delta", str(tmp_path / "path.csv")]
    done = CliRunner().invoke(main, [*words, "--load", "platform=0.5,0,0,0", "--json"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["actuators"][1] == pytest.approx([0.5 * 9.81 / 3] * 3)
    assert "counted as none: carriage1" in done.stderr
    assert CliRunner().invoke(main, words).exit_code == 2
    written, by_hand = tmp_path / "written.csv", tmp_path / "by_hand.csv"
    assert CliRunner().invoke(main, [*words, "--load", "platform=0.5,0,0,0", "-o", str(written)]).exit_code == 0
    machine = pf.load("linear_delta")
    weightless = machine.with_masses(pf.Mass(body, 0.0) for body in machine.bodies[1:])
    loads = {"platform": (0.5, [0.0, 0.0, 0.0])}
    track = pf.track(weightless, [[0.0, 0.0, 5.0]] * 3, times=[0.0, 0.1, 0.2])
    pf.inverse_dynamics(track, loads=loads).to_csv(by_hand)
    assert by_hand.read_text() == written.read_text()
    with pytest.raises(InvalidArgument, match="no path with times"):
        pf.inverse_dynamics(track[0], twists=[0, 0, 0], loads=loads).to_csv(by_hand)


SHAPES: dict[str, tuple[dict[str, Any], str]] = {
    "capsule": (
        {"ends": ((0, 0, 0.1), (0.2, 0.1, 0.4)), "thickness": 0.08},
        'type="capsule" fromto="0 0 .1 .2 .1 .4" size=".04"',
    ),
    "sphere": ({"at": (0.1, 0, 0.2), "diameter": 0.3}, 'type="sphere" pos=".1 0 .2" size=".15"'),
    "box": (
        {"at": (0.1, 0.2, 0.3), "size": (0.1, 0.2, 0.4), "axes": ((0.6, 0.8, 0), (-0.8, 0.6, 0))},
        'type="box" pos=".1 .2 .3" size=".05 .1 .2" xyaxes=".6 .8 0 -.8 .6 0"',
    ),
    "disc": (
        {"at": (0.1, 0.2, 0.3), "axis": (0, 0.6, 0.8), "diameter": 0.3, "thickness": 0.1},
        'type="cylinder" pos=".1 .2 .3" zaxis="0 .6 .8" size=".15 .05"',
    ),
}


@pytest.mark.parametrize("kinds", [("capsule",), ("sphere",), ("box",), ("disc",), ("box", "capsule")])
def test_shapes_filled_evenly_weigh_as_in_mujoco(kinds: tuple[Any, ...]) -> None:
    mujoco = pytest.importorskip("mujoco")
    geoms = "".join(f'<geom {SHAPES[kind][1]} density="2700"/>' for kind in kinds)
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody><body><freejoint/>{geoms}</body></worldbody></mujoco>")
    joint = pf.Joint("A", "revolute", ("base", "arm"), at=(0, 0, 0), axis=(0, 0, 1), actuated=True)
    shapes = [pf.Shape("arm", kind, density=2.7e-6 * 1e9, **SHAPES[kind][0]) for kind in kinds]
    machine = pf.Mechanism("arm", [joint], "arm", (1, 0, 0), length_unit="m", task=("x",), shapes=shapes)
    found = inertias_of(machine, 1.0)["arm"]
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.body_iquat[1])
    axes = turn.reshape(3, 3)
    np.testing.assert_allclose(found.mass, model.body_mass[1])
    np.testing.assert_allclose(found.centre, model.body_ipos[1], atol=1e-12)
    np.testing.assert_allclose(found.inertia, axes @ np.diag(model.body_inertia[1]) @ axes.T, atol=1e-9 * found.mass)


GEOMS = """<mujoco model="arm"><compiler {compiler}/>
<asset><mesh name="m" vertex="0 0 0 .1 0 0 0 .1 0 0 0 .1"/></asset>
<default><geom density="500"/><default class="seen"><geom type="mesh" mesh="m" {seen}/></default></default>
<worldbody><geom type="plane" size="1 1 1"/><body name="a" pos=".1 .2 .3" euler="10 20 30">
  <joint name="A" axis="0 0 1"/><geom size=".02 .05 .03" type="ellipsoid" pos=".01 0 .1"/>
  <geom fromto="0 0 0 .3 0 .1" size=".01" type="capsule" mass=".4"/><geom class="seen"/>
  <body name="b" pos=".3 0 .1" quat="1 .2 .3 .1"><joint name="B" axis="0 1 0"/>
    <geom type="box" size=".02 .03 .1" pos="0 0 .1" shellinertia="true"/><geom type="sphere" size=".1" group="4"/>
    <body name="c" pos="0 0 .2"><joint name="C" axis="1 0 0"/>
      <inertial pos="0 .1 0" mass=".3" diaginertia="1e-3 2e-3 2e-3"/>
      <geom type="cylinder" size=".05 .02" euler="5 0 0"/>
      <body name="d" pos="0 0 .2"><joint name="D" axis="0 1 0"/>
        <frame pos=".1 0 0"><replicate count="3" offset=".1 0 0"><geom size=".02"/></replicate></frame>
        <geom type="mesh" mesh="m" {seen}/></body></body></body></body></worldbody>
<actuator><motor joint="A"/><motor joint="B"/><motor joint="C"/><motor joint="D"/></actuator></mujoco>"""


@pytest.mark.parametrize(
    ("compiler", "seen", "known"),
    [
        ("", 'mass="0"', "abcd"),
        ("", 'density="0.0"', "abcd"),
        ("", "", "bc"),
        ('inertiafromgeom="true"', "", "bc"),
        ('inertiafromgeom="true" inertiagrouprange="0 1"', 'group="2"', "abcd"),
        ('inertiafromgeom="false"', "", "c"),
        ('settotalmass="7"', 'mass="0"', "abcd"),
        ('settotalmass="7"', "", ""),
    ],
)
def test_bodies_of_geoms_weigh_what_mujoco_says(compiler: str, seen: str, known: str) -> None:
    """By primitives, whose meshes weigh nothing or are not counted; a body that a mesh makes heavier is named."""
    mujoco = pytest.importorskip("mujoco")
    text = GEOMS.format(compiler=compiler, seen=seen)
    bounded = text.replace("<compiler ", '<compiler boundmass="1e-12" boundinertia="1e-15" ')
    model = mujoco.MjModel.from_xml_string(bounded.replace('settotalmass="7"', ""))
    if "settotalmass" in compiler:
        mujoco.mj_setTotalmass(model, 7.0)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    read = pf.interop.from_mjcf(text, base="world", end_effector="d")
    masses = {each.body: each for each in read.mechanism.masses}
    assert "".join(sorted(masses)) == known
    for body, mass in masses.items():
        index, turn = model.body(body).id, data.body(body).ximat.reshape(3, 3)
        np.testing.assert_allclose(mass.mass, model.body_mass[index], rtol=1e-9)
        np.testing.assert_allclose(mass.centre, data.xipos[index], atol=1e-9)
        assert mass.inertia is not None
        found = inertias_of(read.mechanism, 1.0)[body].inertia
        np.testing.assert_allclose(found, turn @ np.diag(model.body_inertia[index]) @ turn.T, atol=1e-9 * mass.mass)
    told = any("masses that follow from meshes" in str(note) for note in read.notes)
    assert told == (known in ("bc", ""))


@pytest.mark.parametrize("seed", range(3))
def test_what_hangs_on_a_machine_by_joints_that_are_left_out_weighs_on_it(seed: int) -> None:
    """As in MuJoCo where it is welded on: a finger of the hand, and a pair of links that hang on the arm."""
    pytest.importorskip("mujoco")
    random = np.random.default_rng(seed)

    def body(name: str, joint: str, inner: str = "") -> str:
        place, turn = 0.2 * random.standard_normal(3), random.standard_normal(4)
        at, centre, quat = (" ".join(map(repr, each.tolist())) for each in (place, place[::-1], turn))
        inertial = f'<inertial mass="{random.uniform(0.5, 2.0)!r}" pos="{centre}" diaginertia="0.01 0.02 0.025"/>'
        return f'<body name="{name}" pos="{at}" quat="{quat}">{joint}{inertial}{inner}</body>'

    hinge = '<joint name="{}" axis="1 2 3"/>'
    finger = body("finger", '<joint name="grip" type="slide"/>')
    links = body("hung", '<joint name="swing"/>', body("low", '<joint name="twist" type="ball"/>'))
    arm = body("arm", hinge.format("j"), body("hand", hinge.format("k"), finger) + links)
    motors = '<actuator><motor joint="j"/><motor joint="k"/></actuator>'
    text = f'<mujoco><option gravity="1 -2 -9"/><worldbody>{arm}</worldbody>{motors}</mujoco>'
    found = pf.interop.from_mjcf(text, end_effector="hand")
    assert "their masses go with what they hang on: " in str(found)
    values, rates, gains = random.standard_normal((3, 2))
    solution = pf.solve_fk(found.mechanism, values)
    welded = re.sub('<joint name="(grip|swing|twist)"[^>]*>', "", text)
    forces, mass = by_mujoco(welded, values, rates, gains)
    motion: dict[str, Any] = {"twists": rates, "accelerations": gains, "gravity": (1.0, -2.0, -9.0)}
    efforts = pf.inverse_dynamics(solution, at="actuators", **motion).actuators
    np.testing.assert_allclose(efforts, forces, atol=1e-9 * np.abs(forces).max())
    np.testing.assert_allclose(pf.mass_matrix(solution, "actuators"), mass, atol=1e-9 * np.abs(mass).max())


def test_a_planar_body_may_have_its_one_moment_alone() -> None:
    """As drawings of planar machines have it; then it is a lamina, which exerts the same."""
    machine = pf.load("rrr")
    centre = np.asarray(machine.reference_point)

    def with_inertia(inertia: Any) -> pf.Mechanism:
        return machine.with_masses([pf.Mass(body, 1.5, centre, inertia) for body in machine.bodies])

    drawn, flat = with_inertia((0.0, 0.0, 80.0)), with_inertia((40.0, 40.0, 80.0))
    moves = {"twists": [3.0, -2.0, 0.0, 0.0, 0.0, 0.7], "accelerations": [9.0, 5.0, 0.0, 0.0, 0.0, -4.0]}
    efforts = [pf.inverse_dynamics(pf.solve_ik(each, each.home_pose), **moves).actuators for each in (drawn, flat)]
    np.testing.assert_allclose(*efforts, rtol=1e-12)
    with pytest.raises(pf.errors.InvalidMechanism, match="principal moments"):
        with_inertia((0.0, 80.0, 0.0))
    spatial = pf.load("stewart")
    with pytest.raises(pf.errors.InvalidMechanism, match="principal moments"):
        spatial.with_masses([pf.Mass("platform", 1.5, (0.0, 0.0, 200.0), (0.0, 0.0, 80.0))])
