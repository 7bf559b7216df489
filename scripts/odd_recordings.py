"""Read recordings that are damaged or odd in many ways, and print each that ends in a traceback.

Every file is made from an intact one by random changes of bytes, cells, rows, header or options.

    python scripts/odd_recordings.py [COUNT] [SEED]
"""

from __future__ import annotations

import math
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "exchange"))
from filmed_walks import SLOPE, places_of, sampled

import walkerlab
from walkerlab.errors import ConfigError, NoAnswer

CELLS = (
    "", "nan", "inf", "-inf", "1e400", "0", "-0", "1,5", "0x10", "1_0", "text", "12:00", "12:00:00", "PT1S", "P", "\0",
    '"', "'", "1e-320", "9" * 400, "²", "½", "٣", "--1", "+90deg", ";", "\t", "2026-02-30 10:00:00", "0 days 00:00:01",
)  # fmt: skip
OPTIONS: tuple[dict[str, Any], ...] = (
    {}, {"fps": 100.0}, {"fps": 1e-3}, {"fps": 1e7}, {"from_s": 1.0}, {"from_s": 1e9}, {"to_s": 1e-9},
    {"from_s": 0.0, "to_s": 1e-9}, {"camera_tilt_deg": "free"}, {"camera_tilt_deg": "floor"}, {"camera_tilt_deg": 45},
    {"belt_speed_m_s": 1e-9}, {"belt_speed_m_s": 1e3}, {"min_likelihood": 0.5}, {"min_likelihood": 1.0},
    {"walks": "left"}, {"walks": "away"}, {"walks": "right", "fps": 240.0, "camera_tilt_deg": "free"},
    {"units": {"time": "ms"}}, {"units": {"angle": "deg"}}, {"units": {"length": "mm"}},
)  # fmt: skip
SOURCES = (
    "{}",
    "-{}",
    "{}+90deg",
    "{}-1e300rad",
    '"{}"',
    "-{}+90mm",
    "{}>{}",
    "",
    "-",
    "+90deg",
    ">",
    "HIP>",
    ">FOOT1",
)


def tables() -> dict[str, str]:
    """Return intact files by name."""
    time, angle = sampled(fps=60.0)
    places = places_of(angle, fps=60.0)
    own = "\n".join(f"{t:.5f},{a:.6f},{b:.6f}" for t, (a, b) in zip(time, angle, strict=True))
    rows = [[f"{value:.4f}" for value in row.ravel()] for row in places]
    names = ("HIP", "FOOT1", "FOOT2")
    trc = [
        "PathFileType\t4\t(X/Y/Z)\tfilm_Sports2D_m.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"60\t60\t{len(rows)}\t3\tm\t60\t1\t{len(rows)}",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{n}" for n in (1, 2, 3) for axis in "XYZ"),
        *("\t".join([str(n), f"{t:.5f}", *row]) for n, (t, row) in enumerate(zip(time, rows, strict=True))),
    ]
    thirds = [",".join([part] * 3) for part in names]
    dlc = [
        f"scorer{',net' * 9}", f"bodyparts,{','.join(thirds)}", f"coords{',x,y,likelihood' * 3}",
        *(
            ",".join([str(n), *(f"{v:.3f}" for place in 300.0 * row[:, :2] for v in (*place, 0.9))])
            for n, row in enumerate(places)
        ),
    ]  # fmt: skip
    mot = "Coordinates\nversion=1\ninDegrees=yes\nendheader\ntime\tright thigh\tleft thigh\n" + "\n".join(
        f"{t:.5f}\t{a:.5f}\t{b:.5f}" for t, (a, b) in zip(time, np.degrees(angle) - 90.0, strict=True)
    )
    return {
        "own.csv": f"time (s),angle 1 (rad),angle 2 (rad)\n{own}\n",
        "film.trc": "\n".join(trc),
        "dlc.csv": "\n".join(dlc),
        "walk.mot": mot,
    }


COLUMNS = {
    "own.csv": {},
    "film.trc": {"angle 1": "HIP>FOOT1", "angle 2": "HIP>FOOT2"},
    "dlc.csv": {"angle 1": "HIP>FOOT1", "angle 2": "HIP>FOOT2"},
    "walk.mot": {"angle 1": "right thigh+90deg", "angle 2": "left thigh+90deg"},
}


def change_cells(text: str, rng: np.random.Generator) -> str:
    """Replace some cells, anywhere in the file."""
    delimiter = "\t" if "\t" in text else ","
    lines = [line.split(delimiter) for line in text.split("\n")]
    for _ in range(int(rng.choice([1, 3, 50]))):
        line = lines[int(rng.integers(0, min(len(lines), int(rng.choice([8, len(lines)])))))]
        line[int(rng.integers(0, len(line)))] = str(rng.choice(CELLS))
    return "\n".join(map(delimiter.join, lines))


def change_rows(text: str, rng: np.random.Generator) -> str:
    """Repeat, remove, reverse or cut off rows."""
    lines = text.split("\n")
    place, count = int(rng.integers(0, len(lines))), int(rng.choice([1, 5, 100]))
    return "\n".join(
        {
            0: lines[:place],
            1: [*lines[:place], *lines[place + count :]],
            2: [*lines[:place], *lines[place : place + count], *lines[place:]],
            3: lines[:8] + lines[:7:-1],
            4: [*lines[:place], *[""] * count, *lines[place:]],
            5: [*lines[:9], *lines[9:place] * 2],
            6: lines[: 5 + count % 4],
            7: [line + ("\t" if "\t" in line else ",") * 2 for line in lines],
        }[int(rng.integers(0, 8))]
    )


def change_column(text: str, rng: np.random.Generator) -> str:
    """Set a whole column to a constant, to a ramp or to text."""
    delimiter = "\t" if "\t" in text else ","
    lines = [line.split(delimiter) for line in text.split("\n")]
    column, kind = int(rng.integers(0, 4)), int(rng.integers(0, 5))
    for number, line in enumerate(lines[7:]):
        if column < len(line):
            line[column] = ("0", str(number), f"{1e300 * number:g}", "x", f"0.{number % 2}")[kind]
    return "\n".join(map(delimiter.join, lines))


def change_bytes(text: str, rng: np.random.Generator) -> str:
    """Change some characters."""
    letters = list(text)
    for _ in range(int(rng.choice([1, 10, 500]))):
        letters[int(rng.integers(0, int(rng.choice([300, len(letters)]))))] = chr(int(rng.integers(1, 400)))
    return "".join(letters)


def leave(text: str, _rng: np.random.Generator) -> str:
    return text


CHANGES: tuple[Callable[[str, np.random.Generator], str], ...] = (
    change_cells, change_rows, change_column, change_bytes, leave,
)  # fmt: skip


def main() -> None:
    count, seed = (int(word) for word in (*sys.argv[1:], *("300", "0")[len(sys.argv) - 1 :]))
    rng, ends = np.random.default_rng(seed), Counter[str]()
    right = tables()
    warnings.simplefilter("error")
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            name = str(rng.choice(list(right)))
            change = CHANGES[int(rng.integers(0, len(CHANGES)))]
            text = change(right[name], rng)
            options = dict(OPTIONS[int(rng.integers(0, len(OPTIONS)))])
            columns = dict(COLUMNS[name])
            if rng.random() < 0.2:
                pattern = str(rng.choice(SOURCES))
                columns["angle 1"] = pattern.replace("{}", columns.get("angle 1", "angle 1"))
            path = Path(folder) / name
            path.write_text(text, encoding="utf-8")
            try:
                walkerlab.read_walk(path, columns, slope_deg=math.degrees(SLOPE), **options)
                ends["read"] += 1
            except (ConfigError, NoAnswer):
                ends["refused"] += 1
            except Exception:  # The script looks for tracebacks.
                ends["traceback"] += 1
                print(number, name, change.__name__, options, columns, flush=True)
                print("".join(traceback.format_exc().splitlines(keepends=True)[-5:]), flush=True)
    print(f"{count} files: {dict(ends)}")


if __name__ == "__main__":
    main()
