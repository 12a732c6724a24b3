"""Tasks that fit a mechanism: as the catalogue's authors chose them, in planes of any direction, and of machines that
are not quite as they were meant; and what is said where a task asks for more than the mechanism can do."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest
from click.testing import CliRunner

import pfabrik as pf
from in_mujoco import Model
from machines.redescribed import moved
from pfabrik.cli import main
from pfabrik.cli.remarks import remarks_on
from pfabrik.common.rotations import from_rotvec
from pfabrik.exchange.interop import from_mjcf, to_mjcf
from pfabrik.machine.catalog import template
from pfabrik.machine.files import loads
from pfabrik.machine.motion.fitting_task import fitting_tasks, has_dependent_coordinates, task_hint, what_follows

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

WHOLE = ("x", "y", "z", "rotation")
CHOSEN = {
    "agile_eye": "rotation",
    "ankle_rss": "tilt",
    "ankle_ups": "tilt",
    "delta": "x,y,z",
    "five_bar": "y,z",
    "g1_ankle": "tilt",
    "orthoglide": "x,y,z",
    "prr": "x,y,yaw",
    "prs": "z,tilt",
    "psu": "x,y,z",
    "rps": "z,tilt",
    "rrr": "x,y,yaw",
    "serial_arm": "x,y,z,yaw",
    "stewart": "x,y,z,rotation",
    "tricept": "x,y,z",
}


@pytest.mark.parametrize("name", CHOSEN)
def test_the_task_that_fits_is_what_the_author_of_a_machine_chose(name: str) -> None:
    assert str(fitting_tasks(pf.load(name))[0]) == CHOSEN[name]


def test_where_the_author_chose_otherwise_that_is_among_the_others() -> None:
    assert "z,tilt" in [str(task) for task in fitting_tasks(pf.load("canfield"))[:3]]


def test_a_plane_that_stands_upright_has_a_tilt_in_place_of_the_yaw() -> None:
    """What of the tilt leads out of the plane never varies: all three freedoms are set, and poses in it reached."""
    upright = moved(pf.load("rrr"), from_rotvec(np.array([np.pi / 2, 0.0, 0.0])), np.zeros(3))
    best = fitting_tasks(upright)[0]
    assert (best.words, best.count, best.n_constant) == (("x", "z", "tilt"), 3, 1)
    machine = upright._with(task=best.words)
    target = pf.pose(machine.reference_point + np.array([5.0, 0.0, -8.0]), rotvec=[0.0, 0.2, 0.0])
    solution = pf.solve_ik(machine, target)
    assert solution and solution.pose == pytest.approx(target, abs=1e-7)


def test_coordinates_that_never_vary_ask_for_nothing_and_those_that_follow_do() -> None:
    def depends(name: str, task: tuple[str, ...]) -> bool:
        return has_dependent_coordinates(pf.load(name)._with(task=task))

    assert not any(has_dependent_coordinates(pf.load(name)) for name in (*CHOSEN, "canfield"))
    assert all(depends(name, WHOLE) for name in ("rps", "canfield", "tricept", "g1_ankle"))
    assert not any(depends(name, WHOLE) for name in ("rrr", "delta", "agile_eye"))


# A delta as it comes from drawings: no two of its rods are parallel, so that its platform tilts as it moves.


@pytest.mark.parametrize("kind", ["3-RRS", "3-RPS", "3-PRS"])
def test_a_task_of_parasitic_motions_is_remarked_on(kind: str) -> None:
    """A tripod slides sideways by a hundredth of its size, made to by its tilts: x, y and z are no task for it."""
    text = template(kind)
    assert not [remark for remark in remarks_on(loads(text)) if "task" in remark]
    task = re.sub("^task = .*$", 'task = ["x", "y", "z"]', text, flags=re.MULTILINE)
    assert any(
        "hardly varies independently: a task that fits is z tilt" in remark for remark in remarks_on(loads(task))
    )


def crooked_delta() -> str:
    """The model of a delta whose balls are off by some millimetres, without what this library notes of a task."""
    delta, random = pf.load("delta"), np.random.default_rng(1)
    balls = {joint.name: np.array(joint.at) + random.normal(size=3) for joint in delta.joints if joint.at is not None}
    joints = [
        joint if joint.driven else dataclasses.replace(joint, at=balls[joint.name], cone=None) for joint in delta.joints
    ]
    machine = pf.Mechanism("crooked", joints, "platform", delta.reference_point, length_unit="mm")
    return re.sub(r"<custom>.*?</custom>", "", to_mjcf(machine), flags=re.DOTALL)


def test_an_imported_machine_reaches_where_mujoco_says_that_it_can_go() -> None:
    text = crooked_delta()
    found = from_mjcf(text, end_effector="platform", length_unit="mm")
    mechanism, model = found.mechanism, Model.of(text)
    assert mechanism.task == ("x", "y", "z")
    notes = "\n".join(map(str, found.notes))
    assert "the end effector has 3 freedoms of 6: targets set x y z, as with `--task x,y,z`" in notes
    assert not has_dependent_coordinates(mechanism)
    begin, _ = model.pose("platform")
    tilted = 0.0
    for values in np.random.default_rng(2).uniform(-0.3, 0.3, (20, 3)):
        assert model.lead(mechanism.actuator_names, values) <= 1e-12
        position, rotation = model.pose("platform")
        arm = np.array(mechanism.reference_point) - 1e3 * begin
        placed = 1e3 * position + rotation @ arm
        solution = pf.solve_ik(mechanism, placed)
        assert solution and solution.reason == ""
        assert np.abs(solution.pose[:3, :3] - rotation).max() <= 1e-7
        tilted = max(tilted, float(np.abs(rotation - np.eye(3)).max()))
    assert tilted > 1e-3


def test_a_task_that_was_asked_for_is_kept_and_named_as_the_cause(tmp_path) -> None:
    found = from_mjcf(crooked_delta(), end_effector="platform", length_unit="mm", task=WHOLE)
    mechanism = found.mechanism
    assert mechanism.task == WHOLE
    task_remark = "the task x y z rotation asks for 6 coordinates, of which the mechanism can vary 3 independently"
    fits = "a task that fits is x y z"
    home = pf.solve_ik(mechanism, mechanism.home_pose)
    missed = pf.solve_ik(mechanism, mechanism.reference_point + np.array([20.0, 10.0, -5.0]))
    travelled = pf.travel(home, along=[1, 0, 0])
    assert home and missed.status == pf.Status.PROJECTED
    assert travelled.distances[0] < 1e-3 * mechanism.characteristic_length
    for said in (str(found.notes[-1]), missed.reason, travelled[0].cause, str(travelled), missed._repr_html_()):
        assert task_remark in said and fits in said
    pf.save(mechanism, tmp_path / "crooked.toml")
    checked = CliRunner().invoke(main, ["check", str(tmp_path / "crooked.toml")])
    assert checked.exit_code == 0 and task_remark in checked.stderr and fits in checked.stderr


def test_a_limit_that_holds_an_answer_back_is_named_and_not_the_task() -> None:
    machine = pf.load("delta")
    far = pf.solve_ik(machine, machine.reference_point - np.array([0.0, 0.0, 500.0]))
    assert "task" not in far.reason and far.reason != ""
    with pytest.raises(TypeError, match="a reason a row"):
        _ = pf.solve_ik(machine, [machine.reference_point] * 2).reason


def test_what_stops_an_end_effector_where_no_limit_does_is_said() -> None:
    machine = pf.load("rrr")
    up, round_x = pf.travel(pf.solve_ik(machine, machine.home_pose), along=[0, 0, 1], about=[1, 0, 0])
    assert {up.cause, round_x.cause} == {"the mechanism has no freedom that way"}
    reached = pf.travel(pf.solve_ik(machine, machine.home_pose), along=[1, 0, 0])[0]
    assert reached.stopped_by and reached.cause == ""
    free = pf.load("five_bar").without_limits()
    out = pf.travel(pf.solve_ik(free, free.reference_point), along=[0, 0, 1])[0]
    assert out.why == "p1 stretched" and out.cause == "the links are stretched out or folded"


SET = {"tilt": 2, "yaw": 1, "rotation": 3}


@pytest.mark.parametrize("name", [name for name in pf.catalog() if name != "snake60"])
def test_a_task_of_more_coordinates_than_freedoms_has_a_hint_to_one_that_fits(name: str) -> None:
    machine = pf.load(name)
    hint, asked = task_hint(machine), sum(SET.get(word, 1) for word in machine.task)
    assert bool(hint) == (asked > pf.mobility(machine).platform)
    if hint:
        fits = hint.rpartition("fits is ")[2].split()
        assert sum(SET.get(word, 1) for word in fits) == pf.mobility(machine).platform


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("prs", "task z, tilt: x, y and yaw follow"),
        ("rps", "task z, tilt: x, y and yaw follow"),
        ("tricept", "task x, y, z: the rotation follows"),
        ("delta", ""),  # which never turns
        ("stewart", ""),
    ],
)
def test_what_follows_from_the_task_is_said_with_an_answer(name: str, said: str) -> None:
    machine = pf.load(name)
    assert what_follows(machine) == said
    assert said in str(pf.solve_ik(machine, machine.home_pose).table())
    assert ("follow" in str(pf.solve_ik(machine, machine.home_pose).table())) == bool(said)


def test_a_leg_of_five_freedoms_is_asked_for_all_five() -> None:
    """Roll, yaw and pitch of a hip, a knee and an ankle that pitches: sideways the foot goes as it rolls."""
    hinges = [("roll", "1 0 0", "0 0 1"), ("yaw", "0 0 1", "0 0 -0.1"), ("pitch", "0 1 0", "0.05 0 -0.1")]
    hinges += [("knee", "0 1 0", "0.1 0 -0.4"), ("ankle", "0 1 0", "-0.1 0 -0.4")]
    bodies = "".join(
        f'<body name="b_{name}" pos="{at}"><joint name="{name}" axis="{axis}"/><geom size=".01"/>'
        for name, axis, at in hinges
    )
    motors = "".join(f'<motor joint="{name}"/>' for name, *_ in hinges)
    text = f"""<mujoco><worldbody>{bodies}<site name="sole" pos="0.05 0.02 -0.1"/>{"</body>" * 5}</worldbody>
    <actuator>{motors}</actuator></mujoco>"""
    found = from_mjcf(text, end_effector="sole")
    mechanism, model = found.mechanism, Model.of(text)
    assert mechanism.task == ("x", "z", "rotation")
    assert fitting_tasks(mechanism)[0].count == 5
    for values in np.random.default_rng(3).uniform(-0.3, 0.3, (10, 5)):
        model.lead(mechanism.actuator_names, values)
        position, rotation = model.pose("b_ankle")
        placed = position + rotation @ np.array([0.05, 0.02, -0.1])
        assert pf.solve_ik(mechanism, pf.pose(placed, rotation=rotation))
