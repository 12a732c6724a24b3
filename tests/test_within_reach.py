"""What is within reach is reached before anything is held, and no answer is farther from its target than its start."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import INTERPRETED, gap_of_joints
from pfabrik import Joint, Mechanism, Options, Status

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")


def h4_on_rails() -> Mechanism:
    """Four carriages along x, in pairs; each pair holds a bar by two parallelograms, and the bars carry the platform.

    Where a parallelogram folds, its bar may turn: a constraint singularity.
    """
    joints, down = [], -400.0
    for i, (rail, reach, bar) in enumerate(
        [(220.0, 170.0, "front"), (-120.0, -90.0, "front"), (-220.0, -170.0, "back"), (120.0, 90.0, "back")]
    ):
        sign = 1.0 if bar == "front" else -1.0
        foot, head = np.array([rail, sign * 330.0, 0.0]), np.array([rail - reach, sign * 100.0, down])
        across = 28.0 * np.cross((0, 0, 1), head - foot) / np.hypot(*(head - foot)[:2])
        cart = f"cart{i}"
        joints.append(
            Joint(f"A{i}", "prismatic", ("base", cart), foot, (1, 0, 0), actuated=True, range=(-140.0, 140.0))
        )
        for side in (-1.0, 1.0):
            rod = f"rod{i}{'L' if side < 0 else 'R'}"
            joints.append(Joint(f"B{rod}", "spherical", (cart, rod), foot + side * across))
            joints.append(Joint(f"C{rod}", "spherical", (rod, bar), head + side * across))
    joints.append(Joint("Q1", "revolute", ("front", "platform"), (30.0, 85.0, down), (0, 0, 1), range=(-1.1, 1.1)))
    joints.append(Joint("Q2", "revolute", ("back", "platform"), (-30.0, -70.0, down), (0, 0, 1)))
    return Mechanism("H4 on rails", joints, "platform", (0, 0, down))


def around(mechanism: Mechanism, n: int, seed: int) -> np.ndarray:
    """Poses (n, 4, 4) around home, most of them out of reach: they lean, and the platform does not."""
    rng, poses = np.random.default_rng(seed), np.tile(mechanism.home_pose, (n, 1, 1))
    poses[:, :3, 3] += rng.uniform(-0.8, 0.8, (n, 3)) * mechanism.characteristic_length
    poses[:, :3, :3] = Rotation.from_rotvec(rng.uniform(-1.0, 1.0, (n, 3)) * (0.3, 0.3, 1.0)).as_matrix()
    return poses


def test_poses_near_a_constraint_singularity_are_reached_with_an_orientation_held_or_not() -> None:
    """They are poses of configurations whose loops are closed; all but a few of a hundred are found."""
    mechanism = h4_on_rails()
    count = 3 if INTERPRETED else 150
    found = pf.solve_ik(mechanism, around(mechanism, count, 5), options=Options(hold=None))
    own = pf.configuration(mechanism, found.q)
    assert (own.status == Status.REACHED).all()
    assert max(gap_of_joints(mechanism, own)) <= 1e-6
    for hold in ("orientation", None):
        again = pf.solve_ik(mechanism, own.pose, options=Options(hold=hold))
        assert (again.status != Status.REACHED).sum() <= 0.02 * count


def test_an_answer_costs_no_more_than_its_start() -> None:
    """Its distance and the price of what it gives way, that is."""
    mechanism = h4_on_rails()
    count = 2 if INTERPRETED else 30
    length, turning = mechanism.characteristic_length, mechanism.rotation_length
    starts = pf.solve_ik(mechanism, around(mechanism, count, 5), options=Options(hold=None))
    targets = around(mechanism, count, 6)
    answers = pf.solve_ik(mechanism, targets, start=starts)
    off = np.linalg.norm(starts.pose[:, :3, 3] - targets[:, :3, 3], axis=1)
    turned = Rotation.from_matrix(np.swapaxes(starts.pose[:, :3, :3], 1, 2) @ targets[:, :3, :3]).magnitude()
    lever = np.linalg.norm(mechanism.platform_points.mean(axis=0) - mechanism.reference_point)
    price = Options().hold_price * length + lever
    cost = np.hypot(answers.position_error, turning * answers.rotation_error) + price * answers.rotation_error
    assert (cost <= np.hypot(off, turning * turned) + price * turned + 1e-6 * length).all()


# --- forward kinematics from a start ---------------------------------------------------------------------------------

POSTS = [(480.0, 330.0, 310.0), (480.0, -330.0, 310.0), (-480.0, 330.0, 310.0), (-480.0, -330.0, 310.0)]


def eight_struts() -> Mechanism:
    """A box on eight struts from the corners of a room: two more than it has freedoms."""
    base = [(x, y, sign * z) for x, y, z in POSTS for sign in (1.0, -1.0)]
    box = [(x / 8.0, y / 7.0, -sign * 45.0) for x, y, _ in POSTS for sign in (1.0, -1.0)]
    return Mechanism.from_legs("S-P*-S", base=base, platform=box, reference_point=(0, 0, 0), stroke=(150.0, 1200.0))


def test_lengths_that_agree_are_reached_from_a_start_too() -> None:
    """The lengths are those of a pose, by Pythagoras; where the way from the start strays, other starts follow."""
    mechanism, rng = eight_struts(), np.random.default_rng(1)
    count = 10 if INTERPRETED else 100
    length, feet, heads = mechanism.characteristic_length, [], []
    for name in mechanism.actuator_names:
        along = mechanism.joint(name).along
        assert along is not None
        feet.append(mechanism.joint(along[0]).at)
        heads.append(mechanism.joint(along[1]).at)
    near = np.tile(np.eye(4), (count, 1, 1))
    near[:, :3, 3] = rng.uniform(-0.2, 0.2, (count, 3)) * length
    near[:, :3, :3] = Rotation.from_rotvec(rng.uniform(-0.4, 0.4, (count, 3))).as_matrix()
    poses = near.copy()
    poses[:, :3, 3] += 0.1 * length * rng.normal(size=(count, 3))
    poses[:, :3, :3] = near[:, :3, :3] @ Rotation.from_rotvec(0.3 * rng.normal(size=(count, 3))).as_matrix()
    ends = np.einsum("nij,kj->nki", poses[:, :3, :3], np.array(heads, float)) + poses[:, None, :3, 3]
    values = np.linalg.norm(ends - np.array(feet, float), axis=2)
    starts = pf.solve_ik(mechanism, near)
    kept = (starts.status == Status.REACHED) & ((values >= 150.0) & (values <= 1200.0)).all(axis=1)
    found = pf.solve_fk(mechanism, values[kept], start=starts[kept])
    assert kept.sum() >= 0.5 * count
    assert (found.status == Status.REACHED).all()


def test_what_assembles_in_the_mode_of_its_start_beyond_a_limit_stays_there() -> None:
    """A 5-bar assembles with its tip high or low; high, an elbow is beyond its range, low it is not.

    In any mode the one within all limits is taken; from home, whose tip is high, given or not, the answer stays high.
    """
    values, free = [0.1, 0.2], pf.load("five_bar").without_limits()
    high, low = (float(mode.joints["p2"]) for mode in pf.assembly_modes(free, values))
    assert low < high < 0.0
    mechanism = free.with_limits(p2=(low - 0.1, high - 0.01))
    home = float(pf.solve_ik(mechanism, mechanism.home_pose).joints["p2"])
    assert low < home < high - 0.01
    anywhere = pf.solve_fk(mechanism, values, options=Options(working_mode="any"))
    assert anywhere.status == Status.REACHED and abs(float(anywhere.joints["p2"]) - low) <= 1e-9
    for start in (None, pf.solve_ik(mechanism, mechanism.home_pose)):
        answer = pf.solve_fk(mechanism, values, start=start)
        assert answer.status == Status.PROJECTED and abs(float(answer.joints["p2"]) - (high - 0.01)) <= 1e-6
