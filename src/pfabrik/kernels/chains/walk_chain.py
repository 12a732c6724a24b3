"""From coordinates to the end effector, with the screws of all freedoms, and from steps of freedoms to coordinates."""

from __future__ import annotations

import math

from ...common.arrays import Floats
from .._jit import inlined, routine
from ..joints.loops import BALL, SLIDE
from ..quaternions import logarithm, rotate_by, turn_ball
from .chain_constants import ALONG, CORRECTIONS, NEAR_CONE
from .chain_records import ChainScratch, ChainState, SerialChain


@inlined
def copy_chain_state(source: ChainState, target: ChainState) -> None:
    """Copy a configuration."""
    for j in range(len(source.q)):
        target.q[j] = source.q[j]
    for k in range(len(source.balls)):
        for i in range(4):
            target.balls[k, i] = source.balls[k, i]


@routine
def load_chain(chain: SerialChain, coordinates: Floats, within: bool, state: ChainState) -> None:
    """Load a configuration from dimensionless coordinates (columns,); with `within`, moved into its limits."""
    for k in range(len(chain.kinds)):
        j, d, sense = chain.columns[k], chain.freedoms[k], chain.senses[k]
        if chain.kinds[k] == BALL:
            ball = state.balls[k]
            ball[0] = 1.0
            ball[1] = ball[2] = ball[3] = 0.0
            turn_ball(ball, sense * coordinates[j], sense * coordinates[j + 1], sense * coordinates[j + 2])
        else:
            q = sense * coordinates[j]
            state.q[d] = min(max(q, chain.lo[d]), chain.hi[d]) if within else q
    for cone in range(len(chain.cone_angles) if within else 0):
        enter_cone(chain, cone, state)


@routine
def store_chain(chain: SerialChain, state: ChainState, coordinates: Floats) -> None:
    """Write a configuration to dimensionless coordinates (columns,)."""
    for k in range(len(chain.kinds)):
        j, sense = chain.columns[k], chain.senses[k]
        if chain.kinds[k] == BALL:
            ball = state.balls[k]
            x, y, z = logarithm(ball[0], ball[1], ball[2], ball[3])
            coordinates[j], coordinates[j + 1], coordinates[j + 2] = sense * x, sense * y, sense * z
        else:
            coordinates[j] = sense * state.q[chain.freedoms[k]]


@routine
def walk_chain(chain: SerialChain, state: ChainState, s: ChainScratch) -> None:
    """Pose the end effector, and write the screws of all freedoms."""
    kinds, axes, offsets, freedoms = chain.kinds, chain.axes, chain.offsets, chain.freedoms
    screws, centres, X = s.screws, s.centres, s.X
    a00, a01, a02, a10, a11, a12, a20, a21, a22 = 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0
    px, py, pz = 0.0, 0.0, 0.0
    m = len(kinds)
    for k in range(m):
        x, y, z = offsets[k, 0], offsets[k, 1], offsets[k, 2]
        px += a00 * x + a01 * y + a02 * z
        py += a10 * x + a11 * y + a12 * z
        pz += a20 * x + a21 * y + a22 * z
        d, kind = freedoms[k], kinds[k]
        if kind == BALL:
            for i in range(3):
                centres[d + i, 0], centres[d + i, 1], centres[d + i, 2] = px, py, pz
            screws[d, 3], screws[d, 4], screws[d, 5] = a00, a10, a20
            screws[d + 1, 3], screws[d + 1, 4], screws[d + 1, 5] = a01, a11, a21
            screws[d + 2, 3], screws[d + 2, 4], screws[d + 2, 5] = a02, a12, a22
            X[0, 0], X[0, 1], X[0, 2], X[1, 0], X[1, 1], X[1, 2] = a00, a01, a02, a10, a11, a12
            X[2, 0], X[2, 1], X[2, 2] = a20, a21, a22
            ball = state.balls[k]
            rotate_by(X, ball[0], ball[1], ball[2], ball[3])
            a00, a01, a02, a10, a11, a12 = X[0, 0], X[0, 1], X[0, 2], X[1, 0], X[1, 1], X[1, 2]
            a20, a21, a22 = X[2, 0], X[2, 1], X[2, 2]
            continue
        x, y, z = axes[k, 0], axes[k, 1], axes[k, 2]
        u, v, w = a00 * x + a01 * y + a02 * z, a10 * x + a11 * y + a12 * z, a20 * x + a21 * y + a22 * z
        q = state.q[d]
        if kind == SLIDE:
            screws[d, 0], screws[d, 1], screws[d, 2] = u, v, w
            screws[d, 3] = screws[d, 4] = screws[d, 5] = 0.0
            px += q * u
            py += q * v
            pz += q * w
            continue
        screws[d, 3], screws[d, 4], screws[d, 5] = u, v, w
        centres[d, 0], centres[d, 1], centres[d, 2] = px, py, pz
        # each row r of the rotation becomes c r + s r x a + (1 - c) (r . a) a, where a is the axis
        c, e = math.cos(q), math.sin(q)
        f = 1.0 - c
        a00, a01, a02 = turned_row(a00, a01, a02, c, e, f * u, x, y, z)
        a10, a11, a12 = turned_row(a10, a11, a12, c, e, f * v, x, y, z)
        a20, a21, a22 = turned_row(a20, a21, a22, c, e, f * w, x, y, z)
    x, y, z = offsets[m, 0], offsets[m, 1], offsets[m, 2]
    px += a00 * x + a01 * y + a02 * z
    py += a10 * x + a11 * y + a12 * z
    pz += a20 * x + a21 * y + a22 * z
    X[0, 0], X[0, 1], X[0, 2], X[0, 3] = a00, a01, a02, px
    X[1, 0], X[1, 1], X[1, 2], X[1, 3] = a10, a11, a12, py
    X[2, 0], X[2, 1], X[2, 2], X[2, 3] = a20, a21, a22, pz
    for k in range(m):
        if kinds[k] != SLIDE:
            for d in range(freedoms[k], freedoms[k] + (3 if kinds[k] == BALL else 1)):
                x, y, z = px - centres[d, 0], py - centres[d, 1], pz - centres[d, 2]
                u, v, w = screws[d, 3], screws[d, 4], screws[d, 5]
                screws[d, 0], screws[d, 1], screws[d, 2] = v * z - w * y, w * x - u * z, u * y - v * x


@inlined
def turned_row(
    r: float, s: float, t: float, c: float, e: float, f: float, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """c (r, s, t) + e (r, s, t) x (x, y, z) + f (x, y, z)."""
    return c * r + e * (s * z - t * y) + f * x, c * s + e * (t * x - r * z) + f * y, c * t + e * (r * y - s * x) + f * z


@routine
def cone_normal(chain: SerialChain, cone: int, state: ChainState, out: Floats) -> float:
    """The angle at a cone; `out` gets the axis across line and cone axis, unit or zero, in the joint's first body."""
    k = chain.cone_motions[cone]
    moved, fixed = chain.cone_moved[cone], chain.cone_fixed[cone]
    x, y, z = moved[0], moved[1], moved[2]
    if chain.kinds[k] == BALL:
        ball = state.balls[k]
        x, y, z = turned_by(ball[0], ball[1], ball[2], ball[3], x, y, z)
    else:
        for i in range(k + 1, k - 1, -1):
            half, axis = 0.5 * state.q[chain.freedoms[i]], chain.axes[i]
            e = math.sin(half)
            x, y, z = turned_by(math.cos(half), e * axis[0], e * axis[1], e * axis[2], x, y, z)
    u, v, w = y * fixed[2] - z * fixed[1], z * fixed[0] - x * fixed[2], x * fixed[1] - y * fixed[0]
    sine = math.sqrt(u * u + v * v + w * w)
    scale = 1.0 / sine if sine > ALONG else 0.0
    out[0], out[1], out[2] = scale * u, scale * v, scale * w
    return math.atan2(sine, x * fixed[0] + y * fixed[1] + z * fixed[2])


@inlined
def turned_by(w: float, x: float, y: float, z: float, a: float, b: float, c: float) -> tuple[float, float, float]:
    """The vector (a, b, c) turned by a unit quaternion."""
    p, q, r = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return a + w * p + y * r - z * q, b + w * q + z * p - x * r, c + w * r + x * q - y * p


@routine
def cone_slopes(chain: SerialChain, cone: int, state: ChainState, normal: Floats) -> tuple[float, float]:
    """Derivatives of the angle at a cone of two turns, whose `normal` is given."""
    k = chain.cone_motions[cone]
    a, b = chain.axes[k], chain.axes[k + 1]
    half = 0.5 * state.q[chain.freedoms[k]]
    e = math.sin(half)
    x, y, z = turned_by(math.cos(half), e * a[0], e * a[1], e * a[2], b[0], b[1], b[2])
    first = -(normal[0] * a[0] + normal[1] * a[1] + normal[2] * a[2])
    return first, -(normal[0] * x + normal[1] * y + normal[2] * z)


@routine
def enter_cone(chain: SerialChain, cone: int, state: ChainState) -> None:
    """Bring a joint that is outside its cone back onto it, the shortest way."""
    k, limit, normal = chain.cone_motions[cone], chain.cone_angles[cone], state.balls[chain.cone_motions[cone]]
    if chain.kinds[k] == BALL:
        x, y, z = normal[1], normal[2], normal[3]
        angle = cone_normal(chain, cone, state, normal[1:])
        u, v, t = normal[1], normal[2], normal[3]
        normal[1], normal[2], normal[3] = x, y, z
        if angle > limit:
            turn_ball(normal, (angle - limit) * u, (angle - limit) * v, (angle - limit) * t)
        return
    first = chain.freedoms[k]
    for _ in range(CORRECTIONS):
        angle = cone_normal(chain, cone, state, normal)
        if angle <= limit:
            return
        f, g = cone_slopes(chain, cone, state, normal)
        square = f * f + g * g
        if not square > 0.0:
            return
        back = (angle - limit) / square
        state.q[first] -= back * f
        state.q[first + 1] -= back * g


@routine
def excess_of(chain: SerialChain, state: ChainState, s: ChainScratch) -> float:
    """The largest excess over a limit; negative inside all [rad or L]."""
    excess = -math.inf
    for d in range(len(chain.lo)):
        excess = max(excess, chain.low[d] - state.q[d], state.q[d] - chain.high[d])
    for cone in range(len(chain.cone_angles)):
        excess = max(excess, cone_normal(chain, cone, state, s.cones[cone]) - chain.cone_angles[cone])
    return excess


@routine
def bound_steps(chain: SerialChain, state: ChainState, s: ChainScratch) -> None:
    """Write the bounds of the step of every freedom; freedoms of joints with cones are turned along and across them."""
    for d in range(len(chain.lo)):
        s.least[d], s.most[d], s.bend[d] = chain.lo[d] - state.q[d], chain.hi[d] - state.q[d], 0.0
    for cone in range(len(chain.cone_angles)):
        frame_cone(chain, cone, state, s)


@routine
def frame_cone(chain: SerialChain, cone: int, state: ChainState, s: ChainScratch) -> None:
    """Replace the screws of a joint near its cone: the first opens the angle at the cone, the others leave it."""
    k, normal = chain.cone_motions[cone], s.cones[cone]
    d = chain.freedoms[k]
    angle = cone_normal(chain, cone, state, normal)
    x, y, z = normal[0], normal[1], normal[2]
    slack = chain.cone_angles[cone] - angle
    is_near = slack < NEAR_CONE and x * x + y * y + z * z > 0.0
    if chain.kinds[k] == BALL:
        normal[3] = 1.0 if is_near else 0.0
        if not is_near:
            return
        fixed = chain.cone_fixed[cone]
        # opening turns about -n; turns about the cone's axis f leave the angle; the third is about n x f
        turn_screws(s.screws, d, -x, -y, -z, fixed[0], fixed[1], fixed[2])
        s.most[d] = slack
        normal[4] = math.cos(angle) / max(math.sin(angle), ALONG)
        return
    f, g = cone_slopes(chain, cone, state, normal)
    size = math.sqrt(f * f + g * g)
    if not is_near or size < ALONG:
        normal[3] = 0.0
        return
    f, g = f / size, g / size
    normal[0], normal[1], normal[2], normal[3] = f, g, size, 2.0
    for i in range(6):
        a, b = s.screws[d, i], s.screws[d + 1, i]
        s.screws[d, i], s.screws[d + 1, i] = f * a + g * b, f * b - g * a
    s.least[d] = s.least[d + 1] = -math.inf
    s.most[d], s.most[d + 1] = slack / size, math.inf


@inlined
def turn_screws(screws: Floats, d: int, x: float, y: float, z: float, u: float, v: float, w: float) -> None:
    """Combine the three screws of a ball into those about the unit vectors a = (x, y, z), b = (u, v, w) and a x b."""
    p, q, r = y * w - z * v, z * u - x * w, x * v - y * u
    for i in range(6):
        a, b, c = screws[d, i], screws[d + 1, i], screws[d + 2, i]
        screws[d, i] = x * a + y * b + z * c
        screws[d + 1, i] = u * a + v * b + w * c
        screws[d + 2, i] = p * a + q * b + r * c


@routine
def move_chain(chain: SerialChain, state: ChainState, s: ChainScratch) -> None:
    """Move all freedoms by `s.step`, which is used up, into their limits."""
    for cone in range(len(chain.cone_angles)):
        turn_back(chain, cone, state, s)
    for k in range(len(chain.kinds)):
        d = chain.freedoms[k]
        if chain.kinds[k] != BALL:
            state.q[d] = min(max(state.q[d] + s.step[d], chain.lo[d]), chain.hi[d])
            continue
        turn_ball(state.balls[k], 0.0, 0.0, s.step[d + 2])
        turn_ball(state.balls[k], 0.0, s.step[d + 1], 0.0)
        turn_ball(state.balls[k], s.step[d], 0.0, 0.0)
    for cone in range(len(chain.cone_angles)):
        enter_cone(chain, cone, state)


@routine
def turn_back(chain: SerialChain, cone: int, state: ChainState, s: ChainScratch) -> None:
    """Turn the steps of a joint near its cone back into those of its own axes; a ball is moved by them."""
    k, normal = chain.cone_motions[cone], s.cones[cone]
    d = chain.freedoms[k]
    a, b = s.step[d], s.step[d + 1]
    if normal[3] == 2.0:
        s.step[d], s.step[d + 1] = normal[0] * a - normal[1] * b, normal[1] * a + normal[0] * b
    elif normal[3] == 1.0:
        c, fixed = s.step[d + 2], chain.cone_fixed[cone]
        x, y, z = -normal[0], -normal[1], -normal[2]
        u, v, w = fixed[0], fixed[1], fixed[2]
        turn_ball(state.balls[k], c * (y * w - z * v), c * (z * u - x * w), c * (x * v - y * u))
        turn_ball(state.balls[k], b * u, b * v, b * w)
        turn_ball(state.balls[k], a * x, a * y, a * z)
        s.step[d] = s.step[d + 1] = s.step[d + 2] = 0.0
