"""Mobility, Jacobians and singularities: published counts, central differences, and machines built singular."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.spatial.transform import Rotation

import pfabrik as pf
from machines import MACHINES, planar, redescribed, ring, struts
from pfabrik import Joint, Mechanism, Solution
from pfabrik.answers.differential import Mobility, forward_jacobian, inverse_jacobian, mobility, singularity
from pfabrik.closure.configurations import Configurations, new_rows
from pfabrik.closure.first_order import forward_map, inverse_map, singularities, units_of
from pfabrik.errors import InvalidArgument
from pfabrik.kernels.handle import Handle
from pfabrik.kernels.platform.jacobians import jacobians, new_jacobian_tables
from pfabrik.model import model_of
from pfabrik.motion.displacements import columns, end_effector_pose, gaps, loop_errors, rate_units
from pfabrik.motion.joint_rates import first_order
from pfabrik.motion.mobility import generic_of
from pfabrik.motion.singularities import KINDS
from pfabrik.tolerances import TOLERANCES

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

X, Y, Z = np.eye(3)
TURN = Rotation.from_rotvec((0.3, -0.8, 0.5)).as_matrix()


def loop(points, axes, end_effector="b2") -> Mechanism:
    """A single loop of revolutes; the first is driven."""
    bodies = ["base", *(f"b{k}" for k in range(1, len(points))), "base"]
    joints = [
        Joint(f"R{k}", "revolute", (bodies[k], bodies[k + 1]), at=point, axis=axis, actuated=k == 0)
        for k, (point, axis) in enumerate(zip(points, axes, strict=True))
    ]
    return Mechanism("loop", joints, end_effector, points[len(points) // 2])


def bennett() -> Mechanism:
    """Hinges normal to the sides of a skew quadrilateral whose opposite sides are equal."""
    corners = np.array([(3, 0, 1), (1, 2, -1), (-3, 0, 1), (-1, -2, -1)])
    axes = [np.cross(corners[k] - corners[k - 1], corners[(k + 1) % 4] - corners[k]) for k in range(4)]
    return loop(corners, axes)


def sarrus() -> Mechanism:
    """Two pairs of plates with hinges in two directions: a platform that only moves up and down."""
    heights, out = (0.0, 1.0, 2.0), (2.0, 3.0, 2.0)
    points = [(x, 0, z) for x, z in zip(out, heights, strict=True)]
    points += [(0, x, z) for x, z in zip(out, reversed(heights), strict=True)]
    return loop(points, [Y] * 3 + [X] * 3, "b3")


def four_bar(angle: float = 1.2, crank: float = 2.0, rocker: float = 2.0, base: float = 5.0) -> Mechanism:
    """A planar four-bar linkage with a coupler of 5; a parallelogram by default."""
    b = crank * np.array([np.cos(angle), np.sin(angle), 0])
    d = base * X
    across = d - b
    far = np.linalg.norm(across)
    along = (5.0**2 - rocker**2 + far**2) / (2 * far)
    height = np.sqrt(max(5.0**2 - along**2, 0.0))
    c = b + along * across / far + height * np.cross(Z, across / far)
    return loop([0 * X, b, c, d], [Z] * 4)


def five_bar(first: float, second: float, bend: float) -> Mechanism:
    """Cranks of 1 and forearms at given angles about z, and the right elbow bent by `bend`; the tip is at (0, 2)."""
    tip = np.array([0.0, 2.0, 0.0])
    left = tip - np.array([np.cos(first), np.sin(first), 0])
    right = tip - 1.2 * np.array([np.cos(second), np.sin(second), 0])
    bases = left - np.array([0.2, 1.0, 0]), right - np.array([np.cos(second - bend), np.sin(second - bend), 0])
    joints = [
        Joint("A", "revolute", ("base", "a"), at=bases[0], axis=Z, actuated=True),
        Joint("B", "revolute", ("a", "b"), at=left, axis=Z),
        Joint("tip", "revolute", ("b", "d"), at=tip, axis=Z),
        Joint("D", "revolute", ("e", "d"), at=right, axis=Z),
        Joint("E", "revolute", ("base", "e"), at=bases[1], axis=Z, actuated=True),
    ]
    return Mechanism("five-bar", joints, "tip")


def hexapod(bases, tops, lower="universal") -> Mechanism:
    """Struts between points, U-P-S or S-P-S."""
    return Mechanism("hexapod", struts(bases, tops, lower), "platform", np.mean(tops, axis=0))


def fichter(turned: float) -> Mechanism:
    """Semi-regular hexagons, the platform turned about the normal from where opposite struts mirror each other."""
    bases = ring(100, 0, [-10, 10, 110, 130, 230, 250])
    tops = ring(60, 120, np.array([-50, 50, 70, 170, 190, 290]) + turned)
    return hexapod(bases, tops)


def similar_hexagons(lower) -> Mechanism:
    """A hexapod whose platform is its base, smaller: singular by its architecture."""
    angles = [0, 50, 120, 170, 240, 290]
    return hexapod(ring(10, 0, angles), ring(6, 8, angles), lower)


def tsai_upu(outers=None) -> Mechanism:
    """3-UPU whose outer axes are parallel in each leg, as are its inner axes: it translates. Outer axes are tangential.

    Each leg resists one rotation, about the part of its direction that is normal to its outer axis.
    """
    joints = []
    for i, (a, c) in enumerate(zip(ring(100, 0, [0, 120, 240]), ring(50, 130, [0, 120, 240]), strict=True)):
        outer = np.cross(Z, a) if outers is None else outers[i]
        inner = np.cross(outer, np.subtract(c, a))
        joints += [
            Joint(f"A{i}", "universal", ("base", f"c{i}"), at=a, axes=(outer, inner)),
            Joint(f"B{i}", "prismatic", (f"c{i}", f"r{i}"), along=(f"A{i}", f"C{i}"), actuated=True),
            Joint(f"C{i}", "universal", (f"r{i}", "platform"), at=c, axes=(inner, outer)),
        ]
    return Mechanism("3-UPU", joints, "platform", (0, 0, 130))


def guarded_rpr(elbow: float) -> Mechanism:
    """Planar 3-RPR with a fourth, passive leg along x whose elbow is off the straight line by `elbow`."""
    joints = list(planar("RPR").joints)
    joints += [
        Joint("G1", "revolute", ("base", "upper"), at=(300, 20, 0), axis=Z),
        Joint("G2", "revolute", ("upper", "lower"), at=(150, 20 + elbow, 0), axis=Z),
        Joint("G3", "revolute", ("lower", "platform"), at=(40, 20, 0), axis=Z),
    ]
    return Mechanism("guarded", joints, "platform", (0, 0, 0))


def residual(machine: Mechanism, q: np.ndarray) -> np.ndarray:
    return loop_errors(machine, q).reshape(len(q), -1)


def slope(function: Callable, q: np.ndarray, units: np.ndarray, h: float = 1e-5) -> np.ndarray:
    """Central differences of a batched function at one row, per unit."""
    steps = h * np.diag(units)
    return (function(q + steps) - function(q - steps)).T / (2 * h)


def solved(errors: Callable, q: np.ndarray, units: np.ndarray) -> np.ndarray:
    """The root near one row q, by Newton steps with numerical slopes."""
    for _ in range(12):
        error = errors(q[None])[0]
        if not error.size:
            break
        q = q - units * np.linalg.lstsq(slope(errors, q, units), error, rcond=1e-7)[0]
        if np.abs(error).max() < 1e-9:
            break
    return q


def driven(machine: Mechanism, q: np.ndarray, values: np.ndarray) -> np.ndarray:
    """The closed configuration near one row q with the actuators at `values`."""
    units, actuated = rate_units(machine), drives(machine)

    def errors(rows: np.ndarray) -> np.ndarray:
        return np.hstack([residual(machine, rows), (rows[:, actuated] - values) / units[actuated]])

    return solved(errors, q, units)


def drives(machine: Mechanism) -> list[int]:
    return [columns(machine)[each].start for each in machine.actuator_names]


CATALOGUE = ("five_bar", "nrpm", "stewart")
EVERY = {**MACHINES, **{name: lambda name=name: pf.load(name) for name in CATALOGUE}, "tsai_upu": tsai_upu}
CONTROLLED = [name for name in EVERY if name != "serial_spherical"]


@cache
def closed(name: str) -> tuple[Mechanism, np.ndarray]:
    """A machine and two closed configurations (2, c) near home, at random."""
    machine = EVERY[name]()
    units = rate_units(machine)
    random = np.random.default_rng(3)
    starts = 0.05 * random.uniform(-1, 1, (2, len(units))) * units
    q = np.array([solved(lambda rows: residual(machine, rows), start, units) for start in starts])
    assert gaps(machine, q).max() < 1e-10 * machine.characteristic_length
    return machine, q


def answer(machine: Mechanism, q: np.ndarray, shape: tuple[int, ...]) -> Solution:
    """Joint coordinates as an answer, with nothing measured of them."""
    return Solution(machine, Configurations(new_rows(model_of(machine), len(q)), q), shape)


def home(machine: Mechanism) -> np.ndarray:
    return np.zeros((1, len(rate_units(machine))))


def at_home(machine: Mechanism):
    return singularity(answer(machine, home(machine), ()))


class TestMobility:
    @pytest.mark.parametrize(
        ("machine", "expected"),
        [
            (MACHINES["hexapod_ups"], Mobility(6, 6, 0, 0, 6, 0, 0)),
            (MACHINES["hexapod_rus"], Mobility(12, 6, 0, 6, 6, 0, 0)),
            (MACHINES["tripod_rps"], Mobility(3, 3, 0, 0, 3, 0, 0)),
            (MACHINES["tripod_prs"], Mobility(3, 3, 0, 0, 3, 0, 0)),
            (MACHINES["planar_rrr"], Mobility(3, 3, 0, 0, 3, 0, 6)),
            (MACHINES["mixed"], Mobility(5, 5, 0, 0, 5, 0, 0)),
            (MACHINES["serial_planar"], Mobility(5, 2, 2, 1, 4, 0, 0)),
            (tsai_upu, Mobility(3, 3, 0, 0, 3, 0, 0)),
            (lambda: pf.load("stewart"), Mobility(6, 6, 0, 0, 6, 0, 0)),
            (lambda: pf.load("five_bar"), Mobility(2, 2, 0, 0, 2, 0, 3)),
            (lambda: pf.load("nrpm"), Mobility(12, 6, 6, 0, 12, 0, 0)),
            (lambda: similar_hexagons("spherical"), Mobility(12, 6, 0, 6, 6, 1, 0)),
            (bennett, Mobility(1, 1, 0, 0, 1, 0, 3)),
            (sarrus, Mobility(1, 1, 0, 0, 1, 0, 1)),
            (four_bar, Mobility(1, 1, 0, 0, 1, 0, 3)),
        ],
    )
    def test_published_counts(self, machine, expected):
        assert mobility(machine()) == expected

    def test_struts_between_ball_joints_spin_idly(self):
        machine = MACHINES["hexapod_ups"]().without_limits()
        joints = [dataclasses.replace(j, type="spherical") if j.type == "universal" else j for j in machine.joints]
        spinning = Mechanism("6-SPS", joints, "platform", machine.reference_point)
        assert mobility(spinning) == Mobility(12, 6, 0, 6, 6, 0, 0)

    def test_home_in_a_singularity_is_not_taken_for_the_general_case(self):
        assert mobility(four_bar(0.0)).mobility == 1
        assert mobility(five_bar(0.4, 0.4 + np.pi, 1.0)) == mobility(five_bar(0.4, 2.4, 0.0))
        assert mobility(fichter(90)) == Mobility(6, 6, 0, 0, 6, 0, 0)

    def test_similar_hexagons_are_singular_everywhere(self):
        machine = similar_hexagons("universal")
        assert mobility(machine) == Mobility(6, 6, 0, 0, 6, 1, 0)
        assert at_home(machine).kinds == ("parallel",)

    def test_redundancy_counts_actuators_beyond_the_freedoms_of_the_end_effector(self):
        assert mobility(pf.load("nrpm")).redundancy == 6
        assert mobility(MACHINES["serial_spherical"]()).redundancy == -2
        assert mobility(MACHINES["serial_spherical"]()).uncontrolled == 3

    def test_actuators_on_every_joint_are_redundant_but_control_everything(self):
        joints = [dataclasses.replace(joint, actuated=True) for joint in five_bar(0.4, 2.4, 1.0).joints]
        found = mobility(Mechanism("all driven", joints, "tip"))
        assert found == Mobility(2, 2, 0, 0, 5, 0, 3)
        assert found.redundancy == 3

    def test_a_frame_does_not_move(self):
        joints = [
            Joint("A", "revolute", ("base", "bar"), at=(0, 0, 0), axis=Z, actuated=True),
            Joint("B", "revolute", ("base", "bar"), at=(1, 0, 0), axis=Z),
        ]
        machine = Mechanism("frame", joints, "bar", (2, 0, 0))
        assert mobility(machine) == Mobility(0, 0, 0, 0, 1, 0, 4)
        found = at_home(machine)
        assert (found.serial, found.parallel, found.kinds) == (np.inf, np.inf, ())
        assert np.isnan(found.lost).all()
        assert np.array_equal(forward_map(model_of(machine), home(machine))[0], np.zeros((6, 1)))


class TestJacobians:
    @pytest.mark.parametrize("name", CONTROLLED)
    def test_forward_jacobian_is_the_slope_of_the_pose(self, name):
        machine, q = closed(name)
        forward = forward_map(model_of(machine), q)
        units = rate_units(machine)
        actuated = drives(machine)
        h = 1e-6
        for row in range(len(q)):
            for k, column in enumerate(actuated):
                step = np.zeros(len(actuated))
                step[k] = h * units[column]
                ahead, behind = (driven(machine, q[row], q[row, actuated] + sign * step) for sign in (1, -1))
                T, T0 = end_effector_pose(machine, np.array([ahead, behind]))
                velocity = (T - T0)[:3, 3] / (2 * step[k])
                angular = Rotation.from_matrix(T[:3, :3] @ T0[:3, :3].T).as_rotvec() / (2 * step[k])
                expected = velocity if machine.end_effector_is_joint else np.concatenate([velocity, angular])
                scale = np.abs(forward[row, :, k]).max()
                assert forward[row, :, k] == pytest.approx(expected, abs=1e-6 * scale)

    @pytest.mark.parametrize("name", ["hexapod_ups", "hexapod_rus", "hexaglide", "stewart"])
    def test_jacobians_of_six_freedoms_and_six_actuators_are_inverse(self, name):
        machine, q = closed(name)
        product = inverse_map(model_of(machine), q) @ forward_map(model_of(machine), q)
        assert product == pytest.approx(np.broadcast_to(np.eye(6), (2, 6, 6)), abs=1e-10)

    @pytest.mark.parametrize("name", CONTROLLED)
    def test_jacobians_are_moore_penrose_inverses_in_lengths_of_l(self, name):
        machine, q = closed(name)
        forward, inverse = forward_map(model_of(machine), q), inverse_map(model_of(machine), q)
        units = rate_units(machine)[drives(machine)]
        twist = np.ones(forward.shape[1])
        twist[:3] = machine.characteristic_length
        forward, inverse = forward * units / twist[:, None], inverse / units[:, None] * twist
        assert inverse == pytest.approx(np.linalg.pinv(forward, rcond=1e-9), abs=1e-9)

    def test_a_hexapods_inverse_jacobian_is_its_strut_lines(self):
        machine = pf.load("stewart")
        rows = inverse_map(model_of(machine), home(machine))[0]
        for name, row in zip(machine.actuator_names, rows, strict=True):
            a, c = (np.array(machine.joint(each).at) for each in machine.joint(name).along)
            d = (c - a) / np.linalg.norm(c - a)
            assert row == pytest.approx([*d, *np.cross(c - machine.reference_point, d)], abs=1e-10)

    def test_jacobian_of_carriages_is_exact_wherever_they_stand(self):
        """A 3-PPR: each carriage goes as fast as the platform's corner goes along its rail."""
        corners = np.array(ring(40.0, 0.0, (90, 210, 330)))
        out = corners / 40.0
        rails = np.cross(Z, out)
        joints = []
        for k, (corner, direction, rail) in enumerate(zip(corners, out, rails, strict=True)):
            joints += [
                Joint(f"A{k}", "prismatic", ("base", f"a{k}"), axis=rail, actuated=True),
                Joint(f"B{k}", "prismatic", (f"a{k}", f"b{k}"), axis=direction),
                Joint(f"C{k}", "revolute", (f"b{k}", "platform"), at=corner, axis=Z),
            ]
        machine = Mechanism("3-PPR", joints, "platform", (3, 4, 0))
        rng = np.random.default_rng(0)
        twists = np.concatenate([rng.uniform(-20, 20, (40, 2)), rng.uniform(-0.6, 0.6, (40, 1))], axis=1)
        targets = pf.pose([(3 + x, 4 + y, 0) for x, y, _ in twists], rotvec=twists[:, 2:] * Z)
        found = inverse_jacobian(pf.solve_ik(machine, targets))
        arms = (corners - (3, 4, 0)) @ np.swapaxes(targets[:, :3, :3], -1, -2)
        turning = np.einsum("nki,ki->nk", np.cross(Z, arms), rails)
        assert found[..., :2] == pytest.approx(np.broadcast_to(rails[:, :2], (40, 3, 2)), abs=1e-9)
        assert found[..., 5] == pytest.approx(turning, abs=1e-9 * 40)

    def test_free_freedoms_rest_as_far_as_they_can(self):
        machine = MACHINES["serial_spherical"]()
        q = home(machine)
        q[0, columns(machine)["s1"]] = 0.3, -0.2, 0.1
        along = Rotation.from_rotvec((0.3, -0.2, 0.1)).apply(Z)  # all links are in line: no ball moves the tip so
        assert forward_map(model_of(machine), q)[0, :, 0] == pytest.approx(along[0] * along, abs=1e-12)

    @pytest.mark.parametrize("shape", [(), (2,), (1, 2)])
    def test_results_take_the_shape_of_the_solution(self, shape):
        machine, q = closed("stewart")
        found = answer(machine, q[: int(np.prod(shape))], shape)
        assert forward_jacobian(found).shape == (*shape, 6, 6)
        assert inverse_jacobian(found).shape == (*shape, 6, 6)
        near = singularity(found)
        assert np.shape(near.serial) == np.shape(near.parallel) == np.shape(near.passive) == shape
        assert near.lost.shape == near.gained.shape == (*shape, 6)
        assert near.kinds == () if shape == () else near.kinds == [(), ()]

    def test_invalid_rows_are_nan_and_leave_the_others_alone(self):
        machine, q = closed("stewart")
        marked = np.array([q[0], np.full_like(q[0], np.nan), q[1]])
        for function in (forward_map, inverse_map):
            found = function(model_of(machine), marked)
            assert np.isnan(found[1]).all()
            assert np.array_equal(found[[0, 2]], function(model_of(machine), q))
        near = singularities(model_of(machine), marked)
        assert np.isnan([near.serial[1], near.parallel[1], near.constraint[1], near.passive[1]]).all()
        assert np.isnan([near.lost[1], near.gained[1]]).all()
        assert near.kinds == [(), (), ()]

    def test_no_rows_give_no_rows(self):
        machine = pf.load("stewart")
        none = answer(machine, np.zeros((0, 36)), (0,))
        assert forward_jacobian(none).shape == inverse_jacobian(none).shape == (0, 6, 6)
        assert singularity(none).kinds == []

    def test_what_is_no_solution_is_refused(self):
        for function in (forward_jacobian, inverse_jacobian, singularity, pf.closure_residual):
            with pytest.raises(InvalidArgument, match="solution: found ndarray; expected a Solution"):
                function(closed("stewart")[1])


def drawn(machine: Mechanism, n: int, reach: float = 0.15) -> Solution:
    """Answers to targets about home at random."""
    random, base = np.random.default_rng(5), machine.home_pose
    shifts = random.uniform(-reach, reach, (n, 3)) * machine.characteristic_length
    targets = pf.pose(base[:3, 3] + shifts, rotvec=random.uniform(-reach, reach, (n, 3)))
    targets[:, :3, :3] = targets[:, :3, :3] @ base[:3, :3]
    return pf.solve_ik(machine, targets)


def off(machine: Mechanism, found: np.ndarray, expected: np.ndarray, *, forward: bool) -> np.ndarray:
    """Largest differences of Jacobians (n, a, b), with lengths in L, relative to the largest entry, (n,)."""
    twists, actuators = units_of(model_of(machine))
    scale = actuators / twists[:, None] if forward else twists / actuators[:, None]
    largest = np.abs(scale * expected).max(axis=(1, 2))
    return np.abs(scale * (found - expected)).max(axis=(1, 2)) / np.where(largest > 0.0, largest, 1.0)


OF_LEGS = [name for name in pf.catalog() if name not in ("nrpm", "panda", "serial_arm", "snake60")]


class TestJacobiansOfLegs:
    """New answers of legs in closed form, whose joint coordinates nobody has asked for."""

    @pytest.mark.parametrize("name", OF_LEGS)
    def test_they_are_those_of_all_joint_coordinates_in_batches_and_alone(self, name):
        """In and out of reach: some are stretched, most are limited, and tasks leave some of the pose open."""
        machine = pf.load(name)
        batch = drawn(machine, 24, 0.3)
        assembled = pf.solve_fk(machine, batch.actuators[:6])
        found = [(each, forward_jacobian(each), inverse_jacobian(each)) for each in (batch, assembled, batch[3:4])]
        for solution, forward, inverse in found:
            q = solution._coordinates
            assert off(machine, forward, forward_map(model_of(machine), q), forward=True).max() < 1e-11
            assert off(machine, inverse, inverse_map(model_of(machine), q), forward=False).max() < 1e-11
        one = pf.solve_ik(machine, batch.pose[3])
        assert np.array_equal(forward_jacobian(one), forward_jacobian(pf.solve_ik(machine, batch.pose[3:4]))[0])

    @pytest.mark.parametrize("name", OF_LEGS)
    def test_they_take_no_joint_coordinates(self, name):
        machine = pf.load(name)
        solution = pf.solve_ik(machine, machine.home_pose if name != "g1_ankle" else drawn(machine, 1).pose[0])
        forward_jacobian(solution), inverse_jacobian(solution)
        assert "coordinates" not in vars(solution._configurations)

    @pytest.mark.parametrize("name", OF_LEGS)
    def test_forward_jacobian_is_the_slope_of_forward_kinematics(self, name):
        machine = pf.load(name).without_limits()
        here = pf.solve_fk(machine, drawn(pf.load(name), 1, 0.05).actuators[0])
        forward, h = forward_jacobian(here), 1e-5
        for k, unit in enumerate(rate_units(machine)[drives(machine)]):
            step = np.zeros(len(here.actuators))
            step[k] = h * unit
            T, T0 = (pf.solve_fk(machine, here.actuators + sign * step, start=here).pose for sign in (1, -1))
            velocity = (T - T0)[:3, 3] / (2 * step[k])
            angular = Rotation.from_matrix(T[:3, :3] @ T0[:3, :3].T).as_rotvec() / (2 * step[k])
            expected = velocity if machine.end_effector_is_joint else np.concatenate([velocity, angular])
            lengths = np.where(np.arange(len(expected)) < 3, machine.characteristic_length, 1.0)
            assert np.abs((forward[:, k] - expected) / lengths).max() < 1e-6 * np.abs(forward[:, k] / lengths).max()

    @pytest.mark.parametrize("name", ["delta", "hexaglide", "rrr", "servo_hexapod"])
    def test_at_dead_points_and_next_to_them_they_are_those_of_joint_coordinates(self, name):
        """Far targets stretch a leg out; from there inward, its slopes grow until they are lost.

        A share of 1e-12 from there slopes are a million, and keep ten digits.
        """
        machine = pf.load(name).without_limits()
        center = machine.home_pose[:3, 3]
        aside = machine.characteristic_length * (X if name == "rrr" else Z)
        far = pf.solve_ik(machine, center + 3.0 * aside).pose
        shares = np.concatenate([1.0 - 10.0 ** np.arange(-1.0, -13.0, -1.0), [1.0, 1.2]])
        targets = np.repeat(far[None], len(shares), axis=0)
        targets[:, :3, 3] = center + shares[:, None] * (far[:3, 3] - center)
        solution = pf.solve_ik(machine, targets)
        forward, inverse = forward_jacobian(solution), inverse_jacobian(solution)
        q = solution._coordinates
        assert off(machine, forward, forward_map(model_of(machine), q), forward=True).max() < 1e-10
        assert off(machine, inverse, inverse_map(model_of(machine), q), forward=False).max() < 1e-10
        assert inverse_map(model_of(machine), q)[-1] == pytest.approx(inverse[-1], abs=0)

    def test_a_strut_along_the_outer_hinge_of_its_universal_joint_loses_a_freedom(self):
        """Nothing of the strut's length says so: its foot cannot swing across both hinges."""
        bases = np.array(ring(100, 0, [-10, 10, 110, 130, 230, 250]))
        tops = np.array(ring(60, 120, [-50, 50, 70, 170, 190, 290]))
        machine, outer = hexapod(bases, tops), np.array([0.6, 0.0, 0.8])
        joints = [
            dataclasses.replace(joint, axes=(outer, np.cross(outer, tops[0] - bases[0])))
            if joint.name == "A1"
            else joint
            for joint in machine.joints
        ]
        machine = Mechanism("aligned", joints, "platform", machine.reference_point)
        away = np.array([0.0, 1e-6, 1e-3, 0.1])
        targets = np.repeat(machine.home_pose[None], len(away), axis=0)
        targets[:, :3, 3] += bases[0] + 150.0 * outer - tops[0] + 150.0 * away[:, None] * Y
        solution = pf.solve_ik(machine, targets)
        assert solution
        forward, inverse = forward_jacobian(solution), inverse_jacobian(solution)
        q = solution._coordinates
        assert off(machine, forward, forward_map(model_of(machine), q), forward=True).max() < 1e-11
        assert off(machine, inverse, inverse_map(model_of(machine), q), forward=False).max() < 1e-11
        ranks = np.linalg.matrix_rank(inverse / np.linalg.norm(inverse, axis=(1, 2), keepdims=True), tol=1e-6)
        assert ranks.tolist() == [5, 6, 6, 6]

    def test_rows_that_are_no_poses_are_nan(self):
        machine = pf.load("stewart")
        targets = np.stack([machine.home_pose, np.full((4, 4), np.nan), machine.home_pose])
        marked = pf.solve_ik(machine, targets, options=pf.Options(on_invalid="mark"))
        found = inverse_jacobian(marked)
        assert np.isnan(found[1]).all()
        assert np.array_equal(found[0], found[2])

    @pytest.mark.parametrize("actuators", [3, 5])
    def test_kernel_gives_moore_penrose_inverses_on_what_constraints_allow(self, actuators):
        """Four constraints of rank three, so that three freedoms are left, with as many actuators or more."""
        random = np.random.default_rng(actuators)
        slopes = random.normal(size=(20, 4 + actuators, 6))
        slopes[:, 3] = slopes[:, 0] - 2.0 * slopes[:, 1]
        scratch = Handle(new_jacobian_tables(4, 3, 6, actuators))
        forward, inverse = np.empty((20, 6, actuators)), np.empty((20, actuators, 6))
        assert jacobians(scratch.address, slopes, 1, forward) == jacobians(scratch.address, slopes, 0, inverse) == 0
        for own, ahead, back in zip(slopes, forward, inverse, strict=True):
            free = null_space(own[:3])
            assert back == pytest.approx(own[4:] @ free @ free.T, abs=1e-11)
            assert ahead == pytest.approx(free @ np.linalg.pinv(own[4:] @ free), abs=1e-10)

    def test_kernel_tells_nothing_where_rank_differs_or_an_actuator_does_not_move(self):
        random = np.random.default_rng(0)
        slopes = random.normal(size=(3, 5, 6))
        slopes[0, 1] = slopes[0, 0]  # a constraint less than in general
        slopes[1, 4] = slopes[1, 3]  # two actuators that move as one
        scratch = Handle(new_jacobian_tables(2, 2, 6, 3))
        found = np.zeros((3, 6, 3))
        jacobians(scratch.address, slopes, 1, found)
        assert np.isnan(found[:, 0, 0]).all()  # four freedoms, three actuators
        scratch = Handle(new_jacobian_tables(3, 3, 6, 2))
        found = np.zeros((3, 2, 6))
        assert jacobians(scratch.address, slopes, 0, found) == 1
        assert np.isnan(found[:, 0, 0]).tolist() == [True, False, False]


class TestSingularity:
    @pytest.mark.parametrize("name", CONTROLLED)
    def test_measures_are_the_norms_of_the_jacobians_and_the_twists_attain_them(self, name):
        machine, q = closed(name)
        forward, inverse, near = (
            forward_map(model_of(machine), q),
            inverse_map(model_of(machine), q),
            singularities(model_of(machine), q),
        )
        units = rate_units(machine)[drives(machine)]
        twist = np.ones(forward.shape[1])
        twist[:3] = machine.characteristic_length
        forward, inverse = forward * units / twist[:, None], inverse / units[:, None] * twist
        (closure, twists), generic = first_order(machine, q), generic_of(machine)
        shown = generic.mobility.platform + generic.mobility.internal
        for row, conditions in enumerate(closure):
            resisted = [np.inf, *np.linalg.svd(conditions, compute_uv=False)] if len(conditions) else [np.inf]
            motions = null_space(conditions, 1e-6) if len(conditions) else np.eye(conditions.shape[1])
            seen = np.linalg.svd(np.vstack([twists[row] @ motions, motions[drives(machine)]]), compute_uv=False)
            assert near.constraint[row] == pytest.approx(resisted[generic.rank], rel=1e-9)
            assert near.passive[row] == pytest.approx(seen[shown - 1], rel=1e-9)
        assert near.parallel == pytest.approx(1 / np.linalg.norm(forward, 2, axis=(1, 2)), rel=1e-9)
        assert near.serial == pytest.approx(1 / np.linalg.norm(inverse, 2, axis=(1, 2)), rel=1e-9)
        for row in range(len(q)):
            assert np.linalg.norm(inverse[row] @ near.lost[row]) == pytest.approx(1 / near.serial[row], rel=1e-6)
            assert np.linalg.norm(inverse[row] @ near.gained[row]) == pytest.approx(near.parallel[row], rel=1e-6)

    def test_a_stretched_leg_is_serial_and_loses_the_direction_of_the_leg(self):
        near = at_home(five_bar(0.4, 2.4, 0.0))
        assert near.serial == pytest.approx(0, abs=1e-12)
        assert near.kinds == ("serial",)
        assert near.lost == pytest.approx(np.array([-np.cos(2.4), -np.sin(2.4), 0]) * np.sign(-np.cos(2.4)), abs=1e-9)

    def test_aligned_forearms_are_parallel_and_gain_the_direction_across(self):
        near = at_home(five_bar(0.4, 0.4 + np.pi, 1.0))
        assert near.parallel == pytest.approx(0, abs=1e-12)
        assert near.kinds == ("parallel",)
        assert near.gained == pytest.approx([-np.sin(0.4), np.cos(0.4), 0], abs=1e-9)

    @pytest.mark.parametrize(
        ("kind", "family"),
        [
            ("serial", lambda x: five_bar(0.4, 2.4, x)),
            ("parallel", lambda x: five_bar(0.4, 0.4 + np.pi + x, 1.0)),
            ("parallel", lambda x: fichter(90 + np.degrees(x))),
            ("constraint", four_bar),
            ("passive", lambda x: guarded_rpr(100 * x)),
        ],
        ids=["stretched leg", "aligned forearms", "hexapod at 90 degrees", "flat parallelogram", "stretched guard"],
    )
    def test_measures_go_to_zero_in_proportion_and_only_theirs(self, kind, family):
        sizes = [1e-2, 1e-3, 1e-5, 1e-7]
        found = [at_home(family(x)) for x in [*sizes, 0.0]]
        values = np.array([getattr(each, kind) for each in found])
        assert values[:-1] / sizes == pytest.approx(np.full(4, values[2] / sizes[2]), rel=0.05)
        assert values[-1] < 1e-9
        for other in set(KINDS) - {kind}:
            before = [getattr(each, other) for each in found[1:4]]
            assert before == pytest.approx([before[0]] * 3, rel=0.05)
            assert min(before) > TOLERANCES.singular
        assert [each.kinds for each in found[:2]] == [(), ()]
        assert kind in found[3].kinds
        assert kind in found[4].kinds

    def test_a_hexapod_at_ninety_degrees_gains_a_screw_that_no_strut_resists(self):
        machine = fichter(90)
        near = at_home(machine)
        assert near.kinds == ("parallel",)
        twist = near.gained * ([machine.characteristic_length] * 3 + [1] * 3)
        assert np.abs(twist[[0, 1, 3, 4]]).max() < 1e-9
        for name in machine.actuator_names:
            a, c = (np.array(machine.joint(each).at) for each in machine.joint(name).along)
            d = (c - a) / np.linalg.norm(c - a)
            assert d @ (twist[:3] + np.cross(twist[3:], c - machine.reference_point)) == pytest.approx(0, abs=1e-9)

    def test_lines_of_planar_legs_through_one_point_gain_the_rotation_about_it(self):
        joints = []
        for i, angle in enumerate((90, 210, 330)):
            out = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0])
            joints += [
                Joint(f"A{i}", "revolute", ("base", f"c{i}"), at=200 * out, axis=Z),
                Joint(f"B{i}", "prismatic", (f"c{i}", f"r{i}"), axis=out, actuated=True),
                Joint(f"C{i}", "revolute", (f"r{i}", "platform"), at=50 * out, axis=Z),
            ]
        near = at_home(Mechanism("3-RPR", joints, "platform", (0, 0, 0)))
        assert near.kinds == ("parallel",)
        assert near.gained == pytest.approx([0, 0, 0, 0, 0, 1], abs=1e-9)

    def test_a_stretched_passive_leg_loses_the_motion_along_itself(self):
        machine = guarded_rpr(0.0)
        near = at_home(machine)
        assert near.kinds == ("passive",)
        expected = np.array([machine.characteristic_length, 0, 0, 0, 0, -20])
        assert near.lost == pytest.approx(expected / np.linalg.norm(expected), abs=1e-9)

    def test_a_flat_parallelogram_gains_a_motion_of_its_coupler(self):
        near = at_home(four_bar(0.0))
        assert "constraint" in near.kinds
        assert np.isfinite(near.gained).all()
        assert np.abs(near.gained[[2, 3, 4]]).max() < 1e-9

    def test_legs_that_all_resist_horizontal_rotations_gain_the_vertical_one(self):
        leg = np.array([-50 * np.cos(np.radians(240)), -50 * np.sin(np.radians(240)), 130])
        machine = tsai_upu([Z, Z, leg * [1, 0, 1]])
        assert mobility(machine) == Mobility(3, 3, 0, 0, 3, 0, 0)
        near = at_home(machine)
        assert near.constraint == pytest.approx(0, abs=1e-12)
        assert near.kinds[-1] == "constraint"
        twist = near.gained * ([machine.characteristic_length] * 3 + [1] * 3)
        assert twist[3:5] / twist[5] == pytest.approx([0, 0], abs=1e-9)
        for name in machine.actuator_names:  # the actuators hold every strut's length
            a, c = (np.array(machine.joint(each).at) for each in machine.joint(name).along)
            velocity = twist[:3] + np.cross(twist[3:], c - machine.reference_point)
            assert (c - a) @ velocity == pytest.approx(0, abs=1e-9 * np.linalg.norm(c - a) * np.linalg.norm(velocity))

    def test_missing_actuators_are_a_parallel_singularity_everywhere(self):
        machine = MACHINES["serial_spherical"]()
        q = home(machine)
        q[0, columns(machine)["s2"]] = 0.4, 0.3, -0.2
        near = singularities(model_of(machine), q)
        assert near.parallel == pytest.approx(0, abs=1e-12)
        assert near.kinds == [("parallel",)]

    def test_exactly_singular_jacobians_leave_the_singular_direction_out(self):
        stretched = five_bar(0.4, 2.4, 0.0)
        inverse = inverse_map(model_of(stretched), home(stretched))[0]
        assert np.linalg.norm(inverse) < 10
        assert inverse @ [np.cos(2.4), np.sin(2.4), 0] == pytest.approx([0, 0], abs=1e-9)
        aligned = five_bar(0.4, 0.4 + np.pi, 1.0)
        forward = forward_map(model_of(aligned), home(aligned))[0]
        assert np.linalg.norm(forward) < 10
        assert forward.T @ [-np.sin(0.4), np.cos(0.4), 0] == pytest.approx([0, 0], abs=1e-9)

    @pytest.mark.parametrize("name", ["hexapod_ups", "tripod_rps", "planar_prr", "five_bar", "mixed", "tsai_upu"])
    def test_unit_place_and_order_do_not_matter(self, name):
        machine = EVERY[name]().without_limits()
        plain = at_home(machine)
        shift = 5 * machine.characteristic_length * np.array([1, -2, 1])
        others = [
            redescribed.scaled(machine, 1000.0),
            redescribed.moved(machine, TURN, shift),
            redescribed.relabelled(machine, np.random.default_rng(0))[0],
        ]
        for other, turn in zip(others, (np.eye(3), TURN, np.eye(3)), strict=True):
            near = at_home(other)
            for kind in KINDS:
                assert getattr(near, kind) == pytest.approx(getattr(plain, kind), rel=1e-6)
            assert mobility(other) == mobility(machine)
            if name == "hexapod_ups":  # its directions are unique
                turned = np.concatenate([turn @ plain.lost[:3], turn @ plain.lost[3:]])
                assert abs(near.lost @ turned) == pytest.approx(1, abs=1e-6)

    @pytest.mark.parametrize("factor", [0.5, 2.0])
    def test_kinds_are_named_below_the_threshold_only(self, factor):
        slope = at_home(five_bar(0.4, 2.4, 1e-3)).serial / 1e-3
        near = at_home(five_bar(0.4, 2.4, factor * TOLERANCES.singular / slope))
        assert near.kinds == (("serial",) if factor < 1 else ())


def test_an_arm_of_fewer_joints_than_directions_loses_those_along_and_about_its_line_when_stretched() -> None:
    bodies, axes = ("base", "l1", "l2", "l3", "l4", "tool"), ((0, 1, 0), (0, 0, 1))
    joints = [
        Joint(f"j{k}", "revolute", bodies[k : k + 2], at=(k, 0, 0), axis=axes[k % 2], actuated=True) for k in range(5)
    ]
    machine = Mechanism("stretched arm", joints, "tool", reference_point=(5, 0, 0), task=("x", "y", "z"))
    near = pf.singularity(pf.solve_ik(machine, machine.home_pose))
    assert "serial" in near.kinds
    np.testing.assert_allclose(near.lost[[1, 2, 4, 5]], 0.0, atol=1e-12)  # rounding


def test_mobility_is_the_same_in_every_call_and_warns_of_nothing():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        first = generic_of(pf.load("nrpm")).mobility
        assert mobility(pf.load("nrpm")) == generic_of(pf.load("nrpm")).mobility == first
