"""Errors: they reach another process as they are, and say who still moves."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import pytest

from pfabrik import errors
from pfabrik.common.derived import derived
from pfabrik.errors import Fault

FAILURE = errors.InvalidArgument("x", "a", "b")
FAULT = Fault("joint[0].at", "nothing", "three numbers")
PUBLIC = [
    errors.PfabrikError("anything"),
    errors.InvalidMechanism([FAULT, FAULT], "my.toml"),
    errors.UnsupportedMechanism("m", ["one", "two"]),
    errors.ContinuumOfSolutions("m", 2),
    errors.ContinuumOfWorkingModes("m", 1, ["j4", "j6"]),
    errors.InvalidArgument("target", "a text", "numbers", rows=[3, 5]),
    errors.UnknownName("joint", "p", ["p1", "p5"]),
    errors.MissingLibrary("pictures", "matplotlib", "pip install '.[plot]'"),
    errors.MobilityWarning("the loops all but lock"),
]


def test_every_public_error_is_tried_below() -> None:
    classes = {name for name in errors.__all__ if issubclass(getattr(errors, name), Exception)}
    assert {type(error).__name__ for error in PUBLIC} == classes


@pytest.mark.parametrize("error", PUBLIC, ids=lambda error: type(error).__name__)
def test_an_error_reaches_another_process_as_it_is(error: Exception) -> None:
    for again in (pickle.loads(pickle.dumps(error)), copy.copy(error)):
        assert type(again) is type(error)
        assert str(again) == str(error)
        assert vars(again) == vars(error)


def test_a_continuum_says_what_is_given_and_what_still_moves() -> None:
    locked = "still moves with its actuators locked at these values (2 freedoms of the end effector)"
    assert locked in str(errors.ContinuumOfSolutions("m", 2))
    placed = "still moves with its end effector on the target (1 freedom of the actuators j4, j6)"
    assert placed in str(errors.ContinuumOfWorkingModes("m", 1, ["j4", "j6"]))


@pytest.mark.parametrize("name", ["a\nb", "x" * 100_000, [10**4000] * 9])
def test_what_was_found_takes_one_line_however_long_it_is(name: Any) -> None:
    for error in (errors.UnknownName("joint", name, ["p1"]), errors.InvalidArgument("name", repr(name), "a name")):
        assert "\n" not in str(error) and len(str(error)) < 500


class Kept:
    """An object that keeps what is derived from it."""


def test_a_refusal_of_a_derived_value_has_no_other_error_behind_it() -> None:
    @derived
    def refused(owner: Kept, *more: int) -> None:
        raise FAILURE

    for more in ((), (1,), (1, 2)):
        with pytest.raises(errors.InvalidArgument) as caught:
            refused(Kept(), *more)
        assert caught.value.__context__ is None and caught.value.__cause__ is None


def test_a_derived_value_of_nothing_is_kept_too() -> None:
    calls = []

    @derived
    def nothing(owner: Kept) -> None:
        calls.append(owner)

    kept = Kept()
    assert nothing(kept) is nothing(kept) is None and len(calls) == 1
