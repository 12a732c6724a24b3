"""Calibration of printers of every firmware: what the data determine is found, and what they do not stays as it was.

A printer is simulated by the firmwares' own formulas: a carriage, or an arm, is as far from its endstop as its steps
say, and the firmware takes the endstop to be where its settings have it.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.optimize import least_squares

import pfabrik as pf
from pfabrik.cli import main
from test_printers import FILES, PRINTERS, Arms, Towers, numbers

NOISE = 0.01
"""Of a probe, and of what measures positions [mm]."""

MOST_DEVIATIONS = 4.5
"""Of a few hundred numbers, none is farther off by chance (7 in a million are)."""


class Delta(NamedTuple):
    """Settings of a linear delta by the names of its dimensions."""

    radius: float
    angles: tuple[float, float, float]
    arms: tuple[float, float, float]
    tops: tuple[float, float, float]

    @property
    def firmware(self) -> Towers:
        return Towers((self.radius,) * 3, self.angles, self.arms, self.tops)

    @property
    def dimensions(self) -> dict[str, float]:
        towers = {"angle": self.angles, "arm_length": self.arms, "position_endstop": self.tops}
        named = {
            f"{name}_{letter}": value
            for name, three in towers.items()
            for letter, value in zip("abc", three, strict=True)
        }
        return {"delta_radius": self.radius, **named}

    def place(self, carriages: np.ndarray) -> np.ndarray:
        """Where the nozzle is: where three spheres about the carriages meet, below them."""
        turns = np.radians(self.angles)
        centres = np.column_stack([self.radius * np.cos(turns), self.radius * np.sin(turns), carriages])
        along = centres[1:] - centres[0]
        squares = (centres**2).sum(axis=1) - np.array(self.arms) ** 2
        point, *_ = np.linalg.lstsq(2.0 * along, squares[1:] - squares[0], rcond=None)
        line = np.cross(along[0], along[1])
        line /= -np.sign(line[2]) * np.linalg.norm(line)
        off = point - centres[0]
        middle = off @ line
        return point + line * (-middle + math.sqrt(middle**2 - off @ off + self.arms[0] ** 2))


NOMINAL = Delta(142.5, (210.0, 330.0, 90.0), (290.125,) * 3, (205.25, 205.5, 205.25))

SETTINGS = {
    "klipper": "[printer]\nkinematics: delta\ndelta_radius: 142.5\n"
    "[stepper_a]\narm_length: 290.125\nposition_endstop: 205.25\n"
    "[stepper_b]\nposition_endstop: 205.5\n[stepper_c]\nposition_endstop: 205.25\n",
    "reprap": "M665 L290.125 R142.5 B120 H205.25 X0 Y0 Z0\nM666 X0 Y0.25 Z0\n",
    "marlin": "M665 L290.125 R142.5 H205.25 S100 X0 Y0 Z0\nM666 X0 Y-0.25 Z0\n",
    "Configuration.h": "#define DELTA\n#define DELTA_DIAGONAL_ROD 290.125\n#define DELTA_RADIUS 142.5\n"
    "#define DELTA_HEIGHT 205.25\n#define DELTA_ENDSTOP_ADJ { 0.0, -0.25, 0.0 }\n",
}
"""The same printer in every dialect."""


def written(form: str, text: str) -> Delta:
    """The settings in a text that was written for a firmware."""
    says = numbers(text)
    if form == "klipper":
        each = [
            tuple(says[f"[stepper_{k}] {key}"][0] for k in "abc") for key in ("angle", "arm_length", "position_endstop")
        ]
        return Delta(says["[printer] delta_radius"][0], *each)
    height, rods = says["M665 H"][0], says["M665 L"]
    angles = tuple(base + says[f"M665 {axis}"][0] for base, axis in zip((210.0, 330.0, 90.0), "XYZ", strict=True))
    if form == "reprap":
        ends = [height + says[f"M666 {axis}"][0] for axis in "XYZ"]
        arms = rods * 3 if len(rods) == 1 else rods
    else:
        ends = [height - says[f"M666 {axis}"][0] for axis in "XYZ"]
        arms = [rods[0] + says[f"M665 {letter}"][0] for letter in "ABC"]
    return Delta(says["M665 R"][0], angles, tuple(arms), tuple(ends))


def drawn(rng: np.random.Generator, arms: float) -> Delta:
    """A printer that is off by what builders are: a millimetre of radius, tenths of endstops and degrees."""
    a, b, c = NOMINAL.angles
    return Delta(
        NOMINAL.radius + rng.normal(0.0, 0.7),
        (a + rng.normal(0.0, 0.2), b + rng.normal(0.0, 0.2), c),
        tuple(arm + rng.normal(0.0, arms) for arm in NOMINAL.arms),
        tuple(top + rng.normal(0.0, 0.4) for top in NOMINAL.tops),
    )


def readings(built: Towers | Arms, settings: Towers | Arms, places: np.ndarray) -> np.ndarray:
    """What the firmware counts by its settings where the nozzle of the built printer is at places."""
    below = np.array(built.endstops) - np.array([built(*place) for place in places])
    return np.array(settings.endstops) - below


def bed(rng: np.random.Generator, count: int, radius: float) -> np.ndarray:
    """Places on the bed, those at its edge first."""
    turns = rng.uniform(0.0, 2.0 * math.pi, count)
    out = radius * np.sqrt(np.maximum(rng.uniform(0.0, 1.0, count), np.arange(count) < count // 3))
    return np.column_stack([out * np.cos(turns), out * np.sin(turns), np.zeros(count)])


def table(header: str, rows: np.ndarray) -> str:
    return "\n".join([header, *(",".join(f"{value:.9f}" for value in row) for row in rows)]) + "\n"


def run(*line: str) -> str:
    result = CliRunner().invoke(main, ["calibrate", *line])
    assert result.exit_code == 0, result.output
    return result.stdout


def check_found(result: str, truth: dict[str, float]) -> dict[str, dict[str, float]]:
    """The parameters of a result by name; those that are determined are within their deviations of the truth."""
    found = {each["name"]: each for each in json.loads(result)["parameters"]}
    for name, each in found.items():
        off = each["value"] - truth[name]
        assert not each["determined"] or abs(off) < MOST_DEVIATIONS * each["deviation"], (name, off, each)
        assert each["determined"] or each["value"] == each["described"]
    return found


@pytest.mark.parametrize("seed", [0, pytest.param(range(1, 40), marks=pytest.mark.campaign)])
@pytest.mark.parametrize("has_positions", [False, True], ids=["heights", "positions"])
@pytest.mark.parametrize("dialect", SETTINGS)
def test_a_printer_is_found_as_far_as_the_data_say(
    dialect: str, has_positions: bool, seed: int | range, tmp_path: Path
) -> None:
    """Arms are wrong, too: by heights alone they stay as described, and deviations of the others reckon with that."""
    form = "marlin" if dialect == "Configuration.h" else dialect
    file, data, out = tmp_path / "settings", tmp_path / "data.csv", tmp_path / "out"
    file.write_text(SETTINGS[dialect])
    for number in [seed] if isinstance(seed, int) else seed:
        rng = np.random.default_rng([number, has_positions])
        built = drawn(rng, 0.4)
        places = bed(rng, 30, 110.0)
        places[:, 2] += has_positions * rng.uniform(0.0, 80.0, len(places))
        counted = readings(built.firmware, NOMINAL.firmware, places)
        noisy = places + NOISE * rng.standard_normal(places.shape)
        measured = ("x,y,z", noisy) if has_positions else ("height", noisy[:, 2:])
        header = f"carriage_a,carriage_b,carriage_c,{measured[0]}"
        data.write_text(table(header, np.column_stack([counted, measured[1]])))
        found = check_found(run(str(file), str(data), "--json", f"--{form}", str(out), "--force"), built.dimensions)
        held = [name for name, each in found.items() if not each["determined"]]
        assert held == ([] if has_positions else ["arm_length_a", "arm_length_b", "arm_length_c"])
        text = out.read_text()
        assert text.startswith(("#", ";")[form != "klipper"]) and (", ".join(held) in text.partition("\n")[0])
        says = written(form, text).dimensions
        for name in found:
            described = NOMINAL.dimensions[name]
            assert says[name] == (described if name in held else pytest.approx(found[name]["value"], abs=1e-8))
        # a print of the corrected printer: flat, and at the height that is commanded
        new, commanded = written(form, text), bed(rng, 40, 110.0)
        counted = readings(new.firmware, built.firmware, commanded)
        heights = [built.place(carriages)[2] for carriages in counted]
        assert np.abs(heights).max() < 0.04


@pytest.mark.parametrize("name", ["rotary.cfg", "rotary.g"])
@pytest.mark.parametrize("has_positions", [False, True], ids=["heights", "positions"])
def test_a_rotary_printer_is_found_too(name: str, has_positions: bool, tmp_path: Path) -> None:
    rng, settings = np.random.default_rng(4), PRINTERS[name]
    assert isinstance(settings, Arms)
    ends = "tops" if settings.highest is None else "highest"

    def off(values: tuple[float, float, float], by: float) -> tuple[float, float, float]:
        a, b, c = np.array(values) + by * rng.standard_normal(3)
        return a, b, c

    a, b, _ = off(settings.angles, 0.2)
    heights = off(settings.heights, 0.2) if ends == "highest" else (settings.heights[0] + 0.3,) * 3
    built = settings._replace(
        radius=settings.radius + 0.05, angles=(a, b, settings.angles[2]), heights=heights,
        **{ends: off(getattr(settings, ends), 0.3)},
    )  # fmt: skip
    if has_positions:
        built = built._replace(upper=off(settings.upper, 0.2), lower=off(settings.lower, 0.2))
    middle = 85.0 if name == "rotary.g" else 30.0
    places = bed(rng, 60, 70.0) + [0.0, 0.0, middle]
    places[:, 2] += has_positions * rng.uniform(-15.0, 15.0, len(places))
    noisy = places + NOISE * rng.standard_normal(places.shape)
    header = "arm_a_deg,arm_b_deg,arm_c_deg," + ("x,y,z" if has_positions else "height")
    (tmp_path / "data.csv").write_text(
        table(header, np.column_stack([readings(built, settings, places), noisy if has_positions else noisy[:, 2:]]))
    )
    truth = {f"angle_{k}": value for k, value in zip("abc", built.angles, strict=True)}
    truth |= {f"upper_arm_length_{k}": value for k, value in zip("abc", built.upper, strict=True)}
    truth |= {f"lower_arm_length_{k}": value for k, value in zip("abc", built.lower, strict=True)}
    truth |= {f"shoulder_height_{k}": value for k, value in zip("abc", built.heights, strict=True)}
    truth |= {"shoulder_radius": built.radius, "shoulder_height": built.heights[0]}
    for stem, three in (("position_endstop", built.tops), ("highest", built.highest)):
        truth |= {f"{stem}_{k}": value for k, value in zip("abc" if three else "", three or (), strict=True)}
    form, out = "klipper" if name.endswith("cfg") else "reprap", tmp_path / "out"
    line = (str(FILES / name), str(tmp_path / "data.csv"), "--json", f"--{form}", str(out), "-o", str(tmp_path / "m"))
    found = check_found(run(*line), truth)
    assert all(each["determined"] for each in found.values()) == has_positions
    described = pf.load(FILES / name).dimensions
    for file in (out, tmp_path / "m"):
        again = pf.load(file).dimensions
        for each in found.values():
            assert again[each["name"]] == pytest.approx(each["value"], abs=1e-8)
            assert each["determined"] or again[each["name"]] == described[each["name"]]


def test_endstops_are_those_of_least_squares_by_another_program(tmp_path: Path) -> None:
    """The printer of the firmwares' formulas, fitted by SciPy with differences: values and deviations."""
    rng = np.random.default_rng(11)
    built = NOMINAL._replace(radius=142.0, tops=(205.5, 205.0, 205.25), angles=(210.1, 329.9, 90.0))
    counted = readings(built.firmware, NOMINAL.firmware, bed(rng, 31, 105.0))
    heights = 0.008 * rng.standard_normal(31)

    def settings(x: np.ndarray) -> Delta:
        return NOMINAL._replace(tops=(x[0], x[1], x[2]), radius=x[3], angles=(x[4], x[5], 90.0))

    def residual(x: np.ndarray) -> np.ndarray:
        own = settings(x)
        shift = np.array(own.firmware.endstops) - NOMINAL.firmware.endstops
        return np.array([own.place(row + shift)[2] for row in counted]) - heights

    start = [*NOMINAL.tops, NOMINAL.radius, *NOMINAL.angles[:2]]
    fit = least_squares(residual, start, jac="3-point", x_scale=1e-2, xtol=1e-12, ftol=1e-12, gtol=1e-12)
    spread = np.sqrt(np.diag(np.linalg.inv(fit.jac.T @ fit.jac)) * 2.0 * fit.cost / (31 - 6))
    (tmp_path / "config.g").write_text(SETTINGS["reprap"])
    rows = np.column_stack([counted, heights])
    (tmp_path / "data.csv").write_text(table("carriage_a,carriage_b,carriage_c,height", rows))
    names = [*(f"position_endstop_{letter}" for letter in "abc"), "delta_radius", "angle_a", "angle_b"]
    line = [str(tmp_path / "config.g"), str(tmp_path / "data.csv")]
    out = tmp_path / "out.g"
    named = run(*line, "--json", "--reprap", str(out), *(word for name in names for word in ("--free", name)))
    found = {each["name"]: each for each in json.loads(named)["parameters"]}
    np.testing.assert_allclose([found[name]["value"] for name in names], fit.x, rtol=0, atol=1e-6)
    np.testing.assert_allclose([found[name]["deviation"] for name in names], spread, rtol=1e-3)
    # the same by default, but that arms are taken to be as described only so far; and by zeros of the carriages
    default = {each["name"]: each for each in json.loads(run(*line, "--json"))["parameters"]}
    assert [default[name]["value"] for name in names] == pytest.approx([*fit.x], abs=1e-6)
    assert all(default[name]["deviation"] > found[name]["deviation"] for name in names)
    zeros = [word for name in (*names[3:], "offsets") for word in ("--free", name)]
    run(*line, *zeros, "--reprap", str(tmp_path / "zeros.g"))
    texts = [numbers((tmp_path / name).read_text()) for name in ("out.g", "zeros.g")]
    assert texts[0].keys() == texts[1].keys()
    for key, values in texts[0].items():
        np.testing.assert_allclose(texts[1][key], values, rtol=0, atol=1e-6)


@pytest.mark.parametrize("name", ["position_endstop_b", "delta_radius", "arm_length_c"])
def test_a_dimension_that_the_user_names_is_found_and_nothing_else_changes(name: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    true = NOMINAL.dimensions | {name: NOMINAL.dimensions[name] + 0.75}
    three = [tuple(true[f"{stem}_{k}"] for k in "abc") for stem in ("angle", "arm_length", "position_endstop")]
    built = Delta(true["delta_radius"], *three)
    rows = np.column_stack([readings(built.firmware, NOMINAL.firmware, bed(rng, 20, 100.0)), np.zeros(20)])
    (tmp_path / "data.csv").write_text(table("carriage_a,carriage_b,carriage_c,height", rows))
    for form in ("klipper", "reprap", "marlin"):
        (tmp_path / "file").write_text(SETTINGS[form])
        line = str(tmp_path / "file"), str(tmp_path / "data.csv"), "--free", name, "--sigma", "0.01", "--json"
        check_found(run(*line, f"--{form}", str(tmp_path / "out"), "--force"), true)
        says = written(form, (tmp_path / "out").read_text()).dimensions
        assert says == pytest.approx(true, abs=1e-6)
        assert all(says[other] == NOMINAL.dimensions[other] for other in says if other != name)


def klipper_with_measurements(noise: float, rng: np.random.Generator, built: Delta) -> str:
    """Klipper's settings after DELTA_CALIBRATE and DELTA_ANALYZE: seven heights, and twelve distances on a print."""
    turns, around = np.arange(6) * math.pi / 3.0, np.arange(12) * math.pi / 6.0
    probed = np.concatenate([[[0.0, 0.0, 0.0]], 100.0 * np.column_stack([np.cos(turns), np.sin(turns), 0.0 * turns])])
    probed[:, 2] += NOISE * rng.standard_normal(7)
    marks = 32.0 * np.column_stack([np.cos(around), np.sin(around), 0.0 * around])

    def steps(place: np.ndarray) -> str:
        below = np.array(built.firmware.endstops) - built.firmware(*place)
        return ",".join(f"{80.0 * value:.3f}" for value in below)

    lines = ["microsteps: 16\nrotation_distance: 40\n", "[delta_calibrate]"]
    lines += [f"height{k} = 0.0\nheight{k}_pos = {steps(place)}" for k, place in enumerate(probed)]
    for k, mark in enumerate(marks):
        lines.append(f"distance{k} = {64.0 + noise * rng.standard_normal():.4f}")
        lines += [f"distance{k}_pos1 = {steps(mark)}", f"distance{k}_pos2 = {steps(-mark)}"]
    saved = "\n".join(f"#*# {line}" for line in "\n".join(lines[1:]).splitlines())
    head = SETTINGS["klipper"].replace("[stepper_a]\n", f"[stepper_a]\n{lines[0]}")
    return f"{head}\n#*# <---------------------- SAVE_CONFIG ---------------------->\n{saved}\n"


def test_klipper_never_gets_rods_that_its_measurements_do_not_determine(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    built = NOMINAL._replace(arms=(290.725, 290.325, 289.825), radius=143.0, tops=(205.5, 205.25, 205.5))
    printer, out = tmp_path / "printer.cfg", tmp_path / "out.cfg"
    printer.write_text(klipper_with_measurements(0.03, rng, built))
    both = run(str(printer), "--json", "--klipper", str(out), "-o", str(tmp_path / "out.toml"))
    found = check_found(both, built.dimensions)
    held = [name for name, each in found.items() if not each["determined"]]
    assert held == ["arm_length_a", "arm_length_b", "arm_length_c"]
    said = "# Not determined by the measurements, and so as described: arm_length_a, arm_length_b, arm_length_c."
    for file in (out, tmp_path / "out.toml"):
        assert file.read_text().startswith(said)
        assert {pf.load(file).dimensions[name] for name in held} == {290.125}
    new, commanded = written("klipper", out.read_text()), bed(rng, 60, 100.0)
    places = np.array([built.place(row) for row in readings(new.firmware, built.firmware, commanded)])
    sizes = [np.linalg.norm(each[:30, :2] - each[30:, :2], axis=1) for each in (places, commanded)]
    assert np.abs(places[:, 2]).max() < 0.05 and np.sqrt(np.mean((sizes[0] - sizes[1]) ** 2)) < 0.06


def test_sigma_counts_for_what_klipper_has_measured(tmp_path: Path) -> None:
    printer, out = tmp_path / "printer.cfg", tmp_path / "out.cfg"
    printer.write_text(klipper_with_measurements(0.01, np.random.default_rng(3), NOMINAL._replace(radius=142.75)))

    def found(sigma: str) -> tuple[float, list[bool]]:
        result = json.loads(run(str(printer), "--sigma", sigma, "--json", "--klipper", str(out), "--force"))
        return result["rms_before"], [each["determined"] for each in result["parameters"]]

    fine, coarse = found("0.01"), found("0.04")
    assert fine[0] == pytest.approx(4.0 * coarse[0]) and any(fine[1])
    assert not any(found("50")[1]), "a ruler of 5 cm determines nothing"
    assert written("klipper", out.read_text()) == NOMINAL
    refused = CliRunner().invoke(main, ["calibrate", str(printer), "--sigma", "0"])
    assert refused.exit_code and "sigma" in refused.stderr


def test_a_mechanism_file_keeps_what_its_data_do_not_determine(tmp_path: Path) -> None:
    (tmp_path / "settings").write_text(SETTINGS["reprap"])
    pf.save(pf.load(tmp_path / "settings"), tmp_path / "m.toml")
    machine = pf.load(tmp_path / "m.toml")
    rng = np.random.default_rng(8)
    places = bed(rng, 25, 100.0) + [0.0, 0.0, 1.0] * rng.uniform(0.0, 60.0, (25, 1))
    other = machine.with_dimensions(arm_length_a=290.5, delta_radius=142.875, angle_b=330.25)
    rows = np.column_stack([pf.solve_ik(other, places).actuators, places])
    (tmp_path / "data.csv").write_text(table(",".join([*machine.actuator_names, "x", "y", "z"]), rows))
    run(str(tmp_path / "m.toml"), str(tmp_path / "data.csv"), "-o", str(tmp_path / "out.toml"))
    text, again = (tmp_path / "out.toml").read_text(), pf.load(tmp_path / "out.toml").dimensions
    assert text.startswith("# Not determined by the measurements, and so as described: platform_radius, apart.\n")
    assert again == pytest.approx(other.dimensions, abs=1e-6)
    assert all(again[name] == machine.dimensions[name] for name in ("platform_radius", "apart"))


def test_what_does_not_fit_is_named_as_the_file_has_it(tmp_path: Path) -> None:
    printer, rng = tmp_path / "printer.cfg", np.random.default_rng(6)
    text = klipper_with_measurements(0.01, rng, NOMINAL._replace(radius=142.75))
    for name, value in (("distance2", 64.8), ("height5", 0.6)):
        lines = [f"#*# {name} = {value}" if line.startswith(f"#*# {name} =") else line for line in text.splitlines()]
        printer.write_text("\n".join(lines))
        found = pf.read_printer(printer).calibrate(free=("delta_radius", "position_endstop_a", "angle_a"))
        assert found.outliers[0].name == name and f"{name} does not fit" in str(found)
