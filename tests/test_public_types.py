"""The program that mypy checks as a user's own does what it says."""

from __future__ import annotations

import inspect
import runpy
from collections.abc import Iterator
from pathlib import Path
from types import FunctionType

import pytest

import pfabrik as pf

PROGRAM = Path(__file__).parent / "typing" / "public.py"


def test_the_typed_program_runs() -> None:
    runpy.run_path(str(PROGRAM), run_name="__main__")


def test_it_casts_and_ignores_nothing() -> None:
    text = PROGRAM.read_text(encoding="utf-8")
    assert not [word for word in ("cast(", "type: ignore", "Any") if word in text]


def signatures(public: object, name: str) -> Iterator[tuple[str, FunctionType]]:
    """The functions a user calls or reads: a public function, or the public methods and properties of a class."""
    if isinstance(public, FunctionType):
        yield name, public
    elif inspect.isclass(public) and public.__module__.startswith("pfabrik"):
        own_classes = [each for each in inspect.getmro(public) if each.__module__.startswith("pfabrik")]
        for own, member in (item for each in own_classes for item in vars(each).items()):
            function = getattr(member, "fget", None) or getattr(member, "func", None) or member
            function = getattr(function, "__func__", function)
            if isinstance(function, FunctionType) and (not own.startswith("_") or own == "__getitem__"):
                yield f"{name}.{own}", function


@pytest.mark.parametrize("name", pf.__all__)
def test_no_public_signature_takes_or_gives_anything_whatever(name: str) -> None:
    loose = [
        f"{place}({argument}: {kind})"
        for place, function in signatures(getattr(pf, name), name)
        for argument, kind in function.__annotations__.items()
        if "Any" in str(kind) and not place.endswith(".to_dict")
    ]
    assert loose == []


def test_signatures_of_functions_properties_and_class_methods_are_looked_at() -> None:
    places = {place for name in pf.__all__ for place, _ in signatures(getattr(pf, name), name)}
    assert {"solve_ik", "Solution.status", "Solution.q", "Mechanism.joint", "Mechanism.from_legs"} <= places
