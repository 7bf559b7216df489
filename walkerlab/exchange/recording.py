"""Read time series from files that other programs or people wrote.

`read_recording` chooses the format by the file extension: delimited text (CSV, ADAMS tables), ADAMS results (.res),
OpenSim tables (.sto, .mot), markers (.trc, .c3d). The module `columns` finds the quantities of a walk among their
columns.
"""

import csv
import math
import re
import stat
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import cache
from importlib.util import find_spec
from io import BytesIO
from itertools import product
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final
from xml.etree import ElementTree
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from walkerlab.config.fields import DECIMAL_COMMA
from walkerlab.errors import ConfigError

csv.field_size_limit(2**31 - 1)  # A cell may contain a long comment.

Array = NDArray[np.float64]
Row = tuple[int, list[str]]
"""Line number of a row as an editor shows it, and the cells of the row."""

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

TIME: Final = "time"
TIME_NAMES = [
    re.compile(pattern)
    for pattern in (
        "(?i:time)", "t", r"(?i:.*[.\s_]time)", r"(?i:time[\s_]?stamp)",
        rf"(?i:(?:time|time[\s_]?stamp|t)[\s_](?:{'|'.join(UNIT_VALUES['time'])}))", "T",
    )
]  # fmt: skip
"""Patterns for the name of a time column. T comes last, because it may be a temperature."""
UNIT_IN_NAME: Final = re.compile(r"\s*[\[(]\s*(?!(?::,)?\d+\s*\])([^\[\]()]*?)\s*[\])]\s*$")
"""Pattern for a unit in brackets after a name. It excludes [2] and [:,2], which are indices of vector components."""
DELIMITERS: Final = "\t;,"
EMPTY: Final = frozenset({"", "nan", "na", "n/a", "null", "none", "-", "#n/a"})
"""Texts of cells, in lower case, that stand for a missing value."""
THOUSANDS: Final = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}")
"""Pattern for numbers whose comma may also separate thousands."""
COMMAS_AND_BLANKS: Final = re.compile(r" *[-+]?\d+,\d+(?: +[-+]?\d+,\d+(?:[eE][-+]?\d+)?)+ *")
DECLARED_ENCODING: Final = re.compile(rb"""\s*<\?xml[^>]*encoding\s*=\s*["']([\w.-]+)""")
CLOCKS: Final = (
    re.compile(r"(?:(\d+) days? )?(?:(\d+):)?(\d+):(\d\d(?:\.\d+)?)"),
    re.compile(r"P(?:(\d+)D)?T(?:(\d+)H)?(?:(\d+)M)?(?:(\d+(?:\.\d+)?)S)?"),
)
"""Patterns of durations, as on a clock (1:02:03) and in ISO 8601 (PT1H2M3S)."""
DAY_S: Final = 86400.0
SEGMENTS: Final = "Sports2D (angles)"
SEGMENT_NAMES: Final = frozenset({"right thigh", "left thigh"})
"""Names of segments in a table of angles that Sports2D wrote."""
NO_FILE: Final = "there is no such file"
LONGEST_PATH: Final = 200  # maximum number of characters of a path in messages
HEADER_LINES: Final = 60
"""Number of lines at the top of a file that are searched for the header."""
ACCEPTED_FORMATS: Final = (
    "CSV (.csv, .txt, .tab, .tsv), ADAMS results (.res), OpenSim (.sto, .mot), markers (.trc, .c3d)"
)

ONE_TABLE: Final = (
    "Write a table with a column of times and all points side by side: time (s),hip.x,hip.y,foot1.x,foot1.y,..."
)
TRACKS: Final = (
    "Export each track by itself (File > Export > Data File, one track), and put the columns side by side under one "
    "header: time (s),hip.x,hip.y,foot1.x,foot1.y,..."
)
EXPORT_MARKERS: Final = "Export the markers as .c3d or .trc."
PROGRAMS: Final = {
    re.compile(r"(?:Trajectories|Devices|Joints|Segments|Model Outputs)\W*\n"): ("Vicon Nexus", EXPORT_MARKERS),
    re.compile(r"Format Version,"): ("Motive", EXPORT_MARKERS),
    re.compile(r"NO_OF_FRAMES(?!(?s:.*)\nFrame\tTime)"): (
        "Qualisys Track Manager without column headers or time",
        "Export it with column headers and time, or export the markers as .c3d.",
    ),
    re.compile(r"mass[ _]\w+\W+mass[ _]\w+[^\n]*\n"): ("Tracker with several tracks", TRACKS),
    re.compile(r"mass[ _]\w+\W*\n#?t\Wx\Wy"): ("Tracker with a single point", ONE_TABLE),
}
"""Tables that the user must export differently. Patterns of their beginnings map to the program and our advice."""


C3D_PATIENCE_S: Final = 60.0
# A parameter of a C3D file holds at most 255 labels. Further ones are in LABELS2, LABELS3 and so on.
C3D_PROGRAM: Final = """
import sys, ezc3d, numpy
content = ezc3d.c3d(sys.argv[1])
point = content["parameters"]["POINT"]
names = sorted((name for name in point if name.startswith("LABELS")), key=lambda name: (len(name), name))
labels = numpy.array([label for name in names for label in point[name]["value"]], str)
units = numpy.array(point.get("UNITS", {}).get("value", []), str)
rate = numpy.ravel(point["RATE"]["value"])
numpy.savez(sys.stdout.buffer, places=content["data"]["points"], rate=rate, labels=labels, units=units)
"""


def value_in_si(unit: str, kind: str) -> float | None:
    """Return the SI value of a unit, such as mm, Millimeters or [mm], or None if it is not a unit of this `kind`."""
    name = unit.strip().strip("[]()").strip().lower()
    values = UNIT_VALUES[kind]
    # Some units end in s themselves, such as ms, so the s of a plural is removed only if the whole name is unknown.
    return values.get(name, values.get(name.removesuffix("s")))


def is_unit(text: str) -> bool:
    return any(value_in_si(text, kind) for kind in UNIT_VALUES)


@dataclass(frozen=True, eq=False)
class Recording:
    """Time series of a recording as stored in the file, before any unit conversion. Missing values are nan."""

    path: Path
    columns: dict[str, Array]  # values (samples,) by name of the column
    units: dict[str, str] = field(default_factory=dict)  # unit by column as written in the file, if it states one
    # unit by kind ('angle', 'length', 'time', 'force'), where the file states one for all columns of that kind
    kind_units: dict[str, str] = field(default_factory=dict)
    # for each column that cannot be used, the reason, such as a cell with text
    problems: dict[str, str] = field(default_factory=dict)
    unseen: dict[str, str] = field(default_factory=dict)  # for each marker column with gaps, the reason for them
    levelled_by: str = ""  # name of the program if it rotates the data to level the floor, otherwise empty

    @property
    def time_name(self) -> str | None:
        """Name of the time column, or None if there is none. Earlier patterns of TIME_NAMES take precedence over later
        ones.
        """
        return next((name for pattern in TIME_NAMES for name in self.columns if pattern.fullmatch(name)), None)


def read_recording(path: Path, key: tuple[str, ...] = ()) -> Recording:
    """Read the columns of a file in the format of its extension. `key` is the config key that names the file, if any.

    Raises ConfigError if the file cannot be read, is damaged, or has an unknown format.
    """
    if (reader := READERS.get(path.suffix.lower())) is None:
        raise ConfigError(
            f"{path} has an unsupported format ({path.suffix or 'no extension'}).",
            FORMAT_ADVICE.get(path.suffix.lower(), f"Export it as one of: {ACCEPTED_FORMATS}."),
        )
    return read_file(path, reader, key)


def read_file(path: Path, reader: Callable[[Path], Recording], key: tuple[str, ...] = ()) -> Recording:
    """Read a regular file.

    Raises ConfigError if it does not exist, and for a pipe or a device, which might never end.
    """
    shown = str(path) if len(str(path)) <= LONGEST_PATH else f"{str(path)[:LONGEST_PATH]}..."
    name = f"{'.'.join(key)}: {shown}" if key else shown
    try:
        mode = path.stat().st_mode
        # A folder is not refused here, because the attempt to read it raises an OSError with the right reason.
        if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
            raise ConfigError(f"{name} is a pipe or a device, not a file.", "Save its output as a file first.", key)
        return reader(path)
    except OSError as error:
        reason = NO_FILE if isinstance(error, FileNotFoundError) else error.strerror or error
        raise ConfigError(f"{name} cannot be read: {reason}.", "Check the path of the file.", key) from error


def build_recording(
    path: Path,
    names: Sequence[str],
    values: Iterable[Array],
    units: Mapping[str, str],
    kind_units: Mapping[str, str],
    problems: Iterable[str] = (),
) -> Recording:
    """Build a recording from columns in order. Columns without a name are left out.

    problems  for each column, the reason why it cannot be used, or ''. Columns that share a name cannot be used either
    """
    columns = dict(zip(names, values, strict=True))
    reasons = {name: reason for name, reason in zip(names, problems, strict=False) if reason}
    reasons |= {name: f"{count} columns have this name" for name, count in Counter(names).items() if count > 1}
    columns.pop("", None)
    return Recording(path, columns, dict(units), dict(kind_units), reasons)


# Delimited text -------------------------------------------------------------------------------------------------------


def read_delimited(path: Path) -> Recording:
    """Read a CSV file or an ADAMS table: optional titles, a header, an optional row of units, and rows of numbers."""
    text = text_of(path)
    for beginning, (program, advice) in PROGRAMS.items():
        if beginning.match(text):
            raise ConfigError(f"{path} is a table of {program}, which walkerlab does not read.", advice)
    lines = merge_headers(remove_blanks(text.splitlines()))
    delimiter, header, unit_row, first = find_header(path, lines)
    # Units are in brackets after the names.
    units = [match[1] if (match := UNIT_IN_NAME.search(name)) else "" for name in header]
    names = [UNIT_IN_NAME.sub("", name).strip() or f"column {number}" for number, name in enumerate(header, 1)]
    stated = {name: of_row or unit for name, of_row, unit in zip(names, unit_row, units, strict=True) if of_row or unit}
    return table_of(path, names, lines, first, delimiter, stated)


def plain_numbers(lines: Sequence[str], delimiter: str, count: int) -> Array | None:
    """Return the columns (count, samples) of a table whose cells are all plain numbers, or None for another table."""
    # NumPy would warn about input without rows.
    if not any(map(str.strip, lines)):
        return None
    try:
        # With `comments=None`, a '#' counts as text in a cell, and the caller reports such cells.
        values = np.loadtxt(lines, delimiter=delimiter, comments=None, ndmin=2)
    except ValueError:
        return None
    return np.ascontiguousarray(values.T) if values.shape[1] == count else None


def merge_headers(lines: list[str]) -> list[str]:
    """Return the lines of a DeepLabCut table with one row of names, such as hip.x, instead of three or four."""
    rows = list(csv.reader(lines[:4]))
    coords = next((number for number, row in enumerate(rows) if row[:1] == ["coords"]), 0)
    if not coords or rows[0][:1] != ["scorer"]:
        return lines
    names = [".".join(parts) for parts in zip(*(row[1:] for row in rows[1 : coords + 1]), strict=False)]
    # Blank lines take the place of the old header, so that line numbers in messages stay right.
    return [*[""] * coords, ",".join(["frame", *(f'"{name}"' for name in names)]), *lines[coords + 1 :]]


def remove_blanks(lines: list[str]) -> list[str]:
    """Return the lines, with semicolons between columns if blanks separate numbers with decimal commas."""
    last = next((line for line in reversed(lines) if line.strip()), "")
    if not COMMAS_AND_BLANKS.fullmatch(last):
        return lines
    count = len(last.split())
    # Names may contain single blanks. So split a line at wider gaps if that gives the right number of cells.
    names = [re.split(" {2,}", line.strip()) for line in lines]
    return [";".join(wide if len(wide) == count else line.split()) for line, wide in zip(lines, names, strict=True)]


def text_of(path: Path) -> str:
    """Read a text file in UTF-16, in the encoding that an XML file declares, in UTF-8 or in Latin-1.

    Raises ConfigError for binary data.
    """
    data = path.read_bytes()
    declared = match[1].decode() if (match := DECLARED_ENCODING.match(data)) else "utf-8"
    # Some programs declare UTF-16 but write UTF-8. In real UTF-16 the pattern above would not match.
    encodings = ("utf-8-sig" if declared.lower().startswith(("utf-", "ucs-")) else declared, "utf-8-sig", "latin-1")
    for encoding in ("utf-16",) if data[:2] in (b"\xff\xfe", b"\xfe\xff") else encodings:
        try:
            text = data.decode(encoding)
        except (UnicodeDecodeError, LookupError):
            continue
        # Latin-1 decodes any bytes, so only a NUL reveals binary data.
        if "\0" in text:
            break
        return text
    raise ConfigError(f"{path} is not a text file, despite its extension.", f"Export it as one of: {ACCEPTED_FORMATS}.")


def rows_of(lines: Iterable[str], delimiter: str) -> Iterator[Row]:
    """Yield the rows that are not empty, with their cells stripped of blanks."""
    reader = csv.reader(lines, delimiter=delimiter)
    for row in reader:
        cells = [cell.strip() for cell in row]
        if any(cells):
            yield reader.line_num, cells


def find_header(path: Path, lines: Sequence[str]) -> tuple[str, list[str], list[str], int]:
    """Find the header, which is the first row of names above a row of as many values. A row of units may be between
    them.

    Returns the delimiter, the names, the units ('' without a row of units), and the line number of the first values.
    Tables with several columns are preferred to tables with one, and names that are words to names that are numbers.
    """
    tops = [(delimiter, list(rows_of(lines[:HEADER_LINES], delimiter))) for delimiter in DELIMITERS]
    places = [(rows[k : k + 3], delimiter) for delimiter, rows in tops for k in range(len(rows) - 1)]
    # The sort is stable, so if two delimiters fit the same line, the first of DELIMITERS is used.
    places.sort(key=lambda place: place[0][0][0])
    for fewest, only_words in product((2, 1), (True, False)):
        for ((_, names), *below), delimiter in places:
            has_units = len(below) > 1 and not any(map(is_number, below[0][1])) and any(map(is_unit, below[0][1]))
            units = below[0][1] if has_units else [""] * len(names)
            line, cells = below[has_units]
            alike = len(names) == len(units) == len(trim_blank_end(cells, len(names))) >= fewest
            numbers = sum(map(is_number, names))
            if alike and any(names) and numbers < (1 if only_words else len(names)) and any(map(is_number, cells)):
                return delimiter, names, units, line
    refuse_without_table(path, lines)
    raise ConfigError(
        f"{path} has no header with the names of its columns.",
        "Its first row must name them, separated by commas, semicolons or tabs: time (s), angle 1 (rad), ... "
        "Numbers with decimal commas need semicolons, tabs or quotes.",
    )


def refuse_without_table(path: Path, lines: Sequence[str]) -> None:
    """Raise ConfigError for a file that is empty, has no rows, or separates columns by an unsupported character."""
    rows = [line for line in lines if line.strip()]
    if not rows:
        raise ConfigError(f"{path} is empty.", "Export it again.")
    if len(rows) == 1 and any(character.isalpha() for character in rows[0]):
        raise ConfigError(f"{path} has a header but no rows of numbers.", "Export it again, with its samples.")
    for separator, name in (("|", "vertical bars"), (":", "colons"), (None, "blanks")):
        cells = [[cell.strip() for cell in row.split(separator)] for row in rows[-2:]]
        if all(sum(map(is_number, row)) > 1 for row in cells):
            raise ConfigError(
                f"{path} separates its columns by {name}.", "Separate them by commas, semicolons or tabs."
            )


def trim_blank_end(cells: list[str], count: int) -> list[str]:
    """Return the first `count` cells of a row if all others are empty, otherwise the whole row."""
    return cells if any(cells[count:]) else cells[:count]


def number_of(cell: str) -> float:
    """Parse a number with a decimal point or comma.

    Raises ValueError for other texts.
    """
    return float(cell.replace(",", ".") if DECIMAL_COMMA.fullmatch(cell) else cell)


def is_number(cell: str) -> bool:
    try:
        number_of(cell)
    except ValueError:
        return False
    return True


def table_of(
    path: Path,
    names: Sequence[str],
    lines: Sequence[str],
    first: int,
    delimiter: str,
    units: Mapping[str, str] = MappingProxyType({}),
    kind_units: Mapping[str, str] = MappingProxyType({}),
) -> Recording:
    """Build a recording from the lines of a table, whose rows begin in line `first`.

    Empty cells become nan, and a cell with text is a problem of its column.

    Raises ConfigError for a row with too many or too few cells.
    """
    if (plain := plain_numbers(lines[first - 1 :], delimiter, len(names))) is not None:
        return build_recording(path, names, plain, units, kind_units)
    numbers = []
    table = []
    for number, row in (row for row in rows_of(lines, delimiter) if row[0] >= first):
        cells = trim_blank_end(row, len(names))
        if len(cells) != len(names):
            raise ConfigError(
                f"{path}, line {number}: {len(cells)} values where the header names {len(names)} columns.",
                "Complete or remove the line.",
            )
        numbers.append(number)
        table.append(cells)

    @cache
    def has_points() -> bool:
        return any("." in cell and is_number(cell) for cells in table for cell in cells)

    columns = list(zip(*table, strict=True))
    clocks = {
        name: times for name, cells in zip(names, columns, strict=False) if (times := clock_times(cells)) is not None
    }
    parsed = [
        (clocks[name], "") if name in clocks else parse_column(column, numbers, has_points)
        for name, column in zip(names, columns, strict=False)
    ]
    values, problems = zip(*parsed, strict=True) if parsed else ([np.zeros(0)] * len(names), ())
    return build_recording(path, names, values, {**units, **dict.fromkeys(clocks, "s")}, kind_units, problems)


def clock_times(cells: Sequence[str]) -> Array | None:
    """Convert clock times, dates with times, or durations to seconds. Return None for a column of other cells.

    Times of day continue after midnight.
    """
    if not cells or not (":" in cells[0] or cells[0].startswith("P")):
        return None
    times = np.array([seconds_of(cell) for cell in cells])
    if not np.isfinite(times).all():
        return None
    # If the time falls by more than half a day, midnight has passed. `columns` reports a smaller fall as an error.
    return np.asarray(times + DAY_S * np.cumsum(np.diff(times, prepend=times[:1]) < -0.5 * DAY_S))


def seconds_of(cell: str) -> float:
    """Convert a duration, a time of day or a date to seconds.

    Times of day count from midnight, dates from 1970. Other cells give nan.
    """
    for pattern in CLOCKS:
        if match := pattern.fullmatch(cell.replace(",", ".")):
            days, hours, minutes, seconds = (float(part or 0.0) for part in match.groups())
            return days * DAY_S + 3600.0 * hours + 60.0 * minutes + seconds
    try:
        date = datetime.fromisoformat(cell)
    except ValueError:
        return math.nan
    # Without a time zone Python would assume the local one, in which times jump when summer time begins and ends.
    return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()


def parse_column(cells: Sequence[str], lines: Sequence[int], has_points: Callable[[], bool]) -> tuple[Array, str]:
    """Parse the cells of a column. Return the values and ''. If a cell is not a number, return incomplete values and
    the reason.

        lines       line number of each cell
        has_points  function that returns whether the file has numbers with a decimal point
    """
    try:
        return np.array([float(cell or "nan") for cell in cells]), ""
    except ValueError:
        values = np.full(len(cells), np.nan)
    commas = [index for index, cell in enumerate(cells) if DECIMAL_COMMA.fullmatch(cell)]
    # 1,234 can be 1.234 or 1234. If other numbers have points, the comma probably separates thousands.
    may_be_thousands = all(THOUSANDS.fullmatch(cells[index]) for index in commas)
    if commas and (any("." in cell and is_number(cell) for cell in cells) or (may_be_thousands and has_points())):
        return values, f"line {lines[commas[0]]}: {cells[commas[0]]!r} has a comma, but other numbers have points"
    for index, cell in enumerate(cells):
        try:
            values[index] = np.nan if cell.lower() in EMPTY else number_of(cell)
        except ValueError:
            return values, f"line {lines[index]}: {cell!r} is not a number"
    return values, ""


# ADAMS results --------------------------------------------------------------------------------------------------------


def read_adams_results(path: Path) -> Recording:
    """Read XML results of ADAMS (.res), which hold one value per component and output step, by component id."""
    try:
        root = ElementTree.fromstring(text_of(path))
    except ElementTree.ParseError as error:
        raise ConfigError(
            f"{path} is not complete XML: {error}.", "Export the results again with RESULTS/XRF."
        ) from None
    components = component_names(path, root)
    # The state at time 0 is only in the block initialConditions. Blocks named modelInput are not part of the walk.
    blocks = (block for block in root.iterfind(".//{*}Data") if not block.get("name", "").startswith("modelInput"))
    steps = [step for block in blocks for step in block.iterfind("{*}Step")]
    if not steps:
        raise ConfigError(
            f"{path} holds no simulation steps.", "Run a dynamic simulation before exporting its results."
        )
    values = np.array([parse_step(path, number, step, len(components)) for number, step in enumerate(steps, 1)])
    names = [name for _, name, _ in components]
    units = {name: unit for _, name, unit in components if unit not in ("", "no_units")}
    return drop_repeated_times(build_recording(path, names, values.T, units, xml_units(root)))


def component_names(path: Path, root: ElementTree.Element) -> list[tuple[int, str, str]]:
    """Return id, name and unit of each component, in ascending order of the ids."""
    try:
        names = [
            (
                int(component.get("id", "")),
                f"{entity.get('name')}.{component.get('name')}",
                component.get("unitsValue", ""),
            )
            for entity in root.iterfind(".//{*}Entity")
            for component in entity.iterfind("{*}Component")
        ]
    except ValueError:
        raise ConfigError(f"{path}: a component has no id.", "Export the results again with RESULTS/XRF.") from None
    if len({name[0] for name in names}) < len(names) or not names:
        raise ConfigError(
            f"{path}: component ids are missing or not unique.", "Export the results again with RESULTS/XRF."
        )
    return sorted(names)


def parse_step(path: Path, number: int, step: ElementTree.Element, count: int) -> list[float]:
    """Parse one simulation step into one value per component, ordered by id."""
    try:
        values = [number_of(cell) for cell in (step.text or "").split()]
    except ValueError:
        raise ConfigError(
            f"{path}: step {number} contains a value that is not a number.", "Export the results again."
        ) from None
    if len(values) != count:
        raise ConfigError(
            f"{path}: step {number} has {len(values)} numbers for {count} components.", "Export the results again."
        )
    return values


def xml_units(root: ElementTree.Element) -> dict[str, str]:
    """Return the unit of the model for each kind of quantity."""
    units: Mapping[str, str] = next((node.attrib for node in root.iterfind(".//{*}Units")), {})
    return {kind: units[kind] for kind in ("angle", "length", "time", "force") if units.get(kind)}


def drop_repeated_times(recording: Recording) -> Recording:
    """Keep only the last of several samples at one time. A block begins with the last sample of the previous block."""
    time = recording.columns.get(recording.time_name or "", np.zeros(0))
    last = np.append(np.diff(time) != 0.0, True) if time.size else np.zeros(0, bool)
    return replace(recording, columns={name: column[last] for name, column in recording.columns.items()})


# OpenSim --------------------------------------------------------------------------------------------------------------


def read_opensim(path: Path) -> Recording:
    """Read an OpenSim table (.sto, .mot) or its variant from SIMM: settings up to `endheader`, column names,
    and rows.
    """
    lines = text_of(path).splitlines()
    end = next((number for number, line in enumerate(lines) if line.strip().lower() == "endheader"), None)
    start = next((number for number, line in enumerate(lines) if end is not None and number > end and line.strip()), 0)
    if not start:
        raise ConfigError(f"{path} has no line 'endheader', or nothing after it.", "Export it again from OpenSim.")
    settings = dict(line.lower().replace(" ", "").split("=", 1) for line in lines[:end] if "=" in line)
    if settings.get("datatype", "double") != "double":
        raise ConfigError(
            f"{path} holds values of type {settings['datatype']}, not numbers.", "Export a table of type double."
        )
    names = split_at_tabs(lines[start].strip())
    if "\t" not in lines[start]:
        lines = ["\t".join(line.split()) for line in lines]
    units = {"length": "m", "time": "s", "angle": angle_unit(path, settings)}
    # Count the rows, because their number in the header is often wrong.
    table = table_of(path, names, lines, start + 2, "\t", {}, {kind: unit for kind, unit in units.items() if unit})
    return replace(table, levelled_by=SEGMENTS if table.columns.keys() >= SEGMENT_NAMES else "")


def angle_unit(path: Path, settings: Mapping[str, str]) -> str:
    """Return the unit in which OpenSim 4.6 reads the angles of an OpenSim table, or '' if the header of the table
    contradicts it.

    A .mot file without a version is from SIMM, in degrees. Other tables are in radians unless they say inDegrees=yes.
    """
    in_degrees = settings.get("indegrees", "")
    if path.suffix.lower() == ".mot" and "version" not in settings and in_degrees != "yes":
        return "" if in_degrees else "deg"
    return "deg" if in_degrees == "yes" else "rad"


def split_at_tabs(line: str) -> list[str]:
    """Split a line into cells at tabs, or at blanks if it has no tab."""
    return [cell.strip() for cell in next(csv.reader([line], delimiter="\t"))] if "\t" in line else line.split()


# Markers --------------------------------------------------------------------------------------------------------------


def read_markers(path: Path) -> Recording:
    """Read the markers of a .trc file as columns 'name.x', 'name.y', 'name.z'. Empty cells become nan."""
    lines = text_of(path).splitlines()
    if len(lines) < 5 or not lines[0].startswith("PathFileType"):
        raise ConfigError(
            f"{path} is not a marker file: its first line must begin with PathFileType.", "Export it again as .trc."
        )
    settings = dict(zip(split_at_tabs(lines[1]), split_at_tabs(lines[2]), strict=False))
    labels = split_at_tabs(lines[3].rstrip())
    # Usually a name is above the first of three coordinates. Some programs write the names side by side.
    spread = not any(labels[3::3]) and not any(labels[4::3])
    markers = labels[2::3] if spread else labels[2:]
    count = sum(map(bool, split_at_tabs(lines[4]))) // 3
    stated = settings.get("NumMarkers", "")
    if len(markers) > count or (stated and stated != str(count)):
        raise ConfigError(
            f"{path} has names for {len(markers)} markers and coordinates for {count}, and its NumMarkers is {stated}.",
            "Export it again as .trc, with a name for every marker.",
        )
    if not any(map(str.strip, lines[5:])) or not any(markers):
        raise ConfigError(f"{path} holds no markers.", "Export it again as .trc.")
    names = [*labels[:2], *coordinates(markers), *[""] * (3 * (count - len(markers)))]
    tabs = len(names) - 1
    # Some programs omit the tabs after the last marker that was seen. A line without tabs is blank.
    if not {line.count("\t") for line in lines[5:]} <= {0, tabs}:
        lines = [line + "\t" * (tabs - line.count("\t")) if line.strip() else "" for line in lines]
    unit = settings.get("Units")
    by_sports2d = "Sports2D" in lines[0]
    # Sports2D states metres even if the coordinates are pixels.
    in_pixels = by_sports2d and "_px" in lines[0]
    kind_units = {"time": "s", **({"length": unit} if unit and not in_pixels else {})}
    table = table_of(path, names, lines, 6, "\t", {}, kind_units)
    return replace(table, levelled_by="Sports2D" if by_sports2d and not in_pixels else "")


def coordinates(markers: Iterable[str]) -> list[str]:
    """Return the names of the columns x, y and z of each marker, or () for a marker without a name."""
    return [f"{marker}.{axis}" if marker else "" for marker in markers for axis in "xyz"]


def read_c3d(path: Path) -> Recording:
    """Read the markers of a C3D file as columns 'name.x', 'name.y', 'name.z'. This needs the package extra `data`."""
    if find_spec("ezc3d") is None:
        raise ConfigError(f"{path}: reading C3D needs ezc3d.", 'Install it: pip install "walkerlab[data]"')
    arrays = c3d_arrays(path)
    places = arrays["places"]
    labels = [str(label).strip() for label in arrays["labels"]]
    rate = float(arrays["rate"][0]) if arrays["rate"].size else 0.0
    if not any(labels) or not rate > 0.0 or places.ndim != 3 or places.shape[1] < len(labels):
        raise ConfigError(f"{path} has no markers or no frame rate.", "Export it again.")
    # ezc3d adds a fourth coordinate to each point.
    values = places[:3, : len(labels)].transpose(1, 0, 2).reshape(-1, places.shape[2])
    unit = str(arrays["units"][0]).strip() if arrays["units"].size else ""
    kind_units = {"time": "s", **({"length": unit} if unit else {})}
    time = np.arange(places.shape[2]) / rate
    return build_recording(path, [TIME, *coordinates(labels)], [time, *values], {}, kind_units)


def c3d_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Read labels, rate, units and marker positions (3 or 4, markers, frames) with ezc3d."""
    with path.open("rb"):  # This raises OSError for an unreadable file, which ezc3d does not.
        pass
    # A child process runs ezc3d, because damaged files crash it with segmentation faults.
    try:
        # Without -P, modules in the working folder could take the place of the real ones.
        command = [sys.executable, "-P", "-c", C3D_PROGRAM, str(path)]
        done = subprocess.run(command, capture_output=True, check=True, timeout=C3D_PATIENCE_S)
        with np.load(BytesIO(done.stdout), allow_pickle=False) as arrays:
            return dict(arrays)
    except (subprocess.SubprocessError, ValueError, EOFError, BadZipFile):
        raise ConfigError(f"{path} is not a C3D file that ezc3d can read.", "Export it again.") from None


READERS: Final[dict[str, Callable[[Path], Recording]]] = {
    **dict.fromkeys((".csv", ".txt", ".tab", ".tsv"), read_delimited),
    ".res": read_adams_results,
    **dict.fromkeys((".sto", ".mot"), read_opensim),
    ".trc": read_markers,
    ".c3d": read_c3d,
}
FORMAT_ADVICE: Final = {
    ".req": "Request files differ between versions of ADAMS. Export .res (RESULTS/XRF) or a table instead.",
    **dict.fromkeys((".xlsx", ".xls"), "Save the sheet as CSV."),
    ".mat": "Export the columns as CSV.",
}
