"""The routines that kernels are made of, one by one, against NumPy, SciPy, brute force and finite differences.

Routines are only callable from compiled code: each is called through a kernel of its own here. To compile these takes
longer than all else, so `make test` runs them as plain Python, and a campaign compiled.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from itertools import chain, pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

import checks
import pfabrik as pf
from machines import MACHINES, ring
from pfabrik import Cone, Joint, Mechanism
from pfabrik.decomposition.plan import CompiledPlan, compile_plan
from pfabrik.kernels import linear, vectors
from pfabrik.kernels._jit import kernel
from pfabrik.kernels.reaching import exact, frames, restrict, rows, settle
from pfabrik.kernels.reaching import passes as reach
from pfabrik.kernels.reaching import plan as P

INTERPRETED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
pytestmark = [
    pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning"),
    *([] if INTERPRETED else [pytest.mark.campaign]),
]

TURN, TRANSLATE, BOTH, NEITHER = settle.TURNS, settle.TRANSLATES, settle.TURNS | settle.TRANSLATES, 0


@kernel
def clamp_cone(axis, half_angle, d):
    return restrict.clamp_cone(axis, half_angle, d)


@kernel
def clamp_stroke(length, lo, hi):
    return restrict.clamp_stroke(length, lo, hi)


@kernel
def angle_between(a, b):
    return vectors.angle_between(a, b)


@kernel
def wrap(angle, centre):
    return vectors.wrap(angle, centre)


@kernel
def rotation_between(A, B):
    return frames.rotation_between(A, B)


@kernel
def turn_pose_by_vector(T, w):
    frames.turn_pose_by_vector(T, w)


@kernel
def solve_spd(A, n, damping):
    return linear.solve_spd(A, n, damping)


@kernel
def room(plan):
    return rows.new_configuration(plan), rows.new_work(plan)


@kernel
def move_carriers(plan, now):
    frames.move_carriers(plan, now)


@kernel
def reach_exact(plan, b, now, mode, slack):
    return exact.reach_exact(plan, b, now, mode, slack), exact.branch_mode(plan, b, now)


@kernel
def pass_once(plan, b, now, forward):
    if forward:
        reach.reach_forward(plan, b, now)
    else:
        reach.reach_backward(plan, b, now)


@kernel
def place_ends(plan, now):
    for c in range(plan.chains.shape[0]):
        frames.place_ends(plan, c, now)


@kernel
def settle_all(plan, free, now, work):
    return settle.settle(plan, 0, plan.chains.shape[0], free, now, work)


@kernel
def right_hand_side(plan, free, now, work):
    """The number of unknowns; the normal equations are left in `work`."""
    n = settle.assign_columns(plan, 0, plan.chains.shape[0], free, work)
    settle.note_violations(plan, 0, plan.chains.shape[0], now, work)
    settle.assemble(plan, 0, plan.chains.shape[0], free, now, work, n)
    return n


@kernel
def cost_beside(plan, free, now, work, n):
    """Half the sum of squared violations one step aside; the configuration is put back."""
    settle.keep(now, work)
    settle.apply_step(plan, 0, plan.chains.shape[0], free, now, work, n)
    settle.note_violations(plan, 0, plan.chains.shape[0], now, work)
    settle.restore(plan, now, work)
    return 0.5 * work.totals[0]


def triple(v: Any) -> tuple[float, float, float]:
    x, y, z = (float(each) for each in v)
    return x, y, z


def unit(v: Any) -> np.ndarray:
    return np.asarray(v, float) / np.linalg.norm(v)


def directions(rng: np.random.Generator, n: int) -> np.ndarray:
    v = rng.normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1)[:, None]


# --- vectors and angles ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("half_angle", [0.01, 0.5, 1.2, 1.5, 2.5])
def test_clamp_cone_gives_the_nearest_vector_in_the_cone(half_angle: float) -> None:
    """No vector of the cone comes nearer; only where the nearest would be none at all, a thousandth is kept."""
    rng = np.random.default_rng(1)
    for axis, d in zip(directions(rng, 30), rng.normal(size=(30, 3)), strict=True):
        clamped = np.array(clamp_cone(triple(axis), half_angle, triple(d)))
        size = np.linalg.norm(d)
        assert np.arctan2(np.linalg.norm(np.cross(axis, clamped)), axis @ clamped) <= half_angle + 1e-12
        across = np.cross(axis, directions(rng, 2000))
        across /= np.linalg.norm(across, axis=1)[:, None]
        angle = np.where(rng.random(2000) < 0.5, half_angle, rng.uniform(0, half_angle, 2000))[:, None]
        rays = np.cos(angle) * axis + np.sin(angle) * across
        samples = np.maximum(rays @ d, 0)[:, None] * rays
        nearest = np.linalg.norm(samples - d, axis=1).min()
        allowed = 1e-12 if np.linalg.norm(clamped) > 1.1e-3 * size else 2e-3 * size
        assert np.linalg.norm(clamped - d) <= nearest + allowed
        assert np.linalg.norm(clamped) >= 0.999e-3 * size


def test_clamp_cone_leaves_vectors_inside_alone() -> None:
    rng = np.random.default_rng(2)
    for axis, d in zip(directions(rng, 200), rng.normal(size=(200, 3)), strict=True):
        angle = np.arccos(axis @ unit(d))
        if angle < 0.9:
            assert clamp_cone(triple(axis), 0.9 + 1e-12, triple(d)) == triple(d)


def test_clamp_cone_finds_a_direction_opposite_to_its_axis() -> None:
    for axis in np.vstack([np.eye(3), -np.eye(3), directions(np.random.default_rng(3), 10)]):
        clamped = np.array(clamp_cone(triple(axis), 0.5, triple(-3.0 * axis)))
        assert unit(clamped) @ axis == pytest.approx(np.cos(0.5), abs=1e-12)


@pytest.mark.parametrize("length, expected", [(0.5, 1.0), (1.0, 1.0), (1.7, 1.7), (2.0, 2.0), (3.0, 2.0)])
def test_clamp_stroke_leaves_lengths_inside_alone(length: float, expected: float) -> None:
    assert clamp_stroke(length, 1.0, 2.0) == expected
    assert clamp_stroke(length, 0.0, np.inf) == length


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


def two_poses(A: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    first, second = np.eye(4), np.eye(4)
    first[:3, :3], second[:3, :3] = A, Rotation.from_rotvec(w).as_matrix() @ A
    return first, second


@pytest.mark.parametrize("angle", [*SMALL, 1.0, 2.0, 3.0, *(np.pi - small for small in SMALL[2:])])
def test_rotation_between_is_the_rotation_vector_between(angle: float) -> None:
    """Near half a turn the axis is as exact as the matrix allows."""
    rng = np.random.default_rng(4)
    for axis in np.vstack([np.eye(3), directions(rng, 20)]):
        A, B = two_poses(Rotation.random(rng=rng).as_matrix(), angle * axis)
        np.testing.assert_allclose(rotation_between(A, B), angle * axis, rtol=0, atol=1e-11)


def test_half_a_turn_has_two_rotation_vectors() -> None:
    rng = np.random.default_rng(5)
    for axis in np.vstack([np.eye(3), directions(rng, 20)]):
        A, B = two_poses(Rotation.random(rng=rng).as_matrix(), np.pi * axis)
        w = np.array(rotation_between(A, B))
        np.testing.assert_allclose(w * np.sign(w @ axis), np.pi * axis, rtol=0, atol=1e-7)


@pytest.mark.parametrize("angle", [*SMALL, 1.0, 3.0, 7.0])
def test_turn_pose_by_vector_is_the_rotation_from_the_left(angle: float) -> None:
    rng = np.random.default_rng(6)
    for axis in directions(rng, 20):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = Rotation.random(rng=rng).as_matrix(), (1, 2, 3)
        expected = Rotation.from_rotvec(angle * axis).as_matrix() @ T[:3, :3]
        turn_pose_by_vector(T, triple(angle * axis))
        np.testing.assert_allclose(T[:3, :3], expected, rtol=0, atol=4e-15)
        np.testing.assert_allclose(T[:3, :3].T @ T[:3, :3], np.eye(3), rtol=0, atol=1e-15)
        np.testing.assert_array_equal(T[:3, 3], (1, 2, 3))


def test_a_pose_turned_many_times_stays_a_rotation() -> None:
    T = np.eye(4)
    for _ in range(1000):
        turn_pose_by_vector(T, (0.3, -0.2, 0.1))
    np.testing.assert_allclose(T[:3, :3], Rotation.from_rotvec([300, -200, 100]).as_matrix(), rtol=0, atol=1e-11)
    np.testing.assert_allclose(T[:3, :3].T @ T[:3, :3], np.eye(3), rtol=0, atol=1e-15)


# --- linear systems --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [1, 2, 3, 6, 12])
@pytest.mark.parametrize("unit_of_length", [1e-150, 1.0, 1e140])
def test_solve_spd_solves(n: int, unit_of_length: float) -> None:
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


def test_damping_makes_a_singular_system_solvable() -> None:
    work = np.ones((3, 3))
    assert not solve_spd(work.copy(), 2, 0.0)
    assert solve_spd(work, 2, 1e-6)
    np.testing.assert_allclose(work[:2, 2], 1 / (2 + 1e-6), rtol=1e-9)


# --- configurations --------------------------------------------------------------------------------------------------


def at_home(compiled: CompiledPlan) -> tuple[Any, Any]:
    """A configuration at home, and scratch memory."""
    now, work = room(compiled.plan)
    now.pose[:] = compiled.home_seed.poses[0]
    now.nodes[:] = compiled.plan.nodes["home"]
    move_carriers(compiled.plan, now)
    return now, work


def disturb(compiled: CompiledPlan, now: Any, rng: np.random.Generator, share: float, planar: bool = False) -> None:
    """Move everything by up to a share of L; first and last nodes stay where carrier, rail and platform have them."""
    length = compiled.plan.scalars[P.LENGTH]
    keep = np.array([1, 1, 0]) if planar else np.ones(3)
    now.nodes[:] += share * length * rng.uniform(-1, 1, now.nodes.shape) * keep
    now.pose[:3, 3] += share * length * rng.uniform(-1, 1, 3) * keep
    now.pose[:3, :3] = Rotation.from_rotvec(share * rng.uniform(-1, 1, 3) * (1 - keep if planar else 1)).as_matrix()
    for j, joint in enumerate(compiled.plan.trunk_joints):
        now.trunks[j] += share * rng.uniform(-1, 1) * (length if joint["kind"] == P.SLIDE else 1.0)
    for branch in compiled.plan.branches:
        if branch["rail"]:
            home = compiled.plan.nodes[branch["first"]]["home"]
            now.nodes[branch["first"]] = home + share * length * rng.uniform(-3, 3) * branch["rail_axis"]
    move_carriers(compiled.plan, now)
    place_ends(compiled.plan, now)


def arm_with_elbow(leg: Callable[[str, Any, Any], list[Joint]], slide: bool = True) -> Mechanism:
    """A trunk of shoulder, slide and elbow that carries two branches; four struts more hold the platform."""
    joints = [
        Joint("shoulder", "revolute", ("base", "arm"), at=(100, 0, 0), axis=(0, 1, 0), actuated=True, range=(-1, 1))
    ]
    joints += [
        Joint("slide", "prismatic", ("slider", "arm"), axis=(-1, 0, 3), actuated=True, range=(-20, 20)),
        Joint("elbow", "revolute", ("bar", "slider"), at=(90, 0, 40), axis=(1, 1, 0), actuated=True, range=(-1, 1)),
    ]
    joints += leg("1", (80, 20, 60), (50, 30, 150)) + leg("2", (80, -20, 60), (50, -30, 150))
    for i, (foot, head) in enumerate(
        zip(ring(100, 0, (80, 120, 200, 260)), ring(50, 150, (90, 140, 180, 270)), strict=True)
    ):
        joints += _strut(f"s{i}", "base", foot, head)
    return Mechanism("arm with elbow", joints, "platform", (0, 0, 150))


def _strut(name: str, body: str, foot: Any, head: Any) -> list[Joint]:
    line = np.subtract(head, foot)
    return [
        Joint(f"C{name}", "universal", (body, f"c{name}"), at=foot, cone=Cone(line, 0.3, body)),
        Joint(
            f"D{name}", "prismatic", (f"c{name}", f"r{name}"), along=(f"C{name}", f"E{name}"), actuated=True,
            range=(0.95 * np.linalg.norm(line), 1.05 * np.linalg.norm(line)),
        ),
        Joint(f"E{name}", "spherical", (f"r{name}", "platform"), at=head, cone=Cone(-line, 0.3, "platform")),
    ]  # fmt: skip


def _bar_strut(name: str, foot: Any, head: Any) -> list[Joint]:
    return _strut(name, "bar", foot, head)


def _bar_dyad(name: str, foot: Any, head: Any) -> list[Joint]:
    """Crank, rod and ball joint, with a cone that is fixed to the crank."""
    knee = np.add(foot, (0, 30, 50))
    aside = np.subtract(head, knee) + (3, 2, 1)
    return [
        Joint(f"C{name}", "revolute", ("bar", f"c{name}"), at=foot, axis=(1, 0, 0), range=(-0.2, 0.2)),
        Joint(f"D{name}", "spherical", (f"c{name}", f"r{name}"), at=knee, cone=Cone(aside, 0.3, f"c{name}")),
        Joint(f"E{name}", "spherical", (f"r{name}", "platform"), at=head),
    ]


def _bar_ball(name: str, foot: Any, head: Any) -> list[Joint]:
    """A strut, and on the other side the platform's ball joint on the crossbar itself."""
    if name == "1":
        return [Joint("ball", "spherical", ("bar", "platform"), at=head)]
    return _bar_strut(name, foot, head)


def _bar_planar(name: str, foot: Any, head: Any) -> list[Joint]:
    knee = np.add(foot, (0, 30, 50))
    return [
        Joint(f"C{name}", "revolute", ("bar", f"c{name}"), at=foot, axis=(1, 0, 0)),
        Joint(f"D{name}", "revolute", (f"c{name}", f"r{name}"), at=knee, axis=(1, 0, 0)),
        Joint(f"E{name}", "revolute", (f"r{name}", "platform"), at=head, axis=(1, 0, 0)),
    ]


def pivoted() -> Mechanism:
    """A platform on a ball joint that is fixed to the base, with three struts."""
    struts = [
        _strut(f"{i}", "base", a, c)
        for i, (a, c) in enumerate(zip(ring(100, 0, (0, 120, 240)), ring(60, 150, (10, 120, 250)), strict=True))
    ]
    return Mechanism(
        "pivoted",
        [Joint("pivot", "spherical", ("base", "platform"), at=(0, 0, 140)), *chain.from_iterable(struts)],
        "platform",
        (0, 0, 150),
    )


@pytest.mark.parametrize("name", ["nrpm", "elbow"])
def test_carriers_are_products_of_exponentials(name: str) -> None:
    compiled = compile_plan(pf.load("nrpm") if name == "nrpm" else arm_with_elbow(_bar_strut))
    now, _ = at_home(compiled)
    rng = np.random.default_rng(7)
    now.trunks[:] = rng.uniform(-1, 1, now.trunks.shape)
    move_carriers(compiled.plan, now)
    np.testing.assert_array_equal(now.carriers[0], np.eye(4)[:3])
    for k, trunk in enumerate(compiled.plan.trunks):
        T = np.eye(4)
        for j in range(trunk["first"], trunk["last"]):
            joint = compiled.plan.trunk_joints[j]
            np.testing.assert_allclose(now.screws[j, 0], T[:3, :3] @ joint["point"] + T[:3, 3], rtol=0, atol=1e-12)
            np.testing.assert_allclose(now.screws[j, 1], T[:3, :3] @ joint["axis"], rtol=0, atol=1e-14)
            twist = np.zeros((4, 4))
            if joint["kind"] == P.TURN:
                twist[:3, :3] = np.cross(np.eye(3), joint["axis"])
                twist[:3, 3] = -twist[:3, :3] @ joint["point"]
            else:
                twist[:3, 3] = joint["axis"]
            T = T @ expm(twist * now.trunks[j])
        np.testing.assert_allclose(now.carriers[k + 1], T[:3], rtol=0, atol=1e-12)


# --- closed forms ----------------------------------------------------------------------------------------------------


def two_links(inner: float, outer: float) -> CompiledPlan:
    """A dyad in the plane z = 0 from the origin, with a ball-jointed outer link; bent by a right angle at home."""
    joints = [
        Joint("A", "revolute", ("base", "crank"), at=(0, 0, 0), axis=(0, 0, 1), actuated=True),
        Joint("B", "spherical", ("crank", "rod"), at=(inner, 0, 0)),
        Joint("C", "spherical", ("rod", "tool"), at=(inner, outer, 0)),
    ]
    return compile_plan(Mechanism("dyad", joints, "C"))


def reached(compiled: CompiledPlan, target: Any, mode: float, slack: float = 1e-12) -> tuple[bool, float, np.ndarray]:
    now, _ = at_home(compiled)
    now.pose[:3, 3] = target
    found, present_mode = reach_exact(compiled.plan, 0, now, mode, slack)
    return found, present_mode, now.nodes.copy()


def test_a_dyad_reaches_in_two_modes_that_are_mirror_images() -> None:
    compiled = two_links(3.0, 2.0)
    assert compiled.plan.branches[0]["kind"] == P.DYAD
    rng = np.random.default_rng(8)
    for _ in range(100):
        radius, angle, height = rng.uniform(1.5, 4.5), rng.uniform(-4, 4), rng.uniform(-0.5, 0.5)
        target = np.array([radius * np.cos(angle), radius * np.sin(angle), height])
        one, other = reached(compiled, target, 1.0), reached(compiled, target, -1.0)
        for found, _mode, (base, knee, tip) in (one, other):
            assert found
            np.testing.assert_array_equal(base, 0)
            np.testing.assert_array_equal(tip, target)
            assert knee[2] == 0
            assert np.linalg.norm(knee) == pytest.approx(3, abs=1e-14)
            assert np.linalg.norm(tip - knee) == pytest.approx(2, abs=1e-14)
        assert (one[1], other[1]) == (1.0, -1.0)
        line = unit(target * [1, 1, 0])
        knee = one[2][1]
        np.testing.assert_allclose(other[2][1], 2 * (knee @ line) * line - knee, rtol=0, atol=1e-13)


@pytest.mark.parametrize("distance, reaches", [(5.0, True), (5.0 + 0.9e-9, True), (5.0 + 1.1e-9, False)])
@pytest.mark.parametrize("mode", [1.0, -1.0])
def test_a_stretched_dyad_is_straight_and_reaches_no_farther(distance: float, reaches: bool, mode: float) -> None:
    found, present, (_, knee, _) = reached(two_links(3.0, 2.0), (distance, 0, 0), mode, slack=1e-9)
    assert found is reaches
    if reaches:
        np.testing.assert_allclose(knee, (3, 0, 0), atol=2e-7)
        assert present == 0.0


@pytest.mark.parametrize("distance, reaches", [(1.0, True), (1.0 - 0.9e-9, True), (1.0 - 1.1e-9, False)])
@pytest.mark.parametrize("inner, outer", [(3.0, 2.0), (2.0, 3.0)])
def test_a_folded_dyad_is_straight_and_reaches_no_nearer(
    inner: float, outer: float, distance: float, reaches: bool
) -> None:
    found, present, (_, knee, _) = reached(two_links(inner, outer), (0, distance, 0), 1.0, slack=1e-9)
    assert found is reaches
    if reaches:
        np.testing.assert_allclose(knee, (0, inner * np.sign(inner - outer), 0), atol=2e-7)
        assert present == 0.0


@pytest.mark.parametrize("outer, reaches", [(3.0, True), (2.0, False)])
def test_a_dyad_folded_onto_its_base_keeps_its_direction(outer: float, reaches: bool) -> None:
    found, _, (_, knee, _) = reached(two_links(3.0, outer), (0, 0, 0), 1.0)
    assert found is reaches
    if reaches:
        np.testing.assert_allclose(knee, (3, 0, 0), atol=1e-14)


def test_a_target_beside_the_dyads_plane_is_reached_as_far_as_the_outer_link_leans() -> None:
    compiled = two_links(3.0, 2.0)
    assert reached(compiled, (3, 0, 1.999), 1.0)[0]
    assert not reached(compiled, (3, 0, 2.001), 1.0)[0]


def rail_and_rod() -> CompiledPlan:
    """A carriage on the x axis with a rod of 5, at home over x = 0 with its end at (3, 4, 0)."""
    joints = [
        Joint("P", "prismatic", ("base", "carriage"), axis=(1, 0, 0), actuated=True),
        Joint("U", "universal", ("carriage", "rod"), at=(0, 0, 0)),
        Joint("S", "spherical", ("rod", "tool"), at=(3, 4, 0)),
    ]
    return compile_plan(Mechanism("rail and rod", joints, "S"))


def test_a_rail_and_a_rod_reach_in_two_modes_that_are_mirror_images() -> None:
    compiled = rail_and_rod()
    assert compiled.plan.branches[0]["kind"] == P.RAIL_ROD
    rng = np.random.default_rng(9)
    for _ in range(100):
        off, angle, x = rng.uniform(0, 4.9), rng.uniform(-4, 4), rng.uniform(-20, 20)
        target = np.array([x, off * np.cos(angle), off * np.sin(angle)])
        one, other = reached(compiled, target, 1.0), reached(compiled, target, -1.0)
        for found, _mode, (carriage, end) in (one, other):
            assert found
            np.testing.assert_array_equal(carriage[1:], 0)
            np.testing.assert_array_equal(end, target)
            assert np.linalg.norm(end - carriage) == pytest.approx(5, abs=1e-13)
        assert (one[1], other[1]) == (1.0, -1.0)
        assert one[2][0, 0] + other[2][0, 0] == pytest.approx(2 * x, abs=1e-12)


@pytest.mark.parametrize("off, reaches", [(5.0, True), (5.0 + 0.9e-9, True), (5.0 + 1.1e-9, False)])
def test_a_rod_across_its_rail_reaches_no_farther(off: float, reaches: bool) -> None:
    found, present, (carriage, _) = reached(rail_and_rod(), (7, off, 0), 1.0, slack=1e-9)
    assert found is reaches
    if reaches:
        np.testing.assert_allclose(carriage, (7, 0, 0), atol=1e-12)
        assert present == 0.0


# --- passes ----------------------------------------------------------------------------------------------------------

PASSED = [
    "stewart",
    "nrpm",
    "hexapod_rus",
    "hexaglide",
    "tripod_rps",
    "tripod_prs",
    "planar_rrr",
    "planar_prr",
    "serial_planar",
    "serial_spherical",
]


def lengths_kept(compiled: CompiledPlan, nodes: np.ndarray) -> bool:
    for branch in compiled.plan.branches:
        for k in range(branch["first"] + 1, branch["last"] + 1):
            length = np.linalg.norm(nodes[k] - nodes[k - 1])
            slack = 1e-13 * compiled.plan.scalars[P.LENGTH]
            if not compiled.plan.nodes[k]["lo"] - slack <= length <= compiled.plan.nodes[k]["hi"] + slack:
                return False
    return True


def off_plane(compiled: CompiledPlan, nodes: np.ndarray) -> float:
    """Largest distance of a node that hinges on the base carry from the plane of its branch."""
    gaps = [0.0]
    for branch in compiled.plan.branches:
        last = branch["first"] + min(branch["planar"], branch["last"] - branch["first"])
        for k in range(branch["first"], last + 1):
            gaps.append(abs(branch["normal"] @ (nodes[k] - compiled.plan.nodes[branch["first"]]["home"])))
    return max(gaps) if not len(compiled.plan.trunks) else 0.0


@pytest.mark.parametrize("name", PASSED)
def test_a_pass_outward_starts_at_the_base_and_keeps_lengths_planes_rails_and_ranges(name: str) -> None:
    machine = MACHINES[name]() if name in MACHINES else pf.load(name)
    if name == "tripod_rps":  # a platform's cone may contradict the hinge's plane
        machine = machine.with_limits(S1=None, S2=None, S3=None)
    compiled = compile_plan(machine)
    rng = np.random.default_rng(10)
    length = compiled.plan.scalars[P.LENGTH]
    for share in (0.05, 0.5, 3.0):
        now, _ = at_home(compiled)
        disturb(compiled, now, rng, share)
        for b, branch in enumerate(compiled.plan.branches):
            pass_once(compiled.plan, b, now, False)
            first = branch["first"]
            carrier = now.carriers[branch["carrier"]]
            base = carrier[:, :3] @ compiled.plan.nodes[first]["home"] + carrier[:, 3]
            slide = branch["rail_axis"] @ (now.nodes[first] - base)
            np.testing.assert_allclose(now.nodes[first], base + slide * branch["rail_axis"], atol=1e-12 * length)
            if branch["rail"]:
                assert branch["rail_lo"] - 1e-12 * length <= slide <= branch["rail_hi"] + 1e-12 * length
            else:
                assert slide == 0
        assert lengths_kept(compiled, now.nodes)
        assert off_plane(compiled, now.nodes) <= 1e-12 * length


@pytest.mark.parametrize("name", PASSED)
def test_a_pass_inward_starts_at_the_target_and_keeps_lengths_and_planes(name: str) -> None:
    compiled = compile_plan(MACHINES[name]() if name in MACHINES else pf.load(name))
    rng = np.random.default_rng(11)
    length = compiled.plan.scalars[P.LENGTH]
    for share in (0.05, 0.5, 3.0):
        now, _ = at_home(compiled)
        disturb(compiled, now, rng, share, planar=name.startswith("planar"))
        for b, branch in enumerate(compiled.plan.branches):
            pass_once(compiled.plan, b, now, True)
            target = now.pose[:3, :3] @ branch["end"] + now.pose[:3, 3]
            np.testing.assert_allclose(now.nodes[branch["last"]], target, atol=1e-12 * length)
        if name.startswith(("stewart", "nrpm", "hexa", "planar", "serial_spherical")) and name != "hexapod_rus":
            assert lengths_kept(compiled, now.nodes)


def bend(a: np.ndarray, b: np.ndarray) -> float:
    """Angle from `a` to `b`, right-handed about y."""
    return float(np.arctan2(np.cross(a, b)[1], a @ b))


def test_a_pass_outward_keeps_the_ranges_of_hinges() -> None:
    """Every joint of the planar arm stays within 1.4 of the bend that home has there."""
    compiled = compile_plan(MACHINES["serial_planar"]())
    rng = np.random.default_rng(12)
    home = compiled.plan.nodes["home"]
    limited = 0
    for _ in range(50):
        now, _ = at_home(compiled)
        disturb(compiled, now, rng, 2.0)
        pass_once(compiled.plan, 0, now, False)
        links, homes = np.diff(now.nodes, axis=0), np.diff(home, axis=0)
        turns = [bend(homes[0], links[0])]
        turns += [bend(links[k - 1], links[k]) - bend(homes[k - 1], homes[k]) for k in range(1, 4)]
        turns = (np.array(turns) + np.pi) % (2 * np.pi) - np.pi
        assert np.abs(turns).max() <= 1.4 + 1e-9
        limited += int((np.abs(turns) > 1.4 - 1e-9).sum())
    assert limited > 20


def test_a_pass_outward_keeps_cones_about_base_and_links() -> None:
    compiled = compile_plan(MACHINES["serial_spherical"]())
    rng = np.random.default_rng(13)
    limited = 0
    for _ in range(50):
        now, _ = at_home(compiled)
        disturb(compiled, now, rng, 2.0)
        pass_once(compiled.plan, 0, now, False)
        links = np.vstack([[0, 0, 1], np.diff(now.nodes, axis=0)])
        angles = [np.arccos(unit(a) @ unit(b)) for a, b in pairwise(links)]
        assert max(angles) <= 0.9 + 1e-9
        limited += sum(angle > 0.9 - 1e-9 for angle in angles)
    assert limited > 20


def test_a_pass_inward_keeps_the_cones_of_the_platform() -> None:
    machine = MACHINES["hexapod_ups"]()
    compiled = compile_plan(machine)
    rng = np.random.default_rng(14)
    for _ in range(10):
        now, _ = at_home(compiled)
        disturb(compiled, now, rng, 1.0)
        for b, branch in enumerate(compiled.plan.branches):
            pass_once(compiled.plan, b, now, True)
            axis = now.pose[:3, :3] @ np.array(machine.joint(f"C{b + 1}").cone.axis)
            line = now.nodes[branch["first"]] - now.nodes[branch["last"]]
            assert np.arccos(axis @ unit(line)) <= 0.7 + 1e-9


# --- settling --------------------------------------------------------------------------------------------------------

SETTLED: dict[str, Callable[[], Mechanism]] = {
    **{name: (lambda name=name: pf.load(name)) for name in ("five_bar", "stewart", "nrpm")},
    **MACHINES,
    "pivoted": pivoted,
    "trunk with struts": lambda: arm_with_elbow(_bar_strut),
    "trunk with cranks": lambda: arm_with_elbow(_bar_dyad),
    "trunk with a ball joint": lambda: arm_with_elbow(_bar_ball),
    "trunk with planar legs": lambda: arm_with_elbow(_bar_planar),
}


def gradient(compiled: CompiledPlan, now: Any, work: Any, free: int) -> tuple[np.ndarray, np.ndarray]:
    """Gradient of half the sum of squared violations: as assembled, and by central differences."""
    n = right_hand_side(compiled.plan, free, now, work)
    assembled = -work.normal[:n, n].copy()
    step = 3e-6 * compiled.plan.scalars[P.LENGTH]
    found = np.zeros(n)
    for i in range(n):
        costs = []
        for signed in (step, -step):
            work.system[:, n] = 0
            work.system[i, n] = signed
            costs.append(cost_beside(compiled.plan, free, now, work, n))
        found[i] = (costs[0] - costs[1]) / (2 * step)
    return assembled, found


def assert_gradients_agree(compiled: CompiledPlan, now: Any, work: Any) -> None:
    """For every way the platform may be free; the step leaves an error of some 1e-8."""
    for free in (NEITHER, TRANSLATE, TURN, BOTH):
        assembled, found = gradient(compiled, now, work, free)
        largest = max(np.abs(found).max(initial=0.0), 1e-3 * compiled.plan.scalars[P.LENGTH])
        np.testing.assert_allclose(assembled, found, rtol=0, atol=3e-6 * largest)


@pytest.mark.parametrize("name", SETTLED)
def test_the_gradient_of_loops_and_planes_agrees_with_finite_differences(name: str) -> None:
    compiled = compile_plan(SETTLED[name]().without_limits())
    rng = np.random.default_rng(15)
    for share in (0.02, 0.3):
        now, work = at_home(compiled)
        disturb(compiled, now, rng, share)
        assert_gradients_agree(compiled, now, work)


@pytest.mark.parametrize("name", SETTLED)
def test_the_gradient_of_limits_agrees_with_finite_differences(name: str) -> None:
    """Angles of hinges, and at cones fixed to hinged links, are gradients where the links lie in their planes."""
    compiled = compile_plan(SETTLED[name]())
    rng = np.random.default_rng(16)
    noted = 0
    for share in (0.02, 0.3, 0.6):
        now, work = at_home(compiled)
        disturb(compiled, now, rng, share)
        put_into_planes(compiled, now)
        assert_gradients_agree(compiled, now, work)
        noted += int(work.totals[2])
    assert noted > 0


def put_into_planes(compiled: CompiledPlan, now: Any) -> None:
    """Put every hinged link into its plane; the platform too, where all its links share one."""
    branches = compiled.plan.branches
    if branches["align"].any() or compiled.plan.scalars[P.POINT_END] == 1.0:
        normal = now.carriers[branches[0]["carrier"]][:, :3] @ branches[0]["normal"]
        turn = normal @ Rotation.from_matrix(now.pose[:3, :3]).as_rotvec()
        now.pose[:3, :3] = Rotation.from_rotvec(turn * normal).as_matrix()
        if branches[0]["planar"]:
            now.pose[:3, 3] -= normal * (normal @ (now.pose[:3, 3] - compiled.home_seed.poses[0, :3, 3]))
        place_ends(compiled.plan, now)
    for branch in branches:
        nodes = now.nodes[branch["first"] : branch["last"] + 1]
        normal = now.carriers[branch["carrier"]][:, :3] @ branch["normal"]
        inner = nodes[: branch["planar"] + 1]
        inner -= np.outer((inner - nodes[0]) @ normal, normal)
        if branch["end_plane"]:
            end_normal = now.pose[:3, :3] @ branch["end_normal"]
            nodes[:-1] -= np.outer((nodes[:-1] - nodes[-1]) @ end_normal, end_normal) * (len(nodes) > 2)
    place_ends(compiled.plan, now)


def as_answer(compiled: CompiledPlan, now: Any) -> SimpleNamespace:
    """What the independent check reads of a configuration: pose and joint centres."""
    points = {joint: now.screws[j, 0] for joint, j in compiled.trunk_points}
    for point in compiled.points:
        frame = now.pose if point.carrier < 0 else now.carriers[point.carrier]
        points[point.joint] = now.nodes[point.node] + frame[:3, :3] @ (point.shift * point.axis)
    return SimpleNamespace(pose=now.pose, points=points)


@pytest.mark.parametrize("name", SETTLED)
def test_settling_closes_the_loops(name: str) -> None:
    """From a configuration disturbed by a twentieth of L, to a trillionth, checked on the description."""
    mechanism = SETTLED[name]()
    compiled = compile_plan(mechanism)
    rng = np.random.default_rng(16)
    for _ in range(2 if INTERPRETED else 10):
        now, work = at_home(compiled)
        disturb(compiled, now, rng, 0.05)
        if compiled.plan.scalars[P.POINT_END] == 1.0:
            now.pose[:3, :3] = np.eye(3)
        free = TRANSLATE if compiled.plan.scalars[P.POINT_END] == 1.0 else BOTH
        assert settle_all(compiled.plan, free, now, work)
        assert checks.gap_of_points(mechanism, as_answer(compiled, now))[0] <= 1e-12
        np.testing.assert_allclose(now.pose[:3, :3].T @ now.pose[:3, :3], np.eye(3), rtol=0, atol=1e-14)


@pytest.mark.parametrize("name", SETTLED)
def test_settling_says_when_the_loops_cannot_be_closed(name: str) -> None:
    """The platform is held ten L away."""
    compiled = compile_plan(SETTLED[name]())
    now, work = at_home(compiled)
    now.pose[:3, 3] += (0, 0, 10 * compiled.plan.scalars[P.LENGTH])
    place_ends(compiled.plan, now)
    assert not settle_all(compiled.plan, NEITHER, now, work)
    assert np.isfinite(now.nodes).all()


def test_settling_leaves_a_settled_configuration_alone() -> None:
    for name, make in SETTLED.items():
        compiled = compile_plan(make())
        now, work = at_home(compiled)
        before = now.nodes.copy()
        assert settle_all(compiled.plan, BOTH, now, work), name
        np.testing.assert_allclose(now.nodes, before, rtol=0, atol=1e-11)
