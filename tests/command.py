"""The command in this process, or in one of its own; and machines and paths in files for it."""

from __future__ import annotations

import csv
import dataclasses
import os
import re
import shlex
import subprocess
import sys
import warnings
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from click.testing import CliRunner, Result

import pfabrik as pf
from machines import closure
from pfabrik import Joint, Leg, Mechanism
from pfabrik.cli import main
from pfabrik.machine.catalog import template
from pfabrik.machine.files import dumps


def pfabrik(line: str | Sequence[object], given: str | None = None) -> Result:
    """Run a command line without its first word, with standard input if given; a Python exception fails the test."""
    words = shlex.split(line, comments=True) if isinstance(line, str) else [*map(str, line)]
    result = CliRunner().invoke(main, words, input=given)
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


def told(result: Result) -> list[str]:
    """The lines on stderr that do not depend on how quick the machine is: no progress, and no compiling."""
    return [line for line in result.stderr.splitlines() if not re.match(r"pfabrik: .*(compiling|: \d+%, )", line)]


def in_process(line: str, **options: Any) -> subprocess.Popen[str]:
    """Start a command line in a process of its own."""
    command = [sys.executable, "-m", "pfabrik", *shlex.split(line)]
    return subprocess.Popen(command, text=True, stderr=subprocess.PIPE, **options)


def rows_of(path: str | Path) -> list[dict[str, str]]:
    """The rows of a CSV file."""
    with Path(path).open(newline="", encoding="utf-8") as handle:
        return list(csv.DictReader(handle))


# Machines


def plotter() -> Mechanism:
    """A cart that carries a tool which slides and turns."""
    slide = Joint("X", "prismatic", ("base", "cart"), axis=(1, 0, 0), actuated=True, range=(-50, 50))
    limits = ((-0.5, 0.5), (-5, 5))
    tool = Joint("C", "cylindrical", ("cart", "tool"), at=(0, 0, 9), axis=(0, 0, 1), range=limits)
    return Mechanism("plotter", [slide, tool], "tool", (0, 0, 30))


def upu() -> Mechanism:
    """A 3-UPU that translates; positions alone cannot express its legs."""
    joints = []
    for i, angle in enumerate(np.radians([0, 120, 240]), 1):
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        foot, head, tangent = 100 * out, 50 * out + [0, 0, 130], np.cross([0, 0, 1], out)
        inner, along = np.cross(tangent, head - foot), (f"A{i}", f"C{i}")
        joints += [
            Joint(f"A{i}", "universal", ("base", f"c{i}"), at=foot, axes=(tangent, inner)),
            Joint(f"B{i}", "prismatic", (f"c{i}", f"r{i}"), along=along, actuated=True, range=(90, 200)),
            Joint(f"C{i}", "universal", (f"r{i}", "platform"), at=head, axes=(inner, tangent)),
        ]
    return Mechanism("3-UPU", joints, "platform", (0, 0, 130))


def hexagons() -> Mechanism:
    """A 6-UPS whose platform is its base, smaller: it moves with its struts locked."""
    corners = [(np.cos(angle), np.sin(angle)) for angle in np.radians([0, 40, 120, 160, 240, 280])]
    feet, heads = [[100 * x, 100 * y, 0] for x, y in corners], [[60 * x, 60 * y, 150] for x, y in corners]
    legs = [Leg("U-P*-S", base=foot, platform=head) for foot, head in zip(feet, heads, strict=True)]
    return Mechanism.from_legs(legs, name="similar hexagons", reference_point=(0, 0, 150))


def two_links() -> Mechanism:
    """A two-link arm with a hole of radius 1 in its middle."""
    joints = [
        Joint("j1", "revolute", ("base", "upper"), at=(0, 0, 0), axis=(0, 0, 1), actuated=True),
        Joint("j2", "revolute", ("upper", "lower"), at=(3, 0, 0), axis=(0, 0, -1), actuated=True),
        Joint("tip", "revolute", ("lower", "tool"), at=(3, 2, 0), axis=(0, 0, 1)),
    ]
    return Mechanism("two-link arm", joints, "tip")


def with_longer_rods(name: str, *joints: str) -> Mechanism:
    """A machine with the feet of some rods moved along them, so that they are 23 longer."""
    mechanism = pf.load(name)
    moved = []
    for joint in mechanism.joints:
        if joint.name in joints:
            foot, head = np.array(joint.at), np.array(mechanism.joint(f"C{joint.name[1:]}").at)
            along = (foot - head) / np.linalg.norm(foot - head)
            joint = dataclasses.replace(joint, at=tuple((foot + 23.0 * along).tolist()))
        moved.append(joint)
    return dataclasses.replace(mechanism, joints=moved)


FLAP = """
schema = 1
name = "flap"
units = { length = "mm", angle = "deg" }
end_effector = "flap"
reference_point = [100, 0, 0]
task = ["tilt"]

[[joint]]
name = "hinge"
type = "revolute"
connects = ["base", "flap"]
at = [0, 0, 0]
axis = [0, 1, 0]
actuated = true
range = [-30, 30]
"""


def edited(text: str, pattern: str, replacement: str) -> str:
    """A text with all that a pattern matches replaced; it has to match."""
    text, count = re.subn(pattern, replacement, text, flags=re.MULTILINE)
    assert count
    return text


@cache
def files() -> dict[str, str]:
    """File name -> its text: machines and paths that transcripts and tests use."""
    hundred = Leg("U-P*-S", base=[100, 0, 0], platform=[50, 10, 180], copies={"count": 100, "axis": (0, 0, 1)})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        machines = {
            "free": pf.load("five_bar").without_limits(),
            "endless": pf.load("stewart").without_limits(),
            "plotter": plotter(),
            "upu": upu(),
            "hexagons": hexagons(),
            "two_links": two_links(),
            "scara": closure.scara(),
            "one_rod": with_longer_rods("delta", "BL2"),
            "one_carriage_rod": with_longer_rods("linear_delta", "BR1"),
            "two_carriage_rods": with_longer_rods("linear_delta", "BL3", "BR3"),
            "servo_rod": with_longer_rods("servo_hexapod", "BL1"),
            "weighed": pf.load("five_bar").with_masses(
                [pf.Mass(f"link{k}", 0.1 * k, (0, 0, 90)) for k in (1, 2, 3, 4)]
            ),
            "hundred_legs": Mechanism.from_legs(hundred, reference_point=(0, 0, 180)),
        }
    five_bar = dumps(pf.load("five_bar"))
    height = pf.load("rps").reference_point[2]
    hole = [3, 2, 1.5, 1.1, 0.75, 0.5, 0.25, -0.25, -0.5, -0.75]
    return {f"{name}.toml": dumps(machine) for name, machine in machines.items()} | {
        "flap.toml": FLAP,
        "untasked.toml": edited(template("3-RPS"), "^task.*$", ""),
        "narrow.toml": edited(template("5-bar"), r"range = \[.*\]", "range = [-1, 1]"),
        "radians.toml": edited(template("5-bar"), 'angle = "deg"', 'angle = "rad"'),
        "faulty.toml": five_bar.replace("actuated = true", 'actuated = "yes"'),
        "revolving.toml": five_bar.replace('"revolute"', '"revolving"'),
        "path.csv": "x,y,z\n0,10,200\n5,10,201\n",
        "turned.csv": "x,y,z,roll,pitch,yaw\n0,0,190,0,0,0\n5,0,190,0,5,0\n\n10,20,300,0,0,0\n",
        "lift.csv": "x,y,z\n3,1,195\n3,1,205\n3,1,205\n",
        "swing.csv": "x,y,z\n0,5,175\n0,10,180\n",
        "rise.csv": "t,x,y,z\n" + "".join(f"{k / 10},0,{2 * k},{180 + k * k}\n" for k in range(5)),
        "hole.csv": "x,y,z\n" + "".join(f"{x},0,0\n" for x in hole),
        "tilted.csv": "x,y,z,roll,pitch,yaw\n340,60,0,0,0,5\n340,60,0,0,3,5\n",
        "yawed.csv": "x,y,z,roll,pitch,yaw\n0,10,190,0,0,5\n",
        "aside.csv": f"x,y,z,roll,pitch,yaw\n0,3,{height + 1},2,0,0\n",
        "upu.csv": "x,y,z\n3,4,135\n5,2,140\n",
        "edge.csv": "x,y,z\n0,0,5\n1,0,5\n",
    }


def write_files(*names: str) -> None:
    """Write some of the files into the present folder, or all."""
    for name in names or files():
        Path(name).write_text(files()[name], encoding="utf-8")


def listed() -> list[str]:
    """What the present folder has in it."""
    return sorted(os.listdir())
