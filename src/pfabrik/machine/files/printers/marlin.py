"""Marlin's `Configuration.h` of a delta, by its definitions."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path

from ..dimensions import NoNumber, number_of
from .conditions import definitions
from .deltas import LOOPLESS, Table, fault, linear_delta
from .print_region import PrintRegion

ANGLES = (210.0, 330.0, 90.0)
"""Angles of the towers [deg], to which corrections are added; RepRapFirmware's too."""

PROBES = (
    *("FIX_MOUNTED_PROBE", "Z_PROBE_SERVO_NR", "BLTOUCH", "TOUCH_MI_PROBE", "SOLENOID_PROBE", "Z_PROBE_SLED"),
    *(
        "Z_PROBE_ALLEN_KEY",
        "RACK_AND_PINION_PROBE",
        "MAG_MOUNTED_PROBE",
        "MAGLEV4",
        "BIQU_MICROPROBE",
        "BD_SENSOR_PROBE",
    ),
)
"""Definitions of a probe, whose offset counts in the homed height."""

_NONE = (0.0, 0.0, 0.0)


def marlin_delta(
    rod: float,
    radius: float,
    height: float,
    *,
    adjustments: Sequence[float] = _NONE,
    angle_trims: Sequence[float] = _NONE,
    rod_trims: Sequence[float] = _NONE,
    radius_trims: Sequence[float] = _NONE,
) -> Table:
    """The machine of Marlin's numbers [mm and deg]; of the homed height, with a probe its offset is taken before.

    A carriage goes from its endstop by its adjustment, which is not positive, to where the homed height is.
    """
    towers = {
        "angle": [angle + trim for angle, trim in zip(ANGLES, angle_trims, strict=True)],
        "arm_length": [rod + trim for trim in rod_trims],
        "position_endstop": [height - adjustment for adjustment in adjustments],
    }
    return linear_delta(radius, towers | ({"radius_trim": [*radius_trims]} if any(radius_trims) else {}))


def marlin_table(text: str, folder: Path | None) -> Table:
    """The machine of a `Configuration.h`."""
    definitions = _Definitions(text)
    if "DELTA" not in definitions.texts:
        raise fault("#define DELTA", f"nothing: {LOOPLESS}", "Marlin's Configuration.h of a delta")
    offset = 0.0
    if any(probe in definitions.texts for probe in PROBES):
        offset = definitions.three("NOZZLE_TO_PROBE_OFFSET")[2]
    radius = "DELTA_SMOOTH_ROD_OFFSET - DELTA_EFFECTOR_OFFSET - DELTA_CARRIAGE_OFFSET"
    return marlin_delta(
        definitions.number("DELTA_DIAGONAL_ROD"),
        definitions.number("DELTA_RADIUS", radius),
        definitions.number("DELTA_HEIGHT", "MANUAL_Z_HOME_POS") - offset,
        adjustments=definitions.three("DELTA_ENDSTOP_ADJ"),
        angle_trims=definitions.three("DELTA_TOWER_ANGLE_TRIM"),
        rod_trims=definitions.three("DELTA_DIAGONAL_ROD_TRIM_TOWER"),
        radius_trims=definitions.three("DELTA_RADIUS_TRIM_TOWER"),
    )


def marlin_region(text: str, folder: Path | None) -> PrintRegion:
    """What a `Configuration.h` says beside the machine."""
    name = "DELTA_PRINTABLE_RADIUS"
    radius = _Definitions(text).texts.get(name)
    return PrintRegion(f"{name} {radius}" if radius else "")


class _Definitions:
    """The `#define`s of a file, in branches that hold; a name that is defined twice has to say the same."""

    def __init__(self, text: str) -> None:
        self.texts, self._twice = definitions(text)

    def number(self, name: str, otherwise: str | None = None) -> float:
        """The value of a name, or of an older way to say it."""
        said = name if name in self.texts or otherwise is None else otherwise
        return self._value(name, said, ())

    def three(self, name: str) -> tuple[float, float, float]:
        """Three numbers in braces, or with `_1` to `_3` behind the name; zeros without."""
        if name in self.texts:
            parts = self._text_of(name).strip("{} \t").split(",")
        else:
            parts = [f"{name}_{k}" if f"{name}_{k}" in self.texts else "0" for k in (1, 2, 3)]
        if len(parts) != 3:
            raise fault(f"#define {name}", self.texts[name], "three numbers in braces")
        a, b, c = (self._value(name, part, ()) for part in parts)
        return a, b, c

    def _text_of(self, name: str) -> str:
        if name in self._twice:
            raise fault(f"#define {name}", "two values, and names of another file say which", "the one that holds")
        return self.texts[name]

    def _value(self, place: str, said: str, within: tuple[str, ...]) -> float:
        names = [name for name in re.findall(r"[A-Za-z_]\w*", said) if name in self.texts]
        if set(names) & set(within):
            raise fault(f"#define {place}", f"{said}, which needs itself", "a number")
        values = {name: self._value(place, self._text_of(name), (*within, name)) for name in names}
        try:
            number = number_of(re.sub(r"(?<=[\d.])[fF]\b", "", said), values, "rad", ())
        except NoNumber as reason:
            found = "nothing" if said == place else str(reason)
            raise fault(f"#define {place}", found, "a number, or an expression of definitions") from None
        if not math.isfinite(number):
            raise fault(f"#define {place}", said, "a finite number")
        return number
