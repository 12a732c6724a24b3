"""What an answer lets one read: batches, points, active limits, plain data."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from pfabrik import Mechanism, Options, Solution, Status

FIELDS = ("pose", "actuators", "position_error", "rotation_error", "residual", "limit_excess", "iterations", "rounds")


@pytest.fixture(scope="module")
def stewart() -> Mechanism:
    return pf.load("stewart")


@pytest.fixture(scope="module")
def batch(stewart: Mechanism) -> Solution:
    """Rows 0 and 3 reached, row 1 no pose, rows 2, 4 and 5 out of reach; shape (2, 3)."""
    targets = np.tile(stewart.home_pose, (2, 3, 1, 1))
    targets[0, 1, 0, 0] = np.nan
    targets[0, 2, 2, 3] += 1000
    targets[1, 0, 0, 3] += 5
    targets[1, 1, 1, 3] += 1000
    targets[1, 2, 2, 3] -= 500
    return pf.solve_ik(stewart, targets, options=Options(on_invalid="mark"))


def assert_same_rows(part: Solution, whole: Solution, index: object) -> None:
    np.testing.assert_array_equal(part.status, whole.status[index])
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(part, field), getattr(whole, field)[index])
    for joint, points in whole.points.items():
        np.testing.assert_array_equal(part.points[joint], points[index])


@pytest.mark.parametrize(
    "index",
    [0, -1, slice(None), slice(1, None), (1, 2), (slice(None), 0), [1, 0, 1], np.array([[True, False, True]] * 2), ...],
)
def test_indexing_follows_numpys_rules_on_every_field(batch: Solution, index: object) -> None:
    assert_same_rows(batch[index], batch, index)


def test_a_single_answer_is_scalar(batch: Solution) -> None:
    row = batch[1][0]
    assert row.status is Status.REACHED
    assert isinstance(row.position_error, float)
    assert isinstance(row.iterations, int)
    assert row.pose.shape == (4, 4)


def test_iteration_gives_the_rows_in_order(batch: Solution) -> None:
    rows = list(batch)
    assert len(rows) == len(batch) == 2
    for i, row in enumerate(rows):
        assert_same_rows(row, batch, i)


def test_active_limits_follow_their_rows(batch: Solution) -> None:
    """One tuple a row, in row order; none for a row that is reached or no pose."""
    limits = batch.active_limits
    assert [bool(row) for row in limits] == [False, False, True, False, True, True]
    assert batch[0, 2].active_limits == limits[2]
    assert batch[1].active_limits == limits[3:]


def test_a_single_answer_has_neither_length_nor_rows_and_an_index_out_of_range_is_refused(batch: Solution) -> None:
    for use in (len, lambda answer: answer[0], list):
        with pytest.raises(TypeError):
            use(batch[0, 0])
    with pytest.raises(IndexError):
        batch[2]


def test_an_answer_is_true_where_every_row_is_reached(batch: Solution) -> None:
    assert batch[[0, 1], [0, 0]] and batch[0, 0]
    assert not any((batch, batch[1], batch[0, 1], batch[0, 2]))


def test_the_worst_status_is_the_largest(batch: Solution) -> None:
    assert Status.REACHED < Status.PROJECTED < Status.FAILED < Status.INVALID == batch.status.max()


def test_rows_that_were_no_poses_are_nan(batch: Solution) -> None:
    marked = batch[0, 1]
    assert marked.status is Status.INVALID
    for field in ("pose", "actuators", "position_error", "rotation_error", "residual", "limit_excess"):
        assert np.isnan(getattr(marked, field)).all()
    assert all(np.isnan(point).all() for point in marked.points.values())
    assert marked.iterations == marked.rounds == 0


KEYS = {"status", *FIELDS, "q", "actuator_error", "held", "certified", "jumped", "joints", "points", "active_limits"}


def test_plain_data_has_the_fields_and_is_json(batch: Solution) -> None:
    for part in (batch, batch[0], batch[0, 0], batch[0, 1], batch[0, 2], batch[:0]):
        plain = part.to_dict()
        assert set(plain) == KEYS
        assert json.loads(json.dumps(plain, allow_nan=False)) == plain


def test_plain_data_says_what_the_fields_say(batch: Solution) -> None:
    plain = batch.to_dict()
    assert plain["status"] == [["REACHED", "INVALID", "PROJECTED"], ["REACHED", "PROJECTED", "PROJECTED"]]
    assert plain["position_error"][0][1] is None
    assert plain["points"]["AL1"][0][1] == [None] * 3
    assert plain["points"]["AL1"][1][0] == [100, 20, 0]
    single = batch[0, 2].to_dict()
    assert single["status"] == "PROJECTED"
    first, limit = batch[0, 2].active_limits[0], single["active_limits"][0]
    assert limit == vars(first)


def test_the_representation_counts_what_became_of_the_rows(batch: Solution) -> None:
    assert repr(batch) == "<Solution of '6-UPS Stewart platform': 2 REACHED, 3 PROJECTED, 1 INVALID>"
    assert repr(batch[0, 0]) == "<Solution of '6-UPS Stewart platform': 1 REACHED>"
    assert repr(batch[:0]) == "<Solution of '6-UPS Stewart platform': empty>"


def test_points_are_in_the_order_of_the_joints_and_cannot_be_replaced(stewart: Mechanism, batch: Solution) -> None:
    assert list(batch.points) == [joint.name for joint in stewart.joints if joint.at is not None]
    with pytest.raises(TypeError):
        batch.points["AL1"] = 0


def test_branches_start_where_their_trunk_carries_them() -> None:
    """Arm angle and extension of the redundant machine, and the ends of its crossbars by hand."""
    machine = pf.load("nrpm")
    answer = pf.solve_ik(machine, pf.pose([30, 50, 210], rotvec=[0.1, -0.2, 0.3]))
    assert answer
    values = dict(zip(machine.actuator_names, answer.actuators, strict=True))
    assert max(abs(values[f"A{arm}"] - np.pi / 2) for arm in (1, 2, 3)) > 1e-2
    for arm in (1, 2, 3):
        hinge, slide = machine.joint(f"A{arm}"), machine.joint(f"B{arm}")
        swing = Rotation.from_rotvec((values[hinge.name] - hinge.home) * np.array(hinge.axis))
        np.testing.assert_allclose(answer.points[hinge.name], hinge.at, atol=1e-12)
        for side in "LR":
            home = np.array(machine.joint(f"C{side}{arm}").at)
            extended = home + (values[slide.name] - slide.home) * np.array(slide.axis)
            expected = hinge.at + swing.apply(extended - hinge.at)
            np.testing.assert_allclose(answer.points[f"C{side}{arm}"], expected, atol=1e-9)


@pytest.mark.parametrize("distance, named", [(0.9e-7, True), (1.1e-7, False)])
@pytest.mark.parametrize("bound", ["min", "max", "cone"])
def test_limits_are_active_up_to_the_stated_distance(
    stewart: Mechanism, bound: str, distance: float, named: bool
) -> None:
    """A limit is put at a distance (of L, or in rad) from where a projected answer happens to be."""
    answer = pf.solve_ik(stewart, np.add(stewart.reference_point, (500.0, 0, -500.0 if bound == "min" else 0)))
    assert answer.status is Status.PROJECTED
    held = {limit.joint for limit in answer.active_limits}
    if bound == "cone":
        joint = next(j for j in stewart.joints if j.cone and j.cone.fixed_to == "base" and j.name not in held)
        line = answer.points[joint.name.replace("A", "C")] - joint.at
        angle = np.arctan2(np.hypot(line[0], line[1]), line[2])
        limit = pf.Cone((0, 0, 1), angle + distance, "base")
        expected = angle + distance
    else:
        gap = distance * stewart.characteristic_length
        lengths = dict(zip(stewart.actuator_names, answer.actuators, strict=True))
        homeward = 1 if bound == "min" else -1
        free = (n for n, v in lengths.items() if n not in held and homeward * (stewart.home_coordinate(n) - v) > 0)
        joint = stewart.joint(next(free))
        expected = lengths[joint.name] - homeward * gap
        limit = (expected, 400.0) if bound == "min" else (1.0, expected)
    moved = stewart.with_limits({joint.name: limit})
    found = Solution(moved, answer._configurations, ()).active_limits
    hits = [(hit.bound, hit.limit) for hit in found if hit.joint == joint.name]
    assert hits == ([(bound, pytest.approx(expected))] if named else [])


def test_what_a_caller_does_to_targets_afterwards_changes_no_answer(stewart: Mechanism) -> None:
    target = stewart.home_pose.copy()
    target[2, 3] += 1000
    expected = pf.solve_ik(stewart, target).active_limits
    answer, path = pf.solve_ik(stewart, target), np.repeat(target[None], 3, axis=0)
    followed = pf.track(stewart, path)
    target[:], path[:] = np.eye(4), np.eye(4)
    assert answer.active_limits == expected
    assert [limit.joint for limit in followed.active_limits[0]] == [limit.joint for limit in expected]


def test_the_binding_limit_of_every_row_is_its_first_active_one(stewart: Mechanism) -> None:
    targets = np.tile(stewart.reference_point, (2, 3, 1)) + np.random.default_rng(4).normal(size=(2, 3, 3)) * 60
    targets[0, 0], targets[1, 2, 0] = stewart.reference_point, np.nan
    answer = pf.solve_ik(stewart, targets, options=pf.Options(on_invalid="mark"))
    binding, limits = answer.binding, answer.active_limits
    assert binding.shape == (2, 3) and (answer.status == Status.PROJECTED).sum() >= 3
    for record, listed in zip(binding.ravel(), limits, strict=True):
        if not listed:
            assert (record["joint"], record["bound"]) == ("", "")
            assert np.isnan([record["value"], record["limit"], record["multiplier"]]).all()
            continue
        first = listed[0]
        for field in ("joint", "bound", "coordinate", "value", "limit", "multiplier"):
            assert record[field] == getattr(first, field)
    for row in np.ndindex(2, 3):
        assert (answer[row].binding.shape, answer[row].binding.tobytes()) == ((), binding[row].tobytes())


def test_a_status_is_written_and_compares_by_its_name_and_its_number() -> None:
    status = Status.PROJECTED
    assert str(status) == f"{status}" == "PROJECTED"
    assert f"{Status.REACHED:>9}" == "  REACHED" and f"{status:d}" == "1"
    assert status == 1 and status == "PROJECTED" and status != "REACHED"
    assert {0: 1}[Status.REACHED] == 1


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many rows joint coordinates are computed of, call by call."""
    from pfabrik.engines.pose import answers

    rows: list[int] = []
    compute = answers.joint_coordinates

    def counting(*arguments: object) -> object:
        rows.append(len(arguments[2]))
        return compute(*arguments)

    monkeypatch.setattr(answers, "joint_coordinates", counting)
    return rows


@pytest.mark.parametrize("started", [False, True])
def test_joints_of_a_part_are_found_for_that_part(started: bool, counted: list[int]) -> None:
    """As many rows as were asked for; the whole once, and nothing again after it."""
    machine = pf.load("delta")
    targets = np.random.default_rng(0).uniform(-10, 10, (400, 3)) + machine.home_pose[:3, 3]
    start = pf.solve_ik(machine, targets) if started else None
    whole = pf.solve_ik(machine, targets, start=start)
    part, again = whole[100:110], whole[[5, 3, 5]]
    some, others = part.joints, again[1:].joints
    assert counted == ([10, 10, 3, 3] if started else [10, 3])
    for name, values in whole.joints.items():
        np.testing.assert_allclose(some[name], values[100:110], rtol=0, atol=1e-12)
        np.testing.assert_allclose(others[name], values[[3, 5]], rtol=0, atol=1e-12)
    assert counted[-1] == 400
    before = len(counted)
    assert whole[7].points and len(whole[:50].joints) == len(whole.joints) and whole[3].q.shape == whole.q.shape[1:]
    assert len(counted) == before


def test_joints_of_all_rows_one_by_one_are_found_about_once(counted: list[int]) -> None:
    machine = pf.load("delta")
    targets = np.random.default_rng(0).uniform(-40, 40, (300, 3)) + machine.home_pose[:3, 3]
    whole = pf.solve_ik(machine, targets)
    apart = np.array([row.q for row in whole])
    assert len(counted) < 20 and sum(counted) < 2 * len(targets)
    np.testing.assert_allclose(apart, whole.q, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", pf.catalog())
def test_what_is_shown_of_an_answer_has_no_digits_of_rounding(name: str) -> None:
    mechanism = pf.load(name)
    answer = pf.solve_fk(mechanism, [1e-3 + drive.home for drive in mechanism.drives])
    shown = [answer._repr_html_(), pf.margins(answer)._repr_html_(), str(pf.search_log(mechanism, answer.pose))]
    assert [text for text in shown if re.search(r"(?<!&lt; )(?<!< )\b\d(\.\d+)?e-(1[2-9]|[23]\d)", text)] == []
