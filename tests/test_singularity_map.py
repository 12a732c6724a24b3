"""Maps of singularities show closed forms' loci, and the parts that these divide a workspace into."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import pfabrik as pf
from oracles.annuli import within
from pfabrik.capabilities.workspace.locus import locus
from pfabrik.errors import InvalidArgument
from pfabrik.view.singular_picture import on_grid, without_specks
from pfabrik.view.slices import cut_mesh, loops_of, plane_across
from test_pictures import faults

Array = NDArray[np.float64]


def forearms_cross(tips: Array) -> Array:
    """The sine between the catalogue 5-bar's forearms, elbows bent as at home, (n,): 0 where they are in line."""
    crank, forearm = np.hypot(66.0, 88.0), np.hypot(116.0, 87.0)
    ways = []
    for shoulder, side in ((-50.0, 1.0), (50.0, -1.0)):
        away = tips - [shoulder, 0.0]
        far = np.linalg.norm(away, axis=1)
        along = (crank**2 - forearm**2 + far**2) / (2.0 * far)
        across = np.sqrt(np.maximum(crank**2 - along**2, 0.0))
        unit = away / far[:, None]
        elbow = [shoulder, 0.0] + along[:, None] * unit + side * across[:, None] * unit[:, ::-1] * [-1.0, 1.0]
        ways.append((tips - elbow) / forearm)
    return np.asarray(ways[0][:, 0] * ways[1][:, 1] - ways[0][:, 1] * ways[1][:, 0])


@pytest.fixture(scope="module")
def free_five_bar() -> pf.Workspace:
    return pf.workspace(pf.load("five_bar").without_limits(), resolution=6.0)


def test_a_five_bar_is_singular_where_its_forearms_are_in_line(free_five_bar: pf.Workspace) -> None:
    found = pf.singularity_map(free_five_bar.mechanism, free_five_bar)
    sines = forearms_cross(found.points)
    assert abs(np.sum(found.signs * np.sign(sines))) == len(sines)
    assert {-1.0, 1.0} == set(np.unique(found.signs))
    on = forearms_cross(found.locus_vertices)
    assert len(on) > 30
    assert np.median(np.abs(on)) < 0.01
    assert np.abs(on).max() < 0.1  # between points 6 mm apart, near a stretched arm
    assert (np.asarray(found.measures.parallel)[np.abs(sines) > 0.2] > 0.02).all()


def rods_in_a_plane(points: Array) -> Array:
    """The volume that an Orthoglide's rods span, as a share of a cube's, (n,): 0 where they are in a plane."""
    length = 310.582854123025
    along = np.sqrt(length**2 - (points**2).sum(axis=1, keepdims=True) + points**2)  # NaN where a rod does not reach
    rods = np.repeat(-points[:, None], 3, axis=1)
    rods[:, range(3), range(3)] = along
    return np.asarray(np.linalg.det(rods) / length**3)


def test_the_locus_goes_as_far_as_the_workspace() -> None:
    """Within the five-bar's reach, and in the three cylinders of an Orthoglide, wherever the closed form is 0."""
    crank, forearm = np.hypot(66.0, 88.0), np.hypot(116.0, 87.0)
    rings = [(y, 0.0, abs(crank - forearm), crank + forearm) for y in (-50.0, 50.0)]
    random = np.random.default_rng(0)
    for name, options, step, closed_form in (
        ("five_bar", {"resolution": 5.0}, 5.0, lambda at: np.where(within(rings, at), forearms_cross(at), np.nan)),
        ("orthoglide", {"resolution": 25.0}, 35.0, rods_in_a_plane),
    ):
        space = pf.workspace(pf.load(name).without_limits(), **options)
        found = pf.singularity_map(space.mechanism, space, resolution=step)
        assert (np.abs(found.signs) == 1.0).all() and space.contains(found.points).all()
        assert len(found.points) == len(found.parts) == len(np.asarray(found.measures.serial))
        begins = random.uniform(*space.bounds, (60_000, len(space.names)))
        with np.errstate(invalid="ignore"):
            near, far = (closed_form(begins + by) for by in (0.0, 0.1 * step))
            zeros = begins[near * far < 0.0]
            on = closed_form(found.locus_vertices)
        assert len(zeros) > 30
        far_off = [np.linalg.norm(found.locus_vertices - point, axis=1).min() for point in zeros]
        assert max(far_off) < step
        assert np.nanmedian(np.abs(on)) < 0.01


def test_parts_have_one_sign_each(free_five_bar: pf.Workspace) -> None:
    pytest.importorskip("matplotlib.pyplot")
    found = pf.singularity_map(free_five_bar.mechanism, free_five_bar, resolution=8.0)
    assert found.plot().collections
    for part in range(found.parts.max() + 1):
        assert len(set(found.signs[found.parts == part].tolist())) == 1
    assert found.sizes.sum() == pytest.approx(1.0)
    assert (np.diff(found.sizes) <= 0.0).all()
    above, between = (
        found.parts[np.linalg.norm(found.points - place, axis=1).argmin()] for place in ([0.0, 150.0], [0.0, 10.0])
    )
    assert above != between
    table, plain = found.table(), found.to_dict()
    shares = [f"{size:.1%}" for size in plain["parts"]]
    assert table.lines == [
        f"{len(found.points)} points over y z: {len(shares)} parts between parallel singularities ({', '.join(shares)})"
    ]
    parallel = np.asarray(found.measures.parallel)
    assert plain["least"]["parallel"] == parallel.min() and plain["near"]["parallel"] == np.mean(parallel < 0.1)
    assert table.rows[1] == ("parallel", f"{parallel.min():.3g}", f"{np.mean(parallel < 0.1):.1%}")


def test_a_path_through_a_singularity_is_told_where_and_redundant_machines_have_no_sides() -> None:
    pytest.importorskip("matplotlib.pyplot")
    machine, path = pf.load("five_bar").without_limits(), np.zeros((60, 3))
    path[:, 1], path[:, 2] = 3.0, np.linspace(150.0, 20.0, 60)
    found = pf.singularity_map(machine, pf.track(machine, path))
    sines = forearms_cross(path[:, 1:])
    (row,) = np.flatnonzero(sines[1:] * sines[:-1] < 0.0) + 1
    assert found.crossings.tolist() == [row] and found.plot().lines
    redundant = pf.load("nrpm")
    along = pf.singularity_map(redundant, pf.track(redundant, [redundant.reference_point] * 2))
    assert np.isnan(along.signs).all() and along.crossings.tolist() == []


def lattice(n: int) -> Array:
    steps = np.arange(-n, n + 1)
    return np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)


@pytest.mark.parametrize("order", [(0, 1, 2), (1, 2, 0)])
def test_a_plane_cuts_a_mesh_where_it_is_with_the_inside_on_the_left(order: tuple[int, int, int]) -> None:
    """The unit sphere at height h is a circle of radius sqrt(1 - h^2)."""
    places, step = lattice(12), 0.1
    vertices, faces = locus(places, places * step, 1.0 - np.linalg.norm(places * step, axis=1))
    for axis in range(3):
        plane = plane_across(axis, 0.6, order)
        cut = cut_mesh(vertices, faces, plane)
        assert np.linalg.norm(cut.points, axis=1) == pytest.approx(0.8, abs=0.02)
        (loop,) = loops_of(cut.segments)
        x, y = cut.points[loop].T
        area = 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
        assert area == pytest.approx(0.64 * np.pi, rel=0.02)


def test_specks_of_a_locus_are_dropped_and_a_measure_goes_on_beyond_the_border() -> None:
    places, step = lattice(12), np.full(3, 0.1)
    values = np.linalg.norm(places * step, axis=1)
    sheet = locus(places, places * step, values - 1.0)
    speck = locus(places, places * step, values - 0.06)
    both = np.concatenate([sheet[0], speck[0]]), np.concatenate([sheet[1], speck[1] + len(sheet[0])])
    vertices, faces = without_specks(*both, step)
    assert faces.tolist() == sheet[1].tolist()
    np.testing.assert_array_equal(vertices[faces], sheet[0][sheet[1]])  # closed: it has no rim
    flat = lattice(3)[:, :2]
    grid, low = on_grid(flat, flat @ [2.0, -1.0] + 0.5)
    at = np.stack(np.meshgrid(*map(np.arange, grid.shape), indexing="ij"), axis=-1) + low
    known = np.isfinite(grid)
    assert known.sum() > 1.5 * 7**2
    np.testing.assert_allclose(grid[known], (at @ [2.0, -1.0] + 0.5)[known], atol=1e-12)


def test_what_is_no_workspace_of_the_machine_is_refused(free_five_bar: pf.Workspace) -> None:
    machine = free_five_bar.mechanism
    with pytest.raises(InvalidArgument, match="a Workspace or a Track"):
        pf.singularity_map(machine, 3)  # type: ignore[call-overload]
    with pytest.raises(InvalidArgument, match="one of"):
        pf.singularity_map(pf.load("stewart"), free_five_bar)
    with pytest.raises(InvalidArgument, match="resolution"):
        pf.singularity_map(machine, free_five_bar, resolution=-1.0)


@pytest.mark.usefixtures("coarse")
def test_a_map_in_space_has_its_locus_and_its_slices_in_one_figure(monkeypatch: pytest.MonkeyPatch) -> None:
    pyplot = pytest.importorskip("matplotlib.pyplot")
    machine = pf.load("stewart").without_limits()
    ends = {"x": (-40.0, 40.0), "y": (-40.0, 40.0), "z": (-60.0, 60.0)}
    found = pf.singularity_map(machine, pf.workspace(machine, within=ends, resolution=20.0))
    axes = found.plot()
    panels = [each for each in axes.figure.axes if " = " in each.get_title()]
    assert len(panels) == 4
    assert all(panel.get_title().startswith("y = ") for panel in panels)
    assert faults(axes.figure, monkeypatch) == []
    own = pyplot.figure().add_subplot()
    assert found.plot(own, view="iso") is own
    with pytest.raises(InvalidArgument, match="three-dimensional axes"):
        found.plot(pyplot.figure().add_subplot(projection="3d"))


def test_the_locus_of_a_pointing_machine_is_where_its_axis_is_let_go_of() -> None:
    """However far it leans: the tilt that a task sets is about the platform's axes, not the base's."""
    axes = [(1, 0.1, 0), (0.2, 1, 0.3), (0, 0.2, 1), (-0.9, 0.3, 0.6), (-0.3, -1, 0.1)]
    links = [("base", "l1"), ("l1", "l2"), ("l2", "l3"), ("l3", "l4"), ("base", "l4")]
    joints = [
        pf.Joint(name, "revolute", link, at=(0, 0, 0), axis=axis, actuated=name in "AE")
        for name, link, axis in zip("ABCDE", links, axes, strict=True)
    ]
    machine = pf.Mechanism("spherical 5R", joints, "l2", (0, 20, 100), task=("tilt",))
    ends = {"tilt_x": (-1.2, 1.2), "tilt_y": (-1.2, 1.2)}
    found = pf.singularity_map(machine, pf.workspace(machine, within=ends, resolution=0.06), resolution=0.1)
    at = pf.solve_ik(machine, found.workspace.poses(found.locus_vertices), options=pf.Options(working_mode="keep"))
    assert len(found.locus_vertices) > 5
    assert np.median(pf.singularity(at).parallel) < 0.01 and np.max(pf.singularity(at).parallel) < 0.1
