"""Starting files for people who describe a machine of their own: one mechanism file, with comments, for each kind."""

from __future__ import annotations

from importlib.resources import files

from ..errors import UnknownName

_FOLDER = files("pfabrik") / "catalog" / "templates"
_SUFFIX = ".toml"


def templates() -> tuple[str, ...]:
    """Names of the starting files, sorted."""
    names = (entry.name for entry in _FOLDER.iterdir())
    return tuple(sorted(name.removesuffix(_SUFFIX) for name in names if name.endswith(_SUFFIX)))


def template(name: str) -> str:
    """The text of a starting file, whether its name is in capitals or not; `UnknownName` if there is none."""
    known = {each.lower(): each for each in templates()}
    if name.lower() not in known:
        raise UnknownName("template", name, templates())
    return (_FOLDER / f"{known[name.lower()]}{_SUFFIX}").read_text(encoding="utf-8")


def title(name: str) -> str:
    """What a starting file describes, in one line: the first of its text, without its name."""
    return template(name).partition("\n")[0].removeprefix("#").strip().partition(": ")[2]
