"""Compile all kernels to one extension module, in place: `python tools/kernels/compile_kernels.py`.

Needs NumPy and a C compiler with Python's headers. Kernels are translated to C, in `build/kernels`, where that has not
been done from the same sources: an sdist has the C with it. Objects are kept there by what they are made of: after an
edit only the files that depend on it are compiled again.
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
ROOT = HERE.parents[1]
BUILD = ROOT / "build" / "kernels"
SOURCES = BUILD / "sources.sha256"
"""Hash of what the C text was made of."""

LEVELLED = (
    *("legs.answer_blocks", "legs.margins_in_blocks"),
    *("pose.assemble_in_blocks", "clearance.capsule_clearance"),
)
"""Kernels whose loops are vectors: compiled for each level of processors. On all others a level has no effect."""

LEVELS = {
    "v2": ["-march=x86-64-v2"],
    "v3": ["-march=x86-64-v3"],
    "v4": ["-march=x86-64-v4", "-mprefer-vector-width=512"],
}
FLAGS = ["-std=c99", "-O3", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"]
"""Without contraction the same arithmetic everywhere; what sets `errno` or traps could not be a vector."""

CHECKS = ["-DCHECKED", "-O1", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]

ALONE = {"pose.nearest_pose": "nearest", "joints.close": "close", "joints.rates": "rates"}
"""Kernels whose C is a file of its own, by the file's name; else it has all of a folder."""

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


def hash_of_sources() -> str:
    """Hash of all that the C text is made of."""
    package = ROOT / "src" / "pfabrik"
    files = [*(package / "kernels").rglob("*.py"), *(package / "to_c").glob("*.*"), HERE / "host.h", Path(__file__)]
    return hashlib.sha256(b"".join(hashlib.sha256(path.read_bytes()).digest() for path in sorted(files))).hexdigest()


def translate() -> None:
    """Write C text by groups of kernels, and their table; what is there from the same sources stays."""
    made_of = hash_of_sources()
    if SOURCES.exists() and SOURCES.read_text(encoding="utf-8") == made_of:
        return
    os.environ["PFABRIK_KERNELS"] = "python"
    sys.path.insert(0, str(ROOT / "src"))
    from pfabrik.kernels._shipped import name_of
    from pfabrik.kernels.ahead import KERNELS
    from pfabrik.to_c import Program

    program, table = Program(), list[Kernel]()
    entries: dict[str, list[str]] = {}
    for kernel, arguments in KERNELS:
        name = name_of(kernel)
        group = "blocks" if name in LEVELLED else ALONE.get(name) or name.partition(".")[0]
        made, symbol = program.add(kernel, *arguments), f"pf_{name.replace('.', '_')}"
        text, words = entry(made, f"LEVELLED({symbol})" if group == "blocks" else symbol, program.spell)
        entries.setdefault(group, []).append(text.replace(f"run_LEVELLED({symbol})", f"run_{symbol}"))
        table.append(Kernel(name, "".join(map(code_of, arguments)), made.gives, words, group))
    for path in BUILD.glob("*.c"):
        path.unlink()
    for group, texts in entries.items():
        write(BUILD / f"{group}.c", program.text("\n".join([host(group), *texts])).encode())
    write(BUILD / "table.h", table_of(table).encode())
    write(SOURCES, made_of.encode())


def host(group: str) -> str:
    """What stands between the functions of a group and those that Python calls."""
    head = "#define JOINED(a, b) a##_##b\n#define NAMED(a, b) JOINED(a, b)\n#define LEVELLED(a) NAMED(a, LEVEL)\n"
    return "\n".join([(HERE / "host.h").read_text(encoding="utf-8"), head if group == "blocks" else ""])


def run(command: list[str]) -> None:
    """Run the compiler."""
    subprocess.run(command, check=True)


def write(path: Path, data: bytes) -> None:
    """Write a file whole, or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f"{path.name}.{os.getpid()}")
    beside.write_bytes(data)
    os.replace(beside, path)


def table_of(kernels: list[Kernel]) -> str:
    """The C text of the table of kernels; of those that are there for each level of a processor, too."""
    declared, rows = list[str](), list[str]()
    for kernel in kernels:
        plain = kernel.name.replace(".", "_")
        rest = f"\"{kernel.takes}\", '{kernel.gives}', {kernel.words}"
        by_level = {f"{plain}_{level}": k for k, level in enumerate(LEVELS, 1)} if kernel.group == "blocks" else {}
        both = ["#ifdef __x86_64__"], ["#else"], ["#endif"]
        for lines, row in (
            (declared, "int pf_{0}(const word *, word *);"),
            (rows, f'    {{{{"{{1}}", pf_{{0}}, {rest}, {{2}}}}}},'),
        ):
            usual = [row.format(f"{plain}_" if by_level else plain, plain, 0)]
            levelled = [row.format(name, name, k) for name, k in by_level.items()]
            lines += [*both[0], *levelled, *both[1], *usual, *both[2]] if by_level else usual
    levels = ", ".join(f'"{level}"' for level in LEVELS)
    return "\n".join(
        [
            *declared,
            "static const struct kernel KERNELS[] = {",
            *rows,
            "};",
            "#ifdef __x86_64__",
            f"static const char *const LEVELS[] = {{{levels}}};",
            f"enum {{ N_LEVELS = {len(LEVELS)} }};",
            "#else",
            "static const char *const LEVELS[] = {0};",
            "enum { N_LEVELS = 0 };",
            "#endif",
            "enum { N_KERNELS = sizeof KERNELS / sizeof KERNELS[0],",
            f"       MOST_WORDS = {max(kernel.words for kernel in kernels) or 1},",
            f"       MOST_ARRAYS = {max(kernel.takes.count(';') for kernel in kernels) or 1} }};",
            "",
        ]
    )


def compiled(source: Path, flags: list[str], name: str) -> Path:
    """The object of a C file; compiled, if there is none yet of the same text and command."""
    command = [*compiler(), *flags]
    text = re.sub(r"/\*.*?\*/", "", source.read_text(encoding="utf-8"), flags=re.DOTALL)  # comments have line numbers
    key = hashlib.sha256("\n".join([text, *command]).encode()).hexdigest()[:16]
    made = BUILD / f"{name}-{key}.o"
    if not made.exists():
        sys.stderr.write(".")
        sys.stderr.flush()
        beside = made.with_name(f"{made.name}.{os.getpid()}")
        run([*command, "-c", str(source), "-o", str(beside)])
        os.replace(beside, made)
    return made


def link(platform: dict[str, str], files: list[Path], tables: Path, module: Path, more: list[str]) -> None:
    """Make an extension module from C files or objects, with the table of their kernels in a folder."""
    flags = [*more, "-O2", "-fvisibility=hidden", f"-I{sysconfig.get_path('include')}", f"-I{tables}"]
    if "_WIN32" in platform:
        flags += ["-shared", f"-L{Path(sys.base_prefix) / 'libs'}"]
    elif "__APPLE__" in platform:
        flags += ["-bundle", "-undefined", "dynamic_lookup"]
    else:
        flags += ["-shared", "-fPIC", "-s", "-Wl,-z,noexecstack", "-lm"]
    made = tables / f"{module.name}.{os.getpid()}"
    run([*compiler(), str(HERE / "entry.c"), *map(str, files), *flags, "-o", str(made)])
    os.replace(made, module) if made.stat().st_dev == module.parent.stat().st_dev else write(module, made.read_bytes())


def file_name(platform: dict[str, str]) -> str:
    """How the module's file is called."""
    return "_compiled.pyd" if "_WIN32" in platform else "_compiled.abi3.so"


def flags_for(platform: dict[str, str]) -> list[str]:
    """How C is compiled to objects of a module."""
    return [*FLAGS, *([] if "_WIN32" in platform else ["-fPIC"])]


def build(platform: dict[str, str], into: Path, more: list[str]) -> None:
    """Translate, compile what has changed, and link."""
    translate()
    levels = LEVELS if "__x86_64__" in platform else {"": []}
    jobs = []
    for source in sorted(BUILD.glob("*.c"), key=lambda path: -path.stat().st_size):  # what takes longest first
        group, flags = source.stem, [*flags_for(platform), *more]
        if group == "blocks":
            jobs += [
                (source, [*flags, *own, f"-DLEVEL={level}"], f"{group}-{level}".rstrip("-"))
                for level, own in levels.items()
            ]
        else:
            jobs.append((source, flags, group))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        objects = list(pool.map(lambda job: compiled(*job), jobs))
    sys.stderr.write("\n" if sys.stderr.isatty() else "")
    for path in set() if more else set(BUILD.glob("*.o")) - set(objects):  # of sources that are no more
        path.unlink()
    link(platform, objects, BUILD, into / file_name(platform), more)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--into", type=Path, default=ROOT / "src" / "pfabrik" / "kernels", help="folder of the module")
    parser.add_argument("--checked", action="store_true", help="stop at an index outside its array, and for sanitizers")
    parser.add_argument("--translate", action="store_true", help="write the C only")
    given = parser.parse_args()
    if given.translate:
        translate()
        return 0
    platform = macros()
    if platform is None:
        return UNABLE
    build(platform, given.into, CHECKS if given.checked else [])
    return 0


if __name__ == "__main__":
    sys.exit(main())
