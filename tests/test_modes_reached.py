"""A target that some configuration reaches in a mode that the call allows is REACHED; maps say what `keep` reaches."""

import tempfile
from pathlib import Path

import numpy as np
import pytest

import pfabrik as pf

LONG, SHORT = 90.0, 60.0
LIMITS = (-60.0, 110.0)

TIP = """
[[joint]]
name = "tip"
type = "revolute"
connects = ["forearm", "tool"]
at = [{x}, {y}, 0.0]
axis = [0, 0, 1]
"""

ECLIPSE_LEG = """
[[joint]]
name = "G"
type = "revolute"
connects = ["base", "g"]
at = [0, 0, 0]
axis = [0, 0, 1]
actuated = true
range = [-50, 50]
copies = { count = 3, axis = [0, 0, 1] }
[[joint]]
name = "P"
type = "prismatic"
connects = ["g", "q"]
at = [200, 0, 40]
axis = [0, 0, 1]
actuated = true
range = [-90, 90]
copies = { count = 3, axis = [0, 0, 1] }
[[joint]]
name = "A"
type = "revolute"
connects = ["q", "l"]
at = [200, 0, 40]
axis = [0, 1, 0]
copies = { count = 3, axis = [0, 0, 1] }
[[joint]]
name = "C"
type = "spherical"
connects = ["l", "platform"]
at = [70, 0, 150]
copies = { count = 3, axis = [0, 0, 1] }
"""

FOUR_BAR_LEG = """
[[joint]]
name = "Crank"
type = "revolute"
actuated = true
connects = ["base", "crank"]
at = [60, 0, 0]
axis = [0, 1, 0]
range = [-50, 50]
copies = { count = 3, axis = [0, 0, 1] }
[[joint]]
name = "CrankTop"
type = "revolute"
connects = ["crank", "coupler"]
at = [70, 0, 60]
axis = [0, 1, 0]
copies = { count = 3, axis = [0, 0, 1] }
[[joint]]
name = "Rocker"
type = "revolute"
connects = ["base", "rocker"]
at = [120, 0, 0]
axis = [0, 1, 0]
copies = { count = 3, axis = [0, 0, 1] }
[[joint]]
name = "RockerTop"
type = "revolute"
connects = ["rocker", "coupler"]
at = [110, 0, 80]
axis = [0, 1, 0]
copies = { count = 3, axis = [0, 0, 1] }
[[joint]]
name = "Hinge"
type = "revolute"
connects = ["coupler", "rod"]
at = [130, 0, 95]
axis = [0, 1, 0]
copies = { count = 3, axis = [0, 0, 1] }
[[joint]]
name = "Ball"
type = "spherical"
connects = ["rod", "platform"]
at = [80, 0, 180]
cone = { axis = [50, 0, -85], half_angle = 40, fixed_to = "platform" }
copies = { count = 3, axis = [0, 0, 1] }
"""


def machine(joints, end_effector="platform", head=""):
    units = 'schema = 1\nname = "m"\nunits = { length = "mm", angle = "deg" }\n'
    text = f'{units}base = "base"\nend_effector = "{end_effector}"\n{head}\n{joints}'
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "m.toml"
        path.write_text(text, encoding="utf-8")
        return pf.load(path)


def arm(drawn_bent_by, elbow, end_effector):
    """Two hinges in a plane; its elbow has the range `elbow` from straight [deg]."""
    bent = np.radians(drawn_bent_by)
    x, y = LONG + SHORT * np.cos(bent), SHORT * np.sin(bent)
    joints = f"""
[[joint]]
name = "A"
type = "revolute"
connects = ["base", "upper"]
at = [0, 0, 0]
axis = [0, 0, 1]
actuated = true
range = [{LIMITS[0]}, {LIMITS[1]}]
[[joint]]
name = "B"
type = "revolute"
connects = ["upper", "forearm"]
at = [{LONG}, 0, 0]
axis = [0, 0, 1]
actuated = true
home = {drawn_bent_by}
range = [{elbow[0]}, {elbow[1]}]
"""
    if end_effector == "tip":
        return machine(joints + TIP.format(x=x, y=y), "tip", 'task = ["x", "y"]')
    return machine(joints, "forearm", f'reference_point = [{x}, {y}, 0.0]\ntask = ["x", "y"]')


def within_limits(targets, elbow):
    """Targets (n, 3) reached with the elbow bent to either side, (2, n): the textbook's closed form."""
    x, y = targets[:, :2].T
    cosine = (x * x + y * y - LONG**2 - SHORT**2) / (2 * LONG * SHORT)
    reached = []
    for sign in (1.0, -1.0):
        b = sign * np.arccos(np.clip(cosine, -1.0, 1.0))
        a = np.arctan2(y, x) - np.arctan2(SHORT * np.sin(b), LONG + SHORT * np.cos(b))
        a, b = np.degrees((a + np.pi) % (2 * np.pi) - np.pi), np.degrees(b)
        inside = (LIMITS[0] <= a) & (a <= LIMITS[1]) & (elbow[0] <= b) & (b <= elbow[1])
        reached.append(inside & (np.abs(cosine) <= 1.0))
    return np.array(reached)


def is_reached(m, targets, **arguments):
    return np.asarray(pf.solve_ik(m, targets, **arguments).status == pf.Status.REACHED)


@pytest.mark.parametrize("end_effector", ["forearm", "tip"])
@pytest.mark.parametrize("elbow", [(0, 100), (-100, 0), (-100, 100), (-30, 140)])
@pytest.mark.parametrize("bent", [0.0, 40.0, -20.0])
def test_an_arm_reaches_what_its_closed_form_says_in_every_mode(bent, elbow, end_effector):
    if not elbow[0] <= bent <= elbow[1]:
        pytest.skip("home is beyond the range")
    m = arm(bent, elbow, end_effector)
    targets = np.pad(np.random.default_rng(0).uniform(-150, 150, (600, 2)), ((0, 0), (0, 1)))
    either = within_limits(targets, elbow)
    home_mode = either.any(axis=0) if bent == 0.0 else either[0 if bent > 0.0 else 1]
    assert (is_reached(m, targets) == either.any(axis=0)).all()
    keep, home = pf.Options(working_mode="keep"), pf.solve_ik(m, m.home_pose)
    assert (is_reached(m, targets, options=keep) == home_mode).all()
    assert (is_reached(m, targets, start=home) == home_mode).all()
    assert (is_reached(m, targets, start=home.q) == home_mode).all()
    for start in (None, home):
        assert ((pf.feasibility(m, targets, start=start).margin >= 0.0) == home_mode).all()


def test_the_workspace_of_an_arm_drawn_straight_is_that_of_its_elbow():
    m = arm(0.0, (0, 100), "forearm")
    area = LONG * SHORT * np.radians(LIMITS[1] - LIMITS[0]) * (1 - np.cos(np.radians(100)))
    space = pf.workspace(m)
    assert space.size == pytest.approx(area, rel=1e-3)
    targets = np.random.default_rng(1).uniform(-150, 150, (500, 2))
    off_border = np.abs(pf.feasibility(m, np.pad(targets, ((0, 0), (0, 1)))).margin) > 0.02
    reached = within_limits(np.pad(targets, ((0, 0), (0, 1))), (0, 100)).any(axis=0)
    assert (space.contains(targets) == reached)[off_border].all()


def test_an_answer_of_a_point_has_the_rotation_of_its_body():
    m = arm(40.0, (-30, 140), "forearm")
    found = pf.solve_ik(m, np.array([[100.0, 50.0, 0.0], [60.0, -70.0, 0.0]]))
    assert pf.configuration(m, found.q).pose == pytest.approx(found.pose, abs=1e-9)
    assert found.pose[0, 0, 0] == pytest.approx(np.cos(found.q[0].sum() - np.radians(40.0)), abs=1e-9)


def test_a_slide_along_the_hinge_below_it_reaches_around_home():
    m = machine(ECLIPSE_LEG, head="reference_point = [0, 0, 150]")
    near = m.home_pose[:3, 3] + np.random.default_rng(0).uniform(-7, 7, (40, 3))
    home, keep = pf.solve_ik(m, m.home_pose), pf.Options(working_mode="keep")
    found = pf.solve_ik(m, near, options=keep)
    assert (found.status == pf.Status.REACHED).all()
    assert is_reached(m, near, start=home).all()
    assert (pf.feasibility(m, near).margin >= 0.0).all()
    for turn, hinge in zip(np.radians([0, 120, 240]), found.q.T[:3], strict=True):  # the ball's azimuth
        ball = near - m.home_pose[:3, 3] + [70 * np.cos(turn), 70 * np.sin(turn), 150]
        azimuth = np.arctan2(ball[:, 1], ball[:, 0]) - turn
        assert np.exp(1j * hinge) == pytest.approx(np.exp(1j * azimuth), abs=1e-9)


@pytest.mark.parametrize("height, crank", [(182.0, 34.50), (183.0, 35.38), (184.0, 36.19), (185.0, 36.93)])
def test_legs_with_loops_reach_in_another_mode_what_no_start_leads_to(height, crank):
    m = machine(FOUR_BAR_LEG, head='reference_point = [0, 0, 180]\ntask = ["z", "tilt"]')
    found = pf.solve_ik(m, [0.0, 0.0, height])
    assert found.status == pf.Status.REACHED
    assert np.degrees(found.actuators) == pytest.approx([crank] * 3, abs=0.01)


def test_no_attempt_of_a_search_has_reached_what_is_projected():
    machines = [arm(40.0, (-30, 140), "forearm"), machine(ECLIPSE_LEG, head="reference_point = [0, 0, 150]")]
    for m in machines:
        length = m.characteristic_length
        for offset in np.random.default_rng(0).uniform(-1.0, 1.0, (8, 3)) * length * [1, 1, len(m.task) > 2]:
            for mode in ("any", "keep"):
                log = pf.search_log(m, m.home_pose[:3, 3] + offset, options=pf.Options(working_mode=mode))
                was_reached = any(attempt.ending == "reached" for attempt in log.attempts)
                assert log.solution.status == pf.Status.REACHED or not was_reached
