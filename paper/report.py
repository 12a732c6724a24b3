"""The findings in words and tables: next to what the paper printed, and with what must hold."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pfabrik.errors import InvalidArgument

from .arrays import Floats
from .checking import Feasibility
from .efficacy import Efficacy, is_point
from .efficiency import Efficiency
from .everything import Findings
from .robustness import Jump, Robustness
from .tables import markdown, number, tiny
from .timing import machine

Cells = dict[str, tuple[str, str]]
"""What the paper printed and what we found, by the name of the row."""

EXACT = 1e-8
"""RMSE that the default tolerance must keep [length of the machine, and deg]."""

SAME_ORDER = 10.0
"""How many times the paper's RMSE ours may be with the paper's E."""

SMOOTH = 3.0
"""How many times the largest step of an actuator inside the workspace one outside may be."""

NEAREST = 1e-5
"""How much less than 1 a ratio to the nearest feasible distance may be: what the search for it is exact to."""

FARTHER = 1e-2
"""How much farther than the nearest pose that the optimiser finds an exact projection may be, relatively."""

BEGIN, END = "<!-- reproduce: begin -->", "<!-- reproduce: end -->"


@dataclass(frozen=True)
class Promise:
    """What must hold, what was measured, and whether it holds."""

    text: str
    measured: str
    holds: bool


def report(findings: Findings) -> str:
    """The whole report, as Markdown."""
    parts = [
        "# The paper's experiments, run again",
        "Written by `python -m paper`. *Paper*: as printed in P-FABRIK; it does not print the dimensions of its "
        "machines, ours have others. *Paper's E*: `passes.Options.paper()`, the passes of P-FABRIK alone with "
        "E = 0.01 mm. "
        "*Accelerated*: `passes.Options.accelerated()`, passes with exact meetings and half-spaces, which are not the "
        "paper's, to 1e-9 L. *Default*: `Options()`, which for legs that have closed forms takes these and makes no "
        "passes.",
        "## What must hold",
        markdown(("promise", "measured", "holds"), [(p.text, p.measured, yes(p.holds)) for p in promises(findings)]),
        "## Next to what the paper printed",
        summary(findings),
        "Passes are averages over the targets that are reached. A warm start is the answer to the target before; the "
        "targets are in an order in which each is the nearest one left. Times are medians on one core. *A pass*: "
        "forward and backward, of all chains: by how much longer a batch takes that makes a hundred, over a hundred. "
        "*Single*: the passes that a target takes, without what a call sets up, next to the geometric approach for a "
        "target alone, in a compiled loop. *Of a batch*: the share of one call, which also works out joint coordinates "
        "and measures loops and limits; with the paper's E this takes longer than the passes. *One call*: by "
        "default of a prepared `Solver`.",
        "Out of reach: the distance from the target over that of the nearest feasible pose of the same orientation, "
        "which the exact projection (the default) finds, or a general optimiser, whichever comes nearer.",
        "The CSV files have every number: jumps of the actuators, those with twice as many steps too, and all times.",
        "![errors](efficacy.png)",
        "![cost](efficiency.png)",
        "![paths](robustness.png)",
        "## Limits and loops, everywhere",
        "The worst over all steps: `limit_excess` of the answers, `closure_residual` by the closure engine (over L), "
        "and limits and loops by closed forms in NumPy that share no code with either.",
        feasibility_table(findings),
    ]
    return "\n\n".join(parts) + "\n"


def yes(holds: bool) -> str:
    return "yes" if holds else "**no**"


def promises(findings: Findings) -> list[Promise]:
    """Everything that must hold."""
    return [
        exact_by_default(findings.efficacy),
        accurate_with_the_papers_e(findings.efficacy),
        all_feasible(findings),
        all_reached(findings.efficiency, "default", "by default"),
        all_reached(findings.efficiency, "accelerated", "by accelerated passes"),
        continuous_outside(findings.robustness),
        never_nearer_than_the_nearest(findings.robustness),
        exact_where_asked(findings.robustness),
    ]


def exact_by_default(found: Sequence[Efficacy]) -> Promise:
    worst = max(max(each.runs["default"].position_rmse, each.runs["default"].orientation_rmse) for each in found)
    text = f"by default, RMSE of the round trip at most {EXACT:.0e} mm and {EXACT:.0e} deg"
    return Promise(text, f"{worst:.1e} at most", worst <= EXACT)


def accurate_with_the_papers_e(found: Sequence[Efficacy]) -> Promise:
    pairs = [(each.runs["paper"].position_rmse, each.case.printed.position_rmse) for each in found]
    pairs += [(e.runs["paper"].orientation_rmse, e.case.printed.orientation_rmse or np.inf) for e in found]
    worst = max(ours / theirs for ours, theirs in pairs)
    text = f"with the paper's E, RMSE at most {SAME_ORDER:g} times the paper's"
    return Promise(text, f"{worst:.2g} times at most", worst <= SAME_ORDER)


def all_feasible(findings: Findings) -> Promise:
    found = [each for _, each in feasibilities(findings)]
    excess = max(max(each.limit_excess, each.independent) for each in found)
    closure, failed = max(each.closure for each in found), sum(each.failed for each in found)
    text = "every answer of every experiment keeps all limits and closes all loops to 1e-9"
    measured = f"excess {excess:.0e}, gap {closure:.0e} L, {failed} failed"
    return Promise(text, measured, all(each.holds for each in found))


def all_reached(found: Sequence[Efficiency], options: str, how: str) -> Promise:
    answers = [each.answers[options, start] for each in found for start in ("cold", "warm")]
    reached, count = sum(each.reached for each in answers), sum(len(each.solution) for each in answers)
    return Promise(f"{how}, every random target is reached", f"{reached} of {count}", reached == count)


def continuous_outside(found: Sequence[Robustness]) -> Promise:
    worst = max(jump_ratio(parts) for each in found for parts in each.jumps.values())
    text = f"outside, no step of an actuator is more than {SMOOTH:g} times the largest inside"
    return Promise(text, f"{worst:.2f} times at most", worst <= SMOOTH)


def never_nearer_than_the_nearest(found: Sequence[Robustness]) -> Promise:
    least = min(float(each.ratios.min()) for each in found)
    text = "no projection of the paper's is nearer to its target than the nearest feasible pose"
    return Promise(text, f"ratio {least:.6f} at least", least >= 1.0 - NEAREST)


def exact_where_asked(found: Sequence[Robustness]) -> Promise:
    worst = max(float(each.exact_ratios.max()) for each in found)
    text = f"by default, no projection is farther than the optimiser's nearest pose by more than {100 * FARTHER:g} %"
    return Promise(text, f"ratio {worst:.7f} at most", worst <= 1.0 + FARTHER)


def jump_ratio(parts: dict[str, Jump]) -> float:
    """Largest step outside, and across the edge, over the largest inside."""
    return max(parts["outside"].size, parts["edge"].size) / parts["inside"].size


def feasibilities(findings: Findings) -> Iterator[tuple[str, Feasibility]]:
    """What was measured of every experiment, with its name."""
    for inside in findings.efficacy:
        for name, run in inside.runs.items():
            yield f"{inside.case.label}, circle inside, {name} options", run.feasibility
    for random in findings.efficiency:
        for (name, start), answered in random.answers.items():
            yield f"{random.case.label}, random targets, {name} options, {start}", answered.feasibility
    for leaving in findings.robustness:
        yield f"{leaving.case.label}, circle that leaves", leaving.feasibility
        yield f"{leaving.case.label}, circle that leaves, projected exactly", leaving.exact_feasibility
        yield f"{leaving.case.label}, circle that leaves, by half-spaces", leaving.accelerated_feasibility


def feasibility_table(findings: Findings) -> str:
    rows = [
        (name, tiny(each.limit_excess), tiny(each.closure), tiny(each.independent), str(each.failed))
        for name, each in feasibilities(findings)
    ]
    return markdown(("", "limit excess", "closure", "independent", "failed"), rows)


def summary(findings: Findings) -> str:
    """The table of the documentation: the paper's numbers next to ours, for each machine."""
    groups = zip(findings.efficacy, findings.efficiency, findings.robustness, strict=True)
    columns = [{**accuracy(inside), **cost(random), **out_of_reach(leaving)} for inside, random, leaving in groups]
    header = ["", *[f"{each.case.label}, {who}" for each in findings.efficacy for who in ("paper", "ours")]]
    rows = [[name, *[cell for column in columns for cell in column[name]]] for name in columns[0]]
    extent = findings.extent
    measured = f"{extent.targets} random targets and {extent.steps} steps a circle; {machine()}."
    return f"{markdown(header, rows)}\n\n{measured}"


def accuracy(found: Efficacy) -> Cells:
    printed, point = found.case.printed, is_point(found.case)
    ours = {
        name: (number(run.position_rmse, 2), "–" if point else number(run.orientation_rmse, 2))
        for name, run in found.runs.items()
    }
    return {
        "position RMSE, paper's E [mm]": (number(printed.position_rmse, 2), ours["paper"][0]),
        "position RMSE, accelerated [mm]": ("–", ours["accelerated"][0]),
        "position RMSE, default [mm]": ("–", ours["default"][0]),
        "orientation RMSE, paper's E [deg]": (number(printed.orientation_rmse, 2), ours["paper"][1]),
        "orientation RMSE, accelerated [deg]": ("–", ours["accelerated"][1]),
        "orientation RMSE, default [deg]": ("–", ours["default"][1]),
    }


def cost(found: Efficiency) -> Cells:
    printed = found.case.printed

    def both(name: str) -> str:
        return " / ".join(f"{found.answers[name, start].iterations:.3g}" for start in ("cold", "warm"))

    def reached(name: str) -> str:
        answered = found.answers[name, "cold"]
        return f"{100 * answered.reached / len(answered.solution):.4g} %"

    def batch(name: str) -> str:
        return " / ".join(number(1e6 * found.times[name, start, "batch"], 2) for start in ("cold", "warm"))

    passes, default = (
        " / ".join(number(ratio(start), 2) for start in ("cold", "warm"))
        for ratio in (found.ratio_of_passes, found.ratio)
    )
    return {
        "random targets reached, paper's E": ("–", reached("paper")),
        "random targets reached, accelerated": ("–", reached("accelerated")),
        "random targets reached, default": ("–", reached("default")),
        "passes, paper's E, cold / warm start": (number(printed.iterations), both("paper")),
        "passes, accelerated, cold / warm start": ("–", both("accelerated")),
        "a pass, paper's [µs]": (number(1e3 * printed.time / printed.iterations, 2), number(1e6 * found.pass_time, 2)),
        "passes ÷ geometric approach, single, cold / warm start": (number(printed.ratio, 2), passes),
        "a target of a batch, paper's E, cold / warm start [µs]": ("–", batch("paper")),
        "a target of a batch, accelerated, cold / warm start [µs]": ("–", batch("accelerated")),
        "a target of a batch, default, cold / warm start [µs]": ("–", batch("default")),
        "default ÷ geometric approach, batch, cold / warm start": ("–", default),
        "one call from Python, default [µs]": ("–", number(1e6 * found.times["default", "cold", "call"], 2)),
    }


def out_of_reach(found: Robustness) -> Cells:
    paper, exact, accelerated = map(spread, (found.ratios, found.exact_ratios, found.accelerated_ratios))
    return {
        "out of reach, paper's projection: distance ÷ nearest feasible, median / 95 % / worst": ("–", paper),
        "out of reach, accelerated: distance ÷ nearest feasible, median / 95 % / worst": ("–", accelerated),
        "out of reach, exact projection: distance ÷ an optimiser's, median / 95 % / worst": ("–", exact),
        "out of reach: largest limit excess": ("–", tiny(found.feasibility.limit_excess)),
        "out of reach: largest loop gap ÷ L": ("–", tiny(found.feasibility.closure)),
        "out of reach: largest actuator step ÷ largest inside": (
            "–",
            f"{max(jump_ratio(parts) for parts in found.jumps.values()):.2f}",
        ),
    }


def spread(ratios: Floats) -> str:
    """Median, 95 % and worst."""
    return " / ".join(f"{ratio:.3f}" for ratio in np.quantile(ratios, (0.5, 0.95, 1.0)))


def put_into(path: Path, text: str) -> None:
    """Replace what stands between the two marks of a file, and nothing else.

    Raises
    ------
    InvalidArgument : the file does not have both marks, once each and in order.
    """
    before, begin, rest = path.read_text(encoding="utf-8").partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end) or BEGIN in rest or END in after:
        raise InvalidArgument("page", f"{path} without them", f"one line '{BEGIN}', then one line '{END}'")
    path.write_text(f"{before}{BEGIN}\n{text}\n{END}{after}", encoding="utf-8")
