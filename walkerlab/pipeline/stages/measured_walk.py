"""Measured walks as `identify` reads them: a table of steps, or angles over time divided into steps."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from difflib import get_close_matches
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from walkerlab.errors import ConfigError
from walkerlab.exchange.columns import (
    RecordedWalk,
    as_walk,
    named_column,
    normalise_name,
    refuse_gaps,
    refuse_units,
    unit_value,
)
from walkerlab.exchange.leg_angles import mend_angles, read_leg_angles
from walkerlab.exchange.recording import NO_FILE, Recording, read_delimited, read_file, read_recording, value_in_si
from walkerlab.exchange.touches import sums_at_jumps
from walkerlab.exchange.walk_in_steps import PLAUSIBLE, RecordedSteps, divide_into_steps, is_plausible, sum_over_level
from walkerlab.labels import unit_by_name
from walkerlab.physics.estimation.measurements import (
    LEG_ANGLE,
    STEP_LENGTH,
    STEP_PERIOD,
    MeasuredWalk,
    split_into_steps,
)
from walkerlab.physics.estimation.prediction import OFFSET
from walkerlab.physics.solvers.system import Floats
from walkerlab.pipeline.store.files import file_digest
from walkerlab.scene.rigid import rigid_walker

if TYPE_CHECKING:
    from walkerlab.config.identify import Identify
    from walkerlab.config.reads import IdentifyConfig, RigidConfig
    from walkerlab.config.schema import Config

STEP_KINDS: Final = {"period_s": "time", "length_m": "length", "touch_angle_rad": "angle"}
"""Kind of unit of each quantity in a table of steps."""
MIN_STEPS: Final = 2
# Each step adds an unknown floor height, and computing time grows as the cube of the number of steps.
MAX_STEPS: Final = 500
DATA_KEY: Final = ("identify", "data")
SLOPE_KEY: Final = "slope_deg"
SAME_TOUCHES: Final = 0.002  # rad; smaller changes of the sum of leg angles at heel strike do not count


def digests(config: Config) -> Mapping[str, str]:
    """Return the digest of the data file's content, so that a changed file makes results outdated."""
    return {} if config.identify is None else {"identify.data": file_digest(Path(config.identify.data)) or NO_FILE}


class MeasuredFile:
    """Content of the file that an `identify` block names, as steps or angles (`block.level`). It is read only once.

    Raises ConfigError if it cannot be read.
    """

    def __init__(self, block: Identify, config: IdentifyConfig) -> None:
        self.block = block
        self.config = config
        self.path = Path(block.data)
        self.steps = read_steps(self.path, block, config.slope_rad) if block.level == "steps" else None
        if self.steps is None:
            self.walk, self.resolution = read_angles(block, config.slope_rad)
            self.find_steps = cache(partial(self.steps_of, config))

    def steps_of(self, config: RigidConfig, touch_sum_rad: float) -> RecordedSteps:
        """Find the steps in the recorded walk of a config's walker."""
        return divide_into_steps(self.walk, rigid_walker(config), self.block.data, touch_sum_rad)

    def divisions(self) -> Iterator[MeasuredWalk]:
        """Yield the walk divided into steps.

        There is more than one division only if slope or sensor offset is estimated: heel strikes depend on both.
        Raises ConfigError for a file without a walk.
        """
        if self.steps is not None:
            yield refuse_count(self.path, self.steps)
            return
        problem = None
        divided = False
        for touch_sum_rad in touch_sums(self.walk, self.block, self.config):
            try:
                measured = self.divide_at(touch_sum_rad)
            except ConfigError as error:
                problem = problem or error
            else:
                divided = True
                yield refuse_count(self.path, measured)
        if problem is not None and not divided:
            raise problem

    def divide_at(self, touch_sum_rad: float, config: RigidConfig | None = None) -> MeasuredWalk:
        """Divide the angles into steps, at instants when the sum of the leg angles is `touch_sum_rad`.

        config  config of the walker, or None for that of the file
        """
        steps = self.find_steps(touch_sum_rad) if config is None else self.steps_of(config, touch_sum_rad)
        if steps.touch_time_s.size < MIN_STEPS:
            raise ConfigError(
                f"{self.path} has 1 complete step; at least {MIN_STEPS} are needed.", "Record a longer walk."
            )
        # The samples are taken from the recording, because `steps` has interpolated ones at heel strikes.
        angles = read_leg_angles(self.walk)[:, ::-1] if steps.swapped else read_leg_angles(self.walk)
        touches = np.append(0.0, steps.touch_time_s)
        measured = split_into_steps(self.walk.time_s - steps.origin_s, angles, touches, touch_sum_rad)
        return replace(measured, resolution={LEG_ANGLE: self.resolution}, first_leg=2 if steps.swapped else 1)

    def doubts(self) -> tuple[str, ...]:
        """Describe, in a sentence for each finding, what is odd about the angles and how it was handled."""
        if self.steps is not None:
            return ()
        try:
            return (*self.walk.doubts, *self.find_steps(0.0).doubts)
        except ConfigError:
            return self.walk.doubts


def refuse_count(path: Path, measured: MeasuredWalk) -> MeasuredWalk:
    if measured.count > MAX_STEPS:
        raise ConfigError(
            f"{path} has {measured.count} steps; at most {MAX_STEPS} are fitted at once.", "Cut it into shorter walks."
        )
    return measured


def touch_sums(walk: RecordedWalk, block: Identify, config: RigidConfig) -> Iterator[float]:
    """Yield candidates for the sum of the leg angles at heel strike (rad, from the slope's normal), starting with 0."""
    yield 0.0
    if not (SLOPE_KEY in block.fit or SLOPE_KEY in block.prior or OFFSET in block.sensors):
        return
    sums = sums_at_jumps(walk.time_s, read_leg_angles(walk), partial(sum_over_level, rigid_walker(config)))
    yield from (each for each in sums if each)


def read_angles(block: Identify, slope_rad: float) -> tuple[RecordedWalk, float]:
    """Read the recording in the block's file. Return it and the smallest decimal place of its angles (rad).

    The decimal place is 0 for angles that are computed from markers.
    """
    recording = read_recording(Path(block.data), DATA_KEY)
    if recording.levelled_by and block.camera_tilt_deg is None and SLOPE_KEY in block.keys:
        raise ConfigError(
            f"{block.data} is from {recording.levelled_by}, which rotates its data until the floor is level. So "
            "the angles from the vertical depend on the slope, which is to be estimated.",
            "Give --camera-tilt floor, or --camera-tilt 0 if the recording's floor_angle was 0.",
            ("identify", "camera_tilt_deg"),
        )
    walk = mend_angles(as_walk(recording, block, slope_rad), block.data)
    source = walk.sources["angle 1"]
    written = recording.columns.get(source)
    if written is None:
        return walk, 0.0
    unit = unit_value(recording, "angle 1", source, "angle", block.units)
    return walk, unit * smallest_decimal(written[np.isfinite(written)])


def smallest_decimal(values: Floats) -> float:
    """Return the smallest decimal place that the values use: 0.001 for 0.72 and 0.725, 1 for whole numbers."""
    return next((10.0**-index for index in range(16) if np.array_equal(np.round(values, index), values)), 0.0)


def read_steps(path: Path, block: Identify, slope_rad: float) -> MeasuredWalk:
    """Read a table with one row per step: `period_s` and, if measured, `length_m` and `touch_angle_rad`."""
    table = read_file(path, read_delimited, DATA_KEY)
    refuse_units(table, block.units, STEP_KINDS)
    for key in ("fps", "from_s", "to_s", "min_likelihood", "walks"):
        if getattr(block, key) is not None:
            advice = f"Leave out {key}, or give angles (--level angles)."
            raise ConfigError(f"identify.{key}: a table of steps has no samples.", advice, ("identify", key))
    for name in block.columns.keys() - STEP_KINDS.keys():
        raise ConfigError(f"--columns: {name!r} is not a quantity of a step.", f"Choose from {', '.join(STEP_KINDS)}.")
    columns = {name: column for name in STEP_KINDS if (column := read_column(table, name, block)) is not None}
    if "period_s" not in columns:
        near = get_close_matches("period_s", table.columns, 1, 0.3) or list(table.columns)[:1]
        advice = f'Name the column of periods: --columns "period_s={near[0]}". Angles over time need --level angles.'
        raise ConfigError(f"{path} has no column period_s; it has: {', '.join(list(table.columns)[:8])}.", advice)
    values = {name: in_si for name, (in_si, _) in columns.items()}
    period = values["period_s"]
    if period.size < MIN_STEPS:
        raise ConfigError(f"{path} has {period.size} step; at least {MIN_STEPS} are needed.", "Measure more steps.")
    # On a treadmill, the length of a step is the distance that the belt moves from touch to touch.
    if block.belt_speed_m_s and "length_m" not in values:
        values["length_m"] = block.belt_speed_m_s * period
    if "touch_angle_rad" in values:
        tilt = slope_rad if block.camera_tilt_deg == "floor" else math.radians(float(block.camera_tilt_deg or 0.0))
        values["touch_angle_rad"] = values["touch_angle_rad"] - tilt
    quantities = dict(zip(STEP_KINDS, (STEP_PERIOD, STEP_LENGTH, LEG_ANGLE), strict=True))
    resolution = {quantities[name]: smallest for name, (_, smallest) in columns.items()}
    lengths, angles = values.get("length_m"), values.get("touch_angle_rad")
    return MeasuredWalk(period, lengths, angles, resolution=resolution, first_leg=block.first_leg)


def read_column(table: Recording, name: str, block: Identify) -> tuple[Floats, float] | None:
    """Return a quantity (steps,) and its smallest decimal place, both in SI units, or None if the table has no column
    for it.

    Raises ConfigError for gaps and bad values, and for a column such as length_mm, whose unit is another one.
    """
    by_name = {normalise_name(column): column for column in table.columns}
    stem = name.rpartition("_")[0]
    source = block.columns.get(name) or by_name.get(name) or by_name.get(stem)
    if source is None:
        units = {key: key.removeprefix(f"{stem}_") for key in by_name if key.startswith(f"{stem}_")}
        other = next((key for key, unit in units.items() if value_in_si(unit, STEP_KINDS[name])), None)
        if other is None:
            return None
        stated = f"{name}={by_name[other]} [{units[other]}]"
        advice = f'Name the column with its unit: --columns "{stated}". Otherwise rename or remove it.'
        raise ConfigError(f"{table.path} has a column {by_name[other]!r}, but no {name}.", advice)
    source = named_column(table, source)
    refuse_gaps(table, source, slice(None))
    values = table.columns[source]
    if name != "touch_angle_rad" and (bad := np.flatnonzero(values <= 0.0)).size:
        raise ConfigError(
            f"{table.path}: {source!r} is {values[bad[0]]:g} in step {bad[0] + 1}; it must be above 0.",
            "Correct it, or leave out the step and those before it.",
        )
    unit = unit_value(table, name, source, STEP_KINDS[name], block.units)
    in_si = np.asarray(values * unit)
    refuse_sizes(table, name, source, in_si)
    return in_si, smallest_decimal(values) * unit


def refuse_sizes(table: Recording, name: str, source: str, values: Floats) -> None:
    """Raise ConfigError if one of the `values` (steps,), in SI units, is impossible for a step."""
    angle = name == "touch_angle_rad"
    possible = [abs(value) <= math.pi if angle else is_plausible(value) for value in values.tolist()]
    if all(possible):
        return
    step = possible.index(False)
    unit = unit_by_name(name)
    allowed = "up to half a turn" if angle else f"{PLAUSIBLE[0]:g} to {PLAUSIBLE[1]:g} {unit}"
    raise ConfigError(
        f"{table.path}: {source!r} is {values[step]:.3g} {unit} in step {step + 1}; possible: {allowed}.",
        f"Correct it, or give its unit: --units {name}=UNIT.",
    )
