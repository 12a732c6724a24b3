"""Straight tendons of a MuJoCo model between two sites, as legs: cables, and cylinders."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats
from ...common.rotations import square_to
from ...machine.description.joints import Joint
from ...tolerances import TOLERANCES
from .mjcf_model import MjcfModel
from .names import unique
from .notes import Note
from .opened import Loop


class TendonLeg(NamedTuple):
    """A tendon as a leg: a universal joint at its first site, its length, a ball at its second.

    Attributes
    ----------
    joints : the universal joint and the slide, which is called as the tendon.
    end : the ball.
    """

    joints: tuple[Joint, Joint]
    end: Loop

    @property
    def name(self) -> str:
        """That of the tendon."""
        return self.joints[1].name

    @property
    def span(self) -> tuple[str, str]:
        """The two joints whose distance is the tendon's length."""
        return self.joints[0].name, self.end.name

    @property
    def places(self) -> dict[str, Floats]:
        """Its two bodies, and the site that each is at (3,) [m]."""
        cylinder, rod = self.joints[1].connects
        return {cylinder: np.array(self.joints[0].at), rod: self.end.at[0]}


def tendon_legs(model: MjcfModel, taken: Collection[str], notes: list[Note]) -> Iterator[TendonLeg]:
    """Yield the tendons of a model, which are straight, as legs [m].

    Parameters
    ----------
    taken : names of joints, loops and bodies.
    """
    compiled, names = model.model, {*taken}
    for index in range(compiled.ntendon):
        begin = int(compiled.tendon_adr[index])
        sites = [int(site) for site in compiled.wrap_objid[begin : begin + 2]]
        points = np.array([model.data.site_xpos[site] for site in sites])
        bodies = [model.body(int(compiled.site_bodyid[site])) for site in sites]
        name, span = unique(model.tendon(index), names), points[1] - points[0]
        length = float(np.linalg.norm(span))
        if bodies[0] == bodies[1] or length <= TOLERANCES.file_gap:
            notes.append(Note("a tendon on one body, or between sites at one place, is left out", (name,)))
            continue
        near, far, inner, outer = (unique(f"{name}:{part}", names) for part in ("near", "far", "cylinder", "rod"))
        range_ = compiled.tendon_range[index].tolist() if compiled.tendon_limited[index] else None
        driven = compiled.njnt + index in model.targets
        universal = Joint(near, "universal", (bodies[0], inner), points[0], axes=square_to(span))
        slide = Joint(name, "prismatic", (inner, outer), axis=span, actuated=driven, home=length, range=range_)
        model.note_rounding((near, far), sites)
        yield TendonLeg((universal, slide), Loop(far, "spherical", (outer, bodies[1]), points[[1, 1]]))
