"""Legs in shorthand: the joints they stand for, in files and in Python, and every fault at its place."""

from __future__ import annotations

import math
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pfabrik as pf
from pfabrik import Cone, Joint, Leg, Mechanism
from pfabrik.errors import InvalidArgument, InvalidMechanism, MobilityWarning
from pfabrik.machine.description.form_faults import MOST_FAULTS
from pfabrik.machine.description.legs import read_chain
from pfabrik.machine.files import dumps, loads
from pfabrik.machine.files.reading import MOST_JOINTS
from test_files import TRIPOD as JOINTS
from test_files import edited

PAGE = Path(__file__).parents[1] / "docs" / "describing-a-mechanism.md"
HEAD = 'schema = 1\nname = "m"\nend_effector = "platform"\nreference_point = [0, 0, 195]\n'
HEXAPOD = (
    HEAD
    + """
[[leg]]
chain = "U-P*-S"
base = [[100, 20, 0], [100, -20, 0]]
platform = [[40, 40, 195], [40, -40, 195]]
stroke = [155, 280]
copies = { count = 3, axis = [0, 0, 1] }
A.cone = { axis = "vertical", half_angle = 50 }
C.cone = { half_angle = 45 }
"""
)
SERVOS = (
    HEAD
    + """
[[leg]]
chain = "R*-U-S"
base = [[95, 35, 0], [95, -35, 0]]
via = [[95, 65, 0], [95, -65, 0]]
platform = [[55, 45, 125], [55, -45, 125]]
copies = { count = 3, axis = [0, 0, 1] }
A.axis = ["x", "-x"]
A.range = [-80, 80]
B.cone = { half_angle = 40 }
"""
)
TRIPOD = (
    HEAD
    + """
[[leg]]
chain = "P*-R-S"
base = [[110, 0, 100], [-55, 95, 100], [-55, -95, 100]]
platform = [[60, 0, 220], [-30, 52, 220], [-30, -52, 220]]
A = { axis = "vertical", home = 100, range = [40, 160] }
B = { axis = "tangential", range = [-30, 30] }
"""
)
THREE = [(2, 0, 0), (-1, 2, 0), (-1, -2, 0)]
ABOVE = [(1, 0, 3), (-1, 1, 3), (-1, -1, 3)]


def faults_of(text: str) -> dict[str, str]:
    """The faults of a text, in order: place to what was found and expected."""
    with pytest.raises(InvalidMechanism) as caught:
        loads(text, "x.toml")
    places = [fault.place for fault in caught.value.faults]
    assert len(set(places)) == len(places)
    return {fault.place: f"{fault.found} -> {fault.expected}" for fault in caught.value.faults}


def faults_in_python(*legs: Any, **parts: Any) -> dict[str, str]:
    with pytest.raises(InvalidMechanism) as caught:
        Mechanism.from_legs(*legs, reference_point=(0, 0, 3), **parts)
    return {fault.place: f"{fault.found} -> {fault.expected}" for fault in caught.value.faults}


def tripod(chain: str = "R-P*-S", **parts: Any) -> Mechanism:
    parts = {"base": THREE, "platform": ABOVE, "axis": "tangential", "reference_point": (0, 0, 3)} | parts
    return Mechanism.from_legs(chain, **parts)


def round_z(points: list[list[float]]) -> list[list[float]]:
    """Points, and their copies a third and two thirds of a turn about z."""
    turns = [np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) for c, s in ((1, 0), (-0.5, 0.75**0.5), (-0.5, -(0.75**0.5)))]
    return [(R @ point).tolist() for R in turns for point in points]


class TestWhatLegsStandFor:
    def test_a_file_of_legs_is_the_mechanism_that_is_written_joint_by_joint(self):
        bases, tops = round_z([[100, 20, 0], [100, -20, 0]]), round_z([[40, 40, 195], [40, -40, 195]])
        found = loads(HEXAPOD)
        assert len(found.joints) == 18 and found.actuator_names == ("B1", "B2", "B3", "B4", "B5", "B6")
        for k, (a, c) in enumerate(zip(bases, tops, strict=True)):
            line = np.subtract(a, c) / math.dist(a, c)
            A, B, C = found.joints[3 * k : 3 * k + 3]
            assert (A.name, B.name, C.name) == (f"A{k + 1}", f"B{k + 1}", f"C{k + 1}")
            assert (A.type, B.type, C.type) == ("universal", "prismatic", "spherical")
            assert A.connects == ("base", f"AB{k + 1}")
            assert B.connects == (f"AB{k + 1}", f"BC{k + 1}")
            assert C.connects == (f"BC{k + 1}", "platform")
            assert A.at == pytest.approx(a, abs=1e-12) and C.at == pytest.approx(c, abs=1e-12)
            assert B.along == (A.name, C.name) and B.axis is None and B.range == (155.0, 280.0) and B.actuated
            assert A.cone == Cone((0, 0, 1), math.radians(50), "base")
            assert C.cone.half_angle == math.radians(45) and C.cone.fixed_to == "platform"
            assert C.cone.axis == pytest.approx(line, abs=1e-14)

    def test_servo_legs_have_an_axis_each_and_points_between(self):
        found = loads(SERVOS)
        assert [found.joint(f"A{k}").axis for k in (1, 2)] == [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)]
        assert found.joint("A3").axis == pytest.approx((-0.5, 0.75**0.5, 0), abs=1e-15)
        assert found.joint("B2").at == (95.0, -65.0, 0.0)
        assert found.joint("B1").cone.fixed_to == "AB1"
        assert found.joint("B1").cone.axis == pytest.approx(np.array([-40, -20, 125]) / math.hypot(40, 20, 125))
        assert [str(chain) for chain in pf.decompose(found)] == ["R*-U-S"] * 6

    def test_a_star_drives_both_coordinates_of_a_cylindrical_joint_or_the_one_that_is_said(self):
        post = '[[leg]]\nchain = "C*-P*"\nbase = [0, 0, 0]\naxis = "z"\nB.axis = "x"\n'
        head = 'schema = 1\nname = "post"\nend_effector = "platform"\nreference_point = [300, 0, 200]\ntask = ["x"]\n'
        assert loads(head + post).actuator_names == ("A1[0]", "A1[1]", "B1")
        assert loads(head + post + "A.max_speed = [90, 5]\n").joints[0].max_speed == (math.pi / 2, 5.0)
        turned = post + "A.actuated = [true, false]\nA.max_speed = 90\n"
        with pytest.warns(MobilityWarning, match="2 actuators leave the end effector 1 freedom"):
            found = loads(head.replace('["x"]', '["x", "z"]') + turned)
        assert found.actuator_names == ("A1[0]", "B1") and found.joints[0].max_speed == math.pi / 2
        with pytest.warns(MobilityWarning):
            again = Mechanism.from_legs("C*-P*", base=(0, 0, 0), axis="z", name="post", reference_point=(300, 0, 200),
                                        A={"actuated": (True, False), "max_speed": math.pi / 2}, B={"axis": "x"},
                                        task=["x", "z"])  # fmt: skip
        assert again == found
        for said, starred, expected in (
            ("[true, false]", "C-P*", "[True, False] -> nothing: 'C-P*' has no `*` behind the joint"),
            ("false", "C*-P*", "False -> what is driven: 'C*-P*' has a `*` behind the joint"),
            ("[false, false]", "C*-P*", "[False, False] -> what is driven"),
            ("3", "C*-P*", "3 (joint A1) -> true, false, or a pair of them: angle, length"),
        ):
            faults = faults_of(head + post.replace("C*-P*", starred) + f"A.actuated = {said}\n")
            assert faults.keys() == {"leg[0].A.actuated"} and expected in faults["leg[0].A.actuated"]

    def test_drives_say_what_they_can_do_by_their_letters(self):
        found = loads(edited(SERVOS, ("A.range = [-80, 80]", "A.max_speed = 180")))
        assert [found.joint(f"A{leg}").max_speed for leg in range(1, 7)] == [math.pi] * 6
        faults = faults_of(edited(SERVOS, ("A.range = [-80, 80]", "B.max_speed = 180")))
        assert faults["leg[0].B.max_speed"].endswith("(joint B1) -> nothing: the joint is not actuated")

    def test_rails_have_no_point_of_their_own(self):
        found = loads(TRIPOD)
        assert found.joint("A2") == Joint(
            "A2", "prismatic", ("base", "AB2"), axis=(0, 0, 1), actuated=True, home=100, range=(40, 160)
        )
        assert found.joint("B2").at == (-55.0, 95.0, 100.0)
        assert found.joint("B2").axis == pytest.approx(np.array([-95, -55, 0]) / math.hypot(95, 55))
        assert found.joint("B2").range == (math.radians(-30), math.radians(30))

    @pytest.mark.parametrize("text", [HEXAPOD, SERVOS, TRIPOD], ids=["hexapod", "servos", "tripod"])
    def test_what_is_saved_is_joints_and_loads_as_its_equal(self, text):
        found = loads(text)
        assert "[[leg]]" not in dumps(found)
        assert loads(dumps(found)) == found

    def test_python_builds_the_same_as_a_file(self):
        named = {"name": "m", "reference_point": (0, 0, 195)}
        assert loads(HEXAPOD) == Mechanism.from_legs(
            "U-P*-S",
            base=[(100, 20, 0), (100, -20, 0)],
            platform=np.array([[40, 40, 195], [40, -40, 195]]),
            stroke=(155, 280),
            copies={"count": 3, "axis": (0, 0, 1)},
            A={"cone": {"axis": "vertical", "half_angle": math.radians(50)}},
            C={"cone": {"half_angle": math.radians(45)}},
            **named,
        )
        rail = {"axis": "vertical", "home": 100, "range": (40, 160)}
        joints = {"A": rail, "B": {"axis": "tangential", "range": (-math.radians(30), math.radians(30))}}
        bases, tops = [(-55, 95, 100), (-55, -95, 100)], [(-30, 52, 220), (-30, -52, 220)]
        first = Leg("P*-R-S", (110, 0, 100), (60, 0, 220), by_letter=joints)
        others = Leg("P*-R-S", bases, tops, by_letter=joints)
        assert loads(TRIPOD) == Mechanism.from_legs([first, others], **named)

    def test_python_names_the_machine_as_the_field_does(self):
        assert tripod().name == "3-RPS"
        pillar = Leg("U", (0, 0, 3))
        struts = Leg("U-P*-S", THREE[1:], ABOVE[1:])
        assert Mechanism.from_legs([struts, pillar], reference_point=(0, 0, 3)).name == "2-UPS/1-U"

    def test_copies_of_a_leg_are_the_legs_at_the_turned_points(self):
        one = tripod(base=(2, 1, 0), platform=(1, 0, 3), copies={"count": 3, "axis": (0, 0, 1)})
        all_ = tripod(base=round_z([[2, 1, 0]]), platform=round_z([[1, 0, 3]]))
        for each, other in zip(one.joints, all_.joints, strict=True):
            assert (each.name, each.connects, each.along) == (other.name, other.connects, other.along)
            assert each.at == (other.at and pytest.approx(other.at, abs=1e-15))
            assert each.axis == (other.axis and pytest.approx(other.axis, abs=1e-15))

    def test_legs_are_counted_on_and_by_the_name_before_theirs(self):
        struts = Leg("U-P*-S", THREE[:2], ABOVE[:2]), Leg("U-P*-S", THREE[2], ABOVE[2])
        legs = [*struts, Leg("U", (0, 0, 3), name="mid ")]
        found = Mechanism.from_legs(legs, reference_point=(0, 0, 3))
        numbered = [f"{letter}{leg}" for leg in (1, 2, 3) for letter in "ABC"]
        assert [joint.name for joint in found.joints] == [*numbered, "mid A1"]
        prefixed = tripod(
            [Leg("R-P*-S", THREE, ABOVE, axis="tangential", name="leg.")], base=None, platform=None, axis=None
        )
        assert prefixed.joint("leg.B2").connects == ("leg.AB2", "leg.BC2")
        assert prefixed.joint("leg.B2").along == ("leg.A2", "leg.C2")

    def test_joints_of_the_file_come_before_those_of_its_legs(self):
        found = loads(HEXAPOD + MAST.format("Mast"))
        assert [joint.name for joint in found.joints[:3]] == ["Mast", "A1", "B1"]
        assert found.joints == (found.joint("Mast"), *loads(HEXAPOD).joints)

    def test_legs_can_lead_between_other_bodies(self):
        arm = '[[joint]]\nname = "Slide"\ntype = "prismatic"\nactuated = true\nconnects = ["base", "table"]\n'
        arm += "axis = [1, 0, 0]\n"
        found = loads(edited(HEXAPOD, ("copies", 'connects = ["table", "platform"]\ncopies')) + arm)
        assert found.joint("A1").connects == ("table", "AB1")
        assert found.joint("A1").cone.fixed_to == "table"

    def test_legs_to_bodies_that_meet_in_a_tip_make_a_five_bar(self):
        text = edited(HEAD, ('"platform"', '"Tip"'), ("reference_point = [0, 0, 195]\n", ""))
        for side, x in (("L", -1), ("R", 1)):
            text += f'[[leg]]\nname = "{side}"\nchain = "R*-R"\nconnects = ["base", "fore{side}"]\naxis = "z"\n'
            text += f"base = [{50 * x}, 0, 0]\nplatform = [{116 * x}, 88, 0]\n"
        text += '[[joint]]\nname = "Tip"\ntype = "revolute"\nconnects = ["foreL", "foreR"]\n'
        text += "at = [0, 175, 0]\naxis = [0, 0, 1]\n"
        found = loads(text)
        assert found.actuator_names == ("LA1", "RA1")
        assert [str(chain) for chain in pf.decompose(found)] == ["R*-R-R", "R*-R-R"]

    @pytest.mark.parametrize(("chain", "letter"), [("R*-S-S", "B"), ("R*-P-S-S", "C")])
    @pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
    def test_points_of_a_single_joint_between_need_no_list_around_them(self, chain, letter):
        via = [(3.0, 0.0, 1.0), (0.0, 3.0, 1.0), (0.0, -3.0, 1.0)]
        for points in (via, [via]):
            found = tripod(chain, via=points)
            assert [found.joint(f"{letter}{k}").at for k in (1, 2, 3)] == via

    @pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
    def test_several_joints_between_have_a_list_each(self):
        lists = [[(3, 0, 1), (0, 3, 1), (0, -3, 1)], [(3, 0, 2), (0, 3, 2), (0, -3, 2)]]
        found = tripod("R*-U-R-S", via=lists, B={"axes": ["x", "y"]})
        assert found.joint("B2").at == (0.0, 3.0, 1.0) and found.joint("C3").at == (0.0, -3.0, 2.0)
        single = tripod("R*-U-R-S", base=THREE[0], platform=ABOVE[0], via=[lists[0][0], lists[1][0]])
        assert single.joint("C1").at == (3.0, 0.0, 2.0)

    def test_a_chain_with_one_centre_has_one_point_at_either_end(self):
        struts = Leg("U-P*-S", THREE[:2], ABOVE[:2])
        for end in ({"base": (0, 0, 2)}, {"platform": (0, 0, 2)}):
            with pytest.warns(MobilityWarning):
                found = Mechanism.from_legs(
                    [struts, Leg("U-P", axis="vertical", name="m", **end)], reference_point=(0, 0, 3)
                )
            assert found.joint("mA1").at == (0.0, 0.0, 2.0) and found.joint("mB1").axis == (0.0, 0.0, 1.0)

    def test_slides_alone_need_no_points(self):
        gantry = Mechanism.from_legs(
            "P*-P*-P*", reference_point=(0, 0, 0), A={"axis": "x"}, B={"axis": "y", "range": (0, 2)}, C={"axis": "-z"}
        )
        assert [joint.axis for joint in gantry.joints] == [(1, 0, 0), (0, 1, 0), (0, 0, -1)]
        assert gantry.joints[1].connects == ("AB1", "BC1")

    def test_a_slide_between_two_joints_runs_along_them_unless_it_has_an_axis(self):
        assert tripod().joint("B1").along == ("A1", "C1")
        slide = tripod(B={"axis": "vertical"}).joint("B1")
        assert slide.along is None and slide.axis == (0.0, 0.0, 1.0)

    @given(st.lists(st.sampled_from(["R", "R*", "P", "P*", "U", "S", "C"]), min_size=2, max_size=7), st.data())
    @settings(deadline=None)
    def test_any_chain_comes_out_as_it_was_written(self, parts, data):
        chain = "-".join(parts)
        centred = sum(part[0] != "P" for part in parts)
        point = st.tuples(*[st.floats(1, 9)] * 3)
        points = data.draw(st.lists(point, min_size=2 * max(centred, 1), max_size=2 * max(centred, 1), unique=True))
        rows = [points[2 * k : 2 * k + 2] for k in range(centred)]
        where: dict[str, Any] = {"base": rows[0] if rows else None}
        where |= {"platform": rows[-1] if centred > 1 else None, "via": rows[1:-1] or None}
        letters = {
            step.letter: {"axis": "x"}
            for step in read_chain(chain)
            if step.type in ("revolute", "prismatic", "cylindrical")
        }
        driven = Joint("drive", "revolute", ("base", "platform"), at=(0, 0, 0), axis=(0, 0, 1), actuated=True)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MobilityWarning)
            found = Mechanism.from_legs(chain, reference_point=(0, 0, 3), joints=[driven], **where, **letters)
            assert loads(dumps(found)) == found
        legs = 2 if rows else 1
        assert [str(each) for each in pf.decompose(found)] == ["R*"] + [chain] * legs


@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
class TestDirections:
    def test_words_point_where_they_say(self):
        found = tripod(base=[(3, 4, 1), (-1, 0, 0), (0, 5, 7)], axis="radial")
        assert [found.joint(f"A{k}").axis for k in (1, 2, 3)] == [(0.6, 0.8, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
        found = tripod(base=[(3, 4, 1), (-1, 0, 0), (0, 5, 7)], axis="-tangential")
        assert [found.joint(f"A{k}").axis for k in (1, 2, 3)] == [(0.8, -0.6, 0.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)]

    @pytest.mark.parametrize(("axis", "expected"), [
        ("x", [(1, 0, 0)] * 3), ("-y", [(0, -1, 0)] * 3), ("-vertical", [(0, 0, -1)] * 3),
        ((0, 3, 4), [(0, 0.6, 0.8)] * 3), (["x", (0, 2, 0), "-z"], [(1, 0, 0), (0, 1, 0), (0, 0, -1)]),
    ])  # fmt: skip
    def test_a_direction_holds_for_all_legs_or_one_for_each(self, axis, expected):
        found = tripod(axis=axis)
        assert [found.joint(f"A{k}").axis for k in (1, 2, 3)] == expected

    @pytest.mark.parametrize(("axes", "expected"), [
        (["radial", "vertical"], ((1, 0, 0), (0, 0, 1))),
        ([[0, 2, 0], "x"], ((0, 1, 0), (1, 0, 0))),
        ([["y", "z"], ["x", "y"], ["x", [0, 1, 1]]], ((0, 1, 0), (0, 0, 1))),
    ])  # fmt: skip
    def test_the_two_axes_of_universal_joints_are_written_alike(self, axes, expected):
        limits = ((-1, 1), (-2, 2))
        found = tripod("U-P*-S", axis=None, A={"axes": axes, "range": limits})
        assert found.joint("A1").axes == expected and found.joint("A1").range == limits
        if len(axes) == 3:
            assert found.joint("A3").axes[1] == pytest.approx((0, 0.5**0.5, 0.5**0.5))

    def test_a_rail_points_from_where_its_carriage_is(self):
        found = tripod("P*-R-S", axis="tangential", A={"axis": "radial"})
        assert found.joint("A1").axis == (1.0, 0.0, 0.0) and found.joint("B1").axis == (0.0, 1.0, 0.0)

    def test_the_axis_of_the_leg_is_for_joints_that_need_one_and_have_none(self):
        found = tripod("R-P*-R", axis="z", C={"axis": "-z"})
        assert [found.joint(name).axis for name in ("A1", "B1", "C1")] == [(0, 0, 1), None, (0, 0, -1)]


@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
class TestCones:
    def test_without_an_axis_they_stand_on_the_line_at_home(self):
        found = tripod("U-P*-S", axis=None, A={"cone": {"half_angle": 1}}, C={"cone": {"half_angle": 2}})
        along = np.array([-1, 0, 3]) / 10**0.5
        assert found.joint("A1").cone.axis == pytest.approx(along) and found.joint("A1").cone.fixed_to == "base"
        assert found.joint("C1").cone.axis == pytest.approx(-along) and found.joint("C1").cone.fixed_to == "platform"

    @pytest.mark.parametrize(("fixed_to", "body", "axis"), [(None, "AB1", (-2, 0, 2)), ("BC", "BC1", (-1, 0, -1))])
    def test_between_the_ends_they_are_fixed_to_the_inner_body_unless_told(self, fixed_to, body, axis):
        cone = {"half_angle": 1} | ({"fixed_to": fixed_to} if fixed_to else {})
        found = tripod("R*-S-S", via=[(3, 0, 1), (0, 3, 1), (0, -3, 1)], B={"cone": cone})
        assert found.joint("B1").cone.fixed_to == body
        assert found.joint("B1").cone.axis == pytest.approx(np.array(axis) / np.linalg.norm(axis))

    def test_they_may_have_an_axis_of_their_own_for_each_leg(self):
        cone = {"axis": ["x", "-vertical", (0, 0, -2)], "half_angle": math.pi}
        found = tripod(C={"cone": cone})
        assert [found.joint(f"C{k}").cone.axis for k in (1, 2, 3)] == [(1, 0, 0), (0, 0, -1), (0, 0, -1)]
        assert tripod(C={"cone": Cone((0, 0, -1), 1, "platform")}).joint("C2").cone == Cone((0, 0, -1), 1, "platform")


MAST = '[[joint]]\nname = "{}"\ntype = "universal"\nconnects = ["base", "platform"]\nat = [0, 0, 195]\n'
HOSTILE = [
    ("leg = 5\n" + HEAD, "leg", "5 -> [[leg]] tables"),
    (HEAD + "leg = [7]", "leg[0]", "7 -> a [[leg]] table"),
    (HEAD + "[[leg]]", "leg[0].chain", "nothing -> joints from the base outward"),
    (HEAD + "[[leg]]\n" * (MOST_JOINTS + 1), "leg", f"{MOST_JOINTS + 1} [[leg]] tables -> at most {MOST_JOINTS}"),
    (edited(HEXAPOD, ("count = 3", "count = 100"), ("base = [", "base = [" + "[1, 2, 3]," * 9)),
     "leg", "3300 joints -> at most"),
    (edited(HEXAPOD, ('"U-P*-S"', '"UPS"')), "leg[0].chain", "did you mean 'U-P-S'?"),
    (edited(HEXAPOD, ('"U-P*-S"', '"U P* S"')), "leg[0].chain", "did you mean 'U-P*-S'?"),
    (edited(HEXAPOD, ('"U-P*-S"', '"u-p*-s"')), "leg[0].chain", "did you mean 'U-P*-S'?"),
    (edited(HEXAPOD, ('"U-P*-S"', '"U-X*-S"')), "leg[0].chain", "'U-X*-S' -> joints from the base outward"),
    (edited(HEXAPOD, ('"U-P*-S"', f'"{"-".join("S" * 27)}"')), "leg[0].chain", "joints from the base outward"),
    (edited(HEXAPOD, ('"U-P*-S"', "3")), "leg[0].chain", "3 -> joints from the base outward"),
    (edited(HEXAPOD, ("U-P*-S", "U-P-S")),
     "joint", "no actuated joint -> at least one joint with `actuated = true`, or `*`"),
    (edited(HEXAPOD, ("U-P*-S", "U*-P*-S")), "leg[0].chain", "an actuated universal joint (joint A1)"),
    (edited(HEXAPOD, ("base = [[100, 20, 0], [100, -20, 0]]\n", "")), "leg[0].base", "nothing -> points"),
    (edited(HEXAPOD, ("base = [[100, 20, 0], [100, -20, 0]]", "base = []")), "leg[0].base", "[] -> points"),
    (edited(HEXAPOD, ("[100, -20, 0]", "[100, -20]")), "leg[0].base[1]", "[100, -20] -> three numbers"),
    (edited(HEXAPOD, (", [40, -40, 195]]", "]")), "leg[0].platform", "1 point -> 2, one for each leg"),
    (edited(HEXAPOD, ("[[40, 40, 195], [40, -40, 195]]", "[40, 40, 195]")), "leg[0].platform", "1 point -> 2"),
    (edited(HEXAPOD, ("stroke", "via = [[1, 2, 3], [4, 5, 6]]\nstroke")),
     "leg[0].via", "nothing: no joint of 'U-P*-S'"),
    (edited(SERVOS, ("via = [[95, 65, 0], [95, -65, 0]]\n", "")), "leg[0].via", "nothing -> points"),
    (edited(SERVOS, ("R*-U-S", "R*-U-R-S")), "leg[0].via", "2 lists of points, one for each joint of 'R*-U-R-S'"),
    (edited(SERVOS, ("R*-U-S", "R*-U-R-R-S")), "leg[0].via", "3 lists of points, one for each joint of 'R*-U-R-R-S'"),
    (edited(SERVOS, ("[95, -65, 0]", "[95, -65]")), "leg[0].via[1]", "[95, -65] -> three numbers"),
    (edited(SERVOS, ('A.axis = ["x", "-x"]\n', "")), "leg[0].A.axis", "nothing, for a revolute joint -> a direction"),
    (edited(SERVOS, ('["x", "-x"]', '["x", "-x", "y"]')),
     "leg[0].A.axis", "3 directions -> one, or one for each leg: 2"),
    (edited(SERVOS, ('["x", "-x"]', '["x", "u"]')), "leg[0].A.axis[1]", "'u' -> a direction"),
    (edited(SERVOS, ('["x", "-x"]', '"radail"')), "leg[0].A.axis", "'radail'; did you mean 'radial'? -> a direction"),
    (edited(SERVOS, ('["x", "-x"]', "[0, 0, 0]")), "leg[0].A.axis", "not zero"),
    (edited(SERVOS, ('["x", "-x"]', "{ x = 1 }")), "leg[0].A.axis", "{'x': 1} -> a direction"),
    (edited(SERVOS, ("via", 'axis = "z"\nvia')), "leg[0].axis", "'z' -> nothing: no joint needs it"),
    (edited(SERVOS, ("via", "stroke = [1, 2]\nvia")), "leg[0].stroke", "nothing: no joint of 'R*-U-S' is prismatic"),
    (edited(TRIPOD, ("[110, 0, 100]", "[0, 0, 100]")), "leg[0].B.axis", "'tangential' at a joint on the z axis"),
    (edited(TRIPOD, ("A = {", "stroke = [1, 2]\nA = {")),
     "leg[0].stroke", "both `stroke` and `A.range` -> one of them"),
    (edited(TRIPOD, ("P*-R-S", "P*-P-R-S"), ("A = {", 'axis = "x"\nstroke = [1, 2]\nA = {'), ("B = ", "C = ")),
     "leg[0].stroke", "A.range, B.range"),
    (edited(TRIPOD, ("range = [40, 160]", "range = [40, 90]")),
     "leg[0].A.range", "40 to 90 (joint A1) -> a range that contains home"),
    (edited(TRIPOD, ("range = [-30, 30]", "range = [30, -30]")), "leg[0].B.range", "the lowest value first"),
    (edited(TRIPOD, ("home = 100", "homme = 100")), "leg[0].A.homme", "did you mean 'home'?"),
    (edited(TRIPOD, ("B = {", "Z = {")), "leg[0].Z", "a joint that the chain does not have -> one of A, B, C"),
    (edited(TRIPOD, ("B = {", "b = {")), "leg[0].b", "did you mean 'B'? -> one of chain, name, connects"),
    (edited(TRIPOD, ("B = {", "bb = {")), "leg[0].bb", "or the letter of one of its joints"),
    (edited(TRIPOD, ('B = { axis = "tangential", range = [-30, 30] }', "B = 3")),
     "leg[0].B", "3 -> a table: axis, axes"),
    (edited(HEXAPOD, ("stroke = [155, 280]", "stroke = [280, 155]")), "leg[0].stroke", "280 to 155 (joint B1)"),
    (edited(HEXAPOD, ("stroke = [155, 280]", "stroke = [210, 280]")),
     "leg[0].stroke", "a range that contains home, 205"),
    (edited(HEXAPOD, ("stroke", "strok")), "leg[0].strok", "did you mean 'stroke'?"),
    (edited(HEXAPOD, ("stroke", "range")), "leg[0].range", "did you mean 'A.range' or 'B.range' or 'C.range'?"),
    (edited(HEXAPOD, ("[40, 40, 195]", "[100, 20, 0]")),
     "leg[0].platform[0]", "two joints at the same place (joint B1)"),
    (edited(HEXAPOD, ("half_angle = 50", "half_angle = 5")),
     "leg[0].A.cone.half_angle", "at least the angle at home to 'C1'"),
    (edited(HEXAPOD, ('"vertical"', '"vertcal"')), "leg[0].A.cone.axis", "did you mean 'vertical'?"),
    (edited(HEXAPOD, ("half_angle = 45", 'half_angle = 45, fixed_to = "platfrom"')),
     "leg[0].C.cone.fixed_to", "did you mean 'platform'? -> 'BC' or 'platform'"),
    (edited(HEXAPOD, ("A.cone = {", "B.cone = {")), "leg[0].B.cone", "nothing: a prismatic joint has no cone"),
    (edited(HEXAPOD, ("A.cone =", "A.home =")), "leg[0].A.home", "(joint A1) -> two numbers"),
    (edited(HEXAPOD, ("copies", 'connects = ["base"]\ncopies')),
     "leg[0].connects", "['base'] -> the names of two bodies"),
    (edited(HEXAPOD, ("copies", 'connects = ["base", "platfrom"]\ncopies')),
     "end_effector", "did you mean 'platfrom'?"),
    (HEXAPOD + MAST.format("A2"), "leg[0].name", "'A2', the name of an earlier joint (joint A2)"),
    (edited(HEXAPOD, ('"platform"', '"T"')) + MAST.format("T"), "leg[0].connects", "the end effector 'T' is a joint"),
]  # fmt: skip


class TestFaults:
    @pytest.mark.parametrize(("text", "place", "fault"), HOSTILE, ids=range(len(HOSTILE)))
    def test_a_faulty_leg_is_refused_with_a_fault_at_its_place(self, text, place, fault):
        assert fault in faults_of(text)[place]

    @pytest.mark.parametrize(("old", "new", "place"), [
        ("stroke = [155, 280]", "stroke = [210, 280]", "leg[0].stroke"),
        ("half_angle = 45", "half_angle = 200", "leg[0].C.cone.half_angle"),
        ("count = 3", "count = 0", "leg[0].copies.count"),
    ])  # fmt: skip
    def test_one_mistake_is_reported_once(self, old, new, place):
        assert list(faults_of(edited(HEXAPOD, (old, new)))) == [place]

    def test_a_mistake_in_one_leg_names_its_joint(self):
        found = faults_in_python("U-P*-S", base=THREE, platform=[*ABOVE[:2], (-1, -1, 9)], stroke=(3, 4))
        assert list(found) == ["leg[0].stroke"] and "(joint B3)" in found["leg[0].stroke"]

    def test_all_faults_come_in_one_go_and_in_the_order_of_the_keys(self):
        text = edited(
            HEXAPOD,
            ('name = "m"', 'nmae = "m"'),
            ("[40, -40, 195]", "[40, -40]"),
            ("stroke = [155, 280]", "stroke = [280, 155]\nstork = 1"),
            ('"vertical"', '"vertcal"'),
            ("half_angle = 45", "half_angle = -45"),
            ("copies = ", 'connects = ["base"]\ncopies = '),
        )
        text += edited(MAST.format("Mast"), ("universal", "universa"))
        assert list(faults_of(text)) == [
            "nmae", "name", "joint[0].type", "leg[0].connects", "leg[0].platform[1]", "leg[0].stroke",
            "leg[0].A.cone.axis", "leg[0].C.cone.half_angle", "leg[0].stork",
        ]  # fmt: skip

    def test_faults_of_python_are_at_the_places_of_a_file(self):
        parts = {"base": THREE, "platform": ABOVE[:2], "axis": "tangental", "stroke": (4, 2)}
        found = faults_in_python("R-P*-S", **parts, C={"cone": {"half_angle": 9, "x": 1}})
        expected = ["platform", "axis", "stroke", "C.cone.x", "C.cone.half_angle"]
        assert list(found) == [f"leg[0].{place}" for place in expected]
        found = faults_in_python([Leg("U-P*-S", THREE, ABOVE), Leg("U-P*-S", THREE, ABOVE, stroke=(1, 2))])
        assert list(found) == ["leg[1].stroke"]

    @pytest.mark.parametrize(("parts", "place", "fault"), [
        ({"A": {"axes": ["x"]}}, "leg[0].A.axes", "two directions, or two for each leg (3)"),
        ({"A": {"axes": ["x", "x"]}}, "leg[0].A.axes", "two parallel axes"),
        ({"A": {"axes": [["x", "y"], ["x", "q"], ["x", "y"]]}}, "leg[0].A.axes[1][1]", "'q' -> a direction"),
        ({"A": {"axis": "x"}}, "leg[0].A.axis", "nothing: a universal joint has no axis"),
        ({"A": {"rnage": 1}}, "leg[0].A.rnage", "did you mean 'range'?"),
        ({"A": 5}, "leg[0].A", "5 -> a table"),
        ({"A": {"cone": 5}}, "leg[0].A.cone", "5 -> a table"),
        ({"D": {}}, "leg[0].D", "a joint that the chain does not have"),
        ({"AC": {}}, "leg[0].AC", "a body that the chain does not have -> one of AB, BC, between the joints"),
        ({"AB": 5}, "leg[0].AB", "5 -> a table"),
        ({"AB": {"desnity": 1}}, "leg[0].AB.desnity", "did you mean 'density'?"),
        ({"AB": {"density": 1}}, "leg[0].AB.thickness", "nothing -> a number"),
        ({"AB": {"thickness": -1}}, "leg[0].AB.thickness", "-1 -> more than 0"),
        ({"AB": {"thickness": 1, "mass": -1}}, "leg[0].AB.mass", "-1 -> kilograms"),
        ({"AB": {"thickness": 1, "density": 1, "mass": 1}}, "leg[0].AB.mass", "density"),
        ({"AB": {"mass": 1}}, "leg[0].AB.centre", "nothing -> three numbers"),
        ({"AB": {"mass": 1, "centre": (0, 0, 1)}}, "leg[0].AB.centre", "1 point -> 3, one for each leg"),
        ({"B": {"home": [1, 2]}}, "leg[0].B.home", "2 values -> one, or one for each leg: 3"),
        ({"B": {"range": [(1, 2)] * 4}}, "leg[0].B.range", "4 values -> one, or one for each leg: 3"),
        ({"copies": {"count": 2.5, "axis": (0, 0, 1)}}, "leg[0].copies.count", "2.5 -> a whole number"),
        ({"copies": {"count": 2}}, "leg[0].copies.axis", "nothing -> three numbers"),
        ({"copies": {"cuont": 2}}, "leg[0].copies.cuont", "did you mean 'count'?"),
        ({"copies": 3}, "leg[0].copies", "3 -> a table: count, axis"),
        ({"stroke": "long"}, "leg[0].stroke", "'long' (joint B1) -> two numbers"),
        ({"base": "here"}, "leg[0].base", "'here' -> points of three numbers"),
        ({"base_body": ""}, "base", "a text that is not empty"),
        ({"joints": [5]}, "joint", "5"),
    ])  # fmt: skip
    def test_wrong_parts_in_python_are_refused(self, parts, place, fault):
        assert fault in faults_in_python("U-P*-S", **({"base": THREE, "platform": ABOVE} | parts))[place]

    @pytest.mark.parametrize(("legs", "parts", "argument"), [
        (5, {}, "legs"), ([], {}, "legs"), ([5], {}, "legs"), (["U-P*-S"], {}, "legs"),
        (Leg("U-P*-S", THREE, ABOVE), {"base": THREE}, "base"), (Leg("U-P*-S", THREE, ABOVE), {"A": {}}, "by_letter"),
    ])  # fmt: skip
    def test_wrong_calls_are_refused(self, legs, parts, argument):
        with pytest.raises(InvalidArgument) as caught:
            Mechanism.from_legs(legs, reference_point=(0, 0, 3), **parts)
        assert caught.value.argument == argument

    @pytest.mark.parametrize(("leg", "place", "fault"), [
        (Leg("U-P*-S", THREE, ABOVE, connects="ab"), "leg[1].connects", "'ab' -> the names of two bodies"),
        (Leg("U-P*-S", THREE, ABOVE, by_letter=5), "leg[1]", "what is said of joints, by their letters"),
        (Leg("U", (0, 0, 1), (0, 0, 3)), "leg[1].platform", "nothing: 'U' has one joint with a centre, at `base`"),
        (Leg("P", (0, 0, 1), axis="x"), "leg[1].base", "nothing: 'P' has no joint with a centre"),
        (Leg("U"), "leg[1].base", "nothing -> points"),
        (Leg("U", (0, 0, 1), via=(0, 0, 2)), "leg[1].via", "nothing: no joint of 'U'"),
        (Leg("U", (0, 0, 1), by_letter={"A": {"cone": {"half_angle": 1}}}), "leg[1].A.cone.axis", "no next joint"),
        (Leg("P-S", (0, 0, 1), axis="radial"), "leg[1].axis", "'radial' at a joint on the z axis"),
        (Leg("P", axis="radial"), "leg[1].axis", "'radial' at a joint on the z axis"),
    ])  # fmt: skip
    def test_legs_that_do_not_hold_together_are_refused(self, leg, place, fault):
        assert fault in faults_in_python([Leg("U-P*-S", THREE, ABOVE), leg])[place]

    def test_too_few_actuators_are_a_warning(self):
        with pytest.warns(MobilityWarning, match="3 actuators leave the end effector 3 freedoms"):
            tripod("U-P*-S", axis=None)

    def test_as_many_joints_as_a_mechanism_may_have_are_accepted(self):
        single = HEAD + '[[leg]]\nchain = "U-P*-S"\nbase = [2, 1, 0]\nplatform = [1, 0, 3]\n'
        assert len(loads(single + "copies = { count = 100, axis = [0, 0, 1] }").joints) == 300
        assert (
            "1020 joints" in faults_of(single + '[[leg]]\nchain = "U-P*-S"\nbase = [' + "[1, 2, 3]," * 339 + "]")["leg"]
        )

    def test_faults_beyond_number_are_counted(self):
        found = faults_of(HEXAPOD + "".join(f"k{number} = 1\n" for number in range(1000)))
        assert len(found) == MOST_FAULTS + 1

    @given(st.sampled_from([HEXAPOD, SERVOS, TRIPOD, JOINTS]), st.data())
    @settings(max_examples=60, deadline=None)
    def test_no_edit_of_a_file_escapes_as_another_error(self, text, data):
        for _ in range(data.draw(st.integers(1, 3))):
            parts = re.findall(r'\[[^\[\]]*\]|"[^"]*"|(?<= )\d+|true|\w+ =|(?<=[-"])[RPUS]\*?', text)
            words = ['"base"', '"x"', "[0, 0]", "[]", "{}", "-1e300", "nan", "0", "x =", "P*", "C"]
            old, new = data.draw(st.sampled_from(parts)), data.draw(st.sampled_from(words))
            text = text.replace(old, new, data.draw(st.integers(1, 3)))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MobilityWarning)
            try:
                assert loads(dumps(loads(text))) == loads(text)
            except InvalidMechanism as error:
                assert error.faults


class TestLegs:
    def test_a_leg_is_frozen_and_copies_what_it_is_given(self):
        points, said = np.array([THREE[0]], dtype=float), {"A": {"axis": [0, 1, 0]}}
        leg = Leg("R-P*-S", points, [ABOVE[0]], by_letter=said)
        points[0, 0], said["A"]["axis"] = 99.0, "x"
        assert leg.base == ((2.0, 0.0, 0.0),) and leg.by_letter["A"]["axis"] == (0.0, 1.0, 0.0)
        with pytest.raises(AttributeError):
            leg.chain = "U"
        with pytest.raises(TypeError):
            leg.by_letter["B"] = {}


def test_the_legs_of_the_page_are_mechanisms():
    texts = re.findall(r"^```\n(\[\[leg\]\]\n.*?)^```$", PAGE.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    assert len(texts) >= 2
    for text in texts:
        chains = {str(chain) for chain in pf.decompose(loads(HEAD + text))}
        assert chains <= set(re.findall(r'chain = "([^"]*)"', text))
