"""Meshes are as far from other links as their convex hulls are, and what is no mesh is refused."""

from __future__ import annotations

import itertools
import pickle
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

import pfabrik as pf
from pfabrik.common import extras
from pfabrik.errors import InvalidMechanism, MissingLibrary
from pfabrik.kernels.clearance.least_clearance import least_clearance
from pfabrik.kernels.clearance.solids import BOX, CAPSULE, DISC
from pfabrik.machine.files.writing import dumps
from pfabrik.machine.meshes import MOST_VERTICES, hull_of, middle_of, sizes_of
from pfabrik.view.skeleton import skeleton_of
from test_compiled_and_interpreted import INTERPRETED

Array = NDArray[np.float64]
CUBE = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))


def written(folder: Path, points: Array, name: str = "mesh.obj") -> Path:
    """A file with the hull of points as triangles."""
    hull = ConvexHull(points)
    lines = [f"v {' '.join(map(repr, map(float, point)))}" for point in points]
    lines += [f"f {' '.join(str(k + 1) for k in triangle)}" for triangle in hull.simplices]
    (folder / name).write_text("\n".join(lines) + "\n")
    return folder / name


def solid_of(points: Array, folder: Path, place: Array) -> tuple[Array, Array]:
    """The sizes of a mesh of points, and its place where the origin of the file and its axes are at a place."""
    hull = hull_of(str(written(folder, points, f"{abs(hash(points.tobytes()))}.obj")))
    at = place.copy()
    at[0] += middle_of(hull) @ place[1:]
    return sizes_of(hull, 1.0), at


def random_place(rng: np.random.Generator, spread: float) -> Array:
    return np.vstack([spread * rng.normal(size=3), Rotation.random(random_state=rng).as_matrix()])


def measured(one: tuple[Array, Array], other: tuple[Array, Array]) -> tuple[float, Array]:
    clearance, nearest, points = np.full(1, np.inf), np.full(1, -1), np.empty((1, 2, 3))
    sizes = np.zeros((2, max(len(one[0]), len(other[0]))))
    sizes[0, : len(one[0])], sizes[1, : len(other[0])] = one[0], other[0]
    places = np.stack([one[1], other[1]])[None]
    least_clearance(sizes, places, np.array([[0, 1]]), 0, clearance, nearest, points)
    return float(clearance[0]), points[0]


def signed_distance(one: Array, other: Array) -> float:
    """The distance of the hulls of points by a least-squares problem with weights; or how deep they overlap, as the
    nearest face of the hull of all differences."""
    differences = (one[:, None] - other[None]).reshape(-1, 3)
    depth = -ConvexHull(differences).equations[:, 3].max()
    if depth >= 0.0:
        return -float(depth)
    large = 1e4
    rows = np.vstack([differences.T, np.full(len(differences), large)])
    weights, _ = nnls(rows, np.array([0.0, 0.0, 0.0, large]))
    return float(np.linalg.norm(weights / weights.sum() @ differences))


def some_points(rng: np.random.Generator) -> Array:
    """Points in a ball, on a sphere, in a plate, or on a lattice, where many faces are not triangles."""
    kind, count = rng.integers(4), rng.integers(4, 20)
    points = rng.normal(size=(count, 3))
    if kind == 1:
        points /= np.linalg.norm(points, axis=1)[:, None]
    elif kind == 2:
        points *= [1.0, 1.0, 0.01]
    elif kind == 3:
        points = np.vstack([0.4 * rng.integers(-2, 3, size=(count, 3)), 0.3 * CUBE])
    return points


def test_hulls_are_as_far_apart_or_as_deep_as_their_differences_say(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    deep = 0
    for _ in range(10 if INTERPRETED else 100):
        one, other = some_points(rng), some_points(rng)
        place, other_place = random_place(rng, 0.9), random_place(rng, 0.9)
        if rng.integers(3) == 0:
            other_place[1:] = place[1:]
        found, points = measured(solid_of(one, tmp_path, place), solid_of(other, tmp_path, other_place))
        there, other_there = one @ place[1:] + place[0], other @ other_place[1:] + other_place[0]
        assert found == pytest.approx(signed_distance(there, other_there), abs=1e-9 if found < 0.0 else 1e-6)
        deep += found < 0.0
        assert np.linalg.norm(points[1] - points[0]) == pytest.approx(abs(found), abs=1e-9)
        # A plane square to the line between the two points bounds both hulls: so none of their points are nearer.
        n = (points[1] - points[0]) / found
        assert (other_there @ n).min() - (there @ n).max() == pytest.approx(found, abs=1e-9)
        for x, hull in ((points[0], there), (points[1], other_there)):
            planes = ConvexHull(hull).equations
            assert (planes[:, :3] @ x + planes[:, 3]).max() < 1e-9
    assert deep > 0


def test_hulls_that_nearly_touch_are_as_far_apart_as_they_were_moved(tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    for _ in range(5 if INTERPRETED else 50):
        one = solid_of(some_points(rng), tmp_path, random_place(rng, 1.0))
        sizes, place = solid_of(some_points(rng), tmp_path, random_place(rng, 3.0))
        distance, points = measured(one, (sizes, place))
        if distance <= 0.0:
            continue
        for gap in (1e-4, 1e-8, 1e-12, 0.0, -1e-12, -1e-8, -1e-4):
            moved = place.copy()
            moved[0] -= (distance - gap) / distance * (points[1] - points[0])
            found, _ = measured(one, (sizes, moved))
            # Overlapping ones have another way out that is shorter, or none needed: corners beside corners.
            assert found >= gap - 1e-14 and (gap < 0.0 or found <= gap + 1e-14)


@pytest.mark.parametrize("kind", [CAPSULE, BOX, DISC])
def test_a_box_as_a_mesh_is_as_far_from_solids_as_the_box(kind: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    deep = 0
    for _ in range(8 if INTERPRETED else 80):
        size, place, other_place = rng.uniform(0.4, 1.8, 3), random_place(rng, 0.7), random_place(rng, 0.7)
        sizes = np.array([kind, 0.0, *rng.uniform(0.2, 0.9, 3)])
        if kind == CAPSULE:
            sizes[1], other_place[1] = 0.1, other_place[0] + rng.normal(size=3)
        elif rng.integers(4) == 0:
            other_place[1:] = place[1:]
        box = np.array([BOX, 0.0, *(0.5 * size)]), place
        mesh, solid = solid_of(CUBE * size, tmp_path, place), (sizes, other_place)
        expected, _ = measured(box, solid)
        for pair in ((mesh, solid), (solid, mesh)):
            found, points = measured(*pair)
            assert found == pytest.approx(expected, abs=1e-9)
            assert np.linalg.norm(points[1] - points[0]) == pytest.approx(abs(found), abs=1e-8)
        deep += expected < 0.0
    assert 0 < deep < 80


def test_hulls_and_discs_are_parted_by_a_plane_square_to_the_nearest_points(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    apart = 0
    for _ in range(6 if INTERPRETED else 60):
        points, place, disc_place = some_points(rng), random_place(rng, 1.5), random_place(rng, 1.5)
        sizes = np.array([DISC, 0.0, *rng.uniform(0.2, 0.9, 2), 0.0])
        found, nearest = measured(solid_of(points, tmp_path, place), (sizes, disc_place))
        n = (nearest[1] - nearest[0]) / found
        flat = n - (n @ disc_place[1]) * disc_place[1]
        flat -= (flat @ disc_place[1]) * disc_place[1]
        low = n @ disc_place[0] - sizes[2] * np.linalg.norm(flat) - sizes[3] * abs(n @ disc_place[1])
        high = ((points @ place[1:] + place[0]) @ n).max()
        if found > 0.0:
            apart += 1
            assert low - high == pytest.approx(found, abs=1e-9)
        else:
            assert high - low >= -found - 1e-9
    assert apart


def test_a_hull_of_many_vertices_is_enclosed_by_one_of_few_as_much_larger_as_said(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    points = rng.normal(size=(150 if INTERPRETED else 3000, 3))
    points *= np.array([50.0, 30.0, 40.0]) / np.linalg.norm(points, axis=1)[:, None]
    hull = hull_of(str(written(tmp_path, points + [300.0, 0.0, 0.0])))
    assert len(hull.vertices) == MOST_VERTICES
    assert 0.0 < hull.margin < 0.04 * 50.0
    directions = rng.normal(size=(5000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    true = ((points + [300.0, 0.0, 0.0]) @ directions.T).max(axis=0)
    enclosing = (hull.vertices @ directions.T).max(axis=0) + hull.margin
    assert (enclosing >= true).all()
    assert (enclosing <= true + hull.margin + 1e-9).all()


# Machines


def with_mesh(file: Path, **more: object) -> pf.Mechanism:
    machine = pf.load("stewart")
    plate = pf.Shape("base", "box", at=(0, 0, 60), size=(50, 50, 50))
    return machine.with_shapes([pf.Shape("platform", "mesh", file=file, **more), plate])  # type: ignore[arg-type]


def test_a_mesh_in_a_file_is_measured_as_the_box_that_it_is_and_kept_on_saving(tmp_path: Path) -> None:
    file = written(tmp_path, CUBE * [0.3, 0.2, 0.1] + [1.0, 0.0, 0.0])
    at, axes = (0.0, -100.0, 195.0), ((0, 1, 0), (-1, 0, 0))
    machine = with_mesh(file, scale=100.0, at=at, axes=axes)
    box = pf.Shape("platform", "box", at=(0, 0, 195), size=(30, 20, 10), axes=axes)
    by_box = machine.with_shapes([box, machine.shapes[1]])
    target = pf.pose([10, 5, 200], rpy=[5, 10, 15], degrees=True)
    found, expected = (pf.clearance(pf.solve_ik(each, target)) for each in (machine, by_box))
    assert found.distance == pytest.approx(expected.distance, abs=1e-9)
    np.testing.assert_allclose(found.gradient, expected.gradient, atol=1e-9)
    (tmp_path / "machines").mkdir()
    pf.save(machine, tmp_path / "machines" / "with_mesh.toml")
    text = (tmp_path / "machines" / "with_mesh.toml").read_text()
    assert 'file = "../mesh.obj"' in text
    assert pf.load(tmp_path / "machines" / "with_mesh.toml") == machine
    sized = text.replace("../mesh.obj", "mesh.obj").replace("scale = 100.0", 'scale = "size"')
    (tmp_path / "with_dimension.toml").write_text(f"{sized}\n[dimensions]\nsize = 100\n")
    with_dimension = pf.load(tmp_path / "with_dimension.toml")
    assert with_dimension.shapes == machine.shapes
    pf.save(with_dimension, tmp_path / "machines" / "again.toml")
    assert pf.load(tmp_path / "machines" / "again.toml") == machine
    assert str(file) in dumps(machine)
    drawn = skeleton_of(pf.solve_ik(machine, machine.home_pose)).solids[0]
    a, b, c = np.moveaxis(drawn.vertices[drawn.faces], 1, 0)
    assert np.einsum("ni,ni->n", a - a[0], np.cross(b - a[0], c - a[0])).sum() / 6.0 == pytest.approx(6000.0)
    np.testing.assert_allclose(drawn.vertices.mean(axis=0), [0, 0, 195], atol=1e-9)


def test_copies_of_a_body_have_its_mesh_turned_with_them(tmp_path: Path) -> None:
    written(tmp_path, CUBE)
    delta = (Path(pf.__file__).parent / "machine" / "catalog" / "delta.toml").read_text()
    table = '\n[[body]]\nname = "arm"\nshape = "mesh"\nfile = "mesh.obj"\nscale = 10\nat = [0, -200, 0]\n'
    (tmp_path / "delta.toml").write_text(delta + table)
    machine = pf.load(tmp_path / "delta.toml")
    assert [shape.body for shape in machine.shapes] == ["arm1", "arm2", "arm3"]
    for k, solid in enumerate(skeleton_of(machine).solids):
        turn = Rotation.from_euler("z", 120 * k, degrees=True).as_matrix()
        expected = (10.0 * CUBE + [0, -200, 0]) @ turn.T
        np.testing.assert_allclose(np.sort(solid.vertices, axis=0), np.sort(expected, axis=0), atol=1e-9)


@pytest.mark.skipif(INTERPRETED, reason="searches, which take long as plain Python")
def test_searches_keep_a_mesh_as_far_away_as_the_box_that_it_is(tmp_path: Path) -> None:
    file = written(tmp_path, CUBE * [3.0, 2.0, 1.0])
    machine = with_mesh(file, scale=20.0, at=(0, 0, 110)).with_clearance(5.0)
    box = pf.Shape("platform", "box", at=(0, 0, 110), size=(60, 40, 20))
    by_box = machine.with_shapes([box, machine.shapes[1]])
    targets = np.stack([pf.pose([x, 0, 180], rpy=[0, x, 0], degrees=True) for x in np.linspace(-15, 15, 5)])
    found, expected = pf.solve_ik(machine, targets), pf.solve_ik(by_box, targets)
    assert (expected.status == pf.Status.PROJECTED).sum() >= 2
    np.testing.assert_array_equal(found.status, expected.status)
    np.testing.assert_allclose(found.position_error, expected.position_error, atol=1e-6)
    assert (np.asarray(pf.clearance(found).distance) >= 5.0 - 1e-6).all()


def test_a_mechanism_keeps_the_hull_of_a_file_that_is_gone_and_a_copy_of_it_says_so(tmp_path: Path) -> None:
    file = written(tmp_path, CUBE)
    machine = with_mesh(file, scale=20.0, at=(0, 0, 195))
    text = pickle.dumps(machine)
    file.unlink()
    assert pf.clearance(pf.solve_ik(machine, machine.home_pose)).distance > 0.0
    assert len(skeleton_of(machine).solids[0].faces) == 12
    copy = pickle.loads(text)
    with pytest.raises(InvalidMechanism, match="no such file"):
        pf.clearance(pf.solve_ik(copy, copy.home_pose))


# What is refused


def test_what_is_no_mesh_is_named_at_its_place(tmp_path: Path) -> None:
    (tmp_path / "text.stl").write_text("hello")
    (tmp_path / "other.xyz").write_text("1 2 3")
    flat = "\n".join(f"v {x} {y} 0" for x in (0, 1) for y in (0, 1)) + "\nf 1 2 3\nf 2 4 3\n"
    (tmp_path / "flat.obj").write_text(flat)
    with (tmp_path / "large.stl").open("wb") as large:
        large.truncate(200_000_000)
    file = written(tmp_path, CUBE)
    for given, place, words in [
        ({"file": tmp_path / "none.stl"}, "file: found", "none.stl': no such file"),
        ({"file": tmp_path}, "file: found", "which is no file"),
        ({"file": tmp_path / "text.stl"}, "file: found", "in which no mesh was found"),
        ({"file": tmp_path / "other.xyz"}, "file: found", "in which no mesh was found"),
        ({"file": tmp_path / "flat.obj"}, "file: found", "a flat mesh"),
        ({"file": tmp_path / "large.stl"}, "file: found", "200000000 bytes"),
        ({"file": 7}, "file: found 7", "the path of a mesh file"),
        ({"file": ""}, "file: found ''", "the path of a mesh file"),
        ({"file": None}, "file: found nothing", "for a mesh"),
        ({"file": file, "scale": 0}, "scale: found 0", "more than 0"),
        ({"file": file, "scale": float("nan")}, "scale: found nan", "a number"),
        ({"file": file, "diameter": 3}, "diameter: found 3", "a mesh has no diameter"),
        ({"file": file, "axes": ((1, 0, 0), (1, 1, 0))}, "axes: found", "square to each other"),
    ]:
        with pytest.raises(InvalidMechanism) as caught:
            with_mesh(**given)  # type: ignore[arg-type]
        (fault,) = map(str, caught.value.faults)
        assert fault.startswith(f"body[0].{place}") and words in fault


def test_a_missing_library_is_named_with_what_installs_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extras, "find_spec", lambda name: None)
    with pytest.raises(MissingLibrary, match=r"meshes.*trimesh.*\[collide\]"):
        with_mesh(written(tmp_path, CUBE))
