"""Forces hold what they say they hold; factors, stiffness and accuracy follow from them, by oracles of their own."""

from __future__ import annotations

import dataclasses
import itertools
import warnings
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

import pfabrik as pf
from in_mujoco import Model, mujoco
from machines import closure, ring
from pfabrik.errors import InvalidArgument, UnknownName, UnsupportedMechanism
from pfabrik.exchange.interop import to_mjcf
from pfabrik.exchange.interop.referee import reached_at_random
from pfabrik.machine.files.units import metres_of

Array = NDArray[np.float64]
QUICK = ("stewart", "five_bar", "orthoglide", "tricept", "rps")
WRENCH = np.array([10.0, -20.0, 30.0, 400.0, 500.0, -600.0])


def named(*names: str) -> list[object]:
    """Names of machines as parameters: those that take their time as plain Python are marked as slow."""
    return [name if name in QUICK else pytest.param(name, marks=pytest.mark.compiled) for name in names]


@cache
def rows_of(name: str, count: int = 2) -> list[pf.Solution]:
    """Configurations of a machine of the catalogue, or of `cables`."""
    machine, rng = cables() if name == "cables" else pf.load(name), np.random.default_rng(5)
    if name != "cables":
        return reached_at_random(machine, count, rng)
    shifts, turns = rng.uniform(-90, 90, (count, 3)), rng.uniform(-0.2, 0.2, (count, 3))
    return list(pf.solve_ik(machine, pf.pose(machine.reference_point + shifts, rotvec=turns)))


class Weighed:
    """A machine of bodies with masses in MuJoCo, which says what its actuators have to exert at rest."""

    def __init__(self, mechanism: pf.Mechanism) -> None:
        self.mechanism, self.metres = mechanism, metres_of(mechanism.length_unit)
        moving = [body for body in mechanism.bodies if body != mechanism.base]
        self.masses = {body: 0.5 + 0.25 * place for place, body in enumerate(moving)}
        self.model = Model.of(to_mjcf(mechanism, masses=self.masses, gravity=(0, 0, -9.81)))
        self.centres = {body: np.array(self.model.data.body(body).xipos) / self.metres for body in moving}

    @property
    def loads(self) -> dict[str, tuple[float, Array]]:
        return {body: (mass, self.centres[body]) for body, mass in self.masses.items()}

    def actuators(self, solution: pf.Solution, wrench: Array) -> Array:
        """Forces [N] and torques [N mm or the like] at rest: those that MuJoCo's loops leave to actuators."""
        names, model, data = self.mechanism.actuator_names, self.model.model, self.model.data
        turning = np.array([self.mechanism.joint(name).type == "revolute" for name in names])
        gap = self.model.lead(names, solution.actuators * np.where(turning, 1.0, self.metres))
        assert gap < 1e-12
        position, _ = self.model.pose("reference_point", "site")
        np.testing.assert_allclose(position, solution.pose[:3, 3] * self.metres, atol=1e-9)
        mujoco.mj_forward(model, data)
        _, loops = self.model.rows()
        linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jacSite(model, data, linear, angular, model.site("reference_point").id)
        needed = data.qfrc_bias - linear.T @ wrench[:3] - angular.T @ wrench[3:] * self.metres
        driven = [int(model.joint(name).dofadr[0]) for name in names]
        passive = np.setdiff1d(np.arange(model.nv), driven)
        multipliers = np.linalg.lstsq(loops[:, passive].T, needed[passive], rcond=1e-10)[0]
        assert np.abs(loops[:, passive].T @ multipliers - needed[passive]).max() < 1e-7
        exerted = needed[driven] - loops[:, driven].T @ multipliers
        return exerted / np.where(turning, self.metres, 1.0)


@pytest.mark.parametrize("name", named("stewart", "delta", "rps", "hexaglide", "tricept", "five_bar", "orthoglide"))
@pytest.mark.parametrize("poses", [3, pytest.param(50, marks=pytest.mark.campaign)])
def test_actuators_exert_what_mujoco_needs_to_rest(name: str, poses: int) -> None:
    mechanism = pf.load(name)
    weighed, rng = Weighed(mechanism), np.random.default_rng(2)
    for solution in reached_at_random(mechanism, poses, rng):
        wrench = rng.uniform(-50, 50, 6) * np.repeat([1.0, mechanism.characteristic_length], 3)
        given = wrench
        if mechanism.end_effector_is_joint:
            wrench[3:], given = 0.0, wrench[:3]
        expected = weighed.actuators(solution, wrench)
        found = pf.forces(solution, given, loads=weighed.loads)
        assert found.reason == ""
        np.testing.assert_allclose(found.actuators, expected, atol=1e-5 * np.abs(expected).max())


@cache
def cables() -> pf.Mechanism:
    """A body on eight cables in a frame."""
    corners = np.array(list(itertools.product((-500.0, 500.0), (-400.0, 400.0), (0.0, 600.0))))
    shares = np.where(corners[:, 2:] == 0.0, [0.12, 0.05, 0.0], [0.04, 0.15, 0.0])
    ends = corners * shares + [0.0, 0.0, 300.0] + (300.0 - corners) * [0.0, 0.0, 0.15]
    return pf.Mechanism.from_legs("U-P*-S", base=corners, platform=ends, stroke=(10, 2000), reference_point=(0, 0, 300))


def struts_jacobian(solution: pf.Solution) -> Array:
    """Rates of strut lengths per twist, from the points of a machine of struts alone, (n_a, 6)."""
    machine, rows = solution.mechanism, []
    for name in machine.actuator_names:
        start, end = (solution.points[joint.name] for joint in machine.ends_along(machine.joint(name)))
        along = (end - start) / np.linalg.norm(end - start)
        rows.append(np.r_[along, np.cross(end - solution.pose[:3, 3], along)])
    return np.array(rows)


def test_struts_push_along_their_lines_and_are_springs_along_them() -> None:
    k = np.array([100.0, 120.0, 90.0, 200.0, 50.0, 70.0])
    for solution in rows_of("stewart"):
        jacobian, stiff = struts_jacobian(solution), pf.stiffness(solution, k)
        np.testing.assert_allclose(stiff.matrix, jacobian.T @ np.diag(k) @ jacobian, rtol=1e-7, atol=1e-6)
        np.testing.assert_allclose(stiff.matrix @ stiff.compliance, np.eye(6), atol=1e-7)
        assert stiff.rigid == 0
        expected = -np.linalg.solve(jacobian.T, WRENCH)
        np.testing.assert_allclose(pf.forces(solution, WRENCH).actuators, expected, rtol=1e-9)
        point = solution.pose[:3, 3] + [3.0, -40.0, 20.0]
        moved = np.r_[WRENCH[:3], WRENCH[3:] + np.cross(solution.pose[:3, 3] - point, WRENCH[:3])]
        np.testing.assert_allclose(pf.forces(solution, moved, at=point).actuators, expected, rtol=1e-9)


@pytest.mark.parametrize("name", named("stewart", "delta", "tricept", "canfield", "g1_ankle", "panda"))
def test_reactions_hold_every_body_and_no_free_motion(name: str) -> None:
    machine = pf.load(name)
    body = next(body for body in machine.bodies if body not in (machine.base, machine.end_effector_body))
    pin = next(joint for joint in machine.joints if body in joint.connects and joint.at is not None)
    for solution in rows_of(name):
        force = np.array([1.0, 2.0, -50.0])
        found = pf.forces(solution, WRENCH, loads={body: (force, pin.at)})
        assert (found.reason, found.undetermined) == ("", "")
        left = {each: np.zeros(6) for each in machine.bodies}
        left[machine.end_effector_body] += WRENCH
        left[body] += np.r_[force, np.cross(solution.points[pin.name] - solution.pose[:3, 3], force)]
        size = np.abs(np.array(list(found.reactions.values()))).max()
        for joint in machine.joints:
            reaction, at = found.reactions[joint.name], centre(solution, joint)
            about = reaction + np.r_[np.zeros(3), np.cross(at - solution.pose[:3, 3], reaction[:3])]
            left[joint.connects[0]] -= about
            left[joint.connects[1]] += about
            if joint.type == "spherical":
                assert np.abs(reaction[3:]).max() <= 1e-9 * size
            if joint.type == "prismatic" and joint.driven and joint.along:
                ends = [solution.points[each.name] for each in machine.ends_along(joint)]
                along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
                exerted = found.actuators[machine.actuator_names.index(joint.name)]
                assert reaction[:3] @ along == pytest.approx(exerted, abs=1e-9 * size)
        del left[machine.base]
        assert max(np.abs(wrench).max() for wrench in left.values()) <= 1e-9 * size


def centre(solution: pf.Solution, joint: pf.Joint) -> Array:
    """What the moment of a joint's reaction is about."""
    if joint.at is not None:
        return np.asarray(solution.points[joint.name])
    return np.asarray(solution.points[joint.along[0]] if joint.along else solution.pose[:3, 3])


def test_a_five_bar_pulls_along_its_forearms_and_says_what_it_does_not_know() -> None:
    for solution in rows_of("five_bar"):
        force = np.array([0.0, 7.0, -20.0])
        tip, elbows = solution.points["p3"], [solution.points["p2"], solution.points["p4"]]
        along = np.array([(tip - elbow) / np.linalg.norm(tip - elbow) for elbow in elbows])
        pulls = np.linalg.solve(along[:, 1:].T, force[1:])
        found = pf.forces(solution, force)
        np.testing.assert_allclose([found.rods["link2"], found.rods["link3"]], pulls, rtol=1e-9)
        cranks = [solution.points["p1"], solution.points["p5"]]
        torques = [-np.cross(e - c, p * a)[0] for e, c, p, a in zip(elbows, cranks, pulls, along, strict=True)]
        np.testing.assert_allclose(found.actuators, torques, rtol=1e-9)
        reaction = found.reactions["p2"]
        np.testing.assert_allclose(reaction[1:3], -pulls[0] * along[0][1:], rtol=1e-9)
        assert np.isnan(reaction[[0, 4, 5]]).all()
        assert "p2 fx" in found.undetermined


def test_at_a_parallel_singularity_only_what_does_no_work_is_held() -> None:
    """Forearms of 145 mm in line, cranks of 110 mm at 50 mm either side: the tip is as high as the elbows."""
    machine = pf.load("five_bar").without_limits()
    height = np.sqrt(110.0**2 - 95.0**2)
    flat = pf.solve_ik(machine, [0, 0, height])
    assert flat
    assert pf.singularity(flat).kinds == ("parallel",)
    lifted = pf.forces(flat, [0, 0, 5.0])
    assert np.isnan(lifted.actuators).all()
    assert "parallel singularity" in str(lifted.reason)
    assert np.isnan(lifted.reactions["p2"]).all()
    along = pf.forces(flat, [0, 5.0, 0])
    assert along.reason == ""
    np.testing.assert_allclose(along.actuators, [5.0 * height / 2, 5.0 * height / 2], rtol=1e-6)
    for other in (
        pf.wrench_capacity(flat, 5.0),
        pf.transmission(flat),
        pf.stiffness(flat, 5.0),
        pf.accuracy(flat, 0.1),
    ):
        assert "parallel singularity" in str(other.reason)
    both = pf.solve_ik(machine, [[0, 0, height], [0, 0, 200]])
    stiff = pf.stiffness(both, 5.0)
    assert list(np.isnan(stiff.matrix).any(axis=(1, 2))) == [True, False]
    np.testing.assert_allclose(stiff.matrix[1], pf.stiffness(both[1], 5.0).matrix, rtol=1e-9)


@pytest.mark.compiled
@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
def test_at_a_constraint_singularity_nothing_is_said() -> None:
    machine = closure.h4()
    home = pf.solve_ik(machine, machine.home_pose)
    assert pf.singularity(home).kinds == ("constraint",)
    for found in (pf.forces(home, [0, 0, -5.0]), pf.transmission(home), pf.stiffness(home, 5.0, rods=5.0)):
        assert "constraint singularity" in str(found.reason)
    assert np.isnan(pf.forces(home, [0, 0, -5.0]).actuators).all()


def test_a_stretched_leg_holds_without_its_motor() -> None:
    """At the border of what a 5-bar reaches, its forearms are in line with their cranks: no motor moves the tip."""
    machine = pf.load("five_bar").without_limits()
    top = pf.solve_ik(machine, [0, 0, np.sqrt(255.0**2 - 50.0**2)])
    assert top
    assert "serial" in pf.singularity(top).kinds
    np.testing.assert_allclose(pf.forces(top, [0, 0, -20.0]).actuators, 0.0, atol=1e-3)
    lifted = pf.stiffness(top, 100.0)
    assert (lifted.reason, lifted.rigid) == ("", 3)
    assert float(pf.wrench_capacity(top, 5.0).radius) > 1e4


def test_redundant_actuators_share_with_the_least_norm() -> None:
    for solution in rows_of("cables"):
        jacobian, wrench = struts_jacobian(solution), np.array([10.0, -20.0, 0.0, 0.0, 0.0, 300.0])
        found = pf.forces(solution, wrench)
        assert found.is_least_norm
        assert found.undetermined == ""
        np.testing.assert_allclose(found.actuators, -np.linalg.lstsq(jacobian.T, wrench, rcond=1e-9)[0], atol=1e-9)
    planar = pf.solve_ik(closure.planar_4rpr(), pf.pose([10, -5, 0], rotvec=[0, 0, 0.1]))
    points = [(planar.points[f"R{leg}.1"], planar.points[f"R{leg}.3"]) for leg in (1, 2, 3, 4)]
    along = np.array([(end - start) / np.linalg.norm(end - start) for start, end in points])
    arms = np.array([end for _, end in points]) - planar.pose[:3, 3]
    rows = np.c_[along[:, :2], np.cross(arms, along)[:, 2]]
    found = pf.forces(planar, [10.0, -20.0, 0.0, 0.0, 0.0, 300.0])
    np.testing.assert_allclose(found.actuators, -np.linalg.lstsq(rows.T, [10.0, -20.0, 300.0])[0], atol=1e-9)
    assert "overconstraint" in found.undetermined


def most(normal: Array, jacobian: Array, low: float, high: float) -> float:
    """The largest normal . f of forces f, without a moment, that actuators hold within limits: a linear programme."""
    n = len(jacobian)
    cost, held = np.r_[-normal, np.zeros(n)], np.hstack([np.vstack([np.eye(3), np.zeros((3, 3))]), jacobian.T])
    answer = linprog(cost, A_eq=held, b_eq=np.zeros(6), bounds=[(None, None)] * 3 + [(low, high)] * n)
    assert answer.status == 0
    return -float(answer.fun)


@pytest.mark.parametrize(("name", "low", "high"), [("stewart", -40.0, 90.0), ("cables", -300.0, -10.0)])
def test_what_can_be_held_is_what_linear_programmes_find(name: str, low: float, high: float) -> None:
    rng = np.random.default_rng(3)
    for solution in rows_of(name):
        found, jacobian = pf.wrench_capacity(solution, (low, high)), struts_jacobian(solution)
        vertices = found.vertices
        assert isinstance(vertices, np.ndarray)
        for normal in rng.standard_normal((10, 3)):
            assert (vertices @ normal).max() == pytest.approx(most(normal, jacobian, low, high), rel=1e-7)
        weakest = np.asarray(found.weakest)
        assert found.radius == pytest.approx(most(weakest, jacobian, low, high), rel=1e-7)
        assert all(found.holds(vertices))
        assert not found.holds(1.001 * float(found.radius) * weakest)


def test_capacity_beside_a_load_is_what_is_left_of_it() -> None:
    machine = pf.load("stewart")
    solution, weight = pf.solve_ik(machine, [10, 5, 195]), np.array([0.0, 0.0, -60.0])
    point = solution.pose[:3, 3] + [0.0, 0.0, 50.0]
    limits = {name: (-40.0, 80.0 + place) for place, name in enumerate(machine.actuator_names)}
    for of in ("force", "moment", "wrench"):
        found = pf.wrench_capacity(solution, limits, of=of, wrench=weight, at=point)
        rng, width = np.random.default_rng(0), found.normals.shape[-1]
        for x in rng.standard_normal((200, width)) * (60.0 if of == "force" else 3000.0):
            load = np.r_[weight, np.zeros(3)]
            load[{"force": slice(0, 3), "moment": slice(3, 6), "wrench": slice(0, 6)}[of]] += x
            exerted = pf.forces(solution, load, at=point).actuators
            low, high = np.array(list(limits.values())).T
            assert found.holds(x) == bool(((exerted >= low) & (exerted <= high)).all())
    heavy = pf.wrench_capacity(solution, 20.0, of="moment", wrench=[0, 0, -1000])
    assert float(heavy.radius) < 0.0
    assert len(heavy.vertices) == 0


def test_one_sided_limits_leave_polytopes_open() -> None:
    machine = pf.load("orthoglide")
    found = pf.wrench_capacity(pf.solve_ik(machine, [0, 0, 0]), (-np.inf, 50.0))
    assert found.radius == pytest.approx(50.0)
    np.testing.assert_allclose(found.vertices, [[-50.0, -50.0, -50.0]], atol=1e-9)
    assert pf.wrench_capacity(pf.solve_ik(machine, [0, 0, 0]), np.inf).radius == np.inf


def test_the_orthoglide_has_its_published_factors() -> None:
    """Chablat and Wenger, 2003: between 1/2 and 2 in a cube of 200 mm, 1 where the legs are square to each other."""
    machine, ends = pf.load("orthoglide"), (-126.79491924, 73.20508076)
    cube = np.stack(np.meshgrid(*[np.linspace(*ends, 7)] * 3), axis=-1)
    found = pf.transmission(pf.solve_ik(machine, cube)).translation
    assert found.velocity.shape == (7, 7, 7, 3)
    assert found.velocity.min() == pytest.approx(0.5, abs=1e-6)
    assert found.velocity.max() == pytest.approx(2.0, abs=1e-6)
    np.testing.assert_allclose(found.force, 1.0 / found.velocity)
    here = pf.transmission(pf.solve_ik(machine, [0, 0, 0]))
    np.testing.assert_allclose(here.translation.velocity, 1.0, rtol=1e-9)
    assert here.rotation.velocity.shape == (0,)


def test_what_a_tripod_cannot_do_has_the_factor_0_not_rounding() -> None:
    """Level, it rises and tilts: it moves along z alone, and turns about x and y alone."""
    found = pf.transmission(pf.solve_ik(pf.load("rps"), pf.load("rps").home_pose))
    np.testing.assert_array_equal(found.translation.velocity[1:], 0.0)
    assert found.rotation.velocity[2] == 0.0 and np.isinf(found.rotation.force[2])
    np.testing.assert_allclose(np.abs(found.translation.directions[:, 0]), [0, 0, 1], rtol=0, atol=1e-9)
    np.testing.assert_allclose(np.abs(found.rotation.directions[:, 2]), [0, 0, 1], rtol=0, atol=1e-9)
    assert found.table().rows[0][:4] == ("along", "0", "0", "1")


def test_slack_cables_have_no_stiffness() -> None:
    machine = cables()
    for solution in rows_of("cables"):
        jacobian, forces = struts_jacobian(solution), np.array([-5.0, -5, -5, -5, -5, -5, 1.0, 0.0])
        found = pf.stiffness(solution, 50.0, cables=machine.actuator_names, forces=forces)
        np.testing.assert_allclose(
            found.matrix, stiffness_of_struts(solution, 50.0, np.minimum(forces, 0.0)), rtol=1e-6, atol=1e-3
        )
        whole = pf.stiffness(solution, 50.0)
        np.testing.assert_allclose(whole.matrix, 50.0 * jacobian.T @ jacobian, rtol=1e-7, atol=1e-3)
        forces[:3], forces[3:6] = 2.0, -1e-9
        slack = pf.stiffness(solution, 50.0, cables=machine.actuator_names, forces=forces)
        assert "slack" in str(slack.reason)
        assert np.isnan(slack.compliance).all()
        springs = np.diag(np.where(forces < 0.0, 50.0, 0.0))
        np.testing.assert_allclose(slack.matrix, jacobian.T @ springs @ jacobian, rtol=1e-7, atol=1e-3)


def stiffness_of_struts(solution: pf.Solution, k: float, exerted: Array) -> Array:
    """The wrench by which struts and cables resist, by differences of poses: they exert less as they grow."""
    springs, step = np.where(exerted == 0.0, 0.0, k), 1e-3

    def change(axis: int, way: float) -> Array:
        shift, turn = np.split(way * step * np.eye(6)[axis] * np.repeat([1.0, 1e-3], 3), 2)
        pose = solution.pose.copy()
        pose[:3, 3], pose[:3, :3] = pose[:3, 3] + shift, Rotation.from_rotvec(turn).as_matrix() @ pose[:3, :3]
        moved = pf.solve_ik(solution.mechanism, pose)
        return -struts_jacobian(moved).T @ (exerted - springs * (moved.actuators - solution.actuators))

    columns = [(change(axis, 1.0) - change(axis, -1.0)) / (2 * step) for axis in range(6)]
    return np.array(columns).T * np.repeat([1.0, 1e3], 3)


def test_cables_are_as_stiff_as_differences_of_their_pull_say() -> None:
    """With tensions within limits, under a load with a moment: by which the matrix is not symmetric."""
    machine, load = cables(), np.array([20.0, -10.0, -300.0, 2e4, 1e4, -3e4])
    batch = pf.solve_ik(machine, np.array([solution.pose for solution in rows_of("cables")]))
    held = pf.forces(batch, load, limits=(-900.0, -20.0))
    assert held.is_least_norm and list(held.reason) == ["", ""]
    found = pf.stiffness(batch, 40.0, cables=machine.actuator_names, forces=held)
    for row, solution in enumerate(rows_of("cables")):
        expected, exerted = stiffness_of_struts(solution, 40.0, held.actuators[row]), held.actuators[row]
        np.testing.assert_allclose(found.matrix[row], expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max())
        np.testing.assert_allclose(found.matrix[row] @ found.compliance[row], np.eye(6), atol=1e-7)
        alone = pf.stiffness(solution, 40.0, forces=exerted)
        np.testing.assert_allclose(alone.matrix, found.matrix[row], rtol=1e-7, atol=1e-7 * np.abs(expected).max())
    skew = found.matrix[:, 3:, 3:] - np.swapaxes(found.matrix[:, 3:, 3:], 1, 2)
    np.testing.assert_allclose(skew[:, [2, 0, 1], [1, 2, 0]], np.tile(-load[3:], (2, 1)), rtol=1e-6)


def test_a_platform_on_four_cables_in_a_plane_has_the_second_derivatives_of_its_energy() -> None:
    """E = sum k (l - l0)^2 / 2 of cables between fixed points and those of a platform that turns, in closed form."""
    machine = closure.planar_4rpr().without_limits()
    solution, k = pf.solve_ik(machine, pf.pose([10, -5, 0], rotvec=[0, 0, 0.1])), 30.0
    tensions = -pf.forces(solution, [5.0, -8.0, 0, 0, 0, 40.0], limits=(-500.0, -30.0)).actuators
    expected, turned = np.zeros((3, 3)), np.array([[0.0, -1.0], [1.0, 0.0]])
    for leg, tension in enumerate(tensions, 1):
        start, end = (solution.points[f"R{leg}.{place}"][:2] for place in (1, 3))
        arm, length = end - solution.pose[:2, 3], np.linalg.norm(end - start)
        along, motion = (end - start) / length, np.c_[np.eye(2), turned @ arm]
        across = motion.T @ (np.eye(2) - np.outer(along, along)) @ motion / length
        across[2, 2] -= along @ arm
        expected += k * np.outer(motion.T @ along, motion.T @ along) + tension * across
    found = pf.stiffness(solution, k, cables=machine.actuator_names, forces=-tensions)
    shown = [0, 1, 5]
    np.testing.assert_allclose(found.matrix[np.ix_(shown, shown)], expected, rtol=1e-8, atol=1e-6)
    assert (found.reason, found.rigid) == ("", 3)


@pytest.mark.parametrize(
    "name", named("stewart", "delta", "tricept", "rps", "five_bar", "g1_ankle", "canfield", "panda")
)
def test_what_a_load_adds_to_stiffness_is_what_differences_of_forces_say(name: str) -> None:
    """With weights on every body: actuators exert t(q) - k (q - q0) against what they need, which changes too."""
    machine, rng = pf.load(name).without_limits(), np.random.default_rng(1)
    length, n_a = machine.characteristic_length, len(machine.actuator_names)
    loads = {body: (1.0, rng.uniform(-1, 1, 3) * length) for body in machine.bodies if body != machine.base}
    if name == "stewart":
        loads = {"platform": (rng.uniform(-5, 5, 6), rng.uniform(-1, 1, 3) * length)}
    for solution in reached_at_random(pf.load(name), 2, rng):
        wrench = np.r_[rng.uniform(-20, 20, 3), rng.uniform(-5, 5, 3) * length]
        wrench = wrench[:3] if machine.end_effector_is_joint else wrench
        kinds = np.array([machine.joint(drive).type == "revolute" for drive in machine.actuator_names])
        units, step = np.where(kinds, 1.0, length), 1e-5
        k = 500.0 * length / units**2
        shifts = np.concatenate([way * step * np.diag(units) for way in (1.0, -1.0)])
        here = pf.solve_fk(machine, solution.actuators + np.vstack([np.zeros(n_a), shifts]), start=solution.q)
        held = pf.forces(here, wrench, loads=loads)
        change = (held.actuators[1 : n_a + 1] - held.actuators[n_a + 1 :]) / (2 * step * units[:, None])
        forward = pf.forward_jacobian(here[0])
        expected = forward @ np.linalg.solve(np.diag(k) + change.T, forward.T)
        found = pf.stiffness(here[0], k, forces=pf.forces(here[0], wrench, loads=loads))
        assert found.reason == ""
        np.testing.assert_allclose(found.compliance, expected, atol=2e-7 * np.abs(expected).max())
        assert np.abs(expected - forward @ np.diag(1 / k) @ forward.T).max() > 1e-4 * np.abs(expected).max()


def test_a_load_that_tips_and_cables_that_would_push_are_said() -> None:
    solution = rows_of("stewart")[0]
    heavy = pf.stiffness(solution, 1.0, forces=pf.forces(solution, [0, 0, -1e5]))
    assert "not stable" in str(heavy.reason) and np.isnan(heavy.compliance).all()
    assert np.linalg.eigvalsh(heavy.matrix + heavy.matrix.T)[0] < 0.0
    machine, hung = cables(), rows_of("cables")[0]
    pushed = pf.forces(hung, [0, 0, 2000.0, 0, 0, 0])
    pushing = [name for name, force in zip(machine.actuator_names, pushed.actuators, strict=True) if force > 0.0]
    loose = pf.stiffness(hung, 40.0, cables=machine.actuator_names, forces=pushed)
    assert pushing and all(name in str(loose.reason) for name in pushing) and np.isnan(loose.matrix).all()
    low, high = [-900.0, -20.0]
    beyond = str(pf.forces(hung, [0, 0, 0, 0, 0, 1e6], limits=(low, high)).reason)
    assert "would push" in beyond and any(name in beyond for name in machine.actuator_names)
    elsewhere = pf.forces(rows_of("cables")[1], [0, 0, -5.0])
    with pytest.raises(InvalidArgument, match="forces of other configurations"):
        pf.stiffness(hung, 40.0, forces=elsewhere)
    with pytest.raises(InvalidArgument, match="infinite"):
        pf.stiffness(hung, 40.0, forces=np.where(pushed.actuators > 0.0, np.inf, pushed.actuators))


@pytest.mark.parametrize("name", ["stewart", "delta", "five_bar"])
def test_actuators_beyond_their_limits_are_named_with_how_far(name: str) -> None:
    for solution in rows_of(name):
        loads = {"platform": (5.0, solution.mechanism.reference_point)} if name != "five_bar" else None
        wrench = WRENCH[: 3 if solution.mechanism.end_effector_is_joint else 6]
        needed = pf.forces(solution, wrench, loads=loads).actuators
        names, most = solution.mechanism.actuator_names, 0.5 * float(np.abs(needed).max())
        held = pf.forces(solution, wrench, loads=loads, limits=(-most, 0.2 * most))
        expected = {}
        for actuator, force in zip(names, needed, strict=True):
            if force > 0.2 * most or force < -most:
                bound = 0.2 * most if force > 0.0 else -most
                expected[actuator] = f"{force:.5g}, {abs(force - bound):.5g} {'above' if force > 0.0 else 'below'}"
        named = str(held.reason).partition("hold the load: ")[2].split("; ")
        assert named == [f"{actuator} would exert {words} its limit" for actuator, words in expected.items()]
        assert expected and np.isnan(held.actuators).all()
        within = pf.forces(solution, wrench, loads=loads, limits=2.5 * most)
        np.testing.assert_allclose(within.actuators, needed, rtol=1e-7)


def test_rods_that_stretch_are_as_soft_as_slides_in_them() -> None:
    """The same machine with a spring in each rod, as a twelfth actuator, has stiffness from actuators alone."""
    base = np.array(ring(150.0, 0.0, (6, 115, 126, 235, 246, 355)))
    top = np.array(ring(70.0, 200.0, (46, 74, 166, 195, 286, 315)))
    via = base + [30.0, -10.0, 60.0] + 0.5 * (top - base) * [1, 1, 0]
    made = {"base": base, "platform": top, "via": via, "axis": [0.2, 1.0, 0.1], "reference_point": (0, 0, 200)}
    rigid, sprung = (pf.Mechanism.from_legs(chain, **made) for chain in ("R*-U-S", "R*-U-P*-S"))
    here, same = (pf.solve_ik(machine, machine.home_pose) for machine in (rigid, sprung))
    k = {name: 300.0 if sprung.joint(name).type == "prismatic" else 4e4 for name in sprung.actuator_names}
    expected, found = pf.stiffness(same, k), pf.stiffness(here, 4e4, rods=300.0)
    np.testing.assert_allclose(found.compliance, expected.compliance, atol=1e-9 * np.abs(expected.compliance).max())
    assert np.abs(pf.stiffness(here, 4e4).matrix).max() > 1.1 * np.abs(found.matrix).max()


def test_rods_of_an_overconstrained_machine_share_what_equilibrium_does_not_tell() -> None:
    orthoglide = pf.load("orthoglide")
    found = pf.stiffness(pf.solve_ik(orthoglide, [[0, 0, 0], [5, 0, 0]]), 5.0, rods=5.0)
    assert all("does not determine" in reason for reason in found.reason)
    assert np.isnan(found.matrix).all()
    flat = pf.stiffness(pf.solve_ik(pf.load("five_bar"), [0, 0, 190]), 5e5, rods=20.0)
    assert (flat.reason, flat.rigid) == ("", 1)


def test_the_worst_error_is_that_of_forward_kinematics_at_the_worst_corner() -> None:
    machine = pf.load("stewart").without_limits()
    errors = dict(zip(machine.actuator_names, [2e-4, 1e-4, 3e-4, 1e-4, 2e-4, 4e-4], strict=True))
    bounds = np.array(list(errors.values()))
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=6))) * bounds
    for row in rows_of("stewart"):
        solution = pf.solve_ik(machine, row.pose)
        found = pf.accuracy(solution, errors)
        exact = pf.solve_fk(machine, solution.actuators + corners, start=solution.q)
        shifts = np.linalg.norm(exact.pose[:, :3, 3] - solution.pose[:3, 3], axis=1)
        turns = Rotation.from_matrix(exact.pose[:, :3, :3] @ solution.pose[:3, :3].T).magnitude()
        assert shifts.max() == pytest.approx(found.position, rel=1e-4)
        assert turns.max() == pytest.approx(found.rotation, rel=1e-4)
        assert found.actuators is not None
        for pattern, sizes in zip(found.actuators, (shifts, turns), strict=True):
            row = np.argmin(np.abs(corners - pattern).sum(axis=1))
            assert sizes[row] == pytest.approx(sizes.max(), rel=1e-4)
        chance = pf.accuracy(solution, errors, "rms")
        inverse = np.linalg.inv(struts_jacobian(solution)) * bounds
        np.testing.assert_allclose(chance.covariance, inverse @ inverse.T, rtol=1e-9, atol=1e-18)
        assert chance.position == pytest.approx(np.sqrt((inverse[:3] ** 2).sum()))
        assert float(chance.position) < float(found.position)


def with_slides(machine: pf.Mechanism, name: str, side: int, axes: Array) -> pf.Mechanism:
    """The machine with driven slides between one body of a joint and the joint: how far its centre is off."""
    joints: list[pf.Joint] = []
    for joint in machine.joints:
        if joint.name != name:
            joints.append(joint)
            continue
        bodies = [joint.connects[side], *(f"off{place}" for place in range(len(axes)))]
        joints += [
            pf.Joint(f"slide{place}", "prismatic", pair, axis=axis, actuated=True)
            for place, (pair, axis) in enumerate(zip(itertools.pairwise(bodies), axes, strict=True))
        ]
        ends = (bodies[-1], joint.connects[1]) if side == 0 else (joint.connects[0], bodies[-1])
        joints.append(dataclasses.replace(joint, connects=ends))
    point = None if machine.end_effector_is_joint else machine.reference_point
    return pf.Mechanism(machine.name, joints, machine.end_effector, point, task=machine.task)


@pytest.mark.parametrize(
    ("name", "joint", "side"),
    [
        ("stewart", "AR2", 0),
        ("stewart", "CL3", 1),
        pytest.param("delta", "BL1", 0, marks=pytest.mark.compiled),
        ("five_bar", "p2", 0),
    ],
)
def test_play_of_a_joint_moves_the_machine_as_far_as_slides_in_it_do(name: str, joint: str, side: int) -> None:
    machine, play = pf.load(name).without_limits(), 1e-3
    axes = np.eye(3)[1:] if name == "five_bar" else np.eye(3)
    moving = with_slides(machine, joint, side, axes)
    found = pf.accuracy(pf.solve_ik(machine, machine.home_pose), {joint: play})
    ways = np.random.default_rng(0).standard_normal((400, len(axes)))
    ways *= play / np.linalg.norm(ways, axis=1, keepdims=True)
    home = {drive.name: np.full(len(ways), drive.home) for drive in machine.drives}
    moved = pf.solve_fk(moving, home | {f"slide{place}": way for place, way in enumerate(ways.T)})
    assert moved
    shifts = np.linalg.norm(moved.pose[:, :3, 3] - machine.reference_point, axis=1)
    assert 0.98 * float(found.position) <= shifts.max() <= 1.001 * float(found.position)
    if name == "five_bar":  # across its plane the loops hold it, however much play there is
        assert np.asarray(found.components)[0] == pytest.approx(0.0, abs=1e-15)
    both = pf.accuracy(pf.solve_ik(machine, machine.home_pose), {joint: play, machine.actuator_names[0]: 1e-3})
    alone = pf.accuracy(pf.solve_ik(machine, machine.home_pose), {machine.actuator_names[0]: 1e-3})
    assert max(found.position, alone.position) < float(both.position) <= found.position + alone.position + 1e-15


def test_the_worst_of_many_actuators_is_at_a_corner() -> None:
    """Of a chain with sixty hinges in a plane, all errors of one sign turn it most."""
    snake = pf.load("snake60")
    here = pf.solve_ik(snake, snake.home_pose)
    found = pf.accuracy(here, 1e-3)
    forward = pf.forward_jacobian(here)
    assert found.actuators is not None
    assert np.linalg.norm(forward[:3] @ found.actuators[0]) == pytest.approx(found.position)
    for pattern in np.random.default_rng(0).choice([-1e-3, 1e-3], (500, 60)):
        assert np.linalg.norm(forward[:3] @ pattern) <= found.position


OF_A_DELTA = {
    "forces": lambda s: pf.forces(s, WRENCH).actuators,
    "reactions": lambda s: pf.forces(s, WRENCH).reactions["BL1"],
    "capacity": lambda s: pf.wrench_capacity(s, 500.0).radius,
    "transmission": lambda s: pf.transmission(s).translation.velocity,
    "rates": lambda s: pf.transmission(s, "BL1").rates,
    "stiffness": lambda s: pf.stiffness(s, 1e5, rods=400.0).matrix,
    "worst error": lambda s: pf.accuracy(s, {"A1": 1e-3, "BL2": 0.1}).position,
    "usual error": lambda s: pf.accuracy(s, 1e-3, "rms").components,
}


@pytest.mark.compiled
@pytest.mark.parametrize("of", OF_A_DELTA)
def test_answers_of_batches_are_those_of_their_rows(of: str) -> None:
    machine, ask = pf.load("delta"), OF_A_DELTA[of]
    targets = np.random.default_rng(0).uniform([-20, -20, -120], [20, 20, -90], (2, 3, 3))
    targets[1, 2] = np.nan
    batch = pf.solve_ik(machine, targets, options=pf.Options(on_invalid="mark"))
    together = ask(batch)
    assert np.shape(together)[:2] == (2, 3) and np.isnan(together[1, 2]).all()
    np.testing.assert_allclose(together[1, 0], ask(batch[1, 0]), rtol=1e-9, atol=1e-9)
    none = ask(pf.solve_ik(machine, np.zeros((0, 3))))
    assert np.shape(none) == (0, *np.shape(together)[2:])


def test_a_row_without_a_configuration_says_so_and_wrenches_go_together_with_points() -> None:
    machine = pf.load("stewart")
    batch = pf.solve_ik(machine, [[0, 0, 190], [np.nan] * 3], options=pf.Options(on_invalid="mark"))
    answers = pf.forces(batch, WRENCH), pf.wrench_capacity(batch, 500.0), pf.transmission(batch), pf.stiffness(batch, 1)
    for answer in (*answers, pf.accuracy(batch, 1.0)):
        assert answer.reason.tolist() == ["", "the row is INVALID: it has no configuration"]
    assert len(answers[1].vertices) == 2
    wrenches = np.random.default_rng(0).standard_normal((4, 1, 6))
    found = pf.forces(batch[0], wrenches, at=np.zeros((5, 3)))
    assert found.actuators.shape == (4, 5, 6) and found.reactions["AL1"].shape == (4, 5, 6)
    alone = pf.forces(batch[0], wrenches[2, 0], at=np.zeros(3))
    np.testing.assert_allclose(found.actuators[2, 3], alone.actuators)


def test_too_few_actuators_and_parts_that_nothing_holds_are_said() -> None:
    rods = pf.load("linear_delta")
    here = pf.solve_ik(rods, rods.home_pose)
    spun = pf.forces(here, [0, 0, -5], loads={"rodL1": ([0.0, 0, 0, 50, 60, 70], rods.joint("BL1").at)})
    assert "neither the end effector nor an actuator holds" in str(spun.reason)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pf.errors.MobilityWarning)
        joints = [dataclasses.replace(j, actuated=False) if j.name == "A1" else j for j in pf.load("delta").joints]
        loose = pf.Mechanism("loose", joints, "platform", pf.load("delta").reference_point, task=("x", "y", "z"))
    answer = pf.forces(pf.solve_ik(loose, loose.home_pose), [0, 0, -5.0])
    assert "keeps 1 freedom" in str(answer.reason)


def at_home(machine: pf.Mechanism) -> pf.Solution:
    return pf.solve_ik(machine, machine.home_pose)


WRONG = {
    "solution: found Mechanism": lambda m, s: pf.forces(m, [0, 0, 1]),
    "wrench: found shape (4,)": lambda m, s: pf.forces(s, [0, 0, 1, 2]),
    "wrench: found a number that is not finite": lambda m, s: pf.forces(s, [0, 0, np.nan]),
    "wrench: found str of dtype": lambda m, s: pf.forces(s, "down"),
    "wrench: found a batch of (2,)": lambda m, s: pf.forces(pf.solve_ik(m, [[0, 0, 190]] * 3), [[0, 0, 1]] * 2),
    "at: found shape (2,)": lambda m, s: pf.forces(s, [0, 0, 1], at=[0, 0]),
    "no body that moves named 'base'": lambda m, s: pf.forces(s, loads={"base": (1.0, [0, 0, 0])}),
    "did you mean 'platform'": lambda m, s: pf.forces(s, loads={"platfrom": (1.0, [0, 0, 0])}),
    "loads['platform']: found a mass of -1.0": lambda m, s: pf.forces(s, loads={"platform": (-1.0, [0, 0, 0])}),
    "loads['platform']: found 5": lambda m, s: pf.forces(s, loads={"platform": 5}),
    "loads['platform'][1]: found shape (2,)": lambda m, s: pf.forces(s, loads={"platform": (5, [0, 0])}),
    "gravity: found shape ()": lambda m, s: pf.forces(s, [0, 0, 1], gravity=9.81),
    "limits: found -5": lambda m, s: pf.wrench_capacity(s, -5.0),
    "limits: found [5.0, 1.0]; expected a positive number": lambda m, s: pf.wrench_capacity(s, (5.0, 1.0)),
    "limits: found no value of BL2, BL3, BR1, BR2, BR3": lambda m, s: pf.wrench_capacity(s, {"BL1": 5.0}),
    "no actuator named 'X1'": lambda m, s: pf.wrench_capacity(s, {"X1": 5.0}),
    "of: found 'torque'": lambda m, s: pf.wrench_capacity(s, 5.0, of="torque"),
    "of: found 'wrench'": lambda m, s: pf.wrench_capacity(s, 5.0, of="wrench").vertices,
    "load: found shape (2,)": lambda m, s: pf.wrench_capacity(s, 5.0).holds([1.0, 2.0]),
    "no joint named 'Z9'": lambda m, s: pf.transmission(s, "Z9"),
    "k: found shape (2,)": lambda m, s: pf.stiffness(s, [1.0, 2.0]),
    "k: found [0.0, 1.0": lambda m, s: pf.stiffness(s, [0.0, 1, 1, 1, 1, 1]),
    "rods: found a stiffness": lambda m, s: pf.stiffness(s, 1.0, rods=5.0),
    "forces: found None": lambda m, s: pf.stiffness(s, 1.0, cables=["BL1"]),
    "cables: found 'B1'": lambda m, s: pf.stiffness(s, 1.0, cables="B1"),
    "errors: found -0.1": lambda m, s: pf.accuracy(s, -0.1),
    "errors['BL1']: found 0": lambda m, s: pf.accuracy(s, {"BL1": 0}),
    "no actuator or joint named 'D1'": lambda m, s: pf.accuracy(s, {"D1": 1.0}),
    "kind: found 'mean'": lambda m, s: pf.accuracy(s, 1.0, "mean"),
    "more actuators than motions": lambda m, s: pf.accuracy(at_home(closure.planar_4rpr()), {"R1.1": 0.1}),
    "the end effector is a joint": lambda m, s: pf.forces(at_home(pf.load("five_bar")), np.zeros(6)),
    "act on the centre of p3": lambda m, s: pf.forces(at_home(pf.load("five_bar")), np.zeros(3), at=[0, 0, 0]),
}


@pytest.mark.parametrize("sentence", WRONG)
def test_a_wrong_call_says_so_in_one_sentence(sentence: str) -> None:
    machine = pf.load("stewart")
    with pytest.raises((InvalidArgument, UnknownName, UnsupportedMechanism)) as caught:
        WRONG[sentence](machine, pf.solve_ik(machine, [0, 0, 190]))
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


def suspended() -> pf.Mechanism:
    """A platform on eight cables, two more than it has freedoms."""
    corners = np.array([(x, y, z) for z in (0, 1) for x in (-1, 1) for y in (-1, 1)], float)
    base = corners * [500, 400, 600]
    platform = [0, 0, 260] + corners * [60, 60, -80] * np.where(corners[:, 2:] > 0, [1, -1, 1], 1) + [0, 0, 80]
    return pf.Mechanism.from_legs("U-P*-S", base=base, platform=platform, reference_point=(0, 0, 300), name="cables")


def test_cables_share_a_load_within_their_limits_nearest_to_the_middle() -> None:
    machine, load = suspended(), [10.0, -5.0, -80.0, 300.0, 0.0, 500.0]
    solutions = pf.solve_ik(machine, pf.pose([[0, 0, 300], [30, -20, 310]], rotvec=[[0, 0, 0], [0, 0, 0.05]]))
    least, low, high = pf.forces(solutions, load), -99.0, -40.0
    assert least.actuators.max() > 0.0  # some would push
    found = pf.forces(solutions, load, limits=(low, high))
    assert list(found.reason) == ["", ""]
    for solution, pulls, margin, binding in zip(solutions, found.actuators, found.margin, found.binding, strict=True):
        assert low * (1 + 1e-8) <= pulls.min() and pulls.max() <= high * (1 - 1e-8)
        jacobian = pf.inverse_jacobian(solution)
        np.testing.assert_allclose(jacobian.T @ pulls, -np.array(load), atol=1e-6 * 500)
        is_free = (pulls > low + 1e-5) & (pulls < high - 1e-5)
        away = pulls - 0.5 * (low + high)
        scaled = jacobian / [1, 1, 1, 300, 300, 300]
        against = away - scaled @ np.linalg.lstsq(scaled[is_free], away[is_free], rcond=1e-9)[0]
        np.testing.assert_allclose(against[is_free], 0.0, atol=1e-4)  # the conditions of the nearest point
        assert (against[pulls <= low + 1e-5] >= -1e-4).all() and (against[pulls >= high - 1e-5] <= 1e-4).all()
        room = np.minimum(pulls - low, high - pulls)
        assert margin == pytest.approx(room.min(), abs=1e-9)
        assert binding.split()[0] == machine.actuator_names[int(room.argmin())]
    ends = [found.reactions[joint.name] for joint in machine.joints if joint.type == "spherical"]
    np.testing.assert_allclose(np.sum(ends, axis=0)[:, :3], np.tile(np.multiply(load[:3], -1.0), (2, 1)), atol=1e-6)


def test_a_load_that_no_forces_within_limits_hold_has_a_reason() -> None:
    machine = suspended()
    home = pf.solve_ik(machine, machine.home_pose)
    assert "within their limits" in str(pf.forces(home, [0, 0, -5000, 0, 0, 0], limits=(-90, -5)).reason)
    stewart = pf.solve_ik(pf.load("stewart"), pf.load("stewart").home_pose)
    held = pf.forces(stewart, [0, 0, -60, 0, 0, 0], limits=20.0)
    np.testing.assert_allclose(held.actuators, pf.forces(stewart, [0, 0, -60, 0, 0, 0]).actuators)
    assert "of B" in str(held.table()) and held.margin == pytest.approx(20.0 - held.actuators.max())
    assert "within their limits" in str(pf.forces(stewart, [0, 0, -60, 0, 0, 0], limits=9.0).reason)
