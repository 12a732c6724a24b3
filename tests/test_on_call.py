"""Kernels of the checkout's own programs: what is compiled on call answers as its Python does."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest

from pfabrik.kernels._shipped import IS_INTERPRETED
from tools.kernels import on_call

pytestmark = pytest.mark.skipif(IS_INTERPRETED, reason="nothing is compiled")


class Weights(NamedTuple):
    """What a kernel is given together."""

    values: np.ndarray
    power: float


@on_call.routine
def weighted(x: float, weight: float, power: float) -> float:
    return weight * math.sin(power * x)


@on_call.kernel
def total(weights: Weights, rows: np.ndarray, out: np.ndarray) -> int:
    table = np.zeros((2, rows.shape[1]))
    for i in range(rows.shape[0]):
        for j in range(rows.shape[1]):
            table[0, j] = weighted(rows[i, j], weights.values[j], weights.power)
            out[i] += table[0, j]
    return rows.shape[0]


def one(weights: Weights, rows: np.ndarray, out: np.ndarray, i: int) -> int:
    return total(weights, rows[i : i + 1], out[i : i + 1])


PLAIN = getattr(total, "__wrapped__", total)
WEIGHTS, ROWS = Weights(np.linspace(-1.0, 2.0, 5), 1.7), np.linspace(-2.0, 2.0, 200).reshape(40, 5)
EXPECTED = np.zeros(40)
PLAIN(WEIGHTS, ROWS, EXPECTED)


@pytest.fixture(autouse=True)
def folder(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(on_call, "KEPT", tmp_path_factory.getbasetemp() / "on_call")


def test_compiled_answers_equal_plain_ones_and_other_types_are_compiled_beside_the_first() -> None:
    read_only = ROWS.copy()
    read_only.setflags(write=False)
    for rows in (ROWS, read_only, ROWS.copy()):
        out = np.zeros(40)
        assert total(WEIGHTS, rows, out) == 40
        np.testing.assert_allclose(out, EXPECTED, rtol=1e-15, atol=1e-15)  # the sine is another library's
    assert len(total.compiled) == 2  # type: ignore[attr-defined]


def test_a_call_for_each_row_is_all_of_them() -> None:
    out = np.zeros(40)
    assert on_call.for_each(one)(WEIGHTS, ROWS, out, 40) == 40
    np.testing.assert_allclose(out, EXPECTED, rtol=1e-15, atol=1e-15)


def test_without_a_compiler_it_is_plain_python_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    out = np.zeros(40)
    monkeypatch.setenv("CC", "no-such-compiler")
    on_call.platform.cache_clear()
    with pytest.warns(RuntimeWarning, match="there is no C compiler"):
        on_call.kernel(PLAIN)(WEIGHTS, ROWS, out)
    on_call.platform.cache_clear()
    np.testing.assert_array_equal(out, EXPECTED)
