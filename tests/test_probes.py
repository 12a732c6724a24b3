"""Measurements as people have them: probes' logs and height maps, commanded positions, several files together."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import pfabrik as pf
from pfabrik.cli import main
from pfabrik.errors import InvalidArgument
from test_printer_calibration import NOMINAL, SETTINGS, Delta, bed, readings, written

BUILT = NOMINAL._replace(radius=143.0, tops=(205.5, 205.25, 205.5), angles=(210.125, 329.875, 90.0))
"""A printer whose arms are as described: what heights cannot tell is right."""


def true_height(place: np.ndarray) -> float:
    """Height of the nozzle of the built printer where its firmware, with the settings of NOMINAL, means it to be."""
    return float(BUILT.place(readings(NOMINAL.firmware, BUILT.firmware, place[None])[0])[2])


def trigger(x: float, y: float, height: float = 0.0) -> float:
    """The firmware's z when the nozzle, on its way down at x and y, is at a true height."""
    z = 0.0
    for _ in range(20):
        z -= true_height(np.array([x, y, z])) - height
    return z


def flatness(settings: Delta) -> float:
    """The most that the corrected printer is off a flat bed."""
    rows = readings(settings.firmware, BUILT.firmware, bed(np.random.default_rng(2), 40, 100.0))
    return float(np.abs([BUILT.place(row)[2] for row in rows]).max())


PLACES = bed(np.random.default_rng(1), 25, 100.0)[:, :2].round(3)


def klipper_log(form: str, offset: tuple[float, float, float]) -> str:
    lines = ["Start printer at Sun Nov 1 10:00:00 2026 (1.0 1.0)", "probe at 1.000,1.000 is z=9.000000"]
    lines += ["Start printer at Mon Nov 2 10:00:00 2026 (2.0 2.0)", "some other line"]
    for x, y in PLACES:
        z = trigger(x, y, offset[2])
        places = (x, y, z) if "is z" in form else (x + offset[0], y + offset[1], z - offset[2])
        lines.append(form.format(*places))
    return "\n".join(lines)


KLIPPER = ["// probe at {:.3f},{:.3f} is z={:.6f}", "10:30 probe: at {:.3f},{:.3f} bed will contact at z={:.6f}"]


def calibrated(tmp_path: Path, dialect: str, *data: Path, head: str = "") -> Delta:
    printer, out = tmp_path / ("printer.cfg" if dialect == "klipper" else "config.g"), tmp_path / "out"
    printer.write_text(SETTINGS[dialect] + head)
    result = CliRunner().invoke(main, ["calibrate", str(printer), *map(str, data), f"--{dialect}", str(out)])
    assert result.exit_code == 0, result.output
    return written(dialect, out.read_text())


@pytest.mark.parametrize("form", KLIPPER, ids=["old", "new"])
@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (20.0, -10.0, 2.5)], ids=["nozzle", "probe"])
def test_a_log_of_klipper_s_probe(form: str, offset: tuple[float, float, float], tmp_path: Path) -> None:
    (tmp_path / "klippy.log").write_text(klipper_log(form, offset))
    head = "[probe]\nx_offset: {}\ny_offset: {}\nz_offset: {}\n".format(*offset)
    assert flatness(NOMINAL) > 0.3
    assert flatness(calibrated(tmp_path, "klipper", tmp_path / "klippy.log", head=head)) < 1e-3


def test_lines_of_marlin(tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_text("".join(f"Bed X: {x} Y: {y} Z: {trigger(x, y):.4f}\nok\n" for x, y in PLACES))
    assert flatness(calibrated(tmp_path, "marlin", tmp_path / "log.txt")) < 1e-3


@pytest.mark.parametrize(
    "head",
    [
        "v1\nxmin,xmax,ymin,ymax,radius,spacing,xnum,ynum\n-80,80,-90,90,100,30,6,7",
        "v2 generated at 2020\nxmin,xmax,ymin,ymax,radius,xspacing,yspacing,xnum,ynum\n-80,80,-90,90,100,30,30,6,7",
        "v2\naxis0,axis1,min0,max0,min1,max1,radius,spacing0,spacing1,num0,num1\nX,Y,-80,80,-90,90,-1,30,30,6,7",
    ],
    ids=["v1", "v2", "axes"],
)
def test_a_height_map(head: str, tmp_path: Path) -> None:
    grid = [[(-80 + 30 * i, -90 + 30 * j) for i in range(6)] for j in range(7)]
    cells = [["0" if x * x + y * y > 1e4 else f"{trigger(x, y):8.4f}" for x, y in row] for row in grid]
    text = f"RepRapFirmware height map file {head}\n" + "\n".join(map(",".join, cells)) + "\n"
    (tmp_path / "heightmap.csv").write_text(text)
    assert flatness(calibrated(tmp_path, "reprap", tmp_path / "heightmap.csv")) < 1e-3
    machine = pf.load(tmp_path / "config.g")
    assert pf.read_measurements(tmp_path / "heightmap.csv", machine).rows == sum(map(len, cells)) - sum(
        row.count("0") for row in cells
    )
    for bad in (
        text.replace(",30,", ",x,"),
        text.replace("RepRap", "RepRap", 1).replace("xmin", "x").replace("min0", "m"),
    ):
        (tmp_path / "bad.csv").write_text(bad)
        if bad != text:
            with pytest.raises(InvalidArgument, match="line"):
                pf.read_measurements(tmp_path / "bad.csv", machine)


@pytest.mark.parametrize("z", [None, 0.0, 20.0])
def test_commanded_places_and_measured_heights(z: float | None, tmp_path: Path) -> None:
    rows = [(x, y, z or 0.0, true_height(np.array([x, y, z or 0.0]))) for x, y in PLACES]
    lines = [f"{x},{y},{h:.6f}" if z is None else f"{x},{y},{at},{h:.6f}" for x, y, at, h in rows]
    header = "x,y,height" if z is None else "x,y,z,height"
    (tmp_path / "a.csv").write_text("\n".join([header, *lines[:12]]))
    (tmp_path / "b.csv").write_text("\n".join([header, *lines[12:]]))
    assert flatness(calibrated(tmp_path, "reprap", tmp_path / "a.csv", tmp_path / "b.csv")) < 1e-3


def test_commanded_poses_of_any_machine_beside_measured_ones(tmp_path: Path) -> None:
    machine = pf.load("stewart")
    own = pf.parameters(machine, "offsets")
    true = np.array([0.2, -0.1, 0.3, 0.0, 0.1, -0.2])
    rng = np.random.default_rng(3)
    numbers = np.column_stack([rng.uniform(-15, 15, (12, 2)), rng.uniform(180, 210, 12), rng.uniform(-5, 5, (12, 3))])
    commanded = pf.solve_ik(machine, pf.pose(numbers[:, :3], rpy=numbers[:, 3:], degrees=True))
    poses = pf.solve_fk(own.apply(true), commanded.actuators).pose
    header = "target_x,target_y,target_z,target_roll_deg,target_pitch,target_yaw,x,y,z"
    lines = [",".join(f"{v:.12g}" for v in (*row, *pose[:3, 3])) for row, pose in zip(numbers, poses, strict=True)]
    (tmp_path / "data.csv").write_text("\n".join([header, *lines]))
    found = pf.calibrate(machine, pf.read_measurements(tmp_path / "data.csv", machine), free=own)
    np.testing.assert_allclose(found.values, true, atol=1e-6)


def test_sums_are_what_one_set_would_be() -> None:
    machine = pf.load("linear_delta")
    places = np.array([[0, 0, 0], [10, 5, -3], [0, 20, 1], [-15, 4, 2], [3, -20, 0], [20, 20, 5.0]])
    readings_, off = pf.solve_ik(machine, places).actuators, np.array([0.1, -0.2, 0.05])
    true = pf.solve_fk(pf.parameters(machine, "offsets").apply(off), readings_).pose[:, :3, 3]
    first = pf.Measurements(readings_[:4], height=true[:4, 2], sigma=0.01)
    second = pf.Measurements(
        readings_[4:], position=true[4:], distances=[(0, 1, np.linalg.norm(true[5] - true[4]))],
        sigma={"position": 0.02, "distances": 0.03}, names=["left", "right", "span"],
    )  # fmt: skip
    both = first + second
    assert both.names == ("row 1", "row 2", "row 3", "row 4", "left", "right", "span")
    assert both.count == 4 + 6 + 1 and both.distances[0, :2].tolist() == [4, 5]
    assert both.sigma == {"height": 0.01, "position": 0.02, "distances": 0.03}
    np.testing.assert_allclose(pf.calibrate(machine, both, free="offsets").values, off, atol=1e-8)
    assert both.without([4]).names == ("row 1", "row 2", "row 3", "row 4", "right")
    assert (first + first).names[-1] == "row 8"
    with pytest.raises(InvalidArgument, match=r"0\.01 and 0\.02 of height"):
        first + pf.Measurements(readings_[4:], height=true[4:, 2], sigma=0.02)
    with pytest.raises(InvalidArgument, match="beside none"):
        first + pf.Measurements(readings_[4:], height=true[4:, 2])


def test_what_cannot_be_says_so(tmp_path: Path) -> None:
    machine, file = pf.load("linear_delta"), tmp_path / "data.csv"
    for text, words in (
        ("x,y,height\n0,0,0\n5000,0,0\n", "row 2: x 5000, y 0, z 0, where 'Linear delta' as described cannot be"),
        ("x,height\n0,0\n", "no column y"),
        ("height\n0\n", "no column A1, A2, A3; expected one for each actuator of the machine, or x, y, z as commanded"),
        ("A1,A2,height\n0,0,0\n", "no column A3"),
        ("x,y,height\n0,,0\n", "a row without all of what was commanded"),
        ("Start printer at Mon\nStats 1.0: a=1, b\nbye\n", "no line that a probe wrote, .* 'probe at 30,40 is z=0.12'"),
    ):
        file.write_text(text)
        with pytest.raises(InvalidArgument, match=words):
            pf.read_measurements(file, machine)
    with pytest.raises(InvalidArgument, match="No such file"):
        pf.read_measurements(tmp_path / "none.csv", machine)


def test_a_file_given_twice_is_refused_and_the_offset_of_a_probe_is_said(tmp_path: Path) -> None:
    """None counts twice by a slip; what no file says is taken as 0, and noted."""
    machine, log = tmp_path / "delta.toml", tmp_path / "a.log"
    pf.save(pf.load("linear_delta"), machine)
    places = [(0, 0), (40, 0), (0, 40), (-40, 0), (0, -40)]
    log.write_text("\n".join(f"probe at {x},{y} is z=0.{n}" for n, (x, y) in enumerate(places, 1)))
    asked = ["calibrate", str(machine), str(log), "--free", "lengths"]
    twice = CliRunner().invoke(main, [*asked[:3], str(tmp_path / "." / "a.log"), *asked[3:]])
    assert twice.exit_code == 2 and "is given twice" in twice.stderr
    once = CliRunner().invoke(main, asked)
    assert "the probe is taken to be at x 0, y 0 of the nozzle, and to trigger at z 0" in once.stderr
    sigma = CliRunner().invoke(main, [*asked, "--sigma", "-1"])
    assert "--sigma: found -1.0; expected a positive number" in sigma.stderr


def test_what_may_be_freed_is_listed_by_kind(tmp_path: Path) -> None:
    (tmp_path / "config.g").write_text(SETTINGS["reprap"])
    listed = CliRunner().invoke(main, ["calibrate", str(tmp_path / "config.g"), "--list"])
    lines = {tuple(line.split()[:3]) for line in listed.stdout.splitlines()}
    assert listed.exit_code == 0
    assert {("dimensions", "delta_radius", "142.5"), ("dimensions", "position_endstop_b", "205.5")} <= lines
    assert {("offsets", "carriage_a.offset", "0"), ("scale", "carriage_c.scale", "1")} <= lines
    machine = pf.load("stewart")
    listed = CliRunner().invoke(main, ["calibrate", "stewart", "--list"])
    for line in listed.stdout.splitlines()[1:]:
        kind, name = line.split()[:2]
        assert pf.parameters(machine, name).names == (name,) and name in pf.parameters(machine, kind).names


def test_a_height_map_without_its_last_rows_is_refused(tmp_path: Path) -> None:
    labels = "axis0,axis1,min0,max0,min1,max1,radius,spacing0,spacing1,num0,num1\nX,Y,-9,9,-9,9,95,9,9,3,3\n"
    path = tmp_path / "heightmap.csv"
    path.write_text("RepRapFirmware height map file v2\n" + labels + 2 * "0.010,0.020,0.030\n")
    with pytest.raises(InvalidArgument, match="2 of the 3 rows"):
        pf.read_measurements(path, pf.load("linear_delta"))
