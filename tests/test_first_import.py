"""The first import of a file lists what its loops move; each refusal, and each lock, has a way on that works."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

import pfabrik as pf
from command import pfabrik
from in_mujoco import Model
from pfabrik.errors import InvalidArgument, InvalidMechanism, UnknownName
from pfabrik.exchange.interop import NoEndEffector, from_mjcf, from_urdf
from rounded_files import LINKAGES, model_text, planar_four_bar
from test_interop_reading import ANKLE, FIVE_BAR, MIMIC, URDF, delta

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")


def run(*words: str) -> tuple[int, str, str]:
    result = pfabrik(words)
    return result.exit_code, result.stdout, result.stderr


PARALLELOGRAM = """<robot name="lamp"><link name="base"/><link name="lower"/><link name="upper"/><link name="rod"/>
  <joint name="A" type="continuous"><parent link="base"/><child link="lower"/><axis xyz="0 1 0"/></joint>
  <joint name="B" type="continuous"><parent link="lower"/><child link="upper"/><origin xyz="0 0 .3"/>
    <axis xyz="0 1 0"/></joint>
  <joint name="D" type="continuous"><parent link="base"/><child link="rod"/><origin xyz="-.08 0 .02"/>
    <axis xyz="0 1 0"/></joint>{drives}</robot>"""
DRIVEN = '<transmission name="t"><joint name="A"/></transmission>'


def loop(height: float = 0.3, beside: float = 0.0, **more: object) -> dict[str, object]:
    """The loop of the parallelogram, its rod so long, and its two points so far apart along the pin."""
    points = [[0, 0, height], [-0.08, beside, 0.02]]
    return {"loops": [{"name": "C", "type": "ball", "links": ["rod", "upper"], "at": points, **more}]}


FILES = {
    "ankle.xml": (ANKLE, None),
    "delta.xml": (delta(), None),
    "five.xml": (FIVE_BAR, None),
    "bennett.xml": (model_text(LINKAGES["bennett"](), 6), None),
    "open chain.urdf": (re.sub("<mimic[^>]*>", "", MIMIC), None),
    "driven.urdf": (PARALLELOGRAM.format(drives=DRIVEN), loop()),
    "undriven.urdf": (PARALLELOGRAM.format(drives=""), loop()),
    "undriven, closed by a hinge.urdf": (
        PARALLELOGRAM.format(drives=""),
        loop(type="hinge", axis=[[0, 1, 0], [0, 1, 0]]),
    ),
    "bare.urdf": (URDF, None),
}


@pytest.mark.parametrize("name", FILES)
def test_each_command_that_the_first_import_prints_works(name: str, tmp_path: Path) -> None:
    text, loops = FILES[name]
    (tmp_path / name).write_text(text)
    words = ["import", str(tmp_path / name)]
    if loops is not None:
        (tmp_path / "loops.yaml").write_text(json.dumps(loops))
        words += ["--loops", str(tmp_path / "loops.yaml")]
    code, out, err = run(*words, "--unit", "mm")
    assert (code, out) == (2, "")
    commands = [shlex.split(line)[1:] for line in err.splitlines() if line.startswith("pfabrik import ")]
    assert commands
    for command in commands:
        file = str(tmp_path / command[command.index("-o") + 1])
        code, _, err = run(*command[:-1], file)
        assert code == 0, err
        machine = pf.load(file)
        assert machine.length_unit == "mm"
        assert pf.mobility(machine).platform > 0
    shown = json.loads(run(*words, "--json")[1])["choices"]
    assert [len(each["commands"]) for each in shown] == [1] * len(commands)


def test_what_moves_a_body_and_in_how_many_freedoms_is_counted() -> None:
    with pytest.raises(NoEndEffector) as caught:
        from_mjcf(delta())
    plate, tool = caught.value.choices
    assert (plate.base, plate.end_effector, tool.end_effector) == ("world", "plate", "tool")
    moved = {each.body: (each.freedoms, each.undriven, set(each.actuators)) for each in (*plate.moved, *tool.moved)}
    assert moved["plate"] == (3, 0, {"q0", "q1", "q2"})
    assert moved["arm1"] == (1, 0, {"q1"})
    assert moved["tool"] == (4, 0, {"q0", "q1", "q2", "wrist"})
    ankle = ANKLE.replace('<motor joint="motor_right"/>', "")
    with pytest.raises(NoEndEffector) as caught:
        from_mjcf(ankle)
    foot = next(each for choice in caught.value.choices for each in choice.moved if each.body == "foot")
    assert (foot.freedoms, foot.undriven, foot.actuators) == (2, 1, ("motor_left",))


def test_what_moves_the_bodies_of_a_chain_of_a_hundred_joints_is_listed_at_once() -> None:
    links = "".join(f'<link name="l{k}"/>' for k in range(101))
    hinge = (
        '<joint name="j{0}" type="continuous"><parent link="l{0}"/><child link="l{1}"/><axis xyz="0 0 1"/>{2}</joint>'
    )
    joints = "".join(hinge.format(k, k + 1, '<origin xyz="1 0 0"/>') for k in range(100))
    with pytest.raises(NoEndEffector) as caught:
        from_urdf(f'<robot name="chain">{links}{joints}</robot>')  # minutes, were bodies counted one by one
    (whole,) = caught.value.choices
    (end,) = whole.moved
    assert (end.body, end.freedoms, len(end.actuators)) == ("l100", 3, 100)


RODS = """<robot name="rods"><link name="base"/><link name="a"/><link name="b"/><link name="c"/><link name="top"/>
  <joint name="A" type="continuous"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/></joint>
  <joint name="B" type="continuous"><parent link="base"/><child link="b"/><origin xyz=".03 0 0"/>
    <axis xyz="0 1 0"/></joint>
  <joint name="C" type="continuous"><parent link="base"/><child link="c"/><origin xyz=".07 0 .01"/>
    <axis xyz="0 1 0"/></joint>
  <joint name="T" type="continuous"><parent link="a"/><child link="top"/><origin xyz="0 0 .042366"/>
    <axis xyz="0 1 0"/></joint><transmission name="t"><joint name="A"/></transmission></robot>"""


def rods(third: float) -> dict[str, object]:
    """Two more rods of a parallelogram, the last one of another length."""
    ends = (("P", "b", 0.042366, [0.03, 0, 0]), ("Q", "c", third, [0.07, 0, 0.01]))
    return {
        "loops": [
            {"name": name, "type": "hinge", "links": [link, "top"], "at": [[0, 0, length], at], "axis": [[0, 1, 0]] * 2}
            for name, link, length, at in ends
        ]
    }


def proposed(said: str) -> float:
    match = re.search(r"--within (\S+)", said)
    assert match, said
    return float(match[1])


@pytest.mark.parametrize("off", [4.9e-5, 3e-4])
def test_rods_that_are_not_equally_long_move_with_the_value_that_is_proposed(off: float) -> None:
    """With the value that is proposed the machine is a parallelogram, to what is off."""
    table = rods(0.042366 - off)
    with pytest.raises(InvalidMechanism) as caught:
        from_urdf(RODS, table, end_effector="top")
    within = proposed(str(caught.value))
    assert 0.1 * off <= within <= 10.0 * off
    moving = from_urdf(RODS, table, end_effector="top", within=within).mechanism
    assert pf.mobility(moving).platform == 1 and not pf.mobility(moving).nearly_free
    answer = pf.solve_fk(moving, [0.5])
    assert answer.residual <= 1e-9
    np.testing.assert_allclose(
        answer.pose[:3, 3], 0.042366 * np.array([np.sin(0.5), 0, np.cos(0.5)]), atol=3.0 * off, rtol=0.0
    )


LEANING = URDF.replace('rpy="1.5708 0 0"', 'rpy="1.57075 0 0"', 1).replace("1.5708", "1.5707963267948966")
HINGED = {"loops": [{"name": "tip", "type": "hinge", "links": ["l2", "r2"], "at": [[0.1, 0.1, 0], [-0.1, 0.1, 0]]}]}


def test_a_quarter_turn_typed_badly_gives_a_leg_its_freedoms_within_what_it_is_off() -> None:
    asked = {"end_effector": "l2", "actuated": ["motor_l", "motor_r"], "task": ["x", "z"]}
    found = from_urdf(LEANING, HINGED, within=1e-4, **asked)
    assert pf.mobility(found.mechanism).platform == 2
    assert any("as asked for" in str(note) for note in found.notes)
    axes = np.array([joint.axis for joint in found.mechanism.joints])
    np.testing.assert_array_equal(np.abs(axes), [[0.0, 1.0, 0.0]] * len(axes))
    with pytest.raises(InvalidArgument, match="within"):
        from_urdf(LEANING, HINGED, within=-1.0, **asked)


def test_a_gap_along_the_pin_is_a_vector_with_three_ways_on_that_work(tmp_path: Path) -> None:
    """In its plane the loop closes: as a pin it answers as the exact file, and as MuJoCo does."""
    text, asked = PARALLELOGRAM.format(drives=DRIVEN), {"end_effector": "upper", "task": ["x", "z"]}
    with pytest.raises(InvalidMechanism) as caught:
        from_urdf(text, loop(beside=0.003), **asked)
    said = str(caught.value)
    for part in ("the gap is (0, -0.003, 0) m, along the pin", "`type: pin`", "--leave-out C"):
        assert part in said, part
    axis = [[0, 1, 0], [0, 1, 0]]
    pin = from_urdf(text, loop(beside=0.003, type="pin", axis=axis), **asked).mechanism
    exact = from_urdf(text, loop(), **asked).mechanism
    np.testing.assert_allclose(pf.solve_fk(pin, [0.35]).pose, pf.solve_fk(exact, [0.35]).pose, atol=1e-12)
    np.testing.assert_allclose(pf.solve_fk(pin, [0.35]).pose[:3, 3], [0.3 * np.sin(0.35), 0, 0.3 * np.cos(0.35)])
    midway = from_urdf(text, loop(beside=0.003), within=proposed(said), **asked).mechanism
    assert pf.mobility(midway).platform == 1
    (tmp_path / "robot.urdf").write_text(text)
    (tmp_path / "loops.yaml").write_text(json.dumps(loop(beside=0.003)))
    words = ["import", str(tmp_path / "robot.urdf"), "--loops", str(tmp_path / "loops.yaml"), "--end-effector", "upper"]
    assert run(*words)[0] == 2
    code, _, err = run(*words, "--leave-out", "C", "--actuated", "A,B")
    assert code == 0 and "left out as asked for: C" in err


def test_what_is_left_out_must_be_there_and_a_mimic_may_be() -> None:
    with pytest.raises(UnknownName, match="loop, or joint that follows another"):
        from_urdf(MIMIC, end_effector="fore", leave_out=["shoulder"])
    free = from_urdf(MIMIC, end_effector="fore", leave_out=["elbow"], actuated=["shoulder", "elbow"])
    assert free.mechanism.actuator_names == ("shoulder", "elbow")


TURNED = PARALLELOGRAM.replace('xyz="-.08 0 .02"', 'xyz=".3 0 0" rpy="1.5707963 0 0"').replace("0 1 0", "0 0 -1")
TURNED = TURNED.replace("0 0 -1", "0 1 0", 2)  # the rod's own frame alone is turned, and its hinge in it


@pytest.mark.parametrize(
    ("text", "table"),
    [
        (PARALLELOGRAM, loop(height=0.9)),
        (TURNED, loop(type="hinge", axis=[[0, 1, 0]] * 2, at=[[0, 0.3, 0], [0.3, 0.001, 0]])),
    ],
)
def test_a_wide_gap_across_the_pin_or_an_axis_that_is_turned_is_no_pin(text: str, table: dict[str, object]) -> None:
    with pytest.raises(InvalidMechanism) as caught:
        from_urdf(text.format(drives=DRIVEN), table, end_effector="upper")
    assert "along the pin" not in str(caught.value) and "--within" not in str(caught.value)


@pytest.mark.parametrize("by", [1e-5, 1e-4])
def test_an_axis_that_leans_by_more_than_its_digits_moves_with_the_value_that_is_proposed(by: float) -> None:
    linkage = planar_four_bar()
    lean = linkage.hinges[1].axis + by * np.cross(linkage.hinges[1].axis, [0.3, 0.2, -0.9])
    linkage.hinges[1] = linkage.hinges[1]._replace(axis=lean / np.linalg.norm(lean))
    text, asked = model_text(linkage), {"base": "world", "end_effector": linkage.end_effector}
    locked = from_mjcf(text, **asked)
    assert pf.mobility(locked.mechanism).platform == 0
    within = proposed("\n".join(map(str, locked.notes)))
    assert 0.1 * by <= within <= 10.0 * by
    moving = from_mjcf(text, within=within, **asked)
    assert pf.mobility(moving.mechanism).platform == 1
    straight = Model.of(model_text(planar_four_bar()))
    straight.lead(linkage.drives, np.zeros(1))
    straight.lead(linkage.drives, np.array([0.3]))
    position, _ = straight.pose(linkage.end_effector)
    assert np.linalg.norm(pf.solve_fk(moving.mechanism, [0.3]).pose[:3, 3] - position) <= 10.0 * by
