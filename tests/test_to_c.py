"""The subset of Python that kernels are written in, translated to C: each construct answers as in plain Python."""

from __future__ import annotations

import copy
import importlib.util
import inspect
import os
import re
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pfabrik.kernels._jit import SOURCES
from pfabrik.to_c import Program, Unsupported
from pfabrik.to_c.types import StructLayout
from subset import constructs
from subset.random_programs import Writer

WARNINGS = ["-Werror", "-Wall", "-Wextra", "-pedantic", "-Wconversion", "-Wshadow"]
OPTIONS = ["-std=c99", "-O1", "-ffp-contract=off"]
SANITIZERS = ["-DCHECKED", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)] or [os.environ.get("CC", "cc")]
CASES = 40
CONSTRUCTS = ("arithmetic", "functions", "conditions", "loops", "order", "tuples", "views", "records", "structures")
CONSTRUCTS += ("memory", "polymorphic")


def drawn(rng: np.random.Generator) -> dict[str, Any]:
    """An argument for each name that constructs have."""
    links = np.zeros(3, constructs.LINK)
    links["kind"], links["length"] = rng.integers(0, 3, 3), rng.normal(size=3)
    for field in ("axis", "frame", "places", "cube"):
        links[field] = rng.integers(-9, 9, links[field].shape)
    table = constructs.Table(rng.normal(size=4), links.copy(), rng.normal(size=(2, 2)))
    other = constructs.Table(rng.normal(size=5), links.copy(), rng.normal(size=(3, 1)))
    return {
        "x": rng.normal(size=6) * 3.0,
        "n": rng.integers(-50, 50, 2),
        "grid": rng.normal(size=(4, 4)),
        "cube": rng.normal(size=(2, 3, 4)),
        "links": links,
        "table": table,
        "other": other,
        "out": np.zeros(24),
    }


def arguments(function: Any, rng: np.random.Generator) -> list[Any]:
    """Arguments of a construct."""
    values = drawn(rng) | ({"n": 7} if function.__name__ == "memory" else {})
    return [values[name] for name in inspect.signature(function).parameters]


def arrays_of(values: list[Any]) -> list[Any]:
    """All arrays of arguments, in order."""
    found = []
    for value in values:
        found += (
            arrays_of(list(value)) if isinstance(value, tuple) else [value] if isinstance(value, np.ndarray) else []
        )
    return found


def c_of(program: Program, value: Any, name: str) -> tuple[str, str]:
    """Static data for an argument, with how it is given."""
    if isinstance(value, int):
        return "", str(value)
    t = program.type_of(value)
    if isinstance(value, tuple):
        parts = [c_of(program, item, f"{name}_{k}") for k, item in enumerate(value)]
        inner = ", ".join(
            given.replace(f"({program.spell.value(f)})", "") for f, (_, given) in zip(t.items, parts, strict=True)
        )
        return "".join(text for text, _ in parts), f"&({program.spell.value(t)}){{{inner}}}"
    shape = ", ".join(map(str, value.shape))
    data = f"static {program.spell.value(t.element)} {name}[{max(value.size, 1)}];\n"
    return data, f"({program.spell.value(t)}){{{name}, {{{shape}}}}}"


def executable(folder: Path, compiler: str, flags: list[str]) -> Path:
    """A program that reads the arrays of all cases and writes what constructs made of them."""
    program, rng = Program(), np.random.default_rng(0)
    data, calls = "", ""
    for name in CONSTRUCTS:
        function = SOURCES[getattr(constructs, name)].function
        values = arguments(function, rng)
        made = program.add(getattr(constructs, name), *values)
        told = [c_of(program, value, f"{name}_{k}") for k, value in enumerate(values)]
        data += "".join(text for text, _ in told)
        places = [line.split()[-1].split("[")[0] for text, _ in told for line in text.splitlines()]
        given = [*(["&memory"] if made.allocates else []), *(given for _, given in told)]
        calls += f"    for (int i = 0; i < {CASES}; i++) {{\n"
        calls += "".join(f"        if (!fread({place}, sizeof {place}, 1, stdin)) return 1;\n" for place in places)
        calls += f"        memory.next = memory.end - sizeof BUFFER;\n        {made.name}({', '.join(given)});\n"
        calls += "".join(f"        fwrite({place}, sizeof {place}, 1, stdout);\n" for place in places) + "    }\n"
    main = "#include <stdio.h>\nstatic char BUFFER[1 << 20];\n" + data
    main += "int main(void) {\n    arena memory = {BUFFER, BUFFER + sizeof BUFFER, NULL, NULL};\n"
    main += f"{calls}    return 0;\n}}\n"
    source, made_file = folder / f"{compiler}.c", folder / f"{compiler}{len(flags)}"
    source.write_text(program.text(main))
    subprocess.run([compiler, *OPTIONS, *WARNINGS, *flags, str(source), "-o", str(made_file), "-lm"], check=True)
    return made_file


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("flags", [[], SANITIZERS], ids=["plain", "sanitized"])
def test_constructs_answer_as_in_python(tmp_path: Path, compiler: str, flags: list[str]) -> None:
    if flags and not sanitizes(tmp_path, compiler):
        pytest.skip(f"{compiler} has no sanitizers")
    made, rng = executable(tmp_path, compiler, flags), np.random.default_rng(1)
    sent, expected, names = [], [], []
    for name in CONSTRUCTS:
        function = SOURCES[getattr(constructs, name)].function
        for _ in range(CASES):
            values = arguments(function, rng)
            sent += [array.tobytes() for array in arrays_of(values)]
            function(*values)
            expected += copy.deepcopy(arrays_of(values))
            names += [name] * len(arrays_of(values))
    ran = subprocess.run([str(made)], input=b"".join(sent), capture_output=True, check=False)
    assert ran.returncode == 0, ran.stderr.decode()[:2000]
    at = 0
    for name, array in zip(names, expected, strict=True):
        got = np.frombuffer(ran.stdout, array.dtype, array.size, at).reshape(array.shape)
        at += array.nbytes
        if name == "functions":  # the mathematics of the C library may round otherwise
            np.testing.assert_allclose(got, array, rtol=4e-16, err_msg=name)
        else:
            np.testing.assert_array_equal(got, array, err_msg=name)


def sanitizes(folder: Path, compiler: str) -> bool:
    """Whether a compiler's sanitizers are installed."""
    (folder / "empty.c").write_text("int main(void) { return 0; }\n")
    command = [compiler, *SANITIZERS, str(folder / "empty.c"), "-o", str(folder / "empty")]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


REFUSED = {
    "total changes its type": "total = 0; total = x[0]; x[0] = total",
    "a variable that changes its type": "total = 1; total += x[0]; x[0] = total",
    "read before it is assigned": "x[0] = later; later = 1.0",
    "perhaps read before it is assigned: value": """
        for i in range(x.shape[0]):
            value = x[i]
        x[0] = value""",
    "FunctionDef is not in the subset": """
        def inner():
            return 1.0
        x[0] = inner()""",
    "ListComp is not in the subset": "x[0] = [v for v in x][0]",
    "Raise is not in the subset": "raise ValueError",
    "a constant that is no number": "name = 'x'; x[0] = len(name)",
    "a slice with a step": "x[0] = x[::2][0]",
    "an element that is no number": "x[:] = 0.0",
    "a method that is not in the subset": "x[0] = x.mean()",
    "a call of what is no part of kernels": "x[0] = sum(x)",
    "arguments by name, or in a tuple": "x[0] = move(x=x)",
    "refused calls itself": "refused(x)",
    "a global array: SIZES": "x[0] = SIZES[0]",
    "a choice of values of different types": "x[0] = (x if x[0] > 0.0 else x[0])[0]",
    "`and` or `or` of what is not a truth value": "x[0] = x[0] or 1.0",
    "a parameter that becomes a new NamedTuple": "pair = Pair(pair.b, pair.a); x[0] = pair.a[0]",
    "must be computed before an expression in which it may not be evaluated": (
        "x[0] = 1.0 if x[0] > 0.0 and x[0] + move(x) > 1.0 else 0.0"
    ),
    "a function of math that is not in the subset": "x[0] = math.gamma(x[0])",
    "a loop with else": """
        for i in range(3):
            x[i] = 0.0
        else:
            x[0] = 1.0""",
    "arithmetic with two truth values": "x[0] = (x[0] > 0.0) + (x[1] > 0.0)",
    "a negative power of an integer": "x[0] = 10**-3",
    "an index that is computed twice, and changes": "x[int(x[0])] += move(x)",
    "an index that changes what it is an index of": "x[0] = pair_of(x)[int(move(x) - move(x)) % 2]",
    "`in` of what is not a tuple": "x[0] = 1.0 if x[0] in () else 0.0",
    "more than an integer of 32 bits": "x[0] = x[2147483648 - x.shape[0]]",
    "more than an integer of 32 bits: 65536 * 65536": "x[0] = 65536 * 65536",
    "more than an integer of 32 bits: 1 << 31": "x[0] = 1 << 31",
    "more than an integer of 32 bits: 2 ** 40": "x[0] = -(2**40)",
    "MANY of refused does not fit in an integer of 32 bits: 4294967296": "x[0] = MANY",
    "PAIR of refused does not fit in an integer of 32 bits": "x[0] = PAIR[1]",
}
"""What the subset has not: what the refusal says, and the body of a function."""

AROUND = """
import math
from typing import Any, NamedTuple

import numpy as np

from pfabrik.kernels._jit import routine

SIZES = np.zeros(3)
MANY, PAIR = 2**32, (1, 2**32)


class Pair(NamedTuple):
    a: Any
    b: Any


@routine
def move(x):
    x[0] += 1.0
    return float(x[0])


@routine
def pair_of(x):
    x[1] += 1.0
    return x[0], x[1]


@routine
def refused({arguments}) -> None:
{body}
"""


@pytest.mark.parametrize("what", REFUSED)
def test_what_the_subset_lacks_is_refused_with_its_place(what: str, tmp_path: Path) -> None:
    x, body = np.zeros(3), textwrap.indent(textwrap.dedent(REFUSED[what].strip("\n")), "    ")
    arguments = "pair, x" if "Pair(" in body else "x"
    made_of = imported(tmp_path / "refused.py", AROUND.format(arguments=arguments, body=body))
    samples = [made_of.Pair(x, x), x] if "Pair(" in body else [x]
    with pytest.raises(Unsupported) as told:
        Program(integer="int_fast32_t").add(made_of.refused, *samples)
    assert what in str(told.value)
    if "calls itself" not in what and "global" not in what and "fit" not in what:
        file, line = str(told.value).split(":")[:2]
        assert file == "refused.py" and int(line) > AROUND.count("\n") - 3


def test_integers_of_64_bits_hold_what_those_of_32_do_not(tmp_path: Path) -> None:
    text = AROUND.format(arguments="x", body="    x[0] = MANY + PAIR[1] + 65536 * 65536 + (1 << 31) + 2**40")
    made_of, program = imported(tmp_path / "refused.py", text), Program()
    program.add(made_of.refused, np.zeros(3))
    assert f"INT64_C({3 * 2**32 + 2**31 + 2**40})" in program.text()


FACTS = """
from typing import NamedTuple
from typing import Any

from pfabrik.kernels._jit import routine


class Own(NamedTuple):
    none: Any
    some: Any
    out: Any


@routine
def is_any(own: Own) -> bool:
    return len(own.none) > 0 and own.some[0] > 1e9


@routine
def costly(own: Own, k: int) -> float:
    return 17.0 * own.none[k]


@routine
def asked(own: Own) -> None:
    wanted = own.some
    for k in range(int(own.some[1])):
        own.out[0] += costly(own, k)
    if is_any(own):
        own.out[1] = 18.0
    if own.out[3] < 0.0:
        own.out[2] = 19.0 if own.some[0] > 1e9 else own.none[0]
    elif own.out[3] > 2.0 and own.none[3] > 20.0:
        own.out[2] = 21.0
    else:
        own.out[2] = wanted[2] + len(wanted)
"""


def test_what_would_need_an_element_of_an_empty_array_is_left_out(tmp_path: Path) -> None:
    """A loop over one, a branch that takes one, a call of what takes one; and lengths that are known are numbers."""
    made_of = imported(tmp_path / "facts.py", FACTS)
    own = made_of.Own(np.zeros(0), np.array([1.0, 0.0, 3.0]), np.zeros(4))
    shapes = {("Own", name): array.shape for name, array in own._asdict().items()}
    program = Program(facts={("Own", "none"): {0}}, layout=StructLayout(shapes=shapes))
    made = program.add(made_of.asked, own)
    text = program.text(f"int {made.name};\n")
    assert program.fields_read(text) == {("Own", "some"), ("Own", "out")}
    assert not re.search(r"costly|is_any|\b(17|18|20|21)\.0", text) and "19.0" in text
    arrays = "".join(f"static double {name}[4] = {{1.0, 0.0, 3.0, 0.0}};\n" for name in ("none", "some", "out"))
    given = f"({program.spell.value(made.arguments[0])}){{none, some, out}}"
    main = f"{arrays}int main(void) {{ asked(&{given}); return (int)out[2]; }}\n"
    (tmp_path / "facts.c").write_text(program.text(main))
    command = [COMPILERS[0], *OPTIONS, *WARNINGS, str(tmp_path / "facts.c"), "-o", str(tmp_path / "facts"), "-lm"]
    subprocess.run(command, check=True)
    assert subprocess.run([str(tmp_path / "facts")], check=False).returncode == 6


def test_elements_outside_an_array_are_found(tmp_path: Path) -> None:
    program = Program()
    made = program.add(constructs.last, np.zeros(3))
    main = f"int main(void) {{ return (int){made.name}(({program.spell.value(made.arguments[0])}){{NULL, {{0}}}}); }}\n"
    (tmp_path / "outside.c").write_text(program.text(main))
    command = [COMPILERS[0], "-DCHECKED", str(tmp_path / "outside.c"), "-o", str(tmp_path / "outside"), "-lm"]
    subprocess.run(command, check=True)
    ran = subprocess.run([str(tmp_path / "outside")], capture_output=True, text=True, check=False)
    assert ran.returncode != 0 and "index -1 of 0" in ran.stderr


@pytest.mark.parametrize("flag", ["-ffast-math", "-m32 -mfpmath=387"])
def test_arithmetic_that_is_not_ieee_is_refused(tmp_path: Path, flag: str) -> None:
    (tmp_path / "head.c").write_text(Program().text("int main(void) { return 0; }\n"))
    command = [COMPILERS[0], *flag.split(), "-E", str(tmp_path / "head.c")]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    if "-m32" in flag and "IEEE" not in ran.stderr and "x87" not in ran.stderr:
        pytest.skip("no compiler for x87 here")
    assert ran.returncode != 0 and "kernels need" in ran.stderr


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.campaign) for seed in range(1, 40))])
def test_random_programs_answer_as_in_python(tmp_path: Path, seed: int) -> None:
    made_of, program, main = imported(tmp_path / f"random_{seed}.py", Writer(seed).program(40)), Program(), ""
    rng, sent, expected = np.random.default_rng(seed), [], []
    for k in range(40):
        function = getattr(made_of, f"f{k}")
        try:
            made = program.add(function, np.zeros(6), np.zeros(2, np.int64))
        except Unsupported as told:
            assert "may not be evaluated" in str(told)
            continue
        main += "    if (!fread(x, sizeof x, 1, stdin) || !fread(n, sizeof n, 1, stdin)) return 1;\n"
        main += f"    {made.name}((Floats1){{x, {{6}}}}, (Ints1){{n, {{2}}}}), fwrite(x, sizeof x, 1, stdout);\n"
        x, n = rng.normal(size=6), rng.integers(-9, 9, 2)
        sent.append(x.tobytes() + n.tobytes())
        SOURCES[function].function(x, n)
        expected.append(x)
    main = f"#include <stdio.h>\nint main(void) {{\n    real x[6];\n    integer n[2];\n{main}    return 0;\n}}\n"
    (tmp_path / "random.c").write_text(program.text(main))
    made_file = tmp_path / "random"
    flags = [*OPTIONS, "-DCHECKED", "-lm"]
    subprocess.run(
        [COMPILERS[seed % len(COMPILERS)], str(tmp_path / "random.c"), "-o", str(made_file), *flags], check=True
    )
    ran = subprocess.run([str(made_file)], input=b"".join(sent), capture_output=True, check=False)
    assert ran.returncode == 0 and len(expected) > 20
    np.testing.assert_array_equal(np.frombuffer(ran.stdout).reshape(-1, 6), expected)


def imported(path: Path, text: str) -> Any:
    """The module of a text."""
    path.write_text(text)
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    return module
