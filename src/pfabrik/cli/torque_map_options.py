"""Options of ``pfabrik plot --torque-map``."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import click

import pfabrik as pf

from .arguments import FINITE, named_joints


@dataclass(frozen=True)
class TorqueMap:
    """A torque map: of which joints, and by which torque of every actuator."""

    joints: tuple[str, ...]
    torque: float

    def draw(self, mechanism: pf.Mechanism) -> Any:
        """Draw it; of the passive joints in series, if none are named."""
        from ..motion.joint_series import passive_series

        names = self.joints or passive_series(mechanism)
        if not names:
            raise click.UsageError("--torque-map: no passive joints in series from base to end effector; give --joints")
        return pf.actuation(mechanism, names).plot_torques(self.torque)


def torque_map_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--torque-map``, ``--joints`` and ``--torque``, which the command gets as one `torque_map`, or None."""

    @click.option("--torque-map", "wanted", is_flag=True, help="Draw the torques that actuators give two joints.")
    @click.option(
        "--joints",
        metavar="NAME[,NAME]...",
        multiple=True,
        help="The joints of --torque-map.  [default: the passive ones in series]",
    )
    @click.argument("words", metavar="", nargs=-1)
    @click.option("--torque", type=FINITE, help="Of every actuator, for --torque-map.  [default: 1]")
    @functools.wraps(command)
    def with_torque_map(
        *, wanted: bool, joints: tuple[str, ...], words: tuple[str, ...], torque: float | None, **parameters: Any
    ) -> Any:
        if words and not joints:
            raise click.UsageError(f"found {' '.join(words)}; expected one MECH, or names after --joints")
        if not wanted and (joints or torque is not None):
            raise click.UsageError("--joints and --torque belong to --torque-map")
        torque_map = TorqueMap(named_joints(joints, words), 1.0 if torque is None else torque) if wanted else None
        return command(torque_map=torque_map, **parameters)

    return with_torque_map
