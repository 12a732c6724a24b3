"""Forces of motion: against MuJoCo, closed forms, energy, and statics."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from pfabrik.kinematics import displacements, home_coordinates
from pfabrik.machine.files.units import metres_of

WITHOUT_IDLE = (
    *("agile_eye", "ankle_ups", "canfield", "delta", "five_bar", "g1_ankle", "hexaglide", "nrpm", "orthoglide"),
    *("panda", "prr", "prs", "psu", "rpr", "rps", "rrr", "serial_arm", "servo_hexapod", "stewart", "tricept", "ucu"),
)
WITH_IDLE = ("ankle_rss", "linear_delta", "reachy_mini")


def weighed(machine: pf.Mechanism, seed: int = 1, own: dict[str, float] | None = None) -> pf.Mechanism:
    """The machine with random masses, centres and anisotropic inertias; of bodies in `own`, with these masses."""
    random, length = np.random.default_rng(seed), machine.characteristic_length
    masses = []
    for body in machine.bodies:
        points = [joint.at for joint in machine.joints if body in joint.connects and joint.at is not None]
        centre = np.mean(points or [machine.reference_point], axis=0) + 0.05 * length * random.standard_normal(3)
        axes = np.linalg.qr(random.standard_normal((3, 3)))[0]
        inertia = axes @ np.diag([1.0, 1.3, 1.8]) @ axes.T * (0.2 * length) ** 2
        mass = random.uniform(0.3, 2.0)
        if own is not None:
            mass = own.get(body, 0.0)
        masses.append(pf.Mass(body, mass, centre, mass * 0.5 * (inertia + inertia.T)))
    return machine.with_masses(masses)


def motorised(machine: pf.Mechanism, seed: int = 7) -> pf.Mechanism:
    """The machine with random rotors, gears, friction and limits of its motors."""
    random = np.random.default_rng(seed)
    joints = []
    for joint in machine.joints:
        count = len(joint.driven)
        said = {key: random.uniform(0.5, 2.0, count) for key in ("rotor_inertia", "gear", "max_torque", "max_speed")}
        said |= {"friction": random.uniform(0.1, 0.5, (count, 2))}
        drive: Any = {key: value if count > 1 else value[0] for key, value in said.items()} if count else {}
        joints.append(dataclasses.replace(joint, **drive))
    return dataclasses.replace(machine, joints=tuple(joints))


def units(machine: pf.Mechanism) -> Any:
    """Of actuators: those of their coordinates in L, and in SI."""
    length, metres = machine.characteristic_length, metres_of(machine.length_unit)
    is_length = np.array([drive.kind == "length" for drive in machine.drives])
    return np.where(is_length, length, 1.0), np.where(is_length, metres, 1.0)


def somewhere(machine: pf.Mechanism, seed: int = 5) -> Any:
    """A configuration near home, rates and accelerations of the actuators."""
    random, (of_length, _) = np.random.default_rng(seed), units(machine)
    home = pf.solve_ik(machine, machine.home_pose).actuators
    steps, rates, gains = random.standard_normal((3, len(home))) * of_length
    solution = pf.solve_fk(machine, home + 0.03 * steps)
    assert solution
    return solution, rates, 3.0 * gains


def by_mujoco(text: str, start: Any, rates: Any, gains: Any) -> Any:
    """Actuator forces and mass matrix of a closed model, by its constraint rows; their rate by differences."""
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT) | int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    model.site_sameframe[:] = int(mujoco.mjtSameFrame.mjSAMEFRAME_NONE)
    data = mujoco.MjData(model)

    def rows(qpos: Any) -> Any:
        data.qpos[:] = qpos
        mujoco.mj_fwdPosition(model, data)
        return data.efc_J.reshape(-1, model.nv)[: data.ne].copy()

    def after(time: float) -> Any:
        qpos = start.copy()
        mujoco.mj_integratePos(model, qpos, v, time)
        return rows(qpos) @ v

    conditions = rows(start)
    _, values, right = np.linalg.svd(conditions)
    motions = right[int((values > 1e-7).sum()) :].T
    drives = [model.jnt_dofadr[model.actuator_trnid[k, 0]] for k in range(model.nu)]
    driven = motions[drives]
    v = motions @ np.linalg.lstsq(driven, rates, rcond=1e-9)[0]
    h = 1e-3 / max(1.0, np.abs(v).max())
    drift = (8.0 * (after(h) - after(-h)) - (after(2 * h) - after(-2 * h))) / (12.0 * h)
    data.qpos[:], data.qvel[:] = start, v
    mujoco.mj_forward(model, data)
    bias = data.qfrc_bias - data.qfrc_passive + model.dof_frictionloss * np.sign(v)
    mass = np.zeros((model.nv, model.nv))
    for k, one in enumerate(np.eye(model.nv)):
        mujoco.mj_mulM(model, data, mass[k], one)
    least = -np.linalg.pinv(conditions, rcond=1e-7) @ drift if len(drift) else np.zeros(model.nv)
    whole = least + motions @ np.linalg.lstsq(driven, gains - least[drives], rcond=1e-9)[0]
    _, sizes, axes = np.linalg.svd(driven)
    idle = motions @ axes[int((sizes > 1e-9).sum()) :].T
    if idle.size:  # what nothing holds moves as it will
        whole = whole - idle @ np.linalg.solve(idle.T @ mass @ idle, idle.T @ (mass @ whole + bias))
    forces = np.linalg.lstsq(driven.T, motions.T @ (mass @ whole + bias), rcond=1e-9)[0]
    following = motions @ np.linalg.pinv(driven)
    if idle.size:
        following = following - idle @ np.linalg.solve(idle.T @ mass @ idle, idle.T @ mass @ following)
    return forces, following.T @ mass @ following


@pytest.mark.parametrize("name", [*WITHOUT_IDLE, *WITH_IDLE])
def test_efforts_and_mass_matrices_are_mujocos(name: str) -> None:
    """Of the exported model as it is: with its rotors, its friction, and nothing that is made up."""
    machine = motorised(weighed(pf.load(name)))
    solution, rates, gains = somewhere(machine)
    rates, gravity = rates * (name in WITHOUT_IDLE), (1.0, -2.0, -9.0)  # how fast what is idle spins is a choice
    found = pf.inverse_dynamics(solution, twists=rates, accelerations=gains, at="actuators", gravity=gravity)
    text = pf.interop.to_mjcf(machine, gravity=gravity)
    forces, mass = by_mujoco(text, pf.interop.qpos(solution), *units(machine)[1] * [rates, gains])
    assert found.reason == ""
    np.testing.assert_allclose(found.actuators, forces, atol=1e-9 * np.abs(forces).max())
    np.testing.assert_allclose(pf.mass_matrix(solution, "actuators"), mass, atol=1e-9 * np.abs(mass).max())


@pytest.mark.parametrize("name", WITHOUT_IDLE)
def test_at_rest_they_are_static_forces(name: str) -> None:
    machine = weighed(pf.load(name))
    solution, *_ = somewhere(machine)
    metres, length = metres_of(machine.length_unit), machine.characteristic_length
    body, point, push = machine.end_effector_body, machine.reference_point, [1.0, -2.0, 3.0]
    weights: Any = {mass.body: (mass.mass, mass.centre) for mass in machine.masses if mass.body != machine.base}
    found = pf.inverse_dynamics(solution, loads={body: (push, point)})
    wrench = push if machine.end_effector_is_joint else [*push, 0.0, 0.0, 0.0]
    forces = pf.forces(solution, wrench, loads=weights)
    expected = forces.actuators * np.where(units(machine)[0] == length, 1.0, metres)
    np.testing.assert_allclose(found.actuators, expected, atol=1e-12 * np.abs(expected).max(initial=1.0))
    size = np.nanmax(np.abs([*forces.reactions.values()]))
    for name, reaction in forces.reactions.items():
        moved = reaction * np.repeat([1.0, metres], 3)
        np.testing.assert_allclose(found.reactions[name], moved, atol=1e-11 * size)
    assert found.undetermined == forces.undetermined


def on_the_way(t: Any) -> tuple[Any, Any, Any]:
    """Poses, twists and accelerations of a hexapod's platform at times t (n,)."""
    zero = np.zeros_like(t)
    p = np.stack([20 * np.sin(3 * t), 15 * np.cos(2 * t), 195 + 10 * np.sin(4 * t)], axis=-1)
    v = np.stack([60 * np.cos(3 * t), -30 * np.sin(2 * t), 40 * np.cos(4 * t)], axis=-1)
    a = np.stack([-180 * np.sin(3 * t), -60 * np.cos(2 * t), -160 * np.sin(4 * t)], axis=-1)
    x, y, dx, dy, ddx, ddy = (
        *(0.1 * np.sin(2 * t), 0.15 * np.cos(3 * t), 0.2 * np.cos(2 * t), -0.45 * np.sin(3 * t)),
        *(-0.4 * np.sin(2 * t), -1.35 * np.cos(3 * t)),
    )
    about_y = np.stack([zero, np.cos(x), np.sin(x)], axis=-1)  # the y axis, turned about x
    change = np.stack([zero, -np.sin(x) * dx, np.cos(x) * dx], axis=-1)
    about_x = np.array([1.0, 0.0, 0.0])
    w = dx[:, None] * about_x + dy[:, None] * about_y
    dw = ddx[:, None] * about_x + ddy[:, None] * about_y + dy[:, None] * change
    turned = np.zeros((len(t), 4, 4))
    turned[:, 3, 3] = 1.0
    turned[:, :3, 0] = np.stack([np.cos(y), np.sin(x) * np.sin(y), -np.cos(x) * np.sin(y)], axis=-1)
    turned[:, :3, 1] = about_y
    turned[:, :3, 2] = np.cross(turned[:, :3, 0], about_y)
    turned[:, :3, 3] = p
    return turned, np.concatenate([v, w], axis=-1), np.concatenate([a, dw], axis=-1)


def test_power_goes_into_kinetic_and_potential_energy() -> None:
    machine, h, gravity = weighed(pf.load("stewart")), 1e-3, np.array([2.0, -1.0, -9.0])
    middle = np.linspace(0.1, 2.0, 9)
    t = (middle[:, None] + h * np.array([-2, -1, 0, 1, 2])).ravel()
    poses, twists, accelerations = on_the_way(t)
    solutions = pf.solve_ik(machine, poses)
    si = twists * np.array([1e-3] * 3 + [1.0] * 3)
    energy = 0.5 * np.einsum("ni,nij,nj->n", si, pf.mass_matrix(solutions), si)
    moved = displacements(machine, solutions.q - home_coordinates(machine))
    for mass in machine.masses:
        at = moved[mass.body][:, :3, :3] @ np.array(mass.centre) + moved[mass.body][:, :3, 3]
        energy -= mass.mass * 1e-3 * at @ gravity
    e = energy.reshape(-1, 5)
    change = (8.0 * (e[:, 3] - e[:, 1]) - (e[:, 4] - e[:, 0])) / (12.0 * h)
    found = pf.inverse_dynamics(solutions, twists=twists, accelerations=accelerations, gravity=gravity)
    power = found.power.sum(axis=-1).reshape(-1, 5)[:, 2]
    np.testing.assert_allclose(power, change, rtol=1e-8, atol=1e-8 * np.abs(power).max())


def test_rods_that_spin_as_they_will_take_no_power() -> None:
    machine, h, gravity = pf.load("linear_delta"), 1e-3, np.array([2.0, -1.0, -9.0])
    length, metres, masses = machine.characteristic_length, metres_of(machine.length_unit), []
    for body in machine.bodies[1:]:
        ends = np.array([joint.at for joint in machine.joints if body in joint.connects and joint.at is not None])
        line = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        inertia = 0.1 * length**2 * (np.eye(3) - 0.3 * np.outer(line, line))  # round about its line
        masses.append(pf.Mass(body, 0.7, ends.mean(axis=0), inertia))
    machine = machine.with_masses(masses)
    t = (np.linspace(0.1, 2.0, 9)[:, None] + h * np.array([-2, -1, 0, 1, 2])).ravel()[:, None]
    size, speed = 0.1 * length * np.array([1.0, 0.7, 0.4]), np.array([3.0, 2.0, 4.0])
    solutions = pf.solve_ik(machine, machine.home_pose[:3, 3] + size * np.sin(speed * t))
    assert (solutions.status == 0).all()
    motion = size * speed * np.cos(speed * t), -size * speed**2 * np.sin(speed * t)
    found = pf.inverse_dynamics(solutions, twists=motion[0], accelerations=motion[1], gravity=gravity)
    si = motion[0] * metres
    energy = 0.5 * np.einsum("ni,nij,nj->n", si, pf.mass_matrix(solutions), si)
    for mass in machine.masses:
        moved = displacements(machine, solutions.q - home_coordinates(machine))[mass.body]
        energy -= mass.mass * metres * (moved[:, :3, :3] @ np.array(mass.centre) + moved[:, :3, 3]) @ gravity
    e = energy.reshape(-1, 5)
    power = found.power.sum(axis=-1).reshape(-1, 5)[:, 2]
    change = (8.0 * (e[:, 3] - e[:, 1]) - (e[:, 4] - e[:, 0])) / (12.0 * h)
    np.testing.assert_allclose(power, change, atol=1e-8 * np.abs(power).max())


def lagrange(shown: Callable[[Any], Any], weights: Any, potential: Callable[[Any], Any], q: Any, v: Any, a: Any) -> Any:
    """Generalised forces of coordinates that show positions and angles with weights: d/dt dT/dv - dT/dq + dU/dq."""
    h, one = 1e-4, np.eye(len(q))

    def slopes(q: Any) -> Any:
        return np.array([np.imag(shown(q + 1e-30j * each)) / 1e-30 for each in one]).T

    def momentum(t: float) -> Any:
        jacobian = slopes(q + v * t + 0.5 * a * t * t)
        return jacobian.T @ (weights * (jacobian @ (v + a * t)))

    def energy(q: Any) -> Any:
        return 0.5 * weights @ (slopes(q) @ v) ** 2

    def derivative(of: Callable[[Any], Any]) -> Any:
        return (8.0 * (of(h) - of(-h)) - (of(2 * h) - of(-2 * h))) / (12.0 * h)

    by_place = [derivative(lambda s, each=each: energy(q + s * each)) for each in one]
    pull = np.array([np.imag(potential(q + 1e-30j * each)) / 1e-30 for each in one])
    return derivative(momentum) - np.array(by_place) + pull


def slider_crank(drive: str, r: float = 0.1, length: float = 0.25) -> pf.Mechanism:
    """Its crank upright at home, driven at the crank, A, or the slider, D."""
    reach, turn = math.sqrt(length**2 - r * r), math.asin(r / length)
    joints = [
        pf.Joint("A", "revolute", ("base", "crank"), (0, 0, 0), (0, 0, 1), actuated=drive == "A"),
        pf.Joint("B", "revolute", ("crank", "rod"), (0, r, 0), (0, 0, 1)),
        pf.Joint("C", "revolute", ("rod", "slider"), (reach, 0, 0), (0, 0, 1)),
        pf.Joint("D", "prismatic", ("base", "slider"), axis=(1, 0, 0), actuated=drive == "D"),
    ]
    if drive == "A":
        joints[0] = dataclasses.replace(joints[0], rotor_inertia=1e-5, gear=20, friction=(0.1, 0.02))
    centres = {
        "crank": (0.4, (0, 0.03, 0)),
        "rod": (0.3, (0.1 * math.cos(turn), r - 0.1 * math.sin(turn), 0)),
        "slider": (0.7, (reach, 0, 0)),
    }
    masses = [pf.Mass(body, mass, at, (1e-3, 1e-3, 2e-3 * mass)) for body, (mass, at) in centres.items()]
    return pf.Mechanism("sc", joints, "slider", (reach, 0, 0), length_unit="m", task=("x",), masses=masses)


def test_a_slider_crank_is_as_its_closed_form() -> None:
    machine, r, length = slider_crank("A"), 0.1, 0.25

    def shown(q: Any) -> Any:
        theta = q[0] + math.pi / 2  # from the x axis
        phi = -np.arcsin(r * np.sin(theta) / length)
        x = r * np.cos(theta) + length * np.cos(phi)
        rod = (r * np.cos(theta) + 0.1 * np.cos(phi), r * np.sin(theta) + 0.1 * np.sin(phi))
        return np.array([0.03 * np.cos(theta), 0.03 * np.sin(theta), theta, *rod, phi, x, 0 * x, 0 * x])

    weights = np.array([0.4, 0.4, 8e-4, 0.3, 0.3, 6e-4, 0.7, 0.7, 0.0])
    q, v, a = np.array([-0.6]), np.array([3.0]), np.array([-7.0])
    expected = lagrange(shown, weights, lambda q: 9.81 * (weights[[1, 4]] @ shown(q)[[1, 4]]), q, v, a)
    motion: dict[str, Any] = {"twists": v, "accelerations": a, "at": "actuators", "gravity": (0, -9.81, 0)}
    found = pf.inverse_dynamics(pf.solve_fk(machine, q), **motion)
    drive = 1e-5 * 20**2 * a + 0.1 + 0.02 * v
    np.testing.assert_allclose(found.actuators, expected + drive, rtol=1e-8)
    np.testing.assert_allclose(found.power, found.actuators * v)


def test_a_slider_does_not_drive_its_crank_through_dead_centre() -> None:
    machine, down = slider_crank("D"), (0, -9.81, 0)
    there = pf.solve_fk(slider_crank("A"), np.linspace(-0.2, 0.2, 5)[:, None] - math.pi / 2)
    solution, is_dead = pf.configuration(machine, there.q), np.arange(5) == 2
    moving = pf.inverse_dynamics(solution, twists=[1.0], at="actuators")
    for found, reason in (
        (moving, "serial singularity"),
        (pf.inverse_dynamics(solution, gravity=down), "parallel singularity"),
    ):
        assert [reason in each for each in np.atleast_1d(found.reason)] == is_dead.tolist(), found.reason
        np.testing.assert_array_equal(np.isnan(found.actuators[:, 0]), is_dead)
    np.testing.assert_array_equal(np.isnan(pf.mass_matrix(solution)[:, 0, 0]), is_dead)
    path = pf.track(machine, solution.pose, start=solution[0], sample_time=0.1)
    stopped = pf.inverse_dynamics(path)
    assert all(stopped.reason) and stopped.projected.tolist() == is_dead.tolist()
    with pytest.raises(pf.errors.InvalidArgument, match=r"track: .* not reached.*row: 2\)"):
        pf.time_path(path, torque=500.0, gravity=down)


@pytest.mark.parametrize(("name", "motions", "still"), [("rps", 3, []), ("five_bar", 2, [0])])
def test_more_coordinates_than_motions_share_the_rank_of_these(name: str, motions: int, still: list[int]) -> None:
    machine = weighed(pf.load(name))
    machine = machine._with(task=machine.whole_task)
    solution, rates, _ = somewhere(machine)
    mass, twist = pf.mass_matrix(solution), pf.forward_jacobian(solution) @ rates
    assert np.linalg.matrix_rank(mass, 1e-9) == motions < len(mass) == len(twist)
    assert not mass[still].any()
    si, metres = units(machine)[1], np.repeat([metres_of(machine.length_unit), 1.0], 3)[: len(twist)]
    energy = (rates * si) @ pf.mass_matrix(solution, "actuators") @ (rates * si)
    np.testing.assert_allclose((twist * metres) @ mass @ (twist * metres), energy)


@pytest.mark.parametrize(("name", "task"), [("panda", ("x", "y", "z")), ("panda", None), ("serial_arm", ("x", "y"))])
def test_of_more_motions_than_coordinates_the_mass_is_that_which_a_force_meets(
    name: str, task: tuple[str, ...] | None
) -> None:
    """The least energy of all motions with a velocity there; forces M a accelerate it by a while actuators are free."""
    machine = weighed(pf.load(name))
    machine = machine if task is None else machine._with(task=task)
    solution, rates, _ = somewhere(machine)
    si, metres = units(machine)[1], metres_of(machine.length_unit)
    of_lengths = 3 if task is None else len(task)
    jacobian = pf.forward_jacobian(solution) / si
    jacobian = jacobian[: of_lengths if task else len(jacobian)]
    jacobian[:of_lengths] *= metres
    mass, at_actuators = pf.mass_matrix(solution), pf.mass_matrix(solution, "actuators")
    assert len(mass) < len(rates)
    pushed = np.linalg.solve(at_actuators, jacobian.T)  # rates that a unit impulse at the task gives
    np.testing.assert_allclose(mass @ (jacobian @ pushed), np.eye(len(mass)), atol=1e-8)
    least = pushed @ mass @ np.arange(1.0, len(mass) + 1.0)
    other = least + np.linalg.svd(jacobian)[2][-1]
    assert 0.5 * least @ at_actuators @ least < 0.5 * other @ at_actuators @ other


def test_a_mass_matrix_takes_no_forces() -> None:
    solution, *_ = somewhere(weighed(pf.load("delta")))
    with pytest.raises(pf.errors.InvalidArgument, match=r"loads\['platform'\]: found a force.*\(mass, centre\)"):
        pf.mass_matrix(solution, loads={"platform": ((0, 0, -5), (0, 0, -190))})


def test_a_five_bar_is_as_its_closed_form() -> None:
    machine = pf.load("five_bar")
    place = {joint.name: np.array(joint.at)[1:] for joint in machine.joints}
    ends = {body: [j.name for j in machine.joints if body in j.connects] for body in machine.bodies}
    masses = [
        pf.Mass(body, 0.5, (0.0, *(0.5 * (place[a] + place[b]))), (400, 200, 200))
        for body, (a, b) in list(ends.items())
        if body != "base"
    ]
    machine = machine.with_masses(masses)
    a0, b0, c0, d0, e0 = (place[f"p{k}"] for k in (1, 2, 3, 4, 5))

    def turned(arm: Any, angle: Any) -> Any:
        return np.array(
            [np.cos(angle) * arm[0] - np.sin(angle) * arm[1], np.sin(angle) * arm[0] + np.cos(angle) * arm[1]]
        )

    base, arm = d0 - b0, c0 - b0
    side = np.sign(base[0] * arm[1] - base[1] * arm[0])

    def shown(q: Any) -> Any:
        left, right = a0 + turned(b0 - a0, q[0]), e0 + turned(d0 - e0, q[1])
        r, s, span = np.linalg.norm(c0 - b0), np.linalg.norm(c0 - d0), right - left
        d = np.sqrt(span @ span)
        x = (d * d + r * r - s * s) / (2 * d)
        tip = left + (x * span + side * np.sqrt(r * r - x * x) * np.array([-span[1], span[0]])) / d
        angles = [np.arctan(u[1] / u[0]) for u in (tip - left, tip - right)]
        centres = [0.5 * (a0 + left), 0.5 * (e0 + right), 0.5 * (left + tip), 0.5 * (right + tip)]
        return 1e-3 * np.concatenate([*centres, 1e3 * q, 1e3 * np.array(angles)])

    weights = np.array([0.5] * 8 + [4e-4] * 4)
    solution, v, a = somewhere(machine)
    q = solution.actuators - pf.solve_ik(machine, machine.home_pose).actuators
    expected = lagrange(shown, weights, lambda q: 9.81 * 0.5 * shown(q)[1:8:2].sum(), q, v, a)
    found = pf.inverse_dynamics(solution, twists=v, accelerations=a, at="actuators")
    np.testing.assert_allclose(found.actuators, expected, rtol=1e-7)


def test_a_platform_on_legs_without_mass_is_newtons_and_eulers() -> None:
    machine = weighed(pf.load("stewart"), own={"platform": 1.7})
    poses, twists, accelerations = on_the_way(np.linspace(0.0, 2.0, 7))
    solutions = pf.solve_ik(machine, poses)
    found = pf.inverse_dynamics(solutions, twists=twists, accelerations=accelerations)
    mass = next(each for each in machine.masses if each.body == "platform")
    xx, yy, zz, xy, xz, yz = mass.inertia or ()
    at_home = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) * 1e-6
    for k, pose in enumerate(poses):
        arm = pose[:3, :3] @ (np.array(mass.centre) - machine.reference_point) * 1e-3
        inertia, w, dw = pose[:3, :3] @ at_home @ pose[:3, :3].T, twists[k, 3:], accelerations[k, 3:]
        at_centre = accelerations[k, :3] * 1e-3 + np.cross(dw, arm) + np.cross(w, np.cross(w, arm))
        force = mass.mass * (at_centre + np.array([0.0, 0.0, 9.81]))
        moment = inertia @ dw + np.cross(w, inertia @ w) + np.cross(arm, force)
        jacobian = pf.inverse_jacobian(solutions[k])  # actuator rates per twist, of mm
        expected = np.linalg.solve(jacobian.T, np.concatenate([force, moment * 1e3]))
        np.testing.assert_allclose(found.actuators[k], expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", ["stewart", "delta", "nrpm", "rps"])
def test_moved_scaled_and_relabelled_machines_do_the_same(name: str) -> None:
    machine = weighed(pf.load(name).without_limits())
    solution, rates, gains = somewhere(machine)
    motion: dict[str, Any] = {"at": "actuators", "gravity": (0, 3, -9)}
    found = pf.inverse_dynamics(solution, twists=rates, accelerations=gains, **motion)
    shift, scale = np.array([3e4, -1e4, 2e4]), metres_of(machine.length_unit)

    def point(value: Any) -> Any:
        return None if value is None else (np.array(value) + shift) * scale

    homes = [np.multiply(joint.home, scale if joint.type == "prismatic" else 1.0) for joint in machine.joints]
    pairs = zip(machine.joints, homes, strict=True)
    joints = [dataclasses.replace(joint, at=point(joint.at), home=home) for joint, home in pairs]
    masses = [
        pf.Mass(each.body, each.mass, point(each.centre), np.array(each.inertia) * scale**2) for each in machine.masses
    ]
    reference = point(machine.reference_point)
    other = pf.Mechanism(
        "other", joints[::-1], machine.end_effector, reference, length_unit="m", task=machine.task, masses=masses
    )
    order, si = [other.actuator_names.index(each) for each in machine.actuator_names], units(machine)[1]
    back = np.argsort(order)
    there = pf.solve_fk(other, (solution.actuators * si)[back])
    again = pf.inverse_dynamics(there, twists=(rates * si)[back], accelerations=(gains * si)[back], **motion)
    np.testing.assert_allclose(
        again.actuators[order], found.actuators, rtol=1e-7, atol=1e-7 * np.abs(found.actuators).max()
    )
    np.testing.assert_allclose(again.power[order], found.power, rtol=1e-7, atol=1e-7 * np.abs(found.power).max())
    at_task = pf.mass_matrix(solution)
    np.testing.assert_allclose(pf.mass_matrix(there), at_task, atol=1e-8 * np.abs(at_task).max())


def test_paths_with_times_move_as_these_say() -> None:
    machine = weighed(pf.load("stewart"))
    t = np.arange(0.0, 1.0, 0.005)
    poses, twists, accelerations = on_the_way(t)
    path = pf.track(machine, poses, sample_time=0.005)
    found = pf.inverse_dynamics(path)
    expected = pf.inverse_dynamics(path, twists=twists, accelerations=accelerations)
    size = np.abs(expected.actuators).max()
    np.testing.assert_allclose(found.actuators[2:-2], expected.actuators[2:-2], atol=1e-5 * size)
    np.testing.assert_allclose(found.actuators, expected.actuators, atol=1e-3 * size)
    assert found.energy is not None
    np.testing.assert_allclose(np.gradient(found.energy, t)[5:-5], found.power.sum(axis=1)[5:-5], atol=1e-2)
    timed = pf.time_path(path, speed=200, acceleration=3000, rate=200)
    fast = pf.inverse_dynamics(timed)
    np.testing.assert_allclose(fast.rates, timed.rates, atol=1e-9 * np.abs(timed.rates).max())
    np.testing.assert_allclose(fast.accelerations, timed.accelerations, atol=1e-9 * 3000)
    assert fast.table().rows[0][0] == "BL1"


def test_what_a_body_carries_is_as_if_it_weighed_more() -> None:
    points = [dataclasses.replace(each, mass=0.0, inertia=None) for each in weighed(pf.load("delta")).masses]
    (platform,) = (each for each in points if each.body == "platform")
    heavy = [dataclasses.replace(each, mass=0.5 * (each is platform)) for each in points]
    bare, machine = (pf.load("delta").with_masses(masses) for masses in (points, heavy))
    motion: dict[str, Any] = {"twists": [100, 50, -20], "accelerations": [3000, -1000, 500]}
    solution, *_ = somewhere(machine)
    found = pf.inverse_dynamics(
        pf.configuration(bare, solution.q), **motion, loads={"platform": (0.5, platform.centre)}
    )
    np.testing.assert_allclose(found.actuators, pf.inverse_dynamics(solution, **motion).actuators, rtol=1e-12)


def test_redundant_actuators_share_the_work_within_their_limits() -> None:
    plain = weighed(pf.load("five_bar"))
    more = plain._with_joints(dataclasses.replace(joint, actuated=joint.name != "p3") for joint in plain.joints)
    solution, *_ = somewhere(plain)
    motion: dict[str, Any] = {"twists": [0, 200, 100], "accelerations": [0, 9000, 5000]}
    alone = pf.inverse_dynamics(solution, **motion)
    shared = pf.inverse_dynamics(pf.configuration(more, solution.q), **motion)
    assert shared.is_least_norm and not alone.is_least_norm
    np.testing.assert_allclose(shared.power.sum(), alone.power.sum(), rtol=1e-9)
    assert np.linalg.norm(shared.actuators) < np.linalg.norm(alone.actuators)
    most = 0.9 * np.abs(shared.actuators).max()
    held = more._with_joints(
        dataclasses.replace(joint, max_torque=most) if joint.actuated else joint for joint in more.joints
    )
    found = pf.inverse_dynamics(pf.configuration(held, solution.q), **motion)
    assert np.abs(found.actuators).max() <= most * (1 + 1e-8)
    np.testing.assert_allclose(found.power.sum(), alone.power.sum(), rtol=1e-7)
    forearm = [each.reactions["p2"][1:3] - each.reactions["p3"][1:3] for each in (found, shared)]
    np.testing.assert_allclose(*forearm, atol=1e-6)  # what its ends pass moves it, whoever drives


def test_numbers_that_overflow_have_a_reason() -> None:
    solution, *_ = somewhere(weighed(pf.load("stewart")))
    found = pf.inverse_dynamics(solution, twists=np.full(6, 1e200))
    assert np.isnan(found.actuators).all() and "too large" in str(found.reason)


def test_rows_without_a_configuration_have_a_reason() -> None:
    machine = weighed(pf.load("delta"))
    targets = [machine.home_pose[:3, 3], [np.nan] * 3]
    solutions = pf.solve_ik(machine, targets, options=pf.Options(on_invalid="mark"))
    found = pf.inverse_dynamics(solutions, twists=[10, 0, 0])
    assert list(np.isnan(found.actuators).any(axis=1)) == [False, True]
    assert "INVALID" in np.ravel(found.reason)[1]
    assert np.isnan(pf.mass_matrix(solutions)[1]).all()


def test_joints_of_a_serial_model_feel_the_mass_by_their_jacobian() -> None:
    machine = weighed(pf.load("g1_ankle"))
    serial = ("pitch_joint", "roll_joint")
    solution, *_ = somewhere(machine)
    by_motor = pf.mass_matrix(solution, "actuators")
    jacobian = pf.actuation(machine, serial).jacobian([solution.joints[name] for name in serial])
    np.testing.assert_allclose(pf.mass_matrix(solution, serial), jacobian.T @ by_motor @ jacobian, rtol=1e-7)


def test_parts_of_a_motion_that_a_task_leaves_out_follow() -> None:
    machine = weighed(pf.load("rps"))
    solution = pf.solve_ik(machine, machine.home_pose)
    found = pf.inverse_dynamics(solution, twists=[99, 0, 50, 0.1, 0.2, 99])
    rates = pf.inverse_dynamics(solution, twists=found.rates, accelerations=found.accelerations, at="actuators")
    np.testing.assert_allclose(rates.actuators, found.actuators, rtol=1e-9)
    np.testing.assert_allclose((pf.forward_jacobian(solution) @ found.rates)[[2, 3, 4]], [50, 0.1, 0.2], atol=1e-9)


def test_refusals_name_what_is_lacking() -> None:
    stewart = pf.load("stewart")
    home = pf.solve_ik(stewart, stewart.home_pose)
    with pytest.raises(pf.errors.InvalidArgument, match=r"no mass of cylinderL1, .*rodR3"):
        pf.inverse_dynamics(home)
    machine = weighed(stewart)
    home = pf.solve_ik(machine, machine.home_pose)
    with pytest.raises(pf.errors.InvalidArgument, match="without times"):
        pf.inverse_dynamics(pf.track(machine, [machine.home_pose] * 4))
    with pytest.raises(pf.errors.InvalidArgument, match=r"twists.*batch"):
        pf.inverse_dynamics(home, twists=np.zeros((3, 6)))
    waiting = pf.track(machine, [machine.home_pose] * 4, times=[0.0, 1.0, 1.0, 2.0])
    with pytest.raises(pf.errors.InvalidArgument, match="do not rise") as refused:
        pf.inverse_dynamics(waiting)
    assert "2" in str(refused.value)


def test_no_mass_is_felt_where_the_motion_cannot_be_made() -> None:
    length = 0.3
    at = {"A": (0, 0, 0), "B": (0.1, 0, 0), "C": (0.1 + length, 0, 0), "D": (0.1 + length, 0, 0)}
    ends = {"A": ("base", "crank"), "B": ("crank", "rod"), "C": ("rod", "slider"), "D": ("slider", "base")}
    joints = [
        pf.Joint(name, "prismatic" if name == "D" else "revolute", ends[name], at=at[name],
                 axis=(1, 0, 0) if name == "D" else (0, 0, 1), actuated=name == "A")
        for name in at
    ]  # fmt: skip
    crank = pf.Mechanism("crank", joints, "slider", at["D"], task=("x",), length_unit="m")
    crank = crank.with_masses([pf.Mass("crank", 0.0), pf.Mass("rod", 0.0), pf.Mass("slider", 2.0, at["C"])])
    solutions = pf.solve_fk(crank, [[0.0], [1e-3], [0.5]])  # from the dead centre on
    assert np.isnan(np.ravel(pf.mass_matrix(solutions))).tolist() == [True, False, False]
    angle = np.array([0.0, 1e-3, 0.5])
    rate = -0.1 * np.sin(angle) * (1 + 0.1 * np.cos(angle) / np.sqrt(length**2 - (0.1 * np.sin(angle)) ** 2))
    np.testing.assert_allclose(np.ravel(pf.mass_matrix(solutions, "actuators")), 2 * rate**2, rtol=1e-6, atol=1e-15)
    np.testing.assert_allclose(np.ravel(pf.mass_matrix(solutions, "D")), [np.nan, 2, 2], rtol=1e-9)


def test_at_singular_poses_a_reason_is_given() -> None:
    machine = weighed(pf.load("five_bar").without_limits())
    a, b, c = (np.array(machine.joint(name).at) for name in ("p1", "p2", "p3"))
    stretched = (np.linalg.norm(b - a) + np.linalg.norm(c - b)) / np.linalg.norm(c - a)
    found = pf.inverse_dynamics(pf.solve_ik(machine, a + (1.0 - 1e-10) * stretched * (c - a)), twists=c - a)
    assert "serial singularity" in str(found.reason)
    assert np.isnan(found.actuators).all()
    assert "serial singularity" in str(found.table())


def sway(machine: pf.Mechanism, amount: float, times: Any) -> pf.Track:
    """A path about home and back, so many L far, which is out of reach where that is far."""
    way = np.random.default_rng(3).standard_normal(3) * np.isin(["x", "y", "z"], machine.task)
    shift = amount * machine.characteristic_length * np.outer(np.sin(1.3 * times) ** 2, way / np.linalg.norm(way))
    poses = np.tile(machine.home_pose, (len(times), 1, 1))
    poses[:, :3, 3] += shift
    return pf.track(machine, poses, times=times)


@pytest.mark.parametrize("name", ["delta", "five_bar", "hexaglide", "servo_hexapod"])
def test_a_sizing_is_what_numpy_makes_of_the_rows(name: str) -> None:
    machine = motorised(weighed(pf.load(name)))
    times = np.cumsum(np.random.default_rng(2).uniform(0.01, 0.03, 60))
    found = pf.inverse_dynamics(sway(machine, 0.02, times))
    sizing, si = found.sizing, units(machine)[1]
    assert not any(found.reason)
    for place, drive in enumerate(machine.drives):
        force, rate, power = (x[:, place] for x in (found.actuators, found.rates, found.power))
        peak, fastest = force[np.argmax(np.abs(force))], np.abs(rate).max()
        seconds = np.ptp(times)
        expected = {
            "rms": math.sqrt(np.trapezoid(force**2, times) / seconds),
            "peak": peak,
            "peak_rate": fastest,
            "peak_power": max(0.0, power.max()),
            "braking": max(0.0, -power.min()),
            "mean_power": np.trapezoid(force * rate * si[place], times) / seconds,
            "torque_margin": 1.0 - abs(peak) / drive.said("max_torque"),
            "speed_margin": 1.0 - fastest / drive.said("max_speed"),
            "motor_rms": math.sqrt(np.trapezoid((force / drive.said("gear")) ** 2, times) / seconds),
            "motor_peak": peak / drive.said("gear"),
            "motor_speed": fastest * si[place] * drive.said("gear"),
        }
        for field, value in expected.items():
            assert getattr(sizing, field)[place] == pytest.approx(value, rel=1e-12), (drive.name, field)
        alike = np.abs(rate[np.abs(force) >= 0.999 * abs(peak)])
        assert abs(sizing.rate_at_peak[place]) == pytest.approx(alike.max(), rel=2e-3, abs=2e-5 * fastest)
    assert sizing.mean_power.sum() * seconds == pytest.approx(found.energy[-1])
    bare = pf.inverse_dynamics(sway(weighed(pf.load(name)), 0.02, times)).sizing
    assert all(np.isnan(each).all() for each in (bare.torque_margin, bare.motor_rms, bare.motor_speed))
    assert "left of" not in str(bare) and "left of torque" in str(found) and "rpm" in str(found)


@pytest.mark.parametrize("name", ["delta", "five_bar", "hexaglide", "stewart"])
def test_out_of_reach_forces_are_those_of_what_the_machine_does(name: str) -> None:
    machine, peaks = weighed(pf.load(name)), []
    for count in (161, 641):
        path = sway(machine, 2.0, np.linspace(0.0, 2.4, count))
        found = pf.inverse_dynamics(path)
        assert found.projected.any() and not found.projected.all()
        np.testing.assert_array_equal(found.projected, path.status == pf.Status.PROJECTED)
        again = pf.track(machine, path.pose, times=path.times)
        assert again
        done = pf.inverse_dynamics(again).actuators
        held = [{(each.joint, each.bound) for each in limits} for limits in path.active_limits]
        held = [each if off else set() for each, off in zip(held, found.projected, strict=True)]
        leaps = [k for k in range(1, count) if held[k] != held[k - 1]]
        rows = np.arange(count)
        first = np.clip(rows - 2, 0, count - 5)  # of the five steps whose polynomial a row has
        about = np.any([(first < k) & (k <= first + 4) for k in leaps], axis=0)
        np.testing.assert_array_equal(["leaps" in each for each in found.reason], about)
        kept = ~np.isnan(found.actuators).any(axis=1)
        np.testing.assert_array_equal(kept, ~about)
        np.testing.assert_allclose(found.actuators[kept], done[kept], atol=1e-5 * np.abs(done[kept]).max())
        peaks.append(np.abs(found.sizing.peak).max())
    assert peaks[1] < 3.0 * peaks[0]  # those of a leap would grow as the number of steps, fourfold
    assert "out of reach" in str(found) and f"{int(found.projected.sum())} targets" in str(found)
    with pytest.raises(pf.errors.InvalidArgument, match="not reached"):
        pf.identify(path, np.ones(path.actuators.shape))


@pytest.mark.parametrize("name", ["delta", "stewart"])
def test_a_picture_of_efforts_has_every_actuator_between_its_limits(name: str) -> None:
    pytest.importorskip("matplotlib")
    from matplotlib import pyplot
    from matplotlib.colors import to_hex

    machine = motorised(weighed(pf.load(name)))
    found = pf.inverse_dynamics(sway(machine, 2.0, np.linspace(0.0, 2.4, 161)))
    figure = found.plot(theme="dark")
    *panels, power, _ = figure.axes
    assert len(panels) == 2 * len(machine.drives)
    for place, (drive, over_time, over_rates) in enumerate(zip(machine.drives, panels[::2], panels[1::2], strict=True)):
        force, most, fastest = found.actuators[:, place], drive.said("max_torque"), drive.said("max_speed")
        rate = np.degrees(found.rates[:, place]) if drive.kind == "angle" else found.rates[:, place]
        fastest = math.degrees(fastest) if drive.kind == "angle" else fastest
        np.testing.assert_array_equal(over_time.lines[0].get_ydata(), force)
        held = np.asarray(over_time.lines[1].get_ydata())
        np.testing.assert_array_equal(held, np.where(np.abs(force) >= most * (1 - 1e-4), force, np.nan))
        level = [float(line.get_ydata()[0]) for line in over_time.lines if len(set(line.get_ydata())) == 1]
        assert {-most, most, found.sizing.rms[place], found.sizing.peak[place]} <= set(level)
        assert {-fastest, fastest} <= {float(line.get_xdata()[0]) for line in over_rates.lines}
        inside, beyond = (np.asarray(each.get_offsets()) for each in over_rates.collections)
        rows = ~np.isnan(force)
        cloud = np.stack([rate, force], axis=1)[rows]
        is_beyond = (np.abs(cloud) >= np.array([fastest, most]) * (1 - 1e-4)).any(axis=1)
        np.testing.assert_allclose(beyond[~np.isnan(beyond).any(axis=1)], cloud[is_beyond])
        np.testing.assert_allclose(inside[~np.isnan(inside).any(axis=1)], cloud[~is_beyond])
        assert drive.name in over_time.get_title(loc="left")
        assert f"rms {found.sizing.rms[place]:.4g}" in over_time.get_title(loc="left")
    total = np.asarray(power.lines[-1].get_ydata())
    np.testing.assert_array_equal(total, found.power.sum(axis=1))
    assert to_hex(figure.get_facecolor()) == "#14161a"
    pyplot.close(figure)
    with pytest.raises(pf.errors.InvalidArgument, match="size"):
        found.plot(size=(1.0, 1.0))


def notes(efforts: pf.Efforts) -> str:
    return " ".join(str(efforts).split())


def test_what_the_digits_of_a_path_make_is_said_about_as_large_as_it_is() -> None:
    """Twice the root mean square of what rounding changes, within a factor of two; nothing where it does not show."""
    machine = weighed(pf.load("linear_delta"))
    for step, digits, is_said in ((5e-4, 3, True), (1e-3, 3, True), (0.02, 3, False), (1e-3, 9, False)):
        t = np.arange(0.0, 1.0, step)
        exact = machine.home_pose[:3, 3] + np.stack([10 * np.sin(3 * t) ** 3, 8 * np.sin(2 * t) ** 4, 0 * t], axis=1)
        rounded, smooth = (
            pf.inverse_dynamics(pf.track(machine, each, sample_time=step)) for each in (exact.round(digits), exact)
        )
        said = re.search(r"digits of this path make ±(\S+) N of that", notes(rounded))
        assert bool(said) == is_said and "digits" not in notes(smooth)
        if said is not None:
            off = 2.0 * np.sqrt(np.mean((rounded.actuators - smooth.actuators)[3:-3] ** 2, axis=0)).max()
            assert 0.5 * off < float(said[1]) < 2.0 * off
    whole = machine.home_pose[:3, 3] + np.arange(50)[:, None] * np.array([0.1, 0.0, 0.0])
    assert "digits" not in notes(pf.inverse_dynamics(pf.track(machine, whole, sample_time=0.1)))  # exact, not rounded


def test_a_path_that_is_in_motion_at_its_ends_says_so() -> None:
    machine = weighed(pf.load("linear_delta"))
    few = machine.home_pose[:3, 3] + np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [5.0, 0.0, 0.0], [12.0, 0.0, 0.0]])
    assert "starts at" in notes(pf.inverse_dynamics(pf.track(machine, few, times=[0.0, 0.1, 0.2, 0.3])))
    t = np.linspace(0.0, 1.0, 200)
    gentle = machine.home_pose[:3, 3] + (t**3 * (10.0 - 15.0 * t + 6.0 * t**2))[:, None] * np.array([10.0, 0.0, 5.0])
    assert "starts" not in notes(pf.inverse_dynamics(pf.track(machine, gentle, times=t)))
