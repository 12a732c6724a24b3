"""The contract of engines."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Literal, NamedTuple, Protocol

import numpy as np

from ...common.arrays import Floats, Record, Records
from ...kernels.handle import Handle, Scratch
from ...kernels.legs.records import Table
from ...kernels.pose.search_records import Starts
from ...kernels.rows import Rows
from ...machine.model import Model
from ...machine.motion.singularities import are_opposite, assembly_signs, loop_blocks
from ...options import Options
from .attempts import Attempt
from .close import Closing
from .configurations import Configurations
from .projection import ProjectionMode

if TYPE_CHECKING:
    from ...kernels.pose.evaluate import EvaluationScratch

OnProgress = Callable[[int, int], None]
"""Called with the number of targets solved, and of all."""

Counted = Literal["orientation", "position"]
"""What counts of targets: their orientation too, or the position alone."""

Prepared = tuple[Callable[[], int], object]
"""A call prepared for one row, which returns 0 if it solves that row, and what must be kept alive for it."""


class LegsRead(NamedTuple):
    """Legs that give joint coordinates by closed forms, for kernels.

    Attributes
    ----------
    table, scratch : addresses of the kernel table and of its memory, and what must be kept alive for them.
    sides : of each leg, (legs,).
    columns : of the coordinates that they give.
    """

    table: Handle[Table]
    scratch: Scratch[EvaluationScratch]
    sides: Floats
    columns: frozenset[int]


class InverseEngine(ABC):
    """Solves for the poses of targets.

    Every answer is a feasible configuration: REACHED within the tolerances of the options, or PROJECTED to the nearest
    one found. Rows are INVALID where the target is no pose, and FAILED where no feasible configuration is found.

    Attributes
    ----------
    is_fast : True if a search takes no joint coordinates: blocks of rows are larger then.
    """

    is_fast = False

    @abstractmethod
    def answer(
        self, targets: Floats, start: Configurations | None, options: Options, *, keep_mode: bool
    ) -> Configurations:
        """Solve for targets (n, 4, 4) independently of each other.

        Parameters
        ----------
        start : one start for all targets, or one for each; None for home.
        keep_mode : answers are in the working mode of the start.
        """

    @abstractmethod
    def follow(
        self, targets: Floats, start: Configurations | None, options: Options, on_progress: OnProgress | None
    ) -> Configurations:
        """Solve for a path (n, 4, 4), each target from the answer before it, in its working mode."""

    def attempts(
        self, target: Floats, start: Configurations | None, options: Options, *, keep_mode: bool
    ) -> Iterator[Attempt]:
        """Every attempt to answer one target (1, 4, 4), repeated one by one, in the order in which they are made."""
        return iter(())

    def prepared(self, target: Floats, start: Configurations | None, rows: Rows, *, keep_mode: bool) -> Prepared | None:
        """A call that solves for the pose in `target`, (1, 4, 4), into `rows`; None if the engine has none.

        It answers as `answer` does where it succeeds. Where it does not, it has overwritten `rows`.
        """
        return None


class Grower(Protocol):
    """Grows known configurations from one target to the next."""

    def known(self, start: Configurations | None) -> Starts:
        """Configurations as what others grow from; None for home."""

    def grow(self, known: Starts, targets: Floats, *, anew: bool, keep_mode: bool) -> Configurations:
        """Move known configurations, one or as many, to nearby targets (n, 4, 4); PROJECTED where the nearest is found.

        Parameters
        ----------
        anew : targets may be far, and are searched for from the machine's seeds too, where it has any.
        keep_mode : stay in the working modes of the known configurations.
        """


class Engine(InverseEngine):
    """Solves a mechanism: inverse and forward kinematics, and what results say about configurations."""

    def read_legs(self, start: Configurations | None) -> LegsRead | None:
        """The legs as kernels read joint coordinates from poses, on the sides of one start, or of home.

        None where sides are not those of the start at each pose that `prepared` reaches.
        """
        return None

    @abstractmethod
    def advance(self, targets: Floats, start: Configurations) -> Configurations:
        """Move as many configurations to targets (n, 4, 4) in their working modes; not REACHED where that fails."""

    def grower(self, counted: Counted) -> Grower | None:
        """Grower of known configurations; None where answering targets anew takes no longer."""
        return None

    def rested(self, answers: Configurations, start: Configurations | None) -> Configurations:
        """Answers whose projections have their redundant joints as near to those of the start as their poses let them.

        Parameters
        ----------
        start : one start for all answers, or one for each; None for home.
        """
        return answers

    @abstractmethod
    def forward(
        self, values: Floats, start: Configurations | None, tolerance: float, *, keep_mode: bool = True
    ) -> Configurations:
        """Solve for configurations with actuated values (n, n_a), from one start or one for each.

        With `keep_mode` in the assembly mode of the start, or home's.

        REACHED where the values differ by at most `tolerance` [L or rad]; PROJECTED at the nearest values found.
        """

    def prepared_forward(self, start: Configurations | None, rows: Rows) -> Prepared | None:
        """A call that solves for the configuration with the values in `rows.actuators`; as `prepared`."""
        return None

    @abstractmethod
    def as_configurations(self, closing: Closing) -> Configurations:
        """Configurations that were closed in joint coordinates, with their status still PENDING."""

    @abstractmethod
    def points(self, configurations: Configurations) -> Mapping[str, Floats]:
        """Joint name -> position of its centre in the base frame, (n, 3) [length]."""

    @abstractmethod
    def limit_multipliers(self, configurations: Configurations, targets: Floats, projection: ProjectionMode) -> Floats:
        """Multipliers (n, 2 columns + cones) of all limits at projections of targets (n, 4, 4).

        In the order low and high bound of each coordinate, then the cones: the decrease of the distance [L] per unit
        [L or rad] by which the limit is relaxed; 0 for limits that are not active.
        """


SHARES = 1.0, 0.2, 0.04, 0.008
"""Shares of their speeds that drives have in a tick, one after the other until it passes no dead point of a loop."""


class Driven(ABC):
    """A machine that a stream of targets drives, where it is, and the limits that hold it.

    Attributes
    ----------
    target : array (4, 4), to be written before a tick [length].
    pose, actuators : arrays (4, 4) and (n_a,), where it is [length or rad].
    tick : the record `TICK` of the last tick.
    drives : the records `DRIVE` of its drives, in the order of `actuators`.
    """

    target: Floats
    pose: Floats
    actuators: Floats
    tick: Record
    drives: Records
    _state: tuple[Floats, ...]  # where it is, and the target
    _memory: tuple[Floats | Records, ...]  # of ticks, all 0 where there were none

    def __init__(self, model: Model) -> None:
        self._model = model
        self._has_signs, self._signs = bool(loop_blocks(model.mechanism)), np.zeros(0)

    def go_on(self, dt: float) -> int:
        """One tick of dt seconds; its status. One that would pass a dead point of a loop is not taken."""
        return self._go_on_before_dead_points(dt) if self._has_signs else self._tick(dt)

    def _go_on_before_dead_points(self, dt: float) -> int:
        memory, drives, mechanism = (*self._state, *self._memory, self.drives), self.drives, self._model.mechanism
        before, speeds, rates = [array.copy() for array in memory], drives["speed"].copy(), drives["rate"].copy()
        for share in SHARES:
            drives["speed"] = share * speeds
            status = self._tick(dt)
            drives["speed"] = speeds
            if not are_opposite(assembly_signs(mechanism, self.coordinates()), self._signs).any():
                return status
            for array, saved in zip(memory, before, strict=True):
                array[:] = saved
        drives["rate"] = drives["speed"] = 0.0  # it stops
        status = self._tick(dt)
        drives["speed"] = speeds
        self.tick["exceeded"] = max(float(np.max(np.abs(rates) / (drives["acceleration"] * dt))) - 1.0, 0.0)
        return status

    @abstractmethod
    def _tick(self, dt: float) -> int: ...

    @abstractmethod
    def speeds(self) -> Floats:
        """How fast the drives went in the last tick (n_a,) [length or rad, per s]."""

    def place(self, configurations: Configurations) -> None:
        """Put it where a configuration, one, has it; its drives stay as fast as in the last tick."""
        self._put(configurations)
        if self._has_signs:
            self._signs = assembly_signs(self._model.mechanism, configurations.coordinates)[0]

    @abstractmethod
    def _put(self, configurations: Configurations) -> None: ...

    def rest(self) -> None:
        """Let it rest where it is, with no memory of ticks."""
        self.drives["rate"], self.drives["aim"] = 0.0, np.nan
        for array in self._memory:
            array[:] = 0

    @abstractmethod
    def coordinates(self) -> Floats:
        """All joint coordinates, deviations from home (1, columns) [length or rad]."""

    @abstractmethod
    def multipliers(self) -> dict[tuple[str, str], float]:
        """Multipliers of the limits in the last search of a tick, by joint and bound; `speed` of drives."""
