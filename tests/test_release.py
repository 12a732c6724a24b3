"""A release: built and tried by a tag, published by a person, and said once."""

from __future__ import annotations

import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
TOOL = ROOT / "tools" / "ci" / "release.py"


def release() -> dict[str, Any]:
    return runpy.run_path(str(TOOL))


def test_the_readme_has_the_line_and_the_address_of_pyproject() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    tool = release()
    table = tool["project"]()
    assert tool["with_install_lines"](readme) == readme
    assert readme.count("pip install") == 1
    assert readme.count(table["project"]["urls"]["Documentation"]) == 1


@pytest.mark.parametrize(
    ("released", "line"), [(True, 'pip install "pfabrik[plot]"'), (False, 'pip install ".[plot]"')]
)
def test_one_switch_says_from_where_the_package_is_installed(released: bool, line: str) -> None:
    tool = release()
    table = tool["project"]()
    table["tool"]["pfabrik"]["released"] = released
    lines = tool["install_lines"](table)
    assert lines.splitlines()[1].startswith(line)
    assert ("from the first release on" in lines) != released


def test_what_a_tag_lacks_is_said() -> None:
    ran = subprocess.run([sys.executable, str(TOOL), "v99.0"], capture_output=True, text=True)
    assert ran.returncode == 1 and ran.stdout.startswith("found the tag v99.0; expected v")


def test_a_tag_builds_and_tries_for_three_systems_and_publishes_nothing() -> None:
    yaml = pytest.importorskip("yaml")
    text = (ROOT / ".github" / "workflows" / "release.yml").read_text(encoding="utf-8")
    jobs = yaml.safe_load(text)["jobs"]
    for job in ("wheel", "try"):
        systems = {name.partition("-")[0] for name in jobs[job]["strategy"]["matrix"]["os"]}
        assert systems == {"ubuntu", "macos", "windows"}
    assert set(jobs["publish"]["needs"]) == {"try", "sdist", "site"} and jobs["try"]["needs"] == "wheel"
    assert jobs["publish"]["if"].startswith("inputs.publish &&")
    for name, job in jobs.items():
        uses = " ".join(step.get("uses", "") + step.get("run", "") for step in job["steps"])
        assert ("publish" in uses or "deploy" in uses) == (name == "publish")
    assert any("tools/ci/wheel.py" in step.get("run", "") for step in jobs["try"]["steps"])
    assert any("tools/ci/release.py" in step.get("run", "") for step in jobs["publish"]["steps"])
