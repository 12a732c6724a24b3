"""Compile all kernels to one extension module, in place: `python building/compile_kernels.py`.

Needs NumPy and a C compiler with Python's headers. Kernels are translated to C, in `build/kernels`; objects are kept
there by what they are made of: after an edit only the files that depend on it are compiled again.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import re
import shlex
import subprocess
import sys
import sysconfig
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

HERE = Path(__file__).parent
ROOT = HERE.parent
BUILD = ROOT / "build" / "kernels"
os.environ["PFABRIK_KERNELS"] = "python"
sys.path.insert(0, str(ROOT / "src"))

LEVELLED = ("legs.answer_blocks", "legs.margins_in_blocks", "clearance.capsule_clearance")
"""Kernels whose loops are vectors: compiled for each level of processors. On all others a level has no effect."""

LEVELS = {
    "v2": ["-march=x86-64-v2"],
    "v3": ["-march=x86-64-v3"],
    "v4": ["-march=x86-64-v4", "-mprefer-vector-width=512"],
}
FLAGS = ["-std=c99", "-O3", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"]
"""Without contraction the same arithmetic everywhere; what sets `errno` or traps could not be a vector."""

CHECKS = ["-DCHECKED", "-O1", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]

UNABLE = 3
"""Exit code where no compiler is."""


class Kernel(NamedTuple):
    """What the table of the module says of a kernel."""

    name: str
    takes: str
    gives: str
    words: int
    group: str


def compiler() -> list[str]:
    """The command of the C compiler."""
    return shlex.split(os.environ.get("CC", "clang" if os.name == "nt" else "cc"))


def macros() -> dict[str, str] | None:
    """What the compiler defines for its platform, with Python's headers; None if there is no compiler."""
    include = sysconfig.get_path("include")
    command = [*compiler(), "-E", "-dM", f"-I{include}", "-x", "c", "-"]
    try:
        ran = subprocess.run(command, input="#include <Python.h>\n", capture_output=True, text=True, check=False)
    except OSError:
        sys.stderr.write(f"kernels are not compiled: there is no C compiler ({compiler()[0]})\n")
        return None
    if ran.returncode:
        sys.stderr.write(f"kernels are not compiled: the C compiler finds no Python.h in {include} (python3-dev)\n")
        return None
    return dict(re.findall(r"#define (\w+) ?(.*)", ran.stdout))


def code_of(value: Any) -> str:
    """How `entry.c` reads an argument: numbers i, f, b; arrays with dimensions and bytes, in capitals if only read."""
    if isinstance(value, tuple):
        return "(" + "".join(map(code_of, value)) + ")"
    if hasattr(value, "dtype"):
        kind = "r" if value.dtype.names else value.dtype.kind
        return f"{kind if value.flags.writeable else kind.upper()}{value.ndim}{value.dtype.itemsize};"
    return "b" if isinstance(value, bool) else "i" if isinstance(value, int) else "f"


def words_of(t: Any) -> int:
    """How many eight-byte words an argument takes."""
    if isinstance(t, str):
        return 1
    return 1 + t.ndim if hasattr(t, "ndim") else sum(map(words_of, t.items))


def entry(made: Any, symbol: str, spell: Any) -> tuple[str, int]:
    """The function that `entry.c` calls, which takes arguments as words in memory; and how many."""
    given, at = ["memory"] if made.allocates else [], 0
    for t in made.arguments:
        reads = {"i": f"words[{at}]", "b": f"words[{at}] != 0", "f": f"((const union number *)words)[{at}].number"}
        if isinstance(t, str):
            given.append(reads[t])
        else:
            star = "*" if hasattr(t, "ndim") else ""
            given.append(f"{star}(const {spell.value(t)} *)(const void *)(words + {at})")
        at += words_of(t)
    call = f"{made.name}({', '.join(given)});"
    call = call if made.gives == "n" else f"results[0] = {call}"
    takes = "const integer *words, integer *results"
    text = f"int {symbol}({takes});\n"
    if made.allocates:
        text += f"static void run_{symbol}(arena *memory, {takes}) {{\n    (void)results;\n    {call}\n}}\n"
        call = f"return with_memory(run_{symbol}, words, results);"
    else:
        call += "\n    (void)results;\n    return 0;"
    return f"{text}int {symbol}({takes}) {{\n    {call}\n}}\n", at


def translate() -> tuple[dict[str, str], list[Kernel]]:
    """C text by its group, and all kernels; one group is compiled for each level."""
    from pfabrik.kernels._shipped import name_of
    from pfabrik.kernels.ahead import KERNELS
    from pfabrik.to_c import Program

    texts, table, host = {}, [], (HERE / "host.h").read_text(encoding="utf-8")
    names = {kernel: name_of(kernel) for kernel, _ in KERNELS}
    groups = {name: "blocks" if name in LEVELLED else name.partition(".")[0] for name in names.values()}
    for group in dict.fromkeys(groups.values()):
        program, entries = Program(), []
        for kernel, arguments in KERNELS:
            name = names[kernel]
            if groups[name] != group:
                continue
            made = program.add(kernel, *arguments)
            symbol = f"pf_{name.replace('.', '_')}"
            text, words = entry(made, f"LEVELLED({symbol})" if group == "blocks" else symbol, program.spell)
            entries.append(text.replace(f"run_LEVELLED({symbol})", f"run_{symbol}"))
            table.append(Kernel(name, "".join(map(code_of, arguments)), made.gives, words, group))
        head = "#define JOINED(a, b) a##_##b\n#define NAMED(a, b) JOINED(a, b)\n#define LEVELLED(a) NAMED(a, LEVEL)\n"
        texts[group] = program.text("\n".join([host, head if group == "blocks" else "", *entries]))
    return texts, table


def write(path: Path, data: bytes) -> None:
    """Write a file whole, or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f"{path.name}.{os.getpid()}")
    beside.write_bytes(data)
    os.replace(beside, path)


def table_of(kernels: list[Kernel], levels: list[str]) -> str:
    """The C text of the table of kernels."""
    rows = []
    for kernel in kernels:
        for k, level in enumerate(levels if kernel.group == "blocks" else [""]):
            symbol = "_".join([kernel.name.replace(".", "_"), *([level] if level else [])])
            place = k + 1 if level else 0
            rows.append(
                (symbol, f'"{symbol}", pf_{symbol}, "{kernel.takes}", \'{kernel.gives}\', {kernel.words}, {place}')
            )
    names = ", ".join(f'"{level}"' for level in levels if level) or "0"
    most_arrays = max(kernel.takes.count(";") for kernel in kernels)
    return "\n".join(
        [
            *(f"int pf_{symbol}(const word *, word *);" for symbol, _ in rows),
            "static const struct kernel KERNELS[] = {",
            *(f"    {{{row}}}," for _, row in rows),
            "};",
            f"static const char *const LEVELS[] = {{{names}}};",
            f"enum {{ N_KERNELS = {len(rows)}, N_LEVELS = {sum(map(bool, levels))},",
            f"       MOST_WORDS = {max(kernel.words for kernel in kernels)}, MOST_ARRAYS = {most_arrays} }};",
            "",
        ]
    )


def compiled(group: str, text: str, flags: list[str], name: str) -> Path:
    """The object of a C file; compiled, if there is none yet of the same text and command."""
    command = [*compiler(), *flags]
    key = hashlib.sha256("\n".join([text, *command]).encode()).hexdigest()[:16]
    source, made = BUILD / f"{group}.c", BUILD / f"{name}-{key}.o"
    if not made.exists():
        sys.stderr.write(".")
        sys.stderr.flush()
        beside = made.with_name(f"{made.name}.{os.getpid()}")
        subprocess.run([*command, "-c", str(source), "-o", str(beside)], check=True)
        os.replace(beside, made)
    return made


def build(platform: dict[str, str], into: Path, more: list[str]) -> Path:
    """Translate, compile what has changed, and link; where the module is."""
    texts, kernels = translate()
    levels = list(LEVELS) if "__x86_64__" in platform else [""]
    flags = [*FLAGS, *([] if "_WIN32" in platform else ["-fPIC"]), *more]
    jobs = []
    for group, text in texts.items():
        write(BUILD / f"{group}.c", text.encode())
        for level in levels if group == "blocks" else levels[:1]:
            own = [
                *flags,
                *LEVELS.get(level, []),
                *([f"-DLEVEL={level}" if level else "-DLEVEL="] if group == "blocks" else []),
            ]
            jobs.append((group, text, own, f"{group}-{level}" if group == "blocks" else group))
    write(BUILD / "table.h", table_of(kernels, levels).encode())
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        objects = list(pool.map(lambda job: compiled(*job), jobs))
    sys.stderr.write("\n" if sys.stderr.isatty() else "")
    for path in set() if more else set(BUILD.glob("*.o")) - set(objects):  # of sources that are no more
        path.unlink()
    module = into / ("_compiled.pyd" if "_WIN32" in platform else "_compiled.abi3.so")
    link = [*more, "-O2", "-fvisibility=hidden", f"-I{sysconfig.get_path('include')}", f"-I{BUILD}"]
    if "_WIN32" in platform:
        link += ["-shared", f"-L{Path(sys.base_prefix) / 'libs'}"]
    elif "__APPLE__" in platform:
        link += ["-bundle", "-undefined", "dynamic_lookup"]
    else:
        link += ["-shared", "-fPIC", "-s", "-Wl,-z,noexecstack", "-lm"]
    made = BUILD / f"{module.name}.{os.getpid()}"
    subprocess.run([*compiler(), str(HERE / "entry.c"), *map(str, objects), *link, "-o", str(made)], check=True)
    os.replace(made, module) if made.stat().st_dev == into.stat().st_dev else write(module, made.read_bytes())
    return module


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--into", type=Path, default=ROOT / "src" / "pfabrik" / "kernels", help="folder of the module")
    parser.add_argument("--checked", action="store_true", help="stop at an index outside its array, and for sanitizers")
    given = parser.parse_args()
    platform = macros()
    if platform is None:
        return UNABLE
    build(platform, given.into, CHECKS if given.checked else [])
    return 0


if __name__ == "__main__":
    sys.exit(main())
