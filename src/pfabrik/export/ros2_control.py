"""A transmission for ros2_control, as a package of ROS 2 around the exported C."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from importlib import resources
from os import PathLike
from pathlib import Path

from ..checks import require_path
from ..description.mechanism import Mechanism, checked_mechanism
from ..kinematics import JointPath
from ..whole_files import whole_path
from .export_c import c_source, require_identifier
from .machine_data import Machine, fitting_path
from .static_data import comment, literal

FILES = {
    "CMakeLists.txt": "CMakeLists.txt",
    "package.xml": "package.xml",
    "plugins.xml": "{name}_transmission_plugins.xml",
    "snippet.urdf.xml": "{name}_transmission.urdf.xml",
    "transmission.hpp": "include/{name}_transmission/{name}_transmission.hpp",
    "transmission.cpp": "src/{name}_transmission.cpp",
}
"""Where each text of `ros2_package` goes in the folder."""


def export_ros2_control(
    mechanism: Mechanism,
    folder: str | PathLike[str],
    *,
    joints: str | Sequence[str],
    name: str | None = None,
) -> Path:
    """Write a package of ROS 2 with a transmission between joints in series and the actuators.

    It has a `transmission_interface::Transmission` with its loader, the description of the plugin, CMakeLists.txt,
    package.xml, the exported C, and a piece of URDF. Efforts conserve power; limits, the clearance between
    links among them, stay the controller's.

    Parameters
    ----------
    folder : it is made where it is not there; files of the package in it are replaced, others are left alone.
    joints : names of joints in series from the base to the end effector.
    name : prefix of the package and of all names in it, lower-case letters, digits and underscores; the folder's,
        without "_transmission", if it is left out.

    Raises
    ------
    UnsupportedMechanism : some chain is no leg in closed form, or joints and actuators do not determine each other.
    UnknownName, InvalidArgument : of the joints or the name.
    """
    path = require_path("folder", folder)
    for place, text in ros2_control_texts(mechanism, joints, prefix_of(path, name)).items():
        file = path / place
        file.parent.mkdir(parents=True, exist_ok=True)
        with whole_path(file) as part:
            part.write_text(text, encoding="utf-8")
    return path


def prefix_of(folder: Path, name: str | None) -> str:
    """The prefix of all names: the one given, or the folder's name without "_transmission"."""
    return folder.resolve().name.removesuffix("_transmission") if name is None else name


def ros2_control_texts(mechanism: Mechanism, joints: str | Sequence[str], name: str) -> dict[str, str]:
    """The files of the package by their place in its folder."""
    checked_mechanism(mechanism)
    require_identifier(name)
    Machine(mechanism)  # its legs have closed forms
    path = fitting_path(mechanism, joints)
    words, templates = _words(mechanism, path, name), resources.files(__package__).joinpath("ros2_package")
    texts = {f"src/{name}_kinematics.c": c_source(mechanism, parts=("ik", "fk", "rates"), name=name, joints=path.names)}
    for template, place in FILES.items():
        text = templates.joinpath(template).read_text(encoding="utf-8")
        for word, meant in words.items():
            text = text.replace(f"@{word}@", meant)
        texts[place.format(name=name)] = text
    return texts


def _words(mechanism: Mechanism, path: JointPath, name: str) -> dict[str, str]:
    joints, actuators = ", ".join(path.names), ", ".join(mechanism.actuator_names)
    elements = [
        f'  <actuator name="{_xml(each)}" role="actuator{n}"/>' for n, each in _counted(mechanism.actuator_names)
    ]
    elements += [f'  <joint name="{_xml(each)}" role="joint{n}"/>' for n, each in _counted(path.names)]
    return {
        "NAME": name,
        "GUARD": f"{name}_transmission__{name}".upper(),
        "MACRO": name.upper(),
        "MACHINE": _plain(mechanism.name),
        "JOINTS": _plain(joints),
        "ACTUATORS": _plain(actuators),
        "MACHINE_XML": _xml(mechanism.name),
        "JOINTS_XML": _xml(joints),
        "ACTUATORS_XML": _xml(actuators),
        "N_JOINTS": str(len(path.names)),
        "N_ACTUATORS": str(len(mechanism.actuator_names)),
        "HOME": literal(path.home)[1:-1],
        "ELEMENTS": "\n".join(elements),
    }


def _counted(names: Sequence[str]) -> list[tuple[int, str]]:
    return list(enumerate(names, 1))


def _plain(text: str) -> str:
    """Text safe in a comment and in a string of C++."""
    return comment(text).replace("\\", "/").replace('"', "'")


def _xml(text: str) -> str:
    return escape(text).replace("--", "- -")
