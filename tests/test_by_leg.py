"""The library against closed forms leg by leg, and these against distances measured from scratch."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import oracles
import pfabrik as pf
from checks import INTERPRETED, home_values
from pfabrik import Joint, Mechanism
from pfabrik.tolerances import TOLERANCES

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
Array = np.ndarray

MODES = {
    "agile_eye": 8,
    "ankle_rss": 4,
    "ankle_ups": 2,  # half a turn of the pivot about both axes, too
    "canfield": 8,
    "delta": 8,
    "five_bar": 4,
    "g1_ankle": None,  # its pivot has two axes that miss each other
    "hexaglide": 64,
    "linear_delta": 8,
    "nrpm": None,  # redundant
    "orthoglide": 8,
    "panda": None,  # one chain, driven seven times
    "prr": 8,
    "prs": 8,
    "psu": 8,
    "reachy_mini": 64,
    "rpr": 1,
    "rps": 2,  # turned by half a turn, too
    "rrr": 8,
    "serial_arm": None,  # one leg, driven four times
    "servo_hexapod": 64,
    "snake60": None,  # one chain, driven sixty times
    "stewart": 1,
    "tricept": 2,
    "ucu": 1,
}
"""How many working modes every machine of the catalogue has at home: two a crank or carriage, and of a target that sets
a part only perhaps two poses; None where they have no closed form."""
SOLVED = [name for name, modes in MODES.items() if modes is not None]
DRIVEN = {
    "agile_eye": [("A", "B", "C")],
    "ankle_rss": [("A", "B", "C")],
    "canfield": [("A", "B", "C")],
    "delta": [("A", "BL", "CL"), ("A", "BR", "CR")],
    "five_bar": [("p1", "p2", "p3"), ("p5", "p4", "p3")],
    "hexaglide": [("AL", "BL", "CL"), ("AR", "BR", "CR")],
    "linear_delta": [("A", "BL", "CL"), ("A", "BR", "CR")],
    "orthoglide": [("A", "CL", "DL"), ("A", "CR", "DR")],
    "prr": [("A", "B", "C")],
    "prs": [("A", "B", "C")],
    "psu": [("A", "BL", "CL"), ("A", "BR", "CR")],
    "reachy_mini": [(f"stewart_{k}", f"passive_{k}", f"closing_{k}") for k in range(1, 7)],
    "rrr": [("A", "B", "C")],
    "servo_hexapod": [("AL", "BL", "CL"), ("AR", "BR", "CR")],
}
"""Rods: the driven joint on the base, the joint that it moves, and the joint on the end effector (of the Orthoglide,
both joints of a rod, as they lie on the axes of the hinges beyond)."""
STRUTS = {"ankle_ups": ("A", "C"), "rpr": ("A", "C"), "rps": ("A", "C"), "stewart": ("A", "C"), "tricept": ("A", "C")}
SUFFIXES = ("", "1", "2", "3", "L", "R")


def rods(mechanism: Mechanism, name: str) -> list[tuple[Joint, Joint, Joint]]:
    known = {joint.name: joint for joint in mechanism.joints}
    named = [tuple(each + suffix for each in rod) for rod in DRIVEN[name] for suffix in SUFFIXES]
    return [tuple(known[each] for each in rod) for rod in named if set(rod) <= set(known)]


def on_end_effector(mechanism: Mechanism, joint: Joint, poses: Array) -> Array:
    """Where joints of the end effector are, (n, 3)."""
    if mechanism.end_effector_is_joint:
        return poses[:, :3, 3]
    return poses[:, :3, :3] @ np.subtract(joint.at, mechanism.reference_point) + poses[:, :3, 3]


def moved(mechanism: Mechanism, driver: Joint, joint: Joint, values: Array) -> Array:
    """Where a driven joint on the base takes another joint, (n, 3)."""
    by = values - mechanism.home_coordinate(driver.name)
    by = by if driver.connects[0] == mechanism.base else -by
    if driver.type == "prismatic":
        return np.array(joint.at) + by[:, None] * np.array(driver.axis)
    turn = Rotation.from_rotvec(by[:, None] * np.array(driver.axis)).as_matrix()
    return turn @ np.subtract(joint.at, driver.at) + np.array(driver.at)


def misfits(mechanism: Mechanism, name: str, poses: Array, actuators: Array) -> Array:
    """How much any rod is too long or too short at poses (n, 4, 4) with actuators (n, n_a), (n, rods) [L]."""
    column = mechanism.actuator_names.index
    found = []
    for driver, foot, head in rods(mechanism, name):
        start = moved(mechanism, driver, foot, actuators[:, column(driver.name)])
        apart = np.linalg.norm(on_end_effector(mechanism, head, poses) - start, axis=1)
        found.append(np.abs(apart - np.linalg.norm(np.subtract(head.at, foot.at))))
    return np.stack(found, axis=1) / mechanism.characteristic_length


def some_targets(mechanism: Mechanism, n: int = 300, seed: int = 5) -> Array:
    """Poses about home's, some far off; of a plane machine in its plane."""
    rng = np.random.default_rng(seed)
    size, length = rng.uniform(0, 1, (n, 1)), mechanism.characteristic_length
    targets = np.tile(np.eye(4), (n, 1, 1))
    targets[:, :3, 3] = mechanism.reference_point + rng.uniform(-0.5, 0.5, (n, 3)) * length * size
    turns = rng.normal(size=(n, 3)) * 0.35 * size
    axes = {tuple(np.abs(joint.axis)) for joint in mechanism.joints if joint.type == "revolute"}
    plane = {joint.type for joint in mechanism.joints} <= {"revolute", "prismatic"} and len(axes) == 1
    if plane:
        normal = np.array(axes.pop())
        steps = targets[:, :3, 3] - mechanism.reference_point
        targets[:, :3, 3] -= np.outer(steps @ normal, normal)
        turns = np.outer(turns @ normal, normal) * 2.0
    targets[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix()
    return targets


# --- the closed forms ------------------------------------------------------------------------------------------------


def test_every_machine_of_the_catalogue_is_in_the_table() -> None:
    assert sorted(MODES) == sorted(pf.catalog())
    assert set(DRIVEN) | set(STRUTS) | {"ucu"} == set(SOLVED)


@pytest.mark.parametrize("name", MODES)
def test_home_is_the_first_of_its_working_modes_and_the_answer(name: str) -> None:
    mechanism = pf.load(name)
    if MODES[name] is None:
        with pytest.raises(oracles.NoClosedForm):
            oracles.working_modes(mechanism, mechanism.home_pose)
        return
    modes = oracles.working_modes(mechanism, mechanism.home_pose)
    counted = np.column_stack([modes.completions, modes.branches])
    assert len(np.unique(counted, axis=0)) == len(modes.actuators) == MODES[name]
    assert modes.margins[0] >= 0.0
    answer = oracles.solve_ik(mechanism, mechanism.home_pose)
    for values, pose in ((modes.actuators[0], modes.poses[0]), (answer.actuators, answer.pose)):
        np.testing.assert_allclose(values, home_values(mechanism), rtol=0, atol=1e-9)
        np.testing.assert_allclose(pose, mechanism.home_pose, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", DRIVEN)
def test_rods_keep_their_length_in_every_working_mode(name: str) -> None:
    mechanism = pf.load(name)
    modes = [oracles.working_modes(mechanism, target) for target in some_targets(mechanism, 8)]
    poses, actuators = (np.concatenate([getattr(each, field) for each in modes]) for field in ("poses", "actuators"))
    assert len(poses)
    assert misfits(mechanism, name, poses, actuators).max() < TOLERANCES.position


@pytest.mark.parametrize("name", STRUTS)
def test_struts_are_as_long_as_their_ends_are_apart(name: str) -> None:
    mechanism = pf.load(name)
    answer = oracles.solve_ik(mechanism, some_targets(mechanism))
    assert answer.reached.any()
    for column, strut in enumerate(mechanism.actuator_names):
        foot, head = (mechanism.joint(each + strut[1:]) for each in STRUTS[name])
        apart = on_end_effector(mechanism, head, answer.pose) - foot.at
        closed = np.isfinite(answer.actuators[:, column])
        lengths = np.linalg.norm(apart, axis=1)
        np.testing.assert_allclose(answer.actuators[closed, column], lengths[closed], rtol=1e-12)


# --- the library -----------------------------------------------------------------------------------------------------


SLOW = {"delta", "psu"}


@pytest.mark.parametrize("name", [pytest.param(each, marks=[pytest.mark.slow] * (each in SLOW)) for each in SOLVED])
def test_the_solver_reaches_exactly_what_the_closed_form_reaches(name: str) -> None:
    mechanism = pf.load(name)
    wanted = some_targets(mechanism, 8 if INTERPRETED else 300)
    answer, solution = oracles.solve_ik(mechanism, wanted), pf.solve_ik(mechanism, wanted)
    reached = solution.status == pf.Status.REACHED
    np.testing.assert_array_equal(answer.reached, reached)
    assert reached.any()
    length = mechanism.characteristic_length
    np.testing.assert_allclose(answer.actuators[reached], solution.actuators[reached], rtol=0, atol=1e-9 * length)
    np.testing.assert_allclose(answer.pose[reached], solution.pose[reached], rtol=0, atol=1e-9 * max(length, 1.0))


@pytest.mark.parametrize("name", SOLVED)
def test_the_forward_engine_returns_to_the_pose(name: str) -> None:
    """From actuators on a small ball about home to a pose, and back by the closed form."""
    mechanism = pf.load(name)
    if pf.mobility(mechanism).redundancy:
        pytest.skip("values drawn for more actuators than freedoms do not assemble")
    scale = [
        mechanism.characteristic_length if mechanism.joint(each).type == "prismatic" else 1.0
        for each in mechanism.actuator_names
    ]
    values = home_values(mechanism) + np.random.default_rng(3).uniform(-0.1, 0.1, (20, len(scale))) * scale
    forward = pf.solve_fk(mechanism, values)
    forward = forward[forward.status == pf.Status.REACHED]
    assert len(forward) >= 15
    answer = oracles.solve_ik(mechanism, forward.pose)
    assert answer.reached.all()
    np.testing.assert_allclose(answer.actuators, forward.actuators, rtol=0, atol=1e-8)
    np.testing.assert_allclose(answer.pose, forward.pose, rtol=0, atol=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rrr", "prr", "rps", "prs", "canfield", "agile_eye"])
def test_the_library_lists_the_working_modes_of_the_closed_form(name: str) -> None:
    """The same actuators and poses, each once, away from home."""
    mechanism = pf.load(name).without_limits()
    target = some_targets(mechanism, 1, seed=4)[0] * 0.2 + mechanism.home_pose * 0.8
    target[:3, :3] = (Rotation.from_matrix(some_targets(mechanism, 1, seed=4)[0, :3, :3]) ** 0.3).as_matrix()
    expected, found = oracles.working_modes(mechanism, target), pf.working_modes(mechanism, target)
    assert len(found) == len(expected.actuators) > 1
    for values, pose in zip(expected.actuators, expected.poses, strict=True):
        apart = [max(np.abs(mode.actuators - values).max(), np.abs(mode.pose - pose).max()) for mode in found]
        assert min(apart) <= 1e-7 * mechanism.characteristic_length


# --- machines of any shape -------------------------------------------------------------------------------------------

KINDS = ("R*-U-S", "R*-S-S", "P*-U-S", "P*-S-U", "U-P*-S", "S-P*-U")


def any_machine(seed: int, n_legs: int) -> Mechanism:
    """A platform on legs of various kinds, joints and axes wherever they happen to be."""
    rng = np.random.default_rng(seed)
    joints = []
    for leg in range(n_legs):
        chain = KINDS[rng.integers(len(KINDS))].split("-")
        foot, elbow = rng.uniform(-100, 100, 3), rng.uniform(-100, 100, 3)
        head = np.append(rng.uniform(-60, 60, 2), 250.0)
        points = [foot, head, head] if chain[1] == "P*" else [foot, elbow, head]
        names, last = [f"{letter}{leg}" for letter in "ABC"], len(chain) - 1
        for place, (letter, point) in enumerate(zip(chain, points, strict=True)):
            bodies = [
                "base" if place == 0 else f"l{leg}.{place}",
                "platform" if place == last else f"l{leg}.{place + 1}",
            ]
            if letter != "U":  # whose axes are square to the link on its second body
                bodies = bodies[:: rng.choice([-1, 1])]
            axis, driven = rng.normal(size=3), letter.endswith("*")
            if letter == "P*" and place == 1:
                joints.append(Joint(names[1], "prismatic", bodies, along=(names[0], names[2]), actuated=True))
            elif letter == "P*":
                joints.append(Joint(names[0], "prismatic", bodies, axis=axis, actuated=True))
            elif letter == "R*":
                joints.append(Joint(names[place], "revolute", bodies, at=point, axis=axis, actuated=driven))
            else:
                kind = {"U": "universal", "S": "spherical"}[letter]
                joints.append(Joint(names[place], kind, bodies, at=point))
    return Mechanism("any machine", joints, "platform", (5, -3, 240))


@pytest.mark.parametrize("seed", range(6))
def test_legs_of_any_shape_and_kind_are_mixed(seed: int) -> None:
    """Without a start the solver may answer in any working mode."""
    mechanism = any_machine(seed, n_legs=3 + seed % 4)
    wanted = some_targets(mechanism, 10 if INTERPRETED else 150, seed)
    solution = pf.solve_ik(mechanism, wanted)
    reached = solution.status == pf.Status.REACHED
    np.testing.assert_array_equal(oracles.solve_ik(mechanism, wanted).reached, reached)
    assert reached.any()
    turns = [mechanism.joint(name).type == "revolute" for name in mechanism.actuator_names]
    for row in np.flatnonzero(reached)[:10]:
        modes = oracles.working_modes(mechanism, wanted[row])
        apart = modes.actuators - solution.actuators[row]
        apart = np.where(turns, np.remainder(apart + np.pi, 2 * np.pi) - np.pi, apart)
        assert np.abs(apart).max(axis=1).min() <= 1e-9 * mechanism.characteristic_length


def one_leg(kind: str) -> Mechanism:
    """A free platform on a crank of 100 about y and a rod of 150, or on a carriage along z and a rod of 100."""
    if kind == "crank":
        driver = Joint("A", "revolute", ("base", "link"), at=(0, 0, 0), axis=(0, 1, 0), actuated=True)
        foot, head = (0, 0, 100), (90, 0, 220)
    else:
        driver = Joint("A", "prismatic", ("base", "link"), axis=(0, 0, 1), actuated=True)
        foot, head = (0, 0, 0), (60, 0, -80)
    joints = [
        driver,
        Joint("B", "universal", ("link", "rod"), at=foot),
        Joint("C", "spherical", ("rod", "platform"), at=head),
    ]
    return Mechanism(kind, joints, "platform", head)


@pytest.mark.parametrize("kind, reach, direction", [("crank", 250.0, (0.6, 0.0, 0.8)), ("carriage", 100.0, (1, 0, 0))])
def test_a_stretched_leg_has_one_branch_and_reaches_no_further(
    kind: str, reach: float, direction: tuple[float, ...]
) -> None:
    mechanism = one_leg(kind)
    slack = TOLERANCES.position * mechanism.characteristic_length
    for beyond, modes in ((-1.0, 2), (0.0, 1), (0.4 * slack, 1), (3 * slack, 0)):
        target = (reach + beyond) * np.array(direction)
        assert len(oracles.working_modes(mechanism, target).actuators) == modes
        assert bool(pf.solve_ik(mechanism, target)) is (modes > 0)
