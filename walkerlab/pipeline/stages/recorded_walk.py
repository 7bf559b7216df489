"""Stage `recorded-walk`: read a walk recorded elsewhere, and store it like a computed walk."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from walkerlab.config.reads import RecordedWalkConfig
from walkerlab.config.recording import RecordedFile
from walkerlab.config.schema import Config
from walkerlab.errors import ConfigError
from walkerlab.exchange.columns import LEG_QUANTITIES, WALKER_QUANTITIES, RecordedWalk, as_walk
from walkerlab.exchange.leg_angles import describe_doubts, mend_angles
from walkerlab.exchange.recording import NO_FILE, TIME, Recording, read_file, read_recording
from walkerlab.exchange.walk_in_steps import RecordedSteps, correct_tilt, divide_into_steps
from walkerlab.outcome import Outcome
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.stages.walk import TIME_LABELS, leg_labels, step_columns, variables_over_time
from walkerlab.pipeline.store import artifact
from walkerlab.pipeline.store.artifact import Damaged
from walkerlab.pipeline.store.content import Content, Group
from walkerlab.pipeline.store.files import file_digest
from walkerlab.scene.rigid import rigid_walker


def digests(config: Config) -> Mapping[str, str]:
    """Return the digest of the recording's content, so that a changed file makes results outdated."""
    assert config.recording is not None, "the stage requires the block"
    return {"recording.file": file_digest(Path(config.recording.file)) or NO_FILE}


def run(config: RecordedWalkConfig, _inputs: Mapping[str, Content], progress: Progress) -> Content:
    """Read the recording and find its steps.

    Raises ConfigError for a file that holds no walk.
    """
    block = config.recording
    assert block is not None, "the stage requires the block"
    progress.start("recorded-walk", 1)
    model = rigid_walker(config)
    walk = read_walk(block, config.slope_rad)
    if block.camera_tilt_deg == "free":
        walk = correct_tilt(walk, model)
    doubts = list(describe_doubts(walk))
    # Doubts are reported first, because noise may make the division into steps fail.
    for doubt in doubts:
        progress.note(doubt)
    steps = divide_into_steps(walk, model, block.file)
    for doubt in steps.doubts:
        progress.note(doubt)
    progress.advance()
    return content_of(block, config, walk, steps, [*doubts, *steps.doubts])


def read_walk(block: RecordedFile, slope_rad: float) -> RecordedWalk:
    """Read the quantities of a recorded walk in SI units.

    Raises ConfigError for a file that cannot be read.
    """
    if not block.file:
        raise ConfigError("recording.file: the recording has no file.", "Name one: --with FILE.", ("recording", "file"))
    path = Path(block.file)
    key = "recording", "file"
    recording = read_file(path, read_artifact, key) if path.suffix.lower() == ".h5" else read_recording(path, key)
    return mend_angles(as_walk(recording, block, slope_rad), block.file)


def read_artifact(path: Path) -> Recording:
    """Read the trajectory of a stored walk.

    Raises ConfigError if the file has none.
    """
    try:
        groups = artifact.read(path).groups
    except (Damaged, IsADirectoryError) as error:
        raise ConfigError(
            f"{path} is not a stored walk: {error}.", "Give the file simulate.h5 or contact-sim.h5 of a run."
        ) from None
    group = groups.get("trajectory")
    if group is None or "angle" not in group.variables:
        raise ConfigError(f"{path} contains no samples of a walk.", "Run it with outputs: [states, energies, forces].")
    columns = {TIME: np.asarray(group["time"], float)}
    units = {TIME: "s"}
    for name, variable in group.variables.items():
        if variable.dims[:1] != ("time",) or name not in (*LEG_QUANTITIES, *WALKER_QUANTITIES) or name == TIME:
            continue
        for index, values in enumerate(np.atleast_2d(np.asarray(variable.values, float).T)):
            column = f"{name} {index + 1}" if variable.values.ndim > 1 else name
            columns[column], units[column] = values, variable.units
    return Recording(path, columns, units)


def content_of(
    block: RecordedFile, config: RecordedWalkConfig, walk: RecordedWalk, steps: RecordedSteps, doubts: Sequence[str]
) -> Content:
    """Build the content to store, with variables named as in computed walks.

    It has energies and forces only if they were recorded.
    """
    periods = np.diff(steps.touch_time_s, prepend=0.0)
    along = np.cumsum(steps.length_m)
    columns = step_columns(steps.touch_time_s, period_s=periods, length_m=steps.length_m, touch_along_m=along)
    samples: dict[str, Any] = {
        "time": steps.time_s,
        "step": steps.step,
        "stance_leg": 2 - steps.step % 2,
        "angle": steps.angle_rad,
        "velocity": steps.velocity_rad_s,
        **resample_others(walk, steps),
    }
    speed = float(along[-1] / steps.touch_time_s[-1])
    summary = {
        "name": block.name or Path(block.file).stem,
        "outcome": Outcome.WALKED.label,
        "steps": len(periods),
        "step_periods_s": periods.tolist(),
        "step_lengths_m": steps.length_m.tolist(),
        "touch_times_s": steps.touch_time_s.tolist(),
        "touch_errors_s": steps.touch_error_s.tolist(),
        "end_time_s": float(steps.time_s[-1]),
        "speed_m_s": speed,
        "froude": speed / math.sqrt(config.gravity_m_s2 * config.walker.leg_length_m),
        "scatter_rad": steps.scatter_rad,
        "first_heel_strike_s": steps.origin_s,
        "legs_swapped": steps.swapped,
        "columns": walk.sources,
        "doubts": [*doubts],
    }
    trajectory = Group({**variables_over_time(**samples), **leg_labels()})
    return Content({"steps": Group(columns), "trajectory": trajectory}, summary)


def resample_others(walk: RecordedWalk, steps: RecordedSteps) -> dict[str, Any]:
    """Interpolate the other recorded quantities at the samples of the steps, with shape (samples,) or (samples, 2)."""
    time = walk.time_s - steps.origin_s
    besides = {}
    for name in TIME_LABELS:
        if name in ("time", "angle", "velocity"):
            continue
        both = walk.both_legs(name)
        if both is not None:
            both = both[:, ::-1] if steps.swapped else both
            besides[name] = np.column_stack([np.interp(steps.time_s, time, column) for column in both.T])
        elif name in walk.quantities:
            besides[name] = np.interp(steps.time_s, time, walk.quantities[name])
    return besides
