"""A node of ROS 2 for a platform: poses in, commands of actuators out, around the exported C."""

from __future__ import annotations

import json
from collections.abc import Iterable
from os import PathLike
from pathlib import Path
from shlex import quote

import numpy as np

from ...common.checks import require_path
from ...machine.description.drive_bounds import drive_limits
from ...machine.description.mechanism import Mechanism, checked_mechanism
from ...machine.files.units import metres_of
from ...options import USUAL
from .export_c import Part, c_source
from .machine_data import Machine
from .ros2_description import PlatformDescription, ShownJoint
from .ros2_texts import filled, in_markdown, in_xml, package_name, plain, write_package
from .source import ACTIVE, features
from .static_data import literal, quoted

FILES = {
    "CMakeLists.txt": "CMakeLists.txt",
    "package.xml": "package.xml",
    "README.md": "README.md",
    "params.yaml": "config/params.yaml",
    "launch.py.in": "launch/{name}.launch.py",
    "platform.hpp": "src/{name}_platform.hpp",
    "node.cpp": "src/{name}_node.cpp",
}
"""Where each text of `ros2_node_package` goes in the folder."""

KINDS = ("kSlides", "kTurns", "kTilts", "kTiltsNext")
"""Names of the kinds of `ShownJoint` in C++."""


def export_ros2_node(
    mechanism: Mechanism,
    folder: str | PathLike[str],
    *,
    name: str | None = None,
    hold_price: float = USUAL.hold_price,
) -> Path:
    """Write a package of ROS 2 with a node that commands a platform's actuators for poses of its end effector.

    Out of reach it commands the nearest feasible pose, or holds, and its diagnostics name the limits. The package has
    the exported C, a description (URDF) with all joints for rviz, a launch file, parameters and a README.md; metres and
    radians throughout.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    folder : str or PathLike
        Folder of the package. It is made where it is not there; files of the package in it are replaced, others are
        left alone.
    name : str, optional
        Prefix of the package and of all names in it, lower-case letters, digits and underscores; the folder's, without
        "_node", if it is left out.
    hold_price : float, optional
        Up to which the nearest poses hold the orientation, as in `Options`.

    Raises
    ------
    UnsupportedMechanism
        No C can be exported of it, for the reason that `export_c` gives.
    InvalidArgument
        A name that is not allowed, or a unit of length that is not known in metres.
    """
    path = require_path("folder", folder)
    return write_package(path, ros2_node_texts(mechanism, path, name=name, hold_price=hold_price))


def ros2_node_texts(
    mechanism: Mechanism, folder: Path, *, name: str | None = None, hold_price: float = USUAL.hold_price
) -> dict[str, str]:
    """The files of the package by their place in its folder."""
    checked_mechanism(mechanism)
    name = package_name(folder, name, "_node")
    machine = Machine(mechanism)
    description = PlatformDescription(machine)
    parts: list[Part] = ["ik", "limits", "bodies"]
    parts += [] if machine.uncontrolled else ["fk"]
    parts += [] if machine.why_no_nearest else ["nearest"]
    parts += [] if machine.why_no_live else ["live"]
    file = f"{name}_kinematics.c"
    texts = {
        f"src/{file}": c_source(mechanism, parts=parts, name=name, hold_price=hold_price, file=file),
        f"urdf/{name}.urdf": description.text(),
    }
    return texts | filled("ros2_node_package", FILES, _words(machine, description, parts, name))


def commands(mechanism: Mechanism, folder: Path, name: str | None = None) -> list[str]:
    """The commands that build a package, launch its node, and send it home."""
    name = package_name(folder, name, "_node")
    target = quote(_example_target(mechanism, metres_of(mechanism.length_unit)))
    return [
        f"colcon build --packages-select {name}_node && source install/setup.bash",
        f"ros2 launch {name}_node {name}.launch.py open_loop:=true",
        f"ros2 topic pub --once /{name}/target geometry_msgs/msg/PoseStamped {target}",
    ]


def _example_target(mechanism: Mechanism, metres: float) -> str:
    """A message of the pose at home, as `ros2 topic pub` takes it."""
    x, y, z = (float(f"{value:.6g}") for value in mechanism.home_pose[:3, 3] * metres)
    position = f"{{x: {x}, y: {y}, z: {z}}}"
    return f"{{header: {{frame_id: {_exact(mechanism.base)}}}, pose: {{position: {position}}}}}"


def _words(machine: Machine, description: PlatformDescription, parts: list[Part], name: str) -> dict[str, str]:
    mechanism, metres = machine.mechanism, description.metres
    size, has = mechanism.characteristic_length * metres, features(machine, parts)
    nearest = f"{name}_ik_or_nearest(&memory_, &wanted, &pose, actuators, settings_.steps, settings_.starts, holding)"
    too_near = f" || code > {name.upper()}_PAIR" if "CLEARANCE" in has else ""
    mosts = zip(*(drive_limits(mechanism, what, None) for what in ("speed", "acceleration")), strict=True)
    actuators = [
        [_exact(drive.name), _truth(each.is_length)]
        + [literal(value) for value in (*_units(each.is_length, metres, size), each.home)]
        + [literal(value if np.isfinite(value) else 0.0) for value in most]
        for drive, each, most in zip(mechanism.drives, machine.driven, mosts, strict=True)
    ]
    live = {
        "BEGIN": f"{name}_live_begin(&memory_, &commanded_.pose, speeds, accelerations, actuators)",
        "TICK": f"{name}_live_tick(&memory_, &wanted, seconds, &pose, actuators)",
    }
    limits = []
    for (joint, bound), (value, is_length) in zip(machine.limits, machine.bounds, strict=True):
        unit, whole = _units(is_length, metres, size)
        text = quoted(f"{joint} {bound} {value * unit:.10g} {'m' if is_length else 'rad'}")
        limits.append([text, literal(unit), literal(whole)])
    listed = ", ".join(mechanism.actuator_names)
    columns = [drive.column for drive in mechanism.drives]
    return {
        "NAME": name,
        "MACRO": name.upper(),
        "GUARD": f"{name}_node__{name}".upper(),
        "MACHINE": plain(mechanism.name),
        "MACHINE_MARKDOWN": in_markdown(mechanism.name),
        "MACHINE_XML": in_xml(mechanism.name),
        "MACHINE_TEXT": quoted(mechanism.name),
        "ACTUATORS_MARKDOWN": in_markdown(listed),
        "ACTUATORS_XML": in_xml(listed),
        "BASE": _exact(mechanism.base),
        "BASE_MARKDOWN": in_markdown(mechanism.base),
        "PLATFORM": _exact(mechanism.end_effector),
        "COMMANDS": "\n".join(f"    {each}" for each in commands(mechanism, Path(), name)),
        "METRES": literal(metres),
        "SIZE": f"{size:.6g}",
        "AXES": ", ".join(_truth(axis) for axis in machine.axes),
        "ROTATIONS": str(machine.rotations),
        "HAS_NEAREST": _truth("nearest" in parts),
        "HAS_FORWARD": _truth("fk" in parts),
        "HAS_LIVE": _truth("live" in parts),
        "OUT_OF_REACH": "live" if "live" in parts else "project" if "nearest" in parts else "hold",
        "ACTIVE": literal(ACTIVE["double"]),
        **{f"LIVE_{what}": call if "live" in parts else f"{name.upper()}_NO_ACTUATORS" for what, call in live.items()},
        "ANSWER": nearest if "nearest" in parts else f"{name}_ik(&memory_, &wanted, &pose, actuators)",
        "JUMPED": f"code_ == {name.upper()}_JUMPED" if "nearest" in parts else "false",
        "FORWARD": f"{name}_fk(&memory_, actuators, &pose, nullptr)"
        if "fk" in parts
        else f"{name.upper()}_NO_ACTUATORS",
        "COUNT_TURNS": f"{name}_count_turns(&memory_, before, actuators);" if "TURNS" in has else "",
        "MEASURE_LINKS": f"{name}_clearance(&memory_, &commanded_.pose, &between_, &pair_);"
        if "CLEARANCE" in has
        else "",
        "PAIR": f"{name.upper()}_PAIR + platform_.pair()" if "CLEARANCE" in has else "0",
        "CLEARANCE": literal((mechanism.clearance or 0.0) * metres),
        "ROUNDING": literal(ACTIVE["double"] * size),
        "IS_MEASURED": f"code == 0{too_near}",
        "N_JOINTS": str(len(description.joints)),
        "ACTUATOR_TABLE": _table(actuators),
        "LIMIT_TABLE": _table(limits or [['""', "1.0", "1.0"]]),
        "JOINT_TABLE": _table(_joint(joint, columns) for joint in description.joints),
    }


def _exact(text: str) -> str:
    """A string of C++, and of YAML, that other programs compare with."""
    return json.dumps(text, ensure_ascii=False)


def _units(is_length: bool, metres: float, size: float) -> tuple[float, float]:
    """The unit of a coordinate, and what it counts in of all machines."""
    return (metres, size) if is_length else (1.0, 1.0)


def _truth(value: object) -> str:
    return "true" if value else "false"


def _table(rows: Iterable[list[str]]) -> str:
    return ",\n".join(f"  {{{', '.join(row)}}}" for row in rows)


def _joint(joint: ShownJoint, columns: list[int]) -> list[str]:
    """A joint as a row of the table of C++."""
    numbers = [literal(joint.axis), literal(joint.line), *map(_bound, (joint.home, joint.lo, joint.hi))]
    actuator = columns.index(joint.column) if joint.column in columns else -1
    return [_exact(joint.name), KINDS[joint.kind], str(joint.parent), str(joint.body), *numbers, str(actuator)]


def _bound(value: float) -> str:
    return literal(value) if np.isfinite(value) else "kInfinity" if value > 0.0 else "-kInfinity"
