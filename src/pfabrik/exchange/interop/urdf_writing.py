"""A mechanism as a robot description (URDF): a tree of links, and a file of loops beside it."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from ...common.arrays import Floats
from ...common.whole_files import whole_path
from ...errors import InvalidArgument
from ...kinematics import columns
from ...machine.description.body_inertias import inertias_of
from ...machine.description.body_masses import as_moments
from ...machine.description.joint_coordinates import JointCoordinate
from ...machine.description.mechanism import Mechanism, checked_mechanism
from ...machine.files.units import metres_of
from .cuts import Branch, CutTree, cut_tree
from .mjcf_bodies import share_of
from .names import unique
from .urdf_collision import MOMENTS
from .urdf_tree import DRAKE, UrdfTree, kind_of_joint, left_out
from .xml_reading import number_text

Table = dict[str, Any]


def to_urdf(
    mechanism: Mechanism, path: str | os.PathLike[str] | None = None, loops: str | os.PathLike[str] | None = None
) -> tuple[str, Table]:
    """A mechanism as a robot description, and what URDF cannot tell of it: loops, balls and motors.

    Zero is home, closed, for URDF has no word for another; frames are parallel to the base's there, that of the end
    effector is at the reference point. Balls of the tree are `floating` in the description and SPHERICAL in the file of
    loops; loops meet in links `closing_<joint>_1` and `closing_<joint>_2`. Masses,
    friction, and the most that drives exert and how fast they are go out where the machine has them; highest
    accelerations, rotors and gears in Drake's words. An effort or velocity of 0 stands for one that is not known, and a
    body that closes a loop with a double of it leaves that a tenth of its mass. Cones, tasks, shapes and what drives a
    ball are left out, as comments at the top of the file say.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    path, loops : str or PathLike, optional
        The files to write, URDF and YAML; None writes none.

    Returns
    -------
    tuple
        The text of the description, and the content of the file of loops, both as `from_urdf` takes them.
    """
    metres = metres_of(checked_mechanism(mechanism).length_unit)
    if path is not None and loops is not None and os.path.realpath(path) == os.path.realpath(loops):
        raise InvalidArgument("loops", f"'{os.fspath(loops)}', where the description goes", "a file of its own")
    description = _Description(mechanism, metres)
    text = description.text()
    for file, content in ((path, text), (loops, json.dumps(description.table, indent=1) + "\n")):
        if file is not None:
            with whole_path(Path(file)) as part:
                part.write_text(content, encoding="utf-8")
    return text, description.table


class _Description(UrdfTree):
    """A description, and its table of loops."""

    def __init__(self, mechanism: Mechanism, metres: float) -> None:
        super().__init__(mechanism, metres)
        for remark in _remarks(mechanism):
            self.remark(remark)
        motors = [drive.name for drive in mechanism.drives]
        self.table: Table = {"closed_loop": [], "type": [], "name_mot": motors, "joint_name": [], "joint_type": []}
        self._carriers: dict[str, str] = {}
        self._joint_names = {joint.name for joint in mechanism.joints} | set(mechanism.coordinate_names)
        self._link_names = set(mechanism.bodies)
        self._add_body(mechanism.base, "", np.zeros(3))
        tree = cut_tree(mechanism)
        for branch in tree.branches:
            self._add_branch(branch)
        for joint in tree.cuts:
            at = np.array(mechanism.reference_point if joint.at is None else joint.at) * metres
            self._close(joint.name, joint.connects, at, is_weld=joint.type == "fixed")
        self._weigh(tree)
        self._add_rotors()

    def _add_branch(self, branch: Branch) -> None:
        """A body and the joints that it hangs on, from its parent outward."""
        joint, parent = branch.joint, self._carriers[branch.parent]
        origin = self.origins[parent] if joint.at is None else np.array(joint.at) * self.metres
        coordinates = self.mechanism.coordinates[columns(self.mechanism)[joint.name]]
        parts: list[tuple[str, str, JointCoordinate | None]]
        if joint.type == "spherical" or not coordinates:
            self.table["joint_name"] += [joint.name] if joint.type == "spherical" else []
            self.table["joint_type"] += ["SPHERICAL"] if joint.type == "spherical" else []
            parts = [(joint.name, "floating" if joint.type == "spherical" else "fixed", None)]
        else:
            ordered = coordinates if branch.forward else coordinates[::-1]
            parts = [(each.name, kind_of_joint(each), each) for each in ordered]
        for place, (name, kind, coordinate) in enumerate(parts):
            is_last = place == len(parts) - 1
            link = self._body_link(branch.body) if is_last else unique(f"{branch.body}:{name}", self._link_names)
            element = self.join(name, kind, parent, link, origin)
            if coordinate is not None:
                self.move(element, coordinate, 1.0 if branch.forward else -1.0, from_home=True)
            parent = link
        self._add_body(branch.body, parent, origin)
        if branch.double_of is not None:
            self._close(joint.name, (branch.double_of, branch.body), origin, is_weld=True)

    def _body_link(self, body: str) -> str:
        """The link that hangs on a body's joint: of the end effector it is not its own, which is at another point."""
        is_tip = body == self.mechanism.end_effector_body and not self.mechanism.end_effector_is_joint
        return unique(f"{body}:frame", self._link_names) if is_tip else body

    def _add_body(self, body: str, link: str, origin: Floats) -> None:
        """The link of a body, in the place of its joint; the end effector's at the reference point."""
        if link in ("", body):
            self.link(body, origin)
            self._carriers[body] = body
        else:
            self._carriers[body] = link
            point = np.array(self.mechanism.reference_point) * self.metres
            self.join(unique(f"{body}:at", self._joint_names), "fixed", link, body, point)

    def _weigh(self, tree: CutTree) -> None:
        """Add what links weigh, of bodies whose masses are known."""
        masses = inertias_of(self.mechanism, self.metres)
        links = {link.get("name"): link for link in self.root.iterfind("link")}
        bodies = [(body, body) for body in self.mechanism.bodies]
        doubles = [(branch.body, branch.double_of) for branch in tree.branches if branch.double_of is not None]
        for body, weighed in [*bodies, *doubles]:
            if weighed not in masses or masses[weighed].mass == 0.0:
                continue
            (mass, centre, inertia), share = masses[weighed], share_of(body, tree)
            element = ET.SubElement(links[body], "inertial")
            ET.SubElement(element, "origin", xyz=number_text(centre * self.metres - self.origins[body]), rpy="0 0 0")
            ET.SubElement(element, "mass", value=repr(share * mass))
            moments = as_moments(share * inertia * self.metres**2)
            ET.SubElement(element, "inertia", dict(zip(MOMENTS, map(repr, moments), strict=True)))

    def _add_rotors(self) -> None:
        """Add the rotors of motors, as transmissions."""
        for drive in self.mechanism.drives:
            rotor, gear = drive.said("rotor_inertia"), drive.said("gear")
            if rotor is None:
                continue
            motor = ET.SubElement(self.root, "transmission", name=f"{drive.name}:transmission")
            ET.SubElement(motor, "type").text = "transmission_interface/SimpleTransmission"
            ET.SubElement(motor, "joint", name=drive.name)
            actuator = ET.SubElement(motor, "actuator", name=f"{drive.name}:motor")
            for key, value in (("rotor_inertia", rotor), ("gear_ratio", gear)):
                if value is not None:
                    ET.SubElement(actuator, f"{DRAKE}:{key}", value=repr(value))

    def _close(self, name: str, bodies: tuple[str, str], at: Floats, *, is_weld: bool) -> None:
        """A loop, by a link on each of two bodies that meet at a point [m]."""
        ends = [unique(f"closing_{name}_{side}", self._link_names) for side in (1, 2)]
        for body, end in zip(bodies, ends, strict=True):
            self.join(unique(end, self._joint_names), "fixed", self._carriers[body], end, at)
        if is_weld:
            self.table["closed_loop"].append(ends)
            self.table["type"].append("6d")


def _remarks(mechanism: Mechanism) -> Iterator[str]:
    """Yield the comments for who reads the file: whose it is, and what is not in it."""
    yield f"'{mechanism.name}', written by pfabrik: lengths in m, joints count from home"
    for drive in mechanism.coordinates:
        if drive.home:
            yield f"{drive.name} counts {drive.home:.9g} more in the machine's own file"
    masses = inertias_of(mechanism, metres_of(mechanism.length_unit))
    if unweighed := [body for body in mechanism.bodies if body not in masses and body != mechanism.base]:
        yield f"no mass is known of {', '.join(unweighed)}"
    yield from left_out(mechanism)
