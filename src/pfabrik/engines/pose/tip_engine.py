"""The engine of machines whose end effector is placed as a point: one leg, whose rotation the task leaves open."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ...common.arrays import Floats
from ...common.derived import derived
from ...kernels.rows import FAILED, INVALID
from ...machine.description.geometry import home_numbers, with_numbers
from ...machine.description.joints import Joint
from ...machine.description.mechanism import Mechanism
from ...machine.model import Model
from ...options import Options
from ..joints.attempts import Attempt
from ..joints.close import Closing, platform_poses
from ..joints.configurations import Configurations
from ..joints.engine_contract import Counted, Engine, Grower
from ..joints.link_distances import too_near
from ..joints.projection import ProjectionMode
from .legs_engine import LegsEngine


@derived
def read_at_tip(model: Model) -> Model | None:
    """The machine with a joint at its reference point as end effector; None where no leg has two solutions so.

    A task that leaves the whole rotation open sets a point. Where one leg carries the end effector, its elbow, which
    completing a pose leaves to Newton's method, is then a branch of the leg in closed form.
    """
    mechanism = model.mechanism
    is_point = not mechanism.end_effector_is_joint and model.task.rotations == 0
    if not is_point or any(joint.cone is not None for joint in mechanism.joints):
        return None
    read = Model(_with_tip(mechanism, model.length))
    read.mechanism.__dict__["_model"] = read  # not one shared with a description that is equal, whose L differs
    is_better = not read.why_poses_do_not_suffice and read.legs.has_sides and not read.legs.has_implicit_joints
    return read if is_better else None


def measured(model: Model) -> Model:
    """The machine whose legs measure targets: `read_at_tip` where there is one, but with a clearance between links."""
    read = read_at_tip(model) if model.mechanism.clearance is None else None
    return model if read is None else read


def _with_tip(mechanism: Mechanism, length: float) -> Mechanism:
    """A mechanism with one joint more, the last, at the reference point, as its end effector; of the same length L."""
    name = "tip"
    while name in (*mechanism.bodies, *(joint.name for joint in mechanism.joints)):
        name += "'"
    connects, at = (mechanism.end_effector, f"beyond {name}"), mechanism.reference_point
    tip = Joint(name, "revolute", connects, at=at, axis=(0.0, 0.0, 1.0))
    read = mechanism._with(
        joints=(*mechanism.joints, tip), end_effector=name, shapes=(), masses=(), ignore=(), clearance=None
    )
    numbers = home_numbers(read).copy()
    numbers[0] = length
    return with_numbers(read, numbers)


@dataclass(frozen=True, eq=False)
class TipEngine(Engine):
    """Targets by the closed forms of the leg up to the reference point, all else by the usual engine.

    Attributes
    ----------
    model, usual : the machine, and its engine that completes poses.
    at_tip : the engine of `read_at_tip`.
    """

    model: Model
    usual: Engine
    at_tip: LegsEngine

    def answer(
        self, targets: Floats, start: Configurations | None, options: Options, *, keep_mode: bool
    ) -> Configurations:
        """As `InverseEngine.answer`."""
        answers = self._with_rotations(self.at_tip.answer(targets, start_at_tip(start), options, keep_mode=keep_mode))
        rows = too_near(self, self.model.mechanism, answers)
        if not len(rows):
            return answers
        begin = start if start is None or len(start) == 1 else start.at(rows)
        return answers.with_rows(rows, self.usual.answer(targets[rows], begin, options, keep_mode=keep_mode))

    def follow(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        on_progress: Callable[[int, int], None] | None,
    ) -> Configurations:
        """As `InverseEngine.follow`."""
        if self.model.mechanism.clearance is not None:
            return self.usual.follow(targets, start, options, on_progress)
        return self._with_rotations(self.at_tip.follow(targets, start_at_tip(start), options, on_progress))

    def attempts(
        self, target: Floats, start: Configurations | None, options: Options, *, keep_mode: bool
    ) -> Iterator[Attempt]:
        """As `InverseEngine.attempts`."""
        return self.at_tip.attempts(target, start_at_tip(start), options, keep_mode=keep_mode)

    def advance(self, targets: Floats, start: Configurations) -> Configurations:
        """As `Engine.advance`."""
        at_start = start_at_tip(start)
        assert at_start is not None
        answers = self._with_rotations(self.at_tip.advance(targets, at_start))
        answers.rows.status[too_near(self, self.model.mechanism, answers)] = FAILED
        return answers

    def grower(self, counted: Counted) -> Grower | None:
        """As `Engine.grower`: by the usual engine, where positions alone count."""
        return self.usual.grower(counted) if counted == "position" else None

    def forward(
        self, values: Floats, start: Configurations | None, tolerance: float, *, keep_mode: bool = True
    ) -> Configurations:
        """As `Engine.forward`."""
        return self.usual.forward(values, start, tolerance, keep_mode=keep_mode)

    def as_configurations(self, closing: Closing) -> Configurations:
        """As `Engine.as_configurations`."""
        return self.usual.as_configurations(closing)

    def points(self, configurations: Configurations) -> Mapping[str, Floats]:
        """As `Engine.points`."""
        return self.usual.points(configurations)

    def limit_multipliers(self, configurations: Configurations, targets: Floats, projection: ProjectionMode) -> Floats:
        """As `Engine.limit_multipliers`."""
        return self.usual.limit_multipliers(configurations, targets, projection)

    def _with_rotations(self, answers: Configurations) -> Configurations:
        """Answers of the point as those of the body: with the rotation that their joints give, without the tip's."""
        coordinates, rows = answers.coordinates[:, :-1], answers.rows
        valid = np.flatnonzero(rows.status != INVALID)
        rows.poses[valid, :3, :3] = platform_poses(self.model.mechanism, coordinates[valid])[:, :3, :3]
        return Configurations(rows, coordinates)


def start_at_tip(start: Configurations | None) -> Configurations | None:
    """Configurations of the body as those of the point, which has no rotation."""
    if start is None:
        return None
    poses = start.rows.poses.copy()
    poses[:, :3, :3] = np.eye(3)
    return Configurations(start.rows._replace(poses=poses), np.pad(start.coordinates, ((0, 0), (0, 1))))
