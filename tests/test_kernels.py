"""The routines that kernels are made of, one by one, against NumPy, SciPy, brute force and finite differences.

They are plain Python here, whichever code the kernels are: a translation is compared with its source elsewhere.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import pfabrik as pf
from machines import MACHINES
from machines.trunks import TRUNKS
from pfabrik.decomposition.plan import CompiledPlan, compile_plan
from pfabrik.kernels import quaternions
from pfabrik.kernels.legs.complete_poses import ROUNDED, orthonormalise, turn_pose
from pfabrik.kernels.linear import solve_spd
from pfabrik.kernels.passes import half_spaces
from pfabrik.kernels.passes import plan as P
from pfabrik.kernels.passes.moving_frames import move_carriers, place_ends
from pfabrik.kernels.passes.passes import reach_backward, reach_forward
from pfabrik.kernels.passes.restrict import clamp_cone
from pfabrik.kernels.vectors import angle_between, wrap

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
        clamped = np.array(clamp_cone(triple(axis), half_angle, triple(d)))
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
        clamped = np.array(clamp_cone(triple(axis), 0.5, triple(-3.0 * axis)))
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


# --- linear systems --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("unit_of_length", [1e-150, 1.0, 1e140])
def test_solve_spd_solves(unit_of_length: float) -> None:
    for n in (1, 3, 6, 12):
        rng = np.random.default_rng(n)
        J = unit_of_length * rng.normal(size=(n + 3, n))
        A, b = J.T @ J, rng.normal(size=n)
        for damping in (0.0, 0.1):
            work = np.full((15, 15), np.nan)
            work[:n, :n], work[:n, n] = np.tril(A), b
            assert solve_spd(work, n, damping)
            expected = np.linalg.solve(A + damping * A.diagonal().max() * np.eye(n), b)
            np.testing.assert_allclose(work[:n, n], expected, rtol=1e-8, atol=0)


@pytest.mark.parametrize("A", [[[1.0, 2], [2, 1]], [[0.0, 0], [0, 0]], [[1.0, 0], [0, -1]], [[np.nan, 0], [0, 1]]])
def test_solve_spd_refuses_what_is_not_positive(A: list[list[float]]) -> None:
    work = np.ones((3, 3))
    work[:2, :2] = A
    assert not solve_spd(work, 2, 0.0)
    np.testing.assert_array_equal(work[:2, 2], 0)


# --- passes ----------------------------------------------------------------------------------------------------------


def at_home(compiled: CompiledPlan) -> Any:
    """A configuration at home."""
    now = P.new_configuration(compiled.plan)
    now.pose[:] = compiled.home_seed.poses[0]
    now.nodes[:] = compiled.plan.nodes["home"]
    move_carriers(compiled.plan, now)
    return now


def disturb(compiled: CompiledPlan, now: Any, rng: np.random.Generator, share: float, planar: bool = False) -> None:
    """Move everything by up to a share of L; first and last nodes stay where carrier, rail and platform have them."""
    plan, keep = compiled.plan, np.array([1, 1, 0]) if planar else np.ones(3)
    now.nodes[:] += share * plan.length * rng.uniform(-1, 1, now.nodes.shape) * keep
    now.pose[:3, 3] += share * plan.length * rng.uniform(-1, 1, 3) * keep
    now.pose[:3, :3] = Rotation.from_rotvec(share * rng.uniform(-1, 1, 3) * (1 - keep if planar else 1)).as_matrix()
    now.trunks[:] += share * rng.uniform(-1, 1, now.trunks.shape) * plan.trunk_joints["unit"]
    for branch in plan.branches[plan.branches["rail"] != 0]:
        home = plan.nodes[branch["first"]]["home"]
        now.nodes[branch["first"]] = home + share * plan.length * rng.uniform(-3, 3) * branch["rail_axis"]
    move_carriers(plan, now)
    for c in range(plan.chains.shape[0]):
        place_ends(plan, c, now)


def test_carriers_are_products_of_exponentials() -> None:
    compiled = compile_plan(pf.load("nrpm"))
    now, joints = at_home(compiled), compiled.plan.trunk_joints
    now.trunks[:] = np.random.default_rng(7).uniform(-1, 1, now.trunks.shape)
    move_carriers(compiled.plan, now)
    np.testing.assert_array_equal(now.carriers[0], np.eye(4)[:3])
    for k, trunk in enumerate(compiled.plan.trunks):
        T = np.eye(4)
        for j in range(trunk["first"], trunk["last"]):
            np.testing.assert_allclose(now.screws[j, 0], T[:3, :3] @ joints[j]["point"] + T[:3, 3], rtol=0, atol=1e-12)
            np.testing.assert_allclose(now.screws[j, 1], T[:3, :3] @ joints[j]["axis"], rtol=0, atol=1e-14)
            twist = np.zeros((4, 4))
            twist[:3, 3] = joints[j]["axis"]
            if joints[j]["turns"]:
                twist[:3, :3] = np.cross(np.eye(3), joints[j]["axis"])
                twist[:3, 3] = -twist[:3, :3] @ joints[j]["point"]
            T = T @ expm(twist * now.trunks[j])
        np.testing.assert_allclose(now.carriers[k + 1], T[:3], rtol=0, atol=1e-12)


def passes(
    machine: pf.Mechanism, inward: bool, share: float, n: int = 10, planar: bool = False
) -> Iterator[tuple[Any, Any, np.ndarray, int, Any]]:
    """Configurations disturbed by a share of L: plan, configuration, nodes before, and the branch that was passed."""
    compiled, rng = compile_plan(machine), np.random.default_rng(10)
    for _ in range(n):
        now = at_home(compiled)
        disturb(compiled, now, rng, share, planar)
        before = now.nodes.copy()
        for b, branch in enumerate(compiled.plan.branches):
            (reach_forward if inward else reach_backward)(compiled.plan, b, now)
            yield compiled.plan, now, before, b, branch


def lengths_kept(plan: Any, nodes: np.ndarray, branch: Any) -> bool:
    inner = slice(branch["first"] + 1, branch["last"] + 1)
    lengths = np.linalg.norm(np.diff(nodes[branch["first"] : branch["last"] + 1], axis=0), axis=1)
    low, high = plan.nodes["lo"][inner], plan.nodes["hi"][inner]
    return bool(((lengths >= low - 1e-13 * plan.length) & (lengths <= high + 1e-13 * plan.length)).all())


@pytest.mark.parametrize("share", [0.05, 0.5, 3.0])
@pytest.mark.parametrize("name", ["stewart", "nrpm", "hexaglide", "tripod_rps", "tripod_prs", "planar_prr"])
def test_a_pass_outward_starts_at_the_base_and_keeps_lengths_planes_rails_and_ranges(name: str, share: float) -> None:
    machine = MACHINES[name]() if name in MACHINES else pf.load(name)
    if name == "tripod_rps":  # a platform's cone may contradict the hinge's plane
        machine = machine.with_limits(C1=None, C2=None, C3=None)
    for plan, now, _, _, branch in passes(machine, False, share, 1):
        first, carrier = branch["first"], now.carriers[branch["carrier"]]
        base = carrier[:, :3] @ plan.nodes[first]["home"] + carrier[:, 3]
        slide = branch["rail_axis"] @ (now.nodes[first] - base)
        np.testing.assert_allclose(now.nodes[first], base + slide * branch["rail_axis"], atol=1e-12 * plan.length)
        if branch["rail"]:
            assert branch["rail_lo"] - 1e-12 * plan.length <= slide <= branch["rail_hi"] + 1e-12 * plan.length
        else:
            assert slide == 0
        assert lengths_kept(plan, now.nodes, branch)
        if not len(plan.trunks):  # nodes that hinges on the base carry stay in the plane of their branch
            last = first + min(branch["planar"], branch["last"] - first)
            off_plane = (now.nodes[first : last + 1] - plan.nodes[first]["home"]) @ branch["normal"]
            assert np.abs(off_plane).max() <= 1e-12 * plan.length


@pytest.mark.parametrize("share", [0.05, 0.5, 3.0])
@pytest.mark.parametrize("name", ["stewart", "nrpm", "hexaglide", "planar_prr", "serial_spherical"])
def test_a_pass_inward_starts_at_the_target_and_keeps_lengths(name: str, share: float) -> None:
    machine = MACHINES[name]() if name in MACHINES else pf.load(name)
    for plan, now, _, _, branch in passes(machine, True, share, 1, planar=name.startswith("planar")):
        target = now.pose[:3, :3] @ branch["end"] + now.pose[:3, 3]
        np.testing.assert_allclose(now.nodes[branch["last"]], target, atol=1e-12 * plan.length)
        assert lengths_kept(plan, now.nodes, branch)


def bend(a: np.ndarray, b: np.ndarray) -> float:
    """Angle from `a` to `b`, right-handed about y."""
    return float(np.arctan2(np.cross(a, b)[1], a @ b))


def test_a_pass_outward_keeps_the_ranges_of_hinges() -> None:
    """Every joint of the planar arm stays within 1.4 of the bend that home has there."""
    angles = []
    for plan, now, *_ in passes(MACHINES["serial_planar"](), False, 2.0, 50):
        links, homes = np.diff(now.nodes, axis=0), np.diff(plan.nodes["home"], axis=0)
        turns = [bend(homes[0], links[0])]
        turns += [bend(links[k - 1], links[k]) - bend(homes[k - 1], homes[k]) for k in range(1, 4)]
        angles += np.abs((np.array(turns) + np.pi) % (2 * np.pi) - np.pi).tolist()
    assert_kept(angles, 1.4)


def assert_kept(angles: list[float], half_angle: float) -> None:
    """No angle beyond a limit, and some at it."""
    assert max(angles) <= half_angle + 1e-9
    assert (np.array(angles) > half_angle - 1e-9).sum() > 10


def angles_between(lines: np.ndarray, others: np.ndarray) -> list[float]:
    return [float(np.arccos(unit(a) @ unit(b))) for a, b in zip(lines, others, strict=False)]


def test_a_pass_outward_keeps_cones_about_base_and_links() -> None:
    angles = []
    for _, now, *_ in passes(MACHINES["serial_spherical"](), False, 2.0, 50):
        links = np.vstack([[0, 0, 1], np.diff(now.nodes, axis=0)])
        angles += [float(np.arccos(unit(a) @ unit(b))) for a, b in pairwise(links)]
    assert_kept(angles, 0.9)


def test_a_pass_inward_keeps_the_cones_of_links_where_they_are() -> None:
    angles = []
    for _, now, before, *_ in passes(MACHINES["serial_spherical"](), True, 2.0, 50):
        angles += angles_between(np.vstack([[0, 0, 1], np.diff(before, axis=0)]), np.diff(now.nodes, axis=0))
    assert_kept(angles, 0.9)


def test_a_pass_inward_keeps_the_cones_of_the_platform() -> None:
    machine, angles = MACHINES["hexapod_ups"](), []
    for _, now, _, b, branch in passes(machine, True, 1.0):
        axis = now.pose[:3, :3] @ np.array(machine.joint(f"C{b + 1}").cone.axis)
        angles.append(float(np.arccos(axis @ unit(now.nodes[branch["first"]] - now.nodes[branch["last"]]))))
    assert_kept(angles, 0.7)


def test_a_pass_inward_keeps_the_cones_of_intermediate_platforms() -> None:
    """The strut of an arm, seen from its target: within the cone that is fixed to the crossbar, where the arm is."""
    machine, angles = pf.load("nrpm"), []
    free = {f"{joint}{side}{i}": None for joint in "DE" for side in "LR" for i in "123"}
    for _, now, _, b, branch in passes(machine.with_limits(**free), True, 1.0):
        cone = machine.joint(f"C{'LR'[b % 2]}{b // 2 + 1}").cone
        axis = now.carriers[branch["carrier"]][:, :3] @ unit(cone.axis)
        angles.append(float(np.arccos(axis @ unit(now.nodes[branch["last"]] - now.nodes[branch["first"]]))))
    assert_kept(angles, np.radians(50))


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
