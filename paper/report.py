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
from .forward import MOST, Forward
from .geometric import IS_COMPILED
from .robustness import LEAP, Robustness
from .tables import markdown, number, tiny
from .timing import machine

Cells = dict[str, tuple[str, str]]
"""What the paper printed and what we found, by the name of the row."""

EXACT = 1e-8
"""RMSE that the default tolerance must keep [length of the machine, and deg]."""

SAME_ORDER = 10.0
"""How many times the paper's RMSE ours may be with the paper's E."""

NEAREST = 1e-5
"""How much less than 1 a ratio to the nearest feasible distance may be: what the search for it is exact to."""

FARTHER = 1e-2
"""How much farther than the nearest pose that the optimiser finds an exact projection may be, relatively."""

ASSEMBLES = 0.99
"""Share of values at which forward kinematics by passes ends, within limits; passes stall near singular poses."""

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
        "machines, ours have others. *The paper's passes*: `passes.Options.paper()`, its text, with E = 0.01 mm. "
        "*Extended*: `passes.Options.extended()`, these with two rules and a clamp that are ours. "
        "*Accelerated*: `passes.Options.accelerated()`, passes with exact meetings and half-spaces, which are not the "
        "paper's, to 1e-9 L. *Default*: `Options()`, which for legs that have closed forms takes these and makes no "
        "passes. *Centroid*: `passes.Options.centroid()`, the default within reach, beyond it the paper's projection "
        "by least-squares fits in place of passes. "
        f"{fallbacks(findings)}"
        + ("" if IS_COMPILED else " Closed forms were not compiled here, so nothing is timed by them."),
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
        "## Circles that leave the workspace",
        beyond_table(findings),
        BEYOND,
        "## Forward kinematics by passes",
        forward_table(findings),
        FORWARD,
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
        assembled_by_passes(findings.forward),
    ]


def exact_by_default(found: Sequence[Efficacy]) -> Promise:
    worst = max(max(each.runs["default"].position_rmse, each.runs["default"].orientation_rmse) for each in found)
    text = f"by default, RMSE of the round trip at most {EXACT:.0e} mm and {EXACT:.0e} deg"
    return Promise(text, f"{worst:.1e} at most", worst <= EXACT)


def accurate_with_the_papers_e(found: Sequence[Efficacy]) -> Promise:
    pairs = [(each.runs["paper"].position_rmse, each.case.printed.position_rmse) for each in found]
    pairs += [(e.runs["paper"].orientation_rmse, e.case.printed.orientation_rmse or np.inf) for e in found]
    worst = max(ours / theirs for ours, theirs in pairs)
    text = f"by the paper's passes, RMSE at most {SAME_ORDER:g} times what it printed"
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


SMOOTH = ("default", "accelerated", "centroid")
"""Options by which no actuator leaps; plain passes promise nothing of the kind."""


def continuous_outside(found: Sequence[Robustness]) -> Promise:
    worst = max(each.runs[name].jump_ratio for each in found for name in SMOOTH)
    text = (
        f"by default, accelerated passes and the centroid, no step outside is above {LEAP:g} times the largest inside"
    )
    return Promise(text, f"{worst:.2f} times at most", worst <= LEAP)


def never_nearer_than_the_nearest(found: Sequence[Robustness]) -> Promise:
    least = min(float(run.ratios.min()) for each in found for run in each.runs.values())
    text = "no projection, by whatever options, is nearer to its target than the nearest feasible pose"
    return Promise(text, f"ratio {least:.6f} at least", least >= 1.0 - NEAREST)


def exact_where_asked(found: Sequence[Robustness]) -> Promise:
    worst = max(float(each.default_ratios.max()) for each in found)
    text = f"by default, no projection is farther than the optimiser's nearest pose by more than {100 * FARTHER:g} %"
    return Promise(text, f"ratio {worst:.7f} at most", worst <= 1.0 + FARTHER)


def assembled_by_passes(found: Sequence[Forward]) -> Promise:
    ended, count = sum(len(each.made) - each.by_fallback for each in found), sum(len(each.made) for each in found)
    text = f"forward kinematics by passes ends at the values of {100 * ASSEMBLES:g} of 100 random targets"
    return Promise(text, f"{ended} of {count}", ended >= ASSEMBLES * count)


def feasibilities(findings: Findings) -> Iterator[tuple[str, Feasibility]]:
    """What was measured of every experiment, with its name."""
    for inside in findings.efficacy:
        for name, run in inside.runs.items():
            yield f"{inside.case.label}, circle inside, {name} options", run.feasibility
    for random in findings.efficiency:
        for (name, start), answered in random.answers.items():
            yield f"{random.case.label}, random targets, {name} options, {start}", answered.feasibility
    for leaving in findings.robustness:
        for name, followed in leaving.runs.items():
            yield f"{leaving.case.label}, circle that leaves, {name} options", followed.feasibility


def feasibility_table(findings: Findings) -> str:
    rows = [
        (name, tiny(each.limit_excess), tiny(each.closure), tiny(each.independent), str(each.failed))
        for name, each in feasibilities(findings)
    ]
    return markdown(("", "limit excess", "closure", "independent", "failed"), rows)


def summary(findings: Findings) -> str:
    """The table of the documentation: the paper's numbers next to ours, for each machine."""
    groups = zip(findings.efficacy, findings.efficiency, strict=True)
    columns = [{**accuracy(inside), **cost(random)} for inside, random in groups]
    header = ["", *[f"{each.case.label}, {who}" for each in findings.efficacy for who in ("paper", "ours")]]
    rows = [[name, *[cell for column in columns for cell in column[name]]] for name in columns[0]]
    extent = findings.extent
    measured = f"{extent.targets} random targets and {extent.steps} steps a circle; {machine()}."
    return f"{markdown(header, rows)}\n\n{measured}"


def lines_of_summary(findings: Findings) -> str:
    """A few lines next to the paper's, for the project's first page."""
    names = (
        "position RMSE, paper's passes [mm]",
        "random targets reached, paper's passes",
        "random targets reached, default",
        "one call from Python, default [µs]",
    )
    text, _, _ = summary(findings).partition("\n\n")
    header, rule, *rows = text.splitlines()
    chosen = [row for row in rows if row.startswith(tuple(f"| {name} |" for name in names))]
    for name in ("paper", "default"):
        told = [f"– | {spread(each.runs[name].ratios)}" for each in findings.robustness]
        chosen.append(
            f"| out of reach, {NAMES[name]}: times the least distance (half, 95 %, all) | {' | '.join(told)} |"
        )
    return "\n".join([header, rule, *chosen])


def page_tables(findings: Findings) -> str:
    """What stands in the documentation: all tables."""
    parts = (summary(findings), beyond_table(findings), BEYOND, forward_table(findings), FORWARD, fallbacks(findings))
    return "\n\n".join(parts)


def accuracy(found: Efficacy) -> Cells:
    printed, point = found.case.printed, is_point(found.case)
    ours = {
        name: (number(run.position_rmse, 2), "–" if point else number(run.orientation_rmse, 2))
        for name, run in found.runs.items()
    }
    return {
        "position RMSE, paper's passes [mm]": (number(printed.position_rmse, 2), ours["paper"][0]),
        "position RMSE, extended [mm]": ("–", ours["extended"][0]),
        "position RMSE, accelerated [mm]": ("–", ours["accelerated"][0]),
        "position RMSE, default [mm]": ("–", ours["default"][0]),
        "orientation RMSE, paper's passes [deg]": (number(printed.orientation_rmse, 2), ours["paper"][1]),
        "orientation RMSE, extended [deg]": ("–", ours["extended"][1]),
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
        "random targets reached, paper's passes": ("–", reached("paper")),
        "random targets reached, extended": ("–", reached("extended")),
        "random targets reached, accelerated": ("–", reached("accelerated")),
        "random targets reached, default": ("–", reached("default")),
        "passes, paper's, cold / warm start": (number(printed.iterations), both("paper")),
        "passes, extended, cold / warm start": ("–", both("extended")),
        "passes, accelerated, cold / warm start": ("–", both("accelerated")),
        "a pass, paper's [µs]": (number(1e3 * printed.time / printed.iterations, 2), number(1e6 * found.pass_time, 2)),
        "paper's passes ÷ geometric approach, single, cold / warm start": (number(printed.ratio, 2), passes),
        "a target of a batch, paper's passes, cold / warm start [µs]": ("–", batch("paper")),
        "a target of a batch, accelerated, cold / warm start [µs]": ("–", batch("accelerated")),
        "a target of a batch, default, cold / warm start [µs]": ("–", batch("default")),
        "default ÷ geometric approach, batch, cold / warm start": ("–", default),
        "one call from Python, default [µs]": ("–", number(1e6 * found.times["default", "cold", "call"], 2)),
    }


BEYOND = f"""*Farther*: the distance from the target over that of the nearest feasible pose of the same orientation,
which the default finds, or a general optimiser, whichever comes nearer; median, 95 % and worst. *Passes*: medians,
of steps that the default reaches, and of the others. *Step*: the largest of an actuator outside or across the edge over
the largest inside. *Leaps*: steps above {LEAP:g} times that. *Missed*: steps within reach that end elsewhere."""

FORWARD = f"""From home, at the actuator values of {MOST} random targets at most. *Found*: rows that end in the pose
that the values were taken from; others assemble otherwise. Passes for this are ours: the paper leaves it to future
work."""


def fallbacks(findings: Findings) -> str:
    """How many answers of all experiments, by their options, are not those of passes."""
    counts: dict[str, list[int]] = {}
    for each in findings.efficacy:
        for name, run in each.runs.items():
            counts.setdefault(name, []).extend([run.by_fallback, len(run.solution)])
    for random in findings.efficiency:
        for (name, _start), answered in random.answers.items():
            counts.setdefault(name, []).extend([answered.by_fallback, len(answered.solution)])
    for leaving in findings.robustness:
        for name, followed in leaving.runs.items():
            counts.setdefault(name, []).extend([followed.by_fallback, len(followed.solution)])
    told = [f"{name} {sum(given[::2])} of {sum(given[1::2])}" for name, given in counts.items() if name != "default"]
    return f"Answers that another engine gave because passes did not, in all experiments: {', '.join(told)}."


def beyond_table(findings: Findings) -> str:
    """The third experiment, a row for each machine and set of options."""
    header = ("", "farther", "passes within / beyond", "rounds, most", "step", "leaps", "missed")
    rows = [
        (
            f"{found.case.label}, {NAMES[name]}",
            spread(run.ratios),
            " / ".join(
                number(float(np.median(run.solution.iterations[part])), 3) for part in (~found.beyond, found.beyond)
            ),
            str(int(run.solution.rounds.max())),
            f"{run.jump_ratio:.2f}",
            str(run.leaps),
            str(found.missed(name)),
        )
        for found in findings.robustness
        for name, run in found.runs.items()
    ]
    worst = [each for name, each in feasibilities(findings) if "leaves" in name]
    excess, gap = max(each.limit_excess for each in worst), max(each.closure for each in worst)
    beyond = ", ".join(f"{each.case.label} {int(each.beyond.sum())}" for each in findings.robustness)
    steps = len(findings.robustness[0].targets)
    told = f"Out of reach of {steps} steps: {beyond}. Largest of all rows: limit excess {tiny(excess)}, loop gap"
    return f"{markdown(header, rows)}\n\n{told} {tiny(gap)} L."


NAMES = {
    "paper": "the paper's passes",
    "extended": "extended",
    "centroid": "centroid, fitted",
    "accelerated": "accelerated",
    "default": "default",
}


def forward_table(findings: Findings) -> str:
    """Both methods of forward kinematics, a row for each machine."""
    header = ("", "found by passes", "passes, median / most", "by Newton's method", "time ÷ Newton's")
    rows = [
        (
            random.case.label,
            f"{found.found} of {len(found.made)}",
            f"{np.median(found.made):.4g} / {found.made.max()}",
            f"{found.newton} of {len(found.made)}",
            number(found.seconds["passes"] / found.seconds["newton"], 2),
        )
        for random, found in zip(findings.efficiency, findings.forward, strict=True)
    ]
    return markdown(header, rows)


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
