"""Routines of the search on poses, as plain Python: slopes of distances, the Lagrangian, limits that are weighed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from machines import machine, published
from pfabrik.engines.joints.placed_links import links_on_paths
from pfabrik.engines.pose.carriages import stays_there
from pfabrik.engines.pose.links_of_legs import links_of_legs
from pfabrik.engines.pose.table import kernel_table
from pfabrik.kernels.clearance.link_limits import new_link_limits, pair_excess
from pfabrik.kernels.clearance.link_records import NO_LINKS, LinkLimits
from pfabrik.kernels.holding import limit_multipliers
from pfabrik.kernels.joints import path_kinematics
from pfabrik.kernels.joints.descend import move
from pfabrik.kernels.joints.loops import BALL, BASE_AXES, PoseObjective
from pfabrik.kernels.joints.path_kinematics import LAYOUT, new_equations, new_state
from pfabrik.kernels.pose import equations as E
from pfabrik.kernels.pose import limits
from pfabrik.kernels.pose.linearise import lagrangian_gradient, note_involved
from pfabrik.kernels.pose.nearest import NO_STARTS, new_nearest_scratch
from pfabrik.kernels.pose.search import new_search_scratch
from pfabrik.kernels.pose.search_records import SETTINGS, MultistartPlan, PlatformObjective
from pfabrik.machine.decomposition.leg_table import LegTable
from pfabrik.machine.model import model_of

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

STEP = 1e-6


def moved(state: E.PlatformState, unknown: int, step: float, columns: np.ndarray) -> E.PlatformState:
    """A configuration with one unknown changed: along an axis, about an axis, or of a proximal or redundant joint."""
    pose, q = state.pose.copy(), state.q.copy()
    if unknown < 3:
        pose[unknown, 3] += step
    elif unknown < 6:
        pose[:3, :3] = Rotation.from_rotvec(step * np.eye(3)[unknown - 3]).as_matrix() @ pose[:3, :3]
    else:
        q[columns == unknown] += step
    return E.PlatformState(pose, q, state.sides)


def random_configuration(mechanism: pf.Mechanism, table: LegTable, rng: np.random.Generator) -> E.PlatformState:
    """A random configuration about home; loops may be open."""
    state = E.new_platform_state(len(table.legs))
    state.sides[:], state.q[:] = table.home_sides[0], rng.uniform(-0.3, 0.3, len(table.legs))
    state.pose[:] = pf.pose(
        mechanism.home_pose[:3, 3] / mechanism.characteristic_length + rng.uniform(-0.1, 0.1, 3),
        rotvec=rng.uniform(-0.2, 0.2, 3),
    )
    return state


@pytest.mark.parametrize("name", ["stewart", "nrpm", "Par4"])
def test_legs_without_multipliers_have_no_part_in_the_lagrangian(name: str) -> None:
    """The gradient from legs with multipliers, and what carries them, equals that from all legs."""
    mechanism, rng = machine(name), np.random.default_rng(1)
    legs = model_of(mechanism).legs
    table = kernel_table(legs)
    search, n = new_search_scratch(table, NO_LINKS), E.count_unknowns(table)
    objective = PoseObjective(mechanism.home_pose[None], np.ones(6), BASE_AXES, 0, 0.0, 0.0, 0.0, 1e-6, 10)
    objective = PlatformObjective(objective, np.zeros((0, len(table.driven))), 0)
    search.target[:] = random_configuration(mechanism, legs, rng).pose
    search.gradient.unit[0] = 1.0
    limits, rows = 2 * len(table.limited) + len(table.cones), len(search.leg_eval.rows)
    n_involved = set()
    for index in range(limits + rows):
        E.evaluate_legs(table, random_configuration(mechanism, legs, rng), search.leg_eval)
        E.put_slopes(table, search.leg_eval)
        search.hessian.multipliers[:], search.equation_multipliers[:] = 0.0, 0.0
        if index < limits:
            search.hessian.multipliers[index] = 1.0
        else:
            search.equation_multipliers[index - limits] = 1.0
        state, gradient, full_gradient = random_configuration(mechanism, legs, rng), np.zeros(n), np.zeros(n)
        note_involved(table, objective, search)
        n_involved.add(int(search.involved.sum()))
        lagrangian_gradient(table, 0, objective, state, search, gradient)
        search.involved[:] = 1
        lagrangian_gradient(table, 0, objective, state, search, full_gradient)
        np.testing.assert_allclose(gradient, full_gradient, rtol=0, atol=1e-12)
    assert min(n_involved) < len(table.legs)


def with_thin_links(name: str) -> pf.Mechanism:
    """A machine with a thin capsule between the joints of every link, a ball and a box on its base and platform."""
    machine = pf.load(name)
    length = machine.characteristic_length
    shapes = [pf.Shape(machine.base, "box", at=(2 * length, 0, 0), size=(0.3 * length, 0.2 * length, 0.1 * length))]
    if not machine.end_effector_is_joint:
        shapes.append(pf.Shape(machine.end_effector, "sphere", at=machine.reference_point, diameter=1e-3 * length))
    for body in machine.bodies:
        centred = [joint for joint in machine.joints if body in joint.connects and joint.at is not None]
        if body not in (machine.base, machine.end_effector) and len(centred) == 2:
            shapes.append(pf.Shape(body, thickness=1e-3 * length))
    return machine.with_shapes(shapes).with_clearance(1e-3 * length)


def excesses_of(links: LinkLimits) -> np.ndarray:
    return np.array([pair_excess(links, pair, np.inf) for pair in range(len(links.pairs))])


@pytest.mark.parametrize("name", ["five_bar", "delta", "hexaglide"])
def test_slopes_of_distances_of_links_are_their_differences(name: str) -> None:
    """In the platform's pose with proximal joints, and in joint coordinates; on cranks, carriages and rods."""
    mechanism, rng = with_thin_links(name), np.random.default_rng(4)
    legs = model_of(mechanism).legs
    table, links = kernel_table(legs), new_link_limits(links_of_legs(model_of(mechanism)))
    assert len(links.pairs) > 2
    leg_eval = E.new_leg_evaluation(table)

    def at_poses(state: E.PlatformState) -> np.ndarray:
        E.evaluate_legs(table, state, leg_eval)
        limits.place_links(table, links, leg_eval.frames, leg_eval.values)
        return excesses_of(links)

    state = random_configuration(mechanism, legs, rng)
    slopes = np.zeros((len(links.pairs), E.count_unknowns(table)))
    for pair, excess in enumerate(at_poses(state)):
        pair_excess(links, pair, np.inf)
        limits.add_pair_slope(table, links, pair, excess, 1.0, leg_eval, slopes[pair])
    for unknown in range(slopes.shape[1]):
        ends = [at_poses(moved(state, unknown, sign * STEP, table.columns)) for sign in (1.0, -1.0)]
        np.testing.assert_allclose(slopes[:, unknown], (ends[0] - ends[1]) / (2.0 * STEP), atol=1e-6)

    limits_on_paths, ways = links_on_paths(mechanism)
    links, eq, n = new_link_limits(limits_on_paths), new_equations(ways, LAYOUT), len(ways.lo)

    def at_joints(step: np.ndarray) -> np.ndarray:
        joints = new_state(ways)
        joints.balls[ways.kinds == BALL, 0] = 1.0
        move(ways, random, 1.0, joints)
        move(ways, step, 1.0, joints)
        path_kinematics.place_links(ways, joints, eq, links)
        return excesses_of(links)

    random, slopes = 0.1 * rng.normal(size=n), np.zeros((len(links.pairs), n))
    for pair, excess in enumerate(at_joints(np.zeros(n))):
        pair_excess(links, pair, np.inf)
        path_kinematics.add_pair_slope(ways, links, pair, excess, 1.0, eq, slopes[pair])
    for column in range(n):
        ends = [at_joints(sign * STEP * np.eye(n)[column]) for sign in (1.0, -1.0)]
        np.testing.assert_allclose(slopes[:, column], (ends[0] - ends[1]) / (2.0 * STEP), atol=1e-6)


def test_limits_are_weighed_in_more_motions_than_there_are_limits() -> None:
    """For an arm with one limit: scratch memory suffices, and the multiplier is the pull along the limit."""
    table = model_of(published.planar_arm()).legs
    settings = np.zeros(1, SETTINGS)
    plan = MultistartPlan(np.zeros((1, 6)), settings, NO_STARTS, stays_there(table), NO_LINKS)
    scratch = new_nearest_scratch(kernel_table(table), plan, weighs_limits=True)
    linear = scratch.search.first.linear
    n = len(linear.g)
    assert len(linear.h) < n
    linear.metric[:] = np.eye(n)
    linear.totals["motions"], linear.totals["limits"] = n, 1
    linear.g[:], linear.G[0], linear.h[0] = -3.0, np.eye(n)[0], 0.0
    assert limit_multipliers(linear, 1e-6, scratch.p, scratch.natural_gradients) == 1
    assert scratch.p.x[0] == pytest.approx(3.0)
