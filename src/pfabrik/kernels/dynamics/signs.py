"""Signs of the rates of actuators, by which dry friction acts; 0 at rest."""

from __future__ import annotations

from ...common.arrays import Floats
from .._jit import routine, search

STILL = 1e-8
"""Rate of an actuator up to which it is at rest [L/s or rad/s], and so as a share of the fastest one's: loops that are
closed to 1e-9, and rounding, leave less; a machine that moves so takes three years for its own size."""


@routine
def put_signs(rates: Floats, still: Floats, signs: Floats) -> None:
    """Fill 1, -1, or 0 at rest, of rates (n_a,) [L/s or rad/s].

    Parameters
    ----------
    still : rates up to which actuators are at rest besides, (n_a,); or none.
    """
    fastest = 1.0
    for a in range(rates.shape[0]):
        fastest = max(fastest, abs(rates[a]))
    for a in range(rates.shape[0]):
        least = max(STILL * fastest, still[a] if still.shape[0] > 0 else 0.0)
        signs[a] = 1.0 if rates[a] > least else -1.0 if rates[a] < -least else 0.0


@search
def signs_of(rates: Floats, signs: Floats) -> None:
    """Fill the signs of n rows of rates, (n, n_a)."""
    for row in range(rates.shape[0]):
        put_signs(rates[row], rates[row, :0], signs[row])
