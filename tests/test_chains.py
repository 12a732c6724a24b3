"""Serial chains: what is reached, limits, the nearest configurations, and that the work grows with the joints alone.

Configurations are measured by the description alone (`checks`); the nearest are those of the engine in joint space.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import INTERPRETED, assert_feasible, assert_honest
from pfabrik import Cone, Joint, Mechanism, Options, Status
from pfabrik.engines.chains.chain_engine import ChainEngine
from pfabrik.engines.engine import engine_of
from pfabrik.engines.joints.closure_engine import ClosureEngine
from pfabrik.engines.joints.projection import modes_of
from pfabrik.machine.model import model_of

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
compiled_only = pytest.mark.skipif(INTERPRETED, reason="minutes in plain Python")
FEW, MANY = (4, 3) if INTERPRETED else (40, 60)
POINT = ("x", "y", "z")
Task = tuple[str, ...] | None


def bodies(i: int, n: int) -> tuple[str, str]:
    return ("base" if i == 0 else f"b{i}", "tip" if i == n - 1 else f"b{i + 1}")


def hinges(n: int, most: float, axes: list[Any], task: Task) -> Mechanism:
    """Hinges along x, one unit apart, about axes by turns; each turns by so much [rad]."""
    bound = {} if most == np.inf else {"range": (-most, most)}
    joints = [
        Joint(f"j{i}", "revolute", bodies(i, n), (i, 0, 0), axes[i % len(axes)], actuated=True, **bound)  # type: ignore[arg-type]
        for i in range(n)
    ]
    return Mechanism("hinges", joints, "tip", (n, 0, 0), task=task)


def planar(n: int, most: float = np.inf, task: Task = ("x", "y")) -> Mechanism:
    return hinges(n, most, [(0, 0, 1)], task)


def in_space(n: int, most: float, task: Task = None) -> Mechanism:
    """Hinges about z and y by turns."""
    return hinges(n, most, [(0, 0, 1), (0, 1, 0)], task)


def mixed() -> Mechanism:
    """R, P, a fixed joint, C, R passed backwards, U, R; skew axes."""
    turns_and_slides = ((-1, 1.2), (-0.3, 0.2))
    joints = [
        Joint("a", "revolute", ("base", "1"), (0.1, 0, 0), (0, 0.2, 1), actuated=True, range=(-2, 2)),
        Joint("b", "prismatic", ("1", "2"), axis=(0.3, 1, 0), actuated=True, range=(-0.4, 0.5)),
        Joint("f", "fixed", ("2", "2f"), (0.5, 0, 0)),
        Joint("c", "cylindrical", ("2f", "3"), (1, 0.2, 0.1), (0, 1, 0.4), range=turns_and_slides),
        Joint("d", "revolute", ("4", "3"), (1.5, -0.2, 0), (1, 0.5, 0), actuated=True, range=(-1, 0.7)),
        Joint("u", "universal", ("4", "5"), (2, 0, 0), axes=((0, 1, 0), (0, 0, 1)), range=((-1, 1), (-1, 1))),
        Joint("e", "revolute", ("5", "tip"), (2.5, 0, 0.2), (1, 0, 0.1), actuated=True, range=(-1, 1)),
    ]
    return Mechanism("mixed", joints, "tip", (3, 0.1, 0.2))


def coned(n: int, kind: str, half_angle: float) -> Mechanism:
    """A hinge, then links in cones about the one before; the cones are fixed to one body or the other, by turns."""
    joints = [Joint("j0", "revolute", bodies(0, n), (0, 0, 0), (0, 0, 1), actuated=True, range=(-1, 1))]
    for i in range(1, n):
        body, after = bodies(i, n)
        outward = Cone((1, 0, 0), half_angle, body) if i < n - 1 else None
        axes = {"axes": ((0, 1, 0), (0, 0, 1))} if kind == "universal" else {}
        cone = outward if i % 2 else Cone((-1, 0, 0), half_angle, after)
        joints.append(Joint(f"j{i}", kind, (body, after), (i, 0, 0), cone=cone, **axes))  # type: ignore[arg-type]
    return Mechanism("cones", joints, "tip", (n, 0, 0), task=POINT)


def feasible(mechanism: Mechanism, n: int, seed: int = 0, share: float = 0.95) -> pf.Solution:
    """Configurations within a share of all ranges."""
    ranges = [np.reshape(joint.range, (-1, 2)) for joint in mechanism.joints if joint.range is not None]
    low, high = share * np.concatenate(ranges).T
    return pf.configuration(mechanism, np.random.default_rng(seed).uniform(low, high, (n, len(low))))


def by_joint_space(mechanism: Mechanism, targets: np.ndarray, options: Options) -> pf.Solution:
    """The answers of the engine in joint coordinates."""
    answers = ClosureEngine(model_of(mechanism)).answer(targets, None, options, keep_mode=False)
    return pf.Solution(mechanism, answers, (len(targets),))


def test_chains_and_trees_have_this_engine_and_loops_do_not() -> None:
    gripper = Joint("g", "revolute", ("b3", "finger"), (1, 0, 0), (0, 0, 1), range=(-1, 1))
    tree = Mechanism("tree", (*in_space(7, 1.0).joints, gripper), "tip", (7, 0, 0))
    assert all(isinstance(engine_of(each), ChainEngine) for each in (mixed(), in_space(7, 1.0), tree))
    assert not any(isinstance(engine_of(pf.load(name)), ChainEngine) for name in ("stewart", "five_bar", "prs"))


# --- within reach ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [7, 20, 60])
@pytest.mark.parametrize("task", [POINT, None, (*POINT, "tilt"), (*POINT, "yaw"), ("x", "z")])
def test_targets_of_feasible_configurations_are_reached_within_limits(n: int, task: Task) -> None:
    mechanism = in_space(n, 4.0 / n, task)
    targets = feasible(mechanism, MANY, n).pose
    answer = pf.solve_ik(mechanism, targets)
    assert answer
    assert_honest(mechanism, targets, answer)


def test_slides_fixed_joints_and_joints_passed_backwards_are_solved() -> None:
    mechanism = mixed()
    there = feasible(mechanism, FEW, 5)
    answer = pf.solve_ik(mechanism, there.pose)
    assert there and answer
    assert_feasible(mechanism, there)
    assert_honest(mechanism, there.pose, answer)


def test_home_is_its_own_answer_and_branches_beside_the_chain_stay_where_they_are() -> None:
    plain = in_space(7, 1.0)
    for mechanism in (plain, planar(20, 0.2), mixed()):
        np.testing.assert_array_equal(pf.solve_ik(mechanism, mechanism.home_pose).q, 0.0)
    finger = Joint("g", "revolute", ("b3", "finger"), (1, 0, 0), (0, 0, 1), range=(-1, 1), actuated=True)
    tree = Mechanism("tree", (*plain.joints[:4], finger, *plain.joints[4:]), "tip", (7, 0, 0))
    start = pf.configuration(tree, np.where(np.arange(8) == 4, 0.3, 0.0))
    answer = pf.solve_ik(tree, feasible(plain, FEW).pose, start=start, options=Options(working_mode="any"))
    assert answer
    np.testing.assert_array_equal(answer.joints["g"], 0.3)


def test_a_start_is_kept_near_where_the_target_is_near() -> None:
    mechanism = in_space(7, 1.5)
    start = feasible(mechanism, FEW, 7, 0.6)
    targets = start.pose.copy()
    targets[:, :3, 3] += 0.01
    answer = pf.solve_ik(mechanism, targets, start=start)
    moved = np.abs(answer.q - start.q).max(axis=1)
    assert (moved[answer.status == Status.REACHED] < 0.5).mean() >= 0.95


# --- out of reach ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [2, 5, 30])
def test_a_planar_chain_without_limits_reaches_the_disc_and_points_at_what_is_beyond(n: int) -> None:
    """On the border too, and next to it, where the target pulls as weakly as it is far."""
    mechanism, rng = planar(n), np.random.default_rng(1)
    angles, radii = rng.uniform(-np.pi, np.pi, FEW), rng.uniform(0.05, 2.0, FEW) * n
    radii[:4] = n + np.array((0.0, 1e-7, 1e-4, 1e-2))
    answer = pf.solve_ik(mechanism, np.stack([radii * np.cos(angles), radii * np.sin(angles), 0 * radii], axis=1))
    np.testing.assert_allclose(answer.position_error, np.maximum(radii - n, 0.0), atol=1e-7 * n)
    inside = answer.status == Status.REACHED
    np.testing.assert_array_equal(inside[1:], radii[1:] <= n)


def test_two_links_of_unequal_length_stay_out_of_the_hole_between_them() -> None:
    joints = [
        Joint("a", "revolute", ("base", "1"), (0, 0, 0), (0, 0, 1), actuated=True),
        Joint("b", "revolute", ("1", "tip"), (3, 0, 0), (0, 0, 1), actuated=True),
    ]
    model = model_of(Mechanism("two", joints, "tip", (4, 0, 0), task=("x", "y")))
    targets = pf.pose([(1.0, 0.5, 0.0), (0.0, -1.5, 0.0), (2.5, 0, 0)])
    answer = ChainEngine(model).answer(targets, None, Options(), keep_mode=False)
    np.testing.assert_allclose(answer.rows.measures[:, 0], (2.0 - np.hypot(1.0, 0.5), 0.5, 0.0), atol=1e-7)


@compiled_only
@pytest.mark.parametrize(
    ("make", "hold"),
    [
        (partial(in_space, 4, 1.0, POINT), "orientation"),
        (partial(in_space, 20, 0.26, POINT), "orientation"),
        (partial(in_space, 7, 1.7), "orientation"),
        (partial(in_space, 7, 0.7), "position"),
        (partial(in_space, 7, 0.7), None),
        (partial(coned, 8, "spherical", 0.35), "orientation"),
        (partial(coned, 8, "universal", 0.35), "orientation"),
    ],
)
def test_answers_are_hardly_ever_farther_than_those_in_joint_coordinates(
    make: Callable[[], Mechanism], hold: Any
) -> None:
    mechanism = make()
    n, rng, options = mechanism.reference_point[0], np.random.default_rng(8), Options(hold=hold)
    directions = rng.normal(size=(20, 3)) * (1, 1, 0.4) + (1.5, 0, 0)
    positions = directions * (rng.uniform(0.4, 1.3, 20) * n / np.linalg.norm(directions, axis=1))[:, None]
    targets = pf.pose(positions, rotvec=rng.uniform(-1.5, 1.5, (20, 3)))
    answer, other = pf.solve_ik(mechanism, targets, options=options), by_joint_space(mechanism, targets, options)
    assert_feasible(mechanism, answer)
    model, length = model_of(mechanism), mechanism.characteristic_length
    mode = modes_of(model.path_closure, options)[-1]
    far, other_far = (
        length * mode.distances(model.path_closure, each.position_error, each.rotation_error)
        for each in (answer, other)
    )
    is_farther = far > other_far + 1e-6 * np.maximum(length, other_far)
    assert is_farther.sum() <= 2
    assert (answer.status == Status.REACHED).sum() >= (other.status == Status.REACHED).sum()


def test_actuators_beyond_their_ranges_are_clipped_one_by_one() -> None:
    mechanism = in_space(9, 0.5)
    values = np.random.default_rng(3).uniform(-0.8, 0.8, (FEW, 9))
    values[:, 4] = 0.7
    answer, clipped = pf.solve_fk(mechanism, values), np.clip(values, -0.5, 0.5)
    assert_feasible(mechanism, answer)
    assert (answer.status == Status.PROJECTED).all()
    np.testing.assert_allclose(answer.actuators, clipped, atol=1e-9)
    np.testing.assert_allclose(answer.actuator_error, np.abs(clipped - values).max(axis=1), atol=1e-9)


# --- paths -----------------------------------------------------------------------------------------------------------


def test_a_path_is_followed_without_a_jump() -> None:
    mechanism = in_space(12, 0.6)
    along = pf.configuration(mechanism, 0.4 * np.sin(np.linspace(0, 4, 200)[:, None] + np.arange(12)))
    followed = pf.track(mechanism, along.pose, start=along[0])
    assert followed
    assert np.abs(np.diff(followed.q, axis=0)).max() < 0.1


def test_a_path_out_of_reach_and_back_ends_where_the_target_is() -> None:
    mechanism = in_space(9, 0.5, POINT)
    x = np.concatenate([np.linspace(7, 11, 30), np.linspace(11, 7, 30)])
    path = np.stack([x, 0 * x + 1.0, 0 * x + 0.5], axis=1)
    followed = pf.track(mechanism, path, start=pf.solve_ik(mechanism, path[0]))
    assert ((followed.status == Status.PROJECTED) == (followed.position_error > 1e-8)).all()
    assert (followed.position_error >= np.linalg.norm(path, axis=1) - 9.0 - 1e-9).all()
    assert followed.status[-1] == Status.REACHED


def test_the_forward_jacobian_is_the_slope_of_the_pose() -> None:
    mechanism, h = in_space(11, 1.0), 1e-6 * np.eye(11)
    here = feasible(mechanism, 1, 9)[0]
    jacobian, inverse = pf.forward_jacobian(here), pf.inverse_jacobian(here)
    ahead, behind = (pf.configuration(mechanism, here.q + step).pose for step in (h, -h))
    turns = Rotation.from_matrix(ahead[:, :3, :3] @ behind[:, :3, :3].swapaxes(1, 2)).as_rotvec()
    slopes = np.hstack([(ahead - behind)[:, :3, 3], turns]) / 2e-6
    np.testing.assert_allclose(jacobian, slopes.T, atol=1e-7)
    np.testing.assert_allclose(jacobian @ inverse, np.eye(6), atol=1e-9)


# --- hundreds of joints ----------------------------------------------------------------------------------------------

LENGTHS = [300, pytest.param(999, marks=pytest.mark.compiled)]


@compiled_only
@pytest.mark.parametrize("n", LENGTHS)
@pytest.mark.parametrize("most", [np.inf, np.radians(10.0)])
def test_targets_in_and_out_of_reach_of_many_hinges_are_reached_or_approached(n: int, most: float) -> None:
    """The tip is at most n away from the base: nothing comes nearer than the difference."""
    mechanism, beyond = planar(n, most, task=None), np.array((0.9 * n, 0.6 * n, 0.0))
    answer = pf.solve_ik(mechanism, [(0.98 * n, 0.05 * n, 0.0), beyond])
    assert answer.status.tolist() == [Status.REACHED, Status.PROJECTED]
    assert_feasible(mechanism, answer)
    least = np.linalg.norm(beyond) - n
    assert least - 1e-9 * n <= np.linalg.norm(answer.pose[1, :3, 3] - beyond) <= 1.1 * least


@compiled_only
def test_targets_within_reach_of_many_cones_are_reached() -> None:
    mechanism, n = coned(200, "universal", 0.2), 200
    answer = pf.solve_ik(mechanism, [(0.97 * n, 0.05 * n, 0.03 * n)])
    assert answer
    assert_feasible(mechanism, answer)


@compiled_only
@pytest.mark.parametrize("n", LENGTHS)
def test_angles_beyond_the_ranges_of_many_hinges_are_projected_onto_them(n: int) -> None:
    most = np.radians(10.0)
    answer = pf.solve_fk(planar(n, most, task=None), np.full(n, 0.2))
    assert answer.status == Status.PROJECTED
    assert np.abs(answer.q).max() <= most + 1e-9
    assert answer.actuator_error <= 0.2 - most + 1e-3


@compiled_only
def test_a_thousand_hinges_are_answered_in_milliseconds() -> None:
    """The engine in joint coordinates takes twenty seconds for one."""
    n, most = 999, np.radians(6.0)
    mechanism, s = in_space(n, most, POINT), np.linspace(0, 1, n)
    q = 0.6 * most * np.stack([np.sin(k + 5 * s) * np.cos(k * s) for k in range(20)])
    targets = pf.configuration(mechanism, q).pose
    pf.solve_ik(mechanism, targets[:1])
    began = time.process_time()
    answer = pf.solve_ik(mechanism, targets)
    assert time.process_time() - began < 20 * 0.05
    assert (answer.status == Status.REACHED).all()
    assert np.abs(answer.q).max() <= most + 1e-9
