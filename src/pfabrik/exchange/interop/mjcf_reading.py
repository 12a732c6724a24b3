"""A MuJoCo model as a mechanism: its tree of bodies, and its equalities as the joints that close loops."""

from __future__ import annotations

import json
import math
import os
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import ArrayLike

from ...common.checks import require_names
from ...common.extras import require
from ...machine.description.contact import ContactLike
from ...machine.description.form_faults import shown
from ...machine.description.joints import DRIVE_FIELDS, Cone
from ...machine.description.mechanism import Mass
from .assembling import Imported
from .collision import Collision
from .driving import Rates
from .known_elements import require_known
from .known_mjcf import MJCF
from .mjcf_bodies import is_half, read_struts
from .mjcf_geoms import read_collision
from .mjcf_masses import read_masses
from .mjcf_model import MjcfModel, frame_of
from .mjcf_plain import plain_model, straight_tendons, target_of, transmission_text
from .mjcf_tendons import tendon_legs
from .mjcf_writing import MADE_UP, NOTE, WEIGHTLESS_BODIES
from .notes import Note, note_names, noting
from .opened import loops_by_name
from .robot_tree import Robot
from .robots import ImportOptions, mechanism_of
from .standing import posed
from .xml_reading import fault, read_xml


def from_mjcf(
    source: str | os.PathLike[str],
    *,
    base: str | None = None,
    end_effector: str | None = None,
    actuated: Iterable[str] | None = None,
    fixed: Iterable[str] = (),
    configuration: str | ArrayLike | Mapping[str, float] | None = None,
    length_unit: str = "m",
    task: Sequence[str] | None = None,
    within: float | None = None,
    leave_out: Iterable[str] = (),
    feet: Mapping[str, ContactLike] | Sequence[str] | None = None,
) -> Imported:
    """The mechanism in a MuJoCo model.

    Hinges, slides, balls and free joints, several on one body too, become joints between bodies; `connect` becomes a
    ball, two between the same bodies a hinge, `weld` makes two bodies one; sites `closing_<name>_1` and
    `closing_<name>_2` meet in a ball. A straight tendon between two sites that an actuator pulls, or whose length is
    limited, becomes a universal joint, a slide that counts its length, and a ball. Coordinates count as `qpos` does. Of
    a whole robot, what the end effector's motion against the base does not depend on is left out. Loops that are open
    are closed by moving passive joints. Base coordinates are those of the world at the configuration. Geoms that
    collide become shapes of their bodies; what the file lets pass through each other, and what overlaps at home, may
    touch (`ignore`). Masses are those of inertial elements, or of geoms that are no meshes, as MuJoCo has them. Of a
    driven joint, armature, friction, and the most that its actuators exert are read: the smaller side of `forcerange`,
    of `ctrlrange` where control is a force, both by the gear, and of `actuatorfrcrange`.

    Parameters
    ----------
    source : str or PathLike
        The path of a model, or its text. Files that it includes must be in its folder; no other is opened.
    base : str, optional
        The body that rests. Default: the one that the file names if this library wrote it, else the world.
    end_effector : str, optional
        A body, a site (which is then the reference point), or a joint or equality (whose centre is moved). Default: the
        one that the file names; else the error has the choices that there are.
    actuated : iterable of str, optional
        Names of the joints that are driven, in the order of the actuators. Default: those that an actuator drives, in
        the order of these.
    fixed : iterable of str, optional
        Names of joints to hold where they are.
    configuration : str or array (nq,) or mapping of str to float, optional
        Home: "qpos0", the name of a keyframe, MuJoCo's `qpos`, or joint -> its value [rad, m], others as by default.
        Default: "qpos0"; with `feet` the keyframe "home", if there is one.
    length_unit : str, optional
        The unit of the mechanism: "mm", "m", ...; a model has metres.
    task : sequence of str, optional
        What targets set, as in `Mechanism`. Default: that of the file, else everything or, where the end effector has
        fewer freedoms, as much of it as can be set independently.
    within : float, optional
        How far what was meant to be parallel, to meet, or to be equal may be off [m and rad], and is made so. Default:
        as far as the digits of the file explain.
    leave_out : iterable of str, optional
        Names of loops, and of joints that follow others, to read as if they were not bound.
    feet : mapping of str to str or sequence of str, optional
        The robot on its feet, as in `stand`; the end effector is then its trunk.

    Returns
    -------
    Imported
        The mechanism, how far its loops were open, and notes of all that was left out or changed, by name.

    Raises
    ------
    MissingLibrary
        MuJoCo is not installed.
    InvalidMechanism
        No model, or one that cannot be closed or asks for too much, with what and where; joints that follow others
        where both are there; nothing that is driven. All errors carry the notes so far as `__notes__`.
    UnknownName
        A body, joint or keyframe that the model does not have.
    NoEndEffector
        No end effector is given; an `InvalidArgument` that carries the `choices`: what loops move, by which drives.
    """
    require("reading a MuJoCo model", "mujoco", "mujoco")
    root = read_xml(source, "mjcf")
    notes: list[Note] = []
    with noting(notes):
        plain = plain_model(root, notes)
        parts = [each.get("name", "") for each in root.iter() if each.tag in ("body", "joint", "freejoint")]
        require_known(root, MJCF, "mujoco", notes, {*filter(None, parts), "world"})
        values = configuration if isinstance(configuration, Mapping) else {}
        keys = [key.get("name") for key in root.iterfind("keyframe/key")]
        home = "home" if feet is not None and "home" in keys else "qpos0"
        named = home if configuration is None or isinstance(configuration, Mapping) else configuration
        model = MjcfModel(plain, named)
        robot = posed(_robot(root, model, notes), values)
        held = [*require_names("fixed", fixed), *model.held(notes)]
        drives = None if actuated is None else require_names("actuated", actuated)
        asked = ImportOptions(drives, length_unit, task, within, feet)
        return mechanism_of(robot, base, end_effector, asked, notes, held, leave_out)


def _robot(root: ET.Element, model: MjcfModel, notes: list[Note]) -> Robot:
    """The model as a robot, with its loops."""
    data, places = _own_notes(root), model.places()
    written: dict[str, Any] = _written_by_us(data) if data else {"rates": model.rates(notes)}
    site = places.get(written.pop("reference_point", ""))
    if site is not None and written.get("end_effector") in places:
        places[written["end_effector"]] = (written["end_effector"], site[1])
    joints, loops = list(model.joints(notes)), list(model.loops(notes))
    names = [*(part for joint in joints for part in (joint.name, *joint.connects)), *(loop.name for loop in loops)]
    legs = list(tendon_legs(model, names, notes))
    places |= {body: (body, frame_of(point, np.eye(3))) for leg in legs for body, point in leg.places.items()}
    joints, loops = [*joints, *(part for leg in legs for part in leg.joints)], [*loops, *(leg.end for leg in legs)]
    note_names(notes, "straight tendons are legs of a universal joint, a slide and a ball", (leg.name for leg in legs))
    taken = [*(joint.name for joint in joints), *(loop.name for loop in loops)]
    named = loops_by_name(places, [*loops, *model.inactive_loops()], taken, notes)
    return Robot(
        root.get("model", "mechanism"),
        joints,
        [*loops, *named],
        model.body(0),
        places,
        order=model.driven,
        roundings=model.roundings,
        couplings=tuple(model.couplings(notes)),
        undriven=_undriven(root),
        unread=", ".join(map(transmission_text, _unread(root))),
        spans={leg.name: leg.span for leg in legs},
        collision=_collision(root, model, data, notes),
        **written,
    )


def _collision(root: ET.Element, model: MjcfModel, data: dict[str, str], notes: list[Note]) -> Collision:
    """The collision geometry of a model, with the struts and the clearance of one that `to_mjcf` wrote."""
    collision = read_collision(root, model, bool(data), notes)
    struts = dict(read_struts(data))
    solids = [each for each in collision.solids if not is_half(each.name, struts)]
    clearance, masses = _clearance(data.get("clearance")), read_masses(root, model, notes)
    return replace(collision, solids=(*solids, *struts.values()), clearance=clearance, masses=_weighed(masses, data))


def _weighed(masses: Iterable[Mass], data: dict[str, str]) -> tuple[Mass, ...]:
    """The masses but those that `to_mjcf` made up; 0 of bodies that weigh nothing but in MuJoCo."""
    made_up, weightless = (_names_in(data, key) for key in (MADE_UP, WEIGHTLESS_BODIES))
    kept = (each for each in masses if each.body not in made_up)
    return tuple(Mass(each.body, 0.0) if each.body in weightless else each for each in kept)


def _names_in(data: dict[str, str], key: str) -> tuple[str, ...]:
    """The names of bodies in a custom element."""
    text = data.get(key, "[]")
    try:
        return tuple(require_names(key, json.loads(text)))
    except ValueError:
        raise fault(f"custom text '{key}'", shown(text), '["body", ...]') from None


def _clearance(text: str | None) -> float | None:
    """The clearance that a note tells of [m]."""
    try:
        clearance = None if text is None else float(text)
    except ValueError:
        clearance = math.nan
    if clearance is not None and not 0.0 <= clearance < math.inf:
        raise fault("custom text 'clearance'", shown(text), "a length in metres, 0 or more")
    return clearance


def _undriven(root: ET.Element) -> str:
    """Why no joint of a model is driven, where none is."""
    actuators = root.findall("actuator/*")
    if not actuators:
        return "the model has no actuators"
    if unread := _unread(root):
        return f"actuators of what is not read: {', '.join(map(transmission_text, unread))}"
    return "no actuator of a joint"


def _unread(root: ET.Element) -> list[ET.Element]:
    """The actuators of neither a joint nor a straight tendon."""
    straight = {each.get("name", "") for each in straight_tendons(root)}
    return [each for each in root.iterfind("actuator/*") if not target_of(each, straight)]


def _own_notes(root: ET.Element) -> dict[str, str]:
    """The custom elements that `to_mjcf` wrote, by their names without the prefix; empty where it did not."""
    texts = {text.get("name", ""): text.get("data", "") for text in root.iterfind("custom/text")}
    return {name.removeprefix(NOTE): text for name, text in texts.items() if name.startswith(NOTE)}


def _written_by_us(data: dict[str, str]) -> dict[str, Any]:
    """The fields of a robot that `to_mjcf` wrote into custom elements, and its reference point."""
    fields: dict[str, Any] = {key: data[key] for key in ("base", "end_effector", "reference_point") if key in data}
    if "task" in data:
        fields["task"] = tuple(data["task"].split())
    fields["cones"] = {name: _cone(text) for name, text in _with_prefix(data, "cone.").items()}
    rates: dict[str, dict[str, Any]] = defaultdict(dict)
    for field in DRIVE_FIELDS:
        for name, text in _with_prefix(data, f"{field}.").items():
            numbers = tuple(map(float, text.split()))
            rates[name][field] = numbers if field == "friction" else numbers[0]
    fields["rates"] = {name: Rates(**said) for name, said in rates.items()}
    return fields


def _with_prefix(data: dict[str, str], prefix: str) -> dict[str, str]:
    return {name.removeprefix(prefix): text for name, text in data.items() if name.startswith(prefix)}


def _cone(text: str) -> Cone:
    *numbers, body = text.split(maxsplit=4)
    return Cone(list(map(float, numbers[:3])), float(numbers[3]), body)
