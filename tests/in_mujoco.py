"""MuJoCo by itself: loops closed by Newton's method on its own rows, led from where a model starts; and against us."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from pfabrik.exchange.interop import Imported

mujoco = pytest.importorskip("mujoco", reason="needs MuJoCo, whole: pip install '.[dev]'", exc_type=ImportError)

LED = 15
"""Steps in which driven joints are led to their values."""


class Model:
    """A MuJoCo model with its driven joints led to values, and its loops closed. No code of ours."""

    def __init__(self, model: Any, held: Mapping[str, float] | None = None) -> None:
        self.model, self.data = model, mujoco.MjData(model)
        self.model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        self.held = dict(held or {})
        self.update()

    @classmethod
    def of(cls, text: str, **held: float) -> Model:
        return cls(mujoco.MjModel.from_xml_string(text), held)

    def update(self) -> None:
        mujoco.mj_fwdPosition(self.model, self.data)

    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        count = self.data.ne
        return self.data.efc_pos[:count].copy(), self.data.efc_J.reshape(-1, self.model.nv)[:count].copy()

    def mass(self) -> np.ndarray:
        """The mass matrix, (nv, nv), armature included."""
        full = np.zeros((self.model.nv, self.model.nv))
        if hasattr(self.data, "qM"):  # before MuJoCo 4
            mujoco.mj_fullM(self.model, full, self.data.qM)
        else:
            mujoco.mj_fullM(self.model, self.data, full)
        return full

    def rank(self) -> int:
        rows, slopes = self.rows()
        return int(np.linalg.matrix_rank(slopes, 1e-9)) if len(rows) else 0

    def lead(self, names: Sequence[str], values: np.ndarray) -> float:
        """Lead joints from their reference to values, closing the loops on the way; the gap that is left."""
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        every = {**self.held, **dict(zip(names, values, strict=True))}
        places = [int(model.joint(name).qposadr[0]) for name in every]
        free = np.ones(model.nv, bool)
        free[[int(model.joint(name).dofadr[0]) for name in every]] = False
        begin, goal = data.qpos[places].copy(), np.array(list(every.values()))
        for step in range(1, LED + 1):
            data.qpos[places] = begin + (goal - begin) * step / LED
            for _ in range(12 if step == LED else 4):
                self.update()
                rows, slopes = self.rows()
                if np.abs(rows).max(initial=0.0) < 1e-16:
                    break
                move = np.zeros(model.nv)
                move[free] = -np.linalg.lstsq(slopes[:, free], rows, rcond=1e-10)[0]
                mujoco.mj_integratePos(model, data.qpos, move, 1.0)
        self.update()
        return float(np.abs(self.rows()[0]).max(initial=0.0))

    def pose(self, name: str, kind: str = "body") -> tuple[np.ndarray, np.ndarray]:
        """Position [m] and rotation matrix of a body or site."""
        found = getattr(self.data, kind)(name)
        position = found.xpos
        return np.array(position), np.array(found.xmat).reshape(3, 3)


def notes_of(imported: Imported) -> str:
    return "\n".join(map(str, imported.notes))


def agrees(found: Imported, model: Model, body: str, reach: float = 0.3, poses: int = 8) -> None:
    """The end effector is where MuJoCo has it, in metres, at random values of the drives around home."""
    mechanism, random = found.mechanism, np.random.default_rng(0)
    names = mechanism.actuator_names
    home = np.array([mechanism.home_coordinate(name) for name in names])
    model.lead(names, home)
    _, begin = model.pose(body)
    limits = np.transpose([drive.limits for drive in mechanism.drives])
    for values in np.clip(home + random.uniform(-reach, reach, (poses, len(names))), *limits):
        solution = pf.solve_fk(mechanism, values)
        assert solution
        assert model.lead(names, values) <= 1e-13
        position, turned = model.pose(body)
        assert np.linalg.norm(solution.pose[:3, 3] - position) <= 1e-11
        assert np.abs(solution.pose[:3, :3] - turned @ begin.T).max() <= 1e-10
