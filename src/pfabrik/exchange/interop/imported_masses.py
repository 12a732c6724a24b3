"""The masses of an imported mechanism, from the inertial elements of its file."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable

import numpy as np

from ...common.arrays import Floats
from ...machine.description.body_inertias import BodyInertia, joined
from ...machine.description.body_masses import as_matrix, as_moments
from ...machine.description.mechanism import Mass, Mechanism
from ...machine.description.whole_rules import is_impossible
from .notes import Note, note_names
from .short_numbers import shortened

NEGLIGIBLE = 1e-6
"""Share of a machine's mass up to which a body between two hinges that cross is no body of its own: what a file has for
nothing is 1e-9 kg or so, and a cross weighs 1e-4 and more."""


def placed_mass(body: str, mass: float, frame: Floats, inertia: Floats) -> Mass:
    """The mass of a body whose centre, and the axes of whose inertia (3, 3), are a frame (4, 4)."""
    turn = frame[:3, :3]
    return Mass(body, mass, frame[:3, 3], as_moments(turn @ inertia @ turn.T))


def mass_in_unit(mass: Mass, metres: float) -> Mass:
    """A mass with lengths in a unit, from metres."""
    if mass.centre is None or mass.inertia is None:
        return mass
    return Mass(mass.body, mass.mass, np.divide(mass.centre, metres), np.divide(mass.inertia, metres**2))


def heavy_bodies(masses: Iterable[Mass]) -> set[str]:
    """The bodies that weigh more than next to nothing."""
    whole: dict[str, float] = defaultdict(float)
    for each in masses:
        whole[each.body] += each.mass
    return {body for body, mass in whole.items() if mass > NEGLIGIBLE * sum(whole.values())}


def with_masses(mechanism: Mechanism, masses: Iterable[Mass], known: Collection[str], notes: list[Note]) -> Mechanism:
    """With the masses of bodies that were merged as one; 0 for bodies that the file does not know.

    Parameters
    ----------
    known : the bodies of the file: others are between the joints that one of its joints has become.
    """
    parts: dict[str, list[Mass]] = defaultdict(list)
    for mass in masses:
        parts[mass.body].append(mass)
    if not parts:
        return mechanism
    strange, found = [], []
    for body in mechanism.bodies:
        own = [each for each in parts.get(body, []) if each.centre is not None and each.mass > 0.0]
        strange += [body for each in own if is_impossible(each.inertia)]
        solids = [BodyInertia(each.mass, np.array(each.centre), _inertia(each)) for each in own]
        if solids:
            whole = joined(solids)
            centre = shortened(whole.centre, mechanism.characteristic_length)
            moments = np.array(as_moments(whole.inertia))
            found.append(Mass(body, whole.mass, centre, shortened(moments, float(np.abs(moments).max()))))
        elif body != mechanism.base and (body in parts or body not in known):
            found.append(Mass(body, 0.0))
    note_names(notes, "moments of inertia that no body has are left out: its mass is a point, of", strange)
    return mechanism.with_masses(found)


def _inertia(mass: Mass) -> Floats:
    return np.zeros((3, 3)) if mass.inertia is None or is_impossible(mass.inertia) else as_matrix(mass.inertia)
