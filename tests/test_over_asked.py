"""Random machines that are asked for more than they can do: what they can do is reached, and nothing else moves."""

from __future__ import annotations

import os

import pytest

from over_asked import random_case, wrong_of

INTERPRETED = os.environ.get("NUMBA_DISABLE_JIT") == "1"
BATCHES, SAMPLES = (1, 2) if INTERPRETED else (8, 6)


def wrong_among(seeds: range, samples: int) -> dict[int, list[str]]:
    found = {seed: wrong_of(random_case(seed, samples)) for seed in seeds}
    return {seed: wrong for seed, wrong in found.items() if wrong}


@pytest.mark.parametrize("batch", range(BATCHES))
def test_what_a_machine_can_do_is_reached_from_home_and_nothing_aside_moves(batch: int) -> None:
    """200 machines in all; of one in some hundreds a single target is missed, none of these."""
    assert not wrong_among(range(25 * batch, 25 * batch + 25), SAMPLES)


@pytest.mark.slow
@pytest.mark.campaign
def test_of_thousands_of_machines_hardly_any_misses_a_target_and_none_moves_what_is_aside() -> None:
    wrong = wrong_among(range(1000, 4000), 8)
    assert not [seed for seed, told in wrong.items() if any("aside" in each for each in told)]
    assert len(wrong) <= 3000 * MOST_MISSED, wrong


MOST_MISSED = 0.003
"""Share of machines of which one target in eight may be missed: searches end, and some corners are narrow."""
