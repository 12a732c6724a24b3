"""XML of other people: read with a limit on everything, with no entities, and with no file but what it includes."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree as ET
from xml.parsers import expat

from ..checks import require_path
from ..description.form_faults import shown
from ..errors import Fault, InvalidArgument, InvalidMechanism

LARGEST = 10_000_000
"""Largest text read [bytes], all included files together: a humanoid with every bolt has 1 MB."""

DEEPEST = 100
"""Deepest nesting of elements."""

KINDS: dict[str, Literal["mjcf", "urdf"]] = {"mujoco": "mjcf", "robot": "urdf"}
"""First element of a file -> its kind."""

MOST_ELEMENTS, MOST_INCLUDED = 200_000, 20


def read_xml(source: str | os.PathLike[str], root: str) -> ET.Element:
    """The element tree of a file, or of a text that begins with ``<``, with its includes put in.

    Parameters
    ----------
    root : name of the element that it must be.

    Raises
    ------
    InvalidMechanism : no such XML, or more than is read; with one fault, which names the file.
    InvalidArgument : neither a path nor a text.
    """
    if not isinstance(source, str | os.PathLike):
        raise InvalidArgument("source", shown(source), "a path, or the text of a model")
    budget = _Budget()
    if isinstance(source, str) and source.lstrip().startswith("<"):
        tree = _parsed(budget.spent(source.encode(), "text"), "text")
        folder = None
    else:
        path = Path(source)
        tree = _parsed(budget.read(path), str(path))
        folder = path.resolve().parent
    if tree.tag != root:
        raise fault("text" if folder is None else str(source), f"<{shown(tree.tag)[1:-1]}>", f"<{root}>")
    _include(tree, folder, budget, () if folder is None else (Path(source).resolve(),))
    return tree


def kind_of(path: str | os.PathLike[str]) -> Literal["mjcf", "urdf"]:
    """The kind of a file, by its first element; InvalidMechanism where it is neither."""
    tree = _parsed(_Budget().read(require_path("path", path)), os.fspath(path))
    if tree.tag not in KINDS:
        expected = " or ".join(f"<{tag}> ({kind.upper()})" for tag, kind in KINDS.items())
        raise fault(os.fspath(path), f"<{shown(tree.tag)[1:-1]}>", expected)
    return KINDS[tree.tag]


def fault(place: str, found: str, expected: str) -> InvalidMechanism:
    """The error of one thing wrong."""
    return InvalidMechanism([Fault(place, found, expected)])


def require_file(path: Path, expected: str) -> None:
    """A fault where there is no file of this name."""
    if not path.is_file():
        raise fault(str(path), "a directory or device" if path.exists() else "no such file", expected)


class _Budget:
    """The bytes that may still be read."""

    def __init__(self) -> None:
        self.remaining = LARGEST

    def spent(self, content: bytes, place: str) -> bytes:
        self.remaining -= len(content)
        if self.remaining < 0:
            raise fault(place, f"more than {LARGEST} bytes", f"at most {LARGEST}, with all that is included")
        return content

    def read(self, path: Path) -> bytes:
        require_file(path, "a model in XML")
        try:
            with path.open("rb") as file:
                return self.spent(file.read(self.remaining + 1), str(path))
        except OSError as error:
            raise fault(str(path), f"a file that cannot be read ({error.strerror})", "a readable file") from None


def _parsed(content: bytes, place: str) -> ET.Element:
    """The tree of a text whose size and declarations are checked first: nothing is expanded before."""
    parser = expat.ParserCreate()
    depth = count = 0

    def begin(*_: object) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if depth > DEEPEST or count > MOST_ELEMENTS:
            raise fault(place, "elements nested too deeply, or too many", f"{DEEPEST} levels, {MOST_ELEMENTS} elements")

    def end(*_: object) -> None:
        nonlocal depth
        depth -= 1

    def declared(*_: object) -> None:
        raise fault(place, "a document type declaration, with which XML pulls in what is elsewhere", "elements alone")

    parser.StartElementHandler, parser.EndElementHandler = begin, end
    parser.StartDoctypeDeclHandler = declared
    try:
        parser.Parse(content, True)
        return ET.fromstring(content)
    except (expat.ExpatError, ET.ParseError, ValueError, LookupError) as error:
        if isinstance(error, InvalidMechanism):
            raise
        raise fault(place, f"no XML: {error}", "XML") from None


def _include(element: ET.Element, folder: Path | None, budget: _Budget, around: tuple[Path, ...]) -> None:
    """Put the elements of included files where they are included, in place."""
    for place, child in reversed(list(enumerate(element))):
        if child.tag != "include":
            _include(child, folder, budget, around)
            continue
        path = _included(child.get("file", ""), folder, around)
        content = _parsed(budget.read(path), str(path))
        _include(content, folder, budget, (*around, path))
        element[place : place + 1] = list(content)


def _included(name: str, folder: Path | None, around: tuple[Path, ...]) -> Path:
    """The file of an include: within the folder of the model, and not around itself."""
    place = f"include '{name}'"
    if folder is None:
        raise fault(place, "an include in a text, which has no folder", "a model in a file, or in one piece")
    path = (folder / name).resolve()
    if not path.is_relative_to(folder):
        raise fault(place, "a file outside the folder of the model", f"one in {folder}")
    if len(around) > MOST_INCLUDED:
        raise fault(place, "files that include one another too deeply", f"{MOST_INCLUDED} levels")
    if path in around:
        raise fault(place, "a file that includes itself", "includes that end")
    return path
