"""A machine with another geometry: its records are those of a machine made anew, to the last bit, or there are none."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from functools import lru_cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from machines import MACHINES, closure, published
from machines.trunks import TRUNKS
from pfabrik.decomposition.leg_table import LegTable, leg_table
from pfabrik.decomposition.rewritten import rewritten
from pfabrik.decomposition.tape import Tape
from pfabrik.description.enclosing import enclosing_radius
from pfabrik.description.geometry import (
    Geometry,
    geometry_of,
    home_numbers,
    numbers_with,
    with_geometry,
    with_numbers,
)
from pfabrik.description.joint_types import JOINT_TYPES
from pfabrik.description.structure import Structure
from pfabrik.files import dumps, loads
from pfabrik.kernels import tape as operations
from pfabrik.kernels.enclosing import N_PLACES
from pfabrik.kernels.home import measure_home
from pfabrik.kernels.replay import replay
from pfabrik.model import Model, model_of
from test_compiled_and_interpreted import INTERPRETED

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
COMPILED = pytest.mark.skipif(INTERPRETED, reason="NumPy warns where numbers overflow, which compiled code does not")

Change = Callable[[pf.Mechanism, Geometry], Geometry]
LITERATURE = (
    *(published.planar_arm, published.tripod, published.similar_hexagons, published.seven_struts),
    published.four_rails,
)
MAKERS = MACHINES | closure.MACHINES | closure.ON_ARMS | TRUNKS | {make.__name__: make for make in LITERATURE}
NAMES = [*pf.catalog(), *(f"tests/{name}" for name in MAKERS)]
ARRAYS = ("legs", "aimed", "limited", "cones", "driven", "known", "task")


@lru_cache
def machine(name: str) -> pf.Mechanism:
    return MAKERS[name.removeprefix("tests/")]() if name.startswith("tests/") else pf.load(name)


class Unchecked(pf.Mechanism):
    """A new mechanism whose home may be beyond its limits."""

    def __post_init__(self) -> None:
        Structure.__post_init__(self)


def made_anew(mechanism: pf.Mechanism, kind: type[pf.Mechanism] = Unchecked) -> pf.Mechanism:
    """A mechanism of the same description, from plain numbers."""
    fields = {field.name: getattr(mechanism, field.name) for field in dataclasses.fields(mechanism)}
    joints = [
        dataclasses.replace(
            joint,
            **{name: value and np.array(value) for name in ("at", "axis", "axes") for value in [getattr(joint, name)]},
        )
        for joint in mechanism.joints
    ]
    if mechanism.end_effector_is_joint:
        fields["reference_point"] = None
    return kind(**fields | {"joints": joints})


def moved(mechanism: pf.Mechanism, geometry: Geometry) -> Geometry:
    shift = np.array([0.3, -0.2, 0.7]) * mechanism.characteristic_length
    return geometry._replace(points=geometry.points + shift, reference_point=geometry.reference_point + shift)


def scaled(mechanism: pf.Mechanism, geometry: Geometry) -> Geometry:
    lengths = [coordinate.kind == "length" for coordinate in mechanism.coordinates]
    points, home, point = geometry.points, geometry.home, geometry.reference_point
    return geometry._replace(points=1.7 * points, home=home * np.where(lengths, 1.7, 1.0), reference_point=1.7 * point)


def turned(mechanism: pf.Mechanism, geometry: Geometry) -> Geometry:
    R = Rotation.from_rotvec([0.4, -0.9, 0.5]).as_matrix()
    return Geometry(geometry.points @ R.T, geometry.axes @ R.T, geometry.home, R @ geometry.reference_point)


def recounted(mechanism: pf.Mechanism, geometry: Geometry) -> Geometry:
    """Coordinates count from elsewhere, and targets place another point."""
    offsets = np.random.default_rng(2).normal(size=geometry.home.shape) * 0.01
    shift = 0.1 * mechanism.characteristic_length
    return geometry._replace(home=geometry.home + offsets, reference_point=geometry.reference_point + shift)


def shifted(*types: str) -> Change:
    """Joints of some types off by a hundredth of the machine in all directions."""

    def shift(mechanism: pf.Mechanism, geometry: Geometry) -> Geometry:
        offsets = np.random.default_rng(1).normal(size=geometry.points.shape) * 0.01 * mechanism.characteristic_length
        chosen = np.array([joint.type in types for joint in mechanism.joints])
        return geometry._replace(points=geometry.points + chosen[:, None] * offsets)

    return shift


ALIKE = {"moved": moved, "scaled": scaled, "turned": turned, "recounted": recounted}
OTHERS = {
    "ball and universal joints shifted": shifted("spherical", "universal"),
    "hinges shifted": shifted("revolute", "cylindrical"),
    "all shifted": shifted(*JOINT_TYPES),
}


def differences(table: LegTable, other: LegTable) -> list[str]:
    return [name for name in ARRAYS if getattr(table, name).tobytes() != getattr(other, name).tobytes()]


def table_with(mechanism: pf.Mechanism, geometry: Geometry) -> LegTable | None:
    table = leg_table(mechanism)
    return rewritten(table, numbers_with(mechanism, geometry))


@pytest.mark.parametrize("name", NAMES)
def test_the_same_geometry_makes_an_equal_mechanism(name: str) -> None:
    mechanism = machine(name)
    geometry = geometry_of(mechanism)
    made = with_geometry(mechanism, geometry)
    assert made == mechanism
    assert hash(made) == hash(mechanism)
    assert made.characteristic_length == mechanism.characteristic_length
    for given, taken in zip(geometry, geometry_of(made), strict=True):
        np.testing.assert_array_equal(given, taken)


@pytest.mark.parametrize("name", NAMES)
def test_what_is_written_of_another_geometry_reads_as_its_equal(name: str) -> None:
    mechanism = machine(name)
    made = with_geometry(mechanism, moved(mechanism, geometry_of(mechanism)))
    assert loads(dumps(made)) == made
    assert made_anew(made, pf.Mechanism) == made


@pytest.mark.parametrize("name", NAMES)
def test_records_are_those_of_a_machine_made_anew_or_it_has_other_legs(name: str) -> None:
    mechanism = machine(name)
    model = Model(mechanism)
    if not model.has_legs:
        return
    table = model.legs
    for how, change in (ALIKE | OTHERS).items():
        numbers = numbers_with(mechanism, change(mechanism, geometry_of(mechanism)))
        made = with_numbers(mechanism, numbers)
        again = rewritten(table, numbers)
        if again is None:
            assert how not in ALIKE, how
            continue
        anew = leg_table(made_anew(made))
        assert not differences(again, anew), how
        assert again.limits == anew.limits
        for given, taken in zip(geometry_of(made), geometry_of(made_anew(made)), strict=True):
            np.testing.assert_array_equal(given, taken)


@pytest.mark.parametrize("name", ["stewart", "servo_hexapod", "five_bar", "nrpm", "tests/hexaglide"])
def test_what_calibration_varies_keeps_the_form_of_common_legs(name: str) -> None:
    mechanism = machine(name)
    geometry = geometry_of(mechanism)
    for change in (shifted("spherical", "universal"), recounted):
        assert table_with(mechanism, change(mechanism, geometry)) is not None


def test_a_crank_may_be_lengthened() -> None:
    mechanism = machine("servo_hexapod")
    geometry = geometry_of(mechanism)
    for joint in mechanism.joints:
        if joint.type == "revolute":
            elbow = next(k for k, other in enumerate(mechanism.joints) if joint.connects[1] in other.connects[:1])
            geometry.points[elbow] += 0.2 * (geometry.points[elbow] - np.array(joint.at))
    made, again = with_geometry(mechanism, geometry), table_with(mechanism, geometry)
    anew = leg_table(made_anew(made))
    assert again is not None
    assert not differences(again, anew)
    longer = np.linalg.norm(again.legs["crank"], axis=1) * made.characteristic_length
    shorter = leg_table(mechanism).legs["crank"]
    np.testing.assert_allclose(longer, 1.2 * np.linalg.norm(shorter, axis=1) * mechanism.characteristic_length)


@pytest.mark.parametrize("name", ["stewart", "delta", "nrpm", "five_bar", "reachy_mini"])
def test_a_model_with_another_geometry_answers_as_a_machine_made_anew(name: str) -> None:
    mechanism = machine(name)
    geometry = moved(mechanism, geometry_of(mechanism))
    made = model_of(mechanism).with_geometry(*geometry).mechanism
    anew = made_anew(made)
    target = made.home_pose.copy()
    target[:3, 3] += 0.01 * made.characteristic_length * np.array([1.0, 0.5, 0.0])
    for ask in (pf.solve_ik, lambda m, at: pf.solve_fk(m, pf.solve_ik(m, at).actuators)):
        ours, theirs = ask(made, target), ask(anew, target)
        assert ours.status == theirs.status
        np.testing.assert_array_equal(ours.pose, theirs.pose)
        np.testing.assert_array_equal(ours.q, theirs.q)


def tilted(mechanism: pf.Mechanism, joint: pf.Joint, by: float) -> Geometry:
    """A machine's geometry with the axis of one joint tilted by an angle [rad]."""
    geometry, index = geometry_of(mechanism), mechanism.joints.index(joint)
    axis = np.array(joint.axis)
    geometry.axes[index, 0] = axis + by * np.cross(axis, [0.6, 0.64, 0.48])
    return geometry


def test_a_tilted_hinge_of_a_planar_machine_is_read_anew() -> None:
    mechanism = machine("five_bar")
    for joint in mechanism.joints:
        if joint.name != mechanism.end_effector:  # which is a point
            geometry = tilted(mechanism, joint, 1e-3)
            assert table_with(mechanism, geometry) is None, joint.name


def test_a_hinge_off_the_strut_that_it_was_along_makes_another_leg() -> None:
    mechanism = machine("ucu")
    joint = next(each for each in mechanism.joints if each.type == "revolute")
    geometry = tilted(mechanism, joint, 1e-4)
    assert table_with(mechanism, geometry) is None
    anew = leg_table(made_anew(with_geometry(mechanism, geometry)))
    assert len(anew.legs) > len(leg_table(mechanism).legs)


def test_a_slide_that_has_turned_over_is_read_anew() -> None:
    mechanism = machine("tests/ranged_stewart")
    table = leg_table(mechanism)
    geometry = geometry_of(mechanism)
    index = next(k for k, each in enumerate(mechanism.joints) if each.type == "prismatic" and each.axis is not None)
    geometry.axes[index] *= -1.0
    assert rewritten(table, numbers_with(mechanism, geometry)) is None
    assert Model(made_anew(with_geometry(mechanism, geometry))).has_legs


@COMPILED
@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf])
def test_numbers_that_are_not_finite_make_no_records(number: float) -> None:
    for name in ("stewart", "five_bar", "delta"):
        mechanism = machine(name)
        for field in ("points", "home", "reference_point"):
            geometry = geometry_of(mechanism)
            getattr(geometry, field)[0] = number
            if field == "reference_point" and mechanism.end_effector_is_joint:
                continue  # it is the joint's centre, whatever is given
            if field == "home" and mechanism.coordinates[0].name not in mechanism.actuator_names:
                continue
            assert table_with(mechanism, geometry) is None, field


def test_an_axis_without_a_direction_makes_no_records() -> None:
    for name in ("five_bar", "delta", "tests/hexaglide"):
        mechanism = machine(name)
        for index, joint in enumerate(mechanism.joints):
            geometry = geometry_of(mechanism)
            if joint.axis is not None and joint.name != mechanism.end_effector:
                geometry.axes[index] = 0.0
                assert table_with(mechanism, geometry) is None


def test_directions_become_unit_vectors_as_in_a_new_mechanism() -> None:
    mechanism = machine("five_bar")
    geometry = geometry_of(mechanism)
    made = with_geometry(mechanism, geometry._replace(axes=3.0 * geometry.axes))
    assert made_anew(made, pf.Mechanism) == made
    np.testing.assert_allclose(np.linalg.norm(geometry_of(made).axes[:, 0], axis=1), 1.0, rtol=0, atol=1e-15)


def test_what_follows_from_other_numbers_is_not_read() -> None:
    mechanism = machine("stewart")
    geometry = geometry_of(mechanism)
    slides = [k for k, joint in enumerate(mechanism.joints) if joint.along is not None]
    columns = [each.column for each in mechanism.coordinates if each.joint.along is not None]
    assert slides
    wrong = Geometry(*(each.copy() for each in geometry))
    wrong.axes[slides] = [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    wrong.home[columns] = 7.0
    assert with_geometry(mechanism, wrong) == mechanism
    five_bar = machine("five_bar")
    wrong = geometry_of(five_bar)._replace(reference_point=np.full(3, np.nan))
    assert with_geometry(five_bar, wrong) == five_bar


@pytest.mark.parametrize("name", ["agile_eye", "tests/hinge", "tests/slider"])
def test_machines_all_of_whose_centres_coincide_have_a_length_too(name: str) -> None:
    mechanism = machine(name)
    geometry = geometry_of(mechanism)
    for shift in ([0.0, 0.3, 0.4], [0.0, 0.0, 0.0]):
        made = with_geometry(mechanism, geometry._replace(reference_point=geometry.reference_point + shift))
        assert made.characteristic_length == made_anew(made).characteristic_length > 0.0
        assert home_numbers(made)[0] == made.characteristic_length


def steps_with(rng: np.random.Generator) -> tuple[Tape, np.ndarray]:
    """A tape with every operation several times, of numbers of all sizes, and the numbers that it was given."""
    given = rng.normal(size=60) * 10.0 ** rng.integers(-8, 8, 60)
    given[:6] = 0.0, -0.0, 1.0, 1e-310, 1e160, -1.0
    tape = Tape(given.tolist())
    for operation in range(len(operations.SIZES)):
        for _ in range(6):
            tape.perform(operation, *rng.integers(0, 57, 2).tolist())
    return tape, given


@COMPILED
def test_compiled_and_interpreted_steps_give_the_same_bits() -> None:
    rng = np.random.default_rng(5)
    for _ in range(200):
        tape, given = steps_with(rng)
        values, words = np.zeros(len(tape.values)), np.zeros(len(tape.values))
        everything = np.array([[0, 0, len(values)]])
        assert replay(np.array(tape.steps), given, np.arange(60), values, everything, words)
        assert words.tobytes() == np.array(tape.values).tobytes()


def test_a_decision_that_comes_out_otherwise_writes_nothing() -> None:
    tape = Tape([1.0, 2.0])
    assert tape.scalar(0) < tape.scalar(1)
    steps, used, writes = np.array(tape.steps), np.array([0, 1]), np.array([[0, 0, 1]])
    for given, kept in (([1.0, 2.0], 1.0), ([1.5, 2.0], 1.5), ([2.0, 2.0], 7.0), ([np.nan, 2.0], 7.0)):
        words = np.full(1, 7.0)
        assert replay(steps, np.array(given), used, np.zeros(len(tape.values)), writes, words) == (kept != 7.0)
        assert words[0] == kept


def clouds(rng: np.random.Generator) -> Iterator[np.ndarray]:
    """Points in space, in a plane, on a line, on a sphere, on a grid, all in one place."""
    for size in (1e-12, 1.0, 1e12):
        for n in range(1, 25):
            points = rng.normal(size=(n, 3))
            yield points * size
            yield points * [1.0, 1.0, 0.0] * size
            yield points[:, :1] * [1.0, 2.0, -3.0] * size
            yield points / np.linalg.norm(points, axis=1)[:, None] * size
            yield np.round(points) * size
            yield points[:1].repeat(n, axis=0) * size


def test_compiled_and_interpreted_spheres_have_the_same_radius() -> None:
    for points in clouds(np.random.default_rng(6)):
        n = len(points)
        numbers = np.concatenate([np.zeros(4), points.ravel(), np.zeros(6 * n)])
        assert measure_home(numbers, n, np.zeros(6 * n + 8), np.zeros(N_PLACES, int))
        assert numbers[0] == enclosing_radius(points)


def test_directions_square_to_a_line_of_any_length_are_unit_vectors() -> None:
    rng = np.random.default_rng(7)
    for line in [*rng.normal(size=(100, 3)), *np.eye(3), *-np.eye(3)]:
        for size in (1e-300, 1.0, 1e300):
            length = operations.result(operations.LENGTH, (line * size).tolist())
            assert length[0] == pytest.approx(np.linalg.norm(line) * size, rel=1e-14)
            rows = np.reshape(operations.result(operations.SQUARE, (line * size).tolist(), length), (2, 3))
            basis = np.vstack([line / np.linalg.norm(line), rows])
            np.testing.assert_allclose(basis @ basis.T, np.eye(3), rtol=0, atol=1e-14)
