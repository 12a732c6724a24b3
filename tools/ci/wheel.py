"""Build the sdist and the wheel, compare their files with what is tracked, and use the wheel in empty environments.

    .venv/bin/python tools/ci/wheel.py          # builds both
    python tools/ci/wheel.py FOLDER             # uses the wheel in a folder, built elsewhere

The wheel is built from the sdist, so that what the sdist lacks is missed. It is installed outside the checkout, for
each Python from 3.11 on that is found: the kernels are in it, as `tools/kernels/try_wheel.py` shows.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NEWEST_MINOR = 14
NOT_PACKED = (".ci/", ".github/", ".gitignore")
"""Beginnings of tracked names that the sdist leaves out."""
ADDED = ("PKG-INFO", ".gitignore")
"""Files that a build adds to an sdist."""
TRANSLATED = "build/kernels/"
"""Where an sdist has the kernels in C, which are not tracked."""
BUILT = "pfabrik/kernels/"
"""Where a wheel may have files that are made when it is built: kernels compiled ahead."""

SLOWEST_START = "1.2"
"""Of a command in a new environment, in seconds of the processor: 0.3 to 0.5 on a quiet machine."""

USE = """
import sys
import pfabrik as pf
from pfabrik.machine.catalog import template, templates
from pfabrik.machine.files import loads

assert not pf.__file__.startswith(sys.argv[1]), pf.__file__
for name in pf.__all__:
    getattr(pf, name)
for name in pf.catalog():
    pf.load(name)
for name in templates():
    loads(template(name))
print(f"{len(pf.__all__)} public names, {len(pf.catalog())} machines, {len(templates())} templates")
"""


def main() -> int:
    """Build, compare and use; 0 if all is as it should be."""
    with tempfile.TemporaryDirectory() as folder:
        if len(sys.argv) > 1:
            (wheel,) = Path(sys.argv[1]).resolve().glob("*.whl")
            use(wheel, sys.executable, Path(folder))
            return 0
        sdist, wheel = build(Path(folder))
        wrong = [*differences(sdist, wheel)]
        for fault in wrong:
            print(fault)
        if wrong:
            return 1
        for python in pythons():
            use(wheel, python, Path(folder))
    return 0


def build(folder: Path) -> tuple[Path, Path]:
    """The sdist, and the wheel that is built from it."""
    run([sys.executable, "-m", "build", "--outdir", str(folder), str(ROOT)])
    (sdist,), (wheel,) = folder.glob("*.tar.gz"), folder.glob("*.whl")
    return sdist, wheel


def differences(sdist: Path, wheel: Path) -> Iterator[str]:
    """What the sdist or the wheel lacks, or has beside what is tracked, one a line."""
    tracked = set(run(["git", "-C", str(ROOT), "ls-files"]).splitlines())
    with tarfile.open(sdist) as archive:
        packed = {name.partition("/")[2] for name in archive.getnames()}
    expected = {name for name in tracked if not name.startswith(NOT_PACKED)}
    translated = {name for name in packed if name.startswith(TRANSLATED)}
    if not {f"{TRANSLATED}table.h", f"{TRANSLATED}sources.sha256"} < translated:
        yield f"{sdist.name}: the kernels in C are missing"
    yield from compared(sdist.name, packed - set(ADDED) - translated, expected)
    with zipfile.ZipFile(wheel) as zipped:
        installed = {name for name in zipped.namelist() if ".dist-info/" not in name}
    package = {name.removeprefix("src/") for name in tracked if name.startswith("src/")}
    made = {name for name in installed - package if name.startswith(BUILT) and not name.endswith(".py")}
    yield from compared(wheel.name, installed - made, package)


def compared(archive: str, found: set[str], expected: set[str]) -> Iterator[str]:
    """The names in one set only."""
    yield from (f"{archive}: {name} is missing" for name in sorted(expected - found))
    yield from (f"{archive}: {name} does not belong there" for name in sorted(found - expected))


def pythons() -> Iterator[str]:
    """This Python, then the other versions on the PATH."""
    yield sys.executable
    for minor in range(11, NEWEST_MINOR + 1):
        found = shutil.which(f"python3.{minor}")
        if found and minor != sys.version_info.minor:
            version = f"import sys; sys.exit(sys.version_info[:2] != (3, {minor}))"
            if subprocess.run([found, "-c", version], capture_output=True).returncode == 0:
                yield found


def use(wheel: Path, python: str, folder: Path) -> None:
    """Install the wheel into an empty environment and do a few things with it there."""
    place = Path(tempfile.mkdtemp(dir=folder))
    run([python, "-m", "venv", str(place / "env")])
    programs = place / "env" / ("Scripts" if os.name == "nt" else "bin")
    command, own = str(programs / "pfabrik"), str(programs / "python")
    run([own, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", str(wheel)])
    run([command, "new", "hexapod", "-o", "machine.toml"], place)
    said = [
        run([own, "-W", "error", "-c", USE, str(ROOT)], place),
        run([command, "check", "machine.toml"], place),
        run([own, str(ROOT / "tools" / "kernels" / "try_wheel.py"), "--within", SLOWEST_START], place),
    ]
    version = run([own, "--version"]).strip()
    print(f"{wheel.name}, {version}: " + "; ".join(text.partition("\n")[0] for text in said), flush=True)


def run(command: list[str], folder: Path | None = None) -> str:
    """Run a command, without the checkout on Python's path; what it prints, or its failure with all it said."""
    environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(command)}\nexit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


if __name__ == "__main__":
    sys.exit(main())
