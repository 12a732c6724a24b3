"""Mechanisms built in Python: what they hold, what they derive, and every fault they refuse."""

from __future__ import annotations

import copy
import dataclasses
import math
import pickle
import warnings

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pfabrik.errors import InvalidArgument, InvalidMechanism, MobilityWarning, UnknownName
from pfabrik.machine.description.enclosing import enclosing_radius
from pfabrik.machine.description.graph import cone_line
from pfabrik.machine.description.home_mobility import universal_axes
from pfabrik.machine.description.mechanism import Cone, Joint, Mechanism
from pfabrik.machine.files import loads
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


def test_sequences_and_arrays_become_tuples_of_floats() -> None:
    joint = Joint("a", "revolute", ["x", "y"], at=np.array([1, 2, 3]), axis=[0, 0, 2], range=[-1, np.float32(1)])
    assert joint == Joint("a", "revolute", ("x", "y"), at=(1.0, 2.0, 3.0), axis=Z, range=(-1.0, 1.0))
    assert all(type(number) is float for number in (*joint.at, *joint.axis, *joint.range))
    assert Joint("c", "cylindrical", ("x", "y"), at=(0, 0, 0), axis=Z).home == (0.0, 0.0)
    driven = Joint("a", "revolute", ("x", "y"), at=(0, 0, 0), axis=Z, actuated=True, max_speed=np.float32(2))
    assert driven.max_speed == 2.0 and driven.max_acceleration is None


@given(st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 3).filter(any))
def test_normalising_a_direction_twice_changes_no_bit(vector: tuple[float, ...]) -> None:
    once = Cone(vector, 1.0, "x").axis
    assert math.hypot(*once) == pytest.approx(1.0, abs=1e-15)
    assert Cone(once, 1.0, "x").axis == once


def test_what_a_mechanism_tells_of_itself() -> None:
    machine, tip = stewart(), Mechanism("5", five_bar(), "tip")
    assert machine.actuator_names == tuple(f"B{leg}" for leg in range(6))
    assert machine.bodies[:4] == ("base", "cylinder0", "rod0", "platform")
    assert repr(machine) == "<Mechanism 'hexapod': 18 joints, 6 actuators, task x y z rotation>"
    crank = [Joint("a", "revolute", ("base", "crank"), at=(0, 0, 0), axis=Z, actuated=True)]
    assert repr(Mechanism("crank", crank, "crank", (1, 0, 0), task=["tilt"])) == (
        "<Mechanism 'crank': 1 joint, 1 actuator, task tilt>"
    )
    assert tip.end_effector_is_joint and not machine.end_effector_is_joint
    assert (tip.reference_point, tip.task) == ((1.0, 3.0, 0.0), ("x", "y", "z"))
    assert machine.task == ("x", "y", "z", "rotation")
    assert dataclasses.replace(tip, name="6").reference_point == tip.reference_point
    assert Mechanism("5", five_bar(), "tip", angle_unit="rad") == tip
    with pytest.raises(UnknownName, match="did you mean 'tip'"):
        tip.joint("tipp")


def test_mechanisms_are_values_that_nobody_changes() -> None:
    machine = stewart()
    for each in (machine, pickle.loads(pickle.dumps(machine)), copy.deepcopy(machine)):
        assert each == machine and hash(each) == hash(machine)
        assert np.array_equal(each.home_pose[:3, 3], (0, 0, 150))
        assert np.array_equal(each.home_pose[:3, :3], np.eye(3))
        with pytest.raises(ValueError, match="read-only"):
            each.home_pose[0, 0] = 2.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        machine.name = "other"


def test_two_that_are_equal_are_compared_joint_by_joint_once(monkeypatch: pytest.MonkeyPatch) -> None:
    machine, again, other = stewart(), stewart(), stewart().without_limits()
    assert machine == again and machine != other
    monkeypatch.delattr(Joint, "__eq__")  # joints made one by one now differ
    assert machine.joints != again.joints
    assert machine == again and again == machine and {machine: 1}[again] == 1
    assert machine != other and machine != machine.name


def test_home_coordinates_and_axes_follow_from_where_the_joints_are() -> None:
    machine = Mechanism("hexapod", changed(hexapod(), "B1", along=("C1", "A1")), "platform", (0, 0, 150))
    for leg in (0, 1):  # an axis along two joints points from the first body to the second, whatever their order
        start, end = np.array(machine.joint(f"A{leg}").at), np.array(machine.joint(f"C{leg}").at)
        assert machine.home_coordinate(f"B{leg}") == math.dist(start, end)
        assert machine.home_axis(f"B{leg}") == pytest.approx((end - start) / np.linalg.norm(end - start), abs=1e-15)
    assert machine.home_coordinate("A0") == (0.0, 0.0)
    assert machine.home_coordinate("C0") == (0.0, 0.0, 0.0)
    assert Mechanism("s", slider(home=4), "block", (3, 0, 0)).home_coordinate("s") == 4.0
    axes = universal_axes(machine, machine.joint("A0"))  # without axes, it keeps its link from spinning
    assert axes @ machine.home_axis("B0") == pytest.approx([0, 0], abs=1e-15)
    assert axes @ axes.T == pytest.approx(np.eye(2), abs=1e-15)
    assert [joint.name for joint in cone_line(machine, machine.joint("A0"))] == ["A0", "C0"]  # through the strut
    with pytest.raises(InvalidArgument, match="C0"):
        cone_line(machine, machine.joint("C0"))


@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
def test_characteristic_length_includes_the_reference_point_only_when_all_joints_coincide() -> None:
    wrist = [
        Joint("a", "universal", ("base", "ring"), at=(0, 0, 0)),
        Joint("b", "revolute", ("ring", "tool"), at=(0, 0, 0), axis=Z, actuated=True),
    ]
    assert Mechanism("w", wrist, "tool", (0, 0, 4)).characteristic_length == 2.0
    assert Mechanism("w", wrist, "tool", (0, 0, 0)).characteristic_length == 1.0
    assert Mechanism("5", five_bar(), "tip").characteristic_length == pytest.approx(2.0)


def test_limits_are_set_and_dropped_on_copies() -> None:
    machine = stewart()
    other = machine.with_limits({"B0": (50, 300), "A1": Cone(Z, 2.0, "base")}, B1=None)
    assert other.joint("B0").range == (50.0, 300.0)
    assert other.joint("A1").cone.half_angle == 2.0
    assert other.joint("B1").range is None
    assert machine.joint("B0").range == (100.0, 200.0) and machine.with_limits() == machine
    assert all(joint.range is None and joint.cone is None for joint in machine.without_limits().joints)
    with pytest.raises(UnknownName, match="did you mean 'B0'"):
        machine.with_limits({"B00": None})
    with pytest.raises(InvalidMechanism, match="contains home"):
        machine.with_limits(B0=(1, 2))


TWO_FREEDOMS = [
    Joint("c", "cylindrical", ("base", "arm"), at=(0, 0, 0), axis=Z),
    Joint("f", "fixed", ("arm", "flange"), at=(1, 0, 0)),
    Joint("r", "revolute", ("flange", "tool"), at=(2, 0, 0), axis=Z, actuated=True),
]


def leaning(tilt: float) -> list[Joint]:
    return changed(five_bar(), "b", axis=(0, math.sin(tilt), math.cos(tilt)))


@pytest.mark.parametrize(
    ("joints", "head", "said"),
    [
        (TWO_FREEDOMS, ("tool", (3, 0, 0)), "1 actuator leaves the end effector 2 freedoms"),
        (changed(five_bar(), "b", actuated=False), ("tip",), "1 actuator leaves the end effector 1 freedom at home"),
        (leaning(1e-11), ("tip",), "need more digits"),
        (leaning(1e-6), ("tip",), "need more digits"),
        (leaning(1e-4), ("tip",), "need more digits"),
        (changed(slider(), "o", axis=(1, 0, 1)), ("block", (3, 0, 0)), "it cannot move"),
    ],
)
def test_machines_that_drives_do_not_hold_or_that_cannot_move_are_warned_of_once(
    joints: list[Joint], head: tuple, said: str
) -> None:
    with pytest.warns(MobilityWarning, match=said):
        machine = Mechanism("m", joints, *head)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        machine.without_limits()


@pytest.mark.parametrize("tilt", [0.0, 1e-13])
def test_axes_that_are_parallel_to_the_last_digit_are_not_warned_of(tilt: float) -> None:
    Mechanism("5", leaning(tilt), "tip")


SQUARE = {"axis": None, "axes": (Z, (1, 0, 0)), "actuated": False}

JOINT_FAULTS = [
    ({"name": ""}, "name", "'' -> a text"),
    ({"name": "\ud800"}, "name", "a text"),
    ({"type": "revolut"}, "type", "'revolut'; did you mean 'revolute'? -> one of revolute, "),
    ({"connects": "base"}, "connects", "'base' -> the names of two bodies"),
    ({"connects": ("crank1", "crank1")}, "connects", "'crank1' twice -> two different"),
    ({"at": None}, "at", "nothing -> three numbers, the centre of the revolute joint"),
    ({"at": (1, 2)}, "at", "[1, 2] -> three numbers"),
    ({"at": (1, 10**400, 2)}, "at", "three numbers"),
    ({"at": (1, math.nan, 2)}, "at", "three numbers, finite"),
    ({"at": (1, 2e12, 2)}, "at", "at most 1e+12"),
    ({"axis": None}, "axis", "nothing -> three numbers, the direction"),
    ({"axis": (0, 0, 0)}, "axis", "a direction that is not zero"),
    ({"axes": (Z, Z)}, "axes", "nothing: a revolute joint has no axes"),
    ({"type": "spherical", "actuated": False}, "axis", "nothing: a spherical joint has no axis"),
    ({**SQUARE, "type": "universal", "axes": (Z, (0, 0, -2))}, "axes", "two parallel axes"),
    ({**SQUARE, "type": "universal", "axes": (Z, (0, 0, 0))}, "axes[1]", "not zero"),
    ({"along": ("a", "b")}, "along", "nothing: a revolute joint does not run along"),
    ({"actuated": 1}, "actuated", "1 -> true or false"),
    ({**SQUARE, "type": "universal", "actuated": True}, "actuated", "an actuated universal joint"),
    ({"actuated": (True, False)}, "actuated", "[True, False] -> true or false"),
    ({"type": "cylindrical", "actuated": 1}, "actuated", "1 -> true, false, or a pair of them: angle, length"),
    ({"type": "cylindrical", "actuated": (True, 1)}, "actuated", "a pair of them"),
    ({"type": "cylindrical", "actuated": (True, False), "max_speed": (1, 2)}, "max_speed", "[1, 2] -> a number"),
    ({"type": "cylindrical", "actuated": True, "max_speed": 1}, "max_speed", "1 -> two numbers"),
    ({"type": "cylindrical", "actuated": True, "max_speed": (1, -2)}, "max_speed", "numbers greater than 0"),
    ({"type": "cylindrical", "actuated": (False, False), "max_speed": 1}, "max_speed", "the joint is not actuated"),
    ({"max_speed": 0}, "max_speed", "0 -> a number greater than 0"),
    ({"max_speed": math.inf}, "max_speed", "a number, finite"),
    ({"max_speed": True}, "max_speed", "True -> a number"),
    ({"max_acceleration": -2.5}, "max_acceleration", "-2.5 -> a number greater than 0"),
    ({"max_acceleration": (1, 2)}, "max_acceleration", "[1, 2] -> a number"),
    ({"actuated": False, "max_speed": 3}, "max_speed", "3 -> nothing: the joint is not actuated"),
    ({"type": "fixed", "axis": None}, "actuated", "an actuated fixed joint"),
    ({"home": (1, 2)}, "home", "[1, 2] -> a number"),
    ({"type": "cylindrical", "actuated": False, "home": 1}, "home", "two numbers"),
    ({"type": "spherical", "axis": None, "actuated": False, "home": 1}, "home", "nothing: it counts from home"),
    ({"range": 3}, "range", "3 -> two numbers"),
    ({"range": (1, -1)}, "range", "(57.29577951 deg) to -1 rad"),
    ({"range": (-math.inf, 1)}, "range", "two numbers, finite: where nothing limits one end, a number that is never"),
    ({"range": (0.5, 1)}, "range", "a range that contains home, 0 rad (0 deg)"),
    ({"type": "cylindrical", "actuated": False, "range": (-1, 1)}, "range[0]", "two numbers"),
    ({"type": "cylindrical", "actuated": False, "range": ((-1, 1), (1, 2))}, "range[1]", "1 to 2 -> a range"),
    ({**SQUARE, "type": "universal", "range": 1}, "range", "two pairs"),
    ({**SQUARE, "type": "universal", "axes": None, "range": ((-1, 1),) * 2}, "range", "`axes` as well"),
    ({"type": "spherical", "axis": None, "actuated": False, "range": (-1, 1)}, "range", "a spherical joint has no"),
    ({"cone": Cone(Z, 1, "base")}, "cone", "a revolute joint has no cone"),
    ({**SQUARE, "type": "universal", "cone": 5}, "cone", "5 -> a cone"),
    ({**SQUARE, "type": "universal", "cone": Cone((0, 0, 0), 3, "base")}, "cone.axis", "not zero"),
    ({**SQUARE, "type": "universal", "cone": Cone(Z, 0, "base")}, "cone.half_angle", "more than 0"),
    ({**SQUARE, "type": "universal", "cone": Cone(Z, 3.2, "base")}, "cone.half_angle", "at most half a turn"),
    ({**SQUARE, "type": "universal", "cone": Cone(Z, 3, "arm1")}, "cone.fixed_to", "'arm1' -> 'base' or 'crank1'"),
    ({**SQUARE, "type": "universal", "cone": Cone(Z, 1, "base")}, "cone.half_angle", "at least the angle at home"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "place", "text"), JOINT_FAULTS)
def test_fault_of_one_joint_is_named_at_its_place_and_nowhere_else(changes, place, text):
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
def test_fault_of_a_prismatic_joint_is_named(changes, text):
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
def test_fault_of_the_head_is_named(head, place, text):
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
def test_fault_between_joints_is_named(joints, end_effector, place, text):
    head = {} if end_effector in ("tip", "arm1") else {"reference_point": (0, 0, 0)}
    faults = faults_of(joints, end_effector, **head)
    assert list(faults) == place.split() and text in faults[place.split()[-1]]


def test_a_tool_that_hangs_on_an_end_effector_joint_is_no_dangling_body() -> None:
    joints = [
        Joint("x", "revolute", ("base", "arm"), at=(0, 0, 0), axis=Z, actuated=True),
        Joint("y", "spherical", ("arm", "tool"), at=(1, 0, 0)),
    ]
    assert Mechanism("arm", joints, "y").bodies == ("base", "arm", "tool")


def tiny(size: float) -> list[Joint]:
    return [dataclasses.replace(joint, at=[size * x for x in joint.at]) for joint in five_bar()]


def cone_at_home(beyond: float) -> list[Joint]:
    joints = hexapod()
    line = np.subtract(joints[2].at, joints[0].at)
    half_angle = math.acos(line[2] / np.linalg.norm(line)) - beyond * TOLERANCES.home_slack
    return changed(joints, "A0", cone=Cone(Z, half_angle, "base"))


def range_at_home(beyond: float) -> list[Joint]:
    return changed(five_bar(), "a", range=(beyond * TOLERANCES.home_slack, 1))


def nearly_parallel(sine: float) -> list[Joint]:
    return changed(hexapod(), "A0", axes=(Z, (sine * TOLERANCES.alignment, 0, 1)))


@pytest.mark.parametrize(
    ("within", "beyond", "place", "text"),
    [
        (tiny(1e-8), tiny(1e-10), "joint", "at least 1e-09"),
        (range_at_home(0.5), range_at_home(2.0), "joint[0].range", "contains home"),
        (cone_at_home(0.5), cone_at_home(2.0), "joint[0].cone.half_angle", "at home to 'C0'"),
        (nearly_parallel(2.0), nearly_parallel(0.5), "joint[0].axes", "parallel"),
        (changed(five_bar(), "a", range=(0, 0)), changed(five_bar(), "a", range=(0, 2e12)), "joint[0].range", "1e+12"),
    ],
)
def test_what_is_just_within_is_accepted_and_what_is_just_beyond_is_not(
    within: list[Joint], beyond: list[Joint], place: str, text: str
) -> None:
    is_point = any(joint.name == "tip" for joint in within)
    head = {"end_effector": "tip"} if is_point else {"end_effector": "platform", "reference_point": (0, 0, 150)}
    Mechanism("m", within, **head)
    assert text in faults_of(beyond, **head)[place]


def test_what_only_follows_from_a_fault_is_not_reported_beside_it() -> None:
    cone = Cone((0, 0, 0), 4, "x")
    assert list(faults_of(changed(five_bar(), "a", cone=cone))) == ["joint[0].cone"]


def test_all_faults_come_in_one_go_and_in_the_order_of_the_description() -> None:
    joints = changed(five_bar(), "a", at=None)
    joints = changed(joints, "b", type="revolve", axis=(0, 0, 0))
    joints = changed(joints, "c", range=(2, 1))
    places = ["name", "end_effector", "joint[0].at", "joint[1].type", "joint[1].axis", "joint[2].range"]
    assert list(faults_of(joints, "nobody", name="")) == places


JUNK = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=3), st.binary(max_size=2),
    st.lists(st.floats(), max_size=3), st.lists(st.lists(st.integers(), max_size=3), max_size=3),
    st.dictionaries(st.text(max_size=2), st.integers(), max_size=2), st.just(np.ones((2, 3))), st.complex_numbers(),
)  # fmt: skip


@given(st.data())
@settings(max_examples=50, deadline=None)
def test_no_value_whatever_escapes_as_another_error(data: st.DataObject) -> None:
    joints, index = five_bar(), data.draw(st.integers(0, 4))
    fields = data.draw(st.lists(st.sampled_from([each.name for each in dataclasses.fields(Joint)]), max_size=3))
    joints[index] = dataclasses.replace(joints[index], **{field: data.draw(JUNK) for field in fields})
    heads = data.draw(st.lists(st.sampled_from(["name", "base", "end_effector"])))
    head = {"name": "5", "joints": joints, "end_effector": "tip"} | {field: data.draw(JUNK) for field in heads}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MobilityWarning)
        try:
            hash(Mechanism(**head))
        except InvalidMechanism as error:
            assert error.faults and str(error)


@given(st.lists(st.tuples(*[st.floats(-1, 1)] * 3), min_size=1, max_size=30), st.floats(1e-9, 1e9))
@settings(max_examples=15, deadline=None)
@example([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], 2.0)
@example([(1, 2, 3)] * 4, 1.0)
def test_no_centre_has_a_smaller_sphere(points: list[tuple[float, ...]], scale: float) -> None:
    """Found by walking toward the farthest point in ever smaller steps: slow, and right to about 1 in 1000."""
    radius, points = enclosing_radius(np.array(points) * scale) / scale, np.array(points)
    centre = points.mean(axis=0)
    for step in range(1, 1000):
        distances = np.linalg.norm(points - centre, axis=1)
        centre = centre + (points[distances.argmax()] - centre) / (step + 1)
    assert radius == pytest.approx(np.linalg.norm(points - centre, axis=1).max(), rel=2e-2, abs=1e-12)
    assert radius >= max(math.dist(a, b) for a in points for b in points) / 2 * (1 - 1e-9)


FIVE_STRUTS = """
schema = 1
name = "five"
end_effector = "platform"
reference_point = [0, 0, -900]
task = ["x", "y", "z", "tilt"]
"""


def test_a_freedom_that_the_task_does_not_set_is_no_warning() -> None:
    """Five struts on rings about the spindle: it turns about z, which a task of position and tilt leaves out."""
    text, feet = FIVE_STRUTS, ((-418, 325), (-160, -500), (160, -500), (418, 325), (0, 530))
    for number, foot in enumerate(feet):
        (x, y), z = np.array(foot) / np.hypot(*foot), -415 - 20 * number
        text += (
            f"[[leg]]\nchain = 'S-P*-R-R'\nbase = [{foot[0]}, {foot[1]}, 0]\nvia = [[{80 * x}, {80 * y}, {z}]]\n"
            f"platform = [0, 0, {z}]\nstroke = [200, 1200]\nC.axis = [{-y}, {x}, 0]\nD.axis = 'z'\n"
        )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        loads(text)
    with pytest.warns(MobilityWarning, match="1 freedom"):
        loads(text.replace('task = ["x", "y", "z", "tilt"]\n', ""))
