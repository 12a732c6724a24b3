"""The compiled kernels: they answer as their source does, take every array alike, and leave their inputs alone."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import pfabrik as pf
from checks import INTERPRETED
from machines import machine
from oracles import any_values
from pfabrik.kernels._shipped import load_module
from pfabrik.passes.plan import compile_plan

TESTS = Path(__file__).parent
pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
FEW = ("five_bar", "nrpm", "hexapod_rus", "serial_spherical", "serial_arm")
MANY = (*FEW, "stewart", "tripod_prs", "mixed", "closure.four_bar_driven")
"""Machines that are compared, by legs, by reaching and on all joints: what the interpreter is quick with, and more."""


SCRIPT = """
import sys, warnings
import numpy as np
warnings.simplefilter("ignore")
from test_compiled_and_interpreted import answers
path, *names = sys.argv[1:]
np.savez(path, **{f"{name} {field}": values for name in names for field, values in answers(name).items()})
"""


def some_targets(mechanism: pf.Mechanism, n: int, seed: int = 0, share: float = 0.2) -> np.ndarray:
    """Poses near home, moved by up to a share of L."""
    rng = np.random.default_rng(seed)
    steps = share * mechanism.characteristic_length * rng.uniform(-1, 1, (n, 3))
    return np.array([pf.pose(mechanism.reference_point + d, rotvec=0.1 * rng.uniform(-1, 1, 3)) for d in steps])


def answers(name: str) -> dict[str, np.ndarray]:
    """What is compared; the home pose, and targets nearby: for some out of reach, where the interpreter is quick."""
    mechanism = machine(name)
    targets = some_targets(mechanism, 4, share=0.05 if name in ("hexapod_rus", "mixed", "nrpm") else 0.2)
    targets[0] = mechanism.home_pose
    if name == "serial_arm":  # on all joints, where the interpreter is quick within reach alone
        targets = pf.solve_fk(mechanism, any_values(mechanism, 4, 0.3)).pose
    if name in ("five_bar", "stewart"):
        targets[3, :3, 3] += 5 * mechanism.characteristic_length
    answer = pf.solve_ik(mechanism, targets)
    values = {"status": answer.status, "pose": answer.pose, "actuators": answer.actuators}
    return values | {f"point {joint}": points for joint, points in answer.points.items()}


@pytest.mark.compiled
@pytest.mark.skipif(not load_module()[0], reason="kernels are not compiled in this folder: see `make`")
@pytest.mark.parametrize("names", [FEW, pytest.param(MANY, marks=pytest.mark.campaign)])
def test_compiled_and_interpreted_answers_are_the_same(tmp_path: Path, names: tuple[str, ...]) -> None:
    """This process against one that runs the kernels the other way; what is projected agrees to what it settles to."""
    paths = os.pathsep.join([str(TESTS), *(path for path in sys.path if path)])
    environment = os.environ | {"PFABRIK_KERNELS": "compiled" if INTERPRETED else "python", "PYTHONPATH": paths}
    subprocess.run([sys.executable, "-c", SCRIPT, str(tmp_path / "other.npz"), *names], env=environment, check=True)
    other = np.load(tmp_path / "other.npz")
    for name in names:
        length = machine(name).characteristic_length
        here = answers(name)
        np.testing.assert_array_equal(other[f"{name} status"], here["status"])
        reached = here["status"] == pf.Status.REACHED
        assert reached[0]
        for field, values in here.items():
            found = other[f"{name} {field}"]
            np.testing.assert_allclose(found[reached], values[reached], rtol=0, atol=1e-9 * length)
            np.testing.assert_allclose(found[~reached], values[~reached], rtol=0, atol=1e-5 * length)


def read_only(array: np.ndarray) -> np.ndarray:
    copy = array.copy()
    copy.setflags(write=False)
    return copy


def integers(poses: np.ndarray) -> np.ndarray:
    """Home's orientation, and positions a few units apart."""
    whole = np.tile(np.eye(4, dtype=np.int64), (len(poses), 1, 1))
    whole[:, :3, 3] = np.round(poses[:, :3, 3]).astype(np.int64)
    return whole


FORMS = {
    "as they are": lambda poses: poses,
    "Fortran-ordered": np.asfortranarray,
    "strided": lambda poses: np.repeat(poses, 2, axis=0)[::2],
    "reversed": lambda poses: poses[::-1].copy()[::-1],
    "transposed": lambda poses: poses.transpose(0, 2, 1).copy().transpose(0, 2, 1),
    "read-only": read_only,
    "a list": lambda poses: poses.tolist(),
    "big-endian": lambda poses: poses.astype(">f8"),
    "single rows": lambda poses: poses[0],
    "an empty batch": lambda poses: poses[:0],
    "positions": lambda poses: poses[:, :3, 3],
    "a grid": lambda poses: poses.reshape(2, -1, 4, 4),
}


def test_targets_in_any_memory_layout_and_type_give_the_same_answer() -> None:
    mechanism, targets = pf.load("stewart"), some_targets(pf.load("stewart"), 6)
    targets[:, :3, :3] = np.eye(3)
    expected = pf.solve_ik(mechanism, targets).actuators
    for form, change in FORMS.items():
        found = pf.solve_ik(mechanism, change(targets)).actuators.reshape(-1, 6)
        np.testing.assert_array_equal(found, expected[: len(found)], err_msg=form)
    for other in (integers(targets), targets.astype(np.float32)):
        found = pf.solve_ik(mechanism, other).actuators
        np.testing.assert_array_equal(found, pf.solve_ik(mechanism, other.astype(float)).actuators)
    with pytest.raises(pf.errors.InvalidArgument):
        pf.solve_ik(mechanism, targets > 0)


@pytest.mark.parametrize("name", ["stewart", "nrpm", "serial_spherical"])
def test_starts_in_any_memory_layout_give_the_same_answer(name: str) -> None:
    mechanism = machine(name)
    targets = some_targets(mechanism, 6)
    start = pf.solve_ik(mechanism, targets)
    answer = pf.solve_ik(mechanism, targets, start=start)
    turned = pf.solve_ik(mechanism, targets[::-1], start=start[::-1])
    np.testing.assert_array_equal(turned.actuators[::-1], answer.actuators)
    one = pf.solve_ik(mechanism, targets[1], start=start[1])
    np.testing.assert_array_equal(one.actuators, answer.actuators[1])
    back = pf.solve_fk(mechanism, answer.actuators[::-1], start=answer[::-1])
    np.testing.assert_array_equal(back.pose[::-1], pf.solve_fk(mechanism, answer.actuators, start=answer).pose)


@pytest.mark.parametrize("name", ["stewart", "nrpm"])
def test_inputs_are_never_written_to_nor_shared_with_answers(name: str) -> None:
    mechanism = machine(name)
    targets = some_targets(mechanism, 4)
    targets[2:, 0, 3] += 1e4
    seed = pf.solve_ik(mechanism, targets)
    compiled = compile_plan(mechanism)
    arrays = [each for each in compiled.plan if isinstance(each, np.ndarray)]
    watched = [targets, *seed._rows, *arrays, *compiled.home_seed]
    before = [array.copy() for array in watched]
    answer = pf.solve_ik(mechanism, targets, start=seed)
    followed = pf.track(mechanism, targets, start=seed[0])
    assert answer.active_limits is not None
    home = pf.solve_ik(mechanism, mechanism.home_pose)
    expected = home.actuators.copy()
    for each in (answer, followed, home):
        each.pose[:] = each.actuators[:] = np.nan
    np.testing.assert_array_equal(pf.solve_ik(mechanism, mechanism.home_pose).actuators, expected)
    for array, copy in zip(watched, before, strict=True):
        np.testing.assert_array_equal(array, copy)


def test_calls_from_several_threads_answer_as_one_after_the_other() -> None:
    mechanisms = [machine(name) for name in ("five_bar", "stewart", "nrpm")] * (1 if INTERPRETED else 4)
    tasks = [(m, some_targets(m, 3 if INTERPRETED else 200, seed)) for seed, m in enumerate(mechanisms)]
    expected = [there_and_back(*task) for task in tasks]
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda task: there_and_back(*task), tasks))
    for ones, others in zip(expected, found, strict=True):
        for one, other in zip(ones, others, strict=True):
            np.testing.assert_array_equal(other.status, one.status)
            np.testing.assert_array_equal(other.pose, one.pose)
            np.testing.assert_array_equal(other.actuators, one.actuators)


def there_and_back(mechanism: pf.Mechanism, targets: np.ndarray) -> tuple[pf.Solution, pf.Solution]:
    """Targets answered, and the actuators of the answers."""
    answers = pf.solve_ik(mechanism, targets)
    return answers, pf.solve_fk(mechanism, answers.actuators)
