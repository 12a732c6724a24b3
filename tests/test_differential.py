"""Mobility, Jacobians and singularities: published counts, central differences, and machines built singular."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import INTERPRETED
from machines import five_bar as planar_five_bar
from machines import machine as named
from machines import planar, redescribed, ring, struts
from oracles import targets_about
from pfabrik import Joint, Mechanism, Solution
from pfabrik.answers.differential import Mobility, forward_jacobian, inverse_jacobian, mobility, singularity
from pfabrik.engines.joints.first_order import forward_map, inverse_map, units_of
from pfabrik.errors import InvalidArgument
from pfabrik.machine.model import model_of
from pfabrik.machine.motion.displacements import columns
from pfabrik.machine.motion.loops import actuated_columns, first_order
from pfabrik.machine.motion.mobility import generic_of
from pfabrik.machine.motion.singularities import KINDS
from pfabrik.tolerances import TOLERANCES
from slopes import beside, slope_of_pose, slopes, somewhere

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


def four_bar(angle: float = 1.2) -> Mechanism:
    """A parallelogram in a plane."""
    crank = 2.0 * np.array([np.cos(angle), np.sin(angle), 0])
    return loop([0 * X, crank, crank + 5 * X, 5 * X], [Z] * 4)


def five_bar(first: float, second: float, bend: float) -> Mechanism:
    """Cranks of 1 and forearms at given angles about z, and the right elbow bent by `bend`; the tip is at (0, 2)."""
    tip, turn = np.array([0.0, 2.0]), lambda angle: np.array([np.cos(angle), np.sin(angle)])
    left, right = tip - turn(first), tip - 1.2 * turn(second)
    return planar_five_bar([left - [0.2, 1.0], right - turn(second - bend)], [left, right], tip)


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


def guarded_rpr(elbow: float) -> Mechanism:
    """Planar 3-RPR with a fourth, passive leg along x whose elbow is off the straight line by `elbow`."""
    joints = list(planar("RPR").joints)
    joints += [
        Joint("G1", "revolute", ("base", "upper"), at=(300, 20, 0), axis=Z),
        Joint("G2", "revolute", ("upper", "lower"), at=(150, 20 + elbow, 0), axis=Z),
        Joint("G3", "revolute", ("lower", "platform"), at=(40, 20, 0), axis=Z),
    ]
    return Mechanism("guarded", joints, "platform", (0, 0, 0))


def home(machine: Mechanism) -> Solution:
    return pf.configuration(machine, [coordinate.home for coordinate in machine.coordinates])


def at_home(machine: Mechanism):
    return singularity(home(machine))


def bent(joint: str, turn: tuple[float, float, float]) -> Solution:
    """The chain of ball joints with one of them turned."""
    machine = named("serial_spherical")
    q = np.zeros(len(machine.coordinates))
    q[columns(machine)[joint]] = turn
    return pf.configuration(machine, q)


# Mobility


@pytest.mark.parametrize(
    ("which", "expected"),
    [
        ("hexapod_ups", (6, 6, 0, 0, 6, 0, 0)),
        ("hexapod_rus", (12, 6, 0, 6, 6, 0, 0)),
        ("tripod_rps", (3, 3, 0, 0, 3, 0, 0)),
        ("tripod_prs", (3, 3, 0, 0, 3, 0, 0)),
        ("planar_rrr", (3, 3, 0, 0, 3, 0, 6)),
        ("mixed", (5, 5, 0, 0, 5, 0, 0)),
        ("serial_planar", (5, 2, 2, 1, 4, 0, 0)),
        ("stewart", (6, 6, 0, 0, 6, 0, 0)),
        ("five_bar", (2, 2, 0, 0, 2, 0, 3)),
        ("nrpm", (12, 6, 6, 0, 12, 0, 0)),
        (lambda: similar_hexagons("spherical"), (12, 6, 0, 6, 6, 1, 0)),
        ("upu", (3, 3, 0, 0, 3, 0, 0)),
        (bennett, (1, 1, 0, 0, 1, 0, 3)),
        (sarrus, (1, 1, 0, 0, 1, 0, 1)),
        (four_bar, (1, 1, 0, 0, 1, 0, 3)),
    ],
)
def test_published_counts(which, expected):
    assert mobility(named(which) if isinstance(which, str) else which()) == Mobility(*expected)


def test_home_in_a_singularity_is_not_taken_for_the_general_case():
    assert mobility(four_bar(0.0)).mobility == 1
    assert mobility(five_bar(0.4, 0.4 + np.pi, 1.0)) == mobility(five_bar(0.4, 2.4, 0.0))
    assert mobility(fichter(90)) == Mobility(6, 6, 0, 0, 6, 0, 0)


def test_similar_hexagons_are_singular_everywhere():
    machine = similar_hexagons("universal")
    assert mobility(machine) == Mobility(6, 6, 0, 0, 6, 1, 0)
    assert at_home(machine).kinds == ("parallel",)


def test_redundancy_counts_actuators_beyond_the_freedoms_of_the_end_effector():
    assert mobility(pf.load("nrpm")).redundancy == 6
    assert mobility(named("serial_spherical")).redundancy == -2
    assert mobility(named("serial_spherical")).uncontrolled == 3


def test_actuators_on_every_joint_are_redundant_but_control_everything():
    joints = [dataclasses.replace(joint, actuated=True) for joint in five_bar(0.4, 2.4, 1.0).joints]
    found = mobility(Mechanism("all driven", joints, "tip"))
    assert found == Mobility(2, 2, 0, 0, 5, 0, 3)
    assert found.redundancy == 3


def test_a_frame_does_not_move():
    joints = [
        Joint("A", "revolute", ("base", "bar"), at=(0, 0, 0), axis=Z, actuated=True),
        Joint("B", "revolute", ("base", "bar"), at=(1, 0, 0), axis=Z),
    ]
    machine = Mechanism("frame", joints, "bar", (2, 0, 0))
    assert mobility(machine) == Mobility(0, 0, 0, 0, 1, 0, 4)
    found = at_home(machine)
    assert (found.serial, found.parallel, found.kinds) == (np.inf, np.inf, ())
    assert np.isnan(found.lost).all()
    assert np.array_equal(forward_jacobian(home(machine)), np.zeros((6, 1)))


# Jacobians


def skewed() -> Mechanism:
    """Universal joints whose axes are not square to each other."""
    axes = (X, (0.6, 1, 0.2))
    machine = named("hexapod_ups")
    change = lambda each: dataclasses.replace(each, axes=axes) if each.type == "universal" else each  # noqa: E731
    return redescribed.with_joints(machine, change)


FREE = [name for name in pf.catalog() if name != "snake60"]
OTHERS = ["hexapod_ups", "hexapod_rus", "tripod_prs", "planar_rrr", "mixed", "serial_planar", "upu", "skewed"]


@pytest.mark.parametrize("name", OTHERS if INTERPRETED else FREE + OTHERS)
def test_what_is_of_first_order_is_the_slope_of_forward_kinematics(name):
    """Jacobians, the rates of joints, and the actuators' forces, which do no work with what they hold."""
    here = somewhere(skewed() if name == "skewed" else named(name))
    machine, near, rng = here.mechanism, beside(here), np.random.default_rng(1)
    assert near
    forward, inverse, expected = forward_jacobian(here), inverse_jacobian(here), slope_of_pose(near)
    twists, actuators = units_of(model_of(machine))
    scaled, off = forward * actuators / twists[:, None], (forward - expected) * actuators / twists[:, None]
    assert (np.abs(off).max(axis=0) < 1e-6 * np.abs(scaled).max(axis=0)).all()
    assert inverse / actuators[:, None] * twists == pytest.approx(np.linalg.pinv(scaled, rcond=1e-9), abs=1e-9)
    for joint in [each for each in machine.joints if each.type not in ("spherical", "fixed")][:12]:
        values = near.joints[joint.name].reshape(2, len(actuators), -1)
        rates = slopes(machine, values)
        found = pf.transmission(here, joint.name).rates
        np.testing.assert_allclose(found, rates, atol=1e-5 * max(1.0, np.abs(rates).max()))
    wrench, rates = rng.uniform(-1, 1, len(twists)), rng.uniform(-1, 1, len(actuators))
    scale = np.abs(forward * wrench[:, None] * rates).sum()
    loads = {machine.end_effector_body: (0.0, machine.reference_point)}  # by the equilibrium of all bodies
    for held, most in ((pf.forces(here, wrench), 1e-12), (pf.forces(here, wrench, loads=loads), 1e-9)):
        assert abs(held.actuators @ rates + wrench @ forward @ rates) <= most * scale


def test_free_freedoms_rest_as_far_as_they_can():
    along = Rotation.from_rotvec((0.3, -0.2, 0.1)).apply(Z)  # all links are in line: no ball moves the tip so
    assert forward_jacobian(bent("s1", (0.3, -0.2, 0.1)))[:, 0] == pytest.approx(along[0] * along, abs=1e-12)


@pytest.mark.parametrize("shape", [(), (0,), (2,), (1, 2)])
def test_results_take_the_shape_of_the_solution(shape):
    machine = pf.load("stewart")
    found = pf.solve_ik(machine, np.broadcast_to(machine.home_pose, (*shape, 4, 4)))
    assert forward_jacobian(found).shape == inverse_jacobian(found).shape == (*shape, 6, 6)
    near = singularity(found)
    assert np.shape(near.serial) == np.shape(near.parallel) == np.shape(near.passive) == shape
    assert near.lost.shape == near.gained.shape == (*shape, 6)
    assert near.kinds == () if shape == () else near.kinds == [()] * int(np.prod(shape))


def test_invalid_rows_are_nan_and_leave_the_others_alone():
    machine = pf.load("stewart")
    targets = np.stack([machine.home_pose, np.full((4, 4), np.nan), machine.home_pose])
    marked = pf.solve_ik(machine, targets, options=pf.Options(on_invalid="mark"))
    q = marked._coordinates
    for found in (forward_jacobian(marked), inverse_jacobian(marked), *(of(model_of(machine), q) for of in MAPS)):
        assert np.isnan(found[1]).all() and np.isfinite(found[[0, 2]]).all() and np.array_equal(found[0], found[2])
    near = singularity(marked)
    assert np.isnan([near.serial[1], near.parallel[1], near.constraint[1], near.passive[1]]).all()
    assert np.isnan([near.lost[1], near.gained[1]]).all() and near.kinds == [(), (), ()]


def test_what_is_no_solution_is_refused():
    for function in (forward_jacobian, inverse_jacobian, singularity, pf.closure_residual):
        with pytest.raises(InvalidArgument, match="solution: found ndarray; expected a Solution"):
            function(np.zeros((2, 36)))


MAPS = (forward_map, inverse_map)
"""Jacobians by all joint coordinates, which those of legs are compared with."""


def assert_those_of_joint_coordinates(solution, tolerance):
    """Largest differences relative to the largest entry, with lengths in L."""
    model, q = model_of(solution.mechanism), solution._coordinates
    twists, actuators = units_of(model)
    scales = actuators / twists[:, None], twists / actuators[:, None]
    for found, of, scale in zip((forward_jacobian(solution), inverse_jacobian(solution)), MAPS, scales, strict=True):
        expected = scale * of(model, q)
        largest = np.abs(expected).max(axis=(1, 2), keepdims=True)
        assert (np.abs(scale * found - expected) <= tolerance * np.where(largest > 0.0, largest, 1.0)).all()


OF_LEGS = [name for name in pf.catalog() if name not in ("nrpm", "panda", "serial_arm", "snake60")]


@pytest.mark.parametrize("name", OF_LEGS)
def test_jacobians_of_legs_are_those_of_all_joint_coordinates_in_batches_and_alone(name):
    """In and out of reach: some are stretched, most are limited, and tasks leave some of the pose open.

    Nobody asks for joint coordinates, which take time.
    """
    machine = pf.load(name)
    batch = pf.solve_ik(machine, targets_about(machine, np.random.default_rng(5), 24, 0.3, 0.3))
    one = pf.solve_ik(machine, batch.pose[3])
    alone = forward_jacobian(one), inverse_jacobian(one)
    assert "coordinates" not in vars(one._configurations)
    assert np.array_equal(alone[0], forward_jacobian(pf.solve_ik(machine, batch.pose[3:4]))[0])
    for solution in (batch, pf.solve_fk(machine, batch.actuators[:6]), batch[3:4]):
        assert_those_of_joint_coordinates(solution, 1e-11)


@pytest.mark.parametrize("name", ["delta", "hexaglide", "rrr", "servo_hexapod"])
def test_at_dead_points_and_next_to_them_they_are_those_of_joint_coordinates(name):
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
    assert_those_of_joint_coordinates(pf.solve_ik(machine, targets), 1e-10)


def test_a_strut_along_the_outer_hinge_of_its_universal_joint_loses_a_freedom():
    """Nothing of the strut's length says so: its foot cannot swing across both hinges."""
    bases = np.array(ring(100, 0, [-10, 10, 110, 130, 230, 250]))
    tops = np.array(ring(60, 120, [-50, 50, 70, 170, 190, 290]))
    outer = np.array([0.6, 0.0, 0.8])
    machine = hexapod(bases, tops)
    axes = (outer, np.cross(outer, tops[0] - bases[0]))
    machine = redescribed.with_joints(machine, lambda j: dataclasses.replace(j, axes=axes) if j.name == "A1" else j)
    away = np.array([0.0, 1e-6, 1e-3, 0.1])
    targets = np.repeat(machine.home_pose[None], len(away), axis=0)
    targets[:, :3, 3] += bases[0] + 150.0 * outer - tops[0] + 150.0 * away[:, None] * Y
    solution = pf.solve_ik(machine, targets)
    assert solution
    assert_those_of_joint_coordinates(solution, 1e-11)
    inverse = inverse_jacobian(solution)
    ranks = np.linalg.matrix_rank(inverse / np.linalg.norm(inverse, axis=(1, 2), keepdims=True), tol=1e-6)
    assert ranks.tolist() == [5, 6, 6, 6]


# Singularities


@pytest.mark.parametrize("name", ["hexapod_ups", "tripod_rps", "planar_rrr", "mixed", "five_bar", "nrpm", "upu", "psu"])
def test_measures_are_the_norms_of_the_jacobians_and_the_twists_attain_them(name):
    here = somewhere(named(name), 2)
    machine, q, near = here.mechanism, here._coordinates, singularity(here)
    twists, actuators = units_of(model_of(machine))
    forward = forward_jacobian(here) * actuators / twists[:, None]
    inverse = inverse_jacobian(here) / actuators[:, None] * twists
    (closure, rates), generic = first_order(machine, q), generic_of(machine)
    driven, shown = actuated_columns(machine), generic.mobility.platform + generic.mobility.internal
    for row, conditions in enumerate(closure):
        resisted = [np.inf, *np.linalg.svd(conditions, compute_uv=False)]
        motions = null_space(conditions, 1e-6)
        seen = np.linalg.svd(np.vstack([rates[row] @ motions, motions[driven]]), compute_uv=False)
        assert near.constraint[row] == pytest.approx(resisted[generic.rank], rel=1e-9)
        assert near.passive[row] == pytest.approx(seen[shown - 1], rel=1e-9)
        assert np.linalg.norm(inverse[row] @ near.lost[row]) == pytest.approx(1 / near.serial[row], rel=1e-6)
        assert np.linalg.norm(inverse[row] @ near.gained[row]) == pytest.approx(near.parallel[row], rel=1e-6)
    assert near.parallel == pytest.approx(1 / np.linalg.norm(forward, 2, axis=(1, 2)), rel=1e-9)
    assert near.serial == pytest.approx(1 / np.linalg.norm(inverse, 2, axis=(1, 2)), rel=1e-9)


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
def test_measures_go_to_zero_in_proportion_and_only_theirs(kind, family):
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


def test_what_is_lost_or_gained_is_left_out_of_exactly_singular_jacobians():
    """Along a stretched leg; across forearms in line."""
    stretched, aligned = (home(five_bar(0.4, *angles)) for angles in ((2.4, 0.0), (0.4 + np.pi, 1.0)))
    for solution, which, jacobian, way in (
        (stretched, "lost", inverse_jacobian(stretched), [np.cos(2.4), np.sin(2.4), 0.0]),
        (aligned, "gained", forward_jacobian(aligned).T, [-np.sin(0.4), np.cos(0.4), 0.0]),
    ):
        assert abs(getattr(singularity(solution), which) @ way) == pytest.approx(1.0, abs=1e-9)
        assert np.linalg.norm(jacobian) < 10
        assert jacobian @ way == pytest.approx([0, 0], abs=1e-9)


def test_a_stretched_passive_leg_loses_the_motion_along_itself_and_a_flat_parallelogram_gains_one_in_its_plane():
    machine = guarded_rpr(0.0)
    near, flat = at_home(machine), at_home(four_bar(0.0))
    assert near.kinds == ("passive",) and "constraint" in flat.kinds
    expected = np.array([machine.characteristic_length, 0, 0, 0, 0, -20])
    assert near.lost == pytest.approx(expected / np.linalg.norm(expected), abs=1e-9)
    assert np.isfinite(flat.gained).all() and np.abs(flat.gained[[2, 3, 4]]).max() < 1e-9


def test_a_hexapod_at_ninety_degrees_gains_a_screw_that_no_strut_resists():
    machine = fichter(90)
    near = at_home(machine)
    assert near.kinds == ("parallel",)
    twist = near.gained * ([machine.characteristic_length] * 3 + [1] * 3)
    assert np.abs(twist[[0, 1, 3, 4]]).max() < 1e-9
    for name in machine.actuator_names:
        a, c = (np.array(machine.joint(each).at) for each in machine.joint(name).along)
        d = (c - a) / np.linalg.norm(c - a)
        assert d @ (twist[:3] + np.cross(twist[3:], c - machine.reference_point)) == pytest.approx(0, abs=1e-9)


def test_missing_actuators_are_a_parallel_singularity_everywhere():
    near = singularity(bent("s2", (0.4, 0.3, -0.2)))
    assert near.parallel == pytest.approx(0, abs=1e-12)
    assert near.kinds == ("parallel",)


@pytest.mark.parametrize("name", ["hexapod_ups", "tripod_rps", "planar_prr", "five_bar", "upu"])
def test_unit_place_and_order_do_not_matter(name):
    machine = named(name).without_limits()
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
def test_kinds_are_named_below_the_threshold_only(factor):
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
