"""Pages of the site from the notebooks: their text, their cells, and what the cells show, for they are run.

Cells are run as Jupyter runs them, without Jupyter: the value of a last line is shown, and every figure that was drawn.
"""

from __future__ import annotations

import ast
import contextlib
import io
import json
import re
import tempfile
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("agg")
from matplotlib import pyplot as plt

NOTEBOOKS = Path(__file__).resolve().parents[2] / "notebooks"
RESOLUTION = 80  # of figures: dots per inch


def write(site: Path) -> None:
    """A page for each notebook, in `notebooks/`, and the notebooks themselves."""
    folder = site / "notebooks"
    folder.mkdir()
    for path in sorted(NOTEBOOKS.glob("*.ipynb")):
        (folder / path.name).write_bytes(path.read_bytes())
        (folder / f"{path.stem}.md").write_text(page(path, folder), encoding="utf-8")


def page(path: Path, folder: Path) -> str:
    """The page of a notebook; its figures go into the folder."""
    parts, namespace, n_figures = [], dict[str, Any](__name__="__main__"), 0
    with tempfile.TemporaryDirectory() as work, contextlib.chdir(work):
        for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
            source = "".join(cell["source"])
            if cell["cell_type"] == "markdown":
                parts.append(source.replace("](../docs/", "](../"))
                continue
            parts.append(f"```python\n{source}\n```")
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                value = run(source, namespace)
            if printed.getvalue():
                parts.append(f"```text\n{printed.getvalue().rstrip()}\n```")
            for number in plt.get_fignums():
                n_figures += 1
                name = f"{path.stem}-{n_figures}.png"
                plt.figure(number).savefig(folder / name, dpi=RESOLUTION)
                parts.append(f"![Figure {n_figures}]({name})")
            plt.close("all")
            parts.append(shown(value))
    parts.append(f"*[The notebook]({path.name}), to be run in Jupyter.*")
    return "\n\n".join(part for part in parts if part) + "\n"


def run(source: str, namespace: dict[str, Any]) -> Any:
    """Run a cell; the value of its last line, if that is an expression and no semicolon ends it."""
    body = ast.parse(source).body
    last = body.pop() if isinstance(body[-1], ast.Expr) else None
    exec(compile(ast.Module(body, []), "<cell>", "exec"), namespace)
    value = None if last is None else eval(compile(ast.Expression(last.value), "<cell>", "eval"), namespace)
    return None if source.rstrip().endswith(";") else value


def shown(value: Any) -> str:
    """What Jupyter shows of a value: its HTML, or else its text; nothing of what is drawn already."""
    if value is None or type(value).__module__.startswith(("matplotlib", "mpl_toolkits")):
        return ""
    markup = getattr(value, "_repr_html_", None)
    if markup is None:
        return f"```text\n{value!r}\n```"
    lines = re.sub(r"\n\s*", "\n", markup())
    return f'<div class="shown">{lines}</div>'.replace("\n\n", "\n")
