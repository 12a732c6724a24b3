"""Pictures show what the answers say, where they say it, and nothing in them hides anything else."""

from __future__ import annotations

import dataclasses
import itertools
import os
import shutil
from collections import Counter
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from machines import MACHINES, planar, tripod_rps
from machines.small import slides
from pfabrik.errors import InvalidArgument, MissingLibrary, UnknownName
from pfabrik.machine.common_centre import common_centre
from pfabrik.machine.description.sketch import joint_places, joints_on, slider_place
from pfabrik.view.drawn_parts import home_rail, order_around
from pfabrik.view.skeleton import skeleton_of

pytest.importorskip("matplotlib")
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from pfabrik.common.drawing import round_length
from pfabrik.machine.description.plane import plane_of
from pfabrik.view.crossings import far_to_near
from pfabrik.view.eye import Eye, eye_for, eye_of, eye_on
from pfabrik.view.looks import HELD, LOOKS
from pfabrik.view.save_picture import save_picture

TRIPOD, FIVE_BAR = tripod_rps(), pf.load("five_bar")


def gantry(*axes: int) -> pf.Mechanism:
    return slides(*[(-5, 5)] * len(axes), axes=np.eye(3)[[*axes]])


def circle_of(machine: pf.Mechanism, radius: float, steps: int = 12) -> pf.Track:
    """A circle about home, along two axes of the task, in a plane that the machine reaches at home."""
    angle = np.linspace(0.0, 2.0 * np.pi, steps, endpoint=False)
    targets = np.repeat(machine.home_pose[None], steps, axis=0)
    first, second = [place for place, name in enumerate("xyz") if name in machine.task][-2:]
    targets[:, first, 3] += radius * np.sin(angle)
    targets[:, second, 3] += radius * (1.0 - np.cos(angle))
    return pf.track(machine, targets)


def texts_drawn(figure: Any, monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, np.ndarray]]:
    """Every text as it is drawn, with its left, bottom, right and top edge [pixels]."""
    drawn: list[tuple[str, np.ndarray]] = []
    draw = Text.draw

    def listening(self: Text, renderer: Any, *arguments: Any, **options: Any) -> Any:
        if self.get_visible() and self.get_text().strip():
            drawn.append((self.get_text(), self.get_window_extent(renderer).extents))
        return draw(self, renderer, *arguments, **options)

    with monkeypatch.context() as patched:
        patched.setattr(Text, "draw", listening)
        figure.canvas.draw()
    return drawn


def faults(figure: Any, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Texts that hide each other, or leave the figure."""
    drawn = texts_drawn(figure, monkeypatch)
    pairs = itertools.combinations(drawn, 2)
    hiding = [
        f"{text} hides {other}"
        for (text, box), (other, another) in pairs
        if (np.minimum(box[2:], another[2:]) - np.maximum(box[:2], another[:2])).min() > 0.5
    ]
    edges = figure.bbox.extents
    cut = [text for text, box in drawn if (box[:2] < edges[:2]).any() or (box[2:] > edges[2:]).any()]
    return hiding + [f"{text} is cut" for text in cut]


# What is drawn, before any library draws it.


def places_of(shown: pf.Mechanism | pf.Solution) -> dict[str, np.ndarray]:
    return {mark.joint.name: mark.place for mark in skeleton_of(shown).marks}


def test_an_answer_is_drawn_where_its_points_are() -> None:
    mechanism = tripod_rps()
    answer = pf.solve_ik(mechanism, (0, 0, 212))
    home, moved = places_of(mechanism), places_of(answer)
    assert moved["C1"] == pytest.approx(answer.points["C1"])
    assert moved["C1"][2] - home["C1"][2] == pytest.approx(12.0)
    assert moved["B1"] == pytest.approx((answer.points["A1"] + answer.points["C1"]) / 2)
    assert skeleton_of(answer).reference == pytest.approx(answer.pose[:3, 3])


def test_a_rail_spans_the_travel_and_stays_when_the_carriage_moves() -> None:
    mechanism = planar("PRR")
    moved = pf.solve_fk(mechanism, [3.0, -2.0, 4.0])
    at_home, later = skeleton_of(mechanism).rails, skeleton_of(moved).rails
    assert np.linalg.norm(at_home[0, 1] - at_home[0, 0]) == pytest.approx(140)
    assert later == pytest.approx(at_home)
    assert home_rail(mechanism, mechanism.joint("B1")) is None


@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
@pytest.mark.parametrize("make", MACHINES.values(), ids=MACHINES)
def test_every_joint_and_every_body_is_drawn(make: Callable[[], pf.Mechanism]) -> None:
    mechanism = make()
    skeleton = skeleton_of(mechanism)
    assert [mark.joint for mark in skeleton.marks] == list(mechanism.joints)
    drawn = {line.part.body for line in skeleton.parts}
    assert drawn >= {body for body in mechanism.bodies if len(joints_on(mechanism, body)) > 1}
    assert np.isfinite(skeleton.points).all()
    assert np.isfinite(skeleton.lines).all()


def test_slides_without_any_centre_are_drawn_at_the_reference_point() -> None:
    mechanism = gantry(0, 1, 2)
    assert slider_place(mechanism, mechanism.joint("P1"), {}) is None
    places = joint_places(mechanism, None, mechanism.home_pose[:3, 3])
    assert np.array(list(places.values())) == pytest.approx(np.array([[1, 2, 3]] * 3))


def test_corners_of_a_polygon_follow_each_other() -> None:
    square = [np.array(corner, float) for corner in ((0, 0, 1), (1, 1, 1), (1, 0, 1), (0, 1, 1))]
    ordered = np.array(square)[order_around(square)]
    assert np.linalg.norm(ordered - np.roll(ordered, 1, axis=0), axis=1) == pytest.approx(1)


def test_what_holds_an_answer_back_is_marked_at_its_joint() -> None:
    far = pf.solve_ik(pf.load("stewart"), (40, 0, 300))
    held = {mark.joint.name: mark.held_by for mark in skeleton_of(far).marks if mark.held_by}
    assert held == {limit.joint: (limit.bound,) for limit in far.active_limits} != {}


def test_planar_is_what_cannot_leave_its_plane() -> None:
    assert plane_of(FIVE_BAR) == pytest.approx(np.array([[0, 1, 0], [0, 0, 1]]))
    assert plane_of(planar("RPR")) == pytest.approx(np.array([[1, 0, 0], [0, 1, 0]]))
    assert plane_of(gantry(0, 2)) == pytest.approx(np.array([[1, 0, 0], [0, 0, 1]]))
    for machine in (tripod_rps(), gantry(0, 1, 2), gantry(0), pf.load("agile_eye")):
        assert plane_of(machine) is None


# A picture of one configuration.


@pytest.mark.parametrize("make", [tripod_rps, lambda: gantry(0, 1, 2), lambda: pf.load("nrpm")])
def test_home_can_be_drawn_on_axes_of_ones_own(make: Callable[[], pf.Mechanism]) -> None:
    mechanism = make()
    axes = Figure(figsize=(3, 3)).add_subplot()
    assert pf.plot(mechanism, axes) is axes
    markers = [line for line in axes.lines if line.get_marker() not in ("None", "+")]
    assert len(markers) == len(mechanism.joints)


def test_a_planar_machine_has_numbers_and_one_in_space_a_scale_of_its_length() -> None:
    flat = pf.plot(FIVE_BAR)
    assert (flat.get_xlabel(), flat.get_ylabel(), flat.get_aspect()) == ("y [mm]", "z [mm]", 1.0)
    for shown, size in ((tripod_rps(), (4.0, 3.0)), (pf.load("g1_ankle"), (2.0, 5.0)), (pf.load("delta"), None)):
        axes = pf.plot(shown, view="front", size=size)
        assert axes.get_aspect() == 1.0
        words = [text.get_text() for text in axes.texts if text.get_text() not in ("", "x", "y", "z")]
        (bar,) = (line for line in axes.lines if line.get_solid_capstyle() == "butt")
        length = np.ptp(bar.get_xdata())
        assert words == [f"{1000 * length:g} mm" if shown.length_unit == "m" else f"{length:g} {shown.length_unit}"]
        assert f"{length:.0e}"[0] in "125"
        points = skeleton_of(shown).points
        span = np.ptp(points[:, [0, 2]], axis=0).max()
        assert 0.1 * span < length <= 0.28 * span
        box = axes.viewLim
        assert (box.min < points[:, [0, 2]].min(axis=0)).all()
        assert (box.max > points[:, [0, 2]].max(axis=0)).all()


def test_a_figure_has_the_shape_of_its_machine_unless_it_is_given_a_size() -> None:
    tall, wide = (pf.plot(pf.load(name)).figure.get_size_inches() for name in ("g1_ankle", "delta"))
    assert tall[1] > 1.5 * tall[0]
    assert wide[0] > 1.2 * wide[1]
    for machine in (TRIPOD, FIVE_BAR):
        assert pf.plot(machine, size=(3.5, 2.5)).figure.get_size_inches() == pytest.approx([3.5, 2.5])


def test_a_dark_picture_is_drawn_in_the_colours_of_its_ground() -> None:
    for machine in (TRIPOD, FIVE_BAR):
        axes = pf.plot(machine, theme="dark", names=True)
        assert to_hex(axes.figure.get_facecolor()) == LOOKS["dark"].paper
        texts = [*axes.texts, axes.title, *axes.get_legend().get_texts()]
        colours = {to_hex(text.get_color()) for text in texts if text.get_text()}
        assert colours <= {LOOKS["dark"].ink, LOOKS["dark"].soft}


@pytest.mark.parametrize(
    ("view", "right", "up"),
    [("top", [1, 0, 0], [0, 1, 0]), ("front", [1, 0, 0], [0, 0, 1]), ("side", [0, 1, 0], [0, 0, 1])],
)
def test_views_are_those_of_drawings(view: Any, right: list[float], up: list[float]) -> None:
    assert eye_of(view).axes == pytest.approx(np.array([right, up, np.cross(right, up)]))
    plane = np.array([right, up], float)
    assert eye_on(plane).axes[:2] == pytest.approx(plane)


def test_an_eye_sees_three_equal_directions_and_turns_with_the_order_of_its_axes() -> None:
    lengths = np.linalg.norm(eye_of("iso").axes[:2], axis=0)
    assert lengths == pytest.approx(lengths[0])
    for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        axes = Eye(20.0, 30.0, order).axes  # type: ignore[arg-type]
        assert axes @ axes.T == pytest.approx(np.eye(3))
        assert np.linalg.det(axes) == pytest.approx(1.0)
        assert axes[0, order[2]] == pytest.approx(0.0)  # upright


def test_what_is_nearer_crosses_over_what_is_farther() -> None:
    rng = np.random.default_rng(3)
    lines = [np.column_stack([rng.uniform(-1, 1, (2, 2)), [depth, depth]]) for depth in rng.permutation(30) / 30.0]
    order = far_to_near(lines, [False] * 30)
    assert sorted(order) == list(range(30))
    place = np.argsort(order)
    for a, b in itertools.combinations(range(30), 2):
        across = np.linalg.solve(
            np.column_stack([lines[a][1] - lines[a][0], lines[b][0] - lines[b][1]])[:2], (lines[b][0] - lines[a][0])[:2]
        )
        if (np.abs(across - 0.5) < 0.48).all():
            assert (place[a] < place[b]) == (lines[a][0, 2] < lines[b][0, 2])


def test_a_line_is_before_or_behind_a_plate_by_its_plane_and_not_by_its_middle() -> None:
    corners = np.array([[-1, -1, -3], [1, -1, 3], [1, 1, 3], [-1, 1, -3], [-1, -1, -3]], float)  # it leans
    behind, before = (np.array([[x, -0.5, depth], [x, 0.5, depth]]) for x, depth in ((0.9, 1.0), (-0.9, -1.0)))
    order = far_to_near([behind, corners, before], [False, True, False])
    assert order == [0, 1, 2]


def test_limits_that_hold_an_answer_back_are_named_in_their_own_colour() -> None:
    far = pf.solve_ik(FIVE_BAR, (0, 0, 300))
    axes = pf.plot(far, names=["p1"])
    names = {text.get_text(): to_hex(text.get_color()) for text in axes.texts}
    held = {f"{limit.joint} {limit.bound}": HELD for limit in far.active_limits}
    assert len(held) == 2
    assert {name: colour for name, colour in names.items() if colour == HELD} == held
    assert set(names) - set(held) == {"p1"}


@pytest.mark.parametrize("name", ["five_bar", "canfield"])
def test_all_joints_are_named_where_that_is_asked_for(name: str) -> None:
    bare, named = (pf.plot(pf.load(name), names=names) for names in (False, True))
    added = Counter(text.get_text() for text in named.texts) - Counter(text.get_text() for text in bare.texts)
    assert added == Counter(joint.name for joint in pf.load(name).joints)


def machine(name: str) -> Any:
    mechanism = pf.load(name)
    return pf.plot(mechanism, names=mechanism.actuator_names[:: -(-len(mechanism.actuator_names) // 12)])


def in_a_column(name: str) -> Any:
    return pf.plot(pf.load(name), names=True, size=(3.5, 3.0))


def workspace(name: str) -> Any:
    mechanism = pf.load(name)
    length = mechanism.characteristic_length if set(mechanism.task) & set("xyz") else 1.0
    return pf.workspace(mechanism, resolution=0.04 * length).plot()


def singularities(name: str) -> Any:
    mechanism = pf.load(name)
    step = 0.12 * mechanism.characteristic_length
    return pf.singularity_map(mechanism, pf.workspace(mechanism, resolution=step), resolution=2.0 * step).plot()


MACHINES_DRAWN = ("stewart", "five_bar", "nrpm", "hexaglide", "delta", "g1_ankle", "agile_eye", "ankle_rss")
"""Machines of which pictures are drawn every time: in space and in a plane, flat, thin, small, with many joints."""
WORKSPACES = ("five_bar", "ankle_ups", "prr")
OTHER_WORKSPACES = sorted({*pf.catalog()} - {*WORKSPACES, "panda", "serial_arm", "snake60"})


CASES = [
    *(
        pytest.param(machine, name, marks=[pytest.mark.campaign] * (name not in MACHINES_DRAWN))
        for name in pf.catalog()
    ),
    *(pytest.param(in_a_column, name) for name in ("nrpm", "hexaglide", "ucu")),
    *(pytest.param(workspace, name) for name in WORKSPACES),
    *(pytest.param(workspace, name, marks=pytest.mark.campaign) for name in OTHER_WORKSPACES),
    pytest.param(singularities, "five_bar"),  # of one in space: in the tests of these maps
]


@pytest.mark.parametrize(("draw", "name"), CASES)
def test_no_text_hides_another_or_leaves_the_figure(
    draw: Callable[[str], Any], name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert faults(draw(name).figure, monkeypatch) == []


# The shape of a machine, and what is drawn of it.


def test_the_links_of_a_spherical_linkage_are_arcs_about_its_centre() -> None:
    mechanism = pf.load("agile_eye")
    answer = pf.solve_ik(mechanism, pf.pose(mechanism.reference_point, rpy=[10, -15, 20], degrees=True))
    for shown in (mechanism, answer):
        links = [line for line in skeleton_of(shown).parts if line.part.kind == "arc" and line.part.role == "link"]
        assert len(links) == 6
        for link in links:
            far = np.linalg.norm(link.outline, axis=1)
            near, end = np.linalg.norm(link.corners, axis=1)
            assert far == pytest.approx(np.linspace(near, end, len(far)))
            steps = np.linalg.norm(np.diff(link.outline / far[:, None], axis=0), axis=1)
            assert steps == pytest.approx(2.0 * np.sin(np.pi / 4.0 / len(steps)))  # links of a quarter turn
            assert np.linalg.matrix_rank(link.outline, tol=1e-6) == 2  # in a plane through the centre


@pytest.mark.parametrize("name", ["five_bar", "delta", "g1_ankle", "panda", "snake60", "canfield"])
def test_links_between_other_joints_are_straight(name: str) -> None:
    for line in skeleton_of(pf.load(name)).parts:
        assert len(line.outline) == (len(line.corners) + 1 if line.part.kind == "plate" else 2)


def test_a_pair_of_hinges_that_cross_is_no_spherical_linkage_unless_it_carries_the_end_effector() -> None:
    hinges = {"A": ((0, 0, 1), (0, 0, 10)), "B": ((0, 1, 0), (0, 10, 0)), "C": ((1, 0, 0), (10, 0, 0))}
    bodies = ("base", "one", "two", "tip")
    joints = [
        pf.Joint(name, "revolute", bodies[place : place + 2], at=at, axis=axis, actuated=True)
        for place, (name, (axis, at)) in enumerate(hinges.items())
    ]
    wrist = pf.Mechanism("wrist", joints, "tip", (20, 0, 0))
    assert common_centre(wrist) == pytest.approx(np.zeros(3))
    moved = [*joints[:2], dataclasses.replace(joints[2], at=(10, 0, 5))]
    assert common_centre(pf.Mechanism("arm", moved, "tip", (20, 0, 0))) is None


def test_a_machine_is_seen_where_its_joints_are_apart_whatever_its_size_and_never_along_an_axis() -> None:
    for name in ("delta", "stewart", "orthoglide"):
        home = skeleton_of(pf.load(name))
        points = np.array([mark.place for mark in home.marks])
        eye = eye_for(points, home.lines)
        assert eye_for(1e3 * points + [5.0, 6.0, 7.0], 1e3 * home.lines + [5.0, 6.0, 7.0]) == eye
        assert np.linalg.norm(eye.axes[:2], axis=0).min() > 0.2
    none = np.zeros((0, 2, 3))
    thin = np.column_stack([np.zeros(9), np.arange(9.0), np.arange(9.0) ** 2 / 9.0])
    assert np.linalg.norm(eye_for(thin, none).axes[:2, 1]) > 0.7  # not along its length
    assert eye_for(np.zeros((4, 3)), none).elevation == 22.0


def test_lines_are_thinner_where_joints_are_close_and_in_small_axes() -> None:
    def width(machine: pf.Mechanism, size: float) -> float:
        axes = pf.plot(machine, Figure(figsize=(size, size)).add_subplot())
        return max(line.get_linewidth() for line in axes.lines if line.get_path_effects())

    stewart, snake = pf.load("stewart"), pf.load("snake60")
    assert width(stewart, 1.5) < width(stewart, 5.0)
    assert width(snake, 5.0) < width(stewart, 5.0)


BATCH = pf.solve_ik(TRIPOD, [[0, 0, 200], [np.nan] * 3], options=pf.Options(on_invalid="mark"))
SPATIAL_AXES = Figure().add_subplot(projection="3d")
SHORT = pf.track(FIVE_BAR, FIVE_BAR.home_pose[None])
WRONG: list[tuple[Callable[[], Any], type[Exception], str]] = [
    (lambda: pf.plot(BATCH), InvalidArgument, "batch of shape"),
    (lambda: pf.plot(BATCH[1]), InvalidArgument, "INVALID"),
    (lambda: pf.plot("stewart"), InvalidArgument, "str"),  # type: ignore[arg-type]
    (lambda: pf.plot(TRIPOD, SPATIAL_AXES), InvalidArgument, "found three-dimensional axes; expected two-dimensional"),
    (lambda: pf.plot(TRIPOD, view="below"), InvalidArgument, "expected 'top', 'front', 'side', 'iso', or "),  # type: ignore[arg-type]
    (lambda: pf.plot(TRIPOD, view=(91.0, 0.0)), InvalidArgument, "elevation from -90 to 90"),
    (lambda: pf.plot(TRIPOD, size=(3.0, -1.0)), InvalidArgument, "size: .* positive number"),
    (lambda: pf.plot(TRIPOD, size=3.0), InvalidArgument, "width and height in inches"),  # type: ignore[arg-type]
    (lambda: pf.plot(TRIPOD, theme="blue"), InvalidArgument, "'light' or 'dark'"),  # type: ignore[arg-type]
    (lambda: pf.plot(TRIPOD, names=["AA1"]), UnknownName, "did you mean 'A1'"),
    (lambda: pf.plot_travel(pf.Travel(BATCH[0], ())), InvalidArgument, "no direction"),
    (lambda: pf.plot_track(BATCH), InvalidArgument, "expected a Track"),  # type: ignore[arg-type]
    (lambda: pf.plot_track(SHORT, size=(3.0, 2.0)), InvalidArgument, "found 3 x 2 inches; expected 6 x 4 at least"),
    (lambda: pf.animate(SHORT, "film.avi"), InvalidArgument, r"ends in \.gif or \.mp4"),
    (lambda: pf.animate(SHORT, "film.gif", seconds=-1.0), InvalidArgument, "a positive number"),
    (lambda: save_picture(Figure(), Path("a.bmp")), InvalidArgument, r"'a\.bmp'; .* ends in \.png, \.svg or \.pdf"),
    (lambda: save_picture(Figure(), Path("none/a.png")), FileNotFoundError, "none/a.png"),
]


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(("draw", "error", "told"), WRONG, ids=[told for *_, told in WRONG])
def test_what_cannot_be_drawn_or_written_is_refused(draw: Callable[[], Any], error: type[Exception], told: str) -> None:
    with pytest.raises(error, match=told):
        draw()
    assert os.listdir() == []


@pytest.mark.usefixtures("folder")
def test_what_is_missing_is_named_with_what_installs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    animation = import_module("pfabrik.view.animation")  # `pfabrik.view` is a function
    monkeypatch.setattr(shutil, "which", lambda _: None)
    monkeypatch.setattr(animation, "_own_ffmpeg", lambda: None)
    with pytest.raises(MissingLibrary, match=r"need the program ffmpeg; install it with: .*apt"):
        pf.animate(SHORT, "film.mp4")
    monkeypatch.setattr("pfabrik.common.extras.find_spec", lambda _: None)
    with pytest.raises(MissingLibrary, match=r"pictures need matplotlib; .* pip install '\.\[plot\]'"):
        pf.plot(TRIPOD)


# Files.


def test_a_picture_is_the_same_file_every_time(tmp_path: Path) -> None:
    for name in ("one", "two"):
        axes = pf.plot(pf.load("rrr"))
        for ending in ("png", "svg", "pdf"):
            save_picture(axes.figure, tmp_path / f"{name}.{ending}")
    for ending, begins in (("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")):
        one, two = ((tmp_path / f"{name}.{ending}").read_bytes() for name in ("one", "two"))
        assert one == two
        assert one.startswith(begins)


def test_thick_links_that_overlap_are_orange() -> None:
    rods = [f"rod{side}{number}" for side in "LR" for number in (1, 2, 3)]
    hexaglide = pf.load("hexaglide").with_shapes([pf.Shape(rod, thickness=8) for rod in rods])
    share = np.linspace(0, 1, 20)[:, None]
    targets = pf.pose(hexaglide.reference_point + share * [-31.5, -7.1, 15.7], rotvec=share * [-0.142, 0.189, -0.378])
    track = pf.track(hexaglide, targets)
    for row, orange in ((0, 0), (-1, 2)):
        links = [line for line in pf.plot(track[row]).lines if line.get_path_effects()]
        assert sum(to_hex(line.get_color()) == HELD for line in links) == orange


# A path.


def test_a_track_is_drawn_with_its_actuators_and_margins(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = FIVE_BAR
    track = circle_of(machine, 60.0)
    assert not track
    axes = pf.plot_track(track)
    assert list(axes) == ["path", *machine.actuator_names, "margins"]
    p1 = axes["p1"].lines[2].get_ydata()
    assert p1 == pytest.approx(np.degrees(track.actuators[:, 0]))
    assert [text.get_text() for text in axes["p1"].get_yticklabels()] == ["min -60", "max 60"]
    least = np.min(list(pf.margins(track).values()), axis=0)
    drawn = {line.get_label(): np.asarray(line.get_ydata()) for line in axes["margins"].lines}
    named = [name for name in drawn if not name.startswith("_")]
    assert np.min([drawn[name] for name in named], axis=0) == pytest.approx(least)
    assert faults(axes["path"].get_figure(root=True), monkeypatch) == []
    free = circle_of(planar("RRR").without_limits(), 5.0)
    assert "margins" not in pf.plot_track(free, Figure(layout="constrained"))


def frames_of(path: Path) -> tuple[list[np.ndarray], int]:
    """The pictures of a film, and how long it lasts [ms]."""
    frames, lasting = [], 0
    with Image.open(path) as film:
        for frame in range(film.n_frames):
            film.seek(frame)
            frames.append(np.asarray(film.convert("L"), float))
            lasting += film.info["duration"]
    return frames, lasting


def test_a_film_shows_every_step_and_its_axes_stay(tmp_path: Path) -> None:
    track = circle_of(FIVE_BAR, 60.0, 4)
    steps: list[tuple[int, int]] = []
    pf.animate(track, tmp_path / "film.gif", on_progress=lambda *done: steps.append(done))
    assert steps == [(1, 4), (2, 4), (3, 4), (4, 4)]
    frames, lasting = frames_of(tmp_path / "film.gif")
    assert (len(frames), lasting) == (4, 200)
    axes_of = [frame[-40:] for frame in frames]  # ticks and the name of the horizontal axis
    assert max(np.abs(each - axes_of[0]).mean() for each in axes_of) < 0.5
    assert min(np.abs(first - second).mean() for first, second in itertools.pairwise(frames)) > 0.1


def test_a_film_lasts_as_long_as_its_path_or_as_asked_for(tmp_path: Path) -> None:
    track = pf.track(FIVE_BAR, np.repeat(FIVE_BAR.home_pose[None], 8, axis=0), sample_time=0.025)
    for seconds, lasting in ((None, 200), (0.1, 100)):  # frames that are the same count as one
        pf.animate(track, tmp_path / "film.gif", seconds=seconds)
        assert frames_of(tmp_path / "film.gif")[1] == lasting


def test_an_interrupted_film_leaves_nothing_behind(tmp_path: Path) -> None:
    def interrupt(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        pf.animate(circle_of(FIVE_BAR, 10.0, 3), tmp_path / "film.gif", on_progress=interrupt)
    assert os.listdir(tmp_path) == []


def test_mp4_is_written_where_ffmpeg_is(tmp_path: Path) -> None:
    if shutil.which("ffmpeg") is None and find_spec("imageio_ffmpeg") is None:
        pytest.skip("needs the program ffmpeg, which is not installed")
    pf.animate(circle_of(FIVE_BAR, 10.0, 3), tmp_path / "film.mp4", seconds=0.1)
    assert (tmp_path / "film.mp4").read_bytes()[4:8] == b"ftyp"


# How far it can go.


def test_travel_is_drawn_with_what_stops_it(monkeypatch: pytest.MonkeyPatch) -> None:
    found = pf.travel(pf.solve_ik(pf.load("stewart"), (0, 20, 200)))
    assert "<td>BL3 max</td>" in found._repr_html_()
    axes = pf.plot_travel(found)
    assert list(axes) == ["along", "about"]
    widths = [abs(bar.get_width()) for bar in axes["about"].patches]
    assert sorted(widths) == pytest.approx(sorted(np.degrees(found.distances[6:])), rel=1e-5)  # as in the table
    assert "138.6\nBL3 max" in [text.get_text() for text in axes["along"].texts]
    assert faults(axes["along"].figure, monkeypatch) == []


def test_a_way_without_end_and_one_of_stretched_links_say_so(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = FIVE_BAR.without_limits()
    axes = pf.plot_travel(pf.travel(pf.solve_ik(machine, machine.home_pose), along=(0, 0, 1)))["along"]
    assert "p1 stretched" in axes.texts[0].get_text().replace("\n", " ")
    free = gantry(0).without_limits()
    axes = pf.plot_travel(pf.travel(pf.solve_ik(free, free.home_pose)))["along"]
    assert [text.get_text() for text in axes.texts] == ["unlimited", "unlimited"]
    assert faults(axes.figure, monkeypatch) == []


def test_a_scale_is_the_largest_round_length_up_to_any_number() -> None:
    for number in (*np.random.default_rng(0).uniform(1e-9, 1e9, 200), np.nextafter(1000.0, 0.0), 1e23, 0.2, 5.0):
        length = round_length(float(number))
        assert length <= number < 2.6 * length


def test_machines_drawn_like_each_other_are_at_one_scale() -> None:
    machines = pf.load("stewart"), pf.load("linear_delta")
    figure = Figure(figsize=(8.0, 4.0))
    axes = [figure.add_axes((0.5 * k, 0.0, 0.5, 1.0)) for k in (0, 1)]
    for ax, shown, other in zip(axes, machines, reversed(machines), strict=True):
        pf.plot(shown, ax=ax, view="front", like=other)
    assert np.ptp(axes[0].get_xlim()) == pytest.approx(np.ptp(axes[1].get_xlim()))


def test_the_key_names_the_links_that_are_nearest() -> None:
    machine = pf.load("reachy_mini").with_clearance(0.005)
    for depth, said in ((0.0, "nearest"), (0.03, "too near")):
        target = machine.home_pose - depth * np.eye(4)[2][:, None] * np.eye(4)[3]
        key = pf.plot(pf.solve_ik(machine, target @ pf.pose([0, 0, 0], rpy=[0, 10 * depth, 0]))).get_legend()
        assert key is not None
        assert f"{said}: body–head" in [text.get_text() for text in key.get_texts()]


def test_an_arm_is_drawn_seen_end_on(tmp_path: Path) -> None:
    pf.plot(pf.load("snake60"), view="side").figure.savefig(tmp_path / "end-on.png")  # type: ignore[union-attr]
