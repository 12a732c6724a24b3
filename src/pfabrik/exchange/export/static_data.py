"""C text in a given precision and with a given prefix; NamedTuples of arrays as static data."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Literal

import numpy as np

from ...to_c import Unsupported
from .machine_data import Number

Precision = Literal["double", "float"]

_MATHS = re.compile(r"\b(sqrt|fabs|sin|cos|atan2|floor)\(")
_LITERAL = re.compile(r"(?<![\w.])(\d+\.\d*(?:[eE][+-]?\d+)?|\d+[eE][+-]?\d+)(?![\w.])")
_COMMENT = re.compile(r"(/\*.*?\*/|\"(?:[^\"\\]|\\.)*\")", re.DOTALL)


def in_words(text: str, name: str, precision: Precision) -> str:
    """A template with its prefix pfk replaced, and its numbers and mathematics in the given precision."""
    text = re.sub(r"\bpfk_", f"{name}_", re.sub(r"\bPFK_", f"{name.upper()}_", text))
    if precision == "double":
        return text
    parts = _COMMENT.split(text.replace("typedef double", "typedef float"))
    parts[::2] = [_LITERAL.sub(_single, _MATHS.sub(r"\1f(", part)) for part in parts[::2]]
    return "".join(parts)


def _single(match: re.Match[str]) -> str:
    """A number in single precision; zero if it is too small for that, which compilers warn of."""
    return f"{match[1]}f" if abs(float(match[1])) >= SMALLEST or not float(match[1]) else "0.0f"


SMALLEST = float(np.finfo(np.float32).tiny)


def literal(value: Number) -> str:
    """A number, or nested braces of numbers, with every digit of a double."""
    if np.ndim(value):
        return "{" + ", ".join(literal(item) for item in np.asarray(value)) + "}"
    number = float(value) + 0.0  # so that no -0.0 is written
    text = repr(number)
    return text if "." in text or "e" in text else f"{text}.0"


def comment(text: str) -> str:
    """Text safe in a C comment: it does not end the comment, and is printable ASCII."""
    plain = text.encode("ascii", "replace").decode().replace("*/", "* /").replace("/*", "/ *").replace("??", "? ?")
    return "".join(character if character.isprintable() else " " for character in plain)


def quoted(text: str) -> str:
    """A C string literal."""
    return '"' + comment(text).replace("\\", "\\\\").replace('"', '\\"') + '"'


def table(declaration: str, rows: Iterable[str]) -> Iterator[str]:
    """A table of rows, with one of zeros where there are none."""
    yield f"static const {declaration} = {{"
    yield ",\n".join(rows) or "    {0}"
    yield "};"
    yield ""


def words(name: str, texts: Sequence[str]) -> Iterator[str]:
    """Texts in rows of one width: pointers would have to be relocated when the file is loaded."""
    quotes = [quoted(text) for text in texts] or ['""']
    yield f"static const char pfk_{name}_words[][{max(map(len, quotes)) - 1}] = {{"
    yield from (f"    {text}," for text in quotes)
    yield "};"
    yield ""


PER_LINE = 120
"""Most characters of a line of numbers."""

NUMBERS_PER_LINE = 6
"""Most numbers of a record in a line."""


def fields_read(text: str) -> set[str]:
    """The fields of structs that C text reads."""
    return set(re.findall(r"(?:->|\.)(\w+)", text))


class StaticData:
    """Static data of a file: tables are constants, all other arrays memory of calls.

    Parameters
    ----------
    program : the translated program.
    text : the translated program: arrays, and fields of records, that it does not read are left out.
    size : bytes of a real number.
    """

    def __init__(self, program: Any, text: str, size: int) -> None:
        self._program, self._size = program, size
        self._fields = fields_read(text)
        self.n_constant = self.n_memory = 0  # bytes
        self._arrays: dict[int, tuple[str, Any]] = {}  # by identity, with the array, so that it stays alive
        self.lines = ["static pfk_real pfk_nothing[1]; /* where there are no numbers */"]

    def constants(self, name: str, owner: Any, *fields: str) -> None:
        """Write the arrays in some fields of a NamedTuple as constants."""
        for field in (each for each in self._program.spell.members(type(owner)) if each in fields):
            for path, array in self._read_in(f"{name}.{field}", getattr(owner, field)):
                self._put(path, array, is_constant=True)

    def variable(self, name: str, value: tuple[Any, ...]) -> None:
        """Write a NamedTuple; its arrays that are no constants are memory."""
        for path, array in self._read_in(name, value):
            self._put(path, array, is_constant=False)
        kind = self._program.spell.value(self._program.type_of(value))
        self.lines.append(f"static const {kind} pfk_{name} = {self._made(value)};")

    def _read_in(self, path: str, value: Any) -> Iterator[tuple[str, Any]]:
        """Arrays in a NamedTuple that are read, with the names that lead there."""
        if isinstance(value, np.ndarray):
            yield path, value
        elif isinstance(value, tuple):
            for name in self._program.spell.members(type(value)):
                yield from self._read_in(f"{path}.{name}", getattr(value, name))

    def _is_read(self, field: str) -> bool:
        return f"{field}_" in self._fields or field in self._fields

    def _put(self, path: str, array: Any, *, is_constant: bool) -> None:
        if id(array) in self._arrays or not array.size:
            return
        name = f"pfk_{path.replace('.', '_')}"
        self._arrays[id(array)] = name, array
        element = self._element(array)
        self._require_fitting(path, array)
        if read := [field for field in array.dtype.names or () if self._is_read(field)]:
            array = array[read]
        fields = [array.dtype[field] for field in array.dtype.names or ()] or [array.dtype]
        size = array.size * sum(each.itemsize // 8 * (self._size if each.base.kind == "f" else 4) for each in fields)
        self.n_constant, self.n_memory = self.n_constant + is_constant * size, self.n_memory + (not is_constant) * size
        qualifier = "static const" if is_constant else "static"
        is_zero = not is_constant and not any(np.any(array[field]) for field in array.dtype.names or [()])
        declared = f"{qualifier} {element} {name}[{array.size}]"
        self.lines.append(f"{declared};" if is_zero else f"{declared} = {{\n{_values(array)}\n}};")

    def _require_fitting(self, path: str, array: Any) -> None:
        fields = [array[name] for name in array.dtype.names or ()] or [array]
        for value in (value for field in fields if field.dtype.kind == "i" for value in np.ravel(field)):
            if not self._program.fits(value):
                raise Unsupported(f"{path} does not fit in an integer of {self._program.bits} bits: {value}")

    def _element(self, array: Any) -> str:
        return str(self._program.spell.value(self._program.type_of(array).element))

    def _made(self, value: Any) -> str:
        if isinstance(value, tuple):
            members = self._program.spell.members(type(value))
            made = [self._member(type(value).__name__, name, getattr(value, name)) for name in members]
            return "{" + (", ".join(made) or "0") + "}"
        if not isinstance(value, np.ndarray):
            return literal(value) if isinstance(value, float) else str(int(value))
        return f"{{{self._pointer(value)}, {{{', '.join(map(str, value.shape))}}}}}"

    def _member(self, owner: str, name: str, value: Any) -> str:
        return self._pointer(value) if (owner, name) in self._program.shapes else self._made(value)

    def _pointer(self, array: Any) -> str:
        known = self._arrays.get(id(array))
        return f"({self._element(array)} *){'pfk_nothing' if known is None else known[0]}"


def _values(array: Any) -> str:
    if array.dtype.names:
        return ",\n".join("    {\n" + "\n".join(_members(record)) + "\n    }" for record in array.ravel())
    lines, line = [], "   "
    for text in map(_number, array.ravel()):
        if len(line) + len(text) + 2 > PER_LINE:
            lines.append(line)
            line = "   "
        line += f" {text},"
    return "\n".join([*lines, line.removesuffix(",")])


def _members(record: Any) -> Iterator[str]:
    """The members of a record in lines, each after a comment with their names."""
    group: list[str] = []
    for name in record.dtype.names:
        is_long = bool(record.dtype[name].shape)
        if group and (is_long or len(group) == NUMBERS_PER_LINE):
            yield _labelled(group, record)
            group = []
        group.append(name)
        if is_long:
            yield _labelled(group, record)
            group = []
    if group:
        yield _labelled(group, record)


def _labelled(names: Sequence[str], record: Any) -> str:
    return f"        /* {', '.join(names)} */ {', '.join(_number(record[name]) for name in names)},"


def _number(value: Any) -> str:
    if np.ndim(value):
        return "{" + ", ".join(map(_number, np.ravel(value))) + "}"
    if isinstance(value, (np.integer, int)):
        return str(int(value))
    number = float(value)
    return "INFINITY" if number == np.inf else "-INFINITY" if number == -np.inf else literal(number)
