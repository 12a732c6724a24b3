"""End effectors that tilt about one axis alone: in any plane a tilt is measured along that freedom, and by it alone."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from machines.redescribed import moved
from pfabrik.exchange.interop import from_mjcf
from rounded_files import Hinge, Linkage, model_text

UPRIGHT = Rotation.from_rotvec([np.pi / 2, 0.0, 0.0]).as_matrix()
TURNS = [Rotation.from_rotvec(vector).as_matrix() for vector in ([0.0, 0.0, 0.7], [0.4, -0.5, 0.9], [0.5, 0.3, -0.4])]
"""Rotations of the base: with the first a plane stays upright, with the others it leans."""

BODIES, AT = ("world", "thigh", "shank", "foot"), np.array([[0.0, 0.0, 0.0], [0.1, 0.0, -0.3], [0.0, 0.0, -0.6]])


def hinges(turn: np.ndarray) -> list[Hinge]:
    """A leg of three hinges in a plane, turned."""
    ends = zip(("hip", "knee", "ankle"), BODIES[:-1], BODIES[1:], AT, strict=True)
    return [Hinge(name, parent, child, turn @ at, turn @ [0.0, 1.0, 0.0]) for name, parent, child, at in ends]


def arm(turn: np.ndarray) -> pf.Mechanism:
    joints = [
        pf.Joint(each.name, "revolute", each[1:3], each.at, axis=each.axis, actuated=True, range=(-1.0, 1.0))
        for each in hinges(turn)
    ]
    return pf.Mechanism("arm", joints, "foot", turn @ [0.05, 0.0, -0.65], "world", task=("x", "z", "tilt"))


def platform(turn: np.ndarray) -> pf.Mechanism:
    return moved(pf.load("rrr"), turn @ UPRIGHT, np.zeros(3))._with(task=("x", "z", "tilt"))


def off_the_plane(poses: np.ndarray, axis: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Poses whose z axis has another part along an axis, and the same direction across it."""
    targets = poses.copy()
    for target in targets:
        z = target[:3, 2] + rng.uniform(-0.7, 0.7) * axis
        first = np.cross(z, rng.normal(size=3))
        first, z = first / np.linalg.norm(first), z / np.linalg.norm(z)
        target[:3, :3] = np.stack([first, np.cross(z, first), z], axis=1)
    return targets


@pytest.mark.parametrize("turn", [np.eye(3), *TURNS], ids=["base", "upright", "leaning", "further"])
@pytest.mark.parametrize("build", [arm, platform])
def test_what_of_a_tilt_is_off_the_only_freedom_does_not_count(
    build: Callable[[np.ndarray], pf.Mechanism], turn: np.ndarray
) -> None:
    machine, rng = build(turn), np.random.default_rng(3)
    values = np.linspace(0.0, 1.0, 12)[:, None] * rng.uniform(-0.1, 0.1, 3) + rng.uniform(-1e-3, 1e-3, (12, 3))
    known = pf.solve_fk(machine, values + [drive.home for drive in machine.drives])
    assert all(known)
    targets = off_the_plane(known.pose, turn @ [0.0, 1.0, 0.0], rng)
    start, solver = pf.solve_ik(machine, machine.home_pose), pf.Solver(machine)
    for answers in (
        pf.solve_ik(machine, targets),
        pf.solve_ik(machine, targets, start=start),
        pf.track(machine, targets),
    ):
        assert all(answers)
        assert answers.actuators == pytest.approx(known.actuators, abs=1e-6)
        assert np.asarray(answers.rotation_error) == pytest.approx(0.0, abs=1e-9)
    assert (pf.feasibility(machine, targets).margin >= 0.0).all()
    assert solver.ik(np.ascontiguousarray(targets[5])) == pf.Status.REACHED
    assert solver.actuators == pytest.approx(known.actuators[5], abs=1e-6)
    level = pf.solve_ik(build(np.eye(3)), build(np.eye(3)).home_pose)
    leant, about = (sorted(r.distance for r in pf.travel(each) if r.kind == "about") for each in (start, level))
    assert leant == pytest.approx(about, rel=1e-3)


class Pose(ctypes.Structure):
    _fields_ = (("p", ctypes.c_double * 3), ("R", ctypes.c_double * 9))

    @staticmethod
    def of(pose: np.ndarray) -> Pose:
        return Pose((ctypes.c_double * 3)(*pose[:3, 3]), (ctypes.c_double * 9)(*pose[:3, :3].ravel()))


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc")
def test_exported_c_measures_a_tilt_along_the_only_freedom(tmp_path: Path) -> None:
    machine, turn = platform(TURNS[1]), TURNS[1]
    pf.export_c(machine, tmp_path / "machine.c", parts=("ik",))
    subprocess.run(["gcc", "-shared", "-fPIC", "machine.c", "-o", "machine.so", "-lm"], cwd=tmp_path, check=True)
    library, actuators = ctypes.CDLL(str(tmp_path / "machine.so")), (ctypes.c_double * 3)()
    memory = (ctypes.c_double * 10_000)()
    library.pfk_begin(memory)
    known = pf.solve_fk(machine, [0.05, -0.08, 0.1] + np.array([drive.home for drive in machine.drives]))
    for target in off_the_plane(
        np.repeat(known.pose[None], 5, axis=0), turn @ [0.0, 1.0, 0.0], np.random.default_rng(3)
    ):
        last = Pose.of(np.asarray(machine.home_pose))
        assert library.pfk_ik(memory, ctypes.byref(Pose.of(target)), ctypes.byref(last), actuators) == 0
        assert np.array(actuators) == pytest.approx(known.actuators, abs=1e-9)


@pytest.mark.parametrize("turn", [np.eye(3), TURNS[2]], ids=["base", "leaning"])
@pytest.mark.parametrize("digits", [6, 7])
def test_a_model_of_a_few_digits_answers_typed_angles_as_the_exact_one(turn: np.ndarray, digits: int) -> None:
    linkage = Linkage(hinges(turn), ["hip", "knee", "ankle"], "foot", 3)
    exact, rounded = (
        from_mjcf(model_text(linkage, count), end_effector="foot", task=["x", "z", "tilt"]).mechanism
        for count in (17, digits)
    )
    targets = pf.pose(
        np.array(exact.reference_point) + [[0.02, 0.0, 0.03]] * 3, rpy=[[0, 5, 0], [4, 0, 0], [3, -6, 20]], degrees=True
    )
    one, other = (pf.solve_ik(each, targets) for each in (exact, rounded))
    assert all(one) and all(other)
    assert other.actuators == pytest.approx(one.actuators, abs=1e-5 if digits == 7 else 1e-4)
    if turn is not TURNS[0] and np.allclose(turn, np.eye(3)):
        assert all(np.abs(joint.axis).tolist() == [0.0, 1.0, 0.0] for joint in rounded.joints)
