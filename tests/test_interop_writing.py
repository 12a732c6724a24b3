"""Mechanisms as MuJoCo models: they start closed, stay closed, and move as our answers say; read back, they are the
same."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

import mujoco
import numpy as np
import pytest

import pfabrik as pf
from in_mujoco import Model
from machines import closure
from pfabrik.errors import InvalidArgument, UnknownName
from pfabrik.files.units import metres_of
from pfabrik.interop import from_mjcf, to_mjcf, verify
from pfabrik.interop.referee_configurations import reached_at_random

INTERPRETED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
NAMES = pf.catalog()
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


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("poses", POSES)
def test_mujoco_finds_our_answers_closed_and_closes_to_the_same_poses(name: str, poses: int) -> None:
    found = verify(pf.load(name), poses=poses)
    assert found
    assert found.poses == poses
    assert found.tolerance == 1e-9 * pf.load(name).characteristic_length


def test_the_referee_sees_a_machine_that_is_not_the_one_that_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    """A millionth of the size off, in one joint of the model: it must not agree."""
    from pfabrik.interop import referee

    whole = to_mjcf

    def bent(mechanism: pf.Mechanism) -> str:
        return whole(mechanism).replace('pos="0.1 0.02 0.0"', 'pos="0.1001 0.02 0.0"')

    monkeypatch.setattr(referee, "to_mjcf", bent)
    found = verify(pf.load("stewart"), poses=FEW)
    assert not found
    assert found.position_difference > 1e-3


@pytest.mark.parametrize("poses", POSES)
def test_newton_on_mujocos_rows_led_from_home_lands_on_our_poses(poses: int) -> None:
    mechanism = pf.load("stewart")
    model = Model.of(to_mjcf(mechanism))
    for solution in reached_at_random(mechanism, poses, np.random.default_rng(3)):
        model.lead(mechanism.actuator_names, in_si(mechanism, solution.actuators))
        position, turned = model.pose("reference_point", "site")
        assert np.linalg.norm(position * 1e3 - solution.pose[:3, 3]) <= 1e-9  # mm
        assert np.abs(turned - solution.pose[:3, :3]).max() <= 1e-11


@pytest.mark.parametrize(("name", "largest"), [("stewart", 1e-6), ("five_bar", 1e-6), ("delta", 1e-6)])
def test_servos_take_the_model_to_our_poses_and_it_stays_closed(name: str, largest: float) -> None:
    """From home, in 2.5 s, the servos' targets led there in half a second; lengths in mm."""
    mechanism = pf.load(name)
    model = Model.of(to_mjcf(mechanism))
    home = np.array([float(np.ravel(mechanism.home_coordinate(each))[0]) for each in mechanism.actuator_names])
    for solution in reached_at_random(mechanism, 1 if INTERPRETED else 2, np.random.default_rng(1)):
        mujoco.mj_resetDataKeyframe(model.model, model.data, 0)
        goal, begin, gap = in_si(mechanism, solution.actuators), in_si(mechanism, home), 0.0
        for step in range(2500):
            model.data.ctrl[:] = begin + (goal - begin) * min(1.0, step / 500)
            mujoco.mj_step(model.model, model.data)
            gap = max(gap, float(np.abs(model.rows()[0]).max()))
        position, _ = model.pose("reference_point", "site")
        assert np.linalg.norm(position / metres(mechanism) - solution.pose[:3, 3]) <= largest
        assert gap <= 1e-3 * mechanism.characteristic_length * metres(mechanism)
        assert not any(model.data.warning[kind].number for kind in range(len(model.data.warning)))


@pytest.mark.parametrize("name", NAMES)
def test_servos_that_are_asked_for_too_much_at_once_do_not_blow_up(name: str) -> None:
    mechanism = pf.load(name)
    model = Model.of(to_mjcf(mechanism))
    rng = np.random.default_rng(0)
    spans = [mechanism.joint(each).range or (-0.5, 0.5) for each in mechanism.actuator_names]
    model.data.ctrl[:] = in_si(mechanism, np.array([rng.uniform(*span) for span in spans]))
    for _ in range(300):
        mujoco.mj_step(model.model, model.data)
    assert np.isfinite(model.data.qpos).all()
    assert np.abs(model.data.qvel).max() < 1e3
    assert not any(model.data.warning[kind].number for kind in range(len(model.data.warning)))


def with_rates(mechanism: pf.Mechanism) -> pf.Mechanism:
    """With a highest speed and acceleration of every actuator, in powers of two."""
    joints = []
    for number, joint in enumerate(mechanism.joints):
        rates = (2.0 ** (number % 5), 8.0) if len(joint.driven) == 2 else 2.0 ** (number % 5)
        joints.append(dataclasses.replace(joint, max_speed=rates, max_acceleration=rates) if joint.driven else joint)
    return dataclasses.replace(mechanism, joints=joints)


@pytest.mark.parametrize("name", NAMES)
def test_what_is_written_is_read_back_as_an_equal_machine(name: str) -> None:
    mechanism = with_rates(pf.load(name))
    back = from_mjcf(to_mjcf(mechanism), length_unit=mechanism.length_unit).mechanism
    again = from_mjcf(to_mjcf(back), length_unit=back.length_unit).mechanism
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
    assert {joint.name for joint in again.joints} == {joint.name for joint in back.joints}
    solution = reached_at_random(mechanism, 1, np.random.default_rng(2))[0]
    length = mechanism.characteristic_length
    found = pf.solve_fk(back, solution.actuators, start=pf.solve_ik(back, solution.pose))
    assert found
    assert np.abs(found.pose - solution.pose).max() <= 1e-9 * max(length, 1.0)


def test_a_cone_fixed_to_what_is_welded_is_read_back_on_the_body_that_stands_for_it() -> None:
    mechanism = closure.welded_tricept()
    back = from_mjcf(to_mjcf(mechanism), length_unit=mechanism.length_unit).mechanism
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
    with pytest.raises(UnknownName, match="nothing"):
        to_mjcf(mechanism, masses={"nothing": 1.0})
    with pytest.raises(InvalidArgument, match="positive"):
        to_mjcf(mechanism, masses={body: 0.0})
    with pytest.raises(InvalidArgument, match="gravity"):
        to_mjcf(mechanism, gravity=[0, 0])


def test_a_unit_of_length_that_nobody_knows_is_refused(tmp_path: Path) -> None:
    mechanism = pf.Mechanism(
        "rods",
        [pf.Joint("A", "revolute", ("base", "rod"), at=(0, 0, 0), axis=(0, 0, 1), actuated=True)],
        "rod",
        (1, 0, 0),
        length_unit="furlong",
    )
    with pytest.raises(InvalidArgument, match="length_unit: found 'furlong'"):
        to_mjcf(mechanism, tmp_path / "rods.xml")
    with pytest.raises(InvalidArgument, match="found 'inches'; did you mean 'inch'"):
        to_mjcf(dataclasses.replace(mechanism, length_unit="inches"), tmp_path / "rods.xml")
    assert list(tmp_path.iterdir()) == []
    models = [to_mjcf(dataclasses.replace(mechanism, length_unit=unit)) for unit in ("in", "inch")]
    assert models[0].splitlines()[2:] == models[1].splitlines()[2:]


def test_what_cannot_be_written_is_told_by_its_own_name(tmp_path: Path) -> None:
    path = tmp_path / f"{'n' * 250}.xml"
    with pytest.raises(OSError) as caught:
        to_mjcf(pf.load("five_bar"), path)
    assert caught.value.filename == str(path)


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
