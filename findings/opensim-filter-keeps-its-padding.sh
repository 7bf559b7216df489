#!/usr/bin/env bash
# OpenSim 4.6: TableUtilities.filterLowpass with padding returns a table twice as long, that starts before the measurement.
#
# What one would guess: padData=True extends the data by reflection, filters, and cuts the extension off again, as
# scipy.signal.filtfilt does, so times and rows are those of before.
# What happens: the reflected data stay. A table of 201 rows from 0 to 2 s has 401 rows from -1 to 3 s: half of the heel
# strikes that are found in it were never measured, and row k is another instant. With uneven times the table is also
# resampled, at the smallest interval, with padding or without.
# Instead: table.trim(first, last) with the times of before.
# Versions: opensim 4.6, November 2026.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check opensim==4.6 numpy==2.4.6
cat > padding.py <<'EOF'
import numpy as np
import opensim

opensim.Logger.setLevelString("off")


def filtered_times(times, has_padding):
    table = opensim.TimeSeriesTable()
    table.setColumnLabels(["hip"])
    for time in times:
        table.appendRow(float(time), opensim.RowVector(1, float(np.sin(2 * np.pi * time))))
    opensim.TableUtilities.filterLowpass(table, 6.0, has_padding)
    return np.array(table.getIndependentColumn())


EVEN = np.arange(201) / 100
UNEVEN = np.concatenate([np.arange(100) / 100, 1 + np.arange(51) / 50])
CASES = (
    ("even times", EVEN, False, (201, 0.0, 2.0)),
    ("even times, padded", EVEN, True, (401, -1.0, 3.0)),
    ("uneven times", UNEVEN, False, (201, 0.0, 2.0)),
    ("uneven times, padded", UNEVEN, True, (401, -1.0, 3.0)),
)
print("opensim", opensim.GetVersion())
for name, times, has_padding, found in CASES:
    after = filtered_times(times, has_padding)
    print(f"{name}: expected {len(times)} rows from {times[0]} to {times[-1]} s,", end=" ")
    print(f"actual {len(after)} rows from {after[0]:.2f} to {after[-1]:.2f} s")
    assert len(after) == found[0], "behaviour has changed"
    assert np.allclose((after[0], after[-1]), found[1:], atol=1e-6), "behaviour has changed"
EOF
venv/bin/python padding.py
