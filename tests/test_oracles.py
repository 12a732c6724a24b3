"""The oracles themselves: against home, hand-made cases, published tables and brute force."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial.transform import Rotation

import pfabrik as pf
from oracles import closed_forms as oracles
from pfabrik.description.mechanism import Mechanism

NAMES = ("five_bar", "stewart", "nrpm")
CIRCLES = {"five_bar": (200.0, 60.0), "stewart": (220.0, 60.0), "nrpm": (200.0, 100.0)}
"""Height of the centre and radius [mm] of the circles in the plane x = 0 that the machines are to follow."""


def circle(name: str) -> oracles.Array:
    """360 level targets, one a degree, from the top of the machine's circle by way of +y; ``(360, 4, 4)``."""
    height, radius = CIRCLES[name]
    angle = np.radians(np.arange(360))
    return oracles.poses(np.stack([0 * angle, radius * np.sin(angle), height + radius * np.cos(angle)], axis=1))


def sample(name: str, n: int) -> tuple[Mechanism, oracles.Array]:
    mechanism = pf.load(name)
    return mechanism, oracles.random_targets(mechanism, np.random.default_rng(20), n)


# --- home and the circles --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_home_is_well_inside_every_limit(name: str) -> None:
    mechanism = pf.load(name)
    home = oracles.poses(np.array([mechanism.reference_point]))
    assert oracles.margin(mechanism, home)[0] > 0.2


def test_home_has_the_home_coordinates() -> None:
    five_bar, stewart = pf.load("five_bar"), pf.load("stewart")
    assert oracles.actuators(five_bar, oracles.poses(np.array([[0.0, 0, 175]])))[0] == pytest.approx([0, 0], abs=1e-12)
    assert oracles.actuators(stewart, oracles.poses(np.array([[0.0, 0, 195]])))[0] == pytest.approx([205] * 6)


@pytest.mark.parametrize("name", NAMES)
def test_circle_leaves_the_workspace_on_one_upper_arc(name: str) -> None:
    outside = ~oracles.reachable(pf.load(name), circle(name))
    assert outside[0]
    assert np.count_nonzero(outside != np.roll(outside, 1)) == 2
    assert 0.15 < outside.mean() < 0.40
    assert not outside[90:271].any()


def test_five_bar_has_one_working_mode_everywhere() -> None:
    mechanism, targets = sample("five_bar", 2000)
    modes = oracles.working_mode_margins(mechanism, np.concatenate([targets, circle("five_bar")]))
    assert (modes[:, 1:] < 0).all()


def test_nrpm_follows_the_reachable_arc_without_a_jump_of_its_arms() -> None:
    mechanism = pf.load("nrpm")
    arc = circle("nrpm")[oracles.reachable(mechanism, circle("nrpm"))]
    arc = arc[np.argsort(np.arctan2(arc[:, 1, 3], 200.0 - arc[:, 2, 3]))][::4]
    for leg in "123":
        feasible = arm_slack(mechanism, leg, arc, *arm_grid(mechanism, leg, 41)) >= 0
        parts, _ = ndimage.label(feasible, structure=np.ones((3, 3, 3)))
        common = set(np.unique(parts[0])) & set(np.unique(parts[-1])) - {0}
        assert any((parts == part).any(axis=(1, 2)).all() for part in common)


# --- coordinates and limits ------------------------------------------------------------------------------------------


def test_five_bar_coordinates_put_the_tip_on_the_target() -> None:
    mechanism = pf.load("five_bar")
    targets = oracles.inside_targets(mechanism, np.random.default_rng(1), 200)
    turns = oracles.actuators(mechanism, targets)
    tips = targets[:, :3, 3]
    for column, (shoulder, elbow) in enumerate((("p1", "p2"), ("p5", "p4"))):
        base, joint = np.array(mechanism.joint(shoulder).at), np.array(mechanism.joint(elbow).at)
        turned = base + Rotation.from_rotvec(turns[:, column, None] * [1.0, 0.0, 0.0]).apply(joint - base)
        assert np.linalg.norm(tips - turned, axis=1) == pytest.approx(145.0, abs=1e-9)


@pytest.mark.parametrize("bend, inside", [(10.001, True), (9.999, False)])
def test_five_bar_elbow_bound_is_tested_on_both_sides(bend: float, inside: bool) -> None:
    reach = np.sqrt(110**2 + 145**2 + 2 * 110 * 145 * np.cos(np.radians(bend)))
    tip = np.array([[0.0, 0.0, np.sqrt(reach**2 - 50**2)]])
    assert oracles.reachable(pf.load("five_bar"), oracles.poses(tip))[0] == inside


@pytest.mark.parametrize("offset, inside", [(0.0, True), (1e-3, False)])
def test_five_bar_cannot_leave_its_plane(offset: float, inside: bool) -> None:
    assert oracles.reachable(pf.load("five_bar"), oracles.poses(np.array([[offset, 0.0, 180.0]])))[0] == inside


def test_five_bar_without_limits_has_four_working_modes_within_reach_only() -> None:
    mechanism = pf.load("five_bar").without_limits()
    heights = np.sqrt(255.0**2 - 50.0**2) + np.array([-1e-6, 1e-6])
    modes = oracles.working_mode_margins(mechanism, oracles.poses(np.array([[0.0, 0.0, z] for z in heights])))
    assert (modes[0] > 0).all()
    assert (modes[1] < 0).all()


@pytest.mark.parametrize("height, inside", [(269.0, True), (273.0, False)])
def test_stewart_stroke_bound_is_tested_on_both_sides(height: float, inside: bool) -> None:
    # straight up, a strut spans 60 and 20 mm sideways: 280 mm of length are 272.76 mm of height
    assert oracles.reachable(pf.load("stewart"), oracles.poses(np.array([[0.0, 0.0, height]])))[0] == inside


@pytest.mark.parametrize("margin_deg", [0.01, -0.01])
def test_stewart_platform_cone_is_tested_on_both_sides(margin_deg: float) -> None:
    """With the strokes free, tilting the platform about the joint CL1 brings that joint to its cone's edge."""
    mechanism = pf.load("stewart")
    free = {j.name: None for j in mechanism.joints if j.name != "CL1" and (j.range or j.cone)}
    mechanism = mechanism.with_limits(free)
    head = np.array([40.0, 40.0, 195.0])
    strut = np.array([60.0, -20.0, -195.0])
    axis = np.cross(strut, [0.0, 0.0, 1.0])
    tilt = Rotation.from_rotvec(axis / np.linalg.norm(axis) * np.radians(45.0 - margin_deg))
    position = head - tilt.apply(head - np.array([0.0, 0.0, 195.0]))
    target = oracles.poses(position[None], tilt.as_matrix()[None])
    assert oracles.reachable(mechanism, target)[0] == (margin_deg > 0)


@pytest.mark.parametrize("name", NAMES)
def test_turning_a_machine_over_does_not_change_its_margins(name: str) -> None:
    mechanism, targets = sample(name, 100)
    turn, shift = Rotation.from_rotvec([0.4, -1.1, 2.0]), np.array([30.0, -20.0, 50.0])
    turned = moved(mechanism, turn, shift)
    R = turn.as_matrix()
    positions = targets[:, :3, 3] @ R.T + shift
    there = oracles.poses(positions, R @ targets[:, :3, :3] @ R.T)
    assert oracles.margin(turned, there) == pytest.approx(oracles.margin(mechanism, targets), abs=1e-7)


@pytest.mark.parametrize("name", ["five_bar", "nrpm"])
def test_naming_the_bodies_of_a_joint_the_other_way_round_reverses_its_coordinate(name: str) -> None:
    mechanism = pf.load(name)
    targets = oracles.inside_targets(mechanism, np.random.default_rng(2), 20)
    reversed_ = dataclasses.replace(mechanism, joints=tuple(map(other_way_round, mechanism.joints)))
    assert oracles.margin(reversed_, targets) == pytest.approx(oracles.margin(mechanism, targets), abs=1e-8)
    own = [k for k, key in enumerate(mechanism.actuator_names) if mechanism.joint(key).along is None]
    there, here = oracles.actuators(reversed_, targets)[:, own], oracles.actuators(mechanism, targets)[:, own]
    assert there == pytest.approx(-here, abs=1e-4)


def moved(mechanism: Mechanism, turn: Rotation, shift: oracles.Array) -> Mechanism:
    """The same machine elsewhere."""

    def point(value: tuple[float, ...] | None) -> tuple[float, ...] | None:
        return None if value is None else tuple(turn.apply(value) + shift)

    def vector(value: tuple[float, ...] | None) -> tuple[float, ...] | None:
        return None if value is None else tuple(turn.apply(value))

    joints = tuple(
        dataclasses.replace(
            joint,
            at=point(joint.at),
            axis=vector(joint.axis),
            axes=joint.axes and tuple(map(vector, joint.axes)),
            cone=joint.cone and dataclasses.replace(joint.cone, axis=vector(joint.cone.axis)),
        )
        for joint in mechanism.joints
    )
    return dataclasses.replace(mechanism, joints=joints, reference_point=point(mechanism.reference_point))


def other_way_round(joint: pf.mechanism.Joint) -> pf.mechanism.Joint:
    """A joint with an axis, seen from its second body: the coordinate changes its sign."""
    if joint.axis is None:
        return joint
    limits = joint.range and (-joint.range[1], -joint.range[0])
    return dataclasses.replace(joint, connects=joint.connects[::-1], home=-joint.home, range=limits)


# --- published leg lengths -------------------------------------------------------------------------------------------

HEXAPOD_BASE = np.array(
    [
        [2.57940852063914, 0.797904557985617, 0.0],
        [1.98070987733051, 1.83488102661872, 0.0],
        [-1.98070987733051, 1.83488102661872, 0.0],
        [-2.57940852063914, 0.797904557985617, 0.0],
        [-0.598698643308632, -2.63278558460434, 0.0],
        [0.598698643308631, -2.63278558460434, 0.0],
    ]
)
HEXAPOD_PLATFORM = np.array(
    [
        [0.955336489125606, -0.29552020666134, 0.0],
        [0.221740238262456, 0.975105772075681, 0.0],
        [-0.221740238262455, 0.975105772075681, 0.0],
        [-0.955336489125606, -0.295520206661339, 0.0],
        [-0.733596250863151, -0.679585565414341, 0.0],
        [0.73359625086315, -0.679585565414341, 0.0],
    ]
)
HEXAPOD_LENGTHS = [
    ((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), (3.5823, 3.5823, 3.5823, 3.5823, 3.5823, 3.5823)),
    ((0.0, 0.0, 2.5), (0.0, 0.0, 0.3), (3.0629, 3.3441, 3.0629, 3.3441, 3.0629, 3.3441)),
    ((0.0, 0.0, 2.5), (0.0, 0.2, 0.0), (3.0385, 3.1433, 3.2126, 3.3362, 3.2908, 3.0614)),
    ((0.0, 0.0, 2.5), (0.2, 0.2, 0.0), (2.9993, 3.2785, 3.3903, 3.2822, 3.1948, 2.9688)),
    ((0.0, 0.0, 2.5), (0.2, 0.0, 0.2), (3.0446, 3.4353, 3.2588, 3.2356, 2.993, 3.19)),
]
"""Position, roll-pitch-yaw about fixed axes [rad], lengths. Source: conroy-cheers/hexapod_kinematics,
test/test_kinematics.cpp at 29dc065; printed to four decimals."""


@pytest.mark.parametrize("position, rpy, lengths", HEXAPOD_LENGTHS)
def test_leg_lengths_agree_with_a_published_hexapod(
    position: tuple[float, ...], rpy: tuple[float, ...], lengths: tuple[float, ...]
) -> None:
    target = oracles.poses(np.array([position]), Rotation.from_euler("xyz", [rpy]).as_matrix())
    assert oracles.leg_lengths(HEXAPOD_BASE, HEXAPOD_PLATFORM, target)[0] == pytest.approx(lengths, abs=6e-5)


def test_stewart_actuators_are_the_leg_lengths_of_its_joint_positions() -> None:
    mechanism, targets = sample("stewart", 50)
    along = [mechanism.joint(name).along for name in mechanism.actuator_names]
    base = np.array([mechanism.joint(foot).at for foot, _ in along])
    platform = np.array([mechanism.joint(head).at for _, head in along]) - np.array(mechanism.reference_point)
    assert oracles.actuators(mechanism, targets) == pytest.approx(oracles.leg_lengths(base, platform, targets))


# --- the redundant mechanism against brute force ---------------------------------------------------------------------


def arm_slack(
    mechanism: Mechanism, leg: str, targets: oracles.Array, phi: oracles.Array, d: oracles.Array
) -> oracles.Array:
    """Smallest slack of an NRPM arm, ``(n, *phi.shape)``, from the positions of its joints step by step."""
    hinge, slide = mechanism.joint("A" + leg), mechanism.joint("B" + leg)
    pivot = np.array(hinge.at)
    swing = Rotation.from_rotvec((phi.ravel() - hinge.home)[:, None] * np.array(hinge.axis))
    slacks = [share_of_range(phi, hinge.range), share_of_range(d, slide.range)]
    for side in "LR":
        foot, head = mechanism.joint(f"C{side}{leg}"), mechanism.joint(f"E{side}{leg}")
        start = np.array(foot.at) - pivot + (d.ravel() - slide.home)[:, None] * np.array(slide.axis)
        feet = (pivot + swing.apply(start)).reshape(*phi.shape, 3)
        foot_axes = swing.apply(foot.cone.axis).reshape(*phi.shape, 3)
        arm = np.array(head.at) - np.array(mechanism.reference_point)
        heads = targets[:, :3, :3] @ arm + targets[:, :3, 3]
        head_axes = targets[:, :3, :3] @ np.array(head.cone.axis)
        spread = (len(targets),) + (1,) * phi.ndim + (3,)
        lines = heads.reshape(spread) - feet
        slacks.append(share_of_range(np.linalg.norm(lines, axis=-1), mechanism.joint(f"D{side}{leg}").range))
        slacks.append(1 - angle(foot_axes, lines) / foot.cone.half_angle)
        slacks.append(1 - angle(head_axes.reshape(spread), -lines) / head.cone.half_angle)
    return np.min(np.broadcast_arrays(*slacks), axis=0)


def arm_grid(mechanism: Mechanism, leg: str, n: int) -> tuple[oracles.Array, oracles.Array]:
    """Angles and extensions, ``(n, n)`` each, over the arm's ranges."""
    ranges = (mechanism.joint("A" + leg).range, mechanism.joint("B" + leg).range)
    phi, d = np.meshgrid(*(np.linspace(*limits, n) for limits in ranges), indexing="ij")
    return phi, d


def share_of_range(value: oracles.Array, limits: tuple[float, float]) -> oracles.Array:
    return np.minimum(value - limits[0], limits[1] - value) / (limits[1] - limits[0])


def angle(first: oracles.Array, second: oracles.Array) -> oracles.Array:
    return np.arctan2(np.linalg.norm(np.cross(first, second), axis=-1), (first * second).sum(axis=-1))


def best_by_hand(mechanism: Mechanism, leg: str, target: oracles.Array) -> float:
    """Largest slack of an arm at one target: a fine grid, then a random search from its five highest local maxima."""
    phi, d = arm_grid(mechanism, leg, 121)
    values = arm_slack(mechanism, leg, target[None], phi, d)[0]
    peaks = np.flatnonzero(values == ndimage.maximum_filter(values, size=5))
    starts = peaks[np.argsort(-values.flat[peaks])][:5]
    return max(climbed(mechanism, leg, target, np.array([phi.flat[k], d.flat[k]])) for k in starts)


def climbed(mechanism: Mechanism, leg: str, target: oracles.Array, start: oracles.Array) -> float:
    """Slack reached from a start by the best of 400 random points in a window that follows and shrinks."""
    rng = np.random.default_rng(0)
    low, high = np.array([mechanism.joint(name + leg).range for name in "AB"]).T
    window, place, best = (high - low) / 60, start, -np.inf
    for _ in range(120):
        points = np.clip(place + window * rng.uniform(-1, 1, (400, 2)), low, high)
        values = arm_slack(mechanism, leg, target[None], *points.T)[0]
        if values.max() > best:
            place, best = points[values.argmax()], float(values.max())
        window = 0.88 * window
    return best


def test_nrpm_margin_is_never_below_what_brute_force_finds() -> None:
    mechanism, targets = sample("nrpm", 300)
    grids = [arm_slack(mechanism, leg, targets, *arm_grid(mechanism, leg, 41)).max(axis=(1, 2)) for leg in "123"]
    found, margins = np.min(grids, axis=0), oracles.margin(mechanism, targets)
    assert (margins >= found - oracles.ACCURACY).all()
    near = np.abs(margins) < 0.3
    assert near.sum() > 100
    assert (margins - found)[near].max() < 0.1


def test_nrpm_margin_agrees_with_another_search_near_the_boundary() -> None:
    mechanism, targets = sample("nrpm", 200)
    margins = oracles.margin(mechanism, targets)
    nearest = np.argsort(np.abs(margins))[:8]
    by_hand = [min(best_by_hand(mechanism, leg, targets[k]) for leg in "123") for k in nearest]
    assert margins[nearest] == pytest.approx(by_hand, abs=oracles.ACCURACY)


def test_nrpm_margin_does_not_depend_on_how_finely_it_is_searched() -> None:
    mechanism, targets = sample("nrpm", 100)
    finer = [oracles._best_arm(arm, targets, cells=240, peaks=6, steps=55)[0] for arm in oracles.arms(mechanism)]
    assert oracles.margin(mechanism, targets) == pytest.approx(np.min(finer, axis=0), abs=oracles.ACCURACY)


def test_nrpm_actuators_attain_the_margin() -> None:
    mechanism = pf.load("nrpm")
    targets = oracles.inside_targets(mechanism, np.random.default_rng(5), 30)
    values = dict(zip(mechanism.actuator_names, oracles.actuators(mechanism, targets).T, strict=True))
    attained = [
        [arm_slack(mechanism, leg, targets[k : k + 1], values["A" + leg][k], values["B" + leg][k])[0] for leg in "123"]
        for k in range(len(targets))
    ]
    assert np.min(attained, axis=1) == pytest.approx(oracles.margin(mechanism, targets), abs=1e-7)


# --- targets ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_random_targets_are_on_both_sides_of_the_boundary(name: str) -> None:
    mechanism, targets = sample(name, 400)
    margins = oracles.margin(mechanism, targets)
    assert np.isfinite(margins).all()
    assert 0.2 < (margins > 0).mean() < 0.8
    assert np.abs(targets[:, :3, 3]).max() > 1000.0


@pytest.mark.parametrize("name", NAMES)
def test_inside_targets_are_inside(name: str) -> None:
    mechanism = pf.load(name)
    targets = oracles.inside_targets(mechanism, np.random.default_rng(3), 50, least=0.02)
    assert targets.shape == (50, 4, 4)
    assert (oracles.margin(mechanism, targets) >= 0.02).all()
