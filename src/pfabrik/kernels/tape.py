"""Steps of arithmetic with the numbers of a home configuration, one at a time.

A step takes numbers and vectors out of an array of values, and writes its result there. A *tape* is a list of steps:
what a table of legs was computed by. Here is plain Python, which new machines run as it is; `kernels.replay` compiles
the same text. Neither fuses or reorders operations, so both give the same bits.
"""

from __future__ import annotations

import math
from typing import Any

# Of numbers a and b: a + b, a - b, a * b, a / b (0 where b is), the larger one, |a|, the sign of a (also of a zero),
# and the angle of the vector (b, a).
ADD, SUBTRACT, MULTIPLY, DIVIDE, MAXIMUM, MAGNITUDE, SIGN, ANGLE = range(8)
# Decisions, 1 if true: a <= b, a < b; vectors are the same.
AT_MOST, BELOW, SAME = range(8, 11)
# Of vectors a and b: a + b, a - b, number a times b, a divided by number b (0 where b is), the larger and the smaller
# of each two components, a x b.
V_ADD, V_SUBTRACT, V_SCALE, V_DIVIDE, V_MAXIMUM, V_MINIMUM, CROSS = range(11, 18)
# Of vectors a and b, and a number b: a . b; |a|; |a| without over- or underflow; the largest component of a; two unit
# vectors square to a, whose length is b, and to each other.
DOT, NORM, LENGTH, LARGEST, SQUARE = range(18, 23)

SIZES = (*(1,) * 11, *(3,) * 7, 1, 1, 1, 1, 6)
"""How many values the result of each operation is."""

SMALL, LARGE = 1e-100, 1e100
"""Numbers between which squares, and sums of them, neither over- nor underflow."""

DECISIONS = (AT_MOST, BELOW, SAME)


def perform(operation: int, values: Any, a: int, b: int, out: int) -> None:
    """Perform one step: operands at `a` and `b` among the values, its result at `out`.

    Unit vectors square to v are the last two rows of I - t w w^T, the reflection that turns v into the x axis: with
    s = -sign(v_x) |v|, w = (1, v_y / (v_x - s), v_z / (v_x - s)) and t = (s - v_x) / s. Of no length, v is that axis.
    """
    if operation == DOT:
        values[out] = values[a] * values[b] + values[a + 1] * values[b + 1] + values[a + 2] * values[b + 2]
    elif operation == CROSS:
        values[out] = values[a + 1] * values[b + 2] - values[a + 2] * values[b + 1]
        values[out + 1] = values[a + 2] * values[b] - values[a] * values[b + 2]
        values[out + 2] = values[a] * values[b + 1] - values[a + 1] * values[b]
    elif operation == NORM:
        x, y, z = values[a], values[a + 1], values[a + 2]
        values[out] = math.sqrt(x * x + y * y + z * z)
    elif operation == V_SUBTRACT:
        for i in range(3):
            values[out + i] = values[a + i] - values[b + i]
    elif operation == V_ADD:
        for i in range(3):
            values[out + i] = values[a + i] + values[b + i]
    elif operation == V_SCALE:
        for i in range(3):
            values[out + i] = values[a] * values[b + i]
    elif operation == V_DIVIDE:
        for i in range(3):
            values[out + i] = values[a + i] / values[b] if values[b] != 0.0 else 0.0
    elif operation == V_MAXIMUM:
        for i in range(3):
            values[out + i] = max(values[a + i], values[b + i])
    elif operation == V_MINIMUM:
        for i in range(3):
            values[out + i] = min(values[a + i], values[b + i])
    elif operation == AT_MOST:
        values[out] = 1.0 if values[a] <= values[b] else 0.0
    elif operation == BELOW:
        values[out] = 1.0 if values[a] < values[b] else 0.0
    elif operation == ADD:
        values[out] = values[a] + values[b]
    elif operation == SUBTRACT:
        values[out] = values[a] - values[b]
    elif operation == MULTIPLY:
        values[out] = values[a] * values[b]
    elif operation == DIVIDE:
        values[out] = values[a] / values[b] if values[b] != 0.0 else 0.0
    elif operation == MAXIMUM:
        values[out] = max(values[a], values[b])
    elif operation == MAGNITUDE:
        values[out] = abs(values[a])
    elif operation == SIGN:
        values[out] = math.copysign(1.0, values[a])
    elif operation == ANGLE:
        values[out] = math.atan2(values[a], values[b])
    elif operation == LARGEST:
        values[out] = max(values[a], values[a + 1], values[a + 2])
    elif operation == SAME:
        is_same = values[a] == values[b] and values[a + 1] == values[b + 1] and values[a + 2] == values[b + 2]
        values[out] = 1.0 if is_same else 0.0
    elif operation == SQUARE:
        x, s = values[a], -math.copysign(values[b], values[a])
        u, w, t = (values[a + 1] / (x - s), values[a + 2] / (x - s), (s - x) / s) if s != 0.0 else (0.0, 0.0, 0.0)
        values[out], values[out + 1], values[out + 2] = -t * u, 1.0 - t * u * u, -t * u * w
        values[out + 3], values[out + 4], values[out + 5] = -t * w, -t * u * w, 1.0 - t * w * w
    elif operation == LENGTH:
        size = max(abs(values[a]), abs(values[a + 1]), abs(values[a + 2]))
        unit = 1.0 if SMALL < size < LARGE or size == 0.0 else size
        x, y, z = values[a] / unit, values[a + 1] / unit, values[a + 2] / unit
        values[out] = unit * math.sqrt(x * x + y * y + z * z)


def result(operation: int, a: Any, b: Any = ()) -> list[float]:
    """The result of one step with operands that are sequences of one or three numbers."""
    values = [*a, *b, *(0.0,) * SIZES[operation]]
    perform(operation, values, 0, len(a), len(a) + len(b))
    return values[len(a) + len(b) :]
