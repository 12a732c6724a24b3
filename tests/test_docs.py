"""What the documentation shows is true: its programs run, its commands print what it prints, its links lead on."""

from __future__ import annotations

import os
import re
import runpy
import shutil
from pathlib import Path

import click
import pytest

import pfabrik as pf
from command import pfabrik, told
from pfabrik.cli import main
from test_transcripts import CHANCE

ROOT = Path(__file__).parents[1]
PAGES = sorted(
    [*(ROOT / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md")), *ROOT.glob("docs/**/*.md")]
)
EXAMPLES = sorted(ROOT.glob("examples/*.py"))
FORMAT = ROOT / "docs" / "describing-a-mechanism.md"
MAP = ROOT / "docs" / "map.md"
CONTRIBUTING = ROOT / "CONTRIBUTING.md"
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
ROUNDING = re.compile(r"(?<!< )\b\d(\.\d+)?e-1[2-9]")
"""A number that is rounding, whose digits differ between processors; ``< 1e-12`` is none."""


def blocks(page: Path, language: str) -> list[str]:
    """The fenced blocks of a page in one language."""
    fenced = re.findall(r"^```(\w*)\n(.*?)^```$", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    return [text for label, text in fenced if label == language]


def anchors(page: Path) -> set[str]:
    """What a link may have behind its #: the headings of a page."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def files_named(page: Path) -> list[str]:
    """Files and folders of the package in back quotes: `engine.py`, `decomposition/`."""
    return re.findall(r"`((?:\w+/)*(?:\w+\.py|\w+/))`", page.read_text(encoding="utf-8"))


def page_id(page: Path) -> str:
    return str(page.relative_to(ROOT))


def test_there_is_something_to_check() -> None:
    assert len(PAGES) > 10
    assert EXAMPLES
    assert sum(len(blocks(page, "python")) for page in PAGES) >= 4


@pytest.mark.parametrize("page", PAGES, ids=page_id)
def test_links_within_the_project_lead_somewhere(page: Path) -> None:
    for link in LINK.findall(page.read_text(encoding="utf-8")):
        if "://" in link:
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link


@pytest.mark.parametrize("page", ["docs/how-it-works.md", "CONTRIBUTING.md"])
def test_files_of_the_package_that_a_page_names_are_there(page: str) -> None:
    named = files_named(ROOT / page)
    assert len(named) > 15
    missing = [name for name in named if not any((top / name).exists() for top in (ROOT, ROOT / "src" / "pfabrik"))]
    assert missing == []


def test_every_page_is_on_the_map() -> None:
    """Linked from the map, from the list of its own folder, or for developers from CONTRIBUTING.md."""
    linked = set().union(*map(linked_from, [MAP, CONTRIBUTING, *ROOT.glob("docs/*/index.md")]))
    assert {page.resolve() for page in ROOT.glob("docs/**/*.md")} <= linked | {MAP}


ELSEWHERE_TOO = ("docs/your-controller.md-3", "docs/start.md-2", "docs/ros2-node.md-1", "docs/cluster.md-1")
"""Programs of seconds: exports, a workspace and processes, which tasks, examples and other tests have as well."""


@pytest.mark.pages
@pytest.mark.parametrize(
    "code",
    [
        pytest.param(code, id=name, marks=[pytest.mark.campaign] * (name in ELSEWHERE_TOO))
        for page in PAGES
        if page.parent.name != "tasks" and page.name != "coming-from.md"  # one program each; run with their tables
        for number, code in enumerate(blocks(page, "python"), 1)
        for name in [f"{page_id(page)}-{number}"]
    ],
)
@pytest.mark.usefixtures("folder", "coarse")
def test_python_blocks_run_as_they_are_written(code: str) -> None:
    exec(compile(code, "<block>", "exec"), {"__name__": "__main__"})


@pytest.mark.pages
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.name)
@pytest.mark.usefixtures("folder")
def test_examples_run(example: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.argv", [str(example)])
    runpy.run_path(str(example), run_name="__main__")
    printed = capsys.readouterr().out
    assert printed
    if example.name == "08_on_a_cluster.py":
        assert printed in blocks(ROOT / "docs" / "cluster.md", "text")


def compiler_that_does_not_optimize(folder: Path) -> Path:
    """A folder with a `cc` that takes a third of the time, and makes programs that print the same."""
    command, cc = folder / "cc", shutil.which("cc")
    command.write_text(f'#!/bin/sh\nexec {cc} "$@" -O0\n')
    command.chmod(0o755)
    return folder


@pytest.mark.pages
@pytest.mark.usefixtures("coarse")
@pytest.mark.parametrize("program", sorted(ROOT.glob("examples/tasks/*.py")), ids=lambda program: program.stem)
def test_the_page_of_a_task_is_what_its_program_prints(
    program: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each is run in an empty folder; `python tools/site/pages.py` writes the pages and their pictures."""
    if '"cc"' in program.read_text(encoding="utf-8"):
        if shutil.which("cc") is None:
            pytest.skip("the page shows what compiled C prints, and there is no compiler")
        monkeypatch.setenv("PATH", str(compiler_that_does_not_optimize(tmp_path)), prepend=os.pathsep)
    page = runpy.run_path(str(ROOT / "tools" / "site" / "pages.py"))["page_of"](program)
    written = ROOT / "docs" / "tasks" / f"{program.stem}.md"
    assert page.text == written.read_text(encoding="utf-8")
    assert all((written.parent / name).exists() for name in page.pictures)


@pytest.mark.parametrize("page", PAGES, ids=page_id)
def test_no_page_shows_digits_of_rounding(page: Path) -> None:
    lines = "".join([*blocks(page, ""), *blocks(page, "text")]).splitlines()
    assert [line for line in lines if ROUNDING.search(line) and not line.startswith(("$", "python"))] == []


def test_every_task_has_a_page_with_a_picture_in_the_navigation() -> None:
    pages = {f"tasks/{program.stem}.md" for program in ROOT.glob("examples/tasks/*.py")}
    site = (ROOT / "zensical.toml").read_text(encoding="utf-8")
    assert pages == set(re.findall(r"tasks/\w+\.md", site))
    for page in pages:
        assert "\n![" in (ROOT / "docs" / page).read_text(encoding="utf-8"), page


COMMAND = re.compile(r"^```\n\$ pfabrik ([^\n]*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
SHOWING = [
    FORMAT,
    *(ROOT / "docs" / f"{name}.md" for name in ("adding-a-mechanism", "cli", "forces", "singularities", "start")),
]


def files_of(page: Path) -> dict[str, str]:
    """The files that the commands of a page are about, from the page itself."""
    if page == FORMAT:
        return {"hexapod.toml": blocks(FORMAT, "toml")[0]}
    if page.name == "adding-a-mechanism.md":
        return dict(
            re.findall(r'Path\("(\w+\.toml)"\)\.write_text\("""\\\n(.*?)"""\)', page.read_text("utf-8"), re.DOTALL)
        )
    return {}


def misspelt(text: str) -> str:
    """The example with the two faults that the page on the format describes."""
    return text.replace('name = "TopR"', 'name = "TopL"').replace('["rodR", "platform"]', '["rodR", "platfrom"]')


@pytest.mark.compiled
@pytest.mark.parametrize("page", SHOWING, ids=page_id)
def test_commands_print_what_their_page_shows(page: Path, folder: Path) -> None:
    """All in one folder, one after the other; what stands for dots is not compared."""
    pytest.importorskip("matplotlib")
    for line, expected in COMMAND.findall(page.read_text(encoding="utf-8")):
        for name, text in files_of(page).items():
            (folder / name).write_text(misspelt(text) if " found " in expected else text, encoding="utf-8")
        done = pfabrik(line)
        said = CHANCE.sub("", "\n".join(each.rstrip() for each in (*done.stdout.splitlines(), *told(done))))
        parts = CHANCE.sub("", expected.rstrip("\n")).split("\n...\n")
        assert all(part in said for part in parts), line
        assert len(parts) > 1 or said == parts[0], line


def test_the_worked_example_has_six_legs_of_its_kind(folder: Path) -> None:
    (folder / "hexapod.toml").write_text(blocks(FORMAT, "toml")[0], encoding="utf-8")
    assert [str(chain) for chain in pf.decompose(pf.load("hexapod.toml"))] == ["R*-S-S"] * 6


def test_the_page_of_the_command_line_lists_every_command_with_every_option() -> None:
    page = (ROOT / "docs" / "cli.md").read_text(encoding="utf-8")
    rows, context = [line for line in page.splitlines() if line.startswith("| `pfabrik ")], click.Context(main)
    for name in main.list_commands(context):
        command = main.get_command(context, name)
        assert command is not None
        (row,) = (row.partition("` | ")[0] for row in rows if re.match(rf"\| `pfabrik {name}\b", row))
        for option in (each for each in command.params if isinstance(each, click.Option)):
            assert any(re.search(rf"(?<![-\w]){re.escape(said)}(?![-\w])", row) for said in option.opts), option.opts


def linked_from(page: Path) -> set[Path]:
    """The files that a page has links to."""
    return {(page.parent / link.partition("#")[0]).resolve() for link in LINK.findall(page.read_text(encoding="utf-8"))}


def test_the_readme_leads_to_every_page() -> None:
    """By a link of its own, or by the map that it has a link to."""
    linked = linked_from(ROOT / "README.md")
    assert MAP in linked
    linked |= linked_from(MAP) | linked_from(CONTRIBUTING)
    assert [page.name for page in ROOT.glob("docs/*.md") if page.resolve() not in linked] == []


COMING_FROM = ROOT / "docs" / "coming-from.md"
SECTIONS = COMING_FROM.read_text(encoding="utf-8").split("\n## ")[1:]
ASKS = re.compile(r"`((?:pf|answer|machine)\.[^`]*)`")
"""A line of code in a table."""
OPENS = ("pf.interop.from_urdf(", "pf.view(")
"""Lines that want a file, or open a window."""


@pytest.mark.pages
@pytest.mark.parametrize("section", SECTIONS, ids=[section.partition("\n")[0] for section in SECTIONS])
@pytest.mark.usefixtures("folder")
def test_lines_for_those_who_come_from_elsewhere_run(section: str) -> None:
    """Those in the last column, after the block above the table; not those with dots or with arguments left out."""
    (code,) = re.findall(r"^```python\n(.*?)^```$", section, re.DOTALL | re.MULTILINE)
    namespace: dict[str, object] = {"__name__": "__main__"}
    exec(compile(code, "<block>", "exec"), namespace)
    cells = re.findall(r"^\| .* \| (.*) \|$", section, re.MULTILINE)
    lines = [line for cell in cells for line in ASKS.findall(cell)]
    lines = [line for line in lines if "..." not in line and not line.startswith(OPENS)]
    assert lines
    for line in lines:
        eval(line, namespace)


CITED = re.compile(r"`(tests/\w+\.py)(?:::(\w+))?`")


@pytest.mark.parametrize(
    "page", [page for page in PAGES if CITED.search(page.read_text(encoding="utf-8"))], ids=page_id
)
def test_tests_that_a_page_cites_are_there(page: Path) -> None:
    for file, name in CITED.findall(page.read_text(encoding="utf-8")):
        assert f"def {name or 'test_'}" in (ROOT / file).read_text(encoding="utf-8"), (file, name)


def test_every_promise_along_a_motion_has_a_test_that_states_it() -> None:
    text = (ROOT / "docs" / "safety.md").read_text(encoding="utf-8")
    rows = [row for row in text.splitlines() if row.startswith("| ") and not row.startswith("| promise")]
    assert len(rows) > 12 and all(CITED.search(row) for row in rows)


@pytest.mark.compiled
@pytest.mark.usefixtures("folder")
def test_the_first_program_of_the_readme_prints_what_it_shows(capsys: pytest.CaptureFixture[str]) -> None:
    (code, *_), (shown,) = blocks(ROOT / "README.md", "python"), blocks(ROOT / "README.md", "text")
    exec(compile(code, "<readme>", "exec"), {"__name__": "__main__"})
    assert capsys.readouterr().out == shown


def test_the_package_is_installed_from_its_folder_until_it_is_on_an_index() -> None:
    lines = [line for page in PAGES for line in page.read_text(encoding="utf-8").splitlines() if "pip install" in line]
    assert lines
    by_name = [line for line in lines if re.search(r"pip install ['\"]?pfabrik", line)]
    assert all("# from the first release on" in line for line in by_name)


def test_pages_say_alike_how_long_an_installation_compiles() -> None:
    for name in ("README.md", "docs/start.md", "docs/install.md", "CONTRIBUTING.md"):
        assert "half a minute" in (ROOT / name).read_text(encoding="utf-8"), name


def test_the_citation_is_of_this_version_and_of_the_paper_that_the_pages_name() -> None:
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {pf.__version__}\n" in citation
    (number,) = set(re.findall(r"\d{4}\.\d{5}", citation))
    for page in (ROOT / "README.md", ROOT / "docs" / "references.md"):
        assert set(re.findall(r"\d{4}\.\d{5}", page.read_text(encoding="utf-8"))) == {number}


LINES = [line for block in blocks(ROOT / "README.md", "") for line in block.splitlines() if line.startswith("pfabrik ")]
ELSEWHERE = ("pfabrik demo --quick",)
"""Commands that take long, and that tests of their own run just so."""


@pytest.mark.compiled
@pytest.mark.parametrize("line", [line for line in LINES if not line.startswith(ELSEWHERE)])
def test_commands_of_the_readme_answer(line: str, folder: Path) -> None:
    pf.save(pf.load("five_bar"), folder / "my_machine.toml")
    (folder / "path.csv").write_text("x,y,z\n0,0,190\n0,0,300\n", encoding="utf-8")
    done = pfabrik(line.removeprefix("pfabrik "))
    assert done.exit_code in (0, 1), done.stderr
    assert done.output


SEEING = ROOT / "docs" / "see-your-machine.md"
DRAWN = re.compile(r"pfabrik .*figures/[\w.]+\.(?:png|gif)")
DRAWING = [line for block in blocks(SEEING, "") for line in block.splitlines() if DRAWN.fullmatch(line)]


@pytest.mark.compiled
@pytest.mark.parametrize(
    "line", [pytest.param(line, marks=[pytest.mark.campaign] * line.endswith(".gif")) for line in DRAWING]
)
def test_pictures_are_made_by_the_commands_shown_beside_them(line: str, folder: Path) -> None:
    pytest.importorskip("matplotlib")
    (made,) = re.findall(r"figures/[\w.]+$", line)
    assert f"]({made})" in SEEING.read_text(encoding="utf-8")
    shown = (ROOT / "docs" / made).stat().st_size
    shutil.copytree(ROOT / "docs" / "figures", folder / "figures", ignore=shutil.ignore_patterns(Path(made).name))
    done = pfabrik(line.removeprefix("pfabrik "))
    assert done.exit_code in (0, 1), done.stderr
    assert (folder / made).stat().st_size == pytest.approx(shown, rel=0.2), "run the command again, in docs/"
