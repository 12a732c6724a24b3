"""What a page asks the program that serves it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from ...answers.differential import singularity
from ...answers.solution import Solution
from ...answers.status import Status
from ...answers.words import by_bound, exceeded
from ...capabilities.clearance.clearance import clearance
from ...capabilities.clearance.solid_meshes import solids_of
from ...capabilities.modes.assembly import assembly_modes
from ...capabilities.modes.working import working_modes
from ...configuration import configuration
from ...fk import solve_fk
from ...ik import solve_ik
from ...kinematics import home_coordinates, links_of, model_of
from ...machine.description.mechanism import Mechanism
from ...tolerances import TOLERANCES
from ...travel import travel
from .borders import Borders
from .distances import leg_at_dead_point, limits_left, side_of
from .page_answers import configuration_from, page_answer
from .page_data import why_no_page
from .server import Send

BARS = 6
"""Nearest limits that are told."""


class LiveQuestions:
    """Answers by the names of questions, each with its data, and a function that sends things to the page.

    Parameters
    ----------
    machine : callable
        Called with True for the machine without its limits, returns it.
    noted : callable
        Called with what a page says of itself.
    """

    def __init__(
        self, machine: Callable[[bool], Mechanism], noted: Callable[[Mechanism, dict[str, Any]], None]
    ) -> None:
        self._machine, self._noted = machine, noted
        self._searching = threading.Lock()
        self._borders: Borders | None = None
        self._asks = {"state": self._state, "ask": self._ask, "more": self._more}
        self._asks |= {"modes": self._modes, "borders": self._find_borders}

    def answer(self, name: str, asked: Any, send: Send) -> None:
        """Answer a question; what goes wrong is an answer too."""
        try:
            self._asks[name](self._machine(bool(asked.get("free"))), asked, send)
        except OSError:
            raise  # nobody reads on
        except Exception as error:
            send({"error": str(error) or type(error).__name__})

    def _state(self, mechanism: Mechanism, asked: dict[str, Any], _: Send) -> None:
        self._noted(mechanism, asked)

    def _ask(self, mechanism: Mechanism, asked: dict[str, Any], send: Send) -> None:
        """An answer for machines that a page cannot answer for: to a pose, or to actuator values."""
        self._noted(mechanism, asked)
        send(page_answer(answered(mechanism, asked)))

    def _more(self, mechanism: Mechanism, asked: dict[str, Any], send: Send) -> None:
        """What is nearest to an answer: limits, other links; where the page does not know: the reason why it is as it
        is, singularities, travel.
        """
        here = configuration_from(mechanism, asked["answer"])
        limits = limits_left(here)
        bars = [asdict(left) | {"isOn": abs(left.margin) <= TOLERANCES.active} for left in limits[:BARS]]
        send({"limits": bars, "others": max(0, len(limits) - BARS), "distance": _distance(here)})
        if asked["answer"]["status"] == Status.PROJECTED and not asked["answer"]["limits"]:
            send({"reason": answered(mechanism, asked).reason})
        if why_no_page(model_of(mechanism)):
            home = singularity(configuration(mechanism, home_coordinates(mechanism)))
            send({"singular": _measures(here), "atHome": {"serial": home.serial, "parallel": home.parallel}})
            for kind, direction in asked["directions"]:
                (reach,) = travel(here, **{kind: direction})
                stops = [{"joint": each.joint, "bound": each.bound} for each in reach.stopped_by]
                send({"reach": {"distance": float(reach.distance), "limits": stops}})

    def _modes(self, mechanism: Mechanism, asked: dict[str, Any], send: Send) -> None:
        """All "working" modes of the pose, or "assembly" modes of the actuator values."""
        kind = asked["kind"]
        modes: Sequence[Solution]
        if kind == "working":
            modes = working_modes(mechanism, np.reshape(asked["target"], (4, 4)))
        else:
            modes = assembly_modes(mechanism, asked["values"])
        beyond = [by_bound(exceeded(mode)) for mode in modes]
        words = [f"beyond {limits}" if limits else "within limits" for limits in beyond]
        send({"modes": [page_answer(mode) | {"words": each} for mode, each in zip(modes, words, strict=True)]})

    def _find_borders(self, mechanism: Mechanism, asked: dict[str, Any], send: Send) -> None:
        start = configuration_from(mechanism, asked["answer"])
        with self._searching:
            if self._borders is None or not _is_same(self._borders.start, start):
                self._borders = Borders(start)
            self._borders.send(asked["names"], send)


def answered(mechanism: Mechanism, asked: dict[str, Any]) -> Solution:
    """The answer to what a page asks for, from the answer before it."""
    before = asked.get("answer")
    here = None if before is None else configuration_from(mechanism, before)
    if asked["asked"] == "configuration" and here is not None:
        return here
    start = here.q if here is not None and here.status >= Status.FAILED else here  # an address keeps ten digits
    if asked["asked"] == "actuators":
        return solve_fk(mechanism, asked["values"], start=start)
    return solve_ik(mechanism, np.reshape(asked["target"], (4, 4)), start=start)


def _is_same(one: Solution, other: Solution) -> bool:
    return one.mechanism == other.mechanism and bool(np.array_equal(one.q, other.q))


def _measures(here: Solution) -> dict[str, Any]:
    """How near an answer is to singularities, as the page measures it where it can."""
    now = singularity(here)
    return {"serial": now.serial, "parallel": now.parallel, "leg": leg_at_dead_point(here), "side": side_of(here)}


def _distance(here: Solution) -> dict[str, Any] | None:
    """The least distance between two links, where it is, and of which; None for a machine without shapes of links."""
    mechanism = here.mechanism
    if not len(links_of(mechanism).pairs):
        return None
    measured, solids = clearance(here), solids_of(mechanism, here)
    return {
        "shapes": [number for number, solid in enumerate(solids) if solid.is_nearest],
        "ends": (np.asarray(measured.points) / mechanism.characteristic_length).tolist(),
        "distance": float(measured.distance),
        "isHeld": any(solid.is_stopped for solid in solids),
    }
