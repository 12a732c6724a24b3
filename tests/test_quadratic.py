"""Quadratic programmes: solutions are checked by the conditions of Karush, Kuhn and Tucker."""

from __future__ import annotations

import numpy as np
import pytest

from pfabrik.kernels.qp import factorise, new_qp, solve_qp


def solved(H: np.ndarray, g: np.ndarray, G: np.ndarray, h: np.ndarray) -> tuple[bool, np.ndarray, np.ndarray]:
    """True if there is a solution; it, and the multipliers of its limits."""
    n, k = len(g), len(h)
    p = new_qp(n, k)
    p.H[:], p.g[:], p.G[:], p.h[:] = H, g, G, h
    assert factorise(p.H, n, 0.0, p.factor)
    is_solved = solve_qp(p, n, k)
    return is_solved, p.x[:n].copy(), p.multipliers[:k].copy()


@pytest.mark.parametrize("seed", range(20))
def test_solutions_balance_the_objective_with_limits_that_are_met(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(10):
        n, k = rng.integers(1, 9), rng.integers(0, 30)
        A = rng.normal(size=(n, n))
        H, g = A @ A.T + 0.01 * np.eye(n), 10.0 * rng.normal(size=n)
        G, h = rng.normal(size=(k, n)), -rng.uniform(0.0, 1.0, k) * (rng.random(k) < 0.9)
        if k > 5:  # two equal limits, and one that follows from two others
            G[1], h[1], G[5], h[5] = G[0], h[0], G[3] + G[4], h[3] + h[4]
        is_solved, x, multipliers = solved(H, g, G, h)
        assert is_solved  # zero keeps all limits
        excess = G @ x + h
        assert np.abs(H @ x + g + G.T @ multipliers).max() <= 1e-8
        assert excess.max(initial=0.0) <= 1e-8
        assert multipliers.min(initial=0.0) >= 0.0
        assert np.abs(multipliers * excess).max(initial=0.0) <= 1e-7


def test_contradicting_limits_have_no_solution() -> None:
    G = np.array([[1.0, 0.0], [-1.0, 0.0]])
    assert not solved(np.eye(2), np.zeros(2), G, np.array([1.0, 1.0]))[0]  # x <= -1 and x >= 1
    assert solved(np.eye(2), np.zeros(2), G, np.array([1.0, -1.0]))[0]  # x <= -1 and x >= -1


@pytest.mark.parametrize("seed", range(10))
def test_multipliers_of_a_contradiction_prove_it(seed: int) -> None:
    """Farkas: a sum of limits that no x enters, and that is exceeded."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 7))
    G = rng.normal(size=(n + 6, n))
    G[0] = -rng.uniform(0.1, 1.0, 3) @ G[1:4]
    h = rng.uniform(0.1, 1.0, n + 6)
    is_solved, _, multipliers = solved(np.eye(n), rng.normal(size=n), G, h)
    assert not is_solved
    assert multipliers.min() >= 0.0
    assert np.abs(G.T @ multipliers).max() <= 1e-6 * multipliers.sum()  # gradients so near count as dependent
    assert h @ multipliers > 0.0


def test_a_matrix_that_is_not_positive_definite_is_refused() -> None:
    p = new_qp(2, 0)
    assert not factorise(np.diag([1.0, -1.0]), 2, 0.0, p.factor)
