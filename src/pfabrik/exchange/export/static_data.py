"""C text in a given precision and with a given prefix; NamedTuples of arrays as static data."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Literal

import numpy as np

from ...to_c import Unsupported
from ...to_c.values import c_name
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
    """The tables of a file as constants, and the memory of its calls: the members of a struct, and what fills it.

    Parameters
    ----------
    program : the translated program.
    text : the translated program: fields of records that it does not read are left out.
    size : bytes of a real number.
    """

    def __init__(self, program: Any, text: str, size: int) -> None:
        self._program, self._size = program, size
        self._fields = fields_read(text)
        self.n_constant = self.n_memory = 0  # bytes, on 32 bits
        self._arrays: dict[int, tuple[str, Any]] = {}  # by identity, with the array, so that it stays alive
        self._structs: dict[str, str] = {}  # names of constant ones by their type and text
        self.lines = ["static const pfk_real pfk_nothing[1] = {0.0}; /* where there are no numbers */"]
        self.members: list[str] = []
        self.filling: list[str] = []
        self.places: list[str] = []  # of pointers to the memory's own arrays, and of these

    def constants(self, name: str, owner: Any, *fields: str) -> None:
        """Write the arrays in some fields of a NamedTuple as constants."""
        for field in (each for each in self._program.spell.members(type(owner)) if each in fields):
            for path, array in self._read_in(f"{name}.{field}", getattr(owner, field)):
                if place := self._taken(f"pfk_{path.replace('.', '_')}", path, array):
                    self.lines.append(self._constant(place, array))

    def memory(self, name: str, value: tuple[Any, ...]) -> None:
        """Write a NamedTuple; its arrays that are no constants are memory."""
        for path, array in self._read_in(name, value):
            own = path.replace(".", "_")
            if not self._taken(f"memory->{own}", path, array):
                continue
            kept = self._kept(array)
            self.n_memory += self._bytes(kept)
            self.members.append(f"    {self._element(array)} {own}[{array.size}];")
            if any(np.any(kept[field]) for field in kept.dtype.names or [()]):
                self.lines.append(self._constant(f"pfk_first_{own}", array))
                turns = f"for (i = 0; i < {array.size}; ++i)"
                self.filling.append(f"    {turns}\n        memory->{own}[i] = pfk_first_{own}[i];")
        self.members.append(f"    {self._program.spell.value(self._program.type_of(value))} {name};")
        self._fill(f"memory->{name}", name, value)

    def _fill(self, place: str, path: str, value: tuple[Any, ...]) -> None:
        """Statements that fill a NamedTuple in the memory; what is nothing is zero already."""
        for name in self._program.spell.members(type(value)):
            key, item, at = (type(value).__name__, name), getattr(value, name), f"{place}.{c_name(name)}"
            if key in self._program.layout.constant:
                self._assign(at, f"&{self._struct(f'{path}.{name}', item)}")
            elif isinstance(item, tuple):
                self._fill(at, f"{path}.{name}", item)
            elif not isinstance(item, np.ndarray):
                self._assign(at, self._scalar(item))
            elif key in self._program.layout.shapes:
                self._assign(at, self._pointer(item))
            else:
                self._assign(f"{at}.data", self._pointer(item))
                for k in range(item.ndim):
                    self._assign(f"{at}.n[{k}]", str(item.shape[k]))

    def _assign(self, place: str, text: str) -> None:
        self.n_memory += 4
        if text.startswith("memory->"):
            own, array = (each.removeprefix("memory->") for each in (place, text))
            self.places.append(f"    PFK_PLACES({own}, {array})")
        else:
            self.filling.append(f"    {place} = {text};")

    def _struct(self, path: str, value: tuple[Any, ...]) -> str:
        """The name of a constant NamedTuple."""
        kind = self._program.spell.value(self._program.type_of(value))
        text = self._made(path, value, "    ")
        name = f"pfk_{path.replace('.', '_')}"
        known = self._structs.setdefault(f"{kind} {text}", name)
        if known == name:
            self.lines.append(f"static const {kind} {name} = {text};")
        return known

    def _made(self, path: str, value: tuple[Any, ...], indent: str) -> str:
        """The initialiser of a constant NamedTuple, a line for each field."""
        lines = []
        for name in self._program.spell.members(type(value)):
            key, item = (type(value).__name__, name), getattr(value, name)
            if key in self._program.layout.constant:
                text = f"&{self._struct(f'{path}.{name}', item)}"
            elif isinstance(item, tuple):
                text = self._made(f"{path}.{name}", item, f"{indent}    ")
            elif not isinstance(item, np.ndarray):
                text = self._scalar(item)
            elif key in self._program.layout.shapes:
                text = self._pointer(item)
            else:
                text = f"{{{self._pointer(item)}, {{{', '.join(map(str, item.shape))}}}}}"
            lines.append(f"{indent}{text}")
        return "{\n" + ",\n".join(lines or [f"{indent}0"]) + f"\n{indent[4:]}}}"

    def _scalar(self, value: Any) -> str:
        return literal(value) if isinstance(value, float) else str(int(value))

    def _read_in(self, path: str, value: Any) -> Iterator[tuple[str, Any]]:
        """Arrays in a NamedTuple that are read, with the names that lead there."""
        if isinstance(value, np.ndarray):
            yield path, value
        elif isinstance(value, tuple):
            for name in self._program.spell.members(type(value)):
                yield from self._read_in(f"{path}.{name}", getattr(value, name))

    def _is_read(self, field: str) -> bool:
        return f"{field}_" in self._fields or field in self._fields

    def _taken(self, place: str, path: str, array: Any) -> str:
        """Where an array is from now on; nothing if it has a place, or needs none."""
        if id(array) in self._arrays or not array.size:
            return ""
        self._arrays[id(array)] = place, array
        self._require_fitting(path, array)
        return place

    def _kept(self, array: Any) -> Any:
        """An array with the fields of its records that are read."""
        read = [field for field in array.dtype.names or () if self._is_read(field)]
        return array[read] if read else array

    def _bytes(self, array: Any) -> int:
        fields = [array.dtype[field] for field in array.dtype.names or ()] or [array.dtype]
        sizes = [each.itemsize // 8 * (self._size if each.base.kind == "f" else 4) for each in fields]
        return int(array.size * sum(sizes))

    def _constant(self, name: str, array: Any) -> str:
        """An array as a constant."""
        kept = self._kept(array)
        self.n_constant += self._bytes(kept)
        return f"static const {self._element(array)} {name}[{array.size}] = {{\n{_values(kept)}\n}};"

    def _require_fitting(self, path: str, array: Any) -> None:
        fields = [array[name] for name in array.dtype.names or ()] or [array]
        for value in (value for field in fields if field.dtype.kind == "i" for value in np.ravel(field)):
            if not self._program.fits(value):
                raise Unsupported(f"{path} does not fit in an integer of {self._program.bits} bits: {value}")

    def _element(self, array: Any) -> str:
        return str(self._program.spell.value(self._program.type_of(array).element))

    def _pointer(self, array: Any) -> str:
        place = self._arrays[id(array)][0] if id(array) in self._arrays else "pfk_nothing"
        return place if place.startswith("memory->") else f"({self._element(array)} *){place}"


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
