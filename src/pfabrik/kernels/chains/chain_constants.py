"""Constants of searches for chains: reaching a target, descent, multistart."""

# Reaching a target (`reach_target`, `walk_chain`)

LONGEST_STEP = 1.0
"""Longest step of a freedom [rad or L]: beyond it the linear model says nothing."""

REACH_SWEEPS = 5
"""Most times that freedoms are set to their bounds in one step."""

REACH_DAMPING = 1e-12
"""Damping of the system, relative to the sum of its diagonal, which does not depend on the axes: the least keeps it
definite where components do not vary."""

PROGRESS = 0.9
"""Ratio of squared errors that a step must reach to count as progress."""

PATIENCE = 4
"""Steps in a row without progress that end an attempt."""

NEAR_CONE = 0.3
"""Distance from a cone within which the freedoms of its joint are turned into those along and across it [rad]."""

ALONG = 1e-9
"""Sine below which a line is straight along its cone's axis, and no direction leads in or out."""

CORRECTIONS = 8
"""Most steps of Newton's method that bring two turns back onto their cone."""

# Descent (`descend_chain`, `curvature`)

SWEEPS = 12
"""Most times that freedoms are fixed at their bounds and released in one step."""

PULL, PULLED_TURN = 0.1, 0.5
"""Distance to which a target that is nearer is pulled outwards [L], and the most that this may turn it [rad]."""

ON_BOUND = 1e-12
"""Distance from a bound at which a freedom counts as on it [rad or L]."""

FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-10, 1e4
"""Damping of the Hessian, relative to the square of the longest screw."""

LEAST_PIVOT = 1e-12
"""Pivot of a Hessian that counts as positive, relative to the same."""

SUFFICIENT, GOOD, EXACT = 0.1, 0.6, 0.1
"""Share of its predicted reduction by which a step must reduce the objective; share from which damping falls; and
relative error of the prediction below which it falls fast."""

CONVERGED, FINE, NOTHING = 1e-14, 1e-12, 1e-26
"""Change of the objective, relative to it, that ends a descent, and below which rounding hides how much a step reduces
it; and value that counts as zero [L^2]."""

RESTORING, RESTORED = 8, 1e-10
"""Most steps that restore the held components after a step, and error that they may have [L or rad]."""

HELD_WEIGHT = 100.0
"""Weight of the squares of held components in the Hessian, relative to the largest force: it changes nothing but the
definiteness of the Hessian, which counts along held components alone."""

# Multistart (`search_chain`, `pfabrik.engines.chains`)

CLOSENESS = 1e-12
"""Error of held components that ends a search [L or rad]."""

STEPS = 30
"""Most steps of an attempt to reach a target; those that converge need ten."""

NEARER = 0.25
"""The start goes before a seed that is not nearer than this share of its squared distance."""

PULLED_FROM, PULLS = 100.0, 12
"""Ratio to the least distance up to which a descent's end may become the nearest by way of a target farther out, and
most times that this is done."""

BENT = 0.25
"""How far towards a seed a start is bent, as a share of the way."""

NEARLY, DESCENTS_NEARBY = 1e-2, 120
"""Distance below which a target out of reach of a short chain is tried from more seeds [L], and how many these are."""

MET = 1e-10
"""Error up to which what is held is met [L or rad]: a tenth of what counts as reached."""

FEW = 12
"""Most joints of a chain that has few: with narrow limits these have the most local minima."""

SHORT = {"tries": 40, "descents": 60, "bends": 20, "agreements": 10}
"""Of chains of few joints: seeds from which a target is tried, and from which descents to the nearest start; starts of
descents around the start, beside itself; and descents that must end at the least distance before the others are left
out, one more for each that ended farther away before."""

LONG = {"tries": 8, "descents": 15, "bends": 0, "agreements": 4}
"""The same of longer chains, whose steps cost more and whose limits leave them fewer local minima."""

WAVES = 4
"""Waves along the chain that a smooth configuration is the sum of."""

INDEPENDENT = 3
"""Every so many seeds have independent coordinates; the others are smooth, as long chains in use are."""

REACH_OF_SLIDES = 1.0
"""Displacement that stands for the range of a slide without one [L]."""

ACROSS = 1e-3
"""Sine of the angle from which two axes differ in direction."""

MOST_BENT = 100
"""Coordinates up to which links that are stretched out on a path bend back: the check takes their cube."""
