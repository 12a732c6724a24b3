"""Named dimensions of a file: what follows from them follows, they are kept, and what is wrong with them is named."""

from __future__ import annotations

import copy
import math
import pickle
from pathlib import Path

import numpy as np
import pytest

import pfabrik as pf
from pfabrik.errors import InvalidMechanism, UnknownName
from pfabrik.machine.files import dumps, loads

PENDULUM = """
schema = 1
name = "arm"
units = { length = "mm", angle = "deg" }
end_effector = "tip"
reference_point = ["upper*cos(tilt) + lower", 0, "upper*sin(tilt)"]

[dimensions]
upper = 300
lower = "upper / 2"
tilt = 30
stop = "2*tilt + atan2(1, 1)"

[[joint]]
name = "shoulder"
type = "revolute"
actuated = true
connects = ["base", "upper"]
at = [0, 0, 0]
axis = [0, -1, 0]
home = "tilt"
range = ["-stop", "stop"]

[[joint]]
name = "elbow"
type = "revolute"
actuated = true
connects = ["upper", "tip"]
at = ["upper*cos(tilt)", 0, "upper*sin(tilt)"]
axis = [0, -1, 0]
"""


def test_expressions_are_computed_in_the_units_of_the_file() -> None:
    arm = loads(PENDULUM)
    assert dict(arm.dimensions) == pytest.approx({"upper": 300, "lower": 150, "tilt": 30, "stop": 105})
    across, up = 300 * math.cos(math.pi / 6), 300 * math.sin(math.pi / 6)
    np.testing.assert_allclose(arm.joint("elbow").at, (across, 0, up), rtol=1e-15)
    np.testing.assert_allclose(arm.reference_point, (across + 150, 0, up), rtol=1e-15)
    shoulder = arm.joint("shoulder")
    assert shoulder.home == pytest.approx(math.radians(30))
    np.testing.assert_allclose(shoulder.range, np.radians([-105, 105]), rtol=1e-15)


def test_another_dimension_changes_what_follows_from_it_also_after_it_was_saved(tmp_path: Path) -> None:
    pf.save(loads(PENDULUM).with_dimensions(tilt=20), tmp_path / "arm.toml")
    assert '"upper*cos(tilt)"' in (tmp_path / "arm.toml").read_text(encoding="utf-8")
    arm = pf.load(tmp_path / "arm.toml").with_dimensions(upper=400)
    assert arm == loads(PENDULUM.replace("upper = 300", "upper = 400").replace("tilt = 30", "tilt = 20"))
    assert (arm.dimensions["lower"], arm.dimensions["tilt"]) == (200, 20)
    held = loads(PENDULUM).with_dimensions({"lower": 1}, upper=400)  # a dimension that follows may be set too
    assert held.dimensions["lower"] == 1 and held.reference_point[0] == pytest.approx(400 * math.cos(math.pi / 6) + 1)


def test_dimensions_go_with_a_machine_to_other_processes() -> None:
    for twin in (
        pickle.loads(pickle.dumps(loads(PENDULUM))),
        copy.deepcopy(loads(PENDULUM)),
        copy.copy(loads(PENDULUM)),
    ):
        assert twin.dimensions == loads(PENDULUM).dimensions
        name, value = next(iter(twin.dimensions.items()))
        assert twin.with_dimensions({name: 1.01 * value}) == loads(PENDULUM).with_dimensions({name: 1.01 * value})


def test_a_machine_changed_in_python_has_numbers_alone() -> None:
    free = loads(PENDULUM).without_limits()
    assert not free.dimensions and loads(dumps(free)) == free
    with pytest.raises(UnknownName, match="no dimension named 'upper'"):
        free.with_dimensions(upper=1)


@pytest.mark.parametrize(
    ("old", "new", "place", "words"),
    [
        ('"upper / 2"', '"uper / 2"', "dimensions.lower", "no dimension 'uper' here; did you mean 'upper'?"),
        ('"upper / 2"', '"stop / 2"', "dimensions.lower", "it comes later"),
        ('"upper / 2"', '"lower / 2"', "dimensions.lower", "it comes later"),
        ('"upper / 2"', '"upper / 0"', "dimensions.lower", "has no finite value"),
        ('"upper / 2"', '"9**9**9**9"', "dimensions.lower", "has no finite value"),
        ('"upper / 2"', '"sqr(upper)"', "dimensions.lower", "did you mean 'sqrt'?"),
        ('"upper / 2"', '"sqrt(upper, 2)"', "dimensions.lower", "sqrt of 2 arguments"),
        ('"upper / 2"', "\"__import__('os').system('x')\"", "dimensions.lower", "more than an expression may have"),
        ('"upper / 2"', '"(((upper"', "dimensions.lower", "'(((upper'"),
        ('"upper / 2"', '"1' + "+1" * 100 + '"', "dimensions.lower", "an expression of 201 characters"),
        ('"upper / 2"', "true", "dimensions.lower", "True"),
        ('"upper / 2"', "inf", "dimensions.lower", "has no finite value"),
        ("tilt = 30", '"my tilt" = 30', "dimensions.my tilt", "the name 'my tilt'"),
        ("tilt = 30", "tilt = 30\nsin = 3", "dimensions.sin", "the name 'sin'"),
        ('["-stop", "stop"]', '["-stopp", "stop"]', "joint[0].range", "did you mean 'stop'?"),
        ("[dimensions]", "[dimension]", "dimension", "did you mean 'dimensions'?"),
    ],
)
def test_what_is_wrong_is_named_at_its_place(old: str, new: str, place: str, words: str) -> None:
    with pytest.raises(InvalidMechanism) as refused:
        loads(PENDULUM.replace(old, new, 1))
    assert any(fault.place == place and words in str(fault) for fault in refused.value.faults), refused.value.faults
