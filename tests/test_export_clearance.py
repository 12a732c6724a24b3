"""The exported C keeps links apart: its distances are those that the library measures on the same poses."""

from __future__ import annotations

import re
import shutil
import subprocess
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from pfabrik.description.links import links_of
from pfabrik.errors import UnsupportedMechanism
from pfabrik.export.export_c import c_source
from pfabrik.export.firmware_settings import klipper
from pfabrik.export.linuxcnc import linuxcnc
from pfabrik.export.self_test import targets_around_home
from pfabrik.export.tensors import tensor_source
from test_controllers import STUBS
from test_export_c import COMPILERS, MATHEMATICS, STRICT, compiled, flat, needs_compiler, slack_of

Array = np.ndarray
SANITIZED = ("-std=c99", "-O0", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
KEEP = pf.Options(working_mode="keep")
PAIR = 10_000
EXACT = {"double": 1e-12, "float": 1e-5}


def hexaglide() -> pf.Mechanism:
    machine = pf.load("hexaglide")
    rods = [pf.Shape(body, thickness=8) for body in machine.bodies if body.startswith("rod")]
    return machine.with_shapes(rods).with_clearance(12.0)


def delta() -> pf.Mechanism:
    """A delta with thick arms and forearms, and a tool that comes near beams below it."""
    machine = pf.load("delta")
    tip = np.array(machine.reference_point)
    shapes = [pf.Shape(body, thickness=8) for body in machine.bodies if body.startswith("rod")]
    for k in (1, 2, 3):
        elbow = 0.5 * (np.array(machine.joint(f"BL{k}").at) + machine.joint(f"BR{k}").at)
        shapes.append(pf.Shape(f"arm{k}", ends=(machine.joint(f"A{k}").at, elbow), thickness=14))
    shapes.append(pf.Shape("platform", ends=(tip, tip - [0, 0, 60]), thickness=40))
    shapes += [pf.Shape("base", ends=((-100, y, -225), (100, y, -225)), thickness=20) for y in (-60, 0, 60)]
    return machine.with_shapes(shapes).with_clearance(11.0)


def hexapod(thickness: float = 20.0, clearance: float | None = 8.5, **more: Any) -> pf.Mechanism:
    return pf.Mechanism.from_legs(
        "U-P*-S",
        base=[[100, 20, 0], [100, -20, 0]],
        platform=[[40, 40, 195], [40, -40, 195]],
        stroke=(155, 280),
        copies={"count": 3, "axis": [0, 0, 1]},
        reference_point=[0, 0, 195],
        thickness=thickness,
        clearance=clearance,
        **more,
    )


def with_solids() -> pf.Mechanism:
    """Every two of box, disc, sphere and capsule, which overlap at some poses."""
    x, y = (0.6, 0.8, 0.0), (0.0, 0.0, 1.0)
    on_base = [
        pf.Shape("base", "box", at=(-25, 8, 138), size=(30, 44, 50), axes=(x, y)),
        pf.Shape("base", "disc", at=(30, -12, 150), axis=(0.3, 0.2, 1.0), diameter=46, thickness=22),
    ]
    on_platform = [
        pf.Shape("platform", "disc", at=(-28, 0, 198), axis=(0.2, 0.0, 1.0), diameter=52, thickness=12),
        pf.Shape("platform", "box", at=(24, -4, 202), size=(40, 20, 24), axes=(x, y)),
        pf.Shape("platform", "sphere", at=(2, 16, 185), diameter=14),
    ]
    return hexapod(4.0, 2.0, shapes=[*on_base, *on_platform])


def with_all_bodies() -> pf.Mechanism:
    """Capsules beside the lines of cylinders and rods, whose places take the angles of their hinges."""
    machine = pf.load("stewart")
    shapes = []
    for k, body in enumerate(body for body in machine.bodies if body not in ("base", "platform")):
        at = next(np.array(joint.at) for joint in machine.joints if body in joint.connects and joint.at is not None)
        side, up = np.array([np.cos(k), np.sin(k), 0.0]), np.array([0.0, 0.0, 18.0 if "cylinder" in body else -18.0])
        shapes.append(pf.Shape(body, ends=(at + 6 * side + up, at - 4 * side + 2 * up), thickness=4))
    return machine.with_shapes(shapes).with_clearance(16.0)


def between_balls() -> pf.Mechanism:
    """Struts that may spin between two balls, with thick cylinders, thin rods and collars on their lines."""
    machine = pf.Mechanism.from_legs(
        "S-P*-S",
        base=[[100, 20, 0], [100, -20, 0]],
        platform=[[40, 40, 195], [40, -40, 195]],
        copies={"count": 3, "axis": [0, 0, 1]},
        reference_point=[0, 0, 195],
        stroke=(155, 280),
    )
    shapes = []
    for k in range(1, 7):
        start, end = (np.array(machine.joint(f"{joint}{k}").at) for joint in "AC")
        line = end - start
        shapes.append(pf.Shape(f"AB{k}", ends=(start, start + 0.5 * line), thickness=16))
        shapes.append(pf.Shape(f"BC{k}", ends=(start + 0.4 * line, end), thickness=8))
        collar = pf.Shape(f"BC{k}", "disc", at=start + 0.9 * line, axis=line, diameter=20, thickness=6)
        shapes += [pf.Shape(f"BC{k}", "sphere", at=start + 0.8 * line, diameter=18), collar][: k % 3]
    return machine.with_shapes(shapes).with_clearance(18.0)


MACHINES = {
    "between balls": between_balls,
    "hexaglide": hexaglide,
    "delta": delta,
    "hexapod": hexapod,
    "solids": with_solids,
    "all bodies": with_all_bodies,
}


@lru_cache
def machine(name: str) -> pf.Mechanism:
    return MACHINES[name]()


@lru_cache
def text_of(name: str, precision: Any = "double") -> str:
    return c_source(machine(name), precision=precision)


class Truth(NamedTuple):
    """Poses that legs reach, and what the library measures there, limits and clearance left out."""

    poses: Array
    actuators: Array
    slack: Array
    distances: Array
    pairs: Array


@lru_cache
def truth(name: str, count: int = 400) -> Truth:
    mechanism = machine(name)
    free = mechanism.with_clearance(None).without_limits()
    found = pf.solve_ik(free, targets_around_home(mechanism, count, np.random.default_rng(5)), options=KEEP)
    found = found[found.status == 0]
    apart = pf.clearance(found)
    home = np.concatenate([np.ravel(mechanism.home_coordinate(joint.name)) for joint in mechanism.joints])
    slack = slack_of(mechanism, found.q, home)
    names = np.array([" and ".join(names) for names in np.asarray(apart.links)])
    return Truth(found.pose.copy(), found.actuators.copy(), slack, np.asarray(apart.distance), names)


def distances_between(mechanism: pf.Mechanism, names: str, poses: Array) -> Array:
    """The distances of one pair of links, all others left out."""
    pairs = [tuple(mechanism.shapes[k].body for k in pair) for pair in links_of(mechanism).pairs]
    others = {pair for pair in pairs if set(pair) != set(names.split(" and "))}
    alone = mechanism.with_clearance(None).without_limits().with_shapes(mechanism.shapes, [*mechanism.ignore, *others])
    return np.asarray(pf.clearance(pf.solve_ik(alone, poses, options=KEEP)).distance)


DRIVER = """
#include EXPORTED
#include <stdio.h>
int main(void)
{
    double x[12], codes[4], measured[2];
    while (fread(x, sizeof(double), 12, stdin) == 12) {
        pfk_real actuators[PFK_ACTUATORS], slack[PFK_LIMITS + 1], distance = 0;
        pfk_pose target, pose, back;
        int i, j, pair = 0;
        for (i = 0; i < 3; ++i)
            for (target.p[i] = (pfk_real)x[i], j = 0; j < 3; ++j)
                target.R[i][j] = (pfk_real)x[3 + 3 * i + j];
        for (i = 0; i < PFK_ACTUATORS; ++i)
            actuators[i] = 0;
        pfk_home(&pose);
        codes[0] = pfk_ik(&target, &pose, actuators);
        codes[1] = pfk_limits(&target, slack);
        codes[2] = pfk_clearance(&target, &distance, &pair);
        for (i = 0; i < PFK_ACTUATORS; ++i) {
            double given;
            if (fread(&given, sizeof(double), 1, stdin) != 1)
                return 1;
            actuators[i] = (pfk_real)given;
        }
        back = target;
        codes[3] = pfk_fk(actuators, &back, 0);
        measured[0] = (double)distance;
        measured[1] = pair;
        fwrite(codes, sizeof(double), 4, stdout);
        fwrite(measured, sizeof(double), 2, stdout);
        for (i = 0; i < 3; ++i) {
            measured[0] = (double)(back.p[i] - target.p[i]);
            fwrite(measured, sizeof(double), 1, stdout);
        }
        fprintf(stderr, "%s\\n", pfk_what(PFK_PAIR + pair));
    }
    return 0;
}
"""


class Answers(NamedTuple):
    """What a file said, one row a pose; `words` of the nearest pair."""

    ik: Array
    limits: Array
    clearance: Array
    fk: Array
    distances: Array
    pairs: Array
    back: Array
    words: list[str]


def answers_of(name: str, folder: Path, precision: str = "double", options: tuple[str, ...] = SANITIZED) -> Answers:
    known, driver = truth(name), folder / "driver.c"
    driver.write_text(DRIVER)
    program = compiled(folder, text_of(name, precision), COMPILERS[0], *options, driver=driver)
    given = np.concatenate([flat(known.poses), known.actuators], axis=1)
    run = subprocess.run([str(program)], input=given.tobytes(), capture_output=True)
    assert run.returncode == 0, run.stderr.decode()[-2000:]
    said = np.frombuffer(run.stdout).reshape(len(given), -1)
    return Answers(*said[:, :4].astype(int).T, *said[:, 4:6].T, said[:, 6:], run.stderr.decode().splitlines())


@needs_compiler
@pytest.mark.parametrize(
    ("name", "precision"), [*((name, "double") for name in MACHINES), ("delta", "float"), ("solids", "float")]
)
def test_the_file_measures_what_the_library_does_and_answers_where_links_are_apart(
    name: str, precision: str, tmp_path: Path
) -> None:
    mechanism, known = machine(name), truth(name)
    size, exact = mechanism.characteristic_length, EXACT[precision]
    said = answers_of(name, tmp_path, precision, SANITIZED if precision == "double" else ("-std=c99", "-O1"))
    np.testing.assert_allclose(said.distances / size, known.distances / size, rtol=0, atol=exact)
    # the verdict, but where rounding decides
    room = (known.distances - mechanism.clearance) / size
    is_sure, is_apart = np.abs(room + 1e-9) > exact, room >= -1e-9
    is_within = (known.slack >= -1e-9).all(axis=1)
    is_sure &= (np.abs(known.slack + 1e-9) > exact).all(axis=1)
    assert 0.02 < np.mean(~is_apart) < 0.98 and (is_apart & is_within).any() and (~is_apart & is_within).any()
    for codes in (said.ik, said.limits):
        np.testing.assert_array_equal((codes == 0)[is_sure], (is_apart & is_within)[is_sure])
        np.testing.assert_array_equal((codes > PAIR)[is_sure], (~is_apart & is_within)[is_sure])
    for codes in (said.clearance, said.fk):
        np.testing.assert_array_equal((codes == 0)[is_sure], is_apart[is_sure])
        np.testing.assert_array_equal((codes > PAIR)[is_sure], ~is_apart[is_sure])
    # which pair it is, by its number and in words
    too_near = said.clearance > PAIR
    np.testing.assert_array_equal(said.clearance[too_near], PAIR + said.pairs[too_near])
    named = np.array([words.removeprefix("links too near: ") for words in said.words])
    assert np.mean(named == known.pairs) > 0.3
    for names in set(named[named != known.pairs]):  # pairs that are as near, by symmetry
        rows = named == names
        np.testing.assert_allclose(
            distances_between(mechanism, names, known.poses[rows]) / size, said.distances[rows] / size, atol=2 * exact
        )
    # forward kinematics tell the pose all the same
    assert np.abs(said.back[said.fk != -3]).max() <= 100 * exact * size


@needs_compiler
@pytest.mark.parametrize("name", ["hexapod", "solids"])
def test_the_file_checks_its_distances_and_finds_links_of_another_thickness(name: str, tmp_path: Path) -> None:
    text = text_of(name)
    rows = re.findall(r"^    \{\{\{.*, ([01]), (\S+)\},?$", text, re.MULTILINE)
    assert len(rows) == 50 and {kept for kept, _ in rows} == {"0", "1"}
    assert any(float(distance) < machine(name).clearance for _, distance in rows)
    program = compiled(tmp_path, text, COMPILERS[0], *SANITIZED, driver=None)
    run = subprocess.run([str(program)], capture_output=True, text=True)
    assert (run.returncode, run.stdout, run.stderr) == (0, "50 poses, 0 wrong\n", "")
    wrong = re.sub(r"(pfk_reaching_links_sizes\[\d+\] = \{\s+\S+ )", r"\1 0.001 + ", text)  # of the first, all around
    run = subprocess.run([str(compiled(tmp_path, wrong, COMPILERS[0], driver=None))], capture_output=True, text=True)
    assert run.returncode == 1 and ", links: " in run.stdout


def test_a_machine_without_a_clearance_is_exported_as_one_without_thickness() -> None:
    bare, thick = hexapod(clearance=None).with_shapes(()), hexapod(clearance=None)
    assert c_source(thick) == c_source(bare)
    assert "PAIR" not in c_source(bare)


def test_links_are_kept_apart_where_limits_are() -> None:
    text = c_source(hexapod(), parts=("ik", "fk"))
    assert "PFK_PAIR" not in text
    assert "Links may be too near: the clearance of the machine is kept where limits are." in text
    text = c_source(hexapod())
    assert re.search(r"^   2 +BC1 and BC3 +8.5 mm$", text, re.MULTILINE)
    assert re.search(r"^#define PFK_CLEARANCE 8.5 ", text, re.MULTILINE)


@needs_compiler
@pytest.mark.parametrize("parts", [("limits",), ("ik", "limits"), ("limits", "fk"), ("limits", "rates")])
def test_any_choice_of_parts_with_links_compiles_without_a_warning(parts: Any, tmp_path: Path) -> None:
    for name in ("hexapod", "solids"):
        exported = tmp_path / "exported.c"
        exported.write_text(c_source(machine(name), parts=parts))
        command = [COMPILERS[0], "-std=c99", *STRICT, "-c", str(exported), "-o", str(tmp_path / "exported.o")]
        assert subprocess.run(command, capture_output=True, text=True).stderr == ""


@pytest.mark.skipif(not all(map(shutil.which, ("g++", "gcc", "nm"))), reason="no gcc, g++ and nm here")
def test_the_file_with_links_is_cpp_too_and_needs_mathematics_alone(tmp_path: Path) -> None:
    program = compiled(tmp_path, text_of("solids"), "g++", "-std=c++11", "-xc++", driver=None)
    assert subprocess.run([str(program)], capture_output=True, text=True).stdout == "50 poses, 0 wrong\n"
    subprocess.run(["gcc", "-std=c99", "-O1", "-c", "exported.c"], cwd=tmp_path, check=True)
    listed = subprocess.run(["nm", "exported.o"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    symbols = [line.split()[-2:] for line in listed.splitlines()]
    assert not [name for kind, name in symbols if kind in "BDC"]  # none that another file could see
    assert {name for kind, name in symbols if kind == "U"} <= MATHEMATICS


JOINTS_DRIVER = """
#include EXPORTED
#include <stdio.h>
int main(void)
{
    double q[PFK_JOINTS], out[2 + PFK_JOINTS];
    while (fread(q, sizeof(double), PFK_JOINTS, stdin) == PFK_JOINTS) {
        double x[PFK_ACTUATORS] = {0};
        int j;
        out[0] = pfk_to_actuators(q, x);
        for (j = 0; j < PFK_ACTUATORS; ++j)
            if (fread(&x[j], sizeof(double), 1, stdin) != 1)
                return 1;
        for (j = 0; j < PFK_JOINTS; ++j)
            out[2 + j] = 0.0;
        out[1] = pfk_to_joints(x, out + 2, 0);
        fwrite(out, sizeof(double), 2 + PFK_JOINTS, stdout);
    }
    return 0;
}
"""


@needs_compiler
def test_joints_in_series_are_answered_where_links_are_apart(tmp_path: Path) -> None:
    joints, free = ("pitch_joint", "roll_joint"), pf.load("g1_ankle")
    rods = [
        pf.Shape(f"{side}_connect_link", between=(f"{side}_connect_joint", closing), thickness=0.006)
        for side, closing in (("right", "closure_1"), ("left", "closure_2"))
    ]
    free = free.with_shapes([*rods, pf.Shape("base", "sphere", at=(0.05, 0.0, 0.22), diameter=0.03)])
    mechanism, driver = free.with_clearance(0.0083), tmp_path / "driver.c"
    q = np.random.default_rng(0).uniform([-0.5, -0.2], [0.4, 0.2], (300, 2))
    poses = np.tile(np.eye(4), (len(q), 1, 1))
    poses[:, :3, :3] = Rotation.from_euler("YX", q).as_matrix()
    found = pf.solve_ik(free, poses)
    assert (found.status == 0).all()
    is_apart = np.asarray(pf.clearance(found).distance) >= 0.0083
    assert 0.2 < is_apart.mean() < 0.8
    driver.write_text(JOINTS_DRIVER)
    program = compiled(tmp_path, c_source(mechanism, joints=joints), COMPILERS[0], *SANITIZED, driver=driver)
    given = np.concatenate([q, found.actuators], axis=1)
    run = subprocess.run([str(program)], input=given.tobytes(), capture_output=True, check=True)
    said = np.frombuffer(run.stdout).reshape(-1, 4)
    for codes in said[:, :2].T:
        np.testing.assert_array_equal(codes == 0, is_apart)
        np.testing.assert_array_equal(codes > PAIR, ~is_apart)
    np.testing.assert_allclose(said[:, 2:], q, atol=1e-9)


def test_links_that_turn_as_no_leg_says_are_refused_by_name() -> None:
    machine = pf.load("linear_delta")
    rod = 0.5 * (np.array(machine.joint("BL1").at) + machine.joint("CL1").at) + [4, 0, 0]
    shapes = [pf.Shape("rodL1", "sphere", at=rod, diameter=3), pf.Shape("base", "sphere", at=(0, 0, -40), diameter=9)]
    machine = machine.with_shapes(shapes).with_clearance(1.0)
    with pytest.raises(UnsupportedMechanism) as caught:
        c_source(machine)
    assert "cannot be exported with its clearance: body 'rodL1' turns in ways that no leg has" in str(caught.value)
    for way in ("name two joints in `between`", "the line of its rod", "in `ignore`", "without the part 'limits'"):
        assert way in str(caught.value)
    assert "PAIR" not in c_source(machine, parts=("ik", "fk"))


MAIN = """
#include <stdio.h>
int hal_init(const char *name) { (void)name; return 1; }
int hal_ready(int id) { (void)id; return 0; }
int hal_exit(int id) { (void)id; return 0; }
int main(void)
{
    double joints[16] = {0}, numbers[6];
    while (fread(numbers, sizeof(double), 6, stdin) == 6) {
        EmcPose world = {{numbers[0], numbers[1], numbers[2]}, numbers[3], numbers[4], numbers[5], 0, 0, 0};
        EmcPose back = world;
        printf("%d ", kinematicsInverse(&world, joints, 0, 0));
        if (fread(joints, sizeof(double), 6, stdin) != 6)
            return 1;
        printf("%d\\n", kinematicsForward(joints, &back, 0, 0));
    }
    return 0;
}
"""


@needs_compiler
def test_a_module_for_linuxcnc_refuses_what_is_too_near(tmp_path: Path) -> None:
    mechanism = hexapod()
    assert "genhexkins" in linuxcnc(mechanism.with_clearance(None))
    for name, text in STUBS.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "module.c").write_text(linuxcnc(mechanism) + MAIN)
    command = [COMPILERS[0], "-std=c99", "-Wall", "-I.", "module.c", "-o", "module", "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True)
    known = truth("hexapod")
    rows = (known.slack > 1e-6).all(axis=1)
    angles = Rotation.from_matrix(known.poses[rows, :3, :3]).as_euler("xyz", degrees=True)
    given = np.concatenate([known.poses[rows, :3, 3], angles, known.actuators[rows]], axis=1)
    run = subprocess.run([str(tmp_path / "module")], input=given.tobytes(), capture_output=True, check=True)
    said = np.array(run.stdout.split(), int).reshape(-1, 2)
    expected = np.where(known.distances[rows] >= mechanism.clearance, 0, -1)
    assert set(expected) == {0, -1}
    np.testing.assert_array_equal(said, np.stack([expected, expected], axis=1))


def test_exports_that_keep_no_clearance_say_so() -> None:
    machine = pf.load("linear_delta")
    rods = [pf.Shape(body, thickness=2) for body in machine.bodies if body.startswith("rod")]
    thick = machine.with_shapes(rods).with_clearance(0.5)
    assert "# - the clearance between links, 0.5 mm" in klipper(thick)
    assert klipper(thick.with_clearance(None)) == klipper(machine)
    words = "Links may be nearer than the machine's clearance, 0.5 mm: that is no limit of `margin`."
    assert words in tensor_source(thick)
    assert tensor_source(thick.with_clearance(None)) == tensor_source(machine)
