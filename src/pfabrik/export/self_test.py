"""Poses that an exported file checks itself with: what the library answers to them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..arrays import Floats, Mask
from ..configuration import configuration
from ..description.mechanism import Mechanism
from ..feasibility import feasibility
from ..ik import solve_ik
from ..motion.mobility import generic_of
from ..options import Options
from ..poses import pose
from .machine import Machine
from .wording import Precision, literal

POSES = 50
FARTHEST = (0.3, 0.5)
"""How far the poses are from home [L, rad] at most."""

TRIED = 400
EXACT: dict[Precision, float] = {"double": 1e-10, "float": 1e-4}
"""To what share of L, or to how many rad, actuators must agree: what rounding may leave near a dead point."""

SURE = 1e-3
"""How far from its limits a pose is kept or not beyond doubt, as a share of the room there is."""


class Checks(NamedTuple):
    """Targets (n, 4, 4), the actuators there (n, n_a), and whether they are within all limits (n,)."""

    targets: Floats
    actuators: Floats
    kept: Mask


def checks_of(mechanism: Mechanism, limits: bool) -> Checks:
    """Poses around home that the mechanism reaches in home's working mode, some beyond its limits."""
    targets = targets_around_home(mechanism, TRIED, np.random.default_rng(0))
    targets[0] = mechanism.home_pose
    free = mechanism.without_limits()
    targets = targets[~(np.asarray(feasibility(free, targets).margin) < 0.0)]
    found = solve_ik(free, targets, options=Options(working_mode="keep"))
    reached = np.flatnonzero(found.status == 0)
    least = least_margins(mechanism, found.q[reached])
    sure = np.abs(least) > SURE
    kept, beyond = reached[sure & (least > 0.0)], reached[sure & (least < 0.0)] if limits else reached[:0]
    n_beyond = min(len(beyond), max(POSES // 5, POSES - len(kept)))
    chosen = np.concatenate([kept[: POSES - n_beyond], beyond[:n_beyond]])
    return Checks(targets[chosen], found.actuators[chosen], np.isin(chosen, kept))


def targets_around_home(mechanism: Mechanism, count: int, random: np.random.Generator) -> Floats:
    """Poses (n, 4, 4) around home, displaced as the platform can move at all."""
    directions = generic_of(mechanism).directions
    basis = np.zeros((6, directions.shape[1]))
    basis[: len(directions)] = directions
    onto = basis @ basis.T
    onto[np.abs(onto) < 1e-12] = 0.0
    reach, turn = FARTHEST
    scales = np.repeat([reach * mechanism.characteristic_length, turn], 3)
    moved = random.uniform(-1.0, 1.0, (count, 6)) * scales @ onto
    return pose(mechanism.home_pose[:3, 3] + moved[:, :3], rotvec=moved[:, 3:])


def least_margins(mechanism: Mechanism, q: Floats) -> Floats:
    """The least margin of all limits at joint vectors q, (n,)."""
    from ..answers.margins import margins

    if not len(q):
        return np.zeros(0)
    found = margins(configuration(mechanism, q))
    return np.asarray(np.min([np.ones(len(q)), *(np.asarray(each) for each in found.values())], axis=0))


def self_test(machine: Machine, precision: Precision, limits: bool, forward: bool) -> str:
    """A `main` that compares the file's answers with the library's."""
    return "\n".join(_main(machine, checks_of(machine.mechanism, limits), EXACT[precision], forward))


def _main(machine: Machine, checks: Checks, exact: float, forward: bool) -> Iterator[str]:
    count = len(checks.targets)
    sizes = ["PFK_SIZE" if each.unit == "length" else "1.0" for each in machine.driven]
    yield "#ifdef PFK_SELF_TEST"
    yield ""
    yield "#include <stdio.h>"
    yield ""
    yield f"/* {count} poses: where they are, the actuators there, and whether those are within all limits. */"
    yield "static const struct {"
    yield "    pfk_pose target;"
    yield "    pfk_real actuators[PFK_ACTUATORS];"
    yield "    int kept;"
    yield f"}} pfk_checks[{count}] = {{"
    for target, actuators, kept in zip(*checks, strict=True):
        own = f"{{{literal(target[:3, 3])}, {literal(target[:3, :3])}}}"
        yield f"    {{{own}, {literal(actuators)}, {int(kept)}}},"
    yield "};"
    yield ""
    yield "int main(void)"
    yield "{"
    yield f"    static const pfk_real size[PFK_ACTUATORS] = {{{', '.join(sizes)}}};"
    yield "    pfk_real found[PFK_ACTUATORS];"
    yield f"    pfk_pose pose{', back' if forward else ''};"
    yield "    int i, j, code, wrong = 0;"
    yield f"    for (i = 0; i < {count}; ++i) {{"
    yield "        pfk_home(&pose);"
    yield "        code = pfk_ik(&pfk_checks[i].target, &pose, found);"
    yield "        if ((code == 0) != pfk_checks[i].kept) {"
    yield '            printf("pose %d: %s\\n", i, pfk_what(code));'
    yield "            ++wrong;"
    yield "        }"
    yield "        for (j = 0; code == 0 && j < PFK_ACTUATORS; ++j)"
    yield f"            if (!(fabs(found[j] - pfk_checks[i].actuators[j]) <= {literal(exact)} * size[j])) {{"
    yield '                printf("pose %d, actuator %d: %.9g\\n", i, j, (double)found[j]);'
    yield "                ++wrong;"
    yield "            }"
    if forward:
        yield "        back = pose;"
        yield "        if (code == 0 && pfk_fk(found, &back, 0) != 0) {"
        yield '            printf("pose %d: no way back\\n", i);'
        yield "            ++wrong;"
        yield "        }"
        yield "        for (j = 0; code == 0 && j < 3; ++j)"
        yield f"            if (!(fabs(back.p[j] - pose.p[j]) <= {literal(exact)} * PFK_SIZE)) {{"
        yield '                printf("pose %d, back: %.9g\\n", i, (double)back.p[j]);'
        yield "                ++wrong;"
        yield "            }"
    yield "    }"
    yield f'    printf("{count} poses, %d wrong\\n", wrong);'
    yield "    return wrong != 0;"
    yield "}"
    yield ""
    yield "#endif"
    yield ""
