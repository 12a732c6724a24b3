"""`pfabrik workspace`: what it prints and writes, and what it refuses in a line."""

from __future__ import annotations

import json
import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import pfabrik as pf
from machines import closure
from pfabrik.cli import main


def test_it_prints_the_size_and_what_forms_the_border_and_writes_every_format(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    names = ["a.png", "a.stl", "a.ply", "a.npz", "a.csv"]
    words = ["workspace", "stewart", "--resolution", "8", *(word for name in names for word in ("-o", name))]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0, result.stderr
    found = pf.workspace(pf.load("stewart"), resolution=8.0)
    (joint, bound), _ = next(iter(found.shares.items()))
    assert "mm³" in result.stdout.splitlines()[0]
    assert re.search(rf"^\d+\.\d% +{joint} {bound} +prismatic, actuated$", result.stdout, re.MULTILINE)
    assert re.search(r"^\d+\.\d% +A\w+ cone +universal$", result.stdout, re.MULTILINE)
    told = [line for line in result.stderr.splitlines() if "compiling" not in line]
    assert told == [f"wrote {name}" for name in names]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names)
    assert np.load("a.npz")["size"] == found.size


def test_angles_are_degrees_in_the_table_and_radians_in_json() -> None:
    words = ["workspace", "stewart", "--fix", "x=0", "--fix", "y=0", "--fix", "z=200", "--resolution", "8"]
    table, found = (CliRunner().invoke(main, [*words, *more]) for more in ([], ["--json"]))
    rows = {line.split()[0]: line.split() for line in table.stdout.splitlines() if line.startswith(("tilt", "yaw"))}
    told = json.loads(found.stdout)
    assert told["units"] == ["rad"] * 3
    for name, (low, high) in told["bounds"].items():
        assert [float(number) for number in rows[name][1:3]] == pytest.approx(np.degrees([low, high]), rel=1e-5)
        assert rows[name][3] == "deg"


def test_nothing_within_reach_is_exit_code_1() -> None:
    result = CliRunner().invoke(main, ["workspace", "stewart", "--fix", "z=5000"])
    assert (result.exit_code, result.stdout) == (1, "nothing within reach\n")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--fix", "q=1"], "no coordinate named 'q'"),
        (["--fix", "z=nan"], "expected NAME=VALUE with finite numbers"),
        (["--within", "z=1"], "expected NAME=MIN:MAX"),
        (["--resolution", "0"], "expected a positive number"),
        (["--tilt", "200"], "expected an angle from 0 to 180 degrees"),
        (["-o", "a.bmp"], "expected a name that ends in"),
        (["--centre", "1,2,3"], "says nothing without --largest"),
        (["--any-orientation", "--rpy", "0", "0", "1"], "give one of them"),
    ],
)
def test_what_makes_no_sense_is_told_in_a_line(words: list[str], told: str) -> None:
    result = CliRunner().invoke(main, ["workspace", "stewart", *words])
    assert result.exit_code == 2
    assert told in result.stderr
    assert "Traceback" not in result.stderr


def test_a_machine_without_closed_forms_is_told_of_at_once_and_how_far_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pfabrik.telling.PATIENCE", 0.0)
    machine = closure.with_hinges_apart(pf.load("delta").without_limits())
    pf.save(machine, tmp_path / "apart.toml")
    asked = ["--fix", "z=-200", "--within", "x=-60:60", "--within", "y=-60:60", "--resolution", "30", "--json"]
    result = CliRunner().invoke(main, ["workspace", str(tmp_path / "apart.toml"), *asked])
    assert result.exit_code == 0 and json.loads(result.stdout)["size"] == pytest.approx(120.0**2)
    first, *lines = result.stderr.splitlines()
    assert "no closed forms, " in first and "points are tried one by one" in first
    shares = [int(line.partition("workspace: ")[2].partition("%")[0]) for line in lines]
    assert shares and all(after // 10 > before // 10 for before, after in pairwise(shares))  # a line in ten per cent
    assert all(line.endswith(" left") for line in lines)
