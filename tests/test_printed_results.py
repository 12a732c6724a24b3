"""Results print the same in Python and at the command line."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import pfabrik as pf
from pfabrik.cli import main
from pfabrik.overview import Overview


def test_a_track_says_what_the_command_says(tmp_path: Path) -> None:
    path = tmp_path / "path.csv"
    path.write_text("x,y,z\n0,0,-200\n10,0,-200\n0,0,-900\n", encoding="utf-8")
    delta = pf.load("delta")
    said = CliRunner().invoke(main, ["track", "delta", str(path)])
    lines = pf.track(delta, pf.read_path(path, delta).targets).table().lines
    assert list(lines) == re.sub(r" \(line \d+\)", "", said.stdout + said.stderr).splitlines()
    assert "2 reached, 1 projected; first at target 3; farthest" in lines[0]
    assert lines[1].startswith("worst step: target 3, margin 0 of ")


def test_an_overview_says_what_the_command_says() -> None:
    assert CliRunner().invoke(main, ["info", "delta"]).stdout == f"{Overview(pf.load('delta'))}\n"


def test_forces_of_a_batch_show_the_largest_of_each_actuator() -> None:
    stewart = pf.load("stewart")
    held = pf.forces(pf.solve_ik(stewart, [(0, 0, 190), (0, 5, 190)]), [0, 0, -200])
    shown = {name: float(value) for name, value, _ in held.table().rows}
    assert shown == pytest.approx(dict(zip(stewart.actuator_names, held.actuators.max(axis=0), strict=True)), rel=1e-5)


def test_a_largest_shape_shows_its_size_in_its_units_and_its_certificate() -> None:
    square = pf.largest(pf.load("five_bar"), "box")
    text = str(square)
    assert re.search(r"^z \[mm\] +[\d.]+ +129\.085$", text, re.MULTILINE)
    assert text.endswith(str(square.certificate))
    tilts = pf.workspace(pf.load("ankle_rss"), resolution=0.1).inscribed("box")
    assert [name for name, *_ in tilts.table().rows] == ["pivot[0] [deg]", "pivot[1] [deg]"]
    assert [float(extent) for *_, extent in tilts.table().rows] == pytest.approx(np.degrees(tilts.extents), rel=1e-5)
