"""Mechanisms as MuJoCo models: they start closed, stay closed, and move as our answers say; read back, they are the
same."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from checks import INTERPRETED, home_values
from in_mujoco import Model, mujoco
from machines import closure
from pfabrik.errors import InvalidArgument, InvalidMechanism, UnknownName
from pfabrik.exchange.interop import from_mjcf, to_mjcf, verify
from pfabrik.exchange.interop.referee import reached_at_random
from pfabrik.machine.description.links import links_of
from pfabrik.machine.files.units import metres_of
from test_dynamics import weighed

LIKE_OTHERS = ("ankle_ups", "hexaglide", "linear_delta", "nrpm", "panda", "prr", "psu", "reachy_mini", "rps", "rrr")
"""Machines whose joints and loops others of the catalogue have too."""
NAMES = [pytest.param(name, marks=pytest.mark.campaign) if name in LIKE_OTHERS else name for name in pf.catalog()]
FEW, ALL = (1 if INTERPRETED else 4), 100
POSES = [FEW, pytest.param(ALL, marks=pytest.mark.campaign)]


def metres(mechanism: pf.Mechanism) -> float:
    return metres_of(mechanism.length_unit)


def in_si(mechanism: pf.Mechanism, actuators: np.ndarray) -> np.ndarray:
    turning = np.array([mechanism.joint(name).type == "revolute" for name in mechanism.actuator_names])
    return actuators * np.where(turning, 1.0, metres(mechanism))


@pytest.mark.parametrize("name", NAMES)
def test_a_model_starts_closed_with_as_many_freedoms_as_the_machine(name: str) -> None:
    mechanism = pf.load(name)
    model = Model.of(to_mjcf(mechanism))
    rows, _ = model.rows()
    assert np.abs(rows).max(initial=0.0) <= 1e-15 * max(1.0, mechanism.characteristic_length * metres(mechanism))
    assert model.rank() == model.model.nv - pf.mobility(mechanism).mobility
    position, turned = model.pose("reference_point", "site")
    np.testing.assert_allclose(position, np.array(mechanism.reference_point) * metres(mechanism), atol=1e-14)
    np.testing.assert_allclose(turned, np.eye(3), atol=1e-14)
    assert [model.model.key(index).name for index in range(model.model.nkey)] == ["home"]


@pytest.mark.parametrize("poses", POSES)
@pytest.mark.parametrize("name", NAMES)
def test_mujoco_finds_our_answers_closed_and_closes_to_the_same_poses(name: str, poses: int) -> None:
    found = verify(pf.load(name), poses=poses)
    assert found and found.poses == poses
    assert found.tolerance == 1e-9 * pf.load(name).characteristic_length


def test_the_referee_sees_a_machine_that_is_not_the_one_that_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    """A millionth of the size off, in one joint of the model: it must not agree."""
    from pfabrik.exchange.interop import referee

    bent = to_mjcf(pf.load("stewart")).replace('pos="0.1 0.02 0.0"', 'pos="0.1001 0.02 0.0"')
    monkeypatch.setattr(referee, "to_mjcf", lambda mechanism: bent)
    found = verify(pf.load("stewart"), poses=FEW)
    assert not found and found.position_difference > 1e-3


@pytest.mark.parametrize("poses", POSES)
def test_newton_on_mujocos_rows_led_from_home_lands_on_our_poses(poses: int) -> None:
    mechanism = pf.load("stewart")
    model = Model.of(to_mjcf(mechanism))
    for solution in reached_at_random(mechanism, poses, np.random.default_rng(3)):
        model.lead(mechanism.actuator_names, in_si(mechanism, solution.actuators))
        position, turned = model.pose("reference_point", "site")
        assert np.linalg.norm(position * 1e3 - solution.pose[:3, 3]) <= 1e-9  # mm
        assert np.abs(turned - solution.pose[:3, :3]).max() <= 1e-11


@pytest.mark.parametrize("name", ["stewart", "five_bar", "delta"])
def test_servos_take_the_model_to_our_poses_and_it_stays_closed(name: str) -> None:
    """From home, in 2.5 s, the servos' targets led there in half a second; lengths in mm."""
    mechanism = pf.load(name)
    model = Model.of(to_mjcf(mechanism))
    begin, gap = in_si(mechanism, home_values(mechanism)), 0.0
    (solution,) = reached_at_random(mechanism, 1, np.random.default_rng(1))
    goal = in_si(mechanism, solution.actuators)
    mujoco.mj_resetDataKeyframe(model.model, model.data, 0)
    for step in range(2500):
        model.data.ctrl[:] = begin + (goal - begin) * min(1.0, step / 500)
        mujoco.mj_step(model.model, model.data)
        gap = max(gap, float(np.abs(model.rows()[0]).max()))
    position, _ = model.pose("reference_point", "site")
    assert np.linalg.norm(position / metres(mechanism) - solution.pose[:3, 3]) <= 1e-6
    assert gap <= 1e-3 * mechanism.characteristic_length * metres(mechanism)
    assert not any(model.data.warning[kind].number for kind in range(len(model.data.warning)))


@pytest.mark.parametrize("name", ["stewart", "delta", "prs", "serial_arm", "agile_eye"])
def test_servos_that_are_asked_for_too_much_at_once_do_not_blow_up(name: str) -> None:
    mechanism = pf.load(name)
    model = Model.of(to_mjcf(mechanism))
    spans = [mechanism.joint(each).range or (-0.5, 0.5) for each in mechanism.actuator_names]
    model.data.ctrl[:] = in_si(mechanism, np.random.default_rng(0).uniform(*np.transpose(spans)))
    for _ in range(300):
        mujoco.mj_step(model.model, model.data)
    assert np.isfinite(model.data.qpos).all()
    assert np.abs(model.data.qvel).max() < 1e3
    assert not any(model.data.warning[kind].number for kind in range(len(model.data.warning)))


@pytest.mark.parametrize("name", ["stewart", "delta", "nrpm", "g1_ankle", "five_bar"])
@pytest.mark.parametrize("what", ["solids", "points", "nothing but the end effector"])
def test_models_of_machines_with_masses_stay_closed_and_still(name: str, what: str) -> None:
    """With weight, for 0.3 s: though nothing is made up of solids, and points hardly resist turning."""
    machine = weighed(pf.load(name))
    if what == "points":
        machine = machine.with_masses([dataclasses.replace(each, inertia=None) for each in machine.masses])
    elif what != "solids":
        machine = weighed(machine, own={machine.end_effector_body: 1.0})
    text = to_mjcf(machine, gravity=(0.0, 0.0, -9.81))
    assert ("made up" in text) == (what != "solids") and "damping" not in text
    model = Model.of(text)
    mujoco.mj_resetDataKeyframe(model.model, model.data, 0)
    for _ in range(300):
        mujoco.mj_step(model.model, model.data)
        assert np.abs(model.rows()[0]).max() <= 1e-2 * machine.characteristic_length * metres(machine)
    assert not any(model.data.warning[kind].number for kind in range(len(model.data.warning)))


def test_what_weighs_nothing_weighs_nothing_again_when_it_is_read_back() -> None:
    machine = weighed(pf.load("five_bar"), own={pf.load("five_bar").end_effector_body: 1.0})
    masses = {each.body: each.mass for each in read_back(machine).masses}
    assert masses == {each.body: each.mass for each in machine.masses if each.body != machine.base}


def with_rates(mechanism: pf.Mechanism) -> pf.Mechanism:
    """With a highest speed and acceleration of every actuator, in powers of two."""
    joints = []
    for number, joint in enumerate(mechanism.joints):
        rates = (2.0 ** (number % 5), 8.0) if len(joint.driven) == 2 else 2.0 ** (number % 5)
        joints.append(dataclasses.replace(joint, max_speed=rates, max_acceleration=rates) if joint.driven else joint)
    return dataclasses.replace(mechanism, joints=joints)


def read_back(mechanism: pf.Mechanism) -> pf.Mechanism:
    return from_mjcf(to_mjcf(mechanism), length_unit=mechanism.length_unit).mechanism


@pytest.mark.parametrize("name", NAMES)
def test_what_is_written_is_read_back_as_an_equal_machine(name: str) -> None:
    mechanism = with_rates(pf.load(name))
    back = read_back(mechanism)
    assert pf.mobility(back) == pf.mobility(mechanism)
    assert back.actuator_names == mechanism.actuator_names
    for one, other in zip(back.drives, mechanism.drives, strict=True):
        for what in ("max_speed", "max_acceleration"):
            np.testing.assert_allclose(getattr(one.joint, what), getattr(other.joint, what), rtol=1e-15)
    assert (back.base, back.end_effector, back.task) == (mechanism.base, mechanism.end_effector, mechanism.task)
    limited = {each.name: each for each in back.joints}
    for joint in mechanism.joints:
        if joint.name in limited and joint.range is not None:
            np.testing.assert_allclose(limited[joint.name].range, joint.range, rtol=1e-14)
        if joint.cone is not None:
            np.testing.assert_allclose(limited[joint.name].cone.axis, joint.cone.axis, atol=1e-15)
            assert limited[joint.name].cone.half_angle == joint.cone.half_angle
    if name in ("delta", "tricept"):
        assert {joint.name for joint in read_back(back).joints} == {joint.name for joint in back.joints}
    solution = reached_at_random(mechanism, 1, np.random.default_rng(2))[0]
    length = mechanism.characteristic_length
    found = pf.solve_fk(back, solution.actuators, start=pf.solve_ik(back, solution.pose))
    assert found
    assert np.abs(found.pose - solution.pose).max() <= 1e-9 * max(length, 1.0)


def test_a_cone_fixed_to_what_is_welded_is_read_back_on_the_body_that_stands_for_it() -> None:
    mechanism = closure.welded_tricept()
    back = read_back(mechanism)
    fixed_to = {joint.name: joint.cone.fixed_to for joint in mechanism.joints if joint.cone}
    assert set(fixed_to.values()) == {"plinth"}
    assert {joint.name: joint.cone.fixed_to for joint in back.joints if joint.cone} == dict.fromkeys(fixed_to, "base")


def test_masses_are_as_given_and_said_to_be_made_up_elsewhere() -> None:
    mechanism = pf.load("five_bar")
    body = next(each for each in mechanism.bodies if each != mechanism.base)
    text = to_mjcf(mechanism, masses={body: 0.75}, gravity=(0, 0, -9.81))
    model = Model.of(text).model
    assert model.body(body).mass[0] == 0.75
    np.testing.assert_array_equal(model.opt.gravity, [0, 0, -9.81])
    made_up = next(line for line in text.splitlines() if "made up" in line)
    assert body not in made_up.split()


def test_units_that_have_two_names_are_one() -> None:
    models = [to_mjcf(dataclasses.replace(pf.load("five_bar"), length_unit=unit)) for unit in ("in", "inch")]
    assert models[0].splitlines()[2:] == models[1].splitlines()[2:]


@pytest.mark.parametrize(
    ("unit", "asked", "error", "said"),
    [
        ("mm", {"masses": {"nothing": 1.0}}, UnknownName, "nothing"),
        ("mm", {"masses": {"link1": 0.0}}, InvalidArgument, "positive"),
        ("mm", {"gravity": [0, 0]}, InvalidArgument, "gravity"),
        ("furlong", {}, InvalidArgument, "length_unit: found 'furlong'"),
        ("inches", {}, InvalidArgument, "found 'inches'; did you mean 'inch'"),
        ("mm", {"path": "n" * 250 + ".xml"}, OSError, "n" * 250 + ".xml"),
    ],
)
def test_what_cannot_be_written_is_refused_and_leaves_no_file(
    unit: str, asked: dict[str, Any], error: type[Exception], said: str, tmp_path: Path
) -> None:
    mechanism = dataclasses.replace(pf.load("five_bar"), length_unit=unit)
    path = tmp_path / asked.pop("path", "rods.xml")
    with pytest.raises(error, match=said):
        to_mjcf(mechanism, path, **asked)
    assert list(tmp_path.iterdir()) == []


def test_names_that_clash_in_a_model_are_told_apart() -> None:
    """A joint called as the reference point's site, and as a coordinate of another."""
    joints = [
        pf.Joint("reference_point", "revolute", ("base", "a"), at=(0, 0, 0), axis=(0, 1, 0), actuated=True),
        pf.Joint("B -- <&>", "spherical", ("a", "b"), at=(1, 0, 0)),
        pf.Joint("C", "universal", ("b", "platform"), at=(1, 0, 1), axes=((1, 0, 0), (0, 1, 0))),
        pf.Joint("D", "revolute", ("base", "platform"), at=(0, 0, 1), axis=(0, 1, 0)),
    ]
    mechanism = pf.Mechanism("a -- b", joints, "platform", (0, 0, 1), length_unit="m")
    model = Model.of(to_mjcf(mechanism))
    assert {"B -- <&>", "C[0]", "C[1]"} <= {model.model.joint(i).name for i in range(model.model.njnt)} | {
        model.model.eq(i).name for i in range(model.model.neq)
    }
    assert model.rank() == model.model.nv - pf.mobility(mechanism).mobility


# Shapes


def hexapod(stroke: tuple[float, float] | None = (155, 280), **more: object) -> pf.Mechanism:
    """Six struts, a plate that leans, a box that is turned, a ball, and pairs that may touch."""
    shapes = [
        pf.Shape("platform", "disc", at=(0, 0, 200), axis=(0.1, 0.2, 1), diameter=60, thickness=6),
        pf.Shape("base", "box", at=(10, 0, 60), size=(40, 30, 50), axes=((0.8, 0.6, 0), (-0.36, 0.48, 0.8))),
        pf.Shape("base", "box", at=(0, 0, -30), size=(240, 200, 10)),
        pf.Shape("base", "sphere", at=(-20, 5, 10), diameter=20),
        pf.Shape("AB1", ends=((98, 28, 20), (99, 20, 40)), thickness=5),
    ]
    return pf.Mechanism.from_legs(
        "U-P*-S",
        base=[[100, 20, 0], [100, -20, 0]],
        platform=[[40, 40, 195], [40, -40, 195]],
        stroke=stroke,
        copies={"count": 3, "axis": [0, 0, 1]},
        reference_point=[0, 0, 195],
        thickness=12,
        shapes=shapes,
        ignore=[("BC1", "BC4"), ("AB2", "BC5"), ("base", "platform")],
        **more,  # type: ignore[arg-type]
    )


def geometry(mechanism: pf.Mechanism) -> dict[tuple[float, ...], tuple[str, str, np.ndarray]]:
    """Every shape by its place: its body, its kind, sizes and place; the ends of a capsule are in order."""
    links, found = links_of(mechanism), {}
    for shape, sizes, place in zip(mechanism.shapes, links.sizes, links.places.copy(), strict=True):
        if shape.kind == "capsule":
            place[:2] = sorted(place[:2].tolist(), key=lambda end: np.round(end, 6).tolist())
        found[tuple(np.round(place[0], 6))] = (shape.body, shape.kind, np.concatenate([sizes, place.ravel()]))
    return found


def welded_with_balls() -> pf.Mechanism:
    mechanism = closure.welded_tricept()
    places = np.array(mechanism.reference_point) + [[0, 0, 500 + 99 * k] for k in range(len(mechanism.bodies))]
    return mechanism.with_shapes(
        pf.Shape(body, "sphere", at=at, diameter=7) for body, at in zip(mechanism.bodies, places, strict=True)
    )


@pytest.mark.parametrize("make", [hexapod, welded_with_balls])
def test_shapes_and_pairs_that_may_touch_are_read_back(make: Callable[[], pf.Mechanism]) -> None:
    mechanism = make()
    found = from_mjcf(to_mjcf(mechanism), length_unit=mechanism.length_unit)
    back, welded = geometry(found.mechanism), {"plinth": "base", "plate": "platform"}
    assert set(back) == set(geometry(mechanism))
    for place, (body, kind, numbers) in geometry(mechanism).items():
        assert back[place][:2] == (welded.get(body, body), kind)
        np.testing.assert_allclose(back[place][2], numbers, rtol=0, atol=1e-9)
    assert found.mechanism.ignore == mechanism.ignore
    again = read_back(found.mechanism)
    assert (set(geometry(again)), again.ignore) == (set(back), mechanism.ignore)
    assert not any("touch nothing" in str(note) for note in found.notes)


def test_shapes_are_read_back_from_a_model_to_which_something_that_touches_was_added() -> None:
    table = '<worldbody><geom type="box" size="1 1 0.1" pos="0 0 -0.3"/>'
    back = from_mjcf(to_mjcf(hexapod()).replace("<worldbody>", table), length_unit="mm").mechanism
    assert len(back.shapes) == 12
    assert set(geometry(hexapod())) < set(geometry(back))


def test_a_clearance_is_read_back_with_the_struts_that_keep_it() -> None:
    mechanism = hexapod(clearance=1.5)
    back = read_back(mechanism)
    assert back.clearance == pytest.approx(1.5, rel=1e-15)
    assert sum(shape.between is not None for shape in back.shapes) == 6


@pytest.mark.parametrize(
    ("written", "edited"),
    [('clearance" data="0.0015"', 'clearance" data="-1"'), ('strut.5" data="[', 'strut.5" data="{'), ("0.012", '"x"')],
)
def test_custom_elements_that_somebody_has_edited_are_refused_with_a_sentence(written: str, edited: str) -> None:
    text = to_mjcf(hexapod(clearance=1.5)).replace("&quot;", "'").replace("'", "&quot;")
    assert written in text
    with pytest.raises(InvalidMechanism, match="custom text"):
        from_mjcf(text.replace(written, edited.replace('"x"', "&quot;x&quot;"), 1), length_unit="mm")


@pytest.mark.parametrize("stroke", [(100, 280), None])
def test_a_strut_that_no_two_halves_are_has_no_geom_but_is_read_back(stroke: tuple[float, float] | None) -> None:
    """Longer than twice the shortest, or of no range: two halves would stick out of the short one, or leave a gap."""
    text = to_mjcf(hexapod(stroke))
    model = Model.of(text).model
    assert (np.array(model.geom_group) == 3).sum() == 5
    assert len(from_mjcf(text, length_unit="mm").mechanism.shapes) == 11
    assert (np.array(Model.of(to_mjcf(hexapod((141, 280)))).model.geom_group) == 3).sum() == 5 + 12


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("order", [("cylinder", "rod"), ("rod", "cylinder")])
@pytest.mark.parametrize("home", [0.0, 30.0])
def test_halves_are_the_strut_at_all_lengths_whichever_way_its_slide_counts(
    sign: int, order: tuple[str, str], home: float
) -> None:
    """A point on the way from the one joint to the other is as deep in the two halves as in the strut."""
    travel = sorted(sign * (1 if order[1] == "rod" else -1) * np.array([-40.0, 60.0]))
    joints = [
        pf.Joint("A", "universal", ("base", "cylinder"), at=(0, 0, 0), axes=((1, 0, 0), (0, 1, 0))),
        pf.Joint("P", "prismatic", order, axis=(0, 0, sign), range=np.array(travel) + home, home=home, actuated=True),
        pf.Joint("C", "spherical", ("rod", "platform"), at=(0, 0, 150)),
        pf.Joint("D", "spherical", ("base", "platform"), at=(90, 0, 150)),
    ]
    with pytest.warns(pf.errors.MobilityWarning):
        strut = pf.Shape("rod", thickness=10, between=("A", "C"))
        mechanism = pf.Mechanism("strut", joints, "platform", (0, 0, 160), shapes=[strut])
    model = Model.of(to_mjcf(mechanism))
    geoms = [model.model.geom(f"strut_0_{side}").id for side in (1, 2)]
    for value in (*travel, 0.0):
        length = 150 + value * sign * (1 if order[1] == "rod" else -1)
        model.data.qpos[model.model.joint("P").qposadr[0]] = (value + home) * 1e-3
        mujoco.mj_kinematics(model.model, model.data)
        middles = model.data.geom_xpos[geoms] * 1e3
        halves = model.model.geom_size[geoms, 1] * 1e3
        np.testing.assert_allclose(middles[:, :2], 0, atol=1e-9)
        assert min(middles[:, 2] - halves) == pytest.approx(0, abs=1e-9)
        assert max(middles[:, 2] + halves) == pytest.approx(length)
        assert 2 * halves.sum() >= length - 1e-9
        np.testing.assert_allclose(model.model.geom_size[geoms, 0], 0.005)
