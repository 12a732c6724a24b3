"""Kernels of the checkout's own programs: what is compiled on call answers as its Python does."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest

from building import on_call
from pfabrik.kernels._shipped import IS_INTERPRETED

pytestmark = pytest.mark.skipif(IS_INTERPRETED, reason="nothing is compiled")


class Weights(NamedTuple):
    """What a kernel is given together."""

    values: np.ndarray
    power: float


@on_call.routine
def weighted(x: float, weight: float, power: float) -> float:
    return weight * math.sin(power * x)


def total(weights: Weights, rows: np.ndarray, out: np.ndarray) -> int:
    table = np.zeros((2, rows.shape[1]))
    for i in range(rows.shape[0]):
        for j in range(rows.shape[1]):
            table[0, j] = weighted(rows[i, j], weights.values[j], weights.power)
            out[i] += table[0, j]
    return rows.shape[0]


def one(weights: Weights, rows: np.ndarray, out: np.ndarray, i: int) -> int:
    return total(weights, rows[i : i + 1], out[i : i + 1])


@pytest.fixture(autouse=True)
def folder(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(on_call, "KEPT", tmp_path_factory.getbasetemp() / "on_call")


def example() -> tuple[Weights, np.ndarray]:
    rng = np.random.default_rng(0)
    return Weights(rng.normal(size=5), 1.7), rng.normal(size=(40, 5))


def test_compiled_and_plain_answers_are_equal() -> None:
    weights, rows = example()
    expected, found = np.zeros(40), np.zeros(40)
    kernel = on_call.kernel(total)
    assert total(weights, rows, expected) == kernel(weights, rows, found) == 40
    np.testing.assert_allclose(found, expected, rtol=1e-15, atol=1e-15)  # the sine is another library's
    assert len(kernel.compiled) == 1  # type: ignore[attr-defined]


def test_other_types_are_compiled_beside_the_first() -> None:
    weights, rows = example()
    kernel = on_call.kernel(total)
    expected, found = np.zeros(40), np.zeros(40)
    rows.setflags(write=False)
    kernel(weights, rows, expected)
    kernel(weights, rows.copy(), found)
    np.testing.assert_array_equal(found, expected)


def test_a_call_for_each_row_is_all_of_them() -> None:
    weights, rows = example()
    expected, found = np.zeros(40), np.zeros(40)
    total(weights, rows, expected)
    assert on_call.for_each(one)(weights, rows, found, 40) == 40
    np.testing.assert_allclose(found, expected, rtol=1e-15, atol=1e-15)


def test_without_a_compiler_it_is_plain_python_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    weights, rows = example()
    expected, found = np.zeros(40), np.zeros(40)
    total(weights, rows, expected)
    monkeypatch.setenv("CC", "no-such-compiler")
    on_call.platform.cache_clear()
    with pytest.warns(RuntimeWarning, match="there is no C compiler"):
        on_call.kernel(total)(weights, rows, found)
    on_call.platform.cache_clear()
    np.testing.assert_array_equal(found, expected)
