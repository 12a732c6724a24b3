"""Constants of the passes: steps, restrictions, intersections, and the accelerated projection."""

# Passes (`passes`, `fit`, `restrict`, `meet`)

CONTENT = 1e-12
"""Largest distance of a branch's base node from its target after a forward pass that counts as none: rounding [L]."""

OBLIQUE = 1e-6
"""Sine of the angle between a rail and its branch's plane from which the plane moves with the rail."""

FIT_STEPS, FIT_DAMPING = 2, 1e-12
"""Gauss-Newton steps that fit a trunk well enough for one pass; damping for joints that move no branch joint."""

LARGEST_TURN, TURN_DAMPING = 0.5, 1e-9
"""Largest turn of a platform in one round [rad]; damping for points on a line, whose turn about it is free."""

NO_LENGTH = 1e-150
"""Shorter vectors have no direction: far below any length of a machine, far above the smallest normal number."""

NO_SIDE = 1e-12
"""Within this angle of a cone's axis, or of its opposite, the direction across the axis is only rounding."""

WELL_INSIDE = 1e-9
"""Excess over a cone's cosine from which a vector is inside however its angle is rounded."""

LEAST_SHARE = 1e-3
"""A clamp to a cone keeps at least this share of the length, so that the direction survives."""

SWEEPS = 3
"""Sweeps over the restrictions of one step, met in turn: enough for all but pathological cones."""

UNMOVED = 1e-15
"""Change of a step in one sweep, as a share of its length, at which sweeps end: rounding."""

BRACKETS, SECTIONS, GOLDEN = 12, 40, 0.6180339887498949
"""Nearest end of two parts: steps that bracket it over the range of the inner joint, then golden sections, and the
share of the bracket that each leaves. They end at a billionth of the range, because the minimum may be at a kink."""

# Accelerated (`accelerated`, `half_spaces`)

PASSES, HASTY, PATIENT, TAKEN_OFF = 16, 2, 5, 0.7
"""Passes of a trunk from one start; stalled passes in a row that end them, at first and in later tours; a pass that
leaves more than the last share of the least excess is stalled."""

MARGINS, SHRINK = (0.04, 0.04, 0.0, 0.0), 0.6
"""Distance inside limits at which trunks aim [L], tour by tour, and its factor from pass to pass, so that passes end.
The last tours find regions that are too small to have an inside."""

CAME_BACK = 1e-3
"""A trunk is nearest to its start once the next step is a smaller share of its distance from there."""

LONGEST, LONGEST_OF_ALL = 0.8, 0.4
"""Longest steps for which half-spaces are trusted [rad or L]: of a trunk towards a target, and of a target with all
trunks."""

INSIDE, OPEN, VARIED = (0.15, 0.15, 0.15, 0.35), 0.5, 3
"""Seeds of a trunk: distance from the ends of each joint's range as a share of it, tour by tour; distance from home if
the range is open [rad or L]; most joints that are varied, the others stay."""

PULL, FARTHEST, WEAKER = 0.5, 0.3, 0.5
"""Pull of a pose back to its target: as a share of their distance, at most so much [L]; its factor after a reversal."""

CHEAP = 5.0
"""Steps of trunks cost less than steps of the target, by the square of this factor."""

WINDOW, SETTLED = 0.5, 1e-3
"""Limits nearer than this [L] count for the target's step; it has converged when the step is below this share of its
distance from the requested target."""

LOST, LOST_ROUNDS = 1e-3, 10
"""A projection has failed if its excess is above this [L] and stalls for so many rounds."""

PULLED = 120
"""Rounds after which a target is no longer pulled back, converged or not."""

CLOSING = 12
"""Rounds that close the remaining gaps of a converged target; then it moves to the centroid of the ends."""

STIFF = 1e3
"""Stiffness of the slack: contradicting half-spaces are exceeded alike, all others by about a millionth of the
step."""

PROBE = 0.2
"""Distance beyond the target at which a branch of several parts that reaches is probed, as a share of the window."""

NO_RATE = 1e-6
"""Norm of a row below which no unknown changes its half-space."""
