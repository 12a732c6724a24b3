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
from pfabrik.decomposition.plan import compile_plan
from pfabrik.kernels._shipped import load_module

TESTS = Path(__file__).parent
pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
FEW = ("five_bar", "nrpm", "hexapod_rus", "serial_spherical", "serial_arm")
MANY = (*FEW, "stewart", "tripod_prs", "mixed", "closure.four_bar_driven")
"""Machines that are compared, by legs, by reaching and on all joints: what the interpreter is quick with, and more."""


def has_module() -> bool:
    """Whether compiled kernels are here, run or not."""
    return bool(load_module()[0])


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


@pytest.mark.slow
@pytest.mark.skipif(not has_module(), reason="kernels are not compiled in this folder: see `make`")
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


@pytest.mark.parametrize("form", FORMS)
def test_targets_in_any_memory_layout_give_the_same_answer(form: str) -> None:
    mechanism = pf.load("stewart")
    targets = some_targets(mechanism, 6)
    if form == "positions":
        targets[:, :3, :3] = np.eye(3)
    expected = pf.solve_ik(mechanism, targets).actuators
    found = pf.solve_ik(mechanism, FORMS[form](targets)).actuators.reshape(-1, 6)
    np.testing.assert_array_equal(found, expected[: len(found)])


@pytest.mark.parametrize(
    "change", [integers, lambda poses: poses.astype(np.float32), lambda poses: integers(poses) > 0]
)
def test_numbers_of_another_type_are_converted(change: object) -> None:
    mechanism = pf.load("stewart")
    targets = change(some_targets(mechanism, 4))
    if targets.dtype == bool:
        with pytest.raises(pf.errors.InvalidArgument):
            pf.solve_ik(mechanism, targets)
        return
    expected = pf.solve_ik(mechanism, targets.astype(float))
    np.testing.assert_array_equal(pf.solve_ik(mechanism, targets).actuators, expected.actuators)


@pytest.mark.skipif(INTERPRETED, reason="nothing is compiled")
@pytest.mark.parametrize("name", ["stewart", "nrpm", "serial_spherical"])
def test_no_question_hands_a_kernel_what_it_refuses(name: str) -> None:
    """Compiled ones take one type each: whatever the layout of targets and seeds, single, batch, seeded, projected."""
    mechanism = machine(name)
    targets = some_targets(mechanism, 6)
    far = targets + np.eye(4)[3] * [[1e4], [0], [0], [0]]
    for form in FORMS.values():
        pf.solve_ik(mechanism, form(targets))
    for other in (targets.astype(np.float32), integers(targets)):
        pf.solve_ik(mechanism, other)
    seed = pf.solve_ik(mechanism, targets)
    for answer in (
        pf.solve_ik(mechanism, targets, start=seed),
        pf.solve_ik(mechanism, targets[::-1], start=seed[::-1]),
        pf.solve_ik(mechanism, targets, start=seed[0]),
        pf.solve_ik(mechanism, far, options=pf.Options(hold=None, tolerance=1)),
        pf.passes.solve(mechanism, far, pf.passes.Options.paper()),
        pf.track(mechanism, targets, start=seed[1], on_progress=lambda done, total: None),
    ):
        assert answer.active_limits is not None
        assert pf.solve_fk(mechanism, answer.actuators, start=answer).joints


@pytest.mark.parametrize("name", ["stewart", "nrpm"])
def test_inputs_are_never_written_to(name: str) -> None:
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
    answer.pose[:] = answer.actuators[:] = np.nan
    followed.pose[:] = np.nan
    for array, copy in zip(watched, before, strict=True):
        np.testing.assert_array_equal(array, copy)


def test_a_plan_is_not_shared_with_its_answers() -> None:
    """Overwriting an answer, home's included, changes no later one."""
    mechanism = pf.load("stewart")
    first = pf.solve_ik(mechanism, mechanism.home_pose)
    expected = first.actuators.copy()
    first.pose[:] = first.actuators[:] = 7.0
    np.testing.assert_array_equal(pf.solve_ik(mechanism, mechanism.home_pose).actuators, expected)


def test_calls_from_several_threads_answer_as_one_after_the_other() -> None:
    mechanisms = [machine(name) for name in ("five_bar", "stewart", "nrpm")] * (1 if INTERPRETED else 8)
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
