"""The transmission for ros2_control, compiled against stubs of its documented interface: it maps there and back."""

from __future__ import annotations

import os
import shutil
import subprocess
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import pfabrik as pf
from command import pfabrik
from machines import machine
from pfabrik.errors import InvalidArgument, UnsupportedMechanism
from pfabrik.machine.motion.joint_path import joint_path

DATA = Path(__file__).parent / "data"
STRICT = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")
needs_compilers = pytest.mark.skipif(
    not (shutil.which("gcc") and shutil.which("g++")), reason="no compilers of C and C++ here: gcc, g++"
)
MACHINES = {
    "g1_ankle": (("pitch_joint", "roll_joint"), (0.4, 0.2)),
    "tricept": (("D", "E"), (0.2, 0.2, 20.0)),
    "ankle_ups": (("pivot",), (0.3, 0.3)),
    "closure.ankle": (("ankle",), (0.2, 0.2)),
}
OFTEN = ("g1_ankle", "tricept")
"""Two hinges with cranks, and three joints with struts: each of the others is like one of them."""


def package(name: str, tmp_path: Path) -> Path:
    return pf.export_ros2_control(machine(name), tmp_path / "leg_transmission", joints=MACHINES[name][0])


def mapped(
    folder: Path, rows: np.ndarray, n_joints: int, n_actuators: int, headers: Sequence[Path] = ()
) -> tuple[np.ndarray, np.ndarray]:
    """Values of actuators, and back of joints, as (rows, 3, n): positions, velocities, efforts.

    Headers are looked for in these folders, then among the stubs.
    """
    built = folder / "built"
    includes = [word for each in (*headers, DATA / "ros2_stubs") for word in ("-isystem", str(each))]
    built.mkdir()
    commands = [
        ["gcc", "-std=c99", *STRICT, "-c", str(folder / "src/leg_kinematics.c"), "-o", str(built / "kinematics.o")],
        ["g++", "-std=c++17", *STRICT, *includes, "-I", str(folder / "include"), "-DFMT_HEADER_ONLY",
         str(folder / "src/leg_transmission.cpp"), str(DATA / "run_transmission.cpp"), str(built / "kinematics.o"),
         "-o", str(built / "run"), "-lm"],
    ]  # fmt: skip
    for command in commands:
        run = subprocess.run(command, capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
    text = f"{n_joints} {n_actuators} {len(rows)}\n" + "\n".join(" ".join(map(repr, row)) for row in rows.tolist())
    run = subprocess.run([str(built / "run")], input=text, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    told = np.array([line.split() for line in run.stdout.splitlines()], float)
    actuators, joints = told[:, : 3 * n_actuators], told[:, 3 * n_actuators :]
    return actuators.reshape(-1, 3, n_actuators), joints.reshape(-1, 3, n_joints)


@needs_compilers
@pytest.mark.parametrize(
    "name", [*OFTEN, *(pytest.param(n, marks=pytest.mark.campaign) for n in MACHINES if n not in OFTEN)]
)
def test_joints_to_actuators_and_back_is_where_it_began_and_power_is_conserved(name: str, tmp_path: Path) -> None:
    check_there_and_back(name, tmp_path)


@needs_compilers
@pytest.mark.campaign
@pytest.mark.parametrize("branch", ["jazzy", "master"])
def test_so_it_does_against_the_headers_of_ros2_control(branch: str, tmp_path: Path) -> None:
    """All but the macro that makes a plugin of it."""
    control = fetched("ros-controls/ros2_control", tmp_path, "--branch", branch)
    packages = [control / each for each in ("transmission_interface", "hardware_interface", "joint_limits")]
    packages += [fetched(each, tmp_path) for each in ("ros2/rcpputils", "fmtlib/fmt")]
    check_there_and_back("g1_ankle", tmp_path, [each / "include" for each in packages])


def fetched(repository: str, folder: Path, *options: str) -> Path:
    """A copy of a repository."""
    place = folder / repository.replace("/", "+")
    line = ["git", "clone", "--quiet", "--depth", "1", *options, f"https://github.com/{repository}.git", str(place)]
    run = subprocess.run(line, capture_output=True, text=True, env=os.environ | {"GIT_TERMINAL_PROMPT": "0"})
    if run.returncode != 0:
        pytest.skip(f"{repository} is not to be had here: {run.stderr.strip()}")
    return place


def check_there_and_back(name: str, tmp_path: Path, headers: Sequence[Path] = ()) -> None:
    mechanism, (names, reach) = machine(name), MACHINES[name]
    path, n, n_a = joint_path(mechanism, names), len(reach), len(mechanism.actuator_names)
    values = np.random.default_rng(0).uniform(-1.0, 1.0, (40, 3, n))
    values[:, 0] = path.home + 0.1 + values[:, 0] * reach  # an offset of 0.1 of every joint
    rows = np.concatenate([values, np.zeros((3, 3, n))])
    rows[41, 0, 0], rows[42, 0] = np.nan, 1.5
    actuators, joints = mapped(package(name, tmp_path), rows.reshape(43, -1), n, n_a, headers)
    assert np.isfinite(actuators[40]).all() and np.isnan(actuators[41]).any()  # what is not finite is passed on
    if name == "g1_ankle":  # out of reach: nothing is written over the values before
        np.testing.assert_array_equal(actuators[42], actuators[41])
    actuators, joints = actuators[:40], joints[:40]
    scale = np.abs(values).max(axis=0)
    assert (np.abs(joints - values) / scale).max() <= 1e-12
    power = (actuators[:, 1] * actuators[:, 2]).sum(axis=1) - (values[:, 1] * values[:, 2]).sum(axis=1)
    assert np.abs(power).max() <= 1e-12 * np.abs(actuators[:, 1] * actuators[:, 2]).max()
    solution = pf.solve_ik(mechanism.without_limits(), path.poses(values[:, 0] - 0.1))
    size = mechanism.characteristic_length
    np.testing.assert_allclose(actuators[:, 0], 2.0 * solution.actuators, atol=1e-11 * max(1.0, size))


def test_the_package_names_one_plugin_everywhere(tmp_path: Path) -> None:
    folder = package("g1_ankle", tmp_path)
    plugin = ET.parse(folder / "leg_transmission_plugins.xml").getroot()[0]
    snippet = ET.parse(folder / "leg_transmission.urdf.xml").getroot()
    assert snippet.findtext("plugin") == plugin.get("name") == "leg_transmission/Transmission"
    assert plugin.get("type") == "leg_transmission::TransmissionLoader"
    assert [each.get("name") for each in snippet.iter("joint")] == ["pitch_joint", "roll_joint"]
    assert [each.get("role") for each in snippet.iter("actuator")] == ["actuator1", "actuator2"]
    assert ET.parse(folder / "package.xml").getroot().findtext("name") == "leg_transmission"
    listed = (folder / "CMakeLists.txt").read_text()
    assert "project(leg_transmission" in listed and "leg_transmission_plugins.xml" in listed
    assert not [path for path in folder.rglob("*") if path.is_file() and "@NAME@" in path.read_text()]


def test_joints_and_names_that_do_not_fit_are_refused_and_nothing_is_written(tmp_path: Path) -> None:
    ankle, arm = machine("g1_ankle"), machine("panda")
    with pytest.raises(InvalidArgument, match="in series"):
        pf.export_ros2_control(ankle, tmp_path / "a", joints=["roll_joint"])
    with pytest.raises(InvalidArgument, match="lower-case"):
        pf.export_ros2_control(ankle, tmp_path / "b", joints=["pitch_joint", "roll_joint"], name="Leg")
    with pytest.raises(UnsupportedMechanism):
        pf.export_ros2_control(arm, tmp_path / "c", joints=[joint.name for joint in arm.joints])
    assert not list(tmp_path.iterdir())


def test_the_command_writes_tensors_and_packages_and_never_over_files(tmp_path: Path) -> None:
    joints, text = ["--joints", "pitch_joint", "roll_joint"], tmp_path / "c.py"
    for option, place in (("--torch", "a.py"), ("--jax", "b.py"), ("--numpy", "c.py"), ("--ros2-control", "leg")):
        names = ["--joints", "pitch_joint,roll_joint"] if option == "--numpy" else joints
        line = ["export", "g1_ankle", option, str(tmp_path / place), *names]
        result = pfabrik(line)
        assert result.exit_code == 0, result.output
        assert (tmp_path / place).exists()
        again = pfabrik(line)
        assert again.exit_code != 0 and "exists already" in again.output
    written = text.read_bytes()
    line = ["export", "g1_ankle", "--numpy", str(text), "--force", "--joints", "pitch_joint", "--joints", "roll_joint"]
    assert pfabrik(line).exit_code == 0 and text.read_bytes() == written
    for line, said in (
        (["export", "g1_ankle"], "expected a FORMAT"),
        (["export", "g1_ankle", "c", *joints, "--joints", "x"], "--joints once with all names"),
        (["export", "g1_ankle", "c", "d"], "after --joints"),
        (["export", "g1_ankle", "mjcf", *joints], "not of mjcf"),
        (["export", "g1_ankle", "--torch", str(tmp_path / "d.py"), "--name", "x"], "torch has none"),
        (["export", "g1_ankle", "--ros2-control", str(tmp_path / "other")], "needs --joints"),
    ):
        result = pfabrik(line)
        assert result.exit_code == 2 and said in result.output, result.output
