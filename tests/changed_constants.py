"""What machines answer with one constant of a search changed: by kernels whose constants are variables, and that count.

python tests/changed_constants.py build FOLDER
python tests/changed_constants.py ask FOLDER RECORD [NAME …]

The second prints, as JSON, what changes for each constant of a record: what is answered, or how many functions run.
"""

from __future__ import annotations

import ast
import ctypes
import importlib
import importlib.util
import json
import multiprocessing
import os
import pkgutil
import sys
import warnings
from collections.abc import Iterator
from functools import cache
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[1]
FILES = Path(__file__).parent / "machines" / "files"
PACKAGE = "pfabrik.kernels"
PER_ROW, LIMIT = 4, 120
"""Targets of each question; seconds after which a search with a constant changed counts as slower."""

MACHINES = {
    "search_constants": ["stewart", "rps", "palletizer", "rrr", "panda", "straight_arm", "hexaglide", "nrpm"],
    "pose.pose_constants": ["stewart", "rps", "prr", "reachy_mini", "canfield", "hexaglide", "nrpm"]
    + ["thick_hexaglide"],
    "joints.joint_constants": ["straight_arm", "arm_by_its_body", "four_bar_tripod", "walking_linkage"],
    "chains.chain_constants": ["panda", "spherical_cones", "universal_cones", "snake60"],
    "passes.pass_constants": ["nrpm", "delta", "servo_hexapod", "canfield"],
    "clearance.distance_constants": ["struts", "delta_apart"],
    "legs.leg_constants": ["rps", "nrpm", "agile_eye", "reachy_mini", "canfield", "delta"],
}
"""Machines whose searches have the constants of a record, the quickest first."""


@cache
def imported(module: str) -> dict[str, tuple[str, str]]:
    """Names of a module that are constants of records: the record and the name there."""
    file = sys.modules[module].__file__ or ""
    nodes = ast.parse(Path(file).read_text(encoding="utf-8")).body if file.endswith(".py") else []
    package = module if file.endswith("__init__.py") else module.rpartition(".")[0]
    return {
        alias.asname or alias.name: (importlib.util.resolve_name("." * node.level + node.module, package), alias.name)
        for node in nodes
        if isinstance(node, ast.ImportFrom) and node.level and (node.module or "").endswith("_constants")
        for alias in node.names
    }


def symbol(record: str, name: str) -> str:
    return f"{record.replace('.', '_')}_{name}"


def build(folder: Path) -> None:
    """Compile kernels whose constants are variables of the module, and which count the functions that run."""
    os.environ["PFABRIK_KERNELS"] = "python"
    sys.path.insert(0, str(ROOT / "tools" / "kernels"))
    import compile_kernels

    import pfabrik.kernels.ahead  # noqa: F401
    from pfabrik.to_c.c_file import File
    from pfabrik.to_c.values import Value

    compile_kernels.BUILD, compile_kernels.SOURCES = folder, folder / "sources.sha256"
    compile_kernels.LEVELS = {"v2": compile_kernels.LEVELS["v2"]}
    plain, made = File.constant, dict[str, str]()

    def constant(self: Any, name: str, value: Any, module: str) -> Value:
        if name not in imported(module):
            return plain(self, name, value, module)
        t, own = self.type_of(value), symbol(*imported(module)[name])
        kind, several = self.spell.stored(t).strip(), isinstance(value, tuple)
        made[own] = (
            f"{'real' if several else kind} {own}{f'[{len(value)}]' if several else ''} = {self.literal(value, t)};"
        )
        self.items[own] = f"extern {kind} {own};\n"
        return Value(own, t, constant=value)

    File.constant = constant  # type: ignore[method-assign]
    compile_kernels.translate()
    uncounted = "__attribute__((no_instrument_function))"
    hooks = [
        f"{uncounted} void __cyg_profile_func_{where}(void *f, void *by) {{ (void)f; (void)by; {count} }}"
        for where, count in (("enter", "N_CALLS++;"), ("exit", ""))
    ]
    head = "#include <stdint.h>\n#pragma GCC visibility push(default)\ntypedef double real; typedef int64_t integer;"
    (folder / "variables.c").write_text("\n".join([head, *made.values(), "integer N_CALLS;", *hooks, ""]))
    platform = compile_kernels.macros()
    assert platform is not None
    compile_kernels.build(platform, folder, ["-O1", "-finstrument-functions"])


def load(folder: Path) -> ctypes.CDLL:
    """Take the kernels of a folder for those of the package."""
    name = f"{PACKAGE}._compiled"
    spec = importlib.util.spec_from_file_location(name, next(folder.glob("_compiled.*")))
    assert spec is not None and spec.loader is not None and spec.origin is not None
    sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sys.modules[name])
    return ctypes.CDLL(spec.origin)


def machine(name: str) -> Any:
    """A machine of the catalogue, of the tests' files, or one that a test makes."""
    import pfabrik as pf

    if name in pf.catalog():
        return pf.load(name)
    if (FILES / f"{name}.toml").exists():
        return pf.load(FILES / f"{name}.toml")
    import test_apart
    import test_chains
    import test_clearance
    from machines import closure

    made = {
        "thick_hexaglide": test_apart.thick_hexaglide,
        "struts": lambda: test_clearance.struts(20.0, clearance=2),
        "delta_apart": lambda: test_apart.between_joints("delta", 0.04),
        "spherical_cones": lambda: test_chains.coned(5, "spherical", 0.4),
        "universal_cones": lambda: test_chains.coned(5, "universal", 0.4),
    }
    return made.get(name, closure.MACHINES.get(name))()


def answers(name: str, record: str) -> Iterator[Any]:
    """What a machine answers: near, far and beyond, from home and from a start, held and not, on a path, forward."""
    import pfabrik as pf

    asked, rng = machine(name), np.random.default_rng(7)
    length, home = asked.characteristic_length, asked.home_pose[:3, 3]

    def poses(size: float) -> Any:
        shift, turn = size * rng.normal(size=(2, PER_ROW, 3))
        return pf.pose(home + length * shift, rotvec=turn)

    near, far, beyond = poses(0.1), poses(0.5), poses(2.0)
    if record == "passes.pass_constants":
        for method in ("paper", "extended", "accelerated", "centroid"):
            yield pf.passes.solve(asked, far, pf.passes.Options(method=method))
        return
    first, there = pf.solve_ik(asked, near), pf.solve_ik(asked, far)
    yield from (first, there, pf.solve_ik(asked, beyond), pf.track(asked, near))
    yield pf.solve_ik(asked, far, start=there[0])
    yield pf.solve_ik(asked, far, start=there[0], options=pf.Options(working_mode="keep", hold="position"))
    yield pf.solve_ik(asked, far, options=pf.Options(working_mode="any", hold=None))
    for off in (0.0, 0.3, 3.0):
        yield pf.solve_fk(asked, there.actuators + off * rng.normal(size=there.actuators.shape))
    yield pf.solve_fk(asked, there.actuators[:2] + 0.3, options=pf.Options(working_mode="any"))


def measures(solution: Any) -> list[bytes]:
    """Statuses; distances from targets; everything."""
    distance = np.hypot(solution.position_error, solution.rotation_error)
    fields = (solution.pose, solution.q, solution.actuators, solution.certified)
    return [np.asarray(each).tobytes() for each in (solution.status, np.round(distance, 9))] + [
        b"".join(np.ascontiguousarray(each).tobytes() for each in fields)
    ]


def answer(record: str, n_calls: Any, change: dict[str, Any], base: Any, sink: Connection) -> None:
    """Answer in a process of its own; with a base, until something differs from it."""
    library, name, value = change.get("library"), change.get("name"), change.get("value")
    own = f"{PACKAGE}.{record}"
    if library is not None:
        setattr(sys.modules[own], name, value)
        for module in [each for each in sys.modules if each.startswith("pfabrik.")]:
            for here, there in imported(module).items():
                if there == (own, name):
                    setattr(sys.modules[module], here, value)
        for k, each in enumerate(value if isinstance(value, tuple) else [value]):
            if hasattr(library, symbol(own, name)):
                kind = ctypes.c_double if isinstance(each, float) else ctypes.c_int64
                (kind * (k + 1)).in_dll(library, symbol(own, name))[k] = each
    out, k, began = [], 0, n_calls.value
    for each in MACHINES[record]:
        try:
            for solution in answers(each, record):
                out.append((each, [*measures(solution), n_calls.value - began]))
                if base is not None:
                    kinds = [a != b for a, b in zip(base[k][1], out[-1][1], strict=True)]
                    if any(kinds):
                        what = ("status", "distance", "answer", "steps")[kinds.index(True)]
                        sink.send(f"{what} ({each}, {k})")
                        return
                k += 1
        except Exception as error:
            if base is None:
                raise
            sink.send(f"{type(error).__name__} ({each})")
            return
    sink.send(out if base is None else "")


def in_a_process(*given: Any) -> Any:
    """What `answer` sends; what became of its process if it sends nothing."""
    source, sink = multiprocessing.Pipe(False)
    process = multiprocessing.get_context("fork").Process(target=answer, args=(*given, sink))
    process.start()
    sink.close()
    try:
        sent = source.recv() if source.poll(LIMIT) else "slower"
    except EOFError:
        sent = "crash"
    process.kill()
    process.join()
    return sent


def numbers(record: str) -> dict[str, Any]:
    """The constants of a record."""
    members = vars(importlib.import_module(f"{PACKAGE}.{record}"))
    return {
        name: value
        for name, value in members.items()
        if name.isupper() and isinstance(value, (int, float, tuple, dict))
    }


def times(value: Any, factor: float) -> Any:
    """A constant, or all numbers of one, times a factor."""
    if isinstance(value, dict):
        return {name: times(each, factor) for name, each in value.items()}
    if isinstance(value, tuple):
        return tuple(times(each, factor) for each in value)
    return type(value)(value * factor)


def ask(folder: Path, record: str, names: list[str]) -> None:
    """Print what changes with each constant of a record ten times as large or, if nothing does, a tenth."""
    library = load(folder)
    warnings.simplefilter("ignore")
    cores = sorted(os.sched_getaffinity(0))
    os.sched_setaffinity(0, {cores[os.getpid() % len(cores)]})  # one: what runs is counted without a lock
    for package in ("platform", "closure", "chains", "passes"):
        for found in pkgutil.iter_modules([str(ROOT / "src" / "pfabrik" / package)], f"pfabrik.{package}."):
            importlib.import_module(found.name)
    n_calls = ctypes.c_int64.in_dll(library, "N_CALLS")
    importers = {module: imported(module) for module in list(sys.modules) if module.startswith("pfabrik.")}
    outside = {
        there
        for module, constants in importers.items()
        if not module.startswith(PACKAGE)
        for there in constants.values()
    }
    for is_derived in (True, False):  # what follows from a machine is kept: the first where nothing is yet
        own = [name for name in numbers(record) if ((f"{PACKAGE}.{record}", name) in outside) == is_derived]
        own = [name for name in own if not names or name in names]
        for each in MACHINES[record] if own and not is_derived else ():
            list(answers(each, record))
        base = in_a_process(record, n_calls, {}, None) if own else None
        for name in own:
            for factor in (10, 0.1):
                change = {"library": library, "name": name, "value": times(numbers(record)[name], factor)}
                told = in_a_process(record, n_calls, change, base)
                if told:
                    break
            sys.stdout.write(f"{json.dumps([name, factor, told])}\n")
            sys.stdout.flush()


if __name__ == "__main__":
    verb, folder, *more = sys.argv[1:]
    if verb == "build":
        build(Path(folder))
    else:
        ask(Path(folder), more[0], more[1:])
