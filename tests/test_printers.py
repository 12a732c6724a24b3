"""Settings of delta printers: machines that are where the firmware has them, there and back.

The formulas are those of the firmwares, written anew: klippy/kinematics/delta.py and chelper/kin_rotary_delta.c of
Klipper, LinearDeltaKinematics.cpp and RotaryDeltaKinematics.cpp of RepRapFirmware, delta.cpp of Marlin.
"""

from __future__ import annotations

import json
import math
import re
import shutil
import subprocess
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from click.testing import CliRunner, Result
from scipy.spatial.transform import Rotation

import pfabrik as pf
from machines.redescribed import moved
from pfabrik.cli import main
from pfabrik.cli.export import text_of
from pfabrik.errors import InvalidMechanism, UnsupportedMechanism
from pfabrik.machine.files import print_region_of
from pfabrik.machine.files.printers.conditions import definitions

FILES = Path(__file__).parent / "data" / "printers"

EXACT = 1e-9
"""Largest difference from the firmware's own formula [mm or deg]: a few roundings of lengths of some 300 mm."""


class Towers(NamedTuple):
    """A linear delta as a firmware's file says it: sqrt(arm² - (x - tower)²) + z."""

    radii: tuple[float, float, float]
    angles: tuple[float, float, float]
    arms: tuple[float, float, float]
    tops: tuple[float, float, float]
    """Height of the nozzle in the middle with the carriage at its endstop, from what the firmware does in homing."""

    def __call__(self, x: float, y: float, z: float) -> list[float]:
        turns = np.radians(self.angles)
        across = np.hypot(np.array(self.radii) * np.cos(turns) - x, np.array(self.radii) * np.sin(turns) - y)
        return [float(h) for h in np.sqrt(np.array(self.arms) ** 2 - across**2) + z]

    @property
    def endstops(self) -> list[float]:
        return [self(0.0, 0.0, top)[k] for k, top in enumerate(self.tops)]


class Arms(NamedTuple):
    """A rotary delta: the angle at which an elbow outside is a rod's length from the nozzle [deg]."""

    radius: float
    heights: tuple[float, float, float]
    angles: tuple[float, float, float]
    upper: tuple[float, float, float]
    lower: tuple[float, float, float]
    tops: tuple[float, float, float] | None = None
    highest: tuple[float, float, float] | None = None

    def __call__(self, x: float, y: float, z: float) -> list[float]:
        return [self.arm(k, x, y, z) for k in range(3)]

    def arm(self, k: int, x: float, y: float, z: float) -> float:
        turn = math.radians(self.angles[k])
        aside = y * math.cos(turn) - x * math.sin(turn)
        out = x * math.cos(turn) + y * math.sin(turn) - self.radius
        up = z - self.heights[k]
        # elbow_y = c1 - c2 elbow_x, in the circle of the upper arm; the root farther out
        c1 = (out * out + up * up + self.upper[k] ** 2 - self.lower[k] ** 2 + aside * aside) / (2.0 * up)
        c2 = out / up
        scale = c2 * c2 + 1.0
        along = c1 * c2 + math.sqrt(scale * self.upper[k] ** 2 - c1 * c1)
        return math.degrees(math.atan2(c1 * scale - c2 * along, along))

    @property
    def endstops(self) -> list[float]:
        if self.highest is not None:
            return list(self.highest)
        return [self.arm(k, 0.0, 0.0, top) for k, top in enumerate(self.tops or ())]


PRINTERS: dict[str, Towers | Arms] = {
    "per_tower.cfg": Towers((128.375,) * 3, (209.125, 330.5, 90.25), (271.5, 271.75, 270.875), (286.25, 286.25, 285.5)),
    "saved.cfg": Towers(  # arm_length of stepper_a is said above the block, which holds elsewhere
        (104.718281,) * 3,
        (210.057721, 329.842654, 90.0),
        (241.0, 240.693147, 240.577215),
        (251.331415, 251.173205, 251.414213),
    ),
    "rotary.cfg": Arms(
        41.25,
        (362.5,) * 3,
        (30.0, 151.25, 270.0),
        (140.5, 141.125, 140.5),
        (301.25, 301.25, 300.5),
        tops=(187.5, 187.5, 186.75),
    ),
    # endstop = homed height + adjustment; towers at -150, -30 and 90 deg
    "config.g": Towers(
        (121.062,) * 3, (-149.688, -30.125, 90.0), (250.125, 250.375, 249.875), (259.0, 259.999, 259.312)
    ),
    "rotary.g": Arms(
        48.5,
        (270.0, 270.125, 270.25),
        (-149.25, -30.5, 90.0),
        (110.0, 110.25, 109.75),
        (230.0,) * 3,
        highest=(40.25, 39.5, 40.0),
    ),
    # homed height = DELTA_HEIGHT - probe offset; a carriage retraces its adjustment from the stop
    "Configuration.h": Towers(
        (132.25, 131.75, 131.5), (210.375, 329.75, 90.0), (268.75, 268.125, 268.625), (303.0, 302.75, 303.875)
    ),
    "m503.gcode": Towers((131.75,) * 3, (210.38, 329.75, 90.0), (268.75, 268.12, 268.63), (301.5, 301.25, 302.38)),
}
"""File -> the firmware's formula with the file's numbers."""


@pytest.mark.parametrize("name", PRINTERS)
def test_actuators_are_where_the_firmware_has_them(name: str) -> None:
    firmware, machine, random = PRINTERS[name], pf.load(FILES / name), np.random.default_rng(3)
    unit = np.degrees if isinstance(firmware, Arms) else np.asarray
    turns, out = random.uniform(0.0, 2.0 * math.pi, 100), 40.0 * np.sqrt(random.uniform(0.0, 1.0, 100))
    around = np.stack([out * np.cos(turns), out * np.sin(turns), random.uniform(70.0, 120.0, 100)], axis=1)
    # a firmware knows one place of each carriage or arm: far above the endstops nothing is within reach
    column = np.array([(0.0, 0.0, height) for height in np.linspace(-1000.0, 2000.0, 61)])
    answers = pf.solve_ik(machine, np.concatenate([around, column]))
    reached = answers.status == pf.Status.REACHED
    assert reached[:100].all()
    expected = [firmware(*place) for place in np.concatenate([around, column])[reached]]
    np.testing.assert_allclose(unit(answers.actuators[reached]), expected, rtol=0, atol=EXACT)
    ends = [machine.joint(actuator).range[1] for actuator in machine.actuator_names]
    np.testing.assert_allclose(unit(ends), firmware.endstops, rtol=0, atol=EXACT)


def numbers(text: str) -> dict[str, list[float]]:
    """The settings of a text by section or code and key."""
    said, place = {}, ""
    for line in text.splitlines():
        line = line.partition("#")[0].partition(";")[0].strip()
        place = line if line.startswith("[") else place
        for key, value in re.findall(r"^(\w+)\s*[:=]\s*([-+.\d]+)$", line):
            said[f"{place} {key}"] = [float(value)]
        for code in re.findall(r"^M\d+(?: K\d+)?", line):
            for letter, value in re.findall(r"([A-Z])([-+.\d:]+)", line.removeprefix(code)):
                said[f"{code} {letter}"] = [float(part) for part in value.split(":")]
    return said


@pytest.mark.parametrize(
    ("name", "form", "unsaid"),
    [
        ("per_tower.cfg", "klipper", "microsteps rotation_distance max_velocity max_accel minimum_z_position radius"),
        ("rotary.cfg", "klipper", "microsteps"),
        ("config-override.g", "reprap", "A B"),
        ("rotary.g", "reprap", "S"),
    ],
)
def test_a_file_comes_back_with_its_numbers(name: str, form: str, unsaid: str) -> None:
    file = FILES / name
    written = numbers(text_of(pf.load(file), form, ""))
    said = {key: value for key, value in numbers(file.read_text()).items() if key.split()[-1] not in unsaid.split()}
    assert said and {key: written[key] for key in said} == said


def delta_above_its_bed(name: str, up: float) -> pf.Mechanism:
    """A delta of the catalogue, raised above its bed and turned; its arms stop before they are in line with rods."""
    limits = {f"A{leg}": (-0.5, 1.4) for leg in (1, 2, 3)} if name == "delta" else {}
    turn = Rotation.from_euler("z", 17.0, degrees=True).as_matrix()
    return moved(pf.load(name).with_limits(limits), turn, np.array([0.0, 0.0, up]))


WRITTEN = {
    **{name: pf.load(FILES / name) for name in PRINTERS},
    "linear_delta": delta_above_its_bed("linear_delta", 0.0),
    "delta": delta_above_its_bed("delta", 200.0),
}


@pytest.mark.parametrize("degrees", range(10, 60, 10))
def test_an_endstop_is_written_where_klipper_takes_the_arm_that_is_there(degrees: int) -> None:
    """Of the two arms that have the nozzle at a height, Klipper takes the one farther out."""
    up = math.radians(degrees)
    machine = delta_above_its_bed("delta", 200.0).with_limits({f"A{leg}": (-up, 1.4) for leg in (1, 2, 3)})
    says = numbers(text_of(machine, "klipper", ""))
    sections = ("[stepper_a]", "[printer]")
    one = {key.split()[-1]: value[0] for key, value in says.items() if key.startswith(sections)}
    radius, height = one["shoulder_radius"], one["shoulder_height"]
    arms = Arms(
        radius, (height,) * 3, (one["angle"],) * 3, (one["upper_arm_length"],) * 3, (one["lower_arm_length"],) * 3
    )
    out = radius + arms.upper[0] * math.cos(up)
    top = height + arms.upper[0] * math.sin(up) - math.sqrt(arms.lower[0] ** 2 - out**2)
    is_there = abs(arms.arm(0, 0.0, 0.0, top) - degrees) < 1e-5
    assert one.get("position_endstop") == (pytest.approx(top, abs=1e-5) if is_there else None)


@pytest.mark.parametrize("form", ["klipper", "reprap", "marlin"])
@pytest.mark.parametrize("name", WRITTEN)
def test_what_is_written_is_the_same_machine(name: str, form: str, tmp_path: Path) -> None:
    """Of any firmware, for any other that has such a machine; arms of printers count upward."""
    machine = WRITTEN[name]
    dimensions, is_rotary = machine.dimensions, machine.drives[0].kind == "angle"
    has_heights = len({value for key, value in dimensions.items() if re.match("shoulder_height", key)}) > 1
    if "radius_trim_a" in dimensions or (is_rotary and form == "marlin") or (has_heights and form == "klipper"):
        with pytest.raises(UnsupportedMechanism, match=r"firmware has one|Marlin's delta has three upright rails"):
            text_of(machine, form, "")
        return
    (tmp_path / "written").write_text(text_of(machine, form, ""))
    again, sign = pf.load(tmp_path / "written"), -1.0 if name == "delta" else 1.0
    low = machine.home_pose[:3, 3] + [12.0, -7.0, 20.0]
    found, expected = (pf.solve_ik(each.without_limits(), low).actuators for each in (again, machine))
    heights = found[0] - sign * expected[0] if name == "linear_delta" else 0.0  # carriages count from anywhere
    atol = EXACT if name in PRINTERS else 1e-6  # written with nine digits
    np.testing.assert_allclose(found - heights, sign * expected, rtol=0, atol=atol)
    tops = [
        [max(s * np.array(each.joint(joint).range)) for joint in each.actuator_names]
        for each, s in ((again, 1.0), (machine, sign))
    ]
    np.testing.assert_allclose(np.array(tops[0]) - heights, tops[1], rtol=0, atol=max(atol, 2e-9))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[printer]\nkinematics: corexy\n", "found 'corexy', a printer without closed loops"),
        ("[stepper_x]\nmicrosteps: 16\n", r"\[printer\] kinematics: found nothing"),
        ("[printer]\nkinematics: delta\n", r"\[printer\] delta_radius: found nothing; expected a number above 0"),
        ("[printer]\nkinematics: delta\ndelta_radius: 100\n[stepper_a]\narm_length: 90\n", "a number above 100"),
        (
            "[printer]\nkinematics: rotary_delta\nshoulder_radius: 30\nshoulder_height: 300\n[stepper_a]\n"
            "upper_arm_length: 100\nlower_arm_length: 200\nposition_endstop: 250\n",
            "position_endstop of arm a: found 250, 58.3095 from the shoulder",
        ),
        ("[include other.cfg]\n[printer]\nkinematics: delta\n", r"\[include other.cfg\]: found no such file"),
        ("[include printer.cfg]\n[printer]\nkinematics: delta\n", r"\[include\]: found more than 100 files"),
        ("[include /dev/zero]\n[printer]\nkinematics: delta\n", "/dev/zero]: found a directory or device"),
        (
            "[printer]\nkinematics: delta\ndelta_radius: 100\n[stepper_a]\narm_length: 200\nposition_endstop: -9\n",
            "tower a",
        ),
        ("M669 K1\nM92 X80\n", "found K1, a printer without closed loops"),
        ("M665 L200:201 R100 H200\n", "found 2 numbers; expected one number, or one for each of three towers"),
        ("M665 L-200 R100 H200\n", "tower a: found rods of -200 at a radius of 100; expected .* longer rods"),
        ("M669 K10 U100 L50\n", "found 0, 254.951 from the shoulder of arms 100 and 50"),
        ("M669 K10 A45:-45\n", "M669 A: found 45.0:-45.0"),
        ('M550 P"x"\n', "M669: found no M665 with L, and no M669 with K"),
        ("M665 L{var.l} R100\n", r"line 1: found M665 L\{var.l\} R100; expected numbers"),
        ("M665 L200 R100 H200\nM666 A0.5\n", "found A0.5, which shears z"),
        ("M665 L200 R100 S100\n", "found no H; expected L, R and H"),
        ("// x\n#define X_BED_SIZE 200\n", "#define DELTA: found nothing: a printer without closed loops"),
        (
            "//\n#define DELTA\n#define DELTA_HEIGHT A\n#define A DELTA_HEIGHT\n",
            "#define DELTA_DIAGONAL_ROD: found nothing",
        ),
        (
            "//\n#define DELTA\n#define DELTA_DIAGONAL_ROD A\n#define A DELTA_DIAGONAL_ROD\n",
            "which needs itself",
        ),
        ("//\n#define DELTA\n#define DELTA_DIAGONAL_ROD 2\n#define DELTA_DIAGONAL_ROD 3\n", "the one that holds"),
    ],
)
def test_other_printers_are_refused_in_one_sentence(text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "printer.cfg").write_text(text)
    with pytest.raises(InvalidMechanism, match=said) as refused:
        pf.load(tmp_path / "printer.cfg")
    assert len(refused.value.faults) == 1 and str(refused.value).startswith(str(tmp_path / "printer.cfg"))


def test_every_command_takes_a_printer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def run(*line: str) -> Result:
        result = CliRunner().invoke(main, list(line))
        assert result.exit_code == 0, result.output
        return result

    monkeypatch.chdir(tmp_path)
    printer, other = str(FILES / "per_tower.cfg"), str(FILES / "rotary.g")
    for words in (("check",), ("info",), ("ik", "--position", "0", "0", "10"), ("export", "reprap")):
        run(words[0], printer, *words[1:])
    run("workspace", printer, "--fix", "z=0")
    run("new", "--from", other, "-o", "my.toml")
    assert pf.load(tmp_path / "my.toml") == pf.load(other)


def test_a_slip_of_a_key_is_named_and_no_key_of_klipper_is_one(tmp_path: Path) -> None:
    printer, text = tmp_path / "printer.cfg", (FILES / "per_tower.cfg").read_text()
    own = (
        "step_pin, dir_pin, rotation_distance, microsteps, full_steps_per_rotation, gear_ratio, endstop_pin, "
        "step_pulse_duration, position_min, position_max, homing_speed, homing_retract_dist, homing_retract_speed, "
        "second_homing_speed, homing_positive_dir"
    )
    head = "minimum_cruise_ratio, square_corner_velocity, max_velocity, max_accel, max_z_velocity, max_z_accel"
    all_keys = text.replace("[printer]", "\n".join(["[printer]", *(f"{key}: 1" for key in head.split(", "))]))
    all_keys += "\n".join(["", "[stepper_a]", *(f"{key}: 1" for key in own.split(", "))])
    printer.write_text(all_keys)
    region = print_region_of(str(printer))
    assert region is not None and region.slips == () and (region.lowest, region.floor) == (-3.0, "minimum_z_position")
    printer.write_text(f"{text}\n[stepper_b]\narm_lenght: 331\n")
    checked = CliRunner().invoke(main, ["check", str(printer)])
    assert "[stepper_b] arm_lenght is not read; did you mean 'arm_length'?" in checked.stderr and not checked.exit_code
    printer.write_text("[printer]\nkinematics: delta\ndelta_radius: 100\n[stepper_a]\ndiagonal_rod: 330\n")
    with pytest.raises(InvalidMechanism, match=r"\[stepper_a\] arm_length: found nothing, but 'diagonal_rod'"):
        pf.load(printer)


def test_a_printers_workspace_begins_at_its_bed_and_says_what_it_leaves_out(tmp_path: Path) -> None:
    """The nozzle can go lower than the firmware lets it: the reach of a linear delta does not change with height."""
    printer = tmp_path / "printer.cfg"
    printer.write_text(
        "[printer]\nkinematics: delta\ndelta_radius: 148\nprint_radius: 140\nminimum_z_position: -5\n"
        "[stepper_a]\narm_length: 330\nposition_endstop: 320\n"
    )

    def lowest(*options: str) -> tuple[float, str]:
        asked = ["workspace", str(printer), "--fix", "y=0", "--resolution", "10", "--json", *options]
        result = CliRunner().invoke(main, asked)
        return json.loads(result.stdout)["bounds"]["z"][0], result.stderr

    end, notes = lowest()
    assert end == pytest.approx(-5.0, abs=1e-2)
    assert "print_radius 140" in notes and "z from -5 on, minimum_z_position" in notes
    end, notes = lowest("--within", "z=-100:0")
    assert end < -90.0 and "upper bound" in notes and "z from" not in notes


def held_definitions(text: str) -> dict[str, str]:
    """Names and values that hold at the end of a text of C, by the C preprocessor itself."""
    command = ["cpp", "-dM", "-undef", "-P", "-"]
    lines = subprocess.run(command, input=text, capture_output=True, text=True, check=True).stdout.splitlines()
    words = [line.split(maxsplit=2)[1:] for line in lines]
    return {word[0]: " ".join(word[1:]) for word in words if not word[0].startswith("_")}


def conditions_at_random(rng: np.random.Generator, depth: int = 0) -> list[str]:
    """Lines that define names as nested conditions on others say; all names are defined somewhere."""
    names, lines = "ABCDEF", []

    def asked() -> str:
        one, other = rng.choice([*names], 2)
        of_names = (
            f"defined({one}), !defined {one}, defined({one}) && !defined({other}), defined {one} || (defined({other}))"
        )
        return str(rng.choice([*of_names.split(", "), "1 > 2", "V == 2", "V != 2 && V < 5", "0"]))

    for _ in range(4):
        name, number = rng.choice([*names]), int(rng.integers(1, 9))
        choice = rng.integers(4 if depth < 3 else 2)
        if choice == 0:
            lines += [f"#undef {name}", f"  # define {name} {number} // as before"]
        elif choice == 1:
            lines += [f"#undef {name}"]
        else:
            begin = [f"#if {asked()}", f"#ifdef {name}", f"#ifndef {name}"][rng.integers(3)]
            middle = [f"#elif {asked()}", *conditions_at_random(rng, depth + 1)] if rng.integers(2) else []
            end = ["#else /* or */", *conditions_at_random(rng, depth + 1)] if rng.integers(2) else []
            lines += [begin, *conditions_at_random(rng, depth + 1), *middle, *end, "#endif"]
    return lines


@pytest.mark.skipif(shutil.which("cpp") is None, reason="needs the C preprocessor")
def test_conditions_are_followed_as_the_c_preprocessor_follows_them() -> None:
    rng = np.random.default_rng(4)
    for _ in range(40):
        text = "\n".join(["#define V 3", *conditions_at_random(rng), *(f"//#define {name}" for name in "ABCDEF")])
        assert definitions(text) == (held_definitions(text), set()), text


SIZES = """
#define DELTA
//#define SMALL
#define MODEL 2
#if {0}
  #define DELTA_DIAGONAL_ROD 269.0
  #define DELTA_RADIUS 136.4
#else
  #define DELTA_DIAGONAL_ROD 218.0
  #define DELTA_RADIUS 97.0
#endif
#define DELTA_HEIGHT 300.0
"""


@pytest.mark.parametrize(
    ("asked", "rod"),
    [
        ("ENABLED(DELTA)", 269.0),
        ("DISABLED(DELTA)", 218.0),
        ("ENABLED(SMALL)", 218.0),
        ("BOTH(DELTA, SMALL) || MODEL == 2", 269.0),
        ("EITHER(SMALL, DELTA) && !NONE(DELTA)", 269.0),
        ("MODEL > 1 && MODEL <= 1", 218.0),
        ("ENABLED(OF_ANOTHER_FILE) && ENABLED(SMALL)", 218.0),
    ],
)
def test_a_delta_of_two_sizes_in_one_file_of_marlin_is_the_one_that_is_enabled(
    asked: str, rod: float, tmp_path: Path
) -> None:
    (tmp_path / "Configuration.h").write_text(SIZES.format(asked))
    machine = pf.load(tmp_path / "Configuration.h")
    arm = np.subtract(machine.joint("lower_al").at, machine.joint("upper_al").at)
    assert np.linalg.norm(arm) == pytest.approx(rod, abs=EXACT)
    radius = {269.0: 136.4, 218.0: 97.0}[rod]
    assert np.hypot(*arm[:2]) == pytest.approx(radius, abs=EXACT)


def test_a_size_that_another_file_decides_is_refused(tmp_path: Path) -> None:
    (tmp_path / "Configuration.h").write_text(SIZES.format("ENABLED(OF_ANOTHER_FILE)"))
    with pytest.raises(InvalidMechanism, match="two values, and names of another file say which"):
        pf.load(tmp_path / "Configuration.h")


DELTESIAN = """[printer]
kinematics: deltesian
[stepper_left]
position_endstop: 311
arm_length: 217
arm_x_length: 160
[stepper_right]
{right}
[stepper_y]
position_min: {lowest}
position_max: 210
"""


@pytest.mark.parametrize(
    ("right", "x_right", "arm_right", "lowest"),
    [("", 160.0, 217.0, 0.0), ("arm_length: 218.5\narm_x_length: 161.5", 161.5, 218.5, 12.0)],
)
def test_a_deltesian_is_where_klipper_has_it(
    right: str, x_right: float, arm_right: float, lowest: float, tmp_path: Path
) -> None:
    """A carriage of Klipper's deltesian is at sqrt(arm² - (x - its x)²) + z; its third stepper counts y."""
    file = tmp_path / "printer.cfg"
    file.write_text(DELTESIAN.format(right=right, lowest=lowest))
    machine = pf.load(file)
    assert machine.actuator_names == ("carriage_left", "carriage_right", "carriage_y")
    tops = [machine.joint(name).range[1] for name in ("carriage_left", "carriage_right")]
    assert tops == pytest.approx([311 + np.sqrt(217**2 - 160**2), 311 + np.sqrt(arm_right**2 - x_right**2)])
    for x, y, z in ((0, 12, 0), (50, 40, 100), (-50, 209, 10), (20, 90, 250)):
        answer = pf.solve_ik(machine, [x, y, z])
        left, right_ = np.sqrt(217**2 - (x + 160) ** 2) + z, np.sqrt(arm_right**2 - (x - x_right) ** 2) + z
        assert answer and answer.actuators == pytest.approx([left, right_, y], abs=EXACT * 100)
        assert pf.solve_fk(machine, answer.actuators).pose[:3, 3] == pytest.approx([x, y, z], abs=1e-6)
    file.write_text(DELTESIAN.format(right="", lowest=300))
    with pytest.raises(InvalidMechanism, match="position_max: found 210"):
        pf.load(file)
