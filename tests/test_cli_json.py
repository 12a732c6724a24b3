"""What `--json` prints is one object that any parser takes, with the numbers that the library gives."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import pfabrik as pf
from pfabrik.catalog import description
from pfabrik.cli import main


def refuse(constant: str) -> None:
    raise AssertionError(f"{constant} is no JSON")


def printed(*line: str, code: int = 0) -> dict[str, Any]:
    """The one object on stdout."""
    result = CliRunner().invoke(main, [*line, "--json"])
    assert result.exit_code == code, result.output
    found = json.loads(result.stdout, parse_constant=refuse)
    assert isinstance(found, dict)
    return found


def test_catalog_maps_names_to_descriptions() -> None:
    assert printed("catalog") == {name: description(name) for name in pf.catalog()}


@pytest.mark.parametrize("name", pf.catalog())
def test_info_gives_what_the_library_knows_with_angles_in_radians(name: str) -> None:
    mechanism, found = pf.load(name), printed("info", name)
    assert found["actuators"] == list(mechanism.actuator_names)
    assert found["coordinates"] == list(mechanism.coordinate_names)
    assert found["task"] == list(mechanism.task)
    assert found["mobility"]["platform"] == pf.mobility(mechanism).platform
    assert found["mobility"]["redundancy"] == pf.mobility(mechanism).redundancy
    assert [chain["notation"] for chain in found["sub_chains"]] == [str(chain) for chain in pf.decompose(mechanism)]
    assert {chain["engine"] for chain in found["sub_chains"]} <= {"reaching", "closure", "chains", "legs"}
    for shown, joint in zip(found["joints"], mechanism.joints, strict=True):
        assert (shown["name"], shown["type"], shown["actuated"]) == (joint.name, joint.type, joint.actuated)
        assert np.ravel(shown["home"]) == pytest.approx(np.ravel(mechanism.home_coordinate(joint.name)))
        assert np.ravel(shown["range"] or ()) == pytest.approx(np.ravel(joint.range or ()))
        assert (shown["cone"] or {}).get("half_angle") == (joint.cone.half_angle if joint.cone else None)


def test_check_counts_what_it_found_sound() -> None:
    found = printed("check", "five_bar")
    assert (found["ok"], found["joints"], found["actuators"], found["sub_chains"]) == (True, 5, 2, 2)
    assert found["notes"] == []


def test_check_notes_what_may_not_be_meant(tmp_path: Path) -> None:
    text = (Path(pf.__file__).parent / "catalog" / "rps.toml").read_text(encoding="utf-8")
    whole = tmp_path / "whole.toml"
    whole.write_text("\n".join(line for line in text.splitlines() if not line.startswith("task")), encoding="utf-8")
    (note,) = printed("check", str(whole))["notes"]
    assert "asks for 6 coordinates" in note


def test_check_lists_every_fault(tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    pf.save(pf.load("five_bar"), path)
    path.write_text(path.read_text(encoding="utf-8").replace('"revolute"', '"revolving"'), encoding="utf-8")
    with pytest.raises(pf.errors.InvalidMechanism) as raised:
        pf.load(path)
    found = printed("check", str(path), code=2)
    assert not found["ok"]
    assert [(each["place"], each["found"]) for each in found["faults"]] == [
        (fault.place, fault.found) for fault in raised.value.faults
    ]
    assert len(found["faults"]) == 5


def test_travel_gives_distances_in_radians_and_null_where_nothing_stops_it() -> None:
    here = pf.solve_ik(pf.load("stewart"), (0, 20, 200))
    found = printed("travel", "stewart", "--position", "0", "20", "200")
    assert [each["distance"] for each in found["travel"]] == pytest.approx(pf.travel(here).distances)
    assert {each["kind"] for each in found["travel"]} == {"along", "about"}
    assert found["from"] == here.pose.tolist()


def test_ik_and_fk_give_the_fields_of_a_solution() -> None:
    mechanism = pf.load("five_bar")
    answer = pf.solve_ik(mechanism, (0, 10, 180))
    assert printed("ik", "five_bar", "--position", "0", "10", "180") == json.loads(json.dumps(answer.to_dict()))
    far = printed("ik", "five_bar", "--position", "0", "10", "900", code=1)
    assert far.pop("reason") == pf.solve_ik(mechanism, (0, 10, 900)).reason != ""
    assert set(far) == set(answer.to_dict())
    degrees = [str(value) for value in np.degrees(answer.actuators)]
    back = printed("fk", "five_bar", *degrees)
    assert back["status"] == "REACHED"
    assert np.array(back["pose"]) == pytest.approx(answer.pose, abs=1e-9)
    assert set(back) == set(answer.to_dict())


def test_time_and_speed_are_objects_with_what_the_library_tells(tmp_path: Path) -> None:
    mechanism = pf.load("linear_delta")
    at = pf.solve_ik(mechanism, mechanism.reference_point)
    told = printed("speed", "linear_delta", "--position", *map(str, mechanism.reference_point), "--speed", "300")
    assert [each["speed"] for each in told["speeds"]] == [each.speed for each in pf.platform_speed(at, speed=300.0)]
    path = tmp_path / "path.csv"
    path.write_text("x,y,z\n0,0,5\n1,0,5\n", encoding="utf-8")
    assert set(printed("time", "linear_delta", str(path), "--speed", "300")) == {"duration", "samples", "held_back"}
