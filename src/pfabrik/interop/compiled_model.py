"""A model that MuJoCo has compiled, in a configuration: the rows of its equalities, and steps that close them."""

from __future__ import annotations

import copy
from typing import Any

from numpy.typing import ArrayLike

from ..arrays import Floats, Ints, Mask
from ..errors import UnknownName


class CompiledModel:
    """A model that is compiled, of a text or as a copy of another, and its state; sites are where the text puts them.

    MuJoCo takes frames that are less than 1e-6 apart, in whatever unit, for one; asked not to, it computes both.

    Attributes
    ----------
    model, data : MuJoCo's `MjModel` and `MjData`.
    is_slide : of the joints, (njnt,).
    joint_names : of the joints; those without a name have "".
    """

    def __init__(self, model: Any) -> None:
        import mujoco

        self.mujoco: Any = mujoco
        self.model: Any = mujoco.MjModel.from_xml_string(model) if isinstance(model, str) else copy.deepcopy(model)
        self.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        self.model.site_sameframe[:] = int(mujoco.mjtSameFrame.mjSAMEFRAME_NONE)
        self.model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        self.data: Any = mujoco.MjData(self.model)
        self.is_slide: Mask = self.model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE
        self.joint_names = [str(self.model.joint(index).name) for index in range(self.model.njnt)]

    def put_configuration(self, name: str) -> None:
        """Take "qpos0", or the configuration of a keyframe; UnknownName where there is none of this name."""
        if name != "qpos0":
            keys = [self.model.key(index).name for index in range(self.model.nkey)]
            if name not in keys:
                raise UnknownName("configuration", name, ["qpos0", *keys])
            self.data.qpos[:] = self.model.key_qpos[keys.index(name)]

    def update(self) -> None:
        """Compute everything that follows from the coordinates."""
        self.mujoco.mj_fwdPosition(self.model, self.data)

    def take(self, qpos: ArrayLike) -> None:
        """Take a state (nq,)."""
        self.data.qpos[:] = qpos
        self.update()

    def move(self, motion: ArrayLike) -> None:
        """Move the joints by (nv,) [rad or m]."""
        self.mujoco.mj_integratePos(self.model, self.data.qpos, motion, 1.0)
        self.update()

    def rows(self) -> tuple[Floats, Floats, Ints]:
        """Errors (r,) [m or rad] of the rows of equalities, their Jacobian (r, nv), and their equalities (r,)."""
        data, count = self.data, self.data.ne
        return data.efc_pos[:count], data.efc_J.reshape(-1, self.model.nv)[:count], data.efc_id[:count]
