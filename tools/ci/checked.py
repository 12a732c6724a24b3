"""All machines with kernels that stop at an index outside its array, at memory that is not theirs, and at what C leaves
open. Needs a compiler's sanitizers; without them it says so.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
QUESTIONS = """
import warnings
import numpy as np
import pfabrik as pf
from pathlib import Path
from pfabrik.kernels._shipped import LIBRARY
from pfabrik.engines.varied import varied
assert LIBRARY is not None
warnings.simplefilter("ignore")
for name in pf.catalog():
    machine, rng = pf.load(name), np.random.default_rng(3)
    length = machine.characteristic_length
    for size in (0.1, 0.5, 3.0):
        shift = size * length * rng.normal(size=(40, 3))
        targets = pf.pose(machine.home_pose[:3, 3] + shift, rotvec=size * rng.normal(size=(40, 3)))
        found = pf.solve_ik(machine, targets)
        pf.track(machine, targets[:8])
        for mode in ("keep", "any"):
            pf.solve_ik(machine, targets[:10], start=found[0], options=pf.Options(working_mode=mode))
        pf.solve_fk(machine, found.actuators + 0.2 * size * rng.normal(size=found.actuators.shape))
        found.q, pf.margins(found)
    print(name, flush=True)
for path in sorted((Path(pf.__file__).parent / "machine" / "catalog" / "templates").glob("*.toml")):
    machine, rng = pf.load(path), np.random.default_rng(3)
    shift = 0.3 * machine.characteristic_length * rng.normal(size=(100, 3))
    ours, targets = varied(machine), pf.pose(machine.home_pose[:3, 3] + shift, rotvec=0.3 * rng.normal(size=(100, 3)))
    at = ours.at([1.01 * machine.dimensions[name] for name in ours.names])
    at.margins(targets), at.slopes(targets), at.inverse_jacobians(targets)
    print(path.stem, flush=True)
"""


def main() -> int:
    libraries = [
        subprocess.run(["cc", f"-print-file-name={name}"], capture_output=True, text=True, check=True).stdout.strip()
        for name in ("libasan.so", "libubsan.so")
    ]
    if not all(Path(library).is_absolute() for library in libraries):
        print("not tried: the C compiler has no sanitizers")
        return 0
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "src"
        shutil.copytree(ROOT / "src", source, ignore=shutil.ignore_patterns("_compiled*", "__pycache__"))
        into = source / "pfabrik" / "kernels"
        command = [
            sys.executable,
            str(ROOT / "tools" / "kernels" / "compile_kernels.py"),
            "--checked",
            "--into",
            str(into),
        ]
        subprocess.run(command, check=True)
        environment = os.environ | {
            "PYTHONPATH": str(source),
            "LD_PRELOAD": " ".join(libraries),
            "ASAN_OPTIONS": "detect_leaks=0",
            "PFABRIK_KERNELS": "compiled",
        }
        return subprocess.run([sys.executable, "-c", QUESTIONS], env=environment, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
