"""All three experiments."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from . import efficacy, efficiency, forward, robustness
from .efficacy import Efficacy
from .efficiency import Efficiency
from .forward import Forward
from .robustness import Robustness
from .study import FULL, QUICK, Case, Extent, cases


@dataclass(frozen=True)
class Findings:
    """The experiments, each one for every machine, and forward kinematics by passes, which the paper does not have."""

    extent: Extent
    efficacy: list[Efficacy]
    efficiency: list[Efficiency]
    robustness: list[Robustness]
    forward: list[Forward]


def run(quick: bool = False, on_progress: Callable[[int, int], None] | None = None) -> Findings:
    """Run everything.

    Parameters
    ----------
    quick : fewer steps, targets and searches.
    on_progress : called with (parts done, parts in all); a search for a nearest pose is a part.
    """
    extent, all_cases = (QUICK if quick else FULL), cases()
    tick = _Tick(expected(extent, all_cases), on_progress)
    random = [efficiency.run(case, extent, tick) for case in all_cases]
    return Findings(
        extent=extent,
        efficacy=[efficacy.run(case, extent, tick) for case in all_cases],
        efficiency=random,
        robustness=[robustness.run(case, extent, tick) for case in all_cases],
        forward=[forward.run(each, extent.repeats, tick) for each in random],
    )


class _Tick:
    """Counts parts."""

    def __init__(self, total: int, on_progress: Callable[[int, int], None] | None) -> None:
        self.done, self.total, self.on_progress = 0, total, on_progress

    def __call__(self) -> None:
        self.done += 1
        if self.on_progress is not None:
            self.on_progress(min(self.done, self.total), self.total)


def expected(extent: Extent, all_cases: tuple[Case, ...]) -> int:
    """About how many parts there are; a third of the steps of a circle leave the workspace."""
    return len(all_cases) * (4 + min(extent.searches, extent.steps // 3))
