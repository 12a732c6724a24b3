"""The viewer without a browser: whom it lets in, what it answers to its page, and what a program reads."""

from __future__ import annotations

import base64
import http.client
import json
import re
import shutil
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest

import pfabrik as pf
from command import pfabrik, write_files
from machines import tripod_rps
from pfabrik.errors import InvalidArgument
from pfabrik.view.page import borders
from pfabrik.view.page.distances import leg_at_dead_point, limits_left, side_of
from pfabrik.view.page.export_web import FOLDER
from pfabrik.view.page.page_answers import configuration_from, page_answer
from pfabrik.view.page.watch import Watch

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


def sent(viewer: pf.Viewer, place: str, body: object = None, **headers: str) -> tuple[int, str, dict[str, str]]:
    """The status, the text and the headers that the server answers at a place behind the token."""
    address = urlsplit(viewer.url)
    with closing(http.client.HTTPConnection(address.hostname or "", viewer.port, timeout=PATIENCE)) as connection:
        path = place if place.startswith("/") else address.path + place
        text = None if body is None else json.dumps(body)
        connection.request("GET" if body is None else "POST", path, text, headers)
        answer = connection.getresponse()
        return answer.status, answer.read().decode(), dict(answer.getheaders())


def asked(viewer: pf.Viewer, question: str, **data: Any) -> list[dict[str, Any]]:
    """What the viewer answers to a question of its page."""
    status, text, _ = sent(viewer, question, data)
    assert status == 200
    return [json.loads(line) for line in text.splitlines()]


def machine_of(viewer: pf.Viewer, place: str = "") -> dict[str, Any]:
    """What the page knows of its machine."""
    text = sent(viewer, place)[1]
    found = re.search(r'id="machine">(.*?)</script>', text, re.S)
    assert found
    return dict(json.loads(found[1]))


# Whom it lets in.


def test_only_this_computer_is_let_in_unless_told(shown: Callable[..., pf.Viewer]) -> None:
    viewer = shown("five_bar")
    assert viewer.url.startswith(f"http://127.0.0.1:{viewer.port}/")
    with pytest.raises(OSError, match="refused"), socket.create_connection(("127.0.0.2", viewer.port), timeout=5):
        pass
    assert f'<iframe src="{viewer.url}"' in viewer._repr_html_()
    assert shown("five_bar").url != viewer.url


def test_pages_of_others_are_refused_and_nothing_is_asked_of_them(shown: Callable[..., pf.Viewer]) -> None:
    """Without the token of the address, from another origin, or by a name that was bound to this computer."""
    viewer = shown("five_bar")
    own = f"127.0.0.1:{viewer.port}"
    state = {"target": np.eye(4).ravel().tolist(), "asked": "pose", "answer": page_answer(viewer.solution)}
    strangers: list[tuple[str, dict[str, str]]] = [
        ("/", {}),
        ("/state", {}),
        (f"/{'x' * 22}/state", {}),
        ("state", {"Origin": "http://evil.example"}),
        ("state", {"Origin": "null"}),
        ("state", {"Origin": f"http://localhost:{viewer.port}"}),
        ("state", {"Host": f"evil.example:{viewer.port}", "Origin": f"http://evil.example:{viewer.port}"}),
    ]
    for place, headers in strangers:
        for body in (None, state):
            assert sent(viewer, place, body, **headers)[0] == 403, (place, headers)
    assert viewer.target == pytest.approx(viewer.mechanism.home_pose)
    for host in (own, f"localhost:{viewer.port}", f"[::1]:{viewer.port}"):
        assert sent(viewer, "", Host=host)[0] == 200
    assert sent(viewer, "state", state, Origin=f"http://{own}")[0] == 200
    _, text, headers = sent(viewer, "")
    assert headers["Referrer-Policy"] == "no-referrer"
    policy = headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy and "connect-src 'self'" in policy
    assert not re.search(r"https?://(?!www\.w3\.org)", text)


@pytest.mark.parametrize(("body", "status"), [("{", 400), ("[" * 100_000, 400), (" " * 5_000_000, 413)])
def test_what_is_no_question_is_refused(shown: Callable[..., pf.Viewer], body: str, status: int) -> None:
    viewer = shown("five_bar")
    address = urlsplit(viewer.url)
    with closing(http.client.HTTPConnection("127.0.0.1", viewer.port, timeout=PATIENCE)) as connection:
        connection.putrequest("POST", address.path + "state")
        connection.putheader("Content-Length", str(len(body)))
        connection.endheaders(body.encode() if status != 413 else None)
        assert connection.getresponse().status == status
    assert "error" in asked(viewer, "ask", target=[1.0], asked="pose")[0]
    assert "error" in asked(viewer, "state", target=[1.0], asked="pose")[0]
    assert "error" in asked(viewer, "unheard_of")[0]
    assert viewer.target == pytest.approx(viewer.mechanism.home_pose)


def test_a_taken_port_is_told_in_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        monkeypatch.setattr(pf.Viewer, "wait", lambda _: None)
        told = pfabrik(f"view stewart --no-browser --port {port}")
    (served,) = re.findall(rf"port {port} is taken: served at (\d+) instead", told.output)
    assert int(served) != port
    assert f"http://127.0.0.1:{served}/" in told.output


def test_a_viewer_that_is_closed_leaves_no_thread(shown: Callable[..., pf.Viewer]) -> None:
    before = set(threading.enumerate())
    viewer = shown(pf.load("five_bar"))
    connection = http.client.HTTPConnection("127.0.0.1", viewer.port, timeout=PATIENCE)
    connection.request("GET", urlsplit(viewer.url).path + "events")
    events = connection.getresponse()
    assert events.readline() == b"event: version\n"
    viewer.close()
    assert b"event" not in events.read()
    until(lambda: set(threading.enumerate()) <= before)
    connection.close()


# What it answers to its page.


@pytest.mark.parametrize("name", ["stewart", "five_bar", "nrpm", "panda"])
def test_an_answer_comes_back_from_a_page_as_it_went_there(name: str) -> None:
    """Of legs as their pose and branches, of other machines as joint coordinates; through JSON."""
    machine = pf.load(name)
    away = machine.home_pose @ pf.pose(0.05 * machine.characteristic_length * np.ones(3))
    for solution in (pf.solve_ik(machine, machine.home_pose), pf.solve_ik(machine, away)):
        there = json.loads(json.dumps(page_answer(solution)))
        back = configuration_from(machine, there)
        assert back.q == pytest.approx(solution.q, abs=1e-7 * machine.characteristic_length)
        assert there["status"] == solution.status


def test_python_answers_a_page_that_cannot(shown: Callable[..., pf.Viewer]) -> None:
    viewer = shown("panda")
    machine = viewer.mechanism
    start = page_answer(pf.solve_ik(machine, machine.home_pose))
    for target in (pf.pose((300, 50, 500)), pf.pose((3000, 50, 500))):
        (answer,) = asked(viewer, "ask", asked="pose", target=target.ravel().tolist(), answer=start)
        expected = pf.solve_ik(machine, target, start=pf.solve_ik(machine, machine.home_pose))
        assert answer["status"] == expected.status
        assert answer["actuators"] == pytest.approx(expected.actuators, abs=1e-9)
        assert len(answer["frames"]) == len(machine.bodies) - 2
    values = [0.1, -0.5, 0.0, -2.0, 0.0, 1.5, 0.5]
    (answer,) = asked(viewer, "ask", asked="actuators", values=values, target=start["pose"], answer=start)
    assert np.reshape(answer["pose"], (4, 4)) == pytest.approx(pf.solve_fk(machine, values).pose)
    more = asked(viewer, "more", answer=start, directions=[["along", [0, 0, 1]], ["about", [0, 0, -1]]])
    here = configuration_from(machine, start)
    expected_travel = [pf.travel(here, along=(0, 0, 1))[0], pf.travel(here, about=(0, 0, -1))[0]]
    assert [each["reach"]["distance"] for each in more[2:]] == pytest.approx([e.distance for e in expected_travel])
    assert more[1]["singular"]["serial"] == pytest.approx(pf.singularity(here).serial)


def test_the_state_of_a_page_is_what_a_program_reads(shown: Callable[..., pf.Viewer]) -> None:
    """A target beyond reach stays what was asked, as do values that do not fit; and what has no limits is told so."""
    viewer = shown("five_bar")
    machine = viewer.mechanism
    home = page_answer(pf.solve_ik(machine, machine.home_pose))
    far = pf.pose((0, 30, 400))
    asked(viewer, "state", asked="pose", target=far.ravel().tolist(), answer=home)
    assert viewer.target == pytest.approx(far)
    assert viewer.solution.status == pf.Status.PROJECTED
    assert viewer.solution.pose == pytest.approx(pf.solve_ik(machine, far).pose, abs=1e-6)
    values = np.radians([30.0, -75.0]).tolist()
    asked(viewer, "state", asked="actuators", target=far.ravel().tolist(), values=values, answer=home)
    assert "p4 at its maximum" in viewer.solution.reason
    asked(viewer, "state", free=True, asked="configuration", target=home["pose"], answer=home)
    assert viewer.mechanism == machine.without_limits()
    viewer.show(pf.solve_ik(machine, (0, 0, 190)))
    assert viewer.mechanism == machine
    assert viewer.target[2, 3] == pytest.approx(190.0)


def test_answers_stay_in_the_working_mode_that_was_chosen(shown: Callable[..., pf.Viewer]) -> None:
    viewer = shown(pf.load("rrr").without_limits())
    machine = viewer.mechanism
    mode, moved = pf.working_modes(machine, machine.home_pose)[1], machine.home_pose.copy()
    moved[0, 3] += 2.0
    asked(viewer, "state", asked="pose", target=moved.ravel().tolist(), answer=page_answer(mode))
    assert viewer.solution.actuators == pytest.approx(mode.actuators, abs=0.2)
    assert np.abs(viewer.solution.actuators - pf.solve_ik(machine, moved).actuators).max() > 0.3


NEWEST = """
const asked = [], told = [];
const fetch = (question, { body }) => {
  asked.push(JSON.parse(body));
  const line = body === "3" ? '{"error": "no"}' : body;
  return new Promise((go) => setTimeout(() => go(new Response(line + "\\n")), 5));
};
const newest = new Newest("ask", (error) => {
  told.push(error);
  newest.ask(() => 5, tell);
});
const tell = (answer, isLast) => {
  told.push([answer, isLast]);
  if (answer === 4) newest.ask(() => 3);
  if (answer === 5) console.log(JSON.stringify([asked, told]));
};
for (const k of [0, 1, 2, 3, 4]) newest.ask(() => k, tell);
"""


@pytest.mark.skipif(shutil.which("node") is None, reason="needs Node.js, which is not installed")
def test_only_the_newest_of_what_waits_is_asked_and_a_failure_is_told() -> None:
    """The first is on its way when the others come."""
    script = (FOLDER / "web" / "remote.js").read_text(encoding="utf-8")
    text = f"class StillEngine {{}}\n{script}\n{NEWEST}"
    ran = subprocess.run(["node", "-"], input=text, capture_output=True, text=True, check=True)
    assert json.loads(ran.stdout) == [[0, 4, 3, 5], [[0, False], [4, True], "no", [5, True]]]


def test_why_no_limit_holds_an_answer_back_is_a_reason(shown: Callable[..., pf.Viewer]) -> None:
    """Both cranks of a 5-bar without limits driven outward: its forearms are too short."""
    viewer = shown("five_bar")
    free = viewer.mechanism.without_limits()
    values = np.radians([60.0, -60.0])
    answer = page_answer(pf.solve_fk(free, values))
    state = {"asked": "actuators", "values": values.tolist(), "target": answer["pose"], "answer": answer}
    (reason,) = [each["reason"] for each in asked(viewer, "more", free=True, **state) if "reason" in each]
    assert "the assembly mode ends at a dead point, a parallel singularity" in reason


def test_borders_and_singularities_are_sent_with_their_colours(shown: Callable[..., pf.Viewer]) -> None:
    """Singularities where the parallel measure is 0; the border as the workspace has it."""
    viewer = shown("five_bar")
    home = page_answer(viewer.solution)
    found = asked(viewer, "borders", names=["workspace"], answer=home)
    assert found[0]["note"].startswith("looking for the workspace")
    (border,) = [each["patches"] for each in found if "border" in each]
    assert "p1, 5 max, actuated: 29%" in [patch["words"] for patch in border]
    assert "mm²" in found[-1]["note"]
    found = asked(viewer, "borders", free=True, names=["locus"], answer=home)
    ((locus,),) = [each["patches"] for each in found if "border" in each]
    free = viewer.mechanism.without_limits()
    corners = np.frombuffer(base64.b64decode(locus["corners"]), "<f4").reshape(-1, locus["sides"], 3)
    points = corners[::16, 0].astype(float) * free.characteristic_length
    there = pf.solve_ik(free, points, start=pf.solve_ik(free, free.home_pose))
    assert np.asarray(pf.singularity(there).parallel) == pytest.approx(0.0, abs=0.05)


def test_a_search_that_nobody_waits_for_ends(shown: Callable[..., pf.Viewer], monkeypatch: pytest.MonkeyPatch) -> None:
    viewer = shown("stewart")
    ended = threading.Event()
    find = borders.Borders.send

    def send(self: borders.Borders, *given: Any) -> None:
        try:
            find(self, *given)
        except OSError:
            ended.set()
            raise

    monkeypatch.setattr(borders.Borders, "send", send)
    body = json.dumps({"names": ["workspace"], "answer": page_answer(viewer.solution)})
    connection = http.client.HTTPConnection("127.0.0.1", viewer.port, timeout=PATIENCE)
    connection.request("POST", urlsplit(viewer.url).path + "borders", body)
    answer = connection.getresponse()
    assert "looking for" in answer.readline().decode()
    answer.close()
    connection.close()
    assert ended.wait(PATIENCE)


def test_modes_are_told_with_what_they_exceed(shown: Callable[..., pf.Viewer]) -> None:
    viewer = shown("five_bar")
    (found,) = asked(viewer, "modes", kind="working", target=viewer.target.ravel().tolist())
    assert found["modes"][1]["words"] == "beyond p4 min; p5 max"
    assert len(found["modes"]) == 4
    (found,) = asked(viewer, "modes", kind="assembly", values=viewer.solution.actuators.tolist())
    assert len(found["modes"]) == len(pf.assembly_modes(viewer.mechanism, viewer.solution.actuators))


def test_what_is_left_to_a_limit_is_its_margin_of_half_the_range() -> None:
    for name in ("stewart", "reachy_mini", "five_bar", "g1_ankle"):
        machine = pf.load(name)
        for left in limits_left(pf.solve_ik(machine, machine.home_pose)):
            joint, bound = left.name.split()
            described = machine.joint(joint)
            half = described.cone.half_angle if bound == "cone" else 0.5 * np.ptp(described.range)
            expected = left.margin * half
            assert left.left == pytest.approx(np.degrees(expected) if left.unit == "deg" else expected, abs=1e-6), left


def test_the_leg_that_is_nearest_to_its_dead_point_is_named_and_sides_of_singularities_differ() -> None:
    """Of a 5-bar: at 254.9 of 255 mm its left leg is stretched; straight below home its forearms are in line."""
    free = pf.load("five_bar").without_limits()
    home = pf.solve_ik(free, free.home_pose)
    reach = 254.9
    stretched = pf.solve_ik(free, (0, -50 + reach * np.sin(0.5), reach * np.cos(0.5)), start=home)
    assert leg_at_dead_point(stretched) == "p1"
    assert leg_at_dead_point(home) == ""
    height = np.sqrt(110.0**2 - (145.0 - 50.0) ** 2)  # of the elbows, 145 mm to the left and right of the tip
    above, below = (pf.solve_ik(free, (0, 0, height + offset), start=home) for offset in (20.0, -20.0))
    assert side_of(above) * side_of(below) == -1.0


# What a program does with it.


def test_a_page_opens_as_it_was_shown_and_a_track_is_in_it(shown: Callable[..., pf.Viewer], tmp_path: Path) -> None:
    machine = pf.load("five_bar")
    track = pf.track(machine, np.linspace([0, 0, 175], [0, 0, 200], 6))
    viewer = shown(track)
    assert machine_of(viewer)["first"]["pose"][11] == pytest.approx(175.0)
    assert machine_of(viewer)["track"]["every"] == 0.05
    viewer.show(track[5])
    assert machine_of(viewer)["first"]["pose"][11] == pytest.approx(200.0)
    assert machine_of(viewer, "?limits=no")["first"] is None
    assert "attachment" in sent(viewer, "saved")[2]["Content-Disposition"]
    viewer.save(tmp_path / "five_bar.html")
    page = (tmp_path / "five_bar.html").read_text(encoding="utf-8")
    assert "EventSource" not in page
    assert page == sent(viewer, "saved")[1]
    with pytest.raises(InvalidArgument, match=r"ends in \.html"):
        viewer.save(tmp_path / "five_bar.pdf")
    assert [path.name for path in tmp_path.iterdir()] == ["five_bar.html"]
    assert sent(viewer, "unheard_of")[0] == 404


def test_a_file_that_changes_is_shown_and_its_faults_are_told(shown: Callable[..., pf.Viewer], tmp_path: Path) -> None:
    path, stewart = tmp_path / "mine.toml", pf.load("stewart")
    pf.save(stewart, path)
    viewer = shown(path)
    path.write_text(path.read_text(encoding="utf-8").replace("spherical", "sferical"), encoding="utf-8")
    until(lambda: "did you mean" in machine_of(viewer)["live"]["fault"])
    assert viewer.mechanism == stewart
    pf.save(tripod_rps(), path)
    until(lambda: viewer.mechanism == tripod_rps())
    assert viewer.target == pytest.approx(tripod_rps().home_pose)
    assert machine_of(viewer)["live"] == {"version": 1, "free": False, "fault": ""}


def test_a_file_half_written_is_not_read(tmp_path: Path) -> None:
    path, seen = tmp_path / "a", []
    path.write_text("one")
    watch = Watch(path, lambda changed: seen.append(changed.read_text()))
    path.unlink()
    path.write_text("two, whole")
    until(lambda: seen == ["two, whole"])
    watch.end()


def test_what_cannot_be_shown_is_refused(shown: Callable[..., pf.Viewer]) -> None:
    machine = pf.load("five_bar")
    with pytest.raises(InvalidArgument, match="batch"):
        pf.view(pf.solve_ik(machine, [[0, 0, 180], [0, 0, 190]]))
    with pytest.raises(InvalidArgument, match="from 1 to 65535"):
        pf.view(machine, port=0)
    with pytest.raises(InvalidArgument, match="an address of this computer"):
        pf.view(machine, host="203.0.113.7", port=18080)
    with pytest.raises(InvalidArgument, match="one Solution of"):
        shown(machine).show(pf.solve_ik(tripod_rps(), (0, 0, 210)))


@pytest.mark.usefixtures("folder")
def test_the_command_writes_a_page_and_refuses_what_it_cannot() -> None:
    write_files("path.csv")
    result = pfabrik("view five_bar --track path.csv --html a.html --port 18080")
    assert (result.exit_code, result.stderr) == (0, "wrote a.html\n")
    assert Path("a.html").stat().st_size > 100_000
    for line in ("view five_bar --html a.txt", "view five_bra", "view five_bar --port 0"):
        assert pfabrik(line).exit_code == 2
