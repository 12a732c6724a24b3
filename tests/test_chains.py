"""Serial chains: what is reached, limits, the nearest configurations, and that the work grows with the joints alone.

Poses are checked by products of rotations written here, limits by own arithmetic, the nearest by SciPy.
"""

from __future__ import annotations

import time

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import INTERPRETED
from pfabrik import Cone, Joint, Mechanism, Status
from pfabrik.chains.chain_engine import ChainEngine
from pfabrik.closure.closure_engine import ClosureEngine
from pfabrik.engine import engine_of
from pfabrik.model import model_of

Array = NDArray[np.float64]
pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
FEW, MANY = (4, 8) if INTERPRETED else (40, 200)


def bodies(i: int, n: int) -> tuple[str, str]:
    return ("base" if i == 0 else f"b{i}", "tip" if i == n - 1 else f"b{i + 1}")


def hinges(n: int, most: float, axes: Array, task: tuple[str, ...] | None = None, link: float = 1.0) -> Mechanism:
    """Hinges along x, `link` apart, about given axes (n, 3); each turns by so much [rad]."""
    bound = {} if most == np.inf else {"range": (-most, most)}
    joints = [
        Joint(f"j{i}", "revolute", bodies(i, n), (i * link, 0, 0), axes[i], actuated=True, **bound)  # type: ignore[arg-type]
        for i in range(n)
    ]
    return Mechanism("hinges", joints, "tip", (n * link, 0, 0), task=task)


def planar(n: int, most: float = np.inf) -> Mechanism:
    return hinges(n, most, np.tile((0.0, 0.0, 1.0), (n, 1)), ("x", "y"))


def in_space(n: int, most: float, task: tuple[str, ...] | None = None) -> Mechanism:
    """Hinges about z and y by turns."""
    return hinges(n, most, np.array([(0.0, 0.0, 1.0), (0.0, 1.0, 0.0)])[np.arange(n) % 2], task)


def turned(axis: Array, angles: Array) -> Array:
    return Rotation.from_rotvec(np.multiply.outer(angles, axis)).as_matrix()


def product(mechanism: Mechanism, q: Array) -> Array:
    """Poses (n, 4, 4) of the last body of a chain of R, P, C and U joints, from coordinates (n, c), joint by joint."""
    T = np.tile(np.eye(4), (len(q), 1, 1))
    column = 0
    for joint in mechanism.joints:
        first = joint.type in ("revolute", "cylindrical", "universal")
        motions: list[tuple[str, Array]] = []
        if first:
            axes = joint.axes if joint.type == "universal" else (joint.axis,)
            motions += [("turn", np.array(axis)) for axis in axes or ()]
        if joint.type in ("prismatic", "cylindrical"):
            motions.append(("slide", np.array(joint.axis)))
        steps = np.tile(np.eye(4), (len(q), 1, 1))
        for kind, axis in motions:
            step = np.tile(np.eye(4), (len(q), 1, 1))
            if kind == "turn":
                at = np.array(joint.at)
                step[:, :3, :3] = turned(axis, q[:, column])
                step[:, :3, 3] = at - step[:, :3, :3] @ at
            else:
                step[:, :3, 3] = q[:, column, None] * axis
            steps = steps @ step
            column += 1
        backwards = joint.connects[0] != mechanism.base and joint.name.endswith("_back")
        T = T @ (np.linalg.inv(steps) if backwards else steps)
    T[:, :3, 3] += T[:, :3, :3] @ np.array(mechanism.reference_point)
    return T


def mixed() -> Mechanism:
    """R, P, a fixed joint, C, R passed backwards, U, R; skew axes."""
    joints = [
        Joint("a", "revolute", ("base", "1"), (0.1, 0, 0), (0, 0.2, 1), actuated=True, range=(-2, 2)),
        Joint("b", "prismatic", ("1", "2"), axis=(0.3, 1, 0), actuated=True, range=(-0.4, 0.5)),
        Joint("f", "fixed", ("2", "2f"), (0.5, 0, 0)),
        Joint(
            "c",
            "cylindrical",
            ("2f", "3"),
            (1, 0.2, 0.1),
            axis=(0, 1, 0.4),
            actuated=True,
            range=((-1, 1.2), (-0.3, 0.2)),
        ),  # type: ignore[arg-type]
        Joint("d_back", "revolute", ("4", "3"), (1.5, -0.2, 0), (1, 0.5, 0), actuated=True, range=(-1, 0.7)),
        Joint("u", "universal", ("4", "5"), (2, 0, 0), axes=((0, 1, 0), (0, 0, 1))),
        Joint("e", "revolute", ("5", "tip"), (2.5, 0, 0.2), (1, 0, 0.1), actuated=True),
    ]
    return Mechanism("mixed", joints, "tip", (3, 0.1, 0.2))


def feasible(mechanism: Mechanism, n: int, seed: int = 0, share: float = 0.95) -> Array:
    """Random coordinates (n, c) within ranges, deviations from home; up to 1 where there is none."""
    rng, bounds = np.random.default_rng(seed), []
    for joint in mechanism.joints:
        if joint.type == "cylindrical":
            bounds += list(joint.range)  # type: ignore[arg-type]
        elif joint.type == "universal":
            bounds += [(-1.0, 1.0)] * 2
        elif joint.type != "fixed":
            bounds.append(joint.range or (-1.0, 1.0))
    low, high = np.transpose(bounds)
    return share * rng.uniform(low, high, (n, len(bounds)))


def assert_reached(mechanism: Mechanism, answer: pf.Solution, targets: Array) -> None:
    assert (answer.status == Status.REACHED).all()
    position, rotation = model_of(mechanism).task.errors(product(mechanism, answer.q), targets)
    assert position.max() <= 1.1e-9 * mechanism.characteristic_length
    assert rotation.max() <= 1.1e-9


# --- the engine -------------------------------------------------------------------------------------------------------


def test_chains_and_trees_have_this_engine_and_loops_do_not() -> None:
    assert isinstance(engine_of(mixed()), ChainEngine)
    assert isinstance(engine_of(in_space(7, 1.0)), ChainEngine)
    gripper = Joint("g", "revolute", ("b3", "finger"), (1, 0, 0), (0, 0, 1), range=(-1, 1))
    tree = Mechanism("tree", (*in_space(7, 1.0).joints, gripper), "tip", (7, 0, 0))
    assert isinstance(engine_of(tree), ChainEngine)
    for name in ("stewart", "five_bar", "prs"):
        assert not isinstance(engine_of(pf.load(name)), ChainEngine)


def test_forward_kinematics_is_the_product_of_the_joints_motions() -> None:
    mechanism = in_space(12, 1.2)
    q = feasible(mechanism, FEW)
    answer = pf.solve_fk(mechanism, q)
    assert (answer.status == Status.REACHED).all()
    np.testing.assert_allclose(answer.pose, product(mechanism, q), atol=1e-13 * 12)
    np.testing.assert_allclose(
        pf.configuration(mixed(), feasible(mixed(), FEW)).pose, product(mixed(), feasible(mixed(), FEW)), atol=1e-13
    )


def test_actuators_beyond_their_ranges_are_clipped_one_by_one() -> None:
    mechanism = in_space(9, 0.5)
    values = np.random.default_rng(3).uniform(-0.8, 0.8, (FEW, 9))
    values[:, 4] = 0.7
    answer = pf.solve_fk(mechanism, values)
    clipped = np.clip(values, -0.5, 0.5)
    assert (answer.status == Status.PROJECTED).all()
    np.testing.assert_allclose(answer.actuators, clipped, atol=1e-9)
    np.testing.assert_allclose(answer.actuator_error, np.abs(clipped - values).max(axis=1), atol=1e-9)
    np.testing.assert_allclose(answer.pose, product(mechanism, clipped), atol=1e-8)


# --- within reach -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [7, 20, 60])
@pytest.mark.parametrize("task", [("x", "y", "z"), None, ("x", "y", "z", "tilt"), ("x", "y", "z", "yaw"), ("x", "z")])
def test_targets_of_feasible_configurations_are_reached_within_limits(n: int, task: tuple[str, ...] | None) -> None:
    mechanism = in_space(n, 4.0 / n, task)
    count = 3 if INTERPRETED else MANY // 2
    targets = product(mechanism, feasible(mechanism, count, n))
    answer = pf.solve_ik(mechanism, targets)
    assert_reached(mechanism, answer, targets)
    assert np.abs(answer.q).max() <= 4.0 / n + 1e-9


def test_slides_fixed_joints_and_joints_passed_backwards_are_solved() -> None:
    mechanism = mixed()
    targets = product(mechanism, feasible(mechanism, FEW, 5))
    answer = pf.solve_ik(mechanism, targets)
    assert_reached(mechanism, answer, targets)
    for name, low, high in (("a", -2, 2), ("b", -0.4, 0.5), ("d_back", -1, 0.7)):
        assert answer.joints[name].min() >= low - 1e-9
        assert answer.joints[name].max() <= high + 1e-9
    assert (np.abs(answer.joints["c"] - (0.1, -0.05)) <= np.array((1.1, 0.25)) + 1e-9).all()


def test_branches_beside_the_chain_stay_where_they_are() -> None:
    plain = in_space(7, 1.0)
    finger = Joint("g", "revolute", ("b3", "finger"), (1, 0, 0), (0, 0, 1), range=(-1, 1), actuated=True)
    tree = Mechanism("tree", (*plain.joints[:4], finger, *plain.joints[4:]), "tip", (7, 0, 0))
    targets = product(plain, feasible(plain, FEW))
    start = pf.configuration(tree, np.where(np.arange(8) == 4, 0.3, 0.0))
    answer = pf.solve_ik(tree, targets, start=start, options=pf.Options(working_mode="any"))
    assert (answer.status == Status.REACHED).all()
    np.testing.assert_array_equal(answer.joints["g"], 0.3)


def test_home_is_its_own_answer() -> None:
    for mechanism in (in_space(7, 1.0), planar(20, 0.2), mixed()):
        np.testing.assert_array_equal(pf.solve_ik(mechanism, mechanism.home_pose).q, 0.0)


def coned(n: int, kind: str, half_angle: float) -> Mechanism:
    """A hinge, then links in cones about the one before; the cones are fixed to one body or the other, by turns."""
    joints = [Joint("j0", "revolute", bodies(0, n), (0, 0, 0), (0, 0, 1), actuated=True, range=(-1, 1))]
    for i in range(1, n):
        body, after = bodies(i, n)
        outward = Cone((1, 0, 0), half_angle, body) if i < n - 1 else None
        axes = {"axes": ((0, 1, 0), (0, 0, 1))} if kind == "universal" else {}
        cone = outward if i % 2 else Cone((-1, 0, 0), half_angle, after)
        joints.append(Joint(f"j{i}", kind, (body, after), (i, 0, 0), cone=cone, **axes))  # type: ignore[arg-type]
    return Mechanism("cones", joints, "tip", (n, 0, 0), task=("x", "y", "z"))


@pytest.mark.parametrize("kind", ["spherical", "universal"])
def test_cones_are_kept_within_reach_and_beyond(kind: str) -> None:
    n, half = 8, 0.35
    mechanism, rng = coned(n, kind, half), np.random.default_rng(2)
    directions = rng.normal(size=(FEW, 3)) * (1, 1, 0.4) + (1.5, 0, 0)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    targets = directions * rng.uniform(5.0, 9.0, (FEW, 1))
    answer = pf.solve_ik(mechanism, targets)
    assert (answer.status <= Status.PROJECTED).all()
    points = np.stack([answer.points[f"j{i}"] for i in range(n)] + [answer.pose[:, :3, 3]], axis=1)
    links = np.diff(points, axis=1)
    np.testing.assert_allclose(np.linalg.norm(links, axis=2), 1.0, atol=1e-9)
    assert answer.limit_excess.max() <= 1e-9
    theirs = ClosureEngine(model_of(mechanism)).answer(pf.pose(targets), None, pf.Options(), keep_mode=False).rows
    assert (answer.position_error <= theirs.measures[:, 0] + 1e-6 * mechanism.characteristic_length).mean() >= 0.95
    assert (answer.status == Status.REACHED).sum() >= (theirs.status == Status.REACHED).sum()


# --- out of reach -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [2, 5, 30])
def test_a_planar_chain_without_limits_reaches_the_disc_and_points_at_what_is_beyond(n: int) -> None:
    mechanism, rng = planar(n), np.random.default_rng(1)
    angles, radii = rng.uniform(-np.pi, np.pi, FEW), rng.uniform(0.05, 2.0, FEW) * n
    targets = np.stack([radii * np.cos(angles), radii * np.sin(angles), 0 * radii], axis=1)
    answer = pf.solve_ik(mechanism, targets)
    np.testing.assert_allclose(answer.position_error, np.maximum(radii - n, 0.0), atol=1e-7 * n)
    np.testing.assert_array_equal(answer.status == Status.REACHED, radii <= n)


def test_two_links_of_unequal_length_stay_out_of_the_hole_between_them() -> None:
    joints = [
        Joint("a", "revolute", ("base", "1"), (0, 0, 0), (0, 0, 1), actuated=True),
        Joint("b", "revolute", ("1", "tip"), (3, 0, 0), (0, 0, 1), actuated=True),
    ]
    mechanism = Mechanism("two", joints, "tip", (4, 0, 0), task=("x", "y"))
    answer = ChainEngine(model_of(mechanism)).answer(
        pf.pose([(1.0, 0.5, 0.0), (0.0, -1.5, 0.0), (2.5, 0, 0)]), None, pf.Options(), keep_mode=False
    )
    np.testing.assert_allclose(answer.rows.measures[:, 0], (2.0 - np.hypot(1.0, 0.5), 0.5, 0.0), atol=1e-7)


def nearest_by_scipy(mechanism: Mechanism, target: Array, turning: float, starts: Array, most: float) -> float:
    """The least distance that bounded quasi-Newton searches find from several starts."""

    def squared(q: Array) -> float:
        position, rotation = model_of(mechanism).task.errors(product(mechanism, q[None]), target[None])
        return float(position[0] ** 2 + (turning * rotation[0]) ** 2)

    bounds = [(-most, most)] * starts.shape[1]
    return min(minimize(squared, q, bounds=bounds, method="L-BFGS-B").fun for q in starts) ** 0.5


@pytest.mark.skipif(INTERPRETED, reason="SciPy's searches take minutes beside interpreted kernels")
@pytest.mark.parametrize("task", [("x", "y", "z"), None])
def test_no_search_of_scipy_ends_nearer(task: tuple[str, ...] | None) -> None:
    n, most = 5, 0.6
    mechanism, rng = in_space(n, most, task), np.random.default_rng(8)
    targets = pf.pose(rng.uniform(-7, 7, (4, 3)), rotvec=rng.uniform(-1, 1, (4, 3)))
    answer, turning = pf.solve_ik(mechanism, targets, options=pf.Options(hold=None)), mechanism.rotation_length
    for target, own in zip(targets, np.hypot(answer.position_error, turning * answer.rotation_error), strict=True):
        other = nearest_by_scipy(mechanism, target, turning, feasible(mechanism, 5, 4), most)
        assert own <= other + 1e-6 * mechanism.characteristic_length


@pytest.mark.parametrize("hold", ["orientation", "position", None])
def test_projections_meet_the_conditions_of_a_minimum(hold: str | None) -> None:
    """In what a projection may still move, the distance has no slope but towards the limits."""
    mechanism, rng = in_space(7, 0.8), np.random.default_rng(6)
    targets = pf.pose(rng.uniform(-8, 8, (FEW, 3)), rotvec=rng.uniform(-1.5, 1.5, (FEW, 3)))
    answer = pf.solve_ik(mechanism, targets, options=pf.Options(hold=hold))  # type: ignore[arg-type]
    length, turning = mechanism.characteristic_length, mechanism.rotation_length
    np.testing.assert_allclose(product(mechanism, answer.q), answer.pose, atol=1e-12)
    checked = 0
    for row in np.flatnonzero(answer.status == Status.PROJECTED):
        q, held = answer.q[row], answer.held[row]

        def pose_of(q: Array) -> Array:
            return product(mechanism, q[None])[0]

        def components(q: Array, target: Array) -> tuple[Array, Array]:
            X = pose_of(q)
            return X[:3, 3] - target[:3, 3], Rotation.from_matrix(X[:3, :3] @ target[:3, :3].T).as_rotvec()

        steps = 1e-6 * np.eye(7)
        moved = [
            (np.array(components(q + h, targets[row])) - np.array(components(q - h, targets[row]))) / 2e-6
            for h in steps
        ]
        position, rotation = components(q, targets[row])
        slopes = np.array([m[0] @ position * (held != "position") for m in moved]) / length
        slopes += np.array([m[1] @ rotation * turning**2 * (held != "orientation") for m in moved]) / length
        at_low, at_high = q <= -0.8 + 1e-7, q >= 0.8 - 1e-7
        free = ~(at_low | at_high)
        rows = {"orientation": [m[1] for m in moved], "position": [m[0] for m in moved], None: np.zeros((7, 0))}[held]
        A = np.array(rows)
        if A.shape[1]:
            multipliers = np.linalg.lstsq(A[free], -slopes[free], rcond=None)[0]
            slopes = slopes + A @ multipliers
            if free.sum() <= 3:
                continue  # bounds and what is held leave nothing free: multipliers are not unique
        checked += 1
        assert np.abs(slopes[free]).max(initial=0.0) <= 1e-5
        assert slopes[at_low].min(initial=0.0) >= -1e-5
        assert slopes[at_high].max(initial=0.0) <= 1e-5
    assert checked >= (0 if INTERPRETED else FEW // 4)


def test_targets_on_the_border_are_reached_and_those_next_to_it_are_approached() -> None:
    """Of a plane chain without limits the border is a circle: there the target pulls as weakly as it is far."""
    n = 9
    mechanism = planar(n)
    directions = np.random.default_rng(4).normal(size=(FEW, 3)) * (1, 1, 0)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for beyond in (0.0, 1e-7, 1e-4, 1e-2):
        answer = pf.solve_ik(mechanism, (n + beyond) * directions)
        np.testing.assert_allclose(answer.position_error, beyond, atol=1e-8)
        np.testing.assert_allclose(product(mechanism, answer.q), answer.pose, atol=1e-12)


@pytest.mark.skipif(INTERPRETED, reason="the engine beside it takes minutes interpreted")
@pytest.mark.parametrize(
    ("n", "most", "task"), [(4, 1.0, ("x", "y", "z")), (7, 1.7, None), (7, 0.7, None), (20, 0.26, ("x", "y", "z"))]
)
def test_answers_are_hardly_ever_farther_than_those_in_joint_coordinates(
    n: int, most: float, task: tuple[str, ...] | None
) -> None:
    mechanism, rng = in_space(n, most, task), np.random.default_rng(n)
    targets = pf.pose(rng.uniform(-1.3 * n, 1.3 * n, (30, 3)), rotvec=rng.uniform(-2, 2, (30, 3)))
    answer = pf.solve_ik(mechanism, targets)
    theirs = ClosureEngine(model_of(mechanism)).answer(targets, None, pf.Options(), keep_mode=False).rows
    own, other = (
        np.hypot(rows.measures[:, 0], mechanism.rotation_length * rows.measures[:, 1])
        for rows in (answer._rows, theirs)
    )
    assert ((answer._rows.holds != theirs.holds) | (own > other + 1e-6 * mechanism.characteristic_length)).sum() <= 2
    assert (answer.status == Status.REACHED).sum() >= (theirs.status == Status.REACHED).sum()


# --- starts and paths -------------------------------------------------------------------------------------------------


def test_a_path_is_followed_without_a_jump() -> None:
    mechanism = in_space(12, 0.6)
    q = 0.4 * np.sin(np.linspace(0, 4, 200)[:, None] + np.arange(12))
    path = product(mechanism, q)
    found = pf.track(mechanism, path, start=q[0])
    assert_reached(mechanism, found, path)
    assert np.abs(np.diff(found.q, axis=0)).max() < 0.1


def test_a_path_out_of_reach_and_back_ends_where_the_target_is() -> None:
    mechanism = in_space(9, 0.5, ("x", "y", "z"))
    x = np.concatenate([np.linspace(7, 11, 30), np.linspace(11, 7, 30)])
    path = np.stack([x, 0 * x + 1.0, 0 * x + 0.5], axis=1)
    found = pf.track(mechanism, path, start=pf.solve_ik(mechanism, path[0]))
    away = np.linalg.norm(path, axis=1) - 9.0
    assert ((found.status == Status.PROJECTED) == (found.position_error > 1e-8)).all()
    assert (found.position_error >= away - 1e-9).all()
    assert found.status[-1] == Status.REACHED


def test_a_start_is_kept_near_where_the_target_is_near() -> None:
    mechanism = in_space(7, 1.5)
    q = feasible(mechanism, FEW, 7, 0.6)
    targets = product(mechanism, q)
    targets[:, :3, 3] += 0.01
    answer = pf.solve_ik(mechanism, targets, start=q)
    assert (np.abs(answer.q - q).max(axis=1)[answer.status == Status.REACHED] < 0.5).mean() >= 0.95


# --- as anywhere else -------------------------------------------------------------------------------------------------


def test_a_machine_moved_and_scaled_gives_the_same_angles() -> None:
    plain, scale = in_space(8, 0.7), 250.0
    turn = Rotation.from_rotvec((0.3, -0.8, 0.5)).as_matrix()
    shift = np.array((40.0, -3.0, 12.0))
    joints = [
        Joint(
            j.name,
            "revolute",
            j.connects,
            turn @ (scale * np.array(j.at)) + shift,
            turn @ j.axis,
            actuated=True,
            range=j.range,
        )  # type: ignore[arg-type]
        for j in plain.joints
    ]
    other = Mechanism("moved", joints, "tip", turn @ (scale * np.array(plain.reference_point)) + shift)
    targets = product(plain, feasible(plain, FEW, 3))
    moved = targets.copy()
    moved[:, :3, 3] = (turn @ (scale * targets[:, :3, 3, None]))[..., 0] + shift
    moved[:, :3, :3] = turn @ targets[:, :3, :3] @ turn.T
    np.testing.assert_allclose(pf.solve_ik(other, moved).q, pf.solve_ik(plain, targets).q, atol=1e-6)


def test_the_forward_jacobian_is_the_slope_of_the_product() -> None:
    mechanism = in_space(11, 1.0)
    q = feasible(mechanism, 3, 9)
    jacobian = pf.forward_jacobian(pf.configuration(mechanism, q))
    for row, values in enumerate(q):
        for column in range(11):
            h = 1e-6 * (np.arange(11) == column)
            ahead, behind = product(mechanism, np.stack([values + h, values - h]))
            turn = Rotation.from_matrix(ahead[:3, :3] @ behind[:3, :3].T).as_rotvec() / 2e-6
            slope = np.concatenate([(ahead - behind)[:3, 3] / 2e-6, turn])
            np.testing.assert_allclose(jacobian[row, :, column], slope, atol=1e-7)
    inverse = pf.inverse_jacobian(pf.configuration(mechanism, q))
    np.testing.assert_allclose(jacobian @ inverse, np.tile(np.eye(6), (3, 1, 1)), atol=1e-9)


@pytest.mark.skipif(INTERPRETED, reason="a thousand joints take long in plain Python")
def test_a_thousand_hinges_are_answered_in_milliseconds() -> None:
    """The engine in joint coordinates takes twenty seconds for one."""
    n, most = 999, np.radians(6.0)
    mechanism = in_space(n, most, ("x", "y", "z"))
    s = np.linspace(0, 1, n)
    q = 0.6 * most * np.stack([np.sin(k + 5 * s) * np.cos(k * s) for k in range(20)])
    targets = product(mechanism, q)
    pf.solve_ik(mechanism, targets[:1])
    began = time.process_time()
    answer = pf.solve_ik(mechanism, targets)
    assert time.process_time() - began < 20 * 0.05
    assert (answer.status == Status.REACHED).all()
    assert np.abs(answer.q).max() <= most + 1e-9
    np.testing.assert_allclose(product(mechanism, answer.q)[:, :3, 3], targets[:, :3, 3], atol=1e-9 * n)
