"""Settings of controllers: put into their published formulas, they give the same joints as the library."""

from __future__ import annotations

import dataclasses
import re
import subprocess
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from exported import COMPILERS, needs_compiler
from machines.redescribed import moved
from pfabrik.errors import UnsupportedMechanism
from pfabrik.exchange.export.export_c import c_source
from pfabrik.exchange.export.firmware_settings import klipper
from pfabrik.exchange.export.linuxcnc import linuxcnc
from pfabrik.machine import files

STUBS = {
    "rtapi_app.h": "#define EXPORT_SYMBOL(name) struct unused_##name { int i; }\n"
    "#define MODULE_LICENSE(text) static const char license[] = text\n#define KINS_NOT_SWITCHABLE\n",
    "hal.h": "int hal_init(const char *name);\nint hal_ready(int id);\nint hal_exit(int id);\n",
    "kinematics.h": "typedef struct { struct { double x, y, z; } tran; double a, b, c, u, v, w; } EmcPose;\n"
    "typedef unsigned long KINEMATICS_FORWARD_FLAGS;\ntypedef unsigned long KINEMATICS_INVERSE_FLAGS;\n"
    "typedef enum { KINEMATICS_BOTH = 4 } KINEMATICS_TYPE;\n",
}
MAIN = """
#include <stdio.h>
int hal_init(const char *name) { (void)name; return 1; }
int hal_ready(int id) { (void)id; return 0; }
int hal_exit(int id) { (void)id; return 0; }
int main(void)
{
    EmcPose world = {{2.0, -3.0, %r}, 0, 0, 0, 0, 0, 0}, back = {{0, 0, 0}, 0, 0, 0, 0, 0, 0};
    double joints[16];
    if (kinematicsInverse(&world, joints, 0, 0) || kinematicsForward(joints, &back, 0, 0))
        return 1;
    printf("%%.12g %%.12g %%.12g %%.12g %%.12g %%.12g\\n", joints[0], joints[1], joints[2], back.tran.x, back.tran.y,
           back.tran.z);
    world.tran.x = 1e6;
    return kinematicsInverse(&world, joints, 0, 0) == -1 ? 0 : 2;
}
"""


def pins_of(module: str, text: str) -> dict[str, float]:
    return {name: float(value) for name, value in re.findall(rf"setp {module}\.([\w.]+) (\S+)", text)}


def turned(name: str, degrees: float, up: float = 0.0) -> pf.Mechanism:
    R = Rotation.from_euler("z", degrees, degrees=True).as_matrix()
    return moved(pf.load(name), R, np.array([0.0, 0.0, up]))


def test_a_hexapod_of_struts_is_genhexkins() -> None:
    mechanism = pf.load("stewart")
    pins = pins_of("genhexkins", linuxcnc(mechanism))
    assert len(pins) >= 36
    base, platform = (
        np.array([[pins[f"{part}.{n}.{axis}"] for axis in "xyz"] for n in range(6)]) for part in ("base", "platform")
    )
    pose = pf.pose([5, -8, 200], rpy=[4, -3, 6], degrees=True)
    lengths = np.linalg.norm(platform @ pose[:3, :3].T + pose[:3, 3] - base, axis=1)
    np.testing.assert_allclose(lengths, pf.solve_ik(mechanism, pose).actuators, rtol=1e-9)


def test_a_delta_of_towers_is_lineardeltakins_in_the_order_of_its_code() -> None:
    """Carriages as its inverse has them: joint 0 at (0, R), the others counter-clockwise from there."""
    mechanism = turned("linear_delta", 90.0)
    pins = pins_of("lineardeltakins", linuxcnc(mechanism))
    angles = np.radians([90.0, 210.0, 330.0])
    towers = pins["R"] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    heights = 7.0 + np.sqrt(pins["L"] ** 2 - ((towers - [12.0, -20.0]) ** 2).sum(axis=1))
    np.testing.assert_allclose(pf.solve_ik(mechanism, [12.0, -20.0, 7.0]).actuators, heights, atol=1e-6)


def test_a_delta_that_hangs_from_its_thighs_is_rotarydeltakins() -> None:
    """Thighs swing down from level, straight out at -90, 30 and 150 degrees; shins reach from knees to ankles."""
    mechanism, target = pf.load("delta"), np.array([15.0, -22.0, -140.0])
    pins = pins_of("rotarydeltakins", linuxcnc(mechanism))
    joints = pf.solve_ik(mechanism, target).actuators
    angles = np.radians([-90.0, 30.0, 150.0])
    out = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    reach = pins["platformradius"] + pins["thighlength"] * np.cos(joints)
    knees = reach[:, None] * out - np.outer(pins["thighlength"] * np.sin(joints), [0.0, 0.0, 1.0])
    ankles = target + pins["footradius"] * out
    np.testing.assert_allclose(np.linalg.norm(ankles - knees, axis=1), pins["shinlength"], rtol=1e-9)
    counted = files.dumps(mechanism).replace('name = "A1"', 'name = "A1"\nhome = 10').replace("80]", "90]", 1)
    assert "# joint A1 counts 10 deg more" in linuxcnc(files.loads(counted))


UNIT = "mm */ setp x\nsetp y"
"""A unit of length that would end the comment it is written in."""


@pytest.mark.parametrize(("name", "up"), [("linear_delta", 0.0), ("delta", 5.0), ("five_bar", 0.0)])
def test_machines_that_stand_elsewhere_are_modules_of_their_own(
    name: str, up: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "pfabrik.exchange.export.linuxcnc.c_source", partial(c_source, parts=("ik",))
    )  # the shortest code
    text = linuxcnc(dataclasses.replace(turned(name, 0.0, up), length_unit=UNIT))
    assert "kinematicsInverse" in text
    assert not re.search("^setp", text, re.MULTILINE) and "*/ setp" not in text


def test_a_unit_cannot_leave_the_comment_it_is_in() -> None:
    for write, name in ((linuxcnc, "stewart"), (klipper, "linear_delta")):
        text = write(dataclasses.replace(pf.load(name), length_unit=UNIT))
        assert not re.search(r"^setp y", text, re.MULTILINE) and "*/ setp" not in text


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("stewart", "cannot be exported: Klipper's delta has three upright rails"),
        ("five_bar", "cannot be exported: Klipper's delta has three upright rails"),
        ("delta", "counts heights from its bed"),
    ],
)
def test_what_klipper_has_no_kinematics_for_is_refused(name: str, why: str) -> None:
    with pytest.raises(UnsupportedMechanism, match=why):
        klipper(pf.load(name))


@needs_compiler
def test_other_machines_are_a_module_around_their_own_code(tmp_path: Path) -> None:
    mechanism = turned("delta", 10.0)
    for name, text in STUBS.items():
        (tmp_path / name).write_text(text)
    height = float(mechanism.reference_point[2]) - 20.0
    (tmp_path / "module.c").write_text(linuxcnc(mechanism) + MAIN % height)
    command = [COMPILERS[0], "-std=c99", "-Wall", "-I.", "module.c", "-o", "module", "-lm"]
    built = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    told = subprocess.run([str(tmp_path / "module")], capture_output=True, text=True)
    assert told.returncode == 0
    numbers = np.array(told.stdout.split(), float)
    expected = np.degrees(pf.solve_ik(mechanism, [2.0, -3.0, height]).actuators)
    np.testing.assert_allclose(numbers, [*expected, 2.0, -3.0, height], atol=1e-8)
