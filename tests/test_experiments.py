"""The paper's experiments keep their promises, and come out the same in every run."""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import oracles
import pfabrik as pf
from paper import __main__ as command
from paper import robustness
from paper.closest import nearest_distance
from paper.feasible import model_of, worst_excess
from paper.report import BEGIN, END, put_into
from paper.study import LEAVING, SETTINGS, Case, Extent, cases

ROOT = Path(__file__).parents[1]
MACHINES = ("five_bar", "stewart", "nrpm")
PAGE = f"# Title\n\nbefore\n\n{BEGIN}\nstale numbers\n{END}\n\nafter\n"


LINE = ("--quick", "-o", "out", "--page", "page.md")


def rows(name: str) -> list[dict[str, str]]:
    with Path("out", name).open(newline="", encoding="utf-8") as handle:
        return list(csv.DictReader(handle))


@pytest.mark.campaign
def test_a_quick_study_keeps_its_promises_and_comes_out_the_same_in_another_process(
    folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """The study checks its promises itself, and its exit code says so; here is what it does not check."""
    other = tmp_path_factory.mktemp("again")
    for each in (folder, other):
        (each / "page.md").write_text(PAGE, encoding="utf-8")
    assert command.main([*LINE]) == 0
    names = {path.name for path in Path("out").iterdir()}
    assert names >= {"report.md", "efficacy.png", "efficiency.png", "robustness.png", "efficacy.csv", "robustness.csv"}
    assert all(picture.read_bytes().startswith(b"\x89PNG") for picture in Path("out").glob("*.png"))
    text = Path("page.md").read_text(encoding="utf-8")
    assert text.startswith(f"# Title\n\nbefore\n\n{BEGIN}\n|") and text.endswith(f"\n{END}\n\nafter\n")
    assert "stale" not in text and "position RMSE" in text
    agreements = [float(row["agreement"]) for row in rows("efficiency.csv") if row["agreement"]]
    assert agreements and max(agreements) <= 1e-9
    for key in MACHINES:
        steps = rows(f"robustness_{key}.csv")
        assert {row["status"] for row in steps} == {"REACHED", "PROJECTED"}
        compared = [row for row in steps if row["nearest_by_search"]]
        assert len(compared) >= 5
        default, searched = (
            np.array([float(row[name]) for row in compared]) for name in ("default_position_error", "nearest_by_search")
        )
        assert np.median(default / searched) <= 1.0 + 1e-6
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(Path(pf.__file__).parents[1])])}
    subprocess.run([sys.executable, "-m", "paper", *LINE], cwd=other, env=environment, check=True)
    first, again = (
        {path.name: path.read_bytes() for path in (each / "out").glob("*.csv") if not path.stem.endswith("_times")}
        for each in (folder, other)
    )
    assert first == again


@pytest.mark.parametrize("case", cases(), ids=lambda case: case.key)
def test_what_is_called_the_papers_is_by_its_own_passes(case: Case) -> None:
    """The rows of the third experiment, read back from what is written of it."""
    extent = Extent(steps=19, targets=10, repeats=1, searches=2)
    found = robustness.run(case, extent, lambda: None)
    own = pf.passes.track(case.mechanism, case.leaving.poses(extent.steps), pf.passes.Options.paper())
    assert (own.iterations > 0).all() and (own.status == pf.Status.PROJECTED).any()
    for row, answer in zip(robustness.steps(found), own, strict=True):
        assert (row["iterations"], row["rounds"]) == (answer.iterations, answer.rounds)
        assert row["position_error"] == answer.position_error
        assert [row[name] for name in case.mechanism.actuator_names] == answer.actuators.tolist()
    options = {"paper": "paper", "extended": "extended", "accelerated": "accelerated", "centroid": "centroid"}
    assert {name: LEAVING[name].method for name in options} == options
    assert LEAVING["paper"] == SETTINGS["paper"] == pf.passes.Options.paper()
    (row,) = [row for row in robustness.summary(found) if row["options"] == "paper"]
    outside = own.iterations[pf.track(case.mechanism, case.leaving.poses(extent.steps)).status != pf.Status.REACHED]
    assert row["iterations_outside"] == np.mean(outside) and row["by_fallback"] == 0
    page = command.PAGE.read_text(encoding="utf-8")
    assert f"| {case.label}, the paper's passes |" in page and f"| {case.label}, default |" in page


@pytest.mark.parametrize("text", ["no marks", f"{BEGIN}\n", f"{END}\n{BEGIN}\n", PAGE + PAGE])
def test_a_page_without_its_two_marks_is_left_as_it_is(tmp_path: Path, text: str) -> None:
    path = tmp_path / "page.md"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(pf.errors.InvalidArgument, match="reproduce: begin"):
        put_into(path, "new")
    assert path.read_text(encoding="utf-8") == text


def test_it_says_how_to_get_what_it_needs(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(command, "find_spec", lambda name: None if name == "scipy" else name)
    with pytest.raises(SystemExit) as leaving:
        command.main([])
    assert leaving.value.code == 2
    assert "this needs scipy; install it with: python -m pip install scipy" in capsys.readouterr().err


def test_a_page_that_is_not_there_is_told_before_anything_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as leaving:
        command.main(["-o", str(tmp_path / "out"), "--page", str(tmp_path / "none.md")])
    assert leaving.value.code == 2
    assert "none.md: no such file" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_the_page_of_the_documentation_has_the_marks_for_the_table() -> None:
    assert command.PAGE == ROOT / "docs" / "reproduction.md"
    between = []
    for page in (command.PAGE, command.FIRST_PAGE):
        text = page.read_text(encoding="utf-8")
        assert text.count(BEGIN) == text.count(END) == 1
        between.append(text.partition(BEGIN)[2].partition(END)[0].strip().splitlines())
    page, first = between
    assert len([line for line in first[2:] if line in page]) == 4 and first[:2] == page[:2]  # of the same run


def private_uses(text: str) -> list[str]:
    """What a source text takes of the library beyond the public names of `pfabrik` and `pfabrik.errors`."""
    public = {"pfabrik": pf.__all__, "pfabrik.errors": pf.errors.__all__}
    found = [name for name in re.findall(r"^import (pfabrik[\w.]*)", text, re.MULTILINE) if name not in public]
    for module, names in re.findall(r"^from (pfabrik[\w.]*) import (\([^)]*\)|.*)", text, re.MULTILINE):
        found += [f"{module}.{name}" for name in re.findall(r"\w+", names) if name not in public.get(module, ())]
    found += [f"pf.{name}" for name in re.findall(r"\bpf\.(\w+)", text) if name not in pf.__all__]
    return found + re.findall(r"(?<!\bself)(?<!\bcls)\._(?!_|asdict)\w+", text)


def test_the_paper_stands_on_the_public_names_of_the_library() -> None:
    files = sorted(ROOT.glob("paper/**/*.py"))
    assert len(files) > 20
    assert {path.name: found for path in files if (found := private_uses(path.read_text(encoding="utf-8")))} == {}
    for text in (
        "from pfabrik.tolerances import TOLERANCES",
        "import pfabrik.kernels",
        "from pfabrik import kernels",
        "import pfabrik as pf\npf.kernels",
        "solution._rows",
    ):
        assert len(private_uses(text)) == 1, text


def test_the_machines_of_the_study_are_those_of_the_paper() -> None:
    assert tuple(case.key for case in cases()) == MACHINES
    assert set(MACHINES) <= set(pf.catalog())
    assert json.dumps([round(case.printed.ratio, 3) for case in cases()]) == "[2.2, 1.4, 0.764]"


@pytest.mark.parametrize("case", cases(), ids=lambda case: case.key)
def test_circles_are_closed_and_keep_their_radius(case: object) -> None:
    for circle in (case.inside, case.leaving):
        poses = circle.poses(25)
        assert np.allclose(poses[0], poses[-1], atol=1e-12)
        assert np.allclose(np.linalg.norm(poses[:, :3, 3] - circle.center, axis=1), circle.radius)


@pytest.mark.parametrize("key", MACHINES)
def test_the_closed_form_of_limits_and_loops_holds_at_home(key: str) -> None:
    model = model_of(pf.load(key))
    assert model.slacks(model.home, np.eye(3)).min() > 0.0
    assert np.abs(model.gaps(model.home, np.eye(3))).max(initial=0.0) < 1e-12


def test_the_closed_form_of_limits_agrees_with_another_about_what_is_reachable() -> None:
    mechanism = pf.load("stewart")
    model = model_of(mechanism)
    targets = oracles.random_targets(mechanism, np.random.default_rng(3), 200)
    margins = oracles.margin(mechanism, targets)
    slacks = [model.slacks(T[:3, 3] / mechanism.characteristic_length, T[:3, :3]).min() for T in targets]
    assert 20 < (margins > 0.0).sum() < 180
    assert np.array_equal(np.array(slacks) >= 0.0, margins >= 0.0)


@pytest.mark.parametrize(("key", "name"), [("five_bar", "p4"), ("stewart", "BR2"), ("nrpm", "A2"), ("nrpm", "DL3")])
def test_answers_that_exceed_narrower_limits_are_told(key: str, name: str) -> None:
    mechanism = pf.load(key)
    targets = next(case for case in cases() if case.key == key).inside.poses(40)
    solution = pf.track(mechanism, targets)
    assert worst_excess(solution).max() <= 1e-9
    home, values = mechanism.home_coordinate(name), solution.joints[name]
    farthest = int(np.abs(values - home).argmax())
    half = 0.5 * abs(values[farthest] - home)
    narrow = model_of(mechanism.with_limits({name: (home - half, home + half)}))
    slacks = narrow.slacks(narrow.variables(solution)[farthest], solution.pose[farthest, :3, :3])
    unit = mechanism.characteristic_length if mechanism.joint(name).type == "prismatic" else 1.0
    assert -slacks.min() == pytest.approx(half / unit, rel=1e-9)


def test_the_nearest_feasible_pose_above_a_hexapod_is_straight_below_the_target() -> None:
    mechanism = pf.load("stewart")
    highest = np.sqrt(280.0**2 - 60.0**2 - 20.0**2)  # struts at full stroke, their ends that far apart sideways
    model = model_of(mechanism)
    target = pf.pose([0.0, 0.0, highest + 25.0])
    start = np.array([5.0, -3.0, 200.0]) / mechanism.characteristic_length
    assert nearest_distance(model, target, start) == pytest.approx(25.0, rel=1e-6)
