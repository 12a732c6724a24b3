"""Doubts about an identification as a whole: by what is left over, and by what bodies would have to be."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .effort_fit import EffortFit
from .unknowns import Unknowns

FAR = 4.0
"""Noise of efforts, by that which they are taken to have, from which no machine explains them."""

ABSURD = 3.5
"""Change of a body, in what it is expected to be off by, from which it is none that anybody describes so."""

EXPLAINED = 0.9
"""Share of the squares of efforts that a machine explains at least, of a measurement that says much about it."""

ALIKE, CHANCE = 0.2, 4.0
"""Autocorrelation of residuals from which they are no noise, and how much more than that of as many random rows it is,
in deviations of that."""

MULTIPLE, SAME = 1.5, 0.95
"""Factor by which all masses are off together, or its inverse, from which it is rather one of the efforts, and the
share of the squares of what bodies take that it explains."""


def doubt_of(unknowns: Unknowns, fit: EffortFit) -> str:
    """Why the values of a fit may be wrong as a whole, in a sentence with the strongest reason; "" if there is none."""
    found = next(_doubts(unknowns, fit), "")
    return f"{found}: are they in N and N m, with the right signs, and of this motion at its times?" if found else ""


def _doubts(unknowns: Unknowns, fit: EffortFit) -> Iterator[str]:
    bodies, n_bodies = unknowns.scales.bodies, len(unknowns.scales.bodies)
    if fit.missed > FAR:
        yield f"no possible bodies explain these efforts, missed by {fit.missed:.3g} times their noise"
    factor = _multiple(unknowns, fit)
    if n_bodies > 1 and not 1.0 / MULTIPLE < factor < MULTIPLE:
        yield f"all masses together would be {factor:.3g} times those of the file, as of efforts with another gear"
    changes = np.abs(fit.found[: 10 * n_bodies]).reshape(-1, 10).max(axis=1)
    if changes.max(initial=0.0) > ABSURD:
        body, times = bodies[changes.argmax()], f"{changes.max():.3g}"
        yield f"'{body}' would differ from the file by {times} times what is expected of it"
    if fit.explained < EXPLAINED:
        yield f"the identified machine explains {100.0 * max(fit.explained, 0.0):.0f} % of the squares of these efforts"
    worst = int(fit.alike.argmax())
    if fit.alike[worst] > max(ALIKE, CHANCE / np.sqrt(max(fit.n_pairs, 1))):
        name, alike = unknowns.mechanism.actuator_names[worst], fit.alike[worst]
        yield f"what is left of the efforts of {name} is no noise, with {alike:.2f} of it the same from row to row"


def _multiple(unknowns: Unknowns, fit: EffortFit) -> float:
    """The factor by which what bodies take is that of the file; 1 where no factor explains it."""
    n_bodies, described = len(unknowns.scales.bodies), unknowns.to_scaled @ unknowns.described
    before, after = (fit.of_bodies(values, n_bodies).ravel() for values in (described, described + fit.found))
    across, squares, whole = before @ after, before @ before, after @ after
    return float(across / squares) if squares and across**2 > SAME * squares * whole else 1.0
