"""Pictures of workspaces in space show the border that margins have, and say which limit forms it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

import pfabrik as pf
from pfabrik.errors import InvalidArgument
from test_pictures import faults

pytest.importorskip("matplotlib")
from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from pfabrik.view.eye import Eye, upright
from pfabrik.view.raster import Raster, lines_between, rasterised
from pfabrik.view.solid import SeenSolid, best_eye, picked_faces, scale_of, seen_solid

OVER = {"rps": ["z", "tilt_x", "tilt_y"]}
CELLS = 20.0


@cache
def space_of(name: str) -> pf.Workspace:
    """A workspace of a catalogue machine in space, with few cells."""
    machine = pf.load(name)
    return pf.workspace(machine, over=OVER.get(name), resolution=machine.characteristic_length / CELLS)


def seen(region: pf.Workspace) -> SeenSolid:
    sample = picked_faces(region.vertices * scale_of(region), region.faces, region.face_limit)
    return seen_solid(region, best_eye(sample, upright(region.names)), 240)


def centres(raster: Raster, pixels: NDArray[np.int64]) -> NDArray[np.float64]:
    """The centres of pixels, (n, 2), by their places in a flat image."""
    row, column = np.divmod(pixels, raster.face.shape[1])
    return np.asarray(raster.low + raster.pixel * np.stack([column, row], axis=1))


@pytest.mark.parametrize("eye", [Eye(30.0, -60.0), Eye(-20.0, 110.0, (1, 2, 0))])
def test_each_pixel_shows_the_nearest_face(eye: Eye) -> None:
    """Of a box: a ray leaves it where it leaves the first of three slabs."""
    ends = np.array([[-1.0, -0.7, -0.4], [1.0, 0.7, 0.4]])
    square = np.array([[0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4]])
    square = np.concatenate([square, [[2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5]]])
    corners = np.array([ends[list(pick), range(3)] for pick in np.ndindex(2, 2, 2)])
    volume = np.linalg.det(corners[square]).sum() / 6.0
    faces = square if volume > 0.0 else square[:, ::-1]
    for both_sides in (False, True):
        raster = rasterised(eye.seen(corners), faces, 120, both_sides=both_sides)
        pixels = np.arange(raster.face.size)
        start = centres(raster, pixels) @ eye.axes[:2]
        hits = (ends[:, None] - start) / eye.axes[2]
        leaves, enters = hits.max(axis=0).min(axis=1), hits.min(axis=0).max(axis=1)
        depth = (
            raster.depth.ravel()
        )  # corners of faces are moved to pixels: one beside an edge may have its neighbour's
        assert np.mean(np.isfinite(depth) == (leaves > enters)) > 0.985
        drawn = np.isfinite(depth) & (leaves > enters)
        assert np.mean(np.abs(depth - leaves)[drawn] < 1e-9) > 0.975
        assert len(lines_between(np.minimum(raster.face, 0), raster, 1.0)) == 1


@pytest.mark.parametrize("name", ["stewart", "linear_delta", "rps"])
def test_a_pixel_has_the_limit_that_is_exceeded_just_outside(name: str) -> None:
    solid = seen(space_of(name))
    towards, pixels = solid.eye.axes[2], np.flatnonzero(solid.limit >= 0)
    pixels = pixels[np.random.default_rng(0).permutation(len(pixels))[:1000]]
    at = centres(solid.raster, pixels) @ solid.eye.axes[:2] + solid.depth.ravel()[pixels, None] * towards
    outside = pf.feasibility(
        solid.region.mechanism, solid.region.poses((at + 0.3 * solid.step * towards) / solid.scale)
    )
    assert (outside.margin < 0.0).mean() > 0.96  # a ray may graze the border, and faces are flat where it bends
    named = np.array([" ".join(limit) for limit in solid.region.limits])[solid.limit.ravel()[pixels]]
    told = np.array([" ".join(limit) for limit in outside.limits])[outside.binding]
    assert (named == told)[outside.margin < 0.0].mean() > 0.95
    inside = pf.feasibility(solid.region.mechanism, solid.region.poses((at - 0.3 * solid.step * towards) / solid.scale))
    assert (inside.margin >= 0.0).mean() > 0.94


def test_no_face_is_folded() -> None:
    """Slopes of neighbouring pixels on one face differ little: the mesh is drawn as it is."""
    solid = seen(space_of("linear_delta"))
    is_one = (solid.limit[:, 1:] == solid.limit[:, :-1]) & (solid.limit[:, 1:] >= 0)
    is_one &= np.abs(np.diff(np.where(solid.limit >= 0, solid.depth, 0.0), axis=1)) < solid.step
    cosines = (solid.normal[:, 1:] * solid.normal[:, :-1]).sum(axis=2)[is_one]
    assert np.mean(cosines > 0.9) > 0.99  # the rest is where marching cubes cut an edge
    facing = (solid.normal @ solid.eye.axes[2])[solid.limit >= 0]
    assert np.mean(facing > 0.0) > 0.99


CASES: list[tuple[str, Callable[[], pf.Workspace]]] = [
    ("Stewart", lambda: space_of("stewart")),
    ("3-RPS", lambda: space_of("rps")),
    ("nothing within reach", lambda: pf.workspace(pf.load("stewart"), fixed={"z": 5000.0})),
]


@pytest.mark.usefixtures("coarse")
@pytest.mark.parametrize(("word", "make"), CASES, ids=[word for word, _ in CASES])
def test_names_and_numbers_hide_nothing(
    word: str, make: Callable[[], pf.Workspace], monkeypatch: pytest.MonkeyPatch
) -> None:
    region = make()
    axes = region.plot(theme="dark")
    assert faults(axes.figure, monkeypatch) == []
    assert any(word in text.get_text() for text in (*axes.figure.texts, axes.title))
    if len(region.faces):
        assert [line.get_color() for line in axes.lines if line.get_marker() == "+"] == ["white"]  # home is inside
        key = [text.get_text() for text in axes.figure.legends[0].get_texts()]
        assert 97 <= sum(int(entry.split()[-2]) for entry in key) <= 103


@pytest.mark.usefixtures("coarse")
def test_a_solid_goes_on_axes_of_ones_own_with_a_shape_that_fits_in() -> None:
    region = space_of("linear_delta")
    own = Figure(figsize=(4.0, 4.0)).add_subplot()
    assert region.plot(own, view="top", shape=region.inscribed("box")) is own
    assert own.figure.axes == [own]
    with pytest.raises(InvalidArgument, match="three-dimensional axes"):
        region.plot(Figure().add_subplot(projection="3d"))
    with pytest.raises(InvalidArgument, match="view"):
        region.plot(view="left")  # type: ignore[arg-type]


COLUMN = (3.5, 3.0)
"""A column of a page [inches]."""


@pytest.mark.usefixtures("coarse")
@pytest.mark.parametrize("kind", ["space", "plane", "singular", "singular in a plane", "travel"])
@pytest.mark.filterwarnings("error")
def test_words_of_a_picture_in_a_column_hide_nothing_and_are_whole(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    machine = pf.load({"travel": "stewart", "space": "delta"}.get(kind, "rps"))
    if kind == "travel":
        found = pf.travel(pf.solve_ik(machine, machine.home_pose))
        figure = next(iter(pf.plot_travel(found, size=COLUMN).values())).figure
    else:
        over = ("z", "tilt_x") if "plane" in kind else OVER.get(kind if kind == "space" else "rps")
        region = pf.workspace(machine, over=over, resolution=machine.characteristic_length / 12.0)
        drawn = pf.singularity_map(machine, region) if kind.startswith("singular") else region
        figure = drawn.plot(size=COLUMN).figure
    drawn_boxes: dict[Text, Bbox] = {}

    def draw(text: Text, renderer: RendererBase) -> None:  # only those ticks that are within their axes
        if text.get_text().strip() and text.get_visible():
            drawn_boxes[text] = text.get_window_extent(renderer)

    monkeypatch.setattr(Text, "draw", draw)
    figure.canvas.draw()
    drawn_boxes.clear()
    figure.canvas.draw()
    texts, boxes = list(drawn_boxes), list(drawn_boxes.values())
    page = figure.bbox.padded(1.0)
    for row, (text, box) in enumerate(zip(texts, boxes, strict=True)):
        assert page.x0 <= box.x0 and box.x1 <= page.x1 and page.y0 <= box.y0 and box.y1 <= page.y1, text
        for other, beside in zip(texts[:row], boxes[:row], strict=True):
            shrunk = beside.padded(-1.0)
            assert not box.overlaps(shrunk), (text.get_text(), other.get_text())


def test_a_picture_that_is_too_small_for_words_is_refused() -> None:
    machine = pf.load("stewart")
    for draw in (
        space_of("delta").plot,
        lambda size: pf.plot_travel(pf.travel(pf.solve_ik(machine, machine.home_pose)), size=size),
    ):
        with pytest.raises(InvalidArgument, match=r"size: found 2 x 2 inches; expected 3 x 2\.\d+ at least"):
            draw(size=(2.0, 2.0))
