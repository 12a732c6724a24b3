"""Named joints and actuators: maps, Jacobians, torques, limits, what is feasible, and samples."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from in_mujoco import Model, mujoco
from pfabrik import Actuation, Joint, Mechanism, Status
from pfabrik.errors import InvalidArgument, UnknownName, UnsupportedMechanism

# Pitch, roll, left and right motor [rad]: rows of the analytic solution of the model's author, github.com/feidedao/
# Parallel_Ankle_Joint at 1305e88, MIT License, Copyright (c) 2026 feidedao.
PUBLISHED = [
    (-0.12557919, 0.06700554, 0.2297056, -0.1148528),
    (0.15733601, -0.07589257, -0.29569338, 0.14784669),
    (-0.08324742, 0.04391298, 0.15238781, -0.07619391),
    (0.03248401, -0.01652169, -0.05991299, 0.0299565),
    (-0.16387576, 0.08829035, 0.29981431, -0.14990716),
    (0.10831783, -0.05346798, -0.2017643, 0.10088215),
]

MAPS = [
    ("g1_ankle", ("pitch_joint", "roll_joint"), 0.25),
    ("ankle_ups", ("pivot",), 0.25),
    ("ankle_rss", ("pivot",), 0.15),
    ("five_bar", ("p1", "p2"), 0.2),
    ("five_bar", "task", 0.05),
    ("waist", ("yaw", "roll", "pitch"), 0.2),
    ("stewart", "task", 0.03),
    ("rps", "task", 0.03),
    ("delta", "task", 0.03),
]


def waist() -> Mechanism:
    """A driven yaw, and on it roll and pitch by two struts: no chain of it has a closed form."""
    joints = [
        Joint("yaw", "revolute", ("base", "hip"), at=(0, 0, 0), axis=(0, 0, 1), actuated=True, range=(-1, 1)),
        Joint("roll", "revolute", ("hip", "cross"), at=(0, 0, 50), axis=(1, 0, 0), range=(-0.5, 0.5)),
        Joint("pitch", "revolute", ("torso", "cross"), at=(0, 5, 50), axis=(0, 1, 0), range=(-0.5, 0.5)),
    ]
    for side, y in (("L", 40), ("R", -40)):
        ends, strut = (f"A{side}", f"C{side}"), (f"cylinder{side}", f"rod{side}")
        joints += [
            Joint(ends[0], "universal", ("hip", strut[0]), at=(-60, y, 0)),
            Joint(f"B{side}", "prismatic", strut, along=ends, actuated=True, range=(60, 140)),
            Joint(ends[1], "spherical", (strut[1], "torso"), at=(-60, y, 100)),
        ]
    return Mechanism(name="waist", joints=joints, end_effector="torso", reference_point=(0, 0, 150), task=["rotation"])


@cache
def actuation_of(name: str, joints: Any) -> Actuation:
    return pf.actuation(waist() if name == "waist" else pf.load(name), joints)


def near_home(a: Actuation, size: float, n: int, seed: int = 0) -> np.ndarray:
    """Coordinates around home: angles up to a size [rad], lengths up to it times L."""
    units = np.where(a._coordinates.is_angle, 1.0, a.mechanism.characteristic_length)
    return a.home + size * units * np.random.default_rng(seed).uniform(-1.0, 1.0, (n, len(a.names)))


def ankle() -> Actuation:
    return actuation_of("g1_ankle", ("pitch_joint", "roll_joint"))


every_map = pytest.mark.parametrize(
    ("name", "joints", "size"), MAPS, ids=[f"{name}-{joints}" for name, joints, _ in MAPS]
)


@every_map
def test_there_and_back_gives_the_same_joints(name: str, joints: Any, size: float) -> None:
    a = actuation_of(name, joints)
    q = near_home(a, size, 6).reshape(2, 3, -1)
    x = a.to_actuators(q)
    assert x and x.values.shape == (2, 3, len(a.mechanism.actuator_names))
    back = a.to_joints(x, start=q)
    assert back
    np.testing.assert_allclose(np.asarray(back), q, atol=1e-7 * max(1.0, np.abs(q).max()))
    np.testing.assert_array_equal(a.to_actuators(q[1, 2]).values, x.values[1, 2])


@every_map
def test_rates_are_slopes_of_the_map_and_power_in_is_power_out(name: str, joints: Any, size: float) -> None:
    """Whichever way: rates by the map, torques by its transpose, and both by their inverses."""
    a, random, step = actuation_of(name, joints), np.random.default_rng(2), 1e-5
    q, n_a = near_home(a, size, 6), len(a.mechanism.actuator_names)
    J, units = a.jacobian(q), np.where(a._coordinates.is_angle, 1.0, a.mechanism.characteristic_length)
    off = step * np.diag(units)
    ahead, behind = (a.to_actuators(q + sign * off[:, None]).values for sign in (1.0, -1.0))
    slopes = np.moveaxis((ahead - behind) / (2.0 * step * units[:, None, None]), 0, -1)
    np.testing.assert_allclose(J, slopes, rtol=1e-6, atol=2e-6 * np.abs(J).max())
    rates, torques, of_joints = random.normal(size=q.shape), random.normal(size=(6, n_a)), random.normal(size=q.shape)
    x_rates, back = a.velocities(q, rates), a.torques_to_actuators(q, of_joints)
    for made, needed, most in ((torques, a.torques_to_joints(q, torques), 1e-12), (back, of_joints, 1e-11)):
        scale = (np.abs(made) * np.abs(x_rates)).sum(1)
        assert (np.abs((made * x_rates).sum(1) - (needed * rates).sum(1)) <= most * scale).all()
    np.testing.assert_allclose(a.joint_velocities(q, x_rates), rates, atol=1e-9 * np.abs(rates).max())


def test_a_start_tells_the_assembly_mode() -> None:
    a = pf.actuation(pf.load("five_bar").without_limits(), "task")
    x = np.asarray(a.to_actuators(a.home))
    modes = pf.assembly_modes(a.mechanism, x)
    assert len(modes) > 1
    for mode in modes:
        expected = mode.pose[1:3, 3]
        np.testing.assert_allclose(np.asarray(a.to_joints(x, start=mode)), expected, atol=1e-6)
        np.testing.assert_allclose(np.asarray(a.to_joints(x, start=mode.q)), expected, atol=1e-6)
    np.testing.assert_allclose(np.asarray(a.to_joints(x)), a.home, atol=1e-6)


def test_motor_angles_are_those_of_the_ankle_s_author() -> None:
    """Of the model to 4e-5 rad; with its cranks, 17 mm long, turned by 0.02 degrees at home, to 1e-6 rad."""
    table, model = np.array(PUBLISHED), pf.load("g1_ankle")
    moved = {"closure_1": (0.0, -0.8e-6, 6.4e-6), "closure_2": (0.0, 0.9e-6, 5.1e-6)}  # the ends of the cranks [m]
    joints = [
        dataclasses.replace(joint, at=tuple(np.add(joint.at, moved.get(joint.name, 0.0)))) for joint in model.joints
    ]
    for machine, exact in ((model, 4e-5), (dataclasses.replace(model, joints=tuple(joints)), 1e-6)):
        a = pf.actuation(machine, ("pitch_joint", "roll_joint"))
        x = a.to_actuators(table[:, :2])
        assert x
        np.testing.assert_allclose(np.asarray(x), table[:, 2:], atol=exact)
        np.testing.assert_allclose(np.asarray(a.to_joints(table[:, 2:])), table[:, :2], atol=exact)


def test_the_order_of_joints_permutes_everything() -> None:
    a, b = ankle(), actuation_of("g1_ankle", ("roll_joint", "pitch_joint"))
    q = near_home(a, 0.2, 5)
    np.testing.assert_array_equal(a.to_actuators(q).values, b.to_actuators(q[:, ::-1]).values)
    np.testing.assert_array_equal(a.jacobian(q), b.jacobian(q[:, ::-1])[:, :, ::-1])
    np.testing.assert_array_equal(a.armature(q, 2.0), b.armature(q[:, ::-1], 2.0)[:, ::-1, ::-1])
    np.testing.assert_allclose(a.torque_limits(q, 3.0).box, b.torque_limits(q[:, ::-1], 3.0).box[:, ::-1], rtol=1e-13)


# With MuJoCo as the referee, on the exported model.


def closed_in_mujoco(a: Actuation, q: np.ndarray) -> tuple[Model, np.ndarray]:
    """The exported model at coordinates, and the rates of all its joints by those of the named ones, (nv, k).

    From MuJoCo's own rows alone: of the motions that these leave, those with unit rates of named joints.
    """
    model = Model.of(pf.interop.to_mjcf(a.mechanism))
    model.data.qpos[:] = pf.interop.qpos(a.to_actuators(q).solution)
    model.update()
    _, rows = model.rows()
    motions = np.linalg.svd(rows)[2][np.linalg.matrix_rank(rows, 1e-9) :].T
    return model, motions @ np.linalg.pinv(motions[[model.model.joint(name).dofadr[0] for name in a.names]])


@pytest.mark.parametrize("q", [(0.1, -0.1), (-0.5, 0.15), (0.3, 0.2)])
def test_armature_is_mujocos_mass_matrix_on_the_loops(q: tuple[float, float]) -> None:
    """The mass matrix with rotors minus that without, projected on the motions that MuJoCo's rows leave."""
    a, rotors = ankle(), np.array([0.02, 0.05])
    model, named = closed_in_mujoco(a, np.array(q))
    mass = []
    for inertia in (np.zeros(2), rotors):
        for name, value in zip(a.mechanism.actuator_names, inertia, strict=True):
            model.model.dof_armature[model.model.joint(name).dofadr[0]] = value
        mujoco.mj_fwdPosition(model.model, model.data)
        mass.append(named.T @ model.mass() @ named)
    np.testing.assert_allclose(a.armature(q, rotors), mass[1] - mass[0], atol=1e-8)
    rates = named[[model.model.joint(name).dofadr[0] for name in a.mechanism.actuator_names]]
    np.testing.assert_allclose(a.jacobian(q), rates, atol=1e-8)


@pytest.mark.parametrize(("name", "joints"), [("g1_ankle", ("pitch_joint", "roll_joint")), ("ankle_rss", "pivot")])
def test_samples_are_closed_in_mujoco(name: str, joints: Any) -> None:
    a = actuation_of(name, joints)
    sample = a.sample(20, seed=3)
    assert sample.solution and sample.q.shape == (20, 2)
    model = Model.of(pf.interop.to_mjcf(a.mechanism))
    for qpos in sample.qpos:
        model.data.qpos[:] = qpos
        model.update()
        assert np.abs(model.rows()[0]).max() <= 1e-9
    np.testing.assert_array_equal(sample.q, a.sample(20, seed=3).q)
    assert (sample.q >= a.low).all() and (sample.q <= a.high).all() and (a.margin(sample.q).margin >= 0.0).all()


# Beyond reach.


def test_coordinates_out_of_reach_are_projected_and_the_limit_is_named() -> None:
    a = ankle()
    q = np.array([[0.1, 0.1], [0.0, 0.4], [0.5, 0.25], [7.0, 0.0]])
    x, margin = a.to_actuators(q), a.margin(q)
    assert list(np.asarray(x.status)) == [Status.REACHED, Status.PROJECTED, Status.PROJECTED, Status.PROJECTED]
    assert not x and [(limit.joint, limit.bound) for limit in x.solution[1].active_limits] == [("roll_joint", "max")]
    assert (margin.margin > 0.0).tolist() == [True, False, False, False]
    assert margin.bound[1:].tolist() == ["max", "stretched", "max"]
    assert margin.joint[1:].tolist() == ["roll_joint", "right_motor_joint", "pitch_joint"]
    np.testing.assert_allclose(a.to_joints(x.values[1]).values, [0.0, a.high[1]], atol=1e-6)


@pytest.mark.compiled
def test_nothing_is_nan_at_and_beyond_dead_points() -> None:
    """From home into the corner where a crank and its rod are in line, and on."""
    a = ankle()
    q = np.linspace(0.0, 1.0, 40)[:, None] * np.array([0.6, 0.35])
    inside = a.margin(q).margin > 0.0
    last = int(inside.argmin()) - 1
    low, high = q[last], q[last + 1]
    for _ in range(60):  # the dead point itself, to rounding
        middle = 0.5 * (low + high)
        low, high = (middle, high) if a.margin(middle).margin > 0.0 else (low, middle)
    q = np.vstack([q, low, high])
    margin = a.margin(q)
    assert abs(margin.margin[-2]) < 1e-3
    assert margin.bound[-2] == "dead point" and margin.joint[-2].endswith("motor_joint")
    assert margin.bound[last + 1] == "stretched" and margin.margin[-1] <= 1e-3
    force = a.torques_to_actuators(q, [1.0, 1.0])
    for values in (a.to_actuators(q).values, a.jacobian(q), force, a.armature(q, 1.0), margin.margin):
        assert np.isfinite(values).all()
    for capacity in (a.torque_limits(q, 5.0), a.speed_limits(q, 5.0)):
        assert np.isfinite(capacity.box).all() and np.isfinite(capacity.offsets).all()


# Torque and speed limits.


@every_map
def test_torque_limits_hold_what_actuators_can_make(name: str, joints: Any, size: float) -> None:
    """Random torques within their limits are in the set; the corners of the box are made within them; more is not."""
    a, random = actuation_of(name, joints), np.random.default_rng(5)
    q = near_home(a, size, 1)[0]
    most = random.uniform(1.0, 2.0, len(a.mechanism.actuator_names))
    capacity = a.torque_limits(q, most)
    made = a.torques_to_joints(q, random.uniform(-most, most, (200, len(most))))
    assert capacity.contains(made * (1.0 - 1e-12)).all()
    corners = capacity.box * random.choice([-1.0, 1.0], (50, len(a.names)))
    assert (np.abs(a.torques_to_actuators(q, corners)) <= most * (1.0 + 1e-9)).all()
    alone = np.diag(capacity.alone)
    assert capacity.contains(alone * (1.0 - 1e-9)).all() and not capacity.contains(alone * (1.0 + 1e-6)).any()
    torques = a.torques_to_actuators(q, alone)
    np.testing.assert_allclose(np.abs(torques / most).max(axis=1), 1.0, rtol=1e-9)


def test_speed_limits_are_those_of_the_actuators() -> None:
    a, q = ankle(), np.array([[0.1, 0.05], [-0.4, 0.1]])
    capacity = a.speed_limits(q, [3.0, 4.0])
    random = np.random.default_rng(6).normal(size=(50, 2, 2)) * 3.0
    fast = np.abs(a.velocities(q, random)) > [3.0, 4.0]
    np.testing.assert_array_equal(capacity.contains(random), ~fast.any(axis=-1))


def test_the_polygon_of_torques_has_the_corners_of_extreme_motors() -> None:
    a, q = ankle(), np.array([0.2, -0.1])
    extreme = a.torques_to_joints(q, np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]]) * 10.0)
    corners = a.torque_limits(q, 10.0).polygon()
    assert len(corners) == 4
    gaps = np.linalg.norm(corners[:, None] - extreme[None], axis=2)
    np.testing.assert_allclose(gaps.min(axis=0), 0.0, atol=1e-9)


def redundant_ankle() -> Mechanism:
    """A universal joint that three struts tilt: one more than it needs."""
    legs = pf.Leg(
        "U-P*-S", base=[[-80, 48, 0], [-80, -48, 0], [90, 0, 0]], platform=[[-64, 36, 99], [-64, -36, 99], [60, 0, 99]]
    )
    pivot = Joint("pivot", "universal", ("base", "platform"), at=(0, 0, 99), axes=[[0, 1, 0], [1, 0, 0]])
    return Mechanism.from_legs(legs, joints=[pivot], task=["tilt"], reference_point=(0, 0, 99))


def test_torques_of_redundant_actuators_have_the_least_norm() -> None:
    a, q = pf.actuation(redundant_ankle(), "pivot"), np.array([0.1, -0.05])
    assert a.is_redundant and not ankle().is_redundant
    wanted = np.array([30.0, -20.0])
    forces = a.torques_to_actuators(q, wanted)
    np.testing.assert_allclose(a.torques_to_joints(q, forces), wanted, atol=1e-9)
    idle = np.linalg.svd(a.jacobian(q).T)[2][2]
    assert abs(forces @ idle) < 1e-9
    np.testing.assert_allclose(a.torques_to_joints(q, idle), 0.0, atol=1e-9)
    capacity = a.torque_limits(q, 5.0)
    made = a.torques_to_joints(q, np.random.default_rng(7).uniform(-5.0, 5.0, (500, 3)))
    assert capacity.contains(made).all() and len(capacity.polygon()) == 6


# What is feasible.


@pytest.mark.compiled
def test_the_hull_is_feasible_and_says_what_is_lost() -> None:
    a = ankle()
    hull = a.hull()
    random = np.random.default_rng(8).uniform(a.low, a.high, (2000, 2))
    feasible = np.asarray(a.to_actuators(random).status) == Status.REACHED
    inside = hull.contains(random)
    assert (feasible | ~inside).mean() > 0.999
    assert hull.share_lost == pytest.approx(1.0 - feasible.mean(), abs=0.015)
    assert hull.share_cut == pytest.approx(1.0 - inside.mean(), abs=0.02) and hull.share_cut < hull.share_lost + 0.005
    assert hull.contains(a.home) and hull.limits[-1][0]
    corners = hull.polygon()
    after = np.roll(corners, -1, axis=0)
    area = 0.5 * np.sum(corners[:, 0] * after[:, 1] - corners[:, 1] * after[:, 0])
    assert area / np.prod(a.high - a.low) == pytest.approx(1.0 - hull.share_cut, abs=0.02)


# Wrong calls.


def half_driven() -> Mechanism:
    joints = [
        Joint("a", "revolute", ("base", "link"), at=(0, 0, 0), axis=(0, 0, 1), actuated=True),
        Joint("b", "revolute", ("link", "tip"), at=(1, 0, 0), axis=(0, 0, 1)),
    ]
    return Mechanism("half driven", joints, "tip", (2, 0, 0))


@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        # The arms of a redundant hexapod turn while its platform rests.
        (lambda: actuation_of("nrpm", "task"), UnsupportedMechanism, "actuators: with them at rest, .* can still"),
        # A way through a strut has six coordinates, of which two are independent.
        (lambda: actuation_of("ankle_ups", ("AL", "BL", "CL")), UnsupportedMechanism, r"AL\[0\], .* 2 freedoms, not 6"),
        (lambda: pf.actuation(half_driven(), ("a", "b")), UnsupportedMechanism, "with them locked, b can"),
        (lambda: pf.actuation(pf.load("g1_ankle"), ("pitch",)), UnknownName, "did you mean 'pitch_joint'"),
        (lambda: pf.actuation(pf.load("g1_ankle"), ("pitch_joint",)), InvalidArgument, "in series"),
        (lambda: ankle().jacobian([0.0, 0.0, 0.0]), InvalidArgument, "shape .3,.; expected .*pitch_joint, roll_joint"),
        (lambda: ankle().to_actuators([[0.0, np.nan]]), InvalidArgument, "not finite"),
        (lambda: ankle().armature([0.0, 0.0], -1.0), InvalidArgument, "not negative"),
        (lambda: ankle().torques_to_joints([0.0, 0.0], [1.0]), InvalidArgument, "left_motor_joint, right_motor_joint"),
        (lambda: ankle().torques_to_joints(np.zeros((3, 2)), np.zeros((4, 2))), InvalidArgument, "shapes that agree"),
        (lambda: ankle().sample(0), InvalidArgument, "from 1 to"),
        (lambda: ankle().speed_limits([0.1, 0.05]), InvalidArgument, "no max_speed of 'left_motor_joint'"),
        (lambda: actuation_of("delta", "task").hull(), InvalidArgument, "no range of x, y, z"),
        (lambda: actuation_of("delta", "task").hull([[1e4] * 3, [2e4] * 3]), InvalidArgument, "no feasible point"),
        (lambda: ankle().hull([[0.0, 0.0], [0.0, 1.0]]), InvalidArgument, "without an extent"),
    ],
    ids=range(15),
)
def test_wrong_calls_name_what_is_wrong(call: Any, error: type[Exception], text: str) -> None:
    with pytest.raises(error, match=text):
        call()


def test_maps_end_at_parallel_singularities_and_come_back() -> None:
    """An ankle whose joints may go farther than its motors hold it: rods level with the pivot are singular."""
    joints = [
        Joint("pitch", "revolute", ("base", "cross"), at=(0, 0, 0), axis=(0, 1, 0), range=(-2, 2)),
        Joint("roll", "revolute", ("cross", "foot"), at=(0, 0, 0), axis=(1, 0, 0), range=(-2, 2)),
    ]
    for side, y, z in (("L", 43.0, 215.0), ("R", -43.0, 140.0)):
        ends = ("foot", f"rod{side}"), (f"crank{side}", f"rod{side}")
        joints += [
            Joint(f"C{side}", "spherical", ends[0], at=(-56, y, 22)),
            Joint(f"M{side}", "revolute", ("base", f"crank{side}"), at=(0, y, z), axis=(0, 1, 0), actuated=True),
            Joint(f"B{side}", "spherical", ends[1], at=(-56, y, z + 22)),
        ]
    ankle = Mechanism(name="ankle", joints=joints, end_effector="foot", reference_point=(0, 0, 0), task=["tilt"])
    a = pf.actuation(ankle, ("pitch", "roll"))
    sample = a.sample(200)
    led = np.repeat(a.home[None], 200, axis=0)  # in small steps, so that only singularities lead to another assembly
    for share in np.linspace(0.02, 1.0, 50):
        led = np.asarray(a.to_joints(a.to_actuators(a.home + share * (sample.q - a.home)).values, start=led))
    assert (np.abs(led - sample.q).max(axis=1) < 1e-6).mean() > 0.98  # some are led to one axis after the other
    home = np.sign(np.linalg.det(a.jacobian(a.home)))
    assert (np.sign(np.linalg.det(a.jacobian(sample.q))) == home).all()
    drawn = np.random.default_rng(1).uniform(a.low, a.high, (600, 2))
    margin, mapped = a.margin(drawn), a.to_actuators(drawn)
    beyond = margin.bound == "singularity"
    assert beyond.any() and (np.asarray(mapped.status)[beyond & (margin.margin < 0.0)] == Status.PROJECTED).all()
    lost = float((margin.margin < 0.0).mean())
    assert a.hull().share_lost == pytest.approx(lost, abs=0.06)


@pytest.mark.parametrize(("name", "joints", "size"), MAPS)
def test_the_rate_of_the_jacobian_is_its_difference_along_the_motion(name: str, joints: Any, size: float) -> None:
    a, random, h = actuation_of(name, joints), np.random.default_rng(1), 1e-3
    units = np.where(a._coordinates.is_angle, 1.0, a.mechanism.characteristic_length)
    q = a.home + 0.5 * size * units * random.uniform(-1.0, 1.0, (3, len(a.names)))
    rates = units * random.standard_normal(q.shape)
    j = [a.jacobian(q + k * h * rates) for k in (-2, -1, 1, 2)]
    expected = (8.0 * (j[2] - j[1]) - (j[3] - j[0])) / (12.0 * h)
    found = a.jacobian_rate(q, rates)
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())
    np.testing.assert_allclose(a.jacobian_rate(q[0], rates[0]), found[0], atol=1e-9 * np.abs(expected).max())


def test_the_rate_of_a_rotation_vectors_matrix_is_that_of_large_and_small_ones() -> None:
    from pfabrik.capabilities.actuation.jacobian_rate import NEAR_NONE, _turning_rate
    from pfabrik.common.rotations import turning

    random, h = np.random.default_rng(0), 1e-3
    directions, speeds = random.standard_normal((2, 6, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    vectors = directions * np.array([0.0, 0.03, 0.999 * NEAR_NONE, 1.001 * NEAR_NONE, 1.0, 3.0])[:, None]
    near = [turning(vectors + k * h * speeds) for k in (-2, -1, 1, 2)]
    expected = (8.0 * (near[2] - near[1]) - (near[3] - near[0])) / (12.0 * h)
    np.testing.assert_allclose(_turning_rate(vectors, speeds), expected, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "joints"),
    [
        ("g1_ankle", ("pitch_joint", "roll_joint")),
        ("ankle_ups", "pivot"),
        ("five_bar", ("p1", "p2")),
        ("delta", "task"),
    ],
)
def test_armature_with_links_is_the_mass_matrix_of_the_joints(name: str, joints: Any) -> None:
    machine = pf.load(name)
    driven = [dataclasses.replace(j, rotor_inertia=1e-4, gear=9) if j.actuated else j for j in machine.joints]
    places = {body: [j.at for j in machine.joints if body in j.connects and j.at] for body in machine.bodies[1:]}
    machine = machine._with(joints=tuple(driven)).with_masses(
        pf.Mass(body, 0.7, np.mean(at or [machine.reference_point], axis=0), [9.0, 8.0, 7.0])
        for body, at in places.items()
    )
    a = pf.actuation(machine, joints)
    q = a.home + 0.02 * np.where(a._coordinates.is_angle, 1.0, machine.characteristic_length)
    expected = pf.mass_matrix(a.to_actuators(q).solution, joints)
    np.testing.assert_allclose(a.armature(q, links=True), expected, rtol=1e-7, atol=1e-9 * np.abs(expected).max())
    other = a.armature(q, 0.02, links=True) - a.armature(q, 0.02)
    np.testing.assert_allclose(other, expected - a.armature(q), atol=1e-12)


def test_the_rate_of_the_jacobian_goes_on_beyond_limits_and_refuses_balls() -> None:
    a, h = ankle(), 1e-4
    q, rates = np.array([0.0, a.high[1] + 0.02]), np.array([1.0, -2.0])
    assert a.margin(q).margin < 0.0
    expected = (a.jacobian(q + h * rates) - a.jacobian(q - h * rates)) / (2.0 * h)
    np.testing.assert_allclose(a.jacobian_rate(q, rates), expected, atol=1e-6)
    joints = [Joint("ball", "spherical", ("base", "platform"), at=(0, 0, 50))]
    for k, (x, y) in enumerate([(60, 0), (-30, 50), (-30, -50)]):
        low, strut = (x, y, 0), (f"cylinder{k}", f"rod{k}")
        joints += [
            Joint(f"A{k}", "universal", ("base", strut[0]), at=low),
            Joint(f"B{k}", "prismatic", strut, along=(f"A{k}", f"C{k}"), actuated=True, range=(40, 140)),
            Joint(f"C{k}", "spherical", (strut[1], "platform"), at=(0.5 * x - 0.3 * y, 0.5 * y + 0.3 * x, 90)),
        ]
    machine = Mechanism("ball", joints, "platform", (0, 0, 50), task=["rotation"])
    with pytest.raises(UnsupportedMechanism, match="ball"):
        pf.actuation(machine, "ball").jacobian_rate(np.zeros(3), np.ones(3))
    with pytest.raises(InvalidArgument, match="rates"):
        a.jacobian_rate(np.zeros((2, 2)), np.ones((3, 2)))
