"""Constants of the passes: their steps, restrictions and meetings, and the accelerated descent."""

# Passes (`passes`, `fit`, `restrict`, `meet`)

CONTENT = 1e-12
"""A branch whose wish for its first node is nearer than this to where the node is, is content: rounding [L]."""

OBLIQUE = 1e-6
"""A rail that leaves the plane of its branch by more than this sine moves the plane along."""

FIT_STEPS, FIT_DAMPING = 2, 1e-12
"""Two Gauss-Newton steps fit a trunk well enough for one pass; damped where a joint moves no branch joint."""

LARGEST_TURN, TURN_DAMPING = 0.5, 1e-9
"""A platform turns by one such step a round: at most so far [rad], and damped for points on a line, whose turn about it
is free."""

NO_LENGTH = 1e-150
"""Below this a vector has no direction; far under any length of a machine, far over the smallest normal number."""

NO_SIDE = 1e-12
"""A vector within this angle of a cone's axis, or of its opposite, has no direction across it but rounding."""

WELL_INSIDE = 1e-9
"""By so much more than a cone's cosine, a vector is inside whatever its angle is rounded to."""

LEAST_SHARE = 1e-3
"""A clamp to a cone keeps at least this share of the length, so that the direction survives."""

SWEEPS = 3
"""Several restrictions on one step are met in turn; so many sweeps settle all but pathological cones."""

UNMOVED = 1e-15
"""Sweeps over the restrictions end when one turns the step by no more than rounding, as a share of its length."""

BRACKETS, SECTIONS, GOLDEN = 12, 40, 0.6180339887498949
"""The nearest end of two parts is bracketed by so many steps over the range of the inner one, then by golden sections,
each of which leaves this share of the bracket: to a billionth of the range, for the least may be at a kink."""

# Accelerated (`accelerated`, `half_spaces`)

PASSES, HASTY, PATIENT, TAKEN_OFF = 16, 2, 5, 0.7
"""Passes of a trunk from one start; how many in a row may fail to leave this share of the excess, first and, where no
start succeeds, again."""

MARGINS, SHRINK = (0.04, 0.04, 0.0, 0.0), 0.6
"""Trunks aim this far inside limits [L], tour by tour, less by this factor from pass to pass, so that passes end; the
last tours find what is too small to have an inside."""

CAME_BACK = 1e-3
"""A trunk has come back where the next step is a smaller share of its distance from its start."""

LONGEST, LONGEST_OF_ALL = 0.8, 0.4
"""Longest steps for which half-spaces are trusted: of a trunk towards a target, of a target with all trunks [rad or
L]."""

INSIDE, OPEN, VARIED = (0.15, 0.15, 0.15, 0.35), 0.5, 3
"""Other starts of a trunk, tour by tour: this share of each joint's range from either end; where a range is open, so
far from home [rad or L]. Of more than so many joints the last rest."""

PULL, FARTHEST, WEAKER = 0.5, 0.3, 0.5
"""Targets are pulled back by this share of their distance, or by so much [L]; less where steps turn back."""

CHEAP = 5.0
"""Steps of trunks cost less than the target's by the square of this."""

WINDOW, SETTLED = 0.5, 1e-3
"""Limits that are kept by less than this [L] count for the target's step; it settles below this share of its
distance."""

LOST, LOST_ROUNDS = 1e-3, 10
"""A descent is lost where its excess stays above this [L] and does not fall to this share in so many rounds."""

PULLED = 120
"""Rounds after which a target that does not settle is pulled no more."""

CLOSING = 12
"""Rounds that close what a settled target leaves open; then chains' ends agree on their centroid."""

STIFF = 1e3
"""What it costs to miss half-spaces by a length beside the same step: those that contradict each other are missed
alike, those that do not by a millionth of the step."""

PROBE = 0.2
"""A branch of several parts that reaches is probed by this share of the window beyond its target."""

NO_RATE = 1e-6
"""A half-space that no motion answers: its rates are below this."""
