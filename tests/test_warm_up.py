"""Compiling ahead: every step is told, and afterwards no question compiles anything."""

from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner

import pfabrik as pf
from pfabrik.cli import main
from pfabrik.errors import InvalidArgument
from pfabrik.kernels._shipped import COMPILES


@pytest.mark.slow
@pytest.mark.skipif(not COMPILES, reason="nothing is compiled")
def test_afterwards_nothing_is_compiled_whatever_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    from pfabrik.kernels._numba.cache import KernelCache

    told: list[tuple[str, float]] = []
    pf.warm_up(on_step=lambda what, seconds: told.append((what, seconds)))
    assert told
    assert all(what and seconds >= 0.0 for what, seconds in told)
    asked: list[object] = []
    load = KernelCache.load_overload

    def watched(self: KernelCache, signature: object, context: object) -> object:
        asked.append(signature)
        return load(self, signature, context)

    monkeypatch.setattr(KernelCache, "load_overload", watched)
    for name in pf.catalog():
        ask_everything(pf.load(name))
    assert asked == []


def ask_everything(mechanism: pf.Mechanism) -> None:
    home = pf.solve_ik(mechanism, mechanism.home_pose)
    far = pf.pose(np.multiply.outer([0.9, 2.0], mechanism.reference_point), rotvec=(0.2, 0, 0))
    for hold in ("orientation", "position", None):
        for projection in ("nearest", "centroid"):
            answers = pf.solve_ik(mechanism, far, start=home, options=pf.Options(hold=hold, projection=projection))
            assert answers.active_limits is not None
    pf.solve_ik(mechanism, far, options=pf.Options.paper())
    pf.track(mechanism, far)
    pf.solve_fk(mechanism, answers.actuators * 1.1, start=home)
    pf.travel(home)
    pf.configuration(mechanism, home.q)
    pf.closure_residual(answers)


def test_a_mechanism_is_asked_what_it_will_be_asked() -> None:
    told: list[str] = []
    pf.warm_up(pf.load("rrr"), on_step=lambda what, _: told.append(what))
    assert {"targets within reach", "targets out of reach", "forward kinematics"} <= set(told)


def test_what_is_no_mechanism_is_refused() -> None:
    with pytest.raises(InvalidArgument, match="expected a Mechanism"):
        pf.warm_up("stewart")  # type: ignore[arg-type]


@pytest.mark.skipif(COMPILES, reason="something is compiled")
def test_where_nothing_is_to_be_compiled_the_command_says_so() -> None:
    told: list[str] = []
    pf.warm_up(on_step=lambda what, _: told.append(what))
    assert told == []
    result = CliRunner().invoke(main, ["compile"])
    assert (result.exit_code, result.stdout) == (0, "nothing to compile: the kernels are here\n")


@pytest.mark.slow
@pytest.mark.skipif(not COMPILES, reason="nothing is compiled")
def test_the_command_says_each_step_with_its_seconds() -> None:
    result = CliRunner().invoke(main, ["compile"])
    assert result.exit_code == 0
    *steps, total = [line.split(" s  ") for line in result.stdout.splitlines()]
    assert total[1] == "in all"
    assert sum(float(seconds) for seconds, _ in steps) == pytest.approx(float(total[0]), abs=0.1 * len(steps))
    assert len({what for _, what in steps}) == len(steps) > 1
