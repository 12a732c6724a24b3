"""Jacobians of chains whose joints are all driven: the screws of the joints, in time linear in their number."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Floats, Ints
from ...common.derived import derived
from ...kernels.joints.loops import BALL
from ...machine.model import Model
from ...tolerances import TOLERANCES
from .chain_tables import posed
from .serial_chain import chain_of, is_chain


def is_driven_chain(model: Model) -> bool:
    """True if a mechanism has a chain engine's chain, and every joint of it is driven."""
    return not model.has_legs and is_chain(model) and _driven_freedoms(model) is not None


def forward_of_chain(model: Model, q: Floats) -> Floats:
    """Twists per actuator rate at coordinates q (n, c), (n, 6, n_a) or (n, 3, n_a) [length, rad]; NaN where q is.

    Column k is the screw of actuator k; zero for actuators beside the chain.
    """
    driven = _driven_freedoms(model)
    assert driven is not None
    places, freedoms = driven
    n_twists, n_actuators = 3 if model.mechanism.end_effector_is_joint else 6, len(model.closure.actuated)
    forward = np.zeros((len(q), n_twists, n_actuators))
    screws = np.zeros((len(q), len(chain_of(model).lo), 6))
    posed(model, q * model.closure.scale, screws)
    screws = screws[:, freedoms, :n_twists]
    screws[..., :3] *= model.length
    screws *= model.closure.scale[model.closure.actuated[places], None]
    forward[:, :, places] = np.swapaxes(screws, 1, 2)
    forward[~np.isfinite(q).all(axis=1)] = np.nan
    return forward


def inverse_of_chain(model: Model, q: Floats) -> Floats:
    """Actuator rates per twist at coordinates q (n, c), (n, n_a, 6) or (n, n_a, 3): the Moore-Penrose inverse.

    Lengths count in units of L; directions whose singular value is that of a singular configuration are left out.
    """
    forward, scale = forward_of_chain(model, q), model.closure.scale[model.closure.actuated]
    lengths = np.ones(forward.shape[1])
    lengths[:3] = model.length
    inverse = np.full(np.swapaxes(forward, 1, 2).shape, np.nan)
    valid = np.isfinite(q).all(axis=1)
    solved = np.linalg.pinv(forward[valid] / lengths[:, None] / scale, rcond=TOLERANCES.rank)
    inverse[valid] = solved / scale[:, None] / lengths
    return inverse


@derived
def _driven_freedoms(model: Model) -> tuple[Ints, Ints] | None:
    """Places of the chain's joints among the actuators, and their freedoms; None if some joint is passive."""
    chain = chain_of(model)
    place_of = {int(column): place for place, column in enumerate(model.closure.actuated)}
    if (chain.kinds == BALL).any() or any(int(column) not in place_of for column in chain.columns):
        return None
    return np.array([place_of[int(column)] for column in chain.columns], np.int64), chain.freedoms
