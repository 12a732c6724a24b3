"""Singularities of a workspace, and the parts that they separate; singularities along a path."""

from __future__ import annotations

import math
import reprlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast, overload

import numpy as np

from ...answers.differential import forward_jacobian, singularity
from ...answers.solution import Solution
from ...answers.status import Status
from ...answers.tracked import Track
from ...common.arrays import Floats, Ints, as_plain
from ...common.checks import require_positive
from ...common.drawing import Theme, View, drawn
from ...common.printed import Printed, ResultTable, plain
from ...common.telling import OnProgress, telling
from ...errors import InvalidArgument, counted
from ...ik import solve_ik
from ...machine.description.mechanism import Mechanism, checked_mechanism, told_apart
from ...machine.motion.singularities import KINDS, NUMBERS, Singularity, parallel_signs
from ...options import Options
from .lattice_points import Numbering, codes
from .locus import drawn_to_border, locus
from .parts import connected
from .result import Workspace

if TYPE_CHECKING:
    from matplotlib.axes import Axes


POINTS = 20_000
"""Approximate number of points of a map by default."""

NEAR = 0.1
"""Measure below which a point counts as near to a singularity: what one side does there is tenfold at the other [-]."""
MEASURED = ("measure", "least", f"below {NEAR:g}")

SPECK = 6
"""Points up to which a part is a speck, beside a locus that runs along the border: it is not counted in words."""

ROWS_A_BLOCK = 512


@dataclass(frozen=True, eq=False)
class SingularityMap(Printed):
    """Measures of singularity over a workspace, on a lattice of points.

    Attributes
    ----------
    workspace : Workspace
        The workspace that it covers.
    step : array (d,)
        Distance of the points along each coordinate [length or rad].
    points : array (n, d)
        Points within reach [length or rad].
    measures : Singularity
        As in `singularity`, (n,) each.
    signs : array (n,)
        The side of the parallel singularities that each point is on, 1 or -1; NaN where that has no meaning, as with
        more actuators than freedoms.
    parts : array of int (n,)
        The part that each point is in: a motion within the workspace from one part to another passes a parallel
        singularity, or a gap. 0 is the largest.
    locus_vertices : array (v, d)
        Points of the zero set of the signed parallel measure [length or rad].
    locus_faces : array of int (f, d)
        Segments or triangles between them.
    """

    workspace: Workspace
    step: Floats
    points: Floats
    measures: Singularity
    signs: Floats
    parts: Ints
    locus_vertices: Floats
    locus_faces: Ints

    @property
    def sizes(self) -> Floats:
        """The share of the points that each part has, the largest first."""
        return np.bincount(self.parts) / max(len(self.parts), 1)

    def plot(
        self,
        ax: Axes | None = None,
        *,
        view: View | None = None,
        size: tuple[float, float] | None = None,
        theme: Theme = "light",
    ) -> Axes:
        """Draw the parallel measure and the locus of parallel singularities. Needs the extra `plot`.

        Over three coordinates, the locus in space stands beside slices that show the measure and where they cut it. On
        axes that are given, which are two-dimensional, there are no slices.

        Parameters
        ----------
        ax : Axes, optional
            Two-dimensional Matplotlib axes to draw on, without slices. Default: those of a new figure.
        view : str or (float, float), optional
            As in `Workspace.plot`; by default most of the locus is seen.
        size : (float, float), optional
            Width and height of a new figure [inches].
        theme : {"light", "dark"}, optional
            Colours for a light or a dark ground.
        """
        axes: Axes = drawn(self, ax, view, size, theme)
        return axes

    @property
    def _signed(self) -> Floats:
        return signed_of(self.measures, self.signs)

    def table(self) -> ResultTable:
        """The parts between parallel singularities, the least of each measure, and the share of points near to 0."""
        if not len(self.points):
            return ResultTable(self.workspace.mechanism.name, ["nothing within reach"])
        points, names = counted(len(self.points), "point"), " ".join(self.workspace.names)
        lines = [f"{points} over {names}: {self._parts_in_words()}"]
        return ResultTable(self.workspace.mechanism.name, lines, MEASURED, measured_rows(self.measures))

    def to_dict(self) -> dict[str, Any]:
        """Number of points, shares of the parts, and of each measure the least and the share of points near to 0."""
        least_and_near = {kind: least_and_share(getattr(self.measures, kind)) for kind in KINDS}
        return {
            "over": list(self.workspace.names),
            "points": len(self.points),
            "parts": self._sizes_that_count(),
            "least": {kind: as_plain(least) for kind, (least, _) in least_and_near.items()},
            "near": {kind: as_plain(share) for kind, (_, share) in least_and_near.items()},
        }

    def __repr__(self) -> str:
        least = float(np.min(self.measures.parallel, initial=np.inf))
        points = counted(len(self.points), "point")
        return f"<SingularityMap of {points}: {self._parts_in_words()}, least parallel measure {least:.3g}>"

    def _sizes_that_count(self) -> list[float]:
        """The sizes of the parts that are no specks."""
        n_parts = int((np.bincount(self.parts) > SPECK).sum())
        return [float(size) for size in self.sizes[:n_parts]]

    def _parts_in_words(self) -> str:
        if not len(self.locus_faces):
            return "no parallel singularity"
        sizes = self._sizes_that_count()
        shares = ", ".join(f"{size:.1%}" for size in sizes)
        return f"{counted(len(sizes), 'part')} between parallel singularities ({shares})"


@dataclass(frozen=True, eq=False)
class SingularityTrack(Printed):
    """Measures of singularity along a path.

    Attributes
    ----------
    measures : Singularity
        As in `singularity`, (n,) each.
    signs : array (n,)
        As in `SingularityMap`.
    crossings : array of int
        Rows before which the sign changes: the path leads through a parallel singularity on the way to them.
    """

    measures: Singularity
    signs: Floats
    crossings: Ints

    def table(self) -> ResultTable:
        """The rows before which the path leads through a singularity, and the least of each measure."""
        crossings = ", ".join(map(str, self.crossings.tolist())) or "none"
        lines = [f"{counted(len(self.signs), 'row')}, crossings before rows: {crossings}"]
        return ResultTable("Singularities along a path", lines, MEASURED, measured_rows(self.measures))

    def plot(self, ax: Axes | None = None, *, size: tuple[float, float] | None = None, theme: Theme = "light") -> Axes:
        """Draw the measures along the path, crossings marked.

        Parameters
        ----------
        ax : Axes, optional
            Matplotlib axes to draw on. Default: those of a new figure.
        size : (float, float), optional
            Width and height of a new figure [inches].
        theme : {"light", "dark"}, optional
            Colours for a light or a dark ground.
        """
        axes: Axes = drawn(self, ax, size, theme)
        return axes


def least_and_share(measure: float | Floats) -> tuple[float, float]:
    """The least of a measure, and the share of the known values that are near to 0; NaN where none is known."""
    values = np.ravel(measure)
    known = values[~np.isnan(values)]
    return (float(known.min()), float(np.mean(known < NEAR))) if len(known) else (np.nan, np.nan)


def measured_rows(measures: Singularity) -> list[tuple[str, str, str]]:
    """The least of each measure and the share of points near to 0, in words."""
    found = {kind: least_and_share(getattr(measures, kind)) for kind in KINDS}
    return [(kind, plain(least, 0.0, ".3g"), f"{share:.1%}") for kind, (least, share) in found.items()]


@overload
def singularity_map(
    mechanism: Mechanism, over: Workspace, *, resolution: float | None = None, on_progress: OnProgress | None = None
) -> SingularityMap: ...
@overload
def singularity_map(
    mechanism: Mechanism, over: Track, *, resolution: float | None = None, on_progress: OnProgress | None = None
) -> SingularityTrack: ...
def singularity_map(
    mechanism: Mechanism,
    over: Workspace | Track,
    *,
    resolution: float | None = None,
    on_progress: OnProgress | None = None,
) -> SingularityMap | SingularityTrack:
    """Measures of nearness to singularities over a workspace, or along a path, and the loci of singularities.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    over : Workspace or Track
        A workspace, or a slice of one; or a path that was followed.
    resolution : float, optional
        Distance of the points, along lengths [length], or [rad] where all coordinates are angles; default: so that
        there are some 20,000 of them. None for a path.
    on_progress : callable, optional
        As in `workspace`.

    Raises
    ------
    InvalidArgument
        A workspace or path of another mechanism, or one of positions with any orientation or several.
    """
    checked_mechanism(mechanism)
    given: object = over
    if not isinstance(given, Workspace | Track):
        expected = "a Workspace or a Track; over coordinates by their names, `workspace` makes one"
        raise InvalidArgument("over", reprlib.repr(given), expected)
    if over.mechanism != mechanism:
        raise InvalidArgument("over", f"that of {told_apart(over.mechanism, mechanism)}", f"one of '{mechanism.name}'")
    if isinstance(over, Track):
        return _along(over)
    question = over._question
    if question.hold == "position" or len(question.turns) > 1:
        raise InvalidArgument("over", "positions of several orientations", "a workspace with one pose at each point")
    step = _step(over, resolution)
    places = _places(over, step)
    with telling("singularities", on_progress) as tell:
        d, n = len(step), len(places)
        total = n + math.ceil(2 * d * n ** (1.0 - 1.0 / d))  # as many beyond a cube's sides as on them
        reached, measures, signs = _measured(over, places * step + question.space.start, tell, 0, total)
        places = places[reached]
        outer, border = drawn_to_border(over, places, step)
        at_border, measures_there, signs_there = _measured(over, border, tell, n, n + len(border))
    points, signed = places * step + question.space.start, signed_of(measures, signs)
    vertices, faces = locus(
        np.concatenate([places, outer[at_border]]),
        np.concatenate([points, border[at_border]]),
        np.concatenate([signed, signed_of(measures_there, signs_there)]),
    )
    return SingularityMap(
        workspace=over,
        step=step,
        points=points,
        measures=measures,
        signs=signs,
        parts=_parts(places, signed),
        locus_vertices=vertices,
        locus_faces=faces,
    )


def _along(track: Track) -> SingularityTrack:
    measures, signs = _of(track)
    is_feasible = np.asarray(track.status) < Status.FAILED
    signs = np.where(is_feasible, signs, np.nan)
    crossings = np.flatnonzero(signs[1:] * signs[:-1] < 0.0) + 1
    return SingularityTrack(measures, signs, crossings)


def _of(answers: Solution) -> tuple[Singularity, Floats]:
    signs = parallel_signs(answers.mechanism, answers._coordinates, forward_jacobian(answers))
    return singularity(answers), signs


def signed_of(measures: Singularity, signs: Floats) -> Floats:
    """The parallel measure, signed where signs have a meaning."""
    return np.asarray(np.where(np.isnan(signs), 1.0, signs) * np.asarray(measures.parallel))


def signed_at(over: Workspace, points: Floats) -> Floats:
    """The signed parallel measure at points (n, d) of a workspace, (n,); NaN beyond reach."""
    signed, within = np.full(len(points), np.nan), np.flatnonzero(over.contains(points))
    rows, measures, signs = _measured(over, points[within], None)
    signed[within[rows]] = signed_of(measures, signs)
    return signed


def _step(over: Workspace, resolution: float | None) -> Floats:
    """The distance of the points, (d,): a multiple of the resolution of the workspace."""
    d = len(over.names)
    if resolution is None:
        cells = over.size / float(np.prod(over.resolution))
        return np.asarray(over.resolution * max(1.0, (cells / POINTS) ** (1.0 / d)))
    leading = next((axis for axis, unit in enumerate(over.units) if unit != "rad"), 0)  # the first length, if any
    return np.asarray(over.resolution * require_positive("resolution", resolution) / over.resolution[leading])


def _places(over: Workspace, step: Floats) -> Ints:
    """Places on the lattice about the start that are within reach, (n, d)."""
    bounds = (over.bounds - over._question.space.start) / step
    if not np.isfinite(bounds).all():
        return np.zeros((0, len(step)), np.int64)
    axes = [np.arange(np.floor(low), np.ceil(high) + 1).astype(np.int64) for low, high in bounds.T]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    inside = np.asarray(over.contains(places * step + over._question.space.start))
    return np.asarray(places[inside])


def _measured(
    over: Workspace, points: Floats, tell: OnProgress | None, done: int = 0, total: int = 0
) -> tuple[Ints, Singularity, Floats]:
    """Rows of the points that are reached in the question's working mode, and their measures and signs."""
    question, options = over._question, Options(working_mode="keep", on_invalid="mark")
    rows, blocks, signs = [np.zeros(0, np.int64)], [], [np.zeros(0)]
    for begin in range(0, max(len(points), 1), ROWS_A_BLOCK):
        poses = question.space.poses(points[begin : begin + ROWS_A_BLOCK])
        answers = solve_ik(question.mechanism, poses, start=question.start, options=options)
        reached = np.flatnonzero(np.asarray(answers.status) == Status.REACHED)
        measures, sign = _of(answers[reached])
        rows.append(reached + begin)
        blocks.append(measures)
        signs.append(sign)
        if tell is not None:
            tell(done + begin + len(poses), total)
    return np.concatenate(rows), _joined(blocks), np.concatenate(signs)


def _joined(blocks: list[Singularity]) -> Singularity:
    numbers: dict[str, Any] = {
        name: np.concatenate([np.asarray(getattr(block, name)) for block in blocks]) for name in NUMBERS
    }
    return Singularity(
        **numbers, kinds=[kinds for block in blocks for kinds in cast(list[tuple[str, ...]], block.kinds)]
    )


def _parts(places: Ints, signed: Floats) -> Ints:
    """The part of each lattice place, (n,): neighbours of the same sign are in one part."""
    n, d = places.shape
    numbering = Numbering()
    numbering.number(codes(places))
    pairs = [np.zeros((0, 2), np.int64)]
    for offset in np.eye(d, dtype=np.int64):
        neighbours = numbering.find(codes(places + offset))
        joined = np.flatnonzero((neighbours >= 0) & ((signed[neighbours] >= 0.0) == (signed >= 0.0)))
        pairs.append(np.stack([joined, neighbours[joined]], axis=1))
    _, labels, counts = np.unique(connected(n, np.concatenate(pairs)), return_inverse=True, return_counts=True)
    rank = np.empty(len(counts), np.int64)
    rank[np.argsort(-counts, kind="stable")] = np.arange(len(counts))
    return np.asarray(rank[labels])
