"""Measurements that do not fit: noise alone names hardly any, and what is off is named."""

from __future__ import annotations

import numpy as np
import pytest

import pfabrik as pf
from pfabrik.capabilities.calibration.linear_fit import LinearFit
from pfabrik.capabilities.calibration.measurements import Measurements


def fit(
    rng: np.random.Generator,
    rows: int,
    parameters: int,
    each: int,
    sigma: float | None,
    off: dict[int, float],
    kinds: tuple[float, ...] = (1.0,),
) -> LinearFit:
    """A linear problem at its solution: rows of `each` numbers with normal noise of 1, or of its kind; some are off."""
    of = np.repeat(np.arange(rows) % len(kinds), each)
    jacobian, noise = rng.normal(size=(rows * each, parameters)), rng.normal(size=rows * each) * np.array(kinds)[of]
    for row, far in off.items():
        noise[row * each : row * each + each] += far
    whitened = jacobian / (sigma or 1.0), noise / (sigma or 1.0)
    solved, *_ = np.linalg.lstsq(*whitened)
    groups = np.repeat(np.arange(rows), each)
    return LinearFit(whitened[0], whitened[1] - whitened[0] @ solved, groups, of, sigma is not None, 0.0)


@pytest.mark.parametrize("sigma", [None, 1.0, 0.5], ids=["unknown", "known", "too-small"])
@pytest.mark.parametrize(("rows", "each"), [(9, 1), (10, 1), (11, 1), (31, 1), (4, 3), (12, 3)])
def test_noise_alone_names_a_row_in_one_of_a_hundred_fits(rows: int, each: int, sigma: float | None) -> None:
    """Of 100 draws one is expected, and more than six by chance in one of 10,000 tests."""
    rng = np.random.default_rng([rows, each])
    named = [bool(fit(rng, rows, 6, each, sigma, {}).outliers(3)) for _ in range(100)]
    assert sum(named) <= 6


@pytest.mark.parametrize("kinds", [(1.0, 0.01), (1.0, 30.0)])
def test_a_kind_of_quantity_is_compared_with_itself(kinds: tuple[float, float]) -> None:
    rng = np.random.default_rng(3)
    assert sum(bool(fit(rng, 24, 6, 1, None, {}, kinds).outliers(3)) for _ in range(100)) <= 6
    assert (
        sum(
            [n for n, _ in fit(rng, 24, 6, 1, None, {5: 40.0 * max(kinds)}, kinds).outliers(3)] == [5]
            for _ in range(20)
        )
        >= 17
    )


@pytest.mark.parametrize("spare", [1, 2])
def test_nothing_is_said_of_fewer_than_three_spare_numbers(spare: int) -> None:
    rng = np.random.default_rng(spare)
    for sigma in (None, 1.0):
        assert not fit(rng, 6 + spare, 6, 1, sigma, {2: 1e6}).outliers(3)


@pytest.mark.parametrize("sigma", [None, 1.0], ids=["unknown", "known"])
@pytest.mark.parametrize("off", [{4: 25.0}, {4: 25.0, 11: -40.0}, {0: 20.0, 7: 20.0, 19: -20.0}])
def test_what_is_off_is_named_and_nothing_else(off: dict[int, float], sigma: float | None) -> None:
    rng = np.random.default_rng(len(off))
    right = [sorted(n for n, _ in fit(rng, 30, 6, 1, sigma, off).outliers(3)) == sorted(off) for _ in range(40)]
    assert sum(right) >= 38


def test_rows_without_a_weight_do_not_count() -> None:
    rng = np.random.default_rng(9)
    whole = fit(rng, 12, 6, 1, None, {3: 12.0})
    none = np.zeros((40, 6))
    padded = LinearFit(
        np.concatenate([whole.jacobian, none]), np.concatenate([whole.residual, none[:, 0]]),
        np.arange(52), np.zeros(52, dtype=int), False, 0.0,
    )  # fmt: skip
    np.testing.assert_allclose(padded.left_out().chances[:12], whole.left_out().chances, rtol=1e-9)


def test_a_printer_s_probe_without_an_outlier_and_with_one() -> None:
    machine = pf.load("linear_delta")
    turns = np.arange(10) * 0.2 * np.pi
    places = np.concatenate([[[0.0, 0.0, 0.0]], np.stack([40 * np.cos(turns), 40 * np.sin(turns), 0 * turns], 1)])
    places[1::2] *= 0.6
    actuators = pf.solve_ik(machine, places).actuators
    for seed in range(3):
        heights = np.random.default_rng(seed).normal(0.0, 0.01, len(places))
        quiet = pf.calibrate(machine, Measurements(actuators, height=heights), free="offsets")
        heights[7] += 0.15
        spoiled = pf.calibrate(machine, Measurements(actuators, height=heights), free="offsets")
        assert [each.name for each in spoiled.outliers] == ["row 8"]
        assert f"row 8 does not fit: off by {spoiled.outliers[0].residual:.1f} standard" in str(spoiled)
        assert spoiled.to_dict()["outliers"][0]["row"] == 7
        assert not quiet.outliers
