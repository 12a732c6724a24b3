"""What bodies of a MuJoCo model weigh: by their inertial elements, or by their geoms, as MuJoCo computes it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from copy import deepcopy
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from ...machine.description.mechanism import Mass
from .imported_masses import placed_mass
from .mjcf_geoms import SOLIDS, UNBOUNDED, Geom, frame_on, geoms_of
from .mjcf_model import MjcfModel
from .mjcf_plain import IN_BODIES, kept
from .notes import Note, note_names

BOUNDS = ("boundmass", "boundinertia")
"""Settings by which every body weighs at least so much [kg], [kg m²]."""

PRIMITIVES = (*SOLIDS, "ellipsoid")
"""Types of geoms whose mass follows from the model alone, without other files."""


def read_masses(root: ET.Element, model: MjcfModel, notes: list[Note]) -> Iterator[Mass]:
    """Yield the masses of bodies [m]; notes name those whose geoms do not say, for they are meshes.

    Parameters
    ----------
    model : the kinematics of the model, compiled; its bodies are those of the file.
    """
    root = deepcopy(root)
    said = {key: text for each in root.iterfind("compiler") for key, text in each.attrib.items()}
    by_geoms, groups = said.get("inertiafromgeom", "auto"), said.get("inertiagrouprange", "0 5").split()
    given = {body.get("name") for body in root.iter("body") if body.find("inertial") is not None}
    try:
        total = float(said.get("settotalmass", "-1"))
        counted = range(int(groups[0]), int(groups[1]) + 1) if by_geoms != "false" else ()
        heavy = [geom for geom in geoms_of(root, set()) if geom.weighs and int(geom.group) in counted]
        meshes = [geom for geom in heavy if geom.kind not in (*PRIMITIVES, *UNBOUNDED)]
        for geom in meshes:  # which body has them is what counts
            geom.element.attrib = {"type": "sphere", "size": "1"}
        whole = _compiled(root, model, [geom for geom in heavy if geom.kind in PRIMITIVES])
        with_meshes = {*_compiled(root, model, meshes).geom_bodyid.tolist()} if meshes else set()
    except ValueError as error:
        reason = str(error).replace("\n", " ").strip()
        notes.append(Note(f"masses are left out, for MuJoCo does not compile the geoms ({reason})"))
        return
    mass = float(whole.body_mass[1:].sum())
    scale = total / mass if min(total, mass) > 0.0 else 1.0
    by_inertial = {index for index in range(1, whole.nbody) if by_geoms != "true" and model.body(index) in given}
    of_meshes = sorted({*range(1, whole.nbody)} if meshes and total > 0.0 else with_meshes - by_inertial - {0})
    note_names(notes, "masses that follow from meshes are not read, of", map(model.body, of_meshes))
    bounded = {*range(1, whole.nbody)} if any(float(said.get(key, "0")) > 0.0 for key in BOUNDS) else set()
    for index in sorted((by_inertial | bounded | {*whole.geom_bodyid.tolist()}) - {0, *of_meshes}):
        frame = frame_on(model, index, whole.body_ipos[index], whole.body_iquat[index])
        inertia = scale * np.diag(whole.body_inertia[index])
        yield placed_mass(model.body(index), scale * float(whole.body_mass[index]), frame, inertia)


def _compiled(root: ET.Element, model: MjcfModel, geoms: Iterable[Geom]) -> Any:
    """The bodies with some of their geoms, without joints."""
    plain, chosen = ET.Element("mujoco"), {id(geom.element) for geom in geoms}

    def is_kept(each: ET.Element, in_defaults: bool) -> bool:
        if in_defaults:
            return each.tag in ("default", "geom")
        return each.tag in (*IN_BODIES, "inertial") or id(each) in chosen

    for section in root:
        if section.tag in ("compiler", "default", "worldbody"):
            plain.append(kept(section, Counter(), is_kept))
    return model.mujoco.MjModel.from_xml_string(ET.tostring(plain, encoding="unicode"))
