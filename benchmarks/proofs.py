"""What proofs cost: regions proved and refuted, a track, sizes between two bounds."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import pfabrik as pf
from pfabrik.capabilities.certify.enclosure import COORDINATES, enclose
from pfabrik.machine.model import model_of
from table import Row
from timing import best_times


def proofs(runs: int) -> Iterator[Row]:
    """On one core; times are for all of it."""
    hexapod, middle = pf.load("stewart"), np.array([0.0, 0.0, 210.0])
    for half, degrees, verdict in ((34.0, 7.5, "PROVED"), (35.0, 8.0, "REFUTED")):
        region = pf.PoseRegion.box(middle - half, middle + half, rotation=np.radians(degrees))
        assert pf.certify(hexapod, region).verdict == verdict
        (seconds,) = best_times(runs, lambda region=region: pf.certify(hexapod, region))
        yield Row(f"6-UPS, ±{half:g} mm and ±{degrees:g}° {verdict.lower()}", 1, seconds)
    tripod, ankle = pf.load("rps"), pf.load("ankle_rss")
    tilts = pf.PoseRegion.box([0, 0, 183.835], [0, 0, 223.835], tilt=np.radians(20))
    turns = pf.PoseRegion.joints({"pivot[0]": (-0.23, 0.23), "pivot[1]": (-0.2, 0.2)})
    for name, machine, region in (("3-RPS, ±20 mm and 20°", tripod, tilts), ("ankle of cranks, pivot", ankle, turns)):
        assert pf.certify(machine, region)
        (seconds,) = best_times(runs, lambda machine=machine, region=region: pf.certify(machine, region))
        yield Row(f"{name} proved", 1, seconds)
    turn = np.linspace(0.0, 2.0 * np.pi, 1001)
    track = pf.track(hexapod, np.stack([30 * np.cos(turn), 30 * np.sin(turn), 210 + 10 * np.sin(3 * turn)], axis=1))
    assert pf.certify(hexapod, track)
    (seconds,) = best_times(runs, lambda: pf.certify(hexapod, track))
    yield Row("6-UPS, every pose of a track of 1,000 steps proved", 1, seconds)
    orthoglide = pf.load("orthoglide").without_limits()
    for name, machine, accuracy in (("6-UPS", hexapod, 1e-2), ("Orthoglide without limits", orthoglide, 1e-3)):
        held = dict(zip(COORDINATES, [*machine.home_pose[:3, 3], 0.0, 0.0, 0.0], strict=True))
        ends, model = np.full(3, np.inf), model_of(machine)

        def size(model=model, held=held, ends=ends, accuracy=accuracy):
            return enclose(model, "xyz", held, np.eye(3), (-ends, ends), accuracy=accuracy, budget=10**6)

        (seconds,) = best_times(min(runs, 3), size)
        yield Row(f"{name}, volume at home's orientation enclosed to {accuracy:.1%}", 1, seconds)
