"""Links of any machine: where they are, and how their distances change with the joint coordinates.

Their bodies are numbered by the paths that lead to them from the base.
"""

from __future__ import annotations

from ...arrays import Floats
from .._jit import routine
from ..clearance.link_limits import links_excess, put_pulls
from ..clearance.link_records import LinkLimits
from ..clearance.solids import CAPSULE, KIND
from ..vectors import Vec, add, cross, dot, put, sub, turn, vec
from .loops import SLIDE, Loops
from .path_kinematics import Equations, State, walk_path


@routine
def place_links(ways: Loops, state: State, eq: Equations, links: LinkLimits) -> None:
    """Fill the places of all links, and the axes of the joints on the ways to their bodies."""
    for i in range(len(links.home)):
        for k in range(4):
            put(links.places[i, k], vec(links.home[i, k]))
    for body in range(len(ways.paths) - 1):
        walk_path(ways, body, ways.paths[body + 1], state, eq)
        T = eq.T
        shift = (T[0, 3], T[1, 3], T[2, 3])
        for i in range(len(links.home)):
            is_capsule = links.sizes[i, KIND] == CAPSULE
            for k in range(4):
                if links.bodies[i, 1 if is_capsule and k == 1 else 0] == body:
                    turned = turn(eq.T, vec(links.home[i, k]))
                    put(links.places[i, k], add(turned, shift) if is_capsule or k == 0 else turned)


@routine
def are_apart(links: LinkLimits, ways: Loops, state: State, eq: Equations, tolerance: float) -> bool:
    """True if no links are nearer than the clearance, but for a tolerance [L]."""
    if links.pairs.shape[0] == 0:
        return True
    place_links(ways, state, eq, links)
    return bool(links_excess(links) <= tolerance)


@routine
def add_pair_slope(
    ways: Loops, links: LinkLimits, pair: int, excess: float, factor: float, eq: Equations, out: Floats
) -> None:
    """Add a factor times the derivative of the excess of the pair that was measured last."""
    put_pulls(links, pair, excess, factor)
    for end in range(4):
        body = links.bodies[links.pairs[pair, end // 2], end % 2]
        add_force(ways, body, vec(links.pulls[end]), vec(links.pulls[end, 3:]), eq, out)


@routine
def add_force(ways: Loops, body: int, x: Vec, force: Vec, eq: Equations, out: Floats) -> None:
    """Add the generalised force of a force at a point of a body."""
    for visit in range(ways.paths[body] if body >= 0 else 0, ways.paths[body + 1] if body >= 0 else 0):
        is_slide = ways.kinds[ways.visits[visit, 0]] == SLIDE
        for r in range(ways.visit_rows[visit], ways.visit_rows[visit + 1]):
            rate = vec(eq.rows[r]) if is_slide else cross(vec(eq.rows[r, 3:]), sub(x, vec(eq.at[r])))
            out[ways.row_columns[r]] += dot(force, rate)
