"""Forward kinematics: from actuator values to a configuration that has them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from .answers.solution import Solution
from .answers.start_configuration import Start, start_of
from .common.arguments import as_floats
from .common.arrays import Floats, Mask
from .common.checks import require_each
from .engines.engine import engine_of
from .engines.joints.assemble import forward_answers
from .engines.joints.close import measure_configurations
from .engines.joints.configurations import Configurations
from .errors import InvalidArgument
from .kernels.rows import ACTUATOR_ERROR, PROJECTED, REACHED
from .machine.description.mechanism import Mechanism, checked_mechanism
from .machine.model import model_of
from .options import Options, checked_options
from .tolerances import TOLERANCES

Actuators: TypeAlias = ArrayLike | Mapping[str, ArrayLike]
"""Actuated coordinates (..., n_a) in the order of `mechanism.actuator_names`, or joint name -> values (...,)."""

HORIZON = 1e100
"""Largest actuator value that searches use [length or rad]; larger ones are clipped, so that squares stay finite."""


def solve_fk(
    mechanism: Mechanism, actuators: Actuators, *, start: Start | None = None, options: Options | None = None
) -> Solution:
    """The pose of the end effector, and all joints, at given actuator values.

    Newton's method closes the loops from the start with the actuators locked. If its steps do not contract, the
    actuators move to their values in steps of which each does. So the answer is in the assembly mode of the start. With
    `working_mode="any"` other starts follow. `assembly_modes` finds all assembly modes.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    actuators : array (..., n_a) or mapping of str to array
        Actuated coordinates in the order of `mechanism.actuator_names` [length or rad]; or joint name -> its values
        (...), for every actuator.
    start : Solution or array (..., nq), optional
        A Solution or joint vector q to start from, single or one for each row. Default: home.
    options : Options, optional
        Of these, `working_mode`, `actuator_tolerance` and `on_invalid` count.

    Returns
    -------
    Solution
        REACHED, assembled at these values within every limit; or PROJECTED, where no such configuration is found: a
        feasible one whose actuators are as near as a local search brings them, by least squares (lengths relative to L,
        angles in rad). `actuator_error` is the largest difference; more actuators than freedoms disagree by as much.
        FAILED where not even that is found: pose and residual are those of the attempt.

    Raises
    ------
    InvalidArgument
        Values of the wrong shape or, unless marked, not finite; a start that does not fit.
    """
    options = checked_options(options)
    values, shape = as_values(mechanism, actuators)
    begin = start_of(mechanism, start, shape)
    forward = partial(engine_of(mechanism).forward, keep_mode=options.working_mode != "any")
    if shape == () and np.vdot(values, values) <= HORIZON**2:  # one row of numbers, with nothing to set aside
        solutions = forward(values, begin, options.actuator_tolerance)
        return Solution(mechanism, solutions, shape, values=values if solutions.rows.status[0] != REACHED else None)
    is_valid = finite_rows(values, shape, options)
    starts = begin if begin is None or len(begin) == 1 else begin.at(np.flatnonzero(is_valid))
    clipped = np.clip(values[is_valid], -HORIZON, HORIZON)
    solutions = forward(clipped, starts, options.actuator_tolerance)
    count_clipped(solutions, clipped, values[is_valid])
    return Solution(mechanism, solutions.scatter(is_valid), shape, values=values.copy())


def count_clipped(solutions: Configurations, clipped: Floats, values: Floats) -> None:
    """Count what was clipped of actuated values (n, n_a) among the errors of answers, which are then not REACHED."""
    rows, beyond = solutions.rows, np.abs(clipped - values).max(axis=1)
    rows.status[(beyond > 0.0) & (rows.status == REACHED)] = PROJECTED
    rows.measures[:, ACTUATOR_ERROR] = np.maximum(rows.measures[:, ACTUATOR_ERROR], beyond)


def finite_rows(values: Floats, shape: tuple[int, ...], options: Options) -> Mask:
    """Rows of actuated values (n, n_a) that are finite, (n,); InvalidArgument for others, unless they are marked."""
    is_valid = np.asarray(np.isfinite(values).all(axis=1))
    if options.on_invalid == "raise" and not is_valid.all():
        bad = np.flatnonzero(~is_valid)[:5].tolist() if shape else ()
        raise InvalidArgument("actuators", "a value that is not finite", "finite values", rows=bad)
    return is_valid


def solution_at(mechanism: Mechanism, coordinates: Floats, values: Floats) -> Solution:
    """The answer to actuated values (n, n_a) at given joint coordinates (n, columns): measured, not changed."""
    closing = measure_configurations(model_of(mechanism), coordinates)
    configurations = engine_of(mechanism).as_configurations(closing)
    solutions = forward_answers(model_of(mechanism).closure, configurations, closing, values, TOLERANCES.position)
    return Solution(mechanism, solutions, (len(values),))


def as_values(mechanism: Mechanism, actuators: Actuators) -> tuple[Floats, tuple[int, ...]]:
    """Actuated values (n, n_a), and the batch shape they came in."""
    names = checked_mechanism(mechanism).actuator_names
    expected = f"shape (..., {len(names)}): {', '.join(names)}"
    if isinstance(actuators, Mapping):
        actuators = _by_name(names, actuators)
    array = as_floats("actuators", actuators, expected)
    if array.shape[-1:] != (len(names),):
        raise InvalidArgument("actuators", f"shape {array.shape}", expected)
    return array.reshape(-1, len(names)), array.shape[:-1]


def _by_name(names: Sequence[str], actuators: Mapping[str, ArrayLike]) -> Floats:
    """Actuated values (..., n_a) from a mapping that has every actuator, with shapes that broadcast."""
    require_each("actuators", actuators, names)
    values = [as_floats(f"actuators['{name}']", actuators[name], "values of shape (...)") for name in names]
    try:
        return np.stack(np.broadcast_arrays(*values), axis=-1)
    except ValueError:
        found = f"shapes {', '.join(str(value.shape) for value in values)}"
        raise InvalidArgument("actuators", found, "shapes that agree") from None
