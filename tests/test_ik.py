"""Inverse kinematics against closed forms, and its policies: modes, what counts of a target, what is asked again."""

from __future__ import annotations

import dataclasses
import weakref

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import oracles
import pfabrik as pf
from checks import INTERPRETED, assert_feasible
from oracles.ik import plan_of
from pfabrik import Joint, Mechanism, Options, Status
from pfabrik.errors import InvalidArgument
from pfabrik.tolerances import TOLERANCES

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

MODES = {
    "delta": 8,
    "five_bar": 4,
    "hexaglide": 64,
    "linear_delta": 8,
    "prr": 8,
    "psu": 8,
    "reachy_mini": 64,
    "rpr": 1,
    "rrr": 8,
    "servo_hexapod": 64,
    "stewart": 1,
}
"""Machines with closed forms, and their working modes at home: two a crank or carriage."""


def some_targets(machine: Mechanism, n: int, seed: int) -> np.ndarray:
    """Poses (n, 4, 4) on both sides of the border; of a plane machine in its plane."""
    rng = np.random.default_rng(seed)
    size, length = rng.uniform(0, 1, (n, 1)), machine.characteristic_length
    shifts, turns = rng.uniform(-0.6, 0.6, (n, 3)) * length * size, rng.normal(size=(n, 3)) * 0.4 * size
    normal = plan_of(machine).normal if machine.name[:9] != "Redundant" else np.zeros(3)
    if normal.any():
        shifts, turns = shifts - np.outer(shifts @ normal, normal), np.outer(turns @ normal, normal)
    return oracles.poses(machine.reference_point + shifts, Rotation.from_rotvec(turns).as_matrix())


def assert_as_in_closed_form(answer: pf.Solution, margin: np.ndarray) -> None:
    clear = np.abs(margin) > 1e-8
    np.testing.assert_array_equal((answer.status == Status.REACHED)[clear], (margin >= 0)[clear])
    assert_feasible(answer.mechanism, answer)


@pytest.mark.parametrize("count", [20 if INTERPRETED else 300, pytest.param(10_000, marks=pytest.mark.campaign)])
@pytest.mark.parametrize("name", [*MODES, "nrpm"])
def test_reached_exactly_where_the_closed_form_says_cold_and_warm(name: str, count: int) -> None:
    machine, rng = pf.load(name), np.random.default_rng(count)
    targets = some_targets(machine, count, seed=5)
    margin = oracles.margin(machine, targets)
    assert 0.1 < (margin >= 0.0).mean() < 1.0 or INTERPRETED
    cold = pf.solve_ik(machine, targets)
    assert_as_in_closed_form(cold, margin)
    warm = pf.solve_ik(machine, targets, start=cold[rng.permutation(count)], options=Options(working_mode="any"))
    assert_as_in_closed_form(warm, margin)
    if name != "nrpm":  # whose arms may stand in many places
        reached, length = cold.status == Status.REACHED, machine.characteristic_length
        expected = oracles.actuators(machine, targets[reached])
        np.testing.assert_allclose(cold.actuators[reached], expected, rtol=0, atol=1e-9 * max(length, 1.0))


def test_every_machine_of_the_catalogue_with_a_closed_form_is_in_the_table() -> None:
    for name in pf.catalog():
        if name not in MODES:
            with pytest.raises(oracles.NoClosedForm):
                plan_of(pf.load(name))


@pytest.mark.parametrize("name", MODES)
def test_home_is_the_first_of_the_working_modes_in_closed_form(name: str) -> None:
    machine = pf.load(name)
    modes = oracles.working_modes(machine, machine.home_pose)
    assert len(modes.actuators) == MODES[name] and modes.margins[0] >= 0.0
    np.testing.assert_allclose(modes.actuators[0], [drive.home for drive in machine.drives], rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ["five_bar", "stewart", "nrpm"])
def test_status_is_right_on_both_sides_of_the_boundary(name: str) -> None:
    """Targets a millionth of L inside and outside the edge, by the closed form."""
    machine, rng = pf.load(name), np.random.default_rng(3)
    count = 2 if name == "nrpm" else 20  # whose margins are searched for
    outward = rng.normal(size=(count, 3)) * ([0, 1, 1] if name == "five_bar" else 1)
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    home, length = np.array(machine.reference_point), machine.characteristic_length

    def targets(distance: np.ndarray) -> np.ndarray:
        return oracles.poses((home + distance[..., None] * outward).reshape(-1, 3))

    farthest, width = np.full(count, 10 * length), 1e-7 * length
    edge = oracles.edge(lambda d: oracles.margin(machine, targets(d)).reshape(d.shape), farthest, width)
    inner, outer = targets(edge - 1e-6 * length), targets(edge + 1e-6 * length)
    assert (oracles.margin(machine, inner) >= 0).all() and (oracles.margin(machine, outer) < 0).all()
    within, beyond = pf.solve_ik(machine, inner), pf.solve_ik(machine, outer)
    assert (within.status == Status.REACHED).all() and (beyond.status == Status.PROJECTED).all()
    assert np.median(beyond.position_error) <= 1.1e-6 * length


KINDS = ("R*-U-S", "R*-S-S", "P*-U-S", "P*-S-U", "U-P*-S", "S-P*-U")
TYPES = {"R": "revolute", "P": "prismatic", "U": "universal", "S": "spherical"}


def any_machine(seed: int, n_legs: int) -> Mechanism:
    """A platform on legs of various kinds, joints and axes wherever they happen to be."""
    rng = np.random.default_rng(seed)
    joints = []
    for leg in range(n_legs):
        chain = KINDS[rng.integers(len(KINDS))].split("-")
        foot, elbow = rng.uniform(-100, 100, 3), rng.uniform(-100, 100, 3)
        head = np.append(rng.uniform(-60, 60, 2), 250.0)
        points, bodies = [foot, head if chain[1] == "P*" else elbow, head], ["base", f"a{leg}", f"b{leg}", "platform"]
        for place, (kind, point) in enumerate(zip(chain, points, strict=True)):
            connects = bodies[place : place + 2]
            if kind != "U":  # whose axes are square to the link on its second body
                connects = connects[:: rng.choice([-1, 1])]
            where = (
                {"along": (f"J{leg}.0", f"J{leg}.2")} if kind == "P*" and place == 1 else {"axis": rng.normal(size=3)}
            )
            where = {} if kind in "US" else where
            at = None if kind == "P*" else point
            joints.append(
                Joint(f"J{leg}.{place}", TYPES[kind[0]], connects, at=at, actuated=kind.endswith("*"), **where)
            )
    return Mechanism("any machine", joints, "platform", (5, -3, 240))


@pytest.mark.parametrize("seed", range(6))
def test_legs_of_any_shape_and_kind_are_mixed(seed: int) -> None:
    """Without a start the solver may answer in any working mode."""
    machine = any_machine(seed, n_legs=3 + seed % 4)
    targets = some_targets(machine, 10 if INTERPRETED else 100, seed)
    answer = pf.solve_ik(machine, targets)
    reached = answer.status == Status.REACHED
    np.testing.assert_array_equal(oracles.solve_ik(machine, targets).reached, reached)
    assert reached.any()
    is_angle = [drive.kind == "angle" for drive in machine.drives]
    for row in np.flatnonzero(reached)[:10]:
        apart = oracles.working_modes(machine, targets[row]).actuators - answer.actuators[row]
        apart = np.where(is_angle, np.remainder(apart + np.pi, 2 * np.pi) - np.pi, apart)
        assert np.abs(apart).max(axis=1).min() <= 1e-9 * machine.characteristic_length


@pytest.mark.parametrize("kind, reach, direction", [("crank", 250.0, (0.6, 0.0, 0.8)), ("carriage", 100.0, (1, 0, 0))])
def test_a_stretched_leg_has_one_branch_and_reaches_no_further(
    kind: str, reach: float, direction: tuple[float, ...]
) -> None:
    """A free platform on a crank of 100 about y and a rod of 150, or on a carriage along z and a rod of 100."""
    driver = Joint("A", "revolute", ("base", "link"), at=(0, 0, 0), axis=(0, 1, 0), actuated=True)
    foot, head = (0, 0, 100), (90, 0, 220)
    if kind == "carriage":
        driver = Joint("A", "prismatic", ("base", "link"), axis=(0, 0, 1), actuated=True)
        foot, head = (0, 0, 0), (60, 0, -80)
    rod = Joint("B", "universal", ("link", "rod"), at=foot), Joint("C", "spherical", ("rod", "platform"), at=head)
    machine = Mechanism(kind, [driver, *rod], "platform", head)
    slack = TOLERANCES.position * machine.characteristic_length
    for beyond, modes in ((-1.0, 2), (0.0, 1), (0.4 * slack, 1), (3 * slack, 0)):
        target = (reach + beyond) * np.array(direction)
        assert len(oracles.working_modes(machine, target).actuators) == modes
        assert bool(pf.solve_ik(machine, target)) is (modes > 0)


# --- policies --------------------------------------------------------------------------------------------------------


def test_positions_alone_mean_home_orientation() -> None:
    machine = pf.load("stewart")
    position = np.add(machine.reference_point, (3.0, -2.0, 1.0))
    by_position, by_pose = pf.solve_ik(machine, position), pf.solve_ik(machine, pf.pose(position))
    np.testing.assert_array_equal(by_position.actuators, by_pose.actuators)


def test_a_point_has_no_orientation_to_miss() -> None:
    machine = pf.load("five_bar")
    answer = pf.solve_ik(machine, pf.pose(machine.reference_point, rotvec=[0.3, 0.2, 0.1]))
    assert answer
    assert answer.rotation_error == 0.0


def test_home_seeds_the_answer_where_no_seed_is_given() -> None:
    """Both elbows of an unlimited 5-bar reach; the answer stays on home's."""
    machine = pf.load("five_bar").without_limits()
    targets = oracles.inside_targets(pf.load("five_bar"), np.random.default_rng(7), 10)
    home = pf.solve_ik(machine, machine.home_pose)
    seeded = pf.solve_ik(machine, targets, start=home)
    np.testing.assert_allclose(seeded.actuators, pf.solve_ik(machine, targets).actuators)


def test_another_working_mode_is_used_where_only_it_keeps_the_limits() -> None:
    """An elbow range that contains home, not home's bend at the target, but the mirrored one."""
    machine = pf.load("five_bar").without_limits().with_limits(p2=np.radians((-100.0, 140.0)))
    target = np.subtract(machine.reference_point, (0.0, 5.0, 75.0))
    modes = oracles.working_modes(machine, target)
    assert modes.margins[0] < 0 < modes.margins.max()
    assert pf.solve_ik(machine, target)
    home = pf.solve_ik(machine, machine.home_pose)
    kept = pf.solve_ik(machine, target, options=Options(working_mode="keep"))
    for answer in (kept, pf.solve_ik(machine, target, start=home)):
        assert answer.status is Status.PROJECTED
        assert [(limit.joint, limit.bound) for limit in answer.active_limits] == [("p2", "min")]
    assert pf.solve_ik(machine, target, start=home, options=Options(working_mode="any"))


@pytest.mark.parametrize("name", ["five_bar", "stewart", "nrpm"])
def test_the_papers_settings_end_within_its_tolerance_with_the_loops_closed(name: str) -> None:
    machine = pf.load(name)
    targets = oracles.inside_targets(machine, np.random.default_rng(8), 10 if INTERPRETED else 100, least=0.05)
    answer = pf.passes.solve(machine, targets)
    assert_feasible(machine, answer)
    assert (answer.position_error <= 1e-2).mean() > 0.95
    assert np.median(answer.iterations) <= 100


@pytest.mark.parametrize("name", ["stewart", "delta", "servo_hexapod", "five_bar", "hexaglide"])
def test_a_certified_answer_asked_again_is_the_answer_but_with_other_tolerances(name: str) -> None:
    machine = pf.load(name)
    targets = oracles.targets_about(machine, np.random.default_rng(3), 12, 0.9, 0.2)
    answer = next(a for a in pf.solve_ik(machine, targets) if a.status is Status.PROJECTED and a.certified)
    target = answer._request.targets[0]
    again = pf.solve_ik(machine, target, start=answer)
    assert again.certified and again.status is Status.PROJECTED
    assert np.array_equal(again.q, answer.q)
    wide = Options(tolerance=2.0 * answer.position_error, rotation_tolerance=0.1)
    assert pf.solve_ik(machine, target, start=answer, options=wide).status is Status.REACHED


def test_batches_asked_again_do_not_keep_all_answers_before_them() -> None:
    machine = pf.load("stewart")
    targets = oracles.targets_about(machine, np.random.default_rng(3), 12, 0.6, 0.4)
    first = answer = pf.solve_ik(machine, targets, options=Options(hold=None))
    assert 0 < np.count_nonzero(first.status == Status.PROJECTED) < len(targets)
    kept = weakref.ref(first._configurations)
    for _ in range(40):
        answer = pf.solve_ik(machine, targets, start=answer, options=Options(hold=None))
    q = first.q.copy()
    del first
    assert kept() is None
    np.testing.assert_allclose(answer.q, q, rtol=0, atol=1e-12)


def test_rotations_are_accepted_up_to_the_stated_deviation() -> None:
    machine = pf.load("stewart")
    target = machine.home_pose.copy()
    target[:3, :3] *= 1 + 0.4e-6
    assert pf.solve_ik(machine, target)
    target[:3, :3] *= 1 + 0.2e-6
    with pytest.raises(InvalidArgument):
        pf.solve_ik(machine, target)


def test_an_answer_of_the_same_machine_with_other_motors_or_masses_is_a_start() -> None:
    machine = pf.load("stewart")
    joints = [dataclasses.replace(j, friction=(1.0, 0.1)) if j.actuated else j for j in machine.joints]
    other = dataclasses.replace(machine, joints=tuple(joints), masses=(pf.Mass("platform", 2.0, (0.0, 0.0, 200.0)),))
    start = pf.solve_ik(machine, machine.home_pose)
    assert pf.solve_ik(other, machine.home_pose, start=start)
    assert pf.track(other, machine.home_pose[None], start=start)
    with pytest.raises(InvalidArgument, match="another mechanism of the same name"):
        pf.solve_ik(machine.with_limits({machine.actuator_names[0]: (150.0, 270.0)}), machine.home_pose, start=start)
