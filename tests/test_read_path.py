"""Paths from CSV and G-code: every move where it should be, and one sentence for what is no path."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import pfabrik as pf
from machines import machine as made
from pfabrik.capabilities.paths import path as path_module
from pfabrik.cli import main
from pfabrik.common.cells import marked
from pfabrik.errors import InvalidArgument, UnknownName

TEMPLATES = Path(pf.__file__).parent / "machine" / "catalog" / "templates"


def read(tmp_path: Path, text: str, name: str = "path.nc", machine: str = "stewart", **options: float) -> Any:
    (tmp_path / name).write_text(text)
    return pf.read_path(tmp_path / name, made(machine), **options)


def positions(found: Any) -> np.ndarray:
    return found.targets[:, :3, 3]


def test_straight_moves_in_both_ways_of_counting_and_both_units(tmp_path: Path) -> None:
    text = "G21 G90\nG0 X0 Y0 Z180 (over the middle)\nG1 X10 F600 ; away\nG91 Y5\nG20 G1 X1\nG90 X0 Y0\nM2\nX99\n"
    found = read(tmp_path, text, longest=1000.0)
    expected = [[0, 0, 180], [10, 0, 180], [10, 5, 180], [35.4, 5, 180], [0, 0, 180]]
    np.testing.assert_allclose(positions(found)[1:], expected, atol=1e-12)
    assert found.lines[1:] == [2, 3, 4, 5, 6]
    assert np.isinf(found.feeds[1])
    np.testing.assert_allclose(found.feeds[2:4], 10.0)
    np.testing.assert_allclose(found.feeds[4:], 254.0)


@pytest.mark.parametrize(("plane", "axes", "offsets"), [("G17", "XY", "IJ"), ("G18", "ZX", "KI"), ("G19", "YZ", "JK")])
@pytest.mark.parametrize("code", ["G2", "G3"])
def test_arcs_stay_on_their_circle(plane: str, axes: str, offsets: str, code: str, tmp_path: Path) -> None:
    home = dict(zip("XYZ", made("stewart").home_pose[:3, 3], strict=True))
    begin, (u, v) = dict(home), axes
    end = {u: begin[u] + 10.0, v: begin[v] + 10.0}
    text = f"{plane} {code} {u}{end[u]} {v}{end[v]} {offsets[0]}10 {offsets[1]}0 F100"
    found = positions(read(tmp_path, text, tolerance=1e-3))
    centre = np.array([begin["XYZ"[i]] for i in range(3)])
    centre["XYZ".index(u)] += 10.0
    np.testing.assert_allclose(np.linalg.norm(found - centre, axis=1), 10.0, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(0.5 * (found[1:] + found[:-1]) - centre, axis=1), 10.0, atol=1.001e-3)
    # from (-1, 0) to (0, 1) as seen against the normal: a quarter clockwise, three quarters the other way
    length = np.linalg.norm(np.diff(found, axis=0), axis=1).sum()
    assert length == pytest.approx((0.5 if code == "G2" else 1.5) * np.pi * 10.0, rel=1e-3)


def test_an_arc_by_its_radius_and_a_helix(tmp_path: Path) -> None:
    by_radius = positions(read(tmp_path, "G91 G2 X10 Y10 R10 F1"))
    by_centre = positions(read(tmp_path, "G91 G2 X10 Y10 I10 J0 F1"))
    np.testing.assert_allclose(by_radius, by_centre, atol=1e-9)
    helix = positions(read(tmp_path, "G91 G3 I5 J0 Z3 F1"))
    assert helix[-1] - helix[0] == pytest.approx([0.0, 0.0, 3.0], abs=1e-9)
    np.testing.assert_allclose(np.linalg.norm(helix[:, :2] - helix[0, :2] - [5.0, 0.0], axis=1), 5.0, atol=1e-9)


@pytest.mark.parametrize(
    ("ending", "dwell", "seconds"),
    [
        (".gcode", "G4 P500", 0.5), (".g", "G04 P500", 0.5), (".gcode", "G4 S2", 2.0), (".gcode", "G4 P100 S2", 2.0),
        (".ngc", "G4 P0.5", 0.5), (".nc", "G4 P1", 1.0), (".ngc", "G1 E2\nG4 P500", 0.5), (".nc", "G4 F3", 3.0),
        (".gcode", "G4", 0.0), (".ngc", "G4 P0", 0.0),
    ],
)  # fmt: skip
def test_a_dwell_holds_the_pose_for_its_time(ending: str, dwell: str, seconds: float, tmp_path: Path) -> None:
    moves = "G91\nG1 X10 F600\n{}\nG1 X-10\n"
    with_dwell, without = tmp_path / f"a{ending}", tmp_path / f"b{ending}"
    with_dwell.write_text(moves.format(f"{dwell}\n{dwell}"))
    without.write_text(moves.format(""))
    found, plain = (pf.read_path(file, made("stewart")) for file in (with_dwell, without))
    assert found.times is not None and plain.times is not None
    assert plain.times[-1] == pytest.approx(2.0)
    assert found.times[-1] == pytest.approx(2.0 + 2.0 * seconds)
    sampled = pf.read_path(with_dwell, made("stewart"), rate=100.0)
    assert sampled.times is not None
    still = (sampled.times >= 1.0) & (sampled.times <= 1.0 + 2.0 * seconds)
    x = sampled.targets[:, 0, 3]
    np.testing.assert_allclose(x[still], x.max(), rtol=0, atol=1e-9)
    np.testing.assert_allclose(x[sampled.times > 1.0 + 2.0 * seconds + 1e-9][0], x.max(), atol=0.11)


def test_words_of_a_printers_settings_are_no_places(tmp_path: Path) -> None:
    settings = "M205 X8 Y8 ; jerk\nN5 M204 P500 R1000\nM900 K0.2\nM117 Layer G1 X9\nM84 X Y E\nG4 P0\n"
    found = read(tmp_path, f"M201 X500 Y500\nG1 X10 F600\n{settings}G2 X5 Y5 R5\n{settings}", longest=1000.0)
    plain = read(tmp_path, "G1 X10 F600\nG2 X5 Y5 R5\n", longest=1000.0)
    np.testing.assert_array_equal(found.targets, plain.targets)
    np.testing.assert_array_equal(found.feeds, plain.feeds)


def test_a_program_is_followed_to_its_end_with_turns_as_roll_pitch_and_yaw(tmp_path: Path) -> None:
    found = read(tmp_path, "G1 Z185 A5 B-3 C2 F100 M30\nX99\n", longest=1000.0)
    expected = pf.pose([*made("stewart").home_pose[:2, 3], 185.0], rpy=[5, -3, 2], degrees=True)
    assert len(found.targets) == 2
    np.testing.assert_allclose(found.targets[-1], expected, atol=1e-12)
    (tmp_path / "a.nc").write_bytes("(Stück für Stück)\nG1 X1 F60\n".encode("latin-1"))
    assert len(pf.read_path(tmp_path / "a.nc", made("stewart")).targets) >= 2


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("G1 X1 F0", "line 1: found F0"),
        ("G5 X1", "line 1: found G5"),
        ("X10", "line 1: a position without"),
        ("G1 X1\nG2 X5 Y5 I100 J0", "line 2: an arc from radius"),
        ("G2 X100 R1", "line 1: found R1"),
        ("G1 X#5", "line 1: found X#5, a variable"),
        ("G1 X[3+1]", "line 1: found X[3+1], an expression"),
        ("G1 X=4", "line 1: found '"),
        ("hello world", "found 'HELLO'"),
        ("", "no moves"),
        ("G1 X99999999999", "line 1: found X"),
        ("G1 X1 " + "X" * 200_000, "no text of a path"),
        ("G1 X1\0", "no text of a path"),
        ("G1 X1\nG3 X1 I5 P3", "line 2: found P3"),
        ("G1 X1 U5", "line 1: found U5"),
        ("G1 X1 Y2 X3", "line 1: found X twice"),
        ("G1 X1\nG4 X2", "line 2: found G4"),
        ("G1 X1\nM98 P100", "line 2: found M98, a call of a subroutine"),
        ("O100 sub\nG1 X1\no100 endsub", "line 1: found O100 SUB, a subroutine"),
        ("G1 X1\no<corner> call [1]", "line 2: found O<"),
        ("G1 X1\nO 7 while [#1 LT 3]", "line 2: found O 7 WHILE, a condition or a loop"),
        ("O1\nG1 X1\nO2\nG1 X2", "line 3: found O2, another program"),
        ("IF [#1 EQ 2] GOTO 10", "line 1: found IF, a condition"),
        ("G1 X1\nG55\nG1 X2", "line 2: found G55, a work offset that the program does not say"),
        ("G1 X1\nG92 X0", "line 2: found G92, an offset of all positions"),
        ("G10 L2 P1 X5\nG1 X1", "line 1: found G10, offsets or tool data"),
        ("G1 X1\nG53 G0 X0", "line 2: found G53, a move past the work offset"),
        ("G1 X1\nG28", "line 2: found G28, a move to a place that the program does not say"),
        ("G93 G1 X1 F1", "line 1: found G93, feeds as shares of a move"),
        ("G1 X1\nM206 X5", "line 2: found M206, an offset of all positions"),
        ("G90\nM70\nG91\nM72\nG1 X1", "line 4: found M72, a return to modes"),
        ("G1 X1\nSET_GCODE_OFFSET Z=0.1", "line 2: found SET_GCODE_OFFSET, an offset of all positions"),
        ("G1 X1\nRESTORE_GCODE_STATE NAME=x MOVE=1", "a return to modes that were saved"),
        ("G1 X1\nG29 X", "line 2: found 'X'; expected words such as X12.5"),
        ("G1 X1\nCALL", "line 2: found CALL, a call of a subroutine"),
    ],
)
def test_gcode_that_cannot_be_followed_is_one_sentence(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InvalidArgument) as caught:
        read(tmp_path, text)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300


def test_words_that_set_no_place_are_passed_over(tmp_path: Path) -> None:
    begun = "%\nO1234 (PART)\nG54 G21\nG92 E0\nG10\nG1 X1 F60\n"
    text = begun + "M73 P10 R5\nG11\nG92 E1\nM117 M98 in words\nG1 X2\nM30\nO2\n"
    np.testing.assert_allclose(positions(read(tmp_path, text, longest=5.0))[1:, 0], [1, 2])


@pytest.mark.parametrize("tolerance", [5e-324, 1e-17, 1e-12])
def test_a_tolerance_that_no_number_of_steps_keeps_is_refused(tolerance: float, tmp_path: Path) -> None:
    with pytest.raises(InvalidArgument, match=r"line 2: .*(too many steps|more than 1000000 targets)"):
        read(tmp_path, "G0 X0 Y0\nG2 X0 Y0 I20 J0 F600\n", tolerance=tolerance)


@pytest.mark.parametrize("tolerance", [1e-5, 1.0, 1e300])
def test_chords_are_as_far_off_their_arc_as_the_tolerance_says(tolerance: float, tmp_path: Path) -> None:
    found = positions(read(tmp_path, "G0 X0 Y0\nG2 X0 Y0 I20 J0 F600\n", tolerance=tolerance, longest=1e9))[1:]
    middles = (found[1:, :2] + found[:-1, :2]) / 2.0
    off = 20.0 - np.hypot(middles[:, 0] - 20.0, middles[:, 1])
    assert off.max() <= min(1.001 * tolerance, 20.0)
    assert off.max() > 0.5 * tolerance or len(found) == 5


AS_IN_ENGLISH = "note,t,x,y,z\na,0,1.5,2,180\nGröße,0.5,-2.25,3e-1,181\n"


@pytest.mark.parametrize(
    ("text", "encoding"),
    [
        (AS_IN_ENGLISH, "utf-8"),
        (AS_IN_ENGLISH, "utf-8-sig"),
        (AS_IN_ENGLISH, "utf-16"),
        (AS_IN_ENGLISH, "latin-1"),
        (AS_IN_ENGLISH.replace(",", ";"), "latin-1"),
        (AS_IN_ENGLISH.replace(",", ";").replace(".", ","), "latin-1"),
        (AS_IN_ENGLISH.replace(",", "\t").replace(".", ","), "utf-16"),
        ("sep=;\r\n" + AS_IN_ENGLISH.replace(",", ";").replace(".", ","), "utf-8-sig"),
        ("\ufeff" + AS_IN_ENGLISH.replace("\n", "\r"), "utf-16-be"),
    ],
)
@pytest.mark.parametrize("name", ["path.csv", "path"])
def test_tables_as_spreadsheets_of_any_country_write_them(
    text: str, encoding: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / name).write_bytes(text.encode(encoding))
    with (tmp_path / name).open(encoding="utf-8") as standard:
        monkeypatch.setattr("sys.stdin", standard)
        for found in (pf.read_path(tmp_path / name, made("stewart")), pf.read_path("-", made("stewart"))):
            assert positions(found).tolist() == [[1.5, 2, 180], [-2.25, 0.3, 181]]
            assert found.times is not None and found.times.tolist() == [0.0, 0.5]
            assert list(found.others["note"]) == ["a", "Größe"]
            assert list(found.others["t"]) == ["0", "0.5"]
        assert not standard.closed


FORMULAS = ["=1+1", "+note", "-x", "@me", "'=1", "''-a"]
HARMLESS = ["'quoted'", "-5", "+3.5", "-1,5", "'-5", "-", "=", "a=b", ""]


def test_text_that_looks_like_a_formula_is_marked_and_read_as_it_was(tmp_path: Path) -> None:
    assert [marked(cell) for cell in HARMLESS] == HARMLESS
    assert [marked(cell) for cell in FORMULAS] == [f"'{cell}" for cell in FORMULAS]
    cells = FORMULAS + HARMLESS
    rows = "".join(f'"{marked(cell)}",1,2,180\n' for cell in cells)
    assert list(read(tmp_path, "'=note,x,y,z\n" + rows, "path.csv").others["=note"]) == cells


def test_columns_in_any_order_and_either_unit(tmp_path: Path) -> None:
    text = "note,z,t,yaw_rad,x,feed,y,roll\nfirst,180,0,0.1,1,5,2,3\nlast,181,0.5,0.2,3,6,4,-3\n"
    found = read(tmp_path, text, "path.csv")
    expected = pf.pose([[1, 2, 180], [3, 4, 181]], rpy=[[np.radians(3), 0, 0.1], [-np.radians(3), 0, 0.2]])
    np.testing.assert_allclose(found.targets, expected, atol=1e-12)
    assert found.times is not None
    assert found.times.tolist() == [0.0, 0.5]
    assert found.feeds.tolist() == [5.0, 6.0]
    assert read(tmp_path, "z\n180\n", "z.csv", "rps").targets[0, 2, 3] == 180.0


@pytest.mark.parametrize(
    ("text", "heights"),
    [
        ("z\n180\n182\n", [180.0, 182.0]),
        ("\n\ufeffz,note\n180,G1\n", [180.0]),
        ("G21\nG1 Z181 F60\n", [220.0, 181.0]),
        ("; begun, by hand\nG1 Z181 F60\n", [220.0, 181.0]),
        ("%\nN10 G1 Z181 (up, a little) F60\n", [220.0, 181.0]),
    ],
)
def test_a_file_without_an_ending_is_what_its_first_line_says(text: str, heights: list[float], tmp_path: Path) -> None:
    found = read(tmp_path, text, "path", "prs", longest=1000.0)
    assert positions(found)[:, 2].tolist() == heights


def test_turns_as_quaternions_of_any_length_and_columns_in_capitals(tmp_path: Path) -> None:
    found = read(tmp_path, "qw,X,Y,Z,qx,qy,qz\n2,1,0,190,0.2,0.4,-0.6\n", "path.csv")
    expected = pf.pose([[1, 0, 190]], quat_xyzw=[[0.1, 0.2, -0.3, 1.0]])
    np.testing.assert_allclose(found.targets, expected, atol=1e-12)
    capitals = read(tmp_path, "x,y,z,Roll,T\n1,0,190,10,7\n", "path.csv")
    np.testing.assert_allclose(capitals.targets, pf.pose([[1, 0, 190]], rpy=[[np.radians(10), 0, 0]]), atol=1e-12)
    assert capitals.times is None
    assert list(capitals.others) == ["T"]


def test_turns_and_times_by_the_names_of_machine_tools(tmp_path: Path) -> None:
    handed_on = read(tmp_path, "x,y,z,rx\n1,2,-100,5\n", "path.csv", "delta")  # whose task has no turns
    assert [*handed_on.others["rx"]] == ["5"]
    table = read(tmp_path, "b_rad,x,y,z,a_deg\n0.1,0,0,190,3\n", "path.csv")
    np.testing.assert_allclose(table.targets, pf.pose([[0, 0, 190]], rpy=[[np.radians(3), 0.1, 0]]), atol=1e-12)
    assert table.angle_units == ("deg", "rad", "deg")
    turned = read(tmp_path, "G21 G1 Z190 F600\nA30 F60\n", longest=1000.0)
    assert turned.times is not None
    height = made("stewart").home_pose[2, 3]
    np.testing.assert_allclose(turned.times, [0.0, abs(190 - height) / 10.0, abs(190 - height) / 10.0 + 30.0])


def test_steps_are_divided_or_made_at_a_rate(tmp_path: Path) -> None:
    text = "x,y,z,t,note\n0,0,180,0,a\n0,3,180,1,b\n0,3,184,3,c\n"
    divided = read(tmp_path, text, "path.csv", longest=1.0)
    assert np.linalg.norm(np.diff(positions(divided), axis=0), axis=1) == pytest.approx(1.0)
    assert divided.others["note"] == [*"abbbcccc"]
    assert divided.times is not None
    np.testing.assert_allclose(divided.times, [0, 1 / 3, 2 / 3, 1, 1.5, 2, 2.5, 3])
    sampled = read(tmp_path, text, "path.csv", rate=0.8)
    assert sampled.times is not None
    np.testing.assert_allclose(sampled.times, [0, 1.25, 2.5, 3.0])
    np.testing.assert_allclose(positions(sampled)[:, 1:], [[0, 180], [3, 180.5], [3, 183], [3, 184]])
    with pytest.raises(InvalidArgument, match="without a time"):
        read(tmp_path, "x,y,z\n0,0,180\n0,0,181\n", "path.csv", rate=1.0)
    with pytest.raises(InvalidArgument, match="line 3: more than 1000000 samples"):
        read(tmp_path, "t,x,y,z\n-1e308,0,0,180\n7e307,0,0,181\n", "path.csv", rate=10.0)


@pytest.mark.parametrize(
    ("machine", "text", "said"),
    [
        ("stewart", "x,y,z\n1,2,nan\n", "line 2: column 'z': found 'nan'"),
        ("stewart", "x,y,z\n1,2\n", "line 2: found 2 cells"),
        ("stewart", "x,y,zz\n1,2,3\n", "did you mean 'zz'"),
        ("stewart", "x,y,z,x\n1,2,3,4\n", "column 'x' appears twice"),
        ("stewart", "x,y,z,roll,roll_rad\n1,2,3,4,5\n", "expected one of them"),
        ("stewart", "x,y,z\n", "no targets"),
        ("stewart", "x,y,z,t\n1,2,180,1\n1,2,180,1\n", "times that grow"),
        ("stewart", "x,y,z,feed\n1,2,180,0\n", "a feed above zero"),
        ("stewart", "x;y;z\n1,5;2;180\n1.5;2;180\n", "line 3: column 'x': found '1.5'; expected decimals with ','"),
        ("stewart", "x;y;z\n1.234,5;2;180\n", "line 2: column 'x': found '1.234,5'"),
        ("stewart", 'x,y,z\n"1,5",2,180\n', "line 2: column 'x': found '1,5'"),
        ("stewart", "x,y,z\n1,5,2,180\n", "line 2: found 4 cells; expected 3"),
        ("stewart", "x,y,z,qx,qy,qz\n1,2,180,0,0,0\n", "line 1: found columns qx, qy, qz"),
        ("stewart", "x,y,z,qx,qy,qz,qw,yaw\n1,2,180,0,0,0,1,0\n", "line 1: found columns yaw, qx, qy, qz, qw"),
        ("stewart", "x,y,z,qx,qy,qz,qw\n1,2,180,0,0,0,0\n", "line 2: found a zero quaternion"),
        ("stewart", "x,y,z,rx,ry,rz\n1,2,180,0,0,0\n", "line 1: found columns rx, ry, rz for turns"),
        ("g1_ankle", "pitch_joint\n1\n", "no column of a pose; expected "),
        ("g1_ankle", "pitch_joint\n1\n", ", or pitch_joint, roll_joint"),
        ("g1_ankle", "pitch_joint,roll_joint\n1,x\n", "line 2: column 'roll_joint': found 'x'; expected a finite"),
        ("g1_ankle", "pitch_joint,roll_joint,roll_joint_rad\n1,2,3\n", "no column of a pose"),
        ("g1_ankle", "pitch_joint,pitch_joint,roll_joint\n1,2,3\n", "column 'pitch_joint' appears twice"),
    ],
)
def test_tables_that_are_no_path_are_one_sentence(machine: str, text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InvalidArgument) as caught:
        read(tmp_path, text, "path.csv", machine)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_table_gives_targets_by_joints_in_series(tmp_path: Path) -> None:
    """In degrees, as roll and pitch are, or as a name says; further columns are handed on."""
    text = "t,roll_joint_rad,pitch_joint,note\n0,0.1,-10,a\n1,-0.05,5,b\n"
    (tmp_path / "joints.csv").write_text(text)
    machine = made("g1_ankle")
    path = pf.read_path(tmp_path / "joints.csv", machine)
    answers = pf.track(machine, path.targets)
    np.testing.assert_allclose(answers.joints["pitch_joint"], np.radians([-10.0, 5.0]), atol=1e-9)
    np.testing.assert_allclose(answers.joints["roll_joint"], [0.1, -0.05], atol=1e-9)
    assert path.times is not None and path.times.tolist() == [0.0, 1.0] and path.others["note"] == ["a", "b"]
    (tmp_path / "joints.csv").write_text("pivot[1],pivot[0]\n5,10\n")
    ankle = made("ankle_ups")
    found = pf.solve_ik(ankle, pf.read_path(tmp_path / "joints.csv", ankle).targets)
    np.testing.assert_allclose(np.degrees(found.joints["pivot"]), [[10.0, 5.0]], atol=1e-7)


def test_binary_and_endless_paths_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "binary.nc").write_bytes(bytes(range(256)) * 1000)
    with pytest.raises(InvalidArgument, match="no text"):
        pf.read_path(tmp_path / "binary.nc", made("stewart"))
    for module in ("pfabrik.capabilities.paths.sampling", "pfabrik.capabilities.paths.read_path"):
        monkeypatch.setattr(f"{module}.MOST_STEPS", 1000)
    assert path_module.MOST_STEPS == 1_000_000
    with pytest.raises(InvalidArgument, match="line 1002: more than 1000 targets"):
        read(tmp_path, "x,y,z\n" + "1,2,180\n" * 1001, "long.csv")
    with pytest.raises(InvalidArgument, match="more than 1000 targets"):
        read(tmp_path, "G1 X1 F1\nX2\n" * 10_000)
    with pytest.raises(InvalidArgument, match="more than 1000 targets"):
        read(tmp_path, "G1 X100000 F1", longest=1.0)


SLICED = """; a slicer's beginning and end
M104 S200
START_PRINT BED=60 EXTRUDER=200 NAME="a part (1)"
G28
G29 P1
G34
M420 S1 Z10
SET_VELOCITY_LIMIT ACCEL=3000
_CLEAN_NOZZLE
G21
G90
M83
G92 E0
G1 Z5 F9000
G1 X10 Y0 F3000 E0.1
G1 E-2 F2400
EXCLUDE_OBJECT_DEFINE NAME=part_0 CENTER=1.5,-2 POLYGON=[[0,0],[3,-1.5],[1.5,2]]
EXCLUDE_OBJECT_START NAME=part_0
G2 X0 Y10 I-10 J0 E0.3
PAUSE
END_PRINT
"""


def test_what_slicers_write_passes_and_is_named(tmp_path: Path) -> None:
    moves = "".join(line + "\n" for line in SLICED.splitlines() if line.startswith(("G1 X", "G1 Z", "G2 ")))
    path, bare = read(tmp_path, SLICED, name="part.gcode"), read(tmp_path, moves, name="bare.gcode")
    np.testing.assert_array_equal(path.targets, bare.targets)
    lines = {"START_PRINT": 3, "G29": 5, "G34": 6, "M420": 7, "SET_VELOCITY_LIMIT": 8, "_CLEAN_NOZZLE": 9}
    assert path.passed == lines | {
        "EXCLUDE_OBJECT_DEFINE": 17,
        "EXCLUDE_OBJECT_START": 18,
        "PAUSE": 20,
        "END_PRINT": 21,
    }


def test_a_recording_with_columns_and_units_of_its_own(tmp_path: Path) -> None:
    """A game's log, in m and ms, is the table that it would be in the machine's units and under its names."""
    rows = np.random.default_rng(5).uniform(-0.01, 0.01, (20, 4))
    log, table = tmp_path / "log.csv", tmp_path / "table.csv"
    lines = ["time;surge [m];sway;heave;roll;x;gear"]
    plain = ["t,x,y,z,roll_rad"]
    for k, (x, y, z, roll) in enumerate(rows):
        lines.append(f"{20 * k};{x:.9f};{y:.9f};{z + 0.195:.9f};{roll:.9f};{k};N")
        plain.append(f"{0.02 * k},{1000 * x:.6f},{1000 * y:.6f},{1000 * z + 195:.6f},{roll:.9f}")
    log.write_text("\n".join(lines))
    table.write_text("\n".join(plain))
    machine = made("stewart")
    columns = {"t": "time", "x": "surge [m]", "y": "sway", "z": "heave", "roll_rad": "roll"}
    scale = {"t": 1e-3, "x": 1e3, "y": 1e3, "z": 1e3}
    found, right = pf.read_path(log, machine, columns=columns, scale=scale), pf.read_path(table, machine)
    np.testing.assert_allclose(found.targets, right.targets, atol=1e-5)
    np.testing.assert_allclose(found.times, right.times, atol=1e-12)
    assert found.others["gear"][0] == "N" and found.others["file_x"][3] == "3"
    by_one = pf.read_path(log, machine, columns={k: v for k, v in columns.items() if k != "t"}, scale=1000.0, rate=None)
    np.testing.assert_array_equal(by_one.targets, found.targets)
    words = "t=time,x=surge [m],y=sway", "z=heave,roll_rad=roll"
    options = [*(part for each in words for part in ("--columns", each)), "--scale", "1000", "--scale", "t=0.001"]
    for command, more in (("track", []), ("time", ["--speed", "500"]), ("effort", ["--load", "platform=2,0,0,0"])):
        files = []
        for path, own in ((log, options), (table, [])):
            files.append(tmp_path / f"{path.stem}.{command}")
            line = [command, "stewart", str(path), *own, *more, "-o", str(files[-1]), "--rate", "200"]
            result = CliRunner().invoke(main, line)
            assert result.exit_code == 0, result.output
        ours, theirs = ([float(row.split(",")[0]) for row in f.read_text().splitlines()[1:]] for f in files)
        np.testing.assert_allclose(ours, theirs, atol=1e-4)


@pytest.mark.parametrize(
    ("columns", "scale", "words"),
    [
        ({"x": "surge"}, None, "no column 'surge'; expected one of those there: t, x, y, z"),
        ({"x": 3}, None, r"columns\['x'\]"),
        ({"rol": "roll"}, None, "no column named 'rol'; did you mean 'roll'"),
        (None, {"surge": 2.0}, "no column named 'surge'"),
        (None, -1.0, "scale"),
        (None, {"x": 0.0}, "scale of 'x'"),
        ({"x": "x", "y": "x"}, None, "'x' twice"),
        (None, {"roll": 2.0}, "no column 'roll' to scale; expected one of t, x, y, z"),
    ],
)
def test_columns_that_are_not_there(columns: Any, scale: Any, words: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t,x,y,z\n0,0,0,195\n1,1,0,195\n")
    with pytest.raises((InvalidArgument, UnknownName), match=words):
        pf.read_path(tmp_path / "a.csv", made("stewart"), columns=columns, scale=scale)


def test_one_factor_is_for_every_length_of_joints_and_none_of_angles(tmp_path: Path) -> None:
    machine, metres, right = pf.load(TEMPLATES / "tricept.toml"), tmp_path / "m.csv", tmp_path / "mm.csv"
    metres.write_text("Swing[0],Swing[1],Slide\n0,0,0.28\n5,-4,0.29\n")
    right.write_text("Swing[0],Swing[1],Slide\n0,0,280\n5,-4,290\n")
    for scale in (1000.0, {"lengths": 1000.0}, {"Slide": 1000.0}):
        found = pf.read_path(metres, machine, scale=scale).targets
        np.testing.assert_allclose(found, pf.read_path(right, machine).targets, atol=1e-9)
