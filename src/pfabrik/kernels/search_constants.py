"""Constants of what all searches share: Newton's method, projection and multistart, descent and its programmes."""

# Newton's method

NEWTON_STEP = 0.5
"""Longest step of Newton's method [rad or L]: beyond it the linear model says nothing."""

CONTRACTION = 0.5
"""Newton's method stays in the assembly mode of its start if each step is at most this share of the one before, and
none is shortened: the start is then in the ball around the solution in which there is no other (Kantorovich)."""

BELIEVED, FARTHEST_TURN, FARTHEST_OPENING = 0.25, 0.5, 0.25
"""That solution need not be the one to which the motion leads, for actuators jump while the platform stays. So the
second step is at most this share of the first, which has the slopes of the start where actuators place rods. No such
actuator goes farther than so much at once [rad or L], and none opens loops farther than so much [L or rad]."""

SINGULAR = 1e-10
"""Least pivot of the squared slopes at a start, as a share of the largest, from which on actuators lead somewhere."""

SHORTEST_SHARE = 1.0 / 8192.0
"""Shortest step of a continuation, as a share of the way: where even that does not contract, a parallel singularity, or
a limit, ends the assembly mode."""

UNBOUNDED = 2**31 - 1
"""More steps than are ever taken; an integer of a controller has 32 bits."""

MOST_STEPS = 200
"""Most steps of a descent, rejected ones included; most need a dozen."""

# Projection and multistart (`projecting`)

SAME_DISTANCE = 1e-7
"""Relative difference of distances below which two searches agree."""

ROUNDED_OFF, COARSELY = 1e-3, 2e-2
"""Share of the distance below which the price of what is held is rounded off, at its end, and in searches that first
look for the basin: the sharper the edge, the more of them end beside it."""

BESIDE = 1e-6
"""Relative difference of F by which the end of a search that first looked for the basin is taken for farther: the least
is beside it."""

MOST_ROUNDED = 0.1
"""Largest product of that share and the price: of a tenth of the distance, F is a norm still."""

TURNED = 10.0
"""Error of what is held, in units of the share, below which it is looked at whether it can be held exactly."""

WORTH = 0.25
"""By how much the distance must fall from a start to its answer before other basins are searched [L]: from an answer to
the target before, in a stream, it falls by less."""

CONTINUATION_STEPS, LONGEST_IN_MODE = 8, 0.25
"""Steps on the way to a target in the working mode of the start, and the longest single one that keeps it: a longer one
may jump over a singularity [L or rad]."""

SIGHT = 1e6
"""Largest distance of a target from home [L]: farther ones in the same direction have the same nearest pose."""

SUSPICIOUS, UNDONE, MOVED = 2.0, 0.5, 1e-6
"""Ratio of the motion of drives to that of their target above which a step may be a jump; share of it that the way back
to the target before leaves, if it is one; and least motion that is looked at [L or rad]."""

# Descent by quadratic programmes (`sqp`)

LONGEST_STEP, FIRST_DAMPING = 0.4, 0.1
"""Longest step of any unknown [rad or L], beyond which the quadratic model is not trusted; and the initial damping, as
a share of what would make the first step that long."""

REACH = 1.0
"""Limits farther away than this are left out of a programme [rad or L]: no step comes near them."""

CLOSED, NEARLY_CLOSED = 1e-13, 1e-10
"""Gaps and excesses of a feasible configuration, and of one that no step improves [rad or L]: overconstrained loops
close only as exactly as their description. The second is a tenth of the tolerance of solutions."""

OPEN = 0.01
"""Violation to which a step is corrected, as a share of its predicted reduction: a rejected step, and on joint
coordinates every step, for there a step may end where loops no longer close."""

FINE, ROUNDING = 1e-11, 1e-13
"""Shares of the objective: a step with a predicted reduction below the first need not reduce the merit, but may raise
it by no more than the second, or than it costs to close what counts as closed: rounding hides anything finer."""

LAST, NEXT, CONVERGING = 1e-18, 1e-20, 1e-2
"""Predicted reductions that end a descent, as shares of the objective: of the last step, whose length is then a
billionth of the distance; of the step that would follow. And, for fine steps, as a share of the prediction before: if
it is more, the steps are rounding."""

PROBE = 1e-6
"""Step of the differences that give the Hessian along each motion [rad or L]."""

RESTORING, CORRECTIONS = 8, 1
"""Most steps to restore feasibility; and to correct the violation of a rejected step."""

LEAST_WEIGHT = 1.0
"""Least weight of the violation in the merit, in units of the gradient: if the objective has no gradient along an
equation, its multiplier does not say how much violation is acceptable."""

SUFFICIENT, GOOD, EXACT = 1e-4, 0.5, 0.1
"""Actual reduction as a share of the predicted: least of an accepted step, and least of one that lowers the damping;
and largest relative difference of the two for which a full step lowers it much."""

LEAST_DAMPING, LARGE_DAMPING = 0.01, 0.1
"""Damping, in units of curvature: least after a rejected step; largest that an exact step divides by 100, not 10."""

HOPELESS = 8.0
"""A search is given up if its distance to the incumbent's objective exceeds the last predicted reduction by this
factor, unless damping kept the step short."""

SOLVABLE = 1e-8
"""Least damping, in units of curvature, for a programme that rounding keeps from its solution."""

MOST_DAMPING = 1e8
"""Damping, in units of curvature, that ends a search: no step, however short, is accepted."""

# Programmes (`qp`, `holding`, `free_motions`)

KEPT, ROUNDED, DEPENDENT = 1e-14, 1e-9, 1e-12
"""Violation up to which a limit counts as kept; violation that may remain when no more limit can be made active; share
of a gradient's square, orthogonal to the active gradients, below which it counts as dependent on them."""

REGULARISATION = 1e-10
"""Weight of the sum of squared multipliers in the objective: far below the squares of the limits' gradients."""

IMPLIED = 1e-6
"""Largest entry left of an equation that follows from the others: descriptions are typed with as many digits."""

LOOSE = 4.0
"""Largest entry left of such an equation where equations are not met, in units of the gap."""

FILLED = 4
"""An equation of which more than one entry in so many is not zero is taken from the others as a whole."""

SHARED = 0.01
"""Factor for pivots of unknowns that legs have in common: they would couple the legs' equations."""
