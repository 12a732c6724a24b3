"""Compile the kernels of a web page to WebAssembly: `python tools/kernels/compile_web.py`.

Needs clang and wasm-ld; the module, `src/pfabrik/view/page/kernels.wasm`, is a file of the repository, and holds the
digest of the C that it was made of. With `--check` it only says whether that is the C of today, which needs neither.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
OUT = ROOT / "src" / "pfabrik" / "view" / "page" / "kernels.wasm"
os.environ["PFABRIK_KERNELS"] = "python"
sys.path.insert(0, str(ROOT / "src"))

FLAGS = [
    "--target=wasm32", "-std=c99", "-Os", "-ffreestanding", "-nostdlib", "-ffp-contract=off", "-fno-math-errno",
    "-mbulk-memory", "-fvisibility=hidden", f"-I{HERE / 'wasm'}",
    "-Wl,--no-entry,--gc-sections,--strip-all,--allow-undefined", "-Wl,-z,stack-size=262144",
]  # fmt: skip
SECTION = b"\x06source"
"""Name of the section with the digest, after its length."""


def exports() -> list[tuple[Any, tuple[Any, ...]]]:
    """Functions that a page calls, with samples of their arguments."""
    import numpy as np

    from pfabrik.kernels.ahead import KERNELS
    from pfabrik.kernels.pose.answer_row import answer_row, weigh_limits
    from pfabrik.kernels.pose.answer_rows import _TABLES as tables
    from pfabrik.kernels.pose.assemble_row import assemble_row
    from pfabrik.kernels.pose.evaluate import evaluate_poses
    from pfabrik.kernels.pose.live_pose import _LIVE as live
    from pfabrik.kernels.pose.live_pose import go_on, new_live_scratch, place
    from pfabrik.kernels.pose.search_records import new_solutions
    from pfabrik.kernels.pose.tables import QUESTION, Start, new_answer_scratch, new_weighing_scratch

    start = Start(np.zeros((1, 4, 4)), np.zeros((1, 1)), np.zeros((1, 1)))
    common = tables, new_answer_scratch(tables), start
    question, answer = np.zeros(1, QUESTION)[0], new_solutions(1, 1, 1)
    evaluate = next(arguments for kernel, arguments in KERNELS if kernel is evaluate_poses)
    return [
        (answer_row, (*common, np.zeros((1, 4, 4)), question, answer)),
        (assemble_row, (*common, np.zeros((1, 1)), question, answer)),
        (weigh_limits, (*common[:2], new_weighing_scratch(tables), np.zeros((1, 4, 4)), answer, np.zeros(1))),
        (evaluate_poses, evaluate),
        (place, (live, new_live_scratch(live))),
        (go_on, (live, new_live_scratch(live), 0.0)),
    ]


def type_of(sample: Any, records: dict[Any, str]) -> Any:
    """The type of an argument, which may be one record of an array."""
    from pfabrik.to_c import types

    is_record = getattr(getattr(sample, "dtype", None), "names", None) and not sample.shape
    return types.element_of(sample.dtype, records) if is_record else types.type_of(sample, records)


def source() -> str:
    """The C text; every function takes the addresses of its arguments, which lie in the page's memory."""
    from pfabrik.to_c import Program

    called = exports()  # imported before the program reads names of records
    program, glue = Program(), []
    for function, samples in called:
        made = program.instance(function, tuple(type_of(sample, program.records) for sample in samples))
        takes, given = [], []
        for k, t in enumerate(made.arguments):
            if t == "i":
                takes.append(f"void *a{k}")
                given.append(f"(integer)(intptr_t)a{k}")
            elif hasattr(t, "ndim"):
                takes.append(f"const {program.spell.value(t)} *a{k}")
                given.append(f"*a{k}")
            else:
                takes.append(f"{program.spell.variable(t)}a{k}")
                given.append(f"a{k}")
        name, result = function.__name__, "void" if made.gives == "n" else "int"
        call = f"{made.name}({', '.join(given)});"
        glue.append(f'__attribute__((export_name("{name}")))')
        glue.append(
            f"{result} page_{name}({', '.join(takes)}) {{ {'' if result == 'void' else 'return (int)'}{call} }}"
        )
    glue.append("extern unsigned char __heap_base;")
    glue.append('__attribute__((export_name("free_memory"))) void *page_memory(void) { return &__heap_base; }\n')
    return program.text("\n".join(glue))


def digest_of(text: str) -> bytes:
    """The digest of C text and of what it is compiled with, whatever its comments say."""
    plain = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    header = (HERE / "wasm" / "math.h").read_text(encoding="utf-8")
    return hashlib.sha256("\n".join([plain, header, *FLAGS[:-3]]).encode()).digest()


def digest_in(module: bytes) -> bytes:
    """The digest that a module holds, at its end."""
    return module[-32:] if module[-32 - len(SECTION) : -32] == SECTION else b""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="compile nothing; end with 1 where the module is stale")
    check = parser.parse_args().check
    text = source()
    digest = digest_of(text)
    if check:
        is_stale = not OUT.exists() or digest_in(OUT.read_bytes()) != digest
        print("kernels.wasm is stale: make web" if is_stale else "kernels.wasm is of today")
        return int(is_stale)
    if shutil.which("clang") is None or shutil.which("wasm-ld") is None:
        print("kernels.wasm needs clang and wasm-ld (lld)")
        return 3
    with tempfile.TemporaryDirectory() as folder:
        path, made = Path(folder) / "page.c", Path(folder) / "kernels.wasm"
        path.write_text(text, encoding="utf-8")
        if "PFABRIK_KEEP" in os.environ:
            shutil.copy(path, os.environ["PFABRIK_KEEP"])
        subprocess.run([os.environ.get("CLANG", "clang"), *FLAGS, str(path), "-o", str(made)], check=True)
        payload = SECTION + digest
        OUT.write_bytes(made.read_bytes() + b"\x00" + bytes([len(payload)]) + payload)
    print(f"{OUT.relative_to(ROOT)}: {OUT.stat().st_size} bytes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
