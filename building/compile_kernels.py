"""Compile all kernels to one extension module, in place: `python building/compile_kernels.py`.

Needs Numba and a C compiler with Python's headers; the module needs neither. Objects are kept in `build/kernels`, by
what they are made of: after an edit only the kernels that depend on it are compiled again.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import shlex
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import NamedTuple

HERE = Path(__file__).parent
ROOT = HERE.parent
os.environ["PFABRIK_KERNELS"] = "numba"
os.environ.pop("NUMBA_DISABLE_JIT", None)
sys.path.insert(0, str(ROOT / "src"))

SPLIT = ("legs.", "platform.")
"""Kernels of two processes: these share little with the others, and take about as long."""

LEVELLED = ("legs.answer_blocks", "legs.margins_in_blocks", "clearance.capsule_clearance")
"""Kernels whose loops are vectors: compiled for each level of processors. On all others a level has no effect."""

UNABLE = 3
"""Exit code where no compiler is."""

LEVELS = {"v2": ("x86-64-v2", ""), "v3": ("x86-64-v3", ""), "v4": ("x86-64-v4", "-prefer-256-bit")}


class Part(NamedTuple):
    """A kernel for one level: what it is made of, by hash, and what the table of the module says of it."""

    name: str
    level: str
    triple: str
    key: str
    takes: str

    @property
    def symbol(self) -> str:
        return "_".join([self.name.replace(".", "_"), *([self.level] if self.level else [])])

    @property
    def place(self) -> Path:
        return folder_for(self.triple) / f"{self.symbol}-{self.key[:16]}.o"


def folder_for(triple: str) -> Path:
    """Where objects are kept."""
    return ROOT / "build" / "kernels" / triple


def compiler() -> list[str]:
    """The command of the C compiler."""
    return shlex.split(os.environ.get("CC", "clang" if os.name == "nt" else "cc"))


def lacks() -> str:
    """What is missing to build: a sentence, or nothing."""
    include = sysconfig.get_path("include")
    command = [*compiler(), "-E", f"-I{include}", "-x", "c", "-"]
    try:
        ran = subprocess.run(command, input="#include <Python.h>\n", capture_output=True, text=True, check=False)
    except OSError:
        return f"there is no C compiler ({compiler()[0]})"
    return f"the C compiler finds no Python.h in {include}: its package is python3-dev" if ran.returncode else ""


def levels_of(triple: str, name: str) -> dict[str, tuple[str, str]]:
    """Levels that a kernel is compiled for, with processor and features of each."""
    if not triple.startswith("x86_64"):
        return {"": ("apple-m1" if "apple" in triple else "generic", "")}
    return LEVELS if name in LEVELLED else {"": LEVELS["v2"]}


def parts_for(triple: str) -> list[Part]:
    """All that the module consists of."""
    import llvmlite
    import numba
    from emit import code_of

    from pfabrik.kernels._numba.cache import digest_for
    from pfabrik.kernels._shipped import name_of
    from pfabrik.kernels.ahead import KERNELS

    own = hashlib.sha256((HERE / "emit.py").read_bytes()).hexdigest()
    parts = []
    for kernel, arguments in KERNELS:
        name, takes = name_of(kernel.py_func), "".join(map(code_of, arguments))
        for level, processor in levels_of(triple, name).items():
            made_of = [own, digest_for(kernel.py_func), takes, triple, *processor]
            made_of += [numba.__version__, llvmlite.__version__]
            key = hashlib.sha256("\n".join(made_of).encode()).hexdigest()
            parts.append(Part(name, level, triple, key, takes))
    return parts


def compile_parts(triple: str, is_first: bool) -> None:
    """Compile what has no object yet of one half of the kernels, with a dot for each."""
    from emit import Target, emit, lower

    from pfabrik.kernels._shipped import name_of
    from pfabrik.kernels.ahead import KERNELS

    missing = [part for part in parts_for(triple) if not part.place.exists()]
    for kernel, arguments in KERNELS:
        name = name_of(kernel.py_func)
        wanted = [part for part in missing if part.name == name]
        if not wanted or name.startswith(SPLIT) != is_first:
            continue
        lowered = lower(kernel, arguments)
        for part in wanted:
            target = Target(triple, *levels_of(triple, name)[part.level])
            data, n_words = emit(lowered, f"pf_{part.symbol}", target)
            write(part.place.with_suffix(".json"), json.dumps([lowered.gives, n_words]).encode())
            write(part.place, data)
        sys.stderr.write(".")
        sys.stderr.flush()


def write(path: Path, data: bytes) -> None:
    """Write a file whole, or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f"{path.name}.{os.getpid()}")
    beside.write_bytes(data)
    os.replace(beside, path)


def table(parts: list[Part], levels: list[str]) -> str:
    """The C text of the table of kernels."""
    told = [json.loads(part.place.with_suffix(".json").read_text()) for part in parts]
    lines = [f"int pf_{part.symbol}(const word *, word *);" for part in parts]
    lines.append("static const struct kernel KERNELS[] = {")
    for part, (gives, n_words) in zip(parts, told, strict=True):
        level = levels.index(part.level) + 1 if part.level else 0
        lines.append(f'    {{"{part.symbol}", pf_{part.symbol}, "{part.takes}", \'{gives}\', {n_words}, {level}}},')
    n_arrays, names = max(part.takes.count(";") for part in parts), ", ".join(f'"{level}"' for level in levels) or "0"
    return "\n".join(
        [
            *lines,
            "};",
            f"static const char *const LEVELS[] = {{{names}}};",
            f"enum {{ N_KERNELS = {len(parts)}, N_LEVELS = {len(levels)},",
            f"       MOST_WORDS = {max(n_words for _, n_words in told)}, MOST_ARRAYS = {n_arrays} }};",
            "",
        ]
    )


def link(parts: list[Part], triple: str, levels: list[str], into: Path) -> Path:
    """Link the module; where it is."""
    build = folder_for(triple)
    write(build / "table.h", table(parts, levels).encode())
    module = into / ("_compiled.pyd" if "windows" in triple else "_compiled.abi3.so")
    flags = ["-O2", "-fvisibility=hidden", f"-I{sysconfig.get_path('include')}", f"-I{build}"]
    if "windows" in triple:
        flags += ["-shared", f"-L{Path(sys.base_prefix) / 'libs'}"]
    elif "apple" in triple:
        flags += ["-bundle", "-undefined", "dynamic_lookup"]
    else:
        flags += ["-shared", "-fPIC", "-s", "-Wl,-z,noexecstack", "-lm"]
    made = build / f"{module.name}.{os.getpid()}"
    sources = [str(HERE / "entry.c"), *(str(part.place) for part in parts)]
    subprocess.run([*compiler(), *sources, *flags, "-o", str(made)], check=True)
    write(module, made.read_bytes())
    made.unlink()
    return module


def build(triple: str, into: Path) -> Path:
    """Compile what has changed, link, and write the card that the library compares the module with."""
    from pfabrik.kernels._shipped import CARD, sources_digest

    parts = parts_for(triple)
    if not all(part.place.exists() for part in parts):
        sys.stderr.write("compiling kernels ")
        halves = [[sys.executable, __file__, "--triple", triple, "--half", half] for half in ("first", "other")]
        running = [subprocess.Popen(half) for half in halves]
        failed = sum(process.wait() != 0 for process in running)
        sys.stderr.write("\n")
        if failed:
            raise SystemExit("kernels do not compile")
    levels = [level for level in LEVELS if any(part.level == level for part in parts)]
    module = link(parts, triple, levels, into)
    card = {"file": module.name, "module": hashlib.sha256(module.read_bytes()).hexdigest(), "sources": sources_digest()}
    write(into / CARD, json.dumps(card).encode())
    for path in folder_for(triple).glob("*.[oj]*"):  # of sources that are no more
        if path.with_suffix(".o") not in {part.place for part in parts}:
            path.unlink()
    return module


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--triple", help="another platform than this one, as LLVM names it; CC must compile for it")
    parser.add_argument("--into", type=Path, default=ROOT / "src" / "pfabrik" / "kernels", help="folder of the module")
    parser.add_argument("--half", choices=["first", "other"], help=argparse.SUPPRESS)
    given = parser.parse_args()
    if (missing := lacks()) and not given.half:
        sys.stderr.write(f"kernels are not compiled: {missing}; Numba compiles them when they are needed\n")
        return UNABLE
    import llvmlite.binding as llvm

    triple = given.triple or llvm.get_process_triple()
    if given.half:
        compile_parts(triple, given.half == "first")
        return 0
    build(triple, given.into)
    return 0


if __name__ == "__main__":
    sys.exit(main())
