"""What arguments of several questions are checked for."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from pfabrik.checks import put_limits, require_positive
from pfabrik.errors import InvalidArgument, UnknownName

NAMES = ("A1", "A2")


@pytest.mark.parametrize("value", [2, 2.0, np.float32(2), np.int64(2), Fraction(4, 2)])
def test_positive_numbers_of_any_type_are_told_as_floats(value: Any) -> None:
    found = require_positive("rate", value)
    assert type(found) is float and found == 2.0


@pytest.mark.parametrize("value", [0, -1.0, np.nan, np.inf, True, np.True_, "2", None, 2j, [2.0], 10**400])
def test_what_is_no_positive_number_is_refused_by_name(value: Any) -> None:
    with pytest.raises(InvalidArgument, match=r"rate: found .*; expected a positive number"):
        require_positive("rate", value)


def test_limits_that_are_not_named_stay() -> None:
    limits = np.array([1.0, np.inf])
    put_limits(limits, "speed", None, NAMES)
    put_limits(limits, "speed", {"A2": 3}, NAMES)
    assert limits.tolist() == [1.0, 3.0]
    put_limits(limits, "speed", 4, NAMES)
    assert limits.tolist() == [4.0, 4.0]


def test_wrong_limits_are_named() -> None:
    with pytest.raises(UnknownName, match="A3"):
        put_limits(np.zeros(2), "speed", {"A3": 1.0}, NAMES)
    with pytest.raises(InvalidArgument, match=r"speed\['A1'\]"):
        put_limits(np.zeros(2), "speed", {"A1": 0.0}, NAMES)
