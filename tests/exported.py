"""Exported C, compiled and asked: the text and the program of a machine are made once in a process."""

from __future__ import annotations

import shutil
import subprocess
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
import pytest

import hostile
import machines
import pfabrik as pf
from checks import actuator_units
from machines import published
from pfabrik.exchange.export.export_c import c_source
from pfabrik.exchange.export.source import targets_around_home
from pfabrik.machine.description.joints import KINDS
from pfabrik.machine.model import model_of
from pfabrik.machine.motion.displacements import columns
from pfabrik.machine.motion.limited_coordinates import coned

Array = np.ndarray
COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)]
needs_compiler = pytest.mark.skipif(not COMPILERS, reason="no C compiler here: neither gcc nor clang")
STRICT = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Wshadow", "-Werror")
SANITIZERS = ("-DCHECKED", "-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all")
DRIVER = Path(__file__).parent / "data" / "run_exported.c"
KEEP = pf.Options(working_mode="keep")
EXACT = {"double": 1e-12, "float": 1e-5}
"""Rounding of a file's answers [L or rad]."""

PASSED = "50 poses, 0 wrong\n"
"""What a file says that has checked itself."""

WITHOUT_NEAREST: Any = ("ik", "limits", "fk", "rates")
"""The parts of a file that are a tenth of it; the search for the nearest pose is the rest."""

REFUSED = {
    "nrpm": "poses leave joints A1, B1",
    "H4": "singular at home, where joints Q1, Q2",
    "panda": "between the ends of its rod, is not along it",
    "snake60": "between the ends of its rod, is not along it",
}
"""Machines that have no code, and what the refusal says."""

CATALOGUE = [name for name in pf.catalog() if name not in REFUSED]

_FOLDER = TemporaryDirectory()


@cache
def machine(name: str) -> pf.Mechanism:
    """A machine of the catalogue, of the literature, or of the tests."""
    if name in pf.catalog():
        return pf.load(name)
    return published.seven_struts() if name == "seven_struts" else machines.machine(name)


@cache
def _written(name: str, precision: Any, parts: Any) -> str:
    return c_source(machine(name), precision=precision, parts=parts)


def text_of(name: str, precision: Any = "double", parts: Any = None) -> str:
    return _written(name, precision, parts)


@cache
def sanitizers_of(compiler: str) -> tuple[str, ...]:
    """What finds wrong indices and memory; nothing where a compiler is there without its sanitizers."""
    source, program = Path(_FOLDER.name, "whole.c"), Path(_FOLDER.name, "whole")
    source.write_text("int main(void) { return 0; }\n")
    built = subprocess.run([compiler, *SANITIZERS, str(source), "-o", str(program)], capture_output=True)
    return () if built.returncode or subprocess.run([str(program)]).returncode else SANITIZERS


@cache
def compiled(text: str, *options: str, compiler: str = "", driver: Path | None = DRIVER) -> Path:
    """A program of an exported text, compiled without one warning: with a driver, or its self-test alone.

    Integers have 32 bits, as on most controllers.
    """
    folder = Path(_FOLDER.name, str(len(list(Path(_FOLDER.name).iterdir()))))
    folder.mkdir()
    exported, program = folder / "exported.c", folder / "program"
    exported.write_text(text)
    standard = () if any(each.startswith("-std") for each in options) else ("-std=c99",)
    parts = [f"-DHAS_{part}" for part in ("nearest", "clearance", "jacobian") if f"int pfk_{part}(" in text]
    (folder / "hostile.h").write_text(hostile.header(text))
    included = [f'-DEXPORTED="{exported}"', f'-DHOSTILE="{folder}/hostile.h"']
    source = [*included, *parts, str(driver)] if driver else [str(exported)]
    defined = ["-DPFK_SELF_TEST", "-DPFK_INTEGER=int32_t"]
    command = [compiler or COMPILERS[0], *standard, *options, *STRICT, *defined, *source]
    run = subprocess.run([*command, "-o", str(program), "-lm"], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return program


def checks_itself(program: Path) -> tuple[int, str]:
    """Exit code and words of a program's self-test; nothing is written as an error."""
    run = subprocess.run([str(program), "check"], capture_output=True, text=True)
    assert run.stderr == ""
    return run.returncode, run.stdout


def survives(program: Path) -> None:
    """No argument of any function of a program makes it write what is not finite, or return 0 for it."""
    run = subprocess.run([str(program), "hostile"], capture_output=True, text=True)
    assert (run.returncode, run.stdout, run.stderr) == (0, "", "")


def asked(program: Path, given: Array, *arguments: object) -> tuple[Array, list[str]]:
    """What a program answers to rows of numbers, one row each, and what it says."""
    command = [str(program), *map(str, arguments)]
    run = subprocess.run(command, input=given.tobytes(), capture_output=True)
    assert run.returncode == 0, run.stderr.decode()[-2000:]
    return np.frombuffer(run.stdout).reshape(len(given), -1), run.stderr.decode().splitlines()


def flat(poses: Array) -> Array:
    return np.concatenate([poses[:, :3, 3], poses[:, :3, :3].reshape(-1, 9)], axis=1)


def matrices(numbers: Array) -> Array:
    """Poses (n, 4, 4) of the numbers (n, 12) that files know them by."""
    poses = np.tile(np.eye(4), (len(numbers), 1, 1))
    poses[:, :3, 3], poses[:, :3, :3] = numbers[:, :3], numbers[:, 3:].reshape(-1, 3, 3)
    return poses


class Truth(NamedTuple):
    """What the library says of targets, limits measured on the coordinates of all joints."""

    targets: Array
    whole: Array
    closes: Array
    actuators: Array
    slack: Array


@cache
def truth(name: str, count: int) -> Truth:
    """Targets around home; where a machine has less freedoms than its task asks for, nearest to them."""
    mechanism = machine(name)
    free = mechanism.without_limits()
    targets = targets_around_home(mechanism, count, np.random.default_rng(5))
    found = pf.solve_ik(free, targets, options=KEEP)
    if not (found.status == 0).any():
        targets = np.ascontiguousarray(found.pose)
        found = pf.solve_ik(free, targets, options=KEEP)
    whole, closes, actuators, q = found.pose.copy(), found.status == 0, found.actuators.copy(), found.q.copy()
    # limits may lead a search where it does not come without them
    rows = np.flatnonzero(~closes & (np.asarray(pf.feasibility(mechanism, targets).margin) > 0.0))
    if len(rows):
        kept = pf.solve_ik(mechanism, targets[rows], options=KEEP)
        rows, kept = rows[kept.status == 0], kept[kept.status == 0]
        whole[rows], closes[rows], actuators[rows], q[rows] = kept.pose, True, kept.actuators, kept.q
    return Truth(targets, whole, closes, actuators, slack_of(mechanism, q))


def home_of(mechanism: pf.Mechanism) -> Array:
    """All joints at home."""
    return np.concatenate([np.ravel(mechanism.home_coordinate(joint.name)) for joint in mechanism.joints])


def limit_units(mechanism: pf.Mechanism) -> Array:
    """Of every limit, in the order of the file: L of lengths, 1 of angles."""
    table = model_of(mechanism).legs
    return np.concatenate([np.repeat(table.limited["unit"], 2), np.ones(len(table.cones))])


def slack_of(mechanism: pf.Mechanism, q: Array) -> Array:
    """Room left before every limit, in the order of the file, (n, limits) [L or rad]."""
    turning = {joint.name: angles for joint, angles, _ in coned(mechanism, q - home_of(mechanism))}
    table, places = model_of(mechanism).legs, columns(mechanism)
    rooms: list[Array] = []
    n_ranged: dict[tuple[str, str], int] = {}
    for joint, bound in table.limits:
        described = mechanism.joint(joint)
        if bound == "cone":
            rooms.append(described.cone.half_angle - turning[joint])
            continue
        place = n_ranged.setdefault((joint, bound), 0)
        n_ranged[joint, bound] += 1
        first, last = places[joint].start, places[joint].stop
        column = first + place
        if len(KINDS[described.type].coordinates) > 1:  # a leg may have the two coordinates of a joint in either order
            column = [int(each["column"]) for each in table.limited if first <= each["column"] < last][place]
        low, high = np.reshape(described.range, (-1, 2))[column - first]
        rooms.append(q[:, column] - low if bound == "min" else high - q[:, column])
    return np.array(rooms).T.reshape(len(q), -1) / limit_units(mechanism)


class Answers(NamedTuple):
    """What a file says, one row a pose; lengths over L. Rates and distances where the file has them."""

    ik: Array
    limits: Array
    fk: Array
    steps: Array
    poses: Array
    back: Array
    actuators: Array
    slack: Array
    rates: Array
    distances: Array
    words: list[str]


def answers_of(program: Path, mechanism: pf.Mechanism, known: Truth, start: str = "home") -> Answers:
    """What a program answers: to targets, of whole poses, and to actuators, from home or from where they are."""
    given = np.concatenate([flat(known.targets), flat(known.whole), known.actuators], axis=1)
    rows, words = asked(program, given, start)
    n, sizes = len(mechanism.actuator_names), limit_units(mechanism)
    scale = np.repeat([mechanism.characteristic_length, 1.0], [3, 9])
    ends = np.cumsum([4, 12, 12, n, len(sizes), 7 * n + 13])
    codes, poses, back, actuators, slack, rates, distances = np.split(rows, ends, axis=1)
    return Answers(*codes.T.astype(int), poses / scale, back / scale, actuators, slack / sizes, rates, distances, words)


def off(mechanism: pf.Mechanism, actuators: Array, expected: Array) -> Array:
    """How far actuators are from others, (n, n_a) [L or rad]."""
    return np.abs(actuators - expected) / actuator_units(mechanism)


def program_of(name: str, precision: Any = "double", parts: Any = None) -> Path:
    """The program of a machine, with the driver; a delta's with all parts has its indices and memory checked."""
    options = sanitizers_of(COMPILERS[0]) if name == "delta" and parts is None else ()
    return compiled(text_of(name, precision, parts), *options)
