"""Constants of searches on joint coordinates: closing loops, closing them on a target, descent, assembly."""

# Closing loops (`close`)

DAMPING = 0.01
"""Damping at the start, relative to the sum of squares."""

LEAST_DAMPING, MOST_DAMPING = 1e-14, 1e6
"""Damping of the normal equations, whose entries are of order one: the least stops idle motions (a rod's own spin)
without slowing convergence; the most ends a search in which no step reduces the cost."""

FEW = 100
"""Coordinates of one group up to which the least damping exceeds the rounding errors of the factor. These grow with the
cube of the number of coordinates, as six equations leave all but six pivots to damping."""

PROGRESS = 0.9
"""Ratio of squared residuals that a step must reach to count as progress."""

# Closing on a target (`close_on_target`)

PATIENCE = 8
"""Steps in a row without progress that end a closing where a descent follows: from there that finds what is left."""

STRANGE = 0.1
"""Largest change of components that the task leaves out, beyond which a step is replaced by continuation [L or rad]."""

STARTS = 80
"""Random starts of legs that are not closed from the given start: a leg has a handful of branches."""

BRANCH_AGREEMENTS, SAME_GAP = 16.0, 1e-3
"""Starts that must end at the least gap or excess found before a leg is given up, and the relative difference below
which two count as equal. A branch found half as often has then been found too, but for one time in 600."""

NEARBY = 64
"""Random feasible configurations that are tried before random starts, the nearest to the target first."""

STEPS = 30
"""Most steps from each of these; those that converge need fewer."""

MOST_CLOSING = 100
"""Most steps that close loops: most closings need a dozen."""

# Multistart (`answer_joints`, `pfabrik.engines.joints.multistart`)

AGREEMENTS = 7.0
"""Searches that must end at the nearest configuration found before the multistart stops."""

NEAR = 2
"""Random feasible configurations, the nearest to a target out of reach, that searches start from, too: on a machine of
two arms more answers come nearer so than random closings on the target would bring."""

FEWEST_LINEARISED = 20
"""Configurations for which a search is begun: it may restore its start, and its end, in eight steps each."""

NEARLY = 1e-2
"""Distance from its target below which loops are closed once more on it, from where a descent ended [L]."""

LONG_CHAIN_STEPS = 20
"""Steps that bring a start of a long chain within its limits."""

SEED_DISTANCE, SEED_TURN = 0.5, 0.5
"""Distance [L] and rotation [rad] from home of the poses for which the first seeds are the nearest configurations."""

SEEDS, RANDOM_STARTS, RANDOM_STEPS = 8, 128, 20
"""Most seeds; random configurations that are closed to find them; about as many steps are spent on each."""

SPREAD = 0.7
"""Standard deviation of the platform's random positions about home, per coordinate [L]."""

# Bounds on operations (`pfabrik.engines.joints.effort`)

CLOSING = 5e9
"""Operations of all random starts together: a closing step takes the sum over groups of the cubed number of
coordinates. About a second; the bound matters from some 130 coordinates on."""

CONTINUATION = 1e10
"""Operations of a continuation to a target, and of each closing from the start of a search."""

DESCENDING = 4e9
"""Operations of all descents of one answer: a step takes several times the cube of the number of all coordinates."""

LIMIT_COST = 4
"""Cost of adding a limit to the active set, in squares of the number of coordinates."""

FEWEST_CLOSING = 20
"""Steps that every closing may take: those that converge need ten to fifteen, however long the chain."""

FEWEST, A_DESCENT = 4, 15
"""Fewest steps for which a descent or a continuation step is tried; and the steps that most descents need."""

# Forward kinematics (`pfabrik.engines.joints.assemble`)

ASSEMBLY_STARTS = 48
"""Random starts, if nothing else assembles and there is no start whose mode is to be kept."""

NEAR_VALUES = 1e-6
"""Actuator error below which no other seed is tried [L or rad]."""

NOISE = 1e-4
"""Actuator error that noise alone causes in readings of more actuators than freedoms [L or rad]: readings that fit this
well from a start contradict each other, and fit exactly nowhere else."""

PROJECTIONS = 12
"""Random starts of the search for the nearest feasible values, if no configuration has the target values."""

LONGEST_SEARCH = 3.0
"""Largest change of an actuator value, if the target values are too far for a search to converge [L or rad]."""

FOLDED = 0.05
"""Difference of joint coordinates up to which where a walk ends is where a descent did: to a fold, where most nearest
configurations are, it comes no nearer [L or rad]."""
