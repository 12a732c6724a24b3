"""Answers as pages have them, and configurations from those of a page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...answers.margins import margins
from ...answers.solution import Solution
from ...answers.status import Status
from ...common.arrays import Floats
from ...configuration import configuration
from ...engines.pose.answers import LegAnswers, sides_at
from ...engines.pose.coordinates import joint_coordinates
from ...kinematics import Model, displacements, home_coordinates, model_of
from ...machine.decomposition.leg_table import DEAD_POINTS
from ...machine.description.mechanism import Mechanism
from ...tolerances import TOLERANCES
from .page_data import why_no_page
from .posed_drawing import other_bodies


def page_answer(solution: Solution) -> dict[str, Any]:
    """One answer as a page takes it.

    Joint coordinates are deviations from home. Legs have their branches, as the page's own answers do; where a page
    cannot answer, all bodies have their frames, with lengths in L.
    """
    mechanism, model = solution.mechanism, model_of(solution.mechanism)
    q = np.asarray(solution.q) - home_coordinates(mechanism)
    out = {
        "status": int(solution.status),
        "pose": np.asarray(solution.pose).ravel().tolist(),
        "actuators": None if solution.status >= Status.FAILED else np.asarray(solution.actuators).tolist(),
        "q": q.tolist(),
        "branch": [],
        "limits": _limits(solution),
        "errors": [float(solution.position_error), float(solution.rotation_error)],
        "jumped": bool(solution.jumped),
    }
    if why_no_page(model):
        return out | {"frames": _frames(mechanism, q)}
    return out | _legs(model, solution)


def home_answer(mechanism: Mechanism) -> dict[str, Any]:
    """Home, as a page takes it."""
    return page_answer(configuration(mechanism, home_coordinates(mechanism)))


def _legs(model: Model, solution: Solution) -> dict[str, Any]:
    """The branch of each leg, and the coordinates of proximal joints that a search found."""
    configurations = solution._configurations
    proximal = configurations.q_proximal if isinstance(configurations, LegAnswers) else None
    return {
        "branch": sides_at(model, configurations)[0].tolist(),
        "proximal": None if proximal is None else [None if np.isnan(q) else q for q in proximal[0].tolist()],
    }


def _limits(solution: Solution) -> list[dict[str, str]]:
    """The limits that hold an answer back, or that it exceeds; of one that is reached, those that it lies on."""
    if solution.status == Status.REACHED:
        on = [limit for limit, margin in margins(solution).items() if float(margin) <= TOLERANCES.active]
    else:
        on = [(limit.joint, limit.bound) for limit in solution._limits[0] if limit.bound not in DEAD_POINTS]
    return [{"joint": joint, "bound": bound} for joint, bound in on]


def _frames(mechanism: Mechanism, q: Floats) -> list[list[float]]:
    """The displacements from home of all bodies beside base and platform."""
    moved = displacements(mechanism, q[None])
    frames = []
    for body in other_bodies(mechanism):
        frame = moved[body][0].copy()
        frame[:3, 3] /= mechanism.characteristic_length
        frames.append(frame.ravel().tolist())
    return frames


def configuration_from(mechanism: Mechanism, answer: Mapping[str, Any]) -> Solution:
    """The configuration of an answer of a page, measured anew."""
    model, q = model_of(mechanism), np.array(answer.get("q") or [], float)
    if not why_no_page(model):
        poses = np.reshape(answer["pose"], (1, 4, 4)).astype(float)
        actuators, sides = (np.array([answer[name]], float) for name in ("actuators", "branch"))
        given = answer.get("proximal")
        proximal = None if given is None else np.array([given], float)
        q = joint_coordinates(model, poses, actuators, sides, None, proximal)[0]
    return configuration(mechanism, q + home_coordinates(mechanism))
