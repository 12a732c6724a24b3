"""The result of an identification: masses and friction, what efforts determine of them, and what is left over."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints, Mask, as_plain
from ...common.printed import Printed, ResultTable, error_text, plain
from ...machine.description.mechanism import Mechanism
from .effort_doubt import doubt_of
from .effort_fit import EffortFit
from .inertial_fit import combined
from .unknowns import Unknowns

SHOWN = 3
"""Terms of a combination that are printed."""

UNSEEN = 1e-9
"""Share of the largest, in its scale, up to which efforts do not depend on a parameter at all."""


class BaseParameter(NamedTuple):
    """A combination of parameters that the efforts determine.

    Attributes
    ----------
    name : str
        The combination in words: the first parameter, plus the others with their factors.
    factors : dict of str to float
        Parameter -> by which it counts: 1 for the first.
    value, described : float
        Identified, and of the machine as described, in `unit`.
    deviation : float
        Standard deviation.
    unit : str
        Unit of the values.
    """

    name: str
    factors: dict[str, float]
    value: float
    described: float
    deviation: float
    unit: str


class Identification(Printed):
    """Masses of bodies, and friction and rotors of actuators, from efforts; made by `identify`.

    A body has the parameters `body.mass` [kg]; `body.x`, `.y`, `.z`, its mass times where its centre is from the point
    `points["body"]` [kg length]; and `body.Ixx` to `body.Iyz`, its moments of inertia about that point [kg length²],
    along the axes of the base at home. An actuator has `name.dry` and `name.viscous` friction, and `name.rotor`, as in
    the file. Of most bodies efforts determine combinations only: `combinations` has them.

    Attributes
    ----------
    names, units : tuple of str
        Names of the parameters, p, and their units.
    values, described : array (p,)
        Identified values, and those of the machine as described.
    deviations : array (p,)
        Standard deviations; infinite for parameters that the efforts do not determine alone.
    determined : array of bool (p,)
        True for the parameters that they do.
    rank : int
        Number of combinations that the efforts determine, each to a tenth of what it is expected to be off by.
    rms_before, rms : array (n_a,)
        Root mean square of the residuals of each actuator, with the machine as described, and identified [N, N m].
    residuals : array (n, n_a)
        Measured efforts less those of the identified machine [N, N m]; NaN in rows that were left out.
    points : dict of str to array
        Body -> the point that its parameters are about: its centre of mass in the file, else the middle of its joints
        [length].
    adjusted : tuple of str
        Bodies, and parameters of actuators, of which noise would make what none can be, such as a negative moment of
        inertia: the likeliest values that are possible were taken.
    """

    def __init__(self, unknowns: Unknowns, fit: EffortFit) -> None:
        self._unknowns, self._fit = unknowns, fit
        self.names, self.units, self.described = unknowns.names, unknowns.units, unknowns.described
        self.values, self.rank = self.described + unknowns.by_scaled @ fit.found, len(self._combined[0])
        self.rms_before, self.rms, self.residuals = fit.rms_before, fit.rms, fit.residuals
        self.points = dict(zip(unknowns.scales.bodies, unknowns.scales.points, strict=True))
        owners = (*unknowns.scales.bodies, *unknowns.names[10 * len(self.points) :])
        self.adjusted = tuple(owners[place] for place in np.flatnonzero(fit.is_broken))

    @cached_property
    def mechanism(self) -> Mechanism:
        """The machine with the identified values."""
        return self._unknowns.apply(self.values)

    @cached_property
    def deviations(self) -> Floats:
        return self._fit.fit.deviations(self._unknowns.by_scaled, self._fit.deviation)

    @property
    def determined(self) -> Mask:
        return np.isfinite(self.deviations)

    @cached_property
    def _sizes(self) -> Floats:
        """What the parameters are compared by, (p,)."""
        return np.asarray(np.linalg.norm(self._unknowns.by_scaled, axis=1))

    @cached_property
    def _combined(self) -> tuple[Ints, Floats, Floats]:
        directions, spread = self._fit.fit.directions(self._fit.deviation)
        return combined(directions, spread, self._unknowns.to_scaled, self._sizes, self.determined)

    @cached_property
    def combinations(self) -> tuple[BaseParameter, ...]:
        """The base parameters: combinations that the efforts determine, r."""
        found = []
        for place, factors, deviation in zip(*self._combined, strict=True):
            weights = np.abs(factors) * self._sizes
            order = [place, *(k for k in np.argsort(-weights, kind="stable") if weights[k] > 0.0 and k != place)]
            terms = [f"{factors[k]:+.4g} {self.names[k]}" for k in order[1 : SHOWN + 1]]
            terms += [f"and {len(order) - 1 - SHOWN} more"] * (len(order) > SHOWN + 1)
            found.append(
                BaseParameter(
                    " ".join([self.names[place], *terms]),
                    {self.names[k]: float(factors[k]) for k in order},
                    float(factors @ self.values),
                    float(factors @ self.described),
                    float(deviation),
                    self.units[place],
                )
            )
        return tuple(found)

    @cached_property
    def unseen(self) -> tuple[str, ...]:
        """Parameters that no effort of this motion depends on, whatever the noise."""
        seen = self._fit.sensitivity(self._unknowns.to_scaled) * self._sizes
        return tuple(name for name, size in zip(self.names, seen, strict=True) if size <= UNSEEN * seen.max())

    @property
    def doubt(self) -> str:
        """Why these values may be wrong as a whole, in a sentence; "" if nothing says so.

        Efforts that are late, of another motion, of exchanged actuators or of other loads leave residuals that follow
        from row to row, or explain little; of another unit, gear or current they make all masses a multiple.
        """
        return doubt_of(self._unknowns, self._fit)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """What the efforts leave open, in words."""
        shared = [n for n, alone in zip(self.names, self.determined, strict=True) if not alone and n not in self.unseen]
        return (
            *([f"no effort depends on {_listed(self.unseen)}"] if self.unseen else []),
            *([f"determined in combinations only, or too weakly: {_listed(shared)}"] if shared else []),
        )

    def __repr__(self) -> str:
        counts = f"{self.rank} combinations of {len(self.names)} parameters"
        return f"<Identification of '{self._unknowns.mechanism.name}': {counts} determined>"

    def table(self) -> ResultTable:
        """The combinations that are determined, a line each; then the residuals of the actuators, and what is open."""
        rows = [_cells(each) for each in self.combinations]
        names, units = self._unknowns.mechanism.actuator_names, self._unknowns.drives.forces
        left = [
            (name, error_text(before, ".3g", size), error_text(after, ".3g", size), unit)
            for name, before, after, unit, size in zip(
                names, self.rms_before, self.rms, units, self._fit.largest, strict=True
            )
        ]
        residuals = ResultTable("", (), ("actuator", "rms before", "rms", "unit"), left)
        header = ("determined", "described", "identified", "deviation", "unit")
        return ResultTable(
            self._unknowns.mechanism.name,
            (),
            header,
            rows,
            ["\n".join(self._facts)] * bool(self._facts),
            "",
            [residuals],
        )

    @property
    def _facts(self) -> list[str]:
        """What is open, and what was not physical, a sentence each."""
        held = ", ".join(self.adjusted)
        sentence = f"no body or actuator can have the likeliest values of {held}: the likeliest possible were taken"
        return [*([self.doubt] if self.doubt else []), *self.undetermined, *([sentence] if held else [])]

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain numbers, lists and dicts, ready for JSON; the machine aside."""
        columns = (self.names, self.units, *map(as_plain, (self.values, self.described, self.deviations)))
        heads = ("name", "unit", "value", "described", "deviation")
        return {
            "parameters": [dict(zip(heads, row, strict=True)) for row in zip(*columns, strict=True)],
            "combinations": [each._asdict() for each in self.combinations],
            "rank": self.rank,
            "rms_before": as_plain(self.rms_before),
            "rms": as_plain(self.rms),
            "doubt": self.doubt,
            "undetermined": list(self.undetermined),
            "adjusted": list(self.adjusted),
        }


def _cells(each: BaseParameter) -> tuple[str, ...]:
    size = max(abs(each.value), abs(each.described), each.deviation)
    digits = max(2, min(9, 2 + math.ceil(math.log10(size / each.deviation)))) if each.deviation > 0.0 else 9
    numbers = [plain(value, 1e-9 * size, f".{digits}g") for value in (each.described, each.value)]
    return (each.name, *numbers, f"{each.deviation:.2g}", each.unit)


def _listed(names: tuple[str, ...] | list[str]) -> str:
    """Names, those of a body together: a.mass x y."""
    bodies: dict[str, list[str]] = {}
    for name in names:
        body, _, part = name.rpartition(".")
        bodies.setdefault(body, []).append(part)
    return ", ".join(f"{body} ({' '.join(parts)})" for body, parts in bodies.items())
