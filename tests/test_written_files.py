"""Whatever file a command writes has something in it; which files there are, the command itself tells."""

from __future__ import annotations

import itertools
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import click
import numpy as np
import pytest

import pfabrik as pf
from command import pfabrik, write_files
from pfabrik.cli import main
from pfabrik.view.save_picture import FILMS, PICTURES
from test_calibration import klipper_settings
from written import check_written

pytest.importorskip("matplotlib")

pytestmark = pytest.mark.usefixtures("folder")

READ = {
    *(
        "certify --track",
        "design --track",
        "view --track",
        "import --loops",
        "track --qpos",
        "verify --loops",
        "verify --original",
    ),
}
"""Options with files that are read."""

ELSEWHERE = {"demo -o", "export --ros2-control", "export --ros2-node", "identify -o"}
"""Options with folders, or of much data, whose files other tests look at one by one."""

LINES = (
    "new 6-UPS -o my.toml",
    "track five_bar rise.csv -o rows.csv --plot picture.png --animate film.gif --dpi 40",
    "travel five_bar --plot picture.png --dpi 40",
    "workspace five_bar --resolution 16 --dpi 40 -o picture.png -o all.npz -o border.csv",
    "workspace linear_delta --resolution 60 -o mesh.stl -o mesh.ply -o all.npz",
    "design my.toml --vary longest=200:600 --box -1:1,-1:1,-1:1 --about home -o designed.toml --plot picture.png",
    "calibrate printer.cfg -o found.toml --klipper a.cfg --reprap a.g --marlin a.h --plot picture.png",
    "time weighed.toml rise.csv --speed 900 --rate 50 -o rows.csv",
    "effort weighed.toml rise.csv -o rows.csv --plot picture.png",
    "effort weighed.toml rise.csv --plot picture.pdf",
    "singularities five_bar --over y,z --resolution 16 --dpi 40 -o picture.png",
    "plot five_bar --dpi 40 -o picture.png",
    "plot g1_ankle --torque-map --dpi 40 -o picture.png",
    "view five_bar --html page.html",
    "import robot.xml --end-effector p3 -o imported.toml",
    "join five_bar rrr --prefix a_ --prefix b_ --end-effector b_platform -o joined.toml",
    "export linear_delta klipper -o a.cfg",
    "export five_bar --torch a.py --jax b.py --numpy c.py --web page.html",
)


def commands(group: click.Group, before: str = "") -> Iterator[tuple[str, click.Command]]:
    """The name of every command, and the command."""
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        assert command is not None
        if isinstance(command, click.Group):
            yield from commands(command, f"{before}{name} ")
        else:
            yield f"{before}{name}", command


def test_every_option_that_takes_a_file_is_tried() -> None:
    options = {
        f"{name} {min(each.opts, key=len)}"
        for name, command in commands(main)
        for each in command.params
        if isinstance(each, click.Option) and isinstance(each.type, click.Path)
    }
    tried = {f"{words[0]} {option}" for words in map(shlex.split, LINES) for option in words}
    assert tried & options == options - READ - ELSEWHERE
    assert options > READ | ELSEWHERE


def test_every_option_that_takes_a_picture_is_tried_with_one() -> None:
    """Those whose help names the ending, in small or capital letters."""
    for name, command in commands(main):
        for each in command.params:
            if isinstance(each, click.Option) and re.search(r"\bpng\b", each.help or "", re.IGNORECASE):
                option = min(each.opts, key=len)
                lines = [shlex.split(line) for line in LINES if line.startswith(f"{name} ")]
                assert any((option, "picture.png") in itertools.pairwise(words) for words in lines), f"{name} {option}"


@pytest.mark.parametrize("line", LINES)
def test_what_is_written_has_something_in_it(line: str) -> None:
    write_files("weighed.toml", "rise.csv")
    Path("printer.cfg").write_text(klipper_settings(), encoding="utf-8")
    Path("robot.xml").write_text(pf.interop.to_mjcf(pf.load("five_bar")), encoding="utf-8")
    if line.startswith("design"):
        assert pfabrik("new 6-UPS -o my.toml").exit_code == 0
    before = {path for path in Path().rglob("*") if path.is_file()}
    done = pfabrik(line)
    assert done.exit_code in (0, 1), done.stderr
    written = {path for path in Path().rglob("*") if path.is_file()} - before
    assert written
    for path in written:
        assert f"wrote {path}" in done.output or path.suffix not in (*PICTURES, *FILMS)
        check_written(path)


def test_a_film_of_one_step_is_refused() -> None:
    Path("one.csv").write_text("x,y,z\n0,1,190\n", encoding="utf-8")
    done = pfabrik("track five_bar one.csv --animate film.gif")
    assert done.exit_code == 2 and "two or more: a film shows a motion" in done.stderr
    assert not Path("film.gif").exists()


def test_a_curve_of_one_step_is_a_dot() -> None:
    """In every panel: a line through one point is none."""
    for panel in pf.plot_track(pf.track(pf.load("five_bar"), np.array([[0.0, 1.0, 190.0]]))).values():
        assert any(line.get_marker() == "o" and line.get_markevery() == [0] for line in panel.get_lines())
