"""The machines that come with the library: one mechanism file each."""

from __future__ import annotations

from importlib.resources import files
from importlib.resources.abc import Traversable

from ..errors import UnknownName

_SUFFIX = ".toml"


def catalog() -> tuple[str, ...]:
    """Names of the machines that come with the library, sorted; each can be given to `load`."""
    names = (entry.name for entry in files(__name__).iterdir())
    return tuple(sorted(name.removesuffix(_SUFFIX) for name in names if name.endswith(_SUFFIX)))


def catalog_file(name: str) -> Traversable:
    """The mechanism file of a catalogue machine; `UnknownName` if there is none of that name."""
    if name not in catalog():
        raise UnknownName("catalogue machine", name, catalog())
    return files(__name__) / f"{name}{_SUFFIX}"


def description(name: str) -> str:
    """What a catalogue machine is, in one line: the first of its file."""
    with catalog_file(name).open(encoding="utf-8") as file:
        return file.readline().removeprefix("#").strip()
