"""A machine with another geometry: its legs are those of a machine made anew, to the last bit."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from machines import EVERY, TRUNKS, machine
from pfabrik.machine.decomposition.leg_forms import NoLeg
from pfabrik.machine.decomposition.leg_table import LegTable, leg_table
from pfabrik.machine.description.geometry import (
    Geometry,
    geometry_of,
    home_numbers,
    numbers_with,
    with_geometry,
    with_numbers,
)
from pfabrik.machine.description.joints import JOINT_TYPES
from pfabrik.machine.description.structure import Structure
from pfabrik.machine.files import dumps, loads
from pfabrik.machine.model import Model, model_of

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

Change = Callable[[pf.Mechanism, Geometry], Geometry]
NAMES = (*EVERY, *TRUNKS)
ARRAYS = ("legs", "aimed", "limited", "cones", "driven", "known", "task")


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
    longer = geometry._replace(axes=3.0 * geometry.axes)  # directions become unit vectors, as in a new mechanism
    for other in (with_geometry(mechanism, moved(mechanism, geometry)), with_geometry(mechanism, longer)):
        assert loads(dumps(other)) == other
        assert made_anew(other, pf.Mechanism) == other


@pytest.mark.parametrize("name", NAMES)
def test_legs_with_other_numbers_are_those_of_a_machine_made_anew(name: str) -> None:
    mechanism = machine(name)
    if not Model(mechanism).has_legs:
        return
    for how, change in (ALIKE | OTHERS).items():
        made = with_numbers(mechanism, numbers_with(mechanism, change(mechanism, geometry_of(mechanism))))
        anew = made_anew(made)
        for given, taken in zip(geometry_of(made), geometry_of(anew), strict=True):
            np.testing.assert_array_equal(given, taken)
        try:
            expected = leg_table(anew)
        except NoLeg as reason:
            with pytest.raises(NoLeg, match=re.escape(str(reason))):
                leg_table(made)
            continue
        table = leg_table(made)
        assert not differences(table, expected), how
        assert table.limits == expected.limits


def tilted(name: str, joint_name: str, by: float) -> tuple[pf.Mechanism, Geometry]:
    """A machine, and its geometry with the axis of one joint tilted by an angle [rad]."""
    mechanism = machine(name)
    geometry = geometry_of(mechanism)
    axis = np.array(mechanism.joint(joint_name).axis)
    geometry.axes[mechanism.joints.index(mechanism.joint(joint_name)), 0] = axis + by * np.cross(
        axis, [0.6, 0.64, 0.48]
    )
    return mechanism, geometry


def test_a_hinge_off_the_strut_that_it_was_along_makes_other_legs() -> None:
    ucu = machine("ucu")
    mechanism, geometry = tilted("ucu", next(each.name for each in ucu.joints if each.type == "revolute"), 1e-4)
    assert len(leg_table(with_geometry(mechanism, geometry)).legs) > len(leg_table(mechanism).legs)


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


@pytest.mark.parametrize("name", ["agile_eye", "hinge", "slider"])
def test_machines_all_of_whose_centres_coincide_have_a_length_too(name: str) -> None:
    mechanism = machine(name)
    geometry = geometry_of(mechanism)
    for shift in ([0.0, 0.3, 0.4], [0.0, 0.0, 0.0]):
        made = with_geometry(mechanism, geometry._replace(reference_point=geometry.reference_point + shift))
        assert made.characteristic_length == made_anew(made).characteristic_length > 0.0
        assert home_numbers(made)[0] == made.characteristic_length
