"""How exact answers must be: what the library promises, written down again so that both can be held to it."""

from __future__ import annotations

POSITION = 1e-9
"""Error of a pose that counts as reached, and gap of a loop that counts as closed [L]."""

ROTATION = 1e-9
"""The same for the orientation [rad]."""

LIMIT = 1e-9
"""Excess up to which a limit counts as kept [L or rad]."""

ROTATION_MATRIX = 1e-6
"""Largest deviation of R^T R from I in a target: matrices typed with 7 digits pass, scaled or sheared ones do not."""

ALIGNMENT = 1e-6
"""Sine of the angle up to which two axes count as parallel, and length [L] up to which a link has none: descriptions
are often typed with four to six digits."""

ASSEMBLED = 1e-6
"""Difference of two poses up to which they are the same assembly [L, and entries of the rotation]."""
