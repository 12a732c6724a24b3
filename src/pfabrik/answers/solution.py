"""What an answer is: a status, a configuration that is feasible, and what was measured of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from enum import IntEnum
from functools import cached_property
from types import EllipsisType, MappingProxyType
from typing import Any, Literal, NamedTuple, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..closure.configurations import Configurations
from ..closure.projection import ways_of
from ..description.mechanism import Mechanism
from ..engine import engine_of
from ..errors import InvalidArgument
from ..kernels.reaching import plan as P
from ..motion.displacements import columns, home_coordinates
from .limits import ActiveLimit, active_limits, binding_limits, holding_limits

Integers = NDArray[np.int64]

Held: TypeAlias = Literal["orientation", "position"] | None
"""What of its target a projected answer has."""

_AlongAxis: TypeAlias = int | slice | EllipsisType | Sequence[int] | NDArray[np.integer] | NDArray[np.bool_]
Index: TypeAlias = _AlongAxis | tuple[_AlongAxis, ...]
"""What NumPy takes as an index of the axes of a batch."""


NUMBERS = tuple("bdoxXneEfFgG%")
"""Types of format specifications by which a status is written as the number it is."""


class Status(IntEnum):
    """What became of a target; the worst of a batch is the largest.

    REACHED : what was asked for, closed and within every limit.
    PROJECTED : closed and within every limit, near what was asked for.
    EXCEEDED : what was asked for, closed, but beyond a limit; only `assembly_modes` and `working_modes` look for such.
    FAILED : no feasible configuration was found.
    INVALID : what was asked for is no pose, or not finite; only where such rows are to be marked.
    """

    REACHED = P.REACHED
    PROJECTED = P.PROJECTED
    EXCEEDED = P.EXCEEDED
    FAILED = P.FAILED
    INVALID = P.INVALID

    def __str__(self) -> str:
        return self.name

    def __format__(self, spec: str) -> str:
        return format(int(self) if spec[-1:] in NUMBERS else self.name, spec)


class Wanted(NamedTuple):
    """Poses that were asked for, (n, 4, 4), and how the distance from them counts; see `Options`."""

    targets: Floats
    hold: str | None
    rotation_length: float | None


class Solution:
    """The answer to one target or, with leading batch axes on every field, to a batch.

    What a status promises is measured on the configuration, not assumed: `residual` and `limit_excess` are there to
    be read. Where the status is INVALID (a row that was no pose, marked), numbers are NaN.

    Attributes
    ----------
    status : a `Status`; for a batch an integer array of them, (...,).
    pose : T_base_platform achieved, (..., 4, 4) [length].
    actuators : actuated coordinates in the order of `mechanism.actuator_names`, (..., n_a) [length or rad].
    q : all joint coordinates (..., nq) in the order of `mechanism.coordinate_names`, counted as the description counts
        them [rad or length]: one for R and P, two for U and C, three for S, whose rotation vector turns its second body
        against its first, from home. What a configuration leaves open (a rod's spin about itself) is nearest to the
        start, or to home; angles count on along a path.
    joints : joint name -> its part of `q`: (...,) for R and P, (..., 2) for U and C, (..., 3) for S.
    points : joint name -> position of its centre in the base frame, (..., 3) [length].
    position_error, rotation_error : distance of the pose from the target, (...,) [length], [rad]; 0 where actuator
        values were asked for, not a pose.
    actuator_error : largest difference of an actuated coordinate from the asked value, (...,); lengths relative to L,
        angles in rad; 0 where a pose was asked for.
    residual : largest gap of any loop: open ends, stretched rigid links, links out of their plane, (...,) [length].
    limit_excess : largest excess over any limit, (...,); lengths relative to L, angles in rad; 0 if all are kept.
    held : what of the target a projected answer has all the same: "orientation", "position", or None; for a batch an
        array of them, (...,). It is what `Options.hold` asked for, or None where no feasible pose has that.
    iterations, rounds : passes over the chains, and revisions of the target, (...,).
    active_limits : limits that hold a projected answer back, the hardest first, or that another one exceeds; for a
        batch, one tuple a row, in row order. A projected answer may lie on other limits too; were one of those a little
        wider, it would not come nearer. Where a chain is at full stretch there may be none.
    """

    def __init__(
        self, mechanism: Mechanism, found: Configurations, shape: tuple[int, ...], wanted: Wanted | None = None
    ) -> None:
        """Wrap configurations, as many as the batch shape has; `wanted` are the poses asked for, if any were."""
        self.mechanism = mechanism
        self.shape = shape
        self._found = found
        self._wanted = wanted

    def __getstate__(self) -> tuple[Mechanism, Configurations, tuple[int, ...], Wanted | None]:
        """What an answer is made of; all else follows again where it is unpickled."""
        return self.mechanism, self._found, self.shape, self._wanted

    def __setstate__(self, state: tuple[Mechanism, Configurations, tuple[int, ...], Wanted | None]) -> None:
        Solution.__init__(self, *state)

    @property
    def _rows(self) -> P.Rows:
        return self._found.rows

    @property
    def _coordinates(self) -> Floats:
        """All joint coordinates as deviations from home, row by row, (n, columns) [length or rad]."""
        return self._found.coordinates

    def _shaped(self, array: NDArray[Any]) -> Any:
        shaped = array.reshape(self.shape + array.shape[1:])
        return shaped if shaped.ndim else shaped.item()

    @property
    def status(self) -> Status | Integers:
        return Status(int(self._rows.status[0])) if self.shape == () else self._rows.status.reshape(self.shape)

    @property
    def pose(self) -> Floats:
        return cast(Floats, self._shaped(self._rows.poses))

    @property
    def actuators(self) -> Floats:
        return cast(Floats, self._shaped(self._rows.actuators))

    @property
    def position_error(self) -> float | Floats:
        return cast(float | Floats, self._shaped(self._rows.measures[:, P.POSITION_ERROR]))

    @property
    def rotation_error(self) -> float | Floats:
        return cast(float | Floats, self._shaped(self._rows.measures[:, P.ROTATION_ERROR]))

    @property
    def residual(self) -> float | Floats:
        return cast(float | Floats, self._shaped(self._rows.measures[:, P.RESIDUAL]))

    @property
    def limit_excess(self) -> float | Floats:
        return cast(float | Floats, self._shaped(self._rows.measures[:, P.LIMIT_EXCESS]))

    @property
    def iterations(self) -> int | Integers:
        return cast(int | Integers, self._shaped(self._rows.counters[:, P.ITERATIONS]))

    @property
    def rounds(self) -> int | Integers:
        return cast(int | Integers, self._shaped(self._rows.counters[:, P.ROUNDS]))

    @property
    def held(self) -> Held | NDArray[np.object_]:
        names = np.array([None, "orientation", "position"], dtype=object)
        held = names[np.where(self._rows.status == Status.PROJECTED, self._rows.counters[:, P.HELD], P.HOLD_NOTHING)]
        return held[0] if self.shape == () else held.reshape(self.shape)

    @property
    def actuator_error(self) -> float | Floats:
        return cast(float | Floats, self._shaped(self._rows.measures[:, P.ACTUATOR_ERROR]))

    @cached_property
    def q(self) -> Floats:
        return cast(Floats, self._shaped(self._coordinates + home_coordinates(self.mechanism)))

    @cached_property
    def joints(self) -> Mapping[str, Floats]:
        spans = ((name, span) for name, span in columns(self.mechanism).items() if span.stop > span.start)
        single = {name: span.start if span.stop - span.start == 1 else span for name, span in spans}
        return MappingProxyType({name: self.q[..., place][()] for name, place in single.items()})

    @cached_property
    def points(self) -> Mapping[str, Floats]:
        found = engine_of(self.mechanism).points(self._found)
        order = [joint.name for joint in self.mechanism.joints if joint.name in found]
        unknown = (self._rows.status == Status.INVALID)[:, None]
        return MappingProxyType({name: self._shaped(np.where(unknown, np.nan, found[name])) for name in order})

    @cached_property
    def active_limits(self) -> tuple[ActiveLimit, ...] | list[tuple[ActiveLimit, ...]]:
        listed = self._limits
        return listed[0] if self.shape == () else listed

    @cached_property
    def _limits(self) -> list[tuple[ActiveLimit, ...]]:
        """The same as a list of rows, also of a single answer."""
        rows = self._rows
        held: list[tuple[ActiveLimit, ...]] = [()] * len(rows.status)
        away = np.flatnonzero((rows.status != Status.REACHED) & (rows.status != Status.INVALID))
        named = active_limits(self.mechanism, self._coordinates[away])
        for row, found in zip(away, named, strict=True):
            held[row] = found
        projected = np.flatnonzero(rows.status == Status.PROJECTED)
        if self._wanted is not None and len(projected):
            for row, found in zip(projected, self._holding(self._wanted, projected), strict=True):
                held[row] = found
        return held

    @cached_property
    def binding(self) -> NDArray[np.void]:
        """The first of `active_limits` of every row as one array, (...,): empty names where there is none.

        Fields: joint, bound (text), coordinate (int), value, limit [length or rad], multiplier (NaN where none is
        known).
        """
        return binding_limits(self._limits).reshape(self.shape)

    def _holding(self, wanted: Wanted, projected: NDArray[np.intp]) -> list[tuple[ActiveLimit, ...]]:
        """The limits that hold projected rows back from the poses that were asked for."""
        found: dict[int, tuple[ActiveLimit, ...]] = {}
        engine = engine_of(self.mechanism)
        holds, ways = (
            self._rows.counters[projected, P.HELD],
            ways_of(self.mechanism, wanted.hold, wanted.rotation_length),
        )
        for way in ways:
            rows = projected[holds == way.hold]
            if len(rows):
                weights = engine.weighed_limits(self._found.at(rows), wanted.targets[rows], way)
                limits = holding_limits(self.mechanism, self._coordinates[rows], weights)
                found.update(zip(rows.tolist(), limits, strict=True))
        return [found[row] for row in projected.tolist()]

    def __bool__(self) -> bool:
        """Whether the target, or every target of the batch, is REACHED."""
        return bool((self._rows.status == Status.REACHED).all())

    def __len__(self) -> int:
        if self.shape == ():
            raise TypeError("the answer to one target has no length")
        return self.shape[0]

    def __getitem__(self, index: Index) -> Solution:
        """The answer at `index` of the batch axes; NumPy's rules for integers, slices and arrays."""
        if self.shape == ():
            raise TypeError("the answer to one target cannot be indexed")
        chosen = np.arange(len(self._found)).reshape(self.shape)[cast(Any, index)]
        places = np.ravel(chosen)
        wanted = None if self._wanted is None else self._wanted._replace(targets=self._wanted.targets[places])
        return Solution(self.mechanism, self._found.at(places), np.shape(chosen), wanted)

    def __iter__(self) -> Iterator[Solution]:
        return (self[i] for i in range(len(self)))

    def to_dict(self) -> dict[str, Any]:
        """The fields as plain numbers, lists and dicts, ready for JSON; NaN (an INVALID row) becomes None."""
        names = (
            "pose",
            "actuators",
            "q",
            "position_error",
            "rotation_error",
            "residual",
            "actuator_error",
            "limit_excess",
            "iterations",
            "rounds",
        )
        plain: dict[str, Any] = {"status": _plain_status(self.status)}
        plain |= {name: as_plain(getattr(self, name)) for name in names}
        plain["held"] = as_plain(self.held)
        plain["joints"] = {name: as_plain(value) for name, value in self.joints.items()}
        plain["points"] = {name: as_plain(point) for name, point in self.points.items()}
        listed = [[vars(limit) for limit in row] for row in self._limits]
        plain["active_limits"] = listed[0] if self.shape == () else listed
        return plain

    def __repr__(self) -> str:
        found = ", ".join(f"{count} {name}" for name, count in self._counts().items())
        return f"<{type(self).__name__} of '{self.mechanism.name}': {found or 'empty'}>"

    def _repr_html_(self) -> str:
        """Status, errors, actuators and a small drawing, for notebooks; of a batch, how many rows have each status."""
        from .notebook import solution_html

        return solution_html(self, self._counts())

    def _counts(self) -> dict[str, int]:
        """How many rows have each status that occurs."""
        counts = {status.name: int((self._rows.status == status).sum()) for status in Status}
        return {name: count for name, count in counts.items() if count}


def checked_solution(solution: Any) -> Solution:
    """What was passed as an answer; InvalidArgument where it is none."""
    if not isinstance(solution, Solution):
        raise InvalidArgument("solution", type(solution).__name__, "a Solution, as `solve_ik` returns")
    return solution


def _plain_status(status: Any) -> Any:
    return (
        status.name
        if isinstance(status, Status)
        else np.vectorize(lambda s: Status(s).name, otypes=[object])(status).tolist()
    )


def as_plain(value: Any) -> Any:
    """An array as numbers and lists; what is not finite becomes None."""
    array = np.asarray(value)
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        return np.where(np.isfinite(array), array.astype(object), np.array(None)).tolist()
    return array.tolist()
