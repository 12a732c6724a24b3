"""`design`: dimensions for what a machine must do, found by counterexample, with the proof."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from typing import Any, Literal, overload

import numpy as np

from ...common.arrays import Floats
from ...common.checks import require_choice, require_finite, require_mapping
from ...common.extras import require
from ...common.telling import OnProgress, telling
from ...errors import InvalidArgument, UnknownName
from ...kinematics import Target
from ...machine.description.mechanism import Mechanism, checked_mechanism
from ..certify.pose_region import PoseRegion
from .candidate import Candidate
from .counterexamples import Aim, DesignQuestion, SmallestSearch, aim_of
from .found_design import Design, Designs
from .keep import Requirement, requirements_of

FRONT, APART = 7, 1e-5
"""Designs of a front at most, and by what share the second aim falls from one to the next at least."""


@overload
def design(
    mechanism: Mechanism,
    vary: Mapping[str, tuple[float, float]],
    reach: PoseRegion | Target,
    *,
    keep: Iterable[Requirement | str] = ...,
    minimise: Aim | Sequence[Aim] = ...,
    about: Literal["base", "home"] = ...,
    seed: int = ...,
    executor: Executor | None = ...,
    on_progress: OnProgress | None = ...,
) -> Design: ...


@overload
def design(
    mechanism: Sequence[Mechanism] | Mapping[str, Mechanism],
    vary: Mapping[str, tuple[float, float]],
    reach: PoseRegion | Target,
    *,
    keep: Iterable[Requirement | str] = ...,
    minimise: Aim | Sequence[Aim] = ...,
    about: Literal["base", "home"] = ...,
    seed: int = ...,
    executor: Executor | None = ...,
    on_progress: OnProgress | None = ...,
) -> Designs: ...


def design(
    mechanism: Mechanism | Sequence[Mechanism] | Mapping[str, Mechanism],
    vary: Mapping[str, tuple[float, float]],
    reach: PoseRegion | Target,
    *,
    keep: Iterable[Requirement | str] = (),
    minimise: Aim | Sequence[Aim] = "size",
    about: Literal["base", "home"] = "base",
    seed: int = 0,
    executor: Executor | None = None,
    on_progress: OnProgress | None = None,
) -> Design | Designs:
    """Find dimensions with which a machine reaches all poses of a region and keeps what it must, as small as can be.

    By counterexample: the smallest aim for some poses; `certify` proves the region, or has a pose that is not reached,
    which is one more of them; and so on. Requirements other than margins have no proof: many samples decide, and the
    result says so.

    Parameters
    ----------
    mechanism : Mechanism or sequence of Mechanism or mapping of str to Mechanism
        A machine from a file with dimensions, whose chains are all legs in closed form; or several to compare.
    vary : mapping of str to tuple
        Dimension -> its lowest and highest value, in the units of the file. Of several machines each has those of them
        that it knows.
    reach : PoseRegion or array or Track
        What is to be reached: a region, poses as in `solve_ik`, or a Track, also between its steps.
    keep : iterable of Requirement or str, optional
        Requirements of `pfabrik.keep`, and relations of dimensions, "rod >= 1.2*arm". A distance from singularities is
        kept unless `keep.singularity(None)` is among them; a machine with a clearance keeps that.
    minimise : str or callable or sequence, optional
        "size": the diameter of the smallest sphere about the centres of all joints at home [length]. "stroke": the
        longest way of an actuator over the poses [length, or rad times L]. Or an expression of dimensions, or a
        function of a Mechanism. Two of these give a front.
    about : {"base", "home"}, optional
        Where positions of `reach` count from: the base's origin, or the reference point at home, which may move with
        the dimensions.
    seed : int, optional
        Of starts and samples.
    executor : Executor, optional
        Of `concurrent.futures`, or one like it, on whose workers `certify` looks at cells.
    on_progress : callable, optional
        Called with (rounds done, most rounds); default: a line on a terminal.

    Returns
    -------
    Design or Designs
        Designs of several machines. True if found. Wishes that contradict each other end as "NOT FOUND", with those
        that do by name.

    Raises
    ------
    UnknownName or InvalidArgument
        No such dimension; bounds that are none; no poses.
    UnsupportedMechanism
        A chain is no leg in closed form.
    MissingLibrary
        SciPy is not installed.
    """
    require("design", "scipy", "calibrate")
    require_choice("about", about, ("base", "home"))
    bounds = _bounds(vary)
    requirements = requirements_of(keep)
    if isinstance(mechanism, Mapping | list | tuple):
        machines = list(mechanism.items()) if isinstance(mechanism, Mapping) else [("", m) for m in mechanism]
        named = [(name or checked_mechanism(m).name, checked_mechanism(m)) for name, m in machines]
        if not named:
            raise InvalidArgument("mechanism", "no machine", "one or more")
        known = {name for _, m in named for name in m.dimensions}
        _require_known(bounds, known)
    else:
        named = [("", checked_mechanism(mechanism))]
        _require_known(bounds, named[0][1].dimensions)
    found = []
    for name, machine in named:
        own = {each: ends for each, ends in bounds.items() if each in machine.dimensions}
        if not own:
            raise InvalidArgument("vary", f"no dimension of '{name}'", f"one of {', '.join(machine.dimensions)}")
        with telling("design", on_progress) as tell:
            asked = DesignQuestion(machine, own, reach, requirements, about, seed, executor, tell)
            aims = minimise if isinstance(minimise, tuple | list) else (minimise,)
            if len(aims) not in (1, 2):
                raise InvalidArgument("minimise", f"{len(aims)} aims", "one, or two for a front")
            answer = _front(asked, *aims) if len(aims) == 2 else SmallestSearch(asked, *aims).answer()
        found.append(replace(answer, _name=name or machine.name))
    return found[0] if named[0][0] == "" else Designs(found)


def _require_known(names: Iterable[str], known: Iterable[str]) -> None:
    for name in names:
        if name not in known:
            raise UnknownName("dimension", name, sorted(known))


def _bounds(vary: Any) -> dict[str, tuple[float, float]]:
    given = require_mapping("vary", vary, "bounds by the names of dimensions")
    if not given:
        raise InvalidArgument("vary", "no dimension", "bounds by the names of dimensions")
    found = {}
    for name, ends in given.items():
        try:
            low, high = (require_finite(f"vary['{name}']", end) for end in ends)
        except (TypeError, ValueError):
            raise InvalidArgument(f"vary['{name}']", repr(ends), "a lowest and a highest value") from None
        if not low < high:
            raise InvalidArgument(f"vary['{name}']", f"{low:g} to {high:g}", "the lowest value first, then the highest")
        found[name] = (low, high)
    return found


def _front(asked: DesignQuestion, first: Aim, second: Aim) -> Design:
    """Designs from the smallest first aim to the smallest second one, in equal steps of the second."""
    words, other = aim_of(asked, second)

    def value(aim: Callable[[Candidate], float], of: Design) -> float:
        values = np.array(list(of.dimensions.values()))
        return aim(Candidate(asked.dimensions, values, asked.reach.poses, asked.reach.moves))

    start = SmallestSearch(asked, first).answer()
    end = SmallestSearch(asked, second, near=start).answer()
    if not (start and end):
        return end if start else start
    most, least = value(other, start), value(other, end)
    designs, lowest = [replace(start, other=most)], most
    for bound in np.linspace(most, least, FRONT)[1:]:
        eased = bound + 1e-4 * abs(most - least)

        def kept(machine: Candidate, eased: float = eased) -> Floats:
            return np.array([(eased - other(machine)) / (abs(most) or 1.0)])

        row = Requirement(f"{words} <= {eased:.6g}", kept, has_poses=False)
        found = SmallestSearch(asked, first, [row], near=end).answer()
        if not found and bound == least:
            found = replace(end, aim=value(aim_of(asked, first)[1], end))
        if found and (other_of := value(other, found)) < lowest - APART * abs(lowest):
            designs = [each for each in designs if each.aim < found.aim] + [replace(found, other=other_of)]
            lowest = other_of
    return replace(designs[0], front=tuple(designs), minimised=f"{start.minimised}, {words}")
