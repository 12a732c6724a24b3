"""P-FABRIK, the paper's method: forward and backward passes on joint positions, and projection of unreached targets.

answer = pf.passes.solve(m, target)                                  # the paper's text, K = 100 and E = 0.01 mm
answer = pf.passes.solve(m, target, pf.passes.Options.extended())     # with two rules of ours
answer = pf.passes.solve(m, target, pf.passes.Options.accelerated())  # exact meetings and half-spaces
track = pf.passes.track(m, targets)                                  # each target from the answer before it
answer = pf.passes.solve_fk(m, actuators)                            # forward kinematics by passes, which is ours
steps = pf.passes.trace(m, target)                                   # every pass, to look at: steps.plot()

`solve_ik` and `track` do not use this package.
"""

from .forward_passes import solve_fk
from .pass_options import PassOptions as Options
from .solve import by_fallback, solve, track
from .trace import PassTrace as Trace
from .trace import Stage, trace

__all__ = ["Options", "Stage", "Trace", "by_fallback", "solve", "solve_fk", "trace", "track"]
