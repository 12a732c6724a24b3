"""Constructs of the subset, each in a function of its own; `test_to_c` compares them in Python and in C."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from pfabrik.kernels._jit import allocator, inlined, routine

Floats = Any
Ints = Any
LINK_FIELDS = [("kind", "i8"), ("length", "f8"), ("axis", "f8", (3,)), ("frame", "f8", (3, 3)), ("places", "i8", (2,))]
LINK = np.dtype([*LINK_FIELDS, ("cube", "f8", (2, 2, 2))])
FIRST, SECOND, THIRD = range(3)
WEIGHTS = (0.5, -2.0, 3.25)
PLACES = (2, 0, 1)
HUGE = 2**40
MANY = 100000
NEVER = False
UNIT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
ROWS, WIDTH = 3, 64


class Table(NamedTuple):
    """Arrays that go together."""

    numbers: Floats  # (n,)
    links: Any
    grid: Floats  # (n, m)


class Pair(NamedTuple):
    """A NamedTuple in a NamedTuple, with numbers."""

    table: Table
    scale: float
    n: int


@routine
def arithmetic(x: Floats, n: Ints, out: Floats) -> None:
    a, b, i, j = x[0], x[1], n[0], n[1]
    out[0], out[1], out[2] = a + b * i - j / 3, -a - -b, abs(a)
    out[3], out[4], out[5] = i // 7, i % 7, -i // 7
    out[6], out[7], out[8] = -i % 7, i // -7, 2 ** (j & 7)
    out[9], out[10], out[11] = i & j | 5 ^ i, i >> 2, 1 << (j & 5)
    out[12], out[13], out[14] = min(a, b, 0.25), max(i, j), min(1.0 * i, a)
    out[15], out[16], out[17] = int(1000.0 * a), round(10.0 * b), float(i)
    out[22] = i << 2
    out[18], out[19], out[20] = +a, ~i, abs(j - i)
    out[21] = MANY * MANY + i


@routine
def functions(x: Floats, out: Floats) -> None:
    a, b = x[0], x[1]
    out[0], out[1], out[2] = math.sin(a), math.cos(b), math.tan(0.3 * a)
    out[3], out[4], out[5] = math.sqrt(a * a + 1.0), math.hypot(a, b), math.atan2(a, b)
    out[6], out[7], out[8] = math.acos(0.5 * math.sin(a)), math.copysign(a, b), math.floor(10.0 * a)
    out[9], out[10], out[11] = math.fabs(a), math.exp(-a * a), math.log(1.0 + b * b)
    out[14], out[15], out[16] = -(a**2), b**3, abs(a) ** 1.5
    out[12] = 1.0 if math.isfinite(a) and not math.isnan(b) else math.nan
    out[13] = math.pi if a < math.inf else -math.inf


@routine
def conditions(x: Floats, n: Ints, out: Floats) -> None:
    a, b, i = x[0], x[1], n[0]
    if a < b <= 1.0 and not i & 1:
        out[0] = 1.0
    elif i in (0, 2, 4) or i not in (1, 3, 5):
        out[0] = 2.0
    else:
        out[0] = 3.0
    is_odd = i & 1 == 1
    out[1] = is_odd + 1
    out[2] = (a if a > b else b) if is_odd else 0.5
    low, high = (a, b) if a < b else (b, a)
    out[3], out[4] = low, high
    out[5] = 1.0 if is_odd & (a > 0.0) or not is_odd else 0.0
    out[6] = 1.0 if i and not n[1] else 0.0
    out[7] = int(is_odd) if bool(i) else -1


@routine
def loops(x: Floats, n: Ints, out: Floats) -> None:
    total, k = 0.0, 0
    for i in range(x.shape[0]):
        if i % 3 == 1:
            continue
        for j in range(i, -1, -2):
            total += x[j] * (i + 1)
        if total > 40.0:
            break
    while k < n[0] % 9:
        k += 2
        if k == 6:
            break
    for weight in WEIGHTS:
        total = total * 0.5 + weight
    for a, b in ((1.0, 2.0), (total, 3.0)):
        out[2] += a * b
    for _ in range(3):
        out[3] += 1.0
    last = 0
    for last in range(2, 5):
        out[4] += last
    for i in range(3):
        n_more = i
        for j in range(n_more):
            n_more += 1  # the range was fixed before
            out[6] += j
    out[0], out[1], out[5] = total, k, last


@routine
def move_on(values: Floats) -> float:
    """A value, and a change of what it is taken from."""
    values[0] += 1.0
    return float(values[0])


@routine
def order(x: Floats, out: Floats) -> None:
    out[0] = x[0] + move_on(x) * x[0] - move_on(x)
    first, second = x[0], move_on(x)
    out[1], out[2] = first, second
    out[3] = 2.0 * x[0] + (move_on(x) - move_on(x) / x[0])
    x[1], x[0] = x[0], x[1]
    out[4], out[5] = x[0], x[1]
    x[0] += move_on(x)
    out[6] = x[0]
    a, b = 1.0, 2.0
    a, b = b, a + b
    out[7], out[8] = a, b
    out[int(x[0]) * 0 + 9] = move_on(x)
    while move_on(x) + x[0] < 30.0:
        out[10] += 1.0
    out[11] = max(move_on(x), x[0] + 0.5)
    out[12] = 1.0 if move_on(x) > -99.0 and NEVER else 0.0
    out[13] = 1.0 if move_on(x) > 1e9 or not NEVER else 0.0
    out[15 + int(move_on(x)) * 0] = x[0]


@inlined
def cross(a: tuple[float, float, float], b: tuple[float, float, float]) -> tuple[float, float, float]:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@routine
def halves(a: float, n: int) -> tuple[float, int, bool]:
    return 0.5 * a, n // 2, n % 2 == 0


@routine
def tuples(x: Floats, n: Ints, out: Floats) -> None:
    a = (x[0], x[1], x[2])
    b = cross(a, (1.0, 0.5, x[3]))
    out[0], out[1], out[2] = b
    half, m, is_even = halves(x[0], n[0])
    out[3], out[4], out[5] = half, m, 1.0 if is_even else 0.0
    out[6] = halves(x[1], n[1])[0] + a[PLACES[n[0] % 3]] + WEIGHTS[-1]
    (p, q), r = (a[0], a[1]), a[2]
    out[7] = p + q * r
    out[8] = UNIT[1][1] + len(a) + HUGE
    out[9] = 1.0 if a == (x[0], x[1], x[2]) and b != a else 0.0
    out[10] = max(a) - min((b[0], b[1]))


@routine
def first_of(row: Floats) -> float:
    return float(row[0])


@routine
def views(x: Floats, grid: Floats, cube: Floats, out: Floats) -> None:
    row, rest, part = grid[1], x[2:], x[1:-1]
    out[0], out[1], out[2] = row[-1], rest[0], part[part.shape[0] - 1]
    out[3] = first_of(cube[1, 2]) + first_of(cube[0][1]) + cube[1][0][2]
    block = grid[1:3]
    block[0, 1] = 7.0
    out[4], out[5] = grid[1, 1], len(block)
    column = grid[:, 2]
    out[6] = column[0] + column[column.shape[0] - 1]
    inner = cube[:, 1, 1:]
    out[7] = inner[1, 0] + inner.shape[1]
    flat = cube.reshape(-1, 4)
    out[8], out[9] = flat[3, 1], flat.shape[0]
    out[10] = x[len(x) - 1 :][0] + x[:3][2] + x[5:2].shape[0]
    either = x if x[0] > 0.0 else row
    out[11] = either[1]
    grid[0, 0] = grid[0, 1] = 0.25


@routine
def records(links: Any, x: Floats, out: Floats) -> None:
    total = 0.0
    for k in range(links.shape[0]):
        link = links[k]
        link["length"] += x[k]
        link["axis"][1] = x[0]
        total += link["length"] * link["frame"][1, 2] + link["axis"][k % 3] + link["places"][1]
        if link["kind"] == SECOND:
            total -= first_of(link["axis"]) + first_of(link["frame"][2])
    links[2]["cube"][1, 0, 1] += links[2]["cube"][0][1][0]
    longest = links[0] if links[0]["length"] > links[1]["length"] else links[1]
    out[0], out[1] = total, longest["length"]


@routine
def sum_of(table: Table) -> float:
    return float(table.numbers[0] + table.links[0]["length"] + table.grid[0, 0])


@routine
def scaled(table: Table, scale: float) -> Pair:
    return Pair(table, scale, len(table.numbers))


@routine
def structures(table: Table, other: Table, out: Floats) -> None:
    pair = scaled(table, 2)
    older = pair
    for k in range(3):
        pair = Pair(other if k == 1 else table, pair.scale + k, k)
    out[0], out[1], out[2] = older.scale, pair.scale, sum_of(pair.table)
    out[3] = sum_of(older.table) + scaled(other, 0.5).scale + older.n
    chosen = table if out[0] > 100.0 else other
    out[4] = sum_of(chosen)


@allocator
def memory(n: int, out: Floats) -> None:
    a, b, c = np.zeros(n), np.zeros((n, 2), np.int64), np.empty((ROWS, WIDTH))
    links = np.zeros(2, LINK)
    for i in range(WIDTH):
        c[0, i] = i
        c[2, i] = 2.0 * c[0, i]
    links[1]["length"] = c[2, 3]
    a[n - 1], b[0, 1] = 3.0, 4
    out[0], out[1], out[2] = a[0] + a[n - 1], b[0, 1] + b[0, 0], links[1]["length"] + links[0]["length"]
    for k in range(20):
        more = np.zeros(1000 + k)
        out[3] += more[k] + more.shape[0]


@routine
def use_both(values: Floats, places: Ints) -> float:
    """A routine for two sets of argument types, whose inner calls are chosen by type."""
    return float(last(values) + last(places))


@routine
def last(values: Any) -> float:
    return values[values.shape[0] - 1] / 2


@routine
def polymorphic(x: Floats, n: Ints, out: Floats) -> None:
    out[0], out[1] = use_both(x, n), last(n)
