"""Numbers as a person would have written them: what sums of a file's short numbers are, but for their rounding."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...common.arrays import Floats
from ...machine.description.joints import Joint

NOISE = 1e-15
"""Rounding of a few sums and products, over the size of what is summed."""

LONGEST = 12
"""Most significant digits of a short number: one of more is taken as meant to the last."""


def shortened(values: ArrayLike, size: float) -> Floats:
    """Numbers (...), each as the short one beside it, or 0, if rounding alone is between: 0.34 for 0.33999999999999997.

    Parameters
    ----------
    size : of what the numbers are sums of.
    """
    given = np.asarray(values, dtype=float)
    short = np.array([float(f"{value:.{LONGEST}g}") for value in given.ravel()]).reshape(given.shape)
    short[np.abs(given) <= NOISE * size] = 0.0
    noise = NOISE * np.maximum(size, np.abs(given))
    return np.where(np.abs(short - given) <= noise, short, given) + 0.0


def short_joint(joint: Joint, size: float) -> Joint:
    """A joint with short numbers where they are within rounding.

    Parameters
    ----------
    size : of the machine [length].
    """
    sizes = {"at": size, "axis": 1.0, "axes": 1.0, "home": 0.0, "range": 0.0}
    said = {key: getattr(joint, key) for key in sizes}
    changes: dict[str, Any] = {key: shortened(value, sizes[key]) for key, value in said.items() if value is not None}
    return dataclasses.replace(joint, **changes)
