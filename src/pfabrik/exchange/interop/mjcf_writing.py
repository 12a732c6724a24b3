"""A mechanism as a MuJoCo model that starts closed: a tree of bodies, and equalities where loops are cut."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import ArrayLike

from ...common.arguments import array
from ...common.arrays import Floats
from ...common.whole_files import whole_path
from ...machine.description.joints import DRIVE_FIELDS
from ...machine.description.mechanism import Mechanism, checked_mechanism
from ...machine.files.units import MEASURED, metres_of
from .cuts import CutTree, cut_tree
from .mjcf_bodies import (
    STEP,
    WEIGHTLESS,
    Names,
    Physics,
    as_attributes,
    bodies,
    names_of,
    physics,
    si_unit,
    strut_notes,
)
from .xml_reading import number_text

NOTE = "pfabrik."
"""Prefix of the names of custom elements, which hold what MuJoCo has no word for."""

MADE_UP = "made_up"
"""The custom element with the names of the bodies whose masses are made up: they are not read back."""

WEIGHTLESS_BODIES = "weightless"
"""The custom element with the names of the bodies that weigh nothing: they do again when they are read back."""

CLOSING_TIME = 2.5 * STEP
"""Time constant by which equalities close what opens [s]: MuJoCo asks for two steps at least."""


def to_mjcf(
    mechanism: Mechanism,
    path: str | os.PathLike[str] | None = None,
    *,
    masses: Mapping[str, float] | None = None,
    gravity: ArrayLike = (0.0, 0.0, 0.0),
) -> str:
    """A mechanism as a MuJoCo model, which starts closed, at home, and stays closed.

    Lengths become metres, and every joint counts as it does in the mechanism: `qpos` of a hinge or slide is the
    coordinate [rad or m]. Loops are cut at ball joints, which become `connect`; a loop without one gets a double of a
    body, with a share of its mass, welded to it. Sites are at all joints and at the reference point; actuated joints
    have position servos; there is a keyframe `home`. Shapes of bodies are geoms of group 3 that touch nothing, and
    weigh nothing; a strut is two, of which one goes with each part, where these are as long as it is over all of its
    range. Pairs of `ignore` are `exclude`. Cones, which MuJoCo does not know, are in comments and in custom elements,
    as are base, end effector and task, what drives can do, struts, and the clearance. Of drives, armature (the inertia
    of a rotor by the square of its gear), friction, and the most that they exert are those of the mechanism; where it
    lacks the mass of a body, what it does not say of them is made up, for servos to be stable, and comments say so;
    armature also where a body is a point or weighs nothing.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    path : str or PathLike, optional
        The file to write; None writes none.
    masses : mapping of str to float, optional
        Body -> its mass [kg]. Others are those of the mechanism, or made up, in proportion to it: what the model
        weighs, and so every force in it, means nothing until they are given. What weighs nothing has a thousandth of
        the heaviest, and a point the least inertia that MuJoCo can turn.
    gravity : array (3,), optional
        Gravity [m/s²]; none by default, for with masses made up, its forces would be too.

    Returns
    -------
    str
        The text of the model.

    Raises
    ------
    UnknownName or InvalidArgument
        A mass of no body, or not positive; gravity that is no vector; a unit of length that is not known.
    """
    metres = metres_of(checked_mechanism(mechanism).length_unit)
    pull = array("gravity", gravity, "3", note=" [m/s²]")
    weights = physics(mechanism, metres, masses)
    text = _text(mechanism, metres, weights, pull)
    if path is not None:
        with whole_path(path) as part:
            part.write_text(text, encoding="utf-8")
    return text


def _text(mechanism: Mechanism, metres: float, physics: Physics, gravity: Floats) -> str:
    """The whole model, element by element."""
    tree = cut_tree(mechanism)
    names = names_of(mechanism, tree)
    root = ET.Element("mujoco", model=mechanism.name)
    for comment in _comments(mechanism, physics):
        root.append(ET.Comment(f" {comment} ".replace("--", "- -")))
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    ET.SubElement(
        root, "option", timestep=repr(STEP), integrator="implicitfast", tolerance="1e-12", gravity=number_text(gravity)
    )
    custom = ET.SubElement(root, "custom")
    for name, named in ((MADE_UP, physics.made_up), (WEIGHTLESS_BODIES, physics.weightless)):
        bodies_named = [*named, *(branch.body for branch in tree.branches if branch.double_of in named)]
        if bodies_named:
            ET.SubElement(custom, "text", name=NOTE + name, data=json.dumps(bodies_named))
    for name, text in _notes(mechanism, names, metres):
        ET.SubElement(custom, "text", name=NOTE + name, data=text)
    root.append(bodies(mechanism, tree, names, metres, physics))
    root.append(_equalities(tree, names, physics))
    if mechanism.ignore:
        contact = ET.SubElement(root, "contact")
        for one, other in mechanism.ignore:
            ET.SubElement(contact, "exclude", body1=one, body2=other)
    root.append(_servos(mechanism, metres, physics))
    home = " ".join(repr(float(drive.home) * si_unit(drive, metres)) for drive in mechanism.drives)
    ET.SubElement(ET.SubElement(root, "keyframe"), "key", name="home", ctrl=home)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _comments(mechanism: Mechanism, physics: Physics) -> Iterator[str]:
    """Yield the comments for who reads the file."""
    yield f"'{mechanism.name}', written by pfabrik: lengths in m, where its own file has {mechanism.length_unit}"
    if physics.made_up:
        yield f"masses are made up, in proportion to the machine, of {', '.join(physics.made_up)}"
        yield "armature and damping of passive joints are made up"
        if unbraked := [drive.name for drive in mechanism.drives if drive.said("friction") is None]:
            yield f"damping is made up of {', '.join(unbraked)}"
    unsaid = [drive.name for drive in mechanism.drives if drive.armature is None]
    if unsaid and not physics.is_solid:
        yield f"armature is made up of {', '.join(unsaid)}"
    if physics.weightless:
        yield f"bodies that weigh nothing have {WEIGHTLESS:g} of the heaviest: {', '.join(physics.weightless)}"
    for joint in mechanism.joints:
        if joint.cone is not None:
            half_angle = f"{np.degrees(joint.cone.half_angle):.6g} deg"
            yield f"a limit that MuJoCo does not keep: the cone of {joint.name}, {half_angle} about {joint.cone.axis}"


def _notes(mechanism: Mechanism, names: Names, metres: float) -> Iterator[tuple[str, str]]:
    """Yield names and texts of the custom elements, which `from_mjcf` reads back."""
    yield "base", mechanism.base
    yield "end_effector", mechanism.end_effector
    yield "reference_point", names.reference
    yield "task", " ".join(mechanism.task)
    for key in DRIVE_FIELDS:
        for drive in mechanism.drives:
            said = drive.said(key)
            if said is not None:
                numbers = np.atleast_1d(said) * (si_unit(drive, metres) if key in MEASURED else 1.0)
                yield f"{key}.{drive.name}", number_text(numbers)
    for joint in mechanism.joints:
        if joint.cone is not None:
            cone = joint.cone
            yield f"cone.{joint.name}", f"{number_text(np.array(cone.axis))} {cone.half_angle!r} {cone.fixed_to}"
    if mechanism.clearance is not None:
        yield "clearance", repr(mechanism.clearance * metres)
    yield from strut_notes(mechanism, metres)


def _equalities(tree: CutTree, names: Names, physics: Physics) -> ET.Element:
    """The equalities that keep the loops closed; stiff, for the kinematics are what counts."""
    stiff = {"solref": f"{CLOSING_TIME!r} 1", "solimp": f"0.999 0.9999 {1e-3 * physics.length!r}"}
    equality = ET.Element("equality")
    for joint in tree.cuts:
        kind = "connect" if joint.type == "spherical" else "weld"
        site1, site2 = joint.name, names.ends[joint.name]
        ET.SubElement(equality, kind, {"name": joint.name, "site1": site1, "site2": site2, **stiff})
    for branch in tree.branches:
        if branch.double_of is not None:
            ET.SubElement(equality, "weld", {"body1": branch.double_of, "body2": branch.body, **stiff})
    return equality


def _servos(mechanism: Mechanism, metres: float, physics: Physics) -> ET.Element:
    """A position servo for every actuated coordinate."""
    actuator = ET.Element("actuator")
    for drive in mechanism.drives:
        gains = as_attributes(physics.servo(drive))
        servo = ET.SubElement(actuator, "position", {"name": drive.name, "joint": drive.name, **gains})
        if np.isfinite(drive.limits).all():
            servo.set("ctrlrange", number_text(np.array(drive.limits) * si_unit(drive, metres)))
        if (most := drive.said("max_torque")) is not None:
            servo.set("forcerange", number_text(np.array([-most, most])))
    return actuator
