#!/usr/bin/env bash
# movement 0.15.0 reads poses of an NWB file without their times, their start and their scale.
#
# What one would guess: NWB says when each sample was taken (`timestamps`, or `rate` and `starting_time`) and what the numbers
# mean: value * conversion + offset in `unit`. A reader of that format keeps all of it.
# What happens:
#   timestamps     only the median interval is kept: a film of variable rate, 0.467 s long, becomes one of 0.603 s
#   starting_time  dropped: samples from 2.00 s on begin at 0, so they no longer match forces or events of the same file
#   conversion     not applied: positions stored in mm with conversion=0.001 and unit='meters' are 1,000 times too large
# Nothing is printed. pynwb alone gives all of these.
# Instead: dataset.assign_coords(time=series.timestamps[:]) and position * series.conversion, with the series from pynwb.
# Versions: movement 0.15.0 (the last for Python 3.11), ndx-pose 0.4.0, pynwb 4.2.0, November 2026.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
# Both packages bring editors and video codecs that reading of NWB does not need.
venv/bin/pip install -q --disable-pip-version-check --no-deps movement==0.15.0 sleap-io==0.9.5
venv/bin/pip install -q --disable-pip-version-check ndx-pose==0.4.0 pynwb==4.2.0 xarray==2026.9.0 pandas==3.1.1 scipy==1.17.1 \
    numpy==2.4.6 loguru==0.7.3 attrs==26.1.0 PyYAML==6.0.4 tqdm==4.70.1 imageio==2.38.1 imageio-ffmpeg==0.8.1 \
    lazy_loader==0.6 simplejson==4.3.0
cat > poses.py <<'EOF'
import datetime
from importlib.metadata import version

import numpy as np
from movement.io import load_poses
from ndx_pose import PoseEstimation, PoseEstimationSeries, Skeleton, Skeletons
from pynwb import NWBHDF5IO, NWBFile
from pynwb.file import Subject

STORED = np.column_stack([np.arange(10.0) * 100, np.zeros(10)])


def write(name, **meaning):
    """Write positions of one foot; return the times and metres that pynwb reads."""
    start = datetime.datetime(2026, 1, 1, tzinfo=datetime.UTC)
    file = NWBFile(session_description="walk", identifier=name, session_start_time=start)
    file.subject = Subject(subject_id="walker", species="Homo sapiens")
    skeleton = Skeleton(name="walker", nodes=["foot"], subject=file.subject)
    foot = PoseEstimationSeries(
        name="foot", description="d", data=STORED, unit="meters", reference_frame="origin", confidence=np.ones(10), **meaning
    )
    poses = PoseEstimation(
        name="PoseEstimation",
        pose_estimation_series=[foot],
        original_videos=["walk.mp4"],
        dimensions=np.array([[640, 480]], dtype="uint16"),
        devices=[file.create_device(name="camera")],
        skeleton=skeleton,
    )
    behavior = file.create_processing_module(name="behavior", description="poses")
    behavior.add(Skeletons(skeletons=[skeleton]))
    behavior.add(poses)
    with NWBHDF5IO(name, "w") as io:
        io.write(file)
    with NWBHDF5IO(name, "r") as io:
        series = io.read().processing["behavior"]["PoseEstimation"]["foot"]
        return np.array(series.get_timestamps()), np.array(series.get_data_in_units())


print({name: version(name) for name in ("movement", "ndx-pose", "pynwb")})
intervals = np.concatenate([np.full(4, 0.033), np.full(5, 0.067)])
times, _ = write("variable.nwb", timestamps=np.concatenate([[0], np.cumsum(intervals)]))
found = load_poses.from_nwb_file("variable.nwb").time.values
print(f"timestamps: expected 0 to {times[-1]:.3f} s, actual 0 to {found[-1]:.3f} s")
assert np.isclose(times[-1], 0.467) and np.isclose(found[-1], 0.603, atol=1e-3), "behaviour has changed"

times, _ = write("late.nwb", rate=50.0, starting_time=2.0)
found = load_poses.from_nwb_file("late.nwb").time.values
print(f"starting_time: expected the first sample at {times[0]:.2f} s, actual {found[0]:.2f} s")
assert times[0] == 2.0 and found[0] == 0.0, "behaviour has changed"

_, metres = write("millimetres.nwb", rate=50.0, conversion=0.001)
found = load_poses.from_nwb_file("millimetres.nwb").position.values.squeeze()
print(f"conversion: expected {np.ptp(metres):.1f} m from the first to the last sample, actual {np.ptp(found):.1f}")
assert np.isclose(np.ptp(metres), 0.9) and np.isclose(np.ptp(found), 900), "behaviour has changed"
EOF
venv/bin/python -W ignore poses.py
