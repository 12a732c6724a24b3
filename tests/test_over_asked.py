"""Random machines that are asked for more than they can do: what they can do is reached, and nothing else moves."""

from __future__ import annotations

import pytest

from checks import INTERPRETED
from over_asked import random_case, wrong_of

BATCHES, SAMPLES = (1, 2) if INTERPRETED else (8, 6)


def wrong_among(seeds: range, samples: int) -> dict[int, list[str]]:
    found = {seed: wrong_of(random_case(seed, samples)) for seed in seeds}
    return {seed: wrong for seed, wrong in found.items() if wrong}


@pytest.mark.parametrize("batch", range(BATCHES))
def test_what_a_machine_can_do_is_reached_from_home_and_nothing_aside_moves(batch: int) -> None:
    """200 machines in all."""
    assert not wrong_among(range(25 * batch, 25 * batch + 25), SAMPLES)


ACROSS, OVER = (1654, 1722, 2258, 2650, 3088, 3495), (973, 3482)
"""Machines that move across the base's z axis, so that they tilt and never yaw; and such as tilt upside down."""


@pytest.mark.skipif(INTERPRETED, reason="the search takes minutes")
@pytest.mark.parametrize("seed", [*ACROSS, *OVER])
def test_a_far_target_is_found_where_the_machine_never_yaws_or_tilts_upside_down(seed: int) -> None:
    assert not wrong_of(random_case(seed, 8))


@pytest.mark.slow
@pytest.mark.campaign
def test_of_thousands_of_machines_none_misses_a_target_or_moves_what_is_aside() -> None:
    assert not wrong_among(range(1000, 4000), 8)
