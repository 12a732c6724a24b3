"""Constants of searches on the platform's pose: nearest poses, their certificates and seeds; forward kinematics."""

# Descent (`search`, `descend_pose`)

NEAR, NEARBY, STEPS_AWAY = 0.3, 0.02, 3.0
"""Limits farther away than the first are left out of a programme [rad or L]. As steps shrink, so does this distance: to
the third number times the last step, but not below the second."""

NEAR_LINKS = 0.1
"""Pairs of links that are farther than this beyond the clearance are left out of a programme [L]."""

ARRIVED = 1e-12
"""Distance from the target that counts as none [L]."""

PROXIMAL_SCALE, PLATFORM_SCALE = 0.6, 0.5
"""Weights in the length of a step: of proximal coordinates, which `close_rods` corrects afterwards; and of the platform
if it has the only unknowns, for squared rod lengths are then quadratic in its position."""

STUCK = 0.2
"""Largest share of a gap that a restoration step leaves: at a double root Newton's method leaves a quarter."""

SHORT = 1e-6
"""Predicted reduction, as a share of the objective, after which the Hessian is reused: it changed by a thousandth."""

NEAR_INCUMBENT = 0.01
"""Distance from the incumbent below which a search is taken to end there [rad or L]."""

MISSES = 4
"""Rejected infeasible steps after which equations are solved for the platform too: near a dead point, a proximal joint
depends so steeply on the platform that the linearisation holds for a small part of the remaining way only."""

FAR_FROM_DEAD_POINT = 1e-2
"""Least singularity margin for which a joint is moved to its closed-form solution."""

STRETCHED = 1e-4
"""Difference of the two solutions of a proximal joint below which it is at a dead point, and keeps its side [L or rad].
"""

# Multistart (`nearest`, `starts`)

BENT = 1e-2
"""Displacement of a proximal joint from its dead point where a search starts [L or rad]."""

AROUND = 2.5
"""Distance from home beyond which seeds are taken along to a target [L], if carriages can displace the whole machine.
Seeds are about as far apart; if all lie on one side of a target, their searches may agree on a pose that is not the
nearest."""

NEARLY = 1e-4
"""Distance below which a projection is close enough to its target to try to reach it exactly [L]."""

HALF_DIGITS = 1e-6
"""Tolerance of closure and limits for legs at dead points, where closed forms lose half of their digits [rad or L]."""

MOST_CHOICES = 8
"""Most legs with two sides of which all combinations are tried, if the legs complete the pose together."""

AGREEMENTS, AGREEMENTS_OF_STRUTS, AGREEMENTS_OF_VALUES = 4, 3, 8
"""Searches that must end at the nearest configuration, and one more for each that ends elsewhere.

Fewer on struts that leave the platform all its freedoms: they have one solution each. More where actuators have target
values: a platform nearly has them in many poses."""

AGREEMENTS_OF_RAILS = 6
"""Agreements where rods on carriages leave the platform all its freedoms: a search may take a rod to its other side,
where it ends at the limit of another leg. With 4, 14 of 1,200 targets have a nearer pose; with 6, three."""

AGREEMENTS_OF_MANY = 8
"""Agreements with implicit joints, or where task and legs leave some of the pose open: there are many more
configurations."""

MOST_CHANGED = 64
"""Most working modes that are looked through: those that change the fewest sides."""

# Seeds (`pfabrik.engines.pose.seeds`)

SEEDS, MANY_SEEDS = 16, 32
"""Seeds at most, and with implicit joints, or pivots with two solutions: there are many more configurations."""

BEYOND, MANY_BEYOND = 8, 16
"""Seeds farther away, where components of the workspace beyond the base may be, likewise."""

DRAWS, DRAW_STEPS = 240, 30
"""Random poses that either kind is chosen from, and the steps of the search that makes each feasible."""

RADIUS, RADIUS_BEYOND, FARTHEST_ROTATION = 1.0, 2.5, 1.5
"""How far from home random poses are, and those beyond the base [L]: the mirror image of a component is twice as far
away as the base. And how far they are turned [rad]."""

ROTATION_WEIGHT = 0.2
"""Weight of a squared rotation beside a squared distance, in the distance between seeds [L^2]."""

Q_WEIGHT = 0.02
"""Weight of the squared sine of half the difference between coordinates of proximal joints, likewise [L^2]."""

SEEDS_PER_MODE, RARE_BONUS = 4, 0.2
"""Seeds of one working mode that are enough, and the distance added to configurations of a mode with fewer [L^2]: a
mode may have a small component of its own."""

JOINT_PLACES = 12
"""Places of an implicit joint, evenly over its range, from which it is solved for: a hinge has few solutions."""

# Certificate

NEARER = 1e-7
"""Relative error of the squared distance up to which the end of a search counts as nearest."""

BALANCED = 1e-7
"""Largest imbalance of the multipliers, as a share of the distance, and largest slack of an active limit [rad or L]."""

# Forward kinematics (`forward`, `forward_blocks`, `assemble_row`)

ASSEMBLED, NEARLY_ASSEMBLED = 1e-13, 1e-11
"""Largest residual of an assembled configuration, and of one that no step improves [L or rad]: with more actuators than
freedoms, or redundant constraints, equations agree only as exactly as the description."""

FORWARD_STEPS = 24
"""Most Newton steps."""

ON_THE_WAY = 1e-5
"""Largest residual of a configuration that a continuation goes on from [L or rad]."""

FARTHEST_VALUE = 1e3
"""Largest deviation from home that is solved for [L or rad]: beyond, nearby values differ by less than rounding."""

BLOCK_STEPS = 10
"""Most Newton steps; three to six are usual."""

WAY_HALVINGS = 12
"""Halvings that find the last configuration of an assembly mode on the way to values beyond."""
