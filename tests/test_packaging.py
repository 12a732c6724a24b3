"""What is published says the same everywhere: the project's own settings are the reference."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

import pfabrik as pf

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def test_the_conda_recipe_has_the_version_and_the_requirements_of_the_project() -> None:
    yaml = pytest.importorskip("yaml")
    recipe = yaml.safe_load((ROOT / "tools" / "conda" / "recipe.yaml").read_text(encoding="utf-8"))
    assert recipe["context"]["version"] == pf.__version__
    assert f">={recipe['context']['python_min']}" == PROJECT["project"]["requires-python"]

    def named(requirements: list[str]) -> set[str]:
        return {each.replace(" ", "") for each in requirements}

    needed = recipe["requirements"]
    assert named(needed["run"]) == named(PROJECT["project"]["dependencies"]) | {"python"}
    assert named(needed["host"]) == named(PROJECT["build-system"]["requires"]) | {"python", "pip"}


def test_everything_that_the_joss_paper_cites_is_in_its_bibliography() -> None:
    folder = ROOT / "paper" / "joss"
    cited = set(re.findall(r"@(\w+)", (folder / "paper.md").read_text(encoding="utf-8")))
    known = set(re.findall(r"^@\w+\{(\w+),", (folder / "paper.bib").read_text(encoding="utf-8"), re.MULTILINE))
    assert cited == known
