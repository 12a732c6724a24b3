"""Answers as they were recorded, and how today's differ: `python benchmarks/recorded.py [record] [--only NAME …]`.

Every catalogue machine is asked for the same targets, in and out of reach, from home and from a start, for forward
kinematics of values that assemble and of some that do not, and for its modes. Without `record` it prints what differs
from the file beside it, and ends with 1 where a status changed or a projection got farther.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import pfabrik as pf

FILE = Path(__file__).with_name("recorded.npz")
TARGETS = 240
FARTHER = 1e-6
"""How much farther from its target a projection may be than the recorded one [L]."""


def targets_of(mechanism: pf.Mechanism) -> np.ndarray:
    """Poses (n, 4, 4): a third where the machine can be, a third around home, a third anywhere up to 3 L away."""
    rng = np.random.default_rng(20261122)
    length, home, third = mechanism.characteristic_length, mechanism.home_pose, TARGETS // 3
    start = pf.solve_ik(mechanism, home).actuators
    slides = np.array([mechanism.joint(name).type == "prismatic" for name in mechanism.actuator_names])
    span = np.where(slides, 0.15 * length, 0.4)
    forward = pf.solve_fk(mechanism, start + rng.uniform(-1.0, 1.0, (third, len(start))) * span)
    reach = np.repeat([0.2, 1.0], third) * np.repeat([1.0, 3.0], third) * length
    directions = rng.normal(size=(2 * third, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    share = rng.uniform(size=2 * third) ** (1.0 / 3.0)
    poses = np.zeros((2 * third, 4, 4)) + np.eye(4)
    spins = rng.uniform(-1.0, 1.0, (2 * third, 3)) * np.repeat([0.25, 1.2], third)[:, None]
    poses[:, :3, :3] = Rotation.from_rotvec(spins).as_matrix()
    poses[:, :3, 3] = home[:3, 3] + directions * (reach * share)[:, None]
    return np.concatenate([forward.pose, poses])


def distances(mechanism: pf.Mechanism, solution: Any) -> np.ndarray:
    turned = mechanism.rotation_length * np.asarray(solution.rotation_error)
    return np.hypot(solution.position_error, turned) / mechanism.characteristic_length


def answers(mechanism: pf.Mechanism, targets: np.ndarray) -> dict[str, np.ndarray]:
    """What is recorded of a machine, name -> array."""
    cold = pf.solve_ik(mechanism, targets)
    start = next(each for each in cold if each)
    started = pf.solve_ik(mechanism, targets, start=start)
    found = {"targets": targets}
    for name, solution in (("cold", cold), ("started", started)):
        found[f"{name}.status"] = np.asarray(solution.status, np.int8)
        found[f"{name}.distance"] = distances(mechanism, solution)
        found[f"{name}.actuators"] = np.asarray(solution.actuators, np.float32)
        held = [(None, "orientation", "position").index(each) for each in solution.held]
        found[f"{name}.held"] = np.array(held, np.int8)
    limits = [" ".join(f"{each.joint}.{each.bound}" for each in row) for row in cold.active_limits]
    found["cold.limits"] = np.array(limits)
    rng = np.random.default_rng(7)
    values = np.concatenate([cold.actuators[:60], cold.actuators[:8] * rng.uniform(0.3, 1.7, (8, 1))])
    forward = pf.solve_fk(mechanism, values)
    found["fk.status"] = np.asarray(forward.status, np.int8)
    found["fk.pose"] = forward.pose
    found["fk.error"] = np.asarray(forward.actuator_error)
    home = [pf.solve_ik(mechanism, mechanism.home_pose), start]
    found["assembly"] = np.array([len(pf.assembly_modes(mechanism, each.actuators)) for each in home])
    found["working"] = np.array([_count(mechanism, each.pose) for each in home])
    return found


def _count(mechanism: pf.Mechanism, pose: np.ndarray) -> int:
    try:
        return len(pf.working_modes(mechanism, pose))
    except ValueError:  # a continuum of them
        return -1


def compare(name: str, before: dict[str, np.ndarray], now: dict[str, np.ndarray], length: float) -> int:
    """Print how a machine's answers differ; how many differences count as worse."""
    worse, told = 0, []
    for way in ("cold", "started"):
        was, status = before[f"{way}.status"], now[f"{way}.status"]
        farther = now[f"{way}.distance"] - before[f"{way}.distance"]
        same_hold = before[f"{way}.held"] == now[f"{way}.held"]
        projected = (was == pf.Status.PROJECTED) & (status == pf.Status.PROJECTED)
        counts = {
            "statuses": (was != status).sum(),
            "holds": (projected & ~same_hold).sum(),
            "farther": (projected & same_hold & (farther > FARTHER)).sum(),
            "nearer": (projected & same_hold & (farther < -FARTHER)).sum(),
        }
        off = np.abs(now[f"{way}.actuators"] - before[f"{way}.actuators"]).max(axis=1)
        counts["elsewhere"] = ((was == status) & (off > 1e-4 * max(length, 1.0)) & (np.abs(farther) <= FARTHER)).sum()
        worse += counts["statuses"] + counts["holds"] + counts["farther"]
        told += [f"{way}: {count} {what}" for what, count in counts.items() if count]
        if counts["farther"]:
            told.append(f"worst {farther[projected & same_hold].max():.2g} L")
        for row in np.flatnonzero(was != status)[:3]:
            told.append(f"[{row}] {pf.Status(was[row])} -> {pf.Status(status[row])}")
    other = (before["cold.limits"] != now["cold.limits"]).sum()
    told += [f"{other} name other limits"] if other else []
    fk = (before["fk.status"] != now["fk.status"]).sum()
    off = np.abs(before["fk.pose"] - now["fk.pose"]).max(axis=(1, 2)) > 1e-6 * max(length, 1.0)
    less = (now["fk.error"] > before["fk.error"] + FARTHER).sum()
    told += [f"fk: {fk} statuses, {off.sum()} other poses, {less} farther"] if fk or off.any() or less else []
    worse += fk + less
    for modes in ("assembly", "working"):
        if (before[modes] != now[modes]).any():
            told.append(f"{modes} modes {before[modes]} -> {now[modes]}")
            worse += int((before[modes] > now[modes]).any())
    print(f"{name:16s}", "; ".join(told) or "the same", flush=True)
    return int(worse)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", nargs="?", choices=["record", "compare"], default="compare")
    parser.add_argument("--only", nargs="*", default=None)
    arguments = parser.parse_args()
    recorded: dict[str, Any] = dict(np.load(FILE)) if FILE.exists() else {}
    worse = 0
    for name in arguments.only or pf.catalog():
        mechanism = pf.load(name)
        if arguments.what == "compare" and f"{name}/targets" not in recorded:
            print(f"{name:16s} not recorded")
            continue
        began = time.perf_counter()
        targets = targets_of(mechanism) if arguments.what == "record" else recorded[f"{name}/targets"]
        now = answers(mechanism, targets)
        if arguments.what == "record":
            recorded |= {f"{name}/{key}": value for key, value in now.items()}
            print(f"{name:16s} {time.perf_counter() - began:.1f} s", flush=True)
        else:
            before = {key: recorded[f"{name}/{key}"] for key in now}
            worse += compare(name, before, now, mechanism.characteristic_length)
    if arguments.what == "record":
        np.savez_compressed(FILE, **recorded)
    return int(worse > 0)


if __name__ == "__main__":
    sys.exit(main())
