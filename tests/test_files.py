"""Mechanism files: what they say is what is built, what is saved is what is loaded, and what is wrong is named."""

from __future__ import annotations

import math
import os
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pfabrik.common.whole_files import whole_path
from pfabrik.errors import InvalidArgument, InvalidMechanism, MobilityWarning, UnknownName
from pfabrik.machine.catalog import catalog, catalog_file
from pfabrik.machine.description.copies import MOST_COPIES, cos_sin
from pfabrik.machine.description.form_faults import MOST_FAULTS
from pfabrik.machine.description.mechanism import Cone, Joint, Mechanism
from pfabrik.machine.files import LARGEST_FILE, MOST_DOTS, dumps, load, loads, save
from pfabrik.machine.files.reading import MOST_JOINTS
from pfabrik.machine.files.units import exact_degrees

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


LOOSE = '[[joint]]\nname = "D"\ntype = "fixed"\nconnects = ["{}", "{}"]\nat = [1, 1, 1]\n'


def faults_of(text: str) -> dict[str, str]:
    """The faults of a text: place to what was found and expected."""
    with pytest.raises(InvalidMechanism) as caught:
        loads(text, "x.toml")
    assert caught.value.source == "x.toml" and str(caught.value).startswith("x.toml: ")
    return {fault.place: f"{fault.found} -> {fault.expected}" for fault in caught.value.faults}


def edited(text: str, *edits: tuple[str, str]) -> str:
    """The text with each edit made once."""
    for old, new in edits:
        assert old in text
        text = text.replace(old, new, 1)
    return text


def tripod(*edits: tuple[str, str]) -> str:
    return edited(TRIPOD, *edits)


@pytest.mark.parametrize("name", catalog())
def test_every_catalogue_machine_loads_and_survives_the_round_trip(name: str) -> None:
    machine = load(name)
    assert loads(catalog_file(name).read_bytes().decode()) == machine
    assert loads(dumps(machine)) == machine


def test_catalogue_names_are_sorted_and_refuse_others() -> None:
    assert list(catalog()) == sorted(catalog()) and "stewart" in catalog()
    with pytest.raises(UnknownName, match="did you mean 'stewart'"):
        catalog_file("stewrat")


CYLINDER = edited(CRANK, ("revolute", "cylindrical"), ("actuated = true\n", ""))
DRIVEN = edited(CRANK, ("revolute", "cylindrical"), ("= true", "= {}"))
RAD = 'units = { length = "in", angle = "rad" }\n'
RIGHT = math.pi / 2


@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (CRANK + "home = 30\nrange = [-90, 180]\n", {"home": math.radians(30), "range": (-RIGHT, math.pi)}),
        (RAD + CRANK + "home = 1\nrange = [-1, 3]\n", {"home": 1.0, "range": (-1.0, 3.0)}),
        (CRANK + "max_speed = 90\nmax_acceleration = 180\n", {"max_speed": RIGHT, "max_acceleration": math.pi}),
        (
            CYLINDER + "home = [90, 5]\nrange = [[0, 180], [4, 6]]\n" + CRANK.replace('"A"', '"B"'),
            {"home": (RIGHT, 5.0), "range": ((0.0, math.pi), (4.0, 6.0))},
        ),
        (DRIVEN.format("true") + "max_speed = [90, 5]\n", {"actuated": True, "max_speed": (RIGHT, 5.0)}),
        (DRIVEN.format("[true, true]") + "max_speed = [90, 5]\n", {"actuated": True, "max_speed": (RIGHT, 5.0)}),
        (DRIVEN.format("[true, false]") + "max_speed = 90\n", {"actuated": (True, False), "max_speed": RIGHT}),
        (DRIVEN.format("[false, true]") + "max_speed = 5\n", {"actuated": (False, True), "max_speed": 5.0}),
    ],
)
def test_angles_are_converted_lengths_are_not_and_both_are_written_back(text: str, expected: dict) -> None:
    """Of a cylindrical joint the first coordinate is an angle, the second a length: its limits and its speeds."""
    machine = loads(HEAD + text)
    assert {name: getattr(machine.joints[0], name) for name in expected} == expected
    assert loads(dumps(machine)) == machine


@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
def test_limits_and_speeds_of_copies_are_those_of_the_first() -> None:
    limits = "axes = [[0, 1, 0], [1, 0, 0]]\nrange = [[-90, 90], [-45, 45]]\n"
    machine = loads(
        tripod(("revolute", "universal"), ("axis = [0, 1, 0]\n", limits), ("[2, 4]", "[2, 4]\nmax_speed = 0.5"))
    )
    assert machine.joint("A1").range == ((-RIGHT, RIGHT), (-RIGHT / 2, RIGHT / 2))
    assert [machine.joint(f"B{leg}").max_speed for leg in (1, 2, 3)] == [0.5] * 3


def test_byte_order_mark_and_windows_line_ends_are_accepted(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_bytes(b"\xef\xbb\xbf" + TRIPOD.replace("\n", "\r\n").encode())
    assert load(path) == load(str(path)) == loads(TRIPOD)


def test_copies_are_numbered_and_the_base_and_end_effector_are_not() -> None:
    machine = loads(TRIPOD)
    assert [joint.name for joint in machine.joints] == [f"{name}{n}" for name in "ABC" for n in range(1, 4)]
    assert machine.joint("A2").connects == ("base", "cylinder2")
    assert machine.joint("B3").along == ("A3", "C3")
    assert machine.joint("C2").connects == ("rod2", "platform")
    assert machine.joint("C3").cone.fixed_to == "platform"


def test_copies_are_turned_right_handed_about_the_axis_exactly_where_sines_are() -> None:
    machine = loads(TRIPOD)
    assert machine.joint("A2").at == pytest.approx((-1, math.sqrt(3), 0), abs=1e-15)
    assert machine.joint("A2").axis == pytest.approx((-math.sqrt(0.75), -0.5, 0), abs=1e-15)
    text = tripod(("[2, 0, 0]", "[0.1, 0.7, 0.3]"), ("[0, 0, 1] }\n", "[1, 2, 3] }\n"))
    assert loads(text).joint("A1").at == (0.1, 0.7, 0.3)  # the first is the original to the last bit
    assert [cos_sin(step, 4) for step in range(4)] == [(1, 0), (0, 1), (-1, 0), (0, -1)]
    assert [cos_sin(step, 3)[0] for step in range(3)] == [1.0, -0.5, -0.5]
    assert [cos_sin(step, 12)[1] for step in (1, 5, 7, 11)] == [0.5, 0.5, -0.5, -0.5]


def test_the_cone_of_a_copy_turns_and_follows_its_copied_body() -> None:
    text = tripod(
        ('["rod", "platform"]', '["rod", "rider"]'),
        ("axis = [0, 0, -1]", "axis = [1, 0, 3]"),
        ('fixed_to = "platform"', 'fixed_to = "rod"'),
    )
    text += edited(CRANK, ("base", "rider"), ("[0, 0, 0]", "[1, 0, 6]"), ('"A"', '"D"'))
    cone = loads(text + "copies = { count = 3, axis = [0, 0, 1] }\n").joint("C2").cone
    assert cone.fixed_to == "rod2"
    assert cone.axis == pytest.approx(np.array([-0.5, math.sqrt(0.75), 3]) / math.sqrt(10), abs=1e-15)


def test_a_joint_without_copies_says_which_copy_it_means() -> None:
    assert loads(TRIPOD + LOOSE.format("cylinder1", "base")).joint("D").connects == ("cylinder1", "base")


def test_most_copies_and_joints_are_accepted_and_no_more() -> None:
    strut = TRIPOD.replace("count = 3", f"count = {MOST_COPIES}")
    assert len(loads(strut).joints) == 3 * MOST_COPIES
    many = "".join(
        LOOSE.replace('"D"', f'"{name}"').format("base", "platform").replace("fixed", "spherical")
        + f"copies = {{ count = {MOST_COPIES}, axis = [0, 0, 1] }}\n"
        for name in "DEFGHIJ"
    )
    assert len(loads(strut + many).joints) == MOST_JOINTS
    assert f"at most {MOST_JOINTS}" in faults_of(strut + many + CRANK.replace('"A"', '"K"'))["joint"]


HOSTILE = [
    ("", "schema", "nothing -> 1"),
    ("schema = 2", "schema", "2 -> 1"),
    ("schema = ", "file", "no TOML: Invalid value (at end of document)"),
    ("a = 1\nb == 2", "file", "line 2, column 4"),
    ("x = " + "[" * 100_000, "file", "nested too deeply"),
    (".".join("a" * (MOST_DOTS + 2)) + " = 1", "file", "nested too deeply"),
    ("x = " + "9" * 10_000, "file", "no TOML"),
    ("\x00\x01", "file", "no TOML"),
    ("#" * (LARGEST_FILE + 1), "file", f"at most {LARGEST_FILE}"),
    (HEAD + "joint = 5", "joint", "5 -> [[joint]] tables"),
    (HEAD + "[joint]\nname = 'A'", "joint", "-> [[joint]] tables"),
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
    (HEAD + CRANK.replace("[0, 0, 0]", "[nan, 0, 0]"), "joint[0].at", "finite"),
    (HEAD + CRANK.replace("actuated", "acutated"), "joint[0].acutated", "did you mean 'actuated'?"),
    (HEAD + CRANK + "task = ['x']\n", "joint[0].task", "it is one of the file, above its first table"),
    (HEAD + "[[leg]]\nchain = 'U-P*-S'\ntask = ['x']\n", "leg[0].task", "it is one of the file"),
    (HEAD + "[units]\ntask = ['x']\n" + CRANK, "units.task", "it is one of the file"),
    (HEAD + CRANK.replace('"A"', "2020-01-01"), "joint[0].name", "a text"),
    (HEAD + CRANK + "range = [90, 45]", "joint[0].range", "(90 deg) to "),
    (HEAD + CRANK + "cone = 5", "joint[0].cone", "a table"),
    (HEAD + CRANK + "copies = {}", "joint[0].copies.count", "nothing -> a whole number"),
    (HEAD + CRANK + "copies = { count = 2.5, axis = [0, 0, 1] }", "joint[0].copies.count", "2.5 -> a whole number"),
    (HEAD + CRANK + "copies = { count = 0, axis = [0, 0, 1] }", "joint[0].copies.count", "0 -> a whole number"),
    (tripod(("half_angle", "half_agle")), "joint[2].cone.half_agle", "did you mean 'half_angle'?"),
    (tripod(("half_angle = 60", "half_angle = 6")), "joint[2].cone.half_angle", "(6 deg) -> at least the angle"),
    (tripod(('end_effector = "platform"', 'end_effector = "platfrom"')), "end_effector", "did you mean 'platform'?"),
    (HEAD.replace('"m"', '"m"\nbase = "bse"') + CRANK, "base", "did you mean 'base'?"),
    (tripod(('"m"', '"m"\nbase = "bse"')), "base", "did you mean 'base'?"),
    (tripod(('["rod", ', '["rood", ')), "joint[2].connects", "'rood', which no other joint connects; did you mean "),
    (tripod(("count = 3", "count = 5")), "joint[1].copies.count", "3, but 'cylinder' has 5 copies at joint 'A' -> 5"),
    (tripod(("count = 3", f"count = {MOST_COPIES + 1}")), "joint[0].copies.count", "from 1 to 100"),
    (tripod(("[0, 0, 1] }\n\n", "[0, 0, 0] }\n\n")), "joint[0].copies.axis", "not zero"),
    (TRIPOD + LOOSE.format("cylinder", "base"), "joint[3].connects", "did you mean 'cylinder1'?"),
    (TRIPOD + LOOSE.format("cylinder1", "platfrom"), "joint[3].connects",
     "'platfrom', which no other joint connects; did you mean 'platform'?"),
]  # fmt: skip
"""A text, the place of its fault, and what is said there of what was found and expected."""

ALONE = [
    (tripod(("range = [2, 4]", "range = [3.5, 4]")), ["joint[1].range"]),  # of three copies
    (tripod(('end_effector = "platform"', 'end_effector = "platfrom"')), ["end_effector"]),
    (tripod(('end_effector = "platform"\n', ""), ("[2, 4]", "[4, 2]")), ["end_effector", "joint[1].range"]),
    (tripod(('name = "m"', 'nmae = "m"'), ("at = [2, 0, 0]", 'at = [2, 0, "0"]'), ("[2, 4]", "[4, 2]\nrnage = 1"),
            ('"C"\ntype = "spherical"', '"C"\ntype = "spherica"')),
     ["nmae", "name", "joint[0].at", "joint[1].range", "joint[1].rnage", "joint[2].type"]),
]  # fmt: skip
"""A text, and the places of all its faults: those of the schema and of the meaning, once each, in order."""


@pytest.mark.parametrize(("text", "place", "fault"), HOSTILE, ids=range(len(HOSTILE)))
def test_hostile_text_is_refused_with_a_fault_at_its_place(text: str, place: str, fault: str) -> None:
    assert fault in faults_of(text)[place]


@pytest.mark.parametrize(("text", "places"), ALONE)
def test_faults_come_in_one_go_in_order_without_what_follows_from_them(text: str, places: list[str]) -> None:
    assert list(faults_of(text)) == places


def test_unknown_keys_beyond_number_are_counted() -> None:
    faults = faults_of(HEAD + CRANK + "".join(f"k{number} = 1\n" for number in range(1000)))
    assert len(faults) == MOST_FAULTS + 1
    assert f"{1000 - MOST_FAULTS} more faults" in faults["joint[0]"]


@pytest.mark.parametrize("name", ["stewrat", "no/such/file.toml", "", "a\0b", "x" * 5000, Path("stewart"), 5])
def test_neither_file_nor_catalogue_name_is_refused(
    name: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    error = {"": InvalidMechanism, 5: InvalidArgument}.get(name, UnknownName)
    with pytest.raises(error, match="source" if name == 5 else "mechanism file"):
        load(name)
    with pytest.raises(InvalidArgument, match="text"):
        loads(None)


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        (b"\xff\xfe", "no UTF-8 text at byte 0"),
        (b"name = '\xe9'", "no UTF-8 text at byte 8"),
        (b"\x7fELF\x00\x01", "no TOML"),
        (b"#" * 10_000_000, "more than 1000000 bytes"),
        (None, "a directory or device"),
    ],
)
def test_files_that_are_no_text_or_too_large_are_refused(tmp_path: Path, content: bytes | None, fault: str) -> None:
    path = tmp_path / "m.toml"
    path.mkdir() if content is None else path.write_bytes(content)
    with pytest.raises(InvalidMechanism, match=fault) as caught:
        load(path)
    assert caught.value.source == str(path) and len(caught.value.faults) == 1
    with pytest.raises(InvalidMechanism, match="a directory or device"):
        load(os.devnull)


def test_a_file_that_cannot_be_read_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    path = tmp_path / "m.toml"
    path.write_text(TRIPOD)
    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(InvalidMechanism, match="cannot be read \\(Permission denied\\)"):
        load(path)


NAMES = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=8).filter(str.strip)
NUMBERS = st.floats(-1e6, 1e6)
VECTORS = st.tuples(NUMBERS, NUMBERS, NUMBERS)
DIRECTIONS = VECTORS.filter(lambda vector: max(map(abs, vector)) > 1e-3)


@st.composite
def mechanisms(draw: st.DrawFn) -> Mechanism:
    """A chain of joints of every type with any names, angles and numbers, and limits that home keeps."""
    bodies = draw(st.lists(NAMES, min_size=6, max_size=6, unique=True))
    labels = draw(st.lists(NAMES.filter(lambda name: name not in bodies), min_size=6, max_size=6, unique=True))
    turn, shift, low, high = draw(st.floats(-7, 7)), draw(NUMBERS), draw(st.floats(0, 9)), draw(st.floats(0, 9))
    around, across = (turn - low, turn + high), (shift - low, shift + high)
    centres, axis = draw(st.lists(VECTORS, min_size=5, max_size=5, unique=True)), draw(DIRECTIONS)
    cone = Cone(np.subtract(centres[4], centres[3]), draw(st.floats(3, math.pi)), bodies[3])
    joints = [
        Joint(labels[0], "revolute", bodies[0:2], centres[0], axis=axis, actuated=True, home=turn, range=around),
        Joint(labels[1], "cylindrical", bodies[1:3], centres[1], axis=axis, home=(turn, shift), range=(around, across)),
        Joint(labels[2], "universal", bodies[2:4], centres[2], axes=(np.eye(3)[np.abs(axis).argmin()], axis),
              home=(turn, turn), range=(around, around)),
        Joint(labels[3], "spherical", bodies[3:5], centres[3], cone=cone),
        Joint(labels[4], "fixed", bodies[4:6], centres[4]),
        Joint(labels[5], "prismatic", bodies[0::5], axis=axis, home=shift, range=across, actuated=True,
              max_acceleration=draw(st.one_of(st.none(), st.floats(0.1, 9)))),
    ]  # fmt: skip
    return Mechanism(
        draw(NAMES), joints, bodies[3], draw(VECTORS), bodies[0], draw(NAMES), draw(st.sampled_from(["deg", "rad"]))
    )


@given(st.data())
@settings(max_examples=30, deadline=None)
def test_what_is_saved_is_what_is_loaded(data: st.DataObject) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MobilityWarning)
        machine = data.draw(mechanisms())
        again = loads(dumps(machine))
    assert again == machine and hash(again) == hash(machine)


def test_numbers_are_written_as_a_person_would_where_these_are_exact() -> None:
    text = dumps(loads(TRIPOD))
    assert 'angle = "deg"' in text and "half_angle = 60.0" in text
    assert "max_speed = 90.0" in dumps(loads(HEAD + CRANK + "max_speed = 90\n"))
    assert "reference_point" not in dumps(load("five_bar"))  # its end effector is a joint
    angle = next(angle for angle in np.linspace(0.5, 1, 1000).tolist() if exact_degrees(angle) is None)
    machine = loads(HEAD + CRANK).with_limits(A=(-angle, angle))
    assert 'angle = "rad"' in dumps(machine) and repr(angle) in dumps(machine)
    assert loads(dumps(machine)) == machine


def test_save_replaces_the_file_as_a_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "m.toml"
    path.write_text("old")
    path.chmod(0o640)
    save(loads(TRIPOD), path)
    assert load(path) == loads(TRIPOD)
    assert os.listdir(tmp_path) == ["m.toml"] and path.stat().st_mode & 0o777 == 0o640

    def refuse(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(os, "replace", refuse)
    with pytest.raises(OSError, match="disk full"):
        save(loads(HEAD + CRANK), path)
    assert load(path) == loads(TRIPOD) and os.listdir(tmp_path) == ["m.toml"]


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
