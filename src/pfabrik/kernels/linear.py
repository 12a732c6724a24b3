"""Small dense linear systems, solved in place."""

from __future__ import annotations

import math

from ..common.arrays import Floats
from ._jit import routine


@routine
def solve_spd(A: Floats, n: int, damping: float) -> bool:
    """Solve the symmetric positive definite system A[:n, :n] x = A[:n, n] by Cholesky; x replaces A[:n, n].

    `damping` times the largest diagonal entry is added to the diagonal first. False, with x zero, if the matrix is
    still not positive definite. The lower triangle of A is overwritten.
    """
    largest = 0.0
    for i in range(n):
        largest = max(largest, A[i, i])
    shift = damping * largest
    for j in range(n):
        pivot = A[j, j] + shift
        for k in range(j):
            pivot -= A[j, k] * A[j, k]
        if not pivot > 0.0:
            for i in range(n):
                A[i, n] = 0.0
            return False
        inverse = 1.0 / math.sqrt(pivot)
        A[j, j] = inverse
        for i in range(j + 1, n):
            entry = A[i, j]
            for k in range(j):
                entry -= A[i, k] * A[j, k]
            A[i, j] = entry * inverse
        entry = A[j, n]
        for k in range(j):
            entry -= A[j, k] * A[k, n]
        A[j, n] = entry * inverse
    for j in range(n - 1, -1, -1):
        entry = A[j, n]
        for k in range(j + 1, n):
            entry -= A[k, j] * A[k, n]
        A[j, n] = entry * A[j, j]
    return True


@routine
def solve_square(A: Floats, n: int) -> bool:
    """Solve A[:n, :n] x = A[:n, n] by Gaussian elimination with partial pivoting; x replaces A[:n, n].

    False if a column has no pivot. A is overwritten.
    """
    for j in range(n):
        best = j
        for i in range(j + 1, n):
            if abs(A[i, j]) > abs(A[best, j]):
                best = i
        if not abs(A[best, j]) > 0.0:
            return False
        if best != j:
            for k in range(j, n + 1):
                A[j, k], A[best, k] = A[best, k], A[j, k]
        inverse = 1.0 / A[j, j]
        for i in range(j + 1, n):
            factor = A[i, j] * inverse
            for k in range(j + 1, n + 1):
                A[i, k] -= factor * A[j, k]
    for j in range(n - 1, -1, -1):
        entry = A[j, n]
        for k in range(j + 1, n):
            entry -= A[j, k] * A[k, n]
        A[j, n] = entry / A[j, j]
    return True


@routine
def sign_of_square(A: Floats, n: int) -> int:
    """The sign of det A[:n, :n], by Gaussian elimination with partial pivoting; A is overwritten."""
    sign = 1
    for j in range(n):
        best = j
        for i in range(j + 1, n):
            if abs(A[i, j]) > abs(A[best, j]):
                best = i
        if not abs(A[best, j]) > 0.0:
            return 0
        if best != j:
            sign = -sign
            for k in range(j, n):
                A[j, k], A[best, k] = A[best, k], A[j, k]
        if A[j, j] < 0.0:
            sign = -sign
        for i in range(j + 1, n):
            factor = A[i, j] / A[j, j]
            for k in range(j + 1, n):
                A[i, k] -= factor * A[j, k]
    return sign


@routine
def least_pivot(A: Floats, n: int) -> float:
    """The least pivot of a positive semidefinite matrix A[:n, :n], as a share of its largest entry; overwrites A."""
    largest, least = 0.0, math.inf
    for i in range(n):
        largest = max(largest, A[i, i])
    for j in range(n):
        least = min(least, A[j, j])
        if not A[j, j] > 0.0:
            return 0.0
        for i in range(j + 1, n):
            factor = A[i, j] / A[j, j]
            for k in range(j + 1, n):
                A[i, k] -= factor * A[j, k]
    return least / largest
