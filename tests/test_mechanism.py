"""Mechanisms built in Python: what they hold, what they derive, and every fault they refuse."""

from __future__ import annotations

import copy
import dataclasses
import math
import pickle
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pfabrik.answers.differential import mobility
from pfabrik.description.enclosing import enclosing_radius
from pfabrik.description.graph import cone_line
from pfabrik.description.home_mobility import universal_axes
from pfabrik.description.joint_types import JOINT_TYPES, KINDS
from pfabrik.description.mechanism import Cone, Joint, Mechanism
from pfabrik.errors import InvalidArgument, InvalidMechanism, MobilityWarning, UnknownName
from pfabrik.files import loads
from pfabrik.tolerances import TOLERANCES

Z = (0.0, 0.0, 1.0)


def five_bar() -> list[Joint]:
    return [
        Joint("a", "revolute", ("base", "crank1"), at=(0, 0, 0), axis=Z, actuated=True),
        Joint("b", "revolute", ("base", "crank2"), at=(2, 0, 0), axis=Z, actuated=True),
        Joint("c", "revolute", ("crank1", "arm1"), at=(-1, 1, 0), axis=Z),
        Joint("d", "revolute", ("crank2", "arm2"), at=(3, 1, 0), axis=Z),
        Joint("tip", "revolute", ("arm1", "arm2"), at=(1, 3, 0), axis=Z),
    ]


def hexapod() -> list[Joint]:
    joints = []
    for leg in range(6):
        low, high = leg * math.pi / 3 + 0.3 * (-1) ** leg, leg * math.pi / 3 - 0.2 * (-1) ** leg
        foot = (100 * math.cos(low), 100 * math.sin(low), 0)
        head = (60 * math.cos(high), 60 * math.sin(high), 150)
        names = (f"cylinder{leg}", f"rod{leg}")
        joints += [
            Joint(f"A{leg}", "universal", ("base", names[0]), at=foot, cone=Cone(Z, 1.0, "base")),
            Joint(f"B{leg}", "prismatic", names, along=(f"A{leg}", f"C{leg}"), actuated=True, range=(100, 200)),
            Joint(f"C{leg}", "spherical", (names[1], "platform"), at=head),
        ]
    return joints


def stewart() -> Mechanism:
    return Mechanism("hexapod", hexapod(), "platform", (0, 0, 150))


def slider(**changes: object) -> list[Joint]:
    """A slider crank, with some fields of its prismatic joint `s` replaced."""
    return [
        Joint("o", "revolute", ("base", "crank"), at=(0, 0, 0), axis=Z),
        Joint("p", "revolute", ("crank", "rod"), at=(1, 1, 0), axis=Z),
        Joint("q", "revolute", ("rod", "block"), at=(3, 0, 0), axis=Z),
        Joint(**{"name": "s", "type": "prismatic", "connects": ("base", "block"), "axis": (1, 0, 0), "actuated": True}
              | changes),
    ]  # fmt: skip


def stray(*names: object) -> list[Joint]:
    """Joints between two bodies that nothing else connects."""
    return [Joint(name, "spherical", ("u", "v"), at=(float(i), 0, 0)) for i, name in enumerate(names)]


def changed(joints: list[Joint], which: str, /, **changes: object) -> list[Joint]:
    return [dataclasses.replace(joint, **changes) if joint.name == which else joint for joint in joints]


def faults_of(joints: object, end_effector: object = "tip", **head: object) -> dict[str, str]:
    """The faults of a mechanism that cannot be built: place to what was found and expected."""
    with pytest.raises(InvalidMechanism) as caught:
        Mechanism(**{"name": "m", "joints": joints, "end_effector": end_effector} | head)
    return {fault.place: f"{fault.found} -> {fault.expected}" for fault in caught.value.faults}


class TestValues:
    def test_sequences_and_arrays_become_tuples_of_floats(self):
        joint = Joint("a", "revolute", ["x", "y"], at=np.array([1, 2, 3]), axis=[0, 0, 2], range=[-1, np.float32(1)])
        assert joint == Joint("a", "revolute", ("x", "y"), at=(1.0, 2.0, 3.0), axis=Z, range=(-1.0, 1.0))
        assert all(type(number) is float for number in (*joint.at, *joint.axis, *joint.range))

    @given(st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 3).filter(any))
    def test_normalising_a_direction_twice_changes_no_bit(self, vector):
        once = Cone(vector, 1.0, "x").axis
        assert math.hypot(*once) == pytest.approx(1.0, abs=1e-15)
        assert Cone(once, 1.0, "x").axis == once

    def test_two_coordinates_default_to_home_zero_each(self):
        assert Joint("c", "cylindrical", ("x", "y"), at=(0, 0, 0), axis=Z).home == (0.0, 0.0)

    def test_every_joint_type_has_a_kind(self):
        assert set(KINDS) == set(JOINT_TYPES)


class TestDerived:
    def test_names_come_in_the_order_of_the_joints(self):
        machine = stewart()
        assert machine.actuator_names == tuple(f"B{leg}" for leg in range(6))
        assert machine.bodies[:4] == ("base", "cylinder0", "rod0", "platform")

    def test_it_introduces_itself_in_one_line(self):
        assert repr(stewart()) == "<Mechanism 'hexapod': 18 joints, 6 actuators, task x y z rotation>"
        crank = [Joint("a", "revolute", ("base", "crank"), at=(0, 0, 0), axis=Z, actuated=True)]
        assert repr(Mechanism("crank", crank, "crank", (1, 0, 0), task=["tilt"])) == (
            "<Mechanism 'crank': 1 joint, 1 actuator, task tilt>"
        )

    def test_end_effector_joint_gives_reference_point_and_task(self):
        machine = Mechanism("5", five_bar(), "tip")
        assert machine.end_effector_is_joint and not stewart().end_effector_is_joint
        assert machine.reference_point == (1.0, 3.0, 0.0)
        assert machine.task == ("x", "y", "z") and stewart().task == ("x", "y", "z", "rotation")

    def test_home_pose_is_read_only_also_after_pickling(self):
        machine = stewart()
        for each in (machine, pickle.loads(pickle.dumps(machine)), copy.deepcopy(machine)):
            assert each == machine and hash(each) == hash(machine)
            assert np.array_equal(each.home_pose[:3, 3], (0, 0, 150)) and np.array_equal(
                each.home_pose[:3, :3], np.eye(3)
            )
            with pytest.raises(ValueError, match="read-only"):
                each.home_pose[0, 0] = 2.0

    def test_two_that_are_equal_are_compared_joint_by_joint_once(self, monkeypatch):
        machine, again, other = stewart(), stewart(), stewart().without_limits()
        assert machine == again and machine != other
        monkeypatch.delattr(Joint, "__eq__")  # joints made one by one now differ
        assert machine.joints != again.joints
        assert machine == again and again == machine and {machine: 1}[again] == 1
        assert machine != other and machine != machine.name

    def test_nothing_can_be_assigned(self):
        with pytest.raises(dataclasses.FrozenInstanceError):
            stewart().name = "other"

    def test_replace_keeps_a_joint_end_effector(self):
        machine = Mechanism("5", five_bar(), "tip")
        assert dataclasses.replace(machine, name="6").reference_point == machine.reference_point

    def test_angle_unit_is_only_a_label(self):
        assert Mechanism("5", five_bar(), "tip", angle_unit="rad") == Mechanism("5", five_bar(), "tip")

    def test_unknown_joint_is_refused_with_a_near_miss(self):
        with pytest.raises(UnknownName, match="did you mean 'tip'"):
            Mechanism("5", five_bar(), "tip").joint("tipp")

    def test_home_coordinate_of_every_kind(self):
        machine = stewart()
        start, end = machine.joint("A0").at, machine.joint("C0").at
        assert machine.home_coordinate("B0") == math.dist(start, end)
        assert machine.home_coordinate("A0") == (0.0, 0.0)
        assert machine.home_coordinate("C0") == (0.0, 0.0, 0.0)
        assert Mechanism("s", slider(home=4), "block", (3, 0, 0)).home_coordinate("s") == 4.0

    def test_axis_along_two_joints_points_from_first_body_to_second_whatever_their_order(self):
        joints = changed(hexapod(), "B0", along=("C0", "A0"))
        machine = Mechanism("hexapod", joints, "platform", (0, 0, 150))
        start, end = np.array(machine.joint("A0").at), np.array(machine.joint("C0").at)
        assert machine.home_axis("B0") == pytest.approx((end - start) / np.linalg.norm(end - start), abs=1e-15)

    def test_characteristic_length_includes_the_reference_point_only_when_all_joints_coincide(self):
        wrist = [
            Joint("a", "universal", ("base", "ring"), at=(0, 0, 0)),
            Joint("b", "revolute", ("ring", "tool"), at=(0, 0, 0), axis=Z, actuated=True),
        ]
        with pytest.warns(MobilityWarning):
            assert Mechanism("w", wrist, "tool", (0, 0, 4)).characteristic_length == 2.0
        with pytest.warns(MobilityWarning):
            assert Mechanism("w", wrist, "tool", (0, 0, 0)).characteristic_length == 1.0
        assert Mechanism("5", five_bar(), "tip").characteristic_length == pytest.approx(2.0)


class TestLimits:
    def test_limits_are_set_and_dropped_on_copies(self):
        machine = stewart()
        other = machine.with_limits({"B0": (50, 300), "A1": Cone(Z, 2.0, "base")}, B1=None)
        assert other.joint("B0").range == (50.0, 300.0)
        assert other.joint("A1").cone.half_angle == 2.0
        assert other.joint("B1").range is None
        assert machine.joint("B0").range == (100.0, 200.0) and machine.with_limits() == machine

    def test_without_limits_drops_every_range_and_cone(self):
        assert all(joint.range is None and joint.cone is None for joint in stewart().without_limits().joints)

    def test_wrong_limits_are_refused(self):
        with pytest.raises(UnknownName, match="did you mean 'B0'"):
            stewart().with_limits({"B00": None})
        with pytest.raises(InvalidMechanism, match="contains home"):
            stewart().with_limits(B0=(1, 2))

    def test_copies_do_not_warn_of_freedoms_again(self):
        with pytest.warns(MobilityWarning):
            machine = Mechanism("loose", changed(five_bar(), "b", actuated=False), "tip")
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            machine.without_limits()


class TestFreedom:
    def test_cylindrical_and_fixed_joints_count_two_and_none(self):
        joints = [
            Joint("c", "cylindrical", ("base", "arm"), at=(0, 0, 0), axis=Z),
            Joint("f", "fixed", ("arm", "flange"), at=(1, 0, 0)),
            Joint("r", "revolute", ("flange", "tool"), at=(2, 0, 0), axis=Z, actuated=True),
        ]
        with pytest.warns(MobilityWarning, match="1 actuator leaves the end effector 2 freedoms"):
            machine = Mechanism("c", joints, "tool", (3, 0, 0))
        assert mobility(machine).mobility == 3

    def test_fewer_actuators_than_freedoms_warn_with_the_numbers(self):
        with pytest.warns(MobilityWarning, match="1 actuator leaves the end effector 1 freedom at home"):
            Mechanism("loose", changed(five_bar(), "b", actuated=False), "tip")

    @pytest.mark.parametrize("tilt", [1e-11, 1e-8, 1e-6, 1e-4])
    def test_axes_that_are_hardly_parallel_warn_that_the_loops_lock(self, tilt):
        with pytest.warns(MobilityWarning, match="need more digits"):
            Mechanism("5", changed(five_bar(), "b", axis=(0, math.sin(tilt), math.cos(tilt))), "tip")

    @pytest.mark.parametrize("tilt", [0.0, 1e-13])
    def test_axes_that_are_parallel_to_the_last_digit_do_not(self, tilt):
        Mechanism("5", changed(five_bar(), "b", axis=(0, math.sin(tilt), math.cos(tilt))), "tip")

    def test_loops_that_hold_the_end_effector_warn_that_it_cannot_move(self):
        with pytest.warns(MobilityWarning, match="it cannot move"):
            Mechanism("s", changed(slider(), "o", axis=(1, 0, 1)), "block", (3, 0, 0))

    @given(st.floats(1e-6, 1e6))
    @settings(max_examples=20, deadline=None)
    def test_freedoms_do_not_depend_on_the_unit(self, scale):
        joints = [dataclasses.replace(joint, at=[scale * x for x in joint.at]) for joint in five_bar()]
        assert mobility(Mechanism("5", joints, "tip")).mobility == 2

    def test_universal_joint_without_axes_keeps_its_link_from_spinning(self):
        machine = stewart()
        axes = universal_axes(machine, machine.joint("A0"))
        assert axes @ machine.home_axis("B0") == pytest.approx([0, 0], abs=1e-15)
        assert axes @ axes.T == pytest.approx(np.eye(2), abs=1e-15)


class TestCones:
    def test_line_passes_through_the_strut_to_its_other_end(self):
        machine = stewart()
        assert [joint.name for joint in cone_line(machine, machine.joint("A0"))] == ["A0", "C0"]

    def test_joint_without_a_cone_has_no_line(self):
        machine = stewart()
        with pytest.raises(InvalidArgument, match="C0"):
            cone_line(machine, machine.joint("C0"))

    @pytest.mark.parametrize("short", [0.5, 2.0])
    def test_home_may_exceed_its_cone_by_the_slack_and_no_more(self, short):
        machine = stewart()
        line = np.subtract(machine.joint("C0").at, machine.joint("A0").at)
        angle = math.acos(line[2] / np.linalg.norm(line))
        cone = Cone(Z, angle - short * TOLERANCES.home_slack, "base")
        if short < 1:
            machine.with_limits(A0=cone)
        else:
            with pytest.raises(InvalidMechanism, match=r"joint 'A0'.cone.half_angle: .* angle at home to 'C0'"):
                machine.with_limits(A0=cone)


SQUARE = {"axis": None, "axes": (Z, (1, 0, 0)), "actuated": False}

JOINT_FAULTS = [
    ({"name": ""}, "name", "'' -> a text"),
    ({"name": "\ud800"}, "name", "a text"),
    ({"name": 3}, "name", "3 -> a text"),
    ({"type": "revolut"}, "type", "'revolut'; did you mean 'revolute'? -> one of revolute, "),
    ({"type": []}, "type", "[] -> one of"),
    ({"connects": "base"}, "connects", "'base' -> the names of two bodies"),
    ({"connects": ("base", 5)}, "connects", "the names of two bodies"),
    ({"connects": ("crank1", "crank1")}, "connects", "'crank1' twice -> two different"),
    ({"at": None}, "at", "nothing -> three numbers, the centre of the revolute joint"),
    ({"at": (1, 2)}, "at", "[1, 2] -> three numbers"),
    ({"at": (1, True, 2)}, "at", "three numbers"),
    ({"at": (1, 10**400, 2)}, "at", "three numbers"),
    ({"at": object()}, "at", "three numbers"),
    ({"at": (1, math.nan, 2)}, "at", "three numbers, finite"),
    ({"at": (1, 2e12, 2)}, "at", "at most 1e+12"),
    ({"axis": None}, "axis", "nothing -> three numbers, the direction"),
    ({"axis": (0, 0, 0)}, "axis", "a direction that is not zero"),
    ({"axis": (0, math.inf, 0)}, "axis", "finite"),
    ({"axes": (Z, Z)}, "axes", "nothing: a revolute joint has no axes"),
    ({"type": "spherical", "actuated": False}, "axis", "nothing: a spherical joint has no axis"),
    ({**SQUARE, "type": "universal", "axes": (Z, (0, 0, -2))}, "axes", "two parallel axes"),
    ({**SQUARE, "type": "universal", "axes": Z}, "axes", "two directions"),
    ({**SQUARE, "type": "universal", "axes": (Z, (0, 0, 0))}, "axes[1]", "not zero"),
    ({"along": ("a", "b")}, "along", "nothing: a revolute joint does not run along"),
    ({"actuated": 1}, "actuated", "1 -> true or false"),
    ({**SQUARE, "type": "universal", "actuated": True}, "actuated", "an actuated universal joint"),
    ({"actuated": (True, False)}, "actuated", "[True, False] -> true or false"),
    ({"actuated": (True, True)}, "actuated", "[True, True] -> true or false"),
    ({"type": "cylindrical", "actuated": 1}, "actuated", "1 -> true, false, or a pair of them: angle, length"),
    ({"type": "cylindrical", "actuated": (True,)}, "actuated", "a pair of them"),
    ({"type": "cylindrical", "actuated": (True, 1)}, "actuated", "a pair of them"),
    ({"type": "cylindrical", "actuated": "angle"}, "actuated", "'angle' -> true, false, or a pair of them"),
    ({"type": "cylindrical", "actuated": (True, False), "max_speed": (1, 2)}, "max_speed", "[1, 2] -> a number"),
    ({"type": "cylindrical", "actuated": True, "max_speed": 1}, "max_speed", "1 -> two numbers"),
    ({"type": "cylindrical", "actuated": True, "max_speed": (1, -2)}, "max_speed", "numbers greater than 0"),
    ({"type": "cylindrical", "actuated": (False, False), "max_speed": 1}, "max_speed", "the joint is not actuated"),
    ({"type": "fixed", "axis": None}, "actuated", "an actuated fixed joint"),
    ({"home": (1, 2)}, "home", "[1, 2] -> a number"),
    ({"home": math.inf}, "home", "finite"),
    ({"type": "cylindrical", "actuated": False, "home": 1}, "home", "two numbers"),
    ({"type": "spherical", "axis": None, "actuated": False, "home": 1}, "home", "nothing: it counts from home"),
    ({"range": 3}, "range", "3 -> two numbers"),
    ({"range": ()}, "range", "two numbers"),
    ({"range": (1, -1)}, "range", "(57.29577951 deg) to -1 rad"),
    ({"range": (-math.inf, 1)}, "range", "two numbers, finite: where nothing limits one end, a number that is never"),
    ({"range": ((-1, 1), (-1, 1))}, "range", "two numbers"),
    ({"range": (0.5, 1)}, "range", "a range that contains home, 0 rad (0 deg)"),
    ({"type": "cylindrical", "actuated": False, "range": (-1, 1)}, "range[0]", "two numbers"),
    ({"type": "cylindrical", "actuated": False, "range": ((-1, 1), (1, 2))}, "range[1]", "1 to 2 -> a range"),
    ({**SQUARE, "type": "universal", "range": 1}, "range", "two pairs"),
    ({**SQUARE, "type": "universal", "axes": None, "range": ((-1, 1),) * 2}, "range", "`axes` as well"),
    ({"type": "spherical", "axis": None, "actuated": False, "range": (-1, 1)}, "range", "a spherical joint has no"),
    ({"type": "fixed", "axis": None, "actuated": False, "range": (-1, 1)}, "range", "a fixed joint has no range"),
    ({"cone": Cone(Z, 1, "base")}, "cone", "a revolute joint has no cone"),
    ({"type": "cylindrical", "actuated": False, "cone": Cone(Z, 1, "base")}, "cone", "a cylindrical joint has no cone"),
    ({**SQUARE, "type": "universal", "cone": 5}, "cone", "5 -> a cone"),
    ({**SQUARE, "type": "universal", "cone": Cone((0, 0, 0), 3, "base")}, "cone.axis", "not zero"),
    ({**SQUARE, "type": "universal", "cone": Cone(Z, 0, "base")}, "cone.half_angle", "more than 0"),
    ({**SQUARE, "type": "universal", "cone": Cone(Z, 3.2, "base")}, "cone.half_angle", "at most half a turn"),
    ({**SQUARE, "type": "universal", "cone": Cone(Z, "1", "base")}, "cone.half_angle", "a number"),
    ({**SQUARE, "type": "universal", "cone": Cone(Z, 3, "arm1")}, "cone.fixed_to", "'arm1' -> 'base' or 'crank1'"),
    ({**SQUARE, "type": "universal", "cone": Cone(Z, 1, "base")}, "cone.half_angle", "at least the angle at home"),
]  # fmt: skip


class TestDrives:
    def test_a_drive_may_say_what_it_can_do(self):
        joint = Joint("a", "revolute", ("base", "crank1"), at=(0, 0, 0), axis=Z, actuated=True, max_speed=np.float32(2))
        assert joint.max_speed == 2.0 and joint.max_acceleration is None

    @pytest.mark.parametrize(
        ("value", "fault"),
        [
            (0, "0 -> a number greater than 0"),
            (-2.5, "-2.5 -> a number greater than 0"),
            (math.inf, "a number, finite"),
            ("fast", "'fast' -> a number"),
            ((1, 2), "[1, 2] -> a number"),
            (True, "True -> a number"),
        ],
    )
    @pytest.mark.parametrize("field", ["max_speed", "max_acceleration"])
    def test_nothing_but_a_positive_number_is_accepted(self, field, value, fault):
        found = faults_of(changed(five_bar(), "a", **{field: value}))
        assert list(found) == [f"joint[0].{field}"] and fault in found[f"joint[0].{field}"]

    def test_joints_without_a_drive_have_no_pace(self):
        found = faults_of(changed(five_bar(), "c", max_speed=3))
        assert found == {"joint[2].max_speed": "3 -> nothing: the joint is not actuated"}


class TestFaults:
    @pytest.mark.parametrize(("changes", "place", "text"), JOINT_FAULTS)
    def test_fault_of_one_joint_is_named_at_its_place_and_nowhere_else(self, changes, place, text):
        faults = faults_of(changed(five_bar(), "a", **changes))
        assert text in faults[f"joint[0].{place}"]
        assert all(each.startswith("joint[0]") for each in faults)

    @pytest.mark.parametrize(("changes", "text"), [
        ({"axis": None}, "nothing -> three numbers"),
        ({"along": ("o", "q")}, "both `axis` and `along`"),
        ({"axis": None, "along": ("o", "x")}, "'x': no such joint"),
        ({"axis": None, "along": ("o", "o")}, "'o' twice"),
        ({"axis": None, "along": ("o", "s")}, "'s', the joint itself"),
        ({"axis": None, "along": "oq"}, "'oq' -> the names of two joints"),
        ({"axis": None, "along": ("o", "p")}, "one joint of 'base' and one joint of 'block'"),
        ({"axis": None, "along": ("o", "q"), "home": 1.0}, "home is the distance"),
        ({"axis": None, "along": ("o", "q"), "at": (0, 0, 0)}, "`along` already says"),
        ({"axis": None, "along": ("o", "q"), "range": (4, 5)}, "4 to 5 -> a range that contains home, 3"),
    ])  # fmt: skip
    def test_fault_of_a_prismatic_joint_is_named(self, changes, text):
        faults = faults_of(slider(**changes), "block", reference_point=(0, 0, 0))
        assert any(text in each for each in faults.values()) and len(faults) == 1

    @pytest.mark.parametrize(("head", "place", "text"), [
        ({"name": " "}, "name", "a text"),
        ({"base": "bse"}, "base", "'bse', which no joint connects; did you mean 'base'?"),
        ({"end_effector": "tp"}, "end_effector", "neither a body nor a joint; did you mean 'tip'?"),
        ({"end_effector": "base"}, "end_effector", "which is the base"),
        ({"end_effector": None}, "end_effector", "nothing -> a text"),
        ({"end_effector": "arm1"}, "reference_point", "nothing -> three numbers"),
        ({"end_effector": "arm1", "reference_point": (1, 2)}, "reference_point", "three numbers"),
        ({"reference_point": (1, 2, 3)}, "reference_point", "the centre of the joint 'tip'"),
        ({"angle_unit": "grad"}, "units.angle", "'grad' -> 'deg' or 'rad'"),
        ({"length_unit": ""}, "units.length", "a text"),
        ({"joints": []}, "joint", "no joints -> at least one"),
        ({"joints": None}, "joint", "nothing -> at least one"),
        ({"joints": [1]}, "joint", "1 -> at least one"),
    ])  # fmt: skip
    def test_fault_of_the_head_is_named(self, head, place, text):
        faults = faults_of(**({"joints": five_bar()} | head))
        assert text in faults[place] and len(faults) == 1

    @pytest.mark.parametrize(("joints", "end_effector", "place", "text"), [
        (changed(five_bar(), "b", name="a"), "tip", "joint[1].name", "'a', the name of an earlier joint"),
        ([dataclasses.replace(each, actuated=False) for each in five_bar()], "tip", "joint", "no actuated joint"),
        (changed(five_bar(), "d", connects=("crnk2", "arm2")), "tip", "joint[1].connects joint[3].connects",
         "'crnk2', which no other joint connects; did you mean 'crank2'?"),
        ([*five_bar(), *stray("x", "y")], "tip", "joint[5].connects", "'u', 'v', apart from the rest"),
        ([*five_bar(), *stray({}, "y")], "tip", "joint[5].name joint[5].connects", "'u', 'v', apart from the rest"),
        ([*five_bar(), *stray("x", "y")], "u", "end_effector", "no joints lead from the base"),
        (changed(five_bar(), "a", name="arm1"), "arm1", "end_effector", "both a body and a joint"),
        (changed(five_bar(), "tip", type="cylindrical"), "tip", "end_effector", "a cylindrical joint"),
        (changed(slider(axis=None, along=("o", "q")), "q", at=(0, 0, 0)), "block", "joint[3].along", "same place"),
        (changed(slider(axis=None, along=("o", "q")), "o", type="prismatic", at=None), "block", "joint[3].along",
         "without a centre"),
        (changed(hexapod(), "C0", cone=Cone(Z, 3, "rod0")), "platform", "joint[2].cone",
         "'platform', which leads to several joints ('C1', "),
        ([*hexapod(), Joint("T", "spherical", ("platform", "tool"), at=(0, 0, 0), cone=Cone(Z, 1, "platform"))], "tool",
         "joint[18].cone", "leads to no other joint"),
        (changed(five_bar(), "c", type="spherical", axis=None, cone=Cone(Z, 3, "crank1"), at=(1, 3, 0)), "tip",
         "joint[2].cone", "'tip' at the same place"),
    ])  # fmt: skip
    def test_fault_between_joints_is_named(self, joints, end_effector, place, text):
        head = {} if end_effector in ("tip", "arm1") else {"reference_point": (0, 0, 0)}
        faults = faults_of(joints, end_effector, **head)
        assert list(faults) == place.split() and text in faults[place.split()[-1]]

    def test_tool_that_hangs_on_an_end_effector_joint_is_no_dangling_body(self):
        joints = [Joint("x", "revolute", ("base", "arm"), at=(0, 0, 0), axis=Z, actuated=True),
                  Joint("y", "spherical", ("arm", "tool"), at=(1, 0, 0))]  # fmt: skip
        assert Mechanism("arm", joints, "y").bodies == ("base", "arm", "tool")

    @pytest.mark.parametrize("size", [1e-10, 1e-8])
    def test_machine_without_size_is_a_fault(self, size):
        joints = [dataclasses.replace(joint, at=[size * x for x in joint.at]) for joint in five_bar()]
        if size > 1e-9:
            Mechanism("5", joints, "tip")
        else:
            assert "at least 1e-09" in faults_of(joints)["joint"]

    @pytest.mark.parametrize("span", [(-1e12, 1e12), (0, 0)])
    def test_the_largest_numbers_and_a_locked_coordinate_are_accepted(self, span):
        Mechanism("5", changed(five_bar(), "a", range=span), "tip")

    @pytest.mark.parametrize("excess", [0.5, 2.0])
    def test_home_may_exceed_its_range_by_the_slack_and_no_more(self, excess):
        low = excess * TOLERANCES.home_slack
        if excess < 1:
            Mechanism("5", changed(five_bar(), "a", range=(low, 1)), "tip")
        else:
            assert "contains home" in faults_of(changed(five_bar(), "a", range=(low, 1)))["joint[0].range"]

    @pytest.mark.parametrize("sine", [0.5, 2.0])
    def test_axes_are_parallel_up_to_the_alignment_tolerance(self, sine):
        axes = (Z, (sine * TOLERANCES.alignment, 0, 1))
        joints = changed(hexapod(), "A0", axes=axes)
        if sine > 1:
            Mechanism("hexapod", joints, "platform", (0, 0, 150))
        else:
            assert "parallel" in faults_of(joints, "platform", reference_point=(0, 0, 150))["joint[0].axes"]

    def test_what_only_follows_from_a_fault_is_not_reported_beside_it(self):
        cone = Cone((0, 0, 0), 4, "x")
        assert list(faults_of(changed(five_bar(), "a", cone=cone))) == ["joint[0].cone"]

    def test_all_faults_come_in_one_go_and_in_the_order_of_the_description(self):
        joints = changed(five_bar(), "a", at=None)
        joints = changed(joints, "b", type="revolve", axis=(0, 0, 0))
        joints = changed(joints, "c", range=(2, 1))
        assert list(faults_of(joints, "nobody", name="")) == [
            "name", "end_effector", "joint[0].at", "joint[1].type", "joint[1].axis", "joint[2].range",
        ]  # fmt: skip

    @given(st.data())
    @settings(max_examples=150, deadline=None)
    def test_no_value_whatever_escapes_as_another_error(self, data):
        junk = st.one_of(
            st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=3), st.binary(max_size=2),
            st.lists(st.floats(), max_size=3), st.lists(st.lists(st.integers(), max_size=3), max_size=3),
            st.dictionaries(st.text(max_size=2), st.integers(), max_size=2), st.just(np.ones((2, 3))),
            st.complex_numbers(),
        )  # fmt: skip
        index = data.draw(st.integers(0, 4))
        fields = data.draw(st.lists(st.sampled_from([each.name for each in dataclasses.fields(Joint)]), max_size=3))
        joints = five_bar()
        joints[index] = dataclasses.replace(joints[index], **{field: data.draw(junk) for field in fields})
        head = {
            field: data.draw(junk) for field in data.draw(st.lists(st.sampled_from(["name", "base", "end_effector"])))
        }
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MobilityWarning)
            try:
                hash(Mechanism(**{"name": "5", "joints": joints, "end_effector": "tip"} | head))
            except InvalidMechanism as error:
                assert error.faults and str(error)


class TestEnclosingSphere:
    def test_known_radii(self):
        assert enclosing_radius([]) == enclosing_radius([(1, 2, 3)]) == enclosing_radius([(1, 2, 3)] * 4) == 0.0
        assert enclosing_radius([(0, 0, 0), (2, 0, 0)]) == 1.0
        triangle = [(math.cos(angle), math.sin(angle), 5) for angle in (0, 2 * math.pi / 3, 4 * math.pi / 3)]
        assert enclosing_radius(triangle) == pytest.approx(1.0, rel=1e-14)
        cube = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
        assert enclosing_radius(cube) == pytest.approx(math.sqrt(0.75), rel=1e-14)

    @given(st.lists(st.tuples(*[st.floats(-1, 1)] * 3), min_size=1, max_size=30), st.floats(1e-9, 1e9))
    @settings(max_examples=60, deadline=None)
    def test_no_centre_does_better(self, points, scale):
        radius = enclosing_radius(np.array(points) * scale) / scale
        assert radius == pytest.approx(_by_descent(np.array(points)), rel=2e-2, abs=1e-12)
        diameter = max(math.dist(a, b) for a in points for b in points)
        assert diameter / 2 * (1 - 1e-9) <= radius <= diameter * math.sqrt(3 / 8) * (1 + 1e-9)


def _by_descent(points: np.ndarray) -> float:
    """The radius by walking toward the farthest point in ever smaller steps: slow, and right to about 1 in 1000."""
    centre = points.mean(axis=0)
    for step in range(1, 2000):
        distances = np.linalg.norm(points - centre, axis=1)
        centre = centre + (points[distances.argmax()] - centre) / (step + 1)
    return float(np.linalg.norm(points - centre, axis=1).max())


def test_a_freedom_that_the_task_does_not_set_is_no_warning() -> None:
    """Five struts on rings about the spindle: it turns about z, which a task of position and tilt leaves out."""
    rings = [((-418, 325), -415), ((-160, -500), -435), ((160, -500), -455), ((418, 325), -475), ((0, 530), -495)]
    legs = []
    for foot, z in rings:
        out = np.array(foot) / np.hypot(*foot)
        across = f"[{-out[1]}, {out[0]}, 0]"
        legs.append(
            f"[[leg]]\nchain = 'S-P*-R-R'\nbase = [{foot[0]}, {foot[1]}, 0]\n"
            f"via = [[{80 * out[0]}, {80 * out[1]}, {z}]]\n"
            f"platform = [0, 0, {z}]\nstroke = [200, 1200]\nC.axis = {across}\nD.axis = 'z'\n"
        )
    head = "schema = 1\nname = 'five'\nend_effector = 'platform'\nreference_point = [0, 0, -900]\n"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        loads(head + "task = ['x', 'y', 'z', 'tilt']\n" + "\n".join(legs))
    with pytest.warns(MobilityWarning, match="1 freedom"):
        loads(head + "\n".join(legs))
