"""The Python reference: every public name is on one page, and docstrings say of each name what its signature says."""

from __future__ import annotations

import ast
import builtins
import importlib.util
import inspect
import re
import sys
import tomllib
import typing
from functools import cache
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, NamedTuple

import pytest

import pfabrik as pf
from test_public_types import signatures

ROOT = Path(__file__).parents[1]
SCALARS = ("bool", "int", "float", "str")
CONTAINERS = ("tuple", "list", "dict", "mapping", "sequence", "iterable")
FOREIGN = ("PathLike", "RigidTransform", "Rotation", "Axes", "Figure", "Executor", "MjModel")
"""Classes of other libraries in types."""

SHAPE, CHOICES = r"\((?:\.\.\.|\w+)(?:, \w+)*,?\)", r'\{"[^{}]+"\}'
KIND = r"\w+(?: of \w+)*(?: to \w+(?: of \w+)*)?"
ALTERNATIVE = rf"(?:{CHOICES}|{SHAPE}|{KIND}(?: {SHAPE})?)"


@cache
def generator() -> ModuleType:
    """The script tools/site/reference.py as a module."""
    spec = importlib.util.spec_from_file_location("reference_pages", ROOT / "tools" / "site" / "reference.py")
    assert spec and spec.loader
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@cache
def words() -> frozenset[str]:
    """Words that a type may be made of: those of Python, those of other libraries, and every class of this one."""
    trees = (ast.parse(path.read_text(encoding="utf-8")) for path in (ROOT / "src" / "pfabrik").rglob("*.py"))
    own = {each.name for tree in trees for each in tree.body if isinstance(each, ast.ClassDef)}
    return frozenset(
        {*SCALARS, *CONTAINERS, *FOREIGN, *own, *pf.__all__, "Options", "array", "callable", "object", "None"}
    )


class Entry(NamedTuple):
    """An item of a section: its names, its type without ``, optional``, if it is optional, and its text."""

    section: str
    names: list[str]
    type: str
    is_optional: bool
    text: str


def entries_of(documented: object) -> list[Entry]:
    """The items of the sections of a docstring in NumPy's style."""
    sections = re.split(r"^(\w+)\n-{3,}\n", inspect.getdoc(documented) or "", flags=re.MULTILINE)[1:]
    found = []
    for section, body in zip(sections[::2], sections[1::2], strict=True):
        for head, text in re.findall(r"^(\S.*)\n((?:(?:    .*)?\n?)*)", body, re.MULTILINE):
            names, _, kind = head.partition(" : ") if section in ("Parameters", "Attributes") else ("", "", head)
            plain = kind.removesuffix(", optional")
            found.append(Entry(section, names.split(", "), plain, plain != kind, text.strip()))
    return found


def is_type(text: str) -> bool:
    """True for words of types, as in ``mapping of str to array (..., 3) or None``, and for choices in braces."""
    if not re.fullmatch(rf"{ALTERNATIVE}(?: or {ALTERNATIVE})*", text):
        return False
    return set(re.sub(rf"{CHOICES}|{SHAPE}", "", text).split()) <= words() | {"of", "to", "or"}


def documented() -> dict[str, Any]:
    """All that the reference shows, by name: functions, classes, and the methods and properties of classes."""
    pages = generator()
    shown = {name: pages.public(name) for name in pages.public_names()}
    shown |= {name: pages.at(place) for page in pages.PAGES.values() for name, place in pages.parts_of(page)}
    return shown | {place: each for name in shown for place, each in signatures(shown[name], name)}


SHOWN = documented()
FUNCTIONS = {name: each for name, each in SHOWN.items() if isinstance(each, FunctionType)}
CLASSES = {name: each for name, each in SHOWN.items() if inspect.isclass(each)}
ENTRIES = {name: entries_of(each) for name, each in SHOWN.items()}
ERRORS = {*vars(builtins), *pf.errors.__all__, "NoEndEffector"}


class Lenient(dict[str, Any]):
    """Names of a module, where those that only type checkers import are `object`."""

    def __missing__(self, name: str) -> Any:
        return getattr(builtins, name, object)


def hint_of(owner: Any, name: str) -> Any:
    """What an annotation of a function, or of a class and its bases, stands for; None where there is none."""
    for place in inspect.getmro(owner) if inspect.isclass(owner) else (owner,):
        text = inspect.get_annotations(place).get(name)
        if text is not None:
            known = Lenient(vars(sys.modules[place.__module__]))
            return eval(text, {}, known) if isinstance(text, str) else text
    return None


def disagreements(name: str, owner: Any, entries: list[Entry]) -> list[str]:
    """Documented types that say something else than annotations that have only scalars, texts and None."""
    told = [(entry, each, hint_of(owner, each.lstrip("*"))) for entry in entries for each in entry.names]
    return [f"{name}: {each} : {entry.type}, not {hint}" for entry, each, hint in told if not agree(entry.type, hint)]


def agree(told: str, hint: Any) -> bool:
    """True where a type says what an annotation says, or that says less: it has arrays, machines and others."""
    hints = set(typing.get_args(hint)) if typing.get_origin(hint) in (typing.Union, type(int | str)) else {hint}
    choices = {text for each in hints if typing.get_origin(each) is typing.Literal for text in typing.get_args(each)}
    plain = {each.__name__ for each in hints if each in (bool, int, float, str)}
    if hint is None or len(plain) + bool(choices) + (type(None) in hints) < len(hints):
        return True
    listed = set(re.findall(r'"([^"]+)"', told))
    expected = plain | ({"str"} if choices and not listed else set())
    return set(re.sub(CHOICES, "", told).split()) - {"or", "None"} == expected and listed in (set(), choices)


def test_the_pages_are_what_their_generator_writes() -> None:
    written = {path.name: path.read_text("utf-8") for path in (ROOT / "docs" / "reference").glob("*.md")}
    assert written == generator().pages(), "run: python tools/site/reference.py"


def test_every_public_name_is_on_one_page_and_every_page_on_the_site() -> None:
    pages = [path.read_text("utf-8") for path in (ROOT / "docs" / "reference").glob("*.md")]
    headings = [name for page in pages for name in re.findall(r"^      heading: pf\.(\S+)$", page, re.MULTILINE)]
    assert sorted([*headings, "interop.from_sdf"]) == sorted(generator().public_names())
    site = tomllib.loads((ROOT / "zensical.toml").read_text("utf-8"))
    assert set(re.findall(r"'reference/([\w-]+\.md)'", str(site["project"]["nav"]))) == set(generator().pages())
    assert pf.interop.from_sdf is pf.interop.from_urdf


@pytest.mark.parametrize(
    "text", ["float", "array (..., 4, 4) or None", "mapping of str to array (n,)", '{"a", "b c"} or None']
)
def test_types_are_told(text: str) -> None:
    assert is_type(text)


@pytest.mark.parametrize(
    "text", ["the machine", "a pose (4, 4) [length]", "float.", "", "str, which is the name", "Unknown"]
)
def test_prose_is_no_type(text: str) -> None:
    assert not is_type(text)


def test_no_type_in_a_docstring_is_prose_and_no_text_is_missing() -> None:
    faults = []
    for name, entries in ENTRIES.items():
        for entry in entries:
            if entry.section == "Raises":
                is_good = all(kind in ERRORS for kind in entry.type.split(" or "))
            else:
                is_good = is_type(entry.type)
            if not is_good or not (entry.text or entry.section == "Returns"):
                faults.append(f"{name}: {' '.join(entry.names)} : {entry.type}")
    assert faults == []


def test_documented_parameters_are_those_of_the_signature() -> None:
    """All of them and in its order, optional where they have a default; functions of the package have them all."""
    stars = {inspect.Parameter.VAR_KEYWORD: "**", inspect.Parameter.VAR_POSITIONAL: "*"}
    faults = []
    for name, function in FUNCTIONS.items():
        entries = [entry for entry in ENTRIES[name] if entry.section == "Parameters"]
        signature = [
            each for each in inspect.signature(function).parameters.values() if each.name not in ("self", "cls")
        ]
        expected = [(stars.get(each.kind, "") + each.name, each.default is not each.empty) for each in signature]
        found = [(each, entry.is_optional) for entry in entries for each in entry.names]
        is_method = name.rpartition(".")[0] in CLASSES
        if found != expected and (found or not is_method):
            faults.append(f"{name}: {found}, not {expected}")
        defaults = {each.name: each.default for each in signature}
        for entry in entries:  # the site takes the first choice for the default
            first = re.match(r'\{"([^"]+)"', entry.type)
            faults += [
                f"{name}: {entry.names}: {first[1]}" for each in entry.names if first and first[1] != defaults[each]
            ]
        faults += disagreements(name, function, entries)
    assert faults == []


def test_documented_attributes_are_there_and_fields_are_documented() -> None:
    faults = []
    for name, shown in CLASSES.items():
        entries = [entry for entry in ENTRIES[name] if entry.section == "Attributes"]
        found = {each for entry in entries for each in entry.names}
        fields = {each: str(text) for each, text in inspect.get_annotations(shown).items() if not each.startswith("_")}
        faults += [
            f"{name}.{each}" for each, text in fields.items() if not text.startswith("ClassVar") and each not in found
        ]
        bases = [each for each in inspect.getmro(shown) if each.__module__.startswith("pfabrik")]
        source = "".join(inspect.getsource(each) for each in bases)
        for each in found:
            if not hasattr(shown, each) and not re.search(rf"^    {each}: |\bself\.{each}\b", source, re.MULTILINE):
                faults.append(f"{name}.{each} is not there")
        faults += disagreements(name, shown, entries)
    assert faults == []
