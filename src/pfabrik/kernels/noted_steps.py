"""Expressions of numbers at many rows, and their slopes: steps of arithmetic, a block of rows at a time.

A step takes values out of rows of a block, and writes its result into one. Slopes are carried forward along the same
steps: d f(x, y) = f_x dx + f_y dy, for all columns of what the inputs depend on.
"""

from __future__ import annotations

import math

import numpy as np

from ..common.arrays import Floats, Ints
from ._jit import kernel, routine
from .legs.columns import arctangent

# Of a and b: a + b, a - b, a * b, a / b, the larger, the smaller, |a|, |a| with the sign of b, the angle of (b, a), a
# to the power b; of a: its root, sine, cosine, tangent, the whole number below it.
ADD, SUBTRACT, MULTIPLY, DIVIDE, LARGER, SMALLER, MAGNITUDE, COPYSIGN, ANGLE, POWER = range(10)
ROOT, SINE, COSINE, TANGENT, FLOOR = range(10, 15)
# 1 if true, else 0: a < b, a <= b, a == b. Of a, b and c: b if a is 1, else c.
BELOW, AT_MOST, EQUAL, CHOOSE = range(15, 19)

BLOCK = 64
"""Rows of a block."""


@routine
def put_values(operation: int, a: Floats, b: Floats, c: Floats, n: int, out: Floats) -> None:
    """Fill the result of a step at n rows."""
    if operation == MULTIPLY:
        for i in range(n):
            out[i] = a[i] * b[i]
    elif operation == ADD:
        for i in range(n):
            out[i] = a[i] + b[i]
    elif operation == SUBTRACT:
        for i in range(n):
            out[i] = a[i] - b[i]
    elif operation == DIVIDE:
        for i in range(n):
            out[i] = a[i] / b[i]
    elif operation == CHOOSE:
        for i in range(n):
            first, second = b[i], c[i]
            out[i] = first if a[i] == 1.0 else second
    elif operation == BELOW:
        for i in range(n):
            out[i] = 1.0 if a[i] < b[i] else 0.0
    elif operation == AT_MOST:
        for i in range(n):
            out[i] = 1.0 if a[i] <= b[i] else 0.0
    elif operation == EQUAL:
        for i in range(n):
            out[i] = 1.0 if a[i] == b[i] else 0.0
    elif operation == LARGER:
        for i in range(n):
            first, second = a[i], b[i]
            out[i] = first if first >= second else second
    elif operation == SMALLER:
        for i in range(n):
            first, second = a[i], b[i]
            out[i] = first if first <= second else second
    elif operation == MAGNITUDE:
        for i in range(n):
            out[i] = abs(a[i])
    elif operation == ROOT:
        for i in range(n):
            out[i] = math.sqrt(a[i])
    else:
        put_functions(operation, a, b, n, out)


@routine
def put_functions(operation: int, a: Floats, b: Floats, n: int, out: Floats) -> None:
    """Fill the result of a step that the library of C computes."""
    if operation == ANGLE:
        for i in range(n):
            out[i] = arctangent(a[i], b[i])
    elif operation == COPYSIGN:
        for i in range(n):
            out[i] = math.copysign(a[i], b[i])
    elif operation == SINE:
        for i in range(n):
            out[i] = math.sin(a[i])
    elif operation == COSINE:
        for i in range(n):
            out[i] = math.cos(a[i])
    elif operation == TANGENT:
        for i in range(n):
            out[i] = math.tan(a[i])
    elif operation == FLOOR:
        for i in range(n):
            out[i] = float(math.floor(a[i]))
    elif operation == POWER:
        for i in range(n):
            out[i] = a[i] ** b[i]


@routine
def put_partials(operation: int, a: Floats, b: Floats, value: Floats, n: int, x: Floats, y: Floats) -> None:
    """Fill the derivatives of a step by its operands, of a choice by what is chosen from; 0 of a root or angle of 0."""
    for i in range(n):
        x[i], y[i] = 0.0, 0.0
    if operation == MULTIPLY:
        for i in range(n):
            x[i], y[i] = b[i], a[i]
    elif operation in (ADD, SUBTRACT):
        sign = 1.0 if operation == ADD else -1.0
        for i in range(n):
            x[i], y[i] = 1.0, sign
    elif operation == DIVIDE:
        for i in range(n):
            x[i] = 1.0 / b[i]
            y[i] = -value[i] / b[i]
    elif operation == CHOOSE:
        for i in range(n):
            x[i] = a[i]
            y[i] = 1.0 - a[i]
    elif operation in (LARGER, SMALLER):
        for i in range(n):
            x[i] = 1.0 if value[i] == a[i] else 0.0
            y[i] = 1.0 - x[i]
    elif operation == MAGNITUDE:
        for i in range(n):
            x[i] = math.copysign(1.0, a[i])
    elif operation == COPYSIGN:
        for i in range(n):
            x[i] = math.copysign(1.0, a[i]) * math.copysign(1.0, b[i])
    elif operation == ROOT:
        for i in range(n):
            x[i] = 0.5 / value[i] if value[i] > 0.0 else 0.0
    elif operation == ANGLE:
        for i in range(n):
            square = a[i] * a[i] + b[i] * b[i]
            over = 1.0 / square if square > 0.0 else 0.0
            x[i], y[i] = b[i] * over, -a[i] * over
    elif operation == SINE:
        for i in range(n):
            x[i] = math.cos(a[i])
    elif operation == COSINE:
        for i in range(n):
            x[i] = -math.sin(a[i])
    elif operation == TANGENT:
        for i in range(n):
            x[i] = 1.0 + value[i] * value[i]
    elif operation == POWER:
        for i in range(n):
            x[i] = b[i] * a[i] ** (b[i] - 1.0) if b[i] != 0.0 else 0.0
            y[i] = value[i] * math.log(a[i]) if a[i] > 0.0 else 0.0


@routine
def put_slopes(hull: Ints, x: Floats, X: Floats, y: Floats, Y: Floats, n: int, out: Floats) -> None:
    """Fill the slopes of a step at n rows from its derivatives x and y by two operands, whose slopes are X and Y.

    The slopes of a number are a row of n for each column; which columns the operands have is in the step's hull, as in
    `evaluate`.
    """
    x0, x1, y0, y1 = hull[2], hull[3], hull[4], hull[5]
    if y0 == y1 or (x0 == y0 and x1 == y1):
        for column in range(x0, x1):
            own, other, to = X[n * column :], Y[n * column :], out[n * column :]
            if y0 == y1:
                for i in range(n):
                    to[i] = x[i] * own[i]
            else:
                for i in range(n):
                    to[i] = x[i] * own[i] + y[i] * other[i]
    else:
        for column in range(min(x0, y0) if x0 < x1 else y0, max(x1, y1)):
            to = out[n * column :]
            for i in range(n):
                to[i] = 0.0
            if x0 <= column and column < x1:
                own = X[n * column :]
                for i in range(n):
                    to[i] += x[i] * own[i]
            if y0 <= column and column < y1:
                other = Y[n * column :]
                for i in range(n):
                    to[i] += y[i] * other[i]


@kernel
def evaluate(
    steps: Ints,
    hulls: Ints,
    outputs: Ints,
    n_values: int,
    uniform: Floats,
    varying: Floats,
    tangents: Floats,
    out: Floats,
    slopes: Floats,
) -> None:
    """Fill expressions and their slopes.

    Parameters
    ----------
    steps : (k, 5): operation, places of its operands and of its result among the values.
    hulls : (inputs + k, 6): the columns from and to which an input, or a step's result, has slopes; then those of the
        two operands by which the step has derivatives.
    outputs : (r, 3): the place of each expression among the values, the columns from and to which it has slopes.
    n_values : how many places there are.
    uniform, varying : the inputs: those that are the same at all rows, (u,), then the others, (n, v).
    tangents : slopes of the inputs (u + v, c).
    out, slopes : (n, r), (n, r, c); the second all zero.
    """
    n_uniform, n_columns, n_inputs = uniform.shape[0], tangents.shape[1], tangents.shape[0]
    width = max(1, min(BLOCK, out.shape[0]))
    V, P, D = np.empty(n_values * width), np.empty(2 * width), np.empty(n_values * n_columns * width)
    for block in range((out.shape[0] + width - 1) // width):
        start = block * width
        n = min(width, out.shape[0] - start)
        m = n * n_columns
        for k in range(n_uniform):
            row = V[k * n :]
            for i in range(n):
                row[i] = uniform[k]
        for k in range(n_inputs - n_uniform):
            row = V[(n_uniform + k) * n :]
            for i in range(n):
                row[i] = varying[start + i, k]
        for k in range(n_inputs if n_columns > 0 else 0):
            for column in range(hulls[k, 0], hulls[k, 1]):
                row = D[k * m + column * n :]
                for i in range(n):
                    row[i] = tangents[k, column]
        for k in range(steps.shape[0]):
            operation, a, b, c, to = steps[k, 0], steps[k, 1], steps[k, 2], steps[k, 3], steps[k, 4]
            put_values(operation, V[a * n :], V[b * n :], V[c * n :], n, V[to * n :])
            hull = hulls[n_inputs + k]
            if n_columns > 0 and hull[0] < hull[1]:
                put_partials(operation, V[a * n :], V[b * n :], V[to * n :], n, P, P[width:])
                x, y = (b, c) if operation == CHOOSE else (a, b)
                put_slopes(hull, P, D[x * m :], P[width:], D[y * m :], n, D[to * m :])
        for r in range(outputs.shape[0]):
            at, first, last = outputs[r, 0], outputs[r, 1], outputs[r, 2]
            for i in range(n):
                out[start + i, r] = V[at * n + i]
            for i in range(n if n_columns > 0 else 0):
                for column in range(first, last):
                    slopes[start + i, r, column] = D[at * m + column * n + i]
