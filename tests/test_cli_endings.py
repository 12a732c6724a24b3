"""How the command ends: closed streams, full disks, signals at any moment; nothing half written stays."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from command import in_process, pfabrik, write_files


def interruptible() -> None:
    """A shell starts what runs in its background with interrupts ignored."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def stopped(line: str, number: int, when: Callable[[], object]) -> tuple[int, str]:
    """The exit code and the last words of a process that gets a signal as soon as something is so."""
    with in_process(line, stdout=subprocess.PIPE, preexec_fn=interruptible) as process:
        deadline = time.monotonic() + 60
        while not when() and time.monotonic() < deadline:
            time.sleep(0.02)
        process.send_signal(number)
        try:
            said = process.communicate(timeout=90)[1]
        finally:
            process.kill()  # where it has ended, nothing happens
    return process.returncode, said


def test_a_reader_who_has_gone_is_no_error_worth_words() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    process = in_process("catalog", stdout=writer)
    os.close(writer)
    assert process.communicate(timeout=60)[1] == ""
    assert process.returncode == 141


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("line", "closed", "code", "said"),
    [
        ("catalog", ">&-", 2, "pfabrik: Bad file descriptor\n"),
        ("info - --json", "<&-", 2, "pfabrik: Bad file descriptor\n"),
        ("catalog", "2>&-", 0, ""),
        ("info nowhere.toml", "2>&-", 2, ""),
        ("catalog", "> /dev/full", 2, "pfabrik: No space left on device\n"),
        ("new 6-UPS", "> /dev/full", 2, "pfabrik: No space left on device\n"),
    ],
)
@pytest.mark.skipif(sys.platform != "linux", reason="needs a shell, and /dev/full")
def test_closed_streams_and_full_disks_are_told_in_a_line(line: str, closed: str, code: int, said: str) -> None:
    command = f"{shlex.quote(sys.executable)} -m pfabrik {line} {closed}"
    ran = subprocess.run(["sh", "-c", command], text=True, capture_output=True)
    assert (ran.returncode, ran.stderr) == (code, said)


@pytest.mark.skipif(sys.platform == "win32", reason="needs /dev/stdout")
@pytest.mark.usefixtures("folder")
def test_dev_stdout_is_standard_output() -> None:
    plain = pfabrik("new delta").stdout
    with in_process("new delta -o /dev/stdout", stdout=subprocess.PIPE) as process:
        assert process.communicate(timeout=60)[0] == plain
    with Path("out.toml").open("w") as handle:
        in_process("new delta -o /dev/stdout", stdout=handle).communicate(timeout=60)
    assert Path("out.toml").read_text() == plain


@pytest.mark.usefixtures("folder")
def test_standard_output_that_is_a_file_is_not_written_twice() -> None:
    write_files("path.csv")
    with Path("a.csv").open("w") as handle:
        process = in_process("track five_bar path.csv -o a.csv --json", stdout=handle)
        assert "found one place for two outputs" in process.communicate(timeout=60)[1]
    assert process.returncode == 2


# Signals


def test_an_interrupted_demo_leaves_nothing_behind(folder: Path) -> None:
    code, said = stopped("demo --steps 20000 -o out", signal.SIGINT, lambda: os.listdir(folder))
    assert code == 130 and "Traceback" not in said, said
    assert os.listdir(folder) == []


def test_a_track_that_is_told_to_end_leaves_no_parts_of_files(folder: Path) -> None:
    Path("path.csv").write_text("x,y,z\n" + "0,10,200\n5,10,201\n" * 50_000)
    line = "track five_bar path.csv -o answers.csv"
    code, said = stopped(line, signal.SIGTERM, lambda: list(folder.glob(".*.part*")))
    assert (code, said.splitlines()[-1]) == (143, "pfabrik: terminated")
    assert os.listdir(folder) == ["path.csv"]


@pytest.mark.compiled
@pytest.mark.parametrize("after", [1.5, 3.0])
def test_a_view_is_interrupted_at_any_moment(after: float) -> None:
    at = time.monotonic() + after
    line = f"view stewart --no-browser --port {9100 + int(10 * after)}"
    code, said = stopped(line, signal.SIGINT, lambda: time.monotonic() >= at)
    assert (code, said.strip()) == (130, "pfabrik: interrupted")


def test_an_interruption_while_the_command_is_loaded_is_told_as_one() -> None:
    code = (
        "import sys\nclass Interrupting:\n    def find_spec(self, name, *_):\n"
        "        if name == 'click':\n            raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Interrupting())\nfrom pfabrik.__main__ import main\nmain()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "pfabrik: interrupted\n")


@pytest.mark.usefixtures("folder")
def test_a_signal_in_code_that_was_just_generated_has_its_own_exit_code() -> None:
    Path("ends.py").write_text(
        "import os, signal, sys, time\nfrom pfabrik.cli.group import exit_code\n"
        "sys.exit(exit_code(lambda: exec('os.kill(os.getpid(), signal.SIGTERM); time.sleep(5)')))\n"
    )
    ran = subprocess.run([sys.executable, "ends.py"], capture_output=True, text=True)
    assert (ran.returncode, ran.stderr) == (143, "pfabrik: terminated\n")
