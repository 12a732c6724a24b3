"""A MuJoCo model as a mechanism: its tree of bodies, and its equalities as the joints that close loops."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from ..arrays import Floats
from ..checks import require_names
from ..description.joints import Joint
from ..errors import UnknownName
from ..extras import require
from .assembling import Imported
from .closing_frames import closing_loops
from .couplings import Coupling
from .cuts import unique
from .digits import Rounding, worst
from .mjcf_digits import ModelDigits
from .mjcf_notes import own_notes
from .mjcf_plain import compiled, plain_model, through_what
from .opened import Loop, LoopType, Note, noting
from .robots import Robot, mechanism_of
from .xml_reading import fault, read_xml

AXES = "xyz"


def from_mjcf(
    source: str | os.PathLike[str],
    *,
    base: str | None = None,
    end_effector: str | None = None,
    actuated: Iterable[str] | None = None,
    fixed: Iterable[str] = (),
    configuration: str = "qpos0",
    length_unit: str = "m",
    task: Sequence[str] | None = None,
) -> Imported:
    """The mechanism in a MuJoCo model.

    Hinges, slides, balls and free joints, several on one body too, become joints between bodies; `connect` becomes a
    ball, two between the same bodies a hinge, `weld` makes two bodies one; sites `closing_<name>_1` and
    `closing_<name>_2` meet in a ball. Coordinates count as `qpos` does. Of a whole robot, what the end effector's
    motion against the base does not depend on is left out. The loops are closed, if
    they are open, by moving passive joints. Base coordinates are those of the world at the configuration.

    Parameters
    ----------
    source : the path of a model, or its text. Files that it includes must be in its folder; no other is opened.
    base : the body that rests. Default: what the file itself says if this library wrote it, else the world.
    end_effector : a body, a site (which is then the reference point), or a joint or equality (whose centre is moved).
        Default: what the file says, else the body at which most joints and equalities meet.
    actuated : names of the joints that are driven, in the order of the actuators. Default: those that an actuator
        drives, in the order of these.
    fixed : names of joints to hold where they are.
    configuration : "qpos0", or the name of a keyframe: home.
    length_unit : the unit of the mechanism: "mm", "m", ...; a model has metres.
    task : what targets set, as of a `Mechanism`. Default: what the file says, else everything or, where the end
        effector has fewer freedoms, as much of it as can be set independently.

    Returns
    -------
    Imported : the mechanism, how far its loops were open, and notes of all that was left out or changed, by name.

    Raises
    ------
    MissingLibrary : MuJoCo is not installed.
    InvalidMechanism : no model, or one that cannot be closed or asks for too much, with what and where; joints that
        follow others where both are there; nothing that is driven. All errors carry the notes so far as `__notes__`.
    UnknownName : a body, joint or keyframe that the model does not have.
    InvalidArgument : no end effector given, and none that is evident.
    """
    require("reading a MuJoCo model", "mujoco", "mujoco")
    root = read_xml(source, "mujoco")
    told: list[Note] = []
    with noting(told):
        model = _Model(plain_model(root, told), configuration)
        own, places = own_notes(root), model.places()
        site = places.get(own.pop("reference_point", ""))
        if site is not None and own.get("end_effector") in places:
            places[own["end_effector"]] = (own["end_effector"], site[1])
        joints, loops = list(model.joints(told)), list(model.loops(told))
        taken = [*(each.name for each in joints), *(each.name for each in loops)]
        named = closing_loops(places, [*loops, *model.resting()], taken, told)
        coarsest = worst(model.roundings.values())
        couplings = tuple(model.couplings(told))
        robot = Robot(
            root.get("model", "mechanism"),
            joints,
            [*loops, *named],
            model.body(0),
            places,
            order=model.driven,
            roundings=model.roundings | {loop.name: coarsest for loop in named},
            couplings=couplings,
            undriven=_undriven(root),
            **own,
        )
        held = [*require_names("fixed", fixed), *model.held(told)]
        return mechanism_of(robot, told, base, end_effector, actuated, held, length_unit, task)


def _undriven(root: ET.Element) -> str:
    """Why no joint of a model is driven, where none is."""
    if root.find("actuator/*") is None:
        return "the model has no actuators"
    through = [child for child in root.iterfind("actuator/*") if not (child.get("joint") or child.get("jointinparent"))]
    if through:
        return f"actuators that drive no joint itself: {', '.join(map(through_what, through))}"
    return "no actuator of a joint"


class _Model:
    """A compiled model in one configuration."""

    def __init__(self, plain: ET.Element, configuration: str) -> None:
        import mujoco

        self._mujoco: Any = mujoco
        try:
            self.model: Any = compiled(ET.tostring(plain, encoding="unicode"))
        except ValueError as error:
            said = str(error).replace("\n", " ").strip()
            raise fault("model", f"what MuJoCo does not compile ({said})", "a model that it does") from None
        self.data: Any = mujoco.MjData(self.model)
        self._configure(configuration)
        self._digits = ModelDigits(plain, self.model)
        self.roundings: dict[str, Rounding] = {}
        self.taken = {self.body(index) for index in range(self.model.nbody)}

    def _configure(self, configuration: str) -> None:
        model, data = self.model, self.data
        if configuration != "qpos0":
            names = [model.key(index).name for index in range(model.nkey)]
            if configuration not in names:
                raise UnknownName("configuration", configuration, ["qpos0", *names])
            data.qpos[:] = model.key_qpos[names.index(configuration)]
        self._mujoco.mj_normalizeQuat(model, data.qpos)
        self._mujoco.mj_kinematics(model, data)

    def body(self, index: int) -> str:
        """Name of a body; a number where it has none."""
        return str(self.model.body(index).name) or f"body_{index}"

    def joint(self, index: int) -> str:
        """Name of a joint; a number where it has none."""
        return str(self.model.joint(index).name) or f"joint_{index}"

    @property
    def driven(self) -> list[str]:
        """Names of the joints that are driven, in the order of the actuators."""
        return [self.joint(int(index)) for index in self.model.actuator_trnid[:, 0]]

    def joints(self, told: list[Note]) -> Iterator[Joint]:
        """Every joint, between its body and the parent's, or the bodies between that several joints on one need."""
        model = self.model
        driven = {int(model.actuator_trnid[index, 0]) for index in range(model.nu)}
        balls = []
        for index in range(1, model.nbody):
            parent, body = self.body(model.body_parentid[index]), self.body(index)
            begin, count = int(model.body_jntadr[index]), int(model.body_jntnum[index])
            if count == 0:
                yield Joint(unique(f"{body}:weld", self.taken), "fixed", (parent, body))
            made = [part for joint in range(begin, begin + count) for part in self._parts(joint, joint in driven)]
            self.roundings |= {self.joint(joint): self._digits.joint(joint) for joint in range(begin, begin + count)}
            for place, part in enumerate(made):
                last = place == len(made) - 1
                outer, parent = parent, body if last else unique(f"{body}:{part['name']}", self.taken)
                yield Joint(connects=(outer, parent), **part)
            balls += [self.joint(j) for j in range(begin, begin + count) if self._is_ball(j) and model.jnt_limited[j]]
        if balls:
            told.append(Note("a ball's range is no limit here: it is left out", tuple(balls)))

    def _is_ball(self, index: int) -> bool:
        kinds = self._mujoco.mjtJoint
        return bool(kinds(int(self.model.jnt_type[index])) == kinds.mjJNT_BALL)

    def _parts(self, index: int, driven: bool) -> Iterator[dict[str, Any]]:
        """What one joint of the model is: one of ours, or of a free joint three slides and a ball."""
        model, data, kinds = self.model, self.data, self._mujoco.mjtJoint
        name, kind = self.joint(index), kinds(int(model.jnt_type[index]))
        at, axis = data.xanchor[index].copy(), data.xaxis[index].copy()
        address = int(model.jnt_qposadr[index])
        if kind == kinds.mjJNT_FREE:
            for letter, direction, home in zip(AXES, np.eye(3), data.qpos[address:], strict=False):
                yield {"name": f"{name}_{letter}", "type": "prismatic", "axis": direction, "home": home}
        if kind in (kinds.mjJNT_FREE, kinds.mjJNT_BALL):
            yield {"name": name, "type": "spherical", "at": at}
            return
        hinge = kind == kinds.mjJNT_HINGE
        part = {"name": name, "type": "revolute" if hinge else "prismatic", "axis": axis, "actuated": driven}
        part |= {"at": at if hinge else None, "home": float(data.qpos[address])}
        yield part | {"range": model.jnt_range[index].tolist() if model.jnt_limited[index] else None}

    def loops(self, told: list[Note]) -> Iterator[Loop]:
        """Every equality that holds: two points, or two frames, that are to meet."""
        resting = tuple(loop.name for loop in self.resting())
        yield from self._equalities(True)
        if resting:
            told.append(Note("an equality that is not active is left out", resting))

    def resting(self) -> Iterator[Loop]:
        """Every equality that would close a loop, but is not active."""
        return self._equalities(False)

    def _equalities(self, active: bool) -> Iterator[Loop]:
        """Every equality of points or frames that is active, or not."""
        model, kinds = self.model, self._mujoco.mjtEq
        taken = {self.joint(index) for index in range(model.njnt)}
        for index in range(model.neq):
            kind = kinds(int(model.eq_type[index]))
            if kind not in (kinds.mjEQ_CONNECT, kinds.mjEQ_WELD):
                continue
            weld = kind == kinds.mjEQ_WELD
            name = unique(str(model.eq(index).name) or f"closure_{index + 1}", taken)
            if bool(model.eq_active0[index]) == active:
                bodies, points, frames = self._sides(index, weld)
                self.roundings[name] = self._rounding(index, weld)
                only_point = not weld or model.eq_data[index, 10] == 0.0
                closed: LoopType = "spherical" if only_point else "fixed"
                yield Loop(name, closed, bodies, points, None if only_point else frames)

    def couplings(self, told: list[Note]) -> Iterator[Coupling]:
        """Every active equality of two joints, as coordinates count."""
        resting = []
        for one, other, factors, active in self._joint_equalities():
            if other >= 0 and active:
                y, x = (float(self.model.qpos0[self.model.jnt_qposadr[joint]]) for joint in (one, other))
                begin = y + factors[0] - factors[1] * x  # factors count from the reference; higher ones stay with it
                yield Coupling(self.joint(one), self.joint(other), (begin, *factors[1:]))
            elif not active:
                resting += [self.joint(joint) for joint in (one, other) if joint >= 0]
        if resting:
            told.append(Note("an equality that is not active is left out, of", tuple(resting)))

    def held(self, told: list[Note]) -> list[str]:
        """Joints that an equality keeps where they are."""
        names = [self.joint(one) for one, other, _, active in self._joint_equalities() if other < 0 and active]
        if names:
            told.append(Note("an equality holds these where they are", tuple(names)))
        return names

    def _joint_equalities(self) -> Iterator[tuple[int, int, tuple[float, ...], bool]]:
        """The two joints of an equality, the second -1 where there is none, its factors, and whether it is active."""
        model = self.model
        for index in np.flatnonzero(model.eq_type == self._mujoco.mjtEq.mjEQ_JOINT):
            factors = tuple(model.eq_data[index, :5].tolist())
            yield int(model.eq_obj1id[index]), int(model.eq_obj2id[index]), factors, bool(model.eq_active0[index])

    def _sides(self, index: int, weld: bool) -> tuple[tuple[str, str], Floats, Floats]:
        """The two bodies of an equality, the point (2, 3) and the frame (2, 3, 3) on each."""
        model, data = self.model, self.data
        one, other = int(model.eq_obj1id[index]), int(model.eq_obj2id[index])
        if model.eq_objtype[index] == self._mujoco.mjtObj.mjOBJ_SITE:
            points, frames = data.site_xpos[[one, other]], data.site_xmat[[one, other]].reshape(2, 3, 3)
            owners = model.site_bodyid[[one, other]]
            return (self.body(owners[0]), self.body(owners[1])), points.copy(), frames.copy()
        own = model.eq_data[index]
        anchors = np.array([own[3:6], own[:3]] if weld else [own[:3], own[3:6]])
        turns = data.xmat[[one, other]].reshape(2, 3, 3).copy()
        points = data.xpos[[one, other]] + np.einsum("bij,bj->bi", turns, anchors)
        if weld:
            relative = np.empty(9)
            self._mujoco.mju_quat2Mat(relative, own[6:10])
            turns[0] = turns[0] @ relative.reshape(3, 3)
        return (self.body(one), self.body(other)), points, turns

    def _rounding(self, index: int, weld: bool) -> Rounding:
        """How exactly the worse side of an equality is placed."""
        model = self.model
        ends = int(model.eq_obj1id[index]), int(model.eq_obj2id[index])
        if model.eq_objtype[index] == self._mujoco.mjtObj.mjOBJ_SITE:
            return worst(self._digits.site(end) for end in ends)
        own = model.eq_data[index]
        anchors = (own[3:6], own[:3]) if weld else (own[:3], own[3:6])
        return worst(self._digits.anchor(end, anchors[side], bool(side)) for side, end in enumerate(ends))

    def places(self) -> dict[str, tuple[str, Floats]]:
        """Bodies and sites, each with its body and its place."""
        model, data = self.model, self.data
        sites = {
            str(model.site(i).name): (self.body(model.site_bodyid[i]), data.site_xpos[i].copy())
            for i in range(model.nsite)
        }
        return sites | {self.body(i): (self.body(i), data.xpos[i].copy()) for i in range(model.nbody)}
