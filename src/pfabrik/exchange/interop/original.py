"""Answers against the file that a mechanism was imported from: its joints put there, its loops closed by MuJoCo."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

import numpy as np

from ...answers.solution import Solution
from ...common.arrays import Floats
from ...common.extras import require
from ...errors import InvalidArgument, PfabrikError, UnknownName
from ...fk import solve_fk
from ...machine.description.mechanism import Mechanism
from ...tolerances import TOLERANCES
from .loops_file import read_loops
from .mjcf_model import CompiledModel, frame_of
from .mjcf_plain import bare_model, plain_robot
from .mjcf_reading import from_mjcf
from .opened import CLOSING
from .referee import distances
from .robot_in_mujoco import RobotInMujoco
from .urdf_reading import from_urdf, read_description
from .xml_reading import kind_of, read_xml

if TYPE_CHECKING:
    from .second_reading import SaidJoint

SHARES = (0.0, 0.05, 0.2, 0.4)
"""How far joints are moved off zero before the loops are closed: shares of a radian, and of the size."""

OPEN = 10.0
"""Times what loops stay open by, up to which a joint may be off: rounding."""


@dataclass(frozen=True)
class OriginalFile:
    """A file that a mechanism was imported from, and how: arguments as of `verify`."""

    path: str | os.PathLike[str]
    loops: str | os.PathLike[str] | Mapping[str, Any] | None
    configuration: str

    def model(self, driven: Sequence[str]) -> str:
        """The kinematics of a model, or of a robot description, with all loops, as a MuJoCo model; couplings left out.

        Of joints that are coupled a mechanism has one, or drives that somebody else couples.
        """
        if kind_of(self.path) != "mjcf":
            root = read_xml(self.path, "urdf", "sdf")
            plain = plain_robot(*read_description(root, read_loops(self.loops), driven, []))
        elif self.loops is not None:
            raise InvalidArgument("loops", "some", "none: a MuJoCo model tells its loops itself")
        else:
            plain = bare_model(read_xml(self.path, "mjcf"))
        for section in plain.iterfind("equality"):
            for joint in section.findall("joint"):
                section.remove(joint)
        _add_named_loops(plain)
        return ET.tostring(plain, encoding="unicode")

    def misread(self, driven: Sequence[str]) -> tuple[float, float]:
        """How far joints of a description are from what a second reader says of them, [m] and [rad].

        The largest over configurations in which the loops of the file as a model are closed; 0 for a MuJoCo model,
        which MuJoCo reads itself. A loop that a file of loops tells too is that file's.
        """
        if kind_of(self.path) == "mjcf":
            return 0.0, 0.0
        root, loops_file = read_xml(self.path, "urdf", "sdf"), read_loops(self.loops)
        links, _ = read_description(root, loops_file, driven, [])
        told = {frozenset(loop.links) for loop in loops_file.loops(links.frames, links.frame_joints)}
        hung = {joint.name for joint in links.joints}
        require("comparing with the original file", "scipy", "mujoco")
        from .second_reading import joints_said

        said = joints_said(root, loops_file.retyped)
        said = [each for each in said if each.name in hung or frozenset(each.links) not in told]
        return _misread(CompiledModel(self.model(driven)), said)

    def imported_as(self, mechanism: Mechanism, left_out: Sequence[str]) -> Mechanism | None:
        """The file as a machine with a mechanism's base, end effector, actuators and point; None where it makes none.

        Joints that the mechanism has not were left out, or held; so those of machines with the same joints come first.
        """
        machines = []
        asked: dict[str, Any] = {
            "base": mechanism.base,
            "end_effector": mechanism.end_effector,
            "actuated": mechanism.actuator_names,
            "length_unit": mechanism.length_unit,
            "task": mechanism.task,
        }
        for fixed in ((), left_out):
            try:
                if kind_of(self.path) != "mjcf":
                    machine = from_urdf(self.path, self.loops, fixed=fixed, **asked).mechanism
                else:
                    machine = from_mjcf(self.path, configuration=self.configuration, fixed=fixed, **asked).mechanism
            except PfabrikError:
                continue
            machines.append(machine)
        machines.sort(key=lambda each: each.coordinate_names != mechanism.coordinate_names)
        if not machines or set(machines[0].actuator_names) != set(mechanism.actuator_names):
            return None
        point = {} if mechanism.end_effector_is_joint else {"reference_point": mechanism.reference_point}
        return machines[0]._with(**point)


class Original:
    """The robot of such a file with the joints of a mechanism in it."""

    def __init__(self, mechanism: Mechanism, file: OriginalFile) -> None:
        self.robot = RobotInMujoco(mechanism, file.model(mechanism.actuator_names), file.configuration)
        self._close(self.robot.put_home)
        tips = [mechanism.end_effector]
        if mechanism.end_effector_is_joint:
            tips = [*mechanism.joint(mechanism.end_effector).connects]
        names = [self.robot.model.body(index).name for index in range(self.robot.model.nbody)]
        body = next((name for name in tips if name in names), None)
        if body is None:
            raise UnknownName("end effector in the original", tips[0], names)
        self._body = self.robot.data.body(body)
        self._home = self._body.xpos.copy(), self._body.xmat.reshape(3, 3).copy()

    def compare(self, solution: Solution) -> tuple[float, float, float]:
        """Gap of the loops where an answer's drives are [m], and how far its pose is from ours [m], [rad]."""
        gap = self._close(lambda: self.robot.put(np.asarray(solution.q)))
        begin, turned_at_home = self._home
        turn = self._body.xmat.reshape(3, 3) @ turned_at_home.T
        point = np.array(solution.mechanism.reference_point) * self.robot.metres
        return gap, *distances(solution, turn @ (point - begin) + self._body.xpos, turn, self.robot.metres)

    def changes_of_import(self, file: OriginalFile, solutions: Sequence[Solution]) -> Floats:
        """Gap of the file's loops [m], and how far poses of the machine that import makes of it are from it [m], [rad].

        The largest at the actuators of some answers of another mechanism that is said to be the same; 0 where import
        does not make a machine with the same actuators and end effector of the file: then nothing is explained by it.
        """
        mechanism, largest = self.robot.mechanism, np.zeros(3)
        joints = {*self.robot.model.dof_jntid[self.robot.unknown].tolist()}
        again = file.imported_as(mechanism, [self.robot.joint_names[joint] for joint in joints])
        if again is None:
            return largest
        other = Original(again, file)
        has_same = again.coordinate_names == mechanism.coordinate_names
        for solution in solutions:
            values = dict(zip(mechanism.actuator_names, np.asarray(solution.actuators).tolist(), strict=True))
            answer = solve_fk(again, values, start=solution.q if has_same else None)
            if answer:
                largest = np.maximum(largest, other.compare(answer))
        return largest

    def _close(self, put: Callable[[], None]) -> float:
        """Put joints, close the loops, and let go of those that stay open and have joints that the mechanism has not.

        A joint that was held when the mechanism was imported is in loops of the mechanism, which close without it; one
        that was left out, for the end effector does not depend on it, is in loops that do not. The gap is left [m].
        """
        put()
        robot = self.robot
        largest = TOLERANCES.file_gap * robot.mechanism.characteristic_length * robot.metres
        while (gap := robot.close()[0]) > largest:
            errors, jacobian, equalities = robot.rows()
            is_doubtful = jacobian[:, robot.unknown].any(axis=1) & (np.abs(errors) > largest)
            if not is_doubtful.any():
                break
            robot.data.eq_active[np.unique(equalities[is_doubtful])] = 0
            put()
        return gap


def _misread(robot: CompiledModel, said: Sequence[SaidJoint]) -> tuple[float, float]:
    """How far joints are from what is said of them, [m] and [rad], at random where a robot's loops are closed."""
    rng, largest = np.random.default_rng(0), np.zeros(2)
    bodies = [robot.data.body(index) for index in range(robot.model.nbody)]
    robot.update()
    size = max(float(np.linalg.norm([body.xpos for body in bodies], axis=1).max()), TOLERANCES.file_gap)
    units = np.where(robot.is_slide[robot.model.dof_jntid], size, 1.0)
    for share in SHARES:
        robot.take(robot.model.qpos0)
        robot.move(share * units * rng.uniform(-1.0, 1.0, robot.model.nv))
        open_by = robot.close_all()
        frames = {body.name: frame_of(body.xpos, body.xmat) for body in bodies}
        values = dict(zip(robot.joint_names, robot.data.qpos[robot.model.jnt_qposadr].tolist(), strict=True))
        for joint in said:
            value = values.get(joint.name) if joint.kind in ("revolute", "prismatic") else None
            error = np.array(joint.error(frames, value)) / [size, 1.0]
            largest = np.maximum(largest, np.where(error > OPEN * open_by, error, 0.0))
    return float(largest[0]) * size, float(largest[1])


def _add_named_loops(plain: ET.Element) -> None:
    """Add a `connect` for every two frames that are called as those that meet, unless an equality names them."""
    frames = {each.get("name", ""): each for each in plain.iter() if each.tag in ("body", "site")}
    named = {name for each in plain.iterfind("equality/*") for name in each.attrib.values()}
    equality = ET.SubElement(plain, "equality")
    for first, second in ((name, f"{name[:-1]}2") for name in frames if CLOSING.fullmatch(name) and name[-1] == "1"):
        if second in frames and not {first, second} & named:
            for name in (first, second):
                if frames[name].tag == "body":
                    ET.SubElement(frames[name], "site", name=name)
            ET.SubElement(equality, "connect", site1=first, site2=second)
