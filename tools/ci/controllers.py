"""Exported files on controllers of 32 bits, in qemu, against the library; without the programs for it, it says so.

On Debian they are installed first, where this runs as root.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = ("arm-none-eabi-gcc", "qemu-system-arm")
PACKAGES = ("gcc-arm-none-eabi", "libnewlib-arm-none-eabi", "qemu-system-arm")
LONGEST = 600
"""How long an installation may take [s]."""


def missing() -> list[str]:
    """Programs that are not here."""
    return [name for name in PROGRAMS if shutil.which(name) is None]


def install() -> str:
    """Install what is missing; why that was not possible, or nothing."""
    if not hasattr(os, "geteuid") or os.geteuid() != 0 or shutil.which("apt-get") is None:
        return "they are installed on Debian alone, and as root"
    quiet = os.environ | {"DEBIAN_FRONTEND": "noninteractive"}
    for command in (["update"], ["install", "--yes", "--no-install-recommends", *PACKAGES]):
        try:
            ran = subprocess.run(
                ["apt-get", "-qq", *command], env=quiet, capture_output=True, text=True, timeout=LONGEST
            )
        except subprocess.TimeoutExpired:
            return f"apt-get {command[0]} took more than {LONGEST} s"
        if ran.returncode:
            return f"apt-get {command[0]}: {ran.stderr.strip() or ran.stdout.strip()}"
    return ""


def main() -> int:
    why = install() if missing() else ""
    if missing():
        print(f"not tried: {' and '.join(missing())} not found; {why}")
        return 0
    return subprocess.run([sys.executable, str(ROOT / "benchmarks" / "controllers.py")], check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
