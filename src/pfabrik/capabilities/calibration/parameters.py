"""Parameters: the numbers of a machine that may differ from its drawing, by name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ...common.arguments import array
from ...common.arrays import Floats
from ...common.checks import names_of, require_choice
from ...common.derived import derived
from ...common.rotations import from_rotvec
from ...errors import InvalidArgument, UnknownName
from ...kinematics import VariedGeometry
from ...machine.description.geometry import Geometry, geometry_of, with_geometry
from ...machine.description.mechanism import Joint, Mechanism, checked_mechanism
from .parameter_kinds import KINDS, Candidates, tied
from .shifts import Shift, ShiftedGeometry, with_own_axes

Free: TypeAlias = str | Sequence[str] | None
"""Kinds ("dimensions", "points", "axes", "lengths", "offsets", "frame", "tool", "scale"); names of dimensions, joints,
or single parameters."""

STEP = 1e-5
"""Step of central differences of what follows from a geometry, in a parameter's scale: truncation and rounding both
leave 1e-10."""


class Parameters:
    """Numbers of a machine that may vary, by name; made by `parameters`.

    Attributes
    ----------
    mechanism : Mechanism
        The machine as described.
    names : tuple of str
        Names of the p parameters.
    values : array (p,)
        Values of the machine as described, in `units`.
    units : tuple of str
        The mechanism's unit of length, "rad", or "" for a dimension, which is as its file has it.
    scales : array (p,)
        Changes that would be noticed: L, 1 rad, or of a dimension what moves a joint by L or turns an axis by 1 rad,
        or its size if that is more.
    moves : array (p, 2, 6)
        Derivatives of the instrument's frame and target, a rotation vector and a place each.
    factors : array (p, n_a)
        Derivatives of the factors on the actuators' readings.
    """

    def __init__(self, mechanism: Mechanism, dimensions: Sequence[str], candidates: Candidates, shifts: list[Shift]):
        self.mechanism = mechanism
        self._dimensions, self._shifted = tuple(dimensions), ShiftedGeometry(mechanism, shifts, candidates.rods)
        self.names = (*dimensions, *(shift.name for shift in shifts))
        self.units = (
            *("" for _ in dimensions),
            *("rad" if s.is_angle else "" if s.factors.any() else mechanism.length_unit for s in shifts),
        )
        own = [mechanism.dimensions[name] for name in dimensions]
        self.values = _read_only(np.array([*own, *(shift.value for shift in shifts)]))
        self.scales = _read_only(np.append(self._dimension_scales(), [shift.scale for shift in shifts]))
        n, drives = len(dimensions), [drive.column for drive in mechanism.drives]
        self.moves = np.concatenate([np.zeros((n, 2, 6)), [shift.moves for shift in shifts] or np.zeros((0, 2, 6))])
        factors = [shift.factors[drives] for shift in shifts] or np.zeros((0, len(drives)))
        self.factors = np.concatenate([np.zeros((n, len(drives))), factors])

    def __len__(self) -> int:
        return len(self.names)

    def __repr__(self) -> str:
        shown = ", ".join(self.names[:6]) + (", ..." if len(self) > 6 else "")
        return f"<Parameters of '{self.mechanism.name}': {len(self)}: {shown}>"

    def apply(self, x: ArrayLike) -> Mechanism:
        """The machine with other values of the parameters, (p,), checked as every machine is.

        A machine that only differs by dimensions keeps its file's expressions; others have numbers.

        Raises
        ------
        InvalidMechanism
            No machine has these values; with every fault.
        """
        values = self.checked(x)
        n = len(self._dimensions)
        drawn = self.mechanism
        if n and not np.array_equal(values[:n], self.values[:n]):
            drawn = drawn.with_dimensions(dict(zip(self._dimensions, values[:n].tolist(), strict=True)))
        if np.array_equal(values[n:], self.values[n:]):
            return drawn
        explicit = {
            j
            for j, joint in enumerate(drawn.joints)
            if joint.along is not None and self._shifted.like.joints[j].along is None
        }
        like = with_own_axes(drawn, explicit) if explicit else drawn
        before = geometry_of(like)
        after = self._shifted.at(values[None, n:], Geometry(*(array[None] for array in before)))
        moved = with_geometry(like, Geometry(*(array[0] for array in after)))
        joints = [
            _with_cone(joint, before.axes[j], after.axes[0, j], self._turn(values[n:], j))
            for j, joint in enumerate(moved.joints)
        ]
        return replace(moved, joints=tuple(joints))

    def _turn(self, values: Floats, j: int) -> Floats:
        changes = values - self.values[len(self._dimensions) :]
        return np.asarray(
            sum((c * s.turns[j] for c, s in zip(changes, self._shifted.shifts, strict=True)), np.zeros(3))
        )

    def checked(self, x: ArrayLike) -> Floats:
        """Values of all parameters, (p,)."""
        note = f": {', '.join(self.names[:8])}{', ...' if len(self) > 8 else ''}"
        return array("x", x, f"{len(self)}", "finite values", note)

    @property
    def like(self) -> Mechanism:
        """The machine that geometries are of: some of its joints may be given by axes of their own."""
        return self._shifted.like

    @cached_property
    def unlimited(self) -> Mechanism:
        """The machine without limits: a real machine has reached every configuration that was read."""
        return self.like.without_limits()

    def geometry(self, values: Floats) -> Geometry:
        """The geometry at values (p,), unchecked."""
        return Geometry(*(array[0] for array in self._geometries(values[None])))

    def factors_at(self, values: Floats) -> Floats:
        """Coordinates of actuators by what they read, (n_a,), at values (p,)."""
        return np.asarray(1.0 + (values - self.values) @ self.factors)

    def slopes(self, values: Floats) -> Geometry:
        """Derivatives of the geometry by the parameters at values (p,): every array with the parameters in front."""
        steps, n = STEP * self.scales, len(self._dimensions)
        grid, drawn = np.concatenate([np.diag(steps), -np.diag(steps)]), None
        if n:
            own, changes = self._drawn.at(values[None, :n]), self._drawn.slopes(values[:n])
            drawn = Geometry(*(a + np.tensordot(grid[:, :n], by, 1) for a, by in zip(own, changes, strict=True)))
        both, p = self._shifted.at(values[n:] + grid[:, n:], drawn), len(self)
        return Geometry(*((a[:p] - a[p:]) / (2.0 * steps).reshape(p, *(1,) * (a.ndim - 1)) for a in both))

    def _dimension_scales(self) -> Floats:
        """Changes of the dimensions that move some joint by L or turn an axis by 1 rad; or their own size, if more."""
        n, length = len(self._dimensions), self.mechanism.characteristic_length
        if not n:
            return np.zeros(0)
        points, axes, home, reference_point = self._drawn.slopes(self.values[:n])
        is_angle = np.array([coordinate.kind == "angle" for coordinate in self.mechanism.coordinates])
        moved = [points, length * axes.reshape(n, -1, 3), reference_point[:, None]]
        sizes = [np.linalg.norm(np.nan_to_num(each), axis=2).max(axis=1, initial=0.0) for each in moved]
        effects = np.max([*sizes, np.abs(home * np.where(is_angle, length, 1.0)).max(axis=1, initial=0.0)], axis=0)
        own = np.abs(self.values[:n])
        least = np.divide(length, effects, out=np.zeros(n), where=(effects > 0.0) & np.isfinite(effects))
        scales = np.maximum(own, least)
        return np.where(scales > 0.0, scales, 1.0)

    def _geometries(self, values: Floats) -> Geometry:
        """Geometries at values (b, p), every array with the batch in front."""
        n = len(self._dimensions)
        return self._shifted.at(values[:, n:], self._drawn.at(np.ascontiguousarray(values[:, :n])) if n else None)

    @cached_property
    def _drawn(self) -> VariedGeometry:
        return VariedGeometry(self.mechanism, self._dimensions)


def parameters(mechanism: Mechanism, free: Free = None, *, ties: Literal["copies"] | None = None) -> Parameters:
    """Parameters of a machine that may differ from its drawing.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    free : str or sequence of str, optional
        Kinds, names, or a list of both:

        - "dimensions": the named dimensions of the file that are numbers (`rod = 250`), in the file's units; not
          those that only set limits;
        - "points": centres of joints, "A1.x" [length]; of a hinge two components, as it may slide along its axis;
        - "axes": directions of axes, as turns about base axes, "A1.rx" [rad];
        - "offsets": of the actuators' zeros, "B1.offset", added to a reading [length or rad];
        - "lengths": of rods on actuated joints of the base, "A1.rod" [length];
        - "frame": of the base as an instrument sees it, "frame.x" [length] to "frame.rz" [rad], a rotation vector;
        - "tool": of its target on the platform, "tool.x" to "tool.rz", from the reference point;
        - "scale": factors on the actuators' readings, "B1.scale";
        - the name of a dimension, of a joint (all its points), or of one parameter.

        By default the dimensions, or, of a machine without any, points and offsets.
    ties : str, optional
        "copies" lets joints that are turned copies of each other (A1, A2, A3) vary as one, "A.x": those of copy 1, and
        what the turn makes of it for the others.

    Raises
    ------
    UnknownName or InvalidArgument
        No such parameter, or one that is named twice.
    """
    require_choice("ties", ties, ("copies", None))
    if free is None:
        free = ("dimensions",) if checked_mechanism(mechanism).dimensions else ("points", "offsets")
    chosen = names_of("free", free)
    if not chosen:
        raise InvalidArgument("free", repr(free), f"kinds (dimensions, {', '.join(KINDS)}) or names of parameters")
    return _parameters(checked_mechanism(mechanism), chosen, ties)


def independent_dimensions(mechanism: Mechanism) -> tuple[str, ...]:
    """The dimensions of a machine's file that are numbers."""
    source = mechanism.__dict__.get("_source")
    return () if source is None else tuple(source.independent)


@derived
def _parameters(mechanism: Mechanism, chosen: tuple[str, ...], ties: str | None) -> Parameters:
    independent = independent_dimensions(mechanism)
    candidates = Candidates(mechanism)
    dimensions: list[str] = []
    shifts: list[Shift] = []
    for name in chosen:
        _choose(mechanism, name, independent, candidates, dimensions, shifts)
    if ties == "copies":
        shifts = tied(mechanism, shifts)
    names = [*dimensions, *(shift.name for shift in shifts)]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InvalidArgument("free", f"{', '.join(twice)} twice", "every parameter once")
    if not names:
        raise InvalidArgument("free", "no parameter", "a kind of which the machine has some")
    return Parameters(mechanism, dimensions, candidates, shifts)


def _choose(
    mechanism: Mechanism,
    name: str,
    independent: Sequence[str],
    candidates: Candidates,
    dimensions: list[str],
    shifts: list[Shift],
) -> None:
    """Add the parameters that a name stands for."""
    if name == "dimensions":
        if not independent:
            raise InvalidArgument("free", "dimensions of a machine that has none", f"one of {', '.join(KINDS)}")
        dimensions += _shaping(mechanism, independent, candidates)
    elif name in independent:
        dimensions.append(name)
    elif name in KINDS and name not in {joint.name for joint in mechanism.joints}:
        shifts += candidates.of_kind(name)
    else:
        kind = "lengths" if name.endswith(".rod") else None
        known = [s for k in KINDS if k != "lengths" or kind for s in candidates.of_kind(k)]
        own = [s for s in known if s.name == name or (s.name.partition(".")[0] == name and s.points.any())]
        if not own:
            raise UnknownName("parameter", name, [*independent, *KINDS, *(s.name for s in known)])
        shifts += own


def _shaping(mechanism: Mechanism, names: Sequence[str], candidates: Candidates) -> list[str]:
    """The dimensions that change the geometry: others only set limits, say, which no measurement shows."""
    own = Parameters(mechanism, names, candidates, [])
    changes = own.slopes(own.values)
    parts = [np.abs(np.nan_to_num(array)).reshape(len(names), -1).max(axis=1, initial=0.0) for array in changes]
    return [name for name, part in zip(names, np.max(parts, axis=0), strict=True) if part > 0.0]


def _with_cone(joint: Joint, before: Floats, after: Floats, turn: Floats) -> Joint:
    """A joint whose cone is turned as its axes are."""
    if joint.cone is None or not turn.any() or np.array_equal(before, after):
        return joint
    axis = from_rotvec(turn) @ np.array(joint.cone.axis)
    return replace(joint, cone=replace(joint.cone, axis=tuple(axis.tolist())))


def _read_only(array: Any) -> Floats:
    array.setflags(write=False)
    return np.asarray(array)
