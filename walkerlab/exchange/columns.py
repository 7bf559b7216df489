"""Find the quantities of a walk among the columns of a recording, and convert them to SI units. A column is found by
its name, by the end of its name, or as the user specifies.
"""

import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walkerlab.config.recording import Recorded
from walkerlab.errors import ConfigError
from walkerlab.exchange import marker_lines
from walkerlab.exchange.recording import SEGMENTS, SI, TIME, UNIT_IN_NAME, UNIT_VALUES, Array, Recording, value_in_si

LEG_QUANTITIES: Final = {
    "angle": "angle", "velocity": "rate", "shank_angle": "angle", "shank_velocity": "rate", "foot_along_m": "length",
    "foot_height_m": "length", "knee_along_m": "length", "knee_height_m": "length", "normal_force_N": "force",
    "friction_force_N": "force", "penetration_m": "length", "slip_velocity_m_s": "speed",
}  # fmt: skip
WALKER_QUANTITIES: Final = {
    TIME: "time", "torso_angle": "angle", "torso_velocity": "rate", "hip_along_m": "length", "hip_height_m": "length",
    "kinetic_J": "energy", "potential_J": "energy", "mechanical_J": "energy", "total_energy_J": "energy",
}  # fmt: skip
QUANTITY_KINDS: Final = WALKER_QUANTITIES | {
    f"{name} {leg}": kind for name, kind in LEG_QUANTITIES.items() for leg in (1, 2)
}
"""Kind of unit of each quantity. If a quantity belongs to a leg, its name ends in 1 or 2."""
NEEDED: Final = (TIME, "angle 1", "angle 2")
UNIT_AT_END: Final = re.compile(r"_(?:m_s|m|n)$")
LINE: Final = re.compile(r"(.+?)\s*>\s*(.+)")
"""Pattern for the angle of a line from one marker to another, as in `angle 1=HIP>HEEL`."""
HIP_OF_LINES: Final = "upper marker along the walk"
"""Name of the quantity for the position (m) of the first line's upper marker along the direction of the walk. It
exists if the angles are computed from lines between markers.
"""
SAMPLE: Final = "sample"
"""Name of the quantity that numbers the samples of the file, counted from 1."""
QUOTED: Final = re.compile(r"""["'](.*)["']""")
SIGN_AND_OFFSET: Final = re.compile(r"(-?)(.+?)(?:([+-] *(?:\d+\.?\d*|\.\d+)) *([a-zA-Z°/]+))?")
"""Pattern for a column with an optional minus sign and an added constant, such as -NAME+90deg."""
FRAME: Final = re.compile(r"(?i:frames?(?:[\s_]?(?:idx|index|number|no\.?))?#?)")
"""Pattern for the name of a column that counts frames."""
PAIR: Final = re.compile(r"""(?:[^,"]|"[^"]*")+|"[^,]*""")
FRAME_TIME: Final = "frame / fps"
SAME_RATE: Final = 0.01  # frame rates that differ by less than this (relative) count as equal
LIKELIHOOD: Final = r"(?i:[\s._:]+(?:likelihood|confidence|score))"
DOUBTFUL_LIKELIHOOD: Final = 0.5  # likelihood below which the position of a marker is doubtful


@dataclass(frozen=True, eq=False)
class RecordedWalk:
    """Recorded walk in SI units: time (samples,), quantities (samples,) by name, and the columns they come from."""

    time_s: Array
    quantities: dict[str, Array]
    sources: dict[str, str] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)  # reason why a column is not used, by quantity
    walks: str = ""  # stated direction of the walk, or '' if it has to be found
    unit_is_stated: bool = True  # whether the file or the user states the unit of the leg angles explicitly
    lines: tuple[str, ...] = ()  # quantities that are angles of lines between markers
    doubts: tuple[str, ...] = ()  # oddities of the recording, and how they were handled
    gaps: str = ""  # which samples within the walk are left out because of missing values
    tilt_rad: float = 0.0  # forward lean (rad) of the direction from which angles are measured
    belt_m_s: float = 0.0  # speed of a treadmill's belt
    hip_is_in_m: bool = False  # whether the position of the upper marker is in a known unit

    def both_legs(self, name: str) -> Array | None:
        """Return a quantity of both legs (samples, 2), or None unless it is recorded for both."""
        both = [self.quantities.get(f"{name} {leg}") for leg in (1, 2)]
        return None if both[0] is None or both[1] is None else np.stack([both[0], both[1]], axis=1)


@dataclass(frozen=True)
class ColumnSource:
    """Source of a quantity: a column, or a line between markers. Values are multiplied by `sign`, then `constant` is
    added.
    """

    column: str
    sign: float = 1.0
    constant: float = 0.0  # SI


def as_walk(recording: Recording, asked: Recorded, slope_rad: float = 0.0) -> RecordedWalk:
    """Return the quantities of a recorded walk in SI units.

    asked      what the user says about the file
    slope_rad  slope of the ground, for angles from the floor's normal

    Raises ConfigError if a column or unit is unknown or missing, if there are gaps, or if the recording shows running.
    """
    units = asked.units
    refuse_units(recording, units, QUANTITY_KINDS)
    recording, notes = set_frame_times(recording, asked)
    # The frame rate has replaced the times of the file, so a unit that is stated for them does not apply.
    if FRAME_TIME in recording.columns:
        units = {name: unit for name, unit in units.items() if name != TIME}
    named = find_named(recording, asked)
    sources, left_out = match_columns(recording, named.keys())
    sources |= {name: source.column for name, source in named.items()}
    for name in NEEDED:
        if name in left_out:
            raise ConfigError(left_out[name], f'Choose one: --columns "{name}=..."')
        if name not in sources:
            raise missing_error(recording, name)
    ends = {name: pairs for name, source in sources.items() if (pairs := ends_of(recording, source))}
    recording, more_notes = remove_unlikely_positions(recording, [sources[name] for name in ends], asked.min_likelihood)
    for pairs in ends.values():
        columns_with_gaps, unseen = marker_lines.replace_unseen(recording.columns, pairs)
        recording = replace(recording, columns=columns_with_gaps, unseen=recording.unseen | unseen)
    # Frozen markers of lines are found later, marker by marker, see `body_gaps`.
    recording = remove_frozen_angles(recording, [sources[name] for name in NEEDED[1:] if name not in ends])
    # A fault in a column that every walk needs, or that the user names, is an error. Other faulty columns are left out.
    needed = [sources[name] for name in {**dict.fromkeys(NEEDED), **named}]
    time_unit = unit_value(recording, TIME, sources[TIME], "time", units)
    rows = select_span(recording, recording.columns[sources[TIME]] * time_unit, asked)
    rows, cut, gaps = rows_without_gaps(recording, needed, rows)
    left_out |= {"samples": cut} if cut else {}
    within = replace(recording, columns={name: values[rows] for name, values in recording.columns.items()})
    values = {}
    lines = dict[str, marker_lines.Line]()
    for name, column in sources.items():
        try:
            refuse_gaps(recording, column, rows)
            if name in ends:
                lines[name] = places_of_ends(within, ends[name], units)
            else:
                source = named.get(name, ColumnSource(column))
                unit = unit_value(recording, name, column, QUANTITY_KINDS[name], units)
                floor = floor_in_column(recording, asked, slope_rad) if name in NEEDED[1:] else 0.0
                values[name] = source.sign * (unit * within.columns[column] + floor) + source.constant
        except ConfigError as error:
            if column in needed:
                raise
            left_out[name] = error.message.removeprefix(f"{recording.path}: ")
    time = values.pop(TIME)
    refuse_order(recording.path, time)
    used = {name: sources[name] for name in (TIME, *values, *lines)}
    # From here on samples may be left out. Messages still name samples by their numbers in the file.
    values[SAMPLE] = np.asarray(1.0 + np.flatnonzero(rows))
    tilt, tilt_notes = camera_tilt(recording, asked, slope_rad)
    walk = RecordedWalk(
        time,
        values,
        used,
        left_out,
        asked.walks or "",
        states_unit(recording, sources["angle 1"], units),
        doubts=(*notes, *more_notes, *tilt_notes, *([f"{gaps}."] if gaps else [])),
        gaps=gaps,
        tilt_rad=tilt,
        belt_m_s=asked.belt_speed_m_s or 0.0,
        hip_is_in_m=bool(lines) and scale_of_line(recording, ends[next(iter(lines))], units) is not None,
    )
    if not lines:
        return walk
    constants = {name: source.constant for name, source in named.items() if name in lines}
    return add_lines(walk, lines, constants, str(recording.path))


def set_frame_times(recording: Recording, asked: Recorded) -> tuple[Recording, list[str]]:
    """Compute times from frame numbers if the user states a frame rate. Also return notes about the times.

    Frame numbers come from a column that counts frames. Without one, they come from regular times, or else from the
    order of the samples.
    """
    if asked.fps is None or not recording.columns:
        return recording, []
    name = asked.columns.get(TIME) or next((name for name in recording.columns if FRAME.fullmatch(name)), None)
    stated = recording.columns.get(recording.time_name or "", np.zeros(0))
    intervals = np.diff(stated[np.isfinite(stated)])
    notes = []
    if name is not None:
        refuse_problem(recording, name := named_column(recording, name))
        frames = recording.columns[columns_of(recording, name)[0]]
        if np.any(np.mod(frames[np.isfinite(frames)], 1.0)):
            raise ConfigError(f"{recording.path}: {name!r} does not count frames.", "Leave out --fps, or that column.")
    elif intervals.size and (typical := float(np.median(intervals))) > 0.0:
        # Where frames are missing, the intervals between times are longer. Rounding counts the missing frames, too.
        frames = np.round((stated - stated[0]) / typical)
        value = value_in_si(stated_unit(recording, TIME, recording.time_name or "", "time", asked.units), "time") or 1.0
        if abs(asked.fps * typical * value - 1.0) > SAME_RATE:
            notes = [
                f"The file's times, {1.0 / (typical * value):.4g} frames/s, are replaced by {asked.fps:g} frames/s."
            ]
    else:
        frames = np.arange(float(next(iter(recording.columns.values())).size))
    columns = {name: values for name, values in recording.columns.items() if name != recording.time_name}
    units = recording.units | {FRAME_TIME: SI["time"]}
    return replace(recording, columns={FRAME_TIME: frames / asked.fps, **columns}, units=units), notes


def remove_unlikely_positions(
    recording: Recording, lines: Sequence[str], least: float | None
) -> tuple[Recording, list[str]]:
    """Mark positions of the markers of `lines` as gaps if their likelihood is below `least`. Also return notes.

    Raises ConfigError if the file has no likelihoods although the user gives a limit.
    """
    markers = dict.fromkeys(marker for line in lines if (ends := LINE.fullmatch(line)) for marker in ends.groups())
    likelihoods = {
        marker: recording.columns[column]
        for marker in markers
        for column in recording.columns
        if re.fullmatch(rf"{re.escape(marker)}{LIKELIHOOD}", column)
    }
    if least is None:
        low = {marker: each < DOUBTFUL_LIKELIHOOD for marker, each in likelihoods.items()}
        spelled = ", ".join(f"{name} at {marker_lines.spell_rows(rows)}" for name, rows in low.items() if rows.any())
        return recording, [
            f"Likelihoods are below {DOUBTFUL_LIKELIHOOD:g}: {spelled}. --min-likelihood turns them into gaps."
        ] if spelled else []
    if not likelihoods:
        raise ConfigError(
            f"{recording.path} has no likelihoods of {' and '.join(markers) or 'markers'}.",
            "They would be in columns such as HIP.likelihood. Leave out --min-likelihood.",
        )
    columns = dict(recording.columns)
    unseen = dict(recording.unseen)
    for marker, likelihood in likelihoods.items():
        for column in axes_of(recording, marker).values():
            columns[column] = np.where(likelihood < least, np.nan, columns[column])
            unseen[column] = f"likelihoods below {least:g} are taken for 'not seen'"
    return replace(recording, columns=columns, unseen=unseen), []


def remove_frozen_angles(recording: Recording, names: Iterable[str]) -> Recording:
    """Mark angles as gaps where they stay constant for some samples and then jump.

    Software that fills gaps produces such angles.
    """
    for name in names:
        if name in recording.problems:
            continue
        values = recording.columns[name]
        if (frozen := marker_lines.frozen_rows(values[:, None])).any():
            columns = recording.columns | {name: np.where(frozen, np.nan, values)}
            recording = replace(recording, columns=columns, unseen=recording.unseen | {name: "it stands still there"})
    return recording


def camera_tilt(recording: Recording, asked: Recorded, slope_rad: float) -> tuple[float, list[str]]:
    """Return the forward lean (rad) of the direction from which angles are measured, and notes about it."""
    tilt = asked.camera_tilt_deg
    if tilt is None and recording.levelled_by:
        # In tables of angles, the angle of the floor is added to the values instead, see `floor_in_column`.
        return (0.0 if recording.levelled_by == SEGMENTS else slope_rad), [
            f"{recording.levelled_by} levels the floor, so angles are taken from the floor's normal: state "
            "--camera-tilt 0 if its floor_angle was 0."
        ]
    if isinstance(tilt, float | int):
        return math.radians(tilt), []
    return (slope_rad if tilt == "floor" else 0.0), []


def floor_in_column(recording: Recording, asked: Recorded, slope_rad: float) -> float:
    """Return the angle (rad) that Sports2D subtracted from the angles of segments to level the floor in the picture.

    Sports2D uses the same sign for walks in both directions, although it mirrors the picture of a walk to the left.
    """
    if asked.camera_tilt_deg is not None or recording.levelled_by != SEGMENTS:
        return 0.0
    return slope_rad if asked.walks == "left" else -slope_rad


def add_lines(
    walk: RecordedWalk, lines: Mapping[str, marker_lines.Line], constants: Mapping[str, float], source: str
) -> RecordedWalk:
    """Add the angles of lines between markers (by quantity) to a walk.

    Raises ConfigError if the recording shows running, not walking.
    """
    lines, swaps = marker_lines.swap_lines_back(lines, walk.quantities[SAMPLE], walk.time_s)
    named = {walk.sources[name]: line for name, line in lines.items()}
    off, jumps = marker_lines.body_gaps(named, walk.quantities[SAMPLE], walk.time_s)
    lines = {name: (top[~off], bottom[~off]) for name, (top, bottom) in lines.items()}
    walk = select_rows(walk, ~off)
    plane = marker_lines.find_plane(lines, walk.walks)
    marker_lines.refuse_running(lines, plane, source)
    angles = {name: plane.angle(line) + constants.get(name, 0.0) for name, line in lines.items()}
    hip = next(iter(lines.values()))[0] @ plane.ahead
    changes = marker_lines.body_doubts({walk.sources[name]: line for name, line in lines.items()}, plane)
    gaps = "; ".join(text.removesuffix(".") for text in (walk.gaps, *jumps) if text)
    quantities = {**walk.quantities, **angles, HIP_OF_LINES: hip}
    doubts = (*walk.doubts, *swaps, *jumps, *changes)
    return replace(walk, quantities=quantities, lines=tuple(lines), doubts=doubts, gaps=gaps)


def select_rows(walk: RecordedWalk, rows: NDArray[np.bool_]) -> RecordedWalk:
    """Return the samples of a walk where `rows` (samples,) is true."""
    kept = {name: values[rows] for name, values in walk.quantities.items()}
    return replace(walk, time_s=walk.time_s[rows], quantities=kept)


def ends_of(recording: Recording, source: str) -> list[tuple[str, str]]:
    """Return the columns of the upper and lower end of a line for each coordinate (x, y or z) that both markers have.

    Return nothing if `source` is not a line. Raises ConfigError if a marker is missing.
    """
    # The name of a column may itself contain '>'.
    line = None if source in recording.columns else LINE.fullmatch(source)
    top, bottom = (axes_of(recording, marker) for marker in line.groups()) if line else ({}, {})
    return [(top[axis], bottom[axis]) for axis in "xyz" if axis in top and axis in bottom]


def select_span(recording: Recording, time: Array, asked: Recorded) -> NDArray[np.bool_]:
    """Find the samples in the requested part of the recording.

    Raises ConfigError if there are none.
    """
    begin = -math.inf if asked.from_s is None else asked.from_s
    end = math.inf if asked.to_s is None else asked.to_s
    # The negation keeps samples without a time, which are then reported as gaps.
    rows = ~((time < begin) | (time > end))
    if rows.size and not rows.any():
        raise ConfigError(
            f"{recording.path} has no sample from {begin:g} to {end:g} s: its times go from {np.min(time):g} to "
            f"{np.max(time):g} s.",
            "Change --from-s and --to-s.",
        )
    return np.asarray(rows)


def rows_without_gaps(
    recording: Recording, sources: Iterable[str], rows: NDArray[np.bool_]
) -> tuple[NDArray[np.bool_], str, str]:
    """Find the rows in which no source has a gap. Also describe the samples that are cut off at the ends, and the gaps
    between them.

    Raises ConfigError for a column that does not contain numbers, and if every sample has a gap.
    """
    used = list(dict.fromkeys(column for source in sources for column in columns_of(recording, source)))
    for column in used:
        refuse_problem(recording, column)
    finite = {column: np.abs(recording.columns[column]) < marker_lines.MAX_VALUE for column in used}
    whole = rows & np.all(list(finite.values()), axis=0)
    if not whole.any():
        raise ConfigError(f"{recording.path} has no sample with values of {', '.join(used)}.", "Record the walk again.")
    first, last = np.flatnonzero(whole)[[0, -1]].tolist()
    before, after = int(np.sum(rows[:first])), int(np.sum(rows[last + 1 :]))
    cut = f"{before} at the beginning and {after} at the end, which have gaps" if before or after else ""
    inside = (np.arange(rows.size) > first) & (np.arange(rows.size) < last) & rows
    gaps = dict[str, list[str]]()
    for column in used:
        if (lacking := inside & ~finite[column]).any():
            reason = f" ({recording.unseen[column]})" if column in recording.unseen else ""
            gaps.setdefault(f"{marker_lines.spell_rows(lacking)}{reason}", []).append(column)
    spelled = "; ".join(f"{', '.join(columns)} at {place}" for place, columns in gaps.items())
    return whole, cut, f"Gaps are left out: {spelled}" if gaps else ""


def refuse_problem(recording: Recording, column: str) -> None:
    """Raise ConfigError for a column that the file's reader could not use."""
    if column in recording.problems:
        raise ConfigError(
            f"{recording.path}: {column!r} cannot be used: {recording.problems[column]}.",
            "Correct the file, or name another column (--columns).",
        )


def refuse_gaps(recording: Recording, source: str, rows: NDArray[np.bool_] | slice) -> None:
    """Raise ConfigError if values of a source are missing in some of the rows."""
    for column in columns_of(recording, source):
        refuse_problem(recording, column)
        values = recording.columns[column]
        if (gaps := np.arange(values.size)[rows][~np.isfinite(values[rows])]).size:
            raise ConfigError(
                f"{recording.path}: {column!r} lacks {gaps.size} of {values.size} values, the first at sample "
                f"{gaps[0] + 1}.",
                "Fill the gaps, or cut the recording to a part without them.",
            )


def refuse_order(path: Path, time: Array) -> None:
    """Raise ConfigError unless there are at least two times, in strictly ascending order."""
    if time.size < 2:
        raise ConfigError(f"{path} has {time.size} samples, but a walk needs at least two.", "Record a longer walk.")
    if (steps_back := np.flatnonzero(np.diff(time) <= 0.0)).size:
        row = int(steps_back[0])
        raise ConfigError(
            f"{path}: time does not increase from sample {row + 1} ({time[row]:.9g} s) "
            f"to {row + 2} ({time[row + 1]:.9g} s).",
            "Sort the rows by time, and remove duplicate times.",
        )


def normalise_name(name: str) -> str:
    """Return a name in lower case, with underscores as its only separators."""
    return re.sub(r"[\s_\-]+", "_", name.strip().lower())


def match_columns(recording: Recording, named: Collection[str]) -> tuple[dict[str, str], dict[str, str]]:
    """Find the column of each quantity: the one with its name, otherwise the only one whose name ends in it.

    Also return, for each quantity that several columns could match, an error message that names them.

    named  quantities to skip, because the user names their columns
    """
    columns = {column: normalise_name(column) for column in recording.columns}
    by_ending: dict[str, list[str]] = {}
    for column, name in columns.items():
        # A column may have names of objects before that of the quantity, separated by dots in ADAMS and by slashes in
        # OpenSim.
        for start in (0, *(match.end() for match in re.finditer(r"[./]", name))):
            by_ending.setdefault(name[start:], []).append(column)
    sources = {} if recording.time_name is None or TIME in named else {TIME: recording.time_name}
    problems = {}
    for name in (name for name in QUANTITY_KINDS if name != TIME and name not in named):
        names = (normalise_name(name), normalise_name(name).removesuffix("_m"), *leg_names(name))
        found = list(dict.fromkeys(column for ending in names for column in by_ending.get(ending, ())))
        candidates = [column for column in found if columns[column] in names] or found
        if len(candidates) == 1:
            sources[name] = candidates[0]
        elif candidates:
            problems[name] = f"{recording.path}: columns {' and '.join(candidates[:3])} could each be {name!r}."
    return sources, problems


def leg_names(name: str) -> list[str]:
    """Return the name that exported models give a leg quantity, such as leg_1.angle for 'angle 1', or '' for other
    quantities.
    """
    quantity, blank, leg = name.rpartition(" ")
    return [f"leg_{leg}.{UNIT_AT_END.sub('', normalise_name(quantity))}"] if blank else []


def find_named(recording: Recording, asked: Recorded) -> dict[str, ColumnSource]:
    """Return the sources that the user names, by quantity.

    Raises ConfigError for an unknown quantity or column.
    """
    known = {normalise_name(name): name for name in QUANTITY_KINDS}
    sources = {TIME: ColumnSource(FRAME_TIME)} if FRAME_TIME in recording.columns else {}
    for quantity, text in asked.columns.items():
        name = known.get(normalise_name(quantity))
        if name is None:
            near = get_close_matches(normalise_name(quantity), known, 1)
            advice = f"Did you mean {known[near[0]]!r}?" if near else f"Available: {', '.join(QUANTITY_KINDS)}."
            raise ConfigError(f"--columns: {quantity!r} is not a quantity of a walk.", advice)
        if name not in sources:
            sources[name] = parse_source(recording, text, QUANTITY_KINDS[name])
            columns_of(recording, sources[name].column)
    return sources


def parse_source(recording: Recording, text: str, kind: str) -> ColumnSource:
    """Parse a source such as NAME, -NAME or NAME+90deg. An exact or quoted column name takes precedence.

    Raises ConfigError for a constant in an unknown unit, and for a sign before a line between two markers.
    """
    name = named_column(recording, text)
    if name in recording.columns:
        return ColumnSource(name)
    if quoted := QUOTED.fullmatch(text):
        return ColumnSource(named_column(recording, quoted[1]))
    match = SIGN_AND_OFFSET.fullmatch(text)
    if match is None or not (match[1] or match[3]):
        return ColumnSource(name)
    unit = value_in_si(match[4], kind) if match[4] else 0.0
    if unit is None:
        raise ConfigError(
            f"--columns: {text!r} adds a constant in {match[4]!r}, which is not a unit of {kind}.",
            f"Known units: {', '.join(list(UNIT_VALUES[kind])[:6])}. Quote a name that ends like this: '\"{text}\"'.",
        )
    column = named_column(recording, match[2].strip())
    if match[1] and LINE.fullmatch(column) and column not in recording.columns:
        raise ConfigError(
            f"--columns: {text!r} changes the sign of a line's angle, but the direction of the walk determines it.",
            "Leave out the sign, or state the direction with --walks.",
        )
    return ColumnSource(column, -1.0 if match[1] else 1.0, float(match[3].replace(" ", "")) * unit if match[3] else 0.0)


def named_column(recording: Recording, name: str) -> str:
    """Return the column that a user names, with or without the unit in brackets that its header may have."""
    name = name.strip()
    return name if name in recording.columns else UNIT_IN_NAME.sub("", name)


def columns_of(recording: Recording, source: str) -> list[str]:
    """Return the columns that a source needs: one, or the coordinates of both ends of a line. Raises ConfigError if one
    is missing.
    """
    if pairs := ends_of(recording, source):
        return [column for pair in pairs for column in pair]
    if source not in recording.columns:
        raise unknown_column_error(recording, source)
    return [source]


def axes_of(recording: Recording, marker: str) -> dict[str, str]:
    """Return the column of each coordinate of a marker, such as HIP.x, HIP X, HIP.PosX or HIP[:,0]."""
    pattern = re.compile(rf"{re.escape(marker)}(?:(?i:[\s._:]+(?:pos[\s._]*)?([xyz]))|\[(?::,)?([012])\])")
    axes: dict[str, str] = {}
    for column in recording.columns:
        match = pattern.fullmatch(column)
        axis = match and (match[1] or "xyz"[int(match[2])]).lower()
        first = axes.setdefault(axis, column) if axis else column
        if first != column:
            raise ConfigError(
                f"{recording.path}: columns {first} and {column} could each be a coordinate of {marker}.",
                "Rename one of them in the file.",
            )
    if len(axes) < 2:
        raise unknown_column_error(recording, f"{marker}.x")
    return axes


def unknown_column_error(recording: Recording, column: str) -> ConfigError:
    """Build the error for a column that the file lacks, with the most similar name as a suggestion."""
    near = get_close_matches(column, recording.columns, 1, 0.3)
    advice = f"Did you mean {near[0]!r}?" if near else f"Available: {', '.join(list(recording.columns)[:12])}."
    return ConfigError(f"{recording.path} has no column {column!r}.", advice)


def missing_error(recording: Recording, name: str) -> ConfigError:
    """Build the error for a quantity without a column, with the most similar name as a suggestion."""
    there = ", ".join(list(recording.columns)[:12])
    if name == TIME:
        return ConfigError(
            f"{recording.path} has no time column. Its first columns are {there}.",
            'Name it: --columns "time=NAME". For a file that counts frames, state their rate: --fps RATE.',
        )
    markers = [column.removesuffix(".x") for column in recording.columns if column.endswith(".x")]
    if markers and name.startswith("angle"):
        return ConfigError(
            f"{recording.path} has no column for {name!r}, but it has markers: {', '.join(markers[:12])}.",
            f'Name the markers at the hip and at the foot: --columns "{name}=HIP>FOOT"',
        )
    near = get_close_matches(normalise_name(name), [normalise_name(column) for column in recording.columns], 1, 0.2)
    nearest = next((column for column in recording.columns if near and normalise_name(column) == near[0]), "NAME")
    return ConfigError(
        f"{recording.path} has no column for {name!r}. It has: {there}.", f'Name it: --columns "{name}={nearest}"'
    )


def refuse_units(recording: Recording, units: Mapping[str, str], quantities: Collection[str]) -> None:
    """Raise ConfigError if a unit is stated for an unknown name or does not fit the kind it is stated for."""
    for name, unit in units.items():
        if name not in (*UNIT_VALUES, *quantities, *recording.columns):
            near = get_close_matches(name, (*UNIT_VALUES, *quantities, *recording.columns), 1)
            advice = f"Did you mean {near[0]!r}?" if near else f"Kinds: {', '.join(UNIT_VALUES)}."
            raise ConfigError(
                f"--units: {name!r} is neither a kind, a quantity nor a column of {recording.path}.", advice
            )
        if name in UNIT_VALUES and value_in_si(unit, name) is None:
            raise unknown_unit_error(recording, unit, name, name)


def unit_value(recording: Recording, name: str, source: str, kind: str, units: Mapping[str, str]) -> float:
    """Return the SI value of a column's unit, which the file or the user states.

    Raises ConfigError if they disagree.
    """
    unit = stated_unit(recording, name, source, kind, units)
    if not unit:
        raise ConfigError(
            f"{recording.path} gives no unit for {source!r} ({name}).",
            f"Add --units {kind}={SI[kind]}, or another unit: {', '.join(list(UNIT_VALUES[kind])[:6])}.",
        )
    if (value := value_in_si(unit, kind)) is None:
        raise unknown_unit_error(recording, unit, name, kind)
    return value


def stated_unit(recording: Recording, name: str, source: str, kind: str, units: Mapping[str, str]) -> str:
    """Return the unit that the file or the user states for a column, or ''.

    Raises ConfigError if they disagree.
    """
    of_user = units.get(source) or units.get(name) or units.get(kind) or rate_unit(units, kind)
    of_file = (
        recording.units.get(source) or recording.kind_units.get(kind) or unit_in_name(source, kind)
        or rate_unit(recording.kind_units, kind)
    )  # fmt: skip
    known = value_in_si(of_file, kind)
    if of_user and known is not None and value_in_si(of_user, kind) != known:
        raise ConfigError(
            f"{recording.path} states that {source!r} ({name}) is in {of_file}, but --units says {of_user}.",
            "Leave out that unit, or correct the one in the file.",
        )
    return of_user or of_file


def unknown_unit_error(recording: Recording, unit: str, name: str, kind: str) -> ConfigError:
    return ConfigError(
        f"{recording.path}: {unit!r}, stated for {name!r}, is not a known unit of {kind}.",
        f"Known units: {', '.join(list(UNIT_VALUES[kind])[:6])}. Set --units {kind}={SI[kind]}.",
    )


def states_unit(recording: Recording, column: str, units: Mapping[str, str]) -> bool:
    """Whether the user or the file states the unit of this leg angle. A unit that the file states for all its angles
    does not count.
    """
    named = ends_of(recording, column) or column in recording.units or unit_in_name(column, "angle")
    return bool(named or not units.keys().isdisjoint((column, "angle 1", "angle")))


def unit_in_name(column: str, kind: str) -> str:
    """Return the unit at the end of a column's name, such as mm in hip_mm, or '' if the name has none."""
    endings = [unit for unit in UNIT_VALUES[kind] if normalise_name(column).endswith(f"_{unit.replace('/', '_')}")]
    return max(endings, key=len, default="")


def rate_unit(units: Mapping[str, str], kind: str) -> str:
    """Derive the unit of velocities from the unit of angles or lengths, or return '' if that is not stated either."""
    unit = units.get({"rate": "angle", "speed": "length"}.get(kind, ""))
    return f"{unit}/s" if unit else ""


def places_of_ends(
    recording: Recording, pairs: Sequence[tuple[str, str]], units: Mapping[str, str]
) -> marker_lines.Line:
    """Return the positions (samples, axes) of both ends of a line in m, or as recorded if their unit is unknown."""
    scale = scale_of_line(recording, pairs, units) or {}
    top, bottom = (
        np.stack([recording.columns[column] * scale.get(column, 1.0) for column in end]).T
        for end in zip(*pairs, strict=True)
    )
    return top, bottom


def scale_of_line(
    recording: Recording, pairs: Sequence[tuple[str, str]], units: Mapping[str, str]
) -> dict[str, float] | None:
    """Return the SI values of the units of a line's columns, or None if all columns have the same unknown unit."""
    columns = [column for pair in pairs for column in pair]
    stated = {stated_unit(recording, column, column, "length", units) for column in columns}
    # The angle of a line does not depend on the unit of length, as long as both ends share it.
    if len(stated) == 1 and value_in_si(next(iter(stated)), "length") is None:
        return None
    return {column: unit_value(recording, column, column, "length", units) for column in columns}


def parse_pairs(option: str, texts: Sequence[str]) -> dict[str, str]:
    """Parse pairs such as `a=b,c=d` into a dictionary. Quotes protect commas.

    Raises ConfigError for any other form.
    """
    pairs = [pair for text in texts for pair in PAIR.findall(text) if pair.strip()]
    for pair in pairs:
        if "=" not in pair or not all(side.strip() for side in pair.split("=", 1)):
            raise ConfigError(f"{pair!r} is not of the form NAME=NAME.", f'Write {option} "a=b,c=d".')
    return {key.strip(): value.strip() for key, value in (pair.split("=", 1) for pair in pairs)}


def parse_units(texts: Sequence[str]) -> dict[str, str]:
    """Return units by kind, quantity or column. A unit without a name, such as `deg`, applies to all quantities of its
    kind.
    """
    pairs = []
    alone = {}
    for part in (part.strip() for text in texts for part in text.split(",") if part.strip()):
        kinds = [kind for kind in UNIT_VALUES if value_in_si(part, kind) is not None]
        if "=" in part:
            pairs.append(part)
        elif kinds:
            alone[kinds[0]] = part
        else:
            known = ", ".join(unit for units in UNIT_VALUES.values() for unit in units)
            raise ConfigError(f"{part!r} is not a known unit.", f"Known units: {known}.")
    return alone | parse_pairs("--units", pairs)
