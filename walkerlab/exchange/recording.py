"""Read time series from files that other programs or people wrote.

`read_recording` chooses the format by the file extension: delimited text (CSV, ADAMS tables), ADAMS results (.res),
OpenSim tables (.sto, .mot), markers (.trc, .c3d). The module `columns` maps them to quantities of a walk.
"""

from __future__ import annotations

import csv
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from walkerlab.errors import ConfigError

Array = NDArray[np.float64]

TIME: Final = "time"
TIME_NAMES = [re.compile(pattern) for pattern in ("(?i:time)", "t", r"(?i:.*[.\s_]time)", "T")]
"""Names of a file's time column; T comes last, because it may be a temperature."""
UNIT_IN_NAME: Final = re.compile(r"\s*[\[(]\s*([^\[\]()]*?)\s*[\])]\s*$")
DELIMITERS: Final = "\t;,"
EMPTY: Final = frozenset({"", "nan", "na", "n/a", "null", "none", "-", "#n/a"})
"""Texts of cells without a value, in lower case."""
HEADER_LINES: Final = 60
"""Number of lines at the top of a file that are searched for the header."""
WANTED: Final = "CSV (.csv, .txt, .tab, .tsv), ADAMS results (.res), OpenSim (.sto, .mot), markers (.trc, .c3d)"


C3D_PATIENCE_S: Final = 60.0
C3D_PROGRAM: Final = """
import sys, ezc3d, numpy
content = ezc3d.c3d(sys.argv[1])
point = content["parameters"]["POINT"]
labels, units = (numpy.array(point.get(name, {}).get("value", []), str) for name in ("LABELS", "UNITS"))
rate = numpy.ravel(point["RATE"]["value"])
numpy.savez(sys.stdout.buffer, places=content["data"]["points"], rate=rate, labels=labels, units=units)
"""


@dataclass(frozen=True, eq=False)
class Recording:
    """Time series of a recording as stored in the file, before any unit conversion; missing values are nan."""

    path: Path
    columns: dict[str, Array]  # (samples,) arrays by name; the time column is named `time`
    units: dict[str, str] = field(default_factory=dict)  # unit by column, where the file states one, as written there
    # unit by kind ('angle', 'length', 'time', 'force'), where the file states one for all columns of that kind
    kind_units: dict[str, str] = field(default_factory=dict)


def read_recording(path: Path) -> Recording:
    """Read the columns of a file, in the format of its extension.

    Raises ConfigError if the file cannot be read, is damaged, or has an unknown format.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise ConfigError(
            f"{path} has an unsupported format ({path.suffix or 'no extension'}).",
            FORMAT_ADVICE.get(path.suffix.lower(), f"Export it as one of: {WANTED}."),
        )
    try:
        recording = reader(path)
    except OSError as error:
        raise ConfigError(
            f"{path} cannot be read: {error.strerror or error}.", "Check the path given to --with."
        ) from error
    return checked_time(recording)


def checked_time(recording: Recording) -> Recording:
    """Return the recording unchanged; raises ConfigError unless its time is complete and strictly rising."""
    time, path = recording.columns.get(TIME), recording.path
    if time is None:
        names = ", ".join(list(recording.columns)[:8])
        raise ConfigError(f"{path} has no time column; the first columns are {names}.", "Name it: --columns time=NAME")
    if time.size < 2:
        raise ConfigError(f"{path} holds {time.size} samples; a walk needs at least two.", "Record a longer walk.")
    gaps = np.flatnonzero(~np.isfinite(time))
    if gaps.size:
        raise ConfigError(
            f"{path}: time is missing at sample {gaps[0] + 1}.", "Fill the time column, or leave out such rows."
        )
    steps_back = np.flatnonzero(np.diff(time) <= 0.0)
    if steps_back.size:
        row = int(steps_back[0])
        raise ConfigError(
            f"{path}: time does not increase from sample {row + 1} ({time[row]:.9g}) "
            f"to {row + 2} ({time[row + 1]:.9g}).",
            "Sort the rows by time, and remove duplicate times.",
        )
    return recording


# Delimited text -------------------------------------------------------------------------------------------------------


def read_delimited(path: Path) -> Recording:
    """Read a CSV file or an ADAMS table, which has optional titles, a header, and rows of numbers."""
    lines = without_last_delimiters(text_of(path).splitlines())
    header, delimiter = header_of(path, lines)
    names, units = names_and_units(split_row(lines[header], delimiter))
    names = unique(path, names)
    values = numbers_in(path, lines, header + 1, delimiter, len(names))
    columns = {name: values[:, place] for place, name in enumerate(names)}
    return as_time_column(
        Recording(path, columns, {name: unit for name, unit in zip(names, units, strict=True) if unit})
    )


def text_of(path: Path) -> str:
    """Read a text file in UTF-8, UTF-16 or Latin-1; raises ConfigError for binary data."""
    data = path.read_bytes()
    for encoding in ("utf-16",) if data[:2] in (b"\xff\xfe", b"\xfe\xff") else ("utf-8-sig", "latin-1"):
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" in text:
            break
        return text
    raise ConfigError(f"{path} is not a text file, despite its extension.", f"Export it as one of: {WANTED}.")


def without_last_delimiters(lines: list[str]) -> list[str]:
    """Remove the delimiter that some spreadsheets append to every row."""
    first = next((number for number, line in enumerate(lines) if line.endswith(tuple(DELIMITERS))), len(lines))
    last = lines[first][-1] if first < len(lines) else ""
    header_is_before = first > 0 and last in lines[first - 1]
    if header_is_before or not all(line.endswith(last) for line in lines[first:] if line.strip()):
        return lines
    return [*lines[:first], *(line[:-1] for line in lines[first:])]


def header_of(path: Path, lines: Sequence[str]) -> tuple[int, str]:
    """Find the header, the first row of names above a row of as many values; return its index and the delimiter.

    A table with several columns takes precedence over a table with one column.
    """
    several = [(number, delimiter) for number in range(len(lines[:HEADER_LINES])) for delimiter in DELIMITERS]
    for fewest in (2, 1):
        for number, delimiter in several:
            following = next((row for row in lines[number + 1 :] if row.strip()), "")
            names, cells = split_row(lines[number], delimiter), split_row(following, delimiter)
            alike = len(names) == len(cells) >= fewest and all(names)
            if alike and not all(map(is_number, names)) and any(map(is_number, cells)):
                return number, delimiter
    raise ConfigError(
        f"{path} has no header with the names of its columns.",
        "Its first row must name them, separated by commas, semicolons or tabs: time (s), angle 1 (rad), ...",
    )


def split_row(line: str, delimiter: str) -> list[str]:
    """Split a row into cells, stripped of blanks."""
    return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]


def is_number(cell: str) -> bool:
    """Return whether a cell holds a number, with a decimal point or comma."""
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def names_and_units(header: Iterable[str]) -> tuple[list[str], list[str]]:
    """Split column headers into names and the units in brackets, which are empty if absent."""
    units = [match[1] if (match := UNIT_IN_NAME.search(name)) else "" for name in header]
    return [UNIT_IN_NAME.sub("", name).strip() for name in header], units


def unique(path: Path, names: Sequence[str]) -> list[str]:
    """Return the names; raises ConfigError if two are the same."""
    for name in names:
        if names.count(name) > 1:
            raise ConfigError(f"{path} has two columns named {name!r}.", "Give each column a unique name.")
    return list(names)


def numbers_in(path: Path, lines: Sequence[str], first: int, delimiter: str, count: int) -> Array:
    """Parse the lines from index `first` on into an array (rows, count); empty cells become nan."""
    rows = [line for line in lines[first:] if line.strip()]
    text = "\n".join(rows)
    if delimiter == ";":
        text = text.replace(",", ".")
    try:
        values = np.loadtxt(StringIO(text), delimiter=delimiter, ndmin=2, comments=None)
        if values.shape[1] == count:
            return values
    except ValueError:
        pass  # a cell is empty or not a number, so read cell by cell
    return table_of(path, numbered_rows(lines, first), delimiter, count)


def numbered_rows(lines: Sequence[str], first: int) -> Iterator[tuple[int, str]]:
    """Return the non-blank lines from index `first` on, with line numbers as an editor shows them."""
    return ((number + 1, line) for number, line in enumerate(lines) if number >= first and line.strip())


def table_of(path: Path, rows: Iterable[tuple[int, str]], delimiter: str, count: int) -> Array:
    """Parse numbered lines cell by cell into an array (rows, count); empty cells become nan."""
    cells = [cells_as_numbers(path, number, line, delimiter, count) for number, line in rows]
    return np.array(cells).reshape(len(cells), count)


def cells_as_numbers(path: Path, number: int, line: str, delimiter: str, count: int) -> list[float]:
    """Parse a row into numbers, nan for empty cells; raises ConfigError if the count is wrong or a cell holds text."""
    cells = split_row(line.replace(",", ".") if delimiter == ";" else line, delimiter)
    if len(cells) != count:
        raise ConfigError(
            f"{path}, line {number}: {len(cells)} values where the header names {count} columns.",
            "Complete or remove the line.",
        )
    try:
        return [np.nan if cell.lower() in EMPTY else float(cell) for cell in cells]
    except ValueError:
        wrong = next(cell for cell in cells if cell.lower() not in EMPTY and not is_number(cell))
        raise ConfigError(
            f"{path}, line {number}: {wrong!r} is not a number.", "Correct it, or leave the cell empty."
        ) from None


def as_time_column(recording: Recording) -> Recording:
    """Rename the time column to `time`: the first whose name matches the first of TIME_NAMES that any name matches."""
    columns = recording.columns
    name = next((name for pattern in TIME_NAMES for name in columns if pattern.fullmatch(name)), None)
    if name is None or name == TIME:
        return recording
    renamed = {TIME if key == name else key: values for key, values in columns.items()}
    return replace(
        recording, columns=renamed, units={TIME if key == name else key: unit for key, unit in recording.units.items()}
    )


# ADAMS results --------------------------------------------------------------------------------------------------------


def read_adams_results(path: Path) -> Recording:
    """Read XML results of ADAMS (.res): components with ids, and steps with a number for each component."""
    try:
        root = ElementTree.parse(path).getroot()
    except ElementTree.ParseError as error:
        raise ConfigError(
            f"{path} is not complete XML: {error}.", "Export the results again with RESULTS/XRF."
        ) from None
    blocks = [
        block
        for block in elements(root, "Data")
        if not str(block.get("name", "")).startswith(("modelInput", "initial"))
    ]
    names = component_names(path, root)
    steps = [step for block in blocks for step in elements(block, "Step")]
    if not steps:
        raise ConfigError(
            f"{path} holds no simulation steps.", "Run a dynamic simulation before exporting its results."
        )
    values = np.array([numbers_of_step(path, place, step, len(names)) for place, step in enumerate(steps)])
    time = next((name for _, name, _ in names if name.lower() in ("time", "time.time")), "")
    called = [TIME if name == time else name for _, name, _ in names]
    columns = {name: values[:, place] for place, name in enumerate(called)}
    units = {name: unit for name, (_, _, unit) in zip(called, names, strict=True) if unit not in ("", "no_units")}
    return without_repeated_times(Recording(path, columns, units, xml_units(root)))


def elements(node: ElementTree.Element, tag: str) -> Iterator[ElementTree.Element]:
    """Return all elements below a node that have this tag, in any namespace."""
    return (element for element in node.iter() if element.tag.rpartition("}")[2] == tag)


def component_names(path: Path, root: ElementTree.Element) -> list[tuple[int, str, str]]:
    """Return id, name and unit of each component, in ascending order of the ids."""
    try:
        names = [
            (
                int(component.get("id", "")),
                f"{entity.get('name')}.{component.get('name')}",
                component.get("unitsValue", ""),
            )
            for entity in elements(root, "Entity")
            for component in elements(entity, "Component")
        ]
    except ValueError:
        raise ConfigError(f"{path}: a component has no id.", "Export the results again with RESULTS/XRF.") from None
    if len({name[0] for name in names}) < len(names) or not names:
        raise ConfigError(
            f"{path}: component ids are missing or not unique.", "Export the results again with RESULTS/XRF."
        )
    return sorted(names)


def numbers_of_step(path: Path, place: int, step: ElementTree.Element, count: int) -> list[float]:
    """Return a step's numbers, in the order of the components' ids."""
    try:
        values = [float(cell) for cell in (step.text or "").split()]
    except ValueError:
        raise ConfigError(
            f"{path}: step {place + 1} contains a value that is not a number.", "Export the results again."
        ) from None
    if len(values) != count:
        raise ConfigError(
            f"{path}: step {place + 1} holds {len(values)} numbers for {count} components.", "Export the results again."
        )
    return values


def xml_units(root: ElementTree.Element) -> dict[str, str]:
    """Return the model's unit for each kind of quantity."""
    units: Mapping[str, str] = next((node.attrib for node in elements(root, "Units")), {})
    return {kind: units[kind] for kind in ("angle", "length", "time", "force") if units.get(kind)}


def without_repeated_times(recording: Recording) -> Recording:
    """Remove samples that repeat a time: a block begins with the last sample of the block before it."""
    time = recording.columns.get(TIME, np.zeros(0))
    rising = np.concatenate(([True], np.diff(time) != 0.0)) if time.size else np.zeros(0, bool)
    return replace(recording, columns={name: column[rising] for name, column in recording.columns.items()})


# OpenSim --------------------------------------------------------------------------------------------------------------


def read_opensim(path: Path) -> Recording:
    """Read an OpenSim table (.sto, .mot) or SIMM's variant: settings up to `endheader`, column names, and rows."""
    lines = text_of(path).splitlines()
    end = next((number for number, line in enumerate(lines) if line.strip().lower() == "endheader"), None)
    if end is None or end + 1 >= len(lines):
        raise ConfigError(f"{path} has no line 'endheader', or nothing after it.", "Export it again from OpenSim.")
    settings = dict(line.lower().replace(" ", "").split("=", 1) for line in lines[:end] if "=" in line)
    if settings.get("datatype", "double") != "double":
        raise ConfigError(
            f"{path} holds values of type {settings['datatype']}, not numbers.", "Export a table of type double."
        )
    start = next((number for number in range(end + 1, len(lines)) if lines[number].strip()), len(lines) - 1)
    names = unique(path, lines[start].split())
    # the rows are counted, because their number in the header is often wrong
    rows = [(number, "\t".join(line.split())) for number, line in numbered_rows(lines, start + 1)]
    values = table_of(path, rows, "\t", len(names))
    units = {"angle": "deg" if settings.get("indegrees", "no") == "yes" else "rad", "length": "m", "time": "s"}
    return as_time_column(Recording(path, {name: values[:, place] for place, name in enumerate(names)}, {}, units))


# Markers --------------------------------------------------------------------------------------------------------------


def read_markers(path: Path) -> Recording:
    """Read the markers of a .trc file as columns 'name.x', 'name.y', 'name.z'; empty cells become nan."""
    lines = text_of(path).splitlines()
    if len(lines) < 5 or not lines[0].startswith("PathFileType"):
        raise ConfigError(
            f"{path} is not a marker file: its first line must begin with PathFileType.", "Export it again as .trc."
        )
    settings = dict(zip(lines[1].split(), lines[2].split(), strict=False))
    labels = [label.strip() for label in lines[3].split("\t")]
    names = [label for label in labels[2:] if label]
    rows = list(numbered_rows(lines, 5))
    if not rows or not names:
        raise ConfigError(f"{path} holds no markers.", "Export it again as .trc.")
    columns = [f"{name}.{axis}" for name in unique(path, names) for axis in "xyz"]
    width = 2 + len(columns)
    cells = [(number, [*line.rstrip("\r\n").split("\t"), *[""] * width][:width]) for number, line in rows]
    values = table_of(path, [(number, "\t".join(row)) for number, row in cells], "\t", width)
    units = {"time": "s", **({"length": settings["Units"]} if "Units" in settings else {})}
    markers = {name: values[:, 2 + place] for place, name in enumerate(columns)}
    return Recording(path, {TIME: values[:, 1], **markers}, {}, units)


def read_c3d(path: Path) -> Recording:
    """Read the markers of a C3D file as columns 'name.x', 'name.y', 'name.z'; needs the package extra `data`."""
    if find_spec("ezc3d") is None:
        raise ConfigError(f"{path}: reading C3D needs ezc3d.", 'Install it: pip install "walkerlab[data]"')
    arrays = c3d_arrays(path)
    names, places = unique(path, [str(label).strip() for label in arrays["labels"]]), arrays["places"]
    rate = float(arrays["rate"][0]) if arrays["rate"].size else 0.0
    if not names or not rate > 0.0 or places.ndim != 3 or places.shape[1] < len(names):
        raise ConfigError(f"{path} holds no markers, or no frame rate.", "Export it again.")
    columns = {
        f"{name}.{axis}": places[place, row] for row, name in enumerate(names) for place, axis in enumerate("xyz")
    }
    kind_units = {"time": "s", **({"length": str(arrays["units"][0])} if arrays["units"].size else {})}
    return Recording(path, {TIME: np.arange(places.shape[2]) / rate, **columns}, {}, kind_units)


def c3d_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Read labels, rate, units and marker positions (3 or 4, markers, frames) with ezc3d."""
    with path.open("rb"):  # raises OSError for an unreadable file; ezc3d does not
        pass
    # Damaged files end ezc3d in segmentation faults, so a child process runs it.
    try:
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
    ".req": "Request files differ between versions of ADAMS; export .res (RESULTS/XRF) or a table instead.",
    ".xlsx": "Save the sheet as CSV.",
    ".xls": "Save the sheet as CSV.",
    ".mat": "Export the columns as CSV.",
}
