"""Units of recorded quantities."""

import math
from collections.abc import Mapping
from typing import Final

DEG_RAD: Final = math.pi / 180.0
ANGLES: Final = {
    "rad": 1.0, "radian": 1.0, "mrad": 1e-3, "milliradian": 1e-3, "deg": DEG_RAD, "degree": DEG_RAD, "°": DEG_RAD,
}  # fmt: skip
LENGTHS: Final = {
    "m": 1.0, "meter": 1.0, "metre": 1.0, "mm": 1e-3, "millimeter": 1e-3, "millimetre": 1e-3, "cm": 1e-2,
    "centimeter": 1e-2, "centimetre": 1e-2, "km": 1e3, "in": 0.0254, "inch": 0.0254, "ft": 0.3048, "foot": 0.3048,
}  # fmt: skip
UNIT_VALUES: Final[Mapping[str, Mapping[str, float]]] = {
    "time": {
        "s": 1.0, "sec": 1.0, "second": 1.0, "ms": 1e-3, "msec": 1e-3, "millisecond": 1e-3,
        # Unicode has two letters that look like this one: the micro sign and the Greek mu.
        **dict.fromkeys(("us", "\u00b5s", "\u03bcs", "usec", "microsecond"), 1e-6),
        **dict.fromkeys(("ns", "nsec", "nanosecond"), 1e-9), "min": 60.0, "minute": 60.0,
    },
    "angle": ANGLES,
    "rate": {f"{unit}/{second}": value for unit, value in ANGLES.items() for second in ("s", "sec", "second")},
    "length": LENGTHS,
    "speed": {f"{unit}/{second}": value for unit, value in LENGTHS.items() for second in ("s", "sec", "second")},
    "force": {"n": 1.0, "newton": 1.0, "kn": 1e3},
    # Names are in lower case, so MJ would read as mJ. No walker has megajoules.
    "energy": {"j": 1.0, "joule": 1.0, "mj": 1e-3, "n mm": 1e-3},
}  # fmt: skip
"""Value of each unit in SI, by kind of quantity. The names of units are in lower case and singular."""
SI: Final = {kind: next(iter(units)) for kind, units in UNIT_VALUES.items()}


def value_in_si(unit: str, kind: str) -> float | None:
    """Return the SI value of a unit, such as mm, Millimeters or [mm], or None if it is not a unit of this `kind`."""
    name = unit.strip().strip("[]()").strip().lower()
    values = UNIT_VALUES[kind]
    # Some units end in s themselves, such as ms, so the s of a plural is removed only if the whole name is unknown.
    return values.get(name, values.get(name.removesuffix("s")))


def is_unit(text: str) -> bool:
    return any(value_in_si(text, kind) for kind in UNIT_VALUES)
