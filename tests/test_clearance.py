"""Links are as far apart as other programs say, and what says how thick they are is checked."""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import INTERPRETED, actuator_units
from in_mujoco import Model, mujoco
from links import by_cases, distances_of_struts, struts, thick_hexaglide
from oracles import targets_about
from pfabrik.answers.active_limits import ActiveLimit, binding_limits
from pfabrik.cli import main
from pfabrik.errors import InvalidArgument, InvalidMechanism, UnsupportedMechanism
from pfabrik.exchange.interop import qpos as mjcf_qpos
from pfabrik.exchange.interop import to_mjcf
from pfabrik.kernels.clearance.capsules import capsule_clearance
from pfabrik.kernels.clearance.least_clearance import least_clearance
from pfabrik.kernels.clearance.solids import BOX, CAPSULE, DISC
from pfabrik.machine.files import loads
from pfabrik.machine.files.units import metres_of
from pfabrik.machine.files.writing import dumps
from pfabrik.view.skeleton import skeleton_of
from slopes import beside, slopes

Array = NDArray[np.float64]
ROWS = 500 if INTERPRETED else 20_000
SLOW = pytest.mark.compiled if INTERPRETED else ()
KINDS = ("capsule", "box", "disc")
DELTA = (Path(pf.__file__).parent / "machine" / "catalog" / "delta.toml").read_text()


def around(machine: pf.Mechanism, count: int, shift: float, turn: float) -> pf.Solution:
    """Answers at poses near home [L and rad]."""
    return pf.solve_ik(machine, targets_about(machine, np.random.default_rng(3), count, shift, turn))


def refused(make: Callable[[], object]) -> list[str]:
    with pytest.raises(InvalidMechanism) as caught:
        make()
    return [str(fault) for fault in caught.value.faults]


# Segments


def random_segments(rng: np.random.Generator, count: int) -> Array:
    """Pairs of segments, (count, 4, 3): any; almost parallel; parallel; points; crossing; with an end in common."""
    ends = rng.normal(size=(count, 4, 3))
    kind = np.arange(count) % 6
    d = ends[:, 1] - ends[:, 0]
    tilt = 10.0 ** rng.uniform(-16, -2, (count, 1)) * rng.normal(size=(count, 3))
    ends[kind == 1, 3] = (ends[:, 2] + d * rng.uniform(-2, 2, (count, 1)) + tilt)[kind == 1]
    ends[kind == 2, 3] = (ends[:, 2] + 0.5 * d)[kind == 2]
    ends[kind == 3, 3] = ends[kind == 3, 2]
    middle = ends[:, 0] + rng.uniform(0, 1, (count, 1)) * d
    ends[kind == 4, 3] = (2.0 * middle - ends[:, 2])[kind == 4]
    ends[kind == 5, 2] = ends[kind == 5, 1]
    return ends


def test_segments_are_as_far_apart_as_the_cases_of_their_quadratic_programme_say() -> None:
    ends = random_segments(np.random.default_rng(0), ROWS)
    found, nearest = np.full(ROWS, np.inf), np.full(ROWS, -1.0)
    by_shape = np.ascontiguousarray(ends.reshape(ROWS, 2, 6).transpose(1, 2, 0))
    capsule_clearance(np.zeros(2), by_shape, np.array([[0, 1]]), found, nearest)
    np.testing.assert_allclose(
        found, by_cases(ends), rtol=0, atol=1e-12 if np.finfo(np.longdouble).nmant > 60 else 1e-9
    )
    assert (nearest == 0).all()


# Solids


def random_solid(rng: np.random.Generator, kind: str, on_a_grid: bool) -> tuple[Array, Array]:
    """Sizes and place of a core; on a grid edges are parallel, faces in one plane, and middles in one place."""
    sizes, place = np.zeros(5), np.zeros((4, 3))
    sizes[0] = {"capsule": CAPSULE, "box": BOX, "disc": DISC}[kind]
    place[0], to, half = 1.2 * rng.normal(size=3), rng.normal(size=3), rng.uniform(0.2, 0.9, 3)
    turn = Rotation.random(random_state=rng)
    if on_a_grid:
        place[0], to, half = np.round(place[0]), 0.5 * np.round(2.0 * to), 0.25 * np.ceil(4.0 * half)
        turn = Rotation.from_euler("xyz", 90.0 * rng.integers(4, size=3), degrees=True)
    if kind == "capsule":
        place[1] = place[0] + to
    else:
        sizes[2:], place[1:] = half, turn.as_matrix()
    return sizes, place


def moved(solid: tuple[Array, Array], shift: Array) -> tuple[Array, Array]:
    place = solid[1].copy()
    place[: 2 if solid[0][0] == CAPSULE else 1] += shift
    return solid[0], place


def inside(solid: tuple[Array, Array], x: Array) -> Array:
    """The nearest point of a core, written down once more."""
    sizes, place = solid
    offset = x - place[0]
    if sizes[0] == CAPSULE:
        d = place[1] - place[0]
        return place[0] + np.clip(offset @ d / max(float(d @ d), 1e-300), 0, 1) * d
    if sizes[0] == BOX:
        return place[0] + np.clip(offset @ place[1:].T, -sizes[2:], sizes[2:]) @ place[1:]
    height = offset @ place[1]
    flat = offset - height * place[1]
    flat *= min(1.0, sizes[2] / max(float(np.linalg.norm(flat)), 1e-300))
    return place[0] + flat + np.clip(height, -sizes[3], sizes[3]) * place[1]


def farthest(solid: tuple[Array, Array], n: Array) -> float:
    """The largest coordinate of a core along each of some directions, (k, 3)."""
    sizes, place = solid
    if sizes[0] == CAPSULE:
        return np.maximum(n @ place[0], n @ place[1])  # type: ignore[no-any-return]
    if sizes[0] == BOX:
        return n @ place[0] + np.abs(n @ place[1:].T) @ sizes[2:]  # type: ignore[no-any-return]
    flat = np.linalg.norm(np.cross(n, place[1]), axis=-1)
    return n @ place[0] + sizes[2] * flat + sizes[3] * np.abs(n @ place[1])  # type: ignore[no-any-return]


def way_out(one: tuple[Array, Array], other: tuple[Array, Array], n: Array) -> Array:
    """How far the other has to go along directions (k, 3) until both are apart."""
    return np.asarray(farthest(one, n) + farthest(other, -n))


def measured(one: tuple[Array, Array], other: tuple[Array, Array]) -> tuple[float, Array]:
    clearance, nearest, points = np.full(1, np.inf), np.full(1, -1), np.empty((1, 2, 3))
    sizes, places = np.stack([one[0], other[0]]), np.stack([one[1], other[1]])[None]
    least_clearance(sizes, places, np.array([[0, 1]]), 0, clearance, nearest, points)
    return float(clearance[0]), points[0]


@pytest.mark.parametrize("count", [6 if INTERPRETED else 60, pytest.param(12_000, marks=pytest.mark.campaign)])
@pytest.mark.parametrize(("first", "second"), list(itertools.combinations_with_replacement(KINDS, 2)))
def test_solids_are_as_far_apart_as_separating_planes_say_and_as_deep_as_the_shortest_way_out(
    first: str, second: str, count: int
) -> None:
    rng, n_apart, n_deep = np.random.default_rng(4), 0, 0
    directions = np.concatenate([rng.normal(size=(500, 3)), np.eye(3), -np.eye(3)])
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    for k in range(count):
        one, other = random_solid(rng, first, k % 2 == 0), random_solid(rng, second, k % 2 == 0)
        distance, points = measured(one, other)
        if distance > 1e-6:
            n_apart += 1
            # A plane square to the line between the two points parts the cores: so none of their points are nearer.
            n = (points[1] - points[0]) / distance
            assert -farthest(other, -n) - farthest(one, n) == pytest.approx(distance, abs=1e-9)
            assert np.linalg.norm(inside(one, points[0]) - points[0]) < 1e-12
            assert np.linalg.norm(inside(other, points[1]) - points[1]) < 1e-12
            # Moved until they nearly touch; beside corners none is deep.
            for gap in (1e-3, 1e-9, 1e-12, 0.0, *([-1e-9] * (not first == second == "capsule"))):
                there, _ = measured(one, moved(other, -(distance - gap) * n))
                assert gap - 1e-9 <= there <= max(gap, 0.0) + 1e-9
        middles = [each[1][:2].mean(axis=0) if each[0][0] == CAPSULE else each[1][0] for each in (one, other)]
        other = moved(other, middles[0] - middles[1] + (0.1 * rng.normal(size=3) if k % 4 else 0.0))
        clearance, points = measured(one, other)
        if clearance > 0.0:
            assert "capsule" in (first, second)
            continue
        assert -clearance <= way_out(one, other, directions).min() + 1e-9
        assert np.linalg.norm(points[1] - points[0]) == pytest.approx(-clearance, abs=1e-9)
        if clearance < -1e-6:  # so far along this line they touch: no less is enough
            n_deep += 1
            n = (points[0] - points[1]) / -clearance
            assert way_out(one, other, n[None])[0] == pytest.approx(-clearance, abs=1e-9)
    assert n_apart and (n_deep or first == second == "capsule")


# Machines


def test_struts_are_as_far_apart_as_their_axes_less_their_thickness() -> None:
    """All pairs, as margins beyond a clearance, and the nearest of them, with its points."""
    machine = struts(clearance=2.0)
    answers = around(machine, 20 if INTERPRETED else 200, 0.2, 0.2)
    found, margins, expected = pf.clearance(answers), pf.margins(answers), distances_of_struts(answers.pose)
    assert {name for name, bound in margins if bound == "clearance"} == set(expected)
    for name, distance in expected.items():
        room = (distance - 2.0) / machine.characteristic_length
        np.testing.assert_allclose(margins[name, "clearance"], room, atol=1e-9)
    np.testing.assert_allclose(found.distance, np.min(list(expected.values()), axis=0), atol=1e-9)
    named = [expected["–".join(sorted(links))][row] for row, links in enumerate(np.asarray(found.links).tolist())]
    np.testing.assert_allclose(named, found.distance, atol=1e-9)
    gaps = np.linalg.norm(found.points[:, 1] - found.points[:, 0], axis=-1)
    np.testing.assert_allclose(gaps, np.abs(found.distance), atol=1e-9)
    assert not [limit for limit in pf.margins(around(struts(), 2, 0.1, 0.2)) if limit[1] == "clearance"]


def test_one_answer_has_one_distance_and_the_same_as_in_a_batch_and_invalid_rows_none() -> None:
    machine = struts()
    targets = np.stack([machine.home_pose, np.full((4, 4), np.nan), machine.home_pose])
    targets[2, 0, 3] += 20.0
    answers = pf.solve_ik(machine, targets, options=pf.Options(on_invalid="mark"))
    found, one = pf.clearance(answers), pf.clearance(answers[2])
    assert isinstance(one.distance, float) and one.distance == np.asarray(found.distance)[2]
    assert one.links == tuple(np.asarray(found.links)[2]) and f"'{one.links[0]}'" in repr(one)
    np.testing.assert_array_equal(one.points, found.points[2])
    assert np.isnan(np.asarray(found.distance)).tolist() == [False, True, False] and np.isnan(found.points[1]).all()
    assert np.asarray(found.links)[1].tolist() == ["", ""]
    box = pf.Shape("base", "box", at=(0, 0, -20), size=(9, 9, 9))
    for machine in (struts(), struts(shapes=[box])):
        none = pf.clearance(pf.solve_ik(machine, np.empty((0, 4, 4))))
        assert np.shape(none.distance) == (0,) and none.points.shape == (0, 2, 3) and none.links.shape == (0, 2)
        assert none.gradient.shape == (0, 6) and "no configuration" in repr(none)


THICK_DELTA = (
    DELTA
    + """
[[body]]
name = "rodL"
thickness = 8

[[body]]
name = "rodR"
between = ["BR", "CR"]
thickness = 8

[[body]]
name = "platform"
shape = "disc"
at = [0, 0, -100]
axis = [0, 0, 1]
diameter = 60
thickness = 5

[[body]]
name = "arm"
ends = [[0, -132.011139050208, 0], [0, -244.011139050208, 0]]
thickness = 14

[[body]]
name = "base"
shape = "box"
at = [0, 0, 60]
size = [300, 200, 20]
"""
)


def thick_delta() -> pf.Mechanism:
    """Rods on either side of the platform are left out: they end side by side."""
    machine = loads(THICK_DELTA)
    beside = [(f"rodL{i}", f"rod{side}{j}") for side in "LR" for i in (1, 2, 3) for j in (1, 2, 3)]
    return machine.with_shapes(machine.shapes, beside)


def struts_around_a_column() -> pf.Mechanism:
    column = pf.Shape("base", "box", at=(0, 0, 60), size=(60, 80, 120), axes=((0.8, 0.6, 0), (-0.6, 0.8, 0)))
    plate = pf.Shape("platform", "disc", at=(0, 0, 150), axis=(0, 0.1, 1), diameter=50, thickness=10)
    beside = [("BC1", "BC2"), ("BC3", "BC4"), ("BC5", "BC6"), ("AB1", "BC4"), ("BC2", "AB5"), ("BC3", "BC6")]
    return struts(shapes=[column, plate], ignore=beside)


def hexaglide_with_a_ball() -> pf.Mechanism:
    machine = thick_hexaglide(8.0)
    ball = pf.Shape("platform", "sphere", at=(0, 0, 260), diameter=30)
    return machine.with_shapes([*machine.shapes, ball]).with_clearance(None)


def with_boxes_as_meshes(text: str) -> str:
    """A model whose boxes are meshes of eight corners: of a capsule whose axis is deep in a box, MuJoCo's function for
    this pair alone does not find the depth; its function for convex bodies does."""
    root = ElementTree.fromstring(text)
    asset = ElementTree.SubElement(root, "asset")
    for geom in root.iterfind(".//geom[@type='box']"):
        half = np.array(geom.attrib.pop("size").split(), float)
        corners = " ".join(str(x) for x in (np.array(list(itertools.product((-1, 1), repeat=3))) * half).ravel())
        name = f"box {len(asset)}"
        ElementTree.SubElement(asset, "mesh", name=name, vertex=corners)
        geom.attrib |= {"type": "mesh", "mesh": name}
    return ElementTree.tostring(root, encoding="unicode")


def in_mujoco(machine: pf.Mechanism, answers: pf.Solution) -> Array:
    """The least distance of all pairs of links that share no joint and are not excluded, in the exported machine."""
    model, metres = Model.of(with_boxes_as_meshes(to_mjcf(machine))), metres_of(machine.length_unit)
    scene = model.model
    scene.opt.ccd_tolerance, scene.opt.ccd_iterations = 1e-12, 200
    links: dict[str, list[int]] = {}  # a strut is two geoms
    for geom in np.flatnonzero(scene.geom_group == 3):
        links.setdefault(scene.geom(geom).name.rpartition("_")[0] or str(geom), []).append(int(geom))
    assert len(links) == len(machine.shapes)
    bodies = {name: {str(scene.body(scene.geom_bodyid[i]).name) for i in geoms} for name, geoms in links.items()}
    apart = {frozenset(joint.connects) for joint in machine.joints}
    apart |= {frozenset(str(scene.body(i).name) for i in divmod(pair, 2**16)) for pair in scene.exclude_signature}
    pairs = [
        pair
        for one, other in itertools.combinations(links, 2)
        if not bodies[one] & bodies[other]
        and not any(frozenset(pair) in apart for pair in itertools.product(bodies[one], bodies[other]))
        for pair in itertools.product(links[one], links[other])
    ]
    found = []
    for qpos in mjcf_qpos(answers):
        model.data.qpos[:] = qpos
        model.update()
        assert np.abs(model.rows()[0]).max(initial=0.0) < 1e-9
        found.append(min(mujoco.mj_geomDistance(scene, model.data, i, j, 1e3, None) for i, j in pairs) / metres)
    return np.array(found)


@pytest.mark.parametrize(
    ("make", "shift", "turn"),
    [
        (struts_around_a_column, 0.3, 0.3),
        (thick_delta, 0.5, 0.0),
        pytest.param(hexaglide_with_a_ball, 0.3, 0.4, marks=SLOW),
    ],
)
def test_links_are_as_far_apart_as_in_the_exported_machine(
    make: Callable[[], pf.Mechanism], shift: float, turn: float
) -> None:
    machine = make()
    assert loads(dumps(machine)) == machine
    answers = around(machine, 2 if INTERPRETED else 400, shift, turn)
    found, expected = np.asarray(pf.clearance(answers).distance), in_mujoco(machine, answers)
    assert (expected > 0.0).any()
    np.testing.assert_array_equal(found > 0.0, expected > 0.0)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * machine.characteristic_length)


def struts_about_a_ball() -> pf.Mechanism:
    plate = pf.Shape("platform", "disc", at=(0, 0, 205), axis=(0, 0, 1), diameter=150, thickness=10)
    return struts(shapes=[plate, pf.Shape("base", "sphere", at=(0, 0, 150), diameter=20)])


@pytest.mark.parametrize("make", [struts_about_a_ball, pytest.param(thick_delta, marks=SLOW)])
def test_gradients_are_the_differences_by_actuators(make: Callable[[], pf.Mechanism]) -> None:
    machine = make()
    answers, compared = around(machine, 20, 0.2, 0.1), 0
    found, units = pf.clearance(answers), actuator_units(machine) / machine.characteristic_length
    for row in np.flatnonzero((answers.status == pf.Status.REACHED) & (np.abs(found.distance) > 1e-3)):
        near = beside(answers[int(row)])
        there = pf.clearance(near)
        changes = slopes(machine, np.asarray(there.distance)) * units
        same = ((there.links == found.links[row]).all(axis=(0, 2))) & (near.status == pf.Status.REACHED).all(axis=0)
        np.testing.assert_allclose((found.gradient[row] * units)[same], changes[same], rtol=0, atol=1e-4)
        compared += np.count_nonzero(same & (np.abs(changes) > 1e-2))
    assert compared > 5


def test_links_that_share_a_joint_or_are_ignored_are_left_out() -> None:
    ends = {"base": [[-50, 0, 0], [50, 0, 0]], "platform": [[0, 0, 100], [0, 0, 100]]}
    legs = [pf.Leg("U-P*-S", **ends, stroke=(50, 200), thickness=10)]  # two struts to one double ball joint
    legs += [pf.Leg("U-P*-S", [0, 80, 0], [0, 40, 100], stroke=(50, 200), thickness=10, name="Z")]
    with pytest.warns(pf.errors.MobilityWarning):
        machine = pf.Mechanism.from_legs(legs, reference_point=[0, 0, 100])
    found = pf.clearance(pf.solve_ik(machine, machine.home_pose))
    assert "ZBC1" in found.links
    with pytest.warns(pf.errors.MobilityWarning):
        ignoring = pf.Mechanism.from_legs(legs, reference_point=[0, 0, 100], ignore=[["ZBC1", "BC1"], ["ZAB1", "BC2"]])
    with pytest.raises(UnsupportedMechanism, match="share a joint, or are one body, or are ignored"):
        pf.clearance(pf.solve_ik(ignoring, ignoring.home_pose))


# What is refused


def test_a_machine_without_thickness_has_no_clearance() -> None:
    machine = pf.load("stewart")
    with pytest.raises(UnsupportedMechanism, match="no link has a thickness"):
        pf.clearance(pf.solve_ik(machine, machine.home_pose))
    with pytest.raises(InvalidArgument):
        pf.clearance(machine)  # type: ignore[arg-type]
    with pytest.raises(InvalidArgument, match="a list of Shape"):
        struts(shapes=5)


@pytest.mark.parametrize(
    ("said", "place", "words"),
    [
        ('name = "rodL"\nthickness = -1', "body[0].thickness", "more than 0"),
        ('name = "rodL"', "body[0].thickness", "a number, for a capsule"),
        ('name = "rodX"\nthickness = 1', "body[0].name", "no such body; did you mean"),
        ('name = "rodL"\nshape = "capsul"', "body[0].shape", "did you mean 'capsule'?"),
        ('name = "rodL"\nshape = "box"\nat = [0, 0, 0]\nsize = [1, 2]', "body[0].size", "three numbers"),
        ('name = "rodL"\nshape = "sphere"\nat = [0, 0, 0]\ndiameter = 3\nsize = [1, 1, 1]', "body[0].size", "nothing"),
        ('name = "arm"\nthickness = 3', "body[0].between", "3 joints with a centre"),
        ('name = "rodL"\nthickness = 3\nbetween = ["A", "BL"]', "body[0].between", "joints of 'rodL"),
        ('name = "rodL"\nthickness = 3\nlength = 3', "body[0].length", "an unknown key"),
        ('name = "rodL"\nthickness = 3\nends = [[0, 0, 0]]', "body[0].ends", "two points"),
    ],
)
def test_what_no_body_can_have_is_named_at_its_place(said: str, place: str, words: str) -> None:
    faults = refused(lambda: loads(f"{DELTA}\n[[body]]\n{said}\n"))
    assert f"{place}:" in faults[0]
    assert words in faults[0]
    assert len(faults) == 1


THICK_LEG = pf.Leg("U-P*-S", (0, 9, 0), (0, 9, 9), thickness={})  # type: ignore[arg-type]
ONE_BALL = pf.Shape("base", "sphere", at=(0, 0, -50), diameter=1)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: struts(45.0), "leg[0].thickness: found 'BC2', which is 5 deep in 'BC1' at home"),
        (lambda: pf.Mechanism.from_legs([THICK_LEG], reference_point=(0, 0, 9)), "a number"),
        (lambda: struts(clearance=30), "28 from 'BC1' at home; expected links that are at least 30 apart"),
        (lambda: pf.load("stewart").with_shapes([1]), "found [1]"),
        (lambda: pf.load("stewart").with_shapes([ONE_BALL] * 301), "at most 300"),
        (lambda: pf.load("stewart").with_shapes((), ignore=7), "pairs of bodies"),
        (lambda: pf.load("stewart").with_shapes((), ignore=["base"]), "two bodies"),
        *(
            (lambda line=line: loads(DELTA.replace("schema = 1", f"schema = 1\nclearance = {line}")), words)
            for line, words in (("-1", "0 or more"), ("'x'", "a number"), ("2", "links with a thickness"))
        ),
    ],
)
def test_shapes_and_clearances_that_no_machine_can_have_are_named(make: Callable[[], object], words: str) -> None:
    assert words in refused(make)[0]


def test_links_may_be_as_thick_as_home_lets_them_and_a_clearance_is_kept_in_a_file() -> None:
    assert struts(29.282)
    ignored = [("BC1", "BC2"), ("BC3", "BC4"), ("BC5", "BC6"), ("BC1", "BC4"), ("BC2", "BC5"), ("BC3", "BC6")]
    assert struts(45.0, ignore=ignored).ignore == tuple(ignored)
    kept = struts(clearance=2)
    assert loads(dumps(kept)) == kept
    assert kept.with_clearance(None).clearance is None and kept != kept.with_clearance(3)


def test_copies_of_a_body_have_its_shape_turned_with_them() -> None:
    machine = loads(THICK_DELTA)
    arms = [shape for shape in machine.shapes if shape.body.startswith("arm")]
    assert [shape.body for shape in arms] == ["arm1", "arm2", "arm3"]
    for k, shape in enumerate(arms, start=1):
        np.testing.assert_allclose(shape.ends[0], machine.joint(f"A{k}").at, atol=1e-9)  # type: ignore[index]
    with_dimension = THICK_DELTA.replace("thickness = 14", 'thickness = "2 * wide"') + "\n[dimensions]\nwide = 7\n"
    assert loads(with_dimension).shapes == machine.shapes
    assert "wide" in dumps(loads(with_dimension))


# What is shown


def test_pictures_and_the_viewer_have_links_as_thick_as_they_are() -> None:
    machine = struts(shapes=[pf.Shape("base", "box", at=(0, 0, -20), size=(240, 200, 10))])
    skeleton = skeleton_of(pf.solve_ik(machine, machine.home_pose))
    box, strut = skeleton.solids[0], skeleton.solids[1]
    np.testing.assert_allclose(np.ptp(box.vertices, axis=0), [240, 200, 10])
    a, b, c = np.moveaxis(strut.vertices[strut.faces], 1, 0)
    volume = float(np.einsum("ni,ni->n", a, np.cross(b, c)).sum() / 6.0)
    length = float(np.linalg.norm(np.subtract(machine.joint("C1").at, machine.joint("A1").at)))
    assert abs(volume) == pytest.approx(np.pi * 36 * length + 4 / 3 * np.pi * 216, rel=0.05)
    assert sum(solid.is_nearest for solid in skeleton.solids) == 2
    assert not any(solid.is_stopped for solid in skeleton.solids)


def test_the_command_says_how_far_apart_links_are_and_which_clearance_is_kept(tmp_path: Path) -> None:
    def said(*words: str) -> str:
        return CliRunner().invoke(main, list(words)).output

    free, kept = str(tmp_path / "free.toml"), str(tmp_path / "kept.toml")
    pf.save(struts(), free)
    pf.save(struts(clearance=2.0), kept)
    shown = said("info", free)
    assert ("BC1       capsule" in shown or "BC1   capsule" in shown) and "at home BC" in shown
    at = ["--position", "0", "0", "200", "--margins"]
    assert "17.282 mm apart (no clearance is kept)" in said("ik", free, *at)
    plain = json.loads(said("ik", free, *at, "--json"))
    assert plain["clearance"]["distance"] == pytest.approx(2 * 14.6410161514 - 12)
    assert "clearance" not in json.loads(said("ik", "stewart", *at, "--json"))
    shown = said("info", kept)
    assert "clearance              2 mm kept between links" in shown and "(the clearance kept is 2 mm)" in shown
    assert json.loads(said("info", "--json", kept))["clearance"] == 2.0
    assert "BC1–BC4" in (table := said("ik", kept, *at)) and "clearance" in table


# As a limit


def test_feasibility_is_the_least_of_strokes_and_distances_and_what_solve_ik_reaches() -> None:
    machine = struts(clearance=10.0)
    n = 100 if INTERPRETED else 4_000
    rng = np.random.default_rng(5)
    turns = rng.uniform(-1.0, 1.0, (n, 3)) * [0.5, 0.5, 2.2]
    targets = pf.pose(machine.home_pose[:3, 3] + rng.uniform(-30, 30, (n, 3)), rotvec=turns)
    found = pf.feasibility(machine, targets)
    free = np.asarray(pf.feasibility(machine.with_clearance(None), targets).margin)
    distances = distances_of_struts(targets)
    room = (np.stack(list(distances.values())) - 10.0) / machine.characteristic_length
    expected = np.where(free < 0.0, free, np.minimum(free, room.min(axis=0)))
    np.testing.assert_allclose(found.margin, expected, atol=1e-12)
    by_links = np.flatnonzero((room.min(axis=0) < free - 1e-9) & (free >= 0.0))
    assert len(by_links) > n // 20
    named = [found.limits[place] for place in found.binding[by_links].tolist()]
    assert [bound for _, bound in named] == ["clearance"] * len(named)
    own = [distances[name][row] for (name, _), row in zip(named, by_links, strict=True)]
    np.testing.assert_allclose(own, 10.0 + room[:, by_links].min(axis=0) * machine.characteristic_length, atol=1e-9)
    rows = by_links[:: max(len(by_links) // 100, 1)]
    reached = pf.solve_ik(machine, targets[rows], options=pf.Options(working_mode="keep"))
    np.testing.assert_array_equal(reached.status == 0, expected[rows] >= 0.0)


@pytest.mark.parametrize("make", [lambda: loads(THICK_DELTA), hexaglide_with_a_ball], ids=["delta", "hexaglide"])
def test_feasibility_knows_links_on_inner_bodies_and_tasks_that_leave_something_open(
    make: Callable[[], pf.Mechanism],
) -> None:
    machine = make()
    least = 0.9 * float(pf.clearance(pf.solve_ik(machine, machine.home_pose)).distance)
    kept, length = machine.with_clearance(least), machine.characteristic_length
    rng = np.random.default_rng(4)
    n = 12 if INTERPRETED else 60
    turns = rng.uniform(-0.2, 0.2, (n, 3)) * ("rotation" in machine.task)
    targets = pf.pose(machine.home_pose[:3, 3] + 0.2 * length * rng.uniform(-1, 1, (n, 3)), rotvec=turns)
    free, found = pf.feasibility(machine, targets), pf.feasibility(kept, targets)
    distance = np.asarray(pf.clearance(pf.solve_ik(machine, targets, options=pf.Options(working_mode="keep"))).distance)
    room = (distance - least) / length
    expected = np.where(free.margin < 0.0, free.margin, np.minimum(free.margin, room))
    np.testing.assert_allclose(found.margin, expected, atol=1e-9)
    assert (expected < 0.0).any() and (room < free.margin).any()


def test_links_that_are_nearer_than_the_clearance_are_active_and_exceeded_by_name() -> None:
    machine = struts(clearance=10.0).without_limits()
    target = pf.pose(machine.home_pose[:3, 3], rotvec=(0.0, 0.0, 2.2))
    q = pf.solve_ik(machine.with_clearance(None), target).q
    found = pf.configuration(machine, q)
    expected = {name: float(d[0]) for name, d in distances_of_struts(target[None]).items() if d[0] < 10.0}
    assert found.status == pf.Status.EXCEEDED
    assert {limit.joint: pytest.approx(limit.value, abs=1e-9) for limit in found.active_limits} == expected
    assert {(limit.bound, limit.limit) for limit in found.active_limits} == {("clearance", 10.0)}
    worst = min(expected.values())
    assert found.active_limits[0].value == pytest.approx(worst)
    assert found.limit_excess == pytest.approx((10.0 - worst) / machine.characteristic_length)
    assert str(found.binding["bound"]) == "clearance" and f"{found.binding['joint']}" in expected
    assert re.search(r"BC\S* clearance", found.reason)
    assert found.to_dict()["active_limits"][0]["bound"] == "clearance"


def test_an_answer_held_back_by_links_says_so_in_words() -> None:
    machine = struts(clearance=10.0)
    target = pf.pose(machine.home_pose[:3, 3], rotvec=(0.0, 0.0, 2.2))
    found = pf.solve_ik(machine, target, options=pf.Options(hold=None))
    assert found.status == pf.Status.PROJECTED
    assert {limit.joint for limit in found.active_limits} == {"BC1–BC4", "BC2–BC5", "BC3–BC6"}
    assert found.reason.endswith("BC1–BC4, BC2–BC5, BC3–BC6 at their clearance 10 mm")
    assert min(float(d[0]) for d in distances_of_struts(found.pose[None]).values()) == pytest.approx(10.0, abs=1e-5)
    log = pf.search_log(machine, target)
    assert log.answered_by == "links kept apart" and "come too near at the target" in str(log)


@pytest.mark.compiled
def test_sizes_of_workspaces_are_not_proved_of_a_machine_with_a_clearance() -> None:
    machine = struts(clearance=2.0)
    place = machine.home_pose[:3, 3]
    with pytest.raises(UnsupportedMechanism, match="with_clearance"):
        pf.workspace(machine, fixed={"z": 195.0}, certified=True)
    assert pf.certify(machine, pf.PoseRegion.box(place - 1.0, place + 1.0))


def test_names_of_two_bodies_are_whole_however_long_they_are() -> None:
    rows = [(ActiveLimit("a" * 60 + "–" + "b" * 60, "clearance", 1.0, 2.0),), ()]
    assert binding_limits(rows)["joint"].tolist() == ["a" * 60 + "–" + "b" * 60, ""]
