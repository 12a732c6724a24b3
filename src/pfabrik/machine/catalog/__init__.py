"""The machines that come with the library, and files to start from for people who describe one of their own.

One mechanism file each; the first line of a file, a comment, says what it describes.
"""

from __future__ import annotations

from importlib.resources import files
from importlib.resources.abc import Traversable

from ...errors import UnknownName

_CATALOG = files(__name__)
_TEMPLATES = _CATALOG / "templates"
_SUFFIX = ".toml"


def catalog() -> tuple[str, ...]:
    """Names of the machines that come with the library, sorted; each can be given to `load`."""
    return _names(_CATALOG)


def catalog_file(name: str) -> Traversable:
    """The mechanism file of a catalogue machine; `UnknownName` if there is none of that name."""
    if name not in catalog():
        raise UnknownName("catalogue machine", name, catalog())
    return _CATALOG / f"{name}{_SUFFIX}"


def description(name: str) -> str:
    """What a catalogue machine is, in one line."""
    return _first_line(catalog_file(name).read_text(encoding="utf-8"))


def templates() -> tuple[str, ...]:
    """Names of the starting files, sorted."""
    return _names(_TEMPLATES)


def template(name: str) -> str:
    """The text of a starting file, whether its name is in capitals or not; `UnknownName` if there is none."""
    known = {each.lower(): each for each in templates()}
    if name.lower() not in known:
        raise UnknownName("kind of machine", name, templates())
    return (_TEMPLATES / f"{known[name.lower()]}{_SUFFIX}").read_text(encoding="utf-8")


def title(name: str) -> str:
    """What a starting file describes, in one line, without its name."""
    return _first_line(template(name)).partition(": ")[2]


def _names(folder: Traversable) -> tuple[str, ...]:
    names = (entry.name for entry in folder.iterdir())
    return tuple(sorted(name.removesuffix(_SUFFIX) for name in names if name.endswith(_SUFFIX)))


def _first_line(text: str) -> str:
    return text.partition("\n")[0].removeprefix("#").strip()
