"""The exported C keeps links apart: its distances are those that the library measures on the same poses."""

from __future__ import annotations

import re
import shutil
import subprocess
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from exported import (
    COMPILERS,
    EXACT,
    KEEP,
    PASSED,
    STRICT,
    WITHOUT_NEAREST,
    Truth,
    answers_of,
    asked,
    checks_itself,
    compiled,
    needs_compiler,
    sanitizers_of,
    slack_of,
    survives,
)
from pfabrik.errors import UnsupportedMechanism
from pfabrik.exchange.export.export_c import c_source
from pfabrik.exchange.export.firmware_settings import klipper
from pfabrik.exchange.export.linuxcnc import linuxcnc
from pfabrik.exchange.export.source import targets_around_home
from pfabrik.exchange.export.tensors import tensor_source
from pfabrik.machine.description.links import links_of

Array = np.ndarray
PAIR = 10_000


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
    "solids": with_solids,
    "all bodies": with_all_bodies,
}


@cache
def machine(name: str) -> pf.Mechanism:
    return MACHINES[name]()


@cache
def text_of(name: str, precision: Any) -> str:
    """With all parts of a delta: the search for the nearest pose is most of a file, whatever the machine."""
    return c_source(machine(name), precision=precision, parts=None if name == "delta" else WITHOUT_NEAREST)


class Measured(NamedTuple):
    """Poses that legs reach, and what the library measures there, limits and clearance left out."""

    known: Truth
    distances: Array
    pairs: Array


@cache
def measured(name: str, count: int = 300) -> Measured:
    mechanism = machine(name)
    free = mechanism.with_clearance(None).without_limits()
    found = pf.solve_ik(free, targets_around_home(mechanism, count, np.random.default_rng(5)), options=KEEP)
    found = found[found.status == 0]
    apart, poses = pf.clearance(found), found.pose.copy()
    known = Truth(poses, poses, found.status == 0, found.actuators.copy(), slack_of(mechanism, found.q))
    names = np.array([" and ".join(names) for names in np.asarray(apart.links)])
    return Measured(known, np.asarray(apart.distance), names)


def distances_between(mechanism: pf.Mechanism, names: str, poses: Array) -> Array:
    """The distances of one pair of links, all others left out."""
    pairs = [tuple(mechanism.shapes[k].body for k in pair) for pair in links_of(mechanism).pairs]
    others = {pair for pair in pairs if set(pair) != set(names.split(" and "))}
    alone = mechanism.with_clearance(None).without_limits().with_shapes(mechanism.shapes, [*mechanism.ignore, *others])
    return np.asarray(pf.clearance(pf.solve_ik(alone, poses, options=KEEP)).distance)


@needs_compiler
@pytest.mark.parametrize(
    ("name", "precision"),
    [
        ("between balls", "double"),
        ("delta", "float"),
        ("solids", "double"),
        ("all bodies", "double"),
        *(
            pytest.param(*each, marks=pytest.mark.campaign)
            for each in (("hexaglide", "double"), ("delta", "double"), ("solids", "float"))
        ),
    ],
)
def test_the_file_measures_what_the_library_does_and_answers_where_links_are_apart(name: str, precision: str) -> None:
    mechanism, (known, distances, pairs) = machine(name), measured(name)
    size, exact = mechanism.characteristic_length, EXACT[precision]
    options = sanitizers_of(COMPILERS[0]) if name == "solids" else ()
    program = compiled(text_of(name, precision), *options)
    survives(program)
    said = answers_of(program, mechanism, known, "there")
    codes, measured_there, numbers = said.distances.T
    np.testing.assert_allclose(measured_there / size, distances / size, rtol=0, atol=exact)
    # the verdict, but where rounding decides
    room = (distances - mechanism.clearance) / size
    is_sure, is_apart = np.abs(room + 1e-9) > exact, room >= -1e-9
    is_within = (known.slack >= -1e-9).all(axis=1)
    is_sure &= (np.abs(known.slack + 1e-9) > exact).all(axis=1)
    assert 0.02 < np.mean(~is_apart) < 0.98 and (is_apart & is_within).any() and (~is_apart & is_within).any()
    for verdicts in (said.ik, said.limits):
        np.testing.assert_array_equal((verdicts == 0)[is_sure], (is_apart & is_within)[is_sure])
        np.testing.assert_array_equal((verdicts > PAIR)[is_sure], (~is_apart & is_within)[is_sure])
    for verdicts in (codes, said.fk):
        np.testing.assert_array_equal((verdicts == 0)[is_sure], is_apart[is_sure])
        np.testing.assert_array_equal((verdicts > PAIR)[is_sure], ~is_apart[is_sure])
    # which pair it is, by its number and in words
    too_near = codes > PAIR
    np.testing.assert_array_equal(codes[too_near], PAIR + numbers[too_near])
    named = np.array([words.removeprefix("links too near: ") for words in said.words])
    assert np.mean(named == pairs) > 0.3
    for names in set(named[named != pairs]):  # pairs that are as near, by symmetry
        rows = named == names
        there = distances_between(mechanism, names, known.whole[rows])
        np.testing.assert_allclose(there / size, measured_there[rows] / size, atol=2 * exact)
    # forward kinematics tell the pose all the same
    apart = said.back[:, :3] - known.whole[:, :3, 3] / size
    assert np.abs(apart[said.fk != -3]).max() <= 100 * exact
    assert checks_itself(program) == (0, PASSED)


@needs_compiler
def test_the_self_test_compares_distances_and_finds_links_of_another_thickness() -> None:
    text = text_of("solids", "double")
    rows = re.findall(r"^    \{\{\{.*, ([01]), [01], (\S+)\},?$", text, re.MULTILINE)
    assert len(rows) == 50 and {kept for kept, _ in rows} == {"0", "1"}
    assert any(float(distance) < machine("solids").clearance for _, distance in rows)
    wrong = re.sub(r"(pfk_reaching_links_sizes\[\d+\] = \{\s+\S+ )", r"\1 0.001 + ", text)  # of the first, all around
    code, words = checks_itself(compiled(wrong, driver=None))
    assert code == 1 and "links at pose" in words


def test_a_machine_without_a_clearance_is_exported_as_one_without_thickness() -> None:
    bare, thick = hexapod(clearance=None).with_shapes(()), hexapod(clearance=None)
    text = c_source(bare, parts=("limits",))
    assert c_source(thick, parts=("limits",)) == text
    assert "PAIR" not in text


def test_links_are_kept_apart_where_limits_are() -> None:
    text = c_source(hexapod(), parts=("fk",))
    assert "PFK_PAIR" not in text
    assert "Links may be too near: the clearance of the machine is kept where limits are." in text
    text = c_source(hexapod(), parts=("limits",))
    assert re.search(r"^   2 +BC1 and BC3 +8.5 mm$", text, re.MULTILINE)
    assert re.search(r"^#define PFK_CLEARANCE 8.5 ", text, re.MULTILINE)


def test_machines_whose_links_other_searches_keep_apart_have_no_nearest() -> None:
    assert "int pfk_nearest(" not in c_source(machine("all bodies"))
    with pytest.raises(UnsupportedMechanism, match="leave 'nearest' out"):
        c_source(machine("all bodies"), parts=("ik", "limits", "nearest"))


@needs_compiler
@pytest.mark.parametrize(
    "parts",
    [
        ("limits", "rates"),
        *(pytest.param(each, marks=pytest.mark.campaign) for each in (("limits",), ("ik", "limits"), ("limits", "fk"))),
    ],
)
def test_any_choice_of_parts_with_links_compiles_without_a_warning(parts: Any, tmp_path: Path) -> None:
    (tmp_path / "exported.c").write_text(c_source(machine("solids"), parts=parts))
    command = [COMPILERS[0], "-std=c99", *STRICT, "-c", "exported.c", "-o", "exported.o"]
    assert subprocess.run(command, cwd=tmp_path, capture_output=True, text=True).stderr == ""


JOINTS_DRIVER = """
#undef PFK_SELF_TEST
#include EXPORTED
#include <stdio.h>
#include <string.h>
#include HOSTILE
int main(int argc, char **argv)
{
    static pfk_memory memory;
    double q[PFK_JOINTS], rates[PFK_JOINTS] = {1.0, 2.0};
    pfk_begin(&memory);
    if (argc > 1 && !strcmp(argv[1], "hostile"))
        return hostile_all() != 0;
    while (fread(q, sizeof(double), PFK_JOINTS, stdin) == PFK_JOINTS) {
        double x[PFK_ACTUATORS] = {0}, given[PFK_ACTUATORS], back[PFK_JOINTS] = {0}, power = 0.0, codes[2];
        double J[PFK_ACTUATORS][PFK_JOINTS], speeds[PFK_ACTUATORS], torques[PFK_ACTUATORS];
        int j;
        if (fread(given, sizeof(double), PFK_ACTUATORS, stdin) != PFK_ACTUATORS)
            return 1;
        codes[0] = pfk_to_actuators(&memory, q, x);
        codes[1] = pfk_to_joints(&memory, given, back, 0);
        if (pfk_jacobian(&memory, q, J) || pfk_speeds(&memory, q, rates, speeds) ||
            pfk_torques(&memory, q, rates, torques))
            return 1;
        for (j = 0; j < PFK_ACTUATORS; ++j)
            power += speeds[j] * torques[j];
        fwrite(codes, sizeof(double), 2, stdout);
        fwrite(x, sizeof(double), PFK_ACTUATORS, stdout);
        fwrite(J, sizeof(double), PFK_ACTUATORS * PFK_JOINTS, stdout);
        fwrite(back, sizeof(double), PFK_JOINTS, stdout);
        fwrite(&power, sizeof(double), 1, stdout);
    }
    return 0;
}
"""


@needs_compiler
def test_joints_in_series_are_coordinates_too_and_answered_where_links_are_apart(tmp_path: Path) -> None:
    """In C++, where there is a compiler of it."""
    joints, free = ("pitch_joint", "roll_joint"), pf.load("g1_ankle")
    rods = [
        pf.Shape(f"{side}_connect_link", between=(f"{side}_connect_joint", closing), thickness=0.006)
        for side, closing in (("right", "closure_1"), ("left", "closure_2"))
    ]
    free = free.with_shapes([*rods, pf.Shape("base", "sphere", at=(0.05, 0.0, 0.22), diameter=0.03)])
    mechanism = free.with_clearance(0.0083)
    q = np.random.default_rng(0).uniform([-0.5, -0.2], [0.4, 0.2], (300, 2))
    found = pf.solve_ik(free, poses_at(q))
    assert (found.status == 0).all()
    is_apart = np.asarray(pf.clearance(found).distance) >= 0.0083
    assert 0.2 < is_apart.mean() < 0.8
    (tmp_path / "driver.c").write_text(JOINTS_DRIVER)
    compiler, options = ("g++", ("-std=c++11", "-xc++")) if shutil.which("g++") else (COMPILERS[0], ())
    text = c_source(mechanism, joints=joints)
    program = compiled(text, *options, compiler=compiler, driver=tmp_path / "driver.c")
    survives(program)
    said, _ = asked(program, np.concatenate([q, found.actuators], axis=1))
    for codes in said[:, :2].T:
        np.testing.assert_array_equal(codes == 0, is_apart)
        np.testing.assert_array_equal(codes > PAIR, ~is_apart)
    np.testing.assert_allclose(said[is_apart, 2:4], found.actuators[is_apart], atol=1e-12)
    np.testing.assert_allclose(said[:, 8:10], q, atol=1e-9)
    np.testing.assert_allclose(said[:, 10], 5.0, rtol=1e-12)  # 1 * 1 + 2 * 2: power in is power out
    for column, step in enumerate(1e-6 * np.eye(2)):
        slope = (pf.solve_ik(free.without_limits(), poses_at(q + step)).actuators - found.actuators) / 1e-6
        np.testing.assert_allclose(said[:, [4 + column, 6 + column]], slope, rtol=1e-4, atol=1e-4)


def poses_at(q: Array) -> Array:
    """Poses of the ankle at its joints."""
    poses = np.tile(np.eye(4), (len(q), 1, 1))
    poses[:, :3, :3] = Rotation.from_euler("YX", q).as_matrix()
    return poses


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


def test_a_hexapod_with_a_clearance_is_a_module_of_its_own_for_linuxcnc_which_keeps_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(
        "pfabrik.exchange.export.linuxcnc.c_source", partial(c_source, parts=("ik", "limits"))
    )  # what it calls
    text = linuxcnc(hexapod())
    assert "kinematicsInverse" in text and "PAIR" in text
    assert "genhexkins" in linuxcnc(hexapod(clearance=None))


def test_exports_that_keep_no_clearance_say_so() -> None:
    machine = pf.load("linear_delta")
    rods = [pf.Shape(body, thickness=2) for body in machine.bodies if body.startswith("rod")]
    thick = machine.with_shapes(rods).with_clearance(0.5)
    assert "# - the clearance between links, 0.5 mm" in klipper(thick)
    assert klipper(thick.with_clearance(None)) == klipper(machine)
    words = "Links may be nearer than the machine's clearance, 0.5 mm: that is no limit of `margin`."
    assert words in tensor_source(thick)
    assert tensor_source(thick.with_clearance(None)) == tensor_source(machine)
