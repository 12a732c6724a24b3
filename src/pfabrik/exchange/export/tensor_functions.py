# mypy: disable-error-code="no-untyped-def, no-untyped-call, var-annotated"
"""The functions of a file of tensors: their text goes into files, for NumPy, PyTorch or JAX.

What stands here first is of every machine and library its own, in its file: constants, what arrays are made of, and
the functions that are noted of the machine's legs. In a file the first axes of arrays count numbers, those of the batch
are behind them; lengths are in SIZE.
"""

from __future__ import annotations

from typing import Any, cast

import numpy as xp

SIZE, STEPS, COMPLETING_STEPS = 1.0, 5, 5
N_PARAMETERS, N_PROXIMAL, N_OPEN, N_MOTIONS, ROTATIONS = 0, 0, 0, 6, 3
DIMENSIONS: dict[str, Any] = {}
JOINTS = _CONSTANTS = JOINT_UNITS = RATE_UNITS = SET_AXES = cast(Any, ())
ACCURACY = {"float64": 1e-13, "float32": 1e-6}
CLOSED = {"float64": 1e-9, "float32": 1e-4}
UNIT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_tensor = _array_of = _kind = _places = _cached = _whole = _detach = _largest = _root = _atan2 = cast(Any, staticmethod)
_home = _placed = _rates = _rooms = _equations = _closing = _proximal = _walked = cast(Any, None)


class _Numbers:
    """Numbers by their names."""

    def __init__(self, **named):
        self.__dict__.update(named)

    def detached(self):
        """The same without derivatives."""
        return _Numbers(**{name: _detach(value) for name, value in self.__dict__.items()})


# --- Arrays whose first axes count numbers. ---


def _array(values, like):
    """Constants with the type, and the device, of an array."""
    return _array_of(values, _kind(like))


def _first(x, n):
    """An array whose last n axes come first."""
    return _whole(xp.moveaxis(x, tuple(range(-n, 0)), tuple(range(n))))


def _last(x, n):
    """An array whose first n axes come last."""
    return _whole(xp.moveaxis(x, tuple(range(n)), tuple(range(-n, 0))))


def _spread(x, n, lead):
    """An array of the same numbers, with as many axes behind its first n as a batch has."""
    return x.reshape(tuple(x.shape[:n]) + (1,) * (len(lead) + n - x.ndim) + tuple(x.shape[n:]))


def _column(values, like):
    """Constants along the first axes, for numbers such as `like`."""
    values = _array(values, like)
    return values.reshape(tuple(values.shape) + (1,) * like.ndim)


def _joined(parts, like):
    """Numbers along one axis, from pairs of some of them and their count."""
    lead = tuple(like.shape)
    rows = [0.0 * like + part if isinstance(part, float) else part for part, _ in parts]
    return xp.concatenate([xp.broadcast_to(row, (n, *lead)) for row, (_, n) in zip(rows, parts, strict=True)], 0)


def _picked(x, places):
    """Some of the numbers along the first axis."""
    return x[_array_of(places, _places(x))]


def _over(a, b):
    """a / b; a where b is 0."""
    return a / xp.where(b == 0.0, 1.0, b)


def _larger(a, b):
    return xp.where(a > b, a, b)


def _sign(x):
    return xp.copysign(xp.ones_like(x), x)


def _cross(a, b):
    return xp.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _norm(v):
    return _root((v * v).sum(0))


def _precision(x):
    """The name of a type of numbers: float32 or float64."""
    return str(x.dtype).rpartition(".")[2]


# --- The machine's dimensions. ---


def _flat(rows):
    return [number for row in rows for number in _flat(row)] if isinstance(rows, tuple) else [float(rows)]


def _names(name, rows):
    if not isinstance(rows, tuple):
        return [name]
    if not isinstance(rows[0], tuple) and not name.endswith((".length", ".home")):
        return [f"{name}.{letter}" for letter in "xyz"]
    return [each for place, row in enumerate(rows) for each in _names(f"{name}[{place}]", row)]


PARAMETER_NAMES = tuple(each for name, rows in DIMENSIONS.items() for each in _names(name, rows))
"""The name of every number of `parameters`, such as 'cranks.centre[0].x'."""

_PARAMETERS = tuple(_flat(tuple(DIMENSIONS.values())))


@_cached
def _own_home(kind, n_axes):
    """What follows from the machine's own dimensions."""
    return _home(_array_of(_PARAMETERS + _CONSTANTS, kind).reshape((-1,) + (1,) * n_axes))


def _given(q, n, parameters):
    """Coordinates, whose own n axes come first, and what follows from dimensions, both for the same batch."""
    lead, own = tuple(q.shape[: q.ndim - n]), _first(q, n)
    if parameters is None:
        return own, _own_home(_kind(q), len(lead))
    lead = xp.broadcast_shapes(lead, tuple(parameters.shape[:-1]))
    numbers = _spread(_first(parameters, 1), 1, lead)
    constants = _spread(_array(_CONSTANTS, numbers), 1, lead)
    constants = xp.broadcast_to(constants, (len(_CONSTANTS), *numbers.shape[1:]))
    own = xp.broadcast_to(_spread(own, n, lead), tuple(own.shape[:n]) + tuple(lead))
    return own, _home(xp.concatenate([numbers, constants], 0))


# --- Newton's method: a fixed number of steps, then one more that carries the derivatives. ---


def _solve(J, off):
    """The least step (n, ...) for J step = - off, by the normal equations; what they do not determine stays 0.

    J is (n, m, ...), by the n unknowns first.
    """
    n, rank = len(J), ACCURACY[_precision(J)]
    rows, step = [(J[i] * J[i:]).sum(1) for i in range(n)], [-(J[i] * off).sum(0) for i in range(n)]
    sizes, shares = [row[0] for row in rows], []
    for k in range(n):
        is_free = rows[k][0] > rank * sizes[k]
        inverse = xp.where(is_free, 1.0 / xp.where(is_free, rows[k][0], 1.0), 0.0)
        shares.append(inverse * rows[k])
        step[k] = inverse * step[k]
        for i in range(k + 1, n):
            rows[i] = rows[i] - rows[k][i - k] * shares[k][i - k :]
            step[i] = step[i] - rows[k][i - k] * step[k]
    for k in reversed(range(n)):
        for i in range(k + 1, n):
            step[k] = step[k] - shares[k][i - k] * step[i]
    return xp.stack(step)


def _repeat(step, times, state):
    """A state after a number of steps."""
    for _ in range(times):
        state = step(state)
    return state


def _limited(step):
    """A step no longer than half a characteristic length, or half a radian."""
    size = _norm(step)
    return step * xp.where(size > 0.5, 0.5 / xp.where(size > 0.5, size, 1.0), 1.0)


def _moved_by(R, p, twist):
    """A pose after a twist (6, ...), in SIZE and in radians.

    The turn is that of the Rodrigues vector c = w / 2, a turn by w to second order: I + 2 (C + C C) / (1 + c c), where
    C is the cross product by c.
    """
    c = 0.5 * twist[3:]
    across = _cross(c, R)
    return R + (across + _cross(c, across)) * (2.0 / (1.0 + (c * c).sum(0))), p + twist[:3]


def _moved_slightly(R, p, twist):
    """The same to first order, for the last step, whose length is 0 but whose derivatives are not."""
    return R + _cross(twist[3:], R), p + twist[:3]


def _pose(R, p):
    """The pose (..., 4, 4) of a rotation and a position."""
    upper = xp.concatenate([R + 0.0 * p[0], (SIZE * p)[:, None] + 0.0 * R[0, 0]], 1)
    lower = 0.0 * upper[:1] + _column(((0.0, 0.0, 0.0, 1.0),), upper[0, 0])
    return _last(xp.concatenate([upper, lower], 0), 2)


def to_joints(actuators, start=None, parameters=None, steps=STEPS):
    """Joint coordinates (..., n) at which actuators (..., n_a) are, by `steps` steps of Newton's method from `start`.

    They carry derivatives by actuators and parameters. Near `start`, home if it is left out, they are those of the
    machine as it is assembled; far from it Newton's method may end in another assembly, or not come: compare
    `to_actuators` of them.
    """
    values, home = _given(_tensor(actuators), 1, parameters)
    fixed, wanted, n = home.detached(), _detach(values), len(JOINTS)
    q = fixed.joint_homes if start is None else _spread(_first(_detach(_tensor(start)), 1), 1, values.shape[1:])
    units = _column(JOINT_UNITS + (1.0,) * N_OPEN, values[0])
    z = xp.concatenate([q + 0.0 * wanted[:1], 0.0 * wanted[:1] + _column((0.0,) * N_OPEN, values[0])], 0)

    def equations(home, values, z):
        R, p, basis = _walked(home, z[:n])
        off, J = _equations(home, R, p, values, z[n:])
        return off, xp.concatenate([(J[:6, None] * basis[:, :, None]).sum(0), J[6:]], 0)

    def step(z):
        off, J = equations(fixed, wanted, z)
        return z + units * _limited(_solve(J, off))

    z = _detach(_repeat(step, steps, z))
    off, J = equations(home, values, z)
    return _last((z + units * _solve(_detach(J), off))[:n], 1)


def to_pose(actuators, start=None, parameters=None, steps=STEPS):
    """Poses (..., 4, 4) at which actuators (..., n_a) are, by `steps` steps of Newton's method from `start`.

    They carry derivatives by actuators and parameters. Near `start`, home if it is left out, they are those of the
    machine as it is assembled; far from it Newton's method may end in another assembly, or not come: compare
    `to_actuators` of them.
    """
    values, home = _given(_tensor(actuators), 1, parameters)
    fixed, wanted = home.detached(), _detach(values)
    zero = 0.0 * wanted[:1]
    if start is None:
        R, p = _column(UNIT, zero[0]) + zero, fixed.reference + zero
    else:
        T = _spread(_first(_detach(_tensor(start)), 2), 2, values.shape[1:])
        R, p = T[:3, :3] + zero, T[:3, 3] / SIZE + zero
    z = zero + _column((0.0,) * N_OPEN, zero[0])

    def solved(home, values, R, p, z, fixes):
        off, J = _equations(home, R, p, values, z)
        step = _solve(fixes(J if N_MOTIONS == 6 else xp.concatenate([J[:N_MOTIONS], J[6:]], 0)), off)
        return step if N_MOTIONS == 6 else xp.concatenate([step[:3], 0.0 * step[:3], step[3:]], 0)

    def step(now):
        R, p, z = now
        step = _limited(solved(fixed, wanted, R, p, z, lambda J: J))
        return *_moved_by(R, p, step[:6]), z + step[6:]

    R, p, z = map(_detach, _repeat(step, steps, (R, p, z)))
    return _pose(*_moved_slightly(R, p, solved(home, values, R, p, z, _detach)[:6]))


# --- Where the end effector is. ---


def _platform_by_joints(q, parameters):
    """Rotation and position at joint coordinates, the twist by each of them, and what follows from dimensions."""
    q, home = _given(_tensor(q), 1, parameters)
    return *_walked(home, q), home


def _platform_by_pose(q, parameters):
    """Rotation and position of a target, and what follows from dimensions."""
    T, home = _given(_tensor(q), 2, parameters)
    R, p = T[:3, :3], T[:3, 3] / SIZE
    return (R if N_MOTIONS == 6 else 0.0 * R + _column(UNIT, p[0])), p, None, home


def _platform_completed(q, parameters):
    """Rotation and position of a target, what the task leaves open completed, and what follows from dimensions."""
    T, home = _given(_tensor(q), 2, parameters)
    return *_completed(home, T[:3, :3], T[:3, 3] / SIZE), None, home


def pose(q, parameters=None):
    """The whole pose (..., 4, 4) of the end effector there."""
    return _pose(*_platform(q, parameters)[:2])


def _completed(home, target_R, target_p):
    """A pose whose legs close: what the task leaves open is found by Newton's method from home.

    The last step, from a detached solution, carries the derivatives.
    """
    fixed, is_set, fixed_R = home.detached(), _column(SET_AXES, target_p[0]), _detach(target_R)
    R, p = _start_rotation(fixed_R), is_set * _detach(target_p) + (1.0 - is_set) * fixed.reference
    z = _proximal(fixed, R, p) if N_PROXIMAL else p[:0]

    def step(now):
        R, p, z = now
        off, J = _closing(fixed, R, p, z)
        twist, more = _unset_twist(_limited(_solve(_by_unset(J, R), off)), R)
        return *_moved_by(R, p, twist), z + more

    R, p, z = map(_detach, _repeat(step, COMPLETING_STEPS, (R, p, z)))
    start_R, start_p = R, is_set * target_p + (1.0 - is_set) * p
    if ROTATIONS == 3:
        start_R = target_R
    elif ROTATIONS == 2:  # turned about its own z axis
        start_R = _times(target_R, _times(fixed_R.swapaxes(0, 1), R))
    off, J = _closing(home, start_R, start_p, z)
    twist, _ = _unset_twist(_solve(_detach(_by_unset(J, R)), off), R)
    return _moved_slightly(start_R, start_p, twist)


def _times(A, B):
    return (A[:, :, None] * B[None]).sum(1)


def _start_rotation(R):
    """The rotation to begin with: none, the shortest way to the target's tilt, or all that is asked for."""
    if ROTATIONS == 3:
        return R
    none = 0.0 * R + _column(UNIT, R[0, 0])
    if ROTATIONS == 0:
        return none
    z = R[:, 2]
    turn = xp.stack([-z[1], z[0], 0.0 * z[2]])
    sine = _norm(turn)
    axis, angle = _over(turn, sine), _atan2(sine, z[2])
    across = _cross(axis, none)
    return none + xp.sin(angle) * across + (1.0 - xp.cos(angle)) * _cross(axis, across)


def _by_unset(J, R):
    """Slopes by the motions that the task leaves open, and by proximal joints, from those by all six of a twist."""
    parts = [J[k : k + 1] for k in range(3) if not SET_AXES[k]]
    if ROTATIONS == 2:
        parts.append((J[3:6] * R[:, 2][:, None]).sum(0)[None])
    return xp.concatenate([*parts, *([J[3:6]] if ROTATIONS == 0 else []), J[6:]], 0)


def _unset_twist(step, R):
    """The twist (6, ...) of a step by the motions that the task leaves open, and what is left of the step."""
    zero, twist, n = 0.0 * step[:1], [], 0
    for is_set in SET_AXES:
        twist.append(zero if is_set else step[n : n + 1])
        n += 0 if is_set else 1
    if ROTATIONS == 0:
        return xp.concatenate([*twist, step[n : n + 3]], 0), step[n + 3 :]
    if ROTATIONS == 2:
        return xp.concatenate([*twist, step[n : n + 1] * R[:, 2]], 0), step[n + 1 :]
    return xp.concatenate([*twist, zero, zero, zero], 0), step[n:]


# --- From there to the actuators. ---


def to_actuators(q, parameters=None):
    """Actuators (..., n_a) there, in home's working mode.

    Where a rod does not reach, its crank or carriage is where it comes nearest, and `margin` is negative.
    """
    R, p, _, home = _platform(q, parameters)
    return _last(_placed(home, R, p)[0], 1)


def jacobian(q, parameters=None):
    """Rates of actuators by RATES_BY."""
    return with_jacobian(q, parameters)[1]


def with_jacobian(q, parameters=None):
    """`to_actuators` and `jacobian` at once."""
    R, p, basis, home = _platform(q, parameters)
    actuators, at = _placed(home, R, p)
    rates, rows = _rates(home, R, p, at)
    rates = _feasible(rates, rows) if basis is None else (rates[:, None] * basis[:, :, None]).sum(0)
    rates = rates if RATE_UNITS is None else rates * _column(RATE_UNITS, p[0])
    return _last(actuators, 1), _last(rates.swapaxes(0, 1), 2)


def _feasible(rates, rows):
    """Rates (6, n_a, ...) by the nearest twists that the legs allow, whose constraints have slopes (6, m, ...)."""
    basis = []
    for k in range(0 if rows is None else rows.shape[1]):
        row = rows[:, k]
        least = ACCURACY[_precision(row)] ** 0.5 * _larger(_norm(row), 1.0)
        for _ in range(2):
            for direction in basis:
                row = row - (row * direction).sum(0) * direction
        size = _norm(row)
        basis.append(xp.where(size > least, row / xp.where(size > least, size, 1.0), 0.0))
    for direction in basis:
        rates = rates - (rates * direction[:, None]).sum(0) * direction[:, None]
    return rates


def velocities(q, rates, parameters=None):
    """Rates of actuators (..., n_a) at rates of the coordinates (..., k), those that the Jacobian is by."""
    return (jacobian(q, parameters) * rates[..., None, :]).sum(-1)


def torques_to_coordinates(q, torques, parameters=None):
    """What torques and forces of actuators (..., n_a) do at TORQUES_AT.

    They are multiplied by the transpose of the Jacobian.
    """
    return (jacobian(q, parameters) * torques[..., None]).sum(-2)


def margins(q, parameters=None):
    """The room that is left before every limit of LIMITS, (..., k): negative beyond it.

    Ranges and cones are in rad or LENGTH_UNIT, from home's as the legs count them. A dead point's is the square of the
    sine of the angle from it, negative where a rod does not reach. The last one is negative where legs do not close.
    """
    R, p, _, home = _platform(q, parameters)
    room, gaps = _rooms(home, R, p, _placed(home, R, p)[1])
    if gaps is not None:
        closed = CLOSED[_precision(gaps)] - _largest(_last(abs(gaps), 1))
        room = closed[None] if room is None else xp.concatenate([room, closed[None]], 0)
    return _last(room, 1)


def margin(q, parameters=None):
    """The least of `margins` (...,), and its place in LIMITS."""
    room = margins(q, parameters)
    return -_largest(-room), room.argmin(-1)


_platform: Any = _platform_by_pose
