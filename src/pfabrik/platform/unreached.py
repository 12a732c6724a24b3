"""Targets that legs do not reach in the working mode of the start: other modes, then the nearest feasible poses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..kernels.platform.tables import EXACTLY, IN_OTHER_ASSEMBLIES, IN_OTHER_MODES
from ..kernels.rows import OPEN, TOO_NEAR
from .rows_one_by_one import Answers, Request, answer_phases
from .tables import has_seeds


def answer_unreached(request: Request, targets: Floats, answers: Answers, places: NDArray[np.intp]) -> None:
    """Answer targets (n, 4, 4) at some places in other working modes, or by the nearest feasible poses.

    Rows may stay PENDING or UNSURE. Seeds are not computed if other modes answer all rows.
    """
    first, model = IN_OTHER_MODES, request.model
    if not (request.keep_mode or has_seeds(model)) and model.legs.has_sides:
        answer_phases(request, targets, answers, places, first, first)
        first, places = IN_OTHER_ASSEMBLIES, places[np.isin(answers.rows.status[places], (OPEN, TOO_NEAR))]
    if len(places):
        answer_phases(request, targets, answers, places, first, EXACTLY)
