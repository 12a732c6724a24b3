"""The exported C on controllers: bytes, stack, instructions, and its answers against the library's.

python benchmarks/controllers.py [--targets 60] [--docs] [NAME ...]

Bytes and stack are those of arm-none-eabi-gcc -Os for a Cortex-M4F in single precision; instructions those that
qemu-system-arm counts, there and on a Cortex-M7 in double precision. Without these programs it says so, and compares
what the C compiler here makes of the file with integers of 32 bits. It ends with 1 where a status differs, a pose is
farther from its target than the library's by more than the tolerance, no target was searched for, or ticks along the
targets as a stream do not end where the library's do. With --docs it
writes the table of docs/your-controller.md. On Debian:
apt-get install gcc-arm-none-eabi libnewlib-arm-none-eabi qemu-system-arm
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np

import pfabrik as pf
from pfabrik.exchange.export.export_c import c_source
from pfabrik.exchange.export.static_data import Precision
from timing import Array, draw

SIZE, TILT, BEYOND = 0.35, 0.4, 1.6
"""How far targets are from home [L], [rad]; and how many times as far the other half."""

STEPS = 200
"""Most steps of a search, as in the library."""

TOLERANCE: dict[Precision, float] = {"double": 1e-8, "float": 1e-4}
"""How much farther from its target than the library's a nearest pose may be [L]."""

PARTS = {
    "IK": ("ik", "limits"),
    "IK, live": ("ik", "limits", "live"),
    "IK, FK": ("ik", "limits", "fk"),
    "IK, FK, nearest": ("ik", "limits", "fk", "nearest"),
}
ALL = "ik", "limits", "fk", "nearest", "live"

SPEED, TICKS = 0.02, 10
"""Of a stream: how far drives go in a tick [L or rad], and its ticks for each target."""

APART: dict[Precision, float] = {"double": 1e-6, "float": 1e-2}
"""Most difference of drives from the library's at the end of the stream [L or rad]."""

GCC, QEMU = "arm-none-eabi-gcc", "qemu-system-arm"
M4F = ("-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16")
M7 = ("-mcpu=cortex-m7", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv5-d16")
BOARDS: dict[Precision, tuple[str, tuple[str, ...]]] = {"float": ("mps2-an386", M4F), "double": ("mps2-an500", M7)}
C = ("-std=c99", "-ffp-contract=off")

MAIN = """
#include EXPORTED
#include <stdio.h>
#ifdef BOARD
#define TICKS (*(volatile unsigned *)0xE000E018u)
static unsigned began;
static void start(void) { *(volatile unsigned *)0xE000E014u = 0xFFFFFFu; *(volatile unsigned *)0xE000E010u = 5u;
    began = TICKS; }
static unsigned counted(void) { return (began - TICKS) & 0xFFFFFFu; }
#else
static void start(void) {}
static unsigned counted(void) { return 0; }
#endif
static const double targets[][12] = {
#include TARGETS
};
int main(void)
{
    unsigned k, i, j, counts[3];
    pfk_real a[PFK_ACTUATORS], driven[PFK_ACTUATORS];
    static const pfk_real speeds[PFK_ACTUATORS] = {SPEEDS}, no_accelerations[PFK_ACTUATORS];
    static pfk_memory memory, live;
    pfk_begin(&memory);
    pfk_begin(&live);
    {
        pfk_pose home;
        pfk_home(&home);
        if (pfk_live_begin(&live, &home, speeds, no_accelerations, driven))
            return 1;
    }
    for (k = 0; k < sizeof targets / sizeof *targets; ++k) {
        pfk_pose target, pose, back;
        int code, near = 0, fk = 0, steps = 0, tick;
        unsigned longest = 0;
        pfk_home(&pose);
        pfk_home(&back);
        for (i = 0; i < 3; ++i)
            for (target.p[i] = (pfk_real)targets[k][i], j = 0; j < 3; ++j)
                target.R[i][j] = (pfk_real)targets[k][3 + 3 * i + j];
        counts[0] = counts[1] = counts[2] = 0;
        for (i = 0; i < PFK_ACTUATORS; ++i)
            a[i] = 0;
        start();
        code = pfk_ik(&memory, &target, &pose, a);
        counts[0] = counted();
        if (code == 0) {
            start();
            fk = pfk_fk(&memory, a, &back, &steps);
            counts[1] = counted();
        } else {
            start();
            near = pfk_nearest(&memory, &target, &pose, a, STEPS, STARTS, 0);
            counts[2] = counted();
        }
        for (tick = 0; tick < TICKS_EACH; ++tick) {
            pfk_pose there;
            unsigned count;
            start();
            pfk_live_tick(&live, &target, 1, &there, driven);
            count = counted();
            longest = count > longest ? count : longest;
        }
        printf("%d %d %d %u %u %u %d %d %u", code, fk, near, counts[0], counts[1], counts[2], steps,
               near ? memory.told.steps : 0, longest);
        for (i = 0; i < PFK_ACTUATORS; ++i)
            printf(" %.9g", (double)driven[i]);
        for (i = 0; i < 3; ++i)
            printf(" %.9g %.9g %.9g %.9g", (double)pose.R[i][0], (double)pose.R[i][1], (double)pose.R[i][2],
                   (double)pose.p[i]);
        printf("\\n");
    }
    return 0;
}
"""

STARTUP = """
extern int main(void);
extern void _exit(int);
extern void initialise_monitor_handles(void);
extern unsigned _etext, _data, _edata, _bss, _ebss, _stack;
void reset(void)
{
    unsigned *from = &_etext, *to;
    for (to = &_data; to < &_edata;) *to++ = *from++;
    for (to = &_bss; to < &_ebss;) *to++ = 0;
    *(volatile unsigned *)0xE000ED88u |= 0xF00000u; /* the floating-point unit */
    __asm volatile("dsb; isb");
    initialise_monitor_handles();
    _exit(main());
}
__attribute__((section(".vectors"), used)) static void *const vectors[2] = {&_stack, (void *)reset};
"""

LAYOUT = """
MEMORY { FLASH (rx) : ORIGIN = 0, LENGTH = 4M  RAM (rwx) : ORIGIN = 0x20000000, LENGTH = 4M }
SECTIONS {
  .text : { KEEP(*(.vectors)) *(.text*) *(.rodata*) . = ALIGN(4); } > FLASH
  .ARM.exidx : { *(.ARM.exidx*) . = ALIGN(4); } > FLASH
  _etext = .;
  .data : AT (_etext) { _data = .; *(.data*) . = ALIGN(4); _edata = .; } > RAM
  .bss : { _bss = .; *(.bss*) *(COMMON) . = ALIGN(4); _ebss = .; } > RAM
  end = .; _end = .; _stack = ORIGIN(RAM) + LENGTH(RAM);
}
"""

PAGE = Path(__file__).parents[1] / "docs" / "your-controller.md"
BEGIN, END = "<!-- benchmarks/controllers.py --docs -->\n", "\n<!-- end -->"
"""Where the table is in the page."""

TICK = 40
"""Instructions a tick of the board's timer: 1 ns each by `-icount shift=0`, at 25 MHz."""


class Size(NamedTuple):
    """Bytes of an exported file."""

    code: int
    constants: int
    memory: int
    stack: int


class Truth(NamedTuple):
    """Targets, and the library's answers in home's working mode from home."""

    targets: Array
    status: Array
    poses: Array


def size_of(text: str, folder: Path) -> Size:
    """Bytes of a file on a Cortex-M4F with one memory of calls; the stack is the deepest path of calls, without the C
    library's."""
    (folder / "exported.c").write_text(f"{text}\nextern pfk_memory pfk_of_a_caller;\npfk_memory pfk_of_a_caller;\n")
    command = [
        GCC,
        *C,
        *M4F,
        "-Os",
        "-ffunction-sections",
        "-fdata-sections",
        "-fcallgraph-info=su",
        "-c",
        "exported.c",
    ]
    subprocess.run(command, cwd=folder, check=True)
    listed = subprocess.run(["arm-none-eabi-size", "-A", "exported.o"], cwd=folder, capture_output=True, text=True)
    totals = dict.fromkeys((".text", ".rodata", ".data", ".bss"), 0)
    for name, size in re.findall(r"^(\.\w+)\S*\s+(\d+)", listed.stdout, re.MULTILINE):
        if name in totals:
            totals[name] += int(size)
    memory = totals[".data"] + totals[".bss"]
    return Size(totals[".text"], totals[".rodata"], memory, stack_of((folder / "exported.ci").read_text()))


def stack_of(graph: str) -> int:
    """The deepest path of calls in a graph of gcc, each function with the bytes that it takes."""
    own = {name: int(size) for name, size in re.findall(r'title: "([^"]+)" label: "[^"]*?(\d+) bytes', graph)}
    calls: dict[str, set[str]] = {}
    for source, target in re.findall(r'sourcename: "([^"]+)" targetname: "([^"]+)"', graph):
        calls.setdefault(source, set()).add(target)
    deepest: dict[str, int] = {}

    def depth(name: str) -> int:
        if name not in deepest:
            deepest[name] = own.get(name, 0) + max(map(depth, calls.get(name, ())), default=0)
        return deepest[name]

    return max(map(depth, own))


def truth_of(machine: pf.Mechanism, n: int) -> Truth:
    """Targets around home, half of them farther away, and what the library answers."""
    rng = np.random.default_rng(5)
    targets = np.concatenate(
        [draw(machine, rng, n // 2, SIZE, TILT), draw(machine, rng, n - n // 2, BEYOND * SIZE, TILT)]
    )
    home = np.concatenate([np.ravel(machine.home_coordinate(joint.name)) for joint in machine.joints])
    found = pf.solve_ik(machine, targets, start=home, options=pf.Options(working_mode="keep"))
    return Truth(targets, np.asarray(found.status), np.asarray(found.pose))


def told(
    machine: pf.Mechanism, known: Truth, precision: Precision, folder: Path, *, on_board: bool, starts: int
) -> Array:
    """What the exported file says of the targets, one row each: codes, counts, the pose."""
    (folder / "exported.c").write_text(c_source(machine, precision=precision, parts=ALL))
    flat = np.concatenate([known.targets[:, :3, 3], known.targets[:, :3, :3].reshape(-1, 9)], axis=1)
    (folder / "targets.h").write_text("".join("{" + ", ".join(map(repr, row)) + "},\n" for row in flat.tolist()))
    (folder / "main.c").write_text(MAIN)
    speeds = ",".join(repr(float(each)) for each in SPEED * units_of(machine))
    defined = [f"-DSPEEDS={speeds}", f"-DTICKS_EACH={TICKS}"]
    given = [
        *defined,
        '-DEXPORTED="exported.c"',
        '-DTARGETS="targets.h"',
        f"-DSTEPS={STEPS}",
        f"-DSTARTS={starts}",
        "main.c",
    ]
    if not on_board:
        compiler = next(name for name in ("cc", "gcc", "clang") if shutil.which(name))
        given = ["-DPFK_INTEGER=int32_t", *given]
        subprocess.run([compiler, *C, "-O2", *given, "-lm", "-o", "main"], cwd=folder, check=True)
        run = subprocess.run([str(folder / "main")], capture_output=True, text=True, check=True)
    else:
        board, processor = BOARDS[precision]
        (folder / "startup.c").write_text(STARTUP)
        (folder / "layout.ld").write_text(LAYOUT)
        command = [GCC, *C, *processor, "-O2", "-DBOARD", *given, "startup.c", "-nostartfiles", "--specs=rdimon.specs"]
        subprocess.run([*command, "-T", "layout.ld", "-lm", "-o", "main.elf"], cwd=folder, check=True)
        command = [QEMU, "-M", board, "-icount", "shift=0", "-semihosting", "-nographic", "-kernel", "main.elf"]
        run = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=600, check=True)
    return np.array([line.split() for line in run.stdout.splitlines()], float)


def units_of(machine: pf.Mechanism) -> Array:
    """1 rad or L of every drive."""
    return np.array([machine.characteristic_length if drive.kind == "length" else 1.0 for drive in machine.drives])


def driven(machine: pf.Mechanism, known: Truth) -> Array:
    """Where the library's ticks along the stream of all targets end."""
    live = pf.Live(machine, speed=dict(zip(machine.actuator_names, SPEED * units_of(machine), strict=True)))
    for target in known.targets:
        for _ in range(TICKS):
            live.tick(target, 1.0)
    return np.array(live.actuators)


def compared(machine: pf.Mechanism, known: Truth, said: Array) -> tuple[int, int, float]:
    """How many statuses differ from the library's, and how many nearest poses were found; how much farther [L]."""
    status = np.where(said[:, 0] == 0, 0, np.where(said[:, 2] == 0, 0, np.where(said[:, 2] == -4, 1, 9)))
    poses = said[:, -12:].reshape(-1, 3, 4)
    distance = [np.linalg.norm(each[:, :3, 3] - known.targets[:, :3, 3], axis=1) for each in (poses, known.poses)]
    both = (status == 1) & (known.status == 1)
    above = (distance[0] - distance[1])[both] / machine.characteristic_length
    return int(np.count_nonzero(status != known.status)), int(both.sum()), float(above.max(initial=0.0))


def counts(said: Array, column: int) -> str:
    """Median and most of the instructions of a call."""
    some = TICK * said[said[:, column] > 0, column]
    return f"{np.median(some):,.0f} / {some.max():,.0f}" if len(some) else "-"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", default=["stewart", "delta"], help="machines of the catalogue")
    parser.add_argument("--targets", type=int, default=60)
    parser.add_argument("--docs", action="store_true", help="write the table of docs/your-controller.md")
    parser.add_argument("--starts", type=int, default=99, help="places that searches start from beside the last answer")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    has_gcc, has_qemu = shutil.which(GCC) is not None, shutil.which(QEMU) is not None
    if not has_gcc or not has_qemu:
        print(f"{'' if has_gcc else GCC} {'' if has_qemu else QEMU} not found: the C compiler here takes their place")
    is_wrong, rows = False, []
    for name in given.names:
        machine = pf.load(name)
        known = truth_of(machine, given.targets)
        ends = driven(machine, known)
        print(f"\n{name}: {np.count_nonzero(known.status == 0)} of {len(known.status)} targets reached")
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            for part, parts in PARTS.items() if has_gcc else ():
                size = size_of(c_source(machine, precision="float", parts=parts), folder)
                rows.append([name, part, *(f"{bytes / 1000:.1f} kB" for bytes in size)])
                print(
                    f"  M4F float {part:<16} code {size.code:6,}  constants {size.constants:6,}  RAM {size.memory:6,}"
                    f"  stack {size.stack:6,}"
                )
            for precision in ("float", "double"):
                said = told(machine, known, precision, folder, on_board=has_gcc and has_qemu, starts=given.starts)
                differ, n_nearest, above = compared(machine, known, said)
                apart = float(np.abs((said[-1, 9:-12] - ends) / units_of(machine)).max())
                is_wrong |= differ > 0 or n_nearest == 0 or above > TOLERANCE[precision] or apart > APART[precision]
                if precision == "float" and rows:
                    for row, parts in zip(rows[-len(PARTS) :], PARTS.values(), strict=True):
                        asked = {"ik": 3, "fk": 4, "nearest": 5, "live": 8}
                        row += [counts(said, column) if part in parts else "" for part, column in asked.items()]
                        most = {"fk": 6, "nearest": 7}
                        row += [
                            f"{said[:, column].max():.0f}" if part in parts else "" for part, column in most.items()
                        ]
                of = f"IK {counts(said, 3)}, FK {counts(said, 4)}, nearest {counts(said, 5)}, tick {counts(said, 8)}"
                most = f"most steps FK {said[:, 6].max():.0f}, nearest {said[:, 7].max():.0f}"
                print(
                    f"  {precision:<6} statuses that differ {differ}, nearest {n_nearest}, farther by {above:.1e} L;"
                    f" drives apart after {TICKS * len(said)} ticks {apart:.1e}; instructions {of}; {most}"
                )
    if given.docs and has_gcc and has_qemu:
        write_table(rows)
    return int(is_wrong)


def write_table(rows: list[list[str]]) -> None:
    """Put the table into its page."""
    columns = ["machine", "parts", "code", "constants", "memory", "stack", "`_ik`", "`_fk`", "`_nearest`"]
    columns += ["`_live_tick`", "steps of `_fk`", "of `_nearest`"]
    lines = [f"| {' | '.join(row)} |" for row in (columns, ["---"] * 2 + ["--:"] * 10, *rows)]
    text = PAGE.read_text(encoding="utf-8")
    first, last = text.index(BEGIN) + len(BEGIN), text.index(END)
    PAGE.write_text("".join([text[:first], "\n", "\n".join(lines), "\n", text[last:]]), encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
