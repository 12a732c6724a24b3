"""Kernels to object files: Numba is the front end, LLVM optimises and emits for a named processor of any platform."""

from __future__ import annotations

import pickle
import re
from typing import Any, NamedTuple

import llvmlite.binding as llvm
import numpy as np
from numba.core import codegen, compiler, types
from numba.core.compiler_lock import global_compiler_lock

from pfabrik.kernels._numba import pipeline
from pfabrik.kernels._numba.decorators import types_of

llvm.initialize_all_targets()
llvm.initialize_all_asmprinters()

RAISED = {MemoryError, ValueError, OverflowError, NotImplementedError, IndexError}
"""All that kernels may raise: no memory, sizes, the length of a range, arrays in another shape, places in a tuple."""


class Target(NamedTuple):
    """What code is emitted for: a platform, and a processor with its features."""

    triple: str
    processor: str
    features: str = ""

    def machine(self) -> Any:
        target = llvm.Target.from_triple(self.triple)
        return target.create_target_machine(
            cpu=self.processor, features=self.features, opt=3, reloc="pic", codemodel="default"
        )


class Lowered(NamedTuple):
    """A kernel with all its parts, as Numba lowers it, before any optimisation of the whole."""

    module: Any
    function: str
    gives: str  # n, i or b: nothing, an integer, a truth value


class _Kept:
    """The code of a kernel, prepared and left as it is."""

    def _optimize_final_module(self) -> None:
        self.prepare()  # type: ignore[attr-defined]

    def _finalize_final_module(self) -> None:
        pass


@global_compiler_lock
def lower(kernel: Any, arguments: tuple[Any, ...]) -> Lowered:
    """Let Numba lower a kernel for arguments of these types."""
    target, own = kernel.targetdescr, kernel._compiler.pipeline_class
    library = type("Kept", (_Kept, own.library), {})
    flags = compiler.Flags()
    target.options.parse_as_flags(flags, kernel.targetoptions)
    flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
    with pipeline.in_haste():
        compiled = compiler.compile_extra(
            target.typing_context,
            target.target_context,
            kernel.py_func,
            types_of(arguments),
            None,
            flags,
            {},
            pipeline_class=type("Keeping", (own,), {"library": library}),
        )
        compiled.library.finalize()
    kinds = {types.none: "n", types.int64: "i", types.boolean: "b"}
    gives = kinds[compiled.signature.return_type]
    return Lowered(compiled.library._final_module, compiled.fndesc.llvm_func_name, gives)


def code_of(value: Any) -> str:
    """How `entry.c` reads an argument: numbers i, f, b; arrays with dimensions and bytes, in capitals if only read."""
    if isinstance(value, tuple):
        return "(" + "".join(map(code_of, value)) + ")"
    if isinstance(value, np.ndarray):
        kind = "r" if value.dtype.names else value.dtype.kind
        return f"{kind if value.flags.writeable else kind.upper()}{value.ndim}{value.dtype.itemsize};"
    return "b" if isinstance(value, bool) else "i" if isinstance(value, int) else "f"


def wrap(module: Any, function: str, symbol: str) -> int:
    """Add a function that C calls: it takes arguments as eight-byte words, in Numba's order; how many there are."""
    own = module.get_function(function)
    taken = [str(argument.type) for argument in own.arguments]
    lines = ["%result_of = alloca i64", "%raised = alloca ptr"]
    lines += ["store i64 0, ptr %result_of", "store ptr null, ptr %raised"]
    given = ["ptr %result_of", "ptr %raised"]
    for i, kind in enumerate(taken[2:]):
        lines += [f"%at{i} = getelementptr i64, ptr %words, i64 {i}", f"%word{i} = load {kind}, ptr %at{i}"]
        given.append(f"{kind} %word{i}")
    lines += [
        f'%status = call i32 @"{function}"({", ".join(given)})',
        "%value = load i64, ptr %result_of",
        "store i64 %value, ptr %results",
        "%raise_to = getelementptr i64, ptr %results, i64 1",
        "%what = load ptr, ptr %raised",
        "store ptr %what, ptr %raise_to",
        "ret i32 %status",
    ]
    text = f'declare i32 @"{function}"({", ".join(taken)})\n'
    text += f"define hidden i32 @{symbol}(ptr %words, ptr %results) {{\n" + "\n".join(lines) + "\n}\n"
    added = llvm.parse_assembly(text)
    added.triple, added.data_layout = module.triple, module.data_layout
    module.link_in(added)
    return len(taken) - 2


def emit(lowered: Lowered, symbol: str, target: Target) -> tuple[bytes, int]:
    """The object file of a kernel for a processor; and how many words its function takes."""
    module, machine = lowered.module.clone(), target.machine()
    module.triple, module.data_layout = target.triple, str(machine.target_data)
    n_words = wrap(module, lowered.function, symbol)
    for function in module.functions:
        if not function.is_declaration and function.name != symbol:
            # counters of references: x86's atomics are left in Numba's, and `entry.c` has plain ones
            function.linkage = "available_externally" if function.name.startswith("NRT_") else "internal"
    for variable in module.global_variables:
        if not variable.is_declaration and variable.linkage.name != "private":
            variable.linkage = "internal"
    builder = codegen.create_pass_builder(machine, opt=3, loop_vectorize=True, slp_vectorize=False)
    passes = builder.getModulePassManager()
    passes.add_refprune_pass()
    passes.run(module, builder)
    module.verify()
    check_raised(symbol, module)
    return machine.emit_object(module), n_words


def check_raised(symbol: str, module: Any) -> None:
    """Refuse a kernel that may raise anything but what is expected of kernels: Numba keeps that pickled."""
    for variable in module.global_variables:
        if re.fullmatch(r"\.const\.pickledata\.[0-9a-f]+(\.\d+)?", variable.name):
            raised, *_ = pickle.loads(initial_bytes(str(variable)))
            if raised not in RAISED:
                raise SystemExit(f"{symbol} may raise {raised.__name__}")


def initial_bytes(text: str) -> bytes:
    """The bytes of a constant in LLVM's text: as they are, or a backslash and two hexadecimal digits."""
    escaped = text[text.index('c"') + 2 : text.rindex('"')]
    return re.sub(rb"\\([0-9A-F]{2})", lambda found: bytes.fromhex(found[1].decode()), escaped.encode("latin-1"))
