"""The notebooks of the project run as they are, show themselves, and are kept without outputs."""

from __future__ import annotations

import ast
import html.parser
import json
import re
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("matplotlib")

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))
IDS = [path.stem for path in NOTEBOOKS]


def cells_of(path: Path, kind: str) -> list[dict[str, Any]]:
    """The cells of one kind: code, or markdown."""
    return [cell for cell in json.loads(path.read_text(encoding="utf-8"))["cells"] if cell["cell_type"] == kind]


def run_cell(source: str, namespace: dict[str, object]) -> object:
    """What a cell shows below it: the value of its last line, if that is an expression."""
    body = ast.parse(source).body
    last = body.pop() if isinstance(body[-1], ast.Expr) else None
    exec(compile(ast.Module(body, []), "<cell>", "exec"), namespace)
    return None if last is None else eval(compile(ast.Expression(last.value), "<cell>", "eval"), namespace)


def markup(shown: object) -> str:
    """Its HTML, or what is printed of it."""
    as_html = getattr(shown, "_repr_html_", None)
    return (as_html() if as_html else None) or repr(shown)  # a figure of matplotlib has a method that gives None


def test_there_are_notebooks() -> None:
    assert set(IDS) == {"stewart", "five_bar"}
    assert len(cells_of(NOTEBOOKS[IDS.index("stewart")], "code")) == 10


@pytest.mark.parametrize("path", NOTEBOOKS, ids=IDS)
def test_notebooks_are_kept_without_outputs(path: Path) -> None:
    whole = json.loads(path.read_text(encoding="utf-8"))
    assert (whole["nbformat"], whole["metadata"]["kernelspec"]["name"]) == (4, "python3")
    assert len({cell["id"] for cell in whole["cells"]}) == len(whole["cells"])
    for cell in cells_of(path, "code"):
        assert cell["outputs"] == []
        assert cell["execution_count"] is None


@pytest.mark.pages
@pytest.mark.parametrize("path", NOTEBOOKS, ids=IDS)
@pytest.mark.usefixtures("folder")
def test_cells_of_notebooks_run_one_after_the_other(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without Jupyter: what a cell shows is a number, an array, or has HTML that can be parsed."""
    namespace: dict[str, object] = {"__name__": "__main__"}
    tables = 0
    for cell in cells_of(path, "code"):
        shown = run_cell("".join(cell["source"]), namespace)
        if shown is not None:
            text = markup(shown)
            html.parser.HTMLParser().feed(text)
            tables += "<table" in text
    assert tables >= 2
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("path", NOTEBOOKS, ids=IDS)
def test_links_of_notebooks_lead_somewhere(path: Path) -> None:
    for cell in cells_of(path, "markdown"):
        for link in re.findall(r"\]\(([^)#]+)\)", "".join(cell["source"])):
            assert (path.parent / link).exists(), link
