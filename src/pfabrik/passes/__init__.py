"""P-FABRIK, the paper's method: forward and backward passes on joint positions, and projection of unreached targets.

answer = pf.passes.solve(m, target)                                  # the paper's text, K = 100 and E = 1e-2
answer = pf.passes.solve(m, target, pf.passes.Options.accelerated())  # exact meetings and half-spaces
track = pf.passes.track(m, targets)                                  # each target from the answer before it

`solve_ik` and `track` do not use this package.
"""

from .pass_options import PassOptions as Options
from .solve import solve, track

__all__ = ["Options", "solve", "track"]
