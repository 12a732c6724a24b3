"""A transmission for ros2_control, as a package of ROS 2 around the exported C."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path

from ...common.checks import require_path
from ...kinematics import JointPath
from ...machine.description.mechanism import Mechanism, checked_mechanism
from .export_c import c_source
from .machine_data import Machine, fitting_path
from .ros2_texts import filled, in_xml, package_name, plain, write_package
from .static_data import literal

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
    mechanism : Mechanism
        The machine.
    folder : str or PathLike
        Folder of the package. It is made where it is not there; files of the package in it are replaced, others are
        left alone.
    joints : str or sequence of str
        Names of joints in series from the base to the end effector.
    name : str, optional
        Prefix of the package and of all names in it, lower-case letters, digits and underscores; the folder's, without
        "_transmission", if it is left out.

    Raises
    ------
    UnsupportedMechanism
        Some chain is no leg in closed form, or joints and actuators do not determine each other.
    UnknownName or InvalidArgument
        Joints that are none, or a name that is not allowed.
    """
    path = require_path("folder", folder)
    return write_package(path, ros2_control_texts(mechanism, path, joints=joints, name=name))


def ros2_control_texts(
    mechanism: Mechanism, folder: Path, *, joints: str | Sequence[str], name: str | None = None
) -> dict[str, str]:
    """The files of the package by their place in its folder."""
    checked_mechanism(mechanism)
    name = package_name(folder, name, "_transmission")
    Machine(mechanism)  # its legs have closed forms
    path = fitting_path(mechanism, joints)
    texts = {f"src/{name}_kinematics.c": c_source(mechanism, parts=("ik", "fk", "rates"), name=name, joints=path.names)}
    return texts | filled("ros2_package", FILES, _words(mechanism, path, name))


def _words(mechanism: Mechanism, path: JointPath, name: str) -> dict[str, str]:
    joints, actuators = ", ".join(path.names), ", ".join(mechanism.actuator_names)
    elements = [
        f'  <actuator name="{in_xml(each)}" role="actuator{n}"/>' for n, each in _counted(mechanism.actuator_names)
    ]
    elements += [f'  <joint name="{in_xml(each)}" role="joint{n}"/>' for n, each in _counted(path.names)]
    return {
        "NAME": name,
        "GUARD": f"{name}_transmission__{name}".upper(),
        "MACRO": name.upper(),
        "MACHINE": plain(mechanism.name),
        "JOINTS": plain(joints),
        "ACTUATORS": plain(actuators),
        "MACHINE_XML": in_xml(mechanism.name),
        "JOINTS_XML": in_xml(joints),
        "ACTUATORS_XML": in_xml(actuators),
        "N_JOINTS": str(len(path.names)),
        "N_ACTUATORS": str(len(mechanism.actuator_names)),
        "HOME": literal(path.home)[1:-1],
        "ELEMENTS": "\n".join(elements),
    }


def _counted(names: Sequence[str]) -> list[tuple[int, str]]:
    return list(enumerate(names, 1))
