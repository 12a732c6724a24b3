"""Why a row of an answer has no numbers: a sentence for each, empty where it has them."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..arrays import Mask

Reasons: TypeAlias = NDArray[np.object_]


def no_reasons(rows: int) -> Reasons:
    """Empty reasons, (n,)."""
    return np.full(rows, "", dtype=object)


def add_reason(reasons: Reasons, rows: Any, reason: str) -> None:
    """Give some rows this reason, by indices or a mask, unless they have one."""
    places = np.arange(len(reasons))[rows]
    reasons[places[~has_reason(reasons[places])]] = reason


def has_reason(reasons: Reasons) -> Mask:
    """Mask of the rows with a reason, (n,)."""
    return np.asarray(np.not_equal(reasons, ""), bool)


def in_shape(reasons: Reasons, shape: tuple[int, ...]) -> str | Reasons:
    """Reasons (n,) in the shape of a batch: a text for a single row."""
    return str(reasons[0]) if shape == () else reasons.reshape(shape)
