"""Wrong calls raise errors that name the argument, what was found and what was expected: one table for all verbs."""

from __future__ import annotations

import inspect
import warnings
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from machines import machine, published
from machines.published import PUBLISHED
from oracles.assembly import Planar3RPR
from pfabrik import Options
from pfabrik.errors import InvalidArgument, PfabrikError, UnknownName
from test_track import arm, turning

STEWART, FIVE_BAR, ANKLE, ARM = pf.load("stewart"), pf.load("five_bar"), pf.load("ankle_ups"), arm(None)
HOME, POINT, NAN, VALUES = STEWART.home_pose, STEWART.reference_point, float("nan"), [200.0] * 6
SAUER = published.planar_3rpr(Planar3RPR(**PUBLISHED["sauer_p2_5"]["geometry"]), PUBLISHED["sauer_p2_5"]["p"])[0]
BY_NAME = dict.fromkeys(STEWART.actuator_names, 200.0)
NO_TARGETS = [
    *(np.zeros((3, 4)), "here", [[1, 2], [3]], np.full((4, 4), np.inf), np.eye(4) * 1j, np.diag([1.0, 1, -1, 1])),
    *(np.eye(4)[[0, 1, 3, 2]], None, 5.0, [True, False, True], [1, 2]),
]
NO_SINGLE_TARGETS = [[[0, 10, 180]] * 2, [NAN, 0, 0], np.diag([1, 1, 2, 1]), "home", None, [1, 2], np.zeros((1, 4, 4))]
NO_VALUES = [
    *([200.0] * 5, [200.0] * 7, [], 200.0, [[200.0] * 5] * 2, [*VALUES[1:], NAN], [*VALUES[1:], np.inf], ["long"] * 6),
    *("home", None, [200.0 + 1j] * 6, [True] * 6, [[200.0, 200.0], [200.0]]),
]
NO_SINGLE_VALUES = [[5.0, 5.0], [5.0] * 4, [5.0, 5.0, NAN], ["a", "b", "c"], None, [[5.0] * 3]]
Case = tuple[Any, str]


def travelling(name: str, target: Any = None, **asked: Any) -> Any:
    start = pf.solve_ik(pf.load(name), pf.load(name).home_pose if target is None else target)
    return partial(pf.travel, start, **asked)


def exceeded() -> pf.Solution:
    """A configuration beyond a limit."""
    return next(mode for mode in pf.working_modes(FIVE_BAR, (0, 10, 180)) if mode.status == pf.Status.EXCEEDED)


TABLE: list[Case] = [
    # targets
    *((partial(pf.solve_ik, STEWART, target), "target") for target in NO_TARGETS),
    *((partial(pf.working_modes, FIVE_BAR, target), "target") for target in NO_SINGLE_TARGETS),
    (partial(pf.solve_ik, STEWART, {"BL1": 200.0}), "coordinates of BL1; expected a pose, or those of joints in"),
    (partial(pf.solve_ik, ANKLE, {"pivt": (0.1, 0)}), "no joint named 'pivt'; did you mean 'pivot'"),
    (partial(pf.solve_ik, ANKLE, {"pivot": (0.1, 0), "BL": 9.0}), "pivot, BL; expected .* in series .*, such as pivot"),
    (partial(pf.solve_ik, ANKLE, {}), "found coordinates of no joint"),
    (partial(pf.solve_ik, ANKLE, {"pivot": 0.1}), r"target\['pivot'\]: found shape \(\); expected finite"),
    (partial(pf.solve_ik, ANKLE, {"pivot": (0.1, 0, 0)}), r"target\['pivot'\]: found shape \(3,\)"),
    (partial(pf.solve_ik, ANKLE, {"pivot": "up"}, options=Options(on_invalid="mark")), r"target\['pivot'\]: found str"),
    # values of actuators and joints
    *((partial(pf.solve_fk, STEWART, values), "actuators") for values in NO_VALUES),
    *((partial(pf.assembly_modes, SAUER, values), "actuators") for values in NO_SINGLE_VALUES),
    (partial(pf.solve_fk, STEWART, {k: v for k, v in BY_NAME.items() if k != "BL1"}), "no value of BL1; expected one"),
    (partial(pf.solve_fk, STEWART, BY_NAME | {"BL7": 200.0}), "BL7"),
    (partial(pf.solve_fk, STEWART, BY_NAME | {"AL1": 0.0}), "AL1"),
    (partial(pf.solve_fk, STEWART, BY_NAME | {"BL1": [200.0] * 2, "BL2": VALUES[:3]}), r"shapes \(2,\), \(3,\)"),
    (partial(pf.solve_fk, STEWART, BY_NAME | {"BL1": "long"}), r"actuators\['BL1'\]: found str"),
    (partial(pf.solve_fk, STEWART, BY_NAME | {"BL1": NAN}), "not finite"),
    *((partial(pf.configuration, STEWART, q), told) for q, told in (
      ([0.0], r"found shape \(1,\); expected .* shape \(\.\.\., 36"), (0.0, r"found shape \(\)"),
      ("home", "q: found str"), ([NAN] * 36, "a number that is not finite"))),
    *((partial(pf.solve_ik, STEWART, HOME, start=q), told) for q, told in (
      ([0.0], r"start: found shape \(1,\)"), (0.0, r"start: found shape \(\)"),
      ("home", "start: found str"), ([NAN] * 36, "start.*not finite"))),
    # mechanisms and options
    (partial(pf.configuration, "stewart", [0.0]), "mechanism"),
    (partial(pf.solve_ik, "stewart", HOME), "mechanism"),
    (partial(pf.Solver, "delta"), "mechanism: found str"),
    (partial(pf.solve_ik, STEWART, HOME, options={"hold": None}), "options"),
    *((partial(Options, **wrong), "options") for wrong in (
      {"hold": "nothing"}, {"tolerance": -1}, {"tolerance": True}, {"rotation_tolerance": None})),
    *((partial(pf.passes.Options, **wrong), "options") for wrong in (
      {"hold": "nothing"}, {"method": "fast"}, {"max_iterations": 0}, {"max_rounds": True})),
    (partial(pf.solve_ik, STEWART, HOME, options=pf.passes.Options()), "options: found PassOptions; expected Options"),
    (partial(pf.passes.solve, STEWART, HOME, Options()), "options: found Options; expected PassOptions"),
    # modes
    *((partial(pf.working_modes, FIVE_BAR, (0, 0, 180), **{name: wrong}), f"{name}: found .* a whole number from")
      for name in ("most", "most_starts") for wrong in (-1, 2.5, True, "many", None)),
    *((partial(pf.assembly_modes, FIVE_BAR, (0, 0), most_starts=wrong), "most_starts: found") for wrong in (-1, True)),
    # paths
    *((partial(pf.track, STEWART, targets), "path") for targets in (HOME, POINT, np.tile(HOME, (2, 3, 1, 1)))),
    (partial(pf.track, STEWART, [POINT], options=Options(working_mode="any")), "working_mode"),
    *((partial(pf.track, ARM, turning(), **wrong), "sample_time") for wrong in (
      {"sample_time": 0.0}, {"sample_time": -1.0}, {"sample_time": np.inf}, {"sample_time": "1"}, {"sample_time": True},
      {"speed_limits": 1.0})),
    *((partial(pf.track, ARM, turning(), **wrong), "times") for wrong in (
      {"sample_time": 0.1, "times": np.arange(9.0)}, {"times": np.arange(8.0)}, {"times": -np.arange(9.0)},
      {"times": [2.0, NAN, 1.0, *range(3, 9)]}, {"times": [0.0, np.inf, *range(2, 9)]})),
    *((partial(pf.track, ARM, turning(), sample_time=0.1, speed_limits=wrong), named) for wrong, named in (
      (0.0, "speed_limits"), ([1.0, 2.0], "speed_limits"), ({"j1": NAN}, r"\['j1'\]"), ({"j3": 1.0}, "j3"))),
    # travel
    (travelling("stewart", [(0, 0, 195)] * 2), r"solution: found batch shape \(2,\)"),
    *((travelling("stewart", (0, 0, 195), **asked), named) for asked, named in (
      ({"along": (0, 0, 0)}, "along"), ({"along": [(0, 0, 1), (0, NAN, 1)]}, r"along.*rows?: 1"),
      ({"about": (0, 1)}, "about: found shape"), ({"about": 1.0}, "about: found shape"), ({"along": "up"}, "along"),
      ({"pivot": (0, 0)}, "pivot"), ({"pivot": (0, 0, np.inf)}, "pivot"))),
    (travelling("agile_eye", along=(0, 0, 1)), "along.*within the task, rotation"),
    (travelling("rps", along=[(0, 0, 1), (0, 1, 1)]), r"along.*within the task, z tilt.*rows?: 1"),
    (travelling("rps", about=[(1, 0, 0), (0, 0, 1)]), r"about.*within the task, z tilt.*rows?: 1"),
    (travelling("delta", about=(0, 0, 1)), "about.*within the task, x y z"),
    (partial(pf.travel, FIVE_BAR), "solution: found Mechanism"),
    (lambda: pf.travel(exceeded()), "solution: found an answer that is EXCEEDED"),
    # maps
    *((partial(pf.workspace, STEWART, **asked), named) for asked, named in (
      ({"resolution": 0.0}, "resolution"), ({"resolution": NAN}, "resolution"), ({"fixed": {"w": 1.0}}, "coordinate"),
      ({"fixed": {"z": np.inf}}, "fixed"), ({"fixed": 3}, "fixed"), ({"over": ["x"]}, "over"),
      ({"over": ["x", "x"]}, "over"), ({"over": ["x", "y"], "fixed": {"x": 1.0}}, "over"), ({"tilt": -1.0}, "tilt"),
      ({"tilt": 10**400}, "tilt"),
      ({"orientation": "all"}, "orientation"), ({"orientation": np.ones((3, 3))}, "orientation"),
      ({"tilt": 0.1, "orientation": "any"}, "tilt"), ({"within": {"x": (1.0, 0.0)}}, "within"),
      ({"within": {"yaw": (0.0, 1.0)}}, "coordinate"), ({"start": np.zeros(3)}, "start"))),
    # files
    *((partial(pf.export_c, STEWART, "no/such/folder/machine.c", **wrong), next(iter(wrong))) for wrong in (
      {"precision": "half"}, {"parts": ()}, {"parts": ("ik", "dynamics")}, {"parts": "ik"}, {"name": "my kins"})),
]  # fmt: skip


@pytest.mark.parametrize(("call", "named"), TABLE, ids=range(len(TABLE)))
def test_a_wrong_call_names_what_is_wrong(call: Any, named: str) -> None:
    with pytest.raises((InvalidArgument, UnknownName), match=named) as caught:
        call()
    assert isinstance(caught.value, PfabrikError) and isinstance(caught.value, (ValueError, KeyError, TypeError))
    assert not Path("no").exists()


def test_starts_that_do_not_fit_are_refused() -> None:
    other, pair = pf.solve_ik(FIVE_BAR, FIVE_BAR.home_pose), pf.solve_ik(STEWART, [POINT] * 2)
    unknown = pf.solve_ik(STEWART, [[NAN] * 3], options=Options(on_invalid="mark"))[0]
    for start in (other, pair, HOME):
        for solve, asked in ((pf.solve_ik, HOME), (pf.solve_fk, [205.0] * 6), (pf.track, [POINT])):
            with pytest.raises(InvalidArgument, match="start"):
                solve(STEWART, asked, start=start)
    with pytest.raises(InvalidArgument, match="start"):
        pf.track(STEWART, [POINT], start=unknown)
    with pytest.raises(InvalidArgument, match="start: found batch shape"):
        pf.Solver(machine("stewart"), start=pair)


GOOD = {"mechanism": STEWART, "target": HOME, "targets": [HOME], "path": [HOME], "actuators": VALUES, "values": VALUES}
GOOD |= {"solution": pf.solve_ik(STEWART, HOME), "q": pf.solve_ik(STEWART, HOME).q}
WRONG_TYPES = [
    *(None, "nonsense", object(), {"nonsense": 1.0}, np.array([object()] * 3), np.zeros((2, 5)), 1j, [None], len),
    pf.solve_ik(FIVE_BAR, FIVE_BAR.home_pose),
]
VERBS = [name for name in pf.__all__ if inspect.isfunction(getattr(pf, name)) and name not in ("animate", "view")]


@pytest.mark.parametrize("verb", VERBS)
def test_a_value_of_a_wrong_type_ends_in_one_sentence(verb: str, tmp_path: Path, monkeypatch: Any) -> None:
    """Every verb, every argument: an error of the library, or a valid answer. Files of these names are not there."""
    monkeypatch.chdir(tmp_path)
    function, parameters = getattr(pf, verb), inspect.signature(getattr(pf, verb)).parameters.values()
    named = [each for each in parameters if each.kind not in (each.VAR_KEYWORD, each.VAR_POSITIONAL)]
    usual = {each.name: GOOD.get(each.name) for each in named if each.default is each.empty}
    usual |= {"path": "file"} if "path" in usual and verb.startswith("export") else {}
    usual |= {"parts": ("limits",)} if verb == "export_c" else {}  # the least C
    for each in named:
        for wrong in WRONG_TYPES:
            if (each.name == "on_progress" and wrong is len) or (wrong is None and each.default is None):
                continue
            try:
                with warnings.catch_warnings(action="ignore"):
                    function(**(usual | {each.name: wrong}))
            except (PfabrikError, OSError) as error:
                assert "\n" not in str(error), (each.name, wrong)
