"""The exported C, compiled: it answers as the library does, and as limits measured on all joints say."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.spatial.transform import Rotation

import pfabrik as pf
from machines import closure, published
from pfabrik.cli import main
from pfabrik.description.joint_types import KINDS
from pfabrik.description.task import task_of
from pfabrik.errors import UnsupportedMechanism
from pfabrik.export import self_test
from pfabrik.export.export_c import c_source
from pfabrik.export.self_test import targets_around_home
from pfabrik.export.wording import in_words
from pfabrik.files import dumps, loads
from pfabrik.model import model_of
from pfabrik.motion.displacements import columns
from pfabrik.motion.limited_coordinates import coned

COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)]
needs_compiler = pytest.mark.skipif(not COMPILERS, reason="no C compiler here: neither gcc nor clang")
STRICT = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Wshadow", "-Werror")
DRIVER = Path(__file__).parent / "data" / "run_exported.c"
PRECISIONS = {"double": 1e-12, "float": 1e-5}
ROUNDED = 1e-6
"""How far a pose is off in single precision after some ten roundings [L or rad]."""

MATHEMATICS = {"sin", "cos", "sincos", "tan", "atan2", "acos", "hypot", "sqrt", "floor", "rint", "memset", "memcpy"}
"""What an exported file may need of the C library; the last two compilers write of themselves."""

REFUSED = {
    "nrpm": "poses leave joints A1, B1",
    "H4": "singular at home, where joints Q1, Q2",
    "panda": "a joint between the ends of its rod",
    "snake60": "a joint between the ends of its rod",
}
"""Machines that have no code, and what the refusal says."""

CATALOGUE = [name for name in pf.catalog() if name not in REFUSED]
ON_ARMS = {name: made for name, made in closure.ON_ARMS.items() if name not in REFUSED}
OTHERS = {
    "exechon": closure.exechon,
    "upu": closure.upu,
    "ankle": closure.ankle,
    "tricept_of_legs": closure.tricept,
    "planar_4rpr": closure.planar_4rpr,
    "puu": closure.puu,
    "hinge": closure.hinge,
    "slider": closure.slider,
    "seven_struts": published.seven_struts,
    **ON_ARMS,
}
AMBIGUOUS = "R + 3-RPS + RR"
"""A machine far from whose home arms follow from poses in more than one way."""


@lru_cache
def machine(name: str) -> pf.Mechanism:
    made = OTHERS.get(name) or closure.ON_ARMS.get(name)
    return made() if made else pf.load(name)


class Answers(NamedTuple):
    """What the exported file said, one row a pose; lengths over L."""

    ik: np.ndarray
    limits: np.ndarray
    fk: np.ndarray
    steps: np.ndarray
    poses: np.ndarray
    back: np.ndarray
    actuators: np.ndarray
    slack: np.ndarray


class Truth(NamedTuple):
    """What the library says of the same targets, limits measured on the coordinates of all joints."""

    targets: np.ndarray
    whole: np.ndarray
    closes: np.ndarray
    actuators: np.ndarray
    slack: np.ndarray


def units(mechanism: pf.Mechanism, names: Any) -> np.ndarray:
    lengths = [mechanism.joint(name).type == "prismatic" for name in names]
    return np.where(lengths, mechanism.characteristic_length, 1.0)


@lru_cache
def truth(name: str, count: int) -> Truth:
    """Targets around home; where a machine has less freedoms than its task asks for, nearest to them."""
    mechanism = machine(name)
    free = mechanism.without_limits()
    keep = pf.Options(working_mode="keep")
    targets = targets_around_home(mechanism, count, np.random.default_rng(5))
    found = pf.solve_ik(free, targets, options=keep)
    if not (found.status == 0).any():
        targets = np.ascontiguousarray(found.pose)
        found = pf.solve_ik(free, targets, options=keep)
    whole, closes, actuators, q = found.pose.copy(), found.status == 0, found.actuators.copy(), found.q.copy()
    # limits may lead a search where it does not come without them
    rows = np.flatnonzero(~closes & (np.asarray(pf.feasibility(mechanism, targets).margin) > 0.0))
    if len(rows):
        kept = pf.solve_ik(mechanism, targets[rows], options=keep)
        rows, kept = rows[kept.status == 0], kept[kept.status == 0]
        whole[rows], closes[rows], actuators[rows], q[rows] = kept.pose, True, kept.actuators, kept.q
    home = np.concatenate([np.ravel(mechanism.home_coordinate(joint.name)) for joint in mechanism.joints])
    return Truth(targets, whole, closes, actuators, slack_of(mechanism, q, home))


def limit_units(mechanism: pf.Mechanism) -> np.ndarray:
    """Of every limit, in the order of the file: L of lengths, 1 of angles."""
    table = model_of(mechanism).legs
    return np.concatenate([np.repeat(table.limited["unit"], 2), np.ones(len(table.cones))])


def slack_of(mechanism: pf.Mechanism, q: np.ndarray, home: np.ndarray) -> np.ndarray:
    """Room left before every limit, in the order of the file, (n, limits) [L or rad]."""
    turning = {joint.name: angles for joint, angles, _ in coned(mechanism, q - home)}
    rooms, ranged_so_far = [], {}
    for joint, bound in model_of(mechanism).legs.limits:
        described = mechanism.joint(joint)
        if bound == "cone":
            rooms.append(described.cone.half_angle - turning[joint])
            continue
        place = ranged_so_far.setdefault((joint, bound), 0)
        ranged_so_far[joint, bound] += 1
        kinds = KINDS[described.type].coordinates
        table = model_of(mechanism).legs
        column = columns(mechanism)[joint].start + (place if len(kinds) > 1 else 0)
        if len(kinds) > 1:  # a leg may tell the two coordinates of a joint in either order
            own = [int(each["column"]) for each in table.limited if columns(mechanism)[joint].start <= each["column"]]
            own = [each for each in own if each < columns(mechanism)[joint].stop]
            column = own[place]
        lo, hi = np.reshape(described.range, (-1, 2))[column - columns(mechanism)[joint].start]
        rooms.append(q[:, column] - lo if bound == "min" else hi - q[:, column])
    return np.array(rooms).T.reshape(len(q), -1) / limit_units(mechanism)


def sharpness(mechanism: pf.Mechanism, poses: np.ndarray) -> np.ndarray:
    """How far an actuator moves [L or rad] with the platform at most, by its motion [L and rad], (n,)."""
    found = pf.solve_ik(mechanism.without_limits(), poses, options=pf.Options(working_mode="keep"))
    jacobian = pf.inverse_jacobian(found) / units(mechanism, mechanism.actuator_names)[:, None]
    jacobian[..., :3] *= mechanism.characteristic_length
    return np.asarray(np.linalg.norm(jacobian, axis=-1).max(axis=-1))


def flat(poses: np.ndarray) -> np.ndarray:
    return np.concatenate([poses[:, :3, 3], poses[:, :3, :3].reshape(-1, 9)], axis=1)


@lru_cache
def needs_whole(compiler: str, *options: str) -> None:
    """Skip where a compiler is there, but not all that it needs for these options: clang without its sanitizers."""
    with tempfile.TemporaryDirectory() as folder:
        source, program = Path(folder, "whole.c"), Path(folder, "whole")
        source.write_text("#include <math.h>\nint main(void) { return 0; }\n")
        built = subprocess.run([compiler, *options, str(source), "-o", str(program)], capture_output=True, text=True)
        if built.returncode or subprocess.run([str(program)], capture_output=True).returncode:
            pytest.skip(f"{compiler} {' '.join(options)} builds no program that runs here: {built.stderr[-200:]}")


def compiled(folder: Path, text: str, compiler: str, *options: str, driver: Path | None = DRIVER) -> Path:
    """A program of an exported text, compiled without one warning."""
    exported, program = folder / "exported.c", folder / "program"
    exported.write_text(text)
    given = ["-std=c99", *options] if not any(each.startswith("-std") for each in options) else list(options)
    needs_whole(compiler, *given)
    source = [f'-DEXPORTED="{exported}"', str(driver)] if driver else ["-DPFK_SELF_TEST", str(exported)]
    run = subprocess.run(
        [compiler, *given, *STRICT, *source, "-o", str(program), "-lm"], capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    return program


def asked(program: Path, mechanism: pf.Mechanism, known: Truth) -> Answers:
    """What a program answers to all targets."""
    given = np.concatenate([flat(known.targets), flat(known.whole)], axis=1)
    run = subprocess.run([str(program)], input=given.tobytes(), capture_output=True)
    assert run.returncode == 0, run.stderr.decode()[-2000:]
    told = np.frombuffer(run.stdout).reshape(len(given), -1)
    n_a, sizes = len(mechanism.actuator_names), limit_units(mechanism)
    codes = told[:, :4].astype(int)
    scale = np.repeat([mechanism.characteristic_length, 1.0], [3, 9])
    return Answers(
        *codes.T, told[:, 4:16] / scale, told[:, 16:28] / scale, told[:, 28 : 28 + n_a], told[:, 28 + n_a :] / sizes
    )


def check(name: str, precision: str, told: Answers, known: Truth) -> float:
    """The promises of an exported file; the mean number of steps of its forward kinematics."""
    mechanism, exact = machine(name), PRECISIONS[precision]
    least = known.slack.min(axis=1, initial=1.0)
    kept, doubtful = known.closes & (least >= -1e-9), np.abs(known.slack + 1e-9).min(axis=1, initial=1.0) <= exact
    reached = told.ik == 0
    assert not (reached != kept)[~doubtful].any(), np.flatnonzero((reached != kept) & ~doubtful)[:5]
    both = reached & kept
    assert both.sum() >= 0.05 * len(both)
    off = np.abs(told.actuators - known.actuators) / units(mechanism, mechanism.actuator_names)
    rough = np.flatnonzero(both & (off.max(axis=1) > exact))
    if precision == "float":  # near a dead point the rounding of the pose itself leaves more open
        assert len(rough) <= 0.002 * both.sum()
        assert (off[rough].max(axis=1, initial=0.0) <= ROUNDED * sharpness(mechanism, known.whole[rough])).all()
    else:
        assert not len(rough), off[rough].max()
    # every limit by itself, and which is exceeded most
    measured = known.closes & (told.limits < 1000)
    assert measured.sum() >= (1.0 if precision == "double" else 0.999) * known.closes.sum()
    verdicts = (told.slack >= -1e-9) == (known.slack >= -1e-9)
    assert verdicts[measured][np.abs(known.slack + 1e-9)[measured] > exact].all()
    beyond = measured & (told.limits > 0)
    places = np.where(beyond, told.limits - 1, 0)[:, None]
    worst = np.take_along_axis(known.slack, places, axis=1)[:, 0] if beyond.any() else least
    assert (worst[beyond] <= least[beyond] + 10 * exact).all()
    # back to a pose that has these actuators: mostly the same one, else another assembly; arms have more of these
    least_back, most_others = (0.95, 0.3) if name in ON_ARMS else (0.98, 0.1)
    assert (told.fk[both] == 0).mean() > least_back
    back = both & (told.fk == 0)
    seen = slice(3) if mechanism.end_effector_is_joint else slice(12)
    other = np.flatnonzero(back & (np.abs(told.back - told.poses)[:, seen].max(axis=1) > 10 * exact))
    assert len(other) <= most_others * back.sum()
    if len(other) and precision == "double":
        poses = np.tile(np.eye(4), (len(other), 1, 1))
        poses[:, :3, 3] = told.back[other, :3] * mechanism.characteristic_length
        poses[:, :3, :3] = told.back[other, 3:].reshape(-1, 3, 3)
        again = pf.solve_ik(mechanism.without_limits(), poses, options=pf.Options(working_mode="keep")).actuators
        assert np.abs((again - told.actuators[other]) / units(mechanism, mechanism.actuator_names)).max() < 1e-9
    return float(told.steps[both].mean())


@needs_compiler
@pytest.mark.parametrize(
    "name",
    [
        *("stewart", "delta", "canfield", "five_bar", "agile_eye", "rps", "orthoglide"),
        *("tricept_of_legs", "upu", "planar_4rpr"),
        *("serial_arm", "6-RRPS", "3-CRU", "delta with a shaft", "Tricept with a wrist"),
    ],
)
def test_the_file_answers_as_the_library_does(name: str, tmp_path: Path) -> None:
    known = truth(name, 300)
    for precision in PRECISIONS:
        program = compiled(tmp_path, c_source(machine(name), precision=precision), COMPILERS[0])
        steps = check(name, precision, asked(program, machine(name), known), known)
        assert steps <= 6.5 or name not in CATALOGUE


@needs_compiler
@pytest.mark.campaign
@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", [name for name in (*CATALOGUE, *OTHERS) if name != AMBIGUOUS])
def test_the_file_answers_as_the_library_does_on_many_poses(name: str, precision: str, tmp_path: Path) -> None:
    known, text = truth(name, 20_000), c_source(machine(name), precision=precision)
    for compiler in COMPILERS:
        for standard in ("-std=c99", "-std=c11"):
            checked = ("-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
            program = compiled(tmp_path, text, compiler, standard, *checked)
            steps = check(name, precision, asked(program, machine(name), known), known)
            assert steps <= 6.5 or name not in CATALOGUE


@needs_compiler
@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("compiler", COMPILERS)
def test_the_file_checks_itself_under_sanitizers(compiler: str, precision: str, tmp_path: Path) -> None:
    text = c_source(machine("delta"), precision=precision)
    program = compiled(tmp_path, text, compiler, "-std=c11", "-fsanitize=address,undefined", driver=None)
    run = subprocess.run([str(program)], capture_output=True, text=True)
    assert (run.returncode, run.stdout, run.stderr) == (0, "50 poses, 0 wrong\n", "")


@needs_compiler
@pytest.mark.parametrize("compiler", COMPILERS)
def test_numbers_too_small_for_single_precision_are_no_warning(compiler: str, tmp_path: Path) -> None:
    text = c_source(machine("agile_eye"), precision="float")
    compiled(tmp_path, text, compiler, driver=None)
    assert in_words("a = 1e-60 + 2e-38 + 0.0;", "pfk", "float") == "a = 0.0f + 2e-38f + 0.0f;"


@needs_compiler
def test_arms_that_follow_in_more_than_one_way_do_so_in_home_s(tmp_path: Path) -> None:
    program = compiled(tmp_path, c_source(machine(AMBIGUOUS)), COMPILERS[0], driver=None)
    assert subprocess.run([str(program)], capture_output=True, text=True).stdout == "50 poses, 0 wrong\n"


@needs_compiler
@pytest.mark.campaign
@pytest.mark.parametrize("made", [closure.stretched_wrist, closure.five_bar_with_tool])
def test_the_file_reaches_what_is_feasible_where_more_than_one_pose_closes(made: Any, tmp_path: Path) -> None:
    mechanism, random = made(), np.random.default_rng(0)
    near = np.array([1.2 if drive.kind == "angle" else 30.0 for drive in mechanism.drives])
    values = [drive.home for drive in mechanism.drives] + near * random.uniform(-1.0, 1.0, (500, len(near)))
    targets = pf.solve_fk(mechanism, values).pose
    feasible = np.asarray(pf.feasibility(mechanism, targets).margin) > 1e-9
    assert feasible.mean() > 0.3
    text, unknown = c_source(mechanism), np.zeros(0)
    program = compiled(tmp_path, text, COMPILERS[0])
    told = asked(program, mechanism, Truth(targets, targets, unknown, unknown, unknown))
    assert not told.ik[feasible].any()
    off = told.poses[:, :3] - targets[:, :3, 3] / mechanism.characteristic_length
    assert np.abs(off[feasible] * task_of(mechanism).axes).max() < 1e-12
    program = compiled(tmp_path, text, COMPILERS[0], driver=None)
    assert subprocess.run([str(program)], capture_output=True, text=True).stdout == "50 poses, 0 wrong\n"


@needs_compiler
def test_a_file_checks_itself_with_poses_that_have_one_answer_alone(tmp_path: Path) -> None:
    text = c_source(closure.stretched_wrist(tool=(0, 10, 270)))
    program = compiled(tmp_path, text, COMPILERS[0], driver=None)
    assert subprocess.run([str(program)], capture_output=True, text=True).stdout == "50 poses, 0 wrong\n"


@needs_compiler
def test_a_machine_without_any_limit_has_a_file_that_compiles_and_checks_itself(tmp_path: Path) -> None:
    program = compiled(tmp_path, c_source(pf.load("servo_hexapod").without_limits()), COMPILERS[0], driver=None)
    assert subprocess.run([str(program)], capture_output=True, text=True).stdout == "50 poses, 0 wrong\n"


@needs_compiler
def test_a_self_test_says_so_where_nothing_can_be_compared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(self_test, "N_POSES", 0)
    program = compiled(tmp_path, c_source(machine("tricept_of_legs")), COMPILERS[0], driver=None)
    run = subprocess.run([str(program)], capture_output=True, text=True)
    assert (run.returncode, run.stdout) == (2, "nothing is checked: no pose near home has one answer alone\n")


@pytest.mark.parametrize(
    ("name", "task"), [("canfield", ("x", "y")), ("canfield", ("tilt",)), ("g1_ankle", ("x", "y"))]
)
def test_actuators_that_the_task_leaves_to_a_choice_are_not_exported(name: str, task: tuple[str, ...]) -> None:
    chosen = loads(
        re.sub("(?m)^schema.*", f"schema = 1\ntask = {[*task]}", re.sub("(?m)^task.*", "", dumps(machine(name))))
    )
    with pytest.raises(UnsupportedMechanism, match=r"leaves motions open.*--parts"):
        c_source(chosen)
    assert "pfk_fk" in c_source(chosen, parts=("limits", "fk", "rates"))


@needs_compiler
def test_a_self_test_fails_where_the_machine_is_another(tmp_path: Path) -> None:
    text = c_source(machine("stewart"))
    place = text.index("/* base_end_point */ {") + len("/* base_end_point */ {")
    wrong = text[:place] + "1.0 + " + text[place:]
    run = subprocess.run([str(compiled(tmp_path, wrong, COMPILERS[0], driver=None))], capture_output=True, text=True)
    assert run.returncode == 1
    assert "actuator 0" in run.stdout


@pytest.mark.skipif(not shutil.which("g++"), reason="no C++ compiler here")
@pytest.mark.parametrize("standard", ["c++11", pytest.param("c++20", marks=pytest.mark.campaign)])
@pytest.mark.parametrize(
    ("name", "precision"), [("linear_delta", "float"), ("canfield", "double"), (AMBIGUOUS, "double")]
)
def test_the_file_is_cpp_too(name: str, precision: str, standard: str, tmp_path: Path) -> None:
    text = c_source(machine(name), precision=precision)
    program = compiled(tmp_path, text, "g++", f"-std={standard}", "-xc++", driver=None)
    assert subprocess.run([str(program)], capture_output=True, text=True).stdout == "50 poses, 0 wrong\n"


@pytest.mark.skipif(not COMPILERS or not shutil.which("g++"), reason="no compilers of C and C++ here")
def test_a_program_in_cpp_calls_the_file_compiled_as_c(tmp_path: Path) -> None:
    (tmp_path / "arm.c").write_text(c_source(machine("linear_delta"), name="arm"))
    (tmp_path / "main.cpp").write_text(
        '#define ARM_DECLARATIONS_ONLY\n#include "arm.c"\n#include <cstdio>\n'
        "int main() { arm_pose pose; double found[ARM_ACTUATORS]; arm_home(&pose); pose.p[2] += 1.0;"
        " arm_pose out = pose; if (arm_ik(&pose, &out, found)) return 1;"
        ' std::printf("%.12g %.12g %.12g", found[0], found[1], found[2]); }'
    )
    for command in (
        [COMPILERS[0], "-std=c99", "-c", "arm.c"],
        ["g++", "-std=c++17", "-Wall", "-Werror", "main.cpp", "arm.o", "-o", "main", "-lm"],
    ):
        subprocess.run(command, cwd=tmp_path, check=True)
    told = subprocess.run([str(tmp_path / "main")], capture_output=True, text=True, check=True).stdout
    lifted = pf.solve_ik(machine("linear_delta"), machine("linear_delta").home_pose[:3, 3] + [0, 0, 1])
    np.testing.assert_allclose([float(word) for word in told.split()], lifted.actuators, rtol=1e-9)


@needs_compiler
@pytest.mark.parametrize("options", [[], ["--name", "delta"]])
def test_the_command_that_the_file_and_the_page_tell_runs_the_self_test(options: list[str], tmp_path: Path) -> None:
    file, page = tmp_path / "delta.c", Path(__file__).parents[1] / "docs" / "your-controller.md"
    result = CliRunner().invoke(main, ["export", "linear_delta", "c", "-o", str(file), *options])
    assert result.exit_code == 0
    said = re.search(r"^ +(cc .*-D.*SELF_TEST delta.c .*)$", file.read_text(), re.MULTILINE)
    assert said is not None
    told = re.search(r"^ +(cc .*-D.*SELF_TEST delta.c .*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    assert told is not None
    assert told[1] == said[1] or not options
    command = said[1].replace("cc", COMPILERS[0], 1)
    ran = subprocess.run(["sh", "-c", command], cwd=tmp_path, capture_output=True, text=True)
    assert (ran.stdout, ran.stderr) == ("50 poses, 0 wrong\n", "")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["check", "delta.c"]


@needs_compiler
def test_nothing_is_needed_but_mathematics_and_nothing_is_written_but_memory_of_calls(tmp_path: Path) -> None:
    (tmp_path / "exported.c").write_text(c_source(machine("servo_hexapod"), name="robot"))
    subprocess.run([COMPILERS[0], "-std=c99", "-O1", "-c", "exported.c"], cwd=tmp_path, check=True)
    listed = subprocess.run(["nm", "exported.o"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    symbols = [line.split()[-2:] for line in listed.splitlines()]
    assert not [name for kind, name in symbols if kind in "BDC"]  # none that another file could see
    assert {name for kind, name in symbols if kind == "U"} <= MATHEMATICS
    assert all(name.startswith("robot_") for kind, name in symbols if kind in "Tbd")


@needs_compiler
@pytest.mark.parametrize("name", ["stewart", "6-RRPS"])
def test_no_answer_depends_on_the_calls_before(name: str, tmp_path: Path) -> None:
    """The memory of calls is static: targets asked in another order have the same answers, bit by bit."""
    known = truth(name, 300)
    program, turned = compiled(tmp_path, c_source(machine(name)), COMPILERS[0]), slice(None, None, -1)
    there = asked(program, machine(name), known)
    back = asked(program, machine(name), Truth(*(each[turned] for each in known)))
    for one, other in zip(there, back, strict=True):
        np.testing.assert_array_equal(one, other[turned])


def test_parts_that_are_not_asked_for_are_not_there() -> None:
    text = c_source(machine("stewart"), parts=("ik",))
    assert "int pfk_ik(" in text
    assert "pfk_fk" not in text
    assert "pfk_limits" not in text


@needs_compiler
@pytest.mark.parametrize("parts", [("ik",), ("limits",), ("fk",), ("ik", "limits"), ("limits", "fk"), ("ik", "fk")])
def test_any_choice_of_parts_compiles_without_a_warning(parts: Any, tmp_path: Path) -> None:
    for name in ("stewart", "prs", "delta with a shaft"):
        exported = tmp_path / "exported.c"
        exported.write_text(c_source(machine(name), parts=parts))
        command = [COMPILERS[0], "-std=c99", *STRICT, "-c", str(exported), "-o", str(tmp_path / "exported.o")]
        assert subprocess.run(command, capture_output=True, text=True).stderr == ""


@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
@pytest.mark.parametrize(("name", "said"), REFUSED.items())
def test_chains_without_code_are_refused_by_name_and_nothing_is_written(name: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(UnsupportedMechanism) as caught:
        pf.export_c(machine(name), tmp_path / "machine.c")
    assert said in str(caught.value)
    assert "cannot be exported" in str(caught.value)
    assert not list(tmp_path.iterdir())


@needs_compiler
def test_names_of_joints_cannot_leave_comments_or_strings(tmp_path: Path) -> None:
    joints = [
        pf.Joint('a */ "\\ ??/ é', "prismatic", ("base", "platform"), axis=(0, 0, 1), actuated=True, range=(-1, 1))
    ]
    mechanism = pf.Mechanism("evil */ int x;", joints, "platform", (0, 0, 0), task=("z",))
    compiled(tmp_path, c_source(mechanism), COMPILERS[0])


RATES_DRIVER = """
#include EXPORTED
#include <stdio.h>
int main(void)
{
    double x[12], w[6] = {1, 2, 3, 4, 5, 6}, code;
    while (fread(x, 8, 12, stdin) == 12) {
        double J[PFK_ACTUATORS][6] = {{0}}, torques[PFK_ACTUATORS] = {0}, speeds[PFK_ACTUATORS] = {0};
        double given[6] = {0}, twist[6] = {0};
        pfk_pose pose;
        int i, j;
        for (i = 0; i < 3; ++i)
            for (pose.p[i] = x[i], j = 0; j < 3; ++j)
                pose.R[i][j] = x[3 + 3 * i + j];
        code = pfk_jacobian(&pose, J);
        pfk_speeds(&pose, w, speeds);
        pfk_speeds_back(&pose, speeds, twist);
        pfk_torques(&pose, w, torques);
        pfk_torques_back(&pose, torques, given);
        fwrite(&code, 8, 1, stdout);
        fwrite(J, 8, 6 * PFK_ACTUATORS, stdout);
        fwrite(torques, 8, PFK_ACTUATORS, stdout);
        fwrite(twist, 8, 6, stdout);
        fwrite(given, 8, 6, stdout);
    }
    return 0;
}
"""


def rates_of(name: str, folder: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, pf.Solution]:
    """Jacobians, torques, twists and wrenches of the exported file, and the library's configurations."""
    mechanism, driver = machine(name), folder / "rates.c"
    known, n_a = truth(name, 300), len(mechanism.actuator_names)
    poses = known.whole[known.closes][:100]
    solution = pf.solve_ik(mechanism.without_limits(), poses, options=pf.Options(working_mode="keep"))
    driver.write_text(RATES_DRIVER)
    program = compiled(folder, c_source(mechanism), COMPILERS[0], driver=driver)
    run = subprocess.run([str(program)], input=flat(solution.pose).tobytes(), capture_output=True, check=True)
    told = np.frombuffer(run.stdout).reshape(len(poses), -1)
    rows = np.flatnonzero((told[:, 0] == 0) & (solution.status == 0))
    assert len(rows) > 30
    told = told[rows, 1:]
    jacobian, rest = told[:, : 6 * n_a].reshape(-1, n_a, 6), told[:, 6 * n_a :]
    return jacobian, rest[:, :n_a], rest[:, n_a : n_a + 6], rest[:, n_a + 6 :], solution[rows]


@needs_compiler
@pytest.mark.parametrize(
    "name", ["stewart", "delta", "canfield", "five_bar", "agile_eye", "serial_arm", "g1_ankle", "seven_struts"]
)
def test_jacobians_speeds_and_torques_are_the_library_s(name: str, tmp_path: Path) -> None:
    """Of the library: torques by the transposed forward Jacobian, twists by both Jacobians one after the other."""
    jacobian, torques, twists, wrenches, solution = rates_of(name, tmp_path)
    inverse, forward, wanted = pf.inverse_jacobian(solution), pf.forward_jacobian(solution), np.arange(1.0, 7.0)
    if inverse.shape[-1] == 3:
        inverse = np.concatenate([inverse, 0.0 * inverse], axis=2)
        forward = np.concatenate([forward, 0.0 * forward], axis=1)
    allowed = forward @ inverse
    for told, expected in (
        (jacobian, inverse),
        (torques, np.einsum("nia,i->na", forward, wanted)),
        (twists, allowed @ wanted),
        (wrenches, np.einsum("nij,i->nj", allowed, wanted)),
    ):
        error = np.abs(told - expected).reshape(len(told), -1).max(axis=1)
        assert (error <= 1e-9 * np.abs(expected).reshape(len(told), -1).max(axis=1)).all()


@needs_compiler
@pytest.mark.parametrize("compiler", [*COMPILERS, "g++"])
def test_joints_in_series_are_coordinates_too(compiler: str, tmp_path: Path) -> None:
    if not shutil.which(compiler):
        pytest.skip("no C++ compiler here")
    mechanism, joints = machine("g1_ankle"), ("roll_joint", "pitch_joint")
    driver = tmp_path / "joints.c"
    driver.write_text(
        "#include EXPORTED\n#include <stdio.h>\n"
        "int main(void) { double q[2], x[2], J[2][2], back[2], w[2] = {1.0, 2.0}, t[2], v[2]; int steps;\n"
        'while (scanf("%lf %lf", &q[0], &q[1]) == 2) { back[0] = back[1] = 0.0;\n'
        "if (pfk_to_actuators(q, x) || pfk_jacobian(q, J) || pfk_to_joints(x, back, &steps) || pfk_torques(q, w, t)\n"
        "    || pfk_speeds(q, w, v)) return 1;\n"
        'printf("%.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g\\n", x[0], x[1], J[0][0], J[0][1], J[1][0],\n'
        "J[1][1], back[0], back[1], t[0] * v[0] + t[1] * v[1]); } return 0; }\n"
    )
    options = ["-std=c++11", "-xc++"] if compiler == "g++" else []
    program = compiled(tmp_path, c_source(mechanism, joints=joints), compiler, *options, driver=driver)
    q = np.random.default_rng(0).uniform([-0.15, -0.3], [0.15, 0.3], (50, 2))
    text = "\n".join(f"{a!r} {b!r}" for a, b in q.tolist())
    run = subprocess.run([str(program)], input=text, capture_output=True, text=True, check=True)
    told = np.array([line.split() for line in run.stdout.splitlines()], float)
    poses = np.tile(np.eye(4), (50, 1, 1))
    poses[:, :3, :3] = Rotation.from_euler("YX", q[:, ::-1]).as_matrix()
    expected = pf.solve_ik(mechanism, poses).actuators
    step = 1e-6 * np.eye(2)
    np.testing.assert_allclose(told[:, :2], expected, atol=1e-12)
    np.testing.assert_allclose(told[:, 6:8], q, atol=1e-10)
    np.testing.assert_allclose(told[:, 8], 5.0, rtol=1e-12)  # 1 * 1 + 2 * 2: power in is power out
    turned = poses.copy()
    for column, step_q in enumerate(step):
        turned[:, :3, :3] = Rotation.from_euler("YX", (q + step_q)[:, ::-1]).as_matrix()
        slope = (pf.solve_ik(mechanism.without_limits(), turned).actuators - expected) / 1e-6
        np.testing.assert_allclose(told[:, [2 + column, 4 + column]], slope, rtol=1e-4, atol=1e-4)
