"""Files that the command reads and writes: paths, answers, pictures, starting files; whole, and never over others."""

from __future__ import annotations

import csv
import dataclasses
import importlib
import json
import math
import os
from pathlib import Path

import numpy as np
import pytest

import pfabrik as pf
from command import in_process, listed, pfabrik, rows_of, told, write_files
from pfabrik.machine.catalog import template
from written import check_written

pytestmark = pytest.mark.usefixtures("folder")


# Answers along a path


def test_track_answers_every_target_with_angles_in_degrees() -> None:
    write_files("turned.csv")
    assert pfabrik("track stewart turned.csv -o answers.csv").exit_code == 1
    rows = rows_of("answers.csv")
    assert [row["status"] for row in rows] == ["REACHED", "REACHED", "PROJECTED"]
    assert float(rows[1]["target_pitch_deg"]) == pytest.approx(5, abs=1e-12)
    assert float(rows[1]["pitch_deg"]) == pytest.approx(5, abs=1e-7)
    assert "max" in rows[2]["active_limits"]
    assert listed() == ["answers.csv", "turned.csv"]


def test_angles_go_out_in_the_unit_they_came_in() -> None:
    Path("deg.csv").write_text("\ufeffx, y, z\r\n0, 10, 200\r\n", encoding="utf-8")
    Path("rad.csv").write_text("x,y,z,roll_rad,pitch_rad,yaw_rad\n0,10,200,0,0,0\n")
    answer = pf.track(pf.load("five_bar"), np.array([[0.0, 10.0, 200.0]]))
    for unit, expected in (("deg", np.degrees(answer.actuators[0])), ("rad", answer.actuators[0])):
        assert pfabrik(f"track five_bar {unit}.csv -o answers.csv").exit_code == 0
        row = rows_of("answers.csv")[0]
        np.testing.assert_allclose([float(row[f"actuator_{name}_{unit}"]) for name in ("p1", "p5")], expected, 1e-15)


def test_actuators_that_are_too_fast_are_named_in_their_rows() -> None:
    """Two places 10 apart: struts differ by what Pythagoras says."""
    Path("lift.csv").write_text("x,y,z\n0,0,195\n0,0,205\n0,0,205\n")
    lengths = [math.hypot(60, 20, height) for height in (195, 205)]
    fastest = (lengths[1] - lengths[0]) / 0.5
    for speeds, named in (
        (f"--speed {1.001 * fastest}", []),
        (f"--speed BL2={0.999 * fastest}", ["BL2"]),
        (f"--speed BL2={1.001 * fastest} --speed {0.999 * fastest}", ["BL1", "BL3", "BR1", "BR2", "BR3"]),
    ):
        result = pfabrik(f"track stewart lift.csv -o answers.csv --sample-time 0.5 {speeds}")
        assert [row["too_fast"] for row in rows_of("answers.csv")] == ["", "; ".join(named), ""]
        assert result.exit_code == (1 if named else 0)


@pytest.mark.compiled
def test_track_tells_where_answers_leap() -> None:
    write_files("two_links.toml", "hole.csv")
    result = pfabrik("track two_links.toml hole.csv -o answers.csv")
    assert [row["jump"] for row in rows_of("answers.csv")] == ["0"] * 7 + ["1"] + ["0"] * 2
    assert "; 1 jump (target 8)" in result.stdout


def test_text_that_a_spreadsheet_would_run_goes_out_as_text() -> None:
    joints = [dataclasses.replace(joint, name=f"={joint.name}", along=None) for joint in pf.load("five_bar").joints]
    pf.save(dataclasses.replace(pf.load("five_bar"), joints=joints, end_effector="=p3"), "arm.toml")
    Path("path.csv").write_text("x,y,z,@note\n0,10,200,=1+1\n0,10,900,-5\n")
    assert pfabrik("track arm.toml path.csv -o answers.csv").exit_code == 1
    with Path("answers.csv").open(newline="", encoding="utf-8") as handle:
        cells = {cell for row in csv.reader(handle) for cell in row if cell[:1] in ("=", "@", "+", "-")}
    assert all(math.isfinite(float(cell)) for cell in cells)
    rows = rows_of("answers.csv")
    assert [row["'@note"] for row in rows] == ["'=1+1", "-5"]
    assert {row["margin_of"][:2] for row in rows} == {"'="}
    again = pf.read_path("answers.csv", pf.load("five_bar"))
    assert list(again.others["@note"]) == ["=1+1", "-5"]
    assert {name[:1] for name in again.others["margin_of"]} == {"="}


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "empty"),
        ("\n\n", "empty"),
        ("x,y,z\n", "no targets"),
        ("x,y\n1,2\n", "no column z"),
        ("x y z\n1 2 3\n", "with commas between"),
        ("x,y,z,x\n1,2,3,4\n", "'x' appears twice"),
        ("x,y,z\n1,2,3\n1,b,3\n", "line 3: column 'y': found 'b'"),
        ("x,y,z\n1,2,nan\n", "line 2: column 'z': found 'nan'"),
        ("x,y,z\n1,2,1e999\n", "found '1e999'"),
        ("x,y,z\n1,2\n", "line 2: found 2 cells; expected 3"),
        ("1,2,3\n", "line 1: no column y, z"),
        ('x,y,z\n1,2,"' + "9" * 200_000 + '"\n', "line 2: no text of a path"),
        ("x,y,z\n" + "1,2,?\n" * 1000, "line 2: column 'z': found '?'"),
        ("\x00\xff" * 128, "no text of a path"),
    ],
)
def test_a_wrong_path_is_told_by_line_and_column_in_one_line(text: str, told: str) -> None:
    Path("path.csv").write_bytes(text.encode("latin-1"))
    result = pfabrik("track five_bar path.csv -o answers.csv")
    assert result.exit_code == 2
    assert told in result.stderr and len(result.stderr.splitlines()) == 1
    assert listed() == ["path.csv"]


# Whole files, in places of their own


def test_what_stood_in_the_output_stays_when_the_work_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    write_files("path.csv")
    Path("answers.csv").write_text("precious")
    monkeypatch.setattr("pfabrik.capabilities.paths.track_rows.TrackRows.write", interrupted)
    assert pfabrik("track five_bar path.csv -o answers.csv").exit_code == 130
    assert Path("answers.csv").read_text() == "precious"
    assert listed() == ["answers.csv", "path.csv"]


@pytest.mark.parametrize("output", ["missing/answers.csv", ".", "path.csv/answers.csv"])
def test_an_unwritable_output_is_told_by_its_name(output: str) -> None:
    write_files("path.csv")
    result = pfabrik(f"track five_bar path.csv -o {output}")
    assert result.exit_code == 2
    assert len(result.stderr.splitlines()) == 1 and ".part" not in result.stderr


@pytest.fixture
def linked(folder: Path) -> dict[str, bytes]:
    """A machine and a path with links to them, and what they hold."""
    pf.save(pf.load("five_bar"), "arm.toml")
    Path("path.csv").write_text("y,z\n0,170\n")
    Path("soft.csv").symlink_to("path.csv")
    Path("soft.toml").symlink_to("arm.toml")
    os.link("path.csv", "hard.csv")
    return {each.name: each.read_bytes() for each in folder.iterdir()}


@pytest.mark.parametrize("output", ["path.csv", "./path.csv", "soft.csv", "hard.csv", "arm.toml", "soft.toml"])
@pytest.mark.parametrize("read", ["arm.toml path.csv", "soft.toml soft.csv"])
def test_nothing_that_is_read_is_overwritten(folder: Path, linked: dict[str, bytes], read: str, output: str) -> None:
    result = pfabrik(f"track {read} -o {output}")
    assert result.exit_code == 2
    assert "found a file that was read" in result.stderr
    assert {each.name: each.read_bytes() for each in folder.iterdir()} == linked


@pytest.mark.parametrize(
    ("line", "name"), [("arm.toml - -o hard.csv", "path.csv"), ("- path.csv -o soft.toml", "arm.toml")]
)
def test_a_file_on_standard_input_is_not_overwritten(
    folder: Path, linked: dict[str, bytes], line: str, name: str
) -> None:
    with Path(name).open() as file, in_process(f"track {line}", stdin=file) as process:
        told = process.communicate()[1]
    assert process.returncode == 2
    assert "found a file that was read" in told
    assert {each.name: each.read_bytes() for each in folder.iterdir()} == linked


def test_an_output_that_is_a_link_or_a_device_stays_one_and_a_link_in_circles_is_refused(folder: Path) -> None:
    write_files("path.csv")
    Path("link.csv").symlink_to("answers.csv")
    Path("loop.csv").symlink_to("loop.csv")
    written = pfabrik("track five_bar path.csv -o link.csv")
    assert f"pfabrik: note: link.csv is a link; {folder / 'answers.csv'} is written\n" in written.stderr
    assert Path("link.csv").is_symlink() and len(rows_of("answers.csv")) == 2
    assert "is a link" not in pfabrik("track five_bar path.csv -o answers.csv").stderr
    assert pfabrik(f"track five_bar path.csv -o {os.devnull}").exit_code == 1
    assert not Path(os.devnull).is_file()
    refused = pfabrik("track five_bar path.csv -o loop.csv")
    assert (refused.exit_code, Path("loop.csv").is_symlink()) == (2, True)
    assert "loop.csv: Too many levels of symbolic links" in refused.stderr


@pytest.mark.parametrize(
    "line",
    [
        "track five_bar path.csv -o a.png --plot a.png",
        "track five_bar path.csv -o a.png --plot ./a.png",
        "track five_bar path.csv -o {folder}/a.png --plot a.png",
        "track five_bar path.csv -o same/a.png --plot a.png",
        "track five_bar path.csv -o a.png --plot link.png",
        "track five_bar path.csv -o there.png --plot hard.png",
        "track five_bar path.csv --plot a.png --animate link.gif",
        "workspace five_bar -o a.csv -o ./a.csv",
    ],
)
def test_two_outputs_to_one_place_are_refused(folder: Path, line: str) -> None:
    write_files("path.csv")
    Path("there.png").write_text("precious")
    os.link("there.png", "hard.png")
    Path("same").symlink_to(".")
    for link in ("link.png", "link.gif"):
        Path(link).symlink_to("a.png")
    before = listed()
    result = pfabrik(line.format(folder=folder))
    assert result.exit_code == 2
    assert "found one place for two outputs" in result.stderr
    assert listed() == before
    assert Path("there.png").read_text() == "precious"


def test_a_file_that_exists_is_kept_unless_forced() -> None:
    Path("my.toml").write_text("mine")
    result = pfabrik("new delta -o my.toml")
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr == "pfabrik: my.toml: exists already; --force replaces it\n"
    assert Path("my.toml").read_text() == "mine"
    assert pfabrik("new delta -o my.toml --force").exit_code == 0
    assert Path("my.toml").read_text(encoding="utf-8") == template("delta")


# Pictures


PICTURES = [
    # the line, its exit code, and what it writes
    ("plot five_bar", 0, "five_bar.png"),
    ("plot five_bar --position 0 0 180 -o a.svg", 0, "a.svg"),
    ("plot five_bar --position 0 0 300 -o a.pdf", 1, "a.pdf"),
    ("plot five_bar --torque-map --joints p1,p2 --torque 25 -o a.png", 0, "a.png"),
    ("plot five_bar --torque-map --joints p1 p2 -o a.png", 0, "a.png"),
]


@pytest.mark.parametrize(("line", "code", "name"), PICTURES, ids=[line for line, *_ in PICTURES])
def test_pictures_are_written_and_told_of(line: str, code: int, name: str) -> None:
    pytest.importorskip("matplotlib")
    write_files("path.csv")
    result = pfabrik(line)
    assert result.exit_code == code, result.stderr
    assert f"wrote {name}\n" in result.stdout + result.stderr
    check_written(Path(name))
    assert listed() == sorted(["path.csv", name])


SHOWN = "--view 20,-60 --size 6x4 --dpi 50 --theme dark"


@pytest.mark.parametrize(
    "line",
    ["plot stewart -o a.png", "track five_bar path.csv --plot a.png", "workspace stewart --resolution 40 -o a.png"],
)
def test_a_picture_has_the_size_and_the_ground_that_it_is_asked_for(line: str) -> None:
    pytest.importorskip("matplotlib")
    from PIL import Image

    write_files("path.csv")
    assert pfabrik(f"{line} {SHOWN}").exit_code < 2
    with Image.open("a.png") as picture:
        assert picture.size == (300, 200)
        assert max(picture.convert("RGB").getpixel((0, 0))) < 50
    without = pfabrik("travel five_bar --theme dark")
    assert (without.exit_code, without.stderr) == (0, "pfabrik: note: --theme has no effect without --plot\n")


def test_plot_writes_the_names_of_all_joints(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    written: list[set[str]] = []
    drawing = importlib.import_module("pfabrik.view.machine")
    monkeypatch.setattr(drawing, "write_names", lambda _canvas, _skeleton, named: written.append(named))
    for line in ("plot five_bar --names -o a.svg", "plot five_bar -o b.svg"):
        assert pfabrik(line).exit_code == 0
    assert written == [{joint.name for joint in pf.load("five_bar").joints}, set()]


def test_a_workspace_is_written_in_every_format() -> None:
    pytest.importorskip("matplotlib")
    names = ["a.csv", "a.npz", "a.ply", "a.png", "a.stl"]
    result = pfabrik(f"workspace stewart --resolution 16 {' '.join(f'-o {name}' for name in names)}")
    assert (result.exit_code, told(result), listed()) == (0, [f"wrote {name}" for name in names], names)
    assert np.load("a.npz")["size"] == pf.workspace(pf.load("stewart"), resolution=16.0).size


@pytest.mark.compiled
def test_demo_writes_a_picture_and_a_table_for_each_machine() -> None:
    pytest.importorskip("matplotlib")
    assert pfabrik("demo --quick -o pictures").exit_code == 0
    assert {path.suffix for path in Path("pictures").iterdir()} == {".png", ".csv"}
    for path in Path("pictures").glob("*.csv"):
        assert {row["status"] for row in rows_of(path)} == {"REACHED", "PROJECTED"}, path.name
        check_written(path.with_suffix(".png"))


def test_demo_refuses_a_file_where_its_folder_should_be() -> None:
    Path("out").write_text("precious")
    assert pfabrik("demo --quick").exit_code == 2
    assert Path("out").read_text() == "precious"


def test_a_missing_library_is_named_before_the_work(monkeypatch: pytest.MonkeyPatch) -> None:
    write_files("path.csv")
    monkeypatch.setattr("pfabrik.common.extras.find_spec", lambda _: None)
    for line in ("demo", "plot five_bar", "track five_bar path.csv --animate a.gif"):
        result = pfabrik(line)
        assert result.exit_code == 2
        assert "pip install '.[plot]'" in result.stderr


def test_efforts_of_a_path_go_to_a_file_row_by_row() -> None:
    write_files("weighed.toml", "rise.csv")
    done = pfabrik("effort weighed.toml rise.csv --torque 2 -o out.csv --plot out.svg --json")
    rows, found = rows_of("out.csv"), json.loads(done.stdout)
    assert [float(row["effort_p5"]) for row in rows] == [row[1] for row in found["actuators"]]
    assert max(abs(float(row["effort_p5"])) for row in rows) == pytest.approx(2.0, rel=1e-4)
    by_hand = math.radians(float(rows[5]["rate_p1_deg"])) * float(rows[5]["effort_p1"])
    assert float(rows[5]["power_p1"]) == pytest.approx(by_hand)
    check_written(Path("out.svg"))


def test_efforts_out_of_reach_are_those_of_the_nearest_poses_and_said() -> None:
    write_files("weighed.toml")
    heights = [190 + 40 * step for step in range(12)]
    Path("far.csv").write_text("y,z\n" + "\n".join(f"0,{height}" for height in heights) + "\n")
    done = pfabrik("effort weighed.toml far.csv --sample-time 0.1 -o out.csv")
    path = pf.track(pf.load("weighed.toml"), [[0, 0, height] for height in heights], sample_time=0.1)
    is_off = path.status == pf.Status.PROJECTED
    assert done.exit_code == 1 and is_off.any() and not is_off.all()
    assert [row["projected"] for row in rows_of("out.csv")] == [str(int(off)) for off in is_off]
    first = int(np.flatnonzero(is_off)[0]) + 1
    assert f"{is_off.sum()} targets: {first} to 12" in done.output


@pytest.mark.parametrize(
    "line",
    [
        "plot stewart -o a.png -o b.png",
        "singularities five_bar -o a.png -o a.pdf",
        "travel stewart --plot a.png --plot=b.png",
        "track stewart path.csv -o a.csv --output b.csv",
        "new delta -o a.toml -oa.toml",
        "export stewart --web a.html --web b.html",
    ],
)
def test_an_option_of_one_file_that_is_given_twice_is_refused_and_nothing_written(line: str) -> None:
    before = listed()
    result = pfabrik(line)
    assert result.exit_code == 2 and "found it 2 times; expected one file" in result.stderr
    assert listed() == before


def test_every_file_that_is_written_is_named() -> None:
    Path("path.csv").write_text("x,y,z,t\n0,0,190,0\n0,0,200,1\n0,0,205,2\n")
    lines = {
        "new delta -o a.toml": ["a.toml"],
        "track stewart path.csv -o a.csv": ["a.csv"],
        "time stewart path.csv --speed 100 -o b.csv": ["b.csv"],
        "effort stewart path.csv --load platform=1,0,0,200 -o c.csv": ["c.csv"],
        "export stewart c -o a.c": ["a.h", "a.c"],
        "export stewart --numpy a.py": ["a.py"],
        "plot stewart -o a.svg": ["a.svg"],
        "track stewart path.csv -o - --plot b.svg": ["b.svg"],
    }
    for line, files in lines.items():
        result = pfabrik(line)
        assert result.exit_code == 0, result.output
        assert [row.split()[1].rstrip(";") for row in result.stderr.splitlines() if row.startswith("wrote ")] == files


def test_columns_of_joints_leave_nothing_of_the_task_out(tmp_path: Path) -> None:
    """Their poses turn as the joints do, which the task of a Tricept does not set."""
    path = tmp_path / "joints.csv"
    path.write_text("t,D[0],D[1],E\n0,0,0,270\n1,5,2,280\n")
    result = pfabrik(f"track tricept {path}")
    assert result.exit_code == 0 and "no effect" not in result.stderr
