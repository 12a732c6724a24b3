"""A mechanism as a serial chain: the unit motions between the base and the end effector, as kernels take them."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...common.arrays import Floats
from ...common.derived import derived
from ...kernels.chains.chain_records import SerialChain
from ...kernels.handle import Handle
from ...kernels.joints.loops import BALL, SLIDE, Loops
from ...machine.description.graph import independent_paths
from ...machine.model import Model
from ...tolerances import TOLERANCES


def is_chain(model: Model) -> bool:
    """True if one way leads to the end effector, through joints whose limits kernels of chains keep.

    The mechanism has no loop; branches that do not carry the end effector are idle.
    """
    return serial_chain(model) is not None


def chain_of(model: Model) -> SerialChain:
    """The chain of a mechanism that is one."""
    chain = serial_chain(model)
    assert chain is not None
    return chain


@derived
def chain_handle(model: Model) -> Handle[SerialChain]:
    """The handle by which kernels open the chain of a mechanism that is one."""
    return Handle(chain_of(model))


@derived
def serial_chain(model: Model) -> SerialChain | None:
    """The chain of a mechanism, lengths in L; None if it has loops, or limits of a kind that needs the closure engine.

    These are cones whose lines slides move, and universal joints with a cone and a range.
    """
    mechanism, loops = model.mechanism, model.closure.loops
    if len(loops.paths) != 2:
        return None
    (path,) = independent_paths(mechanism)
    moving = {step.joint.name for step in path if not step.joint.is_rigid}
    owners = [coordinate.joint for coordinate in mechanism.coordinates]
    visits = [(k, float(sense)) for k, sense in loops.visits if owners[loops.columns[k]].name in moving]
    units, signs = [k for k, _ in visits], np.array([sense for _, sense in visits])
    cones = _cones(loops, units, signs)
    if not visits or cones is None:
        return None
    kinds = loops.kinds[units]
    freedoms = np.concatenate([[0], np.cumsum(np.where(kinds == BALL, 3, 1))])
    low, high = np.full(freedoms[-1], -np.inf), np.full(freedoms[-1], np.inf)
    places = freedoms[:-1][kinds != BALL]
    low[places], high[places] = (bound[loops.columns[units][kinds != BALL]] for bound in (loops.lo, loops.hi))
    inside = TOLERANCES.inside
    with np.errstate(invalid="ignore"):
        is_narrow = high - low < 2.0 * inside
        middle = 0.5 * (low + high)
    points = np.vstack([np.zeros(3), loops.points[units], loops.end])
    for place in np.flatnonzero(kinds == SLIDE):
        points[place + 1] = points[place]  # a slide has no point of its own
    return SerialChain(
        kinds=kinds,
        axes=signs[:, None] * loops.axes[units],
        offsets=np.diff(points, axis=0),
        freedoms=freedoms[:-1],
        columns=loops.columns[units],
        senses=np.where(kinds == BALL, signs, 1.0),
        lo=np.where(is_narrow, middle, low + inside),
        hi=np.where(is_narrow, middle, high - inside),
        low=low,
        high=high,
        **cones,
    )


@derived
def stretched_length(model: Model) -> float:
    """Length of a chain that is stretched out, slides too [L]."""
    chain = chain_of(model)
    slides = chain.freedoms[chain.kinds == SLIDE]
    strokes = np.maximum(np.abs(chain.lo[slides]), np.abs(chain.hi[slides])).sum()
    return float(np.linalg.norm(chain.offsets[1:], axis=1).sum() + strokes)


def _cones(loops: Loops, units: list[int], signs: Floats) -> dict[str, Any] | None:
    """The cones on the chain: the vectors that joints turn, as the chain passes them, and those that rest.

    None if there are cones of another kind.
    """
    motions, moved, fixed, angles = [], [], [], []
    for cone, (first, last) in enumerate(loops.cone_units):
        if first not in units:
            continue
        columns = loops.columns[first:last]
        is_ranged = loops.kinds[first] != BALL and np.isfinite([loops.lo[columns], loops.hi[columns]]).any()
        if is_ranged or loops.cone_slides[cone, 0] < loops.cone_slides[cone, 1]:
            return None
        line = loops.cone_lines[cone] / np.linalg.norm(loops.cone_lines[cone])
        place = min(units.index(first), units.index(last - 1))
        is_line_moved = (loops.cone_outward[cone] == 1) == (signs[place] > 0.0)
        motions.append(place)
        moved.append(line if is_line_moved else loops.cone_axes[cone])
        fixed.append(loops.cone_axes[cone] if is_line_moved else line)
        angles.append(loops.cone_angles[cone] - TOLERANCES.inside)
    return {
        "cone_motions": np.array(motions, np.int64),
        "cone_moved": np.array(moved, float).reshape(-1, 3),
        "cone_fixed": np.array(fixed, float).reshape(-1, 3),
        "cone_angles": np.array(angles, float),
    }
