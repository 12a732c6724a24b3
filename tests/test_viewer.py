"""The viewer without a browser: what it asks, what it answers, what it drops, and what it lets in."""

from __future__ import annotations

import re
import socket
import sys
import threading
import time
import types
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import rich
from rich.console import Console
from scipy.spatial.transform import Rotation

import pfabrik as pf
from command import pfabrik, write_files
from machines import tripod_rps
from pfabrik.answers.margins import nearest_first
from pfabrik.errors import InvalidArgument, MissingLibrary
from pfabrik.view.eye import VIEWS, eye_of
from pfabrik.view.live.distances import limits_left
from pfabrik.view.live.live_machine import backed_off, seen_from
from pfabrik.view.live.panel_html import BARS, NAME, NOTE, margins_html, singular_html, status_html
from pfabrik.view.live.scene import SHAPES, cylinder, fan, quaternion, upright_to
from pfabrik.view.live.session import Session, moved
from pfabrik.view.live.workers import Newest, Watch

pytest.importorskip("viser")

PATIENCE = 60.0  # seconds


def until(true: Callable[[], object]) -> None:
    """Wait until something is so; fail where it does not come."""
    end = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < end, "it did not come"
        time.sleep(0.01)


@pytest.fixture
def shown() -> Iterator[Callable[..., pf.Viewer]]:
    """`view`, whose viewers are closed in the end."""
    opened: list[pf.Viewer] = []

    def view(what: pf.Mechanism | pf.Solution | str | Path) -> pf.Viewer:
        opened.append(pf.view(what, port=18080))
        return opened[-1]

    yield view
    for viewer in opened:
        viewer.close()


def test_a_cell_of_a_notebook_shows_no_banner(
    shown: Callable[..., pf.Viewer], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In a notebook the console of rich hands what is printed to IPython's `display`, past standard output."""
    displayed: list[object] = []
    display = types.ModuleType("IPython.display")
    display.display = displayed.append  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "IPython", types.ModuleType("IPython"))
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    console = Console(force_jupyter=True)
    monkeypatch.setattr(rich, "_console", console)
    viewer = shown(tripod_rps())
    viewer.close()
    assert displayed == []
    assert capsys.readouterr().out == ""
    console.print("what others print is shown")
    assert len(displayed) == 1


# Only the newest.


def test_only_the_newest_of_what_waits_is_answered_and_a_failure_is_told() -> None:
    begun, go_on, answered = threading.Event(), threading.Event(), list[object]()
    worker = Newest(lambda error: answered.append(str(error)))

    def first() -> None:
        begun.set()
        assert go_on.wait(PATIENCE)
        answered.append(0)

    worker.post(first)
    assert begun.wait(PATIENCE)
    for number in range(1, 100):
        worker.post(lambda number=number: answered.append(number))
    go_on.set()
    until(lambda: worker.answered == 2)
    worker.post(lambda: 1 / 0)
    until(lambda: worker.answered == 3)
    worker.post(lambda: answered.append("well"))
    until(lambda: worker.answered == 4)
    assert answered == [0, 99, "division by zero", "well"]
    worker.end()


# What is asked, and what is answered.


def test_a_target_beyond_a_stroke_names_the_limit_and_stays_what_was_asked() -> None:
    machine = pf.load("stewart")
    session = Session(machine)
    assert session.sentence == "reached"
    far = pf.pose((0, 20, 300))
    session.go_to(far)
    assert session.solution.status == pf.Status.PROJECTED
    assert session.target == pytest.approx(far)
    names = {f"{each.joint} {each.bound}" for each in session.solution.active_limits}
    assert all(name.split()[0] in session.sentence for name in names)
    joint, bound, margin = nearest_first(session.solution)[0]
    assert margin == pytest.approx(0.0, abs=1e-6)
    assert f"{joint} {bound}" in names
    session.go_to(machine.home_pose)
    assert session.solution.status == pf.Status.REACHED


def test_actuator_values_that_cannot_be_stay_what_was_asked() -> None:
    session = Session(pf.load("five_bar"))
    session.drive(np.radians([30.0, -75.0]))
    assert session.actuators == pytest.approx(np.radians([30.0, -75.0]))
    assert session.solution.status == pf.Status.PROJECTED
    assert "p4 at its maximum" in session.sentence
    assert session.target == pytest.approx(session.solution.pose)


def test_answers_stay_in_the_working_mode_that_was_chosen() -> None:
    machine = pf.load("rrr").without_limits()
    session = Session(machine)
    mode = pf.working_modes(machine, machine.home_pose)[1]
    session.show(mode)
    assert session.start is mode
    session.go_to(moved(machine.home_pose, "x", 2.0))
    assert session.solution.actuators == pytest.approx(mode.actuators, abs=0.2)
    assert np.abs(session.solution.actuators - pf.solve_ik(machine, session.target).actuators).max() > 0.3


def test_coordinates_of_a_target_are_changed_one_by_one_and_its_copy_is_the_target() -> None:
    target = pf.pose((1, 2, 3), rpy=(10, 20, 30), degrees=True)
    assert moved(target, "y", 5.0) == pytest.approx(pf.pose((1, 5, 3), rpy=(10, 20, 30), degrees=True))
    assert moved(target, "pitch", -5.0) == pytest.approx(pf.pose((1, 2, 3), rpy=(10, -5, 30), degrees=True))
    session = Session(pf.load("stewart"))
    session.go_to(pf.pose((10, -20, 200), rpy=(5, 0, -3), degrees=True))
    assert eval(session.pose_as_python, {"pf": pf}) == pytest.approx(session.target)


def test_what_is_left_to_a_limit_is_its_margin_of_half_the_range() -> None:
    for name in ("stewart", "reachy_mini", "five_bar", "g1_ankle"):
        machine = pf.load(name)
        for left in limits_left(pf.solve_ik(machine, machine.home_pose)):
            joint, bound = left.name.split()
            described = machine.joint(joint)
            half = described.cone.half_angle if bound == "cone" else 0.5 * np.ptp(described.range)
            expected = left.margin * half
            assert left.left == pytest.approx(np.degrees(expected) if left.unit == "deg" else expected, abs=1e-6), left


def test_each_gesture_is_a_step_that_is_undone() -> None:
    session = Session(pf.load("stewart"))
    for gesture, height in (("drag", 195.0), ("drag", 200.0), ("slider", 205.0)):
        session.remember(gesture)
        session.go_to(pf.pose((0, 0, height)))
    heights = []
    for _ in range(3):
        session.undo()
        heights.append(session.target[2, 3])
    assert heights == pytest.approx([200.0, *[session.mechanism.home_pose[2, 3]] * 2])


# Singularities: forearms of a 5-bar in line with each other, straight below home.


def test_a_five_bar_is_dragged_through_its_singularity_and_driven_no_farther() -> None:
    free = pf.load("five_bar").without_limits()
    height = np.sqrt(110.0**2 - (145.0 - 50.0) ** 2)  # of the elbows, 145 mm to the left and right of the tip
    session = Session(free)
    seen = []
    for above in (60.0, 20.0, 1e-4, -20.0):
        session.go_to(pf.pose((0, 0, height + above)))
        assert session.solution.status == pf.Status.REACHED
        seen.append((session.nearness[1].share, session.is_across))
    shares, across = zip(*seen, strict=True)
    assert shares[0] > shares[1] > shares[2]
    assert shares[2] == pytest.approx(0.0, abs=0.01)
    assert across == (False, False, False, True)
    assert "passed a parallel singularity" in singular_html(session)
    session.show(session.home)
    session.drive(np.radians([60.0, -60.0]))  # both outward: the forearms are too short
    assert session.solution.status == pf.Status.PROJECTED
    assert session.solution.pose[2, 3] == pytest.approx(height, abs=0.1)
    assert not session.is_across


def test_the_leg_that_is_nearest_to_its_dead_point_is_named() -> None:
    free = pf.load("five_bar").without_limits()
    session = Session(free)
    reach = 254.9  # of 255 mm, with the left leg stretched
    session.go_to(pf.pose((0, -50 + reach * np.sin(0.5), reach * np.cos(0.5))))
    serial, _ = session.nearness
    assert serial.leg == "p1"
    assert serial.share < 0.1
    assert "serial: p1" in singular_html(session)


# Shapes.


def test_meshes_are_closed_and_face_outward() -> None:
    for make in (cylinder, *SHAPES.values()):
        vertices, faces = make()
        triangles = vertices[faces].astype(float)
        normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        assert np.abs(normals.sum(axis=0)).max() < 1e-5
        assert (triangles[:, 0] * normals).sum() > 0.0


def test_turns_are_those_of_scipy() -> None:
    rng = np.random.default_rng(3)
    special = Rotation.from_rotvec([[np.pi, 0, 0], [0, np.pi, 0], [0, 0, np.pi], [0, 0, 0]])
    for rotation in Rotation.concatenate([Rotation.random(50, rng), special]):
        w, x, y, z = quaternion(rotation.as_matrix())
        assert (Rotation.from_quat([x, y, z, w]) * rotation.inv()).magnitude() < 1e-7
    for direction in (*rng.normal(size=(20, 3)), np.array([0, 0, -2.0]), np.array([0, 0, 1.0])):
        w, x, y, z = upright_to(direction[None])[0]
        turned = Rotation.from_quat([x, y, z, w]).apply([0, 0, 1])
        assert turned == pytest.approx(direction / np.linalg.norm(direction))
    assert upright_to(np.zeros((1, 3)))[0] == pytest.approx([1, 0, 0, 0])


def test_a_face_is_triangles_about_its_middle() -> None:
    square = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]], float)
    vertices, faces = fan(square)
    assert vertices[4] == pytest.approx([1, 1, 0])
    corners = vertices[faces]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] / 2
    assert areas.sum() == pytest.approx(4.0)


# The server.


def test_only_this_computer_is_let_in_unless_told(shown: Callable[..., pf.Viewer]) -> None:
    viewer = shown(pf.load("five_bar"))
    port = int(viewer.url.rpartition(":")[2])
    assert viewer.url.startswith("http://127.0.0.1:")
    with socket.create_connection(("127.0.0.1", port), timeout=5):
        pass
    with pytest.raises(OSError, match="refused"), socket.create_connection(("127.0.0.2", port), timeout=5):
        pass
    assert viewer._server.request_share_url() is None
    assert f'<iframe src="{viewer.url}"' in viewer._repr_html_()


def test_motions_of_the_mouse_reach_the_answer(shown: Callable[..., pf.Viewer]) -> None:
    machine = pf.load("stewart")
    viewer = shown(machine)
    viewer._drag(pf.pose((0, 0, 300)), 1)
    until(lambda: viewer.solution.status == pf.Status.PROJECTED)
    until(lambda: "struts BL1, BL2" in viewer._stage.panel._status.content)
    viewer._change_target("z", 200.0)
    until(lambda: viewer.solution.status == pf.Status.REACHED)
    assert viewer.solution.pose[2, 3] == pytest.approx(200.0)
    until(lambda: viewer._stage.actuators == pytest.approx(viewer.solution.actuators))  # sliders have followed
    viewer._change_actuator(0, 190.0)
    viewer._change_actuator(1, 200.0)
    until(lambda: viewer.solution.actuators[:2] == pytest.approx([190.0, 200.0]))
    viewer._go_home()
    until(lambda: viewer.solution.pose == pytest.approx(machine.home_pose))


def test_joints_in_series_are_targets_with_sliders_of_their_own(shown: Callable[..., pf.Viewer]) -> None:
    """Both run ahead of the answers; what is beyond reach stays what was asked, and the limit is named."""
    viewer = shown("g1_ankle")
    viewer._change_joint(0, np.radians(-10.0))
    viewer._change_joint(1, np.radians(5.0))
    until(lambda: np.degrees(viewer.solution.joints["roll_joint"]) == pytest.approx(5.0))
    assert np.degrees(viewer.solution.joints["pitch_joint"]) == pytest.approx(-10.0)
    until(lambda: [slider.value for slider in viewer._stage.panel._joints] == pytest.approx([-10.0, 5.0]))
    viewer._change_joint(1, np.radians(20.0))
    until(lambda: "roll_joint" in viewer._stage.panel._status.content)
    assert np.degrees(viewer._stage.session.joints) == pytest.approx([-10.0, 20.0])
    assert not shown("stewart")._stage.panel._joints


def test_modes_are_listed_and_taken(shown: Callable[..., pf.Viewer]) -> None:
    viewer = shown("five_bar")
    viewer._searches.find_modes("working")
    until(lambda: len(viewer._stage.modes) == 4)
    until(lambda: viewer._stage.panel._modes.options[2] == "2: beyond p4 min; p5 max")
    viewer._take_mode(1)
    until(lambda: viewer.solution.status == pf.Status.EXCEEDED)
    until(lambda: "p4 min" in viewer._stage.panel._status.content)


def test_the_border_of_the_workspace_is_shown_on_request(shown: Callable[..., pf.Viewer]) -> None:
    viewer = shown("five_bar")
    panel, borders = viewer._stage.panel, viewer._stage.scene._borders
    panel._borders["workspace"].value = True
    viewer._searches.show_border("workspace", True)
    until(lambda: "mm²" in panel._note.content)
    told = panel._legend.content
    assert "p1, 5 max, actuated: 29%" in told and "p2, 4 max: 21%" in told, told  # as in the picture
    assert borders["workspace"]
    viewer._searches.show_border("workspace", False)
    assert not borders["workspace"]


def test_a_search_that_is_no_longer_wanted_ends_and_says_no_more(
    shown: Callable[..., pf.Viewer], monkeypatch: pytest.MonkeyPatch
) -> None:
    viewer = shown("stewart")
    panel, searches, said = viewer._stage.panel, viewer._searches, list[str]()

    def tell(words: str) -> None:
        said.append(words)
        panel._borders["workspace"].value = "%" not in words  # unticked as soon as it is on its way

    monkeypatch.setattr(panel, "tell", tell)
    panel._borders["workspace"].value = True
    searches.show_border("workspace", True)
    until(lambda: searches._newest.answered == 1)
    assert len(said) == 2 and "%" in said[1] and searches._space is None


def test_singularities_are_shown_where_they_are_and_limits_are_let_go(shown: Callable[..., pf.Viewer]) -> None:
    viewer = shown("five_bar")
    machine = viewer.mechanism
    viewer._keep_limits(False)
    until(lambda: viewer.mechanism == machine.without_limits())
    assert viewer.solution.pose == pytest.approx(machine.home_pose)
    viewer._stage.panel._borders["locus"].value = True
    viewer._searches.show_border("locus", True)
    until(lambda: viewer._stage._borders.get("locus"))
    (locus,) = viewer._stage._borders["locus"]
    there = pf.solve_ik(viewer.mechanism, locus.corners[::16, 0], start=viewer.solution)
    assert np.asarray(pf.singularity(there).parallel) == pytest.approx(0.0, abs=0.05)
    viewer.show(pf.solve_ik(machine, (0, 0, 190)))
    assert viewer.mechanism == machine


def test_sliders_are_those_of_the_freedoms_and_their_numbers_fit(shown: Callable[..., pf.Viewer]) -> None:
    assert list(shown("five_bar")._stage.panel._target) == ["y", "z"]
    assert list(shown("rrr")._stage.panel._target) == ["x", "y", "yaw"]
    viewer = shown("reachy_mini")
    assert list(viewer._stage.panel._target) == ["x", "y", "z", "roll", "pitch", "yaw"]
    viewer._change_target("z", 0.1834567891)
    until(lambda: viewer.target[2, 3] == 0.1834567891)
    until(lambda: viewer._stage.panel._target["z"].value == pytest.approx(0.1834567891, abs=1e-5))
    for slider in (*viewer._stage.panel._target.values(), *viewer._stage.panel._actuators):
        assert len(f"{slider.value:g}") <= 7, slider.label


def test_what_is_done_is_undone(shown: Callable[..., pf.Viewer]) -> None:
    viewer = shown("stewart")
    home = viewer.mechanism.home_pose
    viewer._drag(pf.pose((0, 0, 200)), 1)
    until(lambda: viewer.target[2, 3] == 200.0)
    viewer._change_actuator(0, 200.0)
    until(lambda: viewer.solution.actuators[0] == pytest.approx(200.0))
    viewer._change_target("yaw", 10.0)
    for _ in range(2):  # the same value again is nothing to undo
        viewer._asked_by = ""
        until(lambda: viewer._newest.answered == viewer._stage.asked)
        viewer._change_target("yaw", 10.0)
    until(lambda: viewer._newest.answered == viewer._stage.asked)
    viewer._undo()
    until(lambda: viewer.solution.actuators[0] == pytest.approx(200.0))
    viewer._undo()
    until(lambda: viewer.solution.pose == pytest.approx(pf.pose((0, 0, 200))))
    viewer._undo()
    until(lambda: viewer.solution.pose == pytest.approx(home))


def test_views_look_at_the_machine_from_where_they_say() -> None:
    """That is where pictures are seen from; at first a planar machine is seen in its plane."""
    for name, straight in (("stewart", (1, -1, 1)), ("five_bar", (1, 0, 0)), ("rrr", (0, 0, 1))):
        for view in (*VIEWS, None):
            direction, up = seen_from(pf.load(name), view)
            assert abs(direction @ up) < 0.9
            expected = np.array(straight) / np.linalg.norm(straight) if view is None else eye_of(view).axes[2]
            assert direction == pytest.approx(expected)


def test_a_track_is_played_step_by_step(shown: Callable[..., pf.Viewer]) -> None:
    machine = pf.load("five_bar")
    track = pf.track(machine, np.linspace([0, 0, 175], [0, 0, 200], 6))
    viewer = shown(track)
    viewer._take_step(6)
    until(lambda: viewer.solution.pose == pytest.approx(track[5].pose))
    viewer._play(True)
    until(lambda: viewer.solution.pose == pytest.approx(track[2].pose))
    viewer._play(False)


def test_a_file_is_shown_again_when_it_changes_with_the_target_kept_and_its_faults_told(
    shown: Callable[..., pf.Viewer], tmp_path: Path
) -> None:
    path, stewart = tmp_path / "mine.toml", pf.load("stewart")
    pf.save(stewart, path)
    viewer = shown(path)
    viewer._change_target("z", 200.0)
    until(lambda: viewer.target[2, 3] == pytest.approx(200.0))
    path.write_text(path.read_text(encoding="utf-8").replace("spherical", "sferical"), encoding="utf-8")
    until(lambda: "did you mean" in viewer._stage.panel._note.content)
    assert viewer.mechanism == stewart
    changed = stewart.with_limits({"BL1": (140.0, 240.0)})
    pf.save(changed, path)
    until(lambda: viewer.mechanism == changed)
    until(lambda: viewer.target[2, 3] == pytest.approx(200.0))
    assert viewer.solution.status == pf.Status.REACHED
    pf.save(tripod_rps(), path)
    until(lambda: viewer.mechanism == tripod_rps())
    assert viewer.solution.pose == pytest.approx(tripod_rps().home_pose)


def test_a_file_half_written_is_not_read(tmp_path: Path) -> None:
    path, seen = tmp_path / "a", []
    path.write_text("one")
    watch = Watch(path, lambda changed: seen.append(changed.read_text()))
    path.unlink()
    path.write_text("two, whole")
    until(lambda: seen == ["two, whole"])
    watch.end()


def test_a_page_of_its_own_is_written_whole_or_not_at_all(shown: Callable[..., pf.Viewer], tmp_path: Path) -> None:
    viewer = shown("five_bar")
    viewer.save(tmp_path / "five_bar.html")
    page = (tmp_path / "five_bar.html").read_text(encoding="utf-8")
    assert page.lstrip().lower().startswith("<!doctype html>")
    with pytest.raises(InvalidArgument, match=r"ends in \.html"):
        viewer.save(tmp_path / "five_bar.pdf")
    assert [path.name for path in tmp_path.iterdir()] == ["five_bar.html"]


def test_what_cannot_be_shown_is_refused(shown: Callable[..., pf.Viewer], monkeypatch: pytest.MonkeyPatch) -> None:
    machine = pf.load("five_bar")
    with pytest.raises(InvalidArgument, match="batch"):
        pf.view(pf.solve_ik(machine, [[0, 0, 180], [0, 0, 190]]))
    with pytest.raises(InvalidArgument, match="from 1 to 65535"):
        pf.view(machine, port=0)
    with pytest.raises(InvalidArgument, match="one Solution of"):
        shown(machine).show(pf.solve_ik(tripod_rps(), (0, 0, 210)))
    monkeypatch.setattr("pfabrik.common.extras.find_spec", lambda _: None)
    with pytest.raises(MissingLibrary, match=r"the viewer needs viser; install it with: pip install '\.\[view\]'"):
        pf.view(machine)


@pytest.mark.usefixtures("folder")
def test_the_command_writes_a_page_and_refuses_what_it_cannot() -> None:
    write_files("path.csv")
    result = pfabrik("view five_bar --track path.csv --html a.html --port 18080")
    assert (result.exit_code, result.stdout) == (0, "wrote a.html\n"), result.stderr
    assert Path("a.html").stat().st_size > 100_000
    for line in ("view five_bar --html a.txt", "view five_bra", "view five_bar --port 0"):
        assert pfabrik(line).exit_code == 2


def test_a_panel_does_not_jump_while_values_change() -> None:
    """Status and bars have a height of their own, whatever they say, and names of limits have one line."""
    session = Session(pf.load("stewart"))
    heights, rows = set(), set()
    for target in ((0, 0, 190), (0, 0, 400), (60, 40, 260), (-90, 20, 100)):
        session.go_to(pf.pose(target))
        heights.add(re.findall(r"height:[0-9.]+em;overflow:auto", status_html(session))[0])
        rows.add(
            (margins_html(session).count(NAME), singular_html(session).count(NAME), NOTE in singular_html(session))
        )
    assert len(heights) == 1
    assert rows == {(BARS, 2, True)}


def test_a_camera_moves_back_until_the_target_is_in_view() -> None:
    middle, place, angle = np.zeros(3), np.array([3.0, -1.0, 0.5]), 0.9
    along = -place / np.linalg.norm(place)
    rng = np.random.default_rng(5)
    for point in rng.normal(0.0, 3.0, (50, 3)):
        moved_to = backed_off(place, middle, angle, point)
        away = point - moved_to
        seen = np.arccos(np.clip(away @ along / np.linalg.norm(away), -1.0, 1.0))
        assert seen <= 0.5 * angle
        step = place - moved_to
        assert np.linalg.norm(np.cross(step, along)) < 1e-9
        assert step @ along >= -1e-12
    assert backed_off(place, middle, angle, middle) == pytest.approx(place)


def test_a_handle_in_the_hand_of_a_page_that_went_follows_again(shown: Callable[..., pf.Viewer]) -> None:
    viewer = shown(pf.load("stewart"))
    handles = viewer._stage._handles
    handles._held = handle = handles._all[0]
    viewer.show(pf.solve_ik(viewer.mechanism, (0, 0, 200)))
    before = handle.position[2]
    viewer._stage.release()
    viewer.show(pf.solve_ik(viewer.mechanism, (0, 0, 210)))
    assert handle.position[2] * viewer.mechanism.characteristic_length == pytest.approx(210.0)
    assert handle.position[2] != before


def test_a_taken_port_is_told_in_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        monkeypatch.setattr(pf.Viewer, "wait", lambda _: None)
        told = pfabrik(f"view stewart --no-browser --port {port}")
    (served,) = re.findall(rf"port {port} is taken: served at (\d+) instead", told.output)
    assert int(served) != port
    assert f"localhost:{served} " in told.output or f"127.0.0.1:{served} " in told.output


def test_thick_links_move_with_the_machine(shown: Callable[..., pf.Viewer]) -> None:
    stewart = pf.load("stewart")
    struts = [
        pf.Shape(f"rod{side}{k}", between=(f"A{side}{k}", f"C{side}{k}"), thickness=9) for side in "LR" for k in (1, 2)
    ]
    thick = stewart.with_shapes([*struts, pf.Shape("platform", "sphere", at=(0, 0, 240), diameter=20)])
    viewer = shown(thick)
    solids = viewer._stage.scene._solids
    assert len(solids) == 5
    line, words = viewer._stage.scene._distance
    ends = line.points[0].astype(float) * thick.characteristic_length
    apart = pf.clearance(viewer.solution)
    assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(apart.distance, abs=1e-3)
    assert words.text == f"{apart.distance:.3g} mm"
    viewer._show_solids(False)
    assert not any(node.visible for node in (*solids, *viewer._stage.scene._distance))
    viewer._show_solids(True)
    before = solids[-1].vertices.mean(axis=0).copy()
    viewer.show(pf.solve_ik(thick, (0, 0, 210)))
    moved = solids[-1].vertices.mean(axis=0) - before
    assert np.allclose(moved * thick.characteristic_length, [0, 0, 15], atol=1e-3)
