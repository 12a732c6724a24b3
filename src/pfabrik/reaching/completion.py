"""Between the two engines: joint coordinates from an answer in positions, and positions from joint coordinates."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..arrays import Floats
from ..closure.close import HELD, Closing, Closure, close, closure_of
from ..closure.configurations import new_rows, rows_at
from ..decomposition.plan import CompiledPlan, compile_plan
from ..description.mechanism import Mechanism
from ..kernels.reaching import plan as P
from ..motion.displacements import columns, displacements
from ..motion.limits import within_turns
from ..tolerances import TOLERANCES
from .points import joint_points

RESTARTS = 24
"""Random starts for an answer whose loops do not close from where it began: each finds most legs' turns."""


def coordinates_of(mechanism: Mechanism, rows: P.Rows, start: Floats | None = None, chained: bool = False) -> Floats:
    """All joint coordinates of answers in positions, as deviations from home, (n, columns).

    The platform and the actuators stay as they are, joint centres lead to the branch; what they leave open (a rod's
    spin) stays nearest to the start.

    Parameters
    ----------
    start : where to start, (n, columns) or (1, columns); None for home.
    chained : each row starts from the one before, so that angles count on along a path.
    """
    closure = closure_of(mechanism, whole=False)
    found = np.full((len(rows.status), len(closure.scale)), np.nan)
    known = np.flatnonzero(rows.status != P.INVALID)
    if not len(known):
        return found
    rows = rows_at(rows, known)
    begin = np.zeros((len(known), len(closure.scale)))
    if start is not None:
        begin[:] = start if len(start) == 1 else start[known]
    closure.put_actuators(begin, rows.actuators)
    centres = _centres(mechanism, compile_plan(mechanism), rows)
    settled = _settle(closure, begin, rows.poses, centres, chained).coordinates
    within_turns(mechanism, settled)
    found[known] = settled
    return found


def positions_of(mechanism: Mechanism, compiled: CompiledPlan, coordinates: Floats, rows: P.Rows) -> None:
    """Fill the nodes and trunks of answers from joint coordinates (n, columns)."""
    if rows.nodes.shape[1]:
        bodies = displacements(mechanism, coordinates)
        for point in compiled.points:
            node = compiled.plan.nodes[point.node]
            if node["stored"] >= 0:
                T = bodies[mechanism.joint(point.joint).connects[0]]
                rows.nodes[:, node["stored"]] = T[:, :3, :3] @ node["home"] + T[:, :3, 3]
    for name, record in zip(compiled.coordinates, compiled.plan.coordinates, strict=True):
        if record["kind"] == P.TRUNK:
            value = coordinates[:, columns(mechanism)[name].start] + mechanism.home_coordinate(name)
            rows.trunks[:, record["index"]] = record["sign"] * (value - record["offset"])


@lru_cache(maxsize=64)
def _readable_centres(mechanism: Mechanism) -> frozenset[str]:
    """Joints whose centres an answer in positions tells: not those merged with others into one at a common centre."""
    compiled = compile_plan(mechanism)
    home = new_rows(mechanism, 1)._replace(**compiled.home_seed._asdict())
    near = TOLERANCES.position * mechanism.characteristic_length
    return frozenset(
        name
        for name, point in joint_points(compiled, home).items()
        if np.abs(point[0] - np.asarray(mechanism.joint(name).at)).max() <= near
    )


def _centres(mechanism: Mechanism, compiled: CompiledPlan, rows: P.Rows) -> Floats:
    """Joint centres as the closure kernel wishes for them, (n, joints, 3); NaN for those that cannot be read."""
    readable = _readable_centres(mechanism)
    wished = np.full((len(rows.poses), len(mechanism.joints), 3), np.nan)
    points = joint_points(compiled, rows)
    for place, joint in enumerate(mechanism.joints):
        if joint.name in readable:
            wished[:, place] = points[joint.name]
    return wished


def _settle(closure: Closure, begin: Floats, poses: Floats, centres: Floats, chained: bool) -> Closing:
    """Close the legs below a platform and actuators at rest; rows that do not close are tried from elsewhere."""
    locked = closure.driven
    platform = (*HELD[:3], *((0.0,) * 3)) if closure.mechanism.end_effector_is_joint else HELD
    closing = close(closure, begin, poses, locked=locked, platform=platform, centres=centres, chained=chained)
    rng = np.random.default_rng(0)
    for _ in range(RESTARTS):
        open_rows = np.flatnonzero(_off(closing) > TOLERANCES.position)
        if not len(open_rows):
            break
        turns = np.where(closure.idle, 0.0, rng.uniform(-np.pi, np.pi, begin.shape[1]) * closure.turning)
        elsewhere = begin[open_rows] + turns
        closure.put_actuators(elsewhere, closure.actuators(begin[open_rows]))
        tried = close(
            closure, elsewhere, poses[open_rows], locked=locked, platform=platform, centres=centres[open_rows]
        )
        better = _off(tried) < _off(closing)[open_rows]
        closing.take(open_rows[better], tried, better)
    return closing


def _off(closing: Closing) -> Floats:
    """Largest gap or miss of each row [L or rad]."""
    return np.asarray(np.maximum(closing.gap, closing.misses.max(axis=1, initial=0.0)))
