"""Frames in random places are read as they are meant, in every dialect; where the importer errs, `verify` disagrees."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from in_mujoco import Model, agrees
from pfabrik.exchange.interop import (
    Imported,
    from_mjcf,
    from_sdf,
    from_urdf,
    mjcf_plain,
    sdf_links,
    told_loops,
    urdf_links,
    verify,
)

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

# Hinges A and D at the base, a rod with a ball at each end, B and C.

POINTS = {"A": (0.0, 0.0, 0.1), "B": (0.05, 0.02, 0.2), "C": (0.2, -0.03, 0.3), "D": (0.3, 0.0, 0.1)}
AXES = {"A": (0.0, 0.6, 0.8), "D": (0.36, 0.48, 0.8)}
JOINTS = {"A": ("base", "crank"), "B": ("crank", "rod"), "C": ("rod", "rocker"), "D": ("base", "rocker")}
LINKS = ("base", "crank", "rod", "rocker")

Frame = np.ndarray


def frame(turn: Rotation, at: np.ndarray) -> Frame:
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = turn.as_matrix(), at
    return whole


def within(outer: Frame, inner: Frame) -> Frame:
    return np.linalg.inv(outer) @ inner


def numbers(values: np.ndarray) -> str:
    return " ".join(map(repr, map(float, values)))


def rpy(turn: np.ndarray) -> str:
    return numbers(Rotation.from_matrix(turn).as_euler("xyz"))


class Drawing:
    """The machine with the frames of its links, and of its joints, in random places."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.links = {name: self.anywhere() for name in LINKS[1:]} | {"base": np.eye(4)}
        self.joints = {name: frame(Rotation.random(rng=self.rng), np.array(at)) for name, at in POINTS.items()}

    def anywhere(self) -> Frame:
        return frame(Rotation.random(rng=self.rng), self.rng.uniform(-0.3, 0.3, 3))

    def axis(self, joint: str, on: Frame) -> str:
        """The axis of a joint in a frame."""
        return numbers(on[:3, :3].T @ AXES[joint])

    @property
    def in_mujoco(self) -> Model:
        """The machine with frames where joints are: written by hand, and told apart from every dialect below."""
        a, b, c, d = (np.array(POINTS[name]) for name in "ABCD")
        return Model.of(f"""<mujoco><compiler boundmass="1" boundinertia="1"/><worldbody>
          <body pos="{numbers(a)}"><joint name="A" axis="{numbers(np.array(AXES["A"]))}"/>
            <body pos="{numbers(b - a)}"><joint type="ball"/><site name="1" pos="{numbers(c - b)}"/></body></body>
          <body pos="{numbers(d)}"><joint name="D" axis="{numbers(np.array(AXES["D"]))}"/>
            <site name="2" pos="{numbers(c - d)}"/>
            <body name="hand" pos="{numbers(self.links["rocker"][:3, 3] - d)}"/></body>
          </worldbody><equality><connect site1="1" site2="2"/></equality></mujoco>""")

    def sdf(self, is_apart: bool) -> str:
        """A model of SDF, poses relative to other frames; if apart, links are drawn anywhere, and frames meet."""
        moved = {name: self.anywhere() @ at if is_apart and name != "base" else at for name, at in self.links.items()}
        parts, before = ['<link name="base"/>', '<joint name="weld" type="fixed">'], "base"
        parts.append("<parent>world</parent><child>base</child></joint>")
        for name in LINKS[1:]:
            helper = self.anywhere()
            pose = within(moved[before] @ helper, moved[name])
            parts.append(f'<frame name="by_{name}" attached_to="{before}">{_pose(helper)}</frame>')
            parts.append(f'<link name="{name}">{_pose(pose, f"by_{name}")}</link>')
            before = name
        for name, (parent, child) in JOINTS.items():
            at, ends = self.joints[name], ""
            for end, link in (("parent", parent), ("child", child)):
                parts.append(f'<frame name="{name}_{end}" attached_to="{link}">{_pose(within(self.links[link], at))}')
                parts.append("</frame>")
                ends += f"<drake:{end}_frame>{name}_{end}</drake:{end}_frame>" * is_apart
            ends += "" if is_apart else _pose(within(self.links[child], at))
            kind = "revolute" if name in AXES else "ball"
            axis = f"<axis><xyz>{self.axis(name, at)}</xyz></axis>" if name in AXES else ""
            ends = f"<parent>{parent}</parent><child>{child}</child>{ends}{axis}"
            parts.append(f'<joint name="{name}" type="{kind}">{ends}</joint>')
        return f'<sdf version="1.9" xmlns:drake="x"><model name="m">{"".join(parts)}</model></sdf>'

    def urdf(self, tells: str) -> str:
        """A description, whose links stand where their joints are, turned at random; C told in a dialect."""
        on = {"base": np.eye(4), "crank": self.joints["A"], "rod": self.joints["B"], "rocker": self.joints["D"]}
        tip = within(on["rocker"], frame(Rotation.identity(), self.links["rocker"][:3, 3]))
        text = "".join(f'<link name="{name}"/>' for name in (*LINKS, "tip"))
        for name, (parent, child) in JOINTS.items():
            if name != "C":
                axis = f'<axis xyz="{self.axis(name, on[child])}"/>' if name in AXES else ""
                kind = "continuous" if name in AXES else "ball"
                text += f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
                text += f"{_origin(within(on[parent], on[child]))}{axis}</joint>"
        text += f'<joint name="tip" type="fixed"><parent link="rocker"/><child link="tip"/>{_origin(tip)}</joint>'
        one, two = (within(on[link], self.joints["C"]) for link in JOINTS["C"])
        return f'<robot name="m" xmlns:drake="x">{text}{TOLD[tells](one, two)}</robot>'

    def mjcf(self) -> str:
        """A MuJoCo model, bodies anywhere, joints off their origins, in frames within frames."""

        def place(pose: Frame) -> str:
            return f'pos="{numbers(pose[:3, 3])}" xyaxes="{numbers(pose[:3, :2].T.ravel())}"'

        def body(name: str, parent: str, joint: str, inner: str) -> str:
            helper, at = self.anywhere(), self.links[name]
            axis = f'axis="{self.axis(joint, at)}"' if joint in AXES else 'type="ball"'
            point = numbers(within(at, self.joints[joint])[:3, 3])
            pose = within(self.links[parent] @ helper, at)
            return (
                f'<frame {place(helper)}><body name="{name}" {place(pose)}><joint name="{joint}" pos="{point}" {axis}/>'
                f"{inner}</body></frame>"
            )

        one, two = (place(within(self.links[link], self.joints["C"])) for link in JOINTS["C"])
        rod = body("rod", "crank", "B", f'<site name="1" {one}/>')
        rocker = body("rocker", "base", "D", f'<site name="2" {two}/>')
        return (
            f"<mujoco><worldbody>{body('crank', 'base', 'A', rod)}{rocker}</worldbody>"
            '<equality><connect name="C" site1="1" site2="2"/></equality></mujoco>'
        )


def _pose(at: Frame, base: str = "") -> str:
    said = f' relative_to="{base}"' if base else ""
    return f"<pose{said}>{numbers(at[:3, 3])} {rpy(at[:3, :3])}</pose>"


def _origin(at: Frame, tag: str = "origin") -> str:
    return f'<{tag} xyz="{numbers(at[:3, 3])}" rpy="{rpy(at[:3, :3])}"/>'


ROD, ROCKER = 'link1 link="rod"', 'link2 link="rocker"'
TOLD: dict[str, Callable[[Frame, Frame], str]] = {
    "loop_joint": lambda one, two: (
        f'<loop_joint name="C" type="spherical">{_origin(one, ROD)}{_origin(two, ROCKER)}</loop_joint>'
    ),
    "constraint": lambda one, two: (
        '<constraint name="C" type="ball"><parent link="rod"/><child link="rocker"/>'
        f"{_origin(one, 'parent_origin')}{_origin(two, 'child_origin')}</constraint>"
    ),
    "drake": lambda one, two: (
        '<drake:ball_constraint><drake:ball_constraint_body_A name="rod"/><drake:ball_constraint_body_B name="rocker"/>'
        f'<drake:ball_constraint_p_AP value="{numbers(one[:3, 3])}"/>'
        f'<drake:ball_constraint_p_BQ value="{numbers(two[:3, 3])}"/></drake:ball_constraint>'
    ),
    "gazebo": lambda _, two: (
        '<gazebo><joint name="C" type="ball"><parent>rod</parent><child>rocker</child>'
        + _pose(two)
        + "</joint></gazebo>"
    ),
}

ASKED = {"actuated": ["A"], "task": ["tilt"]}


def sdf(drawing: Drawing) -> tuple[str, Callable[[Path], Imported]]:
    return drawing.sdf(is_apart=False), lambda path: from_sdf(path, end_effector="rocker", **ASKED)


def sdf_apart(drawing: Drawing) -> tuple[str, Callable[[Path], Imported]]:
    return drawing.sdf(is_apart=True), lambda path: from_sdf(path, end_effector="rocker", **ASKED)


def urdf(tells: str) -> Callable[[Drawing], tuple[str, Callable[[Path], Imported]]]:
    return lambda drawing: (drawing.urdf(tells), lambda path: from_urdf(path, end_effector="tip", **ASKED))


def mjcf(drawing: Drawing) -> tuple[str, Callable[[Path], Imported]]:
    return drawing.mjcf(), lambda path: from_mjcf(path, end_effector="rocker", **ASKED)


DIALECTS = {"sdf": sdf, "sdf apart": sdf_apart, "mjcf": mjcf, **{f"urdf {tells}": urdf(tells) for tells in TOLD}}


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.campaign) for seed in range(1, 20))])
@pytest.mark.parametrize("dialect", DIALECTS)
def test_frames_in_random_places_are_read_as_they_are_meant_in_every_dialect(
    dialect: str, seed: int, tmp_path: Path
) -> None:
    drawing = Drawing(seed)
    text, read = DIALECTS[dialect](drawing)
    path = tmp_path / "robot.xml"
    path.write_text(text)
    found = read(path)
    agrees(found, drawing.in_mujoco, "hand", reach=0.2, poses=3)
    checked = verify(found.mechanism, poses=2, original=path)
    assert checked.agrees and checked.original


def _askew(read: Callable[..., Frame]) -> Callable[..., Frame]:
    """A reader of places that turns each by a few degrees and shifts it by a few millimetres: the loop still closes."""

    def wrong(*args: object) -> Frame:
        place = np.array(read(*args))
        return place @ frame(Rotation.from_rotvec([0.05, -0.03, 0.04]), np.array([0.004, 0.003, -0.005]))

    return wrong


def _patch(patch: pytest.MonkeyPatch, wrong: str) -> None:
    """Make the importer wrong."""
    if wrong == "the two frames of a joint":
        patch.setattr(sdf_links, "_place_on", lambda poses, joint, _: poses[joint.get("name", "")])
    elif wrong == "poses":
        patch.setattr(sdf_links, "pose_in", _askew(sdf_links.pose_in))
    elif wrong == "origins":
        patch.setattr(urdf_links, "frame_at", _askew(urdf_links.frame_at))
    elif wrong == "places of loops":
        patch.setattr(told_loops, "_place", _askew(told_loops._place))
    elif wrong == "a joint of SDF":
        patch.setattr(sdf_links, "_within", _askew(sdf_links._within))
    elif wrong == "places of joints":
        patch.setitem(mjcf_plain.KEPT, "joint", tuple(each for each in mjcf_plain.KEPT["joint"] if each != "pos"))
    else:
        patch.setitem(mjcf_plain.KEPT, "frame", ("name", "pos"))


@pytest.mark.parametrize(
    ("dialect", "wrong"),
    [
        ("sdf apart", "the two frames of a joint"),
        ("sdf", "poses"),
        ("urdf drake", "origins"),
        ("urdf loop_joint", "places of loops"),
        ("urdf constraint", "places of loops"),
        ("urdf gazebo", "a joint of SDF"),
        ("mjcf", "places of joints"),
        ("mjcf", "turns of frames"),
    ],
)
def test_verify_disagrees_where_the_importer_reads_over_frames(
    dialect: str, wrong: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text, read = DIALECTS[dialect](Drawing(0))
    path = tmp_path / "robot.xml"
    path.write_text(text)
    assert verify(read(path).mechanism, poses=2, original=path).original
    _patch(monkeypatch, wrong)
    checked = verify(read(path).mechanism, poses=2, original=path)
    assert not checked.agrees and not checked.original
