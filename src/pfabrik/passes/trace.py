"""Passes step by step: what each brings about, to look at."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, cast

import numpy as np

from ..answers.start_configuration import Start, start_of
from ..common.arrays import Floats
from ..common.checks import require_count
from ..common.drawing import Plotted, Size, View, drawn
from ..common.extras import require
from ..engines.joints.closure_engine import start_coordinates
from ..engines.joints.descend import clip_targets
from ..engines.joints.projection import modes_of
from ..engines.targets import Target, as_targets
from ..errors import InvalidArgument, UnsupportedMechanism, counted
from ..kernels.passes import passes as kernels
from ..kernels.passes import plan as P
from ..kernels.passes.restrict import fit_trunk, revise_target
from ..kernels.vectors import copy_table
from ..machine.description.mechanism import Mechanism, checked_mechanism
from ..machine.model import model_of
from ..machine.poses import are_poses, made_exact
from ..options import options_or
from .joint_positions import positions_of
from .pass_options import PAPER, PassOptions
from .passes_engine import settings_of, with_rules
from .plan import compile_plan

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Kind = Literal["start", "inward", "trunk", "outward", "revised"]


@dataclass(frozen=True, eq=False)
class Stage:
    """A configuration between two halves of a pass.

    Attributes
    ----------
    kind : {"start", "inward", "trunk", "outward", "revised"}
        What led to it: a half of a pass; the step of a trunk between the two; a revision of the target, which begins a
        round.
    chain : int
        The chain that moved, in the order of `decompose`; -1 for all.
    round, iteration : int
        The revisions of the target, and the passes of this round, up to here.
    nodes : array (n, 3)
        Joint centres [length].
    pose : array (4, 4)
        The target of the passes: the platform's pose if they reach it.
    trunks : array (k,)
        Coordinates of the trunks' joints, from home [length or rad].
    gap : float
        Largest distance of a chain's end from its target, of the chains that have moved [length].
    """

    kind: Kind
    chain: int
    round: int
    iteration: int
    nodes: Floats
    pose: Floats
    trunks: Floats
    gap: float


@dataclass(frozen=True, eq=False)
class PassTrace(Plotted):
    """Passes towards one target: `len(trace)` stages, `trace[i]` one of them.

    Attributes
    ----------
    mechanism : Mechanism
        The machine.
    target : array (4, 4)
        What was asked for.
    stages : tuple of Stage
        In order: per pass an inward and an outward one for each chain, and between them, where a chain has a trunk, its
        step; then, where chains do not reach, the target's revision.
    tolerance : float
        E [length].
    is_cut : bool
        True if the passes would have gone on: `most` of them were made.
    """

    mechanism: Mechanism
    target: Floats
    stages: tuple[Stage, ...]
    tolerance: float
    is_cut: bool

    def __len__(self) -> int:
        return len(self.stages)

    def __getitem__(self, index: int) -> Stage:
        return self.stages[index]

    def __iter__(self) -> Iterator[Stage]:
        return iter(self.stages)

    @property
    def passes(self) -> int:
        """Passes of all rounds: of each round those of the chain that needs most."""
        return int(sum(max(stage.iteration for stage in self if stage.round == k) for k in range(self.rounds + 1)))

    @property
    def rounds(self) -> int:
        """Revisions of the target."""
        return self.stages[-1].round

    @property
    def is_reached(self) -> bool:
        """True if all chains end within E of their targets, revised or not."""
        return self.stages[-1].gap <= self.tolerance

    @property
    def gaps(self) -> Floats:
        """Largest distance of a chain's end from its target after each pass, (passes,) [length]."""
        last = {(stage.round, stage.iteration): stage.gap for stage in self if stage.kind == "outward"}
        return np.array([last[key] for key in sorted(last)])

    def __str__(self) -> str:
        ends = "all ends within" if self.is_reached else "ends not within"
        passes, revisions = f"{self.passes} pass{'es' * (self.passes != 1)}", counted(self.rounds, "revision")
        unit, cut = self.mechanism.length_unit, "; stopped here" if self.is_cut else ""
        return f"{self.mechanism.name}: {passes}, {revisions} of the target; {ends} {self.tolerance:.4g} {unit}{cut}"

    def plot(self, passes: int = 1, *, view: View | None = None, size: Size | None = None) -> Figure:
        """Draw the start, the first passes half by half, and the end.

        Parameters
        ----------
        passes : int
            How many passes are drawn. Each chain has a picture of its own where there are three at most.
        view : str or (float, float), optional
            As in `pfabrik.plot`.
        size : (float, float), optional
            Width and height of the figure [inches].
        """
        require("pictures", "matplotlib", "plot")
        return cast("Figure", drawn(self, passes, view=view, size=size))

    def animate(
        self,
        path: str | os.PathLike[str],
        *,
        seconds: float = 0.4,
        view: View | None = None,
        size: Size | None = None,
    ) -> None:
        """Write a film of all stages, or of 400 of more.

        Parameters
        ----------
        path : str or PathLike
            The film; it ends in ".gif" or ".mp4". The latter needs the program `ffmpeg`.
        seconds : float, optional
            How long each stage is shown.
        view : str or (float, float), optional
            As in `pfabrik.plot`.
        size : (float, float), optional
            Width and height of the film [inches].
        """
        require("pictures", "matplotlib", "plot")
        drawn(self, 1, path, seconds, view=view, size=size)


def trace(
    mechanism: Mechanism,
    target: Target,
    options: PassOptions | None = None,
    *,
    start: Start | None = None,
    most: int = 10_000,
) -> PassTrace:
    """The passes of `pfabrik.passes.solve` towards one target, step by step, all chains in turn.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    target : array or RigidTransform or mapping
        One target as in `solve_ik`.
    options : Options, optional
        `Options.paper()`, the default, or `Options.extended()`, or some with one of their methods.
    start : Solution or array (nq,), optional
        Start as in `solve_ik`.
    most : int, optional
        Passes after which the trace ends, whatever they have reached (`is_cut`).

    Raises
    ------
    UnsupportedMechanism
        Joint positions do not express the mechanism, or its task leaves a part of the pose open.
    InvalidArgument
        Several targets; options of a method that makes no plain passes.
    """
    options = options_or(PAPER, options).of(checked_mechanism(mechanism))
    if options.method not in ("paper", "extended"):
        raise InvalidArgument("options.method", repr(options.method), "'paper' or 'extended', whose passes are plain")
    require_count("most", most)
    targets, shape = as_targets(mechanism, target)
    if shape or not are_poses(targets).all():
        raise InvalidArgument("target", f"batch shape {shape}" if shape else "no pose", "one pose")
    if mechanism.task != mechanism.whole_task:
        raise UnsupportedMechanism(mechanism.name, ("passes set the whole pose, which its task does not",))
    compiled, model = with_rules(compile_plan(mechanism), options), model_of(mechanism)
    wanted = clip_targets(mechanism, made_exact(targets))
    pose = wanted[0].copy()
    if mechanism.end_effector_is_joint:  # a point has no orientation; that of home is used
        pose[:3, :3] = np.eye(3)
    settings = settings_of(model, options, modes_of(model.path_closure, options)[0])
    config = P.new_configuration(compiled.plan)
    seeds = positions_of(mechanism, compiled, start_coordinates(model, start_of(mechanism, start, ())))
    P.load_seed(compiled.plan, seeds, 0, config)
    copy_table(pose, config.pose)
    stages = tuple(_stages(compiled.plan, config, settings, most))
    trace = PassTrace(mechanism, targets[0].copy(), stages, settings.tolerance, is_cut=False)
    goes_on = trace.rounds < settings.max_rounds or stages[-1].iteration < settings.max_iterations
    return replace(trace, is_cut=trace.passes >= most and not trace.is_reached and goes_on)


def _stages(plan: P.Plan, config: P.Configuration, settings: P.Settings, most: int) -> Iterator[Stage]:
    """Run passes of all chains, and revise the target where they do not reach it."""
    chains, made = range(len(plan.chains)), 0
    gaps = [max(_gap(plan, b, config) for b in _branches(plan, c)) for c in chains]

    def stage(kind: Kind, chain: int, done: int, iteration: int) -> Stage:
        arrays = config.nodes.copy(), config.pose.copy(), config.trunks.copy()
        return Stage(kind, chain, done, iteration, *arrays, max(gaps))

    yield stage("start", -1, 0, 0)
    for done in range(settings.max_rounds + 1):
        if done:
            revise_target(plan, config, settings)
            yield stage("revised", -1, done, 0)
        left = list(chains)
        for iteration in range(1, settings.max_iterations + 1):
            for c in left:
                yield from (stage(kind, c, done, iteration) for kind in _halves(plan, c, config))
                gaps[c] = kernels.pass_outward(plan, c, config)
                yield stage("outward", c, done, iteration)
            made += 1
            left = [c for c in left if gaps[c] > settings.tolerance]
            if not left or made >= most:
                break
        if max(gaps) <= settings.tolerance or made >= most:
            return


def _halves(plan: P.Plan, c: int, config: P.Configuration) -> Iterator[Kind]:
    """The inward half of a pass, and the step of the trunk."""
    kernels.pass_inward(plan, c, config)
    yield "inward"
    if plan.chains[c]["trunk"] >= 0:
        fit_trunk(plan, c, config)
        yield "trunk"


def _branches(plan: P.Plan, c: int) -> range:
    return range(plan.chains[c]["first"], plan.chains[c]["last"])


def _gap(plan: P.Plan, b: int, config: P.Configuration) -> float:
    return float(kernels.end_gap(plan, b, config))
