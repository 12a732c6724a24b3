"""What is written of the experiments: a report, its pictures, and every number in CSV files."""

from __future__ import annotations

from pathlib import Path

from . import efficacy, efficiency, figures, forward, robustness
from .everything import Findings
from .report import report
from .tables import write_csv


def write(findings: Findings, folder: Path) -> None:
    """Tables, pictures and rows of numbers; times have files of their own, all else is the same in every run."""
    write_csv(folder / "efficacy.csv", [row for each in findings.efficacy for row in efficacy.summary(each)])
    write_csv(folder / "efficiency.csv", [row for each in findings.efficiency for row in efficiency.summary(each)])
    write_csv(folder / "efficiency_times.csv", [row for e in findings.efficiency for row in efficiency.time_rows(e)])
    write_csv(folder / "robustness.csv", [row for each in findings.robustness for row in robustness.summary(each)])
    write_csv(folder / "forward.csv", [forward.summary(each) for each in findings.forward])
    write_csv(folder / "forward_times.csv", [forward.time_row(each) for each in findings.forward])
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
