"""XML of other people: read with a limit on everything, with no entities, and with no file but what it includes."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree as ET
from xml.parsers import expat

import numpy as np

from ...common.arrays import Floats
from ...common.checks import require_path
from ...errors import Fault, InvalidArgument, InvalidMechanism
from ...machine.description.form_faults import shown
from ...machine.files.reading import MOST_JOINTS

LARGEST = 10_000_000
"""Largest text read [bytes], all included files together: a humanoid with every bolt has 1 MB."""

DEEPEST = 100
"""Deepest nesting of elements."""

Kind = Literal["mjcf", "urdf", "sdf"]
KINDS: dict[str, Kind] = {"mujoco": "mjcf", "robot": "urdf", "sdf": "sdf"}
"""First element of a file -> its kind."""

OF_XML = ("xmlns", "xml", "xsi")
"""Prefixes of attributes that say something of the text, and nothing of the model."""

MOST_ELEMENTS, MOST_INCLUDED = 200_000, 20

MOST_OF = {
    **dict.fromkeys(("links", "bodies", "frames", "fixed joints"), 5_000),
    "joints": MOST_JOINTS,
    "loops": 100,
    **dict.fromkeys(("sites", "geoms"), 20_000),
    "elements": MOST_ELEMENTS,
}
"""Most parts of a robot: of a humanoid with every bolt, ten times; joints as of a mechanism's file."""

PARTS = {
    "link": "links",
    "body": "bodies",
    "frame": "frames",
    "site": "sites",
    "geom": "geoms",
    "joint": "joints",
    "freejoint": "joints",
    **dict.fromkeys(("connect", "weld", "spatial", "loop_joint", "constraint", "loop"), "loops"),
}
"""Tag -> what it is counted as."""


def read_xml(source: str | os.PathLike[str], *kinds: Kind) -> ET.Element:
    """The element tree of a file, or of a text that begins with ``<``; tags without prefixes, a MuJoCo model's includes
    put in.

    Parameters
    ----------
    kinds : what it may be.

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
    kind = _kind(tree, "text" if folder is None else str(source), kinds)
    if kind == "mjcf":
        _include(tree, folder, budget, () if folder is None else (Path(source).resolve(),))
    _require_few(tree, "text" if folder is None else str(source))
    return tree


def _require_few(tree: ET.Element, place: str) -> None:
    """Refuse a model of more parts than any has, before anything is made of it."""
    counts, waiting = Counter[str](), [(tree, 1)]
    while waiting:
        element, copies = waiting.pop()
        if element.tag == "replicate":
            copies *= max(1, int(number(element, "count")))
        part = PARTS.get(element.tag, "")
        counts[f"fixed {part}" if element.get("type") == "fixed" else part] += copies
        counts["elements"] += copies
        waiting += [(child, copies) for child in element]
    for part, most in MOST_OF.items():
        if counts[part] > most:
            raise fault(place, f"{counts[part]} {part}, with all copies", f"at most {most}")


def kind_of(path: str | os.PathLike[str]) -> Kind:
    """The kind of a file, by its first element; InvalidMechanism where it is none that is read.

    Parameters
    ----------
    path : str or PathLike
        The file.
    """
    tree = _parsed(_Budget().read(require_path("path", path)), os.fspath(path))
    return _kind(tree, os.fspath(path), tuple(KINDS.values()))


def _kind(tree: ET.Element, place: str, kinds: tuple[Kind, ...]) -> Kind:
    if KINDS.get(tree.tag) not in kinds:
        expected = " or ".join(f"<{tag}> ({kind.upper()})" for tag, kind in KINDS.items() if kind in kinds)
        raise fault(place, f"<{shown(tree.tag)[1:-1]}>", expected)
    return KINDS[tree.tag]


def numbers_in(text: str, count: int, endless: bool = False) -> Floats | None:
    """The numbers of a text, with blanks between them, (count,); None where it has others.

    Parameters
    ----------
    endless : True where they may be infinite.
    """
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        return None
    return values if values.shape == (count,) and (np.isfinite(values) | (endless & np.isinf(values))).all() else None


def number_text(values: Iterable[float]) -> str:
    """Numbers as an attribute, each the shortest that reads back as it is."""
    return " ".join(repr(float(value) + 0.0) for value in values)


def number(element: ET.Element | None, key: str, default: float = 0.0) -> float:
    """The first number of an attribute, or of an element within; the default where there is none."""
    text = "" if element is None else element.get(key) or element.findtext(key) or ""
    value = numbers_in(" ".join(text.split()[:1]), 1)
    return default if value is None else float(value[0])


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
    """The tree of a text, checked as it is read, so that nothing is expanded; prefixes of names are left out."""
    parser, builder = expat.ParserCreate(), ET.TreeBuilder()
    depth = count = 0

    def begin(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if depth > DEEPEST or count > MOST_ELEMENTS:
            raise fault(place, "elements nested too deeply, or too many", f"{DEEPEST} levels, {MOST_ELEMENTS} elements")
        if tag.startswith("xacro:"):
            raise fault(place, f"<{shown(tag)[1:-1]}>, of a file for xacro", "what `xacro FILE` makes of it")
        own = {key.rpartition(":")[2]: text for key, text in attributes.items() if key.partition(":")[0] not in OF_XML}
        builder.start(tag.rpartition(":")[2], own)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag.rpartition(":")[2])

    def declared(*_: object) -> None:
        raise fault(place, "a document type declaration, with which XML pulls in what is elsewhere", "elements alone")

    parser.StartElementHandler, parser.EndElementHandler = begin, end
    parser.CharacterDataHandler, parser.StartDoctypeDeclHandler = builder.data, declared
    try:
        parser.Parse(content, True)
    except (expat.ExpatError, ValueError, LookupError) as error:
        if isinstance(error, InvalidMechanism):
            raise
        raise fault(place, f"no XML: {error}", "XML") from None
    return builder.close()


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
