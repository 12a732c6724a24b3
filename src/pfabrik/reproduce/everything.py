"""All three experiments, and what is written of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from . import efficacy, efficiency, robustness
from .efficacy import Efficacy
from .efficiency import Efficiency
from .robustness import Robustness
from .study import FULL, QUICK, Case, Extent, cases
from .tables import write_csv


@dataclass(frozen=True)
class Findings:
    """The experiments, each one for every machine."""

    extent: Extent
    efficacy: list[Efficacy]
    efficiency: list[Efficiency]
    robustness: list[Robustness]


def run(quick: bool = False, on_progress: Callable[[int, int], None] | None = None) -> Findings:
    """Run everything.

    Parameters
    ----------
    quick : fewer steps, targets and searches.
    on_progress : called with (parts done, parts in all); a search for a nearest pose is a part.
    """
    extent, all_cases = (QUICK if quick else FULL), cases()
    tick = _Tick(expected(extent, all_cases), on_progress)
    return Findings(
        extent=extent,
        efficacy=[efficacy.run(case, extent, tick) for case in all_cases],
        efficiency=[efficiency.run(case, extent, tick) for case in all_cases],
        robustness=[robustness.run(case, extent, tick) for case in all_cases],
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
    return len(all_cases) * (3 + min(extent.searches, extent.steps // 3))


def write(findings: Findings, folder: Path) -> None:
    """Tables, pictures and rows of numbers; times have files of their own, all else is the same in every run."""
    from . import figures
    from .report import report

    write_csv(folder / "efficacy.csv", [row for each in findings.efficacy for row in efficacy.summary(each)])
    write_csv(folder / "efficiency.csv", [row for each in findings.efficiency for row in efficiency.summary(each)])
    write_csv(folder / "efficiency_times.csv", [row for e in findings.efficiency for row in efficiency.time_rows(e)])
    write_csv(folder / "robustness.csv", [robustness.summary(each) for each in findings.robustness])
    write_csv(folder / "jumps.csv", [row for each in findings.robustness for row in robustness.jump_rows(each)])
    for inside in findings.efficacy:
        write_csv(folder / f"efficacy_{inside.case.key}.csv", efficacy.steps(inside))
    for leaving in findings.robustness:
        write_csv(folder / f"robustness_{leaving.case.key}.csv", robustness.steps(leaving))
        write_csv(folder / f"robustness_{leaving.case.key}_times.csv", robustness.step_time_rows(leaving))
    figures.draw_efficacy(findings.efficacy, folder / "efficacy.png")
    figures.draw_efficiency(findings.efficiency, folder / "efficiency.png")
    figures.draw_robustness(findings.robustness, folder / "robustness.png")
    (folder / "report.md").write_text(report(findings), encoding="utf-8")
