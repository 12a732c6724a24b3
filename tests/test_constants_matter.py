"""Each constant of a search has its unit and its reason in the record, and answers or steps depend on it."""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import pfabrik as pf
from changed_constants import MACHINES
from checks import INTERPRETED

SCRIPT = Path(__file__).with_name("changed_constants.py")
GUARDS = {
    "search_constants": "LAST SOLVABLE FILLED UNBOUNDED",
    "pose.pose_constants": "NEAR_INCUMBENT STRETCHED BENT",
    "joints.joint_constants": "MOST_DAMPING FEW FEWEST_LINEARISED",
    "chains.chain_constants": "ALONG PULLED_TURN ON_BOUND MOST_DAMPING LEAST_PIVOT NOTHING RESTORED PULLED_FROM PULLS "
    "BENT DESCENTS_NEARBY",
    "passes.pass_constants": "CONTENT OBLIQUE LARGEST_TURN TURN_DAMPING NO_LENGTH NO_SIDE WELL_INSIDE LEAST_SHARE "
    "HASTY MARGINS INSIDE OPEN VARIED LOST PULLED NO_RATE",
    "clearance.distance_constants": "MOST_SIMPLICES MOST_STALLED ROUNDING MOST_CORNERS FLAT CLOSE TOUCHING NEAR "
    "PARALLEL ALONG_AXIS",
    "legs.leg_constants": "MOST_STEPS_IMPLICIT KEPT NOT_A_ROTATION PARTS MORE_PARTS LEAST_MARGIN",
}
"""Constants that nothing depends on of what these machines are asked: they guard against rounding, loops without an
end, and what other machines have."""


def run(*arguments: object) -> str:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, str(SCRIPT), *map(str, arguments)]
    return subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout


@pytest.fixture(scope="module")
def kernels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of kernels whose constants are variables."""
    folder = tmp_path_factory.mktemp("kernels")
    run("build", folder)
    return folder


def test_each_constant_of_a_search_has_its_reason() -> None:
    package = Path(pf.__file__).parent / "kernels"
    records = {
        ".".join(path.relative_to(package).with_suffix("").parts): path for path in package.rglob("*_constants.py")
    }
    assert records.keys() == MACHINES.keys()
    for record, path in records.items():
        nodes = ast.parse(path.read_text(encoding="utf-8")).body[1:]
        for node, reason in zip(nodes[::2], nodes[1::2], strict=True):
            is_text = isinstance(reason, ast.Expr) and isinstance(reason.value, ast.Constant)
            assert isinstance(node, ast.Assign) and is_text, f"{record}: {ast.unparse(node)}"


@pytest.mark.campaign
@pytest.mark.skipif(INTERPRETED or sys.platform != "linux", reason="kernels are compiled with variables for constants")
@pytest.mark.parametrize("record", MACHINES)
def test_answers_or_steps_depend_on_each_constant(record: str, kernels: Path) -> None:
    changed = {name: what for name, _, what in map(json.loads, run("ask", kernels, record).splitlines())}
    assert {name for name, what in changed.items() if not what} <= set(GUARDS[record].split())
