"""Codes of a controller's calls: 0, the number of the limit exceeded most, or one of these."""

from __future__ import annotations

LEG, PAIR = 1000, 10000
"""Plus the number of a leg that does not reach or close; plus that of the nearest pair of links, which is too near."""

NO_POSE, NO_ACTUATORS, OTHER_MODE, PROJECTED, BUDGET = -1, -2, -3, -4, -5
"""Not finite, or not a rotation; not finite; closed, but not in home's working mode; the nearest feasible pose; the
same, or none, when the steps were spent."""
