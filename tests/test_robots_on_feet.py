"""Robots on their feet, arms on one object, machines on each other: with MuJoCo, and each arm alone, as oracles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from command import pfabrik
from pfabrik.errors import InvalidArgument, PfabrikError, UnknownName
from pfabrik.interop import NoEndEffector

mujoco: Any = pytest.importorskip("mujoco")

LEGS = {"FL": (0.2, 0.1), "FR": (0.2, -0.1), "RL": (-0.2, 0.1), "RR": (-0.2, -0.1)}
CROUCH = {"hip": 0.0, "thigh": 0.8, "calf": -1.6}
SOLES = {"left": 0.08, "right": -0.08}
KNEES = {"hip_pitch": -0.4, "knee": 0.8, "ankle_pitch": -0.4}


def dog(floats: bool = True) -> str:
    """A quadruped as a MuJoCo model: three hinges a leg, a named ball as each foot, a keyframe in which it crouches."""
    legs = ""
    for name, (x, y) in LEGS.items():
        side = 0.08 if y > 0 else -0.08
        legs += f"""
        <body name="{name}_hip" pos="{x} {y} 0"><inertial pos="0 0 0" mass="0.6" diaginertia="1e-3 1e-3 1e-3"/>
          <joint name="{name}_hip_joint" axis="1 0 0" range="-1 1"/>
          <body name="{name}_thigh" pos="0 {side} 0"><inertial pos="0 0 -0.1" mass="1" diaginertia="5e-3 5e-3 1e-3"/>
            <joint name="{name}_thigh_joint" axis="0 1 0" range="-1.5 3.5"/>
            <body name="{name}_calf" pos="0 0 -0.2"><inertial pos="0 0 -0.1" mass="0.2" diaginertia="1e-3 1e-3 1e-4"/>
              <joint name="{name}_calf_joint" axis="0 1 0" range="-2.7 -0.5"/>
              <geom name="{name}" type="sphere" size="0.02" pos="0.01 0 -0.22"/>
            </body></body></body>"""
    motors = "".join(
        f'<motor name="{leg}_{part}" joint="{leg}_{part}_joint" ctrlrange="-25 25"/>' for leg in LEGS for part in CROUCH
    )
    free = "<freejoint/>" if floats else ""
    qpos = " ".join(["0 0 0.3 1 0 0 0"] * floats + ["0 0.8 -1.6"] * 4)
    return f"""<mujoco model="dog"><compiler angle="radian" autolimits="true"/>
      <worldbody><body name="trunk" pos="0 0 0.5">{free}
      <inertial pos="0 0 0" mass="7" diaginertia="0.1 0.1 0.02"/>{legs}
      </body></worldbody><actuator>{motors}</actuator><keyframe><key name="home" qpos="{qpos}"/></keyframe></mujoco>"""


BODY = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'


def biped(floats: bool = False) -> str:
    """Two legs of six hinges as a URDF, straight at zero, with a frame at each sole that leans.

    With `floats`, as MuJoCo reads it with a pelvis that is free.
    """
    world = '<mujoco><compiler fusestatic="false"/></mujoco><link name="world"/><joint name="float" type="floating">'
    links = [f'{world}<parent link="world"/><child link="pelvis"/></joint>'] if floats else []
    links.append(f'<link name="pelvis">{BODY}')
    for name, y in SOLES.items():
        before = "pelvis"
        for part, axis, at in (
            ("hip_yaw", "0 0 1", f"0 {y} 0"),
            ("hip_roll", "1 0 0", "0 0 -0.05"),
            ("hip_pitch", "0 1 0", "0 0 -0.05"),
            ("knee", "0 1 0", "0 0 -0.3"),
            ("ankle_pitch", "0 1 0", "0 0 -0.3"),
            ("ankle_roll", "1 0 0", "0 0 0"),
            ("sole", "", "0.02 0 -0.05"),
        ):
            link = f"{name}_sole" if part == "sole" else f"{name}_{part}_link"
            leaning = 'rpy="0 0.1 0"' if part == "sole" else ""
            moves = f'<axis xyz="{axis}"/><limit lower="-1.5" upper="1.5" effort="60" velocity="5"/>' if axis else ""
            links.append(
                f'<link name="{link}">{BODY}<joint name="{name}_{part}" type="{"revolute" if axis else "fixed"}">'
                f'<parent link="{before}"/><child link="{link}"/><origin xyz="{at}" {leaning}/>{moves}</joint>'
            )
            before = link
    return f'<robot name="biped">{"".join(links)}</robot>'


def states(solution: pf.Solution, model: Any, configuration: str | None = None) -> list[Any]:
    """MuJoCo's own states of a robot at answers."""
    found = []
    for qpos in np.atleast_2d(pf.interop.qpos(solution, model, configuration=configuration)):
        data = mujoco.MjData(model)
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        found.append(data)
    return found


def near_home(mechanism: pf.Mechanism, count: int, far: float, turned: float = 0.3, seed: int = 0) -> Any:
    """Targets around home (n, 4, 4), up to a share of L away."""
    rng = np.random.default_rng(seed)
    span = far * mechanism.characteristic_length
    at = mechanism.home_pose[:3, 3] + rng.uniform(-span, span, (count, 3))
    return pf.pose(at, rotvec=rng.uniform(-turned, turned, (count, 3)))


def test_feet_stay_where_mujoco_has_them() -> None:
    """Over 100 poses, in reach and out of it, MuJoCo's own feet do not move, and its trunk is where the answer is."""
    machine = pf.stand(dog(), list(LEGS))
    assert (machine.end_effector, pf.mobility(machine).platform, len(machine.actuator_names)) == ("trunk", 6, 12)
    answers = pf.solve_ik(machine, near_home(machine, 100, 0.4))
    assert set(answers.status) == {pf.Status.REACHED, pf.Status.PROJECTED}
    model = mujoco.MjModel.from_xml_string(dog())
    begin = states(pf.solve_ik(machine, machine.home_pose), model)[0]
    np.testing.assert_allclose(begin.qpos[7:], [0.0, 0.8, -1.6] * 4, atol=1e-9)
    for state, pose in zip(states(answers, model), answers.pose, strict=True):
        for foot in LEGS:
            np.testing.assert_allclose(state.geom(foot).xpos, begin.geom(foot).xpos, atol=1e-12)
        np.testing.assert_allclose(state.body("trunk").xpos, pose[:3, 3], atol=1e-12)
        np.testing.assert_allclose(state.body("trunk").xmat.reshape(3, 3), pose[:3, :3], atol=1e-12)
        low, high = model.jnt_range[1:].T
        assert (state.qpos[7:] >= low - 1e-9).all() and (state.qpos[7:] <= high + 1e-9).all()


@pytest.mark.parametrize("contact", ["flat", "pinned", "edge"])
def test_contacts_hold_what_they_say(contact: str) -> None:
    """A sole keeps its place; flat its frame, pinned the vertical in it, an edge the line that it rolls about."""
    at = np.array([0.05, 0.0, 0.0]) if contact == "edge" else np.zeros(3)
    held: Any = {"type": "edge", "axis": (0.0, 1.0, 0.0), "at": at} if contact == "edge" else contact
    crouched = {f"{side}_{name}": value for side in SOLES for name, value in KNEES.items()}
    machine = pf.stand(biped(), {"left_sole": held, "right_sole": "flat"}, at=crouched)
    answers = pf.solve_ik(machine, near_home(machine, 50, 0.05, 0.1))
    assert (answers.status == pf.Status.REACHED).any()
    model = mujoco.MjModel.from_xml_string(biped(floats=True))
    before, *others = states(pf.solve_ik(machine, [machine.home_pose, *answers.pose]), model)
    home, turns = before.body("left_sole").xmat.reshape(3, 3), []
    for state in others:
        frame = state.body("left_sole").xmat.reshape(3, 3)
        np.testing.assert_allclose(
            state.body("left_sole").xpos + frame @ at, before.body("left_sole").xpos + home @ at, atol=1e-10
        )
        turns.append(frame @ home.T)
        if contact != "flat":
            line = np.array([0.0, 0.0, 1.0]) if contact == "pinned" else home[:, 1]
            np.testing.assert_allclose(turns[-1] @ line, line, atol=1e-10)
    assert (np.abs(np.array(turns) - np.eye(3)).max() < 1e-10) == (contact == "flat")


def test_one_robot_from_every_file(tmp_path: Path) -> None:
    """A dog as a MuJoCo model, with a trunk that is free or held, and as a mechanism of ours: the same answers."""
    machine = pf.stand(dog(), list(LEGS))
    values = {f"{leg}_{part}_joint": value for leg in LEGS for part, value in CROUCH.items()}
    pf.save(machine, tmp_path / "dog.toml")
    held = pf.stand(dog(floats=False), list(LEGS), at=values)
    targets = near_home(machine, 20, 0.1)
    expected = pf.solve_ik(machine, targets)
    for other in (pf.load(tmp_path / "dog.toml"), held):
        moved = targets.copy()
        moved[:, :3, 3] += other.home_pose[:3, 3] - machine.home_pose[:3, 3]
        np.testing.assert_allclose(pf.solve_ik(other, moved).actuators, expected.actuators, atol=1e-7)


def test_a_mechanism_file_of_a_robot_stands_too() -> None:
    """A tree that is described here, on its feet at given angles, holds them where its own chains put them."""
    joints, hips = [], {name: (1000.0 * x, 1000.0 * y) for name, (x, y) in LEGS.items()}
    for name, (x, y) in hips.items():
        joints += [
            pf.Joint(
                f"{name}_hip", "revolute", ("trunk", f"{name}1"), (x, y, 0), (1, 0, 0), actuated=True, range=(-1, 1)
            ),
            pf.Joint(f"{name}_thigh", "revolute", (f"{name}1", f"{name}2"), (x, y, 0), (0, 1, 0), actuated=True),
            pf.Joint(f"{name}_calf", "revolute", (f"{name}2", f"{name}3"), (x, y, -200), (0, 1, 0), actuated=True),
        ]
    robot = pf.Mechanism("robot", joints, "FL3", (200, 100, -400), "trunk")
    feet: Any = {f"{name}3": {"type": "point", "at": (0, 0, -200)} for name in LEGS if name != "FL"} | {"FL3": "point"}
    angles = {f"{name}_{part}": CROUCH[part] for name in LEGS for part in ("thigh", "calf")}
    machine = pf.stand(robot, feet, at=angles)
    height = 200 * np.cos(0.8) + 200 * np.cos(0.8)
    for name, (x, y) in hips.items():
        np.testing.assert_allclose(machine.joint(f"{name}3_contact").at, (x, y, -height), atol=1e-9)
    raised = pf.solve_ik(machine, machine.home_pose[:3, 3] + (0.0, 0.0, 30.0))
    bent = np.arccos((height + 30.0) / 400.0)
    np.testing.assert_allclose(raised.actuators, [0.0, bent, -2.0 * bent] * 4, atol=1e-9)


def test_a_robot_is_told_what_it_stands_on() -> None:
    """The choices of a robot that floats begin with its feet, as many as it has, and the words that put it on them."""
    for source, read, feet, drives in (
        (dog(), pf.interop.from_mjcf, "FL,FR,RL,RR", 12),
        (biped(), pf.interop.from_urdf, "left_sole:flat,right_sole:flat", 12),
    ):
        with pytest.raises(NoEndEffector) as caught:
            read(source)
        first = caught.value.choices[0]
        assert first.options[:2] == ["--stand", feet]
        assert f"6 freedoms of {drives} drives" in str(first)


def test_the_commands_stand_follow_and_write_states(folder: Path) -> None:
    """From a robot's file to a table of its joint positions: a line of names, and a row for each target."""
    (folder / "dog.xml").write_text(dog())
    (folder / "path.csv").write_text("x,y,z\n0,0,0.3\n0.02,0,0.28\n")
    assert pfabrik("import dog.xml --stand FL,FR,RL,RR --body trunk -o dog.toml").exit_code == 0
    assert pfabrik("track dog.toml path.csv --qpos dog.xml -o states.csv").exit_code == 0
    names, *rows = (folder / "states.csv").read_text().splitlines()
    model = mujoco.MjModel.from_xml_string(dog())
    assert names.split(",")[:8] == [f"trunk_{each}" for each in ("x", "y", "z", "qw", "qx", "qy", "qz")] + [
        "FL_hip_joint"
    ]
    machine = pf.load("dog.toml")
    expected = pf.interop.qpos(pf.track(machine, [[0.0, 0.0, 0.3], [0.02, 0.0, 0.28]]), model)
    np.testing.assert_allclose([list(map(float, row.split(","))) for row in rows], expected, atol=1e-9)
    assert pfabrik("track dog.toml path.csv --qpos dog.xml").exit_code == 2


def test_angles_of_a_description_are_degrees_at_the_command(folder: Path) -> None:
    (folder / "biped.urdf").write_text(biped())
    knees = ",".join(f"{side}_{name}={np.degrees(value)}" for side in SOLES for name, value in KNEES.items())
    line = "import biped.urdf --stand left_sole:flat,right_sole:flat -o biped.toml --configuration"
    assert pfabrik(f"{line} {knees}").exit_code == 0
    crouched = {f"{side}_{name}": value for side in SOLES for name, value in KNEES.items()}
    expected = pf.stand(biped(), {"left_sole": "flat", "right_sole": "flat"}, at=crouched)
    machine = pf.load("biped.toml")
    assert machine.actuator_names == expected.actuator_names
    home = pf.solve_ik(machine, machine.home_pose)
    np.testing.assert_allclose(home.actuators, [0, 0, -0.4, 0.8, -0.4, 0] * 2, atol=1e-7)
    assert pfabrik(f"{line} left_knee=much").exit_code == 2


def test_two_arms_are_joined_by_a_command(folder: Path) -> None:
    line = "join panda panda --at 0,300,0 --at 0,-300,0 --prefix left_ --prefix right_ --hold box"
    assert pfabrik(f"{line} -o two.toml").exit_code == 0
    arm = pf.load("panda")
    expected = pf.grasp("box", {"left": (arm.at([0, 300, 0]), "flat"), "right": (arm.at([0, -300, 0]), "flat")})
    machine = pf.load("two.toml")
    np.testing.assert_allclose(machine.home_pose, expected.home_pose, atol=1e-9)
    target = machine.home_pose[:3, 3] + (20.0, -10.0, 30.0)
    found = [pf.solve_ik(each, target).actuators for each in (machine, expected)]
    np.testing.assert_allclose(*found, atol=1e-7)
    for wrong in ("--at 1,2", "--end-effector box", "--prefix a --prefix b"):
        assert pfabrik(f"{line} {wrong} -o other.toml").exit_code == 2


def test_wrong_feet_are_named() -> None:
    """What cannot be stood on, and how, is told; a part that is on no leg, one foot alone, a contact that is none."""
    cases: list[tuple[Any, dict[str, Any], type[PfabrikError], str]] = [
        (["nix"], {}, UnknownName, "nix"),
        (["FL"], {}, InvalidArgument, "body: found none"),
        (["FL", "trunk"], {}, InvalidArgument, "'trunk', which is fixed to 'trunk'"),
        ({"FL": "flot"}, {}, InvalidArgument, r"feet\['FL'\]: found 'flot'"),
        ({"FL": {"type": "edge"}, "FR": "point"}, {}, InvalidArgument, "axis: found none"),
        ({"FL": {"type": "point", "axis": (0, 0, 1)}, "FR": "point"}, {}, InvalidArgument, "none, for a point"),
        ({"FL": {"kind": "point"}}, {}, UnknownName, "kind"),
        (["FL", "FR"], {"at": {"FL_calf_joint": "a"}}, InvalidArgument, "FL_calf_joint"),
        ([], {}, InvalidArgument, "feet"),
        ("FL", {}, InvalidArgument, "feet"),
        (["FL", "FR"], {"at": "nowhere"}, UnknownName, "nowhere"),
        (["FL", "FR"], {"at": np.zeros(3)}, InvalidArgument, "qpos of shape"),
        (["FL", "FR"], {"at": {"nix": 1.0}}, UnknownName, "nix"),
        (["FL", "FR"], {"body": "nix"}, UnknownName, "nix"),
    ]
    for feet, options, error, text in cases:
        with pytest.raises(error, match=text):
            pf.stand(dog(), feet, **options)


def test_a_floating_base_is_put_wherever_it_was_at_home() -> None:
    """States are in the mechanism's base coordinates: turned away, under another keyframe of the same joints, moved."""
    away = np.array([1.0, 2.0, 0.5, np.cos(0.5), 0.0, 0.0, np.sin(0.5), *([0.1, 0.9, -1.7] * 4)])
    key = '<key name="jump" qpos="1 2 3 0 0 0 1' + " 0 0.8 -1.6" * 4 + '"/><key name="home"'
    jumping = dog().replace('<key name="home"', key)
    moved = pf.stand(dog(), list(LEGS)).at(pf.pose([5.0, 0.0, 0.0], rotvec=[0.0, 0.0, 1.0]))
    for machine, text in (
        (pf.stand(dog(), list(LEGS), at=away), dog()),
        (pf.stand(jumping, list(LEGS)), jumping),
        (moved, dog()),
    ):
        model = mujoco.MjModel.from_xml_string(text)
        answers = pf.solve_ik(machine, [machine.home_pose, *near_home(machine, 5, 0.05, 0.1)])
        begin, *others = states(answers, model)
        assert (answers.status == pf.Status.REACHED).all()
        np.testing.assert_allclose(begin.body("trunk").xpos, machine.home_pose[:3, 3], atol=1e-9)
        for state in others:
            feet = [[each.geom(foot).xpos.copy() for foot in LEGS] for each in (begin, state)]
            np.testing.assert_allclose(*feet, atol=1e-9)
    turned = pf.stand(dog(), list(LEGS), at=away)
    np.testing.assert_allclose(pf.interop.qpos(pf.solve_ik(turned, turned.home_pose), dog()), away, atol=1e-9)
    with pytest.raises(InvalidArgument, match="away from where the mechanism has them"):
        pf.interop.qpos(pf.solve_ik(moved, moved.home_pose), dog().replace('pos="0.2 0.1 0"', 'pos="0.25 0.1 0"'))


@pytest.mark.parametrize("trunk", ["welded", "waist"])
def test_all_of_a_robot_weighs_on_its_feet(trunk: str) -> None:
    """What is above the trunk, welded or by a joint that is left out, in a URDF or a model, is carried and not lost."""
    joint = '<joint name="waist" axis="0 0 1"/>' if trunk == "waist" else ""
    heavy = '<inertial pos="0 0 0" mass="20" diaginertia="1 1 1"/>'
    torso = f'<body name="torso" pos="0 0 0.1"><freejoint/>{heavy}<body name="trunk">{joint}'
    text = dog().replace('<body name="trunk" pos="0 0 0.5"><freejoint/>', torso)
    text = text.replace("</body></worldbody>", "</body></body></worldbody>")
    text = text.replace('qpos="0 0 0.3 1 0 0 0', 'qpos="0 0 0.3 1 0 0 0' + (" 0" if trunk == "waist" else ""))
    machine = pf.stand(text, list(LEGS), body="trunk")
    whole = float(mujoco.MjModel.from_xml_string(text).body_mass.sum())
    assert sum(each.mass for each in machine.masses if each.body != machine.base) == pytest.approx(whole)
    held = pf.forces(pf.solve_ik(machine, machine.home_pose), loads=weights(machine), friction=0.8)
    assert sum(held.reactions[name][2] for name in held.spare) == pytest.approx(9.81 * whole)
    rooted = (
        biped()
        .replace('<link name="pelvis">', f'<link name="rack">{BODY}<link name="pelvis">')
        .replace(
            "</robot>",
            '<joint name="bolts" type="fixed"><parent link="rack"/><child link="pelvis"/></joint></robot>',
        )
    )
    standing = pf.stand(rooted, {"left_sole": "flat", "right_sole": "flat"})
    assert standing.base == "ground"
    moving = {each.body: each.mass for each in standing.masses}
    assert moving["pelvis"] == pytest.approx(2.0)


def weights(machine: pf.Mechanism) -> Any:
    """The masses of a machine as loads."""
    return {each.body: (each.mass, each.centre) for each in machine.masses}


def most_to_spare(points: Any, centre: Any, weight: float, friction: float) -> float:
    """The largest least f_n - |f_t| / mu of feet that carry a weight, by linear programming over pyramids."""
    optimize = pytest.importorskip("scipy.optimize")
    count = len(points)
    balance = np.zeros((6, 3 * count + 1))
    for foot, (x, y, z) in enumerate(points):
        balance[:3, 3 * foot : 3 * foot + 3] = np.eye(3)
        balance[3:, 3 * foot : 3 * foot + 3] = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
    carried = [0.0, 0.0, weight, *np.cross(centre, [0.0, 0.0, weight])]
    rows = []
    for foot in range(count):
        for angle in np.arange(64) * np.pi / 32:
            row = np.zeros(3 * count + 1)
            row[3 * foot : 3 * foot + 3] = np.cos(angle) / friction, np.sin(angle) / friction, -1.0
            row[-1] = 1.0
            rows.append(row)
    cost = np.append(np.zeros(3 * count), -1.0)
    found = optimize.linprog(cost, rows, np.zeros(len(rows)), balance, carried, [(None, None)] * (3 * count + 1))
    return float(-found.fun)


def test_feet_have_to_spare_what_no_other_forces_beat() -> None:
    """Forces on the feet carry the dog, its motors exert what MuJoCo says, and no others leave the worst foot more."""
    machine, model = pf.stand(dog(), list(LEGS)), mujoco.MjModel.from_xml_string(dog())
    answers = pf.solve_ik(machine, near_home(machine, 8, 0.2))
    held = pf.forces(answers, loads=weights(machine), friction=0.6)
    assert np.all(held.reason == "")
    weight = 9.81 * sum(each.mass for each in machine.masses)
    on_feet = np.stack([held.reactions[name][:, :3] for name in held.spare], axis=1)
    np.testing.assert_allclose(on_feet.sum(axis=1), [[0.0, 0.0, weight]] * 8, atol=1e-9 * weight)
    for row, state in enumerate(states(answers, model)):
        mujoco.mj_forward(model, state)
        exerted = state.qfrc_bias.copy()
        for foot, force in zip(LEGS, on_feet[row], strict=True):
            geom = state.geom(foot)
            mujoco.mj_applyFT(model, state, -force, np.zeros(3), geom.xpos, model.geom_bodyid[geom.id], exerted)
        np.testing.assert_allclose(exerted[:6], 0.0, atol=1e-8 * weight)
        np.testing.assert_allclose(exerted[6:], held.actuators[row], atol=1e-8 * weight)
        points = [state.geom(foot).xpos for foot in LEGS]
        most = most_to_spare(points, state.subtree_com[1], weight, 0.6)
        least = min(spare[row] for spare in held.spare.values())
        assert least == pytest.approx(most, abs=2e-3 * weight)
        assert least <= most + 1e-6 * weight


def test_what_feet_cannot_hold_is_told() -> None:
    """A dog pushed over, or on ice, has a reason that names the foot; limits of motors are kept."""
    machine = pf.stand(dog(), list(LEGS))
    home = pf.solve_ik(machine, machine.home_pose)
    loads = weights(machine)
    over = pf.forces(home, [0.0, 80.0, 0.0], loads=loads, friction=0.6)
    assert "would be the first" in str(over.reason)
    assert np.isnan(over.actuators).all()
    assert pf.forces(home, [0.0, 20.0, 0.0], loads=loads, friction=0.6).reason == ""
    assert "would be the first" in str(pf.forces(home, [0.0, 20.0, 0.0], loads=loads, friction=0.05).reason)
    free = pf.forces(home, loads=loads, friction=0.6)
    most = 0.95 * float(np.abs(free.actuators).max())
    kept = pf.forces(home, loads=loads, friction=0.6, limits=most)
    assert kept.reason == ""
    assert np.abs(kept.actuators).max() <= most * (1.0 + 1e-9)
    assert min(kept.spare.values()) <= min(free.spare.values()) + 1e-6
    for wrong, text in ((0.0, "positive"), ({"nix": 0.5}, "nix")):
        with pytest.raises(PfabrikError, match=text):
            pf.forces(home, loads=loads, friction=wrong)  # type: ignore[arg-type]
    with pytest.raises(InvalidArgument, match="no passive ball"):
        pf.forces(pf.solve_ik(pf.load("panda"), pf.load("panda").home_pose), friction=0.5)


ELSEWHERE = pf.pose([30.0, -20.0, 10.0], rpy=[0.0, 0.0, 0.7])
ASKEW = pf.pose([30.0, -20.0, 10.0], rotvec=[0.3, -0.5, 0.7])


@pytest.mark.parametrize("name", pf.catalog())
def test_a_machine_elsewhere_answers_as_here(name: str) -> None:
    """Moved as a whole, a machine gives the same actuator values for targets that are moved with it."""
    machine = pf.load(name)
    motion = ASKEW if machine.task == machine.whole_task else ELSEWHERE
    moved = machine.at(motion, prefix="L_")
    assert moved.actuator_names == tuple(f"L_{each}" for each in machine.actuator_names)
    here = near_home(machine, 5, 0.02, 0.02)
    there = here.copy()
    there[:, :3, 3] = here[:, :3, 3] @ motion[:3, :3].T + motion[:3, 3]
    there[:, :3, :3] = motion[:3, :3] @ here[:, :3, :3] @ motion[:3, :3].T
    one, other = pf.solve_ik(machine, here), pf.solve_ik(moved, there)
    np.testing.assert_array_equal(one.status, other.status)
    np.testing.assert_allclose(one.actuators, other.actuators, atol=1e-9 * machine.characteristic_length)
    back = moved.at(np.linalg.inv(motion), base="again")
    np.testing.assert_allclose(back.home_pose, machine.home_pose, atol=1e-9 * machine.characteristic_length)
    assert back.base == "again"


def test_a_turn_that_leaves_a_task_no_words_is_told() -> None:
    """A task turns with its machine, from x and z to x and y; tilted askew, it has no words."""
    quarter = np.radians(90.0)
    machine = pf.load("five_bar")
    flat = pf.Mechanism(machine.name, machine.joints, machine.end_effector, base=machine.base, task=("x", "z"))
    assert flat.at(pf.pose([0.0, 0.0, 0.0], rotvec=[quarter, 0.0, 0.0])).task == ("x", "y")
    assert flat.at(pf.pose([0.0, 0.0, 0.0], rotvec=[0.0, 0.0, quarter])).task == ("y", "z")
    tripod = pf.load("rps")
    assert tripod.at(ELSEWHERE).task == tripod.task == ("z", "tilt")
    for each in (flat, tripod):
        with pytest.raises(InvalidArgument, match="no task in base coordinates"):
            each.at(ASKEW)
    assert tripod.at(ASKEW, task=("x", "y", "z")).task == ("x", "y", "z")


def test_hands_hold_a_box_where_each_arm_alone_puts_them() -> None:
    """The box of two arms is where each arm's own kinematics, given its joints, has the hand that holds it."""
    arm = pf.load("panda")
    left, right = arm.at((0.0, 300.0, 0.0)), arm.at((0.0, -300.0, 0.0))
    grips = {"left": pf.pose([0.0, 150.0, 0.0], rotvec=[0.0, 0.0, 0.3]), "right": pf.pose([0.0, -150.0, 0.0])}
    machine = pf.grasp(
        "box", {"left": (left, grips["left"]), "right": (right, (grips["right"], "flat"))}, at=(500.0, 0.0, 400.0)
    )
    counts = pf.mobility(machine)
    assert (len(machine.actuator_names), counts.platform, counts.redundancy) == (14, 6, 8)
    answers = pf.solve_ik(machine, near_home(machine, 30, 0.1, 0.2))
    assert (answers.status == pf.Status.REACHED).sum() > 10
    for side, alone in (("left", left), ("right", right)):
        place = [machine.actuator_names.index(f"{side}_{name}") for name in alone.actuator_names]
        hands = pf.solve_fk(alone, answers.actuators[:, place]).pose
        np.testing.assert_allclose(hands, answers.pose @ grips[side], atol=1e-8)


def test_two_arms_go_with_a_stream_that_they_reach() -> None:
    """Live, arms that begin where a target is stay within a thousandth of their size of a stream within reach."""
    arm = pf.load("panda")
    hands = {"left": (arm.at((0.0, 300.0, 0.0)), "flat"), "right": (arm.at((0.0, -300.0, 0.0)), "flat")}
    machine, time = pf.grasp("box", hands), np.arange(0.0, 1.0, 0.01)  # type: ignore[arg-type]
    shift = np.stack([20 * np.sin(2 * time), 30 * np.sin(3 * time), 40 * np.sin(4 * time)], axis=1)
    targets = pf.pose(machine.home_pose[:3, 3] + shift)
    driven = pf.Live(machine, speed=2.0).follow(targets, sample_time=0.01)
    assert np.linalg.norm((driven.pose - targets)[:, :3, 3], axis=1).max() < 1e-3 * machine.characteristic_length
    assert np.abs(driven.speeds).max() <= 2.0 * (1.0 + 1e-9)


def test_fingers_touch_at_points() -> None:
    """Arms as they are at home, touching at points of the hand: the object turns about what it is held at."""
    arm = pf.load("panda")
    touch: Any = {"type": "point", "at": (0.0, 0.0, 50.0)}
    fingers: Any = {name: (arm.at((0.0, y, 0.0)), touch) for name, y in (("a", 200.0), ("b", -200.0))}
    with pytest.warns(pf.errors.MobilityWarning, match="1 freedom at home"):
        machine = pf.grasp("ball", fingers)
    middle = arm.home_pose[:3, 3] + (0.0, 0.0, 50.0)
    np.testing.assert_allclose(machine.home_pose[:3, 3], middle, atol=1e-9)
    assert pf.mobility(machine).platform == 6
    assert pf.mobility(machine).uncontrolled == 1  # about the line of both


def test_a_machine_on_another() -> None:
    """A hexapod on a delta's platform is where both alone put it, one after the other."""
    low, high = pf.load("linear_delta"), pf.load("stewart")
    seat = low.home_pose[:3, 3]
    machine = pf.join(low, high.at(seat, prefix="h_", base=low.end_effector), end_effector="h_platform")
    answers = pf.solve_ik(machine, near_home(machine, 2, 0.01, 0.02))
    assert (answers.status == pf.Status.REACHED).all()
    below = pf.solve_fk(low, answers.actuators[:, :3]).pose[:, :3, 3]
    above = pf.solve_fk(high, answers.actuators[:, 3:]).pose
    np.testing.assert_allclose(above[:, :3, 3] + below, answers.pose[:, :3, 3], atol=1e-7)
    np.testing.assert_allclose(above[:, :3, :3], answers.pose[:, :3, :3], atol=1e-9)


def test_wrong_joins_are_named() -> None:
    """Names that two machines have, units that differ, hands without a place or out of reach are told."""
    arm = pf.load("panda")
    far = pf.pose([0.0, 0.0, 0.0])
    cases: list[tuple[Any, str]] = [
        (lambda: pf.join(end_effector="a"), "one or more mechanisms"),
        (lambda: pf.join(arm, arm, end_effector="flange"), "names of their own"),
        (lambda: pf.join(arm, pf.load("rpr"), end_effector="flange"), "one unit"),
        (lambda: pf.grasp("a_link2", {"a": (arm, "flat")}), "a name of its own"),
        (lambda: pf.grasp("box", {1: (arm, "flat")}), "a name"),  # type: ignore[dict-item]
        (lambda: pf.grasp("box", {}), "an arm and how it holds"),
        (lambda: pf.grasp("box", {"a": (arm, far)}), "the object's pose"),
        (lambda: pf.grasp("box", {"a": (arm, far)}, at=(9000.0, 0.0, 0.0)), "brings no nearer than"),
        (lambda: pf.grasp("box", {"a": (arm, "glue")}), "found 'glue'"),
        (lambda: pf.grasp("box", {"a": arm}), "an arm, and how it holds"),  # type: ignore[dict-item]
        (lambda: arm.at(np.zeros((4, 4))), "pose"),
        (lambda: arm.at((0.0, 0.0, 0.0), prefix=3), "prefix"),  # type: ignore[arg-type]
    ]
    for call, text in cases:
        with pytest.raises(InvalidArgument, match=text):
            call()
    low, high = pf.load("linear_delta"), pf.load("stewart")
    with pytest.raises(UnknownName, match="did you mean 'platform'"):
        pf.join(low, high.at((0.0, 0.0, 0.0), prefix="h_", base="plattform"), end_effector="h_platform")
