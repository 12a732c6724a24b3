"""One border has one name: whichever verb meets it, a limit or a dead point is called alike."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pfabrik as pf
from pfabrik.answers.words import limit_name
from pfabrik.machine.files import loads

PRINTER = """
[printer]
kinematics: delta
delta_radius: {radius}
[stepper_a]
position_endstop: 300
arm_length: {arm}
[stepper_b]
[stepper_c]
"""
CRANKS = """
schema = 1
name = "cranks"
end_effector = "platform"
reference_point = [0, 0, 125]
[[leg]]
chain = "R*-U-S"
base = [[95, 35, 0], [95, -35, 0]]
via = [[95, 65, 0], [95, -65, 0]]
platform = [[55, 45, 125], [55, -45, 125]]
copies = {{ count = 3, axis = [0, 0, 1] }}
A.axis = ["x", "-x"]
"""
RAILS = """
schema = 1
name = "rails"
end_effector = "platform"
reference_point = [0, 0, 100]
[[leg]]
chain = "P*-U-S"
axis = {axis}
base = [[100, 20, 0], [100, -20, 0]]
platform = [[40, 40, 100], [40, -40, 100]]
copies = {{ count = 3, axis = [0, 0, 1] }}
"""
ARM = """
schema = 1
name = "arm"
end_effector = "hand"
reference_point = [130, 40, 0]
task = ["x", "y"]
[[joint]]
name = "A"
type = "revolute"
actuated = true
connects = ["base", "upper"]
at = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "B"
type = "revolute"
actuated = true
connects = ["upper", "hand"]
at = [90, 0, 0]
axis = [0, 0, 1]
"""
MADE = {
    "printer": PRINTER.format(radius=140, arm=290),
    "wide printer": PRINTER.format(radius=200, arm=260),
    "cranks": CRANKS.format(),
    "upright rails": RAILS.format(axis='"vertical"'),
    "rails": RAILS.format(axis='"radial"'),
    "arm": ARM,
}
DEAD = {"printer": "level", "wide printer": "level", "upright rails": "level"}


def machine_of(name: str, folder: Path) -> pf.Mechanism:
    """A machine of the catalogue, or one of those above."""
    if name not in MADE:
        return pf.load(name)
    if "printer" not in name:
        return loads(MADE[name])
    file = folder / "printer.cfg"
    file.write_text(MADE[name])
    return pf.load(file)


def named(limits: tuple[pf.ActiveLimit, ...]) -> set[str]:
    return {limit_name(limit.joint, limit.bound) for limit in limits}


@pytest.mark.parametrize(
    "name", [*MADE, "delta", "linear_delta", "stewart", "hexaglide", "servo_hexapod", "orthoglide"]
)
def test_workspace_travel_track_and_ik_name_a_border_alike(name: str, tmp_path: Path) -> None:
    machine = machine_of(name, tmp_path)
    home, rng = pf.solve_ik(machine, machine.home_pose), np.random.default_rng(5)
    axes, length, dead = [*machine.task[: 2 + ("z" in machine.task)]], machine.characteristic_length, set()
    for _ in range(8):
        way = np.zeros(3)
        way[["xyz".index(axis) for axis in axes]] = rng.normal(size=len(axes))
        (reach,) = pf.travel(home, along=way)
        if reach.end is None:
            continue
        beyond = reach.end.pose.copy()
        beyond[:3, 3] += 1e-5 * length * np.array(reach.direction)
        feasible = pf.feasibility(machine, beyond, start=home)  # what a workspace asks just beyond its border
        of_map = limit_name(*feasible.limits[feasible.binding])
        answer = pf.solve_ik(machine, beyond, start=reach.end)
        tracked = pf.track(machine, np.stack([reach.end.pose, beyond]), start=reach.end)
        assert named(tracked.active_limits[-1]) == named(answer.active_limits)
        assert of_map in named(reach.stopped_by) | named(answer.active_limits)
        assert named(reach.stopped_by) & named(answer.active_limits)
        assert reach.why == "; ".join(dict.fromkeys(limit_name(each.joint, each.bound) for each in reach.stopped_by))
        if of_map.split()[-1] in ("stretched", "level"):
            assert named(reach.stopped_by) == {of_map} and of_map in named(answer.active_limits)
            dead.add(of_map.split()[-1])
    assert not (dead or name in MADE) or dead == {DEAD.get(name, "stretched")}


def test_a_whole_map_has_the_names_of_travel(tmp_path: Path) -> None:
    machine = machine_of("printer", tmp_path)
    found = pf.workspace(machine, over=("x", "y"), fixed={"z": 50.0}, resolution=4.0)
    bounds = {limit for limit, share in found.shares.items() if share > 0.01}
    assert bounds == {(f"carriage_{tower}", "level") for tower in "abc"}
