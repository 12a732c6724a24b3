"""Constants of legs in closed form: completing a pose, dead points."""

# Completing a pose (`answer`, `complete_poses`, `feasibility`)

MOST_STEPS, MOST_STEPS_IMPLICIT = 8, 16
"""Newton steps that complete a pose: one to five are usual; implicit joints need more near their singularities."""

DAMPING = 1e-12
"""Added to the diagonal of the normal equations, as a share of the largest entry: undetermined unknowns then stay
put."""

KEPT = 1e-9
"""Excess up to which a limit counts as kept [L or rad]."""

NOT_A_ROTATION, ROUNDED = 1e-6, 1e-14
"""Largest deviation from an orthonormal matrix that a target may have, and the smallest that is corrected."""

PARTS, MORE_PARTS = 4, 16
"""Steps of the continuation from the start to a target, tried where a pose completed in one step is not feasible. The
larger number is tried where the smaller did not close, and with implicit joints, which turn fast near singularities."""

LEAST_MARGIN = 1e-6
"""Sine of the angle to a dead point, or to aligned hinges, below which a solution loses half of its digits."""
