"""Packages of ROS 2: their files from templates, and names and texts that are safe in them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from html import escape
from importlib import resources
from pathlib import Path

from ...common.whole_files import whole_path
from .export_c import require_identifier
from .static_data import comment


def package_name(folder: Path, name: str | None, ending: str) -> str:
    """The prefix of all names of a package: the one given, or the folder's name without an ending.

    Raises
    ------
    InvalidArgument : it is no identifier.
    """
    prefix = folder.resolve().name.removesuffix(ending) if name is None else name
    require_identifier(prefix)
    return prefix


def filled(package: str, files: Mapping[str, str], words: Mapping[str, str]) -> dict[str, str]:
    """Templates of a folder beside this file, with each @WORD@ replaced, by where they go, which has {name} in it."""
    templates, texts = resources.files(__package__).joinpath(package), {}
    for template, place in files.items():
        text = templates.joinpath(template).read_text(encoding="utf-8")
        texts[place.format(name=words["NAME"])] = re.sub("@([A-Z_]+)@", lambda word: words[word[1]], text)
    return texts


def write_package(folder: Path, texts: Mapping[str, str]) -> Path:
    """Write files by their place in a folder, which is made where it is not there."""
    for place, text in texts.items():
        file = folder / place
        file.parent.mkdir(parents=True, exist_ok=True)
        with whole_path(file) as part:
            part.write_text(text, encoding="utf-8")
    return folder


def plain(text: str) -> str:
    """Text safe in a comment and in a string of C++."""
    return comment(text).replace("\\", "/").replace('"', "'")


def in_markdown(text: str) -> str:
    """Text that is read as it is within a line, or a cell of a table, of Markdown."""
    printable = "".join(character if character.isprintable() else " " for character in text)
    return re.sub(r"[\\`*_\[\]<>&|~]", r"\\\g<0>", printable)


def in_xml(text: str) -> str:
    """Text safe in an element and in a comment of XML."""
    return escape(text).replace("--", "- -")
