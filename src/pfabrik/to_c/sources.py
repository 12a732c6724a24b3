"""Functions of Python as their text: syntax trees and comments."""

from __future__ import annotations

import ast
import tokenize
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any

from ..kernels._jit import OPENERS, SOURCES, Marked

PACKAGE = Path(__file__).parents[1]


@cache
def _functions(path: str) -> dict[tuple[str, int], ast.FunctionDef]:
    tree = ast.parse(Path(path).read_text(encoding="utf-8"))
    found = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    return {(f.name, min([f.lineno, *(d.lineno for d in f.decorator_list)])): f for f in found}


def tree_of(function: FunctionType) -> ast.FunctionDef:
    """The syntax tree of a function."""
    code = function.__code__
    return _functions(code.co_filename)[code.co_name, code.co_firstlineno]


@cache
def comments_of(path: str) -> dict[int, tuple[str, bool]]:
    """Comments of a file by their lines, and whether each has its line alone."""
    with open(path, "rb") as file:
        found = [t for t in tokenize.tokenize(file.readline) if t.type == tokenize.COMMENT]
    return {t.start[0]: (t.string.lstrip("# "), not t.line[: t.start[1]].strip()) for t in found}


def short_path(path: str) -> str:
    """A path from the package's folder on, for comments and messages."""
    where = Path(path)
    return where.relative_to(PACKAGE).as_posix() if PACKAGE in where.parents else where.name


def source_of(called: Any) -> Marked | None:
    """The function of Python that a decorator of kernels was given, with its kind; None for anything else."""
    source: Marked | None = found_in(SOURCES, called)
    return source


def opened_by(called: Any) -> Any:
    """The sample of what opens a handle; None for anything else."""
    return found_in(OPENERS, called)


def found_in(known: dict[Any, Any], called: Any) -> Any:
    try:
        return known.get(called)
    except TypeError:  # it has no hash
        return None
