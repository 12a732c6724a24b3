"""Ten pictures that new users found hard to read, drawn by the commands that draw them: `out/pictures` is for eyes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

OUT = Path(__file__).resolve().parents[2] / "out" / "pictures"
COMMANDS = """
new 3-RRS -o tripod.toml --force
plot delta -o delta.png
plot orthoglide -o orthoglide.png
plot g1_ankle -o g1_ankle.png
plot reachy_mini -o reachy_mini.png
travel five_bar --plot travel.png
workspace stewart -o workspace_stewart.png
workspace linear_delta -o workspace_linear_delta.png --theme dark
workspace tripod.toml -o workspace_tripod.png
singularities tripod.toml -o singularities_tripod.pdf
singularities orthoglide --resolution 20 -o singularities_orthoglide.png
""".strip().splitlines()


def main() -> None:
    OUT.mkdir(parents=True, exist_ok=True)
    for command in COMMANDS:
        before = os.times().children_user
        subprocess.run([sys.executable, "-m", "pfabrik", *command.split()], cwd=OUT, check=True, capture_output=True)
        print(f"{os.times().children_user - before:5.1f} s  pfabrik {command}")


if __name__ == "__main__":
    main()
