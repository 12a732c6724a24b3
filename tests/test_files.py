"""Mechanism files: what they say is what is built, what is saved is what is loaded, and what is wrong is named."""

from __future__ import annotations

import math
import os
import re
import warnings
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pfabrik.catalog import catalog, catalog_file
from pfabrik.description.copies import MOST_COPIES, cos_sin
from pfabrik.description.form_faults import MOST_FAULTS
from pfabrik.description.mechanism import Cone, Joint, Mechanism
from pfabrik.errors import InvalidArgument, InvalidMechanism, MobilityWarning, UnknownName
from pfabrik.files import LARGEST_FILE, MOST_DOTS, dumps, load, loads, save
from pfabrik.files.reading import MOST_JOINTS
from pfabrik.files.units import exact_degrees
from pfabrik.whole_files import whole_path

HEAD = 'schema = 1\nname = "m"\nend_effector = "platform"\nreference_point = [0, 0, 3]\n'
TRIPOD = (
    HEAD
    + """
[[joint]]
name = "A"
type = "revolute"
connects = ["base", "cylinder"]
at = [2, 0, 0]
axis = [0, 1, 0]
copies = { count = 3, axis = [0, 0, 1] }

[[joint]]
name = "B"
type = "prismatic"
actuated = true
connects = ["cylinder", "rod"]
along = ["A", "C"]
range = [2, 4]
copies = { count = 3, axis = [0, 0, 1] }

[[joint]]
name = "C"
type = "spherical"
connects = ["rod", "platform"]
at = [1, 0, 3]
cone = { axis = [0, 0, -1], half_angle = 60, fixed_to = "platform" }
copies = { count = 3, axis = [0, 0, 1] }
"""
)
CRANK = """
[[joint]]
name = "A"
type = "revolute"
actuated = true
connects = ["base", "platform"]
at = [0, 0, 0]
axis = [0, 0, 1]
"""


def faults_of(text: str) -> dict[str, str]:
    """The faults of a text: place to what was found and expected."""
    with pytest.raises(InvalidMechanism) as caught:
        loads(text, "x.toml")
    assert caught.value.source == "x.toml" and str(caught.value).startswith("x.toml: ")
    return {fault.place: f"{fault.found} -> {fault.expected}" for fault in caught.value.faults}


def edited(*edits: tuple[str, str], text: str = TRIPOD) -> str:
    """The text with each edit made once."""
    for old, new in edits:
        assert old in text
        text = text.replace(old, new, 1)
    return text


class TestReading:
    @pytest.mark.parametrize("name", catalog())
    def test_every_catalogue_machine_loads_and_survives_the_round_trip(self, name):
        machine = load(name)
        with catalog_file(name).open("rb") as file:
            assert loads(file.read().decode()) == machine
        assert loads(dumps(machine)) == machine

    def test_catalogue_names_are_sorted_and_refuse_others(self):
        assert list(catalog()) == sorted(catalog()) and "stewart" in catalog()
        with pytest.raises(UnknownName, match="did you mean 'stewart'"):
            catalog_file("stewrat")

    def test_angles_are_converted_and_lengths_are_not(self):
        limits = CRANK + "home = 30\nrange = [-90, 180]\n"
        joint = loads(HEAD + limits).joints[0]
        assert joint.home == math.radians(30) and joint.range == (math.radians(-90), math.radians(180))
        units = 'units = { length = "in", angle = "rad" }\n'
        joint = loads(HEAD + units + CRANK + "home = 1\nrange = [-1, 3]").joints[0]
        assert joint.home == 1.0 and joint.range == (-1.0, 3.0)

    def test_speeds_are_in_the_unit_of_the_coordinate(self):
        machine = loads(HEAD + CRANK + "max_speed = 90\nmax_acceleration = 180\n")
        assert machine.joints[0].max_speed == math.pi / 2 and machine.joints[0].max_acceleration == math.pi
        assert "max_speed = 90.0" in dumps(machine) and loads(dumps(machine)) == machine
        struts = loads(edited(("range = [2, 4]", "range = [2, 4]\nmax_speed = 0.5")))
        assert [struts.joint(f"B{leg}").max_speed for leg in (1, 2, 3)] == [0.5] * 3
        assert loads(dumps(struts)) == struts

    def test_only_the_first_coordinate_of_a_cylindrical_joint_is_an_angle(self):
        text = edited(("revolute", "cylindrical"), ("actuated = true\n", ""), text=CRANK)
        text += "home = [90, 5]\nrange = [[0, 180], [4, 6]]\n"
        text += edited(('"A"', '"B"'), text=CRANK)
        joint = loads(HEAD + text).joints[0]
        assert joint.home == (math.pi / 2, 5.0) and joint.range == ((0.0, math.pi), (4.0, 6.0))

    @pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
    def test_either_coordinate_of_a_cylindrical_joint_is_driven_and_its_speed_is_in_its_own_unit(self):
        said = {"true": "[90, 5]", "[true, true]": "[90, 5]", "[true, false]": "90", "[false, true]": "5"}
        names = {"true": ("A[0]", "A[1]"), "[true, false]": ("A[0]",), "[false, true]": ("A[1]",)}
        speeds = {"true": (math.pi / 2, 5.0), "[true, false]": math.pi / 2, "[false, true]": 5.0}
        for driven, speed in said.items():
            text = edited(("revolute", "cylindrical"), ("actuated = true\n", f"actuated = {driven}\n"), text=CRANK)
            machine = loads(HEAD + text + f"max_speed = {speed}\n")
            driven = driven.replace("[true, true]", "true")
            assert machine.actuator_names == names[driven] and machine.joints[0].max_speed == speeds[driven]
            assert loads(dumps(machine)) == machine and f"actuated = {driven}\n" in dumps(machine)

    def test_universal_ranges_are_angles(self):
        limits = "axes = [[0, 1, 0], [1, 0, 0]]\nrange = [[-90, 90], [-45, 45]]\n"
        with pytest.warns(MobilityWarning):
            machine = loads(edited(("revolute", "universal"), ("axis = [0, 1, 0]\n", limits)))
        assert machine.joint("A1").range == ((-math.pi / 2, math.pi / 2), (-math.pi / 4, math.pi / 4))

    def test_byte_order_mark_and_windows_line_ends_are_accepted(self, tmp_path):
        path = tmp_path / "m.toml"
        path.write_bytes(b"\xef\xbb\xbf" + TRIPOD.replace("\n", "\r\n").encode())
        assert load(path) == load(str(path)) == loads(TRIPOD)

    def test_missing_actuators_warn_with_the_numbers(self):
        with pytest.warns(MobilityWarning, match="2 actuators leave the end effector 1 freedom"):
            text = dumps(loads(TRIPOD)).replace("actuated = true\n", "", 1)
            loads(text)


class TestCopies:
    def test_copies_are_numbered_and_the_base_and_end_effector_are_not(self):
        machine = loads(TRIPOD)
        assert [joint.name for joint in machine.joints] == [f"{name}{n}" for name in "ABC" for n in range(1, 4)]
        assert machine.joint("A2").connects == ("base", "cylinder2")
        assert machine.joint("B3").along == ("A3", "C3")
        assert machine.joint("C2").connects == ("rod2", "platform")
        assert machine.joint("C3").cone.fixed_to == "platform"

    def test_cone_of_a_copy_turns_and_follows_its_copied_body(self):
        text = edited(
            ('["rod", "platform"]', '["rod", "rider"]'),
            ("axis = [0, 0, -1]", "axis = [1, 0, 3]"),
            ('fixed_to = "platform"', 'fixed_to = "rod"'),
        )
        text += edited(("base", "rider"), ("[0, 0, 0]", "[1, 0, 6]"), ('"A"', '"D"'), text=CRANK)
        cone = loads(text + "copies = { count = 3, axis = [0, 0, 1] }\n").joint("C2").cone
        assert cone.fixed_to == "rod2"
        assert cone.axis == pytest.approx(np.array([-0.5, math.sqrt(0.75), 3]) / math.sqrt(10), abs=1e-15)

    def test_first_copy_is_the_original_to_the_last_bit(self):
        text = edited(("[2, 0, 0]", "[0.1, 0.7, 0.3]"), ("[0, 0, 1] }\n", "[1, 2, 3] }\n"))
        assert loads(text).joint("A1").at == (0.1, 0.7, 0.3)

    def test_copies_are_turned_right_handed_about_the_axis(self):
        machine = loads(TRIPOD)
        assert machine.joint("A2").at == pytest.approx((-1, math.sqrt(3), 0), abs=1e-15)
        assert machine.joint("A2").axis == pytest.approx((-math.sqrt(0.75), -0.5, 0), abs=1e-15)

    def test_turns_are_exact_where_sines_are(self):
        assert [cos_sin(step, 4) for step in range(4)] == [(1, 0), (0, 1), (-1, 0), (0, -1)]
        assert [cos_sin(step, 3)[0] for step in range(3)] == [1.0, -0.5, -0.5]
        assert [cos_sin(step, 12)[1] for step in (1, 5, 7, 11)] == [0.5, 0.5, -0.5, -0.5]

    def test_different_numbers_of_copies_of_one_body_are_a_fault(self):
        faults = faults_of(edited(("count = 3", "count = 5")))
        assert "3, but 'cylinder' has 5 copies at joint 'A' -> 5" in faults["joint[1].copies.count"]

    def test_joint_without_copies_must_say_which_copy_it_means(self):
        loose = '[[joint]]\nname = "D"\ntype = "fixed"\nconnects = ["cylinder{}", "base"]\nat = [1, 1, 1]\n'
        assert "did you mean 'cylinder1'?" in faults_of(TRIPOD + loose.format(""))["joint[3].connects"]
        assert loads(TRIPOD + loose.format("1")).joint("D").connects == ("cylinder1", "base")

    def test_most_copies_and_joints_are_accepted_and_no_more(self):
        strut = TRIPOD.replace("count = 3", f"count = {MOST_COPIES}")
        assert len(loads(strut).joints) == 3 * MOST_COPIES
        assert (
            "from 1 to 100"
            in faults_of(TRIPOD.replace("count = 3", f"count = {MOST_COPIES + 1}"))["joint[0].copies.count"]
        )
        many = "".join(
            f'[[joint]]\nname = "{name}"\ntype = "spherical"\nconnects = ["base", "platform"]\nat = [1, 2, 3]\n'
            f"copies = {{ count = {MOST_COPIES}, axis = [0, 0, 1] }}\n"
            for name in "DEFGHIJ"
        )
        assert len(loads(strut + many).joints) == MOST_JOINTS
        assert f"at most {MOST_JOINTS}" in faults_of(strut + many + CRANK.replace('"A"', '"K"'))["joint"]

    def test_zero_axis_of_copies_is_a_fault(self):
        assert "not zero" in faults_of(edited(("[0, 0, 1] }\n\n", "[0, 0, 0] }\n\n")))["joint[0].copies.axis"]


HOSTILE = [
    ("", "schema", "nothing -> 1"),
    ("schema = 2", "schema", "2 -> 1"),
    ("schema = true", "schema", "True -> 1"),
    ("schema = ", "file", "no TOML: Invalid value (at end of document)"),
    ("a = 1\nb == 2", "file", "line 2, column 4"),
    ("a = 1\na = 2\n", "file", "line 2"),
    ("x = " + "[" * 100_000, "file", "nested too deeply"),
    (".".join("a" * (MOST_DOTS + 2)) + " = 1", "file", "nested too deeply"),
    ("x = " + "9" * 10_000, "file", "no TOML"),
    ("\x00\x01", "file", "no TOML"),
    ("#" * (LARGEST_FILE + 1), "file", f"at most {LARGEST_FILE}"),
    (HEAD + "joint = 5", "joint", "5 -> [[joint]] tables"),
    (HEAD + "[joint]\nname = 'A'", "joint", "-> [[joint]] tables"),
    (HEAD + "joint = [7]", "joint[0]", "7 -> a [[joint]] table"),
    (HEAD, "joint", "no joints"),
    (HEAD + "legs = 1", "legs", "did you mean 'leg'?"),
    (HEAD + "task = 'x'", "task", "'x' -> some of x, y, z"),
    (HEAD + "task = ['z', 'tlt']\n" + CRANK, "task", "did you mean 'tilt'?"),
    (HEAD + "[units]\nangle = 'grad'", "units.angle", "'grad' -> 'deg' or 'rad'"),
    (HEAD + "[units]\nlenght = 'mm'", "units.lenght", "did you mean 'length'?"),
    (HEAD + "'a b' = 1", "'a b'", "an unknown key"),
    ("[[joint]]\n" * (MOST_JOINTS + 1), "joint", f"{MOST_JOINTS + 1} joints -> at most {MOST_JOINTS}"),
    (HEAD + CRANK + "at = 5\n", "file", "(at line "),
    (HEAD + CRANK.replace("[0, 0, 0]", '"0"'), "joint[0].at", "'0' -> three numbers"),
    (HEAD + CRANK.replace("[0, 0, 0]", '["0", 0, 0]'), "joint[0].at", "['0', 0, 0] -> three numbers"),
    (HEAD + CRANK.replace("[0, 0, 0]", "[true, 0, 0]"), "joint[0].at", "[True, 0, 0] -> three numbers"),
    (HEAD + CRANK.replace("[0, 0, 0]", "[nan, 0, 0]"), "joint[0].at", "finite"),
    (HEAD + CRANK.replace("[0, 0, 0]", "[1e400, 0, 0]"), "joint[0].at", "finite"),
    (HEAD + CRANK.replace("[0, 0, 0]", f"[{'9' * 400}, 0, 0]"), "joint[0].at", "three numbers"),
    (HEAD + CRANK.replace("[0, 0, 0]", "{ x = 1 }"), "joint[0].at", "{'x': 1} -> three numbers"),
    (HEAD + CRANK.replace("= true", "= 1"), "joint[0].actuated", "1 -> true or false"),
    (HEAD + CRANK.replace("actuated", "acutated"), "joint[0].acutated", "did you mean 'actuated'?"),
    (HEAD + CRANK + "task = ['x']\n", "joint[0].task", "it is one of the file, above its first table"),
    (HEAD + "[[leg]]\nchain = 'U-P*-S'\ntask = ['x']\n", "leg[0].task", "it is one of the file"),
    (HEAD + "[units]\ntask = ['x']\n" + CRANK, "units.task", "it is one of the file"),
    (HEAD + CRANK.replace('"A"', "2020-01-01"), "joint[0].name", "a text"),
    (HEAD + CRANK.replace('"revolute"', "[]"), "joint[0].type", "[] -> one of revolute, prismatic"),
    (HEAD + CRANK + "home = { a = 1 }", "joint[0].home", "a number"),
    (HEAD + CRANK + "range = { a = 1 }", "joint[0].range", "two numbers"),
    (HEAD + CRANK + "range = [[1, 2], 3]", "joint[0].range", "two numbers"),
    (HEAD + CRANK + "range = [90, 45]", "joint[0].range", "(90 deg) to "),
    (HEAD + CRANK + "cone = 5", "joint[0].cone", "a table"),
    (HEAD + CRANK + "copies = {}", "joint[0].copies.count", "nothing -> a whole number"),
    (HEAD + CRANK + "copies = { count = 2.5, axis = [0, 0, 1] }", "joint[0].copies.count", "2.5 -> a whole number"),
    (HEAD + CRANK + "copies = { count = 0, axis = [0, 0, 1] }", "joint[0].copies.count", "0 -> a whole number"),
    (HEAD + CRANK.replace('["base", "platform"]', '["base"]'), "joint[0].connects", "['base'] -> the names of two"),
    (edited(("half_angle", "half_agle")), "joint[2].cone.half_agle", "did you mean 'half_angle'?"),
    (edited(("half_angle = 60", 'half_angle = "60"')), "joint[2].cone.half_angle", "'60' -> a number"),
    (edited(("half_angle = 60", "half_angle = 6")), "joint[2].cone.half_angle", "(6 deg) -> at least the angle"),
    (edited(("half_angle = 60", "half_angle = 181")), "joint[2].cone.half_angle", "at most half a turn"),
    (edited(('end_effector = "platform"', 'end_effector = "platfrom"')), "end_effector", "did you mean 'platform'?"),
    (HEAD.replace('"m"', '"m"\nbase = "bse"') + CRANK, "base", "did you mean 'base'?"),
    (edited(('["A", "C"]', '["A", "Cc"]')), "joint[1].along", "'Cc': no such joint"),
    (edited(('["rod", ', '["rood", ')), "joint[2].connects", "'rood', which no other joint connects; did you mean "),
]  # fmt: skip


class TestFaults:
    @pytest.mark.parametrize(("text", "place", "fault"), HOSTILE, ids=range(len(HOSTILE)))
    def test_hostile_text_is_refused_with_a_fault_at_its_place(self, text, place, fault):
        assert fault in faults_of(text)[place]

    def test_one_mistake_in_a_copied_joint_is_reported_once(self):
        assert list(faults_of(edited(("range = [2, 4]", "range = [3.5, 4]")))) == ["joint[1].range"]

    def test_copied_joint_is_named_in_the_words_of_the_file(self):
        assert "'rood', which no" in faults_of(edited(('["rod", ', '["rood", ')))["joint[2].connects"]

    def test_misspelt_end_effector_is_not_taken_for_a_copied_body(self):
        faults = faults_of(edited(('end_effector = "platform"', 'end_effector = "platfrom"')))
        assert list(faults) == ["end_effector"]
        other = '[[joint]]\nname = "D"\ntype = "spherical"\nconnects = ["cylinder1", "platfrom"]\nat = [1, 1, 1]\n'
        found = "'platfrom', which no other joint connects; did you mean 'platform'?"
        assert found in faults_of(TRIPOD + other)["joint[3].connects"]

    def test_faults_of_schema_and_of_meaning_come_in_one_go_and_in_order(self):
        text = edited(
            ('name = "m"', 'nmae = "m"'),
            ("at = [2, 0, 0]", 'at = [2, 0, "0"]'),
            ("range = [2, 4]", "range = [4, 2]"),
            ("range = [4, 2]", "range = [4, 2]\nrnage = 1"),
            ('name = "C"\ntype = "spherical"', 'name = "C"\ntype = "spherica"'),
        )
        faults = faults_of(text)
        assert list(faults) == [
            "nmae", "name", "joint[0].at", "joint[1].range", "joint[1].rnage", "joint[2].type",
        ]  # fmt: skip

    def test_missing_end_effector_leaves_only_faults_that_do_not_follow_from_it(self):
        faults = faults_of(edited(('end_effector = "platform"\n', ""), ("range = [2, 4]", "range = [4, 2]")))
        assert list(faults) == ["end_effector", "joint[1].range"]

    @given(st.data())
    @settings(max_examples=200, deadline=None)
    def test_no_edit_of_a_file_escapes_as_another_error(self, data):
        text = TRIPOD
        for _ in range(data.draw(st.integers(1, 3))):
            old = data.draw(st.sampled_from(re.findall(r'\[[^\[\]]*\]|"[^"]*"|(?<= )\d+|true|\w+ =', text)))
            new = data.draw(st.sampled_from(['"base"', '"rod"', "[0, 0]", "[]", "{}", "-1e300", "nan", "0", "x ="]))
            text = text.replace(old, new, data.draw(st.integers(1, 3)))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MobilityWarning)
            try:
                assert loads(dumps(loads(text))) == loads(text)
            except InvalidMechanism as error:
                assert error.faults

    def test_unknown_keys_beyond_number_are_counted(self):
        text = HEAD + CRANK + "".join(f"k{number} = 1\n" for number in range(1000))
        faults = faults_of(text)
        assert len(faults) == MOST_FAULTS + 1
        assert f"{1000 - MOST_FAULTS} more faults" in faults["joint[0]"]

    def test_wrong_calls_are_refused(self):
        with pytest.raises(InvalidArgument, match="source"):
            load(5)
        with pytest.raises(InvalidArgument, match="text"):
            loads(None)

    @pytest.mark.parametrize("name", ["stewrat", "no/such/file.toml", "", "a\0b", "x" * 5000, Path("stewart")])
    def test_neither_file_nor_catalogue_name_is_refused(self, name, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        expected = InvalidMechanism if name == "" else UnknownName
        with pytest.raises(expected, match="mechanism file"):
            load(name)

    @pytest.mark.parametrize(("content", "fault"), [
        (b"\xff\xfe", "no UTF-8 text at byte 0"),
        (b"name = '\xe9'", "no UTF-8 text at byte 8"),
        (b"\x7fELF\x00\x01", "no TOML"),
        (b"#" * 10_000_000, "more than 1000000 bytes"),
    ])  # fmt: skip
    def test_files_that_are_no_text_or_too_large_are_refused(self, tmp_path, content, fault):
        path = tmp_path / "m.toml"
        path.write_bytes(content)
        with pytest.raises(InvalidMechanism, match=fault) as caught:
            load(path)
        assert caught.value.source == str(path) and len(caught.value.faults) == 1

    def test_directories_devices_and_unreadable_files_are_refused(self, tmp_path, monkeypatch):
        with pytest.raises(InvalidMechanism, match="a directory or device"):
            load(tmp_path)
        with pytest.raises(InvalidMechanism, match="a directory or device"):
            load(os.devnull)
        path = tmp_path / "m.toml"
        path.write_text(TRIPOD)

        def refuse(*_: object) -> None:
            raise PermissionError(13, "Permission denied")

        monkeypatch.setattr(Path, "open", refuse)
        with pytest.raises(InvalidMechanism, match="cannot be read \\(Permission denied\\)"):
            load(path)


names = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=8).filter(str.strip)
numbers = st.floats(-1e6, 1e6)
angles = st.one_of(st.integers(-360, 360).map(math.radians), st.floats(-7, 7))
vectors = st.tuples(numbers, numbers, numbers)
directions = vectors.filter(lambda vector: max(map(abs, vector)) > 1e-3)


DRIVEN: list[dict[str, object]] = [
    {}, {"actuated": True}, {"actuated": (True, False)}, {"actuated": (False, True), "max_acceleration": 3.5},
    {"actuated": (True, False), "max_speed": 1.25}, {"actuated": True, "max_speed": (0.3, 70)},
]  # fmt: skip


@st.composite
def mechanisms(draw: st.DrawFn) -> Mechanism:
    """A chain of joints of every type, with limits that home keeps."""
    bodies = draw(st.lists(names, min_size=6, max_size=6, unique=True))
    labels = draw(st.lists(names.filter(lambda name: name not in bodies), min_size=6, max_size=6, unique=True))
    turn, shift, low, high = draw(angles), draw(numbers), draw(st.floats(0, 9)), draw(st.floats(0, 9))
    around, across = (turn - low, turn + high), (shift - low, shift + high)
    centres = draw(st.lists(vectors, min_size=5, max_size=5, unique=True))
    half_angle = draw(st.one_of(st.just(math.pi), st.floats(3, math.pi)))
    axis, links = draw(directions), list(pairwise(bodies))
    toward_next = tuple(np.copysign(axis, np.subtract(centres[4], centres[3])))
    joints = [
        Joint(labels[0], "revolute", links[0], centres[0], axis=axis, actuated=True, home=turn, range=around,
              max_speed=draw(st.one_of(st.none(), st.floats(0.1, 9)))),
        Joint(labels[1], "cylindrical", links[1], centres[1], axis=axis, home=(turn, shift), range=(around, across),
              **draw(st.sampled_from(DRIVEN))),
        Joint(labels[2], "universal", links[2], centres[2], axes=(np.eye(3)[np.abs(axis).argmin()], axis),
              home=(turn, turn), range=(around, around)),
        Joint(labels[3], "spherical", links[3], centres[3], cone=Cone(toward_next, half_angle, bodies[3])),
        Joint(labels[4], "fixed", links[4], centres[4]),
        Joint(labels[5], "prismatic", (bodies[0], bodies[5]), axis=axis, home=shift, range=across, actuated=True,
              max_acceleration=draw(st.one_of(st.none(), st.floats(0.1, 9)))),
    ]  # fmt: skip
    unit = draw(st.sampled_from(["deg", "rad"]))
    return Mechanism(draw(names), joints, bodies[3], draw(vectors), bodies[0], draw(names), unit)


class TestWriting:
    @given(st.data())
    @settings(max_examples=100, deadline=None)
    def test_what_is_saved_is_what_is_loaded(self, data):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MobilityWarning)
            machine = data.draw(mechanisms())
            again = loads(dumps(machine))
        assert again == machine and hash(again) == hash(machine)

    def test_end_effector_joint_survives_the_round_trip(self):
        machine = load("five_bar")
        assert "reference_point" not in dumps(machine)
        assert loads(dumps(machine)) == machine

    def test_angles_are_written_in_round_degrees_where_these_are_exact(self):
        text = dumps(loads(TRIPOD))
        assert 'angle = "deg"' in text and "half_angle = 60.0" in text

    def test_angle_without_exact_degrees_is_written_in_radians(self):
        angle = next(angle for angle in np.linspace(0.5, 1, 1000).tolist() if exact_degrees(angle) is None)
        machine = loads(HEAD + CRANK).with_limits(A=(-angle, angle))
        text = dumps(machine)
        assert 'angle = "rad"' in text and repr(angle) in text
        assert loads(text) == machine

    def test_save_replaces_the_file_as_a_whole_and_leaves_nothing_behind(self, tmp_path):
        path = tmp_path / "m.toml"
        path.write_text("old")
        path.chmod(0o640)
        save(loads(TRIPOD), path)
        assert load(path) == loads(TRIPOD)
        assert os.listdir(tmp_path) == ["m.toml"] and path.stat().st_mode & 0o777 == 0o640

    def test_failed_save_keeps_the_old_file(self, tmp_path, monkeypatch):
        path = tmp_path / "m.toml"
        path.write_text("old")

        def refuse(*_: object) -> None:
            raise OSError("disk full")

        monkeypatch.setattr(os, "replace", refuse)
        with pytest.raises(OSError, match="disk full"):
            save(loads(TRIPOD), path)
        assert path.read_text() == "old" and os.listdir(tmp_path) == ["m.toml"]


def test_two_writers_of_one_file_do_not_write_into_each_other(tmp_path: Path) -> None:
    """Threads of one process too: the file is what one of them wrote, whole."""
    path = tmp_path / "both.txt"
    with whole_path(path) as late:
        late.write_text("late")
        with whole_path(path) as early:
            early.write_text("early")
        assert path.read_text() == "early"
    assert path.read_text() == "late"
    assert list(tmp_path.iterdir()) == [path]
