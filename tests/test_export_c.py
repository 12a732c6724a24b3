"""The exported C, compiled: it answers as the library does, and as limits measured on all joints say."""

from __future__ import annotations

import dataclasses
import re
import shutil
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import pfabrik as pf
from exported import (
    CATALOGUE,
    COMPILERS,
    EXACT,
    KEEP,
    PASSED,
    REFUSED,
    STRICT,
    WITHOUT_NEAREST,
    Answers,
    Truth,
    answers_of,
    checks_itself,
    compiled,
    machine,
    matrices,
    needs_compiler,
    off,
    program_of,
    sanitizers_of,
    survives,
    text_of,
    truth,
)
from machines import closure
from pfabrik.cli import main
from pfabrik.errors import InvalidArgument, UnsupportedMechanism
from pfabrik.exchange.export import source
from pfabrik.exchange.export.export_c import PARTS, c_source
from pfabrik.exchange.export.static_data import in_words
from pfabrik.kernels.controller.reached import MOST_PARTS, SHORTEST_SHARE
from pfabrik.machine.description.task import task_of
from pfabrik.machine.files import dumps, loads
from test_actuation import waist

ROUNDED = 1e-6
"""How far a pose is off in single precision after some ten roundings [L or rad]."""

MATHEMATICS = {"sin", "cos", "sincos", "tan", "atan2", "acos", "hypot", "sqrt", "floor", "rint", "memset", "memcpy"}
"""What an exported file may need of the C library; the last two compilers write of themselves."""

OTHERS = ["exechon", "upu", "ankle", "closure.tricept", "planar_4rpr", "puu", "hinge", "slider", "seven_struts"]
OTHERS += [name for name in closure.ON_ARMS if name not in REFUSED]
AMBIGUOUS = "R + 3-RPS + RR"
"""A machine far from whose home arms follow from poses in more than one way."""

DIFFERENT = ("stewart", "five_bar", "serial_arm", "seven_struts", "Par4")
"""Machines with struts, cranks, arms, implicit joints, more legs than freedoms; with a pivot: joints in series."""

FILES = [*((name, "double") for name in DIFFERENT), ("delta", "float"), ("agile_eye", "float")]
WHOLE = ("stewart",)
"""Whose file has all parts; those of three machines are asked for nearest poses, those of all in a campaign."""


@pytest.fixture(scope="module", params=FILES, ids=" ".join)
def file(request: pytest.FixtureRequest) -> tuple[str, str]:
    """Name and precision of a machine's file; what is asked of one comes together, for it is compiled once."""
    return request.param


def program(name: str, precision: str) -> Path:
    return program_of(name, precision, None if name in WHOLE else WITHOUT_NEAREST)


def sharpness(mechanism: pf.Mechanism, poses: np.ndarray) -> np.ndarray:
    """How far an actuator moves [L or rad] with the platform at most, by its motion [L and rad], (n,)."""
    jacobian = pf.inverse_jacobian(pf.solve_ik(mechanism.without_limits(), poses, options=KEEP))
    jacobian = off(mechanism, jacobian.swapaxes(1, 2), 0.0).swapaxes(1, 2)
    jacobian[..., :3] *= mechanism.characteristic_length
    return np.asarray(np.linalg.norm(jacobian, axis=-1).max(axis=-1))


def check(name: str, precision: str, told: Answers, known: Truth) -> None:
    """The promises of an exported file."""
    mechanism, exact = machine(name), EXACT[precision]
    least = known.slack.min(axis=1, initial=1.0)
    kept, doubtful = known.closes & (least >= -1e-9), np.abs(known.slack + 1e-9).min(axis=1, initial=1.0) <= exact
    reached = told.ik == 0
    assert not (reached != kept)[~doubtful].any(), np.flatnonzero((reached != kept) & ~doubtful)[:5]
    both = reached & kept
    assert both.sum() >= 0.05 * len(both)
    wrong = off(mechanism, told.actuators, known.actuators).max(axis=1)
    rough = np.flatnonzero(both & (wrong > exact))
    if precision == "float":  # near a dead point the rounding of the pose itself leaves more open
        assert len(rough) <= 0.002 * both.sum()
        assert (wrong[rough] <= ROUNDED * sharpness(mechanism, known.whole[rough])).all()
    else:
        assert not len(rough), wrong[rough].max()
    # nothing is written where a target is not reached
    assert not told.actuators[~reached].any()
    assert (told.poses[~reached, 3:] == np.eye(3).ravel()).all()
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
    least_back, most_others = (0.95, 0.3) if name in closure.ON_ARMS else (0.98, 0.1)
    assert (told.fk[both] == 0).mean() > least_back
    back = both & (told.fk == 0)
    seen = slice(3) if mechanism.end_effector_is_joint else slice(12)
    other = np.flatnonzero(back & (np.abs(told.back - told.poses)[:, seen].max(axis=1) > 10 * exact))
    assert len(other) <= most_others * back.sum()
    if len(other) and precision == "double":
        poses = matrices(told.back[other])
        poses[:, :3, 3] *= mechanism.characteristic_length
        again = pf.solve_ik(mechanism.without_limits(), poses, options=KEEP).actuators
        assert off(mechanism, again, known.actuators[other]).max() < 1e-9
    assert told.steps[both].mean() <= 8.5 or name not in CATALOGUE  # far from home motors go there in two parts


@needs_compiler
def test_the_file_answers_as_the_library_does(file: tuple[str, str]) -> None:
    name, precision = file
    known = truth(name, 300)
    check(name, precision, answers_of(program(name, precision), machine(name), known), known)


@needs_compiler
def test_jacobians_speeds_and_torques_are_the_library_s(file: tuple[str, str]) -> None:
    """Of the library: torques by the transposed forward Jacobian, twists by both Jacobians one after the other."""
    name, precision = file
    if precision == "float":
        pytest.skip("as exact as a machine is far from dead points")
    mechanism, known = machine(name), truth(name, 300)
    known = Truth(*(each[known.closes][:100] for each in known))
    solution = pf.solve_ik(mechanism.without_limits(), known.whole, options=KEEP)
    told = answers_of(program(name, precision), mechanism, known).rates
    rows, n = np.flatnonzero((told[:, 0] == 0) & (solution.status == 0)), len(mechanism.actuator_names)
    assert len(rows) > 30
    inverse, forward = pf.inverse_jacobian(solution[rows]), pf.forward_jacobian(solution[rows])
    if inverse.shape[-1] == 3:
        inverse = np.concatenate([inverse, 0.0 * inverse], axis=2)
        forward = np.concatenate([forward, 0.0 * forward], axis=1)
    allowed, wanted = forward @ inverse, np.arange(1.0, 7.0)
    expected = (
        inverse.reshape(len(rows), -1),
        np.einsum("nia,i->na", forward, wanted),
        allowed @ wanted,
        np.einsum("nij,i->nj", allowed, wanted),
    )
    for one, other in zip(np.split(told[rows, 1:], np.cumsum([6 * n, n, 6]), axis=1), expected, strict=True):
        assert (np.abs(one - other).max(axis=1) <= 1e-9 * np.abs(other).max(axis=1)).all()


@needs_compiler
def test_no_answer_depends_on_the_calls_before(file: tuple[str, str]) -> None:
    """The memory of calls is static: targets asked in another order have the same answers, bit by bit."""
    name, precision = file
    known, turned = Truth(*(each[:60] for each in truth(name, 300))), slice(None, None, -1)
    there = answers_of(program(name, precision), machine(name), known)
    back = answers_of(program(name, precision), machine(name), Truth(*(each[turned] for each in known)))
    for one, other in zip(there, back, strict=True):
        np.testing.assert_array_equal(one, other[turned])


@needs_compiler
def test_the_file_checks_itself(file: tuple[str, str]) -> None:
    assert checks_itself(program(*file)) == (0, PASSED)


@needs_compiler
def test_no_argument_of_any_function_makes_the_file_write_what_is_not_finite(file: tuple[str, str]) -> None:
    survives(program(*file))


@needs_compiler
@pytest.mark.campaign
@pytest.mark.parametrize("precision", EXACT)
@pytest.mark.parametrize("name", [name for name in (*CATALOGUE, *OTHERS) if name != AMBIGUOUS])
def test_the_file_answers_as_the_library_does_on_many_poses(name: str, precision: str) -> None:
    known = truth(name, 20_000)
    for compiler in COMPILERS:
        for standard in ("-std=c99", "-std=c11"):
            options = (standard, "-O1", *sanitizers_of(compiler))
            built = compiled(text_of(name, precision), *options, compiler=compiler)
            check(name, precision, answers_of(built, machine(name), known), known)
            assert checks_itself(built)[0] == 0
            survives(built)


@needs_compiler
@pytest.mark.campaign
@pytest.mark.parametrize("made", [closure.stretched_wrist, closure.five_bar_with_tool])
def test_the_file_reaches_what_is_feasible_where_more_than_one_pose_closes(made: Any) -> None:
    mechanism, random = made(), np.random.default_rng(0)
    near = np.array([1.2 if drive.kind == "angle" else 30.0 for drive in mechanism.drives])
    values = [drive.home for drive in mechanism.drives] + near * random.uniform(-1.0, 1.0, (500, len(near)))
    targets = pf.solve_fk(mechanism, values).pose
    feasible = np.asarray(pf.feasibility(mechanism, targets).margin) > 1e-9
    assert feasible.mean() > 0.3
    built = compiled(c_source(mechanism))
    told = answers_of(built, mechanism, Truth(targets, targets, feasible, values, np.zeros(0)))
    assert not told.ik[feasible].any()
    apart = told.poses[:, :3] - targets[:, :3, 3] / mechanism.characteristic_length
    assert np.abs(apart[feasible] * task_of(mechanism).axes).max() < 1e-12
    assert checks_itself(built) == (0, PASSED)


# --- self-tests ------------------------------------------------------------------------------------------------------


@needs_compiler
def test_a_file_checks_itself_with_poses_that_have_one_answer_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(source, "N_TRIED", 150)
    text = c_source(closure.stretched_wrist(), parts=("ik", "limits"))
    assert checks_itself(compiled(text, driver=None)) == (0, PASSED)


@needs_compiler
def test_a_self_test_fails_where_the_machine_is_another() -> None:
    text, place = text_of("stewart"), "/* base_end_point */ {"
    code, words = checks_itself(compiled(text.replace(place, f"{place}1.0 + ", 1), driver=None))
    assert code == 1 and "actuators of pose 0" in words and "torques 0" in words


@needs_compiler
@pytest.mark.parametrize(
    ("function", "said"), [("nearest", "target out of reach 0"), ("fk", "back to pose"), ("torques", "torques 0")]
)
def test_a_self_test_fails_where_a_function_is_another(function: str, said: str) -> None:
    """One whose first number is twice what it should be."""
    text = text_of("stewart")
    (head,) = re.findall(rf"^(int pfk_{function}\((?:[^()]*)\))\n\{{", text, re.MULTILINE)
    name = {"nearest": "pose->p[0]", "fk": "pose->p[0]", "torques": "torques[0]"}[function]
    given = ", ".join(re.findall(r"(\w+)(?:\[\w*\])?(?:,|\)$)", head.partition("(")[2]))
    other = head.replace(f"pfk_{function}", f"pfk_other_{function}")
    body = f"    const int code = pfk_other_{function}({given});\n    {name} *= 2.0;\n    return code;\n"
    caller = f"{head}\n{{\n{body}}}\n"
    place = text.index("#ifdef PFK_SELF_TEST\n")
    before = text[:place].replace(f"\n{head}\n{{", f"\nstatic {other}\n{{")
    code, words = checks_itself(compiled(f"{before}{caller}{text[place:]}", driver=None))
    assert code == 1 and said in words


def test_the_most_parts_of_a_way_are_as_many_as_the_file_tells() -> None:
    """Of all ways in which legs may close and not: each part twice as long as one that closes, half as long else."""

    @cache
    def most(way: float, share: float) -> int:
        if way >= 1.0 or share < SHORTEST_SHARE:
            return 0
        return 1 + max(most(way + share, min(2.0 * share, 1.0 - way - share)), most(way, 0.5 * share))

    assert most(0.0, 0.5) == MOST_PARTS
    assert "pfk_ik takes at most 8 Newton steps" in text_of("delta", "float")


def slide(name: str = "J", **more: Any) -> pf.Mechanism:
    """A platform that slides, the smallest machine."""
    joint = pf.Joint(name, "prismatic", ("base", "platform"), axis=(0, 0, 1), actuated=True, **more)
    return pf.Mechanism("evil */ int x;", [joint], "platform", (0, 0, 0), task=("z",))


@needs_compiler
def test_a_self_test_says_so_where_nothing_can_be_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(source, "N_POSES", 0)
    words = "nothing is checked: no pose near home has one answer alone\n"
    assert checks_itself(compiled(c_source(slide(), parts=("ik",)), driver=None)) == (2, words)


@needs_compiler
def test_names_of_joints_cannot_leave_comments_or_strings() -> None:
    compiled(c_source(slide('a */ "\\ ??/ é', range=(-1, 1)), parts=WITHOUT_NEAREST))


@needs_compiler
def test_a_machine_without_any_limit_has_a_file_that_compiles_and_checks_itself() -> None:
    assert checks_itself(compiled(c_source(slide()))) == (0, PASSED)


def test_numbers_too_small_for_single_precision_are_nothing() -> None:
    assert in_words("a = 1e-60 + 2e-38 + 0.0;", "pfk", "float") == "a = 0.0f + 2e-38f + 0.0f;"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the file of a delta, as the command writes it."""
    folder = tmp_path_factory.mktemp("delta")
    result = CliRunner().invoke(main, ["export", "linear_delta", "c", "-o", f"{folder}/delta.c", "--name", "delta"])
    assert result.exit_code == 0
    return folder


@needs_compiler
def test_the_command_that_the_file_and_the_page_tell_runs_the_self_test(folder: Path) -> None:
    page = Path(__file__).parents[1] / "docs" / "your-controller.md"
    said, told = (
        re.search(r"^ +(cc .*-D.*SELF_TEST delta.c .*)$", path.read_text(encoding="utf-8"), re.MULTILINE)
        for path in (folder / "delta.c", page)
    )
    assert said is not None and told is not None and told[1] == said[1]
    command = said[1].replace("cc", COMPILERS[0], 1).replace(" -O2", "")
    ran = subprocess.run(["sh", "-c", command], cwd=folder, capture_output=True, text=True)
    assert (ran.stdout, ran.stderr) == (PASSED, "")


# --- C++, and what a file needs --------------------------------------------------------------------------------------


@pytest.mark.skipif(not shutil.which("g++"), reason="no C++ compiler here")
def test_the_file_is_cpp_too_and_arms_that_follow_in_more_than_one_way_do_so_in_home_s() -> None:
    built = compiled(text_of(AMBIGUOUS, parts=WITHOUT_NEAREST), "-std=c++11", "-xc++", compiler="g++", driver=None)
    assert checks_itself(built) == (0, PASSED)


@pytest.mark.skipif(not COMPILERS or not all(map(shutil.which, ("g++", "nm"))), reason="no C, C++ and nm here")
def test_a_program_in_cpp_calls_the_file_compiled_as_c_which_needs_mathematics_alone(folder: Path) -> None:
    (folder / "main.cpp").write_text(
        '#include "delta.h"\n#include <cstdio>\n'
        "int main() { delta_pose pose; double found[DELTA_ACTUATORS]; delta_home(&pose); pose.p[2] += 1.0;"
        " static delta_memory own; delta_begin(&own);"
        " delta_pose out = pose; if (delta_ik(&own, &pose, &out, found)) return 1;"
        ' std::printf("%.12g %.12g %.12g", found[0], found[1], found[2]); }'
    )
    for command in (
        [COMPILERS[0], "-std=c99", "-O1", "-c", "delta.c"],
        ["g++", "-std=c++17", "-Wall", "-Werror", "main.cpp", "delta.o", "-o", "main", "-lm"],
    ):
        subprocess.run(command, cwd=folder, check=True)
    told = subprocess.run([str(folder / "main")], capture_output=True, text=True, check=True).stdout
    lifted = pf.solve_ik(machine("linear_delta"), machine("linear_delta").home_pose[:3, 3] + [0, 0, 1])
    np.testing.assert_allclose([float(word) for word in told.split()], lifted.actuators, rtol=1e-9)
    # nothing but mathematics, no name that another file could see, and nothing static that is written
    listed = subprocess.run(["nm", "delta.o"], cwd=folder, capture_output=True, text=True, check=True).stdout
    symbols = [line.split()[-2:] for line in listed.splitlines()]
    assert not [name for kind, name in symbols if kind in "BDCb"]
    assert {name for kind, name in symbols if kind == "U"} <= MATHEMATICS
    assert all(name.startswith("delta_") for kind, name in symbols if kind in "Tbd")


# --- parts -----------------------------------------------------------------------------------------------------------

FUNCTIONS = dict(
    zip(PARTS, ("ik", "limits", "fk", "jacobian", "nearest", "live_tick", "bodies", "effort"), strict=True)
)
CHOICES: list[Any] = [("prs", ("ik",)), ("delta with a shaft", ("limits", "fk")), ("stewart", ("bodies",))]
CHOICES += [
    pytest.param(name, parts, marks=pytest.mark.campaign)
    for name in ("stewart", "prs", "delta with a shaft")
    for parts in (("ik",), ("limits",), ("fk",), ("rates",), ("ik", "limits"), ("limits", "fk"), ("ik", "fk"))
]


@needs_compiler
@pytest.mark.parametrize(("name", "parts"), CHOICES)
def test_any_choice_of_parts_is_all_that_is_there_and_compiles_without_a_warning(
    name: str, parts: Any, tmp_path: Path
) -> None:
    text = c_source(machine(name), parts=parts)
    assert {part for part, function in FUNCTIONS.items() if f"int pfk_{function}(" in text} == set(parts)
    (tmp_path / "exported.c").write_text(text)
    command = [COMPILERS[0], "-std=c99", "-O2", *STRICT, "-c", "exported.c", "-o", "exported.o"]
    assert subprocess.run(command, cwd=tmp_path, capture_output=True, text=True).stderr == ""


def test_nearest_is_of_ik_and_limits() -> None:
    with pytest.raises(InvalidArgument, match="'ik' and 'limits' too"):
        c_source(machine("stewart"), parts=("ik", "nearest"))


# --- what has no code ------------------------------------------------------------------------------------------------


@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
@pytest.mark.parametrize(("name", "said"), REFUSED.items())
def test_chains_without_code_are_refused_by_name_and_nothing_is_written(name: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(UnsupportedMechanism) as caught:
        pf.export_c(machine(name), tmp_path / "machine.c")
    assert said in str(caught.value)
    assert "cannot be exported" in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_what_a_refusal_says_would_help_helps() -> None:
    """Redundant joints that are fixed; the body above the joint that carries a pivot, as the base."""
    redundant = machine("nrpm")
    fixed = [
        pf.Joint(each.name, "fixed", each.connects, each.at or (0, 0, 0)) if each.name[0] in "AB" else each
        for each in redundant.joints
    ]
    assert "pfk_ik(" in c_source(dataclasses.replace(redundant, joints=fixed), parts=["ik"])
    whole = waist()
    with pytest.raises(UnsupportedMechanism, match="body that joint yaw carries as the base"):
        c_source(whole)
    (carried,) = {*whole.joint("yaw").connects} - {whole.base}
    above = [each for each in whole.joints if each.name != "yaw"]
    assert "pfk_ik(" in c_source(dataclasses.replace(whole, joints=above, base=carried), parts=["ik"])


@pytest.mark.parametrize(
    ("name", "task"), [("canfield", ("x", "y")), ("canfield", ("tilt",)), ("g1_ankle", ("x", "y"))]
)
def test_actuators_that_the_task_leaves_to_a_choice_are_not_exported(name: str, task: tuple[str, ...]) -> None:
    text = re.sub("(?m)^task.*", "", dumps(machine(name)))
    chosen = loads(re.sub("(?m)^schema.*", f"schema = 1\ntask = {[*task]}", text))
    with pytest.raises(UnsupportedMechanism, match=r"leaves motions open.*--parts"):
        c_source(chosen)
    assert name != "g1_ankle" or "pfk_fk" in c_source(chosen, parts=("limits", "fk", "rates"))
