"""The routines that kernels are made of, one by one, against NumPy, SciPy, brute force and finite differences.

They are plain Python here, whichever code the kernels are: a translation is compared with its source elsewhere.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import pfabrik as pf
from machines import MACHINES
from machines.trunks import TRUNKS
from pfabrik.kernels import quaternions
from pfabrik.kernels.legs.complete_poses import ROUNDED, orthonormalise, turn_pose
from pfabrik.kernels.passes import half_spaces
from pfabrik.kernels.passes import plan as P
from pfabrik.kernels.passes.passes import reach_backward
from pfabrik.kernels.passes.plan import move_carriers, place_ends
from pfabrik.kernels.passes.restrict import clamp_cone
from pfabrik.kernels.vectors import angle_between, wrap
from pfabrik.passes.plan import CompiledPlan, compile_plan

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")


def triple(v: Any) -> tuple[float, float, float]:
    x, y, z = (float(each) for each in v)
    return x, y, z


def unit(v: Any) -> np.ndarray:
    return np.asarray(v, float) / np.linalg.norm(v)


def directions(rng: np.random.Generator, n: int) -> np.ndarray:
    v = rng.normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1)[:, None]


# --- vectors and angles ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("half_angle", [0.01, 1.2, 1.5, 2.5])
def test_clamp_cone_gives_the_nearest_vector_in_the_cone(half_angle: float) -> None:
    """No vector of the cone comes nearer; only where the nearest would be none at all, a thousandth is kept."""
    rng = np.random.default_rng(1)
    for axis, d in zip(directions(rng, 30), rng.normal(size=(30, 3)), strict=True):
        clamped = np.array(clamp_cone(triple(axis), half_angle, triple(d), False))
        size = np.linalg.norm(d)
        assert np.arctan2(np.linalg.norm(np.cross(axis, clamped)), axis @ clamped) <= half_angle + 1e-12
        if np.arccos(axis @ unit(d)) < half_angle - 1e-12:
            assert clamped.tolist() == d.tolist()
        across = np.cross(axis, directions(rng, 1000))
        across /= np.linalg.norm(across, axis=1)[:, None]
        angle = np.where(rng.random(1000) < 0.5, half_angle, rng.uniform(0, half_angle, 1000))[:, None]
        rays = np.cos(angle) * axis + np.sin(angle) * across
        samples = np.maximum(rays @ d, 0)[:, None] * rays
        nearest = np.linalg.norm(samples - d, axis=1).min()
        allowed = 1e-12 if np.linalg.norm(clamped) > 1.1e-3 * size else 2e-3 * size
        assert np.linalg.norm(clamped - d) <= nearest + allowed
        assert np.linalg.norm(clamped) >= 0.999e-3 * size


def test_clamp_cone_finds_a_direction_opposite_to_its_axis() -> None:
    for axis in np.vstack([np.eye(3), -np.eye(3), directions(np.random.default_rng(3), 10)]):
        clamped = np.array(clamp_cone(triple(axis), 0.5, triple(-3.0 * axis), False))
        assert unit(clamped) @ axis == pytest.approx(np.cos(0.5), abs=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-15, 1e-12, 1e-8, 1e-3, 1.0, np.pi / 2])
def test_angles_are_exact_near_zero_and_near_half_a_turn(angle: float) -> None:
    turned = (2.0 * np.cos(angle), 2.0 * np.sin(angle), 0.0)
    assert angle_between((5.0, 0.0, 0.0), turned) == pytest.approx(angle, rel=1e-15, abs=0)
    supplement = np.pi - angle_between((-5.0, 0.0, 0.0), turned)
    assert supplement == pytest.approx(angle, rel=1e-15, abs=5e-16)


def test_wrapped_angles_are_within_half_a_turn_of_their_centre() -> None:
    for angle in np.linspace(-20, 20, 101):
        for centre in (0.0, 1.0, -4.0, 10.0):
            candidates = angle + 2 * np.pi * np.arange(-10, 11)
            nearest = candidates[np.abs(candidates - centre).argmin()]
            assert wrap(float(angle), centre) == pytest.approx(nearest, abs=1e-13)


# --- rotations -------------------------------------------------------------------------------------------------------

SMALL = [0.0, 1e-14, 1e-10, 1e-7, 1e-6, 0.9e-4, 1.1e-4, 1e-3]


def rotations_apart(angle: float, rng: np.random.Generator) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Axes, and the differences of two poses that are an angle about them apart."""
    for axis in np.vstack([np.eye(3), directions(rng, 20)]):
        first, second, w = np.eye(4), np.eye(4), np.empty(3)
        first[:3, :3] = Rotation.random(rng=rng).as_matrix()
        second[:3, :3] = Rotation.from_rotvec(angle * axis).as_matrix() @ first[:3, :3]
        quaternions.difference(second, first, w)
        yield axis, w


@pytest.mark.parametrize("angle", [*SMALL, 1.0, 2.0, 3.0, *(np.pi - small for small in SMALL[2:])])
def test_the_difference_of_rotations_is_the_rotation_vector_between(angle: float) -> None:
    """Near half a turn the axis is as exact as the matrix allows."""
    for axis, w in rotations_apart(angle, np.random.default_rng(4)):
        np.testing.assert_allclose(w, angle * axis, rtol=0, atol=1e-11)


def test_half_a_turn_has_two_rotation_vectors() -> None:
    for axis, w in rotations_apart(np.pi, np.random.default_rng(5)):
        np.testing.assert_allclose(w * np.sign(w @ axis), np.pi * axis, rtol=0, atol=1e-7)


def test_differences_of_yaw_are_within_half_a_turn() -> None:
    for first, second in [(170.0, -170.0), (-170.0, 170.0), (10.0, -10.0), (179.0, -1.5)]:
        A, B = (Rotation.from_euler("z", angle, degrees=True).as_matrix() for angle in (first, second))
        expected = np.degrees(Rotation.from_matrix(A @ B.T).as_rotvec()[2])
        assert np.degrees(quaternions.yaw_difference(A, B)) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("angle", [*SMALL, 1.0, 3.0, 7.0])
def test_turn_pose_is_the_rotation_from_the_left(angle: float) -> None:
    rng = np.random.default_rng(6)
    for axis in directions(rng, 20):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = Rotation.random(rng=rng).as_matrix(), (1, 2, 3)
        expected = Rotation.from_rotvec(angle * axis).as_matrix() @ T[:3, :3]
        turn_pose(T, triple(angle * axis))
        orthonormalise(T)
        np.testing.assert_allclose(T[:3, :3], expected, rtol=0, atol=4e-15)
        np.testing.assert_allclose(T[:3, :3].T @ T[:3, :3], np.eye(3), rtol=0, atol=ROUNDED)
        np.testing.assert_array_equal(T[:3, 3], (1, 2, 3))


def test_a_pose_turned_many_times_stays_a_rotation() -> None:
    T = np.eye(4)
    for _ in range(1000):
        turn_pose(T, (0.3, -0.2, 0.1))
        orthonormalise(T)
    np.testing.assert_allclose(T[:3, :3], Rotation.from_rotvec([300, -200, 100]).as_matrix(), rtol=0, atol=1e-11)
    np.testing.assert_allclose(T[:3, :3].T @ T[:3, :3], np.eye(3), rtol=0, atol=ROUNDED)


# --- passes ----------------------------------------------------------------------------------------------------------


def at_home(compiled: CompiledPlan) -> Any:
    """A configuration at home."""
    now = P.new_configuration(compiled.plan)
    now.pose[:] = compiled.home_seed.poses[0]
    now.nodes[:] = compiled.plan.nodes["home"]
    move_carriers(compiled.plan, now)
    return now


def disturb(compiled: CompiledPlan, now: Any, rng: np.random.Generator, share: float) -> None:
    """Move everything by up to a share of L; first and last nodes stay where carrier, rail and platform have them."""
    plan = compiled.plan
    now.nodes[:] += share * plan.length * rng.uniform(-1, 1, now.nodes.shape)
    now.pose[:3, 3] += share * plan.length * rng.uniform(-1, 1, 3)
    now.pose[:3, :3] = Rotation.from_rotvec(share * rng.uniform(-1, 1, 3)).as_matrix()
    now.trunks[:] += share * rng.uniform(-1, 1, now.trunks.shape) * plan.trunk_joints["unit"]
    for branch in plan.branches[plan.branches["rail"] != 0]:
        home = plan.nodes[branch["first"]]["home"]
        now.nodes[branch["first"]] = home + share * plan.length * rng.uniform(-3, 3) * branch["rail_axis"]
    move_carriers(plan, now)
    for c in range(plan.chains.shape[0]):
        place_ends(plan, c, now)


@pytest.mark.parametrize("share", [0.05, 0.5, 3.0])
@pytest.mark.parametrize("name", ["stewart", "nrpm", "hexaglide", "tripod_rps", "tripod_prs", "planar_prr"])
def test_a_pass_outward_starts_at_the_base_and_keeps_lengths_planes_rails_and_ranges(name: str, share: float) -> None:
    machine = MACHINES[name]() if name in MACHINES else pf.load(name)
    if name == "tripod_rps":  # a platform's cone may contradict the hinge's plane
        machine = machine.with_limits(C1=None, C2=None, C3=None)
    compiled = compile_plan(machine)
    plan, now = compiled.plan, at_home(compiled)
    exact = 1e-12 * plan.length
    disturb(compiled, now, np.random.default_rng(10), share)
    for b, branch in enumerate(plan.branches):
        reach_backward(plan, b, now)
        first, last, carrier = branch["first"], branch["last"], now.carriers[branch["carrier"]]
        base = carrier[:, :3] @ plan.nodes[first]["home"] + carrier[:, 3]
        slide = branch["rail_axis"] @ (now.nodes[first] - base)
        np.testing.assert_allclose(now.nodes[first], base + slide * branch["rail_axis"], atol=exact)
        if branch["rail"]:
            assert branch["rail_lo"] - exact <= slide <= branch["rail_hi"] + exact
        else:
            assert slide == 0
        lengths = np.linalg.norm(np.diff(now.nodes[first : last + 1], axis=0), axis=1)
        assert (lengths >= plan.nodes["lo"][first + 1 : last + 1] - exact).all()
        assert (lengths <= plan.nodes["hi"][first + 1 : last + 1] + exact).all()
        if not len(plan.trunks):  # nodes that hinges on the base carry stay in the plane of their branch
            n_planar = min(branch["planar"], last - first) + 1
            off_plane = (now.nodes[first : first + n_planar] - plan.nodes[first]["home"]) @ branch["normal"]
            assert np.abs(off_plane).max() <= exact


# --- half-spaces -----------------------------------------------------------------------------------------------------


def half_spaces_of(plan, b, now, settings, column, window):
    spaces = half_spaces.new_half_spaces(plan)
    programme = spaces.programme[0]
    programme["window"], programme["trunk_scale"], programme["lever"] = window, 1.0, settings.lever
    half_spaces.begin_programme(spaces, half_spaces.PLATFORM + plan.trunk_joints.shape[0], column, settings.free)
    half_spaces.add_branch(plan, b, now, settings, spaces)
    k = programme["n_rows"]
    return spaces.problem.G[:k, :-1].copy(), spaces.problem.h[:k].copy()


def least_step(plan, rows, h, equations=()):
    spaces = half_spaces.new_half_spaces(plan)
    k, n = rows.shape
    half_spaces.begin_programme(spaces, n, 0, 0)
    for i in range(k):
        spaces.problem.G[i, :n] = rows[i]
        half_spaces.keep_row(spaces, h[i], i in equations)
    half_spaces.least_step(spaces)
    return spaces.x[:n].copy()


@pytest.mark.parametrize("name", ["nrpm", "trunk with struts"])
def test_half_spaces_are_the_slopes_of_what_limits_are_exceeded_by(name: str) -> None:
    """By central differences, in the joints of the trunk and in the platform's translation and turn."""
    compiled = compile_plan(pf.load("nrpm") if name == "nrpm" else TRUNKS[name]())
    plan, rng, step = compiled.plan, np.random.default_rng(17), 1e-6
    length, column, lever = plan.length, half_spaces.PLATFORM, 0.7 * plan.length
    settings = P.Settings(1e-9 * length, 10, 0, P.TRANSLATES + P.TURNS, 0, lever, 1)
    now = at_home(compiled)
    disturb(compiled, now, rng, 0.1)
    pose, trunks = now.pose.copy(), now.trunks.copy()

    def asked(b: int, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        now.pose[:] = pose
        now.pose[:3, 3] += length * x[:3]
        now.pose[:3, :3] = Rotation.from_rotvec(x[3:6] * length / lever).as_matrix() @ pose[:3, :3]
        now.trunks[:] = trunks + x[6:] * plan.trunk_joints["unit"]
        move_carriers(plan, now)
        return half_spaces_of(plan, b, now, settings, column, 1e9 * length)

    for b in range(min(len(plan.branches), 3)):
        n = column + len(plan.trunk_joints)
        rows, _ = asked(b, np.zeros(n))
        assert len(rows) >= 4
        for j in range(n):
            x = step * np.eye(n)[j]
            (_, more), (_, less) = asked(b, x), asked(b, -x)
            np.testing.assert_allclose(rows[:, j], (more - less) / (2 * step), atol=1e-6)


def test_the_least_step_is_that_of_a_general_optimiser() -> None:
    """Half-spaces and equations that do not contradict: to the millionth that a slack costs."""
    plan, rng = compile_plan(TRUNKS["trunk with struts"]()).plan, np.random.default_rng(18)
    for _ in range(20):
        rows, inside = rng.normal(size=(7, 4)), rng.normal(size=4)
        h = -rows @ inside - np.where(np.arange(7) == 2, 0.0, rng.uniform(0, 1, 7))
        found = minimize(
            lambda x: x @ x,
            inside,
            constraints=[
                {"type": "ineq", "fun": lambda x, rows=rows, h=h: -(np.delete(rows, 2, 0) @ x + np.delete(h, 2))},
                {"type": "eq", "fun": lambda x, rows=rows, h=h: rows[2:3] @ x + h[2:3]},
            ],
            method="SLSQP",
            options={"ftol": 1e-14, "maxiter": 200},
        )
        twice = np.concatenate([rows, rows[2:3]]), np.append(h, h[2]), (2, 7)  # one equation implies the other
        np.testing.assert_allclose(least_step(plan, *twice), found.x, atol=1e-4)


def test_half_spaces_that_contradict_are_missed_alike() -> None:
    plan = compile_plan(TRUNKS["trunk with struts"]()).plan
    rows, h = np.array([[1.0, 0.0], [-1.0, 0.0]]), np.array([0.3, 0.5])  # x <= -0.3, x >= 0.5
    x = least_step(plan, rows, h)
    np.testing.assert_allclose(x, [0.1, 0.0], atol=1e-6)
