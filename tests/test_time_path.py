"""Timed paths: within every limit, and as fast as another's method says is possible."""

from __future__ import annotations

import dataclasses
import json
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

import pfabrik as pf
from command import pfabrik
from machines import closure, planar
from pfabrik.capabilities.timing.curve import curve_of
from pfabrik.common.arrays import Floats
from pfabrik.errors import InvalidArgument, UnknownName
from pfabrik.kinematics import drive_limits
from pfabrik.machine.description.task import task_of
from pfabrik.machine.motion.displacements import actuator_units
from pfabrik.machine.motion.loops import first_order
from pfabrik.machine.motion.mobility import generic_of

KEPT = 1.0 + 2e-6
"""Share of a limit that counts as kept."""


@lru_cache
def followed(name: str, turns: int, count: int = 150) -> pf.Track:
    """A closed curve around home of a few turns, tilting where the machine can."""
    mechanism = pf.load(name)
    size = 0.06 * mechanism.characteristic_length
    angle = np.linspace(0.0, 2.0 * np.pi, count)
    offsets = np.stack([np.sin(angle), np.sin(turns * angle), 0.5 - 0.5 * np.cos(angle)], axis=1) * size
    tilts = np.stack([np.sin(angle), 1.0 - np.cos(angle), np.sin(turns * angle)], axis=1) * 0.05
    directions = generic_of(mechanism).directions  # what the machine can do at all
    basis = np.zeros((6, directions.shape[1]))
    basis[: len(directions)] = directions
    moved = np.concatenate([offsets, tilts], axis=1) @ np.round(basis @ basis.T, 9)
    offsets, tilts = moved[:, :3], moved[:, 3:]
    track = pf.track(mechanism, pf.pose(mechanism.home_pose[:3, 3] + offsets, rotvec=tilts))
    assert track
    return track


def limits(name: str) -> dict[str, float]:
    """Limits that a machine of this size could have: some by speed, some by acceleration."""
    mechanism = pf.load(name)
    is_slide = mechanism.joint(mechanism.actuator_names[0]).type == "prismatic"
    unit = mechanism.characteristic_length if is_slide else 1.0
    return {"speed": 0.4 * unit, "acceleration": 3.0 * unit}


@pytest.mark.parametrize("name", ["stewart", "five_bar", "servo_hexapod", "linear_delta", "rrr"])
def test_the_time_is_that_of_toppra(name: str) -> None:
    pytest.importorskip("toppra", reason="no toppra here: its wheels are for Linux")
    import toppra
    from scipy.interpolate import CubicSpline

    track = followed(name, 3)
    given = limits(name)
    curve = curve_of(track)
    grid = curve.grid()
    n_a = curve.n_actuators
    path = toppra.SplineInterpolator(curve.s, track.actuators[curve.steps], bc_type="natural")
    spline = CubicSpline(curve.s, track.actuators[curve.steps], bc_type="natural")
    np.testing.assert_allclose(curve.at(grid)[:, :n_a], spline(grid), atol=1e-9)
    speed, acceleration = (np.array([[-most, most]] * n_a) for most in given.values())
    kinds = toppra.constraint
    both = [kinds.JointVelocityConstraint(speed), kinds.JointAccelerationConstraint(acceleration)]
    _, speeds, _ = toppra.algorithm.TOPPRA(both, path, gridpoints=grid).compute_parameterization(0.0, 0.0)
    expected = (2.0 * np.diff(grid) / (speeds[1:] + speeds[:-1])).sum()
    timed = pf.time_path(track, **given)
    assert timed.duration == pytest.approx(expected, rel=1e-3)
    assert np.abs(timed.rates).max() <= KEPT * given["speed"]
    assert np.abs(timed.accelerations).max() <= KEPT * given["acceleration"]


def slide(length: float = 100.0, count: int = 30) -> pf.Track:
    joint = pf.Joint("x", "prismatic", ("base", "table"), axis=(1, 0, 0), actuated=True, range=(-1, 1000))
    mechanism = pf.Mechanism("slide", [joint], "table", (0, 0, 0), task=("x",))
    return pf.track(mechanism, np.linspace([0, 0, 0], [length, 0, 0], count))


@pytest.mark.parametrize(("speed", "acceleration"), [(50.0, 200.0), (1000.0, 200.0), (50.0, 30.0)])
def test_a_straight_move_of_one_actuator_takes_its_closed_form(speed: float, acceleration: float) -> None:
    length = 100.0
    timed = pf.time_path(slide(length), speed=speed, acceleration=acceleration, rate=500)
    peak = min(speed, np.sqrt(length * acceleration))
    assert timed.duration == pytest.approx(length / peak + peak / acceleration, rel=1e-5)
    assert timed.rates.max() == pytest.approx(peak, rel=1e-2)
    # what is told at the samples belongs together
    assert timed.actuators[-1] == pytest.approx([length], rel=1e-12)
    np.testing.assert_allclose(timed.rates[1:-2, 0], (np.diff(timed.actuators[:-1, 0]) * 500)[:-1], atol=peak * 0.05)


@lru_cache
def zigzag() -> pf.Track:
    """A straight line of 21,000 steps, each off by a thousandth of a millimetre."""
    noise = np.random.default_rng(0).normal(size=(21_000, 3))
    return pf.track(pf.load("linear_delta"), np.linspace([0, 0, 5], [30, 20, 5], len(noise)) + 1e-3 * noise)


@pytest.mark.parametrize(("speed", "acceleration"), [(100.0, None), (100.0, 3e5)])
def test_limits_are_kept_between_steps_that_zigzag(speed: float | None, acceleration: float | None) -> None:
    """More steps than points of the grid, and each bends the path: within a step rates and accelerations vary much."""
    timed = pf.time_path(zigzag(), speed=speed, acceleration=acceleration, rate=50_000)
    most_speed, most_acceleration = (np.inf if most is None else KEPT * most for most in (speed, acceleration))
    assert np.abs(timed.rates).max() <= most_speed
    assert np.abs(timed.accelerations).max() <= most_acceleration
    assert timed.exceeded == ()
    velocities = np.diff(timed.actuators, axis=0)[:-1] * 50_000  # what the samples say themselves
    assert np.abs(velocities).max() <= most_speed
    assert np.abs(np.diff(velocities, axis=0)).max() * 50_000 <= 1.001 * most_acceleration


def test_a_spline_that_leaves_a_range_between_the_steps_is_refused_with_the_step() -> None:
    joints = [
        pf.Joint("x", "prismatic", ("base", "a"), axis=(1, 0, 0), actuated=True, range=(-1, 60)),
        pf.Joint("y", "prismatic", ("a", "b"), axis=(0, 1, 0), actuated=True),
    ]
    mechanism = pf.Mechanism("table", joints, "b", (0, 0, 0), task=("x", "y"))
    corner = np.array([[min(10 * k, 60), max(10 * k - 60, 0), 0] for k in range(12)])
    with pytest.raises(InvalidArgument, match=r"swings \S+ mm beyond the range of 'x' between its steps") as caught:
        pf.time_path(pf.track(mechanism, corner), speed=10.0)
    assert caught.value.rows[0] == 6
    assert pf.time_path(pf.track(mechanism, corner - [1, 0, 0]), speed=10.0).actuators[:, 0].max() > 59.0


def test_some_limit_is_met_at_all_times_and_named() -> None:
    timed = pf.time_path(followed("stewart", 1), **limits("stewart"))
    assert (timed.used[1:-1] > 0.99).mean() > 0.95
    assert timed.used.max() <= KEPT
    assert sum(timed.held_back.values()) == pytest.approx(1.0, abs=0.1)
    assert {each for each, _ in timed.held_back} <= {*pf.load("stewart").actuator_names}
    assert {what for _, what in timed.held_back} == {"speed", "acceleration"}


def test_the_platform_keeps_its_own_speed() -> None:
    timed = pf.time_path(followed("linear_delta", 1), platform_speed=20.0)
    inner = slice(2, -2)
    assert timed.platform_speeds.max() <= 20.0 * KEPT
    positions = timed.poses[:, :3, 3]
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1) / np.diff(timed.times)
    np.testing.assert_allclose(steps[inner], 20.0, rtol=1e-3)
    assert ("platform", "speed") in timed.held_back


def test_the_answer_is_the_machine_s() -> None:
    timed = pf.time_path(followed("stewart", 3), **limits("stewart"), rate=50)
    again = pf.solve_ik(pf.load("stewart"), timed.poses)
    assert np.abs(again.actuators - timed.actuators).max() < 1e-4 * pf.load("stewart").characteristic_length


def test_limits_come_from_the_file_and_from_the_call() -> None:
    joints = [
        pf.Joint("x", "prismatic", ("base", "a"), axis=(1, 0, 0), actuated=True, max_speed=3.0, max_acceleration=7.0),
        pf.Joint("y", "prismatic", ("a", "b"), axis=(0, 1, 0), actuated=True),
    ]
    mechanism = pf.Mechanism("table", joints, "b", (0, 0, 0), task=("x", "y"))
    assert drive_limits(mechanism, "speed", None).tolist() == [3.0, np.inf]
    assert drive_limits(mechanism, "acceleration", {"y": 2.0}).tolist() == [7.0, 2.0]
    assert drive_limits(mechanism, "speed", 5.0).tolist() == [5.0, 5.0]
    with pytest.raises(UnknownName, match="did you mean"):
        drive_limits(mechanism, "speed", {"yy": 1.0})
    post = pf.Joint(
        "post", "cylindrical", ("base", "arm"), at=(0, 0, 0), axis=(0, 0, 1), actuated=True, max_speed=(2.0, 30.0)
    )
    column = pf.Mechanism("column", [post], "arm", (1, 0, 0), task=("z", "yaw"))
    assert drive_limits(column, "speed", {"post[0]": 1.0}).tolist() == [1.0, 30.0]
    track = pf.track(column, pf.pose([[1, 0, 0], [0, 1, 20]], rpy=[[0, 0, 0], [0, 0, np.pi / 2]]))
    assert pf.time_path(track).duration == pytest.approx(max(np.pi / 2 / 2.0, 20.0 / 30.0), rel=1e-6)


def along_five_bar(*ways: float) -> pf.Track:
    mechanism = pf.load("five_bar")
    return pf.track(mechanism, [mechanism.home_pose[:3, 3] + [0, way, 0] for way in ways])


@pytest.mark.parametrize(
    ("path", "asked", "said"),
    [
        (lambda: along_five_bar(0, 1e4, 0), {}, r"not reached.*first bad row: 1"),
        (lambda: along_five_bar(0, 0), {}, "does not move"),
        (lambda: along_five_bar(0, 1)[0], {}, "track"),
        (slide, {"speed": None}, "a limit"),
        (slide, {"speed": 1e-9}, "samples"),
        (slide, {"speed": -1.0}, "speed"),
        (slide, {"rate": 0.0}, "rate"),
        (slide, {"acceleration": float("nan")}, "acceleration"),
        (slide, {"platform_speed": True}, "platform_speed"),
    ],
)
def test_paths_that_no_machine_follows_are_refused_with_the_step(path: Any, asked: dict[str, Any], said: str) -> None:
    with pytest.raises(InvalidArgument, match=said):
        pf.time_path(path(), **{"speed": 1.0, **asked})


def test_a_path_across_a_parallel_singularity_is_refused_with_the_step() -> None:
    """A planar 3-RPR with like triangles, turned past where its legs meet in a point."""
    mechanism = planar("RPR").without_limits()
    angles = np.radians(np.linspace(0.0, 170.0, 60))
    targets = pf.pose(np.tile(mechanism.home_pose[:3, 3], (60, 1)), rotvec=angles[:, None] * [0.0, 0.0, 1.0])
    track = pf.track(mechanism, targets)
    assert track
    with pytest.raises(InvalidArgument, match="parallel singularity") as caught:
        pf.time_path(track, speed=1.0)
    (step, *_) = caught.value.rows
    signs = np.sign(np.linalg.det(pf.inverse_jacobian(track)[:, :, [0, 1, 5]]))
    assert signs[step] != signs[step - 1]


def test_a_timed_path_goes_to_a_file_whole_or_not_at_all_and_to_a_picture(tmp_path: Path) -> None:
    timed = pf.time_path(followed("five_bar", 1), speed=1.0, rate=20)
    timed.to_csv(tmp_path / "timed.csv")
    header, *rows = (tmp_path / "timed.csv").read_text().splitlines()
    assert header.startswith("t,step,x,y,z,roll_deg,pitch_deg,yaw_deg,actuator_")
    assert len(rows) == len(timed.times)
    fourth = dict(zip(header.split(","), rows[3].split(","), strict=True))
    name = timed.mechanism.actuator_names[0]
    assert float(fourth[f"actuator_{name}_deg"]) == pytest.approx(np.degrees(timed.actuators[3, 0]))
    with pytest.raises(FileNotFoundError):
        timed.to_csv(tmp_path / "no" / "timed.csv")
    pytest.importorskip("matplotlib")
    assert [len(axes.lines) for axes in timed.plot().axes] == [2, 2, 2]


@pytest.mark.parametrize("name", ["rps", "ankle_ups", "stewart", "rrr", "five_bar_with_tool"])
def test_the_speed_of_a_platform_is_that_at_which_an_actuator_meets_its_limit(name: str) -> None:
    """Away from home too, where what a task leaves out moves along: by central differences of inverse kinematics."""
    machine = closure.five_bar_with_tool() if name == "five_bar_with_tool" else pf.load(name)
    task = task_of(machine)
    tilt = (0.05, 0.08, 0.0) if task.rotations in (2, 3) and name != "rrr" else (0.0, 0.0, 0.0)
    here = pf.solve_ik(machine, pf.pose(np.array(machine.reference_point), rotvec=tilt))
    assert here.status is pf.Status.REACHED
    fastest = pf.platform_speed(here, speed=2.0)
    assert sum(each.speed > 0.0 for each in fastest) >= sum(task.axes) + task.rotations - 3 * (name == "rrr")
    for each in fastest:
        if each.speed == 0.0:
            continue
        step = 1e-5 * (machine.characteristic_length if each.kind == "along" else 1.0)
        sides = []
        for way in (step, -step):
            target = here.pose.copy()
            if each.kind == "along":
                target[:3, 3] += way * np.array(each.direction)
            else:
                target[:3, :3] = Rotation.from_rotvec(way * np.array(each.direction)).as_matrix() @ target[:3, :3]
            sides.append(pf.solve_ik(machine, target, start=here).actuators)
        rates = np.abs(sides[0] - sides[1]) / (2.0 * step)
        assert each.speed * rates.max() == pytest.approx(2.0, rel=1e-4)
        assert machine.actuator_names[rates.argmax()] == each.limited_by or np.sum(rates > 0.9999 * rates.max()) > 1


def arms(count: int, joints: int) -> pf.Mechanism:
    """A platform on arms of so many revolute joints, all of them actuated."""
    random = np.random.default_rng(0)
    made = []
    for arm in range(count):
        bodies = ["base", *(f"link_{arm}_{place}" for place in range(joints - 1)), "platform"]
        for place, centre in enumerate(np.linspace((200.0, 0.0, 0.0), (60.0, 0.0, 300.0), joints)):
            at = Rotation.from_rotvec([0.0, 0.0, 2.0 * np.pi * arm / count]).apply(centre) + 30.0 * random.normal(
                size=3
            )
            name, between, axis = f"{arm}_{place}", tuple(bodies[place : place + 2]), tuple(random.normal(size=3))
            made.append(pf.Joint(name, "revolute", between, at=tuple(at), axis=axis, actuated=True))
    return pf.Mechanism(name="arms", joints=made, base="base", end_effector="platform", reference_point=(0, 0, 300))


@pytest.mark.parametrize("machine", [pf.load("nrpm"), arms(1, 9), arms(2, 15)], ids=str)
def test_internal_motions_take_load_off_the_actuator_that_limits_a_platform(machine: pf.Mechanism) -> None:
    """A redundant machine goes as fast as a linear program over the rates of all its actuators says, and nowhere
    slower than in the direction that is told; with 30 actuators and 18 internal motions as well."""
    random = np.random.default_rng(0)
    limits = random.uniform(0.5, 2.0, len(machine.actuator_names)) * 100.0
    here = pf.solve_ik(machine, pf.pose(np.array(machine.reference_point), rotvec=(0.05, 0.1, 0.02)))
    (closure_rows,), (twist_rows,) = first_order(machine, here._coordinates)
    joints = {
        drive.column: limit for drive, limit in zip(machine.drives, limits / actuator_units(machine), strict=True)
    }
    bounds = [(-joints.get(column, np.inf), joints.get(column, np.inf)) for column in range(closure_rows.shape[1])]

    def most(twist: Floats) -> float:
        asked = -twist / np.repeat([machine.characteristic_length, 1.0], 3)
        loops = np.column_stack([np.vstack([closure_rows, twist_rows]), np.append(np.zeros(len(closure_rows)), asked)])
        aim = np.append(np.zeros(len(bounds)), -1.0)
        best = linprog(aim, A_eq=loops, b_eq=np.zeros(len(loops)), bounds=[*bounds, (0.0, None)])
        return float(best.x[-1])

    *axes, slowest = pf.platform_speed(here, speed=dict(zip(machine.actuator_names, limits, strict=True)))
    for each in (*axes, slowest):
        twist = np.zeros(6)
        twist[slice(3) if each.kind == "along" else slice(3, 6)] = each.direction
        assert each.speed == pytest.approx(most(twist), rel=1e-9)
        assert each.limited_by in machine.actuator_names
    near = np.array(slowest.direction) + 0.1 * random.normal(size=(10, 3))
    for direction in (*random.normal(size=(30, 3)), *near):
        assert slowest.speed <= most(np.append(direction / np.linalg.norm(direction), np.zeros(3))) * (1.0 + 1e-9)


def test_an_answer_without_a_configuration_has_no_speed() -> None:
    nothing = pf.solve_ik(pf.load("stewart"), np.full((1, 4, 4), np.nan), options=pf.Options(on_invalid="mark"))[0]
    with pytest.raises(InvalidArgument, match="an answer that is INVALID"):
        pf.platform_speed(nothing, speed=1.0)


def heavy(name: str, friction: tuple[float, float] = (0.0, 0.0)) -> pf.Mechanism:
    """A machine with masses, rotors and friction."""
    machine = pf.load(name)
    masses = []
    for body in machine.bodies:
        points = [joint.at for joint in machine.joints if body in joint.connects and joint.at is not None]
        size = 0.1 * machine.characteristic_length
        masses.append(
            pf.Mass(
                body,
                0.5,
                np.mean(points or [machine.reference_point], axis=0),
                0.5 * size**2 * np.array([1.0, 1.5, 2.0]),
            )
        )
    drive: dict[str, Any] = {"rotor_inertia": 1e-5, "gear": 10.0, "friction": friction}
    joints = (dataclasses.replace(joint, **drive) if joint.actuated else joint for joint in machine.joints)
    return machine._with_joints(joints).with_masses(masses)


@pytest.mark.parametrize("friction", [(0.0, 0.0), (0.05, 0.0), (0.0, 0.02)])
@pytest.mark.parametrize("name", ["servo_hexapod", "linear_delta"])
def test_motors_are_at_a_limit_of_torque_all_the_way(name: str, friction: tuple[float, float]) -> None:
    machine, path = heavy(name, friction), followed(name, 2)
    track = pf.track(machine, path.pose)
    most = 1.5 * np.abs(pf.inverse_dynamics(track, twists=np.zeros(6)).actuators).max()
    timed = pf.time_path(track, torque=most)
    shares = np.abs(pf.inverse_dynamics(timed).actuators).max(axis=1)[1:-1] / most
    assert shares.max() < 1.0 + 1e-5
    assert np.mean(shares > 0.99) > 0.97  # no timing is faster; some meet it only at the next point of the grid
    assert {what for _, what in timed.held_back} == {"torque"}


@pytest.mark.parametrize("name", ["servo_hexapod", "linear_delta", "five_bar"])
def test_the_time_by_torque_is_that_of_toppra(name: str) -> None:
    """Of rows that inverse dynamics gives at every place of its grid, beside limits of speed."""
    pytest.importorskip("toppra", reason="no toppra here: its wheels are for Linux")
    import toppra

    machine = heavy(name, (0.05, 0.0))
    track = pf.track(machine, followed(name, 2).pose)
    most = 1.5 * np.abs(pf.inverse_dynamics(track, twists=np.zeros(3 if name == "five_bar" else 6)).actuators).max()
    rubs = np.full(len(machine.actuator_names), 0.05)
    curve = curve_of(track)
    grid = curve.grid(600)
    path = toppra.SplineInterpolator(curve.s, track.actuators[curve.steps], bc_type="natural")
    reached = pf.solve_fk(heavy(name), path.eval(grid), start=track.q[curve.step_of(grid)])

    class OfTorque(toppra.constraint.LinearConstraint):  # type: ignore[misc]
        def compute_constraint_params(self, path: Any, gridpoints: Floats) -> tuple[Any, ...]:
            rates, bends = path.evald(gridpoints), path.evaldd(gridpoints)
            rest, push, speed = (
                pf.inverse_dynamics(reached, twists=twists, accelerations=accelerations, at="actuators").actuators
                for twists, accelerations in ((0 * rates, None), (0 * rates, rates), (rates, bends))
            )
            bound = np.concatenate([np.eye(len(rubs)), -np.eye(len(rubs))])
            dry = rest + rubs * np.sign(rates)
            return push - rest, speed - rest, dry, bound, np.full(2 * len(rubs), most), None, None

    torque = OfTorque()
    torque.identical = True
    speeds = toppra.constraint.JointVelocityConstraint(np.array([[-1.0, 1.0]] * len(rubs)) * 8 * limits(name)["speed"])
    algorithm = toppra.algorithm.TOPPRA([speeds, torque], path, gridpoints=grid)
    _, pace, _ = algorithm.compute_parameterization(0.0, 0.0)
    expected = (2.0 * np.diff(grid) / (pace[1:] + pace[:-1])).sum()
    timed = pf.time_path(track, torque=most, speed=8 * limits(name)["speed"])
    assert timed.duration == pytest.approx(expected, rel=2e-3)
    assert sum(share for (_, what), share in timed.held_back.items() if what == "torque") > 0.9


def test_a_mass_on_a_slide_moves_in_the_time_of_its_closed_form() -> None:
    track = slide()
    joint = dataclasses.replace(track.mechanism.joint("x"), max_torque=8.0, friction=(2.0, 0.0))
    table = pf.Mass("table", 3.0, [0, 0, 0])
    machine = pf.Mechanism("slide", [joint], "table", (0, 0, 0), task=("x",), masses=[table])
    timed = pf.time_path(pf.track(machine, track.pose), loads={"table": (1.0, [0, 0, 0])}, gravity=(1.5, 0, 0))
    faster, slower = (8.0 - 2.0 + 6.0) / 4.0, (8.0 + 2.0 - 6.0) / 4.0  # gravity pulls 4 kg along it
    peak = np.sqrt(2.0 * 0.1 / (1.0 / faster + 1.0 / slower))
    assert timed.duration == pytest.approx(peak / faster + peak / slower, rel=1e-4)


def on_seven_struts() -> pf.Mechanism:
    base = np.array([(500.0 * x, 400.0 * y, z) for x in (-1, 1) for y in (-1, 1) for z in (0.0, 600.0)][:7])
    ends = base * [0.12, 0.15, 0.0] + np.where(base[:, 2:] == 0.0, 1.0, -1.0) * [0.0, 0.0, 40.0] + [0.0, 0.0, 300.0]
    return pf.Mechanism.from_legs("U-P*-S", base=base, platform=ends, stroke=(10, 2000), reference_point=(0, 0, 300))


@pytest.mark.parametrize("name", ["four struts", "seven struts"])
def test_redundant_motors_share_what_a_linear_programme_finds_no_timing_beats(name: str) -> None:
    """The least share of their limits by which any forces of the actuators move the machine is 1 all the way."""
    machine = closure.planar_4rpr() if name == "four struts" else on_seven_struts()
    machine = machine.without_limits().with_masses(
        pf.Mass(body, 0.5, machine.reference_point, [500.0] * 3) for body in machine.bodies[1:]
    )
    drive: dict[str, Any] = {"rotor_inertia": 0.3, "friction": (0.5, 1.0), "max_torque": 40.0}
    machine = machine._with_joints(
        dataclasses.replace(joint, **drive) if joint.actuated else joint for joint in machine.joints
    )
    t = np.linspace(0.0, 1.0, 81)
    z = 20 * t * (name == "seven struts")
    turns = np.stack([0.005 * z, 0 * t, 0.2 * t], axis=1)
    shifts = np.stack([30 * np.sin(3 * t), 20 * t, z], axis=1)
    timed = pf.time_path(pf.track(machine, pf.pose(machine.reference_point + shifts, rotvec=turns)))
    efforts, spatial = pf.inverse_dynamics(timed), slice(0, 6) if name == "seven struts" else [0, 1, 5]
    assert np.abs(efforts.actuators[:-1]).max() < 40.0 * (1 + 1e-4)  # seven rates of six motions, each a spline's own
    rates = pf.inverse_jacobian(timed.solution)[..., spatial]
    n, shares = len(machine.actuator_names), []
    bounds = np.block([[np.eye(n), -np.full((n, 1), 40.0)], [-np.eye(n), -np.full((n, 1), 40.0)]])
    for row in np.linspace(1, len(timed.times) - 2, 60).astype(int):
        works = np.c_[rates[row].T, np.zeros(rates.shape[2])]
        best = linprog(
            np.eye(n + 1)[n],
            A_eq=works,
            b_eq=works[:, :n] @ efforts.actuators[row],
            A_ub=bounds,
            b_ub=np.zeros(2 * n),
            bounds=(None, None),
        )
        shares.append(best.fun)
    assert max(shares) < 1.0 + 1e-5
    assert np.mean(np.array(shares) > 0.99) > 0.95
    assert all(" and " in who and what == "torque" for who, what in timed.held_back)
    with pytest.raises(InvalidArgument, match=r"0.1, where '\w[^']* and [^']*' must exert"):
        pf.time_path(timed._track, torque=0.1)


def test_limits_of_torque_that_no_timing_keeps_are_refused() -> None:
    machine = heavy("five_bar")
    track = pf.track(machine, followed("five_bar", 1).pose)
    with pytest.raises(InvalidArgument, match=r"0.1, where 'p\d' must exert"):
        pf.time_path(track, torque=0.1)
    with pytest.raises(InvalidArgument, match="no mass of link1"):
        pf.time_path(followed("five_bar", 1), torque=1.0)
    limited = pf.load("five_bar")._with_joints(
        dataclasses.replace(joint, max_torque=1.0) if joint.actuated else joint for joint in machine.joints
    )
    with pytest.raises(InvalidArgument, match="without max_speed"):  # without masses, motors of a file say nothing
        pf.time_path(pf.track(limited, track.pose))


def wound(machine: pf.Mechanism, turns: int, count: int, noise: float) -> pf.Track:
    """Turns of all actuators around home, in phases of their own."""
    random, units = np.random.default_rng(1), actuator_units(machine)
    home, phases = pf.solve_ik(machine, machine.home_pose).actuators, random.uniform(0.0, 6.0, len(units))
    angles = np.linspace(0.0, 2.0 * np.pi * turns, count)[:, None] * np.linspace(1.0, 1.5, len(units))
    offsets = 0.05 * (np.sin(angles + phases) - np.sin(phases)) + noise * random.standard_normal((count, len(units)))
    return pf.track(machine, pf.solve_fk(machine, home + offsets * units).pose)


WOUND = [
    ("five_bar", (0.0, 0.0), 3, 80, 1e-3),
    ("five_bar", (0.0, 0.0), 20, 400, 0.0),  # torques change more between its steps than splines do
    ("five_bar", (0.0, 0.0), 5, 2000, 1e-5),  # and so do they within them, of so short ones
    ("five_bar", (0.05, 0.01), 3, 80, 1e-4),  # dry friction leaps where an actuator turns back
    ("linear_delta", (0.0, 0.0), 3, 80, 1e-3),
    ("stewart", (0.5, 0.0), 40, 3000, 0.0),  # a path of minutes
]


@pytest.mark.parametrize(("name", "friction", "turns", "count", "noise"), [*WOUND[1:4], WOUND[5]])
def test_torques_are_kept_between_the_points_of_a_path(
    name: str, friction: tuple[float, float], turns: int, count: int, noise: float
) -> None:
    """To a thousandth, in samples that are denser than its grid was at first."""
    track = wound(heavy(name, friction), turns, count, noise)
    rest = np.zeros(3 if name == "five_bar" else 6)
    most = 1.5 * np.abs(pf.inverse_dynamics(track, twists=rest).actuators).max()
    timed = pf.time_path(track, torque=most)
    assert timed.exceeded == () and timed.used.max() <= 1.001
    assert measured(track, most, 50_000.0 / timed.duration).max() <= 1.001


@pytest.mark.parametrize(("name", "friction", "turns", "count", "noise"), WOUND[:5])
def test_what_a_timing_exceeds_is_what_inverse_dynamics_measures_there(
    name: str,
    friction: tuple[float, float],
    turns: int,
    count: int,
    noise: float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where the grid stays as it is at first."""
    monkeypatch.setattr("pfabrik.capabilities.timing.time_path.REFINEMENTS", 0)
    is_kept = noise == 1e-3 or friction[0] > 0.0  # friction counts at either sign
    track = wound(heavy(name, friction), turns, count, noise)
    machine, rest = track.mechanism, np.zeros(3 if name == "five_bar" else 6)
    most = 1.5 * np.abs(pf.inverse_dynamics(track, twists=rest).actuators).max()
    timed = pf.time_path(track, torque=most)
    assert (timed.exceeded == ()) == is_kept
    assert ("exceeds its limit of torque by" in str(timed)) != is_kept
    shares = measured(track, most, 8_000.0 / timed.duration)
    assert shares.max() <= (timed.exceeded[0].share if timed.exceeded else 1.0 + 1e-3) + 1e-4
    for each in timed.exceeded:
        place, samples = machine.actuator_names.index(each.actuator), 20 + int(10.0 * each.time)
        sides = [
            measured(track, most, samples / (each.time * (1.0 + side)))[samples, place] for side in (-1e-8, 1e-8)
        ]  # of where s'' or friction leaps
        assert max(sides) == pytest.approx(each.share, abs=1e-4)
        assert each.what == "torque" and each.share > 1.001
        assert 0.0 < each.duration < 0.2 * timed.duration
        assert timed.steps[np.searchsorted(timed.times, each.time) - 1] <= each.step


def measured(track: pf.Track, most: float, rate: float) -> Floats:
    """Shares of a limit of torque that actuators exert in samples of a rate; none in those at rest."""
    efforts = pf.inverse_dynamics(pf.time_path(track, torque=most, rate=rate))
    return np.abs(np.where(efforts.at_rest.any(axis=1, keepdims=True), 0.0, efforts.actuators)) / most


def test_the_command_says_what_is_exceeded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pfabrik.capabilities.timing.time_path.REFINEMENTS", 0)
    machine = heavy("five_bar")
    pf.save(machine, tmp_path / "m.toml")
    track = wound(machine, 20, 400, 0.0)
    np.savetxt(tmp_path / "path.csv", track.pose[:, :3, 3], "%.17g", ",", header="x,y,z", comments="")
    most = float(1.5 * np.abs(pf.inverse_dynamics(track, twists=np.zeros(3)).actuators).max())
    line = f"time {tmp_path / 'm.toml'} {tmp_path / 'path.csv'} --torque {most!r}"
    said = pfabrik(line)
    assert said.exit_code == 0, said.output
    exceeded = pf.time_path(track, torque=most).exceeded
    assert [line.split(", at")[0] for line in said.stdout.splitlines() if "exceeds" in line] == [
        f"{each.actuator} exceeds its limit of torque by {each.share - 1.0:.2%}" for each in exceeded
    ]
    assert json.loads(pfabrik(f"{line} --json").stdout)["exceeded"][0]["step"] == exceeded[0].step


@pytest.mark.parametrize("acceleration", [None, 3.0])
def test_a_dwell_stops_the_path_for_its_time(acceleration: float | None, tmp_path: Path) -> None:
    """Each part takes what it takes alone, and nothing moves between them."""
    machine = pf.load("delta")
    parts = ["G1 X20 Y0 Z-200 F6000\nG1 X40\n", "G1 X0 Y30\n"]
    (tmp_path / "whole.gcode").write_text(f"G4 S0.25\n{parts[0]}G4 P500\nG4 P100\n{parts[1]}G4 S1\n")
    read = pf.read_path(tmp_path / "whole.gcode", machine)
    track = pf.track(machine, read.targets)
    limits = {"speed": 3.0, "rate": 200.0} | ({} if acceleration is None else {"acceleration": acceleration})
    timed = pf.time_path(track, dwells=read.dwells, **limits)
    stop = int(np.flatnonzero(read.dwells)[1])
    alone = [pf.time_path(pf.track(machine, each), **limits) for each in (read.targets[:stop], read.targets[stop:])]
    first, second = (each.duration for each in alone)
    assert timed.duration == pytest.approx(0.25 + first + 0.6 + second + 1.0, abs=1e-9)
    assert (np.diff(timed.times) > 0.0).all() and np.diff(timed.times).max() < 1.001 / 200.0
    for begin, end in ((0.0, 0.25), (0.25 + first, 0.85 + first), (0.85 + first + second, timed.duration)):
        rows = (timed.times > begin + 1e-9) & (timed.times < end - 1e-9)
        assert rows.sum() > 40 and not timed.rates[rows].any() and not timed.accelerations[rows].any()
        assert np.ptp(timed.actuators[rows], axis=0).max() == 0.0
    none = pf.time_path(track, dwells=0.0 * read.dwells, **limits)
    assert none.duration == pf.time_path(track, **limits).duration
    with pytest.raises(InvalidArgument, match="dwells"):
        pf.time_path(track, dwells=-read.dwells, **limits)
    with pytest.raises(InvalidArgument, match="at most 10000000 samples"):
        pf.time_path(track, dwells=1e12 * read.dwells, **limits)


@pytest.mark.parametrize("row", [1, 7, 20])
def test_a_path_goes_on_from_where_it_dwelt(row: int) -> None:
    """The move to the step that a dwell is before is made behind it, and nothing leaps."""
    machine, targets = pf.load("stewart"), np.linspace([0.0, 0.0, 200.0], [20.0, 0.0, 200.0], 21)
    limits = {"speed": 100.0, "acceleration": 1000.0}
    timed = pf.time_path(pf.track(machine, targets), dwells=0.5 * (np.arange(21) == row), **limits)
    parts = [each for each in (targets[:row], targets[row - 1 :]) if len(each) > 1]
    alone = sum(pf.time_path(pf.track(machine, each), **limits).duration for each in parts)
    assert timed.duration == pytest.approx(0.5 + alone, abs=1e-9)
    np.testing.assert_allclose(timed.poses[-1, :3, 3], targets[-1], atol=1e-6)
    rates = np.diff(timed.actuators, axis=0) / np.diff(timed.times)[:, None]
    assert np.abs(rates).max() <= 100.0 * (1.0 + 1e-6)


TURNED = [("stewart", 5, 400, 0.0), ("rps", 3, 300, 0.0), ("delta", 3, 200, 0.0), ("five_bar", 3, 80, 1e-3)]


@pytest.mark.parametrize(("name", "turns", "count", "noise"), TURNED)
def test_a_platform_keeps_its_accelerations_and_is_at_one_of_them_all_the_way(
    name: str, turns: int, count: int, noise: float
) -> None:
    """By differences of poses of the actuators, three times as dense as its grid."""
    track = wound(pf.load(name), turns, count, noise)
    mechanism, turning = track.mechanism, 1.5
    most = 2.0 * mechanism.characteristic_length
    asked: dict[str, float] = {"platform_acceleration": most}
    if name not in ("delta", "five_bar"):
        asked["platform_angular_acceleration"] = turning
    duration = pf.time_path(track, **asked).duration
    timed = pf.time_path(track, **asked, rate=60_000.0 / duration)
    assert timed.exceeded == () and timed.used.max() <= 1.001
    assert np.mean(timed.used > 0.99) > 0.95
    step, near = timed.times[1], np.linspace(10, len(timed.times) - 12, 3000).astype(int)
    far = 4  # of steps as short as these, second differences would be rounding
    begin, here, end = (
        pf.solve_fk(mechanism, timed.actuators[near + k], start=track[timed.steps[near]]).pose for k in (-far, 0, far)
    )
    along = (end - 2.0 * here + begin)[:, :3, 3] / (far * step) ** 2
    assert np.linalg.norm(along, axis=1).max() <= 1.001 * most
    if "platform_angular_acceleration" in asked:
        turns_of = [Rotation.from_matrix(after[:, :3, :3]) * Rotation.from_matrix(before[:, :3, :3]).inv()
                    for before, after in ((begin, here), (here, end))]  # fmt: skip
        change = (turns_of[1].as_rotvec() - turns_of[0].as_rotvec()) / (far * step) ** 2
        assert np.linalg.norm(change, axis=1).max() <= 1.001 * turning


def test_a_straight_move_takes_the_closed_form_of_its_platform_s_acceleration() -> None:
    """From rest to rest, 2 sqrt(d / a)."""
    mechanism = pf.load("linear_delta")
    way = np.linspace(0.0, 30.0, 31)[:, None] * np.array([0.6, 0.0, 0.8])
    track = pf.track(mechanism, mechanism.home_pose[:3, 3] + way)
    timed = pf.time_path(track, platform_acceleration=500.0)
    assert timed.duration == pytest.approx(2.0 * np.sqrt(30.0 / 500.0), rel=1e-4)
    assert ("platform", "acceleration") in timed.held_back


def test_a_joint_has_no_angular_acceleration() -> None:
    with pytest.raises(InvalidArgument, match="a joint"):
        pf.time_path(followed("five_bar", 1), platform_angular_acceleration=1.0)
